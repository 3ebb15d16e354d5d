"""Strengths of many effects averaged one after the other, against the average over all their combinations."""

import pytest

from rrru.diagnosis.evidence import averaged
from rrru.diagnosis.terms import EffectTerm
from tests.diagnosis.evidence_problems import tripod_evidence

# nats between both: 0.04 with four effects, 0.1 with five, 0.13 with six (not tested here: 262,144 combinations)
_MAX_ERROR_NATS = 0.15
_SETS = (
    ("drive_compliance", "backlash", "link_flexure", "joint_clearance"),
    ("axis_tilt", "drive_compliance", "frame_misregistration", "encoder_eccentricity"),
    ("servo_lag", "backlash", "encoder_eccentricity", "thermal_growth"),
    ("drive_compliance", "backlash", "link_flexure", "joint_clearance", "servo_lag"),
)


@pytest.mark.parametrize("names", _SETS, ids=[" ".join(names) for names in _SETS])
def test_the_average_over_each_prior_scale_is_near_that_over_all_combinations(names):
    evidence, terms = tripod_evidence(), tuple(map(EffectTerm, names))
    found, _ = evidence.over_all_strengths(terms, 0)
    value, _ = evidence.over_strengths(terms, levels=[0])
    assert abs(found - averaged(value, evidence.log_scales(terms))[0]) < _MAX_ERROR_NATS
