"""Inverse kinematics of a general robot by damped Newton steps, and the lengths of driven bars. mm, rad."""

from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial.transform import Rotation

from rrru.arrays import BoolArray, FloatArray
from rrru.cache import last_cached
from rrru.kinematics.chain import PoseGuess, Twists, bar_pose, walk
from rrru.kinematics.legs import Leg, Legs
from rrru.kinematics.parameter_jacobian import TwistMap

if TYPE_CHECKING:
    from rrru.kinematics.general_robot import GeneralRobot
    from rrru.kinematics.robot import Robot

# positions (n, 3) in mm and orientations (n, 3, 3), robot frame
PoseArrays = tuple[FloatArray, FloatArray]

# Newton steps of one solution, and the remaining error at which it ends
_MAX_STEPS, _REACHED_MM = 100, 1e-9
# larger errors than this after the last step are no solution
_ACCEPTED_MM = 1e3 * _REACHED_MM
# longest step of a drive, as a share of its range, or of a turn if that is less: longer ones end in other assemblies or
# do not converge
_LONGEST_STEP = 0.05
# singular values below this share of the matrix's norm count as zero: the pose is singular
_SINGULAR_SHARE = 1e-9
# where a singular pose leaves steps below the first share of the drives' ranges, all drives move by the second
_SHORTEST_STEP, _ESCAPE_STEP = 1e-6, 0.01
# values beyond a drive's range by no more than this share of it are in it: rounding
_SLACK = 1e-6
# a position off the surface that a robot's tool can reach, of two drives a plane, is met by the nearest one on it where
# it is off by less than this share of the robot's size, as errors of its parts are
_OFF_SURFACE_SHARE = 2e-3
# a pose followed from home is used where its distance from where it should be is below this share of home's distance
_MAX_DISTANCE_SHARE = 0.1


def drives_from_home(robot: "GeneralRobot", goal: PoseArrays, twists: FloatArray, nearest: bool) -> FloatArray:
    """`inverse_kinematics` near the home pose."""
    count, legs = len(goal[0]), robot.legs
    start = np.tile(legs.home_drives, (count, 1)), np.tile(legs.home_mm, (count, 1))
    return inverse_kinematics(robot, goal, start, twists, nearest)


def inverse_kinematics(
    robot: "Robot", goal: PoseArrays, start: tuple[FloatArray, FloatArray], twists: FloatArray, nearest: bool = True
) -> FloatArray:
    """Actuator values (n, K) of a robot at poses of its tool, under twists (n or 1, sites, 6); NaN where it has none.

    goal: positions (n, 3) of the tool and orientations (n, 3, 3) of the platform, met where the drives can choose
    it; start: actuator values (n, K) and positions (n, 3) near which to search; nearest: whether the nearest
    position that the drives can reach is accepted however far it is.
    """
    (position, wanted), (start_actuators, near) = goal, start
    actuators = np.array(start_actuators, dtype=float)
    poses, left = robot.solve(actuators, near, twists), np.full(len(position), np.inf)
    (low, high), widths = np.asarray(robot.drive_range, dtype=float).T, _widths(robot)
    # of a robot that reaches all positions no error is left
    off_surface_mm = _ACCEPTED_MM if robot.degrees_of_freedom[0] == 3 else _OFF_SURFACE_SHARE * robot.size_mm
    rows, going = np.arange(len(position)), np.isfinite(actuators).all(axis=1)
    for _ in range(_MAX_STEPS):
        going = going & poses.closed & ~(left[rows] < _REACHED_MM)
        rows, poses = rows[going], poses.of(going)
        if not len(rows):
            break
        twist = twists[rows] if len(twists) > 1 else twists
        at = robot.map(actuators[rows], poses, twist)
        error_mm = position[rows] - robot.measured(at.poses, twist)
        error_rad = Rotation.from_matrix(wanted[rows] @ at.poses.turn.transpose(0, 2, 1)).as_rotvec()
        step, error_of_turn, singular = drive_step(at, robot.degrees_of_freedom, error_mm, error_rad, widths)
        longest, gain = np.abs(step).max(axis=1), (at.drive_response @ (widths * step)[:, :, None])[:, :, 0]
        # an error that no drive changes stays: a point off the plane of a planar robot
        off_mm = np.linalg.norm(error_mm - gain, axis=1)
        accepted = nearest | (off_mm < off_surface_mm)
        going = accepted | singular | (longest >= _SHORTEST_STEP)
        # a plane that errors have tilted does not contain the commanded points: the nearest ones replace them
        error_mm = np.where((accepted & ~singular)[:, None], gain, error_mm)
        left[rows] = np.linalg.norm(error_mm, axis=1) + robot.characteristic_length_mm * error_of_turn
        step *= np.minimum(1.0, _LONGEST_STEP / np.maximum(longest, 1e-9))[:, None]
        # a stretched arm gets no step in the direction of its singularity: it is moved away from there
        stuck = singular & (longest < _SHORTEST_STEP) & (left[rows] >= _REACHED_MM)
        away = np.where(actuators[rows] - low > high - actuators[rows], -_ESCAPE_STEP, _ESCAPE_STEP)
        step[stuck] = away[stuck]
        actuators[rows] += widths * step
        poses = robot.model.solve(actuators[rows], poses, twist)
    return np.where((left < _ACCEPTED_MM)[:, None], actuators, np.nan)


