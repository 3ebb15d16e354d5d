"""The user's own file with what a diagnosis has found, and how far that closes the gap.

Every effect that changes constants alone is geometry, as the calibration's parameters are; `drive_compliance` is the
stiffness of the drives and `backlash` their backlash. A file cannot hold anything else, nor loads other than those of
its own masses. The model is in the frame of the measurements. Lengths in mm, angles in rad.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import pandas as pd

from rrru.arrays import FloatArray
from rrru.campaign import measurements as rows
from rrru.diagnosis.calibrate import calibrate
from rrru.diagnosis.inference import InferenceResult, with_effects
from rrru.diagnosis.model_fit import fit_model
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.prediction_errors import prediction_rms_mm
from rrru.diagnosis.problem import DiagnosisProblem
from rrru.diagnosis.result_notes import payload_notes
from rrru.diagnosis.result_tables import acting_places, parameter_rows
from rrru.formats.file_changes import Found, held_by
from rrru.formats.mjcf_writer import to_mjcf
from rrru.formats.robot_file import mjcf_parts, urdf_parts
from rrru.formats.structure import structure_of
from rrru.formats.urdf_writer import to_urdf
from rrru.kinematics.general_robot import GeneralRobot

# parameters of a drive in a file: the effect and the stem of its parameters
_COMPLIANCE, _BACKLASH = ("drive_compliance", "compliance"), ("backlash", "width")


@dataclass(frozen=True)
class Corrected:
    """A corrected file.

    text; not_in_model: what it cannot hold, in words; lacking: the effects among these; found: what there is to hold;
    in_file: values by parameter of the effects that it holds in addition to geometry; predicted_mm: rms error with
    which its own fit predicts stops that are left out of it, 0 where it holds all effects; mjcf: whether it is an MJCF,
    not a URDF.
    """

    text: str
    not_in_model: tuple[str, ...]
    lacking: tuple[str, ...]
    found: Found
    predicted_mm: float = 0.0
    in_file: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    mjcf: bool = False


def found_of(inference: InferenceResult, stated_reflectors: bool = False) -> tuple[Found, list[str]]:
    """The Found of an inference, and the names of its effects that no file holds.

    stated_reflectors: whether reflectors whose places are stated belong to it, too.
    """
    problem, state = inference.problem, inference.state
    library, sites = problem.library, problem.mechanism.legs.sites
    changes = {key: np.asarray(state.contribution(library, key, problem.motion).twists) for key in state.effects}
    constant = {key: twists for key, twists in changes.items() if twists.ndim == 3 and len(twists) == 1}
    twists = problem.mechanism.twists(state.deviations)[0] + sum(one[0] for one in constant.values())
    steps, coordinates = inference.fit.one_sigma_steps()
    spread = np.einsum("scp,qp->qsc", problem.mechanism.directions, steps)
    for key, twist in constant.items():
        moved = (state.contribution(library, key, problem.motion, state.effects[key] + one) for one in coordinates[key])
        spread = spread + np.stack([np.asarray(one.twists)[0] - twist[0] for one in moved])
    moves = [k for k in range(len(sites)) if twists[k].any() or spread[:, k].any()]
    numbers, count = parameter_rows(inference), len(problem.mechanism.parts.drives)
    loads = np.nan_to_num(np.abs(problem.motion.drive_load)).max(axis=0)
    x, y, z = problem.mechanism.tool_mm
    found = Found(
        {sites[k]: twists[k] for k in moves},
        {sites[k]: spread[:, k] for k in moves},
        _places(problem, stated_reflectors),
        (x, y, z),
        _of_drives(numbers, *_COMPLIANCE, count),
        _of_drives(numbers, *_BACKLASH, count),
        dict(enumerate(loads.tolist())),
    )
    held = {name for name, _ in constant} | {_COMPLIANCE[0], _BACKLASH[0]}
    return found, [name for name, _ in state.effects if name not in held]


def fitted_in_file(inference: InferenceResult, section: dict[str, Any]) -> InferenceResult:
    """The InferenceResult with its hypothesis fitted in geometric numbers that the robot's own file can hold.

    Other parameters, such as shifts between the axes of a ball, can absorb errors in the fit; a file written without
    them would lack these corrections. section: the robot's entry in the configuration.
    """
    # a robot of a file is a GeneralRobot
    mechanism = cast(GeneralRobot, inference.problem.mechanism)
    if "urdf" in section:
        parts = urdf_parts(section["urdf"], **{key: section.get(key) for key in ("base", "tip", "home")})
    else:
        parts = mjcf_parts(section["mjcf"], section["platform"])
    held = held_by(structure_of(*parts), mechanism.candidates)
    if set(mechanism.parameters.names) <= set(held):
        return inference
    names = [name for name in held if name in mechanism.among] if mechanism.among else held
    problem = replace(inference.problem, mechanism=replace(mechanism, among=tuple(names)))
    fitted, state = inference.fit.model, inference.state
    start = replace(calibrate(problem), effects=state.effects, shape_values=state.shape_values)
    of_problem = replace(fitted.problem, mechanism=problem.mechanism)
    fit = fit_model(of_problem, [start], fitted.terms, fitted.scales, inference.fit.level, fitted.signed)
    return replace(inference, problem=problem, fit=fit)


def _with_misfit(inference: InferenceResult, spread: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    """Errors (q, 6) by site of numbers that are fitted without effects that act: as large as what is left asks for.

    They are too small by the ratio of what the fit leaves to the noise and discrepancy that it assumes (R. Birge,
    Physical Review 40, 1932).
    """
    left = inference.fit.estimate.standardized_residual
    ratio = max(float(np.sqrt((left**2).mean())), 1.0)
    return {site: ratio * errors for site, errors in spread.items()}


def _of_drives(numbers: pd.DataFrame, effect: str, stem: str, count: int) -> dict[int, tuple[float, float]]:
    """(value, standard error) of an effect's parameter of every drive by its number from 0 on."""
    of_effect = numbers[numbers["effect"] == effect].set_index("parameter")
    columns = ["value", "standard_error"]
    return {k: tuple(of_effect.loc[f"{stem}{k + 1}", columns]) for k in range(count) if len(of_effect)}


