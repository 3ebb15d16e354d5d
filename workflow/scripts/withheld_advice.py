"""The advised run of ambiguous robots driven, added and diagnosed, compared with a random run."""

import pandas as pd

from rrru.diagnosis.diagnose import MeasuredRobot
from rrru.diagnosis.settings import GapSettings
from rrru.kinematics.dynamics import Masses
from rrru.pipeline import setup
from rrru.store import tables
from rrru.store.job import run
from rrru.studies.blind_validation.advice import UNSURE, advice_summary, ambiguous, follow
from rrru.studies.blind_validation.robots import Conditions, robot_of
from rrru.studies.blind_validation.schemas import TABLES


def main(settings, inputs, outputs):
    """Write how many ambiguous robots the advice settles; reads only those robots' points from the chunks."""
    verdicts = tables.read(inputs["withheld_verdicts"], columns=UNSURE)
    names, most, followed_robots = ambiguous(verdicts), settings["withheld"]["advice"], 0
    # no robot has the name ""
    chosen = [("robot", "in", names or [""])]
    conditions, library = Conditions.from_config(settings), GapSettings.from_config(settings["gap"], settings["seed"])
    mechanism, masses = setup.mechanism(settings["robot"]), Masses(**settings["masses"])
    answers, result = tables.read(inputs["withheld_answers"], columns=["robot", "drawn"], rows=chosen), []
    drawn = answers.set_index("robot")["drawn"]
    for path in inputs["withheld_measurements"]:
        points = tables.read(path, rows=chosen)
        for name in [name for name in names if name in set(points["robot"])]:
            if followed_robots == most:
                break
            own = points[points["robot"] == name].drop(columns=["robot", "kind"]).reset_index(drop=True)
            known = MeasuredRobot(mechanism, masses, conditions.noise_mm, name)
            rows = follow(robot_of(drawn[name]), own, conditions, known, library)
            followed_robots += bool(rows)
            result.extend(rows)
    columns = next(table.names for table in TABLES if table.name == "withheld_advice")
    followed = pd.DataFrame(result, columns=columns)
    frames = {"withheld_advice": followed, "withheld_advice_summary": advice_summary(followed)}
    tables.write_all(TABLES, frames, outputs)


if __name__ == "__main__":
    run(main, snakemake)
