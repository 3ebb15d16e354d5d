from rrru.studies.delta import twin as robot

# refuses commands out of reach before anything runs
robot.twin(config)

DELTA_IMAGE_TABLES = ["delta_centres", "delta_dots", "delta_picture"]
DELTA_TABLES = [
    "delta_camera",
    "delta_poses",
    "delta_calibrations",
    "delta_observability",
    "delta_draws",
    "delta_points",
    "delta_robots",
]
DELTA_FIGURES = ["delta_images", "delta_errors", "delta_observability"]
DELTA_SETTINGS = settings("seed", "robots", "delta")
# parts that one step hands to the next
DELTA_PARTS = f"{RESULTS}/delta"


rule delta_images:
    output:
        images=f"{DELTA_PARTS}/images.npz",
        truth=f"{DELTA_PARTS}/truth.parquet",
    log:
        f"{RESULTS}/logs/delta_images.log",
    params:
        settings=DELTA_SETTINGS,
        code=script_code("delta_images"),
    script:
        "../scripts/delta_images.py"


# it sees the images and the commands, never the truth
rule delta_vision:
    input:
        images=f"{DELTA_PARTS}/images.npz",
    output:
        **{name: table(name) for name in DELTA_IMAGE_TABLES},
        delta_lens=f"{DELTA_PARTS}/lens.parquet",
        delta_timings=f"{RESULTS}/timings/delta/steps.parquet",
    log:
        f"{RESULTS}/logs/delta_vision.log",
    params:
        settings=DELTA_SETTINGS,
        code=script_code("delta_vision"),
    script:
        "../scripts/delta_vision.py"


rule delta_calibrate:
    input:
        lens=f"{DELTA_PARTS}/lens.parquet",
        centres=table("delta_centres"),
        dots=table("delta_dots"),
        truth=f"{DELTA_PARTS}/truth.parquet",
    output:
        **{name: table(name) for name in DELTA_TABLES},
    log:
        f"{RESULTS}/logs/delta_calibrate.log",
    params:
        settings=DELTA_SETTINGS,
        code=script_code("delta_calibrate"),
    script:
        "../scripts/delta_calibrate.py"


rule delta_twin:
    input:
        dots=table("delta_dots"),
        truth=f"{DELTA_PARTS}/truth.parquet",
    output:
        f"{RESULTS}/twin/delta.yaml",
    log:
        f"{RESULTS}/logs/delta_twin.log",
    params:
        settings=DELTA_SETTINGS,
        code=script_code("delta_twin"),
    script:
        "../scripts/delta_twin.py"


rule delta:
    input:
        [table(name) for name in (*DELTA_IMAGE_TABLES, *DELTA_TABLES)],
        expand(f"{RESULTS}/figures/{{figure}}.png", figure=DELTA_FIGURES),
