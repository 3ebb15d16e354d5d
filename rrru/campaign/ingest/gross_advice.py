"""Advice against gross mistakes, in words: what to write into the configuration or to correct in the file."""

from collections.abc import Iterator, Mapping

import numpy as np

from rrru.campaign.ingest.gross_file import GrossFile, Hypothesis
from rrru.campaign.ingest.mistakes import Mistakes
from rrru.campaign.ingest.sheet import MEASURED, position_text
from rrru.campaign.ingest.spec import MM

# an axis of the instrument equals one of the robot's where its component along that axis is more than this
_ALONG_AN_AXIS = 0.95
# the unit of commanded positions is right where their spread is that of the nominal robot, up to this factor
_ALIKE = 2.0


def advice(file: GrossFile, found: Hypothesis) -> str:
    """Text: what to write into the configuration or to correct in the file."""
    mistakes = found.mistakes
    texts = [*of_drives(file, mistakes), *_of_units(file, mistakes)]
    if mistakes.shift:
        texts.append(shifted_words("measured", mistakes.shift))
    if mistakes.free:
        texts.append(_of_targets(file, found))
    if mistakes.mirrored:
        texts.append(f"a right-handed frame: {_of_axes(file, found.rotation)}")
    return " and ".join(texts)


def shifted_words(which: str, shift: int) -> str:
    """What to do where columns are so many rows late, or early for a negative number."""
    count = f"{abs(shift)} row{'s' * (abs(shift) > 1)}"
    (side, way, end) = ("late", "up", "last") if shift > 0 else ("early", "down", "first")
    deleted = "row" if abs(shift) == 1 else count
    move = f"move their values {way} by {count} in each run, leave all other columns, and delete its {end} {deleted}"
    return f"{which} columns that are not {count} {side}: {move}"


def of_drives(file: GrossFile, mistakes: Mistakes) -> Iterator[str]:
    """Keys `order` and `signs`, which replace those that are configured."""
    drives = file.robot.parts.columns[: file.count]
    order = tuple([*drives].index(name) for name in file.spec.order) if file.spec.order and drives else file.given.order
    configured = Mistakes(tuple(file.spec.signs.get(name, 1) for name in drives), order)
    combined = mistakes.after(configured)
    if combined.order != configured.order:
        named = f"order: [{', '.join(drives[k] for k in combined.order)}]"
        yield named if combined.order != file.given.order else "no `order`"
    if combined.signs != configured.signs:
        turned = [f"{drives[k]}: -1" for k, sign in enumerate(combined.signs) if sign < 0]
        yield f"signs: {{{', '.join(turned)}}}" if turned else "no `signs`"


def _of_units(file: GrossFile, mistakes: Mistakes) -> Iterator[str]:
    """Keys `unit`, `drive_unit`, `angle_unit`; where commands are in the stated unit, what to correct in the file."""
    spec = file.spec
    unit, drive_unit = spec.unit, mistakes.drive_unit or spec.unit_of_drives
    if mistakes.unit and _commands_are_right(file, mistakes):
        factor = f"multiply them by {MM[mistakes.unit] / MM[spec.unit]:.6g}"
        both = f"`unit: {mistakes.unit}` is for a file whose commanded columns are in {mistakes.unit}, too"
        yield f"measured columns in {spec.unit}, as the commanded ones: they are in {mistakes.unit}, {factor} ({both})"
    elif mistakes.unit:
        unit = mistakes.unit
        yield f"unit: {unit}"
    if file.has_lengths and (spec.drive_unit or unit) != drive_unit:
        yield f"drive_unit: {drive_unit}"
    if mistakes.angle_unit:
        yield f"angle_unit: {mistakes.angle_unit}"


def _commands_are_right(file: GrossFile, mistakes: Mistakes) -> bool:
    """Whether a file has commanded positions that spread as the nominal robot's do."""
    if file.command_mm is None:
        return False
    command, nominal = (np.linalg.norm(np.nanstd(one, axis=0)) for one in (file.command_mm, file.bodies(mistakes)))
    return bool(1.0 / _ALIKE < command / nominal < _ALIKE)


def _of_targets(file: GrossFile, found: Hypothesis) -> str:
    """The key `targets` with the places that were found of those that are stated, or where the tool is."""
    stated = np.isfinite(file.place_mm).all(axis=1)
    return place_words(
        {name: found.place_mm[k] for k, name in enumerate(file.names) if stated[k] or not any(file.names)}
    )


def place_words(places: Mapping[str, np.ndarray]) -> str:
    """The key `targets` with places (3,) in mm by name, or where the tool is, whose name is empty."""
    if "" in places:
        return f"a tool at {position_text(places[''])} (the robot's tool_mm)"
    entries = (f"{name}: [{', '.join(f'{value:.4g}' for value in place)}]" for name, place in places.items())
    return f"targets: {{{', '.join(entries)}}}"


def _of_axes(file: GrossFile, rotation: np.ndarray) -> str:
    """Which measured axes to exchange, or which one to reverse, to make an improper rotation (3, 3) a proper one.

    Any choice is right, unless the axes of the instrument are those of the robot: then two are exchanged or one is
    reversed.
    """
    along = np.where(np.abs(rotation) > _ALONG_AN_AXIS, np.sign(rotation), 0.0)
    turned = np.flatnonzero(np.diag(along) < 0.0)
    if np.abs(along).sum() == 3.0 and (along >= 0.0).all():
        first, second = np.flatnonzero(np.diag(along) == 0.0).tolist()
    elif np.abs(np.diag(along)).sum() == 3.0 and len(turned) == 1:
        return f"turn the sign of {file.found.get(MEASURED[turned[0]], MEASURED[turned[0]])}"
    else:
        first, second = 0, 1
    pairs = (MEASURED[first], MEASURED[second]), (MEASURED[second], MEASURED[first])
    exchanged = ", ".join(f"{ours}: {file.found.get(theirs, theirs)}" for ours, theirs in pairs)
    return f"columns: {{{exchanged}}}"
