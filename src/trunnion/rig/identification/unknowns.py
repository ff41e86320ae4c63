"""The unknowns of an identification: numbers of the model, alone or several that are one, with where they may lie."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf

import numpy as np

from trunnion.errors import Finding, MechanismError
from trunnion.model.mechanism import Mechanism
from trunnion.model.parameters import Entry, measured
from trunnion.model.rules import Within

__all__ = ["Parameters", "Unknown", "described", "limits", "unknowns"]

Parameters = Mapping[str, Sequence[str] | str] | Sequence[str]
SMALL = 1e-6  # of 1 in SI: the least of numbers that must be above 0
PLAIN = {"SI": "1"}  # of a dimension without a unit, whose kind its value does not tell


@dataclass(frozen=True)
class Unknown:
    """One unknown: its name, the paths of the numbers that it stands for, SI unit, start and limits in SI.

    before: what the model has at each path.
    """

    name: str
    paths: tuple[str, ...]
    unit: str
    start: float
    lower: float
    upper: float
    before: tuple[float, ...]

    @property
    def size(self) -> float:
        """How large it is by the model; 0 if that has none."""
        return max(abs(self.start), max(map(abs, self.before)))


def described(mechanism: Mechanism, parameters: Parameters) -> dict[str, tuple[str, ...]]:
    """Paths by the name of the unknown; MechanismError for what means no number, or one that is named twice."""
    stated = parameters if isinstance(parameters, Mapping) else {name: [name] for name in parameters}
    if not stated:
        remedy = "name one, such as joint_defaults.friction.coefficient"
        raise MechanismError(Finding("no parameter to identify is given", "parameters", remedy))
    findings: list[Finding] = []
    found: dict[str, tuple[str, ...]] = {}
    owners: dict[str, str] = {}
    for name, given in stated.items():
        names = [given] if isinstance(given, str) else list(given)
        paths = []
        for one in names or [name]:
            try:
                path = mechanism.path_of(one)
            except MechanismError as error:
                findings += error.findings
                continue
            if path in owners:
                what = f"{path} is in '{owners[path]}' already"
                findings.append(Finding(what, f"parameter {name}", "name each number once"))
            owners[path] = name
            paths.append(path)
        found[name] = tuple(paths)
    if findings:
        raise MechanismError(findings)
    return found


def unknowns(
    mechanism: Mechanism, described: Mapping[str, tuple[str, ...]], start: Mapping[str, float | str]
) -> list[Unknown]:
    """The unknowns of a mechanism that states all their numbers; start: of some, by name."""
    extra = [name for name in start if name not in described]
    if extra:
        what = f"'{extra[0]}' is not one of the parameters"
        raise MechanismError(Finding(what, "start", f"they are {', '.join(described)}"))
    values = mechanism.parameters()
    kinds = measured(mechanism, mechanism.parameter_set.entries.values())
    found, findings = [], []
    for name, paths in described.items():
        missing = [path for path in paths if path not in values]
        if missing:
            what = f"{missing[0]} is no number but changes with the motion"
            findings.append(Finding(what, f"parameter {name}", "identify a dimension in it"))
            continue
        units = {PLAIN.get(kinds[path].unit, kinds[path].unit) for path in paths}
        if len(units) > 1:
            what = f"its numbers are not of one kind: {', '.join(sorted(units))}"
            findings.append(Finding(what, f"parameter {name}", "use one parameter for each kind"))
            continue
        before = tuple(float(np.ravel(values[path])[0]) for path in paths)
        ends = [limits(mechanism, path) for path in paths]
        lower, upper = max(low for low, _ in ends), min(high for _, high in ends)
        first = _read(mechanism, paths[0], start[name]) if name in start else float(np.mean(before))
        if not lower <= first <= upper:
            what = f"the start {first:g} is beyond its limits, {lower:g} to {upper:g} (SI)"
            findings.append(Finding(what, f"parameter {name}", "give another start"))
            continue
        found.append(Unknown(name, paths, next(iter(units)), first, lower, upper, before))
    if findings:
        raise MechanismError(findings)
    return found


def _read(mechanism: Mechanism, path: str, text: float | str) -> float:
    """A start value in SI."""
    return float(np.ravel(mechanism.with_values({path: text}).parameters()[path])[0])


def limits(mechanism: Mechanism, path: str) -> tuple[float, float]:
    """Where a number may lie by its law or its kind, SI; infinite where nothing is known against it.

    A dimension has the limits of all numbers that are it and nothing else.
    """
    entries = mechanism.parameter_set.entries.values()
    ends, same, grown = [_limits(mechanism, path)], {path}, path.startswith("dimensions.")
    while grown:  # dimensions that are this one, and so on
        equal = [one.path for one in entries if one.path not in same and _equals(one, same)]
        ends += [_limits(mechanism, one) for one in equal]
        same.update(equal)
        grown = bool(equal)
    return max(low for low, _ in ends), min(high for _, high in ends)


def _equals(entry: Entry, paths: set[str]) -> bool:
    """Whether a number is written as one of these dimensions alone, or follows a number that is."""
    if entry.alias:
        return entry.alias in paths
    source = entry.quantity.source
    return isinstance(source, str) and f"dimensions.{source.strip()}" in paths


def _limits(mechanism: Mechanism, path: str) -> tuple[float, float]:
    """Those of a number by itself."""
    entry = mechanism.parameter_set.entries[path]
    limits = [one for one in entry.rules if isinstance(one, Within)]
    low = max((SMALL if one.ends[0] == "(" and one.low == 0 else one.low for one in limits), default=-inf)
    high = min((one.high for one in limits), default=inf)
    moment = path.startswith("links.") and path.endswith(".inertia")
    return max(low, 0.0 if moment else -inf), high
