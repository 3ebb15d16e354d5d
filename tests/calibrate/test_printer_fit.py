"""Printers: the answer of another program found again, foreign answers told apart, what is left diagnosed or called undecidable."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import optimize

from rrru.calibrate import printer_causes, printer_fit, printer_tables
from rrru.calibrate.least_squares import least_squares
from rrru.campaign.printers import read
from rrru.errors import FitError
from rrru.report import tables

SOURCE = Path(__file__).parents[1] / "data" / "linear_delta.json"
ENTRIES = {entry["id"]: entry for entry in json.loads(SOURCE.read_text())}
PRINTERS = {printer.name: printer for printer in read(SOURCE)}
STEP = 1e-5
SETTINGS = {"stopping_step": STEP, "level": 0.05, "imitated_from": 0.95}
NINE = np.array([0.6, 0.002, -0.003, 0.4, -0.3, 0.2, 0.7, -0.5, 0.4])
HEIGHTS, DISTANCES = PRINTERS["printer_16"], PRINTERS["printer_22"]
# noise of a simulated distance; the firmware's weights make a height as much better
NOISE_MM = 0.05


def simulated(printer, errors, noise_mm=0.0, generator=None, scale=1.0, offset_mm=0.0, lean=None):
    """The printer with the readings of a robot with nine true errors, a caliper error and towers that lean (3, 2) outwards and sideways."""
    own = printer_fit.residuals_of(printer, "distances")
    robot, sliders = own.mechanism, own.actuators
    legs = robot.legs(errors)
    height = (sliders + legs[:, 0])[..., None]
    shift = 0.0 if lean is None else height * (lean[:, :1] * robot.radial + lean[:, 1:] * robot.tangent)
    places = robot.forward_of_legs(sliders, legs, shift)
    n, m = len(printer.height_mm), len(printer.distance_mm)
    heights, lengths = places[:n, 2], np.linalg.norm(places[n : n + m] - places[n + m :], axis=1) * scale + offset_mm
    if noise_mm:
        weight = printer_fit.residuals_of(printer).height_weight
        heights = heights + generator.normal(0.0, noise_mm / np.sqrt(weight), n)
        lengths = lengths + generator.normal(0.0, noise_mm, m)
    return replace(printer, height_mm=heights, distance_mm=lengths)


def with_many_heights(printer, side=6):
    """The printer with heights on a grid over its bed; their values are to be simulated."""
    line = np.linspace(-90.0, 90.0, side)
    grid = np.stack([*(part.ravel() for part in np.meshgrid(line, line)), np.full(side**2, 20.0)], axis=-1)
    return replace(printer, height_mm=grid[:, 2], height_drop_mm=-printer.mechanism().inverse(grid))


def diagnosed(printer):
    """Fit, left-out readings, causes by name and the diagnosis of a printer."""
    result = printer_fit.fit_printer(printer, STEP)
    left = printer_causes.left_out(result)
    answers = printer_causes.causes(result, left, SETTINGS["level"], SETTINGS["imitated_from"])
    return result, left, {one.name: one for one in answers}, printer_causes.diagnosis(answers)


@pytest.mark.parametrize("name", PRINTERS)
def test_the_answer_is_that_of_another_refit_and_belongs_where_the_file_is_consistent(name):
    """`refit_max_difference`: how far another least-squares refit landed from the saved answer; 0.0005 is its maker's bar."""
    result = printer_fit.fit_printer(PRINTERS[name], STEP)
    other = ENTRIES[name]["refit_max_difference"]
    assert np.abs(result.there - result.here).max() == pytest.approx(other, rel=0.01, abs=3e-6)
    assert (printer_fit.reason(result) == "") == (other < 5e-4)
    assert result.fit.identifiability.rank == len(result.names) == (9 if ENTRIES[name]["distances"] else 6)


