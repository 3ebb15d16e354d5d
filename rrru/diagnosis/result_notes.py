"""Sentences on results of a fit other than the effects: zero offsets, payload and tilt, noise, convergence, and the
omitted-variable bias of a calibration without an effect of how the campaign was measured. Lengths mm, angles rad.
"""

from collections.abc import Collection, Iterator

import numpy as np
from scipy.special import chdtri

from rrru.arrays import FloatArray, IntArray
from rrru.campaign.ingest.zero_offsets import LARGE
from rrru.campaign.noise import repeat_noise
from rrru.diagnosis.inference import InferenceResult
from rrru.diagnosis.make_problem import UNLOADED
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.payload_nuisance import WEIGHT
from rrru.diagnosis.posterior import Posterior
from rrru.diagnosis.problem import GEOMETRY, DiagnosisProblem
from rrru.effects.protocol import is_compliance
from rrru.estimation.estimate import Estimate
from rrru.estimation.intervals import QUANTILE_95
from rrru.kinematics.legs import WORLD
from rrru.kinematics.robot import Robot

# said where an effect depends on loads of a robot whose file states no masses
MASSES_UNKNOWN = (
    "no masses of the links are stated: without them payloads alone tell the size of a compliance, and the weight of "
    "the links may appear as another effect, state them in the robot's file (`inertial`, or `mass_kg` of a row of `dh`)"
)
# said where an effect depends on loads of a robot whose file does not say how it is mounted
MOUNTING_ASSUMED = (
    "gravity is assumed along -z of the robot's base: state `up` of the robot if it is mounted on a wall or a ceiling"
)
# said where a part of the gap looks like random error, by what poses say that were measured under the same conditions
# again: there are none; there are too few; they agree
REPEATABILITY_UNKNOWN = "repeatability is unknown: no pose was measured twice"
REPEATABILITY_UNSURE = "repeatability is unknown: too few poses were measured twice"
ROBOT_REPEATS = "poses that were measured again agree better than the noise that was found"
# said where that part is no random error: it has a serial correlation
SUCCESSIVE_ALIKE = "residuals of successive stops are correlated, so that the error follows the time or the path"
_SCATTERS = "the robot does not repeat, or the instrument is worse"


def zero_notes(estimate: Estimate, robot: Robot) -> Iterator[str]:
    """Sentences on drives whose zeros are far off, such as "joint 4: zero, or the part that it moves, is off by 2
    degrees (95 %: 1.98 to 2.02)".

    estimate: of the robot's geometric errors. A zero that is not separately identifiable from a frame, or from the
    place of a target, has a combined offset with that where its drive slides. A zero whose variance comes from the
    priors of geometric errors is not determined; one whose variance comes from that of a load has a small one.
    """
    block, names = estimate.parameters.slices[GEOMETRY], robot.parameters.names
    of_priors = estimate.prior_shares(block)
    known = dict(zip(names, range(block.start, block.stop), strict=True))
    for drive in robot.parts.drives:
        name = f"d{drive.column.rpartition('_')[0]}"
        number = known.get(name)
        if number is None:
            continue
        value, error = estimate.values[number], np.nan_to_num(estimate.standard_errors[number])
        if abs(value) <= max(LARGE[drive.unit], OPTIONS.min_zero_z * error):
            continue
        unit, scale = ("degrees", np.degrees(1.0)) if drive.unit == "rad" else ("mm", 1.0)
        size = _sized(scale * value, scale * estimate.intervals[number], unit)
        if others := _confounded_with(robot, name, LARGE[drive.unit]):
            both = f"{drive.site}: zero and {others} are not separately identifiable"
            if drive.unit == "rad":
                # a shift of a frame or of a target across the axis does what a turn does: no number is the zero's alone
                yield f"{both}; the fitted model holds at what was read, not at other points of the platform"
            else:
                yield f"{both}, combined they equal a zero offset of {size}"
        elif of_priors[number] > OPTIONS.max_prior_variance_share:
            yield f"{drive.site}: zero is not determined by the readings, its most probable offset is {size}"
        else:
            yield f"{drive.site}: zero, or the part that it moves, is off by {size}"


def _sized(value: float, ends: FloatArray, unit: str) -> str:
    """A number with its 95 % interval (2,), to two digits of its half width."""
    places = max(1 - int(np.floor(np.log10(max(0.5 * float(np.ptp(ends)), 1e-12)))), 0)
    size, low, high = (f"{number:.{places}f}" for number in (value, *ends))
    return f"{size} {unit} (95 %: {low} to {high})"


def _confounded_with(robot: Robot, zero: str, least: float) -> str:
    """What a zero is confounded with, in words: errors of usual size that equal an offset of at least `least`."""
    usual = {"mm": OPTIONS.outside_error_mm, "rad": OPTIONS.outside_error_rad}
    on_platform = "the place of the target" if robot.legs.reflectors else "the place of the tool"
    others = (
        "the frame of the measurements" if WORLD in candidate.twists else on_platform
        for candidate, size in robot.confounded_outside(zero)
        if abs(size) * usual[candidate.unit] > least
    )
    return " and ".join(dict.fromkeys(others))


