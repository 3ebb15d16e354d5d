"""A small arm of a made-up user through the whole of the study, and what of it is refused."""

import json

import numpy as np
import pytest
import yaml

from rrru.diagnosis.settings import GapSettings
from rrru.errors import ConfigError, IngestError
from rrru.store.tables import check
from rrru.studies.real import arm_tables, arms, carry, figures
from rrru.studies.real.schemas import TABLES
from rrru.studies.real.series import found
from tests.places import ROOT
from tests.studies.real import simulated_arm

ROBOTS = {"arm": simulated_arm.robot()}


def _series(folder, raw, **changes):
    (folder / "arm").mkdir(exist_ok=True)
    raw.to_csv(folder / "arm" / "log_x.csv", index=False)
    return found({"folder": str(folder), "sets": {"mine": simulated_arm.section(**changes)}}, "mine")[0]


def _settings():
    config = yaml.safe_load((ROOT / "config.yaml").read_text())
    effects = {"effects": ["backlash", "drive_compliance", "encoder_eccentricity"]}
    return GapSettings.from_config(config["gap"] | effects, config["seed"])


@pytest.fixture(scope="module")
def studied(tmp_path_factory):
    folder = tmp_path_factory.mktemp("arm")
    series = _series(folder, simulated_arm.log(80))
    return arms.study(series, ROBOTS, _settings(), folder / "sheet.parquet")


def test_compliance_and_lost_zero_of_a_strange_arm_are_named(studied):
    row = arm_tables.tables(studied)["real_verdicts"].iloc[0]
    assert row["effects"] == "drive_compliance" and row["probability"] > 0.8
    assert "joint 4: zero, or the part that it moves, is off by 2" in row["notes"]
    assert row["held_out_rms_mm"] < 0.03 < row["held_out_b_rms_mm"]
    assert row["predicted_share"] == pytest.approx(row["held_out_share"], abs=0.05)


def test_models_get_better_and_carry(studied):
    steps = arm_tables.tables(studied)["real_steps"].set_index("model")["held_out_rms_mm"]
    assert steps["a"] > 5.0 * steps["b"] > 5.0 * steps["c"]
    numbers = json.loads(json.dumps(carry.saved_values(studied)))
    one = carry.model(studied.series, numbers, studied.measurements, ROBOTS, _settings())
    other = carry.carried([one, one])
    assert (other["causes_rms_mm"] < 0.03).all()


def test_a_short_series_is_calibrated_but_not_diagnosed(tmp_path):
    series = _series(tmp_path, simulated_arm.log(10))
    short = arms.study(series, ROBOTS, _settings(), tmp_path / "sheet.parquet")
    tables = {name: frame.assign(campaign="mine") for name, frame in arm_tables.tables(short).items()}
    row = tables["real_verdicts"].iloc[0]
    assert row["effects"] == "undiagnosed" and np.isnan(row["probability"])
    assert row["held_out_rms_mm"] == row["held_out_b_rms_mm"] < 1.0
    assert "too few for a diagnosis" in row["notes"]
    for schema in TABLES:
        if len(tables.get(schema.name, ())):
            check(schema, tables[schema.name].reindex(columns=schema.names))
    empty = {"real_budget": tables["real_points"].iloc[:0].assign(kind="", share=0.0, part="")}
    empty["real_budget"] = empty["real_budget"].assign(share_low=0.0, share_high=0.0)
    figures.steps(tables | empty, {"set": "mine"})
    figures.spectrum(tables, {"set": "mine"})


def test_a_far_off_held_out_reading_is_named(tmp_path):
    raw = simulated_arm.log(60)
    raw.loc[40, [*"XYZ"]] += 5.0
    known = arms.prepared(_series(tmp_path, raw), ROBOTS, tmp_path / "sheet.parquet")
    row = arm_tables.tables(arms.studied(known, _settings()))["real_verdicts"].iloc[0]
    reading = "row 41 of tcp"
    assert (
        f"far off among those held out: {reading}; without: 0.0" in row["notes"]
        or f"in the table but not in fits: {reading}" in row["notes"]
    )


def test_without_held_out_rows_there_is_a_diagnosis(tmp_path):
    series = _series(tmp_path, simulated_arm.log(50).assign(held_out=0))
    row = arm_tables.tables(arms.study(series, ROBOTS, _settings(), tmp_path / "sheet.parquet"))["real_verdicts"]
    assert row["held_out_rms_mm"].isna().all() and row["effects"].iloc[0] == "drive_compliance"


def _refused(folder, message, raw=None, robots=ROBOTS, error=ConfigError, **changes):
    series = _series(folder, simulated_arm.log(30) if raw is None else raw, **changes)
    with pytest.raises(error, match=message):
        arms.study(series, robots, _settings(), folder / "sheet.parquet")


def test_joints_have_to_be_the_robots(tmp_path):
    five = {"arm": {"dh": ROBOTS["arm"]["dh"][:5]}}
    _refused(tmp_path, r"mine\.joints: got q6_rad; allowed: q1_rad, .* of robot arm", robots=five)
    few = {f"q{k}_rad": f"J{k}" for k in range(1, 6)}
    _refused(tmp_path, r"mine\.joints: got no q6_rad for .*log_x\.csv", joints=few)


def test_orientations_have_to_fit_the_positions(tmp_path):
    reading = simulated_arm.section()["readings"]["tcp"]
    for change in ({"sequence": "XYZ"}, {"rotation_unit": "rad"}):
        _refused(
            tmp_path,
            r"log_x.csv, column measured_qx, .*: got orientations that differ by",
            error=IngestError,
            readings={"tcp": reading | change},
        )


def test_wrong_units_and_rows_that_come_twice_are_refused_by_the_files_names(tmp_path):
    _refused(tmp_path, r"log_x\.csv, .*angle_unit: deg", error=IngestError, angle_unit="rad")
    raw = simulated_arm.log(30)
    # a few would be stale readings, which are left out
    for row in (7, 9, 11, 13):
        raw.loc[row, [*"XYZ"]] = raw.loc[2, [*"XYZ"]]
    _refused(tmp_path, r"log_x\.csv, row 8, column X, Y, Z: .* row 3 of tcp", raw, error=IngestError)


def test_chains_have_to_be_there_and_of_their_form(tmp_path):
    section = {"chain": "chain.json", "robot": None}
    series = _series(tmp_path, simulated_arm.log(10), **section)
    for text, message in ((None, "No such file"), ("{", "JSON"), ("{}", "KeyError 'masses'"), ("[]", "TypeError")):
        if text is not None:
            (tmp_path / "arm" / "chain.json").write_text(text)
        with pytest.raises(ConfigError, match=rf"real\.sets\.mine\.chain: .*chain\.json.*{message}"):
            arms.nominal_robot(series, ROBOTS)
