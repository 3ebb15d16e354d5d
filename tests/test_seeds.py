"""Random streams: stable, independent, and the same for equal numbers."""

import hashlib

import numpy as np
import pytest

from rrru.seeds import run_seed, stream, stream_seed


def test_seeds_are_the_digest_of_their_labels():
    digest = hashlib.sha256(b"5\x1fone\x1f0.8\x1f3").hexdigest()
    assert stream_seed(5, "one", 0.8, 3) == int(digest[:16], 16) // 2
    assert run_seed(5, "one", 0.8, 3) == int(digest[:16], 16) // 2 % 2**32


def test_seeds_differ_for_all_that_differs_and_only_for_that():
    labels = [
        (s, p, k, v, n)
        for s in (0, 1)
        for p in ("a", "b")
        for k in ("one", "islands")
        for v in (0.1, 0.2, 1.0)
        for n in range(20)
    ]
    assert len({stream_seed(*label) for label in labels}) == len({run_seed(*label) for label in labels}) == len(labels)
    assert all(0 <= run_seed(*label) < 2**32 for label in labels)
    assert run_seed(0, 0.1 + 0.2) == run_seed(0, 0.3) == run_seed(0, np.float64(0.3))
    assert run_seed(0, 1) == run_seed(0, 1.0) and run_seed(0, "ab", "c") != run_seed(0, "a", "bc")


def test_streams_of_different_labels_are_uncorrelated():
    draws = np.array([stream(1, "purpose", k).standard_normal(2000) for k in range(8)])
    correlation = np.corrcoef(draws) - np.eye(8)
    assert np.abs(correlation).max() < 5.0 / np.sqrt(2000) and draws.std() == pytest.approx(1.0, abs=0.03)
    np.testing.assert_array_equal(draws[3], stream(1, "purpose", 3).standard_normal(2000))
