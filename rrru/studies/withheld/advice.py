"""Whether advice settles what is ambiguous: the advised run driven, added and diagnosed, beside a run drawn at random.

The advice sees measurements alone; the robot that drives it is the one that made them. Lengths mm, times s.
"""

from dataclasses import replace

import numpy as np
import pandas as pd

from rrru.campaign import measurements as rows
from rrru.campaign.plan import Plan, make_plan
from rrru.campaign.trajectories import Line, from_config
from rrru.gap.advise import candidates
from rrru.gap.diagnose import MeasuredRobot, diagnose
from rrru.gap.poses import LENGTH_MM, POINTS
from rrru.seeds import stream
from rrru.studies.withheld.noise import NoiseLaw, with_noise
from rrru.studies.withheld.summary import wilson
from rrru.studies.withheld.verdicts import is_right

# as sure as this, and right, an answer is settled
SURE = 0.9
_GROUPS = {
    "all": "",
    "a run is advised": "kind == 'run'",
    "poses are advised": "kind == 'poses'",
    "nothing is advised": "kind == 'nothing'",
}


def ambiguous(verdicts, most):
    """Names of up to so many robots, in order, whose cause is hidden and whose verdict is unsure beside named rivals.

    verdicts: rows of `withheld_verdicts`.
    """
    rivals = (verdicts["next_runs"] != "") | (verdicts["confusable_with"] != "")
    return verdicts.loc[(verdicts["check"] == "label") & (verdicts["probability"] < SURE) & rivals, "robot"][:most]


def follow(robot, measurements, conditions, known, library):
    """Row of `withheld_advice` of one Robot.

    measurements: its table; known: its MeasuredRobot; library: GapSettings of the diagnosis.
    """
    before = diagnose(measurements, known, library, details=False)
    advised, poses = (before.tables[name] for name in ("gap_next_runs", "gap_next_poses"))
    first = advised.iloc[0].to_dict() if len(advised) else None
    drawn = random_run(measurements, first, stream(conditions.seed, "withheld", "advice", "random", robot.name))
    row = {
        "robot": robot.name,
        "truth": robot.truth,
        "kind": first["kind"] if first else "nothing",
        **_told("before", before.verdict, robot),
        "gain_nats": first["gain_nats"] if first else np.nan,
    }
    for name, run in (("advised", first), ("random", drawn)):
        after = before
        if run is not None:
            extra = drive(robot, run, poses, conditions, name)
            longer = pd.concat([measurements, extra], ignore_index=True)
            after = diagnose(longer, known, library, details=False)
        row |= {f"{name}_run": run["run"] if run else "", **_told(name, after.verdict, robot)}
        row[f"settled_{name}"] = row[f"right_{name}"] and row[f"probability_{name}"] >= SURE
    return row


def _told(when, verdict, robot):
    """Verdict, its probability and whether it is right, as columns of a time."""
    return {
        f"verdict_{when}": verdict["effects"],
        f"probability_{when}": verdict["probability"],
        f"right_{when}": is_right(robot.truth, verdict["effects"], "label"),
    }


def random_run(measurements, advised, generator):
    """One of the runs that the advice chose from, of as many points as the advised one or as near to that as any."""
    choice, _ = candidates(measurements)
    off = [abs(run["points"] - advised["points"]) if advised else 0 for run in choice]
    return generator.choice([run for run, points in zip(choice, off, strict=True) if points == min(off)])


def drive(robot, run, poses, conditions, label):
    """Measurements of a run of `gap_next_runs`, driven by a Robot after its campaign; label: of the noise's stream.

    poses: rows of `gap_next_poses`, which a run of poses goes through.
    """
    campaign = robot.campaign(conditions)
    done = campaign.plan
    plan = Plan((*done.runs, *_runs(robot, run, poses, conditions)), done.dwell_s)
    table, _ = replace(campaign, plan=plan, noise_mm=0.0).run()
    extra = table[table["run"] > len(done.runs)].reset_index(drop=True)
    generator = stream(conditions.seed, "withheld", "advice", label, robot.name)
    law = NoiseLaw(**robot.noise)
    return with_noise(extra.assign(run=extra["run"] - len(done.runs)), law, conditions.noise_mm, generator).assign(
        run=extra["run"]
    )


def _runs(robot, run, poses, conditions):
    """Runs of a plan: the profile of the campaign, faster in proportion, or a pass for each pose."""
    entry = {key: run[key] for key in ("reverse", "speed_mm_s", "payload_kg")}
    if run["kind"] == "poses":
        ends = zip(rows.vectors(poses, "from").tolist(), rows.vectors(poses, "to").tolist(), strict=True)
        lines = [Line(f"pose_{k}", *pair, POINTS) for k, pair in enumerate(ends, start=1)]
        entry["acceleration_mm_s2"] = run["speed_mm_s"] ** 2 / LENGTH_MM
        return make_plan(lines, [entry], **conditions.motion).runs
    faster = run["speed_mm_s"] / conditions.motion["speed_mm_s"]
    entry |= {"trajectories": [run["trajectory"]]}
    entry["acceleration_mm_s2"] = conditions.motion["acceleration_mm_s2"] * faster**2
    return make_plan(from_config(robot.trajectories), [entry], **conditions.motion).runs


def advice_summary(followed):
    """Frame `withheld_advice_summary` from `withheld_advice`."""
    result = []
    for group, which in _GROUPS.items():
        robots = followed.query(which) if which else followed
        for run in ("advised", "random"):
            settled, count = int(robots[f"settled_{run}"].sum()), len(robots)
            low, high = wilson(settled, count)
            value = settled / count if count else np.nan
            row = {"group": group, "run": run, "robots": count, "settled": settled, "value": value}
            result.append(row | {"low": low, "high": high})
    return pd.DataFrame(result)
