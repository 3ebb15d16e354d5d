"""Link growth: single links of an arm, or of a parallel robot's legs, grow with time towards a limit.

One motor warms its link, or the sun one rod. As in `thermal_growth`, but with a final strain e_k of its own for all
lengths l of link k:

    dl(t) = l e_k (1 - exp(-t / tau))

One time constant tau holds for all links. A link of an arm is what drive k moves and drive k + 1 does not. The column
below the first drive is no link: its growth moves the whole robot as a drift of the base does. A length behind a joint
that follows drives is of the link of the drive before it.

A leg of a parallel robot has an arm, from its drive to the first passive joint, and rods, from there to the platform;
each has a strain of its own. Rods side by side on one arm are rods of one leg. A leg whose length is driven grows as
its screw does, see `screw_growth`. Base and platform are no links.

Assumptions: each link has one temperature; constant power over the campaign.

Source: as `thermal_growth`; Mayr et al., Thermal issues in machine tools, CIRP Annals 61, 2012 (heat of single drives).
"""

from collections.abc import Iterator
from string import ascii_lowercase
from typing import NamedTuple

import numpy as np

from rrru.arrays import FloatArray
from rrru.effects.protocol import Contribution, Effect, Motion, plain_coordinates
from rrru.effects.thermal_growth import SHAPES, TIME_CONSTANT, growth_twists, warm_up_fraction
from rrru.kinematics.legs import Leg, Legs
from rrru.kinematics.robot import Robot
from rrru.parameters import Parameter, ParameterSet

_TYPICAL, _MOST, _SOURCE = 2e-4, 1e-2, "aluminium 2.3e-5 per kelvin; temperature assumed"
_LINK, _ARM, _ROD = "", "arm_", "rod_"


class _Link(NamedTuple):
    """A link: number of its drive from 1 on, its kind (_LINK of an arm, _ARM or _ROD) and for rods that of its leg."""

    drive: int
    kind: str
    leg: int = 0


def for_robot(robot: Robot) -> Effect | None:
    """The effect model for an arm with two links or more behind drives of their own, and for a parallel robot.

    None for others.
    """
    named = _names(_links(robot.legs))
    if len({link.drive for link in named}) < 2:
        return None
    parameters = ParameterSet(
        (*(Parameter(name, "1", 0.0, 0.0, _MOST, _SOURCE, link.drive) for link, name in named.items()), TIME_CONSTANT)
    )

    def grown(motion: Motion, values: FloatArray) -> Contribution:
        """Shifts of the links' ends by their growth under the strains and the time constant in s."""
        *strains, time_constant = values
        # the measured robot may have more sites, those of reflectors
        links = _links(motion.robot.legs)
        longer = sum(strain * links[link] for link, strain in zip(named, strains, strict=True))
        return Contribution(np.multiply.outer(warm_up_fraction(motion, time_constant), longer))

    return Effect("link_growth", parameters, plain_coordinates(parameters, _TYPICAL, SHAPES), grown, ("time_s",))


def _names(links: dict[_Link, FloatArray]) -> dict[_Link, str]:
    """Names of the links' strains, drive by drive; rods side by side have a letter."""
    result = {}
    for link in sorted(links):
        same = [other for other in links if other[:2] == link[:2]]
        letter = f"{ascii_lowercase[sorted(same).index(link)]}_" if len(same) > 1 else ""
        result[link] = f"{link.kind}{letter}strain{link.drive}"
    return result


def _links(legs: Legs) -> dict[_Link, FloatArray]:
    """Twists (sites, 6) that make all lengths of a link longer by their own size, by link; of other robots none."""
    every = growth_twists(legs)
    result: dict[_Link, FloatArray] = {}
    for number, leg in enumerate(legs.legs if _has_links(legs) else ()):
        parts = _arm_links(legs, leg) if len(legs.legs) == 1 else _leg_links(legs, leg, number)
        for name, link in parts:
            site = legs.site_numbers[name]
            if every[site].any():
                result.setdefault(link, np.zeros_like(every))[site] = every[site]
    return result


def _has_links(legs: Legs) -> bool:
    """Whether a robot is an arm or holds one platform by several legs."""
    return bool(legs.arm_joints) if len(legs.legs) == 1 else not legs.end_effectors


def _arm_links(legs: Legs, leg: Leg) -> Iterator[tuple[str, _Link]]:
    """Sites of an arm's lengths behind its first drive, each with its link."""
    drive = None
    for joint in leg.joints:
        if drive is not None:
            yield joint.name, _Link(drive + 1, _LINK)
        # driven values of joints that follow drives come after those of the drives
        if joint.drive is not None and joint.drive < len(legs.home_drives):
            drive = joint.drive


def _leg_links(legs: Legs, leg: Leg, number: int) -> Iterator[tuple[str, _Link]]:
    """Sites of a leg's lengths between its first moving joint and the platform, each with its link.

    number: of the leg.
    """
    own = [joint.drive for joint in leg.joints if joint.drive is not None and joint.drive < len(legs.home_drives)]
    moving = [k for k, joint in enumerate(leg.joints) if joint.kind != "fixed"]
    if not own or not moving:
        return
    passive = False
    for k, joint in enumerate(leg.joints):
        if moving[0] < k and (leg.bar or k <= moving[-1]):
            yield joint.name, _Link(own[0] + 1, _ROD, number) if passive else _Link(own[0] + 1, _ARM)
        passive = passive or joint.passive
    if leg.bar and leg.bar.drive is None:
        yield leg.bar_sites[0], _Link(own[0] + 1, _ROD, number)
