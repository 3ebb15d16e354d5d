"""The figures of the gap diagnosis and of its checks: what they draw is what stands in the tables, and odd verdicts are
drawn too.
"""

from functools import cache
from itertools import combinations

import numpy as np
import pandas as pd
import pytest
from matplotlib.colors import to_hex

from rrru.errors import ConfigError
from rrru.figures import style
from rrru.figures.gap import draw_budget
from rrru.store import tables
from rrru.studies.blind_validation import figures as withheld
from rrru.studies.blind_validation.verdicts import PLANTS
from tests.figures import synthetic_gap as made_up
from tests.figures import synthetic_tables as synthetic
from tests.figures.catalogue import FIGURES
from tests.schemas import TABLES

GROUND = synthetic.commanded(names=("line_1", "line_2", "spiral"), passes=2)


@pytest.fixture
def frames():
    return made_up.gap_tables(synthetic.CAMPAIGN, GROUND)


def draw(name, frames):
    function, needed = FIGURES[name]
    figure = function({table: frames[table] for table in needed}, synthetic.OPTIONS)
    figure.draw_without_rendering()
    return figure


@cache
def plain(name):
    """The figure of the made-up tables as they are, which is looked at and not changed."""
    return draw(
        name,
        made_up.withheld_tables() if name.startswith("withheld") else made_up.gap_tables(synthetic.CAMPAIGN, GROUND),
    )


def panel(figure, title):
    return next(axes for axes in figure.axes if title in axes.get_title(loc="left"))


def written(axes):
    return [text.get_text() for text in axes.texts]


def test_the_map_shows_the_used_points_gaps_in_the_plane_by_size(frames):
    axes = panel(plain("gap"), "(a)")
    used = frames["gap_points"].query("used")
    vectors = used[[f"before_{axis}_mm" for axis in "xyz"]].to_numpy()
    arrows = axes.collections[0]
    size = np.linalg.norm(vectors, axis=1)
    order = np.argsort(size, kind="stable")
    np.testing.assert_allclose(arrows.get_array(), size[order])
    np.testing.assert_allclose(np.column_stack([arrows.U, arrows.V]), vectors[order][:, :2])
    np.testing.assert_allclose(arrows.get_offsets(), used[["command_x_mm", "command_y_mm"]].to_numpy()[order])
    assert f"magnified {1.0 / arrows.scale:g} times" in axes.get_title(loc="left")
    ring = axes.lines[-1].get_xydata()[0]
    np.testing.assert_allclose(ring, frames["gap_verdicts"][["worst_x_mm", "worst_y_mm"]].iloc[0].astype(float))


@pytest.mark.parametrize(
    "stretch", [(1.0, 1.0, 1.0), (1.0, 6.0, 1.0), (4.0, 6.0, 2.0), (1.0, 1.0, 8.0), (6.0, 1.0, 1.0)]
)
@pytest.mark.parametrize(("name", "first"), [("gap", 2), ("gap_map", 0)])
def test_both_views_hold_every_point_and_share_x(name, first, stretch, frames, tmp_path):
    """Also of a gantry that goes far along one axis, for which the page is too low."""
    for table, place in (("gap_points", "command"), ("gap_verdicts", "worst")):
        columns = [f"{place}_{axis}_mm" for axis in "xyz"]
        frames[table] = frames[table].assign(**frames[table][columns] * list(stretch))
    figure = draw(name, frames)
    style.save(figure, {"png": tmp_path / "figure.png"})
    # wide numbers at an axis that a wider view brings stay on the page
    assert figure.get_tightbbox().x0 > -0.01
    top, side = figure.axes[first : first + 2]
    assert top.get_xlim() == side.get_xlim() and side.get_ylim()[0] > side.get_ylim()[1]
    for axes, up in ((top, "y"), (side, "z")):
        place = frames["gap_points"].query("used")[["command_x_mm", f"command_{up}_mm"]].to_numpy()
        low, high = np.sort([axes.get_xlim(), axes.get_ylim()], axis=1).T
        assert (place > low).all() and (place < high).all()


