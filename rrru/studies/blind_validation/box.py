"""Random trajectories in a box about a robot's home. Lengths mm."""

import numpy as np

from rrru.campaign.trajectories import from_config
from rrru.errors import UnreachableError

_TRIES = 20


def draw_trajectories(generator, conditions):
    """Three lines and a spiral in the model's box, as an entry of the configuration's `trajectories`.

    Raises UnreachableError where no draw is in reach.
    """
    half, home = conditions.model.half_mm, conditions.mechanism.legs.home_mm
    for _ in range(_TRIES):
        x, y, z = home + half * generator.uniform(-0.15, 0.15, 3)
        high, low, inner, outer, begin = generator.uniform([0.2, -0.5, 0.3, 0.7, 0.0], [0.5, -0.2, 0.4, 0.9, 360.0])
        level = z + half * generator.uniform(-0.3, 0.3)
        section = {
            "lines": {
                "start_mm": [x - 0.8 * half, y, level],
                "end_mm": [x + 0.8 * half, y, level],
                "offsets_y_mm": [0.0, 0.5 * half, -0.5 * half],
                "points": 9,
            },
            "spiral": {
                "centre_mm": [x, y],
                "radius_mm": [inner * half, outer * half],
                "z_mm": [z + low * half, z + high * half],
                "turns": generator.uniform(2.2, 3.2),
                "points": 32,
                "start_deg": begin,
            },
        }
        points = np.concatenate([curve.curve(np.linspace(0.0, 1.0, 60)) for curve in from_config(section)])
        if conditions.mechanism.solve(conditions.mechanism.inverse(points), points).closed.all():
            return section
    raise UnreachableError(f"{conditions.name}: no trajectories in reach within {half:g} mm of home in {_TRIES} draws")
