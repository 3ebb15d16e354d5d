"""Measured positions of a file in the robot's frame, and which of them a broken beam spoilt. Lengths in mm."""

from dataclasses import replace

import numpy as np
import pandas as pd

from rrru.campaign.driven_path import follows_path
from rrru.campaign.ingest.checks import path_length
from rrru.campaign.ingest.geometry import frame_limit
from rrru.campaign.ingest.mounting import Mounting
from rrru.campaign.ingest.outliers import far_from_all, flag_outliers, frequent_jumps, reproduced
from rrru.campaign.ingest.registration import Registration, register
from rrru.campaign.ingest.sheet import MEASURED, Sheet
from rrru.campaign.measurements import command, measured, series, vector_columns
from rrru.errors import FitError


def at_tool(sheet: Sheet, mounted: Mounting | None) -> Sheet:
    """The sheet with the positions of reflectors carried to the tool, NaN where that is none, in the robot's frame."""
    if mounted is None:
        return sheet
    carried = np.where(mounted.strays[:, None], np.nan, measured(sheet.frame) - mounted.offset_mm)
    moved = vector_columns("measured", carried)
    return replace(sheet, frame=sheet.frame.assign(**moved))


def register_sheet(sheet: Sheet, mounted: Mounting | None, digit_mm: float) -> Registration:
    """Registration from the chosen points, without those that a first registration shows to be outliers."""
    frame = sheet.frame
    offset = mounted.offset_mm if mounted else 0.0
    seen, target = measured(frame), command(frame) + offset
    pairs = list(zip(frame["run"], frame["point"], strict=True))
    wanted = {tuple(pair) for pair in sheet.spec.registration_points}
    for run, point in sorted(wanted - set(pairs), key=str):
        value = f"registration point (run {run}, point {point}), which the file lacks"
        sheet.note("registration", None, value, f"points of the file: runs 1 to {frame['run'].max():g}")
    sheet.problems.refuse()
    chosen = np.array([not wanted or pair in wanted for pair in pairs])
    if mounted:
        chosen &= mounted.framing
    try:
        first = register(seen[chosen], target[chosen])
        moved = frame.assign(**vector_columns("measured", first.apply(seen) - offset))
        chosen &= ~outliers(moved, digit_mm)
        result = register(seen[chosen], target[chosen])
    except FitError as error:
        value, _, allowed = str(error).partition("; allowed: ")
        sheet.refuse_now(None, f"registration points: {value}", allowed)
    if mirrored := _off_as_mirrored(seen[chosen], target[chosen]):
        value = (
            f"positions in a left-handed frame ({mirrored:.6g} mm rms off when registered, a fifth of that if mirrored)"
        )
        sheet.refuse_now(MEASURED, value, "a right-handed frame: reverse the sign of one axis")
    if result.rms_mm > (limit := frame_limit(sheet.mechanism)):
        value = f"distances in space of {result.rms_mm:.6g} mm rms after registration at {result.points} points"
        sheet.refuse_now(MEASURED, value, f"at most {limit:g} mm rms: the same points in both frames")
    return result


def _off_as_mirrored(seen: np.ndarray, target: np.ndarray) -> float:
    """Residual in mm rms of measured positions (n, 3) that fit far better with one axis reversed, else 0."""
    try:
        straight, mirrored = (register(seen * [1.0, 1.0, sign], target).rms_mm for sign in (1.0, -1.0))
    except FitError:
        return 0.0
    return straight if straight > 1.0 and mirrored < 0.2 * straight else 0.0


def outliers(frame: pd.DataFrame, digit_mm: float) -> np.ndarray:
    """Rows (n,) that a broken beam spoilt, positions being in the robot frame; digit_mm: last digit of the file."""
    target, run = command(frame), series(frame)
    deviation = measured(frame) - target
    marked = flag_outliers(deviation, run, noise_mm=digit_mm, place=path_length(target))
    if not follows_path(target, run):
        marked &= far_from_all(deviation, run)
    return marked & ~reproduced(marked, deviation, target, run)


def jumps(frame: pd.DataFrame, digit_mm: float) -> np.ndarray:
    """Rows (n,) that jump off their neighbours in runs where too many do for `outliers`; arguments as there."""
    target, run = command(frame), series(frame)
    deviation = measured(frame) - target
    found = frequent_jumps(deviation, run, noise_mm=digit_mm)
    return found & ~reproduced(found, deviation, target, run)
