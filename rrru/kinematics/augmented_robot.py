"""A robot with a closed form and additional parameters of its campaign: frame, reflectors, tool.

These are added to its parameters as directions at sites, as far as they are identifiable at the campaign's poses
together with the robot's own. Everything except the inverse then uses the general model. Lengths in mm, angles in rad.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from rrru.arrays import BoolArray, FloatArray
from rrru.kinematics.base_parameters import (
    LEFT_OF_DATA,
    Candidate,
    MeasurementConfig,
    candidate_components,
    choose,
    column_scale,
    direction,
    open_numbers,
)
from rrru.kinematics.legs import Legs
from rrru.kinematics.readings import Readings
from rrru.kinematics.robot import Robot
from rrru.parameters import Parameter, ParameterSet

_ANGLE_LIMIT_RAD, _LENGTH_LIMIT_MM = 0.3, 100.0


@dataclass(frozen=True, eq=False)
class AugmentedRobot(Robot):
    """A robot and its campaign's MeasurementConfig; added: Candidates that join its parameters, None for all."""

    robot: Robot
    measurement_config: MeasurementConfig
    added: tuple[Candidate, ...] | None = None

    @cached_property
    def legs(self) -> Legs:
        """The robot's legs, with the reflectors as sites."""
        return replace(self.robot.legs, reflectors=self.measurement_config.reflectors)

    @property
    def _added(self) -> tuple[Candidate, ...]:
        """The Candidates in addition to the robot's own parameters."""
        return open_numbers(self.measurement_config) if self.added is None else self.added

    @cached_property
    def parameters(self) -> ParameterSet:
        """The robot's parameters and the added ones, nominally zero."""
        limits = {"mm": _LENGTH_LIMIT_MM, "rad": _ANGLE_LIMIT_RAD}
        bounds = ((added, limits[added.unit]) for added in self._added)
        more = (Parameter(added.name, added.unit, 0.0, -limit, limit, "bounds assumed") for added, limit in bounds)
        return ParameterSet((*self.robot.parameters, *more))

    @cached_property
    def directions(self) -> FloatArray:
        """Twists (sites, 6, p) that a unit of each parameter makes."""
        robots = np.pad(self.robot.directions, ((0, len(self.legs.reflectors)), (0, 0), (0, 0)))
        return np.concatenate([robots, *(direction(self.legs, added)[:, :, None] for added in self._added)], axis=2)

    @property
    def candidate_components(self) -> BoolArray:
        """Which components (sites, 6) of constant twists its readings leave open."""
        return candidate_components(self.legs, open_numbers(self.measurement_config))

    def with_identifiable_parameters(
        self, actuators: FloatArray, position_mm: FloatArray, readings: Readings | None = None
    ) -> "AugmentedRobot":
        """The robot with the added parameters that are identifiable at poses (n, K), (n, 3) with Readings."""
        complete = replace(self, added=self._added)
        at = complete.map_of_closed(actuators, position_mm, readings)
        columns, count = at.columns(complete.directions), len(self.robot.parameters)
        columns = columns.reshape(-1, columns.shape[2])
        basis, _ = np.linalg.qr(columns[:, :count])
        scale = column_scale(self._added, self.characteristic_length_mm)
        chosen, _ = choose(columns[:, count:] * scale, [True] * len(scale), LEFT_OF_DATA, basis=basis)
        return replace(self, added=tuple(self._added[k] for k in chosen))

    def with_measurement_config(self, config: MeasurementConfig) -> Robot:
        """The robot with another MeasurementConfig."""
        return self.robot.with_measurement_config(config)

    def inverse(self, position_mm: FloatArray, deviations: FloatArray | None = None, elbow: str = "out") -> FloatArray:
        """Actuator values (n, K) for positions (n, 3) in the robot's own frame by its own parameters; see Robot."""
        robots = None if deviations is None else np.asarray(deviations)[: len(self.robot.parameters)]
        return self.robot.inverse(position_mm, robots, elbow)

    def widened(self, angle_rad: float, length_mm: float) -> "AugmentedRobot":
        """The robot with other bounds of its own parameters."""
        return replace(self, robot=self.robot.widened(angle_rad, length_mm))

    @property
    def deviation_names(self) -> tuple[str, ...]:
        """Names of the deviations that `twists_of` knows: the robot's and the added ones."""
        return (*self.robot.deviation_names, *(added.name for added in self._added))

    def twists_of(self, values: Mapping[str, float]) -> FloatArray:
        """Twists (1, sites, 6) of the robot's deviations and of added ones by name."""
        known = {added.name: added for added in self._added}
        robots = self.robot.twists_of({name: value for name, value in values.items() if name not in known})
        result = np.pad(robots, ((0, 0), (0, len(self.legs.reflectors)), (0, 0)))
        for name, value in values.items():
            if name in known:
                result[0] += value * direction(self.legs, known[name])
        return result

    def identifiable(self, values: dict[str, float]) -> dict[str, float]:
        """Mapping of the parameters from values of any of the robot's own; the added ones are unknown."""
        return self.robot.identifiable(values)


def _own(name: str) -> property:
    """A property that is the robot's own, an attribute or a method."""
    return property(lambda self: getattr(self.robot, name), doc="The robot's own.")


# tests/kinematics/test_readings.py goes over the attributes of all robots: one that is missing here is found there
for _name in (
    *("name", "parts", "characteristic_length_mm", "up", "up_stated", "tool_mm", "orients", "workspace_lines", "seats"),
    "point_masses",
    *(
        "reach_mm",
        "size_mm",
        "farthest_mm",
        "degrees_of_freedom",
        "strokes",
        "drive_range",
        "effort_limits",
        "velocity_limits",
    ),
    *("TRACKED", "RICHEST", "SEARCHED", "in_range", "unreached", "guess", "passive_near", "gauge"),
    *("confounded_outside", "own_load", "own_member_forces", "own_moments", "own_base_moment"),
):
    setattr(AugmentedRobot, _name, _own(_name))
