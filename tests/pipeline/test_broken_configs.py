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
from rrru.pipeline.checks import check_schema
from rrru.studies.ptt3 import parts as ptt
from rrru.studies.rrru3 import settings as paper_a
from tests.broken import COUNT, EDITS, counted, edited, many
from tests.places import ROOT

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
    # sets the defaults; whatever it refuses, the stricter one has refused
    validate(config, str(SCHEMA))
    for check in (parts.check_files, ptt.check, paper_a.check):
        check(config)
    for name in CHECKS:
        module, _, function = name.partition(":")
        getattr(importlib.import_module(module), function)(config)


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


@pytest.mark.parametrize(
    ("overlay", "message"),
    [
        ("motion: {dwell_s: .nan}", "motion.dwell_s: nan is not of type 'number'; allowed: a finite number"),
        ("motion: {dwell_s: .inf}", "motion.dwell_s: inf is not of type 'number'; allowed: a finite number"),
        ("results_dir: a{b}", "results_dir: 'a{b}' does not match"),
        ("seed: 5.0", "seed: 5.0 is not of type 'integer'; allowed: a whole number, without a point"),
        ("campaigns: {1: {robot: rrru3}}", "is not of type 'object'; allowed: a mapping whose keys are text"),
        ("campaigns: {no: {robot: rrru3}}", "is not of type 'object'; allowed: a mapping whose keys are text"),
        ("loads: {arm_mass_kg: 8.0e-1x}", "is not of type 'number'; allowed: a finite number of at most 1e+15"),
        ("loads: {arm_mass_kg: 8.0e1}", "it is text to YAML: write 80.0, without quotes"),
        ('loads: {arm_mass_kg: "8e-05"}', "it is text to YAML: write 8.0e-05, without quotes"),
        ("campaigns: {crooked: {platform_mass_kg: 3.0}}", "crooked: 'platform_mass_kg' is not one of ['robot', "),
        ("campaigns: {mine: {robot: rrru3, ingest: a.csv, unit: mms}}", "did you mean mm for mms?"),
        (
            "campaigns: {mine: {robot: rrru3, ingest: a.csv, motion: stop_and_goo}}",
            "mine.motion: 'stop_and_goo' is not one of ['stop_and_go', 'continuous']; did you mean stop_and_go",
        ),
        (
            "campaigns: {mine: {robot: rrru3, ingest: a.csv, motion: {kind: stop_and_go, between: joints}}}",
            "mine.motion.between: 'joints' is not one of ['tool', 'drives']",
        ),
        (
            "campaigns: {mine: {robot: rrru3, ingest: a.csv, motion: {between: tool}}}",
            "mine.motion: 'kind' is a required property",
        ),
        (
            "campaigns: {mine: {robot: rrru3, ingest: a.csv, motion: {kind: continuous, path: tool}}}",
            "'path' was unexpected); allowed: kind, between",
        ),
        (
            "robots: {rrru3: {limits: {payload_kg: -1.0}}}",
            "robots.rrru3.limits.payload_kg: -1.0 is less than the minimum",
        ),
        (
            "robots: {ur10: {limits: {speed: 250.0}}}",
            "robots.ur10.limits: Additional properties are not allowed ('speed' was unexpected); did you mean",
        ),
        (
            "campaigns: {mine: {robot: rrru3, ingest: a.csv, limits: {minutes: 0}}}",
            "campaigns.mine.limits.minutes: 0 is less than or equal to the minimum of 0",
        ),
        ("campaigns: {crooked: {limits: {}}}", "campaigns.crooked.limits: {} should be non-empty"),
        ("campaigns: {mine: {robot: rrru3, virtual: crooked}}", "'trajectories' is a required property"),
        ("campaigns: {mine: {robot: rrru3}}", "a measured one has `ingest: file.csv` instead"),
        ("gap: {zzz: 3}", "; allowed: effects"),
        ("real: {sets: {ur10: {files: /data/*.csv}}}", "real.sets.ur10.files: got '/data/*.csv'; allowed: a path"),
    ],
)
def test_what_is_refused_says_what_is_meant(overlay, message, monkeypatch):
    monkeypatch.chdir(ROOT)
    config = _base()
    update_config(config, yaml.safe_load(overlay))
    with pytest.raises(ConfigError, match=re.escape(message)):
        _asked(config)
