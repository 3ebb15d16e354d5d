"""Fixtures of the twin's search."""

import pytest

from rrru.robots.rrru3 import Rrru3
from rrru.studies.rrru3 import twin_descent, twin_search
from tests.studies.rrru3.test_twin import CONFIGURED, MOTION, draws


@pytest.fixture(scope="module")
def task():
    """A search over three draws."""
    return twin_search.Task(Rrru3(), MOTION, CONFIGURED, 0.02, draws(0))


@pytest.fixture(scope="module")
def short_descents():
    """Descents of one step with the tolerance and one without."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(twin_descent, "_STEPS", (1, 1))
        yield
