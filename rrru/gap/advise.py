"""Which further run would tell two answers apart: computed by what each candidate adds, not by rule of thumb.

If hypothesis A holds with its fitted numbers, the data that it makes differ from the best that hypothesis B can do by

    I = 1/2 min_b |(y_A - X_B b) / sigma|^2 + prior of b

nats, the log Bayes factor to expect. A candidate run adds its points to both sums; what I grows by is its worth.
"""

import numpy as np
import pandas as pd

from rrru.campaign import measurements as rows
from rrru.gap.case import make_case
from rrru.gap.terms import spread

_FAST_MM_S, _LOAD_KG, _MOST_TRAJECTORIES, _MOST_RIVALS = 300.0, 5.0, 4, 2
# less than this is not worth a run
_WORTH_NATS = 1.0
_COLUMNS = ("run", "trajectory", "reverse", "speed_mm_s", "payload_kg", "points", "separates", "now_nats", "gain_nats")


def advise(attribution, verdict, masses, most=3):
    """Rows of `gap_next_runs` without campaign and rank, best first; none where no rival answer is left that the
    library can predict.
    """
    beliefs = attribution.posterior
    favoured = beliefs.best_of(frozenset(verdict.effects))
    rivals = [
        frozenset(names)
        for names, flag, _ in verdict.rivals
        if not flag and frozenset(names) != frozenset(verdict.effects)
    ]
    if favoured is None or verdict.unexplained or not rivals:
        return pd.DataFrame(columns=_COLUMNS)
    candidates, table = _candidates(attribution.case)
    if not candidates:
        return pd.DataFrame(columns=_COLUMNS)
    found = []
    for names in rivals[:_MOST_RIVALS]:
        other = beliefs.best_of(names)
        # the answer with more effects makes the data: the smaller one could not make the larger one's
        truth, imitator = (favoured, other) if len(favoured[0].terms) >= len(other[0].terms) else (other, favoured)
        now, gains = _worth(attribution, truth, imitator, candidates, table, masses)
        separates = f"{'+'.join(sorted(verdict.effects)) or 'none'} / {'+'.join(sorted(names)) or 'none'}"
        found.extend(
            candidate | {"separates": separates, "now_nats": now, "gain_nats": gain}
            for candidate, gain in zip(candidates, gains, strict=True)
        )
    result = pd.DataFrame(found).drop(columns="rows")
    result = result[result["gain_nats"] > _WORTH_NATS].sort_values(
        ["gain_nats", "run"], ascending=[False, True], kind="stable"
    )
    return result.drop_duplicates("run").head(most).reset_index(drop=True)[list(_COLUMNS)]


def _worth(attribution, truth, imitator, candidates, table, masses):
    """Nats between two (hypothesis, level) now and what each candidate adds."""
    case, evidence = attribution.case, attribution.evidence
    keys = list(dict.fromkeys((t.effect, t.shape) for h, _ in (truth, imitator) for t in h.terms))
    planned = make_case(table, case.mechanism, masses, case.noise_mm, case.effects)
    there = planned.linearise(attribution.calibrated, keys)
    here = evidence.linear
    hypothesis, level = truth
    mean, _ = evidence.posterior(hypothesis.terms, hypothesis.strengths[level], level)
    size = sum(spread(case.library[t.effect].coordinates, t.legs).shape[1] for t in hypothesis.terms)
    made = [_columns(case.library, linear, hypothesis.terms) @ mean[:size] for linear in (here, there)]
    rival, rival_level = imitator
    designs = [
        np.concatenate([linear.base, _columns(case.library, linear, rival.terms)], axis=-1) for linear in (here, there)
    ]
    penalty = np.zeros(designs[0].shape[-1])
    penalty[here.base.shape[-1] :] = evidence.scales(rival.terms, rival.strengths[rival_level]) ** -2.0
    now = _misfit(designs[0], made[0], penalty, case.noise_mm)
    gains = []
    for candidate in candidates:
        chosen = candidate["rows"][planned.used]
        design = np.concatenate([designs[0], designs[1][chosen]])
        gains.append(_misfit(design, np.concatenate([made[0], made[1][chosen]]), penalty, case.noise_mm) - now)
    return now, gains


