"""Friction wind-up: the drive train twists against friction and, after each reversal, unwinds over a stretch of travel.

Between motor and arm the train is a spring of stiffness k that carries the friction F of what it drives. Friction does
not jump to its full size F_c when a drive turns back but builds up over a travel s of the drive (pre-sliding, by the
deflection of its many contacts; Dahl's model with exponent 1). With the share h = F / F_c and the amplitude a = F_c / k

    dh/du = (sgn(du) - h) / s,    dtheta = -a h

which is solved exactly along any path, however it is sampled:

    h_k = sgn(u_k - u_{k-1}) + (h_{k-1} - sgn(u_k - u_{k-1})) exp(-|u_k - u_{k-1}| / s)

After a reversal the error changes by 2 a, 63 % of it over the travel s, 95 % over 3 s, and then stays. It enters at the
drive angle and is linear in the amplitudes, one per drive; the travel is one for all drives of a kind. Friction that
builds up at once would hold the arm until the spring has turned by 2 a. That is `backlash` of this width, the limit of
this effect for small s. The two differ only at points within some s of a reversal: in a campaign without such points
they are confounded.

Assumptions: a is small compared with s, so that the travel of the drive is that of the contacts; Coulomb friction of
one size, whatever load and speed; the train starts at rest without tension; path as commanded. Points of the path at
which the angle is unknown are skipped. In small loops within a larger one the error of the model creeps; they are rare.

Source: Dahl, A solid friction model, Aerospace Corporation, 1968; Armstrong-Helouvry, Dupont and Canudas de Wit, A
survey of models, analysis tools and compensation methods for the control of machines with friction, Automatica 30,
1994; Seyfferth, Maghzal and Angeles, Nonlinear modeling and parameter identification of harmonic drive robotic
transmissions, IEEE International Conference on Robotics and Automation, 1995, on wind-up with hysteresis. Sizes
assumed: as large as the backlash of a worn drive, over some degrees or millimetres.
"""

import numpy as np

from rrru.arrays import FloatArray
from rrru.effects.protocol import PATH, Contribution, Effect, Motion, drive_parameters, of_drives, plain_coordinates
from rrru.kinematics.robot import Robot
from rrru.kinematics.typed_numba import njit
from rrru.parameters import Parameter, ParameterSet

_SOURCE = dict.fromkeys(("rad", "mm"), "Coulomb friction over stiffness, size assumed")
_HIGHEST = {"rad": ("rad", 0.0, 0.01), "mm": ("mm", 0.0, 0.5)}
_TYPICAL = {"rad": 2.5e-4, "mm": 0.01}
_TRAVEL = {
    "rad": Parameter("travel_rad", "rad", 0.05, 0.001, 1.0, "pre-sliding travel of bearings and gears, size assumed"),
    "mm": Parameter("travel_mm", "mm", 5.0, 0.1, 100.0, "pre-sliding travel of screws and rails, size assumed"),
}
# travels of the hyperparameter grid, over their nominal values
_TRAVEL_SHARES = (0.5, 2.0)


@njit(cache=True)
def wound(path: FloatArray, travel: FloatArray) -> FloatArray:
    """Share (N, k) of the friction that has built up, -1 to 1, along a path (N, k) with travels (k,), same unit."""
    result = np.empty_like(path)
    for leg in range(path.shape[1]):
        share, last = 0.0, np.nan
        for k in range(path.shape[0]):
            step = path[k, leg] - last
            if step != 0.0 and not np.isnan(step):
                sense = 1.0 if step > 0.0 else -1.0
                share = sense + (share - sense) * np.exp(-abs(step) / travel[leg])
            if not np.isnan(path[k, leg]):
                last = path[k, leg]
            result[k, leg] = share
    return result


def for_robot(robot: Robot) -> Effect:
    """The effect model for all drives."""
    drives, units = robot.parts.drives, robot.parts.units
    travels = {unit: _TRAVEL[unit] for unit in dict.fromkeys(units)}
    amplitudes = drive_parameters(drives, _SOURCE, ("amplitude", _HIGHEST))
    parameters = ParameterSet((*amplitudes, *travels.values()))
    shapes = tuple({travel.name: share * travel.nominal for travel in travels.values()} for share in _TRAVEL_SHARES)
    which = [list(travels).index(unit) for unit in units]

    def wound_up(motion: Motion, values: FloatArray) -> Contribution:
        """Changes of the actuator values under amplitudes (K,) and travels in their units."""
        travel = values[len(drives) :][which]
        share = wound(np.ascontiguousarray(motion.path_drive), travel)[motion.path_index]
        amplitude = values[: len(drives)]
        return motion.at_drives(motion.with_approach(-amplitude * share, -amplitude))

    coordinates = plain_coordinates(parameters, of_drives(drives, _TYPICAL), shapes)
    return Effect("friction_windup", parameters, coordinates, wound_up, (PATH,))
