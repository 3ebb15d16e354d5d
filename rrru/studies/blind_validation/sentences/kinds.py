"""Twenty kinds of own robots with dimensions and masses at random. Lengths mm, angles rad, masses kg."""

from functools import partial

import numpy as np

from rrru.studies.blind_validation.sentences.own_robots import Chain, Joint, Rods

_X, _Y, _Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
_AXES = {"x": _X, "y": _Y, "z": _Z}

# rows of joints: letter of the axis, capital for a slide; seat in mm; span; mass in kg
_ARM = [
    ("z", (0, 0, 180), (-1.2, 1.2), 11.0),
    ("y", (60, 0, 220), (-0.7, 0.9), 9.5),
    ("y", (0, 0, 500), (-0.8, 0.8), 5.0),
]
_WRIST = [
    ("x", (420, 0, 40), (-1.3, 1.3), 3.8),
    ("y", (40, 0, 0), (-1.3, 1.3), 1.6),
    ("x", (80, 0, 0), (-1.8, 1.8), 0.4),
]
_OFFSET_WRIST = [
    ("y", (390, 110, 0), (-1.2, 1.2), 2.2),
    ("z", (0, 90, -40), (-1.3, 1.3), 1.8),
    ("y", (0, 60, -90), (-1.8, 1.8), 0.5),
]
_ARM7 = [
    ("z", (0, 0, 170), (-1.2, 1.2), 4.0),
    ("y", (0, 0, 170), (-0.9, 0.9), 4.0),
    ("z", (0, 0, 200), (-1.2, 1.2), 3.0),
    ("y", (0, 0, 200), (-1.4, -0.3), 2.7),
    ("z", (0, 0, 190), (-1.2, 1.2), 1.7),
    ("y", (0, 0, 190), (-1.2, 1.2), 1.6),
    ("z", (0, 0, 80), (-1.8, 1.8), 0.4),
]
# two vertical axes, and a quill that slides and rotates
_SCARA = [
    ("z", (0, 0, 300), (-1.3, 1.3), 9.0),
    ("z", (330, 0, 60), (0.3, 1.9), 5.0),
    ("Z", (270, 0, 0), (-150, 0), 1.5),
    ("z", (0, 0, -120), (-1.8, 1.8), 0.4),
]
# a carriage on a column with three vertical axes
_LIFT_SCARA = [
    ("Z", (0, 0, 400), (-250, 250), 15.0),
    ("z", (80, 0, 0), (-1.2, 1.2), 6.0),
    ("z", (320, 0, 50), (0.3, 1.9), 4.0),
    ("z", (280, 0, -40), (-1.6, 1.6), 1.0),
]
_SLIDES = [
    ("X", (0, 0, 900), (-400, 400), 30.0),
    ("Y", (0, 60, 80), (-350, 350), 14.0),
    ("Z", (90, 0, 0), (-250, 150), 6.0),
]
# a head of two axes, as in milling machines
_HEAD = [("z", (0, 0, -150), (-1.6, 1.6), 3.0), ("y", (0, 40, -90), (-1.0, 1.0), 2.0)]
# a turret that tilts a ram
_POLAR = [
    ("z", (0, 0, 350), (-1.3, 1.3), 12.0),
    ("y", (40, 0, 120), (-0.6, 0.6), 8.0),
    ("X", (350, 0, 30), (0, 350), 5.0),
    ("x", (160, 0, 0), (-1.8, 1.8), 1.0),
]
# a rotating column with a carriage and a ram
_CYLINDRICAL = [
    ("z", (0, 0, 200), (-1.4, 1.4), 14.0),
    ("Z", (60, 0, 300), (-200, 250), 9.0),
    ("X", (250, 0, 0), (0, 350), 5.0),
    ("z", (150, 0, -60), (-1.8, 1.8), 1.0),
]
# rows and tip of each kind of chain, see `_chain`
_CHAINS = {
    "arm4": ([*_ARM, ("z", (450, 0, 0), (-1.5, 1.5), 1.5)], (70, 0, -60)),
    "arm5": ([*_ARM, *_WRIST[1:]], (90, 20, 30)),
    "arm6": ([*_ARM, *_WRIST], (90, 0, 40)),
    "arm6_offset": ([*_ARM, *_OFFSET_WRIST], (20, 90, 0)),
    "arm6_hanging": ([*_ARM, *_WRIST], (100, 0, 0)),
    "arm7": (_ARM7, (50, 0, 80)),
    "arm6_on_rail": ([("X", (0, 0, 300), (-600, 600), 40.0), *_ARM, *_WRIST], (90, 0, 40)),
    "scara": (_SCARA, (60, 30, -50)),
    "lift_scara": (_LIFT_SCARA, (80, 20, -70)),
    "gantry3": (_SLIDES, (30, 20, -120)),
    "gantry4": ([*_SLIDES, ("z", (0, 0, -150), (-1.8, 1.8), 2.0)], (70, 20, -90)),
    "gantry5": ([*_SLIDES, *_HEAD], (40, 0, -140)),
    "polar": (_POLAR, (70, 30, 40)),
    "cylindrical": (_CYLINDRICAL, (60, 20, -60)),
}


