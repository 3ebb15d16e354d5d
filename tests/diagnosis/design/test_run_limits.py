"""Limits of proposed runs against loads and rates that are computed from the runs themselves."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from rrru.campaign import measurements as rows
from rrru.campaign.plan import make_plan
from rrru.campaign.trajectories import Line
from rrru.diagnosis.design.advise import candidates
from rrru.diagnosis.design.run_limits import StatedLimits, moved_kg, run_limits
from rrru.diagnosis.make_problem import make_diagnosis_problem
from rrru.diagnosis.options import OPTIONS
from rrru.kinematics.dynamics import Masses
from rrru.robots.catalogue import make_mechanism
from rrru.simulation.virtual_robot import VirtualRobot
from tests.diagnosis.campaigns import FORWARD, LINES, MASSES, measure, plan_of, problem_of
from tests.places import ROOT

ARM = make_mechanism("arm6", {"urdf": str(ROOT / "data/models/arm6.urdf")}, parameter_set="zero")
NO_MASSES = Masses(0.0, 0.0, 0.0)


@pytest.fixture(scope="module")
def line():
    """Measurements along one line at 80 mm/s, without a payload, of the parallel robot."""
    return measure(plan=plan_of((FORWARD,), LINES[:1]))


@pytest.fixture(scope="module")
def reached():
    """The same of an arm of a URDF that states efforts and velocities, along a line that nearly stretches it."""
    plan = make_plan([Line("line", (450.0, -250.0, 900.0), (850.0, 250.0, 900.0), 20)], [FORWARD], 80.0, 40.0, 60.0)
    table, _ = VirtualRobot(ARM).run(plan, 0.0, np.random.default_rng(0))
    assert (table["status"] == "ok").all()
    return table


def _arm_problem(table, payload_kg=0.0):
    return make_diagnosis_problem(table.assign(payload_kg=payload_kg), ARM, NO_MASSES, 0.02, {})


def _limits(table, **stated):
    return run_limits(problem_of(table, {}), MASSES, StatedLimits(**stated))[0]


def test_without_limits_a_payload_is_proposed_where_the_robot_moves_at_least_twice_as_much(line):
    problem = problem_of(line, {})
    assert moved_kg(problem.mechanism, MASSES) == pytest.approx(3.0 + 3 * 1.2 + 3 * 2.0)
    limits, why = run_limits(problem, MASSES, StatedLimits())
    assert (limits.loaded_kg(0.0), why) == (5.0, "")
    small, why = run_limits(problem, Masses(0.5, 0.3, 0.2), StatedLimits())
    assert small.loaded_kg(0.0) == 0.0
    assert why == "no run with a payload is proposed, the robot moves 2 kg itself: state limits.payload_kg"
    unknown, why = run_limits(problem, NO_MASSES, StatedLimits())
    assert unknown.loaded_kg(0.0) == 0.0 and "the mass of the robot itself is not stated" in why
    heavy = run_limits(problem_of(line.assign(payload_kg=5.0), {}), MASSES, StatedLimits())[0]
    assert heavy.loaded_kg(5.0) == 6.0


def test_stated_limits_are_what_is_proposed_and_never_exceeded(line):
    choice, _ = candidates(line, _limits(line, payload_kg=2.0, speed_mm_s=120.0))
    assert {run["payload_kg"] for run in choice} == {0.0, 2.0} and {run["speed_mm_s"] for run in choice} == {
        80.0,
        120.0,
    }
    assert {run["run"] for run in choice} > {"line_1 at 120 mm/s", "line_1 with 2 kg payload"}
    plain, _ = candidates(line, _limits(line, payload_kg=0.0, speed_mm_s=80.0))
    assert [run["run"] for run in plain] == ["line_1 once more", "line_1 in reverse"]
    assert candidates(line, _limits(line, speed_mm_s=50.0))[0] == []


def test_a_run_whose_payload_changes_is_driven_again_with_its_payloads_and_loaded_with_more(line):
    """Payloads were the first point's: without one and then with 6 kg, 5 kg were proposed."""
    carried = np.where(np.arange(len(line)) < len(line) // 2, 0.0, 1.0)
    choice, table = candidates(line.assign(payload_kg=carried), _limits(line))
    for number, run in enumerate(choice, 1):
        planned = table.loc[table["run"] == number, "payload_kg"].to_numpy()
        if "payload" in run["run"]:
            assert run["payload_kg"] == 6.0 and (planned == 6.0).all()
        else:
            assert run["payload_kg"] == 1.0
            np.testing.assert_array_equal(planned, carried[::-1] if run["reverse"] else carried)


def test_a_run_that_takes_longer_than_allowed_is_not_proposed(line):
    seconds = float(np.ptp(line["time_s"]))
    fast, table = candidates(line, _limits(line, minutes=0.5 * seconds / 60.0))
    assert fast and all(run["speed_mm_s"] == OPTIONS.default_fast_pass_mm_s for run in fast)
    assert table.groupby("run")["time_s"].agg(np.ptp).max() <= 0.5 * seconds
    without = line.assign(time_s=np.nan)
    assert candidates(without, _limits(without, minutes=0.5 * 600.0 / 80.0 / 60.0))[0] == []
    assert candidates(without, _limits(without, minutes=1.5 * 600.0 / 80.0 / 60.0))[0]


def test_the_efforts_of_a_file_leave_the_payload_that_is_proposed(reached):
    limits, why = run_limits(_arm_problem(reached), NO_MASSES, StatedLimits())
    added = limits.loaded_kg(0.0)
    assert added > 0.0 and why == ""
    allowed = OPTIONS.max_effort_share * ARM.effort_limits
    assert (np.abs(_arm_problem(reached, added).motion.drive_load) <= 1.001 * allowed).all()
    weak = replace(ARM, effort_limits=0.1 * ARM.effort_limits)
    nothing, why = run_limits(make_diagnosis_problem(reached, weak, NO_MASSES, 0.02, {}), NO_MASSES, StatedLimits())
    assert nothing.loaded_kg(0.0) == 0.0 and "the efforts of its file leave 0 kg" in why


def test_no_drive_exceeds_its_velocity_in_a_fast_run(reached):
    slow = replace(ARM, velocity_limits=0.1 * ARM.velocity_limits)
    for robot, speed in ((ARM, OPTIONS.default_fast_pass_mm_s), (slow, None)):
        limits, _ = run_limits(make_diagnosis_problem(reached, robot, NO_MASSES, 0.02, {}), NO_MASSES, StatedLimits())
        choice, table = candidates(reached, limits)
        fast = max(run["speed_mm_s"] for run in choice)
        assert fast == speed if speed else 80.0 < fast < OPTIONS.default_fast_pass_mm_s
        for _, run in table.groupby("run"):
            rate = np.abs(np.diff(rows.actuators(run, ARM), axis=0)) / np.diff(run["time_s"])[:, None]
            assert (rate <= robot.velocity_limits).all()
    # as fast as the drives allow, to two digits
    assert (rate.max(axis=0) / slow.velocity_limits).max() > 0.2
    stopped = replace(ARM, velocity_limits=0.01 * ARM.velocity_limits)
    limits, _ = run_limits(make_diagnosis_problem(reached, stopped, NO_MASSES, 0.02, {}), NO_MASSES, StatedLimits())
    assert {run["speed_mm_s"] for run in candidates(reached, limits)[0]} == {80.0}


def test_a_table_without_speeds_has_no_fast_run(line):
    table = pd.concat([line]).assign(speed_mm_s=np.nan)
    assert all("mm/s" not in run["run"] for run in candidates(table, _limits(table))[0])
