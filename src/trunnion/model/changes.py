"""Changes of the plain data of a model: a value at its place, another friction law; what it may state and does not."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from itertools import pairwise
from typing import Any, get_args

from pydantic import BaseModel

from trunnion.joints.friction import FRICTION_LAWS
from trunnion.model.parameters import Location
from trunnion.model.quantity import Quantity

__all__ = [
    "assign",
    "part_types",
    "stated_at",
    "with_law",
]


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
        parameters_of_law = _kept(holder.pop("friction"), declared)
        if law != "off":
            holder["friction"] = {"law": law, **parameters_of_law}
    return data


def _kept(friction: Any, declared: Collection[str]) -> dict[str, Any]:
    """What a statement of friction, short or long, keeps where the parameters of the law are others."""
    if friction is None:
        return {}
    parameters = friction if isinstance(friction, Mapping) else {"coefficient": friction}
    return {key: value for key, value in parameters.items() if key in ("model", *declared)}


def part_types(annotation: object) -> Iterator[type[BaseModel]]:
    """The kinds of entries that a field may be."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for form in get_args(annotation):
        yield from part_types(form)
