"""The picture of the models: every solid is drawn where the file has it."""

import mujoco
import numpy as np
import pandas as pd

from rrru.figures.solids import solids as draw
from rrru.simulation.mujoco_picture import solids
from tests.simulation.simulated import MODELS, file_of


def test_every_model_is_drawn_upright():
    rows = pd.concat([solids(file_of(name)) for name in MODELS])
    figure = draw({"solids": rows}, {})
    assert [axes.get_title(loc="left") for axes in figure.axes] == list(MODELS)
    for axes, name in zip(figure.axes, MODELS, strict=True):
        assert len(axes.patches) == mujoco.MjModel.from_xml_path(str(file_of(name))).ngeom
    # z of the 3-RRRU's file points down, and its platform hangs below its drives
    own = rows[rows["model"] == "rrru3"]
    assert own.loc[own["radius_mm"] == 100.0, "z1_mm"].max() < -650.0


def test_ends_of_a_bar_are_where_its_body_is():
    row = solids(file_of("arm6")).iloc[3]
    np.testing.assert_allclose(row[["x1_mm", "z1_mm", "z2_mm"]].to_numpy(dtype=float), [60.0, 920.0, 400.0], atol=1e-9)
