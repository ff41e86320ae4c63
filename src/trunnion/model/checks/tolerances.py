"""Checks of tolerances, correlations, costs and measures: what they name and take, whether their numbers agree."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np

from trunnion.errors import Finding, MechanismError, Severity
from trunnion.model.expression import parse
from trunnion.model.fields import Fields, operand_dimensions, operands
from trunnion.model.joint_parts import has_play
from trunnion.model.measure_table import MEASURES, Measure
from trunnion.model.names import as_key, nearest
from trunnion.model.parameters import Numbers, ParameterSet, measured
from trunnion.model.rules import Refers, faults, limit_findings, stray
from trunnion.model.tolerance_parts import DISTRIBUTIONS, OPTIONS, Cost, Variation
from trunnion.model.tolerances import DEFAULTS, FULL_TURN, Price, Tolerance, Varying, ends_motion, may_vary, towards
from trunnion.model.units import KINDS, Kind, UnitError, dimension_text, unit

NUMBER = KINDS["number"].dimensions[0]
ROUNDING = 1e-9  # of an eigenvalue, and of limits that touch zero


# ---- names ----------------------------------------------------------------------------------------------------


def meant(mechanism: Varying, section: str, names: Iterable[str]) -> tuple[dict[str, str], list[Finding]]:
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
            findings.append(Finding(f"'{name}' and '{first}' are the same number", where))
        paths[name] = path
    return paths, findings


def tolerance_names(mechanism: Varying) -> Iterator[Finding]:
    """Whether each name is of a number that can vary, once, and distributions and costs get what they take."""
    entries = {entry.path: entry for entry in mechanism.entries}
    followed = {entry.alias for entry in mechanism.entries}
    kinds = measured(mechanism, mechanism.entries)
    paths, findings = meant(mechanism, "tolerances", mechanism.variations)
    yield from findings
    yield from _shape(mechanism, mechanism.tolerance_defaults, "tolerance_defaults")
    for name, variation in mechanism.variations.items():
        where, path = f"tolerances.{name}", paths.get(name, "")
        yield from _shape(mechanism, variation, where)
        if not path:
            continue
        entry, limits = entries[path], "" if variation.limits is None else str(variation.limits.source)
        percent = "%" in limits and "%" not in str(entry.quantity.source) and NUMBER in (kinds[path].dimensions or ())
        yield from faults(
            where,
            (entry.varies, "", f"'{path}' varies with the motion and has no one tolerance"),
            (ends_motion(path), "",
             f"'{path}' does not vary: samples are compared at the same coordinates of the driver"),
            (not (may_vary(entry) or entry.varies or ends_motion(path)), "",
             f"'{path}' is not a parameter of the mechanism"),
            (path.startswith(DEFAULTS) and path not in followed, "", f"no joint follows '{path}'"),
            (percent, "", f"the limits '{limits}' are in percent, the number is not"),
        )  # fmt: skip
    for row, pair in enumerate(mechanism.correlations):
        yield from meant(mechanism, f"correlations.{row}", dict.fromkeys(pair.of))[1]


def _shape(mechanism: Varying, variation: Any, where: str) -> Iterator[Finding]:
    """Whether the keys of a `Variation`, or of the defaults, are those of its distribution."""
    single = isinstance(variation, Variation)
    name = variation.distribution or mechanism.tolerance_defaults.distribution
    keys = [key for key in OPTIONS if getattr(variation, key, None) is not None]
    yield from stray(keys, DISTRIBUTIONS, "distribution", name, "distribution", where)
    yield from faults(
        where,
        (not single and name in ("sample", FULL_TURN), "distribution",
         f"the distribution {name} is of one number, not of all"),
        (single and name == "sample" and variation.values is None, "", "the measured deviations are missing",
         "add values: [0.01 mm, …], or give them by --sample"),
        (single and name == FULL_TURN and variation.limits is not None, "",
         "a direction over the whole turn has no limits", "remove them, or state uniform"),
    )  # fmt: skip


# ---- numbers --------------------------------------------------------------------------------------------------


def tolerance_values(mechanism: Varying) -> Iterator[Finding]:
    """Findings about limits, distributions and correlations as numbers."""
    for entry in mechanism.further_entries:
        value = mechanism.parameter_set.value(entry.quantity)
        if not np.isfinite(value):
            yield Finding(f"'{entry.quantity.source}' has no finite value ({value})", entry.where)
        yield from limit_findings(entry.rules, value, entry.kind, entry.where)
    varied, limits = mechanism.variations_by_path, mechanism.tolerances()
    for tolerance in mechanism.tolerated():
        name, variation = varied.get(tolerance.path, ("", Variation()))
        where = f"tolerances.{name}" if name else tolerance.path
        yield from _limits(mechanism, tolerance, variation, where)
        written = limits.get(tolerance.path)
        if written and variation.limits and not np.allclose(written, (tolerance.lower, tolerance.upper), rtol=1e-9):
            what = f"these limits override those stated with '{tolerance.path}', {written[0]:g} to {written[1]:g} (SI)"
            yield Finding(what, where, "state them once", Severity.NOTE)
    vary = {item.path for item in mechanism.tolerated()}
    first: dict[frozenset[str], int] = {}
    for row, item in enumerate(mechanism.correlations):
        where, paths = f"correlations.{row}", mechanism.named_paths(item.of)
        fixed = [name for name in item.of if not vary.issuperset(mechanism.named_paths([name]))]
        yield from faults(
            where,
            *((True, "", f"'{name}' has no tolerance") for name in fixed),
            (len(paths) < 2, "", "a correlation needs two parameters", "name two, as of: [AB, BC]"),
        )
        for pair in map(frozenset, combinations(paths, 2)):
            if len(pair) < 2 or pair in first:
                again = f"in entry {first[pair] + 1} already" if pair in first else "twice"
                yield Finding(f"{' and '.join(sorted(pair))} is named {again}", where)
            first.setdefault(pair, row)
    matrix = mechanism.correlation()
    if matrix.size and (least := float(np.linalg.eigvalsh(matrix)[0])) < -ROUNDING:
        what = f"these correlations contradict one another: the least eigenvalue of their matrix is {least:.3g}"
        yield Finding(f"{what}, below 0: it is not positive definite", "correlations", "reduce the coefficients")


def _limits(mechanism: Varying, tolerance: Tolerance, variation: Variation, where: str) -> Iterator[Finding]:
    """Whether limits and what a distribution was told make one."""
    path, lower, upper, half = tolerance.path, tolerance.lower, tolerance.upper, tolerance.half_width
    entries, options = mechanism.parameter_set.entries, dict[str, Any](tolerance.options)
    cp, cpk, mode = options.get("cp", 1.0), options.get("cpk"), options.get("mode")
    kind, aimed = entries[path].kind, bool(towards(path, entries))
    cpk_at = "tolerances" if variation.cpk is not None else "tolerance_defaults.cpk"
    yield from faults(
        where,
        (not np.isfinite(np.var(np.atleast_1d(options.get("values", 0.0)))), "",
         f"the deviations of '{path}' have no finite variance", "remove the outliers"),
        (np.isnan(lower + upper), "", f"the limits of '{path}' are missing",
         "add limits: ±0.05 mm, or write them with the value, as 60 mm ± 0.05 mm"),
        (lower > upper, "", f"the lower limit {lower:g} is above the upper one {upper:g} (SI)",
         "write ± before a number that is not negative"),
        (variation.direction and not aimed, "direction",
         f"'{path}' has no direction: the tilt and the offset of a misaligned axis have",
         "remove it; for an angle state {distribution: direction}"),
        (variation.direction and aimed and tolerance.nominal + lower < -ROUNDING * half, "",
         f"is the size of a run-out, from {tolerance.nominal + lower:g} on (SI): a size is not negative",
         "write +0.02/0 mm"),
        (tolerance.distribution == FULL_TURN and kind.dimensions and kind is not KINDS["angle"], "",
         f"'{path}' is no angle", "only an angle is uniform over all directions"),
        (mode is not None and not lower <= mode <= upper, "mode",
         f"the mode {mode or 0:g} is outside the limits {lower:g} to {upper:g} (SI)"),
    )  # fmt: skip
    if cpk is not None and cpk > cp * (1 + ROUNDING):
        what = f"cpk {cpk:g} is above cp {cp:g}: the share of the limits cannot be larger off the middle than in it"
        yield Finding(what, f"{where}.cpk" if cpk_at == "tolerances" else cpk_at)


def cost_values(mechanism: Varying) -> Iterator[Finding]:
    """Whether each cost is of a tolerance or of a play, once, and its numbers make sense."""
    kinds = measured(mechanism, mechanism.entries)
    tolerances = {tolerance.path: tolerance for tolerance in mechanism.tolerated()}
    first: dict[str, str] = {}
    groups: dict[str, dict[str, list[Price]]] = {}
    for name, cost in mechanism.costs.items():
        where, paths = f"costs.{name}", mechanism.cost_paths(name)
        if not paths:  # neither a number with a tolerance nor a clearance
            joint, _, key = name.removeprefix("joints.").rpartition(".")
            if joint in mechanism.effective_joints and key == "clearance":
                remedy = "state clearance: 0.02 mm of its pin or guide, instead of its radii or a fit"
                yield Finding(f"the joint of '{name}' states no clearance", where, remedy)
            else:
                nothing = Finding(f"no joint follows '{name}'", where, "name the number of a joint")
                yield from meant(mechanism, "costs", [name])[1] or [nothing]
        for path in paths:
            if path in first:
                yield Finding(f"'{name}' and '{first[path]}' are the same", where)
            first.setdefault(path, name)
            yield from _bought(mechanism, path, where, tolerances.get(path))
            faulty = [*_offered(cost, where, kinds.get(path), path)]
            try:
                offers = [] if faulty else [mechanism.price(path, cost)]
            except MechanismError as error:  # no grade of this size
                offers = []
                faulty.append(Finding(error.findings[0].what, f"{where}.process", "state options: {…} or a model"))
            yield from faulty
            yield from faults(
                where,
                *((offer.least > offer.most, "least",
                   f"the least half width {offer.least:g} is above the most {offer.most:g} (SI)") for offer in offers),
            )  # fmt: skip
            if cost.group:
                groups.setdefault(cost.group, {}).setdefault(name, []).extend(offers)
    for name, members in groups.items():
        yield from _group(mechanism, name, members)


def _bought(mechanism: Varying, path: str, where: str, tolerance: Tolerance | None) -> Iterator[Finding]:
    """Whether what a cost is of is a play that is modelled, or a tolerance that can be chosen."""
    _, name, *_ = path.split(".")
    joint, of_play = mechanism.effective_joints.get(name), path not in mechanism.parameter_set.entries
    play = f"; the play itself is joints.{name}.clearance" * path.endswith(".clearance")
    yield from faults(
        where,
        (of_play and joint and not has_play(joint), "", f"the play of a {joint and joint.type} joint is not modelled"),
        (not of_play and tolerance is None, "", f"'{path}' has no tolerance",
         f"state one as a start, tolerances: {{{as_key(path)}: ±0.05 mm}}{play}"),
        (tolerance and not tolerance.can_be_chosen, "",
         f"'{path}' varies as measured or over a full turn: there is no tolerance to choose", "remove the cost",
         Severity.WARNING),
    )  # fmt: skip


def _offered(cost: Cost, where: str, kind: Kind | None, path: str) -> Iterator[Finding]:
    """Whether the unit of a formula, and the grades of a process, are those of a number; kind: None of a play."""
    measures = kind or KINDS["length"]
    try:
        dimension = unit(cost.unit or "1")[1]
    except UnitError as error:
        yield Finding(error.what, f"{where}.unit", error.remedy)
        return
    graded = kind is not None and (not kind.dimensions or kind is KINDS["length"])
    yield from faults(
        where,
        (cost.model and cost.unit is None and measures.name in ("length", "angle"), "",
         f"states no unit: B is what a half width of 1 unit costs, of this {measures.name}",
         f"write unit: {'mm' if measures.name == 'length' else 'deg'}"),
        (cost.unit is not None and not measures.accepts(dimension), "unit",
         f"'{cost.unit}' is the unit of {dimension_text(dimension)}, the tolerance is of {measures.name}"),
        (cost.process is not None and not graded, "process",
         f"IT grades are of lengths, this is of {kind.name}" if kind else "a play has no IT grade",
         "state options: {…} or a model"),
    )  # fmt: skip


def _group(mechanism: Varying, name: str, members: Mapping[str, list[Price]]) -> Iterator[Finding]:
    """The members of a group have one half width: each is priced by a formula, or all by the same choices."""
    every = [price for several in members.values() for price in several]
    choices = [{choice.name for choice in price.choices} for price in every]
    mixed = len({bool(mechanism.costs[member].model) for member in members}) > 1
    apart, of = any(choices) and not set.intersection(*choices), f"the group '{name}' ({', '.join(members)})"
    least, most = max((price.least for price in every), default=0), min((price.most for price in every), default=0)
    yield from faults(
        f"costs.{next(iter(members))}.group",
        (mixed, "", f"{of} has formulas and choices"),
        (not mixed and apart, "", f"{of} has no choice in common"),
        (not mixed and not apart and least > most, "", f"the bounds of {of} exclude one another"),
    )


# ---- measures: where and how they are taken ---------------------------------------------------------------------

PLACES = ("place-of-maximum", "place-of-minimum")


def check_measure(mechanism: Numbers, measure: Measure, where: str) -> Iterator[Finding]:
    """Whether a measure has one subject that exists, and is taken where and as it can be."""
    if len(measure.kinds) != 1:
        return  # a finding of its own
    key, kind, name = measure.kind, MEASURES[measure.kind], measure.subject
    joint = mechanism.effective_joints.get(name)
    if key == "expression":
        yield from _expression_findings(mechanism, measure, f"{where}.{key}")
    elif kind.space not in ("", mechanism.space):
        yield Finding(f"there is no {key} in space", f"{where}.{key}")
    elif not isinstance(kind.of, tuple):
        yield from Refers("any joint" if kind.of == "joint" else kind.of).missing(name, f"{where}.{key}", mechanism)
    moves = joint.pair.motions if joint is not None and kind.of == "joint" else ()
    motion = key if key in ("rotation", "slide") else "rotation or slide"
    guide, pin = (joint.guide, joint.pin) if joint else (None, None)  # in the plane a pin bears its load in its middle
    long = (guide and guide.length) or (mechanism.space == "spatial" and pin and (pin.bearing or pin.length))
    word = kind.vector_in(mechanism.space)
    axis, along, of_angle = measure.axis is not None, measure.along is not None, key == "angle"
    figure, at, over = measure.statistic, measure.at is not None, measure.over is not None
    dwell, lasting = figure == "dwell", kind.in_time or name == "cycle" or key == "time_ratio"
    placed, reduced = key == "dead_centre" and figure in PLACES, measure.reduced
    yield from faults(
        where,
        (joint and kind.of == "joint" and (motion not in moves if key in ("rotation", "slide") else not moves), key,
         f"a {joint and joint.type} joint has no {motion} about one axis",
         f"measure its {moves[0]}" if moves else "measure a point, or the angle of a link"),
        (key == "end_load" and joint and not long, key,
         f"the joint '{name}' has no ends: it states no length of a guide, or in space of a bearing"),
        # the component
        (word == "must" and not axis and not along, key,
         "a link in space is not turned by one angle" if of_angle else "a point is measured along an axis",
         "add axis: x, y or z"),
        ((axis or along) and not word, "axis" if axis else "along",
         "the axis of a coordinate is stated, but no point and no reaction"),
        (along and of_angle, "along", "is a direction, and an angle needs an axis"),
        (measure.axis == "z" and mechanism.space == "planar", "axis", "there is no z in the plane"),
        # where and how it is taken
        (dwell == (measure.within is None), "within", "a dwell is within a band, and only that",
         "state as: dwell with within: [10 mm, 12 mm]"),
        (measure.duration is not None and not kind.in_time, "duration", "a duration is of a motion in time"),
        ((at or over) and not mechanism.drivers, "at" if at else "over",
         "there is no driver whose coordinate it could be: the mechanism has one position"),
        (over and lasting, "over", f"the {key} is over all of it"),
        (reduced and (at or (figure is not None and not placed)), "at" if at else "as",
         f"the {key} is one number of a range already", f"remove it; of a dead_centre write {' or '.join(PLACES)}"),
        (not reduced and figure is not None and at != (figure == "value"), "as",
         f"the {figure} is {'of a range, not of' if at else 'that at'} a position", "state over: or at: …"),
    )  # fmt: skip


def measure_values(mechanism: Numbers, numbers: ParameterSet) -> Iterator[Finding]:
    """Whether limits and ranges of measures have an extent; nan passes every check."""
    for name, measure in mechanism.measures.items():
        where, up_to = f"measures.{name}", MEASURES[measure.kind].up_to
        keys = ("limit.lower", "limit.upper", "at_least", "at_most", "within.from", "within.to", "over.from", "over.to")
        value = {key: float(numbers.nominal.get(f"{where}.{key}", np.nan)) for key in keys}
        lower, upper, least, most, low, high, start, end = value.values()
        first, last = (
            (numbers.entries[f"{where}.over.{end}"].kind.name if measure.over else "") for end in ("from", "to")
        )
        yield from faults(
            where,
            (lower > upper, "limit", f"the lower limit {lower:g} is above the upper one {upper:g} (SI)",
             "write ± before a number that is not negative"),
            (least > most, "at_least", f"at least {least:g} and at most {most:g} (SI)"),
            (low >= high, "within", f"the band runs from {low:g} to {high:g} (SI)"),
            *((value[key] >= up_to, key, f"is {value[key]:g}, but this measure is looked for up to {up_to:g} alone")
              for key in ("at_least", "at_most", "within.to")),
            (first != last, "over", f"the range runs from {first} to {last}"),
            (start == end and first == last, "over", f"the range begins and ends at {start:g}", "or state at: …"),
        )  # fmt: skip


def _expression_findings(mechanism: Fields, measure: Measure, where: str) -> Iterator[Finding]:
    """What is wrong with the expression of a measure: its text, its names, that it speaks of itself, its units."""
    text = measure.subject
    try:
        formula, parts = parse(text), operands(mechanism, measure)
        wrong = [*_wrong_operands(mechanism, parts, where)]
        reached: list[Measure] = []
        for part in (left := [] if wrong else [measure]):  # it grows by what each depends on
            others = [other for other in operands(mechanism, part).values() if other is not None]
            left += [other for other in others if other not in reached]
            reached += left[len(reached) + 1 :]
        yield from wrong
        if measure in reached:
            yield Finding(f"'{text}' depends on itself", where, "remove the circle")
        elif not wrong and not any(parts.values()):
            what, remedy = f"'{text}' has no measure in it: it never changes", "name one, or a joint's rotation"
            yield Finding(what, where, remedy)
        elif not wrong:
            formula.dimension(operand_dimensions(mechanism, measure))
    except UnitError as error:
        yield Finding(error.what, where, error.remedy)


def _wrong_operands(mechanism: Fields, parts: Mapping[str, Measure | None], where: str) -> Iterator[Finding]:
    """What is wrong with the names in an expression."""
    columns = "name a measure, a dimension, JOINT.rotation, JOINT.slide, DRIVER.effort or LINK.POINT.x"
    for name, part in parts.items():
        dimension = name in mechanism.dimensions
        if part is None or dimension:
            near = columns if "." in name else nearest(name, [*mechanism.measures, *mechanism.dimensions])
            yield from faults(
                "",
                (part is not None, where, f"'{name}' is a measure and a dimension", "give one of them another name"),
                (not dimension, where, f"there is no measure or dimension '{name}'", near),
            )
            continue
        kind = MEASURES.get(part.kind)
        if kind and name not in mechanism.measures and part.subject not in mechanism.named(str(kind.of)):
            yield Finding(f"there is no {kind.of} '{part.subject}'", where, columns)
            continue
        figure = part.at is not None or part.over is not None or part.statistic or part.reduced
        deviates = kind and (kind.against or (part.kind == "angle" and part.axis is not None))
        if not kind or figure or deviates or kind.in_time or kind.rule not in ("deviation", "ratio"):
            what = f"the measure '{name}' is no number at every position of one mechanism"
            yield Finding(what, where, "name measures without place, range and statistic, that are no deviation")
