"""`make bench`: which groups it runs."""

import subprocess

import pytest

from benchmarks.__main__ import LONG_GROUPS, main


def test_a_long_group_runs_by_its_name_and_leaves_the_page_alone(monkeypatch):
    run, written = [], []
    monkeypatch.setattr(subprocess, "run", lambda command, **_: run.append(command[-1]))
    monkeypatch.setattr("benchmarks.__main__.write_page", written.append)
    for group in LONG_GROUPS:
        main([group])
    assert run == [f"benchmarks.{group}" for group in LONG_GROUPS] and not written


def test_an_unknown_group_is_refused_with_all_that_are_known():
    with pytest.raises(SystemExit, match=r"no group 'coverge'; allowed: objective, .*, coverage, noise_found"):
        main(["coverge"])
