"""Independent random streams from one study seed and labels of their purpose."""

import hashlib

import numpy as np


def stream_seed(study_seed: int, *labels: str | float) -> int:
    """Seed, 0 to 2^63 - 1, for labels (texts and numbers): the same on every machine, independent for other labels.

    Numbers count to ten digits, so that 0.1 + 0.2 is 0.3, and 1.0 is 1.
    """
    text = "\x1f".join(label if isinstance(label, str) else f"{label:.10g}" for label in (study_seed, *labels))
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:8], "big") >> 1


def stream(study_seed: int, *labels: str | float) -> np.random.Generator:
    """Generator of numpy for the labels, see `stream_seed`."""
    return np.random.default_rng(stream_seed(study_seed, *labels))


def run_seed(study_seed: int, *labels: str | float) -> int:
    """Seed, 0 to 2^32 - 1, for libraries that take no larger one; see `stream_seed`."""
    return stream_seed(study_seed, *labels) % 2**32
