"""MuJoCo's system identification, `mujoco.sysid`, compared with the diagnosis: intervals, held-out gap, seconds.

Six-axis arms of `data/models/arm6.xml`, simulated by MuJoCo: all drives have zero offsets, and either one drive's servo
is soft or one gear has backlash. Both methods use the same campaign with the same noise. `mujoco.sysid` is used as in
its documentation, with as much prior knowledge as possible. It has every control, step by step, and a structure with
unknown parameters only: the zeros of all drives, and either the compliance of all or the backlash of the one that has
it (with the joint and the friction of the plant). Residuals are in mm, so that all axes have equal weight. Each payload
is a separate sequence, as its documentation advises. It is also run with the structure of the other cause. The
diagnosis has the file and no information on causes; its result is evaluated by its corrected file.

`make bench GROUPS=sysid` writes results/tables/sysid.parquet.
"""

import contextlib
import io
import logging
import tempfile
from dataclasses import dataclass, field, replace
from pathlib import Path
from time import process_time

import mujoco
import numpy as np
import pandas as pd
import yaml
from mujoco import sysid

from benchmarks import harness
from rrru.campaign import measurements as rows
from rrru.diagnosis.correction.corrected_model import write_corrected
from rrru.diagnosis.diagnose import MeasuredRobot, diagnose
from rrru.diagnosis.settings import GapSettings
from rrru.kinematics.dynamics import Masses
from rrru.pipeline import setup
from rrru.simulation import mujoco_causes, mujoco_model
from rrru.simulation.mujoco_robot import MujocoRobot
from rrru.simulation.mujoco_run import Machine
from rrru.store import tables
from rrru.store.schema import read_tables
from rrru.studies.end_to_end.models import errors

ROOT = Path(__file__).resolve().parents[1]
FILE, PLATFORM, NOISE_MM = ROOT / "data/models/arm6.xml", "tool0", 0.01
NOMINAL = {"name": "arm6", "dimensions": {"mjcf": str(FILE), "platform": PLATFORM}, "parameter_set": "zero"}
AXES = [f"axis{k}" for k in range(1, 7)]
# units of a drive's parameters: mrad, µrad/(N m), mrad
UNIT = {"zero": 1e-3, "soft_servo": 1e-9, "play": 1e-3}
PASSES = ({}, {"reverse": True}, {"trajectories": ["line_1", "spiral"], "payload_kg": 4.0})
# slow enough that inertia is negligible for the diagnosis, which uses the plan's times
_MOTION = {"speed_mm_s": 300.0, "acceleration_mm_s2": 10.0, "dwell_s": 60.0}
# rest before each sequence
_BEFORE_S = 0.1
# seeds from 0 on; the first few are also fitted in the other structure
ROBOTS, WRONG, OUT = 6, 2, ROOT / "results/tables/sysid.parquet"
_MASSES = Masses(0.0, 0.0, 0.0)
# in the parameters' units: steps of the finite differences, and tolerances of a fit; the default of 1e-8 is below the
# noise of a simulation with creeping friction
_OPTIONS = {"eps": 1e-3, "xtol": 1e-4, "gtol": 1e-4, "max_iters": 10, "x_scale": "jac"}
_SIGMAS = 1.96
_START = {"zero": 0.0, "soft_servo": 0.1, "play": 0.2}
_BOUNDS = {"zero": (-20.0, 20.0), "soft_servo": (0.005, 50.0), "play": (0.0, 5.0)}
TABLE = read_tables("""
## sysid | tables/sysid.parquet | robot by given
`mujoco.sysid` and the diagnosis on the same campaigns of arms simulated by MuJoCo, from benchmarks/sysid.py.
--
robot                  int    seed that it was drawn with
cause                  str    acting cause, in addition to zero offsets {soft_servo, play}
by                     str    method {mujoco.sysid, rrru}
given                  str    structure fitted by mujoco.sysid; the diagnosis has none
    {soft_servo, play, nothing}
answer                 str    verdict of the diagnosis with its probability; warnings of mujoco.sysid
numbers                int    numbers of the cause with a finite interval
held                   int    of these, true numbers inside their 95 % interval
off_sigmas             float? deviation of the cause's number over its standard error; null without such a number
zeros                  int    zeros of drives with a finite interval
zeros_held             int    of these, true ones within it
left_mm                float  residual rms on the campaign
fresh_mm               float  residual rms on a new campaign
noise_mm               float  rms of the noise
points                 int    of the campaign
seconds                float  of this process and its threads
""")[0]


