"""What moves and loads one free coordinate, tabulated for many mechanisms that differ in numbers alone.

The numbers are those of `tables`, worked out for all samples in one walk. The way is parted at the places where a force
jumps or bends, which are others in every sample, into stretches; each has so many panels of its own. Samples with as
many stretches go together.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.dynamics.start import Places, nominal_motion, placed
from trunnion.dynamics.state import FreeMotion
from trunnion.dynamics.tables import EXACT, NODES, POWERS, Rub, Tables, numbers, scale_of, tabulated, unfit
from trunnion.joints.pairs import PlanarContactLoad
from trunnion.solve.switches import Mechanisms, bends
from trunnion.solve.system import Values

__all__ = ["SampledTables", "picked", "sampled_tables", "tabulates"]

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

AT_ONCE = 24  # samples of one walk: its arrays then stay in cache
ANGLES = np.pi * (np.arange(NODES) + 0.5) / NODES
COSINES = np.cos(np.arange(NODES)[:, None] * ANGLES)
TRIED = np.array([-0.97, 0.03])  # of a panel: where the polynomials are held against walks
SPARE = 0.3  # of a panel: so that lengths that are nominally whole numbers of panels do not scatter about them
LANES = 480  # samples of a table
LOST = 1e2 * EXACT  # a miss from which a sample is left to others


@dataclass(frozen=True)
class SampledTables:
    """Polynomials of every number over the way, of samples whose ways have as many stretches.

    samples: which they are; low, width: (sample, stretch), coordinate at which each begins and width of its panels;
    first, count: (stretch,), its panels; coefficients: (sample, panel, node, number), of those numbers, `some` of the
    `whole`, that are not 0 all along; period: of the way, (sample,), None of a range; parted: whether there is a bend
    at all; parameters: of the law of each contact.
    """

    motion: FreeMotion
    rubs: tuple[Rub, ...]
    samples: Rows
    low: Array
    width: Array
    first: Rows
    count: Rows
    coefficients: Array
    period: Array | None
    parted: bool
    parameters: Sequence[Mapping[str, Any]]
    some: Rows
    whole: int

    def numbers(self, rows: Rows, stretch: Rows, q: Array) -> Array:
        """Every number at coordinates within stretches of the first turn, (lane, number)."""
        panel, basis = self.basis(rows, stretch, q)
        found = np.zeros((len(rows), self.whole))
        found[:, self.some] = np.matmul(basis[:, None], self.coefficients[rows, panel])[:, 0]
        return found

    def basis(self, rows: Rows, stretch: Rows, q: Array) -> tuple[Rows, Array]:
        """Panels and values of the polynomials, (lane, node), at coordinates within stretches of the first turn."""
        low, width = self.low[rows, stretch], self.width[rows, stretch]
        place = (q - low) / width
        panel = np.clip(np.floor(place), 0, self.count[stretch] - 1)
        inside = np.clip(2.0 * (place - panel) - 1.0, -1.0, 1.0)
        found = np.cos(np.arange(NODES) * np.arccos(inside)[:, None])
        return self.first[stretch] + panel.astype(np.intp), found


def picked(values: Mapping[str, Any], rows: Rows | int) -> dict[str, Any]:
    """The numbers of some samples; of one as plain numbers."""
    alone = isinstance(rows, int)
    return {
        path: (float(value[rows, 0]) if alone else value[rows]) if np.ndim(value) == 2 else value
        for path, value in values.items()
    }


def tabulates(motion: FreeMotion, known: Places) -> Tables | str:
    """The tables of the nominal mechanism, or why its like cannot be tabulated together.

    They can in the plane, and where friction has no memory.
    """
    if motion.bristles:
        return "friction has a memory"
    if why := unfit(motion):
        return why
    found = tabulated(motion, known)
    if found is None:
        return "its forces have no tables that are exact enough"
    planar = all(isinstance(rub.load, PlanarContactLoad) for rub in found.rubs)
    return found if planar else "the mechanism is spatial"


def sampled_tables(nominal: Tables, values: Values, count: int) -> Iterator[SampledTables]:
    """Tables of samples, (sample, 1) values, LANES at a time; a sample of which none are found is in none of them."""
    widest = float(np.max(np.diff(nominal.edges)))
    for low in range(0, count, LANES):
        alike: dict[tuple[int, ...], list[SampledTables]] = {}
        for begin in range(low, min(low + LANES, count), AT_ONCE):
            rows = np.arange(begin, min(begin + AT_ONCE, low + LANES, count))
            own = picked(values, rows)
            ways = _ways(nominal.motion, own, len(rows))
            panels = [_panels(_edges(way), widest) for way in ways]
            for each in sorted(set(panels)):
                some = np.array([i for i, one in enumerate(panels) if one == each])
                found = _tables(nominal, picked(own, some), [ways[i] for i in some], rows[some], np.array(each))
                alike.setdefault(each, []).append(found)
        yield from (_joined(parts) for parts in alike.values() if any(len(part.samples) for part in parts))


def _joined(parts: Sequence[SampledTables]) -> SampledTables:
    """Those of several walks, one after the other."""
    first = parts[0]
    some = np.unique(np.concatenate([part.some for part in parts]))
    own: dict[str, Any] = {
        name: np.concatenate([getattr(part, name) for part in parts])
        for name in ("samples", "low", "width", *(("period",) if first.period is not None else ()))
    }
    own["coefficients"] = np.concatenate([np.take(part.coefficients, some, axis=-1) for part in parts])
    parameters = [
        {key: _one([part.parameters[k][key] for part in parts]) for key in each}
        for k, each in enumerate(first.parameters)
    ]
    return replace(first, **own, parameters=parameters, some=some)


def _one(values: Sequence[Any]) -> Any:
    return np.concatenate(values) if np.ndim(values[0]) else values[0]


def _laid(edges: Array, count: Rows) -> tuple[Array, Array, Rows]:
    """Begin and width of every panel, (sample, panel), and the first panel of every stretch."""
    first, stretch = np.cumsum(count) - count, np.repeat(np.arange(len(count)), count)
    width = (np.diff(edges, axis=1) / count)[:, stretch]
    return edges[:, stretch] + (np.arange(count.sum()) - first[stretch]) * width, width, first


def _ways(motion: FreeMotion, values: Values, count: int) -> list[Places]:
    """Where forces jump or bend in every sample."""
    run, system = motion.run, motion.system
    varied = any(np.ndim(value) == 2 for path, value in values.items() if path.startswith("drivers."))
    cycles = [system.cycle(picked(values, i)) if varied else run.cycle for i in range(count)]
    times = bends(Mechanisms(system, run.chosen.assembly, dict(values), cycles))
    begins, speeds = (
        np.broadcast_to(np.asarray(primal(one), float), (count, 1))[:, 0] for one in nominal_motion(motion, values)
    )
    return [
        placed(np.asarray(own), float(begin), float(speed), cycle)
        for own, begin, speed, cycle in zip(times, begins, speeds, cycles, strict=True)
    ]


def _edges(way: Places) -> Array:
    """Rising coordinates between which forces are smooth: of a turn from one bend to the same in the next."""
    if way.period is None:
        return np.unique([way.limits[0], *way.bends, way.limits[1]])
    if not way.bends:
        return np.array([0.0, way.period])
    return np.array([*way.bends, way.bends[0] + way.period])


def _panels(edges: Array, widest: float) -> tuple[int, ...]:
    """Panels of every stretch: of a sample itself, whatever others are with it, and the same of most samples."""
    return tuple(int(one) for one in np.ceil(np.diff(edges) / widest + SPARE))


def _tables(
    nominal: Tables, values: Values, ways: Sequence[Places], samples: Rows, count: Rows
) -> SampledTables:  # fmt: skip
    edges = np.array([_edges(way) for way in ways])
    begin, width, first = _laid(edges, count)
    coefficients, largest, miss = _fitted(nominal, values, begin, width)
    kept = np.flatnonzero(miss <= LOST)
    period = None if ways[0].period is None else np.array([way.period for way in ways], float)
    parameters = [
        {key: _rowed(values[f"joints.{rub.joint}.friction.{key}"], kept) for key in rub.parameters}
        for rub in nominal.rubs
    ]
    return SampledTables(
        nominal.motion, nominal.rubs, samples[kept], edges[kept, :-1], width[kept][:, first], first, count,
        coefficients[kept],
        None if period is None else period[kept], len(ways[0].bends) > 0, parameters,
        np.flatnonzero(largest.any(axis=0)), coefficients.shape[-1],
    )  # fmt: skip


def _rowed(value: Any, rows: Rows) -> Any:
    return value[rows, 0] if np.ndim(value) == 2 else float(np.ravel(value)[0])


def _fitted(nominal: Tables, values: Values, begin: Array, width: Array) -> tuple[Array, Array, Array]:
    """Coefficients (sample, panel, node, number) through the Chebyshev nodes of every panel, the numbers'
    largest values (sample, number), and largest misses."""
    samples, panels = begin.shape
    inside = np.concatenate([np.cos(ANGLES), TRIED])
    q = (begin[..., None] + 0.5 * width[..., None] * (1.0 + inside)).reshape(samples, -1)
    found = numbers(nominal.motion, nominal.rubs, q, values).reshape(-1, samples, panels, len(inside))
    known, exact = np.moveaxis(found[..., :NODES], 0, -1), found[..., NODES:]
    coefficients = 2.0 / NODES * np.matmul(COSINES, known)
    coefficients[..., 0, :] *= 0.5
    basis = np.cos(np.arange(NODES) * np.arccos(TRIED)[:, None])
    miss = np.abs(np.matmul(basis, coefficients) - np.moveaxis(exact, 0, -1)).max(axis=(1, 2))
    largest = np.abs(known).max(axis=(1, 2))
    scale = np.array([scale_of(one, len(nominal.rubs)) for one in largest])
    worst = np.max(miss / np.where(scale > 0, scale, 1.0), axis=1)
    size = found.shape[0] - POWERS
    return coefficients[..., :size], largest[:, :size], worst
