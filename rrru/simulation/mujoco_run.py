"""Drives a changed MJCF: from stop to stop at rest, or in time where a cause acts in motion only. SI units inside.

The path between two stops is driven, never jumped, with a smooth start and end, so that backlash and friction keep
their states. At each point the robot is at rest and its loops are closed; otherwise an error states speed or opening.
Geometric errors, constant and by warming up, move the seats of bodies and of sites.
"""

from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from scipy.interpolate import Akima1DInterpolator, CubicHermiteSpline
from scipy.spatial.transform import Rotation

from rrru.arrays import FloatArray
from rrru.effects.protocol import Motion
from rrru.errors import SimulationError, UnreachableError
from rrru.simulation.mujoco_model import MM, PAYLOAD, STEP_S, Edit

# limits at a recorded point: opening of its loops, and speed of its platform, the angular one times a characteristic
# length. A body held by friction creeps in MuJoCo by some um/s
CLOSED_MM, REST_MM_S = 1e-3, 1e-2
_CHARACTERISTIC_LENGTH_M = 0.5
# the platform is accelerated by a tenth of gravity at most, so that holding friction still holds an arm in its backlash
_MAX_ACCELERATION_M_S2 = 1.0
_ASSEMBLY_STEPS, _BLOCK_STEPS, _MAX_BLOCKS = 2500, (37, 50), 400
# peak acceleration of the smooth step 10 s^3 - 15 s^4 + 6 s^5
_PEAK_ACCELERATION = 10.0 / np.sqrt(3.0)
_MIN_MOVE_S = 0.02
_WARNING = mujoco.mjtWarning
_INSTABILITY_WARNINGS = (
    _WARNING.mjWARN_BADQPOS,
    _WARNING.mjWARN_BADQVEL,
    _WARNING.mjWARN_BADQACC,
    _WARNING.mjWARN_BADCTRL,
)


