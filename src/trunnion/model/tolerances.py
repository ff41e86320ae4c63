"""Which numbers of a mechanism vary, within which limits and how, and what that costs: `tolerances`, `costs` ….

A name is one that `--set` takes. One of `joint_defaults` means the number of each joint that has it; those vary
independently. A number that is stated with ± or by a fit varies too."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError
from trunnion.joints.fits import standard_tolerance
from trunnion.model.changes import assign, stated_at
from trunnion.model.csv_table import column
from trunnion.model.limits import DIGITS, half_width, limits_text, written
from trunnion.model.parameters import Entry, Numbers, measured, walk
from trunnion.model.quantity import Quantity
from trunnion.model.tolerance_parts import DISTRIBUTIONS, Cost, Variation
from trunnion.model.units import ANY, KINDS, UnitError, unit

__all__ = [
    "Price",
    "ProcessChoice",
    "Tolerance",
    "clearance_of",
    "correlation",
    "cost_paths",
    "ends_motion",
    "further_entries",
    "keep_limits",
    "kept",
    "may_vary",
    "named_paths",
    "price",
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
FORMULA = ("A", "B", "k")


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


# ---- what names mean ------------------------------------------------------------------------------------------


def may_vary(entry: Entry) -> bool:
    """Whether a number is one of the mechanism itself: not of its measures, nor of where it begins and ends."""
    outside = entry.path.partition(".")[0] in ("measures", "assembly")
    return not entry.varies and not outside and not ends_motion(entry.path)


def ends_motion(path: str) -> bool:
    """Whether a number says where a driver begins or ends: samples are compared at the same coordinates of it."""
    return path.startswith("drivers.") and path.split(".")[2:3] in (["start"], ["range"])


def named_paths(mechanism: Numbers, names: Iterable[str]) -> list[str]:
    """The paths that names mean, those of `joint_defaults` as the numbers of the joints; unknown ones left out."""
    numbers, paths = mechanism.parameter_set, list[str]()
    for name in names:
        with suppress(MechanismError):
            path = numbers.resolve(name)
            all_joints = [entry.path for entry in numbers.entries.values() if entry.alias == path]
            paths += all_joints if path.startswith(DEFAULTS) else [path]
    return paths


def clearance_of(mechanism: Numbers, name: str) -> str:
    """The path of the clearance that `joints.B.clearance` or `B.clearance` means, of pin or guide; empty if none.

    The play of a joint is meant, and not a tolerance of the number that states it, which is `joints.B.pin.clearance`.
    """
    joint = name.removeprefix("joints.").removesuffix(".clearance")
    paths = [f"joints.{joint}.{part}.clearance" for part in ("pin", "guide")] if name.endswith(".clearance") else []
    return next((path for path in paths if path in mechanism.parameter_set.entries), "")


def cost_paths(mechanism: Numbers, name: str) -> list[str]:
    """The paths that a name in `costs` means: those of numbers, or `joints.B.clearance`; none if it means nothing."""
    clearance = clearance_of(mechanism, name)
    return [f"joints.{clearance.split('.')[1]}.clearance"] if clearance else named_paths(mechanism, [name])


def towards(path: str, entries: Mapping[str, Entry]) -> str:
    """The angle of the direction in which a tilt or an offset of a misaligned axis points; empty for others."""
    before, _, key = path.rpartition(".misalignment.")
    angle = f"{before}.misalignment." + {"tilt": "towards", "offset": "offset_towards"}.get(key, "")
    return angle if angle in entries else ""


# ---- what varies ----------------------------------------------------------------------------------------------


def variations(mechanism: Numbers) -> dict[str, tuple[str, Variation]]:
    """Name and entry of `tolerances` by path; what is stated of a joint goes before what is stated of all."""
    numbers = mechanism.parameter_set
    single: dict[str, tuple[str, Variation]] = {}
    of_all: dict[str, tuple[str, Variation]] = {}
    for name, variation in mechanism.variations.items():
        for path in named_paths(mechanism, [name]):
            if may_vary(numbers.entries[path]):
                (single if numbers.resolve(name) == path else of_all).setdefault(path, (name, variation))
    return {**of_all, **single}


def written_limits(mechanism: Numbers) -> dict[str, tuple[float, float]]:
    """(lower, upper) signed deviations, SI, of every number that is stated with them, by path.

    Those in `joint_defaults` are of each joint that follows it.
    """
    return {
        path: entry.quantity.tolerance
        for path, entry in mechanism.parameter_set.entries.items()
        if entry.quantity.tolerance
        and not path.startswith(DEFAULTS)
        and (not entry.alias or entry.alias.startswith(DEFAULTS))
    }


def tolerated(mechanism: Numbers) -> list[Tolerance]:
    """Every number that varies, in the order of the parameters."""
    varied, limits_written = variations(mechanism), written_limits(mechanism)
    return [
        _tolerance(mechanism, entry, varied.get(path, ("", Variation()))[1], limits_written.get(path))
        for path, entry in mechanism.parameter_set.entries.items()
        if path in varied or (path in limits_written and may_vary(entry))
    ]


def _tolerance(
    mechanism: Numbers, entry: Entry, variation: Variation, limits_written: tuple[float, float] | None
) -> Tolerance:
    """Of a number, by its entry of `tolerances` and the limits that stand with the number itself.

    Defaults are for what the distribution takes and the entry does not say; a default cpk is that beside the default
    cp.
    """
    numbers, defaults = mechanism.parameter_set, mechanism.tolerance_defaults
    dimensions = numbers.dimension_values
    distribution = variation.distribution or defaults.distribution
    options: dict[str, float | tuple[float, ...]] = {}
    for key in DISTRIBUTIONS[distribution]:
        option = getattr(variation, key)
        if option is None and not (key == "cpk" and variation.cp is not None):
            option = getattr(defaults, key, None)
        if isinstance(option, tuple):
            options[key] = tuple(float(item.evaluate(dimensions)) for item in option)
        elif option is not None:
            options[key] = float(option.evaluate(dimensions))
    sample = options.get("values")
    if variation.limits is not None:
        ends = (variation.limits.lower, variation.limits.upper)
        lower, upper = (float(end.evaluate(dimensions)) for end in ends)
    elif limits_written is not None:
        lower, upper = limits_written
    elif isinstance(sample, tuple):
        lower, upper = min(sample), max(sample)
    else:
        lower, upper = (-np.pi, np.pi) if distribution == FULL_TURN else (np.nan, np.nan)
    direction = towards(entry.path, numbers.entries) if variation.direction else ""
    return Tolerance(entry.path, float(numbers.nominal[entry.path]), lower, upper, distribution, options, direction)


def correlation(mechanism: Numbers) -> NDArray[np.float64]:
    """The matrix of the correlations of all tolerated numbers, in the order of `tolerated`."""
    place = {tolerance.path: index for index, tolerance in enumerate(tolerated(mechanism))}
    matrix = np.eye(len(place))
    for pair in mechanism.correlations:
        paths = [path for path in named_paths(mechanism, pair.of) if path in place]
        value = float(pair.coefficient.evaluate(mechanism.parameter_set.dimension_values))
        for first, other in combinations(dict.fromkeys(paths), 2):
            matrix[place[first], place[other]] = matrix[place[other], place[first]] = value
    return matrix


def further_entries(mechanism: Numbers) -> list[Entry]:
    """Every quantity of the sections about tolerances and costs: what is no number of the mechanism itself.

    What may be any quantity measures what the number does that the entry is of, of a cost of a play a length.
    """
    kinds, listed = measured(mechanism, mechanism.entries), list[Entry]()
    for key in ("tolerance_defaults", "tolerances", "correlations", "costs", "processes"):
        section = getattr(mechanism, "variations" if key == "tolerances" else key)
        parts = section.items() if isinstance(section, Mapping) else [("", section)]
        for name, part in parts:
            kind = ANY
            if key in ("tolerances", "costs"):
                kind = KINDS["length"] if key == "costs" else ANY
                with suppress(MechanismError):  # a finding of its own
                    kind = kinds[mechanism.parameter_names.resolve(name)]
            for entry in walk(part, f"{key}.{name}".rstrip("."), (key, name) if name else (key,)):
                listed.append(replace(entry, kind=kind) if entry.kind is ANY else entry)
    return listed


# ---- what it costs --------------------------------------------------------------------------------------------


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


def price(mechanism: Numbers, path: str, cost: Cost) -> Price:
    """The numbers of a cost of a number or play; MechanismError where a process has no grade of its size."""
    numbers = mechanism.parameter_set

    def value(quantity: Quantity | None, absent: float = 0.0) -> float:
        return absent if quantity is None else float(quantity.evaluate(numbers.dimension_values))

    parameters = {key: value(getattr(cost, key)) for key in FORMULA if getattr(cost, key) is not None}
    if cost.model:
        parameters = {"A": 0.0, **parameters, "unit": float(unit(cost.unit)[0]) if cost.unit else 1.0}
    ways = cost.options or {}
    choices = [ProcessChoice(name, value(way.tolerance), value(way.cost)) for name, way in ways.items()]
    for grade, paid in mechanism.processes[cost.process].items() if cost.process else ():
        half = standard_tolerance(abs(float(numbers.nominal[path])), int(grade)) / 2
        choices.append(ProcessChoice(f"IT{grade}", half, value(paid)))
    return Price(
        path,
        path not in numbers.entries,
        cost.model or "",
        parameters,
        value(cost.least),
        value(cost.most, np.inf),
        cost.group or "",
        tuple(sorted(choices, key=lambda choice: (choice.cost, choice.tolerance))),
    )


# ---- other tolerances -----------------------------------------------------------------------------------------


def with_tolerances(mechanism: Numbers, half_widths: Mapping[str, float | str], digits: int = DIGITS) -> dict[str, Any]:
    """Plain data of the mechanism with other half widths of tolerances, and other clearances, SI or text, by name."""
    numbers, data = mechanism.parameter_set, mechanism.data()
    kinds, varied = measured(mechanism, numbers.entries.values()), variations(mechanism)
    tolerances = {item.path: item for item in tolerated(mechanism)}
    findings: list[Finding] = []
    for name, half_width_text in half_widths.items():
        play = clearance_of(mechanism, name)
        path = play or numbers.resolve(name)
        tolerance, kind = tolerances.get(path), KINDS["length"] if play else kinds[path]
        if not play and (tolerance is None or not tolerance.can_be_chosen):
            what = "has no tolerance" if tolerance is None else "varies as measured or over a full turn"
            findings.append(Finding(f"'{name}' {what}, none can be replaced", remedy="state limits in tolerances: {…}"))
            continue
        try:
            half = half_width(half_width_text, kind, name)
        except MechanismError as error:
            findings += error.findings
            continue
        if play or tolerance is None:
            text = written(half, kind, digits)
            assign(data, numbers.entries[play].location, text, mechanism.coordinates)
            keep_limits(mechanism, play, text, data)
            continue
        section, entry = data.setdefault("tolerances", {}), numbers.entries[path]
        key = varied.get(path, (path,))[0]
        others = section.get(key) if isinstance(section.get(key), dict) else {}
        text = limits_text((tolerance.lower + tolerance.upper) / 2, half, kind, digits)
        own_key = path if numbers.resolve(key).startswith(DEFAULTS) else key
        section[own_key] = {**others, "limits": text} if others.keys() - {"limits"} else text
        if entry.quantity.tolerance and stated_at(data, entry.location) == entry.quantity.source:
            assign(data, entry.location, entry.quantity.alone, mechanism.coordinates)  # its limits stand there now
    if findings:
        raise MechanismError(findings)
    return data


def keep_limits(mechanism: Numbers, name: str, value: Any, data: dict[str, Any]) -> None:
    """Write the limits that stood with a number, as in `40 mm ± 0.02 mm`, into `tolerances` where it is replaced by one
    without: another nominal value is no other tolerance.
    """
    try:
        entry = mechanism.parameter_set.entries[mechanism.parameter_set.resolve(name)]
        again = Quantity.read(value, entry.kind).tolerance is not None
    except (MechanismError, UnitError):  # no number, or a finding of its own
        return
    follows = entry.alias and not entry.alias.startswith(DEFAULTS)
    if again or entry.quantity.tolerance is None or follows or not may_vary(entry):
        return
    lower, upper = entry.quantity.tolerance
    section = data.setdefault("tolerances", {})
    key, variation = variations(mechanism).get(entry.path, (entry.path, Variation()))
    if variation.limits is None:
        kind = measured(mechanism, mechanism.entries)[entry.path]
        others = section.get(key) if isinstance(section.get(key), dict) else {}
        section[key] = {**others, "limits": limits_text((lower + upper) / 2, (upper - lower) / 2, kind)}


def kept(mechanism: Numbers, data: Mapping[str, Any]) -> dict[str, Any]:
    """Plain data made of that of a mechanism, without errors, tolerances and costs of numbers that it no longer has.

    So a mechanism without friction has no tolerance of a coefficient. MechanismError if the data make no mechanism.
    """
    named = [key for key in ("errors", "tolerances", "costs") if data.get(key)]
    if not named:
        return dict(data)
    bare = {key: value for key, value in data.items() if key not in (*named, "correlations", "processes")}
    other = type(mechanism)(**bare)

    def has(name: str) -> bool:
        with suppress(MechanismError):
            return bool(clearance_of(other, name) or other.parameter_set.resolve(name.removeprefix("errors.")))
        return False

    rest: dict[str, Any] = {key: {name: item for name, item in data[key].items() if has(name)} for key in named}
    if "correlations" in data:
        rows = [(row["of"], {**row, "of": [name for name in row["of"] if has(name)]}) for row in data["correlations"]]
        rest["correlations"] = [row for before, row in rows if row["of"] == before or len(row["of"]) > 1]
    return {**data, **rest}


def with_samples(mechanism: Numbers, name: str, path: str | os.PathLike[str]) -> dict[str, Any]:
    """Plain data of the mechanism with a number that varies as the deviations in a file; limits stated are kept."""
    numbers = mechanism.parameter_set
    target = numbers.resolve(name)
    deviations = column(Path(path), measured(mechanism, mechanism.entries)[target])
    key, variation = variations(mechanism).get(target, (target, Variation()))
    limits = {} if variation.limits is None else {"limits": variation.limits.source}
    data = mechanism.data()
    own_key = key if numbers.resolve(key) == target else target
    data.setdefault("tolerances", {})[own_key] = {**limits, "distribution": "sample", "values": deviations}
    return data
