"""Trapezoidal motion profile along a path. Lengths in mm, times in s."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rrru.errors import ConfigError


@dataclass(frozen=True)
class Trapezoid:
    """Rest to rest over `length_mm`: constant acceleration, constant speed, the same deceleration (paper A, 3.2).

    A path too short to reach the speed gets a triangular profile.
    """

    length_mm: float
    speed_mm_s: float
    acceleration_mm_s2: float

    def __post_init__(self) -> None:
        if not min(self.length_mm, self.speed_mm_s, self.acceleration_mm_s2) > 0.0:
            motion = f"length {self.length_mm} mm, speed {self.speed_mm_s} mm/s"
            motion += f", acceleration {self.acceleration_mm_s2} mm/s^2"
            raise ConfigError(f"motion: {motion}; allowed: positive numbers")

    @property
    def peak_mm_s(self) -> float:
        """Highest speed that is reached."""
        return float(min(self.speed_mm_s, np.sqrt(self.length_mm * self.acceleration_mm_s2)))

    @property
    def duration_s(self) -> float:
        """Time from rest to rest."""
        return self.length_mm / self.peak_mm_s + self.peak_mm_s / self.acceleration_mm_s2

    def time(self, distance_mm: npt.ArrayLike) -> np.ndarray:
        """Times (n,) at which distances (n,) along the path are passed."""
        a, v, length = self.acceleration_mm_s2, self.peak_mm_s, self.length_mm
        distance, ramp = np.clip(np.asarray(distance_mm, dtype=float), 0.0, length), 0.5 * v**2 / a
        speeding_up, slowing_down = (
            np.sqrt(2.0 * distance / a),
            self.duration_s - np.sqrt(2.0 * (length - distance) / a),
        )
        steady = v / a + (distance - ramp) / v
        return np.select([distance < ramp, distance > length - ramp], [speeding_up, slowing_down], steady)

    def speed(self, time_s: npt.ArrayLike) -> np.ndarray:
        """Speeds (n,) in mm/s at times (n,)."""
        time = np.asarray(time_s, dtype=float)
        speed = self.acceleration_mm_s2 * np.minimum(time, self.duration_s - time)
        return np.asarray(np.clip(speed, 0.0, self.peak_mm_s))

    def acceleration(self, time_s: npt.ArrayLike) -> np.ndarray:
        """Accelerations (n,) along the path in mm/s^2 at times (n,)."""
        time, a = np.asarray(time_s, dtype=float), self.acceleration_mm_s2
        ramp = self.peak_mm_s / a
        return np.select([time < ramp, time > self.duration_s - ramp], [a, -a], 0.0)
