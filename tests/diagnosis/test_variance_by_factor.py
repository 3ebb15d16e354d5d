"""Variance of the gap by factor, and detectability, on gaps put where they are."""

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
import pytest
from scipy.stats import chi2

from rrru.diagnosis.calibrate import calibrate
from rrru.diagnosis.detectability import detectability
from rrru.diagnosis.state import ModelState
from rrru.diagnosis.variance_by_factor import drive_errors, variance_by_factor, worst_spot
from rrru.effects.protocol import Coordinates, plain_coordinates
from rrru.parameters import Parameter, ParameterSet
from tests.diagnosis.campaigns import EFFECTS, NOISE_MM, measure, problem_of
from tests.schemas import check

FACTORS = {"trajectory", "region", "direction", "drive", "motion_direction", "speed", "payload", "time"}


@pytest.fixture(scope="module")
def problem():
    return problem_of(measure())


@pytest.fixture(scope="module")
def linear(problem):
    return problem.linearise(calibrate(problem))


def _located(problem, residual, linear, seed=0):
    table = variance_by_factor(problem, residual, linear.drive, np.random.default_rng(seed), 40)
    return check("gap_locate", table.assign(campaign="made up"))


def _noise(problem, seed):
    return NOISE_MM * np.random.default_rng(seed).standard_normal((len(problem), 3))


def test_shares_of_a_factor_add_up_to_the_whole(problem, linear):
    quiet = replace(problem, noise_mm=1e-9)
    table = _located(quiet, _noise(problem, 0), linear)
    assert set(table["factor"]) == FACTORS
    leg = (
        table["level"]
        .where(table["factor"] == "motion_direction", "")
        .str.extract(r"(leg \d)", expand=False)
        .fillna("")
    )
    for (factor, _), share in table.groupby([table["factor"], leg])["share"]:
        assert share.sum() == pytest.approx(1.0, abs=1e-6), factor
    assert (table["share_low"] <= table["share"]).all() and (table["share"] <= table["share_high"]).all()
    for factor in ("trajectory", "region", "speed", "payload", "time"):
        assert table.loc[table["factor"] == factor, "points"].sum() == len(problem)
        assert table.loc[table["factor"] == factor, "share_of_noise"].sum() == pytest.approx(1.0)


def test_rms_values_are_those_of_the_points(problem, linear):
    residual = _noise(problem, 1)
    table = _located(problem, residual, linear).set_index(["factor", "level"])
    trajectory = problem.measurements["trajectory"].to_numpy()[problem.used]
    for name in pd.unique(trajectory):
        expected = np.sqrt((residual[trajectory == name] ** 2).sum(axis=1).mean())
        assert table.loc[("trajectory", name), "rms_mm"] == pytest.approx(expected)
    for k, axis in enumerate("xyz"):
        assert table.loc[("direction", axis), "rms_mm"] == pytest.approx(np.sqrt((residual[:, k] ** 2).mean()))


def test_drive_errors_make_the_residual(problem, linear):
    residual = _noise(problem, 2)
    found = drive_errors(residual, linear.drive)
    np.testing.assert_allclose(np.einsum("nal,nl->na", linear.drive, found), residual, atol=1e-12)


def test_noise_alone_is_seen_to_be_so(problem, linear):
    """Each row is a test at 5 %: over many draws no factor alarms much more often than that."""
    could = pd.concat([_located(problem, _noise(problem, seed), linear, seed) for seed in range(25)])
    alarms = 1.0 - could.groupby("factor")["noise_could"].mean()
    assert (alarms < 0.12).all() and 0.02 < 1.0 - could["noise_could"].mean() < 0.09


def test_a_gap_on_one_trajectory_is_found_there(problem, linear):
    residual = _noise(problem, 3)
    here = problem.measurements["trajectory"].to_numpy()[problem.used] == "line_2"
    residual[here] += [0.2, -0.1, 0.1]
    found = _located(problem, residual, linear)
    found = found[found["factor"] == "trajectory"].set_index("level")
    assert found.loc["line_2", "share"] > 0.95 and not found.loc["line_2", "noise_could"]
    assert (found.drop(index="line_2")["share"] < 0.05).all()


@pytest.mark.parametrize("axis", range(3))
def test_a_gap_along_one_axis_is_found_there(problem, linear, axis):
    residual = _noise(problem, 4)
    residual[:, axis] += 0.2
    found = _located(problem, residual, linear)
    found = found[found["factor"] == "direction"].set_index("level")["share"]
    assert found["xyz"[axis]] > 0.97


@pytest.mark.parametrize("leg", range(3))
def test_a_gap_of_one_drive_is_found_on_its_leg(problem, linear, leg):
    residual = _noise(problem, 5) + 5e-4 * linear.drive[:, :, leg]
    found = _located(problem, residual, linear)
    found = found[found["factor"] == "drive"].set_index("level")
    assert found.loc[f"leg {leg + 1}", "share"] > 0.95
    assert found.loc[f"leg {leg + 1}", "drive_rms_rad"] == pytest.approx(5e-4, rel=0.05)


def test_a_gap_with_payload_speed_or_time_is_found_there(problem, linear):
    frame = problem.measurements.loc[problem.used]
    for factor, level, here in (
        ("payload", "5 kg", frame["payload_kg"].to_numpy() == 5.0),
        ("speed", "300 mm/s", frame["speed_mm_s"].to_numpy() == 300.0),
        ("time", "quarter 1", frame["time_s"].to_numpy() < frame["time_s"].quantile(0.25)),
        ("motion_direction", "leg 2 falling", problem.motion.drive_rate[problem.used][:, 1] < -1e-6),
    ):
        found = _located(problem, _noise(problem, 6) + 0.2 * here[:, None], linear).set_index(["factor", "level"])[
            "share"
        ]
        assert found[factor, level] > 0.95, factor


