"""Gross mistakes in a file, found before anything is fitted: signs, orders, units, shifted rows, wrong targets, robots.

A calibration must not explain errors that a mistake in the file makes. The file as it is, and every mistake that could
be in it, are hypotheses. For each the nominal robot is posed at the drive values, or at the commanded positions where a
file has no drive values. The instrument is registered in closed form (`rrru.campaign.target_registration`), and the
residual rms is compared. A mistake is named where its posterior probability is above 0.99. The nominal robot's own
errors have an unknown size, equal under all hypotheses. With k independent errors the likelihood of a residual rms r is
therefore proportional to r^-k (Jeffreys' prior on the size). Each further parameter of a hypothesis costs half the
logarithm of the number of readings (Schwarz, Annals of Statistics 6, 1978). The rms is in shares of the spread of the
positions, so that no unit is favoured for being small. Hypotheses are evaluated in the order of an upper bound of their
evidence: that of a registration with any matrix in place of the rotation. A file that no mistake explains, nor lost
zero offsets of the drives, is not of this robot. Lengths in mm, angles in rad.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import combinations, product

import numpy as np
import pandas as pd
from scipy.special import logsumexp

from rrru.campaign.ingest.gross_advice import advice, of_drives
from rrru.campaign.ingest.gross_file import EXPLAINED_SHARE, ORDINARY_SHARE, GrossFile, Hypothesis
from rrru.campaign.ingest.mistakes import Mistakes, all_orders_and_signs
from rrru.campaign.ingest.spec import IngestSpec
from rrru.kinematics.robot import Robot

# a residual above this share of the robot's size, with the zero offsets of the drives fitted, is of another robot:
# links are not built wrong by a fiftieth; assumed
_FOREIGN_SHARE = 2e-2
# the same as a share of the spread of the measured positions: for a robot that moves little all errors are small
_FOREIGN_SPREAD_SHARE = 0.05
# share of the rows within the ranges of the drives below which these are of another robot, where it is off as well
_LEAST_IN_RANGE = 0.1
_LEAST_ROWS = 10
_CERTAIN = 0.99
# mistakes that may be in one file together, an order of the drives being some; hypotheses of each round that are
# evaluated, more where others may be as good, and number of the best from which the next round starts
_MOST_ROUNDS, _FIRST_LOOKED_AT, _MOST_LOOKED_AT, _MOST_FOLLOWED = 6, 8, 32, 3
# round after which all orders and signs of the drives are tried
_SIMPLE_ROUNDS = 2
# hypotheses that are evaluated at the end, since none may remain that is as good as the best one
_MOST_SETTLED = 150
# difference of log evidence from which on a hypothesis does not matter
_FAR_BEHIND = 10.0
# hypotheses that a message names where several explain a file alike, as the legs of a symmetric robot
_MOST_NAMED = 6


@dataclass(frozen=True)
class GrossError:
    """Why a file cannot be right: its rms in mm as it is and at best, and the advice, in words.

    mistakes: the most probable ones, none where targets of end effectors are exchanged; limit_mm: rms that a file of
    this robot leaves at most, where not even these explain it, None where they do.
    """

    mistakes: Mistakes
    rms_mm: float
    rms_without_mm: float
    advice: str
    limit_mm: float | None = None


def find_gross_error(
    frame: pd.DataFrame,
    spec: IngestSpec,
    robot: Robot,
    found: Mapping[str, str] | None = None,
    unit_stated: bool = False,
    agreed: bool = False,
) -> GrossError | None:
    """The GrossError that a file's columns show, under our names and in mm and rad; None where none is certain.

    found: {our name: the file's name} of the columns; unit_stated: whether the file's header states the unit of what
    was measured; agreed: whether commanded positions and drive values say the same.
    """
    file = GrossFile.of(frame, spec, robot, found or {}, unit_stated)
    if file is None or len(file) < _LEAST_ROWS:
        return None
    file = replace(file, agreed=agreed)
    search, ordinary_mm = _Search(file), ORDINARY_SHARE * robot.size_mm
    as_is = search.best
    if as_is.rms_mm <= ordinary_mm:
        return None
    for number in range(_MOST_ROUNDS):
        if number == _SIMPLE_ROUNDS:
            search.look_at(all_orders_and_signs(file.count))
        before = search.best
        search.go_on()
        if search.best is before and number >= _SIMPLE_ROUNDS:
            break
        if search.best.rms_mm <= ordinary_mm:
            # the remainder is no mistake
            break
    search.settle()
    named = search.named
    if spec.frame == "robot":
        # of mistakes that explain the file alike, those that explain it where the instrument's frame is the robot's
        limit_mm = EXPLAINED_SHARE * robot.size_mm
        named = [one for one in named if file.off_in_robot_frame(one.mistakes) <= limit_mm] or named
    if named:
        words = " or ".join(advice(file, one) for one in named)
        # of hypotheses that differ by rounding, as on a symmetric robot, rounding must not choose
        concerned = next((one.mistakes for one in named if not one.mistakes.of_readings), named[0].mistakes)
        return GrossError(concerned, as_is.rms_mm, named[0].rms_mm, words)
    return _exchanged_targets(file, as_is) or _foreign(file, as_is, search.best)


def frame_advice(file: GrossFile | None) -> str:
    """Advice, in words, for positions that are far off in the robot's own frame.

    It names orders and signs of the drives that correct them in this frame, and the instrument's own frame where a
    registration leaves a small residual. A gantry whose drives are exchanged moves as one whose frame is turned.
    """
    register = "frame: register turns another frame into the robot frame"
    if file is None or len(file) < _LEAST_ROWS:
        return register
    limit_mm = EXPLAINED_SHARE * file.robot.size_mm
    alike = (one for one in file.given.further(()) if one.count and not (one.free or one.mirrored or one.shift))
    found = [one for one in dict.fromkeys(alike) if file.off_in_robot_frame(one) <= limit_mm]
    texts, left_mm = [" and ".join(of_drives(file, one)) for one in found], file.hypothesis(file.given).rms_mm
    if left_mm <= limit_mm:
        texts.append(register)
    if np.isfinite(left_mm) and not texts:
        texts.append(f"frame: register would leave {left_mm:.3g} mm rms: see that `robot` is right")
    return " or ".join(texts) or "see that `robot` and the columns of its drives are right"


class _Search:
    """The evaluated hypotheses of a GrossFile, and upper bounds of the log evidence of the others."""

    def __init__(self, file: GrossFile) -> None:
        self._file = file
        self.found: dict[Mistakes, Hypothesis] = {file.given: file.hypothesis(file.given)}
        self._at_most: dict[Mistakes, float] = {}

    @property
    def best(self) -> Hypothesis:
        """The most probable one so far."""
        return max(self.found.values(), key=lambda one: one.log_evidence)

    def look_at(self, every: Iterable[Mistakes]) -> None:
        """Evaluate the most promising of some Mistakes."""
        fresh = [
            one for one in dict.fromkeys(every) if one not in self.found and one not in self._at_most and one.count
        ]
        self._at_most |= {one: self._file.evidence_at_most(one) for one in fresh}
        promising = sorted(fresh, key=self._at_most.__getitem__, reverse=True)[:_MOST_LOOKED_AT]
        self._evaluate(promising, _FIRST_LOOKED_AT)

    def settle(self) -> None:
        """Evaluate all hypotheses that may be as good as the best one, up to a limit."""
        self._evaluate(sorted(self._at_most, key=self._at_most.__getitem__, reverse=True)[:_MOST_SETTLED])

    def _evaluate(self, promising: list[Mistakes], least: int = 0) -> None:
        """Evaluate Mistakes in their order, at least so many, until one is far behind the best one."""
        for number, one in enumerate(promising):
            if number >= least and self._at_most[one] < self.best.log_evidence - _FAR_BEHIND:
                break
            self.found[one] = self._file.hypothesis(one)
            del self._at_most[one]

    def go_on(self) -> None:
        """Evaluate the hypotheses that are one mistake away from the best ones."""
        start = sorted(self.found.values(), key=lambda one: -one.log_evidence)[:_MOST_FOLLOWED]
        self.look_at(
            one for hypothesis in start for one in hypothesis.mistakes.further(self._file.units, self._file.shifts)
        )

    @property
    def named(self) -> list[Hypothesis]:
        """The hypotheses that explain the file and that together have probability 0.99, most probable ones first.

        Empty where the file as it is belongs to them, where one that was not evaluated may belong to them, or where one
        explains too little.
        """
        every = sorted(self.found.values(), key=lambda one: -one.log_evidence)
        scores = [*(one.log_evidence for one in every), *self._at_most.values()]
        probability = np.exp(np.array(scores[: len(every)]) - logsumexp(scores))
        number = int(np.searchsorted(np.cumsum(probability), _CERTAIN)) + 1
        chosen, limit = every[:number], EXPLAINED_SHARE * self._file.robot.size_mm
        right = number <= _MOST_NAMED and all(one.mistakes.count and one.rms_mm <= limit for one in chosen)
        return chosen if right and probability[:number].sum() > _CERTAIN else []


def _exchanged_targets(file: GrossFile, as_is: Hypothesis) -> GrossError | None:
    """The GrossError of a file in which targets of two end effectors have each other's names; None for others.

    All targets of both, or one of each, are exchanged.
    """
    limit_mm = EXPLAINED_SHARE * file.robot.size_mm
    for one, other in combinations(file.robot.legs.end_effectors, 2):
        for first, second in dict.fromkeys([(one, other), *(((a,), (b,)) for a, b in product(one, other))]):
            rms_mm = file.with_exchanged_targets(first, second).hypothesis(file.given).rms_mm
            if rms_mm <= limit_mm:
                words = f"{', '.join(first)} and {', '.join(second)} exchanged, in this column or in `carries`"
                return GrossError(file.given, as_is.rms_mm, rms_mm, words)
    return None


def _foreign(file: GrossFile, as_is: Hypothesis, best: Hypothesis) -> GrossError | None:
    """The GrossError of a file that is far from the robot with any zero offsets of its drives; None for others.

    Zero offsets, as any mistake, explain a file only where they leave a small residual: they fit the links of another
    robot, too.
    """
    size = file.robot.size_mm
    limit_mm = min(_FOREIGN_SHARE * size, max(_FOREIGN_SPREAD_SHARE * file.spread_mm(), ORDINARY_SHARE * size))
    if file.share_in_range() >= _LEAST_IN_RANGE:
        if as_is.rms_mm <= limit_mm:
            return None
        limit_mm = min(limit_mm, EXPLAINED_SHARE * size)
        if file.with_zeros().rms_mm <= limit_mm:
            return None
    nearest = f" ({advice(file, best)})" if best.mistakes.count and np.isfinite(best.rms_mm) else ""
    return GrossError(best.mistakes, as_is.rms_mm, best.rms_mm, nearest, limit_mm)
