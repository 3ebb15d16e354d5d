"""Zeros of the drives that are lost, in words."""

from typing import Any

import numpy as np
import numpy.typing as npt

from rrru.campaign.ingest.mastering import LARGE

# standard errors from which on a zero is told to be off
_TOLD = 4.0


def mastering_notes(fit: Any, robot: Any, errors: npt.ArrayLike | None = None) -> tuple[str, ...]:
    """Sentences on drives whose zeros are far off, such as "joint 4: zero is off by 2 +- 0.01 degrees".

    fit: what has `deviations` (p,) of the robot's parameters, a Calibration or the State of a diagnosis; errors
    (p,): their standard errors where they are known.
    """
    off = np.asarray(fit.deviations, dtype=float)
    error = np.zeros(len(off)) if errors is None else np.asarray(errors, dtype=float)
    known = dict(zip(robot.parameters.names, zip(off.tolist(), error.tolist(), strict=True), strict=True))
    notes = []
    for drive in robot.parts.drives:
        value, doubt = known.get(f"d{drive.column.rpartition('_')[0]}", (0.0, 0.0))
        if abs(value) > max(LARGE[drive.unit], _TOLD * doubt):
            unit, scale = ("degrees", np.degrees(1.0)) if drive.unit == "rad" else ("mm", 1.0)
            spread = f" +- {scale * doubt:.2g}" if doubt else ""
            notes.append(f"{drive.site}: zero is off by {scale * value:.3g}{spread} {unit}")
    return tuple(notes)
