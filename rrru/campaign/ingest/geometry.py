"""Consistency of commanded, drive and measured values with the robot and with each other. Lengths in mm."""

from collections.abc import Callable
from itertools import permutations, product

import numpy as np
import pandas as pd

from rrru.campaign import measurements as rows
from rrru.campaign.ingest.gross_file import ORDINARY_SHARE
from rrru.campaign.ingest.sheet import AXES, COMMAND, MEASURED, TURNS, Sheet, position_text
from rrru.campaign.ingest.spec import MM
from rrru.kinematics.robot import Robot

# Files print drive angles with six decimals and positions with three or more, sometimes two.
DRIVE_TOLERANCE = {"rad": 1e-4, "mm": 0.01}
# ASSUME no robot's positions are off by a twentieth of its size in the median: if they are, the frames differ. A
# hundredth of it is implausible enough for a note.
_FRAME_SHARE, _STRANGE_SHARE = 0.05, 0.01
# a change that leaves less than this share of a distance explains it
_SMALL_SHARE = 0.2
# Margin beyond the farthest reachable point, where an outlier may still lie.
_REACH_MARGIN = 1.1
_MOST, _MANY = 0.9, 0.5


def check_commands(sheet: Sheet) -> bool:
    """Note commanded positions out of reach and drive values that contradict them; True where the unit can be right."""
    known = sheet.frame.dropna(subset=[*COMMAND])
    command = rows.command(known)
    if not len(known):
        return True
    if sheet.mechanism.orients and set(sheet.drives) <= set(known):
        _check_poses(known, command, sheet)
        return True
    computed = not set(COMMAND) <= set(sheet.found)
    if computed and set(sheet.drives) <= set(known):
        # the robot is there at its drive values; of a tripod several poses have nearly the same position
        return True
    if _wrong_unit(command, sheet):
        return False
    drive = sheet.needed(known, command)
    reached, as_home = np.isfinite(drive).all(axis=1), not set(TURNS["command"]) <= set(known)
    for i in np.flatnonzero(~reached):
        allowed = f"a position that the robot reaches; it is {sheet.mechanism.unreached(drive[i], as_home)}"
        sheet.note("reach", COMMAND, position_text(command[i]), allowed, known.index[i])
    flipped = _upside_down(command[reached], drive[reached], sheet)
    if not computed and set(sheet.drives) <= set(known) and not flipped:
        _check_drives(known[reached], drive[reached], sheet)
    return True


def _check_poses(known: pd.DataFrame, command: np.ndarray, sheet: Sheet) -> None:
    """Note drive values that bring the nominal robot elsewhere than commanded.

    For a robot that can orient its platform the commanded positions alone do not determine the drive values.
    """
    values = known[[*sheet.drives]].to_numpy()
    # blank drive values are a problem of their own
    whole = np.isfinite(values).all(axis=1)
    back = sheet.mechanism.forward(values[whole], guess_mm=command[whole])
    off, limit = np.linalg.norm(back - command[whole], axis=1), frame_limit(sheet.mechanism)
    posed = np.isfinite(off)
    advice = "see that `robot`, its zero positions, its frame and its tool, unit and angle_unit belong to the file"
    if posed.sum() < _MANY * len(off):
        where = f"in {len(off) - posed.sum()} of {len(off)} rows"
        value = f"{sheet.drive_name} at which the nominal robot has no pose {where}"
        sheet.note("angles", COMMAND, value, f"values at which it closes; {advice}")
    elif len(off) and (median := np.median(off[posed])) > limit:
        value = f"{sheet.drive_name} that bring the nominal robot {median:.6g} mm from there in the median"
        sheet.note("angles", COMMAND, value, f"at most {limit:.4g} mm; {advice}")


def check_sizes(sheet: Sheet, offset_mm: np.ndarray | float = 0.0) -> bool:
    """Note measured positions in another unit than the commanded ones; True where both have the same unit.

    Their spreads are compared, which are the same in every frame. offset_mm (n, 3): of what is measured from the tool.
    A reflector without a stated place on a platform that turns may move far less or more than the tool. Spreads as
    small as a robot's errors, of a tool that stays at one place while its drives move, say nothing.
    """
    low, high = (0.5, 2.0) if _place_stated(sheet) else (0.05, 20.0)
    known = (sheet.frame[[*COMMAND, *MEASURED]].notna()).all(axis=1).to_numpy()
    if not known.any():
        return False
    command = _spread((rows.command(sheet.frame) + offset_mm)[known])
    measured = _spread(rows.measured(sheet.frame)[known])
    stays = max(command, measured) <= ORDINARY_SHARE * sheet.mechanism.size_mm
    if stays or command == 0.0 or low <= measured / command <= high:
        return True
    ratio, seems = measured / command, ""
    if not set(COMMAND) <= set(sheet.found):
        # computed positions are in mm
        seems = next((f"; unit: {u} fits" for u, f in MM.items() if 0.9 < ratio * f / MM[sheet.spec.unit] < 1.1), "")
    for (commanded_in, size), (measured_in, its_size) in product(MM.items(), repeat=2):
        if commanded_in != measured_in and not seems and abs(ratio - size / its_size) < 0.1 * ratio:
            seems = f", not the measured ones in {measured_in} and the commanded ones in {commanded_in}, as it seems"
    value = (
        f"measured positions that spread over {measured:.6g} mm while the commanded ones spread over {command:.6g} mm"
    )
    sheet.note(
        "size",
        MEASURED,
        f"{value} (ratio {ratio:.4g})",
        f"a ratio of {low:g} to {high:g}: both in the same unit{seems}",
    )
    return False


