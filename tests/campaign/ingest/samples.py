"""The sample files of other programs' shapes and how they are declared."""

from tests.places import ROOT

FILES = ROOT / "tests" / "campaign" / "ingest" / "files"
_AXES = {
    f"{ours}_{axis}_mm": f"{theirs}{axis}"
    for ours, theirs in (("command", "Goal "), ("measured", "measurement_"), ("noise", "measurement_std_"))
    for axis in "xyz"
}
SAMPLES = {
    "leica": {"ingest": "leica.csv", "format": "leica", "commands": "commands.csv", "frame": "register"},
    "spatial_analyzer": {
        "ingest": "spatial_analyzer.txt",
        "format": "spatial_analyzer",
        "commands": "commands_by_group.csv",
        "frame": "register",
    },
    "decimal_comma": {
        "ingest": "decimal_comma.csv",
        "format": {"kind": "csv", "separator": ";", "decimal": ","},
        "columns": {"trajectory": "Path", "time_s": "Timestamp", "temperature_c": "measurement_temperature", **_AXES},
        "time_format": "%d.%m.%Y %H:%M:%S,%f",
    },
    "workbook": {"ingest": "workbook.xlsx"},
}


def section(name):
    """A sample's section of the configuration, with the files' whole paths."""
    given = SAMPLES[name]
    return given | {key: str(FILES / given[key]) for key in ("ingest", "commands") if key in given}
