"""Causes of residual errors as MuJoCo's own elements: each changes an `Edit` at a site of the file, by a size.

Sites are names in the MJCF: driven joints (a drive), joints, bodies, connects. A direction is `<name>.x` .. `.z` for
shifts and `<name>.rx` .. `.rz` for turns: of a body's seat, or of the place where a connect or weld holds its first
body, in the frame of what carries it. Sizes are in mm, rad, N, s and kg; what depends on the kind of its joint has rad
and N mm of a hinge, mm and N of a slide.

Elements that causes add to a model are springs, leashes that leave a clearance, holding friction, and a base: SI units.
"""

from collections.abc import Mapping, Sequence

import mujoco
import numpy as np

from rrru.errors import ConfigError
from rrru.simulation.mujoco_model import BASE, LIMITED, MM, SOFTER, SOLIMP, SOLREF, Edit, Place, held_sites, set_options

_JOINT, _EQ, _OBJ = mujoco.mjtJoint, mujoco.mjtEq, mujoco.mjtObj
_HINGE, _SLIDE = _JOINT.mjJNT_HINGE, _JOINT.mjJNT_SLIDE
DIRECTIONS = ("x", "y", "z", "rx", "ry", "rz")

# ASSUME friction holds an arm within its backlash against this many times its load at home and its share of all weight
_HOLDS = 2.0
# a body in a clearance swings as a pendulum of that length, damped by this share of the critical damping
_SWINGING, _G = 0.5, 9.81
# ASSUME the base is as heavy as all that stands on it, and as wide
_BASE_RADIUS_M = 0.3


def _zero_offset(edit: Edit, site: str, size: float) -> None:
    """A drive's zero is off: rad or mm."""
    drive = _drive(edit, site)
    edit.offsets[drive] = size * edit.units(drive)[0]


def _placement(edit: Edit, site: str, size: float) -> None:
    """A length or a seat is off, along or about a direction: mm or rad."""
    edit.shifts[_place(edit, site)] = _of_direction(site, size)


def _warming(edit: Edit, site: str, size: float) -> None:
    """A length or seat moves by this as the robot warms up, as 1 - exp(-t / time_s): mm or rad, and time_s in s."""
    if site == "time_s":
        edit.warming_s = _positive("warming.time_s", size)
    else:
        edit.grows[_place(edit, site)] = _of_direction(site, size)


def _actuator_stiffness(edit: Edit, site: str, size: float) -> None:
    """A drive's servo is compliant: kp in N mm/rad or N/mm, damped as the file's."""
    actuator, (length, force) = edit.drives[_drive(edit, site)], edit.units(site)
    kp = _positive(site, size) * force / length
    actuator.biasprm[2] *= np.sqrt(kp / actuator.gainprm[0])
    actuator.gainprm[0], actuator.biasprm[1] = kp, -kp
    edit.steady(edit.spec.joint(site), kp)


def _servo_lag(edit: Edit, site: str, size: float) -> None:
    """A drive's servo is slow: damping kv of kp times this in s, which its feedforward does not compensate."""
    actuator = edit.drives[_drive(edit, site)]
    edit.lags[site] = _positive(site, size)
    actuator.biasprm[2] -= size * actuator.gainprm[0]


def _speed_friction(edit: Edit, site: str, size: float) -> None:
    """Friction in a joint grows with the square of its speed: N mm s^2/rad^2 or N s^2/mm^2."""
    joint, (length, force) = edit.spec.joint(_joint(edit, site)), edit.units(site)
    joint.damping[1] = _positive(site, size) * force / length**2


def _joint_friction(edit: Edit, site: str, size: float) -> None:
    """Dry friction in a joint: N mm or N."""
    joint = edit.spec.joint(_joint(edit, site))
    joint.frictionloss = _positive(site, size) * edit.units(site)[1]
    joint.solref_friction, joint.solimp_friction = SOLREF, SOLIMP


