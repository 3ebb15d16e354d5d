"""The robot that MuJoCo simulates: without causes it is our closure's, and what may not be recorded is an error."""

import mujoco
import numpy as np
import pytest

from rrru.errors import ConfigError, SimulationError, UnreachableError
from rrru.formats.robot_file import from_urdf
from rrru.pipeline import config as parts
from rrru.pipeline import setup
from rrru.robots.delta import Delta
from rrru.robots.rrru3 import Rrru3
from rrru.simulation import mujoco_model, mujoco_run
from rrru.simulation.mujoco_robot import MujocoRobot
from rrru.simulation.tracker import Sees
from rrru.studies.methods.regions import stops
from tests.simulation.simulated import MODELS, file_of, mechanism, near_home, on_line, simulated, standing

_AWAY = ((0.0, 0.0, 0.0), (60.0, 30.0, 20.0), (-50.0, 40.0, -30.0), (10.0, -60.0, 25.0))


def _stiffness(name):
    """Stiffness (K,) of a model's servos in N mm/rad or N/mm."""
    model = mujoco.MjModel.from_xml_path(str(file_of(name)))
    units = np.array([1e-3 if unit == "mm" else 1e3 for unit in mechanism(name).parts.units])
    return model.actuator_gainprm[:, 0] * units


@pytest.mark.parametrize("name", MODELS)
def test_without_causes_it_stands_where_our_closure_says_with_the_servos_sag(name):
    """Two programs that share no line agree to a micrometre at every point, and so do the plate's turns."""
    robot, points = simulated(name), near_home(name, *_AWAY)
    motion, position = standing(robot, points, payload_kg=2.0)
    sagged = motion.drive + motion.drive_load / _stiffness(name)
    # the load that our own statics find is the file's and the payload's
    assert np.abs(motion.drive_load).max() > 1e3 if name != "hexapod" else np.abs(motion.drive_load).max() > 10.0
    expected = robot.mechanism.forward(sagged, guess_mm=points)
    np.testing.assert_allclose(position, expected, atol=1e-3)
    assert robot.positions(motion)[1].max() < 1e-5


@pytest.mark.parametrize("name", MODELS)
def test_read_in_motion_without_a_cause_that_shows_there_it_is_on_its_path(name):
    """A lag of nothing reads at the plan's times: feedforward leaves what the servos' spring and inertia leave."""
    servo = simulated(name).mechanism.parts.columns[0].rpartition("_")[0]
    start, end = near_home(name, (-60.0, -20.0, 0.0), (60.0, 30.0, 10.0))
    motion, position = on_line(simulated(name, servo_lag={servo: 1e-9}), start, end, 7)
    assert np.abs(motion.drive_rate[3]).max() > 0.0
    np.testing.assert_allclose(position, motion.position_mm, atol=3e-3)


@pytest.mark.parametrize("name", ["rrru3", "delta"])
def test_loops_are_closed_to_less_than_a_micrometre(name, monkeypatch):
    seen = []

    def closed(machine, _where):
        seen.append(np.abs(machine.data.efc_pos[: machine.data.ne]).max())

    monkeypatch.setattr(mujoco_run.Machine, "_require_closed", closed)
    standing(simulated(name), near_home(name, *_AWAY), payload_kg=5.0)
    assert len(seen) == len(_AWAY) and max(seen) < 1e-6


@pytest.mark.parametrize(("name", "kind"), [("rrru3", Rrru3), ("delta", Delta)])
def test_models_of_built_in_robots_have_their_dimensions(name, kind):
    points = near_home(name, *_AWAY)
    np.testing.assert_allclose(mechanism(name).inverse(points), kind().inverse(points), atol=1e-9)


def test_the_arm_is_the_same_in_both_formats():
    other, points = from_urdf(file_of("arm6").with_suffix(".urdf")), near_home("arm6", *_AWAY)
    drives = mechanism("arm6").inverse(points)
    np.testing.assert_allclose(other.forward(drives), points, atol=1e-9)
    own = sorted(point_mass.mass_kg for point_mass in mechanism("arm6").point_masses)
    np.testing.assert_allclose(own, sorted(point_mass.mass_kg for point_mass in other.point_masses), rtol=1e-9)


