"""Restarts of the twin's search: reproducible, resumable, on any number of processes, and when it ends."""

from dataclasses import replace

import numpy as np
import pytest

from rrru.studies.rrru3 import twin, twin_restarts, twin_search
from rrru.studies.rrru3.schemas import TABLES
from tests.studies.rrru3.test_twin import CANDIDATE

SECTION = {"seed": 3, "share": 0.02, "candidates": 2, "members": 3, "stall_descents": 50, "stall_nat": 0.1}
SECTION |= {"evaluations": 350, "restarts": 2, "hours": 1.0, "hypotheses": {}}

pytestmark = pytest.mark.usefixtures("short_descents")


@pytest.fixture(scope="module")
def whole(task, short_descents):
    return twin_restarts.search(task, SECTION, CANDIDATE)


def same(one, other):
    assert [restart.state() for restart in one] == [restart.state() for restart in other]


def test_the_same_seed_gives_the_same_restarts_on_any_number_of_processes(task, whole):
    same(whole[0], twin_restarts.search(task, SECTION, CANDIDATE, workers=2)[0])
    other = twin_restarts.search(task, SECTION | {"seed": 4}, CANDIDATE)[0]
    assert [one.best for one in other] != [one.best for one in whole[0]]


def test_an_interrupted_search_ends_with_the_bytes_of_an_uninterrupted_one(task, whole, tmp_path):
    path, direct = tmp_path / "state.json", tmp_path / "direct.json"
    twin_restarts.search(task, SECTION, CANDIDATE, path=direct)
    for _ in range(20):
        restarts, ended = twin_restarts.search(task, SECTION, CANDIDATE, path=path, limit=2)
        if ended:
            break
    same(whole[0], restarts)
    assert ended == whole[1] == "restarts"
    # only the time differs
    first, second = (file.read_text().split('"restarts"')[1] for file in (path, direct))
    assert first == second
    for name, frame in twin_restarts.tables(restarts, ended).items():
        next(table for table in TABLES if table.name == name).pandera().validate(frame)


def test_the_state_of_another_search_is_not_continued(task, tmp_path):
    path = tmp_path / "state.json"
    few = SECTION | {"restarts": 1, "evaluations": 100}
    first, _ = twin_restarts.search(task, few, CANDIDATE, path=path)
    other, _ = twin_restarts.search(replace(task, of_model=True), few, CANDIDATE, path=path)
    same(other, twin_restarts.search(replace(task, of_model=True), few, CANDIDATE)[0])
    assert other[0].best != first[0].best
    # more restarts continue it
    more, _ = twin_restarts.search(replace(task, of_model=True), few | {"restarts": 2}, CANDIDATE, path=path)
    same(more[:1], other)


def test_the_best_stays_in_its_bounds_and_the_progress_never_rises(task, whole):
    best = twin_restarts.best(whole[0])
    assert best.best == pytest.approx(twin_search.cost(list(best.twin.values.values()), task))
    for name, (low, high) in twin.SEARCH_BOUNDS.items():
        assert low <= best.twin.values[name] <= high
    progress = twin_restarts.tables(*whole)["twin_progress"]
    assert (progress.groupby("restart")["objective_nat"].diff().dropna() <= 0.0).all()


def test_a_search_about_a_twin_is_never_worse_than_it(task):
    far = SECTION | {"share": 0.5, "evaluations": 100, "restarts": 1}
    restarts, _ = twin_restarts.search(task, far, CANDIDATE)
    assert restarts[0].best <= twin_search.cost(list(CANDIDATE.values.values()), task) < twin_search.WORST


def test_angles_come_round_and_other_numbers_end_at_their_bounds(task):
    restart = twin_restarts.Restart(task, SECTION, 0, CANDIDATE)
    genes = np.full((1, len(twin.SEARCH_BOUNDS)), 1.25)
    values = dict(zip(twin.SEARCH_BOUNDS, restart.values(genes)[0], strict=True))
    assert values["start_deg"] == pytest.approx(-90.0) and values["phase2"] == pytest.approx(-0.5 * np.pi)
    assert values["wobble_mm"] == pytest.approx(twin.SEARCH_BOUNDS["wobble_mm"][1])


def test_the_search_ends_where_three_restarts_agree_or_with_its_time(task, whole):
    def ended(*bests, hours=0.0, restarts=9):
        made = []
        for best in bests:
            restart = twin_restarts.Restart(task, SECTION, 0, CANDIDATE)
            restart.objectives, restart.stopped = [best], "stalled"
            made.append(restart)
        return twin_restarts._ended(made, SECTION | {"restarts": restarts}, hours)

    assert ended(90.0, 90.5) == "" and ended(90.0, 95.0, 90.8) == ""
    assert ended(90.0, 95.0, 90.8, 90.3) == "agreed"
    assert ended(90.0, 95.0, 91.0, 90.3) == ""
    assert ended(90.0, hours=1.0) == "time" and ended(90.0, 95.0, restarts=2) == "restarts"


def test_a_restart_holds_the_best_of_every_optimum_and_never_one_twice(task):
    restart = twin_restarts.Restart(task, SECTION, 0)
    size = len(twin.SEARCH_BOUNDS)
    at = {place: np.full(size, place) for place in (0.1, 0.3, 0.5, 0.7, 0.9)}
    for place, objective in ((0.1, 95.0), (0.5, 90.0), (0.9, 93.0)):
        restart._hold(at[place], objective)
    assert restart.objectives == [90.0, 93.0, 95.0]
    # the same optimum, better and worse; another one that is better than the worst, and one that is not
    restart._hold(at[0.9] + 0.01, 92.0)
    restart._hold(at[0.5] - 0.01, 91.0)
    restart._hold(at[0.3], 94.0)
    restart._hold(at[0.7], 99.0)
    assert restart.objectives == [90.0, 92.0, 94.0]
    np.testing.assert_allclose(restart.genes[:, 0], [0.5, 0.91, 0.3])
    # an angle that comes round is near on the other side
    turned = at[0.3].copy()
    turned[restart.periodic] += 0.69
    low = at[0.3].copy()
    low[restart.periodic] -= 0.29
    assert abs(restart._apart(turned, low)).max() == pytest.approx(0.02)


def test_children_of_a_kind_and_the_best_of_them(task):
    restart = twin_restarts.Restart(task, SECTION | {"candidates": 20}, 0)
    names, held = list(twin.SEARCH_BOUNDS), (0.25, 0.5, 0.75)
    for place in held:
        restart._hold(np.full(len(names), place), place)
    groups = twin.parts(names)
    assert [name for group in groups for name in group] == names

    def children(kind):
        seen = []

        def rate(genes, tolerance):
            assert tolerance > 0.0
            seen.append(genes)
            return np.arange(len(genes))[::-1, None] - 0.0

        restart.descents = kind
        best = restart._child(rate)
        np.testing.assert_array_equal(best, seen[0][-1])
        return [dict(zip(names, child, strict=True)) for child in seen[0]]

    for child in children(0):
        assert all(len({child[name] for name in group}) == 1 for group in groups)
        assert len(set(child.values())) == 2 and set(child.values()) <= set(held)
    drawn = [[group for group in groups if not {child[name] for name in group} <= set(held)] for child in children(1)]
    assert all(len(part) == 1 for part in drawn) and len({str(part) for part in drawn}) == 1
    # of one from another, all genes alike by the share of a difference
    for child in children(2):
        assert len({round(child[name], 9) for name in names if name not in twin.PERIODIC}) == 1
    (changed,) = children(3)
    assert 0.0 < min(abs(changed["dL1"] - place) for place in held) < 0.5
