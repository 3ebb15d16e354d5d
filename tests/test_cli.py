"""The command: its answer, its exit codes, and one message without a traceback for whatever is wrong."""

import json
import re
import shlex
import subprocess
import sys
from dataclasses import replace
from types import SimpleNamespace

import pandas as pd
import pytest
import yaml

import rrru
from rrru import api, cli
from rrru.pipeline.option_text import options_in
from rrru.studies.blind_validation.sentences.mistakes import MISTAKES, shows, with_mistake
from tests.places import ROOT

SEED, STOPS = 11, 90


@pytest.fixture(autouse=True)
def _in_the_project(monkeypatch):
    monkeypatch.chdir(ROOT)


def ran(capsys, *arguments):
    """Exit code, output and messages of the command."""
    code = cli.main([str(one) for one in arguments])
    return code, *capsys.readouterr()


def test_it_runs_as_a_command_of_its_own_in_any_folder(tmp_path):
    code = "import sys; from rrru.cli import main; sys.exit(main())"
    ended = subprocess.run([sys.executable, "-c", code, "--version"], capture_output=True, text=True, cwd=tmp_path)
    assert (ended.returncode, ended.stdout.strip()) == (0, f"rrru {rrru.__version__}")
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path)
    assert ended.returncode == cli.WRONG and "see `rrru --help`" in ended.stderr


@pytest.mark.usefixtures("quick_figures")
def test_a_diagnosis_prints_its_answer_and_where_its_files_are(tmp_path, capsys):
    arguments = ("data/field_12.csv", "--robot", "rrru3", "--noise", "0.02", "--set", "platform_mass_kg=3.0")
    # two that can be tested and two that this file cannot show
    arguments += ("--effects", "backlash,thermal_growth,read_before_rest,thermal_expansion")
    code, out, _ = ran(capsys, "diagnose", *arguments, "--out", tmp_path, "--figures", "pdf")
    folder = tmp_path / "campaigns/field_12"
    drawn = tmp_path / "figures/field_12"
    figures = [place.stem for place in drawn.glob("*.svg")]
    assert len(figures) > 3 and sorted(place.stem for place in drawn.glob("*.pdf")) == sorted(figures)
    facts = json.loads((folder / "verdict.json").read_text())
    said = " ".join(out.split())
    assert code == cli.DONE and all(" ".join(sentence.split()) in said for sentence in facts["sentences"])
    untested = [note.split()[0] for note in facts["notes"] if " not tested: " in note]
    assert untested and f"for reasons that the page has: {', '.join(untested)}" in said
    assert f"page: {folder / 'report.html'}" in out and (folder / "report.html").is_file() and "\033" not in out
    code, out, _ = ran(capsys, "diagnose", *arguments, "--out", tmp_path, "--json")
    assert code == cli.DONE and json.loads(out) == facts
    # those of the run before would be figures of other results
    assert not [*drawn.glob("*.pdf")] and sorted(place.stem for place in drawn.glob("*.svg")) == sorted(figures)


