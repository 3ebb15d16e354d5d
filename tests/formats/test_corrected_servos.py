"""Drives in corrected files: compliance and lost motion as found; what a file cannot represent is reported."""

from itertools import pairwise

import mujoco
import numpy as np
import pytest

from rrru.errors import ConfigError
from rrru.formats.file_changes import Found
from rrru.formats.mjcf_reader import backlash_joints
from rrru.formats.mjcf_writer import to_mjcf
from rrru.formats.robot_file import from_mjcf
from rrru.formats.urdf_writer import to_urdf
from rrru.kinematics.point_masses import driven_loads
from tests.formats.mjcf import ARM, GEOM, HEXAPOD, file_of, mjcf, servos


def test_a_servo_deflects_by_its_load_over_the_stiffness_found(tmp_path):
    robot = from_mjcf(HEXAPOD, "plate")
    softness = np.array([1.0, 2.0, 1.5, 0.8, 1.2, 0.5]) * 1e-3
    found = Found({}, compliance={k: (one, 1e-5) for k, one in enumerate(softness)})
    path = file_of(tmp_path, to_mjcf(HEXAPOD, "plate", found, tmp_path)[0], "corrected.xml")
    model = mujoco.MjModel.from_xml_path(str(path))
    np.testing.assert_allclose(model.actuator_gainprm[:, 0], 1e3 / softness)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_step(model, data, 6000)
    legs, still = np.array([[1000.0 * data.joint(f"leg{k}").qpos[0] for k in range(1, 7)]]), np.zeros((1, 6))
    poses = robot.solve(legs, robot.legs.home_mm[None])
    load = driven_loads(robot, (legs, still, still), poses, np.array([0.0, 0.0, -9810.0]))
    np.testing.assert_allclose(legs[0], softness * load[0], rtol=2e-3)


_CRANK = (
    f'<body name="crank"><joint name="crank" axis="0 1 0"/>{GEOM}<body name="tip" pos="0.2 0 0">{GEOM}</body></body>'
)


_LOAD = 1000.0 * 9.81 * 0.3 * 0.2


# an upright axis carries nothing, and its arm must not swing on
@pytest.mark.parametrize(
    ("kp", "friction_alone", "axis", "load"),
    [(2e4, False, "0 1 0", _LOAD), (1e3, True, "0 1 0", _LOAD), (2e4, False, "0 0 1", 0.0)],
)
def test_a_drive_turns_back_by_its_lost_motion_before_the_arm_does(tmp_path, kp, friction_alone, axis, load):
    """Between limits or by friction alone, against gravity: both ends of a slow swing are apart by the width found."""
    option = '<option timestep="0.0002" integrator="implicitfast"/>'
    actuator = f'<position joint="crank" kp="{kp}" kv="{20 if friction_alone else 60}"/>'
    file = mjcf(tmp_path, _CRANK.replace("0 1 0", axis), actuators=actuator, more=option)
    found = Found({}, play={0: (1e-3, 1e-5)}, loads={0: load})
    path = file_of(tmp_path, to_mjcf(file, "tip", found, tmp_path)[0], "corrected.xml")
    model = mujoco.MjModel.from_xml_path(str(path))
    assert bool(len(backlash_joints(model))) is not friction_alone
    data, places = mujoco.MjData(model), []
    for start, end in pairwise((0.0, 0.02, 0.01, 0.0, 0.01)):
        for control in np.concatenate([np.linspace(start, end, 4000), np.full(2000, end)]):
            data.ctrl[:] = control
            mujoco.mj_step(model, data)
        places.append(float(data.qpos[: model.njnt].sum()))
    _, down, _, up = places
    assert down - up == pytest.approx(1e-3, rel=0.03)


def test_what_the_files_cannot_hold_is_said(tmp_path):
    both = {"compliance": {1: (1e-8, 1e-9)}, "play": {4: (1e-4, 1e-6)}}
    assert to_urdf(ARM, Found({}, **both), tmp_path)[1] == ("compliance of axis2", "backlash of axis5")
    file = mjcf(tmp_path, _CRANK, actuators='<motor joint="crank"/>')
    assert to_mjcf(file, "tip", Found({}, compliance={0: (1e-8, 1e-9)}), tmp_path)[1] == (
        "compliance of crank: it has 0 position servos, not one",
    )
    file = mjcf(tmp_path, f"<frame>{_CRANK}</frame>", actuators=servos("crank"))
    with pytest.raises(ConfigError, match=r"robot\.xml: it has <frame>; allowed .* bodies written out"):
        to_mjcf(file, "tip", Found({}), tmp_path)
