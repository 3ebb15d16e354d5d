"""The real camera of paper C, 2.1: a dot target seen by a pinhole camera with lens distortion, blur and pixel noise.

Camera frame: x along the rows of pixels, y down the columns, z along the optical axis; the first pixel's centre is (0,
0). The lens moves the normalised coordinates x = X / Z, y = Y / Z of a point as OpenCV's model does (Brown, Close-range
camera calibration, 1971). The target's dots lie in the plane z = 0 of its own frame. Lengths in mm, greys 0 to 255.
"""

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
import numpy.typing as npt
from cv2.typing import MatLike

from rrru.arrays import FloatArray

# ASSUME the paper does not show its grey values: dark dots on a bright plate, which is larger than the dots' field
_PLATE, _DOT = 215.0, 40.0
# samples per pixel and axis
_FINE = 2
# rows of samples that are computed at a time
_ROWS = 8
# the inverse of the distortion ends after so many steps or below this many pixels
_CRITERIA = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 40, 1e-7)


@dataclass(frozen=True)
class Target:
    """A plate with columns x rows of dots, the first at its frame's origin; x along the columns' numbers, y the rows'.

    offsets_mm (rows, columns, 2): how far each dot lies off its place in the lattice.
    """

    columns: int
    rows: int
    pitch_mm: float
    diameter_mm: float
    offsets_mm: FloatArray

    @property
    def middle_mm(self) -> FloatArray:
        """Middle (3,) of the dots' field."""
        return self.pitch_mm * np.array([self.columns - 1.0, self.rows - 1.0, 0.0]) / 2.0


@dataclass(frozen=True)
class Camera:
    """The true camera, for the renderer only: estimation must not use it.

    distortion: k1, k2, p1, p2; centre_offset_px: optical axis off the chip's middle; blur_px: 1 sigma of the lens's
    point spread; noise_grey: 1 sigma per pixel.
    """

    focal_mm: float
    pixel_mm: float
    width_px: int
    height_px: int
    centre_offset_px: tuple[float, float] = (0.0, 0.0)
    distortion: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    blur_px: float = 0.7
    noise_grey: float = 1.5

    @property
    def focal_px(self) -> float:
        """Focal length in pixels."""
        return self.focal_mm / self.pixel_mm

    @property
    def centre_px(self) -> FloatArray:
        """Where the optical axis meets the chip, (2,)."""
        return (np.array([self.width_px, self.height_px]) - 1.0) / 2.0 + self.centre_offset_px

    @property
    def matrix(self) -> FloatArray:
        """Camera matrix (3, 3) in pixels."""
        (x, y), focal = self.centre_px, self.focal_px
        return np.array([[focal, 0.0, x], [0.0, focal, y], [0.0, 0.0, 1.0]])

    def project(self, points_mm: FloatArray) -> FloatArray:
        """Pixels (n, 2) of points (n, 3) of the camera frame."""
        points, still = np.asarray(points_mm, dtype=float), np.zeros(3)
        pixels, _ = cv2.projectPoints(points, still, still, self.matrix, np.array(self.distortion))
        return np.asarray(pixels[:, 0], dtype=float)

    @cached_property
    def rays(self) -> FloatArray:
        """Normalised coordinates (2, fine rows, fine columns) of the ray to every sample of the chip."""
        offset = (np.arange(_FINE) + 0.5) / _FINE - 0.5
        across = (np.arange(self.width_px)[:, None] + offset).ravel()
        down = (np.arange(self.height_px)[:, None] + offset).ravel()
        pixels = np.stack(np.meshgrid(across, down), axis=-1).reshape(-1, 1, 2)
        rays = cv2.undistortPoints(pixels, self.matrix, np.array(self.distortion), criteria=_CRITERIA)
        return np.ascontiguousarray(rays.reshape(len(down), len(across), 2).transpose(2, 0, 1))


def render(
    camera: Camera, target: Target, rotation: FloatArray, translation_mm: FloatArray, generator: np.random.Generator
) -> npt.NDArray[np.uint8]:
    """Image (height, width) of 8 bits that the camera takes of the target.

    rotation (3, 3), translation_mm (3,): from the target's frame to the camera's. generator: numpy Generator of the
    pixel noise.
    """
    to_plane = np.linalg.inv(np.column_stack([rotation[:, 0], rotation[:, 1], translation_mm]))
    rays = camera.rays
    # a few rows at a time stay in the processor's cache
    blocks = [_greys(camera, target, to_plane, *rays[:, k : k + _ROWS]) for k in range(0, rays.shape[1], _ROWS)]
    fine: MatLike = np.concatenate(blocks, dtype=np.float32, casting="same_kind")
    if camera.blur_px > 0.0:
        fine = cv2.GaussianBlur(fine, (0, 0), camera.blur_px * _FINE, borderType=cv2.BORDER_REPLICATE)
    size = camera.width_px, camera.height_px
    image = cv2.resize(fine.astype(float), size, interpolation=cv2.INTER_AREA)
    noisy = image + camera.noise_grey * generator.standard_normal(image.shape)
    greys: npt.NDArray[np.uint8] = np.clip(np.rint(noisy), 0.0, 255.0).astype(np.uint8)
    return greys


def _greys(camera: Camera, target: Target, to_plane: FloatArray, x: FloatArray, y: FloatArray) -> FloatArray:
    """Grey (m, k) of the target on rays x, y (m, k); to_plane (3, 3): from rays to the target's plane."""
    across, up, scale = (row[0] * x + row[1] * y + row[2] for row in to_plane)
    across, up = across / scale, up / scale
    column = np.clip(np.rint(across / target.pitch_mm), 0, target.columns - 1).astype(int)
    row = np.clip(np.rint(up / target.pitch_mm), 0, target.rows - 1).astype(int)
    offsets = target.offsets_mm.reshape(-1, 2).take(target.columns * row + column, axis=0)
    across -= target.pitch_mm * column + offsets[..., 0]
    up -= target.pitch_mm * row + offsets[..., 1]
    distance = np.sqrt(across * across + up * up)
    # the depth is 1 / scale; a sample on a dot's edge is covered by the share of it that lies inside
    covered = np.clip((target.diameter_mm / 2.0 - distance) * scale * camera.focal_px * _FINE + 0.5, 0.0, 1.0)
    return np.asarray(_PLATE + (_DOT - _PLATE) * covered)
