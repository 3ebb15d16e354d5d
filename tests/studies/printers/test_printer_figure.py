"""The figure of the printers draws what stands in the table."""

import numpy as np
import pytest

from rrru.errors import ConfigError
from tests.figures.catalogue import FIGURES
from tests.studies.printers.synthetic_printers import printers


def draw(frame):
    figure = FIGURES["printers"][0]({"printers": frame}, {})
    figure.draw_without_rendering()
    return figure


def drawn(axes, label):
    """Values and rows of the marks with a label."""
    line = next(one for one in axes.lines if one.get_label() == label)
    return line.get_xdata(), line.get_ydata()


def test_every_fitted_printer_has_a_row_with_its_numbers():
    frame = printers()
    fitted = frame[frame["verdict"] != "not fitted"].reset_index(drop=True)
    panels = draw(frame).axes
    assert [text.get_text() for text in panels[0].get_yticklabels()] == fitted["printer"].tolist()
    for verdict in ("reproduced", "does not belong"):
        chosen = fitted[fitted["verdict"] == verdict]
        values, rows = drawn(panels[0], f"answer {verdict}")
        np.testing.assert_array_equal(values, chosen["largest_difference"])
        np.testing.assert_array_equal(rows, chosen.index)
    for axes, label, column in (
        (panels[1], "heights, ours", "height_rms_fitted_mm"),
        (panels[1], "distances, saved", "distance_rms_saved_mm"),
        (panels[2], "an arm, with distances", "arm_standard_error_mm"),
        (panels[2], "all arms, heights alone", "common_arm_standard_error_mm"),
        (panels[2], "all arms, 100 heights", "dense_common_arm_standard_error_mm"),
    ):
        np.testing.assert_array_equal(drawn(axes, label)[0], fitted[column])


@pytest.mark.parametrize("count", [1, 90])
def test_one_printer_and_very_many_are_drawn_on_a_page(count):
    figure = draw(printers(count, ("reproduced",)))
    assert figure.get_size_inches()[1] * 25.4 < 240.0


def test_a_table_without_an_answer_is_refused():
    with pytest.raises(ConfigError, match="no printer that could be fitted"):
        draw(printers(4, ("not fitted",)))
