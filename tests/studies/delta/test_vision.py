"""Dots, their numbers, the camera and its places against known truths; images come from the virtual camera."""

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rrru.errors import FitError
from rrru.simulation.camera import Camera, Target, render
from rrru.studies.delta import vision

PITCH, DIAMETER = 10.0, 5.0
LATTICE = vision.Lattice(PITCH, DIAMETER)
CAMERA = Camera(16.0, 0.0099, 659, 494, (4.0, -3.0), (-0.08, 0.1, 2e-4, -1e-4))
TARGET = Target(55, 40, PITCH, DIAMETER, np.zeros((40, 55, 2)))
DOWN = np.diag([1.0, -1.0, -1.0])
TURN = Rotation.from_rotvec([0.007, -0.005, 0.02]).as_matrix() @ DOWN


def take(rotation, translation, seed):
    return render(CAMERA, TARGET, rotation, translation, np.random.default_rng(seed))


@pytest.fixture(scope="module")
def tilted():
    """Dots of tilted views and the true rotation and translation of each."""
    result = []
    for k, side in enumerate(np.arange(8) * np.pi / 4.0):
        rotation = Rotation.from_rotvec(0.42 * np.array([np.cos(side), np.sin(side), 0.0])).as_matrix() @ DOWN
        translation = np.array([0.0, 0.0, 480.0 + 20.0 * k]) - rotation @ (
            TARGET.middle_mm + k * np.array([7.0, -5.0, 0.0])
        )
        result.append((vision.read_dots(take(rotation, translation, k), "view"), rotation, translation))
    return result


@pytest.fixture(scope="module")
def model(tilted):
    return vision.calibrate_camera([dots for dots, _, _ in tilted], (659, 494), LATTICE)


@pytest.fixture(scope="module")
def shots():
    """Dots of a camera that moves without turning, and its true centres."""
    centres = TARGET.middle_mm + np.random.default_rng(9).uniform(
        [-200.0, -130.0, 540.0], [200.0, 130.0, 560.0], (8, 3)
    )
    return [vision.read_dots(take(TURN, -TURN @ centre, k), "shot") for k, centre in enumerate(centres)], centres


def test_numbers_are_the_lattice_s_up_to_its_origin():
    generator = np.random.default_rng(2)
    for _ in range(30):
        column, row = (axis.ravel() for axis in np.meshgrid(np.arange(18), np.arange(12)))
        tilt = np.append(generator.uniform(-0.35, 0.35, 2), generator.uniform(-0.5, 0.5))
        lattice = PITCH * np.column_stack([column - 9.0, row - 6.0, np.zeros(len(row))])
        points = lattice @ (Rotation.from_rotvec(tilt).as_matrix() @ DOWN).T + [0.0, 0.0, 500.0]
        image = CAMERA.project(points) + generator.normal(0.0, 0.05, (len(points), 2))
        chosen = generator.permutation(len(image))[: int(0.9 * len(image))]
        number, known = vision.number_dots(image[chosen])
        shift = number - np.column_stack([column, row])[chosen]
        assert known.mean() > 0.95 and (shift[known] == shift[known][0]).all()


def test_dots_are_found_where_they_are_projected_and_only_whole_ones(tilted):
    for dots, rotation, translation in tilted[:3]:
        grid = np.stack(np.meshgrid(np.arange(55), np.arange(40)), axis=-1).reshape(-1, 2)
        centre = CAMERA.project(PITCH * np.column_stack([grid, np.zeros(len(grid))]) @ rotation.T + translation)
        distance, nearest = min_distance(dots.centre_px, centre)
        # a tilted circle's image is off its centre by hundredths of a pixel
        assert distance.max() < 0.05 and len(set(nearest)) == len(nearest)
        shift = grid[nearest] - dots.number
        assert (shift == shift[0]).all()
        inside = ((centre > 30.0) & (centre < [628.0, 463.0])).all(axis=1)
        assert set(np.flatnonzero(inside)) <= set(nearest)


def min_distance(points, others):
    """Distance to and index of the nearest of others for every point."""
    distance = np.linalg.norm(points[:, None] - others, axis=-1)
    return distance.min(axis=1), distance.argmin(axis=1)


def test_the_bias_of_a_circle_s_image_is_that_of_the_conic():
    """Without distortion a circle's image is an ellipse whose centre follows from the conic's matrix."""
    matrix = np.array([[1600.0, 0.0, 330.0], [0.0, 1600.0, 250.0], [0.0, 0.0, 1.0]])
    turn, shift = np.array([0.4, 0.3, 0.1]), np.array([10.0, -20.0, 300.0])
    numbers = np.array([[0, 0], [4, -3], [-6, 5]])
    rotation = cv2.Rodrigues(turn)[0]
    model = vision.CameraModel(matrix, np.zeros(4), 0.0)
    for number, bias in zip(numbers, model.centre_bias(numbers, turn, shift, vision.Lattice(PITCH, 8.0)), strict=True):
        x, y = PITCH * number
        to_image = matrix @ np.column_stack([rotation[:, 0], rotation[:, 1], shift])
        circle = np.array([[1.0, 0.0, -x], [0.0, 1.0, -y], [-x, -y, x**2 + y**2 - 16.0]])
        conic = np.linalg.inv(to_image).T @ circle @ np.linalg.inv(to_image)
        centre = np.linalg.solve(conic[:2, :2], -conic[:2, 2])
        projected = to_image @ [x, y, 1.0]
        np.testing.assert_allclose(bias, centre - projected[:2] / projected[2], rtol=0.02, atol=1e-6)
        assert np.linalg.norm(bias) > 0.03


