"""Robots from files that other tools write: a chain of a URDF, or the legs of an MJCF with closed loops.

MuJoCo's own parser reads them; `from_mjcf` and `from_urdf` say how bodies become parts and legs. A leg that ends in a
bar is a Bar: a ball joint, a ball or universal joint, and between them nothing or a driven slide along their line. It
has no idle spin and is faster. Columns and sites have the joints' names. Files count in m and kg, robots in mm; angles
in rad.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from rrru.errors import ConfigError, not_a_file, why_unreadable
from rrru.formats import urdf_reader as urdf_files
from rrru.formats.couplings import JointCoupling, couplings_of_equalities, couplings_of_mimics
from rrru.formats.inertia import point_masses_of
from rrru.formats.joint_graph import Move
from rrru.formats.mjcf_reader import MEASURED_TOOL, MM, Assembly
from rrru.formats.structure import structure_of
from rrru.kinematics.end_effectors import shared_joints, with_hands
from rrru.kinematics.general_robot import GeneralRobot
from rrru.kinematics.legs import Drive, Legs, Parts, unit_twist

# a drive without limits works this far about its home value
_RANGE = {"rad": 1.0, "mm": 100.0}
_UNITS = {"R": "rad", "P": "mm"}
_TRN = mujoco.mjtTrn
# a model's numbers in m, kg and rad that define a robot, and their limit: larger ones are mistakes and would overflow
_DEFINING = (
    "body_pos",
    "body_quat",
    "body_ipos",
    "body_mass",
    "jnt_pos",
    "jnt_axis",
    "jnt_range",
    "site_pos",
    "eq_data",
)
_MOST = 1e9


def from_urdf(
    path: str | Path,
    base: str | None = None,
    tip: str | None = None,
    home: Mapping[str, float] | None = None,
    tips: Mapping[str, str] | None = None,
    carries: Mapping[str, Sequence[str]] | None = None,
    **options: Any,
) -> GeneralRobot:
    """The GeneralRobot of a URDF's chain from the link base, by default the root, to the link tip, the only last one.

    All joints between them are driven, except those that mimic others. home: values by driven joint of the home pose in
    rad or mm, by default 0, or the middle of a range without it; tips: instead of tip the links of several end
    effectors by name, carries: the targets on each, see `rrru.kinematics.end_effectors`; options: of GeneralRobot. The
    frames are the links'. Raises ConfigError for a file that cannot be read.
    """
    file = _existing(path)
    if tips or carries:
        if not tips or len(tips) < 2 or tip:
            raise ConfigError(f"{file}: tips {', '.join(tips or ()) or 'none'}; allowed: two or more, and no tip")
        arms = {arm: from_urdf(path, base, link, home, **options) for arm, link in tips.items()}
        robot: GeneralRobot = with_hands(arms, shared_joints(arms), carries)
        return robot
    return _robot(*urdf_parts(file, base, tip, home), {"up_stated": "up" in options} | options)


def with_tip(section: dict[str, Any]) -> dict[str, Any]:
    """A robot's entry in the configuration with the tip that its URDF has by default; other entries as they are.

    A corrected file may have further links at its tip.
    """
    if "urdf" not in section or section.get("tip") or section.get("tips"):
        return section
    file = _existing(section["urdf"])
    return section | {"tip": urdf_files.ends(urdf_files.read(file), section.get("base"), None, file)[1]}


def urdf_parts(
    path: str | Path, base: str | None = None, tip: str | None = None, home: Mapping[str, float] | None = None
) -> tuple[Assembly, dict[int, list[np.ndarray]], dict[int, JointCoupling]]:
    """The Assembly of a URDF's chain, its driven joints as `structure_of` wants them, and the couplings to them."""
    file = _existing(path)
    urdf = urdf_files.read(file)
    model, known = urdf.model, {urdf.model.joint(j).name: j for j in range(urdf.model.njnt)}
    first, last = (model.body(name).id for name in urdf_files.ends(urdf, base, tip, file))
    (low, high), qpos, address = model.jnt_range.T, model.qpos0.copy(), model.jnt_qposadr
    outside = model.jnt_limited.astype(bool) & ((low > 0.0) | (high < 0.0))
    qpos[address[outside]] = 0.5 * (low + high)[outside]
    for name, value in (home or {}).items():
        if name not in known or name in urdf.mimics:
            drives = ", ".join(one for one in known if one not in urdf.mimics)
            raise ConfigError(f"{file}: home has {name!r}; allowed: {drives}")
        slides = model.jnt_type[known[name]] == mujoco.mjtJoint.mjJNT_SLIDE
        qpos[address[known[name]]] = value / MM if slides else value
    for name, (driver, factor, offset) in urdf.mimics.items():
        if driver in known:
            qpos[address[known[name]]] = factor * qpos[address[known[driver]]] + offset
    assembly = _assembly(model, file, first, last, qpos)
    for move in assembly.moves.values():
        link = model.body(model.jnt_bodyid[move.joint]).name
        if link in urdf.odd:
            raise assembly.error(urdf.odd[link])
    couplings = couplings_of_mimics(assembly, urdf.mimics)
    driven = (move.joint for move in assembly.moves.values() if move.joint is not None)
    servos: dict[int, list[np.ndarray]] = {joint: [] for joint in driven if joint not in couplings}
    assembly.limits = {known[name]: limits for name, limits in urdf.limits.items() if name in known}
    return assembly, servos, couplings


