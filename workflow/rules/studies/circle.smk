# errors of a corrected file on a held-out campaign; without its section there is no target
CHECKS.append("rrru.studies.end_to_end.models:check")
CIRCLE = config.get("circle", {})
CIRCLE_TABLES = ["circle", "circle_points"]
CIRCLE_FIGURES = {"circle": ("rrru.studies.end_to_end.figures:circle", CIRCLE_TABLES)}

if CIRCLE:
    FIGURES["circle"] = CIRCLE_FIGURES
    _DIAGNOSED = CIRCLE["diagnosed"]

    rule try_corrected:
        input:
            **{name: part(name, _DIAGNOSED) for name in ("measurements", "parameters", "gap_verdicts")},
            corrected=f"{RESULTS}/campaigns/{_DIAGNOSED}/corrected.xml",
            fresh=part("measurements", CIRCLE["fresh"]),
            campaigns=part("campaigns", CIRCLE["fresh"]),
        output:
            **named(CIRCLE_TABLES),
        log:
            f"{RESULTS}/logs/circle.log",
        params:
            settings={
                "nominal": parts.nominal(config, _DIAGNOSED),
                "masses": parts.masses(config, config["campaigns"][_DIAGNOSED]),
                **reads("circle"),
            },
            code=code("circle"),
        script:
            "../../scripts/circle.py"

    rule circle:
        input:
            named(CIRCLE_TABLES).values(),
            drawn(CIRCLE_FIGURES).values(),
