"""What the comparison of methods reads of the configuration. Light to import: the workflow asks for it."""


def settings(config, name):
    """All that the comparison on one robot reads of the configuration, as plain mappings.

    The robot is the one of the robot's own study: of the reproduced campaign, of paper B, of the vision study.
    """
    section, bounds = config["methods"], config["calibration"]["bounds"]
    campaign = config["campaigns"][config["reproduce"]["campaign"]] if name == "rrru3" else {}
    dimensions = {**config["robots"].get(name, {}), **campaign.get("dimensions", {})}
    real = {
        "rrru3": lambda: config["virtual_robots"][campaign["virtual"]],
        "ptt3": lambda: config["ptt"]["robot"] | config["loads"],
        "delta": lambda: {"errors": config["delta"]["errors"], "effects": section["delta_effects"]} | config["loads"],
    }[name]()
    shared = ("points", "test_points", "outside_factor", "motion", "network")
    return {
        "robot": name,
        "seed": config["seed"],
        "nominal": {"name": name, "dimensions": dimensions, "bounds": bounds},
        "real": real,
        "region": section["regions"][name],
        "genetic": config["genetic"],
        **{key: section[key] for key in shared},
    }
