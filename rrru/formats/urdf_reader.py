"""A URDF as MuJoCo's parser reads it, for `rrru.formats.robot_file`.

Shapes are left out, which a robot's motion does not need. Fixed links stay, since base and tip are often fixed ones.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias
from xml.etree import ElementTree

import mujoco
import numpy as np

from rrru.errors import ConfigError

# the least mass that MuJoCo asks of a body that moves; a link without one gets it, and counts as none
NO_MASS_KG = 1e-12
_ALLOWED = ("revolute", "continuous", "prismatic", "fixed")

# name of the joint that one follows, None where the file has none, factor and offset
Mimic: TypeAlias = tuple[str | None, float, float]


@dataclass(frozen=True)
class Urdf:
    """A compiled URDF.

    children: links by their parent; parents: link by its child; odd: by child link what is wrong with its joint;
    mimics: by joint's name the joint that it follows, factor and offset; limits: by joint's name its effort in N m or N
    and its velocity in rad/s or m/s, NaN where none above zero is stated.
    """

    model: mujoco.MjModel
    children: dict[str, list[str]]
    parents: dict[str, str]
    odd: dict[str, str]
    mimics: dict[str, Mimic]
    limits: dict[str, tuple[float, float]]


def read(file: Path) -> Urdf:
    """The Urdf of a file; raises ConfigError with the parser's message."""
    try:
        robot = ElementTree.parse(file).getroot()
    except ElementTree.ParseError as error:
        raise ConfigError(f"{file}: {error}; allowed: a URDF") from None
    if robot.tag != "robot" or any("xacro" in element.tag for element in robot.iter()):
        raise ConfigError(f"{file}: its root is {robot.tag!r}; allowed: a URDF's robot, without xacro's macros")
    children: dict[str, list[str]] = {}
    parents: dict[str, str] = {}
    odd: dict[str, str] = {}
    mimics: dict[str, Mimic] = {}
    limits: dict[str, tuple[float, float]] = {}
    for link in robot.iter("link"):
        children.setdefault(link.get("name", ""), [])
        for shape in (*link.findall("visual"), *link.findall("collision")):
            link.remove(shape)
    if not children:
        raise ConfigError(f"{file}: it has no link; allowed: a URDF with links and joints")
    for joint in robot.findall("joint"):
        # MuJoCo refuses what has no name, parent or child
        name, parent, child = joint.get("name", ""), *(_link(joint, end) for end in ("parent", "child"))
        children.setdefault(parent, []).append(child)
        parents[child] = parent
        if joint.get("type") not in _ALLOWED:
            odd[child] = f"joint {name} is of the type {joint.get('type')}; allowed: {', '.join(_ALLOWED)}"
        limits[name] = _limits(joint)
        followed = joint.findall("mimic")
        if len(followed) > 1:
            another = "a joint of its own on the same axis for each of the others"
            odd[child] = f"joint {name} has {len(followed)} elements mimic; allowed: one, and {another}"
        for mimic in followed:
            factor, offset = _numbers(joint, mimic, file)
            mimics[name] = mimic.get("joint"), factor, offset
            joint.remove(mimic)
    return Urdf(
        _compiled(ElementTree.tostring(robot, encoding="unicode"), file), children, parents, odd, mimics, limits
    )


def _link(joint: ElementTree.Element, end: str) -> str:
    """Name of the link at an end of a joint, "" where there is none."""
    found = joint.find(end)
    return "" if found is None else found.get("link", "")


def _limits(joint: ElementTree.Element) -> tuple[float, float]:
    """Effort and velocity of a joint's limit, NaN where none is stated; files write 0 for an unknown limit."""
    limit = joint.find("limit")
    if limit is None:
        return np.nan, np.nan
    return _limit(limit.get("effort", "")), _limit(limit.get("velocity", ""))


def _limit(text: str) -> float:
    """A limit above zero, NaN for any other text."""
    try:
        value = float(text)
    except ValueError:
        return np.nan
    return value if 0.0 < value < np.inf else np.nan


def _numbers(joint: ElementTree.Element, mimic: ElementTree.Element, file: Path) -> Iterator[float]:
    """Factor and offset of a mimic."""
    given = {key: mimic.get(key, default) for key, default in (("multiplier", "1"), ("offset", "0"))}
    for key, text in given.items():
        try:
            yield float(text)
        except ValueError:
            text = f"the {key} of joint {joint.get('name')}'s mimic is {text!r}"
            raise ConfigError(f"{file}: {text}; allowed: a number") from None


def _compiled(text: str, file: Path) -> mujoco.MjModel:
    """The MjModel of a URDF's text."""
    try:
        spec = mujoco.MjSpec.from_string(text)
        spec.compiler.fusestatic = False
        spec.compiler.boundmass = spec.compiler.boundinertia = NO_MASS_KG
        return spec.compile()
    except ValueError as error:
        raise ConfigError(f"{file}: {' '.join(str(error).split())}; allowed: a URDF") from None


def ends(urdf: Urdf, base: str | None, tip: str | None, file: Path) -> tuple[str, str]:
    """Names of base and tip, by default the root link and the only link without children behind the base."""
    known = ", ".join(urdf.children)
    for what, name in (("base", base), ("tip", tip)):
        if name is not None and name not in urdf.children:
            raise ConfigError(f"{file}: {what} is {name!r}; allowed: {known}")
    base = base or next(link for link in urdf.children if link not in urdf.parents)
    if tip:
        return base, tip
    leaves = [link for link in _behind(urdf, base) if not urdf.children[link]]
    if len(leaves) != 1:
        what = "state as `tip` (--tip) the link that carries the measured point"
        raise ConfigError(f"{file}: no tip is given; allowed: one of {', '.join(leaves)}; {what}")
    return base, leaves[0]


def _behind(urdf: Urdf, link: str) -> list[str]:
    """A link and all behind it."""
    return [link, *(other for child in urdf.children[link] for other in _behind(urdf, child))]
