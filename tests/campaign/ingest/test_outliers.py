"""Broken beams are found; what the robot itself does is not taken for one."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rrru.campaign.ingest.outliers import flag_outliers, frequent_jumps, outliers, reproduced
from rrru.campaign.measurements import vector_columns
from rrru.robots.hexapod import hexapod
from rrru.studies.blind_validation.sentences import page
from rrru.studies.blind_validation.sentences.draws import draw
from tests.places import DATA

NOISE_MM = 0.02
COUNT = 30


def smooth(rng, count=COUNT):
    """Deviations (count, 3) of a geometric error along a line: millimetres, curved."""
    share = np.linspace(-1.0, 1.0, count)[:, None]
    return rng.normal(size=(1, 3)) + rng.normal(size=(1, 3)) * share + 0.5 * rng.normal(size=(1, 3)) * share**2


def noisy(rng, deviation):
    return deviation + rng.normal(scale=NOISE_MM, size=deviation.shape)


def field(name):
    """Deviations (n, 3), runs (n,) and commanded positions (n, 3) of a campaign file."""
    table = pd.read_csv(DATA / name)
    command = table[[f"command_{axis}_mm" for axis in "xyz"]].to_numpy()
    return table[[f"measured_{axis}_mm" for axis in "xyz"]].to_numpy() - command, table["run"].to_numpy(), command


def bad_block(rng, length, size):
    """Errors (length, 3) of at least `size` mm each."""
    error = rng.normal(size=(length, 3))
    return error / np.linalg.norm(error, axis=1, keepdims=True) * rng.uniform(size, 3.0 * size, size=(length, 1))


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10**6), length=st.integers(1, 3), start=st.integers(0, COUNT - 3), alike=st.booleans())
def test_a_block_of_bad_points_is_found_and_nothing_else(seed, length, start, alike):
    rng = np.random.default_rng(seed)
    deviation = noisy(rng, smooth(rng))
    error = bad_block(rng, length, 8.0)
    bad = np.arange(start, start + length)
    deviation[bad] += error[:1] if alike else error
    assert np.array_equal(np.flatnonzero(flag_outliers(deviation, np.ones(COUNT))), bad)


def test_a_single_bad_point_of_a_millimetre_is_found():
    rng = np.random.default_rng(1)
    deviation = noisy(rng, smooth(rng))
    deviation[12, 1] += 1.0
    assert np.flatnonzero(flag_outliers(deviation, np.ones(COUNT))).tolist() == [12]


def test_two_bad_points_apart_are_found():
    rng = np.random.default_rng(2)
    deviation = noisy(rng, smooth(rng))
    deviation[[8, 10]] += [[5.0, 0.0, 0.0], [0.0, -7.0, 0.0]]
    assert np.flatnonzero(flag_outliers(deviation, np.ones(COUNT))).tolist() == [8, 10]


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10**6), at=st.integers(1, COUNT - 1), height=st.floats(0.1, 1.0), back=st.integers(1, COUNT))
def test_steps_of_a_play_that_turns_over_are_left_alone(seed, at, height, back):
    rng = np.random.default_rng(seed)
    deviation = smooth(rng)
    way = rng.normal(size=3)
    deviation[at : at + max(back, 4)] += height * way / np.linalg.norm(way)
    assert not flag_outliers(noisy(rng, deviation), np.ones(COUNT)).any()


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10**6), at=st.integers(0, COUNT - 1), height=st.floats(0.1, 0.4))
def test_small_spikes_of_the_robot_are_left_alone(seed, at, height):
    rng = np.random.default_rng(seed)
    deviation = smooth(rng)
    deviation[at, rng.integers(3)] += height
    assert not flag_outliers(noisy(rng, deviation), np.ones(COUNT)).any()


@pytest.mark.parametrize("period", [4.3, 7.0, 13.0])
def test_a_ripple_is_left_alone(period):
    rng = np.random.default_rng(3)
    wave = 0.4 * np.sin(2.0 * np.pi * np.arange(COUNT)[:, None] / period + [0.0, 1.0, 2.0])
    assert not flag_outliers(noisy(rng, smooth(rng) + wave), np.ones(COUNT)).any()


def test_growth_towards_a_singularity_is_left_alone():
    rng = np.random.default_rng(4)
    deviation = noisy(rng, smooth(rng) - 25.0 / np.arange(1.0, COUNT + 1.0)[:, None] ** 0.7)
    assert not flag_outliers(deviation, np.ones(COUNT)).any()
    assert not flag_outliers(deviation[::-1], np.ones(COUNT)).any()


@pytest.mark.parametrize("name", ["field_01.csv", "field_09.csv"])
def test_campaigns_without_bad_points_get_no_mark(name):
    deviation, run, _ = field(name)
    assert not flag_outliers(deviation, run).any()
    assert not flag_outliers(deviation, run, noise_mm=NOISE_MM).any()


@pytest.mark.parametrize("length", [1, 2, 3])
def test_bad_points_in_a_campaign_are_found(length):
    deviation, run, _ = field("field_09.csv")
    rng = np.random.default_rng(length)
    bad = np.zeros(len(run), dtype=bool)
    for number in np.unique(run):
        rows = np.flatnonzero(run == number)
        start = rng.integers(0, len(rows) - length + 1)
        bad[rows[start : start + length]] = True
    deviation[bad] += bad_block(rng, int(bad.sum()), 8.0)
    marked = flag_outliers(deviation, run)
    assert marked[bad].mean() > 0.97
    assert marked[~bad].mean() < 0.003


def test_runs_do_not_mix_and_rows_without_a_number_are_left_out():
    rng = np.random.default_rng(5)
    first, second = noisy(rng, smooth(rng)), noisy(rng, smooth(rng)) + 50.0
    second[7] += 20.0
    second[20] = np.nan
    deviation, run = np.concatenate([first, second]), np.repeat([2, 1], COUNT)
    assert np.flatnonzero(flag_outliers(deviation, run)).tolist() == [COUNT + 7]


def test_uneven_spacing_is_taken_into_account():
    place = np.sort(np.concatenate([np.linspace(0.0, 1.0, 20), [0.501, 0.503, 0.505]]))
    deviation = 6.0 * np.stack([place**3, np.sin(3.0 * place), place], axis=-1)
    deviation[9] += 2.0
    assert np.flatnonzero(flag_outliers(deviation, np.ones(len(place)), place=place)).tolist() == [9]


@pytest.mark.parametrize("every", [3, 4, 6])
def test_bad_points_too_many_to_be_marked_are_counted(every):
    rng = np.random.default_rng(every)
    deviation, bad = noisy(rng, smooth(rng)), np.arange(1, COUNT, every)
    deviation[bad] += bad_block(rng, len(bad), 2.0)
    assert flag_outliers(deviation, np.ones(COUNT)).sum() < 0.5 * len(bad)
    # the ends are not judged
    np.testing.assert_array_equal(
        np.flatnonzero(frequent_jumps(deviation, np.ones(COUNT))), bad[(bad > 2) & (bad < 27)]
    )


def test_bad_points_at_random_are_nearly_all_counted():
    counted, true, bad_inside = 0, 0, 0
    for seed in range(20):
        rng = np.random.default_rng(seed)
        deviation, bad = noisy(rng, smooth(rng)), rng.choice(COUNT, 7, replace=False)
        deviation[bad] += bad_block(rng, 7, 4.0)
        found = np.flatnonzero(frequent_jumps(deviation, np.ones(COUNT)))
        counted, true = counted + len(found), true + len({*found} & {*bad})
        bad_inside += ((bad > 2) & (bad < 27)).sum()
    assert 0.9 * bad_inside < true <= counted < 1.1 * bad_inside


def test_no_jumps_are_counted_where_few_or_none_are():
    rng = np.random.default_rng(6)
    deviation = noisy(rng, smooth(rng))
    assert not frequent_jumps(deviation, np.ones(COUNT)).any()
    deviation[[4, 20]] += 8.0
    assert not frequent_jumps(deviation, np.ones(COUNT)).any()
    deviation, run, _ = field("field_09.csv")
    assert not frequent_jumps(deviation, run, NOISE_MM).any()


def test_short_runs_are_not_judged_and_wrong_shapes_are_refused():
    deviation = np.zeros((6, 3))
    deviation[3] = 100.0
    assert not flag_outliers(deviation, np.ones(6)).any()
    with pytest.raises(ValueError, match=r"got \(6, 3\) and \(5,\)"):
        flag_outliers(deviation, np.ones(5))


def test_a_spike_that_comes_back_in_another_run_is_the_robots():
    command = np.tile(np.stack([np.arange(COUNT), np.zeros(COUNT), np.zeros(COUNT)], axis=-1) * 20.0, (2, 1))
    deviation = np.zeros((2 * COUNT, 3))
    deviation[[10, COUNT + 10]] = [0.0, 0.0, 3.0]
    deviation[COUNT + 20] = [4.0, 0.0, 0.0]
    run = np.repeat([1, 2], COUNT)
    marked = flag_outliers(deviation, run)
    assert np.flatnonzero(marked).tolist() == [10, COUNT + 10, COUNT + 20]
    assert np.flatnonzero(marked & ~reproduced(marked, deviation, command, run)).tolist() == [COUNT + 20]


@pytest.mark.parametrize("seed", range(20))
def test_of_stops_in_no_order_only_what_is_far_from_all_is_marked(seed):
    """The robot's errors grow e-fold from corner to corner, in no order of the stops; a broken beam stands out."""
    rng = np.random.default_rng(seed)
    command = rng.uniform(-1.0, 1.0, (150, 3))
    grows = np.exp(command.sum(axis=1, keepdims=True) / 6.0)
    deviation = noisy(rng, grows * (1.0 + command @ rng.normal(size=(3, 3))))
    bad = int(rng.integers(10, 140))
    deviation[bad] += bad_block(rng, 1, 60.0)[0]
    marked = outliers(_stops(300.0 * command, 300.0 * command + deviation), 0.001, lambda: np.zeros((150, 3, 0)))
    assert marked[bad] and marked.sum() == 1


