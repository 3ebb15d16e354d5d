"""Coverage of 95 % intervals, and predicted over observed errors of predictions: `make bench GROUPS=coverage`.

Every draw of a cell (robot, scene) has new true parameters and new noise, and goes through the whole diagnosis. Of all
numbers that the diagnosis states in `gap_parameters` the error (estimate minus truth) is compared with the stated
standard error s, and the truth with the stated interval of 95 %:

    coverage   share of the intervals that hold the truth; along directions of estimate +- 1.96 s
    ratio      rms of error / s, 1 where s is right, 2 where s is half of what it should be

Parameters of one draw are correlated. Where the covariance C is known, coverage and ratio are also taken along the
independent directions u = L^-1 error, L L' = C, of the combinations that the poses identify: of them the binomial
standard error of the coverage holds. Of parameters it is taken over draws.

The noise of a few draws may happen to be kind: where nothing acts the directions have a row "oracle" for the linear
generalised least squares of the same readings under the true covariance, whose ratio is 1 except for that, and a row
"same draws" for the diagnosis.

    python -m benchmarks.coverage --draws 200 --robot arm7 --scene ar1 --scene white
"""

import os

# matrices are small: more threads than one only wait for each other
os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import time
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
import pandas as pd

from benchmarks.harness import RESULTS
from benchmarks.virtual_campaigns import ROBOTS, SCENES, draw_truth, exact_readings, measure, virtual_campaign
from rrru.campaign.measurements import series
from rrru.diagnosis.diagnose import MeasuredRobot, diagnose, with_wide_bounds
from rrru.diagnosis.make_problem import make_diagnosis_problem
from rrru.diagnosis.problem import GEOMETRY
from rrru.diagnosis.settings import GapSettings
from rrru.errors import FitError
from rrru.estimation.intervals import QUANTILE_95
from rrru.seeds import stream

FOLDER = RESULTS / "benchmarks" / "coverage"
_SEED, _RESAMPLES = 7, 20
_TABLES = ("parameters", "directions", "summaries")
# kinds of parameters by the name that `gap_parameters` has in its column effect; all others are effects
_KINDS = {"calibration": "geometry", "weight": "nuisance"}


# --- what a diagnosis states: the one place that knows how the package names it


@dataclass(frozen=True)
class Statement:
    """What a diagnosis states.

    table: `gap_parameters`; covariance (p, p): of the geometric parameters; effects: in the verdict; held_out_mm:
    predicted rms distance of held-out readings, noise included; gap_after_mm: without noise; legs: of each term of the
    hypothesis; predict: residuals of the corrected model from another table of readings.
    """

    table: pd.DataFrame
    covariance: np.ndarray
    effects: frozenset
    verdict: dict
    held_out_mm: float
    gap_after_mm: float
    legs: str
    used: np.ndarray
    predict: object


def state_of(campaign, frame, noise_mm, draws=_RESAMPLES):
    """The Statement of a diagnosis of a table of readings. Raises FitError where there is no diagnosis."""
    known = MeasuredRobot(campaign.mechanism, campaign.masses, noise_mm)
    settings = GapSettings(effects=campaign.library.offered, draws=draws)
    found = diagnose(frame, known, settings, details=False)
    inference, estimate = found.inference, found.inference.fit.estimate
    terms, geometry = inference.hypothesis.terms, estimate.parameters.slices[GEOMETRY]
    strengths = inference.hypothesis.strengths_of(terms, inference.level)
    prediction = inference.held_out.predict(terms, strengths, inference.level)
    expected = np.sum(prediction.left_mm2, axis=1) + prediction.uncertainty_mm2
    names = found.verdict["effects"].split("+")
    return Statement(
        found.tables["gap_parameters"],
        found.inference.fit.stated.covariance[geometry, geometry],
        frozenset(names) - {"none", "unexplained"},
        found.verdict,
        float(np.sqrt(expected.mean())),
        found.verdict["gap_after_rms_mm"],
        ",".join(str(term.legs) for term in terms),
        inference.problem.used,
        lambda frame: _residual(campaign, frame, inference),
    )


