"""An MJCF with the results of a diagnosis: places of bodies, axes, anchors, stiffness and backlash of drives.

Names, defaults and comments of the user's file stay, and each changed number has its standard error in a comment.
Lengths in mm and angles in rad, m in the file.
"""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TypeAlias
from xml.etree.ElementTree import Element

import mujoco
import numpy as np

from rrru.formats.file_changes import SAME, Found, TwistsBySite, changes_of, difference, scatter
from rrru.formats.mjcf_drives import write_backlash, write_stiffness
from rrru.formats.mjcf_home import close_keys
from rrru.formats.mjcf_reader import MEASURED_TOOL, MM, ends_of
from rrru.formats.mjcf_text import MjcfDocument
from rrru.formats.robot_file import mjcf_parts
from rrru.formats.structure import Structure, meeting_at_home, structure_of
from rrru.formats.xml_text import quaternion, sizes, words

_TURNS = ("quat", "axisangle", "xyaxes", "zaxis", "euler")
_EQ = mujoco.mjtEq
# what numbers of the file are of: ("body", its number), ("axis" or "pos", joint), ("anchor", equality, its end), or
# ("frame", name)
_Key: TypeAlias = tuple[str, int] | tuple[str, int, int] | tuple[str, str]


def to_mjcf(path: str | Path, platform: str, found: Found, folder: Path) -> tuple[str, tuple[str, ...]]:
    """The text of an MJCF with the Found of its robot, for a file in a folder, and what it cannot represent, in words.

    Raises ConfigError for a file whose bodies do not all stand in it as such.
    """
    structure = structure_of(*mjcf_parts(path, platform))
    document, model = MjcfDocument(structure.assembly.file), structure.assembly.model
    found = replace(found, twists=meeting_at_home(structure, found.twists))

    def numbers(twists: TwistsBySite) -> dict[_Key, np.ndarray]:
        return _numbers(structure, found, twists)

    values, nominal = numbers(found.twists), numbers({})
    errors = scatter(numbers, found.twists, found.spread)
    changed = {
        key: (value, errors.get(key, np.full(6 if value.ndim == 2 else 3, np.nan)))
        for key, value in values.items()
        if key[0] == "frame" or np.abs(difference(nominal[key], value)).max() > SAME
    }
    _write_bodies(document, changed, nominal)
    lost = [*changes_of(structure, found, found.twists).lost, *write_stiffness(document, structure, found)]
    joints = [key[1] for key in values if key[0] == "axis" and isinstance(key[1], int)]
    lines = {joint: (values["axis", joint], values["pos", joint]) for joint in joints}
    write_backlash(document, structure, found, lines)
    _write_frames(document, structure.assembly.platform, changed)
    _write_anchors(document, model, values, errors)
    close_keys(document, model, [move.origin for move in structure.driven], document.compiled())
    document.move_to(folder)
    return document.text, tuple(lost)


def measured_tool_mm(path: str | Path) -> np.ndarray | None:
    """Measured point (3,) on the platform of a file written by `to_mjcf`, None where it has none."""
    site = mujoco.MjSpec.from_file(str(path)).site(MEASURED_TOOL)
    return None if site is None else MM * np.array(site.pos)


def _numbers(structure: Structure, found: Found, twists: TwistsBySite) -> dict[_Key, np.ndarray]:
    """Placements (4, 4) and vectors (3,) of the file under twists by site, by what they are of, lengths in mm."""
    model = structure.assembly.model
    result: dict[_Key, np.ndarray] = {}
    changes = changes_of(structure, found, twists)
    for body, placements in changes.bodies.items():
        behind = np.eye(4)
        for k in range(len(placements) - 1, 0, -1):
            behind = placements[k] @ behind
            joint, turn = int(model.body_jntadr[body]) + k - 1, behind[:3, :3].T
            result["axis", joint] = turn @ model.jnt_axis[joint]
            result["pos", joint] = turn @ (MM * model.jnt_pos[joint] - behind[:3, 3])
        result["body", body] = structure.assembly.own(body) @ placements[0] @ behind
    for k, both in changes.anchors.items():
        result |= {("anchor", k, end): at for end, at in enumerate(both)}
    result |= {("frame", name): place for name, place in changes.frames.items()}
    return result


