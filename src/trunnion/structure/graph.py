"""A maximum matching and the strongly connected components of small graphs.

By hand, since a mechanism has tens of links: loading SciPy's sparse matrices would take a tenth of the time that a
small analysis takes from its start (networkx as much).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

__all__ = ["components", "matching"]


def matching(wanted: Sequence[Sequence[int]], count: int) -> list[int]:
    """Of every row the column it is given, -1 if none is left for it; as many rows as possible get one.

    wanted: columns that suit each row, of `count`. Augmenting paths, each the shortest from a row without a column.
    Source: H. W. Kuhn, The Hungarian method for the assignment problem, Nav. Res. Logist. Q. 2 (1955) 83-97,
    doi:10.1002/nav.3800020109.
    """
    column_of, row_of = [-1] * len(wanted), [-1] * count
    for start in range(len(wanted)):
        came_from: dict[int, int] = {}  # column → the row that reached it
        rows, end = deque([start]), -1
        while rows and end < 0:
            row = rows.popleft()
            for column in wanted[row]:
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


def components(following: Sequence[Sequence[int]]) -> list[int]:
    """Of every node the number of its strongly connected component.

    following: nodes that an edge from each leads to. Two searches without recursion, the second backward.
    Source: M. Sharir, A strong-connectivity algorithm and its applications in data flow analysis, Comput. Math. Appl. 7
    (1981) 67-72, doi:10.1016/0898-1221(81)90008-0.
    """
    finished: list[int] = []
    seen = [False] * len(following)
    for start in range(len(following)):
        stack = [] if seen[start] else [(start, iter(following[start]))]
        seen[start] = True
        while stack:
            node, others = stack[-1]
            other = next((one for one in others if not seen[one]), None)
            if other is None:
                finished.append(node)
                stack.pop()
            else:
                seen[other] = True
                stack.append((other, iter(following[other])))
    before: list[list[int]] = [[] for _ in following]
    for node, others_of in enumerate(following):
        for other in others_of:
            before[other].append(node)
    number, component = [-1] * len(following), -1
    for start in reversed(finished):
        left = [start] if number[start] < 0 else []
        component += bool(left)
        while left:
            node = left.pop()
            if number[node] < 0:
                number[node] = component
                left += before[node]
    return number
