"""From images of a dot target to the camera's places (paper C, 2): dots, their numbers, the camera, O_cj = -R_j^T T_j.

A target is a lattice of dots in the plane z = 0 of its frame. Dots are numbered within an image from one near its
middle, x to the image's right and y upwards: an image alone does not say which dots of the plate it shows. Centres in
pixels, the first pixel's is (0, 0); mm, rad.
"""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from scipy import ndimage
from scipy.spatial.transform import Rotation

from rrru.errors import FitError

# the camera's calibration adds up in an order that depends on OpenCV's threads: one gives the same bytes everywhere
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
# corners of the polygon that stands for a dot's edge
_CORNERS = 36


@dataclass(frozen=True)
class Lattice:
    """A target as its maker states it: pitch and diameter of its dots."""

    pitch_mm: float
    diameter_mm: float

    def places(self, number):
        """Places (n, 3) in the target's frame of dots with numbers (n, 2)."""
        return np.column_stack([self.pitch_mm * number, np.zeros(len(number))])


@dataclass(frozen=True)
class Dots:
    """What one image shows: centre_px (n, 2) and number (n, 2) of every dot; numbers count along the target's axes."""

    centre_px: np.ndarray
    number: np.ndarray


@dataclass(frozen=True)
class CameraModel:
    """A calibrated camera: matrix (3, 3), distortion (k1, k2, p1, p2), rms in px that the calibration left."""

    matrix: np.ndarray
    distortion: np.ndarray
    rms_px: float

    def project(self, plane_mm, turn, shift_mm):
        """Pixels (2, ...) of points (2, ...) of the target's plane; turn, shift_mm (3,): target's frame to camera's.

        The same bits as `cv2.projectPoints`, which always adds a Jacobian at six times the cost.
        """
        places = zip(cv2.Rodrigues(turn)[0], np.ravel(shift_mm), strict=True)
        x, y, z = (row[0] * plane_mm[0] + row[1] * plane_mm[1] + shift for row, shift in places)
        inverse = 1.0 / z
        x, y = x * inverse, y * inverse
        (k1, k2, p1, p2), ((fx, _, cx), (_, fy, cy), _) = self.distortion, self.matrix
        square, across = x * x + y * y, 2.0 * x * y
        radial = 1.0 + k1 * square + k2 * (square * square)
        moved_x = x * radial + p1 * across + p2 * (square + 2.0 * x * x)
        moved_y = y * radial + p1 * (square + 2.0 * y * y) + p2 * across
        return np.stack([moved_x * fx + cx, moved_y * fy + cy])

    def centre_bias(self, number, turn, shift_mm, lattice):
        """Pixels (n, 2) from the image of each dot's centre to its image's centroid: a tilted circle's is off it.

        number (n, 2): of the dots; turn, shift_mm: as in `project`.
        """
        angle = 2.0 * np.pi * np.arange(_CORNERS) / _CORNERS
        edge = lattice.diameter_mm / 2.0 * np.stack([np.cos(angle), np.sin(angle)])
        middle = lattice.pitch_mm * number.T[:, None].astype(float)
        image = self.project(np.concatenate([middle, middle + edge[:, :, None]], axis=1), turn, shift_mm)
        x, y = image[:, 1:] - image[:, :1]
        next_x, next_y = np.roll(x, -1, axis=0), np.roll(y, -1, axis=0)
        area = x * next_y - y * next_x
        sums = np.stack([((x + next_x) * area).sum(axis=0), ((y + next_y) * area).sum(axis=0)], axis=-1)
        # summed pairwise, which numpy does along contiguous axes
        return sums / (3.0 * np.ascontiguousarray(area.T).sum(axis=1))[:, None]


@dataclass(frozen=True)
class Pose:
    """Rotation (3, 3) and translation_mm (3,) from the target's frame to the camera's, rms_px of the dots."""

    rotation: np.ndarray
    translation_mm: np.ndarray
    rms_px: float

    @property
    def centre_mm(self):
        """Optical centre (3,) in the target's frame (paper C, the equation before (12))."""
        return -self.rotation.T @ self.translation_mm


def read_dots(image, name):
    """Dots of an image (height, width) of 8 bits; raises FitError with its name where too few make a lattice."""
    centres = find_dots(image)
    numbers, known = centres, np.zeros(len(centres), dtype=bool)
    if len(centres) >= _FEWEST_DOTS:
        numbers, known = number_dots(centres)
    if known.sum() < _FEWEST_DOTS:
        raise FitError(f"{name}: {known.sum()} dots make a lattice; allowed: at least {_FEWEST_DOTS}")
    return Dots(centres[known], numbers[known])


