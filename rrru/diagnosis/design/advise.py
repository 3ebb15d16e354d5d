"""Which further run would decide between answers: computed by what each candidate adds, not by rule of thumb.

Candidates are further passes along a campaign's own trajectories. Where none of them would resolve most of the doubt
between all probable answers, poses are chosen too, each the one that adds most to those before it. What they add is
counted as `rrru.diagnosis.design.expected_information` says. Where trajectories were driven again before, and that was
expected to decide, the readings show which share f of the expected gain may have been realized. What needs no other
payload or speed is then worth f times as much. No candidate exceeds the limits of the robot, see
`rrru.diagnosis.design.run_limits`.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
import pandas as pd

from rrru.arrays import FloatArray
from rrru.campaign import measurements as rows
from rrru.diagnosis.aliases import Row
from rrru.diagnosis.design import poses
from rrru.diagnosis.design.expected_information import Contests, contests, realized_log_bayes_factors
from rrru.diagnosis.design.rival_answers import RivalAnswer, rival_answers
from rrru.diagnosis.design.run_limits import RunLimits, StatedLimits, run_limits
from rrru.diagnosis.inference import InferenceResult
from rrru.diagnosis.make_problem import make_diagnosis_problem
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.problem import DiagnosisProblem
from rrru.diagnosis.verdict import Verdict
from rrru.effects.protocol import LOADS, PATH
from rrru.kinematics.dynamics import Masses

RUN = ("run", "kind", "trajectory", "reverse", "speed_mm_s", "payload_kg", "points")
_COLUMNS = (*RUN, "separates", "now_nats", "gain_nats")
_POSE = ("pose", *(f"{end}_{axis}_mm" for end in ("from", "to") for axis in "xyz"))
_POSE += (*(f"command_r{axis}_rad" for axis in "xyz"), "speed_mm_s", "payload_kg")
# words for a pass that repeats one that was driven
_AGAIN = "once more"
# needs of effects that the speed of a pass does not change
_ALIKE_AT_ANY_SPEED = {PATH, "drive", "position_mm", "payload_kg", "temperature_c"}
# kinds of further passes, the simplest first: in reverse, fast, loaded
_KINDS = ((False, False, False), (True, False, False), (False, False, True), (False, True, False), (True, True, True))


@dataclass(frozen=True)
class Advice:
    """Rows of `gap_next_runs`, best first, without campaign and rank, and of `gap_next_poses` without campaign.

    undecided: the two answers, "a / b", that nothing which can be simulated would decide between, else empty; limited:
    which limit of the robot leaves candidates out, in words, else empty.
    """

    runs: pd.DataFrame
    poses: pd.DataFrame
    undecided: str = ""
    limited: str = ""


NOTHING = Advice(pd.DataFrame(columns=_COLUMNS), pd.DataFrame(columns=_POSE))


def advise(inference: InferenceResult, verdict: Verdict, masses: Masses, stated: StatedLimits | None = None) -> Advice:
    """The Advice, empty where no rival answer is left that the library can predict.

    stated: StatedLimits of the robot, by default none. Runs that resolve most of the doubt come first.
    """
    answers = rival_answers(inference.posterior, verdict)
    if not answers:
        return NOTHING
    stated = stated or StatedLimits()
    limits, limited = run_limits(inference.problem, masses, stated)
    found, listed, share = _runs(inference, answers, masses, limits), NOTHING.poses, 1.0
    if found:
        share = realized_share(inference, found)
        found = [one.as_realized(share) for one in found]
    if not any(one.resolves > OPTIONS.decisive_share for one in found):
        poses_found, listed = _poses(inference, answers, masses, limits)
        found += [one.as_realized(share) for one in poses_found]
    rows = [one.row() for one in found]
    # of runs that are equally informative the simplest one, as they are listed
    order = sorted(range(len(rows)), key=lambda k: -round(found[k].resolves, 2))
    worth = [k for k in order if rows[k]["gain_nats"] > OPTIONS.min_run_gain_nats][: OPTIONS.max_advised_runs]
    runs = pd.DataFrame([rows[k] for k in worth], columns=_COLUMNS)
    open_still = verdict.sure < OPTIONS.min_sure_probability and not any(
        one.gain_of_first > OPTIONS.min_run_gain_nats for one in found
    )
    listed = listed if (runs["kind"] == "poses").any() else NOTHING.poses
    undecided = " / ".join(one.words for one in answers[:2]) if open_still else ""
    return Advice(runs, listed, undecided, limited or (stated.words if open_still else ""))


@dataclass(frozen=True)
class Candidate:
    """A run as a mapping of the columns RUN, the Contests it is counted for, and its gains (s,) in nats.

    plain: gains (s,) of the same trajectory driven once more, without another payload or speed.
    """

    run: Row
    contests: Contests
    gains: FloatArray
    plain: FloatArray

    @property
    def resolves(self) -> float:
        """The share of the doubt that it resolves."""
        return float(self.contests.resolved(self.gains).sum())

    @property
    def gain_of_first(self) -> float:
        """Gain in nats for the two most probable answers."""
        return float(self.contests.by_pair(self.gains)[self.contests.first])

    def as_realized(self, share: float) -> "Candidate":
        """With the gain that needs no other payload or speed multiplied by the share that was realized before."""
        return replace(self, gains=self.gains - (1.0 - share) * np.clip(self.plain, 0.0, self.gains))

    def row(self) -> Row:
        """Row of `gap_next_runs` without campaign and rank, for the pair of answers of which it resolves most."""
        pair = int(self.contests.resolved(self.gains).argmax())
        now, gain = float(self.contests.now_nats[pair]), float(self.contests.by_pair(self.gains)[pair])
        return self.run | {"separates": self.contests.separates(pair), "now_nats": now, "gain_nats": gain}


def _runs(
    inference: InferenceResult, answers: Sequence[RivalAnswer], masses: Masses, limits: RunLimits
) -> list[Candidate]:
    """All candidate runs."""
    choice, table = candidates(inference.problem.measurements, limits)
    planned = _planned(inference.problem, table, masses) if choice else None
    if planned is None or not _have_inputs(planned, answers):
        return []
    about = contests(inference, answers, planned)
    gains = about.gains()
    again = {run["trajectory"]: gain for run, gain in zip(choice, gains, strict=True) if _is_again(run)}
    most = np.max([*again.values()], axis=0, initial=0.0) if again else np.zeros(gains.shape[1])
    return [
        Candidate(run, about, gain, again.get(run["trajectory"], most)) for run, gain in zip(choice, gains, strict=True)
    ]


def _is_again(run: Row) -> bool:
    """Whether a run repeats one that was driven, alike."""
    return bool(run["run"] == f"{run['trajectory']} {_AGAIN}")


def realized_share(inference: InferenceResult, found: Sequence[Candidate]) -> float:
    """Share of the expected gain that runs along trajectories driven before may have added, at most 1.

    1 where they were not expected to decide. A log Bayes factor expected to be E has the variance 2 E: the share is the
    largest that is within one standard deviation of what the readings of all these runs added.
    """
    about = found[0].contests
    again = {one.run["trajectory"]: one for one in found if _is_again(one.run)}
    frame = inference.problem.measurements[inference.problem.used]
    by_run = frame.groupby("run", sort=False)["trajectory"]
    driven = by_run.first().astype(str)
    repeated = driven[driven.duplicated() & driven.isin(again)]
    shares = by_run.size()[repeated.index] / [again[name].run["points"] for name in repeated]
    expected = float(shares @ [again[name].gain_of_first for name in repeated]) if len(repeated) else 0.0
    if not expected > OPTIONS.decisive_gain_nats:
        return 1.0
    # evidence for either answer counts
    factors = realized_log_bayes_factors(inference, [one.answer for one in about.pairs[about.first]])
    realized = abs(sum(factors.get(run, np.inf) for run in repeated.index))
    return float(min((realized + np.sqrt(2.0 * expected)) / expected, 1.0))


def _planned(problem: DiagnosisProblem, table: pd.DataFrame, masses: Masses) -> DiagnosisProblem:
    """The problem of a table of planned runs."""
    return make_diagnosis_problem(
        table,
        problem.mechanism,
        masses,
        problem.noise_mm,
        problem.effects,
        characteristic_length_mm=problem.characteristic_length_mm,
    )


def _have_inputs(planned: DiagnosisProblem, answers: Sequence[RivalAnswer]) -> bool:
    """Whether planned runs have what the effects of all answers need, such as times or temperatures."""
    return all(term.effect in planned.library for one in answers for term in one.answer[0].terms)


def _poses(
    inference: InferenceResult, answers: Sequence[RivalAnswer], masses: Masses, limits: RunLimits
) -> tuple[list[Candidate], pd.DataFrame]:
    """Poses as a candidate in a list, which is empty where there are none, and `gap_next_poses`.

    They are driven as the campaign was, or faster, or with a higher payload, whichever is most informative.
    """
    problem = inference.problem
    best: tuple[list[Candidate], pd.DataFrame] = [], NOTHING.poses
    passes = poses.passes(problem.measurements, problem.mechanism)
    if not len(passes):
        return best
    stated_speed, payload = float(problem.measurements["speed_mm_s"].median()), _payloads(problem.measurements)
    own_speed = stated_speed if np.isfinite(stated_speed) else _speed(problem.measurements)
    # a payload that was carried: the median may lie between two
    own_load = float(np.quantile(payload, 0.5, method="higher"))
    last_s, most = _end_s(problem.measurements), 0.0
    # no more readings than there are
    most_poses = min(OPTIONS.max_advised_poses, max(problem.count // OPTIONS.points_per_pass, 1))
    for fast, loaded in _harder(problem, answers):
        speed = limits.fast(stated_speed, np.full(1, np.nan)) if fast else own_speed
        load = limits.loaded_kg(float(payload.max())) if loaded else own_load
        if (fast and not (speed > stated_speed and np.isfinite(last_s))) or (loaded and not load > own_load):
            continue
        # passes at which a drive would be too fast are left out
        some = passes.some([not fast or limits.slower(rate * speed) >= 1.0 for rate in passes.rates_per_mm])
        if not len(some) or not limits.allows(speed, load):
            continue
        table = some.commands(problem.mechanism, last_s + OPTIONS.pause_between_runs_s, speed, load)
        planned = _planned(problem, table, masses)
        if not _have_inputs(planned, answers):
            continue
        about = contests(inference, answers, planned)
        chosen, gains = about.choose(most_poses)
        within = some.within(chosen, speed, limits.seconds)
        if within < len(chosen):
            chosen, gains = about.choose(within)
        if not chosen:
            continue
        resolved = float(about.resolved(gains).sum())
        # a higher payload or speed has to be clearly more informative
        if resolved > OPTIONS.min_gain_ratio_of_harder_poses * most:
            count, most = len(chosen), resolved
            words = (
                " ".join([f"{count} {'poses' if count > 1 else 'pose'}", *_how(fast, loaded, speed, load)]),
                "poses",
                "poses",
                False,
            )
            run = dict(zip(RUN, (*words, speed, load, count * OPTIONS.points_per_pass), strict=True))
            listed = some.listed(chosen).assign(speed_mm_s=speed, payload_kg=load)
            best = [Candidate(run, about, gains, gains)], listed
    return best


def _harder(problem: DiagnosisProblem, answers: Sequence[RivalAnswer]) -> Iterator[tuple[bool, bool]]:
    """Whether passes are faster, and whether they have a higher payload, as far as an effect of an answer differs.

    Passes at which every effect is the same as at others decide no more than these.
    """
    terms = [term for one in answers for term in one.answer[0].terms]
    needs = {need for term in terms for need in problem.library[term.effect].needs}
    by_speed, by_load = needs - _ALIKE_AT_ANY_SPEED, needs & {*LOADS, "payload_kg"}
    return product((False, True) if by_speed else (False,), (False, True) if by_load else (False,))


def _how(fast: bool, loaded: bool, speed: float, load: float) -> list[str]:
    """In words how a kind of pass differs from those of the campaign."""
    return [f"at {speed:g} mm/s"] * fast + [f"with {load:g} kg payload"] * loaded


def _end_s(frame: pd.DataFrame) -> float:
    """Time at which a measurement table ends, NaN where it has none."""
    return np.nanmax(frame["time_s"].to_numpy(dtype=float)) if frame["time_s"].notna().any() else np.nan


def _payloads(frame: pd.DataFrame) -> FloatArray:
    """Payloads (n,) in kg of a measurement table, 0 where it is unknown."""
    return np.asarray(np.nan_to_num(frame["payload_kg"].to_numpy(dtype=float)))


def _speed(frame: pd.DataFrame) -> float:
    """Speed in mm/s between the points of a measurement table, by its times; NaN where it has none."""
    way = np.linalg.norm(np.diff(rows.command(frame), axis=0), axis=1)
    time = np.diff(frame["time_s"].to_numpy(dtype=float))
    moved = (np.diff(frame["run"].to_numpy()) == 0) & (way > 0.0) & (time > 0.0)
    return float(np.median(way[moved] / time[moved])) if moved.any() else np.nan


def candidates(frame: pd.DataFrame, limits: RunLimits | None = None) -> tuple[list[Row], pd.DataFrame]:
    """Candidate runs as mappings of the columns RUN of `gap_next_runs`, and their commands, numbered from 1.

    Every kind of pass along some of a measurement table's trajectories that keeps the RunLimits, by default those of a
    robot of which nothing is known.
    """
    limits = limits or RunLimits()
    count = frame.groupby(["trajectory", "run"], sort=False).size().groupby("trajectory", sort=False).max()
    # passes of poses that were driven before are no trajectories
    names = count.index[(count > OPTIONS.points_per_pass) | (count.max() <= OPTIONS.points_per_pass)]
    chosen = names[np.unique(np.linspace(0, len(names) - 1, OPTIONS.max_advised_trajectories).astype(int))]
    end, result = _end_s(frame), []
    tables: list[pd.DataFrame] = []
    for name in chosen:
        first = frame[frame["trajectory"] == name]
        first = first[first["run"] == first["run"].iloc[0]]
        own_speed, own_load = float(first["speed_mm_s"].iloc[0]), float(_payloads(first).max())
        fastest, heaviest = limits.fast(own_speed, _rates(first, limits.columns)), limits.loaded_kg(own_load)
        for reverse, fast, loaded in _KINDS:
            if (fast and not (fastest > own_speed and np.isfinite(end))) or (loaded and not heaviest > own_load):
                continue
            speed, load = fastest if fast else own_speed, heaviest if loaded else own_load
            carried = first.assign(payload_kg=heaviest if loaded else _payloads(first))
            table = _pass(carried, len(tables) + 1, end + OPTIONS.pause_between_runs_s, reverse, speed)
            if not limits.allows(speed, load, _seconds(table)):
                continue
            tables.append(table)
            how = ["in reverse"] * reverse + _how(fast, loaded, speed, load)
            words = f"{name} {' '.join(how) or _AGAIN}"
            result.append(dict(zip(RUN, (words, "run", str(name), reverse, speed, load, len(first)), strict=True)))
    return result, pd.concat(tables, ignore_index=True) if tables else frame.iloc[:0]


def _rates(run: pd.DataFrame, columns: Iterable[str]) -> FloatArray:
    """Largest rates (K,) of the drives of some columns between the points of a run; NaN where it has no times."""
    time = np.diff(run["time_s"].to_numpy(dtype=float))
    way = np.abs(np.diff(run[[*columns]].to_numpy(dtype=float), axis=0))
    rate = np.divide(way, time[:, None], out=np.full(way.shape, np.nan), where=time[:, None] > 0.0)
    return np.asarray(np.nanmax(rate, axis=0, initial=0.0))


def _seconds(run: pd.DataFrame) -> float:
    """Driving time of a run, by its times, else by its way and its speed; NaN where it has neither."""
    time = run["time_s"].to_numpy(dtype=float)
    if np.isfinite(time).any():
        return float(np.nanmax(time) - np.nanmin(time))
    way = np.linalg.norm(np.diff(rows.command(run), axis=0), axis=1).sum()
    return float(way / run["speed_mm_s"].iloc[0])


def _pass(first: pd.DataFrame, number: int, start_s: float, reverse: bool, speed_mm_s: float) -> pd.DataFrame:
    """Table of one more pass along the points of a run, with its payloads."""
    run = (first.iloc[::-1] if reverse else first).reset_index(drop=True)
    clock = first["time_s"].to_numpy(dtype=float)
    time = clock[-1] - clock[::-1] if reverse else clock - clock[0]
    own_speed = float(first["speed_mm_s"].iloc[0])
    if np.isfinite(own_speed) and speed_mm_s != own_speed:
        # the same profile, driven faster: the average speed over the run rises in proportion
        time = time * own_speed / speed_mm_s
    measured = rows.vector_columns("measured", rows.command(run))
    planned = {"run": number, "time_s": start_s + time, "speed_mm_s": speed_mm_s}
    return run.assign(**planned, status="ok", **measured)
