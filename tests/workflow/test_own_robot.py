"""Robots of a user's own, from a module and from files, the whole way from campaign to figures."""

import json
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation

from rrru.campaign import measurements as rows
from rrru.errors import ConfigError
from rrru.kinematics.base_parameters import direction
from rrru.robots.catalogue import make_mechanism
from rrru.robots.drive_words import drive_words
from tests.formats import humanoid
from tests.places import ROOT
from tests.refusals import refusals
from tests.workflow.folder import run_here

# a planar 3-RRR: three legs of two links, driven at the base, hold a plate in a plane
_MODULE = '''
"""A planar 3-RRR."""
import numpy as np

from rrru.kinematics.general_robot import GeneralRobot
from rrru.kinematics.legs import Drive, Joint, Leg, Legs, Parts, unit_twist

X, Z = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
BASE, UPPER, LOWER, PLATE = 300.0, 220.0, 200.0, 80.0


def turned(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def make():
    legs, homes = [], []
    for k in (1, 2, 3):
        azimuth = 2.0 * np.pi * (k - 1) / 3.0
        # the elbow stands to the left of the line from foot to plate
        reach = BASE - PLATE
        lean = np.arccos((UPPER**2 + reach**2 - LOWER**2) / (2.0 * UPPER * reach))
        bend = np.pi - np.arccos((UPPER**2 + LOWER**2 - reach**2) / (2.0 * UPPER * LOWER))
        homes.append(np.pi + lean)
        joints = (
            Joint(f"leg {k} root", turn=turned(azimuth)),
            Joint(f"leg {k} motor", "R", Z, BASE * X, drive=k - 1),
            Joint(f"leg {k} elbow", "R", Z, UPPER * X, home=-bend),
            Joint(f"leg {k} wrist", "R", Z, LOWER * X, home=bend - lean - np.pi),
            Joint(f"leg {k} plate", shift_mm=-PLATE * X),
        )
        legs.append(Leg(f"leg {k}", joints, end_turn=turned(-azimuth)))
    home = np.array(homes)
    drives = tuple(Drive(f"motor{k}_rad", "rad", f"leg {k} motor", unit_twist(5)) for k in (1, 2, 3))
    return GeneralRobot("planar", Legs(tuple(legs), home), Parts(drives), np.stack([home - 0.6, home + 0.6], axis=1))
'''
_OVERLAY = """
results_dir: results
robots: {{mine: {robot}}}
virtual_robots:
  own_twin: {{errors: {{{error}: {size}}}, effects: {{backlash: {play}}}, platform_mass_kg: 1.0}}
trajectories:
  small:
    lines: {{start_mm: {start}, end_mm: {end}, offsets_y_mm: [0.0, 25.0, -25.0], points: 15}}
campaigns:
  own:
    {{robot: mine, virtual: own_twin, trajectories: small, noise_mm: 0.01, errors: {errors},{reads}
      passes: [{{}}, {{reverse: true}}]}}
calibration: {{sets: {{lines: ["line_*"]}}}}
"""
_TABLES = ("parameters", "error_summary", "gap_verdicts")


def _run(folder, robot, made, wrong, width, errors="zero", reads=""):
    """Verdict, error summary, parameters and measurements of the whole way with an own robot.

    made: the robot, driven along x about its home; wrong: name and size of its error; width: of every drive's backlash.
    """
    (x, y, z), (error, size) = made.legs.home_mm.round(1).tolist(), wrong
    parts = {"robot": robot, "error": error, "size": size, "errors": errors, "reads": reads}
    parts |= {"start": [x - 60.0, y, z], "end": [x + 60.0, y, z]}
    play = json.dumps({f"width{k}": width for k in range(1, len(made.parts.drives) + 1)})
    (folder / "mine.yaml").write_text(_OVERLAY.format(**parts, play=play))
    targets = [f"results/campaigns/own/{name}.parquet" for name in _TABLES]
    code, output = run_here(folder, *targets, "results/figures/own/cross.png", overlays=("mine.yaml",))
    assert code == 0, output
    names = (*_TABLES, "measurements", "gauge")
    return {name: pd.read_parquet(folder / f"results/campaigns/own/{name}.parquet") for name in names}


