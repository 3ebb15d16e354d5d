"""Wrong microsteps: a file whose readings were counted in steps of another length than it states now.

Under the right steps the saved numbers leave of the readings what noise and small changes leave, under others
centimetres. The noise is unknown, so that the likelihood of one length against another is (rms_1 / rms_2) ^ readings. A
zero of the heights that is off (a Z offset that was applied since) counts as one reading that is off, not as all of
them. Steps count as changed where the likelihood exceeds the number of changes that are tried over the level
(Bonferroni).
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
    """The printer with its carriages' ways in steps that are factors (3,) times as long."""
    ways = printer.height_drop_mm * factors, printer.distance_drop_mm * factors
    return replace(printer, height_drop_mm=ways[0], distance_drop_mm=ways[1], step_mm=printer.step_mm * factors)


def changed_steps(printer, level):
    """Factors (3,) of the steps' lengths under which the readings belong to the saved numbers, ones as a rule."""
    stated = _left(printer)
    left = [_left(with_steps(printer, factors)) for factors in _CHANGES]
    best, readings = int(np.argmin(left)), len(printer.height_mm) + len(printer.distance_mm)
    needed = (len(_CHANGES) / level) ** (1.0 / readings)
    return _CHANGES[best] if stated > needed * left[best] else np.ones(3)


def told(factors):
    """What to say of factors (3,) of the steps' lengths; empty for ones."""
    changed = np.flatnonzero(factors != 1.0)
    if not changed.size:
        return ""
    where = "" if len(changed) == 3 else f" on tower {'abc'[changed[0]]}"
    longer = f"the readings belong to steps {factors[changed[0]]:g} times as long as the file says{where}"
    return f"{longer}: microsteps or rotation distance were changed after the calibration"


def _left(printer):
    """Rms in mm of what the saved numbers leave of the readings, the heights' mean counted once.

    A place out of reach is off by an arm's length.
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
