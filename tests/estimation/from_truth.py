"""Ends of searches, compared with least squares by SciPy from the truth: the minimum that a solver has to find.

The measured positions are handed over in the instrument's frame. Lengths in mm, angles in rad.
"""

import time
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from rrru.campaign import measurements as rows
from rrru.diagnosis.calibrate import calibrate
from rrru.diagnosis.diagnose import with_wide_bounds
from rrru.diagnosis.make_problem import make_diagnosis_problem
from rrru.diagnosis.model_fit import EffectModel, fit_named_effects
from rrru.diagnosis.state import ModelState
from rrru.errors import FitError
from rrru.kinematics.base_parameters import open_numbers
from rrru.kinematics.dynamics import Masses
from rrru.pipeline import setup
from rrru.studies.real.frame_fit import FRAMES, FrameObservations, fit_frames, frame_directions, frames
from tests.estimation.random_robots import NOISE_MM, draw_campaign

SAME = 1e-6
_SAME_UNDER_PRIOR = 1e-3
# readings without a pose, so that SciPy may step there
_LOST_MM = 1e4
_NO_LOADS = Masses(0.0, 0.0, 0.0)


@dataclass
class Outcome:
    """Sums of squares in mm^2 by search, inf where it raised, whose messages and seconds are by search as well.

    least_mm2: by search that of least squares from the truth.
    """

    kind: str
    seed: int
    least_mm2: dict = field(default_factory=dict)
    found_mm2: dict = field(default_factory=dict)
    messages: dict = field(default_factory=dict)
    seconds: dict = field(default_factory=dict)

    def reached(self, name):
        """Whether a search ended at the minimum from the truth, or lower.

        The core's minimum is that of its posterior: the priors of links and joints lift the sum of squares a little.
        """
        same = _SAME_UNDER_PRIOR if name == "core" else SAME
        return self.found_mm2[name] <= (1.0 + same) * self.least_mm2[name]


def unregistered_table(campaign):
    """The measurement table of a RandomCampaign in the instrument's frame; no target's place is stated."""
    table, count = campaign.sheet, len(campaign.targets)
    poses = campaign.robot.solve(campaign.actuators, campaign.position_mm)
    moved = np.abs(np.diff(campaign.actuators, axis=0)).max(axis=1) > 0.0
    labels = {"run": 1, "point": 1 + np.concatenate([[0], moved.cumsum()]), "status": "ok"}
    vectors = {"command": campaign.position_mm, "target": np.zeros((count, 3))}
    columns = {key: value for name, one in vectors.items() for key, value in rows.vector_columns(name, one).items()}
    nothing = dict.fromkeys(("time_s", "speed_mm_s", "payload_kg"), np.nan)
    return table.assign(**labels, **columns, **nothing, **rows.turn_columns("command", poses.turn))


def problem_of(campaign):
    """The DiagnosisProblem of a RandomCampaign, as of a user's file, without ingest."""
    table = unregistered_table(campaign)
    robot = with_wide_bounds(setup.as_measured(campaign.robot, table, registered=True))
    characteristic_length_mm = robot.characteristic_length_mm if campaign.turn is not None else np.nan
    problem = make_diagnosis_problem(
        table, robot, _NO_LOADS, NOISE_MM, {}, characteristic_length_mm=characteristic_length_mm
    )
    return replace(problem, library={FRAMES: frames(robot)})


def true_deviations(campaign, problem):
    """Deviations (p,) of the problem's robot, in the frame and about the places that the problem's readings have."""
    measured = rows.measured(problem.measurements)
    middle, own = campaign.measured_mm.mean(axis=0), measured.mean(axis=0)
    moved, _ = Rotation.align_vectors(measured - own, campaign.measured_mm - middle)
    turn = moved * Rotation.from_rotvec(campaign.frame[3:])
    shift = moved.apply(campaign.frame[:3] - middle) + own
    values = dict(campaign.errors)
    values |= {f"world_{axis}": value for axis, value in zip("xyz", shift, strict=True)}
    values |= {f"world_r{axis}": value for axis, value in zip("xyz", turn.as_rotvec(), strict=True)}
    for name, part in problem.measurements.groupby("target"):
        off = campaign.places[name] - rows.vectors(part, "target")[0]
        values |= {f"reflector_{name}_{axis}": value for axis, value in zip("xyz", off, strict=True)}
    robot = problem.mechanism
    known = {name: value for name, value in values.items() if name in robot.deviation_names}
    return robot.parameters.vector(robot.identifiable(known))


def least_from(observations, start):
    """Values (p,) and least sum of squares in mm^2 of SciPy's search from a start (p,)."""

    def residual(values):
        return np.nan_to_num(observations.residual(values), nan=_LOST_MM).ravel()

    def slope(values):
        return np.nan_to_num(observations.jacobian(values)).reshape(-1, len(values))

    scale = 1.0 / np.maximum(np.linalg.norm(slope(start), axis=0), 1e-12)
    exact = {"xtol": 1e-14, "ftol": 1e-14, "gtol": 1e-14, "max_nfev": 2000}
    found = least_squares(
        lambda x: residual(start + scale * x),
        np.zeros(len(start)),
        jac=lambda x: slope(start + scale * x) * scale,
        method="lm",
        **exact,
    )
    return start + scale * found.x, 2.0 * found.cost


def squares(problem, state):
    """Sum of squares in mm^2 that a ModelState leaves."""
    return float((problem.residual(state) ** 2).sum())


def outcome_of(kind, seed, **options):
    """The Outcome of a random campaign: of the calibration, of the core, and of frames alone on the nominal robot."""
    campaign = draw_campaign(kind, seed, **options)
    result, problem = Outcome(kind, seed), problem_of(campaign)
    model = EffectModel(problem, (), np.zeros(0))
    start = true_deviations(campaign, problem)
    began = time.process_time()
    _, least = least_from(model, start)
    result.seconds["truth"] = time.process_time() - began
    nominal = ModelState(problem.mechanism.parameters.nominal, {})
    searches = {
        "calibrate": lambda: calibrate(problem),
        "core": lambda: fit_named_effects(problem, (), nominal).state,
        "frames": lambda: fit_frames(problem, nominal),
    }
    for name, search in searches.items():
        began = time.process_time()
        try:
            state = search()
            result.found_mm2[name] = squares(problem, state)
        except FitError as error:
            result.found_mm2[name], result.messages[name] = np.inf, str(error)
        result.seconds[name] = time.process_time() - began
        result.least_mm2[name] = least
    result.least_mm2["frames"] = _least_of_frames(campaign, problem, nominal)
    return result


def _least_of_frames(campaign, problem, nominal):
    """Least sum of squares of frames alone, from the true ones."""
    numbers = open_numbers(problem.mechanism.measurement_config)
    observations = FrameObservations(problem, nominal, frame_directions(problem.mechanism))
    whole = replace(problem.mechanism, among=(), sample=None, parameter_set="frame")
    true = whole.parameters.mapping(true_deviations(campaign, replace(problem, mechanism=whole)))
    return least_from(observations, np.array([true[one.name] for one in numbers]))[1]
