"""The corrected MJCF of a planar five-bar, whose readings are those of a simulation by NumPy alone. Lengths in mm."""

import numpy as np
import pandas as pd
import pytest

import rrru
from rrru.formats.file_changes import Found
from rrru.formats.mjcf_writer import to_mjcf
from tests.formats.mjcf import GEOM, mjcf, servos, text_of

_FOOT, _CRANK, _ROD, _NOISE_MM = 100.0, 150.0, 220.0, 0.01


def _file(tmp_path):
    """Cranks that stand upright at zero, rods on hinges, and a connect of the second rod to the tip of the first."""
    rise, world = np.sqrt(_ROD**2 - _FOOT**2), ""
    for k, side in ((1, -1.0), (2, 1.0)):
        end = np.array([-side * _FOOT, rise, 0.0]) / 1000.0
        tip = f'<body name="tip" pos="{text_of(end)}"/>' if k == 1 else ""
        rod = f'<body name="rod{k}" pos="0 {_CRANK / 1000.0} 0"><joint name="p{k}" axis="0 0 1"/>{GEOM}{tip}</body>'
        world += f'<body name="crank{k}" pos="{side * _FOOT / 1000.0} 0 0">'
        world += f'<joint name="q{k}" axis="0 0 1" range="-1 1" limited="true"/>{GEOM}{rod}</body>'
    connect = f'<connect name="pin" body1="rod2" body2="tip" anchor="{text_of(end)}"/>'
    return mjcf(tmp_path, world, connect, servos("q1", "q2"))


def _tips(drive, errors):
    """Tips (n, 3) at drive angles (n, 2) under errors (10,): of feet in x and y, cranks, rods, and zeros."""
    nominal = np.array([[-_FOOT, _FOOT], [0.0, 0.0], [_CRANK, _CRANK], [_ROD, _ROD]])
    foot_x, foot_y, crank, rod = nominal + np.reshape(errors[:8], (4, 2))
    angle = 0.5 * np.pi + drive + errors[8:]
    knees = np.stack([foot_x + crank * np.cos(angle), foot_y + crank * np.sin(angle)], axis=2)
    apart = knees[:, 1] - knees[:, 0]
    length = np.linalg.norm(apart, axis=1)
    along = (rod[0] ** 2 - rod[1] ** 2 + length**2) / (2.0 * length)
    across = np.sqrt(rod[0] ** 2 - along**2)
    x, y = (apart / length[:, None]).T
    return np.column_stack([knees[:, 0, 0] + along * x - across * y, knees[:, 0, 1] + along * y + across * x, 0.0 * x])


@pytest.mark.parametrize("seed", [5])
def test_the_corrected_file_has_drive_values_for_positions_of_the_plane(tmp_path, seed):
    """Its legs are tilted by some microns as the readings' noise is; no row had a pose."""
    generator = np.random.default_rng(seed)
    drive = generator.uniform(-0.2, 0.2, (80, 2))
    errors = np.append(0.3 * generator.standard_normal(8), 2e-3 * generator.standard_normal(2))
    seen = _tips(drive, errors) + _NOISE_MM * generator.standard_normal((80, 3))
    table = {"trajectory": "stops", "q1_rad": drive[:, 0], "q2_rad": drive[:, 1]}
    table |= {f"measured_{axis}_mm": column for axis, column in zip("xyz", seen.T, strict=True)}
    robot = rrru.load_robot(str(_file(tmp_path)), platform="tip")
    campaign = rrru.read_campaign(pd.DataFrame(table), robot, noise_mm=_NOISE_MM, motion="stop_and_go")
    rrru.diagnose(campaign, effects="backlash").write_corrected(tmp_path / "corrected.xml")
    corrected = rrru.load_robot(str(tmp_path / "corrected.xml"), platform="tip").mechanism
    goal = _tips(drive, errors)
    # the file has the measured point that was found: 0.14 mm off the body's origin
    assert np.sqrt(((corrected.forward(drive) - goal) ** 2).sum(axis=1).mean()) < _NOISE_MM
    needed = corrected.inverse(goal)
    assert np.isfinite(needed).all()
    # as far off as the plane is tilted
    np.testing.assert_allclose(corrected.forward(needed), goal, rtol=0.0, atol=5.0 * _NOISE_MM)
    off_the_plane = goal + np.array([0.0, 0.0, 20.0])
    assert np.isnan(corrected.inverse(off_the_plane)).all()


def test_a_corrected_planar_loop_whose_cranks_are_off_its_plane_is_read_again(tmp_path):
    """Errors across the plane that readings determine to some hundredths of a mm contradict each other: the file was
    "the loops stay open by 0.040 mm", so that no planar five-bar with usual readings had one.
    """
    robot = rrru.load_robot(str(_file(tmp_path)), platform="tip").mechanism
    tilted = np.array([0.1, -0.05, 0.06, 2e-4, -1e-4, 5e-4])
    text, lost = to_mjcf(tmp_path / "robot.xml", "tip", Found({"q1": tilted}), tmp_path)
    assert not lost
    (tmp_path / "corrected.xml").write_text(text)
    corrected = rrru.load_robot(str(tmp_path / "corrected.xml"), platform="tip").mechanism
    drive = np.random.default_rng(3).uniform(-0.5, 0.5, (50, 2))
    twists = np.zeros((1, len(robot.legs.sites), 6))
    twists[0, robot.legs.site_numbers["q1"]] = tilted
    poses = robot.solve(drive, robot.forward(drive), twists=twists)
    off = np.abs(corrected.forward(drive) - poses.point(robot.tool_mm)).max(axis=0)
    # what the legs contradict each other in changes with the pose, by their tilt of 0.2 mrad over 0.3 m
    assert off[:2].max() < 1e-4 and off[2] < 0.02
