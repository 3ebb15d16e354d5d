"""All printers of the file at once, as a run of the workflow leaves them."""

import numpy as np
import pandas as pd

from tests.studies.printers.simulated_printers import PRINTERS


def test_printers_that_share_readings_are_one_piece_of_evidence(results):
    """By hand: 18, 22, 23 and 24 have the same twelve distances, 19 the heights of 18; 10 and 11 share some of 09."""
    names = ("printers", "printer_causes", "printer_readings")
    printers, causes, readings = (pd.read_parquet(results / f"tables/{name}.parquet") for name in names)
    printers = printers.set_index("printer")
    for name in ("printer_22", "printer_23", "printer_24"):
        assert (PRINTERS[name].distance_mm == PRINTERS["printer_18"].distance_mm).all()
    shared = {name: first for name, first in printers["evidence"].items() if name != first}
    assert shared == {f"printer_{k}": "printer_18" for k in (19, 22, 23, 24)} | {
        "printer_10": "printer_09",
        "printer_11": "printer_09",
    }
    causes = causes.merge(printers["distances"], left_on="printer", right_index=True)
    # a bad reading is its own file's matter
    pieces = np.where(causes["cause"] == "bad_reading", 1.0, 6.0)
    np.testing.assert_allclose(causes["limit"], 0.05 / pieces / np.where(causes["distances"] > 0, 6.0, 4.0))
    assert set(printers["cause"]) == {"none found", "not decidable"} and not readings["flagged"].any()
