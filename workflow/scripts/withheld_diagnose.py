"""The diagnosis of a chunk of robots, from their measurements alone."""

import pandas as pd

from rrru.diagnosis.diagnose import MeasuredRobot, diagnose
from rrru.diagnosis.result_tables import parameter_rows
from rrru.diagnosis.settings import GapSettings
from rrru.kinematics.dynamics import Masses
from rrru.pipeline import setup
from rrru.store import tables
from rrru.store.job import run
from rrru.studies.blind_validation.schemas import TABLES
from rrru.studies.blind_validation.stated import VERDICT, fitted, state_row, stated


def main(settings, inputs, outputs):
    """Write verdicts, statements on causes, states and budgets of a chunk."""
    library = GapSettings.from_config(settings["gap"], settings["seed"])
    noise_mm = settings["withheld"]["noise_mm"]
    verdicts, causes, states, budgets = [], [], [], []
    for (name, kind), rows in tables.read(inputs["withheld_measurements"]).groupby(["robot", "kind"], sort=False):
        points = rows.drop(columns=["robot", "kind"]).reset_index(drop=True)
        check, taken_out, file = settings["robots"][name]
        known = library.without(taken_out) if taken_out else library
        conditions = settings["files"].get(file, settings)
        robot = setup.measured_robot(conditions["robot"], points) if file else setup.mechanism(conditions["robot"])
        result = diagnose(
            points, MeasuredRobot(robot, Masses(**conditions["masses"]), noise_mm, name), known, details=False
        )
        verdicts.append({"check": check, "robot": name, "kind": kind} | {key: result.verdict[key] for key in VERDICT})
        causes.append(stated(name, result))
        numbers = fitted(parameter_rows(result.inference))
        fit = result.inference
        states.append(state_row(name, fit.calibrated.deviations, result.state, fit.problem.library, numbers))
        budgets.append(result.tables["gap_budget"].assign(robot=name))
    frames = {
        "withheld_verdicts": pd.DataFrame(verdicts),
        "withheld_stated": pd.concat(causes, ignore_index=True),
        "withheld_states": pd.DataFrame(states),
        "withheld_budget": pd.concat(budgets, ignore_index=True),
    }
    tables.write_all(TABLES, frames, outputs)


if __name__ == "__main__":
    run(main, snakemake)
