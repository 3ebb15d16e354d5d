"""Places of a file's reflectors (targets) on the platform or in the world: stated in the configuration or estimated.

The poses are the robot's nominal ones, or those with the lost zero offsets of its drives. Lengths in mm, angles in rad.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.spatial.transform import Rotation

from rrru.campaign import measurements as rows
from rrru.campaign.driven_path import stops
from rrru.campaign.ingest.frames import Frames
from rrru.campaign.ingest.gross_advice import place_words
from rrru.campaign.ingest.orientations import other_readings
from rrru.campaign.ingest.outliers import strays
from rrru.campaign.ingest.sheet import MEASURED, TURNS, Sheet, position_text
from rrru.campaign.ingest.small_turns import common_shift
from rrru.campaign.ingest.zero_offsets import LARGE, found_zeros
from rrru.campaign.outliers import MAX_ROBUST_SDS, MEDIAN_OF_LENGTH, robust_sd
from rrru.campaign.target_registration import axes_by_turning
from rrru.kinematics.chain import Poses
from rrru.kinematics.readings import Readings
from rrru.kinematics.robot import Robot

# the name of a reflector where the file has no such column
_UNNAMED = "tool"
# an axis whose direction differs by less, in rad, never turns: a place that is off by a metre along it moves no reading
# by more than 10 um
_NEVER_TURNS_RAD = 1e-5
# the mean of rotations and those that are far off it are found in so many rounds
_ROUNDS_OF_MEAN = 5
# ASSUME what is nearer to it is no gross error of a camera: least squares of all readings have the plain mean
_GROSS_RAD = 0.02
# residual with other places of the targets, over that with zero offsets of the drives: up to the first value the places
# explain the readings as well, up to the second far better
_AS_GOOD, _FAR_BETTER = 2.0, 0.5
# a place that is off by a larger share of the robot's size is grossly wrong; less may be an error of the base or the
# platform, which the calibration fits
_GROSS_SHARE = 0.01
# an axis is one of the platform's x, y, z where a component of its unit vector is larger
_ALONG = 0.9999
# readings of each reflector that `_by_zeros` uses at most
_SOME_READINGS = 30
# share of a displacement that is rounding
_ROUNDING = 1e-6
# rows from which lost zero offsets are estimated; the calibration fits the result to all of them
_MAX_ROWS = 200
# ASSUME no orientations are off by more than this where the file's frame is the robot's
_MAX_TURNED_RAD = 0.2
# ASSUME no robot's orientations scatter more about those of its nominal model: about 6 degrees in the median
_MAX_SCATTER_RAD = 0.1
# another convention of the orientations (unit, sequence, order) is the right one where it leaves less than this share
_FAR_LESS = 0.2
# the platform of a delta turns by some mrad where its bars differ, and a reflector 40 mm off the tool moves by microns
_STATE_PLACE = (
    "state it in `targets`, since small turns of the platform by the robot's errors move it in an unknown way"
)


@dataclass(frozen=True)
class TargetPlacement:
    """What was measured in the n rows of a file, and where it is.

    names (n,): of the reflectors, None where the tool itself is measured.
    place_mm (n, 3): position of the row's reflector on the platform, or in the robot's frame where on_world (n,).
    offset_mm (n, 3): from the commanded position to the reflector in the robot's frame, with the zero offsets that were
        found.
    turn (3, 3): rotation matrix from the platform to the body whose orientation is measured.
    strays (n,): rows that are no reading of their reflector.
    zeros_lost: whether zero offsets of the drives were found that are not zero.
    notes: sentences on what was found.
    """

    names: np.ndarray | None
    place_mm: np.ndarray
    on_world: np.ndarray
    offset_mm: np.ndarray
    turn: np.ndarray
    strays: np.ndarray
    zeros_lost: bool
    notes: tuple[str, ...]

    @property
    def framing(self) -> np.ndarray:
        """Whether rows (n,) determine the instrument's frame."""
        return np.asarray(~self.strays & ~self.on_world)

    def columns(self, frame: pd.DataFrame, rotation: np.ndarray) -> dict[str, np.ndarray]:
        """Columns of `measurements` by name, none where the tool is measured.

        frame: the file's table; rotation (3, 3): from the instrument's frame to the robot's.
        """
        if self.names is None:
            return {}
        result = {"target": self.names.astype(str), **rows.vector_columns("target", self.place_mm)}
        if self.on_world.any():
            result["target_on"] = np.where(self.on_world, rows.ON_WORLD, rows.ON_PLATFORM)
        if set(TURNS["measured"]) <= set(frame):
            turns = rotation @ rows.turns(frame, "measured") @ self.turn.T
            result |= rows.turn_columns("measured", turns)
        return result


