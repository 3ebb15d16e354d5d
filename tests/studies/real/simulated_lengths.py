"""Belt and cable machines that are simulated, and where the measured ones lie."""

import os
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

NAMES = ("a", "b", "c", "d", "e")


def belts(seed, count=4, rows=60, noise_mm=0.3, missing_mm=0.0, scale=0.0):
    """A random frame of belts: columns of its counted lengths, its section of the configuration, and its anchors."""
    generator = np.random.default_rng(seed)
    turn = -0.75 * np.pi + 2.0 * np.pi * (np.arange(count) + generator.uniform(-0.2, 0.2, count)) / count
    anchors = np.stack([1500.0 * np.cos(turn), 1100.0 * np.sin(turn)], axis=1)
    anchors = anchors * generator.uniform(0.8, 1.2)
    places = generator.uniform([-700.0, -500.0], [700.0, 500.0], (rows, 2))
    heights = generator.uniform(20.0, 110.0, count)
    lengths = np.sqrt(((places[:, None] - anchors) ** 2).sum(axis=-1) + heights**2)
    counted = (lengths - np.asarray(missing_mm)) / (1.0 + np.asarray(scale))
    counted = counted + noise_mm * generator.normal(size=lengths.shape)
    names = NAMES[:count]
    frame = pd.DataFrame({f"{name}_mm": column for name, column in zip(names, counted.T, strict=True)})
    section = {
        "kind": "belts",
        "files": "simulated.csv",
        "lengths": {name: f"{name}_mm" for name in names},
        "heights_mm": dict(zip(names, heights.tolist(), strict=True)),
    }
    return frame, section, anchors


CABLES = {
    "kind": "cables",
    "files": "simulated.csv",
    "drums": {
        "drum1": {"column": "drum1_rad", "radius_mm": 25.0},
        "drum2": {"column": "drum2_rad", "radius_mm": 35.0},
        "drum3": {"column": "drum3_rad", "radius_mm": 35.0},
    },
    "anchors": ["a1", "a2", "a3", "a4"],
    "distances": [[1, 1, 0, 0], [1, 0, 2, 0], [0, 1, 0, 2]],
    "position": ["x_m", "y_m"],
    "unit": "m",
}


def cables(seed, rows=40, noise_mm=0.5, radii=(25.0, 35.0, 35.0)):
    """Poses of a cable robot routed as the measured one, with anchors (4, 2) drawn at random, and these."""
    generator = np.random.default_rng(seed)
    anchors = np.array([[-550.0, 730.0], [600.0, 735.0], [-520.0, -1120.0], [595.0, -1070.0]])
    anchors = anchors + generator.normal(0.0, 60.0, anchors.shape)
    places = generator.uniform(-250.0, 250.0, (rows, 2))
    distances = np.linalg.norm(places[:, None] - anchors, axis=-1) @ np.array(CABLES["distances"]).T
    angles = (distances - distances[0] + noise_mm * generator.normal(size=distances.shape)) / np.array(radii)
    columns = {f"drum{k + 1}_rad": angles[:, k] for k in range(3)}
    return pd.DataFrame(columns | {"x_m": places[:, 0] / 1000.0, "y_m": places[:, 1] / 1000.0}), anchors


def measured(name):
    """A file below the folder that RRRU_REAL_DATA names; the test is skipped where there is none."""
    folder = os.environ.get("RRRU_REAL_DATA")
    if not folder:
        pytest.skip("RRRU_REAL_DATA names no folder with the measured robots")
    path = Path(folder) / name
    if not path.is_file():
        pytest.skip(f"there is no {path}")
    return pd.read_csv(path)
