"""Whether commanded positions, drive angles and measured positions of a campaign belong to the robot and to each other.
Lengths in mm.
"""

from dataclasses import fields
from itertools import permutations, product

import numpy as np

from rrru.campaign.ingest.columns import AXES, COMMAND, DRIVES, MEASURED, MM, drive_name
from rrru.robots.rrru3 import Rrru3

# Files print drive angles with six decimals and positions with three or more, sometimes two.
DRIVE_TOLERANCE = {"rad": 1e-4, "mm": 0.01}
# ASSUME no robot's positions are off by a twentieth of its size in the median: if they seem so, the frames differ.
_FRAME_SHARE = 0.05
# A hundredth of it is strange enough for a note.
_STRANGE_SHARE = 0.01
# Room beyond the farthest reachable point, where an outlier may still lie.
_REACH_MARGIN = 1.1
_MOST, _MANY = 0.9, 0.5


def check_commands(frame, found, spec, mechanism, problems):
    """Note commanded positions that the robot cannot take and angles that contradict them; whether the file's unit can
    be right.

    frame: index row number, columns in mm and rad under our names, NaN where a cell has been noted; found: {our name:
    the file's name}.
    """
    known = frame.dropna(subset=[*COMMAND])
    command = known[[*COMMAND]].to_numpy()
    if not len(known):
        return True
    if _wrong_unit(command, found, spec, mechanism, problems):
        return False
    theta = mechanism.inverse(command, elbow=spec.elbow)
    reached = np.isfinite(theta).all(axis=1)
    for i in np.flatnonzero(~reached):
        legs = ", ".join(str(k + 1) for k in np.flatnonzero(np.isnan(theta[i])))
        column, allowed = _columns(COMMAND, found), f"a position that every leg reaches; leg {legs} does not"
        problems.add("reach", row=known.index[i], column=column, value=_position(command[i]), allowed=allowed)
    flipped = _upside_down(command[reached], theta[reached], found, mechanism, problems)
    if set(DRIVES[mechanism.drive_unit]) <= set(known) and not flipped:
        _check_angles(known[reached], theta[reached], found, spec, mechanism, problems)
    return True


def check_sizes(frame, found, problems):
    """Note measured positions in another unit than the commanded ones; whether both have the same.

    Their spreads are compared, which are the same in every frame.
    """
    known = frame.dropna(subset=[*COMMAND, *MEASURED])
    if not len(known):
        return False
    command, measured = (_spread(known[[*columns]].to_numpy()) for columns in (COMMAND, MEASURED))
    if command == 0.0 or 0.5 <= measured / command <= 2.0:
        return True
    ratio = measured / command
    unit = next(
        (
            f", not the measured ones in {b} and the commanded ones in {a}, as it seems"
            for (a, x), (b, y) in product(MM.items(), repeat=2)
            if a != b and abs(ratio - x / y) < 0.1 * ratio
        ),
        "",
    )
    value = f"measured positions that spread over {measured:.6g} mm while the commanded ones spread over {command:.6g} mm (ratio {ratio:.4g})"
    problems.add(
        "size",
        column=_columns(MEASURED, found),
        value=value,
        allowed=f"a ratio of 0.5 to 2: both in the same unit{unit}",
    )
    return False


