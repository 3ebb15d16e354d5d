"""Which further run would decide between two answers: computed by what each candidate adds, not by rule of thumb.

Candidates are further passes along a campaign's own trajectories. Where none of them would decide between the first two
answers, poses are chosen too, each the one that adds most to those before it. What they add is counted as
`rrru.diagnosis.design.expected_information` says. Where a trajectory was driven again before, and that was expected to
decide, the readings show which share f of the expected gain was realized. What needs no other payload or speed is then
worth f times as much. No candidate exceeds the limits of the robot, see
`rrru.diagnosis.design.run_limits`.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
import pandas as pd

from rrru.arrays import FloatArray
from rrru.campaign import measurements as rows
from rrru.diagnosis.aliases import Row
from rrru.diagnosis.design import poses
from rrru.diagnosis.design.expected_information import (
    AnswerPair,
    answer_pairs,
    choose_greedily,
    present_and_planned,
    realized_log_bayes_factors,
)
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
# kinds of further passes: in reverse, fast, loaded
_KINDS = ((False, False, False), (True, False, False), (False, True, False), (False, False, True), (True, True, True))


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


def advise(
    inference: InferenceResult,
    verdict: Verdict,
    masses: Masses,
    stated: StatedLimits | None = None,
    sizes: Mapping[str, float] | None = None,
) -> Advice:
    """The Advice, empty where no rival answer is left that the library can predict.

    stated: StatedLimits of the robot, by default none; sizes: by effect the rms in mm of its part of the gap. Runs that
    decide what matters most come first.
    """
    pairs = answer_pairs(inference, verdict, sizes or {})
    if not pairs:
        return NOTHING
    stated = stated or StatedLimits()
    limits, limited = run_limits(inference.problem, masses, stated)
    result = _runs(inference, pairs, masses, limits)
    seen = [_realized(inference, pair, result, number) for number, pair in enumerate(pairs)]
    result = [_as_realized(row, seen[row["pair"]]) for row in result]
    first, listed = [row for row in result if row["pair"] == 0], NOTHING.poses
    if not any(row["gain_nats"] > OPTIONS.decisive_gain_nats for row in first):
        row, listed = _poses(inference, pairs[0], masses, limits)
        row = [_as_realized(one, seen[0]) for one in row]
        result, first = result + row, first + row
    runs = pd.DataFrame(result, columns=["pair", *_COLUMNS])
    runs = runs[runs["gain_nats"] > OPTIONS.min_run_gain_nats]
    # decisive runs first, those of the most important pair before others; then the most informative ones
    turn = runs["pair"].where(runs["gain_nats"] > OPTIONS.decisive_gain_nats, len(pairs))
    runs = runs.assign(turn=turn).sort_values(
        ["turn", "gain_nats", "run"], ascending=[True, False, True], kind="stable"
    )
    runs = runs.drop_duplicates("run").head(OPTIONS.max_advised_runs)[[*_COLUMNS]].reset_index(drop=True)
    some_gain = any(row["gain_nats"] > OPTIONS.min_run_gain_nats for row in first)
    open_still = not some_gain and verdict.sure < OPTIONS.min_sure_probability
    listed = listed if (runs["kind"] == "poses").any() else NOTHING.poses
    undecided = pairs[0].separates if open_still else ""
    return Advice(runs, listed, undecided, limited or (stated.words if open_still else ""))


def _runs(inference: InferenceResult, pairs: Sequence[AnswerPair], masses: Masses, limits: RunLimits) -> list[Row]:
    """Rows of `gap_next_runs` of all candidate runs, with the number of the AnswerPair that each is counted for."""
    choice, table = candidates(inference.problem.measurements, limits)
    if not choice:
        return []
    planned, result = _planned(inference.problem, table, masses), []
    for number, pair in enumerate(pairs):
        if not _have_inputs(planned, pair):
            continue
        now, added = present_and_planned(inference, pair.truth, pair.rival, planned)
        start = now.misfit_nats()
        for run, one in zip(choice, added, strict=True):
            about = {"pair": number, "separates": pair.separates, "now_nats": start}
            result.append(run | about | {"gain_nats": (now + one).misfit_nats() - start})
    return result


def _realized(
    inference: InferenceResult, pair: AnswerPair, rows: Sequence[Row], number: int
) -> tuple[float, dict[str, float]]:
    """Share of the expected gain that the last run along a trajectory driven before has added, at most 1.

    1 where it was not expected to decide. And the expected gain of a plain repetition by trajectory; number: of the
    AnswerPair among rows of `_runs`.
    """
    again = [row for row in rows if row["pair"] == number and row["run"] == f"{row['trajectory']} {_AGAIN}"]
    expected = {row["trajectory"]: row["gain_nats"] for row in again}
    frame = inference.problem.measurements[inference.problem.used]
    driven = frame.groupby("run", sort=False)["trajectory"].first().astype(str)
    repeated = driven[driven.duplicated() & driven.isin(expected)]
    if repeated.empty:
        return 1.0, expected
    run, trajectory = repeated.index[-1], repeated.iloc[-1]
    count = next(row["points"] for row in again if row["trajectory"] == trajectory)
    whole = expected[trajectory] * float((frame["run"] == run).sum()) / count
    if not whole > OPTIONS.decisive_gain_nats:
        return 1.0, expected
    # evidence for either answer counts
    found = abs(realized_log_bayes_factors(inference, pair.truth, pair.rival).get(run, np.inf))
    return float(min(found / whole, 1.0)), expected


def _as_realized(row: Row, seen: tuple[float, Mapping[str, float]]) -> Row:
    """A row of `gap_next_runs` whose gain without another payload or speed is multiplied by `_realized`'s share."""
    share, expected = seen
    plain = expected.get(row["trajectory"], max(expected.values(), default=0.0))
    if row["run"].endswith(" poses"):
        plain = row["gain_nats"]
    return row | {"gain_nats": row["gain_nats"] - (1.0 - share) * min(row["gain_nats"], max(plain, 0.0))}


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