def _chain(generator, name):
    """A Chain of a kind, its rows with random variations."""
    (rows, tip_mm), joints, scale = _CHAINS[name], [], generator.uniform(0.75, 1.3)
    for number, (letter, seat, span, mass) in enumerate(rows, 1):
        unit = "mm" if letter.isupper() else "rad"
        place = scale * np.array(seat) * generator.uniform(0.85, 1.15, 3) + generator.uniform(-8.0, 8.0, 3)
        ends = np.array(span) * (scale if unit == "mm" else 1.0) * generator.uniform(0.9, 1.0)
        turned = (np.pi, 0.0, 0.0) if name == "arm6_hanging" and number == 1 else (0.0, 0.0, 0.0)
        centre = 60.0 * generator.uniform(-1.0, 1.0, 3)
        weighed = float(mass * generator.uniform(0.7, 1.4)), tuple(centre.tolist())
        way = _AXES[letter.lower()], tuple(place.tolist()), tuple(ends.tolist()), turned
        joints.append(Joint(f"q{number}", unit, *way, *weighed))
    tip = scale * np.array(tip_mm) + generator.uniform(-10.0, 10.0, 3)
    return Chain(tuple(joints), tuple(tip.tolist()))


def _circle(radius_mm, degrees, height_mm=0.0):
    """Points (n, 3) of a circle."""
    angle = np.radians(degrees)
    return np.stack([radius_mm * np.cos(angle), radius_mm * np.sin(angle), np.full(len(angle), height_mm)], axis=1)


def _pairs(generator, apart):
    """Angles (6,) in degrees of three pairs, with small random errors."""
    return np.repeat([0.0, 120.0, 240.0], 2) + apart * np.tile([-1.0, 1.0], 3) + generator.uniform(-4.0, 4.0, 6)


def _hexapod(generator, uneven=3.0):
    """Six struts between two rings with normal errors of a size in mm."""
    low, high = generator.uniform(0.8, 1.3, 2)
    foot = _circle(250.0 * low, _pairs(generator, generator.uniform(12.0, 22.0)), 50.0)
    head = _circle(170.0 * low, _pairs(generator, generator.uniform(40.0, 48.0)), -20.0)
    foot, head = (points + uneven * generator.standard_normal((6, 3)) for points in (foot, head))
    home = np.array([0.0, 0.0, 470.0 * high])
    return Rods(
        "strut", tuple(range(6)), foot, _along(_Z), foot, head, home, _symmetric(60.0 * low), _masses(generator)
    )


def _along(axis):
    """The same direction (6, 3) for all rods."""
    return np.tile(np.array(axis), (6, 1))


