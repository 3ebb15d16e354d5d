"""Expected information against least squares and brute force, and poses more informative than any trajectory."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pytest

from rrru.campaign.ingest.campaign_file import ingest
from rrru.campaign.ingest.spec import IngestSpec
from rrru.diagnosis.calibrate import calibrate
from rrru.diagnosis.design import poses
from rrru.diagnosis.design.advise import advise
from rrru.diagnosis.design.expected_information import Contests, Prediction, without_unreachable
from rrru.diagnosis.design.run_limits import StatedLimits
from rrru.diagnosis.inference import InferenceResult
from rrru.diagnosis.make_problem import make_diagnosis_problem
from rrru.diagnosis.model_fit import fit_model
from rrru.diagnosis.model_space import explore
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.posterior import Posterior
from rrru.diagnosis.settings import Prior
from rrru.diagnosis.state import ModelState
from rrru.diagnosis.verdict import decide
from rrru.effects.library import find
from rrru.effects.protocol import Coordinates
from rrru.errors import FitError
from rrru.parameters import ParameterSet
from rrru.pipeline.setup import as_measured
from rrru.robots.hexapod import hexapod
from tests.diagnosis import arms, hexapod_stops
from tests.diagnosis.campaigns import EFFECTS, LINES, MASSES, MODEL, measure, plan_of, problem_of, strong

_NOISE_MM = 0.02


def _candidates(seed, count=8, numbers=4, readings=15):
    """Designs (n, k) and sets of data (n, 2) of made-up candidates, over the noise."""
    generator = np.random.default_rng(seed)
    return [
        (generator.standard_normal((readings, numbers)), 1.5 * generator.standard_normal((readings, 2)))
        for _ in range(count)
    ]


def _left(parts, precision):
    """Half the least sums of squares (2,) that the designs of some candidates together leave, in nats."""
    design = np.concatenate([*(one for one, _ in parts), np.diag(np.sqrt(precision))])
    data = np.concatenate([*(one for _, one in parts), np.zeros((len(precision), 2))])
    return 0.5 * ((data - design @ np.linalg.lstsq(design, data, rcond=None)[0]) ** 2).sum(axis=0)


def _contests(first, others, precision):
    """One pair of answers, about two sets of data."""
    prediction = Prediction.of(first, others, precision)
    return Contests(((None, None),), np.ones(1), (prediction,), np.zeros(2, dtype=int))


@pytest.mark.parametrize(("readings", "numbers"), [(15, 4), (3, 6)])
@pytest.mark.parametrize("seed", range(3))
def test_each_pose_is_the_best_one_after_those_before_it(seed, readings, numbers):
    """With more readings than coefficients, and with fewer, against least squares of all points together."""
    first, *others = _candidates(seed, 8, numbers, readings)
    precision = np.array([0.0, *np.full(numbers - 1, 0.5)])
    about, start = _contests(first, others, precision), _left([first], precision)
    np.testing.assert_allclose(about.predictions[0].now_nats, start, rtol=1e-8)
    chosen, total = about.choose(3)
    taken = []
    for number in chosen:
        shares = [
            -1.0
            if k in taken
            else np.mean(1.0 - np.exp(start - _left([first, *(others[t] for t in taken), one], precision)))
            for k, one in enumerate(others)
        ]
        assert number == np.argmax(shares)
        taken.append(number)
    gain = _left([first, *(others[k] for k in taken)], precision) - start
    np.testing.assert_allclose(total, gain, rtol=1e-6)
    assert about.resolved(total)[0] == pytest.approx(np.mean(1.0 - np.exp(-gain)))
    assert len(chosen) == 3


def test_no_more_poses_are_chosen_than_resolve_something():
    """Beyond a few, candidates that tell nothing are left out, and so are all where enough is known."""
    first, *others = _candidates(1, 15)
    silent = [(np.zeros((15, 4)), np.zeros((15, 2)))] * 12
    # each resolves a little, as candidates that tell nothing of the coefficients do
    weak = [(np.zeros((15, 4)), 0.08 * data) for _, data in others]
    chosen, _ = _contests(first, [*silent, *weak], np.ones(4)).choose(26)
    assert len(chosen) > OPTIONS.few_poses and min(chosen) >= len(silent)
    few, _ = _contests(first, [*others[:1], *weak[:2], *silent], np.ones(4)).choose(15)
    assert set(few) >= {0, 1, 2} and len(few) == OPTIONS.few_poses
    strong, _ = _contests(first, others, np.ones(4)).choose(14)
    assert len(strong) == OPTIONS.few_poses


def test_candidates_of_different_length_are_counted_each_by_its_own_readings():
    first, one, other = _candidates(3, 3)
    short = one[0][:6], one[1][:6]
    found = _contests(first, [short, other], np.ones(4)).gains()
    alone = [_contests(first, [some], np.ones(4)).gains()[0] for some in (short, other)]
    np.testing.assert_allclose(found, alone, rtol=1e-9)
    # further points never take information away; data that the design itself can fit have none
    assert (found > 0.0).all()
    made = one[0], one[0] @ np.ones((4, 2))
    np.testing.assert_allclose(Prediction.of(made, [made], np.zeros(4)).gains(), 0.0, atol=1e-6)


def test_passes_lie_between_measured_points_within_reach():
    frame = measure(plan=plan_of(trajectories=LINES[1:]))
    passes = poses.passes(frame, MODEL)
    start, end = passes.start_mm, passes.end_mm
    points = poses.points_of(start, end).reshape(-1, 3)
    known = frame[[f"command_{axis}_mm" for axis in "xyz"]].to_numpy()
    assert len(start) > 20 and np.isfinite(MODEL.inverse(points)).all()
    assert (points >= known.min(axis=0) - 1e-9).all() and (points <= known.max(axis=0) + 1e-9).all()
    np.testing.assert_allclose(np.linalg.norm(end - start, axis=1), OPTIONS.pass_length_mm)
    near, *_ = MODEL.singularities(points, MODEL.inverse(points))
    own, *_ = MODEL.singularities(known, MODEL.inverse(known))
    assert near.min() > 0.75 * own.min()


@dataclass(frozen=True)
class LocalCompliance:
    """A drive with the compliance of `drive_compliance`, but not in the middle between two lines."""

    name: str = "local_compliance"
    parameters: ParameterSet = EFFECTS["drive_compliance"].parameters
    coordinates: Coordinates = EFFECTS["drive_compliance"].coordinates
    needs: tuple = ()
    along_drives = with_waves = None
    switches = False

    def contribute(self, motion, values):
        """Changes (n, 3) of the drive angles."""
        outside = np.abs(motion.position_mm[:, 1:2]) > 60.0
        return motion.at_drives(np.asarray(values) * motion.drive_load * outside)


@pytest.fixture(scope="module")
def rivals():
    """InferenceResult and verdict of a campaign of two lines, at y = 110 mm and -110 mm, of effects that differ between
    these alone.
    """
    library = {"drive_compliance": EFFECTS["drive_compliance"], "local_compliance": LocalCompliance()}
    problem = problem_of(measure((strong("drive_compliance", 6.0),), plan=plan_of(trajectories=LINES[1:])), library)
    calibrated = calibrate(problem)
    evidence = problem.evidence(problem.linearise(calibrated))
    posterior = explore(evidence, Prior())
    found = InferenceResult(
        problem, calibrated, calibrated, fit_model(problem, [calibrated]), evidence, posterior, *posterior.best()
    )
    verdict = decide(posterior, library)
    assert {*verdict.effects, *verdict.confounded_with} >= set(library) and verdict.probability < 0.6
    return found, verdict


@pytest.fixture(scope="module")
def between(rivals):
    """The Advice for it."""
    return advise(*rivals, MASSES)


def test_advised_poses_keep_the_limits(between, rivals):
    few = advise(*rivals, MASSES, StatedLimits(payload_kg=2.0, speed_mm_s=150.0, minutes=0.2))
    (row,) = few.runs.to_dict("records")
    assert row["kind"] == "poses" and 1 <= len(few.poses) < len(between.poses)
    assert row["points"] == OPTIONS.points_per_pass * len(few.poses) and row["gain_nats"] > 0.2
    assert (few.poses["payload_kg"] <= 2.0).all() and (few.poses["speed_mm_s"] <= 150.0).all()
    none = advise(*rivals, MASSES, StatedLimits(minutes=0.01))
    assert not len(none.runs) and not len(none.poses) and "local_compliance" in none.undecided
    assert none.limited == "runs are proposed within the limits minutes 0.01"


def test_poses_decide_what_no_trajectory_does(between):
    assert between.runs["kind"].tolist() == ["poses"]
    assert between.runs["separates"].str.contains("local_compliance").all()
    row, listed = between.runs.iloc[0], between.poses
    assert row["gain_nats"] > 3.0 and row["points"] == OPTIONS.points_per_pass * len(listed) and 1 < len(listed) <= 10
    assert listed["pose"].tolist() == list(range(1, len(listed) + 1))
    middle = (listed["from_y_mm"] + listed["to_y_mm"]) / 2.0
    # the first one crosses where they differ
    assert abs(middle.iloc[0]) < 60.0 + OPTIONS.pass_length_mm / 2.0


@dataclass(frozen=True)
class ComplianceOutside:
    """A drive of an arm with the compliance of `drive_compliance`, but not within 150 mm of the plane y = 0."""

    name: str = "compliance_outside"
    parameters: ParameterSet = find("drive_compliance", arms.ARM).parameters
    coordinates: Coordinates = find("drive_compliance", arms.ARM).coordinates
    needs: tuple = ()
    along_drives = with_waves = None
    switches = False

    def contribute(self, motion, values):
        """Changes (n, 6) of the drive angles."""
        outside = np.abs(motion.position_mm[:, 1:2]) > 150.0
        return motion.at_drives(np.asarray(values) * motion.drive_load * outside)


def _arm_stops(effects=()):
    """Stops of an arm, read with orientations, none of them within 150 mm of the plane y = 0."""
    frame = arms.measure(effects, 400).assign(payload_kg=0.0)
    return frame[frame["command_y_mm"].abs() > 150.0].reset_index(drop=True)


def test_a_platform_that_the_drives_orient_keeps_the_orientation_that_was_commanded_next_to_a_pass():
    frame = _arm_stops()
    robot = arms.reading(frame)
    passes = poses.passes(frame, robot)
    points = poses.points_of(passes.start_mm, passes.end_mm)
    assert len(passes) > 20 and passes.reads_turns
    drives = passes.drives.reshape(-1, arms.DRIVES)
    np.testing.assert_allclose(robot.forward(drives), points.reshape(-1, 3), atol=1e-6)
    turn = robot.solve(drives, points.reshape(-1, 3)).turn.reshape(*points.shape[:2], 3, 3)
    np.testing.assert_allclose(turn, np.broadcast_to(passes.turn[:, None], turn.shape), atol=1e-9)
    known = frame[[f"command_{axis}_mm" for axis in "xyz"]].to_numpy()
    nearest = np.linalg.norm(known - passes.start_mm[:, None], axis=2).argmin(axis=1)
    commanded = robot.solve(frame[robot.parts.columns].to_numpy(), known).turn
    np.testing.assert_allclose(passes.turn, commanded[nearest], atol=1e-9)
    low, high = robot.drive_range.T
    assert ((drives >= low - 1e-9) & (drives <= high + 1e-9)).all()
    # no wrist turns over on the way
    assert np.abs(np.diff(passes.drives, axis=1)).max() < OPTIONS.max_pass_step_rad


def test_poses_are_advised_for_an_arm_with_the_orientation_to_command():
    own = find("drive_compliance", arms.ARM)
    frame = _arm_stops((arms.active("drive_compliance", 3.0 * own.coordinates.typical * np.ones(arms.DRIVES)),))
    library = {"drive_compliance": own, "compliance_outside": ComplianceOutside()}
    problem = arms.problem_of(frame, library=library)
    calibrated = calibrate(problem)
    evidence = problem.evidence(problem.linearise(calibrated))
    posterior = explore(evidence, Prior())
    # both are as probable
    alone = [posterior.best_of(frozenset([name])) for name in library]
    weights = np.array([np.where(np.arange(len(one.evidence)) == level, 0.0, -50.0) for one, level in alone])
    even = Posterior(tuple(one for one, _ in alone), weights, np.zeros(weights.shape, dtype=bool))
    found = InferenceResult(
        problem, calibrated, calibrated, fit_model(problem, [calibrated]), evidence, even, *even.best()
    )
    advice = advise(found, decide(even, library), arms.MASSES)
    best, listed = advice.runs.iloc[0], advice.poses
    assert best["kind"] == "poses" and best["gain_nats"] > OPTIONS.decisive_gain_nats and advice.undecided == ""
    turned = listed[[f"command_r{axis}_rad" for axis in "xyz"]]
    assert turned.notna().all(axis=None) and len(turned.drop_duplicates()) > 1
    # the first one crosses where they differ
    assert abs(listed[["from_y_mm", "to_y_mm"]].iloc[0]).min() < 150.0


def test_of_several_targets_the_one_that_was_read_most_is_read_at_a_pose(tmp_path):
    file = tmp_path / "mine.csv"
    hexapod_stops.file_of("random", "tool").drop(index=[0, 2]).to_csv(file, index=False)
    robot = hexapod(
        hexapod_stops.BASE, hexapod_stops.PLATFORM, hexapod_stops.HEIGHT_MM, stroke_mm=200.0, parameter_set="zero"
    )
    spec = IngestSpec.from_config({"ingest": str(file), "targets": hexapod_stops.PLACES})
    frame = ingest(spec, robot).measurements
    robot = as_measured(robot, frame, tuple(hexapod_stops.PLACES))
    passes = poses.passes(frame, robot)
    table = passes.commands(robot, 0.0, 80.0, 0.0)
    assert len(passes) > 20 and set(table["target"]) == {"b"} and not passes.reads_turns
    np.testing.assert_allclose(table[[f"target_{axis}_mm" for axis in "xyz"]].iloc[0], hexapod_stops.PLACES["b"])
    problem = make_diagnosis_problem(table, robot, MASSES, hexapod_stops.NOISE_MM, {})
    assert problem.count == len(table) == OPTIONS.points_per_pass * len(passes)
    on_world = frame.assign(target_on="world")
    assert len(poses.passes(on_world, robot)) == 0


def test_poses_are_as_many_as_the_time_allows():
    passes = poses.passes(measure(plan=plan_of(trajectories=LINES[1:])), MODEL)
    order = [3, 0, 5, 1]
    way = [np.linalg.norm(passes.start_mm[b] - passes.end_mm[a]) for a, b in pairwise(order)]
    seconds = np.cumsum([200.0, *(200.0 + one for one in way)]) / 50.0
    for count, limit in enumerate(seconds):
        assert passes.within(order, 50.0, limit - 1e-6) == count
    assert passes.within(order, 50.0, np.inf) == passes.within(order, np.nan, 1.0) == 4


def test_points_at_which_the_corrected_model_has_no_pose_are_left_out_of_what_runs_are_worth():
    """A leg that is much too short reaches some of the points only."""
    problem = problem_of(measure(plan=plan_of(trajectories=LINES[1:])), {"leg_asymmetry": EFFECTS["leg_asymmetry"]})
    plain = calibrate(problem)
    for shift_mm in np.linspace(-50.0, -700.0, 66):
        state = ModelState(plain.deviations, {("leg_asymmetry", 0): np.tile([0.0, 0.0, shift_mm], 3)})
        posed = np.isfinite(problem.residual(state)).all(axis=1)
        if 0 < posed.sum() < len(posed):
            break
    assert 0 < posed.sum() < len(posed)
    with pytest.raises(FitError, match="no pose"):
        problem.linearise(state, [])
    reached = without_unreachable(problem, state)
    assert reached.count == posed.sum()
    assert np.isfinite(reached.linearise(state, []).data).all()
    assert without_unreachable(problem, plain) is problem


def test_a_box_smaller_than_a_pass_has_none():
    frame = measure(plan=plan_of(trajectories=LINES[1:]))
    known = frame[[f"command_{axis}_mm" for axis in "xyz"]].to_numpy()
    near = frame[np.abs(known - known[0]).max(axis=1) < 0.5 * OPTIONS.pass_length_mm / np.sqrt(3.0)]
    assert len(near) > 1 and len(poses.passes(near, MODEL)) == 0
