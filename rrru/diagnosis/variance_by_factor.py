"""Variance of the gap by factor: trajectory, region, direction, drive, sense of motion, speed, load and time."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.spatial import cKDTree
from scipy.special import chdtri

from rrru.arrays import FloatArray, IntArray
from rrru.diagnosis.aliases import ObjectArray, Row
from rrru.diagnosis.heldout import resampled_groups, resampled_quantiles, resampled_rows
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.problem import DiagnosisProblem
from rrru.robots.drive_words import drive_words

# regions are cells of the points' box
_CELLS = 3, 3, 2
_COLUMNS = ("factor", "level", "points", "rms_mm", "share", "share_low", "share_high", "share_of_noise", "noise_could")
_MORE_COLUMNS = ("drive_rms_rad", "drive_rms_mm", "x_mm", "y_mm", "z_mm")


def variance_by_factor(
    problem: DiagnosisProblem,
    residual_mm: FloatArray,
    drive: FloatArray,
    generator: np.random.Generator,
    draws: int = 200,
) -> pd.DataFrame:
    """Rows of `gap_locate` without the campaign.

    residual_mm (m, 3): readings minus calibrated model; drive (m, 3, K): derivative by the actuator values. Shares
    are of the mean square of positions on the robot, those of drives of all that was read, with the noise taken off;
    their 95 % intervals come from resampled runs (stretches where there are fewer than ten), see `resampled_quantiles`.
    """
    resampled, ends = resampled_rows(problem, generator, draws), resampled_quantiles(resampled_groups(problem))
    components = np.where(problem.on_robot[:, None], residual_mm**2, 0.0)
    whole = _Whole(components.sum(axis=1), 3.0 * problem.on_robot.astype(float), problem.noise_mm**2, resampled, ends)
    rows = []
    for name, levels in _levels(problem).items():
        for level in pd.unique(levels[(levels != "") & problem.on_robot]):
            chosen = (levels == level) & problem.on_robot
            rows.append(whole.row(name.split()[0], level, np.where(chosen, whole.squares, 0.0), 3.0 * chosen))
            if name == "region":
                centre = problem.motion.position_mm[problem.at][chosen].mean(axis=0)
                rows[-1] |= dict(zip(("x_mm", "y_mm", "z_mm"), centre.tolist(), strict=True))
    freedom = problem.on_robot.astype(float)
    rows.extend(whole.row("direction", axis, components[:, k], freedom) for k, axis in enumerate("xyz"))
    rows.extend(_drive_rows(problem, residual_mm, drive, (resampled, ends)))
    return pd.DataFrame(rows).reindex(columns=[*_COLUMNS, *_MORE_COLUMNS])


def worst_spot(position_mm: FloatArray, residual_mm: FloatArray) -> FloatArray:
    """Point (3,) of the n points around which the residual's mean square over its neighbours is largest."""
    count = min(OPTIONS.worst_spot_neighbours, len(position_mm))
    _, near = cKDTree(position_mm).query(position_mm, k=count)
    squares = (residual_mm**2).sum(axis=1)
    return np.asarray(position_mm[int(squares[near.reshape(len(position_mm), count)].mean(axis=1).argmax())])


def drive_errors(residual_mm: FloatArray, drive: FloatArray) -> FloatArray:
    """Errors (n, K) of the actuator values that would make residuals (n, k), the smallest where K is above k.

    drive (n, k, K): derivative of what was read by the actuator values.
    """
    return (np.linalg.pinv(drive) @ residual_mm[..., None])[..., 0]


