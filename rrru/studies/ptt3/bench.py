"""What paper B does before its experiments: kinematics checked, singularities mapped, backlash measured (Tables 2 and 4
to 6). Lengths in mm.
"""

import numpy as np
import pandas as pd

from rrru.campaign import measurements as rows
from rrru.compensate.backlash import measured_width, repeatability
from rrru.plant.screw import encoder_record
from rrru.robots import workspace
from rrru.seeds import stream
from rrru.studies.ptt3 import experiments as robot

_LEGS = (1, 2, 3)
_GRID_STEP_MM = 6.0


def kinematics(config):
    """Rows of `ptt_kinematics`: every configured position through inverse and forward kinematics, with det J directly
    and by its factors.

    Raises UnreachableError for a position out of reach.
    """
    mechanism, position = robot.mechanism(config), np.array(config["ptt"]["positions_mm"], dtype=float)
    slider = mechanism.require_reachable(position)
    back = mechanism.forward(slider)
    return pd.DataFrame(
        {
            "position": np.arange(1, len(position) + 1),
            **{f"given_{axis}_mm": position[:, k] for k, axis in enumerate("xyz")},
            **{f"slider{leg}_mm": slider[:, leg - 1] for leg in _LEGS},
            **{f"forward_{axis}_mm": back[:, k] for k, axis in enumerate("xyz")},
            "difference_mm": np.linalg.norm(back - position, axis=1),
            "determinant": np.linalg.det(mechanism.jacobian(position, slider)),
            **_factors(mechanism, position),
        }
    )


def _factors(mechanism, position):
    """The determinant by its factors, and these, as columns; null where the rails are inclined."""
    if mechanism.rail_inclination_rad:
        return dict.fromkeys(
            ("factored_determinant", "height_factor_mm", "kappa_mm2", "least_d_mm"), np.full(len(position), np.nan)
        )
    height, kappa, d = mechanism.determinant_factors(position)
    with np.errstate(invalid="ignore", divide="ignore"):
        determinant = -height * kappa / d.prod(axis=1)
    return {
        "factored_determinant": determinant,
        "height_factor_mm": height,
        "kappa_mm2": kappa,
        "least_d_mm": d.min(axis=1),
    }


def singularity(config):
    """Rows of `ptt_singularity`: both measures and det J over an upright slice (y = 0) and a level one at half the
    curve's height.
    """
    mechanism, section = robot.mechanism(config), config["ptt"]["curve"]
    reach = mechanism.L_mm
    frames = []
    for plane, at, vertical in (("xz", 0.0, (-reach, 0.0)), ("xy", float(np.mean(section["z_mm"])), (-reach, reach))):
        points = workspace.slice_points(plane, at, (-reach, reach), vertical, _GRID_STEP_MM)
        reachable, translational, constraint, _ = workspace.measures(mechanism, points)
        slider = mechanism.inverse(points)
        determinant = np.full(len(points), np.nan)
        determinant[reachable] = np.linalg.det(mechanism.jacobian(points[reachable], slider[reachable]))
        frames.append(
            pd.DataFrame(
                {
                    "slice": plane,
                    **{f"{axis}_mm": points[:, k] for k, axis in enumerate("xyz")},
                    "reachable": reachable,
                    "translational_measure": translational,
                    "constraint_measure": constraint,
                    "determinant": determinant,
                    **{name: np.where(reachable, value, np.nan) for name, value in _factors(mechanism, points).items()},
                }
            )
        )
    return pd.concat(frames, ignore_index=True)


def payloads(config):
    """The experiments' payloads in kg, each once, in order."""
    return sorted({section["payload_kg"] for section in config["ptt"]["experiments"].values()})


def backlash(config):
    """Rows of `ptt_encoder` and of `ptt_backlash`: every screw under every load on the bench, and its backlash by eq.
    (19).
    """
    plant, bench = robot.robot(config), robot.bench(config)
    truth = config["ptt"]["robot"]["effects"].get("backlash", {})
    place = (0.0, 0.0, float(np.mean(config["ptt"]["curve"]["z_mm"])))
    records, widths = [], []
    for load in payloads(config):
        for leg in _LEGS:
            record = encoder_record(plant, leg, load, bench, place, stream(config["seed"], "ptt", "bench", load, leg))
            width = measured_width(record, bench.lead_mm)
            label = {"payload_kg": load, "leg": leg}
            records.append(record.assign(sample=np.arange(1, len(record) + 1), **label))
            widths.append(
                label
                | {
                    "backlash_mm": width.mean_mm,
                    "first_mm": width.first_mm,
                    "second_mm": width.second_mm,
                    "standard_error_mm": width.standard_error_mm,
                    "true_mm": float(truth.get(f"width{leg}", 0.0)),
                }
            )
    return pd.concat(records, ignore_index=True), pd.DataFrame(widths)


def widths_mm(backlash, payload_kg):
    """Measured backlash (3,) in mm under one load, from rows of `ptt_backlash`."""
    chosen = backlash[backlash["payload_kg"] == payload_kg].sort_values("leg")
    return chosen["backlash_mm"].to_numpy()


def repeatabilities(config, backlash):
    """Rows of `ptt_repeatability`: scatter of the sliders per unit travel without and with compensated backlash (eq.
    20).

    # ASSUME Fig. 8 is lost: the curve is passed forwards and backwards in turn, the same places are compared, and the
    sliders' positions E_k come from the tracker's F_k through the nominal inverse kinematics.
    """
    first = next(iter(config["ptt"]["experiments"]))
    frames = []
    for compensate in (False, True):
        one = robot.experiment(config, first, compensate=compensate)
        plan = robot.plan(config, one.payload_kg, reverse=(False, True))
        measured = one.run(widths_mm(backlash, one.payload_kg), one.generator("repeatability"), plan=plan)
        position = rows.measured(measured).reshape(len(plan.runs), -1, 3)
        position[1::2] = position[1::2, ::-1]
        values = one.robot.mechanism.inverse(position.reshape(-1, 3)).reshape(position.shape)
        scatter, travel = repeatability(values)
        noise = one.noise_mm * np.sqrt(
            (one.robot.mechanism.jacobian(position[0], values[0]) ** 2).sum(axis=2).mean(axis=0)
        )
        frames.append(
            pd.DataFrame(
                {
                    "leg": _LEGS,
                    "compensated": compensate,
                    "travel_mm": travel,
                    "scatter_mm": scatter,
                    "per_travel_um_per_mm": 1e3 * scatter / travel,
                    "noise_um_per_mm": 1e3 * noise / travel,
                }
            )
        )
    return pd.concat(frames, ignore_index=True)
