"""The options of the verbs: what is shared is declared once, by its name; a model, files and friction are groups.

What makes a function a verb: its options by the names of its parameters, its outputs said before it begins. No output
is a file that the verb reads, and no two are one file; both follow from the types of its options, as what its help
calls files, numbers and texts does.
"""

import functools
import inspect
import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from copy import copy
from dataclasses import MISSING, dataclass, fields, is_dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args, get_origin, get_type_hints

from typer import Argument, Option
from typer.models import ArgumentInfo, OptionInfo, ParameterInfo

from trunnion.errors import Finding, MechanismError
from trunnion.files import Target, writing

if TYPE_CHECKING:
    from trunnion.model.mechanism import Mechanism
    from trunnion.solve.friction_method import FrictionMethod

IMAGES = (".png", ".svg", ".pdf", ".jpg", ".jpeg")
PLOT_KINDS = (
    "torque, speed, friction-power, reactions, polar, power, mechanism, motion, error, seat, beta, locking or measures"
)
DATA = "Write the result: .csv .xlsx .json .nc .zarr .parquet. Repeatable."  # of --out where no figure is written
WRITTEN = "Write tables: .csv .xlsx .json .nc .zarr .parquet; figures: .png .svg .pdf .jpg. Repeatable."
CURVES = "x.positions.csv the curves, x.histogram.csv the samples, x.convergence.csv how they settle"
ONE_POSITION = "One position instead of the cycle: 60deg, 20mm, 0.1s."  # of --at

# by the name of the parameter: what it does, where a verb says nothing else; the flag follows from the name
OPTIONS: dict[str, Any] = {
    "file": Argument(help="Model file: YAML, JSON or TOML."),
    "set": "Replace a value: AB=2.1m, crank.mass=5kg, B.friction.coefficient=0.3. Repeatable.",
    "table": "NAME=FILE.csv: points of a driver or table, two columns. Repeatable.",
    "friction": "off, or a friction law for all joints with friction.",
    "seat": "loaded or free: position of the pins in all joints with play.",
    "out": Option("--out", "-o", help=WRITTEN),
    "report": "Also write the report, one HTML file.",
    "units_row": "Second CSV header row with the units.",
    "units": "Units of table files: si, or model for those of the model file.",
    "columns": "Columns of a table file: usual, motion (velocities, accelerations), locking, all, names. Repeatable.",
    "friction_method": Option(
        "--friction-method", "--method", help="newton, or successive-approximation (Durango et al., 2010)."
    ),
    "criterion": "Friction iteration: largest change of a load, N, at convergence; default: by the residual.",
    "iterations": "Limit of friction iterations.",
    "steps": "Equally spaced positions over the turn or range.",
    "at": "Position for measures that state none: 60deg, 20mm, 0.1s.",
    "measure": "A measure of the model, or rocker.C.x, angle:rocker, effort:A … (check --list). Repeatable.",
    "samples": "Number of random mechanisms.",
    "seed": "Seed of the random numbers; the same seed gives the same result.",
    "jobs": "Number of processes; default: one per core for long work.",
    "engine": "numpy, compiled, or auto: by size.",
    "uncut": "Show peaks near dead centres in full; default: cut at the frame.",
    "write": "Write the model with the values found: .yaml or .json.",
    "force": "With --write: allow overwriting the input itself.",
    "mapping": Argument(help="Mapping of the data: YAML, JSON or TOML."),
    "data": Argument(help="Data files instead of those in the mapping: CSV, Parquet, TDMS, NetCDF."),
}


@dataclass
class Model:
    """The model file, with the numbers and laws that stand in for its own."""

    file: Path
    set_: list[str] | None = None
    table: list[str] | None = None
    friction: str | None = None
    seat: str | None = None

    def read(self, swept: Mapping[str, float | str] | None = None) -> "Mechanism":
        """The model with the options applied: `--table` and `--seat` first, then `--friction` together with `--set`.

        So a number that is set stands against what is said of all joints, and may be one that only the other law has.
        swept: a value of each number that the verb replaces, which may be such a one too.
        """
        from trunnion.model.checks.check import bare_number
        from trunnion.model.mechanism import read_mechanism
        from trunnion.model.units import follow, stated_units

        mechanism = read_mechanism(self.file, dict(named_file(text) for text in self.table or ()))
        values = dict(setting(text) for text in self.set_ or ())
        if self.seat is not None:
            mechanism = mechanism.with_seats(self.seat)
        bare: list[Finding] = []  # numbers that lack the unit that the model has
        for name, value in values.items():
            with suppress(MechanismError):  # of a name that means nothing, which is said where it is set
                if not isinstance(value, str):
                    numbers = mechanism.parameter_set
                    bare += bare_number(numbers, numbers.resolve(name), value)
        if self.friction:
            mechanism = mechanism.with_friction(self.friction, {**(swept or {}), **values})
        elif values:
            mechanism = mechanism.with_values(values)
        again = {finding.where for finding in bare}
        mechanism.checked[:] = [*(finding for finding in mechanism.checked if finding.where not in again), *bare]
        follow(stated_units(mechanism))
        return mechanism

    @contextmanager
    def lines(self) -> Iterator[None]:
        """Findings about the model bear the line of its file also where the analysis finds them."""
        try:
            yield
        except MechanismError as error:
            raise MechanismError(placed(error.findings, self.file)) from None


