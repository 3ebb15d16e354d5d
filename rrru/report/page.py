"""The report: one self-contained HTML file of a folder of results."""

import base64
import html
import os
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import jinja2
import pandas as pd

from rrru.figures.files import fits_page
from rrru.report import cards, cells, contents, svg
from rrru.report.trust import trust
from rrru.report.worth import Worth, worth
from rrru.store import json_files, tables
from rrru.store.atomic_write import write_text
from rrru.store.schema import Table
from rrru.studies import glossary

TEMPLATES = Path(__file__).parent / "templates"
# heads of columns that hold numbers of legs or, for robots without legs, of drives
_HEADS = {"legs": "leg or drive"}
_TRUST = ("parameters", "correlations", "calibrations", "gap_parameters", "gap_verdicts")


@dataclass(frozen=True)
class Picture:
    """A figure of the page: key, title, caption, and its markup."""

    key: str
    title: str
    caption: str
    markup: str
    width: int


@dataclass(frozen=True)
class Part:
    """A section with its pictures and tables."""

    key: str
    title: str
    about: str
    pictures: list[Picture]
    grids: list[cells.Grid]


@dataclass(frozen=True)
class Results:
    """What a run has written to a folder.

    reproduced: the campaign whose figures are next to the study's; campaign: the one whose parts are read, None for the
    whole study; glyphs: shared glyphs of the figures that were asked for; frames: tables that were asked for.
    """

    folder: Path
    reproduced: str
    campaign: str | None = None
    glyphs: dict[str, str] = field(default_factory=dict)
    frames: dict[str, pd.DataFrame | None] = field(default_factory=dict)

    @cached_property
    def schemas(self) -> dict[str, Table]:
        """All tables that the package knows, by name."""
        known: dict[str, Table] = glossary.tables()
        return known

    def place(self, name: str) -> Path:
        """Path of a table."""
        if self.campaign:
            return self.folder / "campaigns" / self.campaign / f"{name}.parquet"
        return self.folder / "tables" / f"{name}.parquet"

    def frame(self, name: str) -> pd.DataFrame | None:
        """A table as a frame, None where it was not made or holds nothing."""
        if name not in self.frames:
            place = self.place(name)
            frame = tables.read(place) if place.is_file() else None
            self.frames[name] = None if frame is None or frame.empty else frame
        return self.frames[name]

    def campaigns(self) -> list[str]:
        """Campaigns that the last run has diagnosed, measured ones first."""
        frame, sources = self.frame("gap_verdicts"), self.sources()
        names = [] if frame is None else frame["campaign"]
        return sorted(names, key=lambda name: (not sources.get(name, "").startswith("file"), name))

    def owners(self) -> set[str]:
        """Names whose figures belong to this run: other figures in the folder may be of an earlier run."""
        frame = self.frame("real_verdicts")
        return {self.reproduced, *self.campaigns(), *(() if frame is None else frame["dataset"])}

    def sources(self) -> dict[str, str]:
        """Where each campaign came from, by name."""
        frame = self.frame("campaigns")
        return {} if frame is None else dict(zip(frame["campaign"], frame["source"], strict=True))

    def worth(self, name: str, noise_rms_mm: float) -> Worth | None:
        """The Worth of a campaign's calibration, None where the tables of it were not made."""
        errors, campaigns = self.frame("errors"), self.frame("campaigns")
        place = self.folder / "campaigns" / name / "gap_points.parquet"
        if errors is None or campaigns is None or not place.is_file():
            return None
        registered = campaigns.set_index("campaign")["registration_rms_mm"].notna().get(name, False)
        return worth(errors[errors["campaign"] == name], tables.read(place), noise_rms_mm, bool(registered))

    def models(self, name: str, start: Path) -> list[str]:
        """Links to the robot's corrected file from the folder start; empty for a robot without a file."""
        found = sorted((self.folder / "campaigns" / name).glob("corrected.*"))
        return [os.path.relpath(place, start) for place in found]

    def drives(self, name: str, start: Path) -> str:
        """Link to the robot's `corrected_drives` from the folder start; empty where there are none."""
        place = self.folder / "campaigns" / name / "corrected_drives.parquet"
        return os.path.relpath(place, start) if place.is_file() and len(tables.read(place)) else ""

    def picture(self, name: str, title: str) -> Picture | None:
        """A figure of a path below figures/ without its ending, None where it was not drawn."""
        place = self.folder / "figures" / f"{name}.svg"
        if not place.is_file():
            return None
        text, key = place.read_text(), name.replace("/", "-")
        caption = svg.caption(text)
        drawn = svg.inline(text, key, title)
        if fits_page(place):
            self.glyphs.update(drawn.glyphs)
            return Picture(key, title, caption, drawn.markup, drawn.width)
        data = base64.b64encode(place.with_suffix(".png").read_bytes()).decode()
        return Picture(
            key, title, caption, f'<img alt="{html.escape(title)}" src="data:image/png;base64,{data}">', drawn.width
        )

    def grid(self, shown: contents.Shown) -> cells.Grid | None:
        """A table of the page, None where there is nothing to show."""
        frame = self.frame(shown.name)
        if frame is None:
            return None
        frame = frame.query(shown.rows) if shown.rows else frame
        columns = [name for name in shown.columns.split() or frame if name in frame]
        frame = frame[columns].dropna(axis="columns", how="all")
        place = self.place(shown.name).relative_to(self.folder)
        heads = {name: text for name, text in _HEADS.items() if name in frame}
        made = cells.grid(frame, shown.name, shown.title, self.schemas.get(shown.name), str(place), heads)
        return made if made.rows else None


