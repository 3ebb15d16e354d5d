"""Places of the instrument and the reflectors from readings of known poses. Lengths in mm, angles in rad.

With poses, centre p_i and orientation R_i of the body that carries a reflector, a reflector at c on it is read at m_i,

    Q m_i + s = p_i + R_i c

with the rotation Q and shift s of the instrument's frame (identity where it is the robot's). The equations are linear
in s, c and, its orthogonality aside, Q; from that start c and the rigid motion are fitted in turn. A reflector that is
fixed to the world is carried by the robot's frame. Where its place is unknown it does not determine the instrument's
frame.
"""

from dataclasses import dataclass, replace

import numpy as np

from rrru.campaign.ingest.registration import register
from rrru.campaign.ingest.zero_offsets import Framed
from rrru.campaign.target_registration import nearest_rotation
from rrru.errors import FitError
from rrru.kinematics.chain import Poses

_TURNS, _STILL_MM = 300, 1e-9


@dataclass(frozen=True)
class Frames:
    """Readings of reflectors, independent of the poses.

    seen_mm (n, 3): readings in the instrument's frame; names (n,) of the reflectors; place_mm (n, 3): known places of
    these, NaN where unknown; on_world (n,): which are fixed to the world; right (n,): which are readings of the named
    reflector; registered: whether the instrument's frame is its own.
    """

    seen_mm: np.ndarray
    names: np.ndarray
    place_mm: np.ndarray
    on_world: np.ndarray
    right: np.ndarray
    registered: bool

    def select(self, rows: np.ndarray) -> "Frames":
        """The readings of some rows."""
        return replace(
            self,
            seen_mm=self.seen_mm[rows],
            names=self.names[rows],
            place_mm=self.place_mm[rows],
            on_world=self.on_world[rows],
            right=self.right[rows],
        )

    @property
    def known(self) -> np.ndarray:
        """Rows (n,) whose places are known."""
        return np.asarray(np.isfinite(self.place_mm).all(axis=1))

    @property
    def framing(self) -> np.ndarray:
        """Rows (n,) that determine the instrument's frame."""
        return np.asarray(self.right & (self.known | ~self.on_world))

    def carriers(self, poses: Poses) -> Poses:
        """Poses (n) of what carries each reflector."""
        centre = np.where(self.on_world[:, None], 0.0, poses.position_mm)
        return replace(poses, position_mm=centre, turn=np.where(self.on_world[:, None, None], np.eye(3), poses.turn))

    def fitted(self, poses: Poses) -> tuple[np.ndarray, np.ndarray]:
        """Rotation (3, 3) of the instrument's frame, and all places (n, 3), from Poses (n)."""
        carriers = self.carriers(poses)
        if not self.registered:
            return np.eye(3), self._placed(carriers, self.seen_mm)
        rotation, shift = self._linear(carriers)
        place, framing = np.full(self.seen_mm.shape, np.inf), self.framing
        for _ in range(_TURNS):
            moved = self._placed(carriers, self.seen_mm @ rotation.T + shift)
            still = np.abs(moved - place).max() < _STILL_MM
            place = moved
            try:
                found = register(self.seen_mm[framing], carriers.point(place)[framing])
            except FitError:
                break
            rotation, shift = found.rotation, found.translation
            if still:
                break
        return rotation, place

    def framed(self, poses: Poses, fitted: tuple[np.ndarray, np.ndarray] | None = None) -> Framed:
        """The Framed of Poses (n), of the rows that determine something; fitted: what `fitted` gives of them."""
        rotation, place = fitted or self.fitted(poses)
        model, turned, rows = self.carriers(poses).point(place), self.seen_mm @ rotation.T, self.framing
        shift = np.median(model[rows] - turned[rows], axis=0) if self.registered else 0.0
        unknown = tuple(dict.fromkeys(self.names[~self.known & rows].tolist()))
        return Framed((turned + shift)[rows], model[rows], place[rows], unknown)

    def _placed(self, carriers: Poses, seen_mm: np.ndarray) -> np.ndarray:
        """Places (n, 3): the known ones, and medians of the readings on the carrier for the others."""
        result, known = self.place_mm.copy(), self.known
        on_carrier = np.einsum("nji,nj->ni", carriers.turn, seen_mm - carriers.position_mm)
        for name in dict.fromkeys(self.names[~known].tolist()):
            its = self.names == name
            used = its & self.right if (its & self.right).any() else its
            result[its] = np.median(on_carrier[used], axis=0)
        return result

    def _linear(self, carriers: Poses) -> tuple[np.ndarray, np.ndarray]:
        """Start of `fitted`: least squares of the linear equations, whose matrix is projected to a rotation."""
        rows = self.framing
        carriers, seen, names, place = carriers.of(rows), self.seen_mm[rows], self.names[rows], self.place_mm[rows]
        known = np.isfinite(place).all(axis=1)
        unknown = list(dict.fromkeys(names[~known].tolist()))
        count = len(seen)
        columns = np.zeros((count, 3, 12 + 3 * len(unknown)))
        for axis in range(3):
            columns[:, axis, 3 * axis : 3 * axis + 3], columns[:, axis, 9 + axis] = seen, 1.0
        for k, name in enumerate(unknown):
            columns[names == name, :, 12 + 3 * k : 15 + 3 * k] = -carriers.turn[names == name]
        aim = np.where(known[:, None], carriers.point(np.nan_to_num(place)), carriers.position_mm)
        scale = np.abs(columns).max(axis=(0, 1)) + 1e-12
        numbers = np.linalg.lstsq((columns / scale).reshape(3 * count, -1), aim.ravel(), rcond=1e-6)[0] / scale
        rotation = nearest_rotation(numbers[:9].reshape(3, 3))
        place = np.where(known[:, None], place, 0.0)
        for k, name in enumerate(unknown):
            place[names == name] = numbers[12 + 3 * k : 15 + 3 * k]
        return rotation, (carriers.point(place) - seen @ rotation.T).mean(axis=0)
