"""The five experiments of paper B: robot, curve, what its controller does, and how it is measured. Lengths in mm,
angles in rad.

Every experiment drives one curve several times and takes the mean of what the tracker sees as a point's position. The
slider columns of its measurements hold where the controller wants the sliders; the jump that a compensated backlash
adds to the motor's command is not in them.
"""

from dataclasses import dataclass

import pandas as pd

from rrru.campaign import measurements as rows
from rrru.campaign.plan import make_plan
from rrru.campaign.trajectories import Spiral
from rrru.compensate.backlash import compensated
from rrru.effects.library import active_effects
from rrru.errors import ConfigError
from rrru.plant.screw import Bench
from rrru.plant.virtual_tripod import VirtualTripod
from rrru.robots.protocol import make_mechanism
from rrru.seeds import stream


def check(config):
    """Raise ConfigError where the `ptt` section does not fit together, before anything runs."""
    section = config["ptt"]
    for name, members in section["joint"].items():
        for member in members:
            if member not in section["experiments"]:
                raise ConfigError(
                    f"ptt.joint.{name}: no experiment {member!r}; known: {', '.join(section['experiments'])}"
                )
    for name in (*section["experiments"], *section["joint"]):
        if name in config["campaigns"] or (name in section["experiments"] and name in section["joint"]):
            raise ConfigError(
                f"ptt: {name!r} names two things; allowed: names that no campaign and no other experiment has"
            )
    points, train = section["curve"]["points"], section["network"]["train"]
    if not train < points:
        raise ConfigError(f"ptt.network.train is {train}; allowed: below ptt.curve.points, which is {points}")
    travel, reach = section["bench"]["turns"] * section["bench"]["lead_mm"], section["bench"]["range_mm"]
    if travel > reach:
        raise ConfigError(f"ptt.bench: turns times lead_mm is {travel:g} mm; allowed: up to range_mm, {reach:g} mm")
    robot(config)


def mechanism(config, parameter_set="tied"):
    """The nominal 3-PTT with a choice of error parameters, see `rrru.robots.ptt3`."""
    return make_mechanism("ptt3", config["robots"]["ptt3"], parameter_set=parameter_set)


def robot(config):
    """The virtual robot that all experiments share; raises ConfigError for an unknown error or effect."""
    section, loads = config["ptt"]["robot"], config["loads"]
    return VirtualTripod(
        mechanism(config),
        deviations={name: float(value) for name, value in section["errors"].items()},
        effects=active_effects(section["effects"], "mm"),
        platform_mass_kg=loads["platform_mass_kg"],
        forearm_mass_kg=loads["forearm_mass_kg"],
        arm_mass_kg=loads["arm_mass_kg"],
    )


def bench(config):
    """The encoder's bench."""
    section = config["ptt"]["bench"]
    return Bench(**{key: value for key, value in section.items() if key != "range_mm"})


def curve(config, radius_mm=0.0, height_mm=0.0):
    """The curve of eq. (18) with its run-up before and after, with what is added to its radius and heights in mm."""
    section = config["ptt"]["curve"]
    radius, (low, high), extra = section["radius_mm"] + radius_mm, section["z_mm"], section["run_up_points"]
    share = extra / (section["points"] - 1)
    low, high = low - share * (high - low) + height_mm, high + share * (high - low) + height_mm
    start = section["start_deg"] - 360.0 * share
    return Spiral(
        "curve", (0.0, 0.0), (radius, radius), (low, high), 1.0 + 2.0 * share, section["points"] + 2 * extra, start
    )


def plan(config, payload_kg, path=None, reverse=(False,), repeats=None):
    """Plan of passes along a curve under a payload; reverse: directions of the passes, taken in turn.

    path, repeats: another curve and number of passes than the configured ones.
    """
    section = config["ptt"]
    passes = [
        {"payload_kg": payload_kg, "reverse": reverse[k % len(reverse)]} for k in range(repeats or section["repeats"])
    ]
    return make_plan(
        [path or curve(config)],
        passes,
        *(section["motion"][key] for key in ("speed_mm_s", "acceleration_mm_s2", "dwell_s")),
    )


@dataclass(frozen=True)
class Experiment:
    """One experiment: the virtual robot, whether its backlash is compensated, its payload, plan, tracker noise and
    seed.
    """

    name: str
    robot: VirtualTripod
    compensated: bool
    payload_kg: float
    plan: object
    noise_mm: float
    seed: int

    def generator(self, *labels):
        """Random stream of the experiment for a purpose."""
        return stream(self.seed, "ptt", self.name, *labels)

    def run(self, widths_mm, generator, sliders=None, plan=None):
        """Measurements of a plan, by default the experiment's.

        widths_mm (3,): the backlash as measured, which the command compensates if the experiment does; sliders:
        positions (N, 3) in the order driven to slider positions (N, 3), by default the nominal inverse kinematics.
        """
        plan, sliders = plan or self.plan, sliders or self.robot.mechanism.inverse
        path, index = plan.path()
        wanted = sliders(path)
        measured, _ = self.robot.run(plan, self.noise_mm, generator, lambda _: self._sent(wanted, widths_mm))
        return measured.assign(**dict(zip(rows.actuator_columns("mm"), wanted[index].T, strict=True)))

    def positions(self, widths_mm, sliders, plan):
        """True positions (n, 3) at a plan's points, driven as in `run`; raises UnreachableError."""
        self.robot.mechanism.require_reachable(plan.targets())
        position, _ = self.robot.positions(self.robot.motion(plan, lambda path: self._sent(sliders(path), widths_mm)))
        return position

    def _sent(self, wanted_mm, widths_mm):
        """Drive commands (N, 3) for wanted slider positions (N, 3) in the order driven."""
        return compensated(wanted_mm, widths_mm) if self.compensated else wanted_mm


def experiment(config, name, compensate=None):
    """The experiment of that name; compensate: whether its backlash is, instead of as configured."""
    section = config["ptt"]
    own = section["experiments"][name]
    load = own["payload_kg"]
    return Experiment(
        name=name,
        robot=robot(config),
        compensated=own["compensate_backlash"] if compensate is None else compensate,
        payload_kg=load,
        plan=plan(config, load),
        noise_mm=section["noise_mm"],
        seed=config["seed"],
    )


def point_means(config, measurements):
    """Commanded positions, wanted slider positions and mean measured positions, each (n, 3), of the curve's points
    without the run-up.

    measurements: of passes in one direction.
    """
    extra, passes = config["ptt"]["curve"]["run_up_points"], measurements["run"].nunique()
    every = (rows.command(measurements), rows.actuators(measurements), rows.measured(measurements))
    return tuple(values.reshape(passes, -1, 3)[:, extra : -extra or None].mean(axis=0) for values in every)


def joined(measured, dwell_s):
    """Measurements of several experiments as one campaign, one after another with a rest between them, runs numbered
    on.
    """
    parts, runs, time = [], 0, 0.0
    for frame in measured:
        parts.append(frame.assign(run=frame["run"] + runs, time_s=frame["time_s"] + time))
        runs, time = int(parts[-1]["run"].max()), float(parts[-1]["time_s"].max()) + dwell_s
    return pd.concat(parts, ignore_index=True)
