"""The compiled closure against NumPy's, on robots of every kind of leg, and where nothing closes."""

from dataclasses import replace

import numpy as np
import pytest

from rrru.errors import ConfigError
from rrru.kinematics.chain import Poses, Twists, walks
from rrru.kinematics.closure import Closure
from rrru.kinematics.legs import Bar, Joint, Leg, Legs, X, Y, Z, turn_about
from rrru.kinematics.wrenches import constraints_of, spare_joints
from rrru.robots.delta import Delta
from rrru.robots.ptt3 import Ptt3
from rrru.robots.rrru3 import Rrru3
from tests.reference import closure as slow

POINTS = 30
# joints of six bars on the base and on the platform, and the platform's height over the base
_ON_BASE, _ON_TOP = np.radians([[-8.0, 8.0, 112.0, 128.0, 232.0, 248.0], [-52.0, 52.0, 68.0, 172.0, 188.0, 292.0]])
BASE = 300.0 * np.column_stack([np.cos(_ON_BASE), np.sin(_ON_BASE), np.zeros(6)])
TOP = 150.0 * np.column_stack([np.cos(_ON_TOP), np.sin(_ON_TOP), np.zeros(6)])
HEIGHT = 400.0 * Z
LENGTHS = np.linalg.norm(TOP + HEIGHT - BASE, axis=1)


def _three_legged(robot, *box):
    """Legs, actuator values and start of a robot with a closed inverse at random positions."""
    position = np.random.default_rng(1).uniform(*np.transpose(box), (POINTS, 3))
    actuators = robot.inverse(position)
    assert np.isfinite(actuators).all()
    return robot.legs, actuators, robot.near(position, actuators)


def _around_home(legs, size):
    """Legs, actuator values around their home ones, and their home pose as start."""
    actuators = legs.home_drives + np.random.default_rng(2).uniform(-size, size, (POINTS, len(legs.home_drives)))
    home = (legs.home_mm, (3,)), (legs.home_turn, (3, 3)), (legs.home_passive, (len(legs.passive_joints),))
    return legs, actuators, Poses(*(np.broadcast_to(part, (POINTS, *shape)) for part, shape in home), None, None)


def _hexapod():
    bars = (Leg(f"leg {k}", (Joint(f"base {k}", shift_mm=BASE[k]),), bar=Bar(0.0, TOP[k], drive=k)) for k in range(6))
    return Legs(tuple(bars), LENGTHS, HEIGHT)


def _ball_and_ball():
    """The hexapod with chains for bars: each spins between its two balls, six joints of rank five."""
    legs = []
    for k, line in enumerate((TOP + HEIGHT - BASE) / LENGTHS[:, None]):
        across, lean = np.arctan2(-line[1], line[2]), np.arcsin(line[0])
        joints = (
            Joint(f"base {k}", shift_mm=BASE[k]),
            Joint(f"ball x {k}", "R", X, home=across),
            Joint(f"ball y {k}", "R", Y, home=lean),
            Joint(f"ball z {k}", "R", Z),
            Joint(f"slide {k}", "P", Z, drive=k),
            Joint(f"end z {k}", "R", Z),
            Joint(f"end y {k}", "R", Y, home=-lean),
            Joint(f"end x {k}", "R", X, home=-across),
            Joint(f"platform {k}", shift_mm=-TOP[k]),
        )
        legs.append(Leg(f"leg {k}", joints))
    return Legs(tuple(legs), LENGTHS, HEIGHT)


def _arm():
    """A serial arm of six driven joints."""
    shifts = (0.0 * X, 300.0 * Z, 500.0 * Z, 100.0 * X, 400.0 * X, 80.0 * X)
    joints = tuple(
        Joint(f"joint {k}", "R", axis, shift, drive=k)
        for k, (axis, shift) in enumerate(zip((Z, Y, Y, X, Y, X), shifts, strict=True))
    )
    home = np.array([0.1, 0.2, 0.3, 0.2, 0.9, -0.3])
    turn, place = np.eye(3), np.zeros(3)
    for joint, value in zip(joints, home, strict=True):
        place, turn = place + turn @ joint.shift_mm, turn @ turn_about(joint.axis, value)
    return Legs((Leg("arm", joints),), home, place, turn)


def _with_bars(count):
    """The 3-RRRU with a leg whose forearm is some bars side by side: bars and chains, six constraints or more."""
    robot = Rrru3()
    legs, actuators, start = _three_legged(robot, (-150, 150), (-150, 150), (550, 800))
    bars = []
    for k in range(count):
        side = 60.0 * (k - 0.5 * (count - 1)) * Y
        elbow = Joint(f"elbow {k}", shift_mm=robot.L1_mm * X + side)
        bar = Bar(robot.L2_mm + robot.L3_mm, robot.r_mm * X + side)
        bars.append(Leg(f"bar {k}", (*legs.legs[0].joints[:3], elbow), bar=bar))
    mixed = Legs((*bars, *legs.legs[1:]), legs.home_drives, legs.home_mm)
    return mixed, actuators, replace(start, passive=start.passive[:, 4:])


