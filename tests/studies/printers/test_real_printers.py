"""Twenty further real printers, read from the folder that RRRU_REAL_DATA names; skipped where it is not there."""

import os
from pathlib import Path

import numpy as np
import pytest

from rrru.studies.printers import files, printer_tables
from tests.studies.printers.simulated_printers import SETTINGS

FOLDER = Path(os.environ.get("RRRU_REAL_DATA", "nowhere")) / "klipper"
pytestmark = pytest.mark.skipif(not FOLDER.is_dir(), reason="RRRU_REAL_DATA names no folder with klipper/")

# read off the history of the same files by those who collected them
OFFSETS = {"sabtech_01": "-0.460", "smileyman_01": "+0.085", "leifbladt_01": "-0.040", "arglurgl_04": "+0.100"}


def test_what_is_known_of_them_is_said():
    frame = printer_tables.tables(files.read(FOLDER / "measurements.json"), SETTINGS)["printers"].set_index("printer")
    foreign = frame[frame["verdict"] == "does not belong"]
    assert set(foreign.index) == {*OFFSETS, "jjsimp_01"} and (frame["verdict"] != "not fitted").all()
    for name, size in OFFSETS.items():
        assert "Z offset" in foreign.loc[name, "reason"] and f"differ by {size} mm" in foreign.loc[name, "reason"]
    assert foreign["reason"].str.contains("steps 2 times").sum() == 1
    assert "215.000 mm instead of 214.500 mm: arm_b" in foreign.loc["jjsimp_01", "reason"]
    suspects = frame.loc[frame["suspect"] != "", "suspect"].to_dict()
    assert suspects == {"aieie_05": "distance 12", "dothebart_02": "distance 12"}


def test_raw_files_are_the_printers_of_the_list():
    known = {printer.name: printer for printer in files.read(FOLDER / "measurements.json")}
    raw = sorted((FOLDER / "raw").glob("*.cfg"))
    assert raw
    for path in raw:
        (printer,) = files.read(path)
        for field in ("radius_mm", "angle_deg", "arm_mm", "endstop_mm", "height_drop_mm", "distance_drop_mm"):
            np.testing.assert_allclose(getattr(printer, field), getattr(known[printer.name], field), rtol=1e-12)
