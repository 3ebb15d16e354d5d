"""Residuals of a file's columns under mistakes that may be in it: poses, registration, rms and evidence.

See `rrru.campaign.ingest.gross_errors`. Lengths in mm, angles in rad.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import cast

import numpy as np
import pandas as pd

from rrru.campaign import measurements as rows
from rrru.campaign.ingest.frames import Frames
from rrru.campaign.ingest.mistakes import SHIFTS, Mistakes
from rrru.campaign.ingest.sheet import COMMAND, MEASURED, TARGET, TURNS
from rrru.campaign.ingest.spec import MM, RAD, IngestSpec
from rrru.campaign.ingest.zero_offsets import found_zeros
from rrru.campaign.target_registration import TargetReadings, affine_rms, axes_by_turning, register_targets
from rrru.errors import FitError
from rrru.kinematics.chain import Poses
from rrru.kinematics.end_effectors import MultiArmRobot
from rrru.kinematics.readings import Readings
from rrru.kinematics.robot import Robot

# a mistake explains a file where its residual rms is less than this share of the robot's size; assumed
EXPLAINED_SHARE = 5e-3
# a smaller rms, as a share of the robot's size, is one of ordinary errors of its geometry; assumed
ORDINARY_SHARE = 2e-3
# number of rows that decide: they give the rms of every hypothesis within some percent; number that screens them
_MAX_ROWS, _MAX_SCREENED_ROWS = 120, 40
# share of the rows at which the nominal robot has to have a pose for a hypothesis to count
_MIN_POSED_SHARE = 0.9
# readings whose residual exceeds this multiple of the median are outliers and do not count
_MAX_PER_MEDIAN = 6.0
# least number of independent errors, for robots whose model has fewer parameters than their joints have; assumed
_MIN_INDEPENDENT_ERRORS = 15
# a place of a target that is off by less than the first share of the robot's size is not a gross error; one that is
# off by more than the second is impossible; assumed
_MIN_TARGET_SHIFT_SHARE, _MAX_TARGET_SHIFT_SHARE = 0.01, 0.5
# smaller residuals, as a share of the positions' spread, count as this: no hypothesis wins by rounding
_MIN_RESIDUAL_SHARE = 1e-5
# positions spread over more than the first share of the robot's size, and over less than the second, or the unit of
# its drives is wrong
_MIN_SPREAD_SHARE, _MAX_SPREAD_SHARE = 2e-3, 3.0
# median distance up to which commanded positions and drive values of few digits agree
_MAX_COMMAND_DISTANCE_MM = 1.0
# turns, or sizes of the robot, by which drives may differ from their home values: beyond, their unit is wrong
_MAX_FROM_HOME = 4.0


@dataclass(frozen=True)
class Hypothesis:
    """Mistakes, the rms that they leave, places (k, 3) of targets, rotation (3, 3) of the frame, and log evidence."""

    mistakes: Mistakes
    rms_mm: float
    place_mm: np.ndarray
    rotation: np.ndarray
    log_evidence: float


@dataclass(frozen=True)
class GrossFile:
    """Drive values (n, K), measured positions (n, 3), runs (n,), and each row's target (n,).

    command_mm (n, 3), command_turn (n, 3, 3): commanded positions of the tool and orientations, which pose the robot
    where K is 0; None where the file has none. names, place_mm (k, 3): of the targets, NaN where no place is stated;
    chosen: rows that decide; spec: what the configuration states, which the columns have already; found: {our name: the
    file's name}; unit_stated: whether the file's header states the unit of what was measured; agreed: whether
    commanded positions and drive values agree, which no mistake may change.
    """

    robot: Robot
    spec: IngestSpec
    found: Mapping[str, str]
    unit_stated: bool
    drive: np.ndarray
    command_mm: np.ndarray | None
    command_turn: np.ndarray
    measured_mm: np.ndarray
    run: np.ndarray
    target: np.ndarray
    names: tuple[str, ...]
    place_mm: np.ndarray
    chosen: np.ndarray
    agreed: bool = False

    def __len__(self) -> int:
        return len(self.chosen)

    @classmethod
    def of(
        cls, frame: pd.DataFrame, spec: IngestSpec, robot: Robot, found: Mapping[str, str], unit_stated: bool
    ) -> "GrossFile | None":
        """From a file's columns.

        None where these do not determine the robot's pose or the end effector that was seen, or where commanded
        positions alone are in another unit, which `rrru.campaign.ingest.geometry` checks.
        """
        driven, commanded = set(robot.parts.columns) <= set(frame), set(COMMAND) <= set(frame)
        if not set(MEASURED) <= set(frame) or not (driven or (commanded and not robot.legs.end_effectors)):
            return None
        names = frame["target"].astype(str).to_numpy() if "target" in frame else np.full(len(frame), "")
        if robot.legs.end_effectors and not set(names) <= {
            target for hand in robot.legs.end_effectors for target in hand
        }:
            return None
        known, number = np.unique(names, return_inverse=True)
        drive = frame[[*robot.parts.columns]].to_numpy(dtype=float) if driven else np.zeros((len(frame), 0))
        command = rows.command(frame) if commanded else None
        right = np.isfinite(drive).all(axis=1) & np.isfinite(rows.measured(frame)).all(axis=1)
        right &= ~np.isin(names, spec.world_targets)
        if command is not None and not driven:
            right &= np.isfinite(command).all(axis=1)
        chosen = _drawn_rows(np.flatnonzero(right), _MAX_ROWS)
        turn = rows.turns(frame, "command") if set(TURNS["command"]) <= set(frame) else None
        turn = np.broadcast_to(robot.legs.home_turn, (len(frame), 3, 3)) if turn is None else turn
        place = _places(frame, spec, robot, known, number)
        read = rows.measured(frame), _run_numbers(frame), number, tuple(known.tolist()), place
        if command is not None and not driven and not _moves(command[chosen], robot):
            return None
        return cls(robot, spec, found, unit_stated, drive, command, turn, *read, chosen)

    @property
    def count(self) -> int:
        """Number of drives with values in the file."""
        return int(self.drive.shape[1])

    @property
    def given(self) -> Mistakes:
        """The file as it is."""
        return Mistakes.none(self.count)

    @property
    def has_lengths(self) -> bool:
        """Whether the file has drive values that are lengths."""
        return bool(self.count) and "mm" in self.robot.parts.units

    @cached_property
    def units(self) -> tuple[dict[str, str], ...]:
        """Units other than those stated that readings and drive values may have."""
        readings = [unit for unit in MM if unit != self.spec.unit and not self.unit_stated]
        result = [{"unit": unit} for unit in readings]
        if self.has_lengths:
            drives = [unit for unit in MM if unit != self.spec.unit_of_drives]
            result += [{"drive_unit": unit} for unit in drives]
            result += [{"unit": unit, "drive_unit": unit} for unit in readings if unit in drives]
        if self.count and "rad" in self.robot.parts.units:
            result += [{"angle_unit": unit} for unit in RAD if unit != self.spec.angle_unit]
        return tuple(result)

    @property
    def shifts(self) -> tuple[int, ...]:
        """Rows by which the measured columns may be late: few, or one stop at which every target was read."""
        stop = len(self.names)
        return tuple(dict.fromkeys((*SHIFTS, stop, -stop)))

    def with_exchanged_targets(self, first: Sequence[str], second: Sequence[str]) -> "GrossFile":
        """The file with targets (a) of one end effector on another one, whose targets (b) are on the first."""
        instead = dict.fromkeys(first, tuple(second)) | dict.fromkeys(second, tuple(first))
        carried = tuple(
            tuple(dict.fromkeys(new for name in hand for new in instead.get(name, (name,))))
            for hand in self.robot.legs.end_effectors
        )
        # only robots of several arms have end effectors
        robot = cast(MultiArmRobot, self.robot)
        return replace(self, robot=replace(robot, legs=replace(robot.legs, end_effectors=carried)))

    def evidence_at_most(self, mistakes: Mistakes) -> float:
        """Upper bound of the log evidence of some Mistakes, from fewer rows."""
        at = self._rows(mistakes.shift)
        readings = self.readings(mistakes, at[:: max(len(at) // _MAX_SCREENED_ROWS, 1)])
        share = 1.0 if readings is None else affine_rms(readings) / self._spread(readings)
        return self._log_evidence(mistakes, share, len(at))

    def hypothesis(self, mistakes: Mistakes) -> Hypothesis:
        """The Hypothesis of some mistakes; its rms is infinite where the nominal robot has too few poses then."""
        impossible = Hypothesis(mistakes, np.inf, self.place_mm, np.eye(3), self._log_evidence(mistakes, 1.0, 1))
        readings = self.readings(mistakes)
        if readings is None:
            return impossible
        try:
            found = register_targets(readings, mistakes.mirrored)
        except FitError:
            return impossible
        place = self._near_stated(found.place_mm, readings.body_turn) if mistakes.free else found.place_mm
        moved = np.linalg.norm((place - self.place_mm)[self._stated], axis=1).max(initial=0.0)
        size = self.robot.size_mm
        if mistakes.free and not _MIN_TARGET_SHIFT_SHARE * size < moved < _MAX_TARGET_SHIFT_SHARE * size:
            return impossible
        rms = _rms_without_outliers(np.linalg.norm(found.residual_mm, axis=1), readings.target)
        # the smaller spread of readings and poses, so that no hypothesis is favoured for making one of them small
        share = rms / min(self._spread(readings), _spread(readings.measured_mm))
        return Hypothesis(
            mistakes, rms, place, found.rotation, self._log_evidence(mistakes, share, len(readings.target))
        )

    def _near_stated(self, place_mm: np.ndarray, turn: np.ndarray) -> np.ndarray:
        """Places (k, 3) moved to the stated ones along axes that turns (n, 3, 3) do not move.

        Along these a shift of all targets is confounded with one of the instrument, as along z for a robot that turns
        about z only.
        """
        if not self._stated.any():
            return place_mm
        axes, turned = axes_by_turning(turn)
        still = axes[:, turned == 0.0]
        return np.asarray(place_mm + still @ still.T @ np.median((self.place_mm - place_mm)[self._stated], axis=0))

    def with_zeros(self) -> Hypothesis:
        """The Hypothesis of no mistake, with the lost zero offsets of the drives that explain most."""
        readings = self.readings(self.given) if self.count else None
        if readings is None:
            return self.hypothesis(self.given)
        at = self.chosen
        values, names = self.drive[at], np.array(self.names)[self.target[at]]
        world, right = np.zeros(len(at), dtype=bool), np.ones(len(at), dtype=bool)
        frames = Frames(self.measured_mm[at], names, self.place_mm[self.target[at]], world, right, True)
        seen = Readings(frames.seen_mm, names, frames.place_mm, on_world=world)
        zeros, *_ = found_zeros(self.robot, (values, self._guess(values, at)), seen, frames.framed)
        return replace(self, drive=self.drive + zeros).hypothesis(self.given)

    def spread_mm(self) -> float:
        """Spread of the measured positions in the rows that decide."""
        return _spread(self.measured_mm[self.chosen])

    @property
    def _stated(self) -> np.ndarray:
        """Targets (k,) with stated places."""
        return np.asarray(np.isfinite(self.place_mm).all(axis=1))

    @cached_property
    def _mistake_count(self) -> int:
        """Number of single mistakes."""
        return len([*self.given.further(self.units, self.shifts)])

    def _spread(self, readings: TargetReadings) -> float:
        """Spread of the poses that carry the targets; turns count by the robot's characteristic length."""
        turn = self.robot.characteristic_length_mm * _spread(readings.body_turn.reshape(-1, 9)) / np.sqrt(2.0)
        return float(np.hypot(_spread(readings.body_mm), turn))

    def _log_evidence(self, mistakes: Mistakes, share: float, count: int) -> float:
        """Log evidence of an rms in shares of the positions' spread, from `count` rows."""
        independent = min(max(len(self.robot.parameters), _MIN_INDEPENDENT_ERRORS), 3 * len(self) // 2)
        fitted = 3 * np.isin(np.flatnonzero(self._stated), self.target[self.chosen]).sum() * mistakes.free
        cost = 0.5 * fitted * np.log(3.0 * max(count, 1))
        share = min(max(share, _MIN_RESIDUAL_SHARE), 1.0)
        return float(mistakes.log_prior(self._mistake_count) - independent * np.log(share) - cost)

    def readings(self, mistakes: Mistakes, at: np.ndarray | None = None) -> TargetReadings | None:
        """The TargetReadings of some rows (m,), by default of all that decide.

        None where the nominal robot has too few poses there.
        """
        at = self._rows(mistakes.shift) if at is None else at
        if len(at) < 3:
            return None
        body, turn = self._bodies(mistakes, at)
        if self.agreed and self.command_mm is not None and not mistakes.of_readings:
            off = np.linalg.norm(body + turn @ np.asarray(self.robot.tool_mm) - self.command_mm[at], axis=1)
            if not np.median(off) <= _MAX_COMMAND_DISTANCE_MM:
                return None
        posed = np.isfinite(body).all(axis=1)
        if posed.mean() < _MIN_POSED_SHARE:
            return None
        at, body, turn = at[posed], body[posed], turn[posed]
        place = np.full_like(self.place_mm, np.nan) if mistakes.free else self.place_mm
        seen = self.measured_mm[at + mistakes.shift] * _factor(MM, mistakes.unit, self.spec.unit)
        readings = TargetReadings(body, turn, seen, self.target[at], place, self.robot.tool_mm)
        moves = _MIN_SPREAD_SHARE < self._spread(readings) / self.robot.size_mm < _MAX_SPREAD_SHARE
        return readings if moves else None

    def off_in_robot_frame(self, mistakes: Mistakes) -> float:
        """Median distance in mm that some Mistakes leave where the instrument's frame is the robot's; inf for none."""
        readings = self.readings(mistakes)
        if readings is None or not np.isfinite(place := readings.place_mm[readings.target]).all():
            return np.inf
        model = readings.body_mm + np.einsum("nij,nj->ni", readings.body_turn, place)
        return float(np.median(np.linalg.norm(readings.measured_mm - model, axis=1)))

    def bodies(self, mistakes: Mistakes) -> np.ndarray:
        """Positions (m, 3) of what carries the targets in the rows that decide, NaN where there are none."""
        return self._bodies(mistakes, self.chosen)[0]

    def tools(self, zeros: np.ndarray) -> np.ndarray:
        """Nominal positions (m, 3) of the tool in the rows that decide, with zeros (K,) added to the drive values."""
        body, turn = replace(self, drive=self.drive + zeros)._bodies(self.given, self.chosen)
        return np.asarray(body + turn @ np.asarray(self.robot.tool_mm, dtype=float))

    def _bodies(self, mistakes: Mistakes, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Positions (m, 3), NaN where there are none, and turns (m, 3, 3) of what carries the targets of some rows."""
        if self.command_mm is not None and not self.count:
            turn = self.command_turn[at]
            return self.command_mm[at] - turn @ np.asarray(self.robot.tool_mm, dtype=float), turn
        lengths = np.array(self.robot.parts.units) == "mm"
        length = _factor(MM, mistakes.drive_unit, self.spec.unit_of_drives)
        factor = np.where(lengths, length, _factor(RAD, mistakes.angle_unit, self.spec.angle_unit))
        values = mistakes.applied(self.drive[at]) * factor
        away = np.abs(values - self.robot.legs.home_drives) / np.where(lengths, self.robot.size_mm, 2.0 * np.pi)
        if np.median(away.max(axis=1)) > _MAX_FROM_HOME or not (mistakes == self.given or self._in_range(values)):
            return np.full((len(at), 3), np.nan), np.zeros((len(at), 3, 3))
        # poses that do not exist are expected here
        with np.errstate(all="ignore"):
            body, turn = _closed(self.robot.solve(values, self._guess(values, at)))
            if self.command_mm is not None and np.isnan(body).any():
                # some robots close near the pose alone
                near, turned = _closed(self.robot.solve(values, self.command_mm[at]))
                body, turn = np.where(np.isnan(body), near, body), np.where(np.isnan(turn), turned, turn)
        return body, turn

    def share_in_range(self) -> float:
        """Share of the rows whose drive values are all within their ranges."""
        if not self.count:
            return 1.0
        return float(np.isfinite(self.robot.in_range(self.drive[self.chosen])).all(axis=1).mean())

    def _in_range(self, values: np.ndarray) -> bool:
        """Whether each drive's values (m, K) are within its range in most rows."""
        return bool(np.isfinite(self.robot.in_range(values)).mean(axis=0).min() > 0.5)

    def _guess(self, values: np.ndarray, at: np.ndarray) -> np.ndarray:
        """Positions (m, 3) near which the poses of drive values (m, K) of some rows are."""
        return np.asarray(
            self.robot.guess(values, np.array(self.names)[self.target[at]] if self.robot.legs.end_effectors else None)
        )

    def _rows(self, shift: int) -> np.ndarray:
        """Deciding rows (m,) for which the row `shift` later is of the same run and has measured values."""
        if not shift:
            return self.chosen
        there = self.chosen + shift
        at = self.chosen[(there >= 0) & (there < len(self.run))]
        same = self.run[at] == self.run[at + shift]
        return np.asarray(at[same & np.isfinite(self.measured_mm[at + shift]).all(axis=1)])


def _closed(poses: Poses) -> tuple[np.ndarray, np.ndarray]:
    """Positions (n, 3) and turns (n, 3, 3) of Poses, NaN where these are not closed."""
    return np.where(poses.closed[:, None], poses.position_mm, np.nan), np.where(
        poses.closed[:, None, None], poses.turn, np.nan
    )


def _drawn_rows(at: np.ndarray, most: int) -> np.ndarray:
    """At most `most` of some rows (n,), drawn at random and in their order."""
    return at if len(at) <= most else np.sort(np.random.default_rng(0).choice(at, most, replace=False))


def _moves(position: np.ndarray, robot: Robot) -> bool:
    """Whether positions (n, 3) spread as far as those of a robot do."""
    return len(position) > 1 and _MIN_SPREAD_SHARE < _spread(position) / robot.size_mm < _MAX_SPREAD_SHARE


def _places(frame: pd.DataFrame, spec: IngestSpec, robot: Robot, names: np.ndarray, number: np.ndarray) -> np.ndarray:
    """Stated places (k, 3) of the targets of some names (k,), NaN where there is none; number (n,): of each row's."""
    tool = tuple(np.asarray(robot.tool_mm, dtype=float))
    # where orientations are read a registration finds the tool's place, too
    unnamed = {} if set(TURNS["measured"]) <= set(frame) else {"": tool}
    stated = dict(spec.targets) if "target" in frame else unnamed
    if set(TARGET) <= set(frame):
        return np.asarray(
            frame[[*TARGET]].to_numpy(dtype=float)[[int(np.argmax(number == k)) for k in range(len(names))]]
        )
    return np.array([stated.get(name, (np.nan,) * 3) for name in names.tolist()], dtype=float)


def _run_numbers(frame: pd.DataFrame) -> np.ndarray:
    """Number (n,) of each row's pass along a trajectory."""
    run = frame["run"].to_numpy(dtype=float) if "run" in frame else np.zeros(len(frame))
    path = frame["trajectory"] if "trajectory" in frame else np.full(len(frame), "")
    pairs = pd.DataFrame({"run": np.nan_to_num(run), "trajectory": np.asarray(path)})
    return np.asarray(pairs.groupby(["run", "trajectory"], sort=False).ngroup().to_numpy())


def _factor(units: Mapping[str, float], right: str | None, stated: str) -> float:
    """Factor from the stated unit, in which numbers were read, to the right one; None: the stated one is right."""
    return units[right or stated] / units[stated]


def _rms_without_outliers(off: np.ndarray, target: np.ndarray) -> float:
    """Rms of distances (n,) without outliers, which are large compared with the median of their target (n,)."""
    _, number = np.unique(target, return_inverse=True)
    medians = np.array([np.median(off[number == k]) for k in range(number.max() + 1)])
    return float(np.sqrt((off[off <= _MAX_PER_MEDIAN * medians[number]] ** 2).mean()))


def _spread(position: np.ndarray) -> float:
    """Root mean square distance of positions (n, 3) from their mean, never zero."""
    return max(float(np.sqrt(((position - position.mean(axis=0)) ** 2).sum(axis=1).mean())), 1e-9)
