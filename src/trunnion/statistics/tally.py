"""Running sums that merge: the same blocks give the same bits, whatever was counted first and where.

Sums of floats depend on their order in the last bit. A `Tree` fixes the order: blocks are leaves of a dyadic tree, and
two siblings are merged, left then right, as soon as both are there. What is kept is what the set of blocks determines.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

__all__ = ["Moments", "Tree", "moments_of"]

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Moments:
    """Count, mean, central sums M_k = Σ (x − mean)ᵏ and extremes, arrays over figures (any shape).

    A figure without values has count 0, mean and sums 0, least +∞ and most −∞.
    Source: P. Pébay, Formulas for robust, one-pass parallel computation of covariances and arbitrary-order statistical
    moments, Sandia report SAND2008-6212 (2008), doi:10.2172/1028931.
    """

    count: Floats
    mean: Floats
    M2: Floats
    M3: Floats
    M4: Floats
    least: Floats
    most: Floats

    def merged(self, other: Self) -> Self:
        """Moments of both sets of values together."""
        n_a, n_b = self.count, other.count
        n = n_a + n_b
        share = n_b / np.maximum(n, 1)
        delta = other.mean - self.mean
        part = delta * share  # δ n_b/n
        square = delta * part * n_a  # δ² n_a n_b/n
        rest = delta - part  # δ n_a/n
        M2 = self.M2 + other.M2 + square
        M3 = self.M3 + other.M3 + square * (rest - part) + 3 * (rest * other.M2 - part * self.M2)
        M4 = (
            self.M4
            + other.M4
            + square * (rest * rest - rest * part + part * part)
            + 6 * (part * part * self.M2 + rest * rest * other.M2)
            + 4 * (rest * other.M3 - part * self.M3)
        )
        mean = np.where(n_a > 0, self.mean + part, other.mean)
        return type(self)(n, mean, M2, M3, M4, np.fmin(self.least, other.least), np.fmax(self.most, other.most))

    @property
    def variance(self) -> Floats:
        """M₂/(n − 1), NaN for fewer than two values."""
        return np.where(self.count > 1, self.M2 / np.maximum(self.count - 1, 1), np.nan)

    @property
    def deviation(self) -> Floats:
        """Standard deviation, the root of the variance."""
        return np.sqrt(self.variance)

    @property
    def skewness(self) -> Floats:
        """(M₃/n)/(M₂/n)^(3/2), NaN where nothing varies."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(self.M2 > 0, np.sqrt(self.count) * self.M3 / self.M2**1.5, np.nan)

    @property
    def kurtosis(self) -> Floats:
        """(M₄/n)/(M₂/n)²: 3 of a normal distribution; NaN where nothing varies."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(self.M2 > 0, self.count * self.M4 / self.M2**2, np.nan)

    def packed(self) -> Floats:
        """All fields as one array, (7, *figures)."""
        return np.stack([np.asarray(getattr(self, f.name), dtype=np.float64) for f in fields(self)])

    @classmethod
    def unpacked(cls, array: Floats) -> Self:
        """From `packed`."""
        return cls(*np.asarray(array, dtype=np.float64))


def moments_of(values: Any, axis: int = -1) -> Moments:
    """Moments along the axis of the samples, the last; NaN are left out (and not in the count)."""
    # In one order in memory, so that sums are taken in one order too.
    x = np.ascontiguousarray(np.moveaxis(np.asarray(values, dtype=np.float64), axis, -1))
    there = ~np.isnan(x)
    if there.all():
        count: Any = np.full(x.shape[:-1], float(x.shape[-1]))
        kept = least = most = x
    else:
        count = there.sum(axis=-1).astype(np.float64)
        kept, least, most = np.where(there, x, 0.0), np.where(there, x, np.inf), np.where(there, x, -np.inf)
    number = np.maximum(count, 1.0)
    mean = kept.sum(axis=-1) / number
    d = x - mean[..., None] if kept is x else np.where(there, x - mean[..., None], 0.0)
    correction = d.sum(axis=-1) / number  # what rounding left in the mean
    mean, d = (
        mean + correction,
        d - correction[..., None] if kept is x else np.where(there, d - correction[..., None], 0.0),
    )
    d2 = d * d
    return Moments(
        count,
        mean,
        d2.sum(axis=-1),
        (d2 * d).sum(axis=-1),
        (d2 * d2).sum(axis=-1),
        np.min(least, axis=-1, initial=np.inf),
        np.max(most, axis=-1, initial=-np.inf),
    )


class Tree:
    """Moments of blocks in a dyadic tree: node (level, index) holds the blocks [index 2^level, (index + 1) 2^level).

    `merge` gives a new tree, `add` puts into this one. nodes: the widest whose blocks are all there, by (level, index);
    prefixes: payload of the first 2^level blocks by level, kept as they come up, for how a figure converges.
    """

    def __init__(
        self, nodes: Mapping[tuple[int, int], Moments] | None = None, prefixes: Mapping[int, Moments] | None = None
    ) -> None:
        self.nodes: dict[tuple[int, int], Moments] = dict(nodes or {})
        self.prefixes: dict[int, Moments] = dict(prefixes or {})

    @classmethod
    def of(cls, block: int, payload: Moments) -> Self:
        """A tree of one block."""
        return cls({(0, block): payload}, {0: payload} if block == 0 else {})

    def merge(self, other: Tree) -> Self:
        """The blocks of both; ValueError if a block is in both."""
        tree = type(self)(self.nodes, self.prefixes)
        tree.prefixes.update(other.prefixes)
        for (level, index), payload in other.nodes.items():
            tree._insert(level, index, payload)
        return tree

    def add(self, block: int, payload: Moments) -> None:
        """Put one more block into this tree."""
        if block == 0:
            self.prefixes[0] = payload
        self._insert(0, block, payload)

    def _insert(self, level: int, index: int, payload: Moments) -> None:
        for other_level, other_index in self.nodes:
            wide = max(level, other_level)
            if index >> (wide - level) == other_index >> (wide - other_level):
                raise ValueError(f"blocks {index << level} ... {((index + 1) << level) - 1} are counted twice")
        while (sibling := self.nodes.pop((level, index ^ 1), None)) is not None:
            payload = sibling.merged(payload) if index & 1 else payload.merged(sibling)
            level, index = level + 1, index >> 1
            if index == 0:
                self.prefixes[level] = payload
        self.nodes[level, index] = payload

    def in_order(self) -> Iterator[tuple[int, int, Moments]]:
        """(first block, number of blocks, payload) of every node, from the first block on."""
        for (level, index), payload in sorted(self.nodes.items(), key=lambda item: item[0][1] << item[0][0]):
            yield index << level, 1 << level, payload

    @property
    def ranges(self) -> list[tuple[int, int]]:
        """The blocks there are, as sorted ranges (first, past the last) that do not touch."""
        ranges: list[tuple[int, int]] = []
        for first, number, _ in self.in_order():
            if ranges and ranges[-1][1] == first:
                ranges[-1] = (ranges[-1][0], first + number)
            else:
                ranges.append((first, first + number))
        return ranges

    def total(self) -> Moments | None:
        """All blocks merged, from the first on; None of an empty tree."""
        total: Moments | None = None
        for _, _, payload in self.in_order():
            total = payload if total is None else total.merged(payload)
        return total

    def to_arrays(self) -> dict[str, NDArray[Any]]:
        """The tree as arrays: `nodes` (level, index) and `levels` of the prefixes with their packed payloads."""
        nodes, levels = sorted(self.nodes), sorted(self.prefixes)
        arrays: dict[str, NDArray[Any]] = {
            "nodes": np.array(nodes, dtype=np.int64).reshape(-1, 2),
            "levels": np.array(levels, dtype=np.int64),
        }
        if nodes:
            arrays["node_payloads"] = np.stack([self.nodes[key].packed() for key in nodes])
        if levels:
            arrays["prefix_payloads"] = np.stack([self.prefixes[level].packed() for level in levels])
        return arrays

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, NDArray[Any]]) -> Self:
        """From `to_arrays`."""
        nodes = [(int(level), int(index)) for level, index in arrays["nodes"]]
        levels = [int(level) for level in arrays["levels"]]
        return cls(
            {key: Moments.unpacked(row) for key, row in zip(nodes, arrays.get("node_payloads", ()), strict=True)},
            {
                level: Moments.unpacked(row)
                for level, row in zip(levels, arrays.get("prefix_payloads", ()), strict=True)
            },
        )
