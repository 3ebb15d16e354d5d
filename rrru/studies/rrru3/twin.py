"""The twin, ONE virtual robot and ONE spiral, as numbers to search and as a configuration. Lengths mm, angles rad."""

from dataclasses import dataclass
from itertools import groupby

import numpy as np
import pandas as pd

from rrru.campaign import trajectories
from rrru.effects.library import active_effects
from rrru.errors import ConfigError
from rrru.robots.rrru3 import Rrru3
from rrru.simulation.virtual_robot import VirtualRobot

_LEGS = (1, 2, 3)
_OFFSETS = ("offset_first_mm", "offset_second_mm", "offset_third_mm")
_GEOMETRY = {
    **{f"dtheta{k}": (-0.01, 0.01) for k in _LEGS},
    **{f"dL{link}": (-1.5, 1.5) for link in (1, 2, 3)},
    "dr": (-4.0, 4.0),
}
# name: (low, high); geometry and clearance of the sizes that the paper's errors suggest, and any spiral in the reach
SEARCH_BOUNDS = {
    **_GEOMETRY,
    **{f"clearance{k}": (0.0, 1.5) for k in _LEGS},
    **{f"width{k}": (0.0, 0.003) for k in _LEGS},
    **{f"amplitude{k}": (0.0, 0.003) for k in _LEGS},
    **{f"phase{k}": (-np.pi, np.pi) for k in _LEGS},
    "ratio": (0.5, 12.5),
    "side": (-1.0, 1.0),
    "wobble_mm": (0.2, 0.9),
    **{name: (15.0, 45.0) for name in _OFFSETS},
    "centre_x_mm": (-560.0, 250.0),
    "centre_y_mm": (-200.0, 200.0),
    "radius_start_mm": (20.0, 420.0),
    "radius_end_mm": (30.0, 420.0),
    "z_start_mm": (480.0, 850.0),
    "z_end_mm": (480.0, 850.0),
    "turns": (1.5, 4.0),
    "start_deg": (-180.0, 180.0),
}
# angles that come round
PERIODIC = ("start_deg", *(f"phase{k}" for k in _LEGS))
# no bounds: only the sign counts, or angles that come round
_UNBOUNDED = {"side", *PERIODIC}
# numbers that single hypotheses add: effect to (low, high) by name
_MORE_EFFECTS = {
    "drive_compliance": {f"compliance{k}": (0.0, 2e-7) for k in _LEGS},
    "link_flexure": {f"flexure{k}": (0.0, 0.02) for k in _LEGS},
    "leg_asymmetry": {f"dL{link}_leg{k}": (-1.5, 1.5) for k in _LEGS for link in (1, 2, 3)},
    "axis_tilt": {f"tilt_{axis}{k}": (-0.004, 0.004) for k in _LEGS for axis in "xz"},
    "base_placement": {
        f"{name}{k}": (-width, width)
        for k in _LEGS
        for name, width in (("azimuth", 0.005), ("radius", 2.0), ("height", 2.0))
    },
}
# errors in rad of the first drive's command at single points of group 1, from 1 on; ASSUME which, Fig. 9 has no numbers
SPIKE_POINTS = {"spike1": 7, "spike2": 13, "spike3": 20}
_MORE = {**_MORE_EFFECTS, "spikes": {name: (-0.01, 0.01) for name in SPIKE_POINTS}}
# a number ends at a bound within this share of the bounds' width
_AT_BOUND = 0.01
# keys of the configuration that hold several searched numbers
_EFFECTS = {
    "joint_clearance": [f"clearance{k}" for k in _LEGS],
    "backlash": [f"width{k}" for k in _LEGS],
    "transmission_error": [f"{name}{k}" for name in ("amplitude", "phase") for k in _LEGS] + ["ratio"],
}
_SPIRAL = {
    "centre_mm": ("centre_x_mm", "centre_y_mm"),
    "radius_mm": ("radius_start_mm", "radius_end_mm"),
    "z_mm": ("z_start_mm", "z_end_mm"),
}
# names of one part that differ in more than a number
_PART = {
    **{f"{name}{k}": "transmission" for name in ("amplitude", "phase") for k in _LEGS},
    **{name: "geometry" for name in _GEOMETRY},
    **{name: "spiral" for names in _SPIRAL.values() for name in names},
    **{name: "lines" for name in _OFFSETS},
    "ratio": "transmission",
    "turns": "spiral",
    "start_deg": "spiral",
}


def search_bounds(more=()):
    """Bounds (low, high) by name of all searched numbers, with those of additional effects, or "spikes"."""
    return SEARCH_BOUNDS | {name: limits for effect in more for name, limits in _MORE[effect].items()}


def parts(names):
    """Groups of searched names, in their order, that describe one part each: names that differ in a number, the drives'
    periodic errors, the lines' or the spiral's.
    """
    return [list(group) for _, group in groupby(names, lambda name: _PART.get(name, name.rstrip("123")))]


