"""Integrals of functions that are smooth between known edges, with the error of each, for many mechanisms at once.

Every panel between two edges goes by the rule of Gauss and Kronrod, 7 and 15 nodes: none lies on an edge, so what jumps
there counts with the value of its own side. A panel whose error is more than its share is parted, for a function may
also bend where nothing in the model says so.

Rule and estimate of the error: R. Piessens, E. de Doncker-Kapenga, C. W. Überhuber, D. K. Kahaner, QUADPACK, Springer
1983, subroutine QK15.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.panels import CANCELLED

__all__ = ["CANCELLED", "Effort", "Integrals", "Nodes", "integrals", "nodes"]

Array = NDArray[np.float64]
Rows = NDArray[np.intp]
Integrands = Callable[[Rows, Array], Array]

PARTS = 8  # a round costs about as much for many nodes as for few
MOST_PANELS = 4000  # of one mechanism: beyond it the error that is left is told
ROUNDING = 50 * float(np.finfo(float).eps)

# abscissae and weights of the half from the outermost node to the middle, as QK15 has them
_NODES = [
    *(0.991455371120812639206854697526329, 0.949107912342758524526189684047851, 0.864864423359769072789712788640926),
    *(0.741531185599394439863864773280788, 0.586087235467691130294144691693013, 0.405845151377397166906606412076961),
    *(0.207784955007898467600689403773245, 0.0),
]
_KRONROD = [
    *(0.022935322010529224963732008058970, 0.063092092629978553290700663189204, 0.104790010322250183839876322541518),
    *(0.140653259715525918745189590510238, 0.169004726639267902826583426598550, 0.190350578064785409913256402421014),
    *(0.204432940075298892414161999234649, 0.209482141084727828012999174891714),
]
_GAUSS = [0.129484966168869693270611432679082, 0.279705391489276667901467771423780,
          0.381830050505118944950369775488975, 0.417959183673469387755102040816327]  # fmt: skip
NODES = np.array([*(-x for x in _NODES), *_NODES[-2::-1]])
KRONROD = np.array([*_KRONROD, *_KRONROD[-2::-1]])
GAUSS = np.zeros(15)
GAUSS[1::2] = [*_GAUSS, *_GAUSS[-2::-1]]


class Nodes(NamedTuple):
    """Places of a mean over panels, rising, the weight of each, and weights of the rule inside, to tell the error."""

    at: Array
    weights: Array
    inside: Array


def nodes(edges: Array) -> Nodes:
    """The nodes of all panels between edges, (…, edge); (…, node)."""
    half, middle = 0.5 * np.diff(edges)[..., None], 0.5 * (edges[..., 1:] + edges[..., :-1])[..., None]
    share, shape = half / (edges[..., -1:] - edges[..., :1])[..., None], (*edges.shape[:-1], -1)
    return Nodes(*(part.reshape(shape) for part in (middle + half * NODES, share * KRONROD, share * GAUSS)))


@dataclass(frozen=True)
class Integrals:
    """Integrals of some functions over one or more panels, (function, mechanism) each.

    value; error: of it, an estimate; size: integral of the magnitude; nodes: how many values were asked for.
    """

    value: Array
    error: Array
    size: Array
    nodes: int


class Effort(NamedTuple):
    """How far the error of an integral is brought down: of the integral of the magnitude, in so many rounds."""

    tolerance: float = 1e-7
    rounds: int = 5


def integrals(
    functions: Integrands,
    edges: Sequence[Array],
    floor: Callable[[Array], Array] = lambda size: 0.0 * size,
    effort: Effort | None = None,
) -> Integrals:
    """Integrals of functions from the first to the last edge of every mechanism.

    functions: `(mechanisms, times) -> values`, (lane,), (lane, node) and (function, lane, node), each lane a panel of
    one mechanism; NaN makes the integral NaN. edges: of every mechanism, rising. floor: from the sizes, (function,
    mechanism), those below which a function is taken as nothing.
    """
    count, effort = len(edges), effort or Effort()
    rows = np.repeat(np.arange(count), [len(one) - 1 for one in edges])
    low, high = (np.concatenate([one[part] for one in edges]) for part in (slice(None, -1), slice(1, None)))
    panels = np.bincount(rows, minlength=count)
    shortest = np.array([1e-12 * (one[-1] - one[0]) for one in edges])
    told, used = None, 0
    for round_ in range(effort.rounds + 1):
        parts = _panels(functions, rows, low, high)
        used += 15 * len(rows)
        if told is None:
            told = np.zeros((3, parts.shape[1], count))
        summed = _by_row(parts, rows, count)
        tolerance = effort.tolerance * np.maximum(told[2] + summed[2], floor(told[2] + summed[2]))
        share = (tolerance / np.maximum(panels, 1))[:, rows]
        with np.errstate(invalid="ignore"):
            wide = np.any(parts[1] > share, axis=0) & (high - low > shortest[rows])
        more = (PARTS - 1) * np.bincount(rows[wide], minlength=count)
        wide &= (panels + more <= MOST_PANELS)[rows] & (round_ < effort.rounds)
        told += _by_row(parts[:, :, ~wide], rows[~wide], count)
        if not np.any(wide):
            break
        parted = np.linspace(low[wide], high[wide], PARTS + 1)
        low, high = parted[:-1].ravel(), parted[1:].ravel()
        panels = panels + (PARTS - 1) * np.bincount(rows[wide], minlength=count)
        rows = np.tile(rows[wide], PARTS)
    assert told is not None
    return Integrals(told[0], told[1], told[2], used)


def _by_row(parts: Array, rows: Rows, count: int) -> Array:
    """Sums of panels over those of each mechanism, (…, panel) to (…, mechanism)."""
    found = np.zeros((*parts.shape[:-1], count))
    np.add.at(found.T, rows, parts.T)
    return found


def _panels(functions: Integrands, rows: Rows, low: Array, high: Array) -> Array:
    """Value, error and size of every function over each panel, (3, function, panel)."""
    half = 0.5 * (high - low)
    values = functions(rows, 0.5 * (low + high)[:, None] + half[:, None] * NODES)
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        mean, size = 0.5 * values @ KRONROD, half * (np.abs(values) @ KRONROD)
        spread = half * (np.abs(values - mean[..., None]) @ KRONROD)
        off = half * np.abs(values @ (KRONROD - GAUSS))
        scaled = spread * np.minimum(1.0, (200 * off / np.where(spread > 0, spread, 1.0)) ** 1.5)
        error = np.maximum(np.where(spread > 0, scaled, off), ROUNDING * size)
    return np.stack([2 * half * mean, error, size])
