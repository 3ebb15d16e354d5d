"""The robots whose cause is withheld: drawn by a seed, as strong as they say, rich enough, and from outside where they
say so.
"""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chisquare

from rrru.campaign import measurements as rows
from rrru.diagnosis.make_problem import make_diagnosis_problem
from rrru.errors import ConfigError
from rrru.kinematics import singularity
from rrru.robots.catalogue import make_mechanism
from rrru.seeds import stream
from rrru.simulation.virtual_robot import VirtualRobot
from rrru.studies.blind_validation import draw
from rrru.studies.blind_validation.causes import EFFECTS, OUTSIDE
from rrru.studies.blind_validation.chunks import Member, check, chunks, noise_of
from rrru.studies.blind_validation.noise import NOISES, NoiseModel
from rrru.studies.blind_validation.robots import noise_free, robot_of, true_gap_mm
from rrru.studies.blind_validation.score import limits, with_truth
from rrru.studies.blind_validation.verdicts import PLANTS
from tests.studies.blind_validation.conditions import CONDITIONS, acting, bare, section

_MECHANISM = CONDITIONS.mechanism
_CONFIG = {"campaigns": {"paper": {}}, "robots": {"rrru3": {"L1_mm": 400.0}, "mine": {"mjcf": "mine.xml"}}}


def _calibrated(measurements):
    """Deviations (7,) and rms distance in mm of a calibration by repeated linear least squares."""
    theta, measured = rows.actuators(measurements, _MECHANISM), rows.measured(measurements)
    deviations = np.zeros(7)
    for _ in range(6):
        model = _MECHANISM.forward(theta, deviations, rows.command(measurements))
        slope = _MECHANISM.parameter_jacobian(model, theta, deviations).reshape(-1, 7)
        deviations = deviations + np.linalg.lstsq(slope, (measured - model).ravel(), rcond=None)[0]
    left = measured - _MECHANISM.forward(theta, deviations, rows.command(measurements))
    return deviations, np.sqrt((left**2).sum(axis=1).mean())


# nothing (on a full campaign), one effect, two, one from outside
@pytest.mark.parametrize("number", [22, 24, 9, 26])
def test_a_robot_is_its_seed_and_survives_as_text(number):
    member = Member("label", "", number)
    robot = draw.draw(member, CONDITIONS)
    assert robot == draw.draw(member, CONDITIONS)
    assert robot != draw.draw(member, replace(CONDITIONS, seed=2022))
    assert robot_of(robot.answer(CONDITIONS)["drawn"]) == robot
    campaign = robot.campaign(CONDITIONS)
    measured, again = (rows.measured(campaign.run()[0]) for _ in range(2))
    np.testing.assert_array_equal(measured, again)
    assert (measured != rows.measured(replace(campaign, seed=1).run()[0])).all()


@pytest.mark.parametrize("effect", EFFECTS)
def test_an_effect_is_as_strong_as_the_answer_says(effect):
    robot = draw.draw(Member("effect", effect, 0), replace(CONDITIONS, seed=5))
    answer = robot.answer(CONDITIONS)
    assert answer["truth"] == effect and 2.0 <= answer["strength"] <= 10.0
    measurements, truth = replace(robot.campaign(CONDITIONS), noise_mm=0.0).run()
    _, gap = _calibrated(measurements)
    np.testing.assert_allclose(gap / CONDITIONS.noise_rms_mm, answer["strength"], rtol=1e-3)
    np.testing.assert_array_equal(rows.measured(measurements), truth[[f"true_{axis}_mm" for axis in "xyz"]])


def test_one_leg_means_that_leg_alone():
    robot = bare(3)
    alone = Counter()
    for seed in range(12):
        cause = acting(robot, "servo_lag", True, (0.5, 1.0), seed)
        coordinates = np.array(cause.coordinates)
        assert (coordinates >= 0.0).all()
        assert not cause.leg or (np.flatnonzero(coordinates) == cause.leg - 1).all()
        alone[bool(cause.leg)] += 1
    assert 1 <= alone[True] <= 8
    # a pair, or an effect without legs, sits on none alone
    assert acting(robot, "thermal_growth", True, (0.5, 1.0)).leg == 0