# --- robots with every control recorded


@dataclass(frozen=True)
class Truth:
    """A robot: zeros (6,) in mrad, its cause, its drive, and its size in that cause's unit."""

    zeros: np.ndarray
    cause: str
    drive: str
    size: float

    @property
    def causes(self):
        """The causes as the plant's input."""
        if self.cause == "play":
            acting = {"play": {self.drive: UNIT["play"] * self.size}}
        else:
            acting = {"actuator_stiffness": {self.drive: 1.0 / (UNIT["soft_servo"] * self.size)}}
        return {"zero_offset": dict(zip(AXES, UNIT["zero"] * self.zeros, strict=True))} | acting


def draw(seed):
    """The Truth of a seed; even ones have a soft drive that carries weight, odd ones backlash in a large joint."""
    generator = np.random.default_rng(seed)
    zeros, even = 2.0 * generator.standard_normal(6), seed % 2 == 0
    drive = str(generator.choice(AXES[1:3] if even else AXES[:3]))
    low, high = (4.0, 12.0) if even else (0.15, 0.6)
    size = float(np.exp(generator.uniform(np.log(low), np.log(high))))
    return Truth(zeros, "soft_servo" if even else "play", drive, size)


@dataclass
class Recorded:
    """Controls (6,) of every step with one payload from rest on, and the steps of the readings.

    start: values of qpos by joint at rest.
    """

    payload_kg: float
    start_s: float
    start: dict
    controls: list = field(default_factory=list)
    read: list = field(default_factory=list)

    def rest(self, time_s, controls):
        """Fill up the steps until a time with controls that did not change."""
        steps = round((time_s - self.start_s + _BEFORE_S) / mujoco_model.STEP_S)
        self.controls += [controls] * (steps - len(self.controls))


class Recorder(Machine):
    """Records the controls of every step, from the first point on, and the times of readings."""

    sequences = ()

    def _recorded(self):
        """A new Recorded of the robot in its current state."""
        start = {name: self.data.joint(name).qpos.copy() for name in self.edit.home}
        return Recorded(self.payload_kg, self.data.time, start)

    def _now(self):
        """The current controls without the zero offsets, which the controller does not know."""
        return self.data.ctrl[self.actuators] - [self.edit.offsets.get(joint, 0.0) for joint in self.edit.servos]

    def _weigh(self, payload_kg):
        super()._weigh(payload_kg)
        self.payload_kg = payload_kg
        if self.sequences:
            self.sequences.append(self._recorded())

    def _closed(self, where):
        super()._closed(where)
        self.sequences = self.sequences or [self._recorded()]
        sequence = self.sequences[-1]
        sequence.rest(self.data.time, self._now())
        sequence.read.append(len(sequence.controls) - 2)

    def _send(self, controls):
        for row in controls:
            if self.sequences:
                self.sequences[-1].rest(self.data.time, self._now())
            super()._send(row[None])
            if self.sequences:
                self.sequences[-1].controls.append(self._now())


@dataclass(frozen=True)
class RecordedRobot(MujocoRobot):
    """A MujocoRobot that stores its Recorder."""

    recorders: list = field(default_factory=list)

    def machine(self, payload_kg=0.0):
        """The Recorder as the machine of a MujocoRobot."""
        made = super().machine(payload_kg)
        self.recorders[:] = [Recorder(made.edit, made.file)]
        return self.recorders[0]