def _symmetric(limit):
    """A span about zero."""
    return (-float(limit), float(limit))


def _masses(generator, masses=(4.0, 1.4, 0.6)):
    """Masses of platform, drive and rod."""
    return tuple((np.array(masses) * generator.uniform(0.7, 1.4, 3)).tolist())


def _hexaglide(generator):
    """Six rods on carriages of vertical rails."""
    size = generator.uniform(0.8, 1.2)
    foot = _circle(400.0 * size, _pairs(generator, 18.0), 200.0) + generator.uniform(-10.0, 10.0, (6, 3))
    head = _circle(130.0 * size, _pairs(generator, 42.0), 0.0)
    home, masses = np.array([0.0, 0.0, 200.0 + 420.0 * size]), _masses(generator, (3, 2, 0.4))
    return Rods("rail", tuple(range(6)), foot, _along(_Z), foot, head, home, _symmetric(45 * size), masses)


def _delta_rails(generator):
    """A delta on three vertical rails."""
    size, drive = generator.uniform(0.8, 1.3), (0, 0, 1, 1, 2, 2)
    foot, head = _rod_pairs(240.0 * size, 60.0 * size, 45.0 * size)
    home, masses = np.array([0.0, 0.0, -380.0 * size]), _masses(generator, (1, 1, 0.2))
    return Rods("rail", drive, foot, _along(_Z), foot, head, home, _symmetric(90 * size), masses)


def _rod_pairs(outer_mm, inner_mm, half_mm):
    """Balls (6, 3) of three parallel pairs of rods, on the drives and on the platform."""
    angle = np.radians([90.0, 210.0, 330.0])
    out = np.stack([np.cos(angle), np.sin(angle), np.zeros(3)], axis=1)
    side = half_mm * np.stack([-np.sin(angle), np.cos(angle), np.zeros(3)], axis=1)
    both = np.stack([-side, side], axis=1).reshape(6, 3)
    return (np.repeat(radius * out, 2, axis=0) + both for radius in (outer_mm, inner_mm))


def _delta(generator):
    """A delta on three cranks."""
    size, drive = generator.uniform(0.8, 1.3), (0, 0, 1, 1, 2, 2)
    arm, base = 300.0 * size * generator.uniform(0.9, 1.1), 150.0 * size
    foot, head = _rod_pairs(base + arm, 60.0 * size, 45.0 * size)
    pivot, _ = _rod_pairs(base, 60.0 * size, 45.0 * size)
    side = (foot[1::2] - foot[::2]) / np.linalg.norm(foot[1] - foot[0])
    home, side = np.array([0.0, 0.0, -620.0 * size]), np.repeat(side, 2, axis=0)
    pivot = np.repeat(0.5 * (pivot[::2] + pivot[1::2]), 2, axis=0)
    return Rods("crank", drive, foot, side, pivot, head, home, _symmetric(0.35), _masses(generator, (1, 1, 0.2)))


def _hexa(generator):
    """Six rods, each on its own crank."""
    size = generator.uniform(0.8, 1.2)
    degrees = _pairs(generator, 20.0)
    pivot, foot = (_circle(radius * size, degrees) for radius in (260.0, 420.0))
    head = _circle(140.0 * size, _pairs(generator, 42.0), 0.0)
    side = _circle(1.0, degrees + 90.0)
    home = np.array([0.0, 0.0, -430.0 * size])
    masses = _masses(generator, (3, 1, 0.3))
    return Rods("crank", tuple(range(6)), foot, side, pivot, head, home, _symmetric(0.2), masses)


KINDS = {
    **{name: partial(_chain, name=name) for name in _CHAINS},
    "hexapod": _hexapod,
    "hexapod_uneven": partial(_hexapod, uneven=15.0),
    "hexaglide": _hexaglide,
    "delta_rails": _delta_rails,
    "delta": _delta,
    "hexa": _hexa,
}
