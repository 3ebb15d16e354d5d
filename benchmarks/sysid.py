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
from pathlib import Path
from time import process_time

import mujoco
import numpy as np
import pandas as pd
import yaml
from mujoco import sysid

from benchmarks import harness
from benchmarks.recorded import (
    AXES,
    FILE,
    NOISE_MM,
    NOMINAL,
    PASSES,
    PLATFORM,
    ROOT,
    UNIT,
    campaign,
    draw,
    trajectories,
)
from benchmarks.sysid_table import TABLE, timing_rows
from rrru.campaign import measurements as rows
from rrru.diagnosis.correction.corrected_model import write_corrected
from rrru.diagnosis.diagnose import MeasuredRobot, diagnose
from rrru.diagnosis.settings import GapSettings
from rrru.kinematics.dynamics import Masses
from rrru.pipeline import setup
from rrru.simulation import mujoco_causes, mujoco_model
from rrru.store import tables
from rrru.studies.end_to_end.models import errors

# seeds from 0 on; the first few are also fitted in the other structure
ROBOTS, WRONG, OUT = 6, 2, ROOT / "results/tables/sysid.parquet"
_MASSES = Masses(0.0, 0.0, 0.0)
# in the parameters' units: steps of the finite differences, and tolerances of a fit; the default of 1e-8 is below the
# noise of a simulation with creeping friction
_OPTIONS = {"eps": 1e-3, "xtol": 1e-4, "gtol": 1e-4, "max_iters": 10, "x_scale": "jac"}
_SIGMAS = 1.96
_START = {"zero": 0.0, "soft_servo": 0.1, "play": 0.2}
_BOUNDS = {"zero": (-20.0, 20.0), "soft_servo": (0.005, 50.0), "play": (0.0, 5.0)}


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
