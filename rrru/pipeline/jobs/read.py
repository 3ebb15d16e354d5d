"""One campaign: driven by a virtual robot or read from a file."""

from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd

from rrru.calibration.campaign_noise import campaign_noise
from rrru.campaign.schemas import TABLES, measurement_table
from rrru.pipeline import campaigns, setup
from rrru.store import tables
from rrru.store.job import tell


def main(settings: Mapping[str, Any], inputs: Mapping[str, str], outputs: Mapping[str, str]) -> None:
    """Write measurements, truth (empty for a file), singularity measures, workspace slices and the campaign's row."""
    advice = [tables.read(inputs[key]) for key in ("next_runs", "next_poses") if inputs.get(key)]
    frames = read(settings, advice)
    if notes := frames["campaigns"]["notes"].iloc[0]:
        tell(f"campaign {settings['campaign']}: {notes}")
    write(settings, frames, outputs)


def read(settings: Mapping[str, Any], advice: Sequence[pd.DataFrame] = ()) -> dict[str, pd.DataFrame]:
    """Frames by table name of a campaign.

    advice: tables `gap_next_runs` and `gap_next_poses` that a virtual campaign follows, or nothing. Raises IngestError
    for a refused file and ConfigError for settings that do not fit together.
    """
    name, section, nominal = settings["campaign"], settings["section"], settings["nominal"]
    robot = setup.mechanism(nominal)
    if settings["virtual"]:
        measurements, truth = setup.virtual_campaign(nominal, settings["virtual"], advice or None).run()
        notes, registration = campaigns.unadvised(advice), None
    else:
        # a large import that virtual campaigns do not need
        from rrru.campaign.ingest.campaign_file import ingest
        from rrru.campaign.ingest.spec import IngestSpec

        ingested = ingest(IngestSpec.from_config(section), robot)
        measurements, truth = ingested.measurements, pd.DataFrame(columns=_columns("truth"))
        notes, registration = ingested.notes, ingested.registration
    measurements, singular = campaigns.with_singularities(robot, measurements, settings["singularity_margin"])
    given = section.get("noise_mm"), section.get("noise_rad")
    known = setup.measured_robot(nominal, measurements)
    noise = campaign_noise(known, measurements, given, settings["use_near_singularity"])
    notes = (*notes, *campaigns.unmatched_sets(settings["sets"], measurements))
    row = campaigns.campaign_row(robot, section, measurements, singular, noise, notes, registration)
    return {
        "measurements": measurements,
        "truth": truth[_columns("truth")],
        "singularity": singular.assign(campaign=name),
        "workspace": campaigns.workspace_table(robot, measurements).assign(campaign=name),
        "campaigns": pd.DataFrame([row]).assign(campaign=name),
        "registration": campaigns.registration_table(registration).assign(campaign=name),
    }


def write(settings: Mapping[str, Any], frames: Mapping[str, pd.DataFrame], paths: Mapping[str, str]) -> None:
    """Write the frames of `read` to paths by table name."""
    measurements = frames["measurements"]
    table = measurement_table(setup.mechanism(settings["nominal"]), measurements.columns)
    tables.write_all((*TABLES, table), frames, paths)


def _columns(name: str) -> list[str]:
    """The columns of a campaign's table."""
    return next(table.names for table in TABLES if table.name == name)
