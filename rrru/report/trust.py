"""Which parameters of a calibration may be trusted, in words. Values in mm and rad."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import pandas as pd

from rrru.diagnosis.number_text import rounded, with_interval
from rrru.estimation.intervals import QUANTILE_95
from rrru.report.cells import MINUS

# absolute correlation above which two parameters are not separable
_MIN_INSEPARABLE_CORRELATION = 0.95
_NO_EFFECTS = ("none", "unexplained")
COLUMNS = ["campaign", "parameter", "value", "judgement", "with_effects", "true_value", "calibration", "points"]


def trust(
    parameters: pd.DataFrame,
    correlations: pd.DataFrame,
    calibrations: pd.DataFrame,
    corrected: pd.DataFrame,
    verdicts: pd.DataFrame,
) -> pd.DataFrame:
    """A row per campaign and parameter of its calibration on most points, least squares: value, interval and judgement.

    corrected: rows of `gap_parameters`, the parameters with the effects in the model;
    verdicts: rows of `gap_verdicts`.
    """
    answers = verdicts.set_index("campaign")["effects"]
    by_least_squares = calibrations[calibrations["method"] == "least_squares"]
    widest = by_least_squares.sort_values("points", kind="stable", ascending=False).drop_duplicates("campaign")
    rows = parameters.merge(widest[["campaign", "calibration", "method", "points"]], how="inner")
    # without effects it is the same calibration, except for the points that a diagnosis leaves out
    with_effects = corrected[~corrected["campaign"].map(answers).isin(_NO_EFFECTS)]
    moved = with_effects.query("effect == 'calibration'")[["campaign", "parameter", "value", "low_95", "high_95"]]
    rows = rows.merge(moved.rename(columns={"value": "moved"}), how="left", on=["campaign", "parameter"])
    rows = rows.assign(unexplained=rows["campaign"].map(answers).fillna("").str.contains("unexplained"))
    texts: dict[str, Callable[[Mapping[str, Any]], str | None]] = {
        "value": _value,
        "judgement": lambda row: _judgement(row, _inseparable(row, correlations)),
        "with_effects": lambda row: _interval(row["moved"], row["low_95"], row["high_95"], row["unit"]),
        "true_value": lambda row: _plain(row["true_value"], row["unit"]),
    }
    judged = {name: [text_of(row) for row in rows.to_dict("records")] for name, text_of in texts.items()}
    return rows.assign(**judged)[COLUMNS]


def _plain(value: float, unit: str) -> str | None:
    """A number with its unit, None where there is none."""
    return None if pd.isna(value) else f"{rounded(value, 3)} {unit}".replace("-", MINUS)


def _value(row: Mapping[str, Any]) -> str | None:
    """A number with its unit and its 95 % interval."""
    half = QUANTILE_95 * row["standard_error"]
    return _interval(row["value"], row["value"] - half, row["value"] + half, row["unit"])


def _interval(value: float, low: float, high: float, unit: str) -> str | None:
    """A number with its unit and its 95 % interval; the number alone where the interval is NaN or empty."""
    if not high > low:
        return _plain(value, unit)
    return str(with_interval(value, low, high, unit).replace("-", MINUS))


def _judgement(row: Mapping[str, Any], tied: Sequence[str]) -> str:
    """What a user may do with one number; tied: parameters that the points do not separate from it."""
    half = QUANTILE_95 * row["standard_error"]
    if not row["seen"]:
        return "do not use: the points do not show it"
    if row["at_bound"]:
        return "do not use: the fit ended at a bound"
    if abs(row["moved"] - row["value"]) > half:
        return "biased: the diagnosed effects change it by more than its error"
    if row["unexplained"]:
        return "doubtful: something acts that no effect explains"
    if tied:
        return f"use only together with {', '.join(tied)}"
    # the interval with the effects in the model, where there is one: without them the parameter absorbs the effects
    low, high = row["value"] - half, row["value"] + half
    if row["high_95"] > row["low_95"]:
        low, high = row["low_95"], row["high_95"]
    return "use: differs from the drawing" if low > 0.0 or high < 0.0 else "use: as drawn, within its error"


def _inseparable(row: Mapping[str, Any], correlations: pd.DataFrame) -> list[str]:
    """Parameters whose estimates correlate so strongly with this one's that the points do not separate them."""
    of_row = (correlations["campaign"] == row["campaign"]) & (correlations["calibration"] == row["calibration"])
    strong = correlations[of_row & (correlations["correlation"].abs() > _MIN_INSEPARABLE_CORRELATION)]
    pairs = zip(strong["parameter_a"], strong["parameter_b"], strict=True)
    return sorted({name for pair in pairs if row["parameter"] in pair for name in pair} - {row["parameter"]})
