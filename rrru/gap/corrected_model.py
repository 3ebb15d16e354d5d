"""The corrected file, read again, along the campaign that it was found on. Lengths in mm, angles in rad."""

from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from rrru.effects.library import active_effects
from rrru.effects.protocol import together
from rrru.errors import ConfigError, SimulationError, UnreachableError
from rrru.gap.shrink import model_row
from rrru.plant.mujoco_robot import MujocoRobot
from rrru.robots.catalogue import make_mechanism
from rrru.robots.file_changes import placement_of
from rrru.robots.legs import TOOL, WORLD


def file_of(section):
    """Key and path of the file of a robot's entry in the configuration, None where it has none that is written back."""
    return next(((key, Path(section[key])) for key in ("mjcf", "urdf") if key in section and "tips" not in section), None)


def gap_rows(attribution, found, section, shrink, path):
    """Rows of `gap_shrink`: of the robot's file as it came, and of the corrected one at a path.

    shrink: the other rows. The corrected file is driven by MuJoCo where it is an MJCF that can be, else closed at the
    drive values that it leads to; so is the file as it came.
    """
    case, (key, given) = attribution.case, file_of(section)
    result = []
    for kind, file in (("given_model", given), ("corrected_model", Path(path))):
        robot = make_mechanism(section_name(case), section | {key: str(file)}, parameter_set="full")
        robot = robot.reading(case.mechanism.reads)
        held = found if kind == "corrected_model" and key == "mjcf" else None
        left = case.by_other(robot, *_posed(case, robot, found, held))
        result.append(model_row(shrink, kind, left, case.noise_mm))
    return pd.DataFrame(result)
