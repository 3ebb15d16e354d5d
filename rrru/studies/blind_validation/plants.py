"""The plants that simulate a robot of a file with a fault: our own effect models, and MuJoCo. mm, rad, N, kg."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from rrru.effects.protocol import ActiveEffect
from rrru.simulation.virtual_robot import VirtualRobot
from rrru.studies.blind_validation.faults import KINDS, kind_of

# servo stiffnesses at which friction shows and weight does not, in N mm/rad or N/mm
_STIFF = {"rad": 4e9, "mm": 2e3}


def own(conditions, offsets, *faults):
    """The VirtualRobot of a file with Faults.

    offsets: errors of its first candidate parameters; the (K,) of the drives come first.
    """
    robot, masses, effects = conditions.mechanism, conditions.masses, []
    deviations = {one.name: offset for one, offset in zip(robot.candidates, offsets, strict=False)}
    for fault in faults:
        kind = kind_of(fault.kind)
        if kind.effect_model:
            effects.append(ActiveEffect(*fault.values(conditions.mechanism)))
        else:
            for error, size in zip(getattr(conditions.model, kind.on), fault.sizes, strict=True):
                deviations |= {number: deviations.get(number, 0.0) + size for _, number in error}
        if "load_kg" in fault.more:
            masses = replace(masses, platform_kg=masses.platform_kg + fault.more["load_kg"])
        if "tilt_x_rad" in fault.more:
            robot = replace(robot, up=tuple(_turned(fault).apply(robot.up).tolist()))
    return VirtualRobot(robot, deviations, effects=tuple(effects), masses=masses)


def _turned(fault):
    """Rotation of the direction of gravity in the frame of a base that is not level."""
    return Rotation.from_rotvec([fault.more["tilt_x_rad"], fault.more["tilt_y_rad"], 0.0]).inv()


def mujoco(conditions, offsets, fault=None):
    """The MujocoRobot of a file with a Fault; offsets (K,) as for `own`."""
    from rrru.simulation.mujoco_robot import MujocoRobot

    causes = {"zero_offset": dict(zip(drives(conditions.mechanism), offsets, strict=True))}
    if fault is not None:
        causes |= mujoco_causes(conditions, fault)
    return MujocoRobot(conditions.mechanism, Path(conditions.file), conditions.platform, causes)


PLANTS = {"own": own, "mujoco": mujoco}


def drives(robot):
    """Names of the driven joints."""
    return [column.rpartition("_")[0] for column in robot.parts.columns]


def mujoco_causes(conditions, fault):
    """Sizes by site by the name of a cause, as `rrru.simulation.mujoco_causes` has them, of a Fault."""
    model, named = conditions.model, drives(conditions.mechanism)
    if not KINDS[fault.kind].effect_model:
        errors = _acting(getattr(model, KINDS[fault.kind].on), fault.sizes)
        return {"placement": {place: size for error, size in errors for place, _ in error}}
    if fault.kind == "warming":
        (strain,), moved = fault.sizes, model.growth_mm.items()
        grown = {f"{body}.{axis}": strain * mm for body, by in moved for axis, mm in zip("xyz", by, strict=True) if mm}
        return {"warming": {"time_s": fault.more["time_constant"]} | grown}
    if fault.kind == "speed_friction":
        stiff = {drive: _STIFF[one.unit] for drive, one in zip(named, conditions.mechanism.parts.drives, strict=True)}
        slowed = {drive: size * stiff[drive] for drive, size in _acting(named, fault.sizes)}
        return {"actuator_stiffness": stiff, "speed_friction": slowed}
    if fault.kind == "base_on_springs":
        return {"base_stiffness": {f"r{axis}": 1.0 / size for axis, size in _acting("xy", fault.sizes[:2])}}
    if fault.kind == "soft_link":
        given = _acting(model.links, fault.sizes)
        return {"link_stiffness": {place: 1.0 / size for places, size in given for place in places}}
    if fault.kind == "clearance":
        return {"clearance": dict(_acting(model.clearances, fault.sizes))}
    by_drive = dict(_acting(named, fault.sizes))
    if fault.kind in ("play", "slow_servo"):
        return {{"play": "play", "slow_servo": "servo_lag"}[fault.kind]: by_drive}
    causes = {"actuator_stiffness": {drive: 1.0 / size for drive, size in by_drive.items()}}
    if "load_kg" in fault.more:
        causes["payload"] = {conditions.platform: fault.more["load_kg"]}
    if "tilt_x_rad" in fault.more:
        causes["base_tilt"] = {axis: fault.more[f"tilt_{axis}_rad"] for axis in "xy"}
    return causes


def _acting(sites, sizes):
    """Pairs of a site and its size where that is not zero."""
    return [(site, size) for site, size in zip(sites, sizes, strict=True) if np.abs(size) > 0.0]
