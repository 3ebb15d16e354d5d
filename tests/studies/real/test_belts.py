"""Belt machines: what misses is found, where nothing does there is no alarm, and what is no such set is refused."""

import numpy as np
import pandas as pd
import pytest

from rrru.calibration.lengths import fit_lengths, refit
from rrru.errors import ConfigError, FitError, IngestError
from rrru.studies.real import belts, figures
from rrru.studies.real.lengths_section import Section
from tests.refusals import refusals
from tests.studies.real import simulated_lengths as simulated

MASLOW = {
    "kind": "belts",
    "files": "maslow/run_*.csv",
    "lengths": {"bl": "bl_mm", "br": "br_mm", "tr": "tr_mm", "tl": "tl_mm"},
    "heights_mm": {"bl": 34, "br": 78, "tr": 56, "tl": 100},
}


def _verdict(seed, **options):
    frame, section, _ = simulated.belts(seed, **options)
    return belts.study(frame, section, "simulated")


def _value(tables, name, column="value"):
    return tables["real_parameters"].set_index("parameter").loc[name, column]


def test_no_alarm_where_nothing_misses():
    """Of 12 machines of 3 to 5 belts."""
    effects = [_verdict(seed, count=3 + seed % 3)["real_verdicts"]["effects"][0] for seed in range(12)]
    assert sum(effect != "none" for effect in effects) <= 1


@pytest.mark.parametrize("count", [3, 4, 5])
def test_common_missing_length_is_named_and_measured(count):
    frame, section, anchors = simulated.belts(30 + count, count, missing_mm=60.0)
    tables = belts.study(frame, section, "simulated")
    verdict = tables["real_verdicts"].iloc[0]
    assert (verdict["effects"], verdict["where"]) == ("missing_length", "all belts alike")
    assert verdict["probability"] > 0.9 and verdict["share_closed"] > 0.9
    assert abs(_value(tables, "missing_length") - 60.0) < 4.0 * _value(tables, "missing_length", "standard_error")
    assert "longer than counted" in verdict["notes"] and "too small" in verdict["notes"]
    found = np.array([[_value(tables, f"{name}_{axis}") for axis in "xy"] for name in simulated.NAMES[:count]])
    sizes = [np.linalg.norm(one[:, None] - one, axis=-1) for one in (found, anchors)]
    np.testing.assert_allclose(sizes[0], sizes[1], atol=10.0)


def test_belt_that_alone_misses_a_length_is_named():
    tables = _verdict(5, missing_mm=[0.0, 0.0, 35.0, 0.0])
    verdict = tables["real_verdicts"].iloc[0]
    assert (verdict["effects"], verdict["where"]) == ("missing_length", "c")
    assert _value(tables, "c_missing_length") == pytest.approx(35.0, abs=5.0)


def test_scales_of_belts_are_named():
    scale = np.array([0.003, -0.001, -0.003, 0.001])
    tables = _verdict(6, scale=scale)
    assert tables["real_verdicts"]["effects"][0] == "length_scale"
    found = [_value(tables, f"{name}_scale") - 1.0 for name in "abcd"]
    np.testing.assert_allclose(found, scale, atol=1e-3)


def test_smooth_error_is_unexplained_and_no_missing_length():
    frame, section, _ = simulated.belts(7, rows=99)
    wave = np.array([[np.sin(frame[f"{name}_mm"] / 170.0 + k)] for k, name in enumerate("abcd")])[:, 0].T
    effects = belts.study(frame + wave, section, "simulated")["real_verdicts"]["effects"][0]
    assert "missing_length" not in effects and "unexplained" in effects


def test_tables_hold_together():
    frame, section, _ = simulated.belts(8, missing_mm=50.0)
    frame.loc[12, "b_mm"] += 200.0
    tables = belts.study(frame, section, "simulated")
    steps, points = tables["real_steps"], tables["real_points"]
    assert (steps["parameters"] == steps["identifiable"]).all() and steps["model"].is_unique
    assert steps["train_rms_mm"][1] < 0.3 < steps["train_rms_mm"][0]
    assert steps["held_out_rms_mm"][1] == pytest.approx(0.3, rel=0.3)
    assert len(points) == 4 * len(frame) and points.loc[~points["used"], "row"].eq(13).all()
    assert tables["real_verdicts"]["dropped_points"][0] == 1 and "row 13" in tables["real_verdicts"]["notes"][0]
    again = belts.study(frame, section, "simulated")
    for name, table in tables.items():
        pd.testing.assert_frame_equal(table, again[name])


def test_metres_and_a_held_out_column():
    frame, section, _ = simulated.belts(9, missing_mm=50.0)
    flags = {"held_out": np.arange(len(frame)) % 4 == 0}
    small = belts.study((frame / 1000.0).assign(**flags), section | {"unit": "m"}, "simulated")
    large = belts.study(frame.assign(**flags), section, "simulated")
    np.testing.assert_allclose(_value(small, "missing_length"), _value(large, "missing_length"), rtol=1e-5)
    assert small["real_points"]["row"].nunique() == len(frame)


