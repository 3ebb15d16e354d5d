"""Several readings at one stop: how far they count as independent, that folds keep them together, and noisy targets."""

import numpy as np
import pandas as pd
import pytest

from rrru.campaign import measurements as rows
from rrru.campaign.outliers import isolated
from rrru.diagnosis.calibrate import calibrate
from rrru.diagnosis.diagnose import MeasuredRobot, diagnose
from rrru.diagnosis.heldout import HeldOut
from rrru.diagnosis.make_problem import make_diagnosis_problem
from rrru.diagnosis.settings import GapSettings
from rrru.effects.library import find
from rrru.estimation.noise_model import NoiseModel, alike
from rrru.kinematics.dynamics import Masses
from tests.diagnosis import arms, gantry

_STOPS, _TARGETS = 150, ("a", "b", "c")
_PLACES = {"a": (60.0, 10.0, 90.0), "b": (-50.0, 40.0, 120.0), "c": (0.0, -70.0, 60.0)}


def _readings(generator, shared_mm, own_mm, targets=3):
    """Data (m, 3), stop (m,) and kind (m,): errors of the robot at each stop, and of each target in addition."""
    stop = np.repeat(np.arange(_STOPS), targets)
    own_mm = np.broadcast_to(own_mm, targets)[np.arange(len(stop)) % targets]
    data = shared_mm * generator.standard_normal((_STOPS, 3))[stop]
    data = data + own_mm[:, None] * generator.standard_normal((len(stop), 3))
    return data, stop, 2 * (np.arange(len(stop)) % targets)


def _columns(generator, count, numbers=12):
    return generator.standard_normal((count, 3, numbers))


def _factor(seeds, shared_mm, own_mm, targets=3):
    found = []
    for seed in range(seeds):
        generator = np.random.default_rng(seed)
        data, stop, kind = _readings(generator, shared_mm, own_mm, targets)
        columns = _columns(generator, len(data))
        found.append(alike(data + columns @ generator.normal(size=12), columns, stop, kind))
    return np.array(found)


@pytest.mark.parametrize(("shared_mm", "targets"), [(0.5, 3), (1.0, 3), (2.0, 3), (1.0, 2), (1.0, 6)])
def test_readings_that_share_the_robots_scatter_have_the_design_effect(shared_mm, targets):
    """1 + (t - 1) r, with the share r of the variance that is shared."""
    share = shared_mm**2 / (shared_mm**2 + 1.0)
    found = _factor(12, shared_mm, 1.0, targets)
    assert found.mean() == pytest.approx(1.0 + (targets - 1) * share, rel=0.06)
    assert found.std() < 0.15 * found.mean()


def test_the_factor_is_the_variance_of_a_mean_over_that_of_independent_readings():
    """By many draws of a mean over all readings, the definition of a design effect."""
    means, singles = [], []
    for seed in range(400):
        data, *_ = _readings(np.random.default_rng(1000 + seed), 1.0, 0.8)
        means.append(data.mean(axis=0))
        singles.append((data**2).mean())
    effect = np.var(means) / (np.mean(singles) / (3 * _STOPS))
    assert _factor(10, 1.0, 0.8).mean() == pytest.approx(effect, rel=0.12)


def test_independent_readings_count_in_full():
    found = _factor(20, 0.0, 1.0)
    assert (found >= 1.0).all() and found.mean() < 1.05 and found.max() < 1.15
    assert (_factor(3, 1.0, 1.0, targets=1) == 1.0).all()


def test_targets_of_unlike_noise_and_orientations_do_not_confuse_it():
    """Each target by its own size; orientations, which come with other errors, are left out."""
    assert _factor(12, 0.0, [1.0, 20.0, 0.1]).mean() < 1.06
    generator = np.random.default_rng(3)
    data, stop, kind = _readings(generator, 1.0, 1.0)
    columns = _columns(generator, len(data))
    alone = alike(data, columns, stop, kind)
    turned = 5.0 * generator.standard_normal((_STOPS, 3))[stop]
    both = alike(
        np.concatenate([data, turned]),
        np.concatenate([columns, _columns(generator, len(data))]),
        np.tile(stop, 2),
        np.concatenate([kind, kind + 1]),
    )
    assert alone == pytest.approx(2.0, abs=0.3) and both == pytest.approx(alone, abs=0.1)


