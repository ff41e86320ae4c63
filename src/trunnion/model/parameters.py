"""The flat set of named numbers that a mechanism is to the analysis.

Every number has a path such as `links.crank.points.B.x` or `joints.B.friction.coefficient`. The set is compiled
once: which numbers depend on which dimensions, and in what order. Evaluating it with other values of some is
then cheap, and arrays (sample, 1) or dual numbers flow through the expressions of the file."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from typing import Any

from pydantic import BaseModel

from trunnion.algebra.namespace import Number
from trunnion.errors import MechanismError
from trunnion.joints.friction import FRICTION_LAWS
from trunnion.model.entry import ReadOnlyDict
from trunnion.model.expression import MOTION, PLACED
from trunnion.model.fields import Fields, course_kind, dimension_kinds, drive_kind, part_turns, place_kind
from trunnion.model.joint_parts import DEFAULT_LAW, Contact, Friction, Joint, Losses
from trunnion.model.names import ERRORS, ParameterNames
from trunnion.model.parts import AT, Driver, Gear, Point
from trunnion.model.quantity import Quantity, evaluation_order
from trunnion.model.rules import Within, markers
from trunnion.model.tolerance_parts import Limits, Variation
from trunnion.model.units import ANY, KINDS, Kind, unit

Location = tuple[str | int, ...]
Rules = tuple[Any, ...]  # of model.rules
LIMITS = ("lower", "upper")


@dataclass(frozen=True)
class Entry:
    """One named number: its path, where it stands in the model's sections, what was written, what it measures.

    alias: path of the number it follows while it has no value of its own (a default of all joints).
    error: path of the deviation that is added to it.
    varies: it speaks of the motion: not a number of the set until an override makes it one, but an expression that
    the analysis evaluates at every position.
    rules: what it must be, by its field; a deviation has none.
    """

    path: str
    location: Location
    quantity: Quantity
    kind: Kind
    alias: str = ""
    varies: bool = False
    error: str = ""
    rules: Rules = ()

    @property
    def depends(self) -> tuple[str, ...]:
        """Paths of the numbers that it is computed from."""
        names = (self.alias,) if self.alias else tuple(f"dimensions.{name}" for name in self.quantity.names)
        return (*names, self.error) if self.error else names

    @property
    def where(self) -> str:
        """Where a finding about it points: to a deviation as it was written, to both limits as to one."""
        if self.path.startswith(ERRORS):
            return f"{ERRORS}{self.location[1]}"
        return self.path.rpartition(".")[0] if self.is_limit else self.path

    @property
    def is_limit(self) -> bool:
        """Whether it is one of two limits, and no dimension of that name."""
        return self.location[-1] in LIMITS and self.location[0] != "dimensions"


def _numbers(mechanism: Fields) -> Iterator[Entry]:
    """Every number of a mechanism but its errors."""
    yield from walk(mechanism.dimensions, "dimensions", ("dimensions",))
    for entry in walk(mechanism.joint_defaults, "joint_defaults", ("joint_defaults",)):
        friction = mechanism.joint_defaults.friction if entry.location[1] == "friction" else None
        yield _of_law(friction, entry) if friction else entry
    size = mechanism.coordinates
    yield from walk(mechanism.gravity or (Quantity(0, KINDS["acceleration"]),) * size, "gravity", ("gravity",))
    for name, link in mechanism.effective_links.items():
        for entry in walk(link, f"links.{name}", ("links", name)):
            if size == 2 or entry.location[-1] != "inertia" or "inertia" in link.model_fields_set:
                yield entry  # a spatial link has a tensor or nothing, never one number
        if link.centre is None:
            yield from walk((Quantity(0, KINDS["length"]),) * size, f"links.{name}.centre", ("links", name, "centre"))
    for row, loop_joint in enumerate(mechanism.loop):
        for key in ("twist", "distance", "slide", "rotation"):
            yield from walk(getattr(loop_joint, key), f"loop.{loop_joint.joint}.{key}", ("loop", row, key))
    for name, joint in mechanism.effective_joints.items():
        yield from _joint_entries(mechanism, name, joint)
    moving = {*MOTION, *mechanism.tables}
    for section in ("gears", "drivers", "tables", "loads", "springs", "assembly", "measures"):
        for name, part in getattr(mechanism, section).items():
            complete = part.complete() if isinstance(part, Driver | Gear) else part
            turns = part_turns(mechanism, section, name)
            for entry in walk(complete, f"{section}.{name}", (section, name)):
                spoken = entry.quantity.names if section == "loads" else ()
                varies = any(operand in moving or PLACED in operand for operand in spoken)
                signed = section == "springs" and part.between is None and entry.location[-1] == "free_length"
                rules = () if signed else entry.rules  # a length along a slide has a sign
                kind = _kind_in_place(mechanism, section, part, turns, entry)
                yield replace(entry, kind=kind, varies=varies, rules=rules)


def _kind_in_place(mechanism: Fields, section: str, part: Any, turns: bool | None, entry: Entry) -> Kind:
    """The kind that the place of an entry leaves of several: a slide is driven at a speed, a rotation at rad/s."""
    key = entry.location[2] if len(entry.location) > 2 else ""
    if section == "measures":
        if key in ("along", "duration"):
            return KINDS["time"] if key == "duration" else entry.kind
        if key == "within":
            return course_kind(mechanism, part)
        of_place = part.kind == "dead_centre" or (part.statistic or "").startswith("place-of-")
        if key not in ("at", "over") and not of_place:
            shares = part.statistic == "dwell" or part.kind == "time_ratio"
            return KINDS["number"] if shares else course_kind(mechanism, part)
        kinds = dimension_kinds(mechanism) if entry.quantity.names else {}
        return place_kind(mechanism, entry.quantity, {name: kind.dimensions[0] for name, kind in kinds.items()})
    if section == "tables":
        place = entry.location[-1] in (0, "period")
        return (KINDS["time"] if part.over == "time" else drive_kind(mechanism)) if place else ANY
    if section == "assembly" and entry.location[1] == AT and turns is None:
        return drive_kind(mechanism)
    if key == "motor" and entry.path.endswith(".place") and turns is not None:
        return KINDS["time" if part.motor.over == "time" else "angular speed" if turns else "speed"]
    return entry.kind if turns is None else entry.kind.of(turns)


def walk(value: object, path: str, location: Location, rules: Rules = ()) -> Iterator[Entry]:
    """The quantities below a part of the model; coordinates are x, y, z and the position of a point is itself.

    rules: those of the field.
    """
    match value:
        case Quantity():
            yield Entry(path, location, value, value.kind, rules=rules)
        case Limits():
            for key in LIMITS:
                yield from walk(getattr(value, key), f"{path}.{key}", (*location, key))
        case BaseModel():
            extra = value.parameters.items() if isinstance(value, Friction) else ()
            field_rules = markers(type(value))
            for key, item in (*((key, getattr(value, key)) for key in type(value).model_fields), *extra):
                if item is None or isinstance(item, str):
                    continue  # most of what could be stated is not
                itself = (isinstance(value, Point) and key == "at") or (
                    isinstance(value, Variation) and key == "limits"
                )
                below = path if itself else f"{path}.{key}"
                yield from walk(item, below, (*location, key), field_rules.get(key, ()))
        case Mapping():
            for key, item in value.items():
                yield from walk(item, f"{path}.{key}", (*location, key))
        case tuple():
            for index, item in enumerate(value):
                yield from walk(item, f"{path}.{item_name(location, index)}", (*location, index))


# by the key of a list, what its items are called, if not coordinates; of a row of points by what has the points
_NAMES = {
    **dict.fromkeys(("points", "references", "links", "joints", "between", "loop", "correlations", "of", "values",
                     "files", "faults", "conditions"), ()),
    **dict.fromkeys(("range", "over", "within"), ("from", "to")),
    "rows of tables": ("at", "value"), "rows of motor": ("place", "effort"), "rows": ("time", "coordinate"),
}  # fmt: skip


def item_name(location: Location, index: int) -> str:
    """What an item of the list at a location is called in a path: a coordinate, an end, or its number."""
    key = location[-1]
    if isinstance(key, int) and location[-2:-1] == ("points",):
        of = "tables" if location[0] == "tables" else "motor" if "motor" in location else ""
        key = f"rows of {of}" if of else "rows"
    names = _NAMES.get(str(key), ("x", "y", "z"))
    return names[index] if index < len(names) else str(index)


def _joint_entries(mechanism: Fields, name: str, joint: Joint) -> Iterator[Entry]:
    """Numbers of a joint with its defaults: what is not its own follows `joint_defaults`."""
    rows, path = [row.joint for row in mechanism.loop], f"joints.{name}"
    location: Location = ("loop", rows.index(name)) if name in rows else ("joints", name)
    shared = {entry.path: entry.quantity for entry in walk(mechanism.joint_defaults, path, ())}
    for key in ("pitch", "pin", "guide", "friction", "losses", "stiffness", "seat", "contact", "misalignment"):
        part = getattr(joint, key)
        for entry in walk(part, f"{path}.{key}", (*location, key), markers(Joint)[key]):
            if isinstance(part, Friction):
                entry = _of_law(part, entry)
            elif isinstance(part, Losses):
                entry = replace(entry, kind=entry.kind.of(joint.pair.turns))
            elif isinstance(part, Contact) and entry.location[-1] == "stiffness":  # K of F = K dⁿ
                kind = ANY  # where the exponent depends on dimensions
                if part.exponent is not None and not part.exponent.names:
                    power = Fraction(str(part.exponent.evaluate())).limit_denominator(1000)
                    text = f"N/m^{float(power):g}" if power != 1 else "N/m"
                    dimension = (1 - power, Fraction(1), Fraction(-2), Fraction(0))
                    kind = Kind("contact stiffness", text, f"60e9 {text}", (dimension,))
                entry = replace(entry, kind=kind)
            follows = shared.get(entry.path) is entry.quantity
            yield replace(entry, alias=f"joint_defaults.{entry.path.removeprefix(f'{path}.')}") if follows else entry
    pin, misalignment = joint.pin, joint.misalignment
    if misalignment and misalignment.towards and misalignment.offset_towards is None:  # it follows that of the tilt
        below, towards = f"{path}.misalignment", misalignment.towards
        where = (*location, "misalignment", "offset_towards")
        yield Entry(f"{below}.offset_towards", where, towards, towards.kind, f"{below}.towards")
    if pin and pin.length and not pin.bearing:
        length, where = pin.length, (*location, "pin", "bearing")
        yield Entry(f"{path}.pin.bearing", where, length, length.kind, f"{path}.pin.length")


def _of_law(friction: Friction, entry: Entry) -> Entry:
    """A parameter of a friction law with what it measures and its range, by the law's own declaration."""
    parameter = str(entry.location[-1])
    declared = FRICTION_LAWS[friction.law or DEFAULT_LAW].parameters.get(parameter)
    if declared is None:
        return replace(entry, kind=ANY)
    law_unit = declared.unit or "1"
    usual = next((kind for kind in KINDS.values() if kind.unit == law_unit), None)
    kind = usual or Kind(parameter, law_unit, f"1 {law_unit}", (unit(law_unit)[1],))
    ends = "(]" if parameter == "pair_factor" else "[]"  # at 0 there would be no friction, which is stated as such
    return replace(entry, kind=kind, rules=(Within(declared.minimum, declared.maximum, ends),))


