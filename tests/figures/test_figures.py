"""Figures: drawn from made-up tables without computing anything, complete, and the same bytes every time."""

import ast
import os
import re
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text

from rrru.errors import ConfigError, RrruError, WriteError
from rrru.figures import choose, observability, style
from rrru.figures.files import KINDS
from tests.figures import synthetic_gap
from tests.figures import synthetic_tables as synthetic
from tests.figures.catalogue import FIGURES
from tests.places import ROOT
from tests.schemas import TABLES
from tests.studies.delta import synthetic_delta
from tests.studies.end_to_end import synthetic_circle
from tests.studies.methods import synthetic_methods
from tests.studies.printers import synthetic_printers
from tests.studies.ptt3 import synthetic_ptt
from tests.studies.real import synthetic_real

# labels of axes that count or name things, or carry a number without a unit
WITHOUT_UNIT = (
    *("share of the gap's mean square", "budget"),
    *("point", "generation", "crossover fraction $P_c$", "migration fraction $P_m$", "calibrated on", "applied to"),
    *("direction, best seen first", "error parameter", "singularity measure: 0 at a singularity, 1 at best"),
    *(
        "probability",
        "run, in the order driven",
        "verdict",
        "truth",
        "stated probability",
        "share of robots",
        "share that acts",
        "gap over noise, rms",
    ),
    *(
        "column (pixel)",
        "row (pixel)",
        "variant",
        "singular value (mm/mm)",
        "standard error (mrad)",
        "error per length (mrad/mm)",
    ),
    *("true explained fraction", "predicted explained fraction", "effect", "trajectory", "printer", "points", "method"),
    *(
        "neurons",
        "mean squared error (mm²)",
        "exact - Jacobian (µm)",
        "benefit (%)",
        "payload changed by (kg)",
        "experiment",
    ),
    *("evaluations of a restart", "objective (nat)"),
    *(
        f"{which} after calibration:\n{end} error / printed"
        for which in ("group 1", "lines")
        for end in ("smallest", "largest")
    ),
    "line calibration:\nmean error / printed",
    *("experiment, curve driven backwards", "payload (kg)", "slider", "scatter per travel (µm/mm)", "residual (µm)"),
    "azimuth of the first point (°)",
    *("model", "waves per turn", "row", "x (m)", "y (m)", "share of the gap's mean square (%)"),
    *(f"joint {number}\n(µrad)" for number in range(1, 7)),
    "size of the weight in the unit direction (angles as arcs at the robot's own length)",
    *("drive value, axis1 (degrees)", "drive value, axis2 (degrees)", "error (mrad)", "error (µm)"),
)
SMALLEST_PT = 7.0
# figures that know no campaign
STUDIES = ("withheld", "withheld_causes", "withheld_plants", "printers", "methods", "circle")
DELTA = ("delta_images", "delta_errors", "delta_observability")
PTT = tuple(name for name in FIGURES if name.startswith("ptt_"))
REAL = ("steps", "spectrum", "lengths")


@pytest.fixture(scope="module")
def frames():
    own = synthetic_gap.gap_tables(synthetic.CAMPAIGN, synthetic.commanded())
    return (
        synthetic.all_tables()
        | own
        | synthetic_gap.withheld_tables()
        | {"printers": synthetic_printers.printers()}
        | synthetic_delta.delta_tables()
        | synthetic_methods.method_tables()
        | synthetic_circle.circle_tables()
        | synthetic_ptt.ptt_tables()
        | synthetic_real.real_tables()
    )


def draw(name, frames, **options):
    function, needed = FIGURES[name]
    return function({table: frames[table] for table in needed}, synthetic.OPTIONS | options)


def files(path):
    """Paths of a figure's files without their ending."""
    return {kind: f"{path}.{kind}" for kind in KINDS}


def labels(figure):
    """Label of every axis of every panel in use."""
    for panel in (axes for axes in figure.axes if axes.axison):
        yield panel, "x", panel.get_xlabel()
        yield panel, "y", panel.get_ylabel()
        if hasattr(panel, "get_zlabel"):
            yield panel, "z", panel.get_zlabel()


def is_labelled(figure, panel, direction):
    """An axis has a label, or a panel in the same column (x) or row (y) has it for it, or it is the thin side of a
    colour bar.
    """
    span = {"x": ("x0", "x1"), "y": ("y0", "y1")}.get(direction)
    if span is None or panel.get_label() == "<colorbar>":
        return bool(panel.get_zlabel() if span is None else panel.get_xlabel())
    place = [round(getattr(panel.get_position(), edge), 2) for edge in span]
    family = [
        other for other in figure.axes if [round(getattr(other.get_position(), edge), 2) for edge in span] == place
    ]
    return any(getattr(other, f"get_{direction}label")() for other in family)


