"""Forth and back: how far what moves on the ground goes, where it turns back, and its time ratio."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from trunnion.algebra.dual import primal
from trunnion.measures.many import figures_of
from trunnion.measures.measures import Measure, coordinate_unit, outputs
from trunnion.results.quantities import number, quantity
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import Run

__all__ = ["Way", "ways"]

DEGREES = 180.0 / np.pi


class Way(NamedTuple):
    """A joint on the ground that goes forth and back: its stroke, m or rad, and time ratio.

    The ratio is NaN of a cycle that does not come again; told: how far the driver goes while the joint moves in its
    positive sense, forth, and back, and where the shorter of the two ways begins and ends.
    """

    joint: str
    stroke: float
    unit: str
    ratio: float
    told: str

    @property
    def rows(self) -> list[list[str]]:
        """As figures of the page."""
        rows = [[f"stroke of {self.joint}", quantity(self.stroke, self.unit)]]
        told = f" ({self.told})" if self.told else ""
        return rows + ([[f"time ratio of {self.joint}", f"{number(self.ratio)}{told}"]] if self.ratio > 0 else [])


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
    figures = figures_of(run, measures, FrictionMethod()) if measures else {}
    for one in sliding or found:
        ratio, stroke, *ends = (figures[f"{kind}:{one.subject}"] for kind in kinds)
        if np.isfinite(ratio) or (sliding and stroke > 0):
            told = _told(run, ends, unit) if ends and np.isfinite(ratio) else ""
            yield Way(one.subject, stroke, one.unit(run.system), ratio, told)


def _told(run: Run, ends: list[float], unit: str) -> str:
    """Both ways, between the places of the driver where the joint is farthest out and in, in the sense it runs."""
    driver = next(iter(run.system.mechanism.drivers))
    drive = np.ravel(primal(run.system.drive(run.values, driver, np.array([0.0, run.cycle.duration]))[0]))
    period = drive[1] - drive[0]
    out, back = ends
    forth = (out - back) / period % 1.0
    first, last = (back, out) if forth <= 0.5 else (out, back)
    places = (_text(one % (2 * np.pi) if unit == "rad" else one, unit) for one in (first, last))
    texts = [f"{way} {_text(share * abs(period), unit)}" for way, share in (("forth", forth), ("back", 1.0 - forth))]
    texts[0 if forth <= 0.5 else 1] += f" from {' to '.join(places)}"
    return ", ".join(texts)


def _text(place: float, unit: str) -> str:
    return f"{place * DEGREES:.1f}°" if unit == "rad" else quantity(place, unit)
