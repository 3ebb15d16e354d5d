"""Own robots by plain NumPy, and as URDF and MJCF: chains of joints, and platforms on six rods. mm, rad, kg, N.

The code follows textbook formulas: a chain is a product of a seat and a motion for every joint; loads are minus the
derivative of the potential energy by the drive's position. A rod runs from a ball on its drive to one on the platform
and keeps its length:

    |p + R b_i - a_i(q)| = l_i(q),   i = 1 .. 6

a_i moves on a crank or a rail, or is fixed where the rod itself is the drive. Newton's method on these six equations
gives the pose. All of it is independent of the package's models, so that it can check them. Files are in m.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

G = 9.80665
# steps of central differences, in the unit of the drive
_STEP = {"mm": 1e-2, "rad": 1e-5}
_SERVO = {"rad": "1e8", "mm": "1e8"}
_DAMPING = {"rad": "4e4", "mm": "2e4"}
_ARMATURE = {"rad": "5", "mm": "5"}
_NEWTON_STEPS, _MAX_OPENING_MM = 30, 1e-9
_REGULARIZATION, _LARGEST_STEP = 1e-12, np.repeat([100.0, 0.3], 3)
# struts: centre of the cylinder from its foot, of the piston from its ball; length of the piston
_CYLINDER_MM, _PISTON_MM, _ROD_MM = 120.0, 120.0, 250.0


class OwnRobot:
    """What chains and platforms on rods share; names, units: of the drives."""

    @property
    def columns(self):
        """Columns of its actuator positions in a file."""
        return tuple(f"{name}_{unit}" for name, unit in zip(self.names, self.units, strict=True))

    def loads(self, values, payload_kg):
        """Torques in N mm or forces in N (n, K) on the drives from all weight, with payloads (n,) at the platform."""
        result = np.empty_like(values)
        for k, unit in enumerate(self.units):
            step = _STEP[unit] * np.eye(len(self.units))[k]
            change = self._energy(values - step, payload_kg) - self._energy(values + step, payload_kg)
            result[:, k] = change / (2.0 * _STEP[unit])
        return result


@dataclass(frozen=True)
class Joint:
    """A joint and the link behind it.

    unit: "rad" where it rotates about its axis (3,), "mm" where it slides along it; seat_mm (3,), seat_rad (3,): place
    and rotation vector in the link before; span: least and largest value that is driven; mass_kg, centre_mm (3,): of
    the link.
    """

    name: str
    unit: str
    axis: tuple
    seat_mm: tuple
    span: tuple
    seat_rad: tuple = (0.0, 0.0, 0.0)
    mass_kg: float = 1.0
    centre_mm: tuple = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Chain(OwnRobot):
    """Joints from the base to the platform; tip_mm, tip_rad (3,): of the platform in the last link."""

    joints: tuple
    tip_mm: tuple = (0.0, 0.0, 0.0)
    tip_rad: tuple = (0.0, 0.0, 0.0)
    formats = ("urdf", "mjcf")

    @property
    def units(self):
        """Units of its drives."""
        return tuple(joint.unit for joint in self.joints)

    @property
    def names(self):
        """Names of its drives."""
        return [joint.name for joint in self.joints]

    @property
    def spans(self):
        """Least and largest values (K, 2) of its drives."""
        return np.array([joint.span for joint in self.joints])

    @property
    def places(self):
        """Places in its MJCF that have errors in the robot as built."""
        return [f"{joint.name}_link.{way}" for joint in self.joints for way in ("x", "y", "z", "rx", "ry", "rz")]

    def poses(self, values):
        """Positions (n, 3) and rotations (n, 3, 3) of the platform at actuator positions (n, K)."""
        *_, (place, turn) = self._links(values)
        return place + turn @ np.array(self.tip_mm), turn @ Rotation.from_rotvec(self.tip_rad).as_matrix()

    def _energy(self, values, payload_kg):
        """Potential energy (n,) in N mm."""
        energy = G * payload_kg * self.poses(values)[0][:, 2]
        for joint, (place, turn) in zip(self.joints, self._links(values), strict=True):
            energy = energy + G * joint.mass_kg * (place + turn @ np.array(joint.centre_mm))[:, 2]
        return energy

    def _links(self, values):
        """Place (n, 3) and rotation (n, 3, 3) of every link."""
        count = len(values)
        place, turn = np.zeros((count, 3)), np.tile(np.eye(3), (count, 1, 1))
        for joint, value in zip(self.joints, np.asarray(values, dtype=float).T, strict=True):
            place = place + turn @ np.array(joint.seat_mm)
            turn = turn @ Rotation.from_rotvec(joint.seat_rad).as_matrix()
            along = np.outer(value, joint.axis)
            if joint.unit == "mm":
                place = place + (turn @ along[:, :, None])[:, :, 0]
            else:
                turn = turn @ Rotation.from_rotvec(along).as_matrix()
            yield place, turn

    def built(self, generator, length_mm, angle_rad):
        """The chain as built: every seat and the tip have normal errors of these sizes.

        Errors along the motion of the joint itself or of the one before are left out: they are zero offsets.
        """
        joints, before = [], ()
        for joint in self.joints:
            shift = length_mm * generator.standard_normal(3) * _free_directions("mm", joint, *before)
            turn = angle_rad * generator.standard_normal(3) * _free_directions("rad", joint, *before)
            seat = tuple((np.array(joint.seat_mm) + shift).tolist())
            joints.append(replace(joint, seat_mm=seat, seat_rad=_composed_rotation(joint.seat_rad, turn)))
            before = (joint,)
        tip = np.array(self.tip_mm) + length_mm * generator.standard_normal(3) * _free_directions("mm", *before)
        return replace(self, joints=tuple(joints), tip_mm=tuple(tip.tolist()))

    def section(self, file, kind):
        """Its entry in `robots:` as a file of a kind."""
        return {"urdf": file, "base": "base", "tip": "tool"} if kind == "urdf" else {"mjcf": file, "platform": "tool"}

    def text(self, kind):
        """Its file, "urdf" or "mjcf"."""
        return self._urdf() if kind == "urdf" else self._mjcf()

    def _urdf(self):
        """The URDF: base, a link for every joint, and the tool."""
        lines, before = ['<robot name="own">', '  <link name="base"/>'], "base"
        for joint in self.joints:
            link, (low, high) = f"{joint.name}_link", np.array(joint.span) * file_scale(joint.unit)
            inertia = "".join(f' {name}="{0.01 * joint.mass_kg:.9g}"' for name in ("ixx", "iyy", "izz"))
            lines += [
                f'  <link name="{link}"><inertial><origin xyz="{_metres(joint.centre_mm)}"/>'
                f'<mass value="{joint.mass_kg:.9g}"/><inertia{inertia} ixy="0" ixz="0" iyz="0"/></inertial></link>',
                f'  <joint name="{joint.name}" type="{"revolute" if joint.unit == "rad" else "prismatic"}">',
                f'    <parent link="{before}"/><child link="{link}"/>',
                f'    <origin xyz="{_metres(joint.seat_mm)}" rpy="{_rpy(joint.seat_rad)}"/>',
                f'    <axis xyz="{_spaced(joint.axis)}"/>',
                f'    <limit lower="{low:.9g}" upper="{high:.9g}" effort="100" velocity="1"/>',
                "  </joint>",
            ]
            before = link
        lines += [
            '  <link name="tool"/>',
            '  <joint name="flange" type="fixed">',
            f'    <parent link="{before}"/><child link="tool"/>',
            f'    <origin xyz="{_metres(self.tip_mm)}" rpy="{_rpy(self.tip_rad)}"/>',
            "  </joint>",
            "</robot>",
        ]
        return "\n".join(lines) + "\n"

    def _mjcf(self):
        """The MJCF: nested bodies with stiff position servos."""
        lines, servos = [], []
        for depth, joint in enumerate(self.joints):
            pad, (low, high) = "  " * (depth + 2), np.array(joint.span) * file_scale(joint.unit)
            kind = "hinge" if joint.unit == "rad" else "slide"
            inertia = _spaced([0.01 * joint.mass_kg] * 3)
            lines += [
                f'{pad}<body name="{joint.name}_link" pos="{_metres(joint.seat_mm)}" quat="{_quat(joint.seat_rad)}">',
                f'{pad}  <joint name="{joint.name}" type="{kind}" axis="{_spaced(joint.axis)}" '
                f'range="{low:.9g} {high:.9g}" armature="{_ARMATURE[joint.unit]}" damping="1"/>',
                f'{pad}  <inertial pos="{_metres(joint.centre_mm)}" mass="{joint.mass_kg:.9g}" '
                f'diaginertia="{inertia}"/>',
            ]
            servos.append(_servo_line(joint.name, joint.unit))
        pad = "  " * (len(self.joints) + 2)
        lines.append(f'{pad}<body name="tool" pos="{_metres(self.tip_mm)}" quat="{_quat(self.tip_rad)}"/>')
        lines += ["  " * (depth + 2) + "</body>" for depth in reversed(range(len(self.joints)))]
        return _mjcf_text(lines, [], servos)


@dataclass(frozen=True)
class Rods(OwnRobot):
    """A platform on six rods.

    kind: strut (the rod is the drive), rail or crank; drive (6,): number of each rod's drive; foot_mm (6, 3): its ball
    at actuator positions of 0, of a strut its base; axis (6, 3): of the rail or crank; pivot_mm (6, 3): a point on the
    crank's axis; head_mm (6, 3): its ball on the platform; home_mm (3,): the platform at actuator positions of 0, not
    rotated; span: least and largest actuator position; masses_kg: platform, part moved by the drive, rod; extra_mm
    (6,): length of each rod beyond that at home.
    """

    kind: str
    drive: tuple
    foot_mm: np.ndarray
    axis: np.ndarray
    pivot_mm: np.ndarray
    head_mm: np.ndarray
    home_mm: np.ndarray
    span: tuple
    masses_kg: tuple
    extra_mm: np.ndarray = 0.0
    formats = ("mjcf",)

    @property
    def unit(self):
        """Unit of its drives."""
        return "rad" if self.kind == "crank" else "mm"

    @property
    def units(self):
        """Units of its drives."""
        return (self.unit,) * (max(self.drive) + 1)

    @property
    def spans(self):
        """Least and largest values (K, 2) of its drives."""
        return np.tile(self.span, (len(self.units), 1))

    @property
    def names(self):
        """Names of its drives."""
        return [f"leg{k + 1}" for k in range(len(self.units))]

    @property
    def places(self):
        """Places in its MJCF with errors as built: bases of struts, and balls of platforms that rotate."""
        if len(self.units) == 3:
            return [f"{name}_drive.{way}" for name in self.names for way in "xyz"]
        body = "cylinder" if self.kind == "strut" else "drive"
        return [f"{name}_{part}.{way}" for name in self.names for part in (body, "ball") for way in "xyz"]

    def poses(self, values):
        """Positions (n, 3) and rotations (n, 3, 3) of the platform at actuator positions (n, K), NaN without one."""
        values = np.asarray(values, dtype=float)
        foot, length = self._feet(values), self._lengths(values)
        place, turn = np.tile(self.home_mm, (len(values), 1)), np.tile(np.eye(3), (len(values), 1, 1))
        for _ in range(_NEWTON_STEPS):
            lever = turn @ self.head_mm.T
            rod = place[:, :, None] + lever - foot.transpose(0, 2, 1)
            size = np.linalg.norm(rod, axis=1)
            along = (rod / size[:, None, :]).transpose(0, 2, 1)
            jacobian = np.concatenate([along, np.cross(lever.transpose(0, 2, 1), along)], axis=2)
            # a pose that diverges is not closed at the end
            step = np.linalg.solve(jacobian + _REGULARIZATION * np.eye(6), (length - size)[:, :, None])[:, :, 0]
            step = np.clip(step, -_LARGEST_STEP, _LARGEST_STEP)
            place = place + step[:, :3]
            turn = Rotation.from_rotvec(step[:, 3:]).as_matrix() @ turn
            if np.abs(length - size).max() < _MAX_OPENING_MM:
                break
        lost = ~(np.abs(length - size).max(axis=1) < _MAX_OPENING_MM)
        place[lost], turn[lost] = np.nan, np.nan
        return place, turn

    def _energy(self, values, payload_kg):
        """Potential energy (n,) in N mm."""
        place, turn = self.poses(values)
        head = place[:, None, :] + (turn @ self.head_mm.T).transpose(0, 2, 1)
        platform_kg, moved_kg, rod_kg = self.masses_kg
        foot = self._feet(values)
        height = (platform_kg + payload_kg) * place[:, 2]
        first = [self.drive.index(k) for k in range(len(self.units))]
        if self.kind == "strut":
            # the piston has its centre at a fixed distance behind its ball
            behind = (head - foot) / np.linalg.norm(head - foot, axis=2, keepdims=True)
            height = height + rod_kg * (head - _PISTON_MM * behind)[:, :, 2].sum(axis=1)
            height = height + moved_kg * (foot + _CYLINDER_MM * behind)[:, :, 2].sum(axis=1)
            return G * height
        height = height + rod_kg * (0.5 * (foot + head))[:, :, 2].sum(axis=1)
        # a crank has its centre halfway between its axis, which does not move, and its ball
        moved_share = 1.0 if self.kind == "rail" else 0.5
        return G * (height + moved_share * moved_kg * foot[:, first, 2].sum(axis=1))

    def _feet(self, values):
        """Balls (n, 6, 3) on the drives."""
        position = values[:, list(self.drive)]
        if self.kind == "strut":
            return np.tile(self.foot_mm, (len(values), 1, 1))
        if self.kind == "rail":
            return self.foot_mm + position[:, :, None] * self.axis
        turned = (
            Rotation.from_rotvec((position[:, :, None] * self.axis).reshape(-1, 3)).as_matrix().reshape(-1, 6, 3, 3)
        )
        arm = self.foot_mm - self.pivot_mm
        return self.pivot_mm + (turned @ arm[:, :, None])[:, :, :, 0]

    def _lengths(self, values):
        """Lengths (n, 6) of the rods."""
        home = np.linalg.norm(self.home_mm + self.head_mm - self.foot_mm, axis=1) + self.extra_mm
        return home + (values[:, list(self.drive)] if self.kind == "strut" else np.zeros((len(values), 6)))

    def built(self, generator, length_mm, angle_rad):
        """The robot as built: balls, rods and axes have normal errors of these sizes.

        Errors along the motion of the drives are left out: they are zero offsets.
        """
        nominal = np.linalg.norm(self.home_mm + self.head_mm - self.foot_mm, axis=1)
        foot, head = (points + length_mm * generator.standard_normal((6, 3)) for points in (self.foot_mm, self.head_mm))
        if len(self.units) == 3:
            # paired rods of a delta stay parallel, otherwise its platform rotates
            foot, head = (
                np.repeat(points[::2] - nominal_points[::2], 2, axis=0) + nominal_points
                for points, nominal_points in ((foot, self.foot_mm), (head, self.head_mm))
            )
        shift, way = foot - self.foot_mm, self._drive_directions()
        foot = self.foot_mm + (shift - (shift * way).sum(axis=1, keepdims=True) * way)
        # an error of a strut's length is a zero offset
        extra = length_mm * generator.standard_normal(6) * (self.kind != "strut")
        extra = np.repeat(extra[::2], 2) if len(self.units) == 3 else extra
        axis = self.axis + angle_rad * generator.standard_normal((6, 3))
        axis = np.repeat(axis[[self.drive.index(k) for k in range(len(self.units))]], 6 // len(self.units), axis=0)
        axis = axis / np.linalg.norm(axis, axis=1, keepdims=True) if self.kind != "strut" else self.axis
        moved = np.linalg.norm(self.home_mm + head - foot, axis=1)
        return replace(self, foot_mm=foot, head_mm=head, axis=axis, extra_mm=nominal - moved + extra)

    def _drive_directions(self):
        """Unit vectors (6, 3) along which the drives move the balls at actuator positions of 0, zero where fixed."""
        if self.kind == "strut":
            return np.zeros((6, 3))
        way = self.axis if self.kind == "rail" else np.cross(self.axis, self.foot_mm - self.pivot_mm)
        return way / np.linalg.norm(way, axis=1, keepdims=True)

    def section(self, file, kind):
        """Its entry in `robots:` as a file of a kind."""
        return {kind: file, "platform": "plate"}

    def text(self, kind):
        """Its MJCF."""
        del kind
        platform_kg, moved_kg, rod_kg = self.masses_kg
        bodies = [
            f'    <body name="plate" pos="{_metres(self.home_mm)}">',
            '      <freejoint name="plate_free"/>',
            f'      <inertial pos="0 0 0" mass="{platform_kg:.9g}" diaginertia="0.04 0.04 0.08"/>',
            "    </body>",
        ]
        equalities = []
        for k, name in enumerate(self.names):
            mine = [rod for rod, drive in enumerate(self.drive) if drive == k]
            bodies += self._leg(name, mine, (moved_kg, rod_kg))
            equalities += [
                f'    <connect name="{self._rod_name(name, mine, rod)}_ball" body1="plate" '
                f'body2="{self._end(name, mine, rod)}" anchor="{_metres(self.head_mm[rod])}"/>'
                for rod in mine
            ]
        return _mjcf_text(bodies, equalities, [_servo_line(name, self.unit) for name in self.names])

    @staticmethod
    def _rod_name(name, mine, rod):
        """Name of a leg's rod."""
        return name if len(mine) == 1 else f"{name}{'ab'[mine.index(rod)]}"

    def _end(self, name, mine, rod):
        """Name of the body that holds the platform."""
        return f"{name}_piston" if self.kind == "strut" else f"{self._rod_name(name, mine, rod)}_rod"

    def _leg(self, name, mine, masses_kg):
        """Lines of the bodies of a leg."""
        moved_kg, rod_kg = masses_kg
        low, high = np.array(self.span) * file_scale(self.unit)
        first, inertia = mine[0], "0.02 0.02 0.002"
        rod = self.home_mm + self.head_mm - self.foot_mm
        stroke = f'range="{low:.9g} {high:.9g}" armature="5" damping="50"'
        if self.kind == "strut":
            length = np.linalg.norm(rod[first])
            return [
                f'    <body name="{name}_cylinder" pos="{_metres(self.foot_mm[first])}" '
                f'zaxis="{_spaced(rod[first] / length)}">',
                f'      <joint name="{name}_u" axis="1 0 0" damping="0.5"/>',
                f'      <joint name="{name}_v" axis="0 1 0" damping="0.5"/>',
                f'      <inertial pos="0 0 {_CYLINDER_MM / 1e3:.9g}" mass="{moved_kg:.9g}" diaginertia="{inertia}"/>',
                f'      <body name="{name}_piston" pos="0 0 {(length - _ROD_MM) / 1e3:.12g}">',
                f'        <joint name="{name}" type="slide" axis="0 0 1" {stroke}/>',
                f'        <inertial pos="0 0 {(_ROD_MM - _PISTON_MM) / 1e3:.9g}" mass="{rod_kg:.9g}" '
                f'diaginertia="{inertia}"/>',
                "      </body>",
                "    </body>",
            ]
        seat = self.pivot_mm[first] if self.kind == "crank" else self.foot_mm[mine].mean(axis=0)
        kind = "hinge" if self.kind == "crank" else "slide"
        centre = 0.5 * (self.foot_mm[mine].mean(axis=0) - seat) if self.kind == "crank" else np.zeros(3)
        lines = [
            f'    <body name="{name}_drive" pos="{_metres(seat)}">',
            f'      <joint name="{name}" type="{kind}" axis="{_spaced(self.axis[first])}" {stroke}/>',
            f'      <inertial pos="{_metres(centre)}" mass="{moved_kg:.9g}" diaginertia="{inertia}"/>',
        ]
        for one in mine:
            length, own = np.linalg.norm(rod[one]), self._rod_name(name, mine, one)
            lines += [
                f'      <body name="{own}_rod" pos="{_metres(self.foot_mm[one] - seat)}" '
                f'zaxis="{_spaced(rod[one] / length)}">',
                f'        <joint name="{own}_elbow" type="ball" damping="0.02"/>',
                f'        <inertial pos="0 0 {length / 2e3:.12g}" mass="{rod_kg:.9g}" diaginertia="{inertia}"/>',
                "      </body>",
            ]
        return [*lines, "    </body>"]


