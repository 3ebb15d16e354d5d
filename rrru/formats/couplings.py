"""Joints that are coupled to driven ones: the mimics of a URDF, the joint equalities of an MJCF.

    value of the follower = offset + factor * value of its driver

Values count from the joints' reference configuration (`ref` of an MJCF), as in `rrru.formats.mjcf_reader`. Lengths in
mm, angles in rad. `rrru.formats.robot_file` reads them.
"""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass

import mujoco
import numpy as np

from rrru.formats.mjcf_reader import MM, Assembly
from rrru.formats.urdf_reader import Mimic

_EQ, _SLIDE = mujoco.mjtEq, mujoco.mjtJoint.mjJNT_SLIDE


@dataclass(frozen=True)
class JointCoupling:
    """The coupling of one follower.

    driver: number of MuJoCo's joint; factor: in the follower's unit per the driver's; offset: in the follower's unit.
    """

    driver: int
    factor: float
    offset: float


def couplings_of_mimics(assembly: Assembly, mimics: Mapping[str, Mimic]) -> dict[int, JointCoupling]:
    """JointCoupling by the number of MuJoCo's joint from the mimics of a URDF.

    mimics: {joint's name: (driver's name, factor, offset)} in m and rad.

    Raises ConfigError for the mimic of a mimic and of a joint that is not on the chain.
    """
    on_chain = {move.origin: move.joint for move in assembly.moves.values() if move.joint is not None}
    result: dict[int, JointCoupling] = {}
    for name, (driver, factor, offset) in mimics.items():
        if name not in on_chain:
            continue
        if driver not in on_chain or driver in mimics:
            known = ", ".join(joint for joint in on_chain if joint not in mimics) or "none here"
            raise assembly.error(f"joint {name} mimics {driver!r}; allowed: driven joints of the chain, {known}")
        result[on_chain[name]] = _in_mm(assembly.model, on_chain[name], on_chain[driver], factor, offset)
    return result


def couplings_of_equalities(assembly: Assembly, driven: Collection[int]) -> dict[int, JointCoupling]:
    """JointCoupling by the number of MuJoCo's joint from the active joint equalities of an MJCF's legs.

    driven: numbers of the joints with actuators.

    Raises ConfigError for a follower of a joint without actuator, with an actuator of its own, or along a curve.
    """
    model = assembly.model
    result: dict[int, JointCoupling] = {}
    of_legs = {move.joint for move in assembly.moves.values()}
    for k in np.flatnonzero(model.eq_active0).tolist():
        joint, driver = int(model.eq_obj1id[k]), int(model.eq_obj2id[k])
        if model.eq_type[k] != _EQ.mjEQ_JOINT or joint not in of_legs:
            continue
        name = f"joint {assembly.joint_name(joint)}"
        if driver < 0:
            raise assembly.error(f"{name} is held by {assembly.eq_name(k)}; allowed: a joint that it follows")
        leader = assembly.joint_name(driver)
        if joint in driven or joint in result:
            raise assembly.error(f"{name} follows {leader} and has an actuator, too; allowed: one of both")
        if driver not in driven:
            raise assembly.error(f"{name} follows {leader}; allowed: a joint of the legs that an actuator drives")
        offset, factor, *bent = model.eq_data[k, :5]
        if np.any(bent):
            raise assembly.error(f"{name} follows {leader} along a curve; allowed: polycoef of two numbers")
        result[joint] = _in_mm(model, joint, driver, float(factor), float(offset))
    return result


def coupling_matrix(driven: Iterable[int], couplings: Mapping[int, JointCoupling]) -> np.ndarray | None:
    """The `coupling` (D, K) of Legs: driven values of the driven joints, then of the followers, per actuator value.

    None where no joint is coupled.
    """
    number = {joint: k for k, joint in enumerate(driven)}
    rows = [[one.factor * (number[one.driver] == k) for k in range(len(number))] for one in couplings.values()]
    return np.array([*np.eye(len(number)), *rows]) if rows else None


def _in_mm(model: mujoco.MjModel, joint: int, driver: int, factor: float, offset: float) -> JointCoupling:
    """The JointCoupling in mm and rad of a factor and an offset in m and rad."""
    unit, driver_unit = (MM if model.jnt_type[number] == _SLIDE else 1.0 for number in (joint, driver))
    return JointCoupling(driver, factor * unit / driver_unit, offset * unit)
