"""Drive compliance without masses: what the masses of an arm do to its drives lies in the space of the effect."""

from dataclasses import replace

import numpy as np
import pytest

from rrru.diagnosis.make_problem import make_diagnosis_problem
from rrru.effects.library import find
from rrru.kinematics.point_masses import PointMass
from rrru.robots.rrru3 import Rrru3
from tests.diagnosis import arms

_COUNT = 90
_MASSLESS = replace(arms.ARM, point_masses=())


def _motion(robot):
    frame = arms.commands(arms.drives(_COUNT, np.random.default_rng(3)))
    frame = frame.assign(payload_kg=0.0, **{f"measured_{axis}_mm": frame[f"command_{axis}_mm"] for axis in "xyz"})
    return make_diagnosis_problem(frame, robot, arms.MASSES, 1.0, {}).motion


def test_only_arms_whose_links_have_no_masses_have_the_parameters():
    of_masses, lacking = (find("drive_compliance", robot) for robot in (arms.ARM, _MASSLESS))
    assert len(of_masses.parameters) == 6 and of_masses.needs == ("drive_load",)
    assert len(lacking.parameters) > 6 and not lacking.needs
    assert set(of_masses.parameters.names) < set(lacking.parameters.names)
    assert find("drive_compliance", Rrru3()).parameters.names == ("compliance1", "compliance2", "compliance3")


@pytest.mark.parametrize("seed", range(4))
def test_every_distribution_of_masses_is_held(seed):
    """Torques by virtual work of point masses anywhere in the links, which the effect knows nothing of."""
    generator = np.random.default_rng(seed)
    joints = [joint.name for joint in arms.ARM.legs.joints if joint.drive is not None]
    masses = tuple(PointMass(name, generator.uniform(0.5, 9.0), generator.uniform(-200.0, 200.0, 3)) for name in joints)
    load = _motion(replace(arms.ARM, point_masses=masses)).drive_load
    functions = find("drive_compliance", _MASSLESS).along_drives(_motion(_MASSLESS))
    # no payload, so that the compliance's own column is zero
    assert not any(f[:, 0].any() for f in functions)
    functions = [f[:, 1:] for f in functions]
    assert [f.shape[1] > 0 for f in functions] == [False, True, True, True, True, True]
    for drive, f in enumerate(functions):
        if not f.shape[1]:
            # an upright axis carries no moment
            np.testing.assert_allclose(load[:, drive], 0.0, atol=1e-3 * np.abs(load).max())
            continue
        left = load[:, drive] - f @ np.linalg.lstsq(f, load[:, drive], rcond=None)[0]
        assert np.abs(left).max() < 1e-5 * np.abs(load).max()
        # no column that the others replace
        assert np.linalg.matrix_rank(f) == f.shape[1]


def test_the_functions_are_the_contribution():
    effect, motion = find("drive_compliance", _MASSLESS), _motion(_MASSLESS)
    values = np.random.default_rng(5).normal(0.0, 1e-4, len(effect.parameters))
    ends = np.cumsum([f.shape[1] for f in effect.along_drives(motion)])[:-1]
    parts = zip(effect.along_drives(motion), np.split(values, ends), strict=True)
    expected = motion.at_drives(np.stack([f @ part for f, part in parts], axis=1)).twists
    np.testing.assert_array_equal(effect.contribute(motion, values).twists, expected)
    assert [p.leg for p in effect.parameters] == sorted(p.leg for p in effect.parameters)
