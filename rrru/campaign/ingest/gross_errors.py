"""Gross mistakes in a file, found before anything is fitted: signs, exchanged drives, shifted rows, wrong targets.

What a mistake does to a robot's error is nothing that a calibration should explain. For the file as it is, and for
every mistake that could be in it, the nominal robot is posed at the drive values, the instrument is registered in
closed form (`rrru.campaign.target_registration`), and the rms that is left is compared. A mistake is named where its
posterior probability is above 0.99. The nominal robot's own errors have an unknown size, alike under all hypotheses, so
that with k independent errors the likelihood of a residual rms r is proportional to r^-k (Jeffreys' prior on the
size); further numbers that a hypothesis fits cost half the logarithm of the readings each (Schwarz, Annals of
Statistics 6, 1978). Lengths in mm, angles in rad.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
import pandas as pd
from scipy.special import logsumexp

from rrru.campaign import measurements as rows
from rrru.campaign.ingest.sheet import MEASURED, TARGET, TURNS, position_text
from rrru.campaign.ingest.spec import IngestSpec
from rrru.campaign.target_registration import TargetReadings, register_targets
from rrru.errors import FitError
from rrru.robots.robot import Robot

# a smaller rms, as a share of the robot's size, is one of ordinary errors of its geometry; assumed
_ORDINARY_SHARE = 2e-3
# a mistake explains a file where what it leaves is less than this share of the robot's size; assumed
_EXPLAINED_SHARE = 5e-3
# rows that decide: enough for the rms of every hypothesis within some percent
_MOST_ROWS = 120
_LEAST_ROWS = 10
# prior probability that a file has a gross mistake, shared by all that are tried; assumed
_PRIOR = 0.01
_CERTAIN = 0.99
# share of the rows at which the nominal robot has to have a pose for a hypothesis to count
_LEAST_POSED = 0.9
# readings farther off than so many medians are spoilt, and do not count
_SPOILT = 6.0
# rows that a column may be shifted by, and mistakes that may be in one file together
_SHIFTS, _MOST_MISTAKES = (1, -1, 2, -2), 3
# hypotheses of each round that are looked at again with spoilt readings left out
_MOST_LOOKED_AT = 5
# independent errors of a robot whose model has few parameters: its joints have more; assumed
_LEAST_INDEPENDENT = 15
# a target that is nearer to its stated place than the first share of the robot's size is not grossly wrong, one that
# is farther than the second cannot be; assumed
_NEAREST_SHARE, _FARTHEST_SHARE = 0.01, 0.5
# a residual of less than this share of the robot's size is as good as none: no hypothesis wins by rounding
_NO_RESIDUAL_SHARE = 1e-5


@dataclass(frozen=True)
class Mistakes:
    """What may be wrong with a file.

    signs (K,): by which the drive values are multiplied; order (K,): number of the drive that each column belongs to;
    shift: rows by which the measured columns are late; free: whether the stated places of the targets are wrong;
    mirrored: whether the instrument's frame is left-handed.
    """

    signs: tuple[int, ...]
    order: tuple[int, ...]
    shift: int = 0
    free: bool = False
    mirrored: bool = False

    @property
    def count(self) -> int:
        """How many mistakes it takes: a sign each, all signs, or one exchange."""
        turned = sum(sign < 0 for sign in self.signs)
        turned = 1 if turned == len(self.signs) else turned
        return turned + (self.order != tuple(sorted(self.order))) + (self.shift != 0) + self.free + self.mirrored

    def applied(self, drive: np.ndarray) -> np.ndarray:
        """Drive values (n, K) as they should be, from those that a file has."""
        result = np.empty_like(drive)
        result[:, list(self.order)] = drive
        return result * self.signs

    def after(self, first: "Mistakes") -> "Mistakes":
        """Signs and order of both, where another one has been applied before."""
        signs = [0] * len(self.signs)
        for k, drive in enumerate(self.order):
            signs[drive] = self.signs[drive] * first.signs[k]
        return replace(self, signs=tuple(signs), order=tuple(self.order[k] for k in first.order))

    def further(self) -> Iterator["Mistakes"]:
        """All that are one mistake away."""
        count = len(self.signs)
        for k in range(count):
            signs = list(self.signs)
            signs[k] = -signs[k]
            yield replace(self, signs=tuple(signs))
        yield replace(self, signs=(-1,) * count)
        for order in _orders(count):
            yield replace(self, order=tuple(self.order[k] for k in order))
        for shift in _SHIFTS:
            yield replace(self, shift=shift)
        yield replace(self, free=True)
        yield replace(self, mirrored=True)


@dataclass(frozen=True)
class GrossError:
    """Mistakes in a file, the rms in mm with and without them, and what to write, in words."""

    mistakes: Mistakes
    rms_mm: float
    rms_without_mm: float
    advice: str

    @property
    def of_readings(self) -> bool:
        """Whether the mistake is in what was measured alone, not in the drive values."""
        return self.mistakes.order == tuple(sorted(self.mistakes.order)) and min(self.mistakes.signs) > 0


def find_gross_error(frame: pd.DataFrame, spec: IngestSpec, robot: Robot) -> GrossError | None:
    """The GrossError that a file's columns show, under our names and in mm and rad; None where none is certain.

    Files without drive values have none here: what was commanded is checked against the robot itself. Robots with
    several hands are left out.
    """
    drives = [*robot.parts.columns]
    if not {*drives, *MEASURED} <= set(frame) or robot.legs.hands:
        return None
    file = _File.of(frame, spec, robot)
    if len(file) < _LEAST_ROWS:
        return None
    given = Mistakes((1,) * len(drives), tuple(range(len(drives))))
    as_is = file.hypothesis(given)
    if as_is.rms_mm <= _ORDINARY_SHARE * robot.size_mm:
        return None
    best, tried = as_is, {given: as_is}
    for _ in range(_MOST_MISTAKES):
        fresh = [one for one in dict.fromkeys(best.mistakes.further()) if one not in tried and one.count]
        roughly = sorted((file.hypothesis(one, robust=False) for one in fresh), key=lambda one: -one.log_evidence)
        found = [file.hypothesis(one.mistakes) for one in roughly[:_MOST_LOOKED_AT]]
        tried |= {one.mistakes: one for one in [*roughly, *found]}
        ahead = max(found, key=lambda one: one.log_evidence)
        if ahead.log_evidence <= best.log_evidence:
            break
        best = ahead
        if best.rms_mm <= _ORDINARY_SHARE * robot.size_mm:
            # the remainder is no mistake
            break
    scores = np.array([one.log_evidence for one in tried.values()])
    certain = np.exp(best.log_evidence - logsumexp(scores)) > _CERTAIN
    if best is as_is or not certain or best.rms_mm > _EXPLAINED_SHARE * robot.size_mm:
        return None
    return GrossError(best.mistakes, as_is.rms_mm, best.rms_mm, file.advice(best))


@dataclass(frozen=True)
class _Hypothesis:
    """Mistakes, the rms that they leave, places (k, 3) of the targets and the log evidence."""

    mistakes: Mistakes
    rms_mm: float
    place_mm: np.ndarray
    log_evidence: float


@dataclass(frozen=True)
class _File:
    """Drive values (n, K), measured positions (n, 3), runs (n,), and each row's target (n,).

    names, place_mm (k, 3): of the targets, NaN where no place is stated; chosen: rows that decide;
    configured: signs and order that the configuration states and that the drive values have already.
    """

    robot: Robot
    drive: np.ndarray
    measured_mm: np.ndarray
    run: np.ndarray
    target: np.ndarray
    names: tuple[str, ...]
    place_mm: np.ndarray
    chosen: np.ndarray
    configured: Mistakes

    def __len__(self) -> int:
        return len(self.chosen)

    @classmethod
    def of(cls, frame: pd.DataFrame, spec: IngestSpec, robot: Robot) -> "_File":
        """From a file's columns."""
        drive = frame[[*robot.parts.columns]].to_numpy(dtype=float)
        measured = rows.measured(frame)
        names = frame["target"].astype(str).to_numpy() if "target" in frame else np.full(len(frame), "")
        known, number = np.unique(names, return_inverse=True)
        tool = tuple(np.asarray(robot.tool_mm, dtype=float))
        # where orientations are read a registration finds the tool's place, too
        unnamed = {} if set(TURNS["measured"]) <= set(frame) else {"": tool}
        stated = dict(spec.targets) if "target" in frame else unnamed
        place = np.array([stated.get(name, (np.nan,) * 3) for name in known.tolist()], dtype=float)
        if set(TARGET) <= set(frame):
            first = [int(np.argmax(number == k)) for k in range(len(known))]
            place = frame[[*TARGET]].to_numpy(dtype=float)[first]
        run = frame["run"].to_numpy() if "run" in frame else np.zeros(len(frame))
        run = np.where(np.isfinite(run.astype(float)), run.astype(float), 0.0)
        labels = run if "trajectory" not in frame else _labels(run, frame["trajectory"].to_numpy())
        right = np.isfinite(drive).all(axis=1) & np.isfinite(measured).all(axis=1)
        right &= ~np.isin(names, spec.world_targets)
        chosen = np.flatnonzero(right)
        if len(chosen) > _MOST_ROWS:
            chosen = np.sort(np.random.default_rng(0).choice(chosen, _MOST_ROWS, replace=False))
        drives = [*robot.parts.columns]
        order = tuple(drives.index(name) for name in spec.order or drives)
        configured = Mistakes(tuple(spec.signs.get(name, 1) for name in drives), order)
        return cls(robot, drive, measured, labels, number, tuple(known.tolist()), place, chosen, configured)

    def hypothesis(self, mistakes: Mistakes, robust: bool = True) -> _Hypothesis:
        """The _Hypothesis of some mistakes; of an endless rms where the nominal robot has no poses then.

        robust: without spoilt readings.
        """
        prior = mistakes.count * np.log(_PRIOR / self._ways)
        at, size = self._rows(mistakes.shift), self.robot.size_mm
        independent = min(max(len(self.robot.parameters), _LEAST_INDEPENDENT), 3 * len(self) // 2)
        impossible = _Hypothesis(mistakes, np.inf, self.place_mm, float(prior - independent * np.log(size)))
        if len(at) < _LEAST_ROWS:
            return impossible
        values = mistakes.applied(self.drive[at])
        # poses that do not exist are an answer here
        with np.errstate(invalid="ignore"):
            poses = self.robot.solve(values, self.robot.guess(values))
        posed = poses.closed & np.isfinite(poses.position_mm).all(axis=1)
        if posed.mean() < _LEAST_POSED:
            return impossible
        poses, at = poses.of(posed), at[posed]
        stated = np.isfinite(self.place_mm).all(axis=1)
        place = np.full_like(self.place_mm, np.nan) if mistakes.free else self.place_mm
        bodies = poses.position_mm, poses.turn
        seen = self.measured_mm[at + mistakes.shift], self.target[at], place, self.robot.tool_mm
        try:
            found = register_targets(TargetReadings(*bodies, *seen), mistakes.mirrored, robust)
        except FitError:
            return impossible
        moved = np.linalg.norm((found.place_mm - self.place_mm)[stated], axis=1)
        if mistakes.free and not _NEAREST_SHARE * size < moved.max(initial=0.0) < _FARTHEST_SHARE * size:
            return impossible
        off = np.linalg.norm(found.residual_mm, axis=1)
        off = off[off <= _SPOILT * np.median(off)] if robust else off
        rms = float(np.sqrt((off**2).mean()))
        size = max(rms, _NO_RESIDUAL_SHARE * size)
        cost = 1.5 * (stated & np.isin(np.arange(len(stated)), self.target[at])).sum() * mistakes.free
        evidence = prior - independent * np.log(size) - cost * np.log(3.0 * len(at))
        return _Hypothesis(mistakes, rms, found.place_mm, float(evidence))

    @property
    def _ways(self) -> int:
        """How many single mistakes there are."""
        count = self.drive.shape[1]
        return count + len(_orders(count)) + len(_SHIFTS) + 3

    def _rows(self, shift: int) -> np.ndarray:
        """Rows (m,) whose measured values, so many rows on, are of the same run and target."""
        if not shift:
            return self.chosen
        there = self.chosen + shift
        at = self.chosen[(there >= 0) & (there < len(self.run))]
        same = (self.run[at] == self.run[at + shift]) & (self.target[at] == self.target[at + shift])
        return at[same & np.isfinite(self.measured_mm[at + shift]).all(axis=1)]

    def advice(self, found: _Hypothesis) -> str:
        """What to write into the configuration or to mend in the file."""
        mistakes, drives, texts = found.mistakes, self.robot.parts.columns, []
        whole = mistakes.after(self.configured)
        if whole.order != self.configured.order:
            named = f"order: [{', '.join(drives[k] for k in whole.order)}]"
            texts.append(named if whole.order != tuple(sorted(whole.order)) else "no `order`")
        if whole.signs != self.configured.signs:
            turned = [f"{drives[k]}: -1" for k, sign in enumerate(whole.signs) if sign < 0]
            texts.append(f"signs: {{{', '.join(turned)}}}" if turned else "no `signs`")
        if mistakes.shift:
            side, count = ("late", mistakes.shift) if mistakes.shift > 0 else ("early", -mistakes.shift)
            texts.append(f"measured columns that are not {count} row{'s' * (count > 1)} {side}")
        if mistakes.free:
            named = [name for name in self.names if name]
            places = ", ".join(
                f"{name}: [{', '.join(f'{value:.4g}' for value in place)}]"
                for name, place, stated in zip(self.names, found.place_mm, self.place_mm, strict=True)
                if np.isfinite(stated).all()
            )
            texts.append(f"targets: {{{places}}}" if named else f"a tool at {position_text(found.place_mm[0])}")
        if mistakes.mirrored:
            texts.append("a right-handed frame: turn the sign of one measured axis")
        return " and ".join(texts)


def _labels(run: np.ndarray, trajectory: np.ndarray) -> np.ndarray:
    """Number (n,) of each row's run of one trajectory."""
    pairs = pd.DataFrame({"run": run, "trajectory": trajectory})
    return pairs.groupby(["run", "trajectory"], sort=False).ngroup().to_numpy()


def _orders(count: int) -> tuple[tuple[int, ...], ...]:
    """Orders of so many drives that are tried: two exchanged, all turned round, and all moved on by some places."""
    plain = tuple(range(count))
    result = []
    for i, j in combinations(plain, 2):
        order = list(plain)
        order[i], order[j] = j, i
        result.append(tuple(order))
    result.append(plain[::-1])
    result += [plain[k:] + plain[:k] for k in range(1, count)]
    return tuple(dict.fromkeys(order for order in result if order != plain))
