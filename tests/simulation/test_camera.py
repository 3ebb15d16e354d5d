"""The camera's pictures against what a pinhole with distortion must give."""

import numpy as np
import pytest

from rrru.simulation.camera import Camera, Target, render

FACING = np.diag([1.0, -1.0, -1.0])
QUIET = {
    "focal_mm": 16.0,
    "pixel_mm": 0.0099,
    "width_px": 320,
    "height_px": 240,
    "centre_offset_px": (3.0, -2.0),
    "noise_grey": 0.0,
}
BROWN = (-0.3, 0.2, 2e-3, -1e-3)


def one_dot(offset_mm=(0.0, 0.0)):
    return Target(1, 1, 10.0, 5.0, np.array(offset_mm, dtype=float).reshape(1, 1, 2))


def centroid(image):
    """Mean pixel weighted by darkness, over the whole image."""
    weight = float(image.max()) - image.astype(float)
    y, x = np.indices(image.shape)
    return np.array([(weight * x).sum(), (weight * y).sum()]) / weight.sum()


@pytest.mark.parametrize("blur_px", [0.0, 0.7])
def test_a_dot_s_image_is_centred_where_its_centre_is_projected(blur_px):
    camera = Camera(**QUIET, blur_px=blur_px)
    generator = np.random.default_rng(4)
    for _ in range(6):
        centre = np.append(generator.uniform(-30.0, 30.0, 2), 550.0)
        image = render(camera, one_dot(), FACING, -FACING @ centre, generator)
        # by hand: f / Z per mm, pixel centres at whole numbers
        expected = 1616.1616161616 * np.array([-centre[0], centre[1]]) / 550.0 + [159.5 + 3.0, 119.5 - 2.0]
        np.testing.assert_allclose(centroid(image), expected, atol=0.02)


def test_a_dot_covers_its_area_and_has_the_plate_s_grey_around_it():
    image = render(Camera(**QUIET), one_dot(), FACING, np.array([0.0, 0.0, 400.0]), np.random.default_rng(0)).astype(
        float
    )
    plate, dot = image[0, 0], image.min()
    radius = 2.5 * 1616.1616161616 / 400.0
    assert ((plate - image) / (plate - dot)).sum() == pytest.approx(np.pi * radius**2, rel=5e-3)


def test_projection_is_brown_s_and_rays_are_its_inverse():
    camera, (k1, k2, p1, p2) = Camera(**QUIET, distortion=BROWN), BROWN
    points = np.random.default_rng(1).uniform([-80.0, -60.0, 400.0], [80.0, 60.0, 700.0], (50, 3))
    x, y = points[:, 0] / points[:, 2], points[:, 1] / points[:, 2]
    square = x**2 + y**2
    radial = 1.0 + k1 * square + k2 * square**2
    expected = [
        x * radial + 2.0 * p1 * x * y + p2 * (square + 2.0 * x**2),
        y * radial + p1 * (square + 2.0 * y**2) + 2.0 * p2 * x * y,
    ]
    expected = camera.centre_px + camera.focal_px * np.stack(expected, axis=-1)
    np.testing.assert_allclose(camera.project(points), expected, atol=1e-9)
    x, y = (axis.ravel() for axis in camera.rays)
    back = camera.project(np.column_stack([x, y, np.ones(len(x))])).reshape(240, 2, 320, 2, 2).mean(axis=(1, 3))
    # the samples of a pixel lie about its centre
    np.testing.assert_allclose(back, np.stack(np.meshgrid(np.arange(320.0), np.arange(240.0)), axis=-1), atol=1e-4)


def test_a_dot_off_its_lattice_place_is_seen_off_it():
    camera, shift = Camera(**QUIET), np.array([0.4, -0.25])
    images = [
        render(camera, one_dot(offset), FACING, np.array([0.0, 0.0, 500.0]), np.random.default_rng(0))
        for offset in ((0.0, 0.0), shift)
    ]
    moved = centroid(images[1]) - centroid(images[0])
    np.testing.assert_allclose(moved, camera.focal_px / 500.0 * shift * [1.0, -1.0], atol=0.02)


def test_noise_has_the_stated_size_and_comes_from_the_generator_only():
    camera = Camera(**QUIET | {"noise_grey": 2.0})
    first, again, other = (
        render(camera, one_dot(), FACING, np.array([500.0, 0.0, 500.0]), np.random.default_rng(seed))
        for seed in (5, 5, 6)
    )
    assert first.dtype == np.uint8 and (first == again).all() and (first != other).any()
    # whole greys add a twelfth to the variance; four standard deviations of the estimate
    assert first.astype(float).var() == pytest.approx(4.0 + 1.0 / 12.0, rel=4.0 * np.sqrt(2.0 / first.size))
