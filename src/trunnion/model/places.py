"""Where what a name means stands in a model file, or would stand: the place that `with_values` changes.

A name is that of a number of the model, or of any key that an entry of the file may state: what may be is what the
sections' classes declare.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, get_args, get_origin

from pydantic import BaseModel

from trunnion.errors import Finding, MechanismError
from trunnion.model.changes import fields_at, stated_at
from trunnion.model.names import nearest
from trunnion.model.parameters import Location, item_name
from trunnion.model.quantity import Quantity
from trunnion.model.tolerance_parts import Cost, Variation
from trunnion.model.tolerances import Varying

__all__ = ["place_of"]


def place_of(mechanism: Varying, name: str) -> tuple[str, Location]:
    """The path of the number that a name means, empty if it is no number, and its place in the file.

    MechanismError if it means nothing.
    """
    section, _, rest = name.partition(".")
    if rest and section in ("errors", "tolerances", "costs"):
        return _of_number(mechanism, section, rest)
    try:
        entry = mechanism.parameter_set.entries[mechanism.parameter_set.resolve(name)]
    except MechanismError:
        if place := next(_of_key(mechanism, name), None):
            return place
        raise
    if entry.is_limit:
        remedy = f"set {entry.where}, as ±0.1 deg or +0.2/-0.1 deg"
        raise MechanismError(Finding("a limit is stated with the other", name, remedy))
    return entry.path, entry.location


def _of_number(mechanism: Varying, section: str, rest: str) -> tuple[str, Location]:
    """Place of the error, the tolerance or the cost of a number by any name of that, or of one of its keys."""
    of, _, key = rest.rpartition(".")
    keys = {"errors": (), "tolerances": Variation.model_fields, "costs": Cost.model_fields}[section]
    if not of or key not in keys:
        of, key = rest, ""
    stated: Mapping[str, Any] = getattr(mechanism, "variations" if section == "tolerances" else section)
    resolve = mechanism.parameter_set.resolve
    if section == "costs":
        paths = {*mechanism.cost_paths(of)}
        names = [cost for cost in stated if cost == of or paths.intersection(mechanism.cost_paths(cost))]
        if not names or not key:
            raise MechanismError(Finding(f"there is no cost '{rest}'", f"costs.{rest}", nearest(of, stated)))
        return "", (section, names[0], key)
    try:
        path = resolve(of)
    except MechanismError as error:
        raise MechanismError(replace(error.findings[0], where=f"{section}.{rest}")) from None
    name = next((other for other in stated if resolve(other) == path), of)
    if section == "errors":
        return f"errors.{path}", (section, name)
    short = key in ("", "limits") and (name not in stated or stated[name].model_fields_set <= {"limits"})
    return "", (section, name) if short else (section, name, key or "limits")


def _of_key(mechanism: Varying, name: str) -> Iterator[tuple[str, Location]]:
    """Paths and places of keys that entries of the file may state by a name: `B.pin.clearance`, `A.motor.limit` …"""
    keys = tuple(name.split("."))
    sections = {key: getattr(mechanism, key) for key in type(mechanism).model_fields}
    sections["joints"] = mechanism.stated_joints
    named = [(section, *keys) for section, entries in sections.items()
             if isinstance(entries, Mapping) and isinstance(entries.get(keys[0]), BaseModel)]  # fmt: skip
    owner = sections.get(keys[0])
    if isinstance(owner, Mapping) and keys[1:]:
        owner = owner.get(keys[1])
    if isinstance(owner, str | BaseModel):
        named.insert(0, keys)
    rows, data = [row.joint for row in mechanism.loop], mechanism.data()
    for location in named:
        above, key = location[:-1], location[-1]
        looped = location[0] == "joints" and location[1] in rows
        place: Location = ("loop", rows.index(location[1]), *location[2:]) if looped else location
        fields, group = fields_at(type(mechanism), above), stated_at(data, place[:-1])
        if key not in fields and key in ("x", "y", "z"):  # of a direction, which is made if need be
            annotation = fields_at(type(mechanism), above[:-1]).get(above[-1])
            of_axes = item_name(place[:-1], "xyz".index(key)) == key and _is_number(annotation, in_rows=True)
            if of_axes and isinstance(group, list | None):
                yield ".".join(location), (*place[:-1], "xyz".index(key))
        elif key in fields and (group is None or isinstance(group, dict) or above[-1:] in (("friction",), ("seat",))):
            if key == "friction":  # a plain number is the coefficient
                location, place = (*location, "coefficient"), (*place, "coefficient")
            yield ".".join(location) if key == "friction" or _is_number(fields[key]) else "", place


def _is_number(annotation: Any, in_rows: bool = False) -> bool:
    """Whether a field is a quantity, or a row of them, or may be one of several forms that is."""
    if annotation is Quantity or get_origin(annotation) is tuple:
        return (annotation is Quantity) != in_rows
    return any(_is_number(form, in_rows) for form in get_args(annotation))