def test_the_budget_stands_first_and_its_parts_lie_end_to_end(frames):
    """Effects by share, what does not repeat, the unknown, small parts, then what completes them to the whole."""
    axes = plain("gap").axes[1]
    bars = [(bar.get_x(), bar.get_width()) for bar in axes.patches]
    np.testing.assert_allclose([width for _, width in bars], [0.6, 0.2, 0.1, 0.05, 0.01, 0.04], atol=1e-12)
    np.testing.assert_allclose([start for start, _ in bars], [0.0, 0.6, 0.8, 0.9, 0.95, 0.96], atol=1e-12)
    named = ["link flexure 60 %", "backlash 20 %", "scatter 10 %", "unexplained 5 %", "covariance 4 %"]
    assert sorted(written(axes)) == sorted(named)


def test_negative_covariances_extend_the_budget_to_the_left(frames):
    """The parts to the right less those to the left are the whole."""
    budget = frames["gap_budget"]
    shared = budget["share"].mask(budget["kind"] == "covariance", -0.2).mask(budget["kind"] == "scatter", 0.34)
    axes = draw("gap", frames | {"gap_budget": budget.assign(share=shared)}).axes[1]
    bars = [(bar.get_x(), bar.get_width()) for bar in axes.patches]
    assert (0.0, -0.2) in bars and axes.get_xlim()[0] == pytest.approx(-0.2)
    # the sampling is no part of the whole
    assert sum(width for _, width in bars) == pytest.approx(1.0)


def test_a_group_alone_has_its_own_probability_in_the_headline(frames):
    causes = frames["gap_attribute"].copy()
    grouped = causes["effect"].isin(["link_flexure", "drive_compliance"])
    causes.loc[grouped, ["decision", "group_probability"]] = "group", 0.91
    changes = {"effects": "link_flexure", "groups": "link_flexure | drive_compliance", "probability": 0.5, "leg": 0}
    verdicts = frames["gap_verdicts"].assign(**changes)
    bold, *rest = written(draw("gap", frames | {"gap_attribute": causes, "gap_verdicts": verdicts}).axes[0])
    assert bold.startswith("link flexure or drive compliance (p = 0.91): 0.37 mm gap")
    assert "not ruled out" not in " ".join(rest)


@pytest.mark.parametrize(
    ("effects", "said"),
    [
        ("backlash", "no cause named, most probable backlash (p = 0.33): 0.37 mm gap"),
        ("link_flexure+backlash", "link flexure + possibly backlash (p = 0.33): 0.37 mm gap"),
    ],
)
def test_the_headline_says_which_causes_are_not_probable_enough_for_a_name(frames, effects, said):
    causes = frames["gap_attribute"].copy()
    causes.loc[causes["effect"] == "backlash", "decision"] = "possible"
    verdicts = frames["gap_verdicts"].assign(effects=effects, leg=0, probability=0.33)
    bold, *_ = written(draw("gap", frames | {"gap_attribute": causes, "gap_verdicts": verdicts}).axes[0])
    assert bold.startswith(said)


def test_causes_are_ordered_and_the_verdict_s_are_in_colour(frames):
    axes = panel(plain("gap"), "(b)")
    names = [label.get_text() for label in axes.get_yticklabels()]
    assert names[:2] == ["link flexure", "backlash"] and names[-2:] == ["unexplained", "none"] and len(names) == 14
    assert [to_hex(bar.get_facecolor()).upper() == style.BLUE for bar in axes.patches] == [True] * 2 + [False] * 12
    texts = dict(zip(names, written(axes), strict=True))
    assert texts["link flexure"] == "0.98, leg 2" and texts["backlash"] == "0.97, each leg"
    assert texts["thermal growth"] == "not tested" and texts["unexplained"] == "0.04"


