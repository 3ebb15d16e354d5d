"""What is said of a file before anything runs is right, and the proposed overlay reads the file."""

from pathlib import Path

import jsonschema
import numpy as np
import pandas as pd
import pytest
import yaml
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from rrru import cli
from rrru.campaign import measurements as rows
from rrru.campaign.ingest.campaign_file import ingest
from rrru.campaign.ingest.spec import IngestSpec
from rrru.pipeline import config as parts
from rrru.pipeline import setup
from rrru.pipeline.data_check.check_data import check_file, print_check
from rrru.pipeline.read_config import read_config
from rrru.robots.rrru3 import Rrru3
from tests.campaign.ingest.samples import SAMPLES, section
from tests.places import DATA, ROOT

ROBOT = Rrru3()
CONFIG = read_config([ROOT / "config.yaml"]) | {"campaigns": {}}
SCHEMA = yaml.safe_load((ROOT / "rrru" / "pipeline" / "config.schema.yaml").read_text())
FIELD = pd.read_csv(DATA / "field_09.csv")
LENGTHS = [f"{name}_{axis}_mm" for name in ("command", "measured") for axis in "xyz"]


def main(arguments):
    """The exit code of `rrru check` under the studies' configuration."""
    return cli.main(["check", *arguments, *([] if "--config" in arguments else ["--config", "config.yaml"])])


def proposed(found):
    """The only section of the overlay as it is read from what is printed."""
    overlay = yaml.safe_load(yaml.safe_dump(found.overlay))
    jsonschema.validate(overlay["campaigns"], SCHEMA["properties"]["campaigns"] | {"$defs": SCHEMA["$defs"]})
    return next(iter(overlay["campaigns"].values()))


def checked(frame, folder, robot="rrru3", **config):
    """The check of a file that holds a frame."""
    frame.to_csv(folder / "mine.csv", index=False)
    return check_file(folder / "mine.csv", CONFIG | config, robot)


def costs(found):
    """What is said of costs."""
    return [line.removeprefix("cost: ") for line in found.lines if line.startswith("cost: ")]


@pytest.mark.parametrize("name", SAMPLES)
def test_the_proposed_overlay_reads_a_sample_as_its_own_declaration_does(name):
    own = section(name)
    found = check_file(own["ingest"], CONFIG, "rrru3", own.get("commands"))
    assert found.refused == ()
    table = ingest(IngestSpec.from_config(proposed(found)), ROBOT).measurements
    pd.testing.assert_frame_equal(table, ingest(IngestSpec.from_config(own), ROBOT).measurements)


@pytest.mark.parametrize(
    ("unit", "factor", "turned"), [("m", 1e-3, False), ("inch", 1.0 / 25.4, True), ("mm", 1.0, True)]
)
def test_units_frame_and_names_are_proposed(unit, factor, turned, tmp_path):
    frame = FIELD.copy()
    if turned:
        measured = [f"measured_{axis}_mm" for axis in "xyz"]
        frame[measured] = frame[measured].to_numpy()[:, [1, 2, 0]] + 2000.0
    frame[LENGTHS] *= factor
    degrees = [f"theta{k}_rad" for k in (1, 2, 3)]
    frame[degrees] = np.degrees(frame[degrees])
    names = {"trajectory": "Path", "time_s": "Time [s]", "command_x_mm": "Goal X", "measured_y_mm": "Meas Y"}
    found = checked(frame.rename(columns=names), tmp_path)
    chosen = proposed(found)
    assert chosen["columns"] == names and chosen["angle_unit"] == "deg"
    assert (chosen.get("unit", "mm"), chosen.get("frame", "robot")) == (unit, "register" if turned else "robot")
    table = ingest(IngestSpec.from_config(chosen), ROBOT).measurements
    assert np.allclose(table[LENGTHS[:3]], FIELD[LENGTHS[:3]], rtol=0.0, atol=1e-6)


def test_units_in_the_header_stay_whatever_else_is_wrong(tmp_path):
    """A cell that is no number hides from ingest whether the rest fits; the frame stays the robot's."""
    frame = FIELD.copy()
    frame[LENGTHS] /= 25.4
    degrees = [f"theta{k}_rad" for k in (1, 2, 3)]
    frame[degrees] = np.degrees(frame[degrees])
    names = {name: f"{name.split('_')[0]} {name.split('_')[1]} [in]" for name in LENGTHS}
    names |= {name: f"{name.removesuffix('_rad')} [deg]" for name in degrees}
    frame = frame.astype({"measured_x_mm": object}).rename(columns=names)
    frame.loc[5, "measured x [in]"] = "n/a"
    found = checked(frame, tmp_path)
    chosen = proposed(found)
    assert (chosen["unit"], chosen["angle_unit"], "frame" in chosen) == ("inch", "deg", False)
    assert chosen["columns"] == names and [problem["row"] for problem in found.refused] == [7]


