"""The catalogue of effects is that of the package, and its shares are those of plain least squares."""

import inspect
import re
from dataclasses import replace

import numpy as np
import pytest

from rrru.diagnosis.detectability import detectability
from rrru.diagnosis.state import ModelState
from rrru.effects.library import NAMES, library
from rrru.effects.protocol import PATH
from rrru.studies import effect_catalogue as catalogue
from tests.places import ROOT

_NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[-+]\d+)?")
_FRESH = "run python -m rrru.studies.effect_catalogue"


def _alike(saved, made, most):
    """Whether two texts have the same words, and numbers that differ by no more than rounding on other machines."""
    if _NUMBER.sub("#", saved) != _NUMBER.sub("#", made):
        return False
    first, second = (np.array(_NUMBER.findall(text), dtype=float) for text in (saved, made))
    return bool((np.abs(first - second) <= most + 1e-3 * np.abs(first)).all())


def test_the_page_is_up_to_date():
    assert _alike((ROOT / "docs/effects.md").read_text(), catalogue.markdown(), 0.011), _FRESH


def test_the_pictures_are_up_to_date():
    made = catalogue.pictures()
    assert {path.stem for path in (ROOT / "docs/effects").glob("*.svg")} == set(made), _FRESH
    assert not [
        name for name, text in made.items() if not _alike((ROOT / f"docs/effects/{name}.svg").read_text(), text, 0.2)
    ], _FRESH


@pytest.mark.parametrize("name", NAMES)
def test_an_effect_states_its_equation_its_source_and_its_sizes(name):
    text = inspect.getdoc(catalogue._module(name))
    assert re.search(r"^Source: \S", text, re.MULTILINE) and re.search(r"^    \S", text, re.MULTILINE)
    section = catalogue._section(name)
    assert "prior s.d." in section.lower() or name == "transmission_orders"


def test_every_need_has_words():
    needs = {
        need for scene in catalogue.SCENES for one in library(scene.problem().mechanism).values() for need in one.needs
    }
    assert needs | {PATH} <= set(catalogue.NEEDS)


@pytest.mark.parametrize("scene", catalogue.SCENES, ids=lambda scene: scene.title)
def test_the_most_confounded_effect_is_that_of_the_diagnosis(scene):
    problem = scene.problem()
    linear = problem.linearise(ModelState(np.zeros(len(problem.mechanism.parameters)), {}))
    # a diagnosis has chosen the orders of an effect that has none before
    problem = replace(problem, library={name: one for name, one in problem.library.items() if len(one.coordinates)})
    rows = detectability(problem, linear).query("testable and confounded_with != ''").set_index("effect")
    assert len(rows) > 5
    for name, row in rows.iterrows():
        rivals = catalogue.confounded(scene, name)
        assert rivals[row["confounded_with"]] == pytest.approx(max(rivals.values()), abs=1e-9)
        assert row["confounded_share"] == pytest.approx(min(max(rivals.values()), 1.0), abs=1e-6)


def test_a_share_is_that_of_least_squares():
    """Of servo lag, what is left by a fit of the calibration, and by one of calibration and backlash together."""
    scene = catalogue.SCENES[0]
    problem = scene.problem()
    linear = problem.linearise(ModelState(np.zeros(len(problem.mechanism.parameters)), {}))

    def columns(name):
        shapes = range(len(problem.library[name].coordinates.shapes))
        return np.concatenate([linear.columns[name, shape].reshape(3 * len(problem), -1) for shape in shapes], axis=1)

    def left(wanted, *given):
        matrix = np.concatenate(given, axis=1)
        matrix = matrix / np.linalg.norm(matrix, axis=0)
        return ((wanted - matrix @ np.linalg.lstsq(matrix, wanted, rcond=1e-12)[0]) ** 2).sum()

    base = linear.base.reshape(3 * len(problem), -1)
    wanted = columns("servo_lag") * problem.library["servo_lag"].coordinates.typical
    share = 1.0 - left(wanted, base, columns("backlash")) / left(wanted, base)
    assert catalogue.confounded(scene, "servo_lag")["backlash"] == pytest.approx(share, abs=1e-6)
