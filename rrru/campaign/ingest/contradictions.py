"""Commanded positions and drive values of one file: whether they agree to 0.01 mm, and what makes them agree.

Both are computed or printed, not measured. The right settings make them agree to the last digit, in the robot's own
frame, so that no probability is needed. Lengths in mm, angles in rad.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import permutations, product

import numpy as np
import pandas as pd
from scipy.spatial.transform import Rotation

from rrru.campaign import measurements as rows
from rrru.campaign.ingest.checks import resolution
from rrru.campaign.ingest.gross_advice import of_drives, shifted_words
from rrru.campaign.ingest.gross_file import GrossFile
from rrru.campaign.ingest.mistakes import Mistakes, all_orders_and_signs
from rrru.campaign.ingest.registration import register
from rrru.campaign.ingest.sheet import AXES, COMMAND, TARGET, TURNS, position_text
from rrru.campaign.ingest.spec import MM, RAD, IngestSpec
from rrru.campaign.target_registration import TargetReadings
from rrru.errors import FitError
from rrru.kinematics.robot import Robot

# positions agree within this and what the last digits of the drive values move them by
TOLERANCE_MM = 0.01
# smallest number of rows that decides, and share of them that has to agree
_LEAST_ROWS, _AGREEING = 10, 0.9
# hypotheses from which two mistakes start
_MOST_FOLLOWED = 3
# steps to the zeros of the drives
_MOST_STEPS = 20
# a controller's own calibration differs from the nominal robot by less than this share of its size; assumed
_SMALL_SHARE = 2e-3
_STEP = {"mm": 1e-3, "rad": 1e-6}


@dataclass(frozen=True)
class Contradiction:
    """How far commanded positions are from those of the drive values in the median, in mm, and at most where both
    agree; what makes them agree, in words, empty where nothing does; whether a file with it cannot be right.
    """

    off_mm: float
    tolerance_mm: float
    advice: str
    refused: bool


def find_contradiction(
    frame: pd.DataFrame, spec: IngestSpec, robot: Robot, found: Mapping[str, str]
) -> Contradiction | None:
    """The Contradiction of a file's columns, under our names and in mm and rad; None where there is none.

    found: {our name: the file's name} of the columns.
    """
    if not {*robot.parts.columns, *COMMAND} <= set(frame):
        return None
    # the commanded point is the tool of the end effector, whichever target it carries
    x, y, z = robot.tool_mm
    tools = {name: (x, y, z) for hand in robot.legs.end_effectors for name in hand}
    unused = [*TARGET, *TURNS["measured"], *(() if tools else ("target",))]
    sent = frame.drop(columns=unused, errors="ignore").assign(**rows.vector_columns("measured", rows.command(frame)))
    file = GrossFile.of(sent, replace(spec, targets=tools, world_targets=()), robot, found, False)
    if file is None or len(file) < _LEAST_ROWS:
        return None
    compared = _Comparison(file)
    if compared.off_mm <= compared.tolerance_mm:
        return None
    small = compared.off_mm <= _SMALL_SHARE * robot.size_mm
    if (mistakes := compared.mistakes(simple=small)) is not None:
        return Contradiction(compared.off_mm, compared.tolerance_mm, _in_words(file, mistakes), True)
    words = next((f"{change}; or no commanded columns: the drive values are enough" for change in compared.moved()), "")
    return Contradiction(compared.off_mm, compared.tolerance_mm, words, bool(words) and not (small and robot.orients))


@dataclass(frozen=True)
class _Comparison:
    """Commanded positions against drive values: a GrossFile whose measured positions are the commanded ones."""

    file: GrossFile

    @cached_property
    def nominal(self) -> TargetReadings | None:
        """TargetReadings of the commanded positions at the nominal poses of the drive values, None for too few."""
        return self.file.readings(self.file.given)

    @cached_property
    def off_mm(self) -> float:
        """Median distance of the commanded positions from those of the drive values, without any change."""
        return float(np.median(_off(self.nominal)))

    @cached_property
    def tolerance_mm(self) -> float:
        """Distance within which both agree, including the tool's motion by the last digits of the drive values."""
        if self.off_mm <= TOLERANCE_MM or self.nominal is None:
            return TOLERANCE_MM
        file, result = self.file, TOLERANCE_MM
        for k, unit in enumerate(file.robot.parts.units):
            stated = RAD[file.spec.angle_unit] if unit == "rad" else MM[file.spec.unit_of_drives]
            digit = stated * resolution(file.drive[:, [k]] / stated)
            moved = self.file.tools(0.5 * digit * np.eye(file.count)[k]) - self.file.tools(np.zeros(file.count))
            result += float(np.nanmedian(np.linalg.norm(moved, axis=1)))
        return result

    def agree(self, off: np.ndarray) -> bool:
        """Whether positions that are so far (n,) from the commanded ones agree with them."""
        return len(off) >= _LEAST_ROWS and bool((off <= self.tolerance_mm).mean() >= _AGREEING)

    def mistakes(self, simple: bool) -> Mistakes | None:
        """The simplest Mistakes in signs, order, unit and rows that make both agree, None for none.

        simple: looks for single ones alone.
        """
        file, tried = self.file, {}

        def first(every: Iterable[Mistakes]) -> Mistakes | None:
            for one in every:
                if one.count and one not in tried and not (one.free or one.mirrored):
                    tried[one] = _off(file.readings(one))
                    if self.agree(tried[one]):
                        return one
            return None

        def further(one: Mistakes) -> Iterator[Mistakes]:
            return one.further(file.units)

        if (found := first(further(file.given))) is not None or simple:
            return found
        if (found := first(all_orders_and_signs(file.count))) is not None:
            return found
        best = sorted(tried, key=lambda one: np.median(tried[one]))[:_MOST_FOLLOWED]
        return first(two for one in best for two in further(one))

    def moved(self) -> Iterator[str]:
        """Words for axes, a zero of a drive, a tool, a frame or zeros of all drives with which both agree."""
        if self.nominal is None:
            return
        point, command = _points(self.nominal), self.nominal.measured_mm
        for order, signs in product(permutations(range(3)), product((1.0, -1.0), repeat=3)):
            if self.agree(np.linalg.norm(command[:, order] * signs - point, axis=1)):
                axes = ", ".join(("-" if sign < 0 else "") + AXES[k] for k, sign in zip(order, signs, strict=True))
                yield f"commanded (x, y, z) in the robot's frame: the file's ({axes}) are these"
        file = self.file
        for one in np.eye(file.count, dtype=bool):
            yield from self._zeros(one)
        turn, body = self.nominal.body_turn, self.nominal.body_mm
        place = np.einsum("nji,nj->ni", turn, command - body)
        if self.agree(np.linalg.norm(place - np.median(place, axis=0), axis=1)):
            which = f"the point {position_text(file.robot.tool_mm)} of the platform, the tool"
            yield f"commanded positions of {which}: they are of the point {position_text(np.median(place, axis=0))}"
        try:
            frame = register(command, point)
        except FitError:
            return
        if self.agree(np.linalg.norm(frame.apply(command) - point, axis=1)):
            turned = Rotation.from_matrix(frame.rotation).as_rotvec()
            vector = ", ".join(f"{value:.4g}" for value in turned)
            by = f"turning them by ({vector}) rad and shifting them by {position_text(frame.translation)}"
            yield f"commanded positions in the robot's frame: {by} brings them there"
        yield from self._zeros(np.ones(file.count, dtype=bool))

    def _zeros(self, which: np.ndarray) -> Iterator[str]:
        """Words for zeros of the drives of which (K,) that make both agree, by Gauss and Newton."""
        file, command = self.file, self.file.measured_mm[self.file.chosen]
        step = np.array([_STEP[unit] for unit in file.robot.parts.units])
        zeros = np.zeros(file.count)
        for _ in range(_MOST_STEPS):
            here = self.file.tools(zeros)
            slope = np.stack(
                [
                    (self.file.tools(zeros + s * e) - here) / s
                    for s, e in zip(step[which], np.eye(file.count)[which], strict=True)
                ],
                axis=-1,
            )
            known = np.isfinite(here).all(axis=1) & np.isfinite(slope).all(axis=(1, 2))
            if known.mean() < _AGREEING:
                return
            off = (command - here)[known]
            change = np.linalg.lstsq(slope[known].reshape(-1, which.sum()), off.ravel(), rcond=1e-9)[0]
            zeros[which] += change
            if np.abs(change / step[which]).max() < 1.0:
                break
        if self.agree(np.nan_to_num(np.linalg.norm(command - self.file.tools(zeros), axis=1), nan=np.inf)):
            units, names = file.robot.parts.units, file.robot.parts.columns
            parts = [f"{zeros[k]:.6g} {units[k]} to {names[k]}" for k in np.flatnonzero(np.abs(zeros) > step)]
            yield f"drive values whose zeros are the robot's: adding {', '.join(parts)} makes both agree"


def _points(nominal: TargetReadings) -> np.ndarray:
    """Points (n, 3) of the tool."""
    return np.asarray(nominal.body_mm + np.einsum("nij,j->ni", nominal.body_turn, nominal.place_mm[0]))


def _off(nominal: TargetReadings | None) -> np.ndarray:
    """Distances (n,) of the commanded positions from the nominal tool's, endless where it has no poses."""
    return np.array([np.inf]) if nominal is None else np.linalg.norm(_points(nominal) - nominal.measured_mm, axis=1)


def _in_words(file: GrossFile, mistakes: Mistakes) -> str:
    """Text: what to write into the configuration or to correct in the file."""
    texts, spec = [*of_drives(file, mistakes)], file.spec
    if mistakes.shift:
        texts.append(shifted_words("commanded", mistakes.shift))
    if mistakes.unit and mistakes.unit != mistakes.drive_unit:
        factor = MM[mistakes.unit] / MM[spec.unit]
        texts.append(f"commanded columns in {spec.unit}: they are in {mistakes.unit}, multiply them by {factor:.6g}")
    elif mistakes.unit:
        texts.append(f"unit: {mistakes.unit}")
    if mistakes.drive_unit and mistakes.unit != mistakes.drive_unit:
        texts.append(f"drive_unit: {mistakes.drive_unit}")
    if mistakes.angle_unit:
        texts.append(f"angle_unit: {mistakes.angle_unit}")
    return " and ".join(texts)
