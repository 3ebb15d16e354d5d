"""Commanded positions and drive values that say different things: what makes them agree is named."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from rrru.campaign import measurements as rows
from rrru.campaign.ingest.campaign_file import IngestSpec, ingest
from rrru.campaign.ingest.contradictions import find_contradiction
from rrru.errors import IngestError
from rrru.robots.delta import Delta
from rrru.robots.ptt3 import Ptt3
from rrru.robots.rrru3 import Rrru3
from tests.campaign.ingest.test_gross_errors import _SPEC, _made
from tests.campaign.ingest.test_lost_zeros import _hexapod

_TRIPODS = {"rrru3": (Rrru3(), 650.0), "ptt3": (Ptt3(), -250.0), "delta": (Delta(parameter_set="tied"), 0.0)}


def _arm_file(seed, kind=None):
    """A robot, and its file with the commanded positions of the nominal one."""
    robot, frame = _made(seed, kind) if kind else _made(seed)
    sent = robot.forward(frame[[*robot.parts.columns]].to_numpy())
    return robot, frame.assign(**rows.vector_columns("command", sent))


def _tripod_file(name):
    """A robot that does not orient, and its file of points in no order, 40 mm around a centre."""
    robot, height = _TRIPODS[name]
    generator = np.random.default_rng(4)
    sent = generator.uniform(-40.0, 40.0, (40, 3)) + np.array([0.0, 0.0, height])
    drives = dict(zip(robot.parts.columns, robot.inverse(sent).T, strict=True))
    seen = sent + 0.1 * generator.standard_normal(sent.shape)
    columns = drives | rows.vector_columns("command", sent) | rows.vector_columns("measured", seen)
    return robot, pd.DataFrame(columns).assign(trajectory="points")


def _advice(frame, robot, spec=_SPEC):
    """What makes the columns of a file agree."""
    return find_contradiction(frame, spec, robot, {}).advice


@pytest.mark.parametrize("name", [*_TRIPODS, "arm", "hexapod"])
def test_what_makes_both_agree_is_named(name):
    kinds = {"arm": (3,), "hexapod": (3, _hexapod)}
    robot, frame = _arm_file(*kinds[name]) if name in kinds else _tripod_file(name)
    drives, command = [*robot.parts.columns], rows.command(frame)
    assert find_contradiction(frame, _SPEC, robot, {}) is None
    order = [len(drives) - 1, *range(len(drives) - 1)]
    mixed = frame.assign(**{one: frame[drives[k]] for one, k in zip(drives, order, strict=True)})
    assert _advice(mixed, robot) == f"order: [{', '.join(drives[k] for k in order)}]"
    late = frame.assign(**rows.vector_columns("command", np.roll(command, 1, axis=0))).iloc[1:]
    moved = "move their values up by 1 row in each run, leave all other columns, and delete its last row"
    assert _advice(late, robot) == f"commanded columns that are not 1 row late: {moved}"
    metres = frame.assign(**rows.vector_columns("command", command / 1000.0))
    assert _advice(metres, robot) == "commanded columns in mm: they are in m, multiply them by 1000"
    unit, zero = robot.parts.units[1], {"rad": 0.05, "mm": 2.0}[robot.parts.units[1]]
    moved = _advice(frame.assign(**{drives[1]: frame[drives[1]] + zero}), robot)
    assert f"adding {-zero:g} {unit} to {drives[1]} makes both agree" in moved
    if unit == "rad":
        degrees = frame.assign(**{one: np.degrees(frame[one]) for one in drives})
        assert _advice(degrees, robot) == "angle_unit: deg"
        turned = frame.assign(**{drives[0]: -frame[drives[0]]})
        assert _advice(turned, robot) == f"signs: {{{drives[0]}: -1}}"


def test_another_point_of_the_platform_and_another_frame_are_told_apart():
    robot, frame = _arm_file(5)
    driven = frame[[*robot.parts.columns]].to_numpy()
    poses = robot.solve(driven, robot.guess(driven))
    flange = frame.assign(**rows.vector_columns("command", poses.point(np.array([10.0, -20.0, 50.0]))))
    assert "they are of the point (10, -20, 50) mm" in _advice(flange, robot)
    elsewhere = frame.assign(**rows.vector_columns("command", rows.command(frame) + np.array([100.0, 0.0, -30.0])))
    assert "shifting them by (-100, " in _advice(elsewhere, robot)


def test_values_with_few_digits_do_not_contradict():
    robot, frame = _arm_file(6)
    degrees = frame.assign(**{one: np.degrees(frame[one]).round(2) for one in robot.parts.columns})
    spoilt = degrees.assign(**{one: np.radians(degrees[one]) for one in robot.parts.columns})
    assert find_contradiction(spoilt, replace(_SPEC, angle_unit="deg"), robot, {}) is None


def test_commands_of_a_controller_that_knows_its_robot_better_are_a_note(tmp_path):
    """Nothing exact makes both agree: drive values are used."""
    robot, frame = _arm_file(7)
    generator = np.random.default_rng(7)
    sizes = np.array([{"mm": 0.2, "rad": 2e-4}[unit] for unit in robot.parameters.units])
    known = robot.forward(frame[[*robot.parts.columns]].to_numpy(), sizes * generator.standard_normal(len(sizes)))
    path = tmp_path / "file.csv"
    frame.assign(**rows.vector_columns("command", known)).to_csv(path, index=False)
    notes = ingest(replace(_SPEC, path=str(path)), robot).notes
    assert any(
        "in the median from those of the nominal robot at the drive angles, which are used" in one for one in notes
    )


@pytest.mark.parametrize("name", _TRIPODS)
def test_a_contradiction_is_one_problem(name, tmp_path):
    robot, frame = _tripod_file(name)
    path = tmp_path / "file.csv"
    frame.assign(**rows.vector_columns("command", np.roll(rows.command(frame), 1, axis=0))).iloc[1:].to_csv(
        path, index=False
    )
    with pytest.raises(IngestError) as refused:
        ingest(IngestSpec(str(path), frame="register"), robot)
    assert len(refused.value.problems) == 1 and "commanded columns that are not 1 row late" in str(refused.value)
