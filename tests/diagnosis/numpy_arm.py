"""The six-axis arm of data/models/arm6.urdf, by NumPy and SciPy alone, at stops that a tracker reads.

Lengths in mm, angles in rad, masses in kg.
"""

import numpy as np
import pandas as pd
from scipy.spatial.transform import Rotation

NOISE_MM, STOPS = 0.02, 110
# reflectors on the flange
PLACES = {"a": (60.0, 20.0, 70.0), "b": (-70.0, 35.0, 95.0)}
_ERROR_MM, _ERROR_RAD, _GRAVITY = 0.2, 5e-4, 9.81
# places of the joints in the links before them, turns about y, the joints' axes; masses and their centres behind them
_PLACE_MM = np.array([[0, 0, 180], [60, 0, 220], [0, 0, 520], [510, 0, 35], [20, 0, 0], [90, 0, 0]], dtype=float)
_PITCH = np.array([0.0, 0.0, 0.0, 0.0, 0.5 * np.pi, 0.0])
_AXES = np.array([[0, 0, 1], [0, 1, 0], [0, 1, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0]], dtype=float)
_MASS_KG = np.array([11.0, 9.5, 5.0, 3.8, 1.6, 0.3])
_CENTRE_MM = np.array([[20, 0, 110], [0, 50, 240], [40, -20, 30], [-120, 0, 0], [15, 0, 0], [-10, 0, 0]], dtype=float)
# the instrument's frame
FRAME = Rotation.from_rotvec([0.1, -0.2, 0.7])
_LOW, _HIGH = np.array([-1.2, -0.6, -1.2, -2.2, -1.5, -2.5]), np.array([1.2, 1.0, 0.6, 2.2, 1.5, 2.5])


def drives(generator):
    """Drive values (STOPS, 6) in no order."""
    return generator.uniform(_LOW, _HIGH, (STOPS, 6))


def errors(generator):
    """Errors (6, 6) of the joints' places and directions."""
    return np.repeat([_ERROR_MM, _ERROR_RAD], 3) * generator.standard_normal((6, 6))


def links(drive, off):
    """Positions (n, 3) and turns (n, 3, 3) of each link behind its joint at drive values (n, 6) with errors (6, 6)."""
    position, turn = np.zeros((len(drive), 3)), np.tile(np.eye(3), (len(drive), 1, 1))
    for k, axis in enumerate(_AXES):
        position = position + turn @ (_PLACE_MM[k] + off[k, :3])
        seat = Rotation.from_euler("y", _PITCH[k]) * Rotation.from_rotvec(off[k, 3:])
        turn = turn @ seat.as_matrix() @ Rotation.from_rotvec(drive[:, k, None] * axis).as_matrix()
        yield position, turn


def torque_on_a_wall(drive, off, payload_kg):
    """Torque (n,) in N mm about the first joint where x of the base points up, with a payload (n,) at the flange."""
    found = list(links(drive, off))
    aside = [(position + turn @ centre)[:, 1] for (position, turn), centre in zip(found, _CENTRE_MM, strict=True)]
    return _GRAVITY * (_MASS_KG @ np.array(aside) + payload_kg * found[-1][0][:, 1])


def table(drive, places, generator, **columns):
    """What a tracker in a frame of its own reads at drive values (n, 6).

    places: by reflector's name its position and turn, (n, 3) and (n, 3, 3) of the flange, and place (3,) or (n, 3) on
    it; columns: others of the table (n,).
    """
    frame, tables = FRAME.as_matrix(), []
    for number, (name, (position, turn, place)) in enumerate(places.items()):
        on_flange = np.broadcast_to(place, position.shape)
        seen = (position + np.einsum("nij,nj->ni", turn, on_flange)) @ frame.T + [500.0, 200.0, -100.0]
        seen = seen + NOISE_MM * generator.standard_normal(seen.shape)
        read = {f"measured_{axis}_mm": column for axis, column in zip("xyz", seen.T, strict=True)}
        driven = {f"axis{k}_rad": column for k, column in enumerate(drive.T, 1)}
        time = 20.0 * np.arange(len(drive)) + 8.0 * number
        tables.append(pd.DataFrame({"time_s": time, "target": name, **driven, **read, **columns}))
    return pd.concat(tables).sort_values("time_s").assign(trajectory="stops")
