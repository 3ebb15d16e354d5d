"""The truth about an own robot with a page. No other code here knows both draw and diagnosis.

Sizes are errors of exact positions: those of the plant compared with the calibrated or corrected model of the diagnosis
at the same stops. These are the stops of the file and fresh ones that no file has. mm, rad, kg.

Robots' files are read again by other code than the package's: a URDF by its tags, an MJCF by MuJoCo. Loops of an MJCF
are closed by Newton's method on MuJoCo's own constraint Jacobian, at given actuator positions.
"""

from dataclasses import dataclass, field, replace
from xml.etree import ElementTree

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from rrru.campaign import measurements as rows
from rrru.diagnosis.calibrate import calibrate
from rrru.diagnosis.make_problem import make_diagnosis_problem
from rrru.diagnosis.state import ModelState
from rrru.studies.blind_validation.sentences import page
from rrru.studies.blind_validation.sentences.causes import Stops
from rrru.studies.blind_validation.sentences.own_robots import file_scale

_ALL = "all.csv"
_DIGIT_MM = 1e-5
# distance from which a drive approaches, in mm and rad
_APPROACH = {"rad": 0.05, "mm": 20.0}
_MM = 1000.0
_NEWTON_STEPS, _CLOSED_M = 40, 1e-10


@dataclass(frozen=True)
class Truth:
    """Truth about a robot and its page.

    effects: names of acting effects of the library; outside: a cause outside the library acts; leg: number of the
    single drive, or 0; strength: residual rms of the cause after a calibration of exact readings, over the noise rms;
    chi2: the same as a chi-square of the file's readings; numbers: true values by effect and parameter; geometry:
    values of the calibration's parameters from exact readings without a cause; zeros: of the drives by site; before_mm,
    after_mm: rms at fresh stops of the calibrated and of the corrected model; before_error_mm2, after_error_mm2:
    standard errors of their squares, from the sample of these stops; seen_mm: of the calibrated one at the file's rows;
    still_mm: residual rms of a calibration of exact readings without a cause; rows, stops: numbers in the file; again:
    stops were measured twice; payloads: number of different ones; turned: orientations were measured;
    error_mm, position_mm (rows, 3): exact errors of the calibrated model and their positions; payload_kg (rows,);
    places: of the targets by name; given_mm, file_mm: rms at fresh stops of the robot's file as given and as corrected,
    NaN where that is not known; given_read_mm, file_read_mm: the same at the file's readings; drives_mm: rms distance
    of the robot from the targets of `corrected_drives`.
    """

    effects: frozenset
    outside: bool
    leg: int
    strength: float
    chi2: float
    numbers: dict
    geometry: dict
    zeros: dict
    before_mm: float
    after_mm: float
    seen_mm: float
    still_mm: float
    noise_rms_mm: float
    noise_mm: float
    rows: int
    stops: int
    again: bool
    payloads: int
    turned: bool
    error_mm: np.ndarray
    position_mm: np.ndarray
    payload_kg: np.ndarray
    before_error_mm2: float = 0.0
    after_error_mm2: float = 0.0
    places: dict = field(default_factory=dict)
    given_mm: float = np.nan
    file_mm: float = np.nan
    given_read_mm: float = np.nan
    file_read_mm: float = np.nan
    drives_mm: float = np.nan

    @property
    def acts(self):
        """Whether any cause acts."""
        return bool(self.effects) or self.outside

    @property
    def share(self):
        """The cause's share of the gap at the file's rows: all except the error of the calibration from noise."""
        if not self.acts or not self.seen_mm:
            return 0.0
        return float(min((self.strength * self.noise_rms_mm / self.seen_mm) ** 2, 1.0))


