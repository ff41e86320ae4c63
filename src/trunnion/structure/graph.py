"""What a structure asks of small graphs: matching, components and their order, the longest of the shortest loops.

By hand, since a mechanism has tens of links: loading a library of graphs would take a tenth of the time that a small
analysis takes from its start.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence
from graphlib import TopologicalSorter
from heapq import heappop, heappush
from typing import TypeVar

Node = TypeVar("Node", bound=Hashable)


def matching(suitable: Sequence[Sequence[int]], count: int) -> list[int]:
    """Of every row the column it is given, -1 if none is left for it; as many rows as possible get one.

    suitable: columns that suit each row, of `count`. Augmenting paths, each the shortest from a row without a column.
    Source: H. W. Kuhn, The Hungarian method for the assignment problem, Nav. Res. Logist. Q. 2 (1955) 83-97,
    doi:10.1002/nav.3800020109.
    """
    column_of, row_of = [-1] * len(suitable), [-1] * count
    for start in range(len(suitable)):
        came_from: dict[int, int] = {}  # column → the row that reached it
        rows, end = deque([start]), -1
        while rows and end < 0:
            row = rows.popleft()
            for column in suitable[row]:
                if column in came_from:
                    continue
                came_from[column] = row
                if row_of[column] < 0:
                    end = column
                    break
                rows.append(row_of[column])
        while end >= 0:
            row = came_from[end]
            row_of[end] = row
            column_of[row], end = end, column_of[row]
    return column_of


def components(following: Sequence[Iterable[int]]) -> list[int]:
    """Of every node the number of its strongly connected component.

    following: nodes that an edge from each leads to. Two searches without recursion, the second backward.
    Source: M. Sharir, A strong-connectivity algorithm and its applications in data flow analysis, Comput. Math. Appl. 7
    (1981) 67-72, doi:10.1016/0898-1221(81)90008-0.
    """
    finished: list[int] = []
    visited = [False] * len(following)
    for start in range(len(following)):
        stack = [] if visited[start] else [(start, iter(following[start]))]
        visited[start] = True
        while stack:
            node, rest = stack[-1]
            onward = next((other for other in rest if not visited[other]), None)
            if onward is None:
                finished.append(node)
                stack.pop()
            else:
                visited[onward] = True
                stack.append((onward, iter(following[onward])))
    before: list[list[int]] = [[] for _ in following]
    for node, others in enumerate(following):
        for other in others:
            before[other].append(node)
    number, component = [-1] * len(following), -1
    for start in reversed(finished):
        if number[start] < 0:
            component += 1
            for node in reached([start], lambda node: (other for other in before[node] if number[other] < 0)):
                number[node] = component
    return number


def ordered(before: Sequence[Iterable[int]], first: Sequence[int]) -> Iterator[int]:
    """Nodes, each after those before it; of those that may come next, the one with the lowest number of `first`."""
    sorter = TopologicalSorter(dict(enumerate(before)))
    sorter.prepare()
    ready: list[tuple[int, int]] = []
    while sorter.is_active():
        for node in sorter.get_ready():
            heappush(ready, (first[node], node))
        _, node = heappop(ready)
        yield node
        sorter.done(node)


def reached(first: Iterable[Node], after: Callable[[Node], Iterable[Node]]) -> set[Node]:
    """All nodes to which a path leads from the first, these included."""
    nodes = set(first)
    left = list(nodes)
    while left:
        onward = set(after(left.pop())) - nodes
        nodes |= onward
        left += onward
    return nodes


def longest_loop(edges: Sequence[tuple[Node, Node]]) -> int:
    """Edges of the longest loop of a minimum cycle basis of a graph without double edges; 0 if it has no loop.

    Of a shortest path from a node to both ends of an edge, and that edge, for every node and edge, the shortest that do
    not follow from shorter ones make up such a basis.
    Source: J. D. Horton, A polynomial-time algorithm to find the shortest cycle basis of a graph, SIAM J. Comput. 16
    (1987) 358-366, doi:10.1137/0216026.
    """
    near: dict[Node, list[tuple[Node, int]]] = {}
    for k, (first, other) in enumerate(edges):
        near.setdefault(first, []).append((other, 1 << k))
        near.setdefault(other, []).append((first, 1 << k))
    loops: set[int] = set()  # sets of edges, one a bit
    for root in near:
        path, queue = {root: 0}, deque([root])
        while queue:
            node = queue.popleft()
            for other, edge in near[node]:
                if other not in path:
                    path[other] = path[node] | edge
                    queue.append(other)
        loops.update(
            path[first] ^ path[other] ^ 1 << k
            for k, (first, other) in enumerate(edges)
            if first in path and not path[first] & path[other]
        )
    longest, basis = 0, dict[int, int]()  # by its highest edge
    for loop in sorted(loops - {0}, key=int.bit_count):
        rest = loop
        while rest and (top := rest.bit_length()) in basis:
            rest ^= basis[top]
        if rest:
            basis[rest.bit_length()] = rest
            longest = loop.bit_count()
    return longest
