from rrru.studies.methods import parts as method_parts

METHOD_TABLES = ["methods", "method_points"]
METHOD_ROBOTS = list(config["methods"]["regions"])
METHOD_FIGURES = {"methods": ("rrru.studies.methods.figures:methods", METHOD_TABLES)}
FIGURES["method"] = METHOD_FIGURES


# the Delta also has the estimates from its images
rule compare_methods:
    input:
        calibrations=lambda wildcards: table("delta_calibrations") if wildcards.robot == "delta" else [],
        poses=lambda wildcards: table("delta_poses") if wildcards.robot == "delta" else [],
    output:
        **named(METHOD_TABLES, under("methods/{robot}")),
        method_timings=f"{RESULTS}/timings/methods_{{robot}}.parquet",
    log:
        f"{RESULTS}/logs/methods/{{robot}}.log",
    wildcard_constraints:
        robot="|".join(METHOD_ROBOTS),
    params:
        settings=lambda wildcards: method_parts.settings(config, wildcards.robot),
        own_effects=own_effects_digests(),
        code=code("methods"),
    script:
        "../../scripts/methods.py"


use rule gather as gather_methods with:
    input:
        **{name: [under(f"methods/{robot}")(name) for robot in METHOD_ROBOTS] for name in METHOD_TABLES},
    output:
        **named(METHOD_TABLES),
    log:
        f"{RESULTS}/logs/gather_methods.log",


rule methods:
    input:
        named(METHOD_TABLES).values(),
        drawn(METHOD_FIGURES).values(),


TARGETS += rules.methods.input
