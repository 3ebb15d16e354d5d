"""Limits of proposed runs: payload, speed and driving time, stated or derived from the robot's file.

Payloads in kg, speeds of the tool in mm/s, times in s.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
import numpy.typing as npt

from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.problem import DiagnosisProblem
from rrru.kinematics.dynamics import Masses
from rrru.kinematics.robot import Robot

# first words of notes that say which candidates are left out
NO_PAYLOAD, WITHIN_LIMITS = "no run with a payload is proposed", "runs are proposed within the limits"


@dataclass(frozen=True)
class StatedLimits:
    """Largest payload, largest speed of the tool and longest driving time of a run; None where it is not stated."""

    payload_kg: float | None = None
    speed_mm_s: float | None = None
    minutes: float | None = None

    @classmethod
    def from_config(cls, section: Mapping[str, float] | None) -> Self:
        """From the key `limits` of the configuration."""
        return cls(**(section or {}))

    @property
    def words(self) -> str:
        """A note with the stated limits, "" where none is stated."""
        stated = ((name, getattr(self, name)) for name in ("payload_kg", "speed_mm_s", "minutes"))
        listed = [f"{name} {value:g}" for name, value in stated if value is not None]
        return f"{WITHIN_LIMITS} {', '.join(listed)}" if listed else ""


@dataclass(frozen=True)
class RunLimits:
    """What candidate runs are made with.

    added_kg: what a loaded pass carries beyond the campaign's payload, 0 where none is proposed; payload_kg,
    speed_mm_s, seconds: limits of every run, infinite where there is none; fast_mm_s: speed of a fast pass, unless the
    drives are too slow for it; rates (K,): limits of the rates in rad/s or mm/s of the drives of some columns, None
    where the file states none.
    """

    added_kg: float = OPTIONS.default_added_payload_kg
    payload_kg: float = np.inf
    speed_mm_s: float = np.inf
    seconds: float = np.inf
    fast_mm_s: float = OPTIONS.default_fast_pass_mm_s
    rates: npt.NDArray[np.float64] | None = None
    columns: tuple[str, ...] = ()

    def loaded_kg(self, own_kg: float) -> float:
        """Payload of a loaded pass where the campaign carries own_kg; own_kg where no more is allowed."""
        return max(own_kg, min(own_kg + self.added_kg, self.payload_kg))

    def fast(self, own_mm_s: float, rate: npt.NDArray[np.float64]) -> float:
        """Speed of a fast pass; own_mm_s where no faster one is allowed.

        rate (K,): largest rates of the drives at own_mm_s, NaN where unknown.
        """
        most = min(self.fast_mm_s, self.speed_mm_s, own_mm_s * self.slower(rate))
        return max(own_mm_s, _rounded_down(most, 2))

    def slower(self, rate: npt.NDArray[np.float64]) -> float:
        """Largest factor by which a motion with drive rates (.., K) may be sped up; below 1 it has to be slower."""
        if self.rates is None:
            return np.inf
        share = np.abs(rate) / self.rates
        highest = np.nanmax(share, initial=0.0)
        return float(1.0 / highest) if highest > 0.0 else np.inf

    def allows(self, speed_mm_s: float, payload_kg: float, seconds: float = np.nan) -> bool:
        """Whether a run stays within the limits; NaN is unknown and counts as within."""
        return not (speed_mm_s > self.speed_mm_s or payload_kg > self.payload_kg or seconds > self.seconds)


def run_limits(problem: DiagnosisProblem, masses: Masses, stated: StatedLimits) -> tuple[RunLimits, str]:
    """The RunLimits of a problem with Masses, and why no payload is proposed, else "".

    A payload that is not stated is what the drives' efforts of the robot's file leave at the campaign's points, else
    `OPTIONS.default_added_payload_kg`; of both no more than a share of what the robot itself moves.
    """
    robot = problem.mechanism
    limits = RunLimits(
        speed_mm_s=_or_infinite(stated.speed_mm_s),
        seconds=60.0 * _or_infinite(stated.minutes),
        fast_mm_s=stated.speed_mm_s or OPTIONS.default_fast_pass_mm_s,
        rates=robot.velocity_limits,
        columns=() if robot.velocity_limits is None else tuple(robot.parts.columns),
    )
    if stated.payload_kg is not None:
        # a loaded pass carries as much as is allowed
        return replace(limits, added_kg=stated.payload_kg, payload_kg=stated.payload_kg), ""
    moved = moved_kg(robot, masses)
    plausible = OPTIONS.max_payload_per_moved_mass * moved
    spare = _spare_kg(problem)
    if np.isfinite(spare):
        added, why = _rounded_down(min(spare, plausible), 1), f"the efforts of its file leave {spare:.2g} kg"
    else:
        fits = plausible >= OPTIONS.default_added_payload_kg
        added, why = (OPTIONS.default_added_payload_kg if fits else 0.0), ""
    if added >= OPTIONS.min_added_payload_kg:
        driven = float(np.nan_to_num(problem.measurements["payload_kg"].to_numpy(dtype=float)).max())
        return replace(limits, added_kg=added, payload_kg=max(_rounded_down(plausible, 1), driven)), ""
    if not why or plausible < spare:
        why = f"the robot moves {moved:.2g} kg itself" if moved else "the mass of the robot itself is not stated"
    return replace(limits, added_kg=0.0), f"{NO_PAYLOAD}, {why}: state limits.payload_kg"


def moved_kg(robot: Robot, masses: Masses) -> float:
    """Mass in kg that a robot itself moves: platform, arms and forearms, and the point masses of its file."""
    legs = len(robot.parts.members) * masses.forearm_kg + len(robot.parts.drives) * masses.arm_kg
    return float(masses.platform_kg + legs + sum(point_mass.mass_kg for point_mass in robot.point_masses))


def _spare_kg(problem: DiagnosisProblem) -> float:
    """Mass in kg that the drives' efforts leave at all points of a campaign, beyond its payload; NaN without efforts.

    The load on drive k is linear in the mass m at the tool: |tau_k + m dtau_k/dm| has to stay below its effort.
    """
    efforts = problem.mechanism.effort_limits
    if efforts is None:
        return np.nan
    slope = np.abs(problem.motion.slopes[0].drive[problem.used])
    room = OPTIONS.max_effort_share * efforts - np.abs(problem.motion.drive_load[problem.used])
    with np.errstate(divide="ignore", invalid="ignore"):
        spare = np.where(slope > 0.0, room / slope, np.nan)
    return float(max(np.nanmin(spare), 0.0)) if np.isfinite(spare).any() else np.nan


def _or_infinite(value: float | None) -> float:
    """A limit, infinite where there is none."""
    return np.inf if value is None else float(value)


def _rounded_down(value: float, digits: int) -> float:
    """A positive number rounded down to some significant digits; infinite and zero ones stay."""
    if not (np.isfinite(value) and value > 0.0):
        return value
    unit = 10.0 ** (np.floor(np.log10(value)) + 1 - digits)
    return float(unit * np.floor(value / unit * (1.0 + 1e-12)))
