"""Cached results: the right one for every argument and class, and none that a caller can change."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from rrru.cache import cached_on, last_cached, last_cached_of


@dataclass(frozen=True)
class _Pair:
    first: np.ndarray
    rest: tuple


@dataclass(frozen=True, eq=False)
class _Line:
    slope: float

    @last_cached
    def at(self, x):
        return self.slope * x

    @last_cached
    def pair(self, x):
        return _Pair(x[:1], ({"all": self.slope * x},))

    @last_cached_of
    def length(self, other):
        return np.array([self.slope * len(other)])


class _Shifted(_Line):
    @last_cached
    def at(self, x):
        return super().at(x) + 1.0

    @last_cached_of
    def length(self, other):
        return super().length(other) + 1.0


def test_a_method_that_overrides_a_cached_one_has_a_result_of_its_own():
    line, x = _Shifted(2.0), np.array([1.0, 3.0])
    for _ in range(2):
        np.testing.assert_array_equal(line.at(x), [3.0, 7.0])
        np.testing.assert_array_equal(_Line.at(line, x), [2.0, 6.0])
        np.testing.assert_array_equal(line.length("abc"), [7.0])
        np.testing.assert_array_equal(_Line.length(line, "abc"), [6.0])


def test_a_replaced_object_has_no_result_of_the_one_before():
    line, x = _Line(2.0), np.array([1.0, 3.0])
    assert line.at(x)[0] == 2.0 and replace(line, slope=5.0).at(x)[0] == 5.0


def test_a_function_of_one_object_is_computed_once_for_each_object():
    computed = []

    @cached_on
    def slope_of(line):
        computed.append(line)
        return line.slope

    line = _Line(2.0)
    other = replace(line, slope=5.0)
    assert [slope_of(one) for one in (line, line, other)] == [2.0, 2.0, 5.0] and computed == [line, other]


def test_results_are_those_of_the_argument_as_it_was():
    line, x = _Line(2.0), np.array([1.0, 3.0])
    before = line.pair(x)
    x[0] = 9.0
    assert before.first[0] == 1.0 and line.pair(np.array([1.0, 3.0])).first[0] == 1.0
    assert line.pair(x).first[0] == 9.0


def test_results_cannot_be_changed_in_place():
    line, x = _Line(2.0), np.array([1.0, 3.0])
    pair = line.pair(x)
    for shared in (line.at(x), pair.first, pair.rest[0]["all"], line.length("abc")):
        with pytest.raises(ValueError, match="read-only"):
            shared += 1.0
    x += 1.0