def test_a_tracker_s_list_below_lines_of_other_things_is_known(tmp_path):
    own = section("leica")
    path = tmp_path / "above.csv"
    path.write_bytes(b"Job: 4711\nOperator: me, second shift\n\n" + Path(own["ingest"]).read_bytes())
    found = check_file(path, CONFIG, "rrru3", own["commands"])
    assert found.refused == () and proposed(found)["format"] == "leica"
    table = ingest(IngestSpec.from_config(proposed(found)), ROBOT).measurements
    pd.testing.assert_frame_equal(table, ingest(IngestSpec.from_config(own), ROBOT).measurements)


def test_german_headers_are_read(tmp_path):
    names = {"trajectory": "Bahn", "time_s": "Zeit", "point": "Nr", "speed_mm_s": "Geschwindigkeit"}
    names |= {f"command_{axis}_mm": f"Soll {axis.upper()}" for axis in "xyz"}
    names |= {f"measured_{axis}_mm": f"Ist {axis.upper()}" for axis in "xyz"}
    frame = FIELD[list(names)].rename(columns=names)
    frame.to_csv(tmp_path / "a.csv", index=False, sep=";", decimal=",")
    found = check_file(tmp_path / "a.csv", CONFIG, "rrru3")
    assert found.refused == () and proposed(found)["columns"] == names
    frame["Punkt"] = [f"P{k}" for k in range(len(frame))]
    frame.drop(columns="Nr").to_csv(tmp_path / "a.csv", index=False, sep=";", decimal=",")
    found = check_file(tmp_path / "a.csv", CONFIG, "rrru3")
    assert found.refused == () and proposed(found)["columns"]["name"] == "Punkt"


@pytest.mark.parametrize(
    ("named", "left_out"),
    [
        ("delta", ()),
        ("ptt3", LENGTHS[:3]),
        ("delta", ("theta1_rad", "theta2_rad", "theta3_rad")),
    ],
)
def test_a_file_of_another_robot_names_that_robot(named, left_out, tmp_path):
    """By what drives it to where it was sent, by the names of the drives, by what is within reach."""
    robots = {name: CONFIG["robots"][name] for name in ("rrru3", "ptt3", "delta", "arm6_file")}
    found = checked(FIELD.head(60).drop(columns=[*left_out]), tmp_path, named, robots=robots)
    hints = [line for line in found.lines if line.startswith("wrong robot?")]
    assert found.refused and len(hints) == 1 and "rrru3" in hints[0] and "arm6_file would" not in hints[0]


def test_a_bad_cell_does_not_make_the_robot_wrong(tmp_path):
    frame = FIELD.copy()
    frame.loc[5, "measured_x_mm"] = 1e5
    found = checked(frame, tmp_path)
    assert found.refused and not any("wrong robot" in line for line in found.lines)


def test_a_section_that_states_its_columns_and_is_accepted_stays_as_it_is(capsys, monkeypatch):
    """A real robot's file whose other columns look like commands, in another unit."""
    monkeypatch.chdir(ROOT)
    assert main(["series_D", "--config", "examples/ur10.yaml"]) == 0
    text = capsys.readouterr().out
    assert "632 rows, 27 columns" in text and "trajectory" not in text.partition("missing:")[0]
    stated = yaml.safe_load((ROOT / "examples/ur10.yaml").read_text())["campaigns"]
    assert yaml.safe_load(text.partition("overlay to paste:")[2]) == {"campaigns": stated}