def test_why_an_answer_does_not_belong():
    reasons = {name: printer_fit.reason(printer_fit.fit_printer(printer, STEP)) for name, printer in PRINTERS.items()}
    foreign = {name: text for name, text in reasons.items() if text}
    words = {
        "printer_04": "overwritten after the calibration: endstop_a, endstop_b, endstop_c;",
        "printer_06": "overwritten after the calibration: arm_a, arm_c;",
        "printer_14": "overwritten after the calibration: radius, angle_a, angle_b;",
        "printer_20": "overwritten after the calibration: radius, angle_a, angle_b;",
        "printer_21": "overwritten after the calibration: radius, angle_a, angle_b;",
        "printer_28": "unknown",
        "printer_29": "all endstops are -0.025 mm off alike",
    }
    assert set(foreign) == set(words) and all(words[name] in text for name, text in foreign.items())


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda p: replace(p, height_mm=p.height_mm + 0.3), "all endstops are -0.300 mm off alike"),
        (lambda p: replace(p, endstop_mm=np.round(p.endstop_mm)), "overwritten after the calibration: endstop_a, endstop_b, endstop_c"),
        (lambda p: replace(p, radius_mm=round(p.radius_mm)), "overwritten after the calibration: radius;"),
        (lambda p: replace(p, height_drop_mm=2.0 * p.height_drop_mm), "steps 0.5 times as long"),
        (lambda p: replace(p, height_drop_mm=p.height_drop_mm / 4.0), "steps 4 times as long"),
        (lambda p: replace(p, arm_mm=p.arm_mm + 2.5), "arms of 345.000 mm"),
    ],
)
def test_what_an_owner_changed_afterwards_is_named(change, words):
    try:
        found = printer_fit.reason(printer_fit.fit_printer(change(HEIGHTS), STEP))
    except FitError as error:
        # with wrong steps there may be no answer at all
        found = str(error)
    assert words in found


@pytest.mark.parametrize(("printer", "number"), [(HEIGHTS, 4), (DISTANCES, 2), (DISTANCES, 11)])
def test_a_reading_that_was_changed_afterwards_is_named_with_what_it_was(printer, number):
    heights, distances = printer.height_mm.copy(), printer.distance_mm.copy()
    kind, at = (heights, number) if number < 7 else (distances, number - 7)
    before, kind[at] = kind[at], kind[at] + 0.4
    found = printer_fit.reason(printer_fit.fit_printer(replace(printer, height_mm=heights, distance_mm=distances), STEP))
    assert f"{'height' if number < 7 else 'distance'} {at + 1} being {before:.3f} mm" in found


@pytest.mark.parametrize("printer", [HEIGHTS, DISTANCES], ids=["heights", "distances"])
def test_a_known_truth_is_recovered(printer):
    """True numbers by hand: the radius and the arms are the saved ones with their errors added, the endstop the zero less the arm's rise."""
    truth = NINE if printer.errors == "distances" else np.append(NINE[:6], np.zeros(3))
    result = printer_fit.fit_printer(simulated(printer, truth), STEP)
    arms, radius = printer.arm_mm + truth[6:], printer.radius_mm + 0.6
    zeros = printer.endstop_mm + np.sqrt(printer.arm_mm**2 - printer.radius_mm**2) + truth[3:6]
    expected = [radius, *(printer.angle_deg[:2] + np.degrees(truth[1:3])), *(zeros - np.sqrt(arms**2 - radius**2)), *arms]
    np.testing.assert_allclose(result.here, expected[: len(result.names)], atol=1e-6)


