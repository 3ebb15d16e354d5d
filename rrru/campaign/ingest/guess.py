"""Proposals of columns and settings for a file, for the user to accept; ingest itself never makes any."""

import re
from collections.abc import Iterable, Mapping, Sequence
from difflib import SequenceMatcher, get_close_matches
from pathlib import Path

from rrru.campaign.ingest.cells import Cell, Cells, decode, separator_of
from rrru.campaign.ingest.clock import is_clock, parsed
from rrru.campaign.ingest.columns import known_columns
from rrru.campaign.ingest.problems import Problems
from rrru.campaign.ingest.sheet import COMMAND, MEASURED
from rrru.campaign.ingest.spec import MM
from rrru.campaign.ingest.trackers import HEADER_LINES, LENGTHS, names_axes, unit_of
from rrru.kinematics.legs import Drive
from rrru.kinematics.robot import Robot

_LEAST_ALIKE = 0.8
# words that other programs use, by what our names have; {} is the axis
_WORDS = {
    "measured_{}_mm": (
        *("measured {}", "measurement {}", "meas {}", "actual {}", "{} measured", "{} actual", "{}"),
        *("ist {}", "{} ist", "gemessen {}", "messwert {}"),
    ),
    "command_{}_mm": (
        "command {}",
        "cmd {}",
        "commanded {}",
        "goal {}",
        "nominal {}",
        "nom {}",
        "set {}",
        "{} nominal",
        "soll {}",
        "{} soll",
    ),
    "noise_{}_mm": ("noise {}", "measurement std {}", "std {}", "sigma {}", "{} std"),
}
_NAMED = {
    "trajectory": ("trajectory", "path", "line", "program", "group", "bahn", "gruppe", "programm"),
    "run": ("run", "pass", "cycle", "lauf", "durchgang"),
    "point": ("point", "index", "number", "punkt", "nummer", "nr"),
    "name": ("name", "point", "point name", "point id", "punkt", "punktname"),
    "time_s": ("time", "timestamp", "time stamp", "date time", "t", "zeit", "zeitstempel", "uhrzeit"),
    "speed_mm_s": ("speed", "velocity", "v", "feed", "geschwindigkeit", "vorschub"),
    "payload_kg": ("payload", "load", "last", "nutzlast"),
    "temperature_c": ("temperature", "temp", "measurement temperature", "temperatur"),
    "target": ("target", "reflector", "marker", "reflektor", "ziel", "marke"),
}
# words before or after an axis in exports of laser trackers, total stations, photogrammetry and CMMs
_INSTRUMENTS = (
    *("smr", "reflector", "retroreflector", "rrr", "prism", "ball", "probe", "marker", "sphere", "reflektor", "prisma"),
    *("lt", "lasertracker", "laser tracker", "tracker", "at", "leica", "faro", "radian", "vantage", "ts", "cmm"),
    *("meas", "measured", "measurement", "act", "actual", "observed", "obs", "ist", "gemessen", "messwert"),
)
# axes of geodesy
_GEODETIC = {"e": "x", "n": "y", "h": "z", "east": "x", "north": "y", "height": "z", "easting": "x", "northing": "y"}
# names of drives that are only numbered
_DRIVES = ("q", "j", "a", "l", "joint", "axis", "achse", "theta", "motor", "leg", "gelenk")
# columns of whole numbers, which similar names of text columns must not match
_COUNTS = ("run", "point")
_CLOCKS = (
    *("%d.%m.%Y %H:%M:%S", "%m/%d/%Y %H:%M:%S", "%d/%m/%Y %H:%M:%S", "%m/%d/%Y %I:%M:%S %p", "%Y/%m/%d %H:%M:%S"),
    *("%d.%m.%Y %H:%M", "%H:%M:%S"),
)
_LENGTH_UNITS = {factor: unit for unit, factor in MM.items()}
_ANGLE_UNITS = {"rad": "rad", "deg": "deg", "degree": "deg", "degrees": "deg", "°": "deg"}
# what stands before a name's first number, the number, and what stands behind it
_NUMBERED = re.compile(r"^([^\d]*)(\d*)(.*)$")
_LAST = re.compile(r"[_ ]([a-z°]+)$")


def names_trajectories(names: Iterable[str]) -> bool:
    """Whether one of a file's columns may hold the names of trajectories, under whatever heading."""
    words = [re.sub(r"[\W_]+", " ", name.casefold()).strip() for name in names]
    return any(word in _NAMED["trajectory"] or get_close_matches(word, ["trajectory"], cutoff=0.7) for word in words)


