"""Following advice: what is driven is what was advised, by the same robot, and the count of what is settled."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from rrru.campaign import measurements as rows
from rrru.diagnosis.design.advise import candidates
from rrru.diagnosis.design.poses import passes, points_of
from rrru.diagnosis.diagnose import Diagnosis, MeasuredRobot
from rrru.diagnosis.hypothesis import Hypothesis
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.posterior import Posterior
from rrru.diagnosis.settings import GapSettings
from rrru.diagnosis.terms import EffectTerm
from rrru.diagnosis.verdict import decide
from rrru.robots.catalogue import make_mechanism
from rrru.studies.blind_validation import advice
from rrru.studies.blind_validation.robots import noise_free
from tests.diagnosis.campaigns import EFFECTS
from tests.schemas import check
from tests.studies.blind_validation.conditions import CONDITIONS, acting, bare


@pytest.fixture(scope="module")
def robot():
    """A robot with compliant drives and a campaign without payload."""
    plain = bare(5)
    return replace(plain, acting=(acting(plain, "drive_compliance"),))


def _found(entries, tables=None):
    """A made-up Diagnosis by (effects, probability, unexplained) of hypotheses."""
    hypotheses = tuple(
        Hypothesis(tuple(map(EffectTerm, names)), np.zeros(2), np.ones((2, 1))) for names, _, _ in entries
    )
    weights = np.array([[0.0, p] if flag else [p, 0.0] for _, p, flag in entries])
    posterior = Posterior(hypotheses, np.log(np.maximum(weights, 1e-300)), np.tile([False, True], (len(entries), 1)))
    inference = SimpleNamespace(posterior=posterior, problem=SimpleNamespace(effects=EFFECTS))
    return Diagnosis({}, tables or {}, None, inference, decide(posterior, EFFECTS))


def _arm(measurements, probability=0.5, runs=(), poses=None):
    """An Arm of a made-up diagnosis, which names backlash or leaves open whether nothing acts."""
    tables = {"gap_next_runs": pd.DataFrame(runs), "gap_next_poses": pd.DataFrame(poses or {})}
    found = _found([(("backlash",), probability, False), ((), 1.0 - probability, False)], tables)
    return advice.Arm(measurements, (), found)


def test_every_candidate_is_driven_as_it_was_planned(robot):
    measurements = robot.measured(CONDITIONS)
    arm = _arm(measurements)
    choice, table = candidates(measurements)
    for number, run in enumerate(choice, start=1):
        driven = advice.drive(robot, arm, run, CONDITIONS, np.random.default_rng(0))
        longer, runs = driven.measurements, driven.runs
        pd.testing.assert_frame_equal(longer.iloc[: len(measurements)], measurements)
        extra, planned = longer.iloc[len(measurements) :], table[table["run"] == number]
        assert len(runs) == 1 and (extra["run"] == measurements["run"].max() + 1).all()
        np.testing.assert_allclose(rows.command(extra), rows.command(planned), atol=1e-6)
        assert (extra["payload_kg"] == run["payload_kg"]).all() and (extra["speed_mm_s"] == run["speed_mm_s"]).all()
        clock, asked = (frame["time_s"].to_numpy() - frame["time_s"].iloc[0] for frame in (extra, planned))
        np.testing.assert_allclose(clock, asked, atol=1e-6)


def test_the_robot_that_drives_on_is_the_one_that_was_measured(robot):
    """Its own first line once more, without noise, misses by what it missed by at first."""
    free = noise_free(robot, CONDITIONS)
    silent = replace(CONDITIONS, noise_mm=0.0)
    again = next(run for run in candidates(free)[0] if run["run"] == "line_1 once more")
    once = advice.drive(robot, _arm(free), again, silent, np.random.default_rng(0))
    both = advice.drive(robot, once, again, silent, np.random.default_rng(0))
    twice = both.measurements
    first = rows.measured(free[free["trajectory"] == "line_1"])
    for number in (1, 2):
        last = twice[twice["run"] == free["run"].max() + number]
        np.testing.assert_allclose(rows.measured(last), first, atol=1e-9)
    assert len(both.runs) == 2 and twice["time_s"].is_monotonic_increasing


def test_poses_are_driven_one_by_one(robot):
    measurements = robot.measured(CONDITIONS)
    found = passes(measurements, CONDITIONS.mechanism)
    start, end = found.start_mm[:3], found.end_mm[:3]
    listed = {**rows.vector_columns("from", start), **rows.vector_columns("to", end)}
    run = {"kind": "poses", "trajectory": "poses", "reverse": False, "speed_mm_s": 80.0, "payload_kg": 5.0}
    driven = advice.drive(robot, _arm(measurements, poses=listed), run, CONDITIONS, np.random.default_rng(0))
    longer, runs = driven.measurements, driven.runs
    extra = longer.iloc[len(measurements) :]
    assert len(runs) == 3 and extra.groupby("run").size().tolist() == [OPTIONS.points_per_pass] * 3
    np.testing.assert_allclose(rows.command(extra), points_of(start, end).reshape(-1, 3), atol=1e-9)
    # passes are no trajectories to be driven again
    names = {run["trajectory"] for run in candidates(longer)[0]}
    assert names == {run["trajectory"] for run in candidates(measurements)[0]}


def test_random_runs_have_as_many_points_as_the_advised_one(robot):
    measurements = robot.measured(CONDITIONS)
    arm, generator = _arm(measurements), np.random.default_rng(0)
    for points in (0, 26, 40, 100):
        chosen = [advice.random_runs(arm, points, generator) for _ in range(20)]
        count = [sum(run["points"] for run in some) for some in chosen]
        # the last one is needed
        before = [sum(run["points"] for run in some[:-1]) for some in chosen]
        assert min(count) >= max(points, 1) and max(before) < max(points, 1)
    assert len({run["run"] for some in chosen for run in some}) > 5
    assert advice.random_runs(_arm(measurements, 0.95), 26, generator) == []


def test_what_is_unsure_beside_rivals_is_ambiguous():
    verdict_rows = [
        ("label", "sure", 0.95, "backlash", "line_1"),
        ("label", "no rival", 0.5, "", ""),
        ("label", "rival", 0.5, "backlash", ""),
        ("effect", "without its effect", 0.5, "backlash", ""),
        ("label", "advised", 0.5, "", "line_1"),
    ]
    verdicts = pd.DataFrame(verdict_rows, columns=["check", "robot", "probability", "confounded_with", "next_runs"])
    assert advice.ambiguous(verdicts) == ["rival", "advised"]


_PAIR = [
    (("backlash", "servo_lag"), 0.5, False),
    (("backlash", "axis_tilt"), 0.45, False),
    (("backlash",), 0.05, False),
]


@pytest.mark.parametrize(
    ("entries", "sure", "truths"),
    [
        # a cause is sure, whatever small ones may act as well
        (
            [(("backlash",), 0.7, False), *(((("backlash", name), 0.1, False)) for name in list(EFFECTS)[-3:])],
            0.9,
            "backlash",
        ),
        # a group is one decision
        (_PAIR, 0.95, "backlash+servo_lag"),
        (_PAIR, 0.95, "axis_tilt+backlash"),
        ([((), 0.97, False), (("backlash",), 0.03, False)], 0.97, "none"),
        ([((), 0.98, True), (("backlash",), 0.02, True)], 0.98, "outside:cable_pull"),
        # what is left open is a decision, too
        ([(("backlash",), 0.7, False), (("backlash", "servo_lag"), 0.3, False)], 0.7, "backlash"),
    ],
)
def test_a_verdict_is_as_sure_as_its_least_sure_decision(entries, sure, truths):
    found = _found(entries)
    assert advice.least_sure_probability(found) == pytest.approx(sure)
    assert advice.names_the_truth(truths, advice.answer(found))
    assert not advice.names_the_truth("thermal_growth", advice.answer(found))


def test_a_verdict_without_a_true_cause_or_with_a_false_one_is_wrong():
    parts = {frozenset(["backlash"]): 1.0, frozenset(["servo_lag", "axis_tilt"]): 1.0}
    assert advice.names_the_truth("backlash+servo_lag", parts)
    wrong = ("backlash", "servo_lag", "backlash+thermal_growth", "axis_tilt+backlash+servo_lag", "none", "outside:bump")
    assert not any(advice.names_the_truth(truth, parts) for truth in wrong)


def test_advice_is_followed_and_counted(robot, monkeypatch):
    monkeypatch.setattr(advice, "SURE", 1.1)
    monkeypatch.setattr(advice, "ROUNDS", 2)
    known = MeasuredRobot(make_mechanism("rrru3", {}), CONDITIONS.masses, CONDITIONS.noise_mm, robot.name)
    # few effects: how a diagnosis decides is no matter here
    library = GapSettings(("backlash", "drive_compliance", "servo_lag", "thermal_growth"), draws=50)
    measurements = robot.measured(CONDITIONS)
    followed = [pd.DataFrame(advice.follow(robot, measurements, CONDITIONS, known, library)) for _ in range(2)]
    pd.testing.assert_frame_equal(*followed)
    table = check("withheld_advice", followed[0])
    assert table["round"].tolist() == [1, 2] and (table["random_run"] != "").all() and not table["settled_random"].any()
    assert table["truth"].unique().tolist() == ["drive_compliance"]
    followed = pd.concat([table.assign(robot=f"{k}", settled_advised=k < 3, kind="run") for k in range(4)])
    summary = check("withheld_advice_summary", advice.advice_summary(followed))
    last = summary[summary["round"] == 2].set_index(["group", "run"])
    assert last.loc[("all", "advised"), ["robots", "settled", "value"]].tolist() == [4, 3, 0.75]
    assert last.loc[("a run is advised", "random"), ["robots", "settled"]].tolist() == [4, 0]
    assert last.loc[("poses are advised", "random"), "robots"] == 0
    assert last["value"].isna().sum() == 4 and last.loc[("all", "advised"), "low"] == pytest.approx(0.3006, abs=1e-3)
