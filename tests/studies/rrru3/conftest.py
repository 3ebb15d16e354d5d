"""Fixtures of the twin's search."""

import pytest

from rrru.studies.rrru3 import twin_descent


@pytest.fixture(scope="module")
def short_descents():
    """Descents of one step with the tolerance and one without."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(twin_descent, "_STEPS", (1, 1))
        yield