# --- text of files


def _mjcf_text(bodies, equalities, servos):
    """The text of an MJCF from lines of its parts."""
    lines = [
        '<mujoco model="own">',
        '  <compiler angle="radian" autolimits="true" inertiafromgeom="false"/>',
        f'  <option timestep="0.0002" integrator="implicitfast" tolerance="1e-14" gravity="0 0 -{G}"/>',
        '  <default><equality solref="0.0004 1" solimp="0.9999 0.9999 0.0001"/></default>',
        "  <worldbody>",
        *bodies,
        "  </worldbody>",
        *(["  <equality>", *equalities, "  </equality>"] if equalities else []),
        "  <actuator>",
        *servos,
        "  </actuator>",
        "</mujoco>",
    ]
    return "\n".join(lines) + "\n"


def _servo_line(joint, unit):
    """Line of a stiff position servo."""
    return f'    <position name="{joint}_servo" joint="{joint}" kp="{_SERVO[unit]}" kv="{_DAMPING[unit]}"/>'


def _quat(vector_rad):
    """Quaternion (w, x, y, z) of a rotation vector (3,) as text."""
    x, y, z, w = Rotation.from_rotvec(vector_rad).as_quat()
    return _spaced((w, x, y, z))


def _composed_rotation(first_rad, then_rad):
    """Rotation vector of two rotations, the second in the frame rotated by the first."""
    return tuple((Rotation.from_rotvec(first_rad) * Rotation.from_rotvec(then_rad)).as_rotvec().tolist())


def _free_directions(unit, *joints):
    """0 or 1 (3,) for every direction: 0 along the axes of those joints that have this unit."""
    axes = [np.abs(joint.axis) for joint in joints if joint.unit == unit]
    return 1.0 - np.max([np.zeros(3), *axes], axis=0)


def file_scale(unit):
    """Factor from mm or rad to the unit of a file."""
    return 1e-3 if unit == "mm" else 1.0


def _metres(values_mm):
    """Lengths in m as text."""
    return _spaced(1e-3 * np.array(values_mm))


def _rpy(vector_rad):
    """A rotation vector as the roll, pitch and yaw of a URDF."""
    return _spaced(Rotation.from_rotvec(vector_rad).as_euler("xyz"))


def _spaced(values):
    """Numbers as text."""
    return " ".join(f"{value:.12g}" for value in values)