def target_placement(sheet: Sheet) -> TargetPlacement | None:
    """The TargetPlacement of a sheet without problems.

    None where the tool itself is read and no zero offset is lost.
    """
    frame, registered = sheet.frame, sheet.spec.frame == "register"
    turned, driven = set(TURNS["measured"]) <= set(frame), set(sheet.drives) <= set(frame)
    named = "target" in frame or (turned and registered)
    if not named and not (driven and registered):
        return None
    poses, command = sheet.poses, rows.command(frame)
    if not poses.closed.all():
        sheet.refuse_now(None, f"{int((~poses.closed).sum())} poses that the nominal robot cannot take", "known poses")
    frames, notes = _frames(sheet, named)
    nothing = np.zeros(len(sheet.drives))
    zeros, far, lost = _zeros(sheet, frames, command) if driven else (nothing, nothing, False)
    if not (named or zeros.any()):
        return None
    if zeros.any():
        poses = sheet.mechanism.solve(sheet.actuators(command) + zeros, command)
    rotation, place = fitted = frames.fitted(poses)
    left_mm = frames.framed(poses, fitted).off_mm
    if zeros.any():
        _refuse_places(sheet, left_mm, lost)
        notes += _lost_zero_notes(sheet, (zeros, far), left_mm) if lost else ()
    free = ~frames.known & ~frames.on_world
    if registered and free.all():
        # along an axis that never turns they are confounded with the frame's shift: their mean is set to the tool
        axes, _ = axes_by_turning(poses.turn)
        still = axes[:, np.ptp(poses.turn @ axes, axis=0).max(axis=0) < _NEVER_TURNS_RAD]
        place = place + still @ still.T @ (np.asarray(sheet.mechanism.tool_mm) - np.unique(place, axis=0).mean(axis=0))
        if still.shape[1] == 3:
            # unless the small turns by the robot's errors show another place
            place = place + _by_small_turns(sheet, frames, (poses, sheet.actuators(command) + zeros, command), place)
    turn = np.eye(3)
    if named and not set(frames.names) <= set(sheet.spec.targets):
        posed = poses, sheet.actuators(command) + zeros, command
        by_zeros = _by_zeros(sheet.mechanism, frames, posed, place, left_mm)
        notes += _place_notes(sheet, frames, place, (*_precision(frames, poses, left_mm), by_zeros))
    if turned:
        turn = _between(poses, rows.turns(frame, "measured"), rotation)
        _refuse_scattered(sheet, poses, rotation)
        if registered:
            angle_deg = np.degrees(Rotation.from_matrix(turn).magnitude())
            notes += (f"orientations are read turned by {angle_deg:.4g} degrees from the platform's",)
        else:
            _check_turned(sheet, turn)
            turn = np.eye(3)
    seen_from = poses.point(np.asarray(sheet.mechanism.tool_mm)) if not zeros.any() else command
    offset = frames.carriers(poses).point(place) - seen_from
    return TargetPlacement(
        frames.names if named else None, place, frames.on_world, offset, turn, ~frames.right, bool(zeros.any()), notes
    )


