"""The geometric parameters of any robot, and which of them are identifiable (base parameters). mm, rad."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rrru.arrays import BoolArray, FloatArray
from rrru.kinematics.legs import TOOL, WORLD, Legs, Parts, unit_twist
from rrru.parameters import Parameter, ParameterSet

# largest error of a drive's lost zero offset, in rad and in mm
_LOST = {"rad": 0.6, "mm": 100.0}
# share of a parameter's column of a campaign's readings that must be independent of the other columns. Of an error of a
# millimetre, as parts and frames have, the others leave five micrometres at most. With 0.002 the hardly determined
# parameters of a hexapod had twice the stated errors
LEFT_OF_DATA = 5e-3
# largest coefficient of a chosen column in the combination of one that is not chosen, both of one length; assumed
_MOST_OF_ANOTHER = 2.0
_AXES = ("x", "y", "z", "rx", "ry", "rz")


@dataclass(frozen=True)
class Candidate:
    """A geometric parameter.

    name, unit ("mm", "rad"); leg: number of its drive, 0 for none; twists: by site the (6,) of a unit; late: whether it
    represents only what no other parameter does.
    """

    name: str
    unit: str
    leg: int
    twists: dict[str, FloatArray]
    late: bool = False

    @property
    def rank(self) -> int:
        """Its rank among the parameters that may replace each other: drives first, late ones last."""
        return 0 if self.leg else 1 + self.late


@dataclass(frozen=True)
class MeasurementConfig:
    """The measurement configuration of a campaign: what is measured, and what is unknown about it.

    reflectors: names of the sites of the reflectors that were read, none where the tool was; fitted: those of them
    whose place on the tool is not known; turned: whether orientations were read; frame: whether the pose of the
    instrument's frame, and where orientations were read that of the tool, is known only roughly.
    """

    reflectors: tuple[str, ...] = ()
    fitted: tuple[str, ...] = ()
    turned: bool = False
    frame: bool = False


def open_numbers(config: MeasurementConfig) -> tuple[Candidate, ...]:
    """Candidates of a MeasurementConfig: places of reflectors, the tool's pose with orientations, the frame."""
    first = 3 if config.fitted else 0
    tool = range(first, 6) if config.turned and config.frame else ()
    places = [(name, k) for name in config.fitted for k in range(3)] + [(TOOL, k) for k in tool]
    return tuple(_at(*place) for place in places + [(WORLD, k) for k in range(6) if config.frame])


def candidates_of(legs: Legs, parts: Parts, config: MeasurementConfig | None = None) -> tuple[Candidate, ...]:
    """All Candidates of Legs, drives first, then lengths along links, other shifts, angles, tool and world.

    Those of the MeasurementConfig come before the others of tool and world, which are late. Where places of reflectors
    are unknown what does the same as an error of them all is late, too: nothing is known about a place, and a tool on
    its flange is off by less than a place that the nominal robot's poses give.
    """
    config = config or MeasurementConfig()
    drives = [
        Candidate(f"d{drive.column.rpartition('_')[0]}", drive.unit, number, drive.twists)
        for number, drive in enumerate(parts.drives, 1)
    ]
    taken = {(drive.site, int(np.abs(drive.twist).argmax())) for drive in parts.drives}
    lengths: list[tuple[str, int]] = []
    shifts: list[tuple[str, int]] = []
    turns: list[tuple[str, int]] = []
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
    # with several end effectors the last frame of each is its tool
    tool = () if legs.end_effectors else range(6 if config.turned or config.reflectors else 3)
    outside = [(TOOL, k) for k in tool] + [(WORLD, k) for k in range(6)]
    numbers = [_at(*place) for place in (*lengths, *shifts, *turns) if place not in taken]
    every = [*drives, *numbers]
    carries = _carry_the_tool(legs, every) if config.fitted else [False] * len(every)
    others, last = ([one for one, carry in zip(every, carries, strict=True) if carry is late] for late in (False, True))
    late = [replace(one, late=True) for one in (*last, *(_at(*place) for place in outside))]
    # the first of a name: of tool and world those of the configuration
    result: dict[str, Candidate] = {}
    for one in (*others, *open_numbers(config), *late):
        result.setdefault(one.name, one)
    return tuple(result.values())


def _carry_the_tool(legs: Legs, candidates: Sequence[Candidate]) -> list[bool]:
    """Whether Candidates move the tool of an arm on its last link: frames behind its last moving joint, and this
    joint's errors along and about its own axis.
    """
    if not legs.arm_joints:
        return [False] * len(candidates)
    behind: set[str] = set()
    own = {}
    for leg in legs.legs:
        moving = max(number for number, joint in enumerate(leg.joints) if joint.kind != "fixed")
        behind |= {joint.name for joint in leg.joints[moving + 1 :]}
        own[leg.joints[moving].name] = np.tile(leg.joints[moving].axis, 2)

    def carries(one: Candidate) -> bool:
        return all(
            site in behind or (site in own and np.allclose(np.abs(twist @ own[site]), np.linalg.norm(twist)))
            for site, twist in one.twists.items()
        )

    return [carries(one) for one in candidates]


