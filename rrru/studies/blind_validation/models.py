"""Models of robots in files that the check drives: their workspace, and where in a file a cause acts. mm, rad.

Names are those of bodies, joints and connects of the MJCF, a place is `<name>.x` to `<name>.rz`; see
`rrru.simulation.mujoco_causes`. Each place is paired with its parameter of our general model.
"""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Model:
    """half_mm: half the width of the box about its home in which it is driven; targets: places of reflectors.

    links: places that deflect under the force of one link, or across one joint; clearances: joints with clearance;
    lengths, tilts: pairs of place and parameter, those of one error together; growth_mm: by body or connect the
    displacement of its seat under a strain of 1.
    """

    half_mm: float
    links: tuple = ()
    clearances: tuple = ()
    lengths: tuple = ()
    tilts: tuple = ()
    growth_mm: dict = field(default_factory=dict)
    targets: dict = field(default_factory=dict)


# places of reflectors on a platform
TARGETS_MM = {"a": (60.0, 0.0, 40.0), "b": (-50.0, 60.0, 40.0), "c": (-40.0, -70.0, 60.0)}
_PLATES = ("plate", "part2", "part3")


def _rrru3():
    """Base and platform expand alike, which no measurement shows."""
    legs = tuple(zip((1, 2, 3), _PLATES, strict=True))
    growth = {}
    for k, plate in legs:
        growth |= {f"crank{k}": (400.0, 0.0, 0.0), f"forearm{k}": (100.0, 0.0, 0.0), plate: (800.0, 0.0, 0.0)}
    arms = tuple(((f"crank{k}.x", f"elbow{k}_x"),) for k, _ in legs)
    forearms = tuple(((f"{plate}.x", f"wrist{k}_x"),) for k, plate in legs)
    tilts = tuple(((f"crank{k}.{turn}", f"elbow{k}_{turn}"),) for k, _ in legs for turn in ("rx", "rz"))
    return Model(140.0, lengths=arms + forearms, tilts=tilts, growth_mm=growth)


def _delta():
    """No place of the file lengthens its rods, which hang between ball joints, so this robot does not warm up."""
    rods = [f"{k}{side}" for k in (1, 2, 3) for side in "ab"]
    pairs = ((1, 2), (3, 4), (5, 6))
    return Model(
        200.0,
        links=tuple((f"rod{rod}.z",) for rod in rods),
        clearances=tuple(f"ball{rod}" for rod in rods),
        lengths=tuple(
            ((f"rod{k}a.x", f"leg_{a}_ball_x"), (f"rod{k}b.x", f"leg_{b}_ball_x"))
            for k, (a, b) in zip((1, 2, 3), pairs, strict=True)
        ),
        tilts=tuple(((f"arm{k}.rz", f"theta{k}_rz"),) for k in (1, 2, 3)),
    )


def _hexapod():
    """Its legs on universal joints have no axis that can tilt, and always push: clearance never changes side."""
    feet = ((252.3, -62.9), (252.3, 62.9), (-71.7, 249.9), (-180.6, 187.0), (-180.6, -187.0), (-71.7, -249.9))
    ends = ((115.1, -111.1), (115.1, 111.1), (38.7, 155.2), (-153.8, 44.1), (-153.8, -44.1), (38.7, -155.2))
    growth = {f"cylinder{k}": (*foot, 50.0) for k, foot in enumerate(feet, 1)}
    growth |= {f"piston{k}": (0.0, 0.0, 453.92) for k in range(1, 7)}
    growth |= {f"ball{k}": (*end, -20.0) for k, end in enumerate(ends, 1)}
    legs = range(1, 7)
    return Model(
        45.0,
        links=tuple((f"piston{k}.z",) for k in legs),
        lengths=tuple(((f"cylinder{k}.x", f"leg_{k}_ball_x"),) for k in legs),
        growth_mm=growth,
        targets=TARGETS_MM,
    )


def _arm6():
    """A link bends and its bearing tilts about the two directions across its axis."""
    across = {"shoulder": "xy", "upper_arm": "xz", "elbow": "xz", "forearm": "yz", "wrist": "xz", "flange": "yz"}
    growth = {"shoulder": (0.0, 0.0, 180.0), "upper_arm": (60.0, 0.0, 220.0), "elbow": (0.0, 0.0, 520.0)}
    growth |= {"forearm": (510.0, 0.0, 35.0), "wrist": (20.0, 0.0, 0.0), "flange": (90.0, 0.0, 0.0)}
    return Model(
        170.0,
        links=tuple(tuple(f"{body}.r{axis}" for axis in axes) for body, axes in across.items()),
        lengths=((("elbow.z", "axis3_z"),), (("forearm.x", "axis4_x"),)),
        tilts=((("upper_arm.rx", "axis2_rx"),), (("elbow.rz", "axis3_rz"),), (("forearm.rz", "axis4_rz"),)),
        growth_mm=growth,
        targets=TARGETS_MM,
    )


# by the name of a file without its ending
MODELS = {"rrru3": _rrru3(), "delta": _delta(), "hexapod": _hexapod(), "arm6": _arm6()}