@dataclass(frozen=True)
class _Whole:
    """Sums of squares (n,) of so many components (n,), the variance of a component's noise, resampled rows (draws, n),
    and the quantiles of their statistics at the ends of a 95 % interval.
    """

    squares: FloatArray
    freedom: FloatArray
    variance: float
    resampled: IntArray
    ends: tuple[float, float]

    def row(self, factor: str, level: str, part: FloatArray, freedom: FloatArray) -> Row:
        """One row: share of a part (n,) of the squares, of so many components (n,)."""
        excess, total = part - freedom * self.variance, self.squares - self.freedom * self.variance
        drawn_total = total[self.resampled].sum(axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            drawn = np.where(drawn_total > 0.0, excess[self.resampled].sum(axis=1) / drawn_total, 0.0)
        share = excess.sum() / total.sum() if total.sum() > 0.0 else 0.0
        low, high = np.quantile(np.clip(drawn, 0.0, 1.0), self.ends)
        share = float(np.clip(share, 0.0, 1.0))
        count = int((freedom > 0.0).sum())
        return {
            "factor": factor,
            "level": str(level),
            "points": count,
            "rms_mm": float(np.sqrt(part.sum() / max(count, 1))),
            "share": share,
            "share_low": float(min(low, share)),
            "share_high": float(max(high, share)),
            "share_of_noise": float(freedom.sum() / self.freedom.sum()),
            "noise_could": bool(part.sum() / self.variance < chdtri(freedom.sum(), OPTIONS.min_noise_p_value)),
        }


def _levels(problem: DiagnosisProblem) -> dict[str, ObjectArray]:
    """Level (n,) of each point by factor; an empty text where it is unknown."""
    frame, position, rate = (
        problem.points,
        problem.motion.position_mm[problem.at],
        problem.motion.drive_rate[problem.at],
    )
    result = {"trajectory": frame["trajectory"].to_numpy(dtype=object), "region": _cells(position)}
    for name, column, unit in (("speed", "speed_mm_s", "mm/s"), ("payload", "payload_kg", "kg")):
        values = frame[column].to_numpy(dtype=float)
        if len(pd.unique(values[np.isfinite(values)])) <= OPTIONS.max_factor_levels:
            result[name] = np.array([f"{v:g} {unit}" if np.isfinite(v) else "" for v in values], dtype=object)
    time = frame["time_s"].to_numpy(dtype=float)
    if np.isfinite(time).any():
        edges = np.nanquantile(time, [0.25, 0.5, 0.75])
        quarter = np.char.add("quarter ", (np.searchsorted(edges, time, side="right") + 1).astype(str))
        result["time"] = np.where(np.isfinite(time), quarter, "").astype(object)
    if np.isfinite(rate).any():
        for k, name in enumerate(drive_words(problem.mechanism).all_names):
            backwards = np.where(rate[:, k] < -OPTIONS.min_drive_rate, "falling", "at rest")
            sense = np.where(rate[:, k] > OPTIONS.min_drive_rate, "rising", backwards)
            named = np.char.add(f"{name} ", sense)
            result[f"motion_direction {k + 1}"] = np.where(np.isfinite(rate[:, k]), named, "").astype(object)
    return result


def _cells(position: FloatArray) -> ObjectArray:
    """Name (n,) of the cell of the points' box that each point lies in."""
    low, size = position.min(axis=0), np.maximum(np.ptp(position, axis=0), 1e-9)
    index = np.minimum((position - low) / size * _CELLS, np.array(_CELLS) - 1).astype(int)
    return np.array([f"x{i + 1} y{j + 1} z{k + 1}" for i, j, k in index], dtype=object)


def _drive_rows(
    problem: DiagnosisProblem,
    residual_mm: FloatArray,
    drive: FloatArray,
    draws: tuple[IntArray, tuple[float, float]],
) -> list[Row]:
    """Rows of the factor drive: shares of the squared errors of the drives; draws: resampled rows, quantiles."""
    resampled, ends = draws
    residual_mm, drive = problem.by_point(residual_mm), problem.by_point(drive)
    errors, number = drive_errors(residual_mm, drive), np.flatnonzero(problem.used)
    resampled = np.searchsorted(number, problem.at[resampled])
    # in units of each drive's own noise, so that poses of a large Jacobian do not dominate
    noise = problem.noise_mm**2 * (np.linalg.pinv(drive) ** 2).sum(axis=-1)
    # a drive of another arm than the one that is read moves nothing; no drive moves a target fixed to the world
    scaled = np.divide(errors**2, noise, out=np.zeros_like(noise), where=noise > 0.0)
    moving = (noise > 0.0).astype(float)
    whole, rows = _Whole(scaled.sum(axis=1), moving.sum(axis=1), 1.0, resampled, ends), []
    names = drive_words(problem.mechanism).all_names
    for k, (name, unit) in enumerate(zip(names, problem.mechanism.parts.units, strict=True)):
        moved = np.linalg.norm(drive[:, :3, k] * errors[:, k, None], axis=1)
        row = whole.row("drive", name, scaled[:, k], moving[:, k])
        row["rms_mm"] = float(np.sqrt((moved**2).mean()))
        row[f"drive_rms_{unit}"] = float(np.sqrt((errors[:, k] ** 2).mean()))
        rows.append(row)
    return rows
