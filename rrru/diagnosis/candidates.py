"""Log evidence that every single term adds to a set of terms, at all its prior scales, those of the set unchanged.

Once the coefficients of a set have been averaged over, the Gram matrix and the moments of all other columns are

    G' = G - W^T W,  g' = g - G_x a,  W = L^-1 S G_x,  L L^T = I + S G_xx S

with the set's columns x, its prior deviations S and its most probable coefficients a. Each term then is a small block
of them. Errors of payload and tilt count in the set and not in the term, and signs of the set's coefficients are those
of a: it is for choosing sets, not for weighing them.
"""

from functools import cached_property

import numpy as np
from scipy.linalg import solve_triangular

from rrru.diagnosis.evidence import PRIOR_SCALES
from rrru.diagnosis.evidence_kernels import log_evidence_of_blocks
from rrru.diagnosis.marginal_problem import posterior_mean


class Candidates:
    """All terms that may be added to a set.

    evidence: a ModelEvidence; terms: Terms whose effects are in its library.
    """

    def __init__(self, evidence, terms):
        self._evidence = evidence
        broad = [evidence.library[term.effect].coordinates.broad for term in terms]
        self._broad = [term for term, many in zip(terms, broad, strict=True) if many]
        self.terms = [*(term for term, many in zip(terms, broad, strict=True) if not many), *self._broad]

    @cached_property
    def _blocks(self):
        """Terms of few coefficients: columns' numbers (n,), ends (c + 1,), deviations (s, n), positive (n,)."""
        few = self.terms[: len(self.terms) - len(self._broad)]
        priors = [self._evidence.priors_of((term,)) for term in few]
        sizes = [sum(len(prior.index) for prior in of_term) for of_term in priors]
        if not priors:
            return (
                np.zeros(0, dtype=int),
                np.zeros(1, dtype=int),
                np.zeros((len(PRIOR_SCALES), 0)),
                np.zeros(0, dtype=bool),
            )
        scale = [
            np.concatenate([of_term[0].at(prior_scale), *(prior.size for prior in of_term[1:])])
            for of_term in priors
            for prior_scale in PRIOR_SCALES
        ]
        rows = [np.concatenate(scale[k :: len(PRIOR_SCALES)]) for k in range(len(PRIOR_SCALES))]
        numbers, positive = (
            np.concatenate([getattr(prior, name) for of_term in priors for prior in of_term])
            for name in ("index", "positive")
        )
        return numbers, np.cumsum([0, *sizes]), np.array(rows), positive

    def gains(self, terms, prior_scales, level):
        """Log evidence (c, s) that each of `self.terms` adds at PRIOR_SCALES to a set at its prior scales and a level.

        -inf for terms of effects that the set has.
        """
        evidence = self._evidence
        taken = {term.effect for term in terms}
        result = np.full((len(self.terms), len(PRIOR_SCALES)), -np.inf)
        numbers, ends, scale, positive = self._blocks
        gram, moment, across = self._left(terms, prior_scales, level)
        few = log_evidence_of_blocks(gram, moment, across, numbers, ends, scale, positive)
        result[: len(few)] = few
        present = None
        for row, term in enumerate(self.terms):
            # columns of an effect that the set has are gone
            if term.effect in taken:
                result[row] = -np.inf
            elif row >= len(few):
                grids = [[prior_scale] for prior_scale in prior_scales]
                if present is None:
                    present = evidence.over_strengths(terms, grids, [level])[0][0, 0] if terms else evidence.none[level]
                result[row] = evidence.over_strengths((*terms, term), (*grids, PRIOR_SCALES), [level])[0][0] - present
        return result

    def _left(self, terms, prior_scales, level):
        """Gram matrix (K, K), moments (K,) and across (K, x): what a set leaves is the first less across across^T."""
        gram, across, moment, problem, scale = self._evidence.remaining_columns(terms, prior_scales, level)
        if problem is None:
            return gram, moment, across
        shared = problem.of_coefficients(gram[problem.index] - across[problem.index] @ across.T)
        factor = np.linalg.cholesky(scale[:, None] * problem.gram[0] * scale + np.eye(len(scale)))
        half = solve_triangular(factor, scale[:, None] * shared, lower=True, check_finite=False)
        moment = moment - posterior_mean(problem, scale) @ shared
        return gram, moment, np.ascontiguousarray(np.concatenate([across, half.T], axis=1))
