"""The virtual Delta and its scene by themselves: poses, frames, streams of noise, and draws without rendering."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rrru.errors import ConfigError
from rrru.studies.delta import draws, views, virtual_delta
from rrru.studies.delta.variants import VARIANTS

CONFIG = {
    "seed": 3,
    "robots": {"delta": {}},
    "delta": {
        "errors": {"dtheta1": -0.005, "dtheta2": 0.006, "dtheta3": -0.009, "dl1_1": -0.2, "dl2_2": 0.15, "da_3": 0.1},
        "plane": {"z_mm": 0.0, "radius_mm": 300.0, "step_mm": 100.0},
        "tracker_noise_mm": 0.02,
        "poses": {"counts": [5, 4], "half_mm": [200.0, 135.0], "z_mm": 100.0, "second_z_mm": 0.0},
        "target": {
            "columns": 55,
            "rows": 40,
            "pitch_mm": 10.0,
            "diameter_mm": 5.0,
            "dot_error_mm": 0.005,
            "turn_deg": [0.1, -0.2, 0.7],
        },
        "camera": {
            "focal_mm": 16.0,
            "pixel_mm": 0.0099,
            "width_px": 500,
            "height_px": 400,
            "centre_offset_px": [4.0, -3.0],
            "distortion": [-0.08, 0.1, 2e-4, -1e-4],
        },
        "mount": {"offset_mm": [50.0, -20.0, -40.0], "turn_deg": [0.4, -0.3, 1.0]},
        "distance_mm": 550.0,
        "tilted_views": {"count": 5, "tilt_deg": 25.0},
    },
}


def changed(**parts):
    """The configuration with other parts of its section."""
    return CONFIG | {"delta": CONFIG["delta"] | parts}


def test_draws_differ_and_the_same_label_gives_the_same():
    truth = views.true_poses(CONFIG).head(4)
    first, again = (draws.drawn_errors(CONFIG, truth, 0.006, 2, "a") for _ in range(2))
    other = draws.drawn_errors(CONFIG, truth, 0.006, 1, "b")
    np.testing.assert_array_equal(first[1]["centre"], again[1]["centre"])
    for one in (first[1], other[0]):
        assert np.abs(one["centre"] - first[0]["centre"]).max() > 1e-3
    exact = changed(target=CONFIG["delta"]["target"] | {"dot_error_mm": 0.0})
    none = draws.drawn_errors(exact, truth, 0.0, 1, "a")[0]
    # an exact plate without noise leaves what single precision does to the lens; under one rotation the origin may
    # shift
    assert np.abs(none["centre"]).max() < 1e-4
    assert np.ptp(none["one_rotation"], axis=0).max() < 1e-4


def test_every_robot_has_its_own_tracker_noise():
    one = virtual_delta.twin(CONFIG)
    runs = [
        replace(one, labels=("robots", k)).generator("tracker", "tracker_heights").standard_normal(50) for k in range(2)
    ]
    assert abs(np.corrcoef(runs)[0, 1]) < 4.0 / np.sqrt(50)


def test_an_own_frame_has_its_axes_where_the_robot_went():
    turn = Rotation.from_rotvec([0.1, -0.2, 0.3])
    places = np.random.default_rng(1).normal(size=(6, 3))
    axes = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.4, 3.0, 0.0]])
    np.testing.assert_allclose(
        virtual_delta.in_own_frame(turn.apply(axes) + 5.0, turn.apply(places) + 5.0), places, atol=1e-12
    )


def test_poses_are_spread_evenly_and_steps_stay_short():
    planes, command = virtual_delta.Poses(**CONFIG["delta"]["poses"]).commands()
    first = command[planes == "first"]
    assert len(first) == 20 and (first[:, 2] == 100.0).all() and (command[planes == "second"][:, 2] == 0.0).all()
    assert len(np.unique(first, axis=0)) == 20
    np.testing.assert_allclose(first.mean(axis=0), [0.0, 0.0, 100.0])
    # joined by whole pitches: the target's turn over a step stays below half a pitch
    assert np.linalg.norm(np.diff(command[:, :2], axis=0), axis=1).max() <= 200.0
    two = next(variant for variant in VARIANTS if variant.planes == "two")
    assert two.used(planes).sum() == 20


def test_a_plane_out_of_reach_is_named():
    far = changed(plane={"z_mm": 0.0, "radius_mm": 2000.0, "step_mm": 500.0})
    with pytest.raises(ConfigError, match=r"delta\.plane: a point is out of the robot's reach"):
        virtual_delta.twin(far)
