from rrru.studies.rrru3 import settings as paper_a_settings

paper_a_settings.check(config)

SWEPT = ["crossover_fraction", "migration_fraction"]
SWEEP_RUNS = ["sweep_runs", "sweep_history", "sweep_parameters"]
SWEEP_TABLES = [*SWEEP_RUNS, "sweep_effect", "sweep_pairs", "sweep_match"]
# operators/parameter/population
SWEEPS = paper_a_settings.sweeps(config["sweep"], SWEPT)
REDRAW_TABLES = ["redraws", "redraw_counts", "redraw_errors", "twin_numbers"]
REPRODUCED = config["reproduce"]["campaign"]
_SWEEP_SHOWN = ["sweep_runs", "sweep_effect", "sweep_pairs", "sweep_match", "calibrations"]
_PAPER_A = "rrru.studies.rrru3.figures"
PAPER_A_FIGURES = {
    "fig06": (f"{_PAPER_A}.sweep:fig06", _SWEEP_SHOWN),
    "fig07": (f"{_PAPER_A}.sweep:fig07", _SWEEP_SHOWN),
    "fig09": (f"{_PAPER_A}.trajectories:fig09", ["measurements", "errors", "redraw_errors"]),
    "fig10": (f"{_PAPER_A}.trajectories:fig10", ["measurements", "errors", "redraw_errors"]),
    "fig11": (f"{_PAPER_A}.trajectories:fig11", ["measurements", "errors", "redraw_errors"]),
    "fig12": (f"{_PAPER_A}.trajectories:fig12", ["measurements", "errors", "redraw_errors"]),
}
TWIN_FIGURES = {"twin_search": (f"{_PAPER_A}.twin:twin_search", ["twin_progress", "twin_restarts"])}
TRADEOFF_FIGURES = {"twin_tradeoff": (f"{_PAPER_A}.twin:twin_tradeoff", ["twin_tradeoff"])}
FIGURES |= {"twin": TWIN_FIGURES, "tradeoff": TRADEOFF_FIGURES}
PAPERS["A"] = {
    "study": "rrru.studies.rrru3",
    "tables": ["errors", "calibrations", "parameters", "genetic", "genetic_parameters", "sweep_runs", "redraw_counts"],
    "settings": {
        "nominal": parts.nominal(config, REPRODUCED),
        "virtual": paper_a_settings.design(parts.virtual(config, REPRODUCED)),
        **reads(
            *(f"genetic.{key}" for key in ("operators", "crossover_fraction", "migration_fraction", "populations")),
            *(f"reproduce.{key}" for key in config["reproduce"] if key not in ("redraws", "ranked", "sets")),
        ),
    },
}


# settings of all jobs that search for the twin
TWIN_PARTS = {
    "nominal": parts.nominal(config, REPRODUCED),
    "virtual": parts.virtual(config, REPRODUCED),
    "workers": 2,
    **reads("twin"),
}


# all values and seeds of one swept setting in one interpretation of the paper
rule sweep:
    input:
        measurements=part("measurements", REPRODUCED),
    output:
        **named(SWEEP_RUNS, under("sweep/{operators}/{parameter}/{population}")),
    log:
        f"{RESULTS}/logs/sweep/{{operators}}/{{parameter}}/{{population}}.log",
    wildcard_constraints:
        operators="|".join(config["sweep"]["readings"]),
        parameter="|".join(SWEPT),
        population="|".join(config["sweep"]["populations"]),
    params:
        settings=lambda wildcards: {
            **wildcards,
            "nominal": parts.nominal(config, REPRODUCED),
            "patterns": parts.sets(config, REPRODUCED)[config["reproduce"]["line_calibration"]],
            "populations": config["sweep"]["populations"][wildcards.population],
            "reading": paper_a_settings.reading(config["sweep"], wildcards.operators),
            **reads("seed", *GENETIC_SETTINGS, "sweep.stall_generations", "calibration.use_near_singularity"),
        },
        code=code("sweep"),
    script:
        "../../scripts/sweep.py"


