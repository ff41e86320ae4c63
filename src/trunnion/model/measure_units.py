"""What measures are of: kinds of their courses and figures, and what the names in their expressions stand for."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from contextlib import suppress

from trunnion.errors import Finding
from trunnion.model.expression import parse
from trunnion.model.fields import Fields
from trunnion.model.measure_table import MEASURES, Measure
from trunnion.model.names import nearest
from trunnion.model.quantity import Quantity, evaluation_order
from trunnion.model.rules import faults
from trunnion.model.units import ANY, KINDS, NUMBER, Dimension, Kind, UnitError, si_unit

__all__ = ["course_kind", "dimension_kinds", "drive_kind", "expression_findings", "operands", "place_kind"]

_COLUMN = re.compile(r"(?P<part>\w+)\.(?P<kind>rotation|slide|effort)|(?P<point>\w+\.\w+)\.(?P<axis>[xyz])")


def dimension_kinds(mechanism: Fields) -> dict[str, Kind]:
    """What each dimension measures, as far as its value tells."""
    dimensions: dict[str, Dimension | None] = {}
    for name in evaluation_order(mechanism.dimensions)[0]:
        with suppress(UnitError, KeyError):  # findings of their own
            dimensions[name] = mechanism.dimensions[name].check(dimensions, ANY)
    return {name: _of_dimension(dimension) for name, dimension in dimensions.items() if dimension is not None}


def _of_dimension(dimension: Dimension | None) -> Kind:
    """The usual kind of a dimension, a number where none is known."""
    dimension = dimension or NUMBER
    usual, si = {kind.dimensions[0]: kind for kind in KINDS.values()}, si_unit(dimension)
    return usual.get(dimension) or Kind("quantity", si, f"1 {si}", (dimension,))


def drive_kind(mechanism: Fields) -> Kind:
    """What the coordinate of the first driver measures."""
    joint = mechanism.effective_joints.get(next(iter(mechanism.drivers), ""))
    return KINDS["length" if joint and not joint.pair.turns else "angle"]


def course_kind(mechanism: Fields, measure: Measure) -> Kind:
    """What a measure is at every position; of a joint with two motions the rotation."""
    if not measure.kind:  # a finding of its own
        return ANY
    if measure.kind == "expression":
        with suppress(UnitError, KeyError):  # findings of their own
            formula = measure.formula
            return _of_dimension(formula.dimension(_dimensions(mechanism, measure)) if formula else None)
        return ANY
    both = MEASURES[measure.kind].quantities
    return both[-1 if slides(mechanism, measure) else 0]


def slides(mechanism: Fields, measure: Measure) -> bool:
    """Whether the joint, driver, load or spring that a measure is of slides and does not turn."""
    load = mechanism.loads.get(measure.subject)
    if MEASURES[measure.kind].of == "load on a joint":
        return load is None or load.resisting_torque is None
    name: str | None = measure.subject
    if MEASURES[measure.kind].of == "spring":
        spring = mechanism.springs.get(measure.subject)
        name = spring.joint if spring else None
        if name is None:  # between two points
            return True
    joint = mechanism.effective_joints.get(name or "")
    return joint is not None and not joint.pair.turns


def place_kind(mechanism: Fields, quantity: Quantity, dimensions: Mapping[str, Dimension | None]) -> Kind:
    """A time if it is stated as one, else the coordinate of the first driver. dimensions: of the names in it."""
    with suppress(UnitError, KeyError):  # findings of their own
        if quantity.check(dimensions) in KINDS["time"].dimensions:
            return KINDS["time"]
    return drive_kind(mechanism)


# ---- expressions ----------------------------------------------------------------------------------------------


def operands(mechanism: Fields, measure: Measure) -> dict[str, Measure | None]:
    """What each name in the expression of a measure stands for: a measure, None for a dimension or for nothing.

    A name is that of a measure or a dimension of the model, or of a column of a result: JOINT.rotation, JOINT.slide,
    DRIVER.effort or LINK.POINT.x.
    """
    names = measure.formula.names if measure.formula else ()
    return {name: mechanism.measures.get(name) or _column(name) for name in names}


def _column(name: str) -> Measure | None:
    match = _COLUMN.fullmatch(name)
    if match is None:
        return None
    of_point = {"point": match["point"], "axis": match["axis"]}
    return Measure.model_validate(of_point if match["point"] else {match["kind"]: match["part"]})


def _dimensions(mechanism: Fields, measure: Measure) -> dict[str, Dimension | None]:
    """The dimension of each name in an expression, None where it is not known; KeyError for what is nothing."""
    of_dimensions = dimension_kinds(mechanism)
    kinds: dict[str, Dimension | None] = {}
    for name, part in operands(mechanism, measure).items():
        if part is None and name not in mechanism.dimensions:
            raise KeyError(name)
        kind = of_dimensions.get(name, ANY) if part is None else course_kind(mechanism, part)
        kinds[name] = next(iter(kind.dimensions), None)
    return kinds


def expression_findings(mechanism: Fields, measure: Measure, where: str) -> Iterator[Finding]:
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
            formula.dimension(_dimensions(mechanism, measure))
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
