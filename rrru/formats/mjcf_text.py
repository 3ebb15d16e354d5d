"""The text of an MJCF whose numbers are changed, element by element as its compiled model has them."""

import os
from copy import deepcopy
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import mujoco

from rrru.errors import ConfigError
from rrru.formats.xml_text import Document, own_children

# with these a body of the model is no element of its own place and order
_REFUSED = ("include", "attach", "replicate", "frame", "composite", "flexcomp")


class MjcfDocument(Document):
    """An MJCF.

    bodies, joints, equalities, actuators: elements in the order of the model, the world first; degrees: whether the
    file's angles are in degrees. Raises ConfigError for a file whose bodies do not all stand in it as such.
    """

    def __init__(self, file: Path) -> None:
        super().__init__(file)
        self._file, root = file, self.root
        if refused := next((one.tag for one in root.iter() if one.tag in _REFUSED), None):
            raise ConfigError(f"{file}: it has <{refused}>; allowed for a corrected model: bodies written out")
        self._find_assets()
        worlds = root.findall("worldbody")
        self.bodies = [worlds[0], *(body for world in worlds for body in world.iter("body"))]
        self.joints = [one for body in self.bodies[1:] for one in body if one.tag in ("joint", "freejoint")]
        self.equalities = [one for section in root.findall("equality") for one in own_children(section)]
        self.actuators = [one for section in root.findall("actuator") for one in own_children(section)]
        angles = [one.get("angle") for one in root.findall("compiler") if one.get("angle")]
        self.degrees = angles[-1:] != ["radian"]

    def _find_assets(self) -> None:
        """Have files that the file names found from anywhere."""
        self._folders, folder = {}, self._file.resolve().parent
        if not any("file" in one.attrib for one in self.root.iter()):
            return
        compiler = self.root.find("compiler")
        self._compiler = self.inside(self.root, "compiler", {}) if compiler is None else compiler
        common = self._compiler.attrib.pop("assetdir", "")
        for key in ("meshdir", "texturedir"):
            self._folders[key] = folder / self._compiler.get(key, common)
            self._compiler.set(key, str(self._folders[key]))

    def move_to(self, folder: Path) -> None:
        """Have files that the file names found from a folder."""
        for key, place in self._folders.items():
            self._compiler.set(key, os.path.relpath(place, folder))

    def site(self, body: int, name: str, attributes: dict[str, str]) -> Element:
        """The site of a name with these attributes, put on a body by number where there is none."""
        for one in self.root.iter("site"):
            if one.get("name") == name:
                one.attrib |= attributes
                return one
        return self.inside(self.bodies[body], "site", {"name": name} | attributes)

    def drop(self, tag: str, name: str) -> None:
        """Remove elements of a name."""
        for one in [one for one in self.root.iter(tag) if one.get("name") == name]:
            self.parent(one).remove(one)

    def compiled(self) -> mujoco.MjModel:
        """The MjModel of the file as it is now, without keyframes."""
        root = deepcopy(self.root)
        for section in root.findall("keyframe"):
            root.remove(section)
        try:
            spec = mujoco.MjSpec.from_string(ElementTree.tostring(root, encoding="unicode"))
            spec.compiler.fusestatic = False
            return spec.compile()
        except ValueError as error:
            raise ConfigError(f"{self._file}: corrected, it fails: {' '.join(str(error).split())}") from None
