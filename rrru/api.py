"""The library: from a robot and a file of measurements to its calibration, its diagnosis and a corrected model.

    import rrru

    robot = rrru.load_robot("arm.urdf", tip="tool0")
    campaign = rrru.read_campaign("run.csv", robot, noise_mm=0.03)
    diagnosis = rrru.diagnose(campaign)
    print(diagnosis)
    diagnosis.write_corrected("arm_corrected.urdf")

Lengths in mm, angles in rad. Every function raises subclasses of `rrru.RrruError` with a message that says what is
wrong with which value, what is allowed, and what to do.
"""

import html
import re
import tempfile
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from rrru.calibration.calibrate import Calibration
from rrru.diagnosis.diagnose import STEPS
from rrru.diagnosis.diagnose import Diagnosis as CoreDiagnosis
from rrru.diagnosis.verdict_facts import NOT_CORRECTED
from rrru.errors import ConfigError, IngestError, RrruError, not_a_file
from rrru.figures.drawing import draw, draw_all, requests
from rrru.figures.files import figure_paths, with_svg
from rrru.kinematics.robot import Robot
from rrru.pipeline import config as parts
from rrru.pipeline import setup
from rrru.pipeline.jobs import calibrate as calibrate_job
from rrru.pipeline.jobs import compensate as compensate_job
from rrru.pipeline.jobs import diagnose as diagnose_job
from rrru.pipeline.jobs import genetic as genetic_job
from rrru.pipeline.jobs import read as read_job
from rrru.pipeline.jobs.outputs import (
    CAMPAIGN_FIGURES,
    CAMPAIGN_TABLES,
    GAP_FIGURES,
    GAP_TABLES,
    READ_TABLES,
    part_path,
)
from rrru.pipeline.progress import Progress, shown
from rrru.pipeline.read_config import check_config, merged, read_config
from rrru.report import page
from rrru.store import json_files
from rrru.store.atomic_write import whole, write_text


@dataclass(frozen=True)
class RobotModel:
    """A robot of the user's own, or one of the package's. Made by `load_robot`.

    name; entry: what describes it, an entry of the configuration's section `robots`.

    >>> robot = load_robot("data/models/arm6.urdf")
    >>> robot.drives
    ('axis1_rad', 'axis2_rad', 'axis3_rad', 'axis4_rad', 'axis5_rad', 'axis6_rad')
    >>> robot.mechanism.forward(np.zeros((1, 6))).round(1)
    array([[590.,   0., 865.]])
    """

    name: str
    entry: Mapping[str, Any]

    @cached_property
    def mechanism(self) -> Robot:
        """The nominal robot with its kinematics, see `rrru.kinematics.robot.Robot`."""
        return setup.mechanism(parts.robot({"robots": {self.name: self.entry}}, {"robot": self.name}))

    @property
    def drives(self) -> tuple[str, ...]:
        """Names of the columns in which a file of measurements has its drive values, with their units as suffix."""
        return tuple(self.mechanism.parts.columns)

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the error parameters that measured positions may identify."""
        return tuple(self.mechanism.parameters.names)

    def __repr__(self) -> str:
        return f"RobotModel({self.name!r}, drives: {', '.join(self.drives)})"


@dataclass(frozen=True)
class Campaign:
    """Measurements of one robot. Made by `read_campaign`.

    name; robot; config: the configuration that it was read with; frames: its tables by name, see results/README.md.

    >>> campaign = read_campaign("data/field_09.csv", load_robot("rrru3"), noise_mm=0.02)
    >>> campaign
    Campaign('field_09', 732 readings of rrru3, noise 0.02 mm)
    >>> float(campaign.measurements["payload_kg"].max())
    5.0
    >>> campaign.section
    {'robot': 'rrru3', 'ingest': 'data/field_09.csv', 'noise_mm': 0.02}
    >>> campaign.notes
    ()
    """

    name: str
    robot: RobotModel
    config: Mapping[str, Any] = field(repr=False)
    frames: Mapping[str, pd.DataFrame] = field(repr=False)

    @property
    def measurements(self) -> pd.DataFrame:
        """One row per reading in mm and rad: command, drive values, measured position, status."""
        return self.frames["measurements"]

    @property
    def notes(self) -> tuple[str, ...]:
        """What was computed, guessed or found missing while the file was read."""
        return tuple(filter(None, self.frames["campaigns"]["notes"].iloc[0].split("; ")))

    @property
    def section(self) -> Mapping[str, Any]:
        """The campaign's section of the configuration: what to write into a YAML file for the workflow."""
        return self.config["campaigns"][self.name]

    def __repr__(self) -> str:
        row = self.frames["campaigns"].iloc[0]
        return f"Campaign({self.name!r}, {row['points']} readings of {self.robot.name}, noise {row['noise_mm']:.3g} mm)"


