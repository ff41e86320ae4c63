"""Checks of tolerances, correlations and costs: what they name, what their distributions take, whether they agree."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np

from trunnion.errors import Finding, MechanismError, Severity
from trunnion.joints.fits import standard_tolerance
from trunnion.model.joint_parts import has_play
from trunnion.model.names import ParameterNames, as_key
from trunnion.model.parameters import Entry, Numbers, ParameterSet, measured
from trunnion.model.quantity import Quantity
from trunnion.model.rules import stray
from trunnion.model.tolerance_parts import COST_MODELS, DISTRIBUTIONS, OPTIONS, Cost, Variation
from trunnion.model.tolerances import (
    DEFAULTS,
    FORMULA,
    FULL_TURN,
    Price,
    Tolerance,
    correlation,
    cost_entries,
    cost_paths,
    ends_motion,
    may_vary,
    named_paths,
    price,
    tolerated,
    towards,
    variations,
    written_limits,
)
from trunnion.model.units import KINDS, Kind, UnitError, dimension_text, unit

__all__ = [
    "cost_names",
    "cost_values",
    "end_of_motion",
    "stated_entries",
    "tolerance_names",
    "tolerance_values",
]

NUMBER = KINDS["number"]
ROUNDING = 1e-9  # of an eigenvalue, and of limits that touch zero


# ---- quantities, for the checks of units ----------------------------------------------------------------------


def stated_entries(mechanism: Numbers, entries: Sequence[Entry]) -> list[Entry]:
    """Every quantity of the sections about tolerances and costs, with where it stands and what it has to measure.

    entries: the numbers of the mechanism.
    """
    if not (mechanism.variations or mechanism.costs or mechanism.correlations or mechanism.processes):
        return _defaults(mechanism)
    names, kinds = ParameterNames(entry.path for entry in entries), measured(mechanism, entries)
    listed = _defaults(mechanism)
    for name, variation in mechanism.variations.items():
        try:
            kind = kinds[names.resolve(name)]
        except MechanismError:  # a finding of its own
            continue
        listed += _variation(variation, f"tolerances.{name}", ("tolerances", name), kind)
    for row, pair in enumerate(mechanism.correlations):
        listed += _entries(pair.coefficient, f"correlations.{row}.coefficient", ("correlations", row), NUMBER)
    return [*listed, *cost_entries(mechanism, names, kinds)]


def _defaults(mechanism: Numbers) -> list[Entry]:
    section = "tolerance_defaults"
    options = {key: getattr(mechanism.tolerance_defaults, key, None) for key in OPTIONS}
    return [
        entry for key, value in options.items() for entry in _entries(value, f"{section}.{key}", (section, key), NUMBER)
    ]


def _variation(variation: Variation, where: str, location: tuple[str | int, ...], kind: Kind) -> list[Entry]:
    listed: list[Entry] = []
    if variation.limits is not None:
        for limit in (variation.limits.lower, variation.limits.upper):
            listed += _entries(limit, where, location, kind)
    for key in OPTIONS:
        own_kind = key in ("shift", "mode", "values")
        listed += _entries(getattr(variation, key), f"{where}.{key}", (*location, key), kind if own_kind else NUMBER)
    return listed


def _entries(value: Any, where: str, location: tuple[str | int, ...], kind: Kind) -> list[Entry]:
    """Entries of a quantity, or of each of several."""
    if isinstance(value, Quantity):
        return [Entry(where, location, value, kind)]
    items = value if isinstance(value, tuple) else ()
    return [Entry(f"{where}.{place}", (*location, place), quantity, kind) for place, quantity in enumerate(items)]


# ---- names ----------------------------------------------------------------------------------------------------


def tolerance_names(mechanism: Numbers, entries: Sequence[Entry]) -> Iterator[Finding]:
    """Whether each name is of a number that can vary, once, and each distribution gets what it takes."""
    names = ParameterNames(entry.path for entry in entries)
    by_path, kinds = {entry.path: entry for entry in entries}, measured(mechanism, entries)
    used = {name for entry in entries for name in entry.quantity.names}
    first: dict[str, str] = {}
    for name, variation in mechanism.variations.items():
        where = f"tolerances.{name}"
        yield from _shape(mechanism, variation, where)
        try:
            path = names.resolve(name)
        except MechanismError as error:
            yield Finding(error.findings[0].what, where, error.findings[0].remedy)
            continue
        if path in first:
            yield Finding(f"'{name}' and '{first[path]}' are the same number", where, "keep one of them")
        first.setdefault(path, name)
        yield from _number(by_path, path, used, where)
        yield from _percent(variation, by_path[path], kinds[path], where)
    yield from _default_distribution(mechanism)
    for row, pair in enumerate(mechanism.correlations):
        for place, name in enumerate(pair.of):
            try:
                names.resolve(name)
            except MechanismError as error:
                at = f"correlations.{row}.of.{place}"
                yield Finding(error.findings[0].what, at, error.findings[0].remedy)


def _number(entries: Mapping[str, Entry], path: str, used: set[str], where: str) -> Iterator[Finding]:
    """Whether a number is one that can vary and that something depends on."""
    entry = entries[path]
    if entry.varies:
        what = f"'{path}' varies with the motion and has no one tolerance"
        yield Finding(what, where, "state one of a dimension in it")
    elif ends_motion(path):
        yield end_of_motion(path, where)
    elif not may_vary(entry):
        what = f"'{path}' is not a parameter of the mechanism"
        yield Finding(what, where, "state tolerances of dimensions, joints, links, loads, springs or drivers")
    elif path.startswith(DEFAULTS) and not any(follower.alias == path for follower in entries.values()):
        yield Finding(f"no joint follows '{path}'", where, "name the number of a joint, as B.pin.clearance")
    elif path.startswith("dimensions.") and path.partition(".")[2] not in used:
        yield Finding(f"no result depends on '{path}'", where, "use it, or remove it", Severity.WARNING)


def end_of_motion(path: str, where: str) -> Finding:
    """The finding about a tolerance of where a driver begins or ends."""
    what = f"'{path}' does not vary, for samples are compared at the same coordinates of the driver"
    return Finding(what, where, "put the deviation into the driven link")


def _percent(variation: Variation, entry: Entry, kind: Kind, where: str) -> Iterator[Finding]:
    """Limits in percent of a number that is not stated so: of the number is meant, one hundredth would be taken."""
    limits = "" if variation.limits is None else str(variation.limits.source)
    if "%" not in limits or "%" in str(entry.quantity.source) or NUMBER.dimensions[0] not in (kind.dimensions or ()):
        return
    remedy = "write the deviation itself"
    if variation.limits is not None and not {*variation.limits.upper.names, *entry.quantity.names}:
        share = float(variation.limits.upper.evaluate()) * abs(float(entry.quantity.evaluate()))
        remedy += f": {share:.4g}, if percent of {entry.quantity.source} is meant"
    yield Finding(f"the limits '{limits}' are in percent, the number is not", where, remedy)


def _shape(mechanism: Numbers, variation: Variation, where: str) -> Iterator[Finding]:
    """Whether the keys of an entry are those of its distribution."""
    name = variation.distribution or mechanism.tolerance_defaults.distribution
    keys = [key for key in OPTIONS if getattr(variation, key) is not None]
    yield from stray(keys, DISTRIBUTIONS, "distribution", name, "distribution", where)
    if name == "sample" and variation.values is None:
        yield Finding(
            "the measured deviations are missing", where, "add values: [0.01 mm, …], or give them by --sample"
        )
    if name == FULL_TURN and variation.limits is not None:
        yield Finding("a direction over the whole turn has no limits", where, "remove them, or state uniform")


def _default_distribution(mechanism: Numbers) -> Iterator[Finding]:
    defaults, where = mechanism.tolerance_defaults, "tolerance_defaults"
    if defaults.distribution in ("sample", FULL_TURN):
        what = f"the distribution {defaults.distribution} is of one number, not of all"
        yield Finding(what, f"{where}.distribution", "state it in tolerances: {…}")
    keys = [key for key in OPTIONS if getattr(defaults, key, None) is not None]
    yield from stray(keys, DISTRIBUTIONS, "distribution", defaults.distribution, "distribution", where)


# ---- numbers --------------------------------------------------------------------------------------------------


def tolerance_values(mechanism: Numbers, numbers: ParameterSet) -> Iterator[Finding]:
    """Findings about limits, distributions and correlations as numbers; nan is reported already and passes."""
    by_path, written = variations(mechanism, numbers), written_limits(numbers)
    for tolerance in tolerated(mechanism, numbers):
        name, variation = by_path.get(tolerance.path, ("", Variation()))
        where = f"tolerances.{name}" if name else tolerance.path
        yield from _limits(numbers, tolerance, variation, written.get(tolerance.path), where)
        places = {key: where if getattr(variation, key) is not None else "tolerance_defaults" for key in OPTIONS}
        yield from _options(tolerance, {key: f"{place}.{key}" for key, place in places.items()})
    if mechanism.correlations:
        yield from _correlations(mechanism, numbers)


def _limits(
    numbers: ParameterSet,
    tolerance: Tolerance,
    variation: Variation,
    written: tuple[float, float] | None,
    where: str,
) -> Iterator[Finding]:
    path, lower, upper = tolerance.path, tolerance.lower, tolerance.upper
    with np.errstate(all="ignore"):
        if not np.isfinite(np.var(np.atleast_1d(tolerance.options.get("values", 0.0)))):
            yield Finding(f"the deviations of '{path}' have no finite variance", where, "remove the outliers")
    unstated = variation.limits is None and written is None
    if unstated and not {"values"} & tolerance.options.keys() and tolerance.distribution != FULL_TURN:
        remedy = "add limits: ±0.05 mm, or write them with the value, as 60 mm ± 0.05 mm"
        yield Finding(f"the limits of '{path}' are missing", where, remedy)
    if lower > upper:
        what = f"the lower limit {lower:g} is above the upper one {upper:g} (SI)"
        yield Finding(what, where, "write ± before a number that is not negative")
    if written is not None and variation.limits is not None and not np.allclose(written, (lower, upper), rtol=1e-9):
        what = f"these limits override those stated with '{path}', {written[0]:g} to {written[1]:g} (SI)"
        yield Finding(what, where, "state them once", Severity.NOTE)
    if variation.direction:
        if not towards(path, numbers):
            what = f"'{path}' has no direction: the tilt and the offset of a misaligned axis have"
            yield Finding(what, f"{where}.direction", "remove it; for an angle state {distribution: direction}")
        elif tolerance.nominal + lower < -ROUNDING * tolerance.half_width:
            what = f"is the size of a run-out, from {tolerance.nominal + lower:g} on (SI): a size is not negative"
            yield Finding(what, where, "write +0.02/0 mm")
    kind = numbers.entries[path].kind
    if tolerance.distribution == FULL_TURN and kind.dimensions and kind is not KINDS["angle"]:
        yield Finding(f"'{path}' is no angle", where, "only an angle is uniform over all directions")


def _options(tolerance: Tolerance, where: Mapping[str, str]) -> Iterator[Finding]:
    """Whether what a distribution was told makes one. where: each option stands."""
    options: dict[str, Any] = dict(tolerance.options)
    cp, cpk, mode = options.get("cp", 1.0), options.get("cpk"), options.get("mode")
    for key in ("cp", "alpha", "beta"):
        if options.get(key, 1.0) <= 0:
            yield Finding(f"{key} is {options[key]:g}", where[key], "give a number above 0")
    if cpk is not None and cpk > cp * (1 + ROUNDING):
        what = f"cpk {cpk:g} is above cp {cp:g}: the share of the limits cannot be larger off the middle than in it"
        yield Finding(what, where["cpk"], "give a cpk of at most cp")
    if mode is not None and not tolerance.lower <= mode <= tolerance.upper:
        what = f"the mode {mode:g} is outside the limits {tolerance.lower:g} to {tolerance.upper:g} (SI)"
        if not np.isnan(tolerance.half_width + mode):
            yield Finding(what, where["mode"], "give the deviation at which the density peaks")
    shift = options.get("shift", 0.0)
    if abs(shift) > tolerance.half_width:
        what = f"the shift {shift:g} puts the mean outside the limits, {tolerance.half_width:g} from their middle (SI)"
        yield Finding(what, where["shift"], "check its unit", Severity.WARNING)


def _correlations(mechanism: Numbers, numbers: ParameterSet) -> Iterator[Finding]:
    vary = {item.path for item in tolerated(mechanism, numbers)}
    first: dict[frozenset[str], int] = {}
    sound = True
    for row, item in enumerate(mechanism.correlations):
        where = f"correlations.{row}"
        evaluable = set(item.coefficient.names) <= numbers.dimension_values.keys()
        value = float(item.coefficient.evaluate(numbers.dimension_values)) if evaluable else np.nan
        paths = named_paths(numbers, item.of)
        if abs(value) > 1:
            sound = False
            yield Finding(f"is {value:g}", f"{where}.coefficient", "give a number from -1 to 1")
        for name in (name for name in item.of if not vary.issuperset(named_paths(numbers, [name]))):
            sound = False
            yield Finding(f"'{name}' has no tolerance", where, "state one in tolerances: {…}, or leave it out")
        if len(paths) < 2 and len(item.of) < 2:
            yield Finding("a correlation needs two parameters", where, "name two, as of: [AB, BC]")
        for pair in map(frozenset, combinations(paths, 2)):
            if len(pair) < 2:
                yield Finding(f"'{next(iter(pair))}' is named twice", where, "name two numbers")
            elif pair in first:
                what = f"the correlation of {_both(pair)} is given in entry {first[pair] + 1} already"
                yield Finding(what, where, "keep one of them")
            first.setdefault(pair, row)
    if not sound:
        return
    matrix = correlation(mechanism, numbers)
    if matrix.size and not np.isnan(matrix).any() and (least := float(np.linalg.eigvalsh(matrix)[0])) < -ROUNDING:
        what = (
            f"these correlations contradict one another: the least eigenvalue of their matrix is {least:.3g}, below 0"
        )
        yield Finding(what, "correlations", "the correlation matrix is not positive definite: reduce the coefficients")


def _both(pair: frozenset[str]) -> str:
    return " and ".join(f"'{path}'" for path in sorted(pair))


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
    tolerances = {tolerance.path: tolerance for tolerance in tolerated(mechanism, numbers)}
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
            elif path not in tolerances:
                yield _untolerated(path, where)
            elif not tolerances[path].can_be_chosen:
                what = f"'{path}' varies as measured or over a full turn: there is no tolerance to choose"
                yield Finding(what, where, "remove the cost", Severity.WARNING)
            kind = KINDS["length"] if play else kinds[path]
            if cost.model is not None and cost.unit is None and kind.name in ("length", "angle"):
                what = f"states no unit: B is what a half width of 1 unit costs, of this {kind.name}"
                yield Finding(what, where, f"write unit: {'mm' if kind.name == 'length' else 'deg'}")
            yield from _formula(cost, where, kind)
            yield from _price(price(mechanism, path, cost, numbers), where)
            yield from _process(mechanism, cost, path, where, kind, numbers)
    yield from _groups(mechanism, numbers)


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


def _price(price: Price, where: str) -> Iterator[Finding]:
    for key, above in (("B", False), ("k", True)):
        value = price.parameters.get(key, 1.0)
        if value < 0 or (above and value == 0):
            limit = "above 0" if above else "at least 0"
            yield Finding(
                f"is {value:g}: a wider tolerance would cost more", f"{where}.{key}", f"give a number {limit}"
            )
    if price.least < 0 or price.most <= 0:
        key = "least" if price.least < 0 else "most"
        yield Finding("a half width is not negative, nor its bound 0", f"{where}.{key}", "give a number above 0")
    elif price.least > price.most:
        what = f"the least half width {price.least:g} is above the most {price.most:g} (SI)"
        yield Finding(what, f"{where}.least", "exchange them")
    for choice in price.choices:
        if choice.tolerance <= 0:
            what = f"'{choice.name}' has a tolerance of {choice.tolerance:g} (SI)"
            yield Finding(what, f"{where}.options.{choice.name}.tolerance", "give a half width above 0")


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


def _groups(mechanism: Numbers, numbers: ParameterSet) -> Iterator[Finding]:
    """The members of a group have one half width: each is priced by a formula, or all by the same choices."""
    groups: dict[str, dict[str, list[Price]]] = {}
    for name, cost in mechanism.costs.items():
        if cost.group:
            paths = cost_paths(mechanism, name, numbers)
            groups.setdefault(cost.group, {})[name] = [price(mechanism, path, cost, numbers) for path in paths]
    for group, members in groups.items():
        where, of = f"costs.{next(iter(members))}.group", f"the group '{group}' ({', '.join(members)})"
        prices = [one for several in members.values() for one in several]
        choices = [{choice.name for choice in one.choices} for one in prices]
        if len({bool(mechanism.costs[name].model) for name in members}) > 1:
            yield Finding(f"{of} has formulas and choices", where, "state the same for all, or two groups")
        elif any(choices) and not set.intersection(*choices):
            yield Finding(f"{of} has no choice in common", where, "give its members the same choices")
        elif prices and max(one.least for one in prices) > min(one.most for one in prices):
            yield Finding(f"the bounds of {of} exclude one another", where, "widen them")
