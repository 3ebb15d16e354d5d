"""Poses to drive for a diagnosis: short straight passes in the box about all that a campaign has measured.

A pose is passed in the middle of a straight line between rest and rest, since what play, friction and lag do at it
depends on how it is reached. Lengths in mm, speeds in mm/s.
"""

import numpy as np
import pandas as pd

from rrru.campaign import measurements as rows
from rrru.campaign.speed_profile import Trapezoid
from rrru.gap.options import OPTIONS


def passes(measurements, mechanism):
    """Starts and ends (n, 3) of passes that a robot can drive in the box about its measured points.

    They go from one point of the box towards another, both of Sobol's sequence (Joe and Kuo, SIAM J. Sci. Comput. 30,
    2008), and keep clear of singularities. None where the robot orients its platform or reflectors are measured.
    """
    # it takes as long to load as some diagnoses, and few advise poses
    from scipy.stats import qmc

    if mechanism.orients or rows.readings(measurements) is not None:
        return np.zeros((0, 3)), np.zeros((0, 3))
    known = np.unique(rows.command(measurements)[rows.usable(measurements)], axis=0)
    low, high = known.min(axis=0), known.max(axis=0)
    shares = qmc.Sobol(6, scramble=False).random_base2(OPTIONS.tried_passes_log2)
    start, other = low + shares[:, :3] * (high - low), low + shares[:, 3:] * (high - low)
    distance = np.linalg.norm(other - start, axis=1, keepdims=True)
    far = distance[:, 0] > OPTIONS.pass_length_mm
    start = start[far]
    end = start + OPTIONS.pass_length_mm * (other[far] - start) / distance[far]
    fine = _clear(known, points_of(start, end), mechanism)
    return start[fine], end[fine]


def points_of(start_mm, end_mm):
    """Points (n, p, 3) of passes, p of each, from starts to ends (n, 3)."""
    return start_mm[:, None] + np.linspace(0.0, 1.0, OPTIONS.points_per_pass)[:, None] * (end_mm - start_mm)[:, None]


def _clear(known, points, mechanism):
    """Passes (n,) whose points (n, p, 3) are in reach and nearly as far from singularities as known points."""
    flat = points.reshape(-1, 3)
    own, drive = mechanism.inverse(known), mechanism.planned(flat)
    fine = np.isfinite(drive).all(axis=1)
    for measure, limit in zip(_measures(mechanism, flat, drive), _measures(mechanism, known, own), strict=True):
        fine &= measure > OPTIONS.min_singularity_distance_ratio * np.nanmin(limit)
    return fine.reshape(points.shape[:2]).all(axis=1)


def _measures(mechanism, position_mm, drive):
    """Translational and constraint measure (n,) of poses, NaN out of reach."""
    result, fine = np.full((2, len(drive)), np.nan), np.isfinite(drive).all(axis=1)
    result[:, fine] = mechanism.singularities(position_mm[fine], drive[fine])[:2]
    return result


def commands(start_mm, end_mm, mechanism, start_s, speed_mm_s, payload_kg):
    """Table of passes from starts to ends (n, 3), numbered from 1, each a run that begins at one time of a campaign.

    The speed is that in the middle, to which each speeds up evenly; times are NaN where it is.
    """
    points, count = points_of(start_mm, end_mm).reshape(-1, 3), len(start_mm)
    time = np.full(OPTIONS.points_per_pass, np.nan)
    if np.isfinite(speed_mm_s):
        profile = Trapezoid(OPTIONS.pass_length_mm, speed_mm_s, speed_mm_s**2 / OPTIONS.pass_length_mm)
        time = start_s + profile.time(np.linspace(0.0, OPTIONS.pass_length_mm, OPTIONS.points_per_pass))
    points_of_pass = np.arange(1, OPTIONS.points_per_pass + 1)
    told = {
        "run": np.repeat(np.arange(1, count + 1), len(points_of_pass)),
        "point": np.tile(points_of_pass, count),
    }
    drives = dict(zip(mechanism.parts.columns, mechanism.planned(points).T, strict=True))
    return pd.DataFrame(told).assign(
        trajectory="poses",
        time_s=np.tile(time, count),
        speed_mm_s=speed_mm_s,
        payload_kg=payload_kg,
        status="ok",
        **rows.vector_columns("command", points),
        **rows.vector_columns("measured", points),
        **drives,
    )
