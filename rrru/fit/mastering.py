"""Zeros of the drives that are lost, in words."""

from typing import Any

import numpy as np

from rrru.campaign.ingest.mastering import LARGE


def mastering_notes(fit: Any, robot: Any) -> tuple[str, ...]:
    """Sentences on drives whose zeros are far off, such as "joint 4: zero is off by 2 degrees".

    fit: what has `deviations` (p,) of the robot's parameters, a Fit or the State of a diagnosis.
    """
    values = dict(zip(robot.parameters.names, np.asarray(fit.deviations, dtype=float).tolist(), strict=True))
    notes = []
    for drive in robot.parts.drives:
        off = values.get(f"d{drive.column.rpartition('_')[0]}", 0.0)
        if abs(off) > LARGE[drive.unit]:
            size = f"{np.degrees(off):.3g} degrees" if drive.unit == "rad" else f"{off:.3g} mm"
            notes.append(f"{drive.site}: zero is off by {size}")
    return tuple(notes)
