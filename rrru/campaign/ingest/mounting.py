"""Where the reflectors of a file sit on the platform, stated or found from the file. Lengths in mm, angles in rad.

With the robot's nominal poses, centre p_i and orientation R_i, a reflector at c on the platform is read at m_i,

    Q m_i + s = p_i + R_i c

with the rotation Q and shift s of the instrument's frame (identity where it is the robot's). The equations are linear
in s, c and, its orthogonality aside, Q; from that start c and the rigid motion are fitted in turn.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from rrru.campaign import measurements as rows
from rrru.campaign.ingest.registration import register
from rrru.campaign.ingest.sheet import TURNS, position_text
from rrru.errors import FitError

# the name of a reflector where the file has no such column
_UNNAMED = "tool"
_TURNS, _STILL_MM = 300, 1e-9
# orientations that differ by less are the same
_NEVER_TURNS = 1e-6
# ASSUME no platform is off by more than this where the file's frame is the robot's
_MOST_TURNED_RAD = 0.2


@dataclass(frozen=True)
class Mounting:
    """names (n,) of the reflectors, place_mm (n, 3): theirs on the platform; offset_mm (n, 3): from the tool, in the
    robot's frame; turn (3, 3): from the platform to what is read as its orientation; notes: what was found.
    """

    names: np.ndarray
    place_mm: np.ndarray
    offset_mm: np.ndarray
    turn: np.ndarray
    notes: tuple

    def columns(self, frame, rotation):
        """Columns of a measurement table; rotation (3, 3): of the instrument's frame into the robot's."""
        result = {"target": self.names.astype(str), **rows.vector_columns("target", self.place_mm)}
        if set(TURNS["measured"]) <= set(frame):
            turns = rotation @ rows.turns(frame, "measured") @ self.turn.T
            result |= rows.turn_columns("measured", turns)
        return result


def mounting(sheet):
    """The Mounting of a sheet without problems, None where the tool itself is read in the robot's frame."""
    frame, registered = sheet.frame, sheet.spec.frame == "register"
    turned = set(TURNS["measured"]) <= set(frame)
    if "target" not in frame and not (turned and registered):
        return None
    names = frame["target"].to_numpy() if "target" in frame else np.full(len(frame), _UNNAMED)
    poses, seen = sheet.poses, rows.measured(frame)
    if not poses.closed.all():
        sheet.refuse_now(None, f"{int((~poses.closed).sum())} poses that the nominal robot cannot take", "known poses")
    stated = _known(sheet, names)
    rotation, place = _fitted(poses, seen, names, stated, registered)
    if registered and np.isnan(stated).all() and np.ptp(poses.turn, axis=0).max() < _NEVER_TURNS:
        # a platform that never turns does not tell them from the frame's shift: they lie about the tool
        place = place + np.asarray(sheet.mechanism.tool_mm) - np.unique(place, axis=0).mean(axis=0)
    turn, notes = np.eye(3), _found(sheet, names, place)
    if turned:
        turn = _between(poses, rows.turns(frame, "measured"), rotation)
        if registered:
            vector = Rotation.from_matrix(turn).as_rotvec()
            notes += (f"orientations are read turned by {np.linalg.norm(vector):.4g} rad from the platform's",)
        else:
            _check_turned(sheet, turn)
            turn = np.eye(3)
    tool = poses.point(np.asarray(sheet.mechanism.tool_mm))
    return Mounting(names, place, poses.point(place) - tool, turn, notes)


def check_turned(sheet):
    """Note orientations in another frame than the robot's, in a sheet that has some and no Mounting."""
    if set(TURNS["measured"]) <= set(sheet.frame):
        _check_turned(sheet, _between(sheet.poses, rows.turns(sheet.frame, "measured"), np.eye(3)))


