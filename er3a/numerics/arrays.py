"""Arrays: short names for their types, numbers as floats, how kernels take them, stretches of True in them."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from er3a.errors import PoseError
from er3a.numerics.jit import inner_kernel

Reals = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Integers = NDArray[np.int64]
Flags = NDArray[np.bool_]
Singles = NDArray[np.float32]
Words = NDArray[np.uint64]

Number = TypeVar("Number", bound=np.generic)
FLOAT = np.dtype(float)


def for_kernel(array: NDArray[Number]) -> NDArray[Number]:
    """A contiguous view that can't be written to, as all kernels here take their arrays.

    Parameters
    ----------
    array : any shape and type; it is copied only if it is not contiguous

    Returns
    -------
    view : same shape and type, read-only

    Notes
    -----
    numba compiles a kernel anew for each layout, and for arrays that can be written to. One form for all saves this.
    """
    view = np.ascontiguousarray(array).view()
    view.setflags(write=False)
    return view


@inner_kernel
def copy_values(source: Reals, target: Reals) -> None:
    """Fill a row with the values of another, element by element. Kernel.

    Parameters
    ----------
    source : (n,) at least
    target : (n,), filled

    Notes
    -----
    A slice would be shorter, but numba compiles 2.5 s for the error that one of another length would raise.
    """
    for i in range(target.shape[0]):
        target[i] = source[i]


def as_floats(values: Reals, argument: str) -> Reals:
    """Values as an array of floats; a float array is returned without a copy.

    Parameters
    ----------
    values : anything array-like
    argument : name of the argument in the caller, for the message

    Returns
    -------
    array : float64, same shape

    Raises
    ------
    PoseError
        if some values are no real numbers, or rows differ in length
    """
    try:
        array = np.asarray(values)
        if array.dtype is FLOAT:  # what most callers give
            return array
        if array.dtype.kind == "c":
            raise TypeError
        return array.astype(float, copy=False)
    except (TypeError, ValueError):
        raise PoseError(f"{argument} holds something that is no real number, or rows that differ in length") from None


def zeros_of(polynomials: Reals | Complexes) -> Complexes:
    """Zeros of polynomials of one degree: the eigenvalues of their companion matrices.

    Parameters
    ----------
    polynomials : (N, n + 1), coefficients in ascending order; none of the last is 0

    Returns
    -------
    zeros : (N, n), in no order
    """
    count, degree = len(polynomials), polynomials.shape[1] - 1
    companion = np.zeros((count, degree, degree), dtype=polynomials.dtype)
    companion[:, np.arange(1, degree), np.arange(degree - 1)] = 1.0
    companion[:, :, -1] = -polynomials[:, :-1] / polynomials[:, -1:]
    return np.asarray(np.linalg.eigvals(companion))


def runs(flags: Flags) -> list[tuple[int, int]]:
    """Stretches of True in a row of flags.

    Parameters
    ----------
    flags : (N,)

    Returns
    -------
    runs : index ranges (first, after the last) in order; adjacent ones are separated by at least one False
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int)))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]