@pytest.mark.parametrize("printer", [HEIGHTS, DISTANCES], ids=["heights", "distances"])
def test_standard_errors_and_intervals_are_those_of_repeated_measurements(printer):
    """With the true noise, standard errors are the scatter of refits; with the residuals', 95 % intervals hold the truth 95 % of the time."""
    generator, draws, inside = np.random.default_rng(8), [], []
    truth = printer_fit.fit_printer(simulated(printer, np.zeros(9)), STEP)
    for _ in range(300):
        result = printer_fit.fit_printer(simulated(printer, np.zeros(9), NOISE_MM, generator), STEP)
        draws.append(result.here)
        inside.append(np.abs(result.here - truth.here) < result.half_widths)
    slope = printer_fit.own_numbers(truth.residuals.mechanism, truth.fit.errors)[1]
    expected = np.sqrt(np.diag(slope @ truth.fit.identifiability.covariance(NOISE_MM) @ slope.T))
    # four standard deviations of a standard deviation, and of a share, from 300 draws
    np.testing.assert_allclose(np.std(draws, axis=0), expected, rtol=4.0 / np.sqrt(600.0))
    np.testing.assert_allclose(np.mean(inside, axis=0), 0.95, atol=4.0 * np.sqrt(0.95 * 0.05 / 300.0))


def test_heights_alone_hardly_see_the_scale():
    """A robot with all arms 1 mm longer, its six other numbers refitted, touches nearly the same bed: the standard error follows from that."""
    result = printer_fit.fit_printer(simulated(HEIGHTS, np.zeros(9), NOISE_MM, np.random.default_rng(3)), STEP)
    exact = simulated(HEIGHTS, np.zeros(9))
    longer = least_squares(printer_fit.residuals_of(replace(exact, arm_mm=exact.arm_mm + 1.0)))
    left_mm = np.linalg.norm(longer.residual_mm)
    assert left_mm < NOISE_MM
    rank, error = printer_fit.common_arm_error(result)
    assert rank == 7 and error == pytest.approx(result.fit.noise_mm / left_mm, rel=0.02)
    # many heights have full rank, and still the arms' common length is known ten times worse than the heights themselves
    many = printer_fit.fit_printer(simulated(with_many_heights(HEIGHTS), np.zeros(9), NOISE_MM, np.random.default_rng(3)), STEP)
    rank, error = printer_fit.common_arm_error(many)
    assert rank == 9 and error > 10.0 * many.fit.noise_mm


def test_a_reading_left_out_is_judged_as_the_textbook_does():
    """Externally studentised residuals from the hat matrix (Cook and Weisberg, 1982, eq. 2.2.8), which hold for a linear model."""
    result, left, _, _ = diagnosed(simulated(DISTANCES, np.zeros(9), 1e-4, np.random.default_rng(5)))
    jacobian, residual = result.residuals.jacobian(result.fit.errors)[:, 0], result.fit.residual_mm[:, 0]
    hat = np.diag(jacobian @ np.linalg.pinv(jacobian))
    others = (residual @ residual - residual**2 / (1.0 - hat)) / (result.freedom - 1)
    np.testing.assert_allclose(left.ratio, residual / np.sqrt(others * (1.0 - hat)), rtol=1e-3, atol=1e-4)


@pytest.mark.parametrize("number", range(19))
def test_a_wrong_reading_is_found_and_nothing_else(number):
    """A height 1 mm off, a distance with digits turned round such as 97.46 into 94.76, in readings that are otherwise good."""
    printer = simulated(DISTANCES, NINE, 0.02, np.random.default_rng(number))
    readings = np.concatenate([printer.height_mm, printer.distance_mm])
    off = (1.0 if number < 7 else 2.7) * (-1.0) ** number
    readings[number] += off
    result, left, answers, diagnosis = diagnosed(replace(printer, height_mm=readings[:7], distance_mm=readings[7:]))
    bad = answers["bad_reading"]
    assert left.suspect == number and diagnosis == "bad_reading"
    assert bad.verdict == "found" and abs(bad.estimate - off) < 4.0 * bad.standard_error
    # it moved the numbers, which the fit without it undoes
    whole, clean = printer_fit.fit_printer(printer, STEP), printer_causes.without(result, left.suspect)
    assert np.abs(clean.here - whole.here).max() < 0.3 * np.abs(result.here - whole.here).max()


