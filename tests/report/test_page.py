"""The page of whatever is there: parts of a run, nothing at all, left-overs of an earlier one."""

import re
import shutil

import numpy as np
import pandas as pd
import pytest
from markupsafe import escape

from rrru.figures import files, style
from rrru.report import cards, page
from rrru.report.worth import Worth
from rrru.store import json_files, tables
from tests.diagnosis.test_verdict_text import CAMPAIGN, answered
from tests.figures import synthetic_gap, synthetic_tables
from tests.schemas import TABLES


@pytest.fixture
def folder(tmp_path):
    """Results of one diagnosed campaign, and what an earlier run has left of another."""
    for name in (CAMPAIGN, "earlier"):
        (tmp_path / "campaigns" / name).mkdir(parents=True)
        json_files.write(answered(notes="a <b> & c") | {"campaign": name}, tmp_path / f"campaigns/{name}/verdict.json")
        with style.print_style():
            figure = style.new(style.SINGLE_MM, 30.0)
            figure.subplots().plot([0.0, 1.0])
        style.save(figure, {kind: tmp_path / f"figures/{name}/gap.{kind}" for kind in ("svg", "png")}, "What to see.")
    verdicts = synthetic_gap.gap_verdicts(CAMPAIGN)
    tables.write(TABLES["gap_verdicts"], verdicts, tmp_path / "tables/gap_verdicts.parquet")
    tables.write(TABLES["gap_budget"], synthetic_gap.gap_budget(CAMPAIGN), tmp_path / "tables/gap_budget.parquet")
    return tmp_path


def written(folder, campaign=None):
    page.write(folder, folder / "page.html", "paper", campaign)
    return (folder / "page.html").read_text()


def test_a_part_of_a_run_is_shown_and_what_an_earlier_one_has_left_is_not(folder):
    text = written(folder)
    assert (
        f'id="answer-{CAMPAIGN}"' in text and f'id="figure-{CAMPAIGN}-gap"' in text and 'id="table-gap_budget"' in text
    )
    assert "earlier" not in text and "What to see." in text
    for lacking in ("table-gap_shrink", 'id="calibration"', 'id="printers"'):
        assert lacking not in text
    assert written(folder) == text and not list(folder.glob("*.partial*"))


def test_the_corrected_file_of_a_robot_is_linked_from_where_the_page_lies(folder):
    assert "corrected" not in written(folder)
    place = folder / "campaigns" / CAMPAIGN / "corrected.xml"
    place.write_text("<mujoco/>")
    assert f'<a href="campaigns/{CAMPAIGN}/corrected.xml">' in written(folder)
    shutil.copy(folder / "tables/gap_verdicts.parquet", place.parent)
    page.write(folder, place.parent / "report.html", "paper", CAMPAIGN)
    assert '<a href="corrected.xml">' in (place.parent / "report.html").read_text()


def _with_file(folder, **verdict):
    """The page of the folder whose campaign has a corrected file."""
    place = folder / "campaigns" / CAMPAIGN
    (place / "corrected.urdf").write_text("<robot/>")
    json_files.write(answered(**verdict), place / "verdict.json")
    return written(folder)


def test_errors_of_a_corrected_file_are_next_to_its_link(folder):
    remains = "this URDF holds the geometry only and not backlash: 0.54 mm rms remain; use corrected_drives.parquet"
    text = _with_file(
        folder,
        file_error_mm=0.31,
        file_error_fresh_mm=0.54,
        file_expected_mm=0.54,
        file_remainder=remains,
        not_in_model="backlash",
    )
    link = text.index(f'<a href="campaigns/{CAMPAIGN}/corrected.urdf">')
    worth = text.index("It is 0.31 mm rms off the diagnosed robot at the measured poses, 0.54 mm at 200 fresh ones.")
    assert link < worth < text.index(remains[1:]) and f'<p class="lead">{remains[:10]}' not in text
    assert '<p class="lead">After calibration' in text


@pytest.mark.parametrize("registered", [True, False])
def test_the_errors_of_a_file_are_said_to_be_those_of_the_points_that_were_read(registered):
    """A palletiser whose reflector was right to 0.012 mm had a tool that was 0.44 mm off."""
    facts = answered(file_error_mm=0.31, file_error_fresh_mm=0.54, file_expected_mm=0.54)
    said = " ".join(cards.card(facts, found=Worth(144, 1.5, 0.05, registered)).worth)
    assert ("the tool and other points of the platform may be off by more" in said) == registered


def test_a_corrected_file_without_fresh_poses_says_so(folder):
    text = _with_file(folder, file_error_mm=0.31, file_error_fresh_mm=np.nan, file_expected_mm=0.31)
    said = "It is 0.31 mm rms off the diagnosed robot at the measured poses, at the fresh ones it has no pose."
    assert said in text


