"""Elements that causes add to a model: springs, leashes that leave a clearance, holding friction, a base. SI units."""

import mujoco
import numpy as np

from rrru.simulation.mujoco_model import BASE, LIMITED, SOFTER, SOLIMP, held_sites, set_options

_JOINT, _EQ = mujoco.mjtJoint, mujoco.mjtEq
_SLIDE = _JOINT.mjJNT_SLIDE
# ASSUME friction holds an arm within its backlash against this many times its load at home and its share of all weight
_HOLDS = 2.0
# a body in a clearance swings as a pendulum of that length, damped by this share of the critical damping
_SWINGING, _G = 0.5, 9.81
# ASSUME the base is as heavy as all that stands on it, and as wide
_BASE_RADIUS_M = 0.3


def swinging_frequency(gap):
    """Angular frequency in 1/s, times its damping, of a body that hangs in a clearance of this in m."""
    return _SWINGING * np.sqrt(_G / gap)


def spring(edit, joint, stiffness):
    """Make a joint a spring of a stiffness in N/m or N m/rad."""
    joint.stiffness[0] = stiffness
    edit.steady(joint, stiffness)
    edit.damped[joint.name.removeprefix(edit.prefix)] = None


def leash(edit, name, sites, gap):
    """Let two sites be as far apart as this in m."""
    tendon = edit.spec.add_tendon(name=f"{name} clearance", limited=LIMITED, range=(0.0, gap))
    edit.leashes[tendon.name] = sites
    tendon.solref_limit, tendon.solimp_limit = SOFTER, SOLIMP
    for site in sites:
        tendon.wrap_site(site)


def damp_swinging(edit, site, gap):
    """Dampers between the two sites of a connect: actuators that only brake, across x, y and z of the second site."""
    first, second = held_sites(site)
    for number, letter in enumerate("xyz"):
        brake = edit.spec.add_actuator(name=f"{site} clearance {letter}", target=first, refsite=second)
        brake.trntype, brake.biastype = mujoco.mjtTrn.mjTRN_SITE, mujoco.mjtBias.mjBIAS_AFFINE
        brake.gear = np.eye(6)[number]
        edit.brakes[brake.name] = f"{site} clearance", swinging_frequency(gap)


def holding_friction(edit, site):
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
    return _HOLDS * abs(_static_load(edit, data)[site]) + share


def _static_load(edit, data):
    """Load of the drives in N m or N in a pose at rest, by joint: the bias that loops cannot bear."""
    model = edit.nominal
    dofs = [model.joint(name).dofadr[0] for name in edit.drives]
    held = np.zeros((data.ne, model.nv))
    for row, unit in zip(held, np.eye(data.nefc), strict=False):
        mujoco.mj_mulJacTVec(model, data, row, unit)
    bearing = np.vstack([np.eye(model.nv)[dofs], held])
    return dict(zip(edit.drives, np.linalg.lstsq(bearing.T, data.qfrc_bias)[0], strict=False))


def _hangs_on(model, body, first):
    """Whether a body is another one or hangs on it."""
    while body > first:
        body = model.body_parentid[body]
    return body == first


def put_on_base(edit):
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


def _unfree(edit, body):
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
