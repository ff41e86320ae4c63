"""What the command line prints: tables on the output, findings on the error stream; nothing is taken for markup."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from trunnion.errors import Finding, Severity
from trunnion.results.quantities import parts

if TYPE_CHECKING:
    from trunnion.results.figure import Figure

__all__ = ["bar", "console", "line", "say", "show_figures", "show_rows", "wrote"]

# notes that nearly every result has: they are left to the report and to `check`
QUIET = frozenset({"model.gravity", "samples.engine", "simulate.centred"})


def console() -> Any:
    """Where tables go."""
    from rich.console import Console

    return Console(emoji=False)  # else `effort:O:` has a circle


def line(text: str = "", style: str = "") -> None:
    """Print a text as it is, on one line however long."""
    console().print(text, style=style, markup=False, highlight=False, soft_wrap=True)


def wrote(path: Path) -> None:
    """Tell of a file that is written."""
    line(f"wrote {path}")


def show_figures(title: str, figures: Sequence[Figure]) -> None:
    """Figures with label, value and a unit that fits its size; nothing if there are none."""
    if not figures:
        return
    from rich.table import Table

    table = Table(title=title, title_justify="left", show_edge=False)
    table.add_column("")
    table.add_column("value", justify="right")
    table.add_column("unit")
    for figure in figures:
        value = "undefined" if figure.value is None else figure.value
        text, unit = (value, figure.unit) if isinstance(value, str) else parts(value, figure.unit)
        table.add_row(figure.label, text, "" if unit == "1" else unit)
    console().print(table, markup=False, highlight=False)


def show_rows(title: str, head: list[str], rows: list[list[str]]) -> None:
    """Rows of texts under their heads, broken between words where they are too wide, but not before a unit.

    A table whose words do not fit the terminal has narrower gaps between its columns; if that does not help, it is
    shown in parts, one below the other, each with the columns that name its rows. Where no terminal sets a width, it is
    as wide as its words need: no number is broken.
    """
    from rich.table import Table

    line(title, "italic")
    out = console()
    if not out.is_terminal and "COLUMNS" not in os.environ:
        out.width = max(out.width, sum(_widths([head, *rows])[0]) + _frame(head))
    gap = next((gap for gap in GAPS if len(_parts([head, *rows], out.width, gap)) == 1), GAPS[0])
    for number, columns_shown in enumerate(_parts([head, *rows], out.width, gap)):
        if number:
            out.print()
        part = [[row[k] for k in columns_shown] for row in [head, *rows]]
        cells = _fitted(part, out.width - _frame(part[0], gap))
        table = Table(show_edge=False, padding=PADDING[gap])
        for name in cells[0]:
            table.add_column(name, justify="right", overflow="fold", no_wrap=cells[0] is not part[0])
        for row in cells[1:]:
            table.add_row(*row)
        out.print(table, markup=False, highlight=False)


PADDING = {3: (0, 1, 0, 1), 2: (0, 0, 0, 1), 1: (0, 0, 0, 0)}  # of a cell, by how much a column takes beside its text
GAPS = tuple(PADDING)


def _frame(columns: Sequence[Any], gap: int = 3) -> int:
    """How much of a line the lines and gaps between so many columns take."""
    return gap * len(columns) - 1


def _widths(rows: list[list[str]]) -> tuple[list[int], list[int]]:
    """How wide each column is at least, by its longest word, and how wide it is by its longest cell."""
    from rich.cells import cell_len

    columns = list(zip(*rows, strict=True))
    least = [max(cell_len(word) for cell in column for word in cell.split(" ")) for column in columns]
    return least, [max(map(cell_len, column)) for column in columns]


def _parts(rows: list[list[str]], width: int, gap: int = 3) -> list[list[int]]:
    """Columns of each table that a table is shown as: all in one if their words fit the width.

    Otherwise each begins with the columns in which every row differs from the others.
    """
    least, longest = _widths(rows)
    if sum(least) + _frame(least, gap) <= width:
        return [list(range(len(least)))]
    room = [max(low, min(WIDE, high)) for low, high in zip(least, longest, strict=True)]
    telling = (k for k in range(1, min(4, len(room))) if len({tuple(row[:k]) for row in rows}) == len(rows))
    count = next(telling, 1)
    names = list(range(count))
    parts = [list(names)]
    for k in range(count, len(room)):
        longer = [*parts[-1], k]
        if len(parts[-1]) > count and sum(room[j] for j in longer) + _frame(longer) > width:
            parts.append([*names, k])
        else:
            parts[-1] = longer
    return parts


WIDE = 20  # of a column that is not broken into more lines, where a table is shown in parts


def _fitted(rows: list[list[str]], room: int) -> list[list[str]]:
    """The cells broken into lines at plain spaces so that all columns take so much room; as they are if they do, or
    cannot. rich itself breaks at spaces that are not to be broken, too."""
    least, widths = _widths(rows)
    if sum(widths) <= room or sum(least) > room:
        return rows
    while sum(widths) > room:
        widest = max((k for k in range(len(widths)) if widths[k] > least[k]), key=widths.__getitem__)
        widths[widest] -= 1
    return [[_broken(cell, width) for cell, width in zip(row, widths, strict=True)] for row in rows]


def _broken(text: str, width: int) -> str:
    """A text in lines no wider than this, broken at plain spaces."""
    from rich.cells import cell_len

    lines = [""]
    for word in text.split(" "):
        longer = f"{lines[-1]} {word}" if lines[-1] else word
        if cell_len(longer) <= width or not lines[-1]:
            lines[-1] = longer
        else:
            lines.append(word)
    return "\n".join(lines)


def say(findings: Iterable[Finding], every: bool = False) -> None:
    """Findings on the error stream, one a paragraph, nothing in them taken for markup.

    every: also those that nearly every result has.
    """
    for finding in findings:
        if every or finding.severity is not Severity.NOTE or finding.code not in QUIET:
            print(str(finding), file=sys.stderr)


@contextmanager
def bar(what: str, total: int | None, least: int = 0) -> Iterator[Callable[[int], None] | None]:
    """A progress bar on the error stream, to be called with how many are done; None off a terminal or below `least`.

    total: None where it is not known beforehand: the bar then only counts. Where TRUNNION_PROGRESS is set, what is done
    is written for a program that reads it.
    """
    if os.environ.get("TRUNNION_PROGRESS"):
        yield lambda done: print(f"\x1e{done}/{total or '-'}", file=sys.stderr, flush=True)
        return
    if (total is not None and total < least) or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import MofNCompleteColumn, Progress

    columns = (*Progress.get_default_columns(), MofNCompleteColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task(what, total=total)
        yield lambda done: progress.update(task, completed=done)
