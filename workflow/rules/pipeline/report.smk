# the whole study on one page
rule report:
    input:
        TARGETS,
    output:
        report=f"{RESULTS}/report.html",
    log:
        f"{RESULTS}/logs/report.log",
    params:
        settings={"results": RESULTS, "reproduced": REPRODUCED},
        optional=optional_digests,
        templates=template_digests(),
        code=code("report"),
    script:
        "../../scripts/report.py"


# the page of one campaign, which needs its own jobs only
use rule report as campaign_report with:
    input:
        campaign_page,
    output:
        report=f"{RESULTS}/campaigns/{{campaign}}/report.html",
    log:
        f"{RESULTS}/logs/report/{{campaign}}.log",
    params:
        settings=lambda wildcards: {
            "results": RESULTS,
            "reproduced": REPRODUCED,
            "campaign": wildcards.campaign,
        },
        templates=template_digests(),
        code=code("report"),
