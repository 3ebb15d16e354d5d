"""Mistakes that a whole file may have: signs, order and units of the drive values, and of what was measured."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from itertools import combinations, permutations, product
from math import factorial

import numpy as np

# prior probability that a file has a gross mistake, shared by all that are tried; assumed
_PRIOR = 0.01
# rows that a column may be shifted by
SHIFTS = (1, -1, 2, -2)
# all orders of so many drives are tried together with other mistakes, all orders and signs of more by themselves
_MOST_ORDERED, _MOST_PERMUTED = 4, 6


@dataclass(frozen=True)
class Mistakes:
    """Possible mistakes in a file of K drives, none where it holds commanded positions alone.

    signs (K,): by which the drive values are multiplied; order (K,): number of the drive that each column belongs to;
    shift: rows by which the measured columns are late; free: whether the stated places of the targets are wrong;
    mirrored: whether the instrument's frame is left-handed; unit, drive_unit, angle_unit: of the readings and of the
    drive values in place of those stated, None where these are right.
    """

    signs: tuple[int, ...]
    order: tuple[int, ...]
    shift: int = 0
    free: bool = False
    mirrored: bool = False
    unit: str | None = None
    drive_unit: str | None = None
    angle_unit: str | None = None

    @classmethod
    def none(cls, count: int) -> "Mistakes":
        """No mistake in a file of so many drives."""
        return cls((1,) * count, tuple(range(count)))

    @property
    def count(self) -> int:
        """Number of single mistakes: a sign each, all signs, one order, or one unit for readings and drive values."""
        turned = sum(sign < 0 for sign in self.signs)
        turned = 1 if turned == len(self.signs) and turned else turned
        lengths = len({self.unit, self.drive_unit} - {None})
        single = self.shift != 0, self.free, self.mirrored, self.angle_unit is not None
        return turned + self._reordered + lengths + sum(single)

    @property
    def of_readings(self) -> bool:
        """Whether the readings are wrong and none of the drive values."""
        right = Mistakes.none(len(self.signs))
        return self == replace(self, signs=right.signs, order=right.order, drive_unit=None, angle_unit=None)

    @property
    def of_units(self) -> bool:
        """Whether a unit is wrong."""
        return {self.unit, self.drive_unit, self.angle_unit} != {None}

    @property
    def _reordered(self) -> bool:
        return self.order != tuple(sorted(self.order))

    def log_prior(self, ways: int) -> float:
        """Logarithm of the prior probability, where there are so many single mistakes."""
        unusual = self._reordered and self.order not in usual_orders(len(self.order))
        return float(self.count * np.log(_PRIOR / ways) - unusual * np.log(factorial(len(self.order))))

    def applied(self, drive: np.ndarray) -> np.ndarray:
        """Drive values (n, K) with the right order and signs, from those that a file has."""
        result = np.empty_like(drive)
        result[:, list(self.order)] = drive
        return result * self.signs

    def after(self, first: "Mistakes") -> "Mistakes":
        """Signs and order of both, where another one has been applied before."""
        signs = [0] * len(self.signs)
        for k, drive in enumerate(self.order):
            signs[drive] = self.signs[drive] * first.signs[k]
        return replace(self, signs=tuple(signs), order=tuple(self.order[k] for k in first.order))

    def further(self, units: tuple[Mapping[str, str], ...], shifts: tuple[int, ...] = SHIFTS) -> Iterator["Mistakes"]:
        """All that are one mistake away.

        units: which others readings and drive values may be in; shifts: rows that a column may be shifted by.
        """
        count = len(self.signs)
        for k in range(count):
            yield replace(self, signs=(*self.signs[:k], -self.signs[k], *self.signs[k + 1 :]))
        yield replace(self, signs=(-1,) * count)
        for order in usual_orders(count):
            yield self.reordered(order)
        for shift in shifts:
            yield replace(self, shift=shift)
        yield replace(self, free=True)
        yield replace(self, mirrored=True)
        for one in units:
            yield replace(
                self,
                unit=one.get("unit", self.unit),
                drive_unit=one.get("drive_unit", self.drive_unit),
                angle_unit=one.get("angle_unit", self.angle_unit),
            )

    def reordered(self, order: tuple[int, ...]) -> "Mistakes":
        """These mistakes with the columns in another order (K,) before."""
        return replace(self, order=tuple(self.order[k] for k in order))


@cache
def usual_orders(count: int) -> tuple[tuple[int, ...], ...]:
    """Orders of so many drives: two exchanged, all turned round, and all moved on by some places; all of few drives."""
    plain = tuple(range(count))
    if count <= _MOST_ORDERED:
        return tuple(permutations(plain))[1:]
    result = []
    for i, j in combinations(plain, 2):
        order = list(plain)
        order[i], order[j] = j, i
        result.append(tuple(order))
    result.append(plain[::-1])
    result += [plain[k:] + plain[:k] for k in range(1, count)]
    return tuple(dict.fromkeys(order for order in result if order != plain))


@cache
def all_orders_and_signs(count: int) -> tuple[Mistakes, ...]:
    """All orders and all signs of so many drives, except the right ones; none where they are too many."""
    if count > _MOST_PERMUTED:
        return ()
    given = Mistakes.none(count)
    signed = (replace(given, signs=signs) for signs in product((1, -1), repeat=count))
    return tuple(one for one in (*map(given.reordered, permutations(range(count))), *signed) if one.count)