def _frames(sheet: Sheet, named: bool) -> tuple[Frames, tuple[str, ...]]:
    """The Frames of a sheet, and notes on readings that are of no or of another reflector."""
    frame, seen = sheet.frame, rows.measured(sheet.frame)
    names = frame["target"].to_numpy() if "target" in frame else np.full(len(frame), _UNNAMED)
    on_world, right = np.isin(names, sheet.spec.world_targets), np.ones(len(frame), dtype=bool)
    notes: tuple[str, ...] = ()
    if "target" in frame:
        wrong, texts = strays(seen, stops(frame), names, on_world)
        right = ~wrong
        notes = tuple(f"row {frame.index[k]}: {text}" for k, text in texts.items())
    stated = (
        _known(sheet, names) if named else np.tile(np.asarray(sheet.mechanism.tool_mm, dtype=float), (len(frame), 1))
    )
    return Frames(seen, names, stated, on_world, right, sheet.spec.frame == "register"), notes


def _zeros(sheet: Sheet, frames: Frames, command: np.ndarray) -> tuple[np.ndarray, np.ndarray, bool]:
    """Zero offsets (K,) of the drives in rad or mm, how far they are off, and whether zeros are lost: `found_zeros`."""
    chosen = _some_rows(frames.framing)
    seen = Readings(frames.seen_mm, frames.names, frames.place_mm, on_world=frames.on_world).of(chosen)
    framed = frames.select(chosen).framed
    return found_zeros(sheet.mechanism, (sheet.actuators(command)[chosen], command[chosen]), seen, framed)


def _by_small_turns(
    sheet: Sheet, frames: Frames, posed: tuple[Poses, np.ndarray, np.ndarray], place: np.ndarray
) -> np.ndarray:
    """The `common_shift` (3,) of places (n, 3) by some of the readings; posed: as of `_by_zeros`."""
    poses, drive, command = posed
    chosen = _some_rows(frames.framing)
    its, at = frames.select(chosen), place[chosen]
    framed = its.framed(poses.of(chosen), (frames.fitted(poses)[0], at))
    readings = Readings(framed.position_mm, its.names, at)
    return common_shift(sheet.mechanism, (drive[chosen], command[chosen]), readings)


def _some_rows(usable: np.ndarray) -> np.ndarray:
    """Rows (m,) of a fit, at most _MAX_ROWS of those that are usable (n,)."""
    chosen = np.flatnonzero(usable)
    if len(chosen) > _MAX_ROWS:
        chosen = np.sort(np.random.default_rng(0).choice(chosen, _MAX_ROWS, replace=False))
    return chosen


def _refuse_places(sheet: Sheet, left_mm: float, lost: bool) -> None:
    """Raise IngestError where other places of the targets explain the readings far better than zero offsets do.

    left_mm: median residual with the zero offsets; lost: whether these are large. With small ones the file is refused
    only where the other places are far from the stated ones.
    """
    places = _places(sheet, _FAR_BETTER * left_mm)
    if not places or not (lost or _moved_mm(sheet, places) > _GROSS_SHARE * sheet.mechanism.size_mm):
        return
    value = f"measured positions that other zeros of the drives bring to {left_mm:.3g} mm from the nominal robot"
    allowed = f"at most {_FAR_BETTER * left_mm:.2g} mm; {place_words(places)} brings them there, "
    sheet.refuse_now(MEASURED, value, f"{allowed}frame: register may do so, too")


def _moved_mm(sheet: Sheet, places: Mapping[str, np.ndarray]) -> float:
    """Largest distance in mm of places by name from the stated ones, infinite where one is not stated."""
    stated = {"": sheet.mechanism.tool_mm, **sheet.spec.targets}
    if not set(places) <= set(stated):
        return np.inf
    return max(float(np.linalg.norm(place - np.asarray(stated[name]))) for name, place in places.items())


def places_instead(sheet: Sheet, max_mm: float) -> str:
    """The key `targets`, or the place of the tool, with which the nominal robot agrees with readings in its own frame.

    As a text for a message; empty where a median distance of more than max_mm remains.
    """
    places = _places(sheet, max_mm)
    return place_words(places) if places else ""