def _residual(campaign, frame, inference):
    """Residuals (n, 3) of the corrected model on another table of readings, NaN where a diagnosis rejects them."""
    problem = make_diagnosis_problem(frame, with_wide_bounds(campaign.mechanism), campaign.masses, 1.0, {})
    problem = replace(problem, library=inference.problem.library).standing(inference.state)
    return np.where(problem.used[:, None], problem.left(inference.state), np.nan)


# --- one draw


def one_draw(robot, scene, number):
    """The results of one draw: rows of its parameters, of its independent directions, and its summary.

    The effect of the library acts in every second draw; with payload and tilt unknown, in all.
    """
    campaign = virtual_campaign(robot, scene)
    generators = [stream(_SEED, robot, scene, what, number) for what in ("truth", "noise", "fresh")]
    acts = bool(number % 2) or campaign.scene.payload
    truth = draw_truth(campaign, generators[0], acts)
    frame = measure(campaign, truth, generators[1])
    began = time.process_time()
    summary = {"draw": number, "acts": acts, "failed": "", "effects": ""}
    try:
        stated = state_of(campaign, frame, campaign.scene.noise.mean_mm)
    except (FitError, np.linalg.LinAlgError) as problem:
        return [], [], summary | {"failed": str(problem)[:200], "seconds": time.process_time() - began}
    seconds = time.process_time() - began
    parameters = _parameter_rows(stated, campaign, truth)
    directions = [{"z": z} for z in _directions(stated, campaign, truth)]
    if not truth.effects + truth.discrepancy:
        for row, z in zip(directions, oracle(campaign, frame, truth, stated.used), strict=True):
            row["oracle"] = z
    exact, noisy = (exact_readings(campaign, truth, fresh=True), measure(campaign, truth, generators[2], fresh=True))
    left = stated.predict(noisy)
    errors = noisy[[f"measured_{axis}_mm" for axis in "xyz"]].to_numpy() - exact
    acting = {active.effect.name for active in truth.effects}
    summary |= {
        "effects": stated.verdict["effects"],
        "right": stated.effects == acting,
        "noise_mm": stated.verdict["noise_rms_mm"] / np.sqrt(3.0),
        "noise_runs_mm": stated.verdict["noise_runs_mm"],
        "noise_correlation": stated.verdict["noise_correlation"],
        "points": stated.verdict["points"],
        "held_out_mm": stated.held_out_mm,
        "fresh_mm": _rms(left),
        "gap_after_mm": stated.gap_after_mm,
        "fresh_gap_mm": _rms(left - errors),
        "legs": stated.legs,
        "share_closed": stated.verdict["share_closed"],
        "unstated": ",".join(sorted(stated.effects - set(stated.table["effect"]))),
        "seconds": seconds,
    }
    return parameters, directions, summary


def _rms(vectors):
    """Root mean square length of vectors (n, 3), without NaN."""
    return float(np.sqrt(np.nanmean((vectors**2).sum(axis=1))))


def _parameter_rows(stated, campaign, truth):
    """Rows of all stated parameters: kind, name, truth, value and standard error."""
    geometry = dict(zip(campaign.mechanism.parameters.names, truth.deviations, strict=True))
    inside = np.linalg.norm(campaign.identifiable, axis=1) > 1.0 - 1e-3
    identified = dict(zip(geometry, inside, strict=True))
    effects = {active.effect.name: active.values for active in truth.effects}
    unseen = {
        (active.effect.name, parameter.name)
        for active in truth.effects
        for parameter in active.effect.parameters
        if parameter.leg in campaign.still
    }
    result = []
    for row in stated.table.itertuples():
        kind = _KINDS.get(row.effect, "effect")
        if kind == "geometry":
            true = geometry[row.parameter] if identified[row.parameter] else None
        elif kind == "nuisance":
            true = truth.payload.get(row.parameter, 0.0)
        else:
            # an effect that does not act has sizes of zero and no true shape
            true = effects[row.effect].get(row.parameter) if row.effect in effects else 0.0
            true = None if (row.effect, row.parameter) in unseen else true
        if true is None or (kind == "effect" and np.isnan(row.low_95)):
            continue
        error = row.value - true
        if row.parameter.startswith("phase"):
            error = (error + np.pi) % (2.0 * np.pi) - np.pi
        below, above = row.low_95 - row.value, row.high_95 - row.value
        named = {"kind": kind, "name": row.parameter if kind == "geometry" else f"{row.effect} {row.parameter}"}
        result.append(
            named
            | {"truth": true, "error": error, "standard_error": row.standard_error}
            | {"held": below - 1e-12 <= -error <= above + 1e-12}
        )
    return result


