"""Measures: numbers that follow from the motion of a mechanism, or from its forces; SI, angles in (−π, π].

`model.measure_table.MEASURES` is the vocabulary, one entry a kind. `CURVES` has the course of each: the one or more
numbers, position by position, that its figure is made of (`figures`); a function of a `Backward` if it needs forces,
else of a `Forward`. Floats, arrays or dual numbers flow through, as the values of the mechanism are.
"""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from trunnion.algebra.dual import Dual, primal
from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.vector import cross, dot
from trunnion.errors import Finding, MechanismError
from trunnion.groups.dyad import DyadPose
from trunnion.model.checks.tolerances import check_measure
from trunnion.model.expression import Expression
from trunnion.model.fields import course_kind, operands
from trunnion.model.measure_table import MEASURES, STATISTICS, MeasureKind
from trunnion.model.measure_table import Measure as Stated
from trunnion.model.mechanism import Mechanism
from trunnion.model.names import nearest
from trunnion.solve.backward import Backward, pose_status
from trunnion.solve.contacts import loads_on_ends
from trunnion.solve.forward import Forward, SpatialWalk
from trunnion.solve.friction_method import MARGIN
from trunnion.solve.loads import NOTHING_USEFUL, STATE_USEFUL, has_useful_work, springs, useful_powers
from trunnion.solve.margin import locking_margin as multiple_that_locks
from trunnion.solve.run import Run, prepare
from trunnion.solve.switches import near, turned
from trunnion.solve.system import System, Values

Array = NDArray[np.float64]

AXES = ("x", "y", "z")
MOTIONS = ("point", "angle", "rotation", "slide")  # kinds of measures of which `value` is the one number


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
    kinds, formula = mechanism.parameter_kinds(), None
    if entry.formula is not None:  # it needs what the most demanding of its parts does
        parts, inner = dict[str, Measure](), dict[str, Formula]()
        for operand, stated in operands(mechanism, entry).items():
            part = stated and _measure(operand, stated, values, mechanism)
            if part and part.formula:
                inner[operand] = part.formula
                parts |= part.formula.parts
            elif part:
                parts[operand] = part
        needs = max((part.of.needs for part in parts.values()), key=("places", "motion", "forces").index)
        kind = replace(MEASURES["expression"], quantity=course_kind(mechanism, entry), needs=needs)
        formula = Formula(entry.formula, parts, inner, kind)
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
        formula=formula,
    )  # fmt: skip


def outputs(system: System) -> list[Measure]:
    """Rotation and slide of every joint to the ground that is not driven."""
    ground, drivers = system.mechanism.fixed_link, system.mechanism.drivers
    return [
        Measure(f"{freedom}:{name}", freedom, name)
        for name, joint in system.joints.items()
        if ground in joint.links and name not in drivers
        for freedom in joint.pair.motions
    ]


# ---- the courses ----------------------------------------------------------------------------------------------


def _component(measure: Measure, vector: Any) -> Number:
    """The component of a vector that is asked for, or its magnitude, which has no derivative where it is 0."""
    if measure.axis:
        return vector[AXES.index(measure.axis)]
    total: Number = 0.0
    if measure.along:
        length = sum(part * part for part in measure.along) ** 0.5
        for share, part in zip(measure.along, vector, strict=True):
            total = total + share / length * part
        return total
    for part in vector:
        total = total + part * part
    return namespace(total).sqrt(total)


def value(measure: Measure, walk: Forward) -> Number:
    """The number of a measure of MOTIONS, m or rad.

    The turn of a link in space is that from the real part of its frame, which has a derivative only: ½ Σ eᵢ⁰ × eᵢ along
    the axis.
    """
    if measure.kind == "point":
        return _component(measure, walk.point(*measure.subject.split(".")).place)
    if measure.kind != "angle":
        return walk.coordinates(measure.subject)[("rotation", "slide").index(measure.kind)]
    frame = walk.motions[measure.subject].frame
    if not isinstance(walk, SpatialWalk):
        return namespace(frame.c, frame.s).arctan2(frame.s, frame.c)
    crosses = [cross(tuple(primal(number) for number in axis), axis) for axis in frame[:3]]
    return _component(measure, tuple(0.5 * (a + b + c) for a, b, c in zip(*crosses, strict=True)))


def _turn_or_slide(of: str) -> Callable[[Measure, Forward], Number]:
    """Of what a joint has `of` its rotation and of its slide the former, the latter if it does not turn."""
    return lambda measure, walk: getattr(walk, of)(measure.subject)[0 if walk.system.turns(measure.subject) else 1]


def _of_point(of: str) -> Callable[[Measure, Forward], Number]:
    """A component of the velocity or acceleration of a point."""
    return lambda measure, walk: _component(measure, getattr(walk.point(*measure.subject.split(".")), of))


def _path(measure: Measure, walk: Forward) -> tuple[Number, ...]:
    """The coordinates of a point."""
    return tuple(walk.point(*measure.subject.split(".")).place)