@dataclass(frozen=True)
class CalibrationResult:
    """Calibrations of a campaign on every set of its trajectories. Made by `calibrate`.

    campaign; settings: of the calibration; frames: tables by name; fits: {(set, method):
    `rrru.calibration.calibrate.Calibration`}.

    >>> result = calibrate(read_campaign("data/field_09.csv", load_robot("rrru3"), noise_mm=0.02))
    >>> result
    CalibrationResult('field_09', rms 0.0477 mm)
    >>> result.parameters.query("method == 'least_squares'")[["parameter", "value", "standard_error"]].head(2).round(4)
      parameter   value  standard_error
    0   dtheta1  0.0026          0.0001
    1   dtheta2  0.0007          0.0001
    >>> result.summary["method"].tolist()
    ['least_squares', 'least_mean_distance']
    """

    campaign: Campaign
    settings: Mapping[str, Any] = field(repr=False)
    frames: Mapping[str, pd.DataFrame] = field(repr=False)
    fits: Mapping[tuple[str, str], Calibration] = field(repr=False)

    @property
    def parameters(self) -> pd.DataFrame:
        """Error parameters with standard errors, in mm and rad: table `parameters`."""
        return self.frames["parameters"]

    @property
    def summary(self) -> pd.DataFrame:
        """Residual errors, noise, rank, condition and observability indices: table `calibrations`."""
        return self.frames["calibrations"]

    @property
    def correlations(self) -> pd.DataFrame:
        """Correlations of the estimates: table `correlations`."""
        return self.frames["correlations"]

    @property
    def not_identifiable(self) -> pd.DataFrame:
        """Parameters that these poses do not identify, and what replaces them: table `gauge`."""
        return self.frames["gauge"]

    @property
    def rms_mm(self) -> float:
        """Root mean square 3-D residual of least squares on the first set of trajectories."""
        return float(next(fit.rms_mm for (_, method), fit in self.fits.items() if method == "least_squares"))

    def __repr__(self) -> str:
        held = int(next(iter(self.fits.values())).at_bound.sum())
        bounds = f", {held} parameter{'s' if held > 1 else ''} at a bound: widen calibration.bounds" if held else ""
        return f"CalibrationResult({self.campaign.name!r}, rms {self.rms_mm:.3g} mm{bounds})"

    def _repr_html_(self) -> str:
        return self.parameters.to_html(index=False)


