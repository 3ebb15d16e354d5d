"""Serial arms from their DH tables: one leg with every joint driven, by a drive of its own or by those of others.

Standard (Denavit and Hartenberg, J. Appl. Mech. 22, 1955) and modified (Craig, Introduction to Robotics, 1986) rows:

    T_i = Rz(theta) Tz(d) Tx(a) Rx(alpha)   or   T_i = Rx(alpha) Tx(a) Rz(theta) Tz(d)

Belts and rods couple joints to several drives: the joints' values are C q with a constant matrix C. Lengths in mm,
angles in rad.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from rrru.arrays import FloatArray
from rrru.errors import ConfigError
from rrru.kinematics.general_robot import GeneralRobot
from rrru.kinematics.inverse import end_of
from rrru.kinematics.legs import TOOL, WORLD, Drive, Joint, Leg, Legs, Parts, X, Z, turn_about, unit_twist
from rrru.kinematics.point_masses import PointMass

# keys of a row: of a joint, of a fixed frame
JOINT = ("a", "alpha", "d", "theta", "sliding", "name", "drives", "mass_kg", "com_mm")
FRAME = ("xyz_mm", "rpy_rad", "mass_kg", "com_mm")
# names of the sites that every arm has
_RESERVED_SITES = (WORLD, TOOL, "base", "flange")


def serial(
    rows: Sequence[Mapping[str, Any]],
    drive_range: npt.ArrayLike,
    home: npt.ArrayLike,
    modified: bool = False,
    tool_mm: Sequence[float] = (0.0, 0.0, 0.0),
    name: str = "arm",
    **options: Any,
) -> GeneralRobot:
    """The GeneralRobot of DH rows, mappings of a, d in mm and alpha, theta in rad; absent ones are 0.

    A row's joint turns by q + theta or, with sliding: true, slides by q + d. It is called `name`, by default "q" and
    the row's number, and has a drive of that name; with drives {name: factor} its value is the sum of these drives'
    times the factors, its own drive's only if it is among them. A row of xyz_mm, rpy_rad is a fixed frame, as a URDF's
    origin. mass_kg, com_mm: of the row's link, in its frame. drive_range (K, 2): of the drives' values q, home (K,):
    those of the home pose, in rad or mm. tool_mm (3,): measured point in the last frame. Columns: q1_rad or q1_mm, ...
    Raises ConfigError for an unknown key or drive.
    """
    links = _links(rows, modified, name)
    _require_unique(links, name)
    coupling = _coupling([link for link in links if link.name], name)
    joints, point_masses, drive_number = [Joint("base")], [], 0
    shift, turn = np.zeros(3), np.eye(3)
    for link in links:
        seat = Joint(link.site, link.kind, Z, shift + turn @ link.shift_mm, turn @ link.turn)
        joints.append(replace(seat, drive=drive_number) if link.name else seat)
        drive_number += bool(link.name)
        shift, turn = link.after
        if link.mass_kg:
            point_masses.append(PointMass(link.site, link.mass_kg, shift + turn @ np.asarray(link.com_mm)))
    leg = Leg("arm", (*joints, Joint("flange", "fixed", Z, shift, turn)))
    matrix = np.array(list(coupling.values())).T
    coupled = None if np.array_equal(matrix, np.eye(len(matrix))) else matrix
    legs = Legs((leg,), np.asarray(home, dtype=float), coupling=coupled)
    end = end_of(legs, leg, legs.home_drives[None])
    x, y, z = tool_mm
    return GeneralRobot(
        name=name,
        legs=replace(legs, home_mm=end.position_mm[0], home_turn=end.turn[0]),
        parts=_parts([link for link in links if link.name], coupling),
        drive_range=np.asarray(drive_range, dtype=float),
        tool_mm=(x, y, z),
        point_masses=tuple(point_masses),
        **{"up_stated": "up" in options} | options,
    )


@dataclass(frozen=True)
class _Link:
    """A row: its joint's frame in the frame before it, and `after` it a shift and a turn to the row's own frame.

    name: of its joint, empty for a fixed frame; drives: factors by drive.
    """

    site: str
    name: str
    kind: str
    shift_mm: FloatArray
    turn: FloatArray
    after: tuple[FloatArray, FloatArray]
    drives: dict[str, float]
    mass_kg: float = 0.0
    com_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def unit(self) -> str:
        """Unit of its joint's value."""
        return "mm" if self.kind == "P" else "rad"

    @property
    def twist(self) -> FloatArray:
        """Twist (6,) of a unit of its joint's value."""
        return unit_twist(2 if self.kind == "P" else 5)


