"""Orientations in a file: rotation vectors, or quaternions that are turned into them. Angles in rad."""

from collections.abc import Mapping, Sequence
from itertools import permutations

import numpy as np
import pandas as pd

from rrru.campaign.ingest.problems import Problems
from rrru.campaign.ingest.sheet import QUATERNIONS, TURNS

# a unit quaternion printed with three decimals; no rotation vector is longer than a turn
_UNIT, _LONGEST_RAD = 2e-3, 2.0 * np.pi + 1e-6


def check_orientations(frame: pd.DataFrame, found: Mapping[str, str], problems: Problems) -> pd.DataFrame:
    """The frame with rotation vectors for its quaternions; what is no orientation is noted and NaN."""
    for name, columns in TURNS.items():
        quaternion = QUATERNIONS[name]
        if set(quaternion) <= set(frame):
            if set(columns) <= set(frame):
                problems.add(
                    "orientation",
                    column=", ".join(found[one] for one in (*columns, *quaternion)),
                    value="an orientation twice",
                    allowed="a rotation vector or a quaternion",
                )
                continue
            frame = _from_quaternions(frame, columns, quaternion, found, problems)
        elif set(columns) <= set(frame):
            size = np.linalg.norm(frame[[*columns]], axis=1)
            allowed = "a rotation vector in rad of at most one turn: convert degrees and Euler angles"
            for i in np.flatnonzero(size > _LONGEST_RAD).tolist():
                _note(problems, frame, i, [found[one] for one in columns], f"{size[i]:.6g} rad", allowed)
    return frame


def _from_quaternions(
    frame: pd.DataFrame, columns: Sequence[str], quaternion: Sequence[str], found: Mapping[str, str], problems: Problems
) -> pd.DataFrame:
    """The frame with rotation vectors in place of quaternions."""
    from scipy.spatial.transform import Rotation

    parts = frame[[*quaternion]].to_numpy(dtype=float)
    size, vectors = np.linalg.norm(parts, axis=1), np.full((len(parts), 3), np.nan)
    for i in np.flatnonzero(np.abs(size - 1.0) > _UNIT).tolist():
        given = [found[one] for one in quaternion]
        _note(problems, frame, i, given, f"a quaternion of length {size[i]:.6g}", "length 1")
    good = np.abs(size - 1.0) <= _UNIT
    if good.any():
        vectors[good] = Rotation.from_quat(parts[good]).as_rotvec()
    return frame.drop(columns=[*quaternion]).assign(**dict(zip(columns, vectors.T, strict=True)))


def other_readings(turns: np.ndarray, found: Mapping[str, str]) -> dict[str, np.ndarray]:
    """What orientations (n, 3, 3) may be instead, (n, 3, 3), by what to write or to mend: inverse, or other columns.

    found: the file's column by ours, where orientations came as quaternions with those of their parts.
    """
    from scipy.spatial.transform import Rotation

    made = Rotation.from_matrix(turns)
    result = {"the orientation of what is measured in the instrument's frame, not its inverse": made.inv()}
    quaternion = set(QUATERNIONS["measured"]) <= set(found)
    names = QUATERNIONS["measured"] if quaternion else TURNS["measured"]
    parts, rotation = (made.as_quat(), Rotation.from_quat) if quaternion else (made.as_rotvec(), Rotation.from_rotvec)
    # columns in another order, as quaternions whose first column is the scalar part
    for order in list(permutations(range(len(names))))[1:]:
        listed = ", ".join(f"{name}: {found.get(names[k], names[k])}" for name, k in zip(names, order, strict=True))
        result[f"columns: {{{listed}}}"] = rotation(parts[:, order])
    return {key: rotation.as_matrix() for key, rotation in result.items()}


def _note(problems: Problems, frame: pd.DataFrame, i: int, columns: Sequence[str], value: str, allowed: str) -> None:
    """Note what is wrong with the orientation of row i."""
    problems.add("orientation", row=frame.index[i], column=", ".join(columns), value=value, allowed=allowed)
