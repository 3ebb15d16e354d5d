"""Result tables of a made-up campaign, small but shaped as real ones, for drawing figures without computing
anything.
"""

import numpy as np
import pandas as pd

from rrru.studies.rrru3.sweep_match import sweep_match
from tests.schemas import TABLES, check, filled

CAMPAIGN = "made_up"
OPTIONS = {
    "campaign": CAMPAIGN,
    "z_down": True,
    "drives": ("leg 1", "leg 2", "leg 3"),
    "drive_noun": "leg",
    "sweep_campaign": CAMPAIGN,
    "sweep_calibration": "lines",
    "sweep_operators": "matlab_gaussian",
    "calibration_lines": "lines",
    "calibration_spiral": "spiral",
    "method": "least_mean_distance",
    "mode": "closed_loop",
}
SETS = ("group_1", "lines", "spiral", "both")
PARAMETERS = ("dtheta1", "dtheta2", "dtheta3", "dL1", "dL2", "dL3", "da")
OPTIMUM_MM = 0.46
LINES_AND_SPIRAL = (*(f"line_{k}" for k in range(1, 8)), "spiral")
# paper A, Table 4
P_M = (0.5115, 0.5114, 0.5113, 0.5113, 0.5114, 0.5113, 0.5112, 0.5114, 0.5113, 0.5113)
_AXES = ("x", "y", "z")


def commanded(names=LINES_AND_SPIRAL, points=9, passes=1):
    """Commanded points per run: trajectory, run, point and position; every second pass goes backwards."""
    frames, run = [], 0
    for _pass in range(passes):
        for k, name in enumerate(names):
            share = np.linspace(0.0, 1.0, points)
            if "spiral" in name:
                angle, radius = 6.0 * np.pi * share, 60.0 + 140.0 * share
                place = np.column_stack(
                    [-400.0 + radius * np.cos(angle), radius * np.sin(angle), 600.0 + 150.0 * share]
                )
            else:
                place = np.column_stack([-800.0 + 500.0 * share, np.full(points, 37.5 * k), np.full(points, 600.0)])
            run += 1
            frames.append(_run(run, name, place[::-1] if _pass % 2 else place))
    return pd.concat(frames, ignore_index=True)


def _run(run, name, place):
    frame = pd.DataFrame(place, columns=[f"command_{axis}_mm" for axis in _AXES])
    return frame.assign(run=run, trajectory=name, point=np.arange(1, len(frame) + 1))


def paths(ground):
    """`measurements` of the campaign; the lines' first points lie near a singularity."""
    near = (ground["command_x_mm"] < -700.0).map({True: "near_singularity", False: "ok"})
    measured = {f"measured_{axis}_mm": ground[f"command_{axis}_mm"] + 1.0 for axis in _AXES}
    return filled("measurements", ground.assign(**measured, payload_kg=0.0, status=near))


def errors(ground, modes=("model", "closed_loop")):
    """`errors` before and under every calibration; the second point of each run has none."""
    generator = np.random.default_rng(1)
    frames = []
    cases = [
        ("none", "none", "before", 5.0),
        *((s, OPTIONS["method"], mode, 0.4 + 0.2 * k) for k, s in enumerate(SETS) for mode in modes),
    ]
    for calibration, method, mode, size in cases:
        vector = size * (
            generator.normal(0.0, 0.4, (len(ground), 3)) + np.array([-0.4, 0.1, -0.6]) * (mode == "before")
        )
        vector[ground["point"] == 2] = np.nan
        frames.append(
            ground[["run", "trajectory", "point"]].assign(
                campaign=CAMPAIGN,
                calibration=calibration,
                method=method,
                mode=mode,
                error_mm=np.linalg.norm(vector, axis=1),
                **{f"error_{axis}_mm": vector[:, k] for k, axis in enumerate(_AXES)},
            )
        )
    return check("errors", pd.concat(frames, ignore_index=True))


