"""Measures: numbers that follow from the motion of a mechanism, or from its forces.

`model.measure_table.MEASURES` is the vocabulary, one entry a kind, `curves.CURVES` the course of each: the one or
more numbers, position by position, that its figure is made of (`figures`).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from pydantic import ValidationError

from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number
from trunnion.errors import Finding, MechanismError
from trunnion.measures.curves import AXES, CURVES, MOTIONS, angle_at, near
from trunnion.model.checks.measures import check_measure
from trunnion.model.expression import Expression
from trunnion.model.joint_parts import motions
from trunnion.model.measure_table import MEASURES, STATISTICS, MeasureKind
from trunnion.model.measure_table import Measure as Stated
from trunnion.model.measure_units import course_kind, operands
from trunnion.model.mechanism import Mechanism
from trunnion.model.names import nearest
from trunnion.solve.backward import Backward
from trunnion.solve.forward import Forward
from trunnion.solve.loads import NOTHING_USEFUL, STATE_USEFUL, has_useful_work
from trunnion.solve.run import Run, prepare
from trunnion.solve.system import System, Values

__all__ = ["Formula", "Measure", "chosen", "coordinate_unit", "named", "outputs"]


@dataclass(frozen=True)
class Formula:
    """An expression of measures. parts: those that are no expressions, by name; inner: those that are."""

    expression: Expression
    parts: Mapping[str, Measure]
    inner: Mapping[str, Formula]
    kind: MeasureKind

    def at(self, numbers: Mapping[str, Number], values: Values) -> Number:
        """Its value, from the numbers of its parts and the dimensions among the values of the mechanism."""

        def number(name: str) -> Number:
            if name in self.inner:
                return self.inner[name].at(numbers, values)
            return numbers[name] if name in numbers else values[f"dimensions.{name}"]

        return self.expression.evaluate({name: number(name) for name in self.expression.names})


@dataclass(frozen=True)
class Measure:
    """One number to watch, its figure and its limits; SI.

    kind: an entry of MEASURES; subject: link.point, link, joint, driver, load, spring or a word such as "cycle"; axis,
    along: which component, by a global axis or a direction; of an angle in space the axis that the link turns about.
    lower, upper: allowed signed deviations of the figure from that of the nominal mechanism; at_least, at_most: bounds
    of the figure itself.
    at, over: coordinate of the first driver, or time if `timed`; statistic: `as` of the model, "" for what the kind
    itself makes of its course (`rule`); within: the band of a dwell; duration: of a
    motion in time, s.
    """

    name: str
    kind: str
    subject: str
    axis: str = ""
    lower: float | None = None
    upper: float | None = None
    at_least: float | None = None
    at_most: float | None = None
    at: float | None = None
    over: tuple[float, float] | None = None
    timed: bool = False
    statistic: str = ""
    along: tuple[float, ...] = ()
    within: tuple[float, float] | None = None
    duration: float | None = None
    formula: Formula | None = field(default=None, compare=False, repr=False)

    @property
    def of(self) -> MeasureKind:
        """What the table says of its kind; of an expression by its parts."""
        return self.formula.kind if self.formula else MEASURES[self.kind]

    @property
    def limit(self) -> float | None:
        """The deviation allowed to either side at every position; None where a limit is of one place or one figure."""
        if not self.everywhere or self.lower is None or self.upper is None:
            return None
        return max(0.0, min(-self.lower, self.upper))

    @property
    def everywhere(self) -> bool:
        """Whether it is of every position: of none place or window, and no statistic."""
        return self.at is None and self.over is None and not self.statistic and not self.in_time

    @property
    def in_time(self) -> bool:
        """Whether it is of a motion in time: its figure has no course over a cycle."""
        return self.of.in_time

    @property
    def of_motion(self) -> bool:
        """Whether the motion alone decides it: its course takes a walk forward."""
        return not self.of.of_forces

    @property
    def of_places(self) -> bool:
        """Whether the places of the links decide it, without their speeds."""
        return self.of.needs == "places"

    @property
    def wants_margin(self) -> bool:
        """Whether the forces must be solved with `FrictionMethod(margin_up_to=MARGIN)`."""
        return self.kind == "locking_margin"

    @property
    def rule(self) -> str:
        """What makes the figure of the course: a rule of `figures.Reading`."""
        rule = self.of.rule
        if rule == "ratio" and self.subject != "cycle":
            rule = "deviation"
        if rule == "dead centre":
            return "dead centre, least" if self.statistic == "place-of-minimum" else rule
        if rule in ("line", "ratio", "work", "time ratio"):
            return rule
        return self.statistic or ("value" if self.at is not None else rule)

    def single(self, system: System) -> bool:
        """Whether it is by itself one number at every position, of one mechanism alone: what a sensor could show."""
        single = self.of.rule == "deviation" or (self.of.rule == "ratio" and self.subject == "instant")
        return single and not self.of.against and not self.of_attitude(system)

    def unit(self, system: System) -> str:
        """SI unit of the course."""
        both = self.of.quantities
        return both[0 if len(both) == 1 or self._turns(system) else 1].unit

    def _turns(self, system: System) -> bool:
        if self.of.of == "load on a joint":
            return system.mechanism.loads[self.subject].resisting_torque is not None
        if self.of.of == "spring":
            joint = system.mechanism.springs[self.subject].joint
            return joint is not None and system.turns(joint)
        return system.turns(self.subject)

    def figure_unit(self, system: System, values: Values) -> str:
        """SI unit of the figure: of a place that of the first driver's coordinate, s where this names no position."""
        if self.rule in ("dwell", "time ratio"):
            return "1"
        return coordinate_unit(system, values) if self.of_place else self.unit(system)

    @property
    def of_place(self) -> bool:
        """Whether the figure is a place in the cycle."""
        return self.rule.startswith(("place", "dead"))

    def against_nominal(self, system: System) -> bool:
        """Whether it is judged against the nominal mechanism."""
        return self.of.against or self.of_attitude(system) or self.rule == "deviation"

    def turning(self, system: System) -> bool:
        """Whether the course is an angle, which may gain whole turns."""
        own_coordinate = self.coordinate(system)
        return own_coordinate.kind in MOTIONS and own_coordinate.unit(system) == "rad" and not self.of_attitude(system)

    def of_attitude(self, system: System) -> bool:
        """Whether it is the turn of a link in space from where it lies in the nominal mechanism."""
        return self.kind == "angle" and system.mechanism.space == "spatial"

    def curve(self, back: Backward | Forward) -> tuple[Number, ...]:
        """The course: one number or more, each to broadcast to (sample, position); SI, angles in (−π, π].

        back: a `Backward`, or a `Forward` where `of_motion`. Of a point its coordinates, of the efficiency of the cycle
        useful and drive power, of the angle of a link in space the three axes of its frame.
        Floats, arrays or dual numbers, as the values were.
        """
        walk = back if isinstance(back, Forward) else back.walk
        return self.joined(self.numbers(back), prepare(walk.system.mechanism), walk.values, walk.time)

    def numbers(self, back: Backward | Forward) -> tuple[Number, ...]:
        """What the course is made of, as the compiled engine finds it: of an expression the number of each part."""
        if self.formula:
            return tuple(number for part in self.formula.parts.values() for number in part.numbers(back))
        walk = back if isinstance(back, Forward) else back.walk
        numbers = CURVES[self.kind](self, back if self.of.of_forces else walk)
        return numbers if isinstance(numbers, tuple) else (numbers,)

    def joined(self, numbers: Sequence[Number], run: Run, values: Values, time: Number) -> tuple[Number, ...]:
        """The course of its numbers at times, s, of mechanisms with these values: an expression is worked out.

        Angles in it go on through whole turns, as they do from the start of the cycle of the run.
        """
        if not self.formula:
            return tuple(numbers)
        linked: dict[str, Number] = {}
        for (name, part), number in zip(self.formula.parts.items(), numbers, strict=True):
            turns = run.cycle.duration > 0 and part.turning(run.system)
            linked[name] = near(number, angle_at(run, part, primal(time))) if turns else number
        return (self.formula.at(linked, values),)

    def coordinate(self, system: System) -> Measure:
        """The rotation or slide of a joint that a stroke, a dead centre or a transmission error is of."""
        if len(self.of.quantities) == 1 or not self.of_places:
            return self
        return Measure(self.name, "rotation" if system.turns(self.subject) else "slide", self.subject)