def _have_inputs(planned: DiagnosisProblem, pair: AnswerPair) -> bool:
    """Whether planned runs have what the effects of an AnswerPair need, such as times or temperatures."""
    answers = pair.truth, pair.rival
    return all(term.effect in planned.library for hypothesis, _ in answers for term in hypothesis.terms)


def _poses(
    inference: InferenceResult, pair: AnswerPair, masses: Masses, limits: RunLimits
) -> tuple[list[Row], pd.DataFrame]:
    """The row of poses of `gap_next_runs` in a list, which is empty where there are none, and `gap_next_poses`.

    They are driven as the campaign was, or faster, or with a higher payload, whichever is most informative.
    """
    problem = inference.problem
    best: tuple[list[Row], pd.DataFrame] = [], NOTHING.poses
    passes = poses.passes(problem.measurements, problem.mechanism)
    if not len(passes):
        return best
    stated_speed, payload = float(problem.measurements["speed_mm_s"].median()), _payloads(problem.measurements)
    own_speed = stated_speed if np.isfinite(stated_speed) else _speed(problem.measurements)
    # a payload that was carried: the median may lie between two
    own_load = float(np.quantile(payload, 0.5, method="higher"))
    last_s, most = _end_s(problem.measurements), 0.0
    for fast, loaded in _harder(problem, pair):
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
        if not _have_inputs(planned, pair):
            continue
        now, added = present_and_planned(inference, pair.truth, pair.rival, planned)
        chosen, _ = choose_greedily(now, added, OPTIONS.max_advised_poses)
        chosen = chosen[: some.within(chosen, speed, limits.seconds)]
        if not chosen:
            continue
        gain = sum((added[number] for number in chosen), now).misfit_nats() - now.misfit_nats()
        # a higher payload or speed has to be clearly more informative
        if gain > OPTIONS.min_gain_ratio_of_harder_poses * most:
            count, most = len(chosen), gain
            words = " ".join([f"{count} poses", *_how(fast, loaded, speed, load)]), "poses", "poses", False
            row = *words, speed, load, count * OPTIONS.points_per_pass, pair.separates, now.misfit_nats(), gain
            listed = some.listed(chosen).assign(speed_mm_s=speed, payload_kg=load)
            best = [{"pair": 0, **dict(zip(_COLUMNS, row, strict=True))}], listed
    return best


def _harder(problem: DiagnosisProblem, pair: AnswerPair) -> Iterator[tuple[bool, bool]]:
    """Whether passes are faster, and whether they have a higher payload, as far as an effect of an AnswerPair differs.

    Passes at which every effect is the same as at others decide no more than these.
    """
    terms = [term for hypothesis, _ in (pair.truth, pair.rival) for term in hypothesis.terms]
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
