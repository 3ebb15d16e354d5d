"""Printers of the file, and readings simulated for them, for the tests of their calibration and of its causes."""

import json
from dataclasses import replace

import numpy as np

from rrru.robots.tripod import lower_intersection
from rrru.studies.printers import firmware, printer_causes, printer_fit
from rrru.studies.printers.files import read
from tests.places import DATA

SOURCE = DATA / "linear_delta.json"
ENTRIES = {entry["id"]: entry for entry in json.loads(SOURCE.read_text())}
PRINTERS = {printer.name: printer for printer in read(SOURCE)}
STEP, LEVEL = 1e-5, 0.05
SETTINGS = {"stopping_step": STEP, "level": LEVEL, "confounded_from": 0.95}
NINE = np.array([0.6, 0.002, -0.003, 0.4, -0.3, 0.2, 0.7, -0.5, 0.4])
HEIGHTS, DISTANCES = PRINTERS["printer_16"], PRINTERS["printer_22"]
# noise of a simulated distance; the firmware's weights make a height as much better
NOISE_MM = 0.05


def simulated(
    printer,
    deviations,
    noise_mm=0.0,
    generator=None,
    ratio=None,
    scale=1.0,
    offset_mm=0.0,
    lean=None,
    steps=0.0,
    shape=(0.0, 0.0),
):
    """The printer with the readings of a robot with nine true errors and noise, a height's by default as the firmware
    weighs it.

    scale, offset_mm: of the calipers. lean (3, 2): of the towers, outwards and sideways. steps (3,): relative error of
    the steps' lengths. shape: stretch along x, which shrinks y, and skew of the measured object.
    """
    own = firmware.residuals_of(printer, "distances")
    robot, sliders = own.mechanism, own.actuators * (1.0 + np.asarray(steps))
    legs = robot.numbers(deviations)
    height = (sliders + legs[:, 0])[..., None]
    shift = 0.0 if lean is None else height * (lean[:, :1] * robot.radial + lean[:, 1:] * robot.tangent)
    places = lower_intersection(robot.ends(sliders, legs) + shift, legs[:, robot.LINK])
    n, m = len(printer.height_mm), len(printer.distance_mm)
    stretch, skew = shape
    between = (places[n : n + m] - places[n + m :]) @ np.array(
        [[1.0 + stretch, skew, 0.0], [skew, 1.0 - stretch, 0.0], [0.0, 0.0, 1.0]]
    )
    heights, lengths = places[:n, 2], np.linalg.norm(between, axis=1) * scale + offset_mm
    if noise_mm:
        ratio = ratio or 1.0 / np.sqrt(firmware.residuals_of(printer).height_weight)
        heights = heights + generator.normal(0.0, noise_mm * ratio, n)
        lengths = lengths + generator.normal(0.0, noise_mm, m)
    return replace(printer, height_mm=heights, distance_mm=lengths)


def with_many_heights(printer, side=6):
    """The printer with heights on a grid over its bed; their values are to be simulated."""
    line = np.linspace(-90.0, 90.0, side)
    grid = np.stack([*(part.ravel() for part in np.meshgrid(line, line)), np.full(side**2, 20.0)], axis=-1)
    return replace(printer, height_mm=grid[:, 2], height_drop_mm=-printer.mechanism().inverse(grid))


def diagnosed(printer):
    """Fit, left-out readings, causes by name and the diagnosis of a printer."""
    result = printer_fit.fit_printer(printer, STEP, LEVEL)
    left = printer_causes.left_out(result)
    answers = printer_causes.causes(result, left, printer_causes.Level(LEVEL, SETTINGS["confounded_from"]))
    return result, left, {one.cause: one for one in answers}, printer_causes.diagnosis(answers)
