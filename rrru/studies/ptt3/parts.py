"""Paper B's part of the configuration: its consistency check, and its experiments as campaigns. Light to import."""

from rrru.errors import ConfigError


def check(config):
    """Raise ConfigError where the `ptt` section is inconsistent, before anything runs."""
    section = config["ptt"]
    known, joint = section["experiments"], section["joint"]
    for name, members in joint.items():
        for member in members:
            if member not in known:
                raise ConfigError(f"ptt.joint.{name}: no experiment {member!r}; known: {', '.join(known)}")
    for name in (*known, *joint):
        if name in config["campaigns"] or (name in known and name in joint):
            allowed = "names that no campaign and no other experiment has"
            raise ConfigError(f"ptt: {name!r} names two things; allowed: {allowed}")
    points, train = section["curve"]["points"], section["network"]["train"]
    if not train < points:
        raise ConfigError(f"ptt.network.train is {train}; allowed: below ptt.curve.points, which is {points}")
    travel, reach = section["bench"]["turns"] * section["bench"]["lead_mm"], section["bench"]["range_mm"]
    if travel > reach:
        raise ConfigError(f"ptt.bench: turns times lead_mm is {travel:g} mm; allowed: up to range_mm, {reach:g} mm")


def check_robot(config):
    """Raise ConfigError where the experiments' robot has an unknown deviation or effect."""
    # imported here because it imports all modules of a robot
    from rrru.studies.ptt3.experiments import experiment

    experiment(config, next(iter(config["ptt"]["experiments"])))


def campaign_section(settings, name):
    """The entry of `campaigns` for an experiment, or for experiments that are diagnosed together."""
    section = settings["ptt"]
    loads = [section["experiments"][member]["payload_kg"] for member in section.get("joint", {}).get(name, [name])]
    return {
        "robot": "ptt3",
        "passes": [{"payload_kg": load, "reverse": False} for load in loads for _ in range(section["repeats"])],
        "noise_mm": section["noise_mm"],
        "errors": section["parameters"],
    }
