"""Search for the Delta's twin: the virtual robot nearest to paper C's numbers."""

from rrru.store import overlay, tables
from rrru.store.job import run
from rrru.studies.delta import draws, robot_search
from rrru.studies.delta.virtual_delta import twin


def main(settings, inputs, outputs):
    """Write the twin's errors as an overlay of the configuration."""
    robot = twin(settings)
    search, truth = settings["delta"]["search"], tables.read(inputs["delta_truth"])
    noise = draws.centre_noise_px(settings, truth, tables.read(inputs["delta_dots"]))
    drawn = draws.drawn_errors(settings, truth, noise, search["draws"], "search")
    best, misfit = robot_search.search(robot, truth, drawn, search)
    errors = {name: round(value, 6) for name, value in robot.truth.parameters.mapping(best).items()}
    overlay.write({"delta": {"errors": errors}}, misfit, outputs["twin"])


if __name__ == "__main__":
    run(main, snakemake)
