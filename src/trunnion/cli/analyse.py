"""`trunnion analyse`, `plot`, `report` and `design`: a cycle as numbers, pictures and a page, and its design values."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Exit, Option

from trunnion.cli.files import verb
from trunnion.cli.options import (
    DATA,
    IMAGES,
    PLOT_KINDS,
    Engine,
    Files,
    Friction,
    Model,
    OnePosition,
    Picture,
    Steps,
    Uncut,
)
from trunnion.cli.result import Shown, check_files, check_page, end, exit_status, write_text
from trunnion.cli.terminal import bar, show_figures, show_rows, wrote
from trunnion.errors import Finding, MechanismError, Severity
from trunnion.files import folder
from trunnion.results.attributes import findings_of

if TYPE_CHECKING:
    import xarray as xr

    from trunnion.model.mechanism import Mechanism
    from trunnion.results.result import Result
    from trunnion.solve.friction_method import FrictionMethod

__all__ = ["analyse", "design", "plot", "report"]


@verb(out=DATA)
def analyse(
    model: Model, files: Files, settled: Friction, steps: Steps = 360, at: OnePosition = None, uncut: Uncut = False,
    engine: Engine = "auto",
    variables: Annotated[
        list[str] | None,
        Option("--variables", help="Keep these variables only: reaction_force, drive_effort … Repeatable."),
    ] = None,
    dtype: Annotated[str, Option("--dtype", help="Numbers of the files: float64, or float32.")] = "float64",
) -> None:  # fmt: skip
    """Analyse a cycle: motion, reactions, friction, effort, power."""
    from trunnion.cycle.positions import Kept

    check_files(files, drawn=False, instead=f"trunnion plot {model.file}")
    kept = Kept.read(variables, dtype)  # type: ignore[arg-type]  # it checks them
    if files.report and kept.variables is not None:
        raise MechanismError(Finding("a report is made of all variables", "--variables", "leave one of both out"))
    if files.report and at:
        raise MechanismError(Finding("a report is of the whole cycle", "--at", "leave one of both out"))
    mechanism = model.read()
    saved = {"units_row": files.units_row, "columns": files.columns, "units": files.units}
    with model.lines():
        result = _analysed(mechanism, steps, settled.checked(), engine, kept, files.out or [], saved, at)

    def show_position() -> None:
        """Every number of one position, with its unit."""
        from trunnion.results.quantities import parts
        from trunnion.results.tables import columns

        rows = []
        for name, unit, values in columns(result.dataset):
            text, shown = (values[0], "") if isinstance(values[0], str) else parts(float(values[0]), unit)
            rows.append([name, text, "" if shown == "1" else shown])
        show_rows(f"{result.attrs['name'] or model.file} at {at}", ["", "value", "unit"], rows)

    shown = Shown(result, model, Files(), "assembly", show=show_position if at else None, written=files.out or [])
    if files.report is not None:
        write_text(_page(mechanism, result, uncut), files.report)
        shown.written.append(files.report)
    shown.end()


@verb(lacks="seat")
def design(
    model: Model,
    fluctuation: Annotated[float, Option("--fluctuation", help="Speed fluctuation that the flywheel allows.")] = 0.05,
) -> None:
    """Design values: transmission angle, dead centres, flywheel.

    Transmission angles, dead centres, range, Grashof type, shaking force, balance, flywheel, motor.
    """
    from trunnion.studies.design import report_figures

    mechanism = model.read()
    with model.lines():
        figures = report_figures(mechanism, fluctuation)
    show_figures(mechanism.name or str(model.file), figures)


@verb()
def plot(
    model: Model,
    out: Annotated[Path, Option("--out", "-o", help="Folder, or a .png .svg .pdf .jpg file of one plot.")],
    kind: Annotated[list[str] | None, Option("--kind", help=f"{PLOT_KINDS}. Repeatable; all if not given.")] = None,
    steps: Steps = 360,
    at: Annotated[
        str | None,
        Option("--at", help="Position to draw the mechanism in and to mark in curves: 60deg, 20mm, 0.1s."),
    ] = None,
    image: Picture = "png", uncut: Uncut = False,
) -> None:  # fmt: skip
    """Plot a cycle: torque, friction power, reactions, mechanism."""
    from trunnion.views.charts import check_kind
    from trunnion.views.common.peaks import whole_peaks
    from trunnion.views.cycle.deviations import with_worst_case
    from trunnion.views.cycle.plots import PLOTS, drawable, figure, save

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
    shown = whole_peaks(with_worst_case(result, mechanism) if "error" in (kind or PLOTS) else result, uncut)
    for name, picture in [(name, figure(shown, name, ideal, at)) for name in kind or drawable(result)]:
        path = out if single else out / f"{name}.{image.lstrip('.')}"
        save(picture, path)
        wrote(path)
    end([finding for finding in findings_of(result) if finding.severity is not Severity.NOTE], model.file, "assembly")


@verb()
def report(
    model: Model,
    out: Annotated[Path, Option("--out", "-o", help="The HTML file to write.")],
    settled: Friction, steps: Steps = 360, uncut: Uncut = False,
) -> None:  # fmt: skip
    """Write an HTML report: animation, plots, findings, inputs."""
    check_page(out, "--out")
    mechanism = model.read()
    with model.lines():
        result = _analysed(mechanism, steps, settled.checked())
    write_text(_page(mechanism, result, uncut), out)
    wrote(out)
    raise Exit(exit_status(findings_of(result)))


def _analysed(mechanism: Mechanism, steps: int, method: FrictionMethod | None = None, *more: Any) -> Result:
    """Analyse, with a progress bar when it takes long enough to need one. more: engine, … of `analysed`."""
    from trunnion.cycle.analyse import analysed

    with bar("positions", steps, least=200_000) as progress:
        return analysed(mechanism, steps, method, progress, *more)


def _ideal(mechanism: Mechanism, steps: int) -> xr.Dataset | None:
    """The cycle without friction, to compare with; None if there is none."""
    if all(joint.friction is None for joint in mechanism.effective_joints.values()):
        return None
    return _analysed(mechanism.with_friction("off"), steps).dataset


def _page(mechanism: Mechanism, analysed: Result, uncut: bool) -> str:
    """The report of a cycle as HTML."""
    from trunnion.views.common.peaks import whole_peaks
    from trunnion.views.cycle.deviations import with_worst_case
    from trunnion.views.cycle.report import report as page

    result = analysed.dataset
    shown = whole_peaks(with_worst_case(result, mechanism), uncut)
    return page(shown, _ideal(mechanism, result.sizes["position"]))
