"""Sentences and numbers of pages of own robots, and answers to gross mistakes in files, compared with the truth."""

from pathlib import Path
from tempfile import TemporaryDirectory

import pandas as pd

from rrru.errors import RrruError, SimulationError, UnreachableError
from rrru.studies.blind_validation.chunks import MISTAKES, PAGES, RIGHT
from rrru.studies.blind_validation.sentences import mistakes, page
from rrru.studies.blind_validation.sentences.claims import UNKNOWN, claims
from rrru.studies.blind_validation.sentences.draws import draw, driven
from rrru.studies.blind_validation.sentences.judge import KINDS, judge
from rrru.studies.blind_validation.sentences.truth import truth_of

_WORDS = {True: "true", False: "false", None: "undecided"}
# numbers of a calibration count separately where the page itself says that something is unexplained
_WITH_UNEXPLAINED = ", with something unexplained"
_OF_NUMBERS = "interval of a number: calibration"
_LONGEST = 400
# sentences that accept a file and warn that it may be wrong
_WARNINGS = (
    "may be shifted",
    "see that unit, frame and rows belong together",
    "if the drives are referenced",
    "see that `robot` is right",
)
COLUMNS = ["check", "robot", "truth", "statement", "kind", "text", "result"]


def statements(check, numbers, settings):
    """Rows of `withheld_statements` of a check's numbers; settings: see `settings_of`."""
    made = {PAGES: _of_page, MISTAKES: _of_mistake, RIGHT: _of_right_file}[check]
    rows = []
    for number in numbers:
        with TemporaryDirectory() as folder:
            name, true, said = made(number, settings, Path(folder))
            for count, (kind, text, result) in enumerate(said):
                # the folder of the files differs from run to run
                shown = " ".join(text.replace(f"{folder}/", "").split())[:_LONGEST]
                rows.append([check, name, true, count, kind, shown, _WORDS[result]])
    return pd.DataFrame(rows, columns=COLUMNS)


def _of_page(number, settings, folder):
    """Name of a robot, its truth in words, and (kind, text, result) of each claim of its page."""
    own = _driven(number, settings)
    section, robot = own.write(folder, own.file_rows)
    try:
        run = page.run(own.name, section, robot, settings["config"])
    except RrruError as error:
        said = [("a right campaign is refused", f"{type(error).__name__}: {error}", False)]
        return own.name, own.in_words, said
    # anything else that ends a run is a defect, whatever it is
    except Exception as error:
        said = [("a run ends with a traceback", f"{type(error).__name__}: {error}", False)]
        return own.name, own.in_words, said
    truth = truth_of(own, run, folder)
    true = f"{own.in_words}; {truth.strength:.3g} times the noise after a calibration"
    return own.name, true, [_judged(claim, truth, run.page.facts) for claim in claims(run.page)]


def _driven(number, settings):
    """The Draw of a number, simulated with NumPy where MuJoCo cannot drive it."""
    own = draw(number, settings["seed"], settings["stops"], settings["mujoco_share"])
    if own.plant == "mujoco":
        try:
            return driven(own)
        except (SimulationError, UnreachableError):
            return draw(number, settings["seed"], settings["stops"], 0.0)
    return own


def _judged(claim, truth, facts):
    """Kind, text and result of a Claim."""
    kind = claim.kind if claim.kind in KINDS else UNKNOWN
    if kind == _OF_NUMBERS and facts["unexplained"]:
        kind += _WITH_UNEXPLAINED
    return kind, claim.text, judge(claim, truth, facts)


def _of_mistake(number, settings, folder):
    """Name of a robot, its mistake, and (kind, text, result) of the answer to it."""
    name, own, handed = mistakes.with_mistake(number, settings["seed"], settings["stops"])
    if not mistakes.shows(name, own, handed):
        return own.name, name, [(f"mistake named: {name}", "does not show in the file", None)]
    became, words = mistakes.read(own, handed, folder)
    warned = any(warning in words for warning in _WARNINGS)
    wanted = f" [wanted: {', '.join(handed.words)}]"
    right = became != "traceback" and mistakes.named(handed, words)
    right = None if not right and mistakes.is_mirrored(own, handed, words) else right
    return (
        own.name,
        f"{name}; {own.in_words}",
        [
            (f"mistake named: {name}", f"{became}: {words}{'' if right else wanted}", right),
            ("a mistake is not accepted without a word", f"{name}: {words}", became != "accepted" or warned),
            ("a mistake ends in no traceback", f"{name}: {words}", became != "traceback"),
        ],
    )


def _of_right_file(number, settings, folder):
    """Name of a robot, how it is measured, and whether its correct file is accepted."""
    own, handed = mistakes.right_file(number, settings["seed"], settings["stops"])
    became, words = mistakes.read(own, handed, folder)
    return own.name, own.in_words, [("a right file is not suspected", f"{became}: {words}", became == "accepted")]


def sentences(found):
    """Rows of `sentences`: how many statements of each kind are true, false and undecided, and the first of each."""
    rows = []
    for kind, of_kind in found.groupby("kind", sort=True):
        by_result = {result: of_kind[of_kind["result"] == result] for result in ("true", "false", "undecided")}
        row = {"kind": kind} | {result: len(part) for result, part in by_result.items()}
        row |= {f"example_{result}": _example(part) for result, part in by_result.items()}
        rows.append(row)
    return pd.DataFrame(rows)


def _example(part):
    """The first statement of a part behind the name of its robot; empty for none."""
    return f"{part['robot'].iloc[0]}: {part['text'].iloc[0]}" if len(part) else ""


def settings_of(settings):
    """The settings of `statements` from a rule's: seed, stops, mujoco_share, and config, see `page.run`."""
    section, config = settings["withheld"]["sentences"], {key: settings[key] for key in ("seed", "gap", "calibration")}
    return {"seed": settings["seed"], "config": config} | {key: section[key] for key in ("stops", "mujoco_share")}
