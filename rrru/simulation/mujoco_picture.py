"""The round bars and discs that an MJCF's bodies are made of, at home, for a picture of it."""

from pathlib import Path

import mujoco
import numpy as np
import pandas as pd

from rrru.simulation.mujoco_model import MM, home_qpos

_ROUND = {int(mujoco.mjtGeom.mjGEOM_CAPSULE), int(mujoco.mjtGeom.mjGEOM_CYLINDER)}


def solids(file: str | Path) -> pd.DataFrame:
    """Frame of the capsules and cylinders of an MJCF in its home pose: model, both ends and radius in mm, colour.

    Turned over where the file's z points down.
    """
    model = mujoco.MjModel.from_xml_path(str(file))
    data = mujoco.MjData(model)
    data.qpos[:] = home_qpos(model)
    mujoco.mj_kinematics(model, data)
    over = np.array([1.0, -1.0, -1.0]) if model.opt.gravity[2] > 0.0 else np.ones(3)
    rows = []
    for geom in [k for k in range(model.ngeom) if int(model.geom_type[k]) in _ROUND]:
        half = data.geom_xmat[geom].reshape(3, 3)[:, 2] * model.geom_size[geom, 1]
        ends = [MM * over * (data.geom_xpos[geom] + side * half) for side in (-1.0, 1.0)]
        named = [(f"{axis}{number}_mm", end["xyz".index(axis)]) for number, end in enumerate(ends, 1) for axis in "xyz"]
        colour = "#" + "".join(f"{round(255 * part):02x}" for part in model.geom_rgba[geom, :3])
        rows.append(
            {"model": Path(file).stem, **dict(named), "radius_mm": MM * model.geom_size[geom, 0], "colour": colour}
        )
    return pd.DataFrame(rows)
