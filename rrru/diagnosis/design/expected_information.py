"""What further points would tell about which of some answers holds.

If answer A holds with parameters a, its data y_A differ from the best fit of answer B by

    I = min_b [ 1/2 |(y_A - X_B b) / sigma|^2 + 1/2 b' P b ]

nats, with the columns X_B of B, the noise sigma and the prior precision P of the coefficients b. I is the expected log
Bayes factor without the log determinants of both marginal likelihoods, and what further points add to it is their gain
g. Where A is as probable as B, exp(-g) is what their odds are multiplied with. Of all pairs of answers,

    R = sum_AB w_AB E_a [1 - exp(-g_AB)],    w_AB ~ p_A p_B d_AB,    sum_AB w_AB = 1

is the part of the doubt that further points resolve: a pair counts as much as both are probable (Box and Hill,
Technometrics 9, 1967, eq. 14) and as far as their predictions of the planned points are apart, d_AB rms. The mean E is
over 2 r values of a, the mean plus and minus sqrt(r) standard deviations along the r principal axes of its covariance
(Julier and Uhlmann, Proceedings of the IEEE 92, 2004): an effect may be larger than present points show it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
import pandas as pd
from scipy.linalg import solve_triangular

from rrru.arrays import BoolArray, FloatArray, IntArray
from rrru.diagnosis.design.rival_answers import RivalAnswer
from rrru.diagnosis.hypothesis import Answer
from rrru.diagnosis.inference import InferenceResult
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.problem import DiagnosisProblem
from rrru.diagnosis.state import ModelState
from rrru.diagnosis.terms import signatures, spread


class Prediction:
    """What the best fit of an answer predicts of c candidates with up to m readings each, over the noise.

    errors (c, m, s): those of the prediction for s sets of data that other answers make; spread (c, m, k): of the
    prediction, with an identity covariance. Readings that a candidate lacks are 0 in both, and add nothing. now_nats
    (s,): I of the points before.
    """

    def __init__(self, errors: FloatArray, spread: FloatArray, now_nats: FloatArray) -> None:
        self.errors, self.spread, self.now_nats = errors, spread, now_nats

    @classmethod
    def of(
        cls,
        present: tuple[FloatArray, FloatArray],
        planned: Sequence[tuple[FloatArray, FloatArray]],
        precision: FloatArray,
    ) -> Self:
        """From designs (n, k) and data (n, s) of present points and of each candidate, over the noise.

        precision (k,): prior precision of the coefficients.
        """
        design, data = present
        unit, root = _factor(design, precision)
        moment = solve_triangular(root, unit[:, None] * (design.T @ data), lower=True)
        planned = [_condensed(*one) for one in planned]
        shape = len(planned), max(len(one) for one, _ in planned)
        errors, spreads = np.zeros((*shape, data.shape[1])), np.zeros((*shape, len(unit)))
        for number, (columns, simulated) in enumerate(planned):
            spreads[number, : len(columns)] = solve_triangular(root, (columns * unit).T, lower=True).T
            errors[number, : len(columns)] = simulated - spreads[number, : len(columns)] @ moment
        return cls(errors, spreads, 0.5 * ((data**2).sum(axis=0) - (moment**2).sum(axis=0)))

    def gains(self) -> FloatArray:
        """What each candidate adds to I (c, s), in nats."""
        if self.spread.shape[1] > self.spread.shape[2]:
            # as many numbers as coefficients, not as readings
            turned = self.spread.transpose(0, 2, 1)
            moment = turned @ self.errors
            solved = np.linalg.solve(turned @ self.spread + np.eye(self.spread.shape[2]), moment)
            return np.asarray(0.5 * ((self.errors**2).sum(axis=1) - (moment * solved).sum(axis=1)))
        variance = self.spread @ self.spread.transpose(0, 2, 1) + np.eye(self.spread.shape[1])
        return np.asarray(0.5 * (self.errors * np.linalg.solve(variance, self.errors)).sum(axis=1))

    def after(self, number: int, gains: FloatArray) -> "Prediction":
        """The Prediction after a candidate has been measured, whose gains (s,) are known."""
        own, error = self.spread[number], self.errors[number]
        root = np.linalg.cholesky(np.eye(own.shape[1]) + own.T @ own)
        moment = solve_triangular(root, own.T @ error, lower=True)
        spread = solve_triangular(root, self.spread.reshape(-1, len(root)).T, lower=True).T.reshape(self.spread.shape)
        return Prediction(self.errors - spread @ moment, spread, self.now_nats + gains)


def _condensed(design: FloatArray, data: FloatArray) -> tuple[FloatArray, FloatArray]:
    """A design (m, k) and data (m, s) turned into as few rows with the same products."""
    width = design.shape[1]
    if len(design) <= width + data.shape[1]:
        return design, data
    _, root = np.linalg.qr(np.concatenate([design, data], axis=1))
    return root[:, :width], root[:, width:]


@dataclass(frozen=True)
class Contests:
    """Pairs (q) of answers about the same candidates, and their weights w (q,).

    predictions: by rival answer, of the data that others make; owner (s,): number of the pair of each set of data of
    all predictions, in their order.
    """

    pairs: tuple[tuple[RivalAnswer, RivalAnswer], ...]
    weights: FloatArray
    predictions: tuple[Prediction, ...]
    owner: IntArray

    @property
    def first(self) -> int:
        """Number of the pair of the most probable answers."""
        return int(np.argmax([one.probability * other.probability for one, other in self.pairs]))

    @property
    def now_nats(self) -> FloatArray:
        """I (q,) of the points before."""
        return self.by_pair(np.concatenate([one.now_nats for one in self.predictions]))

    @property
    def _mean(self) -> FloatArray:
        """Matrix (s, q) of the mean over the sets of data of a pair."""
        one = self.owner[:, None] == np.arange(len(self.pairs))
        return np.asarray(one / one.sum(axis=0))

    def separates(self, number: int) -> str:
        """A pair of answers in words, "a+b / a+c"."""
        return " / ".join(one.words for one in self.pairs[number])

    def gains(self) -> FloatArray:
        """What each candidate adds to I (c, s), in nats."""
        return np.concatenate([one.gains() for one in self.predictions], axis=-1)

    def by_pair(self, gains: FloatArray) -> FloatArray:
        """Means (.., q) of gains (.., s)."""
        return np.asarray(gains @ self._mean)

    def resolved(self, gains: FloatArray) -> FloatArray:
        """The parts (.., q) of R of the module from gains (.., s)."""
        return np.asarray((1.0 - np.exp(-gains)) @ self._mean * self.weights)

    def after(self, number: int, gains: FloatArray) -> "Contests":
        """The Contests after a candidate has been measured, whose gains (s,) are known."""
        parts = np.split(gains, np.cumsum([len(one.now_nats) for one in self.predictions])[:-1])
        known = tuple(one.after(number, part) for one, part in zip(self.predictions, parts, strict=True))
        return replace(self, predictions=known)

    def choose(self, most: int) -> tuple[list[int], FloatArray]:
        """Numbers of up to `most` candidates, each the one that resolves most with those before it, and gains (s,).

        Beyond a few, none is added where enough of the doubt is resolved, or where one resolves too little of the rest.
        """
        chosen: list[int] = []
        left, total, share = self, np.zeros(len(self.owner)), 0.0
        while len(chosen) < min(most, len(self.predictions[0].errors)):
            gains = left.gains()
            shares = self.resolved(total + gains).sum(axis=-1)
            shares[chosen] = -1.0
            best = int(shares.argmax())
            little = shares[best] - share < OPTIONS.min_share_of_rest * (1.0 - share)
            if len(chosen) >= OPTIONS.few_poses and (little or share > OPTIONS.enough_share):
                break
            chosen.append(best)
            total, share = total + gains[best], float(shares[best])
            left = left.after(best, gains[best])
        return chosen, total


def contests(inference: InferenceResult, answers: Sequence[RivalAnswer], planned: DiagnosisProblem) -> Contests:
    """Contests of each pair of answers about the runs of a planned problem, in the order of their numbers.

    Of two answers that with more effects makes the data: the smaller set could not make those of the larger one.
    """
    problem = inference.problem
    ordered = sorted(answers, key=lambda one: -len(one.answer[0].terms))
    terms = [one.answer[0].terms for one in ordered]
    keys = list(dict.fromkeys((term.effect, term.shape) for some in terms for term in some))
    # the errors of payload and tilt are the same in all answers
    here, there = (without_unreachable(replace(one, nuisance_sd={}), inference.state) for one in (problem, planned))
    # both about one state: the linearisation of the evidence is that of the previous fit
    linear = [one.linearise(inference.state, keys) for one in (here, there)]
    runs = [there.run == number for number in np.unique(planned.measurements["run"])]
    pairs: list[tuple[RivalAnswer, RivalAnswer]] = []
    owner, predictions, apart = [], [], []
    made: list[list[FloatArray]] = []
    for place, rival in enumerate(ordered):
        columns = [signatures(problem.library, one, terms[place]) for one in linear]
        if place:
            widths = [0, *np.cumsum([one[0].shape[-1] for one in made])]
            data = [np.concatenate(some, axis=-1) / problem.noise_mm for some in zip(*made, strict=True)]
            designs = [
                np.concatenate([one.base, *some], axis=-1) / problem.noise_mm
                for one, some in zip(linear, columns, strict=True)
            ]
            prediction = _prediction(inference, rival, designs, data, runs)
            predictions.append(prediction)
            for number, truth in enumerate(ordered[:place]):
                sets = slice(widths[number], widths[number + 1])
                owner += [len(pairs)] * (sets.stop - sets.start)
                pairs.append((truth, rival) if truth.probability >= rival.probability else (rival, truth))
                errors = prediction.errors[..., sets]
                apart.append(np.sqrt((errors**2).sum() / max(errors.shape[-1] * data[1].size, 1)))
        if terms[place]:
            coefficients = _coefficients(inference, rival)
            made.append([np.concatenate(some, axis=-1) @ coefficients for some in columns])
    weights = np.prod([[one.probability for one in pair] for pair in pairs], axis=1) * apart
    total = weights.sum()
    return Contests(tuple(pairs), weights / (total if total > 0.0 else 1.0), tuple(predictions), np.array(owner))


def _coefficients(inference: InferenceResult, answer: RivalAnswer) -> FloatArray:
    """Sets of coefficients (k, 2 r) of an answer's effects with the mean and the covariance of its posterior.

    They are exact where r is k, else along the r largest principal axes over the prior's standard deviations.
    """
    (hypothesis, level), library = answer.answer, inference.problem.library
    mean, covariance = inference.evidence.coefficients(hypothesis.terms, hypothesis.prior_scales[level], level)
    count = sum(spread(library[term.effect].coordinates, term.legs).shape[1] for term in hypothesis.terms)
    unit = inference.evidence.scales(hypothesis.terms, hypothesis.prior_scales[level])
    variance, axes = np.linalg.eigh(covariance[:count, :count] / np.outer(unit, unit))
    largest = slice(max(count - OPTIONS.max_spread_axes, 0), None)
    steps = unit[:, None] * axes[:, largest] * np.sqrt(np.maximum(variance[largest], 0.0) * len(variance[largest]))
    return np.asarray(np.concatenate([mean[:count, None] + steps, mean[:count, None] - steps], axis=1))


def _prediction(
    inference: InferenceResult,
    answer: RivalAnswer,
    designs: Sequence[FloatArray],
    data: Sequence[FloatArray],
    runs: Sequence[BoolArray],
) -> Prediction:
    """The Prediction of an answer about runs (m,) of planned points.

    designs (n, 3, k), (m, 3, k) and data (n, 3, s), (m, 3, s): of the present and of the planned points.
    """
    hypothesis, level = answer.answer
    scales = inference.evidence.scales(hypothesis.terms, hypothesis.prior_scales[level])
    precision = np.zeros(designs[0].shape[-1])
    precision[len(precision) - len(scales) :] = scales**-2.0
    present, further = (
        (design.reshape(-1, design.shape[-1]), made.reshape(-1, made.shape[-1]))
        for design, made in zip(designs, data, strict=True)
    )
    rows = [np.repeat(run, 3) for run in runs]
    return Prediction.of(present, [(further[0][run], further[1][run]) for run in rows], precision)


def realized_log_bayes_factors(inference: InferenceResult, answers: Sequence[Answer]) -> dict[int, float]:
    """By number of run the log Bayes factor, in nats, that its readings added to those of all other runs.

    log p(d_r | others, A) - log p(d_r | others, B) of the linearised model, answers: A and B; empty for one run.
    """
    problem = without_unreachable(replace(inference.problem, nuisance_sd={}), inference.state)
    chosen = [(hypothesis.terms, hypothesis.prior_scales[level]) for hypothesis, level in answers]
    keys = list(dict.fromkeys((term.effect, term.shape) for terms, _ in chosen for term in terms))
    linear = problem.linearise(inference.state, keys)
    base = np.concatenate([linear.base, *linear.shape_columns.values()], axis=-1)
    runs = {number: problem.run == number for number in pd.unique(problem.run)}
    result = dict.fromkeys(runs, 0.0) if len(runs) > 1 else {}
    for sign, (terms, scales) in zip((1.0, -1.0), chosen, strict=True):
        design = np.concatenate([base, *signatures(problem.library, linear, terms)], axis=-1) / problem.noise_mm
        penalty = np.zeros(design.shape[-1])
        penalty[base.shape[-1] :] = inference.evidence.scales(terms, scales) ** -2.0
        whole = _negative_log_evidence(design, linear.data / problem.noise_mm, penalty)
        for number in result:
            others = ~runs[number]
            left = _negative_log_evidence(design[others], linear.data[others] / problem.noise_mm, penalty)
            result[number] += sign * (left - whole)
    return result


def _negative_log_evidence(design: FloatArray, data: FloatArray, precision: FloatArray) -> float:
    """Minus the log marginal likelihood, up to a constant, of a design (n, 3, k) and data (n, 3) over the noise."""
    flat, target = design.reshape(-1, len(precision)), data.ravel()
    unit, root = _factor(flat, precision)
    moment = solve_triangular(root, unit * (flat.T @ target), lower=True)
    misfit = 0.5 * float(target @ target - moment @ moment)
    return misfit + float(np.log(np.diag(root)).sum() - np.log(unit).sum())


def _factor(design: FloatArray, precision: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Units u (k,) and lower factor L (k, k) of normal equations, u (X^T X + P) u = L L^T; X: design, P: precision."""
    gram = design.T @ design + np.diag(precision)
    unit = 1.0 / np.sqrt(np.maximum(np.diag(gram), 1e-300))
    return unit, np.asarray(np.linalg.cholesky(unit[:, None] * gram * unit + 1e-12 * np.eye(len(unit))), dtype=float)


def without_unreachable(problem: DiagnosisProblem, state: ModelState) -> DiagnosisProblem:
    """The problem without the points at which a state's model, with its effects or without them, has no pose."""
    left = [problem.residual(one) for one in (state, ModelState(state.deviations, {}))]
    lost = np.any([~np.isfinite(one).all(axis=1) for one in left], axis=0)
    return problem.without(lost) if lost.any() else problem
