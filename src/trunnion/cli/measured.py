"""`trunnion rig`, `data`, `compare` and `identify`: data of test rigs, and the model beside them."""

from pathlib import Path
from typing import TYPE_CHECKING

import typer
from typer import Argument

from trunnion.cli.options import DATA, Files, Model, setting, verb
from trunnion.cli.result import Shown, bar, check_files, check_model, exit_status, line, say, show_tables, wrote
from trunnion.errors import Finding, MechanismError, Severity, counted
from trunnion.results.attributes import findings_of

if TYPE_CHECKING:
    import xarray as xr

    from trunnion.model.mechanism import Mechanism

FEWEST = 20  # conditions from which a progress bar is worth it
MOST_COMPARED, MOST_IDENTIFIED = 40, 24  # rows of the tables that are printed


@verb(
    rig_file=Argument(help="Rig file: YAML, JSON or TOML."),
    out="Folder for data files, mapping.yaml and truth.yaml.",
    format="csv, parquet or tdms; default: as stated in the rig file.",
)
def rig(model: Model, rig_file: Path, out: Path | None = None, format_: str = "", seed: int = 1) -> None:
    """Virtual test rig: write simulated data files.

    Without --out the rig file is only checked.
    """
    from trunnion.rig.virtual.observe import check_folder, check_form, observe
    from trunnion.rig.virtual.rig_file import Rig, placed_in_rig

    if format_:
        check_form(format_)
    mechanism = model.read()
    rig_model = Rig.read(rig_file)
    if out and not format_:
        check_form(rig_model.format)
    with model.lines():
        try:
            if out:
                check_folder(rig_model, out, format_)
            with bar("conditions", len(rig_model.names), least=FEWEST) as progress:
                observation = observe(mechanism, rig_model, seed, progress)
        except MechanismError as error:  # findings about the rig bear the line of its file
            raise MechanismError(placed_in_rig(error.findings, rig_file)) from None
    conditions = counted(len(observation.cases), "condition")
    line(rig_model.name or "Test rig", "bold")
    line(f"{mechanism.name or 'no name'}; {conditions} of {counted(rig_model.schedule.turns, 'cycle')}; "
         f"{rig_model.rate.value:g} samples a second; {counted(observation.rows, 'row')}")  # fmt: skip
    if out:
        with bar("files", len(observation.cases), least=FEWEST) as progress:
            names = observation.write(out, format_, progress)
        wrote(out)
        first, last, *_ = (*names[:1], *names[-3:-2])
        span = first if first == last else f"{first} … {last}"
        line(f"  {span}, {', '.join(names[-2:])}")
    say(placed_in_rig(observation.findings, rig_file))
    raise typer.Exit(exit_status(observation.findings) or int(bool(observation.skipped)))


@verb(
    lacks="report units columns",
    out=DATA,
    files=Argument(help="Data files instead of those it names: .csv .parquet .tdms .nc."),
)
def data(mapping: Path, shared: Files, files: list[Path] | None = None) -> None:
    """Read measured files: conditions, channels, scatter, faults."""
    from trunnion.results.save import save
    from trunnion.rig.reading.measurement import dataset
    from trunnion.rig.reading.read import read_measured
    from trunnion.views.compare import measurement_tables as tables

    check_files(shared, drawn=False)
    measurement = read_measured(mapping, files)
    show_tables("", tables(measurement))
    for text in ["", *measurement.done] if measurement.done else []:
        line(text)
    for path in shared.out or ():
        save(dataset(measurement), path, shared.units_row)
        wrote(path)
    say(measurement.findings)
    raise typer.Exit(int(any(finding.severity is not Severity.NOTE for finding in measurement.findings)))


@verb(
    lacks="units columns",
    channel="A channel by its name in the mapping. Repeatable.",
    condition="The condition to draw.",
    kind="Figure of --out: efficiency or overlay.",
)
def compare(
    model: Model, mapping: Path, files: Files, data: list[Path] | None = None, channel: list[str] | None = None,
    condition: str | None = None, kind: str | None = None,
) -> None:  # fmt: skip
    """Compare a model with measured data: residual, bias, verdict.

    Every channel, and the efficiency as a test rig determines it. Exit status 0 if all agree within the expanded
    uncertainty, 1 if not or if that is undecided.
    """
    from trunnion.rig.comparison import compare as run
    from trunnion.rig.reading.read import read_measured
    from trunnion.rig.reading.turns import gathered
    from trunnion.views.compare import tables

    check_files(files, "comparison", kind)
    mechanism = model.read()
    measurement = read_measured(mapping, [str(path) for path in data] if data else None)
    with model.lines(), bar("conditions", len(measurement.conditions)) as progress:
        result = run(mechanism, measurement, channel, progress=progress)
    errors = exit_status([*measurement.findings, *findings_of(result)])
    Shown(
        result, model, files, "assembly measures", tables=tables(result), most=MOST_COMPARED, rest="FILE.figures.csv",
        drawn={"kind": kind, "condition": condition, "channel": channel[0] if channel and len(channel) == 1 else None},
        others=gathered(measurement.findings),
    ).finish(int(not result.attrs["all_within"] or errors))  # fmt: skip


