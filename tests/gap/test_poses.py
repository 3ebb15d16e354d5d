"""Expected information against least squares and brute force, and poses that tell what no trajectory does."""

from dataclasses import dataclass
from itertools import combinations

import numpy as np
import pytest

from rrru.effects.protocol import Coordinates
from rrru.errors import FitError
from rrru.gap import poses
from rrru.gap.advise import advise
from rrru.gap.attribute import Attribution
from rrru.gap.calibrate import calibrate
from rrru.gap.model_fit import fit_model
from rrru.gap.model_space import explore
from rrru.gap.options import OPTIONS
from rrru.gap.settings import Prior
from rrru.gap.state import State
from rrru.gap.verdict import decide
from rrru.gap.worth import Sums, greedy, reachable
from rrru.parameters import ParameterSet
from tests.gap.campaigns import EFFECTS, LINES, MASSES, SIM, case_of, measure, plan_of, strong

_NOISE_MM = 0.02


def _candidates(seed, count=8, numbers=4):
    """Designs (5, 3, k) and data (5, 3) of made-up candidates."""
    generator = np.random.default_rng(seed)
    return [
        (generator.standard_normal((5, 3, numbers)), 0.03 * generator.standard_normal((5, 3))) for _ in range(count)
    ]


def _left(parts):
    """Half the least squares that the designs of some candidates together leave of their data, in nats."""
    design = np.concatenate([one.reshape(-1, one.shape[-1]) for one, _ in parts]) / _NOISE_MM
    data = np.concatenate([one.ravel() for _, one in parts]) / _NOISE_MM
    return 0.5 * ((data - design @ np.linalg.lstsq(design, data, rcond=None)[0]) ** 2).sum()


@pytest.mark.parametrize("seed", range(5))
def test_each_pose_is_the_best_one_beside_those_before_it(seed):
    first, *others = _candidates(seed)
    chosen, gain = greedy(Sums.of(*first, _NOISE_MM), [Sums.of(*one, _NOISE_MM) for one in others], 3)
    taken = [first]
    for number in chosen:
        gains = [-np.inf if any(one is t for t in taken) else _left([*taken, one]) for one in others]
        assert number == np.argmax(gains)
        taken.append(others[number])
    assert gain == pytest.approx(_left(taken) - _left([first]), rel=1e-6)
    best = max(_left([first, *three]) for three in combinations(others, 3)) - _left([first])
    assert 0.8 * best < gain <= best * (1.0 + 1e-9)


def test_further_points_never_take_information_away():
    first, *others = _candidates(9, 200)
    now = Sums.of(*first, _NOISE_MM)
    assert min((now + Sums.of(*one, _NOISE_MM)).nats() for one in others) >= now.nats()
    # what the design itself can make tells nothing
    made = others[0][0], others[0][0] @ np.ones(4)
    assert (Sums.of(*made, _NOISE_MM) + Sums.of(*made, _NOISE_MM)).nats() == pytest.approx(0.0, abs=1e-6)


def test_passes_lie_between_measured_points_within_reach():
    frame = measure(plan=plan_of(trajectories=LINES[1:]))
    passes = poses.passes(frame, SIM)
    start, end = passes.start_mm, passes.end_mm
    points = poses.points_of(start, end).reshape(-1, 3)
    known = frame[[f"command_{axis}_mm" for axis in "xyz"]].to_numpy()
    assert len(start) > 20 and np.isfinite(SIM.inverse(points)).all()
    assert (points >= known.min(axis=0) - 1e-9).all() and (points <= known.max(axis=0) + 1e-9).all()
    np.testing.assert_allclose(np.linalg.norm(end - start, axis=1), OPTIONS.pass_length_mm)
    near, *_ = SIM.singularities(points, SIM.inverse(points))
    own, *_ = SIM.singularities(known, SIM.inverse(known))
    assert near.min() > 0.75 * own.min()


@dataclass(frozen=True)
class LocalCompliance:
    """A drive that gives way as `drive_compliance` does, but not in the middle between two lines."""

    name: str = "local_compliance"
    parameters: ParameterSet = EFFECTS["drive_compliance"].parameters
    coordinates: Coordinates = EFFECTS["drive_compliance"].coordinates
    needs: tuple = ()

    def contribute(self, motion, values):
        """Changes (n, 3) of the drive angles."""
        outside = np.abs(motion.position_mm[:, 1:2]) > 60.0
        return motion.at_drives(np.asarray(values) * motion.drive_load * outside)


@pytest.fixture(scope="module")
def between():
    """Advice for a campaign of two lines, at y = 110 mm and -110 mm, between effects that differ between them alone."""
    library = {"drive_compliance": EFFECTS["drive_compliance"], "local_compliance": LocalCompliance()}
    case = case_of(measure((strong("drive_compliance", 6.0),), plan=plan_of(trajectories=LINES[1:])), library)
    calibrated = calibrate(case)
    evidence = case.evidence(case.linearise(calibrated))
    beliefs = explore(evidence, Prior())
    found = Attribution(case, calibrated, calibrated, fit_model(case, [calibrated]), evidence, beliefs, *beliefs.best())
    verdict = decide(beliefs, library)
    assert {*verdict.effects, *verdict.confusable_with} >= set(library) and verdict.probability < 0.6
    return advise(found, verdict, MASSES)


def test_poses_tell_what_no_trajectory_does(between):
    assert between.runs["kind"].tolist() == ["poses"]
    assert between.runs["separates"].str.contains("local_compliance").all()
    row, listed = between.runs.iloc[0], between.poses
    assert row["gain_nats"] > 3.0 and row["points"] == OPTIONS.points_per_pass * len(listed) and 1 < len(listed) <= 10
    assert listed["pose"].tolist() == list(range(1, len(listed) + 1))
    middle = (listed["from_y_mm"] + listed["to_y_mm"]) / 2.0
    # the first one crosses where they differ
    assert abs(middle.iloc[0]) < 60.0 + OPTIONS.pass_length_mm / 2.0


def test_points_at_which_the_corrected_model_has_no_pose_are_left_out_of_what_runs_are_worth():
    """A leg that is much too short reaches some of the points only."""
    case = case_of(measure(plan=plan_of(trajectories=LINES[1:])), {"leg_asymmetry": EFFECTS["leg_asymmetry"]})
    plain = calibrate(case)
    for shift_mm in np.linspace(-50.0, -700.0, 66):
        state = State(plain.deviations, {("leg_asymmetry", 0): np.tile([0.0, 0.0, shift_mm], 3)})
        posed = np.isfinite(case.residual(state)).all(axis=1)
        if 0 < posed.sum() < len(posed):
            break
    assert 0 < posed.sum() < len(posed)
    with pytest.raises(FitError, match="no pose"):
        case.linearise(state, [])
    reached = reachable(case, state)
    assert reached.count == posed.sum()
    assert np.isfinite(reached.linearise(state, []).data).all()
    assert reachable(case, plain) is case
