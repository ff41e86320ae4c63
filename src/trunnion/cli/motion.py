"""`trunnion analyse`, `simulate`, `locking`, `design`, `plot`, `report`, `sweep`: motion and forces, in numbers and
pictures, of one mechanism or over a grid of numbers of it."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from typer import Exit

from trunnion.cli.options import (
    DATA,
    IMAGES,
    ONE_POSITION,
    PLOT_KINDS,
    Files,
    Friction,
    Model,
    over,
    points,
    seconds,
    verb,
)  # fmt: skip
from trunnion.cli.result import (
    PAGES,
    Shown,
    bar,
    check_files,
    check_target,
    end,
    exit_status,
    line,
    show_figures,
    show_rows,
    show_tables,
    write_text,
    wrote,
)  # fmt: skip
from trunnion.errors import Finding, MechanismError, Severity, counted
from trunnion.files import folder
from trunnion.results.attributes import findings_of

if TYPE_CHECKING:
    import xarray as xr

    from trunnion.model.mechanism import Mechanism
    from trunnion.results.dataset import Result
    from trunnion.solve.friction_method import FrictionMethod


@verb(out=DATA, at=ONE_POSITION)
def analyse(
    model: Model, files: Files, settled: Friction, steps: int = 360, at: str | None = None, uncut: bool = False,
    engine: str = "auto",
) -> None:  # fmt: skip
    """Analyse a cycle: motion, reactions, friction, effort, power."""
    check_files(files, drawn=False, instead=f"trunnion plot {model.file}")
    if files.report and at:
        raise MechanismError(Finding("a report is of the whole cycle", "--at", "leave one of both out"))
    mechanism = model.read()
    with model.lines():
        result = _analysed(mechanism, steps, settled.checked(), engine=engine, at=at)

    def show_position() -> None:
        """Every number of one position, with its unit."""
        from trunnion.results.quantities import parts
        from trunnion.results.tables import columns

        rows = []
        for name, unit, values in columns(result.dataset):
            text, output = (values[0], "") if isinstance(values[0], str) else parts(float(values[0]), unit)
            rows.append([name, text, "" if output == "1" else output])
        show_rows(f"{result.attrs['name'] or model.file} at {at}", ["", "value", "unit"], rows)

    output = Shown(result, model, files, "assembly", uncut, show=show_position if at else None)
    if files.report is not None:
        output.paged = {"ideal": _ideal(mechanism, steps)}
    output.finish()


@verb(lacks="seat", fluctuation="Speed fluctuation that the flywheel allows.")
def design(model: Model, fluctuation: float = 0.05) -> None:
    """Design values: transmission angle, dead centres, flywheel.

    Transmission angles, dead centres, range, Grashof type, shaking force, balance, flywheel, motor.
    """
    from trunnion.studies.design import report_figures

    mechanism = model.read()
    with model.lines():
        figures = report_figures(mechanism, fluctuation)
    show_figures(mechanism.name or str(model.file), figures)


@verb(
    out="Folder, or a .png .svg .pdf .jpg file of one plot.",
    kind=f"{PLOT_KINDS}. Repeatable; all if not given.",
    at="Position to draw the mechanism in: 60deg, 20mm, 0.1s.",
    format="png, svg, pdf or jpg, for a folder of figures.",
)
def plot(
    model: Model, out: Path, kind: list[str] | None = None, steps: int = 360, at: str | None = None,
    format_: str = "png", uncut: bool = False,
) -> None:  # fmt: skip
    """Plot a cycle: torque, friction power, reactions, mechanism."""
    from trunnion.views.curves import check_kind, whole_peaks
    from trunnion.views.cycle import PLOTS, drawable
    from trunnion.views.draw import save
    from trunnion.views.shown import plot

    for name in kind or []:
        check_kind(name, PLOTS)
    single = out.suffix.lower() in IMAGES
    if single and len(kind or PLOTS) > 1:
        what = f"{len(kind or PLOTS)} plots do not fit one file"
        raise MechanismError(Finding(what, str(out), "name a folder, or one --kind"))
    mechanism = model.read()
    with model.lines():
        result = _analysed(mechanism, steps).dataset
    ideal = _ideal(mechanism, steps)
    if not single:
        folder(out)
    drawn = whole_peaks(result, uncut)
    for name, picture in [(name, plot(drawn, name, ideal=ideal, at=at)) for name in kind or drawable(result)]:
        path = out if single else out / f"{name}.{format_.lstrip('.')}"
        save(picture, path)
        wrote(path)
    end([finding for finding in findings_of(result) if finding.severity is not Severity.NOTE], model.file, "assembly")


@verb(out="The HTML file to write.")
def report(model: Model, out: Path, settled: Friction, steps: int = 360, uncut: bool = False) -> None:
    """Write an HTML report: animation, plots, findings, inputs."""
    from trunnion.views.curves import whole_peaks
    from trunnion.views.shown import report

    check_target(out, "--out", "a report", PAGES)
    mechanism = model.read()
    with model.lines():
        result = _analysed(mechanism, steps, settled.checked())
    write_text(report(whole_peaks(result.dataset, uncut), ideal=_ideal(mechanism, steps)), out)
    wrote(out)
    raise Exit(exit_status(findings_of(result)))


def _analysed(mechanism: "Mechanism", steps: int, method: "FrictionMethod | None" = None, **more: Any) -> "Result":
    """Analyse, with a progress bar when it takes long enough to need one. more: engine, … of `analysed`."""
    from trunnion.cycle.analyse import analysed

    with bar("positions", steps, least=200_000) as progress:
        return analysed(mechanism, steps, method, progress, **more)


def _ideal(mechanism: "Mechanism", steps: int) -> "xr.Dataset | None":
    """The cycle without friction, to compare with; None if there is none."""
    if all(joint.friction is None for joint in mechanism.effective_joints.values()):
        return None
    return _analysed(mechanism.with_friction("off"), steps).dataset


PERCENT = 100
EVALUATIONS = 2_000_000  # as `simulate` has it


@verb(
    lacks="seat columns",
    time="Duration, as 2s or 300ms; default: ten cycles of the stated motion.",
    steps="Equal intervals of time in the result.",
    tolerance="Relative tolerance of the integration.",
    steady="The cycle that the motion comes to repeat, as `analyse` gives a cycle.",
    evaluations="Evaluations of the forces, after which the motion ends.",
    kind="Figure to write: sheet, speed, effort, reactions, energy, phase; in play contacts, gaps, orbit; of a steady "
    "cycle those of `trunnion plot`.",
)
def simulate(
    model: Model, files: Files, time: str | None = None, steps: int = 1000, tolerance: float = 1e-9,
    steady: bool = False, evaluations: int = EVALUATIONS, kind: str | None = None,
) -> None:  # fmt: skip
    """Motion in time: start-up, run-down, rest, locking, pins in play.

    The motion of drivers that are free or have a motor, with friction, stick and slip, forces, energy and events.
    """
    from trunnion.dynamics.opened import in_play
    from trunnion.dynamics.simulate import simulated
    from trunnion.dynamics.steady_cycle import UnsteadyError

    duration = seconds(time, "--time")
    mechanism = model.read()
    contacts = bool(in_play(mechanism))  # else there are none to write or draw
    check_files(files, "cycle" if steady else "motion", kind if files.out else None, in_play=contacts)
    if kind and files.out:
        from trunnion.views.motion import check_contacts  # with matplotlib

        check_contacts(kind, contacts)
    with model.lines(), bar("%", PERCENT) as progress:
        reached = None if progress is None else lambda share: progress(int(PERCENT * share))
        try:
            result = simulated(mechanism, duration, steps, tolerance, reached, steady, evaluations)
        except UnsteadyError as unsteady:
            end(unsteady.findings, model.file, "drivers")
    Shown(result, model, files, "drivers", drawn={"kind": kind}).finish()


MOST_RANGES = 24  # rows of the table of ranges


@verb(lacks="report", near="Locking margin below which a position counts as near locking.")
def locking(model: Model, files: Files, steps: int = 360, near: float = 1.5) -> None:
    """Margin against locking by friction; backdriving.

    The margin for the friction of all joints and of each joint alone, and the ranges of the drive in which the
    mechanism locks, is near locking, is self-locking or can be backdriven.
    """
    from trunnion.cycle.locking import look, report_figures
    from trunnion.cycle.locking_course import HEAD
    from trunnion.results.attributes import attribute
    from trunnion.solve.run import prepare

    check_files(files)
    files.columns = files.columns or ["locking"]
    mechanism = model.read()
    with model.lines():
        run = prepare(mechanism)
        with bar("positions", steps, least=200_000) as progress:
            result = look(run, steps, progress, near)
    figures = report_figures(run)

    def show() -> None:
        show_figures(mechanism.name or str(model.file), figures)
        if not mechanism.drivers:
            return
        line()
        ranges = attribute(result, "locking_ranges", "{}")
        title = f"ranges of {ranges['of']}".removesuffix(" of ") + ", pins centred" * bool(run.seats)
        rows = [row["cells"] for row in ranges["rows"]]  # in the order of the cycle; those near locking last
        show_rows(title, list(HEAD), rows[:MOST_RANGES])
        if len(rows) > MOST_RANGES:
            line(f"{len(rows) - MOST_RANGES} more ranges; --out has every position")

    Shown(result, model, files, "assembly", drawn={"kind": "locking"}, show=show).finish()


@verb(
    lacks="columns",
    over="NAME=FROM:TO:COUNT or NAME=VALUE,VALUE,…: misalignment=0deg:30deg:16. Repeatable.",
    measure="Result to show, by its name in the CSV file: A.effort_max, or a measure of the model. Repeatable.",
    x="The swept value on the x axis and in the rows of the table; default: the first.",
    family="The swept value with one curve each, or on the y axis of a map; default: the second.",
    kind="curves, or map: contours over two swept values.",
    margin="Compute the locking margin too; takes many times as long.",
)
def sweep(
    model: Model, files: Files, over_: list[str], measure: list[str] | None = None, x: str = "", family: str = "",
    kind: str = "curves", margin: bool = False, steps: int = 360, uncut: bool = False, engine: str = "auto",
) -> None:  # fmt: skip
    """Results over a range of model values: tables, curves, maps.

    Efficiency, drive effort, reactions, friction, locking margin and measures of the model.
    """
    from trunnion.studies.sweep import sweep as run
    from trunnion.views.curves import check_kind
    from trunnion.views.sweep import KINDS, check_axes, check_measure, tables

    grid = over(over_)
    measures = list(dict.fromkeys(measure or ["efficiency"]))
    check_kind(kind, KINDS)
    counts = {name: points({name: values}) for name, values in grid.items()}
    check_axes(counts, x, family)
    if kind == "map" and sum(count > 1 for count in counts.values()) < 2:
        what = "a map needs two names that vary"
        raise MechanismError(Finding(what, "--kind", "give --over twice, with several values each, or draw curves"))
    check_files(files)
    if len(measures) > 1 and any(path.suffix.lower() in IMAGES for path in files.out or ()):
        what = f"{len(measures)} figures do not fit one file"
        raise MechanismError(Finding(what, "--out", "give one --measure, or write a --report, which has all"))
    mechanism = model.read({name: values[0] for name, values in grid.items()})
    measures_read = check_measure(measures, mechanism)
    with model.lines(), bar("points", points(grid)) as progress:
        result = run(
            mechanism, grid, steps, progress=progress, margin=margin or "locking_margin" in measures,
            measures=measures_read, engine=engine,  # type: ignore[arg-type]  # it checks it
        )  # fmt: skip

    def show() -> None:
        parts = tables(result, measures, x, family)
        show_tables(mechanism.name or str(model.file), parts, apart=False)
        left_out = sum(table.left_out for table in parts) // (len(measures) if len(parts) > 1 else 1)
        if left_out:
            line(f"{counted(left_out, 'point')} more; --out FILE.csv has all")

    options = {"x": x, "family": family, "kind": kind}
    drawn, paged = {"measure": measures[0], **options}, {"measures": measures, **options}
    Shown(result, model, files, "assembly", uncut, drawn, paged, show=show).finish()
