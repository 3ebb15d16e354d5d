"""Whether the sections of paper A's study fit together."""

from rrru.errors import ConfigError


def check(config):
    """Raise ConfigError where `reproduce` or `sweep` names what does not exist or says a thing twice."""
    reproduce, sweep = config["reproduce"], config["sweep"]
    sets = reproduce["sets"] | config["calibration"]["sets"]
    named = {"campaign": config["campaigns"], "line_calibration": sets, "spiral_calibration": sets}
    for key, known in named.items():
        if reproduce[key] not in known:
            raise ConfigError(f"reproduce.{key} is {reproduce[key]!r}; known: {', '.join(known)}")
    own = {f"sweep.readings.{name}.values": reading(sweep, name)["values"] for name in sweep["readings"]}
    for key, values in {"sweep.values": sweep["values"], **own}.items():
        if len({float(value) for value in values}) < len(values):
            raise ConfigError(f"{key} holds a number twice: {', '.join(values)}")
    for kind, sizes in sweep["populations"].items():
        if (len(sizes) == 1) != (kind == "one"):
            raise ConfigError(f"sweep.populations.{kind} is {sizes}; allowed: one size for one, several for islands")


def reading(sweep, operators):
    """Values and seeds that one reading of the algorithm is swept with, from the configuration's `sweep`."""
    own = sweep["readings"][operators]
    return {"values": own.get("values", sweep["values"]), "seeds": own["seeds"]}


def sweeps(sweep, swept):
    """All sweeps as operators/parameter/population, each reading's own ones or every swept parameter and population."""
    every = [f"{parameter}/{population}" for parameter in swept for population in sorted(sweep["populations"])]
    chosen = {name: own.get("sweeps", every) for name, own in sweep["readings"].items()}
    return [f"{name}/{one}" for name, own in chosen.items() for one in own if one in every]


def design(virtual):
    """What the paper states of a virtual campaign's motion and trajectories; None of a measured one."""
    if virtual is None:
        return None
    shape = virtual["trajectories"]
    searched_keys = {"lines": ("start_mm", "end_mm", "offsets_y_mm", "points"), "spiral": ("points",)}
    return {
        "motion": {key: virtual["motion"][key] for key in ("speed_mm_s", "acceleration_mm_s2")},
        "trajectories": {
            name: {key: shape[name][key] for key in keys} for name, keys in searched_keys.items() if shape.get(name)
        },
    }
