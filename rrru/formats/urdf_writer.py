"""A URDF with the results of a diagnosis: the origins of its robot's joints, and frames on its tip.

Names and comments of the user's file stay, and each changed number has its standard error in a comment. A URDF cannot
represent stiffness and backlash of drives. Lengths in mm and angles in rad, m in the file.
"""

import os
from collections.abc import Mapping
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from rrru.formats.file_changes import SAME, Found, TwistsBySite, changes_of, difference, scatter
from rrru.formats.mjcf_reader import MM
from rrru.formats.robot_file import urdf_parts
from rrru.formats.structure import Structure, structure_of
from rrru.formats.xml_text import Document, child, roll_pitch_yaw, sizes, words


def to_urdf(
    path: str | Path,
    found: Found,
    folder: Path,
    base: str | None = None,
    tip: str | None = None,
    home: Mapping[str, float] | None = None,
) -> tuple[str, tuple[str, ...]]:
    """The text of a URDF with the Found of its robot, for a file in a folder, and what it cannot represent, in words.

    base, tip, home: as of `rrru.formats.robot_file.from_urdf`.
    """
    structure = structure_of(*urdf_parts(path, base, tip, home))
    document, assembly = Document(structure.assembly.file), structure.assembly

    def numbers(twists: TwistsBySite) -> dict[tuple[str, str], np.ndarray]:
        return _numbers(structure, found, twists)

    values, nominal = numbers(found.twists), numbers({})
    errors = scatter(numbers, found.twists, found.spread)
    joints = {child(joint, "child").get("link", ""): joint for joint in document.root.findall("joint")}
    for key, value in values.items():
        error = errors.get(key, np.full(6, np.nan))
        kind, name = key
        change = np.full(6, np.inf) if kind == "frame" else np.abs(difference(nominal[key], value))
        if change.max() <= SAME:
            continue
        if kind == "origin":
            _write_origin(document, joints[name], value, error, change[3:].max() > SAME)
        elif kind == "behind":
            _write_behind(document, joints[name], name, (value, error))
        else:
            body = assembly.body_name(assembly.platform)
            _write_frame(document, (body, name.replace(" ", "_")), value, f"found: {_error_text(error)}")
    _find_meshes(document.root, assembly.file.resolve().parent, folder)
    lost = list(changes_of(structure, found, found.twists).lost)
    for what, by_drive in (("compliance", found.compliance), ("backlash", found.play)):
        drives = [structure.driven[number].origin for number, (value, _) in by_drive.items() if value > 0.0]
        lost += [f"{what} of {', '.join(drives)}"] if drives else []
    return document.text, tuple(lost)


def _numbers(structure: Structure, found: Found, twists: TwistsBySite) -> dict[tuple[str, str], np.ndarray]:
    """Placements (4, 4) of the file under twists by site, by what they are of."""
    result, changes, assembly = {}, changes_of(structure, found, twists), structure.assembly
    for body, placements in changes.bodies.items():
        link = assembly.body_name(body)
        result["origin", link] = assembly.own(body) @ placements[0]
        if len(placements) > 1:
            result["behind", link] = placements[1]
    return result | {("frame", name): place for name, place in changes.frames.items()}


def _error_text(error: np.ndarray) -> str:
    """Standard errors (6,) of a placement in words."""
    if not error.any():
        return "with frame and tool, whose errors it has"
    return f"xyz +- {sizes(error[:3] / MM)} m, turn about own axes +- {sizes(error[3:])} rad"


def _write_origin(document: Document, joint: Element, placement: np.ndarray, error: np.ndarray, turned: bool) -> None:
    """Write the origin of a joint, its turn only where that has changed."""
    origin = _origin(document, joint)
    was = " ".join(f'{name}="{value}"' for name, value in origin.attrib.items())
    document.note(joint, f"corrected: {_error_text(error)}; was {was or 'no origin'}")
    origin.set("xyz", _xyz(placement))
    if turned:
        origin.set("rpy", _rpy(placement))


def _origin(document: Document, joint: Element) -> Element:
    """The origin of a joint, a new one without numbers where it has none."""
    found = joint.find("origin")
    return document.behind(child(joint, "child"), "origin", {}) if found is None else found


def _xyz(placement: np.ndarray) -> str:
    """The xyz of an origin."""
    return words(placement[:3, 3] / MM)


def _rpy(placement: np.ndarray) -> str:
    """The rpy of an origin."""
    return words(roll_pitch_yaw(placement[:3, :3]))


def _write_behind(document: Document, joint: Element, link: str, seat_error: tuple[np.ndarray, np.ndarray]) -> None:
    """Write a link between a joint and the link that it moved, for an error behind its motion.

    seat_error: placement (4, 4) and its standard errors (6,).
    """
    placement, error = seat_error
    child(joint, "child").set("link", f"{link}_seat")
    seat = document.behind(joint, "link", {"name": f"{link}_seat"})
    _write_fixed(document, seat, (f"{link}_seat", link), placement)
    document.note(seat, f"corrected: {_error_text(error)}")


def _write_frame(document: Document, links: tuple[str, str], placement: np.ndarray, text: str) -> None:
    """Write a link that stands at a place on another one, or change its place where it is there already."""
    for joint in document.root.findall("joint"):
        if joint.get("name") == f"{links[1]}_mount":
            _origin(document, joint).attrib |= {"xyz": _xyz(placement), "rpy": _rpy(placement)}
            document.note(joint, text)
            return
    link = document.inside(document.root, "link", {"name": links[1]})
    _write_fixed(document, link, links, placement)
    document.note(link, text)


def _write_fixed(document: Document, behind: Element, links: tuple[str, str], placement: np.ndarray) -> None:
    """Write a fixed joint between two links."""
    joint = document.behind(behind, "joint", {"name": f"{links[1]}_mount", "type": "fixed"})
    document.inside(joint, "parent", {"link": links[0]})
    document.inside(joint, "child", {"link": links[1]})
    document.inside(joint, "origin", {"xyz": _xyz(placement), "rpy": _rpy(placement)})


def _find_meshes(root: Element, source: Path, folder: Path) -> None:
    """Change relative names of meshes and textures in the old file to names relative to a folder.

    Names of other files, such as the shared libraries of a simulator's plugins, are not relative to it.
    """
    for mesh in root.iter():
        name = mesh.get("filename") if mesh.tag in ("mesh", "texture") else None
        if name and "://" not in name and not Path(name).is_absolute():
            mesh.set("filename", os.path.relpath(source / name, folder))
