"""Bench of a screw: one slider driven forwards, back and forwards, with an encoder at it (paper B, Fig. 7). mm."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from rrru.arrays import FloatArray, IntArray
from rrru.effects.motion import Course, make_motion
from rrru.effects.protocol import together
from rrru.errors import UnreachableError
from rrru.simulation.virtual_robot import VirtualRobot

PASSES = ("forward_1", "reverse", "forward_2")


@dataclass(frozen=True)
class ScrewBench:
    """Turns of the motor per pass, lead in mm per turn, samples per turn, the encoder's noise (1 sigma), resolution."""

    turns: int
    lead_mm: float
    samples_per_turn: int
    noise_mm: float
    resolution_mm: float

    def path(self) -> tuple[FloatArray, IntArray]:
        """Commanded travel (3 n + 1,) in mm from the start, and each sample's pass (3 n + 1,), 0 to 2.

        All passes stop at the same places, so that readings can be compared one by one; the turning points belong to
        the pass that ends there.
        """
        count = self.turns * self.samples_per_turn
        forward = np.arange(1, count + 1) * (self.lead_mm / self.samples_per_turn)
        travel = np.concatenate([[0.0], forward, forward[-2::-1], [0.0], forward])
        return travel, np.concatenate([[0], np.repeat([0, 1, 2], count)])


def encoder_record(
    robot: VirtualRobot,
    leg: int,
    payload_kg: float,
    bench: ScrewBench,
    place_mm: Sequence[float],
    generator: np.random.Generator,
) -> pd.DataFrame:
    """Record of one slider, leg 1 to 3: pass, commanded_mm and encoder_mm per sample, under a payload.

    The robot is near `place_mm` (3,), the other two sliders do not move. The encoder reads the carriage with all errors
    of its drive by the robot's effects. Raises UnreachableError where the travel leaves the reach.
    """
    mechanism, (travel, number) = robot.mechanism, bench.path()
    sliders = np.repeat(mechanism.require_reachable(np.reshape(place_mm, (1, 3))), len(travel), axis=0)
    sliders[:, leg - 1] += travel - 0.5 * travel.max()
    position = mechanism.forward(sliders)
    if not np.isfinite(position).all():
        path = f"{travel.max():g} mm of travel about {tuple(place_mm)}"
        raise UnreachableError(f"screw {leg}: {path} leave the reach; allowed: less")
    n, still = len(travel), np.zeros_like(position)
    unknown, payload = np.full(n, np.nan), np.full(n, payload_kg)
    course = Course(position, sliders, sliders, np.arange(n), unknown, still, still, payload)
    change = mechanism.drive_errors(
        np.zeros((n, len(mechanism.legs.sites), 6))
        + together(robot.effects, make_motion(mechanism, robot.masses, course)).twists
    )
    seen = (sliders + change)[:, leg - 1] + bench.noise_mm * generator.standard_normal(len(travel))
    encoder = np.round(seen / bench.resolution_mm) * bench.resolution_mm
    return pd.DataFrame({"pass": np.array(PASSES)[number], "commanded_mm": sliders[:, leg - 1], "encoder_mm": encoder})
