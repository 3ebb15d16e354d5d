"""A URDF as MuJoCo's parser reads it, for `rrru.formats.robot_file`.

Shapes are left out, which a robot's motion does not need. Fixed links stay, since base and tip are often fixed ones.
"""

from dataclasses import dataclass
from xml.etree import ElementTree

import mujoco
import numpy as np

from rrru.errors import ConfigError

# the least mass that MuJoCo asks of a body that moves; a link without one gets it, and counts as none
NO_MASS_KG = 1e-12
_ENDS = ("parent", "child")
_ALLOWED = ("revolute", "continuous", "prismatic", "fixed")


@dataclass(frozen=True)
class Urdf:
    """A compiled URDF.

    children: links by their parent; parents: link by its child; odd: by child link what is wrong with its joint;
    mimics: by joint's name the joint that it follows, factor and offset; limits: by joint's name its effort in N m or N
    and its velocity in rad/s or m/s, NaN where none above zero is stated.
    """

    model: mujoco.MjModel
    children: dict
    parents: dict
    odd: dict
    mimics: dict
    limits: dict


def read(file):
    """The Urdf of a file; raises ConfigError with the parser's message."""
    try:
        robot = ElementTree.parse(file).getroot()
    except ElementTree.ParseError as error:
        raise ConfigError(f"{file}: {error}; allowed: a URDF") from None
    if robot.tag != "robot" or any("xacro" in element.tag for element in robot.iter()):
        raise ConfigError(f"{file}: its root is {robot.tag!r}; allowed: a URDF's robot, without xacro's macros")
    children, parents, odd, mimics, limits = {}, {}, {}, {}, {}
    for link in robot.iter("link"):
        children.setdefault(link.get("name"), [])
        for shape in (*link.findall("visual"), *link.findall("collision")):
            link.remove(shape)
    for joint in robot.findall("joint"):
        parent, child = (joint.find(end).get("link") if joint.find(end) is not None else None for end in _ENDS)
        children.setdefault(parent, []).append(child)
        parents[child] = parent
        if joint.get("type") not in _ALLOWED:
            odd[child] = f"joint {joint.get('name')} is of the type {joint.get('type')}; allowed: {', '.join(_ALLOWED)}"
        limits[joint.get("name")] = _limits(joint)
        for mimic in joint.findall("mimic"):
            mimics[joint.get("name")] = mimic.get("joint"), *_numbers(joint, mimic, file)
            joint.remove(mimic)
    return Urdf(
        _compiled(ElementTree.tostring(robot, encoding="unicode"), file), children, parents, odd, mimics, limits
    )


def _limits(joint):
    """Effort and velocity of a joint's limit, NaN where none is stated; files write 0 for an unknown limit."""
    limit, result = joint.find("limit"), []
    for key in ("effort", "velocity"):
        try:
            value = float(limit.get(key)) if limit is not None and limit.get(key) else np.nan
        except ValueError:
            value = np.nan
        result.append(value if 0.0 < value < np.inf else np.nan)
    return tuple(result)


def _numbers(joint, mimic, file):
    """Factor and offset of a mimic."""
    given = {key: mimic.get(key, default) for key, default in (("multiplier", "1"), ("offset", "0"))}
    for key, text in given.items():
        try:
            yield float(text)
        except ValueError:
            text = f"the {key} of joint {joint.get('name')}'s mimic is {text!r}"
            raise ConfigError(f"{file}: {text}; allowed: a number") from None


def _compiled(text, file):
    """The MjModel of a URDF's text."""
    try:
        spec = mujoco.MjSpec.from_string(text)
        spec.compiler.fusestatic = False
        spec.compiler.boundmass = spec.compiler.boundinertia = NO_MASS_KG
        return spec.compile()
    except ValueError as error:
        raise ConfigError(f"{file}: {' '.join(str(error).split())}; allowed: a URDF") from None


def ends(urdf, base, tip, file):
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
        raise ConfigError(f"{file}: no tip is given; allowed: one of {', '.join(leaves)}")
    return base, leaves[0]


def _behind(urdf, link):
    """A link and all behind it."""
    return [link, *(other for child in urdf.children[link] for other in _behind(urdf, child))]
