"""Cable robots with measured drum angles and platform positions from a camera: radii, anchors, start lengths.

A set of `real: sets:`

    kamal:
      kind: cables
      files: "planar_cables/*.csv"    # one calibration per file
      drums: {drum1: {column: drum1_rad, radius_mm: 25.0}, drum2: {..}, drum3: {..}}
      angle_unit: rad    # of the drums' columns: rad (default), deg
      anchors: [a1, a2, a3, a4]
      distances: [[1, 1, 0, 0], [1, 0, 2, 0], [0, 1, 0, 2]]    # a row per drum: how often its cable runs to each anchor
      heights_mm: {a1: 0}    # of an anchor above the plane of the positions; absent: 0
      position: [x_m, y_m]    # two or three columns of the platform's measured place
      unit: m    # of the position: mm (default), m, inch
      row: pose    # column that numbers the rows; absent: row, or from 1

The length of a cable is its length at the drum's zero plus radius times angle; it equals the sum of the distances along
its route. Anchors are in the camera's frame. The camera's places count as exact. A scale error of the camera is
confounded with a common factor of the radii.
"""

import numpy as np

from rrru.estimation.observations.lengths import Lengths
from rrru.studies.real import length_tables
from rrru.studies.real.length_models import UNEXPLAINED, LengthCase, variants_of
from rrru.studies.real.lengths_section import MM, RAD, Section, numbers

RADIUS = "drum_radius"
_NEEDED = ("kind", "files", "drums", "anchors", "distances", "position")
_OPTIONAL = ("angle_unit", "unit", "heights_mm", "row")
# ASSUME radii have errors of 4 %, 1 sigma; camera scale and cable thickness change all by one factor
_RADIUS_SHARE, _COMMON, _SINGLE, _EACH = 0.04, 0.2, 0.15, 0.15
# number of random starts of the anchors, their largest distance from the centre in spans of the measured places, seed
_STARTS, _FAR, _SEED = 30, 6.0, 1


def study(frame, section, name):
    """Tables of one calibration: real_verdicts, real_steps, real_parameters, real_points.

    frame: one row per pose; section: as above; name: of the set, for messages. Raises ConfigError and IngestError for
    an invalid set, FitError where the poses do not determine the machine.
    """
    read = Section(section, name, _NEEDED, _OPTIONAL)
    case, drums, anchors = cable_case(frame, read)
    verdict = case.verdict()
    chosen = verdict[2]
    effect_models = case.effect_models[RADIUS]
    chain = list(dict.fromkeys([(), (effect_models[0],), (effect_models[-1],), chosen.effect_models]))
    parameters = _parameters(case, chosen, drums, anchors)
    words = _words(case, verdict, drums)
    return length_tables.tables(frame, read, case, verdict, drums, chain, parameters, words)


