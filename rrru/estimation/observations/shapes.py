"""The shape of places that were seen in an unregistered frame: displacements with sign and direction."""

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
import numpy.typing as npt
from scipy import linalg
from scipy.spatial.transform import Rotation

from rrru.cache import last_cached
from rrru.estimation.observations.distances import require_finite
from rrru.kinematics.robot import Robot

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Shape:
    """The whole shape of n places, the frame's rotation and origin free.

    mechanism, actuators (n, K), measured_mm (n, 3): as in `Distances`. The 3 n differences are projected on the 3 n - 6
    directions that no motion of the frame reaches. Raises FitError where a number is not finite.
    """

    mechanism: Robot
    actuators: FloatArray
    measured_mm: FloatArray

    # ASSUME a laser tracker on a small machine, per axis of a place; a calibration takes what the residuals show
    default_sd: ClassVar[float] = 0.02
    unit: ClassVar[str] = "mm"

    def __post_init__(self) -> None:
        require_finite(self.actuators, "actuators")
        require_finite(self.measured_mm, "measured_mm")

    def __len__(self) -> int:
        return len(self.actuators)

    @cached_property
    def _fixed_frame(self) -> FloatArray:
        """Orthonormal rows (3n - 6, 3n): small motions of the frame about the measured places do not reach them."""
        turned = np.cross(np.eye(3)[None], (self.measured_mm - self.measured_mm.mean(axis=0))[:, None])
        motions = np.concatenate([np.tile(np.eye(3), (len(self), 1, 1)), turned], axis=1)
        return np.asarray(linalg.null_space(motions.transpose(1, 0, 2).reshape(6, -1)).T)

    @last_cached
    def _aligned(self, values: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Model places (n, 3) moved onto the measured ones, the rotation (3, 3) of it and the places before."""
        places = self.mechanism.forward(self.actuators, values)
        middle = self.measured_mm.mean(axis=0)
        turn = Rotation.align_vectors(self.measured_mm - middle, places - places.mean(axis=0))[0].as_matrix()
        return (places - places.mean(axis=0)) @ turn.T + middle, turn, places

    def residual(self, values: FloatArray, /) -> FloatArray:
        """Measured minus predicted places, (3n - 6, 1) in mm, at deviations (p,)."""
        moved, _, _ = self._aligned(values)
        return (self._fixed_frame @ (self.measured_mm - moved).ravel())[:, None]

    def jacobian(self, values: FloatArray, /) -> FloatArray:
        """Derivative (3n - 6, 1, p) of the residual; the projection removes the change of the best rotation."""
        _, turn, places = self._aligned(values)
        slope = turn @ self.mechanism.parameter_jacobian(places, self.actuators, values)
        return -(self._fixed_frame @ slope.reshape(-1, slope.shape[-1]))[:, None]
