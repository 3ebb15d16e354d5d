"""Pairs of answers that a further run should separate, and the expected log Bayes factor, in nats, of further points.

If hypothesis A holds with its fitted parameters, its data y_A differ from the best fit of hypothesis B by

    I = min_b [ 1/2 |(y_A - X_B b) / sigma|^2 + 1/2 b' P b ]

nats, with the columns X_B of B, the noise sigma and the prior precision P of the coefficients b. I is the expected log
Bayes factor without the log determinants of both marginal likelihoods. Further points add to the normal equations that
I is computed from; the increase of I is their gain.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
import pandas as pd

from rrru.arrays import FloatArray
from rrru.diagnosis.hypothesis import Answer
from rrru.diagnosis.inference import InferenceResult
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.posterior import Posterior
from rrru.diagnosis.problem import DiagnosisProblem
from rrru.diagnosis.state import ModelState
from rrru.diagnosis.terms import signatures, spread
from rrru.diagnosis.verdict import Verdict, label


@dataclass(frozen=True)
class NormalEquations:
    """Normal equations of data y and a design X (k columns), both over the noise.

    precision (k, k): X'X and the prior precision; moment (k,): X'y; square: y'y. Those of further points are added.
    """

    precision: FloatArray
    moment: FloatArray
    square: float

    def __add__(self, other: "NormalEquations") -> "NormalEquations":
        return NormalEquations(self.precision + other.precision, self.moment + other.moment, self.square + other.square)

    def __sub__(self, other: "NormalEquations") -> "NormalEquations":
        return NormalEquations(self.precision - other.precision, self.moment - other.moment, self.square - other.square)

    @classmethod
    def of(cls, design: FloatArray, data: FloatArray, noise_mm: float) -> Self:
        """The NormalEquations of a design (n, 3, k) and data (n, 3) in mm under a noise per axis."""
        flat, target = design.reshape(-1, design.shape[-1]) / noise_mm, data.ravel() / noise_mm
        return cls(flat.T @ flat, flat.T @ target, float(target @ target))

    def misfit_nats(self) -> float:
        """Half of the least sum of squares, in nats: I of the module."""
        return float(_misfit_nats(self.precision[None], self.moment[None], np.array([self.square]))[0])

    def misfit_nats_with(self, others: Sequence["NormalEquations"]) -> FloatArray:
        """`misfit_nats` (c,) of the sum of these and each of c others."""
        precision = self.precision + np.array([other.precision for other in others])
        moment = self.moment + np.array([other.moment for other in others])
        return _misfit_nats(precision, moment, self.square + np.array([other.square for other in others]))

    def negative_log_evidence(self) -> float:
        """Minus the log marginal likelihood up to a constant: `misfit_nats` and half of the log determinant."""
        unit = 1.0 / np.sqrt(np.maximum(np.diag(self.precision), 1e-300))
        scaled = unit[:, None] * self.precision * unit + 1e-12 * np.eye(len(unit))
        return self.misfit_nats() + 0.5 * float(np.linalg.slogdet(scaled)[1] - 2.0 * np.log(unit).sum())


def _misfit_nats(precision: FloatArray, moment: FloatArray, square: FloatArray) -> FloatArray:
    """`NormalEquations.misfit_nats` (c,) of c of them: precision (c, k, k), moment (c, k), square (c,)."""
    unit = 1.0 / np.sqrt(np.maximum(np.einsum("cii->ci", precision), 1e-300))
    scaled = unit[:, :, None] * precision * unit[:, None, :] + 1e-12 * np.eye(moment.shape[1])
    moment = unit * moment
    solved = np.linalg.solve(scaled, moment[..., None])[..., 0]
    return np.asarray(0.5 * (square - (moment * solved).sum(axis=1)))


def present_and_planned(
    inference: InferenceResult, truth: Answer, rival: Answer, planned: DiagnosisProblem
) -> tuple[NormalEquations, list[NormalEquations]]:
    """NormalEquations of the present campaign with the prior, and of each run of a planned problem by number of run.

    The data are those that `truth` makes, the design is that of `rival`.

    truth, rival: the answers, each a hypothesis and the number of its discrepancy scale, see `Posterior.best_of`.
    """
    (hypothesis, level), (other, other_level) = truth, rival
    problem, evidence = inference.problem, inference.evidence
    terms = hypothesis.terms + other.terms
    # the errors of payload and tilt are the same in both answers
    keys = list(dict.fromkeys((term.effect, term.shape) for term in terms))
    here, planned = (without_unreachable(replace(one, nuisance_sd={}), inference.state) for one in (problem, planned))
    # both about one state: the linearisation of the evidence is that of the previous fit
    present, there = (one.linearise(inference.state, keys) for one in (here, planned))
    mean, _ = evidence.coefficients(hypothesis.terms, hypothesis.prior_scales[level], level)
    mean = mean[: sum(spread(problem.library[t.effect].coordinates, t.legs).shape[1] for t in hypothesis.terms)]
    simulated, designs = [], []
    for linear in (present, there):
        none = np.zeros((*linear.data.shape, 0))
        simulated.append(np.concatenate([none, *signatures(problem.library, linear, hypothesis.terms)], axis=-1) @ mean)
        designs.append(np.concatenate([linear.base, *signatures(problem.library, linear, other.terms)], axis=-1))
    penalty = np.zeros(designs[0].shape[-1])
    penalty[there.base.shape[-1] :] = evidence.scales(other.terms, other.prior_scales[other_level]) ** -2.0
    prior = NormalEquations(np.diag(penalty), np.zeros(len(penalty)), 0.0)
    now = NormalEquations.of(designs[0], simulated[0], problem.noise_mm) + prior
    runs = [planned.run == number for number in np.unique(planned.measurements["run"])]
    return now, [NormalEquations.of(designs[1][run], simulated[1][run], problem.noise_mm) for run in runs]


def realized_log_bayes_factors(inference: InferenceResult, truth: Answer, rival: Answer) -> dict[int, float]:
    """By number of run the log Bayes factor, in nats, that its readings added to those of all other runs.

    log p(d_r | others, A) - log p(d_r | others, B) of the linearised model, A truth, B rival; empty for one run.
    """
    problem = without_unreachable(replace(inference.problem, nuisance_sd={}), inference.state)
    answers = [(hypothesis.terms, hypothesis.prior_scales[level]) for hypothesis, level in (truth, rival)]
    keys = list(dict.fromkeys((term.effect, term.shape) for terms, _ in answers for term in terms))
    linear = problem.linearise(inference.state, keys)
    base = np.concatenate([linear.base, *linear.shape_columns.values()], axis=-1)
    runs = {number: problem.run == number for number in pd.unique(problem.run)}
    result = dict.fromkeys(runs, 0.0) if len(runs) > 1 else {}
    for sign, (terms, scales) in zip((1.0, -1.0), answers, strict=True):
        design = np.concatenate([base, *signatures(problem.library, linear, terms)], axis=-1)
        penalty = np.zeros(design.shape[-1])
        penalty[base.shape[-1] :] = inference.evidence.scales(terms, scales) ** -2.0
        parts = {
            number: NormalEquations.of(design[rows], linear.data[rows], problem.noise_mm)
            for number, rows in runs.items()
        }
        whole = sum(parts.values(), NormalEquations(np.diag(penalty), np.zeros(len(penalty)), 0.0))
        for number in result:
            result[number] += sign * ((whole - parts[number]).negative_log_evidence() - whole.negative_log_evidence())
    return result


def without_unreachable(problem: DiagnosisProblem, state: ModelState) -> DiagnosisProblem:
    """The problem without the points at which a state's model, with its effects or without them, has no pose."""
    left = [problem.residual(one) for one in (state, ModelState(state.deviations, {}))]
    lost = np.any([~np.isfinite(one).all(axis=1) for one in left], axis=0)
    return problem.without(lost) if lost.any() else problem


