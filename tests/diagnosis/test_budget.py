"""The budget of a gap: parts that add up, against the parts that were simulated."""

from types import SimpleNamespace

import numpy as np
import pytest

from rrru.calibration.calibrate import calibrate
from rrru.campaign import measurements as rows
from rrru.diagnosis.budget import _noise_parts, _numbers
from rrru.diagnosis.settings import GapSettings
from rrru.estimation.noise_model import NoiseModel
from rrru.estimation.observations.target_positions import TargetPositions
from tests.diagnosis.campaigns import (
    FAST,
    FORWARD,
    MODEL,
    NOISE_MM,
    REVERSE,
    active,
    diagnosed,
    measure,
    plan_of,
    strong,
)


class _Stops:
    """What `_noise_parts` asks of a problem of 20 stops; noise: its NoiseModel."""

    def __init__(self, noise):
        self.noise, self.noise_mm = noise, noise.mean_mm

    def __len__(self):
        return 20


def _budget(frame, noise_mm=NOISE_MM):
    """The table of a diagnosis by part, and the diagnosis."""
    found = diagnosed(frame, noise_mm)
    return found.tables["gap_budget"].set_index("part"), found


def _left(effects):
    """What the calibration leaves (n, 3) of the effects' own, by the exact closure without noise."""
    return calibrate(TargetPositions(MODEL, *_driven(measure(effects, noise_mm=0.0)))).residual_mm


def _driven(frame):
    """Actuator values, measured and commanded positions of a table."""
    return rows.actuators(frame, MODEL), rows.measured(frame), rows.command(frame)


def _shaken(frame, size_mm, seed=3):
    """The table with more noise on every measured position."""
    more = size_mm * np.random.default_rng(seed).standard_normal((len(frame), 3))
    return frame.assign(**rows.vector_columns("measured", rows.measured(frame) + more))


@pytest.fixture(scope="module")
def two():
    """Budget of a robot with two effects, and these."""
    effects = strong("backlash", 5.0), strong("link_flexure", 5.0)
    return *_budget(measure(effects)), effects


def test_the_interval_of_a_probable_cause_is_that_given_that_it_acts():
    """How probable that is has a column of its own; of an improbable one it is that of all draws."""
    draws = np.concatenate([np.zeros(100), np.random.default_rng(0).uniform(0.9, 1.0, 900)])
    _, share, low, high = _numbers(draws, 1.0, draws, np.arange(1000) >= 100)
    assert share == pytest.approx(draws.mean()) and 0.85 < low <= share and high > 0.99
    # one that acts may have no part: signs are those of the model
    _, _, low, _ = _numbers(draws, 1.0, draws, np.arange(1000) >= 50)
    assert low == 0.0
    _, _, low, _ = _numbers(draws, 1.0, draws)
    assert low == 0.0


def test_parts_add_up_to_the_gap(two):
    budget, found, _ = two
    assert budget["share"].drop("sampling").sum() == pytest.approx(1.0, abs=1e-9)
    without = budget.drop("calibration")
    squares = np.sign(without["rms_mm"]) * without["rms_mm"] ** 2
    residual = found.inference.problem.residual(found.inference.calibrated)
    # the calibration has a part of the noise
    noise = 3.0 * (found.inference.problem.noise.axis_mm**2).mean() - budget.loc["calibration", "rms_mm"] ** 2
    assert squares.sum() == pytest.approx((residual**2).sum(axis=1).mean() - noise, rel=0.05)
    assert (budget["share_low"] <= budget["share"]).all() and (budget["share"] <= budget["share_high"]).all()


@pytest.mark.parametrize("seed", [1, 3])
def test_the_share_of_an_only_cause_leaves_the_calibrations_error_to_others(seed):
    """Products of error and noise, which may be larger than that, are in the gap that was measured and no share."""
    effect = strong("backlash", 1.5)
    budget, found = _budget(measure((effect,), seed=seed))
    assert found.verdict["effects"] == "backlash"
    frames = [measure((effect,), seed=seed, noise_mm=size) for size in (0.0, NOISE_MM)]
    left = [calibrate(TargetPositions(MODEL, *_driven(frame))).residual_mm for frame in frames]
    exact, noisy = (rows.measured(frame) - its for frame, its in zip(frames, left, strict=True))
    error, cause = ((one**2).sum(axis=1).mean() for one in (noisy - exact, left[0]))
    share = budget.loc["backlash"]
    assert share["share_low"] <= cause / (cause + error) <= share["share_high"] <= 1.0


def test_each_effects_part_is_what_it_makes_alone(two):
    budget, _, effects = two
    for effect in effects:
        true = np.sqrt((_left((effect,)) ** 2).sum(axis=1).mean())
        assert budget.loc[effect.effect.name, "rms_mm"] == pytest.approx(true, rel=0.15)
        assert budget.loc[effect.effect.name, "probability"] > 0.9
    assert budget.loc["unexplained", "share"] < 0.05 and budget.loc["scatter", "share"] == 0.0


