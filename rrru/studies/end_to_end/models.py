"""A robot's file as given, calibrated and corrected, evaluated on a held-out campaign. Lengths in mm."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from rrru.arrays import FloatArray
from rrru.campaign import measurements as rows
from rrru.diagnosis.correction.corrected_model import simulated
from rrru.diagnosis.make_problem import make_diagnosis_problem
from rrru.diagnosis.shrink import gap_rms
from rrru.effects.protocol import Motion
from rrru.errors import ConfigError
from rrru.formats.mjcf_writer import measured_tool_mm
from rrru.kinematics.dynamics import Masses
from rrru.kinematics.robot import Robot
from rrru.robots.catalogue import make_mechanism


def check(config: Mapping[str, Any]) -> None:
    """Raise ConfigError where `circle` names an unknown campaign, or not the same robot of an MJCF for both."""
    section = config.get("circle")
    if not section:
        return
    for key in ("diagnosed", "fresh"):
        if section[key] not in config["campaigns"]:
            known = ", ".join(config["campaigns"])
            raise ConfigError(f"circle.{key}: campaigns has no {section[key]!r}; known: {known}")
    names = [config["campaigns"][section[key]]["robot"] for key in ("diagnosed", "fresh")]
    if names[0] != names[1] or "mjcf" not in config["robots"][names[0]]:
        raise ConfigError(f"circle: robots {' and '.join(names)}; allowed: one robot with an mjcf")
    if section["calibration"] not in config["calibration"]["sets"]:
        known = ", ".join(config["calibration"]["sets"])
        raise ConfigError(f"circle.calibration: {section['calibration']!r}; known sets: {known}")


def errors(
    fresh: pd.DataFrame,
    nominal: Mapping[str, Any],
    masses: Masses,
    calibrated: tuple[Robot, FloatArray],
    corrected: str | Path,
) -> pd.DataFrame:
    """Frame `circle_points` of a measurement table: errors of each model at every usable point.

    nominal: the robot's part of the configuration, of an MJCF; calibrated: its Robot and deviations; corrected: path of
    the corrected MJCF. Points without a prediction by a model are left out. Raises ConfigError where more than the
    tool's position was measured, SimulationError or UnreachableError where MuJoCo cannot drive a file.
    """
    if rows.readings(fresh) is not None:
        raise ConfigError(f"circle: {nominal['name']}'s fresh campaign has more than positions; allowed: of the tool")
    name, section, (robot, deviations) = nominal["name"], nominal["dimensions"], calibrated
    corrected_section = section | {"mjcf": str(corrected)}
    if (tool_mm := measured_tool_mm(corrected)) is not None:
        corrected_section["tool_mm"] = tool_mm.tolist()
    given, other = (make_mechanism(name, part, parameter_set="frame") for part in (section, corrected_section))
    problem = make_diagnosis_problem(fresh, given, masses, 1.0, {})
    models = {
        "given": _driven(problem.motion, given, section),
        "calibrated": robot.forward(rows.actuators(fresh, robot), deviations, rows.command(fresh)),
        "corrected": _driven(problem.motion, other, corrected_section),
    }
    left = {model: rows.measured(fresh) - position for model, position in models.items()}
    # the direction of approach of a drive is unknown at a run's first point and next to a reversal
    known = ~np.isfinite(problem.motion.approach).any(axis=1)
    used = problem.used & known & np.isfinite(list(left.values())).all(axis=(0, 2))
    named = fresh.loc[used, ["run", "trajectory", "point"]]
    frames = []
    for model, error in left.items():
        columns = rows.vector_columns("error", error[used])
        frames.append(named.assign(model=model, **columns, error_mm=np.linalg.norm(error[used], axis=1)))
    return pd.concat(frames, ignore_index=True)


def sizes(points: pd.DataFrame, effects: str, noise_mm: float) -> pd.DataFrame:
    """Frame `circle` without its campaigns from `circle_points`; effects: found by the diagnosis; noise per axis."""
    result, noise = [], float(np.sqrt(3.0) * noise_mm)
    for model, rows_of_model in points.groupby("model", sort=False):
        squares = rows_of_model["error_mm"] ** 2
        labels = {"model": model, "effects": effects if model == "corrected" else "none", "points": len(squares)}
        lengths = {"rms_mm": float(np.sqrt(squares.mean())), "max_mm": rows_of_model["error_mm"].max()}
        result.append(labels | lengths | {"noise_rms_mm": noise, "gap_rms_mm": gap_rms(squares - noise**2)})
    return pd.DataFrame(result)


def _driven(motion: Motion, robot: Robot, section: Mapping[str, Any]) -> FloatArray:
    """Positions (n, 3) of the tool of a robot's file that MuJoCo simulates along a Motion."""
    poses, twists = simulated(motion, robot, Path(section["mjcf"]), section["platform"])
    return robot.measured(poses, twists)
