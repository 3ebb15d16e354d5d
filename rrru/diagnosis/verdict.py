"""The decision of a diagnosis: which causes are named, which are confounded, and which leg is at fault.

A decision is not a probability. A cause is named where its posterior probability is at least
`OPTIONS.min_named_probability` = p: naming a cause that does not act then costs as much as missing

    p / (1 - p)

causes that do. Confounded causes form a group where none is that probable alone, but one of them acts with that
probability. They exclude each other, since each explains what the others would. The most probable one represents the
group wherever a model is needed.

No cause is named where the best answer does not describe its readings at all. Lengths in mm, angles in rad.
"""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from rrru.campaign.noise import repeat_noise
from rrru.diagnosis.aliases import CauseSet
from rrru.diagnosis.inference import InferenceResult
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.posterior import Posterior
from rrru.diagnosis.problem import GEOMETRY
from rrru.diagnosis.terms import per_leg
from rrru.effects.protocol import Effect

_NONE: CauseSet = (frozenset(), False)
# decisions on a cause, as the tables have them
NAMED, GROUPED, POSSIBLE, EXCLUDED, NOT_TESTED = "named", "group", "possible", "excluded", "not tested"


@dataclass(frozen=True)
class Group:
    """Confounded causes, of which one acts, the most probable first, and the probability that one of them acts."""

    names: tuple[str, ...]
    probability: float


@dataclass(frozen=True)
class Verdict:
    """effects: names in order of share, () for none, of a group the most probable one; unexplained: no effect
    explains a part; probability: that exactly these act; leg: the one that is at fault, from 1 on, else 0;
    possible: what may act and has no name, "unexplained" and "none" among it, the most probable first; rivals: other
    answers that the data leave open, each (names, unexplained, probability); groups: of confounded causes; no_answer:
    why the fit allows none, else empty; sure: probability of the least sure of the decisions on single causes.
    """

    effects: tuple[str, ...]
    unexplained: bool
    probability: float
    leg: int
    possible: tuple[str, ...]
    rivals: tuple[tuple[frozenset[str], bool, float], ...]
    groups: tuple[Group, ...] = ()
    no_answer: str = ""
    sure: float = 0.0

    @property
    def label(self) -> str:
        """The answer as the table gives it."""
        return label(self.effects, self.unexplained)

    @property
    def confounded_with(self) -> tuple[str, ...]:
        """Causes that may act and are not in the answer: the others of its groups, and those that are possible."""
        grouped = [name for group in self.groups for name in group.names[1:]]
        return tuple(name for name in dict.fromkeys([*grouped, *self.possible]) if name not in self.effects)

    def group_of(self, name: str) -> Group | None:
        """The Group that a cause belongs to, None for none."""
        return next((group for group in self.groups if name in group.names), None)

    def decision(self, name: str) -> str:
        """The decision on a tested cause: NAMED, GROUPED, POSSIBLE or EXCLUDED.

        Causes of the most probable answer where none is probable enough for a name are POSSIBLE.
        """
        if self.group_of(name):
            return GROUPED
        if name in self.possible:
            return POSSIBLE
        chosen = name in self.effects or (name == "unexplained" and self.unexplained) or name == self.label
        return NAMED if chosen else EXCLUDED


def without_answer(why: str) -> Verdict:
    """The Verdict on a fit that describes its readings too badly for any answer, see `why_no_answer`."""
    return Verdict((), True, 1.0, 0, (), (), (), why)


def label(effects: Iterable[str], unexplained: bool) -> str:
    """Names joined by +, with "unexplained" last; "none" for nothing."""
    return "+".join((*effects, *(("unexplained",) if unexplained else ()))) or "none"


def decide(posterior: Posterior, library: Mapping[str, Effect], small: Collection[str] = frozenset()) -> Verdict:
    """Verdict of a Posterior; library: the effects that may be named, by name; small: those that are not, see below.

    Nothing is named as long as "none" has a probability of 0.2: a false alarm costs more than a gap too small to
    matter. Where something acts and no cause is probable enough, or the named ones alone are excluded, the most
    probable answer that holds these is given, and its further causes are called possible. Something is unexplained
    where that is more probable than not; an effect that makes a small part of the gap may then be a part of that.
    """
    sets, unknown = posterior.sets, posterior.probability_unexplained
    none = sets.get(_NONE, 0.0)
    marginal = {name: posterior.marginal(name) for name in library}
    order = sorted(marginal, key=lambda name: (-marginal[name], name))
    groups: tuple[Group, ...] = ()
    effects: tuple[str, ...] = ()
    unexplained = False
    if none <= OPTIONS.max_none_probability:
        unexplained = unknown > OPTIONS.min_unexplained_probability
        order = [name for name in order if not (unexplained and name in small)]
        effects = tuple(name for name in order if marginal[name] >= OPTIONS.min_named_probability)
        groups = _groups(posterior, [name for name in order if name not in effects], marginal)
        effects += tuple(group.names[0] for group in groups)
        if not unexplained:
            effects, unexplained = _completed(sets, effects, groups)
    named = {name for name in effects if marginal[name] >= OPTIONS.min_named_probability}
    chosen = frozenset(effects), unexplained
    # with something unexplained more effects may act, as a part of that
    answers = {key for key in sets if key == chosen or (unexplained and key[1] and key[0] >= chosen[0])}
    probability = sum(p for key, p in sets.items() if key in answers)
    grouped = {name for group in groups for name in group.names}
    firsts = {group.names[0] for group in groups}
    open_ones = {name: p for name, p in marginal.items() if name not in named | firsts}
    open_ones |= {"none": none, "unexplained": unknown}
    taken = {"unexplained"} if unexplained else set() if effects else {"none"}
    least = OPTIONS.min_possible_probability
    # one cause of a group is as sure as it is among its rivals
    decisions = [
        p if name in effects else 1.0 - p for name, p in marginal.items() if name in effects or name not in grouped
    ]
    decisions += [1.0 - open_ones[name] for name in ("none", "unexplained") if name not in taken]
    possible = sorted((-p, name) for name, p in open_ones.items() if p > least and name not in taken)
    rivals = [(*key, p) for key, p in sets.items() if key not in answers]
    return Verdict(
        effects,
        unexplained,
        float(min(probability, 1.0)),
        _leg(posterior, effects, library),
        tuple(name for _, name in possible),
        tuple(rival for rival in rivals if rival[2] > OPTIONS.min_rival_probability_ratio * probability),
        groups,
        sure=float(min(decisions)),
    )


