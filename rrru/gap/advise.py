"""Which further run would tell two answers apart: computed by what each candidate adds, not by rule of thumb.

If hypothesis A holds with its fitted numbers, the data that it makes differ from the best that hypothesis B can do by

    I = 1/2 min_b |(y_A - X_B b) / sigma|^2 + prior of b

nats, the log Bayes factor to expect. A candidate run adds its points to both sums; what I grows by is its worth.
"""

import numpy as np
import pandas as pd

from rrru.campaign import measurements as rows
from rrru.gap.make_case import make_case
from rrru.gap.terms import signatures, spread
from rrru.gap.verdict import label

_FAST_MM_S, _LOAD_KG, _REST_S, _MOST_TRAJECTORIES, _MOST_RIVALS = 300.0, 5.0, 60.0, 4, 2
# less than this is not worth a run
_WORTH_NATS = 1.0
_COLUMNS = ("run", "trajectory", "reverse", "speed_mm_s", "payload_kg", "points", "separates", "now_nats", "gain_nats")
# kinds of further passes: in reverse, fast, loaded
_KINDS = ((False, False, False), (True, False, False), (False, True, False), (False, False, True), (True, True, True))


def advise(attribution, verdict, masses, most=3):
    """Rows of `gap_next_runs` without campaign and rank, best first.

    None where no rival answer is left that the library can predict.
    """
    nothing, effects = pd.DataFrame(columns=_COLUMNS), frozenset(verdict.effects)
    favoured = attribution.posterior.best_of(effects)
    rivals = [frozenset(names) for names, flag, _ in verdict.rivals if not flag and frozenset(names) != effects]
    if favoured is None or verdict.unexplained or not rivals:
        return nothing
    candidates, table = _candidates(attribution.case.measurements)
    if not candidates:
        return nothing
    case, result = attribution.case, []
    planned = make_case(table, case.mechanism, masses, case.noise_mm, case.effects, arm_mm=case.arm_mm)
    others = ((names, attribution.posterior.best_of(names)) for names in rivals[:_MOST_RIVALS])
    for names, other in others:
        if other is None:
            # it is one only beside something small that is unknown
            continue
        # the answer with more effects makes the data: the smaller one could not make the larger one's
        truth, imitator = (favoured, other) if len(favoured[0].terms) >= len(other[0].terms) else (other, favoured)
        now, gains = _worth(attribution, truth, imitator, planned)
        separates = " / ".join(label(sorted(answer), False) for answer in (effects, names))
        result.extend(
            candidate | {"separates": separates, "now_nats": now, "gain_nats": gain}
            for candidate, gain in zip(candidates, gains, strict=True)
        )
    result = pd.DataFrame(result, columns=_COLUMNS)
    result = result[result["gain_nats"] > _WORTH_NATS]
    result = result.sort_values(["gain_nats", "run"], ascending=[False, True], kind="stable")
    return result.drop_duplicates("run").head(most).reset_index(drop=True)


def _worth(attribution, truth, imitator, planned):
    """Nats between two (hypothesis, level) now, and what each run of the planned case adds."""
    (hypothesis, level), (rival, rival_level) = truth, imitator
    case, evidence = attribution.case, attribution.evidence
    terms = hypothesis.terms + rival.terms
    there = planned.linearise(attribution.calibrated, list(dict.fromkeys((t.effect, t.shape) for t in terms)))
    mean, _ = evidence.coefficients(hypothesis.terms, hypothesis.strengths[level], level)
    size = sum(spread(case.library[t.effect].coordinates, t.legs).shape[1] for t in hypothesis.terms)
    made, designs = [], []
    for linear in (evidence.linear, there):
        nothing = np.zeros((*linear.data.shape, 0))
        made.append(
            np.concatenate([nothing, *signatures(case.library, linear, hypothesis.terms)], axis=-1) @ mean[:size]
        )
        designs.append(np.concatenate([linear.base, *signatures(case.library, linear, rival.terms)], axis=-1))
    penalty = np.zeros(designs[0].shape[-1])
    penalty[there.base.shape[-1] :] = evidence.scales(rival.terms, rival.strengths[rival_level]) ** -2.0
    now = _misfit(designs[0], made[0], penalty, case.noise_mm)
    gains = []
    for number in np.unique(planned.measurements["run"]):
        chosen = planned.run == number
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


def _candidates(frame):
    """Candidate runs as rows of `gap_next_runs`, and their table of commands, numbered from 1.

    Every kind of pass along some of a measurement table's trajectories.
    """
    names = pd.unique(frame["trajectory"])
    chosen = names[np.unique(np.linspace(0, len(names) - 1, _MOST_TRAJECTORIES).astype(int))]
    end = np.nanmax(frame["time_s"].to_numpy(dtype=float)) if frame["time_s"].notna().any() else np.nan
    result, tables = [], []
    for name in chosen:
        first = frame[frame["trajectory"] == name]
        first = first[first["run"] == first["run"].iloc[0]]
        own_speed, own_load = float(first["speed_mm_s"].iloc[0]), float(np.nan_to_num(first["payload_kg"].iloc[0]))
        for reverse, fast, loaded in _KINDS:
            if fast and not (own_speed < _FAST_MM_S and np.isfinite(end)):
                continue
            speed, load = _FAST_MM_S if fast else own_speed, own_load + (_LOAD_KG if loaded else 0.0)
            how = ["in reverse"] * reverse + [f"at {speed:g} mm/s"] * fast + [f"with {load:g} kg payload"] * loaded
            tables.append(_pass(first, len(tables) + 1, end + _REST_S, reverse, speed, load))
            words = f"{name} {' '.join(how) or 'once more'}", str(name), reverse, speed, load, len(first)
            result.append(dict(zip(_COLUMNS, words, strict=False)))
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