def test_noise_alone_is_rarely_taken_for_a_cause():
    """80 printers with nothing but noise: false alarms stay at the level of 5 % (within four standard deviations of the count)."""
    generator, alarms = np.random.default_rng(2), 0
    for _ in range(80):
        alarms += diagnosed(simulated(DISTANCES, NINE, NOISE_MM, generator))[3] != "none found"
    assert alarms <= 4 + 4.0 * np.sqrt(80 * 0.05 * 0.95)


@pytest.mark.parametrize("caliper", [{"scale": 1.02}, {"offset_mm": 2.0}])
def test_an_error_of_the_calipers_is_seen_and_its_kind_is_not_decidable(caliper):
    _, _, answers, diagnosis = diagnosed(simulated(DISTANCES, NINE, 0.005, np.random.default_rng(6), **caliper))
    assert diagnosis == "not decidable: caliper_scale, caliper_offset, tower_lean"
    scale, offset = answers["caliper_scale"], answers["caliper_offset"]
    assert scale.p < 1e-4 and offset.p < 1e-4 and "caliper_offset" in scale.imitated_by and "caliper_scale" in offset.imitated_by
    true, one = (0.02, scale) if "scale" in caliper else (2.0, offset)
    assert abs(one.estimate - true) < 4.0 * one.standard_error


@pytest.mark.parametrize("printer", [p for p in PRINTERS.values() if p.errors == "heights"], ids=lambda p: p.name)
def test_seven_heights_decide_nothing(printer):
    """One number is left of them, and every cause explains it whole."""
    result, left, answers, diagnosis = diagnosed(printer)
    assert result.freedom == 1 and diagnosis == "not decidable" and left.suspect is None and np.isnan(left.p).all()
    for name, one in answers.items():
        assert one.verdict == "not decidable" and set(one.imitated_by) == set(answers) - {name}
    assert answers["tower_lean"].share == pytest.approx(1.0) and answers["arms"].share == pytest.approx(1.0)


def test_leaning_towers_are_found_with_distances_and_imitated_by_arms_in_heights():
    """However many heights there are, arms of other lengths than saved leave nearly what leaning towers leave."""
    lean = np.array([[0.02, 0.0], [0.0, -0.016], [0.008, 0.012]])
    _, _, answers, diagnosis = diagnosed(simulated(DISTANCES, NINE, 0.02, np.random.default_rng(7), lean=lean))
    assert answers["tower_lean"].verdict == "found" and diagnosis == "tower_lean"
    many = with_many_heights(HEIGHTS)
    _, _, answers, diagnosis = diagnosed(simulated(many, np.zeros(9), 0.01, np.random.default_rng(7), lean=lean))
    assert answers["tower_lean"].p < 1e-6 and diagnosis == "not decidable: arms, tower_lean"
    assert diagnosed(simulated(many, np.zeros(9), 0.01, np.random.default_rng(7)))[3] == "none found"


@pytest.mark.parametrize("printer", [HEIGHTS, DISTANCES], ids=["heights", "distances"])
def test_columns_of_arms_and_leaning_towers_are_finite_differences(printer):
    result = printer_fit.fit_printer(printer, STEP)
    saved = replace(result, fit=replace(result.fit, errors=np.zeros_like(result.fit.errors)))
    found, step = printer_causes.cause_columns(saved), 1e-5
    leans = [step * np.eye(6)[k].reshape(2, 3).T for k in range(6)]
    wanted = {"tower_lean": [(simulated(printer, np.zeros(9), lean=lean), simulated(printer, np.zeros(9), lean=-lean)) for lean in leans]}
    if printer is HEIGHTS:
        arms = [step * np.eye(9)[k] for k in (6, 7, 8)]
        wanted["arms"] = [(simulated(printer, arm), simulated(printer, -arm)) for arm in arms]
    assert set(wanted) == set(found) - {"caliper_scale", "caliper_offset"}
    for name, pairs in wanted.items():
        readings = [[np.concatenate([p.height_mm, p.distance_mm]) for p in pair] for pair in pairs]
        slope = np.stack([(high - low) / (2.0 * step) for high, low in readings], axis=-1)
        np.testing.assert_allclose(found[name][0], result.residuals.root_weight[:, None] * slope, rtol=1e-4, atol=1e-3)