def test_truths_come_in_the_stated_shares(monkeypatch):
    drawn = Counter()
    monkeypatch.setattr(draw, "draw_trajectories", lambda *_: {})
    monkeypatch.setattr(draw, "true_gap_mm", lambda *_: 1.0)
    monkeypatch.setattr(draw, "draw_acting", lambda robot, name, *_: name)
    effects, kinds = Counter(), Counter()
    for number in range(2000):
        robot = draw.draw(Member("label", "", number), CONDITIONS)
        outside = any(name in OUTSIDE for name in robot.acting)
        drawn["outside" if outside else ("none", "one", "two")[len(robot.acting)]] += 1
        effects.update(robot.acting)
        kinds[robot.kind] += 1
    for truth, share in draw.TRUTHS.items():
        np.testing.assert_allclose(drawn[truth] / 2000, share, atol=0.03)
    assert set(effects) == {*EFFECTS, *OUTSIDE}
    counts = np.array([effects[name] for name in EFFECTS])
    assert chisquare(counts).pvalue > 1e-3
    np.testing.assert_allclose(kinds["full"] / 2000, 0.5, atol=0.04)


def test_the_full_campaign_has_what_a_field_campaign_has():
    measurements = noise_free(bare(1, "full"), CONDITIONS)
    assert len(measurements) == 732 and measurements["run"].nunique() == 26
    assert set(measurements["speed_mm_s"]) == {80.0, 300.0} and set(measurements["payload_kg"]) == {0.0, 5.0}
    assert (measurements.groupby("run")["trajectory"].first() == "line_1").sum() == 6
    assert set(rows.direction(measurements)) == {-1, 1}
    fast = measurements[(measurements["speed_mm_s"] == 300.0) & (measurements["trajectory"] == "line_1")]
    length = np.linalg.norm(rows.command(fast)[-1] - rows.command(fast)[0])
    # a trapezoid: rest to rest at 300 mm/s with 400 mm/s^2
    np.testing.assert_allclose(fast["time_s"].iloc[-1] - fast["time_s"].iloc[0], length / 300.0 + 300.0 / 400.0)
    assert len(noise_free(bare(1), CONDITIONS)) == 222


def test_campaigns_keep_clear_of_singularities_and_fresh_runs_go_elsewhere():
    for number in range(5):
        robot = bare(number)
        points = robot.plan(CONDITIONS).targets()
        theta = _MECHANISM.inverse(points)
        for measure_of in (singularity.translational_measure, singularity.constraint_measure):
            assert measure_of(_MECHANISM, points, theta).min() > 0.1
        other = draw.fresh(robot, CONDITIONS)
        assert other.deviations == robot.deviations and other.acting == robot.acting
        assert np.abs(other.plan(CONDITIONS).targets() - points).max() > 5.0


def test_deviations_alone_leave_no_gap():
    robot = bare(2)
    assert true_gap_mm(robot, CONDITIONS) < 1e-6
    deviations, _ = _calibrated(noise_free(robot, CONDITIONS))
    np.testing.assert_allclose(deviations, robot.deviations, atol=1e-6)


@pytest.mark.parametrize("name", OUTSIDE)
def test_a_cause_from_outside_is_physical_and_no_effect_of_the_library_is_confounded_with_it(name):
    robot = bare(0, "full")
    cause = acting(robot, name)
    robot = replace(robot, acting=(cause,))
    assert robot.truth == f"outside:{name}"
    campaign = robot.campaign(CONDITIONS)
    virtual = replace(campaign.robot, deviations={})
    motion = virtual.motion(campaign.plan, _MECHANISM.inverse)
    moved, _ = virtual.positions(motion, motion.position_mm)
    still, _ = VirtualRobot(mechanism=_MECHANISM).positions(motion, motion.position_mm)
    at = _MECHANISM.map_at(motion.drive, motion.position_mm)
    first = at.move(cause.effect_model.contribute(motion, cause.values).twists)
    np.testing.assert_allclose(moved - still, first, atol=0.02 * np.abs(first).max())
    measurements, _ = campaign.run()
    deviations, _ = _calibrated(measurements)
    problem = make_diagnosis_problem(
        measurements, _MECHANISM, CONDITIONS.masses, 0.02, with_truth(EFFECTS, robot.acting)
    )
    limit = limits(problem, deviations, robot.acting, list(EFFECTS))
    # a library that could make this gap would leave 50 once in a million noises
    assert limit.oracle_detects and limit.rival_chi2 > 50.0