def _completed(
    sets: Mapping[CauseSet, float], effects: tuple[str, ...], groups: tuple[Group, ...]
) -> tuple[tuple[str, ...], bool]:
    """Effects of the answer, and whether something is unexplained, where those that are named cannot be all that acts.

    sets: probability of each set; effects: the named ones with the first of each group, () for none.
    """
    members = {name for group in groups for name in group.names}
    named = frozenset(effects) - members
    alone = sum(p for (acting, flag), p in sets.items() if not flag and named <= acting <= named | members)
    firsts = frozenset(effects)
    with_these = [key for key in sets if key != _NONE and key[0] >= firsts]
    if (effects and alone > OPTIONS.min_possible_probability) or not with_these:
        return effects, False
    best = max(with_these, key=lambda key: sets[key])
    return (*effects, *sorted(best[0] - firsts - members)), best[1]


def _groups(posterior: Posterior, names: Iterable[str], marginal: Mapping[str, float]) -> tuple[Group, ...]:
    """Groups among names that are not named, the most probable first: those that exclude each other.

    marginal: probability of each name.
    """
    left, found = [name for name in names if marginal[name] > OPTIONS.min_possible_probability], []
    while left:
        members = [left[0]]
        for name in left[1:]:
            excluded = all(_exclude(posterior, marginal, name, member) for member in members)
            if len(members) < OPTIONS.max_group_size and excluded:
                members.append(name)
        # as few as make it sure
        while len(members) > 2 and posterior.any_of(members[:-1]) >= OPTIONS.min_sure_probability:
            members.pop()
        together = posterior.any_of(members)
        if len(members) > 1 and together >= OPTIONS.min_named_probability:
            found.append(Group(tuple(members), float(together)))
            left = [name for name in left if name not in members]
        else:
            left = left[1:]
    return tuple(found)


def _exclude(posterior: Posterior, marginal: Mapping[str, float], first: str, second: str) -> bool:
    """Whether two causes act together much less often than if they were independent."""
    return posterior.both(first, second) < OPTIONS.max_joint_probability_ratio * marginal[first] * marginal[second]


def _leg(posterior: Posterior, effects: Iterable[str], library: Mapping[str, Effect]) -> int:
    """The one leg that all effects with legs of their own name, 0 where there is none."""
    likely = [posterior.legs(name) for name in effects if per_leg(library[name])]
    best = {max(legs.items(), key=lambda item: item[1])[0] for legs in likely if legs}
    leg = best.pop() if len(best) == 1 else 0
    return leg if isinstance(leg, int) else 0


def why_no_answer(inference: InferenceResult, stated_mm: float | None = None) -> str:
    """Why no cause can be named, in words; empty where the fit of the best answer may be read.

    A fit whose geometric errors end at their bounds has its minimum outside of all plausible robots. A fit with
    residuals of many times the noise has a model of another robot, or readings of another campaign. stated_mm: noise
    per axis, None where it is not stated.
    """
    return "; ".join(filter(None, (_at_bounds(inference), _far_off(inference, stated_mm))))


def _at_bounds(inference: InferenceResult) -> str:
    """Which geometric errors end at bounds, in words; empty where none."""
    estimate, parameters = inference.fit.estimate, inference.problem.mechanism.parameters
    held = np.flatnonzero(estimate.at_bound[estimate.parameters.slices[GEOMETRY]])
    if not len(held):
        return ""
    values = estimate.block(GEOMETRY)
    shown = [
        f"{parameters.names[k]} = {values[k]:.3g} {parameters.units[k]}" for k in held[: OPTIONS.max_listed_numbers]
    ]
    more = f" and {len(held) - len(shown)} more" if len(held) > len(shown) else ""
    return f"the fit ends at bounds of calibration parameters ({', '.join(shown)}{more})"


def _far_off(inference: InferenceResult, stated_mm: float | None) -> str:
    """How far the best answer is from the readings, in words; empty where that is less than many times the noise."""
    problem = inference.problem
    left = float(np.sqrt((problem.residual(inference.state) ** 2).sum(axis=1).mean()))
    repeated, count = repeat_noise(problem.measurements[problem.used])
    axis_mm = max(stated_mm or problem.noise_mm, repeated if count else 0.0)
    noise = float(np.sqrt(3.0) * axis_mm)
    if left <= OPTIONS.max_left_per_noise * noise:
        return ""
    return f"the residual of the best answer is {left:.3g} mm rms, {left / noise:.0f} times the noise of {noise:.2g} mm"
