"""From a validated configuration to the objects of a study. The only module that knows the configuration as a whole."""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from rrru.campaign import measurements as rows
from rrru.campaign import trajectories
from rrru.campaign.ingest.campaign_file import IngestSpec, ingest
from rrru.campaign.plan import make_plan
from rrru.errors import ConfigError
from rrru.fit.campaign_fit import select
from rrru.fit.least_squares import least_squares
from rrru.plant import virtual_robot, virtual_tripod
from rrru.robots import singularity, workspace
from rrru.robots.protocol import MECHANISMS, identifiable_truth, make_mechanism
from rrru.robots.rrru3 import Rrru3
from rrru.seeds import stream

# grid lines over the longest reach of a robot's legs
_WORKSPACE_LINES = 130
_INGEST_KEYS = ("columns", "unit", "angle_unit", "frame", "registration_points", "extra_columns", "elbow")


def check(config):
    """Raise ConfigError where names in a valid configuration refer to nothing, before anything runs."""
    for campaign, section in config["campaigns"].items():
        if "virtual" not in section:
            continue
        _entry(config, "virtual_robots", section["virtual"], campaign)
        names = [
            t.name for t in trajectories.from_config(_entry(config, "trajectories", section["trajectories"], campaign))
        ]
        for entry in section.get("passes", []):
            for wanted in entry.get("trajectories", []):
                if wanted not in names:
                    raise ConfigError(
                        f"campaigns.{campaign}.passes: no trajectory {wanted!r}; known: {', '.join(names)}"
                    )
    reproduce, sweep = config["reproduce"], config["sweep"]
    for key, section in (
        ("campaign", config["campaigns"]),
        *((f"{k}_calibration", config["calibration"]["sets"]) for k in ("line", "spiral")),
    ):
        if reproduce[key] not in section:
            raise ConfigError(f"reproduce.{key} is {reproduce[key]!r}; known: {', '.join(section)}")
    if len({float(value) for value in sweep["values"]}) < len(sweep["values"]):
        raise ConfigError(f"sweep.values holds a number twice: {', '.join(sweep['values'])}")
    for kind, sizes in sweep["populations"].items():
        if (len(sizes) == 1) != (kind == "one"):
            raise ConfigError(f"sweep.populations.{kind} is {sizes}; allowed: one size for one, several for islands")


def mechanism(config, campaign, parameter_set=None):
    """The nominal robot of a campaign with the configuration's bounds and the chosen error parameters, by default the
    identifiable ones.
    """
    section, bounds = config["campaigns"][campaign], config["calibration"]["bounds"]
    name = section["robot"]
    return make_mechanism(
        name,
        {**config["robots"].get(name, {}), **section.get("dimensions", {})},
        parameter_set=parameter_set or MECHANISMS[name].TRACKED,
        angle_limit_rad=bounds["angle_rad"],
        length_limit_mm=bounds["length_mm"],
    )


@dataclass(frozen=True)
class VirtualCampaign:
    """A campaign of a virtual robot: the robot, what it is told to do, the tracker's noise and a generator per
    purpose.
    """

    robot: virtual_robot.DrivenRobot
    plan: object
    noise_mm: float
    seed: int
    name: str

    def generator(self, *labels):
        """Random stream of this campaign for a purpose."""
        return stream(self.seed, "campaign", self.name, *labels)

    def run(self):
        """Measurements and truth with the nominal controller."""
        return self.robot.run(self.plan, self.noise_mm, self.generator("measure"))


def is_virtual(config, campaign):
    """True where the campaign is simulated, False where it is read from a file."""
    return "virtual" in config["campaigns"][campaign]


def virtual_campaign(config, campaign):
    """The virtual campaign of that name; raises ConfigError where a name that it refers to does not exist."""
    section = config["campaigns"][campaign]
    robot = _entry(config, "virtual_robots", section["virtual"], campaign)
    motion = config["motion"]
    plan = make_plan(
        trajectories.from_config(_entry(config, "trajectories", section["trajectories"], campaign)),
        section.get("passes", [{"reverse": False, "payload_kg": 0.0}]),
        motion["speed_mm_s"],
        motion["acceleration_mm_s2"],
        motion["dwell_s"],
    )
    kind = virtual_robot if section["robot"] == "rrru3" else virtual_tripod
    return VirtualCampaign(
        kind.from_config(mechanism(config, campaign), robot), plan, section["noise_mm"], config["seed"], campaign
    )


def ingest_campaign(config, campaign):
    """The ingested file of a campaign; raises IngestError where it is refused."""
    section = config["campaigns"][campaign]
    options = {key: section[key] for key in _INGEST_KEYS if key in section}
    if "registration_points" in options:
        options["registration_points"] = tuple(tuple(pair) for pair in options["registration_points"])
    return ingest(IngestSpec(path=section["ingest"], **options), mechanism(config, campaign))


def true_errors(config, campaign):
    """The virtual robot's true errors by the names of the mechanism's parameters, or None for an ingested campaign."""
    if not is_virtual(config, campaign):
        return None
    section = _entry(config, "virtual_robots", config["campaigns"][campaign]["virtual"], campaign)
    return identifiable_truth(mechanism(config, campaign), section["errors"])


