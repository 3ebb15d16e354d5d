"""Virtual robots whose cause of the gap is drawn and then withheld from the diagnosis. Lengths mm, angles rad, times s.

The strength of an effect is the rms distance of its gap after the calibration, without noise, over that of the noise.
The strength is drawn, and the effect's coordinates are scaled to it: first with the first-order model, then with two
simulations of the robot.
"""

from collections import Counter
from dataclasses import asdict, replace

import numpy as np

from rrru.campaign.trajectories import from_config
from rrru.errors import ConfigError, UnreachableError
from rrru.kinematics import singularity
from rrru.seeds import stream
from rrru.studies.blind_validation.noise import NOISES, NoiseModel
from rrru.studies.blind_validation.outside import CAUSES, EFFECTS, OUTSIDE
from rrru.studies.blind_validation.robots import PASSES, Acting, Robot, true_gap_mm
from rrru.studies.blind_validation.verdicts import AS_ROBOTS_ARE

TRUTHS = {"none": 0.15, "one": 0.55, "two": 0.2, "outside": 0.1}
WEAKEST, STRONGEST, CLEAR, SEEN = 0.1, 10.0, 2.0, 1.5
# for many causes at once: interval of strengths, and largest non-repeatability over noise
MANY, MOST_SCATTER = (0.3, 30.0), 5.0
# for robots as they are: most causes at once; one in this many robots also has a cause from outside the library
MOST_CAUSES, OUTSIDE_EVERY = 6, 3
# errors of joint axes as manufactured, 1 sigma
AXES_SD = {"mm": 0.01, "rad": 5e-5}
_ANGLE_SD_RAD, _LENGTH_SD_MM = 0.002, 0.5
_SAFE = 0.1
_DRAWS = 20
# ASSUME most draws of trajectories of one robot; with the dimensions of config.yaml the first one of 200 fits
_MAX_TRAJECTORY_DRAWS = 200
_OUT_OF_REACH, _SINGULAR = "out of reach", "near a singularity"


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
        # several causes together may lose a pose that none of them loses alone
        if true_gap_mm(drawn, conditions) is not None:
            return drawn
    raise UnreachableError(f"{robot.name}: {' and '.join(names)} lose a pose in {_DRAWS} draws")


def _draw_single(member, conditions):
    """A robot with a single effect, strong enough to be detected."""
    generator = stream(conditions.seed, "withheld", member.about, member.number)
    robot = bare(member.name, generator, conditions.mechanism)
    acting = draw_acting(robot, member.about, True, (CLEAR, STRONGEST), generator, conditions)
    return replace(robot, acting=(acting,))


def _draw_noisy(member, conditions):
    """A robot with noise that is not as stated, every second one with one effect."""
    generator = stream(conditions.seed, "withheld", member.check, member.about, member.number)
    robot = replace(bare(member.name, generator, conditions.mechanism), noise=_changed(NOISES[member.about]))
    if member.number % 2 == 0:
        return robot
    return _with_causes(robot, [str(generator.choice(list(EFFECTS)))], (SEEN, STRONGEST), generator, conditions)


def _draw_many(member, conditions):
    """A robot with axis errors, scatter and three to six effects; half of them also have a cause from outside."""
    generator = stream(conditions.seed, "withheld", member.check, member.number)
    robot = with_background(bare(member.name, generator, conditions.mechanism), generator, conditions)
    names = generator.choice(list(EFFECTS), int(generator.integers(3, 7)), replace=False).tolist()
    if member.number % 2:
        names.append(str(generator.choice(list(OUTSIDE))))
    noise = {"scatter": float(generator.uniform(0.0, MOST_SCATTER))}
    return _with_causes(replace(robot, noise=noise), names, MANY, generator, conditions)


def _draw_background(member, conditions):
    """A robot with axis errors, every second one with one effect as well."""
    generator = stream(conditions.seed, "withheld", member.check, member.number)
    robot = with_background(bare(member.name, generator, conditions.mechanism), generator, conditions)
    if member.number % 2 == 0:
        return robot
    return _with_causes(robot, [str(generator.choice(list(EFFECTS)))], (SEEN, STRONGEST), generator, conditions)