def _directions(stated, campaign, truth):
    """Errors over standard errors (r,) along the independent directions of the identifiable combinations."""
    names = list(campaign.mechanism.parameters.names)
    table = stated.table[stated.table["effect"] == "calibration"].set_index("parameter")
    error = (table.loc[names, "value"].to_numpy() - truth.deviations) / campaign.scale
    onto = campaign.identifiable
    covariance = onto.T @ (stated.covariance / np.outer(campaign.scale, campaign.scale)) @ onto
    size = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    value, turned = np.linalg.eigh(covariance / np.outer(size, size))
    value = np.where(value > 1e-12 * value[-1], value, np.nan)
    return list(turned.T @ (onto.T @ error / size) / np.sqrt(value))


def oracle(campaign, frame, truth, used):
    """Errors over standard errors (r,) of linear generalised least squares with the true covariance; used (n,)."""
    error = frame[[f"measured_{axis}_mm" for axis in "xyz"]].to_numpy() - exact_readings(campaign, truth)
    rows_of_run = pd.Series(np.arange(len(frame))).groupby(series(frame)).indices
    columns = campaign.jacobian * campaign.scale @ campaign.identifiable
    white, data = [], []
    for place in rows_of_run.values():
        chosen = used[place]
        for axis, covariance in enumerate(campaign.scene.noise.covariances(len(place))):
            factor = np.linalg.cholesky(covariance[np.ix_(chosen, chosen)])
            white.append(np.linalg.solve(factor, columns[place[chosen], axis]))
            data.append(np.linalg.solve(factor, error[place[chosen], axis]))
    basis, _ = np.linalg.qr(np.concatenate(white))
    return basis.T @ np.concatenate(data)


# --- cells


def cell(robot, scene, draws):
    """Tables of parameters, directions and summaries of a number of draws of a cell."""
    parameters, directions, summaries = [], [], []
    for number in range(draws):
        stated, independent, summary = one_draw(robot, scene, number)
        parameters += [row | {"draw": number} for row in stated]
        directions += [row | {"draw": number, "direction": k} for k, row in enumerate(independent)]
        summaries.append(summary)
    tables = [pd.DataFrame(part) for part in (parameters, directions, summaries)]
    return [table.assign(robot=robot, scene=scene) for table in tables]


def coverage(z, draw, held=None):
    """Coverage, its standard error over draws, and rms ratio, of errors over standard errors (n,) in draws (n,).

    held (n,): whether the stated interval holds the truth, None for intervals of 1.96 standard errors.
    """
    held = np.abs(z) < QUANTILE_95 if held is None else np.asarray(held, dtype=bool)
    covered = pd.Series(held).groupby(np.asarray(draw))
    rate, count = float(held.mean()), covered.ngroups
    rates = covered.mean()
    error = float(rates.std(ddof=1) / np.sqrt(count)) if count > 1 else np.nan
    return rate, error, float(np.sqrt(np.nanmean(np.square(z))))


