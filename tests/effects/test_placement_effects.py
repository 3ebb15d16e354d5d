"""Effects of axes, seats and frames against rigid motions of the whole robot and against the chain built in another
way.
"""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rrru.effects.library import find
from rrru.effects.motion import Course, make_motion
from rrru.kinematics.dynamics import Masses
from rrru.robots.hexapod import hexapod
from rrru.robots.rrru3 import Rrru3
from tests.effects.robots import EFFECTS, FORWARD, LINE, ROBOT, SPIRAL, drive, per_leg, plan_of
from tests.reference import spatial_chain
from tests.reference.spatial_chain import LENGTHS, PLACES

_PLAN = plan_of(FORWARD, trajectories=(LINE, SPIRAL))
_FOOT, _PLATFORM = PLACES.index("foot"), PLACES.index("platform")


def _solve(azimuth, displacements):
    """Positions (n, 3) and rotation vectors (n, 3) of the chains with other azimuths and displacements (3, 8, 6)."""
    target = _PLAN.targets()
    theta = ROBOT.inverse(target)
    passive = ROBOT.passive_angles(target, theta)
    position, turn = spatial_chain.close(LENGTHS, displacements, theta, passive, azimuth)
    return position, Rotation.from_matrix(turn).as_rotvec()


@pytest.mark.parametrize("leg", [1, 2, 3])
def test_a_tilted_axis_turns_the_platform_a_lengthened_link_does_not(leg):
    small = drive({"axis_tilt": {f"tilt_x{leg}": 1e-4}}, _PLAN)[2]
    large = drive({"axis_tilt": {f"tilt_x{leg}": 2e-4}}, _PLAN)[2]
    assert 1e-5 < np.median(small) < 1e-3
    np.testing.assert_allclose(large, 2.0 * small, rtol=0.01, atol=1e-7)
    assert drive({"leg_asymmetry": {f"dL3_leg{leg}": 1.0}}, _PLAN)[2].max() < 1e-12


@pytest.mark.parametrize("leg", [1, 2, 3])
def test_an_axis_swung_about_the_vertical_is_a_leg_at_another_azimuth_on_the_same_seat(leg):
    turn = 0.004
    azimuth, displacements = np.array(ROBOT.azimuth_rad), np.zeros((3, len(PLACES), 6))
    azimuth[leg - 1] += turn
    # the seat stays where it was, and the platform's side too
    displacements[leg - 1, _FOOT, :2] = 400.0 * np.cos(turn) - 400.0, -400.0 * np.sin(turn)
    displacements[leg - 1, _PLATFORM, 5] = turn
    other, rotation = _solve(azimuth, displacements)
    _, position, turned = drive({"axis_tilt": {f"tilt_z{leg}": turn}}, _PLAN)
    np.testing.assert_allclose(position, other, atol=1e-8)
    np.testing.assert_allclose(turned, np.linalg.norm(rotation, axis=1), atol=1e-12)


def test_seats_on_a_leaning_base_lean_the_whole_robot():
    """A base turned by a small angle about x is three tilted axes, three heights and three drive errors; the robot
    turns as one.
    """
    lean = 1e-4
    cosine, sine = np.cos(ROBOT.azimuth_rad), np.sin(ROBOT.azimuth_rad)
    effects = {"axis_tilt": per_leg("tilt_x", lean * cosine), "base_placement": per_leg("height", 400.0 * lean * sine)}
    # about the leg's own y the base turns by -lean sin(azimuth), the drive by -theta about the same axis
    deviations = {f"dtheta{k + 1}": lean * sine[k] for k in range(3)}
    _, position, turned = drive(effects, _PLAN, deviations=deviations)
    np.testing.assert_allclose(
        position, _PLAN.targets() @ Rotation.from_rotvec([lean, 0.0, 0.0]).as_matrix().T, atol=2e-5
    )
    np.testing.assert_allclose(turned, lean, rtol=1e-3)


def test_a_common_height_lifts_the_whole_robot():
    _, position, turned = drive({"base_placement": per_leg("height", 1.7)}, _PLAN)
    np.testing.assert_allclose(position, _PLAN.targets() + np.array([0.0, 0.0, 1.7]), atol=1e-8)
    assert turned.max() < 1e-12


def test_a_common_azimuth_turns_the_whole_robot_about_the_vertical():
    _, position, turned = drive({"base_placement": per_leg("azimuth", 0.003)}, _PLAN)
    np.testing.assert_allclose(
        position, _PLAN.targets() @ Rotation.from_rotvec([0.0, 0.0, 0.003]).as_matrix().T, atol=1e-8
    )
    np.testing.assert_allclose(turned, 0.003, rtol=1e-9)


def test_a_common_radius_is_the_papers_error_of_the_base():
    motion, position, _ = drive({"base_placement": per_leg("radius", -1.4)}, _PLAN)
    paper = Rrru3(parameter_set="published")
    exact = paper.forward(motion.drive, paper.parameters.vector({"dR": -1.4}), _PLAN.targets())
    np.testing.assert_allclose(position, exact, atol=1e-8)


