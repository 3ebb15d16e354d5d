"""What is refused, and with which words: cases of a test from the YAML file of its module."""

import inspect
from functools import cache
from pathlib import Path

import pytest
import yaml

_LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


@cache
def cases(module):
    """By name of a test, the cases of the YAML file of its module, a path."""
    return yaml.load(Path(module).with_suffix(".yaml").read_text(encoding="utf-8"), Loader=_LOADER)


def refusals(*names):
    """Decorator: a test's cases, lists of the arguments `names`, from the module's YAML file under the test's name."""

    def parametrized(test):
        found = cases(inspect.getfile(test))[test.__name__]
        return pytest.mark.parametrize(names, [tuple(case) for case in found])(test)

    return parametrized
