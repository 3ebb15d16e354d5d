"""What every mechanism must do, with every error set: against finite differences, loops, a scan of its drives and known
truths.
"""

from dataclasses import dataclass, field, fields

import numpy as np
import pytest

from rrru.calibration.calibrate import calibrate
from rrru.calibration.identifiability import analyse
from rrru.errors import ConfigError, UnreachableError
from rrru.estimation.observations.target_positions import TargetPositions
from rrru.kinematics import singularity
from rrru.robots.catalogue import MECHANISMS, make_mechanism

_HANGING = ((-100.0, -100.0, -310.0), (100.0, 100.0, -150.0))


@dataclass(frozen=True)
class Case:
    """A mechanism by its configuration entry, a box (low, high) of positions in mm to draw from, and the ends of its
    drives' travel.
    """

    robot: str
    box: tuple
    travel: tuple
    section: dict = field(default_factory=dict)

    def mechanism(self, parameter_set):
        """The mechanism with an error set."""
        return make_mechanism(self.robot, self.section, parameter_set=parameter_set)


CASES = {
    "rrru3": Case("rrru3", ((-500.0, -400.0, 450.0), (500.0, 400.0, 950.0)), (-np.pi, np.pi)),
    "ptt3_level": Case("ptt3", _HANGING, (-1500.0, 1500.0), {"rail_inclination_deg": 0.0}),
    "ptt3_30": Case("ptt3", _HANGING, (-1500.0, 1500.0), {"rail_inclination_deg": 30.0}),
    "ptt3_upright": Case("ptt3", _HANGING, (-1500.0, 1500.0), {"rail_inclination_deg": 90.0}),
    "delta": Case("delta", ((-300.0, -300.0, -150.0), (300.0, 300.0, 150.0)), (-np.pi, np.pi)),
}
_PARAMETER_NAMES = {name: kind.PARAMETER_NAMES for name, kind in MECHANISMS.items()}
PAIRS = [(name, kind) for name, case in CASES.items() for kind in _PARAMETER_NAMES[case.robot]]
# combinations of errors that no position shows: R and r; along level rails R - r and a common slider zero
GAUGES = {
    ("rrru3", "published"): 1,
    ("rrru3", "tied"): 1,
    ("ptt3_level", "heights"): 1,
    ("ptt3_level", "distances"): 1,
}
every_set = pytest.mark.parametrize(("name", "kind"), PAIRS)
every_case = pytest.mark.parametrize("name", CASES)


def _clear(name, kind, count=40):
    """Mechanism, `count` positions clear of both singularities by 0.15, their drive values, and errors drawn."""
    case = CASES[name]
    mechanism = case.mechanism(kind)
    generator = np.random.default_rng(5)
    points = generator.uniform(*case.box, (1000, 3))
    drives = mechanism.inverse(points)
    measures = (
        singularity.translational_measure(mechanism, points, drives),
        singularity.constraint_measure(mechanism, points, drives),
    )
    clear = np.min(measures, axis=0) > 0.15
    assert clear.sum() >= count
    return (
        mechanism,
        points[clear][:count],
        drives[clear][:count],
        generator.uniform(-1.0, 1.0, len(mechanism.parameters)) * _size(mechanism),
    )


def _size(mechanism):
    """A workshop's error for each parameter: 0.005 rad or 1 mm."""
    return np.where([unit == "rad" for unit in mechanism.parameters.units], 0.005, 1.0)


def _first(case):
    """First error set of a case."""
    return next(iter(_PARAMETER_NAMES[case.robot]))


def _slope(function, width, steps):
    """Derivative of a function of a vector, one column per entry, by central differences."""
    columns = [(function(step) - function(-step)) / (2.0 * np.abs(step).max()) for step in np.eye(width) * steps]
    return np.stack(columns, axis=-1)


def _same(analytic, numeric):
    np.testing.assert_allclose(analytic, numeric, rtol=1e-5, atol=1e-6 * np.abs(numeric).max())


def test_the_cases_cover_every_mechanism():
    assert {case.robot for case in CASES.values()} == set(MECHANISMS)