def _check_turned(sheet, turn):
    """Note that orientations are read as turned against the platform's by a rotation (3, 3)."""
    angle = Rotation.from_matrix(turn).magnitude()
    if angle > _MOST_TURNED_RAD:
        value = f"orientations {angle:.4g} rad from those of the commanded poses in the mean"
        allowed = f"at most {_MOST_TURNED_RAD:g} rad; frame: register finds frame and tool"
        sheet.note("frame", TURNS["measured"], value, allowed)


def _known(sheet, names):
    """Stated places (n, 3) of the reflectors, NaN where nobody states them; notes those that the file lacks."""
    stated = dict(sheet.spec.targets)
    for name in sorted(set(stated) - set(names)):
        there = ", ".join(sorted(set(names)))
        sheet.note("reflectors", None, f"targets: {name}, which the file lacks", f"reflectors of the file: {there}")
    nowhere = (np.nan,) * 3
    return np.array([stated.get(name, nowhere) for name in names], dtype=float)


def _found(sheet, names, place):
    """Notes on the places that were found."""
    found = [name for name in dict.fromkeys(names.tolist()) if name not in sheet.spec.targets]
    return tuple(
        f"reflector {name} found at {position_text(place[names == name][0])} on the platform" for name in found
    )


def _fitted(poses, seen, names, place, registered):
    """Rotation (3, 3) of the instrument's frame, and all places (n, 3)."""
    known = np.isfinite(place).all(axis=1)
    if not registered:
        return np.eye(3), _placed(poses, seen, names, place, known)
    rotation, shift, place = _linear(poses, seen, names, place, known)
    for _ in range(_TURNS):
        moved = _placed(poses, seen @ rotation.T + shift, names, place, known)
        still = np.abs(moved - place).max() < _STILL_MM
        place = moved
        try:
            found = register(seen, poses.point(place))
        except FitError:
            break
        rotation, shift = found.rotation, found.translation
        if still:
            break
    return rotation, place


def _placed(poses, seen, names, place, known):
    """Places (n, 3): those known, and of the others the medians of where they are seen, in the robot's frame."""
    result = place.copy()
    own = np.einsum("nji,nj->ni", poses.turn, seen - poses.position_mm)
    for name in dict.fromkeys(names[~known].tolist()):
        result[names == name] = np.median(own[names == name], axis=0)
    return result


def _linear(poses, seen, names, place, known):
    """Start of `_fitted`: least squares of the linear equations, the matrix of them made a rotation."""
    unknown = list(dict.fromkeys(names[~known].tolist()))
    count = len(seen)
    columns = np.zeros((count, 3, 12 + 3 * len(unknown)))
    for axis in range(3):
        columns[:, axis, 3 * axis : 3 * axis + 3], columns[:, axis, 9 + axis] = seen, 1.0
    for k, name in enumerate(unknown):
        columns[names == name, :, 12 + 3 * k : 15 + 3 * k] = -poses.turn[names == name]
    aim = np.where(known[:, None], poses.point(np.nan_to_num(place)), poses.position_mm)
    scale = np.abs(columns).max(axis=(0, 1)) + 1e-12
    numbers = np.linalg.lstsq((columns / scale).reshape(3 * count, -1), aim.ravel(), rcond=1e-6)[0] / scale
    u, _, vt = np.linalg.svd(numbers[:9].reshape(3, 3))
    rotation = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    place = np.where(known[:, None], place, 0.0)
    for k, name in enumerate(unknown):
        place[names == name] = numbers[12 + 3 * k : 15 + 3 * k]
    return rotation, (poses.point(place) - seen @ rotation.T).mean(axis=0), place


def _between(poses, turns, rotation):
    """The mean rotation (3, 3) from the platform to the orientations (n, 3, 3) that are read in a frame (3, 3)."""
    known = np.isfinite(turns).all(axis=(1, 2))
    off = poses.turn[known].transpose(0, 2, 1) @ rotation @ turns[known]
    return Rotation.from_matrix(off).mean().as_matrix()
