"""Two calibrations compared: differences beyond chance are reported, others are not, on points that neither used."""

import numpy as np
import pandas as pd
import pytest
from scipy.stats import chi2, kstest

from rrru import cli
from rrru.errors import ConfigError
from rrru.report import compare, compare_page
from rrru.report.compare import gap_difference, over_runs
from rrru.report.compare_unseen import _compared, same_points, unseen
from tests.refusals import refusals
from tests.report import campaigns
from tests.report.campaigns import ERRORS, NOMINAL, joined, leave, measured

OTHER = ERRORS | {"dL2": 0.05, "dtheta3": 2e-4}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Results of one robot measured twice (a, b), after a change (changed), and noisily and briefly (poor)."""
    place = tmp_path_factory.mktemp("results")
    first = measured(1)
    leave(place, "a", first)
    leave(place, "b", measured(2))
    leave(place, "changed", measured(3, OTHER))
    poor = measured(4, noise_mm=0.3, passes=(campaigns.FORWARD,))
    leave(place, "poor", poor, 0.3)
    leave(place, "longer", joined(first, measured(5)))
    return place


def sides(folder, *names):
    return [compare.read(folder, name, name) for name in names]


def test_the_same_robot_measured_twice_does_not_differ(folder):
    first, second = sides(folder, "a", "b")
    found = compare.difference(first, second, "both")
    assert found.freedom == 7 and found.chance > 0.01
    assert all(place.chance > 0.01 for place in unseen(first, second, "both"))
    assert gap_difference(first, second).chance > 0.01


def test_chance_is_what_it_says_over_many_draws(folder):
    """The probabilities of robots that do not differ are spread evenly from 0 to 1."""
    first, _ = sides(folder, "a", "b")
    own, covariance = compare._estimate(first, "both")
    generator, chances = np.random.default_rng(0), []
    for values in generator.multivariate_normal(np.zeros(len(own)), covariance, (60, 2)):
        drawn = [compare.Side("", "", {}, first.frames | {"parameters": shifted(own, one)}, {}) for one in values]
        chances.append(compare.difference(*drawn, "both").chance)
    assert kstest(chances, "uniform").pvalue > 0.01


def shifted(own, values):
    return own.reset_index().assign(value=values)


def test_a_change_is_reported_with_its_chi_square_and_its_parameter(folder):
    first, second = sides(folder, "a", "changed")
    found = compare.difference(first, second, "both")
    # the chi-square by its definition, from the tables
    step, matrices = [], []
    for side in (first, second):
        rows = side.frames["parameters"].query("calibration == 'both' and method == 'least_squares'")
        names = list(rows["parameter"])
        matrix = np.diag(rows["standard_error"].to_numpy() ** 2)
        for row in side.frames["correlations"].query("calibration == 'both'").itertuples():
            i, j = names.index(row.parameter_a), names.index(row.parameter_b)
            matrix[i, j] = matrix[j, i] = row.correlation * np.sqrt(matrix[i, i] * matrix[j, j])
        step.append(rows["value"].to_numpy())
        matrices.append(matrix)
    square = (step[1] - step[0]) @ np.linalg.inv(sum(matrices)) @ (step[1] - step[0])
    assert found.chi_square == pytest.approx(square, rel=1e-6)
    assert found.chance == pytest.approx(chi2.sf(square, 7), abs=1e-12) and found.chance < 1e-3
    wins = [place.rms_mm[0] < place.rms_mm[1] for place in unseen(first, second, "both")]
    assert wins == [True, False]


def test_the_better_calibration_predicts_even_the_other_s_points_better(folder):
    first, second = sides(folder, "poor", "a")
    judged = unseen(first, second, "both")
    assert [place.campaign for place in judged] == ["poor", "a"]
    assert all(place.rms_mm[1] < place.rms_mm[0] for place in judged)
    assert judged[1].chance < 0.01
    said = list(compare_page._better((first, second), judged))
    assert said[-1] == "Which to trust: a."


def test_points_that_both_have_measured_are_seen_by_neither(folder):
    """A campaign and the same with more runs: where it is asked for, both are fitted without the fold."""
    first, second = sides(folder, "a", "longer")
    count = len(first.frames["measurements"])
    assert same_points(first, second) == count and same_points(*sides(folder, "a", "b")) == 0
    judged = unseen(first, second, "both")
    # more measurements of the same robot do no harm
    assert [place.points for place in judged] == [count, 2 * count]
    assert all(abs(place.rms_mm[1] / place.rms_mm[0] - 1.0) < 0.1 for place in judged)
    same = unseen(first, first, "both")
    assert len(same) == 1 and same[0].rms_mm[0] == same[0].rms_mm[1] and same[0].chance == 1.0
    # what was left out is predicted worse than what was fitted
    fitted = first.frames["calibrations"].query("calibration == 'both' and method == 'least_squares'")["rms_mm"].iloc[0]
    assert same[0].rms_mm[0] > fitted


def test_the_error_over_runs_is_that_of_a_mean_of_runs():
    generator = np.random.default_rng(1)
    offsets = generator.normal(0.0, 1.0, (400, 12))
    values = np.repeat(offsets, 5, axis=1) + generator.normal(0.0, 0.1, (400, 60))
    runs = pd.Series(np.repeat(np.arange(12), 5))
    found = np.array([over_runs(pd.Series(row), runs) for row in values])
    assert np.sqrt((found[:, 1] ** 2).mean()) == pytest.approx(found[:, 0].std(), rel=0.1)


@pytest.mark.parametrize("runs", [1, 3])
def test_chance_is_known_where_there_are_few_runs(runs):
    """All poses in one run: a side that is thirty times worse is no chance, and equal ones are."""
    generator = np.random.default_rng(2)
    errors = pd.DataFrame({"trajectory": "poses", "run": np.arange(120) * runs // 120})
    errors["a"] = np.abs(generator.normal(0.0, 0.055, 120))
    clear = _compared("x", errors.assign(b=np.abs(generator.normal(0.0, 1.8, 120))))
    assert clear.chance < 1e-3 and clear.gain_mm2 > 0.0
    equal = [
        _compared("x", errors.assign(b=np.abs(np.random.default_rng(k).normal(0.0, 0.055, 120)))) for k in range(20)
    ]
    assert np.median([one.chance for one in equal]) > 0.1
    assert _compared("x", errors.head(2).assign(b=1.0)).chance == 1.0


def test_a_page_of_two_folders_has_every_campaign_that_both_have(folder, tmp_path):
    leave(tmp_path, "a", measured(7))
    leave(tmp_path, "alone", measured(8))
    compare_page.write(str(folder), str(tmp_path), tmp_path / "page.html")
    text = (tmp_path / "page.html").read_text()
    assert text.count("<h2") == 1 and "do not differ beyond their errors" in text and "alone" not in text
    compare_page.write(str(folder), str(tmp_path), tmp_path / "again.html")
    assert (tmp_path / "again.html").read_text() == text


@pytest.fixture(scope="module")
def others(tmp_path_factory):
    """Results that cannot be compared with the others."""
    place, frame = tmp_path_factory.mktemp("others"), measured(9)
    leave(place, "other", frame, nominal=NOMINAL | {"name": "delta"})
    leave(place, "wide", frame, nominal=NOMINAL | {"dimensions": {"R_mm": 410.0}})
    leave(place, "lines", frame, sets={"sets": {"few": ["line_*"], "both": ["*"]}})
    calibrations = place / "campaigns/lines/calibrations.parquet"
    pd.read_parquet(calibrations).query("calibration == 'few'").to_parquet(calibrations)
    leave(place, "framed", frame)
    numbers = place / "campaigns/framed/parameters.parquet"
    own = pd.read_parquet(numbers)
    pd.concat([own, own[own["parameter"] == "dL1"].assign(parameter="world_x")]).to_parquet(numbers)
    leave(place, "turned", frame)
    readings = place / "campaigns/turned/measurements.parquet"
    pd.read_parquet(readings).assign(target="ball").to_parquet(readings)
    leave(place, "bare", frame)
    (place / "campaigns/bare/verdict.json").unlink()
    (place / "empty").mkdir()
    return place


@refusals("first", "second", "words")
def test_what_cannot_be_compared_is_refused_in_words(folder, others, tmp_path, first, second, words):
    texts = [text.format(folder, others) for text in (first, second)]
    with pytest.raises(ConfigError, match=words):
        compare_page.write(*texts, tmp_path / "page.html")
    assert not list(tmp_path.glob("page*"))


def test_the_command_ends_with_a_message(folder, tmp_path, capsys):
    page = ["--page", str(tmp_path / "page.html")]
    assert cli.main(["compare", f"{folder}:a", f"{folder}:a", *page]) == cli.WRONG
    assert "error: compare: A and B are both" in capsys.readouterr().err
    assert cli.main(["compare", f"{folder}:a", f"{folder}:b", *page]) == cli.DONE
    assert capsys.readouterr().out.strip() == f"page: {tmp_path / 'page.html'}"


def test_a_group_is_named_as_one_with_the_probability_that_one_of_it_acts(tmp_path):
    """The most probable cause was named for all of it, with the probability that it acts alone."""
    group = {"names": ["backlash", "friction_windup"], "probabilities": [0.55, 0.43], "probability": 0.98}
    for name, groups in (("a", [group]), ("b", [])):
        leave(tmp_path, name, measured(7), groups=groups)
    compare_page.write(f"{tmp_path}:a", f"{tmp_path}:b", tmp_path / "page.html")
    text = (tmp_path / "page.html").read_text()
    assert "after calibration: backlash or friction windup (probability 0.98)." in text
    assert "after calibration: backlash (probability 0.90)." in text
