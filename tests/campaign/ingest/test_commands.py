"""What was commanded comes from a second file, row by row the right one, or the files are refused."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rrru.campaign.ingest.campaign_file import ingest
from rrru.campaign.ingest.spec import IngestSpec
from rrru.errors import IngestError
from rrru.robots.rrru3 import Rrru3
from tests.places import DATA

ROBOT = Rrru3()
FIELD = pd.read_csv(DATA / "field_01.csv").head(52).drop(columns=["theta1_rad", "theta2_rad", "theta3_rad"])
COMMAND = [f"command_{axis}_mm" for axis in "xyz"]
MEASURED = [f"measured_{axis}_mm" for axis in "xyz"]
NAMED = FIELD.assign(name=[f"P{k}" for k in range(len(FIELD))])


def joined(folder, measured, commands, **more):
    """What ingest makes of two files."""
    measured.to_csv(folder / "m.csv", index=False)
    commands.to_csv(folder / "c.csv", index=False)
    section = {"ingest": str(folder / "m.csv"), "commands": str(folder / "c.csv")} | more
    return ingest(IngestSpec.from_config(section), ROBOT)


def problems_of(folder, measured, commands, **more):
    """Problems with which two files are refused."""
    with pytest.raises(IngestError) as caught:
        joined(folder, measured, commands, **more)
    return caught.value.problems


@settings(max_examples=8, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(seed=st.integers(0, 99))
def test_names_join_whatever_the_order_of_the_commands(seed, tmp_path):
    measured = NAMED[["name", "trajectory", *MEASURED]].drop(index=[3, 40])
    commands = NAMED[["name", *COMMAND]].sample(frac=1.0, random_state=seed)
    result = joined(tmp_path, measured, commands)
    assert np.array_equal(result.measurements[COMMAND], FIELD.drop(index=[3, 40])[COMMAND])
    assert result.notes[0].endswith("joined by the points' names; 2 of its points were not measured")


def test_a_name_of_the_measured_file_s_own_joins_as_well(tmp_path):
    measured = NAMED[["name", "trajectory", *MEASURED]].rename(columns={"name": "Punkt"})
    result = joined(tmp_path, measured, NAMED[["name", *COMMAND]].iloc[::-1], columns={"name": "Punkt"})
    assert np.array_equal(result.measurements[COMMAND], FIELD[COMMAND])


def test_a_point_measured_twice_has_its_command_twice(tmp_path):
    again = NAMED.assign(run=NAMED["run"] + 2, time_s=NAMED["time_s"] + 900.0)
    again[MEASURED] += 0.01
    measured = pd.concat([NAMED, again])[["name", "trajectory", "run", *MEASURED]]
    result = joined(tmp_path, measured, NAMED[["name", *COMMAND]])
    assert np.array_equal(result.measurements[COMMAND], pd.concat([FIELD, FIELD])[COMMAND])


def test_files_without_names_are_joined_by_their_order(tmp_path):
    result = joined(tmp_path, FIELD[["trajectory", *MEASURED]], FIELD[COMMAND])
    assert np.array_equal(result.measurements[COMMAND], FIELD[COMMAND])
    assert "joined by their order" in result.notes[0]


def test_another_number_of_rows_without_names_is_refused(tmp_path):
    problems = problems_of(tmp_path, FIELD[["trajectory", *MEASURED]], FIELD[COMMAND].head(50))
    assert "52 measured rows and 50 commands" in problems[0]["value"] and "`name`" in problems[0]["allowed"]


def test_a_name_without_a_command_is_refused_with_its_row(tmp_path):
    problems = problems_of(tmp_path, NAMED[["name", "trajectory", *MEASURED]], NAMED[["name", *COMMAND]].drop(index=7))
    assert [(p["row"], p["value"]) for p in problems] == [(9, "'P7'")]


def test_a_name_commanded_twice_is_refused(tmp_path):
    twice = pd.concat([NAMED, NAMED.head(1)])[["name", *COMMAND]]
    problems = problems_of(tmp_path, NAMED[["name", "trajectory", *MEASURED]].head(50), twice)
    assert "'P0' twice" in problems[0]["value"]


def test_a_column_in_both_files_is_refused(tmp_path):
    problems = problems_of(tmp_path, NAMED[["name", "trajectory", *MEASURED]], NAMED[["name", "trajectory", *COMMAND]])
    assert problems[0]["column"] == "trajectory" and "in one of the files" in problems[0]["allowed"]


def test_what_is_wrong_in_the_commands_is_told_of_their_file_and_row(tmp_path):
    commands = NAMED[["name", *COMMAND]].astype(object)
    commands.loc[5, "command_y_mm"] = "left"
    commands = commands.iloc[::-1]
    problems = problems_of(tmp_path, NAMED[["name", "trajectory", *MEASURED]], commands)
    assert [(p["file"], p["row"], p["value"]) for p in problems] == [(str(tmp_path / "c.csv"), 48, "'left'")]