def _places(sheet: Sheet, max_mm: float) -> dict[str, np.ndarray]:
    """Places (3,) by name of the targets, "" for the tool, as for `places_instead`; none where more remains."""
    frame, poses = sheet.frame, sheet.poses
    if sheet.spec.frame != "robot":
        return {}
    seen, names = rows.measured(frame), np.full(len(frame), "")
    if "target" in frame:
        names = frame["target"].astype(str).to_numpy()
    open_places, right = np.full(seen.shape, np.nan), np.isfinite(seen).all(axis=1) & poses.closed
    frames = Frames(seen, names, open_places, np.isin(names, sheet.spec.world_targets), right, registered=False)
    if not frames.framing.any():
        return {}
    found, names = frames.framed(poses), names[frames.framing]
    if found.off_mm > max_mm:
        return {}
    return {name: found.place_mm[names == name][0] for name in dict.fromkeys(names.tolist())}


def _lost_zero_notes(sheet: Sheet, found: tuple[np.ndarray, np.ndarray], left_mm: float) -> tuple[str, ...]:
    """Notes on lost zeros (K,) of the drives, with which the nominal robot is left_mm off in the median.

    found: the zeros and how far they are off over what is lost.
    """
    zeros, far = found
    worst = int(far.argmax())
    drive = sheet.mechanism.parts.drives[worst]
    most = f"{np.degrees(zeros[worst]):.3g} degrees" if drive.unit == "rad" else f"{zeros[worst]:.3g} mm"
    # none is that far off where only the start from the nominal zeros fails
    count = max(int((far > 1.0).sum()), 1)
    lost = f"zeros of {count} drives are" if count > 1 else "the zero of 1 drive is"
    how = f"found with the frame, fitted by the calibration, {left_mm:.2g} mm remain in the median"
    places = places_instead(sheet, _AS_GOOD * left_mm)
    instead = f"{places}, or `robot` is another one" if places else "`robot` is another one or a stated place is wrong"
    return (f"{lost} lost, by {most} at {drive.site}: {how}; if the drives are referenced, {instead}",)


def check_turned(sheet: Sheet) -> None:
    """Note orientations in another frame than the robot's, in a sheet that has some and no TargetPlacement."""
    if not set(TURNS["measured"]) <= set(sheet.frame):
        return
    turns = rows.turns(sheet.frame, "measured")
    # a file without a pose to compare has other problems, which are noted
    if (sheet.poses.closed & np.isfinite(turns).all(axis=(1, 2))).any():
        _refuse_scattered(sheet, sheet.poses, np.eye(3))
        _check_turned(sheet, _between(sheet.poses, turns, np.eye(3)))


def _refuse_scattered(sheet: Sheet, poses: Poses, rotation: np.ndarray) -> None:
    """Raise IngestError where orientations do not turn with the platform, with the convention that they seem to have.

    poses: the robot's; rotation (3, 3): from the instrument's frame to the robot's, by the positions.
    """
    turns = rows.turns(sheet.frame, "measured")
    scatter = _scatter(poses, turns, rotation)
    if not scatter > _MAX_SCATTER_RAD:
        return
    known = np.isfinite(turns).all(axis=(1, 2))
    others = {}
    for convention, read in other_readings(turns[known], sheet.found).items():
        made = np.full(turns.shape, np.nan)
        made[known] = read
        others[convention] = _scatter(poses, made, rotation)
    best = min(others, key=others.__getitem__)
    value = (
        f"orientations that differ by {scatter:.3g} rad in the median from those of the platform times a fixed rotation"
    )
    allowed = f"at most {_MAX_SCATTER_RAD:g} rad"
    if others[best] < _FAR_LESS * scatter:
        allowed += f"; {best} leaves {others[best]:.2g} rad"
    else:
        allowed += "; check unit, sequence and order of their columns"
    sheet.refuse_now(TURNS["measured"], value, allowed)


def _scatter(poses: Poses, turns: np.ndarray, rotation: np.ndarray) -> float:
    """Median angle in rad by which measured orientations (n, 3, 3) turn otherwise than the platform."""
    off = _turned_off(poses, turns, rotation)
    return float(np.median((off * off.mean().inv()).magnitude()))


