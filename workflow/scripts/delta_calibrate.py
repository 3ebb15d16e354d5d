"""Every variant of the Delta's zero calibration, applied and measured again."""

from rrru.store import tables
from rrru.store.job import run
from rrru.studies.delta import draws, fits, views
from rrru.studies.delta.centres import pose_errors
from rrru.studies.delta.schemas import TABLES
from rrru.studies.delta.variants import Seen
from rrru.studies.delta.virtual_delta import twin


def main(settings, inputs, outputs):
    """Write calibrations, observability, errors on the plane, those of other draws and robots, and the camera."""
    centres, truth = tables.read(inputs["delta_centres"]), tables.read(inputs["delta_truth"])
    robot, section = twin(settings), settings["delta"]
    noise = draws.centre_noise_px(settings, truth, tables.read(inputs["delta_dots"]))
    errors = draws.drawn_errors(settings, truth, noise, section["spread"]["draws"], "draws")
    calibrations, observability, points = fits.study(robot, Seen.of_tables(centres, truth), section["length_error_mm"])
    frames = {
        "delta_camera": tables.read(inputs["delta_lens"]).assign(true=views.true_camera(settings)),
        "delta_calibrations": calibrations,
        "delta_observability": observability,
        "delta_points": points,
        "delta_draws": fits.other_draws(robot, truth, errors),
        "delta_robots": fits.other_robots(robot, truth, errors, section["spread"]),
        "delta_poses": pose_errors(centres, truth),
    }
    tables.write_all(TABLES, frames, outputs)


if __name__ == "__main__":
    run(main, snakemake)