def from_mjcf(path: str | Path, platform: str, **options: Any) -> GeneralRobot:
    """The GeneralRobot whose platform is a body of an MJCF, held by chains of bodies and by connects and welds.

    Joints with actuators are driven, and so are those that follow them by a joint equality. The home pose is that of
    the first keyframe, else of the reference configuration; loops that are open there by less than a millimetre are
    closed. options: of GeneralRobot. The platform's frame is its body's. Without a stated tool_mm the measured point is
    the platform's site of the name that `rrru.formats.mjcf_writer` gives it, if there is one. Raises ConfigError for a
    file that cannot be read or is no robot.
    """
    parts = mjcf_parts(path, platform)
    model = parts[0].model
    site = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, MEASURED_TOOL)
    if site >= 0 and model.site_bodyid[site] == model.body(platform).id:
        options = {"tool_mm": tuple((MM * model.site_pos[site]).tolist())} | options
    return _robot(*parts, options)


def mjcf_parts(
    path: str | Path, platform: str
) -> tuple[Assembly, dict[int, list[np.ndarray]], dict[int, JointCoupling]]:
    """The Assembly of an MJCF, its driven joints as `structure_of` wants them, and the couplings to them."""
    file = _existing(path)
    try:
        spec = mujoco.MjSpec.from_file(str(file))
        spec.compiler.fusestatic = False
        model = spec.compile()
    except ValueError as error:
        raise ConfigError(f"{file}: {' '.join(str(error).split())}; allowed: an MJCF") from None
    names = [model.body(k).name for k in range(1, model.nbody)]
    if platform not in names:
        raise ConfigError(f"{file}: platform is {platform!r}; allowed: {', '.join(name for name in names if name)}")
    home = model.key_qpos[0] if model.nkey else model.qpos0
    assembly = _assembly(model, file, 0, model.body(platform).id, home)
    servos = _servos(assembly)
    assembly.limits = {joint: (_effort(model, joint), np.nan) for joint in servos}
    return assembly, servos, couplings_of_equalities(assembly, servos)