def truth_of(draw, run, folder):
    """The Truth of a Draw whose Run was made in a folder."""
    inference = run.diagnosis.inference
    problem, fresh = inference.problem, np.repeat(draw.stops.fresh, len(draw.targets))
    poses, still = draw.poses(), draw.poses(cause=False) if draw.cause else None
    exact = _as_read(draw, run, draw.readings(poses), folder)
    library = run.library(problem.mechanism)
    # with the effects as fitted: all readings together could allow more orders of a drive error function
    whole = make_diagnosis_problem(
        exact, problem.mechanism, run.masses, draw.noise_mm, library, True, problem.characteristic_length_mm
    )
    whole = replace(whole, library=whole.library | problem.library)
    count = len(exact)
    before = whole.left(ModelState(inference.calibrated.deviations, {}))[:count]
    after = whole.standing(inference.state).left(inference.state)[:count]
    free = exact if still is None else _as_read(draw, run, draw.readings(still), folder)
    geometry, without = _calibrated(draw, run, free[~fresh])
    _, left = _calibrated(draw, run, exact[~fresh]) if still is not None else (None, np.zeros((int((~fresh).sum()), 3)))
    seen, name = before[~fresh], draw.cause.effect if draw.cause else None
    held = name in library
    noise_rms, chosen = float(np.sqrt(3.0) * draw.noise_mm), np.repeat(~draw.stops.fresh, len(draw.targets))
    truth = Truth(
        effects=frozenset([name] if held else []),
        outside=name is not None and not held,
        leg=draw.cause.leg if draw.cause else 0,
        strength=_rms(left) / noise_rms,
        chi2=float((left**2).sum() / draw.noise_mm**2),
        numbers={name: draw.cause.numbers(draw.nominal)} if held else {},
        geometry=dict(zip(problem.mechanism.parameters.names, geometry.tolist(), strict=True)),
        zeros=dict(zip([one.site for one in problem.mechanism.parts.drives], draw.zeros.tolist(), strict=True)),
        before_mm=_rms(before[fresh]),
        after_mm=_rms(after[fresh]),
        seen_mm=_rms(seen),
        still_mm=_rms(without),
        noise_rms_mm=noise_rms,
        noise_mm=draw.noise_mm,
        rows=int((~fresh).sum()),
        stops=int((~draw.stops.fresh).sum()),
        again=_measured_again(draw.stops),
        payloads=len(np.unique(draw.stops.payload_kg[~draw.stops.fresh])),
        turned=draw.reading == "pose",
        error_mm=seen,
        position_mm=rows.command(exact)[chosen],
        payload_kg=exact["payload_kg"].to_numpy()[chosen],
        places=dict(draw.targets),
    )
    errors = [_sampling_error((one[fresh] ** 2).sum(axis=1).reshape(-1, len(draw.targets))) for one in (before, after)]
    sampled = dict(zip(("before_error_mm2", "after_error_mm2"), errors, strict=True))
    return replace(truth, **sampled, **_of_files(draw, run, exact, fresh), drives_mm=_of_drives(draw, run))


def _sampling_error(squares_mm2):
    """Standard error of the mean of squares (stops, targets) of a sample of stops."""
    of_stops = squares_mm2.mean(axis=1)
    return float(of_stops.std(ddof=1) / np.sqrt(len(of_stops)))


def _rms(values):
    """Root of the mean square of distances (n, 3), NaN for none."""
    return float(np.sqrt((np.asarray(values) ** 2).sum(axis=1).mean())) if len(values) else np.nan


def _measured_again(stops):
    """Whether a stop of the file was measured again under the same load."""
    own = np.column_stack([stops.drive, stops.payload_kg])[~stops.fresh]
    return len(np.unique(own, axis=0)) < len(own)


def _as_read(draw, run, readings, folder):
    """Exact readings of all stops as a measurement table, with the frame and the target places of the file's own."""
    # a reader refuses readings that are alike in every digit, as exact ones of one stop are: other last digits
    digits = _DIGIT_MM * np.random.default_rng(0).standard_normal(np.shape(readings[0]))
    table = draw.table((readings[0] + digits, readings[1]), False)
    # fresh stops are between the others in time, and behind them in the file
    exact = page.read(*draw.write(folder, table.assign(time_s=np.arange(len(table), dtype=float)), _ALL)).measurements
    own, (seen, vectors) = run.measurements, readings
    seen = seen @ run.rotation.T + run.translation_mm
    exact = exact.assign(**rows.vector_columns("measured", seen), status="ok")
    exact = exact.assign(time_s=table["time_s"])
    if "measured_rx_rad" in exact:
        turns = run.rotation @ turned(vectors) @ _seat(draw, own, run.rotation)
        exact = exact.assign(**rows.turn_columns("measured", turns))
    if "target" in own:
        first = own.drop_duplicates("target").set_index("target")
        columns = [f"target_{axis}_mm" for axis in "xyz"]
        exact = exact.assign(**{name: first.loc[exact["target"], name].to_numpy() for name in columns})
    return exact


def turned(vectors_rad):
    """Rotations (m, 3, 3) of rotation vectors (m, 3)."""
    return Rotation.from_rotvec(np.array(vectors_rad)).as_matrix()


