"""Campaigns of few poses: the stated noise counts, and nothing is said of a repeatability that was not measured."""

import numpy as np
import pytest

from rrru.diagnosis.diagnose import MeasuredRobot, diagnose
from rrru.diagnosis.result_notes import REPEATABILITY_UNKNOWN
from rrru.diagnosis.settings import GapSettings
from tests.diagnosis import arms

_NOISE_MM = 0.03
_ACTING = {
    "nothing": (),
    "compliance": (arms.active("drive_compliance", np.array([0.0, 2e-8, 2e-8, 2e-8, 2e-8, 2e-8])),),
    "eccentricity": (arms.active("encoder_eccentricity", np.full(12, 4e-4)),),
}


def _diagnosed(acting, count, seed):
    frame = arms.measure(acting, count, seed, (_NOISE_MM, 1e-4))
    frame = frame.drop(columns=[name for name in frame if name.startswith("measured_r")])
    known = MeasuredRobot(arms.reading(frame), arms.MASSES, _NOISE_MM)
    return diagnose(frame, known, GapSettings(), details=False)


@pytest.mark.parametrize("count", [40, 150])
@pytest.mark.parametrize("acting", _ACTING)
def test_the_noise_of_a_short_campaign_is_the_stated_one(acting, count):
    """Where the columns of the library were more than half of the numbers, the effect itself passed for noise."""
    found = _diagnosed(_ACTING[acting], count, 3)
    notes = found.verdict["notes"]
    assert found.verdict["noise_rms_mm"] / np.sqrt(3.0) == pytest.approx(_NOISE_MM, rel=0.25)
    assert "does not repeat" not in notes and "noise stated" not in notes
    assert np.isfinite(found.tables["gap_parameters"]["value"]).all()
    if acting != "nothing":
        shares = found.tables["gap_budget"]["share"]
        assert shares.sum() == pytest.approx(1.0, abs=0.02) and shares.max() < 1.05


def test_a_noise_that_contradicts_the_stated_one_says_nothing_of_a_repeatability_that_was_not_measured():
    frame = arms.measure((), 200, 5, (4.0 * _NOISE_MM, 1e-4))
    frame = frame.drop(columns=[name for name in frame if name.startswith("measured_r")])
    known = MeasuredRobot(arms.reading(frame), arms.MASSES, _NOISE_MM)
    notes = diagnose(frame, known, GapSettings(("encoder_eccentricity",)), details=False).verdict["notes"]
    assert "noise stated 0.03 mm per axis" in notes and "does not repeat" not in notes
    assert REPEATABILITY_UNKNOWN in notes.split("; ")
