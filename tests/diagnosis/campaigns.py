"""Virtual campaigns small enough to be diagnosed in a second or two: what the tests of the gap share. Lengths mm,
angles rad.
"""

from functools import cache

import numpy as np

from rrru.calibration.calibrate import calibrate
from rrru.campaign import measurements as rows
from rrru.campaign.plan import make_plan
from rrru.campaign.trajectories import Line, Spiral
from rrru.diagnosis.diagnose import MeasuredRobot, diagnose, with_wide_bounds
from rrru.diagnosis.make_problem import make_diagnosis_problem
from rrru.diagnosis.settings import GapSettings
from rrru.effects.protocol import ActiveEffect
from rrru.estimation.observations.target_positions import TargetPositions
from rrru.kinematics.dynamics import Masses
from rrru.robots.rrru3 import Rrru3
from rrru.simulation.virtual_robot import VirtualRobot

ROBOT = Rrru3()
MODEL = with_wide_bounds(ROBOT)
MASSES = Masses()
# effects of many waves, and growth of single links, which holds that of all, have tests of their own, and these
# campaigns do not show the others: their robot does not stop, has no thermometer, and all its lengths are calibrated
_ELSEWHERE = (
    "drive_error_function",
    "transmission_orders",
    "link_growth",
    "read_before_rest",
    "thermal_expansion",
    "tracker_scale",
)
EFFECTS = {name: effect for name, effect in GapSettings().library(ROBOT).items() if name not in _ELSEWHERE}
NOISE_MM = 0.02
NOISE_RMS_MM = NOISE_MM * np.sqrt(3.0)
ERRORS = {"dtheta1": 2e-3, "dtheta2": -1e-3, "dtheta3": 1.5e-3, "dL1": 0.4, "dL2": -0.3, "dL3": 0.5, "dr": 0.2}

LINES = tuple(
    Line(f"line_{k}", (-600.0, y, 650.0), (0.0, y, 650.0), 16) for k, y in enumerate((0.0, 110.0, -110.0), start=1)
)
SPIRAL = Spiral("spiral", (0.0, 0.0), (50.0, 280.0), (560.0, 760.0), 4.5, 30)
TRAJECTORIES = (*LINES, SPIRAL)
FORWARD = {"reverse": False, "payload_kg": 0.0}
REVERSE = FORWARD | {"reverse": True}
FAST = FORWARD | {"speed_mm_s": 300.0, "acceleration_mm_s2": 400.0}
LOADED = FORWARD | {"payload_kg": 5.0}
FULL = (FORWARD, REVERSE, FAST, LOADED)


def plan_of(passes=FULL, trajectories=TRAJECTORIES):
    """Plan at 80 mm/s and 40 mm/s^2 with a minute of rest between the runs."""
    return make_plan(trajectories, passes, 80.0, 40.0, 60.0)


def robot_of(effects=(), deviations=None):
    """The virtual robot with errors and active effects."""
    return VirtualRobot(deviations=ERRORS if deviations is None else deviations, effects=tuple(effects))


def active(name, coordinates, shape=0):
    """An effect of the library at its coordinates (c,)."""
    effect = EFFECTS[name]
    values = effect.coordinates.to_values(np.asarray(coordinates, dtype=float), effect.coordinates.shapes[shape])
    return ActiveEffect(effect, effect.parameters.mapping(values))


def measure(effects=(), noise_mm=NOISE_MM, seed=1, plan=None, deviations=None):
    """Measurements of a virtual robot as a frame; every point must have been reached."""
    measurements, _ = robot_of(effects, deviations).run(plan or plan_of(), noise_mm, np.random.default_rng(seed))
    assert (measurements["status"] == "ok").all()
    return measurements


def gap_mm(effects, plan=None):
    """Rms distance that a calibration leaves without noise."""
    frame = measure(effects, 0.0, plan=plan)
    return calibrate(
        TargetPositions(MODEL, rows.actuators(frame, MODEL), rows.measured(frame), rows.command(frame))
    ).rms_mm


def drawn(name, seed, leg=0):
    """Coordinates (c,) of an effect of typical size, drawn; on one leg where one is given."""
    coordinates, generator = EFFECTS[name].coordinates, np.random.default_rng(seed)
    size = generator.uniform(0.5, 1.5, len(coordinates)) * coordinates.typical
    sign = np.where(coordinates.positive, 1.0, generator.choice([-1.0, 1.0], len(coordinates)))
    return size * sign * (1.0 if leg == 0 else coordinates.legs == leg)


@cache
def strong(name, strength, seed=0, leg=0, shape=0):
    """An effect scaled so that the gap after the calibration is `strength` times the noise, rms distance over rms
    distance.
    """
    coordinates = drawn(name, seed, leg)
    for _ in range(3):
        coordinates = coordinates * strength * NOISE_RMS_MM / gap_mm((active(name, coordinates, shape),))
    return active(name, coordinates, shape)


def problem_of(measurements, library=EFFECTS, noise_mm=NOISE_MM):
    """The diagnosis' problem of a measurement table."""
    return make_diagnosis_problem(measurements, MODEL, MASSES, noise_mm, dict(library))


def diagnosed(measurements, noise_mm=NOISE_MM, details=False, settings=None):
    """Diagnosis of a measurement table with all effects that these campaigns show."""
    robot = MeasuredRobot(ROBOT, MASSES, noise_mm)
    return diagnose(measurements, robot, settings or GapSettings(tuple(EFFECTS), draws=50), details)