def payload_notes(inference: InferenceResult) -> Iterator[str]:
    """Sentences on significant errors of payload and tilt that the readings determine, and on those at a bound."""
    for name, unit, value, interval in _nuisance_at_bound(inference):
        what = "mass at the platform" if unit == "kg" else f"tilt of the base about {name[-1]}"
        stated, check = ("masses", "the stated masses and payloads") if unit == "kg" else ("level base", "its level")
        yield (
            f"the fitted error of the {what} is at its bound, {_sized(value, interval, unit)}: the stated {stated} "
            f"cannot explain the deflections, and sizes of compliances may be biased; check {check}"
        )
    for name, unit, value, interval, determined in _significant_nuisance(inference):
        if determined:
            size = _sized(value, interval, unit)
            if unit == "kg":
                yield f"the platform carries {size} more than stated, if the other stated loads are right"
            else:
                yield f"the base is tilted by {size} about {name[-1]}, the configuration assumes 0"


def undetermined_payload_notes(inference: InferenceResult) -> Iterator[str]:
    """Sentences on significant errors of payload and tilt that are confounded with a compliance."""
    for name, unit, *_, determined in _significant_nuisance(inference):
        if not determined:
            what = "a mass at the platform" if unit == "kg" else f"a tilt of the base about {name[-1]}"
            do = "measure with two loads" if unit == "kg" else "level the base"
            yield f"{what} and a compliance are not separately identifiable from these readings: {do}"


def mass_notes(problem: DiagnosisProblem) -> Iterator[str]:
    """The sentence that loads are not known, where an effect needs them and the links of the robot have no masses."""
    untested = {name for name, why in problem.untestable.items() if why == UNLOADED}
    if problem.massless and (untested or any(is_compliance(effect) for effect in problem.effects.values())):
        yield MASSES_UNKNOWN


def mounting_notes(inference: InferenceResult) -> Iterator[str]:
    """The sentence that the direction of gravity is assumed, where an effect of the model depends on it.

    Where something is unexplained it may be such an effect under another direction.
    """
    effects, posterior = inference.problem.effects, inference.posterior
    unexplained = posterior.probability_unexplained > OPTIONS.min_unexplained_probability
    names = effects if unexplained else [name for name, _ in inference.state.effects if name in effects]
    if not inference.problem.mechanism.up_stated and any(is_compliance(effects[name]) for name in names):
        yield MOUNTING_ASSUMED


def _nuisance_at_bound(inference: InferenceResult) -> Iterator[tuple[str, str, float, FloatArray]]:
    """Name, unit, value and 95 % interval of each significant error of payload and tilt that ends at a bound.

    There the interval is one-sided, and its width over the normal quantile stands in for the standard error.
    """
    estimate, weight = inference.fit.estimate, inference.fit.weight
    if not weight or inference.problem.massless:
        return
    block = estimate.parameters.slices[WEIGHT]
    held, intervals = estimate.at_bound[block], estimate.intervals[block]
    for (name, unit, value, _), bound, interval in zip(weight, held, intervals, strict=True):
        if bound and abs(value) > OPTIONS.min_nuisance_z * np.ptp(interval) / QUANTILE_95:
            yield name, unit, value, interval


def _significant_nuisance(inference: InferenceResult) -> Iterator[tuple[str, str, float, FloatArray, bool]]:
    """Name, unit, value, 95 % interval and whether determined, of each significant error of payload and tilt.

    With one load all deflections are in proportion to it: the mass is then only relative to masses of the links, which
    are not measured. Where something is unexplained both may be a part of that.
    """
    fit, problem = inference.fit, inference.problem
    estimate, weight = fit.estimate, fit.weight
    unexplained = inference.posterior.probability_unexplained > OPTIONS.min_unexplained_probability
    if not weight or problem.massless or unexplained:
        # without masses an error of the payload would be the weight of the links
        return
    block = estimate.parameters.slices[WEIGHT]
    shares, intervals = estimate.prior_shares()[block], estimate.intervals[block]
    several_loads = len(np.unique(np.nan_to_num(problem.motion.payload_kg[problem.used]))) > 1
    for (name, unit, value, error), share, interval in zip(weight, shares, intervals, strict=True):
        if abs(value) > OPTIONS.min_nuisance_z * error and not interval[0] <= 0.0 <= interval[1]:
            determined = share <= OPTIONS.max_prior_variance_share and (unit != "kg" or several_loads)
            yield name, unit, value, interval, determined


def repeatability(problem: DiagnosisProblem, stated_mm: float) -> str:
    """What poses that were measured again say of a noise found that is larger than the stated one (mm per axis).

    REPEATABILITY_UNKNOWN, REPEATABILITY_UNSURE or ROBOT_REPEATS, empty where they scatter by more than the stated
    noise. Limits are those of the 95 % interval of their standard deviation, from the chi-square distribution.
    """
    repeated, freedom = repeat_noise(problem.measurements[problem.used])
    if not freedom:
        return REPEATABILITY_UNKNOWN
    least, most = (repeated * np.sqrt(freedom / chdtri(freedom, tail)) for tail in (0.025, 0.975))
    if most < problem.noise_mm:
        return ROBOT_REPEATS
    return "" if least > stated_mm else REPEATABILITY_UNSURE


