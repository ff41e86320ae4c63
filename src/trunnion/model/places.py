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
from trunnion.model.parameters import Location
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
    holders: list[tuple[str, Location, BaseModel, list[str]]] = []
    if isinstance(sections.get(first), BaseModel):
        holders.append((first, (first,), sections[first], keys))
    for section, entries in {**sections, "joints": mechanism.stated_joints}.items():
        owner, *below = keys if first == section and keys else [first, *keys]
        if isinstance(entries, Mapping) and isinstance(entries.get(owner), BaseModel):
            holders.append((f"{section}.{owner}", (section, owner), entries[owner], below))
    rows = [row.joint for row in mechanism.loop]
    for path, location, part, below in holders:
        looped = location[0] == "joints" and location[-1] in rows
        place: Location = ("loop", rows.index(str(location[-1]))) if looped else location
        index: tuple[int, ...] = ()
        annotation = field_of(type(part), below)
        if annotation is None and below[-1:] and below[-1] in tuple("xyz"):  # of a direction
            stated = stated_at(mechanism.data(), (*place, *below[:-1]))
            annotation, index = field_of(type(part), below[:-1]), ("xyz".index(below[-1]),)
            if not isinstance(stated, list) and (stated is not None or not _has_components(annotation)):
                continue
        if annotation is not None and Friction in part_types(annotation):  # a plain number is the coefficient
            annotation, below = AnyQuantity, [*below, "coefficient"]
        group = stated_at(mechanism.data(), (*place, *below[:-1]))
        open_to = (
            group is None or isinstance(group, dict) or below[-2:-1] in (["friction"], ["seat"])
        )  # or a short form
        if annotation is not None and (open_to or index):
            number = index or _is_number(annotation)
            yield f"{path}.{'.'.join(below)}" if number else "", (*place, *below[: -1 if index else None], *index)


def field_of(kind: type[BaseModel], keys: Sequence[str]) -> Any:
    """The annotation of what entries of a kind state by keys, each below the one before; None if they have none."""
    fields = {field.alias or name: field.annotation for name, field in kind.model_fields.items()}
    if kind is Friction:
        fields |= {key: AnyQuantity for law in FRICTION_LAWS.values() for key in law.parameters}
    if not keys or keys[0] not in fields:
        return None
    below = (field_of(part, keys[1:]) for part in part_types(fields[keys[0]]))
    return fields[keys[0]] if len(keys) == 1 else next((inner for inner in below if inner is not None), None)


def _has_components(annotation: Any) -> bool:
    """Whether a field is a row of quantities, or may be one of several forms that is."""
    return get_origin(annotation) is tuple or any(map(_has_components, get_args(annotation)))


def _is_number(annotation: Any) -> bool:
    """Whether a field is a quantity, or may be one of several forms that is."""
    if annotation is Quantity:
        return True
    return get_origin(annotation) is not tuple and any(map(_is_number, get_args(annotation)))
