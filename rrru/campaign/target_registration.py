"""Registration of an instrument and its targets in closed form: the best rotation out of all, from poses of a robot.

A target at o_k on a body at p_i with orientation T_i is measured at m_i in the instrument's frame:

    Q m_i + s = p_i + T_i o_k,    Q M_i = T_i X

with the rotation Q and shift s into the robot's frame and, where orientations M_i are measured, the turn X from the
body to what is measured. Given Q everything else is linear and is eliminated (variable projection: Golub and Pereyra,
SIAM Journal on Numerical Analysis 10, 1973). What remains is a quadratic form of the nine entries of Q. It is minimised
over the rotations from a grid of starts, so that no turn of the instrument is too large and no start is needed. With
known places and no orientations the solution is Kabsch's. Gross errors count less by iteratively reweighted least
squares. Lengths in mm, angles in rad.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from rrru.arrays import FloatArray, IntArray
from rrru.campaign.registration_kernel import descend
from rrru.errors import FitError

# prior standard deviation of an unknown place about the tool: no target is farther from the tool than a few metres
PLACE_SD_MM = 1000.0
# standard deviation of readings that goes with this prior, far above an instrument's: the errors of a nominal robot
_READING_SD_MM = 1.0
# the quadratic form has few minima: of the 60 rotations of the icosahedron one is within 45 degrees of each
_GRID = Rotation.create_group("I").as_matrix()
_GRID_ITERATIONS, _MAX_ITERATIONS, _TURN_TOLERANCE_RAD = 25, 60, 1e-12
# reweighting: iterations, the change of a reading that ends them, and the residual in median absolute residuals at
# which a reading begins to count less (Huber, Robust Statistics, 1981, gives 1.5 standard deviations)
_MAX_REWEIGHTINGS, _MOVE_TOLERANCE_MM, _BEND, _MIN_BEND_MM = 50, 1e-6, 1.5 / 0.6745, 1e-3
# a turn is determined where readings move by this share of their spread per rad
_MIN_SHARE_OF_SPREAD = 1e-3
# mean square turn of a body axis from which on a target's place along it is identifiable separately from the frame
_LEAST_TURNED = 1e-5
_EYE = np.eye(3)


def axes_by_turning(turn: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Axes (3, 3), in columns, of a body with orientations (n, 3, 3), and the rms (3,) by which each turns in them.

    The rms of an axis that stays where it is, as that which a robot turns about, is zero: along it a shift of all
    targets is one of the instrument.
    """
    off = turn - turn.mean(axis=0)
    squares, axes = np.linalg.eigh(np.einsum("nji,njk->ik", off, off) / len(turn))
    return axes, np.sqrt(np.where(squares < _LEAST_TURNED, 0.0, squares))


@dataclass(frozen=True)
class TargetReadings:
    """Readings of targets at known poses.

    body_mm (n, 3), body_turn (n, 3, 3): poses of what carries each target, zero and the identity for a target that is
    fixed to the world; measured_mm (n, 3): in the instrument's frame; target (n,): number of each; place_mm (k, 3):
    known places of the targets on their bodies, NaN where unknown; centre_mm (3,): about which unknown ones are
    expected; turn (n, 3, 3): measured orientations, NaN where none was, None where none was at all;
    characteristic_length_mm: length that makes these comparable with positions.
    """

    body_mm: FloatArray
    body_turn: FloatArray
    measured_mm: FloatArray
    target: IntArray
    place_mm: FloatArray
    centre_mm: npt.ArrayLike = (0.0, 0.0, 0.0)
    turn: FloatArray | None = None
    characteristic_length_mm: float = np.nan

    @property
    def unknown(self) -> IntArray:
        """Numbers (u,) of the targets whose places are unknown."""
        return np.flatnonzero(np.isnan(self.place_mm).any(axis=1))


@dataclass(frozen=True)
class TargetRegistration:
    """robot = rotation (3, 3) @ instrument + shift_mm (3,), and what goes with it.

    place_mm (k, 3): of all targets on their bodies; tool_turn (3, 3): from the body to the orientations that are
    measured, the identity where none is; residual_mm (n, 3): of the readings, in the robot's frame; undetermined
    (j, 3): axes about which the readings do not determine the turn.
    """

    rotation: FloatArray
    shift_mm: FloatArray
    place_mm: FloatArray
    tool_turn: FloatArray
    residual_mm: FloatArray
    undetermined: FloatArray

    @property
    def median_mm(self) -> float:
        """Median distance of the readings from the poses."""
        return float(np.median(np.linalg.norm(self.residual_mm, axis=1)))

    @property
    def frame(self) -> FloatArray:
        """Twist (6,), shift before rotation vector, of the instrument's frame: what takes the robot's frame into it."""
        back = self.rotation.T
        return np.concatenate([-back @ self.shift_mm, Rotation.from_matrix(back).as_rotvec()])

    def apply(self, position_mm: FloatArray) -> FloatArray:
        """Positions (n, 3) of the instrument's frame in the robot's."""
        return np.asarray(position_mm @ self.rotation.T + self.shift_mm)