def test_the_laws_from_outside_do_as_they_say():
    motion = VirtualRobot(mechanism=_MECHANISM).motion(bare(0).plan(CONDITIONS), _MECHANISM.inverse)
    run = np.cumsum(np.diff(motion.time_s, prepend=0.0) > 30.0)
    jumps = OUTSIDE["rehoming"].contribute(motion, np.array([1e-3, 2e-3, 0.0, 1.0])).twists
    jumps = _MECHANISM.drive_errors(jumps)
    for number in range(8):
        assert (np.ptp(jumps[run == number], axis=0) == 0.0).all()
    assert np.unique(jumps[:, 0]).size == 8 and np.abs(jumps).max(axis=0)[0] <= 1e-3 and not jumps[:, 2].any()

    def shift(name, values):
        """Shift (n, 3) of what is measured, which is all that the cause does."""
        twists = OUTSIDE[name].contribute(motion, np.array(values)).twists
        assert not twists[:, 1:].any() and not twists[:, 0, 3:].any()
        return twists[:, 0, :3]

    bump = shift("tracker_bump", [0.0, 0.2, 0.0, 0.5])[:, 1]
    assert set(bump) == {0.0, 0.2} and (np.diff(bump) >= 0.0).all()
    assert 0.3 < motion.time_s[bump > 0.0].min() / np.ptp(motion.time_s) - 0.0 < 0.7
    sway = shift("tripod_sway", [0.1, 0.0, 0.0, 10.0])[:, 0]
    np.testing.assert_allclose(sway, 0.1 * np.sin(0.2 * np.pi * motion.time_s), atol=1e-12)
    pull = shift("cable_pull", [1e-3])
    assert 0.0 < (np.linalg.norm(pull, axis=1) > 0.0).mean() < 1.0


def test_robots_as_they_are_have_one_to_six_causes_and_noise_that_is_not_as_stated(monkeypatch):
    """Names and noises alone: what acts is not simulated."""
    monkeypatch.setattr(draw, "draw_trajectories", lambda *_: {})
    monkeypatch.setattr(draw, "true_gap_mm", lambda *_: 1.0)
    spans = set()

    def drawn(robot, name, single, span, *_):
        spans.add(span)
        return name

    monkeypatch.setattr(draw, "draw_acting", drawn)
    counts, outside, noises = Counter(), 0, Counter()
    for number in range(900):
        robot = draw.draw(Member("as_robots_are", "", number), CONDITIONS)
        (axes,) = robot.background
        assert axes.effect == "joint_axis_error"
        own = [name for name in robot.acting if name in EFFECTS]
        assert len(set(own)) == len(own) and len(robot.acting) - len(own) == (number % 3 == 1)
        outside += len(robot.acting) - len(own)
        counts[len(own)] += 1
        assert 0.0 <= robot.noise["scatter"] <= draw.MOST_SCATTER
        noises[tuple(sorted(robot.noise.keys() - {"scatter"}))] += 1
    assert spans == {(0.3, 30.0)} and outside == 300
    assert set(counts) == {1, 2, 3, 4, 5, 6} and chisquare(list(counts.values())).pvalue > 1e-3
    # smaller or larger by a number, axes, along a run, of runs, tails, and scatter alone
    assert set(noises) == {("size",), ("axes",), ("correlation",), ("runs",), ("freedom",), ()}


def test_causes_of_a_robot_as_they_are_are_as_strong_as_they_say():
    # one of two effects and a cause from outside
    number = next(k for k in range(1, 60, 3) if _count(k) == 1)
    robot = draw.draw(Member("as_robots_are", "", number), CONDITIONS)
    assert len(robot.acting) == 2 and robot.acting[-1].outside and robot_of(robot.answer(CONDITIONS)["drawn"]) == robot
    for one in robot.acting:
        assert 0.29 < one.strength < 30.5
        alone = replace(robot, acting=(one,), background=())
        np.testing.assert_allclose(true_gap_mm(alone, CONDITIONS) / CONDITIONS.noise_rms_mm, one.strength, rtol=1e-6)
    assert robot.background[0].strength > 0.0
    # what is read is off by more than the exact places are
    off = rows.measured(robot.measured(CONDITIONS)) - rows.measured(noise_free(robot, CONDITIONS))
    noise = NoiseModel(**robot.noise)
    own = (noise.size * np.array(noise.axes)) ** 2 + noise.scatter**2 + noise.runs**2
    np.testing.assert_allclose(off.std(axis=0) / CONDITIONS.noise_mm, np.sqrt(own), rtol=0.35)


