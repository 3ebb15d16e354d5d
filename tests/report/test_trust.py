"""Which numbers may be trusted: each kind of reason against it is given, the worst one first."""

import numpy as np
import pandas as pd
import pytest

from rrru.report.trust import trust

NAMES = ("sure", "drawn", "bound", "unseen", "tied", "knot")


def tables(effects="backlash", moved=0.1):
    """Tables of one campaign with two calibrations; moved: the value of `sure` with the effects in the model."""
    values = dict(zip(NAMES, (0.1, 0.001, 0.5, 0.0, 0.2, 0.3), strict=True))
    parameters = pd.DataFrame({"parameter": NAMES, "unit": "mm", "value": values.values(), "standard_error": 0.01})
    parameters = parameters.assign(campaign="a", calibration="both", method="least_squares", true_value=np.nan)
    parameters = parameters.assign(
        seen=parameters["parameter"] != "unseen", at_bound=parameters["parameter"] == "bound"
    )
    calibrations = pd.DataFrame({"campaign": "a", "calibration": ["few", "both"], "points": [10, 50]})
    other = parameters.assign(calibration="few", value=9.0)
    correlations = pd.DataFrame([("tied", "knot", -0.99), ("sure", "drawn", 0.5)])
    correlations.columns = ["parameter_a", "parameter_b", "correlation"]
    corrected = pd.DataFrame({"campaign": "a", "effect": "calibration", "parameter": NAMES, "value": values.values()})
    corrected.loc[0, "value"] = moved
    corrected = corrected.assign(low_95=corrected["value"] - 0.02, high_95=corrected["value"] + 0.02)
    return (
        pd.concat([other, parameters], ignore_index=True),
        correlations.assign(campaign="a", calibration="both"),
        calibrations.assign(method="least_squares"),
        corrected,
        pd.DataFrame({"campaign": ["a"], "effects": [effects]}),
    )


def judgements(*made):
    return trust(*made).set_index("parameter")["judgement"]


def test_every_number_is_judged_by_the_calibration_on_most_points():
    said = judgements(*tables())
    assert said["sure"] == "use: differs from the drawing" and said["drawn"] == "use: as drawn, within its error"
    assert said["bound"] == "do not use: the fit ended at a bound"
    assert said["unseen"] == "do not use: the points do not show it"
    assert said["tied"] == "use only together with knot" and said["knot"] == "use only together with tied"
    assert set(trust(*tables())["calibration"]) == {"both"}


@pytest.mark.parametrize(("moved", "word"), [(0.1, "use"), (0.119, "use"), (0.121, "biased"), (0.05, "biased")])
def test_what_the_effects_change_by_more_than_twice_the_error_is_biased(moved, word):
    assert judgements(*tables(moved=moved))["sure"].startswith(word)


def test_a_number_that_only_the_model_with_the_effects_tells_from_the_drawing_differs_from_it():
    made = tables()
    drawn = made[3]["parameter"] == "drawn"
    made[3].loc[drawn, ["value", "low_95", "high_95"]] = 0.004, 0.003, 0.005
    assert judgements(*made)["drawn"] == "use: differs from the drawing"


def test_every_number_has_its_95_percent_interval():
    said = trust(*tables()).set_index("parameter")
    assert said.loc["sure", "value"] == "0.100 mm (95 %: 0.080 to 0.120)"
    assert said.loc["sure", "with_effects"] == "0.100 mm (95 %: 0.080 to 0.120)"


def test_without_effects_nothing_is_biased_and_with_something_unexplained_all_is_doubtful():
    assert judgements(*tables("none", 0.5))["sure"].startswith("use")
    said = judgements(*tables("unexplained", 0.5))
    assert said["sure"].startswith("doubtful") and said["bound"].startswith("do not use")