def _seat(draw, own, rotation):
    """Rotation (3, 3) of the instrument's target on the platform, which reading the file has removed.

    own: the file's measurement table; rotation (3, 3): of the registration.
    """
    noisy = draw.table(draw.readings(draw.poses()), True)[[f"measured_r{axis}_rad" for axis in "xyz"]].to_numpy()
    back = (rotation @ turned(noisy[: len(own)])).transpose(0, 2, 1) @ rows.turns(own, "measured")
    return Rotation.from_matrix(back).mean().as_matrix()


def _calibrated(draw, run, exact):
    """Deviations (p,) of a plain calibration of exact readings, and its position residuals (n, 3)."""
    problem = run.diagnosis.inference.problem
    own = make_diagnosis_problem(
        exact.reset_index(drop=True),
        problem.mechanism,
        run.masses,
        draw.noise_mm,
        {},
        True,
        problem.characteristic_length_mm,
    )
    state = calibrate(own)
    return np.asarray(state.deviations), own.left(state)[: len(exact)]


def _of_files(draw, run, exact, fresh):
    """Errors of the robot's file as given and as corrected, as fields of a Truth."""
    result, written = {}, run.page.corrected
    # without stated places of tool or targets, the tool of a file is arbitrary
    if draw.reading == "found" or (draw.reading == "pose" and draw.registered):
        return result
    files = {"given": written.with_name(draw.robot_file)}
    if not any(text.startswith("not corrected") for text in run.page.not_in_model):
        files["file"] = written
    measured, read = rows.measured(exact), rows.measured(run.measurements)
    right = rows.usable(run.measurements)
    for key, file in files.items():
        loops = draw.kind == "mjcf" and draw.nominal.formats == ("mjcf",)
        joint_effects = {one["name"] for one in run.page.facts["effects"]} & {"drive_compliance", "backlash"}
        if key == "file" and draw.kind == "mjcf" and joint_effects and (loops or _has_play(file)):
            continue
        place, turn, sites = file_poses(file, draw, draw.stops.drive, draw.stops.payload_kg)
        points = measured_points(draw.targets, sites)
        seen = np.stack([place + turn @ point for point in points], axis=1).reshape(-1, 3)
        left = (read - seen[~fresh])[right]
        result |= {f"{key}_mm": _rms((measured - seen)[fresh]), f"{key}_read_mm": _rms(left)}
    return result


def measured_points(targets, sites):
    """Points (3,) on the platform of a file that its sites give for targets, as stated where there is none.

    A corrected MJCF has a site for each reflector, and for the tool where it was found elsewhere than stated.
    """
    names = {name: f"reflector {name}" if name else "measured_tool" for name in targets}
    return [sites.get(names[name], np.array(at)) for name, at in targets.items()]


def _of_drives(draw, run):
    """Rms distance of the robot from the targets of `corrected_drives`, NaN where the frame is not the robot's."""
    table = run.page.tables["corrected_drives"]
    drifts = draw.cause is not None and draw.cause.name == "base_drift"
    if drifts or draw.plant == "mujoco" or draw.registered or draw.reading == "found" or not len(table):
        return np.nan
    columns = [f"corrected_{name}" for name in draw.nominal.columns]
    drive, side = table[columns].to_numpy(), table["approach"].to_numpy()
    before = drive - side[:, None] * np.array([_APPROACH[unit] for unit in draw.nominal.units])
    path = np.stack([before, drive], axis=1).reshape(-1, drive.shape[1])
    twice = {key: np.repeat(table[key].to_numpy(), 2) for key in ("payload_kg", "time_s")}
    stops = Stops(path, twice["payload_kg"], twice["time_s"], np.zeros(len(path), dtype=bool))
    place, _ = draw.poses(stops=stops)
    rotation, shift = draw.frame
    return _rms((place @ rotation.T + shift)[1::2] - rows.command(table))


# --- robots' files read again


def file_poses(file, draw, values, payload_kg):
    """Positions (n, 3), rotations (n, 3, 3) of the platform of a file at actuator positions (n, K), and its sites.

    Sites: places (3,) on the platform by name. The drives of an MJCF without loops deflect by their servo stiffness.
    """
    if draw.kind == "urdf":
        return (*_urdf_poses(file, values), {})
    return _mjcf_poses(file, draw, values, payload_kg)


def _has_play(file):
    """Whether an MJCF has joints that model the backlash of others."""
    model = mujoco.MjModel.from_xml_path(str(file))
    driven = set(model.actuator_trnid[:, 0].tolist())
    names = [model.joint(j).name for j in range(model.njnt) if j not in driven]
    return any(name.endswith("play") or " play" in name for name in names)


