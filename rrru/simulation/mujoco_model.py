"""An MJCF made ready to be driven and to be changed by causes: `Edit` holds its MjSpec. Files count in m, N and kg.

Loops are held between named sites, so that a changed length opens the loop instead of moving the anchor. The
constraints are as stiff as MuJoCo allows at this step: they yield with the square of `solref` and with 1 - `solimp`.
Contacts and keyframes are left out; home is the first keyframe's pose, else the reference configuration.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from rrru.arrays import FloatArray
from rrru.errors import ConfigError

MM = 1000.0
STEP_S = 2e-4
SOLREF, SOLIMP = (2.0 * STEP_S, 1.0), (0.9999, 0.9999, 1e-4, 0.5, 2.0)
# ends of a backlash or clearance: as stiff as loops they would chatter
SOFTER = (10.0 * STEP_S, 1.0)
LIMITED = mujoco.mjtLimited.mjLIMITED_TRUE
PAYLOAD, BASE = "rrru payload", "rrru base"
_EQ, _JOINT, _OBJ = mujoco.mjtEq, mujoco.mjtJoint, mujoco.mjtObj
_SIZES = {_JOINT.mjJNT_FREE: 7, _JOINT.mjJNT_BALL: 4}

# kind ("body" or "site"), name and number of the direction of what a placement moves
Place = tuple[str, str, int]


@dataclass
class Edit:
    """A model on its way from its file to what is driven.

    nominal: the file's compiled model; home: values of qpos by joint; by driven joint: drives, the actuators, servos,
    their names, lengths, factors from its mm or rad to m or rad, offsets in m or rad, and lags in s that its controller
    does not compensate. shifts: by place, as causes name it, its error in m or rad; grows: likewise, its motion as it
    warms up with the time constant warming_s; masses: added to bodies in kg; tilt (3,): rotation vector of the base
    against gravity. damped: by added joint the angular frequency in 1/s of its damper, None for a spring's own;
    leashes: by tendon the two sites that it keeps near each other; brakes: by actuator the leash whose swinging it
    damps, and a frequency likewise; seats: by site that marks where a body is seated the body's site that is there at
    home. prefix: of all names in spec; payload_kg: the heaviest that will be carried.
    """

    spec: mujoco.MjSpec
    nominal: mujoco.MjModel
    platform: str
    home: dict[str, FloatArray]
    drives: dict[str, mujoco.MjsActuator]
    servos: dict[str, str]
    lengths: dict[str, float]
    payload_kg: float = 0.0
    damped: dict[str, float | None] = field(default_factory=dict)
    shifts: dict[Place, float] = field(default_factory=dict)
    grows: dict[Place, float] = field(default_factory=dict)
    warming_s: float | None = None
    offsets: dict[str, float] = field(default_factory=dict)
    masses: dict[str, float] = field(default_factory=dict)
    tilt: FloatArray = field(default_factory=lambda: np.zeros(3))
    lags: dict[str, float] = field(default_factory=dict)
    seats: dict[str, str] = field(default_factory=dict)
    leashes: dict[str, tuple[str, str]] = field(default_factory=dict)
    brakes: dict[str, tuple[str, float]] = field(default_factory=dict)
    prefix: str = ""

    def units(self, joint: str) -> tuple[float, float]:
        """Factors from mm or rad of a joint, and from N or N mm on it, to the file's units."""
        return (1.0 / MM, 1.0) if self.spec.joint(joint).type == _JOINT.mjJNT_SLIDE else (1.0, 1.0 / MM)

    def add_joint(
        self, body: str, name: str, kind: mujoco.mjtJoint, axis: npt.ArrayLike, **options: Any
    ) -> mujoco.MjsJoint:
        """Add a hinge or slide behind the other joints of a body, and the free dof's rest to home."""
        joint = self.spec.body(body).add_joint(name=self.prefix + name, type=kind, axis=axis, **options)
        joint.solref_limit, joint.solimp_limit = SOFTER, SOLIMP
        self.home[name] = np.zeros(1)
        return joint

    def steady(self, joint: mujoco.MjsJoint, stiffness: float) -> None:
        """Give a joint the inertia that an explicit step needs under a spring; it has no weight."""
        joint.armature = max(joint.armature, stiffness * STEP_S**2)


