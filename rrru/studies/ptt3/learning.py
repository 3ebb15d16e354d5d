"""What can be learned from a measured curve, each as a controller: positions (n, 3) to slider positions (n, 3). Lengths
in mm.

Where the paper is followed, a height error counts from that of the curve's first point (3.3), so that a common height
error stays. The networks with `absolute` heights and the calibrated model take it out as well.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import RBFInterpolator

from rrru.compensate.jacobian import through_inverse, through_jacobian
from rrru.compensate.rbf import ROUNDING, fit, grow, make_folds, validation_mse
from rrru.fit.least_squares import least_squares
from rrru.fit.residuals import Residuals
from rrru.studies.ptt3 import experiments as robot

METHODS = (
    "rbf_inverse",
    "rbf_jacobian",
    "rbf_absolute",
    "rbf_paper",
    "rbf_paper_mm",
    "interpolator",
    "parameters",
    "rbf_after_parameters",
)


def relative(error_mm):
    """Position errors (n, 3) with the height's counted from that of the first point."""
    return error_mm - np.array([0.0, 0.0, error_mm[0, 2]])


@dataclass(frozen=True)
class Choice:
    """A spread in mm and a number of neurons, and the cross-validated mean squared errors (s, neurons + 1) they are the
    best of.
    """

    spread_mm: float
    neurons: int
    validation_mse: np.ndarray


@dataclass(frozen=True)
class Learning:
    """One experiment's curve as measured, and what is learned from its training points.

    command_mm, sliders_mm, measured_mm: (n, 3); train (n,): which points are learned from; folds: fold of every
    training point; network: `ptt.network` of the configuration; paper_spread: the paper's, unit not printed.
    """

    mechanism: object
    command_mm: np.ndarray
    sliders_mm: np.ndarray
    measured_mm: np.ndarray
    train: np.ndarray
    folds: np.ndarray
    network: dict
    paper_spread: float

    @property
    def error_mm(self):
        """Measured less commanded positions (n, 3)."""
        return self.measured_mm - self.command_mm

    @property
    def half_range_mm(self):
        """Half the largest range of a coordinate: what scaling the network's inputs to -1 .. 1 divides by."""
        return 0.5 * float(np.ptp(self.command_mm, axis=0).max())

    @property
    def paper_spreads_mm(self):
        """The paper's spread by both readings of its unit: of inputs scaled to -1 .. 1 ("paper_scaled"), or mm
        ("paper_mm").
        """
        return {"paper_scaled": self.paper_spread * self.half_range_mm, "paper_mm": self.paper_spread}

    def choose(self, targets):
        """The candidate spread and the number of neurons with the least cross-validated error on targets (n, q)."""
        points, wanted = self.command_mm[self.train], targets[self.train]
        spreads, most, share = (self.network[key] for key in ("spreads_mm", "neurons", "new_share"))
        curves = np.array([validation_mse(points, wanted, spread, most, self.folds, share) for spread in spreads])
        best, neurons = np.unravel_index(curves.argmin(), curves.shape)
        return Choice(float(spreads[best]), int(neurons), curves)

    def trained(self, targets, spread_mm, neurons, new_share=None):
        """Network on the training points with targets (n, q); new_share: another one than the configured, see
        `grow`.
        """
        points, wanted = self.command_mm[self.train], targets[self.train]
        share = self.network["new_share"] if new_share is None else new_share
        return fit(points, wanted, spread_mm, grow(points, wanted, spread_mm, neurons, share).order)

    @cached_property
    def choice(self):
        """The choice for the paper's target, see `relative`."""
        return self.choose(relative(self.error_mm))

    @cached_property
    def chosen(self):
        """The network of that choice."""
        return self.trained(relative(self.error_mm), self.choice.spread_mm, self.choice.neurons)

    @cached_property
    def calibration(self):
        """Least-squares fit of the mechanism's parameters on the training points."""
        rows = self.train
        return least_squares(
            Residuals(self.mechanism, self.sliders_mm[rows], self.measured_mm[rows], self.command_mm[rows])
        )

    @cached_property
    def rest(self):
        """The network of a choice of its own, on what the calibration leaves."""
        left = self.measured_mm - self.mechanism.forward(self.sliders_mm, self.calibration.deviations)
        again = self.choose(left)
        return self.trained(left, again.spread_mm, again.neurons)

    @cached_property
    def paper(self):
        """Networks of the paper's spread by both readings, with all the neurons that its target of zero error asks
        for.
        """
        error, count = relative(self.error_mm), int(self.train.sum())
        return {key: self.trained(error, spread, count, ROUNDING) for key, spread in self.paper_spreads_mm.items()}

    @cached_property
    def spline(self):
        """The biharmonic spline through the training points: in three dimensions its kernel is the distance itself."""
        return RBFInterpolator(self.command_mm[self.train], relative(self.error_mm)[self.train], kernel="linear")

    def controllers(self):
        """Every method's controller by name; what one needs is learned when it is first called.

        rbf_inverse, rbf_jacobian: the cross-validated network, through eq. (11) or eq. (12); rbf_absolute: with the
        common height error learned; rbf_paper, rbf_paper_mm: the paper's spread, scaled or in mm, and all the neurons
        that its target of zero error asks for; interpolator: scipy's biharmonic spline through the training points,
        which has nothing to choose; parameters: calibrated model; rbf_after_parameters: a network on what the
        calibration leaves.
        """
        mechanism, height = self.mechanism, self.error_mm[0] * np.array([0.0, 0.0, 1.0])
        return {
            "rbf_inverse": lambda path: through_inverse(mechanism, path, self.chosen(path)),
            "rbf_jacobian": lambda path: through_jacobian(mechanism, path, self.chosen(path)),
            "rbf_absolute": lambda path: through_inverse(mechanism, path, self.chosen(path) + height),
            "rbf_paper": lambda path: through_inverse(mechanism, path, self.paper["paper_scaled"](path)),
            "rbf_paper_mm": lambda path: through_inverse(mechanism, path, self.paper["paper_mm"](path)),
            "interpolator": lambda path: through_inverse(mechanism, path, self.spline(path)),
            "parameters": lambda path: mechanism.inverse(path, self.calibration.deviations),
            "rbf_after_parameters": lambda path: through_inverse(
                mechanism, path, self.rest(path), self.calibration.deviations
            ),
        }


def learning(config, experiment, means, labels=()):
    """What an experiment's point means (see `robot.point_means`) allow to learn.

    Which points train, and their folds, are drawn from the experiment's streams of those labels.
    """
    section = config["ptt"]
    command, sliders, measured = means
    count, size = section["network"]["train"], len(command)
    train = np.zeros(size, dtype=bool)
    train[experiment.generator("split", *labels).permutation(size)[:count]] = True
    return Learning(
        robot.mechanism(config, section["parameters"]),
        command,
        sliders,
        measured,
        train,
        make_folds(count, section["network"]["folds"], experiment.generator("folds", *labels)),
        section["network"],
        section["experiments"][experiment.name]["paper_spread"],
    )
