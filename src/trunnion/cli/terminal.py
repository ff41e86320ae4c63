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
    from trunnion.results.attributes import Figure

__all__ = ["bar", "console", "line", "say", "show_figures", "show_rows", "wrote"]

# notes that nearly every result has: they are left to the report and to `check`
QUIET = frozenset({"model.gravity", "simulate.centred"})


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
    """Rows of texts under their heads, broken at plain spaces where they are too wide, so that numbers keep units.

    A table whose words do not fit the terminal is shown in parts, one below the other, each with the columns that name
    its rows. Where no terminal sets a width, it is as wide as its words need.
    """
    from textwrap import wrap

    from rich.table import Table

    line(title, "italic")
    out, table = console(), [head, *rows]
    columns = [(max(len(word) for cell in column for word in cell.split(" ")), max(map(len, column)))
               for column in zip(*table, strict=True)]  # fmt: skip
    if not out.is_terminal and "COLUMNS" not in os.environ:
        out.width = max(out.width, sum(least + BESIDE for least, _ in columns))
    telling = (k for k in range(1, min(4, len(head))) if len({tuple(row[:k]) for row in rows}) == len(rows))
    names = list(range(next(telling, 1)))
    parts = [list(names)]
    for k in range(len(names), len(head)):
        if sum(columns[j][0] + BESIDE for j in [*parts[-1], k]) > out.width and parts[-1] != names:
            out.print()
            parts.append(list(names))
        parts[-1].append(k)
    for part in parts:
        widths, room = [columns[k][1] for k in part], out.width - BESIDE * len(part)
        while sum(widths) > room and (wide := [i for i, k in enumerate(part) if widths[i] > columns[k][0]]):
            widths[max(wide, key=widths.__getitem__)] -= 1
        shown = Table(show_edge=False)
        cells = [["\n".join(wrap(row[k], width, break_long_words=False, break_on_hyphens=False))
                  for k, width in zip(part, widths, strict=True)] for row in table]  # fmt: skip
        for name in cells[0]:
            shown.add_column(name, justify="right", overflow="fold")
        for row in cells[1:]:
            shown.add_row(*row)
        out.print(shown, markup=False, highlight=False)


BESIDE = 3  # what a column takes beside its text


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