def _check_turned(sheet: Sheet, turn: np.ndarray) -> None:
    """Note a rotation (3, 3) from the platform to the measured body that is larger than that of any tool."""
    angle = Rotation.from_matrix(turn).magnitude()
    if angle > _MAX_TURNED_RAD:
        value = f"orientations {angle:.4g} rad from those of the commanded poses in the mean"
        allowed = f"at most {_MAX_TURNED_RAD:g} rad; frame: register finds frame and tool"
        sheet.note("frame", TURNS["measured"], value, allowed)


def _known(sheet: Sheet, names: np.ndarray) -> np.ndarray:
    """Stated places (n, 3) of the reflectors, NaN where not stated; notes those that the file lacks."""
    stated = dict(sheet.spec.targets)
    for name in sorted(set(stated) - set(names)):
        there = ", ".join(sorted(set(names)))
        sheet.note("reflectors", None, f"targets: {name}, which the file lacks", f"reflectors of the file: {there}")
    nowhere = (np.nan,) * 3
    return np.array([stated.get(name, nowhere) for name in names], dtype=float)


def _place_notes(
    sheet: Sheet, frames: Frames, place: np.ndarray, precision: tuple[np.ndarray, np.ndarray, dict[str, np.ndarray]]
) -> tuple[str, ...]:
    """Notes on the places (n, 3) that were found; precision: the results of `_precision` and of `_by_zeros`."""
    (axes, errors, by_zeros), result = precision, []
    for name in dict.fromkeys(frames.names.tolist()):
        if name in sheet.spec.targets:
            continue
        k = int(np.argmax(frames.names == name))
        if frames.on_world[k]:
            result.append(f"reflector {name} found at {position_text(place[k])}, fixed to the world")
        elif not np.isfinite(errors).any():
            shifted = not np.allclose(np.unique(place, axis=0).mean(axis=0), sheet.mechanism.tool_mm)
            reason = "the place that fits best with the robot's errors" if shifted else "the mean of all at the tool"
            at = f"reflector {name} assumed at {position_text(place[k])} on the platform, {reason}"
            result.append(f"{at}: a platform that never turns does not determine it, {_STATE_PLACE}")
        else:
            known = np.isfinite(errors)
            moves = by_zeros[name] @ axes[:, known]
            about = float(np.linalg.norm([errors[known].max(), *np.ravel(moves)]))
            result.append(f"reflector {name} found {_place_text(place[k], axes[:, ~known].T, about)}")
    return tuple(result)


def _precision(frames: Frames, poses: Poses, residual: float) -> tuple[np.ndarray, np.ndarray]:
    """Axes (3, 3) of the platform, in columns, and the error (3,) that an estimated place may have along each of them.

    The nominal robot's own errors make the residual in mm and may move a place by as much, however many readings there
    are. Infinite along axes on which the readings do not determine the places.
    """
    if not frames.registered or (frames.known & frames.framing).any():
        return np.eye(3), np.full(3, residual)
    axes, turned = axes_by_turning(poses.turn)
    with np.errstate(divide="ignore"):
        return axes, np.where(turned > 0.0, residual / turned, np.inf)