@pytest.mark.parametrize("leg", [1, 2, 3])
def test_one_legs_place_is_the_chain_built_there(leg):
    """Azimuth, radius and height of one leg as a chain that starts at another azimuth, with the platform's side left as
    it was.
    """
    turn, radius, height = 0.01, 2.0, -3.0
    azimuth, displacements = np.array(ROBOT.azimuth_rad), np.zeros((3, len(PLACES), 6))
    azimuth[leg - 1] += turn
    displacements[leg - 1, _FOOT, :3] = radius, 0.0, height
    displacements[leg - 1, _PLATFORM, 5] = turn
    other, _ = _solve(azimuth, displacements)
    section = {f"azimuth{leg}": turn, f"radius{leg}": radius, f"height{leg}": height}
    _, position, turned = drive({"base_placement": section}, _PLAN)
    np.testing.assert_allclose(position, other, atol=1e-8)
    assert turned.min() > 1e-4


def test_a_reflector_off_its_seat_turns_with_the_platform_that_the_drives_turn():
    """On a hexapod whose legs are driven by amounts of their own, so that its platform tilts."""
    angle = np.radians([10.0, 110.0, 130.0, 230.0, 250.0, 350.0])
    base = 400.0 * np.stack([np.cos(angle), np.sin(angle), np.zeros(6)], axis=1)
    robot = hexapod(base, -0.6 * base[[3, 4, 5, 0, 1, 2]], 500.0)
    assert find("tool_offset", ROBOT) is None
    drive = robot.legs.home_drives + np.random.default_rng(0).uniform(-30.0, 30.0, (5, 6))
    target, still, none = np.tile([0.0, 0.0, 500.0], (5, 1)), np.zeros((5, 3)), np.zeros(5)
    course = Course(target, drive, drive, np.arange(5), none, still, still, none)
    offset, poses = np.array([0.7, -0.4, 0.9]), robot.solve(drive, target)
    change = find("tool_offset", robot).contribute(make_motion(robot, Masses(), course), offset)
    moved = robot.measured(poses, change.twists) - robot.measured(poses, robot.twists())
    np.testing.assert_allclose(moved, poses.turn @ offset, atol=1e-12)
    assert np.linalg.norm(moved - offset, axis=1).min() > 0.01


def test_crooked_joints_are_the_chain_with_crooked_axes():
    """Shifts and tilts across every joint's axis, drawn, as displacements of the chain's seats."""
    effect = EFFECTS["joint_axis_error"]
    values = dict(
        zip(
            effect.parameters.names,
            np.random.default_rng(6).normal(size=len(effect.parameters)) * effect.coordinates.typical,
            strict=True,
        )
    )
    displacements = np.zeros((3, len(PLACES), 6))
    for name, value in values.items():
        kind, axis, _, leg, place = name.split("_")
        component = "xyz".index(axis) + (3 if kind == "tilt" else 0)
        # the drive's seat is the foot's end, and an axis along y or z has two shifts and two tilts across it
        assert axis != ("z" if place in ("knee", "wrist") else "y")
        displacements[int(leg) - 1, PLACES.index(place), component] = value
    other, rotation = _solve(np.array(ROBOT.azimuth_rad), displacements * _senses(effect))
    _, position, turned = drive({"joint_axis_error": values}, _PLAN)
    np.testing.assert_allclose(position, other, atol=1e-8)
    np.testing.assert_allclose(turned, np.linalg.norm(rotation, axis=1), atol=1e-12)
    assert turned.min() > 1e-5


def _senses(effect):
    """Signs (3, 8, 6) of the effect's unit vectors across the axes, read off its own contribution."""
    motion = drive({}, _PLAN)[0]
    one = effect.contribute(motion, np.ones(len(effect.parameters))).twists[0, 1:25].reshape(3, len(PLACES), 6)
    assert np.isin(np.round(one, 12), (-1.0, 0.0, 1.0)).all()
    return np.round(one)


def test_a_wrong_frame_is_a_rigid_motion_of_all_points():
    shift, turn = np.array([1.0, -2.0, 0.5]), np.array([2e-3, 1e-3, -3e-3])
    section = {f"shift_{a}": s for a, s in zip("xyz", shift, strict=True)} | {
        f"turn_{a}": w for a, w in zip("xyz", turn, strict=True)
    }
    _, position, turned = drive({"frame_misregistration": section}, _PLAN)
    angle = np.linalg.norm(turn)
    axis = turn / angle
    target = _PLAN.targets()
    # Rodrigues' formula
    rotated = (
        target * np.cos(angle)
        + np.cross(axis, target) * np.sin(angle)
        + np.outer(target @ axis, axis) * (1.0 - np.cos(angle))
    )
    np.testing.assert_allclose(position, rotated + shift, atol=1e-8)
    assert turned.max() < 1e-12


def test_the_frame_comes_after_everything_else():
    other = {"backlash": per_leg("width", 0.001), "leg_asymmetry": {"dL3_leg2": 1.0}}
    section = {"shift_y": 3.0, "turn_z": 0.002}
    _, plain, _ = drive(other, _PLAN)
    _, moved, _ = drive(other | {"frame_misregistration": section}, _PLAN)
    np.testing.assert_allclose(
        moved, plain @ Rotation.from_rotvec([0.0, 0.0, 0.002]).as_matrix().T + np.array([0.0, 3.0, 0.0]), atol=1e-9
    )