def _write_bodies(
    document: MjcfDocument, changed: Mapping[_Key, tuple[np.ndarray, np.ndarray]], nominal: Mapping[_Key, np.ndarray]
) -> None:
    """Write places of bodies, and axes and points of joints."""
    for key, (value, error) in changed.items():
        kind, number = key[:2]
        if isinstance(number, str):
            # a place on the platform, which `_write_frames` writes
            continue
        if kind == "body":
            element = document.bodies[number]
            turned = np.abs(difference(nominal[key], value)[3:]).max() > SAME
            names = ("pos", *_TURNS) if turned else ("pos",)
            was = " ".join(f'{name}="{element.get(name)}"' for name in names if name in element.attrib)
            document.note(element, f"corrected: {_error_text(error)}; was {was or 'no place'}")
            element.set("pos", words(value[:3, 3] / MM))
            if turned:
                for name in _TURNS:
                    element.attrib.pop(name, None)
                element.set("quat", words(quaternion(value[:3, :3])))
        elif kind in ("axis", "pos"):
            element, scale = document.joints[number], 1.0 if kind == "axis" else MM
            was = element.get(kind, "the default")
            document.note(element, f"corrected: {kind} +- {sizes(error / scale)}; was {was}")
            element.set(kind, words(value / scale))


def _error_text(error: np.ndarray) -> str:
    """Standard errors (6,) of a placement in words."""
    if not error.any():
        return "with frame and tool, whose errors it has"
    return f"pos +- {sizes(error[:3] / MM)} m, turn about own axes +- {sizes(error[3:])} rad"


def _write_frames(document: MjcfDocument, platform: int, changed: Mapping[_Key, tuple[np.ndarray, np.ndarray]]) -> None:
    """Write places on the platform as sites."""
    for key, (value, error) in changed.items():
        if isinstance(key[1], str):
            place = {"pos": words(value[:3, 3] / MM), "quat": words(quaternion(value[:3, :3]))}
            document.note(document.site(platform, key[1], place), f"found: {_error_text(error)}")


def _write_anchors(
    document: MjcfDocument, model: mujoco.MjModel, values: Mapping[_Key, np.ndarray], errors: Mapping[_Key, np.ndarray]
) -> None:
    """Write the anchors of connects and welds where the changed places of the bodies would move them."""
    now = document.compiled()
    for k, element in enumerate(document.equalities):
        kind = int(model.eq_type[k])
        if kind not in (int(_EQ.mjEQ_CONNECT), int(_EQ.mjEQ_WELD)):
            continue
        first, at_first, second, at_second = ends_of(model, k)
        _, now_first, _, now_second = ends_of(now, k)
        if kind == _EQ.mjEQ_WELD:
            if max(np.abs(now_first - at_first).max(), np.abs(now_second - at_second).max()) > SAME:
                element.set("anchor", words(model.eq_data[k, :3]))
                element.set("relpose", words(model.eq_data[k, 3:10]))
            continue
        wanted = [values.get(("anchor", k, end), at[:3, 3]) for end, at in enumerate((at_first, at_second))]
        if max(np.abs(now_first[:3, 3] - wanted[0]).max(), np.abs(now_second[:3, 3] - wanted[1]).max()) > SAME:
            _hold(document, (k, element), (first, second), wanted, errors)


def _hold(
    document: MjcfDocument,
    connect: tuple[int, Element],
    bodies: tuple[int, int],
    points: list[np.ndarray],
    errors: Mapping[_Key, np.ndarray],
) -> None:
    """Write a connect (number, element) between sites at points of two bodies."""
    k, element = connect
    name = element.get("name") or f"connect{k + 1}"
    for infer in ("body1", "body2", "anchor"):
        element.attrib.pop(infer, None)
    for end, (body, point) in enumerate(zip(bodies, points, strict=True)):
        site = element.get(f"site{end + 1}", f"{name}_{end + 1}")
        error = errors.get(("anchor", k, end), np.full(3, np.nan))
        document.note(document.site(body, site, {"pos": words(point / MM)}), f"corrected: pos +- {sizes(error / MM)} m")
        element.set(f"site{end + 1}", site)
