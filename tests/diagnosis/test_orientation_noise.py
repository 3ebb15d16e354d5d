"""Robots whose pose is read, with a noise of the orientations that is not stated: the noise and the cause are found.

Positions, orientations, legs and links are NumPy's and SciPy's alone, see `hexapod_stops` and `numpy_arm`.
"""

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation

import rrru
from rrru.calibration.campaign_noise import campaign_noise
from rrru.campaign.ingest.campaign_file import ingest
from rrru.campaign.ingest.spec import IngestSpec
from rrru.diagnosis.diagnose import MeasuredRobot, diagnose
from rrru.diagnosis.settings import GapSettings
from rrru.effects.library import NAMES
from rrru.pipeline.setup import as_measured
from rrru.robots.hexapod import hexapod
from tests.diagnosis import arms, hexapod_stops, numpy_arm

_NOISE_MM, _NOISE_RAD, _LEAD_ERROR = 0.015, 4e-5, 1.5e-3
_HEXAPOD = hexapod(
    hexapod_stops.BASE, hexapod_stops.PLATFORM, hexapod_stops.HEIGHT_MM, stroke_mm=200.0, parameter_set="full"
)
_LACKING = ("backlash", "drive_compliance", "link_flexure", "thermal_growth")


def _file():
    """Poses read in no order, 25 s apart; the screw of leg 2 has a constant lead error."""
    generator = np.random.default_rng(8)
    position, turn = hexapod_stops.poses("random", generator)
    commanded = hexapod_stops.lengths(position, turn)
    actual = commanded + 0.3 * generator.standard_normal(6)
    actual[:, 1] += _LEAD_ERROR * (commanded[:, 1] - commanded[:, 1].mean())
    base, platform = (
        places + 0.3 * generator.standard_normal((6, 3)) for places in (hexapod_stops.BASE, hexapod_stops.PLATFORM)
    )
    position, turn = hexapod_stops.standing(actual, (position, turn), base, platform)
    position = position + _NOISE_MM * generator.standard_normal(position.shape)
    turns = Rotation.from_rotvec(_NOISE_RAD * generator.standard_normal(position.shape)) * Rotation.from_matrix(turn)
    read = {f"measured_{axis}_mm": position[:, k] for k, axis in enumerate("xyz")}
    read |= {f"measured_r{axis}_rad": turns.as_rotvec()[:, k] for k, axis in enumerate("xyz")}
    return pd.DataFrame(
        {
            "trajectory": "stops",
            "time_s": 25.0 * np.arange(len(position)),
            **dict(zip(hexapod_stops.DRIVES, commanded.T, strict=True)),
            **read,
        }
    )


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    path = tmp_path_factory.mktemp("poses") / "poses.csv"
    _file().to_csv(path, index=False)
    section = {"ingest": str(path), "motion": {"kind": "stop_and_go", "between": "drives"}}
    return ingest(IngestSpec.from_config(section), _HEXAPOD).measurements


def _diagnosed(measured, effects=None):
    robot = MeasuredRobot(as_measured(_HEXAPOD, measured), noise_mm=_NOISE_MM)
    return diagnose(measured, robot, GapSettings(effects or NAMES), details=False)


def test_a_missing_effect_does_not_pass_for_noise_of_the_orientations_alone(measured):
    """The ratio of both noises is nearly right even where the library lacks what acts."""
    found = _diagnosed(measured, _LACKING)
    assert found.inference.problem.characteristic_length_mm == pytest.approx(_NOISE_MM / _NOISE_RAD, rel=0.5)


def test_a_constant_lead_error_is_no_growth(measured):
    found = _diagnosed(measured)
    assert found.verdict["effects"] == "lead_error" and found.verdict["leg"] == 2
    assert found.verdict["noise_rms_mm"] == pytest.approx(np.sqrt(3.0) * _NOISE_MM, rel=0.2)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_an_effect_of_an_arm_is_no_noise_of_the_orientations_at_few_poses(seed):
    """The shapes of all effects are too many columns for these poses; an encoder's disc sits off its centre."""
    generator = np.random.default_rng(seed)
    drive, off = numpy_arm.drives(generator)[:70], numpy_arm.errors(generator)
    eccentric = drive.copy()
    eccentric[:, 3] += 4e-4 * np.sin(drive[:, 3] + 0.5)
    *_, (position, turn) = numpy_arm.links(eccentric, off)
    table = numpy_arm.table(drive, {"tip": (position, turn, (0.0, 0.0, 0.0))}, generator).drop(columns="target")
    seen = Rotation.from_rotvec(_NOISE_RAD * generator.standard_normal((70, 3))) * Rotation.from_matrix(turn)
    table[[f"measured_r{axis}_rad" for axis in "xyz"]] = (numpy_arm.FRAME * seen).as_rotvec()
    robot = rrru.load_robot("data/models/arm6.urdf")
    campaign = rrru.read_campaign(table, robot, noise_mm=numpy_arm.NOISE_MM, frame="register", motion="stop_and_go")
    verdict = rrru.diagnose(campaign).verdict
    assert [effect["name"] for effect in verdict["effects"]] == ["encoder_eccentricity"]
    assert verdict["noise_rms_mm"] == pytest.approx(np.sqrt(3.0) * numpy_arm.NOISE_MM, rel=0.15)


@pytest.mark.parametrize("noise_rad", [None, _NOISE_RAD])
def test_the_sources_of_both_noises_are_said(noise_rad):
    """Only the noise of the positions is stated, or both."""
    frame = arms.measure(count=80)
    found = campaign_noise(arms.reading(frame), frame, (arms.NOISE_MM, noise_rad))
    assert (found.source, found.rad_source) == ("given", "given" if noise_rad else "high_frequency")
    positions = frame.drop(columns=[name for name in frame if name.startswith("measured_r")])
    found = campaign_noise(arms.reading(positions), positions, (arms.NOISE_MM, noise_rad))
    assert found.rad_source == "" and np.isnan(found.rad)