def dimension_errors(entries: Iterable[Entry]) -> dict[str, Quantity]:
    """Deviations of dimensions by the name of the dimension."""
    before = f"{ERRORS}dimensions."
    return {entry.path.removeprefix(before): entry.quantity for entry in entries if entry.path.startswith(before)}


def measured(mechanism: Fields, entries: Iterable[Entry]) -> dict[str, Kind]:
    """What each number measures, by path: of a dimension, as far as its value tells."""
    of_dimensions = {f"dimensions.{name}": kind for name, kind in dimension_kinds(mechanism).items()}
    kinds = {entry.path: of_dimensions.get(entry.path, entry.kind) for entry in entries}
    deviations = {path: kinds.get(path.removeprefix(ERRORS)) for path in kinds if path.startswith(ERRORS)}
    return {**kinds, **{path: kind for path, kind in deviations.items() if kind}}


class ParameterSet:
    """The numbers of one mechanism, compiled.

    nominal: values by path; dimension_values: those of the dimensions by name; errors: paths of the deviations, and of
    the tilts and offsets of axes, all 0 in the ideal mechanism; resolve: the path that a name means.
    """

    def __init__(self, entries: Iterable[Entry], dimensions: Mapping[str, Quantity]) -> None:
        listed = list(entries)
        order, _ = evaluation_order(dimensions, dimension_errors(listed))
        place = {f"dimensions.{name}": rank for rank, name in enumerate(order)}
        last = len(place)

        def rank(entry: Entry) -> tuple[int, bool]:
            """Dimensions in their order, then the rest; a deviation goes before what it shifts."""
            deviates = entry.path.startswith(ERRORS)
            return place.get(entry.path.removeprefix(ERRORS) if deviates else entry.path, last), not deviates

        listed.sort(key=rank)  # stable: the rest keeps its order
        self.entries: dict[str, Entry] = {entry.path: entry for entry in listed}
        self.resolve = ParameterNames(self.entries).resolve
        numbers = [entry for entry in self.entries.values() if not entry.varies]
        self._dependent = [entry for entry in numbers if entry.depends]
        misaligned = re.compile(r"joints\..*\.misalignment\.(tilt|offset)")
        self.errors = tuple(entry.path for entry in numbers
                            if entry.path.startswith(ERRORS) or misaligned.fullmatch(entry.path))  # fmt: skip
        self.nominal: dict[str, Number] = {}
        self.dimension_values: dict[str, Number] = {}
        for entry in numbers:
            self._evaluate(entry, self.nominal, self.dimension_values)
        self.entries, self.nominal = ReadOnlyDict(self.entries), ReadOnlyDict(self.nominal)

    def value(self, quantity: Quantity | None, absent: float = 0.0) -> float:
        """The nominal value of a quantity that speaks of the dimensions and is no number of the set."""
        return absent if quantity is None else float(quantity.evaluate(self.dimension_values))

    def stated(self, path: str) -> Number:
        """A number as it was stated, without the error that is added to it."""
        entry = self.entries[path]
        return self.evaluate({entry.error: 0.0} if entry.error else None)[path]

    def ideal(self, overrides: Mapping[str, Number] | None = None) -> dict[str, Number]:
        """Every number as `evaluate` gives it, without errors."""
        return self.evaluate({**(overrides or {}), **dict.fromkeys(self.errors, 0.0)})

    def evaluate(
        self, overrides: Mapping[str, Number] | None = None, deviations: Mapping[str, Number] | None = None
    ) -> dict[str, Number]:
        """Every number in SI by path, some replaced; MechanismError if a name is unknown or not unique.

        deviations: what is added to some, by name. A number that follows from others goes on to do so, unlike one
        that is replaced; what depends on it has the sum.
        """
        values = dict(self.nominal)
        if not overrides and not deviations:
            return values
        changed = {self.resolve(name): value for name, value in (overrides or {}).items()}
        added = {self.resolve(name): value for name, value in (deviations or {}).items()}
        names = dict(self.dimension_values)
        for path in {**changed, **added}:
            value = changed[path] if path in changed else values[path]
            _put(path, value + added[path] if path in added else value, values, names)
        touched = {*changed, *added}
        for entry in self._dependent:
            if entry.path not in changed and not touched.isdisjoint(entry.depends):
                self._evaluate(entry, values, names)
                if entry.path in added:
                    _put(entry.path, values[entry.path] + added[entry.path], values, names)
                touched.add(entry.path)
        return values

    def _evaluate(self, entry: Entry, values: dict[str, Number], names: dict[str, Number]) -> None:
        value = values[entry.alias] if entry.alias else entry.quantity.evaluate(names)
        if entry.error:
            value = value + values[entry.error]
        _put(entry.path, value, values, names)