@dataclass(frozen=True)
class DiagnosisResult:
    """Why a calibrated robot still misses. Made by `diagnose`.

    campaign; result: the `rrru.diagnosis.diagnose.Diagnosis` with model and posterior.

    >>> diagnosis = diagnose(read_campaign("data/field_09.csv", load_robot("rrru3"), noise_mm=0.02))
    >>> diagnosis.causes.query("probability > 0.5")["effect"].tolist()
    ['thermal_growth']
    >>> diagnosis.parameters.query("effect == 'thermal_growth'")["parameter"].tolist()
    ['strain', 'time_constant']
    >>> diagnosis.budget.query("part == 'thermal_growth'")["share"].round(1).item()
    0.9
    >>> diagnosis.next_runs.empty
    True
    >>> '"name": "thermal_growth"' in diagnosis.to_json()
    True
    >>> len(diagnosis.plot().axes) > 1
    True
    >>> diagnosis.write_corrected("mine.urdf")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    rrru.errors.ConfigError: robot rrru3 has no file that could be corrected; allowed: ...
    """

    campaign: Campaign
    result: CoreDiagnosis = field(repr=False)

    @cached_property
    def verdict(self) -> dict[str, Any]:
        """The answer, as `verdict.json` of the workflow has it; rrru/pipeline/verdict.schema.yaml has its keys."""
        return diagnose_job.facts(self._settings, self.result, self._robot)

    @property
    def sentences(self) -> tuple[str, ...]:
        """The answer in words, the most important sentence first."""
        return tuple(self.verdict["sentences"])

    @cached_property
    def tables(self) -> dict[str, pd.DataFrame]:
        """All tables of the diagnosis by name, see results/README.md."""
        return diagnose_job.frames_of(self._settings, self.result)

    @property
    def causes(self) -> pd.DataFrame:
        """Posterior probability of every effect that may act: table `gap_attribute`.

        It is NaN for an effect that was not tested: its `decision` is "not tested", its `note` says why.
        """
        return self.tables["gap_attribute"]

    @property
    def budget(self) -> pd.DataFrame:
        """Parts of the residual error with 95 % intervals: table `gap_budget`."""
        return self.tables["gap_budget"]

    @property
    def parameters(self) -> pd.DataFrame:
        """Error parameters and sizes of the effects with 95 % intervals: table `gap_parameters`."""
        return self.tables["gap_parameters"]

    @property
    def next_runs(self) -> pd.DataFrame:
        """Runs that would separate what is confounded, the most informative first: table `gap_next_runs`."""
        return self.tables["gap_next_runs"]

    def plot(self) -> Any:
        """The whole diagnosis as a matplotlib Figure."""
        place, needed = GAP_FIGURES["gap"]
        return draw(place, {name: self.tables[name] for name in needed}, self._figure_options)

    def to_json(self, path: str | Path | None = None) -> str:
        """The verdict as JSON text; path: a file to write it to as well."""
        text = json_files.text(self.verdict)
        if path is not None:
            json_files.write(self.verdict, str(path))
        return text

    def write_corrected(self, path: str | Path) -> "DiagnosisResult":
        """Write the robot's file with what was found, and return the DiagnosisResult with what that file leaves.

        Raises ConfigError where the robot is not of a URDF or MJCF, or where the file cannot be corrected.
        """
        kind = parts.corrected_kind(self.campaign.config, self.campaign.section)
        if not kind:
            allowed = "a robot of a URDF with one tip, or of an MJCF"
            raise ConfigError(
                f"robot {self.campaign.robot.name} has no file that could be corrected; allowed: {allowed}"
            )
        given = parts.own_robot_file(self.campaign.robot.entry)
        if given is not None and Path(path).resolve() == given.resolve():
            raise ConfigError(f"{path} is the robot's own file; allowed: another path, it stays as it is")
        # next to its place, since paths of meshes are relative to the file
        with whole(path) as (partial,):
            corrected = self._corrected(str(partial))
            if why := corrected.not_corrected:
                raise ConfigError(f"robot {self.campaign.robot.name}: {why}")
        return corrected

    @property
    def not_corrected(self) -> str:
        """Why the robot's file could not be corrected, empty where it could or where this was not tried."""
        lost = self.result.verdict["not_in_model"]
        return lost if lost.startswith(NOT_CORRECTED) else ""

    def write(self, folder: str | Path, figures: Sequence[str] = (), *, processes: Executor | None = None) -> Path:
        """Write page, JSON, tables, figures and corrected file of the campaign into a folder of results.

        figures: kinds of the figures' files besides SVG, "pdf" and "png"; a figure that is too large for the page as
        SVG is a PNG there; processes: to draw in, see `rrru.figures.processes`. Returns the path of the page. A page of
        the workflow for the same campaign and configuration has the same bytes. Raises ConfigError for another kind.
        """
        kinds = with_svg(figures)
        name, config, folder = self.campaign.name, self.campaign.config, Path(folder)
        paths = _paths(folder, name, config)
        read_job.write(self._read_settings, self.campaign.frames, paths)
        calibration = calibrate(self.campaign)
        calibrate_job.write(calibration.settings, calibration.frames, self.campaign.frames["campaigns"], paths)
        frames = {**self.campaign.frames, **calibration.frames}
        genetic = genetic_job.genetic(parts.calibration_settings(config, name, *parts.GENETIC_KEYS), frames)
        genetic_job.write(genetic, paths)
        settings = parts.calibration_settings(config, name, driven=True)
        compensate_job.write(compensate_job.compensate(settings, frames | genetic), paths)
        done = self._corrected(paths["corrected"]) if "corrected" in paths else self
        diagnose_job.write(self._settings, done.result, self._robot, paths)
        drawings = diagnose_job.figures(self._settings, self._robot, paths, kinds)
        drawings += requests(CAMPAIGN_FIGURES, paths, parts.figure_options(config, name), paths, kinds)
        draw_all(drawings, processes)
        target = Path(folder, "campaigns", name, "report.html")
        page.write(str(folder), str(target), "", name)
        return target

    def report(self, path: str | Path) -> Path:
        """Write the page alone, one self-contained HTML file."""
        with tempfile.TemporaryDirectory() as folder:
            write_text(self.write(folder).read_text(encoding="utf-8"), path)
        return Path(path)

    def __str__(self) -> str:
        return "\n".join(self.sentences)

    def __repr__(self) -> str:
        return f"DiagnosisResult({self.campaign.name!r}: {self.sentences[0]})"

    def _repr_html_(self) -> str:
        said = "".join(f"<p>{html.escape(sentence)}</p>" for sentence in self.sentences)
        return said + self.budget.to_html(index=False)

    @cached_property
    def _settings(self) -> dict[str, Any]:
        return parts.diagnosis_settings(self.campaign.config, self.campaign.name, self.campaign.section)

    @property
    def _figure_options(self) -> dict[str, Any]:
        return diagnose_job.figure_options(self._settings, self._robot)

    @cached_property
    def _read_settings(self) -> dict[str, Any]:
        return parts.read_settings(self.campaign.config, self.campaign.name)

    @cached_property
    def _robot(self) -> Robot:
        return setup.measured_robot(self._settings["robot"], self.campaign.measurements)

    def _corrected(self, path: str) -> "DiagnosisResult":
        return DiagnosisResult(self.campaign, diagnose_job.with_corrected(self._settings, self.result, path))