def test_robots_and_effects_are_listed(capsys):
    code, out, _ = ran(capsys, "robots")
    assert code == cli.DONE and [line.split(":")[0] for line in out.splitlines()] == ["rrru3", "ptt3", "delta"]
    code, out, _ = ran(capsys, "effects", "--robot", "data/models/arm6.urdf")
    assert code == cli.DONE and "drive_compliance: " in out and "rail_tilt" not in out


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (("diagnose", "nothere.csv", "--robot", "rrru3"), cli.WRONG, "nothere.csv: there is no such file"),
        (("check", "nothere.csv", "--robot", "rrru3"), cli.WRONG, "nothere.csv: there is no such file"),
        (("diagnose", "data/field_12.csv", "--robot", "rrru3", "--noise", "0"), cli.WRONG, "0, which no instrument"),
        (("diagnose", "data/field_12.csv", "--robot", "rrru3", "--effects", "backlsh"), cli.WRONG, "mean backlash?"),
        (("diagnose", "data/field_12.csv"), cli.WRONG, "no robot is stated"),
        (
            ("diagnose", "data/field_12.csv", "--robot", "rrru3", "--figures", "gif"),
            cli.WRONG,
            "figures as gif: no such files; allowed: pdf, png",
        ),
        (("diagnose", "data/field_12.csv", "--robot", "x.urdf"), cli.WRONG, "robot 'x.urdf': there is no such file"),
        (("diagnose", "README.md", "--robot", "rrru3"), cli.REFUSED, "README.md"),
        (("diagnose", "data/field_12.csv", "--robot", "rrru3", "--noise", "-1"), cli.WRONG, "noise_mm: -1.0"),
        (("diagnose", "data/field_12.csv", "--robot", "rrru3", "--set", "unit"), cli.WRONG, "no =; allowed: KEY=VALUE"),
        (("diagnose", "data/field_12.csv", "--robot", "rrru3", "--set", "unit=cm"), cli.WRONG, "'cm' is not one of"),
        (("diagnose", "data/field_12.csv", "--robot", "rrru3", "--target", "a=1,2"), cli.WRONG, "NAME=X,Y,Z"),
        (("diagnose", "data/field_12.csv", "--robot", "rrru3", "--effects", "ghosts"), cli.WRONG, "unknown effect"),
        (("diagnose", "paper", "--config", "config.yaml"), cli.WRONG, "virtual one"),
        (("check", "paper", "--config", "config.yaml"), cli.WRONG, "virtual one"),
        (("compare", "nothing", "nobody"), cli.WRONG, "'nothing' is no folder"),
        (("printer", "nothere.cfg"), cli.REFUSED, "nothere.cfg"),
        (
            ("robots", "--config", "nothere.yaml"),
            cli.WRONG,
            "nothere.yaml: there is no such file; allowed: a YAML",
        ),
        (("robots", "--config", "data"), cli.WRONG, "data: is a folder; allowed: a YAML file"),
        (("robots", "--config", "docs/circle.png"), cli.WRONG, "circle.png: is no text in UTF-8; allowed: a YAML file"),
        (("check", "data", "--robot", "rrru3"), cli.WRONG, "data: is a folder; allowed: a file of measurements"),
        (("diagnose", "data/field_12.csv", "--robot", "data"), cli.WRONG, "robot 'data': is a folder"),
        (("check", "data/field_12.csv", "--robot", "rrru3", "--commands", "no.csv"), cli.WRONG, "no.csv: there is no"),
        (("diagnose", "data/field_12.csv", "--robot", "rrru3", "--commands", "data"), cli.WRONG, "data: is a folder"),
        (("effects", "--robot", "nobody"), cli.WRONG, "robot 'nobody'"),
    ],
)
def test_what_is_wrong_gets_one_message_and_its_exit_code(arguments, code, said, capsys, tmp_path):
    out = ("--out", tmp_path / "results") if arguments[0] == "diagnose" else ()
    found, printed, message = ran(capsys, *arguments, *out)
    assert found == code and said in message and message.startswith("error: ") and "Traceback" not in message
    assert not printed and not (tmp_path / "results").exists()


_FIELD = ("data/field_12.csv", "--robot", "rrru3")
_LIST = ("tests/campaign/ingest/files/leica.csv", "--robot", "rrru3", "--set", "format=leica", "--frame", "register")
# commands with the place of the file that cannot be read, the code where there is no file, and that of other content
_READERS = {
    **{f"{name} --config": ((name, *_FIELD, "--config", None), cli.WRONG, cli.WRONG) for name in ("diagnose", "check")},
    **{f"{name} --config": ((name, "--config", None), cli.WRONG, cli.WRONG) for name in ("robots", "effects")},
    **{f"{name} FILE": ((name, None, *_FIELD[1:]), cli.WRONG, cli.REFUSED) for name in ("diagnose", "check")},
    **{
        f"{name} --commands": ((name, *_LIST, "--commands", None), cli.WRONG, cli.REFUSED)
        for name in ("diagnose", "check")
    },
    **{f"{name} --robot": ((name, _FIELD[0], "--robot", None), cli.WRONG, cli.WRONG) for name in ("diagnose", "check")},
    "effects --robot": (("effects", "--robot", None), cli.WRONG, cli.WRONG),
    "printer": (("printer", None), cli.REFUSED, cli.REFUSED),
    "compare": (("compare", None, None), cli.WRONG, cli.WRONG),
}
_SUFFIXES = {"--config": ".yaml", "--robot": ".urdf", "printer": ".cfg"}


