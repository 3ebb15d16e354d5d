"""The library: its examples, its results beside the workflow's, and what it refuses."""

import doctest
import inspect
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import yaml
from scipy.spatial.transform import Rotation

import rrru
from rrru import api
from rrru.figures import files
from rrru.pipeline.read_config import DEFAULTS, read_config
from tests.places import DATA, ROOT

FIELD = DATA / "field_12.csv"
ARM = DATA / "models/arm6.urdf"
ZERO_RAD, NOISE_MM = 1.5e-3, 0.01
# a pose of the arm in the middle of its joints' ranges, not singular
HOME = np.array([0.2, -0.4, 0.6, 0.3, 0.5, 0.1])


@pytest.fixture(scope="module")
def arm():
    return rrru.load_robot(ARM)


def _measured(arm, generator):
    """Readings of the arm whose second zero is off, by its own forward kinematics and a noise that is known."""
    drives = HOME + generator.uniform(-0.6, 0.6, (80, len(HOME)))
    frame = pd.DataFrame(drives, columns=arm.drives).assign(trajectory="poses")
    off = np.zeros(len(HOME))
    off[1] = ZERO_RAD
    seen = arm.mechanism.forward(drives + off) + generator.normal(0.0, NOISE_MM, (80, 3))
    return frame.assign(**dict(zip(("measured_x_mm", "measured_y_mm", "measured_z_mm"), seen.T, strict=True)))


def test_importing_the_package_loads_no_library_that_takes_long():
    heavy = "('numpy', 'scipy', 'pandas', 'numba', 'matplotlib', 'mujoco', 'snakemake')"
    code = f"import sys, rrru; print([name for name in {heavy} if name in sys.modules])"
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert ended.stdout.strip() == "[]"


def test_every_public_function_has_an_example_and_every_example_is_right(monkeypatch):
    monkeypatch.chdir(ROOT)
    functions = [getattr(rrru, name) for name in rrru.__all__ if name[0].islower()]
    assert len(functions) == 5 and all(">>>" in inspect.getdoc(one) for one in functions)
    results = [one for one in vars(rrru.api).values() if inspect.isclass(one) and one.__module__ == "rrru.api"]
    assert len(results) == 4 and all(">>>" in inspect.getdoc(one) for one in results)
    assert doctest.testmod(api).failed == 0
    assert all(inspect.getdoc(getattr(rrru, name)) for name in rrru.__all__ if name[0].isalpha())


def test_a_name_that_is_not_public_is_no_attribute():
    assert set(rrru.__all__) == set(dir(rrru))
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = rrru.nothing


def test_the_defaults_of_the_package_are_those_of_the_studies():
    study, own = yaml.safe_load((ROOT / "config.yaml").read_text()), yaml.safe_load(DEFAULTS.read_text())
    for name, section in own.items():
        if name in ("campaigns", "genetic"):
            # the studies' own
            continue
        stated = {key: study[name][key] for key in section} if isinstance(section, dict) else study[name]
        assert stated == section, name


def test_the_example_of_a_real_robot_is_the_robot_of_the_study():
    study, own = (yaml.safe_load((ROOT / name).read_text()) for name in ("config.yaml", "examples/ur10.yaml"))
    assert own["robots"]["ur10"] == study["robots"]["ur10"]


def test_a_data_frame_is_read_as_its_file_is(monkeypatch):
    monkeypatch.chdir(ROOT)
    robot = rrru.load_robot("rrru3")
    of_file = rrru.read_campaign(FIELD, robot, noise_mm=0.02)
    frame = pd.read_csv(FIELD)
    frame.index += 7
    of_frame = rrru.read_campaign(frame, robot, name="field_12", noise_mm=0.02)
    pd.testing.assert_frame_equal(of_file.measurements, of_frame.measurements)
    assert of_file.notes == of_frame.notes and of_frame.frames["campaigns"]["source"].item() == "DataFrame"


def test_a_refused_data_frame_is_named_without_a_path(monkeypatch):
    monkeypatch.chdir(ROOT)
    frame = pd.read_csv(FIELD).drop(columns="measured_x_mm")
    with pytest.raises(rrru.IngestError, match=r"^DataFrame mine, column measured_x_mm: got no such column"):
        rrru.read_campaign(frame, rrru.load_robot("rrru3"), name="mine")


