"""Short names for the types of arrays."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

Reals = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Integers = NDArray[np.int64]
Flags = NDArray[np.bool_]
Singles = NDArray[np.float32]
Words = NDArray[np.uint64]

Number = TypeVar("Number", bound=np.generic)


def for_kernel(array: NDArray[Number]) -> NDArray[Number]:
    """A contiguous view that can't be written to: kernels are compiled anew for each layout and for arrays that can."""
    view = np.ascontiguousarray(array).view()
    view.setflags(write=False)
    return view
