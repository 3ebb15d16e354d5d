"""Paper A's numbers compared with this study's, from the configuration and the tables of the reproduced campaign."""

import numpy as np
import pandas as pd

from rrru.campaign.measurements import vectors
from rrru.genetic.campaign_runs import typical_parameters
from rrru.pipeline import setup
from rrru.robots.rrru3 import Rrru3
from rrru.studies import paper
from rrru.studies.rrru3 import study_numbers as computed
from rrru.studies.rrru3.paper import NUMBERS, TIED, TIED_TO_PRINTED
from rrru.studies.rrru3.redraw import QUANTILES
from rrru.studies.rrru3.sweep_match import PRINTED, nearest_seed

_DIMENSIONS = ("L1_mm", "L2_mm", "L3_mm", "R_mm", "r_mm")


def published_rows(settings, errors, calibrations, parameters, genetic, genetic_parameters, sweep_runs, redraw_counts):
    """Rows of `published` for paper A.

    settings: the configuration's `genetic` and `reproduce`, with the campaign's `nominal` robot and its `virtual`
    part; the others: the tables of those names. Numbers that this study does not have are null.
    """
    chosen, nominal, virtual = settings["reproduce"], settings["nominal"], settings["virtual"]
    errors, calibrations, parameters, genetic, found = (
        table[table["campaign"] == chosen["campaign"]]
        for table in (errors, calibrations, parameters, genetic, genetic_parameters)
    )
    names = setup.mechanism(nominal).parameters.names
    parameters = pd.concat([parameters, typical_parameters(genetic, found, (*names, "dR", "dr"))], ignore_index=True)
    values = parameters.set_index(["calibration", "method", "parameter"])["value"]
    runs = genetic[genetic["calibration"] == chosen["line_calibration"]]
    numbers, order_notes = _error_numbers(errors, values, chosen)
    swept, swept_spread = _sweep(sweep_runs, settings["genetic"]["operators"])
    here = {
        **_design(nominal, virtual, settings["genetic"]),
        **swept,
        **_fitted(values, chosen),
        **numbers,
        "lines_objective": _objective(calibrations, runs, chosen),
    }
    counts = redraw_counts[redraw_counts["kind"] != "count"].set_index("item")
    spread = {row.Index: (row.median, row.low, row.high) for row in counts[counts["kind"] == "number"].itertuples()}
    spread |= swept_spread
    notes = _notes(runs, values, chosen) | order_notes
    for row in counts.itertuples():
        text = f"{'holds' if row.kind == 'order' else 'within 15 %'} in {row.met} of {row.draws} other draws"
        notes[row.Index] = "; ".join(filter(None, (notes.get(row.Index), text)))
    return paper.published_rows("A", NUMBERS, here, spread, notes)


def _design(nominal, virtual, genetic):
    """Configured dimensions, motion and counts, as far as the campaign has them."""
    shape = virtual["trajectories"] if virtual else {}
    result = {
        **{key: value for key, value in nominal["dimensions"].items() if key in _DIMENSIONS},
        "population": sum(genetic["populations"]),
        **{key: genetic[key] for key in ("crossover_fraction", "migration_fraction")},
        "errors": len(Rrru3.PARAMETER_NAMES["published"]),
    }
    if virtual:
        result |= {key: virtual["motion"][key] for key in ("speed_mm_s", "acceleration_mm_s2")}
    if lines := shape.get("lines"):
        ends = {
            f"line_{end}_{axis}_mm": lines[f"{end}_mm"][k] for end in ("start", "end") for k, axis in enumerate("xyz")
        }
        result |= ends | {"points_per_line": lines["points"], "line_groups": len(lines["offsets_y_mm"])}
    if spiral := shape.get("spiral"):
        result["points_on_spiral"] = spiral["points"]
    return result


