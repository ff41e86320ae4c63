"""Jumps of an effort whose places errors move: between both places the change by the errors is that of the jump."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.course import Place
from trunnion.cycle.course import CycleCourse, magnitude
from trunnion.errors import Finding
from trunnion.results.sentences import finding_for

__all__ = ["findings"]

Array = NDArray[np.float64]
JUMP = 0.2  # of the largest effort: what changes by more at a break jumps there
ALIKE = 0.5  # of a jump: another that differs by less may be the same elsewhere
NEAR = 1 / 8  # of the cycle: how far a jump is moved at most


def findings(course: CycleCourse, units: list[str]) -> Iterator[Finding]:
    """Changes of efforts by the errors that are a jump at another place; and the largest change elsewhere."""
    edges = course.courses.edges
    for i, (name, unit) in enumerate(zip(course.run.system.mechanism.drivers, units, strict=True)):
        jumps = course.jumps("drive_effort", i)
        without = jumps - course.jumps("drive_effort_change", i)
        left = course.sound.copy()
        tops = []
        for built, meant in _moved(jumps, without, JUMP * course.largest("drive_effort"), edges):
            between = _between(built, meant, len(left))
            left[between] = False
            inside = np.isin(np.arange(len(left)), between) & course.sound
            top = course.extreme("drive_effort_change", i, of=magnitude, panels=inside)
            if top is not None:
                tops.append((top, built, meant))
        if tops:
            top, built, meant = max(tops, key=lambda one: one[0].value)
            rest = course.extreme("drive_effort_change", i, of=magnitude, panels=left)
            places = [course.told(Place(0.0, float(edges[k + 1]))) for k in (built, meant)]
            yield finding_for(
                "errors.jump_moved", f"drivers.{name}", at=course.told(top).removeprefix("at "), built=places[0],
                meant=places[1], rest=rest.value if rest else 0.0, unit=unit,
            )  # fmt: skip


def _moved(jumps: Array, without: Array, least: float, edges: Array) -> Iterator[tuple[int, int]]:
    """Numbers of edges, of a jump of the mechanism with errors and of that without to which it belongs."""
    alone = [
        np.flatnonzero((np.abs(own) > least) & (np.abs(other) < ALIKE * np.abs(own)))
        for own, other in ((jumps, without), (without, jumps))
    ]
    span = edges[-1] - edges[0]
    for built in alone[0]:
        away = np.abs(edges[1:][alone[1]] - edges[1:][built])
        away = np.minimum(away, span - away)
        same = np.abs(without[alone[1]] - jumps[built]) < ALIKE * np.abs(jumps[built])
        away = np.where(same, away, np.inf)
        if np.min(away, initial=np.inf) < NEAR * span:
            yield int(built), int(alone[1][np.argmin(away)])


def _between(one: int, other: int, count: int) -> NDArray[np.intp]:
    """Panels between two edges, each of which ends the panel of its number, the shorter way round."""
    ways = [np.arange(low + 1, low + 1 + (high - low) % count) % count for low, high in ((one, other), (other, one))]
    return min(ways, key=len)
