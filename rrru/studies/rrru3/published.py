"""Published numbers beside this study's: paper A's from its tables, papers B's and C's as they are handed over."""

import numpy as np
import pandas as pd

from rrru.robots.rrru3 import PARAMETER_NAMES
from rrru.studies.rrru3 import paper_a
from rrru.studies.rrru3.published_sisters import row, sister_rows
from rrru.studies.rrru3.study_numbers import TRAJECTORIES, group_orders, study_numbers

_COLUMNS = ["paper", "item", "source", "unit", "published", "here", "ratio", "here_low", "here_high", "note"]
_AXES = [f"error_{axis}_mm" for axis in "xyz"]


def published_table(
    config, errors, calibrations, parameters, genetic, sweep_runs, spread=None, sisters=None, sister_spread=None
):
    """Rows of `published` from tables of the study.

    config: the whole configuration, whose `reproduce` section says which calibrations stand for the paper's; errors,
    calibrations, parameters (the genetic algorithm's median run included), genetic, sweep_runs: the tables of those
    names; spread: item to (low, high) over other draws, see `rrru.studies.rrru3.redraw`; sisters: "B" and "C" to {item:
    number of this study}, sister_spread: to {item: (low, high)}, see `rrru.studies.rrru3.published_sisters`. Numbers
    that this study does not have are null.
    """
    reproduce = config["reproduce"]
    before, lines, spiral = (
        _study_errors(errors, reproduce, key) for key in ("none", "line_calibration", "spiral_calibration")
    )
    here = (
        _design(config)
        | _sweep(sweep_runs)
        | _fitted(parameters, reproduce)
        | _errors(before, lines, spiral)
        | _objective(calibrations, genetic, reproduce)
    )
    notes, spread = _notes(genetic, reproduce), spread or {}
    rows = [row("A", number, here, spread, notes.get(number.item, "")) for number in paper_a.NUMBERS]
    return pd.concat(
        [pd.DataFrame(rows), _orders(before, lines), pd.DataFrame(sister_rows(sisters, sister_spread))],
        ignore_index=True,
    )


def _study_errors(errors, reproduce, key):
    """Trajectory names (n,) and error vectors (n, 3): before calibration (key "none"), or driven again under one of the
    calibrations.
    """
    chosen = errors[errors["campaign"] == reproduce["campaign"]]
    if key == "none":
        chosen = chosen[chosen["mode"] == "before"]
    else:
        same = (chosen["calibration"] == reproduce[key]) & (chosen["method"] == reproduce["method"])
        chosen = chosen[same & (chosen["mode"] == "closed_loop")]
    chosen = chosen.sort_values(["run", "point"])
    return chosen["trajectory"].to_numpy(), chosen[_AXES].to_numpy()


def _design(config):
    """Dimensions, motion and counts as configured; what an ingested campaign or other trajectories do not have is
    absent.
    """
    robot, motion, genetic = config["robots"]["rrru3"], config["motion"], config["genetic"]
    campaign = config["campaigns"][config["reproduce"]["campaign"]]
    shape = config["trajectories"].get(campaign.get("trajectories"), {})
    result = {
        **{key: robot[key] for key in ("L1_mm", "L2_mm", "L3_mm", "R_mm", "r_mm") if key in robot},
        "population": sum(genetic["populations"]),
        "crossover_fraction": genetic["crossover_fraction"],
        "migration_fraction": genetic["migration_fraction"],
        "errors": len(PARAMETER_NAMES["published"]),
    }
    if shape:
        result |= {key: motion[key] for key in ("speed_mm_s", "acceleration_mm_s2")}
    if lines := shape.get("lines"):
        result |= {
            f"line_{end}_{axis}_mm": lines[f"{end}_mm"][k] for end in ("start", "end") for k, axis in enumerate("xyz")
        }
        result |= {"points_per_line": lines["points"], "line_groups": len(lines["offsets_y_mm"])}
    if spiral := shape.get("spiral"):
        result["points_on_spiral"] = spiral["points"]
    return result


def _sweep(runs):
    """Median objective of the one population at every swept value that the paper has."""
    result = {}
    one = runs[runs["population"] == "one"]
    for parameter, label in (("crossover_fraction", "P_c"), ("migration_fraction", "P_m")):
        for value in paper_a.VALUES:
            chosen = one[(one["parameter"] == parameter) & (one["value"] == float(value))]
            if len(chosen):
                result[f"{label}={value}"] = chosen["objective_mm"].median()
    return result


