"""One way from a result to its files, tables, findings and exit status, for every verb that has one."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import typer

from trunnion.cli.options import IMAGES, Files, Model, placed
from trunnion.cli.terminal import line, say, show_figures, show_rows, wrote
from trunnion.errors import Finding, MechanismError, Severity, counted
from trunnion.results.attributes import findings_of, summary_of

if TYPE_CHECKING:
    import xarray as xr

    from trunnion.model.mechanism import Mechanism
    from trunnion.results.dataset import Result

__all__ = ["PAGES", "YAML", "Shown", "check_files", "check_model", "check_target", "end", "exit_status", "show_tables",
           "write_text"]  # fmt: skip

PAGES = (".html", ".htm")  # a report is HTML
YAML, MODELS = (".yaml", ".yml"), (".yaml", ".yml", ".json")


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
