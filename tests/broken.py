"""Broken copies of nested data, of XML and of bytes; a test's inputs are as many as RRRU_BROKEN_FILES says."""

import copy
import os
import re
from xml.etree import ElementTree

from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

COUNT = int(os.environ.get("RRRU_BROKEN_FILES", "8"))
NAUGHTY = [None, True, "", "NA", "1,5", "../x", "a b", "\u0663", "\x00", "{x}", "nan", "0.5", -1, 0, 1e308, 10**30, 2.5]
NAUGHTY += [float("nan"), float("inf"), -float("inf"), [], {}, [[]], {"": 1}, {1: 2}, [None], ["a", "a"], "x" * 300]
_NUMBERS = [float("nan"), float("inf"), -float("inf"), 0, 1, 7, -1, 0.5, -3.7, 1e-9, 1e4, 1e15, 1e308]
_PLACE = st.integers(0, 999_999)
_VALUES = st.one_of(st.sampled_from(NAUGHTY), st.text(max_size=6), st.floats(), st.integers())
_KINDS = st.sampled_from(["value", "number", "drop", "twice", "rename", "other"])
EDITS = st.lists(st.tuples(_KINDS, _PLACE, _VALUES), min_size=1, max_size=3)
SPLICES = st.lists(st.tuples(_PLACE, st.integers(0, 40), st.binary(max_size=20)), min_size=1, max_size=3)


def many(count=COUNT):
    """Settings of a property test of so many examples, the same in every run."""
    quiet = list(HealthCheck)
    return settings(max_examples=count, deadline=None, suppress_health_check=quiet, derandomize=True, database=None)


def counted(counts, refusal, call, *arguments, **options):
    """Call, and count what is taken and what is refused by an error of that kind, which says something."""
    try:
        call(*arguments, **options)
        counts["taken"] += 1
    except refusal as error:
        # a place, and what is wrong there
        assert re.match(r".+: .+", str(error)), error
        counts["refused"] += 1


def edited(tree, edits):
    """A copy of nested mappings and lists with values replaced, exchanged, doubled, dropped or renamed."""
    tree = copy.deepcopy(tree)
    for kind, place, value in edits:
        places = list(_places(tree))
        if not places:
            break
        holder, key = _at(places, place)
        if kind == "value":
            holder[key] = value
        elif kind == "number":
            numbers = [at for at in places if isinstance(at[0][at[1]], int | float)] or places
            holder, key = _at(numbers, place)
            holder[key] = _NUMBERS[place % len(_NUMBERS)]
        elif kind == "drop":
            del holder[key]
        elif kind == "other":
            other, its = _at(places, place * 7919 % 1_000_000)
            holder[key] = copy.deepcopy(other[its])
        elif isinstance(holder, list):
            holder.insert(key, copy.deepcopy(holder[key]))
        else:
            new = value if kind == "rename" and isinstance(value, str | int) else f"{key}_2"
            holder[new] = copy.deepcopy(holder[key]) if kind == "twice" else holder.pop(key)
    return tree


def edited_xml(text, edits):
    """An XML text with attributes and elements replaced, exchanged, doubled, dropped or renamed."""
    root = ElementTree.fromstring(text)
    for kind, place, value in edits:
        element, holder = _at(
            [(child, parent) for parent in root.iter() for child in parent] or [(root, [root])], place
        )
        # in braces ElementTree takes it for a namespace
        word = str(value).replace("{", "")
        if element.attrib and place % 3:
            key = _at(list(element.attrib), place * 7919 % 1_000_000)
            if kind in ("drop", "rename"):
                element.attrib[word if kind == "rename" else key] = element.attrib.pop(key)
            if kind == "drop":
                del element.attrib[key]
            elif kind == "number":
                words = element.attrib[key].split() or [""]
                words[place % len(words)] = str(_NUMBERS[place % len(_NUMBERS)])
                element.attrib[key] = " ".join(words)
            elif kind in ("value", "twice"):
                element.attrib[key] = word if kind == "value" else f"{element.attrib[key]} {word}"
            elif kind == "other":
                element.attrib[key] = _at([v for e in root.iter() for v in e.attrib.values()], place * 7919 % 1_000_000)
        elif kind == "drop":
            holder.remove(element)
        elif kind == "twice":
            holder.append(copy.deepcopy(element))
        elif kind == "other":
            holder.append(copy.deepcopy(_at(list(root.iter()), place * 7919 % 1_000_000)))
        else:
            element.tag = word
    return ElementTree.tostring(root, encoding="unicode")


def edited_lines(text, edits):
    """A text with words of its lines replaced, and lines exchanged, doubled, dropped or renamed."""
    lines = text.splitlines()
    for kind, place, value in edits:
        if not lines:
            break
        at = place * len(lines) // 1_000_000
        words = re.split(r"([\s:=,]+)", lines[at])
        if kind in ("value", "number"):
            words[place % len(words)] = str(value if kind == "value" else _NUMBERS[place % len(_NUMBERS)])
        elif kind == "rename":
            words[0] = str(value)
        new = {"drop": [], "twice": [lines[at]] * 2, "other": [_at(lines, place * 7919 % 1_000_000)]}
        lines[at : at + 1] = new.get(kind, ["".join(words)])
    return "\n".join(lines)


def spliced(data, splices):
    """Bytes with some of them replaced; a place past 900,000 cuts the rest off."""
    data = bytearray(data)
    for place, length, new in splices:
        at = place * len(data) // 1_000_000
        data[at : None if place > 900_000 else at + length] = new
    return bytes(data)


def _places(tree):
    """Every (holder, key) of nested mappings and lists."""
    for key, value in tree.items() if isinstance(tree, dict) else enumerate(tree):
        yield tree, key
        if isinstance(value, dict | list):
            yield from _places(value)


def _at(items, place):
    """The item at a place of 0 to 999,999."""
    return items[place * len(items) // 1_000_000]