def test_a_text_in_a_data_frame_is_refused_with_its_row(monkeypatch):
    monkeypatch.chdir(ROOT)
    frame = pd.read_csv(FIELD).astype({"measured_y_mm": object})
    frame.loc[20, "measured_y_mm"] = "beam lost"
    with pytest.raises(
        rrru.IngestError, match=r"^DataFrame measurements, row 21, column measured_y_mm: got 'beam lost'"
    ):
        rrru.read_campaign(frame, rrru.load_robot("rrru3"))


def test_what_is_no_result_of_the_library_is_refused_in_words():
    robot = rrru.load_robot("rrru3")
    for call, said in (
        (lambda: rrru.load_robot(None), "the source of a robot is a NoneType"),
        (lambda: rrru.read_campaign([1.0], robot), "data is a list"),
        (lambda: rrru.read_campaign(FIELD, "rrru3"), "got a str in place of a RobotModel"),
        (lambda: rrru.calibrate(None), "got a NoneType in place of a Campaign"),
        (lambda: rrru.diagnose("x"), "got a str in place of a Campaign"),
    ):
        with pytest.raises(rrru.ConfigError, match=said):
            call()


def test_a_calibration_at_its_bounds_says_so():
    campaign = rrru.read_campaign(FIELD, rrru.load_robot("rrru3"), noise_mm=0.02)
    assert "bound" not in repr(rrru.calibrate(campaign))
    narrow = {**campaign.config["calibration"], "bounds": {"angle_rad": 0.025, "length_mm": 0.01}}
    held = rrru.calibrate(replace(campaign, config={**campaign.config, "calibration": narrow}))
    assert "parameters at a bound: widen calibration.bounds" in repr(held)


def test_one_stated_reflector_needs_no_column(arm):
    """The reflector's place from the arm's own kinematics: a point 60 mm out and 40 mm up on the flange."""
    generator, place = np.random.default_rng(8), np.array([60.0, 0.0, 40.0])
    drives = HOME + generator.uniform(-0.6, 0.6, (60, len(HOME)))
    seen = arm.mechanism.solve(drives, arm.mechanism.forward(drives)).point(place)
    frame = pd.DataFrame(drives, columns=arm.drives)
    frame[["measured_x_mm", "measured_y_mm", "measured_z_mm"]] = seen + generator.normal(0.0, NOISE_MM, seen.shape)
    campaign = rrru.read_campaign(frame, arm, targets={"ball": place}, noise_mm=NOISE_MM)
    assert "no column target: every reading is of ball" in campaign.notes
    assert abs(rrru.calibrate(campaign).rms_mm / (NOISE_MM * np.sqrt(3.0)) - 1.0) < 0.3
    with pytest.raises(rrru.IngestError, match="column target: got no such column; allowed: a column with each row's"):
        rrru.read_campaign(frame, arm, targets={"ball": place, "other": place}, noise_mm=NOISE_MM)


def test_a_corrected_file_with_a_reflector_at_its_tip_is_compared_at_the_given_tip(arm, tmp_path):
    """The link of the reflector is the only last one of the corrected file, which was 72 mm off by that."""
    generator, place = np.random.default_rng(8), np.array([60.0, 0.0, 40.0])
    drives = HOME + generator.uniform(-0.6, 0.6, (60, len(HOME)))
    seen = arm.mechanism.solve(drives, arm.mechanism.forward(drives)).point(place)
    frame = pd.DataFrame(drives, columns=arm.drives).assign(target="ball")
    frame[["measured_x_mm", "measured_y_mm", "measured_z_mm"]] = seen + generator.normal(0.0, NOISE_MM, seen.shape)
    assert "tip" not in arm.entry
    campaign = rrru.read_campaign(frame, arm, noise_mm=NOISE_MM, errors="zero")
    written = rrru.diagnose(campaign, effects=["drive_compliance"]).write_corrected(tmp_path / "corrected.urdf")
    assert "reflector_ball" in (tmp_path / "corrected.urdf").read_text()
    assert written.not_corrected == "" and written.verdict["corrected_file"]["error_mm"] < NOISE_MM


