"""The command line: every verb of the library, with the same words.

Exit status: 0 fine, 1 findings (cannot be assembled somewhere, locks, dead centre), 2 bad input, 3 a fault of its own.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperGroup

from trunnion.cli.allocate import allocate
from trunnion.cli.assemble import assemble
from trunnion.cli.compare import compare
from trunnion.cli.data import data
from trunnion.cli.edge import status_of
from trunnion.cli.exchange import export, import_
from trunnion.cli.files import guarded, named_words
from trunnion.cli.identify import identify
from trunnion.cli.locking import locking
from trunnion.cli.model import exit_status, lines_of, placed, stated
from trunnion.cli.options import (
    IMAGES,
    Columns,
    Criterion,
    Data,
    Dtype,
    Engine,
    File,
    FrictionLaw,
    Kinds,
    Method,
    OnePosition,
    Report,
    Rounds,
    Seats,
    Set,
    Steps,
    TableFile,
    TableUnits,
    Uncut,
    Units,
    UnitsRow,
    Variables,
)
from trunnion.cli.play import play
from trunnion.cli.result import Shown, check_files, check_page, write_text
from trunnion.cli.rig import rig
from trunnion.cli.simulate import simulate
from trunnion.cli.studio import studio
from trunnion.cli.sweep import sweep
from trunnion.cli.terminal import bar, console, say, show_figures, show_rows, wrote
from trunnion.cli.tolerance import tolerance
from trunnion.errors import Finding, MechanismError, Severity
from trunnion.files import folder
from trunnion.results.attributes import findings_of
from trunnion.version import __version__

if TYPE_CHECKING:
    import xarray as xr

    from trunnion.model.mechanism import Mechanism
    from trunnion.results.result import Result
    from trunnion.solve.friction_method import FrictionMethod

GROUPS = {
    "Model": ("check", "examples", "schema", "studio"),
    "Motion and forces": ("analyse", "simulate", "locking", "design"),
    "As built": ("assemble", "play", "tolerance", "allocate"),
    "Many mechanisms": ("sweep",),
    "Measured data": ("rig", "data", "compare", "identify"),
    "Pictures": ("plot", "report"),
    "Other programs": ("import", "export"),
}
# Each runs in a folder with the models that `trunnion examples NAME` copies; mapping.yaml is one of measured data.
EXAMPLES = {
    "check": ("durango-fourbar.yaml", "durango-fourbar.yaml --list"),
    "examples": ("", "durango-fourbar"),
    "schema": ("-o model.schema.json",),
    "studio": ("durango-fourbar.yaml", "."),
    "analyse": (
        "durango-fourbar.yaml",
        "durango-fourbar.yaml --set AB=2.1m --friction off -o cycle.csv",
        "durango-fourbar.yaml --at 60deg",
    ),
    "simulate": ("flywheel-press.yaml --time 3s -o start.png", "flywheel-press.yaml --steady --report steady.html"),
    "locking": ("drawing-press.yaml --near 1.2 -o margin.png",),
    "design": ("durango-fourbar.yaml --fluctuation 0.02",),
    "assemble": ("misaligned-hinges.yaml -o clearance.csv",),
    "play": ("toleranced-slider-crank.yaml --measure piston.Q.x --at 60deg",),
    "tolerance": ("toleranced-fourbar.yaml --samples 100000 --report yield.html",),
    "allocate": ("toleranced-fourbar.yaml --yield 0.99 --write cheapest.yaml",),
    "sweep": ("durango-fourbar.yaml --over AB=1.6m:2.4m:9 -o efficiency.png",),
    "rig": ("pezzuti-cardan.yaml cardan-rig.yaml", "pezzuti-cardan.yaml cardan-rig.yaml -o lab"),
    "data": ("lab/mapping.yaml -o turns.csv",),
    "compare": ("pezzuti-cardan.yaml lab/mapping.yaml --report lab.html",),
    "identify": ("pezzuti-cardan.yaml lab/mapping.yaml --parameter joint_defaults.friction.coefficient",),
    "plot": ("durango-fourbar.yaml --kind torque -o torque.png", "durango-fourbar.yaml -o plots"),
    "report": ("durango-fourbar.yaml -o durango.html",),
    "import": ("crank.step -o crank.yaml --material aluminium", "robot.urdf -o robot.yaml --ground base"),
    "export": ("durango-fourbar.yaml -o fourbar.xml --at 60deg", "durango-fourbar.yaml -o fourbar.dxf"),
}


class Verbs(TyperGroup):
    """The verbs under the questions that they answer."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the verbs, group by group."""
        for title, names in GROUPS.items():
            rows = [
                (name.ljust(9), self.commands[name].get_short_help_str(68)) for name in names if name in self.commands
            ]
            if rows:
                with formatter.section(title):
                    formatter.write_dl(rows)


