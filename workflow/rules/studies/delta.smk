CHECKS.append("rrru.studies.delta.virtual_delta:twin")

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
_DELTA = "rrru.studies.delta.figures"
DELTA_FIGURES = {
    "delta_images": (f"{_DELTA}:delta_images", ["delta_picture", "delta_dots", "delta_poses", "delta_centres"]),
    "delta_errors": (f"{_DELTA}:delta_errors", ["delta_points", "delta_calibrations", "delta_draws"]),
    "delta_observability": (f"{_DELTA}:delta_observability", ["delta_observability"]),
}
FIGURES["delta"] = DELTA_FIGURES
PAPERS["C"] = {
    "study": "rrru.studies.delta",
    "tables": ["delta_points", "delta_camera", "delta_draws"],
    "settings": parts.part(
        config["delta"],
        *("camera.pixel_mm", "plane.z_mm", "poses.counts", "poses.z_mm"),
        *(f"target.{key}" for key in ("columns", "rows", "diameter_mm", "pitch_mm")),
    ),
}
# the robot and its commands; targets and camera
_ROBOT = ["seed", "robots.delta", *(f"delta.{key}" for key in ("errors", "plane", "poses", "tracker_noise_mm"))]
_SCENE = [*_ROBOT, *(f"delta.{key}" for key in ("camera", "distance_mm", "mount", "target", "tilted_views"))]


rule delta_images:
    output:
        images=f"{RESULTS}/delta/images.npz",
        delta_truth=under("delta")("truth"),
    log:
        f"{RESULTS}/logs/delta_images.log",
    params:
        settings=reads(*_SCENE),
        code=code("delta_images"),
    script:
        "../../scripts/delta_images.py"


# it reads the images and the commands, never the truth
rule delta_vision:
    input:
        images=f"{RESULTS}/delta/images.npz",
    output:
        **named(DELTA_IMAGE_TABLES),
        delta_lens=under("delta")("lens"),
        delta_timings=f"{RESULTS}/timings/delta/steps.parquet",
    log:
        f"{RESULTS}/logs/delta_vision.log",
    params:
        settings=reads(*_ROBOT, "delta.target.diameter_mm", "delta.target.pitch_mm"),
        code=code("delta_vision"),
    script:
        "../../scripts/delta_vision.py"


rule delta_calibrate:
    input:
        **named(["delta_centres", "delta_dots"]),
        delta_lens=under("delta")("lens"),
        delta_truth=under("delta")("truth"),
    output:
        **named(DELTA_TABLES),
    log:
        f"{RESULTS}/logs/delta_calibrate.log",
    params:
        settings=reads(*_SCENE, "delta.spread", "delta.length_error_mm"),
        code=code("delta_calibrate"),
    script:
        "../../scripts/delta_calibrate.py"


rule delta:
    input:
        named([*DELTA_IMAGE_TABLES, *DELTA_TABLES]).values(),
        drawn(DELTA_FIGURES).values(),


TARGETS += rules.delta.input
