"""The command `rrru`: from a file of measurements to its cause on the terminal, and into a folder of results.

Exit codes: 0 done; 1 the file is refused, or the data do not determine an answer; 2 a wrong argument, configuration or
robot; 3 an error of rrru itself, which `--debug` shows with its traceback; 130 interrupted by Ctrl-C.
"""

import argparse
import gc
import json
import os
import shutil
import sys
import textwrap
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from difflib import get_close_matches
from pathlib import Path
from typing import Any, NoReturn

import yaml

from rrru import __version__
from rrru.errors import ConfigError, FitError, IngestError, RrruError, SimulationError, UnreachableError, not_a_file
from rrru.pipeline.option_text import options_in

DONE, REFUSED, WRONG, FAILED = range(4)
INTERRUPTED = 130
_OF_DATA = (IngestError, FitError, UnreachableError, SimulationError)
_WIDEST = 100
_UNTESTED = " not tested: "
_BOLD, _DIM, _PLAIN = "\033[1m", "\033[2m", "\033[0m"
# options of a robot's file, as arguments of `rrru.load_robot`
_OF_ROBOT = ("tip", "base", "platform")


class _Parser(argparse.ArgumentParser):
    """A parser whose errors are one line."""

    def error(self, message: str) -> NoReturn:
        """End with a message that says where the arguments are explained."""
        self.exit(WRONG, f"error: {message}; see `{self.prog} --help`\n")

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """As of argparse, but arguments that are not known end with the command's own help, and the nearest option."""
        found, unknown = super().parse_known_args(args, namespace)
        if unknown:
            nearest = get_close_matches(unknown[0].split("=")[0], self._option_string_actions, n=1)
            meant = f"; did you mean {nearest[0]}?" if nearest else ""
            self.error(f"unknown arguments: {' '.join(unknown)}{meant}")
        return found, unknown


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns its exit code. arguments: None for those of the process, which then ends with it."""
    if arguments is not None:
        return _run(_parser().parse_args(arguments))
    # searches for garbage, one of them as the process ends, cost 0.3 s and free little
    gc.disable()
    options = _parser().parse_args(namespace=argparse.Namespace(alone=True))
    try:
        return _run(options)
    finally:
        gc.freeze()


def _run(options: argparse.Namespace) -> int:
    """Run the command with its options; returns its exit code."""
    # libraries that compute with several threads give other last digits, and are slower on matrices of this size
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    run: Callable[[argparse.Namespace], int] = options.run
    try:
        return run(options)
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:
        # the reader of the output, such as `head`, has ended; Python would report it once more on closing
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return DONE
    except Exception as error:
        if options.debug:
            raise
        known = isinstance(error, RrruError)
        said = str(error) if known else f"rrru failed: {type(error).__name__}: {error}; run it again with --debug"
        print(_bold("error: ", sys.stderr) + said, file=sys.stderr)
        # a user of a configuration writes the key as the message has it
        if known and hasattr(options, "set") and not options.config and (keys := options_in(said)):
            print(f"as options of the command: {' '.join(keys)}", file=sys.stderr)
        return FAILED if not known else REFUSED if isinstance(error, _OF_DATA) else WRONG


def _parser() -> argparse.ArgumentParser:
    """The command line."""
    parser = _Parser(
        prog="rrru",
        description="Why does a calibrated robot still miss? Calibration and diagnosis from a file of measurements.",
        epilog="Exit codes: 0 done; 1 data refused, or no answer from them; 2 wrong argument; 3 failure of rrru.",
    )
    parser.add_argument("--version", action="version", version=f"rrru {__version__}")
    parser.add_argument("--debug", action="store_true", help="show the traceback of an error")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    about = "calibrate and diagnose: answer, page, JSON, tables, corrected file"
    one = _command(commands, "diagnose", _diagnose, about, _campaign)
    one.add_argument("--out", default="results", metavar="FOLDER", help="folder of results; default: %(default)s")
    one.add_argument("--effects", type=_names, metavar="NAME,..", help="effects that may act; default: all")
    about = "files of the figures besides SVG: pdf, png"
    one.add_argument("--figures", type=_names, default=(), metavar="KIND,..", help=about)
    one.add_argument("--json", action="store_true", help="print the answer as JSON")
    about = "what is in a file: its columns, what is missing, what a run would refuse, and a section to paste"
    _command(commands, "check", _check, about, _campaign)
    one = _command(commands, "compare", _compare, "which of two calibrations to trust, as a page")
    one.add_argument("first", metavar="A", help="folder of results, FOLDER:CAMPAIGN, or a campaign of results")
    one.add_argument("second", metavar="B")
    one.add_argument("--page", default="compare.html", metavar="FILE", help="default: %(default)s")
    one = _command(commands, "printer", _printer, "check of a delta printer's calibration")
    one.add_argument("files", nargs="+", metavar="FILE", help="Klipper's printer.cfg, or JSON as in docs/printers.md")
    one.add_argument("--page", metavar="FILE.html", help="also write the answer to a page")
    _command(commands, "robots", _robots, "the package's robots and those of a configuration", _config)
    one = _command(commands, "effects", _effects, "the effects that may act on a robot", _config)
    one.add_argument("--robot", default="rrru3", help="file or name; default: %(default)s")
    _of_robot(one)
    return parser


def _command(
    commands: Any,
    name: str,
    run: Callable[[argparse.Namespace], int],
    about: str,
    *arguments: Callable[[argparse.ArgumentParser], None],
) -> argparse.ArgumentParser:
    """A subcommand with the arguments that it shares with others."""
    parser: argparse.ArgumentParser = commands.add_parser(
        name, help=about, description=f"{about[0].upper()}{about[1:]}."
    )
    parser.set_defaults(run=run)
    # given before the command it holds as well
    about = "show the traceback of an error"
    parser.add_argument("--debug", action="store_true", default=argparse.SUPPRESS, help=about)
    for add in arguments:
        add(parser)
    return parser


def _campaign(parser: argparse.ArgumentParser) -> None:
    """Arguments that state a campaign."""
    parser.add_argument("file", metavar="FILE", help="file of measurements, or a campaign of --config")
    parser.add_argument("--robot", help="URDF or MJCF file, or a name of `rrru robots`")
    _of_robot(parser)
    parser.add_argument("--noise", type=_number, metavar="MM", help="of the instrument, 1 sigma per axis")
    parser.add_argument("--noise-rad", type=_number, metavar="RAD", help="of measured orientations, 1 sigma per axis")
    parser.add_argument("--frame", choices=("robot", "register"), help="register: the instrument's frame is unknown")
    parser.add_argument("--target", action="append", default=[], metavar="NAME=X,Y,Z", help="reflector's place in mm")
    parser.add_argument("--commands", metavar="FILE", help="second file with the commanded positions")
    parser.add_argument("--name", help="of the campaign; default: that of the file")
    parser.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", help="any other key of docs/own-data.md"
    )
    _config(parser)


def _of_robot(parser: argparse.ArgumentParser) -> None:
    """Arguments about a robot's file."""
    parser.add_argument("--tip", help="URDF: link that carries the measured point")
    parser.add_argument("--base", help="URDF: fixed link")
    parser.add_argument("--platform", help="MJCF: body that carries the measured point")
    parser.add_argument("--tool", type=_place, metavar="X,Y,Z", help="measured point in the last frame, mm")
    parser.add_argument("--up", type=_place, metavar="X,Y,Z", help="direction against gravity in the base's frame")


