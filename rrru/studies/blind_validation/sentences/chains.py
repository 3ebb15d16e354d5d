"""Chains of rotary and sliding joints by plain NumPy, and as URDF and MJCF. Lengths mm, angles rad, masses kg.

The code follows the textbook formula (product of a seat and a motion for every joint; loads as minus the derivative of
the potential energy by the joint position). It is independent of the package's models, so that it can check them. Files
are in m.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from rrru.studies.blind_validation.sentences.statics import G, drive_loads

_SERVO = {"rad": "1e8", "mm": "1e8"}
_DAMPING = {"rad": "4e4", "mm": "2e4"}
_ARMATURE = {"rad": "5", "mm": "5"}


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
class Chain:
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
    def columns(self):
        """Columns of its actuator positions in a file."""
        return tuple(f"{joint.name}_{joint.unit}" for joint in self.joints)

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

    def loads(self, values, payload_kg):
        """Torques in N mm or forces in N (n, K) on the drives from all weight, with payloads (n,) at the platform."""
        return drive_loads(lambda at: self._energy(at, payload_kg), values, self.units)

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
            shift = length_mm * generator.standard_normal(3) * _across("mm", joint, *before)
            turn = angle_rad * generator.standard_normal(3) * _across("rad", joint, *before)
            seat = tuple((np.array(joint.seat_mm) + shift).tolist())
            joints.append(replace(joint, seat_mm=seat, seat_rad=_turned(joint.seat_rad, turn)))
            before = (joint,)
        tip = np.array(self.tip_mm) + length_mm * generator.standard_normal(3) * _across("mm", *before)
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
            link, (low, high) = f"{joint.name}_link", np.array(joint.span) * _scale(joint.unit)
            inertia = "".join(f' {name}="{0.01 * joint.mass_kg:.9g}"' for name in ("ixx", "iyy", "izz"))
            lines += [
                f'  <link name="{link}"><inertial><origin xyz="{metres(joint.centre_mm)}"/>'
                f'<mass value="{joint.mass_kg:.9g}"/><inertia{inertia} ixy="0" ixz="0" iyz="0"/></inertial></link>',
                f'  <joint name="{joint.name}" type="{"revolute" if joint.unit == "rad" else "prismatic"}">',
                f'    <parent link="{before}"/><child link="{link}"/>',
                f'    <origin xyz="{metres(joint.seat_mm)}" rpy="{_rpy(joint.seat_rad)}"/>',
                f'    <axis xyz="{spaced(joint.axis)}"/>',
                f'    <limit lower="{low:.9g}" upper="{high:.9g}" effort="100" velocity="1"/>',
                "  </joint>",
            ]
            before = link
        lines += [
            '  <link name="tool"/>',
            '  <joint name="flange" type="fixed">',
            f'    <parent link="{before}"/><child link="tool"/>',
            f'    <origin xyz="{metres(self.tip_mm)}" rpy="{_rpy(self.tip_rad)}"/>',
            "  </joint>",
            "</robot>",
        ]
        return "\n".join(lines) + "\n"

    def _mjcf(self):
        """The MJCF: nested bodies with stiff position servos."""
        lines, servos = [], []
        for depth, joint in enumerate(self.joints):
            pad, (low, high) = "  " * (depth + 2), np.array(joint.span) * _scale(joint.unit)
            kind = "hinge" if joint.unit == "rad" else "slide"
            inertia = spaced([0.01 * joint.mass_kg] * 3)
            lines += [
                f'{pad}<body name="{joint.name}_link" pos="{metres(joint.seat_mm)}" quat="{quat(joint.seat_rad)}">',
                f'{pad}  <joint name="{joint.name}" type="{kind}" axis="{spaced(joint.axis)}" '
                f'range="{low:.9g} {high:.9g}" armature="{_ARMATURE[joint.unit]}" damping="1"/>',
                f'{pad}  <inertial pos="{metres(joint.centre_mm)}" mass="{joint.mass_kg:.9g}" '
                f'diaginertia="{inertia}"/>',
            ]
            servos.append(servo(joint.name, joint.unit))
        pad = "  " * (len(self.joints) + 2)
        lines.append(f'{pad}<body name="tool" pos="{metres(self.tip_mm)}" quat="{quat(self.tip_rad)}"/>')
        lines += ["  " * (depth + 2) + "</body>" for depth in reversed(range(len(self.joints)))]
        return mjcf(lines, [], servos)


def mjcf(bodies, equalities, servos):
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


def servo(joint, unit):
    """Line of a stiff position servo."""
    return f'    <position name="{joint}_servo" joint="{joint}" kp="{_SERVO[unit]}" kv="{_DAMPING[unit]}"/>'


def quat(vector_rad):
    """Quaternion (w, x, y, z) of a rotation vector (3,) as text."""
    x, y, z, w = Rotation.from_rotvec(vector_rad).as_quat()
    return spaced((w, x, y, z))


def _turned(first_rad, then_rad):
    """Rotation vector of two rotations, the second in the frame rotated by the first."""
    return tuple((Rotation.from_rotvec(first_rad) * Rotation.from_rotvec(then_rad)).as_rotvec().tolist())


def _across(unit, *joints):
    """0 or 1 (3,) for every direction: 0 along the axes of those joints that have this unit."""
    axes = [np.abs(joint.axis) for joint in joints if joint.unit == unit]
    return 1.0 - np.max([np.zeros(3), *axes], axis=0)


def _scale(unit):
    """Factor from mm or rad to the unit of a file."""
    return 1e-3 if unit == "mm" else 1.0


def metres(values_mm):
    """Lengths in m as text."""
    return spaced(1e-3 * np.array(values_mm))


def _rpy(vector_rad):
    """A rotation vector as the roll, pitch and yaw of a URDF."""
    return spaced(Rotation.from_rotvec(vector_rad).as_euler("xyz"))


def spaced(values):
    """Numbers as text."""
    return " ".join(f"{value:.12g}" for value in values)