def find_dots(image):
    """Centres (n, 2) of the dark dots that an image shows whole: mean of the pixels weighted by their darkness."""
    _, dark = cv2.threshold(image, 0, 1, cv2.THRESH_BINARY_INV + cv2.THRESH_OTSU)
    _, labels, stats, _ = cv2.connectedComponentsWithStats(dark)
    left, top, width, height, area = stats.T
    whole = (left >= _EDGE_PX) & (top >= _EDGE_PX)
    whole &= (left + width <= image.shape[1] - _EDGE_PX) & (top + height <= image.shape[0] - _EDGE_PX)
    # label 0 is the plate
    whole[0] = False
    if not whole.any():
        return np.zeros((0, 2))
    share = area / np.median(area[whole])
    whole &= (share > _AREA_SHARE[0]) & (share < _AREA_SHARE[1])
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * _EDGE_PX + 1, 2 * _EDGE_PX + 1))
    window = cv2.dilate(labels.astype(np.uint16), disc)
    darkness = np.median(image[window == 0]) - image.astype(float)
    return np.array(ndimage.center_of_mass(darkness, window, np.flatnonzero(whole)))[:, ::-1]


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
    inner = beside.sum(axis=1) == 4
    if not inner.any():
        return np.zeros(centre_px.shape, dtype=int), np.zeros(len(centre_px), dtype=bool)
    start = np.where(inner, np.linalg.norm(centre_px - centre_px.mean(axis=0), axis=1), np.inf).argmin()
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


def calibrate_camera(views, size_px, lattice):
    """CameraModel from Dots of several tilted views of one target; size_px: width and height.

    Parallel views would not do: they see the focal length and the distance only together. A first calibration tells how
    far every dot's image is off that of its centre, the second is free of that.
    """
    places = [lattice.places(view.number).astype(np.float32) for view in views]

    def fitted(centres):
        single = [centre.astype(np.float32) for centre in centres]
        fit = cv2.calibrateCamera(places, single, size_px, None, None, flags=cv2.CALIB_FIX_K3)
        rms, matrix, distortion, turns, shifts = fit
        return CameraModel(matrix, distortion.ravel()[:4], float(rms)), zip(views, turns, shifts, strict=True)

    rough, poses = fitted([view.centre_px for view in views])
    centres = [view.centre_px - rough.centre_bias(view.number, turn, shift, lattice) for view, turn, shift in poses]
    return fitted(centres)[0]


def camera_pose(model, dots, lattice):
    """Pose of the calibrated camera against the target from the dots of one image."""
    places, centres, lens = lattice.places(dots.number), dots.centre_px, (model.matrix, model.distortion)
    for _ in range(2):
        solved, turn, shift = cv2.solvePnP(places, centres, *lens)
        if not solved:
            raise FitError(f"no camera pose fits {len(places)} dots")
        centres = dots.centre_px - model.centre_bias(dots.number, turn, shift, lattice)
    turn, shift = cv2.solvePnPRefineLM(places, centres, *lens, turn, shift)
    left = model.project(places.T[:2], turn, shift) - centres.T
    return Pose(cv2.Rodrigues(turn)[0], shift[:, 0], float(np.sqrt((left**2).sum(axis=0).mean())))


def camera_poses(model, views, lattice):
    """Poses for the Dots of every image: each by itself ("centre"), and of a camera that never turns ("one_rotation").

    For the latter all have the mean rotation, with which the translation t follows from linear equations,
    x (R X + t)_z = (R X + t)_x of every dot and the same for y.
    """
    poses = [camera_pose(model, dots, lattice) for dots in views]
    rotation = Rotation.from_matrix([pose.rotation for pose in poses]).mean().as_matrix()
    together = []
    for dots, pose in zip(views, poses, strict=True):
        x, y = cv2.undistortPoints(dots.centre_px[:, None], model.matrix, model.distortion)[:, 0].T
        turned = lattice.places(dots.number) @ rotation.T
        one, none = np.ones(len(x)), np.zeros(len(x))
        rows = np.concatenate([np.column_stack([one, none, -x]), np.column_stack([none, one, -y])])
        right = np.concatenate([x * turned[:, 2] - turned[:, 0], y * turned[:, 2] - turned[:, 1]])
        together.append(replace(pose, rotation=rotation, translation_mm=np.linalg.lstsq(rows, right, rcond=None)[0]))
    return {"centre": poses, "one_rotation": together}


def join_places(centre_mm, command_mm, pitch_mm):
    """Optical centres (n, 3) in one target frame, from those whose dots were numbered image by image.

    The first one's numbers hold. command_mm (n, 3): commanded positions. The step between two images is known to whole
    pitches from the command, as long as the robot's error and the target's turn against the robot's axes make less than
    half a pitch of it. Raises FitError where that is in doubt.
    """
    missing = (np.diff(command_mm, axis=0) - np.diff(centre_mm, axis=0))[:, :2] / pitch_mm
    off = np.abs(missing - np.rint(missing)).max(axis=1)
    doubtful = np.flatnonzero(off > _SURE_SHARE)
    if doubtful.size:
        raise FitError(
            f"pose {doubtful[0] + 2}: the step from the pose before is {off[doubtful[0]]:.2f} pitches off the dots' "
            f"lattice; allowed: {_SURE_SHARE}, shorter steps or a target that is better aligned help"
        )
    whole = pitch_mm * np.column_stack([np.rint(missing), np.zeros(len(missing))])
    return centre_mm + np.concatenate([np.zeros((1, 3)), np.cumsum(whole, axis=0)])
