"""Types of arrays by the kind of their numbers; docstrings state the shapes."""

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]
# numbers of rows, or which rows
Rows = IntArray | BoolArray
