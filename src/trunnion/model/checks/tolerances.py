"""Checks of tolerances, correlations and costs: what they name, what their distributions take, whether they agree."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np

from trunnion.errors import Finding, MechanismError, Severity
from trunnion.model.joint_parts import has_play
from trunnion.model.names import as_key
from trunnion.model.parameters import Entry, Numbers, measured
from trunnion.model.rules import limit_findings, stray
from trunnion.model.tolerance_parts import COST_MODELS, DISTRIBUTIONS, OPTIONS, Cost, Variation
from trunnion.model.tolerances import (
    DEFAULTS,
    FORMULA,
    FULL_TURN,
    Price,
    Tolerance,
    correlation,
    cost_paths,
    ends_motion,
    further_entries,
    may_vary,
    named_paths,
    price,
    tolerated,
    towards,
    variations,
    written_limits,
)
from trunnion.model.units import KINDS, Kind, UnitError, dimension_text, unit

__all__ = ["cost_values", "meant", "tolerance_names", "tolerance_values"]

NUMBER = KINDS["number"].dimensions[0]
ROUNDING = 1e-9  # of an eigenvalue, and of limits that touch zero
WAYS = ("model", "process", "options")
FORMS = {"power": "A + B/(t/unit)^k", "exponential": "A + B exp(-k t/unit)"}


# ---- names ----------------------------------------------------------------------------------------------------


def meant(mechanism: Numbers, section: str, names: Iterable[str]) -> tuple[dict[str, str], list[Finding]]:
    """The path of each name, and findings about names that mean no number, or the same one as another."""
    paths: dict[str, str] = {}
    findings: list[Finding] = []
    for name in names:
        where = f"{section}.{name}"
        try:
            path = mechanism.parameter_names.resolve(name)
        except MechanismError as error:
            findings.append(replace(error.findings[0], where=where))
            continue
        if path in paths.values():
            first = next(other for other, reached in paths.items() if reached == path)
            findings.append(Finding(f"'{name}' and '{first}' are the same number", where, "keep one of them"))
        paths[name] = path
    return paths, findings


def tolerance_names(mechanism: Numbers) -> Iterator[Finding]:
    """Whether each name is of a number that can vary, once, and distributions and costs get what they take."""
    entries = {entry.path: entry for entry in mechanism.entries}
    used = {name for entry in mechanism.entries for name in entry.quantity.names}
    followed = {entry.alias for entry in mechanism.entries}
    paths, findings = meant(mechanism, "tolerances", mechanism.variations)
    yield from findings
    for name, variation in mechanism.variations.items():
        where = f"tolerances.{name}"
        yield from _shape(mechanism, variation, where)
        if (path := paths.get(name, "")) and (reason := _unvaried(entries[path], followed)):
            yield Finding(reason, where, "state it of a dimension, or of a number of a link, joint, load or driver")
        elif path.startswith("dimensions.") and path.partition(".")[2] not in used:
            yield Finding(f"no result depends on '{path}'", where, "use it, or remove it", Severity.WARNING)
        if path:
            yield from _percent(mechanism, variation, entries[path], where)
    for row, pair in enumerate(mechanism.correlations):
        yield from meant(mechanism, f"correlations.{row}", dict.fromkeys(pair.of))[1]
    yield from _shape(mechanism, None, "tolerance_defaults")
    for name, cost in mechanism.costs.items():
        yield from _way(cost, f"costs.{name}")


def _unvaried(entry: Entry, followed: set[str]) -> str:
    """Why a number cannot have a tolerance; empty if it can."""
    if entry.varies:
        return f"'{entry.path}' varies with the motion and has no one tolerance"
    if ends_motion(entry.path):
        return f"'{entry.path}' does not vary: samples are compared at the same coordinates of the driver"
    if not may_vary(entry):
        return f"'{entry.path}' is not a parameter of the mechanism"
    unfollowed = entry.path.startswith(DEFAULTS) and entry.path not in followed
    return f"no joint follows '{entry.path}'" if unfollowed else ""


def _percent(mechanism: Numbers, variation: Variation, entry: Entry, where: str) -> Iterator[Finding]:
    """Limits in percent of a number that is not stated so: of the number is meant, one hundredth would be taken."""
    limits = "" if variation.limits is None else str(variation.limits.source)
    kind = measured(mechanism, [entry])[entry.path]
    if "%" in limits and "%" not in str(entry.quantity.source) and NUMBER in (kind.dimensions or ()):
        yield Finding(f"the limits '{limits}' are in percent, the number is not", where, "write the deviation itself")


def _shape(mechanism: Numbers, variation: Variation | None, where: str) -> Iterator[Finding]:
    """Whether the keys of an entry, or of the defaults, are those of its distribution."""
    stated = variation or mechanism.tolerance_defaults
    name = stated.distribution or mechanism.tolerance_defaults.distribution
    keys = [key for key in OPTIONS if getattr(stated, key, None) is not None]
    yield from stray(keys, DISTRIBUTIONS, "distribution", name, "distribution", where)
    if variation is None and name in ("sample", FULL_TURN):
        what = f"the distribution {name} is of one number, not of all"
        yield Finding(what, f"{where}.distribution", "state it in tolerances: {…}")
    elif variation and name == "sample" and variation.values is None:
        remedy = "add values: [0.01 mm, …], or give them by --sample"
        yield Finding("the measured deviations are missing", where, remedy)
    elif variation and name == FULL_TURN and variation.limits is not None:
        yield Finding("a direction over the whole turn has no limits", where, "remove them, or state uniform")


def _way(cost: Cost, where: str) -> Iterator[Finding]:
    """Whether a cost is stated in one way, with what that needs."""
    ways = [key for key in WAYS if getattr(cost, key) is not None]
    if len(ways) != 1:
        what = f"states {' and '.join(ways) or 'no cost'}"
        yield Finding(what, where, "state one of model: power with B and k, process: … or options: {…}")
        return
    keys = [key for key in (*FORMULA, "unit", "least", "most") if getattr(cost, key) is not None]
    for key in () if cost.model else keys:
        remedy = f"remove it, or state model: {' or '.join(COST_MODELS)}"
        yield Finding(f"'{key}' has no effect on a choice", f"{where}.{key}", remedy)
    for key in {"B", "k"} - {*keys} if cost.model else ():
        yield Finding(f"'{key}' is missing", where, f"add {key}: …, as in {FORMS[str(cost.model)]}")


# ---- numbers --------------------------------------------------------------------------------------------------


def tolerance_values(mechanism: Numbers) -> Iterator[Finding]:
    """Findings about limits, distributions and correlations as numbers."""
    numbers = mechanism.parameter_set
    for entry in further_entries(mechanism):
        value = float(entry.quantity.evaluate(numbers.dimension_values))
        if not np.isfinite(value):
            yield Finding(
                f"'{entry.quantity.source}' has no finite value ({value})", entry.where, "check its divisions"
            )
        yield from limit_findings(entry.rules, value, entry.kind, entry.where)
    varied, limits = variations(mechanism), written_limits(mechanism)
    for tolerance in tolerated(mechanism):
        name, variation = varied.get(tolerance.path, ("", Variation()))
        where = f"tolerances.{name}" if name else tolerance.path
        yield from _limits(mechanism, tolerance, variation, limits.get(tolerance.path), where)
        places = {key: where if getattr(variation, key) is not None else "tolerance_defaults" for key in OPTIONS}
        yield from _options(tolerance, {key: f"{place}.{key}" for key, place in places.items()})
    yield from _correlations(mechanism)


def _limits(
    mechanism: Numbers, tolerance: Tolerance, variation: Variation, written: tuple[float, float] | None, where: str
) -> Iterator[Finding]:
    path, lower, upper = tolerance.path, tolerance.lower, tolerance.upper
    entries, options = mechanism.parameter_set.entries, tolerance.options
    if not np.isfinite(np.var(np.atleast_1d(options.get("values", 0.0)))):
        yield Finding(f"the deviations of '{path}' have no finite variance", where, "remove the outliers")
    if np.isnan(lower + upper):
        remedy = "add limits: ±0.05 mm, or write them with the value, as 60 mm ± 0.05 mm"
        yield Finding(f"the limits of '{path}' are missing", where, remedy)
    if lower > upper:
        what = f"the lower limit {lower:g} is above the upper one {upper:g} (SI)"
        yield Finding(what, where, "write ± before a number that is not negative")
    if written is not None and variation.limits is not None and not np.allclose(written, (lower, upper), rtol=1e-9):
        what = f"these limits override those stated with '{path}', {written[0]:g} to {written[1]:g} (SI)"
        yield Finding(what, where, "state them once", Severity.NOTE)
    if variation.direction and not towards(path, entries):
        what = f"'{path}' has no direction: the tilt and the offset of a misaligned axis have"
        yield Finding(what, f"{where}.direction", "remove it; for an angle state {distribution: direction}")
    elif variation.direction and tolerance.nominal + lower < -ROUNDING * tolerance.half_width:
        what = f"is the size of a run-out, from {tolerance.nominal + lower:g} on (SI): a size is not negative"
        yield Finding(what, where, "write +0.02/0 mm")
    if tolerance.distribution == FULL_TURN and (kind := entries[path].kind).dimensions and kind is not KINDS["angle"]:
        yield Finding(f"'{path}' is no angle", where, "only an angle is uniform over all directions")


def _options(tolerance: Tolerance, where: Mapping[str, str]) -> Iterator[Finding]:
    """Whether what a distribution was told makes one. where: each option stands."""
    options: dict[str, Any] = dict(tolerance.options)
    cp, cpk, mode, shift = options.get("cp", 1.0), options.get("cpk"), options.get("mode"), options.get("shift", 0.0)
    if cpk is not None and cpk > cp * (1 + ROUNDING):
        what = f"cpk {cpk:g} is above cp {cp:g}: the share of the limits cannot be larger off the middle than in it"
        yield Finding(what, where["cpk"], "give a cpk of at most cp")
    if mode is not None and (mode < tolerance.lower or mode > tolerance.upper):
        what = f"the mode {mode:g} is outside the limits {tolerance.lower:g} to {tolerance.upper:g} (SI)"
        yield Finding(what, where["mode"], "give the deviation at which the density peaks")
    if abs(shift) > tolerance.half_width:
        what = f"the shift {shift:g} puts the mean outside the limits, {tolerance.half_width:g} from their middle (SI)"
        yield Finding(what, where["shift"], "check its unit", Severity.WARNING)


def _correlations(mechanism: Numbers) -> Iterator[Finding]:
    """Whether each correlation is of several tolerated numbers, once, and all of them can be at the same time."""
    vary = {item.path for item in tolerated(mechanism)}
    first: dict[frozenset[str], int] = {}
    for row, item in enumerate(mechanism.correlations):
        where, paths = f"correlations.{row}", named_paths(mechanism, item.of)
        for name in item.of:
            if not vary.issuperset(named_paths(mechanism, [name])):
                yield Finding(f"'{name}' has no tolerance", where, "state one in tolerances: {…}, or leave it out")
        if len(paths) < 2:
            yield Finding("a correlation needs two parameters", where, "name two, as of: [AB, BC]")
        for pair in map(frozenset, combinations(paths, 2)):
            if len(pair) < 2 or pair in first:
                again = f"in entry {first[pair] + 1} already" if pair in first else "twice"
                yield Finding(f"{' and '.join(sorted(pair))} is named {again}", where, "name two numbers, once")
            first.setdefault(pair, row)
    matrix = correlation(mechanism)
    if matrix.size and (least := float(np.linalg.eigvalsh(matrix)[0])) < -ROUNDING:
        what = (
            f"these correlations contradict one another: the least eigenvalue of their matrix is {least:.3g}, below 0"
        )
        yield Finding(what, "correlations", "the correlation matrix is not positive definite: reduce the coefficients")


def cost_values(mechanism: Numbers) -> Iterator[Finding]:
    """Whether each cost is of a tolerance or of a play, once, and its numbers make sense."""
    kinds = measured(mechanism, mechanism.entries)
    tolerances = {tolerance.path: tolerance for tolerance in tolerated(mechanism)}
    first: dict[str, str] = {}
    groups: dict[str, dict[str, list[Price]]] = {}
    for name, cost in mechanism.costs.items():
        where, paths = f"costs.{name}", cost_paths(mechanism, name)
        if not paths:
            yield _unpriced(mechanism, name, where)
        for path in paths:
            if path in first:
                yield Finding(f"'{name}' and '{first[path]}' are the same", where, "keep one of them")
            first.setdefault(path, name)
            kind = kinds.get(path, KINDS["length"])  # of a play, which is no number by itself
            yield from _bought(mechanism, path, where, tolerances.get(path))
            faults = [*_offered(cost, where, kind, path not in kinds)]
            try:
                offers = [] if faults else [price(mechanism, path, cost)]
            except MechanismError as error:  # no grade of this size
                offers, remedy = [], "state options: {…} or a model"
                faults.append(Finding(error.findings[0].what, f"{where}.process", remedy))
            yield from faults
            for offer in offers:
                if offer.least > offer.most:
                    what = f"the least half width {offer.least:g} is above the most {offer.most:g} (SI)"
                    yield Finding(what, f"{where}.least", "exchange them")
            if cost.group:
                groups.setdefault(cost.group, {}).setdefault(name, []).extend(offers)
    for name, members in groups.items():
        yield from _group(mechanism, name, members)


def _bought(mechanism: Numbers, path: str, where: str, tolerance: Tolerance | None) -> Iterator[Finding]:
    """Whether what a cost is of is a play that is modelled, or a tolerance that can be chosen."""
    _, joint, *_ = path.split(".")
    if path not in mechanism.parameter_set.entries:
        if not has_play(mechanism.effective_joints[joint]):
            kind = mechanism.effective_joints[joint].type
            yield Finding(f"the play of a {kind} joint is not modelled", where, "remove the cost")
    elif tolerance is None:
        remedy = f"state one as a start, tolerances: {{{as_key(path)}: ±0.05 mm}}"
        play = f"; the play itself is joints.{joint}.clearance" * path.endswith(".clearance")
        yield Finding(f"'{path}' has no tolerance", where, remedy + play)
    elif not tolerance.can_be_chosen:
        what = f"'{path}' varies as measured or over a full turn: there is no tolerance to choose"
        yield Finding(what, where, "remove the cost", Severity.WARNING)


def _unpriced(mechanism: Numbers, name: str, where: str) -> Finding:
    """Of a cost whose name is no number with a tolerance and no clearance."""
    joint = mechanism.effective_joints.get(name.removeprefix("joints.").removesuffix(".clearance"))
    if not name.endswith(".clearance") or joint is None:
        _, findings = meant(mechanism, "costs", [name])
        return next(iter(findings), Finding(f"no joint follows '{name}'", where, "name the number of a joint"))
    if joint.pin is not None and (joint.pin.fit is not None or joint.pin.hole_radius is not None):
        source = f"the fit {joint.pin.fit.source}" if joint.pin.fit is not None else "the radii of pin and hole"
        what = f"'{name}' cannot have a cost: its play is derived from {source}"
        return Finding(what, where, "state pin.clearance instead, or remove the cost: the play stays as stated")
    what = f"the joint of '{name}' states no clearance"
    return Finding(what, where, "state pin: {clearance: 0.02 mm}, or of a guide guide: {clearance: 0.02 mm}")


def _offered(cost: Cost, where: str, kind: Kind, play: bool) -> Iterator[Finding]:
    """Whether the unit of a formula, and the grades of a process, are those of a number of this kind."""
    if cost.model is not None and cost.unit is None and kind.name in ("length", "angle"):
        what = f"states no unit: B is what a half width of 1 unit costs, of this {kind.name}"
        yield Finding(what, where, f"write unit: {'mm' if kind.name == 'length' else 'deg'}")
    if cost.unit is not None:
        try:
            dimension = unit(cost.unit)[1]
            if not kind.accepts(dimension):
                what = f"'{cost.unit}' is the unit of {dimension_text(dimension)}, the tolerance is of {kind.name}"
                raise UnitError(what, f"write a unit of {kind.name}, such as that of {kind.example}")
        except UnitError as error:
            yield Finding(error.what, f"{where}.unit", error.remedy)
    if cost.process is not None and (play or (kind.dimensions and kind is not KINDS["length"])):
        what = "a play has no IT grade" if play else f"IT grades are of lengths, this is of {kind.name}"
        yield Finding(what, f"{where}.process", "state options: {…} or a model")


def _group(mechanism: Numbers, name: str, members: Mapping[str, list[Price]]) -> Iterator[Finding]:
    """The members of a group have one half width: each is priced by a formula, or all by the same choices."""
    every = [price for several in members.values() for price in several]
    choices = [{choice.name for choice in price.choices} for price in every]
    where, of = f"costs.{next(iter(members))}.group", f"the group '{name}' ({', '.join(members)})"
    if len({bool(mechanism.costs[member].model) for member in members}) > 1:
        yield Finding(f"{of} has formulas and choices", where, "state the same for all, or two groups")
    elif any(choices) and not set.intersection(*choices):
        yield Finding(f"{of} has no choice in common", where, "give its members the same choices")
    elif every and max(price.least for price in every) > min(price.most for price in every):
        yield Finding(f"the bounds of {of} exclude one another", where, "widen them")