def test_what_is_said_to_be_detectable_is_detected_nine_times_of_ten():
    quiet = printer_fit.fit_printer(simulated(DISTANCES, np.zeros(9)), STEP)
    column = printer_causes.cause_columns(quiet)["caliper_offset"][0][:, 0]
    jacobian = quiet.residuals.jacobian(quiet.fit.errors)[:, 0]
    visible = column - jacobian @ optimize.lsq_linear(jacobian, column).x
    nothing_left_out = printer_causes.LeftOut(*np.full((3, 19), np.nan))
    generator, found = np.random.default_rng(9), []

    def seen(offset_mm):
        result = printer_fit.fit_printer(simulated(DISTANCES, np.zeros(9), NOISE_MM, generator, offset_mm=offset_mm), STEP)
        return result, {one.name: one for one in printer_causes.causes(result, nothing_left_out, 0.05, 0.95)}["caliper_offset"]

    result, answer = seen(0.0)
    offset_mm = answer.detectable_mm / result.fit.noise_mm * NOISE_MM * np.sqrt(19.0) / np.linalg.norm(visible)
    for _ in range(200):
        found.append(seen(offset_mm)[1].p < 0.05 / 4.0)
    assert abs(np.mean(found) - 0.9) < 4.0 * np.sqrt(0.9 * 0.1 / 200.0)


def test_tables_fit_their_schemas_and_a_printer_without_an_answer_keeps_its_row():
    lost = replace(PRINTERS["printer_03"], name="lost", height_drop_mm=2.0 * PRINTERS["printer_03"].height_drop_mm)
    with pytest.raises(FitError, match=r"lost: .*the answer belongs to steps 0.5 times as long"):
        printer_fit.fit_printer(lost, STEP)
    frames = printer_tables.tables([DISTANCES, lost, PRINTERS["printer_23"]], SETTINGS)
    frames = {name: tables.check(name, frame) for name, frame in frames.items()}
    printers = frames["printers"].set_index("printer")
    assert printers["verdict"].to_dict() == {"printer_22": "reproduced", "lost": "not fitted", "printer_23": "reproduced"}
    assert "steps 0.5 times" in printers.loc["lost", "reason"] and "the same distances as printer_22" in printers.loc["printer_23", "notes"]
    assert all("lost" not in set(frames[name]["printer"]) for name in ("printer_parameters", "printer_readings", "printer_causes"))
    assert len(frames["printer_readings"]) == 38 and len(frames["printer_parameters"]) == 18
    assert not frames["printer_readings"]["flagged"].any()
    entry = ENTRIES["printer_22"]
    assert printers.loc["printer_22", "height_rms_there_mm"] == pytest.approx(entry["program_height_rms_mm"])
    assert printers.loc["printer_22", "distance_rms_there_mm"] == pytest.approx(entry["program_distance_rms_mm"])


def test_a_mistyped_reading_in_a_real_file_is_flagged_and_said_to_be_changed():
    lengths = DISTANCES.distance_mm.copy()
    lengths[3] += 2.0
    frames = printer_tables.tables([replace(DISTANCES, distance_mm=lengths)], SETTINGS)
    readings, row = frames["printer_readings"], frames["printers"].iloc[0]
    assert readings.loc[readings["flagged"], ["kind", "number"]].to_numpy().tolist() == [["distance", 4]]
    assert row["suspect"] == "distance 4" and row["cause"].startswith("bad_reading") and row["verdict"] == "does not belong"
    assert f"distance 4 being {DISTANCES.distance_mm[3]:.3f} mm" in row["reason"]
