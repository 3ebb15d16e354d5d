"""Gross mistakes put into correct files, the correct words for each, and whether they are detectable. Lengths mm.

A mistake is detectable where the residual of the nominal robot is three times as large with the mistake as without. The
instrument is registered rigidly where its frame is not stated. Otherwise the file is as good as a correct one.
"""

import re
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.spatial.transform import Rotation

from rrru.errors import RrruError
from rrru.seeds import stream
from rrru.studies.blind_validation.sentences import page
from rrru.studies.blind_validation.sentences.draws import draw
from rrru.studies.blind_validation.sentences.kinds import KINDS

_SHOWS = 3.0
_TOOL_MM, _TARGET_MM = 50.0, 40.0
_MEASURED = ["measured_x_mm", "measured_y_mm", "measured_z_mm"]


@dataclass(frozen=True)
class Handed:
    """The input of a user: rows of a file, the campaign's section, the robot, and patterns of the correct words.

    nominal: the robot of the file; places: of the targets as stated.
    """

    rows: object
    section: dict
    nominal: object
    words: tuple
    places: dict


def _right(own):
    """The correct file."""
    return Handed(own.file_rows, own.section(".", "stops.csv"), own.nominal, (), own.targets)


def _signs(handed, own, names):
    """The columns of some drives with the opposite sign."""
    rows = handed.rows.assign(**{name: -handed.rows[name] for name in names})
    turned = ", ".join(f"{name}: -1" for name in own.nominal.columns if name in names)
    return replace(handed, rows=rows, words=(re.escape(f"signs: {{{turned}}}"),))


def _order(handed, own, order):
    """Columns of the drives in another order: the k-th holds the values of drive order[k]."""
    names = own.nominal.columns
    values = {name: handed.rows[names[drive]] for name, drive in zip(names, order, strict=True)}
    listed = ", ".join(names[drive] for drive in order)
    return replace(handed, rows=handed.rows.assign(**values), words=(re.escape(f"order: [{listed}]"),))


def _one_sign(handed, own, generator):
    """One drive has the opposite sign."""
    return _signs(handed, own, [str(generator.choice(own.nominal.columns))])


def _all_signs(handed, own, _generator):
    """All drives have the opposite sign."""
    return _signs(handed, own, list(own.nominal.columns))


def _exchanged(handed, own, generator):
    """Two drives of one unit are exchanged."""
    units = np.array(own.nominal.units)
    pairs = [(i, j) for i in range(len(units)) for j in range(i) if units[i] == units[j]]
    if not pairs:
        return None
    order = list(range(len(units)))
    i, j = pairs[generator.integers(len(pairs))]
    order[i], order[j] = j, i
    return _order(handed, own, order)


def _reversed(handed, own, _generator):
    """The drives are in reverse order."""
    units = own.nominal.units
    return _order(handed, own, list(range(len(units)))[::-1]) if units == units[::-1] else None


def _moved_on(handed, own, generator):
    """The drives are numbered from another drive on."""
    count = len(own.nominal.units)
    step = int(generator.integers(1, count))
    order = [*range(step, count), *range(step)]
    return _order(handed, own, order) if len(set(own.nominal.units)) == 1 else None


def _late(handed, own, _generator, by=1):
    """Measured columns are shifted down by some rows."""
    if own.reading not in ("tool", "pose"):
        return None
    names = [name for name in handed.rows if name.startswith("measured_")]
    moved = handed.rows[names].shift(by)
    # the values of a row are `by` rows below it
    rows = handed.rows.assign(**{name: moved[name] for name in names}).iloc[by:]
    return replace(handed, rows=rows, words=(rf"not {by} rows? late|rows may be shifted",))


