"""Base parameters: what a campaign's calibration holds of a robot whose every part has errors."""

from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation

import rrru
from rrru.studies.blind_validation.sentences.draws import draw

NOISE_MM = 2e-4


@pytest.mark.parametrize("number", [19, 21])
def test_all_errors_of_an_own_robot_of_unknown_frame_are_calibrated(number, tmp_path):
    """A rotary hexapod and an arm with errors of millimetres in all parts, simulated by independent code.

    What is left of readings with hardly any noise is about a micrometre.
    """
    own = replace(draw(number, 771, 300, 0.0), noise_mm=NOISE_MM, cause=None)
    given, described = own.write(tmp_path, own.file_rows)
    robot = rrru.load_robot(
        tmp_path / own.robot_file, **{key: value for key, value in described.items() if key not in ("urdf", "mjcf")}
    )
    campaign = rrru.read_campaign(
        given["ingest"], robot, noise_mm=NOISE_MM, frame=given["frame"], targets=given.get("targets")
    )
    campaign.config["calibration"]["bounds"] = {"angle_rad": 0.3, "length_mm": 50.0}
    (fit, *_) = rrru.calibrate(campaign).fits.values()
    assert 0.8 * NOISE_MM < fit.noise_mm < 1.5e-3


def _chain(path):
    """[(shift in mm (3,), turn (3, 3), axis (3,) or None)] of a URDF's joints from the base to the last link."""
    chain = []
    for joint in ElementTree.parse(path).getroot().findall("joint"):
        place = joint.find("origin")
        shift, rpy = (np.array((place.get(key) or "0 0 0").split(), dtype=float) for key in ("xyz", "rpy"))
        axis = joint.find("axis")
        turn = Rotation.from_euler("xyz", rpy).as_matrix()
        chain.append((1e3 * shift, turn, None if axis is None else np.array(axis.get("xyz").split(), dtype=float)))
    return chain


def _tool(chain, errors, drives):
    """Position (3,) and orientation (3, 3) of the last link at drive values (K,) with twists (joints, 6) as errors."""
    position, turn, values = np.zeros(3), np.eye(3), iter(drives)
    for (shift, seat, axis), error in zip(chain, errors, strict=True):
        position = position + turn @ (shift + error[:3])
        turn = turn @ seat @ Rotation.from_rotvec(error[3:]).as_matrix()
        if axis is not None:
            turn = turn @ Rotation.from_rotvec(next(values) * axis).as_matrix()
    return position, turn


@pytest.mark.parametrize("angle", np.linspace(0.0, np.pi, 9) + 0.1)
def test_a_tool_off_the_last_axis_is_calibrated_in_every_direction(angle, tmp_path):
    """The zero of this drive moves it across, and the two parameters of its place nearly all of it.

    At 0.1 rad that zero and the place across were chosen: 0.185 mm were left of readings with noise of 0.01 mm.
    """
    text, loaded = Path("data/models/arm6.urdf").read_text(encoding="utf-8"), {}
    mount = '<child link="tool0"/><origin xyz="0 0 0"'
    assert mount in text
    for name, radius in (("nominal", 0.0327), ("true", 0.0322)):
        place = f'xyz="0.05 {radius * np.cos(angle):.12f} {radius * np.sin(angle):.12f}"'
        file = tmp_path / f"{name}.urdf"
        file.write_text(text.replace(mount, mount.replace('xyz="0 0 0"', place)), encoding="utf-8")
        loaded[name] = file
    generator, chain = np.random.default_rng(3), _chain(loaded["true"])
    drives = generator.uniform(-1.2, 1.2, (60, 6))
    seen = np.array([_tool(chain, np.zeros((len(chain), 6)), one)[0] for one in drives])
    robot = rrru.load_robot(loaded["nominal"])
    table = pd.DataFrame(drives, columns=robot.drives)
    table[["measured_x_mm", "measured_y_mm", "measured_z_mm"]] = seen + 0.01 * generator.standard_normal((60, 3))
    (fit, *_) = rrru.calibrate(rrru.read_campaign(table, robot, noise_mm=0.01)).fits.values()
    assert fit.noise_mm < 0.013 and "axis6" in " ".join(fit.parameters.names)


@pytest.mark.parametrize("names", [("near",), ("near", "far")])
def test_unknown_places_of_reflectors_leave_the_tool_where_the_file_has_it(names):
    """An arm with errors of all joints and of no frame behind the last one, read in an unknown frame.

    What turns about the line through two reflectors moves neither of them. Fitted to places that the nominal robot's
    poses gave, the tool was off by some mrad. The last joint's zero and shift along its axis are the places', too.
    """
    file, generator = "data/models/arm6.urdf", np.random.default_rng(12)
    chain, robot = _chain(file), rrru.load_robot(file)
    moving = np.array([axis is not None for *_, axis in chain])
    errors = moving[:, None] * generator.normal(0.0, 1.0, (len(chain), 6)) * np.repeat([0.3, 6e-4], 3)
    places = {name: np.array(place) for name, place in (("near", (60.0, 25.0, 15.0)), ("far", (-55.0, 30.0, 45.0)))}
    turn, rows = Rotation.from_euler("xyz", [0.02, -0.01, 2.1]), []
    for drives in np.array([0.2, -0.4, 0.6, 0.3, 0.5, 0.1]) + generator.uniform(-0.8, 0.8, (60, 6)):
        position, oriented = _tool(chain, errors, drives)
        for name in names:
            seen = turn.apply(position + oriented @ places[name]) + np.array([2500.0, 900.0, -150.0])
            rows.append([*drives, name, *seen + generator.normal(0.0, 0.005, 3)])
    columns = [*robot.drives, "target", "measured_x_mm", "measured_y_mm", "measured_z_mm"]
    table = pd.DataFrame(rows, columns=columns)
    campaign = rrru.read_campaign(table, robot, noise_mm=0.005, frame="register", motion="stop_and_go")
    found = rrru.calibrate(campaign).parameters.set_index("parameter")["value"]
    assert not [name for name in found.index if name.startswith(("arm_platform", "tool", "daxis6", "axis6_x"))]
    # the last axis is x of its joint's frame
    (*_, axis), error, behind = chain[5], errors[5], chain[6][1]
    shift, turned = axis @ error[:3] * axis, Rotation.from_rotvec(axis @ error[3:] * axis).as_matrix()
    for name in names:
        first = campaign.measurements.query("target == @name").iloc[0]
        place = [first[f"target_{k}_mm"] + found.get(f"reflector_{name}_{k}", 0.0) for k in "xyz"]
        expected = behind.T @ (shift + turned @ behind @ places[name])
        np.testing.assert_allclose(place, expected, atol=0.03)