def noise(config, campaign, measurements):
    """Noise per axis in mm and where it is from: given in the configuration, else from repeated points, else from the
    fit of all points.
    """
    given = config["campaigns"][campaign].get("noise_mm")
    if given is not None:
        return given, "given"
    repeated, freedom = rows.repeat_noise(measurements)
    if freedom >= rows.ENOUGH_REPEATS and repeated > 0.0:
        return repeated, "repeats"
    residuals = select(measurements, mechanism(config, campaign), ["*"], config["calibration"]["use_near_singularity"])
    if residuals is None:
        raise ConfigError(f"campaigns.{campaign}: too few usable points to estimate noise_mm; give it")
    return least_squares(residuals).noise_mm, "residuals"


def with_singularities(robot, measurements, margin):
    """The measurements with points near a constraint singularity marked, and the rows of `singularity` (without the
    campaign's name).
    """
    position, theta = rows.command(measurements), rows.actuators(measurements)
    measurements = rows.mark_near_singularity(
        measurements, singularity.constraint_measure(robot, position, theta), margin
    )
    return measurements, measurements[["run", "trajectory", "point", "status"]].assign(
        translational_measure=singularity.translational_measure(robot, position, theta),
        constraint_measure=singularity.constraint_measure(robot, position, theta),
        constraint_determinant=singularity.constraint_determinant(robot, position, theta),
    )


def workspace_table(config, campaign, measurements):
    """Rows of `workspace`: the vertical slice y = 0 and the horizontal one through the middle of the commanded
    points.
    """
    robot = mechanism(config, campaign)
    height = float(rows.command(measurements)[:, 2].mean().round(-1))
    reach = float(robot.lengths_mm[1:4].sum())
    # the 3-RRRU's z points down from its base
    across, down = (-reach, reach), (0.0 if isinstance(robot, Rrru3) else -reach, reach)
    frames = []
    for plane, at, vertical in (("xz", 0.0, down), ("xy", height, across)):
        points = workspace.slice_points(plane, at, across, vertical, reach / _WORKSPACE_LINES)
        points = _around_reachable(robot, points)
        reachable, translational, constraint, determinant = workspace.measures(robot, points)
        frames.append(
            pd.DataFrame(
                {
                    "campaign": campaign,
                    "slice": plane,
                    **{f"{axis}_mm": points[:, k] for k, axis in enumerate("xyz")},
                    "reachable": reachable,
                    "translational_measure": translational,
                    "constraint_measure": constraint,
                    "constraint_determinant": determinant,
                }
            )
        )
    return pd.concat(frames, ignore_index=True)


def _unmatched_sets(config, measurements):
    """A note where calibration sets match none of the campaign's trajectories."""
    sets = config["calibration"]["sets"]
    unmatched = [name for name, patterns in sets.items() if not rows.on_trajectories(measurements, patterns).any()]
    if not unmatched:
        return ()
    present = ", ".join(measurements["trajectory"].unique())
    return (f"not calibrated on {', '.join(unmatched)}: these sets match none of the trajectories {present}",)


def _around_reachable(robot, points):
    """The grid points (n, 3) in the box of those that the robot reaches, widened by a tenth."""
    reachable = points[np.isfinite(robot.inverse(points)).all(axis=1)]
    low, high = reachable.min(axis=0), reachable.max(axis=0)
    room = 0.1 * (high - low)
    return points[((points >= low - room) & (points <= high + room)).all(axis=1)]


def campaign_row(config, campaign, measurements, singular, ingested=None):
    """The row of `campaigns`."""
    noise_mm, noise_from = noise(config, campaign, measurements)
    section = config["campaigns"][campaign]
    registration = ingested.registration if ingested else None
    counts = measurements["status"].value_counts()
    return pd.DataFrame(
        [
            {
                "campaign": campaign,
                "robot": section["robot"],
                "source": f"virtual robot {section['virtual']}"
                if "virtual" in section
                else f"file {section['ingest']}",
                "points": len(measurements),
                "runs": measurements["run"].nunique(),
                **{status: int(counts.get(status, 0)) for status in ("ok", "outlier", "near_singularity", "unsolved")},
                "noise_mm": noise_mm,
                "noise_from": noise_from,
                "platform_mass_kg": section.get("platform_mass_kg", np.nan),
                "registration_rms_mm": registration.rms_mm if registration else np.nan,
                "registration_max_mm": registration.max_mm if registration else np.nan,
                "min_translational_measure": singular["translational_measure"].min(),
                "min_constraint_measure": singular["constraint_measure"].min(),
                "notes": "; ".join((*(ingested.notes if ingested else ()), *_unmatched_sets(config, measurements))),
            }
        ]
    )


def _entry(config, section, name, campaign):
    """config[section][name]; raises ConfigError naming campaign, section and what exists."""
    if name not in config[section]:
        raise ConfigError(f"campaigns.{campaign}: {section} has no {name!r}; known: {', '.join(config[section])}")
    return config[section][name]
