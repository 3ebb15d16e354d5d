"""Measurement tables: every robot's has its own columns of actuator values."""

import numpy as np
import pytest

from rrru.campaign import measurements as rows
from rrru.campaign.plan import make_plan
from rrru.campaign.schemas import measurement_table
from rrru.campaign.trajectories import Line
from rrru.errors import TableError
from rrru.robots.delta import Delta
from rrru.robots.ptt3 import Ptt3
from rrru.robots.rrru3 import Rrru3
from rrru.simulation.virtual_robot import VirtualRobot
from rrru.store import tables
from tests.schemas import TABLES, check_measurements

ROBOTS = {
    "rrru3": (Rrru3(), (-400.0, 0.0, 600.0), "theta{}_rad"),
    "ptt3": (Ptt3(), (0.0, 10.0, -250.0), "slider{}_mm"),
    "delta": (Delta(), (10.0, 0.0, 20.0), "theta{}_rad"),
}


def _measured(name):
    robot, start, _ = ROBOTS[name]
    line = Line("line", start, tuple(np.add(start, [20.0, 10.0, -15.0])), 5)
    plan = make_plan([line], [{"payload_kg": 0.0, "reverse": False}], 80.0, 400.0, 0.0)
    return robot, VirtualRobot(robot).run(plan, 0.0, np.random.default_rng(0))[0]


@pytest.mark.parametrize("name", ROBOTS)
def test_the_robots_own_columns_hold_its_actuator_values(name):
    robot, frame = _measured(name)
    columns = [ROBOTS[name][2].format(k) for k in (1, 2, 3)]
    table = measurement_table(robot)
    assert [column for column in table.names if column.endswith(("_rad",)) or "slider" in column] == columns
    assert check_measurements(robot, frame).equals(tables.check(table, frame))
    np.testing.assert_allclose(rows.actuators(frame, robot), robot.inverse(rows.command(frame)), atol=1e-12)
    np.testing.assert_array_equal(rows.actuators(frame, robot), frame[columns].to_numpy())
    others = [column.name for column in TABLES["measurements"].columns if not column.name.startswith("theta")]
    assert [column for column in table.names if column not in columns] == others


def test_another_robots_table_is_refused():
    _, frame = _measured("ptt3")
    with pytest.raises(TableError, match=r"theta1_rad|slider1_mm"):
        check_measurements(Rrru3(), frame)
    assert measurement_table(Rrru3()).names == TABLES["measurements"].names
