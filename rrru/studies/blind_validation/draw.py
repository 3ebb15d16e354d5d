"""Virtual robots whose cause of the gap is drawn and then withheld from the diagnosis. Lengths mm, angles rad, times s.

An effect's strength is its gap after the calibration, rms distance without noise, over the rms distance of the noise.
It is drawn and the effect's coordinates are scaled to it by simulating the robot: the scale from the first-order model,
then two simulations.
"""

from dataclasses import asdict, replace

import numpy as np

from rrru.campaign.trajectories import from_config
from rrru.errors import UnreachableError
from rrru.kinematics import singularity
from rrru.seeds import stream
from rrru.studies.blind_validation.noise import NOISES, NoiseLaw
from rrru.studies.blind_validation.outside import CAUSES, EFFECTS, OUTSIDE
from rrru.studies.blind_validation.robots import PASSES, Acting, Robot, true_gap_mm
from rrru.studies.blind_validation.verdicts import AS_ROBOTS_ARE

TRUTHS = {"none": 0.15, "one": 0.55, "two": 0.2, "outside": 0.1}
WEAKEST, STRONGEST, CLEAR, SEEN = 0.1, 10.0, 2.0, 1.5
# of many causes at once: strengths, and scatter over the noise
MANY, MOST_SCATTER = (0.3, 30.0), 5.0
# of robots as they are: causes at once, and of so many robots one has a cause from outside besides
MOST_CAUSES, OUTSIDE_EVERY = 6, 3
# axes of joints as they are built, 1 sigma
AXES_SD = {"mm": 0.01, "rad": 5e-5}
_ANGLE_SD_RAD, _LENGTH_SD_MM = 0.002, 0.5
_SAFE = 0.1
_DRAWS = 20


def draw(member, conditions):
    """The robot of a member of the check, see `rrru.studies.blind_validation.chunks`."""
    kinds = {"effect": _draw_single, "noise": _draw_noisy, "many": _draw_many, "background": _draw_background}
    kinds[AS_ROBOTS_ARE] = _draw_as_robots_are
    return kinds.get(member.check, _draw_labelled)(member, conditions)


def fresh(robot, conditions):
    """The same robot on other lines and another spiral of the same region."""
    generator = stream(conditions.seed, "withheld", "fresh", robot.name)
    return replace(robot, trajectories=_trajectories(generator, conditions.mechanism))


def _draw_labelled(member, conditions):
    """A robot with nothing, one effect, two, or a cause from outside."""
    generator = stream(conditions.seed, "withheld", member.number)
    robot = bare(member.name, generator, conditions.mechanism)
    truth = generator.choice(list(TRUTHS), p=list(TRUTHS.values()))
    if truth == "none":
        return robot
    causes = list(OUTSIDE if truth == "outside" else EFFECTS)
    names = generator.choice(causes, 2 if truth == "two" else 1, replace=False).tolist()
    return _with_causes(robot, names, (WEAKEST, STRONGEST), generator, conditions)


def _with_causes(robot, names, span, generator, conditions):
    """A robot with causes of strengths drawn from a span."""
    for _ in range(_DRAWS):
        acting = tuple(draw_acting(robot, name, len(names) == 1, span, generator, conditions) for name in names)
        drawn = replace(robot, acting=acting)
        # several causes may lose a pose together that none loses alone
        if true_gap_mm(drawn, conditions) is not None:
            return drawn
    raise UnreachableError(f"{robot.name}: {' and '.join(names)} lose a pose in {_DRAWS} draws")


def _draw_single(member, conditions):
    """A robot with one effect alone, strong enough to be seen."""
    generator = stream(conditions.seed, "withheld", member.about, member.number)
    robot = bare(member.name, generator, conditions.mechanism)
    acting = draw_acting(robot, member.about, True, (CLEAR, STRONGEST), generator, conditions)
    return replace(robot, acting=(acting,))


