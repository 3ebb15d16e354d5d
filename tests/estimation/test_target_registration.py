"""Registration of instrument and targets: against Kabsch's solution, against the truth, with gross errors."""

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from rrru.campaign.registration_kernel import descend
from rrru.campaign.target_registration import TargetReadings, register_targets
from rrru.errors import FitError

_COUNT, _NOISE_MM = 60, 0.05
_PLACES = np.array([[120.0, -40.0, 60.0], [-30.0, 200.0, 10.0]])
_UNKNOWN = np.full((2, 3), np.nan)


def _measured(seed, tilt_rad=2.0, noise_mm=_NOISE_MM, turned=False):
    """TargetReadings of unknown places, the true rotation and shift into the robot's frame, and the tool's turn."""
    draw = np.random.default_rng(seed)
    body, turn = draw.uniform(-500.0, 500.0, (_COUNT, 3)), _turns(draw, tilt_rad)
    target = np.arange(_COUNT) % 2
    rotation, shift = Rotation.random(rng=draw).as_matrix(), draw.uniform(-2000.0, 2000.0, 3)
    robot = body + np.einsum("nij,nj->ni", turn, _PLACES[target])
    seen = (robot - shift) @ rotation + draw.normal(0.0, noise_mm, robot.shape)
    tool, orientations = Rotation.random(rng=draw).as_matrix(), None
    if turned:
        orientations = rotation.T @ turn @ tool
    return (
        TargetReadings(body, turn, seen, target, _UNKNOWN, turn=orientations, characteristic_length_mm=300.0),
        rotation,
        shift,
        tool,
    )


def _turns(draw, tilt_rad):
    """Orientations (n, 3, 3) up to a tilt about each axis."""
    return Rotation.from_rotvec(draw.uniform(-tilt_rad, tilt_rad, (_COUNT, 3))).as_matrix()


@pytest.mark.parametrize("seed", range(12))
def test_any_turn_of_the_instrument_is_found(seed):
    readings, rotation, shift, _ = _measured(seed)
    found = register_targets(readings)
    assert Rotation.from_matrix(found.rotation @ rotation.T).magnitude() < 3e-4
    np.testing.assert_allclose(found.shift_mm, shift, rtol=0.0, atol=0.5)
    np.testing.assert_allclose(found.place_mm, _PLACES, rtol=0.0, atol=0.2)
    np.testing.assert_allclose(found.apply(readings.measured_mm).mean(axis=0), _robot(readings).mean(axis=0), atol=0.1)


def _robot(readings):
    """True positions (n, 3) in the robot's frame."""
    return readings.body_mm + np.einsum("nij,nj->ni", readings.body_turn, _PLACES[readings.target])


def test_the_frame_is_what_takes_the_robots_frame_into_the_instruments():
    readings, *_ = _measured(3, noise_mm=0.0)
    frame = register_targets(readings).frame
    moved = Rotation.from_rotvec(frame[3:]).apply(_robot(readings)) + frame[:3]
    np.testing.assert_allclose(moved, readings.measured_mm, rtol=0.0, atol=1e-2)


def test_known_places_give_kabschs_solution():
    """Where every reading counts alike: noise of one size on all."""
    readings, *_ = _measured(5, noise_mm=0.0)
    draw = np.random.default_rng(0)
    off = draw.standard_normal(readings.measured_mm.shape)
    off /= np.linalg.norm(off, axis=1)[:, None]
    known = TargetReadings(readings.body_mm, readings.body_turn, readings.measured_mm + off, readings.target, _PLACES)
    aim, seen = _robot(readings), known.measured_mm
    kabsch, _ = Rotation.align_vectors(aim - aim.mean(axis=0), seen - seen.mean(axis=0))
    assert (kabsch * Rotation.from_matrix(register_targets(known).rotation).inv()).magnitude() < 1e-4


def test_it_is_the_least_squares_of_a_slow_search_from_the_truth():
    """Of the sum of squares whose weights are those of the soft L1 loss at what was found."""
    readings, rotation, shift, _ = _measured(7, noise_mm=1.0)
    found = register_targets(readings)
    distance = np.linalg.norm(found.residual_mm, axis=1)
    weights = (1.0 + (distance / (1.5 / 0.6745 * np.median(distance))) ** 2) ** -0.5

    def off(numbers):
        turn = Rotation.from_rotvec(numbers[:3]).as_matrix() @ rotation
        place = numbers[6:].reshape(2, 3)[readings.target]
        model = readings.body_mm + np.einsum("nij,nj->ni", readings.body_turn, place)
        rest = readings.measured_mm @ turn.T + numbers[3:6] - model
        return (np.sqrt(weights)[:, None] * rest).ravel()

    start = np.concatenate([np.zeros(3), shift, _PLACES.ravel()])
    slow = least_squares(off, start, x_scale="jac", xtol=1e-14, ftol=1e-14, gtol=1e-14).x
    np.testing.assert_allclose(found.place_mm, slow[6:].reshape(2, 3), rtol=0.0, atol=2e-3)
    np.testing.assert_allclose(found.shift_mm, slow[3:6], rtol=0.0, atol=5e-3)