def test_counted_noise_is_wider_by_the_root_of_the_factor():
    model = NoiseModel(np.array([1.0, 2.0, 3.0]), alike=2.25)
    np.testing.assert_allclose(model.counted.axis_mm, [1.5, 3.0, 4.5])
    np.testing.assert_array_equal(model.counted.counted.axis_mm, model.counted.axis_mm)


def _campaign(scatter_mm, seed=1, turned=False):
    """Three reflectors at each stop of the arm, which does not repeat by so much."""
    generator, frame = np.random.default_rng(seed), arms.measure(count=_STOPS, noise=(0.0, 0.0), seed=seed)
    poses = arms.ARM.solve(rows.actuators(frame, arms.ARM), rows.command(frame), arms.ARM.twists_of(arms.ERRORS))
    seen = np.stack([poses.point(np.array(place)) for place in _PLACES.values()], axis=1).reshape(-1, 3)
    table = frame.loc[np.repeat(np.arange(_STOPS), 3)].reset_index(drop=True)
    seen = seen + scatter_mm * np.repeat(generator.standard_normal((_STOPS, 3)), 3, axis=0)
    seen = seen + 0.02 * generator.standard_normal(seen.shape)
    if not turned:
        table = table.drop(columns=[f"measured_r{axis}_rad" for axis in "xyz"])
    places = rows.vector_columns("target", np.tile([*_PLACES.values()], (_STOPS, 1)))
    names = {"target": np.tile([*_PLACES], _STOPS), "point": np.arange(1, 3 * _STOPS + 1)}
    return table.assign(**rows.vector_columns("measured", seen), **places, **names)


def _problem(table):
    library = {name: find(name, arms.ARM) for name in ("drive_compliance", "encoder_eccentricity")}
    return make_diagnosis_problem(
        table, arms.reading(table), arms.MASSES, 0.02, library, characteristic_length_mm=500.0
    )


@pytest.mark.parametrize(("scatter_mm", "share"), [(0.0, 0.0), (0.02, 0.5), (0.06, 0.9)])
def test_the_scatter_of_an_arm_with_three_reflectors_is_seen(scatter_mm, share):
    found = []
    for seed in range(3):
        problem = _problem(_campaign(scatter_mm, seed))
        linear = problem.linearise(calibrate(problem))
        columns = np.concatenate([linear.base, *linear.columns.values()], axis=-1)
        found.append(alike(linear.data, columns, problem.stop, problem.kind))
    # parameters that are fitted absorb more of what is shared than of the rest, which is taken into account
    assert np.mean(found) == pytest.approx(1.0 + 2.0 * share, abs=0.06)


@pytest.mark.parametrize("turned", [False, True])
def test_a_fold_holds_all_that_was_read_at_a_stop(turned):
    problem = _problem(_campaign(0.0, turned=turned))
    held_out = HeldOut(problem, problem.evidence(problem.linearise(calibrate(problem))))
    row_stop = problem.points["point"].to_numpy() - 1
    stop = row_stop // 3
    assert len(stop) == (6 if turned else 3) * _STOPS
    for number in np.unique(stop):
        assert len(np.unique(held_out.fold[stop == number])) == 1
    # stretches of five stops in turn, of which every fifth is one fold
    assert len(np.unique(held_out.fold)) == 5
    by_stop = held_out.fold[np.unique(stop, return_index=True)[1]]
    pieces = np.split(by_stop, np.flatnonzero(np.diff(by_stop)) + 1)
    assert {len(piece) for piece in pieces[:-1]} == {5}


def _jumping(seed):
    """Residuals of four targets of which one is 25 times as noisy, its runs apart, and their kinds."""
    generator, count = np.random.default_rng(seed), 120
    series = np.arange(4 * count) % 4
    size = np.where(series == 2, 0.5, 0.02)
    return size[:, None] * generator.standard_normal((4 * count, 3)), series