def load_robot(
    source: str | Path | Mapping[str, Any],
    *,
    name: str | None = None,
    tip: str | None = None,
    base: str | None = None,
    tips: Mapping[str, str] | None = None,
    carries: Mapping[str, Sequence[str]] | None = None,
    home: Mapping[str, float] | None = None,
    platform: str | None = None,
    tool_mm: Sequence[float] | None = None,
    up: Sequence[float] | None = None,
    limits: Mapping[str, float] | None = None,
) -> RobotModel:
    """A robot from a URDF or MJCF file, from one of the package's names, or from an entry of a configuration.

    source: path of a URDF (a serial arm) or MJCF (closed loops by equality constraints); "rrru3", "ptt3" or "delta";
    path of a YAML file with a section `robots`, of which `name` chooses one; or such an entry as a mapping, for
    example with rows of a DH table. name: by default the file's. tip, base: links of a URDF; tips: links of several
    end effectors by name, carries: names of the targets on each; home: joint values of a pose that is not singular, rad
    or mm; platform: the MJCF's body that carries the measured point; tool_mm: the measured point in the last frame;
    up (3,): direction against gravity in the base's frame, by default z, or as an MJCF states it; limits: of further
    runs, `payload_kg`, `speed_mm_s`, `minutes`.

    Raises ConfigError for a file that cannot be read, an unknown name, or a wrong value.

    >>> load_robot("rrru3")
    RobotModel('rrru3', drives: theta1_rad, theta2_rad, theta3_rad)
    >>> whole_turn = {"range_deg": [-180, 180]}
    >>> load_robot({"dh": [{"a_mm": 300.0, **whole_turn}, {"a_mm": 200.0, **whole_turn}]}, name="planar").drives
    ('q1_rad', 'q2_rad')
    """
    stated: dict[str, Any] = {"tip": tip, "base": base, "tips": tips, "carries": carries, "home": home}
    stated |= {"platform": platform, "tool_mm": tool_mm, "up": up, "limits": limits}
    given = {key: _plain(value) for key, value in stated.items() if value is not None}
    name, entry = _entry(source, name)
    entry = merged(entry, given)
    check_config({"robots": {name: entry}})
    robot = RobotModel(name, entry)
    # what is wrong with its file shows here
    _ = robot.mechanism
    return robot