def register_targets(readings: TargetReadings, mirrored: bool = False, robust: bool = True) -> TargetRegistration:
    """The TargetRegistration of least robust sum of distances of TargetReadings.

    mirrored: over improper rotations instead, as an instrument with a left-handed frame needs; robust: gross errors
    count less, for a tenth of the time all readings count alike. An unknown place has a
    weak prior about `centre_mm`, which decides where a body never turns and a place and the shift are confounded.
    Raises FitError for fewer than three readings, which determine no frame.
    """
    if len(readings.measured_mm) < 3:
        raise FitError(f"{len(readings.measured_mm)} readings of targets; allowed: at least 3, not on one line")
    linear = _eliminated(readings, np.ones(len(readings.measured_mm)))
    starts = _starts(linear)
    found = _completed(readings, linear, _best_rotation(linear, -starts if mirrored else starts))
    for _ in range(_MAX_REWEIGHTINGS if robust else 0):
        off = np.linalg.norm(found.residual_mm, axis=1)
        bend = max(_BEND * float(np.median(off)), _MIN_BEND_MM)
        linear, last = _eliminated(readings, 1.0 / np.sqrt(1.0 + (off / bend) ** 2)), found.residual_mm
        found = _completed(readings, linear, _best_rotation(linear, found.rotation[None]))
        if np.abs(found.residual_mm - last).max() < _MOVE_TOLERANCE_MM:
            break
    return found


def affine_rms(readings: TargetReadings) -> float:
    """Residual rms distance in mm of the best 3 x 3 matrix in place of the rotation.

    No registration leaves less, whatever the unit of the readings, and mirrored or not.
    """
    linear = _eliminated(readings, np.ones(len(readings.measured_mm)))
    entries = np.linalg.lstsq(linear.rest, linear.left, rcond=1e-9)[0]
    return float(np.linalg.norm(linear.rest @ entries - linear.left) / np.sqrt(len(readings.measured_mm)))


@dataclass(frozen=True)
class _Eliminated:
    """Least squares |upper z + cross q - aim|^2 + |rest q - left|^2 of everything linear z and entries q (9,) of Q.

    centre_mm (3,): of the measured positions, which Q turns about.
    """

    upper: FloatArray
    cross: FloatArray
    aim: FloatArray
    rest: FloatArray
    left: FloatArray
    centre_mm: FloatArray

    def slopes(self, rotations: FloatArray) -> FloatArray:
        """Derivative (m, r, 3) of the residual by a small turn, exp(w) Q, of rotations (m, 3, 3)."""
        # cross products of the axes with the columns, written out: a general product takes ten times as long
        generators = np.zeros((len(rotations), 3, 3, 3))
        for axis, (row, other) in enumerate(((1, 2), (2, 0), (0, 1))):
            generators[:, axis, row], generators[:, axis, other] = -rotations[:, other], rotations[:, row]
        return np.asarray(np.einsum("rk,mjk->mrj", self.rest, generators.reshape(len(rotations), 3, 9)))


def _eliminated(readings: TargetReadings, weights: FloatArray) -> _Eliminated:
    """The _Eliminated of TargetReadings under weights (n,) of their squares."""
    count, unknown = len(readings.measured_mm), readings.unknown
    root, centre = np.sqrt(weights)[:, None, None], np.average(readings.measured_mm, axis=0, weights=weights)
    columns = np.zeros((count, 3, 3 + 3 * len(unknown)))
    columns[:, :, :3] = -_EYE
    for k, number in enumerate(unknown):
        its = readings.target == number
        columns[its, :, 3 + 3 * k : 6 + 3 * k] = readings.body_turn[its]
    known = np.nan_to_num(readings.place_mm)[readings.target]
    body = readings.body_mm + np.einsum("nij,nj->ni", readings.body_turn, known)
    rows = [np.concatenate([columns, -_entries(readings.measured_mm - centre), -body[:, :, None]], axis=2) * root]
    if len(unknown):
        share = _READING_SD_MM / PLACE_SD_MM
        prior = np.zeros((len(unknown), 3, 13 + 3 * len(unknown)))
        prior[:, :, 3:-10] = share * np.eye(3 * len(unknown)).reshape(len(unknown), 3, -1)
        prior[:, :, -1] = share * np.asarray(readings.centre_mm)
        rows.append(prior)
    matrix = np.concatenate(rows).reshape(-1, 13 + 3 * len(unknown))
    if readings.turn is not None and np.isfinite(readings.turn).all(axis=(1, 2)).any():
        matrix = _with_turns(matrix, readings, readings.turn, weights)
    linear, short = matrix.shape[1] - 10, max(0, matrix.shape[1] - len(matrix))
    triangle: FloatArray = np.asarray(np.linalg.qr(np.pad(matrix, ((0, short), (0, 0))), mode="r"))
    parts = triangle[:linear, :linear], triangle[:linear, linear:-1], triangle[:linear, -1]
    return _Eliminated(*parts, triangle[linear:, linear:-1], triangle[linear:, -1], centre)


