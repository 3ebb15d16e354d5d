"""Names of a robot's drives in sentences, tables and figures, by legs or joints and by the kind of drive."""

import re
from dataclasses import dataclass

from rrru.kinematics.robot import Robot

# a drive turns a joint, moves a slide, or changes the length of a leg between two ball joints (strut or cable)
TURNING, SLIDING, LENGTH = KINDS = ("turning", "sliding", "length")
# what a turning drive moves, by whether every drive has a leg of its own
_MOVED = {True: "drive arm", False: "link"}


@dataclass(frozen=True)
class DriveWords:
    """Words for the drives of one robot.

    names: of the drives' sites; kinds: of the drives, each one of KINDS; parallel: whether every drive has a leg of its
    own, which then is named by its number; labels: of the drives in a file of readings, without the unit. A leg whose
    drive's label has another number, or none, is named with it.
    """

    names: tuple[str, ...] = ()
    kinds: tuple[str, ...] = ()
    parallel: bool = True
    labels: tuple[str, ...] = ()

    @property
    def noun(self) -> str:
        """The word for one of them."""
        return "leg" if self.parallel else "drive"

    @property
    def moved(self) -> str:
        """What a turning drive moves."""
        return _MOVED[self.parallel]

    def name(self, number: int) -> str:
        """Name of a drive, or of a joint that follows drives, by its number from 1 on."""
        if self.parallel:
            label = self.labels[number - 1] if number <= len(self.labels) else str(number)
            numbered = number in map(int, re.findall(r"\d+", label))
            return f"leg {number}" if numbered else f"leg {number} ({label})"
        return self.names[number - 1] if number <= len(self.names) else f"driven joint {number}"

    @property
    def all_names(self) -> tuple[str, ...]:
        """Names of all drives."""
        return tuple(self.name(number + 1) for number in range(len(self.names)))

    def place(self, number: int) -> str:
        """Where an effect of one drive acts."""
        return f"{'in' if self.parallel else 'at'} {self.name(number)}"

    def kinds_of(self, numbers: tuple[int, ...] = ()) -> tuple[str, ...]:
        """Kinds, each once, of the drives of these numbers from 1 on; of all where none of the numbers is a drive's."""
        chosen = [self.kinds[number - 1] for number in numbers if 0 < number <= len(self.kinds)]
        return tuple(dict.fromkeys(chosen or self.kinds or (TURNING,)))


def drive_words(robot: Robot) -> DriveWords:
    """The DriveWords of a Robot.

    >>> from rrru.robots.rrru3 import Rrru3
    >>> drive_words(Rrru3()).place(2)
    'in leg 2'
    """
    bars = {leg.bar_sites[0] for leg in robot.legs.legs if leg.bar}
    drives = robot.parts.drives
    kinds = (TURNING if drive.unit == "rad" else LENGTH if drive.site in bars else SLIDING for drive in drives)
    labels = (drive.column.removesuffix(f"_{drive.unit}") for drive in drives)
    return DriveWords(tuple(drive.site for drive in drives), tuple(kinds), robot.legs.parallel, tuple(labels))
