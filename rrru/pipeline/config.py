"""The parts of the configuration that a campaign needs, as plain mappings, and the consistency check of its names.

A workflow rule passes only these parts to its script, so that a change reruns only the affected jobs.
"""

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NotRequired, TypeAlias, TypedDict

from rrru.errors import ConfigError, not_a_file
from rrru.pipeline.jobs.outputs import GAP_FIGURES
from rrru.plugins import module_file, own_code_digest
from rrru.robots.catalogue import OWN

# the configuration, or the sections of it that are asked for, and one section; `config.schema.yaml` has their keys
Config: TypeAlias = Mapping[str, Any]
Section: TypeAlias = Mapping[str, Any]


class Bounds(TypedDict):
    """Bounds of a calibration's parameters."""

    angle_rad: float
    length_mm: float


class RobotPart(TypedDict):
    """The robot of a campaign, as `robot` gives it; digest: of the user's own file or code; bounds: by `nominal`."""

    name: str
    dimensions: dict[str, Any]
    parameter_set: str | None
    digest: NotRequired[str]
    targets: NotRequired[list[str]]
    registered: NotRequired[bool]
    bounds: NotRequired[Bounds]


class Motion(TypedDict):
    """The motion of a virtual campaign, and the rest between its runs."""

    speed_mm_s: float
    acceleration_mm_s2: float
    dwell_s: float


class VirtualPart(TypedDict):
    """A virtual campaign, as `virtual` gives it; digest: of the user's own effects; origin: of its random streams."""

    name: str
    seed: int
    robot: dict[str, Any]
    trajectories: dict[str, Any]
    passes: list[dict[str, Any]]
    motion: Motion
    noise_mm: float
    digest: NotRequired[str]
    targets: NotRequired[dict[str, list[float]]]
    noise_rad: NotRequired[float]
    draw: NotRequired[int]
    origin: NotRequired[str]


# keys that the job of a calibration reads besides robot and sets, and that of the genetic algorithm
CALIBRATION_KEYS = tuple(f"calibration.{key}" for key in ("loss", "loss_scale_mm", "use_near_singularity"))
GENETIC_KEYS = ("seed", "genetic", "calibration.use_near_singularity")
# keys of a campaign's section that only drive it, or limit further runs
_DRIVEN = ("trajectories", "passes", "advised_by", "limits", "draw")


def part(config: Config, *keys: str) -> dict[str, Any]:
    """The values under dotted keys such as "robots.rrru3", nested as in the configuration; absent ones are left out."""
    result: dict[str, Any] = {}
    for key in keys:
        source, target, steps = config, result, key.split(".")
        for step in steps[:-1]:
            source, target = source.get(step, {}), target.setdefault(step, {})
        if steps[-1] in source:
            target[steps[-1]] = source[steps[-1]]
    return result


def robot(config: Config, section: Section) -> RobotPart:
    """The robot of a campaign's section: name, dimensions, and the set of parameters where the section chooses one.

    Includes the measurement configuration: reflectors with stated places, and whether its frame was registered.
    """
    name = section["robot"]
    dimensions = {**config["robots"].get(name, {}), **section.get("dimensions", {})}
    # limits of further runs do not change the robot
    dimensions.pop("limits", None)
    own = own_robot_file(dimensions)
    chosen: RobotPart = {"name": name, "dimensions": dimensions, "parameter_set": section.get("errors")}
    # the user's own robot changes with its file
    if "module" in dimensions:
        chosen["digest"] = own_code_digest([dimensions["module"]])
    elif own and own.is_file():
        chosen["digest"] = hashlib.sha256(own.read_bytes()).hexdigest()
    if "targets" in section:
        chosen["targets"] = sorted(section["targets"])
    if section.get("frame") == "register":
        chosen["registered"] = True
    return chosen


def limits(config: Config, section: Section) -> dict[str, Any]:
    """Limits of further runs of a campaign's section, as for `rrru.diagnosis.design.run_limits.StatedLimits`.

    For each key that of the campaign, otherwise that of the robot.
    """
    return {**config["robots"].get(section["robot"], {}).get("limits", {}), **section.get("limits", {})}


def own_robot_file(dimensions: Section) -> Path | None:
    """The file of a `robots:` entry that describes the user's own robot, None for a built-in one."""
    if "module" in dimensions:
        return module_file(dimensions["module"])
    return next((Path(dimensions[key]) for key in ("urdf", "mjcf") if key in dimensions), None)