def test_the_worst_spot_is_the_middle_of_the_largest_residuals():
    generator = np.random.default_rng(7)
    position = generator.uniform(-300.0, 300.0, (200, 3))
    residual = 0.01 * generator.standard_normal((200, 3))
    centre = position[17]
    residual[np.linalg.norm(position - centre, axis=1) < 120.0] += 1.0
    assert np.linalg.norm(worst_spot(position, residual) - centre) < 120.0
    assert worst_spot(position[:3], residual[:3]).shape == (3,)


_GROWTH = ParameterSet((Parameter("growth", "mm", 0.0, -4.0, 4.0, "made up"),))
_GROWTHS = plain_coordinates(_GROWTH, 0.3)


@dataclass(frozen=True)
class ArmGrowth:
    """What the calibration's dL1 is: one change of L1 on all legs."""

    name: str = "arm_growth"
    parameters: ParameterSet = _GROWTH
    coordinates: Coordinates = _GROWTHS
    needs: tuple = ()
    along_drives = with_waves = None
    switches = False

    def contribute(self, motion, values):
        """Shifts of the elbows along the arms."""
        return motion.along(motion.robot.parts.links["dL1_leg"], np.full((1, 3), values[0]))


def test_an_effect_that_the_calibration_knows_already_cannot_be_seen():
    problem = problem_of(measure(), {"arm_growth": ArmGrowth(), "servo_lag": EFFECTS["servo_lag"]})
    table = detectability(problem, problem.linearise(calibrate(problem))).set_index("effect")
    assert table.loc["arm_growth", "visible_share"] < 1e-6 and not table.loc["arm_growth", "testable"]
    assert "geometric parameters" in table.loc["arm_growth", "note"]
    assert table.loc["servo_lag", "testable"] and table.loc["servo_lag", "confounded_share"] < 0.05


@pytest.fixture(scope="module")
def identified(problem):
    plain = problem.linearise(ModelState(calibrate(problem).deviations, {}))
    return plain, check("gap_identifiability", detectability(problem, plain).assign(campaign="made up")).set_index(
        "effect"
    )


@pytest.mark.parametrize("name", EFFECTS)
def test_the_visible_share_is_what_a_calibration_leaves(problem, identified, name):
    plain, table = identified
    coordinates, left, whole = EFFECTS[name].coordinates, 0.0, 0.0
    for shape in range(len(coordinates.shapes)):
        columns = plain.columns[name, shape].reshape(3 * len(problem), -1) * coordinates.typical
        fitted, *_ = np.linalg.lstsq(plain.base.reshape(3 * len(problem), -1), columns, rcond=None)
        left += ((columns - plain.base.reshape(3 * len(problem), -1) @ fitted) ** 2).sum()
        whole += (columns**2).sum()
    assert table.loc[name, "visible_share"] == pytest.approx(np.sqrt(left / whole), rel=1e-6)
    assert 0.0 <= table.loc[name, "confounded_share"] <= 1.0 and table.loc[name, "confounded_with"] in set(EFFECTS) - {
        name
    }


@pytest.mark.parametrize("name", ["backlash", "base_placement", "thermal_growth", "transmission_error"])
def test_a_gap_of_the_detectable_size_is_detected_nine_times_of_ten(problem, identified, name):
    """Likelihood-ratio tests at 1 % on drawn noise, each of them two least-squares fits."""
    plain, table = identified
    generator, count = np.random.default_rng(11), 3 * len(problem)
    base = plain.base.reshape(count, -1)
    columns = plain.columns[name, 0].reshape(count, -1)
    columns = columns / np.linalg.norm(columns, axis=0)
    base = base / np.linalg.norm(base, axis=0)
    signal = columns @ generator.uniform(0.3, 1.0, columns.shape[1])
    visible = signal - base @ np.linalg.lstsq(base, signal, rcond=None)[0]
    signal *= table.loc[name, "detectable_mm"] / np.sqrt((visible**2).sum() / len(problem))
    draws = 1000
    for gap, rate in ((signal, 0.9), (0.0 * signal, 0.01)):
        data = gap[:, None] + NOISE_MM * generator.standard_normal((count, draws))
        left = []
        for design in (base, np.concatenate([base, columns], axis=1)):
            fitted, _, rank, _ = np.linalg.lstsq(design, data, rcond=1e-9)
            left.append((((data - design @ fitted) ** 2).sum(axis=0) / NOISE_MM**2, rank))
        freedom = left[1][1] - left[0][1]
        found = np.mean(left[0][0] - left[1][0] > chi2.isf(0.01, freedom))
        assert found == pytest.approx(rate, abs=4.0 * np.sqrt(rate * (1.0 - rate) / draws))


def test_effects_that_cannot_be_tested_say_why():
    problem = problem_of(measure().assign(time_s=np.nan))
    table = detectability(problem, problem.linearise(calibrate(problem)))
    table = check("gap_identifiability", table.assign(campaign="made up")).set_index("effect")
    assert (
        set(table.index) == set(EFFECTS)
        and not table.loc["servo_lag", "testable"]
        and "needs" in table.loc["servo_lag", "note"]
    )
