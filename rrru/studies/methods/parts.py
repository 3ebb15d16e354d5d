"""The part of the configuration for the comparison of methods. Light to import, since the workflow imports it."""

_SHARED = ("points", "test_points", "outside_factor", "motion", "network")


def settings(config, name):
    """The complete settings of the comparison on one robot, as plain mappings.

    The robot is the one of the robot's own study: of the reproduced campaign, of paper B, of the vision study.
    """
    section = config["methods"]
    campaign = config["campaigns"][config["reproduce"]["campaign"]] if name == "rrru3" else {}
    real = {
        "rrru3": lambda: config["virtual_robots"][campaign["virtual"]],
        "ptt3": lambda: config["ptt"]["robot"],
        "delta": lambda: {"errors": config["delta"]["errors"], "effects": section["delta_effects"]},
    }[name]
    return {
        "robot": name,
        "seed": config["seed"],
        "nominal": {
            "name": name,
            "dimensions": {**config["robots"].get(name, {}), **campaign.get("dimensions", {})},
            "bounds": config["calibration"]["bounds"],
        },
        "real": config["loads"] | real(),
        "region": section["regions"][name],
        "genetic": {key: value for key, value in config["genetic"].items() if key not in ("campaigns", "seeds")},
        **{key: section[key] for key in _SHARED},
    }