def _cables(anchors, ends, *others):
    """A platform on cables from its sides, and other legs."""
    bars = [
        Leg(f"cable {k}", (Joint(f"anchor {k}", shift_mm=anchors[k]),), bar=Bar(0.0, ends[k], k))
        for k in range(len(ends))
    ]
    return Legs((*bars, *others), np.linalg.norm(ends - anchors, axis=1))


def _in_space():
    """Eight cables, two constraints more than six."""
    corners = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
    return _cables(500.0 * corners, corners @ turn_about(Z, 0.6).T * [90.0, 60.0, -40.0])


def _in_a_plane():
    """Three cables, and two slides and a turn that keep the platform in their plane."""
    spots = 80.0 * np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]])
    plane = Leg("plane", (Joint("along", "P", X), Joint("across", "P", Y), Joint("turn", "R", Z)))
    return _cables(6.0 * spots, np.roll(spots, 1, axis=0), plane)


CASES = {
    "3-RRRU": lambda: _three_legged(Rrru3(), (-150, 150), (-150, 150), (550, 800)),
    "3-PTT": lambda: _three_legged(Ptt3(), (-60, 60), (-60, 60), (-300, -200)),
    "3-PTT, upright": lambda: _three_legged(Ptt3(rail_inclination_rad=np.pi / 2), (-60, 60), (-60, 60), (-300, -200)),
    "Delta": lambda: _three_legged(Delta(), (-200, 200), (-200, 200), (-200, 100)),
    "hexapod": lambda: _around_home(_hexapod(), 25.0),
    "balls": lambda: _around_home(_ball_and_ball(), 25.0),
    "arm": lambda: _around_home(_arm(), 0.3),
    "two bars and chains": lambda: _with_bars(2),
    "three bars and chains": lambda: _with_bars(3),
    "eight cables": lambda: _around_home(_in_space(), 1.0),
    "plane": lambda: _around_home(_in_a_plane(), 5.0),
}


def _twists(legs, count=POINTS):
    """Random twists (count, sites, 6) of some mm and hundredths of a rad."""
    values = np.random.default_rng(3).normal(size=(count, len(legs.sites), 6))
    # three bars side by side hardly hold what they contradict each other in
    return values * np.repeat([1.0, 0.01], 3) * (0.01 if "bar 2 bar" in legs.sites else 1.0)


def _where_spin_is_not_felt(legs, twists):
    """The twists on both ends of bars that spin, and along these."""
    result = np.zeros_like(twists)
    for name, number in legs.site_numbers.items():
        if name.startswith(("base", "platform")):
            result[:, number] = twists[:, number]
        if name.startswith("slide"):
            result[:, number, 2] = twists[:, number, 2]
    return result


