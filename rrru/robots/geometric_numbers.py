"""The geometric numbers of any robot, and which of them positions can tell apart. Lengths in mm, angles in rad."""

from dataclasses import dataclass

import numpy as np

from rrru.robots.legs import TOOL, WORLD, unit_twist

_AXES = ("x", "y", "z", "rx", "ry", "rz")


@dataclass(frozen=True)
class Candidate:
    """A geometric number: its name, unit ("mm", "rad"), number of its drive (0: none), and twists (6,) by site."""

    name: str
    unit: str
    leg: int
    twists: dict


def candidates_of(legs, parts):
    """All Candidates of Legs, drives first, then lengths along links, other shifts, angles, tool and world."""
    drives = [
        Candidate(f"d{drive.column.rpartition('_')[0]}", drive.unit, number, {drive.site: drive.twist})
        for number, drive in enumerate(parts.drives, 1)
    ]
    taken = {(drive.site, int(np.abs(drive.twist).argmax())) for drive in parts.drives}
    lengths, shifts, turns = [], [], []
    for joint in legs.joints:
        if joint.kind == "fixed" and not np.any(joint.shift_mm) and np.array_equal(joint.turn, np.eye(3)):
            continue
        along = int(np.abs(joint.turn.T @ joint.shift_mm).argmax()) if np.any(joint.shift_mm) else None
        for k in range(3):
            (lengths if k == along else shifts).append((joint.name, k))
            turns.append((joint.name, k + 3))
    for leg in legs.legs:
        if leg.bar:
            bar, end = leg.bar_sites
            lengths.append((bar, 0))
            shifts += [(end, k) for k in range(3)]
    own = [(TOOL, k) for k in range(3)] + [(WORLD, k) for k in range(6)]
    return (*drives, *(_at(*place) for place in (*lengths, *shifts, *turns, *own) if place not in taken))


def _at(site, component):
    """The Candidate of one component of a site's twist."""
    name = f"{site.replace(' ', '_')}_{_AXES[component]}"
    return Candidate(name, "mm" if component < 3 else "rad", 0, {site: unit_twist(component)})


def direction(legs, candidate):
    """The twists (sites, 6) of a unit of a Candidate."""
    result = np.zeros((len(legs.sites), 6))
    for site, twist in candidate.twists.items():
        result[legs.site_numbers[site]] += twist
    return result


def choose(columns, allowed, least):
    """Numbers of the columns (m, c) that those chosen before them leave more than the share `least` of.

    allowed (c,): which may be chosen. With {number: combination (k,) of the chosen before it} of the others.
    """
    basis, chosen, stands = np.zeros((len(columns), 0)), [], {}
    for number, column in enumerate(columns.T):
        left = column - basis @ (basis.T @ column)
        left -= basis @ (basis.T @ left)
        size = np.linalg.norm(column)
        if allowed[number] and size > least and np.linalg.norm(left) > least * size:
            basis = np.column_stack([basis, left / np.linalg.norm(left)])
            chosen.append(number)
        else:
            stands[number] = np.linalg.lstsq(columns[:, chosen], column, rcond=None)[0]
    return chosen, stands