def campaign(truth, seed, trajectories, passes, name):
    """Measurements of a Truth's robot, and the recorded controls."""
    virtual = {
        "name": name,
        "seed": seed,
        "robot": {"mujoco": {"causes": truth.causes}},
        "trajectories": trajectories,
        "passes": [{"reverse": False, "payload_kg": 0.0} | campaign_pass for campaign_pass in passes],
        "motion": _MOTION,
        "noise_mm": NOISE_MM,
    }
    driven = setup.virtual_campaign(NOMINAL, virtual)
    plant = driven.robot
    robot = RecordedRobot(plant.mechanism, plant.file, plant.platform, plant.causes)
    frame, _ = replace(driven, robot=robot).run()
    return frame, robot.recorders[0].sequences


def trajectories(x_mm, z_mm):
    """Two lines and a turn of a spiral about a place: short, because every fit simulates them a hundred times."""
    lines = {"start_mm": [x_mm - 90.0, 0.0, z_mm - 40.0], "end_mm": [x_mm + 90.0, 0.0, z_mm + 40.0]}
    spiral = {"centre_mm": [x_mm, 0.0], "radius_mm": [50.0, 90.0], "z_mm": [z_mm - 50.0, z_mm + 50.0]}
    return {
        "lines": lines | {"offsets_y_mm": [-60.0, 60.0], "points": 7},
        "spiral": spiral | {"turns": 1.0, "points": 9},
    }


# --- fits of both


def structure(given, drive):
    """The Edit of the file as in both plants, with the backlash of a drive where that is unknown."""
    edit = mujoco_model.read(FILE, PLATFORM, (0.0, 0.0, 0.0), AXES)
    edit.payload_kg = max(run.get("payload_kg", 0.0) for run in PASSES)
    if given == "play":
        mujoco_causes.apply(edit, {"play": {drive: UNIT["play"] * _START["play"]}})
    edit.spec.add_sensor(
        name="tool", type=mujoco.mjtSensor.mjSENS_FRAMEPOS, objtype=mujoco.mjtObj.mjOBJ_XBODY, objname=PLATFORM
    )
    return edit


def unknown(given, drive):
    """The ParameterDict of a structure: zeros of all drives, and compliances of all or the backlash of one."""
    names = [("zero", axis) for axis in AXES]
    names += [(given, axis) for axis in (AXES if given == "soft_servo" else [drive])]
    result = sysid.ParameterDict()
    for kind, axis in names:
        result.add(sysid.Parameter(f"{kind} {axis}", _START[kind], *_BOUNDS[kind]))
    return result


def build_model(params, spec):
    """The model of a structure with its parameters: stiffness as inverse compliance, damping ratio as in the file."""
    spec = spec.copy()
    for servo in spec.actuators:
        if (name := f"soft_servo {servo.target}") in params:
            share = 1e-3 / (UNIT["soft_servo"] * params[name].value[0]) / servo.gainprm[0]
            servo.gainprm[0], servo.biasprm[1] = share * servo.gainprm[0], share * servo.biasprm[1]
            servo.biasprm[2] *= np.sqrt(share)
        servo.biasprm[0] = servo.gainprm[0] * UNIT["zero"] * params[f"zero {servo.target}"].value[0]
        if (name := f"play {servo.target}") in params:
            half = 0.5 * UNIT["play"] * params[name].value[0]
            spec.joint(f"{servo.target} play").range = (-half, half)
    return spec.compile()


def in_mm(params, sensordata_predicted, sensordata_measured, model, return_pred_all, **kwargs):
    """Residuals in mm at the times of the readings."""
    del params, model, return_pred_all, kwargs
    measured = sensordata_measured
    predicted = sysid.TimeSeries(
        measured.times, sensordata_predicted.interpolate(measured.times), measured.signal_mapping
    )
    return 1e3 * (measured.data - predicted.data), predicted, measured


