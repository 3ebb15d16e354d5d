"""Geometric errors of an MJCF, constant and by warming up: seats of bodies and of sites. SI units."""

import numpy as np
from scipy.spatial.transform import Rotation


class Shape:
    """Writes an Edit's shifts into its compiled model."""

    def __init__(self, edit, model):
        self.edit, self.model = edit, model
        self.nominal = {
            "body": (model.body_pos.copy(), model.body_quat.copy()),
            "site": (model.site_pos.copy(), model.site_quat.copy()),
        }

    def write(self, share, seconds):
        """Write a share of the shifts, and the growth after a time."""
        model, warm = self.model, -np.expm1(-seconds / (self.edit.warming_s or np.inf))
        for array, nominal in zip((model.body_pos, model.body_quat), self.nominal["body"], strict=True):
            array[:] = nominal
        for array, nominal in zip((model.site_pos, model.site_quat), self.nominal["site"], strict=True):
            array[:] = nominal
        for part, places in ((share, self.edit.shifts), (warm, self.edit.grows)):
            for (kind, name, direction), size in places.items():
                self._move(getattr(model, kind)(self.edit.prefix + name), direction, part * size)
        for seat, pin in self.edit.seats.items():
            at = model.site(self.edit.prefix + pin)
            body = model.body(at.bodyid[0])
            model.site(self.edit.prefix + seat).pos = body.pos + _turn(body.quat).apply(at.pos)

    def _move(self, element, direction, size):
        """Shift a body's or site's seat, or turn it, in the frame of what carries it."""
        axis = np.eye(3)[direction % 3]
        if direction < 3:
            element.pos += size * axis
        else:
            turned = Rotation.from_rotvec(size * axis) * _turn(element.quat)
            element.quat = turned.as_quat(scalar_first=True)


def _turn(quat):
    """Rotation of MuJoCo's quaternion."""
    return Rotation.from_quat(quat, scalar_first=True)
