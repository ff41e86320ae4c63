"""`trunnion sweep`: figures of the cycle over a grid of numbers of the model, as tables, files, curves and maps."""

from trunnion.cli.files import verb
from trunnion.cli.options import IMAGES, Files, Model, over, points
from trunnion.cli.result import Shown, check_files, show_tables
from trunnion.cli.terminal import bar, line
from trunnion.errors import Finding, MechanismError, counted

__all__ = ["sweep"]


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
