"""Stiffness and backlash of drives in an MJCF: a servo's kp, and a joint with a range between motor and driven joint.

Between both a rotor with the inertia of all that the joint moves is assumed, without which the two joints would be
redundant. Friction F on the arm, along a tendon over both joints, holds it within the backlash against its load. The
servo has to overcome it: a drive turns back by the backlash and 2 F / kp before the arm does, and the width w found is
their sum. Where friction alone winds up more than w, the file has no backlash, and F = w kp / 2.
"""

from collections.abc import Mapping
from xml.etree.ElementTree import Element

import mujoco
import numpy as np

from rrru.formats.file_changes import Found
from rrru.formats.mjcf_reader import MM
from rrru.formats.mjcf_text import MjcfDocument
from rrru.formats.structure import Structure
from rrru.formats.xml_text import sizes, words

_SERVOS = ("position", "general")
# a limit whose deflection is far less than any backlash
_STIFF = "0.9999 0.9999 0.0001"
# ASSUME friction holds an arm against this many times the largest load of the campaign
_HOLDS = 1.25
# ASSUME friction accelerates an arm without load by this, by kind: rad/s^2, m/s^2
_DRAGS = {"R": 2.0, "P": 1.0}
_NONE = dict.fromkeys(("ref", "springref", "stiffness", "damping", "frictionloss", "margin"), "0")


def write_stiffness(document: MjcfDocument, structure: Structure, found: Found) -> list[str]:
    """Write the stiffness of the drives' servos into a document; returns what it cannot represent, in words."""
    model, lost = structure.assembly.model, []
    ratio = any("dampratio" in one.attrib for one in document.root.iter())
    for number, (compliance, error) in found.compliance.items():
        if not compliance > 0.0:
            continue
        move, joint = structure.driven[number], structure.joints[number]
        servos = [k for k in range(model.nu) if _is_servo(model, k, joint) and document.actuators[k].tag in _SERVOS]
        if len(servos) != 1:
            lost.append(f"compliance of {move.origin}: it has {len(servos)} position servos, not one")
            continue
        # from rad per N mm to N m per rad, from mm per N to N per m
        unit, scale = ("N m/rad", 1.0 / MM) if move.kind == "R" else ("N/m", MM)
        stiffness, element = scale / compliance, document.actuators[servos[0]]
        gain, bias = model.actuator_gainprm[servos[0], 0], model.actuator_biasprm[servos[0]]
        document.note(element, f"corrected: stiffness +- {sizes(stiffness * error / compliance)} {unit}; was {gain:g}")
        # as well damped as it was
        damping = -bias[2] * np.sqrt(stiffness / gain)
        if element.tag == "general":
            element.set("gainprm", words(stiffness))
            element.set("biasprm", words([bias[0], -stiffness, -damping]))
            continue
        element.set("kp", words(stiffness))
        if damping and not ratio:
            element.set("kv", words(damping))
    return lost


def _is_servo(model: mujoco.MjModel, k: int, joint: int) -> bool:
    """Whether an actuator is a position servo of a joint."""
    return bool(
        model.actuator_trnid[k, 0] == joint and model.actuator_biasprm[k, 1] == -model.actuator_gainprm[k, 0] != 0.0
    )


