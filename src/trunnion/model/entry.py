"""What the sections of a model file are made of: names, forms that an entry may have, the immutable entry."""

from __future__ import annotations

import unicodedata
from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, ConfigDict, Discriminator, Field, WithJsonSchema
from pydantic_core import PydanticCustomError

from trunnion.model.names import FORMULA, nearest
from trunnion.model.quantity import Dimensionless, Length

__all__ = ["FORMS", "Direction", "Name", "Part", "Position", "forms", "known", "problem", "shape"]


def _name(name: str) -> str:
    """A name that can stand in a path and in a message."""
    if not name.strip() or name != name.strip():
        raise problem(f"the name {name[:80]!r} is empty or begins or ends with a space", "remove the space")
    if name[0] in FORMULA:
        what = f"the name '{name[:80]}' begins with '{name[0]}', which makes a formula of it in a spreadsheet"
        raise problem(what, "begin it with a letter or a number")
    if "." in name:
        raise problem(f"the name '{name[:80]}' has a dot, which separates the parts of a path", "use - or _")
    if len(name) > 80 or any(unicodedata.category(sign) in ("Cc", "Cf", "Cs", "Zl", "Zp") for sign in name):
        raise problem(f"the name {name[:80]!r} has control characters or over 80", "use a short printable name")
    return name


def problem(what: str, remedy: str) -> PydanticCustomError:
    return PydanticCustomError("stated", "{what}", {"what": what, "remedy": remedy})


def known(table: tuple[str, ...], noun: str) -> Any:
    """Annotations of a text that must be an entry of a table, for validation and JSON Schema."""

    def check(value: str) -> str:
        if value not in table:
            raise problem(f"'{value[:80]}' is not a {noun}", nearest(value, table))
        return value

    return AfterValidator(check), WithJsonSchema({"type": "string", "enum": list(table)})


FORMS = (":group", ":list", ":value", ":way")  # tags of the forms an entry may have


def shape(value: object) -> str:
    """Which of the forms of an entry was written: a list, a group of entries or a single value."""
    if isinstance(value, (Mapping, BaseModel)):
        return ":group"
    return ":list" if isinstance(value, (list, tuple)) else ":value"


def forms(text: str) -> Discriminator:
    return Discriminator(shape, custom_error_type="forms", custom_error_message=f"takes {text}")


Name = Annotated[str, AfterValidator(_name)]
Position = Annotated[tuple[Length, ...], Field(min_length=2, max_length=3)]
Direction = Annotated[tuple[Dimensionless, ...], Field(min_length=2, max_length=3)]


class Part(BaseModel):
    """An entry of a model file: immutable, an unknown key is an error."""

    model_config = ConfigDict(extra="forbid", frozen=True, hide_input_in_errors=True)
