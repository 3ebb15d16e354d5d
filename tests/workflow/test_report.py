"""The page of a whole run in a real browser: silent, complete, readable at any width, searchable; and its rules."""

import json
import re

import jsonschema
import pandas as pd
import pytest
import yaml

import rrru
from rrru.pipeline.read_config import read_config
from rrru.report import page
from tests.places import ROOT
from tests.workflow.browser import chromium, open_page, requested
from tests.workflow.folder import MINIMAL, dry_run

VIEWS = [(width, scheme) for width in (360, 1024, 1600) for scheme in ("light", "dark")]
# figures with nothing to see in them, names that are there twice, links to nowhere, and what is wider than the page
_FAULTS = """
const faults = [];
for (const figure of document.querySelectorAll("figure")) {
  const drawn = figure.querySelector("svg, img"), box = drawn.getBoundingClientRect();
  if (!drawn.checkVisibility() || box.width < 100 || box.height < 30) faults.push(`${figure.id} is not visible`);
  if (drawn.tagName === "IMG" && !(drawn.complete && drawn.naturalWidth)) faults.push(`${figure.id} has no picture`);
  if (!(drawn.getAttribute("aria-label") || drawn.alt)) faults.push(`${figure.id} says nothing to a screen reader`);
  if (!figure.querySelector("figcaption")?.textContent.trim()) faults.push(`${figure.id} has no caption`);
  for (const use of figure.querySelectorAll("use"))
    if (!document.getElementById(use.getAttribute("xlink:href").slice(1))) faults.push(`${figure.id} lacks a part`);
}
const names = [...document.querySelectorAll("[id]")].map((one) => one.id);
for (const name of names) if (names.indexOf(name) !== names.lastIndexOf(name)) faults.push(`${name} is there twice`);
for (const link of document.querySelectorAll("a"))
  if (!document.getElementById(link.getAttribute("href").slice(1))) faults.push(`${link} ends nowhere`);
if (document.documentElement.scrollWidth > innerWidth) faults.push("the page is wider than the window");
const levels = [...document.querySelectorAll("h1, h2, h3, h4")].map((one) => Number(one.tagName[1]));
levels.forEach((level, k) => { if (level > (k ? levels[k - 1] : 0) + 1) faults.push(`heading ${k} skips a level`); });
return faults;
"""
# tables whose campaigns have these figures
_OF = {"convergence": "genetic", "drive_functions": "gap_drive_functions"}
_ROWS = """
const rows = [...arguments[0].querySelectorAll("tbody tr")].filter((row) => row.checkVisibility());
return rows.map((row) => [...row.cells].map((cell) => cell.textContent));
"""


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    with chromium(tmp_path_factory.mktemp("profile")) as driver:
        yield driver


@pytest.fixture(scope="module")
def written(results, tmp_path_factory):
    """The page of the run, the optional check included."""
    place = tmp_path_factory.mktemp("page") / "report.html"
    page.write(results, place, "paper")
    return place


