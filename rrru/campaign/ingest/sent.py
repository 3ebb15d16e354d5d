"""Where the robot was sent, of files that hold its drive values alone. Lengths in mm."""

import numpy as np
from scipy.spatial.distance import pdist

from rrru.campaign import measurements as rows
from rrru.campaign.ingest.sheet import drive_name
from rrru.campaign.ingest.spec import MM, RAD

# distances that are off by this share belong to each other; a unit has to fit so much better than the one stated
_NEAR, _BETTER = 0.2, 0.25
# points that are enough to tell a unit, and the least
_PROBES, _LEAST = 200, 3


def sent_to(frame, spec, mechanism, problems):
    """Positions (n, 3) of the nominal robot at a file's drive values, NaN where one is noted.

    frame: columns of the file under our names, in mm and rad as spec reads them. Raises IngestError where the drive
    values are in another unit than spec says, or a row does not say which of several hands it is of.
    """
    drives = [*mechanism.parts.columns]
    _check_hands(frame, mechanism, problems)
    position = _positions(frame, mechanism)
    _check_angle_unit(frame, position, spec, mechanism, problems)
    for i in np.flatnonzero(np.isnan(position).any(axis=1)):
        value = ", ".join(f"{one:.6g}" for one in frame[drives].iloc[i])
        allowed = "values at which the nominal robot closes near its home pose, or commanded positions beside them"
        problems.add("no pose", row=frame.index[i], column=", ".join(drives), value=value, allowed=allowed)
    return position


def _positions(frame, mechanism, factor=1.0):
    """Nominal positions (n, 3) at the drive values, angles times a factor; NaN where the robot does not close."""
    units = np.array(mechanism.parts.units)
    values = frame[[*mechanism.parts.columns]].to_numpy(dtype=float) * np.where(units == "rad", factor, 1.0)
    return mechanism.forward(values, guess_mm=mechanism.guess(values, frame.get("target")))


def _check_angle_unit(frame, position, spec, mechanism, problems):
    """Refuse drive angles that fit the measured positions in the other unit alone, whatever theirs is."""
    if "rad" not in mechanism.parts.units:
        return
    measured = rows.measured(frame) / MM[spec.unit]
    given = _misfit(position, measured)
    other = next(unit for unit in RAD if unit != spec.angle_unit)
    if given <= _NEAR:
        return
    turned = _misfit(_positions(frame, mechanism, RAD[other] / RAD[spec.angle_unit]), measured)
    if turned > min(_NEAR, _BETTER * given):
        return
    columns = [drive.column for drive in mechanism.parts.drives if drive.unit == "rad"]
    largest = np.nanmax(np.abs(frame[columns].to_numpy(dtype=float))) / RAD[spec.angle_unit]
    value = f"{drive_name(mechanism)} up to {largest:.6g} when read in {spec.angle_unit}"
    allowed = f"what brings the nominal robot to the measured positions; angle_unit: {other} does"
    problems.add("angle unit", column=", ".join(columns), value=value, allowed=allowed)
    problems.refuse()


def _misfit(position, measured):
    """How far the distances between measured positions (n, 3), in the best unit, are from those between others (n, 3),
    in shares of these; infinite where these do not exist. Distances are the same in every frame.
    """
    known = np.flatnonzero(np.isfinite(measured).all(axis=1))
    if np.isnan(position).any() or len(known) < _LEAST:
        return np.inf
    few = known[:: -(-len(known) // _PROBES)]
    wanted, seen = pdist(position[few]), pdist(measured[few])
    whole = max(float(np.median(wanted)), 1e-9)
    return min(float(np.median(np.abs(size * seen - wanted))) / whole for size in MM.values())


def _check_hands(frame, mechanism, problems):
    """Refuse rows that do not say which of several hands they are of."""
    carried = [target for hand in mechanism.legs.hands for target in hand]
    if carried and "target" not in frame:
        problems.add("missing column", column="target", value="no such column", allowed=", ".join(carried))
    if carried and "target" in frame:
        for i in np.flatnonzero(~frame["target"].isin(carried)):
            value, allowed = frame["target"].iloc[i], f"what a hand carries: {', '.join(carried)}"
            problems.add("reflectors", row=frame.index[i], column="target", value=value, allowed=allowed)
    problems.refuse()
