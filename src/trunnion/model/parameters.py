"""The flat set of named numbers that a mechanism is to the analysis.

Every number has a path such as `links.crank.points.B.x` or `joints.B.friction.coefficient`. The set is compiled
once: which numbers depend on which dimensions, and in what order. Evaluating it with other values of some is
then cheap, and arrays (sample, 1) or dual numbers flow through the expressions of the file.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import BaseModel

from trunnion.algebra.namespace import Number
from trunnion.errors import Finding, MechanismError
from trunnion.joints.friction import FRICTION_LAWS
from trunnion.joints.pairs import PAIRS
from trunnion.model.contact import contact_lacks, has_guide, has_pin
from trunnion.model.expression import MOTION
from trunnion.model.names import nearest
from trunnion.model.parts import (
    Driver,
    Friction,
    Gear,
    Guide,
    Joint,
    JointDefaults,
    Measure,
    Pin,
    Point,
    Spring,
    freedoms,
)
from trunnion.model.quantity import Quantity
from trunnion.model.units import ANY, KINDS, Kind, unit

if TYPE_CHECKING:
    from trunnion.model.mechanism import Mechanism

__all__ = ["Entry", "ParameterSet", "entries", "evaluation_order", "merge_joint"]

DEFAULT_LAW = "coulomb"
NO_FRICTION = Quantity(0)
Location = tuple[str | int, ...]


@dataclass(frozen=True)
class Entry:
    """One named number: its path, where it stands in the model's sections, what was written, what it measures.

    alias: path of the number it follows while it has no value of its own (a default of all joints).
    varies: it speaks of the motion: not a number of the set until an override makes it one, but an expression that
    the analysis evaluates at every position.
    """

    path: str
    location: Location
    quantity: Quantity
    kind: Kind
    alias: str = ""
    varies: bool = False

    @property
    def depends(self) -> tuple[str, ...]:
        """Paths of the numbers that it is computed from."""
        return (self.alias,) if self.alias else tuple(f"dimensions.{name}" for name in self.quantity.names)


def entries(mechanism: Mechanism) -> Iterator[Entry]:
    """Every number of a mechanism, defaults filled in; what an entry follows comes before it, dimensions apart."""
    yield from _walk(mechanism.dimensions, "dimensions", ("dimensions",))
    for entry in _walk(mechanism.joint_defaults, "joint_defaults", ("joint_defaults",)):
        friction = mechanism.joint_defaults.friction if entry.location[1] == "friction" else None
        kind = _law_kind(friction, str(entry.location[-1])) if friction else entry.kind
        yield Entry(entry.path, entry.location, entry.quantity, kind)
    zero = Quantity(0, KINDS["acceleration"])
    size = mechanism.coordinates
    yield from _walk(mechanism.gravity or (zero,) * size, "gravity", ("gravity",))
    for name, link in mechanism.effective_links.items():
        for entry in _walk(link, f"links.{name}", ("links", name)):
            if size == 2 or entry.location[-1] != "inertia" or "inertia" in link.model_fields_set:
                yield entry  # a spatial link has a tensor or nothing, never one number
        if link.centre is None:
            origin = (Quantity(0, KINDS["length"]),) * size
            yield from _walk(origin, f"links.{name}.centre", ("links", name, "centre"))
    for row, loop_joint in enumerate(mechanism.loop):
        for key in ("twist", "distance", "slide", "rotation"):
            yield from _walk(getattr(loop_joint, key), f"loop.{loop_joint.joint}.{key}", ("loop", row, key))
    for name, joint in mechanism.effective_joints.items():
        yield from _joint_entries(mechanism, name, joint)
    for section in ("gears", "drivers", "tables", "loads", "springs", "assembly", "measures"):
        for name, part in getattr(mechanism, section).items():
            stated = part.complete() if isinstance(part, Driver | Gear) else part
            for entry in _walk(stated, f"{section}.{name}", (section, name)):
                kind = _narrow(mechanism, section, name, entry)
                varies = section == "loads" and not {*MOTION, *mechanism.tables}.isdisjoint(entry.quantity.names)
                yield Entry(entry.path, entry.location, entry.quantity, kind, varies=varies)


def _walk(value: object, path: str, location: Location) -> Iterator[Entry]:
    """The quantities below a part of the model; coordinates are x, y, z and the position of a point is itself."""
    match value:
        case Quantity():
            yield Entry(path, location, value, value.kind)
        case BaseModel():
            extra = value.parameters.items() if isinstance(value, Friction) else ()
            for key, item in (*((key, getattr(value, key)) for key in type(value).model_fields), *extra):
                below = path if isinstance(value, Point) and key == "at" else f"{path}.{key}"
                yield from _walk(item, below, (*location, key))
        case Mapping():
            for key, item in value.items():
                yield from _walk(item, f"{path}.{key}", (*location, key))
        case tuple():
            for index, item in enumerate(value):
                yield from _walk(item, f"{path}.{item_name(location, index)}", (*location, index))


_LISTS = ("points", "references", "links", "joints", "between", "loop")  # of anything but coordinates


def item_name(location: Location, index: int) -> str:
    """What an item of the list at a location is called in a path: a coordinate, an end, or its number."""
    if location[-1] in _LISTS:
        return str(index)
    row = len(location) > 1 and location[-2] == "points" and isinstance(location[-1], int)
    if row and location[0] == "tables":
        return ("at", "value")[index] if index < 2 else str(index)
    names = ("time", "coordinate") if row else ("from", "to") if location[-1] == "range" else ("x", "y", "z")
    return names[index] if index < len(names) else str(index)


def _joint_entries(mechanism: Mechanism, name: str, joint: Joint) -> Iterator[Entry]:
    """Numbers of a joint with its defaults: what is not its own follows `joint_defaults`."""
    rows = [row.joint for row in mechanism.loop]
    location: Location = ("loop", rows.index(name)) if name in rows else ("joints", name)
    yield from _walk(joint.pitch, f"joints.{name}.pitch", (*location, "pitch"))
    for key in ("pin", "guide", "friction"):
        part, default = getattr(joint, key), getattr(mechanism.joint_defaults, key)
        for entry in _walk(part, f"joints.{name}.{key}", (*location, key)):
            leaf = str(entry.location[-1])
            shared = _stated(default).get(leaf) is entry.quantity
            kind = _law_kind(part, leaf) if isinstance(part, Friction) else entry.kind
            alias = f"joint_defaults.{key}.{leaf}" if shared else ""
            yield Entry(entry.path, entry.location, entry.quantity, kind, alias)
    pin = joint.pin
    if pin and pin.length and not pin.bearing:
        path = f"joints.{name}.pin"
        yield Entry(f"{path}.bearing", (*location, "pin", "bearing"), pin.length, pin.length.kind, f"{path}.length")


def _stated(part: BaseModel | None) -> Mapping[str, Any]:
    """What was written of a part: its own values by key."""
    return {} if part is None else {key: getattr(part, key) for key in sorted(part.model_fields_set)}


def _law_kind(friction: Friction, parameter: str) -> Kind:
    """What a parameter of a friction law measures, by the law's own declaration."""
    declared = FRICTION_LAWS[friction.law or DEFAULT_LAW].parameters.get(parameter)
    if declared is None:
        return ANY
    wanted = declared.unit or "1"
    known = next((kind for kind in KINDS.values() if kind.unit == wanted), None)
    return known or Kind(parameter, wanted, f"1 {wanted}", (unit(wanted)[1],))