def choose_greedily(now: NormalEquations, candidates: Sequence[NormalEquations], count: int) -> tuple[list[int], float]:
    """Numbers of up to `count` candidates, each the one that adds most nats to those before it, and the gain of all.

    now: NormalEquations at the start; candidates: NormalEquations of each; the gain is that of `misfit_nats`.
    """
    chosen: list[int] = []
    start = now.misfit_nats()
    for _ in range(min(count, len(candidates))):
        left = [k for k in range(len(candidates)) if k not in chosen]
        best = left[int(now.misfit_nats_with([candidates[k] for k in left]).argmax())]
        chosen.append(best)
        now = now + candidates[best]
    return chosen, now.misfit_nats() - start


@dataclass(frozen=True)
class AnswerPair:
    """Two answers that a run should separate, as of `Posterior.best_of`, and both in words: "a+b / a+c".

    The data are simulated with truth, which has no fewer effects than rival: the smaller set could not make the data
    of the larger one.
    """

    separates: str
    truth: Answer
    rival: Answer


def answer_pairs(inference: InferenceResult, verdict: Verdict, sizes: Mapping[str, float]) -> list[AnswerPair]:
    """Up to `OPTIONS.max_advised_rivals` AnswerPairs of a Verdict, in the order in which they matter.

    First come the members of each group: the set with its most probable one against the set with another one instead.
    Then comes the verdict against the most probable answer with, or without, the uncertain cause of the largest part of
    the gap. Last come the nearest rivals of a verdict that is not sure. A verdict with something unexplained has those
    of groups alone: an effect outside of the library cannot be simulated. sizes: by effect the rms in mm of its part of
    the gap.
    """
    found: dict[frozenset[frozenset[str]], AnswerPair] = {}
    for favoured, other in _pairs(inference.posterior, verdict, sizes):
        if favoured and other and (pair := _answer_pair(favoured, other)):
            found.setdefault(frozenset((favoured[0].effects, other[0].effects)), pair)
        if len(found) == OPTIONS.max_advised_rivals:
            break
    return [*found.values()]