def read_campaign(
    data: str | Path | pd.DataFrame,
    robot: RobotModel,
    *,
    name: str | None = None,
    noise_mm: float | None = None,
    noise_rad: float | None = None,
    noise_known: bool | None = None,
    frame: str | None = None,
    registration_points: Sequence[Sequence[int]] | None = None,
    targets: Mapping[str, Sequence[float]] | None = None,
    world_targets: Sequence[str] | None = None,
    columns: Mapping[str, str] | None = None,
    extra_columns: str | None = None,
    unit: str | None = None,
    angle_unit: str | None = None,
    drive_unit: str | None = None,
    signs: Mapping[str, int] | None = None,
    order: Sequence[str] | None = None,
    motion: str | Mapping[str, str] | None = None,
    commands: str | Path | Mapping[str, Any] | None = None,
    format: str | Mapping[str, Any] | None = None,
    time_format: str | None = None,
    elbow: str | None = None,
    platform_mass_kg: float | None = None,
    limits: Mapping[str, float] | None = None,
    errors: str | None = None,
    config: Mapping[str, Any] | None = None,
) -> Campaign:
    """Measurements of a robot from a CSV, Excel, parquet or tracker file, or from a DataFrame.

    data: docs/own-data.md has the columns. noise_mm, noise_rad: of the instrument, 1 sigma per axis; without them they
    are read from the file or estimated; noise_known: they are exact. frame: "register" where the instrument's frame is
    not the robot's; registration_points: pairs (run, point) for it. targets: places of reflectors on the platform in
    mm; world_targets: those that are fixed to the ground. columns: our name to the file's. signs: drive to -1 where the
    file counts it in the opposite sense; order: names of the drives in the order of the file's columns. motion:
    "stop_and_go" or "continuous". commands: a second file with the commanded positions. errors: set of parameters to
    calibrate. config: a configuration instead of the package's defaults, see `rrru.pipeline.read_config`. The others
    are those of docs/own-data.md.

    Raises IngestError with every problem of the file, and ConfigError for a wrong value.

    >>> campaign = read_campaign("data/field_01.csv", load_robot("rrru3"), noise_mm=0.02)
    >>> len(campaign.measurements)
    222
    """
    stated = {key: value for key, value in locals().items() if key not in ("data", "robot", "name", "config")}
    _require(robot, RobotModel, "rrru.load_robot")
    if not isinstance(data, str | Path | pd.DataFrame):
        raise ConfigError(f"data is a {type(data).__name__}; allowed: the path of a file, or a pandas DataFrame")
    given = {key: _plain(value) for key, value in stated.items() if value is not None}
    name = name or ("measurements" if isinstance(data, pd.DataFrame) else as_name(Path(data).stem))
    base = read_config() if config is None else config
    section = {"robot": robot.name, "ingest": str(data) if not isinstance(data, pd.DataFrame) else name, **given}
    made = {key: {**base[key]} for key in ("robots", "campaigns")}
    made["robots"][robot.name], made["campaigns"][name] = robot.entry, section
    made = {**base, **made}
    check_config(made)
    parts.check({**made, "campaigns": {name: section}})
    if isinstance(data, pd.DataFrame):
        return _of_frame(data, robot, name, made)
    return Campaign(name, robot, made, read_job.read(parts.read_settings(made, name)))


