"""The twin's search again: for hypotheses about the paper and its robot, and with a missed number weighing more.

Hypotheses are searched with the same number of evaluations each, to the end of a descent. They compete by the objective
on draws that the search did not use: a difference of 1 nat is a factor of e in the probability of what the paper
prints.

A trade-off searches again with a printed number that the twin misses weighing more and more. The number that suffers
most is the other half of a contradiction: two printed numbers that no candidate found meets together. All start at the
same candidate and have the same number of evaluations.
"""

import logging
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from rrru.studies.rrru3 import study_numbers as numbers
from rrru.studies.rrru3 import twin_restarts, twin_search
from rrru.studies.rrru3.paper import ERRORS_MM
from rrru.studies.rrru3.redraw import QUANTILES
from rrru.studies.rrru3.twin_objective import misfit, surprises

_COUNTS = ("medians_met", "inside", "orders_met")
LINE_CALIBRATION = "group_1"
# name: statement, and what it changes of the task; the first one is what the others are compared with
HYPOTHESES = {
    "group_1": ("Table 5 was fitted to group 1; errors are those of the measured points", {}),
    "lines": ("Table 5 was fitted to all seven groups", {"line_calibration": "lines"}),
    "model": ("errors after a calibration are those of its model at the points measured before", {"of_model": True}),
    "lines_model": ("both of these", {"line_calibration": "lines", "of_model": True}),
    "registered": ("the tracker's frame was fitted to the robot's own points", {"registered": True}),
    "spikes": ("three commands of group 1 were wrong", {"more": ("spikes",)}),
    "leg_asymmetry": ("links of each leg differ", {"more": ("leg_asymmetry",)}),
    "drive_compliance": ("the drives give under the platform's weight", {"more": ("drive_compliance",)}),
    "link_flexure": ("the forearms give under the platform's weight", {"more": ("link_flexure",)}),
    "base_placement": ("the legs' feet are misplaced", {"more": ("base_placement",)}),
    "axis_tilt": ("the drives' axes are tilted, so that the platform turns", {"more": ("axis_tilt",)}),
}


def compare(task, fresh, section, start=None, workers=1, folder=None):
    """Rows of `twin_hypotheses`.

    task: of the first hypothesis; fresh: draws that no search uses, see `twin_search.draw`; section: the
    configuration's `twin`; start: a Twin about which every first restart begins; folder: of the searches' states.
    """
    rows, section = [], section | section["hypotheses"]
    for name, (statement, changes) in HYPOTHESES.items():
        path = Path(folder) / f"{name}.json" if folder else None
        # the orders of the spikes count in a search only where something searched makes a spike
        own = replace(task, **changes, spikes="spikes" in changes.get("more", ()))
        restarts, _ = twin_restarts.search(own, section, start, workers, path)
        row = {"hypothesis": name, "statement": statement, "searched": len(own.bounds)}
        row |= {"evaluations": sum(restart.evaluations for restart in restarts)}
        rows.append(row | judged(replace(own, draws=fresh, spikes=True), twin_restarts.best(restarts)))
        logging.info("%s: %.2f nat on other draws", name, rows[-1]["fresh_nat"])
    frame = pd.DataFrame(rows)
    return frame.assign(gain_nat=frame["fresh_nat"].iloc[0] - frame["fresh_nat"])


def judged(task, restart):
    """Objectives and counts of a restart's best candidate on the task's draws; nulls where it cannot be driven."""
    objective = restart.best if restart.best < twin_search.WORST else np.nan
    try:
        found, orders = twin_search.simulate(task, restart.twin)
    except twin_search.NOT_DRIVEN:
        return {"objective_nat": objective, "fresh_nat": np.nan} | dict.fromkeys(_COUNTS, 0)
    low, high = ({item: np.quantile(values, share) for item, values in found.items()} for share in QUANTILES)
    printed = ERRORS_MM.items()
    counts = (
        sum(bool(numbers.matched(item, np.median(found[item]), value)) for item, value in printed),
        sum(bool(numbers.covered(item, low[item], high[item], value)) for item, value in printed),
        sum(bool(np.median(margin) > 0.0) for margin in orders.values()),
    )
    values = {"objective_nat": objective, "fresh_nat": misfit(found, orders)}
    return values | dict(zip(_COUNTS, counts, strict=True))


# --- trade-offs


def tradeoff(task, fresh, section, start, workers=1, folder=None):
    """Rows of `twin_tradeoff` for every printed number that the Twin `start` misses.

    fresh: draws that no search uses, over which medians and contributions are taken; section: the configuration's
    `twin`; folder: of the searches' states.
    """
    judge, own = replace(task, draws=fresh), section | section["tradeoff"] | {"restarts": 1}
    found, _ = twin_search.simulate(judge, start)

    def nearest(item, weight):
        """Contributions of the best candidate where an item has a weight."""
        path = Path(folder) / f"{item}_{weight:g}.json" if folder else None
        restarts, _ = twin_restarts.search(replace(task, weights={item: weight}), own, start, workers, path)
        return _contributions(judge, twin_restarts.best(restarts).twin)

    items, rows = missed(found), []
    # the same for every item
    plain = nearest("none", 1.0) if items else []
    for item in items:
        rows += [(item, 1.0, *part) for part in plain]
        for weight in section["tradeoff"]["weights"]:
            rows += [(item, weight, *part) for part in nearest(item, weight)]
    frame = pd.DataFrame(rows, columns=["item", "weight", "other", "ratio", "contribution_nat"])
    return frame.assign(partner=frame["item"].map(partners(frame)) == frame["other"])


def missed(found):
    """Printed numbers that are outside the middle 90 % of draws (d,) and whose median is not within 15 %."""
    result = []
    for item, printed in ERRORS_MM.items():
        low, high = np.quantile(found[item], QUANTILES)
        near = numbers.matched(item, np.median(found[item]), printed)
        if not near and not numbers.covered(item, low, high, printed):
            result.append(item)
    return result


def partners(frame):
    """By item, the other printed number whose contribution rises most from the least weight to the greatest."""
    result, numbers_only = {}, frame[frame["other"].isin(ERRORS_MM)]
    for item, part in numbers_only.groupby("item"):
        contribution = part[part["other"] != item].pivot(index="other", columns="weight", values="contribution_nat")
        result[item] = (contribution[contribution.columns[-1]] - contribution[contribution.columns[0]]).idxmax()
    return result


def _contributions(task, twin):
    """Name, median over printed number (of an order its margin), and contribution of every number and order."""
    found, orders = twin_search.simulate(task, twin)
    medians = {item: np.median(found[item]) / printed for item, printed in ERRORS_MM.items()}
    medians |= {f"order_{name}": np.median(margin) for name, margin in orders.items()}
    return [(name, float(medians[name]), float(part)) for name, part in surprises(found, orders).items()]
