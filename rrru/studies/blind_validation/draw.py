"""The robots of the check, whose cause of the gap is drawn and then withheld from the diagnosis. mm, rad, s.

The strength of a cause is the rms distance of its gap after the calibration, without noise, over that of the noise. The
strength is drawn, and the cause is scaled to it: in a 3-RRRU first with the first-order model, then with two
simulations of the robot; in a robot of a file with simulations on our own plant.
"""

from collections import Counter
from dataclasses import asdict, replace

import numpy as np

from rrru.campaign import measurements as rows
from rrru.campaign.trajectories import from_config
from rrru.effects.library import library
from rrru.errors import ConfigError, SimulationError, UnreachableError
from rrru.kinematics import singularity
from rrru.seeds import stream
from rrru.studies.blind_validation.causes import (
    CAUSES,
    EFFECTS,
    OUTSIDE,
    OUTSIDE_OF_ANY,
    Acting,
    Fault,
    draw_direction,
    draw_fault,
    draw_log_uniform,
    drawn_effects,
    kind_of,
    kinds_of,
)
from rrru.studies.blind_validation.noise import NOISES, NoiseModel
from rrru.studies.blind_validation.robots import (
    PASSES,
    FileRobot,
    Robot,
    gap_over_noise,
    noise_free,
    residual,
    rms,
    true_gap_mm,
)
from rrru.studies.blind_validation.verdicts import AS_ROBOTS_ARE, NONE

TRUTHS = {"none": 0.15, "one": 0.55, "two": 0.2, "outside": 0.1}
WEAKEST, STRONGEST, CLEAR, SEEN = 0.1, 10.0, 2.0, 1.5
# of a cause of a robot of a file: detectable at all, and large enough for the user's own tracker
FILE_STRENGTHS = (0.7, 10.0)
# for many causes at once: interval of strengths, and largest non-repeatability over noise
MANY, MOST_SCATTER = (0.3, 30.0), 5.0
# by check: the span of strengths, strong enough to be detected where it matters
_SPANS = {"label": (WEAKEST, STRONGEST), "effect": (CLEAR, STRONGEST), "noise": (SEEN, STRONGEST)}
_SPANS |= {"background": (SEEN, STRONGEST), "many": MANY, AS_ROBOTS_ARE: MANY}
_WITH_BACKGROUND = ("many", "background", AS_ROBOTS_ARE)
# for robots as they are: most causes at once; one in this many robots also has a cause from outside the library
MOST_CAUSES, OUTSIDE_EVERY = 6, 3
# errors of geometric parameters, and of joint axes as manufactured, 1 sigma
PARAMETER_SD = {"mm": 0.5, "rad": 0.002}
AXES_SD = {"mm": 0.01, "rad": 5e-5}
_SAFE = 0.1
DRAWS, _STEPS = 20, 2
# gap over noise at the level of rounding errors
_NOTHING = 1e-6
# a full calibration absorbs these to first order
_CALIBRATED = ("frame_misregistration", "tool_offset")
# draws of strength and ratios before another cause is drawn; allowed relative error of its gap
_STRENGTH_DRAWS, _MAX_ERROR = 3, 0.1
# ASSUME most draws of trajectories of one robot; with the dimensions of config.yaml the first one of 200 fits
_MAX_TRAJECTORY_DRAWS = 200
_OUT_OF_REACH, _SINGULAR = "out of reach", "near a singularity"


def drawn(member, conditions):
    """The robot of a Member under its Conditions, and what the diagnosis is given: its measurement table."""
    if member.file and member.check == AS_ROBOTS_ARE:
        return draw_file_robot_as_is(member, conditions)
    if member.file:
        return draw_file_robot(member, conditions)
    robot = draw(member, conditions)
    return robot, robot.measured(conditions)


def fresh(robot, conditions):
    """The same robot on other lines and another spiral of the same region."""
    generator = stream(conditions.seed, "withheld", "files fresh" if robot.file else "fresh", robot.name)
    return replace(robot, trajectories=draw_trajectories(generator, conditions))


# --- 3-RRRUs


def draw(member, conditions):
    """The 3-RRRU of a Member of the check, see `rrru.studies.blind_validation.chunks`."""
    check, about = member.check, member.about
    own_stream = {"label": (), "effect": (about,), "noise": (check, about)}.get(check, (check,))
    generator = stream(conditions.seed, "withheld", *own_stream, member.number)
    robot = bare(member.name, generator, conditions)
    if check in _WITH_BACKGROUND:
        robot = with_background(robot, generator, conditions)
    if check == "noise":
        robot = replace(robot, noise=_changed(NOISES[about]))
    if check == AS_ROBOTS_ARE:
        robot = replace(robot, noise=noise_not_as_stated(generator))
    names = _drawn_names(member, generator)
    if check == "many":
        robot = replace(robot, noise={"scatter": float(generator.uniform(0.0, MOST_SCATTER))})
    return _with_causes(robot, names, _SPANS[check], generator, conditions) if names else robot