@dataclass(frozen=True)
class Twin:
    """A candidate: its searched values by name."""

    values: dict

    def robot_section(self):
        """The searched part of a `virtual_robots:` entry."""
        effects = {effect: {name: self.values[name] for name in names} for effect, names in _EFFECTS.items()}
        # a whole number of periods a turn
        effects["transmission_error"]["ratio"] = float(max(round(self.values["ratio"]), 1))
        for effect, names in _MORE_EFFECTS.items():
            if own := {name: self.values[name] for name in names if name in self.values}:
                effects[effect] = own
        geometry = {name: self.values[name] for name in _GEOMETRY}
        return {"errors": geometry, "effects": effects, "wobble_mm": self.values["wobble_mm"]}

    def trajectory_section(self):
        """The searched part of a `trajectories:` entry: line offsets (7,) in y, 0, then pairs outwards, and the spiral.

        Groups 2, 4, 6 are on the side of the sign of `side`.
        """
        side = 1.0 if self.values["side"] >= 0.0 else -1.0
        outwards = np.cumsum([self.values[name] for name in _OFFSETS]).tolist()
        offsets = [0.0, *(side * sign * offset for offset in outwards for sign in (1.0, -1.0))]
        spiral = {key: [self.values[name] for name in names] for key, names in _SPIRAL.items()}
        spiral |= {key: self.values[key] for key in ("turns", "start_deg")}
        return {"lines": {"offsets_y_mm": offsets}, "spiral": spiral}

    def trajectories(self, configured):
        """Seven lines and the spiral: those of a configured `trajectories:` entry with the searched values."""
        searched = self.trajectory_section()
        return trajectories.from_config(
            {shape: {**configured[shape], **searched[shape]} for shape in ("lines", "spiral")}
        )

    def robot(self, mechanism):
        """The virtual robot of this candidate."""
        section = self.robot_section()
        return VirtualRobot(
            mechanism=mechanism,
            deviations=section["errors"],
            effects=active_effects(section["effects"], Rrru3()),
            non_repeatability_mm=section["wobble_mm"],
        )


def stated(section):
    """The lines and the spiral of a `trajectories:` entry without the searched numbers."""
    searched = {"lines": {"offsets_y_mm"}, "spiral": {*_SPIRAL, "turns", "start_deg"}}
    return {
        shape: {key: section[shape][key] for key in section[shape].keys() - keys} for shape, keys in searched.items()
    }


def settled(twin):
    """The same Twin with whole numbers where only these count: the periods a turn and the side."""
    whole = {"ratio": twin.robot_section()["effects"]["transmission_error"]["ratio"]}
    return Twin(twin.values | whole | {"side": 1.0 if twin.values["side"] >= 0.0 else -1.0})


def from_config(virtual):
    """The configured twin: the virtual robot and the trajectories of a virtual campaign's section, as a Twin.

    Raises ConfigError where these have numbers that are not searched.
    """
    robot, lines, spiral = virtual["robot"], virtual["trajectories"]["lines"], virtual["trajectories"]["spiral"]
    offsets = lines["offsets_y_mm"]
    values = {
        **robot["errors"],
        **{key: value for effect in robot["effects"].values() for key, value in effect.items()},
        "wobble_mm": robot.get("wobble_mm", 0.0),
        "side": np.sign(offsets[1]),
        **dict(zip(_OFFSETS, np.diff([0.0, *np.abs(offsets[1::2])]), strict=True)),
        **{name: value for key, names in _SPIRAL.items() for name, value in zip(names, spiral[key], strict=True)},
        **{key: spiral[key] for key in ("turns", "start_deg")},
    }
    bounds = search_bounds(effect for effect in robot["effects"] if effect in _MORE)
    if other := sorted(set(values) ^ set(bounds)):
        raise ConfigError(f"twin: campaign {virtual['name']} differs in {other} from the searched numbers")
    return Twin({name: float(values[name]) for name in bounds})


def numbers(virtual):
    """Rows of `twin_numbers` of a virtual campaign's section; none where it does not have the searched numbers."""
    columns, shapes = ["name", "value", "low", "high", "at_bound"], virtual["trajectories"]
    seven = "spiral" in shapes and len(shapes.get("lines", {}).get("offsets_y_mm", ())) == 7
    try:
        values = from_config(virtual).values if seven else {}
    except ConfigError:
        values = {}
    bounds = search_bounds(_MORE)
    rows = [(name, value, *bounds[name], _at_bound(name, value, *bounds[name])) for name, value in values.items()]
    return pd.DataFrame(rows, columns=columns)


def _at_bound(name, value, low, high):
    """Whether a searched number ended at a bound."""
    return name not in _UNBOUNDED and min(value - low, high - value) < _AT_BOUND * (high - low)


def overlay(twin):
    """Configuration that makes the twin the virtual robot `twin` and its lines and spiral the trajectories `paper`."""
    return _rounded(
        {"trajectories": {"paper": twin.trajectory_section()}, "virtual_robots": {"twin": twin.robot_section()}}
    )


def _rounded(value):
    """The same structure with every number rounded to six significant digits."""
    if isinstance(value, dict):
        return {key: _rounded(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [_rounded(entry) for entry in value]
    return float(f"{value:.6g}")