def _place_stated(sheet: Sheet) -> bool:
    """Whether the place of every reflector is stated, or moves as the tool does."""
    if not sheet.mechanism.orients or "target" not in sheet.frame:
        return True
    return set(sheet.frame["target"].astype(str)) <= set(dict(sheet.spec.targets))


def check_measured(sheet: Sheet, frame_advice: Callable[[], str]) -> None:
    """Note measured positions, in the robot's frame, beyond its reach or far from all commanded ones.

    frame_advice: function without arguments that returns the advice, in words, where all are far off.
    """
    known = sheet.frame.dropna(subset=[*COMMAND, *MEASURED])
    command, measured = rows.command(known), rows.measured(known)
    limit, off = frame_limit(sheet.mechanism), np.linalg.norm(measured - command, axis=1)
    if len(known) and np.median(off) > limit:
        along = position_text(np.median(measured - command, axis=0))
        value = (
            f"measured positions {np.median(off):.6g} mm from the commanded ones in the median, {along} along x, y, z"
        )
        advice = " or ".join(filter(None, (_axes_advice(measured, command, limit), frame_advice())))
        sheet.note("frame", MEASURED, value, f"at most {limit:g} mm; {advice}")
        return
    for number, at in known.groupby("run").indices.items():
        if (median := np.median(off[at])) > limit:
            value = f"run {number:g}: measured positions {median:.6g} mm from the commanded ones in the median"
            allowed = f"at most {limit:g} mm, in one frame for all runs"
            sheet.note("frame", MEASURED, value, allowed, known.index[at[0]])
    far = _REACH_MARGIN * sheet.mechanism.farthest_mm
    for i in np.flatnonzero((np.linalg.norm(measured, axis=1) > far) | (measured == 0.0).all(axis=1)):
        allowed = f"within {far:.4g} mm of the robot's origin, and not 0, 0, 0"
        allowed += "; drop the row of a point that was not measured"
        sheet.note("reach of measured", MEASURED, position_text(measured[i]), allowed, known.index[i])


def plausibility_notes(frame: pd.DataFrame, mechanism: Robot, places_instead: Callable[[float], str]) -> list[str]:
    """Notes on implausible measured positions in the robot's frame: all of them far off, or one row late or early.

    places_instead: function from the distance in mm that may remain to places of targets or tool, in words.
    """
    command, measured, run = rows.command(frame), rows.measured(frame), frame["run"].to_numpy()
    off, notes = np.median(np.linalg.norm(measured - command, axis=1)), []
    for first, second, word in ((measured[1:], command[:-1], "before"), (measured[:-1], command[1:], "after")):
        shifted = np.linalg.norm(first - second, axis=1)[run[1:] == run[:-1]]
        if off > 1.0 and np.median(shifted) < _SMALL_SHARE * off:
            fit = f"measured positions fit the command of the row {word} theirs to {np.median(shifted):.3g} mm"
            notes.append(f"{fit} in the median, their own to {off:.3g} mm: the rows may be shifted")
    if off > _STRANGE_SHARE * mechanism.size_mm:
        far = f"measured positions are {off:.4g} mm from the commanded ones in the median"
        places = places_instead(_SMALL_SHARE * off)
        fit = f"; {places} would fit to less than {100.0 * _SMALL_SHARE:.0f} % of that" if places else ""
        notes.append(f"{far}: see that unit, frame and rows belong together{fit}")
    return notes


def beyond_ranges(actuators: np.ndarray, mechanism: Robot) -> list[str]:
    """Notes on the drives whose actuator values (n, K) are outside of their stated ranges at some points."""
    if mechanism.drive_range is None:
        return []
    outside, notes = np.isnan(mechanism.in_range(actuators)) & np.isfinite(actuators), []
    for k in np.flatnonzero(outside.any(axis=0)):
        (low, high), unit, drive = mechanism.drive_range[k], mechanism.parts.units[k], mechanism.parts.columns[k]
        points = f"{outside[:, k].sum()} of {len(actuators)} points"
        notes.append(f"{points} are outside of the range of {drive}, {low:.6g} to {high:.6g} {unit}, and are used")
    return notes


