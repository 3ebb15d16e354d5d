"""The virtual 3-PTT or Delta: nominal controller in front, exact closure with its effects behind, a tracker beside.
Lengths mm, angles rad.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from rrru.effects.effect import Contribution
from rrru.effects.library import active_effects
from rrru.errors import ConfigError
from rrru.plant.closure import TripodGeometry
from rrru.plant.virtual_robot import DrivenRobot

# the set of error parameters in which a robot's truth is given
_TRUTH = {"ptt3": "rails", "delta": "legs"}


@dataclass(frozen=True)
class VirtualTripod(DrivenRobot):
    """A tripod whose truth is known.

    mechanism: the nominal robot; deviations: names of its richest error set ("rails" of the 3-PTT, "legs" of the Delta) to
    values; effects: active effects; non_repeatability_mm: radius of the ball in which the platform lies at random; masses in kg,
    the arm's being the 3-PTT's carriage.
    """

    mechanism: object
    deviations: dict = field(default_factory=dict)
    effects: tuple = ()
    non_repeatability_mm: float = 0.0
    platform_mass_kg: float = 3.0
    forearm_mass_kg: float = 1.2
    arm_mass_kg: float = 2.0

    @property
    def geometry(self):
        """The real legs; raises ConfigError for an unknown error."""
        rich = replace(self.mechanism, parameter_set=_TRUTH[self.mechanism.name])
        return TripodGeometry(rich, rich.legs(rich.parameters.vector(self.deviations)))

    def positions(self, motion, target=None):
        """Platform centres (n, 3) in the tracker's frame and its rotations (n,), zero, at the points of a motion; NaN
        where links do not meet.

        target is not needed: of the two assemblies the platform is in the lower one.
        """
        change = sum((effect.contribute(motion) for effect in self.effects), Contribution())
        return self.geometry.solve_under(motion.drive, change), np.zeros(len(motion))


def from_config(mechanism, section):
    """The virtual robot of one `virtual_robots:` entry; raises ConfigError for an unknown error and for axis errors,
    which these do not have.
    """
    axes = section.get("axis_errors", {})
    if axes.get("position_mm") or axes.get("angle_rad"):
        raise ConfigError(
            f"virtual robot: axis_errors on a {mechanism.name}; allowed: none, its platform does not turn; see errors and effects"
        )
    return VirtualTripod(
        mechanism,
        {name: float(value) for name, value in section["errors"].items()},
        active_effects(section["effects"], mechanism.drive_unit),
        section.get("wobble_mm", 0.0),
        section["platform_mass_kg"],
        section["forearm_mass_kg"],
        section["arm_mass_kg"],
    )