def test_what_is_refused_is_not_offered_for_pasting(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(ROOT)
    FIELD.drop(columns="measured_x_mm").to_csv(tmp_path / "a.csv", index=False)
    assert main([str(tmp_path / "a.csv"), "--robot", "rrru3"]) == 1
    text = capsys.readouterr().out
    assert "NOT ACCEPTED YET" in text and "to paste" not in text


def test_of_many_problems_the_first_are_shown_and_none_is_counted(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(ROOT)
    FIELD.assign(measured_x_mm="", measured_y_mm="").to_csv(tmp_path / "a.csv", index=False)
    assert main([str(tmp_path / "a.csv"), "--robot", "rrru3"]) == 1
    refused = [line for line in capsys.readouterr().out.splitlines() if line.startswith("refused: ")]
    assert len(refused) == 9 and refused[-1] == "refused: and more, which a run lists"


def test_a_file_that_holds_everything_costs_nothing(tmp_path):
    found = checked(
        FIELD, tmp_path, campaigns={"a": {"robot": "rrru3", "ingest": str(tmp_path / "mine.csv"), "noise_mm": 0.02}}
    )
    # what no robot that passes its points without a thermometer shows, and how many poses are enough
    ordinary = ("read_before_rest", "thermal_expansion", "poses are read")
    said = costs(found)
    assert all(any(word in one for word in ordinary) for one in said) and len(said) == 3 and found.refused == ()
    assert proposed(found) == {"robot": "rrru3", "ingest": str(tmp_path / "mine.csv"), "noise_mm": 0.02}


def test_what_lacks_times_is_named(tmp_path):
    said = " ".join(costs(checked(FIELD.drop(columns="time_s"), tmp_path)))
    unseen = [part for part in said.split("not testable: ")[1:] if "time_s" in part]
    assert {word for word in ("thermal_growth", "servo_lag", "backlash") if any(word in part for part in unseen)} == {
        "thermal_growth",
        "servo_lag",
    }


def test_missing_repetitions_and_payloads_are_reported(tmp_path):
    once = FIELD[(FIELD["run"] == 1)]
    drive = once[[f"theta{k}_rad" for k in (1, 2, 3)]]
    same = [name for name in drive if (np.diff(drive[name]) > 0).all() or (np.diff(drive[name]) < 0).all()]
    assert same
    said = costs(checked(once, tmp_path))
    for text in ("one payload", "no place is measured in two runs", "noise_mm is not stated"):
        assert any(text in one for one in said), text
    assert any(one.startswith("always approached from one side") and all(name in one for name in same) for one in said)


def test_stops_that_are_driven_to_again_are_places_measured_twice(tmp_path):
    """Stops in no order in one run; those that return were said to be missing, with a run to repeat."""
    random = np.random.default_rng(3)
    some = FIELD.iloc[random.permutation(len(FIELD))[:60]].drop(columns=["run", "point", "trajectory", "time_s"])
    some = some.drop_duplicates(subset=["command_x_mm", "command_y_mm", "command_z_mm"])
    again = pd.concat([some, some.iloc[:5]])
    for frame, missing in ((some, True), (again, False)):
        section = {"robot": "rrru3", "ingest": str(tmp_path / "mine.csv"), "motion": "stop_and_go", "noise_mm": 0.02}
        said = costs(checked(frame, tmp_path, campaigns={"a": section}))
        assert any("return to some stops later" in one for one in said) is missing
        assert not any("in two runs" in one for one in said)


def test_too_few_points_for_a_diagnosis_are_reported(tmp_path):
    assert costs(checked(FIELD.head(8), tmp_path))[0].startswith("no diagnosis: ")


def test_a_list_without_commands_says_what_to_give(tmp_path):
    found = check_file(section("leica")["ingest"], CONFIG, "rrru3")
    assert any("--commands" in line for line in found.lines)
    assert {problem["column"] for problem in found.refused} == {f"command_{axis}_mm" for axis in "xyz"}


@pytest.mark.parametrize("name", ["q{}", "J{} [deg]", "Achse {} (deg)"])
def test_drives_that_are_only_numbered_are_proposed_in_their_order(name, tmp_path):
    """A robot's own drives are called otherwise; where two kinds of columns are numbered, none is taken."""
    config = {"robots": {"my_arm": {"urdf": str(DATA / "models" / "arm6.urdf"), "base": "base_link", "tip": "tool0"}}}
    arm = setup.mechanism(parts.robot(CONFIG | config, {"robot": "my_arm"}))
    rng = np.random.default_rng(5)
    drives = arm.legs.home_drives + rng.uniform(-0.3, 0.3, (60, 6))
    positions = arm.forward(drives) + rng.normal(0.0, 0.02, (60, 3))
    columns = [name.format(i) for i in range(1, 7)]
    frame = pd.DataFrame(np.degrees(drives) if "deg" in name else drives, columns=columns)[columns[::-1]]
    frame = frame.assign(trajectory="poses", **dict(zip(LENGTHS[3:], positions.T, strict=True)))
    found = checked(frame, tmp_path, "my_arm", **config)
    assert found.refused == () and proposed(found)["columns"] == dict(zip(arm.parts.columns, columns, strict=True))
    twice = frame.assign(**{name.replace("{}", "{0}").format(i).lower() + " act": 0.0 for i in range(1, 7)})
    assert "columns" not in proposed(checked(twice, tmp_path, "my_arm", **config))


def test_names_that_look_like_nothing_are_not_guessed(tmp_path):
    found = checked(FIELD.rename(columns={"measured_x_mm": "blue"}), tmp_path)
    assert "columns" not in found.section and any(problem["column"] == "measured_x_mm" for problem in found.refused)


def test_the_command_prints_an_overlay(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(ROOT)
    assert main(["data/field_12.csv", "--robot", "rrru3"]) == 0
    text = capsys.readouterr().out
    overlay = yaml.safe_load(text.partition("overlay to paste:")[2])
    assert overlay == {"campaigns": {"field_12": {"robot": "rrru3", "ingest": "data/field_12.csv"}}}
    assert "# saved as mine.yaml: rrru diagnose field_12 --config config.yaml mine.yaml" in text
    # what the file cannot tell is there to be filled in
    filled = yaml.safe_load(
        text.partition("overlay to paste:")[2].replace("# noise_mm", "noise_mm").replace("# pl", "pl")
    )
    assert filled["campaigns"]["field_12"].keys() == {"robot", "ingest", "noise_mm", "platform_mass_kg"}
    jsonschema.validate(filled["campaigns"], SCHEMA["properties"]["campaigns"] | {"$defs": SCHEMA["$defs"]})


def test_the_overlay_to_save_replaces_none_that_is_given(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    FIELD.head(60).to_csv("run.csv", index=False)
    print_check("run.csv", CONFIG, "rrru3", overlays=["mine.yaml"])
    assert "# saved as run.yaml: rrru diagnose run --config mine.yaml run.yaml" in capsys.readouterr().out


@pytest.mark.parametrize("stem", ["123", "no", "a b: c", "1e5"])
def test_the_printed_overlay_is_the_proposed_one_whatever_the_file_is_called(stem, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(ROOT)
    path = tmp_path / f"{stem}.csv"
    FIELD.head(60).rename(columns={"command_x_mm": "Goal X [mm]: or"}).to_csv(path, index=False, sep=";")
    main([str(path), "--robot", "rrru3"])
    printed = "campaigns:" + capsys.readouterr().out.partition("\ncampaigns:")[2]
    assert yaml.safe_load(printed) == check_file(str(path), CONFIG, "rrru3").overlay


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["nothere.csv", "--robot", "rrru3"], "no such file"),
        (["data", "--robot", "rrru3"], "data: is a folder"),
        (["data/field_12.csv"], "say which robot: --robot ..; allowed: rrru3"),
        (["data/field_12.csv"], "this file fits rrru3"),
        (["data/field_01.csv", "--robot", "rrru9"], "robot 'rrru9': there is no such file"),
        (["data/field_01.csv", "--robot", "rrru3", "--config", "nothere.yaml"], "nothere.yaml"),
        (["data/field_01.csv", "--robot", "rrru3", "--config", "Makefile"], "allowed: a YAML file"),
        (
            ["data/field_01.csv", "--robot", "rrru3", "--commands", "nothere.csv"],
            "--commands nothere.csv: there is no such file",
        ),
    ],
)
def test_an_impossible_check_gets_a_message_without_a_traceback(arguments, said, monkeypatch, capsys):
    monkeypatch.chdir(ROOT)
    assert main(arguments) == cli.WRONG
    assert said in capsys.readouterr().err


@settings(max_examples=20, deadline=None, suppress_health_check=list(HealthCheck))
@given(
    data=st.one_of(st.binary(max_size=200), st.text(alphabet="xyzXYZ/,;\t\n [m]1.-", max_size=200).map(str.encode)),
    ending=st.sampled_from([".csv", ".txt", ".xlsx", ".parquet", ""]),
)
# a byte order mark and nothing else
@example(data=b"\xfe\xff", ending=".csv")
@example(data=b"\xfe\xff", ending=".txt")
@example(data=b"\xef\xbb\xbf\n", ending=".csv")
def test_any_file_gets_a_report(data, ending, tmp_path, monkeypatch):
    monkeypatch.chdir(ROOT)
    path = Path(tmp_path, f"any{ending}")
    path.write_bytes(data)
    assert main([str(path), "--robot", "rrru3"]) in (1, 2)


def test_several_targets_at_a_stop_and_poses_in_no_order_are_proposed_as_stop_and_go(tmp_path, capsys, monkeypatch):
    """A path that is passed gets no such proposal; what is stated stays."""
    shuffled = FIELD[FIELD["run"] == 1].sample(frac=1.0, random_state=1).drop(columns=["time_s", "run", "point"])
    assert "motion" not in proposed(checked(FIELD, tmp_path))
    found = checked(shuffled, tmp_path)
    assert proposed(found)["motion"] == "stop_and_go" and not found.refused
    assert any("servo_lag" in line and "the robot rests at every point" in line for line in costs(found))
    motion = [line for line in found.lines if line.startswith("note: motion: ")]
    assert len(motion) == 1 and "proposed" in motion[0] and "as stated" not in motion[0]
    (noise,) = [line for line in costs(found) if line.startswith("noise_mm is not stated")]
    assert "0 readings repeat an earlier one" in noise and "where 10 would determine it" in noise
    assert "the poses follow no path" in noise and "along the runs" not in noise
    stated = {"robot": "rrru3", "ingest": str(tmp_path / "mine.csv"), "motion": "continuous"}
    known = checked(shuffled, tmp_path, campaigns={"mine": stated})
    assert proposed(known)["motion"] == "continuous" and "note: motion: continuous, as stated" in known.lines
    monkeypatch.chdir(ROOT)
    main([str(tmp_path / "mine.csv"), "--robot", "rrru3"])
    assert "# motion: {kind: stop_and_go, between: drives}" in capsys.readouterr().out
    file, robot = tmp_path / "stops.csv", {"mjcf": "data/models/hexapod.xml", "platform": "plate"}
    _two_targets(setup.mechanism({"name": "own", "dimensions": robot})).to_csv(file, index=False)
    taken = check_file(file, CONFIG | {"robots": CONFIG["robots"] | {"own": robot}}, "own")
    assert taken.refused == () and proposed(taken)["motion"] == "stop_and_go"


@pytest.mark.parametrize("turned", [False, True])
def test_what_commands_and_payloads_mean_and_the_noise_of_orientations_are_named(turned, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(ROOT)
    robot = {"mjcf": "data/models/hexapod.xml", "platform": "plate"}
    frame = _two_targets(setup.mechanism({"name": "own", "dimensions": robot}))
    if turned:
        own = setup.mechanism({"name": "own", "dimensions": robot})
        poses = own.solve(frame[[*own.parts.columns]].to_numpy(), np.tile(own.legs.home_mm, (len(frame), 1)))
        frame = frame.assign(**rows.turn_columns("measured", poses.turn))
    frame.to_csv(tmp_path / "stops.csv", index=False)
    (tmp_path / "own.yaml").write_text(yaml.safe_dump({"robots": {"own": robot}}))
    main([str(tmp_path / "stops.csv"), "--robot", "own", "--config", str(tmp_path / "own.yaml")])
    text = capsys.readouterr().out
    assert "whatever target a row is of" in text and "computed from the drive values" in text
    assert "payload_kg, where you add it, hangs at the tool, (0, 0, 0) mm" in text
    assert ("# noise_rad: " in text) == turned and ("poses are read; their" in text or "poses of one reflector" in text)


def _two_targets(robot):
    """Two reflectors of a robot at each stop of a straight row of stops that turns slowly."""
    at, generator = np.linspace(-1.0, 1.0, 60)[:, None], np.random.default_rng(1)
    width = np.ptp(robot.drive_range, axis=1)
    drive = robot.legs.home_drives + 0.15 * width * np.sin(at + np.arange(6)) - 0.15 * width * np.sin(np.arange(6))
    poses = robot.solve(drive, np.tile(robot.legs.home_mm, (60, 1)))
    assert poses.closed.all()
    places = np.array([[60.0, 10.0, 40.0], [-50.0, 40.0, 70.0]])
    seen = np.stack([poses.point(place) for place in places], axis=1).reshape(-1, 3)
    seen = seen + 0.01 * generator.standard_normal(seen.shape)
    columns = dict(zip(robot.parts.columns, np.repeat(drive, 2, axis=0).T, strict=True))
    columns |= {f"measured_{axis}_mm": column for axis, column in zip("xyz", seen.T, strict=True)}
    return pd.DataFrame({"trajectory": "row", "target": ["a", "b"] * 60, **columns})


def test_every_step_of_a_check_is_reported_as_it_begins():
    steps = []
    assert not check_file("data/field_12.csv", CONFIG, "rrru3", progress=lambda *step: steps.append(step)).refused
    assert [name for name, *_ in steps] == ["columns", "units and frame", "motion", "what it determines"]
    assert [numbers for _, *numbers in steps] == [[0, 4], [1, 4], [2, 4], [3, 4]]
