"""Screws of passive joints, and the wrenches on the platform that are reciprocal to them.

Legs that share passive joints, behind which they part, make a group. Their screws are stacked, rows 6 m for m legs, a
shared joint in all of them, and so are the wrenches W with W S = 0; where each leg ends is its own, where the platform
is the same for all. Screws and twists are at the world's origin, the velocity first. Lengths in mm, angles in rad.
"""

from collections.abc import Sequence, Set

import numpy as np

from rrru.arrays import FloatArray
from rrru.kinematics.chain import Twists, Walk, walk
from rrru.kinematics.closure_kernel import CHARACTERISTIC_LENGTH_MM
from rrru.kinematics.legs import Joint, Legs, cross

# smallest singular value of a leg's passive screws, lengths counted in the arm, that counts as a motion
_RANK = 1e-7
SCALE = np.array([CHARACTERISTIC_LENGTH_MM, CHARACTERISTIC_LENGTH_MM, CHARACTERISTIC_LENGTH_MM, 1.0, 1.0, 1.0])


def screw(joint: Joint, axis: FloatArray, place: FloatArray) -> FloatArray:
    """Screw (n, 6) of a joint with axes (n, 3) through places (n, 3)."""
    turning = joint.kind == "R"
    return np.concatenate([cross(place, axis), axis] if turning else [axis, np.zeros_like(axis)], axis=1)


def group_screws(
    legs: Legs, group: Sequence[int], ways: Sequence[Walk], spare: Set[str] = frozenset()
) -> tuple[list[str], FloatArray]:
    """Names (k,) of the passive joints of a group of m legs, without spare ones, and their screws (n, 6 m, k)."""
    passive = [[j for j in legs.legs[number].joints if j.passive and j.name not in spare] for number in group]
    names = list(dict.fromkeys(joint.name for joints in passive for joint in joints))
    result = np.zeros((len(ways[group[0]].place), 6 * len(group), len(names)))
    for row, (number, joints) in enumerate(zip(group, passive, strict=True)):
        for joint in joints:
            k = legs.legs[number].joints.index(joint)
            column = screw(joint, ways[number].axes[k], ways[number].places[k])
            result[:, 6 * row : 6 * row + 6, names.index(joint.name)] = column
    return names, result


def spare_joints(legs: Legs) -> set[str]:
    """Names of the passive joints that depend on those before them a little off home, where joints may be in line.

    They keep their values: a link between two ball joints does not spin.
    """
    offset, result = 0.1 * np.sin(1.0 + np.arange(len(legs.passive_joints))), set()
    drives, passive, twists = legs.home_drives[None], (legs.home_passive + offset)[None], Twists(legs)
    ways = [walk(legs, leg, drives, passive, twists) for leg in legs.legs]
    for group in legs.groups:
        names, (screws,) = group_screws(legs, group, ways)
        ranks = [rank_of(screws[:, :count]) for count in range(len(names) + 1)]
        result |= {name for name, more in zip(names, np.diff(ranks), strict=True) if not more}
    return result


def rank_of(screws: FloatArray) -> int:
    """Number of independent screws (6 m, k)."""
    scale = np.resize(SCALE, len(screws))
    return int(np.linalg.matrix_rank(screws / scale[:, None], tol=_RANK)) if screws.shape[1] else 0


def constraints_of(legs: Legs, spare: Set[str]) -> list[int]:
    """Number of the wrenches of every group, `spare` the names of the joints that keep their values."""
    result = []
    for group in legs.groups:
        joints = {joint.name for number in group for joint in legs.legs[number].joints if joint.passive}
        result.append(1 if legs.legs[group[0]].bar else 6 * len(group) - len(joints - spare))
    return result


def wrenches_of(legs: Legs, spare: Set[str], ways: Sequence[Walk]) -> list[FloatArray]:
    """Wrenches (n, r, 6) of every leg, which together with those of its group are reciprocal to the passive joints.

    spare: names of joints that keep their values.
    """
    result: dict[int, FloatArray] = {}
    for group in legs.groups:
        if bar := ways[group[0]].bar:
            # a unit force along it
            result[group[0]] = np.concatenate([bar.line, cross(bar.near, bar.line)], axis=1)[:, None]
            continue
        stacked = _reciprocal(group_screws(legs, group, ways, spare)[1])
        for row, number in enumerate(group):
            result[number] = stacked[:, :, 6 * row : 6 * row + 6]
    return [result[number] for number in range(len(legs.legs))]


def _reciprocal(screws: FloatArray) -> FloatArray:
    """Wrenches (n, 6 m - k, 6 m) reciprocal to independent screws (n, 6 m, k)."""
    scale = np.resize(SCALE, screws.shape[1])
    if not screws.shape[2]:
        return np.broadcast_to(np.eye(len(scale)), (len(screws), len(scale), len(scale)))
    # of independent columns; the complement by singular values takes three times as long
    basis, _ = np.linalg.qr(screws / scale[:, None], mode="complete")
    return np.asarray(basis[:, :, screws.shape[2] :].transpose(0, 2, 1) / scale)


def by_group(legs: Legs, wrenches: Sequence[FloatArray]) -> list[FloatArray]:
    """Wrenches (n, r, 6) on the platform by groups of legs, from those of the legs."""
    return [sum((wrenches[k] for k in group[1:]), wrenches[group[0]]) for group in legs.groups]
