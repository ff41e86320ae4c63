"""The options that verbs share, and what their texts say: `name=value`, `name=file`, `name=from:to:count`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from trunnion.errors import Finding, MechanismError

__all__ = [
    "IMAGES",
    "At",
    "Criterion",
    "Data",
    "DataFiles",
    "Dtype",
    "Engine",
    "File",
    "Force",
    "FrictionLaw",
    "Jobs",
    "Kinds",
    "MappingFile",
    "Measures",
    "Method",
    "OnePosition",
    "Out",
    "OutAllocation",
    "OutTolerance",
    "Report",
    "Rounds",
    "Seats",
    "Seed",
    "Set",
    "Steps",
    "TableFile",
    "TableUnits",
    "Units",
    "UnitsRow",
    "Variables",
    "Write",
    "named_file",
    "over",
    "points",
    "seconds",
    "setting",
    "share",
]

IMAGES = (".png", ".svg", ".pdf", ".jpg", ".jpeg")
PLOT_KINDS = (
    "torque, speed, friction-power, reactions, polar, power, mechanism, motion, error, seat, beta, locking or measures"
)

File = Annotated[Path, typer.Argument(help="Model file: YAML, JSON or TOML.")]
Steps = Annotated[int, typer.Option("--steps", help="Equally spaced positions over the turn or range.")]
Set = Annotated[
    list[str] | None,
    typer.Option("--set", help="Replace a value: AB=2.1m, crank.mass=5kg, B.friction.coefficient=0.3. Repeatable."),
]
TableFile = Annotated[
    list[str] | None,
    typer.Option("--table", help="NAME=FILE.csv: points of a driver or table, two columns. Repeatable."),
]
FrictionLaw = Annotated[
    str | None, typer.Option("--friction", help="off, or a friction law for all joints with friction.")
]
Seats = Annotated[
    str | None, typer.Option("--seat", help="loaded or free: position of the pins in all joints with play.")
]
Method = Annotated[
    str,
    typer.Option("--friction-method", "--method", help="newton, or successive-approximation (Durango et al., 2010)."),
]
Criterion = Annotated[
    float | None,
    typer.Option(
        "--criterion", help="Friction iteration: largest change of a load, N, at convergence; default: by the residual."
    ),
]
Rounds = Annotated[int, typer.Option("--iterations", help="Limit of friction iterations.")]
At = Annotated[str | None, typer.Option("--at", help="Position for measures that state none: 60deg, 20mm, 0.1s.")]
OnePosition = Annotated[str | None, typer.Option("--at", help="One position instead of the cycle: 60deg, 20mm, 0.1s.")]
Seed = Annotated[int, typer.Option("--seed", help="Seed of the random numbers; the same seed gives the same result.")]
Jobs = Annotated[int | None, typer.Option("--jobs", help="Number of processes; default: one per core for long work.")]
MappingFile = Annotated[Path, typer.Argument(help="Mapping of the data: YAML.")]
DataFiles = Annotated[
    list[Path] | None, typer.Argument(help="Data files instead of those in the mapping: CSV, Parquet, TDMS.")
]
Write = Annotated[Path | None, typer.Option("--write", help="Write the model with the values found: .yaml or .json.")]
Force = Annotated[bool, typer.Option("--force", help="With --write: allow overwriting the input itself.")]
Report = Annotated[Path | None, typer.Option("--report", help="Also write the report, one HTML file.")]
WRITTEN = "Write tables: .csv .xlsx .json .nc .zarr .parquet; figures: .png .svg .pdf .jpg. Repeatable."
TABLES = "x.positions.csv the curves, x.histogram.csv the samples, x.convergence.csv how they settle"
OF_TOLERANCE = f"The name says which table: x.csv has the measures, x.parameters.csv the contributions, {TABLES}."
OF_ALLOCATION = (
    "The name says which table: x.csv has the tolerances, x.measures.csv the measures, x.offers.csv the cost over "
    f"accuracy, {TABLES}."
)
Out = Annotated[list[Path] | None, typer.Option("--out", "-o", help=WRITTEN)]
OutTolerance = Annotated[list[Path] | None, typer.Option("--out", "-o", help=f"{WRITTEN} {OF_TOLERANCE}")]
OutAllocation = Annotated[list[Path] | None, typer.Option("--out", "-o", help=f"{WRITTEN} {OF_ALLOCATION}")]
Engine = Annotated[str, typer.Option("--engine", help="numpy, compiled, or auto: by size.")]
Data = Annotated[
    list[Path] | None,
    typer.Option("--out", "-o", help="Write the result: .csv .xlsx .json .nc .zarr .parquet. Repeatable."),
]
Uncut = Annotated[
    bool, typer.Option("--uncut", help="Show peaks near dead centres in full; default: cut at the frame.")
]
Columns = Annotated[
    list[str] | None,
    typer.Option(
        "--columns",
        help="Columns of a table file: usual, motion (velocities, accelerations), locking, all, or names. Repeatable.",
    ),
]
Variables = Annotated[
    list[str] | None,
    typer.Option("--variables", help="Keep these variables only: reaction_force, drive_effort … Repeatable."),
]
Dtype = Annotated[str, typer.Option("--dtype", help="Numbers of the files: float64, or float32.")]
UnitsRow = Annotated[bool, typer.Option("--units-row", help="Second CSV header row with the units.")]


class TableUnits(StrEnum):
    """What tables are written in."""

    si = "si"
    model = "model"


Units = Annotated[
    TableUnits, typer.Option("--units", help="Units of table files: si, or model for those of the model file.")
]
Kinds = Annotated[list[str] | None, typer.Option("--kind", help=f"{PLOT_KINDS}. Repeatable; all if not given.")]
Measures = Annotated[
    list[str] | None,
    typer.Option(
        "--measure", help="A measure of the model, or rocker.C.x, angle:rocker, effort:A … (check --list). Repeatable."
    ),
]


def setting(text: str) -> tuple[str, float | str]:
    """A name and its value from `name=value`."""
    name, equals, value = text.partition("=")
    if not equals or not name.strip() or not value.strip():
        raise MechanismError(Finding(f"'{text}' sets no value", "--set", "write name=value, e.g. AB=2.1m"))
    return name.strip(), _plain(value)


def share(text: str) -> float:
    """A share as 0.99 or 99 %."""
    number, percent, rest = text.strip().partition("%")
    if rest:
        raise ValueError(text)
    return float(number) / (100.0 if percent else 1.0)


def _plain(text: str) -> float | str:
    """A number, which is SI, or a text with its unit."""
    try:
        return float(text)
    except ValueError:
        return text.strip()


def seconds(text: str | None, option: str, usual: str) -> float | None:
    """A time above 0 in s, from a number or a text with its unit; None if it is not given.

    usual: a time as one would give it, for the remedy. Raises MechanismError if the text is no such time.
    """
    from trunnion.model.quantity import Quantity
    from trunnion.model.units import KINDS, UnitError

    if text is None:
        return None
    remedy = f"give a time such as {usual}"
    try:
        stated = Quantity.read(_plain(text), KINDS["time"])
    except UnitError as error:
        raise MechanismError(Finding(error.what, option, error.remedy or remedy)) from None
    if stated.names:  # of a model, which is not asked here
        raise MechanismError(Finding(f"'{text.strip()}' is no time", option, remedy))
    found = float(stated.evaluate())
    if not found > 0:
        raise MechanismError(Finding(f"a time of {text.strip()} is not above 0", option, remedy))
    return found


def over(texts: list[str]) -> dict[str, Any]:
    """Values to sweep over, by name: from, to and count of `name=0deg:30deg:7`, or the list of `name=0deg,5deg`."""
    found: dict[str, Any] = {}
    for text in texts:
        name, _, values = (part.strip() for part in text.partition("="))
        parts = values.split(":")
        if not name or not all(part.strip() for part in parts) or len(parts) not in (1, 3):
            remedy = "write NAME=FROM:TO:COUNT or NAME=VALUE,VALUE,…, e.g. misalignment=0deg:30deg:7"
            raise MechanismError(Finding(f"'{text}' is no range and no list of values", "--over", remedy))
        if name in found:
            raise MechanismError(Finding(f"'{name}' is given twice", "--over", "give all its values at once"))
        found[name] = _range(name, parts) if len(parts) == 3 else [_plain(value) for value in values.split(",")]
    return found


def _range(name: str, parts: list[str]) -> tuple[float | str, float | str, int]:
    try:
        return _plain(parts[0]), _plain(parts[1]), int(parts[2])
    except ValueError:
        what = f"the count '{parts[2].strip()}' is no whole number"
        raise MechanismError(Finding(what, f"--over {name}", "write FROM:TO:COUNT, e.g. 0deg:30deg:7")) from None


def points(grid: Mapping[str, Any]) -> int:
    """How many points a grid has."""
    return math.prod(values[2] if isinstance(values, tuple) else len(values) for values in grid.values())


def named_file(text: str, option: str = "--table") -> tuple[str, str]:
    """A name and its file from `name=file`."""
    name, _, path = (part.strip() for part in text.partition("="))
    if not name or not path:
        raise MechanismError(Finding(f"'{text}' names no file", option, "write NAME=FILE, e.g. A=motion.csv"))
    return name, path
