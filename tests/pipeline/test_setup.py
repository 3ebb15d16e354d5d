"""Virtual campaigns from their parts."""

from dataclasses import replace

import numpy as np

from rrru.campaign.plan import make_plan
from rrru.campaign.trajectories import from_config
from rrru.pipeline.setup import VirtualCampaign
from rrru.robots.catalogue import make_mechanism
from rrru.simulation.tracker import Sees
from rrru.simulation.virtual_robot import VirtualRobot

_LINE = {
    "lines": {"start_mm": [-300.0, 0.0, 650.0], "end_mm": [0.0, 0.0, 650.0], "offsets_y_mm": [0.0], "points": 5},
}
_PLAN = make_plan(from_config(_LINE), [{"reverse": False, "payload_kg": 0.0}], 80.0, 40.0, 60.0)
_SEES = Sees({"ball a": (60.0, 0.0, 40.0), "ball b": (-30.0, 50.0, 45.0)}, 1e-4)
_COLUMNS = ["theta1_rad", "theta2_rad", "theta3_rad"]


def test_a_campaign_with_drive_values_of_its_own_reads_all_that_its_tracker_sees():
    plain = VirtualCampaign(VirtualRobot(make_mechanism("rrru3", {})), _PLAN, 0.01, 7, "line", sees=_SEES)
    expected, truth = plain.run()
    same, same_truth = replace(plain, drive=lambda wanted: wanted).run()
    assert {"target", "target_x_mm", "measured_rz_rad"} <= set(same) and len(same) == 10
    assert same.equals(expected) and same_truth.equals(truth)
    # the table has the values that the controller wants, the robot is where those sent take it
    shifted, _ = replace(plain, drive=lambda wanted: wanted + 1e-3).run()
    np.testing.assert_array_equal(shifted[_COLUMNS], expected[_COLUMNS])
    off = (shifted["measured_z_mm"] - expected["measured_z_mm"]).abs()
    assert off.min() > 0.1
