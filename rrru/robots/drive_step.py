"""Newton steps of the actuator values of a robot without a closed inverse. Lengths in mm, angles in rad."""

import numpy as np

from rrru.robots.closure import Poses, Twists, walk


def drive_step(at, ranks, lack_mm, turning_rad):
    """Changes (n, K) of the actuator values that remove what position (n, 3) and, as far as they can, turn (n, 3) lack.

    ranks: freedoms of the point's position and, beside it, of the platform's orientation that the drives have. With the
    size (n,) in rad of the change of orientation that they can and should still make.
    """
    reach = _inverse_of_rank(at.drive_response, ranks[0])
    step = reach @ lack_mm[:, :, None]
    beside = np.eye(reach.shape[1]) - reach @ at.drive_response
    turn = at.platform[:, 3:] @ at.drive_counts
    more = _inverse_of_rank(turn @ beside, ranks[1]) @ (turning_rad[:, :, None] - turn @ step)
    step += beside @ more
    return step[:, :, 0], np.linalg.norm((turn @ beside @ more)[:, :, 0], axis=1)


def _inverse_of_rank(matrices, rank):
    """Pseudo-inverses (n, k, j) of matrices (n, j, k) by their largest `rank` singular values."""
    u, size, vt = np.linalg.svd(matrices, full_matrices=False)
    return (vt[:, :rank].transpose(0, 2, 1) / size[:, None, :rank]) @ u[:, :, :rank].transpose(0, 2, 1)


def end_of(legs, leg, actuators):
    """Poses (n) at which a leg ends whose joints are all driven, at actuator values (n, K)."""
    passive = np.zeros((len(actuators), len(legs.passive_joints)))
    way = walk(legs, leg, actuators, passive, Twists(legs))
    return Poses(way.place, way.turn, passive, None, None)
