from rrru.studies.methods.benches import ROBOTS as METHOD_ROBOTS

METHOD_TABLES = ["methods", "method_points"]


# path of one robot's part of a table of the comparison
METHOD_PART = f"{RESULTS}/methods/{{robot}}/{{name}}.parquet"


# the Delta is also given what its images have shown
rule compare_methods:
    input:
        calibrations=lambda wildcards: table("delta_calibrations") if wildcards.robot == "delta" else [],
    output:
        **{name: METHOD_PART.format(robot="{robot}", name=name) for name in METHOD_TABLES},
        method_timings=f"{RESULTS}/timings/methods_{{robot}}.parquet",
    log:
        f"{RESULTS}/logs/methods/{{robot}}.log",
    wildcard_constraints:
        robot="|".join(METHOD_ROBOTS),
    params:
        settings=settings(
            "seed",
            "robots",
            "motion",
            "trajectories",
            "virtual_robots",
            "campaigns",
            "calibration",
            "genetic",
            "reproduce",
            "loads",
            "ptt",
            "delta",
            "methods",
        ),
        code=script_code("methods"),
    script:
        "../scripts/methods.py"


use rule gather as gather_methods with:
    input:
        **{name: [METHOD_PART.format(robot=robot, name=name) for robot in METHOD_ROBOTS] for name in METHOD_TABLES},
    output:
        **{name: table(name) for name in METHOD_TABLES},
    log:
        f"{RESULTS}/logs/gather_methods.log",


rule methods:
    input:
        [table(name) for name in METHOD_TABLES],
        f"{RESULTS}/figures/methods.png",