def check_measured(frame, found, mechanism, problems):
    """Note measured positions, in the robot's frame, that lie beyond the robot's reach or altogether elsewhere than
    commanded.
    """
    known = frame.dropna(subset=[*COMMAND, *MEASURED])
    command, measured = known[[*COMMAND]].to_numpy(), known[[*MEASURED]].to_numpy()
    limit = frame_limit(mechanism)
    off = np.linalg.norm(measured - command, axis=1)
    column = _columns(MEASURED, found)
    if len(known) and np.median(off) > limit:
        middle = np.median(measured - command, axis=0)
        value = f"measured positions {np.median(off):.6g} mm from the commanded ones in the median, {_position(middle)} along x, y, z"
        allowed = f"at most {limit:g} mm; {_axes_advice(measured, command, limit) or 'frame: register turns another frame into the robot frame'}"
        problems.add("frame", column=column, value=value, allowed=allowed)
        return
    for number, run in known.groupby("run"):
        part = np.linalg.norm(run[[*MEASURED]].to_numpy() - run[[*COMMAND]].to_numpy(), axis=1)
        if np.median(part) > limit:
            value = f"run {number:g}: measured positions {np.median(part):.6g} mm from the commanded ones in the median"
            problems.add(
                "frame",
                row=run.index[0],
                column=column,
                value=value,
                allowed=f"at most {limit:g} mm, in one frame for all runs",
            )
    far = _REACH_MARGIN * _farthest(mechanism)
    for i in np.flatnonzero((np.linalg.norm(measured, axis=1) > far) | (measured == 0.0).all(axis=1)):
        allowed = (
            f"within {far:.4g} mm of the robot's origin, and not 0, 0, 0; drop the row of a point that was not measured"
        )
        problems.add(
            "reach of measured", row=known.index[i], column=column, value=_position(measured[i]), allowed=allowed
        )


def doubts(frame, mechanism):
    """What is possible but strange about measured positions in the robot's frame: far off in all, or one row late or
    early.
    """
    command, measured, run = frame[[*COMMAND]].to_numpy(), frame[[*MEASURED]].to_numpy(), frame["run"].to_numpy()
    off = np.median(np.linalg.norm(measured - command, axis=1))
    notes = []
    for first, second, word in ((measured[1:], command[:-1], "before"), (measured[:-1], command[1:], "after")):
        shifted = np.linalg.norm(first - second, axis=1)[run[1:] == run[:-1]]
        if off > 1.0 and np.median(shifted) < 0.2 * off:
            notes.append(
                f"measured positions fit the command of the row {word} theirs to {np.median(shifted):.3g} mm in the median, "
                f"their own to {off:.3g} mm: the rows may be shifted"
            )
    if off > _STRANGE_SHARE * _size(mechanism):
        notes.append(
            f"measured positions are {off:.4g} mm from the commanded ones in the median: see that unit, frame and rows belong together"
        )
    return notes


def frame_limit(mechanism):
    """Distance in mm between measured and commanded positions above which the frames must differ."""
    return _FRAME_SHARE * _size(mechanism)


def _size(mechanism):
    """Sum of the robot's lengths in mm."""
    return float(sum(np.sum(np.abs(getattr(mechanism, f.name))) for f in fields(mechanism) if f.name.endswith("_mm")))


def _farthest(mechanism):
    """Distance of the farthest reachable point from the origin in mm, found on rays in all directions."""
    count = 400
    height, turn = np.linspace(-1.0, 1.0, count), np.pi * (3.0 - np.sqrt(5.0)) * np.arange(count)
    ring = np.sqrt(1.0 - height**2)
    rays = np.stack([ring * np.cos(turn), ring * np.sin(turn), height], axis=-1)
    radius = np.linspace(0.0, 1.0, 101)[1:] * _size(mechanism)
    points = (radius[:, None, None] * rays).reshape(-1, 3)
    return float(np.linalg.norm(points[np.isfinite(mechanism.inverse(points)).all(axis=1)], axis=1).max())


def _spread(position):
    """Median distance of positions (n, 3) from their median."""
    return float(np.median(np.linalg.norm(position - np.median(position, axis=0), axis=1)))


def _reached(position, spec, mechanism):
    """Share of positions (n, 3) within reach."""
    return np.isfinite(mechanism.inverse(position, elbow=spec.elbow)).all(axis=1).mean()


def _wrong_unit(command, found, spec, mechanism, problems):
    """Note that another unit brings the commanded positions into reach; whether that is so."""
    if _reached(command, spec, mechanism) >= _MANY:
        return False
    for unit, factor in MM.items():
        if unit != spec.unit and _reached(command * factor / MM[spec.unit], spec, mechanism) >= _MOST:
            distance = np.linalg.norm(command, axis=1)
            value = f"commanded positions {distance.min():.4g} to {distance.max():.4g} mm from the robot's origin when read in {spec.unit}"
            allowed = f"positions within reach; unit: {unit} brings them there"
            problems.add("unit", column=_columns(COMMAND, found), value=value, allowed=allowed)
            return True
    return False


