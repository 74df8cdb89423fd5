"""Types of arrays: numbers, indices and flags; and where a peak is."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.intp]
Flags = NDArray[np.bool_]

SAME_PEAK: Final = 1e-5  # [-] of a peak, which rounding may take from any row of a plateau: others on each processor


def first_peak(values: Array) -> int:
    """Index of the first value that is the largest up to rounding, of values of shape (N,), none below 0."""
    return int(np.argmax(values >= (1.0 - SAME_PEAK) * values.max()))
