"""Readings of another reflector than the file says, found by what is rigid."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rrru.campaign.ingest.outliers import strays

_TOOL = {"a": (100.0, 0.0, 0.0), "b": (0.0, 80.0, 10.0), "c": (-60.0, -50.0, 30.0)}
_TABLE = {"t1": (500.0, 100.0, -600.0), "t2": (300.0, -400.0, -600.0)}


def _seen(count=20, noise_mm=0.01):
    """Positions of all reflectors at stops, their stops, names, and which stand on the table."""
    generator = np.random.default_rng(3)
    turns, shifts = Rotation.random(count, random_state=generator), generator.uniform(-300.0, 300.0, (count, 3))
    tool = np.stack([turns.apply(place) + shifts for place in _TOOL.values()], axis=1)
    table = np.tile(np.array([*_TABLE.values()]), (count, 1, 1))
    position = np.concatenate([tool, table], axis=1)
    position += noise_mm * generator.standard_normal(position.shape)
    names = np.tile([*_TOOL, *_TABLE], count)
    return position.reshape(-1, 3), np.repeat(np.arange(count), 5), names, np.isin(names, [*_TABLE])


def _marked(position, stop, names, on_world):
    marked, texts = strays(position, stop, names, on_world)
    assert sorted(texts) == np.flatnonzero(marked).tolist()
    return texts


def test_right_readings_are_left_alone():
    assert _marked(*_seen()) == {}


@pytest.mark.parametrize(
    ("own", "other", "away"), [("a", "b", "128"), ("t1", "t2", "538"), ("t2", "c", ""), ("c", "t1", "")]
)
def test_a_reading_of_another_reflector_is_named(own, other, away):
    position, stop, names, on_world = _seen()
    rows = {name: np.flatnonzero(names == name) for name in (own, other)}
    position[rows[own][7]] = position[rows[other][7]] + 0.02
    (text,) = (found := _marked(position, stop, names, on_world)).values()
    assert [*found] == [rows[own][7]] and text.startswith(f"{own} lies {away}")
    assert text.endswith(f"mm away, where {other} is")


def test_what_lies_nowhere_is_told_as_such():
    position, stop, names, on_world = _seen()
    position[35] += [0.0, 60.0, 20.0]
    position[43] += [0.0, 7.0, 0.0]
    assert _marked(position, stop, names, on_world) == {
        35: "a does not keep its distance from the others",
        43: "t1 lies 7 mm away",
    }


def test_of_two_that_disagree_both_are_marked_and_missing_ones_do_no_harm():
    position, stop, names, on_world = _seen()
    position[35] += 7.0
    seen = np.arange(len(stop)) != 37
    assert [*_marked(position[seen], stop[seen], names[seen], on_world[seen])] == [35, 36]


def test_reflectors_that_move_against_each_other_are_no_body():
    position, stop, names, on_world = _seen()
    position[names == "c"] += np.random.default_rng(1).uniform(-50.0, 50.0, (20, 3))
    position[names == "t1"] += np.random.default_rng(2).uniform(-50.0, 50.0, (20, 3))
    assert _marked(position, stop, names, on_world) == {}
