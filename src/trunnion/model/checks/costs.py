"""Checks of costs: what they name has a tolerance, and each says in one way what it costs."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from trunnion.errors import Finding, MechanismError, Severity
from trunnion.joints.fits import standard_tolerance
from trunnion.model.contact import has_play
from trunnion.model.cost_parts import COST_MODELS, Cost
from trunnion.model.names import as_key
from trunnion.model.parameters import ParameterSet, measured
from trunnion.model.prices import FORMULA, Price, cost_paths, price
from trunnion.model.tolerances import tolerated
from trunnion.model.units import KINDS, Kind, UnitError, dimension_text, unit

if TYPE_CHECKING:
    from trunnion.model.numbers import Numbers

__all__ = ["cost_names", "cost_values"]

WAYS = ("model", "process", "options")


def cost_names(mechanism: Numbers) -> Iterator[Finding]:
    """Whether each cost is stated in one way, with what that needs."""
    for name, cost in mechanism.costs.items():
        where = f"costs.{name}"
        ways = [key for key in WAYS if getattr(cost, key) is not None]
        if len(ways) != 1:
            what = f"states {' and '.join(ways) or 'no cost'}"
            remedy = "state one of model: power with B and k, process: … or options: {…}"
            yield Finding(what, where, remedy)
            continue
        if cost.model is not None:
            for key in ("B", "k"):
                if getattr(cost, key) is None:
                    yield Finding(f"'{key}' is missing", where, f"add {key}: …, as in {FORMS[cost.model]}")
        else:
            for key in (*FORMULA, "unit", "least", "most"):
                if getattr(cost, key) is not None:
                    what = f"'{key}' has no effect on a choice"
                    yield Finding(what, f"{where}.{key}", f"remove it, or state model: {' or '.join(COST_MODELS)}")


FORMS = {"power": "A + B/(t/unit)^k", "exponential": "A + B exp(-k t/unit)"}


def cost_values(mechanism: Numbers, numbers: ParameterSet) -> Iterator[Finding]:
    """Whether each cost is of a tolerance or of a play, and its numbers make sense; nan passes every check."""
    if not mechanism.costs:
        return
    kinds = measured(mechanism, numbers.entries.values())
    known = {one.path: one for one in tolerated(mechanism, numbers)}
    first: dict[str, str] = {}
    for name, cost in mechanism.costs.items():
        where = f"costs.{name}"
        paths = cost_paths(mechanism, name, numbers)
        if not paths:
            yield _unknown(mechanism, name, where, numbers)
        for path in paths:
            play = path not in numbers.entries
            if path in first:
                yield Finding(f"'{name}' and '{first[path]}' are the same", where, "keep one of them")
            first.setdefault(path, name)
            if play:
                yield from _play(mechanism, path, where)
            elif path not in known:
                yield _untolerated(path, where)
            elif not known[path].can_be_chosen:
                what = f"'{path}' varies as measured or over a full turn: there is no tolerance to choose"
                yield Finding(what, where, "remove the cost", Severity.WARNING)
            kind = KINDS["length"] if play else kinds[path]
            yield from _formula(cost, where, kind)
            yield from _price(price(mechanism, path, cost, numbers), where)
            yield from _process(mechanism, cost, path, where, kind, numbers)
    yield from _groups(mechanism)


def _unknown(mechanism: Numbers, name: str, where: str, numbers: ParameterSet) -> Finding:
    joint = mechanism.effective_joints.get(name.removeprefix("joints.").removesuffix(".clearance"))
    if name.endswith(".clearance") and joint is not None:
        if joint.pin is not None and (joint.pin.fit is not None or joint.pin.hole_radius is not None):
            source = f"the fit {joint.pin.fit.source}" if joint.pin.fit is not None else "the radii of pin and hole"
            what = f"'{name}' cannot have a cost: its play is derived from {source}"
            remedy = "state pin.clearance instead, or remove the cost: the play stays as stated"
            return Finding(what, where, remedy)
        what = f"the joint of '{name}' states no clearance"
        return Finding(what, where, "state pin: {clearance: 0.02 mm}, or of a guide guide: {clearance: 0.02 mm}")
    try:
        numbers.resolve(name)
    except MechanismError as error:
        return Finding(error.findings[0].what, where, error.findings[0].remedy)
    return Finding(f"no joint follows '{name}'", where, "name the number of a joint, as B.pin.clearance")


def _untolerated(path: str, where: str) -> Finding:
    remedy = f"state one as a start, tolerances: {{{as_key(path)}: ±0.05 mm}}"
    parts = path.split(".")
    if parts[0] == "joints" and parts[-1] == "clearance":
        remedy += f"; the play itself is {parts[0]}.{parts[1]}.clearance"
    return Finding(f"'{path}' has no tolerance", where, remedy)


def _play(mechanism: Numbers, path: str, where: str) -> Iterator[Finding]:
    """A play that can be chosen is that of a joint whose play is modelled."""
    name = path.split(".")[1]
    joint = mechanism.effective_joints[name]
    if not has_play(joint):
        yield Finding(f"the play of a {joint.type} joint is not modelled", where, "remove it")


def _formula(cost: Cost, where: str, kind: Kind) -> Iterator[Finding]:
    """The unit of a formula."""
    if cost.unit is None:
        return
    try:
        dimension = unit(cost.unit)[1]
    except UnitError as error:
        yield Finding(error.what, f"{where}.unit", error.remedy)
        return
    if not kind.accepts(dimension):
        what = f"'{cost.unit}' is the unit of {dimension_text(dimension)}, the tolerance is of {kind.name}"
        yield Finding(what, f"{where}.unit", f"write a unit of {kind.name}, such as that of {kind.example}")


def _price(found: Price, where: str) -> Iterator[Finding]:
    for key, above in (("B", False), ("k", True)):
        value = found.parameters.get(key, 1.0)
        if value < 0 or (above and value == 0):
            limit = "above 0" if above else "at least 0"
            yield Finding(
                f"is {value:g}: a wider tolerance would cost more", f"{where}.{key}", f"give a number {limit}"
            )
    if found.least < 0 or found.most <= 0:
        key = "least" if found.least < 0 else "most"
        yield Finding("a half width is not negative, nor its bound 0", f"{where}.{key}", "give a number above 0")
    elif found.least > found.most:
        what = f"the least half width {found.least:g} is above the most {found.most:g} (SI)"
        yield Finding(what, f"{where}.least", "exchange them")
    for one in found.choices:
        if one.tolerance <= 0:
            what = f"'{one.name}' has a tolerance of {one.tolerance:g} (SI)"
            yield Finding(what, f"{where}.options.{one.name}.tolerance", "give a half width above 0")


def _process(
    mechanism: Numbers, cost: Cost, path: str, where: str, kind: Kind, numbers: ParameterSet
) -> Iterator[Finding]:
    """Whether a process has its grades at the size of a number."""
    if cost.process is None or cost.process not in mechanism.processes:
        return
    if path not in numbers.entries:
        yield Finding("a play has no IT grade", f"{where}.process", "state options: {…} or a model")
        return
    if kind.dimensions and kind is not KINDS["length"]:
        yield Finding(f"IT grades are of lengths, this is of {kind.name}", f"{where}.process", "state options: {…}")
        return
    size = abs(float(numbers.nominal[path]))
    if np.isnan(size):
        return
    for grade in mechanism.processes[cost.process]:
        try:
            standard_tolerance(size, int(grade))
        except MechanismError as error:
            yield Finding(error.findings[0].what, f"{where}.process", "state options: {…} or a model instead")
            return


def _groups(mechanism: Numbers) -> Iterator[Finding]:
    """The members of a group have one half width: each is priced by a formula, or all by the same choices."""
    members: dict[str, list[tuple[str, Cost]]] = {}
    for name, cost in mechanism.costs.items():
        if cost.group:
            members.setdefault(cost.group, []).append((name, cost))
    for group, costs in members.items():
        if len({cost.model is not None for _, cost in costs}) > 1:
            names = ", ".join(name for name, _ in costs)
            what = f"the group '{group}' ({names}) has formulas and choices"
            yield Finding(what, f"costs.{costs[0][0]}.group", "state the same for all, or two groups")