def _links(rows: Sequence[Mapping[str, Any]], modified: bool, robot: str) -> list[_Link]:
    """The _Links of all rows."""
    result = []
    for number, row in enumerate(rows, 1):
        allowed = FRAME if "xyz_mm" in row or "rpy_rad" in row else JOINT
        if unknown := set(row) - set(allowed):
            raise ConfigError(f"{robot}: row {number} has {unknown.pop()!r}; allowed: {', '.join(allowed)}")
        mass = {key: row[key] for key in ("mass_kg", "com_mm") if key in row}
        if allowed is FRAME:
            turn = Rotation.from_euler("xyz", row.get("rpy_rad", (0.0, 0.0, 0.0))).as_matrix()
            shift, identity = np.asarray(row.get("xyz_mm", (0.0, 0.0, 0.0)), dtype=float), (np.zeros(3), np.eye(3))
            result.append(_Link(f"frame {number}", "", "fixed", shift, turn, identity, {}, **mass))
            continue
        link_offset, joint_turn = row.get("d", 0.0) * Z, turn_about(Z, row.get("theta", 0.0))
        link_length, link_twist = row.get("a", 0.0) * X, turn_about(X, row.get("alpha", 0.0))
        places = (np.zeros(3), joint_turn, (link_offset + link_length, link_twist))
        if modified:
            places = link_length, link_twist @ joint_turn, (link_offset, np.eye(3))
        name = row.get("name", f"q{number}")
        kind = "P" if row.get("sliding") else "R"
        site = row.get("name", f"joint {number}")
        result.append(_Link(site, name, kind, *places, dict(row.get("drives", {name: 1.0})), **mass))
    return result


def _require_unique(links: Sequence[_Link], robot: str) -> None:
    """Raise ConfigError where two joints, or two sites, have one name."""
    joints = [*_RESERVED_SITES, *(link.name for link in links if link.name)]
    sites = [*_RESERVED_SITES, *(link.site for link in links)]
    for names in (joints, sites):
        if len(set(names)) < len(names):
            duplicate = max(names, key=names.count)
            raise ConfigError(f"{robot}: two joints or frames are called {duplicate!r}; allowed: names of their own")


def _coupling(joints: Sequence[_Link], robot: str) -> dict[str, FloatArray]:
    """Columns (D,) of the coupling by drive, in the order of the joints that have a drive of their own."""
    drives = [link.name for link in joints if link.name in link.drives]
    if not drives:
        raise ConfigError(f"{robot}: no row has a drive of its own; allowed: one or more")
    for link in joints:
        for drive, factor in link.drives.items():
            if drive not in drives:
                known = "joints with drives of their own, " + ", ".join(drives)
                raise ConfigError(f"{robot}: joint {link.name} follows {drive!r}; allowed: {known}")
            if not np.isfinite(factor) or factor == 0.0:
                raise ConfigError(f"{robot}: joint {link.name} follows {drive} times {factor}; allowed: not 0")
    return {drive: np.array([link.drives.get(drive, 0.0) for link in joints]) for drive in drives}


def _parts(joints: Sequence[_Link], coupling: Mapping[str, FloatArray]) -> Parts:
    """The Parts: drives, each with its own joint and the joints that follow it, and followers without drives."""
    result = []
    for drive, column in coupling.items():
        driven = next(link for link in joints if link.name == drive)
        twists = {link.site: factor * link.twist for link, factor in zip(joints, column, strict=True) if factor}
        result.append(Drive(f"{drive}_{driven.unit}", driven.unit, driven.site, twists.pop(driven.site), twists))
    followers = [Drive(f"{j.name}_{j.unit}", j.unit, j.site, j.twist) for j in joints if j.name not in j.drives]
    return Parts(drives=tuple(result), followers=tuple(followers))
