"""Robot calibration, and diagnosis of the errors that remain after it.

    import rrru

    robot = rrru.load_robot("arm.urdf", tip="tool0")
    campaign = rrru.read_campaign("run.csv", robot, noise_mm=0.03)
    diagnosis = rrru.diagnose(campaign)

The names below are the public interface; `rrru.api` has their documentation.
"""

from typing import Any

__version__ = "0.2.0"
__all__ = [
    "CalibrationResult",
    "Campaign",
    "ConfigError",
    "DiagnosisResult",
    "FitError",
    "IngestError",
    "RobotModel",
    "RrruError",
    "SimulationError",
    "UnreachableError",
    "WriteError",
    "__version__",
    "calibrate",
    "configured_campaign",
    "diagnose",
    "load_robot",
    "read_campaign",
]


def __getattr__(name: str) -> Any:
    """The public names, loaded when they are first used: NumPy, SciPy and Numba take a second."""
    import importlib

    if name not in __all__:
        raise AttributeError(f"module 'rrru' has no attribute {name!r}")
    module = "rrru.errors" if name.endswith("Error") else "rrru.api"
    return getattr(importlib.import_module(module), name)


def __dir__() -> list[str]:
    return sorted(__all__)