def guess_format(path: Path, problems: Problems) -> str | dict[str, str] | None:
    """The `format` of a text file that is no plain CSV, None for all others."""
    if path.suffix.lower() in (".parquet", ".xlsx"):
        return None
    text = decode(path.read_bytes(), problems, others=("utf-16", "cp1252"))
    lines = [line for line in text.splitlines() if line.strip()]
    if any(line.startswith("//") for line in lines):
        return "spatial_analyzer"
    at = next((i for i, line in enumerate(lines[:HEADER_LINES]) if names_axes(_fields(line))), 0)
    head = lines[at]
    separator = _separator(head)
    stated = {"separator": separator} if separator != "," else {}
    if stated and re.search(r"\d,\d", "".join(lines[at + 1 : at + 20])):
        stated["decimal"] = ","
    # lines above the names of the axes, or units next to them
    names = _fields(head)
    leica = names_axes(names) and (at > 0 or any(unit_of(name) for name in names))
    kind = "leica" if leica else "csv"
    if kind == "csv" and not stated:
        return None if path.suffix.lower() == ".csv" else kind
    return {"kind": kind, **stated} if stated else kind


def guess_units(cells: Cells, found: Mapping[str, str], mechanism: Robot) -> dict[str, str]:
    """{unit: .., angle_unit: ..} as the names of a file's columns say, {our name: the file's}; without what none says.

    Columns whose unit the format knows, and units of which there are several, are left out.
    """
    stated: dict[str, set[str | None]] = {"unit": set(), "angle_unit": set()}
    for ours, theirs in found.items():
        if ours in (*COMMAND, *MEASURED) and theirs not in cells.factors:
            stated["unit"].add(_LENGTH_UNITS.get(LENGTHS.get(_stated(theirs), 0.0)))
        elif ours in mechanism.parts.columns:
            stated["angle_unit"].add(_ANGLE_UNITS.get(_stated(theirs)))
    known = {key: [unit for unit in units if unit] for key, units in stated.items()}
    return {key: units[0] for key, units in known.items() if len(units) == 1}


def _stated(name: str) -> str:
    """The unit that a column's name ends in, in brackets or after a space or underscore, "" where it has none."""
    last = _LAST.search(name.lower())
    return unit_of(name) or (last[1] if last else "")


def _separator(line: str) -> str:
    """The separator of the fields of a line; bars occur in names, too."""
    return separator_of([line]) if ";" in line or "\t" in line else separator_of([line.replace("|", "")])


def _fields(line: str) -> list[str]:
    """Fields of a line."""
    return [field.strip().strip('"') for field in line.split(_separator(line))]


def guess_columns(cells: Cells, mechanism: Robot, given: Mapping[str, str]) -> dict[str, str]:
    """{our name: the file's} of columns whose names are not ours but look like it; given: what is declared already."""
    ours = [name for name in known_columns(mechanism) if name not in given]
    taken = {*given.values(), *cells.means.values(), *cells.unused, *ours}
    free = [name for name in cells.names if name and name not in taken]
    open_names = [name for name in ours if name not in cells.names and name not in cells.means]
    pairs = [(_alike(one, theirs), one, theirs) for one in open_names for theirs in free]
    pairs = [pair for pair in pairs if pair[1] not in _COUNTS or _is_count(cells.cells[pair[2]][0])]
    if _measured_by_an_instrument(free):
        # X, Y, Z next to an instrument's columns are the slides of a machine that names them so
        drives = {_plain(column) for column in mechanism.parts.columns}
        pairs = [pair for pair in pairs if pair[1] not in MEASURED or _plain(pair[2]) not in drives]
    found: dict[str, str] = {}
    for likeness, one, theirs in sorted(pairs, key=lambda pair: -pair[0]):
        if likeness >= _LEAST_ALIKE and one not in found and theirs not in found.values():
            found[one] = theirs
    if not {*MEASURED} & {*given, *found, *cells.means, *cells.names}:
        found |= _measured_by_an_instrument([name for name in free if name not in found.values()])
    return found | _numbered(mechanism.parts.drives, found, [name for name in free if name not in found.values()])


def axis_triples(names: Iterable[str]) -> list[dict[str, str]]:
    """[{x: .., y: .., z: ..}] of columns whose names differ in the axis alone, of whatever they are."""
    triples: dict[tuple[str, int], dict[str, str]] = {}
    for name in names:
        for place, stem, axis in _axes_in(name)[:1]:
            triples.setdefault((stem, place), {}).setdefault(axis, name)
    return [axes for axes in triples.values() if set(axes) == set("xyz")]


