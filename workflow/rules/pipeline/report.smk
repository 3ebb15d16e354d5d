import rrru.report

# studies that are no part of the default run: what lies there of them is shown, nothing of it is made again for a page
OPTIONAL = ["withheld_summary", "withheld_advice_summary", "real_verdicts", "real_steps", "real_budget"]


def templates():
    """Digests of the page's templates, by name."""
    files = sorted(Path(rrru.report.__file__).parent.glob("templates/*"))
    return {file.name: hashlib.sha256(file.read_bytes()).hexdigest() for file in files}


def optional(_):
    """Digests of the optional studies' tables that are there."""
    files = [Path(table(name)) for name in OPTIONAL]
    return {file.stem: hashlib.sha256(file.read_bytes()).hexdigest() for file in files if file.is_file()}


def shown_of(wildcards):
    """All that the page of one campaign shows."""
    name = wildcards.campaign
    calibrated = name in CAMPAIGNS
    tables = [*GAP_TABLES, *(CAMPAIGN_TABLES if calibrated else [])]
    own = drawn(CAMPAIGN_FIGURES, "figures" if name == REPRODUCED else f"figures/{name}") if calibrated else {}
    drawings = (own | drawn(GAP_FIGURES, f"figures/{name}")).values()
    return [verdict(name), *(part(one, name) for one in tables), *drawings]


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
        optional=optional,
        templates=templates(),
        code=code("report"),
    script:
        "../../scripts/report.py"


# one campaign on a page, which takes its own jobs only
use rule report as campaign_report with:
    input:
        shown_of,
    output:
        report=f"{RESULTS}/campaigns/{{campaign}}/report.html",
    log:
        f"{RESULTS}/logs/report/{{campaign}}.log",
    wildcard_constraints:
        campaign="|".join(DIAGNOSED),
    params:
        settings=lambda wildcards: {
            "results": RESULTS,
            "reproduced": REPRODUCED,
            "campaign": wildcards.campaign,
        },
        templates=templates(),
        code=code("report"),
