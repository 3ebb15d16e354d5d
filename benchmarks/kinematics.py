"""Kinematics of the general model compared with robotics libraries: an arm of six axes, a hexapod.

The arm: pose and Jacobian (6 x 6) of a UR10's standard DH rows, of 1000 joint vectors; the hexapod: lengths of its six
legs at 1000 poses. Libraries that take many at once are given them at once, on one thread; the others a loop.
"""

import mujoco
import numpy as np
import pinocchio as pin
import yaml
from mujoco.batch import Batch
from pybotics.kinematic_chain import MDHKinematicChain
from pybotics.robot import Robot as PyboticsRobot
from roboticstoolbox import DHRobot, RevoluteDH
from scipy.spatial.transform import Rotation

from benchmarks import harness
from benchmarks.harness import RESULTS, Call, Task
from rrru.robots.catalogue import make_mechanism
from rrru.robots.hexapod import hexapod

_COUNT, _SAME_MM = 1000, 1e-8
_ARM, _LEGS = "pose and Jacobian of a 6-axis arm", "inverse of a hexapod"
_POSITION = int(mujoco.mjtStage.mjSTAGE_POS)
_NONE = "no closed loops; its inverse is of open chains"


def _section():
    """The UR10 of the configuration."""
    return yaml.safe_load((RESULTS.parent / "config.yaml").read_text())["robots"]["ur10"]


def ur10():
    """The UR10 as a robot of the general model."""
    return make_mechanism("ur10", _section(), parameter_set="full")


def _rows():
    """DH rows (6, 4) of a, alpha, d, theta of the UR10, in m and rad."""
    section = _section()
    lengths = [[1e-3 * row.get(key, 0.0) for key in ("a_mm", "d_mm")] for row in section["dh"]]
    angles = [np.radians([row.get(key, 0.0) for key in ("alpha_deg", "theta_deg")]) for row in section["dh"]]
    return np.array([(a, alpha, d, theta) for (a, d), (alpha, theta) in zip(lengths, angles, strict=True)])


def _behind(a, alpha, d, theta):
    """Placement (4, 4) of a standard row at joint angle zero."""
    result = np.eye(4)
    result[:3, :3] = (Rotation.from_euler("z", theta) * Rotation.from_euler("x", alpha)).as_matrix()
    result[:3, 3] = a * np.cos(theta), a * np.sin(theta), d
    return result