app = typer.Typer(
    name="trunnion",
    cls=Verbs,
    context_settings={"help_option_names": ["-h", "--help"]},
    help="Analysis of linkages as built, with friction, play, axis errors and tolerances.",
    no_args_is_help=True,
    add_completion=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)


class FileKind(StrEnum):
    """Files that have a JSON Schema."""

    MODEL = "model"
    DATA = "data"


def verb(function: Callable[..., None]) -> Callable[..., None]:
    """Register a verb; what its options write is said to every reader before it begins."""
    name = function.__name__.rstrip("_")  # `import` is a word of Python
    named_words(function)
    lines = "\n".join(f"  trunnion {name} {words}".rstrip() for words in EXAMPLES[name])
    app.command(name, epilog=f"\b\nExamples:\n{lines}")(guarded(function))
    return function


@verb
def check(
    file: File,
    set_: Set = None,
    table: TableFile = None,
    friction: FrictionLaw = None,
    assemblies: Annotated[
        Path | None,
        typer.Option("--assemblies", help="Also draw the assembly modes of each group: a .png, .svg or .pdf file."),
    ] = None,
    list_: Annotated[
        bool, typer.Option("--list", help="List what can be set, swept and measured, with units and values.")
    ] = False,
    out: Annotated[Path | None, typer.Option("--out", "-o", help="Write that list: a .json file.")] = None,
) -> None:
    """Check a model: findings, mobility, structure, assembly modes."""
    if list_ or out:
        from trunnion.cli.vocabulary import show

        show(file, stated(file, set_, table, friction), out)
        raise typer.Exit
    from trunnion.cli.structure import show_structure
    from trunnion.cycle.inspect import check as inspect

    if assemblies:
        from trunnion.views.cycle.plots import check_figure

        check_figure(assemblies)
    mechanism = stated(file, set_, table, friction)
    with lines_of(file):
        found = inspect(mechanism)
    show_structure(found, mechanism.name or file.name, len(mechanism.drivers))
    say(placed(found.findings, file, ["assembly", "measures"]), every=True)
    if assemblies:
        from trunnion.views.assembly.mode_drawings import ways as drawings
        from trunnion.views.cycle.plots import save

        save(drawings(mechanism, found.choices), assemblies)
        wrote(assemblies)
    raise typer.Exit(exit_status(found.findings))


@verb
def analyse(
    file: File,
    steps: Steps = 360,
    at: OnePosition = None,
    set_: Set = None,
    table: TableFile = None,
    friction: FrictionLaw = None,
    seat: Seats = None,
    method: Method = "newton",
    criterion: Criterion = None,
    iterations: Rounds = 200,
    out: Data = None,
    report: Report = None,
    units_row: UnitsRow = False,
    units: Units = TableUnits.si,
    columns: Columns = None,
    uncut: Uncut = False,
    engine: Engine = "auto",
    variables: Variables = None,
    dtype: Dtype = "float64",
) -> None:
    """Analyse a cycle: motion, reactions, friction, effort, power."""
    from trunnion.cycle.positions import Kept

    check_files(out or [], report, drawn=False, instead=f"trunnion plot {file}")
    kept = Kept.read(variables, dtype)  # type: ignore[arg-type]  # it checks them
    if report and kept.variables is not None:
        raise MechanismError(Finding("a report is made of all variables", "--variables", "leave one of both out"))
    if report and at:
        raise MechanismError(Finding("a report is of the whole cycle", "--at", "leave one of both out"))
    mechanism = stated(file, set_, table, friction, seat)
    saved = {"units_row": units_row, "columns": columns, "units": units}
    with lines_of(file):
        done = _method(method, criterion, iterations)
        result = _analysed(mechanism, steps, done, engine, kept, out or [], saved, at)
    page = partial(_page, mechanism, result, uncut)
    show = None if at is None else partial(_show_position, result, file, at)
    Shown(result, file, ["assembly"], report=report, page=page, show=show, written=list(out or [])).finish()


@verb
def design(
    file: File,
    set_: Set = None,
    table: TableFile = None,
    friction: FrictionLaw = None,
    fluctuation: Annotated[
        float, typer.Option("--fluctuation", help="Speed fluctuation that the flywheel allows.")
    ] = 0.05,
) -> None:
    """Design values: transmission angle, dead centres, flywheel.

    Transmission angles, dead centres, range, Grashof type, shaking force, balance, flywheel, motor.
    """
    from trunnion.studies.design import report_figures

    mechanism = stated(file, set_, table, friction)
    with lines_of(file):
        figures = report_figures(mechanism, fluctuation)
    show_figures(mechanism.name or str(file), figures)


