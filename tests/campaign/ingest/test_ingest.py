"""A file that an instrument wrote becomes the measurement table, whatever its form."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from rrru.campaign.ingest.campaign_file import IngestSpec, ingest
from rrru.campaign.ingest.checks import number_runs
from rrru.errors import ConfigError, IngestError
from rrru.robots.catalogue import make_mechanism
from rrru.robots.delta import Delta
from rrru.robots.ptt3 import Ptt3
from rrru.robots.rrru3 import Rrru3
from tests.places import DATA
from tests.schemas import check

ROBOT = Rrru3()
COMMAND = [f"command_{axis}_mm" for axis in "xyz"]
MEASURED = [f"measured_{axis}_mm" for axis in "xyz"]
THETA = [f"theta{k}_rad" for k in (1, 2, 3)]
NAMES = pd.read_csv(DATA / "field_01.csv", nrows=0).columns.to_list()
FACTOR = {"mm": 1.0, "m": 1e-3, "inch": 1.0 / 25.4}


@pytest.fixture(scope="module")
def field():
    return pd.read_csv(DATA / "field_01.csv")


@pytest.fixture(scope="module")
def expected():
    return ingest(IngestSpec(str(DATA / "field_01.csv")), ROBOT).measurements


def written(frame, path):
    """The path of a file that holds the frame."""
    frame.to_csv(path, index=False) if path.suffix == ".csv" else frame.to_parquet(path, index=False)
    return str(path)


def same(table, other, tolerance=0.0):
    pd.testing.assert_frame_equal(table, other, check_exact=tolerance == 0.0, rtol=0.0, atol=tolerance)


@pytest.mark.parametrize(("name", "rows", "runs"), [("field_01.csv", 222, 8), ("field_09.csv", 732, 26)])
def test_a_campaign_is_taken_as_it_stands(name, rows, runs):
    result = ingest(IngestSpec(str(DATA / name)), ROBOT)
    table = check("measurements", result.measurements)
    file = pd.read_csv(DATA / name)
    assert (len(table), table["run"].max()) == (rows, runs)
    assert (table["status"] == "ok").all()
    assert result.notes == ()
    assert result.registration is None
    for column in file:
        assert np.array_equal(table[column].to_numpy(), file[column].to_numpy()), column


def test_drive_angles_alone_do_over_a_whole_campaign(tmp_path):
    """Angles with six decimals determine the commanded positions to a micrometre, far from home as well."""
    table = pd.read_csv(DATA / "field_09.csv")
    path = written(table.drop(columns=COMMAND), tmp_path / "angles.csv")
    found = ingest(IngestSpec(str(path)), ROBOT)
    np.testing.assert_allclose(found.measurements[COMMAND], table[COMMAND], atol=2e-3)


def test_parquet_gives_the_same_table_as_csv(field, expected, tmp_path):
    same(ingest(IngestSpec(written(field, tmp_path / "f.parquet")), ROBOT).measurements, expected)


def test_parquet_with_an_index_of_pandas_and_categories_is_taken(field, expected, tmp_path):
    remaining = field[field["point"] != 4].astype({"trajectory": "category"})
    remaining.to_parquet(tmp_path / "f.parquet")
    same(
        ingest(IngestSpec(str(tmp_path / "f.parquet")), ROBOT).measurements,
        expected[expected["point"] != 4].reset_index(drop=True),
    )


@settings(max_examples=10, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(order=st.permutations(NAMES))
def test_the_order_of_columns_does_not_matter(order, field, expected, tmp_path):
    same(ingest(IngestSpec(written(field[order], tmp_path / "f.csv")), ROBOT).measurements, expected)


@settings(max_examples=12, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(unit=st.sampled_from(sorted(FACTOR)), angle_unit=st.sampled_from(["rad", "deg"]))
def test_units_give_the_same_table(unit, angle_unit, field, expected, tmp_path):
    frame = field.copy()
    frame[COMMAND + MEASURED] *= FACTOR[unit]
    frame[THETA] *= {"rad": 1.0, "deg": 180.0 / np.pi}[angle_unit]
    spec = IngestSpec(written(frame, tmp_path / "f.csv"), unit=unit, angle_unit=angle_unit)
    same(ingest(spec, ROBOT).measurements, expected, tolerance=1e-9)


def test_columns_of_other_names_are_mapped(field, expected, tmp_path):
    mine = {"trajectory": "Path", "measured_x_mm": "X [m]", "time_s": "t", "run": "pass"}
    path = written(field.rename(columns=mine), tmp_path / "f.csv")
    same(ingest(IngestSpec(path, columns=mine), ROBOT).measurements, expected)


def test_what_is_missing_is_computed_and_noted(field, expected, tmp_path):
    path = written(field[["trajectory", *COMMAND, *MEASURED]], tmp_path / "f.csv")
    result = ingest(IngestSpec(path), ROBOT)
    table = check("measurements", result.measurements)
    assert np.array_equal(table[["run", "point"]], expected[["run", "point"]])
    assert np.allclose(table[THETA], expected[THETA], rtol=0.0, atol=1e-6)
    assert table[["time_s", "speed_mm_s", "payload_kg"]].isna().all(axis=None)
    for said in (
        "no column run",
        "no column point",
        "no column time_s",
        "no column speed_mm_s",
        "no column payload_kg",
        "no drive angles",
    ):
        assert any(said in note for note in result.notes), said


def test_passes_along_one_trajectory_are_told_apart_without_run_and_point(tmp_path):
    field = pd.read_csv(DATA / "field_09.csv")
    table = ingest(IngestSpec(written(field.drop(columns=["run", "point"]), tmp_path / "f.csv")), ROBOT).measurements
    assert np.array_equal(table[["run", "point"]], field[["run", "point"]])


@pytest.mark.parametrize("repeated", [False, True])
def test_a_path_that_turns_back_begins_a_run(field, tmp_path, repeated):
    there = field[field["run"] == 1].drop(columns=["run", "point", "time_s"])
    back = there.iloc[::-1].copy() if repeated else there.iloc[-2::-1].copy()
    back[MEASURED] += 0.01
    table = ingest(IngestSpec(written(pd.concat([there, back]), tmp_path / "f.csv")), ROBOT).measurements
    assert table.groupby("run").size().to_list() == [26, len(back)]


def test_a_blank_optional_column_counts_as_missing(field, tmp_path):
    result = ingest(
        IngestSpec(
            written(field.assign(time_s=None, theta1_rad=None, theta2_rad=None, theta3_rad=None), tmp_path / "f.csv")
        ),
        ROBOT,
    )
    assert result.measurements["time_s"].isna().all()
    assert [note[:21] for note in result.notes] == ["column time_s is blan", "no drive angles: thet"]


def test_undeclared_columns_can_be_left_out(field, expected, tmp_path):
    result = ingest(IngestSpec(written(field.assign(humidity=40.0), tmp_path / "f.csv"), extra_columns="ignore"), ROBOT)
    same(result.measurements, expected)
    assert result.notes == ("undeclared columns left out: humidity",)


def test_drive_values_of_another_robot_are_doubted(tmp_path):
    """The arm reaches the positions of a 3-RRRU; three drive angles that are not its own are no reason to trust it."""
    arm = make_mechanism("arm6", {"urdf": str(DATA / "models/arm6.urdf")}, parameter_set="zero")
    spec = IngestSpec(str(DATA / "field_01.csv"), extra_columns="ignore")
    said = [note for note in ingest(spec, arm).notes if note.endswith("see that `robot` is right")]
    assert said == [
        "theta1_rad, theta2_rad, theta3_rad may be drive values of another robot, those of arm6 are axis1_rad to "
        "axis6_rad: see that `robot` is right"
    ]


def test_text_files_of_other_systems_are_taken(expected, tmp_path):
    text = (DATA / "field_01.csv").read_text()
    lines = text.splitlines()
    forms = {
        "a byte-order mark": b"\xef\xbb\xbf" + text.encode(),
        "Windows line ends": text.replace("\n", "\r\n").encode(),
        "empty lines and fields at the end": (text + "\n\n" + "," * 14 + "\n").encode(),
        "spaces": "\n".join(line.replace(",", " , ") for line in lines).encode(),
        "quotes": "\n".join(",".join(f'"{cell}"' for cell in line.split(",")) for line in lines).encode(),
    }
    for form, data in forms.items():
        path = tmp_path / "f.CSV"
        path.write_bytes(data)
        same(ingest(IngestSpec(str(path)), ROBOT).measurements, expected)
        assert form


def test_missing_points_do_not_matter(field, tmp_path):
    remaining = field.drop(index=[0, 4, 5, 60, 221])
    result = ingest(IngestSpec(written(remaining, tmp_path / "f.csv")), ROBOT)
    assert np.array_equal(result.measurements["point"], remaining["point"])
    assert (result.measurements["status"] == "ok").all()


def test_a_broken_beam_is_kept_and_marked(field, tmp_path):
    frame = field.copy()
    frame.loc[[40, 200], "measured_z_mm"] += [12.0, -30.0]
    result = ingest(IngestSpec(written(frame, tmp_path / "f.csv")), ROBOT)
    assert np.flatnonzero(result.measurements["status"] == "outlier").tolist() == [40, 200]
    assert result.notes == ("2 points marked as outliers, in the table but not in fits: row 42, row 202",)
    assert result.measurements["measured_z_mm"].to_list() == frame["measured_z_mm"].to_list()


def test_spikes_too_many_to_be_left_out_are_counted(field, tmp_path):
    frame = field.copy()
    spikes = np.flatnonzero(frame["run"] == 1)[3:-3:4]
    frame.loc[spikes, "measured_z_mm"] += 5.0
    result = ingest(IngestSpec(written(frame, tmp_path / "f.csv")), ROBOT)
    assert (result.measurements["status"] == "ok").all()
    (note,) = result.notes
    assert (
        note.startswith(f"at least {len(spikes)} points jump off their neighbours")
        and f"row {spikes.min() + 2}," in note
    )


def test_stale_readings_are_left_out_and_named(field, expected, tmp_path):
    spoilt = field.copy()
    for row in (8, 100):
        spoilt.loc[row, MEASURED] = field.loc[row - 1, MEASURED].to_numpy()
    result = ingest(IngestSpec(written(spoilt, tmp_path / "file.csv")), ROBOT)
    assert np.flatnonzero(result.measurements["status"] == "stale").tolist() == [8, 100]
    text = "2 stale readings, equal to an earlier one in every digit, left out: row 10, row 102"
    assert text in result.notes


def test_a_run_without_a_number_in_the_file_may_be_short(field, tmp_path):
    """As where a path turns back after its first two points."""
    rows = field.iloc[[0, 1, *range(26, 222)]].drop(columns=["run", "point"])
    table = ingest(IngestSpec(written(rows, tmp_path / "file.csv")), ROBOT).measurements
    assert len(table) == 198 and (table["run"] == 1).sum() == 2


def test_rows_that_seem_shifted_or_far_off_are_noted(field, tmp_path):
    frame = field.copy()
    frame[MEASURED] = field[MEASURED].shift(1)
    shifted = ingest(IngestSpec(written(frame[frame["point"] > 1], tmp_path / "f.csv")), ROBOT).notes
    assert "measured positions fit the command of the row before theirs to 1.6" in shifted[0]
    far = ingest(
        IngestSpec(written(field.assign(measured_x_mm=field["measured_x_mm"] + 40.0), tmp_path / "f.csv")), ROBOT
    ).notes
    assert "measured positions are 41.58 mm from the commanded ones in the median" in far[0]


@settings(max_examples=10, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    turn=st.tuples(*[st.floats(-3.0, 3.0)] * 3),
    shift=st.tuples(*[st.floats(-9000.0, 9000.0)] * 3),
    chosen=st.booleans(),
)
def test_a_tracker_frame_is_registered(turn, shift, chosen, field, tmp_path):
    frame, rotation = field.copy(), Rotation.from_euler("xyz", turn).as_matrix()
    frame[MEASURED] = (field[MEASURED].to_numpy() - shift) @ rotation
    frame.loc[100, MEASURED] += 40.0
    points = ((1, 1), (2, 20), (6, 3), (7, 20), (8, 30)) if chosen else ()
    result = ingest(IngestSpec(written(frame, tmp_path / "f.csv"), frame="register", registration_points=points), ROBOT)
    off = np.delete(np.linalg.norm(result.measurements[MEASURED].to_numpy() - field[MEASURED].to_numpy(), axis=1), 100)
    assert off.max() < 5.0
    assert result.registration.points == (5 if chosen else 221)
    assert result.registration.rms_mm < 1.7
    distance = np.linalg.norm(
        (result.measurements[MEASURED].to_numpy() - result.measurements[COMMAND].to_numpy())[
            result.measurements["status"].eq("ok").to_numpy()
        ],
        axis=1,
    )
    if not chosen:
        assert result.registration.rms_mm == pytest.approx(np.sqrt((distance**2).mean()))
    said = f"distance in space after registration {result.registration.rms_mm:.4g} mm rms"
    assert f"at {result.registration.points} points: {said}" in result.notes[-2]
    assert "errors of the robot's geometry included" in result.notes[-2]
    assert np.flatnonzero(result.measurements["status"] == "outlier").tolist() == [100]


def test_the_other_elbow_can_be_chosen(field, tmp_path):
    frame = field.drop(columns=THETA)
    table = ingest(IngestSpec(written(frame, tmp_path / "f.csv"), elbow="in"), ROBOT).measurements
    assert np.allclose(table[THETA], ROBOT.inverse(field[COMMAND].to_numpy(), elbow="in"))


def test_thousands_of_rows_are_taken(field, tmp_path):
    rng = np.random.default_rng(1)
    copies = []
    for k in range(20):
        frame = field.assign(run=field["run"] + 8 * k, time_s=field["time_s"] + 600.0 * k)
        frame[MEASURED] += rng.normal(scale=0.02, size=(len(field), 3))
        copies.append(frame)
    assert len(ingest(IngestSpec(written(pd.concat(copies), tmp_path / "f.parquet")), ROBOT).measurements) == 4440


@pytest.mark.parametrize(
    ("setting", "said"),
    [
        ({"unit": "cm"}, "unit is 'cm'; allowed: mm, m, inch"),
        ({"angle_unit": "gon"}, "angle_unit is 'gon'; allowed: rad, deg"),
        ({"frame": "tracker"}, "frame is 'tracker'; allowed: robot, register"),
        ({"extra_columns": "keep"}, "extra_columns is 'keep'; allowed: refuse, ignore"),
        ({"elbow": "up"}, "elbow is 'up'; allowed: out, in"),
        ({"columns": {"run": "n", "point": "n"}}, "'n' two meanings"),
        ({"registration_points": ((1, 2),)}, "allowed: frame register"),
        ({"frame": "register", "registration_points": (3, 4, 5)}, r"allowed: pairs \(run, point\)"),
    ],
)
def test_settings_that_do_not_exist_are_refused(setting, said):
    with pytest.raises(ConfigError, match=said):
        IngestSpec("f.csv", **setting)


@pytest.mark.parametrize(
    ("robot", "key"), [(ROBOT, "speed"), (ROBOT, "slider1_mm"), (Ptt3(), "theta1_rad"), (Delta(), "slider1_mm")]
)
def test_names_of_columns_that_the_robot_does_not_have_are_refused(robot, key):
    said = f"key '{key}'; allowed: trajectory, command_x_mm, .*time_s, {robot.parts.columns[0]}, "
    with pytest.raises(ConfigError, match=said):
        ingest(IngestSpec("f.csv", columns={key: "v"}), robot)


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_a_damaged_file_is_taken_or_refused_but_never_breaks(data, tmp_path):
    raw = bytearray((DATA / "field_01.csv").read_bytes()[:4000])
    for _ in range(data.draw(st.integers(1, 5))):
        at = data.draw(st.integers(0, len(raw) - 1))
        raw[at : at + data.draw(st.integers(0, 40))] = data.draw(st.binary(max_size=20))
    (tmp_path / "f.csv").write_bytes(bytes(raw))
    try:
        check("measurements", ingest(IngestSpec(str(tmp_path / "f.csv")), ROBOT).measurements)
    except IngestError as error:
        assert all(set(problem) == {"file", "row", "column", "value", "allowed"} for problem in error.problems)


@pytest.mark.parametrize("several", [False, True])
def test_points_of_a_file_are_numbered_anew_only_where_several_reflectors_are_read_at_one(several):
    frame = pd.DataFrame({"trajectory": "a", "run": 1.0, "point": [1.0, 2.0, 3.0, 4.0], "target": "ball"})
    if several:
        frame["point"] = [1.0, 1.0, 2.0, 2.0]
    numbered, notes = number_runs(frame)
    assert numbered["point"].tolist() == [1.0, 2.0, 3.0, 4.0]
    assert notes == (["points numbered anew, a row each: several reflectors are read at one"] if several else [])
