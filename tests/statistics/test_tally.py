"""Moments against numpy and scipy; a tree gives the same bits in any order and any chunking."""

from __future__ import annotations

from functools import reduce
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from trunnion.statistics.tally import Moments, Tree, moments_of

VALUES = np.random.default_rng(3).gamma(2.0, 1e-3, size=(64, 3, 37)) + 1.0  # (block, figure, sample)
VALUES[5, 1, :9] = np.nan
VALUES[9, 2] = np.nan
BLOCKS = [moments_of(values) for values in VALUES]


def bits(moments: Moments | None) -> bytes:
    assert moments is not None
    return moments.packed().tobytes()


def test_moments_as_in_scipy() -> None:
    together = reduce(Moments.merged, BLOCKS)
    for figure in range(3):
        x = VALUES[:, figure].ravel()
        x = x[~np.isnan(x)]
        assert together.count[figure] == x.size
        assert together.mean[figure] == pytest.approx(x.mean(), rel=1e-15)
        assert together.deviation[figure] == pytest.approx(x.std(ddof=1), rel=1e-12)
        assert together.skewness[figure] == pytest.approx(stats.skew(x), rel=1e-10)
        assert together.kurtosis[figure] == pytest.approx(stats.kurtosis(x, fisher=False), rel=1e-10)
        assert (together.least[figure], together.most[figure]) == (x.min(), x.max())


def test_samples_along_the_first_axis_the_same_bits() -> None:
    for block, values in zip(BLOCKS[:10], VALUES, strict=False):
        assert bits(moments_of(np.ascontiguousarray(values.T), axis=0)) == bits(block)


def test_many_blocks_at_once() -> None:
    together = moments_of(VALUES[10:]).packed()  # (moment, block, figure)
    for place, block in enumerate(BLOCKS[10:]):
        assert np.ascontiguousarray(together[:, place]).tobytes() == bits(block)


def test_no_values() -> None:
    """A figure without values has count 0, and merging with it changes nothing."""
    nothing = moments_of(np.full((3, 4), np.nan))
    assert (nothing.count == 0).all()
    assert np.isnan(nothing.deviation).all()
    assert (nothing.least == np.inf).all()
    assert bits(nothing.merged(BLOCKS[0])) == bits(BLOCKS[0].merged(nothing)) == bits(BLOCKS[0])
    np.testing.assert_array_equal(nothing.merged(nothing).packed(), nothing.packed())
    assert bits(moments_of(np.empty((3, 0)))) == bits(nothing)


@given(st.lists(st.floats(-1e3, 1e3), min_size=1, max_size=40), st.integers(0, 40), st.floats(-1e6, 1e6))
def test_merged_are_those_of_all(values: list[float], cut: int, offset: float) -> None:
    x = np.array(values) + offset
    one, two = moments_of(x), moments_of(x[:cut]).merged(moments_of(x[cut:]))
    spread = np.ptp(x) + 1e-9 * (1 + abs(offset))
    np.testing.assert_allclose(two.mean, one.mean, rtol=1e-14, atol=1e-300)
    for power, name in ((2, "M2"), (3, "M3"), (4, "M4")):
        np.testing.assert_allclose(getattr(two, name), getattr(one, name), atol=1e-9 * spread**power * len(values))


def test_constant_figure_has_no_spread() -> None:
    total = reduce(Moments.merged, [moments_of(np.full(37, 0.1))] * 50)
    assert total.mean == pytest.approx(0.1, rel=1e-15)
    assert total.deviation < 1e-16


# ---- tree -----------------------------------------------------------------------------------------------------


def chunk(first: int, last: int) -> Tree:
    tree: Tree = Tree()
    for block in range(first, last):
        tree.add(block, BLOCKS[block])
    return tree


REFERENCE = chunk(0, 53)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.integers(1, 52), max_size=12, unique=True), st.randoms(use_true_random=False))
def test_same_bits_in_any_order_and_chunking(cuts: list[int], random: object) -> None:
    ends = [0, *sorted(cuts), 53]
    chunks = [chunk(a, b) for a, b in pairwise(ends)]
    random.shuffle(chunks)  # type: ignore[attr-defined]
    while len(chunks) > 1:  # and merged pair by pair, as a tree of workers would
        chunks = [
            chunks[n].merge(chunks[n + 1]) if n + 1 < len(chunks) else chunks[n] for n in range(0, len(chunks), 2)
        ]
    (tree,) = chunks
    assert bits(tree.total()) == bits(REFERENCE.total())
    assert tree.nodes.keys() == REFERENCE.nodes.keys() == {(5, 0), (4, 2), (2, 12), (0, 52)}
    assert {level: bits(payload) for level, payload in tree.prefixes.items()} == {
        level: bits(payload) for level, payload in REFERENCE.prefixes.items()
    }


def test_prefixes_are_the_first_blocks() -> None:
    assert sorted(REFERENCE.prefixes) == [0, 1, 2, 3, 4, 5]
    for level, payload in REFERENCE.prefixes.items():
        assert bits(payload) == bits(chunk(0, 1 << level).total())


def test_ranges_and_what_is_missing() -> None:
    tree = chunk(8, 11).merge(chunk(0, 3)).merge(chunk(3, 5))
    assert tree.ranges == [(0, 5), (8, 11)]
    assert Tree().total() is None
    assert Tree().ranges == []
    assert Tree.of(0, BLOCKS[0]).prefixes.keys() == {0}


@pytest.mark.parametrize(("first", "last"), [(5, 6), (0, 1), (0, 16), (7, 9)])
def test_a_block_twice(first: int, last: int) -> None:
    with pytest.raises(ValueError, match="counted twice"):
        chunk(0, 8).merge(chunk(first, last))
    with pytest.raises(ValueError, match="counted twice"):
        chunk(first, last).merge(chunk(0, 8))


def test_saved_and_read_again(tmp_path: object) -> None:
    for tree in (REFERENCE, chunk(3, 20), Tree()):
        np.savez(f"{tmp_path}/tree.npz", **tree.to_arrays())
        with np.load(f"{tmp_path}/tree.npz") as arrays:
            again = Tree.from_arrays(dict(arrays))
        assert {k: bits(v) for k, v in again.nodes.items()} == {k: bits(v) for k, v in tree.nodes.items()}
        assert {k: bits(v) for k, v in again.prefixes.items()} == {k: bits(v) for k, v in tree.prefixes.items()}
