"""The virtual 3-PTT or Delta: nominal controller in front, exact closure with its effects behind, a tracker beside."""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from rrru.effects.protocol import together
from rrru.errors import ConfigError
from rrru.plant.closure import TripodGeometry
from rrru.plant.virtual_robot import DrivenRobot, shared_parts
from rrru.robots.dynamics import Masses


@dataclass(frozen=True)
class VirtualTripod(DrivenRobot):
    """A tripod whose truth is known, in deviations of its richest parameter set; a 3-PTT's arm is its carriage."""

    mechanism: object
    deviations: dict = field(default_factory=dict)
    effects: tuple = ()
    non_repeatability_mm: float = 0.0
    masses: Masses = field(default_factory=Masses)

    @cached_property
    def geometry(self):
        """The real legs; raises ConfigError for an unknown deviation."""
        rich = replace(self.mechanism, parameter_set=self.mechanism.RICHEST)
        return TripodGeometry(rich, rich.legs(rich.parameters.vector(self.deviations)))

    def positions(self, motion, target=None):
        """Platform centres (n, 3) in the tracker's frame, NaN where links do not meet, and its rotations (n,), zero.

        target is not needed: of the two assemblies the platform is in the lower one.
        """
        return self.geometry.solve_under(motion.drive, together(self.effects, motion)), np.zeros(len(motion))


def from_config(mechanism, section):
    """The virtual robot of one `virtual_robots:` entry; raises ConfigError for axis errors, which it does not have."""
    axes = section.get("axis_errors", {})
    if axes.get("position_mm") or axes.get("angle_rad"):
        allowed = "none, its platform does not turn; see errors and effects"
        raise ConfigError(f"virtual robot: axis_errors on a {mechanism.name}; allowed: {allowed}")
    return VirtualTripod(**shared_parts(mechanism, section))
