"""From images of a dot target to the camera's places, paper C, 2: dots, their numbers, the camera itself, R_j and T_j,
O_cj = -R_j^T T_j.

A target is a lattice of dots in the plane z = 0 of its frame. Dots are numbered within an image from one near its
middle, x to the image's right and y upwards, so that an image alone does not say which dots of the plate it shows.
Centres in pixels, the first pixel's is (0, 0); mm, rad.
"""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from rrru.errors import FitError

# the camera's calibration adds up in an order that depends on OpenCV's threads: one thread gives the same bytes
# everywhere
cv2.setNumThreads(1)

# pixels by which the window of a dot's centre exceeds the dot, so that it holds the blurred edge
_EDGE_PX = 4
# dots that are smaller or larger than the median one by more are none
_AREA_SHARE = (0.6, 1.5)
# a dot belongs to the lattice within this share of the pitch
_LATTICE_SHARE = 0.15
# neighbours along a row or column lie within this many times the nearest dot's distance, diagonal ones beyond
_BESIDE = 1.3
_FEWEST_DOTS = 12
# a commanded step tells the dots' numbers when it is off their lattice by less than this share of the pitch
_SURE_SHARE = 0.4
_POLYGON = 36


@dataclass(frozen=True)
class Dots:
    """What one image shows: centre_px (n, 2) and number (n, 2) of every dot; numbers count along the target's axes."""

    centre_px: np.ndarray
    number: np.ndarray


@dataclass(frozen=True)
class CameraModel:
    """A calibrated camera: matrix (3, 3), distortion (k1, k2, p1, p2), rms in px that the calibration left, views it is
    from.
    """

    matrix: np.ndarray
    distortion: np.ndarray
    rms_px: float
    views: int


@dataclass(frozen=True)
class Pose:
    """Camera against target: rotation (3, 3) and translation_mm (3,) from the target's frame to the camera's, rms_px of
    the dots.
    """

    rotation: np.ndarray
    translation_mm: np.ndarray
    rms_px: float

    @property
    def centre_mm(self):
        """Optical centre (3,) in the target's frame (paper C, the equation before (12))."""
        return -self.rotation.T @ self.translation_mm


def read_dots(image, name):
    """Dots of an image (height, width) of 8 bits; raises FitError with the image's name where too few make a
    lattice.
    """
    centres = find_dots(image)
    numbers, known = (
        number_dots(centres) if len(centres) >= _FEWEST_DOTS else (centres, np.zeros(len(centres), dtype=bool))
    )
    if known.sum() < _FEWEST_DOTS:
        raise FitError(f"{name}: {known.sum()} dots make a lattice; allowed: at least {_FEWEST_DOTS}")
    return Dots(centres[known], numbers[known])


def find_dots(image):
    """Centres (n, 2) of the dark dots that an image shows whole: mean of the pixels weighted by their darkness."""
    _, dark = cv2.threshold(image, 0, 1, cv2.THRESH_BINARY_INV + cv2.THRESH_OTSU)
    count, labels, stats, _ = cv2.connectedComponentsWithStats(dark)
    left, top, width, height, area = stats.T
    inner = (left >= _EDGE_PX) & (top >= _EDGE_PX)
    inner &= (left + width <= image.shape[1] - _EDGE_PX) & (top + height <= image.shape[0] - _EDGE_PX)
    # label 0 is the plate
    inner[0] = False
    if not inner.any():
        return np.zeros((0, 2))
    share = area / np.median(area[inner])
    inner &= (share > _AREA_SHARE[0]) & (share < _AREA_SHARE[1])
    window = cv2.dilate(
        labels.astype(np.uint16), cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * _EDGE_PX + 1, 2 * _EDGE_PX + 1))
    )
    darkness = np.median(image[window == 0]) - image.astype(float)
    y, x = np.indices(image.shape)
    sums = [
        np.bincount(window.ravel(), weights=(darkness * factor).ravel(), minlength=count)[inner]
        for factor in (1.0, x, y)
    ]
    return np.stack([sums[1] / sums[0], sums[2] / sums[0]], axis=-1)


def number_dots(centre_px):
    """Numbers (n, 2) of dots at centres (n, 2) and which (n,) have one.

    From the dot nearest to the middle that has its four neighbours the lattice grows outwards; what is numbered gives
    the homography that numbers the next. The camera may be turned about its axis by less than 45 degrees and tilted by
    less than 30.
    """
    steps = centre_px[None] - centre_px[:, None]
    distance = np.linalg.norm(steps, axis=-1)
    np.fill_diagonal(distance, np.inf)
    beside = distance < _BESIDE * distance.min(axis=1, keepdims=True)
    whole = beside.sum(axis=1) == 4
    if not whole.any():
        return np.zeros(centre_px.shape, dtype=int), np.zeros(len(centre_px), dtype=bool)
    start = np.where(whole, np.linalg.norm(centre_px - centre_px.mean(axis=0), axis=1), np.inf).argmin()
    near = steps[start][beside[start]]
    right = near[near[:, 0].argmax()]
    basis = np.column_stack([right, near[(right[0] * near[:, 1] - right[1] * near[:, 0]).argmin()]])
    place = np.linalg.solve(basis, steps[start].T).T
    reach = 1
    while True:
        number = np.rint(place)
        known = (np.abs(place - number).max(axis=1) < _LATTICE_SHARE) & (np.abs(number).max(axis=1) <= reach)
        if reach > np.abs(number).max() or known.sum() < 4:
            return number.astype(int), known
        to_lattice, _ = cv2.findHomography(centre_px[known], number[known])
        place = cv2.perspectiveTransform(centre_px[:, None], to_lattice)[:, 0]
        reach *= 2


