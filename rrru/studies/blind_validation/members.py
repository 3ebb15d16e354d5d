"""The robots of the check: 3-RRRUs on our own plant, and robots of files on the plant that they name."""

import json
from typing import NamedTuple

from rrru.studies.blind_validation import draw, foreign, robots, several
from rrru.studies.blind_validation.outside import EFFECTS
from rrru.studies.blind_validation.verdicts import AS_ROBOTS_ARE


class Known(NamedTuple):
    """Conditions of all robots of one file or of our own 3-RRRU, and effects by name of the diagnosis' library."""

    conditions: robots.Conditions
    library: dict = EFFECTS


def all_conditions(settings):
    """Conditions by the entry in `robots:` of a file, and with an empty name that of our own 3-RRRU."""
    files = settings["files"].items()
    own = robots.Conditions.from_config(settings)
    return {"": own} | {name: foreign.FileConditions.from_parts(parts, settings) for name, parts in files}


def drawn(member, conditions):
    """The robot of a Member under its Conditions, and what the diagnosis is given: its measurement table."""
    if member.file and member.check == AS_ROBOTS_ARE:
        return several.draw(member, conditions)
    if member.file:
        return foreign.draw(member, conditions)
    robot = draw.draw(member, conditions)
    return robot, robot.measured(conditions)


def robot_of(text):
    """The robot of the column `drawn` of `withheld_answers`."""
    section = json.loads(text)
    return (foreign.FileRobot if "plant" in section else robots.Robot).from_mapping(section)


def fresh_runs(robot, conditions):
    """Noise-free measurements of a robot on new runs, None where nothing acts or a pose is lost."""
    if not robot.causes:
        return None
    if robot.file:
        return foreign.noise_free(foreign.fresh(robot, conditions), conditions)
    return robots.noise_free(draw.fresh(robot, conditions), conditions)
