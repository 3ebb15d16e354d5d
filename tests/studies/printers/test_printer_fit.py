"""Printers: the answer of another program found again, and foreign answers distinguished."""

from dataclasses import replace

import numpy as np
import pytest

from rrru.calibration.calibrate import calibrate
from rrru.errors import FitError
from rrru.studies.printers import firmware, judge, printer_fit, printer_tables, steps
from rrru.studies.printers.printer import Refused
from tests.schemas import check
from tests.studies.printers.simulated_printers import (
    DISTANCES,
    ENTRIES,
    HEIGHTS,
    LEVEL,
    NINE,
    NOISE_MM,
    PRINTERS,
    SETTINGS,
    STEP,
    simulated,
)


@pytest.mark.parametrize("name", PRINTERS)
def test_the_answer_is_that_of_another_refit_and_belongs_where_the_file_is_consistent(name):
    """`refit_max_difference`: how far another least-squares refit landed from the saved answer; 0.0005 is its maker's
    bar.
    """
    result = printer_fit.fit_printer(PRINTERS[name], STEP, LEVEL)
    other = ENTRIES[name]["refit_max_difference"]
    assert np.abs(result.saved - result.fitted).max() == pytest.approx(other, rel=0.01, abs=3e-6)
    assert (judge.reason(result) == "") == (other < 5e-4)
    assert result.fit.identifiability.rank == len(result.names) == (9 if ENTRIES[name]["distances"] else 6)


def test_why_an_answer_does_not_belong():
    reasons = {name: judge.reason(printer_fit.fit_printer(printer, STEP, LEVEL)) for name, printer in PRINTERS.items()}
    foreign = {name: text for name, text in reasons.items() if text}
    words = {
        "printer_04": "overwritten after the calibration: endstop_a, endstop_b, endstop_c;",
        "printer_06": "overwritten after the calibration: arm_a, arm_c;",
        "printer_14": "overwritten after the calibration: radius, angle_a, angle_b;",
        "printer_20": "overwritten after the calibration: radius, angle_a, angle_b;",
        "printer_21": "overwritten after the calibration: radius, angle_a, angle_b;",
        "printer_28": "unknown",
        "printer_29": "Z offset was applied after the calibration: all endstops differ by -0.025 mm",
    }
    assert set(foreign) == set(words) and all(words[name] in text for name, text in foreign.items())


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda p: replace(p, height_mm=p.height_mm + 0.3), "all endstops differ by -0.300 mm"),
        (
            lambda p: replace(p, endstop_mm=np.round(p.endstop_mm)),
            "overwritten after the calibration: endstop_a, endstop_b, endstop_c",
        ),
        (lambda p: replace(p, radius_mm=round(p.radius_mm)), "overwritten after the calibration: radius;"),
        (lambda p: replace(p, height_drop_mm=2.0 * p.height_drop_mm), "steps 0.5 times as long as the file says:"),
        (lambda p: replace(p, height_drop_mm=p.height_drop_mm * [1.0, 2.0, 1.0]), "says on tower b"),
        (lambda p: replace(p, arm_mm=p.arm_mm - [0.0, 0.5, 0.0]), "345.000 mm instead of 344.500 mm: arm_b was"),
        (lambda p: replace(p, height_drop_mm=p.height_drop_mm / 4.0), "steps 4 times as long"),
        (lambda p: replace(p, arm_mm=p.arm_mm + 2.5), "345.000 mm instead of 347.500 mm: all arms were changed"),
    ],
)
def test_what_an_owner_changed_afterwards_is_named(change, words):
    try:
        found = judge.reason(printer_fit.fit_printer(change(HEIGHTS), STEP, LEVEL))
    except FitError as error:
        # with wrong steps there may be no answer at all
        found = str(error)
    assert words in found


@pytest.mark.parametrize(("printer", "number"), [(HEIGHTS, 4), (DISTANCES, 2), (DISTANCES, 11)])
def test_a_reading_that_was_changed_afterwards_is_named_with_what_it_was(printer, number):
    heights, distances = printer.height_mm.copy(), printer.distance_mm.copy()
    kind, at = (heights, number) if number < 7 else (distances, number - 7)
    before, kind[at] = kind[at], kind[at] + 0.4
    found = judge.reason(
        printer_fit.fit_printer(replace(printer, height_mm=heights, distance_mm=distances), STEP, LEVEL)
    )
    assert f"{'height' if number < 7 else 'distance'} {at + 1} with {before:.3f} mm" in found


