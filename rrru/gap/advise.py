"""Which further run would tell two answers apart: computed by what each candidate adds, not by rule of thumb.

Candidates are further passes along a campaign's own trajectories. Where none of them would rule a rival out, poses are
chosen too, each the one that adds most to those before it. What they add is counted as `rrru.gap.worth` says.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np
import pandas as pd

from rrru.campaign import measurements as rows
from rrru.gap import poses
from rrru.gap.make_case import make_case
from rrru.gap.options import OPTIONS
from rrru.gap.verdict import label
from rrru.gap.worth import greedy, worth

RUN = ("run", "kind", "trajectory", "reverse", "speed_mm_s", "payload_kg", "points")
_COLUMNS = (*RUN, "separates", "now_nats", "gain_nats")
_POSE = ("pose", *(f"{end}_{axis}_mm" for end in ("from", "to") for axis in "xyz"), "speed_mm_s", "payload_kg")
# kinds of further passes: in reverse, fast, loaded
_KINDS = ((False, False, False), (True, False, False), (False, True, False), (False, False, True), (True, True, True))


@dataclass(frozen=True)
class Advice:
    """Rows of `gap_next_runs`, best first, without campaign and rank, and of `gap_next_poses` without campaign."""

    runs: pd.DataFrame
    poses: pd.DataFrame


NOTHING = Advice(pd.DataFrame(columns=_COLUMNS), pd.DataFrame(columns=_POSE))


def advise(attribution, verdict, masses, most=OPTIONS.max_advised_runs):
    """The Advice, empty where no rival answer is left that the library can predict."""
    contests = [] if verdict.unexplained else list(_contests(attribution, verdict))
    if not contests:
        return NOTHING
    choice, table = candidates(attribution.case.measurements)
    if not choice:
        return NOTHING
    planned, result = _planned(attribution.case, table, masses), []
    contests = [contest for contest in contests if _tell(planned, contest)]
    for separates, truth, imitator in contests:
        now, added = worth(attribution, truth, imitator, planned)
        start = now.nats()
        gains = ((now + one).nats() - start for one in added)
        result += [
            run | {"separates": separates, "now_nats": start, "gain_nats": gain}
            for run, gain in zip(choice, gains, strict=True)
        ]
    runs = pd.DataFrame(result, columns=_COLUMNS)
    listed = NOTHING.poses
    if contests and not (runs["gain_nats"] > OPTIONS.decisive_gain_nats).any():
        row, listed = _poses(attribution, contests[0], masses)
        runs = pd.DataFrame([*result, *row], columns=_COLUMNS)
    runs = runs[runs["gain_nats"] > OPTIONS.min_run_gain_nats]
    runs = runs.sort_values(["gain_nats", "run"], ascending=[False, True], kind="stable")
    runs = runs.drop_duplicates("run").head(most).reset_index(drop=True)
    return Advice(runs, listed if (runs["kind"] == "poses").any() else NOTHING.poses)


def _contests(attribution, verdict):
    """What is to be told apart, in words, and its two (hypothesis, level), for the favoured answer and its rivals."""
    effects = frozenset(verdict.effects)
    favoured = attribution.posterior.best_of(effects)
    rivals = [frozenset(names) for names, flag, _ in verdict.rivals if not flag and frozenset(names) != effects]
    if not rivals and verdict.probability < OPTIONS.min_sure_probability:
        rivals = [names for names, flag in attribution.posterior.sets() if not flag and names != effects]
    for names in rivals[: OPTIONS.max_advised_rivals]:
        other = attribution.posterior.best_of(names)
        # a rival may be one only beside something small that is unknown
        if favoured is not None and other is not None:
            # the answer with more effects makes the data: the smaller one could not make the larger one's
            pair = (favoured, other) if len(favoured[0].terms) >= len(other[0].terms) else (other, favoured)
            yield " / ".join(label(sorted(answer), False) for answer in (effects, names)), *pair


def _planned(case, table, masses):
    """The case of a table of planned runs."""
    return make_case(table, case.mechanism, masses, case.noise_mm, case.effects, arm_mm=case.arm_mm)


def _tell(planned, contest):
    """Whether planned runs tell what the effects of a contest need, such as times or temperatures."""
    _, *answers = contest
    return all(term.effect in planned.library for hypothesis, _ in answers for term in hypothesis.terms)


def _poses(attribution, contest, masses):
    """The row of poses of `gap_next_runs` in a list, which is empty where there are none, and `gap_next_poses`.

    They are driven as the campaign was, or faster, or with a higher payload, whichever tells most.
    """
    (separates, truth, imitator), case, best = contest, attribution.case, ([], NOTHING.poses)
    start, end = poses.passes(case.measurements, case.mechanism)
    if not len(start):
        return best
    told_speed, own_load = (float(case.measurements[name].median()) for name in ("speed_mm_s", "payload_kg"))
    own_speed = told_speed if np.isfinite(told_speed) else _speed(case.measurements)
    last_s, own_load, most = _end_s(case.measurements), float(np.nan_to_num(own_load)), 0.0
    for fast, loaded in product((False, True), repeat=2):
        if fast and not (told_speed < OPTIONS.fast_pass_mm_s and np.isfinite(last_s)):
            continue
        speed, load, how = _driven(own_speed, own_load, fast, loaded)
        table = poses.commands(start, end, case.mechanism, last_s + OPTIONS.pause_between_runs_s, speed, load)
        planned = _planned(case, table, masses)
        if not _tell(planned, contest):
            continue
        now, added = worth(attribution, truth, imitator, planned)
        chosen, gain = greedy(now, added, OPTIONS.max_advised_poses)
        # one that tells hardly more is not worth a payload
        if gain > OPTIONS.min_gain_ratio_of_harder_poses * most:
            count, most = len(chosen), gain
            words = " ".join([f"{count} poses", *how]), "poses", "poses", False
            row = *words, speed, load, count * OPTIONS.points_per_pass, separates, now.nats(), gain
            ends = {**rows.vector_columns("from", start[chosen]), **rows.vector_columns("to", end[chosen])}
            listed = pd.DataFrame({"pose": np.arange(1, count + 1), **ends, "speed_mm_s": speed, "payload_kg": load})
            best = [dict(zip(_COLUMNS, row, strict=True))], listed
    return best


def _driven(own_speed, own_load, fast, loaded):
    """Speed and payload of a kind of pass, and in words what is not the campaign's own."""
    speed = OPTIONS.fast_pass_mm_s if fast else own_speed
    load = own_load + (OPTIONS.added_payload_kg if loaded else 0.0)
    return speed, load, [f"at {speed:g} mm/s"] * fast + [f"with {load:g} kg payload"] * loaded


