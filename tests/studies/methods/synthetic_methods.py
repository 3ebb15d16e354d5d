"""Made-up tables of the comparison of methods, for drawing them without learning anything."""

import pandas as pd

from tests.schemas import filled

_METHODS = (
    "zero_offsets",
    "least_squares",
    "least_squares_full",
    "genetic",
    "rbf_map",
    "rbf_after_parameters",
    "jacobian_step",
)
_OF = {
    "rrru3": tuple(name for name in _METHODS if name != "least_squares_full"),
    "ptt3": _METHODS,
    "delta": (*_METHODS, "zero_offsets_images"),
}


def method_tables():
    """`methods` and `method_points` of three robots: errors that fall with the points, larger outside."""
    rows = []
    for scale, (robot, methods) in zip((1.0, 0.05, 0.3), _OF.items(), strict=True):
        for place, method in enumerate(methods):
            for points in (60,) if method == "jacobian_step" else (20,) if method.endswith("images") else (10, 40, 160):
                for test, worse in (("inside", 1.0), ("outside", 1.8)):
                    after = scale * worse * (0.3 / (1 + place) + 1.0 / points)
                    sizes = {
                        "before_mean_mm": 3.0 * scale,
                        "before_max_mm": 5.0 * scale,
                        "after_mean_mm": after,
                        "after_max_mm": 3.0 * after,
                    }
                    rows.append({"robot": robot, "method": method, "test": test, "points": points} | sizes)
    curve = pd.DataFrame(rows)
    last = curve.loc[curve.groupby(["robot", "method", "test"])["points"].idxmax()].reset_index(drop=True)
    return {"methods": filled("methods", last), "method_points": filled("method_points", curve)}
