"""A histogram whose bins are fixed beforehand, even near a centre and in proportion to the distance far from it.

With t = (x − centre)/scale, every octave of 1 + |t| has 2^fineness bins of equal width: width 2^−fineness up to
|t| = 1, twice that up to 3, four times up to 7, ... Counts are integers: they add up to the same bits in any order, and
with them every quantile to within a bin. The bin is read off the bits of the float 1 + |t|, so that it costs little and
does not depend on a library's logarithm. (Buckets by the bits of the number: as in G. Tene's HdrHistogram.)
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

__all__ = ["Bins", "count", "quantile"]

Floats = NDArray[np.float64]
Counts = NDArray[np.int64]
LEAST = 1e-16  # a deviation that is rounding, SI
_ONE = 1023 << 52
"""The bits of 1.0."""


@dataclass(frozen=True, eq=False)
class Bins:
    """Bins of one or more figures: centre and scale (> 0, unit of the figure) are arrays over figures or numbers.

    fineness: 2^fineness bins an octave; octaves: how many on each side, so that |t| < 2^octaves − 1. What lies further
    out is counted in the outermost bins.
    """

    centre: Any
    scale: Any
    fineness: int = 7
    octaves: int = 64

    @classmethod
    def around(cls, centre: Any, deviation: Any, fineness: int = 7, octaves: int = 64) -> Self:
        """Bins for values expected about `centre` with a standard deviation of `deviation`.

        Where that is 0 or not known (NaN, ∞) the scale is 1e-9 of the centre, or 1e-12: rounding falls into few bins,
        and what is beyond first order, as the force of a contact that is just open, within the outermost.
        """
        centre = np.nan_to_num(np.asarray(centre, dtype=np.float64))
        deviation = np.nan_to_num(np.asarray(deviation, dtype=np.float64), posinf=0.0)
        unknown = np.maximum(1e-9 * np.abs(centre), 1e-12)
        return cls(centre, np.where(deviation > LEAST, deviation, unknown), fineness, octaves)

    @property
    def half(self) -> int:
        """Bins on each side of the centre."""
        return self.octaves << self.fineness

    @property
    def number(self) -> int:
        """Bins of a figure."""
        return 2 * self.half

    def index(self, values: Any) -> NDArray[np.int64]:
        """Bin of each value, samples along the last axis; of NaN it has no meaning."""
        x = np.asarray(values, dtype=np.float64)
        t = np.ascontiguousarray((x - np.asarray(self.centre)[..., None]) / np.asarray(self.scale)[..., None])
        # The greatest float before the next octave: a clip of the float costs less than one of the index.
        far = np.minimum(np.abs(t) + 1.0, np.nextafter(2.0**self.octaves, 0.0))
        index: NDArray[np.int64] = far.view(np.int64) - _ONE
        index >>= 52 - self.fineness
        index ^= t.view(np.int64) >> 63  # −1 − index of negative t: its sign bit drawn through the word is −1
        index += self.half
        return index

    def edges(self) -> Floats:
        """Edges of the bins, (*figures, number + 1), increasing; those at the ends stand for all beyond them."""
        bits = (np.arange(self.half + 1, dtype=np.int64) << (52 - self.fineness)) + _ONE
        t = bits.view(np.float64) - 1.0
        t = np.concatenate([-t[:0:-1], t])
        return np.asarray(self.centre)[..., None] + np.asarray(self.scale)[..., None] * t


def count(values: Any, bins: Bins, axis: int = -1) -> Counts:
    """How many values fall into each bin, (*figures, bin): values (*figures, samples) or samples along `axis`.

    NaN are not counted.
    """
    x = np.moveaxis(np.asarray(values, dtype=np.float64), axis, -1)
    missing = np.isnan(x)
    gaps = bool(missing.any())
    if gaps:
        x = np.where(missing, 0.0, x)
    index = bins.index(x)
    figures = index.shape[:-1]
    index = index.reshape(math.prod(figures), index.shape[-1])
    index += (np.arange(len(index), dtype=np.int64) * bins.number)[:, None]
    chosen = index[~missing.reshape(index.shape)] if gaps else index.ravel()
    counts = np.bincount(chosen, minlength=len(index) * bins.number)
    return counts.reshape(*figures, bins.number)


def quantile(counts: Counts, bins: Bins, q: Any, least: Any = -np.inf, most: Any = np.inf) -> Floats:
    """Value below which the share q of the counted lies, (*figures, *q).

    The density within a bin is linear, with the slope between the bins beside it, so that the quantile of a smooth
    distribution is off by the third power of the width. least, most: extremes over all values (arrays over figures),
    which no quantile passes. NaN where nothing is counted or q is NaN.
    """
    q = np.asarray(q, dtype=np.float64)
    edges = np.broadcast_to(bins.edges(), (*counts.shape[:-1], bins.number + 1)).reshape(-1, bins.number + 1)
    rows = counts.reshape(-1, bins.number)
    low, high = (np.broadcast_to(e, counts.shape[:-1]).reshape(-1) for e in (least, most))
    found = np.full((len(rows), q.size), np.nan)
    for row, values in enumerate(rows):
        reached = np.cumsum(values)
        if reached[-1] == 0:
            continue
        rank = q.ravel() * reached[-1]
        place = np.clip(np.searchsorted(reached, rank, side="left"), *np.flatnonzero(values)[[0, -1]])
        part = np.clip((rank - reached[place] + values[place]) / np.maximum(values[place], 1), 0.0, 1.0)
        part = _tilted(part, values, edges[row], place)
        left, right = edges[row, place], edges[row, place + 1]
        right = np.where(place == bins.number - 1, high[row], right)  # such as of values of which some are infinite
        found[row] = np.clip(left + part * (right - left), low[row], high[row])
    return np.where(np.isnan(q), np.nan, found.reshape((*counts.shape[:-1], *q.shape)))


def _tilted(share: Floats, values: Counts, edges: Floats, place: NDArray[np.intp]) -> Floats:
    """Where in its bin a share of the counted is reached, of a density 1 + s (2 p − 1), p from 0 to 1.

    The share is p + s (p² − p); s, within ±1, from the densities of the bins on either side.
    """
    width, middle = np.diff(edges), 0.5 * (edges[1:] + edges[:-1])
    before, after = np.maximum(place - 1, 0), np.minimum(place + 1, len(values) - 1)
    with np.errstate(all="ignore"):
        rise = values[after] / width[after] - values[before] / width[before]
        own = np.maximum(values[place], 1) / width[place]
        s = np.clip(0.5 * width[place] * rise / (middle[after] - middle[before]) / own, -1.0, 1.0)
    s = np.where(np.isnan(s), 0.0, s)  # bins narrower than the rounding of their centre have no width
    root = np.sqrt(np.maximum((1 - s) ** 2 + 4 * s * share, 0.0))
    return np.clip(2 * share / np.maximum(1 - s + root, 1e-300), 0.0, 1.0)
