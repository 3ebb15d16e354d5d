"""Effects by name: those of the library, user-defined ones, and refusals."""

import sys

import numpy as np
import pytest

from rrru.effects.library import NAMES, active_effects, find, library
from rrru.errors import ConfigError
from rrru.robots.delta import Delta
from rrru.robots.ptt3 import Ptt3
from rrru.simulation.virtual_robot import VirtualRobot
from tests.effects.robots import EFFECTS, FORWARD, ROBOT, drive, drive_error, plan_of
from tests.refusals import refusals

_OWN = """
import numpy as np
from rrru.effects.protocol import Contribution, plain_coordinates
from rrru.parameters import Parameter, ParameterSet

class Creep:
    name = "creep"
    parameters = ParameterSet((Parameter("rate2", "rad/s", 0.0, 0.0, 1e-4, "seen once", leg=2),))

    def contribute(self, motion, values):
        return motion.at_drives(values[0] * motion.time_s[:, None] * np.array([0.0, 1.0, 0.0]))

class Full(Creep):
    name = "full"
    coordinates = plain_coordinates(Creep.parameters, 3e-6)
    needs = ("time_s",)

class Everywhere(Creep):
    name = "everywhere"
    def contribute(self, motion, values):
        return Contribution([values[0], 0.0, 0.0, 0.0, 0.0, 0.0])

class Crooked(Creep):
    def contribute(self, motion, values):
        return Contribution(np.zeros((3, 4)))

class Silent(Creep):
    def contribute(self, motion, values):
        return 1.0

class Usurper(Creep):
    name = "backlash"

class Weight(Creep):
    name = "weight"

class Nothing(Creep):
    name = "none"

class Calibration(Creep):
    name = "calibration"

class Two(Creep):
    name = "backlash+creep"

class Hasty(Creep):
    needs = ("tme_s",)

class Text(Creep):
    needs = "time_s"

class Boundless(Creep):
    name = "boundless"
    parameters = ParameterSet((Parameter("rate", "rad/s"),))

class Numbers(Creep):
    parameters = (1.0, 2.0)

class Choosy(Creep):
    def __init__(self, what):
        self.what = what

made = Creep()
half = type("Half", (), {"name": "half"})()
"""


@pytest.fixture(autouse=True)
def own(tmp_path, monkeypatch):
    """A folder with a user's module, as the working directory; the imports are undone afterwards."""
    (tmp_path / "own_effects.py").write_text(_OWN)
    (tmp_path / "broken_effects.py").write_text("import nothing_of_this_name\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    yield
    for name in ("own_effects", "broken_effects"):
        sys.modules.pop(name, None)


def test_a_library_name_finds_the_librarys_effect():
    for robot in (ROBOT, Ptt3(), Delta()):
        effects = library(robot)
        assert set(effects) < set(NAMES)
        for name in NAMES:
            found = find(name, robot)
            assert (found is not None) == (name in effects)
            if found is not None:
                assert found.name == name and list(found.parameters) == list(effects[name].parameters)


@pytest.mark.parametrize("name", ["own_effects:Creep", "own_effects:made"])
def test_ten_lines_of_ones_own_drive_the_virtual_robot(name):
    motion, position, _ = drive({name: {"rate2": 1e-5}}, plan_of(FORWARD))
    np.testing.assert_allclose(
        drive_error(motion, position), np.outer(1e-5 * motion.time_s, [0.0, 1.0, 0.0]), atol=1e-10
    )


def test_what_a_users_effect_leaves_out_is_filled_in():
    effect = find("own_effects:Creep", ROBOT)
    assert effect.name == "creep" and effect.needs == ()
    assert effect.coordinates.typical == pytest.approx([1e-5]) and effect.coordinates.legs.tolist() == [2]
    assert effect.coordinates.positive.all() and effect.coordinates.to_values([2e-5], {}).tolist() == [2e-5]
    full = find("own_effects:Full", ROBOT)
    assert full.needs == ("time_s",) and full.coordinates.typical.tolist() == [3e-6]


def test_a_users_contribution_gets_its_full_shape():
    motion = VirtualRobot().motion(plan_of(FORWARD), ROBOT.inverse)
    result = find("own_effects:Everywhere", ROBOT).contribute(motion, np.array([1e-5]))
    assert result.twists.shape == (len(motion), 26, 6)
    assert (result.twists[..., 0] == 1e-5).all() and not result.twists[..., 1:].any()
    for name, message in (
        ("Crooked", r"twists have the shape \(3, 4\); allowed: \(60, 26, 6\)"),
        ("Silent", "gave a float"),
    ):
        with pytest.raises(ConfigError, match=message):
            find(f"own_effects:{name}", ROBOT).contribute(motion, np.array([1e-5]))


@refusals("name", "message")
def test_what_is_no_effect_is_refused_by_its_name(name, message):
    with pytest.raises(ConfigError, match=message):
        find(name, ROBOT)


@pytest.mark.parametrize("name", EFFECTS)
def test_values_out_of_bounds_and_unknown_parameters_are_refused(name):
    effect = EFFECTS[name]
    for parameter in effect.parameters:
        for value in (parameter.low - 0.01 * (parameter.high - parameter.low), 1.01 * parameter.high, float("nan")):
            with pytest.raises(ConfigError, match=f"effect {name}: {parameter.name} is .*allowed: "):
                active_effects({name: {parameter.name: value}}, ROBOT)
        active_effects({name: {parameter.name: parameter.high}}, ROBOT)
    with pytest.raises(ConfigError, match="unknown parameter 'strength'; known: "):
        active_effects({name: {"strength": 0.0}}, ROBOT)
    with pytest.raises(ConfigError, match=r"rate2 is 1\.0 rad/s; allowed: 0\.0 to 0\.0001"):
        active_effects({"own_effects:Creep": {"rate2": 1.0}}, ROBOT)


def test_no_effects_at_all_leave_the_robot_ideal():
    plan = plan_of(FORWARD)
    for section in (None, {}):
        assert active_effects(section, ROBOT) == ()
    _, position, _ = drive({}, plan)
    np.testing.assert_allclose(
        position, ROBOT.forward(ROBOT.inverse(plan.targets()), guess_mm=plan.targets()), atol=1e-8
    )


def test_a_law_that_fails_is_named_in_the_error(tmp_path, monkeypatch):
    (tmp_path / "broken_law.py").write_text(
        "from rrru.parameters import Parameter, ParameterSet\n"
        "class Broken:\n"
        "    name = 'broken'\n"
        "    parameters = ParameterSet((Parameter('size', 'mm', 0.0, 0.0, 1.0),))\n"
        "    def contribute(self, motion, values):\n"
        "        return motion.speeds\n"
    )
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(ConfigError, match="'broken_law:Broken': contribute failed with AttributeError"):
        find("broken_law:Broken", ROBOT).contribute(object(), [0.0])
