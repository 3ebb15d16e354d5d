"""Wrong microsteps: the readings of a file have steps of another length than the file now states.

With the correct steps the residuals of the saved numbers are those of noise and small changes, with others they are
centimetres. The noise is unknown, so that the likelihood ratio of two lengths is (rms_1 / rms_2) ^ readings. A zero
offset of the heights (a Z offset that was applied since) counts as the error of one reading, not of all. Steps count as
changed where the likelihood ratio exceeds the number of tested changes over the level (Bonferroni).
"""

from dataclasses import replace

import numpy as np

_FACTORS = (0.0625, 0.125, 0.25, 0.5, 2.0, 4.0, 8.0, 16.0)
# steps of all towers, or of one
_CHANGES = np.array(
    [[factor] * 3 for factor in _FACTORS]
    + [np.where(np.arange(3) == tower, factor, 1.0) for factor in _FACTORS for tower in range(3)]
)


def with_steps(printer, factors):
    """The printer with carriage displacements in steps that are factors (3,) times as long."""
    ways = printer.height_drop_mm * factors, printer.distance_drop_mm * factors
    return replace(printer, height_drop_mm=ways[0], distance_drop_mm=ways[1], step_mm=printer.step_mm * factors)


def changed_steps(printer, level):
    """Factors (3,) of the step lengths with which the readings belong to the saved numbers; ones where unchanged."""
    stated = _left(printer)
    left = [_left(with_steps(printer, factors)) for factors in _CHANGES]
    best, readings = int(np.argmin(left)), len(printer.height_mm) + len(printer.distance_mm)
    needed = (len(_CHANGES) / level) ** (1.0 / readings)
    return _CHANGES[best] if stated > needed * left[best] else np.ones(3)


def describe(factors):
    """The sentence on factors (3,) of the step lengths; empty for ones."""
    changed = np.flatnonzero(factors != 1.0)
    if not changed.size:
        return ""
    where = "" if len(changed) == 3 else f" on tower {'abc'[changed[0]]}"
    sentence = f"the readings belong to steps {factors[changed[0]]:g} times as long as the file says{where}"
    return f"{sentence}: microsteps or rotation distance were changed after the calibration"


def _left(printer):
    """Residual rms in mm of the saved numbers, the mean of the heights counted once.

    A place out of reach has an error of an arm's length.
    """
    robot = printer.mechanism()
    heights = printer.height_mm - robot.forward(-printer.height_drop_mm)[:, 2]
    ends = [robot.forward(-printer.distance_drop_mm[:, end]) for end in (0, 1)]
    lengths = printer.distance_mm - np.linalg.norm(ends[0] - ends[1], axis=1)
    off, arm = np.concatenate([heights, lengths]), printer.arm_mm.mean()
    off[~np.isfinite(off)] = arm
    zero = off[: len(heights)].mean()
    off[: len(heights)] -= zero
    return np.sqrt((np.append(off, zero) ** 2).mean())
