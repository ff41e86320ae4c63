"""Random numbers by place: Philox worked out here, Sobol nets, any order and any part the same bits."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from trunnion.statistics.streams import MOST_POINTS, SobolStream, correlated, direction_numbers, factor, uniforms

MASK = (1 << 64) - 1


def philox(counter: list[int], key: list[int]) -> list[int]:
    """Philox4x64-10 of Salmon et al. (2011), in whole numbers."""
    c, k = list(counter), list(key)
    for _ in range(10):
        first, second = 0xD2E7470EE14C6C93 * c[0], 0xCA5A826395121157 * c[2]
        c = [second >> 64 ^ c[1] ^ k[0], second & MASK, first >> 64 ^ c[3] ^ k[1], first & MASK]
        k = [k[0] + 0x9E3779B97F4A7C15 & MASK, k[1] + 0xBB67AE8584CAA73B & MASK]
    return c


def test_philox_known_answer() -> None:
    """The authors' test vector for counter 0, key 0 (Random123, kat_vectors)."""
    known = [0x16554D9ECA36314C, 0xDB20FE9D672D0FDC, 0xD7E772CEE186176B, 0x7E68B68AEC7BA23B]
    assert philox([0, 0, 0, 0], [0, 0]) == known


@pytest.mark.parametrize("seed", [0, 1, 2**64 + 5, 2**128 - 1])
@pytest.mark.parametrize("block", [0, 7, 2**40])
def test_uniforms_are_philox(seed: int, block: int) -> None:
    words = [w for n in range(1, 4) for w in philox([n, 0, block, 0], [seed & MASK, seed >> 64])]
    expected = (np.array([w >> 12 for w in words], dtype=np.float64) + 0.5) / 2**52
    np.testing.assert_array_equal(uniforms(seed, block, 4, 3), expected.reshape(3, 4).T)


@given(st.integers(0, 2**63), st.integers(0, 2**40), st.integers(1, 12), st.integers(1, 60), st.integers(1, 60))
def test_a_shorter_block_begins_a_longer_one(seed: int, block: int, dims: int, short: int, more: int) -> None:
    whole = uniforms(seed, block, dims, short + more)
    np.testing.assert_array_equal(uniforms(seed, block, dims, short), whole[:, :short])
    assert whole.flags.c_contiguous
    assert (whole > 0).all() and (whole < 1).all()  # noqa: PT018


def test_uniforms_are_uniform_and_independent() -> None:
    u = np.concatenate([uniforms(11, block, 5, 200) for block in range(500)], axis=1)
    assert all(stats.kstest(row, "uniform").pvalue > 1e-3 for row in u)
    correlation = np.corrcoef(np.concatenate([u, uniforms(12, 0, 1, 100_000)]))
    assert np.abs(correlation - np.eye(6)).max() < 4 / np.sqrt(100_000)


def test_seed_out_of_range() -> None:
    with pytest.raises(ValueError, match="seed -1"):
        uniforms(-1, 0, 1, 1)


# ---- Sobol ----------------------------------------------------------------------------------------------------


def test_directions_make_scipys_points() -> None:
    engine = stats.qmc.Sobol(60, scramble=False, bits=32)
    expected = engine.random(1 << 12).T
    numbers, index = direction_numbers(60, 16), np.arange(1 << 12)
    gray, points = index ^ index >> 1, np.zeros((60, 1 << 12), dtype=np.uint64)
    for bit in range(16):
        points ^= (gray >> bit & 1).astype(np.uint64) * numbers[:, bit, None]
    np.testing.assert_array_equal(points / 2**32, expected)


@settings(max_examples=60, deadline=None)
@given(
    st.integers(0, 2**50), st.integers(0, 50), st.integers(1, 9), st.lists(st.integers(0, 40), max_size=6), st.data()
)
def test_any_part_the_same_bits(seed: int, replicate: int, dims: int, parts: list[int], data: st.DataObject) -> None:
    first = data.draw(st.integers(0, 2**17))
    whole = SobolStream(seed, replicate, dims).points(first, sum(parts))
    stream, starts = SobolStream(seed, replicate, dims), np.cumsum([first, *parts])
    for place in data.draw(st.permutations(range(len(parts)))):
        start = starts[place] - first
        np.testing.assert_array_equal(
            stream.points(int(starts[place]), parts[place]), whole[:, start : start + parts[place]]
        )


