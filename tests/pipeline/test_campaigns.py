"""Tables of a campaign before any fit: the workspace of gantries, where the slides are the whole reach."""

from itertools import product

import numpy as np
import pandas as pd
import pytest

from rrru.campaign.measurements import vector_columns
from rrru.pipeline.campaigns import workspace_table
from rrru.robots.catalogue import make_mechanism
from tests.places import ROOT
from tests.schemas import TABLES

_LOW, _HIGH = np.array([0.0, 100.0, -50.0]), np.array([1000.0, 800.0, 450.0])


def _gantry(low=_LOW, high=_HIGH):
    """Slides along x, y and z in turn, from frame to frame without a length."""
    slides = [
        {"sliding": True, "name": name, "range_mm": [*ends]} for name, *ends in zip("xyz", low, high, strict=True)
    ]
    turns = [{"rpy_deg": [0, 90, 0]}, {"rpy_deg": [-90, 0, 0]}, {"rpy_deg": [0, -90, 0]}]
    return make_mechanism("gantry", {"dh": [row for pair in zip(turns, slides, strict=True) for row in pair]})


def _commands(points):
    return pd.DataFrame(vector_columns("command", np.asarray(points, dtype=float)))


def test_the_gantry_s_slides_are_its_axes():
    robot, drives = _gantry(), np.random.default_rng(1).uniform(_LOW, _HIGH, (10, 3))
    np.testing.assert_allclose(robot.forward(drives), drives, atol=1e-9)


def test_a_robot_that_orients_has_no_region_of_reach():
    robot = make_mechanism("arm", {"urdf": str(ROOT / "data/models/arm6.urdf")})
    table = workspace_table(robot, _commands([[500.0, 0.0, 800.0], [600.0, 100.0, 700.0]]))
    assert robot.orients and table.empty
    assert set(TABLES["workspace"].names) == {*table.columns, "campaign"}


def test_no_corner_of_a_gantry_is_farther_than_its_reach():
    corners = np.array(list(product(*zip(_LOW, _HIGH, strict=True))))
    farthest = np.linalg.norm(corners, axis=1).max()
    assert _gantry().reach_mm >= farthest and _gantry().size_mm >= farthest


@pytest.mark.parametrize(("low_y", "slice_y"), [(-200.0, 0.0), (100.0, 460.0)])
def test_the_workspace_of_a_gantry_is_where_its_slides_go(low_y, slice_y):
    """The vertical slice goes through the commands where the gantry reaches nothing at y = 0."""
    low = np.array([_LOW[0], low_y, _LOW[2]])
    table = workspace_table(_gantry(low), _commands([[300.0, 440.0, 100.0], [500.0, 480.0, 140.0]]))
    upright, level = (table[table["slice"] == plane] for plane in ("xz", "xy"))
    assert (upright["y_mm"] == slice_y).all() and (level["z_mm"] == 120.0).all()
    points = table[["x_mm", "y_mm", "z_mm"]].to_numpy()
    inside = ((points >= low) & (points <= _HIGH)).all(axis=1)
    np.testing.assert_array_equal(table["reachable"], inside)
    assert all(part["reachable"].any() and not part["reachable"].all() for part in (upright, level))
