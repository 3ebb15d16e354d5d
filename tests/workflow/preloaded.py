"""Loads what the jobs of most runs need, in the process that they are forked from; see `folder.run_here`."""

from importlib import import_module

from tests import compile_once

compile_once.install()
for _name in (
    "matplotlib.backends.backend_agg",
    "matplotlib.backends.backend_pdf",
    "matplotlib.backends.backend_svg",
    "pyarrow.parquet",
    "rrru.figures.drawing",
    "rrru.pipeline.jobs.calibrate",
    "rrru.pipeline.jobs.compensate",
    "rrru.pipeline.jobs.diagnose",
    "rrru.pipeline.jobs.genetic",
    "rrru.pipeline.jobs.read",
    "snakemake.script",
):
    import_module(_name)
