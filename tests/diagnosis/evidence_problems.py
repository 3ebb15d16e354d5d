"""Twenty problems of the evidence with one to six effects: linearisations of robots, and columns that correlate."""

from dataclasses import replace
from functools import cache
from typing import NamedTuple

import numpy as np

from rrru.diagnosis.calibrate import calibrate
from rrru.diagnosis.marginal_problem import MarginalProblem
from rrru.diagnosis.terms import SAME, EffectTerm
from rrru.diagnosis.whitened import DISCREPANCY_SCALES
from tests.diagnosis import arms, campaigns

# prior scales over what is left of an effect, and levels of the discrepancy
_WEAK, _STRONG, _NO_LEVEL, _HIGH_LEVEL = 1.0, 30.0, 0, 3
_SOFT = EffectTerm("drive_compliance"), EffectTerm("link_flexure")
_CLEARANCE = EffectTerm("backlash"), EffectTerm("joint_clearance")
_TRIPOD = (
    (EffectTerm("backlash"),),
    (EffectTerm("drive_compliance", legs=SAME),),
    (EffectTerm("joint_clearance", 3), EffectTerm("backlash")),
    _SOFT,
    (*_CLEARANCE, EffectTerm("servo_lag")),
    (*_SOFT, EffectTerm("thermal_growth", 2)),
    (*_SOFT, *_CLEARANCE),
    (*_SOFT, *_CLEARANCE, EffectTerm("servo_lag")),
    (*_SOFT, *_CLEARANCE, EffectTerm("servo_lag"), EffectTerm("thermal_growth", 4)),
    (*_SOFT, *_CLEARANCE, EffectTerm("axis_tilt"), EffectTerm("encoder_eccentricity")),
)
_ARM = (
    (EffectTerm("backlash"),),
    (EffectTerm("drive_compliance"),),
    (EffectTerm("drive_compliance"), EffectTerm("backlash")),
    (EffectTerm("drive_compliance"), EffectTerm("backlash"), EffectTerm("encoder_eccentricity")),
)
# coefficients and shared part of random columns: correlations of 0.99 to 0.9999
_RANDOM = ((2, 10.0), (3, 10.0), (6, 30.0), (6, 100.0), (12, 30.0), (18, 100.0))
COUNT = len(_TRIPOD) + len(_ARM) + len(_RANDOM)


class Problem(NamedTuple):
    """A problem of one level: its name, the MarginalProblem, prior scales (terms,), and the evidence with
    terms.
    """

    name: str
    problem: MarginalProblem
    prior_scales: np.ndarray
    evidence: object = None
    terms: tuple = ()
    level: int = 0

    @property
    def scale(self):
        """Prior standard deviations (k,)."""
        return self.problem.scale(self.prior_scales[None])[0]


def without_nuisance(linear):
    """The linearisation with payload and tilt known."""
    return replace(linear, by_weight={}, weight_steps=())


@cache
def tripod_evidence():
    """Evidence of a 3-RRRU on which backlash and compliance act, both about as large as the noise."""
    acting = campaigns.strong("backlash", 0.5), campaigns.strong("drive_compliance", 1.0, 1)
    problem = campaigns.problem_of(campaigns.measure(acting))
    return problem.evidence(without_nuisance(problem.linearise(calibrate(problem))))


@cache
def arm_evidence():
    """Evidence of a six-axis arm with soft joints, some of them too stiff to be seen."""
    soft = arms.active("drive_compliance", [0.0, 2e-9, 1e-9, 0.0, 1e-10, 0.0])
    problem = arms.problem_of(arms.measure((soft,), 60), "backlash", "drive_compliance", "encoder_eccentricity")
    return problem.evidence(without_nuisance(problem.linearise(calibrate(problem))))


def _of_robot(name, evidence, terms, prior_scale, level):
    prior_scales = prior_scale * np.resize([1.0, 0.3, 0.1], len(terms))
    level = level if level in evidence.levels else 0
    evidence = evidence.on_complete(terms)
    return Problem(name, evidence.projected(terms, [level]), prior_scales, evidence, terms, level)


def _random(number, count, shared):
    """Half of the columns point against the other half; the data hold coefficients of which some are zero."""
    generator = np.random.default_rng([32, number])
    sign = np.where(np.arange(count) % 2 == number % 2, -1.0, 1.0) if number % 3 else np.ones(count)
    design = shared * generator.normal(size=(3 * count, 1)) * sign + generator.normal(size=(3 * count, count))
    made = np.maximum(generator.normal(size=count), 0.0)
    data = design @ made + generator.normal(size=3 * count)
    nothing, owner = np.zeros(count), np.arange(count) * 6 // max(count, 6)
    prior = nothing + 1.0, nothing + np.inf, nothing == 0.0, nothing
    problem = MarginalProblem((design.T @ design)[None], (data @ design)[None], *prior, owner, np.arange(count))
    return Problem(f"{count} random columns, shared {shared:g}", problem, np.full(owner.max() + 1, 1.0))


@cache
def problems():
    """All COUNT of them."""
    result = []
    for k, terms in enumerate(_TRIPOD):
        prior_scale, level = (_WEAK, _STRONG)[k % 2], (_NO_LEVEL, _HIGH_LEVEL)[k // 2 % 2]
        name = f"3-RRRU: {', '.join(term.effect for term in terms)}, discrepancy {DISCREPANCY_SCALES[level]:g}"
        result.append(_of_robot(name, tripod_evidence(), terms, prior_scale, level))
    for k, terms in enumerate(_ARM):
        name = f"arm: {', '.join(term.effect for term in terms)}"
        result.append(_of_robot(name, arm_evidence(), terms, (_STRONG, _WEAK)[k % 2], _NO_LEVEL))
    return result + [_random(k, *sizes) for k, sizes in enumerate(_RANDOM)]
