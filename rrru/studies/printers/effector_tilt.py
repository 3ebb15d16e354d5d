"""Test for a tilted effector: unequal rods of an arm tilt the platform, and a probe at an offset reads a bed shape.

Where the two rods of arm i, a distance s apart along the tangent t_i, differ in length by d_i, the platform rotates by
w and its point in the joints' plane moves by v, to first order (n_i: down the arm, u_i: to its joints at the distance
r)

    (t_i x n_i) . w = d_i / s,    n_i . v = -r n_i . (w x u_i)

A probe at the offset o is v_z + (w x o)_z higher than in the model. Every effect that is smooth over the bed may be
confounded with it: arms of other lengths than saved, leaning towers, a bed bent to second order, the zero of the probe.
The slope of a bed is a gradient and the tilt is not, so that probing on three sides of the nozzle separates them. All
of them are fitted together with the tilt, and an F test gives the probability that noise explains as much as the tilt,
see `cause_tests`. The power of the readings is known before the test: the probability that 0.1 mm on any one arm
passes.

Where the readings do not decide, the answer names further readings that would.

# ASSUME distances of rods and joints as in `rrru.robots.linear_delta`, the nozzle in the joints' plane
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import stats
from scipy.spatial.transform import Rotation

from rrru.estimation.f_test import largest_p
from rrru.estimation.observations.combined import WithColumns
from rrru.estimation.parameters import Block, Parameters
from rrru.estimation.problem import Problem, WhiteNoise
from rrru.estimation.solver import solve
from rrru.studies.printers.cause_tests import arm_columns, lean_columns, noise_sds
from rrru.studies.printers.printer_fit import PrinterFit, even_places

# the difference of an arm's rods for which the power is computed
SHOWN_MM = 0.1
# ASSUME repeatability of a probe, where the readings do not determine it
PROBE_MM = 0.01
# ASSUME prior s.d. of the bed's bending, and of the zero of a probe that was moved
BED_MM = 1.0
# lower limit of the noise, for simulated readings without noise
_LEAST_NOISE_MM = 1e-3
_CONFIDENCE = 0.95
# ASSUME noise of a height measured by hand, over that of a probed one
_BY_HAND = (1.0, 2.0, 4.0)
# least power for a difference of SHOWN_MM with which readings decide
_POWER = 0.9
# numbers of places for further probing, more than the firmware's own seven
_COUNTS = (19, 37, 100)


def tilts(robot, places, actuators, deviations):
    """Rotation (n, 3, 3) in rad and translation (n, 3, 3) in mm of the platform at places (n, 3), per mm of difference
    between each arm's rods.
    """
    arms = robot.link_directions(places, actuators, deviations)
    turn = np.linalg.inv(np.cross(robot.tangent, arms)) / robot.spacing_mm
    carried = np.cross(np.moveaxis(turn, 2, 1)[:, None], robot.radial[:, None])
    return turn, np.linalg.solve(arms, -robot.r_mm * np.einsum("nia,nika->nik", arms, carried))


@dataclass(frozen=True)
class TiltTest:
    """The test of a PrinterFit for a tilted effector.

    probe_mm (n, 2): offsets of the probe at the heights. noise_mm: of a reading of weight 1, by default from the
    readings.
    """

    result: PrinterFit
    probe_mm: np.ndarray
    noise_mm: float | None = None

    @cached_property
    def places(self):
        """Places of the nozzle, see `ProbedHeights.places`."""
        return self.result.residuals.places(self.result.fit.deviations)

    @cached_property
    def columns(self):
        """Derivative (n, 3) of the readings by the difference of each arm's rods, per mm."""
        residuals, heights = self.result.residuals, len(self.probe_mm)
        turn, shift = tilts(residuals.mechanism, self.places, residuals.actuators, self.result.fit.deviations)
        changes = np.einsum("rna,nak->rk", residuals.gradient(self.places), shift)
        x, y = self.probe_mm.T[..., None]
        changes[:heights] += y * turn[:heights, 0] - x * turn[:heights, 1]
        return changes

    @cached_property
    def rivals(self):
        """Derivatives (n, k) of the readings by the effects that are confounded with a tilt."""
        arms = () if len(self.result.residuals.distance_mm) else (arm_columns(self.result),)
        return np.concatenate([*arms, lean_columns(self.result), self.bed], axis=1)

    @cached_property
    def bed(self):
        """Derivatives (n, k) of the readings by the zero of every probe offset, and by three shapes of the bed."""
        kinds = np.unique(self.probe_mm, axis=0)
        zeros = (self.probe_mm[:, None] == kinds[1:]).all(axis=2).astype(float)
        x, y = (self.places[: len(self.probe_mm), :2] + self.probe_mm).T
        shapes = np.stack([x**2 + y**2, x**2 - y**2, 2.0 * x * y], axis=1) / np.hypot(x, y).max() ** 2
        return self._of_heights(np.concatenate([zeros, shapes], axis=1))

    def with_bent_bed(self):
        """The test about the answer of a joint estimation with the bed's bending.

        An answer for a flat bed would rotate and stretch the places under the probe.
        """
        result, residuals = self.result, self.result.residuals
        columns = (self.bed * residuals.root_weight[:, None])[:, None]
        names = [f"bed_{k}" for k in range(columns.shape[-1])]
        bed = Block.of("bed", names, ["mm"] * len(names), BED_MM)
        parameters = Parameters((Block.geometry(residuals.mechanism.parameters), bed))
        noise = WhiteNoise(max(result.fit.noise_mm, _LEAST_NOISE_MM))
        start = np.append(result.fit.deviations, bed.mean)
        found = solve(Problem(WithColumns(residuals, columns), parameters, noise), [start])
        return replace(self, result=replace(result, fit=result.fit.at(found.block("geometry"), "with a bent bed")))

    def _of_heights(self, columns):
        """Columns (heights, k) with zeros (n, k) for the distances."""
        return np.pad(columns, ((0, len(self.result.residuals) - len(columns)), (0, 0)))

    @cached_property
    def _models(self):
        """LinearizedModels with all rivals, for all ratios of noises: heights to distances, and by hand to probed.

        The first has the firmware's ratio and the middle ratio of heights by hand.
        """
        touched = (self.probe_mm == 0.0).all(axis=1)
        ratios = _BY_HAND if touched.any() and not touched.all() else (1.0,)
        by_hand = self._of_heights(touched[:, None])[:, 0]
        sds = [sd * np.where(by_hand, ratio, 1.0) for sd in noise_sds(self.result.residuals) for ratio in ratios]
        middle = sds.pop(len(ratios) // 2)
        return [self.result.linearized(sd).with_columns(self.rivals[:, None]) for sd in (middle, *sds)]

    @cached_property
    def _tilt_columns(self):
        """AddedColumns of the tilt for the firmware's ratio and the middle ratio of heights by hand."""
        return self._models[0].add(self.columns[:, None])

    @cached_property
    def noise(self):
        """Noise in mm of a reading of weight 1: as given, from residuals with rivals and tilt, or of a probe."""
        if self.noise_mm is not None:
            return self.noise_mm
        freedom = self._tilt_columns.freedom
        return np.sqrt(self._tilt_columns.unexplained()[0] / freedom) if freedom > 0 else PROBE_MM

    @cached_property
    def most_noise(self):
        """Upper 95 % confidence limit of the noise, since few readings tend to underestimate it."""
        freedom = self._tilt_columns.freedom
        if self.noise_mm is not None or freedom < 1:
            return self.noise
        return self.noise * np.sqrt(freedom / stats.chi2.ppf(1.0 - _CONFIDENCE, freedom))

    @cached_property
    def p(self):
        """Probability that noise explains as much as unequal rods; NaN without degrees of freedom."""
        return self._p(self._models, self.columns)

    def _p(self, models, columns):
        """Largest p of columns (n, k) over models; NaN where their rank depends on the ratio."""
        ranks = {one.add(columns[:, None]).rank for one in models}
        return float(largest_p(models, columns[:, None], self.result.in_mm.residual)[0]) if len(ranks) == 1 else np.nan

    def power(self, limit):
        """Probability that p is below a limit where one arm's rods differ by SHOWN_MM, for the least sensitive arm.

        For a noise of `most_noise`.
        """
        if self._tilt_columns.freedom < 1 or self._tilt_columns.rank < self.columns.shape[1]:
            return 0.0
        return float(self._tilt_columns.power(limit, SHOWN_MM * self.columns[:, None], self.most_noise).min())

    def alone(self, arm):
        """Difference of an arm's rods in mm if only they differ, its standard error, and p of the other arms."""
        column = self.columns[:, [arm]]
        size, error = self._models[0].add(column[:, None]).estimates(self.noise)
        with_arm = [model.with_columns(column[:, None]) for model in self._models]
        return abs(size.item()), error.item(), self._p(with_arm, np.delete(self.columns, arm, axis=1))


@dataclass(frozen=True)
class TiltAnswer:
    """Answer on the tilt: p, the limit for it, the power to find SHOWN_MM, and in words."""

    p: float
    limit: float
    power: float
    text: str

    @property
    def found(self):
        """Whether rods of unequal lengths were found."""
        return self.p < self.limit


def tilt_answer(result, limit):
    """The TiltAnswer of a PrinterFit, None where the probe has no offset from the nozzle, or none is stated."""
    probe = result.printer.probe_mm
    if np.isnan(probe).any() or not probe.any():
        return None
    test = TiltTest(result, probe).with_bent_bed()
    power, p = test.power(limit), test.p
    if p < limit:
        return TiltAnswer(p, limit, power, f"found: the effector tilts, {_rods(test, limit)}")
    if power >= _POWER:
        return TiltAnswer(p, limit, power, f"not found: {SHOWN_MM:g} mm between an arm's rods would be detected")
    return TiltAnswer(p, limit, power, f"cannot tell: {_advice(test, limit)}")


def _rods(test, limit):
    """Arms whose rods may differ alone, with the difference: those that leave no significant rest for the others."""
    alone = {arm: test.alone(number) for number, arm in enumerate("abc")}
    able = [arm for arm, (_, _, others) in alone.items() if others >= limit]
    if not able:
        return "the rods of several arms differ"
    size, error, _ = alone[max(able, key=lambda arm: alone[arm][2])]
    apart = f"if they are {test.result.residuals.mechanism.spacing_mm:.0f} mm apart"
    return f"the rods of arm {' or '.join(able)} differ by {size:.2f} mm (+-{2.0 * error:.2f}) {apart}"


def _advice(test, limit):
    """The easiest further readings that would decide, in words."""
    condition = f"with a repeatability of {test.noise:.3f} mm of a height"
    for words, more in _more(test):
        if more.power(limit) >= _POWER:
            return f"probe {words}; {condition}, this detects {SHOWN_MM:g} mm between an arm's rods"
    return f"no further probing would decide, {condition}"


def _more(test):
    """Further readings that an owner can take, the easiest first: what to do, and the test with them."""
    probed = test.places[: len(test.probe_mm)]
    offset = test.probe_mm[np.hypot(*test.probe_mm.T).argmax()]
    first, second = (_turned(offset, degrees) for degrees in (120.0, 240.0))
    yield "once more at the same places by hand", _with(test, (probed, 0.0 * offset))
    yield "once more at the same places with the probe on the other side of the nozzle", _with(test, (probed, -offset))
    sides = "with the probe on three sides of the nozzle, 120 degrees apart"
    yield f"at the same places {sides}", _with(test, (probed, first), (probed, second))
    for count in _COUNTS:
        places = even_places(test.result, count)
        yield f"at {count} places {sides}", _with(test, (places, offset), (places, first), (places, second))


def _turned(offset, degrees):
    """An offset (2,) rotated about the nozzle."""
    return Rotation.from_euler("z", degrees, degrees=True).apply([*offset, 0.0])[:2]


def _with(test, *sets):
    """The test with more heights: places (n, 3) of the nozzle and offset (2,) of the probe for each set."""
    residuals = test.result.residuals
    places = np.concatenate([places for places, _ in sets])
    sliders = residuals.mechanism.inverse(places, test.result.fit.deviations)
    more = replace(
        residuals,
        height_actuators=np.concatenate([residuals.height_actuators, sliders]),
        height_mm=np.concatenate([residuals.height_mm, places[:, 2]]),
    )
    probe = np.concatenate([test.probe_mm, *(np.tile(offset, (len(places), 1)) for places, offset in sets)])
    fit = test.result.fit.at(test.result.fit.deviations, "with more heights", more)
    return TiltTest(replace(test.result, fit=fit), probe, test.noise)