def _of_link(of: str) -> Callable[[Measure, Forward], Number]:
    """Angular velocity or acceleration of a link; in the plane counterclockwise."""

    def spin(measure: Measure, walk: Forward) -> Number:
        twist: Any = getattr(walk.motions[measure.subject], of)
        return twist.w if hasattr(twist, "w") else _component(measure, twist.u)

    return spin


def _of_spring(of: str) -> Callable[[Measure, Forward], Number]:
    """Force or elongation of a spring."""
    return lambda measure, walk: next(getattr(state, of) for name, _, state in springs(walk) if name == measure.subject)


# ---- how well a dyad passes force on --------------------------------------------------------------------------


def _pressure_angle(pose: DyadPose) -> Number:
    """Pressure angle φ of a dyad from its pose, rad in −π/2 … π/2.

    The angle between the force that the first link puts on the second, had the first neither friction nor loads,
    and the velocity of the point of the second that it acts on, against the link that holds the second. But for RPP
    it is the same the other way round. cos φ is 2 over the condition number of the dyad. With its joints B, C, D:

    RRR   force along BC, velocity of C across DC: sin φ = cos(BC, DC), positive where the angle at C is acute
    RRP   force along BC, velocity along the guide u: sin φ = p/|BC|, C being p to the left of the line along u by B
    RPR   force across the slide, through B, velocity across BD: sin φ = e/|BD|, D being e to the left of that line
    PRP, RPP   force across the one guide u, velocity along the other v: sin φ = cos(u, v)

    Source: R. L. Norton, Design of Machinery, "Transmission angle" (π/2 less |φ|) and "Pressure angle".
    """
    moves = 1 / pose.area
    xp = namespace(pose.lost, moves)
    return xp.arctan2(pose.lost, xp.abs(moves))


def _dyads(walk: Forward) -> dict[tuple[str, ...], DyadPose]:
    """The pose of every dyad by its joints."""
    modules = zip(walk.system.plan.modules, walk.poses, strict=True)
    return {tuple(module.joints): pose for module, pose in modules if isinstance(pose, DyadPose)}


@np.errstate(all="ignore")
def pressure_angles(walk: Forward) -> dict[str, Number]:
    """Pressure angle of every dyad along a walk in the plane, by its joints' names."""
    return {"-".join(joints): _pressure_angle(pose) for joints, pose in _dyads(walk).items()}


@np.errstate(all="ignore")
def _pressure_at(measure: Measure, walk: Forward) -> Number:
    """Pressure angle of the dyad that a joint is of; MechanismError if it is of none."""
    poses = {joint: pose for joints, pose in _dyads(walk).items() for joint in joints}
    if measure.subject not in poses:
        what = f"'{measure.subject}' is no joint of a dyad, which alone has a transmission angle"
        those = f"those of a dyad are {', '.join(poses)}" if poses else "this mechanism has no dyad"
        raise MechanismError(Finding(what, f"joints.{measure.subject}", those))
    return _pressure_angle(poses[measure.subject])


def _transmission_angle(measure: Measure, walk: Forward) -> Number:
    """Rad in 0 … π/2: of an RRR the angle at its inner pin, folded to be acute."""
    angle = _pressure_at(measure, walk)
    return np.pi / 2 - namespace(angle).abs(angle)


# ---- of the forces --------------------------------------------------------------------------------------------


def _load(measure: Measure, back: Backward) -> Number:
    """Torque or force of a load on a joint against the joint's positive sense; NaN where the joint rests.

    Times the speed of the joint it is the power that the load takes.
    """
    load = back.walk.system.mechanism.loads[measure.subject]
    speed = back.walk.rates(load.joint or "")[0 if load.resisting_torque is not None else 1]
    xp = namespace(speed)
    return -back.load_powers[measure.subject] / xp.where(primal(speed) != 0, speed, np.nan)


def _reaction(measure: Measure, back: Backward) -> Number:
    """Force in a joint without friction and drive effort."""
    load: Any = back.reactions[measure.subject]
    return _component(measure, (load.x, load.y) if hasattr(load, "x") else load.u)


def _end_load(measure: Measure, back: Backward) -> Number:
    """The largest of |F⊥/2 ∓ g| with g = M⊥ × u/L, N: what presses on the ends of a bearing or guide of the length L.

    It is the load that friction with two contacts counts, see `joints.contact_loads`.
    """
    joint = measure.subject
    loads = loads_on_ends(back.walk, joint, back.reactions[joint], back.friction_wrenches[joint])
    squares = [dot(load, load) for load in loads]
    largest = functools.reduce(namespace(*squares).maximum, squares)
    loaded = primal(largest) > 0
    xp = namespace(largest)
    return xp.where(loaded, xp.sqrt(xp.where(loaded, largest, 1.0)), 0.0)


def _power(measure: Measure, back: Backward) -> Number:
    """What a driver, or a load, gives the mechanism."""
    name = measure.subject
    return back.efforts[name] * back.walk.rate(name) if name in back.efforts else back.load_powers[name]