def test_a_zero_that_is_off_is_found_and_the_corrected_file_holds_it(arm, tmp_path):
    """Truth from the arm's kinematics alone: the zero of joint 2 within its interval, the file as good as the noise."""
    generator = np.random.default_rng(4)
    stated = {"noise_mm": NOISE_MM, "motion": "stop_and_go", "errors": "zero"}
    campaign = rrru.read_campaign(_measured(arm, generator), arm, **stated)
    found = rrru.calibrate(campaign)
    row = found.parameters.query("method == 'least_squares'").set_index("parameter").loc["daxis2"]
    assert abs(row["value"] - ZERO_RAD) < 4.0 * row["standard_error"] < 1e-4
    assert abs(found.rms_mm / (NOISE_MM * np.sqrt(3.0)) - 1.0) < 0.2
    steps = []
    diagnosis = rrru.diagnose(campaign, effects=["drive_compliance"], progress=lambda *step: steps.append(step))
    assert diagnosis.verdict["effects"] == [] and [step[1] for step in steps] == list(range(5))
    assert diagnosis.sentences[0] in str(diagnosis) and "<p>" in diagnosis._repr_html_()
    with pytest.raises(rrru.ConfigError, match="is the robot's own file"):
        diagnosis.write_corrected(ARM)
    written = diagnosis.write_corrected(tmp_path / "corrected.urdf")
    assert written.not_corrected == "" and written.verdict["corrected_file"]["error_fresh_mm"] < NOISE_MM
    fresh = HOME + generator.uniform(-0.6, 0.6, (50, len(HOME)))
    off = np.zeros(len(HOME))
    off[1] = ZERO_RAD
    corrected = rrru.load_robot(tmp_path / "corrected.urdf").mechanism
    left = corrected.forward(fresh) - arm.mechanism.forward(fresh + off)
    # the first zero and the base's frame are one number; the file holds it in the frame
    assert np.sqrt((left**2).sum(axis=1).mean()) < NOISE_MM


@pytest.fixture(scope="module")
def diagnosis(arm):
    campaign = rrru.read_campaign(_measured(arm, np.random.default_rng(5)), arm, noise_mm=NOISE_MM, name="arm")
    return rrru.diagnose(campaign, effects=["drive_compliance"])


@pytest.mark.usefixtures("quick_figures")
@pytest.mark.parametrize("largest", [None, 100])
def test_what_a_result_writes_is_what_it_holds(diagnosis, tmp_path, monkeypatch, largest):
    if largest:
        monkeypatch.setattr(files, "LARGEST_SVG", largest)
    page = diagnosis.write(tmp_path)
    # a page shows a figure that is too large for it as PNG, whatever was asked for
    drawn = [*(tmp_path / "figures/arm").glob("*.svg")]
    large = {place.stem for place in drawn if place.stat().st_size > files.LARGEST_SVG}
    assert large == {place.stem for place in (tmp_path / "figures/arm").glob("*.png")}
    assert len(large) < len(drawn) or largest
    assert (b'src="data:image/png' in page.read_bytes()) is bool(large)
    assert diagnosis.write(tmp_path / "all", ("pdf", "png")).read_bytes() == page.read_bytes()
    for name in ("gap_budget", "gap_parameters", "gap_attribute"):
        stored = pd.read_parquet(page.with_name(f"{name}.parquet"))
        pd.testing.assert_frame_equal(stored, diagnosis.tables[name][stored.columns].reset_index(drop=True))
    assert diagnosis.report(tmp_path / "alone.html").read_bytes() == page.read_bytes()
    assert diagnosis.to_json(tmp_path / "answer.json") == (tmp_path / "answer.json").read_text()
    assert len(diagnosis.plot().axes) > 3


def test_a_table_of_dh_rows_is_the_arm_that_its_formula_says():
    """Two turning joints with parallel axes: the planar arm."""
    robot = rrru.load_robot(
        {"dh": [{"a_mm": length, "range_deg": [-180, 180]} for length in (300.0, 200.0)]}, name="planar"
    )
    angles = np.array([[0.3, -0.7], [1.1, 0.4]])
    sums = angles.cumsum(axis=1)
    x = 300.0 * np.cos(sums[:, 0]) + 200.0 * np.cos(sums[:, 1])
    y = 300.0 * np.sin(sums[:, 0]) + 200.0 * np.sin(sums[:, 1])
    np.testing.assert_allclose(robot.mechanism.forward(angles), np.stack([x, y, 0.0 * x], axis=1), atol=1e-9)


@pytest.mark.parametrize(
    ("source", "options", "said"),
    [
        ("nothere.urdf", {}, "there is no such file; allowed: a URDF, MJCF or YAML file, or rrru3, ptt3, delta"),
        (ROOT / "README.md", {}, "no <robot> and no <mujoco> in it"),
        (ROOT / "config.yaml", {"name": "nobody"}, "robots has no 'nobody'"),
        (ARM, {"tip": "elbow_link_of_nobody"}, "elbow_link_of_nobody"),
        ({"dh": [{"a_cm": 3.0}]}, {}, "a_cm"),
        (ARM, {"up": [0.0, 0.0, 0.0]}, "up is 0, 0, 0; allowed: a direction"),
        (ARM, {"up": [0.0, 1.0]}, "up: "),
        ("rrru3", {"limits": {"payload": 3.0}}, "did you mean payload_kg for payload"),
    ],
)
def test_a_robot_that_cannot_be_is_refused_in_words(source, options, said):
    with pytest.raises(rrru.ConfigError, match=said):
        rrru.load_robot(source, **options)