def _sweep(runs, operators):
    """Objectives of a single population after its last generation, at every swept value that the paper has.

    By item: those of the seed that is nearest to the printed curve, and (median, low, high) over all seeds.
    """
    chosen = (runs["population"] == "one") & (runs["operators"] == operators) & (runs["stop"] == "end")
    here, spread = {}, {}
    for parameter, label in (("crossover_fraction", "P_c"), ("migration_fraction", "P_m")):
        _, printed = PRINTED[parameter]
        swept = runs[chosen & (runs["parameter"] == parameter) & runs["value"].isin(printed)]
        if swept.empty:
            continue
        seed, _ = nearest_seed(swept, printed)
        for value, part in swept.groupby("value"):
            item = f"{label}={value:.1f}"
            here[item] = float(part.loc[part["seed"] == seed, "objective_mm"].iloc[0])
            low, high = np.quantile(part["objective_mm"], QUANTILES)
            spread[item] = (float(part["objective_mm"].median()), float(low), float(high))
    return here, spread


def _fitted(values, chosen):
    """The 14 deviations that the paper prints, of both calibrations; dR and dr are those of the median genetic run."""
    result = {}
    for label, calibration in (("lines", chosen["line_calibration"]), ("spiral", chosen["spiral_calibration"])):
        for name in (*TIED, "da"):
            key = (calibration, "genetic" if name in ("dR", "dr") else chosen["method"], name)
            if key in values:
                result |= {f"{label}_{printed}": values[key] for printed in TIED_TO_PRINTED.get(name, (name,))}
    return result


def _error_numbers(errors, values, chosen):
    """The errors of the paper's section 3 and the orders between them, and notes on the orders.

    Empty for a campaign that was not driven again along the paper's trajectories.
    """
    names = (chosen["line_calibration"], chosen["spiral_calibration"])
    compensated = errors[(errors["mode"] == "closed_loop") & (errors["method"] == chosen["method"])]
    before, lines, spiral = (
        frame.sort_values(["run", "point"])
        for frame in (
            errors[errors["mode"] == "before"],
            *(compensated[compensated["calibration"] == name] for name in names),
        )
    )
    if not len(before) == len(lines) == len(spiral) > 0 or not set(before["trajectory"]) >= computed.TRAJECTORIES:
        return {}, {}
    before_mm, lines_mm, spiral_mm = (vectors(frame, "error") for frame in (before, lines, spiral))
    trajectory = before["trajectory"]
    margins = computed.group_orders(trajectory, before_mm, lines_mm, spiral_mm)
    margins |= computed.spike_orders(trajectory, before_mm, lines_mm) | _link_margin(values, chosen)
    orders = {f"order_{name}": float(margin > 0.0) for name, margin in margins.items()}
    notes = {f"order_{name}": f"margin here {100.0 * margin:.1f} %" for name, margin in margins.items()}
    return computed.study_numbers(trajectory, before_mm, lines_mm, spiral_mm) | orders, notes


def _link_margin(values, chosen):
    """Margin of the link errors' order, from the estimates of both calibrations."""
    names = (chosen["line_calibration"], chosen["spiral_calibration"])
    found = [[values.get((name, chosen["method"], link)) for link in computed.LINKS] for name in names]
    return {} if None in [*found[0], *found[1]] else computed.link_order(*found)


def _objective(calibrations, runs, chosen):
    """Mean residual distance in mm of the line calibration on its own points."""
    if chosen["method"] == "genetic":
        return runs["objective_mm"].median()
    fitted = (calibrations["calibration"] == chosen["line_calibration"]) & (calibrations["method"] == chosen["method"])
    return calibrations.loc[fitted, "mean_mm"].mean()


def _notes(runs, values, chosen):
    """Notes on the genetic algorithm's runs of the line calibration."""
    if runs.empty:
        return {}
    difference = values[chosen["line_calibration"], "genetic", "da"]
    typical = f"here the genetic algorithm's median run, whose dr - dR is {difference:.4f} mm"
    reached = f"{runs['objective_mm'].min():.4f} to {runs['objective_mm'].max():.4f} mm"
    return {
        "lines_objective": f"least mean distance {runs['optimum_mm'].iloc[0]:.4f} mm; "
        f"the genetic algorithm's {len(runs)} seeds reach {reached}",
        "lines_dR": typical,
        "lines_dr": typical,
        "tolerance_mm": "the paper's requirement, not a result",
        "errors": "as in the paper; least squares fits the 7 that can be identified, "
        "the genetic algorithm the 8 tied ones",
    }
