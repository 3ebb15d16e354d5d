"""RepRapFirmware's commands and answer: the machine that they describe is found again, and what is missing is said."""

import numpy as np
import pytest

from rrru.errors import IngestError
from rrru.robots.linear_delta import linear_delta
from rrru.studies.printers import files, printer_fit
from tests.studies.printers.simulated_printers import LEVEL, STEP

PLACES = [(100.0 * np.cos(k), 100.0 * np.sin(k)) for k in range(6)] + [
    (50.0 * np.cos(k), 50.0 * np.sin(k)) for k in (0, 2, 4)
]
PLACES.append((0.0, 0.0))
RADIUS, ARM, HEIGHT, ANGLES = 136.2, 288.14, 201.1, np.radians([210.0, 330.0, 90.0])


def session(heights, wrong=(0.0, 0.0, 0.0)):
    """A config.g, a bed.g and the console's answer, one below the other."""
    lines = [
        "; config",
        f"M665 R{RADIUS} L{ARM} B105 H{HEIGHT}",
        f"M666 X{wrong[0]} Y{wrong[1]} Z{wrong[2]} ; endstops",
    ]
    lines += ["G31 P500 X0 Y0 Z1.25", *(f"G30 P{k} X{x:.9f} Y{y:.9f} Z-99999 H0" for k, (x, y) in enumerate(PLACES))]
    heights_text = " ".join(f"{one:.9f}" for one in heights)
    return "\n".join([*lines, f"G32 bed probe heights: {heights_text}, mean 0.010, deviation from mean 0.2"])


def test_wrong_endstops_are_found_from_the_heights_that_they_give(tmp_path):
    """The firmware believes its endstops; the true machine touches the bed elsewhere, by plain search down."""
    wrong = np.array([0.4, -0.3, 0.2])
    believed, true = (linear_delta(RADIUS, ANGLES, [ARM] * 3, HEIGHT + off, "heights") for off in (wrong, np.zeros(3)))
    heights = []
    for x, y in PLACES:
        low, high = -5.0, 5.0
        for _ in range(60):
            middle = 0.5 * (low + high)
            nozzle = true.forward(believed.inverse([[x, y, middle + 1.25]]))[0, 2]
            low, high = (low, middle) if nozzle > 1.25 else (middle, high)
        heights.append(low)
    path = tmp_path / "session.g"
    path.write_text(session(heights, wrong))
    (printer,) = files.read(path)
    result = printer_fit.fit_printer(printer, STEP, LEVEL)
    np.testing.assert_allclose(result.fitted, [RADIUS, 210.0, 330.0, *[HEIGHT] * 3], atol=1e-5)
    assert not printer.calibrated and printer.name == "session"


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t: t.replace(" H201.1", ""), ("M665 H", "nothing")),
        (lambda t: t.replace("G30 P3 ", "G30 S-1 "), ("10 heights of 9 places",)),
        (lambda t: t.replace(f"L{ARM}", "L100"), ("M665", "L 100", "longer than R")),
        (lambda t: t.split("G32")[0], ("0 heights of 10 places",)),
    ],
)
def test_what_is_missing_is_named(change, words, tmp_path):
    path = tmp_path / "session.g"
    path.write_text(change(session(np.zeros(10))))
    with pytest.raises(IngestError) as caught:
        files.read(path)
    assert all(word in str(caught.value) for word in ("session.g", *words))
