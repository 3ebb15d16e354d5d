"""What the model of one series leaves of another one of the same robot, with nothing but the frames fitted anew."""

from dataclasses import replace
from itertools import permutations

import numpy as np
import pandas as pd

from rrru.campaign import measurements as rows
from rrru.gap.diagnose import sim
from rrru.gap.make_case import make_case
from rrru.gap.state import State
from rrru.gap.unknown import UNKNOWN
from rrru.studies.real.arms import NO_MASSES, Studied
from rrru.studies.real.steps import FRAMES, frames, held_out_mm, placed, rms


def carried(series: list[Studied]) -> pd.DataFrame:
    """Rows of `real_carried`: of all pairs of series of one robot, in both directions."""
    pairs = [pair for pair in permutations(series, 2) if pair[0].series.variant == pair[1].series.variant]
    columns = ["campaign", "carried_from", "frames_rms_mm", "geometry_rms_mm", "causes_rms_mm"]
    return pd.DataFrame([_row(*pair) for pair in pairs], columns=columns)


def _row(first: Studied, second: Studied) -> dict:
    """The row of the model of one series on another one."""
    state, geometry = first.state, first.step("b").state.deviations
    known = {name: effect for name, effect in first.case.library.items() if name not in UNKNOWN}
    robot = sim(first.robot)
    arm_mm = second.case.arm_mm if rows.has_turns(second.measurements) else np.nan
    case = make_case(second.measurements, robot, NO_MASSES, second.case.noise_mm, {}, True, arm_mm)
    case = replace(case, library=known | {FRAMES: frames(robot)})
    effects = {key: values for key, values in state.effects.items() if key[0] in known}
    models = {
        "frames_rms_mm": State(0.0 * geometry, {}),
        "geometry_rms_mm": State(geometry, {}),
        "causes_rms_mm": State(state.deviations, effects, state.shape_values),
    }
    left = {name: rms(held_out_mm(case, placed(case, model))) for name, model in models.items()}
    return {"campaign": second.series.name, "carried_from": first.series.name, **left}