@every_set
def test_forward_undoes_inverse(name, kind):
    mechanism, points, drives, deviations = _clear(name, kind)
    np.testing.assert_allclose(mechanism.forward(drives, guess_mm=points), points, atol=1e-9)
    moved = mechanism.inverse(points, deviations)
    np.testing.assert_allclose(mechanism.forward(moved, deviations, points), points, atol=1e-9)
    assert np.abs(moved - drives).max() > 1e-3


@every_set
def test_actuator_and_parameter_jacobians_equal_finite_differences(name, kind):
    mechanism, points, drives, deviations = _clear(name, kind)
    position = mechanism.forward(drives, deviations, points)
    steps = 1e-2 * _size(mechanism)
    numeric = _slope(lambda step: mechanism.forward(drives, deviations + step, position), len(deviations), steps)
    _same(mechanism.parameter_jacobian(position, drives, deviations), numeric)
    step = 1e-5 if mechanism.parts.units[0] == "rad" else 1e-2
    numeric = _slope(lambda change: mechanism.forward(drives + change, deviations, position), 3, step)
    _same(mechanism.actuator_jacobian(position, drives, deviations), numeric)


@every_set
def test_closure_jacobians_equal_finite_differences(name, kind):
    mechanism, points, drives, deviations = _clear(name, kind)
    by_position, by_leg = mechanism.closure_jacobians(points, drives, deviations)
    _same(by_position, _slope(lambda step: mechanism.closure(points + step, drives, deviations), 3, 1e-2))
    steps = 1e-2 * _size(mechanism)
    numeric = _slope(lambda step: mechanism.closure(points, drives, deviations + step), len(deviations), steps)
    _same(np.einsum("nlc,lcp->nlp", by_leg, mechanism.leg_map), numeric)


@every_set
def test_errors_are_recovered_or_known_to_be_a_gauge(name, kind):
    mechanism, points, drives, deviations = _clear(name, kind)
    residuals = TargetPositions(mechanism, drives, mechanism.forward(drives, deviations, points), points)
    seen = analyse(mechanism, residuals.jacobian(mechanism.parameters.nominal)).rank
    assert seen == len(deviations) - GAUGES.get((name, kind), 0)
    fit = calibrate(residuals)
    assert fit.identifiability.rank == seen and fit.rms_mm < 1e-8
    if seen == len(deviations):
        np.testing.assert_allclose(fit.deviations, deviations, rtol=0.0, atol=1e-6)


@every_set
def test_a_batch_of_errors_equals_a_loop(name, kind):
    mechanism, points, drives, deviations = _clear(name, kind)
    batch = np.random.default_rng(1).uniform(-1.0, 1.0, (5, len(deviations))) * _size(mechanism)
    result = mechanism.forward_batch(drives, batch, points)
    assert result.shape == (5, len(points), 3)
    for one, vector in zip(result, batch, strict=True):
        np.testing.assert_allclose(one, mechanism.forward(drives, vector, points), rtol=0.0, atol=1e-11)


@every_set
def test_mean_distance_equals_a_loop(name, kind):
    mechanism, points, drives, deviations = _clear(name, kind, 12)
    residuals = TargetPositions(mechanism, drives, mechanism.forward(drives, deviations, points), points)
    batch = np.random.default_rng(2).uniform(-1.0, 1.0, (4, len(deviations))) * _size(mechanism)
    slow = []
    for vector in batch:
        model = [
            mechanism.forward(drive[None], vector, point[None])[0] for drive, point in zip(drives, points, strict=True)
        ]
        slow.append(sum(np.linalg.norm(m - p) for m, p in zip(residuals.measured_mm, model, strict=True)) / len(points))
    np.testing.assert_allclose(residuals.mean_distance(batch), slow, rtol=1e-9)


def _reachable(mechanism, travel, point):
    """Legs (3,) whose closure changes its sign somewhere along the travel of their drive."""
    drive = np.linspace(*travel, 4001)
    with np.errstate(invalid="ignore"):
        closure = mechanism.closure(np.tile(point, (len(drive), 1)), np.tile(drive[:, None], (1, 3)))
    return ((closure[:-1] > 0.0) & (closure[1:] < 0.0) | (closure[:-1] < 0.0) & (closure[1:] > 0.0)).any(axis=0)


