"""Construction of robots and campaigns from the parts of the configuration by `rrru.pipeline.config`."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeAlias

import numpy as np
import pandas as pd

from rrru.campaign import measurements as rows
from rrru.campaign import trajectories
from rrru.campaign.plan import Plan, make_plan
from rrru.estimation.starts import register_measurements
from rrru.kinematics.robot import Robot
from rrru.pipeline.config import RobotPart, VirtualPart
from rrru.robots.catalogue import make_mechanism, tracked_set
from rrru.seeds import stream
from rrru.simulation import virtual_robot
from rrru.simulation.driven import DrivenRobot
from rrru.simulation.tracker import Sees


def mechanism(nominal: RobotPart, parameter_set: str | None = None) -> Robot:
    """The nominal robot with a set of parameters: by default the campaign's, or the one for tracked positions.

    Without bounds in the part, those of the robot are used.
    """
    name = nominal["name"]
    limits = {}
    if "bounds" in nominal:
        bounds = nominal["bounds"]
        limits = {"angle_limit_rad": bounds["angle_rad"], "length_limit_mm": bounds["length_mm"]}
    default = nominal.get("parameter_set") or tracked_set(name)
    return make_mechanism(name, nominal["dimensions"], parameter_set=parameter_set or default, **limits)


def measured_robot(nominal: RobotPart, measurements: pd.DataFrame, parameter_set: str | None = None) -> Robot:
    """The `mechanism` of a measured campaign, with the parameters that are identifiable from its poses.

    These include the open ones of its measurement configuration: frame, tool, places of reflectors.
    """
    robot = mechanism(nominal, parameter_set)
    return as_measured(robot, measurements, nominal.get("targets", ()), nominal.get("registered", False))


def as_measured(
    robot: Robot, measurements: pd.DataFrame, targets: Iterable[str] = (), registered: bool = False
) -> Robot:
    """A nominal robot with the parameters identifiable from a measurement table; see `measured_robot`.

    targets: reflectors with stated places; registered: whether the frame was registered.
    """
    robot = robot.with_measurement_config(rows.measurement_config(measurements, targets, registered))
    measurements = register_measurements(measurements, robot)
    known = measurements[rows.usable(measurements)]
    actuators = rows.actuators(known, robot)
    result: Robot = robot.with_identifiable_parameters(
        actuators, rows.command(known), rows.readings(known, robot.characteristic_length_mm)
    )
    return result


# positions (N, 3) in the order driven to actuator values (N, K), or these to others
Controller: TypeAlias = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class VirtualCampaign:
    """A campaign of a virtual robot: the robot, its plan and the tracker's noise.

    origin: first label of its random streams, in addition to its name; drive: actuator values (N, k) that the
    controller wants, in the order driven, to those sent to the motors, None where these are the same; sees: what the
    tracker reads; draw: number of the draw of non-repeatability and noise that is measured, None for one of its own.
    """

    robot: DrivenRobot
    plan: Plan
    noise_mm: float
    seed: int
    name: str
    origin: str = "campaign"
    drive: Controller | None = None
    sees: Sees = field(default_factory=Sees)
    draw: int | None = None

    def generator(self, *labels: str | int) -> np.random.Generator:
        """Random stream of this campaign for a purpose."""
        return stream(self.seed, self.origin, self.name, *labels)

    def drawn(self, label: str, draw: int | None = None) -> np.random.Generator:
        """Random stream of the measurements of a label, in a numbered draw or in that without a number."""
        return self.generator(*(() if draw is None else ("redraw", draw)), label)

    def run(self, controller: Controller | None = None, label: str = "measure") -> tuple[pd.DataFrame, pd.DataFrame]:
        """Measurements, with the actuator values that the controller wants, and truth.

        controller: positions (N, 3) in the order driven to actuator values, by default the nominal inverse kinematics;
        label: of the noise's random stream.
        """
        mechanism, generator = self.robot.mechanism, self.drawn(label, self.draw)
        if self.drive is None:
            tables: tuple[pd.DataFrame, pd.DataFrame] = self.robot.run(
                self.plan, self.noise_mm, generator, controller, self.sees
            )
            return tables
        path, index = self.plan.path()
        wanted = (controller or mechanism.inverse)(path)
        sent = self.drive(wanted)
        measurements, truth = self.robot.run(self.plan, self.noise_mm, generator, lambda _: sent, self.sees)
        read = wanted[index][self.sees.rows(len(index))]
        return measurements.assign(**dict(zip(mechanism.parts.columns, read.T, strict=True))), truth


def real_robot(nominal: RobotPart, section: Mapping[str, Any]) -> DrivenRobot:
    """The virtual robot of a nominal one and an entry of `virtual_robots:`; see `virtual_campaign`."""
    if "mujoco" not in section:
        real: DrivenRobot = virtual_robot.from_config(mechanism(nominal), section)
        return real
    # a large import that other robots do not need
    from rrru.simulation import mujoco_robot

    simulated: DrivenRobot = mujoco_robot.from_config(mechanism(nominal), nominal["dimensions"], section)
    return simulated


def virtual_campaign(
    nominal: RobotPart, virtual: VirtualPart, advice: Sequence[pd.DataFrame] | None = None
) -> VirtualCampaign:
    """The virtual campaign of its parts; raises ConfigError where a number or a name of the robot is not allowed.

    advice: tables `gap_next_runs` and `gap_next_poses`, whose first run is driven after the passes, if there is any.
    """
    motion = virtual["motion"]
    plan = make_plan(
        trajectories.from_config(virtual["trajectories"]),
        virtual["passes"],
        motion["speed_mm_s"],
        motion["acceleration_mm_s2"],
        motion["dwell_s"],
    )
    if advice is not None and len(advice[0]):
        # a diagnosis is not small, and campaigns that follow none do not need it
        from rrru.pipeline.advised import advised_runs

        more = advised_runs(advice[0].iloc[0].to_dict(), advice[1], virtual["trajectories"], motion)
        plan = replace(plan, runs=(*plan.runs, *more))
    real = real_robot(nominal, virtual["robot"])
    origin = virtual.get("origin", "campaign")
    sees = Sees(virtual.get("targets", {}), virtual.get("noise_rad"))
    return VirtualCampaign(
        real, plan, virtual["noise_mm"], virtual["seed"], virtual["name"], origin, sees=sees, draw=virtual.get("draw")
    )


def true_deviations(robot: Robot, truth: dict[str, float] | None) -> dict[str, float] | None:
    """True deviations by the names of the mechanism's parameters from those of the real robot, None where unknown."""
    return None if truth is None else robot.identifiable(truth)
