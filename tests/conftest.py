"""Shared set-up; its presence puts this folder on the path, so that tests may import `mechanisms` and `reference`."""

from __future__ import annotations

import os

from hypothesis import HealthCheck, settings

# Matrices here are small: a second thread of the linear algebra only spins beside the other test process. Said before
# NumPy is loaded; processes started by a test take it over.
for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

# Every run the same cases, no database on disk, no deadline that a loaded machine could miss.
settings.register_profile(
    "trunnion",
    max_examples=60,
    deadline=None,
    derandomize=True,
    database=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much],
)
settings.load_profile("trunnion")