def _friction_energy(measure: Measure, back: Backward) -> tuple[Number, ...]:
    """Power lost to friction in a joint, W, and how long the first driver takes for its cycle, s."""
    walk = back.walk
    driver = next(iter(walk.system.mechanism.drivers), "")
    duration: Number = walk.system.span(walk.values, driver).duration if driver else 0.0
    return back.losses[measure.subject], duration


def _efficiency(measure: Measure, back: Backward) -> Number | tuple[Number, ...]:
    """Useful and drive power, W; of an instant their ratio, NaN where nothing is useful or the drivers put no power
    in."""
    walk = back.walk
    useful: Number = 0.0 if has_useful_work(walk.system.mechanism) else np.nan
    driven: Number = 0.0
    for power_in in useful_powers(walk, back.load_powers, back.springs):
        useful = useful - power_in
    for name in walk.system.mechanism.drivers:
        driven = driven + back.efforts[name] * walk.rate(name)
    if measure.subject == "cycle":
        return useful, driven
    return useful / namespace(driven).where(driven > 0, driven, np.nan)


def _locking_margin(measure: Measure, back: Backward) -> Number:
    """Multiple of the friction at which a module locks, MARGIN where it does not up to there.

    The search for it has no derivatives: they are NaN where dual numbers ask for some below MARGIN.
    """
    margin: Number = np.minimum(multiple_that_locks(back), MARGIN)
    forces: Number = functools.reduce(operator.add, (*back.friction.values(), *back.efforts.values()), 0.0)
    return Dual(margin, np.where(margin < MARGIN, np.nan, 0.0)) if isinstance(forces, Dual) else margin


CURVES: dict[str, Callable[[Measure, Any], Number | tuple[Number, ...]]] = {
    "point": value,
    "path_error": _path,
    "straightness": _path,
    # in space the axes of the link's frame, nine numbers
    "angle": lambda measure, walk: (
        tuple(number for axis in walk.motions[measure.subject].frame[:3] for number in axis)
        if isinstance(walk, SpatialWalk)
        else value(measure, walk)
    ),
    "rotation": value,
    "slide": value,
    **dict.fromkeys(("transmission_error", "stroke", "dead_centre", "time_ratio"), _turn_or_slide("coordinates")),
    "rate": _turn_or_slide("rates"),
    "joint_acceleration": _turn_or_slide("second_rates"),
    "velocity": _of_point("velocity"),
    "acceleration": _of_point("acceleration"),
    "angular_velocity": _of_link("twist"),
    "angular_acceleration": _of_link("acceleration"),
    "transmission_angle": _transmission_angle,
    "pressure_angle": _pressure_at,
    "effort": lambda measure, back: back.efforts[measure.subject],
    "load": _load,
    "spring_force": _of_spring("force"),
    "spring_elongation": _of_spring("elongation"),
    "reaction": _reaction,
    "end_load": _end_load,
    "power": _power,
    "friction_power": lambda measure, back: back.losses[measure.subject],
    "friction_energy": _friction_energy,
    "efficiency": _efficiency,
    "locking_margin": _locking_margin,
    # of a motion in time, which is no course over a cycle: see `dynamics.measured`
    **dict.fromkeys(("starting_time", "steady_speed", "fluctuation", "peak_effort"), lambda measure, walk: np.nan),
}


# ---- angles without jumps: by how many whole turns those of a mechanism, in (−π, π], are off --------------------


def within(run: Run, times: Number) -> Number:
    """Times within the cycle, s, of such as may run over its end."""
    if not run.cycle.periodic or run.cycle.duration <= 0:
        return times
    real = primal(times) % run.cycle.duration
    return Dual(real, times.dual) if isinstance(times, Dual) else real


def rate_of_angle(angle: Measure, walk: Forward) -> Number:
    """Rate of the angle of a link in the plane, or of the rotation of a joint, rad/s."""
    if angle.kind == "rotation":
        return walk.rates(angle.subject)[0]
    return CURVES["angular_velocity"](angle, walk)


def angles(run: Run, turning: Mapping[str, Measure], span: tuple[float, float]) -> dict[str, tuple[Array, Array]]:
    """Times, s, and angles of the nominal mechanism over a span, by name: integrals of their rates."""
    if not turning:
        return {}

    def look(time: Array) -> tuple[Array, NDArray[np.integer]]:
        walk = run.walk(within(run, time))
        speeds = [np.asarray(primal(rate_of_angle(angle, walk)), float) for angle in turning.values()]
        return np.array(np.broadcast_arrays(*speeds, time)[:-1]), pose_status(walk, time.shape)

    knots = np.array([bend.time for bend in run.bends if bend.scan < 0])

    def firsts(times: Array) -> list[Number]:
        walk = run.walk(within(run, times))
        return [value(angle, walk) for angle in turning.values()]

    return dict(zip(turning, turned(run.cycle, look, firsts, knots, span), strict=True))


def angle_at(run: Run, angle: Measure, time: Array) -> Array:
    """An angle of the nominal mechanism at times of its cycle, s, that goes on from its start."""
    key = ("angle without jumps", angle.kind, angle.subject)
    table = run.once(key, lambda: angles(run, {"": angle}, (0.0, run.cycle.duration))[""])
    return np.asarray(np.interp(time, *table))