@pytest.mark.parametrize("name", FIGURES)
@pytest.mark.usefixtures("quick_figures")
def test_a_figure_is_complete_and_its_files_are_the_same_bytes_every_time(name, frames, tmp_path):
    # the real pictures and fonts are below
    first, again = draw(name, frames), draw(name, frames)
    style.save(first, files(tmp_path / "first"))
    style.save(again, files(tmp_path / "again"))
    for kind in KINDS:
        assert (tmp_path / f"first.{kind}").read_bytes() == (tmp_path / f"again.{kind}").read_bytes()
    assert b"CreationDate" not in (tmp_path / "first.pdf").read_bytes()
    assert "<dc:date>" not in (tmp_path / "first.svg").read_text()

    for panel, direction, label in labels(first):
        assert is_labelled(first, panel, direction), f"{direction} of {panel.get_title(loc='left')!r}"
        assert not label or "(mm)" in label or label in WITHOUT_UNIT
    small = {
        text.get_text() for text in first.findobj(Text) if text.get_text().strip() and text.get_fontsize() < SMALLEST_PT
    }
    assert not small
    width, height = first.get_size_inches() * 25.4
    # the map alone is next to the words of an answer
    assert width == pytest.approx(85.0 if name == "gap_map" else 175.0) and height < 240.0
    box = first.get_tightbbox()
    assert min(box.x0, box.y0) > -0.01 and box.x1 * 25.4 < width + 0.3 and box.y1 * 25.4 < height + 0.3
    assert {path.name for path in tmp_path.iterdir()} == {f"{n}.{kind}" for n in ("again", "first") for kind in KINDS}


def test_bytes_do_not_depend_on_the_process_or_the_user_s_settings(frames, tmp_path):
    style.save(draw("fig09", frames), files(tmp_path / "here"))
    (tmp_path / "matplotlibrc").write_text("font.size: 20\nlines.linewidth: 5\npdf.fonttype: 3\nsavefig.bbox: tight\n")
    code = (
        "from tests.figures import synthetic_tables as s; from tests.figures.catalogue import FIGURES;"
        "from rrru.figures import style; from rrru.figures.files import KINDS;"
        "style.save(FIGURES['fig09'][0](s.all_tables(), s.OPTIONS), {k: f'there.{k}' for k in KINDS})"
    )
    environment = os.environ | {"PYTHONPATH": str(ROOT), "PYTHONHASHSEED": "99"}
    subprocess.run([sys.executable, "-c", code], cwd=tmp_path, env=environment, check=True)
    for kind in KINDS:
        assert (tmp_path / f"here.{kind}").read_bytes() == (tmp_path / f"there.{kind}").read_bytes()


def test_a_failed_save_leaves_the_old_files_and_nothing_else(frames, tmp_path, monkeypatch):
    figure = draw("fig12", frames)
    pdf, png = tmp_path / "a.pdf", tmp_path / "a.png"
    pdf.write_text("old"), png.write_text("old")
    whole = FigureCanvasAgg.print_png

    def fail(canvas, path, **options):
        # the arrangement before asks for a canvas of no file
        if isinstance(path, Path):
            assert [one.name for one in tmp_path.glob(".*")] == [".a.partial.pdf"]
            raise OSError("disk full")
        return whole(canvas, path, **options)

    monkeypatch.setattr(FigureCanvasAgg, "print_png", fail)
    with pytest.raises(WriteError, match=r"a.png: cannot be written \(disk full\)"):
        style.save(figure, {"pdf": pdf, "png": png})
    assert (pdf.read_text(), png.read_text()) == ("old", "old")
    assert sorted(tmp_path.iterdir()) == [pdf, png]


@pytest.mark.parametrize(
    ("name", "options", "word"),
    [
        ("fig09", {"calibration_lines": "circles"}, "'circles'"),
        ("fig10", {"calibration_lines": "circles"}, "'circles'"),
        ("fig11", {"calibration_spiral": "circles"}, "'circles'"),
        ("fig12", {"calibration_spiral": "circles"}, "'circles'"),
        ("fig12", {"method": "guess"}, "'guess'"),
        ("fig06", {"sweep_calibration": "circles"}, "'circles'"),
        *(
            (name, {"campaign": "nowhere"}, "'nowhere'")
            for name in FIGURES
            if name not in ("fig06", "fig07", "twin_search", "twin_tradeoff", *STUDIES, *DELTA, *PTT, *REAL)
        ),
        ("fig07", {"sweep_campaign": "nowhere"}, "'nowhere'"),
    ],
)
def test_what_is_missing_is_named(name, options, word, frames):
    with pytest.raises(RrruError, match=word) as caught:
        draw(name, frames, **options)
    assert str(caught.value).startswith(name)


