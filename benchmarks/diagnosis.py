"""Diagnoses: seconds and memory by the number of points, and for many campaigns in sequence.

Points: the same drawn robots of the withheld check on its short campaign (222 points), on its full one (732) and on the
full one with more points per path (5,008), each size in a separate process. Campaigns: ten small ones repeatedly in one
process.
"""

import json
import subprocess
import sys
from dataclasses import replace
from time import process_time

import numpy as np
import yaml

from benchmarks import harness
from benchmarks.harness import RESULTS, Task
from rrru.diagnosis.diagnose import MeasuredRobot, diagnose
from rrru.diagnosis.settings import GapSettings
from rrru.pipeline import config as parts
from rrru.studies.blind_validation.chunks import Member
from rrru.studies.blind_validation.draw import draw
from rrru.studies.blind_validation.robots import Conditions

# kind of campaign, points of a line and of the spiral
SIZES = {222: ("paper", 26, 40), 732: ("full", 26, 40), 5008: ("full", 178, 273)}
_ROBOTS, _CAMPAIGNS, _GROUP = (1, 2, 4, 5, 6), (10, 100, 1000, 10000), 10
# the many campaigns have few points and one cause; ten thousand take an hour and a half
_SHORT, _FEW = ("line_1", "spiral"), ("backlash",)
_BY_POINTS = "ratio: seconds per point over those of the same robot at 222 points"
_BY_CAMPAIGNS = "ratio: seconds per campaign over those of the first ten; 66 points, one cause"


def known():
    """Conditions of the withheld check, and settings of the diagnosis, as configured."""
    config = yaml.safe_load((RESULTS.parent / "config.yaml").read_text())
    section = {"robot": {"name": "rrru3", "dimensions": config["robots"]["rrru3"]}, "masses": parts.masses(config, {})}
    keys = ("seed", "motion", "withheld")
    settings = GapSettings.from_config(config["gap"], config["seed"])
    return Conditions.from_config(section | {key: config[key] for key in keys}), settings


def measured(number, conditions, size=None):
    """Measurements of a robot of the check, on its own campaign or on one of a size."""
    robot = draw(Member("label", "", number), conditions)
    if size:
        kind, line, spiral = SIZES[size]
        paths = robot.trajectories
        paths = paths | {"lines": paths["lines"] | {"points": line}, "spiral": paths["spiral"] | {"points": spiral}}
        robot = replace(robot, kind=kind, trajectories=paths)
    return robot.measured(conditions)


def spent(measurements, conditions, settings):
    """Seconds of a diagnosis."""
    robot = MeasuredRobot(conditions.mechanism, conditions.masses, conditions.noise_mm)
    start = process_time()
    diagnose(measurements, robot, settings)
    return process_time() - start


def of_size(size):
    """Seconds of all robots at a size and the process' memory."""
    conditions, settings = known()
    spent(measured(0, conditions, 222), conditions, settings)
    seconds = []
    for number in _ROBOTS:
        measurements = measured(number, conditions, size)
        assert len(measurements) == size
        seconds.append(spent(measurements, conditions, settings))
    return {"seconds": seconds, "memory_mib": harness.peak_mib()}


def of_many(count):
    """Mean seconds of every ten of `count` short campaigns (the same ten repeatedly), and memory after each ten."""
    conditions, settings = known()
    settings, tables = replace(settings, effects=_FEW), []
    for number in range(_GROUP):
        table = measured(number, conditions, 222)
        tables.append(table[table["trajectory"].isin(_SHORT)].reset_index(drop=True))
    seconds, memory = [], []
    for _ in range(count // _GROUP + 1):
        seconds.append(float(np.mean([spent(table, conditions, settings) for table in tables])))
        memory.append(harness.peak_mib())
    # the first ten include loading of compiled code
    return {"seconds": seconds[1:], "memory_mib": memory[1:]}


def in_process(what, size):
    """The result of one of the two functions above in a separate process."""
    command = [sys.executable, "-m", "benchmarks.diagnosis", what, str(size)]
    finished = subprocess.run(command, cwd=RESULTS.parent, check=True, capture_output=True, text=True)
    return json.loads(finished.stdout.splitlines()[-1])


def rows():
    """Rows of the group."""
    result, first = [], None
    for size in SIZES:
        found = in_process("size", size)
        each = np.array(found["seconds"]) / size
        first = each if first is None else first
        task, median = Task("diagnosis", "diagnosis by points", size), float(np.median(found["seconds"]))
        result.append(task.row(harness.OURS, median, each / first, memory_mib=found["memory_mib"], note=_BY_POINTS))
    found = in_process("many", max(_CAMPAIGNS))
    for count in _CAMPAIGNS:
        # the second half of the campaigns so far
        groups = count // _GROUP
        seconds = np.array(found["seconds"][groups // 2 : groups])
        task, memory = Task("diagnosis", "diagnosis by campaigns", count), found["memory_mib"][groups - 1]
        ratios = seconds / found["seconds"][0]
        result.append(task.row(harness.OURS, np.median(seconds), ratios, memory_mib=memory, note=_BY_CAMPAIGNS))
    return result


if __name__ == "__main__":
    if len(sys.argv) == 3:
        print(json.dumps({"size": of_size, "many": of_many}[sys.argv[1]](int(sys.argv[2]))))
    else:
        harness.store("diagnosis", rows())
