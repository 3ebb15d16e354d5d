"""Measurement Jacobian: readings of reflectors and orientations by small twists anywhere in a robot."""

from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from rrru.arrays import FloatArray, IntArray
from rrru.kinematics.chain import Poses
from rrru.kinematics.legs import TOOL, WORLD
from rrru.kinematics.parameter_jacobian import TwistMap
from rrru.kinematics.readings import (
    Readings,
    inverse_right_jacobian,
    orientation_residual,
    reflector_numbers,
    turned_by,
)

if TYPE_CHECKING:
    from rrru.kinematics.robot import Robot

_EYE = np.eye(3)


class ReadingMap(TwistMap):
    """The TwistMap of a robot at n poses for what was read there; its m rows are those of the readings' residual.

    twists (n or 1, sites, 6); place_mm (n or 1, 3): of what is read, on the platform.
    """

    def __init__(
        self,
        robot: "Robot",
        actuators: FloatArray,
        poses: Poses,
        twists: FloatArray,
        place_mm: FloatArray,
        readings: Readings,
    ) -> None:
        super().__init__(robot.model, actuators, poses, twists, place_mm)
        self._robot, self._at, self._readings = robot, twists, readings
        self._world, self._tool = (robot.legs.site_numbers[site] for site in (WORLD, TOOL))
        self._on_world = readings.on_world
        if self._on_world is not None:
            self.point_mm = np.where(self._on_world[:, None], place_mm, self.point_mm)

    @property
    def rows(self) -> IntArray:
        """Pose (m,) of each row of what is read."""
        return self._readings.rows

    @cached_property
    def point(self) -> FloatArray:
        """Motion (n, 3, rows) of the points that are read per unit of every constraint; see `TwistMap`."""
        return self._of_platform(super().point)

    def _of_platform(self, motion: FloatArray) -> FloatArray:
        """Motion (n, 3, k) of the points, none of those that are fixed to the world."""
        return motion if self._on_world is None else np.where(self._on_world[:, None, None], 0.0, motion)

    def response(self, site: str) -> FloatArray:
        """Motion (n, 3, 6) of the points that are read per twist at a site, in the site's frame."""
        if site == TOOL and self._readings.place_mm is not None:
            lever = self._readings.place_mm - np.asarray(self._robot.tool_mm)
            tool = self._at[:, self._tool, 3:]
            turning = np.cross(_EYE, turned_by(tool, lever)[:, None, :]).transpose(0, 2, 1)
            turn = self._in_world(self.poses.turn)
            return self._of_platform(np.concatenate([turn, turn @ turning @ self._own(self._tool, _EYE)], axis=2))
        if site in self.closure.legs.reflectors:
            legs, read = self.closure.legs, self._readings.reflectors
            if read is None:
                return np.zeros((len(self), 3, 6))
            its = reflector_numbers(legs, read) == legs.site_numbers[site]
            turn = self.poses.turn
            if self._on_world is not None:
                turn = np.where(self._on_world[:, None, None], _EYE, turn)
            turn = np.where(its[:, None, None], self._in_world(turn), 0.0)
            return np.concatenate([turn, np.zeros_like(turn)], axis=2)
        return super().response(site)

    def turning(self, site: str) -> FloatArray:
        """Turn (n, 3, 6) in rad of the platform, as it is read, per twist at a site, in the site's frame."""
        if site == WORLD:
            return self._about(self._own(self._world, _EYE))
        if site == TOOL:
            return self._about(self._own(self._tool, self._in_world(self.poses.turn)))
        if site in self.closure.legs.reflectors:
            return np.zeros((len(self), 3, 6))
        return self._of_site(site, self._turned)

    @cached_property
    def _turned(self) -> FloatArray:
        """`_swept` of the platform's turn."""
        return self._swept(self.turn)

    def columns(self, directions: FloatArray) -> FloatArray:
        """Derivative (m, 3, p) of what is read by p parameters with directions (sites, 6, p) at the sites."""
        shifts = self._columns(directions, self._moved, self.response)
        return self._with_turns(shifts, lambda: self.turn_columns(directions))

    def turn_columns(self, directions: FloatArray) -> FloatArray:
        """Turn (n, 3, p) in rad of the platform, as it is read, by p parameters with directions (sites, 6, p)."""
        return self._columns(directions, self._turned, self.turning)

    def _about(self, axes: FloatArray) -> FloatArray:
        """Turns (n, 3, 6) per twist whose rotation turns about axes (3, 3) or (n, 3, 3), and whose shift does not."""
        return np.concatenate([np.zeros((len(self), 3, 3)), np.broadcast_to(axes, (len(self), 3, 3))], axis=2)

    def effect(self, site: str) -> FloatArray:
        """Change (m, 3, 6) of what is read per twist at a site, in the site's frame."""
        return self._with_turns(self.response(site), lambda: self.turning(site))

    @property
    def drive_effect(self) -> FloatArray:
        """Change (m, 3, K) of what is read per actuator value."""
        return self._with_turns(self.drive_response, lambda: self.turn @ self.drive_counts)

    def _with_turns(self, shifts: FloatArray, turns: Callable[[], FloatArray]) -> FloatArray:
        """Changes (m, 3, k) of what is read from those of positions (n, 3, k) and, made when needed, of turns."""
        readings = self._readings
        if not len(readings.oriented):
            return shifts
        return np.concatenate([shifts, readings.characteristic_length_mm * self._slope @ turns()[readings.oriented]])

    @cached_property
    def _slope(self) -> FloatArray:
        """Derivatives (k, 3, 3) of the residual rotation vectors with respect to the model's turn."""
        return inverse_right_jacobian(orientation_residual(self._robot, self._readings, self.poses, self._at))