@last_cached
def followed(robot: "GeneralRobot", actuators: FloatArray) -> PoseGuess:
    """Poses (n) at actuator values (n, K), followed in short steps of the drives from the home pose; NaN where lost."""
    legs, n = robot.legs, len(actuators)
    turn, passive = np.broadcast_to(legs.home_turn, (n, 3, 3)), np.tile(legs.home_passive, (n, 1))
    poses: PoseGuess = PoseGuess(np.tile(legs.home_mm, (n, 1)), turn, passive)
    for share in np.linspace(0.0, 1.0, _steps_from_home(robot, actuators) + 1)[1:]:
        poses = robot.model.solve(legs.home_drives + share * (actuators - legs.home_drives), poses)
    return poses


def near_or_followed(robot: "GeneralRobot", actuators: FloatArray, near: PoseGuess) -> PoseGuess:
    """Poses (n) from which to search at actuator values (n, K): `near`, or those followed from home if close to it.

    Passive joints far from home are not known from the platform's place alone.
    """
    if not len(robot.legs.passive_joints) or _steps_from_home(robot, actuators) < 2:
        return near
    poses = followed(robot, actuators)
    off = np.linalg.norm(poses.position_mm - near.position_mm, axis=1)
    close = off < _MAX_DISTANCE_SHARE * np.linalg.norm(robot.legs.home_mm - near.position_mm, axis=1)
    return poses.where(close, near)


def _steps_from_home(robot: "GeneralRobot", actuators: FloatArray) -> int:
    """Number of the steps in which drives may go from home to actuator values (n, K), at least one."""
    away = np.abs(actuators - robot.legs.home_drives) / _widths(robot)
    return max(1, int(np.ceil(np.nanmax(away, initial=0.0) / _LONGEST_STEP)))


def _widths(robot: "Robot") -> FloatArray:
    """Width (K,) of each drive's range, at most one turn of a turning drive; a turn where no range is known."""
    turning = np.array(robot.parts.units) == "rad"
    width = np.minimum(
        np.ptp(np.asarray(robot.drive_range, dtype=float), axis=1), np.where(turning, 2.0 * np.pi, np.inf)
    )
    turn = np.where(turning, 2.0 * np.pi, 2.0 * np.pi * robot.characteristic_length_mm)
    return np.where((width > 0.0) & np.isfinite(width), width, turn)


def in_range(robot: "GeneralRobot", actuators: FloatArray) -> FloatArray:
    """Actuator values (n, K), those of turning drives whole turns further where their ranges want it; NaN outside."""
    legs, slack = robot.legs, _SLACK * _widths(robot)
    low, high = np.asarray(robot.drive_range, dtype=float).T + np.outer([-1.0, 1.0], slack)
    coupling = np.eye(len(legs.driven_kinds)) if legs.coupling is None else legs.coupling
    turning, integer = np.array(legs.driven_kinds) == "R", np.isclose(coupling, np.rint(coupling))
    # a full turn of such a drive returns all joints that it moves
    periodic = ((coupling == 0.0) | (turning[:, None] & integer)).all(axis=0)
    turns = np.ceil((low - actuators) / (2.0 * np.pi))
    assumed = np.array([drive.column in robot.assumed for drive in robot.parts.drives])
    beyond = ~assumed & ~((low <= actuators) & (actuators <= high))
    result = np.where(beyond & periodic, actuators + 2.0 * np.pi * turns, actuators)
    return np.where(beyond & ~((low <= result) & (result <= high)), np.nan, result)


