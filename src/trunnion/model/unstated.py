"""Numbers that a model file may state and does not."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import get_args

from pydantic import BaseModel

__all__ = ["not_stated"]


def not_stated(model: BaseModel, name: str) -> str:
    """The path of what an entry of a model could state, by a name such as `A.initial.speed`; or ""."""
    keys = name.split(".")
    for section in type(model).model_fields:
        entries = getattr(model, section)
        owner, *below = keys[1:] if keys[0] == section else keys
        part = entries.get(owner) if isinstance(entries, dict) and below else None
        if isinstance(part, BaseModel) and _has(type(part), below):
            return ".".join([section, owner, *below])
    return ""


def _has(kind: type[BaseModel], keys: Sequence[str]) -> bool:
    """Whether entries of a kind have such a key, and those below it too."""
    fields = {field.alias or name: field for name, field in kind.model_fields.items()}
    if keys[0] not in fields:
        return False
    return len(keys) == 1 or any(_has(part, keys[1:]) for part in _parts(fields[keys[0]].annotation))


def _parts(annotation: object) -> Iterator[type[BaseModel]]:
    """The kinds of entries that a field may be."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for one in get_args(annotation):
        yield from _parts(one)