def _end_s(frame):
    """Time at which a measurement table ends, NaN where it has none."""
    return np.nanmax(frame["time_s"].to_numpy(dtype=float)) if frame["time_s"].notna().any() else np.nan


def _speed(frame):
    """Speed in mm/s between the points of a measurement table, by its times; NaN where it has none."""
    way = np.linalg.norm(np.diff(rows.command(frame), axis=0), axis=1)
    time = np.diff(frame["time_s"].to_numpy(dtype=float))
    moved = (np.diff(frame["run"].to_numpy()) == 0) & (way > 0.0) & (time > 0.0)
    return float(np.median(way[moved] / time[moved])) if moved.any() else np.nan


def candidates(frame):
    """Candidate runs as mappings of the columns RUN of `gap_next_runs`, and their commands, numbered from 1.

    Every kind of pass along some of a measurement table's trajectories.
    """
    count = frame.groupby(["trajectory", "run"], sort=False).size().groupby("trajectory", sort=False).max()
    # passes of poses that were driven before are no trajectories
    names = count.index[(count > OPTIONS.points_per_pass) | (count.max() <= OPTIONS.points_per_pass)]
    chosen = names[np.unique(np.linspace(0, len(names) - 1, OPTIONS.max_advised_trajectories).astype(int))]
    end, result, tables = _end_s(frame), [], []
    for name in chosen:
        first = frame[frame["trajectory"] == name]
        first = first[first["run"] == first["run"].iloc[0]]
        own_speed, own_load = float(first["speed_mm_s"].iloc[0]), float(np.nan_to_num(first["payload_kg"].iloc[0]))
        for reverse, fast, loaded in _KINDS:
            if fast and not (own_speed < OPTIONS.fast_pass_mm_s and np.isfinite(end)):
                continue
            speed, load, how = _driven(own_speed, own_load, fast, loaded)
            how = ["in reverse"] * reverse + how
            tables.append(_pass(first, len(tables) + 1, end + OPTIONS.pause_between_runs_s, reverse, speed, load))
            words = f"{name} {' '.join(how) or 'once more'}"
            result.append(dict(zip(RUN, (words, "run", str(name), reverse, speed, load, len(first)), strict=True)))
    return result, pd.concat(tables, ignore_index=True) if tables else frame.iloc[:0]


def _pass(first, number, start_s, reverse, speed_mm_s, payload_kg):
    """Table of one more pass along the points of a run."""
    run = (first.iloc[::-1] if reverse else first).reset_index(drop=True)
    clock = first["time_s"].to_numpy(dtype=float)
    time = clock[-1] - clock[::-1] if reverse else clock - clock[0]
    own_speed = float(first["speed_mm_s"].iloc[0])
    if np.isfinite(own_speed) and speed_mm_s != own_speed:
        # the same profile, driven faster: the average speed over the run rises in proportion
        time = time * own_speed / speed_mm_s
    measured = rows.vector_columns("measured", rows.command(run))
    told = {"run": number, "time_s": start_s + time, "speed_mm_s": speed_mm_s, "payload_kg": payload_kg}
    return run.assign(**told, status="ok", **measured)