def _of_acting_drives(numbers: pd.DataFrame, effect: str, stem: str, count: int) -> dict[int, tuple[float, float]]:
    """The result of `_of_drives` for the drives at which the effect is not zero, see `acting_places`."""
    of_effect = numbers[numbers["effect"] == effect]
    acting = of_effect["place"].isin(acting_places(of_effect.to_dict("records")))
    sizes, names = _of_drives(numbers, effect, stem, count), set(of_effect.loc[acting, "parameter"])
    return {k: size for k, size in sizes.items() if f"{stem}{k + 1}" in names}


def _places(problem: DiagnosisProblem, stated: bool) -> dict[str, FloatArray]:
    """Places (3,) on the platform, before what was found, by site: of reflectors that were found, or stated, too."""
    config = problem.mechanism.measurement_config
    wanted = set(config.reflectors if stated else config.fitted)
    if not wanted:
        return {}
    on_world = rows.on_the_world(problem.measurements)
    frame = problem.measurements if on_world is None else problem.measurements[~on_world]
    places, sites = rows.vectors(frame, "target"), rows.sites(frame["target"]).to_numpy()
    return {name: places[np.flatnonzero(sites == name)[0]] for name in pd.unique(sites) if name in wanted}


def corrected(inference: InferenceResult, section: dict[str, Any], folder: Path) -> Corrected:
    """The Corrected file of an inference for a folder; section: the robot's entry in the configuration.

    Its numbers are fitted anew where the format cannot hold all effects and numbers that were. Raises ConfigError for a
    file whose bodies do not all stand in it as such.
    """
    # more links at the end of a URDF's chain would leave its tip open
    reflectors = "mjcf" in section
    _, lacking = found_of(inference, reflectors)
    others, effects = [*lacking], [name for name, _ in inference.state.effects]
    if "urdf" in section:
        lacking += [name for name in effects if name in (_COMPLIANCE[0], _BACKLASH[0])]
    held = tuple(name for name in effects if name not in lacking)
    fitted = fitted_in_file(with_effects(inference, held) if lacking else inference, section)
    found, _ = found_of(fitted, reflectors)
    predicted_mm = 0.0
    if lacking:
        predicted_mm = prediction_rms_mm(fitted.fit)
        found = replace(found, spread=_with_misfit(fitted, found.spread))
    if inference.posterior.probability_unexplained > OPTIONS.min_unexplained_probability:
        others.append("unexplained")
    others += payload_notes(inference)
    if "urdf" in section:
        chain = {key: section.get(key) for key in ("base", "tip", "home")}
        numbers, count = parameter_rows(inference), len(inference.problem.mechanism.parts.drives)
        compliance, play = (_of_acting_drives(numbers, *which, count) for which in (_COMPLIANCE, _BACKLASH))
        found = replace(found, compliance=compliance, play=play)
        text, lost = to_urdf(section["urdf"], found, folder, **chain)
        return Corrected(text, (*others, *lost), tuple(lacking), found, predicted_mm)
    text, lost = to_mjcf(section["mjcf"], section["platform"], found, folder)
    drives = ((*_COMPLIANCE, found.compliance), (*_BACKLASH, found.play))
    in_file = {name: {f"{stem}{k + 1}": value for k, (value, _) in each.items()} for name, stem, each in drives if each}
    return Corrected(text, (*others, *lost), tuple(lacking), found, predicted_mm, in_file, mjcf=True)
