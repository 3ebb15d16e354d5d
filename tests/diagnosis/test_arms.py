"""The diagnosis of a six-axis arm at stops in no order: rough functions of the drives and sharp waves are separated."""

from dataclasses import replace

import numpy as np
import pytest

from rrru.campaign import measurements as rows
from rrru.diagnosis.diagnose import MeasuredRobot, diagnose
from rrru.diagnosis.make_problem import make_diagnosis_problem
from rrru.diagnosis.result_notes import MASSES_UNKNOWN, MOUNTING_ASSUMED
from rrru.diagnosis.settings import GapSettings
from rrru.diagnosis.verdict_facts import answer
from rrru.effects import drive_error_function
from rrru.effects.library import find
from rrru.robots.from_dh import from_dh
from tests.diagnosis import arms

_EFFECTS = (
    "drive_error_function",
    "transmission_orders",
    "transmission_error",
    "drive_compliance",
    "encoder_eccentricity",
)
_COUNT = 200


@pytest.fixture(autouse=True)
def few_orders(monkeypatch):
    """Rough functions of sixteen waves per turn: 192 coefficients, which 200 stops determine."""
    monkeypatch.setattr(drive_error_function, "ORDERS", np.arange(1, 17))


def _diagnosed(acting, seed):
    frame = arms.measure(acting, _COUNT, seed)
    robot = MeasuredRobot(arms.reading(frame), arms.MASSES, arms.NOISE_MM, "arm", arms.NOISE_RAD)
    return diagnose(frame, robot, GapSettings(_EFFECTS, draws=10), details=False)


def test_distances_are_those_of_positions_where_orientations_are_read_too():
    """Turns of a precise instrument weigh 5 m: mixed with positions they would state eleven times the distance."""
    effect = find("encoder_eccentricity", arms.ARM)
    acting = arms.active("", np.full(len(effect.coordinates), 4e-4), {}, effect)
    noise = arms.NOISE_MM, 4e-6
    frame = arms.measure((acting,), _COUNT, 1, noise)
    robot = MeasuredRobot(arms.reading(frame), arms.MASSES, noise[0], "arm", noise[1])
    found = diagnose(frame, robot, GapSettings(("encoder_eccentricity",), draws=50))
    problem = found.inference.problem
    assert problem.characteristic_length_mm == pytest.approx(5000.0)
    left = problem.left(found.inference.calibrated)[: len(frame)]
    squares = (left**2).sum(axis=1) - 3.0 * noise[0] ** 2
    true = np.sqrt(squares.mean())
    assert found.verdict["gap_rms_mm"] == pytest.approx(true, rel=0.1)
    assert found.verdict["gap_after_rms_mm"] < noise[0]
    shrink, budget, places = (found.tables[name] for name in ("gap_shrink", "gap_budget", "gap_locate"))
    assert (shrink["points"] == len(frame)).all()
    assert shrink.query("kind == 'resimulated'")["rms_mm"].item() == pytest.approx(np.sqrt(3.0) * noise[0], rel=0.15)
    effect = budget.query("part == 'encoder_eccentricity'").iloc[0]
    assert effect["rms_mm"] == pytest.approx(true, rel=0.1) and effect["share"] == pytest.approx(1.0, abs=0.1)
    assert budget.query("kind != 'sampling'")["share"].sum() == pytest.approx(1.0)
    axes = places.query("factor == 'direction'")
    np.testing.assert_allclose(axes["rms_mm"], np.sqrt((left**2).mean(axis=0)))
    assert axes["share"].sum() == pytest.approx(1.0) and (axes["points"] == len(frame)).all()
    assert places.query("factor == 'trajectory'")["rms_mm"].item() == pytest.approx(
        np.sqrt((left**2).sum(axis=1).mean())
    )
    drives = places.query("factor == 'drive'")
    assert drives["share"].sum() == pytest.approx(1.0) and drives["share_of_noise"].sum() == pytest.approx(1.0)


def _rough(spectrum, seed):
    """A function of each drive drawn from the effect's own prior, and its coefficients (c,)."""
    effect = find("drive_error_function", arms.ARM)
    size = effect.coordinates.spectra[spectrum]
    values = size * np.random.default_rng(100 + seed).standard_normal(len(size))
    return arms.active("", values, {}, effect), values


