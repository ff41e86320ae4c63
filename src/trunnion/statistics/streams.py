"""Random numbers that depend on their place alone, not on what was drawn before.

`uniforms` gives the numbers of a block from (seed, block), `SobolStream` those of a point from (seed, replicate,
index): any process may work out any part, in any order, and finds the same bits. Arrays are (dims, count); a shorter
block holds the first columns of a longer one. All numbers are odd multiples of 2⁻⁵³ in (0, 1): never 0 or 1, and
1 − u is exact.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import special

__all__ = ["MOST_POINTS", "SobolStream", "correlated", "factor", "mixed", "uniforms"]

Floats = NDArray[np.float64]
Words = NDArray[np.uint64]

MOST_POINTS = 1 << 32
"""Points of one Sobol sequence."""
_BITS = 52
_MONTE_CARLO, _SCRAMBLING = 0, 1


def uniforms(seed: int, block: int, dims: int, count: int) -> Floats:
    """Numbers uniform in (0, 1) of one block, (dims, count).

    Philox4x64-10 with the seed as key; the block is the third word of the counter, so blocks never overlap.
    Source: J. K. Salmon, M. A. Moraes, R. O. Dror, D. E. Shaw, Parallel random numbers: as easy as 1, 2, 3, Proc. SC11
    (2011), doi:10.1145/2063384.2063405. seed: 0 ≤ seed < 2¹²⁸; block: 0 ≤ block < 2⁶⁴.
    """
    # Drawn sample by sample, so that the first samples stay the same when a block is filled further.
    return np.ascontiguousarray(
        _open(_words(seed, block, _MONTE_CARLO, dims * count) >> np.uint64(12)).reshape(count, dims).T
    )


def _words(seed: int, block: int, purpose: int, count: int) -> Words:
    if not 0 <= seed < 1 << 128:
        raise ValueError(f"seed {seed} is not in 0 ... 2^128 - 1")
    key = np.array([seed & 0xFFFFFFFFFFFFFFFF, seed >> 64], dtype=np.uint64)
    counter = np.array([0, 0, block, purpose], dtype=np.uint64)
    return np.random.Philox(key=key, counter=counter).random_raw(count)


def _open(words: Words) -> Floats:
    """(n + ½) 2⁻⁵² of 52-bit integers n, exact in float64."""
    return (words.astype(np.float64) + 0.5) * 2.0**-_BITS


class SobolStream:
    """A Sobol sequence scrambled by random numbers of (seed, replicate): linear matrix scramble and digital shift.

    Each point alone is uniform, the points of a replicate together are even (every 2ᵐ from the start are a net), and
    replicates are independent: the mean over replicates has no bias, and their spread gives its error. The variance of
    a mean is that under Owen's nested scrambling. Sources: S. Joe, F. Y. Kuo, SIAM J. Sci. Comput. 30 (2008) 2635-2654,
    doi:10.1137/070709359 (direction numbers, by `scipy.stats.qmc.Sobol`); J. Matoušek, J. Complexity 14 (1998) 527-556,
    doi:10.1006/jcom.1998.0489 (scramble); A. B. Owen, ACM Trans. Model. Comput. Simul. 13 (2003) 363-378,
    doi:10.1145/945511.945518 (its variance).
    """

    def __init__(self, seed: int, replicate: int, dims: int) -> None:
        words = _words(seed, replicate, _SCRAMBLING, dims * 33).reshape(dims, 33) >> np.uint64(12)
        self.dims = dims
        self._shift = words[:, 32].copy()
        # Column b of the scrambling matrix: a one at digit b (the first is the greatest), random digits below it.
        ones = np.uint64(1) << np.arange(_BITS - 1, _BITS - 33, -1, dtype=np.uint64)
        self._columns = ones | (words[:, :32] & (ones - np.uint64(1)))
        self._scrambled: Words = np.zeros((dims, 0), dtype=np.uint64)

    def points(self, first: int, count: int) -> Floats:
        """Points first ≤ index < first + count of the sequence, (dims, count)."""
        if count == 0:
            return np.empty((self.dims, 0))
        directions = self._directions(first + count)
        start = self._shift.copy()
        for bit in range(first.bit_length()):
            if (first ^ first >> 1) >> bit & 1:
                start ^= directions[:, bit]
        # Point n differs from point n − 1 by the direction of the lowest bit set in n (Gray code).
        index = np.arange(first + 1, first + count, dtype=np.uint64)
        lowest = np.bitwise_count((index & (~index + np.uint64(1))) - np.uint64(1))
        steps = np.concatenate([start[:, None], directions[:, lowest]], axis=1)
        return _open(np.bitwise_xor.accumulate(steps, axis=1))

    def _directions(self, last: int) -> Words:
        """Scrambled direction numbers, (dims, bit), enough for the points below `last`."""
        if last > MOST_POINTS:
            raise ValueError(f"a Sobol sequence has at most 2^32 points, {last} are requested; use more replicates")
        bits = min(32, 8 + -(-max((last - 1).bit_length() - 8, 8) // 4) * 4)
        if self._scrambled.shape[1] < bits:
            plain = direction_numbers(self.dims, bits)
            scrambled = np.zeros((self.dims, bits), dtype=np.uint64)
            for digit in range(bits):
                chosen = plain >> np.uint64(31 - digit) & np.uint64(1)
                scrambled ^= chosen * self._columns[:, digit, None]
            self._scrambled = scrambled
        return self._scrambled


@lru_cache(maxsize=8)
def direction_numbers(dims: int, bits: int) -> Words:
    """The first direction numbers of the Sobol sequence, (dims, bits), as 32-bit fractions.

    They are read off scipy's points: in Gray code order point 2ʲ is the sum (exclusive or) of direction numbers j and
    j − 1. Time goes with dims · 2^bits: 0.05 s for 10 dimensions and 24 bits.
    """
    # Only a study by quasi-Monte Carlo needs scipy.stats, which takes longer to import than all the rest here.
    from scipy.stats import qmc

    engine: Any = qmc.Sobol(dims, scramble=False, bits=32)
    numbers = np.zeros((dims, bits), dtype=np.uint64)
    done = 0
    for bit in range(bits):
        engine.fast_forward((1 << bit) - done)
        numbers[:, bit] = (engine.random(1)[0] * 2.0**32).astype(np.uint64)
        if bit:
            numbers[:, bit] ^= numbers[:, bit - 1]
        done = (1 << bit) + 1
    numbers.flags.writeable = False
    return numbers


def factor(correlation: Any) -> Floats:
    """Lower triangle L with L Lᵀ = correlation, of a positive semidefinite matrix; ValueError if it is not.

    Cholesky's; a number that those before it determine (pivot 0 to rounding) has a zero on the diagonal.
    """
    matrix = np.asarray(correlation, dtype=np.float64)
    size = len(matrix)
    lower, rounding = np.zeros((size, size)), 1e-12 * size
    for j in range(size):
        pivot = matrix[j, j] - sum(lower[j, k] ** 2 for k in range(j))
        if pivot < -rounding:
            raise ValueError("the correlations contradict one another: their matrix is not positive semidefinite")
        rest = matrix[j:, j] - np.array([sum(lower[i, k] * lower[j, k] for k in range(j)) for i in range(j, size)])
        if pivot > rounding:
            lower[j:, j] = rest / np.sqrt(pivot)
        elif np.any(np.abs(rest) > np.sqrt(rounding)):
            raise ValueError("the correlations contradict one another: their matrix is not positive semidefinite")
    return lower


def mixed(scores: Floats, matrix: Floats) -> Floats:
    """M z, summed in fixed order: a matrix product of a library may depend on the number of columns in its last bit."""
    mixed = np.zeros_like(scores)
    for place, score in enumerate(scores):
        mixed += matrix[:, place, None] * score
    return mixed


def correlated(u: Floats, matrix: Floats) -> Floats:
    """Uniform numbers whose normal scores Φ⁻¹(u) are mixed: Φ(M Φ⁻¹(u)), a Gaussian copula. (dims, count).

    u: independent, in (0, 1); matrix: L of `factor` to correlate them, or a rotation, which leaves them independent.
    The result is kept in (0, 1).
    """
    return np.asarray(
        np.clip(special.ndtr(mixed(special.ndtri(u), matrix)), 2.0**-1000, 1 - 2.0**-53), dtype=np.float64
    )
