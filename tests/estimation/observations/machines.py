"""Random machines whose lengths are known."""

import numpy as np

from rrru.estimation.observations.length_starts import align_to_frame, free_coordinates, propose_anchors
from rrru.estimation.observations.lengths import Lengths


def machine(seed, count=4, dimensions=2, rows=40, noise_mm=0.3, missing_mm=0.0, common=False):
    """Lengths of random belts, the true anchors (n, d) and places (N, d)."""
    generator = np.random.default_rng(seed)
    if dimensions == 2:
        turn = 2.0 * np.pi * (np.arange(count) + generator.uniform(-0.2, 0.2, count)) / count
        anchors = 1300.0 * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    else:
        anchors = generator.normal(size=(count, 3))
        anchors *= 1500.0 / np.linalg.norm(anchors, axis=1, keepdims=True)
    places = generator.uniform(-500.0, 500.0, (rows, dimensions))
    heights = generator.uniform(20.0, 100.0, count) * (dimensions == 2)
    anchors, places = align_to_frame(anchors), align_to_frame(anchors, places)
    lengths = np.sqrt(((places[:, None] - anchors) ** 2).sum(axis=-1) + heights**2) - missing_mm
    counted = lengths + noise_mm * generator.normal(size=lengths.shape)
    full = count * dimensions + 2 * count
    columns = list(np.eye(full)[np.flatnonzero(free_coordinates(count, dimensions))])
    if common:
        columns.append(np.concatenate([np.zeros(full - 2 * count), np.ones(count), np.zeros(count)]))
    origin = np.append(np.zeros(full - count), np.ones(count))
    return Lengths(counted, np.eye(count), heights, origin, np.array(columns).T), anchors, places


def values_of(lengths, anchors, missing_mm=0.0):
    """Values (p,) of anchors (n, d) and a common missing length."""
    full = np.concatenate([anchors.ravel(), np.full(len(anchors), missing_mm), np.ones(len(anchors))])
    return np.linalg.pinv(lengths.basis) @ (full - lengths.origin)


def starts(lengths):
    """Values (p,) to start from."""
    for anchors, missing in propose_anchors(lengths.counted, lengths.heights_mm, lengths.dimensions):
        yield values_of(lengths, anchors, missing)
