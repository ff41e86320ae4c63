"""One table for the terminal and the pages of all results: a title, the heads of the columns, rows of texts."""

from __future__ import annotations

from dataclasses import dataclass, replace

__all__ = ["NONE", "Table"]

NONE = "—"  # a cell whose number is not known


@dataclass(frozen=True)
class Table:
    """A title, the heads of the columns, the rows of texts with their units.

    left_out: how many points of the result have no row, where a long table is thinned.
    """

    title: str
    head: list[str]
    rows: list[list[str]]
    left_out: int = 0

    def titled(self, title: str) -> Table:
        """The same table under another title."""
        return replace(self, title=title)

    def without_empty(self) -> Table:
        """The same without the columns after the first in which no row has a number or word."""
        filled = [k for k in range(len(self.head)) if k == 0 or any(row[k] not in ("", NONE) for row in self.rows)]
        rows = [[row[k] for k in filled] for row in self.rows]
        return replace(self, head=[self.head[k] for k in filled], rows=rows)