def _drawn_names(member, generator):
    """Names of the causes of a 3-RRRU.

    label: nothing, one effect, two, or a cause from outside. effect: the one that the library lacks. noise and
    background: one effect in every second robot. many: three to six effects, in every second robot also a cause from
    outside. as_robots_are: one to six effects, in every third robot also a cause from outside.
    """
    if member.check == "effect":
        return [member.about]
    if member.check == "label":
        truth = generator.choice(list(TRUTHS), p=list(TRUTHS.values()))
        causes, count = OUTSIDE if truth == "outside" else EFFECTS, {"none": 0, "two": 2}.get(truth, 1)
        return generator.choice(list(causes), count, replace=False).tolist() if count else []
    if member.check in ("noise", "background"):
        return [str(generator.choice(list(EFFECTS)))] if member.number % 2 else []
    many = member.check == "many"
    count = int(generator.integers(3, 7)) if many else count_of_causes(generator)
    names = generator.choice(list(EFFECTS), count, replace=False).tolist()
    if member.number % 2 if many else has_outside(member.number):
        names.append(str(generator.choice(list(OUTSIDE))))
    return names


def _with_causes(robot, names, span, generator, conditions):
    """A robot with causes of strengths drawn from a span."""
    for _ in range(DRAWS):
        acting = tuple(draw_acting(robot, name, len(names) == 1, span, generator, conditions) for name in names)
        drawn = replace(robot, acting=acting)
        # several causes together may lose a pose that none of them loses alone
        if true_gap_mm(drawn, conditions) is not None:
            return drawn
    raise UnreachableError(f"{robot.name}: {' and '.join(names)} lose a pose in {DRAWS} draws")


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


def bare(name, generator, conditions):
    """A robot with random campaign and deviations, and no acting cause."""
    parameters = conditions.mechanism.parameters
    size = [PARAMETER_SD[unit] for unit in parameters.units]
    inside = parameters.clipped_inside(size * generator.standard_normal(len(size)))
    kind, trajectories = str(generator.choice(list(PASSES))), draw_trajectories(generator, conditions)
    return Robot(name, kind, trajectories, tuple(inside.tolist()))


def draw_acting(robot, name, single, span, generator, conditions):
    """A cause of a strength drawn log-uniform from a span; single: a third of the causes act on one leg alone.

    Draws that violate a bound or lose a pose are repeated, first with the same strength, then with another one.
    """
    coordinates = CAUSES[name].coordinates
    for _ in range(DRAWS):
        strength = draw_log_uniform(span, generator)
        for _ in range(DRAWS):
            acting = draw_direction(name, coordinates, single, strength, generator)
            acting = _to_strength(robot, acting, conditions)
            if acting is not None:
                return acting
    raise UnreachableError(f"{robot.name}: no {name} of strength {span[0]:g} to {span[1]:g} within its bounds")


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


# --- robots of files


def draw_file_robot(member, conditions):
    """The robot of a file of a Member, and its measurements.

    Fault and trajectories are drawn again where the plant loses a pose or does not come to rest, or where the fault
    exceeds the bounds of its effect model. Where no draw of its kind succeeds the fault is of the next kind. Raises the
    last of these errors where there is no such kind.
    """
    generator = stream(conditions.seed, "withheld", "files", conditions.name, member.number)
    offsets = [PARAMETER_SD[unit] * generator.standard_normal() for unit in conditions.mechanism.parts.units]
    trajectories = draw_trajectories(generator, conditions)
    robot = FileRobot(member.name, member.file, member.check, trajectories, tuple(offsets))
    kinds = kinds_of(conditions.model, conditions.mechanism)
    for step in range(len(kinds)):
        kind = kinds[(member.number + step) % len(kinds)]
        if kind == NONE:
            return robot, robot.measured(conditions)
        for _ in range(DRAWS):
            fault = draw_fault(kind, conditions.model, conditions.mechanism, generator)
            strength = draw_log_uniform(FILE_STRENGTHS, generator)
            try:
                return as_driven(replace(robot, acting=(sized(robot, fault, strength, conditions),)), conditions)
            except (SimulationError, UnreachableError) as error:
                failed = error
            robot = replace(robot, trajectories=draw_trajectories(generator, conditions))
    raise failed


