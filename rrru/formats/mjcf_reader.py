"""The bodies of a MuJoCo model as rigid parts, and the joint graph of these, for `rrru.formats.robot_file`.

A body without a joint belongs to the part of its parent, a welded body to that of its partner. A seam joins two parts:
the joints between a body and its parent, or the connects between two parts. One connect is a ball joint, two are a
hinge. A leg is a path of seams from the base to the platform. Values of joints count from the file's reference
configuration (MuJoCo's qpos less ref); those of ball joints, three turns about x, y and z, from the home pose. Lengths
in mm, angles in rad; placements are (4, 4).
"""

from collections.abc import Sequence
from functools import cached_property
from pathlib import Path

import mujoco
import numpy as np

from rrru.errors import ConfigError
from rrru.formats.joint_graph import Item, Move, Seam, inverse_placement, placed, turn_of
from rrru.kinematics.legs import X, Y, Z

MM = 1000.0
# the name of the measured point in a file, where it has moved
MEASURED_TOOL = "measured_tool"
_EQ, _JOINT = mujoco.mjtEq, mujoco.mjtJoint
# two joints are on one line if they are off it by less than this, in m and rad
_MAX_OFF_LINE = 1e-9


def backlash_joints(model: mujoco.MjModel) -> dict[int, int]:
    """Joints that model the backlash of driven ones: same body, kind and line, with a range and without an actuator.

    A robot is read with these joints in the middle of their ranges. Returns the driven joint by joint.
    """
    driven = _actuators(model).keys()
    result = {}
    for joint in set(np.flatnonzero(model.jnt_limited).tolist()) - driven:
        for other in driven:
            same = model.jnt_bodyid[joint] == model.jnt_bodyid[other] and model.jnt_type[joint] == model.jnt_type[other]
            if same and _on_one_line(model, joint, other):
                result[joint] = other
    return result


def _actuators(model: mujoco.MjModel) -> dict[int, int]:
    """Number of the first actuator of every joint that has one."""
    kinds = [int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT)]
    ofs = enumerate(zip(model.actuator_trnid[:, 0].tolist(), model.actuator_trntype, strict=True))
    result: dict[int, int] = {}
    for number, (joint, kind) in ofs:
        if kind in kinds:
            result.setdefault(joint, number)
    return result


def _on_one_line(model: mujoco.MjModel, joint: int, other: int) -> bool:
    """Whether two joints of a body move about or along one line."""
    axis, apart = model.jnt_axis[other], model.jnt_pos[joint] - model.jnt_pos[other]
    slides = model.jnt_type[joint] == _JOINT.mjJNT_SLIDE
    off = 0.0 if slides else np.linalg.norm(np.cross(axis, apart))
    return bool(np.linalg.norm(np.cross(axis, model.jnt_axis[joint])) < _MAX_OFF_LINE and off < _MAX_OFF_LINE)


def ends_of(model: mujoco.MjModel, k: int) -> tuple[int, np.ndarray, int, np.ndarray]:
    """Both bodies of a connect or weld, and the placements on them that it holds together."""
    data = model.eq_data[k]
    first, second = int(model.eq_obj1id[k]), int(model.eq_obj2id[k])
    if model.eq_objtype[k] == mujoco.mjtObj.mjOBJ_SITE:
        at = [placed(MM * model.site_pos[s], turn_of(model.site_quat[s])) for s in (first, second)]
        return int(model.site_bodyid[first]), at[0], int(model.site_bodyid[second]), at[1]
    if model.eq_type[k] == _EQ.mjEQ_CONNECT:
        return first, placed(MM * data[:3]), second, placed(MM * data[3:6])
    return first, placed(MM * data[3:6], turn_of(data[6:10])), second, placed(MM * data[:3])