def _draw_as_robots_are(member, conditions):
    """A robot with axis errors, scatter, noise that is not as stated and one to six effects.

    Every third one also has a cause from outside the library.
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
    """Whether the robot of a number also has a cause from outside the library, as a third of them do."""
    return number % OUTSIDE_EVERY == 1


def noise_not_as_stated(generator):
    """Fields of the NoiseModel of a robot as robots are: one of NOISES, and scatter."""
    noise = NOISES[str(generator.choice(list(NOISES)))]
    # scatter that the noise model defines takes precedence
    return {"scatter": float(generator.uniform(0.0, MOST_SCATTER))} | _changed(noise)


def with_background(robot, generator, conditions):
    """The robot with ordinary errors of the axes of all its joints."""
    effect = CAUSES["joint_axis_error"]
    size = [AXES_SD[unit] for unit in effect.parameters.units]
    acting = Acting(effect.name, {}, tuple((size * generator.standard_normal(len(size))).tolist()), 0, 0.0)
    gap = true_gap_mm(replace(robot, background=(acting,)), conditions)
    return replace(robot, background=(replace(acting, strength=float(gap / conditions.noise_rms_mm)),))


def _changed(noise):
    """The fields of a NoiseModel that are not as stated."""
    changed = {key: value for key, value in asdict(noise).items() if value != getattr(NoiseModel(), key)}
    return {key: list(value) if isinstance(value, tuple) else value for key, value in changed.items()}


def bare(name, generator, mechanism):
    """A robot with random campaign and deviations, and no acting cause."""
    parameters = mechanism.parameters
    size = [_ANGLE_SD_RAD if unit == "rad" else _LENGTH_SD_MM for unit in parameters.units]
    inside = parameters.inside(size * generator.standard_normal(len(size)))
    return Robot(name, str(generator.choice(list(PASSES))), _trajectories(generator, mechanism), tuple(inside.tolist()))


def _trajectories(generator, mechanism):
    """Seven lines and a spiral, as an entry of the configuration's `trajectories`, clear of both singularities.

    Raises ConfigError where none of many draws fits the robot's dimensions.
    """
    obstacles = Counter()
    for _ in range(_MAX_TRAJECTORY_DRAWS):
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
        obstacle = _obstacle(section, mechanism)
        if not obstacle:
            return section
        obstacles[obstacle] += 1
    counts = " and ".join(f"{count} are {obstacle}" for obstacle, count in obstacles.items())
    raise ConfigError(
        f"robots.{mechanism.name}: of {_MAX_TRAJECTORY_DRAWS} drawn trajectories of the blind validation (`withheld`) "
        f"{counts}; allowed: dimensions with which the robot reaches, clear of singularities, x = -640 to 40 mm and "
        "y = -135 to 135 mm at z = 620 to 680 mm, and a spiral of 300 mm radius at z = 550 to 780 mm"
    )


def _obstacle(section, mechanism):
    """What keeps the robot from the trajectories: _OUT_OF_REACH, _SINGULAR (either singularity), or "" for nothing."""
    points = np.concatenate([trajectory.curve(np.linspace(0.0, 1.0, 100)) for trajectory in from_config(section)])
    theta = mechanism.inverse(points)
    if not np.isfinite(theta).all():
        return _OUT_OF_REACH
    measures = (singularity.translational_measure, singularity.constraint_measure)
    smallest = min(measure(mechanism, points, theta).min() for measure in measures)
    return "" if smallest > _SAFE else _SINGULAR


def draw_acting(robot, name, single, span, generator, conditions):
    """A cause of a strength drawn log-uniform from a span; single: a third of the causes act on one leg alone.

    Draws that violate a bound or lose a pose are repeated, first with the same strength, then with another one.
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
    """A cause with random shape, legs and ratios of its coordinates, not yet scaled to its strength."""
    sizes = coordinates.typical * generator.standard_normal(len(coordinates))
    sizes = np.where(coordinates.positive, np.abs(sizes), sizes)
    shape = {key: _draw_value([shape[key] for shape in coordinates.shapes], generator) for key in coordinates.shapes[0]}
    per_leg = set(coordinates.legs.tolist()) == {1, 2, 3}
    leg = int(generator.integers(1, 4)) if single and per_leg and generator.random() < 1.0 / 3.0 else 0
    if leg:
        sizes = np.where(coordinates.legs == leg, sizes, 0.0)
    return Acting(name, shape, tuple(sizes.tolist()), leg, strength)


def _draw_value(tried, generator):
    """A value of a shape: one of at most two grid values of the library, else between its smallest and largest one."""
    known = sorted({float(value) for value in tried})
    low, high = known[0], known[-1]
    if len(known) <= 2:
        return float(generator.choice(known))
    if low > 0.0:
        return float(np.exp(generator.uniform(*np.log([low, high]))))
    return float(generator.uniform(low, high))


def _to_strength(robot, acting, conditions):
    """The cause scaled to its strength, or None where that violates its bounds or loses a pose."""
    robot = replace(robot, background=())
    gap, asked = _first_order_gap_mm(robot, acting, conditions), acting.strength * conditions.noise_rms_mm
    for _ in range(3):
        if gap is None or not gap > 0.0:
            return None
        acting = acting.scaled(asked / gap)
        gap = true_gap_mm(replace(robot, acting=(acting,)), conditions)
    return None if gap is None else replace(acting, strength=float(gap / conditions.noise_rms_mm))


def _first_order_gap_mm(robot, acting, conditions):
    """Rms residual distance of a cause after the calibration, to first order."""
    mechanism = conditions.mechanism
    campaign = robot.campaign(conditions)
    motion = campaign.robot.motion(campaign.plan, mechanism.inverse)
    at = mechanism.map_at(motion.drive, motion.position_mm)
    moved = at.move(acting.effect_model.contribute(motion, acting.values).twists).ravel()
    base = at.columns(mechanism.directions).reshape(moved.size, -1)
    basis, _ = np.linalg.qr(base)
    return float(np.sqrt(((moved - basis @ (basis.T @ moved)) ** 2).sum() / len(motion)))
