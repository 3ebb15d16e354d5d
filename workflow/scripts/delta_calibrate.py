"""Every variant of the Delta's zero calibration, fed back and measured again."""

from rrru.store import tables
from rrru.store.job import job
from rrru.studies.delta import draws, fits, spread, views
from rrru.studies.delta import twin as robot


def main(config, inputs, outputs):
    """Write calibrations, what they see, errors on the plane, of other draws and robots too, and the camera against the
    true one.
    """
    centres, truth = tables.read(inputs["centres"]), tables.read(inputs["truth"])
    twin, section = robot.twin(config), config["delta"]
    noise = draws.centre_noise_px(config, truth, tables.read(inputs["dots"]))
    errors = draws.drawn_errors(config, truth, noise, section["spread"]["draws"], "draws")
    calibrations, observability, points = fits.study(twin, centres, truth, section["length_error_mm"])
    frames = {
        "delta_camera": tables.read(inputs["lens"]).assign(true=views.true_camera(config)),
        "delta_calibrations": calibrations,
        "delta_observability": observability,
        "delta_points": points,
        "delta_draws": spread.other_draws(twin, truth, errors),
        "delta_robots": spread.other_robots(twin, truth, errors, section["spread"]),
        "delta_poses": fits.pose_errors(centres, truth),
    }
    for name, frame in frames.items():
        tables.write(name, frame, outputs[name])


if __name__ == "__main__":
    with job(snakemake.log[0]):
        main(snakemake.config, snakemake.input, snakemake.output)