def coordinate_unit(system: System, values: Values) -> str:
    """Unit of what names positions: rad or m, the coordinate of the first driver if it runs one way, else s."""
    first = next(iter(system.mechanism.drivers), None)
    if first is None or not system.span(values, first).one_way:
        return "s"
    return "rad" if system.turns(first) else "m"


# ---- by name --------------------------------------------------------------------------------------------------

FORMS = "[STATISTIC:]link.point.x, angle:link, rotation:joint, slide:joint, effort:driver, load:name or KIND:NAME"


def named(mechanism: Mechanism, names: Iterable[str], values: Values) -> list[Measure]:
    """Measures by their names in the model, or written as they are.

    `link.point.x`, or KIND:NAME of the entries of MEASURES, as `rotation:joint` or `effort:driver`; of one with a
    component `reaction:joint` or `reaction:joint.x`, in space `angle:link.x`; before any of them a statistic:
    `maximum:effort:A`, `rms:link.point.x`.
    Raises MechanismError for a name that means nothing, or an efficiency where nothing is useful.
    """
    measures, findings = [], []
    for name in dict.fromkeys(names):
        entry = mechanism.measures.get(name)
        if entry is None:
            entry = _read(name)
            if entry is not None:
                at = f"--measure {name}"  # its keys, such as `point`, are not written there
                findings += [replace(finding, where=at) for finding in check_measure(mechanism, entry, at)]
        if entry is None:
            head, colon, _ = name.partition(":")
            links = mechanism.effective_links.items()
            points = [f"{link}.{point}.{axis}" for link, item in links for point in item.points
                      for axis in AXES[: mechanism.coordinates]]  # fmt: skip
            remedy = nearest(head, [*STATISTICS, *MEASURES]) if colon else nearest(name, [*mechanism.measures, *points])
            if not remedy.startswith("did you mean"):
                remedy = f"write {FORMS}, with KIND and STATISTIC as in a model file"
                remedy += f"; the model's measures are {', '.join(mechanism.measures)}" if mechanism.measures else ""
            findings.append(Finding(f"'{name}' is no measure", "", remedy, code="input.measure"))
        elif entry.kind == "efficiency" and not has_useful_work(mechanism):
            what = f"the efficiency is undefined: {NOTHING_USEFUL}"
            findings.append(Finding(what, f"measures.{name}", STATE_USEFUL, code="input.measure"))
        else:
            measures.append(_measure(name, entry, values, mechanism))
    if findings:
        raise MechanismError(findings)
    return measures


