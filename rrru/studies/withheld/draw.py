"""Virtual robots whose cause of the gap is drawn and then withheld from the diagnosis. Lengths mm, angles rad, times s.

An effect's strength is its gap after the calibration, rms distance without noise, over the rms distance of the noise.
It is drawn and the effect's coordinates are scaled to it by simulating the robot: the scale from the first-order model,
then two simulations.
"""

from dataclasses import replace

import numpy as np

from rrru.campaign.trajectories import from_config
from rrru.effects.library import EFFECTS
from rrru.errors import UnreachableError
from rrru.plant.virtual_robot import VirtualRobot
from rrru.robots import singularity
from rrru.robots.first_order import FirstOrder
from rrru.seeds import stream
from rrru.studies.withheld.outside import OUTSIDE
from rrru.studies.withheld.robots import NOISE_RMS_MM, PASSES, Acting, Robot, true_gap_mm

TRUTHS = {"none": 0.15, "one": 0.55, "two": 0.2, "outside": 0.1}
WEAKEST, STRONGEST, CLEAR = 0.1, 10.0, 2.0
_ANGLE_SD_RAD, _LENGTH_SD_MM = 0.002, 0.5
_SAFE = 0.1
_DRAWS = 20


def draw_labelled(seed, number, mechanism):
    """Robot `number` of the label-withheld check: nothing, one effect, two, or a cause from outside."""
    generator = stream(seed, "withheld", number)
    robot = _bare(f"label_{number:04d}", generator, mechanism)
    truth = generator.choice(list(TRUTHS), p=list(TRUTHS.values()))
    if truth == "none":
        return robot
    names = generator.choice(
        list(OUTSIDE if truth == "outside" else EFFECTS), 2 if truth == "two" else 1, replace=False
    )
    for _ in range(_DRAWS):
        acting = tuple(
            _draw_acting(robot, str(name), truth == "one", (WEAKEST, STRONGEST), generator, mechanism) for name in names
        )
        drawn = replace(robot, acting=acting)
        # two causes may lose a pose together that neither loses alone
        if true_gap_mm(drawn, mechanism) is not None:
            return drawn
    raise UnreachableError(f"{robot.name}: {' and '.join(names)} lose a pose in {_DRAWS} draws")


def draw_single(seed, effect, number, mechanism):
    """Robot `number` of the effect-withheld check: that effect alone, strong enough to be seen."""
    generator = stream(seed, "withheld", effect, number)
    robot = _bare(f"effect_{effect}_{number:04d}", generator, mechanism)
    return replace(robot, acting=(_draw_acting(robot, effect, True, (CLEAR, STRONGEST), generator, mechanism),))


def fresh(robot, seed, mechanism):
    """The same robot on other lines and another spiral of the same region."""
    return replace(robot, trajectories=_trajectories(stream(seed, "withheld", "fresh", robot.name), mechanism))


def _bare(name, generator, mechanism):
    """A robot with its campaign and errors drawn, and nothing acting."""
    deviations = np.repeat([_ANGLE_SD_RAD, _LENGTH_SD_MM], [3, 4]) * generator.standard_normal(7)
    inside = mechanism.parameters.inside(deviations)
    return Robot(name, str(generator.choice(list(PASSES))), _trajectories(generator, mechanism), tuple(inside.tolist()))


def _trajectories(generator, mechanism):
    """Seven lines and a spiral, as an entry of the configuration's `trajectories`, clear of both singularities."""
    while True:
        step, height = generator.uniform(28.0, 45.0), generator.uniform(620.0, 680.0)
        start, end, x, y = generator.uniform([-640.0, -60.0, -40.0, -40.0], [-560.0, 40.0, 40.0, 40.0])
        inner, outer, top, bottom, turn = generator.uniform(
            [30.0, 240.0, 550.0, 730.0, 0.0], [70.0, 300.0, 590.0, 780.0, 360.0]
        )
        section = {
            "lines": {
                "start_mm": [start, 0.0, height],
                "end_mm": [end, 0.0, height],
                "offsets_y_mm": [0.0, *(sign * k * step for k in (1, 2, 3) for sign in (1.0, -1.0))],
                "points": 26,
            },
            "spiral": {
                "centre_mm": [x, y],
                "radius_mm": [inner, outer],
                "z_mm": [top, bottom],
                "turns": generator.uniform(4.0, 5.5),
                "points": 40,
                "start_deg": turn,
            },
        }
        if _safe(section, mechanism):
            return section


