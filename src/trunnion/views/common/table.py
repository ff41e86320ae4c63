"""A table of texts, as the terminal and the pages show it."""

from __future__ import annotations

from typing import NamedTuple

__all__ = ["TextTable"]


class TextTable(NamedTuple):
    """A title, the heads of the columns, the rows."""

    title: str
    head: list[str]
    rows: list[list[str]]
