"""Numbers of the figures: round magnifications, short digits; the fonts in their files."""

import re
import zlib
from io import BytesIO

import numpy as np
import pytest
from fontTools.ttLib import TTFont
from matplotlib.image import imread

from rrru.figures import style


@pytest.mark.parametrize(
    ("largest", "span", "factor"),
    [(8.0, 500.0, 10.0), (1.0, 500.0, 50.0), (1e3, 500.0, 1.0), (np.nan, 500.0, 500.0), (0.1, 0.0, 1.0)],
)
def test_magnification_is_round(largest, span, factor):
    assert style.magnification([0.1, np.nan, -largest], span) == factor


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.0471, "0.047"), (-5.031, "\N{MINUS SIGN}5.03"), (-47.11, "\N{MINUS SIGN}47.1"), (471.1, "471"), (np.nan, "–")],
)
def test_numbers_are_short(value, text):
    assert style.number(value) == text


def test_a_label_below_long_names_is_on_the_page(tmp_path):
    figure = style.new(style.SINGLE_MM, 80.0)
    axes = figure.subplots()
    axes.set_xticks(range(30), ["right_arm_platform_y"] * 30, rotation=90.0, fontsize=6.0)
    axes.set_xlabel("error parameter")
    style.save(figure, {"png": tmp_path / "a.png"})
    assert (imread(tmp_path / "a.png")[-2:, :, :3] == 1.0).all()


def test_a_pdf_holds_the_glyphs_that_it_shows_and_nothing_to_lay_them_out(tmp_path):
    figure = style.new(style.SINGLE_MM, 40.0)
    figure.subplots().set_axis_off()
    figure.text(0.1, 0.5, "AV fi \N{MINUS SIGN}5.03 µm")
    style.save(figure, {"pdf": tmp_path / "a.pdf"})
    streams = re.findall(rb"stream\r?\n(.*?)\r?\nendstream", (tmp_path / "a.pdf").read_bytes(), re.DOTALL)
    files = [zlib.decompress(stream) for stream in streams if stream.startswith(b"\x78")]
    # the ligature has a font of its own
    fonts = [TTFont(BytesIO(file)) for file in files if file.startswith(b"\0\1\0\0")]
    assert {"A", "V", "fi", "minus", "five", "m"} <= {name for font in fonts for name in font.getGlyphOrder()}
    for font in fonts:
        assert {"glyf", "hmtx", "head"} <= set(font.keys()) and not {"GDEF", "GPOS", "GSUB"} & set(font.keys())
