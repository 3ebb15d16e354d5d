"""The counts over redraws against the published rows' own computation, and orders and spikes by hand."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import yaml

from rrru.pipeline import config as parts
from rrru.pipeline import setup
from rrru.studies.rrru3 import paper, redraw, twin
from rrru.studies.rrru3 import study_numbers as numbers
from rrru.studies.rrru3.schemas import TABLES
from tests.places import ROOT

PATTERNS = (["line_1"], ["spiral"])
CONFIG = yaml.safe_load((ROOT / "config.yaml").read_text())


@pytest.fixture(scope="module")
def campaign():
    return setup.virtual_campaign(parts.nominal(CONFIG, "paper"), parts.virtual(CONFIG, "paper"))


@pytest.fixture(scope="module")
def found(campaign):
    return redraw.redraws(redraw.draws(campaign, PATTERNS, "least_mean_distance", range(3)))


def valid(name, frame):
    return next(table for table in TABLES if table.name == name).pandera().validate(frame)


def test_every_target_stands_in_every_draw(found):
    valid("redraws", found)
    items = {number.item for number in paper.ERRORS} | {number.item for number in paper.ORDERS}
    assert set(found["item"]) == items and len(found) == 3 * len(items)
    orders = found["kind"] == "order"
    assert (found.loc[orders, "met"] == (found.loc[orders, "value"] > 0.0)).all()
    printed = found.loc[~orders, "item"].map(paper.ERRORS_MM)
    off = found.loc[~orders, "value"] / printed - 1.0
    limit = found.loc[~orders, "item"].isin(numbers.UPPER_LIMITS)
    assert (found.loc[~orders, "met"] == np.where(limit, off <= 0.15, abs(off) <= 0.15)).all()


def test_a_robot_that_repeats_itself_has_one_answer(campaign):
    still = replace(campaign, robot=replace(campaign.robot, non_repeatability_mm=0.0), noise_mm=0.0)
    drawn = redraw.draws(still, PATTERNS, "least_squares", range(2))
    values = redraw.redraws(drawn).set_index(["draw", "item"])["value"]
    assert values[0].to_dict() == values[1].to_dict()
    # driven again by the way that every campaign goes
    measurements, _ = still.run()
    target, first = numbers_of(measurements)
    size = np.linalg.norm(first - target, axis=1)[measurements["trajectory"] == "line_1"]
    assert values[0, "group1_before_max"] == pytest.approx(size.max(), abs=1e-9)


def test_a_campaign_with_a_draw_measures_what_that_draw_of_the_others_has(campaign):
    chosen = replace(campaign, draw=2)
    (drawn,) = redraw.draws(campaign, PATTERNS, "least_squares", [2])
    measurements, _ = chosen.run()
    target, measured = numbers_of(measurements)
    np.testing.assert_allclose(measured - target, drawn.errors_mm[0], atol=1e-12)
    again, _ = chosen.run(label="closed_loop")
    assert not np.allclose([*numbers_of(again)][1], measured)
    assert redraw.others(chosen, 3) == [0, 1, 3] and redraw.others(campaign, 3) == [0, 1, 2]


def test_the_configured_draw_is_nearer_to_the_paper_than_others(campaign):
    assert campaign.draw is not None
    chosen = [*redraw.others(campaign, 6), campaign.draw]
    ranks = redraw.draw_ranks(redraw.draws(campaign, PATTERNS, "least_mean_distance", chosen))
    assert ranks["draw"].iloc[0] == campaign.draw and (ranks["misfit"].diff().dropna() >= 0.0).all()


def test_bands_hold_nine_of_ten_draws_at_every_point(campaign):
    drawn = redraw.draws(campaign, PATTERNS, "least_squares", range(4))
    bands = valid("redraw_errors", redraw.redraw_errors(drawn, campaign.plan.commands(campaign.robot.mechanism)))
    assert len(bands) == 3 * len(drawn[0].errors_mm[0])
    row = bands[(bands["calibration"] == "spiral") & (bands["trajectory"] == "line_2") & (bands["point"] == 5)].iloc[0]
    place = 26 + 4
    sizes = sorted(np.linalg.norm(draw.errors_mm[2][place]) for draw in drawn)
    assert row["error_mm_low"] == pytest.approx(sizes[0] + 0.15 * (sizes[1] - sizes[0]))
    assert row["error_x_mm_high"] == pytest.approx(np.quantile([draw.errors_mm[2][place, 0] for draw in drawn], 0.95))


def numbers_of(frame):
    return (frame[[f"{kind}_{axis}_mm" for axis in "xyz"]].to_numpy() for kind in ("command", "measured"))


def test_counts_by_hand():
    rows = [(0, "a", "number", 1.0, True), (0, "b", "order", -0.1, False), (0, "c", "order", 0.2, True)]
    rows += [(1, "a", "number", 3.0, False), (1, "b", "order", 0.1, True), (1, "c", "order", 0.4, True)]
    found = pd.DataFrame(rows, columns=["draw", "item", "kind", "value", "met"])
    counts = valid("redraw_counts", redraw.redraw_counts(found)).set_index("item")
    assert counts["met"].to_dict() == {"a": 1, "b": 1, "c": 2, "numbers": 1, "orders": 1, "all": 0}
    assert counts["targets"].to_dict() == {"a": 1, "b": 1, "c": 1, "numbers": 1, "orders": 2, "all": 3}
    assert (counts["draws"] == 2).all()
    assert counts["median"].to_dict() == pytest.approx(
        {"a": 2, "b": 0, "c": 0.3, "numbers": 0.5, "orders": 1.5, "all": 2}
    )


def test_without_draws_the_tables_are_empty(campaign):
    empty = redraw.redraws(redraw.draws(campaign, PATTERNS, "least_squares", []))
    assert valid("redraw_errors", redraw.redraw_errors([], campaign.plan.commands(campaign.robot.mechanism))).empty
    assert valid("redraws", empty).empty and valid("redraw_counts", redraw.redraw_counts(empty)).empty


def test_spikes_are_narrow_peaks_above_the_printed_range():
    trajectory, size = np.full(26, "line_1"), np.linspace(4.0, 8.0, 26)
    assert pytest.approx(1.220 - 0.294) == numbers.SPIKE_MM
    error = np.zeros((26, 3))
    error[:, 0] = size
    assert numbers.spike_orders(trajectory, error, error)["spikes_before"] == -1.0
    error[[5, 12, 19], 0] += 1.5
    margins = numbers.spike_orders(trajectory, error, 0.1 * error)
    # the line rises by 0.16 mm from point to point
    assert margins["spikes_before"] == pytest.approx((1.5 - 0.16) / 0.926 - 1.0)
    assert margins["spikes_after"] == pytest.approx(1.0 - 0.134 / 0.926)
    wide = np.zeros((26, 3))
    wide[:, 0] = 6.0 + 3.0 * np.sin(np.linspace(0.0, 6.0 * np.pi, 26))
    assert numbers.spike_orders(trajectory, wide, wide)["spikes_before"] < 0.0


def test_links_are_the_same_as_far_as_the_printed_ones():
    printed = [[table[name] for name in ("dL1", "dL2", "dL3")] for table in (paper.TABLE_5, paper.TABLE_6)]
    assert numbers.link_order(*printed)["links"] == pytest.approx(0.0)
    assert numbers.link_order([0.0, 0.0, 0.0], [0.01, 0.0, -0.04])["links"] == pytest.approx(0.0881 / 0.04 - 1.0)


def test_the_searched_numbers_are_listed_with_their_bounds():
    virtual = parts.virtual(CONFIG, "paper")
    frame = valid("twin_numbers", twin.numbers(virtual)).set_index("name")
    assert frame.index.tolist() == list(twin.SEARCH_BOUNDS)
    assert frame.loc["wobble_mm", "value"] == virtual["robot"]["wobble_mm"]
    moved = {**virtual, "robot": {**virtual["robot"], "wobble_mm": 0.2001}}
    assert twin.numbers(moved).set_index("name").loc["wobble_mm", "at_bound"]
    # its sign alone counts
    assert not frame.loc["side", "at_bound"]
    assert valid("twin_numbers", twin.numbers(parts.virtual(CONFIG, "crooked"))).empty