def drive_step(
    at: TwistMap, ranks: tuple[int, int], error_mm: FloatArray, error_rad: FloatArray, widths: FloatArray
) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Changes (n, K) of the actuator values that remove errors of position (n, 3) and, if possible, of orientation.

    error_rad (n, 3): rotation vectors from the present orientations to the goal's; ranks: degrees of freedom of the
    point's position and, in addition, of the platform's orientation by the drives; widths (K,): of the drives' ranges,
    which scale the changes; the smallest scaled changes are returned. Returns also the size (n,) in rad of the
    remaining change of orientation that is possible, and whether (n,) a pose lacks a degree of freedom. The orientation
    is corrected in the null space of the position (Siciliano et al., 2009, section 3.5).
    """
    response, turn = at.drive_response * widths, at.platform[:, 3:] @ at.drive_counts * widths
    reach, singular = _inverse_of_rank(response, ranks[0], response)
    step = reach @ error_mm[:, :, None]
    null_space = np.eye(len(widths)) - reach @ response
    inverse, aligned = _inverse_of_rank(turn @ null_space, ranks[1], turn)
    more = null_space @ inverse @ (error_rad[:, :, None] - turn @ step)
    possible = np.linalg.norm((turn @ more)[:, :, 0], axis=1)
    if sum(ranks) == 6:
        # every orientation can be met, in another pose if not here
        possible = np.where(aligned, np.linalg.norm(error_rad, axis=1), possible)
    return (step + more)[:, :, 0], possible, singular | aligned


def _inverse_of_rank(matrices: FloatArray, rank: int, unprojected: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Pseudo-inverses (n, k, j) of matrices (n, j, k) by their largest `rank` singular values, and which (n,) lack one.

    unprojected: matrices (n, j, k) of which these are projections; singular values negligible next to them are left
    out.
    """
    u, size, vt = np.linalg.svd(matrices, full_matrices=False)
    size = size[:, :rank]
    lost = size <= _SINGULAR_SHARE * np.linalg.norm(unprojected, axis=(1, 2))[:, None]
    shares = np.where(lost, 0.0, 1.0 / np.where(lost, 1.0, size))
    return (vt[:, :rank].transpose(0, 2, 1) * shares[:, None]) @ u[:, :, :rank].transpose(0, 2, 1), lost.any(axis=1)


def end_of(legs: Legs, leg: Leg, actuators: FloatArray) -> PoseGuess:
    """Poses (n) at which a leg ends whose joints are all driven, at actuator values (n, K)."""
    passive = np.zeros((len(actuators), len(legs.passive_joints)))
    way = walk(legs, leg, actuators, passive, Twists(legs))
    return PoseGuess(way.place, way.turn, passive)


def bar_lengths(legs: Legs, drive_range: FloatArray, poses: PoseArrays, twists: FloatArray) -> FloatArray:
    """Lengths (n, K) of driven bars at poses of the platform, NaN where one is outside of its range (K, 2).

    poses: its positions (n, 3) and orientations (n, 3, 3); twists (n or 1, sites, 6).
    """
    guess = PoseGuess(*poses, np.zeros((len(poses[0]), 0)))
    none, given = np.zeros((len(poses[0]), len(drive_range))), Twists(legs, twists)
    needed = none.copy()
    for leg in legs.legs:
        if leg.bar:
            way = walk(legs, leg, none, guess.passive, given)
            needed[:, leg.bar.drive] = -bar_pose(legs, leg, way, guess, none, given).lack_mm
    low, high = np.asarray(drive_range, dtype=float).T
    return np.where(((needed >= low) & (needed <= high)).all(axis=1, keepdims=True), needed, np.nan)
