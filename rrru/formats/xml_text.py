"""Edits of an XML file that a person wrote: comments, order and indentation stay."""

from pathlib import Path
from typing import cast
from xml.etree import ElementTree
from xml.etree.ElementTree import Element
from xml.parsers import expat

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

# m and rad to a thousandth of a nanometre
_DIGITS = 12


class Document:
    """A file's root element, and what stands before and behind it."""

    def __init__(self, file: Path) -> None:
        text = file.read_text()
        starts, finder = [], expat.ParserCreate()
        finder.StartElementHandler = lambda *_: starts.append(finder.CurrentByteIndex)
        finder.Parse(text.encode(), True)
        self._head = text.encode()[: starts[0]].decode()
        parser = ElementTree.XMLParser(target=ElementTree.TreeBuilder(insert_comments=True))
        self.root = ElementTree.fromstring(text, parser)
        self._tight = '" />' not in text
        self._tail = text[text.rindex(">") + 1 :]

    @property
    def text(self) -> str:
        """The file."""
        text = ElementTree.tostring(self.root, encoding="unicode")
        return self._head + (text.replace('" />', '"/>') if self._tight else text) + self._tail

    def parent(self, element: Element) -> Element:
        """The element that another one is in."""
        return next(one for one in self.root.iter() if element in list(one))

    def note(self, element: Element, text: str) -> None:
        """Put a comment before an element, on a line of its own."""
        # a comment is an element whose tag is a function
        comment = cast(Element, ElementTree.Comment(f" {text} "))
        self._insert(self.parent(element), element, comment, 0)

    def behind(self, element: Element, tag: str, attributes: dict[str, str]) -> Element:
        """A new element behind another one."""
        new = ElementTree.Element(tag, attributes)
        self._insert(self.parent(element), element, new, 1)
        return new

    def inside(self, parent: Element, tag: str, attributes: dict[str, str]) -> Element:
        """A new element at the end of another one."""
        new, children = ElementTree.Element(tag, attributes), list(parent)
        if children:
            self._insert(parent, children[-1], new, 1)
        else:
            parent.append(new)
        return new

    def _insert(self, parent: Element, element: Element, new: Element, offset: int) -> None:
        """Insert an element before or behind a child of parent, indented like that."""
        number = list(parent).index(element)
        gap = parent.text if number == 0 else parent[number - 1].tail
        parent.insert(number + offset, new)
        if offset:
            new.tail, element.tail = element.tail, gap
        else:
            new.tail = gap


def child(element: Element, tag: str) -> Element:
    """The child of a tag that an element of a readable file has."""
    found = element.find(tag)
    if found is None:
        raise LookupError(f"<{element.tag}> has no <{tag}>")
    return found


def own_children(element: Element) -> list[Element]:
    """Children of an element without comments."""
    return [child for child in element if isinstance(child.tag, str)]


def words(values: npt.ArrayLike) -> str:
    """Numbers as text."""
    return " ".join(f"{value:.{_DIGITS}g}" for value in np.round(np.ravel(values), _DIGITS + 2) + 0.0)


def sizes(values: npt.ArrayLike) -> str:
    """Standard errors as text."""
    return " ".join(f"{value:.2g}" for value in np.round(np.ravel(values), _DIGITS))


def quaternion(turn: np.ndarray) -> np.ndarray:
    """MuJoCo's quaternion (4,) of a turn (3, 3)."""
    return np.asarray(Rotation.from_matrix(turn).as_quat(canonical=True, scalar_first=True))


def roll_pitch_yaw(turn: np.ndarray) -> np.ndarray:
    """A URDF's rpy (3,) of a turn (3, 3), yaw 0 where the pitch is a right angle."""
    pitch = np.arctan2(-turn[2, 0], np.hypot(turn[0, 0], turn[1, 0]))
    if np.hypot(turn[0, 0], turn[1, 0]) < 1e-14:
        return np.array([np.arctan2(-turn[1, 2], turn[1, 1]), pitch, 0.0])
    return np.array([np.arctan2(turn[2, 1], turn[2, 2]), pitch, np.arctan2(turn[1, 0], turn[0, 0])])
