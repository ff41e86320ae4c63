"""Places in the plain data of a model: what may stand there, a value put there, what pydantic found wrong there."""

from __future__ import annotations

import re
from collections.abc import Mapping
from itertools import pairwise
from typing import Any, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from trunnion.errors import Finding
from trunnion.joints.friction import FRICTION_LAWS
from trunnion.model.entry import FORMS
from trunnion.model.joint_parts import Friction
from trunnion.model.names import nearest
from trunnion.model.parameters import Location, item_name
from trunnion.model.quantity import AnyQuantity, Quantity


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


# ---- what pydantic found wrong, in the words of a model file ----------------------------------------------------

# What the other types of pydantic errors mean here; {…} are filled from the error's context.
_MEANINGS: Mapping[str, tuple[str, str]] = {
    "missing": ("'{key}' is missing", "add it"),
    "string_type": ("is not a text", "write a text, in quotes if it looks like a number"),
    "bool_type": ("is not true or false", "write true or false"),
    "bool_parsing": ("is not true or false", "write true or false"),
    "tuple_type": ("is not a list", "write a list [..., ...]"),
    "mapping_type": ("is not a group of entries", "write a group {{key: value}} or indented lines key: value"),
    "dict_type": ("is not a group of entries", "write a group {{key: value}} or indented lines key: value"),
    "model_type": ("is not a group of entries", "write a group {{key: value}} or indented lines key: value"),
    "too_short": ("has {actual_length} entries, at least {min_length} are needed", "give them all"),
    "too_long": ("has more than the {max_length} entries it can have", "remove what is too much"),
}


def schema_findings(error: ValidationError, model: type[BaseModel], data: Mapping[str, Any]) -> list[Finding]:
    """One finding for each thing that pydantic found, with its path; of a list whose items are wrong only those."""
    entries = error.errors(include_url=False)
    parents = {entry["loc"][:-1] for entry in entries}
    return [_finding(entry, model, data) for entry in entries
            if entry["type"] != "too_short" or entry["loc"] not in parents]  # fmt: skip


def _finding(error: ErrorDetails, model: type[BaseModel], data: Mapping[str, Any]) -> Finding:
    location = tuple(part for part in error["loc"] if part not in ("[key]", *FORMS))  # without the marks of pydantic
    key = str(location[-1]) if location else ""
    context = error.get("ctx", {})
    kind = error["type"]
    if error["input"] is None and kind != "missing":
        what, remedy = "is empty", "give it a value or remove it"
        if key[:1].isdigit():  # {mass: 1,5 kg} is read as mass: 1 and the key "5 kg"
            what = f"the key '{key[:80]}' has no value"
            remedy = "a comma ends a value in braces: write a decimal point, as 1.5 kg, or quotation marks"
    elif kind in ("quantity", "stated"):
        what, remedy = context["what"], context["remedy"]
    elif kind == "extra_forbidden":
        what, remedy = f"the key '{key[:80]}' is unknown", nearest(key, fields_at(model, location[:-1]))
    elif kind == "string_pattern_mismatch":  # the only texts with a pattern
        what = f"'{error['input'][:40]}' is not the name of an assembly mode"
        remedy = "write way-1, way-2, … as `check` lists them, or folds"
    elif kind == "literal_error" and key.startswith("trunnion"):
        what, remedy = f"the file is of version {error['input']!r}, this program reads 1", f"write {key}: 1"
    elif kind == "literal_error":
        word, words = str(error["input"])[:40], re.findall(r"'([^']*)'", context["expected"])
        what, remedy = f"'{word}' is not one of {context['expected']}", nearest(word, words)
    elif kind in _MEANINGS:
        what, remedy = (text.format(**{"key": key, **context}) for text in _MEANINGS[kind])
    else:
        what, remedy = error["msg"][:1].lower() + error["msg"][1:], "see the examples"
    if kind == "missing":
        location = location[:-1]
    return Finding(what, _path(location, data), remedy)


def _path(location: tuple[int | str, ...], data: Mapping[str, Any]) -> str:
    """Location as a path: coordinates by their letters, rows of the loop by their joints."""
    parts: list[str] = []
    for place, part in enumerate(location):
        if part == "at" and place > 2 and location[place - 2] == "points":
            continue
        if not isinstance(part, int):
            parts.append(part)
        elif location[0] == "loop" and place == 1:
            row = data["loop"][part]
            parts.append(str(row["joint"]) if isinstance(row, Mapping) and "joint" in row else str(part))
        else:
            parts.append(item_name(location[:place], part))
    return ".".join(parts)