def error_summary(error_rows):
    """`error_summary` of rows of `errors`."""
    groups = {name: [name] for name in error_rows["trajectory"].unique()}
    groups |= {"all_lines": [name for name in groups if name.startswith("line_")], "all": list(groups)}
    rows = []
    for key, part in error_rows.groupby(["campaign", "calibration", "method", "mode"], sort=False):
        for name, members in groups.items():
            size = part.loc[part["trajectory"].isin(members), "error_mm"]
            label = dict(zip(("campaign", "calibration", "method", "mode"), key, strict=True)) | {"trajectory": name}
            numbers = {"mean_mm": size.mean(), "rms_mm": np.sqrt((size**2).mean()), "max_mm": size.max()}
            rows.append(label | {"points": int(size.notna().sum())} | numbers)
    return filled("error_summary", rows)


def redraw_errors(ground):
    """`redraw_errors`: a band of 1 mm about every curve's place."""
    frames = []
    for kind, size in (("none", 5.0), ("line", 0.6), ("spiral", 0.8)):
        ends = {f"error_{axis}_mm_{end}": edge for axis in _AXES for end, edge in (("low", -0.5), ("high", 0.5))}
        ends |= {"error_mm_low": size - 0.5, "error_mm_high": size + 0.5}
        frames.append(ground[["run", "trajectory", "point"]].assign(calibration=kind, **ends))
    return check("redraw_errors", pd.concat(frames, ignore_index=True))


def singularity(path_rows):
    """`singularity` of the commanded points."""
    measure = ((path_rows["command_x_mm"] + 900.0) / 1200.0).clip(0.0, 1.0)
    columns = {"translational_measure": 0.5, "constraint_measure": measure, "constraint_determinant": measure - 0.1}
    return check(
        "singularity", path_rows[["run", "trajectory", "point", "status"]].assign(campaign=CAMPAIGN, **columns)
    )


def workspace():
    """Two slices of a made-up workspace, out of reach beyond a circle."""
    frames = []
    for name, across, up, rest in (("xz", "x", "z", {"y_mm": 0.0}), ("xy", "x", "y", {"z_mm": 600.0})):
        a, b = np.meshgrid(
            np.arange(-1000.0, 1001.0, 50.0),
            np.arange(0.0, 1201.0, 50.0) if up == "z" else np.arange(-1000.0, 1001.0, 50.0),
        )
        frame = pd.DataFrame({f"{across}_mm": a.ravel(), f"{up}_mm": b.ravel()}).assign(
            campaign=CAMPAIGN, slice=name, **rest
        )
        radius = np.hypot(frame[f"{across}_mm"], frame[f"{up}_mm"])
        reach = radius < 1000.0
        determinant = (0.9 - radius / 1000.0).where(reach)
        fields = {
            "translational_measure": (1.0 - radius / 1000.0).where(reach),
            "constraint_measure": determinant.abs(),
        }
        frames.append(frame.assign(reachable=reach, constraint_determinant=determinant, **fields))
    frame = pd.concat(frames, ignore_index=True)
    return check("workspace", frame) if "workspace" in TABLES else frame


def campaigns(z_down=True):
    """The row of `campaigns`, as far as figures read it."""
    return filled("campaigns", [{"campaign": CAMPAIGN, "noise_from": "given", "z_down": z_down}])


def observability(unseen=1):
    """`observability` of every set; the worst `unseen` directions are not seen."""
    count = len(PARAMETERS)
    frames = []
    for k, name in enumerate(SETS):
        directions = np.linalg.qr(np.random.default_rng(k).normal(size=(count, count)))[0]
        value = 10.0 ** -np.arange(count, dtype=float)
        error = np.where(np.arange(count) < count - unseen, 0.02 / value, np.nan)
        frames.append(
            pd.DataFrame(
                {
                    "calibration": name,
                    "direction": np.repeat(np.arange(1, count + 1), count),
                    "singular_value": np.repeat(value, count),
                    "standard_error_mm": np.repeat(error, count),
                    "parameter": np.tile(PARAMETERS, count),
                    "weight": directions.ravel(),
                }
            )
        )
    return check("observability", pd.concat(frames, ignore_index=True).assign(campaign=CAMPAIGN))


def calibrations():
    """`calibrations` with the optimum of every set."""
    labels = {"campaign": CAMPAIGN, "method": OPTIONS["method"], "noise_from": "campaign"}
    return filled("calibrations", [labels | {"calibration": name, "mean_mm": OPTIMUM_MM} for name in SETS])