def test_a_robot_of_a_users_module_goes_the_whole_way(tmp_path, monkeypatch):
    """A fourth robot in a module of less than 60 lines, no file of the package touched: its play is named."""
    assert len(_MODULE.splitlines()) < 60
    (tmp_path / "planar.py").write_text(_MODULE)
    monkeypatch.syspath_prepend(tmp_path)
    planar = make_mechanism("planar", {"module": "planar:make"}, parameter_set="zero")
    result = _run(tmp_path, '{module: "planar:make"}', planar, ("dmotor2", 0.002), 0.001, errors="full")
    verdict = result["gap_verdicts"].iloc[0]
    assert verdict["effects"] == "backlash" and verdict["share_closed"] > 0.8
    assert verdict["where"] == "leg 1 motor to leg 3 motor"
    # a leg is lifted alike at each of its joints, whose axes are parallel
    gauge = result["gauge"].set_index("number")["stands_for"]
    assert gauge["leg_1_elbow_z"] == gauge["leg_1_wrist_z"] == "1 leg_1_motor_z"
    assert not set(gauge.index) & set(result["parameters"]["parameter"])
    assert {"motor1_rad", "motor2_rad", "motor3_rad"} <= set(result["measurements"])
    summary = result["error_summary"].query(
        "trajectory == 'all' and calibration in ('none', 'lines') and method in ('none', 'least_squares')"
    )
    means = summary.set_index("mode")["mean_mm"]
    assert means["closed_loop"] < 0.5 * means["before"]


def test_an_arm_from_a_urdf_file_goes_the_whole_way(tmp_path):
    """The example arm: six drives by the names of its joints, and an offset of one found by the calibration.

    The tracker sees two reflectors at every point and the orientation.
    """
    arm = make_mechanism("arm", {"urdf": str(ROOT / "data/models/arm6.urdf")}, parameter_set="zero")
    error = f"d{arm.parts.columns[1].rpartition('_')[0]}"
    reads = " noise_rad: 1.0e-4, targets: {ball: [20.0, 0.0, 60.0], nest: [-30.0, 10.0, 50.0]},"
    result = _run(tmp_path, "{urdf: data/models/arm6.urdf}", arm, (error, 0.002), 0.0005, reads=reads)
    measured = result["measurements"]
    assert len(measured) == 2 * 2 * 3 * 15 and set(measured["target"]) == {"ball", "nest"}
    # where the robot was sent, an orientation is read with its noise alone and the little that the errors turn it by
    off = rows.turns(measured, "measured") @ rows.turns(measured, "command").transpose(0, 2, 1)
    assert 1e-4 < np.sqrt((Rotation.from_matrix(off).magnitude() ** 2).mean()) < 5e-3
    assert result["error_summary"].query("mode == 'model'")["mean_mm"].max() < 0.5
    assert set(arm.parts.columns) <= set(result["measurements"])
    chosen = "calibration == 'lines' and method == 'least_squares'"
    fitted = result["parameters"].query(chosen).set_index("parameter")
    row = fitted.loc[error]
    assert row["true_value"] == pytest.approx(0.002)
    assert "backlash" in result["gap_verdicts"]["effects"].iloc[0]
    assert "backlash of axis1" in result["gap_verdicts"]["not_in_model"].iloc[0]
    # the offset of the second drive is the turn of its joint's seat
    seat = ElementTree.parse(tmp_path / "results/campaigns/own/corrected.urdf").find("joint[@name='axis2']/origin")
    assert float(seat.get("rpy").split()[1]) == pytest.approx(0.002, abs=5e-4)


