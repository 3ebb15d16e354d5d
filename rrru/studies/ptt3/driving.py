"""The robot driven again with learned corrections: on the curve, with new random draws, and on other tasks. mm.

# ASSUME passes in one direction differ by the tracker's noise alone: the run-up crosses the backlash, and no effect
drifts. So one pass is driven and gets the noise of a mean over the configured repeats.
"""

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from rrru.effects.protocol import Motion
from rrru.errors import UnreachableError
from rrru.studies.ptt3.experiments import Experiment
from rrru.studies.ptt3.learning import learning
from rrru.studies.ptt3.results import benefits, mean_errors

# the methods of the study's conclusions; all eight would take three times as long
REDRAWN = ("rbf_inverse", "rbf_jacobian", "rbf_absolute", "parameters")
EXTRAPOLATED = ("rbf_inverse", "rbf_paper_mm", "parameters", "rbf_after_parameters")
_LEVELS = {"benefit_low_percent": 0.05, "benefit_high_percent": 0.95}
_KEYS = ["method", "set", "axis"]


@dataclass(frozen=True)
class Pass:
    """One pass of an experiment's curve, prepared for any number of controllers.

    path_mm (N, 3): positions in the order driven, rows `index` those of the points target_mm; nominal_mm (N, 3): the
    sliders there; motion: input of the effects.
    """

    experiment: Experiment
    path_mm: np.ndarray
    index: np.ndarray
    target_mm: np.ndarray
    nominal_mm: np.ndarray
    motion: Motion

    @property
    def command_mm(self):
        """The curve's points (n, 3) without the run-up."""
        return self.experiment.curve.without_run_up(self.target_mm)

    def errors(self, sliders_mm=None):
        """Errors (n, 3) of the curve's points, without noise, of sliders (N, 3), by default the nominal ones."""
        campaign = self.experiment.campaign
        wanted = self.nominal_mm if sliders_mm is None else sliders_mm
        commanded = wanted if campaign.drive is None else campaign.drive(wanted)
        motion = replace(self.motion, path_drive=commanded, drive=commanded[self.index])
        position, _ = campaign.robot.positions(motion)
        return self.experiment.curve.without_run_up(position - self.target_mm)


def one_pass(experiment, payload_kg=None, reverse=False):
    """The pass under a payload, by default the experiment's, and in a direction; raises UnreachableError."""
    robot, plan = experiment.campaign.robot, experiment.plan(payload_kg, (reverse,))
    robot.mechanism.require_reachable(plan.targets())
    path, index = plan.path()
    nominal = robot.mechanism.inverse(path)
    return Pass(experiment, path, index, plan.targets(), nominal, robot.motion(plan, lambda _: nominal))


def driven(drive, learned, methods, labels=()):
    """Errors (n, 3) of the point means on a pass by method.

    Every method gets the same noise, from the experiment's stream of that label, so that differences come from the
    methods alone.
    """
    noise = drive.experiment.mean_noise("closed_loop", *labels)
    return {name: drive.errors(learned.sliders(name, drive.path_mm)) + noise for name in methods}


def redrawn(drive, methods, labels):
    """`results.benefits` of some methods, with random draws from the experiment's streams of those labels.

    That is the noise before and after, the training points, and the folds.
    """
    experiment, command = drive.experiment, drive.command_mm
    measured = command + (drive.errors() + experiment.mean_noise("measure", *labels))
    learned = learning(experiment, (command, experiment.model.inverse(command), measured), labels)
    return benefits(learned, driven(drive, learned, methods, labels))


def with_ranges(experiment, benefit, redraws):
    """Rows of `ptt_benefit` without the experiment: benefits with their range over redraws, null if not redrawn."""
    drive = one_pass(experiment)
    frames = [redrawn(drive, REDRAWN, ("redraw", draw)) for draw in range(redraws)]
    groups = pd.concat(frames).groupby(_KEYS)["benefit_percent"]
    ranges = pd.DataFrame({name: groups.quantile(level) for name, level in _LEVELS.items()})
    return benefit.merge(ranges, "left", left_on=_KEYS, right_index=True)


def starts(experiment, starts_deg):
    """Rows of `ptt_start` without the experiment: the paper's method with other start azimuths, one draw each."""
    frames = []
    for start in starts_deg:
        other = replace(experiment, curve=replace(experiment.curve, start_deg=start))
        frame = redrawn(one_pass(other), ("rbf_jacobian",), ("start", start))
        frames.append(frame[frame["set"] == "test"].assign(start_deg=start))
    return pd.concat(frames, ignore_index=True).drop(columns=["method", "set"])


def changes(experiment, radius_mm, height_mm, payload_kg):
    """Changed tasks as (family, size, curve, payload, direction): wider or raised, backwards, under another payload."""
    curve, load = experiment.curve, experiment.payload_kg
    yield "none", 0.0, curve, load, False
    for size in radius_mm:
        yield "radius_mm", size, replace(curve, radius_mm=curve.radius_mm + size), load, False
    for size in height_mm:
        yield "height_mm", size, replace(curve, raised_mm=size), load, False
    yield "reverse", 0.0, curve, load, True
    for other in payload_kg:
        if other != load:
            yield "payload_kg", other - load, curve, other, False


def extrapolations(experiment, learned, tasks):
    """Rows of `ptt_extrapolation` without the experiment: benefits on every changed task, all points together.

    tasks: sizes by family, see `changes`; one that leaves the workspace is absent.
    """
    noise, frames = experiment.mean_noise("closed_loop"), []
    for family, size, curve, load, reverse in changes(experiment, **tasks):
        try:
            drive = one_pass(replace(experiment, curve=curve), load, reverse)
        except UnreachableError:
            continue
        after = driven(drive, learned, EXTRAPOLATED)
        frame = mean_errors(drive.errors() + noise, after, {"all": slice(None)})
        frames.append(frame.drop(columns="set").assign(family=family, size=size))
    return pd.concat(frames, ignore_index=True)
