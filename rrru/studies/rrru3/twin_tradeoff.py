"""What keeps the twin from a printed number: the search again, with this number weighing more and more.

The number that suffers most is the other half of a contradiction: two printed numbers that no candidate found meets
together. All start at the same candidate and have the same number of evaluations.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from rrru.studies.rrru3 import study_numbers as numbers
from rrru.studies.rrru3 import twin_restarts, twin_search
from rrru.studies.rrru3.paper import ERRORS_MM
from rrru.studies.rrru3.redraw import QUANTILES
from rrru.studies.rrru3.twin_objective import surprises


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
