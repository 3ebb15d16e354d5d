"""Files of a 3-PTT or a Delta: taken as they stand, or refused with reasons."""

import numpy as np
import pytest

from rrru.campaign.ingest.campaign_file import IngestSpec, ingest
from rrru.campaign.plan import make_plan
from rrru.campaign.trajectories import Spiral
from rrru.errors import IngestError
from rrru.robots.delta import Delta
from rrru.robots.ptt3 import Ptt3
from rrru.simulation.virtual_robot import VirtualRobot
from tests.schemas import check_measurements

ROBOTS = {
    "ptt3": (Ptt3(), -250.0, {"db1": 0.3, "dL2": 0.2}),
    "delta": (Delta(parameter_set="tied"), 0.0, {"dtheta2": 1e-3, "da_1": 0.3}),
}
DRIVES = {"ptt3": [f"slider{k}_mm" for k in (1, 2, 3)], "delta": [f"theta{k}_rad" for k in (1, 2, 3)]}


@pytest.fixture(params=ROBOTS)
def measured(request):
    """Name, nominal robot and a measurement table without its status column."""
    robot, height, deviations = ROBOTS[request.param]
    curve = Spiral("curve", (0.0, 0.0), (40.0, 80.0), (height - 20.0, height + 20.0), 2.0, 50)
    plan = make_plan(
        [curve], [{"payload_kg": 0.0, "reverse": False}, {"payload_kg": 2.0, "reverse": True}], 80.0, 400.0, 5.0
    )
    table, _ = VirtualRobot(robot, deviations).run(plan, 0.01, np.random.default_rng(0))
    return request.param, robot, table.drop(columns="status")


def _taken(table, robot, folder, **options):
    path = folder / "mine.csv"
    table.to_csv(path, index=False)
    return ingest(IngestSpec(str(path), **options), robot)


def test_a_file_is_taken_as_it_stands(measured, tmp_path):
    name, robot, table = measured
    found = _taken(table, robot, tmp_path)
    frame = check_measurements(robot, found.measurements)
    assert set(DRIVES[name]) < set(frame)
    assert found.notes == () and (frame["status"] == "ok").all()
    for column in table.columns.drop("trajectory"):
        np.testing.assert_allclose(frame[column], table[column], rtol=1e-12, atol=1e-12)


def test_actuator_values_that_are_missing_are_those_of_the_commands(measured, tmp_path):
    name, robot, table = measured
    found = _taken(table.drop(columns=DRIVES[name]), robot, tmp_path)
    np.testing.assert_allclose(found.measurements[DRIVES[name]], table[DRIVES[name]], atol=1e-9)
    assert any(f"computed from the commanded positions ({name}" in note for note in found.notes)


def test_positions_in_inches_are_converted_sliders_too(measured, tmp_path):
    name, robot, table = measured
    lengths = [column for column in table if column.startswith(("command", "measured", "slider"))]
    inches = table.assign(**{column: table[column] / 25.4 for column in lengths})
    found = _taken(inches, robot, tmp_path, unit="inch")
    np.testing.assert_allclose(found.measurements[DRIVES[name]], table[DRIVES[name]], atol=1e-9)


def test_values_that_are_not_those_of_the_commands_are_refused(measured, tmp_path):
    name, robot, table = measured
    wrong = table.copy()
    wrong.loc[7, DRIVES[name][1]] += 0.02
    with pytest.raises(IngestError, match=rf"(?s)row 9.*{DRIVES[name][1]}.*that the commanded position needs"):
        _taken(wrong, robot, tmp_path)


def test_a_robot_that_stands_on_its_head_is_refused(tmp_path):
    robot, height, _ = ROBOTS["ptt3"]
    curve = Spiral("curve", (0.0, 0.0), (40.0, 80.0), (height - 20.0, height + 20.0), 2.0, 50)
    plan = make_plan([curve], [{"payload_kg": 0.0, "reverse": False}], 80.0, 400.0, 5.0)
    table, _ = VirtualRobot(robot).run(plan, 0.01, np.random.default_rng(0))
    turned = table.drop(columns=["status", *DRIVES["ptt3"]])
    turned[["command_z_mm", "measured_z_mm"]] *= -1.0
    with pytest.raises(IngestError, match="whose z points UP from the base"):
        _taken(turned, robot, tmp_path)


def test_the_other_kind_of_drives_is_an_unknown_column(measured, tmp_path):
    name, robot, table = measured
    other = DRIVES["delta" if name == "ptt3" else "ptt3"]
    with pytest.raises(IngestError, match=rf"(?s)unknown column.*{other[0]}|{other[0]}.*an undeclared column"):
        _taken(table.rename(columns=dict(zip(DRIVES[name], other, strict=True))), robot, tmp_path)
