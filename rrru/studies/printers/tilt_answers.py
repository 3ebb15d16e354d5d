"""Answer on a tilted effector from a printer's readings, and further readings where these do not decide."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from rrru.studies.printers.effector_tilt import SHOWN_MM, TiltTest
from rrru.studies.printers.printer_fit import even_places

# least power for a difference of SHOWN_MM with which readings decide
_POWER = 0.9
# numbers of places for further probing, more than the firmware's own seven
_COUNTS = (19, 37, 100)


@dataclass(frozen=True)
class TiltAnswer:
    """Answer on the tilt: p, the limit for it, the power to find SHOWN_MM, and in words."""

    p: float
    limit: float
    power: float
    text: str

    @property
    def found(self):
        """Whether rods of unequal lengths were found."""
        return self.p < self.limit


def tilt_answer(result, limit):
    """The TiltAnswer of a PrinterFit, None where the probe has no offset from the nozzle, or none is stated."""
    probe = result.printer.probe_mm
    if np.isnan(probe).any() or not probe.any():
        return None
    test = TiltTest(result, probe).with_bent_bed()
    power, p = test.power(limit), test.p
    if p < limit:
        return TiltAnswer(p, limit, power, f"found: the effector tilts, {_rods(test, limit)}")
    if power >= _POWER:
        return TiltAnswer(p, limit, power, f"not found: {SHOWN_MM:g} mm between an arm's rods would be detected")
    return TiltAnswer(p, limit, power, f"cannot tell: {_advice(test, limit)}")


def _rods(test, limit):
    """Arms whose rods may differ alone, with the difference: those that leave no significant rest for the others."""
    alone = {arm: test.alone(number) for number, arm in enumerate("abc")}
    able = [arm for arm, (_, _, others) in alone.items() if others >= limit]
    if not able:
        return "the rods of several arms differ"
    size, error, _ = alone[max(able, key=lambda arm: alone[arm][2])]
    apart = f"if they are {test.result.residuals.mechanism.spacing_mm:.0f} mm apart"
    return f"the rods of arm {' or '.join(able)} differ by {size:.2f} mm (+-{2.0 * error:.2f}) {apart}"


def _advice(test, limit):
    """The easiest further readings that would decide, in words."""
    condition = f"with a repeatability of {test.noise:.3f} mm of a height"
    for words, more in _more(test):
        if more.power(limit) >= _POWER:
            return f"probe {words}; {condition}, this detects {SHOWN_MM:g} mm between an arm's rods"
    return f"no further probing would decide, {condition}"


def _more(test):
    """Further readings that an owner can take, the easiest first: what to do, and the test with them."""
    probed = test.places[: len(test.probe_mm)]
    offset = test.probe_mm[np.hypot(*test.probe_mm.T).argmax()]
    first, second = (_turned(offset, degrees) for degrees in (120.0, 240.0))
    yield "once more at the same places by hand", _with(test, (probed, 0.0 * offset))
    yield "once more at the same places with the probe on the other side of the nozzle", _with(test, (probed, -offset))
    sides = "with the probe on three sides of the nozzle, 120 degrees apart"
    yield f"at the same places {sides}", _with(test, (probed, first), (probed, second))
    for count in _COUNTS:
        places = even_places(test.result, count)
        yield f"at {count} places {sides}", _with(test, (places, offset), (places, first), (places, second))


def _turned(offset, degrees):
    """An offset (2,) rotated about the nozzle."""
    return Rotation.from_euler("z", degrees, degrees=True).apply([*offset, 0.0])[:2]


def _with(test, *sets):
    """The test with more heights: places (n, 3) of the nozzle and offset (2,) of the probe for each set."""
    residuals = test.result.residuals
    places = np.concatenate([places for places, _ in sets])
    sliders = residuals.mechanism.inverse(places, test.result.fit.deviations)
    more = replace(
        residuals,
        height_actuators=np.concatenate([residuals.height_actuators, sliders]),
        height_mm=np.concatenate([residuals.height_mm, places[:, 2]]),
    )
    probe = np.concatenate([test.probe_mm, *(np.tile(offset, (len(places), 1)) for places, offset in sets)])
    fit = test.result.fit.at(test.result.fit.deviations, "with more heights", more)
    return TiltTest(replace(test.result, fit=fit), probe, test.noise)