def _play(edit: Edit, site: str, size: float) -> None:
    """Backlash between a drive's motor and its arm, full width: rad or mm. Friction on the base holds the arm."""
    joint, name = edit.spec.joint(_drive(edit, site)), f"{site} play"
    if len(joint.parent.joints) > 1:
        further = ", ".join(same.name for same in joint.parent.joints if same.name != site)
        allowed = "a drive whose body has no other joint"
        raise ConfigError(f"play: {site} shares its body with {further}; allowed: {allowed}")
    half, (length, _) = 0.5 * _positive(site, size), edit.units(site)
    ends = {"range": (-half * length, half * length), "limited": LIMITED}
    edit.add_joint(joint.parent.name, name, joint.type, joint.axis, pos=joint.pos, **ends)
    arm = edit.spec.add_tendon(name=name)
    arm.wrap_joint(site, 1.0)
    arm.wrap_joint(name, 1.0)
    arm.frictionloss = holding_friction(edit, site)
    arm.solref_friction, arm.solimp_friction = SOLREF, SOLIMP


def _play_friction(edit: Edit, site: str, size: float) -> None:
    """The friction that holds an arm within its backlash: N mm or N; by default enough for its weight."""
    tendon = edit.spec.tendon(f"{_drive(edit, site)} play")
    if tendon is None:
        raise ConfigError(f"play_friction: {site} has no backlash; allowed: a drive under the key `play`")
    tendon.frictionloss = _positive(site, size) * edit.units(site)[1]


def _link_stiffness(edit: Edit, site: str, size: float) -> None:
    """A body is compliant against its joint, along or about a direction of its own: N/mm or N mm/rad."""
    body, direction = _body_place(edit, site)
    kind, length, force = (_HINGE, 1.0, 1.0 / MM) if direction > 2 else (_SLIDE, 1.0 / MM, 1.0)
    name = f"{site} spring"
    spring(edit, edit.add_joint(body, name, kind, np.eye(3)[direction % 3]), _positive(site, size) * force / length)


def _clearance(edit: Edit, site: str, size: float) -> None:
    """Radial clearance of a hinge, or that of a ball joint or connect in all directions: mm."""
    gap, spec = _positive(site, size) / MM, edit.spec
    if site in [one.name for one in spec.equalities if one.type == _EQ.mjEQ_CONNECT]:
        spec.delete(spec.equality(site))
        leash(edit, site, held_sites(site), gap)
        damp_swinging(edit, site, gap)
        return
    joint = spec.joint(_joint(edit, site, "a hinge, ball joint or connect", (_HINGE, _JOINT.mjJNT_BALL)))
    body, names = joint.parent, held_sites(f"{site} pin")
    body.parent.add_site(name=names[0])  # where, its Shape says
    body.add_site(name=names[1], pos=joint.pos)
    edit.seats[names[0]] = names[1]
    # joints in one body share their seat: clearance there acts in all directions
    alone = len(body.joints) == 1 and joint.type == _HINGE
    axes = np.linalg.svd(np.array(joint.axis)[None])[2][1:] if alone else np.eye(3)
    for number, axis in enumerate(axes, 1):
        name = f"{site} clearance {number}"
        edit.add_joint(body.name, name, _SLIDE, axis)
        edit.damped[name] = swinging_frequency(gap)
    leash(edit, site, names, gap)


def _payload(edit: Edit, site: str, size: float) -> None:
    """A mass at a body's centre that the controller does not know: kg."""
    edit.masses[_known(site, [body.name for body in edit.spec.bodies[1:]], "a body")] = _positive(site, size)


def _base_tilt(edit: Edit, site: str, size: float) -> None:
    """The base is not level: turned about its x or y against gravity, rad."""
    edit.tilt["xy".index(_known(site, ("x", "y"), "x or y"))] = size


def _base_stiffness(edit: Edit, site: str, size: float) -> None:
    """The base stands on springs along or about the robot's axes: N/mm or N mm/rad; without one it is rigid."""
    direction = DIRECTIONS.index(_known(site, DIRECTIONS, "a direction"))
    if not edit.prefix:
        put_on_base(edit)
    kind, factor = (_HINGE, 1.0 / MM) if direction > 2 else (_SLIDE, MM)
    joint = edit.add_joint(BASE, f"base {site}", kind, np.eye(3)[direction % 3])
    spring(edit, joint, _positive(site, size) * factor)


# in the order in which they are applied
CAUSES = {
    "zero_offset": _zero_offset,
    "placement": _placement,
    "warming": _warming,
    "actuator_stiffness": _actuator_stiffness,
    "servo_lag": _servo_lag,
    "speed_friction": _speed_friction,
    "joint_friction": _joint_friction,
    "play": _play,
    "play_friction": _play_friction,
    "link_stiffness": _link_stiffness,
    "clearance": _clearance,
    "payload": _payload,
    "base_tilt": _base_tilt,
    "base_stiffness": _base_stiffness,
}
# causes that act only while the robot moves
MOVING = ("servo_lag", "speed_friction")


