"""Writes down what every workflow script reads of its settings, which modules of the package it has loaded, and in how
many threads linear algebra runs.

It is on the path of the shared run's jobs only; see `tests/workflow/test_dependencies.py`.
"""

import json
import os
import sys
from pathlib import Path

from threadpoolctl import threadpool_info

from rrru.store import job

_plain_run = job.run


class Recorded(dict):
    """A mapping that notes the path of every value that is taken from it."""

    def __init__(self, values, seen, path=()):
        super().__init__({k: Recorded(v, seen, (*path, k)) if isinstance(v, dict) else v for k, v in values.items()})
        self.seen, self.path = seen, path

    def __getitem__(self, key):
        self.seen.add((*self.path, key))
        return super().__getitem__(key)

    def get(self, key, default=None):
        """As of a dict."""
        if key in self:
            return self[key]
        return default

    def __iter__(self):
        return iter(list(super().__iter__()))

    def keys(self):
        """As of a dict."""
        return list(super().__iter__())

    def values(self):
        """As of a dict."""
        return [self[key] for key in self]

    def items(self):
        """As of a dict."""
        return [(key, self[key]) for key in self]

    def pop(self, key, *default):
        """As of a dict."""
        self.seen.add((*self.path, key))
        return super().pop(key, *default)

    def __or__(self, other):
        return dict(self.items()) | dict(other.items())

    def __ror__(self, other):
        return dict(other.items()) | dict(self.items())

    def __reduce__(self):
        return dict, (list(self.items()),)


def leaves(values, path=()):
    """Paths of all values in a nested mapping that are no mappings themselves."""
    for key, value in dict.items(values):
        if isinstance(value, dict) and value:
            yield from leaves(value, (*path, key))
        else:
            yield (*path, key)


def run(main, snakemake):
    """`job.run` with settings that note what is read."""
    seen = set()

    def recorded(settings, inputs, outputs):
        main(Recorded(settings, seen), inputs, outputs)

    _plain_run(recorded, snakemake)
    loaded = sorted(name for name in sys.modules if name.split(".")[0] == "rrru")
    # snakemake runs a copy, and states the script's own path
    script = Path(sys.modules["__main__"].__file__).name
    row = {"rule": snakemake.rule, "script": script, "modules": loaded, "code": snakemake.params.code}
    row |= {"handed": sorted(leaves(snakemake.params.settings), key=str), "read": sorted(seen, key=str)}
    row |= {"threads": [(pool["internal_api"], pool["num_threads"]) for pool in threadpool_info()]}
    file = Path(os.environ["RRRU_RECORD"]) / f"{snakemake.rule}_{os.getpid()}.json"
    file.write_text(json.dumps(row))


if "RRRU_RECORD" in os.environ:
    job.run = run