def _fitted(parameters, reproduce):
    """The printed 14 errors of both calibrations; dR and dr alone are those of the genetic algorithm's median run."""
    result = {}
    for label, key in (("lines", "line_calibration"), ("spiral", "spiral_calibration")):
        own = parameters[
            (parameters["campaign"] == reproduce["campaign"]) & (parameters["calibration"] == reproduce[key])
        ]
        by_method = {
            method: dict(zip(part["parameter"], part["value"], strict=True)) for method, part in own.groupby("method")
        }
        values, typical = by_method.get(reproduce["method"], {}), by_method.get("genetic", {})
        for name in paper_a.TABLE_5:
            value = (typical if name in ("dR", "dr") else values).get(name, np.nan)
            for printed in paper_a.TIED_TO_PRINTED.get(name, (name,)):
                result[f"{label}_{printed}"] = value
        result[f"{label}_da"] = values.get("da", np.nan)
    return result


def _errors(before, lines, spiral):
    """The error numbers of the paper's section 3; empty for a campaign that was not driven again along the paper's
    trajectories.
    """
    if not len(before[1]) == len(lines[1]) == len(spiral[1]) > 0 or not set(before[0]) >= TRAJECTORIES:
        return {}
    return study_numbers(before[0], before[1], lines[1], spiral[1])


def _objective(calibrations, genetic, reproduce):
    """Mean distance that the line calibration leaves on its own points."""
    own = [
        (table["campaign"] == reproduce["campaign"]) & (table["calibration"] == reproduce["line_calibration"])
        for table in (calibrations, genetic)
    ]
    if reproduce["method"] == "genetic":
        return {"lines_objective": genetic.loc[own[1], "objective_mm"].median()}
    return {
        "lines_objective": calibrations.loc[own[0] & (calibrations["method"] == reproduce["method"]), "mean_mm"].mean()
    }


def _orders(before, lines):
    """The paper's orders as rows: published 1 (holds), here 1 or 0."""
    if not len(before[1]) == len(lines[1]) > 0 or not set(before[0]) >= TRAJECTORIES:
        return pd.DataFrame(columns=_COLUMNS)
    text = {
        "centre_before": "mean error of each of groups 1-3 below each of groups 4-7, before calibration",
        "centre_after": "mean error of each of groups 1-3 below each of groups 4-7, after the line calibration",
        "group6_before": "largest error in group 6, before calibration",
        "group6_after": "largest error in group 6, after the line calibration",
    }
    rows = [
        {
            "paper": "A",
            "item": f"order_{name}",
            "source": "section 3.2, Fig. 10",
            "unit": "1",
            "published": 1.0,
            "here": float(margin > 0.0),
            "ratio": float(margin > 0.0),
            "here_low": np.nan,
            "here_high": np.nan,
            "note": f"{text[name]}: 1 where it holds; margin here {100.0 * margin:.1f} %",
        }
        for name, margin in group_orders(before[0], before[1], lines[1]).items()
    ]
    return pd.DataFrame(rows)


def _notes(genetic, reproduce):
    """Notes that depend on the results."""
    runs = genetic[
        (genetic["campaign"] == reproduce["campaign"]) & (genetic["calibration"] == reproduce["line_calibration"])
    ]
    if runs.empty:
        return {}
    typical = runs.sort_values(["objective_mm", "seed"]).iloc[(len(runs) - 1) // 2]
    return {
        "lines_objective": f"least mean distance {runs['optimum_mm'].iloc[0]:.4f} mm; the genetic algorithm's {len(runs)} seeds reach "
        f"{runs['objective_mm'].min():.4f} to {runs['objective_mm'].max():.4f} mm",
        "lines_dR": f"here the genetic algorithm's median run, whose dr - dR is {typical['da']:.4f} mm",
        "lines_dr": f"here the genetic algorithm's median run, whose dr - dR is {typical['da']:.4f} mm",
        "tolerance_mm": "the paper's requirement, not a result",
        "errors": "as in the paper; least squares fits the 7 that can be identified, the genetic algorithm the 8 tied ones",
    }
