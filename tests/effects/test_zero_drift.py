"""Zeros that move with time: against the chain at other drive values, and which drives have one."""

import numpy as np
import pytest

from rrru.campaign import measurements as rows
from rrru.diagnosis.make_problem import make_diagnosis_problem
from rrru.effects.library import find
from rrru.robots.delta import Delta
from rrru.robots.from_dh import from_dh
from rrru.robots.rrru3 import Rrru3
from tests.diagnosis import arms
from tests.diagnosis.gantry import GANTRY

_TURNS, _SLIDES = {"range_deg": [-90, 90], "a_mm": 200.0}, {"sliding": True, "range_mm": [0, 200]}


@pytest.mark.parametrize(
    ("rows", "own"),
    [
        ([_TURNS, _TURNS, _TURNS], (2, 3)),
        ([_TURNS, _SLIDES], (2,)),
        ([_SLIDES, _TURNS, _TURNS], (2, 3)),
        ([_SLIDES, _SLIDES], ()),
        ([_TURNS], ()),
    ],
)
def test_a_drive_whose_drift_moves_the_whole_robot_has_none(rows, own):
    arm = from_dh([row | {"alpha_deg": 90.0} for row in rows], name="arm")
    effect = find("zero_drift", arm)
    names = effect.parameters.names if effect else ("time_constant",)
    assert names == (*(f"drift{number}" for number in own), "time_constant")


def test_parallel_robots_and_gantries_have_none():
    assert all(find("zero_drift", robot) is None for robot in (Rrru3(), Delta(), GANTRY))


def test_the_arm_stands_where_other_drive_values_put_it():
    effect = find("zero_drift", arms.ARM)
    drive, time = arms.drives(30, np.random.default_rng(2)), np.linspace(0.0, 3000.0, 30)
    frame = arms.commands(drive).assign(time_s=time)
    frame = frame.assign(**rows.vector_columns("measured", rows.command(frame)))
    motion = make_diagnosis_problem(frame, arms.ARM, arms.MASSES, 1.0, {}).motion
    values = effect.parameters.vector({"drift3": 4e-4, "drift5": -2e-4, "time_constant": 700.0})
    off = np.zeros((30, 6))
    off[:, 2], off[:, 4] = 4e-4 * (1.0 - np.exp(-time / 700.0)), -2e-4 * (1.0 - np.exp(-time / 700.0))
    twists = effect.contribute(motion, values).twists
    position = arms.ARM.measured(arms.ARM.solve(drive, arms.ARM.forward(drive), twists), twists)
    np.testing.assert_allclose(position, arms.ARM.forward(drive + off), atol=1e-9)