def _put(path: str, value: Number, values: dict[str, Number], names: dict[str, Number]) -> None:
    """A value at its path, and by its name if it is a dimension."""
    values[path] = value
    section, _, name = path.partition(".")
    if section == "dimensions":
        names[name] = value


class Numbers(Fields):
    """A model with its numbers by path. Checks, tolerances and prices read it; `Mechanism` is one that is sound."""

    @cached_property
    def entries(self) -> tuple[Entry, ...]:
        """Every number of the mechanism, defaults filled in; what an entry follows comes before it, dimensions apart.

        Last come the deviations that the model states of them; those whose name means no number are left out.
        """
        numbers = {entry.path: entry for entry in _numbers(self)}
        names, dimensions = ParameterNames(numbers), dimension_kinds(self) if self.errors else {}
        errors: dict[str, Entry] = {}
        for name, quantity in self.errors.items():
            with suppress(MechanismError):  # a finding of its own
                path = names.resolve(name)
                kind = dimensions.get(path.removeprefix("dimensions."), numbers[path].kind)
                errors[path] = Entry(f"{ERRORS}{path}", ("errors", name), quantity, kind)
        shifted = {path: replace(numbers[path], error=error.path) for path, error in errors.items()}
        return (*{**numbers, **shifted}.values(), *errors.values())

    @cached_property
    def parameter_names(self) -> ParameterNames:
        """Their names, also where not every number has a value."""
        return ParameterNames(entry.path for entry in self.entries)

    @cached_property
    def parameter_set(self) -> ParameterSet:
        """The numbers of the mechanism, compiled once."""
        return ParameterSet(self.entries, self.dimensions)
