"""Trapezoidal motion profile along a path. Lengths in mm, times in s."""

from dataclasses import dataclass

import numpy as np

from rrru.errors import ConfigError


@dataclass(frozen=True)
class Trapezoid:
    """Rest to rest over `length_mm` with a constant acceleration, a constant speed and the same deceleration (paper A,
    3.2).

    A path too short to reach the speed gets a triangular profile.
    """

    length_mm: float
    speed_mm_s: float
    acceleration_mm_s2: float

    def __post_init__(self):
        if not (self.length_mm > 0.0 and self.speed_mm_s > 0.0 and self.acceleration_mm_s2 > 0.0):
            raise ConfigError(
                f"motion: length {self.length_mm} mm, speed {self.speed_mm_s} mm/s, acceleration {self.acceleration_mm_s2} mm/s^2; "
                "allowed: positive numbers"
            )

    @property
    def peak_mm_s(self):
        """Highest speed that is reached."""
        return min(self.speed_mm_s, np.sqrt(self.length_mm * self.acceleration_mm_s2))

    @property
    def duration_s(self):
        """Time from rest to rest."""
        return self.length_mm / self.peak_mm_s + self.peak_mm_s / self.acceleration_mm_s2

    def time(self, distance_mm):
        """Times (n,) at which distances (n,) along the path are passed."""
        distance = np.clip(np.asarray(distance_mm, dtype=float), 0.0, self.length_mm)
        a, v, length = self.acceleration_mm_s2, self.peak_mm_s, self.length_mm
        ramp = 0.5 * v**2 / a
        return np.where(
            distance < ramp,
            np.sqrt(2.0 * distance / a),
            np.where(
                distance > length - ramp,
                self.duration_s - np.sqrt(2.0 * (length - distance) / a),
                v / a + (distance - ramp) / v,
            ),
        )

    def speed(self, time_s):
        """Speeds (n,) in mm/s at times (n,)."""
        time = np.asarray(time_s, dtype=float)
        return np.clip(self.acceleration_mm_s2 * np.minimum(time, self.duration_s - time), 0.0, self.peak_mm_s)

    def acceleration(self, time_s):
        """Accelerations (n,) along the path in mm/s^2 at times (n,)."""
        time = np.asarray(time_s, dtype=float)
        ramp = self.peak_mm_s / self.acceleration_mm_s2
        return np.where(
            time < ramp, self.acceleration_mm_s2, np.where(time > self.duration_s - ramp, -self.acceleration_mm_s2, 0.0)
        )