def own_robot(entry: Section) -> bool:
    """Whether a `robots:` entry describes a robot of the user's own."""
    return any(key in entry for key in OWN)


def corrected_kind(config: Config, section: Section) -> str:
    """Ending of the corrected file of a campaign's robot, "xml" or "urdf"; "" for a robot without such a file."""
    own = config["robots"].get(section["robot"], {})
    if "mjcf" in own:
        return "xml"
    return "urdf" if "urdf" in own and "tips" not in own else ""


def nominal(config: Config, name: str) -> RobotPart:
    """The robot of a campaign with the calibration's bounds."""
    result = robot(config, config["campaigns"][name])
    result["bounds"] = config["calibration"]["bounds"]
    return result


def sets(config: Config, name: str) -> dict[str, list[str]]:
    """Sets of trajectories that a campaign is calibrated on; those of the reproduced study apply to its robot alone."""
    more = config["reproduce"]["sets"] if of_reproduced_study(config, name) else {}
    return {**more, **config["calibration"]["sets"]}


def of_reproduced_study(config: Config, name: str) -> bool:
    """Whether a campaign's robot is that of the reproduced study, whose sets and objective it then shares."""
    reproduced = config["campaigns"].get(config.get("reproduce", {}).get("campaign"))
    return reproduced is not None and config["campaigns"][name]["robot"] == reproduced["robot"]


def source(config: Config, name: str) -> Section:
    """A campaign's section without the keys that only drive it."""
    return {key: value for key, value in config["campaigns"][name].items() if key not in _DRIVEN}


def truth(config: Config, name: str) -> dict[str, float] | None:
    """The true deviations of a virtual campaign's robot by name; None for a measured or simulated one."""
    section = config["campaigns"][name]
    real = config["virtual_robots"][section["virtual"]] if "virtual" in section else {"mujoco": {}}
    return None if "mujoco" in real else real["errors"]


def virtual(config: Config, name: str) -> VirtualPart | None:
    """Settings of a virtual campaign: robot, trajectories, passes, motion, noise and seed; None for a measured one."""
    section = config["campaigns"][name]
    if "virtual" not in section:
        return None
    real = config["virtual_robots"][section["virtual"]]
    own = own_effects(real)
    result: VirtualPart = {
        "name": name,
        "seed": config["seed"],
        "robot": config["loads"] | real,
        "trajectories": config["trajectories"][section["trajectories"]],
        "passes": section.get("passes", [{"reverse": False, "payload_kg": 0.0}]),
        "motion": config["motion"],
        "noise_mm": section["noise_mm"],
    }
    if own:
        # the user's own effects change with their code
        result["digest"] = own_code_digest(own)
    if "targets" in section:
        result["targets"] = section["targets"]
    if "noise_rad" in section:
        result["noise_rad"] = section["noise_rad"]
    if "draw" in section:
        result["draw"] = section["draw"]
    return result


def read_settings(config: Config, name: str) -> dict[str, Any]:
    """Settings of the job that drives or reads a campaign."""
    calibration = config["calibration"]
    return {
        "campaign": name,
        "section": source(config, name),
        "nominal": nominal(config, name),
        "virtual": virtual(config, name),
        "sets": sets(config, name),
        **{key: calibration[key] for key in ("singularity_margin", "use_near_singularity")},
    }


def calibration_settings(config: Config, name: str, *keys: str, driven: bool = False) -> dict[str, Any]:
    """Settings of a job about a campaign's calibrations: its robots, and the configuration under dotted keys.

    driven: the real robot is driven again; otherwise only its true deviations are given.
    """
    real = {"virtual": virtual(config, name)} if driven else {"truth": truth(config, name)}
    result = {"campaign": name, "nominal": nominal(config, name), **real, **part(config, *keys)}
    if "calibration" in result:
        result["calibration"]["sets"] = sets(config, name)
    return result


def diagnosis_settings(config: Config, name: str, section: Section) -> dict[str, Any]:
    """Settings of a diagnosis: what is known of the robot of a campaign's section, never the truth of a virtual one."""
    return {
        "campaign": name,
        "robot": robot(config, section),
        "masses": masses(config, section),
        "noise_mm": section.get("noise_mm"),
        "noise_rad": section.get("noise_rad"),
        "noise_known": section.get("noise_known", False),
        "limits": limits(config, section),
        "use_near_singularity": config["calibration"]["use_near_singularity"],
        "figures": GAP_FIGURES,
        "options": {"campaign": name},
        **part(config, "seed", "gap"),
    }