def test_an_arm_of_dh_rows_with_a_joint_that_follows_goes_the_whole_way(tmp_path):
    """Ten drives and a chest that two of them keep upright, described in the configuration alone."""
    section = humanoid.section()
    arm = make_mechanism("arm", section, parameter_set="zero")
    result = _run(tmp_path, json.dumps(section), arm, ("dtorso1", 0.002), 0.0005, reads=" noise_rad: 1.0e-4,")
    measured = result["measurements"]
    assert set(arm.parts.columns) <= set(measured) and "chest_rad" not in measured
    places = arm.forward(measured[arm.parts.columns].to_numpy(dtype=float))
    np.testing.assert_allclose(places, measured[[f"command_{axis}_mm" for axis in "xyz"]], atol=1e-6)
    fitted = result["parameters"].query("calibration == 'lines' and method == 'least_squares'").set_index("parameter")
    assert fitted.loc["dtorso1", "true_value"] == pytest.approx(0.002)
    assert "backlash" in result["gap_verdicts"]["effects"].iloc[0]
    assert result["error_summary"].query("mode == 'model'")["mean_mm"].max() < 0.5


@refusals("entry", "text")
def test_an_own_robot_that_cannot_be_made_is_refused(entry, text):
    """The message names what is missing."""
    with pytest.raises(ConfigError, match=text):
        make_mechanism("mine", entry, parameter_set="full")


def test_parameters_that_are_not_identifiable_are_left_out_and_named():
    """Of an arm's numbers the rank chooses; what is left out is a stated combination of the chosen ones."""
    arm = make_mechanism("arm", {"urdf": str(ROOT / "data/models/arm6.urdf")}, parameter_set="full")
    assert len(arm.parameters) < len(arm.candidates)
    at = arm.map_at(*(values[:20] for values in arm._workspace()))
    columns = {one.name: at.columns(direction(arm.legs, one)[..., None])[..., 0] for one in arm.candidates}
    left_out, shares = next((name, of) for name, of in arm._chosen[1].items() if np.abs(of).max() > 1e-3)
    combined = sum(share * columns[name] for name, share in zip(arm.parameters.names, shares, strict=False))
    assert np.abs(columns[left_out] - combined).max() < 1e-6 * np.abs(columns[left_out]).max() + 1e-9


def test_the_example_hexapod_of_an_mjcf_file_goes_the_whole_way(tmp_path):
    """Its six legs' play is named at the legs, in its own columns."""
    hexapod = make_mechanism("h", {"mjcf": str(ROOT / "data/models/hexapod.xml"), "platform": "plate"})
    error = f"d{hexapod.parts.columns[2].rpartition('_')[0]}"
    robot = "{mjcf: data/models/hexapod.xml, platform: plate}"
    result = _run(tmp_path, robot, hexapod, (error, 0.4), 0.1)
    assert set(hexapod.parts.columns) <= set(result["measurements"])
    verdict = result["gap_verdicts"].iloc[0]
    legs = drive_words(hexapod).all_names
    assert "backlash" in verdict["effects"] and verdict["where"].startswith(legs[0])
    own = {"mjcf": str(tmp_path / "results/campaigns/own/corrected.xml"), "platform": "plate"}
    corrected = make_mechanism("h", own, parameter_set="zero")
    drives = pd.read_parquet(tmp_path / "results/campaigns/own/corrected_drives.parquet")
    nominal, sent = (
        drives[[prefix + one for one in hexapod.parts.columns]].to_numpy() for prefix in ("", "corrected_")
    )
    # one leg's length is off by 0.4, its servo's offset, and half of the play comes on top
    assert np.median(nominal - sent, axis=0)[2] == pytest.approx(0.4, abs=0.06)
    shorter = corrected.forward(nominal[:1] - [0.0, 0.0, 0.4, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(shorter, hexapod.forward(nominal[:1]), rtol=0.0, atol=0.05)


def test_a_module_whose_platform_is_not_held_says_what_it_is_free_to_do(tmp_path, monkeypatch):
    """A planar robot with one leg less turns about the vertical."""
    source = _MODULE.replace("for k in (1, 2, 3):\n        azimuth", "for k in (1,):\n        azimuth", 1)
    source = source.replace("unit_twist(5)) for k in (1, 2, 3))", "unit_twist(5)) for k in (1,))")
    (tmp_path / "loose_planar.py").write_text(source)
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(ConfigError, match=r"robot mine: its platform is free to .*; allowed: legs that hold it"):
        make_mechanism("mine", {"module": "loose_planar:make"}, parameter_set="zero")