@pytest.mark.parametrize("reader", _READERS)
@pytest.mark.parametrize("kind", ["missing", "folder", "binary", "empty"])
def test_a_file_that_cannot_be_read_gets_one_plain_message(reader, kind, tmp_path, capsys):
    arguments, none, content = _READERS[reader]
    file = tmp_path / f"mine{_SUFFIXES.get(reader.split()[-1], '.csv')}"
    if kind == "folder":
        file.mkdir()
    elif kind != "missing":
        file.write_bytes(b"\x00\xff\xfe\x01binary\x80" if kind == "binary" else b"")
    out = ("--out", tmp_path / "results") if arguments[0] == "diagnose" else ()
    code, printed, message = ran(capsys, *(file if one is None else one for one in arguments), *out)
    assert code == (none if kind in ("missing", "folder") else content) and not printed
    # a printer's file has a problem for every setting that it lacks
    one = message.count("\n") == 1 or (reader, kind) == ("printer", "empty")
    assert message.startswith("error: ") and one and str(file) in message
    assert "allowed: " in message or reader == "compare"
    for words in ("Errno", "errno", "codec", "Traceback", "NoneType", "<unicode string>", "rrru failed"):
        assert words not in message
    said = {
        "missing": "no such file",
        "folder": "is a directory" if reader == "printer" else "is a folder",
    }
    assert reader == "compare" or said.get(kind, "") in message.lower()


@pytest.mark.parametrize(
    ("text", "said"),
    [("a: [1, 2\nb: {", "mine.yaml, line 2: expected"), ("- a", "mine.yaml: is no mapping; allowed: ")],
)
def test_a_configuration_that_is_none_is_named_with_its_line(text, said, tmp_path, capsys):
    (tmp_path / "mine.yaml").write_text(text)
    code, _, message = ran(capsys, "robots", "--config", tmp_path / "mine.yaml")
    assert code == cli.WRONG and said in message and "unicode string" not in message and "list" not in message


@pytest.mark.parametrize("number", range(len(MISTAKES)), ids=list(MISTAKES))
def test_a_gross_mistake_in_a_file_gets_one_message(number, tmp_path, capsys):
    name, own, handed = with_mistake(number, SEED, STOPS)
    if not shows(name, own, handed):
        pytest.skip("it does not show in this file")
    section, robot = replace(own, nominal=handed.nominal).write(tmp_path, handed.rows)
    section = handed.section | {"ingest": section["ingest"]}
    (tmp_path / "mine.yaml").write_text(yaml.safe_dump({"robots": {"own": robot}, "campaigns": {"stops": section}}))
    arguments = ("stops", "--config", tmp_path / "mine.yaml")
    code, out, message = ran(capsys, "diagnose", *arguments, "--out", tmp_path / "results")
    assert code == cli.REFUSED and not out and message.startswith("error: ") and "Traceback" not in message
    code, out, message = ran(capsys, "check", *arguments)
    # units and frame are proposed, the rest is refused; either way the key to write is there
    assert (code == cli.REFUSED) == ("refused: " in out) and not message
    assert all(re.search(words, out, re.DOTALL) for words in handed.words)


def test_a_wrong_option_is_one_line(capsys):
    with pytest.raises(SystemExit) as ended:
        cli.main(["diagnose", "data/field_12.csv", "--noise", "abc"])
    message = capsys.readouterr().err
    assert ended.value.code == cli.WRONG and message.count("\n") == 1
    assert "argument --noise: 'abc' is no number; allowed: a number such as 0.03; see `rrru diagnose --help`" in message