def _pairs(
    posterior: Posterior, verdict: Verdict, sizes: Mapping[str, float]
) -> Iterator[tuple[Answer | None, Answer | None]]:
    """Pairs of answers, the favoured one first; None for one of which there is no hypothesis."""
    effects = frozenset(verdict.effects)
    for group in verdict.groups:
        first, *others = group.names
        for other in others:
            yield (
                _answer(posterior, effects, (first,), (other,)),
                _answer(posterior, effects - {first} | {other}, (other,), (first,)),
            )
    if verdict.unexplained:
        return
    if uncertain := _uncertain_cause(posterior, verdict, sizes):
        acts = uncertain in effects
        # without a cause others may explain its part: its rival is the most probable answer without it
        yield (
            _answer(posterior, effects, *(((uncertain,), ()) if acts else ((), (uncertain,)))),
            posterior.best_where(lambda names: (uncertain in names) != acts),
        )
    if verdict.sure >= OPTIONS.min_sure_probability:
        return
    rivals = [frozenset(names) for names, flag, _ in verdict.rivals if not flag and frozenset(names) != effects]
    if not rivals:
        rivals = [names for names, flag in posterior.sets if not flag and names != effects]
    for names in rivals:
        yield posterior.best_of(effects), posterior.best_of(names)


def _answer(
    posterior: Posterior, effects: frozenset[str], within: Collection[str], without: Collection[str]
) -> Answer | None:
    """The answer of exactly these effects, else the most probable one with all of `within` and none of `without`."""
    found = posterior.best_of(effects)
    return found or posterior.best_where(lambda names: names.issuperset(within) and names.isdisjoint(without))


def _uncertain_cause(posterior: Posterior, verdict: Verdict, sizes: Mapping[str, float]) -> str:
    """The cause outside of groups, named or possible, that may act or not and makes most of the gap; "" for none."""
    grouped = {name for group in verdict.groups for name in group.names}
    causes = (*verdict.effects, *(name for name in verdict.possible if name not in ("none", "unexplained")))
    low = OPTIONS.min_possible_probability
    uncertain = {name: posterior.marginal(name) for name in dict.fromkeys(causes) if name not in grouped}
    uncertain = {name: p for name, p in uncertain.items() if low < p < 1.0 - low}
    return max(uncertain, key=lambda name: (sizes.get(name, 0.0), uncertain[name], name), default="")


def _answer_pair(favoured: Answer, other: Answer) -> AnswerPair | None:
    """The AnswerPair of two answers, None where both have the same effects."""
    names = [label(sorted(hypothesis.effects), False) for hypothesis, _ in (favoured, other)]
    if names[0] == names[1]:
        return None
    # a rival may be possible only together with a small discrepancy
    larger = len(favoured[0].terms) >= len(other[0].terms)
    return AnswerPair(" / ".join(names), *((favoured, other) if larger else (other, favoured)))


def apart(separates: str) -> tuple[set[str], set[str]]:
    """The effects, as two sets, that one of two answers "a+b / a+c" has and the other has not."""
    first, second = (set(side.split("+")) - {"none"} for side in separates.split(" / "))
    return first - second, second - first