def _count(number):
    """How many effects of the library act in a 3-RRRU as it is, from what is drawn before them."""
    generator = stream(CONDITIONS.seed, "withheld", "as_robots_are", number)
    robot = draw.bare("", generator, replace(CONDITIONS, mechanism=_MECHANISM))
    draw.with_background(robot, generator, CONDITIONS)
    draw.noise_not_as_stated(generator)
    return draw.count_of_causes(generator)


def test_chunks_hold_every_robot_once():
    parts = list(chunks(section(robots=7, per_effect=3, effects=list(EFFECTS))).values())
    count = 7 + 3 * len(EFFECTS)
    assert [len(part) for part in parts] == [4] * (count // 4) + [count % 4] * (count % 4 > 0)
    names = [member.name for part in parts for member in part]
    assert names[:8] == [*(f"label_{k:04d}" for k in range(7)), "effect_backlash_0000"]
    assert names[7:] == [f"effect_{effect}_{k:04d}" for effect in EFFECTS for k in range(3)]


def test_chunks_hold_the_robots_of_every_check():
    alike = {"many": 3, "background": 2, "as_robots_are": 7, "mujoco": 4, "own": 3}
    lists = {"effects": ["backlash"], "files": ["a_file", "b_file"], "as_robots_are_files": ["b_file", "c_file"]}
    wanted = section(robots=1, per_effect=1, per_noise=2, chunk=100, **alike, **lists)
    members = [member for chunk in chunks(wanted).values() for member in chunk]
    counted = Counter(member.check for member in members)
    assert counted == {"label": 1, "effect": 1, "noise": 2 * len(NOISES)} | alike
    assert len({member.name for member in members}) == len(members)
    for member in members:
        assert noise_of(member.name) == (member.about if member.check == "noise" else "")
        assert member.taken_out == ("backlash" if member.check == "effect" else "")
        assert member.file == (member.about if member.check in (*PLANTS, "as_robots_are") else "")
    driven = {plant: [(one.about, one.number) for one in members if one.check == plant] for plant in PLANTS}
    # the same robots on either plant, and the files take turns
    assert set(driven["own"]) < set(driven["mujoco"])
    assert Counter(file for file, _ in driven["mujoco"]) == {"a_file": 2, "b_file": 2}
    mixed = Counter(member.file for member in members if member.check == "as_robots_are")
    assert mixed == {"": 3, "b_file": 2, "c_file": 2}


def test_robots_of_a_chunk_have_the_same_drives():
    parts = chunks(section(robots=3, mujoco=4, own=3, files=["a_file", "b_file"], chunk=2))
    assert [len({member.file for member in members}) for members in parts.values()] == [1] * len(parts)
    assert sum(map(len, parts.values())) == 10 and list(parts)[:2] == ["robots_0000", "robots_0002"]


@pytest.mark.parametrize(("key", "value"), [("field", ["nosuch"]), ("effects", ["nosuch"])])
def test_unknown_names_are_refused(key, value):
    right = section(field=["paper"], effects=["backlash"])
    with pytest.raises(ConfigError, match=f"withheld.{key} has 'nosuch'"):
        check(_CONFIG | {"withheld": right | {key: value}})


@pytest.mark.parametrize(
    ("file", "message"),
    [("nosuch", "robots has no 'nosuch'"), ("rrru3", "has the mjcf ''"), ("mine", "has the mjcf 'mine.xml'")],
)
def test_files_that_the_check_has_no_places_in_are_refused(file, message):
    for key in ("files", "as_robots_are_files"):
        with pytest.raises(ConfigError, match=message):
            check(_CONFIG | {"withheld": section(**{key: [file]})})


@pytest.mark.parametrize(
    ("dimensions", "reason"), [({"L3_mm": 500.0}, "out of reach"), ({"R_mm": 1.0}, "near a singularity")]
)
def test_dimensions_without_room_for_the_trajectories_are_refused(dimensions, reason):
    small = make_mechanism("rrru3", dimensions)
    with pytest.raises(ConfigError, match=rf"robots\.rrru3: of 200 drawn trajectories .* 200 are {reason}; allowed: "):
        draw.bare("small", np.random.default_rng(0), replace(CONDITIONS, mechanism=small))