def figure_options(config: Config, name: str) -> dict[str, str]:
    """Options of the figures of a campaign."""
    method = config["reproduce"]["method"] if of_reproduced_study(config, name) else "least_squares"
    return {"campaign": name, "method": method, "mode": "closed_loop"}


def own_effects(section: Section) -> list[str]:
    """Names `module:object` of the user's own effects in all lists and mappings of effects below a section, sorted."""
    found = set()
    for key, value in section.items():
        if key.endswith("effects") and isinstance(value, list | dict):
            found |= {name for name in value if ":" in str(name)}
        elif isinstance(value, dict):
            found |= set(own_effects(value))
    return sorted(found)


def masses(config: Config, section: Section) -> dict[str, float]:
    """Masses in kg; that of the platform from the campaign's section where stated."""
    loads = config["loads"]
    if own_robot(config["robots"].get(section.get("robot"), {})):
        return {"platform_kg": section.get("platform_mass_kg", 0.0), "forearm_kg": 0.0, "arm_kg": 0.0}
    return {
        "platform_kg": section.get("platform_mass_kg", loads["platform_mass_kg"]),
        "forearm_kg": loads["forearm_mass_kg"],
        "arm_kg": loads["arm_mass_kg"],
    }


def check(config: Config) -> None:
    """Raise ConfigError where names in a valid configuration refer to missing entries."""
    for name, section in config["campaigns"].items():
        if "virtual" in section:
            _check_virtual(config, name, section)
        elif section.get("noise_mm") == 0.0:
            allowed = "a positive number of mm; leave the key out where the noise is unknown, it is then estimated"
            raise ConfigError(f"campaigns.{name}.noise_mm: 0, which no instrument reaches; allowed: {allowed}")


def check_files(config: Config) -> None:
    """Raise ConfigError where a measured campaign, or the robot of one, has no file."""
    for name, section in config["campaigns"].items():
        own = own_robot_file(entry(config, "robots", section["robot"], f"campaigns.{name}"))
        if own and (why := not_a_file(own)):
            raise ConfigError(f"robots.{section['robot']}: {own}: {why}; allowed: a URDF or MJCF file")
        for key, file in zip(("ingest", "commands"), ingested_files(section), strict=False):
            if why := not_a_file(file):
                raise ConfigError(f"campaigns.{name}.{key}: {file}: {why}; allowed: a file of measurements")


def ingested_files(section: Section) -> list[str]:
    """Files that a campaign's section ingests: that of the measurements and that of the commands, if any."""
    commands = section.get("commands", {})
    commands = commands.get("file") if isinstance(commands, dict) else commands
    return [file for file in (section.get("ingest"), commands) if file]


def entry(config: Config, section: str, name: str, asked_by: str) -> dict[str, Any]:
    """config[section][name]; raises ConfigError naming the referring key, the section and its entries."""
    if name not in config[section]:
        raise ConfigError(f"{asked_by}: {section} has no {name!r}; known: {', '.join(config[section])}")
    found: dict[str, Any] = config[section][name]
    return found


def _check_virtual(config: Config, name: str, section: Section) -> None:
    """Raise ConfigError where a virtual campaign's robot, trajectories or passes refer to missing entries."""
    real = entry(config, "virtual_robots", section["virtual"], f"campaigns.{name}")
    if "mujoco" in real:
        from rrru.pipeline import setup

        setup.real_robot(nominal(config, name), real)
    known = trajectory_names(entry(config, "trajectories", section["trajectories"], f"campaigns.{name}"))
    if "advised_by" in section:
        before = entry(config, "campaigns", section["advised_by"], f"campaigns.{name}.advised_by")
        if section["advised_by"] == name or before.get("trajectories") != section["trajectories"]:
            allowed = "another campaign with the same trajectories"
            raise ConfigError(f"campaigns.{name}.advised_by: {section['advised_by']!r}; allowed: {allowed}")
    for campaign_pass in section.get("passes", []):
        for wanted in campaign_pass.get("trajectories", []):
            if wanted not in known:
                raise ConfigError(f"campaigns.{name}.passes: no trajectory {wanted!r}; known: {', '.join(known)}")


def trajectory_names(section: Section) -> list[str]:
    """Names of the trajectories of a `trajectories:` entry."""
    from rrru.campaign import trajectories

    return [trajectory.name for trajectory in trajectories.from_config(section)]