def apply(edit: Edit, causes: Mapping[str, Mapping[str, float]]) -> None:
    """Change an Edit by causes, {name: {site: size}}; raises ConfigError naming what does not fit."""
    for name in causes:
        if name not in CAUSES:
            raise ConfigError(f"mujoco: unknown cause {name!r}; known: {', '.join(CAUSES)}")
    for name, change in CAUSES.items():
        for site, size in causes.get(name, {}).items():
            try:
                change(edit, site, float(size))
            except ConfigError as error:
                raise ConfigError(f"mujoco.causes.{name}: {error}") from None
    if edit.grows and edit.warming_s is None:
        raise ConfigError("mujoco.causes.warming: no time_s; allowed: the time constant in s besides the sites")


def _known(site: str, allowed: Sequence[str], what: str) -> str:
    """The site, if it is one of those allowed."""
    if site not in allowed:
        raise ConfigError(f"{site!r} is not {what}; allowed: {', '.join(allowed)}")
    return site


def _positive(site: str, size: float) -> float:
    """The size, if it is positive."""
    if not size > 0.0:
        raise ConfigError(f"{site} is {size:g}; allowed: a positive number")
    return size


def _drive(edit: Edit, site: str) -> str:
    """The site, if it is a driven joint."""
    return _known(site, tuple(edit.drives), "a drive")


def _joint(
    edit: Edit, site: str, noun: str = "a joint", kinds: Sequence[mujoco.mjtJoint] = (_HINGE, _SLIDE, _JOINT.mjJNT_BALL)
) -> str:
    """The site, if it is a joint of the file of one of these kinds."""
    nominal = edit.nominal
    return _known(
        site, [nominal.joint(j).name for j in range(nominal.njnt) if _JOINT(nominal.jnt_type[j]) in kinds], noun
    )


def _body_place(edit: Edit, site: str) -> tuple[str, int]:
    """Body and number of the direction of a site `<body>.<direction>`."""
    name, _, direction = site.rpartition(".")
    bodies = [body.name for body in edit.spec.bodies[1:]]
    if direction not in DIRECTIONS or name not in bodies:
        raise ConfigError(f"{site!r} is no direction of a body; allowed: one of {', '.join(bodies)}, and .x to .rz")
    return name, DIRECTIONS.index(direction)


def _place(edit: Edit, site: str) -> Place:
    """Kind, name and number of the direction of the element that a placement moves."""
    name, _, direction = site.rpartition(".")
    held = [one.name for one in edit.spec.equalities if one.objtype == _OBJ.mjOBJ_SITE]
    if direction in DIRECTIONS and name in held:
        return "site", held_sites(name)[0], DIRECTIONS.index(direction)
    return "body", *_body_place(edit, site)


def _of_direction(site: str, size: float) -> float:
    """Size in m or rad of a site that ends in a direction."""
    return size if site.rpartition(".")[2].startswith("r") else size / MM


def swinging_frequency(gap: float) -> float:
    """Angular frequency in 1/s, times its damping, of a body that hangs in a clearance of this in m."""
    return float(_SWINGING * np.sqrt(_G / gap))


def spring(edit: Edit, joint: mujoco.MjsJoint, stiffness: float) -> None:
    """Make a joint a spring of a stiffness in N/m or N m/rad."""
    joint.stiffness[0] = stiffness
    edit.steady(joint, stiffness)
    edit.damped[joint.name.removeprefix(edit.prefix)] = None


def leash(edit: Edit, name: str, sites: tuple[str, str], gap: float) -> None:
    """Let two sites be as far apart as this in m."""
    tendon = edit.spec.add_tendon(name=f"{name} clearance", limited=LIMITED, range=(0.0, gap))
    edit.leashes[tendon.name] = sites
    tendon.solref_limit, tendon.solimp_limit = SOFTER, SOLIMP
    for site in sites:
        tendon.wrap_site(site)


