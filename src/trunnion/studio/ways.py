"""Forth and back: how far what moves on the ground goes, where it turns back, and its time ratio."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from trunnion.measures.evaluation import figures_of
from trunnion.measures.measures import Measure, coordinate_unit, outputs
from trunnion.results.quantities import number, quantity
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import Run

__all__ = ["Way", "ways"]

DEGREES = 180.0 / np.pi


class Way(NamedTuple):
    """A joint on the ground that goes forth and back: its stroke, m or rad, and time ratio.

    The ratio is NaN of a cycle that does not come again; short: the shorter of the two ways, between its dead centres.
    """

    joint: str
    stroke: float
    unit: str
    ratio: float
    short: str

    @property
    def rows(self) -> list[list[str]]:
        """As figures of the page."""
        told = [[f"stroke of {self.joint}", quantity(self.stroke, self.unit)]]
        short = f" ({self.short})" if self.short else ""
        return told + ([[f"time ratio of {self.joint}", f"{number(self.ratio)}{short}"]] if self.ratio > 0 else [])


def ways(run: Run, steps: int) -> Iterator[Way]:
    """Of the slides on the ground, or where there is none of what turns back on it; none of pins in loaded seats."""
    found = [] if run.seats or run.cycle.duration <= 0 else outputs(run.system)
    sliding = [one for one in found if one.kind == "slide"]
    unit = coordinate_unit(run.system, run.values)
    kinds = {"time_ratio": "", "stroke": ""}
    if unit != "s":
        kinds |= {"dead_centre": "", "dead_centre least": "place-of-minimum"}
    measures = [
        Measure(f"{kind}:{one.subject}", kind.split()[0], one.subject, statistic=statistic)
        for one in sliding or found
        for kind, statistic in kinds.items()
    ]
    figures = figures_of(run, measures, steps, FrictionMethod()) if measures else {}
    for one in sliding or found:
        ratio, stroke, *ends = (figures[f"{kind}:{one.subject}"] for kind in kinds)
        if np.isfinite(ratio) or (sliding and stroke > 0):
            short = _short(ends, unit) if ends and np.isfinite(ratio) else ""
            yield Way(one.subject, stroke, one.unit(run.system), ratio, short)


def _short(ends: list[float], unit: str) -> str:
    """The shorter way between two places of the driver; those of one that slides as they come."""
    if unit != "rad":
        return " to ".join(quantity(end, unit) for end in sorted(ends))
    first, last = sorted(end * DEGREES % 360.0 for end in ends)
    if last - first > 180.0:
        first, last = last, first
    return f"{first:.1f}° to {last:.1f}°"