@pytest.mark.parametrize(("spectrum", "seed"), [(3, 1), (3, 3), (4, 0), (5, 1), (7, 2), (1, 0), (9, 1)])
def test_a_rough_function_of_all_drives_is_named(spectrum, seed):
    acting, truth = _rough(spectrum, seed)
    found = _diagnosed((acting,), seed)
    assert found.verdict["effects"] == "drive_error_function" and found.verdict["share_closed"] > 0.8
    assert found.verdict["noise_rms_mm"] == pytest.approx(np.sqrt(3.0) * arms.NOISE_MM, rel=0.15)
    (values,) = found.state.effects.values()
    # functions along the drives' ranges, except for what the calibration's own parameters make
    motion = found.inference.problem.motion
    effect = found.inference.problem.library["drive_error_function"]
    made = zip(effect.along_drives(motion), acting.effect.along_drives(motion), np.split(truth, 6), strict=True)
    for drive, (functions, every, true) in enumerate(made, 1):
        whole = every @ true
        off = functions @ values[effect.coordinates.legs == drive] - whole
        assert np.std(off) < 0.5 * np.std(whole)


def _sharp(waves, size_rad, seed):
    """Waves (drive, order) of phases and sizes about one, drawn."""
    effect, generator = find("transmission_orders", arms.ARM).with_waves(waves), np.random.default_rng(seed)
    size, phase = size_rad * generator.uniform(0.7, 1.3, len(waves)), generator.uniform(-np.pi, np.pi, len(waves))
    values = np.stack([size * np.cos(phase), size * np.sin(phase)], axis=1).ravel()
    return arms.active("", values, {}, effect), size


@pytest.mark.parametrize(
    ("waves", "size_rad"),
    [
        (((0, 17.0), (2, 31.0), (4, 9.0)), 2e-4),
        (((0, 7.15), (3, 53.7), (4, 34.8)), 5e-5),
        (((1, 39.2), (3, 19.9), (0, 28.2)), 1e-4),
    ],
)
def test_three_sharp_orders_of_different_drives_are_named(waves, size_rad):
    acting, size = _sharp(waves, size_rad, 4)
    found = _diagnosed((acting,), 4)
    assert found.verdict["effects"] == "transmission_orders" and found.verdict["share_closed"] > 0.7
    problem = found.inference.problem
    effect, (values,) = problem.library["transmission_orders"], found.state.effects.values()
    amplitudes = {}
    for parameter, sine, cosine in zip(effect.parameters.names[::2], values[::2], values[1::2], strict=True):
        _, drive, order = parameter.split("_")
        amplitudes[int(drive) - 1, float(order)] = np.hypot(sine, cosine)
    step = 2.0 * np.pi / np.ptp(problem.motion.drive, axis=0)
    for (drive, order), amplitude in zip(waves, size, strict=True):
        near = [a for (k, one), a in amplitudes.items() if k == drive and abs(one - order) < 0.3 * step[k]]
        assert near and max(near) == pytest.approx(amplitude, rel=0.35)


def test_sharp_orders_are_found_behind_an_effect_that_hides_them():
    """Compliant drives make a gap twenty times theirs, which looks like many waves at first."""
    acting, _ = _sharp(((0, 17.0), (2, 31.0), (4, 9.0)), 6e-5, 1)
    found = _diagnosed((acting, arms.active("drive_compliance", [5e-8] * 6)), 1)
    named = set(found.verdict["effects"].split("+"))
    # one drive's wave is a transmission error of that drive alone as well
    assert {"drive_compliance", "transmission_orders"} <= named
    assert named <= {"drive_compliance", "transmission_orders", "transmission_error"}
    waves = list(found.inference.problem.library["transmission_orders"].waves)
    if "transmission_error" in named:
        own = found.tables["gap_parameters"].set_index(["effect", "parameter"])["value"]["transmission_error"]
        waves.append((int(own.filter(like="amplitude").argmax()), own["ratio"]))
    for drive, order in ((0, 17.0), (2, 31.0), (4, 9.0)):
        assert any(one == drive and abs(other - order) < 0.1 for one, other in waves)
    assert found.verdict["share_closed"] > 0.95


@pytest.mark.parametrize("seed", [0, 3])
def test_nothing_is_named_where_nothing_acts(seed):
    found = _diagnosed((), seed)
    assert found.verdict["effects"] == "none" and found.verdict["probability"] > 0.5
    assert "transmission_orders" not in found.inference.problem.library
    assert found.verdict["gap_rms_mm"] < 0.5 * found.verdict["noise_rms_mm"]


