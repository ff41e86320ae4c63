"""The matching and the components of structure/graph.py against those of SciPy."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components, maximum_bipartite_matching

from trunnion.structure.graph import components, matching

COUNTS = st.integers(1, 12)


@st.composite
def relations(draw: st.DrawFn, square: bool = False) -> np.ndarray:
    """Which of n rows is related to which of m columns."""
    rows = draw(COUNTS)
    columns = rows if square else draw(COUNTS)
    bits = draw(st.lists(st.booleans(), min_size=rows * columns, max_size=rows * columns))
    return np.array(bits, dtype=np.int8).reshape(rows, columns)


def lists(relation: np.ndarray) -> list[list[int]]:
    return [np.flatnonzero(row).tolist() for row in relation]


@given(relations())
def test_as_many_rows_are_matched_as_can_be(relation: np.ndarray) -> None:
    """No column twice, only columns that suit, and as many as SciPy's Hopcroft-Karp matches."""
    found = matching(lists(relation), relation.shape[1])
    taken = [(row, column) for row, column in enumerate(found) if column >= 0]
    assert len({column for _, column in taken}) == len(taken)
    assert all(relation[pair] for pair in taken)
    assert len(taken) == np.count_nonzero(maximum_bipartite_matching(csr_array(relation), "column") >= 0)


@given(relations(square=True))
def test_components_are_those_of_scipy(relation: np.ndarray) -> None:
    count, labels = connected_components(csr_array(relation), directed=True, connection="strong")
    found = components(lists(relation))
    assert len(set(zip(found, labels.tolist(), strict=True))) == count == len(set(found))


def test_a_long_chain_and_a_long_loop() -> None:
    """Twenty thousand nodes: no recursion."""
    n = 20_000
    assert sorted(components([[i + 1] for i in range(n - 1)] + [[]])) == list(range(n))
    assert set(components([[(i + 1) % n] for i in range(n)])) == {0}
    assert matching([[i] for i in range(n)], n) == list(range(n))


def test_nothing() -> None:
    assert matching([], 0) == []
    assert components([]) == []
