PAPER_MODULES = [f"{paper['study']}.{name}" for paper in PAPERS.values() for name in ("published", "audit")]


# the numbers of all papers compared with the studies', and the papers' misprints
rule published:
    input:
        **named(sorted({name for paper in PAPERS.values() for name in paper["tables"]})),
    output:
        **named(["published", "audit"]),
    log:
        f"{RESULTS}/logs/published.log",
    params:
        settings=dict(sorted(PAPERS.items())),
        code=code("published", {module: (module, []) for module in PAPER_MODULES}),
    script:
        "../../scripts/published.py"


TARGETS += named(["published", "audit"]).values()
