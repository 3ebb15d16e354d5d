"""Keyframes of an MJCF whose numbers were changed: values of all joints, with closed loops.

Newton on the equalities with the driven joints held:  J dq = -r,  the smallest dq. m and rad.
"""

from collections.abc import Collection, Iterable

import mujoco
import numpy as np

from rrru.formats.mjcf_reader import backlash_joints
from rrru.formats.mjcf_text import MjcfDocument
from rrru.formats.xml_text import own_children, words

_STEPS, _CLOSED_M = 30, 1e-12


def closed_qpos(model: mujoco.MjModel, qpos: np.ndarray, held: Collection[int]) -> np.ndarray:
    """The qpos (nq,) next to one at which all equalities of a model hold, joints `held` as they are."""
    model.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    data, free = mujoco.MjData(model), np.ones(model.nv, dtype=bool)
    free[model.jnt_dofadr[sorted(held)]] = False
    data.qpos[:] = qpos
    for _ in range(_STEPS):
        for step in (mujoco.mj_kinematics, mujoco.mj_comPos, mujoco.mj_makeConstraint):
            step(model, data)
        # equalities come before all other constraints
        lack = data.efc_pos[: data.ne]
        if np.abs(lack).max(initial=0.0) < _CLOSED_M:
            break
        slope, change = data.efc_J.reshape(-1, model.nv)[: data.ne, free], np.zeros(model.nv)
        change[free] = -np.linalg.lstsq(slope, lack, rcond=1e-9)[0]
        mujoco.mj_integratePos(model, data.qpos, change, 1.0)
    return np.array(data.qpos)


def close_keys(document: MjcfDocument, before: mujoco.MjModel, driven: Iterable[str], model: mujoco.MjModel) -> None:
    """Write the keyframes of a document whose file had the model `before` and now has another one.

    driven: names of the driven joints, which stay where they are. Where there is no keyframe and loops stand open, a
    new one closes them.
    """
    keys = [one for section in document.root.findall("keyframe") for one in own_children(section)]
    held = {model.joint(name).id for name in driven} | set(backlash_joints(model))
    for k, element in enumerate(keys):
        qpos = closed_qpos(model, _carried(before, model, before.key_qpos[k], "jnt_qposadr", model.qpos0), held)
        if len(qpos) != before.nq or np.abs(qpos - before.key_qpos[k]).max() > _CLOSED_M:
            element.set("qpos", words(qpos))
        if "qvel" in element.attrib:
            element.set("qvel", words(_carried(before, model, before.key_qvel[k], "jnt_dofadr", np.zeros(model.nv))))
    qpos = closed_qpos(model, model.qpos0, held)
    if not keys and np.abs(qpos - model.qpos0).max() > _CLOSED_M:
        section = document.inside(document.root, "keyframe", {})
        document.inside(section, "key", {"name": "corrected", "qpos": words(qpos)})


def _carried(
    before: mujoco.MjModel, model: mujoco.MjModel, values: np.ndarray, address: str, default: np.ndarray
) -> np.ndarray:
    """Values per joint of one model as those of another, which has more joints; these have the default's."""
    result, old = np.array(default), {before.joint(j).name for j in range(before.njnt)}
    common = [j for j in range(model.njnt) if not model.joint(j).name or model.joint(j).name in old]
    starts, ends = getattr(before, address), getattr(model, address)
    for j, k in enumerate(common):
        stop = starts[j + 1] if j + 1 < before.njnt else len(values)
        result[ends[k] : ends[k] + stop - starts[j]] = values[starts[j] : stop]
    return result
