"""Serial arms from their DH tables: one leg with every joint driven.

Standard (Denavit and Hartenberg, J. Appl. Mech. 22, 1955) and modified (Craig, Introduction to Robotics, 1986) rows:

    T_i = Rz(theta) Tz(d) Tx(a) Rx(alpha)   or   T_i = Rx(alpha) Tx(a) Rz(theta) Tz(d)

Lengths in mm, angles in rad.
"""

import numpy as np

from rrru.errors import ConfigError
from rrru.robots.drive_step import end_of
from rrru.robots.general import GeneralRobot
from rrru.robots.legs import Drive, Joint, Leg, Legs, Parts, X, Z, turn_about, unit_twist


def serial(rows, drive_range, home, modified=False, tool_mm=(0.0, 0.0, 0.0), name="arm", **options):
    """The GeneralRobot of DH rows, mappings of a, d in mm and alpha, theta in rad; absent ones are 0.

    A row's joint turns by q + theta or, with sliding: true, slides by q + d. drive_range (K, 2): of the joints' values
    q, home (K,): values of the home pose, in rad or mm. tool_mm (3,): measured point in the last frame. Columns: q1_rad
    or q1_mm, ... Raises ConfigError for an unknown key.
    """
    joints, turn, shift = [], np.eye(3), np.zeros(3)
    for number, row in enumerate(rows, 1):
        if unknown := set(row) - {"a", "alpha", "d", "theta", "sliding"}:
            raise ConfigError(f"{name}: row {number} has {unknown.pop()!r}; allowed: a, alpha, d, theta, sliding")
        along, across, twist = row.get("d", 0.0) * Z, row.get("a", 0.0) * X, turn_about(X, row.get("alpha", 0.0))
        own = turn_about(Z, row.get("theta", 0.0))
        if modified:
            turn, shift = turn @ twist, shift + turn @ across
        kind = "P" if row.get("sliding") else "R"
        joints.append(Joint(f"joint {number}", kind, Z, shift, turn @ own, drive=number - 1))
        shift, turn = along + (0.0 if modified else across), np.eye(3) if modified else twist
    leg = Leg("arm", (Joint("base"), *joints, Joint("flange", "fixed", Z, shift, turn)))
    home = np.asarray(home, dtype=float)
    legs = Legs((leg,), home)
    drives = tuple(
        Drive(f"q{k}_{'mm' if j.kind == 'P' else 'rad'}", "mm" if j.kind == "P" else "rad", j.name, _along(j))
        for k, j in enumerate(joints, 1)
    )
    end = end_of(legs, leg, home[None])
    legs = Legs((leg,), home, end.position_mm[0], end.turn[0])
    return GeneralRobot(
        name=name,
        legs=legs,
        parts=Parts(drives=drives),
        drive_range=np.asarray(drive_range, dtype=float),
        tool_mm=tuple(tool_mm),
        **options,
    )


def _along(joint):
    """Twist (6,) of a unit of a joint's value."""
    return unit_twist(5 if joint.kind == "R" else 2)
