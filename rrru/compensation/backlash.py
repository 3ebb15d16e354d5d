"""Backlash of screws: measured and compensated, and the repeatability (paper B, 3.1.1). Lengths in mm."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd

from rrru.arrays import FloatArray


@dataclass(frozen=True)
class Width:
    """A screw's backlash: the mean of two differences of directions, these, and its standard error."""

    mean_mm: float
    first_mm: float
    second_mm: float
    standard_error_mm: float


def measured_width(record: pd.DataFrame, lead_mm: float) -> Width:
    """Width from a bench's record (`rrru.simulation.screw.encoder_record`), eq. (19).

    # ASSUME the body of eq. (19) is lost. Our reading: at the same commanded place the carriage is further back by the
    width in the forward passes than in the reverse pass, so that e_1 = mean(y_reverse - y_forward_1), e_2 =
    mean(y_reverse - y_forward_2) over the places of the passes, e = (e_1 + e_2) / 2. Places within one turn of a
    turning point are left out: the screw is within its backlash there.
    """
    place = record["commanded_mm"].round(6)
    places = record.pivot_table(index=place, columns="pass", values="encoder_mm", aggfunc="first").dropna()
    at = places.index.to_numpy()
    inner = places[(at > at.min() + lead_mm) & (at < at.max() - lead_mm)]
    differences = [(inner["reverse"] - inner[name]).to_numpy() for name in ("forward_1", "forward_2")]
    first, second = (float(difference.mean()) for difference in differences)
    mean = 0.5 * (differences[0] + differences[1])
    return Width(0.5 * (first + second), first, second, float(mean.std(ddof=1) / np.sqrt(len(mean))))


def compensated(values_mm: FloatArray, widths_mm: Sequence[float] | FloatArray) -> FloatArray:
    """Drive commands (N, 3) for slider positions (N, 3) in the order driven: ahead by half the backlash.

    The command changes by the whole width at a reversal. A slider at rest keeps the side that it came from; before its
    first move it has the side of that move.
    """
    step = np.sign(np.diff(values_mm, axis=0, prepend=values_mm[:1]))
    result = np.array(values_mm, dtype=float)
    for leg in range(step.shape[1]):
        moving = np.flatnonzero(step[:, leg])
        if len(moving):
            # each row takes the side of the last move before it
            last = np.maximum(np.searchsorted(moving, np.arange(len(step)), side="right") - 1, 0)
            result[:, leg] += 0.5 * widths_mm[leg] * step[moving[last], leg]
    return result


def repeatability(values_mm: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Standard deviations (3,) of slider positions (k repeats, n places, 3) about each place's mean, and travel (3,).

    # ASSUME eq. (20) and Fig. 8 are lost: sigma is the standard deviation over the repeats pooled over the places, K
    the stretch between the slider's outermost places; the paper's measure is their ratio.
    """
    values = np.asarray(values_mm, dtype=float)
    deviation = values - values.mean(axis=0)
    scatter = np.sqrt((deviation**2).sum(axis=(0, 1)) / ((len(values) - 1) * values.shape[1]))
    return scatter, np.ptp(values.mean(axis=0), axis=0)