@pytest.mark.parametrize("replicate", [0, 3])
def test_scrambled_points_are_a_net(replicate: int) -> None:
    """Every 2ᵐ points from a multiple of 2ᵐ on have one in each 2ᵐth of every axis; 1, 2 are a (0, m, 2)-net."""
    stream = SobolStream(5, replicate, 20)
    for first in (0, 1 << 10, 7 << 10):
        points = stream.points(first, 1 << 10)
        assert (np.sort(np.floor(points * 2**10), axis=1) == np.arange(2**10)).all()
        for power in range(11):
            cell = np.floor(points[0] * 2**power) * 2 ** (10 - power) + np.floor(points[1] * 2 ** (10 - power))
            assert len(set(cell)) == 2**10
    assert (points > 0).all()
    assert (points < 1).all()


def test_far_points_without_those_before() -> None:
    stream = SobolStream(1, 0, 3)
    a, b = stream.points((1 << 24) - 3, 3), stream.points((1 << 24) - 2, 40)
    np.testing.assert_array_equal(a[:, 1:], b[:, :2])
    with pytest.raises(ValueError, match="more replicates"):
        stream.points(MOST_POINTS - 1, 2)


def test_replicates_are_uniform_and_independent() -> None:
    """One point of many replicates: uniform, and points of it not related to each other."""
    points = np.stack(
        [SobolStream(9, replicate, 4).points(5, 2) for replicate in range(4000)]
    )  # (replicate, dim, point)
    flat = points.reshape(4000, -1)
    assert all(stats.kstest(column, "uniform").pvalue > 1e-3 for column in flat.T)
    across = np.corrcoef(np.concatenate([points[:, :, 0].T]))
    assert np.abs(across - np.eye(4)).max() < 4 / np.sqrt(4000)


def test_error_falls_faster_than_that_of_plain_samples() -> None:
    """Mean of a smooth function of 4 numbers: standard error over replicates about n^-1.5, against n^-0.5."""

    def error(count: int) -> float:
        means = [np.prod(SobolStream(2, r, 4).points(0, count) ** 2 * 3, axis=0).mean() for r in range(32)]
        assert np.mean(means) == pytest.approx(1, abs=4 * np.std(means) / np.sqrt(31))
        return float(np.std(means, ddof=1))

    assert np.log2(error(1 << 6) / error(1 << 12)) / 6 > 1.1
    assert error(1 << 12) < 0.01 * np.sqrt(1.8**4 - 1) / np.sqrt(1 << 12) * 3


# ---- correlation ----------------------------------------------------------------------------------------------


@given(st.integers(0, 1000), st.integers(1, 8), st.integers(1, 8))
def test_factor_of_any_rank(seed: int, size: int, rank: int) -> None:
    rows = np.random.default_rng(seed).normal(size=(size, rank))
    rows /= np.linalg.norm(rows, axis=1)[:, None]
    lower = factor(rows @ rows.T)
    np.testing.assert_allclose(lower @ lower.T, rows @ rows.T, atol=1e-7)
    assert (np.triu(lower, 1) == 0).all()


@pytest.mark.parametrize(
    "matrix",
    [[[1, 1.1], [1.1, 1]], [[1, 1, 0], [1, 1, 0.5], [0, 0.5, 1]], [[1, 0.9, -0.9], [0.9, 1, 0.9], [-0.9, 0.9, 1]]],
)
def test_contradictory_correlations(matrix: list[list[float]]) -> None:
    with pytest.raises(ValueError, match="contradict"):
        factor(matrix)


def test_correlated_normal_scores() -> None:
    matrix = np.array([[1, 0.5, -0.3], [0.5, 1, 0.2], [-0.3, 0.2, 1]])
    u = correlated(uniforms(4, 0, 3, 200_000), factor(matrix))
    assert all(stats.kstest(row, "uniform").pvalue > 1e-3 for row in u)
    np.testing.assert_allclose(np.corrcoef(stats.norm.ppf(u)), matrix, atol=0.01)


def test_correlated_stays_inside() -> None:
    u = np.full((2, 1), 1 - 2.0**-53)
    assert (correlated(u, factor([[1, 0.9], [0.9, 1]])) < 1).all()
    u = np.full((2, 1), 2.0**-53)
    assert (correlated(u, factor([[1, 0.9], [0.9, 1]])) > 0).all()