verb(simulate)
verb(studio)
verb(locking)
verb(assemble)
verb(tolerance)
verb(allocate)
verb(data)
verb(rig)
verb(compare)
verb(identify)
verb(sweep)
verb(play)
verb(import_)
verb(export)


@verb
def plot(
    file: File,
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder, or a .png .svg .pdf .jpg file of one plot.")],
    kind: Kinds = None,
    steps: Steps = 360,
    set_: Set = None,
    table: TableFile = None,
    friction: FrictionLaw = None,
    seat: Seats = None,
    at: Annotated[
        str | None,
        typer.Option("--at", help="Position to draw the mechanism in and to mark in curves: 60deg, 20mm, 0.1s."),
    ] = None,
    image: Annotated[str, typer.Option("--format", help="png, svg, pdf or jpg, for a folder of plots.")] = "png",
    uncut: Uncut = False,
) -> None:
    """Plot a cycle: torque, friction power, reactions, mechanism."""
    from trunnion.views.charts import check_kind
    from trunnion.views.common.peaks import whole_peaks
    from trunnion.views.cycle.deviations import with_worst_case
    from trunnion.views.cycle.plots import PLOTS, drawable, save
    from trunnion.views.cycle.plots import figure as figure_of

    for name in kind or []:
        check_kind(name, PLOTS)
    single = out.suffix.lower() in IMAGES
    if single and len(kind or PLOTS) > 1:
        what = f"{len(kind or PLOTS)} plots do not fit one file"
        raise MechanismError(Finding(what, str(out), "name a folder, or one --kind"))
    mechanism = stated(file, set_, table, friction, seat)
    with lines_of(file):
        result = _run(mechanism, steps, None)
    ideal = _ideal(mechanism, steps, None)
    if not single:
        folder(out)
    shown = whole_peaks(with_worst_case(result, mechanism) if "error" in (kind or PLOTS) else result, uncut)
    for name, figure in [(name, figure_of(shown, name, ideal, at)) for name in kind or drawable(result)]:
        path = out if single else out / f"{name}.{image.lstrip('.')}"
        save(figure, path)
        wrote(path)
    grave = [finding for finding in findings_of(result) if finding.severity is not Severity.NOTE]
    say(placed(grave, file, ["assembly"]))
    raise typer.Exit(exit_status(findings_of(result)))


@verb
def report(
    file: File,
    out: Annotated[Path, typer.Option("--out", "-o", help="The HTML file to write.")],
    steps: Steps = 360,
    set_: Set = None,
    table: TableFile = None,
    friction: FrictionLaw = None,
    seat: Seats = None,
    method: Method = "newton",
    criterion: Criterion = None,
    iterations: Rounds = 200,
    uncut: Uncut = False,
) -> None:
    """Write an HTML report: animation, plots, findings, inputs."""
    check_page(out, "--out")
    mechanism = stated(file, set_, table, friction, seat)
    with lines_of(file):
        result = _analysed(mechanism, steps, _method(method, criterion, iterations))
    write_text(_page(mechanism, result, uncut), out)
    wrote(out)
    raise typer.Exit(exit_status(findings_of(result)))


@verb
def examples(
    name: Annotated[str | None, typer.Argument(help="Example to copy; without it, all are listed.")] = None,
    to: Annotated[Path, typer.Option("--to", help="Folder to copy it into.")] = Path(),
    force: Annotated[bool, typer.Option("--force", help="Overwrite a file of that name.")] = False,
) -> None:
    """List the example models, rigs and drawings, or copy one."""
    found = _examples()
    if name is None:
        for path in found.values():
            title = next(
                (line[5:].strip() for line in path.read_text("utf-8").splitlines() if line.startswith("name:")),
                "a drawing for `trunnion import`" if path.suffix == ".step" else "",
            )
            console().print(f"{path.stem:<28} {title}", markup=False, highlight=False, soft_wrap=True)
        return
    source = found.get(name.removesuffix(".yaml").removesuffix(".step"))
    if source is None:
        raise MechanismError(Finding(f"there is no example '{name}'", remedy=f"use one of {', '.join(found)}"))
    from trunnion.files import whole

    folder(to)
    target = to / source.name
    if target.exists() and not force:
        raise MechanismError(Finding("exists already", str(target), "use --force to overwrite it"))
    with whole(target) as temporary:
        temporary.write_bytes(source.read_bytes())
    wrote(target)


