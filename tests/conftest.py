"""Shared set-up; its presence puts this folder on the path, so that tests may import `mechanisms` and `reference`."""

from __future__ import annotations

import os
import signal
from collections import defaultdict
from typing import Any

import pytest
from hypothesis import HealthCheck, settings

# Matrices here are small: a second thread of the linear algebra only spins beside the other test process. Said before
# NumPy is loaded; processes started by a test take it over.
for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

# A shell starts what it puts in the background with Ctrl-C ignored, and programs that tests start would take that over.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

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


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Of a test marked `spread(n, *also)`, n of its cases, evenly chosen, and those named stay in `make test`."""
    cases: defaultdict[tuple[Any, ...], list[pytest.Item]] = defaultdict(list)
    for item in items:
        if mark := item.get_closest_marker("spread"):
            cases[item.nodeid.partition("[")[0], *mark.args].append(item)
    for (_, count, *also), found in cases.items():
        kept = {round((k + 0.5) * len(found) / count - 0.5) for k in range(count)}
        for k, item in enumerate(found):
            if k not in kept and item.nodeid.partition("[")[2].removesuffix("]") not in also:
                item.add_marker(pytest.mark.slow)