def test_the_rows_of_a_noisy_target_among_quiet_ones_are_no_outliers():
    for seed in range(10):
        residual, series = _jumping(seed)
        assert not isolated(residual, series, 0.0, series).any()
        # of all targets together they would be
        alone = isolated(residual, series, 0.0)
        assert alone.sum() > 10 and (series[alone] == 2).all()


def test_spikes_of_both_are():
    residual, series = _jumping(3)
    quiet, noisy = np.flatnonzero(series == 1)[40], np.flatnonzero(series == 2)[60]
    residual[quiet] += [0.4, 0.0, 0.0]
    residual[noisy] += [0.0, -12.0, 0.0]
    assert np.flatnonzero(isolated(residual, series, 0.0, series)).tolist() == sorted([quiet, noisy])
    # what is a spike of a quiet target is none of a noisy one
    other = np.flatnonzero(series == 2)[20]
    residual[other] += [0.4, 0.0, 0.0]
    assert not isolated(residual, series, 0.0, series)[other]


def test_no_jump_below_the_stated_noise_counts():
    residual, series = _jumping(4)
    quiet = np.flatnonzero(series == 1)[40]
    residual[quiet] += [0.4, 0.0, 0.0]
    assert not isolated(residual, series, 0.05, series).any()


def test_between_stops_in_no_order_slides_come_from_the_stop_before():
    """Of a robot whose platform cannot turn, too: no spline through stops is the path between them."""
    generator = np.random.default_rng(4)
    low, high = gantry.RANGES_MM.T
    drive = low + (high - low) * generator.random((60, 3))
    command = rows.vector_columns("command", gantry.GANTRY.forward(drive))
    frame = pd.DataFrame({"run": 1, "trajectory": "poses", "point": np.arange(1, 61), "status": "ok"})
    frame = frame.assign(**command, **dict(zip(gantry.GANTRY.parts.columns, drive.T, strict=True)))
    frame = frame.assign(**dict.fromkeys(("time_s", "speed_mm_s", "payload_kg"), np.nan))
    frame = frame.assign(**rows.vector_columns("measured", rows.command(frame)))
    motion = make_diagnosis_problem(frame, gantry.GANTRY, Masses(0.0, 0.0, 0.0), 0.01, {}).motion
    effect, width = find("backlash", gantry.GANTRY), 0.02
    made = effect.contribute(motion, np.full(3, width)).twists
    sites = gantry.GANTRY.legs.site_numbers
    for number, part in enumerate(gantry.GANTRY.parts.drives):
        change = made[1:, sites[part.site]] @ part.twist
        np.testing.assert_allclose(change, -0.5 * width * np.sign(np.diff(drive[:, number])), atol=1e-12)


@pytest.mark.parametrize("wrong_mm", [0.0, 2.0])
def test_a_wrong_place_of_a_target_is_unexplained_where_repeats_tell_the_noise(wrong_mm):
    """Its error turns with the platform, and no function follows it from stop to stop: it was called no error."""
    table = _campaign(0.0)
    again = table[table.index < 45].assign(point=lambda frame: frame["point"] + 3 * _STOPS)
    generator = np.random.default_rng(7)
    noise = 0.02 * np.sqrt(2.0) * generator.standard_normal((len(again), 3))
    again = again.assign(**rows.vector_columns("measured", rows.measured(again) + noise))
    table = pd.concat([table, again], ignore_index=True)
    table.loc[table["target"] == "b", "target_x_mm"] += wrong_mm
    robot = MeasuredRobot(arms.reading(table), arms.MASSES, 0.03)
    found = diagnose(table, robot, GapSettings(("backlash", "encoder_eccentricity")))
    verdict, shrink = found.verdict, found.tables["gap_shrink"].query("kind == 'held_out' and trajectory == '*'")
    # a gap and the noise make the held-out error
    parts = np.hypot(shrink["gap_rms_mm"], shrink["noise_rms_mm"])
    np.testing.assert_allclose(parts, shrink["rms_mm"], rtol=0.2)
    assert verdict["effects"] == ("unexplained" if wrong_mm else "none")
    if wrong_mm:
        unexplained = found.tables["gap_budget"].set_index("part").loc["unexplained"]
        assert unexplained["share"] > 0.9 and unexplained["probability"] == pytest.approx(1.0)
