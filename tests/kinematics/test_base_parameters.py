"""Base parameters: what a campaign's calibration holds of a robot whose every part has errors."""

from dataclasses import replace

import numpy as np
import pytest

import rrru
from rrru.studies.blind_validation.sentences.draws import draw

NOISE_MM = 2e-4


@pytest.mark.parametrize("number", [19, 21])
def test_all_errors_of_an_own_robot_of_unknown_frame_are_calibrated(number, tmp_path):
    """A rotary hexapod and an arm with errors of millimetres in all parts, simulated by independent code.

    What is left of readings with hardly any noise is about a micrometre.
    """
    own = draw(number, 771, 300, 0.0)
    own = replace(own, noise_mm=NOISE_MM)
    rows = own.table(own.readings(own.poses(cause=False)), True)
    own.write(tmp_path, rows[np.repeat(~own.stops.fresh, len(own.targets))], "stops.csv")
    given = own.section(tmp_path, "stops.csv")
    described = own.nominal.section("", own.kind)
    robot = rrru.load_robot(
        tmp_path / own.robot_file, **{key: value for key, value in described.items() if key not in ("urdf", "mjcf")}
    )
    campaign = rrru.read_campaign(
        given["ingest"], robot, noise_mm=NOISE_MM, frame=given["frame"], targets=given.get("targets")
    )
    campaign.config["calibration"]["bounds"] = {"angle_rad": 0.3, "length_mm": 50.0}
    (fit, *_) = rrru.calibrate(campaign).fits.values()
    assert 0.8 * NOISE_MM < fit.noise_mm < 1.5e-3
