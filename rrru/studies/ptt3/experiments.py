"""The experiments of paper B as ordinary campaigns: a 3-PTT drives one curve several times. mm, angles in rad.

The position of a point is the mean of the tracker's readings. Slider columns of the measurements are the controller's
desired positions, without the jump that backlash compensation adds to the motor's command.
"""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import pandas as pd

from rrru.campaign import measurements as rows
from rrru.campaign.plan import make_plan
from rrru.campaign.trajectories import from_config
from rrru.compensation.backlash import compensated
from rrru.pipeline import setup
from rrru.studies.ptt3.parts import campaign_section


@dataclass(frozen=True)
class Curve:
    """The curve of eq. (18), raised: one turn that rises evenly, and a run-up of some points before and after it."""

    radius_mm: float
    z_mm: tuple[float, float]
    start_deg: float
    points: int
    run_up_points: int
    raised_mm: float = 0.0

    @property
    def trajectories(self):
        """The curve with its run-up as an entry of the configuration's `trajectories`."""
        share, (low, high) = self.run_up_points / (self.points - 1), self.z_mm
        rise = share * (high - low)
        spiral = {
            "name": "curve",
            "centre_mm": (0.0, 0.0),
            "radius_mm": (self.radius_mm, self.radius_mm),
            "z_mm": (low - rise + self.raised_mm, high + rise + self.raised_mm),
            "turns": 1.0 + 2.0 * share,
            "points": self.points + 2 * self.run_up_points,
            "start_deg": self.start_deg - 360.0 * share,
        }
        return {"spiral": spiral}

    def without_run_up(self, values):
        """Rows (..., points, 3) of the curve itself from values (..., points and run-up, 3)."""
        return values[..., self.run_up_points : self.run_up_points + self.points, :]


@dataclass(frozen=True)
class Lesson:
    """Training data and hyperparameters of a network: its keys in the configuration's `ptt.network`."""

    train: int
    neurons: int
    folds: int
    new_share: float
    spreads_mm: tuple


@dataclass(frozen=True)
class Experiment:
    """One experiment: its campaign, curve and motion, and the settings for learning from it.

    model: the mechanism with the calibrated parameters; repeats: number of passes that a measured position averages;
    network: None without learning; paper_spread: the paper's, unit not printed.
    """

    campaign: setup.VirtualCampaign
    curve: Curve
    motion: dict
    repeats: int
    payload_kg: float
    model: object
    network: Lesson
    paper_spread: float

    def plan(self, payload_kg=None, reverse=(False,)):
        """Plan of passes along the curve, each in its direction; payload_kg: another than the experiment's."""
        load = self.payload_kg if payload_kg is None else payload_kg
        passes = [{"payload_kg": load, "reverse": backwards} for backwards in reverse]
        return make_plan(from_config(self.curve.trajectories), passes, **self.motion)

    def mean_noise(self, *labels):
        """Tracker noise (n, 3) of the curve's points, each the mean over the repeats, from the stream of the labels."""
        scale = self.campaign.noise_mm / np.sqrt(self.repeats)
        return scale * self.campaign.generator(*labels).standard_normal((self.curve.points, 3))


def nominal(settings):
    """The robot section for the builder, see `rrru.pipeline.config`."""
    return {"name": "ptt3", "dimensions": settings["robots"]["ptt3"]}


def experiment(settings, name, widths_mm=(0.0, 0.0, 0.0), compensate=None):
    """The experiment of that name from the parts seed, robots.ptt3, loads and ptt of the configuration.

    widths_mm (3,): measured backlash; compensate: whether the command jumps by it at a reversal, by default as
    configured. Raises ConfigError for an unknown error or effect of the robot.
    """
    section = settings["ptt"]
    entry, curve = section["experiments"][name], Curve(**section["curve"])
    campaign = campaign_section(settings, name)
    virtual = {
        "name": name,
        "origin": "ptt",
        "seed": settings["seed"],
        "robot": section["robot"] | settings["loads"],
        "trajectories": curve.trajectories,
        "motion": section["motion"],
        **{key: campaign[key] for key in ("passes", "noise_mm")},
    }
    driven = setup.virtual_campaign(nominal(settings), virtual)
    if entry["compensate_backlash"] if compensate is None else compensate:
        driven = replace(driven, drive=partial(compensated, widths_mm=widths_mm))
    return Experiment(
        campaign=driven,
        curve=curve,
        motion=section["motion"],
        repeats=section["repeats"],
        payload_kg=entry["payload_kg"],
        model=setup.mechanism(nominal(settings), section["parameters"]),
        network=Lesson(**section["network"]) if "network" in section else None,
        paper_spread=entry["paper_spread"],
    )


def point_means(experiment, measurements):
    """Commanded positions, wanted sliders and mean measured positions, each (n, 3), of the curve's points.

    measurements: of passes in one direction.
    """
    passes = measurements["run"].nunique()
    every = (rows.command(measurements), rows.actuators(measurements, experiment.model), rows.measured(measurements))
    return tuple(experiment.curve.without_run_up(v.reshape(passes, -1, 3)).mean(axis=0) for v in every)


def joined(measured, dwell_s):
    """Measurements of several experiments as one campaign, in sequence with pauses, runs numbered continuously."""
    parts, runs, time = [], 0, 0.0
    for frame in measured:
        parts.append(frame.assign(run=frame["run"] + runs, time_s=frame["time_s"] + time))
        runs, time = int(parts[-1]["run"].max()), float(parts[-1]["time_s"].max()) + dwell_s
    return pd.concat(parts, ignore_index=True)