class Arm:
    """Every library's arm of the same rows: each method takes q (n, 6) to places (n, 3) in m, Jacobians (n, 6, 6)."""

    def __init__(self):
        self.rows, self.robot = _rows(), ur10()
        self.seats = [np.eye(4), *(_behind(*row) for row in self.rows)]
        a, alpha, d, theta = self.rows.T
        self.toolbox = DHRobot([RevoluteDH(a=r[0], alpha=r[1], d=r[2], offset=r[3]) for r in self.rows])
        self.ets = self.toolbox.ets()
        shifted = np.column_stack([np.r_[0.0, alpha[:-1]], np.r_[0.0, a[:-1]], theta, d])
        self.pybotics = PyboticsRobot(MDHKinematicChain.from_parameters(shifted))
        self.pybotics.tool.matrix = _behind(a[-1], alpha[-1], 0.0, 0.0)
        self.model, self.frame = _pinocchio(self.seats)
        self.pin_data, self.mujoco = self.model.createData(), mujoco.MjModel.from_xml_string(_mjcf(self.seats))
        self.data, self.batch = mujoco.MjData(self.mujoco), Batch(self.mujoco, _COUNT, nthread=1)

    def by_rrru(self, q):
        """The general model."""
        robot = self.robot
        at = robot.map(q, robot.solve(q, robot.guess(q)))
        jacobian = np.concatenate([1e-3 * at.drive_response, at.turn @ at.drive_counts], axis=1)
        return 1e-3 * at.point_mm, jacobian

    def by_numpy(self, q):
        """Matrices of all poses at once, written out."""
        frame, axes, places = np.broadcast_to(np.eye(4), (len(q), 4, 4)), [], []
        for number, seat in enumerate(self.seats[1:]):
            axes.append(frame[:, :3, 2])
            places.append(frame[:, :3, 3])
            turn = np.tile(np.eye(4), (len(q), 1, 1))
            cosine, sine = np.cos(q[:, number]), np.sin(q[:, number])
            turn[:, 0, 0], turn[:, 0, 1], turn[:, 1, 0], turn[:, 1, 1] = cosine, -sine, sine, cosine
            frame = frame @ turn @ seat
        return _with_jacobian(frame[:, :3, 3], np.stack(axes, axis=1), np.stack(places, axis=1))

    def by_toolbox(self, q):
        """The toolbox: its compiled elementary transforms, poses at once, Jacobians in a loop."""
        poses = self.ets.eval(q)
        return poses[:, :3, 3], np.array([self.ets.jacob0(one) for one in q])

    def by_pybotics(self, q):
        """The link matrices of pybotics, in a loop."""
        pairs = [(self.pybotics.fk(one)[:3, 3], self.pybotics.jacobian_world(one)) for one in q]
        return tuple(map(np.array, zip(*pairs, strict=True)))

    def by_mujoco(self, q):
        """MuJoCo's functions in a loop."""
        place, jacobian = np.empty((len(q), 3)), np.empty((len(q), 6, 6))
        site = self.data.site("tool")
        for k, one in enumerate(q):
            self.data.qpos[:] = one
            mujoco.mj_kinematics(self.mujoco, self.data)
            mujoco.mj_comPos(self.mujoco, self.data)
            mujoco.mj_jacSite(self.mujoco, self.data, jacobian[k, :3], jacobian[k, 3:], 0)
            place[k] = site.xpos
        return place, jacobian

    def by_batch(self, q):
        """MuJoCo's batch on one thread, axes and places of the joints crossed by NumPy."""
        parts = [self.batch.bind(name) for name in ("site_xpos", "xaxis", "xanchor")]
        self.batch.bind("qpos")[:] = q
        self.batch.forward(stage=_POSITION)
        return _with_jacobian(parts[0][:, 0], *parts[1:])

    def by_pinocchio(self, q):
        """Pinocchio in a loop."""
        place, jacobian = np.empty((len(q), 3)), np.empty((len(q), 6, 6))
        for k, one in enumerate(q):
            jacobian[k] = pin.computeFrameJacobian(
                self.model, self.pin_data, one, self.frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
            )
            place[k] = self.pin_data.oMf[self.frame].translation
        return place, jacobian


def _with_jacobian(place, axes, places):
    """Places (n, 3) and Jacobians (n, 6, 6) of axes (n, 6, 3) through places (n, 6, 3)."""
    moving = np.cross(axes, place[:, None] - places)
    return place, np.concatenate([moving, axes], axis=2).transpose(0, 2, 1)


def _pinocchio(seats):
    """Pinocchio's model of joints about z, each behind the seat before it, and the number of the tool's frame."""
    model, parent = pin.Model(), 0
    for number, seat in enumerate(seats[:-1]):
        parent = model.addJoint(parent, pin.JointModelRZ(), pin.SE3(seat), f"q{number + 1}")
    frame = pin.Frame("tool", parent, 0, pin.SE3(seats[-1]), pin.FrameType.OP_FRAME)
    return model, model.addFrame(frame)


def _mjcf(seats):
    """MJCF of the same."""
    text, body = "", '<body pos="{}" quat="{}"><joint axis="0 0 1"/><geom size="0.01" mass="1"/>'
    for seat in seats[:-1]:
        text += body.format(*_pos_quat(seat))
    site = '<site name="tool" pos="{}" quat="{}"/>'.format(*_pos_quat(seats[-1]))
    inside = text + site + "</body>" * (len(seats) - 1)
    return f'<mujoco><option><flag contact="disable"/></option><worldbody>{inside}</worldbody></mujoco>'


def _pos_quat(seat):
    """A placement's two attributes."""
    quat = Rotation.from_matrix(seat[:3, :3]).as_quat(scalar_first=True)
    return tuple(" ".join(repr(float(number)) for number in part) for part in (seat[:3, 3], quat))