class Machine:
    """A compiled Edit at home; file: for messages."""

    def __init__(self, edit: Edit, file: Path) -> None:
        self.edit, self.file, self.model = edit, file, edit.spec.compile()
        self.data, model = self._at_home(), self.model
        for name, kilograms in edit.masses.items():
            model.body(edit.prefix + name).mass += kilograms
        self.shape = Shape(edit, model)
        self.shape.write(0.0, 0.0)
        self._set_payload(0.0)
        self._damp_added()
        self.platform = model.body(edit.prefix + edit.platform).id
        self.actuators = np.array([model.actuator(edit.prefix + name).id for name in edit.servos.values()])
        kv, kp = -model.actuator_biasprm[self.actuators, 2], model.actuator_gainprm[self.actuators, 0]
        # a servo sees the position at the beginning of a step and the control of its end
        self.known_lag_s = kv / kp - STEP_S - [edit.lags.get(joint, 0.0) for joint in edit.servos]

    def _set_payload(self, payload_kg: float) -> None:
        """Set the mass of the payload on the platform."""
        self.model.body(self.edit.prefix + PAYLOAD).mass = payload_kg
        mujoco.mj_setConst(self.model, mujoco.MjData(self.model))
        self._balance_leashes()

    def _balance_leashes(self) -> None:
        """Set MuJoCo's inverse weight of each leash: at home a leash has no length and so no direction."""
        model, data = self.model, self._at_home()
        mujoco.mj_forward(model, data)
        for name, sites in self.edit.leashes.items():
            jacobians = np.zeros((2, 3, model.nv))
            for jacobian, site in zip(jacobians, sites, strict=True):
                mujoco.mj_jacSite(model, data, jacobian, None, model.site(self.edit.prefix + site).id)
            across = np.ascontiguousarray(jacobians[1] - jacobians[0])
            moved = np.zeros_like(across)
            mujoco.mj_solveM(model, data, moved, across)
            tendon = model.tendon(self.edit.prefix + name).id
            model.tendon_invweight0[tendon] = np.linalg.eigvalsh(across @ moved.T)[-1]

    def _at_home(self) -> mujoco.MjData:
        """New data in the home pose."""
        data = mujoco.MjData(self.model)
        for joint, values in self.edit.home.items():
            data.joint(self.edit.prefix + joint).qpos = values
        return data

    def _damp_added(self) -> None:
        """Critical damping of the joints that causes have added, so that they come to rest."""
        model = self.model
        for name, frequency in self.edit.damped.items():
            joint = model.joint(self.edit.prefix + name)
            dof, inertia = joint.dofadr[0], model.dof_M0[joint.dofadr[0]]
            natural = np.sqrt(model.jnt_stiffness[joint.id] / inertia) if frequency is None else frequency
            model.dof_damping[dof] = 2.0 * inertia * natural
        for name, (leash, frequency) in self.edit.brakes.items():
            mass = 1.0 / model.tendon_invweight0[model.tendon(self.edit.prefix + leash).id]
            model.actuator(self.edit.prefix + name).biasprm[2] = -2.0 * mass * frequency

    def controls(self, drives: FloatArray) -> FloatArray:
        """Controls (N, K) for actuator values (N, K) in rad or mm; raises UnreachableError beyond the file's ranges."""
        edit, model = self.edit, self.model
        unit = np.array([edit.lengths[joint] for joint in edit.servos])
        zero = np.array([edit.nominal.joint(joint).qpos0[0] for joint in edit.servos])
        result = zero + unit * drives
        for number, joint in enumerate(edit.servos):
            low, high = edit.nominal.joint(joint).range if edit.nominal.joint(joint).limited[0] else (-np.inf, np.inf)
            servo = self.actuators[number]
            if model.actuator_ctrllimited[servo]:
                low, high = max(low, model.actuator_ctrlrange[servo, 0]), min(high, model.actuator_ctrlrange[servo, 1])
            out = np.flatnonzero(~((result[:, number] >= low) & (result[:, number] <= high)))
            if out.size:
                text = f"{joint} is commanded to {result[out[0], number]:g} on its path"
                raise UnreachableError(f"{self.file}: {text}; allowed: {low:g} to {high:g} (m, rad)")
        return result + [edit.offsets.get(joint, 0.0) for joint in edit.servos]

    def drive(self, motion: Motion, moving: bool) -> tuple[FloatArray, FloatArray]:
        """Poses along a Motion: positions (n, 3) in mm and turns (n, 3, 3) of the platform at its points.

        moving: whether points are read on the way, at their times, where the drives move there; else all at rest.
        Raises SimulationError where the robot is not at rest or its loops are not closed.
        """
        path, index, payload = self.controls(motion.path_drive), motion.path_index, np.nan_to_num(motion.payload_kg)
        way, time_s = _ControlPath(path, motion, self.known_lag_s), motion.time_s
        self._assemble(path[0], payload[0])
        self._send(way.slowly(0, index[0]))
        positions, turns = [], []
        for point in range(len(index)):
            on_time = moving and point and way.moves(point)
            if point:
                if payload[point] != payload[point - 1]:
                    self._set_payload(payload[point])
                self.shape.write(1.0, time_s[point])
                before, here = index[point - 1 : point + 1]
                self._send(way.in_time(point) if on_time else way.slowly(before, here, way.distance_m[point]))
            where = f"point {point + 1} of {len(index)}"
            if not on_time or not way.moving[point]:
                self._wait_for_rest(where)
            mujoco.mj_fwdPosition(self.model, self.data)
            self._require_closed(where)
            positions.append(MM * self.data.xpos[self.platform])
            turns.append(self.data.xmat[self.platform].reshape(3, 3).copy())
        return np.array(positions), np.array(turns)

    def _assemble(self, controls: FloatArray, payload_kg: float) -> None:
        """Bring the robot from home to its first controls, with weight and errors growing from zero."""
        self._set_payload(payload_kg)
        home = np.concatenate([self.edit.home[joint] for joint in self.edit.servos])
        full = np.array(self.model.opt.gravity)
        for share in _smooth(_ASSEMBLY_STEPS):
            self.model.opt.gravity = share * full
            self.shape.write(share, 0.0)
            self._send((home + share * (controls - home))[None])

    def _send(self, controls: FloatArray) -> None:
        """One step for every row of controls (m, K)."""
        model, data = self.model, self.data
        for row in controls:
            data.ctrl[self.actuators] = row
            mujoco.mj_step(model, data)

    def _wait_for_rest(self, where: str) -> None:
        """Wait until the platform is at rest twice in a row."""
        blocks_at_rest = 0
        for block in range(_MAX_BLOCKS):
            mujoco.mj_step(self.model, self.data, nstep=_BLOCK_STEPS[block % 2])
            velocity = np.zeros(6)
            mujoco.mj_objectVelocity(self.model, self.data, mujoco.mjtObj.mjOBJ_XBODY, self.platform, velocity, 0)
            speed = MM * max(_CHARACTERISTIC_LENGTH_M * np.linalg.norm(velocity[:3]), np.linalg.norm(velocity[3:]))
            blocks_at_rest = blocks_at_rest + 1 if speed < REST_MM_S else 0
            if blocks_at_rest == len(_BLOCK_STEPS):
                return
        self._require_stable(where)
        waited = f"still moves at {speed:.3g} mm/s after {STEP_S * _MAX_BLOCKS * np.mean(_BLOCK_STEPS):.1f} s"
        raise SimulationError(f"{self.file}: {where} {waited}; allowed: less than {REST_MM_S:g}")

    def _require_closed(self, where: str) -> None:
        """Raise SimulationError where loops are open."""
        self._require_stable(where)
        data = self.data
        open_mm = MM * np.abs(data.efc_pos[: data.ne]).max(initial=0.0)
        if not open_mm < CLOSED_MM:
            raise SimulationError(f"{self.file}: {where}: loops are open by {open_mm:.3g} mm; allowed: {CLOSED_MM:g}")

    def _require_stable(self, where: str) -> None:
        """Raise SimulationError where the simulation has become unstable, after which MuJoCo resets it."""
        if any(self.data.warning[int(kind)].number for kind in _INSTABILITY_WARNINGS):
            raise SimulationError(f"{self.file}: {where}: the simulation has become unstable; allowed: softer causes")