def test_missing_trajectories_and_items_are_named(frames):
    ground = synthetic.commanded(names=("circle_1",))
    others = frames | {"measurements": synthetic.paths(ground), "errors": synthetic.errors(ground)}
    for name, word in (("fig09", "line_"), ("fig10", "line_"), ("fig12", "line_"), ("fig11", "spiral")):
        with pytest.raises(ConfigError, match=rf"{name}.*{word}.*circle_1"):
            draw(name, others)
    with pytest.raises(ConfigError, match=r"fig07.*migration_fraction"):
        draw("fig07", frames | {"sweep_runs": frames["sweep_runs"].iloc[:0]})


def line(axes, label):
    """The drawn line with a label."""
    return next(one for one in axes.lines if one.get_label() == label)


def test_what_is_drawn_is_what_stands_in_the_tables(frames):
    errors = frames["errors"]
    figure = draw("fig09", frames)
    plane, sizes = figure.axes
    rows = errors[(errors["trajectory"] == "line_1") & (errors["mode"] == "before")]
    after = errors[
        (errors["trajectory"] == "line_1") & (errors["mode"] == "closed_loop") & (errors["calibration"] == "lines")
    ]
    np.testing.assert_array_equal(line(sizes, "before calibration").get_ydata(), rows["error_mm"])
    np.testing.assert_array_equal(line(sizes, "after line calibration").get_ydata(), after["error_mm"])
    factor = float(re.search(r"magnified ([\d.]+) times", plane.get_title(loc="left"))[1])
    command = frames["measurements"].query("trajectory == 'line_1'")
    x, z = line(plane, "after line calibration").get_data()
    np.testing.assert_allclose(x, command["command_x_mm"].to_numpy() + factor * after["error_x_mm"].to_numpy())
    np.testing.assert_allclose(z, command["command_z_mm"].to_numpy() + factor * after["error_z_mm"].to_numpy())

    panel = draw("fig11", frames).axes[3]
    rows = errors[
        (errors["trajectory"] == "spiral") & (errors["mode"] == "closed_loop") & (errors["calibration"] == "spiral")
    ]
    np.testing.assert_array_equal(line(panel, "after spiral calibration").get_ydata(), rows["error_z_mm"])

    panel = draw("fig07", frames).axes[1]
    np.testing.assert_allclose(
        line(panel, "published, above its own lowest, 0.5112 mm").get_ydata(), np.array(synthetic.P_M) - 0.5112
    )

    image = draw("cross", frames).axes[1].images[0].get_array()
    summary = frames["error_summary"].query(
        "mode == 'closed_loop' and calibration == 'spiral' and trajectory == 'all_lines'"
    )
    assert image.shape == (5, 9) and image[3, 8] == summary["max_mm"].item()


def test_passes_are_laid_over_each_other_at_the_same_places():
    ground = synthetic.commanded(passes=2)
    frames = synthetic.all_tables(ground)
    places = choose.stations(frames["measurements"], "spiral")
    assert places["station"].tolist() == [*range(1, 10), *range(9, 0, -1)]
    errors = frames["errors"].query("mode == 'before' and trajectory == 'line_1'")
    forward, backward = (errors.loc[errors["run"] == run, "error_mm"].to_numpy() for run in (1, 9))
    curve = line(draw("fig09", frames).axes[1], "before calibration").get_ydata()
    # each pass lacks its own second point
    np.testing.assert_allclose(curve, np.nanmean([forward, backward[::-1]], axis=0))


def test_a_campaign_that_was_never_driven_again_shows_the_model_s_residuals():
    frames = synthetic.all_tables(modes=("model",))
    assert line(draw("fig09", frames).axes[1], "residual of line calibration")
    assert "residual" in draw("cross", frames).axes[0].get_title(loc="left")


@pytest.mark.parametrize(
    ("case", "name"),
    [
        *(("other names", name) for name in ("fig09", "fig10", "fig11", "cross")),
        *(("nothing measured", name) for name in ("fig09", "fig11", "fig12", "cross")),
        *(("far off", name) for name in ("fig10", "fig11", "cross")),
    ],
)
def test_odd_campaigns_are_drawn_too(case, name):
    names = (
        ("line_2", "line_10", "line_slow", "free path", "spiral_down")
        if case == "other names"
        else ("line_1", "spiral")
    )
    ground = synthetic.commanded(names=names, points=4, passes=2)
    frames = synthetic.all_tables(ground)
    numbers = [column for column in frames["errors"] if column.startswith("error_")]
    if case == "nothing measured":
        frames["errors"].loc[:, numbers] = np.nan
    if case == "far off":
        frames["errors"].loc[frames["errors"]["point"] == 3, numbers] *= 1e4
    frames["error_summary"] = synthetic.error_summary(frames["errors"])
    figure = draw(name, frames)
    figure.draw_without_rendering()
    if case == "other names" and name == "fig10":
        assert [axes.get_title(loc="left").split(",")[0] for axes in figure.axes[:3]] == [
            "(a) group 2",
            "group 10",
            "line slow",
        ]


