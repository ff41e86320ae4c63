"""The parts of a mechanism: links whose positions depend on each other, and which parts come before which."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from functools import cached_property
from heapq import heappop, heappush

from trunnion.structure.graph import components

__all__ = ["Parts"]


class Parts:
    """Links in parts. links: in the order of the file; edges: (link, link that depends on it)."""

    def __init__(self, links: Sequence[str], edges: Iterable[tuple[str, str]]) -> None:
        number = {link: k for k, link in enumerate(links)}
        pairs = sorted({(number[one], number[other]) for one, other in edges})
        following: list[list[int]] = [[] for _ in links]
        for row, column in pairs:
            following[row].append(column)
        labels = components(following)
        count = max(labels, default=-1) + 1
        self.part_of = dict(zip(links, labels, strict=True))
        self.members: list[list[str]] = [[] for _ in range(count)]
        for link, part in self.part_of.items():
            self.members[part].append(link)
        self.after: list[set[int]] = [set() for _ in range(count)]
        for row, column in pairs:
            if labels[row] != labels[column]:
                self.after[labels[row]].add(labels[column])

    @cached_property
    def before(self) -> list[set[int]]:
        """Of every part, those that it depends on directly."""
        found: list[set[int]] = [set() for _ in self.members]
        for part, following in enumerate(self.after):
            for other in following:
                found[other].add(part)
        return found

    def ordered(self) -> Iterator[int]:
        """The parts, each after those that it depends on; of those that may come next, the one with the first link."""
        place = {link: k for k, link in enumerate(self.part_of)}
        first = [min(place[link] for link in links) for links in self.members]
        waiting = [len(before) for before in self.before]
        ready: list[tuple[int, int]] = []
        for part, count in enumerate(waiting):
            if not count:
                heappush(ready, (first[part], part))
        while ready:
            _, part = heappop(ready)
            yield part
            for other in self.after[part]:
                waiting[other] -= 1
                if not waiting[other]:
                    heappush(ready, (first[other], other))

    def reached(self, some: Iterable[int], backward: bool = False) -> set[int]:
        """Parts that depend on some, those among them; backward: those that they depend on."""
        found, ways = set(some), self.before if backward else self.after
        left = list(found)
        while left:
            more = ways[left.pop()] - found
            found |= more
            left += more
        return found