def test_a_tenth_of_gross_errors_moves_little():
    readings, rotation, *_ = _measured(2)
    seen = readings.measured_mm.copy()
    seen[::10] += np.random.default_rng(1).uniform(-800.0, 800.0, seen[::10].shape)
    found = register_targets(TargetReadings(readings.body_mm, readings.body_turn, seen, readings.target, _UNKNOWN))
    assert Rotation.from_matrix(found.rotation @ rotation.T).magnitude() < 1e-3
    assert np.median(np.linalg.norm(found.residual_mm, axis=1)) < 5.0 * _NOISE_MM


def test_orientations_give_the_turn_of_the_tool():
    readings, rotation, _, tool = _measured(4, tilt_rad=0.1, turned=True)
    found = register_targets(readings)
    assert Rotation.from_matrix(found.tool_turn.T @ tool).magnitude() < 1e-3
    assert Rotation.from_matrix(found.rotation @ rotation.T).magnitude() < 1e-3


def test_a_body_that_never_turns_has_its_targets_about_the_tool():
    """Place and shift are confounded: the weak prior decides, nothing diverges."""
    readings, rotation, *_ = _measured(6, tilt_rad=0.0)
    found = register_targets(readings)
    assert Rotation.from_matrix(found.rotation @ rotation.T).magnitude() < 1e-3
    np.testing.assert_allclose(found.place_mm[0] - found.place_mm[1], _PLACES[0] - _PLACES[1], atol=0.2)
    np.testing.assert_allclose(found.place_mm.mean(axis=0), 0.0, atol=1e-6)


def test_a_left_handed_instrument_fits_mirrored_alone():
    readings, *_ = _measured(8)
    seen = readings.measured_mm * [1.0, 1.0, -1.0]
    flipped = TargetReadings(readings.body_mm, readings.body_turn, seen, readings.target, _UNKNOWN)
    assert register_targets(flipped, mirrored=True).median_mm < 0.01 * register_targets(flipped).median_mm


def test_points_on_a_line_leave_the_turn_about_it_open():
    body = np.outer(np.linspace(-1.0, 1.0, 20), [300.0, 0.0, 400.0])
    turn, none = np.tile(np.eye(3), (20, 1, 1)), np.zeros(20, dtype=int)
    found = register_targets(TargetReadings(body, turn, body + np.array([5.0, 6.0, 7.0]), none, np.zeros((1, 3))))
    np.testing.assert_allclose(np.abs(found.undetermined), [[0.6, 0.0, 0.8]], atol=1e-6)
    with pytest.raises(FitError, match="2 readings of targets; allowed: at least 3"):
        register_targets(TargetReadings(body[:2], turn[:2], body[:2], none[:2], np.zeros((1, 3))))


@pytest.mark.parametrize("seed", range(10))
def test_the_compiled_search_finds_the_minimum_that_a_plain_one_finds(seed):
    """Of a quadratic form of a rotation's entries, from the same start, by SciPy with finite differences."""
    draw = np.random.default_rng(seed)
    rest, start = draw.normal(size=(10, 9)), Rotation.random(rng=draw)
    truth = Rotation.from_rotvec(draw.normal(0.0, 0.2, 3)) * start
    left = rest @ truth.as_matrix().ravel() + draw.normal(0.0, 0.01, 10)
    (found,), (cost,) = descend(rest, left, start.as_matrix()[None], 60, 1e-12)
    plain = least_squares(lambda w: rest @ (Rotation.from_rotvec(w) * start).as_matrix().ravel() - left, np.zeros(3))
    np.testing.assert_allclose(found, (Rotation.from_rotvec(plain.x) * start).as_matrix(), rtol=0.0, atol=1e-6)
    np.testing.assert_allclose(found.T @ found, np.eye(3), rtol=0.0, atol=1e-12)
    assert cost == pytest.approx(2.0 * plain.cost, rel=1e-8)
