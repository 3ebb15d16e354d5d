"""From images of a dot target to camera poses (paper C, 2): dots, their numbers, the camera, O_cj = -R_j^T T_j.

A target is a lattice of dots in the plane z = 0 of its frame. Dots are numbered within an image from one near its
middle, x to the right and y upwards, because an image alone does not show which dots of the plate it has. Centres are
in pixels, that of the first pixel is (0, 0); mm, rad.
"""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from scipy import ndimage
from scipy.spatial.transform import Rotation

from rrru.errors import FitError

# the order of sums in the camera calibration depends on OpenCV's threads; one thread gives reproducible bytes
cv2.setNumThreads(1)

# pixels by which the window of a dot's centre exceeds the dot, so that it holds the blurred edge
_EDGE_PX = 4
# areas of dots relative to the median one
_AREA_SHARE = (0.6, 1.5)
# largest distance of a dot from the lattice, over the pitch
_LATTICE_SHARE = 0.15
# largest distance of neighbours along a row or column over that of the nearest dot; diagonal ones are farther
_MAX_NEIGHBOUR = 1.3
_FEWEST_DOTS = 12
# largest difference of a commanded step from the lattice, over the pitch, for which the dots' numbers are unique
_MAX_STEP_ERROR = 0.4
# corners of the polygon that approximates a dot's edge
_CORNERS = 36


@dataclass(frozen=True)
class Lattice:
    """A target as stated by its maker: pitch and diameter of its dots."""

    pitch_mm: float
    diameter_mm: float

    def places(self, number):
        """Places (n, 3) in the target's frame of dots with numbers (n, 2)."""
        return np.column_stack([self.pitch_mm * number, np.zeros(len(number))])


@dataclass(frozen=True)
class Dots:
    """The dots of one image: centre_px (n, 2) and number (n, 2) of each; numbers count along the target's axes."""

    centre_px: np.ndarray
    number: np.ndarray


@dataclass(frozen=True)
class CameraModel:
    """A calibrated camera: matrix (3, 3), distortion (k1, k2, p1, p2), rms residual of the calibration in px."""

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
        """Pixels (n, 2) from the image of each dot's centre to its image's centroid, which differ for tilted circles.

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
    """Dots of an image (height, width) of 8 bits; raises FitError with its name where too few are on a lattice."""
    centres = find_dots(image)
    numbers, known = centres, np.zeros(len(centres), dtype=bool)
    if len(centres) >= _FEWEST_DOTS:
        numbers, known = number_dots(centres)
    if known.sum() < _FEWEST_DOTS:
        raise FitError(f"{name}: {known.sum()} dots are on a lattice; allowed: at least {_FEWEST_DOTS}")
    return Dots(centres[known], numbers[known])


def find_dots(image):
    """Centres (n, 2) of the dark dots that are completely in an image: mean of the pixels weighted by darkness."""
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

    The lattice grows outwards from the dot with four neighbours that is nearest to the middle. The numbered dots give
    the homography for the next ones. The camera may be rotated about its axis by less than 45 degrees and tilted by
    less than 30.
    """
    steps = centre_px[None] - centre_px[:, None]
    distance = np.linalg.norm(steps, axis=-1)
    np.fill_diagonal(distance, np.inf)
    neighbours = distance < _MAX_NEIGHBOUR * distance.min(axis=1, keepdims=True)
    inner = neighbours.sum(axis=1) == 4
    if not inner.any():
        return np.zeros(centre_px.shape, dtype=int), np.zeros(len(centre_px), dtype=bool)
    start = np.where(inner, np.linalg.norm(centre_px - centre_px.mean(axis=0), axis=1), np.inf).argmin()
    near = steps[start][neighbours[start]]
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

    Focal length and distance are confounded in parallel views. A first calibration gives the bias of every dot's
    centroid, the second one is corrected for it.
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
    """Pose of the calibrated camera relative to the target from the dots of one image."""
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
    """Poses for the Dots of every image: each separately ("centre"), and with a common rotation ("one_rotation").

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
    """Optical centres (n, 3) in one target frame, from those with dots numbered image by image.

    The numbers of the first image are used. command_mm (n, 3): commanded positions. The command gives the step between
    two images in whole pitches if robot error and rotation of the target relative to the robot's axes contribute less
    than half a pitch. Raises FitError where that is not certain.
    """
    missing = (np.diff(command_mm, axis=0) - np.diff(centre_mm, axis=0))[:, :2] / pitch_mm
    off = np.abs(missing - np.rint(missing)).max(axis=1)
    ambiguous = np.flatnonzero(off > _MAX_STEP_ERROR)
    if ambiguous.size:
        raise FitError(
            f"pose {ambiguous[0] + 2}: the step from the pose before is {off[ambiguous[0]]:.2f} pitches off the dots' "
            f"lattice; allowed: {_MAX_STEP_ERROR}; use shorter steps, or align the target with the robot's axes"
        )
    whole = pitch_mm * np.column_stack([np.rint(missing), np.zeros(len(missing))])
    return centre_mm + np.concatenate([np.zeros((1, 3)), np.cumsum(whole, axis=0)])
