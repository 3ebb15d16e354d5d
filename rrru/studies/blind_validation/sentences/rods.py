"""Platforms on six rods by plain NumPy, and as MJCF. Lengths mm, angles rad, masses kg.

A rod runs from a ball on its drive to a ball on the platform and keeps its length:

    |p + R b_i - a_i(q)| = l_i(q),   i = 1 .. 6

a_i moves on a crank or a rail, or is fixed where the rod itself is the drive. Newton's method on these six equations
gives the pose. Loads on the drives are minus the derivatives of the potential energy.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from rrru.studies.blind_validation.sentences.chains import metres, mjcf, servo, spaced
from rrru.studies.blind_validation.sentences.statics import G, drive_loads

_NEWTON_STEPS, _CLOSED_MM = 30, 1e-9
_TINY, _LARGEST_STEP = 1e-12, np.repeat([100.0, 0.3], 3)


@dataclass(frozen=True)
class Rods:
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
    def columns(self):
        """Columns of its actuator positions in a file."""
        return tuple(f"{name}_{self.unit}" for name in self._names)

    @property
    def spans(self):
        """Least and largest values (K, 2) of its drives."""
        return np.tile(self.span, (len(self.units), 1))

    @property
    def _names(self):
        """Names of its drives."""
        return [f"leg{k + 1}" for k in range(len(self.units))]

    @property
    def places(self):
        """Places in its MJCF with errors as built: bases of struts, and balls of platforms that rotate."""
        if len(self.units) == 3:
            return [f"{name}_drive.{way}" for name in self._names for way in "xyz"]
        body = "cylinder" if self.kind == "strut" else "drive"
        return [f"{name}_{part}.{way}" for name in self._names for part in (body, "ball") for way in "xyz"]

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
            step = np.linalg.solve(jacobian + _TINY * np.eye(6), (length - size)[:, :, None])[:, :, 0]
            step = np.clip(step, -_LARGEST_STEP, _LARGEST_STEP)
            place = place + step[:, :3]
            turn = Rotation.from_rotvec(step[:, 3:]).as_matrix() @ turn
            if np.abs(length - size).max() < _CLOSED_MM:
                break
        lost = ~(np.abs(length - size).max(axis=1) < _CLOSED_MM)
        place[lost], turn[lost] = np.nan, np.nan
        return place, turn

    def loads(self, values, payload_kg):
        """Torques in N mm or forces in N (n, K) on the drives from all weight, with payloads (n,) at the platform."""
        return drive_loads(lambda at: self._energy(at, payload_kg), values, self.units)

    def _energy(self, values, payload_kg):
        """Potential energy (n,) in N mm."""
        place, turn = self.poses(values)
        head = place[:, None, :] + (turn @ self.head_mm.T).transpose(0, 2, 1)
        platform_kg, moved_kg, rod_kg = self.masses_kg
        foot, middle = self._feet(values), 0.5 * (self._feet(values) + head)
        height = (platform_kg + payload_kg) * place[:, 2] + rod_kg * middle[:, :, 2].sum(axis=1)
        first = [self.drive.index(k) for k in range(len(self.units))]
        if self.kind == "strut":
            # the piston has its centre at a fixed distance behind its ball
            behind = (head - foot) / np.linalg.norm(head - foot, axis=2, keepdims=True)
            height = (platform_kg + payload_kg) * place[:, 2]
            height = height + rod_kg * (head - _PISTON_MM * behind)[:, :, 2].sum(axis=1)
            height = height + moved_kg * (foot + _CYLINDER_MM * behind)[:, :, 2].sum(axis=1)
        elif self.kind == "rail":
            height = height + moved_kg * foot[:, first, 2].sum(axis=1)
        else:
            height = height + moved_kg * 0.5 * foot[:, first, 2].sum(axis=1)
        return G * height

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
        foot = self.foot_mm + _across(foot - self.foot_mm, self._way())
        # an error of a strut's length is a zero offset
        extra = length_mm * generator.standard_normal(6) * (self.kind != "strut")
        extra = np.repeat(extra[::2], 2) if len(self.units) == 3 else extra
        axis = self.axis + angle_rad * generator.standard_normal((6, 3))
        axis = np.repeat(axis[[self.drive.index(k) for k in range(len(self.units))]], 6 // len(self.units), axis=0)
        axis = axis / np.linalg.norm(axis, axis=1, keepdims=True) if self.kind != "strut" else self.axis
        moved = np.linalg.norm(self.home_mm + head - foot, axis=1)
        return replace(self, foot_mm=foot, head_mm=head, axis=axis, extra_mm=nominal - moved + extra)

    def _way(self):
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
            f'    <body name="plate" pos="{metres(self.home_mm)}">',
            '      <freejoint name="plate_free"/>',
            f'      <inertial pos="0 0 0" mass="{platform_kg:.9g}" diaginertia="0.04 0.04 0.08"/>',
            "    </body>",
        ]
        equalities = []
        for k, name in enumerate(self._names):
            mine = [rod for rod, drive in enumerate(self.drive) if drive == k]
            bodies += self._leg(name, k, mine, (moved_kg, rod_kg))
            equalities += [
                f'    <connect name="{self._rod_name(name, mine, rod)}_ball" body1="plate" '
                f'body2="{self._end(name, mine, rod)}" anchor="{metres(self.head_mm[rod])}"/>'
                for rod in mine
            ]
        return mjcf(bodies, equalities, [servo(name, self.unit) for name in self._names])

    @staticmethod
    def _rod_name(name, mine, rod):
        """Name of a leg's rod."""
        return name if len(mine) == 1 else f"{name}{'ab'[mine.index(rod)]}"

    def _end(self, name, mine, rod):
        """Name of the body that holds the platform."""
        return f"{name}_piston" if self.kind == "strut" else f"{self._rod_name(name, mine, rod)}_rod"

    def _leg(self, name, k, mine, masses_kg):
        """Lines of the bodies of a leg."""
        moved_kg, rod_kg = masses_kg
        low, high = (value * (1.0 if self.unit == "rad" else 1e-3) for value in self.span)
        first, inertia = mine[0], "0.02 0.02 0.002"
        rod = self.home_mm + self.head_mm - self.foot_mm
        stroke = f'range="{low:.9g} {high:.9g}" armature="5" damping="50"'
        if self.kind == "strut":
            length = np.linalg.norm(rod[first])
            return [
                f'    <body name="{name}_cylinder" pos="{metres(self.foot_mm[first])}" '
                f'zaxis="{spaced(rod[first] / length)}">',
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
            f'    <body name="{name}_drive" pos="{metres(seat)}">',
            f'      <joint name="{name}" type="{kind}" axis="{spaced(self.axis[first])}" {stroke}/>',
            f'      <inertial pos="{metres(centre)}" mass="{moved_kg:.9g}" diaginertia="{inertia}"/>',
        ]
        for one in mine:
            length, own = np.linalg.norm(rod[one]), self._rod_name(name, mine, one)
            lines += [
                f'      <body name="{own}_rod" pos="{metres(self.foot_mm[one] - seat)}" '
                f'zaxis="{spaced(rod[one] / length)}">',
                f'        <joint name="{own}_elbow" type="ball" damping="0.02"/>',
                f'        <inertial pos="0 0 {length / 2e3:.12g}" mass="{rod_kg:.9g}" diaginertia="{inertia}"/>',
                "      </body>",
            ]
        return [*lines, "    </body>"]


def _across(shift, way):
    """Shifts (6, 3) without their components along unit vectors (6, 3)."""
    return shift - (shift * way).sum(axis=1, keepdims=True) * way


# struts: centre of the cylinder from its foot, of the piston from its ball; length of the piston
_CYLINDER_MM, _PISTON_MM, _ROD_MM = 120.0, 120.0, 250.0