@verb(
    lacks="units columns",
    parameter="A parameter, named as in --set; NAME=PATH,PATH,… for several with one common value. Repeatable.",
    channel="A channel by its name in the mapping. Repeatable; default: all usable ones.",
    start="NAME=VALUE: start value; default: the value in the model.",
    hold_out="A condition by its name, NAME=VALUE or file, for validation instead of the fit. Repeatable.",
    guard="Positions left out on each side of a friction reversal.",
    kind="Which figure: intervals or residuals.",
)
def identify(
    model: Model, mapping: Path, files: Files, data: list[Path] | None = None, parameter: list[str] | None = None,
    channel: list[str] | None = None, start: list[str] | None = None, hold_out: list[str] | None = None,
    guard: int | None = None, write: Path | None = None, force: bool = False, kind: str | None = None,
) -> None:  # fmt: skip
    """Identify parameters of a model from measured data.

    Estimates, 95 % confidence intervals, and which parameters the data do not separate.
    """
    from trunnion.rig.identification.identify import identify as run
    from trunnion.rig.reading.read import read_measured
    from trunnion.rig.reading.turns import gathered
    from trunnion.views.identify import tables

    check_files(files, "identification", kind)
    check_model(write, model.file, force)
    mechanism = model.read()
    with model.lines():
        unknowns, begin = parameters(parameter or []), dict(setting(text) for text in start or ())
        measurement = read_measured(mapping, [str(path) for path in data] if data else None)
        with bar("models evaluated", None) as progress:
            result = run(mechanism, measurement, unknowns, channel, begin, hold_out or (), guard, progress=progress)
    others = gathered(  # of the notes those that tell what was set, and why intervals may be too narrow
        finding for finding in measurement.findings if finding.severity is not Severity.NOTE or finding.where == "files"
    )
    output = Shown(result, model, files, "assembly measures", drawn={"kind": kind}, tables=tables(result),
                  most=MOST_IDENTIFIED, rest="FILE.residuals.csv", others=others)  # fmt: skip
    output.write()
    findings = findings_of(result)
    if write is not None:
        identified, remarks = estimated(mechanism, result, write)
        findings += remarks
        if identified:
            output.write_model(identified, write, force)
    output.end(findings)


def parameters(texts: list[str]) -> dict[str, list[str]]:
    """Paths by the name of the unknown, from NAME or NAME=PATH,PATH."""
    unknowns: dict[str, list[str]] = {}
    for text in texts:
        name, equals, listed = (part.strip() for part in text.partition("="))
        paths = [path.strip() for path in listed.split(",")] if equals else [name]
        if not name or not all(paths) or name in unknowns:
            what = f"'{text}' names no number" if name not in unknowns else f"'{name}' is given twice"
            remedy = "write NAME, or NAME=PATH,PATH, e.g. pins=pin-1.friction.coefficient,pin-2.friction.coefficient"
            raise MechanismError(Finding(what, "--parameter", remedy))
        unknowns[name] = paths
    if not unknowns:
        remedy = "add --parameter joint_defaults.friction.coefficient, or another number of the model"
        raise MechanismError(Finding("no parameter to identify is given", "--parameter", remedy))
    return unknowns


def estimated(mechanism: "Mechanism", result: "xr.Dataset", write: Path) -> "tuple[Mechanism | None, list[Finding]]":
    """The model with the estimates, if they are worth it, and findings about what is not in it."""
    from trunnion.rig.identification.identify import with_estimates

    errors = {finding.code: finding.where for finding in findings_of(result) if finding.severity is Severity.ERROR}
    if "fit.misfit" in errors or "sensor.off" in errors:
        reduced = float(f"{float(result['reduced_chi_squared']):.3g}")
        misfit = f"the model does not fit (reduced χ² {reduced:,.10g})"
        what = f"'{write}' is not written: {misfit if 'fit.misfit' in errors else errors['sensor.off'] + ' is off'}"
        remedy = "find the cause first: `trunnion compare` shows errors of sensors, angle and friction that explain it"
        return None, [Finding(what, "--write", remedy)]
    estimates = zip(result["parameter"].values, result["told"].values, strict=True)
    lost = [str(name) for name, identifiable in estimates if not identifiable]
    if len(lost) == result.sizes["parameter"] or not result.attrs["converged"]:
        why = "no parameter is identifiable" if result.attrs["converged"] else "the search did not converge"
        return None, [Finding(f"'{write}' is not written: {why}", "--write")]
    notes = []
    if lost:
        notes.append((f"{', '.join(lost)} unchanged: not identifiable from the data", ""))
    if encoder := result.attrs["encoder"]:
        notes.append((f"{encoder} unchanged: by this the encoder is off", "correct angle: zero: in the mapping"))
    findings = [Finding(what, "--write", remedy, Severity.NOTE) for what, remedy in notes]
    return with_estimates(mechanism, result), findings
