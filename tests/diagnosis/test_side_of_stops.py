"""An arm with backlash of which its file does not say all: from where it came to the first stop, or to a later one."""

import numpy as np
import pytest

import rrru
from tests.diagnosis import numpy_arm
from tests.formats.mjcf import ARM

_JOINT, _WIDTH_RAD = 2, 9e-4


def _lost_motion(drive, sense=1.0):
    """What a drive's part lags behind its values (n,), each from the side of the value before, the first by a sense."""
    lag, at = np.zeros(len(drive)), drive[0] - 0.5 * sense * _WIDTH_RAD
    for k, value in enumerate(drive):
        at = np.clip(at, value - 0.5 * _WIDTH_RAD, value + 0.5 * _WIDTH_RAD)
        lag[k] = at - value
    return lag


def _read(generator, sense=1.0):
    """Drive values (n, 6) of an arm that came to its first stop by a sense, and what is read of one reflector."""
    drive = numpy_arm.drives(generator)
    driven = drive.copy()
    driven[:, _JOINT] += _lost_motion(drive[:, _JOINT], sense)
    *_, (position, turn) = numpy_arm.links(driven, numpy_arm.errors(generator))
    return drive, numpy_arm.table(drive, {"a": (position, turn, numpy_arm.PLACES["a"])}, generator)


def _file_without(count, seed):
    """What a tracker reads of one reflector without `count` stops, of which the next ones hide the true side."""
    generator = np.random.default_rng(seed)
    drive, table = _read(generator)
    value = drive[:, _JOINT]
    # from above in truth, from below without the stop between
    hidden = [k for k in range(30, 100) if value[k] > value[k + 1] > value[k - 1]][::4][:count]
    assert len(hidden) == count
    # the times of a file without a hole in its order
    return table.drop(index=hidden).drop(columns="time_s"), [k + 1 for k in hidden]


def _diagnosed(table):
    """The diagnosis of a file whose drives moved straight from stop to stop."""
    motion = {"kind": "stop_and_go", "between": "drives"}
    robot = rrru.load_robot(str(ARM), tip="tool0")
    return rrru.diagnose(rrru.read_campaign(table, robot, noise_mm=numpy_arm.NOISE_MM, frame="register", motion=motion))


@pytest.mark.parametrize("count", [1, 2])
def test_one_stop_that_was_reached_from_the_other_side_is_no_function_of_the_drive(count):
    """`drive_error_function` of that joint had more than 0.99: a hill that one reading alone showed."""
    table, wrong = _file_without(count, 3)
    found = _diagnosed(table)
    assert [effect["name"] for effect in found.verdict["effects"]] == ["backlash"]
    points = found.tables["gap_points"]
    left = points.index[~points["used"]]
    assert table.index[left].tolist() == wrong
    rows = ", ".join(map(str, points.loc[left, "point"]))
    said = f"outliers to the diagnosis: stops (run 1): point {rows}, see these rows"
    assert any(note.startswith(said) for note in found.verdict["notes"])
    assert found.verdict["gap_after_rms_mm"] < numpy_arm.NOISE_MM


@pytest.mark.parametrize("sense", [0.1, -0.5, 1.0])
def test_the_first_stop_may_be_inside_the_backlash(sense):
    """It was an outlier, since the drive was at one side or the other."""
    found = _diagnosed(_read(np.random.default_rng(2), sense)[1].drop(columns="time_s"))
    assert [effect["name"] for effect in found.verdict["effects"]] == ["backlash"]
    assert found.tables["gap_points"]["used"].all()