def residual_of(edit, frame, sequences):
    """The residual function of a measurement table and the controls, one ModelSequences for every payload."""
    models, first = [], 0
    for number, one in enumerate(sequences):
        spec, controls = edit.spec.copy(), np.array(one.controls)
        load = spec.body(mujoco_model.PAYLOAD)
        load.mass, load.inertia, load.explicitinertial = one.payload_kg, np.full(3, 1e-9), True
        model = spec.compile()
        start = mujoco.MjData(model).qpos
        for name in set(one.start) & set(edit.home):
            start[model.joint(name).qposadr[0]] = one.start[name][0]
        times, read = mujoco_model.STEP_S * np.arange(len(controls)), np.array(one.read)
        places = 1e-3 * rows.measured(frame)[first : first + len(read)]
        first += len(read)
        inputs = (
            sysid.create_initial_state(model, start.copy()),
            sysid.TimeSeries.from_control_names(times, controls, model),
            sysid.TimeSeries.from_names(times[read], places, model),
        )
        models.append(sysid.ModelSequences(f"{one.payload_kg:g} kg", spec, f"sequence {number}", *inputs))
    return sysid.build_residual_fn(models_sequences=models, build_model=build_model, modify_residual=in_mm, n_threads=1)


def by_sysid(truth, given, measured, fresh):
    """The result of `mujoco.sysid`, and its model's errors (n, 3) on a new campaign. measured, fresh: of `campaign`."""
    messages, before = io.StringIO(), process_time()
    handler = logging.StreamHandler(messages)
    handler.setLevel(logging.WARNING)
    logging.getLogger("absl").addHandler(handler)
    edit, params = structure(given, truth.drive), unknown(given, truth.drive)
    residual = residual_of(edit, *measured)
    with contextlib.redirect_stdout(io.StringIO()):
        found, result = sysid.optimize(params, residual, **_OPTIONS)
    left, _, _ = residual(result.x, found)
    _, widths = sysid.calculate_intervals(left, result.jac)
    seconds = process_time() - before
    logging.getLogger("absl").removeHandler(handler)
    after, _, _ = residual_of(edit, *fresh)(result.x, found)
    numbers = dict(zip(found.get_non_frozen_parameter_names(), zip(result.x, widths, strict=True), strict=True))
    after = np.concatenate([part.reshape(-1, 3) for part in after])
    row = {"by": "mujoco.sysid", "given": given, "answer": messages.getvalue().strip(), "seconds": seconds}
    return row | {"left_mm": rms(np.concatenate(left))} | counted(truth, numbers), after


def by_us(truth, measured, fresh):
    """The result of the diagnosis, and errors (n, 3) of its corrected file on a new campaign, NaN without one."""
    frame, before = measured[0], process_time()
    config = yaml.safe_load((ROOT / "config.yaml").read_text())
    known = MeasuredRobot(setup.measured_robot(NOMINAL, frame), _MASSES, NOISE_MM, "arm6")
    result = diagnose(frame, known, GapSettings.from_config(config["gap"], config["seed"]))
    seconds, numbers = process_time() - before, {}
    stems = {"backlash": "play", "drive_compliance": "soft_servo", "calibration": "zero"}
    for row in result.tables["gap_parameters"].itertuples():
        if (kind := stems.get(row.effect)) and np.isfinite(row.standard_error):
            axis = row.parameter[1:] if kind == "zero" else f"axis{row.parameter[-1]}"
            value, error = np.array([row.value, row.standard_error]) / UNIT[kind]
            numbers[f"{kind} {axis}"] = value, _SIGMAS * error
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "corrected.xml"
        write_corrected(result, NOMINAL["dimensions"], _MASSES, file)
        nominal = known.mechanism, np.zeros(len(known.mechanism.parameters))
        points = errors(fresh[0], NOMINAL, _MASSES, nominal, file)
    points = fresh[0][["run", "point"]].merge(points[points["model"] == "corrected"], how="left", on=["run", "point"])
    verdict = result.verdict
    answer = f"{verdict['effects']} {verdict['probability']:.2f}"
    if verdict["confounded_with"]:
        answer += f" or {verdict['confounded_with']}"
    shrink = result.tables["gap_shrink"].query("trajectory == '*'").iloc[-1]
    row = {"by": "rrru", "given": "nothing", "answer": answer, "seconds": seconds, "left_mm": shrink["rms_mm"]}
    return row | counted(truth, numbers), rows.vectors(points, "error")


