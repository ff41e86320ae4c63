"""Shared set-up; its presence puts this folder on the path, so that tests may import `mechanisms` and `reference`."""

from __future__ import annotations

from hypothesis import HealthCheck, settings

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