def frame_limit(mechanism: Robot) -> float:
    """Distance in mm between measured and commanded positions above which the frames must differ."""
    return _FRAME_SHARE * mechanism.size_mm


def _spread(position: np.ndarray) -> float:
    """Median distance of positions (n, 3) from their median."""
    return float(np.median(np.linalg.norm(position - np.median(position, axis=0), axis=1)))


def _wrong_unit(command: np.ndarray, sheet: Sheet) -> bool:
    """Note that another unit brings the commanded positions into reach; True where that is so."""

    def reached(position: np.ndarray) -> float:
        return float(np.isfinite(sheet.mechanism.inverse(position, elbow=sheet.spec.elbow)).all(axis=1).mean())

    read = sheet.spec.unit
    if reached(command) >= _MANY:
        return False
    for unit, factor in MM.items():
        if unit != read and reached(command * factor / MM[read]) >= _MOST:
            distance = np.linalg.norm(command, axis=1)
            value = f"commanded positions {distance.min():.4g} to {distance.max():.4g} mm from the robot's origin"
            allowed = f"positions within reach; unit: {unit} brings them there"
            sheet.note("unit", COMMAND, f"{value} when read in {read}", allowed)
            return True
    return False


def _upside_down(command: np.ndarray, drive: np.ndarray, sheet: Sheet) -> bool:
    """Note that the robot is on the other side of its base; True where that is so."""
    back = sheet.mechanism.forward(drive)
    flipped = np.abs(back[:, 2] + command[:, 2]) < np.abs(back[:, 2] - command[:, 2])
    if not len(command) or flipped.mean() < _MANY:
        return False
    way = "DOWN" if sheet.mechanism.up[2] < 0.0 else "UP"
    at, turned = command[flipped][0, 2], back[flipped][0, 2]
    value = f"{at:.6g} mm, where the {sheet.drive_name} of that position bring the robot to {turned:.6g} mm"
    sheet.note("upside down", COMMAND[2], value, f"positions in the robot frame, whose z points {way} from the base")
    return True


def _check_drives(known: pd.DataFrame, drive: np.ndarray, sheet: Sheet) -> None:
    """Note drive angles or slider positions that are not those (n, 3) of the commanded positions."""
    units = sheet.mechanism.parts.units
    given, command = known[[*sheet.drives]].to_numpy(), rows.command(known)
    off, limits = np.abs(given - drive), _tolerances(sheet.mechanism)
    bad = off > limits
    unit, limit = units[0], limits[0]
    allowed = f"within {limit:g} {unit} of the {'angle' if unit == 'rad' else 'one'} that the commanded position needs"
    if bad.any() and bad.any(axis=1).mean() > _MANY and (advice := _elbow_advice(given, command, sheet)):
        value = f"{sheet.drive_name} up to {np.nanmax(np.abs(given)):.6g} {unit}"
        value += f", up to {np.nanmax(off):.6g} {unit} from those that the commanded positions need"
        sheet.note("angles", sheet.drives, value, f"{allowed}; {advice}")
        return
    for i, k in np.argwhere(bad):
        needs = f"while the commanded position {position_text(command[i])} needs {drive[i, k]:.6f} {units[k]}"
        sheet.note("angles", sheet.drives[k], f"{given[i, k]:.6f} {units[k]}, {needs}", allowed, known.index[i])


def _tolerances(mechanism: Robot) -> np.ndarray:
    """Largest differences (K,) of actuator values in their units."""
    return np.array([DRIVE_TOLERANCE[unit] for unit in mechanism.parts.units])


def _elbow_advice(given: np.ndarray, command: np.ndarray, sheet: Sheet) -> str | None:
    """Advice, in words, where the drive values fit the commanded positions with the other elbow, or None."""
    elbow = {"out": "in", "in": "out"}[sheet.spec.elbow]
    off = np.abs(given - sheet.mechanism.inverse(command, elbow=elbow))
    fits = (off < _tolerances(sheet.mechanism)).all(axis=1).mean() > _MOST
    return f"elbow: {elbow} makes them fit" if fits else None


def _axes_advice(measured: np.ndarray, command: np.ndarray, limit: float) -> str | None:
    """Exchange or reversal of the file's axes that makes measured positions fit, or None."""
    best, text = limit, None
    for order, signs in product(permutations(range(3)), product((1.0, -1.0), repeat=3)):
        off = np.median(np.linalg.norm(measured[:, order] * signs - command, axis=1))
        if off < best:
            axes = ", ".join(("-" if sign < 0 else "") + AXES[axis] for axis, sign in zip(order, signs, strict=True))
            best, text = off, f"the file's measured ({axes}) would fit the robot's (x, y, z) to {off:.3g} mm"
    return text