class Assembly:
    """The parts and seams of a compiled model between two of its bodies, by number, in a home pose qpos.

    frames: by body its part and its placement there; a part is called by the number of one body, whose frame it has.
    limits: by joint the effort in N m or N and the velocity in rad/s or m/s that the file allows its drive, NaN where
    none is stated.
    """

    def __init__(self, model: mujoco.MjModel, file: Path, base: int, platform: int, qpos: np.ndarray) -> None:
        self.model, self.file, self.base, self.platform = model, file, base, platform
        self.limits: dict[int, tuple[float, float]] = {}
        self.data = mujoco.MjData(model)
        self.data.qpos[:] = qpos
        mujoco.mj_kinematics(model, self.data)
        kinds = {k: int(model.eq_type[k]) for k in range(model.neq) if model.eq_active0[k]}
        self.frames = self._frames([k for k, kind in kinds.items() if kind == _EQ.mjEQ_WELD])
        if self.frames[platform][0] == base:
            raise self.error(f"body {self.body_name(platform)} is fixed to the base; allowed: a body that moves")
        self._names: set[str] = set()
        self._backlash_joints = backlash_joints(model)
        connects = [k for k, kind in kinds.items() if kind == _EQ.mjEQ_CONNECT]
        self.seams = tuple(self._joint_seams() + self._connect_seams(connects))
        for k, kind in kinds.items():
            if kind not in (_EQ.mjEQ_CONNECT, _EQ.mjEQ_WELD, _EQ.mjEQ_JOINT):
                name = _EQ(kind).name.removeprefix("mjEQ_").lower()
                raise self.error(f"equality {self.eq_name(k)} is of the kind {name}; allowed: connect, weld, joint")

    def error(self, text: str) -> ConfigError:
        """The ConfigError of a text about the file."""
        return ConfigError(f"{self.file}: {text}")

    def body_name(self, body: int) -> str:
        """Name of a body."""
        return self.model.body(body).name or f"body {body}"

    def joint_name(self, joint: int) -> str:
        """Name of a joint, made from its body's where the file gives none."""
        body = int(self.model.jnt_bodyid[joint])
        number = joint - int(self.model.body_jntadr[body]) + 1
        return self.model.joint(joint).name or f"{self.body_name(body)} joint {number}"

    def eq_name(self, k: int) -> str:
        """Name of an equality."""
        return self.model.eq(k).name or f"equality {k + 1}"

    def home_of(self, body: int) -> np.ndarray:
        """Placement of a body at home in MuJoCo's world."""
        return placed(MM * self.data.xpos[body], self.data.xmat[body].reshape(3, 3))

    def own(self, body: int) -> np.ndarray:
        """Placement of a body in its parent's frame with all joints at zero."""
        return placed(MM * self.model.body_pos[body], turn_of(self.model.body_quat[body]))

    def _frames(self, welds: Sequence[int]) -> dict[int, tuple[int, np.ndarray]]:
        """Part and placement there of every body, the parts named after base and platform first."""
        near: dict[int, list[tuple[int, np.ndarray]]] = {body: [] for body in range(self.model.nbody)}
        fixed = [(int(self.model.body_parentid[b]), b, self.own(b)) for b in near if b and self._jointless(b)]
        for k in welds:
            first, at_first, second, at_second = ends_of(self.model, k)
            fixed.append((first, second, at_first @ inverse_placement(at_second)))
        for first, second, placement in fixed:
            near[first].append((second, placement))
            near[second].append((first, inverse_placement(placement)))
        result = {}
        for part in (self.base, self.platform, *near):
            todo = [] if part in result else [(part, np.eye(4))]
            for body, placement in todo:
                if body not in result:
                    result[body] = (part, placement)
                    todo += [(other, placement @ there) for other, there in near[body]]
        return result

    def _jointless(self, body: int) -> bool:
        """Whether a body is fixed to its parent."""
        return bool(self.model.body_jntnum[body] == 0)

    def _joint_seams(self) -> list[Seam]:
        """Seams of the bodies' joints; a free body has none."""
        result, model = [], self.model
        for body in range(1, model.nbody):
            first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
            if not count or model.jnt_type[first] == _JOINT.mjJNT_FREE:
                continue
            (near, before), (far, after) = self.frames[int(model.body_parentid[body])], self.frames[body]
            items = [before @ self.own(body)]
            for joint in range(first, first + count):
                items += self._joint_items(joint) if joint not in self._backlash_joints else []
            if near != far:
                result.append(Seam(near, far, (*items, inverse_placement(after)), body))
        return result

    def _joint_items(self, joint: int) -> list[Item]:
        """Placements and Moves of one joint, in its body's frame."""
        model, name, kind = self.model, self.joint_name(joint), self.model.jnt_type[joint]
        at, address = MM * model.jnt_pos[joint], int(model.jnt_qposadr[joint])
        if kind == _JOINT.mjJNT_BALL:
            return self._ball_items(name, at, turn_of(self.data.qpos[address : address + 4]), at, joint)
        value, axis = float(self.data.qpos[address] - model.qpos0[address]), model.jnt_axis[joint].copy()
        if kind == _JOINT.mjJNT_SLIDE:
            return [placed(at), Move(self._unique(name), "P", axis, name, joint, MM * value), placed(-at)]
        return [placed(at), Move(self._unique(name), "R", axis, name, joint, value), placed(-at)]

    def _connect_seams(self, connects: Sequence[int]) -> list[Seam]:
        """Seams of connects, those of the same two parts taken together."""
        groups: dict[tuple[int, int], list[tuple[int, np.ndarray, np.ndarray]]] = {}
        for k in connects:
            first, at_first, second, at_second = ends_of(self.model, k)
            (near, before), (far, after) = self.frames[first], self.frames[second]
            near_mm, far_mm = (before @ at_first)[:3, 3], (after @ at_second)[:3, 3]
            if near > far:
                near, far, near_mm, far_mm = far, near, far_mm, near_mm
            if near != far:
                groups.setdefault((near, far), []).append((k, near_mm, far_mm))
        return [
            Seam(near, far, tuple(self._connect_items(near, far, group)), connects=tuple(k for k, *_ in group))
            for (near, far), group in groups.items()
        ]

    def _connect_items(self, near: int, far: int, group: Sequence[tuple[int, np.ndarray, np.ndarray]]) -> list[Item]:
        """Placements and Moves of all connects (number, point of near, point of far) of two parts."""
        turn = (inverse_placement(self.home_of(near)) @ self.home_of(far))[:3, :3]
        (first, near_mm, far_mm), *further = group
        name = self.eq_name(first)
        if not further:
            return self._ball_items(name, near_mm, turn, far_mm)
        if len(further) > 1:
            bodies = f"{self.body_name(near)} and {self.body_name(far)}"
            raise self.error(f"{len(group)} connects between {bodies}; allowed: one, two for a hinge, or a weld")
        along, far_along = further[0][1] - near_mm, further[0][2] - far_mm
        if min(np.linalg.norm(along), np.linalg.norm(far_along)) < 1e-6:
            raise self.error(
                f"connects {name} and {self.eq_name(further[0][0])} are at one point; allowed: two points make a hinge"
            )
        along, far_along = along / np.linalg.norm(along), turn @ far_along / np.linalg.norm(far_along)
        cross, cosine = np.cross(far_along, along), far_along @ along
        skew = np.cross(np.eye(3), cross)
        turn = (np.eye(3) + skew + skew @ skew / (1.0 + cosine)) @ turn
        return [placed(near_mm), Move(self._unique(name), "R", along, name), placed(turn=turn), placed(-far_mm)]

    @cached_property
    def moves(self) -> dict[str, Move]:
        """Moves of all paths by name."""
        items = [item for path in self.paths for number in path for item in self.seams[number].items]
        return {item.name: item for item in items if isinstance(item, Move)}

    @cached_property
    def paths(self) -> list[tuple[int, ...]]:
        """Paths of seams from the base to the platform that meet no part twice.

        They are in the order of the actuators that they have, those without after the others, and of their constraints.
        """
        result, target = [], self.frames[self.platform][0]

        def go(part: int, met: set[int], path: tuple[int, ...]) -> None:
            if part == target:
                result.append(path)
                return
            for number, seam in enumerate(self.seams):
                if part in (seam.near, seam.far) and seam.other(part) not in met:
                    go(seam.other(part), met | {seam.other(part)}, (*path, number))

        go(self.base, {self.base}, ())
        return sorted(
            result, key=lambda path: (self._actuators_along(path), tuple(n for n in path if self._closes(n)), path)
        )

    def _actuators_along(self, path: tuple[int, ...]) -> tuple[float, ...]:
        """Numbers, in ascending order, of the actuators of a path's joints, infinity where it has none."""
        moves = [item for n in path for item in self.seams[n].items if isinstance(item, Move)]
        actuators = _actuators(self.model)
        found = {actuators[move.joint] for move in moves if move.joint in actuators}
        return tuple(sorted(found)) or (np.inf,)

    def names_along(self, path: tuple[int, ...]) -> tuple[str, ...]:
        """Names of the joints and connects along a path."""
        items = [item for number in path for item in self.seams[number].items]
        return tuple(dict.fromkeys(item.origin for item in items if isinstance(item, Move)))

    def _closes(self, number: int) -> bool:
        """Whether a seam consists of connects."""
        return all(move.joint is None for move in self.seams[number].items if isinstance(move, Move))

    def _ball_items(
        self, name: str, near_mm: np.ndarray, turn: np.ndarray, far_mm: np.ndarray, joint: int | None = None
    ) -> list[Item]:
        """Placements and Moves of a ball joint between two points, at home turned by `turn`."""
        moves = [
            Move(self._unique(f"{name} {letter}"), "R", axis, name, joint)
            for letter, axis in zip("xyz", (X, Y, Z), strict=True)
        ]
        return [placed(near_mm), *moves, placed(turn=turn), placed(-far_mm)]

    def _unique(self, name: str) -> str:
        """A name that no other Move has."""
        while name in self._names:
            name += "'"
        self._names.add(name)
        return name