def configured_campaign(name: str, config: Mapping[str, Any] | str | Path | Sequence[str | Path]) -> Campaign:
    """A measured campaign of a configuration.

    config: path of a YAML file with sections `robots` and `campaigns`, or several, each on top of the one before, or
    such a configuration. Raises ConfigError where it has no such campaign or a virtual one, and IngestError with every
    problem of its file.

    >>> configured_campaign("field_01", "config.yaml")
    Campaign('field_01', 222 readings of rrru3, noise 0.02 mm)
    """
    if isinstance(config, Mapping):
        whole: Mapping[str, Any] = config
    else:
        whole = read_config([config] if isinstance(config, str | Path) else config)
    section = parts.entry(whole, "campaigns", name, "campaign")
    if "ingest" not in section:
        raise ConfigError(f"campaign {name} is a virtual one; allowed: a measured one, or run it by snakemake")
    alone = {**whole, "campaigns": {name: section}}
    parts.check(alone)
    parts.check_files(alone)
    robot = RobotModel(section["robot"], whole["robots"][section["robot"]])
    return Campaign(name, robot, whole, read_job.read(parts.read_settings(whole, name)))


def calibrate(campaign: Campaign) -> CalibrationResult:
    """Calibrate a robot on a campaign by least squares.

    Raises FitError where the readings do not determine the parameters.

    >>> campaign = read_campaign("data/field_01.csv", load_robot("rrru3"), noise_mm=0.02)
    >>> round(calibrate(campaign).rms_mm, 3)
    0.083
    """
    _require(campaign, Campaign, "rrru.read_campaign")
    settings = parts.calibration_settings(campaign.config, campaign.name, *parts.CALIBRATION_KEYS)
    frames, fits = calibrate_job.calibrate(settings, campaign.measurements, campaign.frames["campaigns"])
    return CalibrationResult(campaign, settings, frames, fits)


def diagnose(
    campaign: Campaign,
    *,
    effects: str | Sequence[str] | None = None,
    own_effects: Sequence[str] | None = None,
    known: Mapping[str, Mapping[str, float]] | None = None,
    seed: int | None = None,
    progress: bool | Progress = False,
) -> DiagnosisResult:
    """Why a calibrated robot still misses: posterior probability, size and interval of every cause.

    effects: names of the effects that may act, "all" by default; own_effects: `module:object` of the user's own, see
    docs/own-effect.md; known: effect to known values of its parameters, such as a gear ratio; seed: of the resampling
    for intervals. progress: True for a bar of tqdm, or a function that is called at the beginning of each step with its
    name, its number from 0 and the number of steps.

    Raises FitError where the readings do not determine the calibration with some 20 to spare, and ConfigError for an
    unknown effect.

    >>> campaign = read_campaign("data/field_09.csv", load_robot("rrru3"), noise_mm=0.02)
    >>> [cause["name"] for cause in diagnose(campaign).verdict["effects"]]
    ['thermal_growth']
    """
    _require(campaign, Campaign, "rrru.read_campaign")
    named = [effects] if isinstance(effects, str) and effects != "all" else effects
    stated = {"effects": named, "own_effects": own_effects, "known": known}
    gap = {key: _plain(value) for key, value in stated.items() if value is not None}
    config = merged(campaign.config, {"gap": gap} | ({} if seed is None else {"seed": seed}))
    check_config(config)
    campaign = Campaign(campaign.name, campaign.robot, config, campaign.frames)
    settings = parts.diagnosis_settings(config, campaign.name, campaign.section)
    with shown(progress, STEPS) as begin:
        return DiagnosisResult(campaign, diagnose_job.diagnose(settings, campaign.measurements, begin))


def _entry(source: str | Path | Mapping[str, Any], name: str | None) -> tuple[str, dict[str, Any]]:
    """Name and entry of the section `robots` for the source of a robot."""
    if isinstance(source, Mapping):
        return name or "robot", _plain(source)
    if not isinstance(source, str | Path):
        allowed = "a path, a name, or an entry of a configuration as a mapping"
        raise ConfigError(f"the source of a robot is a {type(source).__name__}; allowed: {allowed}")
    known, path = read_config()["robots"], Path(source)
    if str(source) in known:
        if name not in (None, str(source)):
            raise ConfigError(f"robot {source}: name is {name!r}; allowed: its own, robots of the package keep theirs")
        return str(source), known[str(source)]
    if why := not_a_file(path):
        allowed = f"a URDF, MJCF or YAML file, or {', '.join(known)}"
        raise ConfigError(f"robot {str(source)!r}: {why}; allowed: {allowed}")
    if path.suffix.lower() in (".yaml", ".yml"):
        described = {key: one for key, one in read_config([path])["robots"].items() if key not in known or key == name}
        chosen = name or (next(iter(described)) if len(described) == 1 else None)
        if chosen is None or chosen not in described:
            raise ConfigError(f"{path}: robots has no {chosen!r}; allowed: name as one of {', '.join(described)}")
        return chosen, described[chosen]
    kind, stem = _kind(path), as_name(path.stem)
    # an entry under the name of a robot of the package would be merged into that one's
    return name or (f"{stem}_{kind}" if stem in known else stem), {kind: str(path)}


