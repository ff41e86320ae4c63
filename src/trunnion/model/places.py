"""Where what a name means stands in a model file, or would stand: the place that `with_values` changes.

A name is that of a number of the model, or of any key that an entry of the file may state: what may be is what the
sections' classes declare.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, get_args, get_origin

from pydantic import BaseModel

from trunnion.errors import Finding, MechanismError
from trunnion.joints.friction import FRICTION_LAWS
from trunnion.model.changes import part_types, stated_at
from trunnion.model.joint_parts import Friction
from trunnion.model.names import nearest
from trunnion.model.parameters import Location, item_name
from trunnion.model.quantity import AnyQuantity, Quantity
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
    first, *keys = name.split(".")
    if not keys and isinstance(getattr(mechanism, first, None), str):  # fits, over_constraint
        yield "", (first,)
    sections = {key: getattr(mechanism, key) for key in type(mechanism).model_fields}
    holders: list[tuple[Location, BaseModel, tuple[str, ...]]] = []
    if isinstance(sections.get(first), BaseModel):
        holders.append(((first,), sections[first], tuple(keys)))
    for section, entries in {**sections, "joints": mechanism.stated_joints}.items():
        owner, *inner = keys if first == section and keys else [first, *keys]
        if isinstance(entries, Mapping) and isinstance(entries.get(owner), BaseModel):
            holders.append(((section, owner), entries[owner], tuple(inner)))
    rows, data = [row.joint for row in mechanism.loop], mechanism.data()
    for location, part, below in holders:
        looped = location[0] == "joints" and location[-1] in rows
        place: Location = ("loop", rows.index(str(location[-1]))) if looped else location
        path, annotation = ".".join(map(str, (*location, *below))), field_of(type(part), below)
        group, short = stated_at(data, (*place, *below[:-1])), below[-2:-1] in (("friction",), ("seat",))
        if annotation is None and below[-1:] and below[-1] in tuple("xyz"):  # of a direction, which is made if need be
            index, annotation = "xyz".index(below[-1]), field_of(type(part), below[:-1])
            of_axes = item_name((*place, *below[:-1]), index) == below[-1] and _is_number(annotation, in_rows=True)
            if of_axes and isinstance(group, list | None):
                yield path, (*place, *below[:-1], index)
        elif annotation is not None and (group is None or isinstance(group, dict) or short):
            if Friction in part_types(annotation):  # a plain number is the coefficient
                annotation, path, below = AnyQuantity, f"{path}.coefficient", (*below, "coefficient")
            yield path if _is_number(annotation) else "", (*place, *below)


def field_of(kind: type[BaseModel], keys: Sequence[str]) -> Any:
    """The annotation of what entries of a kind state by keys, each below the one before; None if they have none."""
    fields = {field.alias or name: field.annotation for name, field in kind.model_fields.items()}
    if kind is Friction:
        fields |= {key: AnyQuantity for law in FRICTION_LAWS.values() for key in law.parameters}
    if not keys or keys[0] not in fields:
        return None
    below = (field_of(part, keys[1:]) for part in part_types(fields[keys[0]]))
    return fields[keys[0]] if len(keys) == 1 else next((inner for inner in below if inner is not None), None)


def _is_number(annotation: Any, in_rows: bool = False) -> bool:
    """Whether a field is a quantity, or a row of them, or may be one of several forms that is."""
    if annotation is Quantity or get_origin(annotation) is tuple:
        return (annotation is Quantity) != in_rows
    return any(_is_number(form, in_rows) for form in get_args(annotation))