def test_a_file_that_is_called_as_a_robot_of_the_package_is_a_robot_of_its_own():
    delta = rrru.load_robot(DATA / "models/delta.xml", platform="plate")
    assert delta.name == "delta_mjcf"
    assert delta.drives == ("theta1_rad", "theta2_rad", "theta3_rad")
    assert rrru.load_robot("delta").name == "delta"


def test_wrong_values_of_a_campaign_are_refused_in_words(monkeypatch):
    monkeypatch.chdir(ROOT)
    robot = rrru.load_robot("rrru3")
    for options, said in (
        ({"unit": "cm"}, "'cm' is not one of"),
        ({"noise_mm": -1.0}, "noise_mm: -1.0 is less than the minimum of 0"),
        ({"targets": {"ball": [1.0, 2.0]}}, "targets.ball"),
    ):
        with pytest.raises(rrru.ConfigError, match=said):
            rrru.read_campaign(FIELD, robot, **options)
    with pytest.raises(rrru.ConfigError, match="virtual one"):
        rrru.configured_campaign("paper", "config.yaml")
    with pytest.raises(rrru.ConfigError, match="has no file that could be corrected"):
        rrru.diagnose(rrru.read_campaign(FIELD, robot, noise_mm=0.02), effects=["backlash"]).write_corrected("no.urdf")


def test_a_campaign_and_its_robot_may_be_in_different_files(tmp_path):
    dh = [{"d_mm": 100, "a_mm": 300, "range_deg": [-90, 90]}, {"a_mm": 200, "range_deg": [10, 90]}]
    (tmp_path / "robot.yaml").write_text(yaml.safe_dump({"robots": {"planar": {"dh": dh}}}), encoding="utf-8")
    generator = np.random.default_rng(1)
    drives = generator.uniform([-1.5, 0.2], [1.5, 1.5], (40, 2))
    frame = pd.DataFrame(drives, columns=["q1_rad", "q2_rad"])
    seen = rrru.load_robot(tmp_path / "robot.yaml").mechanism.forward(drives)
    frame[["measured_x_mm", "measured_y_mm", "measured_z_mm"]] = seen
    frame.to_csv(tmp_path / "run.csv", index=False)
    section = {"campaigns": {"mine": {"robot": "planar", "ingest": str(tmp_path / "run.csv"), "noise_mm": 0.01}}}
    (tmp_path / "run.yaml").write_text(yaml.safe_dump(section), encoding="utf-8")
    found = rrru.configured_campaign("mine", [tmp_path / "robot.yaml", tmp_path / "run.yaml"])
    assert found.robot.name == "planar" and len(found.measurements) == 40


def test_numpy_values_are_taken_as_plain_ones(arm):
    """Places and names as arrays, tuples or paths make the same section as lists and texts."""
    frame = _measured(arm, np.random.default_rng(6)).assign(target="ball")
    place = Rotation.identity().apply([0.0, 0.0, 0.0])
    one = rrru.read_campaign(frame, arm, targets={"ball": place}, noise_mm=np.float64(0.01))
    other = rrru.read_campaign(frame, arm, targets={"ball": [0.0, 0.0, 0.0]}, noise_mm=0.01)
    assert one.section == other.section and yaml.safe_load(yaml.safe_dump(dict(one.section))) == one.section


def test_a_configuration_is_overlaid_in_order_and_checked(tmp_path):
    first, second = tmp_path / "a.yaml", tmp_path / "b.yaml"
    first.write_text("gap: {draws: 50}\nseed: 7")
    second.write_text("gap: {draws: 60}")
    config = read_config([first, second])
    assert config["gap"]["draws"] == 60 and config["seed"] == 7 and config["gap"]["tolerance"] == 0.04
    second.write_text("gap: {drawz: 60}")
    with pytest.raises(rrru.ConfigError, match="did you mean draws for drawz"):
        read_config([second])
    second.write_text("gap: {draws: 60}\ngap: {draws: 70}")
    with pytest.raises(rrru.ConfigError, match="line 2: gap occurs twice"):
        read_config([second])