@pytest.mark.parametrize("legs", ["1", "1 and 2", "1 and 2 and 3", "each", "same"])
def test_long_names_of_joints_stay_in_their_bar_and_on_the_page(legs, frames):
    """Names as in files of common arms; the page's sentences have those for which the bar has no room."""
    causes, probabilities = frames["gap_attribute"].copy(), (1.0, 0.8, 0.62, 0.55, 0.4, 0.1)
    # causes with these probabilities and legs, each in its own row
    chosen = causes.index[causes["note"] == ""][: len(probabilities)]
    causes.loc[chosen, "probability"], causes.loc[chosen, "legs"] = probabilities, legs
    tables = {table: frames[table] for table in FIGURES["gap"][1]} | {"gap_attribute": causes}
    joints = ("shoulder_lift_joint", "panda_joint2", "wrist_joint")
    figure = FIGURES["gap"][0](tables, {**synthetic.OPTIONS, "drives": joints, "drive_noun": "joint"})
    figure.draw_without_rendering()
    axes = panel(figure, "(b)")
    for text in axes.texts:
        box = text.get_window_extent()
        assert box.x0 >= axes.bbox.x0 and box.x1 <= figure.bbox.x1
    assert {">0.99", "0.80", "0.62", "0.55", "0.40", "0.10"} <= {text.partition(",")[0] for text in written(axes)}
    widest = [text for text in written(axes) if "joint" in text]
    assert legs != "1 and 2" or widest[0] == ">0.99, 2 joints"


def test_the_shrink_is_the_last_held_out_step_of_every_trajectory(frames):
    axes = panel(plain("gap"), "(c)")
    rows = frames["gap_shrink"].query("kind == 'held_out'")
    for line, step in zip(axes.lines[1:], (0, 2), strict=True):
        np.testing.assert_allclose(line.get_xdata(), rows.loc[rows["step"] == step, "gap_rms_mm"])
    assert [label.get_text() for label in axes.get_yticklabels()] == ["all", "line 1", "line 2", "spiral"]
    closed = [label.get_text() for label in axes.child_axes[0].get_yticklabels()]
    assert closed[:2] == ["96 % (94 to 98)", "95 % (93 to 97)"]


def test_a_single_trajectory_has_one_row(frames):
    shrink = frames["gap_shrink"]
    frames["gap_shrink"] = shrink[shrink["trajectory"].isin(["*", "spiral"])]
    axes = panel(draw("gap", frames), "(c)")
    assert [label.get_text() for label in axes.get_yticklabels()] == ["all"]


def test_the_headline_says_verdict_leg_probability_and_what_to_run_next(frames):
    bold, *rest = written(plain("gap").axes[0])
    assert bold == "link flexure + backlash, leg 2 (p = 0.97): 0.37 mm gap, 96 % explained (95 %: 94 to 98)"
    text = " ".join(rest)
    assert (
        "not ruled out: drive compliance" in text and "x \N{MINUS SIGN}512" in text and f"next: {made_up.NEXT}" in text
    )


@pytest.mark.parametrize("reflectors", [1, 2])
def test_no_lines_connect_stops_in_no_order(frames, reflectors):
    """The ring of the worst region is all that is drawn as a line, however many reflectors are read at a stop."""
    points = frames["gap_points"]
    count = len(points) // reflectors
    places = np.random.default_rng(2).uniform(-500.0, 500.0, (count, 3)).repeat(reflectors, axis=0)
    stops = points.iloc[: len(places)].assign(run=1, point=np.arange(len(places)), used=True)
    frames["gap_points"] = stops.assign(**{f"command_{axis}_mm": places[:, k] for k, axis in enumerate("xyz")})
    (ring,) = panel(draw("gap", frames), "(a)").lines
    assert ring.get_marker() == "o"


def test_points_left_out_are_marked_and_break_the_lines(frames):
    axes = panel(plain("gap"), "(d)")
    points = frames["gap_points"].sort_values(["run", "point"])
    first = axes.lines[0].get_ydata()
    assert np.isnan(first[4]) and np.isfinite(np.delete(first, 4)).all()
    crosses = next(line for line in axes.lines if line.get_marker() == "x")
    assert len(crosses.get_xdata()) == (~points["used"]).sum() and max(crosses.get_ydata()) < axes.get_ylim()[1]


def test_the_layout_is_the_same_where_no_point_is_left_out(frames):
    some = panel(plain("gap"), "(d)").get_position()
    frames["gap_points"] = frames["gap_points"].assign(used=True)
    every = panel(draw("gap", frames), "(d)").get_position()
    np.testing.assert_allclose([every.x0, every.x1], [some.x0, some.x1], atol=0.02)