def calibrate_camera(views, size_px, pitch_mm, diameter_mm):
    """CameraModel from Dots of several tilted views of one target; size_px: width and height.

    Parallel views would not do: they see the focal length and the distance only together. A first calibration tells how
    far every dot's image is off that of its centre (`centre_bias`), the second is free of that.
    """
    lattice = [_lattice(view, pitch_mm).astype(np.float32) for view in views]
    centres = [view.centre_px for view in views]
    for _ in range(2):
        rms, matrix, distortion, turns, shifts = cv2.calibrateCamera(
            lattice, [c.astype(np.float32) for c in centres], size_px, None, None, flags=cv2.CALIB_FIX_K3
        )
        distortion = distortion.ravel()[:4]
        poses = zip(views, turns, shifts, strict=True)
        centres = [v.centre_px - centre_bias(matrix, distortion, v, r, t, pitch_mm, diameter_mm) for v, r, t in poses]
    return CameraModel(matrix, distortion, float(rms), len(views))


def camera_pose(model, dots, pitch_mm, diameter_mm):
    """Pose of the calibrated camera against the target from the dots of one image."""
    lattice, centres = _lattice(dots, pitch_mm), dots.centre_px
    for _ in range(2):
        found, turn, shift = cv2.solvePnP(lattice, centres, model.matrix, model.distortion)
        if not found:
            raise FitError(f"no camera pose fits {len(lattice)} dots")
        centres = dots.centre_px - centre_bias(model.matrix, model.distortion, dots, turn, shift, pitch_mm, diameter_mm)
    turn, shift = cv2.solvePnPRefineLM(lattice, centres, model.matrix, model.distortion, turn, shift)
    left = cv2.projectPoints(lattice, turn, shift, model.matrix, model.distortion)[0][:, 0] - centres
    return Pose(cv2.Rodrigues(turn)[0], shift[:, 0], float(np.sqrt((left**2).sum(axis=1).mean())))


def with_one_rotation(model, views, poses, pitch_mm):
    """Poses of a camera that never turned: all with the mean rotation, translations (3,) fitted anew to the Dots of
    every image.

    With the rotation known the translation follows from linear equations, x (R X + t)_z = (R X + t)_x of every dot and
    the same for y.
    """
    rotation = Rotation.from_matrix([pose.rotation for pose in poses]).mean().as_matrix()
    result = []
    for dots, pose in zip(views, poses, strict=True):
        x, y = cv2.undistortPoints(dots.centre_px[:, None], model.matrix, model.distortion)[:, 0].T
        turned = _lattice(dots, pitch_mm) @ rotation.T
        one, none = np.ones(len(x)), np.zeros(len(x))
        rows = np.concatenate([np.column_stack([one, none, -x]), np.column_stack([none, one, -y])])
        right = np.concatenate([x * turned[:, 2] - turned[:, 0], y * turned[:, 2] - turned[:, 1]])
        result.append(replace(pose, rotation=rotation, translation_mm=np.linalg.lstsq(rows, right, rcond=None)[0]))
    return result


def centre_bias(matrix, distortion, dots, turn, shift_mm, pitch_mm, diameter_mm):
    """Pixels (n, 2) from the image of each dot's centre to the centroid of the dot's image: a tilted circle's image is
    not centred on it.
    """
    angle = 2.0 * np.pi * np.arange(_POLYGON) / _POLYGON
    edge = diameter_mm / 2.0 * np.stack([np.cos(angle), np.sin(angle), np.zeros(_POLYGON)], axis=-1)
    middle = _lattice(dots, pitch_mm)
    points = np.concatenate([middle[:, None], middle[:, None] + edge], axis=1)
    image = cv2.projectPoints(points.reshape(-1, 3), turn, shift_mm, matrix, distortion)[0].reshape(len(middle), -1, 2)
    outline = image[:, 1:] - image[:, :1]
    after = np.roll(outline, -1, axis=1)
    area = outline[..., 0] * after[..., 1] - outline[..., 1] * after[..., 0]
    return ((outline + after) * area[..., None]).sum(axis=1) / (3.0 * area.sum(axis=1))[:, None]


def join_places(centre_mm, command_mm, pitch_mm):
    """Optical centres (n, 3) in one target frame, from those whose dots were numbered image by image; the first one's
    numbers hold.

    command_mm (n, 3): commanded positions. The step between two images is known to whole pitches from the command, as
    long as the robot's error and the target's turn against the robot's axes make less than half a pitch of it. Raises
    FitError where that is in doubt.
    """
    missing = (np.diff(command_mm, axis=0) - np.diff(centre_mm, axis=0))[:, :2] / pitch_mm
    doubtful = np.flatnonzero((np.abs(missing - np.rint(missing)) > _SURE_SHARE).any(axis=1))
    if doubtful.size:
        raise FitError(
            f"pose {doubtful[0] + 2}: the step from the pose before is {np.abs(missing - np.rint(missing))[doubtful[0]].max():.2f} pitches off "
            f"the dots' lattice; allowed: {_SURE_SHARE}, shorter steps or a target that is better aligned help"
        )
    whole = pitch_mm * np.column_stack([np.rint(missing), np.zeros(len(missing))])
    return centre_mm + np.concatenate([np.zeros((1, 3)), np.cumsum(whole, axis=0)])


def _lattice(dots, pitch_mm):
    """Places (n, 3) of the dots in the target's frame."""
    return np.column_stack([pitch_mm * dots.number, np.zeros(len(dots.number))]).astype(float)
