"""`trunnion identify`: numbers of the model from measured data, with what they are worth."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from trunnion.cli.model import lines_of, stated
from trunnion.cli.options import (
    DataFiles,
    File,
    Force,
    FrictionLaw,
    MappingFile,
    Out,
    Report,
    Seats,
    Set,
    TableFile,
    UnitsRow,
    Write,
    setting,
)
from trunnion.cli.result import Shown, check_files, check_model, show_tables
from trunnion.cli.terminal import bar
from trunnion.errors import Finding, MechanismError, Severity
from trunnion.results.attributes import findings_of

if TYPE_CHECKING:
    import xarray as xr

    from trunnion.model.mechanism import Mechanism

__all__ = ["identify"]

MOST_ROWS = 24

Parameters = Annotated[
    list[str] | None,
    typer.Option(
        "--parameter",
        help="A parameter, named as in --set; NAME=PATH,PATH,… for several with one common value. Repeatable.",
    ),
]
Channels = Annotated[
    list[str] | None,
    typer.Option(
        "--channel", help="A channel by its name in the mapping, or efficiency. Repeatable; default: all usable ones."
    ),
]
Starting = Annotated[
    list[str] | None, typer.Option("--start", help="NAME=VALUE: start value; default: the value in the model.")
]
HeldOut = Annotated[
    list[str] | None,
    typer.Option(
        "--hold-out",
        help="A condition, or a share of the turns such as 0.2, for validation instead of the fit. Repeatable.",
    ),
]
Guard = Annotated[int | None, typer.Option("--guard", help="Positions left out on each side of a friction reversal.")]
Corrected = Annotated[
    Path | None,
    typer.Option(
        "--write-mapping", help="Write the mapping with the zero of the angle or of a channel that was found: .yaml."
    ),
]
Kind = Annotated[str | None, typer.Option("--kind", help="Which figure: intervals, correlation or residuals.")]


def identify(
    file: File,
    mapping: MappingFile,
    data: DataFiles = None,
    parameter: Parameters = None,
    channel: Channels = None,
    start: Starting = None,
    hold_out: HeldOut = None,
    guard: Guard = None,
    set_: Set = None,
    table: TableFile = None,
    friction: FrictionLaw = None,
    seat: Seats = None,
    write: Write = None,
    write_mapping: Corrected = None,
    force: Force = False,
    kind: Kind = None,
    out: Out = None,
    report: Report = None,
    units_row: UnitsRow = False,
) -> None:
    """Identify parameters of a model from measured data.

    Estimates, 95 % confidence intervals, and which parameters the data do not separate.
    """
    from trunnion.rig.identification import identify as run
    from trunnion.rig.reading.read import read_measured
    from trunnion.rig.reading.timebase import gathered

    check_files(out or [], report, of="identification", kind=kind)
    check_model(write, file, force)
    _check_mapping(write_mapping, mapping, force)
    mechanism = stated(file, set_, table, friction, seat)
    with lines_of(file):
        wanted, begin = parameters(parameter or []), dict(setting(text) for text in start or ())
        held = held_out(hold_out or [])
        measurement = read_measured(mapping, [str(path) for path in data] if data else None)
        with bar("models evaluated", None) as progress:
            result = run(mechanism, measurement, wanted, channel, begin, held, guard, progress=progress)
    found = gathered(  # of the notes those that tell what was set, and why intervals may be too narrow
        one for one in measurement.findings if one.severity is not Severity.NOTE or one.where == "files"
    )

    show, sections = partial(_show, result), ["assembly", "measures"]
    shown = Shown(result, file, sections, out or [], report, units_row, {"kind": kind}, show=show, others=found)
    shown.write()
    findings = findings_of(result)
    if write is not None:
        findings += _write_model(mechanism, result, file, write, force, shown.written)
    if write_mapping is not None:
        findings += _write_mapping(result, mapping, write_mapping, shown.written)
    shown.end(findings)


def parameters(texts: list[str]) -> dict[str, list[str]]:
    """Paths by the name of the unknown, from NAME or NAME=PATH,PATH."""
    found: dict[str, list[str]] = {}
    for text in texts:
        name, equals, paths = (part.strip() for part in text.partition("="))
        own = [one.strip() for one in paths.split(",")] if equals else [name]
        if not name or not all(own):
            remedy = "write NAME, or NAME=PATH,PATH, e.g. pins=pin-1.friction.coefficient,pin-2.friction.coefficient"
            raise MechanismError(Finding(f"'{text}' names no number", "--parameter", remedy))
        if name in found:
            raise MechanismError(Finding(f"'{name}' is given twice", "--parameter", "give all its numbers at once"))
        found[name] = own
    if not found:
        remedy = "add --parameter joint_defaults.friction.coefficient, or another number of the model"
        raise MechanismError(Finding("no parameter to identify is given", "--parameter", remedy))
    return found


def held_out(texts: list[str]) -> float | list[str] | None:
    """A share of the turns, or names of conditions."""
    if len(texts) == 1:
        try:
            return float(texts[0])
        except ValueError:
            return texts
    return texts or None


def _show(result: xr.Dataset) -> None:
    """What was found; of long tables the first rows."""
    from trunnion.views.identify import tables

    show_tables(str(result.attrs["name"]), tables(result), most=MOST_ROWS, rest="FILE.residuals.csv")


def _write_model(
    mechanism: Mechanism, result: xr.Dataset, file: Path, write: Path, force: bool, written: list[Path]
) -> list[Finding]:
    """The model with the estimates; findings about what is not in it."""
    from trunnion.model.rewrite import rewrite_mechanism
    from trunnion.rig.identification import with_estimates

    errors = {one.code: one.where for one in findings_of(result) if one.severity is Severity.ERROR}
    if "fit.misfit" in errors or "sensor.off" in errors:
        reduced = float(f"{float(result['reduced_chi_squared']):.3g}")
        misfit = f"the model does not fit (reduced χ² {reduced:,.10g})"
        what = f"'{write}' is not written: {misfit if 'fit.misfit' in errors else errors['sensor.off'] + ' is off'}"
        explained = "sensor.off" in errors or "fit.cause" in {one.code for one in findings_of(result)}
        named = "correct what explains the misfit, and identify again"
        unknown = "find the cause first: `trunnion compare` shows each channel and names errors of sensors and angle"
        return [Finding(what, "--write", named if explained else unknown)]
    known = zip(result["parameter"].values, result["told"].values, strict=True)
    lost = [str(name) for name, identifiable in known if not identifiable]
    if len(lost) == result.sizes["parameter"] or not result.attrs["converged"]:
        why = "no parameter is identifiable" if result.attrs["converged"] else "the search did not converge"
        return [Finding(f"'{write}' is not written: {why}", "--write", "", Severity.ERROR)]
    rewrite_mechanism(with_estimates(mechanism, result), file, write, force)
    written.append(write)
    notes = []
    if lost:
        what = f"{', '.join(lost)} unchanged: not identifiable from the data"
        notes.append(Finding(what, "--write", "", Severity.NOTE))
    if encoder := result.attrs["encoder"]:
        what, remedy = f"{encoder} unchanged: by this the encoder is off", "write it into the mapping: --write-mapping"
        notes.append(Finding(what, "--write", remedy, Severity.NOTE))
    return notes


def _check_mapping(write: Path | None, mapping: Path, force: bool) -> None:
    """MechanismError for a mapping that cannot be written, is in another folder than its data, or is there already."""
    if write is None:
        return
    if write.suffix.lower() not in (".yaml", ".yml"):
        what, remedy = f"a mapping is not written as '{write.suffix}'", "write .yaml"
    elif write.resolve().parent != mapping.resolve().parent:
        what, remedy = f"'{write}' is not in the folder of '{mapping}', whose data it names", "name a file there"
    elif write.exists() and not force:
        what, remedy = f"'{write}' exists", "name another file, or add --force"
    else:
        return
    raise MechanismError(Finding(what, "--write-mapping", remedy))


def _write_mapping(result: xr.Dataset, mapping: Path, write: Path, written: list[Path]) -> list[Finding]:
    """The mapping with the zeros that were found, beside the data that it names."""
    from trunnion.files import whole
    from trunnion.model.file import read_entries
    from trunnion.model.rewrite import changed_text
    from trunnion.rig.identification import corrected_mapping

    try:
        entries = corrected_mapping(read_entries(mapping, "a mapping file")[0], result)
    except MechanismError as error:
        return list(error.findings)
    with whole(write) as temporary:
        temporary.write_text(changed_text(mapping.read_text("utf-8"), entries), encoding="utf-8", newline="\n")
    written.append(write)
    return []
