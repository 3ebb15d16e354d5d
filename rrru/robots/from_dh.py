"""Serial arms from the rows of a configuration, in mm and degrees; see `rrru.robots.serial`."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from rrru.errors import ConfigError
from rrru.kinematics.end_effectors import with_hands
from rrru.kinematics.general_robot import GeneralRobot
from rrru.robots.serial import FRAME, JOINT, serial

_LENGTHS, _ANGLES = ("a_mm", "d_mm"), ("alpha_deg", "theta_deg", "rpy_deg")
_VALUES = ("range_deg", "range_mm", "home_deg", "home_mm")
_CONVENTIONS = ("standard", "modified")
# as a row of the configuration has them
_JOINT = ("a_mm", "d_mm", "alpha_deg", "theta_deg", "sliding", *_VALUES, "name", "drives", "mass_kg", "com_mm")
_FRAME = ("xyz_mm", "rpy_deg", "mass_kg", "com_mm")


def from_dh(
    rows: Sequence[Mapping[str, Any]],
    convention: str = "standard",
    name: str = "arm",
    hands: Mapping[str, Sequence[Mapping[str, Any]]] | None = None,
    carries: Mapping[str, Sequence[str]] | None = None,
    **options: Any,
) -> GeneralRobot:
    """The GeneralRobot of rows as `serial` takes them, with a_mm, d_mm, alpha_deg, theta_deg and rpy_deg.

    A row whose joint has a drive of its own states its range_deg, or range_mm where it slides, and may state home_deg
    or home_mm, by default the range's middle. convention: "standard" or "modified". hands: the rows of each of several
    arms, by the name of its end effector, behind a trunk of the rows; carries: names of the targets on each end
    effector, by default its own. Raises ConfigError for unknown keys and missing ranges.
    """
    if convention not in _CONVENTIONS:
        raise ConfigError(f"robot {name}: convention is {convention!r}; allowed: {', '.join(_CONVENTIONS)}")
    if hands is None and carries is None:
        return _chain(rows, convention, name, options)
    if not hands or len(hands) < 2:
        raise ConfigError(f"robot {name}: hands {', '.join(hands or ()) or 'none'}; allowed: two or more")
    arms = {arm: _chain([*rows, *more], convention, name, options) for arm, more in hands.items()}
    return with_hands(arms, 1 + len(rows), carries)


def _chain(rows: Sequence[Mapping[str, Any]], convention: str, name: str, options: Mapping[str, Any]) -> GeneralRobot:
    """The GeneralRobot of one arm's rows."""
    plain, ranges, homes = [], [], []
    for number, row in enumerate(rows, 1):
        plain.append(_plain(row, f"robot {name}: row {number}"))
        joint = row.get("name", f"q{number}")
        if set(row) & {"xyz_mm", "rpy_deg"} or joint not in row.get("drives", {joint: 1.0}):
            continue
        unit = "mm" if row.get("sliding") else "deg"
        if f"range_{unit}" not in row:
            raise ConfigError(f"robot {name}: row {number} has no range_{unit}; allowed: lowest and highest value")
        low, high = row[f"range_{unit}"]
        if not low < high:
            raise ConfigError(
                f"robot {name}: row {number} has range_{unit} {low:g} to {high:g}; allowed: low, then high"
            )
        scale = 1.0 if unit == "mm" else np.pi / 180.0
        ranges.append(scale * np.asarray(row[f"range_{unit}"], dtype=float))
        homes.append(scale * row.get(f"home_{unit}", float(np.mean(row[f"range_{unit}"]))))
    return serial(plain, ranges, homes, modified=convention == "modified", name=name, **options)


def _plain(row: Mapping[str, Any], where: str) -> dict[str, Any]:
    """A row as `serial` takes it."""
    result = {}
    for key, value in row.items():
        if key in _LENGTHS:
            result[key.removesuffix("_mm")] = value
        elif key in _ANGLES:
            short = "rpy_rad" if key == "rpy_deg" else key.removesuffix("_deg")
            result[short] = np.radians(value)
        elif key in {*JOINT, *FRAME} - {"a", "alpha", "d", "theta", "rpy_rad"}:
            result[key] = value
        elif key not in _VALUES:
            allowed = f"{', '.join(_JOINT)}; of a fixed frame {', '.join(_FRAME)}"
            raise ConfigError(f"{where} has {key!r}; allowed: {allowed}")
    return result
