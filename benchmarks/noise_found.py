"""Statements of a diagnosis on noise and repeatability for short campaigns: `make bench GROUPS=noise_found`.

An arm of seven axes is measured at 40 to 300 random poses with a correctly stated noise of 0.03 mm per axis. The robot
repeats exactly: a sentence that it does not is false. In half of the files some poses are measured again. Compliance,
eccentricity, thermal growth or nothing acts, 15 campaigns each. The diagnosis uses the whole library.

    python -m benchmarks.noise_found --campaigns 15
"""

import os

# matrices are small: more than one thread is slower
os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import time

import numpy as np
import pandas as pd

from benchmarks.harness import RESULTS
from benchmarks.virtual_campaigns import draw_truth, measure, pose_campaign
from rrru.diagnosis.diagnose import MeasuredRobot, diagnose
from rrru.diagnosis.settings import GapSettings
from rrru.diagnosis.verdict_facts import answer
from rrru.errors import FitError
from rrru.robots.drive_words import drive_words
from rrru.seeds import stream

NOISE_MM = 0.03
ACTING = ("drive_compliance", "encoder_eccentricity", "thermal_growth", "")
# number of repeated poses, and number of readings of each
_REPEATED, _TIMES = 10, 4
_SEED, _RESAMPLES, _NEAR = 11, 20, 0.25
_FALSE = ("does not repeat",)
_UNSEEN_SHARE = 0.02


def one_campaign(acting, number):
    """A row with the result of the diagnosis of one campaign; acting: the acting effect, empty for none."""
    generator = stream(_SEED, "noise found", acting, number)
    count, repeated = int(generator.integers(40, 301)), bool(number % 2)
    campaign = pose_campaign("arm7", count, NOISE_MM, acting, (_REPEATED, _TIMES) if repeated else (0, 1), generator)
    truth = draw_truth(campaign, generator, bool(acting))
    frame = measure(campaign, truth, generator)
    known = MeasuredRobot(campaign.mechanism, campaign.masses, NOISE_MM)
    row = {"acting": acting or "none", "number": number, "poses": len(frame), "repeated": repeated}
    began = time.process_time()
    try:
        found = diagnose(frame, known, GapSettings(draws=_RESAMPLES))
    except (FitError, np.linalg.LinAlgError) as problem:
        return row | {"failed": str(problem)[:200], "seconds": time.process_time() - began}
    facts = answer("arm", found.verdict, found.tables, drive_words(campaign.mechanism))
    return row | {"failed": "", "seconds": time.process_time() - began} | _said(found, facts)


def _said(found, facts):
    """What a diagnosis and its sentences say."""
    verdict, parameters, budget = found.verdict, found.tables["gap_parameters"], found.tables["gap_budget"]
    named = set(verdict["effects"].split("+")) - {"none", "unexplained"}
    sentences = [*facts["sentences"], *verdict["notes"].split("; ")]
    errors = parameters.loc[parameters["effect"] == "calibration", "standard_error"]
    parts = budget[~budget["kind"].isin(["sampling", "calibration", "covariance"])]
    free = ~parameters["effect"].isin(["calibration", "weight"]) & parameters["standard_error"].isna()
    return {
        "effects": verdict["effects"],
        "probability": verdict["probability"],
        "points": verdict["points"],
        "noise_mm": verdict["noise_rms_mm"] / np.sqrt(3.0),
        "noise_from": verdict["noise_from"],
        "noise_near": abs(verdict["noise_rms_mm"] / np.sqrt(3.0) / NOISE_MM - 1.0) <= _NEAR,
        "false_repeatability": " | ".join(s for s in sentences if any(false in s for false in _FALSE)),
        "sum_of_shares": budget["share"].sum(),
        "sum_of_parts": parts["share"].sum(),
        "sum_without_sampling": budget.loc[budget["kind"] != "sampling", "share"].sum(),
        "without_rows": ",".join(sorted(named - set(parameters["effect"]))),
        "nan_errors": int(errors.isna().sum()),
        "nan_effect_errors": ",".join(parameters.loc[free, "effect"].unique()),
        "share_closed": verdict["share_closed"],
    }


def summarize(table):
    """Counts over all campaigns, and by what acts."""
    result = []
    for name, own in [("all", table), *table.groupby("acting", sort=False)]:
        done = own[own["failed"] == ""]
        names = done["effects"].str.replace("unexplained", "").str.strip("+")
        result.append(
            {
                "acting": name,
                "campaigns": len(own),
                "diagnosed": len(done),
                "noise_near": int(done["noise_near"].sum()),
                "noise_median_mm": done["noise_mm"].median(),
                "noise_worst_mm": done["noise_mm"].max(),
                "false_sentences": int((done["false_repeatability"] != "").sum()),
                "shares_are_1": int((np.abs(done["sum_of_shares"] - 1.0) <= _UNSEEN_SHARE).sum()),
                "parts_worst": done["sum_of_parts"].max(),
                "without_rows": int((done["without_rows"] != "").sum()),
                "nan_errors": int((done["nan_errors"] > 0).sum()),
                "named_right": int((names.replace("", "none") == done["acting"]).sum()),
            }
        )
    return pd.DataFrame(result)


def main(arguments=None):
    """Run a number of campaigns of each kind, write their table and print the counts."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--campaigns", type=int, default=15)
    asked = parser.parse_args(arguments)
    folder = RESULTS / "benchmarks" / "noise_found"
    folder.mkdir(parents=True, exist_ok=True)
    result = []
    for number in range(asked.campaigns):
        for acting in ACTING:
            result.append(one_campaign(acting, number))
            pd.DataFrame(result).to_csv(folder / "campaigns.csv", index=False)
            print({k: v for k, v in result[-1].items() if k not in ("number", "seconds")}, flush=True)
    counts = summarize(pd.DataFrame(result))
    with pd.option_context("display.width", 220, "display.max_columns", 40, "display.float_format", "{:.3g}".format):
        print(counts.to_string(index=False), flush=True)


if __name__ == "__main__":
    main()
