"""One campaign as the diagnosis sees it: usable points, calibrated model, signature of every effect, exact model.

The model with effects is the exact closure of the robot. A hypothesis is fitted on its linearisation, which is renewed
about the best one found. Lengths in mm, angles in rad.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property, partial
from typing import Self

import numpy as np
import pandas as pd

from rrru.arrays import BoolArray, FloatArray, IntArray
from rrru.cache import last_cached_of
from rrru.campaign import measurements as rows
from rrru.campaign.driven_path import follows_path, passes_points, stops
from rrru.campaign.noise import reading_series
from rrru.diagnosis.aliases import EffectKey
from rrru.diagnosis.approach_direction import estimate_approach, has_direction
from rrru.diagnosis.discrepancy_basis import Library, Unknown
from rrru.diagnosis.evidence import ModelEvidence
from rrru.diagnosis.linearise import approach_responses, linearised
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.state import LinearizedProblem, ModelState
from rrru.effects.motion import standing
from rrru.effects.protocol import Contribution, Effect, Motion
from rrru.estimation.noise_model import NoiseModel
from rrru.estimation.parameters import Block
from rrru.kinematics.chain import Poses
from rrru.kinematics.parameter_jacobian import TwistMap
from rrru.kinematics.readings import Readings, reading_residual
from rrru.kinematics.robot import Robot

# name of the block of geometric errors
GEOMETRY = "geometry"


@dataclass(frozen=True)
class DiagnosisProblem:
    """Points of a campaign, all N of them, of which the used ones are fitted.

    What was read at them makes m rows of three numbers in mm: positions, and after them orientations at their arm.
    library: effects by name that the campaign can test, and after them the functions of
    `rrru.diagnosis.discrepancy_basis` that it can; untestable: name to the reason for the other effects; noise_mm:
    deviation per axis; characteristic_length_mm: of `rrru.kinematics.readings.Readings`; noise: its NoiseModel, white
    where there is none; beside_scale: weight of the rows of reflectors that are not on the robot, so that they have the
    noise of the others; motion_at: from where the robot stands to the motion with the loads there, see
    `rrru.effects.motion.make_motion`; nuisance_sd, bounds: of the errors of payload and tilt, see
    `rrru.diagnosis.payload_nuisance`; known: effect to the points (N,) at which the campaign has all that the effect
    needs, of the effects that lack something at a used point; massless: whether no mass of the robot itself is stated.
    """

    mechanism: Robot
    measurements: pd.DataFrame
    motion: Motion
    used: BoolArray
    library: Library
    untestable: dict[str, str]
    noise_mm: float
    characteristic_length_mm: float = np.nan
    noise: NoiseModel | None = None
    beside_scale: float = 1.0
    motion_at: Callable[..., Motion] | None = None
    nuisance_sd: Mapping[str, float] = field(default_factory=dict)
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    known: Mapping[str, BoolArray] = field(default_factory=dict)
    massless: bool = False

    def __len__(self) -> int:
        return len(self.at)

    @cached_property
    def geometry(self) -> Block:
        """The Block of geometric errors: links and joints are off by less than frames, targets and drives' zeros."""
        block = Block.geometry(self.mechanism.parameters, GEOMETRY)
        if not self.mechanism.stages:
            return block
        usual = {"mm": OPTIONS.body_error_sd_mm, "rad": OPTIONS.body_error_sd_rad}
        body_sd = np.minimum(block.sd, [usual[unit] for unit in block.units])
        return replace(block, sd=np.where(self.mechanism.stages[-1], block.sd, body_sd))

    @cached_property
    def effects(self) -> dict[str, Effect]:
        """The library without the functions of the discrepancy."""
        return {name: effect for name, effect in self.library.items() if not isinstance(effect, Unknown)}

    @cached_property
    def readings(self) -> Readings | None:
        """What was read at all points, None where that are positions of the tool."""
        return rows.readings(self.measurements, self.characteristic_length_mm)

    @cached_property
    def _used_rows(self) -> IntArray:
        """Rows (m,) of the used points among those of all readings."""
        points = np.arange(len(self.used)) if self.readings is None else self.readings.rows
        return np.flatnonzero(self.used[points])

    @cached_property
    def along_paths(self) -> bool:
        """Whether the points lie along paths, not in any order."""
        command, run = rows.command(self.measurements), self.measurements["run"].to_numpy()
        return bool(passes_points(self.measurements) or follows_path(command, run))

    @cached_property
    def on_world(self) -> BoolArray:
        """Which rows (m,) are of reflectors that are not on the robot."""
        flags = rows.on_the_world(self.measurements)
        return np.zeros(len(self), dtype=bool) if flags is None else flags[self.at]

    def of_rows(self, values: FloatArray) -> FloatArray:
        """Values (m, 3, ..) of the used rows, weighted, from those (n, 3, ..) of all that was read."""
        used = values[self._used_rows]
        if self.beside_scale == 1.0:
            return used
        scale = np.where(self.on_world, self.beside_scale, 1.0)
        return used * scale.reshape(-1, *[1] * (used.ndim - 1))

    @cached_property
    def at(self) -> IntArray:
        """Number (m,) of the point that each row was read at."""
        return self._used_rows if self.readings is None else self.readings.rows[self._used_rows]

    @cached_property
    def stop(self) -> IntArray:
        """Number (m,) of the stop that each row was read at: several reflectors may be seen at one."""
        return np.asarray(stops(self.measurements)[self.at])

    @cached_property
    def kind(self) -> IntArray:
        """Number (m,) of the target of each row, orientations apart."""
        target = np.zeros(len(self), dtype=int)
        if "target" in self.measurements:
            target = np.unique(self.points["target"], return_inverse=True)[1]
        return 2 * target + ~self.positions

    @cached_property
    def positions(self) -> BoolArray:
        """Which rows (m,) are positions."""
        return self._used_rows < len(self.used)

    @cached_property
    def on_robot(self) -> BoolArray:
        """Which rows (m,) are positions of points on the robot, the only ones that stated distances in mm are about."""
        return self.positions & ~self.on_world

    @property
    def count(self) -> int:
        """Number of used points."""
        return int(self.used.sum())

    @property
    def points(self) -> pd.DataFrame:
        """The measurement table, row by row of what was read (m)."""
        return self.measurements.iloc[self.at]

    @cached_property
    def run(self) -> IntArray:
        """Run numbers (m,)."""
        return np.asarray(self.measurements["run"].to_numpy()[self.at])

    @cached_property
    def series(self) -> IntArray:
        """Numbers (m,) of what follows one another smoothly: runs, of each reflector, orientations apart."""
        return np.asarray(reading_series(self.measurements, self.readings)[self._used_rows])

    def by_point(self, values: FloatArray) -> FloatArray:
        """Values (n, 3 or 6, ..) of used points from those (m, 3, ..) of rows, zero where no orientation was read."""
        if self.positions.all():
            return values
        result = np.zeros((self.count, 6, *values.shape[2:]))
        result[:, :3] = values[self.positions]
        result[np.searchsorted(np.flatnonzero(self.used), self.at[~self.positions]), 3:] = values[~self.positions]
        return result

    def under(self, noise: NoiseModel) -> Self:
        """The problem under a NoiseModel."""
        return replace(self, noise=noise, noise_mm=noise.mean_mm)

    def evidence(self, linear: LinearizedProblem) -> ModelEvidence:
        """The ModelEvidence on a linearisation."""
        noise = (self.noise or NoiseModel.white(self.noise_mm)).counted
        rows = {name: known[self.at] for name, known in self.known.items() if name in self.library}
        incomplete = {name: known for name, known in rows.items() if not known.all()}
        return ModelEvidence(self.library, linear, self.series, noise, self.along_paths, incomplete)

    def complete(self, effects: Iterable[str]) -> BoolArray:
        """Rows (m,) at which the campaign has all that some effects need."""
        needed = (self.known[name][self.at] for name in sorted(set(effects) & set(self.known)))
        return np.asarray(np.all([np.ones(len(self), dtype=bool), *needed], axis=0))

    def at_complete(self, effects: Iterable[str]) -> Self:
        """The problem of the points alone at which the campaign has all that some effects need."""
        rows = self.complete(effects)
        return self if rows.all() else self.without(~rows)

    def fits_as(self, other: Self) -> bool:
        """Whether a fit of another problem is one of this: senses of approach count at the used points only."""
        if self is other:
            return True
        mine, others = self.motion, other.motion
        names = [one.name for one in fields(self) if one.name not in ("motion", "used")]
        of_motion = [one.name for one in fields(mine) if one.name != "approach"]
        same = all(getattr(self, name) is getattr(other, name) for name in names)
        same &= all(getattr(mine, name) is getattr(others, name) for name in of_motion)
        if not (same and np.array_equal(self.used, other.used)):
            return False
        here, there = (np.broadcast_to(one.approach, one.drive.shape)[self.used] for one in (mine, others))
        return np.array_equal(here, there, equal_nan=True)

    def with_approach(self, state: ModelState) -> Self:
        """The problem with the senses in which the drives arrive, as a state and the readings determine them."""
        if not np.isfinite(self.motion.approach).any():
            return self
        approach = np.where(np.isfinite(self.motion.approach), 0.0, np.nan)
        if any(has_direction(self.library[name]) for name, _ in state.effects):
            approach = estimate_approach(self, state, approach_responses(self, state))
        return replace(self, motion=replace(self.motion, approach=approach))

    @property
    def axis_mm(self) -> FloatArray:
        """Deviation (3,) of the noise of each axis."""
        return np.full(3, self.noise_mm) if self.noise is None else self.noise.axis_mm

    def standing(self, state: ModelState) -> Self:
        """The problem with the loads where the robot of a state stands, if its platform can turn.

        Where positions alone were read, the orientation of the platform is not identifiable and does not count.
        Derivatives of the loads by payload and tilt stay as they were: a sag changes them by a share of itself.
        """
        if self.motion_at is None or not self.mechanism.orients:
            return self
        at = standing(self.mechanism, self.driven, self.posed(state), self.readings is not None)
        slopes, approach = partial(getattr, self.motion, "slopes"), self.motion.approach
        return replace(self, motion=replace(self.motion_at(at), load_slopes=slopes, approach=approach))

    def without(self, dropped: BoolArray) -> Self:
        """The problem without the used points of the rows flagged in (m,)."""
        used = self.used.copy()
        used[self.at[dropped]] = False
        return replace(self, used=used)

    @cached_property
    def driven(self) -> tuple[FloatArray, FloatArray]:
        """Actuator values (N, K) and commanded positions (N, 3)."""
        return rows.actuators(self.measurements, self.mechanism), rows.command(self.measurements)

    @cached_property
    def _measured(self) -> FloatArray:
        """Measured positions (N, 3)."""
        return rows.measured(self.measurements)

    def model_positions(self, deviations: FloatArray) -> FloatArray:
        """Positions (N, 3) of the tool by the calibrated model without effects."""
        actuators, command = self.driven
        return self.mechanism.forward(actuators, deviations, command)

    def weight(self, state: ModelState) -> dict[str, float]:
        """Errors of payload and tilt of a state, by name."""
        return dict.fromkeys(self.nuisance_sd, 0.0) | state.weight

    @last_cached_of
    def contributions(self, state: ModelState) -> dict[EffectKey, Contribution]:
        """What each effect of a state, (name, shape), changes along the motion."""
        return {key: state.contribution(self.library, key, self.motion) for key in state.effects}

    @last_cached_of
    def contribution(self, state: ModelState) -> Contribution:
        """What the effects of a state change along the motion."""
        return sum(self.contributions(state).values(), Contribution())

    @last_cached_of
    def posed(self, state: ModelState) -> tuple[Poses, FloatArray]:
        """Poses (N) of the exact closure corrected by a state, and the twists of deviations and effects."""
        actuators, command = self.driven
        twists = self.mechanism.twists(state.deviations) + self.contribution(state).twists
        return self.mechanism.solve(actuators, command, twists), twists

    def map_of(self, state: ModelState) -> TwistMap:
        """The TwistMap of all points at a state's poses; see `rrru.kinematics.robot.Robot.map`."""
        actuators, _ = self.driven
        if self.readings is None and not state.effects:
            position = self.model_positions(state.deviations)
            of_positions: TwistMap = self.mechanism.map_at(actuators, position, state.deviations)
            return of_positions
        result: TwistMap = self.mechanism.map(actuators, *self.posed(state), self.readings)
        return result

    def left(self, state: ModelState) -> FloatArray:
        """Readings minus the model corrected by a state, of all points: positions (N, 3), then orientations.

        The model is the exact closure where the state has effects, the calibrated one where it has none.
        """
        if self.readings is not None:
            return reading_residual(self.mechanism, self.readings, *self.posed(state))
        model = self.mechanism.measured(*self.posed(state)) if state.effects else self.model_positions(state.deviations)
        return self._measured - model

    def by_other(self, robot: Robot, poses: Poses, twists: FloatArray) -> FloatArray:
        """Readings minus another robot at Poses (N) under twists (N or 1, sites, 6), of the used points (m, 3)."""
        if self.readings is not None:
            return self.of_rows(reading_residual(robot, self.readings, poses, twists))
        return self.of_rows(self._measured - robot.measured(poses, twists))

    def residual(self, state: ModelState) -> FloatArray:
        """`left` of the used points (m, 3)."""
        return self.of_rows(self.left(state))

    def linearise(self, state: ModelState, keys: Iterable[EffectKey] | None = None) -> LinearizedProblem:
        """The model linearised about a state, see `rrru.diagnosis.linearise`."""
        return linearised(self, state, keys)
