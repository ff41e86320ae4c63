"""Changes of the plain data of a model: a value at its place, another friction law; what it may state and does not."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Any, get_args, get_origin

from pydantic import BaseModel

from trunnion.joints.friction import FRICTION_LAWS
from trunnion.model.joint_parts import Friction
from trunnion.model.parameters import Location
from trunnion.model.quantity import AnyQuantity, Quantity

__all__ = ["assign", "fields_at", "stated_at", "with_law"]


def assign(
    data: dict[str, Any], location: Location, value: float | str | Quantity | list[str], coordinates: int
) -> None:
    """Put a value at its place in plain data, making the groups on the way and writing short forms out."""
    holder: Any = data
    for key, following in pairwise(location):
        if isinstance(holder, dict) and holder.get(key) is None:
            holder[key] = [0] * coordinates if isinstance(following, int) else {}
        if following == "at" and isinstance(holder[key], list):
            holder[key] = {"at": holder[key]}
        elif isinstance(following, str) and not isinstance(holder[key], dict):
            short = {"limits": holder[key]} if location[0] == "tolerances" else {"coefficient": holder[key]}
            holder[key] = {} if key == "seat" else short  # the short form, of tolerances and of friction
        holder = holder[key]
    holder[location[-1]] = value


def stated_at(data: Any, location: Location) -> Any:
    """What plain data state at a place, a short form as what it stands for; None if nothing."""
    for key in location:
        if isinstance(data, str) or (key == "at" and isinstance(data, list)):
            continue
        try:
            data = data[key]
        except (LookupError, TypeError):
            return None
    return data


def with_law(data: dict[str, Any], law: str) -> dict[str, Any]:
    """The data, which are changed, with a friction law wherever there is friction, or for "off" without friction.

    Parameters that the laws share are kept.
    """
    declared = {} if law == "off" else FRICTION_LAWS[law].parameters
    holders = [data.get("joint_defaults", {}), *data.get("joints", {}).values(), *data.get("loop", [])]
    for holder in (entry for entry in holders if "friction" in entry):
        friction = holder.pop("friction")
        if not isinstance(friction, Mapping):
            friction = {} if friction is None else {"coefficient": friction}
        if law != "off":
            shared = {key: value for key, value in friction.items() if key in ("model", *declared)}
            holder["friction"] = {"law": law, **shared}
    return data


def fields_at(annotation: Any, location: Location) -> dict[str, Any]:
    """The annotations of the keys that an entry may state, by key; empty where no entry can stand.

    annotation: of what holds it, at its top the class of the model; location: of the entry in that.
    """
    origin, arguments = get_origin(annotation), get_args(annotation)
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        fields = {field.alias or name: field.annotation for name, field in annotation.model_fields.items()}
        if annotation is Friction:
            fields |= {key: AnyQuantity for law in FRICTION_LAWS.values() for key in law.parameters}
        if location and location[0] not in fields:
            return {}
        return fields_at(fields[str(location[0])], location[1:]) if location else fields
    if origin in (Mapping, tuple):  # the next is the name of an entry, or its place in a list
        return fields_at(arguments[0 if origin is tuple else 1], location[1:])
    return {key: below for form in arguments for key, below in fields_at(form, location).items()}