def _upside_down(command, theta, found, mechanism, problems):
    """Note that the robot stands on the other side of its base; whether that is so."""
    back = mechanism.forward(theta)
    flipped = np.abs(back[:, 2] + command[:, 2]) < np.abs(back[:, 2] - command[:, 2])
    if not len(command) or flipped.mean() < _MANY:
        return False
    way = "DOWN" if isinstance(mechanism, Rrru3) else "UP"
    drives, at, turned = drive_name(DRIVES[mechanism.drive_unit]), command[flipped][0, 2], back[flipped][0, 2]
    value = f"{at:.6g} mm, where the {drives} of that position bring the robot to {turned:.6g} mm"
    problems.add(
        "upside down",
        column=found["command_z_mm"],
        value=value,
        allowed=f"positions in the robot frame, whose z points {way} from the base",
    )
    return True


def _check_angles(known, theta, found, spec, mechanism, problems):
    """Note drive angles or slider positions that are not those of the commanded positions."""
    unit = mechanism.drive_unit
    drives = DRIVES[unit]
    given, command = known[[*drives]].to_numpy(), known[[*COMMAND]].to_numpy()
    off = np.abs(given - theta)
    bad = off > DRIVE_TOLERANCE[unit]
    tolerance = f"within {DRIVE_TOLERANCE[unit]:g} {unit} of the {'angle' if unit == 'rad' else 'one'} that the commanded position needs"
    if bad.any(axis=1).mean() > _MANY and (advice := _angle_advice(given, theta, command, spec, mechanism)):
        read = f"{drive_name(drives)} up to {np.nanmax(np.abs(given)):.6g} {unit}"
        read += f" when read in {spec.angle_unit}" if unit == "rad" else ""
        value = f"{read}, up to {np.nanmax(off):.6g} {unit} from those that the commanded positions need"
        problems.add("angles", column=_columns(drives, found), value=value, allowed=f"{tolerance}; {advice}")
        return
    for i, k in np.argwhere(bad):
        value = f"{given[i, k]:.6f} {unit}, while the commanded position {_position(command[i])} needs {theta[i, k]:.6f} {unit}"
        problems.add("angles", row=known.index[i], column=found[drives[k]], value=value, allowed=tolerance)


def _angle_advice(given, theta, command, spec, mechanism):
    """Which setting makes the drive angles or slider positions fit the commanded positions, or None."""
    tolerance = DRIVE_TOLERANCE[mechanism.drive_unit]
    other = {"rad": ("deg", np.pi / 180.0), "deg": ("rad", 180.0 / np.pi)}[spec.angle_unit]
    elbow = {"out": "in", "in": "out"}[spec.elbow]
    for candidate, wanted, advice in (
        *(
            ((given * other[1], theta, f"angle_unit: {other[0]} makes them fit"),)
            if mechanism.drive_unit == "rad"
            else ()
        ),
        (given, mechanism.inverse(command, elbow=elbow), f"elbow: {elbow} makes them fit"),
        (given[:, ::-1], theta, "the legs seem to be numbered the other way round"),
    ):
        if (np.abs(candidate - wanted) < tolerance).all(axis=1).mean() > _MOST:
            return advice
    return None


def _axes_advice(measured, command, limit):
    """Which exchange or turning round of the file's axes makes measured positions fit, or None."""
    best, text = limit, None
    for order, signs in product(permutations(range(3)), product((1.0, -1.0), repeat=3)):
        off = np.median(np.linalg.norm(measured[:, order] * signs - command, axis=1))
        if off < best:
            axes = ", ".join(("-" if sign < 0 else "") + AXES[axis] for axis, sign in zip(order, signs, strict=True))
            best, text = off, f"the file's measured ({axes}) would fit the robot's (x, y, z) to {off:.3g} mm"
    return text


def _columns(ours, found):
    """The file's names of some of our columns."""
    return ", ".join(found[name] for name in ours)


def _position(position):
    """A position for a message."""
    return f"({', '.join(f'{value:.6g}' for value in position)}) mm"
