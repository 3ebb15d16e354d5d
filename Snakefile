from pathlib import Path

from snakemake.utils import min_version

from rrru.pipeline.checks import check_keys, check_once, check_schema, set_defaults
from rrru.pipeline.read_config import SCHEMA

min_version("9.0")
# the last digits of sums depend on how many threads of linear algebra share them: one, whatever `threads` a rule has
shell.prefix("set -euo pipefail; export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1; ")


configfile: "config.yaml"


check_keys(workflow.configfiles)
check_schema(config, SCHEMA)
set_defaults(config, SCHEMA)


include: "workflow/rules/pipeline/common.smk"
include: "workflow/rules/pipeline/campaign.smk"
include: "workflow/rules/pipeline/calibrate.smk"


# a study is its rules here, its folder in rrru/studies and its section of the configuration
for study in sorted(Path(workflow.basedir, "workflow/rules/studies").glob("*.smk")):

    include: study


include: "workflow/rules/pipeline/published.smk"
include: "workflow/rules/pipeline/gap.smk"
include: "workflow/rules/pipeline/figures.smk"
include: "workflow/rules/pipeline/report.smk"


# what is refused is refused before anything runs
check_once(config, CHECKS, own_effects(), ".snakemake/rrru_checked")


rule all:
    default_target: True
    input:
        TARGETS,