def _soft(robot, payload_kg, noise_mm=0.02, effects=("drive_compliance", "encoder_eccentricity"), built=arms.ARM):
    """Diagnosis of an arm, as `built`, with soft joints 2 and 3, by the masses of `robot`; half of the poses carry a
    payload.
    """
    drive, generator = arms.drives(120, np.random.default_rng(4)), np.random.default_rng(5)
    frame = arms.commands(drive)
    frame = frame.assign(payload_kg=np.repeat([0.0, payload_kg], 60), run=np.repeat([1, 2], 60))
    frame = frame.assign(**rows.vector_columns("measured", rows.command(frame)))
    springs = arms.active("drive_compliance", [0.0, 8e-9, 8e-9, 0.0, 0.0, 0.0])
    motion = make_diagnosis_problem(frame, built, arms.MASSES, 1.0, {}).motion
    twists = built.twists_of(arms.ERRORS) + springs.contribute(motion).twists
    position = built.measured(built.solve(drive, rows.command(frame), twists), twists)
    frame = frame.assign(**rows.vector_columns("measured", position + noise_mm * generator.standard_normal((120, 3))))
    settings = GapSettings(effects, draws=20)
    seen = replace(robot, parameter_set="full").with_measurement_config(rows.measurement_config(frame))
    return diagnose(frame, MeasuredRobot(seen, arms.MASSES, noise_mm), settings)


@pytest.mark.parametrize("payload_kg", [0.0, 5.0])
def test_the_weight_of_links_without_masses_is_no_error_of_an_encoder(payload_kg):
    """About a level axis a link's weight turns a soft joint by a sine, as the eccentricity of its encoder would."""
    lacking = replace(arms.ARM, point_masses=())
    effects = "drive_compliance", "encoder_eccentricity", "encoder_ovality", "transmission_error", "base_drift"
    found = _soft(lacking, payload_kg, effects=effects)
    assert set(found.verdict["effects"].split("+")) == {"drive_compliance"}
    assert found.verdict["noise_rms_mm"] == pytest.approx(np.sqrt(3.0) * 0.02, rel=0.1)
    numbers = found.tables["gap_parameters"].set_index("parameter")
    for drive in (2, 3):
        low, high = numbers.loc[f"compliance{drive}", ["low_95", "high_95"]]
        assert low < 8e-9 < high
        # known by the payload alone
        assert (high - low < 4e-9) == (payload_kg > 0.0)


@pytest.mark.parametrize("payload_kg", [0.0, 5.0])
def test_a_compliance_has_a_size_only_where_the_masses_are_stated(payload_kg):
    """The same readings with the masses of the links and without them."""
    stated, lacking = (_soft(robot, payload_kg) for robot in (arms.ARM, replace(arms.ARM, point_masses=())))
    said = answer("a", stated.verdict, stated.tables)
    (cause,) = (one for one in said["sentences"] if "is drive compliance" in one)
    # joint 1 is upright and has no load, the others are stiff
    assert "compliance2 = " in cause and "compliance3 = " in cause and "compliance1" not in cause
    assert MASSES_UNKNOWN not in said["notes"]
    said = answer("a", lacking.verdict, lacking.tables)
    assert MASSES_UNKNOWN in said["notes"] and not any("more than stated" in note for note in said["notes"])
    (cause,) = (one for one in said["sentences"] if "is drive compliance" in one)
    if payload_kg:
        assert "compliance2 = " in cause and "compliance3 = " in cause and "compliance1" not in cause
    assert ("Its size is not determined" in cause) == (payload_kg == 0.0)
    assert ("rad/(N m)" in cause) == (payload_kg > 0.0)