def _entries(vectors: FloatArray) -> FloatArray:
    """Derivative (n, 3, 9) of Q v by the entries of Q, row by row, of vectors (n, 3)."""
    return np.asarray(np.einsum("ij,nk->nijk", _EYE, vectors).reshape(-1, 3, 9))


def _with_turns(matrix: FloatArray, readings: TargetReadings, turn: FloatArray, weights: FloatArray) -> FloatArray:
    """The equations of positions with nine more columns, of X, before those of Q, and those of orientations (n, 3, 3).

    Orientations are NaN where none was measured.
    """
    linear, rows = matrix.shape[1] - 10, np.flatnonzero(np.isfinite(turn).all(axis=(1, 2)))
    spread = np.insert(matrix, [linear], np.zeros((len(matrix), 9)), axis=1)
    turns = np.zeros((len(rows), 3, 3, spread.shape[1]))
    for column in range(3):
        # column by column of T X - Q M = 0
        turns[:, :, column, linear + column : linear + 9 : 3] = readings.body_turn[rows]
        turns[:, :, column, linear + 9 : linear + 18] = -_entries(turn[rows][:, :, column])
    scale = readings.characteristic_length_mm * np.sqrt(weights[rows])
    return np.concatenate([spread, (turns * scale[:, None, None, None]).reshape(-1, spread.shape[1])])


def _starts(linear: _Eliminated) -> FloatArray:
    """Rotations (m, 3, 3) to start from: a grid of all, and the rotation next to the linear solution."""
    entries = np.asarray(np.linalg.lstsq(linear.rest, linear.left, rcond=1e-9)[0], dtype=float)
    return np.concatenate([_GRID, nearest_rotation(entries.reshape(3, 3))[None]])


def nearest_rotation(matrix: FloatArray) -> FloatArray:
    """The rotation (3, 3) nearest to a matrix (3, 3)."""
    left, _, right = np.linalg.svd(matrix)
    return np.asarray(left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right)


def _best_rotation(linear: _Eliminated, rotations: FloatArray) -> FloatArray:
    """The rotation (3, 3) of least cost of searches from rotations (m, 3, 3), by damped Gauss-Newton steps."""
    if len(rotations) > 1:
        rotations, cost = _descended(linear, rotations, _GRID_ITERATIONS)
        rotations = rotations[[cost.argmin()]]
    return np.asarray(_descended(linear, rotations, _MAX_ITERATIONS)[0][0])


def _descended(linear: _Eliminated, rotations: FloatArray, iterations: int) -> tuple[FloatArray, FloatArray]:
    """Rotations (m, 3, 3) and costs (m,) after so many steps of Levenberg's and Marquardt's method."""
    rest, left, starts = (np.ascontiguousarray(part) for part in (linear.rest, linear.left, rotations))
    found, cost = descend(rest, left, starts, iterations, _TURN_TOLERANCE_RAD)
    return np.asarray(found), np.asarray(cost)


def _completed(readings: TargetReadings, linear: _Eliminated, rotation: FloatArray) -> TargetRegistration:
    """The TargetRegistration of a rotation: what is linear follows from it."""
    aim = linear.aim - linear.cross @ rotation.ravel()
    unit = 1.0 / np.maximum(np.linalg.norm(linear.upper, axis=0), 1e-300)
    numbers = unit * np.linalg.lstsq(linear.upper * unit, aim, rcond=1e-12)[0]
    unknown = readings.unknown
    place, tool = readings.place_mm.copy(), np.eye(3)
    place[unknown] = numbers[3 : 3 + 3 * len(unknown)].reshape(-1, 3)
    if len(numbers) > 3 + 3 * len(unknown):
        tool = nearest_rotation(numbers[-9:].reshape(3, 3))
    shift = numbers[:3] - rotation @ linear.centre_mm
    model = readings.body_mm + np.einsum("nij,nj->ni", readings.body_turn, place[readings.target])
    residual = readings.measured_mm @ rotation.T + shift - model
    left, size, _ = np.linalg.svd(linear.slopes(rotation[None])[0].T)
    spread = np.sqrt(((readings.measured_mm - linear.centre_mm) ** 2).sum())
    lost = left.T[np.pad(size, (0, 3 - len(size))) <= _MIN_SHARE_OF_SPREAD * spread]
    return TargetRegistration(rotation, shift, place, tool, residual, lost)
