"""`rrru-printer`: check of a delta printer's calibration from its own file, on the terminal and in a page.

The answer for one printer is sentences, and its calibration as settings to paste.
"""

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jinja2 import Environment

from rrru.errors import FitError, RrruError, WriteError
from rrru.pipeline.read_config import DEFAULTS, read_config
from rrru.studies.printers.files import read_all
from rrru.studies.printers.judge import FOREIGN, REPRODUCED, UNTRIED, judge
from rrru.studies.printers.printer import Refused
from rrru.studies.printers.printer_tables import level_of

_BELONGS = {
    REPRODUCED: "belongs to the readings",
    FOREIGN: "does not belong to the readings",
    UNTRIED: "is not stated to come from the readings",
}
_PAGE = """<!DOCTYPE html>
<html lang="en"><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>Delta printers</title>
<style>
:root { color-scheme: light dark; }
body { font: 16px/1.5 sans-serif; max-width: 50em; margin: 2em auto; padding: 0 1em; }
dt { font-weight: bold; } dd { margin: 0 0 .6em 1em; } pre { padding: .6em; border: 1px solid; overflow-x: auto; }
</style>
{% for answer in answers %}<h1>{{ answer.name }}</h1>
<dl>{% for topic, text in answer.sentences.items() %}<dt>{{ topic }}</dt><dd>{{ text }}</dd>
{% endfor %}</dl>
{% for title, text in answer.settings.items() %}<h2>{{ title }}</h2><pre>{{ text }}</pre>
{% endfor %}{% endfor %}</html>
"""


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


def main(arguments=None):
    """Answer for the printers of the files on the command line; ends with 2 where a printer gives no answer."""
    options = _parser().parse_args(arguments)
    try:
        complete = answer_files(options.files, options.page)
    except RrruError as error:
        sys.exit(f"{type(error).__name__}: {error}")
    if not complete:
        sys.exit(2)


def answer_files(files, page=None):
    """Print the Answer for the printers of files, and write it to a page; returns whether every printer has one.

    Raises IngestError where none of the files can be read, and WriteError where the page cannot be written.
    """
    try:
        answers = answers_of(files)
    except RrruError as error:
        # replaces the page of an earlier run
        _write(page, [failed("no answer", str(error))])
        raise
    _write(page, answers)
    print("\n\n".join(_text(one) for one in answers))
    return all(one.settings for one in answers)


def _write(path, answers):
    """Write the page, if one was asked for."""
    if path:
        page = Environment(autoescape=True).from_string(_PAGE).render(answers=answers)
        try:
            Path(path).write_text(page, encoding="utf-8")
        except OSError as error:
            allowed = "a file in a folder that may be written to"
            raise WriteError(f"{path}: cannot be written ({error.strerror}); allowed: {allowed}") from error


def _parser():
    """The command line."""
    parser = argparse.ArgumentParser(
        prog="rrru-printer",
        description="Check the calibration of delta printers.",
        epilog=f"The same as `rrru printer`, in any folder. Its settings are the section printers of {DEFAULTS}",
    )
    files_help = "Klipper's printer.cfg, or JSON as in docs/printers.md"
    parser.add_argument("files", nargs="+", metavar="FILE", help=files_help)
    parser.add_argument("--page", metavar="FILE.html", help="also write the answer to a page")
    return parser


def answers_of(paths):
    """The Answer for every printer of the files; raises IngestError where none of them can be read."""
    settings = read_config()["printers"]
    printers = read_all(paths)
    level = level_of([printer for printer in printers if not isinstance(printer, Refused)], settings)
    return [_answer(printer, settings["stopping_step"], level) for printer in printers]


def _answer(printer, stopping_step, level):
    """The Answer for one printer."""
    if isinstance(printer, Refused):
        return failed(printer.name, printer.reason)
    try:
        return answer(judge(printer, stopping_step, level))
    except FitError as error:
        return failed(printer.name, str(error))


def _text(answer):
    """An Answer for the terminal."""
    lines = [answer.name, *(f"  {topic}: {text}" for topic, text in answer.sentences.items())]
    for title, text in answer.settings.items():
        lines += [f"  {title}:", *(f"    {line}" for line in text.splitlines())]
    return "\n".join(lines)
