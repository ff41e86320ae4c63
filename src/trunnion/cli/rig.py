"""`trunnion rig`: a test rig that is not there yet: what its sensors will show, and the files that they would leave."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from trunnion.cli.model import exit_status, lines_of, stated
from trunnion.cli.options import File, FrictionLaw, Seats, Seed, Set, TableFile
from trunnion.cli.terminal import bar, console, say, show_rows, wrote
from trunnion.errors import Finding, MechanismError, counted

if TYPE_CHECKING:
    from trunnion.rig.virtual.observe import Observation
    from trunnion.rig.virtual.plan import Expected, Forecast

__all__ = ["rig"]

MOST_SHOWN = 60  # conditions in a table
BIASED = 0.5  # of the standard uncertainty: a bias of the sensors that is shown
FEWEST = 20  # conditions from which a progress bar is worth it


def rig(
    file: File,
    rig_file: Annotated[Path, typer.Argument(help="Rig file: YAML, JSON or TOML.")],
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Folder for data files, mapping.yaml and truth.yaml.")
    ] = None,
    plan: Annotated[
        bool, typer.Option("--plan", help="Predict readings and efficiency; the default without --out.")
    ] = False,
    format_: Annotated[
        str | None, typer.Option("--format", help="csv, parquet or tdms; default: as stated in the rig file.")
    ] = None,
    seed: Seed = 1,
    set_: Set = None,
    table: TableFile = None,
    friction: FrictionLaw = None,
    seat: Seats = None,
) -> None:
    """Virtual test rig: plan sensors, or write simulated data files."""
    from trunnion.rig.reading.rig_file import Rig, placed_in_rig
    from trunnion.rig.virtual.files import check_folder, check_form
    from trunnion.rig.virtual.observe import observe

    if format_:
        check_form(format_)
    _in_order(file)
    mechanism = stated(file, set_, table, friction, seat)
    stated_rig = Rig.read(rig_file)
    if out and not format_:
        check_form(stated_rig.format)
    with lines_of(file), _lines_of_rig(rig_file):
        count = len(stated_rig.schedule.rows())
        if out:
            check_folder(stated_rig, out, format_ or "")
        with bar("conditions", count, least=FEWEST) as progress:
            observation = observe(mechanism, stated_rig, seed, progress)
    found = list(observation.findings)
    _about(observation)
    if plan or out is None:
        found += _show_plan(observation)
    if out:
        with bar("files", len(observation.cases), least=FEWEST) as progress:
            names = observation.write(out, format_ or "", progress)
        wrote(out)
        first, last, *_ = (*names[:1], *names[-3:-2])
        span = first if first == last else f"{first} … {last}"
        console().print(f"  {span}, {', '.join(names[-2:])}", markup=False, highlight=False, soft_wrap=True)
    say(placed_in_rig(found, rig_file))
    raise typer.Exit(exit_status(found) or int(bool(observation.skipped)))


def _in_order(file: Path) -> None:
    """MechanismError where the rig is named before the model."""
    from trunnion.model.file import read_entries

    if "trunnion-rig" in read_entries(file)[0]:
        raise MechanismError(Finding("is a rig file", remedy="name the model first, then the rig", file=str(file)))


@contextmanager
def _lines_of_rig(path: Path) -> Iterator[None]:
    """Findings about the rig bear the line of its file also where `observe` finds them."""
    from trunnion.rig.reading.rig_file import placed_in_rig

    try:
        yield
    except MechanismError as error:
        raise MechanismError(placed_in_rig(error.findings, path)) from None


def _about(observation: Observation) -> None:
    """What is recorded: conditions, turns, samples."""
    turns, conditions = observation.rig.schedule.turns, len(observation.cases)
    rows = max(case.rows for case in observation.cases)
    out = console()
    out.print(observation.rig.name or "Test rig", style="bold", markup=False)
    texts = (
        observation.mechanism.name or "no name",
        f"{conditions} condition{'s' * (conditions != 1)} of {turns} cycle{'s' * (turns != 1)}",
        f"{observation.rate:g} samples a second",
        counted(observation.rows, "row") + (f", at most {rows:,} a file" if conditions > 1 else ""),
    )
    out.print("; ".join(texts), markup=False, highlight=False, soft_wrap=True)


def _show_plan(observation: Observation) -> list[Finding]:
    """The two tables of a plan; what is to be thought about."""
    from trunnion.rig.virtual.plan import plan

    found = plan(observation)
    head = ["sensor", "measures", "least", "most", "unit", "of range", "steps", "noise"]
    show_rows("Predicted readings", head, [_sensor(one) for one in found.sensors])
    told = [one for one in found.conditions if one.measured]
    if told:
        names = list(dict.fromkeys(name for one in found.conditions for name in one.case.settings))
        biased = any(abs(one.bias) > BIASED * one.measured.uncertainty for one in told if one.measured)
        head = [*(names or ["condition"]), "η", *(["as measured"] if biased else []), "U (k = 2)", "main source"]
        rows = [_condition(one, names, biased) for one in told[:MOST_SHOWN]]
        show_rows(
            "Predicted efficiency: of the model, with the expanded uncertainty U = 2 u of its measurement", head, rows
        )
        if len(told) > MOST_SHOWN:
            console().print(f"{counted(len(told) - MOST_SHOWN, 'condition')} more", markup=False, highlight=False)
    return list(found.findings)


def _sensor(one: Expected) -> list[str]:
    share = "" if math.isnan(one.share) else f"{100 * one.share:.3g} %"
    if one.clipped:
        share = f"{share} clipped"
    steps = "" if math.isnan(one.steps) else f"{one.steps:,.0f}"
    noise = f"{one.noise:.3g}" if one.noise else ""
    return [one.sensor, one.measures, f"{one.least + 0.0:.5g}", f"{one.most + 0.0:.5g}", one.unit, share, steps, noise]


def _condition(one: Forecast, names: list[str], biased: bool) -> list[str]:
    assert one.measured is not None  # only those are shown
    settings = [_value(one.case.settings.get(name, "")) for name in names] or [str(one.case.number)]
    expanded = one.measured.expanded
    return [
        *settings,
        f"{one.model:.4f}" if math.isfinite(one.model) else "none",
        *([f"{one.measured.value:.4f}"] if biased else []),
        f"{expanded:#.2g}" if math.isfinite(expanded) else "unknown",
        one.dominant,
    ]


def _value(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:.6g}"
