"""The job of a rule: `main` of the script that the rule's parameters name."""

from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

from rrru.store.job import run

if __name__ == "__main__":
    spec = spec_from_file_location(snakemake.params.job, Path(snakemake.scriptdir, f"{snakemake.params.job}.py"))
    script = module_from_spec(spec)
    spec.loader.exec_module(script)
    run(script.main, snakemake)