def _draw_noisy(member, conditions):
    """A robot whose noise is not what is stated, every other one with one effect."""
    generator = stream(conditions.seed, "withheld", member.check, member.about, member.number)
    robot = replace(bare(member.name, generator, conditions.mechanism), noise=_changed(NOISES[member.about]))
    if member.number % 2 == 0:
        return robot
    return _with_causes(robot, [str(generator.choice(list(EFFECTS)))], (SEEN, STRONGEST), generator, conditions)


def _draw_many(member, conditions):
    """A robot with axis errors, scatter and three to six effects, every other one with a cause from outside besides."""
    generator = stream(conditions.seed, "withheld", member.check, member.number)
    robot = with_background(bare(member.name, generator, conditions.mechanism), generator, conditions)
    names = generator.choice(list(EFFECTS), int(generator.integers(3, 7)), replace=False).tolist()
    if member.number % 2:
        names.append(str(generator.choice(list(OUTSIDE))))
    noise = {"scatter": float(generator.uniform(0.0, MOST_SCATTER))}
    return _with_causes(replace(robot, noise=noise), names, MANY, generator, conditions)


def _draw_background(member, conditions):
    """A robot with axis errors, every other one with one effect besides."""
    generator = stream(conditions.seed, "withheld", member.check, member.number)
    robot = with_background(bare(member.name, generator, conditions.mechanism), generator, conditions)
    if member.number % 2 == 0:
        return robot
    return _with_causes(robot, [str(generator.choice(list(EFFECTS)))], (SEEN, STRONGEST), generator, conditions)


def _draw_as_robots_are(member, conditions):
    """A robot with axis errors, scatter, noise that is not as stated and one to six effects.

    Every third one has a cause from outside besides.
    """
    generator = stream(conditions.seed, "withheld", member.check, member.number)
    robot = with_background(bare(member.name, generator, conditions.mechanism), generator, conditions)
    robot = replace(robot, noise=noise_not_as_stated(generator))
    names = generator.choice(list(EFFECTS), count_of_causes(generator), replace=False).tolist()
    if has_outside(member.number):
        names.append(str(generator.choice(list(OUTSIDE))))
    return _with_causes(robot, names, MANY, generator, conditions)


def count_of_causes(generator):
    """How many effects act at once in a robot as robots are."""
    return int(generator.integers(1, MOST_CAUSES + 1))


def has_outside(number):
    """Whether the robot of a number has a cause from outside besides, as a third of them do."""
    return number % OUTSIDE_EVERY == 1


def noise_not_as_stated(generator):
    """Fields of the NoiseLaw of a robot as robots are: one of NOISES, and scatter."""
    law = NOISES[str(generator.choice(list(NOISES)))]
    # scatter that the law has by itself stays
    return {"scatter": float(generator.uniform(0.0, MOST_SCATTER))} | _changed(law)


def with_background(robot, generator, conditions):
    """The robot with ordinary errors of the axes of all its joints."""
    law = CAUSES["joint_axis_error"]
    size = [AXES_SD[unit] for unit in law.parameters.units]
    acting = Acting(law.name, {}, tuple((size * generator.standard_normal(len(size))).tolist()), 0, 0.0)
    gap = true_gap_mm(replace(robot, background=(acting,)), conditions)
    return replace(robot, background=(replace(acting, strength=float(gap / conditions.noise_rms_mm)),))


def _changed(law):
    """The fields of a NoiseLaw that are not as stated."""
    changed = {key: value for key, value in asdict(law).items() if value != getattr(NoiseLaw(), key)}
    return {key: list(value) if isinstance(value, tuple) else value for key, value in changed.items()}


def bare(name, generator, mechanism):
    """A robot with its campaign and deviations drawn, and nothing acting."""
    parameters = mechanism.parameters
    size = [_ANGLE_SD_RAD if unit == "rad" else _LENGTH_SD_MM for unit in parameters.units]
    inside = parameters.inside(size * generator.standard_normal(len(size)))
    return Robot(name, str(generator.choice(list(PASSES))), _trajectories(generator, mechanism), tuple(inside.tolist()))


