"""What columns and settings of a file may mean: proposals for the user to accept, which ingest itself never makes."""

import re
from datetime import datetime
from difflib import SequenceMatcher

from rrru.campaign.ingest.cells import decode, separator_of
from rrru.campaign.ingest.clock import tells_clock
from rrru.campaign.ingest.columns import known_columns

_LEAST_ALIKE = 0.8
# words that other programs use, by what our names have; {} is the axis
_WORDS = {
    "measured_{}_mm": ("measured {}", "measurement {}", "meas {}", "actual {}", "{} measured", "{} actual", "{}"),
    "command_{}_mm": (
        "command {}",
        "cmd {}",
        "commanded {}",
        "goal {}",
        "nominal {}",
        "nom {}",
        "set {}",
        "{} nominal",
    ),
    "noise_{}_mm": ("noise {}", "measurement std {}", "std {}", "sigma {}", "{} std"),
}
_NAMED = {
    "trajectory": ("trajectory", "path", "line", "program", "group"),
    "run": ("run", "pass", "cycle"),
    "point": ("point", "index", "number"),
    "name": ("name", "point name", "point id"),
    "time_s": ("time", "timestamp", "time stamp", "date time", "t"),
    "speed_mm_s": ("speed", "velocity", "feed"),
    "payload_kg": ("payload", "load"),
    "temperature_c": ("temperature", "temp", "measurement temperature"),
    "target": ("target", "reflector", "marker"),
}
_CLOCKS = (
    *("%d.%m.%Y %H:%M:%S", "%m/%d/%Y %H:%M:%S", "%d/%m/%Y %H:%M:%S", "%m/%d/%Y %I:%M:%S %p", "%Y/%m/%d %H:%M:%S"),
    *("%d.%m.%Y %H:%M", "%H:%M:%S"),
)
_AXIS = re.compile(r"x\b.*\[|\[.*mm|u\(95\)", re.IGNORECASE)


def guess_format(path, problems):
    """The `format` of a text file that is no plain CSV, None for all others."""
    if path.suffix.lower() in (".parquet", ".xlsx"):
        return None
    text = decode(path.read_bytes(), problems, others=("utf-16", "cp1252"))
    lines = [line for line in text.splitlines() if line.strip()]
    if any(line.startswith("//") for line in lines):
        return "spatial_analyzer"
    head = lines[0]
    separator = separator_of([head]) if ";" in head or "\t" in head else separator_of([head.replace("|", "")])
    stated = {"separator": separator} if separator != "," else {}
    if stated and re.search(r"\d,\d", "".join(lines[1:20])):
        stated["decimal"] = ","
    leica = sum(bool(_AXIS.search(name)) for name in head.split(separator)) >= 3
    kind = "leica" if leica else "csv"
    if kind == "csv" and not stated:
        return None if path.suffix.lower() == ".csv" else kind
    return {"kind": kind, **stated} if stated else kind


def guess_columns(cells, mechanism, given):
    """{our name: the file's} of columns whose names are not ours but look like it; given: what is declared already."""
    ours = [name for name in known_columns(mechanism) if name not in given]
    taken = {*given.values(), *cells.means.values(), *cells.unused, *ours}
    free = [name for name in cells.names if name and name not in taken]
    open_names = [name for name in ours if name not in cells.names and name not in cells.means]
    pairs = [(_alike(one, theirs), one, theirs) for one in open_names for theirs in free]
    found = {}
    for likeness, one, theirs in sorted(pairs, key=lambda pair: -pair[0]):
        if likeness >= _LEAST_ALIKE and one not in found and theirs not in found.values():
            found[one] = theirs
    return found


def guess_clock(cells, theirs):
    """The `time_format` of a column of times of day that are not ISO 8601, None where it needs none.

    Of several that fit the one of the shortest campaign whose times never run backwards.
    """
    texts = [cell for cell in cells.cells.get(theirs, ()) if isinstance(cell, str) and cell.strip()]
    if not texts or not tells_clock(texts, None) or all(_reads(text, None) for text in texts[:20]):
        return None
    fitting = []
    for pattern in (f"{one}{fraction}" for one in _CLOCKS for fraction in ("", ".%f", ",%f")):
        times = [_reads(text, pattern) for text in texts]
        if all(times) and sorted(times) == times:
            fitting.append((times[-1] - times[0], pattern))
    return min(fitting)[1] if fitting else None


def _reads(text, pattern):
    """A text as a time, None where it is none."""
    try:
        return datetime.strptime(text.strip(), pattern) if pattern else datetime.fromisoformat(text.strip())
    except ValueError:
        return None


def _alike(ours, theirs):
    """How much a file's name looks like one of ours, 0 to 1."""
    return max(
        SequenceMatcher(None, _plain(word), _plain(theirs)).ratio() if _axis(word) == _axis(theirs) else 0.0
        for word in _words(ours)
    )


def _words(ours):
    """Words for one of our names, its own first."""
    for pattern, words in _WORDS.items():
        for axis in "xyz":
            if ours == pattern.format(axis):
                return (ours, *(word.format(axis) for word in words))
    return (ours, *_NAMED.get(ours, ()))


def _plain(name):
    """A name in small letters without units and signs."""
    bare = re.sub(r"[\[(][^\])]*[\])]", " ", name.lower())
    bare = re.sub(r"_(mm|m|s|rad|deg|kg|c|mm_s)$", "", bare.strip())
    return " ".join(re.sub(r"[^a-z0-9]+", " ", bare).split())


def _axis(name):
    """What a name counts or which axis it is of: names of other axes or joints are never alike."""
    words = _plain(name).split()
    axis = [word for word in words if word in ("x", "y", "z", "rx", "ry", "rz", "qx", "qy", "qz", "qw")]
    return axis, re.findall(r"\d+", " ".join(words))
