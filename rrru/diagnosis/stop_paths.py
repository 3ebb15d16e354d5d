"""Paths of the drives between stops, and the side from which they come to each, for campaigns that stop to measure.

Joint interpolation (PTP) moves every drive straight to its next value: it comes from the side of the value before. On a
straight line of the tool (LIN) a drive may turn back on the way: it comes from the side of its last stretch. A drive
that does not move between two stops keeps its side of arrival. Lengths in mm, angles in rad.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from rrru.campaign.stated_motion import DRIVES, TOOL
from rrru.effects.backlash import play
from rrru.kinematics.inverse import inverse_kinematics

# points of a path, denser near its ends: a drive may turn back just before a stop
_STEPS = 16
_SHARES = 0.5 * (1.0 - np.cos(np.pi * np.arange(_STEPS + 1) / _STEPS))
# senses of arrival that differ by less are the same: values of a long drive are rounded to some 1e-5 of its rest width
_SAME = 0.01


def paths_between_stops(mechanism, drive, position_mm, between):
    """Actuator values (N, K) along everything that is driven, one path for each way that the robot may have taken, and
    their rows (s,) at the stops; `between` as `rrru.campaign.stated_motion.StatedMotion` has it.

    drive (s, K), position_mm (s, 3): of the stops.
    """
    index = _STEPS * np.arange(len(drive))
    ways = {DRIVES: _straight_in_drives, TOOL: _straight_in_tool}
    chosen = [between] if between else [DRIVES, TOOL]
    return [_joined(ways[name](mechanism, drive, position_mm), drive) for name in chosen], index


def undetermined_senses(paths, index, run, widths):
    """Stops (s, K) at which paths of `paths_between_stops` do not determine from which side a drive comes.

    No path determines how the robot got to a run's start, run (s,), nor its motion where its path is unknown. Two paths
    determine nothing where they come from different sides. widths (K,): changes of drive values that are no motion.
    """
    senses = [_senses_of_arrival(path, index, run, widths) for path in paths]
    lost = [np.logical_or.reduceat(np.isnan(path), np.maximum(index - _STEPS + 1, 0)) for path in paths]
    least = np.min([np.abs(sense) for sense in senses], axis=0)
    return (least < 1.0 - _SAME) | (np.ptp(senses, axis=0) > _SAME) | np.any(lost, axis=0)


def _senses_of_arrival(path, index, run, widths):
    """Senses (s, K) in which the drives come to stops of runs (s,): 1 from below, -1 from above, less where a drive has
    moved by less than its width (K,) since the run's start or a reversal.
    """
    result = np.zeros((len(index), path.shape[1]))
    for number in np.unique(run):
        stops = index[run == number]
        piece = np.ascontiguousarray(path[stops[0] : stops[-1] + 1])
        result[run == number] = play(piece, 0.5 * widths)[stops - stops[0]] / (-0.5 * widths)
    return result


def _straight_in_drives(_mechanism, drive, _position_mm):
    """Actuator values (s - 1, steps + 1, K) on the ways between stops, straight in the drives."""
    return drive[:-1, None] + _SHARES[:, None] * np.diff(drive, axis=0)[:, None]


def _straight_in_tool(mechanism, drive, position_mm):
    """Actuator values (s - 1, steps + 1, K) on the ways between stops, on straight lines of the tool.

    Its orientation turns about one axis. NaN where the nominal robot cannot reach.
    """
    straight = _straight_in_drives(mechanism, drive, position_mm)
    shape, poses = straight.shape, mechanism.solve(drive, position_mm)
    place = position_mm[:-1, None] + _SHARES[:, None] * np.diff(position_mm, axis=0)[:, None]
    if mechanism.orients:
        turn, first = _turning(poses.turn), straight.reshape(-1, shape[2])
        place = poses.point(np.asarray(mechanism.tool_mm))
        place = place[:-1, None] + _SHARES[:, None] * np.diff(place, axis=0)[:, None]
        place = place.reshape(-1, 3)
        found = inverse_kinematics(mechanism, (place, turn), (first.copy(), place), mechanism.twists(), False).reshape(
            shape
        )
    else:
        found = mechanism.inverse(place.reshape(-1, 3)).reshape(shape)
    # both ends agree with the rows, also for a controller that corrects the robot's errors
    found = found + (1.0 - _SHARES[:, None]) * (straight - found)[:, :1] + _SHARES[:, None] * (straight - found)[:, -1:]
    return found


def _turning(turn):
    """Orientations (m, 3, 3) on the ways between those (s, 3, 3) of stops, each way about one axis."""
    start = Rotation.from_matrix(np.repeat(turn[:-1], len(_SHARES), axis=0))
    whole = Rotation.from_matrix(turn[:-1].transpose(0, 2, 1) @ turn[1:]).as_rotvec()
    part = Rotation.from_rotvec((_SHARES[None, :, None] * whole[:, None]).reshape(-1, 3))
    return (start * part).as_matrix()


def _joined(ways, drive):
    """The path (N, K) of ways (s - 1, steps + 1, K) from stop to stop at drive values (s, K)."""
    between = np.concatenate([drive[:-1, None], ways[:, 1:-1]], axis=1)
    return np.concatenate([between.reshape(-1, drive.shape[1]), drive[-1:]])
