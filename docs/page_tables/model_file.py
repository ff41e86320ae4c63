"""The keys of a model file: what each takes, its default, its meaning."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal, get_args, get_origin

import yaml
from mkdocs.exceptions import PluginError
from pydantic import BaseModel
from pydantic_core import PydanticUndefined

from page_tables.cells import code, rows_of, unit

DOCS = Path(__file__).resolve().parents[1]


SECTIONS = ("Link", "Point", "PolarPoint", "InertiaTensor", "Joint", "Pin", "Guide", "Contact", "Friction",
            "JointDefaults", "Misalignment", "Seat", "LoopJoint", "Driver", "Motor", "Initial", "Load", "Measure",
            "Variation", "VariationDefaults", "Correlation", "Cost", "CostOption")  # fmt: skip


def meanings() -> dict[str, dict[str, str]]:
    """What each key means, by class and key, where its class has no descriptions of its own.

    The tables below refuse to be built if one is missing or too many.
    """
    return yaml.safe_load((DOCS / "meanings.yaml").read_text("utf-8"))


def section(name: str) -> str:
    """The keys of one section: what each takes, its default, its meaning."""
    fields = {field.alias or key: field for key, field in _class(name).model_fields.items()}
    told = meanings().get(name) or {key: field.description for key, field in fields.items() if field.description}
    stray = set(told) ^ set(fields)
    if stray:
        raise PluginError(f"{name}: {', '.join(sorted(stray))} is told or stated, not both")
    rows = [(code(key), _takes(field), _default(field), told[key]) for key, field in fields.items()]
    return rows_of(("key", "takes", "default", "meaning"), rows)


def _class(name: str) -> type[BaseModel]:
    from trunnion.model import joint_parts, measure_table, mechanism, parts, tolerance_parts

    modules = (mechanism, parts, joint_parts, tolerance_parts, measure_table)
    found: type[BaseModel] = next(getattr(module, name) for module in modules if hasattr(module, name))
    return found


def _takes(field: Any) -> str:
    found = list(
        dict.fromkeys(_forms(Annotated[field.annotation, *field.metadata] if field.metadata else field.annotation))
    )
    return " or ".join(found)


def _forms(hint: Any, metadata: tuple[Any, ...] = ()) -> Iterator[str]:
    """In words, every form that a type hint allows."""
    origin, arguments = get_origin(hint), get_args(hint)
    kinds = [one.kind for one in metadata if hasattr(one, "kind")]
    enums = [one.json_schema for one in metadata if hasattr(one, "json_schema")]
    if kinds:
        yield f"{kinds[0].name} ({unit(kinds[0].unit)})" if kinds[0].dimensions else "any quantity"
    elif enums:
        yield " or ".join(f"`{one}`" for one in enums[0].get("enum", enums[0].get("examples", [])))
    elif origin is Annotated:
        yield from _forms(arguments[0], hint.__metadata__)
    elif origin is Literal:
        yield " or ".join(f"`{one}`" for one in arguments)
    elif origin is tuple:
        inside = [next(_forms(one)) for one in arguments if one is not Ellipsis]
        yield "list of " + inside[0] if len(set(inside)) == 1 else f"[{', '.join(inside)}]"
    elif isinstance(origin, type) and "Mapping" in origin.__name__:
        yield "by name: " + " or ".join(_forms(arguments[1]))
    elif arguments:
        for one in arguments:
            yield from _forms(one, ())
    elif isinstance(hint, type) and issubclass(hint, BaseModel):
        yield f"[{hint.__name__}](#{hint.__name__.lower()})"
    elif hint is bool:
        yield "`true` or `false`"
    elif hint is str:
        yield "text"


def _default(field: Any) -> str:
    from trunnion.model.quantity import Quantity

    value = field.default
    if value is PydanticUndefined:
        return "must be given" if field.is_required() else ""
    if isinstance(value, Quantity):
        return str(value.source)
    if isinstance(value, bool):
        return str(value).lower()
    return code(value) if isinstance(value, (str, int)) and value != "" else ""