def _narrow(mechanism: Mechanism, section: str, name: str, entry: Entry) -> Kind:
    """The kind that the place of an entry leaves of several: a slide is driven at a speed, a rotation at rad/s."""
    joint = mechanism.effective_joints.get(name)
    if section == "measures":
        measure = mechanism.measures[name]
        return _measure_kind(mechanism, measure)
    if section == "tables":
        return _table_kind(mechanism, name) if entry.location[-1] == 0 else ANY
    if section == "springs":
        return _spring_kind(mechanism, mechanism.springs[name], entry)
    if joint is None or section == "loads" or entry.kind in KINDS.values():
        return entry.kind
    slides = "rotation" not in freedoms(joint.type)
    if entry.location[-1] == "speed":
        return KINDS["speed" if slides else "angular speed"]
    return KINDS["length" if slides else "angle"]


def _table_kind(mechanism: Mechanism, name: str) -> Kind:
    """What the first column of a table measures: a time, or the coordinate of the first driver."""
    if mechanism.tables[name].over == "time":
        return KINDS["time"]
    joint = mechanism.effective_joints.get(next(iter(mechanism.drivers), ""))
    return KINDS["length" if joint and "rotation" not in freedoms(joint.type) else "angle"]


def _spring_kind(mechanism: Mechanism, spring: Spring, entry: Entry) -> Kind:
    """A spring in a joint that turns has a torsional stiffness; every other acts along a line."""
    joint = mechanism.effective_joints.get(spring.joint or "")
    turns = joint is not None and "rotation" in freedoms(joint.type)
    match entry.location[-1]:
        case "stiffness" | "damping" as key:
            return KINDS[f"torsional {key}" if turns else key]
        case "preload":
            return KINDS["moment" if turns else "force"]
    return entry.kind