@pytest.mark.parametrize("effects", ["none", "unexplained", "my_effect+unexplained"])
def test_odd_verdicts_are_drawn_too(effects, frames):
    campaign = synthetic.CAMPAIGN
    changes = {
        "leg": 0,
        "next_runs": "",
        "confounded_with": "",
        "dropped_points": 0,
        "probability": 1.0,
        "share_closed": 0.0,
    }
    frames["gap_verdicts"] = made_up.gap_verdicts(campaign, effects, **changes)
    frames["gap_attribute"] = made_up.gap_attribute(
        campaign, [(name, 0.999, "") for name in effects.split("+") if "my" not in name]
    )
    frames["gap_shrink"] = made_up.gap_shrink(campaign, ["line_1"], steps=0, kinds=("resimulated",))
    frames["gap_points"] = frames["gap_points"].assign(used=True, **{f"after_{axis}_mm": np.nan for axis in "xyz"})
    figure = draw("gap", frames)
    bold, *rest = written(figure.axes[0])
    assert bold.startswith(f"{effects.replace('_', ' ').replace('+', ' + ')} (p > 0.99): 0.37 mm gap")
    assert ("% explained (" in bold) == ("+" in effects) and ("nothing" in bold) == ("+" not in effects)
    assert len(rest) == 1 and "resimulated" in panel(figure, "(c)").get_xlabel() and not panel(figure, "(c)").child_axes
    assert [text.get_text() for text in panel(figure, "(d)").get_legend().get_texts()] == [
        "calibrated model",
        "noise, rms",
    ]


def test_a_diagnosis_without_a_used_point_is_refused(frames):
    frames["gap_points"] = frames["gap_points"].assign(used=False)
    with pytest.raises(ConfigError, match="made_up"):
        draw("gap", frames)


def test_many_points_are_thinned_on_the_map_alone():
    ground = synthetic.commanded(points=60, passes=2)
    figure = draw("gap", made_up.gap_tables(synthetic.CAMPAIGN, ground))
    assert len(panel(figure, "(a)").collections[0].get_array()) <= 400 < len(ground)
    assert len(panel(figure, "(d)").get_xticks()) == 16


def test_confusion_tables_count_every_robot_and_frame_the_right_answers():
    frames = made_up.withheld_tables()
    figure = plain("withheld")
    scores = frames["withheld_scores"]
    for check, title in (("label", "label withheld"), ("effect", "effect withheld")):
        axes = panel(figure, title)
        assert sum(map(int, written(axes))) == (scores["check"] == check).sum()
        columns, rows = (
            [label.get_text() for label in labels] for labels in (axes.get_xticklabels(), axes.get_yticklabels())
        )
        framed = {rows[round(patch.get_y() + 0.5)]: columns[round(patch.get_x() + 0.5)] for patch in axes.patches}
        assert framed["backlash"] == ("backlash" if check == "label" else "unexplained") and len(framed) == (
            14 if check == "label" else 12
        )


def test_both_plants_are_compared():
    frames = made_up.withheld_tables()
    figure = plain("withheld_plants")
    for check, title in (("mujoco", "robots, driven by MuJoCo"), ("own", "robots, the same, own plant")):
        assert sum(map(int, written(panel(figure, title)))) == (frames["withheld_scores"]["check"] == check).sum() > 0
    labels = {line.get_label() for line in panel(figure, "strength").lines}
    assert {"driven by MuJoCo", "the same, own plant"} <= labels and "label withheld" not in labels


@pytest.mark.parametrize(
    ("verdict", "column"),
    [("none", "none"), ("backlash", "backlash"), ("a+b", "two or more"), ("a+unexplained", "unexplained")],
)
def test_every_verdict_has_a_column(verdict, column):
    assert withheld._verdict(verdict) == column


