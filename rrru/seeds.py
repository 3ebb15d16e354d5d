"""Independent random streams from one study seed and the names of what they are for."""

import hashlib

import numpy as np


def stream_seed(study_seed, *labels):
    """Seed (a non-negative integer below 2^63) for the labels; the same on every machine, different for other labels."""
    text = "\x1f".join([str(study_seed), *(str(label) for label in labels)])
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:8], "big") >> 1


def stream(study_seed, *labels):
    """Generator of numpy for the labels, see `stream_seed`."""
    return np.random.default_rng(stream_seed(study_seed, *labels))
