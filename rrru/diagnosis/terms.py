"""Terms of hypotheses: one effect with fixed shape parameters, on all legs, with one value for all, or on some legs."""

from collections.abc import Collection, Sequence
from typing import NamedTuple

import numpy as np

from rrru.arrays import FloatArray
from rrru.diagnosis.discrepancy_basis import UNKNOWN, Library, TestedEffect
from rrru.diagnosis.state import LinearizedProblem
from rrru.effects.protocol import Coordinates, Motion
from rrru.kinematics.chain import active_sites

# on which legs an effect acts: on each with its own value, on all with one value, on one leg alone, or on some legs, in
# order, each with its own value
EACH, SAME = "each", "same"
OnLegs = str | int | tuple[int, ...]


class EffectTerm(NamedTuple):
    """One effect of a hypothesis, a tuple since sets of terms are looked up a hundred thousand times.

    effect: its name; shape: number of the values of its nonlinear parameters in `Coordinates.shapes`, such as a gear
    ratio; legs: EACH, SAME, the number of the one leg that it acts on, or those of some of them.
    """

    effect: str
    shape: int = 0
    legs: OnLegs = EACH


def spread(coordinates: Coordinates, legs: OnLegs) -> FloatArray:
    """Matrix (c, k) from the k free coefficients of a term on these legs to the effect's c coordinates."""
    every = np.eye(len(coordinates))
    if legs == EACH:
        return every
    if legs == SAME:
        # coordinates of one kind come in the order of the legs
        return np.asarray(
            np.stack([every[:, coordinates.legs == leg] for leg in np.unique(coordinates.legs)]).sum(axis=0)
        )
    return every[:, np.isin(coordinates.legs, legs)]


def shape_probabilities(coordinates: Coordinates) -> FloatArray:
    """Prior probabilities (shapes,) of the shapes of an effect, alike where it states none."""
    count = len(coordinates.shapes)
    return np.asarray(coordinates.weights or np.full(count, 1.0 / count))


def each_leg(term: EffectTerm) -> EffectTerm:
    """The term with a value of its own for each leg where it has one value for all of them."""
    return term._replace(legs=EACH) if term.legs == SAME else term


def per_leg(effect: TestedEffect) -> bool:
    """Whether every coordinate of an effect belongs to one leg."""
    return bool((effect.coordinates.legs > 0).all())


def legs_alike(effect: TestedEffect) -> bool:
    """Whether an effect has the same number of coordinates on each leg, so that all legs may share one value."""
    legs = effect.coordinates.legs
    return per_leg(effect) and len(np.unique(np.unique(legs, return_counts=True)[1])) == 1


def variants(effect: TestedEffect) -> tuple[EffectTerm, ...]:
    """All terms of an effect: each shape with each choice of legs that makes a difference.

    One value for all legs is tried for coordinates that cannot be negative: sizes of one design, unlike the signed
    errors of an assembly, and unlike the joints of an arm; and for those that all drives may have in common. An effect
    of a single leg acts on that one.
    """
    coordinates = effect.coordinates
    legs: list[OnLegs] = np.unique(coordinates.legs).tolist() if per_leg(effect) else []
    same = legs_alike(effect) and (coordinates.common or (coordinates.alike and coordinates.positive.all()))
    choices = legs if len(legs) == 1 else [EACH, *([SAME] if same else []), *legs]
    return tuple(EffectTerm(effect.name, shape, one) for shape in range(len(coordinates.shapes)) for one in choices)


def may_be_on_some(effect: TestedEffect) -> bool:
    """Whether an effect may act on some of a robot's legs: on several of them and not on all.

    Not one with a distribution of many coefficients for every leg, whose sets would take too long.
    """
    coordinates = effect.coordinates
    return per_leg(effect) and not (coordinates.broad or coordinates.sized) and len(np.unique(coordinates.legs)) > 2


def on_neighbouring_legs(effect: TestedEffect, term: EffectTerm) -> tuple[EffectTerm, ...]:
    """The terms of an effect that act on one leg more or less than a term, some legs or each; none for other terms.

    A single leg and each of them are among `variants`; from them these lead to some of them.
    """
    if term.legs == SAME or not may_be_on_some(effect):
        return ()
    every = np.unique(effect.coordinates.legs).tolist()
    present = every if term.legs == EACH else np.atleast_1d(np.array(term.legs)).tolist()
    changed = [sorted({*present} ^ {leg}) for leg in every]
    return tuple(term._replace(legs=_as_legs(legs, len(every))) for legs in changed if legs)


def _as_legs(legs: list[int], count: int) -> OnLegs:
    """Some of a number of legs as a term has them."""
    return EACH if len(legs) == count else legs[0] if len(legs) == 1 else tuple(legs)


def legs_text(legs: OnLegs) -> str:
    """Legs of a term in a table: each, same, 2, or "2 and 5"."""
    return " and ".join(map(str, legs)) if isinstance(legs, tuple) else str(legs)


def signatures(library: Library, linear: LinearizedProblem, terms: Sequence[EffectTerm]) -> list[FloatArray]:
    """Columns (n, 3, k) of the linearised model by the free coefficients of each term."""
    pairs = ((linear.columns[term.effect, term.shape], term) for term in terms)
    return [
        columns if term.legs == EACH else columns @ spread(library[term.effect].coordinates, term.legs)
        for columns, term in pairs
    ]


def known_basis(library: Library, linear: LinearizedProblem, terms: Sequence[EffectTerm]) -> FloatArray:
    """Orthonormal basis (3n, b) of the calibration and of the terms that are no functions of many coefficients."""
    known = [term for term in terms if term.effect not in UNKNOWN and not library[term.effect].coordinates.broad]
    columns = np.concatenate([linear.base, *signatures(library, linear, known)], axis=-1)
    return np.linalg.qr(columns.reshape(linear.data.size, -1))[0]


def sites(library: Library, motion: Motion, term: EffectTerm, legs: Collection[int] | None = None) -> list[str]:
    """Names of the robot's sites at which a term acts along a motion; legs: it acts on these only, None for all."""
    effect = library[term.effect]
    sizes = effect.coordinates.typical * spread(effect.coordinates, term.legs).sum(axis=1)
    if legs is not None:
        sizes = np.where(np.isin(effect.coordinates.legs, [*legs]), sizes, 0.0)
    values = effect.coordinates.to_values(sizes, effect.coordinates.shapes[term.shape])
    active = active_sites(np.nan_to_num(effect.contribute(motion, values).twists))
    return [name for name, acts in zip(motion.robot.legs.sites, active, strict=True) if acts]