def _existing(path: str | Path) -> Path:
    """The Path of a file that exists and is text."""
    file = Path(path)
    if why := not_a_file(file):
        raise ConfigError(f"{file}: {why}; allowed: a URDF or MJCF file")
    try:
        file.read_text("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"{file}: {why_unreadable(error)}; allowed: a file that can be read, in UTF-8") from None
    return file


def _assembly(model: mujoco.MjModel, file: Path, base: int, platform: int, home: np.ndarray) -> Assembly:
    """The Assembly of a model whose numbers are within limits; MuJoCo only warns of others."""
    for what, values in ({name: getattr(model, name) for name in _DEFINING} | {"the home pose": home}).items():
        if len(odd := values[~(np.abs(values) <= _MOST)]):
            raise ConfigError(f"{file}: {what} has the value {odd[0]:g}; allowed: numbers of at most {_MOST:g}")
    for what in ("jnt_axis", "body_quat"):
        # MuJoCo normalises them, except those whose length overflows
        values = getattr(model, what)
        if len(odd := values[np.abs(np.linalg.norm(values, axis=1) - 1.0) > 1e-6]):
            raise ConfigError(f"{file}: {what} has the value {odd[0]}; allowed: a direction with a length")
    return Assembly(model, file, base, platform, home)


def _servos(assembly: Assembly) -> dict[int, list[np.ndarray]]:
    """By driven joint of the legs, in the order of the actuators, ranges (low, high) of qpos that its servos allow."""
    model = assembly.model
    result: dict[int, list[np.ndarray]] = {}
    of_legs = {move.joint for move in assembly.moves.values()} - {None}
    for k in range(len(model.actuator_trntype)):
        name, kind = model.actuator(k).name or f"actuator {k + 1}", int(model.actuator_trntype[k])
        moved = _moved_by(model, k)
        if moved is not None and not moved & of_legs:
            continue
        if moved is None or kind not in (_TRN.mjTRN_JOINT, _TRN.mjTRN_JOINTINPARENT):
            raise assembly.error(f"{name} drives by {_TRN(kind).name[6:].lower()}; allowed: a joint")
        (joint,) = moved
        if model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_BALL:
            raise assembly.error(f"{name} drives the ball joint {assembly.joint_name(joint)}; allowed: hinge, slide")
        if model.actuator_gear[k, 0] != 1.0:
            raise assembly.error(f"{name} has the gear {model.actuator_gear[k, 0]:g}; allowed: 1")
        result.setdefault(joint, [])
        # a position servo: its force is gain (control - position)
        if model.actuator_ctrllimited[k] and model.actuator_biasprm[k, 1] == -model.actuator_gainprm[k, 0] != 0.0:
            result[joint].append(model.actuator_ctrlrange[k])
    return result


def _effort(model: mujoco.MjModel, joint: int) -> float:
    """Effort in N m or N that a model allows the actuators of a joint, NaN where it states none."""
    ranges = [model.jnt_actfrcrange[joint]] if model.jnt_actfrclimited[joint] else []
    of_joint = (model.actuator_trntype == _TRN.mjTRN_JOINT) & (model.actuator_trnid[:, 0] == joint)
    ranges += [model.actuator_forcerange[k] for k in np.flatnonzero(of_joint) if model.actuator_forcelimited[k]]
    efforts = [effort for effort in (float(np.abs(one).min()) for one in ranges) if effort > 0.0]
    return min(efforts, default=np.nan)


def _moved_by(model: mujoco.MjModel, k: int) -> set[int] | None:
    """Joints that an actuator moves, None where these are unknown."""
    kind, target = int(model.actuator_trntype[k]), int(model.actuator_trnid[k, 0])
    if kind in (_TRN.mjTRN_JOINT, _TRN.mjTRN_JOINTINPARENT):
        return {target}
    if kind == _TRN.mjTRN_TENDON:
        wraps = range(model.tendon_adr[target], model.tendon_adr[target] + model.tendon_num[target])
        if all(model.wrap_type[w] == mujoco.mjtWrap.mjWRAP_JOINT for w in wraps):
            return {int(model.wrap_objid[w]) for w in wraps}
    return None


def _robot(
    assembly: Assembly,
    servos: Mapping[int, Sequence[np.ndarray]],
    couplings: Mapping[int, JointCoupling],
    options: dict[str, Any],
) -> GeneralRobot:
    """The GeneralRobot of an Assembly's legs, servos the driven joints as `_servos` gives them, couplings by joint."""
    read = {"legs", "parts", "point_masses", "effort_limits", "velocity_limits"}
    known = {one.name for one in fields(GeneralRobot) if one.init} - read
    if unknown := set(options) - known:
        raise assembly.error(f"unknown key {unknown.pop()!r}; allowed: {', '.join(sorted(known))}")
    structure = structure_of(assembly, servos, couplings, options.get("up"))
    chains, legs, moves = structure.chains, structure.legs, structure.driven
    ends = [np.linalg.norm(leg.bar.platform_mm) for leg in legs.legs if leg.bar]
    arm = float(np.mean(ends)) if ends else 0.0
    defaults: dict[str, Any] = {"name": assembly.file.stem, "up": structure.up} | (
        {"characteristic_length_mm": arm} if arm else {}
    )
    drives, followers = _drives(legs, [_drive(legs, k, move, chains.sites[move.name]) for k, move in enumerate(moves)])
    parts = Parts(
        drives=drives, followers=followers, members=tuple((leg.bar_sites[0],) for leg in legs.legs if leg.bar)
    )
    stated = [_stated(assembly, joint, ranges) for joint, ranges in servos.items()]
    from_file: dict[str, Any] = {
        "legs": legs,
        "parts": parts,
        "point_masses": point_masses_of(chains, structure.open_legs, legs),
    }
    ranges = [_range(assembly, move, given) for move, given in zip(moves, stated, strict=False)]
    from_file["drive_range"] = np.array(ranges)
    from_file["assumed"] = frozenset(drive.column for drive, given in zip(drives, stated, strict=True) if not given)
    from_file |= _limits(assembly, servos)
    return GeneralRobot(**defaults | from_file | options)


def _limits(assembly: Assembly, joints: Iterable[int]) -> dict[str, np.ndarray | None]:
    """The `effort_limits` and `velocity_limits` of a GeneralRobot, of driven joints."""
    none = np.nan, np.nan
    effort, velocity = np.array([assembly.limits.get(joint, none) for joint in joints]).T
    slides = np.array([assembly.model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_SLIDE for joint in joints])
    return {
        "effort_limits": None if np.isnan(effort).all() else np.where(slides, effort, MM * effort),
        "velocity_limits": None if np.isnan(velocity).all() else np.where(slides, MM * velocity, velocity),
    }


def _stated(assembly: Assembly, joint: int, servos: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Ranges of a driven joint, its own and those of its servos, as far as they are stated."""
    model = assembly.model
    return [*servos, *([model.jnt_range[joint]] if model.jnt_limited[joint] else [])]


def _range(assembly: Assembly, move: Move, ranges: Sequence[np.ndarray]) -> tuple[float, float]:
    """Lowest and highest value of a driven joint within all of its ranges."""
    model, unit = assembly.model, MM if move.kind == "P" else 1.0
    if not ranges:
        about = _RANGE[_UNITS[move.kind]]
        return move.home - about, move.home + about
    zero = model.qpos0[model.jnt_qposadr[move.joint]]
    low, high = max(low for low, _ in ranges) - zero, min(high for _, high in ranges) - zero
    if not low < high:
        raise assembly.error(f"joint {move.origin} works from {low:g} to {high:g}; allowed: a range that is not empty")
    return unit * low, unit * high


def _drives(legs: Legs, uncoupled: Sequence[Drive]) -> tuple[tuple[Drive, ...], tuple[Drive, ...]]:
    """The Drives, and those of the followers, from one uncoupled Drive for each driven value."""
    if legs.coupling is None:
        return tuple(uncoupled), ()
    drives = []
    for number, column in enumerate(legs.coupling.T):
        coupled = {uncoupled[k].site: by * uncoupled[k].twist for k, by in enumerate(column) if by and k != number}
        drives.append(replace(uncoupled[number], others=coupled))
    return tuple(drives), tuple(uncoupled[len(drives) :])


def _drive(legs: Legs, number: int, move: Move, site: str) -> Drive:
    """The Drive of a driven value's Move, without its followers."""
    unit = _UNITS[move.kind]
    for leg in legs.legs:
        if leg.bar and leg.bar.drive == number:
            return Drive(f"{move.origin}_{unit}", unit, leg.bar_sites[0], unit_twist(0))
    axis, none = next(joint.axis for joint in legs.joints if joint.name == site), np.zeros(3)
    return Drive(f"{move.origin}_{unit}", unit, site, np.concatenate([none, axis] if unit == "rad" else [axis, none]))
