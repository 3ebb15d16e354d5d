"""The library of effects by name."""

from rrru.effects.backlash import Backlash
from rrru.effects.joint_clearance import JointClearance
from rrru.effects.protocol import ActiveEffect
from rrru.effects.transmission_error import TransmissionError
from rrru.errors import ConfigError

EFFECTS = {effect.name: effect for effect in (Backlash(), JointClearance(), TransmissionError())}


def active_effects(section):
    """Effects with their values from a mapping {effect: {parameter: value}}; raises ConfigError for unknown names and values out of bounds."""
    result = []
    for name, values in dict(section or {}).items():
        if name not in EFFECTS:
            raise ConfigError(f"unknown effect {name!r}; known: {', '.join(sorted(EFFECTS))}")
        parameters = EFFECTS[name].parameters
        for key, value in values.items():
            allowed = parameters[key]
            if not allowed.low <= value <= allowed.high:
                raise ConfigError(f"effect {name}: {key} is {value} {allowed.unit}; allowed: {allowed.low} to {allowed.high}")
        result.append(ActiveEffect(EFFECTS[name], dict(values)))
    return tuple(result)
