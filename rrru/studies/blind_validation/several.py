"""Robots of files as robots are: errors of all parameters, scatter, noise not as stated, several causes. Lengths mm.

Our own plant simulates them with the effect models of the diagnosis. Their joint axes have the errors of our own
3-RRRU. A full calibration identifies these errors, so they are not causes.
"""

from dataclasses import replace

import numpy as np

from rrru.effects.library import library
from rrru.errors import SimulationError, UnreachableError
from rrru.seeds import stream
from rrru.studies.blind_validation import foreign
from rrru.studies.blind_validation.box import draw_trajectories
from rrru.studies.blind_validation.draw import (
    AXES_SD,
    MANY,
    count_of_causes,
    draw_direction,
    has_outside,
    noise_not_as_stated,
)
from rrru.studies.blind_validation.faults import OUTSIDE_OF_ANY, Fault, kind_of
from rrru.studies.blind_validation.outside import drawn_effects

# a full calibration absorbs these to first order
_CALIBRATED = ("frame_misregistration", "tool_offset")
# draws of strength and ratios before another cause is drawn; allowed relative error of its gap
_TRIES, _MAX_ERROR = 3, 0.1


def draw(member, conditions):
    """The robot of a Member of the check as_robots_are, and its measurements.

    Raises UnreachableError where no draw of causes lets it drive its campaign.
    """
    generator = stream(conditions.seed, "withheld", member.check, conditions.name, member.number)
    robot = bare(member, generator, conditions)
    count, outside = count_of_causes(generator), has_outside(member.number)
    for _ in range(foreign.DRAWS):
        effects = [name for name in drawn_effects(library(conditions.mechanism)) if name not in _CALIBRATED]
        acting = _some(robot, effects, count, generator, conditions)
        acting += _some(robot, OUTSIDE_OF_ANY, int(outside), generator, conditions)
        drawn = replace(robot, acting=acting)
        # several causes together may lose a pose that none of them loses alone
        if len(acting) == count + outside and not np.isnan(foreign.gap_over_noise(drawn, conditions)):
            return drawn, drawn.measured(conditions)
        robot = replace(robot, trajectories=draw_trajectories(generator, conditions))
    raise UnreachableError(f"{robot.name}: {count} causes lose a pose in {foreign.DRAWS} draws")


def bare(member, generator, conditions):
    """The robot without causes: errors of drives and axes, and noise that is not as stated."""
    numbers = conditions.mechanism.candidates
    drives = len(conditions.mechanism.parts.units)
    size = [(foreign.OFFSET_SD if k < drives else AXES_SD)[number.unit] for k, number in enumerate(numbers)]
    offsets = (size * generator.standard_normal(len(size))).tolist()
    trajectories, noise = draw_trajectories(generator, conditions), noise_not_as_stated(generator)
    return foreign.FileRobot(member.name, member.file, "own", trajectories, tuple(offsets), noise=noise, rests=False)


def _some(robot, names, count, generator, conditions):
    """Up to count causes out of names, without those that a calibration absorbs."""
    found = []
    for name in generator.permutation(names).tolist():
        if len(found) == count:
            break
        fault = _cause(robot, name, generator, conditions)
        if fault is not None:
            found.append(fault)
    return tuple(found)


def _cause(robot, name, generator, conditions):
    """A cause of a strength drawn log-uniform from MANY, or None where no draw has it.

    A cause that a calibration absorbs to first order is dropped: its gap does not double with its size.
    """
    coordinates = kind_of(name).effect_model(conditions.mechanism).coordinates
    for _ in range(_TRIES):
        strength = float(np.exp(generator.uniform(*np.log(MANY))))
        one = draw_direction(name, coordinates, False, strength, generator)
        try:
            fault = foreign.sized(robot, Fault(name, one.coordinates, one.shape), strength, conditions)
        except (SimulationError, UnreachableError):
            continue
        alone, half = (
            foreign.gap_over_noise(replace(robot, acting=(fault.scaled(factor),)), conditions) for factor in (1.0, 0.5)
        )
        if max(abs(alone - strength), abs(2.0 * half - strength)) < _MAX_ERROR * strength:
            return replace(fault, strength=alone)
    return None
