"""Paper B before its experiments: kinematics, singularities, backlash (Tables 2 and 4 to 6). Lengths in mm."""

from dataclasses import replace

import numpy as np
import pandas as pd

from rrru.campaign import measurements as rows
from rrru.campaign.measurements import vector_columns
from rrru.compensation.backlash import measured_width, repeatability
from rrru.kinematics import workspace
from rrru.pipeline import setup
from rrru.seeds import stream
from rrru.simulation.screw import ScrewBench, encoder_record
from rrru.studies.ptt3.experiments import experiment, nominal

_LEGS = (1, 2, 3)
_GRID_STEP_MM = 6.0


def kinematics(settings):
    """Rows of `ptt_kinematics`: the configured positions through inverse and forward kinematics, and det J there.

    Raises UnreachableError for a position out of reach.
    """
    mechanism, position = setup.mechanism(nominal(settings)), np.array(settings["ptt"]["positions_mm"], dtype=float)
    slider = mechanism.require_reachable(position)
    back = mechanism.forward(slider)
    return pd.DataFrame(
        {
            "position": np.arange(1, len(position) + 1),
            **vector_columns("given", position),
            **{f"slider{leg}_mm": slider[:, leg - 1] for leg in _LEGS},
            **vector_columns("forward", back),
            "difference_mm": np.linalg.norm(back - position, axis=1),
            "determinant": np.linalg.det(mechanism.jacobian(position, slider)),
            **_factors(mechanism, position),
        }
    )


def _factors(mechanism, position):
    """The determinant from its factors, and the factors, as columns; null where the rails are inclined."""
    names = ("factored_determinant", "height_factor_mm", "kappa_mm2", "least_d_mm")
    if mechanism.rail_inclination_rad:
        return dict.fromkeys(names, np.full(len(position), np.nan))
    height, kappa, d = mechanism.determinant_factors(position)
    with np.errstate(invalid="ignore", divide="ignore"):
        determinant = -height * kappa / d.prod(axis=1)
    return dict(zip(names, (determinant, height, kappa, d.min(axis=1)), strict=True))


def singularity(settings):
    """Rows of `ptt_singularity`: both measures and det J, upright (y = 0) and level at half the curve's height."""
    mechanism, section = setup.mechanism(nominal(settings)), settings["ptt"]["curve"]
    reach = mechanism.L_mm
    frames = []
    for plane, at, vertical in (("xz", 0.0, (-reach, 0.0)), ("xy", float(np.mean(section["z_mm"])), (-reach, reach))):
        points = workspace.slice_points(plane, at, (-reach, reach), vertical, _GRID_STEP_MM)
        reachable, translational, constraint, _ = workspace.measures(mechanism, points, mechanism.planned(points))
        slider = mechanism.inverse(points)
        determinant = np.full(len(points), np.nan)
        determinant[reachable] = np.linalg.det(mechanism.jacobian(points[reachable], slider[reachable]))
        frames.append(
            pd.DataFrame(
                {
                    "slice": plane,
                    **dict(zip(("x_mm", "y_mm", "z_mm"), points.T, strict=True)),
                    "reachable": reachable,
                    "translational_measure": translational,
                    "constraint_measure": constraint,
                    "determinant": determinant,
                    **{name: np.where(reachable, value, np.nan) for name, value in _factors(mechanism, points).items()},
                }
            )
        )
    return pd.concat(frames, ignore_index=True)


def backlash(settings):
    """Rows of `ptt_encoder` and of `ptt_backlash`: every screw under every load, and its backlash by eq. (19)."""
    section, seed = settings["ptt"], settings["seed"]
    robot = experiment(settings, next(iter(section["experiments"]))).campaign.robot
    bench = ScrewBench(**{key: value for key, value in section["bench"].items() if key != "range_mm"})
    truth = section["robot"]["effects"].get("backlash", {})
    place = (0.0, 0.0, float(np.mean(section["curve"]["z_mm"])))
    records, widths = [], []
    for load in sorted({entry["payload_kg"] for entry in section["experiments"].values()}):
        for leg in _LEGS:
            record = encoder_record(robot, leg, load, bench, place, stream(seed, "ptt", "bench", load, leg))
            width = measured_width(record, bench.lead_mm)
            label = {"payload_kg": load, "leg": leg}
            records.append(record.assign(sample=np.arange(1, len(record) + 1), **label))
            label["true_mm"] = float(truth.get(f"width{leg}", 0.0))
            widths.append(label | {name.replace("mean", "backlash"): value for name, value in vars(width).items()})
    return pd.concat(records, ignore_index=True), pd.DataFrame(widths)


def widths_mm(backlash, payload_kg):
    """Measured backlash (3,) in mm under one load, from rows of `ptt_backlash`."""
    return backlash[backlash["payload_kg"] == payload_kg].sort_values("leg")["backlash_mm"].to_numpy()


def repeatabilities(settings, backlash):
    """Rows of `ptt_repeatability`: the sliders' scatter per unit travel without and with compensated backlash (eq. 20).

    # ASSUME Fig. 8 is lost: the curve is passed forwards and backwards in turn, the same places are compared, and the
    sliders' positions E_k come from the tracker's F_k through the nominal inverse kinematics.
    """
    section = settings["ptt"]
    name, entry = next(iter(section["experiments"].items()))
    frames = []
    for compensate in (False, True):
        bench_experiment = experiment(settings, name, widths_mm(backlash, entry["payload_kg"]), compensate)
        directions = [k % 2 == 1 for k in range(bench_experiment.repeats)]
        plan = bench_experiment.plan(reverse=directions)
        measured, _ = replace(bench_experiment.campaign, plan=plan).run(label="repeatability")
        position = rows.measured(measured).reshape(bench_experiment.repeats, -1, 3)
        position[1::2] = position[1::2, ::-1]
        values = bench_experiment.model.inverse(position.reshape(-1, 3)).reshape(position.shape)
        scatter, travel = repeatability(values)
        noise = section["noise_mm"] * np.sqrt(
            (bench_experiment.model.jacobian(position[0], values[0]) ** 2).sum(axis=2).mean(axis=0)
        )
        columns = {
            "leg": _LEGS,
            "travel_mm": travel,
            "scatter_mm": scatter,
            "per_travel_um_per_mm": 1e3 * scatter / travel,
            "noise_um_per_mm": 1e3 * noise / travel,
        }
        frames.append(pd.DataFrame(columns).assign(compensated=compensate))
    return pd.concat(frames, ignore_index=True)
