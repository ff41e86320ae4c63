"""Which numbers of a mechanism vary, within which limits and how, and what that costs: `tolerances`, `costs` ….

A name is one that `--set` takes. One of `joint_defaults` means the number of each joint that has it; those vary
independently. A number that is stated with ± or by a fit varies too."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from itertools import combinations, pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.namespace import Number
from trunnion.errors import Finding, MechanismError
from trunnion.joints.fits import standard_tolerance
from trunnion.model.changes import assign
from trunnion.model.csv_table import column
from trunnion.model.limits import DIGITS, Limits, half_width, limits_text, number_with, written
from trunnion.model.names import ParameterNames
from trunnion.model.parameters import Entry, Location, Numbers, ParameterSet, measured
from trunnion.model.quantity import Quantity
from trunnion.model.tolerance_parts import DISTRIBUTIONS, Cost, Variation
from trunnion.model.units import KINDS, Kind, UnitError, unit

__all__ = [
    "Price",
    "ProcessChoice",
    "Tolerance",
    "clearance_of",
    "correlation",
    "cost_entries",
    "cost_paths",
    "ends_motion",
    "followers",
    "kept",
    "may_vary",
    "named_paths",
    "prices",
    "tolerated",
    "towards",
    "variations",
    "with_samples",
    "with_tolerances",
    "written_limits",
]

DEFAULTS = "joint_defaults."
FULL_TURN = "direction"  # the distribution over all directions


@dataclass(frozen=True)
class Tolerance:
    """A number that varies.

    path: of the number; nominal: its value as it stands, SI; lower, upper: signed deviations, SI; distribution: a key
    of DISTRIBUTIONS; options: what it was told, SI, as far as stated: cp, cpk, shift, mode, alpha, beta, values (a
    tuple); direction: path of the angle that goes with it, uniform over a full turn, or empty.
    """

    path: str
    nominal: float
    lower: float
    upper: float
    distribution: str = "normal"
    options: Mapping[str, float | tuple[float, ...]] = field(default_factory=dict)
    direction: str = ""

    @property
    def half_width(self) -> float:
        """Half the distance of the limits."""
        return (self.upper - self.lower) / 2

    @property
    def can_be_chosen(self) -> bool:
        """Whether its limits are a choice: not where it varies as measured, or over a full turn."""
        return "values" not in self.options and self.distribution != FULL_TURN


def tolerated(mechanism: Numbers, numbers: ParameterSet | None = None) -> list[Tolerance]:
    """Every number that varies, in the order of the parameters.

    numbers: those of the mechanism, where some of it could not be read.
    """
    numbers = numbers or mechanism.parameter_set
    varied, written = variations(mechanism, numbers), written_limits(numbers)
    return [
        _tolerance(mechanism, numbers, entry, varied.get(path, ("", Variation()))[1], written.get(path))
        for path, entry in numbers.entries.items()
        if path in varied or (path in written and may_vary(entry))
    ]


def written_limits(numbers: ParameterSet) -> dict[str, tuple[float, float]]:
    """(lower, upper) signed deviations, SI, of every number that is stated with them, by path.

    Those in `joint_defaults` are of each joint that follows it.
    """
    return {
        path: entry.quantity.tolerance
        for path, entry in numbers.entries.items()
        if entry.quantity.tolerance
        and not path.startswith(DEFAULTS)
        and (not entry.alias or entry.alias.startswith(DEFAULTS))
    }


def may_vary(entry: Entry) -> bool:
    """Whether a number is one of the mechanism itself: not of its measures, nor of where it begins and ends."""
    return (
        not entry.varies
        and entry.path.partition(".")[0] not in ("measures", "assembly")
        and not ends_motion(entry.path)
    )


def ends_motion(path: str) -> bool:
    """Whether a number says where a driver begins or ends: samples are compared at the same coordinates of it."""
    return path.startswith("drivers.") and path.split(".")[2:3] in (["start"], ["range"])


def variations(mechanism: Numbers, numbers: ParameterSet) -> dict[str, tuple[str, Variation]]:
    """Name and entry of `tolerances` by path; names that mean nothing are left out, as findings of their own."""
    varied: dict[str, tuple[str, Variation]] = {}
    shared: dict[str, tuple[str, Variation]] = {}
    for name, variation in mechanism.variations.items():
        try:
            path = numbers.resolve(name)
        except MechanismError:
            continue
        of_all = path.startswith(DEFAULTS)
        for follower in followers(numbers, path) if of_all else [path]:
            if may_vary(numbers.entries[follower]):
                (shared if of_all else varied).setdefault(follower, (name, variation))
    return {**shared, **varied}


def followers(numbers: ParameterSet, path: str) -> list[str]:
    """The paths that a name of `joint_defaults` means: those of the joints that follow it."""
    return [entry.path for entry in numbers.entries.values() if entry.alias == path]


def towards(path: str, numbers: ParameterSet) -> str:
    """The angle of the direction in which a tilt or an offset of a misaligned axis points; empty for others."""
    for key, angle in (("tilt", "towards"), ("offset", "offset_towards")):
        before = path.removesuffix(f".misalignment.{key}")
        if before != path and f"{before}.misalignment.{angle}" in numbers.entries:
            return f"{before}.misalignment.{angle}"
    return ""


def _tolerance(
    mechanism: Numbers,
    numbers: ParameterSet,
    entry: Entry,
    variation: Variation,
    written: tuple[float, float] | None,
) -> Tolerance:
    """written: limits that stand with the number itself."""
    distribution, options = _distribution(mechanism, variation)
    values = {key: _value(option, numbers.dimension_values) for key, option in options.items()}
    sample = values.get("values")
    if variation.limits is not None:
        lower, upper = (
            _number(limit, numbers.dimension_values) for limit in (variation.limits.lower, variation.limits.upper)
        )
    elif written is not None:
        lower, upper = written
    elif isinstance(sample, tuple):
        lower, upper = min(sample), max(sample)
    else:
        lower, upper = (-np.pi, np.pi) if distribution == FULL_TURN else (np.nan, np.nan)
    direction = towards(entry.path, numbers) if variation.direction else ""
    nominal = float(numbers.nominal[entry.path])
    return Tolerance(entry.path, nominal, lower, upper, distribution, values, direction)


def _distribution(mechanism: Numbers, variation: Variation) -> tuple[str, dict[str, Quantity | tuple[Quantity, ...]]]:
    """Its name and what it is told; defaults are for what the distribution takes and the entry does not say."""
    defaults = mechanism.tolerance_defaults
    name = variation.distribution or defaults.distribution
    options = {}
    for key in DISTRIBUTIONS[name]:
        option = getattr(variation, key)
        # a default cpk is one beside the default cp
        spoken = key == "cpk" and variation.cp is not None
        value = option if option is not None or spoken else getattr(defaults, key, None)
        if value is not None:
            options[key] = value
    return name, options


def _value(option: Quantity | tuple[Quantity, ...], dimensions: Mapping[str, Number]) -> float | tuple[float, ...]:
    if isinstance(option, tuple):
        return tuple(_number(item, dimensions) for item in option)
    return _number(option, dimensions)


def _number(quantity: Quantity, dimensions: Mapping[str, Number]) -> float:
    """The value; nan if it cannot be known, which is a finding of its own."""
    return float(quantity.evaluate(dimensions)) if set(quantity.names) <= dimensions.keys() else np.nan


# ---- correlation ----------------------------------------------------------------------------------------------


def correlation(mechanism: Numbers, numbers: ParameterSet | None = None) -> NDArray[np.float64]:
    """The matrix of the correlations of all tolerated numbers, in the order of `tolerated`."""
    numbers = numbers or mechanism.parameter_set
    place = {tolerance.path: index for index, tolerance in enumerate(tolerated(mechanism, numbers))}
    matrix = np.eye(len(place))
    for correlation in mechanism.correlations:
        paths = [path for path in named_paths(numbers, correlation.of) if path in place]
        value = _number(correlation.coefficient, numbers.dimension_values)
        for first, other in combinations(dict.fromkeys(paths), 2):
            matrix[place[first], place[other]] = matrix[place[other], place[first]] = value
    return matrix


def named_paths(numbers: ParameterSet, names: Iterable[str]) -> list[str]:
    """The paths that names mean, those of `joint_defaults` as the numbers of the joints; unknown ones left out."""
    paths: list[str] = []
    for name in names:
        try:
            path = numbers.resolve(name)
        except MechanismError:
            continue
        paths += followers(numbers, path) if path.startswith(DEFAULTS) else [path]
    return paths


# ---- other tolerances -----------------------------------------------------------------------------------------


def clearance_of(mechanism: Numbers, name: str, numbers: ParameterSet | None = None) -> str:
    """The path of the clearance that `joints.B.clearance` or `B.clearance` means, of pin or guide; empty if none.

    The play of a joint is meant, and not a tolerance of the number that states it, which is `joints.B.pin.clearance`.
    """
    joint = name.removeprefix("joints.").removesuffix(".clearance")
    if not name.endswith(".clearance") or joint not in mechanism.effective_joints:
        return ""
    entries = (numbers or mechanism.parameter_set).entries
    paths = [f"joints.{joint}.{part}.clearance" for part in ("pin", "guide")]
    return next((path for path in paths if path in entries), "")


def with_tolerances(mechanism: Numbers, half_widths: Mapping[str, float | str], digits: int = DIGITS) -> dict[str, Any]:
    """Plain data of the mechanism with other half widths of tolerances, and other clearances, SI or text, by name."""
    numbers = mechanism.parameter_set
    kinds = measured(mechanism, numbers.entries.values())
    tolerances = {item.path: item for item in tolerated(mechanism)}
    varied = variations(mechanism, numbers)
    clearances: dict[str, str] = {}
    texts: list[tuple[Location, str]] = []
    entries: dict[str, Any] = {}
    findings: list[Finding] = []
    for name, half_width_text in half_widths.items():
        if play := clearance_of(mechanism, name):
            half = _half(half_width_text, KINDS["length"], name, findings)
            clearances[play] = written(half, KINDS["length"], digits)
            continue
        path = numbers.resolve(name)
        tolerance = tolerances.get(path)
        if tolerance is None or not tolerance.can_be_chosen:
            what = "has no tolerance" if tolerance is None else "varies as measured or over a full turn"
            findings.append(Finding(f"'{name}' {what}, none can be replaced", remedy="state limits in tolerances: {…}"))
            continue
        half = _half(half_width_text, kinds[path], name, findings)
        key, variation = varied.get(path, ("", Variation()))
        if variation.limits is None and (deviation := _in_place(mechanism, numbers.entries[path], half, digits)):
            texts.append(deviation)
            continue
        text = limits_text((tolerance.lower + tolerance.upper) / 2, half, kinds[path], digits)
        own_key = key if key and not numbers.resolve(key).startswith(DEFAULTS) else path
        group = variation.model_copy(update={"limits": Limits.read(text)})
        entries[own_key] = Variation(**{item: getattr(group, item) for item in {*variation.model_fields_set, "limits"}})
    if findings:
        raise MechanismError(findings)
    data = mechanism.data()
    for play, text in clearances.items():
        assign(data, numbers.entries[play].location, text, mechanism.coordinates)
        keep_limits(mechanism, play, text, data)
    for location, text in texts:
        holder, last = _holder(data, location)
        holder[last] = text
    if entries:
        plain = {key: item.model_dump(mode="json", exclude_unset=True) for key, item in entries.items()}
        data["tolerances"] = {**data.get("tolerances", {}), **plain}
    return data


def keep_limits(mechanism: Numbers, name: str, value: Any, data: dict[str, Any]) -> None:
    """Write the limits that stood with a number, as in `40 mm ± 0.02 mm`, into `tolerances` where it is replaced by one
    without: another nominal value is no other tolerance.
    """
    numbers = mechanism.parameter_set
    entry = next(
        (candidate for candidate in (numbers.entries.get(path) for path in _paths(numbers, name)) if candidate), None
    )
    if entry is None or entry.quantity.tolerance is None or not may_vary(entry):
        return
    if entry.alias and not entry.alias.startswith(DEFAULTS):
        return
    try:
        if Quantity.read(value, entry.kind).tolerance is not None:
            return
    except UnitError:  # a finding of its own
        return
    lower, upper = entry.quantity.tolerance
    section = data.setdefault("tolerances", {})
    previous = variations(mechanism, numbers).get(entry.path, ("", Variation()))
    key = previous[0] or entry.path
    kind = measured(mechanism, numbers.entries.values())[entry.path]
    text = limits_text((lower + upper) / 2, (upper - lower) / 2, kind, DIGITS)
    if previous[1].limits is None:
        own = section.get(key, {})
        section[key] = {**(own if isinstance(own, dict) else {}), "limits": text}


def _paths(numbers: ParameterSet, name: str) -> list[str]:
    try:
        return [numbers.resolve(name)]
    except MechanismError:
        return []


def _half(text: float | str, kind: Kind, name: str, findings: list[Finding]) -> float:
    """A half width in SI; 0 and a finding if it is none."""
    try:
        return half_width(text, kind, name)
    except MechanismError as error:
        findings += error.findings
        return 0.0


def _in_place(mechanism: Numbers, entry: Entry, half: float, digits: int) -> tuple[Location, str] | None:
    """Where the text of a number that carries its own limits stands, and the text with others; None if it has none."""
    if entry.alias or not entry.quantity.tolerance:
        return None
    try:
        holder, last = _holder(mechanism.data(), entry.location)
        there = holder[last]
    except (KeyError, IndexError, TypeError):
        return None
    text = number_with(entry.quantity, half, digits) if there == entry.quantity.source else None
    return None if text is None else (entry.location, text)


def _holder(data: dict[str, Any], location: Location) -> tuple[Any, Any]:
    """The group or list in which an entry of plain data stands, and its key there; short forms are looked through."""
    holder: Any = data
    for key, following in pairwise(location):
        if isinstance(holder[key], str):  # a coefficient of friction by itself
            return holder, key
        if following == "at" and isinstance(holder[key], list):  # a point that is nothing but its place
            return holder[key], location[-1]
        holder = holder[key]
    return holder, location[-1]


# ---- numbers that are no more ---------------------------------------------------------------------------------


def kept(mechanism: Numbers, data: Mapping[str, Any]) -> dict[str, Any]:
    """Plain data made of that of a mechanism, without errors, tolerances and costs of numbers that it no longer has.

    So a mechanism without friction has no tolerance of a coefficient. MechanismError if the data make no mechanism.
    """
    named = [key for key in ("errors", "tolerances", "costs") if data.get(key)]
    if not named:
        return dict(data)
    bare = {key: value for key, value in data.items() if key not in (*named, "correlations", "processes")}
    other = type(mechanism)(**bare)

    def known(name: str) -> bool:
        try:
            return bool(clearance_of(other, name) or other.parameter_set.resolve(name.removeprefix("errors.")))
        except MechanismError:
            return False

    rest = {key: {name: item for name, item in data[key].items() if known(name)} for key in named}
    rows = [{**row, "of": [name for name in row["of"] if known(name)]} for row in data.get("correlations", ())]
    together = [
        row
        for row, correlation_row in zip(rows, data.get("correlations", ()), strict=True)
        if row["of"] == correlation_row["of"] or len(row["of"]) > 1
    ]
    return {**data, **rest, **({"correlations": together} if rows else {})}


def with_samples(mechanism: Numbers, name: str, path: str | os.PathLike[str]) -> dict[str, Any]:
    """Plain data of the mechanism with a number that varies as the deviations in a file; limits stated are kept."""
    numbers = mechanism.parameter_set
    target = numbers.resolve(name)
    if target not in numbers.entries:
        raise MechanismError(Finding(f"the model states no '{target}'", "--sample", "state it, then its deviations"))
    deviations = column(Path(path), measured(mechanism, numbers.entries.values())[target])
    key, variation = variations(mechanism, numbers).get(target, (target, None))
    data = mechanism.data()
    limits_kept = {} if variation is None or variation.limits is None else {"limits": variation.limits.source}
    own_key = key if numbers.resolve(key) == target else target
    entry = {**limits_kept, "distribution": "sample", "values": deviations}
    data["tolerances"] = {**data.get("tolerances", {}), own_key: entry}
    return data


FORMULA = ("A", "B", "k")


@dataclass(frozen=True)
class ProcessChoice:
    """One way to make a dimension: its name (an IT grade as `IT7`), the half width that it keeps, SI, and its cost."""

    name: str
    tolerance: float
    cost: float


@dataclass(frozen=True)
class Price:
    """What the tolerance of one number costs, or the play of one joint.

    path: of the number, or `joints.B.clearance` of a play (`play` says so); model: a cost model, or empty where there
    are choices; parameters: A, B, k and unit, the half width that counts as 1, SI; least, most: bounds, SI; group:
    name of those that have one half width; choices: from the cheapest on.
    """

    path: str
    play: bool = False
    model: str = ""
    parameters: Mapping[str, float] = field(default_factory=dict)
    least: float = 0.0
    most: float = np.inf
    group: str = ""
    choices: tuple[ProcessChoice, ...] = ()


def prices(mechanism: Numbers) -> list[Price]:
    """Every cost with its numbers, in the order of the file; what `joint_defaults` states is a price of each joint.

    What varies as measured or over a full turn has no tolerance to choose, and no price.
    """
    if not mechanism.costs:
        return []
    fixed = {tolerance.path for tolerance in tolerated(mechanism) if not tolerance.can_be_chosen}
    paths = [(path, cost) for name, cost in mechanism.costs.items() for path in cost_paths(mechanism, name)]
    return [price(mechanism, path, cost) for path, cost in paths if path not in fixed]


def cost_paths(mechanism: Numbers, name: str, numbers: ParameterSet | None = None) -> list[str]:
    """The paths that a name in `costs` means: those of numbers, or `joints.B.clearance`; none if it means nothing.

    numbers: those of the mechanism, where some of it could not be read.
    """
    numbers = numbers or mechanism.parameter_set
    clearance = clearance_of(mechanism, name, numbers)
    if clearance:
        return [f"joints.{clearance.split('.')[1]}.clearance"]
    return named_paths(numbers, [name])


def price(mechanism: Numbers, path: str, cost: Cost, numbers: ParameterSet | None = None) -> Price:
    """The numbers of a cost; nan where one cannot be known, which is a finding of its own."""
    numbers = numbers or mechanism.parameter_set
    names = numbers.dimension_values
    parameters = {key: _number(getattr(cost, key), names) for key in FORMULA if getattr(cost, key) is not None}
    if cost.model:
        parameters = {"A": 0.0, **parameters, "unit": _unit(cost.unit)}
    return Price(
        path,
        path not in numbers.entries,
        cost.model or "",
        parameters,
        0.0 if cost.least is None else _number(cost.least, names),
        np.inf if cost.most is None else _number(cost.most, names),
        cost.group or "",
        tuple(sorted(_choices(mechanism, path, cost, numbers), key=lambda choice: (choice.cost, choice.tolerance))),
    )


def _choices(mechanism: Numbers, path: str, cost: Cost, numbers: ParameterSet) -> list[ProcessChoice]:
    names = numbers.dimension_values
    if cost.options is not None:
        return [
            ProcessChoice(name, _number(offer.tolerance, names), _number(offer.cost, names))
            for name, offer in cost.options.items()
        ]
    if cost.process is None or cost.process not in mechanism.processes:
        return []
    size = float(numbers.nominal.get(path, np.nan))
    choices = []
    for grade, offer in mechanism.processes[cost.process].items():
        try:
            half = standard_tolerance(abs(size), int(grade)) / 2
        except MechanismError:  # a finding of its own
            half = np.nan
        choices.append(ProcessChoice(f"IT{grade}", half, _number(offer, names)))
    return choices


def _unit(text: str | None) -> float:
    try:
        return float(unit(text)[0]) if text else 1.0
    except UnitError:  # a finding of its own
        return np.nan


def cost_entries(mechanism: Numbers, names: ParameterNames, kinds: Mapping[str, Kind]) -> list[Entry]:
    """Every quantity of costs and processes, with where it stands and what it has to measure."""
    listed: list[Entry] = []

    def add(quantity: Quantity | None, where: str, kind: Kind) -> None:
        if quantity is not None:
            listed.append(Entry(where, tuple(where.split(".")), quantity, kind))

    for name, cost in mechanism.costs.items():
        where = f"costs.{name}"
        try:
            kind = kinds[names.resolve(name)]
        except MechanismError:  # a play, or a finding of its own
            kind = KINDS["length"]
        for key in FORMULA:
            add(getattr(cost, key), f"{where}.{key}", KINDS["number"])
        for key in ("least", "most"):
            add(getattr(cost, key), f"{where}.{key}", kind)
        for option, offer in (cost.options or {}).items():
            add(offer.tolerance, f"{where}.options.{option}.tolerance", kind)
            add(offer.cost, f"{where}.options.{option}.cost", KINDS["number"])
    for process, grades in mechanism.processes.items():
        for grade, paid in grades.items():
            add(paid, f"processes.{process}.{grade}", KINDS["number"])
    return listed
