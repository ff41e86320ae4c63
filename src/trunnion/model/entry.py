"""What the sections of a model file are made of: names, forms that an entry may have, the immutable entry."""

from __future__ import annotations

import unicodedata
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, NoReturn, Self, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Discriminator,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    SerializerFunctionWrapHandler,
    model_serializer,
    model_validator,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from trunnion.model.names import FORMULA, nearest
from trunnion.model.quantity import Dimensionless, Length
from trunnion.model.rules import Directed

K = TypeVar("K")
V = TypeVar("V")


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


@dataclass(frozen=True, eq=False)
class OneOf:
    """A text that is an entry of a table, for validation and JSON Schema; the noun is of the entries."""

    table: Collection[str]
    noun: str

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """The text, if the table has it."""

        def check(value: str) -> str:
            if value not in self.table:
                raise problem(f"'{value[:80]}' is not a {self.noun}", nearest(value, self.table))
            return value

        return core_schema.no_info_after_validator_function(check, handler(source))

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """The entries."""
        return {"type": "string", "enum": list(self.table)}


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
Direction = Annotated[tuple[Dimensionless, ...], Field(min_length=2, max_length=3), Directed()]


def _refuse(*_: object, **__: object) -> NoReturn:
    remedy = "take mechanism.with_values({NAME: VALUE}), or build one from changed data"
    raise TypeError(f"this cannot be changed in place: {remedy}")


class ReadOnlyDict(dict[K, V]):
    """A dict that cannot be changed: what was worked out from a model would no longer belong to it."""

    __setitem__ = __delitem__ = __ior__ = _refuse
    clear = pop = popitem = setdefault = update = _refuse

    def __reduce__(self) -> tuple[type[Self], tuple[dict[K, V]]]:
        """Copied and pickled at once; by default Python adds item by item."""
        return type(self), (dict(self),)


def _read_only(value: Any) -> Any:
    return ReadOnlyDict({key: _read_only(item) for key, item in value.items()}) if isinstance(value, dict) else value


class Part(BaseModel):
    """An entry of a model file: immutable, its groups of entries too; an unknown key is an error.

    one_of: keys of which it states exactly one; some_of: keys of which it states at least one.
    """

    one_of: ClassVar[tuple[str, ...]] = ()
    some_of: ClassVar[tuple[str, ...]] = ()
    model_config = ConfigDict(extra="forbid", frozen=True, hide_input_in_errors=True)

    def __setattr__(self, name: str, value: Any) -> None:
        """Private attributes only."""
        if not name.startswith("_"):
            _refuse()
        super().__setattr__(name, value)

    __delattr__ = _refuse

    def filled(self, values: Mapping[str, Any]) -> Self:
        """With values for keys that it does not state."""
        return self.model_copy(update={key: value for key, value in values.items() if getattr(self, key) is None})

    @model_validator(mode="after")
    def _freeze(self) -> Self:
        self.__dict__.update({key: _read_only(value) for key, value in vars(self).items() if isinstance(value, dict)})
        return self


class ShortForm(Part):
    """An entry that may be written as the value of one of its keys alone, if it states no other."""

    short_key: ClassVar[str]
    short_types: ClassVar[tuple[type, ...]]  # of a value that is not the group

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """The value or the group."""
        group = handler.resolve_ref_schema(handler(schema))
        stated = group["properties"][cls.short_key]
        value = next(form for form in stated.get("anyOf", [stated]) if form.get("type") != "null")
        return {"anyOf": [value, group], "description": group.pop("description")}

    @model_validator(mode="before")
    @classmethod
    def _read_value(cls, value: object) -> object:
        return {cls.short_key: value} if isinstance(value, cls.short_types) else value

    @model_serializer(mode="wrap")
    def _write_value(self, write: SerializerFunctionWrapHandler) -> Any:
        long = write(self)
        stated = [key for key, value in long.items() if value is not None]
        return long[self.short_key] if stated == [self.short_key] else long
