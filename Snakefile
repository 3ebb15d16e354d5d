from snakemake.utils import min_version, validate

from rrru.studies.ptt3.experiments import check as check_ptt
from rrru.studies.setup import check

min_version("9.0")


configfile: "config.yaml"


validate(config, "workflow/schemas/config.schema.yaml")
check(config)
check_ptt(config)


include: "workflow/rules/common.smk"
include: "workflow/rules/campaign.smk"
include: "workflow/rules/calibrate.smk"
include: "workflow/rules/compensate.smk"
include: "workflow/rules/gap.smk"
include: "workflow/rules/withheld_common.smk"
include: "workflow/rules/withheld.smk"
include: "workflow/rules/report.smk"
include: "workflow/rules/printers.smk"
include: "workflow/rules/ptt.smk"
include: "workflow/rules/delta.smk"
include: "workflow/rules/methods.smk"


rule all:
    default_target: True
    input:
        [table(name) for name in STUDY_TABLES],
        rules.figures.input,
        rules.gap.input,
        rules.printers.input,
        rules.ptt.input,
        rules.delta.input,
        rules.methods.input,
