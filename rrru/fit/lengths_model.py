"""Machines of which only lengths are known: what belts or cables measure of places that nobody may know.

Reading j of row i stands for the length start_j + factor_j counted_ij, which is sum_n routing_jn |p_i - a_n| over the
distances from the row's place p_i to the anchors a_n; an anchor's height above the plane of the places adds to its
distance. Start lengths are what a count leaves out (a missing length) or the length at a drum's zero; a factor is
1 for a count in mm, or a drum's radius for one in rad.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations

import numpy as np

# a place at an anchor has no direction from it: the distance in mm that it is held off
_OFF_MM = 1e-9


@dataclass(frozen=True)
class LengthModel:
    """Readings, and which of the machine's numbers are free.

    counted (N, k), in mm or rad; routing (k, n); heights_mm (n,). The machine's numbers (n d + 2 k,) are anchors,
    row by row, start lengths and factors: origin + basis @ theta, basis (n d + 2 k, p) with `names` (p,) of its
    columns. places (N, d) in mm where they were measured; None makes them unknowns of their rows.
    """

    counted: np.ndarray
    routing: np.ndarray
    heights_mm: np.ndarray
    origin: np.ndarray
    basis: np.ndarray
    names: tuple[str, ...]
    places_mm: np.ndarray | None = None

    @cached_property
    def dimensions(self) -> int:
        """Number of coordinates d of a place."""
        readings, anchors = self.routing.shape
        return (len(self.origin) - 2 * readings) // anchors

    @property
    def unknown(self) -> int:
        """Number of unknowns that every row brings."""
        return self.dimensions if self.places_mm is None else 0

    @property
    def redundant(self) -> int:
        """Number of readings above the unknowns, those of rows and of the machine."""
        rows, readings = self.counted.shape
        return rows * (readings - self.unknown) - self.basis.shape[1]

    @cached_property
    def scale(self) -> np.ndarray:
        """Change (p,) of theta that changes a length by about 1 mm."""
        count = np.maximum(np.abs(self.counted).max(axis=0), 1e-12)
        return 1.0 / np.linalg.norm(
            self.basis * np.append(np.ones(len(self.origin) - len(count)), count)[:, None], axis=0
        )

    def numbers(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Anchors (n, d) in mm, start lengths (k,) in mm and factors (k,) for theta (p,)."""
        readings, anchors = self.routing.shape
        full = self.origin + self.basis @ theta
        return full[: -2 * readings].reshape(anchors, -1), full[-2 * readings : -readings], full[-readings:]

    def residual(self, theta: np.ndarray, places: np.ndarray) -> np.ndarray:
        """Residual (N, k) in mm, read less modelled length, for theta (p,) and places (N, d)."""
        anchors, start, factor = self.numbers(theta)
        return start + factor * self.counted - self._distances(anchors, places)[1] @ self.routing.T

    def _distances(self, anchors: np.ndarray, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Ways (N, n, d) from the anchors and distances (N, n), heights included."""
        ways = places[:, None] - anchors
        return ways, np.sqrt((ways**2).sum(axis=-1) + self.heights_mm**2)

    def slopes(self, theta: np.ndarray, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Derivatives (N, k, p) and (N, k, d) of the residual by theta and by the row's own place."""
        ways, distance = self._distances(self.numbers(theta)[0], places)
        unit = ways / np.maximum(distance, _OFF_MM)[..., None]
        rows, readings = self.counted.shape
        by_anchor = np.einsum("kn,ind->iknd", self.routing, unit).reshape(rows, readings, -1)
        fixed, counting = np.split(self.basis[by_anchor.shape[-1] :], 2)
        by_theta = by_anchor @ self.basis[: by_anchor.shape[-1]] + fixed + self.counted[..., None] * counting
        return by_theta, -np.einsum("kn,ind->ikd", self.routing, unit)

    def mirrored(self, theta: np.ndarray, places: np.ndarray) -> np.ndarray:
        """Places (c, N, d) mirrored at every line (plane) through d anchors: where a row's search may have ended."""
        anchors, mirrored = self.numbers(theta)[0], []
        for chosen in combinations(anchors, self.dimensions):
            _, _, directions = np.linalg.svd(np.array(chosen[1:]) - chosen[0])
            normal = directions[-1]
            mirrored.append(places - 2.0 * ((places - chosen[0]) @ normal)[:, None] * normal)
        return np.array(mirrored)

    def rows(self, chosen: np.ndarray) -> "LengthModel":
        """The model of the rows that a mask (N,) or places in the order of rows choose."""
        measured = None if self.places_mm is None else self.places_mm[chosen]
        return replace(self, counted=self.counted[chosen], places_mm=measured)


def framed(anchors: np.ndarray, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Anchors (n, d) and places (N, d) turned, moved and mirrored into the frame that fixes the gauge.

    The first anchor is the origin, the second lies on the positive x axis, the third above it, in space in the plane
    of x and y; lengths do not tell a space from its mirror image, and the fourth is put at positive z.
    """
    origin = anchors[0]
    corners = (anchors[1 : anchors.shape[1] + 1] - origin).T
    axes, upper = np.linalg.qr(corners)
    axes = axes * np.where(np.diag(upper) < 0.0, -1.0, 1.0)
    return (anchors - origin) @ axes, (places - origin) @ axes


def frame_basis(anchors: int, dimensions: int) -> np.ndarray:
    """Flags (anchors, dimensions) of the coordinates that `framed` leaves free."""
    free = np.ones((anchors, dimensions), dtype=bool)
    for row in range(min(anchors, dimensions)):
        free[row, row:] = False
    return free