def chosen(mechanism: Mechanism, names: Sequence[str] | None, values: Values) -> list[Measure]:
    """Measures by their names, those of the model if there are no names; MechanismError for an empty list."""
    if names is not None and not names:
        raise MechanismError(Finding("no measure is named", "measures", "name one, or leave measures out"))
    return named(mechanism, mechanism.measures if names is None else names, values)


def _read(text: str) -> Stated | None:
    """A measure as it is written on the command line; None if it is none."""
    head, colon, rest = text.partition(":")
    statistic: dict[str, Any] = {}
    if colon and head in STATISTICS:
        statistic, text = {"as": head}, rest
    kind, colon, subject = text.partition(":")
    data: dict[str, Any] = {}
    if colon and kind in MEASURES and kind != "point":
        data[kind] = subject
        owner, _, axis = subject.rpartition(".")
        dots = 1 if MEASURES[kind].of == "point" else 0  # a point may be called x
        if MEASURES[kind].vector and owner.count(".") == dots and owner and axis in AXES:
            data = {kind: owner, "axis": axis}
    elif not colon:
        point, _, axis = text.rpartition(".")
        if "." in point and axis in AXES:
            data = {"point": point, "axis": axis}
    try:
        return Stated(**data, **statistic) if data else None
    except ValidationError:  # such as an efficiency of something
        return None


def _measure(name: str, entry: Stated, values: Values, mechanism: Mechanism) -> Measure:
    path = f"measures.{name}"

    def number(key: str) -> float | None:
        value = values.get(f"{path}.{key}")
        return None if value is None else float(np.ravel(primal(value))[0])

    def numbers(*keys: str) -> tuple[float, ...]:
        return tuple(value for key in keys if (value := number(key)) is not None)

    over, within = numbers("over.from", "over.to"), numbers("within.from", "within.to")
    places = [f"{path}.{key}" for key in ("at", "over.from") if f"{path}.{key}" in values]
    kinds = mechanism.parameter_kinds()
    return Measure(
        name, entry.kind, entry.subject, entry.axis or "",
        number("limit.lower"), number("limit.upper"), number("at_least"), number("at_most"),
        at=number("at"),
        over=(over[0], over[1]) if over else None,
        timed=any(kinds[place].unit == "s" for place in places),
        statistic=entry.statistic or "",
        along=numbers(*(f"along.{axis}" for axis in AXES)),
        within=(within[0], within[1]) if within else None,
        duration=number("duration"),
        formula=_formula(mechanism, entry, values),
    )  # fmt: skip


def _formula(mechanism: Mechanism, entry: Stated, values: Values) -> Formula | None:
    """The expression of a measure, None of another kind: it needs what the most demanding of its parts does."""
    if entry.formula is None:
        return None
    parts, inner = dict[str, Measure](), dict[str, Formula]()
    for name, part in operands(mechanism, entry).items():
        if part is None:
            continue
        measure = _measure(name, part, values, mechanism)
        if measure.formula is None:
            parts[name] = measure
        else:
            inner[name] = measure.formula
            parts |= measure.formula.parts
    needs = max((part.of.needs for part in parts.values()), key=("places", "motion", "forces").index)
    kind = replace(MEASURES["expression"], quantity=course_kind(mechanism, entry), needs=needs)
    return Formula(entry.formula, parts, inner, kind)


def outputs(system: System) -> list[Measure]:
    """Rotation and slide of every joint to the ground that is not driven."""
    ground, drivers = system.mechanism.fixed_link, system.mechanism.drivers
    return [
        Measure(f"{freedom}:{name}", freedom, name)
        for name, (kind, links) in system.joints.items()
        if ground in links and name not in drivers
        for freedom in motions(kind)
    ]