def _config(parser: argparse.ArgumentParser) -> None:
    """The configuration's argument."""
    parser.add_argument(
        "--config", nargs="+", default=[], metavar="YAML", help="configurations, each on top of the last"
    )


def _stated(options: argparse.Namespace) -> tuple[dict[str, Any], str]:
    """The configuration with the campaign of the arguments, and the campaign's name."""
    from rrru.api import as_name
    from rrru.pipeline.read_config import check_config, merged, read_config

    config = read_config(options.config)
    name, section = options.file, config["campaigns"].get(options.file)
    if section is None and (why := not_a_file(options.file)):
        allowed = "a file of measurements, or a campaign of --config"
        raise ConfigError(f"{options.file}: {why}; allowed: {allowed}")
    if options.commands is not None and (why := not_a_file(options.commands)):
        raise ConfigError(f"--commands {options.commands}: {why}; allowed: a file with the commanded positions")
    if section is None:
        name, section = options.name or as_name(Path(options.file).stem), {"ingest": options.file}
    config, robot = _with_robot(options, config, section.get("robot"))
    section = section | ({"robot": robot} if robot else {}) | _keys(options)
    config = merged(config, {"campaigns": {name: section}})
    if "robot" in section:
        check_config(config)
    return config, name


def _with_robot(
    options: argparse.Namespace, config: dict[str, Any], of_campaign: str | None = None
) -> tuple[dict[str, Any], str | None]:
    """The configuration with the robot of the arguments, and the robot's name, None where none is stated.

    of_campaign: the robot of the configuration that the arguments are about where they name none.
    """
    from rrru import api
    from rrru.pipeline.read_config import check_config, merged

    of_file = {key: getattr(options, key) for key in _OF_ROBOT} | {"tool_mm": options.tool, "up": options.up}
    stated = {key: value for key, value in of_file.items() if value is not None}
    if options.robot is not None and options.robot not in config["robots"]:
        robot = api.load_robot(options.robot, **stated)
        return merged(config, {"robots": {robot.name: robot.entry}}), robot.name
    if stated and (name := options.robot or of_campaign):
        config = merged(config, {"robots": {name: stated}})
        check_config(config)
    return config, options.robot


