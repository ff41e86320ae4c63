"""One way from a result to its files, tables, findings and exit status, for every verb that has one; what is printed:
tables on the output, findings on the error stream; nothing is taken for markup."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import typer

from trunnion.cli.options import IMAGES, Files, Model, placed
from trunnion.errors import Finding, MechanismError, Severity, counted
from trunnion.results.attributes import findings_of, summary_of
from trunnion.results.quantities import parts

if TYPE_CHECKING:
    import xarray as xr

    from trunnion.model.mechanism import Mechanism
    from trunnion.results.attributes import Figure
    from trunnion.results.dataset import Result

PAGES = (".html", ".htm")  # a report is HTML
YAML, MODELS = (".yaml", ".yml"), (".yaml", ".yml", ".json")
# notes that nearly every result has: they are left to the report and to `check`
QUIET = frozenset({"model.gravity", "simulate.centred"})
BESIDE = 3  # what a column takes beside its text


# ---- before anything is computed ------------------------------------------------------------------------------


def check_files(
    files: Files, of: str = "", kind: str | None = None, drawn: bool = True, instead: str = "", in_play: bool = True
) -> None:
    """MechanismError for a file that cannot be written, or a table or figure that a result of some kind (`of`) has not.

    drawn: whether figures can be written; instead: what writes them where they cannot; in_play: whether a joint is.
    """
    others = IMAGES if drawn else ()
    for key, usual in (("units_row", False), ("units", "si"), ("columns", None)):
        if getattr(files, key) != usual and not files.out:
            raise MechanismError(Finding("has no effect without a file to write", key, "give --out too"))
    for path in files.out or ():
        if instead and path.suffix.lower() in IMAGES:
            what = f"cannot write a result as '{path.suffix.lower()}'"
            raise MechanismError(Finding(what, "--out", f"figures: {instead} --out {path}"))
        if path.suffix.lower() not in others:
            from trunnion.results.save import check_format  # with xarray, which only a file needs
            from trunnion.results.tables import check_table

            check_format(path, others)
            if of:
                check_table(path, of, in_play)
    if files.report is not None:
        check_target(files.report, "--report", "a report", PAGES)
    if kind is not None:
        from trunnion.views.shown import check_kind

        check_kind(of, kind)


def check_target(path: Path, option: str, what: str, kinds: Sequence[str], over: bool = True) -> None:
    """MechanismError for a file of no such kind, or one that is there already unless it may be written over."""
    if path.suffix.lower() not in kinds:
        remedy = f"write {' or '.join(kind for kind in kinds if kind != '.yml')}"
        raise MechanismError(Finding(f"{what} is not written as '{path.suffix}'", option, remedy))
    if path.exists() and not over:
        raise MechanismError(Finding(f"'{path}' exists", option, "name another file, or add --force"))


def check_model(write: Path | None, file: Path, force: bool) -> None:
    """MechanismError for a model that cannot be written, or over the one that is read."""
    if write is None:
        return
    check_target(write, "--write", "a model", MODELS)
    if not force and write.exists() and file.exists() and write.samefile(file):
        raise MechanismError(Finding(f"'{write}' is the model itself", "--write", "name another file, or add --force"))


# ---- afterwards -----------------------------------------------------------------------------------------------


def exit_status(findings: Iterable[Finding]) -> int:
    """1 if any finding is an error."""
    return int(any(finding.severity is Severity.ERROR for finding in findings))


def end(findings: Sequence[Finding], file: Path, sections: str = "", every: bool = False) -> NoReturn:
    """Findings with their lines in the model on the error stream, and the exit status: 1 with any error.

    sections: of the model, to which lines are limited; every: also notes that nearly every result has.
    """
    say(placed(findings, file, sections.split()), every)
    raise typer.Exit(exit_status(findings))


@dataclass
class Shown:
    """A result and what is done with it.

    sections: of the model, whose lines findings get. uncut: whether pictures show peaks in full; drawn, paged: options
    of figure and report, as the view has them. tables: what is printed, `most` rows of each, the file `rest` has the
    others; the summary if there are none. show: prints something else. others: findings beside those of the result,
    which are said as they are.
    """

    result: xr.Dataset | Result
    model: Model
    files: Files
    sections: str
    uncut: bool = False
    drawn: Mapping[str, Any] = field(default_factory=dict)
    paged: Mapping[str, Any] = field(default_factory=dict)
    tables: Sequence[Any] = ()
    most: int = 0
    rest: str = ""
    apart: bool = True
    show: Callable[[], None] | None = None
    others: Sequence[Finding] = ()
    written: list[Path] = field(default_factory=list)

    @property
    def dataset(self) -> xr.Dataset:
        """The result as files take it."""
        from trunnion.results.dataset import Result  # with NumPy, which help does not need

        return self.result.dataset if isinstance(self.result, Result) else self.result

    @property
    def pictured(self) -> xr.Dataset:
        """The result as pictures show it."""
        from trunnion.views.curves import whole_peaks

        return whole_peaks(self.dataset, self.uncut)

    @property
    def name(self) -> str:
        """Whose result it is."""
        return str(self.result.attrs["name"] or self.model.file)

    def write(self) -> None:
        """Write every file that is named."""
        files = self.files
        for path in files.out or ():
            if path.suffix.lower() in IMAGES:
                from trunnion.views.draw import save as save_figure
                from trunnion.views.shown import plot

                save_figure(plot(self.pictured, **self.drawn), path)
            else:
                from trunnion.results.save import save

                save(self.dataset, path, files.units_row, files.columns, files.units)
            self.written.append(path)
        if files.report is not None:
            from trunnion.views.shown import report

            write_text(report(self.pictured, **self.paged), files.report)
            self.written.append(files.report)

    def write_model(self, mechanism: Mechanism, path: Path, over: bool) -> None:
        """Write the model with what was found; over: also over the one that was read."""
        from trunnion.model.rewrite import rewrite_mechanism

        rewrite_mechanism(mechanism, self.model.file, path, over)
        self.written.append(path)

    def end(self, findings: Sequence[Finding] | None = None, status: int | None = None) -> NoReturn:
        """Tables and files on the output, findings on the error stream, and the exit status: 1 with any error.

        findings: those of the result if not given; status: where another than that of the findings.
        """
        if self.show:
            self.show()
        elif self.tables:
            show_tables(self.name, self.tables, self.apart, self.most, self.rest)
        else:
            show_figures(f"{self.name}\n{self.result.attrs['formula']}", summary_of(self.result))
        for path in self.written:
            wrote(path)
        findings = findings_of(self.result) if findings is None else findings
        say(self.others)
        say(placed(findings, self.model.file, self.sections.split()))
        raise typer.Exit(exit_status([*self.others, *findings]) if status is None else status)

    def finish(self, status: int | None = None) -> NoReturn:
        """Write, show and end."""
        self.write()
        self.end(status=status)


def write_text(text: str, path: Path) -> None:
    """Write a text file, whole or not at all."""
    from trunnion.files import whole

    with whole(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


def show_tables(name: str, tables: Sequence[Any], apart: bool = True, most: int = 0, rest: str = "") -> None:
    """Tables, the first under a name. apart: with a line between them; most: rows of each that are shown, all if 0;
    rest: the file that has the others.
    """
    for i, table in enumerate(tables):
        if i and apart:
            line()
        title = f"{name}\n{table.title}" if i == 0 and name else table.title
        show_rows(title, table.head, table.rows[: most or None])
        if most and len(table.rows) > most:
            line(f"{counted(len(table.rows) - most, 'row')} more; --out {rest} has all")


# ---- what is printed -----------------------------------------------------------------------------------------------


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