rule sweep_tables:
    input:
        **{name: [under(f"sweep/{sweep}")(name) for sweep in SWEEPS] for name in SWEEP_RUNS},
    output:
        **named(SWEEP_TABLES),
    log:
        f"{RESULTS}/logs/sweep_tables.log",
    params:
        settings=reads("seed"),
        code=code("sweep_tables"),
    script:
        "../../scripts/sweep_tables.py"


# the reproduced robot for other draws of non-repeatability and noise
rule redraws:
    output:
        **named(REDRAW_TABLES),
    log:
        f"{RESULTS}/logs/redraws.log",
    params:
        settings=redraw_settings("redraws"),
        code=code("redraws"),
    script:
        "../../scripts/redraws.py"


# which of many draws is nearest to what the paper prints: `draw` of the reproduced campaign
rule draw_ranks:
    output:
        **named(["draw_ranks"]),
    log:
        f"{RESULTS}/logs/draw_ranks.log",
    params:
        settings=redraw_settings("ranked"),
        code=code("draw_ranks"),
    script:
        "../../scripts/draw_ranks.py"


# an interrupted search goes on from its state
rule twin_search:
    output:
        **named(["twin_restarts", "twin_progress"]),
        twin=f"{RESULTS}/twin/twin.yaml",
    log:
        f"{RESULTS}/logs/twin.log",
    threads: 2
    params:
        settings={**TWIN_PARTS, "state": f"{RESULTS}/twin/state.json", **reads("reproduce.line_calibration")},
        code=code("twin"),
    script:
        "../../scripts/twin.py"


rule twin_hypotheses:
    output:
        **named(["twin_hypotheses"]),
    log:
        f"{RESULTS}/logs/twin_hypotheses.log",
    threads: 2
    params:
        settings={**TWIN_PARTS, "state": f"{RESULTS}/twin/hypotheses"},
        code=code("twin_hypotheses"),
    script:
        "../../scripts/twin_hypotheses.py"


rule twin_tradeoff:
    output:
        **named(["twin_tradeoff"]),
    log:
        f"{RESULTS}/logs/twin_tradeoff.log",
    threads: 2
    params:
        settings={**TWIN_PARTS, "state": f"{RESULTS}/twin/tradeoff", **reads("reproduce.line_calibration")},
        code=code("twin_tradeoff"),
    script:
        "../../scripts/twin_tradeoff.py"


# the search and its figure; not part of the default run
rule twin:
    input:
        rules.twin_search.output,
        drawn(TWIN_FIGURES).values(),


rule paper_a_figures:
    input:
        **named({*shown(PAPER_A_FIGURES), *shown(CAMPAIGN_FIGURES)} - {"measurements", "workspace"}),
        **named(["measurements", "workspace"], lambda name: part(name, REPRODUCED)),
    output:
        **drawn(PAPER_A_FIGURES | CAMPAIGN_FIGURES),
    log:
        f"{RESULTS}/logs/figures/paper_a.log",
    params:
        settings={"figures": PAPER_A_FIGURES | CAMPAIGN_FIGURES, "options": paper_options()},
        code=code("figure", PAPER_A_FIGURES, CAMPAIGN_FIGURES),
    script:
        "../../scripts/figure.py"


rule campaign_figures:
    input:
        **named(shown(CAMPAIGN_FIGURES), part),
    output:
        **drawn(CAMPAIGN_FIGURES, "figures/{campaign}"),
    log:
        f"{RESULTS}/logs/figures/{{campaign}}.log",
    wildcard_constraints:
        campaign="|".join(CAMPAIGNS),
    params:
        settings=lambda wildcards: {
            "figures": CAMPAIGN_FIGURES,
            "options": parts.figure_options(config, wildcards.campaign),
        },
        code=code("figure", CAMPAIGN_FIGURES),
    script:
        "../../scripts/figure.py"


# the 3-RRRU's
rule figures:
    input:
        drawn(PAPER_A_FIGURES | CAMPAIGN_FIGURES).values(),
        [drawn(CAMPAIGN_FIGURES, f"figures/{name}").values() for name in CAMPAIGNS if name != REPRODUCED],


TARGETS += [*named([*SWEEP_TABLES, *REDRAW_TABLES]).values(), *rules.figures.input]
