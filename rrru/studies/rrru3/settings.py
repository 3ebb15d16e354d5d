"""Whether the sections of paper A's study fit together."""

from rrru.errors import ConfigError


def check(config):
    """Raise ConfigError where `reproduce` or `sweep` names what does not exist or says a thing twice."""
    reproduce, sweep = config["reproduce"], config["sweep"]
    sets = config["calibration"]["sets"]
    named = {"campaign": config["campaigns"], "line_calibration": sets, "spiral_calibration": sets}
    for key, known in named.items():
        if reproduce[key] not in known:
            raise ConfigError(f"reproduce.{key} is {reproduce[key]!r}; known: {', '.join(known)}")
    if len({float(value) for value in sweep["values"]}) < len(sweep["values"]):
        raise ConfigError(f"sweep.values holds a number twice: {', '.join(sweep['values'])}")
    for kind, sizes in sweep["populations"].items():
        if (len(sizes) == 1) != (kind == "one"):
            raise ConfigError(f"sweep.populations.{kind} is {sizes}; allowed: one size for one, several for islands")