def _trajectories(generator, mechanism):
    """Seven lines and a spiral, as an entry of the configuration's `trajectories`, clear of both singularities."""
    while True:
        step, height = generator.uniform(28.0, 45.0), generator.uniform(620.0, 680.0)
        start, end, x, y = generator.uniform([-640.0, -60.0, -40.0, -40.0], [-560.0, 40.0, 40.0, 40.0])
        inner, outer, top, bottom, begin = generator.uniform(
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
                "start_deg": begin,
            },
        }
        if _safe(section, mechanism):
            return section


def _safe(section, mechanism):
    """Whether the trajectories stay clear of both singularities."""
    points = np.concatenate([trajectory.curve(np.linspace(0.0, 1.0, 100)) for trajectory in from_config(section)])
    theta = mechanism.inverse(points)
    measures = (singularity.translational_measure, singularity.constraint_measure)
    return bool(np.isfinite(theta).all() and min(of(mechanism, points, theta).min() for of in measures) > _SAFE)


def draw_acting(robot, name, single, span, generator, conditions):
    """A cause of a strength drawn log-uniform from a span; single: it may sit on one leg alone, as a third of them do.

    Draws that would break a bound or lose a pose are made again, the strength only where no draw can have it.
    """
    coordinates = CAUSES[name].coordinates
    for _ in range(_DRAWS):
        strength = float(np.exp(generator.uniform(*np.log(span))))
        for _ in range(_DRAWS):
            acting = draw_direction(name, coordinates, single, strength, generator)
            acting = _to_strength(robot, acting, conditions)
            if acting is not None:
                return acting
    raise UnreachableError(f"{robot.name}: no {name} of strength {span[0]:g} to {span[1]:g} within its bounds")


def draw_direction(name, coordinates, single, strength, generator):
    """A cause with its shape, legs and the ratios of its coordinates drawn, not yet of that strength."""
    sizes = coordinates.typical * generator.standard_normal(len(coordinates))
    sizes = np.where(coordinates.positive, np.abs(sizes), sizes)
    shape = {key: _draw_value([shape[key] for shape in coordinates.shapes], generator) for key in coordinates.shapes[0]}
    per_leg = set(coordinates.legs.tolist()) == {1, 2, 3}
    leg = int(generator.integers(1, 4)) if single and per_leg and generator.random() < 1.0 / 3.0 else 0
    if leg:
        sizes = np.where(coordinates.legs == leg, sizes, 0.0)
    return Acting(name, shape, tuple(sizes.tolist()), leg, strength)


def _draw_value(tried, generator):
    """A value of a shape: one of two that the library tries, else between the least and the largest that it tries."""
    known = sorted({float(value) for value in tried})
    low, high = known[0], known[-1]
    if len(known) <= 2:
        return float(generator.choice(known))
    if low > 0.0:
        return float(np.exp(generator.uniform(*np.log([low, high]))))
    return float(generator.uniform(low, high))


def _to_strength(robot, acting, conditions):
    """The cause scaled to its strength, or None where that breaks its bounds or loses a pose."""
    robot = replace(robot, background=())
    gap, asked = _first_order_gap_mm(robot, acting, conditions), acting.strength * conditions.noise_rms_mm
    for _ in range(3):
        if gap is None or not gap > 0.0:
            return None
        acting = acting.scaled(asked / gap)
        gap = true_gap_mm(replace(robot, acting=(acting,)), conditions)
    return None if gap is None else replace(acting, strength=float(gap / conditions.noise_rms_mm))


def _first_order_gap_mm(robot, acting, conditions):
    """Rms distance that the calibration would leave of a cause, to first order."""
    mechanism = conditions.mechanism
    campaign = robot.campaign(conditions)
    motion = campaign.robot.motion(campaign.plan, mechanism.inverse)
    at = mechanism.map_at(motion.drive, motion.position_mm)
    moved = at.move(acting.law.contribute(motion, acting.values).twists).ravel()
    base = at.columns(mechanism.directions).reshape(moved.size, -1)
    basis, _ = np.linalg.qr(base)
    return float(np.sqrt(((moved - basis @ (basis.T @ moved)) ** 2).sum() / len(motion)))