def _stops(command_mm, measured_mm):
    """A file's columns of stops in no order."""
    columns = vector_columns("command", command_mm) | vector_columns("measured", measured_mm)
    return pd.DataFrame({"trajectory": "stops", "run": 1.0, **columns})


def _driven_far(rng):
    """A hexapod, stops far from its home in no order, and its drives there."""
    angles = np.radians([0.0, 110.0, 120.0, 230.0, 240.0, 350.0])
    base, plate = (
        np.stack([size * np.cos(at), size * np.sin(at), 0.0 * at], axis=1)
        for size, at in ((400.0, angles), (220.0, angles + np.radians([25.0, -25.0] * 3)))
    )
    robot = hexapod(base, plate, 500.0, parameter_set="full")
    home = robot.inverse(robot.legs.home_mm[None])
    drive = home + rng.uniform(-120.0, 120.0, (300, 6))
    place = robot.forward(drive)
    known = np.isfinite(place).all(axis=1)
    return robot, place[known], drive[known]


@pytest.mark.parametrize("seed", range(12))
def test_errors_of_the_geometry_near_a_singularity_are_no_outliers(seed):
    """A hexapod with legs that are off by some tenths, driven far from home; a broken beam stands out."""
    rng = np.random.default_rng(seed)
    robot, place, drive = _driven_far(rng)
    off = rng.normal(0.0, [0.3 if unit == "mm" else 1e-3 for unit in robot.parameters.units])
    attained = robot.forward(drive, off, place)
    known = np.isfinite(attained).all(axis=1)
    place, drive, measured = place[known], drive[known], noisy(rng, attained[known])
    bad = int(rng.integers(len(place)))
    measured[bad] += bad_block(rng, 1, 60.0)[0]
    marked = outliers(_stops(place, measured), 0.001, lambda: robot.parameter_jacobian(place, drive))
    # very near a singularity the first order is not enough
    assert marked[bad] and marked.sum() <= 2


