"""The audit of paper B against the full, nonlinear kinematics and hand calculation."""

import numpy as np
import pytest

from rrru.studies.ptt3 import audit
from tests.reference import tripods_slow


def _values(text):
    """Printed and right value of the one computed finding whose check contains a text."""
    (finding,) = (finding for finding in audit.COMPUTED if text in finding.check)
    return finding.values()[:2]


def test_what_the_scan_lacks_is_named():
    rows = audit.audit_rows()
    lost = set(rows.loc[rows["kind"] == "lost", "where"])
    assert lost >= {f"Table {k}" for k in range(1, 9)} | {"eq. (1)", "eq. (18)", "eq. (21)"}
    # printed in the scan
    assert not lost & {"eq. (10)", "eq. (11)", "eq. (12)", "eq. (13)"}


def test_radii_by_hand():
    """At (0, 0, -250) all legs have D = sqrt(350^2 - 250^2), so that det J = 250 x 3 sqrt(3)/2 / D."""
    by_hand = 250.0 * 1.5 * np.sqrt(3.0) / np.sqrt(350.0**2 - 250.0**2)
    assert _values("det J at (0, 0, -250)") == pytest.approx((by_hand, by_hand))
    assert _values("slider position at which") == pytest.approx((1e-3, 1e-3 - 240.0), abs=1e-6)
    # the couples then lean 0.001 mm over 350 mm from the horizontal plane, all to one side
    assert _values("constraint measure") == pytest.approx(2 * (np.sqrt(3.0) * 1e-3 / 350.0,), rel=1e-4)


def test_det_j_vanishes_where_the_links_ends_stand_in_line():
    """On the first azimuth at u = D_1 the three ends seen from above are in line: both other links have half of D_1 in
    their planes.
    """
    assert _values("crosses zero")[1] == pytest.approx(np.sqrt(350.0**2 - 250.0**2))


def test_eqs_11_and_12_differ_by_half_the_second_derivative():
    points = np.array(
        [[0.0, 0.0, -250.0], [40.0, 25.0, -230.0], [-60.0, 10.0, -260.0], [15.0, -70.0, -210.0], [-35.0, -45.0, -280.0]]
    )
    azimuth = np.radians([0.0, 120.0, 240.0])
    v = points[:, 1:2] * np.cos(azimuth) - points[:, :1] * np.sin(azimuth)
    z = points[:, 2:]
    cubed = (350.0**2 - v**2 - z**2) ** 1.5
    second = [(350.0**2 - z**2) * np.sin(azimuth) ** 2, (350.0**2 - z**2) * np.cos(azimuth) ** 2, 350.0**2 - v**2]
    half = max((0.5 * part / cubed).max() for part in second)
    small, large = _values("two corrected sliders")
    assert large == pytest.approx(half, rel=0.03) and small == pytest.approx(0.25 * half, rel=0.03)


def test_heights_relative_to_the_first_point_by_a_general_solver():
    rows = []
    for point in audit.POINTS:
        azimuth = np.radians([0.0, 120.0, 240.0])
        u = point[0] * np.cos(azimuth) + point[1] * np.sin(azimuth)
        v = point[1] * np.cos(azimuth) - point[0] * np.sin(azimuth)
        sliders = u - 240.0 + np.sqrt(350.0**2 - v**2 - point[2] ** 2)
        rows.append(
            tripods_slow.ptt3_forward(sliders, 351.0, 240.0, 0.0, point - np.array([0.0, 0.0, 3.0]))[2] - point[2]
        )
    rows = np.array(rows)
    expected = (np.abs(rows - rows[0])[1:].mean(), np.abs(rows).mean())
    assert _values("mean z error") == pytest.approx(expected, abs=1e-6)