def _urdf_poses(file, values):
    """Positions and rotations of the link `tool` of a URDF at drive values of q1, q2, .."""
    joints = {joint.find("child").get("link"): joint for joint in ElementTree.parse(file).getroot().iter("joint")}
    way, link = [], "tool"
    while link in joints and link != "base":
        way.insert(0, joints[link])
        link = joints[link].find("parent").get("link")
    place, turn = np.zeros((len(values), 3)), np.tile(np.eye(3), (len(values), 1, 1))
    for joint in way:
        origin, kind = joint.find("origin"), joint.get("type")
        shift = _numbers(origin, "xyz")
        place = place + _MM * turn @ shift
        turn = turn @ Rotation.from_euler("xyz", _numbers(origin, "rpy")).as_matrix()
        if kind == "fixed":
            continue
        axis = _numbers(joint.find("axis"), "xyz", "1 0 0")
        value = values[:, int(joint.get("name").removeprefix("q")) - 1]
        along = np.outer(value, axis / np.linalg.norm(axis))
        if kind == "prismatic":
            place = place + (turn @ along[:, :, None])[:, :, 0]
        else:
            turn = turn @ Rotation.from_rotvec(along).as_matrix()
    return place, turn


def _numbers(tag, key, default="0 0 0"):
    """Numbers (3,) of an attribute of a tag that may be missing."""
    return np.array((default if tag is None else tag.get(key, default)).split(), dtype=float)


def _mjcf_poses(file, draw, values, payload_kg):
    """Positions and rotations of the platform of an MJCF at drive values, and its sites."""
    model = mujoco.MjModel.from_xml_path(str(file))
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    names = draw.nominal.names
    body = model.body("tool" if "tool" in [model.body(k).name for k in range(model.nbody)] else "plate").id
    scale = np.array([file_scale(unit) for unit in draw.nominal.units])
    joints = [model.joint(name) for name in names]
    address, dof = ([int(getattr(one, key)[0]) for one in joints] for key in ("qposadr", "dofadr"))
    zero, start = model.qpos0[address], data.qpos.copy()
    stiff = np.array([model.actuator_gainprm[_servo(model, one.id), 0] for one in joints])
    places, turns = [], []
    loops = bool(((model.eq_type == mujoco.mjtEq.mjEQ_CONNECT) | (model.eq_type == mujoco.mjtEq.mjEQ_WELD)).any())
    for row, load in zip(values, payload_kg, strict=True):
        data.qpos[:], data.qvel[:] = start, 0.0
        data.qpos[address] = zero + scale * row
        if loops:
            _close(model, data, dof)
        elif np.isfinite(stiff).all():
            mujoco.mj_forward(model, data)
            # at the platform's point, where its centre of mass need not be
            weight = np.zeros(model.nv)
            mujoco.mj_applyFT(model, data, load * model.opt.gravity, np.zeros(3), data.xpos[body], body, weight)
            data.qpos[address] -= (data.qfrc_bias - weight)[dof] / stiff
        mujoco.mj_kinematics(model, data)
        places.append(_MM * data.xpos[body])
        turns.append(data.xmat[body].reshape(3, 3).copy())
    sites = {
        model.site(k).name: _MM * model.site_pos[k] for k in range(model.nsite) if int(model.site_bodyid[k]) == body
    }
    return np.array(places), np.array(turns), sites


def _servo(model, joint):
    """Number of the actuator of a joint."""
    return int(np.flatnonzero(model.actuator_trnid[:, 0] == joint)[0])


def _close(model, data, driven):
    """Close the loops at the actuator positions; NaN in qpos where Newton's method does not converge."""
    free = np.setdiff1d(np.arange(model.nv), driven)
    for _ in range(_NEWTON_STEPS):
        mujoco.mj_fwdPosition(model, data)
        count = data.ne
        off = data.efc_pos[:count]
        if np.abs(off).max() < _CLOSED_M:
            return
        jacobian = data.efc_J.reshape(-1, model.nv)[:count]
        step = np.zeros(model.nv)
        step[free] = -np.linalg.lstsq(jacobian[:, free], off, rcond=None)[0]
        step *= min(1.0, 0.3 / max(np.abs(step).max(), 1e-30))
        mujoco.mj_integratePos(model, data.qpos, step, 1.0)
    data.qpos[:] = np.nan
