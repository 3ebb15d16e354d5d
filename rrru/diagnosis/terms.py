"""Terms of hypotheses: one effect with fixed shape parameters, on all legs, with one value for all, or on one leg."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rrru.arrays import FloatArray
from rrru.diagnosis.discrepancy_basis import Library, TestedEffect
from rrru.diagnosis.state import LinearizedProblem
from rrru.effects.protocol import Coordinates, Motion
from rrru.kinematics.chain import active_sites

# on which legs an effect acts: on each with its own value, on all with one value, or on one leg alone
EACH, SAME = "each", "same"


@dataclass(frozen=True)
class EffectTerm:
    """One effect of a hypothesis.

    effect: its name; shape: number of the values of its nonlinear parameters in `Coordinates.shapes`, such as a gear
    ratio; legs: EACH, SAME or the number of the one leg that it acts on.
    """

    effect: str
    shape: int = 0
    legs: str | int = EACH


def spread(coordinates: Coordinates, legs: str | int) -> FloatArray:
    """Matrix (c, k) from the k free coefficients of a term on these legs to the effect's c coordinates."""
    every = np.eye(len(coordinates))
    if legs == EACH:
        return every
    if legs == SAME:
        # coordinates of one kind come in the order of the legs
        return np.asarray(
            np.stack([every[:, coordinates.legs == leg] for leg in np.unique(coordinates.legs)]).sum(axis=0)
        )
    return every[:, coordinates.legs == legs]


def shape_probabilities(coordinates: Coordinates) -> FloatArray:
    """Prior probabilities (shapes,) of the shapes of an effect, alike where it states none."""
    count = len(coordinates.shapes)
    return np.asarray(coordinates.weights or np.full(count, 1.0 / count))


def each_leg(term: EffectTerm) -> EffectTerm:
    """The term with a value of its own for each leg where it has one value for all of them."""
    return replace(term, legs=EACH) if term.legs == SAME else term


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
    errors of an assembly, and unlike the joints of an arm.
    """
    coordinates, legs = effect.coordinates, per_leg(effect)
    choices = (
        EACH,
        *((SAME,) if legs_alike(effect) and coordinates.alike and coordinates.positive.all() else ()),
        *(np.unique(coordinates.legs).tolist() if legs else ()),
    )
    return tuple(EffectTerm(effect.name, shape, legs) for shape in range(len(coordinates.shapes)) for legs in choices)


def signatures(library: Library, linear: LinearizedProblem, terms: Sequence[EffectTerm]) -> list[FloatArray]:
    """Columns (n, 3, k) of the linearised model by the free coefficients of each term."""
    pairs = ((linear.columns[term.effect, term.shape], term) for term in terms)
    return [
        columns if term.legs == EACH else columns @ spread(library[term.effect].coordinates, term.legs)
        for columns, term in pairs
    ]


def sites(library: Library, motion: Motion, term: EffectTerm, legs: Collection[int] | None = None) -> list[str]:
    """Names of the robot's sites at which a term acts along a motion; legs: it acts on these only, None for all."""
    effect = library[term.effect]
    sizes = effect.coordinates.typical * spread(effect.coordinates, term.legs).sum(axis=1)
    if legs is not None:
        sizes = np.where(np.isin(effect.coordinates.legs, [*legs]), sizes, 0.0)
    values = effect.coordinates.to_values(sizes, effect.coordinates.shapes[term.shape])
    active = active_sites(np.nan_to_num(effect.contribute(motion, values).twists))
    return [name for name, acts in zip(motion.robot.legs.sites, active, strict=True) if acts]
