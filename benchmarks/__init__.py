"""Trunnion measured against its peers on the four-bar of Durango, Calle and Ruiz (2010), and what a group costs in
other linkages: `make bench`.

Everything runs on one thread: the settings below must be in place before NumPy or Numba is first imported.
"""

import os

ONE_THREAD = (
    "OMP_NUM_THREADS",
    "MKL_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "NUMEXPR_NUM_THREADS",
    "NUMBA_NUM_THREADS",
)
os.environ.update(dict.fromkeys(ONE_THREAD, "1"))
