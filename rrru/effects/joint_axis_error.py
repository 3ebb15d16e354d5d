"""Joint axis error: axes of joints, driven and passive, that do not lie where the drawing says.

The axis of a joint along the unit vector a of its own frame is shifted and tilted across itself,

    shift = s_1 e_1 + s_2 e_2,    w = t_1 e_1 + t_2 e_2,    e_1, e_2 perpendicular to a

four numbers a joint; a slide has no place across itself and only tilts. They enter at the joints' seats and are linear.
A shift or a turn along the axis itself is an offset of the joint's value: a parameter of the calibration for a driven
joint, not observable for a passive one. A calibration with these parameters absorbs this effect.

Assumptions: rigid links, constant over the campaign.

Source: geometry; ordinary manufacturing errors, the subject of kinematic calibration (Mooring, Roth and Driels,
Fundamentals of Manipulator Calibration, 1991). Typical sizes assumed: 0.1 mm and 5e-4 rad.
"""

import numpy as np

from rrru.arrays import FloatArray
from rrru.effects.protocol import Contribution, Effect, Motion, plain_coordinates
from rrru.kinematics.legs import Joint
from rrru.kinematics.robot import Robot
from rrru.parameters import Parameter, ParameterSet

_SOURCE = "drilling and fit of joints, size assumed"
_BOUNDS, _TYPICAL = {"mm": 5.0, "rad": 0.03}, {"mm": 0.1, "rad": 5e-4}


def for_robot(robot: Robot) -> Effect | None:
    """The effect model for all joints that move, None for a robot of bars alone or on rails (there `rail_tilt`)."""
    moving = [joint for joint in robot.legs.joints if joint.kind != "fixed"]
    if not moving or (robot.parts.feet and all(joint.kind == "P" for joint in moving)):
        return None
    placed = [(joint.name, twist) for joint in moving for twist in _across(joint)]
    parameters = ParameterSet(tuple(_parameter(site, twist) for site, twist in placed))

    def seated(motion: Motion, values: FloatArray) -> Contribution:
        """The twists of the seats under all shifts and tilts."""
        twists: dict[str, FloatArray] = {}
        for (site, twist), value in zip(placed, values, strict=True):
            twists[site] = twists.get(site, 0.0) + value * twist[None]
        return motion.at(twists)

    typical = [_TYPICAL[unit] for unit in parameters.units]
    return Effect("joint_axis_error", parameters, plain_coordinates(parameters, typical), seated)


def _across(joint: Joint) -> tuple[FloatArray, ...]:
    """Unit twists (6,) across the axis of a joint: two shifts, none for a slide, and two tilts."""
    first = np.cross(joint.axis, np.eye(3)[np.abs(joint.axis).argmin()])
    first = first / np.linalg.norm(first)
    across = (first, np.cross(joint.axis, first))
    shifts = [np.concatenate([one, np.zeros(3)]) for one in across] if joint.kind == "R" else []
    return (*shifts, *(np.concatenate([np.zeros(3), one]) for one in across))


def _parameter(site: str, twist: FloatArray) -> Parameter:
    """The parameter of one shift or tilt of a seat, named by the largest of its components."""
    largest = int(np.abs(twist).argmax())
    unit, axis = ("mm" if largest < 3 else "rad"), "xyz"[largest % 3]
    limit = _BOUNDS[unit]
    kind = "shift" if unit == "mm" else "tilt"
    return Parameter(f"{kind}_{axis}_{site.replace(' ', '_')}", unit, 0.0, -limit, limit, _SOURCE)
