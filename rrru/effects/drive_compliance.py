"""Drive compliance: between motor and arm the drive gives way to the torque of the loads.

Gear teeth, shafts and a harmonic drive's flexspline act as a torsion spring of compliance k_i. The encoder on the
motor's side does not see its wind-up, so that the arm errs by

    dtheta_i = k_i tau_i

where tau_i is the torque of all loads about drive axis i, positive in the sense of theta
(`rrru.robots.dynamics.loads`):

    tau_i = W . dx/dtheta_i + (m_a + m_f) / 2 g L1 cos(theta_i) - (m_a / 3 + m_f / 2) L1^2 theta_i''

with W the weight and inertia force of platform, payload and half of the forearms. It enters at the drive angle, one
compliance per leg, and is linear in k. With theta > 0 lowering the arm, gravity lowers the platform. Most of its static
part looks like errors of lengths and drives; a second payload shows it plainly, since nothing else but `link_flexure`
grows with it.

Assumptions: linear spring (harmonic drives stiffen with torque by a factor of about two over their range), no lost
motion (that is `backlash`), wind-up small enough that loads are those at the commanded pose, no vibration (a motion
slow against the drive's resonance).

SLIDER is the law of a carriage on a screw or belt: b_i errs by k_i F_i with the force F_i of all loads along its rail.

Source: Tsai, Robot Analysis, 1999, chapter 10 (loads); Spong, Modeling and control of elastic joint robots, ASME
Journal of Dynamic Systems, Measurement, and Control 109, 1987 (joint as a torsion spring). The size is assumed: 15 N m
on 50 kN m/rad make 3e-4 rad.
"""

from dataclasses import dataclass

import numpy as np

from rrru.effects.effect import LEGS, Contribution, Coordinates, plain_coordinates
from rrru.parameters import Parameter, ParameterSet

_PARAMETERS = ParameterSet(
    tuple(
        Parameter(f"compliance{k}", "rad/(N mm)", 0.0, 0.0, 1e-6, "torsion spring; a small drive's 1 kN m/rad as bound")
        for k in LEGS
    )
)
_COORDINATES = plain_coordinates(_PARAMETERS, 2e-8)


@dataclass(frozen=True)
class DriveCompliance:
    """Drives that give way to static and inertial loads, compliance per leg."""

    name: str = "drive_compliance"
    parameters: ParameterSet = _PARAMETERS
    coordinates: Coordinates = _COORDINATES
    needs: tuple = ("drive_load",)

    def contribute(self, motion, values):
        """Changes (n, 3) of the actuator values under compliances (3,), rad/(N mm) or mm/N."""
        return Contribution(drive=np.asarray(values, dtype=float) * motion.drive_load)


_SCREW = ParameterSet(
    tuple(
        Parameter(f"compliance{k}", "mm/N", 0.0, 0.0, 0.05, "screw, nut, bearing and carriage, size assumed")
        for k in LEGS
    )
)
SLIDER = DriveCompliance(parameters=_SCREW, coordinates=plain_coordinates(_SCREW, 1e-3))