def summarize(parameters, directions, summaries):
    """One row per kind of parameter of a cell; directions: of the geometric parameters, independent."""
    good = summaries[summaries["failed"] == ""]
    head = {"robot": summaries["robot"].iloc[0], "scene": summaries["scene"].iloc[0]}
    head |= {"draws": len(summaries), "failed": len(summaries) - len(good)}
    head |= {"right": float(good["right"].astype(float).mean()) if len(good) else np.nan}
    result = []
    for kind, some, z in _errors_by_kind(parameters, directions):
        rate, error, ratio = coverage(z, some["draw"], some.get("held"))
        binomial = np.sqrt(0.95 * 0.05 / len(z))
        row = head | {"kind": kind, "intervals": len(z), "coverage": rate, "coverage_se": max(error, binomial)}
        row |= {"ratio": ratio, "ratio_68": float(np.nanquantile(np.abs(z), 0.6827))}
        row |= {"nan": int(np.isnan(z).sum())} | _worst(some, z)
        result.append(row)
    return pd.DataFrame(result)


def _errors_by_kind(parameters, directions):
    """Kind, rows and errors over standard errors (n,) in the tables of one cell."""
    if len(directions):
        yield "directions", directions, directions["z"].to_numpy(dtype=float)
    if "oracle" in directions and directions["oracle"].notna().any():
        known = directions[directions["oracle"].notna()]
        yield "same draws", known, known["z"].to_numpy(dtype=float)
        yield "oracle", known, known["oracle"].to_numpy(dtype=float)
    for kind in ("geometry", "effect", "nuisance"):
        some = parameters[parameters["kind"] == kind] if len(parameters) else parameters
        if len(some):
            yield kind, some, (some["error"] / some["standard_error"]).to_numpy(dtype=float)


def _worst(some, z):
    """The parameter of the largest and of the smallest rms of z (n,)."""
    if "name" not in some:
        return {"worst": "", "worst_ratio": np.nan, "least": "", "least_ratio": np.nan}
    sizes = pd.Series(z**2).groupby(some["name"].to_numpy()).mean() ** 0.5
    ends = sizes.idxmax(), sizes.idxmin()
    return {"worst": ends[0], "worst_ratio": sizes.max(), "least": ends[1], "least_ratio": sizes.min()}


def predictions(summaries):
    """Predicted over observed rms of a cell, one row: of held-out readings with noise and of the gap without it.

    Root mean squares over the draws, and the medians of the draws' own ratios. No row where every draw has failed.
    """
    good = summaries[summaries["failed"] == ""]
    if good.empty:
        return pd.DataFrame()
    row = {"robot": summaries["robot"].iloc[0], "scene": summaries["scene"].iloc[0], "draws": len(good)}
    for name, predicted, observed in (("held_out", "held_out_mm", "fresh_mm"), ("gap", "gap_after_mm", "fresh_gap_mm")):
        row[f"{name}_ratio"] = float(np.sqrt((good[predicted] ** 2).mean() / (good[observed] ** 2).mean()))
        row[f"{name}_median"] = float((good[predicted] / good[observed]).median())
    medians = good[["noise_mm", "noise_runs_mm", "seconds"]].median()
    return pd.DataFrame([row | medians.to_dict()])


def main(arguments=None):
    """Run cells, three files each, and print their results."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--draws", type=int, default=200)
    parser.add_argument("--robot", action="append", choices=ROBOTS)
    parser.add_argument("--scene", action="append", choices=SCENES)
    asked = parser.parse_args(arguments)
    FOLDER.mkdir(parents=True, exist_ok=True)
    for scene, robot in product(asked.scene or SCENES, asked.robot or ROBOTS):
        tables = cell(robot, scene, asked.draws)
        for name, table in zip(_TABLES, tables, strict=True):
            table.to_csv(FOLDER / f"{robot}-{scene}-{name}.csv", index=False)
        options = {"display.width": 250, "display.max_columns": 40, "display.float_format": "{:.3g}".format}
        with pd.option_context(*(part for option in options.items() for part in option)):
            for table in (summarize(*tables), predictions(tables[-1])):
                print(table.to_string(index=False), flush=True)


if __name__ == "__main__":
    main()