def _measure_kind(mechanism: Mechanism, measure: Measure) -> Kind:
    if measure.effort is None:
        return KINDS["length" if measure.angle is None and measure.rotation is None else "angle"]
    joint = mechanism.effective_joints.get(measure.effort)
    return KINDS["force" if joint and "rotation" not in freedoms(joint.type) else "moment"]


def merge_joint(joint: Joint, defaults: JointDefaults, spatial: bool = False) -> Joint:
    """A joint with the defaults that apply to its type, its friction complete: law, model and every parameter."""
    pin, guide = joint.pin, joint.guide
    if has_pin(joint.type) and (pin or defaults.pin):
        pin = Pin(**_pin(_stated(defaults.pin), _stated(pin)))
    if has_guide(joint.type) and (guide or defaults.guide):
        guide = Guide(**{**_stated(defaults.guide), **_stated(guide)})
    rubs = PAIRS[joint.type].count > 0  # nothing slips in a fixed joint: it needs no exception from the defaults
    friction = _friction(_stated(defaults.friction) if rubs else {}, _stated(joint.friction))
    merged = joint.model_copy(update={"pin": pin, "guide": guide, "friction": friction})
    if friction and friction.parameters.get("coefficient") == NO_FRICTION:
        touches = has_pin(joint.type) or has_guide(joint.type)
        if not touches or contact_lacks(merged, spatial):
            return merged.model_copy(update={"friction": None})  # friction: 0 asks for no radius or length
    return merged


def _pin(default: Mapping[str, Any], own: Mapping[str, Any]) -> dict[str, Any]:
    """A pin's own values over the defaults; a fit replaces radius and clearance and the other way round."""
    if "fit" in own:
        default = {key: value for key, value in default.items() if key not in ("radius", "clearance")}
    elif own.keys() & {"radius", "clearance"}:
        default = {key: value for key, value in default.items() if key != "fit"}
    merged = {**default, **own}
    if merged.get("fit") and not merged.get("radius"):
        size = merged["fit"].size
        half = size.source / 2 if not isinstance(size.source, str) else f"({size.source}) / 2"
        merged["radius"] = Quantity.read(half, size.kind)
    return merged


def _friction(default: Mapping[str, Any], own: Mapping[str, Any]) -> Friction | None:
    """Friction complete: the joint's own over the file's defaults (those its law knows) over the law's."""
    if not default and not own:
        return None
    law = own.get("law") or default.get("law") or DEFAULT_LAW
    declared = FRICTION_LAWS[law].parameters
    if default.get("law", law) != law:
        default = {key: value for key, value in default.items() if key in declared}
    filled = {key: one.default for key, one in declared.items() if one.default is not None}
    model = own.get("model") or default.get("model") or "two-contact"
    return Friction.model_validate({**filled, **default, **own, "law": law, "model": model})