@pytest.mark.parametrize("printer", [HEIGHTS, DISTANCES], ids=["heights", "distances"])
def test_a_known_truth_is_recovered(printer):
    """True numbers by hand: the radius and the arms are the saved ones with their errors added, the endstop the zero
    less the arm's rise.
    """
    truth = NINE if printer.parameter_set == "distances" else np.append(NINE[:6], np.zeros(3))
    result = printer_fit.fit_printer(simulated(printer, truth), STEP, LEVEL)
    arms, radius = printer.arm_mm + truth[6:], printer.radius_mm + 0.6
    zeros = printer.endstop_mm + np.sqrt(printer.arm_mm**2 - printer.radius_mm**2) + truth[3:6]
    expected = [
        radius,
        *(printer.angle_deg[:2] + np.degrees(truth[1:3])),
        *(zeros - np.sqrt(arms**2 - radius**2)),
        *arms,
    ]
    np.testing.assert_allclose(result.fitted, expected[: len(result.names)], atol=1e-6)


@pytest.mark.parametrize("printer", [HEIGHTS, DISTANCES], ids=["heights", "distances"])
def test_standard_errors_and_intervals_are_those_of_repeated_measurements(printer):
    """With the true noise, standard errors are the scatter of refits; with the residuals', 95 % intervals hold the
    truth 95 % of the time.
    """
    generator, draws, inside = np.random.default_rng(8), [], []
    truth = printer_fit.fit_printer(simulated(printer, np.zeros(9)), STEP, LEVEL)
    for _ in range(300):
        result = printer_fit.fit_printer(simulated(printer, np.zeros(9), NOISE_MM, generator), STEP, LEVEL)
        draws.append(result.fitted)
        inside.append(np.abs(result.fitted - truth.fitted) < result.half_widths)
    slope = firmware.own_numbers(truth.residuals.mechanism, truth.fit.deviations)[1]
    expected = np.sqrt(np.diag(slope @ truth.fit.identifiability.covariance(NOISE_MM) @ slope.T))
    # four standard deviations of a standard deviation, and of a share, from 300 draws
    np.testing.assert_allclose(np.std(draws, axis=0), expected, rtol=4.0 / np.sqrt(600.0))
    np.testing.assert_allclose(np.mean(inside, axis=0), 0.95, atol=4.0 * np.sqrt(0.95 * 0.05 / 300.0))


def test_heights_alone_hardly_see_the_scale():
    """A robot with all arms 1 mm longer, its six other numbers refitted, touches nearly the same bed: the standard
    error follows from that.
    """
    result = printer_fit.fit_printer(simulated(HEIGHTS, np.zeros(9), NOISE_MM, np.random.default_rng(3)), STEP, LEVEL)
    exact = simulated(HEIGHTS, np.zeros(9))
    longer = calibrate(firmware.residuals_of(replace(exact, arm_mm=exact.arm_mm + 1.0)))
    left_mm = np.linalg.norm(longer.residual_mm)
    assert left_mm < NOISE_MM
    assert printer_fit.common_arm_error(result) == pytest.approx(result.fit.noise_mm / left_mm, rel=0.02)


def test_heights_in_great_number_hardly_see_the_scale_either():
    """As above, for 3000 random places on the disc that its own heights reach: a hundred know the length worse by the
    root of 30.
    """
    result = printer_fit.fit_printer(simulated(HEIGHTS, np.zeros(9), NOISE_MM, np.random.default_rng(3)), STEP, LEVEL)
    generator, robot, count = np.random.default_rng(4), HEIGHTS.mechanism(), 3000
    reach = np.linalg.norm(robot.forward(-HEIGHTS.height_drop_mm)[:, :2], axis=1).max()
    square = generator.uniform(-reach, reach, (2 * count, 2))
    inside = square[np.linalg.norm(square, axis=1) < reach][:count]
    places = np.column_stack([inside, np.full(count, HEIGHTS.height_mm.mean())])
    disc = replace(HEIGHTS, height_mm=places[:, 2], height_drop_mm=-robot.inverse(places))
    left_mm = np.linalg.norm(calibrate(firmware.residuals_of(replace(disc, arm_mm=disc.arm_mm + 1.0))).residual_mm)
    error = printer_fit.dense_arm_error(result)
    assert error == pytest.approx(result.fit.noise_mm / left_mm * np.sqrt(count / 100.0), rel=0.1)
    assert 10.0 * result.fit.noise_mm < error < printer_fit.common_arm_error(result)