def _safe(section, mechanism):
    """Whether the trajectories stay clear of both singularities."""
    points = np.concatenate([trajectory.curve(np.linspace(0.0, 1.0, 100)) for trajectory in from_config(section)])
    theta = mechanism.inverse(points)
    measures = (
        singularity.translational_measure(mechanism, points, theta),
        singularity.constraint_measure(mechanism, points, theta),
    )
    return bool(np.isfinite(theta).all() and np.min(measures) > _SAFE)


def _draw_acting(robot, name, single, strengths, generator, mechanism):
    """A cause of that name at a strength drawn log-uniform between two; single: it may sit on one leg alone, as a third
    of them do.

    Draws that would break a parameter's bounds or lose a pose are made again, the strength only where no draw can have
    it.
    """
    coordinates = (EFFECTS[name] if name in EFFECTS else OUTSIDE[name]).coordinates
    for _ in range(_DRAWS):
        strength = float(np.exp(generator.uniform(*np.log(strengths))))
        for _ in range(_DRAWS):
            acting = _to_strength(robot, _draw_direction(name, coordinates, single, strength, generator), mechanism)
            if acting is not None:
                return acting
    raise UnreachableError(
        f"{robot.name}: no {name} of strength {strengths[0]:g} to {strengths[1]:g} within its bounds"
    )


def _draw_direction(name, coordinates, single, strength, generator):
    """A cause with its shape, legs and the ratios of its coordinates drawn, not yet of that strength."""
    draw = coordinates.typical * generator.standard_normal(len(coordinates))
    draw = np.where(coordinates.positive, np.abs(draw), draw)
    shape = _draw_shape(coordinates.shapes, generator)
    per_leg = set(coordinates.legs.tolist()) == {1, 2, 3}
    leg = int(generator.integers(1, 4)) if single and per_leg and generator.random() < 1.0 / 3.0 else 0
    if leg:
        draw = np.where(coordinates.legs == leg, draw, 0.0)
    return Acting(name, shape, tuple(draw.tolist()), leg, strength)


def _draw_shape(shapes, generator):
    """Values of what is no coordinate: one of two that the library tries, else between the least and the largest that
    it tries.
    """
    result = {}
    for key in shapes[0]:
        known = sorted({float(shape[key]) for shape in shapes})
        if len(known) <= 2:
            result[key] = float(generator.choice(known))
        elif known[0] > 0.0:
            result[key] = float(np.exp(generator.uniform(*np.log([known[0], known[-1]]))))
        else:
            result[key] = float(generator.uniform(known[0], known[-1]))
    return result


def _to_strength(robot, acting, mechanism):
    """The cause scaled to its strength, or None where that breaks its bounds or loses a pose."""
    first = _first_order_gap_mm(robot, acting, mechanism)
    if not first > 0.0:
        return None
    acting = acting.scaled(acting.strength * NOISE_RMS_MM / first)
    for _ in range(2):
        gap = true_gap_mm(replace(robot, acting=(acting,)), mechanism)
        if gap is None or gap == 0.0:
            return None
        acting = acting.scaled(acting.strength * NOISE_RMS_MM / gap)
    gap = true_gap_mm(replace(robot, acting=(acting,)), mechanism)
    return None if gap is None else replace(acting, strength=float(gap / NOISE_RMS_MM))


def _first_order_gap_mm(robot, acting, mechanism):
    """Rms distance that the calibration would leave of a cause, to first order."""
    motion = VirtualRobot(mechanism=mechanism).motion(robot.plan, mechanism.inverse)
    moved = (
        FirstOrder(mechanism, motion.position_mm, motion.drive)
        .move(acting.law.contribute(motion, acting.values))
        .ravel()
    )
    base = mechanism.parameter_jacobian(motion.position_mm, motion.drive).reshape(moved.size, -1)
    basis, _ = np.linalg.qr(base)
    return float(np.sqrt(((moved - basis @ (basis.T @ moved)) ** 2).sum() / len(motion)))
