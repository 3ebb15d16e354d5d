"""The answer for one printer in sentences, and its calibration as settings to paste."""

from dataclasses import dataclass

import numpy as np

from rrru.studies.printers.judge import FOREIGN, REPRODUCED, UNTRIED

_BELONGS = {
    REPRODUCED: "belongs to the readings",
    FOREIGN: "does not belong to the readings",
    UNTRIED: "is not stated to come from the readings",
}


@dataclass(frozen=True)
class Answer:
    """The answer on a printer: sentences by topic, and blocks of settings by title."""

    name: str
    sentences: dict
    settings: dict


def failed(name, reason):
    """The Answer for a printer that cannot be read or fitted."""
    return Answer(name, {"not fitted": reason}, {})


def answer(judged):
    """The Answer for a Judged printer."""
    result, tilt = judged.result, judged.tilt
    sentences = {
        "saved answer": ": ".join(filter(None, [_BELONGS[judged.verdict], judged.reason])),
        "readings": _readings(result),
        "suspicious reading": _suspect(judged),
        "cause of the residuals": judged.cause,
        "effector": "not tested: no probe offset from the nozzle is stated" if tilt is None else tilt.text,
    }
    settings = {"calibration from all readings": _settings(result)}
    if judged.suspect is not None:
        name = result.reading_name(judged.suspect)
        settings[f"calibration without {name}"] = _settings(judged.without_suspect)
    return Answer(result.printer.name, sentences, settings)


def _readings(result):
    """Numbers of readings and their residuals after calibration."""
    residuals = result.residuals
    parts = zip(("heights", "distances"), np.split(result.in_mm.residual, [len(residuals.height_mm)]), strict=True)
    residual = [f"{len(part)} {kind} (rms {np.sqrt((part**2).mean()):.3f} mm)" for kind, part in parts if len(part)]
    return f"residuals after calibration of {' and '.join(residual)}"


def _suspect(judged):
    """The reading to repeat."""
    if judged.left.suspect is None:
        return "too few readings for a test"
    if judged.suspect is None:
        return "none"
    number, result = judged.suspect, judged.result
    read, off = result.residuals.measured_mm[number], judged.left.difference_mm[number]
    difference = f"{result.reading_name(number)}: {read:g} mm, predicted from the others {read - off:.2f} mm"
    return f"{difference} (by chance in one of {1.0 / judged.left.p[number]:.0f} printers); repeat this reading"


def _settings(result):
    """Fitted numbers as Klipper's settings; arms are the saved ones where only heights were measured."""
    numbers = np.concatenate([result.fitted, result.printer.arm_mm])[:9]
    radius, angles, endstops, arms = numbers[0], [*numbers[1:3], result.printer.angle_deg[2]], numbers[3:6], numbers[6:]
    lines = ["[printer]", f"delta_radius: {radius:.6f}"]
    for tower, angle, arm, endstop in zip("abc", angles, arms, endstops, strict=True):
        lines += [f"[stepper_{tower}]", f"angle: {angle:.6f}", f"arm_length: {arm:.6f}"]
        lines += [f"position_endstop: {endstop:.6f}"]
    return "\n".join(lines)
