"""What one experiment of paper B teaches, and the robot driven again with it."""

from rrru.ptt_study import bench, methods, results, robot
from rrru.ptt_study.extrapolation import extrapolations
from rrru.report import tables
from rrru.report.job import job


def main(config, experiment, inputs, outputs):
    """Write networks, corrections, errors and benefits, on the curve and away from it."""
    one = robot.experiment(config, experiment)
    widths = bench.widths_mm(tables.read(inputs["backlash"]), one.payload_kg)
    learned = methods.learning(config, one, tables.read(inputs["measurements"]))
    controllers = learned.controllers()
    after = results.driven(config, one, widths, controllers)
    training = results.trainings(learned)
    frames = {
        "ptt_points": results.points(learned, after["rbf_inverse"]),
        "ptt_benefit": results.benefits(learned, after, config["ptt"]["draws"], one.generator("bootstrap")),
        "ptt_training": training,
        "ptt_spread": results.spreads(learned, training),
        "ptt_corrections": results.corrections(learned),
        "ptt_extrapolation": extrapolations(config, one, widths, controllers),
    }
    for name, frame in frames.items():
        tables.write(name, frame.assign(experiment=experiment), outputs[name])


if __name__ == "__main__":
    with job(snakemake.log[0]):
        main(snakemake.config, snakemake.wildcards.experiment, snakemake.input, snakemake.output)
