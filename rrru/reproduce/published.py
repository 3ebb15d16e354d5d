"""Paper A's numbers beside this study's."""

import numpy as np
import pandas as pd

from rrru.reproduce import paper_a
from rrru.reproduce.study_numbers import group_orders, study_numbers

_AXES = [f"error_{axis}_mm" for axis in "xyz"]


def published_table(config, errors, parameters, genetic, sweep_runs, method="least_mean_distance"):
    """Rows of `published` from tables of the study.

    config: the whole configuration; errors, parameters, genetic, sweep_runs: the tables of those names; method: whose errors and
    parameters stand beside the paper's. Numbers that this study does not have are null.
    """
    here = (
        _design(config)
        | _sweep(sweep_runs)
        | _fitted(parameters, genetic, config, method)
        | _errors(errors, config, method)
        | {"tolerance_mm": 2.0}
    )
    notes = _notes(genetic, config)
    rows = []
    for number in paper_a.NUMBERS:
        value = here.get(number.item, np.nan)
        rows.append(
            {
                "item": number.item,
                "source": number.source,
                "unit": number.unit,
                "published": number.value,
                "here": value,
                "ratio": value / number.value if number.value else np.nan,
                "note": "; ".join(text for text in (number.note, notes.get(number.item, "")) if text),
            }
        )
    return pd.concat([pd.DataFrame(rows), _orders(errors, config, method)], ignore_index=True)


def closed_loop_errors(errors, campaign, calibration, method):
    """Trajectory names (n,) and error vectors (n, 3) of one calibration driven again, or measured before any (calibration "none")."""
    mode = "before" if calibration == "none" else "closed_loop"
    chosen = errors[
        (errors["campaign"] == campaign)
        & (errors["calibration"] == calibration)
        & (errors["method"] == ("none" if calibration == "none" else method))
        & (errors["mode"] == mode)
    ].sort_values(["run", "point"])
    return chosen["trajectory"].to_numpy(), chosen[_AXES].to_numpy()


def _design(config):
    """Dimensions, motion and counts as configured."""
    robot, motion = config["robots"]["rrru3"], config["motion"]
    shape = config["trajectories"][config["campaigns"][config["sweep"]["campaign"]]["trajectories"]]
    lines, spiral, genetic = shape["lines"], shape["spiral"], config["genetic"]
    return {
        **{key: robot[key] for key in ("L1_mm", "L2_mm", "L3_mm", "R_mm", "r_mm")},
        **{key: motion[key] for key in ("speed_mm_s", "acceleration_mm_s2")},
        **{f"line_{end}_{axis}_mm": lines[f"{end}_mm"][k] for end in ("start", "end") for k, axis in enumerate("xyz")},
        "points_per_line": lines["points"],
        "line_groups": len(lines["offsets_y_mm"]),
        "points_on_spiral": spiral["points"],
        "population": sum(genetic["populations"]),
        "crossover_fraction": genetic["crossover_fraction"],
        "migration_fraction": genetic["migration_fraction"],
        "errors": 14,
    }


def _sweep(runs):
    """Median objective of the one population at every swept value."""
    label = {"crossover_fraction": "P_c", "migration_fraction": "P_m"}
    medians = runs[runs["population"] == "one"].groupby(["parameter", "value"])["objective_mm"].median()
    return {f"{label[parameter]}={value:.1f}": median for (parameter, value), median in medians.items()}


def _fitted(parameters, genetic, config, method):
    """The printed 14 errors of both calibrations; dR and dr alone from the genetic algorithm's median, since only dr - dR is a result."""
    campaign, result = config["sweep"]["campaign"], {}
    for label in ("lines", "spiral"):
        chosen = parameters[(parameters["campaign"] == campaign) & (parameters["calibration"] == label) & (parameters["method"] == method)]
        values = dict(zip(chosen["parameter"], chosen["value"], strict=True))
        runs = genetic[(genetic["campaign"] == campaign) & (genetic["calibration"] == label)]
        for name in paper_a.TABLE_5:
            value = float(runs[name].median()) if name in ("dR", "dr") and len(runs) else values.get(name, np.nan)
            for printed in paper_a.TIED_TO_PRINTED.get(name, (name,)):
                result[f"{label}_{printed}"] = value
        result[f"{label}_da"] = values.get("da", np.nan)
    return result


def _errors(errors, config, method):
    """The error numbers of the paper's section 3."""
    campaign = config["sweep"]["campaign"]
    trajectory, before = closed_loop_errors(errors, campaign, "none", method)
    _, lines = closed_loop_errors(errors, campaign, "lines", method)
    _, spiral = closed_loop_errors(errors, campaign, "spiral", method)
    if not (len(before) == len(lines) == len(spiral)) or not len(before):
        return {}
    model = errors[
        (errors["campaign"] == campaign)
        & (errors["calibration"] == "lines")
        & (errors["method"] == method)
        & (errors["mode"] == "model")
        & errors["trajectory"].str.startswith("line_")
    ]
    return study_numbers(trajectory, before, lines, spiral) | {"lines_objective": model["error_mm"].mean()}


def _orders(errors, config, method):
    """The paper's orders as rows: published 1 (holds), here 1 or 0."""
    trajectory, before = closed_loop_errors(errors, config["sweep"]["campaign"], "none", method)
    _, lines = closed_loop_errors(errors, config["sweep"]["campaign"], "lines", method)
    if not len(before) or len(before) != len(lines):
        return pd.DataFrame(columns=["item", "source", "unit", "published", "here", "ratio", "note"])
    text = {
        "centre_before": "mean error of each of groups 1-3 below each of groups 4-7, before calibration",
        "centre_after": "mean error of each of groups 1-3 below each of groups 4-7, after the line calibration",
        "group6_before": "largest error in group 6, before calibration",
        "group6_after": "largest error in group 6, after the line calibration",
    }
    rows = [
        {
            "item": f"order_{name}",
            "source": "section 3.2, Fig. 10",
            "unit": "1",
            "published": 1.0,
            "here": float(margin > 0.0),
            "ratio": float(margin > 0.0),
            "note": f"{text[name]}: 1 where it holds; margin here {100.0 * margin:.1f} %",
        }
        for name, margin in group_orders(trajectory, before, lines).items()
    ]
    return pd.DataFrame(rows)


def _notes(genetic, config):
    """Notes that depend on the results."""
    runs = genetic[(genetic["campaign"] == config["sweep"]["campaign"]) & (genetic["calibration"] == "lines")]
    if runs.empty:
        return {}
    return {
        "lines_objective": f"least mean distance {runs['optimum_mm'].iloc[0]:.4f} mm; the genetic algorithm's {len(runs)} seeds reach "
        f"{runs['objective_mm'].min():.4f} to {runs['objective_mm'].max():.4f} mm"
    }
