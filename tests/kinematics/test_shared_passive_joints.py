"""Legs that part behind a passive joint: a Delta whose second arm swings freely, held by a strut instead."""

import numpy as np
import pytest

from rrru.formats.robot_file import from_mjcf
from rrru.kinematics.chain import Poses
from rrru.kinematics.legs import TOOL, WORLD
from rrru.robots.delta import Delta
from tests.formats.mjcf import GEOM, delta_mjcf, file_of, text_of

DELTA, FOOT = Delta(), np.array([50.0, 80.0, 900.0])
POINTS = np.random.default_rng(1).uniform((-150.0, -150.0, -120.0), (150.0, 150.0, 120.0), (40, 3))
THETA = DELTA.inverse(POINTS)
# the strut's slide is zero where the platform is in the origin
DRIVES = np.column_stack([THETA[:, 0], THETA[:, 2], np.linalg.norm(POINTS - FOOT, axis=1) - np.linalg.norm(FOOT)])


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    folder, along = tmp_path_factory.mktemp("strut"), -FOOT / np.linalg.norm(FOOT)
    strut = f"""<body name="strut" pos="{text_of(FOOT / 1000.0)}"><joint name="strut" type="ball"/>{GEOM}
    <body name="rod" pos="{text_of(0.3 * along)}"><joint name="push" type="slide" axis="{text_of(along)}"/>{GEOM}</body>
    </body></worldbody>"""
    text = delta_mjcf(folder, DELTA).read_text().replace('<position joint="theta2" kp="100"/>', "")
    text = text.replace("</worldbody>", strut).replace("</actuator>", '<position joint="push" kp="100"/></actuator>')
    text = text.replace("</equality>", '<connect body1="plate" body2="rod" anchor="0 0 0"/></equality>')
    return from_mjcf(file_of(folder, text), "plate")


@pytest.fixture(scope="module")
def poses(robot):
    poses = robot.solve(DRIVES, POINTS)
    assert poses.closed.all()
    return poses


def test_the_platform_stands_and_the_free_arm_hangs_where_the_deltas_do(robot, poses):
    assert robot.parts.columns == ["theta1_rad", "theta3_rad", "push_mm"]
    assert sorted(map(len, robot.legs.groups)) == [1, 1, 1, 1, 1, 2]
    np.testing.assert_allclose(poses.position_mm, POINTS, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(poses.turn, np.tile(np.eye(3), (len(POINTS), 1, 1)), rtol=0.0, atol=1e-11)
    arm = poses.passive[:, robot.legs.passive_numbers["theta2"]]
    np.testing.assert_allclose(arm, THETA[:, 1], rtol=0.0, atol=1e-11)


def _slope(robot, poses, actuators, twists, step):
    """Central difference (n, 3) of the exact closure; actuators, twists: (n, ..) by the sign and size of a step."""
    start = Poses(poses.position_mm, poses.turn, poses.passive, None, None)
    ends = [robot.model.solve(actuators(sign * step), start, twists(sign * step)) for sign in (1.0, -1.0)]
    assert all(end.closed.all() for end in ends)
    return (ends[0].position_mm - ends[1].position_mm) / (2.0 * step)


def test_the_map_is_the_closures_slope_at_every_site_and_drive(robot):
    """At poses of finite twists; a turn about its own axis changes nothing at the free arm."""
    numbers = robot.legs.site_numbers
    at_all = np.random.default_rng(2).normal(size=(len(POINTS), len(numbers), 6)) * np.repeat([0.3, 2e-3], 3)
    at_all[:, [numbers[WORLD], numbers[TOOL]]] = 0.0
    poses = robot.solve(DRIVES, POINTS, at_all)
    at, seen = robot.map(DRIVES, poses, at_all), []
    for site in set(robot.legs.sites) - {WORLD, TOOL}:
        for component, step in enumerate(np.repeat([5e-3, 2e-5], 3)):

            def turned(change, site=site, component=component):
                result = at_all.copy()
                result[:, numbers[site], component] += change
                return result

            slope = _slope(robot, poses, lambda _: DRIVES, turned, step)
            response = at.response(site)[:, :, component]
            np.testing.assert_allclose(response, slope, rtol=0.0, atol=3e-3 if component > 2 else 3e-6)
            seen.append(np.abs(slope).max())
    assert np.median(seen) > 0.1
    free = robot.map(DRIVES, robot.solve(DRIVES, POINTS)).response("theta2")
    axis = next(joint.axis for joint in robot.legs.joints if joint.name == "theta2")
    assert np.abs(free[:, :, 3:] @ axis).max() < 1e-8 < 1e-2 < np.abs(free).max()
    for k, step in enumerate((2e-5, 2e-5, 5e-3)):
        slope = _slope(robot, poses, lambda change, k=k: DRIVES + change * np.eye(3)[k], lambda _: at_all, step)
        np.testing.assert_allclose(at.drive_response[:, :, k], slope, rtol=0.0, atol=3e-3 if k < 2 else 3e-6)


def test_the_legs_bear_any_load_and_the_free_arm_none_about_its_axis(robot, poses):
    at = robot.map(DRIVES, poses)
    load = np.random.default_rng(3).normal(size=(len(POINTS), 6)) * np.repeat([10.0, 3000.0], 3)
    wrenches = at.wrenches(load)
    np.testing.assert_allclose(wrenches.sum(axis=0), -load, rtol=0.0, atol=1e-6)
    group = next(group for group in robot.legs.groups if len(group) == 2)
    both = wrenches[list(group)].sum(axis=0)
    turn, place = at.frames[robot.legs.site_numbers["theta2"]]
    axis = turn @ next(joint.axis for joint in robot.legs.joints if joint.name == "theta2")
    torque = ((both[:, 3:] - np.cross(place, both[:, :3])) * axis).sum(axis=1)
    assert np.abs(torque).max() < 1e-6 * np.abs(both[:, 3:]).max()
    measure, _ = at.constraint_measures(robot.characteristic_length_mm)
    assert (measure > 1e-3).all()
