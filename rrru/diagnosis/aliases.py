"""Names of types that several modules of the diagnosis have in common."""

from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from rrru.arrays import FloatArray, IntArray

ObjectArray: TypeAlias = npt.NDArray[np.object_]

# an effect in one of its shapes: its name, and the shape's number
EffectKey: TypeAlias = tuple[str, int]
# causes that act together, and whether something is unexplained in addition
CauseSet: TypeAlias = tuple[frozenset[str], bool]
# a nuisance parameter of payload or tilt: name, value, stepped value, prior mean in steps
WeightStep: TypeAlias = tuple[str, float, float, float]
# from numbers (k,) of columns to their Gram matrices (levels, k, k) and moments (levels, k)
Grams: TypeAlias = Callable[[IntArray], tuple[FloatArray, FloatArray]]
# a row of a table by its columns, whose kinds `rrru.diagnosis.schemas` has
Row: TypeAlias = dict[str, Any]
# facts as `rrru/pipeline/verdict.schema.yaml` has them
Facts: TypeAlias = Mapping[str, Any]
