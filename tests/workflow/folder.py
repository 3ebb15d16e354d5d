"""A folder of its own to run snakemake in, which sees the project's files through links."""

import contextlib
import copy
import gc
import hashlib
import io
import multiprocessing
import os
import runpy
import subprocess
import sys
import warnings
from functools import cache
from pathlib import Path
from unittest import mock

import yaml

from tests.places import ROOT

# a process of one thread that has loaded what jobs need, and forks one for each job: that takes a tenth of a new one
_FORKS = multiprocessing.get_context("forkserver")
_FORKS.set_forkserver_preload(["tests.workflow.preloaded"])
SNAKEMAKE = str(Path(sys.executable).parent / "snakemake")
MINIMAL = "tests/minimal.yaml"


def link(folder):
    """Link what a run needs into a folder, once."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in ("Snakefile", "config.yaml", "profiles", "workflow", "data", "examples", "tests"):
        place = folder / name
        if not place.exists():
            place.symlink_to(ROOT / name)


def start(folder, *targets, overlays=(MINIMAL,), cores=2, record=None):
    """A running snakemake in a folder; record: a folder for what its scripts read."""
    link(folder)
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    if record:
        environment |= {
            "PYTHONPATH": f"{ROOT / 'tests/workflow/recorder'}{os.pathsep}{ROOT}",
            "RRRU_RECORD": str(record),
            # of a user who knows nothing of this
            **dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "8"),
        }
    command = [SNAKEMAKE, "--cores", str(cores), *targets, *(["--configfile", *overlays] if overlays else [])]
    return subprocess.Popen(
        command,
        cwd=folder,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )


def run(folder, *targets, **options):
    """Exit code and output of snakemake in a folder, see `start`."""
    process = start(folder, *targets, **options)
    output, _ = process.communicate(timeout=3600)
    return process.returncode, output


def dry_run(folder, *targets, overlays=()):
    """Exit code and output of a dry run within this process, which costs a tenth of a process of its own."""
    return run_here(folder, "-n", *targets, overlays=overlays, cores=1)


@contextlib.contextmanager
def _forgotten(folder):
    """Afterwards the user's modules of a folder are not loaded: the next folder may have others of the same names."""
    places = list(sys.path)
    try:
        yield
    finally:
        sys.path[:] = places
        for name, module in list(sys.modules.items()):
            if str(getattr(module, "__file__", "")).startswith(f"{folder}{os.sep}"):
                del sys.modules[name]


def _script(file, environment):
    """Run a job's script with an environment in place of that of the process."""
    os.environ.clear()
    os.environ.update(environment)
    sys.path.insert(0, str(Path(file).parent))
    sys.argv = [file]
    runpy.run_path(file, run_name="__main__")


def _forked(_job, command, fname, **_options):
    """In place of the shell that snakemake starts a script in."""
    process = _FORKS.Process(target=_script, args=(fname, dict(os.environ)))
    process.start()
    process.join()
    if process.exitcode:
        raise subprocess.CalledProcessError(process.exitcode, command)


# the project's configuration, which every run reads, takes a third of the time of a dry run
_parse_yaml = yaml.load


@cache
def _parsed(text, loader):
    """What PyYAML makes of a text."""
    return _parse_yaml(text, Loader=loader)


def _load_yaml(stream, Loader):
    """In place of `yaml.load`: a text is parsed once in a process."""
    return copy.deepcopy(_parsed(stream if isinstance(stream, str) else stream.read(), Loader))


@cache
def _freeze():
    """What is there before the first run is no garbage of one, and is not looked at again by the collector."""
    gc.collect()
    gc.freeze()


def run_here(folder, *targets, overlays=(), cores=2):
    """Exit code and output of snakemake within this process: without what its jobs print, with logs of failed ones.

    Jobs are forked from a process that has loaded most of what they need. Those of `run` begin as a user's do.
    """
    from snakemake.cli import main
    from snakemake.script import PythonScript

    link(folder)
    output = io.StringIO()
    chosen = ["--configfile", *overlays] if overlays else []
    code = 0
    with contextlib.ExitStack() as stack:
        # snakemake leaves the removal of its temporary folder to the garbage collector
        stack.enter_context(warnings.catch_warnings())
        warnings.simplefilter("ignore", ResourceWarning)
        stack.enter_context(contextlib.chdir(folder))
        stack.enter_context(_forgotten(folder))
        stack.enter_context(contextlib.redirect_stdout(output))
        stack.enter_context(contextlib.redirect_stderr(output))
        # of the jobs, whose folder is another one
        stack.enter_context(mock.patch.dict(os.environ, {"PYTHONPATH": str(ROOT)}))
        stack.enter_context(mock.patch.object(PythonScript, "_execute_cmd", _forked))
        stack.enter_context(mock.patch.object(yaml, "load", _load_yaml))
        _freeze()
        try:
            main(["--cores", str(cores), *targets, *chosen])
        except SystemExit as stopped:
            code = stopped.code
        gc.collect()
    return code, output.getvalue()


def digests(folder):
    """Digest of every result file of a folder that has to be the same in every run."""
    files = [p for p in sorted(folder.rglob("*")) if p.is_file() and p.relative_to(folder).parts[0] not in _VARYING]
    return {str(p.relative_to(folder)): hashlib.sha256(p.read_bytes()).hexdigest() for p in files}


_VARYING = ("timings", "logs")
