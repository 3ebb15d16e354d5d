"""Three models of one robot on a fresh campaign, where what they leave is known."""

import numpy as np
import pandas as pd
import pytest

from rrru.errors import ConfigError
from rrru.kinematics.dynamics import Masses
from rrru.pipeline import setup
from rrru.robots.catalogue import make_mechanism
from rrru.studies.end_to_end.models import check, errors, sizes
from tests.schemas import check as checked
from tests.simulation.simulated import file_of

_SECTION = {"mjcf": str(file_of("hexapod")), "platform": "plate"}
_LINE = {"start_mm": [-20, 0, 500], "end_mm": [20, 0, 510], "offsets_y_mm": [0], "points": 6}
_NOMINAL = {"name": "hexapod", "dimensions": _SECTION, "parameter_set": "zero"}


@pytest.fixture(scope="module")
def fresh():
    """A campaign without noise of the robot that the file is of."""
    virtual = {
        "name": "fresh",
        "seed": 1,
        "robot": {"mujoco": {}},
        "trajectories": {"lines": _LINE},
        "passes": [{"reverse": False, "payload_kg": 0.0}],
        "motion": {"speed_mm_s": 50.0, "acceleration_mm_s2": 50.0, "dwell_s": 1.0},
        "noise_mm": 0.0,
    }
    return setup.virtual_campaign(_NOMINAL, virtual).run()[0]


def test_each_model_leaves_what_it_is_off_by(fresh, tmp_path):
    """The file is right, one leg of the calibration is off by 0.1 mm, the corrected tool by 1 mm."""
    text = file_of("hexapod").read_text()
    end = '<geom type="cylinder" size="0.18 0.01" mass="4"/>'
    assert end in text
    (tmp_path / "corrected.xml").write_text(text.replace(end, f'{end}<site name="measured_tool" pos="0 0 0.001"/>', 1))
    robot = make_mechanism("hexapod", _SECTION, parameter_set="zero")
    deviations = 0.1 * np.eye(len(robot.parameters))[2]
    points = errors(fresh, _NOMINAL, Masses(0.0, 0.0, 0.0), (robot, deviations), tmp_path / "corrected.xml")
    left = checked("circle_points", points).set_index("model")["error_mm"]
    assert left["given"].max() < 1e-3
    np.testing.assert_allclose(left["corrected"], 1.0, atol=1e-3)
    used = fresh.merge(points[["run", "point"]].drop_duplicates())
    actuators = used[list(robot.parts.columns)].to_numpy()
    moved = np.linalg.norm(robot.forward(actuators + deviations) - robot.forward(actuators), axis=1)
    np.testing.assert_allclose(left["calibrated"], moved, atol=2e-3)


def test_sizes_take_the_noise_off():
    lengths = {"given": [0.3, 0.4], "corrected": [0.01, 0.01]}
    points = pd.concat([pd.DataFrame({"error_mm": own}).assign(model=model) for model, own in lengths.items()])
    table = sizes(points, "backlash", 0.1).assign(diagnosed="a", fresh="b")
    given, corrected = checked("circle", table).to_dict("records")
    assert given["rms_mm"] == pytest.approx(np.sqrt(0.125)) and given["max_mm"] == 0.4 and given["effects"] == "none"
    assert given["gap_rms_mm"] == pytest.approx(np.sqrt(0.125 - 0.03))
    assert corrected["gap_rms_mm"] == 0.0 and corrected["effects"] == "backlash"


@pytest.mark.parametrize(
    ("circle", "message"),
    [
        ({"fresh": "nosuch"}, "circle.fresh: campaigns has no 'nosuch'; known: second, third, other"),
        ({"fresh": "other"}, "circle: robots arm and rrru3; allowed: one robot with an mjcf"),
        ({"calibration": "nosuch"}, "circle.calibration: 'nosuch'; known sets: both"),
    ],
)
def test_what_fits_nothing_is_refused(circle, message):
    config = {
        "robots": {"arm": _SECTION, "rrru3": {}},
        "campaigns": {"second": {"robot": "arm"}, "third": {"robot": "arm"}, "other": {"robot": "rrru3"}},
        "calibration": {"sets": {"both": ["*"]}},
        "circle": {"diagnosed": "second", "fresh": "third", "calibration": "both"},
    }
    check(config)
    with pytest.raises(ConfigError, match=message):
        check(config | {"circle": config["circle"] | circle})
