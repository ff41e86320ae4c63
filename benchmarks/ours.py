"""Trunnion's side of the comparison."""

from __future__ import annotations

from benchmarks.side import Job, Side

__all__ = ["trunnion_side"]


def trunnion_side(job: Job) -> Side | None:
    """Trunnion on `examples/durango-fourbar.yaml`, results as arrays (no Dataset built); None if not there."""
    return None