def cable_case(frame, read):
    """The LengthCase of a set, and the names of its drums and anchors; read: its Section."""
    drums, anchors, columns = read.mapping("drums"), read.texts("anchors"), read.texts("position")
    if len(columns) not in (2, 3):
        read.refuse("position", columns, "two or three columns")
    for drum, entry in drums.items():
        if not isinstance(entry, dict) or set(entry) != {"column", "radius_mm"}:
            read.refuse(f"drums.{drum}", entry, "a mapping of column and radius_mm")
    radii = [read.number(f"drums.{drum}.radius_mm", entry["radius_mm"], 1e-6) for drum, entry in drums.items()]
    routing = _routing(read, tuple(drums), anchors)
    least = -(-(len(anchors) * len(columns) + len(drums) + 1) // len(drums))
    wanted = [entry["column"] for entry in drums.values()]
    values = numbers(frame, [*wanted, *columns], read.given("files"), least)
    angles = RAD[read.choice("angle_unit", "rad", tuple(RAD))] * values[:, : len(drums)]
    places = MM[read.choice("unit", "mm", tuple(MM))] * values[:, len(drums) :]
    free, count = len(anchors) * len(columns) + len(drums), len(drums)
    origin = np.append(np.zeros(free), radii)
    heights = read.heights("heights_mm", anchors)
    _check_lengths(read, wanted, angles * radii, routing, places)
    bare = Lengths(angles, routing, heights, origin, np.eye(free + count)[:, :free], places)
    return LengthCase(bare, {RADIUS: _radii(bare, tuple(drums), np.array(radii))}, _starts), tuple(drums), anchors


def _check_lengths(read, columns, taken_mm, routing, places):
    """Raise ConfigError where drums wind more cable than the displacements of the platform allow.

    Between two rows the distance to an anchor changes at most by the displacement. columns: of the drums' angles;
    taken_mm (N, k): radius times angle.
    """
    first, second = np.triu_indices(len(places), 1)
    way = np.linalg.norm(places[first] - places[second], axis=1)
    taken = np.abs(taken_mm[first] - taken_mm[second])[way > 0.0] / way[way > 0.0, None]
    # the median ignores bad rows, which the fit rejects
    times = np.median(taken, axis=0) / routing.sum(axis=1)
    worst = int(times.argmax())
    if times[worst] > 1.0:
        value = f"{read.given('angle_unit', 'rad')}, {columns[worst]} winds {times[worst]:.3g} times"
        read.refuse(
            "angle_unit", value, "at most the cable for the platform's displacements; check angle_unit, unit, radius_mm"
        )


def _routing(read, drums, anchors):
    """Matrix (k, n): how often each cable runs to each anchor."""
    rows = read.given("distances")
    shaped = isinstance(rows, list) and len(rows) == len(drums)
    if not shaped or not all(isinstance(row, list) and len(row) == len(anchors) for row in rows):
        read.refuse("distances", rows, f"{len(drums)} rows, one per drum, of {len(anchors)} numbers, one per anchor")
    routing = np.array([[read.number("distances", value, 0.0) for value in row] for row in rows])
    for drum, row in zip(drums, routing, strict=True):
        if not row.any():
            read.refuse("distances", row.tolist(), f"at least one distance for the cable of {drum}")
    for anchor, column in zip(anchors, routing.T, strict=True):
        if not column.any():
            read.refuse("distances", column.tolist(), f"at least one cable that runs to {anchor}")
    return routing


def _radii(bare, drums, radii):
    """Variants of radius errors: a common factor, one drum, one per drum."""
    factors = np.eye(len(bare.origin))[:, -len(drums) :]
    variants = [
        ("all drums by one factor", "a common factor of the radii", factors @ radii[:, None] / radii.mean(), _COMMON)
    ]
    variants += [(drum, f"the radius of {drum}", factors[:, [k]], _SINGLE / len(drums)) for k, drum in enumerate(drums)]
    variants += [(", ".join(drums), "a radius per drum", factors, _EACH)]
    return variants_of(RADIUS, variants, _RADIUS_SHARE * radii.mean())


def _starts(lengths):
    """Start values (p,): random anchors about the measured places, with start lengths that fit them."""
    generator, inverse = np.random.default_rng(_SEED), np.linalg.pinv(lengths.basis)
    middle, span = lengths.places_mm.mean(axis=0), np.ptp(lengths.places_mm, axis=0).max()
    readings, count = lengths.routing.shape
    for _ in range(_STARTS):
        anchors = middle + span * generator.uniform(-_FAR, _FAR, (count, lengths.dimensions)) * generator.uniform()
        full = np.concatenate([anchors.ravel(), np.zeros(readings), lengths.origin[-readings:]])
        left = lengths.residual(inverse @ (full - lengths.origin))
        full[-2 * readings : -readings] = -left.mean(axis=0)
        yield inverse @ (full - lengths.origin)


def _parameters(case, chosen, drums, anchors):
    """Rows of real_parameters: anchors and start lengths of the verdict's Hypothesis, radii with each one free."""
    fit = chosen.fit
    parameter, start = length_tables.parameter, fit.lengths.machine(fit.values)[1]
    start_errors = fit.lengths.split(chosen.standard_errors)[1]
    rows = length_tables.anchors(case, chosen, anchors, "in the camera's frame")
    rows += [
        parameter(f"{drum}_start", "mm", start[k], start_errors[k], np.nan, "cable at the drum's zero")
        for k, drum in enumerate(drums)
    ]
    free = case.hypothesis([case.effect_models[RADIUS][-1]])
    if free is None:
        return rows
    note = "" if free is chosen else "with all radii free, which is not the verdict"
    radius = free.fit.lengths.machine(free.fit.values)[2]
    spread = free.fit.lengths.split(free.standard_errors)[2]
    nominal = case.bare.origin[-len(drums) :]
    return rows + [
        parameter(f"{drum}_radius", "mm", radius[k], spread[k], nominal[k], note) for k, drum in enumerate(drums)
    ]


def _words(case, verdict, drums):
    """Notes (sentences) of a verdict, and its columns where, confounded_with and next_runs."""
    effects, _, chosen = verdict
    possible, poses = case.effect_models[RADIUS], len(case.used)
    off = case.probability_of(lambda effect_models: bool(effect_models))
    notes, where, rivals, runs = [], "", [], []
    if RADIUS in effects:
        effect_model = chosen.effect_models[0]
        settled = case.probability_of(lambda effect_models: effect_model in effect_models) > 0.9 * off
        where = effect_model.where if settled else ""
        changed = chosen.fit.lengths.machine(chosen.fit.values)[2] - case.bare.origin[-len(drums) :]
        error = chosen.fit.lengths.split(chosen.standard_errors)[2]
        said = [f"{drums[k]} by {changed[k]:+.2f} +- {error[k]:.2f} mm" for k in np.flatnonzero(error > 0.0)]
        notes.append(f"The radii have errors, most probably {', '.join(said)}.")
        if not settled:
            named = [
                way.adds
                for way in possible
                if case.probability_of(lambda effect_models, way=way: way in effect_models) > 0.05 * off
            ]
            notes.append(f"{poses} poses do not determine which radius has an error (possible: {'; '.join(named)}).")
            rivals += named
            runs.append("the cable length of ten turns of each drum, by a tape")
        if case.probability_of(lambda effect_models: possible[0] in effect_models) > 0.05 * off:
            rivals.append("camera_scale")
            runs.append("a ruler of known length in the camera image")
    else:
        notes.append(f"No radius error is shown; the probability of one is {off:.2f}.")
        if off > 0.1:
            rivals.append(RADIUS)
            runs.append("the cable length of ten turns of each drum, by a tape")
    notes.append("A scale error of the camera would act as a common factor of the radii.")
    if UNEXPLAINED in effects:
        notes.append(f"No effect model explains a smooth residual of {chosen.smooth_mm:.1f} mm that follows the place.")
    rivals = ", ".join(dict.fromkeys(rivals))
    return notes, {"where": where, "confounded_with": rivals, "next_runs": "; ".join(runs)}
