"""Paper A's numbers beside this study's."""

import numpy as np
import pandas as pd

from rrru.reproduce import paper_a
from rrru.reproduce.study_numbers import group_orders, study_numbers

_AXES = [f"error_{axis}_mm" for axis in "xyz"]


def published_table(config, errors, parameters, genetic, sweep_runs):
    """Rows of `published` from tables of the study.

    config: the whole configuration, whose `reproduce` section says which calibrations stand for the paper's; errors, parameters, genetic,
    sweep_runs: the tables of those names. Numbers that this study does not have are null.
    """
    reproduce = config["reproduce"]
    before, lines, spiral = (_study_errors(errors, reproduce, key) for key in ("none", "line_calibration", "spiral_calibration"))
    here = (
        _design(config)
        | _sweep(sweep_runs)
        | _fitted(parameters, genetic, reproduce)
        | _errors(errors, reproduce, before, lines, spiral)
        | {"tolerance_mm": 2.0}
    )
    notes = _notes(genetic, reproduce)
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
    return pd.concat([pd.DataFrame(rows), _orders(before, lines)], ignore_index=True)


def _study_errors(errors, reproduce, key):
    """Trajectory names (n,) and error vectors (n, 3): before calibration (key "none"), or driven again under one of the calibrations."""
    chosen = errors[errors["campaign"] == reproduce["campaign"]]
    if key == "none":
        chosen = chosen[chosen["mode"] == "before"]
    else:
        same = (chosen["calibration"] == reproduce[key]) & (chosen["method"] == reproduce["method"])
        chosen = chosen[same & (chosen["mode"] == "closed_loop")]
    chosen = chosen.sort_values(["run", "point"])
    return chosen["trajectory"].to_numpy(), chosen[_AXES].to_numpy()


def _design(config):
    """Dimensions, motion and counts as configured."""
    robot, motion = config["robots"]["rrru3"], config["motion"]
    shape = config["trajectories"][config["campaigns"][config["reproduce"]["campaign"]]["trajectories"]]
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


def _fitted(parameters, genetic, reproduce):
    """The printed 14 errors of both calibrations; dR and dr alone from the genetic algorithm's median, since only dr - dR is a result."""
    result = {}
    for label, key in (("lines", "line_calibration"), ("spiral", "spiral_calibration")):
        own = [(t["campaign"] == reproduce["campaign"]) & (t["calibration"] == reproduce[key]) for t in (parameters, genetic)]
        chosen, runs = parameters[own[0] & (parameters["method"] == reproduce["method"])], genetic[own[1]]
        values = dict(zip(chosen["parameter"], chosen["value"], strict=True))
        for name in paper_a.TABLE_5:
            value = float(runs[name].median()) if name in ("dR", "dr") and len(runs) else values.get(name, np.nan)
            for printed in paper_a.TIED_TO_PRINTED.get(name, (name,)):
                result[f"{label}_{printed}"] = value
        result[f"{label}_da"] = values.get("da", np.nan)
    return result


def _errors(errors, reproduce, before, lines, spiral):
    """The error numbers of the paper's section 3; empty for a campaign that was not driven again."""
    if not len(before[1]) == len(lines[1]) == len(spiral[1]) > 0:
        return {}
    own = (errors["campaign"] == reproduce["campaign"]) & (errors["calibration"] == reproduce["line_calibration"])
    model = errors[own & (errors["method"] == reproduce["method"]) & (errors["mode"] == "model")]
    if reproduce["line_calibration"] == "group_1":
        model = model[model["trajectory"] == "line_1"]
    model = model[model["trajectory"].str.startswith("line_")]
    return study_numbers(before[0], before[1], lines[1], spiral[1]) | {"lines_objective": model["error_mm"].mean()}


def _orders(before, lines):
    """The paper's orders as rows: published 1 (holds), here 1 or 0."""
    if not len(before[1]) == len(lines[1]) > 0:
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
        for name, margin in group_orders(before[0], before[1], lines[1]).items()
    ]
    return pd.DataFrame(rows)


def _notes(genetic, reproduce):
    """Notes that depend on the results."""
    runs = genetic[(genetic["campaign"] == reproduce["campaign"]) & (genetic["calibration"] == reproduce["line_calibration"])]
    if runs.empty:
        return {}
    return {
        "lines_objective": f"least mean distance {runs['optimum_mm'].iloc[0]:.4f} mm; the genetic algorithm's {len(runs)} seeds reach "
        f"{runs['objective_mm'].min():.4f} to {runs['objective_mm'].max():.4f} mm"
    }