@pytest.mark.parametrize("grown", [(1,), (0, 1, 2, 3, 5)], ids=["one link", "all links"])
def test_a_link_that_grows_alone_is_told_from_a_robot_that_grows(grown):
    """Poses of robots made anew from rows of DH numbers, whose lengths grow with the time of each stop."""
    strain, constant_s, count = 4e-4, 1200.0, 120
    drive, time = arms.drives(count, np.random.default_rng(6)), 30.0 * np.arange(count)
    frame = arms.commands(drive).assign(time_s=time, payload_kg=0.0)
    position = np.empty((count, 3))
    for k, t in enumerate(time):
        longer = 1.0 + strain * -np.expm1(-t / constant_s)
        lengths = [
            {key: value * longer for key, value in row.items() if key in ("a_mm", "d_mm") and number in grown}
            for number, row in enumerate(arms._ROWS)
        ]
        rows_now = [row | changed for row, changed in zip(arms._ROWS, lengths, strict=True)]
        position[k] = from_dh(rows_now, name="six_axis", tool_mm=arms.ARM.tool_mm).forward(drive[k : k + 1])[0]
    position += arms.NOISE_MM * np.random.default_rng(7).standard_normal(position.shape)
    frame = frame.assign(**rows.vector_columns("measured", position))
    settings = GapSettings(("thermal_growth", "link_growth", "base_drift", "encoder_eccentricity"), draws=20)
    found = diagnose(frame, MeasuredRobot(arms.reading(frame), arms.MASSES, arms.NOISE_MM), settings, details=False)
    name, parameter = ("link_growth", "strain2") if len(grown) == 1 else ("thermal_growth", "strain")
    assert found.verdict["effects"] == name
    numbers = found.tables["gap_parameters"].query("effect == @name").set_index("parameter")
    assert numbers.loc[parameter, "low_95"] < strain < numbers.loc[parameter, "high_95"]
    assert numbers.loc["time_constant", "low_95"] < constant_s < numbers.loc["time_constant", "high_95"]
    if len(grown) == 1:
        assert found.verdict["leg"] == 2


def test_an_arm_on_a_wall_has_its_compliance_by_the_stated_mounting():
    """The same readings with `up` stated and without it: the note says what is assumed, and disappears."""
    wall = replace(arms.ARM, up=(1.0, 0.0, 0.0), up_stated=True)
    found = _soft(wall, 5.0, built=wall)
    assert found.verdict["effects"] == "drive_compliance"
    assert MOUNTING_ASSUMED not in answer("a", found.verdict, found.tables)["notes"]
    numbers = found.tables["gap_parameters"].set_index("parameter")
    for drive in (2, 3):
        low, high = numbers.loc[f"compliance{drive}", ["low_95", "high_95"]]
        assert low < 8e-9 < high
    assumed = _soft(arms.ARM, 5.0)
    assert MOUNTING_ASSUMED in answer("a", assumed.verdict, assumed.tables)["notes"]


@pytest.mark.parametrize(("law", "joint"), [("warming", 2), ("warming", 4), ("slip", 3)])
def test_a_zero_that_moves_is_that_drives_whatever_else_changes_with_time(law, joint):
    """Positions of the arm at drive values that nobody commanded. A slip follows no law of the library."""
    generator, count, size = np.random.default_rng(joint), 120, 6e-4
    drive, time = arms.drives(count, generator), 20.0 * np.arange(count)
    frame = arms.commands(drive).assign(time_s=time)
    share = -np.expm1(-time / 900.0) if law == "warming" else (time > time.mean()).astype(float)
    stands = drive + size * np.outer(share, np.arange(6) == joint - 1)
    twists = arms.ARM.twists_of(arms.ERRORS)
    position = arms.ARM.measured(arms.ARM.solve(stands, arms.ARM.forward(stands), twists), twists)
    frame = frame.assign(**rows.vector_columns("measured", position + 0.02 * generator.standard_normal((count, 3))))
    robot = MeasuredRobot(arms.reading(frame), arms.MASSES, 0.02)
    found = diagnose(frame, robot, GapSettings(draws=20), details=False)
    if law == "slip":
        assert set(found.verdict["effects"].split("+")) <= {"zero_drift", "unexplained"}
        # between the stops before and after it, 20 s apart
        moment = time.mean()
        assert found.tables["gap_remainder"]["follows"].iloc[0] == (
            f"a jump at {moment:g} s, as a zero offset of joint {joint}"
        )
        # no effect is in the model that moves left-out points away
        assert found.verdict["gap_after_rms_mm"] <= found.verdict["gap_rms_mm"]
        return
    assert found.verdict["effects"] == "zero_drift" and found.verdict["leg"] == joint
    numbers = found.tables["gap_parameters"].query("effect == 'zero_drift'").set_index("parameter")
    low, high = numbers.loc[f"drift{joint}", ["low_95", "high_95"]]
    assert low < size < high
