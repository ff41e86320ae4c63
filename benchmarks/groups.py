"""What a group costs: linkages of one to three groups, motion and forces with friction, against stacked equations.

Motion: poses, velocities, accelerations of all links, kept as arrays. All: with the reactions, friction, friction
power of every joint and the drive effort. Forces: the difference. The driver is counted with the groups.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.table import Table

from benchmarks import stacked
from benchmarks.linkages import LINKAGES, Linkage
from benchmarks.side import Side, take_turns
from trunnion.cycle.positions import CHUNK
from trunnion.solve.forward import Forward, forward
from trunnion.solve.run import Run, prepare

Array = NDArray[np.float64]
LIMITS = {2: 0.6, 3: 15.0}  # µs per group and configuration, by class: motion, forces and friction
CONFIGURATIONS = 100_000
STACKED_CONFIGURATIONS = 10 * stacked.CHUNK

__all__ = ["Cost", "fill", "verdicts"]


@dataclass(frozen=True)
class Cost:
    """What was found for one linkage, µs per configuration; deviation: stacked from Trunnion, of the peak."""

    linkage: Linkage
    motion: float
    all: float
    stacked: float
    deviation: float

    @property
    def limit(self) -> float:
        """µs per configuration."""
        return LIMITS[self.linkage.class_] * self.linkage.groups

    @property
    def kept(self) -> bool:
        """Whether the limit is kept."""
        return self.all <= self.limit


def _links(walk: Forward) -> Iterator[Any]:
    for link, motion in walk.motions.items():
        if link != walk.system.mechanism.fixed_link:
            yield from (motion.frame.x, motion.frame.y, np.arctan2(motion.frame.s, motion.frame.c))
            yield from (*motion.twist, *motion.acceleration)


def _motion(run: Run, time: Array) -> Iterator[Any]:
    yield from _links(forward(run.system, run.values, run.chosen.assembly, time))


def _all(run: Run, time: Array) -> Iterator[Any]:
    back = run.solve(time)
    yield from _links(back.walk)
    for name, reaction in back.reactions.items():
        yield from (reaction.x, reaction.y, reaction.m)
        yield from (back.friction[name], -back.friction[name] * back.walk.speed(name))
    yield from back.efforts.values()


def _sides(linkage: Linkage) -> tuple[Run, list[Side]]:
    run = prepare(linkage.build())
    time = run.cycle.times(STACKED_CONFIGURATIONS)
    motions = [stacked.given(run, time[low : low + stacked.CHUNK]) for low in range(0, time.size, stacked.CHUNK)]

    def chunked(rows: Callable[[Run, Array], Iterator[Any]]) -> Callable[[int], Array]:
        count = sum(1 for _ in rows(run, run.cycle.times(2)))

        def go(n: int) -> Array:
            times, out = run.cycle.times(n), np.empty((count, n))
            for low in range(0, n, CHUNK):
                part = slice(low, low + CHUNK)
                for k, numbers in enumerate(rows(run, times[part])):
                    out[k, part] = numbers
            return out

        return go

    def equations(n: int) -> list[Any]:
        return [stacked.solve(motion) for motion in motions[: n // stacked.CHUNK]]

    return run, [
        Side("motion", "motion", chunked(_motion), np.transpose, (), CONFIGURATIONS),
        Side("all", "friction", chunked(_all), np.transpose, (), CONFIGURATIONS),
        Side("stacked", "friction", equations, np.asarray, (), STACKED_CONFIGURATIONS),
    ]


def _deviation(run: Run, n: int = 360) -> float:
    """Largest difference of pins' forces, friction and efforts, each relative to the largest of its kind."""
    time = run.cycle.times(n)
    back, other = run.solve(time), stacked.solve(stacked.given(run, time))
    worst = 0.0

    def compare(ours: Any, theirs: Array, peak: float) -> None:
        nonlocal worst
        worst = max(worst, float(np.max(np.abs(ours - theirs))) / peak)

    reactions, frictions = other["reaction"], other["friction"]
    for k, (name, joint) in enumerate(run.system.joints.items()):
        same = [j for j, other in enumerate(run.system.joints.values()) if other.type == joint.type]
        compare(back.friction[name], frictions[:, k], float(np.max(np.abs(frictions[:, same]))))
        if joint.type == "revolute":
            for axis in (0, 1):
                compare(back.reactions[name][axis], reactions[:, k, axis], float(np.max(np.abs(reactions[:, same]))))
    for k, effort in enumerate(back.efforts.values()):
        compare(effort, other["effort"][:, k], float(np.max(np.abs(other["effort"][:, k]))))
    return worst


def fill(rounds: int) -> tuple[Table, dict[str, Cost]]:
    """Measure all linkages; the table, and the figures by name."""
    table = Table(title="Cost of a group, one thread, 10^5 configurations", title_justify="left", pad_edge=False)
    table.add_column("linkage")
    for title in (
        *("motion", "forces", "all"),
        *("motion\nper group", "forces\nper group", "all per\ngroup", "limit", "kept"),
        *("stacked", "stacked /\nall", "deviation"),
    ):
        table.add_column(title, justify="right")
    found: dict[str, Cost] = {}
    for name, linkage in LINKAGES.items():
        run, sides = _sides(linkage)
        best = take_turns(sides, rounds)
        cost = found[name] = Cost(linkage, best["motion"], best["all"], best["stacked"], _deviation(run))
        parts = (cost.motion, cost.all - cost.motion, cost.all)
        table.add_row(
            name,
            *(f"{part:.3f}" for part in parts),
            *(f"{part / linkage.groups:.3f}" for part in parts),
            f"{LIMITS[linkage.class_]:g}",
            "yes" if cost.kept else "NO",
            f"{cost.stacked:.2f}",
            f"{cost.stacked / cost.all:.1f}",
            f"{cost.deviation:.0e}",
        )
    return table, found


def verdicts(found: dict[str, Cost]) -> list[tuple[str, bool]]:
    """The limits, each with whether it is kept."""
    sentences = []
    for name, cost in found.items():
        groups, limit = cost.linkage.groups, LIMITS[cost.linkage.class_]
        text = f"{name}: {cost.all / groups:.3f} µs per group with motion and friction, at most {limit:g} µs"
        sentences.append((text, cost.kept))
    return sentences
