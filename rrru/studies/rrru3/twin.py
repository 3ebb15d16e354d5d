"""The twin: ONE virtual robot and ONE spiral, as numbers to search and as a configuration. Lengths in mm, angles in
rad.
"""

from dataclasses import dataclass

import numpy as np

from rrru.campaign.trajectories import Spiral, line_groups
from rrru.effects.library import active_effects
from rrru.errors import ConfigError
from rrru.plant.virtual_robot import VirtualRobot

_LEGS = (1, 2, 3)
# name: (low, high); geometry errors and clearance of the sizes that the paper's errors suggest, and any spiral in the
# reach
SEARCH_BOUNDS = {
    **{f"dtheta{k}": (-0.01, 0.01) for k in _LEGS},
    "dL1": (-1.5, 1.5),
    "dL2": (-1.5, 1.5),
    "dL3": (-1.5, 1.5),
    "dr": (-4.0, 4.0),
    **{f"clearance{k}": (0.0, 1.5) for k in _LEGS},
    **{f"width{k}": (0.0, 0.003) for k in _LEGS},
    **{f"amplitude{k}": (0.0, 0.003) for k in _LEGS},
    **{f"phase{k}": (-np.pi, np.pi) for k in _LEGS},
    "ratio": (0.5, 12.5),
    "side": (-1.0, 1.0),
    "wobble_mm": (0.2, 0.9),
    "offset_first_mm": (15.0, 45.0),
    "offset_second_mm": (15.0, 45.0),
    "offset_third_mm": (15.0, 45.0),
    "centre_x_mm": (-560.0, 250.0),
    "centre_y_mm": (-200.0, 200.0),
    "radius_start_mm": (20.0, 420.0),
    "radius_end_mm": (30.0, 420.0),
    "z_start_mm": (480.0, 850.0),
    "z_end_mm": (480.0, 850.0),
    "turns": (1.5, 4.0),
    "start_deg": (-180.0, 180.0),
}


@dataclass(frozen=True)
class Twin:
    """A candidate: its searched values by name."""

    values: dict

    def offsets(self):
        """Line offsets (7,) in y: 0, then pairs outwards; groups 2, 4, 6 on the side of the sign of `side`."""
        first = self.values["offset_first_mm"]
        second = first + self.values["offset_second_mm"]
        third = second + self.values["offset_third_mm"]
        side = 1.0 if self.values["side"] >= 0.0 else -1.0
        return (0.0, *(side * sign * offset for offset in (first, second, third) for sign in (1.0, -1.0)))

    def trajectories(self, start_mm=(-800.0, 0.0, 600.0), end_mm=(-300.0, 0.0, 600.0)):
        """Seven lines and the spiral."""
        v = self.values
        spiral = Spiral(
            "spiral",
            (v["centre_x_mm"], v["centre_y_mm"]),
            (v["radius_start_mm"], v["radius_end_mm"]),
            (v["z_start_mm"], v["z_end_mm"]),
            v["turns"],
            40,
            v["start_deg"],
        )
        return (*line_groups(start_mm, end_mm, self.offsets(), 26), spiral)

    def effects(self):
        """Effects section of a virtual robot."""
        v = self.values
        return {
            "joint_clearance": {f"clearance{k}": v[f"clearance{k}"] for k in _LEGS},
            "backlash": {f"width{k}": v[f"width{k}"] for k in _LEGS},
            "transmission_error": {
                **{f"amplitude{k}": v[f"amplitude{k}"] for k in _LEGS},
                **{f"phase{k}": v[f"phase{k}"] for k in _LEGS},
                "ratio": float(round(v["ratio"])),
            },
        }

    def robot(self, mechanism, kind=VirtualRobot):
        """The virtual robot of this candidate."""
        names = (*(f"dtheta{k}" for k in _LEGS), "dL1", "dL2", "dL3", "dr")
        return kind(
            mechanism=mechanism,
            deviations={name: self.values[name] for name in names},
            effects=active_effects(self.effects()),
            non_repeatability_mm=self.values["wobble_mm"],
        )


def from_config(virtual):
    """The configured twin: the virtual robot and the trajectories of a virtual campaign's section, as a Twin.

    Raises ConfigError where these hold something that the search does not know.
    """
    robot, shape = virtual["robot"], virtual["trajectories"]
    spiral, offsets = shape["spiral"], shape["lines"]["offsets_y_mm"]
    steps = np.diff([0.0, *np.abs(offsets[1::2])])
    effects = robot["effects"]
    values = {
        **robot["errors"],
        **{key: value for effect in effects.values() for key, value in effect.items()},
        "side": float(np.sign(offsets[1])),
        "wobble_mm": robot["wobble_mm"],
        **dict(zip(("offset_first_mm", "offset_second_mm", "offset_third_mm"), steps.tolist(), strict=True)),
        **dict(zip(("centre_x_mm", "centre_y_mm"), spiral["centre_mm"], strict=True)),
        **dict(zip(("radius_start_mm", "radius_end_mm"), spiral["radius_mm"], strict=True)),
        **dict(zip(("z_start_mm", "z_end_mm"), spiral["z_mm"], strict=True)),
        "turns": spiral["turns"],
        "start_deg": spiral["start_deg"],
    }
    if set(values) != set(SEARCH_BOUNDS):
        raise ConfigError(
            f"twin: campaign {virtual['name']} differs in {sorted(set(values) ^ set(SEARCH_BOUNDS))} from what is searched"
        )
    return Twin({name: float(values[name]) for name in SEARCH_BOUNDS})


def overlay(twin):
    """Configuration overlay that makes the twin the virtual robot `twin` and its lines and spiral the trajectories
    `paper`.
    """
    *_, spiral = twin.trajectories()
    names = (*(f"dtheta{k}" for k in _LEGS), "dL1", "dL2", "dL3", "dr")
    shape = {
        "centre_mm": list(spiral.centre_mm),
        "radius_mm": list(spiral.radius_mm),
        "z_mm": list(spiral.z_mm),
        "turns": spiral.turns,
        "start_deg": spiral.start_deg,
    }
    robot = {
        "errors": {name: twin.values[name] for name in names},
        "effects": twin.effects(),
        "wobble_mm": twin.values["wobble_mm"],
    }
    section = {
        "trajectories": {"paper": {"lines": {"offsets_y_mm": list(twin.offsets())}, "spiral": shape}},
        "virtual_robots": {"twin": robot},
    }
    return _rounded(section)


def _rounded(value):
    """The same structure with every number rounded to six significant digits."""
    if isinstance(value, dict):
        return {key: _rounded(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [_rounded(entry) for entry in value]
    return float(f"{value:.6g}")
