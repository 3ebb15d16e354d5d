"""Virtual six-axis arms at stops in no order, read with orientations: shared by tests of the effects of such campaigns.

Lengths mm, angles rad.
"""

from dataclasses import replace

import numpy as np
import pandas as pd
from scipy.spatial.transform import Rotation

from rrru.campaign import measurements as rows
from rrru.diagnosis.make_problem import make_diagnosis_problem
from rrru.effects.library import find
from rrru.effects.protocol import ActiveEffect, together
from rrru.kinematics.base_parameters import MeasurementConfig
from rrru.kinematics.dynamics import Masses
from rrru.kinematics.readings import orientation
from rrru.robots.from_dh import from_dh

_ROWS = (
    {"d_mm": 400, "alpha_deg": -90, "range_deg": [-150, 150], "mass_kg": 8, "com_mm": [0, 150, 0]},
    {"theta_deg": -90, "a_mm": 450, "range_deg": [-80, 80], "mass_kg": 6, "com_mm": [-220, 0, 0]},
    {"a_mm": 40, "alpha_deg": -90, "range_deg": [-90, 70], "mass_kg": 4, "com_mm": [-20, 0, 0]},
    {"d_mm": 430, "alpha_deg": 90, "range_deg": [-160, 160], "mass_kg": 2.5, "com_mm": [0, -200, 0]},
    {"alpha_deg": -90, "range_deg": [-110, 110], "home_deg": 40, "mass_kg": 1.2},
    {"d_mm": 90, "range_deg": [-170, 170], "mass_kg": 0.8, "com_mm": [20, 0, 40]},
)
ARM = from_dh(_ROWS, name="six_axis", tool_mm=(60.0, 0.0, 90.0))
DRIVES = len(ARM.parts.drives)
MASSES = Masses(0.0, 0.0, 0.0)
NOISE_MM, NOISE_RAD = 0.02, 4e-5
ERRORS = {"dq1": 1e-3, "dq2": -2e-3, "dq3": 1.5e-3, "dq4": 1e-3, "dq5": -1e-3, "dq6": 5e-4}


def drives(count, generator):
    """Drive values (count, 6) in no order, all over their ranges."""
    low, high = ARM.drive_range.T
    return low + (high - low) * generator.random((count, DRIVES))


def commands(drive):
    """The table of stops at drive values (n, 6), nothing measured yet."""
    frame = pd.DataFrame({"run": 1, "trajectory": "poses", "point": np.arange(1, len(drive) + 1)})
    columns = dict(zip(ARM.parts.columns, drive.T, strict=True))
    command = rows.vector_columns("command", ARM.forward(drive))
    nothing = {"time_s": np.nan, "speed_mm_s": np.nan, "payload_kg": np.nan}
    return frame.assign(**command, **columns, **nothing, status="ok")


def active(name, coordinates, shape=None, effect=None):
    """An effect of the arm at its coordinates (c,)."""
    effect = effect or find(name, ARM)
    values = effect.coordinates.to_values(np.asarray(coordinates, dtype=float), shape or effect.coordinates.shapes[0])
    return ActiveEffect(effect, effect.parameters.mapping(values))


def measure(effects=(), count=200, seed=1, noise=(NOISE_MM, NOISE_RAD)):
    """Positions and orientations that the arm with errors and active effects reaches, as a table."""
    generator = np.random.default_rng(seed)
    drive = drives(count, generator)
    frame = commands(drive)
    frame = frame.assign(**rows.vector_columns("measured", rows.command(frame)))
    motion = make_diagnosis_problem(frame, ARM, MASSES, 1.0, {}).motion
    twists = ARM.twists_of(ERRORS) + together(effects, motion).twists
    poses = ARM.solve(drive, rows.command(frame), twists)
    assert poses.closed.all()
    position = ARM.measured(poses, twists) + noise[0] * generator.standard_normal((count, 3))
    off = Rotation.from_rotvec(noise[1] * generator.standard_normal((count, 3))).as_matrix()
    turns = rows.turn_columns("measured", off @ orientation(ARM, poses, twists))
    return frame.assign(**rows.vector_columns("measured", position), **turns)


def problem_of(frame, *names, library=None):
    """The problem of a table, with some effects of the library, at the noise that it has."""
    effects = {name: find(name, ARM) for name in names} | (library or {})
    return make_diagnosis_problem(
        frame, reading(frame), MASSES, NOISE_MM, effects, characteristic_length_mm=NOISE_MM / NOISE_RAD
    )


def reading(frame):
    """The arm with every parameter that a table's readings determine."""
    return replace(ARM, parameter_set="full").with_measurement_config(rows.measurement_config(frame))


def reads_of(sites):
    """What readings of reflectors at some sites leave open."""
    return MeasurementConfig(tuple(sites), tuple(sites))