def _keys(options: argparse.Namespace) -> dict[str, Any]:
    """Keys of the campaign's section that arguments state."""
    stated = {"noise_mm": options.noise, "noise_rad": options.noise_rad, "frame": options.frame}
    stated |= {"commands": options.commands}
    keys = {key: value for key, value in stated.items() if value is not None}
    if options.target:
        keys["targets"] = dict(_target(text) for text in options.target)
    for text in options.set:
        key, equals, value = text.partition("=")
        if not equals:
            raise ConfigError(f"--set {text}: no =; allowed: KEY=VALUE, such as unit=m")
        try:
            keys[key] = yaml.safe_load(value)
        except yaml.YAMLError as error:
            raise ConfigError(f"--set {text}: {' '.join(str(error).split())}; allowed: a value as in YAML") from error
    return keys


def _target(text: str) -> tuple[str, list[float]]:
    """Name and place of NAME=X,Y,Z."""
    name, _, place = text.partition("=")
    try:
        return name, _place(place)
    except argparse.ArgumentTypeError:
        allowed = "NAME=X,Y,Z in mm, such as ball=30,0,60"
        raise ConfigError(f"--target {text}: no place; allowed: {allowed}") from None


def _place(text: str) -> list[float]:
    """Numbers of X,Y,Z."""
    try:
        x, y, z = (float(number) for number in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is no place; allowed: X,Y,Z in mm, such as 30,0,60") from None
    return [x, y, z]


def _number(text: str) -> float:
    """A number of an option."""
    try:
        return float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is no number; allowed: a number such as 0.03") from None


def _names(text: str) -> list[str]:
    """Names between commas."""
    return [name for name in text.split(",") if name]


def _diagnose(options: argparse.Namespace) -> int:
    """Read, calibrate and diagnose a campaign; write its results and print the answer."""
    from rrru.figures.processes import drawing_processes

    # they start before this process loads what it computes with; those of another program would import it anew
    with drawing_processes() if "alone" in options else nullcontext() as processes:
        from rrru import api
        from rrru.figures.files import with_svg

        config, name = _stated(options)
        if "robot" not in config["campaigns"][name]:
            known = ", ".join(config["robots"])
            raise ConfigError(f"no robot is stated; allowed: --robot with a URDF or MJCF file, or one of {known}")
        _require_writable(Path(options.out))
        kinds = with_svg(options.figures)
        terminal = sys.stderr.isatty()
        with _during("file", terminal):
            campaign = api.configured_campaign(name, config)
        diagnosis = api.diagnose(campaign, effects=options.effects, progress=terminal)
        with _during("page, tables and figures", terminal):
            page = diagnosis.write(options.out, kinds, processes=processes)
    if options.json:
        print(page.with_name("verdict.json").read_text(encoding="utf-8"), end="")
    else:
        _print_answer(campaign, page, not options.config)
    return REFUSED if diagnosis.verdict["no_answer"] else DONE


@contextmanager
def _during(step: str, terminal: bool) -> Iterator[None]:
    """Show the only step of a computation on a terminal while it runs."""
    from rrru.pipeline.progress import shown

    with shown(terminal, (step,)) as begin:
        if begin:
            begin(step)
        yield


def _require_writable(folder: Path) -> None:
    """Raise ConfigError, before anything is computed, where results cannot be written to a folder."""
    place = folder
    while not place.exists():
        place = place.parent
    if not (place.is_dir() and os.access(place, os.W_OK)):
        raise ConfigError(f"--out {folder}: cannot be written; allowed: a folder that may be written to")


def _print_answer(campaign: Any, page: Path, as_options: bool) -> None:
    """The answer as text: the sentences, what was noted, and where the results are.

    as_options: repeat the keys that notes name as options of the command.
    """
    from rrru.diagnosis.verdict_facts import not_corrected

    facts = json.loads(page.with_name("verdict.json").read_text(encoding="utf-8"))
    lead, *others = facts["sentences"]
    print(_wrapped(_bold(lead)))
    for sentence in others:
        print(_wrapped(sentence))
    notes = (*campaign.notes, *facts["notes"])
    untested = [note.partition(_UNTESTED)[0] for note in notes if _UNTESTED in note]
    for note in (note for note in notes if _UNTESTED not in note):
        print(_dim(_wrapped(f"note: {note}")))
    if untested:
        print(_dim(_wrapped(f"note: not tested, for reasons that the page has: {', '.join(untested)}")))
    if as_options and (keys := options_in("\n".join(notes))):
        print(_dim(_wrapped(f"keys that the notes name, as options of the command: {' '.join(keys)}")))
    print()
    for label, path in (("page", page), ("answer as JSON", page.with_name("verdict.json")), ("tables", page.parent)):
        print(f"{label}: {path}")
    file = facts["corrected_file"]
    if why := not_corrected(facts):
        print(_wrapped(f"your robot's file was {why}"))
        return
    for path in sorted(page.parent.glob("corrected.*")) if file else ():
        print(f"corrected file: {path}")
        for sentence in filter(None, (file["remainder"], *(f"not in it: {one}" for one in file["not_in_model"]))):
            print(_wrapped(f"  {sentence}"))


def _check(options: argparse.Namespace) -> int:
    """What is in a file."""
    from rrru.pipeline.data_check.check_data import print_check

    config, name = _stated(options)
    section = config["campaigns"][name]
    if "ingest" not in section:
        raise ConfigError(f"campaign {name} is a virtual one; allowed: a file, or a measured campaign")
    accepted = print_check(section["ingest"], config, section.get("robot"), None, options.config, sys.stderr.isatty())
    return DONE if accepted else REFUSED


def _compare(options: argparse.Namespace) -> int:
    """A page on two calibrations."""
    from rrru.report import compare_page

    compare_page.write(options.first, options.second, options.page)
    print(f"page: {options.page}")
    return DONE


def _printer(options: argparse.Namespace) -> int:
    """The answer for delta printers."""
    from rrru.studies.printers.command import answer_files

    return DONE if answer_files(options.files, options.page) else REFUSED


def _robots(options: argparse.Namespace) -> int:
    """Names of the robots, with their drives."""
    from rrru.api import RobotModel
    from rrru.pipeline.read_config import read_config

    for name, entry in read_config(options.config)["robots"].items():
        robot = RobotModel(name, entry)
        print(f"{name}: drives {', '.join(robot.drives)}; parameters {', '.join(robot.parameters)}")
    return DONE


def _effects(options: argparse.Namespace) -> int:
    """Names of the effects that a robot may have, with what each is."""
    from rrru.api import RobotModel
    from rrru.effects.causes import cause_texts
    from rrru.effects.library import library
    from rrru.pipeline.read_config import read_config
    from rrru.robots.drive_words import drive_words

    config, name = _with_robot(options, read_config(options.config))
    robot = RobotModel(str(name), config["robots"][name]).mechanism
    words = drive_words(robot)
    for effect in library(robot):
        print(_wrapped(f"{effect}: {cause_texts(effect, words).meaning}"))
    return DONE


def _wrapped(text: str) -> str:
    """A text in lines of the terminal's width."""
    width = min(shutil.get_terminal_size().columns, _WIDEST)
    return textwrap.fill(text, width, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False)


def _bold(text: str, stream: Any = None) -> str:
    """A text in bold where the stream is a terminal."""
    return f"{_BOLD}{text}{_PLAIN}" if _coloured(stream or sys.stdout) else text


def _dim(text: str) -> str:
    """A text less bright where the output is a terminal."""
    return f"{_DIM}{text}{_PLAIN}" if _coloured(sys.stdout) else text


def _coloured(stream: Any) -> bool:
    """Whether a stream is a terminal whose user has not asked for plain text, https://no-color.org."""
    return bool(stream.isatty()) and not os.environ.get("NO_COLOR")


if __name__ == "__main__":
    sys.exit(main())