def counted(truth, numbers):
    """Coverage of the true numbers by estimates (value, half width of the 95 % interval) by `kind axis`."""
    true = {f"zero {axis}": size for axis, size in zip(AXES, truth.zeros, strict=True)}
    true[f"{truth.cause} {truth.drive}"] = truth.size
    known = {name: pair for name, pair in numbers.items() if name in true and 0.0 < pair[1] < np.inf}
    held = {name: abs(value - true[name]) <= width for name, (value, width) in known.items()}
    zeros = [inside for name, inside in held.items() if name.startswith("zero")]
    cause = f"{truth.cause} {truth.drive}"
    off = (known[cause][0] - truth.size) / known[cause][1] * _SIGMAS if cause in known else np.nan
    counts = {"numbers": int(cause in held), "held": int(held.get(cause, False)), "off_sigmas": off}
    return counts | {"zeros": len(zeros), "zeros_held": int(sum(zeros))}


def rms(left):
    """Root of the mean square of distances, of residuals in mm in any order."""
    return float(np.sqrt(3.0 * np.mean(np.ravel(left) ** 2)))


def rows_of(seed):
    """Rows of the table of one robot."""
    truth = draw(seed)
    measured = campaign(truth, seed, trajectories(580.0, 850.0), PASSES, "measured")
    fresh = campaign(truth, seed, trajectories(520.0, 900.0), [{"payload_kg": 2.0}, {"reverse": True}], "fresh")
    other = "play" if truth.cause == "soft_servo" else "soft_servo"
    structures = [truth.cause, other] if seed < WRONG else [truth.cause]
    found = [by_us(truth, measured, fresh)] + [by_sysid(truth, given, measured, fresh) for given in structures]
    # points with a prediction by all models
    used = np.isfinite([after for _, after in found]).all(axis=(0, 2))
    shared = {"robot": seed, "cause": truth.cause, "points": len(measured[0]), "noise_mm": np.sqrt(3.0) * NOISE_MM}
    return [shared | row | {"fresh_mm": rms(after[used])} for row, after in found]


def timing_rows(frame):
    """Rows of `benchmarks`: seconds of both for the same robots, `mujoco.sysid` with the correct structure."""
    fitted = frame[(frame["by"] == "rrru") | (frame["given"] == frame["cause"])]
    rows = []
    for cause, runs in fitted.groupby("cause"):
        ours, theirs = (runs[runs["by"] == by].set_index("robot")["seconds"] for by in (harness.OURS, "mujoco.sysid"))
        task = harness.Task("sysid", f"numbers of a MuJoCo arm, {cause}", int(runs["points"].max()))
        note = "cause given, fits parameters; rrru finds both"
        rows.append(task.row(harness.OURS, ours.median(), [1.0]))
        rows.append(task.row("mujoco.sysid", theirs.median(), (theirs / ours).to_numpy(), note=note))
    return rows


def main():
    """Write the table and print it; the seconds are also rows of `benchmarks`."""
    result = []
    for seed in range(ROBOTS):
        result += rows_of(seed)
        frame = pd.DataFrame(result)
        OUT.parent.mkdir(parents=True, exist_ok=True)
        tables.write(TABLE, frame, OUT)
        print(frame[frame["robot"] == seed].T.to_string(), flush=True)
    harness.store("sysid", timing_rows(frame))


if __name__ == "__main__":
    main()
