"""Six equations with a symmetric positive matrix, for many lanes at once.

Cholesky's factors written out [1]_, so that one pass over the lanes does it all: ``l_ij`` are the entries of the lower
factor, ``r_i`` the reciprocals of its diagonal.

References
----------
.. [1] G. H. Golub, C. F. Van Loan, *Matrix Computations*, 4th ed., algorithm 4.2.1.
"""

from __future__ import annotations

import numpy as np

from er3a.numerics.arrays import Reals
from er3a.numerics.jit import inner_kernel

LANES = 32
LEAST_PIVOT = 1e-15


@inner_kernel
def solve_by_cholesky(A: Reals, step: Reals) -> None:
    """Replace ``step`` (6 rows of lanes) by the solutions x of A x = step; of A (36 rows) the lower half is read."""
    for i in range(LANES):
        r_0 = 1.0 / np.sqrt(max(A[i], LEAST_PIVOT))
        l_10 = A[6 * LANES + i] * r_0
        l_20 = A[12 * LANES + i] * r_0
        l_30 = A[18 * LANES + i] * r_0
        l_40 = A[24 * LANES + i] * r_0
        l_50 = A[30 * LANES + i] * r_0
        r_1 = 1.0 / np.sqrt(max(A[7 * LANES + i] - l_10 * l_10, LEAST_PIVOT))
        l_21 = (A[13 * LANES + i] - l_20 * l_10) * r_1
        l_31 = (A[19 * LANES + i] - l_30 * l_10) * r_1
        l_41 = (A[25 * LANES + i] - l_40 * l_10) * r_1
        l_51 = (A[31 * LANES + i] - l_50 * l_10) * r_1
        r_2 = 1.0 / np.sqrt(max(A[14 * LANES + i] - l_20 * l_20 - l_21 * l_21, LEAST_PIVOT))
        l_32 = (A[20 * LANES + i] - l_30 * l_20 - l_31 * l_21) * r_2
        l_42 = (A[26 * LANES + i] - l_40 * l_20 - l_41 * l_21) * r_2
        l_52 = (A[32 * LANES + i] - l_50 * l_20 - l_51 * l_21) * r_2
        r_3 = 1.0 / np.sqrt(max(A[21 * LANES + i] - l_30 * l_30 - l_31 * l_31 - l_32 * l_32, LEAST_PIVOT))
        l_43 = (A[27 * LANES + i] - l_40 * l_30 - l_41 * l_31 - l_42 * l_32) * r_3
        l_53 = (A[33 * LANES + i] - l_50 * l_30 - l_51 * l_31 - l_52 * l_32) * r_3
        r_4 = 1.0 / np.sqrt(max(A[28 * LANES + i] - l_40 * l_40 - l_41 * l_41 - l_42 * l_42 - l_43 * l_43, LEAST_PIVOT))
        l_54 = (A[34 * LANES + i] - l_50 * l_40 - l_51 * l_41 - l_52 * l_42 - l_53 * l_43) * r_4
        r_5 = 1.0 / np.sqrt(
            max(A[35 * LANES + i] - l_50 * l_50 - l_51 * l_51 - l_52 * l_52 - l_53 * l_53 - l_54 * l_54, LEAST_PIVOT)
        )
        y_0 = step[i] * r_0
        y_1 = (step[1 * LANES + i] - l_10 * y_0) * r_1
        y_2 = (step[2 * LANES + i] - l_20 * y_0 - l_21 * y_1) * r_2
        y_3 = (step[3 * LANES + i] - l_30 * y_0 - l_31 * y_1 - l_32 * y_2) * r_3
        y_4 = (step[4 * LANES + i] - l_40 * y_0 - l_41 * y_1 - l_42 * y_2 - l_43 * y_3) * r_4
        y_5 = (step[5 * LANES + i] - l_50 * y_0 - l_51 * y_1 - l_52 * y_2 - l_53 * y_3 - l_54 * y_4) * r_5
        x_5 = y_5 * r_5
        x_4 = (y_4 - l_54 * x_5) * r_4
        x_3 = (y_3 - l_43 * x_4 - l_53 * x_5) * r_3
        x_2 = (y_2 - l_32 * x_3 - l_42 * x_4 - l_52 * x_5) * r_2
        x_1 = (y_1 - l_21 * x_2 - l_31 * x_3 - l_41 * x_4 - l_51 * x_5) * r_1
        x_0 = (y_0 - l_10 * x_1 - l_20 * x_2 - l_30 * x_3 - l_40 * x_4 - l_50 * x_5) * r_0
        step[i], step[LANES + i], step[2 * LANES + i] = x_0, x_1, x_2
        step[3 * LANES + i], step[4 * LANES + i], step[5 * LANES + i] = x_3, x_4, x_5
