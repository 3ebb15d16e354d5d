"""A figure's SVG as a part of a page: small, with names of its own, and the glyphs that all figures share apart."""

import html
import re
from dataclasses import dataclass

# a hundredth of a point is finer than any screen; glyphs are drawn in whole numbers
_FRACTION = re.compile(r"(?<=\d\.\d\d)\d+")
_ID = re.compile(r' id="([^"]+)"')
_REFERENCE = re.compile(r'(xlink:href="#|url\(#)([^")]+)')
_GLYPH = re.compile(r'<path id="(DejaVu[^"]+)"[^>]*/>')
_DROPPED_PARTS = (r"<\?xml.*?\?>", r"<!DOCTYPE.*?>", r"<metadata>.*?</metadata>", r"<style.*?</style>", r"<!--.*?-->")
_DROPPED = re.compile("|".join(_DROPPED_PARTS), re.DOTALL)
_CAPTION = re.compile(r"<dc:description>(.*?)</dc:description>", re.DOTALL)
_SIZE = re.compile(r'<svg [^>]*?width="([\d.]+)pt" height="([\d.]+)pt"[^>]*>')
_POINTS_PER_PIXEL = 0.75


@dataclass(frozen=True)
class Inline:
    """markup: the SVG element without its glyphs; glyphs: their elements by name; width: in pixels of the page."""

    markup: str
    glyphs: dict[str, str]
    width: int


def caption(text: str) -> str:
    """What a figure's file says that it shows; empty where it says nothing."""
    found = _CAPTION.search(text)
    return html.unescape(" ".join(found[1].split())) if found else ""


def inline(text: str, name: str, label: str) -> Inline:
    """The text of an SVG file of this package as an Inline.

    name: what the names inside begin with, so that they are the page's only ones; label: what a screen reader says.
    """
    width, height = map(float, _SIZE.findall(text)[0])
    glyphs = dict((found[1], found[0]) for found in _GLYPH.finditer(text))
    body = _SIZE.sub("", _GLYPH.sub("", _DROPPED.sub("", text)))
    body = _FRACTION.sub("", " ".join(body.split())).replace("> <", "><").replace("<defs></defs>", "")
    used = {reference for _, reference in _REFERENCE.findall(body)} - set(glyphs)
    body = _ID.sub(lambda found: f' id="{name}-{found[1]}"' if found[1] in used else "", body)
    body = _REFERENCE.sub(lambda found: f"{found[1]}{name}-{found[2]}" if found[2] in used else found[0], body)
    opening = f'<svg xmlns:xlink="http://www.w3.org/1999/xlink" viewBox="0 0 {width:g} {height:g}" role="img"'
    shared = {key: " ".join(glyph.split()) for key, glyph in glyphs.items()}
    return Inline(
        f'{opening} aria-label="{html.escape(label)}">{body.strip()}', shared, round(width / _POINTS_PER_PIXEL)
    )
