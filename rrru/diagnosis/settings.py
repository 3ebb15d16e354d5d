"""Settings of a diagnosis: which effects may act, known values of their parameters, prior, seed."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import comb
from typing import Any, Self

import numpy as np

from rrru.diagnosis.payload_nuisance import WEIGHT
from rrru.effects.library import HOLDS, NAMES, find
from rrru.effects.protocol import Effect
from rrru.errors import ConfigError
from rrru.kinematics.robot import Robot
from rrru.robots.catalogue import MECHANISMS

# replaces the names of the library in a configuration
ALL = "all"


@dataclass(frozen=True)
class Prior:
    """Prior over sets of effects: a mixture of robots with few effects and of robots with many small ones.

    counts: probabilities of zero, one, two and three effects where there are few; each further effect reduces the
    probability by the ratio of the last two. each: probability that an effect acts where there are many, equal and
    independent for all effects; share: of robots with many. unexplained: probability that something unexplained acts
    in addition. tolerance: share of what a set explains up to which a remaining discrepancy still counts as inaccuracy
    of the effect models.
    """

    counts: tuple[float, ...] = (0.3, 0.55, 0.13, 0.02)
    unexplained: float = 0.1
    tolerance: float = 0.04
    each: float = 0.1
    share: float = 0.5

    def log_set(self, count: int, library: int) -> float:
        """Logarithm of the probability of one set of so many effects of a library of so many."""
        few = self.log_count(count) - np.log(comb(library, count))
        as_they_are = count * np.log(self.each) + (library - count) * np.log1p(-self.each)
        with np.errstate(divide="ignore"):
            log_few, log_as_they_are = np.log([1.0 - self.share, self.share])
        return float(np.logaddexp(log_few + few, log_as_they_are + as_they_are))

    def log_count(self, count: int) -> float:
        """Logarithm of the probability of so many effects."""
        *_, last, most = self.counts
        listed = self.counts[min(count, len(self.counts) - 1)]
        return float(np.log(listed) + max(count + 1 - len(self.counts), 0) * np.log(most / last))


@dataclass(frozen=True)
class GapSettings:
    """effects: names or `module:object` of the effects that may act; known: effect to known values of its parameters,
    such as a gear ratio; prior; draws: resamplings for intervals; seed; use_near_singularity: fit points marked so.
    """

    effects: tuple[str, ...] = NAMES
    known: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    prior: Prior = field(default_factory=Prior)
    draws: int = 200
    seed: int = 0
    use_near_singularity: bool = True

    @classmethod
    def from_config(cls, section: dict[str, Any], seed: int = 0, use_near_singularity: bool = True) -> Self:
        """Settings of the configuration's `gap` section."""
        keys = ("prior_counts", "prior_unexplained", "tolerance", "prior_each", "prior_share")
        counts, *others = (section[key] for key in keys)
        prior = Prior(tuple(counts), *others)
        named = NAMES if section["effects"] == ALL else section["effects"]
        effects = *named, *section["own_effects"]
        return cls(effects, section["known"], prior, section["draws"], seed, use_near_singularity)

    def without(self, name: str) -> Self:
        """The settings with one effect taken out of the library, and without those that have it as a special case."""
        out = {name, *(general for general, held in HOLDS.items() if name in held)}
        return replace(self, effects=tuple(effect for effect in self.effects if effect not in out))

    def library(self, robot: Robot) -> dict[str, Effect]:
        """Effects by name that a robot may have, with known parameters fixed.

        Raises ConfigError for an unknown effect or parameter.
        """
        found = [effect for effect in (find(name, robot) for name in self.effects) if effect is not None]
        result = {effect.name: effect for effect in found}
        if len(result) < len(found):
            raise ConfigError(f"gap.effects names an effect twice: {', '.join(self.effects)}")
        for name, values in self.known.items():
            if name in result:
                result[name] = _with_known(result[name], values)
            elif name == WEIGHT:
                _check_weight(values)
            elif name not in self.effects:
                raise ConfigError(f"gap.known: no effect {name!r}; known: {', '.join((*result, WEIGHT))}")
        # legs are of one design, the joints of an arm are not
        alike = robot.legs.parallel
        return {name: replace(one, coordinates=replace(one.coordinates, alike=alike)) for name, one in result.items()}

    def nuisance_sd(self, nuisance_sd: Mapping[str, float]) -> dict[str, float]:
        """Standard deviations of the errors of payload and tilt by name, zero where they are known."""
        return {name: 0.0 if name in self.known.get(WEIGHT, {}) else sd for name, sd in nuisance_sd.items()}


def _check_weight(values: Mapping[str, float]) -> None:
    """Raise ConfigError for unknown names of payload and tilt, or for values that are not zero.

    Tilts about all axes are allowed: robots of one configuration may stand upright or hang on a wall.
    """
    allowed = ("extra_kg", *(f"lean_{axis}" for axis in "xyz"))
    if unknown := [name for name in values if name not in allowed]:
        raise ConfigError(f"gap.known: weight has no {unknown[0]!r}; allowed: {', '.join(allowed)}")
    if off := [name for name, value in values.items() if value]:
        raise ConfigError(f"gap.known: weight.{off[0]} is not 0; allowed: 0, as stated: state a mass with the campaign")


def _with_known(effect: Effect, values: Mapping[str, float]) -> Effect:
    """The effect with parameters of its shapes fixed to known values; raises ConfigError for an unknown parameter or a
    value beyond its bounds.
    """
    coordinates = effect.coordinates
    unknown = [key for key in values if key not in coordinates.shapes[0]]
    if unknown:
        allowed = ", ".join(coordinates.shapes[0]) or "none"
        raise ConfigError(f"gap.known: {effect.name} has no known {unknown[0]!r}; allowed: {allowed}")
    for key, value in values.items():
        one = effect.parameters[key]
        if not one.low <= value <= one.high:
            allowed = f"{one.low:g} to {one.high:g}" + f" {one.unit}" * (one.unit != "1")
            raise ConfigError(f"gap.known: {effect.name}.{key} is {value:g}; allowed: {allowed}")
    fixed = dict.fromkeys(tuple((dict(shape) | dict(values)).items()) for shape in coordinates.shapes)
    shapes = tuple(map(dict, fixed))
    # where all parameters are known none is fitted
    shape_sd = 0.0 if set(values) == set(shapes[0]) else coordinates.doubt
    return replace(effect, coordinates=replace(coordinates, shapes=shapes, searched=None, doubt=shape_sd))


def check(config: Mapping[str, Any]) -> None:
    """Raise ConfigError where the `gap` section names an effect or a parameter that does not exist."""
    for kind in MECHANISMS.values():
        GapSettings.from_config(config["gap"]).library(kind())
