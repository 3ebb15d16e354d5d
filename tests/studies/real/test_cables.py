"""Cable robots seen by a camera: radii and anchors found, no alarm without cause, wrong input refused."""

import numpy as np
import pytest

from rrru.calibration.lengths import fit_lengths
from rrru.errors import ConfigError, IngestError
from rrru.studies.real import cables
from rrru.studies.real.lengths_section import Section
from tests.refusals import refusals
from tests.studies.real import simulated_lengths as simulated

SECTION = simulated.CABLES


def _value(tables, name, column="value"):
    return tables["real_parameters"].set_index("parameter").loc[name, column]


def test_no_alarm_where_radii_are_as_stated():
    effects = [
        cables.study(simulated.cables(seed)[0], SECTION, "mine")["real_verdicts"]["effects"][0] for seed in range(10)
    ]
    assert sum(effect != "none" for effect in effects) <= 1


def test_radius_that_is_off_is_named():
    frame, anchors = simulated.cables(3, rows=60, radii=(25.0, 36.0, 35.0))
    tables = cables.study(frame, SECTION, "mine")
    verdict = tables["real_verdicts"].iloc[0]
    assert (verdict["effects"], verdict["where"]) == ("drum_radius", "drum2") and verdict["probability"] > 0.9
    for drum, radius in (("drum1", 25.0), ("drum2", 36.0), ("drum3", 35.0)):
        error = _value(tables, f"{drum}_radius", "standard_error")
        assert abs(_value(tables, f"{drum}_radius") - radius) < 4.0 * error
    found = [[_value(tables, f"a{k + 1}_{axis}") for axis in "xy"] for k in range(4)]
    np.testing.assert_allclose(found, anchors, atol=30.0)


def test_common_factor_is_confounded_with_the_camera():
    frame, _ = simulated.cables(4, rows=60)
    frame[["x_m", "y_m"]] *= 1.02
    verdict = cables.study(frame, SECTION, "mine")["real_verdicts"].iloc[0]
    assert verdict["effects"] == "drum_radius" and verdict["where"] == "all drums by one factor"
    assert "camera_scale" in verdict["confounded_with"] and "rule" in verdict["next_runs"]


def test_degrees_and_millimetres():
    frame, _ = simulated.cables(5)
    other = frame.assign(x_m=1000.0 * frame["x_m"], y_m=1000.0 * frame["y_m"])
    for drum in ("drum1_rad", "drum2_rad", "drum3_rad"):
        other[drum] = np.degrees(frame[drum])
    found = cables.study(other, SECTION | {"unit": "mm", "angle_unit": "deg"}, "mine")
    expected = cables.study(frame, SECTION, "mine")
    np.testing.assert_allclose(_value(found, "a1_x"), _value(expected, "a1_x"), rtol=1e-5)


@refusals("change", "message")
def test_wrong_section_is_refused(change, message):
    frame, _ = simulated.cables(0)
    with pytest.raises(ConfigError) as error:
        cables.study(frame, SECTION | change, "mine")
    assert message in str(error.value) and "real.sets.mine" in str(error.value)


def test_drums_that_take_up_more_than_the_way_are_refused():
    frame, _ = simulated.cables(5)
    for drum in ("drum1_rad", "drum2_rad", "drum3_rad"):
        turned = frame.assign(**{drum: np.degrees(frame[drum])})
        with pytest.raises(ConfigError, match=rf"mine\.angle_unit: got 'rad, {drum} winds .* times"):
            cables.study(turned, SECTION, "mine")
    with pytest.raises(ConfigError, match="check angle_unit, unit, radius_mm"):
        cables.study(frame, SECTION | {"unit": "mm"}, "mine")


def test_wrong_readings_are_refused():
    frame, _ = simulated.cables(0)
    with pytest.raises(IngestError, match="column drum2_rad: got no such column"):
        cables.study(frame.drop(columns="drum2_rad"), SECTION, "mine")
    with pytest.raises(IngestError, match="3 rows; allowed: at least 4"):
        cables.study(frame.head(3), SECTION, "mine")
    with pytest.raises(IngestError, match="row 3, column x_m: got 'left'"):
        broken = frame.astype(object)
        broken.loc[2, "x_m"] = "left"
        cables.study(broken, SECTION, "mine")


def test_measured_robot():
    """The reference fits of the data's README: rms of the three cables, radii and anchors."""
    frame = simulated.measured("planar_cables/poses.csv")
    section = SECTION | {"row": "pose"}
    case, _, _ = cables.cable_case(frame, Section(section, "kamal", cables._NEEDED, cables._OPTIONAL))
    expected = {(): (2.06, 1.76, 2.36), case.effect_models["drum_radius"][-1:]: (1.15, 1.49, 1.53)}
    for effect_models, rms_mm in expected.items():
        model = case.model(effect_models)
        fit = fit_lengths(model, case.starts(model), np.ones((16, 3), dtype=bool))
        np.testing.assert_allclose(np.sqrt((fit.residual_mm**2).mean(axis=0)), rms_mm, atol=0.006)
    tables = cables.study(frame, section, "kamal")
    for drum, radius, error in (("drum1", 25.17, 0.28), ("drum2", 34.95, 0.28), ("drum3", 35.32, 0.32)):
        assert _value(tables, f"{drum}_radius") == pytest.approx(radius, abs=0.006)
        assert _value(tables, f"{drum}_radius", "standard_error") == pytest.approx(error, abs=0.006)
    verdict = tables["real_verdicts"].iloc[0]
    assert "16 poses do not determine which radius has an error" in verdict["notes"]
    assert verdict["effects"].startswith("drum_radius") and verdict["where"] == ""