@refusals("change", "message")
def test_wrong_section_is_refused(change, message):
    frame, section, _ = simulated.belts(0)
    with pytest.raises(ConfigError, match=r"real\.sets\.mine") as error:
        belts.study(frame, section | change, "mine")
    assert message in str(error.value)


def test_section_without_lengths_is_refused():
    frame, section, _ = simulated.belts(0)
    del section["lengths"]
    with pytest.raises(ConfigError, match="no 'lengths'"):
        belts.study(frame, section, "mine")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda frame: frame.drop(columns="c_mm"), "column c_mm: got no such column; allowed: one of a_mm, b_mm, d_mm"),
        (lambda frame: frame.head(2), "got 2 rows; allowed: at least 3"),
        (lambda frame: frame.astype(object).replace(frame.iloc[4, 1], "slack"), "row 5, column b_mm: got 'slack'"),
        (lambda frame: frame.replace(frame.iloc[4, 1], -3.0), "row 5, column b_mm: got"),
        (lambda frame: frame.replace(frame.iloc[4, 1], np.nan), "row 5, column b_mm: got"),
        (lambda frame: frame.replace(frame.iloc[4, 1], np.inf), "row 5, column b_mm: got"),
    ],
)
def test_wrong_readings_are_refused(change, message):
    frame, section, _ = simulated.belts(0)
    with pytest.raises(IngestError) as error:
        belts.study(change(frame), section, "mine")
    assert str(error.value).startswith("simulated.csv") and message in str(error.value)


def test_places_that_are_all_alike_are_refused():
    frame, section, _ = simulated.belts(0)
    with pytest.raises(FitError):
        belts.study(frame.iloc[[0] * 20].reset_index(drop=True), section, "mine")


def test_figure_draws_every_set():
    tables = [_verdict(seed, missing_mm=40.0) for seed in (1, 2)]
    joined = {
        name: pd.concat([one[name].assign(campaign=f"run {k}") for k, one in enumerate(tables)]) for name in tables[0]
    }
    figure = figures.lengths(joined, {})
    assert len(figure.axes) == 6


@pytest.mark.parametrize(
    ("run", "truth", "rms_mm", "anchors"),
    [
        (1, 153.4, (3.64, 0.91, 0.82), (2959.8, 2975.7, 2067.6, 27.3, 2065.7)),
        (4, 0.0, (0.91, 0.91, 0.83), (2962.5, 2978.0, 2064.9, 29.0, 2065.8)),
    ],
)
def test_measured_machine(run, truth, rms_mm, anchors):
    """The reference fits of the data's README, and the owner's statement of what misses."""
    frame = simulated.measured(f"maslow/run_{run}.csv")
    case, _ = belts.length_case(frame, Section(MASLOW, "maslow", belts._NEEDED, belts._OPTIONAL))
    everything = np.ones(case.bare.counted.shape, dtype=bool)
    for effect_models, expected in zip(
        ((), case.effect_models["missing_length"][:1], case.effect_models["missing_length"][-1:]), rms_mm, strict=True
    ):
        model = case.model(effect_models)
        fit = fit_lengths(model, case.starts(model), everything)
        assert fit.rms_mm == pytest.approx(expected, abs=0.006)
        if effect_models == case.effect_models["missing_length"][:1]:
            np.testing.assert_allclose(fit.values[:5], anchors, atol=0.06)
            assert fit.standard_errors[-8] == pytest.approx(3.1, abs=0.05)
    tables = belts.study(frame, MASLOW, "maslow")
    verdict = tables["real_verdicts"].iloc[0]
    assert ("missing_length" in verdict["effects"]) == (run == 1)
    assert run == 4 or verdict["probability"] > 0.95
    error = _value(tables, "missing_length", "standard_error")
    assert abs(_value(tables, "missing_length") - truth) < 2.0 * error
    # neighbouring rows err alike: rows left out one area after another tell what that is worth
    chosen = [*case.effect_models["missing_length"][:1], *case.effect_models["length_scale"]]
    assert error == pytest.approx(_jackknife(case.hypothesis(chosen).fit), rel=0.3)


def _jackknife(fit):
    """Standard error of a common missing length by leaving out one of six areas of the places after another."""
    left_right, low_high = (np.argsort(np.argsort(axis)) / len(axis) for axis in fit.places_mm.T)
    area, found = (3 * left_right).astype(int) + 3 * (2 * low_high).astype(int), []
    for number in range(6):
        less = refit(fit, area != number)
        found.append(less.lengths.machine(less.values)[1][0])
    return np.sqrt(5.0 * np.var(found))