def _tool(handed, own, _generator):
    """The tool is longer than in the robot's file or in the stated places."""
    if own.reading == "stated":
        places = {name: [x, y, z + _TOOL_MM] for name, (x, y, z) in own.targets.items()}
        words = (r"targets: \{",)
        return replace(handed, section=handed.section | {"targets": places}, words=words, places=places)
    if own.reading != "tool" or not hasattr(own.nominal, "tip_mm"):
        return None
    x, y, z = own.nominal.tip_mm
    return replace(handed, nominal=replace(own.nominal, tip_mm=(x, y, z - _TOOL_MM)), words=(r"tool|targets: \{",))


def _one_target(handed, own, _generator):
    """One reflector's stated place is wrong."""
    if own.reading != "stated":
        return None
    places = {name: list(place) for name, place in own.targets.items()}
    places["b"][0] += _TARGET_MM
    words = (r"targets: \{.*b: \[",)
    return replace(handed, section=handed.section | {"targets": places}, words=words, places=places)


def _targets_exchanged(handed, own, _generator):
    """Two reflectors were read under each other's names."""
    if own.reading != "stated":
        return None
    names = handed.rows["target"].replace({"a": "b", "b": "a"})
    return replace(handed, rows=handed.rows.assign(target=names), words=(r"targets: \{|exchanged",))


def _left_handed(handed, _own, _generator):
    """The instrument's y axis has the opposite sign."""
    rows = handed.rows.assign(measured_y_mm=-handed.rows["measured_y_mm"])
    return replace(handed, rows=rows, words=("right-handed|mirror|left-handed",))


def _in_m(handed, _own, _generator):
    """Positions are in m, and the section says mm."""
    rows = handed.rows.assign(**{name: 1e-3 * handed.rows[name] for name in _MEASURED})
    return replace(handed, rows=rows, words=(r"unit: m\b",))


def _in_degrees(handed, own, _generator):
    """Angles are in degrees, and the section says rad."""
    turning = [name for name in own.nominal.columns if name.endswith("_rad")]
    if not turning:
        return None
    rows = handed.rows.assign(**{name: np.degrees(handed.rows[name]) for name in turning})
    return replace(handed, rows=rows, words=("angle_unit: deg|degrees",))


def _other_robot(handed, own, generator):
    """The robot's file is that of another robot of its kind; lost zeros of the drives look alike."""
    other = KINDS[own.robot_kind](generator)
    return replace(handed, nominal=other, words=("does not fit the robot|`robot` is another one|`robot` is right",))


def _frame(handed, own, generator):
    """The instrument has an arbitrary frame, and the section does not say so."""
    turn = Rotation.from_rotvec(generator.uniform(0.5, 1.5, 3)).as_matrix()
    if own.registered or own.reading == "pose":
        return None
    moved = handed.rows[_MEASURED].to_numpy() @ turn.T + generator.uniform(500.0, 2000.0, 3)
    rows = handed.rows.assign(**dict(zip(_MEASURED, moved.T, strict=True)))
    return replace(handed, rows=rows, words=("frame: register",))


MISTAKES = {
    "sign of a drive": _one_sign,
    "signs of all drives": _all_signs,
    "two drives exchanged": _exchanged,
    "drives in reverse": _reversed,
    "drives moved on": _moved_on,
    "rows late by one": _late,
    "rows late by two": partial(_late, by=2),
    "tool": _tool,
    "place of a target": _one_target,
    "targets exchanged": _targets_exchanged,
    "left-handed frame": _left_handed,
    "metres": _in_m,
    "degrees": _in_degrees,
    "other robot": _other_robot,
    "frame": _frame,
}
# the residual of a rigid registration does not show these mistakes
_OF_FRAME = ("frame", "metres")


def with_mistake(number, seed, most_stops):
    """The name of a mistake, the Draw of a robot, and what is Handed in: the next robot that can have it."""
    name, turn = [*MISTAKES][number % len(MISTAKES)], number // len(MISTAKES)
    step = 0
    while True:
        own = right_draw(len(MISTAKES) * (turn * 97 + step) + number % len(MISTAKES), seed, most_stops, "mistakes")
        generator = stream(seed, "sentences mistake", number, step)
        handed = MISTAKES[name](_right(own), own, generator)
        if handed is not None:
            return name, own, handed
        step += 1