def _at(site: str, component: int) -> Candidate:
    """The Candidate of one component of a site's twist."""
    name = f"{site.replace(' ', '_')}_{_AXES[component]}"
    return Candidate(name, "mm" if component < 3 else "rad", 0, {site: unit_twist(component)})


def bounded(candidates: Sequence[Candidate], limits: Mapping[str, float]) -> ParameterSet:
    """The ParameterSet of Candidates, nominally zero, bounded by their unit's limit, drives by a lost zero offset."""
    most = (max(limits[one.unit], _LOST[one.unit] if one.leg else 0.0) for one in candidates)
    return ParameterSet(
        tuple(
            Parameter(one.name, one.unit, 0.0, -high, high, "bounds assumed", one.leg)
            for one, high in zip(candidates, most, strict=True)
        )
    )


def stages(candidates: Sequence[Candidate], outside: set[str]) -> tuple[BoolArray, BoolArray]:
    """Which Candidates (p,) are of sites outside the robot, such as the frame, and which are these or drives."""
    frames = np.array([outside.issuperset(one.twists) for one in candidates])
    return frames, frames | np.array([one.leg > 0 for one in candidates])


def direction(legs: Legs, candidate: Candidate) -> FloatArray:
    """The twists (sites, 6) of a unit of a Candidate."""
    result = np.zeros((len(legs.sites), 6))
    for site, twist in candidate.twists.items():
        result[legs.site_numbers[site]] += twist
    return result


def candidate_components(legs: Legs, candidates: Sequence[Candidate]) -> BoolArray:
    """Which components (sites, 6) of twists Candidates represent."""
    return np.asarray(np.any([direction(legs, one).astype(bool) for one in candidates], axis=0))


def column_scale(candidates: Sequence[Candidate], characteristic_length_mm: float) -> FloatArray:
    """Factors (c,) that make columns of Candidates comparable: those of angles count at an arm in mm."""
    return np.array([1.0 if one.unit == "mm" else 1.0 / characteristic_length_mm for one in candidates])


def choose(
    columns: FloatArray,
    allowed: Sequence[bool],
    least: float,
    ranks: Sequence[int] = (),
    basis: FloatArray | None = None,
) -> tuple[list[int], dict[int, FloatArray]]:
    """Numbers of columns (m, c), in order, that represent all others except about the share `least` of each.

    Those are chosen of which more than that share is independent of the chosen ones before. Then one is exchanged for
    another in whose combination it has a coefficient above 2, both of one length. Two parameters that move the readings
    nearly alike would be many times as large as the errors that they represent, where they are not linear. This is the
    search for a large volume of Goreinov et al., How to find a good submatrix, in: Matrix Methods, World Scientific
    2010.
    allowed (c,): which may be chosen; ranks (c,): a column is exchanged for none of higher rank, all alike by default;
    basis (m, b): orthonormal columns that are chosen already. Returns also {number: combination (k,) of the chosen} of
    the columns that are not chosen.
    """
    start, chosen = np.zeros((len(columns), 0)) if basis is None else basis, []
    basis, size = start, np.linalg.norm(columns, axis=0)
    may, rank = np.asarray(allowed) & (size > least), np.asarray(ranks or np.zeros(len(size)))
    for number in np.flatnonzero(may).tolist():
        left = columns[:, number]
        for _ in range(2):
            left = left - basis @ (basis.T @ left)
        if np.linalg.norm(left) > least * size[number]:
            basis = np.column_stack([basis, left / np.linalg.norm(left)])
            chosen.append(number)
    left, size = columns - start @ (start.T @ columns), np.maximum(size, least)
    while True:
        others = [number for number in range(len(size)) if number not in chosen]
        combined = np.linalg.lstsq(left[:, chosen], left[:, others], rcond=None)[0]
        shares = np.abs(combined) * size[chosen][:, None] / size[others]
        shares[(rank[others] > rank[chosen][:, None]) | ~may[others]] = 0.0
        out, new = np.unravel_index(shares.argmax(), shares.shape) if shares.size else (0, 0)
        if not shares.size or shares[out, new] <= _MOST_OF_ANOTHER:
            return chosen, dict(zip(others, combined.T, strict=True))
        chosen = sorted([*chosen[:out], *chosen[out + 1 :], others[new]])


def in_words(combination: FloatArray, names: Sequence[str]) -> str:
    """A combination (k,) of the first k names, such as "0.71 base1_x - 0.2 dl1"; "nothing" where it is none."""
    terms = (f"{c:.3g} {name}" for c, name in zip(combination, names, strict=False) if abs(c) > 1e-6)
    return " + ".join(terms).replace("+ -", "- ") or "nothing"