def test_shares_are_of_the_scores():
    scores = made_up.withheld_scores()
    figure = draw("withheld", made_up.withheld_tables(scores))
    line = next(one for one in panel(figure, "strength").lines if one.get_label() == "label withheld")
    strong = scores.query("check == 'label' and 12 <= strength < 25")
    assert line.get_ydata()[-1] == pytest.approx(strong["right"].mean())
    oracle = next(one for one in panel(figure, "strength").lines if one.get_label().startswith("detected"))
    weak = scores.query("check == 'label' and 0.3 <= strength < 0.6")
    assert oracle.get_ydata()[0] == pytest.approx(weak["oracle_detects"].mean())


def test_reliability_of_causes_is_drawn_check_by_check_with_the_number_of_statements():
    frames = made_up.withheld_tables()
    figure = plain("withheld_causes")
    for check, title in (("label", "label withheld"), ("as_robots_are", "as robots are")):
        axes = panel(figure, title)
        causes = frames["withheld_causes"].query(f"check == '{check}'")
        *numbers, whole = written(axes)
        assert len(numbers) == 10 and sum(map(int, numbers)) == len(causes)
        assert whole.startswith(f"{len(causes)} statements, error 0.")
        sure = causes[causes["probability"] >= 0.9]
        assert axes.lines[-1].get_xdata()[-1] == pytest.approx(sure["probability"].mean())
        assert axes.lines[-1].get_ydata()[-1] == pytest.approx(sure["acts"].mean())


def test_the_checks_are_drawn_one_by_one_and_an_empty_table_is_refused():
    scores = made_up.withheld_scores(each=1)
    for check in scores["check"].unique():
        name = "withheld_plants" if check in PLANTS else "withheld"
        figure = draw(name, made_up.withheld_tables(scores[scores["check"] == check]))
        count = 4 if check in ("many", "noise", "as_robots_are", *PLANTS) else 3
        assert len(figure.axes) == count
        if check != "field":
            assert len(draw("withheld_causes", made_up.withheld_tables(scores[scores["check"] == check])).axes) == 1
    nothing = made_up.withheld_tables(scores.iloc[:0])
    for name, table in (("withheld", "withheld_scores"), ("withheld_causes", "withheld_causes")):
        with pytest.raises(ConfigError, match=table):
            draw(name, nothing)


def test_parts_are_drawn_found_against_true():
    frames = made_up.withheld_tables()
    figure = plain("withheld")
    for check, title in (("many", "parts, many causes"), ("noise", "parts, noise not")):
        parts = frames["withheld_parts"].query(f"check == '{check}' and kind == 'scatter' and named")
        line = next(one for one in panel(figure, title).lines if one.get_label() == "non-repeatability")
        np.testing.assert_allclose(sorted(line.get_xdata()), sorted(parts["true_rms_mm"].clip(withheld._LEAST_MM)))
        assert line.get_markerfacecolor() != "white" and len(line.get_xdata()) == len(parts) > 0


@pytest.mark.parametrize("name", [name for name in TABLES if name.startswith(("gap_", "withheld_"))])
def test_every_the_diagnosis_may_be_empty(name, tmp_path):
    tables.write(TABLES[name], pd.DataFrame(columns=TABLES[name].names), tmp_path / "t.parquet")
    assert tables.read(tmp_path / "t.parquet").empty


def test_the_error_of_every_drive_is_drawn_with_its_band_and_its_worst_place(frames):
    figure, rows = draw("drive_functions", frames), frames["gap_drive_functions"]
    assert len(figure.axes) == 4
    for axes, (_, part), factor in zip(figure.axes, rows.groupby("drive"), (180.0 / np.pi,) * 2 + (1.0,), strict=False):
        _, error, worst = axes.lines
        np.testing.assert_allclose(error.get_xdata(), factor * part["drive_value"])
        np.testing.assert_allclose(error.get_ydata(), 1e3 * part["error"])
        (band,) = axes.collections
        assert band.get_paths()[0].vertices[:, 1].max() == pytest.approx(1e3 * part["high_95"].max())
        assert abs(worst.get_ydata()[0]) == pytest.approx(1e3 * part["error"].abs().max())