def _by_zeros(
    robot: Robot, frames: Frames, posed: tuple[Poses, np.ndarray, np.ndarray], place: np.ndarray, left_mm: float
) -> dict[str, np.ndarray]:
    """By reflector the errors (K, 3) in mm of its estimated place that zero offsets of the K drives may cause.

    The estimated places, and the frame where it is registered, absorb a part of the displacements that a zero offset
    causes: their least squares fit to these. The rest remains as residual, from whose size that of the zero offsets
    follows, if all are alike. Of the last drive of a chain nothing remains, as it moves the platform alike in all
    poses: its zero offset is confounded with the reflectors' places.

    posed: Poses (n), actuator values (n, K) and nominal positions (n, 3) of the rows; place (n, 3): on the platform or
    the world; left_mm: median residual.
    """
    poses, drive, command = posed
    chosen = _some_readings(frames, poses)
    at, its, known = poses.of(chosen), place[chosen], frames.known[chosen]
    names, on_world = frames.names[chosen], frames.on_world[chosen]
    seen, free = at.point(its), [name for name in dict.fromkeys(names[~known].tolist())]
    columns = np.zeros((len(chosen), 3, 6 + 3 * len(free)))
    if frames.registered:
        columns[:, :, :3] = np.eye(3)
        columns[:, :, 3:6] = -np.cross(np.eye(3), (seen - seen.mean(axis=0))[:, None] / robot.size_mm, axis=-1)
    for k, name in enumerate(free):
        columns[names == name, :, 6 + 3 * k : 9 + 3 * k] = at.turn[names == name]
    moves = np.empty((len(chosen), 3, drive.shape[1]))
    for k, part in enumerate(robot.parts.drives):
        moved = robot.solve(drive[chosen] + LARGE[part.unit] * np.eye(drive.shape[1])[k], command[chosen])
        shift = np.where(on_world[:, None], 0.0, moved.point(its) - seen)
        moves[:, :, k] = np.where(moved.closed[:, None], shift, 0.0)
    flat = moves.reshape(-1, drive.shape[1])
    fitted = np.linalg.lstsq(columns.reshape(len(flat), -1), flat, rcond=1e-9)[0]
    left = flat - columns.reshape(len(flat), -1) @ fitted
    alike = np.abs(left).max(axis=0) <= _ROUNDING * np.abs(flat).max(axis=0)
    left_by_all = np.sqrt((left[:, ~alike] ** 2).sum() / len(chosen))
    size = np.where(alike, 1.0, min(left_mm / max(left_by_all, 1e-12), 1.0))
    return {name: size[:, None] * fitted[6 + 3 * k : 9 + 3 * k].T for k, name in enumerate(free)}


def _some_readings(frames: Frames, poses: Poses) -> np.ndarray:
    """Rows (m,) of some readings of each reflector that the robot carries or whose place is known."""
    usable = poses.closed & (frames.known | ~frames.on_world)
    generator, chosen = np.random.default_rng(0), []
    for name in dict.fromkeys(frames.names.tolist()):
        its = np.flatnonzero(usable & (frames.names == name))
        chosen.append(generator.permutation(its)[:_SOME_READINGS])
    return np.sort(np.concatenate(chosen))


def _place_text(place: np.ndarray, still: np.ndarray, about: float) -> str:
    """Text of a place (3,) on the platform, with a question mark for a coordinate that the readings do not determine.

    still (k, 3): axes along which they do not; about: error in mm along the others.
    """
    of_body = {int(np.abs(axis).argmax()) for axis in still if np.abs(axis).max() > _ALONG}
    numbers = ("?" if k in of_body else f"{value:.6g}" for k, value in enumerate(place))
    result = f"at ({', '.join(numbers)}) mm on the platform, to about {about:.2g} mm"
    for axis in still:
        largest = int(np.abs(axis).argmax())
        along = "xyz"[largest] if largest in of_body else f"({', '.join(f'{value:.3g}' for value in axis)})"
        result += (
            f", its place along {along} is not separately identifiable from the instrument's: this axis never turns"
        )
    return result


def _between(poses: Poses, turns: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """Mean rotation (3, 3) from the platform to orientations (n, 3, 3) that were measured in a frame (3, 3).

    Without those that are far off the rest, as a camera takes some.
    """
    off = _turned_off(poses, turns, rotation)
    mean = off.mean()
    for _ in range(_ROUNDS_OF_MEAN):
        away = (off * mean.inv()).magnitude()
        mean = off[away <= max(MAX_ROBUST_SDS * robust_sd(away, MEDIAN_OF_LENGTH), _GROSS_RAD)].mean()
    return np.asarray(mean.as_matrix())


def _turned_off(poses: Poses, turns: np.ndarray, rotation: np.ndarray) -> Rotation:
    """Rotations from the platform to orientations (n, 3, 3) that were measured in a frame (3, 3), at known poses."""
    known = np.isfinite(turns).all(axis=(1, 2)) & poses.closed
    return Rotation.from_matrix(poses.turn[known].transpose(0, 2, 1) @ rotation @ turns[known])