def write_backlash(
    document: MjcfDocument, structure: Structure, found: Found, lines: Mapping[int, tuple[np.ndarray, np.ndarray]]
) -> None:
    """Write the lost motion of drives into a document; lines: (axis, point in mm) of changed joints, by joint."""
    inertia = _inertia(structure.assembly.model)
    for number, (width, error) in found.play.items():
        if not width > 0.0:
            continue
        move, joint = structure.driven[number], structure.joints[number]
        for tag in ("joint", "fixed"):
            # the file may have been corrected before
            document.drop(tag, f"{move.origin}_play")
        # to m and N m, or rad and N
        scale, force, unit = (1.0, 1.0 / MM, "rad") if move.kind == "R" else (1.0 / MM, 1.0, "m")
        load = max(force * found.loads.get(number, 0.0), _DRAGS[move.kind] * inertia[joint])
        lost, holding = scale * width, _HOLDS * load
        stiffness = _stiffness(structure, found, number)
        backlash = lost - 2.0 * holding / stiffness
        text = f"lost motion of {lost:.4g} +- {sizes(scale * error)} {unit} at {move.origin}"
        hard = {"solreffriction": _hard(structure), "solimpfriction": _STIFF}
        if backlash <= 0.0:
            element = document.joints[joint]
            element.attrib |= hard | {"frictionloss": words(0.5 * lost * stiffness)}
            document.note(element, f"found: {text}, less than the wind-up by friction against its load: friction alone")
            continue
        line = lines.get(joint, _line(structure, joint))
        element = _write_joint(document, structure, (number, line, backlash), inertia[joint])
        document.note(element, f"found: {text}, of which friction on the arm winds up {lost - backlash:.2g}")
        section = document.root.find("tendon")
        section = document.inside(document.root, "tendon", {}) if section is None else section
        attributes = {"name": f"{move.origin}_play", "frictionloss": words(holding)}
        tendon = document.inside(section, "fixed", attributes | hard)
        document.note(tendon, f"assumed: {_HOLDS:g} times the largest load, or inertia, holds the arm within backlash")
        for name in (move.origin, f"{move.origin}_play"):
            document.inside(tendon, "joint", {"joint": name, "coef": "1"})


def _stiffness(structure: Structure, found: Found, number: int) -> float:
    """Stiffness of a drive in the corrected file, N m/rad or N/m, inf where it has no compliant servo."""
    model, move = structure.assembly.model, structure.driven[number]
    compliance, _ = found.compliance.get(number, (0.0, 0.0))
    if compliance > 0.0:
        return (1.0 / MM if move.kind == "R" else MM) / compliance
    gains = [model.actuator_gainprm[k, 0] for k in range(model.nu) if _is_servo(model, k, structure.joints[number])]
    return sum(gains) or np.inf


def _line(structure: Structure, joint: int) -> tuple[np.ndarray, np.ndarray]:
    """Axis and point in mm of a joint in the file as it came."""
    return structure.assembly.model.jnt_axis[joint], MM * structure.assembly.model.jnt_pos[joint]


def _hard(structure: Structure) -> str:
    """A solref as stiff as the file's step allows."""
    return words([2.0 * structure.assembly.model.opt.timestep, 1.0])


def _write_joint(
    document: MjcfDocument,
    structure: Structure,
    what: tuple[int, tuple[np.ndarray, np.ndarray], float],
    inertia: float,
) -> Element:
    """Write a joint with a range behind a driven one; what: drive, line (axis, point in mm), backlash."""
    (number, (axis, point), backlash), model = what, structure.assembly.model
    move, joint = structure.driven[number], structure.joints[number]
    half = 0.5 * backlash * (np.degrees(1.0) if move.kind == "R" and document.degrees else 1.0)
    own_rotor = model.dof_armature[model.jnt_dofadr[joint]] > 0.0
    attributes = {
        "name": f"{move.origin}_play",
        "type": "hinge" if move.kind == "R" else "slide",
        "axis": words(axis),
        "pos": words(point / MM),
        "limited": "true",
        "range": words([-half, half]),
        "armature": words(0.0 if own_rotor else inertia),
        "solreflimit": _hard(structure),
        "solimplimit": _STIFF,
    }
    return document.behind(document.joints[joint], "joint", attributes | _NONE)


def _inertia(model: mujoco.MjModel) -> np.ndarray:
    """Inertia (joints,) about or along each joint in the reference configuration, kg m^2 or kg."""
    data, matrix = mujoco.MjData(model), np.zeros((model.nv, model.nv))
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, matrix)
    return np.asarray(np.diag(matrix)[model.jnt_dofadr])