def test_the_only_trajectory_of_a_tracker_s_list_is_shown():
    """It is called `all`, as the sum over several trajectories is."""
    frames = synthetic.all_tables()
    summary = frames["error_summary"].query("trajectory == 'all'")
    texts = [text.get_text() for text in draw("cross", {"error_summary": summary}).axes[0].get_xticklabels()]
    assert texts == [choose.plain("all")]


def test_a_sweep_without_visible_scatter_and_one_slice_are_drawn_too(frames):
    flat = frames | synthetic.sweeps(scatter_mm=0.0)
    draw("fig06", flat).draw_without_rendering()
    one = frames["workspace"].query("slice == 'xy'")
    far = frames["measurements"].assign(status="ok"), frames["singularity"].assign(status="ok")
    figure = draw("workspace", frames | {"workspace": one, "measurements": far[0], "singularity": far[1]})
    assert len(figure.axes) == 3 and len(figure.legends[0].get_texts()) == 2


@pytest.mark.parametrize(("constraint", "panels"), [(1.0, 2), (0.4, 4)])
def test_robots_that_orient_are_drawn_at_their_poses_without_a_region_out_of_reach(frames, constraint, panels):
    """An open chain has no panel of a constraint measure, which is 1 everywhere."""
    poses = frames["singularity"].assign(constraint_measure=constraint)
    figure = draw("workspace", frames | {"workspace": frames["workspace"].head(0), "singularity": poses})
    *views, bar = figure.axes
    assert len(views) == panels and not any(axes.patch.get_hatch() or axes.images for axes in views)
    assert all(len(axes.collections[0].get_offsets()) == len(poses) for axes in views)
    assert "largest singular value of the position Jacobian" in bar.get_xlabel()


@pytest.mark.parametrize("z_down", [True, False])
def test_the_workspace_hangs_as_its_robots_frame_says(frames, z_down):
    low, high = draw("workspace", frames | {"campaigns": synthetic.campaigns(z_down)}).axes[0].get_ylim()
    assert (low > high) == z_down


def test_the_rules_name_tables_that_exist_and_every_figure_has_a_caption():
    for name, (function, needed) in FIGURES.items():
        assert function.__name__ == name and set(needed) <= set(TABLES) and len(function.__doc__) > 60


def test_figures_know_no_computing_package():
    allowed = re.compile(
        r"(numpy|pandas|matplotlib|fontTools|scipy\.spatial|rrru\.arrays|rrru\.errors|rrru\.store|rrru\.figures|rrru\.studies\.\w+\.(figures|paper|summary|verdicts))(\.|$)"
        r"|(re|collections\.abc|concurrent\.futures|contextlib|functools|gc|io|multiprocessing|os|signal|importlib|inspect|itertools|pathlib|fnmatch|textwrap|dataclasses|types|typing)$"
    )
    files = [
        *(ROOT / "rrru/figures").glob("*.py"),
        *(ROOT / "rrru/studies").glob("*/figures*"),
        *(ROOT / "rrru/studies").glob("*/figures/*.py"),
    ]
    for path in files:
        if path.is_dir():
            continue
        for node in ast.walk(ast.parse(path.read_text())):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            names += [node.module] if isinstance(node, ast.ImportFrom) else []
            assert all(allowed.match(name) for name in names), f"{path.name}: {names}"


def test_the_names_of_many_parameters_do_not_overlap():
    """Of a robot of 39 numbers; names and singular values of half the width ran into each other."""
    count, generator = 39, np.random.default_rng(3)
    direction, number = (part.ravel() for part in np.indices((count, count)))
    rows = pd.DataFrame(
        {
            "campaign": synthetic.CAMPAIGN,
            "calibration": "*",
            "direction": direction + 1,
            "parameter": [f"leg_{k % 6 + 1}_ball_{'xyz'[k % 3]}{k}" for k in number],
            "weight": generator.uniform(-1.0, 1.0, count**2),
            "singular_value": 10.0 / (direction + 1.0),
            "standard_error_mm": 1e-3 * (direction + 1.0),
        }
    )
    figure = observability.observability({"observability": rows}, {"campaign": synthetic.CAMPAIGN})
    figure.canvas.draw()
    for axes, along in [(axes, along) for axes in figure.axes[:2] for along in ("x", "y")]:
        labels = axes.get_xticklabels() if along == "x" else axes.get_yticklabels()
        extents = [one.get_window_extent() for one in labels if one.get_text()]
        boxes = sorted((getattr(one, f"{along}0"), getattr(one, f"{along}1")) for one in extents)
        assert all(end <= start + 1.0 for (_, end), (start, _) in pairwise(boxes)), along
