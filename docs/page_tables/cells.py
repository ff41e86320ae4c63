"""The cells and rows of a table in Markdown."""

from __future__ import annotations

import re


def rows_of(head: tuple[str, ...], rows: list[tuple[object, ...]]) -> str:
    """A table with its head; a cell may hold any text."""

    def line(cells: tuple[object, ...]) -> str:
        return "| " + " | ".join(str(cell).replace("|", "&#124;").replace("\n", " ") for cell in cells) + " |"

    return "\n".join([line(head), line(("---",) * len(head)), *(line(row) for row in rows)]) + "\n"


def code(text: object) -> str:
    """As code; nothing for nothing."""
    return f"`{text}`" if text not in ("", None) else ""


def unit(text: str) -> str:
    """A unit with raised exponents."""
    return re.sub(r"\^([0-9])", lambda found: "⁰¹²³⁴⁵⁶⁷⁸⁹"[int(found[1])], text).replace(" ", " ")