def test_what_does_not_repeat_is_scatter():
    """Half of the mean square is an effect's, the other is noise above what is stated."""
    effect, size = strong("drive_compliance", 6.0), 3.0 * NOISE_MM
    budget, found = _budget(_shaken(measure((effect,)), size))
    assert found.verdict["effects"] == "drive_compliance"
    assert budget.loc["scatter", "rms_mm"] == pytest.approx(np.sqrt(3.0) * size, rel=0.1)
    assert budget.loc["scatter", "probability"] > 0.99
    true = np.sqrt((_left((effect,)) ** 2).sum(axis=1).mean())
    assert budget.loc["drive_compliance", "rms_mm"] == pytest.approx(true, rel=0.15)


def _of_few_stops(generator, noise_mm, count, stated_mm):
    """`_noise_parts` of 20 stops, of whose 60 numbers so many parameters are fitted."""
    basis, _ = np.linalg.qr(generator.standard_normal((60, count)))
    linear = SimpleNamespace(calibration_basis=basis, base=basis.reshape(20, 3, count))
    inference = SimpleNamespace(problem=_Stops(NoiseModel.white(noise_mm)), evidence=SimpleNamespace(linear=linear))
    return _noise_parts(inference, stated_mm, generator, 20000)


def test_of_few_stops_the_noise_above_the_stated_one_is_scatter():
    """Of 60 numbers 27 parameters leave 11 per axis; scatter and instrument are what they are within a tenth."""
    instrument, parts = _of_few_stops(np.random.default_rng(1), 2.0 * NOISE_MM, 27, NOISE_MM)
    scatter, probability = parts["scatter"]
    assert instrument.mean() == pytest.approx(3.0 * NOISE_MM**2, rel=0.1)
    assert scatter.mean() == pytest.approx(9.0 * NOISE_MM**2, rel=0.1)
    assert scatter.std() == pytest.approx(np.sqrt(3.0 * 2.0 / 11.0) * 4.0 * NOISE_MM**2, rel=0.1)
    assert probability > 0.95


@pytest.mark.parametrize("freedom", [2, 4, 11])
def test_draws_of_the_noise_are_those_of_a_mean_of_squares(freedom):
    """Against means of squares of normal numbers, of three axes: no draw is negative."""
    generator = np.random.default_rng(freedom)
    drawn, _ = _of_few_stops(generator, NOISE_MM, 3 * (20 - freedom), None)
    squares = (NOISE_MM * generator.standard_normal((3, freedom, 20000))) ** 2
    expected = squares.mean(axis=1).sum(axis=0)
    at = [0.025, 0.25, 0.5, 0.75, 0.975]
    assert drawn.min() > 0.0
    np.testing.assert_allclose(np.quantile(drawn, at), np.quantile(expected, at), rtol=0.05)


def test_the_scatter_is_unknown_where_no_noise_is_stated():
    budget, _ = _budget(measure(), None)
    assert budget.loc["scatter", "share"] == 0.0 and np.isnan(budget.loc["scatter", "probability"])


def test_what_nothing_predicts_is_unexplained():
    """A bulge of the workspace that no effect makes."""
    frame = measure()
    x, y, _ = (rows.command(frame) / 300.0).T
    bulge = 0.15 * np.stack([np.sin(4.0 * x) * np.cos(5.0 * y), 0.0 * x, np.sin(5.0 * x + 3.0 * y)], axis=1)
    frame = frame.assign(**rows.vector_columns("measured", rows.measured(frame) + bulge))
    budget, found = _budget(frame)
    assert "unexplained" in found.verdict["effects"] and budget.loc["unexplained", "probability"] > 0.9
    total = (calibrate(TargetPositions(MODEL, *_driven(frame))).residual_mm ** 2).sum(axis=1).mean() - 3.0 * NOISE_MM**2
    assert budget.loc["unexplained", "rms_mm"] ** 2 > 0.5 * total


def test_whoever_does_not_know_the_weight_still_knows_what_gives_way_in_all():
    """With one load a compliance is determined no better than the mass; its part of the gap is."""
    frame = measure((active("drive_compliance", [8e-8, 6e-8, 9e-8]),), plan=plan_of((FORWARD, REVERSE, FAST)))
    known = {"weight": {"extra_kg": 0.0, "lean_x": 0.0, "lean_y": 0.0}}
    shares, errors = [], []
    for settings in (GapSettings(draws=400), GapSettings(draws=400, known=known)):
        tables = diagnosed(frame, settings=settings).tables
        own = tables["gap_budget"].set_index("part").loc["drive_compliance"]
        shares.append(own["share_high"] - own["share_low"])
        errors.append(tables["gap_parameters"].query("effect == 'drive_compliance'")["standard_error"].mean())
    assert errors[0] > 5.0 * errors[1]
    assert shares[0] < 1.5 * shares[1]


@pytest.mark.parametrize("strengths", [(8.0, 12.0), (10.0, 5.0)])
def test_a_large_effect_has_a_name_where_another_one_could_explain_most_of_it(strengths):
    """Next to something unexplained a small effect has none; each of these two alone explains most of their sum."""
    names = "drive_compliance", "link_flexure"
    frame = measure(tuple(map(strong, names, strengths)))
    passed = 2.0 * frame["time_s"] / frame["time_s"].max() - 1.0
    frame["measured_z_mm"] += 0.15 * passed**2
    frame["measured_x_mm"] -= 0.08 * (4.0 * passed**3 - 3.0 * passed)
    assert {*diagnosed(frame, NOISE_MM).verdict["effects"].split("+")} == {*names, "unexplained"}
