"""A six-axis arm of a made-up user, simulated by plain matrices: no code of the package, no closed form."""

import numpy as np
import pandas as pd
from scipy.spatial.transform import Rotation

# d, a in mm, alpha, theta in degrees, mass in kg, its centre in mm in the frame after the joint
ROWS = (
    (380.0, 60.0, -90.0, 0.0, 14.0, (-20.0, 60.0, 0.0)),
    (0.0, 420.0, 0.0, -90.0, 11.0, (-200.0, 0.0, 60.0)),
    (0.0, 40.0, -90.0, 0.0, 6.0, (-10.0, 0.0, 30.0)),
    (435.0, 0.0, 90.0, 0.0, 3.2, (0.0, -150.0, 0.0)),
    (0.0, 0.0, -90.0, 0.0, 1.6, (0.0, 0.0, 10.0)),
    (85.0, 0.0, 0.0, 0.0, 1.0, (0.0, 0.0, 30.0)),
)
RANGES_DEG = ((-150, 150), (-60, 80), (-100, 50), (-160, 160), (-110, 110), (-180, 180))
LOST_DEG, COMPLIANCE = 2.0, (2e-6, 7e-6, 1.1e-5, 2e-5, 0.0, 0.0)
JOINTS = [f"J{k}" for k in range(1, 7)]


def robot():
    """Its entry in `robots:`."""
    names = ("d_mm", "a_mm", "alpha_deg", "theta_deg", "mass_kg", "com_mm")
    ranges = [{"range_deg": list(limits), "home_deg": 10.0 + 30.0 * (k == 4)} for k, limits in enumerate(RANGES_DEG)]
    return {"dh": [dict(zip(names, (*row[:5], [*row[5]]), strict=True)) | ranges[k] for k, row in enumerate(ROWS)]}


def section(**changes):
    """Its data set in `real: sets:`."""
    angles = {"rotation": ["A", "B", "C"], "rotation_unit": "deg", "sequence": "ZYX"}
    return {
        "files": "arm/log_*.csv",
        "robot": "arm",
        "angle_unit": "deg",
        "joints": {f"q{k}_rad": f"J{k}" for k in range(1, 7)},
        "readings": {"tcp": {"position": ["X", "Y", "Z"]} | angles},
    } | changes


def log(count, seed=1, noise_mm=0.01):
    """A measured file's columns: joints and angles in degrees, positions in mm in a tracker's frame."""
    generator, poses = np.random.default_rng(seed), []
    errors = np.random.default_rng(7)
    lengths, offsets = errors.normal(0.0, 0.25, (6, 2)), errors.normal(0.0, 6e-4, 6)
    offsets[3] += np.radians(LOST_DEG)
    tracker = _placement(Rotation.from_rotvec([0.02, -0.015, 1.9]), (1800.0, -2300.0, 450.0))
    tool = _placement(Rotation.from_euler("xyz", [0.3, -0.4, 1.0]), (35.0, -20.0, 140.0))
    while len(poses) < count:
        commanded = np.radians([generator.uniform(*limits) for limits in RANGES_DEG])
        bent = commanded + offsets
        for _ in range(3):
            bent = commanded + offsets + COMPLIANCE * _torques(_frames(bent, lengths))
        last = _frames(bent, lengths)[-1]
        if last[2, 3] < 50.0:
            continue
        end = tracker @ last @ tool
        place = end[:3, 3] + generator.normal(0.0, noise_mm, 3)
        poses.append([*np.degrees(commanded), *place, *Rotation.from_matrix(end[:3, :3]).as_euler("ZYX", degrees=True)])
    return pd.DataFrame(poses, columns=[*JOINTS, *"XYZABC"])


def _placement(turn, place):
    """Placement (4, 4) of a rotation and a position."""
    result = np.eye(4)
    result[:3, :3], result[:3, 3] = turn.as_matrix(), place
    return result


def _frames(angles, lengths):
    """Placements (4, 4) of the base and after every joint."""
    result = [np.eye(4)]
    for angle, (d, a, alpha, theta, *_), (longer, wider) in zip(angles, ROWS, lengths, strict=True):
        turn = Rotation.from_euler("z", angle + np.radians(theta))
        tilt = Rotation.from_euler("x", np.radians(alpha))
        place = turn.as_matrix() @ (a + wider, 0.0, d + longer)
        result.append(result[-1] @ _placement(turn * tilt, place))
    return result


def _torques(frames):
    """Torques (6,) of gravity about the joints in N m."""
    result = np.zeros(6)
    for joint in range(6):
        for link in range(joint, 6):
            centre = (frames[link + 1] @ (*ROWS[link][5], 1.0))[:3] - frames[joint][:3, 3]
            weight = (0.0, 0.0, -9.80665 * ROWS[link][4])
            result[joint] += frames[joint][:3, 2] @ np.cross(1e-3 * centre, weight)
    return result
