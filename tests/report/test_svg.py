"""Figures within a page: every name once, every reference answered, nothing lost, captions unchanged."""

import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest

from rrru.figures import style
from rrru.report import svg

_HREF = "{http://www.w3.org/1999/xlink}href"


@pytest.fixture(scope="module")
def text(tmp_path_factory):
    """A figure with text, markers, a clipped line and a picture, as a file."""
    with style.print_style():
        figure = style.new(style.SINGLE_MM, 60.0)
        axes = figure.subplots()
        axes.plot([0.0, 1.0, 2.0], [0.0, 3.0, 1.0], "o-", label="a & b")
        axes.imshow(np.eye(3), extent=(0, 1, 0, 1))
        axes.set(xlabel="x (mm)", title="α < β")
    path = tmp_path_factory.mktemp("figure") / "a.svg"
    style.save(figure, {"svg": path}, 'Where "it" is:\n    1 < 2 & more.')
    return path.read_text()


def parsed(one):
    """The elements of an Inline with its glyphs."""
    glyphs = "".join(one.glyphs.values())
    return ElementTree.fromstring(f'<page xmlns:xlink="http://www.w3.org/1999/xlink">{one.markup}{glyphs}</page>')


def references(tree):
    """Names that elements point to."""
    texts = [value for element in tree.iter() for value in element.attrib.values()]
    found = [element.attrib[_HREF][1:] for element in tree.iter() if element.attrib.get(_HREF, "").startswith("#")]
    return found + [value.partition("url(#")[2].partition(")")[0] for value in texts if "url(#" in value]


def test_a_caption_is_read_back_as_it_was_written(text):
    assert svg.caption(text) == 'Where "it" is: 1 < 2 & more.'
    assert svg.caption("<svg></svg>") == ""


def test_two_figures_share_no_name_but_glyphs_and_every_reference_is_answered(text):
    trees = [parsed(svg.inline(text, name, "label")) for name in ("one", "two")]
    names = [[element.get("id") for element in tree.iter() if element.get("id")] for tree in trees]
    glyphs = set(svg.inline(text, "one", "").glyphs)
    assert set(names[0]) & set(names[1]) == glyphs and len(glyphs) > 5
    for tree, own in zip(trees, names, strict=True):
        assert len(own) == len(set(own)) and len(references(tree)) > 20 and set(references(tree)) <= set(own)


def test_nothing_that_is_drawn_is_lost(text):
    drawn = ("path", "use", "image", "polygon", "rect")

    def count(tree):
        tags = [element.tag.rpartition("}")[2] for element in tree.iter()]
        return {tag: tags.count(tag) for tag in drawn}

    one = svg.inline(text, "one", "a <label>")
    assert count(parsed(one)) == count(ElementTree.fromstring(text[text.index("<svg") :]))
    assert 'aria-label="a &lt;label&gt;"' in one.markup and len(one.markup) < len(text)
    assert one.width == round(style.SINGLE_MM / 25.4 * 96.0)