def evaluation_order(dimensions: Mapping[str, Quantity]) -> tuple[list[str], list[list[str]]]:
    """Dimensions in an order in which each follows those it speaks of, and the circles that have none."""
    graph = {name: {one for one in quantity.names if one in dimensions} for name, quantity in dimensions.items()}
    circles: list[list[str]] = []
    while True:
        try:
            return list(TopologicalSorter(graph).static_order()), circles
        except CycleError as error:
            circle = list(reversed(error.args[1]))[:-1]
            circles.append(circle)
            graph = {name: set() if name in circle else needs for name, needs in graph.items()}


class ParameterSet:
    """The numbers of one mechanism, compiled; `unreadable` paths are nan and so is what depends on them."""

    def __init__(self, mechanism: Mechanism, unreadable: Iterable[str] = ()) -> None:
        found = list(entries(mechanism))
        order, _ = evaluation_order(mechanism.dimensions)
        rank = {f"dimensions.{name}": place for place, name in enumerate(order)}
        found.sort(key=lambda entry: rank.get(entry.path, len(rank)))  # stable: the rest keeps its order
        self.entries: dict[str, Entry] = {entry.path: entry for entry in found}
        self._unreadable = frozenset(unreadable)
        numbers = [entry for entry in self.entries.values() if not entry.varies]
        self._dependent = [entry for entry in numbers if entry.depends]
        self.nominal: dict[str, Number] = {}
        self._nominal_names: dict[str, Number] = {}
        for entry in numbers:
            self._evaluate(entry, self.nominal, self._nominal_names)
        self._endings: dict[str, list[str]] | None = None

    def evaluate(self, overrides: Mapping[str, Number] | None = None) -> dict[str, Number]:
        """Every number in SI by path, some replaced; MechanismError if a name is unknown or not unique."""
        values = dict(self.nominal)
        if not overrides:
            return values
        changed = {self.resolve(name): value for name, value in overrides.items()}
        values.update(changed)
        names = dict(self._nominal_names)
        names.update(
            {path.partition(".")[2]: value for path, value in changed.items() if path.startswith("dimensions.")}
        )
        touched = set(changed)
        for entry in self._dependent:
            if entry.path not in changed and not touched.isdisjoint(entry.depends):
                self._evaluate(entry, values, names)
                touched.add(entry.path)
        return values

    def is_unreadable(self, path: str) -> bool:
        """Whether the path was given as one without a value."""
        return path in self._unreadable

    def _evaluate(self, entry: Entry, values: dict[str, Number], names: dict[str, Number]) -> None:
        value: Number
        if entry.path in self._unreadable:
            value = np.nan
        elif entry.alias:
            value = values[entry.alias]
        else:
            value = entry.quantity.evaluate(names)
        values[entry.path] = value
        section, _, name = entry.path.partition(".")
        if section == "dimensions":
            names[name] = value

    def resolve(self, name: str) -> str:
        """The path that a name means: a path, a dimension, or an ending that only one path has."""
        if name in self.entries:
            return name
        if f"dimensions.{name}" in self.entries:
            return f"dimensions.{name}"
        if self._endings is None:
            self._endings = {}
            for path in self.entries:
                parts = path.split(".")
                for start in range(1, len(parts)):
                    self._endings.setdefault(".".join(parts[start:]), []).append(path)
        paths = self._endings.get(name, [])
        if len(paths) == 1:
            return paths[0]
        if paths:
            some = ", ".join(paths[:6]) + (", …" if len(paths) > 6 else "")
            raise MechanismError(
                Finding(f"the name '{name}' stands for {len(paths)} numbers", remedy=f"say which: {some}")
            )
        below = [path for path in self.entries if f".{path}.".find(f".{name}.") >= 0]
        if below:
            some = ", ".join(below[:6]) + (", …" if len(below) > 6 else "")
            raise MechanismError(Finding(f"'{name}' is not one number", remedy=f"set one of {some}"))
        dimensions = [path.partition(".")[2] for path in self.entries if path.startswith("dimensions.")]
        # a short name is most likely a mistyped dimension; endings such as `x` resemble everything
        known = [*self.entries, *self._endings] if "." in name or not dimensions else dimensions
        raise MechanismError(Finding(f"there is no number named '{name}'", remedy=nearest(name, known)))
