"""Models learned from a measured curve, each as a controller: positions (n, 3) to slider positions (n, 3) in mm.

As in the paper, a height error is relative to that of the curve's first point (3.3), so that a common height error
remains. The networks with `absolute` heights and the calibrated model correct it as well.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import RBFInterpolator

from rrru.calibration.calibrate import calibrate
from rrru.compensation.jacobian import through_inverse, through_jacobian
from rrru.compensation.rbf import ROUNDING, choose, fit, grow, make_folds
from rrru.estimation.observations.target_positions import TargetPositions
from rrru.studies.ptt3.experiments import Lesson


def relative(error_mm):
    """Position errors (n, 3) with heights relative to the first point."""
    return error_mm - np.array([0.0, 0.0, error_mm[0, 2]])


def cached_last(function):
    """The function of an array with a cache of its last answer."""
    last = [None, None]

    def answer(array):
        if last[0] is not array:
            last[:] = array, function(array)
        return last[1]

    return answer


@dataclass(frozen=True)
class Learning:
    """One experiment's measured curve, and the models learned from its training points.

    command_mm, sliders_mm, measured_mm: (n, 3); train (n,): flags of the training points; folds: fold of every
    training point; paper_spread: the paper's, unit not printed.
    """

    mechanism: object
    command_mm: np.ndarray
    sliders_mm: np.ndarray
    measured_mm: np.ndarray
    train: np.ndarray
    folds: np.ndarray
    network: Lesson
    paper_spread: float

    @property
    def error_mm(self):
        """Measured minus commanded positions (n, 3)."""
        return self.measured_mm - self.command_mm

    @property
    def paper_spreads_mm(self):
        """The paper's spread with both interpretations of its unit: of inputs scaled to -1 .. 1, or mm."""
        half_range_mm = 0.5 * float(np.ptp(self.command_mm, axis=0).max())
        return {"paper_scaled": self.paper_spread * half_range_mm, "paper_mm": self.paper_spread}

    def choose(self, targets):
        """The candidate spread and the number of neurons with the least cross-validated error on targets (n, q)."""
        points, wanted, network = self.command_mm[self.train], targets[self.train], self.network
        return choose(points, wanted, network.spreads_mm, network.neurons, self.folds, network.new_share)

    def trained(self, targets, spread_mm, neurons, new_share=None):
        """Network on the training points with targets (n, q); new_share: another than the configured one."""
        points, wanted = self.command_mm[self.train], targets[self.train]
        order = grow(points, wanted, spread_mm, neurons, new_share or self.network.new_share).order
        return fit(points, wanted, spread_mm, order)

    @cached_property
    def choice(self):
        """The choice for the paper's target, see `relative`."""
        return self.choose(relative(self.error_mm))

    @cached_property
    def chosen(self):
        """The network of that choice, cached because several methods evaluate it on the same path."""
        return cached_last(self.trained(relative(self.error_mm), self.choice.spread_mm, self.choice.neurons))

    @cached_property
    def calibration(self):
        """Least-squares fit of the mechanism's parameters on the training points."""
        points = (values[self.train] for values in (self.sliders_mm, self.measured_mm, self.command_mm))
        return calibrate(TargetPositions(self.mechanism, *points))

    @cached_property
    def residual_network(self):
        """The network on the residuals of the calibration, with its own choice of spread and neurons."""
        left = self.measured_mm - self.mechanism.forward(self.sliders_mm, self.calibration.deviations)
        choice = self.choose(left)
        return self.trained(left, choice.spread_mm, choice.neurons)

    @cached_property
    def paper(self):
        """Networks of the paper's spread with both interpretations, with all neurons for its target of zero error."""
        error, count = relative(self.error_mm), int(self.train.sum())
        return {key: self.trained(error, spread, count, ROUNDING) for key, spread in self.paper_spreads_mm.items()}

    @cached_property
    def spline(self):
        """The biharmonic spline through the training points: in three dimensions its kernel is the distance itself."""
        return RBFInterpolator(self.command_mm[self.train], relative(self.error_mm)[self.train], kernel="linear")

    def _absolute(self, path):
        """The chosen network's output with the common height error added."""
        return self.chosen(path) + self.error_mm[0] * np.array([0.0, 0.0, 1.0])

    def sliders(self, method, path):
        """Slider positions (N, 3) for positions (N, 3) in the order driven by one of METHODS."""
        return METHODS[method](self, path)


def _network(answers):
    """The method that corrects by a network's output through the exact inverse kinematics, eq. (11)."""
    return lambda learned, path: through_inverse(learned.mechanism, path, answers(learned, path))


# The cross-validated network through eq. (11) or eq. (12), and with the common height error learned; the paper's
# spread, scaled or in mm; scipy's biharmonic spline without free choices; the calibrated model, and a network
# on its residuals.
METHODS = {
    "rbf_inverse": _network(lambda learned, path: learned.chosen(path)),
    "rbf_jacobian": lambda learned, path: through_jacobian(learned.mechanism, path, learned.chosen(path)),
    "rbf_absolute": _network(Learning._absolute),
    "rbf_paper": _network(lambda learned, path: learned.paper["paper_scaled"](path)),
    "rbf_paper_mm": _network(lambda learned, path: learned.paper["paper_mm"](path)),
    "interpolator": _network(lambda learned, path: learned.spline(path)),
    "parameters": lambda learned, path: learned.mechanism.inverse(path, learned.calibration.deviations),
    "rbf_after_parameters": lambda learned, path: through_inverse(
        learned.mechanism, path, learned.residual_network(path), learned.calibration.deviations
    ),
}


def learning(experiment, means, labels=()):
    """The Learning of an experiment's point means (see `experiments.point_means`).

    Training points and their folds are drawn from the experiment's streams of those labels.
    """
    network, generator = experiment.network, experiment.campaign.generator
    train = np.zeros(len(means[0]), dtype=bool)
    train[generator("split", *labels).permutation(len(train))[: network.train]] = True
    folds = make_folds(network.train, network.folds, generator("folds", *labels))
    return Learning(experiment.model, *means, train, folds, network, experiment.paper_spread)