def placed(findings: Iterable[Finding], file: Path, sections: Iterable[str] = ()) -> list[Finding]:
    """Findings with the line of the model file, if it can be read."""
    from trunnion.model.file import placed as place

    try:
        return place(findings, file, sections)
    except MechanismError:  # the file itself is what the findings are about
        return list(findings)


@dataclass
class Files:
    """Where a result goes, and what its tables have."""

    out: list[Path] | None = None
    report: Path | None = None
    units_row: bool = False
    units: Literal["si", "model"] = "si"
    columns: list[str] | None = None


@dataclass
class Friction:
    """How friction and reactions are settled."""

    friction_method: Literal["newton", "successive-approximation"] = "newton"
    criterion: float | None = None
    iterations: int = 200

    def checked(self) -> "FrictionMethod":
        """The method; MechanismError for figures that make no sense."""
        from trunnion.solve.friction_method import FrictionMethod

        return FrictionMethod(self.friction_method, self.criterion, self.iterations)


# ---- what texts say -----------------------------------------------------------------------------------------------


def named(text: str, option: str, what: str, remedy: str) -> tuple[str, str]:
    """The name and the value of `name=value`; MechanismError with this sentence and remedy if either lacks."""
    name, _, value = (part.strip() for part in text.partition("="))
    if not name or not value:
        raise MechanismError(Finding(f"'{text}' {what}", option, remedy))
    return name, value


def named_file(text: str, option: str = "--table") -> tuple[str, str]:
    """A name and its file from `name=file`."""
    return named(text, option, "names no file", "write NAME=FILE, e.g. A=motion.csv")


def setting(text: str) -> tuple[str, float | str]:
    """A name and its value from `name=value`."""
    name, value = named(text, "--set", "sets no value", "write name=value, e.g. AB=2.1m")
    return name, _plain(value)


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


def seconds(text: str | None, option: str) -> float | None:
    """A time above 0 in s, of a number or a text with its unit; None if it is not given. MechanismError for others."""
    from trunnion.model.quantity import Quantity
    from trunnion.model.units import KINDS, UnitError

    if text is None:
        return None
    time = math.nan
    with suppress(UnitError, KeyError):  # the latter of a dimension of the model, which is not asked here
        time = float(Quantity.read(_plain(text), KINDS["time"]).evaluate())
    if not time > 0:
        raise MechanismError(Finding(f"'{text.strip()}' is no time above 0", option, "give a time such as 2s"))
    return time


def over(texts: list[str]) -> dict[str, Any]:
    """Values to sweep over, by name: from, to and count of `name=0deg:30deg:7`, or the list of `name=0deg,5deg`."""
    grid: dict[str, Any] = {}
    what = "is no range and no list of values"
    remedy = "write NAME=FROM:TO:COUNT or NAME=VALUE,VALUE,…, e.g. misalignment=0deg:30deg:7"
    for text in texts:
        name, values = named(text, "--over", what, remedy)
        parts = values.split(":")
        counted = len(parts) == 3 and parts[2].strip().isdecimal()
        if not all(part.strip() for part in parts) or not (counted or len(parts) == 1):
            raise MechanismError(Finding(f"'{text}' {what}", "--over", remedy))
        if name in grid:
            raise MechanismError(Finding(f"'{name}' is given twice", "--over", "give all its values at once"))
        ends = [_plain(part) for part in (parts[:2] if counted else values.split(","))]
        grid[name] = (*ends, int(parts[2])) if counted else ends
    return grid


def points(grid: Mapping[str, Any]) -> int:
    """How many points a grid has."""
    return math.prod(values[2] if isinstance(values, tuple) else len(values) for values in grid.values())


# ---- what makes a function a verb -----------------------------------------------------------------------------------

Hints = dict[str, Any]  # types by the names of parameters
IN_PLACE = {"write": "file"}  # may name that input itself; the verb asks for --force then


