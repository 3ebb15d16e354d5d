"""A tripod of three legs (3-RPS), its drive values and three reflectors: poses by NumPy and SciPy alone.

Its platform rises and tilts. Where its middle is says little of the tilt, so that commanded positions that are computed
from the drive values do not determine these.
"""

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation

import rrru

_HEIGHT_MM, _STOPS, _NOISE_MM = 520.0, 80, 0.02
_ANGLES = np.radians([10.0, 128.0, 247.0])
_AROUND = np.stack([np.cos(_ANGLES), np.sin(_ANGLES), np.zeros(3)], axis=1)
_HINGES = np.stack([-np.sin(_ANGLES), np.cos(_ANGLES), np.zeros(3)], axis=1)
_BASE = np.array([[300.0], [310.0], [295.0]]) * _AROUND
_PLATE = np.array([[140.0], [150.0], [145.0]]) * _AROUND - [0.0, 0.0, 20.0]
_TARGETS = {"a": [90.0, 10.0, 30.0], "b": [-60.0, 80.0, 35.0], "c": [-50.0, -85.0, 45.0]}
_TRACKER_MM = np.array([3100.0, 3900.0, -700.0])
_HOME = np.array([0.0, 0.0, _HEIGHT_MM, 0.0, 0.0, 0.0])


def _legs(pose):
    """Vectors (3, 3) from the hinges to the balls at a pose (6,), position and rotation vector."""
    return pose[:3] + _PLATE @ Rotation.from_rotvec(pose[3:]).as_matrix().T - _BASE


def _open(pose, lengths):
    """What a pose (6,) leaves open of the legs' lengths (3,), and how far the legs leave their planes."""
    legs = _legs(pose)
    return np.r_[np.linalg.norm(legs, axis=1) - lengths, (legs * _HINGES).sum(axis=1)]


def _pose(lengths):
    """The pose (6,) at lengths (3,) of the legs, on the way from home, by Newton's method with finite differences."""
    pose, steps = _HOME, np.diag([1e-4] * 3 + [1e-7] * 3)
    home = np.linalg.norm(_legs(_HOME), axis=1)
    for share in [*np.linspace(0.1, 1.0, 10), 1.0, 1.0, 1.0]:
        at = home + share * (lengths - home)
        slope = [(_open(pose + step, at) - _open(pose - step, at)) / (2.0 * step.max()) for step in steps]
        pose = pose - np.linalg.solve(np.transpose(slope), _open(pose, at))
    assert np.abs(_open(pose, lengths)).max() < 1e-8
    return pose


def _model():
    """The tripod as an MJCF."""
    legs, balls = [], []
    for k, (hinge, place, leg) in enumerate(zip(_HINGES, _BASE, _legs(_HOME), strict=True), 1):
        length = np.linalg.norm(leg)
        across = " ".join(map(str, [*np.cross(hinge, leg / length), *hinge]))
        foot = " ".join(map(str, place / 1e3))
        legs.append(
            f'<body name="leg{k}" pos="{foot}" xyaxes="{across}"><joint name="hinge{k}" axis="0 1 0"/>'
            f'<geom size="0.02" mass="1"/><body name="rod{k}" pos="0 0 {length / 1e3}">'
            f'<joint name="slide{k}" type="slide" axis="0 0 1" range="-0.1 0.1"/><geom size="0.02" mass="1"/>'
            "</body></body>"
        )
        balls.append(f'<connect body1="rod{k}" body2="plate" anchor="0 0 0"/>')
    servos = "".join(f'<position joint="slide{k}" kp="5e7"/>' for k in (1, 2, 3))
    plate = f'<body name="plate" pos="0 0 {_HEIGHT_MM / 1e3}"><freejoint/><geom size="0.05" mass="5"/></body>'
    return (
        f"<mujoco><worldbody>{plate}{''.join(legs)}</worldbody><equality>{''.join(balls)}</equality>"
        f"<actuator>{servos}</actuator></mujoco>"
    )


@pytest.fixture(scope="module")
def tripod(tmp_path_factory):
    path = tmp_path_factory.mktemp("tripod") / "tripod.xml"
    path.write_text(_model())
    return rrru.load_robot(path, platform="plate")


def _table():
    """Drive values in no order and what a tracker reads in a frame of its own; the zeros of the legs are off."""
    generator = np.random.default_rng(70)
    stroke, home = generator.uniform(-55.0, 55.0, (_STOPS, 3)), np.linalg.norm(_legs(_HOME), axis=1)
    frame, rows = Rotation.from_rotvec([0.1, -0.2, 1.1]), []
    for number, values in enumerate(stroke):
        pose = _pose(home + values + [0.5, -0.4, 0.3])
        for name, place in _TARGETS.items():
            seen = frame.apply(pose[:3] + Rotation.from_rotvec(pose[3:]).apply(place)) + _TRACKER_MM
            rows.append((25.0 * number, name, *values, *(seen + _NOISE_MM * generator.standard_normal(3))))
    slides = [f"slide{k}_mm" for k in (1, 2, 3)]
    return pd.DataFrame(rows, columns=["time_s", "target", *slides, *(f"measured_{axis}_mm" for axis in "xyz")])


def _read(table, tripod):
    return rrru.read_campaign(
        table, tripod, noise_mm=_NOISE_MM, targets=_TARGETS, frame="register", motion="stop_and_go"
    )


def test_drive_values_of_a_tripod_are_within_its_reach(tripod):
    """Its positions at them were "out of reach"."""
    campaign = _read(_table(), tripod)
    assert (campaign.measurements["status"] == "ok").all()
    assert rrru.calibrate(campaign).rms_mm == pytest.approx(np.sqrt(3.0) * _NOISE_MM, rel=0.15)


def test_reflectors_away_from_the_tool_are_no_other_unit_where_something_else_is_wrong(tripod):
    """They spread over 104 mm, the tool that only tilts over 18 mm: "both in the same unit" was asked for."""
    table = _table()
    table.loc[30:32, "time_s"] = 0.0
    with pytest.raises(rrru.IngestError, match="time") as refused:
        _read(table, tripod)
    assert "spread" not in str(refused.value)