def arm_rows():
    """Rows of the arm."""
    arm, q = Arm(), np.random.default_rng(1).uniform(-2.5, 2.5, (_COUNT, 6))
    peers = {
        "NumPy, all poses at once": arm.by_numpy,
        "roboticstoolbox-python": arm.by_toolbox,
        "pybotics": arm.by_pybotics,
        "MuJoCo, mj_kinematics + mj_jacSite": arm.by_mujoco,
        "MuJoCo, batch": arm.by_batch,
        "Pinocchio": arm.by_pinocchio,
    }
    place, jacobian = arm.by_rrru(q)
    for name, run in peers.items():
        theirs = run(q)
        assert 1e3 * np.abs(theirs[0] - place).max() < _SAME_MM, name
        assert np.abs(theirs[1] - jacobian).max() < 1e-9, name
    calls = {name: Call(lambda run=run: run(q), _COUNT) for name, run in peers.items()}
    return Task("kinematics", _ARM, _COUNT).in_turns(Call(lambda: arm.by_rrru(q), _COUNT), calls)


def _joints():
    """Joints (6, 3) of a hexapod on the base and on the platform, in mm."""
    around = np.radians([-14.0, 14.0, 106.0, 134.0, 226.0, 254.0])
    on_platform = np.radians([-50.0, 50.0, 70.0, 170.0, 190.0, 290.0])
    rings = [(260.0, around), (160.0, on_platform)]
    return [np.column_stack([r * np.cos(at), r * np.sin(at), np.zeros(6)]) for r, at in rings]


def legs(**options):
    """The hexapod as a robot of the general model."""
    return hexapod(*_joints(), 450.0, **options)


def legs_rows():
    """Rows of the hexapod."""
    base, plate = _joints()
    robot, generator = legs(), np.random.default_rng(2)
    place = robot.legs.home_mm + generator.uniform(-40.0, 40.0, (_COUNT, 3))
    rotation = Rotation.from_rotvec(generator.uniform(-0.1, 0.1, (_COUNT, 3)))
    turn, qpos = rotation.as_matrix(), np.column_stack([1e-3 * place, rotation.as_quat(scalar_first=True)])
    own = robot.inverse(place, turn=turn)
    model = mujoco.MjModel.from_xml_string(_tendons(base, plate))
    data, batch = mujoco.MjData(model), Batch(model, _COUNT, nthread=1)

    def by_numpy():
        return np.linalg.norm(place[:, None] + plate @ turn.transpose(0, 2, 1) - base, axis=2)

    def by_mujoco():
        result = np.empty((_COUNT, 6))
        for k, one in enumerate(qpos):
            data.qpos[:] = one
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)
            mujoco.mj_tendon(model, data)
            result[k] = data.ten_length
        return 1e3 * result

    def by_batch():
        lengths = batch.bind("ten_length")
        batch.bind("qpos")[:] = qpos
        batch.forward(stage=_POSITION)
        return 1e3 * lengths

    runs = {"NumPy, all poses at once": by_numpy, "MuJoCo, mj_tendon": by_mujoco, "MuJoCo, batch": by_batch}
    for name, run in runs.items():
        assert np.abs(run() - own).max() < _SAME_MM, name
    task, calls = Task("kinematics", _LEGS, _COUNT), {name: Call(run, _COUNT) for name, run in runs.items()}
    timed = task.in_turns(Call(lambda: robot.inverse(place, turn=turn), _COUNT), calls)
    return timed + [task.row(name, note=_NONE) for name in ("roboticstoolbox-python", "pybotics")]


def _tendons(base, plate):
    """MJCF of a free platform and a tendon for every leg."""
    sites = [
        "".join(f'<site name="{name}{k}" pos="{x} {y} {z}"/>' for k, (x, y, z) in enumerate(1e-3 * joints))
        for name, joints in (("b", base), ("p", plate))
    ]
    legs = "".join(f'<spatial><site site="b{k}"/><site site="p{k}"/></spatial>' for k in range(6))
    body = f'<body><freejoint/><geom size="0.1" mass="1"/>{sites[1]}</body>'
    return f"<mujoco><worldbody>{sites[0]}{body}</worldbody><tendon>{legs}</tendon></mujoco>"


if __name__ == "__main__":
    harness.store("kinematics", arm_rows() + legs_rows())
