"""`trunnion identify`: numbers of the model from measured data, with what they are worth."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Option

from trunnion.cli.files import verb
from trunnion.cli.options import DataFiles, Files, Force, MappingFile, Model, Write, setting
from trunnion.cli.result import Shown, check_files, check_model
from trunnion.cli.terminal import bar
from trunnion.errors import Finding, MechanismError, Severity
from trunnion.results.attributes import findings_of

if TYPE_CHECKING:
    import xarray as xr

    from trunnion.model.mechanism import Mechanism

__all__ = ["estimated", "identify"]

MOST_ROWS = 24


@verb(lacks="units columns")
def identify(
    model: Model, mapping: MappingFile, files: Files, data: DataFiles = None,
    parameter: Annotated[
        list[str] | None,
        Option("--parameter",
               help="A parameter, named as in --set; NAME=PATH,PATH,… for several with one common value. Repeatable."),
    ] = None,
    channel: Annotated[
        list[str] | None,
        Option("--channel",
               help="A channel by its name in the mapping, or efficiency. Repeatable; default: all usable ones."),
    ] = None,
    start: Annotated[
        list[str] | None, Option("--start", help="NAME=VALUE: start value; default: the value in the model.")
    ] = None,
    hold_out: Annotated[
        list[str] | None,
        Option("--hold-out",
               help="A condition, or a share of the turns such as 0.2, for validation instead of the fit. Repeatable."),
    ] = None,
    guard: Annotated[
        int | None, Option("--guard", help="Positions left out on each side of a friction reversal.")
    ] = None,
    write: Write = None,
    write_mapping: Annotated[
        Path | None,
        Option("--write-mapping",
               help="Write the mapping with the zero of the angle or of a channel that was found: .yaml."),
    ] = None,
    force: Force = False,
    kind: Annotated[str | None, Option("--kind", help="Which figure: intervals, correlation or residuals.")] = None,
) -> None:  # fmt: skip
    """Identify parameters of a model from measured data.

    Estimates, 95 % confidence intervals, and which parameters the data do not separate.
    """
    from trunnion.rig.identification import identify as run
    from trunnion.rig.reading.read import read_measured
    from trunnion.rig.reading.timebase import gathered
    from trunnion.views.identify import tables

    check_files(files, "identification", kind)
    check_model(write, model.file, force)
    _check_mapping(write_mapping, mapping, force)
    mechanism = model.read()
    with model.lines():
        unknowns, begin = parameters(parameter or []), dict(setting(text) for text in start or ())
        held_out = _held_out(hold_out or [])
        measurement = read_measured(mapping, [str(path) for path in data] if data else None)
        with bar("models evaluated", None) as progress:
            result = run(mechanism, measurement, unknowns, channel, begin, held_out, guard, progress=progress)
    others = gathered(  # of the notes those that tell what was set, and why intervals may be too narrow
        finding for finding in measurement.findings if finding.severity is not Severity.NOTE or finding.where == "files"
    )
    shown = Shown(result, model, files, "assembly measures", drawn={"kind": kind}, tables=tables(result),
                  most=MOST_ROWS, rest="FILE.residuals.csv", others=others)  # fmt: skip
    shown.write()
    findings = findings_of(result)
    if write is not None:
        identified, remarks = estimated(mechanism, result, write)
        findings += remarks
        if identified:
            shown.write_model(identified, write, force)
    if write_mapping is not None:
        findings += _write_mapping(result, mapping, write_mapping, shown.written)
    shown.end(findings)


def parameters(texts: list[str]) -> dict[str, list[str]]:
    """Paths by the name of the unknown, from NAME or NAME=PATH,PATH."""
    unknowns: dict[str, list[str]] = {}
    for text in texts:
        name, equals, listed = (part.strip() for part in text.partition("="))
        paths = [path.strip() for path in listed.split(",")] if equals else [name]
        if not name or not all(paths):
            remedy = "write NAME, or NAME=PATH,PATH, e.g. pins=pin-1.friction.coefficient,pin-2.friction.coefficient"
            raise MechanismError(Finding(f"'{text}' names no number", "--parameter", remedy))
        if name in unknowns:
            raise MechanismError(Finding(f"'{name}' is given twice", "--parameter", "give all its numbers at once"))
        unknowns[name] = paths
    if not unknowns:
        remedy = "add --parameter joint_defaults.friction.coefficient, or another number of the model"
        raise MechanismError(Finding("no parameter to identify is given", "--parameter", remedy))
    return unknowns


def _held_out(texts: list[str]) -> float | list[str] | None:
    """A share of the turns, or names of conditions."""
    try:
        (share,) = map(float, texts)
        return share
    except ValueError:
        return texts or None


def estimated(mechanism: Mechanism, result: xr.Dataset, write: Path) -> tuple[Mechanism | None, list[Finding]]:
    """The model with the estimates, if they are worth it, and findings about what is not in it."""
    from trunnion.rig.identification import with_estimates

    errors = {finding.code: finding.where for finding in findings_of(result) if finding.severity is Severity.ERROR}
    if "fit.misfit" in errors or "sensor.off" in errors:
        reduced = float(f"{float(result['reduced_chi_squared']):.3g}")
        misfit = f"the model does not fit (reduced χ² {reduced:,.10g})"
        what = f"'{write}' is not written: {misfit if 'fit.misfit' in errors else errors['sensor.off'] + ' is off'}"
        explained = "sensor.off" in errors or "fit.cause" in {finding.code for finding in findings_of(result)}
        correct = "correct what explains the misfit, and identify again"
        search = "find the cause first: `trunnion compare` shows each channel and names errors of sensors and angle"
        return None, [Finding(what, "--write", correct if explained else search)]
    told = zip(result["parameter"].values, result["told"].values, strict=True)
    lost = [str(name) for name, identifiable in told if not identifiable]
    if len(lost) == result.sizes["parameter"] or not result.attrs["converged"]:
        why = "no parameter is identifiable" if result.attrs["converged"] else "the search did not converge"
        return None, [Finding(f"'{write}' is not written: {why}", "--write")]
    notes = []
    if lost:
        notes.append((f"{', '.join(lost)} unchanged: not identifiable from the data", ""))
    if encoder := result.attrs["encoder"]:
        notes.append((f"{encoder} unchanged: by this the encoder is off", "write it into the mapping: --write-mapping"))
    findings = [Finding(what, "--write", remedy, Severity.NOTE) for what, remedy in notes]
    return with_estimates(mechanism, result), findings


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
    from trunnion.cli.result import write_text
    from trunnion.model.file import read_entries
    from trunnion.model.rewrite import changed_text
    from trunnion.rig.identification import corrected_mapping

    try:
        entries = corrected_mapping(read_entries(mapping, "a mapping file")[0], result)
    except MechanismError as error:
        return list(error.findings)
    write_text(changed_text(mapping.read_text("utf-8"), entries), write)
    written.append(write)
    return []
