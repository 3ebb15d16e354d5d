"""Results of one printer's readings: calibration, suspicious reading, causes, tilted effector."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rrru.errors import FitError
from rrru.studies.printers.cause_tests import CauseTests
from rrru.studies.printers.printer_causes import FOUND, LeftOut, Level, causes, diagnosis, left_out, without
from rrru.studies.printers.printer_fit import PrinterFit, fit_printer
from rrru.studies.printers.saved_answers import reason
from rrru.studies.printers.tilt_answers import TiltAnswer, tilt_answer

REPRODUCED, FOREIGN, UNTRIED, FAILED = "reproduced", "does not belong", "not calibrated", "not fitted"


@dataclass(frozen=True)
class Judged:
    """A printer's fit, its leave-one-out residuals, its causes, and the tilt where the probe has an offset.

    reason: why its saved answer does not belong; empty where it does.
    """

    result: PrinterFit
    left: LeftOut
    causes: tuple
    tilt: TiltAnswer | None
    level: Level
    reason: str

    @property
    def verdict(self):
        """Whether the saved answer is that of the readings."""
        if not self.result.printer.calibrated:
            return UNTRIED
        return FOREIGN if self.reason else REPRODUCED

    @cached_property
    def suspect(self):
        """Number from 0 of the reading with p below the limit, None where there is none."""
        return self.left.suspect if self.causes[0].p < self.causes[0].limit else None

    @property
    def flagged(self):
        """Whether the verdict on the suspicious reading is a bad reading."""
        return self.suspect is not None and self.causes[0].verdict == FOUND

    @cached_property
    def without_suspect(self):
        """The PrinterFit of the other readings, None where none is suspicious."""
        return None if self.suspect is None else without(self.result, self.suspect)

    @property
    def cause(self):
        """The overall answer on the causes."""
        return diagnosis(self.causes)


def judge(printer, stopping_step, level):
    """The Judged printer; raises FitError naming it where it cannot be fitted."""
    result = fit_printer(printer, stopping_step, level.level)
    try:
        left = left_out(result)
        answers = causes(result, left, level)
        tilt = tilt_answer(result, level.limit(CauseTests(result), "effector_tilt", more=1))
    except (FitError, ValueError, np.linalg.LinAlgError) as error:
        raise FitError(f"{printer.name}: {error}", getattr(error, "result", None)) from None
    return Judged(result, left, answers, tilt, level, reason(result) if printer.calibrated else "")