def damp_swinging(edit: Edit, site: str, gap: float) -> None:
    """Dampers between the two sites of a connect: actuators that only brake, across x, y and z of the second site."""
    first, second = held_sites(site)
    for number, letter in enumerate("xyz"):
        brake = edit.spec.add_actuator(name=f"{site} clearance {letter}", target=first, refsite=second)
        brake.trntype, brake.biastype = mujoco.mjtTrn.mjTRN_SITE, mujoco.mjtBias.mjBIAS_AFFINE
        brake.gear = np.eye(6)[number]
        edit.brakes[brake.name] = f"{site} clearance", swinging_frequency(gap)


def holding_friction(edit: Edit, site: str) -> float:
    """Friction in N m or N that holds the arm of a drive: more than its load at home."""
    model, data = edit.nominal, mujoco.MjData(edit.nominal)
    for number in range(model.njnt):
        name = model.joint(number).name
        data.joint(name).qpos = edit.home[name]
    mujoco.mj_forward(model, data)
    loops = ((model.eq_type == _EQ.mjEQ_CONNECT) | (model.eq_type == _EQ.mjEQ_WELD)).any()
    joint = model.joint(site)
    behind = [b for b in range(1, model.nbody) if loops or _hangs_on(model, b, joint.bodyid[0])]
    weight = np.linalg.norm(model.opt.gravity) * np.append(model.body_mass[behind], edit.payload_kg)
    places = np.vstack([data.xipos[behind], data.body(edit.platform).xpos]) - data.joint(site).xanchor
    lever = np.linalg.norm(np.cross(data.joint(site).xaxis, places), axis=1)
    share = (weight.sum() if joint.type[0] == _SLIDE else weight @ lever) / (len(edit.drives) if loops else 1)
    return float(_HOLDS * abs(_static_load(edit, data)[site]) + share)


def _static_load(edit: Edit, data: mujoco.MjData) -> dict[str, float]:
    """Load of the drives in N m or N in a pose at rest, by joint: the bias that loops cannot bear."""
    model = edit.nominal
    dofs = [model.joint(name).dofadr[0] for name in edit.drives]
    held = np.zeros((data.ne, model.nv))
    for row, unit in zip(held, np.eye(data.nefc), strict=False):
        mujoco.mj_mulJacTVec(model, data, row, unit)
    bearing = np.vstack([np.eye(model.nv)[dofs], held])
    return dict(zip(edit.drives, np.linalg.lstsq(bearing.T, data.qfrc_bias)[0], strict=False))


def _hangs_on(model: mujoco.MjModel, body: int, first: int) -> bool:
    """Whether a body is another one or hangs on it."""
    while body > first:
        body = model.body_parentid[body]
    return body == first


def put_on_base(edit: Edit) -> None:
    """Put all bodies of the world on a base body; free bodies get slides and a ball joint instead."""
    for body in edit.spec.worldbody.bodies:
        if [one.type for one in body.joints] == [_JOINT.mjJNT_FREE]:
            _unfree(edit, body)
    model = mujoco.MjSpec()
    set_options(model, edit.nominal.opt.gravity)
    mass = edit.nominal.body_mass.sum()
    inertia = {"mass": mass, "inertia": np.full(3, _BASE_RADIUS_M**2 * mass), "explicitinertial": True}
    base = model.worldbody.add_body(name=BASE, **inertia)
    model.attach(edit.spec, frame=base.add_frame(), prefix="robot ")
    edit.spec, edit.prefix = model, "robot "


def _unfree(edit: Edit, body: mujoco.MjsBody) -> None:
    """Three slides and a ball joint of the same pose at home in place of a free joint."""
    (free,), nominal = body.joints, edit.nominal.body(body.name)
    values, name = edit.home.pop(free.name), free.name
    edit.spec.delete(free)
    turn, back, quat = np.zeros(9), np.zeros(4), np.zeros(4)
    mujoco.mju_quat2Mat(turn, nominal.quat)
    mujoco.mju_negQuat(back, nominal.quat)
    mujoco.mju_mulQuat(quat, back, values[3:])
    for letter, axis, value in zip("xyz", np.eye(3), turn.reshape(3, 3).T @ (values[:3] - nominal.pos), strict=True):
        edit.add_joint(body.name, f"{name} {letter}", _SLIDE, axis)
        edit.home[f"{name} {letter}"] = np.array([value])
    body.add_joint(name=f"{name} turn", type=_JOINT.mjJNT_BALL)
    edit.home[f"{name} turn"] = quat