def _kind(path: Path) -> str:
    """The key of a robot's file, "urdf" or "mjcf", by its root element."""
    root = re.search(r"<\s*(robot|mujoco)\b", path.read_text(encoding="utf-8", errors="replace"))
    if root is None:
        raise ConfigError(f"{path}: no <robot> and no <mujoco> in it; allowed: a URDF or an MJCF file")
    return {"robot": "urdf", "mujoco": "mjcf"}[root.group(1)]


def _of_frame(data: pd.DataFrame, robot: RobotModel, name: str, config: dict[str, Any]) -> Campaign:
    """The Campaign of a DataFrame, which is read as a file of parquet is."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, f"{name}.parquet")
        pd.DataFrame({str(key): _stored(column) for key, column in data.reset_index(drop=True).items()}).to_parquet(
            file
        )
        settings = parts.read_settings(config, name)
        try:
            frames = read_job.read({**settings, "section": {**settings["section"], "ingest": str(file)}})
        except IngestError as error:
            raise IngestError([problem | {"file": f"DataFrame {name}"} for problem in error.problems]) from None
        except RrruError as error:
            raise type(error)(str(error).replace(str(file), f"DataFrame {name}")) from None
    frames["campaigns"] = frames["campaigns"].assign(source="DataFrame")
    return Campaign(name, robot, config, frames)


def _stored(column: pd.Series) -> pd.Series:
    """A column as parquet can hold it: cells of several types as texts, which are read as those of a file."""
    if column.dtype != object:
        return column
    return column.map(lambda cell: cell if cell is None or isinstance(cell, str) else str(cell), na_action="ignore")


def _require(value: Any, kind: type, made_by: str) -> None:
    """Raise ConfigError where an argument is not what another function has made."""
    if not isinstance(value, kind):
        raise ConfigError(f"got a {type(value).__name__} in place of a {kind.__name__}; allowed: a result of {made_by}")


def _paths(folder: Path, name: str, config: Mapping[str, Any]) -> dict[str, str]:
    """Paths of all files of a campaign in a folder of results, as the workflow has them."""
    named = (*READ_TABLES, *CAMPAIGN_TABLES, *GAP_TABLES, "gap_points", "corrected_drives")
    kind = parts.corrected_kind(config, config["campaigns"][name])
    return {
        **{table: part_path(folder, name, table) for table in named},
        **figure_paths(f"{folder}/figures/{name}", {**CAMPAIGN_FIGURES, **GAP_FIGURES}),
        "timings": f"{folder}/timings/{name}.parquet",
        "verdict": f"{folder}/campaigns/{name}/verdict.json",
        "robot": f"{folder}/campaigns/{name}/robot.json",
        **({"corrected": f"{folder}/campaigns/{name}/corrected.{kind}"} if kind else {}),
    }


def as_name(text: str) -> str:
    """A text as a name of the configuration: letters, digits, _ and -.

    >>> as_name("run 1 (cold)")
    'run_1__cold_'
    """
    return "".join(sign if sign.isascii() and (sign.isalnum() or sign in "_-") else "_" for sign in text) or "campaign"


def _plain(value: Any) -> Any:
    """A value in the types of YAML: mappings, lists, texts and numbers."""
    if isinstance(value, Mapping):
        return {str(key): _plain(one) for key, one in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, str | bytes) or not isinstance(value, Sequence):
        return str(value) if isinstance(value, Path) else value
    return [_plain(one) for one in value]
