"""The matching and the components of structure/graph.py against those of SciPy."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components, maximum_bipartite_matching

from trunnion.structure.graph import components, longest_loop, matching

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


def loops_up_to(edges: list[tuple[int, int]], most: int) -> list[int]:
    """All loops of at most so many edges, each a set of edges as bits."""
    number = {pair: 1 << k for k, edge in enumerate(edges) for pair in (edge, edge[::-1])}
    ways = [([start], 0) for start in {node for edge in edges for node in edge}]
    loops = set()
    while ways:
        path, used = ways.pop()
        for node in (other for one, other in number if one == path[-1] and not used & number[one, other]):
            bits = used | number[path[-1], node]
            if node == path[0]:
                loops.add(bits)
            elif node not in path and len(path) < most:
                ways.append(([*path, node], bits))
    return list(loops)


def independent(rows: list[int]) -> int:
    """How many sets of edges do not follow from others."""
    basis: list[int] = []
    for row in rows:
        for other in basis:
            row = min(row, row ^ other)
        basis += [row] * bool(row)
    return len(basis)


@given(st.sets(st.tuples(st.integers(0, 6), st.integers(0, 6)).filter(lambda pair: pair[0] < pair[1]), max_size=12))
def test_loops_up_to_the_longest_span_all_and_shorter_ones_do_not(pairs: set[tuple[int, int]]) -> None:
    edges = sorted(pairs)
    longest, all_of_them = longest_loop(edges), independent(loops_up_to(edges, 7))
    assert independent(loops_up_to(edges, longest)) == all_of_them
    assert independent(loops_up_to(edges, longest - 1)) < all_of_them or longest == 0