@pytest.mark.parametrize(
    ("given", "meant"),
    [("--output=there", "--output=there; did you mean --out?"), ("--noize=0.03", "did you mean --noise?"), ("b", "b")],
)
def test_an_unknown_argument_is_named_with_the_nearest_one(given, meant, capsys):
    with pytest.raises(SystemExit) as ended:
        cli.main(["diagnose", "a.csv", given])
    message = capsys.readouterr().err
    assert ended.value.code == cli.WRONG and f"unknown arguments: {given.split()[0]}" in message
    assert f"{meant}; see `rrru diagnose --help`" in message


def test_a_folder_that_cannot_be_written_is_found_before_anything_is_computed(tmp_path, capsys, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setattr(api, "diagnose", lambda *_, **__: pytest.fail("computed"))
    arguments = ("data/field_12.csv", "--robot", "rrru3", "--noise", "0.02", "--out", tmp_path / "file/results")
    code, _, message = ran(capsys, "diagnose", *arguments)
    assert code == cli.WRONG and "cannot be written" in message


def test_ctrl_c_ends_with_a_word(monkeypatch, capsys):
    def interrupted(_):
        raise KeyboardInterrupt

    monkeypatch.setattr(cli, "_robots", interrupted)
    code, _, message = ran(capsys, "robots")
    assert code == cli.INTERRUPTED and message == "interrupted\n"


def test_a_failure_of_the_program_says_how_to_see_more(monkeypatch, capsys):
    def fails(_):
        raise ZeroDivisionError("in the middle")

    monkeypatch.setattr(cli, "_robots", fails)
    code, _, message = ran(capsys, "robots")
    assert code == cli.FAILED and "ZeroDivisionError: in the middle; run it again with --debug" in message
    with pytest.raises(ZeroDivisionError):
        cli.main(["robots", "--debug"])


def test_keys_of_a_message_are_options_for_a_user_of_the_command(tmp_path, capsys):
    """Readings in another frame: the message says which key, and the line below it which option."""
    frame = pd.read_csv("data/field_12.csv")
    frame["measured_x_mm"] += 5000.0
    frame.to_csv(tmp_path / "moved.csv", index=False)
    code, _, message = ran(capsys, "diagnose", tmp_path / "moved.csv", "--robot", "rrru3", "--out", tmp_path / "out")
    assert code == cli.REFUSED and "frame: register" in message
    assert message.splitlines()[-1] == "as options of the command: --frame register"


@pytest.mark.usefixtures("quick_figures")
def test_every_slow_step_is_shown_on_a_terminal_only(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    _, _, shown = ran(capsys, "check", "data/field_12.csv", "--robot", "rrru3")
    assert "columns:" in shown
    stated = ("diagnose", "data/field_12.csv", "--robot", "rrru3", "--effects", "backlash", "--out", tmp_path)
    _, _, shown = ran(capsys, *stated)
    assert all(f"{step}:" in shown for step in ("file", "problem", "page, tables and figures"))
    monkeypatch.setattr(sys.stderr, "isatty", lambda: False)
    assert ran(capsys, "check", "data/field_12.csv", "--robot", "rrru3")[2] == ""


@pytest.mark.parametrize(
    "option", [("--tool", "1,2,3"), ("--up", "0,1,0"), ("--tip", "tool0"), ("--platform", "plate")]
)
def test_an_option_about_a_robot_s_file_is_refused_where_the_robot_has_none(capsys, tmp_path, option):
    """The dimensions of the package's robots are all that there is of them: the option would change nothing."""
    code, _, message = ran(capsys, "diagnose", "data/field_12.csv", "--robot", "rrru3", *option, "--out", tmp_path)
    key = {"--tool": "tool_mm"}.get(option[0], option[0][2:])
    assert code == cli.WRONG and f"robots.rrru3: Additional properties are not allowed ('{key}'" in message


def test_an_option_about_a_robot_s_file_holds_for_one_of_a_configuration(capsys, tmp_path):
    stated = {"robots": {"arm": {"urdf": "data/models/arm6.urdf"}}}
    stated["campaigns"] = {"mine": {"robot": "arm", "ingest": "data/field_12.csv"}}
    (tmp_path / "mine.yaml").write_text(yaml.safe_dump(stated), encoding="utf-8")
    for robot in ((), ("--robot", "arm")):
        code, _, message = ran(capsys, "check", "mine", *robot, "--tip", "hand", "--config", tmp_path / "mine.yaml")
        assert code == cli.WRONG and "tip is 'hand'; allowed: base_link, shoulder" in message


def test_the_place_of_the_tool_is_an_option_for_a_user_of_the_command():
    said = "allowed: a tool at (85.9, 12, -29.9) mm (the robot's tool_mm), which leaves 0.9 mm rms"
    assert options_in(said) == ["--tool 85.9,12,-29.9"]


def test_alternatives_of_a_message_are_alternatives_of_the_command():
    """Two values of one key in a line, of which the last one would have counted."""
    said = "allowed: signs: {x_mm: -1} or signs: {c_rad: -1}, which leaves 0.02 mm\nanother problem; unit: m fits"
    assert options_in(said) == ["--set 'signs={x_mm: -1}' or --set 'signs={c_rad: -1}'", "--set unit=m"]
    both = "allowed: unit: m and drive_unit: mm, which leaves 0.02 mm"
    assert options_in(both) == ["--set unit=m --set drive_unit=mm"]


def test_a_proposal_is_a_command_as_well_as_yaml(tmp_path, capsys):
    frame = pd.read_csv("data/field_12.csv")
    frame.rename(columns={f"measured_{a}_mm": f"SMR {a.upper()}" for a in "xyz"}).to_csv(
        tmp_path / "a.csv", index=False
    )
    code, out, _ = ran(capsys, "check", tmp_path / "a.csv", "--robot", "rrru3")
    (command,) = (line for line in out.splitlines() if line.startswith("# or without a file: rrru diagnose "))
    assert code == cli.DONE and "--robot rrru3" in command
    words = shlex.split(command.partition("rrru diagnose ")[2])
    again, out, _ = ran(capsys, "check", *words)
    assert again == cli.DONE and "used: 'SMR X' as measured_x_mm" in out


@pytest.mark.parametrize("as_options", [True, False])
def test_keys_of_notes_are_options_where_no_configuration_is_given(tmp_path, capsys, as_options):
    """A note of an accepted file names a key: the command's user reads which option it is."""
    facts = {
        "sentences": ["Nothing is left."],
        "notes": ["would agree with: signs: {q2_rad: -1}"],
        "corrected_file": None,
    }
    (tmp_path / "verdict.json").write_text(json.dumps(facts), encoding="utf-8")
    cli._print_answer(SimpleNamespace(notes=("no column run",)), tmp_path / "report.html", as_options)
    said = " ".join(capsys.readouterr().out.split())
    assert ("keys that the notes name, as options of the command: --set 'signs={q2_rad: -1}'" in said) is as_options


def test_what_a_corrected_file_lacks_is_said_to_lack(tmp_path, capsys):
    file = {"remainder": "0.04 mm rms remain", "not_in_model": ["transmission_orders"]}
    facts = {"sentences": ["Most of it."], "notes": [], "corrected_file": file}
    (tmp_path / "verdict.json").write_text(json.dumps(facts), encoding="utf-8")
    (tmp_path / "corrected.xml").write_text("", encoding="utf-8")
    cli._print_answer(SimpleNamespace(notes=()), tmp_path / "report.html", False)
    assert capsys.readouterr().out.endswith("corrected.xml\n  0.04 mm rms remain\n  not in it: transmission_orders\n")


def test_a_file_that_was_not_corrected_is_not_named(tmp_path, capsys):
    why = ["not corrected: leg 2 misses the platform by 5 mm", "allowed: up to 1 mm"]
    facts = {"sentences": ["Most of it."], "notes": [], "corrected_file": {"remainder": "", "not_in_model": why}}
    (tmp_path / "verdict.json").write_text(json.dumps(facts), encoding="utf-8")
    (tmp_path / "corrected.xml").write_text("<mujoco><!-- not corrected --></mujoco>", encoding="utf-8")
    cli._print_answer(SimpleNamespace(notes=()), tmp_path / "report.html", False)
    said = " ".join(capsys.readouterr().out.split())
    assert "corrected.xml" not in said
    assert said.endswith("your robot's file was not corrected: leg 2 misses the platform by 5 mm; allowed: up to 1 mm")