@pytest.mark.parametrize(("width", "scheme"), VIEWS)
def test_every_figure_is_visible_and_nothing_is_asked_of_the_network(browser, written, width, scheme):
    requested(browser)
    open_page(browser, written, width, scheme)
    assert browser.execute_script(_FAULTS) == []
    assert requested(browser) == [written.as_uri()]
    assert browser.get_log("browser") == []
    light = browser.execute_script("return getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    assert light == (scheme == "light")


def test_all_figures_and_answers_of_the_run_are_on_it(browser, written, results):
    open_page(browser, written, 1024, "light")
    shown = {figure.get_attribute("id") for figure in browser.find_elements("tag name", "figure")}
    files = [file.relative_to(results / "figures").with_suffix("") for file in results.glob("figures/**/*.svg")]
    # figures that say that there is nothing to draw are left out
    having = {
        name: set(pd.read_parquet(results / f"tables/{table}.parquet")["campaign"]) for name, table in _OF.items()
    }
    drawn = [file for file in files if file.name not in having or (file.parent.name or "paper") in having[file.name]]
    assert shown == {f"figure-{str(name).replace('/', '-')}" for name in drawn} and len(drawn) > 20
    for verdict in results.glob("campaigns/*/verdict.json"):
        facts = json.loads(verdict.read_text())
        said = browser.find_element("id", f"answer-{facts['campaign']}").text
        assert all(sentence in said for sentence in facts["sentences"])


def test_a_table_is_sorted_by_a_key_press_and_searched(browser, written, results):
    from selenium.webdriver.common.keys import Keys

    open_page(browser, written, 1600, "light")
    table = browser.find_element("id", "table-error_summary")
    heads = table.find_elements("css selector", "th")
    column = [head.text for head in heads].index("mean (mm)")
    before = browser.execute_script(_ROWS, table)
    for direction in (1, -1):
        heads[column].find_element("tag name", "button").send_keys(Keys.ENTER)
        rows = browser.execute_script(_ROWS, table)
        sizes = [float(row[column]) for row in rows if row[column] != "–"]
        assert sizes == sorted(sizes)[::direction] and sorted(rows) == sorted(before)
        assert heads[column].get_attribute("aria-sort") == {1: "ascending", -1: "descending"}[direction]
    table.find_element("css selector", "input").send_keys("field_01 spiral")
    found = browser.execute_script(_ROWS, table)
    assert found and sorted(found) == sorted(row for row in before if "field_01" in row and "spiral" in row)
    # one search for all tables counts what it finds, section by section
    browser.find_element("id", "find-all").send_keys("field_09")
    marks = {m.get_attribute("data-section"): m.text for m in browser.find_elements("class name", "hits")}
    summary = pd.read_parquet(results / "tables/error_summary.parquet")
    rows = (summary["campaign"] == "field_09") & summary["method"].isin(["none", "least_squares"])
    assert marks["cross"] == f"({rows.sum()})" and marks["printers"] == "(0)"


def test_links_of_the_contents_lead_to_their_sections(browser, written):
    open_page(browser, written, 1600, "light")
    browser.execute_script("document.documentElement.style.scrollBehavior = 'auto'")
    for link in browser.find_elements("css selector", "nav a"):
        link.click()
        top = browser.execute_script(
            "return document.getElementById(arguments[0]).getBoundingClientRect().top",
            link.get_attribute("href").partition("#")[2],
        )
        assert -1.0 <= top < 900.0, link.text


def test_the_page_is_small_and_its_bytes_follow_from_the_results(written, results, tmp_path):
    text = written.read_text()
    page.write(results, tmp_path / "again.html", "paper")
    assert (tmp_path / "again.html").read_text() == text and len(text) < 15e6
    assert not re.search(r"(?:src|href)=\"(?!#|data:)", text)
    assert 'id="withheld"' in text
    # what the rule has written may lack the optional check, which was no input of it
    ruled = (results / "report.html").read_text()
    assert ruled.partition("<main")[2].partition("<section")[0] == text.partition("<main")[2].partition("<section")[0]


def test_every_answer_fits_its_schema_and_says_what_the_tables_say(results):
    schema = yaml.safe_load((ROOT / "rrru/pipeline/verdict.schema.yaml").read_text())
    jsonschema.Draft202012Validator.check_schema(schema)
    verdicts = pd.read_parquet(results / "tables/gap_verdicts.parquet").set_index("campaign")
    files = sorted(results.glob("campaigns/*/verdict.json"))
    assert {file.parent.name for file in files} == set(verdicts.index)
    for file in files:
        facts = json.loads(file.read_text())
        jsonschema.validate(facts, schema)
        row = verdicts.loc[facts["campaign"]]
        names = [effect["name"] for effect in facts["effects"]] + ["unexplained"] * facts["unexplained"]
        assert "+".join(names or ["none"]) == row["effects"]
        for name in ("probability", "gap_rms_mm", "gap_after_rms_mm", "share_closed", "noise_rms_mm", "points"):
            assert facts[name] == row[name]


def test_the_page_of_one_campaign_takes_the_jobs_of_that_campaign_alone(shared):
    target = "build/minimal/campaigns/field_09/report.html"
    code, output = dry_run(shared, target, overlays=(MINIMAL, "field.yaml"))
    assert code == 0 and re.search(r"total +1\n", output), output


def test_the_library_writes_the_same_bytes_for_a_campaign(shared, tmp_path, monkeypatch):
    monkeypatch.chdir(shared)
    config = read_config(["config.yaml", MINIMAL, "field.yaml"])
    written = rrru.diagnose(rrru.configured_campaign("field_09", config)).write(tmp_path, ("pdf", "png"))
    made = shared / "build/minimal"
    for place in ("campaigns/field_09", "figures/field_09"):
        names = {path.name for path in (tmp_path / place).iterdir()} - {written.name}
        assert names == {path.name for path in (made / place).iterdir()} - {written.name}
        for name in names:
            assert (tmp_path / place / name).read_bytes() == (made / place / name).read_bytes(), name
    # as the rule of the campaign's page writes it
    page.write("build/minimal", tmp_path / "page.html", config["reproduce"]["campaign"], "field_09")
    assert written.read_bytes() == (tmp_path / "page.html").read_bytes()