def test_the_camera_is_the_same_to_the_last_bit_every_time(model, tilted):
    for _ in range(5):
        again = vision.calibrate_camera([dots for dots, _, _ in tilted], (659, 494), LATTICE)
        assert (again.matrix == model.matrix).all() and (again.distortion == model.distortion).all()


def test_the_camera_is_found_from_tilted_views(model):
    found = np.array([model.matrix[0, 0], model.matrix[1, 1], *model.matrix[:2, 2]])
    np.testing.assert_allclose(found, [CAMERA.focal_px, CAMERA.focal_px, *CAMERA.centre_px], atol=1.0)
    # where the distortion counts most, in the chip's corner, it moves points by more than a pixel
    corner = np.array([[90.0, 66.0, 500.0]])
    true = CAMERA.project(corner) - CAMERA.centre_px
    seen = (
        cv2.projectPoints(corner, np.zeros(3), np.zeros(3), model.matrix, model.distortion)[0][:, 0]
        - model.matrix[:2, 2]
    )
    np.testing.assert_allclose(seen * CAMERA.focal_px / model.matrix[0, 0], true, atol=0.2)
    assert model.rms_px < 0.02


def test_optical_centres_are_found_up_to_whole_pitches(model, shots):
    seen, centres = shots
    poses, together = vision.camera_poses(model, seen, LATTICE).values()
    deviations = []
    for kind in (poses, together):
        off = np.array([pose.centre_mm for pose in kind]) - centres
        off[:, :2] -= PITCH * np.rint(off[:, :2] / PITCH)
        assert np.abs(off[:, :2] - off[:, :2].mean(axis=0)).max() < 0.05 and np.abs(off[:, 2]).max() < 0.5
        deviations.append(off[:, :2].std())
    # a tilt that is wrong by itself in every image moves the centre sideways
    assert deviations[1] < 0.5 * deviations[0]
    assert all((pose.rotation == together[0].rotation).all() for pose in together)
    angle = Rotation.from_matrix(together[0].rotation @ TURN.T).magnitude()
    assert angle < 1e-3 and max(pose.rms_px for pose in poses) < 0.03


def test_places_are_joined_by_the_commands_as_far_as_half_a_pitch_allows():
    generator = np.random.default_rng(3)
    command = np.array([[x, y, 100.0] for x in range(0, 300, 60) for y in range(0, 200, 50)])
    turned = Rotation.from_rotvec([0.0, 0.0, 0.015]).as_matrix()
    true = (command + generator.uniform(-0.4, 0.4, command.shape)) @ turned.T + [3.0, 4.0, 500.0]
    numbered = true - np.column_stack([PITCH * generator.integers(-9, 9, (len(true), 2)), np.zeros(len(true))])
    joined = vision.join_places(numbered, command, PITCH)
    np.testing.assert_allclose(joined - joined[0], true - true[0], atol=1e-9)
    np.testing.assert_array_equal(joined[0], numbered[0])
    with pytest.raises(FitError, match=r"pose 3: .* 0\.4[0-9] pitches"):
        vision.join_places(true[:3], command[:3] + np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [4.5, 0.0, 0.0]]), PITCH)


@pytest.mark.parametrize("image", [np.full((200, 300), 200, dtype=np.uint8), np.zeros((200, 300), dtype=np.uint8)])
def test_an_image_without_a_lattice_is_named(image):
    image[50:60, 50:60] = 90
    with pytest.raises(FitError, match=r"pose 7: \d+ dots are on a lattice; allowed: at least 12"):
        vision.read_dots(image, "pose 7")


def test_points_are_projected_to_the_last_bit_as_opencv_does():
    generator = np.random.default_rng(4)
    turn, shift = np.array([0.3, -0.2, 0.1]), np.array([5.0, -20.0, 400.0])
    matrix = np.array([[1600.0, 0.0, 330.0], [0.0, 1580.0, 250.0], [0.0, 0.0, 1.0]])
    model = vision.CameraModel(matrix, np.array([-0.08, 0.1, 2e-4, -1e-4]), 0.0)
    points = np.append(generator.uniform(-100.0, 100.0, (50, 2)), np.zeros((50, 1)), axis=1)
    expected = cv2.projectPoints(points, turn, shift, matrix, model.distortion)[0][:, 0].T
    np.testing.assert_array_equal(model.project(points.T[:2], turn, shift), expected)
