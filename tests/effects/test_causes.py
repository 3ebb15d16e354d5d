"""Texts of causes: every effect of the library has them, for every kind of drive, in words that fit the kind."""

import pytest

from rrru.effects.causes import CAUSES, cause_texts
from rrru.effects.library import NAMES
from rrru.robots.drive_words import KINDS, LENGTH, SLIDING, TURNING, DriveWords

EFFECTS = NAMES


def test_the_table_has_every_effect_of_the_library_and_no_other():
    assert set(CAUSES) == set(EFFECTS)


@pytest.mark.parametrize("parallel", [True, False])
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", EFFECTS)
def test_every_effect_says_what_it_is_what_to_inspect_and_what_to_do_with_a_source(name, kind, parallel):
    texts = cause_texts(name, DriveWords(("first",), (kind,), parallel))
    assert 20 < len(texts.meaning) < 130 and not texts.meaning.endswith(".")
    for text in (texts.inspect, texts.remedy):
        assert 30 < len(text) < 330 and text.endswith((".", "?")) and text[0].isupper()
    assert len(texts.source) > 8 and "{" not in "".join(vars(texts).values())


@pytest.mark.parametrize("kind", [SLIDING, LENGTH])
@pytest.mark.parametrize("name", EFFECTS)
def test_of_a_drive_that_slides_nothing_is_said_about_gears_and_arms_that_turn(name, kind):
    """But of effects that only drives that turn have."""
    texts = cause_texts(name, DriveWords(("first",), (kind,)))
    if isinstance(CAUSES[name].meaning, dict):
        said = f"{texts.meaning} {texts.inspect} {texts.remedy}"
        assert not any(word in said for word in ("drive arm", "gear", "turn of the", "torque", "wave generator"))


def test_of_drives_of_several_kinds_those_at_fault_count():
    words = DriveWords(("a", "b", "c"), (SLIDING, TURNING, TURNING), parallel=False)
    assert (
        cause_texts("backlash", words, (1,)).meaning
        == "backlash between motor and slide, as in a nut, a rack or a belt"
    )
    assert cause_texts("backlash", words, (3,)).meaning == "backlash between motor and link"
    both = cause_texts("backlash", words).meaning
    assert "slide" in both and "motor and link" in both


def test_an_effect_of_the_user_s_own_has_no_words():
    assert not any(vars(cause_texts("drift")).values())
