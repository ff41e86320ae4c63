"""What tolerances and plays cost: the section `costs` in numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from trunnion.algebra.namespace import Number
from trunnion.errors import MechanismError
from trunnion.joints.fits import standard_tolerance
from trunnion.model.names import ParameterNames
from trunnion.model.parameters import Entry, ParameterSet
from trunnion.model.quantity import Quantity
from trunnion.model.tolerance_parts import Cost
from trunnion.model.tolerances import clearance_of, named_paths, tolerated
from trunnion.model.units import KINDS, Kind, UnitError, unit

if TYPE_CHECKING:
    from trunnion.model.numbers import Numbers

__all__ = ["Price", "ProcessChoice", "cost_entries", "cost_paths", "prices"]

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
    fixed = {one.path for one in tolerated(mechanism) if not one.can_be_chosen}
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
        tuple(sorted(_choices(mechanism, path, cost, numbers), key=lambda one: (one.cost, one.tolerance))),
    )


def _choices(mechanism: Numbers, path: str, cost: Cost, numbers: ParameterSet) -> list[ProcessChoice]:
    names = numbers.dimension_values
    if cost.options is not None:
        return [
            ProcessChoice(name, _number(one.tolerance, names), _number(one.cost, names))
            for name, one in cost.options.items()
        ]
    if cost.process is None or cost.process not in mechanism.processes:
        return []
    size = float(numbers.nominal.get(path, np.nan))
    found = []
    for grade, one in mechanism.processes[cost.process].items():
        try:
            half = standard_tolerance(abs(size), int(grade)) / 2
        except MechanismError:  # a finding of its own
            half = np.nan
        found.append(ProcessChoice(f"IT{grade}", half, _number(one, names)))
    return found


def _unit(text: str | None) -> float:
    try:
        return float(unit(text)[0]) if text else 1.0
    except UnitError:  # a finding of its own
        return np.nan


def _number(quantity: Quantity, names: Mapping[str, Number]) -> float:
    return float(quantity.evaluate(names)) if set(quantity.names) <= names.keys() else np.nan


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
        for option, one in (cost.options or {}).items():
            add(one.tolerance, f"{where}.options.{option}.tolerance", kind)
            add(one.cost, f"{where}.options.{option}.cost", KINDS["number"])
    for process, grades in mechanism.processes.items():
        for grade, paid in grades.items():
            add(paid, f"processes.{process}.{grade}", KINDS["number"])
    return listed
