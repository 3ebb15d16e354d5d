"""Stiffness and play of drives in an MJCF: a servo's kp, and a joint with a range between motor and driven joint.

Between both a rotor as heavy as what the joint moves is assumed, without which they could not be told apart. Friction
on the arm, along a tendon over both joints, holds it within its play.
"""

import mujoco
import numpy as np

from rrru.robots.from_mjcf import MM
from rrru.robots.xml_text import sizes, words

_SERVOS = ("position", "general")
# a limit that gives way by far less than any play
_HARD = {"solimplimit": "0.9999 0.9999 0.0001"}
# ASSUME friction holds an arm against this many times the largest load of the campaign
_HOLDS = 2.0
_NONE = dict.fromkeys(("ref", "springref", "stiffness", "damping", "frictionloss", "margin"), "0")


def write_stiffness(document, structure, found):
    """Write the stiffness of the drives' servos into a document; returns what it cannot hold, in words."""
    model, lost = structure.assembly.model, []
    for number, (compliance, error) in found.compliance.items():
        if not compliance > 0.0:
            continue
        move = structure.driven[number]
        servos = [
            k for k in range(model.nu) if _is_servo(model, k, move.joint) and document.actuators[k].tag in _SERVOS
        ]
        if len(servos) != 1:
            lost.append(f"compliance of {move.origin}: it has {len(servos)} position servos, not one")
            continue
        # from rad per N mm to N m per rad, from mm per N to N per m
        unit, scale = ("N m/rad", 1.0 / MM) if move.kind == "R" else ("N/m", MM)
        stiffness, element = scale / compliance, document.actuators[servos[0]]
        was = f"{model.actuator_gainprm[servos[0], 0]:g}"
        document.note(element, f"corrected: stiffness +- {sizes(stiffness * error / compliance)} {unit}; was {was}")
        if element.tag == "position":
            element.set("kp", words(stiffness))
        else:
            bias = model.actuator_biasprm[servos[0]]
            element.set("gainprm", words(stiffness))
            element.set("biasprm", words([bias[0], -stiffness, bias[2]]))
    return lost


def _is_servo(model, k, joint):
    """Whether an actuator is a position servo of a joint."""
    return bool(
        model.actuator_trnid[k, 0] == joint and model.actuator_biasprm[k, 1] == -model.actuator_gainprm[k, 0] != 0.0
    )


def write_plays(document, structure, found, lines):
    """Write the play of drives into a document; lines: (axis, point in mm) of joints that have changed, by joint."""
    model = structure.assembly.model
    inertia = _inertia(model)
    for number, (width, error) in found.play.items():
        if not width > 0.0:
            continue
        move = structure.driven[number]
        scale, unit = (1.0, "rad") if move.kind == "R" else (MM, "m")
        half = 0.5 * width / scale * (np.degrees(1.0) if move.kind == "R" and document.degrees else 1.0)
        axis, point = lines.get(move.joint, (model.jnt_axis[move.joint], MM * model.jnt_pos[move.joint]))
        own_rotor = model.dof_armature[model.jnt_dofadr[move.joint]] > 0.0
        hard = words([2.0 * model.opt.timestep, 1.0])
        attributes = {
            "name": f"{move.origin}_play",
            "type": "hinge" if move.kind == "R" else "slide",
            "axis": words(axis),
            "pos": words(point / MM),
            "limited": "true",
            "range": words([-half, half]),
            "armature": words(0.0 if own_rotor else inertia[move.joint]),
            "solreflimit": hard,
        }
        element = document.behind(document.joints[move.joint], "joint", attributes | _HARD | _NONE)
        text = f"found: play of {width / scale:.4g} +- {sizes(error / scale)} {unit} between motor and {move.origin}"
        document.note(element, text)
        _hold(document, move.origin, _HOLDS * found.loads.get(number, 0.0) / (MM if move.kind == "R" else 1.0), hard)


def _hold(document, joint, friction, hard):
    """Write the friction, in N m or N, that holds an arm within the play of its drive."""
    section = document.root.find("tendon")
    section = document.inside(document.root, "tendon", {}) if section is None else section
    attributes = {"name": f"{joint}_play", "frictionloss": words(friction), "solreffriction": hard}
    tendon = document.inside(section, "fixed", attributes | {"solimpfriction": _HARD["solimplimit"]})
    document.note(tendon, f"assumed: {_HOLDS:g} times the largest load on {joint} holds the arm within its play")
    for name in (joint, f"{joint}_play"):
        document.inside(tendon, "joint", {"joint": name, "coef": "1"})


def _inertia(model):
    """Inertia (joints,) about or along each joint in the reference configuration, kg m^2 or kg."""
    data, matrix = mujoco.MjData(model), np.zeros((model.nv, model.nv))
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, matrix)
    return np.diag(matrix)[model.jnt_dofadr]