def noise_notes(problem: DiagnosisProblem, stated_mm: float | None, contradicted: float) -> Iterator[str]:
    """Sentences on a noise that contradicts the stated one (mm per axis, None: none) by more than a factor."""
    if stated_mm == 0.0:
        yield f"noise_mm is 0, which no instrument reaches: the noise is estimated, {problem.noise_mm:.3g} mm per axis"
    if not stated_mm:
        return
    found = f"noise stated {stated_mm:.3g} mm per axis, found {problem.noise_mm:.3g}"
    if problem.noise_mm > contradicted * stated_mm:
        known, missing = repeatability(problem, stated_mm), "the robot has errors that are not in the model"
        if known == ROBOT_REPEATS:
            yield f"{found}: {missing}"
        else:
            yield f"{found}: {f'the instrument is worse, or {missing}' if known else _SCATTERS}"
        if known:
            yield known
    elif problem.noise is not None and (problem.noise.axis_mm > contradicted * stated_mm).any():
        # one axis alone may have a part of the gap
        if known := repeatability(problem, stated_mm):
            yield known
    elif problem.noise_mm < stated_mm / contradicted:
        yield f"{found}: the instrument is better"


def successive_notes(inference: InferenceResult, stated_mm: float | None, contradicted: float) -> Iterator[str]:
    """The sentence that an error above the stated noise (mm per axis, None: none) is no random error."""
    problem = inference.problem
    if not stated_mm or problem.noise_mm <= contradicted * stated_mm:
        return
    rows = problem.on_robot
    correlation, pairs = serial_correlation(
        problem.residual(inference.state)[rows], problem.run[rows], problem.stop[rows]
    )
    if correlation > OPTIONS.min_serial_correlation and correlation * np.sqrt(pairs) > OPTIONS.min_serial_z:
        yield SUCCESSIVE_ALIKE


def serial_correlation(residual: FloatArray, run: IntArray, stop: IntArray) -> tuple[float, int]:
    """Correlation of residuals (m, 3) between successive rows of different stops of a run, and the number of pairs.

    Of white noise it is zero with a standard deviation of at most 1 / sqrt(pairs), however the axes are correlated.
    Rows of one stop share what does not repeat there: they are no pairs.
    """
    pair = (np.diff(run) == 0) & (np.diff(stop) != 0)
    before, after = residual[:-1][pair], residual[1:][pair]
    size = np.sqrt((before**2).sum() * (after**2).sum())
    return (float((before * after).sum() / size) if size else 0.0), int(pair.sum())


def posterior_notes(posterior: Posterior) -> Iterator[str]:
    """A sentence on a Posterior that depends on where its search began."""
    if posterior.apart > OPTIONS.max_searches_apart:
        yield (
            f"the search over sets of effects has not settled: two searches give probabilities that differ by up to "
            f"{posterior.apart:.2f}"
        )


def fit_notes(inference: InferenceResult) -> Iterator[str]:
    """Sentences on a fit that did not converge."""
    end, terms = inference.fit.estimate.end, inference.fit.terms
    if not end.converged:
        names = ", ".join(term.effect for term in terms) or "the calibration"
        yield f"the fit of {names} did not converge ({end.message}): its values are preliminary"


def bias_notes(inference: InferenceResult, named: Collection[str]) -> tuple[str, ...]:
    """Sentences on the bias that each named effect of the corrected model would cause if it were omitted, such as
    "without read_before_rest joint_1_x would be off by 7.1 standard errors: ..".

    The biased parameters are those of the least-squares fit to the omitted effect. Each bias is in units of the
    standard error that a calibration without the effect would state. Parameters of the frame do not count.
    """
    problem, linear = inference.problem, inference.evidence.linear
    flat = linear.base.reshape(linear.data.size, -1)
    size = np.linalg.norm(flat, axis=0)
    inverse = np.linalg.pinv(flat / size, rcond=1e-9)
    robot = problem.mechanism
    frame = np.abs(robot.directions[robot.legs.site_numbers[WORLD]]).any(axis=0)
    acting = {key: linear.columns[key] @ numbers for key, numbers in inference.state.effects.items()}
    unexplained = (linear.data - sum(acting.values(), np.zeros(linear.data.shape))).ravel()
    notes = []
    for (name, _), change in acting.items():
        # of an effect that is possible alone the sentence would say that it acts
        if name in named and problem.effects[name].spoils:
            left = unexplained + change.ravel()
            left = left - flat @ (inverse @ left / size)
            noise = np.sqrt((left**2).sum() / max(len(left) - flat.shape[1], 1))
            off = np.where(frame, 0.0, np.abs(inverse @ change.ravel()) / (noise * np.linalg.norm(inverse, axis=1)))
            worst = int(off.argmax())
            wrong = f"{robot.parameters.names[worst]} would be off by {off[worst]:.2g} standard errors"
            notes.append(f"without {name} {wrong}: {problem.effects[name].spoils}")
    return tuple(notes)