def _misfit(design, data, penalty, noise_mm):
    """Half the penalised least squares of data (n, 3) by a design (n, 3, k), in nats."""
    flat, target = design.reshape(-1, design.shape[-1]) / noise_mm, data.ravel() / noise_mm
    precision = flat.T @ flat + np.diag(penalty)
    unit = 1.0 / np.sqrt(np.maximum(np.diag(precision), 1e-300))
    scaled = unit[:, None] * precision * unit + 1e-12 * np.eye(len(unit))
    moment = unit * (flat.T @ target)
    return float(0.5 * (target @ target - moment @ np.linalg.solve(scaled, moment)))


def _columns(library, linear, terms):
    """Columns (n, 3, k) of the terms' free numbers."""
    own = [linear.columns[t.effect, t.shape] @ spread(library[t.effect].coordinates, t.legs) for t in terms]
    return np.concatenate(own, axis=-1) if own else np.zeros((*linear.base.shape[:2], 0))


def _candidates(case):
    """Candidate runs, each a mapping with its rows of a table of commands, and that table: every kind of pass along
    some trajectories.
    """
    frame = case.measurements
    names = pd.unique(frame["trajectory"])
    chosen = names[np.unique(np.linspace(0, len(names) - 1, _MOST_TRAJECTORIES).astype(int))]
    end = np.nanmax(frame["time_s"].to_numpy(dtype=float)) if frame["time_s"].notna().any() else np.nan
    found, frames = [], []
    for name in chosen:
        first = frame[frame["trajectory"] == name]
        first = first[first["run"] == first["run"].iloc[0]]
        speed, load = float(first["speed_mm_s"].iloc[0]), float(np.nan_to_num(first["payload_kg"].iloc[0]))
        for reverse, fast, loaded in (
            (False, False, False),
            (True, False, False),
            (False, True, False),
            (False, False, True),
            (True, True, True),
        ):
            if fast and not (np.isfinite(speed) and speed < _FAST_MM_S and np.isfinite(end)):
                continue
            run = _pass(
                first, len(found) + 1, end, reverse, _FAST_MM_S if fast else speed, load + (_LOAD_KG if loaded else 0.0)
            )
            words = [str(name), *(["in reverse"] if reverse else []), *([f"at {_FAST_MM_S:g} mm/s"] if fast else [])]
            if loaded:
                words.append(f"with {load + _LOAD_KG:g} kg payload")
            found.append(
                {
                    "run": " ".join(words) if len(words) > 1 else f"{name} once more",
                    "trajectory": str(name),
                    "reverse": reverse,
                    "speed_mm_s": _FAST_MM_S if fast else speed,
                    "payload_kg": load + (_LOAD_KG if loaded else 0.0),
                    "points": len(run),
                    "number": len(found) + 1,
                }
            )
            frames.append(run)
    table = pd.concat(frames, ignore_index=True) if frames else frame.iloc[:0]
    for candidate in found:
        candidate["rows"] = (table["run"] == candidate.pop("number")).to_numpy()
    return found, table


def _pass(first, number, end_s, reverse, speed_mm_s, payload_kg):
    """Table of one more pass along the points of a run, a minute after the campaign's end."""
    run = (first.iloc[::-1] if reverse else first).reset_index(drop=True)
    length = float(np.linalg.norm(np.diff(rows.command(run), axis=0), axis=1).sum())
    clock = first["time_s"].to_numpy(dtype=float)
    time = clock - clock[0] if not reverse else clock[-1] - clock[::-1]
    own_speed = float(first["speed_mm_s"].iloc[0])
    if np.isfinite(own_speed) and speed_mm_s != own_speed:
        # the same profile, driven faster: the average speed over the run rises in proportion
        time = time * own_speed / speed_mm_s if length > 0.0 else time
    measured = {f"measured_{axis}_mm": run[f"command_{axis}_mm"] for axis in "xyz"}
    return run.assign(
        run=number, time_s=end_s + 60.0 + time, speed_mm_s=speed_mm_s, payload_kg=payload_kg, status="ok", **measured
    )
