"""Calibrated campaigns of virtual robots in folders as a run leaves them, with a made-up answer of their diagnosis."""

import numpy as np
import pandas as pd

from rrru.calibration import campaign_fit
from rrru.calibration.schemas import TABLES as FIT_TABLES
from rrru.campaign import measurements as rows
from rrru.compensation.evaluate import model_residual
from rrru.robots.rrru3 import Rrru3
from rrru.simulation.virtual_robot import VirtualRobot
from rrru.store import json_files, tables
from tests.diagnosis.campaigns import FORWARD, NOISE_MM, REVERSE, plan_of
from tests.schemas import TABLES

NOMINAL = {"name": "rrru3", "dimensions": {}, "parameter_set": None}
SETS = {"sets": {"lines": ["line_*"], "both": ["*"]}}
ERRORS = {"dtheta1": 2e-3, "dtheta2": -1e-3, "dL1": 0.4, "dL3": -0.3, "dr": 0.2}


def measured(seed, errors=ERRORS, noise_mm=NOISE_MM, passes=(FORWARD, REVERSE)):
    """Measurements of a virtual robot."""
    return VirtualRobot(deviations=errors).run(plan_of(passes), noise_mm, np.random.default_rng(seed))[0]


def leave(folder, campaign, frame, noise_mm=NOISE_MM, nominal=NOMINAL, sets=SETS, groups=()):
    """Write a campaign's measurements, calibrations and answer, with these groups, to a folder of results."""
    place, robot = folder / "campaigns" / campaign, Rrru3()
    settings = campaign_fit.CalibrationSettings.from_config(sets)
    fits = campaign_fit.fit_sets(frame, robot, settings, noise_mm)
    tables.write(TABLES["measurements"], frame, place / "measurements.parquet")
    known = {table.name: table for table in FIT_TABLES}
    for name, table in campaign_fit.tables(campaign, fits).items():
        tables.write(known[name], table, place / f"{name}.parquet")
    json_files.write(
        {"nominal": nominal, "noise_mm": noise_mm, "arm_mm": np.nan, "calibration": sets}, place / "robot.json"
    )
    left = model_residual(frame, robot, fits["both", "least_squares"].deviations)
    points = frame[["run", "trajectory", "point"]].assign(used=True)
    before = {f"before_{axis}_mm": left[f"error_{axis}_mm"].to_numpy() for axis in "xyz"}
    points.assign(**before, **rows.vector_columns("command", rows.command(frame))).to_parquet(
        place / "gap_points.parquet"
    )
    part = {"part": "backlash", "kind": "effect", "rms_mm": 0.01, "share": 1.0, "share_low": 0.8, "share_high": 1.2}
    answer = {
        "effects": [{"name": "backlash", "decision": "named"}],
        "unexplained": False,
        "probability": 0.9,
        "gap_rms_mm": 0.01,
    }
    answer |= {"groups": [*groups]}
    json_files.write(answer | {"budget": [part], "noise_rms_mm": noise_mm * 3.0**0.5}, place / "verdict.json")


def moved(frame, shift_mm):
    """The same measurements with every measured point shifted (3,)."""
    return frame.assign(**rows.vector_columns("measured", rows.measured(frame) + np.asarray(shift_mm)))


def joined(*frames):
    """Measurements one below the other, their runs counted on."""
    shifted, last = [], 0
    for frame in frames:
        shifted.append(frame.assign(run=frame["run"] + last))
        last = int(shifted[-1]["run"].max())
    return pd.concat(shifted, ignore_index=True)
