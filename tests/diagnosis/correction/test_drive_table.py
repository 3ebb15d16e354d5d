"""The table of corrected drive values where an error is a function of drives' values."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from rrru.diagnosis.calibrate import calibrate
from rrru.diagnosis.correction.drive_table import at_rest, corrected_drives
from rrru.diagnosis.make_problem import make_diagnosis_problem
from rrru.diagnosis.state import ModelState
from rrru.effects.library import find
from rrru.pipeline.setup import as_measured
from tests.diagnosis import arms

NAMES = list(arms.ARM.parts.columns)


def _table(monkeypatch, still=(), jitter=0.0):
    """The table and the drive values that were read, of 40 stops at which some drives stand still, or nearly so."""
    every = arms.drives

    def some(number, generator):
        values = every(number, generator)
        return np.where(np.isin(np.arange(arms.DRIVES), still), 0.2 + jitter * values, values)

    monkeypatch.setattr(arms, "drives", some)
    frame = arms.measure(count=40)
    robot = as_measured(replace(arms.ARM, parameter_set="full"), frame)
    effect = find("drive_error_function", arms.ARM)
    problem = make_diagnosis_problem(frame, robot, arms.MASSES, 1.0, {effect.name: effect}, False, 500.0)
    effect = problem.library[effect.name]
    state = ModelState(calibrate(problem).deviations, {(effect.name, 0): np.zeros(len(effect.coordinates))})
    table = corrected_drives(SimpleNamespace(problem=problem, state=state), arms.MASSES)
    return table, frame[NAMES].to_numpy()


@pytest.mark.parametrize("still", [(), (1,)])
def test_drives_that_move_stay_within_the_values_at_which_their_functions_are_known(monkeypatch, still):
    table, drives = _table(monkeypatch, still)
    moved = [k for k in range(arms.DRIVES) if k not in still]
    nominal = table[NAMES].to_numpy()[:, moved]
    assert len(table) > 10
    assert (nominal > drives[:, moved].min(axis=0) - 1e-6).all() and (
        nominal < drives[:, moved].max(axis=0) + 1e-6
    ).all()


def test_without_a_place_at_which_the_functions_are_known_the_table_is_empty(monkeypatch):
    table, _ = _table(monkeypatch, (1,), 1e-7)
    assert not len(table) and {"point", "payload_kg", "approach", *NAMES} <= {*table.columns}


def test_a_drive_that_comes_from_one_side_has_wound_up_however_long_its_travel_is():
    """Dahl's friction after a long way, -a from below and a from above, in any order of the rows."""
    robot, amplitude = arms.ARM, np.full(arms.DRIVES, 4e-4)
    drive = arms.drives(6, np.random.default_rng(4))
    position = robot.forward(drive)
    effect = find("friction_windup", robot)
    for approach in (1, -1, np.random.default_rng(7).choice([-1.0, 1.0], drive.shape)):
        motion = at_rest(robot, arms.MASSES, (position, drive, 0.0, 0.0, np.nan), approach, drive)
        found = effect.contribute(motion, [*amplitude, 0.8])
        expected = motion.at_drives(np.broadcast_to(-approach * amplitude, drive.shape))
        np.testing.assert_allclose(found.twists, expected.twists, atol=1e-15)


def test_drive_values_are_those_of_the_robot_as_warm_as_at_the_last_point():
    """A robot whose links grow has its flange at (1 + a (T - 20)) times the place; the table was that of 20 degrees."""
    expansion, warm_c = 3e-5, 34.0
    frame = arms.measure(count=40).assign(temperature_c=np.linspace(22.0, warm_c, 40))
    effect = find("thermal_expansion", arms.ARM)
    robot = as_measured(replace(arms.ARM, parameter_set="full"), frame)
    problem = make_diagnosis_problem(frame, robot, arms.MASSES, 1.0, {effect.name: effect}, False, 500.0)
    nothing = np.zeros_like(calibrate(problem).deviations)
    state = ModelState(nothing, {(effect.name, 0): np.array([expansion])})
    table = corrected_drives(SimpleNamespace(problem=problem, state=state), arms.MASSES)
    assert len(table) > 10 and (table["temperature_c"] == warm_c).all()
    drive = table[[f"corrected_{name}" for name in NAMES]].to_numpy()
    flange = replace(arms.ARM, tool_mm=(0.0, 0.0, 0.0)).forward(drive)
    reached = arms.ARM.forward(drive) + expansion * (warm_c - 20.0) * flange
    off = np.linalg.norm(reached - table[["command_x_mm", "command_y_mm", "command_z_mm"]], axis=1)
    assert off.max() < 1e-3
