"""Files of a robot with two end effectors, both read at every pose in an instrument's frame."""

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation

from rrru.campaign import measurements as rows
from rrru.campaign.ingest.campaign_file import IngestSpec, ingest
from rrru.errors import IngestError
from rrru.robots.catalogue import make_mechanism
from tests.robots import two_arms

ROBOT = make_mechanism("two_arms", two_arms.section())
_CAMERA = Rotation.from_euler("xyz", (0.02, -0.01, 1.6)).as_matrix()


def _file(count=40):
    """Rows of drive values and positions of both markers in m, the camera's."""
    drives = ROBOT.legs.home_drives + np.random.default_rng(2).uniform(-0.5, 0.5, (count, len(two_arms.DRIVES)))
    every, arms = np.repeat(drives, 2, axis=0), np.tile(["right", "left"], count)
    seen = np.array([two_arms.seen(q, arm, two_arms.MARKERS[arm]) for q, arm in zip(every, arms, strict=True)])
    seen = (seen @ _CAMERA.T + [2000.0, -1000.0, 50.0] + np.random.default_rng(3).normal(size=seen.shape)) / 1e3
    frame = pd.DataFrame(every, columns=ROBOT.parts.columns).assign(trajectory="poses", target=arms)
    return frame.assign(**rows.vector_columns("measured", seen))


def _ingested(frame, folder, **options):
    frame.to_csv(folder / "arms.csv", index=False)
    return ingest(IngestSpec(str(folder / "arms.csv"), unit="m", frame="register", **options), ROBOT)


def test_the_markers_of_both_hands_and_the_frame_are_found(tmp_path):
    frame = _file()
    found = _ingested(frame, tmp_path)
    assert (found.measurements["status"] == "ok").all() and len(found.measurements) == len(frame)
    np.testing.assert_allclose(found.registration.rotation, _CAMERA.T, atol=2e-3)
    for arm, place in two_arms.MARKERS.items():
        its = found.measurements[found.measurements["target"] == arm]
        np.testing.assert_allclose(rows.vectors(its, "target"), np.tile(place, (len(its), 1)), atol=2.0)
        expected = [two_arms.seen(q, arm) for q in its[ROBOT.parts.columns].to_numpy()]
        np.testing.assert_allclose(rows.command(its), expected, atol=1e-6)


def test_rows_have_to_say_which_hand_they_are_of(tmp_path):
    with pytest.raises(IngestError, match="column target: got no such column; allowed: right, left"):
        _ingested(_file().drop(columns="target"), tmp_path)
    with pytest.raises(IngestError, match=r"head.*a target on an end effector: right, left"):
        _ingested(_file().assign(target=["head", "left"] * 40), tmp_path)


def _commanded(frame, arms):
    """The file with commanded positions in m of the tools of arms (n,)."""
    drives = frame[[*ROBOT.parts.columns]].to_numpy()
    sent = np.array([two_arms.seen(q, arm) for q, arm in zip(drives, arms, strict=True)])
    return frame.assign(**rows.vector_columns("command", sent / 1e3))


def test_the_named_target_is_on_the_end_effector_of_the_pose(tmp_path):
    frame = _file()
    found = _ingested(_commanded(frame, frame["target"]), tmp_path)
    same = _ingested(frame, tmp_path)
    np.testing.assert_allclose(rows.vectors(found.measurements, "target"), rows.vectors(same.measurements, "target"))
    wrong = frame["target"].to_numpy().copy()
    wrong[7] = "right"
    with pytest.raises(IngestError, match=r"row 9, .*command_x_mm.* nearest to another end effector than that of left"):
        _ingested(_commanded(frame, wrong), tmp_path)


def test_commanded_positions_do_not_replace_targets_or_drive_values(tmp_path):
    frame = _commanded(_file(), _file()["target"])
    with pytest.raises(IngestError, match="column target: got no such column; allowed: right, left"):
        _ingested(frame.drop(columns="target"), tmp_path)
    with pytest.raises(IngestError, match="a column for each drive"):
        _ingested(frame.drop(columns=[*ROBOT.parts.columns]), tmp_path)