def _measured_by_an_instrument(free: Iterable[str]) -> dict[str, str]:
    """{our name: the file's column} of the one triple of free columns that an instrument may have measured.

    None where several triples may be meant, as of two reflectors in one row: the user has to say which.
    """
    triples: dict[str, dict[str, str]] = {}
    for name in free:
        word, axis = _instrument_axis(name)
        if axis:
            triples.setdefault(word, {}).setdefault(axis, name)
    whole = [axes for axes in triples.values() if set(axes) == set("xyz")]
    return {f"measured_{axis}_mm": whole[0][axis] for axis in "xyz"} if len(whole) == 1 else {}


def _instrument_axis(name: str) -> tuple[str, str]:
    """The words of an instrument or of its reflector in a column's name, and its axis; "" and "" for other names."""
    found = _axes_in(name)
    return next(((stem, axis) for _, stem, axis in found if re.sub(r"\d+", "", stem).strip() in _INSTRUMENTS), ("", ""))


def _axes_in(name: str) -> list[tuple[int, str, str]]:
    """[(place, other words, axis)] of an axis as the last (place -1) or the first (0) word of a column's name."""
    words = _plain(name).split()
    ends = ((place, words[:-1] if place else words[1:], words[place]) for place in (-1, 0) if words)
    found = [(place, " ".join(stem), _GEODETIC.get(word, word)) for place, stem, word in ends]
    return [one for one in found if one[2] in ("x", "y", "z")]


def _numbered(drives: Sequence[Drive], found: Mapping[str, str], free: Iterable[str]) -> dict[str, str]:
    """{drive: the file's column} where as many free columns as there are drives are numbered alike: q1, q2, ..

    None where a drive has its column already, a column states a unit of another kind, or two kinds are numbered so.
    """
    ours, wrong_units = [drive.column for drive in drives], LENGTHS if drives[0].unit == "rad" else _ANGLE_UNITS
    kinds: dict[tuple[str, str], dict[int, str]] = {}
    for name in free:
        word, digits, ending = _NUMBERED.findall(_plain(name))[0]
        if digits and word.strip() in _DRIVES and _stated(name) not in wrong_units:
            kinds.setdefault((word, ending), {})[int(digits)] = name
    counted = [names for names in kinds.values() if len(names) == len(ours) == max(names) - min(names) + 1]
    if len(counted) != 1 or set(ours) & set(found):
        return {}
    return dict(zip(ours, (counted[0][number] for number in sorted(counted[0])), strict=True))


def _is_count(cell: Cell) -> bool:
    """Whether a cell holds a whole number from 1 on."""
    try:
        number = float(str(cell))
    except ValueError:
        return False
    return number >= 1.0 and number.is_integer()


def guess_clock(cells: Cells, theirs: str) -> str | None:
    """The `time_format` of a column of times of day that are not ISO 8601, None where it needs none.

    Of several that fit the one of the shortest campaign whose times never run backwards.
    """
    texts = [cell for cell in cells.cells.get(theirs, ()) if isinstance(cell, str) and cell.strip()]
    if not texts or not is_clock(texts, None) or all(parsed(text, None) for text in texts[:20]):
        return None
    fitting = []
    for pattern in (f"{one}{fraction}" for one in _CLOCKS for fraction in ("", ".%f", ",%f")):
        times = [time for time in (parsed(text, pattern) for text in texts) if time is not None]
        if len(times) == len(texts) and sorted(times) == times:
            fitting.append((times[-1] - times[0], pattern))
    return min(fitting)[1] if fitting else None


def _alike(ours: str, theirs: str) -> float:
    """Similarity of a file's column name to one of ours, 0 to 1."""
    return max(
        SequenceMatcher(None, _plain(word), _plain(theirs)).ratio() if _axis(word) == _axis(theirs) else 0.0
        for word in _words(ours)
    )


def _words(ours: str) -> tuple[str, ...]:
    """Words for one of our names, its own first."""
    for pattern, words in _WORDS.items():
        for axis in "xyz":
            if ours == pattern.format(axis):
                return (ours, *(word.format(axis) for word in words))
    return (ours, *_NAMED.get(ours, ()))


def _plain(name: str) -> str:
    """A name in small letters without units and signs."""
    bare = re.sub(r"[\[(][^\])]*[\])]", " ", name.lower())
    bare = re.sub(r"(_(mm|m|s|rad|deg|kg|c|mm_s)| (mm|deg|rad|kg))$", "", bare.strip())
    return " ".join(re.sub(r"[^a-z0-9]+", " ", bare).split())


def _axis(name: str) -> tuple[list[str], list[str]]:
    """What a name counts or which axis it is of: names of other axes or joints are never alike."""
    words = _plain(name).split()
    axis = [word for word in words if word in ("x", "y", "z", "rx", "ry", "rz", "qx", "qy", "qz", "qw")]
    return axis, re.findall(r"\d+", " ".join(words))