def read(file: str | Path, platform: str, tool_mm: Sequence[float], drives: Sequence[str]) -> Edit:
    """The Edit of an MJCF without causes; raises ConfigError where a drive has no position actuator.

    tool_mm (3,): where the payload hangs in the platform's frame; drives: names of the driven joints.
    """
    spec = mujoco.MjSpec.from_file(str(file))
    spec.compiler.fusestatic = False
    _name_all(spec)
    nominal = spec.compile()
    qpos = home_qpos(nominal)
    home = {nominal.joint(j).name: _values(nominal, j, qpos) for j in range(nominal.njnt)}
    for key in list(spec.keys):
        spec.delete(key)
    _hold_between_sites(spec, nominal)
    spec.body(platform).add_body(name=PAYLOAD, pos=np.asarray(tool_mm) / MM)
    set_options(spec, nominal.opt.gravity)
    actuators = _servos(spec, Path(file), drives)
    servos = {joint: servo.name for joint, servo in actuators.items()}
    lengths = {joint: 1.0 / MM if spec.joint(joint).type == _JOINT.mjJNT_SLIDE else 1.0 for joint in drives}
    edit = Edit(spec, nominal, platform, home, actuators, servos, lengths)
    for joint, servo in actuators.items():
        edit.steady(spec.joint(joint), servo.gainprm[0])
    return edit


def set_options(spec: mujoco.MjSpec, gravity: FloatArray) -> None:
    """Set the options common to all robots: step, integrator, solver, and gravity (3,) in m/s^2."""
    option = spec.option
    option.timestep, option.integrator = STEP_S, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    option.tolerance, option.iterations = 1e-14, 200
    option.disableflags = int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    option.gravity = gravity


def _name_all(spec: mujoco.MjSpec) -> None:
    """Give names to elements without one, so that all can be found again."""
    for number, body in enumerate(spec.bodies):
        body.name = body.name or f"body {number}"
        for count, joint in enumerate(body.joints, 1):
            joint.name = joint.name or f"{body.name} joint {count}"
    for kind, every in (("equality", spec.equalities), ("actuator", spec.actuators)):
        for number, element in enumerate(every, 1):
            element.name = element.name or f"{kind} {number}"


def home_qpos(model: mujoco.MjModel) -> FloatArray:
    """Values of qpos at home: of the first keyframe, else of the reference configuration."""
    return np.asarray(model.key_qpos[0] if model.nkey else model.qpos0)


def _values(model: mujoco.MjModel, joint: int, qpos: FloatArray) -> FloatArray:
    """Values of qpos of one joint."""
    first = int(model.jnt_qposadr[joint])
    return np.array(qpos[first : first + _SIZES.get(_JOINT(int(model.jnt_type[joint])), 1)])


def _servos(spec: mujoco.MjSpec, file: Path, drives: Sequence[str]) -> dict[str, mujoco.MjsActuator]:
    """Position actuators of the driven joints by their names."""
    found = {actuator.target: actuator for actuator in spec.actuators}
    for joint in drives:
        actuator = found.get(joint)
        if actuator is None or not actuator.gainprm[0] > 0.0 or actuator.biasprm[1] != -actuator.gainprm[0]:
            raise ConfigError(f"{file}: {joint} has no position actuator; allowed: <position joint={joint!r} kp=..>")
    return {joint: found[joint] for joint in drives}


def _hold_between_sites(spec: mujoco.MjSpec, nominal: mujoco.MjModel) -> None:
    """Make connects and welds hold two named sites together where the file's bodies meet; stiffen all equalities."""
    for equality in spec.equalities:
        equality.solref, equality.solimp = SOLREF, SOLIMP
        if equality.type not in (_EQ.mjEQ_CONNECT, _EQ.mjEQ_WELD):
            continue
        data, names = nominal.eq_data[nominal.equality(equality.name).id], held_sites(equality.name)
        if equality.objtype == _OBJ.mjOBJ_SITE:
            sites = [spec.site(name) for name in (equality.name1, equality.name2)]
            bodies = [site.parent.name for site in sites]
            places = [(site.pos, site.quat) for site in sites]
        else:
            bodies, level = [name or "world" for name in (equality.name1, equality.name2)], (1.0, 0.0, 0.0, 0.0)
            connect = equality.type == _EQ.mjEQ_CONNECT
            places = [(data[:3], level), (data[3:6], level)]
            places = places if connect else [(data[3:6], data[6:10]), (data[:3], level)]
        for body, name, (pos, quat) in zip(bodies, names, places, strict=True):
            spec.body(body).add_site(name=name, pos=np.array(pos), quat=np.array(quat))
        equality.objtype, equality.name1, equality.name2 = _OBJ.mjOBJ_SITE, *names


def held_sites(equality: str) -> tuple[str, str]:
    """Names of the two sites that a connect or weld holds together."""
    return f"{equality} first", f"{equality} second"