def verb(lacks: str = "", **helps: str | ParameterInfo) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Make a function a verb: Typer sees its parameters and those of its groups (`Model`, `Files`, …) as options.

    Modules with verbs do not postpone their annotations: as texts all options would be compiled at every start.

    Parameters
    ----------
    lacks
        Options of the groups that this verb has not.
    **helps
        What a parameter does, or how Typer is to read it, where that is not as in `OPTIONS`.
    """

    def decorated(function: Callable[..., None]) -> Callable[..., None]:
        hints = get_type_hints(function, include_extras=True)
        groups: Hints = {name: hint for name, hint in hints.items() if is_dataclass(hint)}

        @functools.wraps(function)
        def run(**options: Any) -> None:
            own = {name: value for name, value in options.items() if name in hints}
            for name, group in groups.items():
                own[name] = group(**{part.name: options[part.name] for part in fields(group) if part.name in options})
            try:
                targets = []
                for name in outputs(run):
                    paths, flag = options.get(name), f"--{name.strip('_').replace('_', '-')}"
                    several = paths if isinstance(paths, list) else [paths] if paths is not None else []
                    targets += [Target(flag, path, options.get(IN_PLACE.get(name, ""))) for path in several]
                with writing(targets):
                    function(**own)
            except MechanismError as error:  # what Python calls by the name of an argument is an option here
                flags = {name.strip("_"): flag for name, _, _, flag in options_of(run)}
                raise MechanismError(
                    [replace(finding, where=flags.get(finding.where, finding.where)) for finding in error.findings]
                ) from None

        parameters = _spread(function, hints, groups, lacks.split(), helps)
        run.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
        run.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
        return run

    return decorated


def _spread(
    function: Callable[..., None],
    hints: Hints,
    groups: Hints,
    lacks: Collection[str],
    helps: Mapping[str, str | ParameterInfo],
) -> list[inspect.Parameter]:
    """The arguments of a verb, those of groups first, and its options, those of groups last."""
    every: list[tuple[int, inspect.Parameter]] = []

    def add(name: str, hint: Any, usual: Any, shared: bool) -> None:
        info = _read(name.strip("_"), helps)
        argument, kind = isinstance(info, ArgumentInfo), next(types_in(hint))
        words = {Path: "FILE", int: "NUMBER", float: "NUMBER", str: "TEXT"}  # none for a switch
        word = "|".join(get_args(kind)) if get_origin(kind) is Literal else words.get(kind)
        info.metavar = info.metavar or (name.upper() if argument else word)
        default = inspect.Parameter.empty if usual is MISSING else usual
        annotation = Annotated[hint, info]
        parameter = inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)
        every.append(((1 - shared) if argument else (2 + shared), parameter))

    for name, parameter in inspect.signature(function).parameters.items():
        if name not in groups:
            add(name, hints[name], MISSING if parameter.default is parameter.empty else parameter.default, False)
            continue
        types = _types(groups[name])
        for part in fields(groups[name]):
            if part.name not in lacks:
                add(part.name, types[part.name], part.default, True)
    return [parameter for _, parameter in sorted(every, key=lambda pair: pair[0])]


def _read(name: str, helps: Mapping[str, str | ParameterInfo]) -> ParameterInfo:
    """How Typer reads a parameter: as it is declared for all verbs, with the help of this one."""
    special = helps.get(name)
    declared = special if isinstance(special, ParameterInfo) else OPTIONS.get(name, "")
    info: ParameterInfo = (
        copy(declared) if isinstance(declared, ParameterInfo) else Option(f"--{name.replace('_', '-')}", help=declared)
    )
    if isinstance(special, str):
        info.help = special
    return info


@functools.cache
def _types(group: type) -> Hints:
    """The types of the options of a group, read once for all verbs."""
    return get_type_hints(group, include_extras=True)


def types_in(hint: Any) -> Iterator[type]:
    """The types that a type is made of: of `list[str] | None` text and none; choices are one type."""
    parts = () if get_origin(hint) is Literal else get_args(hint)
    for part in parts:
        yield from types_in(part)
    if not parts:
        yield hint


# ---- what the types of a verb say ----------------------------------------------------------------------------------


def options_of(verb: Callable[..., None]) -> Iterator[tuple[str, Any, OptionInfo, str]]:
    """The options of a verb: the parameter, its type, what Typer knows of it, and the flag."""
    for name, hint in get_type_hints(verb, include_extras=True).items():
        info: ParameterInfo | None = next(iter(getattr(hint, "__metadata__", ())), None)
        if isinstance(info, OptionInfo):
            words = (info.default, *(info.param_decls or ()))  # of an annotation Typer calls the first the default
            flag = next((str(word) for word in words if str(word).startswith("--")), f"--{name.replace('_', '-')}")
            yield name, get_args(hint)[0], info, flag


def outputs(verb: Callable[..., None]) -> list[str]:
    """The parameters that name files to be written: every option that takes a path. Inputs are arguments or texts."""
    return [name for name, hint, _, _ in options_of(verb) if Path in types_in(hint)]
