"""A tilted effector: its model against six rods solved in space, and printers drawn with a known truth."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rrru.studies.printers import printer_fit
from rrru.studies.printers.effector_tilt import TiltTest, tilt_answer, tilts
from tests.studies.printers.drawn_printers import JOINTS_MM, SPACING_MM, Drawn, rings
from tests.studies.printers.simulated_printers import LEVEL, STEP

OFFSET_MM, LIMIT = np.array([0.0, 20.0]), 0.01


def sides(count):
    """Offsets of a probe on sides of the nozzle, evenly around."""
    return [Rotation.from_euler("z", 2.0 * np.pi * k / count).apply([*OFFSET_MM, 0.0])[:2] for k in range(count)]


def drawn(seed, rods_mm, offsets, rings_of_places=3, bed_mm=0.1):
    """Fit of a printer whose bed was probed at every offset."""
    generator = np.random.default_rng(seed)
    machine = Drawn(generator, rods_mm, bed_mm)
    places = rings(0.75 * machine.radius, rings_of_places)
    printer = machine.probed([(places, offset) for offset in offsets], 0.005, generator)
    return printer_fit.fit_printer(printer, STEP, LEVEL)


@pytest.mark.parametrize("arm", [0, 1, 2])
def test_the_tilt_is_that_of_six_rods(arm):
    generator = np.random.default_rng(1)
    machine = Drawn(generator)
    robot = machine.nominal().mechanism("heights")
    assert (robot.spacing_mm, robot.r_mm) == (SPACING_MM, JOINTS_MM)
    start = np.column_stack([rings(0.7 * machine.radius, 2), np.zeros(19)])
    sliders = robot.inverse(start)
    machine.lean[:], machine.true_radius, machine.rods[:] = 0.0, machine.radius, machine.arm
    machine.zero[:], machine.true_angle = np.asarray(robot.zero_mm), np.asarray(robot.azimuth_rad)
    machine.rods[arm] += [0.005, -0.005]
    pose = machine.pose(-sliders, start)
    turn, shift = tilts(robot, start, sliders, np.zeros(6))
    # to first order, of 0.01 mm
    np.testing.assert_allclose(pose[:, 3:], 0.01 * turn[..., arm], atol=1e-7)
    np.testing.assert_allclose(pose[:, :3] - start, 0.01 * shift[..., arm], atol=2e-6)


def test_unequal_rods_are_found_where_readings_can_tell_and_nowhere_else():
    """Probed on three sides of the nozzle; arms, towers and bed are off on all of them."""
    found = alarms = 0
    for seed in range(12):
        rods = np.zeros(3)
        rods[seed % 3] = 0.1 * (-1) ** seed
        answer = tilt_answer(drawn(seed, rods, sides(3)), LIMIT)
        found += answer.found and "abc"[seed % 3] in answer.text.split("arm ")[1].split(" differ")[0]
        assert answer.power > 0.9
        alarms += tilt_answer(drawn(seed, np.zeros(3), sides(3)), LIMIT).found
    assert found >= 11 and alarms <= 1


def test_one_place_of_the_probe_cannot_tell_and_what_can_is_said():
    """A bent bed looks like the tilt: however many places there are, also with a touch by hand."""
    for offsets, count in (([OFFSET_MM], 1), ([OFFSET_MM], 5), ([OFFSET_MM, 0.0 * OFFSET_MM], 3)):
        answer = tilt_answer(drawn(3, np.array([0.5, 0.0, 0.0]), offsets, count), LIMIT)
        assert answer.power < 0.1 and not answer.found
        assert answer.text.startswith("cannot tell: probe at") and "three sides of the nozzle" in answer.text
    assert tilt_answer(drawn(3, np.zeros(3), [0.0 * OFFSET_MM]), LIMIT) is None


def test_the_power_is_how_often_it_is_found():
    """Noise drawn again on the fitted printer, for the arm that shows its rods worst."""
    test = TiltTest(*(lambda fit: (fit, fit.printer.probe_mm))(drawn(4, np.zeros(3), sides(3), 1)), noise_mm=0.005)
    own, generator, columns, size = test._tilt_columns, np.random.default_rng(2), test.columns, 0.1
    worst = np.argmin((own.model.remainder(columns[:, None]) ** 2).sum(axis=0))
    readings = generator.normal(0.0, 0.005, (2000, len(columns))) + size * columns[:, worst]
    share = (own.test(readings.T[:, None])[0] < LIMIT).mean()
    assert share == pytest.approx(test.power(LIMIT), abs=4.0 * 0.5 / np.sqrt(2000))
