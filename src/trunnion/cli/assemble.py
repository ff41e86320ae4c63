"""`trunnion assemble`: whether the stated clearances take up the errors, and the smallest clearance that would."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

import typer

from trunnion.cli.model import lines_of, stated
from trunnion.cli.options import File, Out, Report, Set, Steps, TableUnits, Units, UnitsRow
from trunnion.cli.result import Shown, check_files
from trunnion.cli.terminal import bar

__all__ = ["assemble"]


class Uniform(StrEnum):
    """What has one and the same clearance where the smallest is looked for."""

    PINS = "pins"
    ALL = "all"


def assemble(
    file: File,
    steps: Steps = 360,
    set_: Set = None,
    uniform: Annotated[
        Uniform, typer.Option("--uniform", help="Joints with one common clearance: pins, or all kinds of play.")
    ] = Uniform.PINS,
    out: Out = None,
    report: Report = None,
    units_row: UnitsRow = False,
    units: Units = TableUnits.si,
) -> None:
    """Clearance needed to assemble a linkage with axis errors."""
    from trunnion.studies.assembly import assemble as run

    check_files(out or [], report)
    mechanism = stated(file, set_)
    with lines_of(file), bar("positions", steps, least=1000) as progress:
        result = run(mechanism, steps, uniform.value, progress)
    Shown(result, file, ["assembly"], out or [], report, units_row, units=units).finish()