def genetic(seeds=5):
    """`genetic` and `genetic_history`; the first run ends at the optimum itself, the second starts infeasible."""
    runs, history = [], []
    for name in SETS:
        for seed in range(1, seeds + 1):
            last = 40 + 10 * seed
            generation = np.arange(last + 1)
            best = OPTIMUM_MM + (
                5.0 * np.exp(-generation / (5.0 * seed)) if seed > 1 else np.maximum(0.0, 3.0 - 0.1 * generation)
            )
            if seed == 2:
                best[0] = np.inf
            label = {"campaign": CAMPAIGN, "calibration": name, "seed": seed}
            history.append(pd.DataFrame(label | {"generation": generation, "best_mm": best, "mean_mm": best + 1.0}))
            numbers = {"objective_mm": best[-1], "generations": last, "evaluations": 30 * last, "stopped": "stalled"}
            runs.append(label | numbers | {"optimum_mm": OPTIMUM_MM, "excess": best[-1] / OPTIMUM_MM - 1.0})
    return filled("genetic", runs), check("genetic_history", pd.concat(history, ignore_index=True))


def sweeps(scatter_mm=0.3, seeds=6):
    """`sweep_runs`, `sweep_effect`, `sweep_pairs`, `sweep_match`; one run at 1.0 is infeasible."""
    generator = np.random.default_rng(3)
    runs, effects, pairs = [], [], []
    for parameter in ("crossover_fraction", "migration_fraction"):
        for population in ("one", "islands"):
            label = {"operators": "matlab_gaussian", "stop": "end", "parameter": parameter, "population": population}
            effects.append(label | {"settings": 10, "runs": 10 * seeds, "p_value": 1e-5, "p_value_mutating": 0.3})
            for k, value in enumerate(np.arange(1, 11) / 10.0):
                excess = scatter_mm * generator.gamma(2.0, 1.0, seeds)
                if parameter == "crossover_fraction" and value == 1.0:
                    excess[0] = np.inf
                for seed, one in enumerate(excess, start=1):
                    ended = {"objective_mm": OPTIMUM_MM + one, "stopped": "stalled"}
                    runs.append(label | {"value": value, "seed": seed} | ended)
                if k:
                    pairs.append(label | {"value": value, "p_value": 0.01, "distinguishable": bool(k > 7)})
    frames = {"sweep_runs": runs, "sweep_effect": effects, "sweep_pairs": pairs}
    found = {name: filled(name, rows) for name, rows in frames.items()}
    return found | {"sweep_match": check("sweep_match", sweep_match(found["sweep_runs"]))}


def twin_search():
    """`twin_restarts` and `twin_progress`: four restarts; the first generation of the last cannot be driven."""
    rows = [(0, 24, 120.0), (0, 600, 95.0), (1, 324, 130.0), (1, 900, 94.8), (2, 324, 110.0), (2, 700, 94.9)]
    progress = pd.DataFrame([*rows, (3, 324, 1e6), (3, 400, 99.0)], columns=["restart", "evaluations", "objective_nat"])
    restarts = progress.groupby("restart", as_index=False).last().assign(stopped="stalled", ended="agreed")
    tradeoff = pd.DataFrame(
        [
            (item, weight, other, 0.6 + 0.02 * weight if other == item else 1.0 - 0.03 * weight, 2.0, other == partner)
            for item, partner in (("group1_after_min", "lines_after_min"), ("lines_after_max", "lines_objective"))
            for weight in (1.0, 4.0, 16.0)
            for other in (item, partner)
        ],
        columns=["item", "weight", "other", "ratio", "contribution_nat", "partner"],
    )
    frames = {"twin_progress": progress, "twin_restarts": restarts, "twin_tradeoff": tradeoff}
    return {name: check(name, frame) for name, frame in frames.items()}


def all_tables(ground=None, **choices):
    """Every table that a figure reads, by name."""
    ground = commanded() if ground is None else ground
    path_rows, error_rows = paths(ground), errors(ground, **choices)
    runs, history = genetic()
    return {
        "measurements": path_rows,
        "errors": error_rows,
        "error_summary": error_summary(error_rows),
        "redraw_errors": redraw_errors(ground),
        "singularity": singularity(path_rows),
        "workspace": workspace(),
        "campaigns": campaigns(),
        "observability": observability(),
        "calibrations": calibrations(),
        "genetic": runs,
        "genetic_history": history,
        **sweeps(),
        **twin_search(),
    }