def right_draw(number, seed, most_stops, label):
    """A Draw without a cause, from a separate stream."""
    return replace(draw(number, stream(seed, label).integers(2**31), most_stops, 0.0), cause=None)


def right_file(number, seed, most_stops):
    """The Draw of a correct file, and what is Handed in."""
    own = right_draw(number, seed, most_stops, "right files")
    return own, _right(own)


def shows(name, own, handed):
    """Whether a mistake is detectable in the file."""
    if name in _OF_FRAME:
        return True
    return _rms(handed, own) > _SHOWS * _rms(_right(own), own)


def _rms(handed, own):
    """Residual rms in mm of the nominal robot, registered where the frame is not stated; infinite without a pose."""
    place, turn = handed.nominal.poses(handed.rows[list(own.nominal.columns)].to_numpy())
    names = handed.rows["target"] if "target" in handed.rows else [""] * len(handed.rows)
    if own.reading == "found":
        return _rms_found(handed.rows, place, turn, np.array(names))
    said = place + (turn @ np.array([handed.places[name] for name in names])[:, :, None])[:, :, 0]
    return _left(handed.rows[_MEASURED].to_numpy(), said, own.registered)


def _rms_found(rows, place, turn, names):
    """The same with the targets' places free: rms after alternating fits of frame and places."""
    measured, places = rows[_MEASURED].to_numpy(), {name: np.zeros(3) for name in set(names)}
    for _ in range(30):
        said = place + (turn @ np.array([places[name] for name in names])[:, :, None])[:, :, 0]
        if not np.isfinite(said).all():
            return np.inf
        rotation, shift = _kabsch(measured, said)
        moved = measured @ rotation.T + shift
        back = (turn.transpose(0, 2, 1) @ (moved - place)[:, :, None])[:, :, 0]
        places = {name: back[names == name].mean(axis=0) for name in places}
    return float(np.sqrt(((moved - said) ** 2).sum(axis=1).mean()))


def _left(measured, said, registered):
    """Residual rms in mm, after a rigid registration where `registered`."""
    if not np.isfinite(said).all():
        return np.inf
    rotation, shift = _kabsch(measured, said) if registered else (np.eye(3), np.zeros(3))
    return float(np.sqrt(((measured @ rotation.T + shift - said) ** 2).sum(axis=1).mean()))


def _kabsch(measured, said):
    """Rotation and translation that best map measured to said positions."""
    a, b = measured.mean(axis=0), said.mean(axis=0)
    left, _, right = np.linalg.svd((measured - a).T @ (said - b))
    sign = np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    rotation = (left @ sign @ right).T
    return rotation, b - rotation @ a


def read(own, handed, folder):
    """The result of reading a file: accepted, refused or traceback, and the words."""
    section, robot = replace(own, nominal=handed.nominal).write(folder, handed.rows)
    try:
        found = page.read(handed.section | {"ingest": section["ingest"]}, robot)
    except RrruError as error:
        return "refused", str(error)
    # any other exception is a defect
    except Exception as error:
        return "traceback", f"{type(error).__name__}: {error}"
    return "accepted", "; ".join(found.notes)


def is_mirrored(own, handed, words):
    """Whether exchanged legs of a mirror-symmetric robot have been taken for a mirrored frame.

    With three equal legs both explain the readings equally well, and the file cannot decide.
    """
    legs = len(own.nominal.units) == 3 and own.nominal.formats == ("mjcf",)
    exchanged = any(pattern.startswith("order:") for pattern in handed.words)
    return legs and exchanged and bool(re.search("right-handed|would fit the robot's", words))


def named(handed, words):
    """Whether words name the mistake and the key to write."""
    return all(re.search(pattern, words, re.DOTALL) for pattern in handed.words)