def _parts(poses, rows):
    """All that Poses hold at some rows, as bytes."""
    return [getattr(poses, name)[rows].tobytes() for name in poses.__dataclass_fields__]


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("twisted", ["everywhere", "alike", "nowhere"])
def test_compiled_poses_equal_numpys_within_1e_9_mm(name, twisted):
    legs, actuators, start = CASES[name]()
    twists = {"everywhere": _twists(legs), "alike": _twists(legs, 1), "nowhere": None}[twisted]
    if name == "balls" and twists is not None:
        twists = _where_spin_is_not_felt(legs, twists)
    fast, plain = Closure(legs).solve(actuators, start, twists), slow.solve(legs, actuators, start, twists)
    assert plain.closed.all() and fast.closed.all()
    np.testing.assert_allclose(fast.position_mm, plain.position_mm, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(fast.turn, plain.turn, rtol=0.0, atol=1e-12)
    if name != "balls":
        np.testing.assert_allclose(fast.passive, plain.passive, rtol=0.0, atol=1e-11)


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("count", [POINTS, 1])
def test_compiled_walks_and_bars_equal_numpys(name, count):
    legs, actuators, start = CASES[name]()
    twists = Twists(legs, _twists(legs, count))
    for leg, way in zip(legs.legs, walks(legs, actuators, start, twists), strict=True):
        plain = slow.walk(legs, leg, actuators, start.passive, twists)
        for part in ("turns", "places", "axes", "turn", "place"):
            fast, expected = getattr(way, part), np.reshape(getattr(plain, part), getattr(way, part).shape)
            np.testing.assert_allclose(fast, expected, rtol=0.0, atol=1e-11, err_msg=part)
        if leg.bar:
            bar = way.bar
            near, far, length = slow.bar_ends(legs, leg, plain, start, actuators, twists)
            span = np.linalg.norm(far - near, axis=1)
            np.testing.assert_allclose(bar.far, far, rtol=0.0, atol=1e-11)
            np.testing.assert_allclose(bar.line, (far - near) / span[:, None], rtol=0.0, atol=1e-13)
            np.testing.assert_allclose(bar.lack_mm, length - span, rtol=0.0, atol=1e-11)
            # right-handed and square
            np.testing.assert_allclose(
                bar.frame @ bar.frame.transpose(0, 2, 1), np.tile(np.eye(3), (POINTS, 1, 1)), atol=1e-14
            )
            np.testing.assert_allclose(np.linalg.det(bar.frame), 1.0, atol=1e-14)


def test_twists_at_another_number_of_points_are_refused():
    legs, actuators, start = CASES["hexapod"]()
    with pytest.raises(ValueError, match="twists at 7 points; allowed: 1 or 30"):
        walks(legs, actuators, start, Twists(legs, _twists(legs, 7)))


def test_chains_with_a_joint_too_many_close_under_any_twists_and_keep_its_value():
    legs, actuators, start = CASES["balls"]()
    closure, twists = Closure(legs), Twists(legs, _twists(legs))
    assert constraints_of(legs, spare_joints(legs)) == [1] * 6
    poses = closure.solve(actuators, start, twists.values)
    assert poses.closed.all()
    unchanged = [joint.name.startswith("end z") for joint in legs.passive_joints]
    assert ((poses.passive == start.passive) == unchanged).all()
    for way in walks(legs, actuators, poses, twists):
        np.testing.assert_allclose(slow.lack_of(way, poses), 0.0, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("name", CASES)
def test_a_point_is_solved_the_same_in_any_company(name):
    legs, actuators, start = CASES[name]()
    closure, twists, order = Closure(legs), _twists(legs), np.random.default_rng(4).permutation(POINTS)[:7]
    near = Poses(start.position_mm[order], start.turn[order], start.passive[order], None, None)
    apart = closure.solve(actuators[order], near, twists[order])
    assert _parts(closure.solve(actuators, start, twists), order) == _parts(apart, slice(None))


@pytest.mark.parametrize("name", CASES)
def test_what_is_not_known_gives_no_pose_and_harms_no_other(name):
    legs, actuators, start = CASES[name]()
    closure, unknown, lost = Closure(legs), actuators.copy(), start.position_mm.copy()
    unknown[3, 1], lost[8, 2] = np.nan, np.inf
    poses = closure.solve(unknown, replace(start, position_mm=lost))
    for row in (3, 8):
        assert poses.residual_mm[row] == np.inf and not poses.closed[row]
        assert all(np.isnan(one[row]).all() for one in (poses.position_mm, poses.turn, poses.passive))
    others = np.delete(np.arange(POINTS), [3, 8])
    assert _parts(poses, others) == _parts(closure.solve(actuators, start), others)


@pytest.mark.parametrize("name", ["3-RRRU", "3-PTT", "Delta", "hexapod", "balls", "two bars and chains"])
def test_out_of_reach_gives_no_pose(name):
    legs, actuators, start = CASES[name]()
    twists = np.zeros((POINTS, len(legs.sites), 6))
    # a leg stands far off at every second point
    twists[::2, legs.site_numbers[legs.legs[-1].joints[0].name], :3] = 6000.0
    poses = Closure(legs).solve(actuators, start, twists)
    assert (poses.closed == (np.arange(POINTS) % 2 == 1)).all() and (poses.residual_mm[::2] > 1.0).all()
    assert np.isnan(poses.position_mm[::2]).all() and np.isfinite(poses.position_mm[1::2]).all()


def test_no_step_is_no_closure():
    """Level bars that are too short pull the platform of a Delta nowhere, from one place, and do not lift it."""
    robot = Delta()
    legs, start = robot.legs, robot.near(np.array([[0.0, 0.0, robot.origin_depth_mm]]), np.zeros((1, 3)))
    twists = np.zeros((1, len(legs.sites), 6))
    twists[0, [number for name, number in legs.site_numbers.items() if name.endswith("bar")], 0] = -500.0
    poses = Closure(legs).solve(np.zeros((1, 3)), start, twists)
    assert not poses.closed[0] and abs(poses.residual_mm[0] - (robot.a_mm + robot.l1_mm + 500.0 - robot.l2_mm)) < 1e-6


def test_shapes_that_do_not_fit_are_refused():
    legs, actuators, start = CASES["hexapod"]()
    with pytest.raises(ValueError, match="actuator values"):
        Closure(legs).solve(actuators[:, :5], start)
    with pytest.raises(ValueError, match="twists at 2 points"):
        Closure(legs).solve(actuators, start, np.zeros((2, len(legs.sites), 6)))
    with pytest.raises(ValueError, match="broadcast"):
        Closure(legs).solve(actuators[:7], start)


def test_a_passive_joint_before_a_bar_is_refused():
    legs = _hexapod()
    swinging = replace(legs.legs[0], joints=(*legs.legs[0].joints, Joint("hinge", "R", Y)))
    more = Leg("more", (Joint("base more", shift_mm=-BASE[0]),), bar=Bar(400.0, -TOP[0]))
    with pytest.raises(ConfigError, match="leg 0: 1 of the joints before its bar"):
        Closure(Legs((swinging, *legs.legs[1:], more), LENGTHS, HEIGHT))