@every_case
def test_out_of_reach_is_nan_in_batches_and_an_error_at_the_boundary(name):
    case = CASES[name]
    mechanism = case.mechanism(_first(case))
    low, high = np.array(case.box)
    points = np.random.default_rng(3).uniform(low - (high - low), high + (high - low), (150, 3))
    reach = np.array([_reachable(mechanism, case.travel, point) for point in points])
    assert (np.isfinite(mechanism.inverse(points)) == reach).all()
    bad = np.flatnonzero(~reach.all(axis=1))
    assert 0 < len(bad) < len(points)
    partly = bad[reach[bad].any(axis=1)][0]
    good = np.flatnonzero(reach.all(axis=1))[0]
    legs = ", ".join(str(leg + 1) for leg in np.flatnonzero(~reach[partly]))
    place = r"\({:.3f}, {:.3f}, {:.3f}\)".format(*points[partly])
    with pytest.raises(UnreachableError, match=rf"^point 2 at {place} mm is out of reach of leg {legs}; 1 of 2"):
        mechanism.require_reachable(points[[good, partly]])
    np.testing.assert_array_equal(mechanism.require_reachable(points[[good]]), mechanism.inverse(points[[good]]))


@every_case
def test_singularity_measures_lie_between_0_and_1(name):
    case = CASES[name]
    mechanism = case.mechanism(_first(case))
    points = np.random.default_rng(4).uniform(*case.box, (500, 3))
    drives = mechanism.inverse(points)
    inside = np.isfinite(drives).all(axis=1)
    for measure in (singularity.translational_measure, singularity.constraint_measure):
        value = measure(mechanism, points, drives)
        assert (np.isfinite(value) == inside).all() and inside.sum() > 100
        assert (value[inside] > 0.0).all() and (value[inside] <= 1.0).all()


@every_case
def test_a_locked_leg_resists_only_along_its_force(name):
    """A small displacement across two legs' directions changes only the third leg's closure."""
    mechanism, points, drives, _ = _clear(name, _first(CASES[name]))
    force = singularity.leg_forces(mechanism, points, drives)
    change = mechanism.closure(points + 1e-4 * np.cross(force[:, 0], force[:, 1]), drives)
    assert np.abs(change[:, :2]).max() < 1e-4 * np.abs(change[:, 2]).max()


@every_case
@pytest.mark.parametrize("shape", [(3,), (4, 2), (2, 4, 3)])
def test_wrong_shapes_are_refused(name, shape):
    mechanism = CASES[name].mechanism(_first(CASES[name]))
    wrong = np.full(shape, 1.0)
    with pytest.raises(ValueError, match=r"expected shape \(n, 3\), got"):
        mechanism.inverse(wrong)
    with pytest.raises(ValueError, match=r"expected shape \(n, 3\), got"):
        mechanism.forward(wrong)


@every_case
def test_bad_dimensions_sets_and_keys_are_refused(name):
    case = CASES[name]
    kind = MECHANISMS[case.robot]
    dimensions = [f.name for f in fields(kind) if f.name.endswith("_mm")]
    assert len(dimensions) >= 4
    for key in dimensions:
        for value in (0.0, -1.0, float("nan")):
            with pytest.raises(ConfigError, match=f"{case.robot}: {key} is {value}; allowed: a positive number"):
                kind(**{key: value})
    with pytest.raises(ConfigError, match=f"{case.robot}: parameter_set is 'all'; allowed: "):
        kind(parameter_set="all")
    with pytest.raises(ConfigError, match=f"robot {case.robot}: unknown key 'L9_mm'; known: "):
        make_mechanism(case.robot, {"L9_mm": 1.0})


def test_an_unknown_robot_is_refused_and_degrees_become_radians():
    with pytest.raises(ConfigError, match="unknown robot 'hexapod'; known: rrru3, ptt3, delta"):
        make_mechanism("hexapod", {})
    assert make_mechanism("ptt3", {"rail_inclination_deg": 90.0}).rail_inclination_rad == np.pi / 2.0
    for degrees in (-1.0, 91.0):
        with pytest.raises(ConfigError, match="ptt3: rail_inclination_rad is "):
            make_mechanism("ptt3", {"rail_inclination_deg": degrees})
    with pytest.raises(ConfigError, match=r"delta: l2_mm is 400.0; allowed: more than a_mm \+ l1_mm"):
        make_mechanism("delta", {"l2_mm": 400.0})
