"""Every variant of the Delta's zero calibration, fed back and measured again."""

from rrru.delta_study import fits, robot, spread, views
from rrru.report import tables
from rrru.report.job import job


def main(config, inputs, outputs):
    """Write calibrations, what they see, errors on the plane (of other robots too), and camera and optical centres against the true ones."""
    centres, truth = tables.read(inputs["centres"]), tables.read(inputs["truth"])
    twin = robot.twin(config)
    calibrations, observability, points = fits.study(twin, centres, truth)
    frames = {
        "delta_camera": tables.read(inputs["lens"]).assign(true=views.true_camera(config)),
        "delta_calibrations": calibrations,
        "delta_observability": observability,
        "delta_points": points,
        "delta_robots": spread.other_robots(twin, centres, truth, config["delta"]["spread"]),
        "delta_poses": fits.pose_errors(centres, truth),
    }
    for name, frame in frames.items():
        tables.write(name, frame, outputs[name])


if __name__ == "__main__":
    with job(snakemake.log[0]):
        main(snakemake.config, snakemake.input, snakemake.output)