class _ControlPath:
    """Controls along a path (N, K) with points at rows (n,), those of a Motion."""

    def __init__(self, path: FloatArray, motion: Motion, known_lag_s: FloatArray) -> None:
        self.path, self.index, self.time_s, self.lag_s = path, motion.path_index, motion.time_s, known_lag_s
        rate, spots = np.nan_to_num(motion.drive_rate), motion.position_mm / MM
        self.moving = np.abs(rate).max(axis=1) > 0.0
        slope = np.gradient(motion.path_drive, axis=0)[self.index] if len(path) > 1 else np.ones_like(rate)
        # rows of the path in a second
        self.speed = (rate * slope).sum(axis=1) / np.maximum((slope**2).sum(axis=1), 1e-30)
        self.distance_m = np.linalg.norm(np.diff(spots, axis=0, prepend=spots[:1]), axis=1)

    def moves(self, point: int) -> bool:
        """Whether the drives move at a point or the one before."""
        return bool(self.moving[point - 1] or self.moving[point])

    def slowly(self, first: int, last: int, distance_m: float = 0.0) -> FloatArray:
        """Controls (m, K) from row to row of the path, with a smooth start and end; distance_m: of the platform."""
        rows = np.arange(len(self.path))
        turned = np.abs(np.diff(self.path[first : last + 1], axis=0)).max(axis=1, initial=0.0).sum()
        seconds = np.sqrt(
            _PEAK_ACCELERATION * max(distance_m, _CHARACTERISTIC_LENGTH_M * turned) / _MAX_ACCELERATION_M_S2
        )
        at = first + (last - first) * _smooth(round(max(seconds, _MIN_MOVE_S) / STEP_S))
        return np.stack([np.interp(at, rows, drive) for drive in self.path.T], axis=1)

    def in_time(self, point: int) -> FloatArray:
        """Controls (m, K) from the point before to a point as the plan's times say, with the drives' feedforward."""
        before, rests = slice(point - 1, point + 1), np.flatnonzero(~self.moving)
        first, last = rests[rests < point].max(initial=0), rests[rests >= point].min(initial=len(self.moving) - 1)
        rows = np.arange(self.index[first], self.index[last] + 1)
        along = Akima1DInterpolator(rows, self.path[rows], method="makima")
        at = CubicHermiteSpline(self.time_s[before], self.index[before], self.speed[before])
        count = max(round(np.diff(self.time_s[before])[0] / STEP_S), 1)
        start_s, end_s = self.time_s[before]
        controls = along(np.clip(at(np.linspace(start_s, end_s, count + 1)), rows[0], rows[-1]))
        return np.asarray(controls[1:] + self.lag_s * np.diff(controls, axis=0) / STEP_S)


def _smooth(steps: int) -> FloatArray:
    """Shares (steps,) from above 0 to 1 that start and end smoothly."""
    s = np.linspace(0.0, 1.0, steps + 1)[1:]
    return s**3 * (10.0 - 15.0 * s + 6.0 * s**2)


class Shape:
    """Writes an Edit's shifts into its compiled model."""

    def __init__(self, edit: Edit, model: mujoco.MjModel) -> None:
        self.edit, self.model = edit, model
        self.nominal = {
            "body": (model.body_pos.copy(), model.body_quat.copy()),
            "site": (model.site_pos.copy(), model.site_quat.copy()),
        }

    def write(self, share: float, seconds: float) -> None:
        """Write a share of the shifts, and the growth after a time."""
        model, warm = self.model, -np.expm1(-seconds / (self.edit.warming_s or np.inf))
        for array, nominal in zip((model.body_pos, model.body_quat), self.nominal["body"], strict=True):
            array[:] = nominal
        for array, nominal in zip((model.site_pos, model.site_quat), self.nominal["site"], strict=True):
            array[:] = nominal
        for part, places in ((share, self.edit.shifts), (warm, self.edit.grows)):
            for (kind, name, direction), size in places.items():
                self._move(getattr(model, kind)(self.edit.prefix + name), direction, part * size)
        for seat, pin in self.edit.seats.items():
            at = model.site(self.edit.prefix + pin)
            body = model.body(at.bodyid[0])
            model.site(self.edit.prefix + seat).pos = body.pos + _turn(body.quat).apply(at.pos)

    def _move(self, element: Any, direction: int, size: float) -> None:
        """Shift a body's or site's seat, or turn it, in the frame of what carries it."""
        axis = np.eye(3)[direction % 3]
        if direction < 3:
            element.pos += size * axis
        else:
            turned = Rotation.from_rotvec(size * axis) * _turn(element.quat)
            element.quat = turned.as_quat(scalar_first=True)


def _turn(quat: FloatArray) -> Rotation:
    """Rotation of MuJoCo's quaternion."""
    return Rotation.from_quat(quat, scalar_first=True)