def write(folder: str | Path, path: str | Path, reproduced: str, campaign: str | None = None) -> None:
    """Write the page of a folder of results, or of one of its campaigns, as a whole or not at all; see Results."""
    results = Results(Path(folder), reproduced, campaign)
    names = results.campaigns()
    sources = results.sources()
    answers = []
    for name in names:
        answer = json_files.read(results.folder / "campaigns" / name / "verdict.json")
        drawn = results.picture(f"{name}/gap_map", f"{name}: residual errors")
        found = results.worth(name, answer["noise_rms_mm"])
        source, start = sources.get(name, "virtual robot of a study"), Path(path).parent
        links = results.models(name, start), results.drives(name, start)
        answers.append((cards.card(answer, source, found, *links), drawn))
    chosen = [s for s in contents.SECTIONS if campaign is None or s.key in contents.OF_A_CAMPAIGN]
    parts = [part for part in (_part(results, section) for section in chosen) if part]
    values = {"answers": answers, "parts": parts, "campaign": campaign, "glyphs": results.glyphs}
    write_text(render("report.html", **values), path)


def render(template: str, **values: Any) -> str:
    """A page of a template of this folder."""
    loader = jinja2.FileSystemLoader(TEMPLATES)
    environment = jinja2.Environment(
        loader=loader, autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    return environment.get_template(template).render(**values)


def _part(results: Results, section: contents.Section) -> Part | None:
    """A section with its pictures and tables, None where there are none."""
    wanted = [(name, title) for name, title in section.figures] if results.campaign is None else []
    wanted += [found for own in section.own for found in _of_campaigns(results, *own)]
    pictures = [picture for picture in (results.picture(*figure) for figure in wanted) if picture]
    grids = [grid for grid in map(results.grid, section.tables) if grid]
    if section.key == "calibration" and (judged := _trust(results)):
        grids.insert(0, judged)
    return Part(section.key, section.title, section.about, pictures, grids) if pictures or grids else None


def _of_campaigns(results: Results, name: str, title: str, needed: str) -> list[tuple[str, str]]:
    """Places and titles of a figure of every campaign that has rows in the needed table, where one is."""
    folder = results.folder / "figures"
    found = [place.relative_to(folder).with_suffix("") for place in sorted(folder.rglob(f"{name}.svg"))]
    owners = [(str(place), place.parent.name or results.reproduced) for place in found]
    known = results.owners() if results.campaign is None else {results.campaign}
    if needed:
        frame = results.frame(needed)
        known &= set() if frame is None else set(frame["campaign"])
    return [(place, f"{owner}: {title}") for place, owner in owners if owner in known]


def _trust(results: Results) -> cells.Grid | None:
    """The table of which parameters may be trusted, None where nothing was calibrated."""
    frames = [results.frame(name) for name in _TRUST]
    if any(frame is None for frame in frames):
        return None
    return cells.grid(trust(*frames).dropna(axis="columns", how="all"), "trust", "Which parameters may be trusted")