def test_without_an_error_over_a_drive_s_value_the_figure_says_so(frames):
    figure = draw("drive_functions", frames | {"gap_drive_functions": frames["gap_drive_functions"].iloc[:0]})
    assert figure.texts[0].get_text() == "no effect over a drive's value was found"


def test_parts_that_cancel_each_other_have_no_bars(frames):
    """Where data determine a sum only, each part may be drawn thirty times as large as the whole."""
    budget = frames["gap_budget"]
    share = budget["share"].mask(budget["part"] == "link_flexure", 30.0).mask(budget["kind"] == "covariance", -29.0)
    axes = draw("gap", frames | {"gap_budget": budget.assign(share=share)}).axes[1]
    assert not axes.patches and "no shares" in axes.texts[0].get_text()


@pytest.mark.parametrize("covariance", [-0.3, 0.2])
def test_the_budget_ends_at_one(covariance):
    """With many parts too small to be drawn by themselves."""
    rows = [(f"effect_{number}", "effect", 0.008) for number in range(10)]
    rows += [("backlash", "effect", 1.0 - 0.08 - covariance), ("both", "covariance", covariance)]
    table = pd.DataFrame(rows, columns=["part", "kind", "share"]).assign(share_low=0.0, share_high=0.1)
    axes = style.new(style.DOUBLE_MM, 30.0).subplots()
    draw_budget(axes, table)
    widths = [bar.get_width() if bar.get_x() >= 0.0 else -bar.get_width() for bar in axes.patches]
    assert sum(widths) == pytest.approx(1.0)
    assert "small parts 8 %" in [text.get_text() for text in axes.texts]


def test_a_share_of_few_readings_has_no_interval(frames):
    table = frames["gap_shrink"]
    wide = (table["trajectory"] != "*") & (table["step"] == table["step"].max())
    table = table.assign(share_closed_low=table["share_closed_low"].mask(wide, -1.0))
    table = table.assign(share_closed_high=table["share_closed_high"].mask(wide, 1.0))
    shrink = panel(draw("gap", frames | {"gap_shrink": table}), "(c)")
    labels = [text.get_text() for text in shrink.child_axes[0].get_yticklabels()]
    assert [label.endswith("% (?)") for label in labels] == [False] + [True] * (len(labels) - 1)


def test_a_share_below_zero_of_what_may_be_above_it_is_not_determined(frames):
    """100 poses with a gap far below the noise: the headline had "-100 % explained (95 %: -100 to 61)"."""
    below = {"share_closed": -1.0, "share_closed_low": -1.0, "share_closed_high": 0.61}
    figure = draw("gap", frames | {name: frames[name].assign(**below) for name in ("gap_verdicts", "gap_shrink")})
    assert any("explained fraction not determined" in text.get_text() for text in figure.axes[0].texts)
    labels = panel(figure, "(c)").child_axes[0].get_yticklabels()
    assert {text.get_text() for text in labels} == {"?"}


@pytest.mark.parametrize("covariance", [-0.55, 0.2])
def test_names_of_the_budget_neither_overlap_nor_leave_the_bar(covariance):
    """With small parts next to each other, and with covariances left of 0."""
    parts = {"transmission_error": 0.09, "drive_error_function": 0.088, "backlash": 0.05, "base_drift": 0.035}
    rows = [(name, "effect", share) for name, share in parts.items()]
    rows += [("unexplained", "unexplained", 0.04), ("calibration", "calibration", 0.16)]
    rows += [("link_flexure", "effect", 0.5), ("both", "covariance", covariance)]
    table = pd.DataFrame(rows, columns=["part", "kind", "share"])
    table = table.assign(share_low=0.5 * table["share"], share_high=1.5 * table["share"])
    with style.print_style():
        figure = style.new(style.DOUBLE_MM, 30.0)
        axes = figure.subplots()
        draw_budget(axes, table)
        figure.canvas.draw()
        boxes, bar = [text.get_window_extent() for text in axes.texts], axes.get_window_extent()
    assert len(boxes) == len(table)
    assert all(bar.x0 - 1.0 <= box.x0 and box.x1 <= bar.x1 + 1.0 for box in boxes)
    assert not any(one.overlaps(other) for one, other in combinations(boxes, 2))
