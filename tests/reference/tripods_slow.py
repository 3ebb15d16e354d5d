"""The 3-PTT and the rotary Delta written out from their vector loops with scipy's general solvers: nothing is shared
with the package.
"""

import numpy as np
from scipy.optimize import fsolve, root
from scipy.spatial.transform import Rotation


def trilaterate(centres, radii):
    """Lower of the two points (3,) at the distances `radii` (3,) from `centres` (3, 3), z up; raises ValueError where
    there is none.

    Differences of the sphere equations are linear: their solution of least norm plus a multiple of the null direction
    meets the first sphere.
    """
    centres, radii = np.asarray(centres, dtype=float), np.asarray(radii, dtype=float)
    rows = 2.0 * (centres[1:] - centres[0])
    right = radii[0] ** 2 - radii[1:] ** 2 + (centres[1:] ** 2).sum(axis=1) - (centres[0] ** 2).sum()
    start = np.linalg.lstsq(rows, right, rcond=None)[0]
    null = np.linalg.svd(rows)[2][-1]
    offset = start - centres[0]
    multiples = np.roots([1.0, 2.0 * null @ offset, offset @ offset - radii[0] ** 2])
    if np.iscomplex(multiples).any():
        raise ValueError("the spheres do not meet")
    return min((start + multiple * null for multiple in multiples), key=lambda point: point[2])


def ptt3_forward(slider, length, radius_difference, inclination, guess):
    """Position (3,) of a 3-PTT: scipy's root on the three link lengths, each leg drawn in its own plane and turned by
    its azimuth.
    """
    ends = []
    for leg in range(3):
        in_plane = [radius_difference + slider[leg] * np.cos(inclination), 0.0, slider[leg] * np.sin(inclination)]
        ends.append(Rotation.from_euler("z", 120.0 * leg, degrees=True).apply(in_plane))
    solution = root(lambda point: [np.linalg.norm(point - end) - length for end in ends], guess, tol=1e-13)
    assert np.abs(solution.fun).max() < 1e-9
    return solution.x


def upright_carriages(position, length, radius):
    """Carriage heights (3,) of a linear delta: each stands above the platform by the upright side of its link's
    triangle.
    """
    azimuth = np.radians([0.0, 120.0, 240.0])
    across = np.hypot(radius * np.cos(azimuth) - position[0], radius * np.sin(azimuth) - position[1])
    return position[2] + np.sqrt(length**2 - across**2)


def _move(rotation_vector, shift):
    """Homogeneous matrix."""
    result = np.eye(4)
    result[:3, :3] = Rotation.from_rotvec(rotation_vector).as_matrix()
    result[:3, 3] = shift
    return result


def ptt3_bars(slider, feet, inclination, lengths, guess, dimensions=(300.0, 60.0, 60.0)):
    """Platform position (3,) and rotation vector (3,) of a 3-PTT of six bars whose feet (3 legs, 6) are displaced.

    feet: shift in mm and rotation vector; rails and what their carriages hold go with them. lengths: of the bars (3
    legs, 2); dimensions: R, r and the distance of a leg's bars.
    """
    base, platform, spacing = dimensions
    pairs = []
    for leg in range(3):
        azimuth = _move([0.0, 0.0, np.radians(120.0 * leg)], np.zeros(3))
        way = slider[leg] * np.array([np.cos(inclination), 0.0, np.sin(inclination)])
        carriage = azimuth @ _move(np.zeros(3), [base, 0.0, 0.0]) @ _move(feet[leg][3:], feet[leg][:3])
        for share, length in zip((-0.5, 0.5), lengths[leg], strict=True):
            start = (carriage @ [way[0], share * spacing, way[2], 1.0])[:3]
            pairs.append((start, (azimuth @ [platform, share * spacing, 0.0, 1.0])[:3], length))
    return _on_bars(pairs, guess)


def delta_bars(theta, beta, lengths, guess, dimensions=(375.0, 125.0, 60.0, 120.0), depth=0.0):
    """Platform position (3,) and rotation vector (3,) of a Delta of six bars (3 arms, 2): fsolve on their lengths.

    dimensions: l1, base's radius less the platform's, the platform's, distance of an arm's bars; the second bar stands
    where the tangent points.
    """
    arm, base, platform, spacing = dimensions
    pairs = []
    for leg in range(3):
        out, side = delta_arm(beta[leg], 0.0), np.array([-np.sin(beta[leg]), np.cos(beta[leg]), 0.0])
        for share, length in zip((-0.5, 0.5), lengths[leg], strict=True):
            elbow = (base + platform) * out + arm * delta_arm(beta[leg], theta[leg]) + np.array([0.0, 0.0, depth])
            pairs.append((elbow + share * spacing * side, platform * out + share * spacing * side, length))
    return _on_bars(pairs, guess)


def _on_bars(bars, guess):
    """Position (3,) and rotation vector (3,) of a platform on six bars: start, end on the platform, and length each."""

    def equations(unknown):
        turn = Rotation.from_rotvec(unknown[3:] / 300.0)
        return [np.linalg.norm(unknown[:3] + turn.apply(end) - start) - length for start, end, length in bars]

    solution = fsolve(equations, np.concatenate([guess, np.zeros(3)]), xtol=1e-12)
    assert np.abs(equations(solution)).max() < 1e-9
    return solution[:3], solution[3:] / 300.0


def delta_arm(beta, angle):
    """Direction u (3,) of a drive arm: e_2 turned by -angle about x, then by beta - pi/2 about z (paper C, eq. 2)."""
    return (Rotation.from_euler("z", beta - np.pi / 2.0) * Rotation.from_euler("x", -angle)).apply([0.0, 1.0, 0.0])


def delta_close(theta, beta, arm, link, base, depth, guess):
    """Position (3,) and links' directions (3 legs, 3) of a Delta: root of its vector loops in 12 unknowns.

    r = a_i + l1 u_i + l2 w_i with unit w_i (paper C, eq. 1).
    """
    starts = []
    for leg in range(3):
        foot = base * delta_arm(beta[leg], 0.0) + np.array([0.0, 0.0, depth])
        starts.append(foot + arm * delta_arm(beta[leg], theta[leg]))

    def loops(unknown):
        position, directions = unknown[:3], unknown[3:].reshape(3, 3)
        gaps = [start + link * direction - position for start, direction in zip(starts, directions, strict=True)]
        return np.concatenate([*gaps, link * ((directions**2).sum(axis=1) - 1.0)])

    first = np.concatenate([guess, np.ravel((guess - np.array(starts)) / link)])
    solution = root(loops, first, tol=1e-13)
    assert np.abs(solution.fun).max() < 1e-8
    return solution.x[:3], solution.x[3:].reshape(3, 3)


def delta_zero_jacobian(theta, beta, arm, directions):
    """Derivative (3, 3) of the position by the drive angles (paper C, eqs. 3 to 6).

    w_i . dr = l1 w_i . Rot(z, beta_i - pi/2) Q_x Rot(x, -theta_i) e_2 dtheta_i
    """
    turn_down = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    right = np.zeros((3, 3))
    for leg in range(3):
        rate = turn_down @ Rotation.from_euler("x", -theta[leg]).apply([0.0, 1.0, 0.0])
        right[leg, leg] = arm * directions[leg] @ Rotation.from_euler("z", beta[leg] - np.pi / 2.0).apply(rate)
    return np.linalg.solve(directions, right)