@verb
def schema(
    of: Annotated[
        FileKind, typer.Option("--of", help="File: model, or data for the mapping of measured data.")
    ] = FileKind.MODEL,
    out: Annotated[Path | None, typer.Option("--out", "-o", help="Write it to a file.")] = None,
) -> None:
    """Print the JSON Schema of model or mapping file, for editors."""
    if of is FileKind.DATA:
        from trunnion.rig.reading.mapping import schema_text

        text = schema_text()
    else:
        from trunnion.model.schema import SCHEMA_FILE

        text = SCHEMA_FILE.read_text("utf-8")
    if out is None:
        print(text, end="")
        return
    write_text(text, out)


def _version(show: bool) -> None:
    if show:
        print(f"trunnion {__version__}")
        raise typer.Exit


VERBS = app.registered_commands


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version.")
    ] = False,
    debug: Annotated[
        bool, typer.Option("--debug", help="Show the traceback of a program fault. With any verb.")
    ] = False,
) -> None:
    """Options of the program itself."""


def main() -> None:
    """Run the command line; every failure is a message and an exit status, never a traceback."""
    for stream in (sys.stdout, sys.stderr):  # names may be Greek whatever the terminal's code page is
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(encoding="utf-8", errors="replace")
    words = sys.argv[1:]
    end = words.index("--") if "--" in words else len(words)
    debug = "--debug" in words[:end]  # before or behind the verb
    words = [word for place, word in enumerate(words) if word != "--debug" or place > end]
    sys.argv[1:] = words
    named = [one for one in VERBS if one.callback and one.name in words[:1]]
    app.registered_commands = named or VERBS  # Typer reads the options of all: those of one verb are a twentieth
    try:
        status = status_of(app, debug)
    finally:
        app.registered_commands = VERBS
    sys.exit(status)


# ---- shared by the verbs --------------------------------------------------------------------------------------


def _method(name: str, criterion: float | None, iterations: int) -> FrictionMethod:
    from trunnion.solve.friction_method import FrictionMethod

    return FrictionMethod(name, criterion, iterations)  # type: ignore[arg-type]  # it checks the name


def _analysed(
    mechanism: Mechanism, steps: int, method: FrictionMethod | None, engine: str = "auto", *kept: Any
) -> Result:
    """Analyse, with a progress bar when it takes long enough to need one. kept: what is, and where, see `analysed`."""
    from trunnion.cycle.analyse import analysed

    with bar("positions", steps, least=200_000) as progress:
        return analysed(mechanism, steps, method, progress, engine, *kept)  # type: ignore[arg-type]  # it checks it


def _show_position(result: Result, file: Path, at: str) -> None:
    """Every number of one position, with its unit."""
    from trunnion.results.quantities import parts
    from trunnion.results.tables import columns

    rows = []
    for name, unit, values in columns(result.dataset):
        value = values[0]
        text, shown = (str(value), "") if isinstance(value, str) else parts(float(value), unit)
        rows.append([name, text, "" if shown == "1" else shown])
    show_rows(f"{result.attrs['name'] or file} at {at}", ["", "value", "unit"], rows)


def _run(mechanism: Mechanism, steps: int, method: FrictionMethod | None) -> xr.Dataset:
    """The same as a Dataset."""
    return _analysed(mechanism, steps, method).dataset


def _ideal(mechanism: Mechanism, steps: int, method: FrictionMethod | None) -> xr.Dataset | None:
    """The same without friction, to compare with; None if there is none."""
    if all(joint.friction is None for joint in mechanism.effective_joints.values()):
        return None
    return _run(mechanism.with_friction("off"), steps, method)


def _page(mechanism: Mechanism, analysed: Result, uncut: bool) -> str:
    """The report of a cycle as HTML."""
    from trunnion.views.common.peaks import whole_peaks
    from trunnion.views.cycle.deviations import with_worst_case
    from trunnion.views.cycle.report import report as page

    result = analysed.dataset
    shown = whole_peaks(with_worst_case(result, mechanism), uncut)
    return page(shown, _ideal(mechanism, result.sizes["position"], None))


def _examples() -> dict[str, Path]:
    """Example models and rigs by name: beside the installed package, or in the source tree."""
    here = Path(__file__).resolve().parent.parent
    folder = here / "examples" if (here / "examples").is_dir() else here.parents[1] / "examples"
    return {
        path.stem: path
        for path in (
            *sorted(folder.glob("*.yaml")),
            *sorted(folder.glob("rig/*-rig.yaml")),
            *sorted(folder.glob("*.step")),
        )
    }


if __name__ == "__main__":
    main()
