"""One way from a result to its files, tables, findings and exit status, for every verb that has one."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import typer

from trunnion.cli.model import exit_status, placed
from trunnion.cli.options import IMAGES
from trunnion.cli.terminal import console, say, say_missed, show_figures, show_rows, wrote
from trunnion.errors import Finding, MechanismError, counted
from trunnion.results.attributes import Described, findings_of, summary_of
from trunnion.results.result import Result

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Shown", "check_files", "check_model", "check_page", "show_summary", "show_tables"]

PAGES = (".html", ".htm")
MODELS = (".yaml", ".yml", ".json")


# ---- before anything is computed ------------------------------------------------------------------------------


def check_files(
    out: Sequence[Path],
    report: Path | None = None,
    drawn: bool = True,
    of: str = "",
    kind: str | None = None,
    instead: str = "",
) -> None:
    """MechanismError for a file that cannot be written, or a table or figure that a result of some kind (`of`) has not.

    drawn: whether figures can be written; instead: what writes them where they cannot.
    """
    others = IMAGES if drawn else ()
    for path in out:
        if instead and path.suffix.lower() in IMAGES:
            what = f"cannot write a result as '{path.suffix.lower()}'"
            raise MechanismError(Finding(what, "--out", f"figures: {instead} --out {path}"))
        if path.suffix.lower() not in others:
            from trunnion.results.export import check_format  # with xarray, which only a file needs
            from trunnion.results.tables import check_table

            check_format(path, others)
            if of:
                check_table(path, of)
    check_page(report, "--report")
    if kind is not None:
        from trunnion.views.shown import check_kind

        check_kind(of, kind)


def check_page(path: Path | None, option: str) -> None:
    """MechanismError for a report that is no HTML."""
    if path is not None and path.suffix.lower() not in PAGES:
        what = f"a report is HTML, '{path.name}' is not"
        raise MechanismError(Finding(what, option, "write a .html file and print it"))


def check_model(write: Path | None, file: Path, force: bool) -> None:
    """MechanismError for a model that cannot be written, or over the one that is read."""
    if write is None:
        return
    if write.suffix.lower() not in MODELS:
        raise MechanismError(Finding(f"a model is not written as '{write.suffix}'", "--write", "write .yaml or .json"))
    if not force and write.exists() and file.exists() and write.samefile(file):
        raise MechanismError(Finding(f"'{write}' is the model itself", "--write", "name another file, or add --force"))


# ---- afterwards -----------------------------------------------------------------------------------------------


@dataclass
class Shown:
    """A result and what is done with it.

    file: of the model, whose lines the findings get, in these sections where they name no place. out, report: files to
    write. drawn: options of the figure, such as its kind; draw: another figure, by the path of its file, or None; page:
    the report as HTML; show: prints the tables, the summary if not given; others: findings beside those of the result,
    which are said as they are; columns, units: those of a table file, see `save`.
    """

    result: xr.Dataset | Result
    file: Path
    sections: Sequence[str]
    out: Sequence[Path] = ()
    report: Path | None = None
    units_row: bool = False
    drawn: Mapping[str, Any] = field(default_factory=dict)
    draw: Callable[[Path], Any] | None = None
    page: Callable[[], str] | None = None
    show: Callable[[], None] | None = None
    others: Iterable[Finding] = ()
    written: list[Path] = field(default_factory=list)
    columns: Sequence[str] | None = None
    units: str = "si"

    @property
    def dataset(self) -> xr.Dataset:
        """The result as files, figures and reports take it."""
        return self.result.dataset if isinstance(self.result, Result) else self.result

    def write(self) -> None:
        """Write every file that is asked for."""
        for path in self.out:
            if path.suffix.lower() not in IMAGES:
                from trunnion.results.export import save

                save(self.dataset, path, self.units_row, self.columns, self.units)  # type: ignore[arg-type]  # it checks them
            elif not self._drawn(path):
                continue
            self.written.append(path)
        if self.report is not None:
            from trunnion.views.shown import report_of

            write_text(self.page() if self.page else report_of(self.dataset), self.report)
            self.written.append(self.report)

    def _drawn(self, path: Path) -> bool:
        from trunnion.views.cycle.plots import save
        from trunnion.views.shown import figure_of

        figure = self.draw(path) if self.draw else figure_of(self.dataset, **self.drawn)
        if figure is None:
            return False
        save(figure, path)
        return True

    def end(self, findings: Sequence[Finding] | None = None, status: int | None = None) -> NoReturn:
        """Tables and files on the output, findings on the error stream, and the exit status: 1 with any error.

        findings: those of the result if not given; status: where another than that of the findings.
        """
        if self.show is None:
            show_summary(self.result, self.file)
        else:
            say_missed(self.result)
            self.show()
        for path in self.written:
            wrote(path)
        told, others = findings_of(self.result) if findings is None else findings, list(self.others)
        say(others)
        say(placed(told, self.file, self.sections))
        raise typer.Exit(exit_status([*others, *told]) if status is None else status)

    def finish(self, status: int | None = None) -> NoReturn:
        """Write, show and end."""
        self.write()
        self.end(status=status)


def write_text(text: str, path: Path) -> None:
    """Write a text file, whole or not at all."""
    from trunnion.files import whole

    with whole(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def show_summary(result: Described, file: Path) -> None:
    """The summary of a result under its name and formula."""
    show_figures(f"{result.attrs['name'] or file}\n{result.attrs['formula']}", summary_of(result))


def show_tables(name: str, tables: Sequence[Any], apart: bool = True, most: int = 0, rest: str = "") -> None:
    """Tables, the first under a name. apart: with a line between them; most: rows of each that are shown, all if 0;
    rest: the file that has the others.
    """
    for i, table in enumerate(tables):
        if i and apart:
            console().print()
        title = f"{name}\n{table.title}" if i == 0 and name else table.title
        show_rows(title, table.head, table.rows[: most or None])
        if most and len(table.rows) > most:
            more = f"{counted(len(table.rows) - most, 'row')} more; --out {rest} has all"
            console().print(more, markup=False, highlight=False)