@pytest.mark.parametrize("wrong", [(), (20,)])
def test_orientations_near_a_singularity_are_no_outliers(wrong, tmp_path):
    """One stop of a right file of a hexapod was one; an orientation that is off by three degrees is one."""
    own = draw(74, 4002, 300, 0.0)
    table = own.file_rows
    table.loc[[*wrong], "measured_rx_rad"] += np.radians(3.0)
    found = page.read(*own.write(tmp_path, table)).measurements
    assert np.flatnonzero(found["status"] == "outlier").tolist() == [*wrong]


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("width", [0.2, 0.5])
def test_a_drive_that_errs_over_a_part_of_its_way_gives_no_outliers(width, seed):
    """Far more than the geometry does: many stops, some of which a singularity magnifies."""
    rng = np.random.default_rng(seed)
    robot, place, drive = _driven_far(rng)
    way = (drive[:, 1] - drive[:, 1].min()) / np.ptp(drive[:, 1])
    error = np.zeros_like(drive)
    error[:, 1] = 0.5 * (way > 1.0 - width)
    off = rng.normal(0.0, [0.02 if unit == "mm" else 1e-4 for unit in robot.parameters.units])
    attained = robot.forward(drive + error, off, place)
    known = np.isfinite(attained).all(axis=1)
    place, drive, measured = place[known], drive[known], noisy(rng, attained[known])
    assert not outliers(_stops(place, measured), 0.001, lambda: robot.parameter_jacobian(place, drive)).any()