def test_tables_fit_their_schemas_and_a_printer_without_an_answer_keeps_its_row():
    far = PRINTERS["printer_03"].height_drop_mm.copy()
    far[2, 1] = 9e3
    lost = replace(PRINTERS["printer_03"], name="lost", height_drop_mm=far)
    with pytest.raises(FitError, match="lost: the nominal robot cannot take 1 of 7 readings' places"):
        printer_fit.fit_printer(lost, STEP, LEVEL)
    unread = Refused("unread", "", ({"file": "mine.json", "value": "nothing", "allowed": "a number"},))
    frames = printer_tables.tables([DISTANCES, lost, unread, PRINTERS["printer_23"]], SETTINGS)
    frames = {name: check(name, frame) for name, frame in frames.items()}
    printers = frames["printers"].set_index("printer")
    assert printers["verdict"].to_dict() == {
        "printer_22": "reproduced",
        "lost": "not fitted",
        "unread": "not fitted",
        "printer_23": "reproduced",
    }
    assert "cannot take 1 of 7" in printers.loc["lost", "reason"] and "got nothing" in printers.loc["unread", "reason"]
    assert "the same distances as printer_22" in printers.loc["printer_23", "notes"]
    assert printers.loc["printer_22", "suspect"] == "" and printers.loc["printer_22", "suspect_p"] > LEVEL
    assert all(
        "lost" not in set(frames[name]["printer"])
        for name in ("printer_parameters", "printer_readings", "printer_causes")
    )
    assert len(frames["printer_readings"]) == 38 and len(frames["printer_parameters"]) == 18
    assert not frames["printer_readings"]["flagged"].any()
    assert printers["evidence"].to_dict() == {
        "printer_22": "printer_22",
        "lost": "lost",
        "unread": "unread",
        "printer_23": "printer_22",
    }
    # one piece of evidence with six causes; errors of the calipers are always confounded, without a detectable size
    # to show
    causes = frames["printer_causes"].set_index("cause")
    assert causes["limit"].to_numpy() == pytest.approx(0.05 / 6.0)
    assert (
        causes.loc[["caliper_scale", "caliper_offset"], "detectable_mm"].isna().all()
        and (causes.loc["tower_lean", "detectable_mm"] > 0.0).all()
    )
    entry = ENTRIES["printer_22"]
    assert printers.loc["printer_22", "height_rms_saved_mm"] == pytest.approx(entry["program_height_rms_mm"])
    assert printers.loc["printer_22", "distance_rms_saved_mm"] == pytest.approx(entry["program_distance_rms_mm"])


def test_a_mistyped_reading_in_a_real_file_is_flagged_and_said_to_be_changed():
    lengths = DISTANCES.distance_mm.copy()
    lengths[7] += 2.0
    frames = printer_tables.tables([replace(DISTANCES, distance_mm=lengths)], SETTINGS)
    readings, row = frames["printer_readings"], frames["printers"].iloc[0]
    # the calibration that is offered is that of a file without the reading
    others = {field: np.delete(getattr(DISTANCES, field), 7, axis=0) for field in ("distance_mm", "distance_drop_mm")}
    residuals = firmware.residuals_of(replace(DISTANCES, **others))
    residuals = replace(residuals, height_weight=firmware.residuals_of(DISTANCES).height_weight)
    others = firmware.own_numbers(residuals.mechanism, calibrate(residuals).deviations)[0]
    np.testing.assert_allclose(frames["printer_parameters"]["without_suspect"], others, atol=1e-6)
    assert readings.loc[readings["flagged"], ["kind", "number"]].to_numpy().tolist() == [["distance", 8]]
    assert (
        row["suspect"] == "distance 8"
        and row["cause"].startswith("bad_reading")
        and row["verdict"] == "does not belong"
    )
    assert f"distance 8 with {DISTANCES.distance_mm[7]:.3f} mm" in row["reason"]


def reason(printer):
    """Why a printer's saved answer does not belong."""
    return judge.reason(printer_fit.fit_printer(printer, STEP, LEVEL))


@pytest.mark.parametrize("factor", [0.125, 0.25, 0.5, 2.0, 4.0, 8.0])
def test_changed_steps_are_found_on_every_printer_with_a_z_offset_too(factor):
    """Klipper writes the endstops with three decimals where it applies one."""
    factors = np.full(3, factor)
    for printer in PRINTERS.values():
        assert (steps.changed_steps(printer, LEVEL) == 1.0).all()
        moved = replace(printer, endstop_mm=np.round(printer.endstop_mm - 0.8, 3))
        for owner in (printer, moved):
            np.testing.assert_array_equal(steps.changed_steps(steps.with_steps(owner, 1.0 / factors), LEVEL), factors)


@pytest.mark.parametrize("printer", [HEIGHTS, DISTANCES], ids=["heights", "distances"])
def test_what_was_changed_is_named_beside_a_z_offset_in_klippers_rounding(printer):
    moved = replace(printer, endstop_mm=np.round(printer.endstop_mm + 0.06, 3))
    assert reason(moved) == "a Z offset was applied after the calibration: all endstops differ by +0.060 mm"
    found = reason(steps.with_steps(moved, np.full(3, 0.5)))
    assert "steps 2 times as long" in found and "endstops differ by +0.060 mm" in found
    arm = moved.arm_mm - [0.0, 0.0, 0.5]
    found = reason(replace(moved, arm_mm=arm))
    assert "arm_c" in found and "endstops differ by +0.060 mm" in found and "arm_a" not in found