_UNKNOWN = (
    {"file_error_mm": np.nan, "not_in_model": "backlash"},
    {"file_error_mm": 0.3, "file_error_fresh_mm": np.nan, "file_expected_mm": 0.3},
    {"noise_stated_mm": np.nan, "gap_after_rms_mm": 0.0},
    {"effects": "unexplained", "leg": 0, "follows": [("the time", 0.9, np.nan, "s", 0.1)]},
    {"runs": (("line_1 once more", "run", "line_1", False, np.nan, np.nan, 26, "backlash / none", np.nan),)},
)


@pytest.mark.parametrize("unknown", _UNKNOWN, ids=str)
def test_no_text_of_a_page_has_a_number_that_is_none(folder, unknown):
    budget = synthetic_gap.gap_budget(CAMPAIGN).assign(probability=np.nan)
    text = _with_file(folder, budget=budget, **unknown)
    seen = re.sub(r"<(script|style|svg)\b.*?</\1>|<[^>]*>", " ", text, flags=re.DOTALL)
    assert "After calibration" in seen and not re.findall(r"\b(?:nan|NaN|inf|None)\b", seen)


def test_corrected_drive_values_are_linked_where_there_are_any(folder):
    place = folder / "campaigns" / CAMPAIGN / "corrected_drives.parquet"
    pd.DataFrame({"point": []}).to_parquet(place)
    assert "corrected_drives" not in _with_file(folder)
    pd.DataFrame({"point": [1]}).to_parquet(place)
    assert f'<a href="campaigns/{CAMPAIGN}/corrected_drives.parquet">corrected_drives</a>' in _with_file(folder)
    unsure = _with_file(folder, effects="unexplained", no_answer="no", not_in_model="not corrected: no")
    assert "corrected_drives.parquet" not in unsure


def test_a_corrected_file_that_is_worse_than_the_calibration_is_the_headline(folder):
    headline = (
        "the corrected file has a residual error of 0.35 mm rms, the calibration one of 0.009 mm; it cannot hold: ball1"
    )
    sizes = {"file_error_mm": 0.3, "file_error_fresh_mm": 0.3, "file_expected_mm": 0.3}
    text = _with_file(folder, file_headline=headline, not_in_model="ball1", **sizes)
    assert f'<p class="lead">T{headline[1:]}.</p>' in text


def test_a_file_that_was_not_corrected_has_no_link_but_a_reason(folder):
    text = _with_file(folder, not_in_model="not corrected: its residual error would be 1 mm rms")
    assert (
        "corrected.urdf" not in text
        and "Your robot&#39;s file was not corrected: its residual error would be 1 mm rms." in text
    )


def test_a_corrected_file_that_is_the_diagnosed_robot_is_off_by_no_rounding(folder):
    text = _with_file(folder, file_error_mm=1.1e-9, file_error_fresh_mm=0.0, file_expected_mm=0.02)
    assert "It is less than 0.001 mm rms off the diagnosed robot at the measured poses, less than 0.001 mm at" in text


def test_without_an_answer_that_is_the_headline_and_no_cause_is_on_the_card(folder):
    why = "the residual of the best answer is 12 mm rms, 600 times the noise of 0.02 mm"
    text = _with_file(folder, effects="unexplained", no_answer=why, not_in_model=f"not corrected: {why}")
    card = text[text.index(f'id="answer-{CAMPAIGN}"') : text.index("</article>")]
    assert f'<p class="lead">No cause is named: {why}.</p>' in card and "corrected.urdf" not in card
    assert "rrru check" in card and "backlash" not in card and "link flexure" not in card


def test_texts_of_files_are_texts_on_the_page(folder):
    assert "a &lt;b&gt; &amp; c" in written(folder)


def test_each_cause_says_what_to_inspect_and_what_to_do_with_its_source(folder):
    text = written(folder)
    for cause in answered()["effects"]:
        assert all(str(escape(cause[part])) in text for part in ("inspect", "remedy", "source"))
    assert "<dt>Link flexure in leg 2</dt>" in text


def test_the_genetic_algorithm_s_figure_is_shown_of_campaigns_that_it_has_searched_alone(folder):
    figure = folder / f"figures/{CAMPAIGN}/convergence.svg"
    shutil.copy(folder / f"figures/{CAMPAIGN}/gap.svg", figure)
    genetic, _ = synthetic_tables.genetic()
    shown = f'id="figure-{CAMPAIGN}-convergence"'
    assert shown not in written(folder)
    tables.write(TABLES["genetic"], genetic.assign(campaign="other"), folder / "tables/genetic.parquet")
    assert shown not in written(folder)
    tables.write(TABLES["genetic"], genetic.assign(campaign=CAMPAIGN), folder / "tables/genetic.parquet")
    assert shown in written(folder)


def test_a_folder_without_a_diagnosis_says_what_to_run(tmp_path):
    assert "No campaign has been diagnosed yet" in written(tmp_path)


def test_a_figure_that_is_large_as_svg_is_shown_as_a_picture(folder, monkeypatch):
    assert "data:image/png" not in written(folder)
    monkeypatch.setattr(files, "LARGEST_SVG", 100)
    text = written(folder)
    assert f'<img alt="{CAMPAIGN}: The whole diagnosis" src="data:image/png;base64,' in text
