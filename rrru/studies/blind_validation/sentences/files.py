"""Robots' files read again by other code than the package's: a URDF by its tags, an MJCF by MuJoCo. mm, rad.

Loops of an MJCF are closed by Newton's method on MuJoCo's own constraint Jacobian, at given actuator positions.
"""

from xml.etree import ElementTree

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

MM = 1000.0
_STEPS, _CLOSED_M = 40, 1e-10


def file_poses(file, draw, values, payload_kg):
    """Positions (n, 3), rotations (n, 3, 3) of the platform of a file at actuator positions (n, K), and its sites.

    Sites: places (3,) on the platform by name. The drives of an MJCF without loops deflect by their servo stiffness.
    """
    if draw.kind == "urdf":
        return (*_urdf_poses(file, values), {})
    return _mjcf_poses(file, draw, values, payload_kg)


def has_play(file):
    """Whether an MJCF has joints that model the backlash of others."""
    model = mujoco.MjModel.from_xml_path(str(file))
    driven = set(model.actuator_trnid[:, 0].tolist())
    names = [model.joint(j).name for j in range(model.njnt) if j not in driven]
    return any(name.endswith("play") or " play" in name for name in names)


def _urdf_poses(file, values):
    """Positions and rotations of the link `tool` of a URDF at drive values of q1, q2, .."""
    joints = {joint.find("child").get("link"): joint for joint in ElementTree.parse(file).getroot().iter("joint")}
    way, link = [], "tool"
    while link in joints and link != "base":
        way.insert(0, joints[link])
        link = joints[link].find("parent").get("link")
    place, turn = np.zeros((len(values), 3)), np.tile(np.eye(3), (len(values), 1, 1))
    for joint in way:
        origin, kind = joint.find("origin"), joint.get("type")
        shift = _numbers(origin, "xyz")
        place = place + MM * turn @ shift
        turn = turn @ Rotation.from_euler("xyz", _numbers(origin, "rpy")).as_matrix()
        if kind == "fixed":
            continue
        axis = _numbers(joint.find("axis"), "xyz", "1 0 0")
        value = values[:, int(joint.get("name").removeprefix("q")) - 1]
        along = np.outer(value, axis / np.linalg.norm(axis))
        if kind == "prismatic":
            place = place + (turn @ along[:, :, None])[:, :, 0]
        else:
            turn = turn @ Rotation.from_rotvec(along).as_matrix()
    return place, turn


def _numbers(tag, key, default="0 0 0"):
    """Numbers (3,) of an attribute of a tag that may be missing."""
    return np.array((default if tag is None else tag.get(key, default)).split(), dtype=float)


def _mjcf_poses(file, draw, values, payload_kg):
    """Positions and rotations of the platform of an MJCF at drive values, and its sites."""
    model = mujoco.MjModel.from_xml_path(str(file))
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    names = [column.rpartition("_")[0] for column in draw.nominal.columns]
    body = model.body("tool" if "tool" in [model.body(k).name for k in range(model.nbody)] else "plate").id
    scale = np.array([1e-3 if unit == "mm" else 1.0 for unit in draw.nominal.units])
    joints = [model.joint(name) for name in names]
    address, dof = ([int(getattr(one, key)[0]) for one in joints] for key in ("qposadr", "dofadr"))
    zero, start = model.qpos0[address], data.qpos.copy()
    stiff = np.array([model.actuator_gainprm[_servo(model, one.id), 0] for one in joints])
    places, turns = [], []
    loops = bool(((model.eq_type == mujoco.mjtEq.mjEQ_CONNECT) | (model.eq_type == mujoco.mjtEq.mjEQ_WELD)).any())
    own_kg = float(model.body_mass[body])
    for row, load in zip(values, payload_kg, strict=True):
        data.qpos[:], data.qvel[:] = start, 0.0
        data.qpos[address] = zero + scale * row
        if loops:
            _close(model, data, dof)
        elif np.isfinite(stiff).all():
            model.body_mass[body] = own_kg + load
            mujoco.mj_forward(model, data)
            data.qpos[address] -= data.qfrc_bias[dof] / stiff
        mujoco.mj_kinematics(model, data)
        places.append(MM * data.xpos[body])
        turns.append(data.xmat[body].reshape(3, 3).copy())
    model.body_mass[body] = own_kg
    sites = {
        model.site(k).name: MM * model.site_pos[k] for k in range(model.nsite) if int(model.site_bodyid[k]) == body
    }
    return np.array(places), np.array(turns), sites


def _servo(model, joint):
    """Number of the actuator of a joint."""
    return int(np.flatnonzero(model.actuator_trnid[:, 0] == joint)[0])


def _close(model, data, driven):
    """Close the loops at the actuator positions; NaN in qpos where Newton's method does not converge."""
    free = np.setdiff1d(np.arange(model.nv), driven)
    for _ in range(_STEPS):
        mujoco.mj_fwdPosition(model, data)
        count = data.ne
        off = data.efc_pos[:count]
        if np.abs(off).max() < _CLOSED_M:
            return
        jacobian = data.efc_J.reshape(-1, model.nv)[:count]
        step = np.zeros(model.nv)
        step[free] = -np.linalg.lstsq(jacobian[:, free], off, rcond=None)[0]
        step *= min(1.0, 0.3 / max(np.abs(step).max(), 1e-30))
        mujoco.mj_integratePos(model, data.qpos, step, 1.0)
    data.qpos[:] = np.nan