def sized(robot, fault, strength, conditions):
    """The fault scaled to a strength on our own plant.

    Raises UnreachableError where a calibration absorbs it, where a pose is lost, or where that strength exceeds the
    bounds of its effect model.
    """
    if kind_of(fault.kind).effect_model is None:
        return fault
    still = residual(noise_free(replace(robot, plant="own", acting=()), conditions), conditions)
    for _ in range(_STEPS):
        measurements = noise_free(replace(robot, plant="own", acting=(fault,)), conditions)
        if measurements is None:
            raise UnreachableError(f"{robot.name}: {fault.kind} of {fault.sizes} loses a pose")
        gap = rms(residual(measurements, conditions) - still) / conditions.noise_rms_mm
        if not gap > _NOTHING:
            raise UnreachableError(f"{robot.name}: a calibration absorbs {fault.kind} of {fault.sizes}")
        fault = fault.scaled(strength / gap)
        # far beyond its bounds no calibration fits, so that the simulation stops here
        if fault.scaled(0.5).beyond(conditions.mechanism):
            break
    if fault.beyond(conditions.mechanism):
        raise UnreachableError(f"{robot.name}: {fault.kind} of {fault.sizes} exceeds the bounds of its effect model")
    return fault


def as_driven(robot, conditions):
    """The robot with the true strength of its fault, and its measurements.

    The strength is the rms distance between the calibration residuals with and without the fault, over the noise rms.
    """
    campaign = robot.campaign(conditions)
    measurements, truth = campaign.run()
    exact = rows.vector_columns("measured", truth[[f"true_{axis}_mm" for axis in "xyz"]].to_numpy())
    still = noise_free(replace(robot, acting=()), conditions)
    left = residual(measurements.assign(**exact), conditions) - residual(still, conditions)
    (fault,) = robot.acting
    fault = replace(fault, strength=float(rms(left) / conditions.noise_rms_mm))
    read = residual(measurements, conditions) - residual(still, conditions)
    chi2 = float((left * read).sum() ** 2 / (left**2).sum() / conditions.noise_mm**2) if left.any() else 0.0
    return replace(robot, acting=(fault,), oracle_chi2=chi2), measurements


def draw_file_robot_as_is(member, conditions):
    """The robot of a file of a Member of the check as_robots_are, and its measurements.

    It has errors of all parameters, scatter, noise that is not as stated and several causes. Our own plant simulates it
    with the effect models of the diagnosis. Its joint axes have the errors of our own 3-RRRU. A full calibration
    identifies these errors, so they are not causes.

    Raises UnreachableError where no draw of causes lets it drive its campaign.
    """
    generator = stream(conditions.seed, "withheld", member.check, conditions.name, member.number)
    robot = bare_file_robot(member, generator, conditions)
    count, outside = count_of_causes(generator), has_outside(member.number)
    for _ in range(DRAWS):
        effects = [name for name in drawn_effects(library(conditions.mechanism)) if name not in _CALIBRATED]
        acting = _draw_some(robot, effects, count, generator, conditions)
        acting += _draw_some(robot, OUTSIDE_OF_ANY, int(outside), generator, conditions)
        drawn = replace(robot, acting=acting)
        # several causes together may lose a pose that none of them loses alone
        if len(acting) == count + outside and not np.isnan(gap_over_noise(drawn, conditions)):
            return drawn, drawn.measured(conditions)
        robot = replace(robot, trajectories=draw_trajectories(generator, conditions))
    raise UnreachableError(f"{robot.name}: {count} causes lose a pose in {DRAWS} draws")


def bare_file_robot(member, generator, conditions):
    """The robot of a file without causes: errors of drives and axes, and noise that is not as stated."""
    numbers = conditions.mechanism.candidates
    drives = len(conditions.mechanism.parts.units)
    size = [(PARAMETER_SD if k < drives else AXES_SD)[number.unit] for k, number in enumerate(numbers)]
    offsets = (size * generator.standard_normal(len(size))).tolist()
    trajectories, noise = draw_trajectories(generator, conditions), noise_not_as_stated(generator)
    return FileRobot(member.name, member.file, "own", trajectories, tuple(offsets), noise=noise, rests=False)


def _draw_some(robot, names, count, generator, conditions):
    """Up to count causes out of names, without those that a calibration absorbs."""
    found = []
    for name in generator.permutation(names).tolist():
        if len(found) == count:
            break
        fault = _draw_cause(robot, name, generator, conditions)
        if fault is not None:
            found.append(fault)
    return tuple(found)