def test_it_is_measured_as_every_virtual_robot_is():
    """Same seed, same bytes; two reflectors, orientations, and the columns of the drives."""
    robot, plan = simulated("arm6", play={"axis2": 1e-3}), stops("s", near_home("arm6", *_AWAY), 80.0, 40.0, 1.0)
    sees = Sees({"ball": (20.0, 0.0, 60.0), "nest": (-30.0, 10.0, 50.0)}, 1e-4)
    tables = [robot.run(plan, 0.02, np.random.default_rng(3), sees=sees) for _ in range(2)]
    assert tables[0][0].equals(tables[1][0]) and tables[0][1].equals(tables[1][1])
    measured, truth = tables[0]
    assert len(measured) == 2 * len(_AWAY) and set(robot.mechanism.parts.columns) <= set(measured)
    assert (measured["status"] == "ok").all() and {"target", "measured_rx_rad"} <= set(measured)
    balls = truth[[f"true_{axis}_mm" for axis in "xyz"]].to_numpy()
    apart = np.linalg.norm(balls[::2] - balls[1::2], axis=1)
    np.testing.assert_allclose(apart, np.sqrt(50.0**2 + 10.0**2 + 10.0**2), atol=1e-9)


def test_a_campaign_of_the_configuration_is_simulated():
    """Backlash of a drive that goes one way only is a constant; no true deviations are claimed for it."""
    line = {"start_mm": [590, -50, 865], "end_mm": [590, 50, 865], "offsets_y_mm": [0], "points": 4}
    config = {
        "seed": 1,
        "motion": {"speed_mm_s": 80.0, "acceleration_mm_s2": 40.0, "dwell_s": 1.0},
        "loads": {"platform_mass_kg": 3.0},
        "calibration": {"bounds": {"angle_rad": 0.02, "length_mm": 3.0}},
        "robots": {"arm": {"mjcf": str(file_of("arm6")), "platform": "tool0"}},
        "virtual_robots": {"worn": {"mujoco": {"causes": {"play": {"axis1": 1e-3}}}, "errors": {}, "effects": {}}},
        "trajectories": {"short": {"lines": line}},
        "campaigns": {"own": {"robot": "arm", "virtual": "worn", "trajectories": "short", "noise_mm": 0.0}},
    }
    parts.check(config)
    measured, _ = setup.virtual_campaign(parts.nominal(config, "own"), parts.virtual(config, "own")).run()
    sideways = (measured["measured_y_mm"] - measured["command_y_mm"]).to_numpy()
    # axis 1 is upright, 590 mm from the tool
    np.testing.assert_allclose(sideways[1:], -590.0 * 0.5e-3, rtol=0.02)
    assert parts.truth(config, "own") is None


def test_a_loop_that_is_not_closed_is_an_error_that_says_where_and_how_far(tmp_path):
    """Where bodies of a tenth of a gram are joined, the welds give by more than a micrometre."""
    text = file_of("rrru3").read_text().replace('mass="0.6"', 'mass="0.00006"').replace('mass="0.4"', 'mass="0.00004"')
    (tmp_path / "light.xml").write_text(text)
    robot = MujocoRobot(mechanism("rrru3"), tmp_path / "light.xml", "plate")
    with pytest.raises(SimulationError, match=r"light.xml: point 1 of 4: loops are open by .* mm; allowed: 0.001"):
        standing(robot, near_home("rrru3", *_AWAY), payload_kg=5.0)


def test_a_robot_that_is_not_at_rest_is_an_error_that_says_where_and_how_fast(monkeypatch):
    """Friction that holds a stretched servo lets it creep: less than the limit, but more than nothing."""
    monkeypatch.setattr(mujoco_run, "REST_MM_S", 1e-6)
    monkeypatch.setattr(mujoco_run, "_MAX_BLOCKS", 10)
    with pytest.raises(SimulationError, match=r"point \d of 4 still moves at .* mm/s after 0.1 s; allowed: less than"):
        standing(simulated("rrru3", play={"drive1": 1e-3}), near_home("rrru3", *_AWAY))


def test_drives_beyond_their_range_are_an_error():
    robot = simulated("hexapod")
    with pytest.raises(UnreachableError, match=r"leg\d is commanded to .* on its path; allowed: -0\.1 to 0\.1"):
        standing(robot, near_home("hexapod", (0.0, 0.0, 0.0), (0.0, 0.0, 115.0)))


def test_a_simulation_that_bursts_is_an_error(tmp_path, monkeypatch):
    """MuJoCo itself would begin anew at its reference configuration and write a log in the folder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(mujoco_model.Edit, "steady", lambda *_: None)
    with pytest.raises(SimulationError, match=r"point 1 of 4: the simulation has become unstable; allowed: softer"):
        standing(simulated("arm6", link_stiffness={"flange.x": 1e9}), near_home("arm6", *_AWAY))


def test_a_drive_that_is_no_position_servo_is_refused(tmp_path):
    text = file_of("arm6").read_text().replace('<position name="servo3" class="strong"', '<motor name="servo3"')
    (tmp_path / "arm.xml").write_text(text)
    robot = MujocoRobot(mechanism("arm6"), tmp_path / "arm.xml", "tool0")
    with pytest.raises(ConfigError, match=r"arm.xml: axis3 has no position actuator; allowed: <position"):
        robot.machine()
