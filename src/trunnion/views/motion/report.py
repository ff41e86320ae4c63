"""The report of a motion in time: that of a cycle, played over time."""

from __future__ import annotations

from typing import TYPE_CHECKING

from trunnion.views.cycle.report import report as cycle_report
from trunnion.views.motion.figure import as_positions

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["report"]


def report(result: xr.Dataset) -> str:
    """The report as one HTML page: figures of the motion, moving mechanism over time, curves, findings."""
    return cycle_report(as_positions(result))