def _draw_cause(robot, name, generator, conditions):
    """A cause of a strength drawn log-uniform from MANY, or None where no draw has it.

    A cause that a calibration absorbs to first order is dropped: its gap does not double with its size.
    """
    coordinates = kind_of(name).effect_model(conditions.mechanism).coordinates
    for _ in range(_STRENGTH_DRAWS):
        strength = draw_log_uniform(MANY, generator)
        one = draw_direction(name, coordinates, False, strength, generator)
        try:
            fault = sized(robot, Fault(name, one.coordinates, one.shape), strength, conditions)
        except (SimulationError, UnreachableError):
            continue
        alone, half = (
            gap_over_noise(replace(robot, acting=(fault.scaled(factor),)), conditions) for factor in (1.0, 0.5)
        )
        if max(abs(alone - strength), abs(2.0 * half - strength)) < _MAX_ERROR * strength:
            return replace(fault, strength=alone)
    return None


# --- trajectories


def draw_trajectories(generator, conditions):
    """Lines and a spiral, as an entry of the configuration's `trajectories`, that the robot of Conditions can drive.

    Those of a 3-RRRU avoid both singularities, those of a robot of a file are within the box of its Model. Raises
    ConfigError or UnreachableError where none of many draws fits the robot.
    """
    draw_them = _in_box if conditions.model else _clear_of_singularities
    return draw_them(generator, conditions)


def _section(ends_mm, offsets_y_mm, points, **spiral):
    """An entry of `trajectories`; ends_mm (2, 3): of the middle line; points: of a line and of the spiral."""
    start, end = ends_mm
    lines = {"start_mm": start, "end_mm": end, "offsets_y_mm": offsets_y_mm, "points": points[0]}
    return {"lines": lines, "spiral": spiral | {"points": points[1]}}


def _clear_of_singularities(generator, conditions):
    """Seven lines and a spiral of a 3-RRRU."""
    obstacles, mechanism = Counter(), conditions.mechanism
    for _ in range(_MAX_TRAJECTORY_DRAWS):
        step, height = generator.uniform(28.0, 45.0), generator.uniform(620.0, 680.0)
        start, end, x, y = generator.uniform([-640.0, -60.0, -40.0, -40.0], [-560.0, 40.0, 40.0, 40.0])
        inner, outer, top, bottom, begin = generator.uniform(
            [30.0, 240.0, 550.0, 730.0, 0.0], [70.0, 300.0, 590.0, 780.0, 360.0]
        )
        section = _section(
            ([start, 0.0, height], [end, 0.0, height]),
            [0.0, *(sign * k * step for k in (1, 2, 3) for sign in (1.0, -1.0))],
            (26, 40),
            centre_mm=[x, y],
            radius_mm=[inner, outer],
            z_mm=[top, bottom],
            turns=generator.uniform(4.0, 5.5),
            start_deg=begin,
        )
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
    points = _points(section, 100)
    theta = mechanism.inverse(points)
    if not np.isfinite(theta).all():
        return _OUT_OF_REACH
    measures = (singularity.translational_measure, singularity.constraint_measure)
    smallest = min(measure(mechanism, points, theta).min() for measure in measures)
    return "" if smallest > _SAFE else _SINGULAR


def _points(section, count):
    """Points (n, 3) of an entry of `trajectories`, `count` of each one."""
    return np.concatenate([trajectory.curve(np.linspace(0.0, 1.0, count)) for trajectory in from_config(section)])


def _in_box(generator, conditions):
    """Three lines and a spiral in the box of a robot of a file about its home."""
    half, home = conditions.model.half_mm, conditions.mechanism.legs.home_mm
    for _ in range(DRAWS):
        x, y, z = home + half * generator.uniform(-0.15, 0.15, 3)
        high, low, inner, outer, begin = generator.uniform([0.2, -0.5, 0.3, 0.7, 0.0], [0.5, -0.2, 0.4, 0.9, 360.0])
        level = z + half * generator.uniform(-0.3, 0.3)
        section = _section(
            ([x - 0.8 * half, y, level], [x + 0.8 * half, y, level]),
            [0.0, 0.5 * half, -0.5 * half],
            (9, 32),
            centre_mm=[x, y],
            radius_mm=[inner * half, outer * half],
            z_mm=[z + low * half, z + high * half],
            turns=generator.uniform(2.2, 3.2),
            start_deg=begin,
        )
        points = _points(section, 60)
        if conditions.mechanism.solve(conditions.mechanism.inverse(points), points).closed.all():
            return section
    raise UnreachableError(f"{conditions.name}: no trajectories in reach within {half:g} mm of home in {DRAWS} draws")
