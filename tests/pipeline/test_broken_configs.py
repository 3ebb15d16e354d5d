"""A broken configuration is taken or refused with place and value, never with anything else.

By what the Snakefile asks of it before anything runs; RRRU_BROKEN_FILES is the number of configurations.
"""

import copy
import importlib
import re
from collections import Counter

import pytest
import yaml
from hypothesis import given
from snakemake.utils import update_config, validate

from rrru.errors import ConfigError
from rrru.pipeline import config as parts
from rrru.pipeline.checks import check_schema, set_defaults
from rrru.studies.ptt3 import parts as ptt
from rrru.studies.rrru3 import settings as paper_a
from tests.broken import COUNT, EDITS, counted, edited, many
from tests.places import ROOT
from tests.refusals import refusals

SCHEMA = ROOT / "rrru/pipeline/config.schema.yaml"
RULES = "".join(file.read_text() for file in sorted((ROOT / "workflow/rules").rglob("*.smk")))
CHECKS = [name for line in RULES.splitlines() if "CHECKS" in line for name in re.findall(r'"(rrru[.\w]+:\w+)"', line)]


def _base():
    """The configuration with small numbers."""
    config, small = (yaml.safe_load((ROOT / name).read_text()) for name in ("config.yaml", "tests/minimal.yaml"))
    update_config(config, small)
    return config


def _asked(config):
    """What the Snakefile asks."""
    check_schema(config, SCHEMA)
    # whatever it refuses, the stricter one has refused
    set_defaults(config, SCHEMA)
    for check in (parts.check_files, ptt.check, paper_a.check):
        check(config)
    for name in CHECKS:
        module, _, function = name.partition(":")
        getattr(importlib.import_module(module), function)(config)


def test_defaults_are_those_that_snakemake_sets():
    """Those of the schema, nested ones too."""
    config = _base()
    config["campaigns"]["paper"]["passes"] = [{}]
    config["virtual_robots"]["mine"] = {"axis_errors": {}}
    expected = copy.deepcopy(config)
    validate(expected, str(SCHEMA))
    set_defaults(config, SCHEMA)
    assert config == expected and config["campaigns"]["paper"]["passes"] == [{"reverse": False, "payload_kg": 0.0}]


def test_a_broken_configuration_is_taken_or_refused(monkeypatch):
    monkeypatch.chdir(ROOT)
    base, counts = _base(), Counter()
    _asked(copy.deepcopy(base))
    assert len(CHECKS) >= 5

    # few edits of a configuration leave a right one
    @many(4 * COUNT)
    @given(edits=EDITS)
    def one(edits):
        counted(counts, ConfigError, _asked, edited(base, edits))

    one()
    print("configurations", dict(counts))
    assert counts["refused"] and counts["taken"]


@refusals("overlay", "message")
def test_what_is_refused_says_what_is_meant(overlay, message, monkeypatch):
    monkeypatch.chdir(ROOT)
    config = _base()
    update_config(config, yaml.safe_load(overlay))
    with pytest.raises(ConfigError, match=re.escape(message)):
        _asked(config)
