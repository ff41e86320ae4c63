"""Arguments of public calls, held to their annotations: a wrong one is refused by name before anything is done."""

from __future__ import annotations

import functools
import inspect
import re
from collections.abc import Callable, Iterable, Sequence
from contextlib import nullcontext
from numbers import Integral, Real
from types import UnionType
from typing import Any, Literal, TypeVar, Union, get_args, get_origin

import numpy as np

from trunnion.errors import Finding, MechanismError
from trunnion.model.names import nearest
from trunnion.model.units import shown_as, stated_by

Public = TypeVar("Public", bound=Callable[..., Any])

# options of the command line that are methods of a mechanism in Python
BY_METHOD = {
    "friction": "mechanism.with_friction('off')",
    "seat": "mechanism.with_seats('free')",
    "set": "mechanism.with_values({NAME: VALUE})",
    "table": "mechanism.with_table(NAME, FILE)",
}
REMEDIES = {
    "Mechanism": ": trunnion.read(FILE) makes one",
    "FrictionMethod": "; mechanism.with_friction('off') leaves friction out",
}
NOUNS = {"methods": "method", "name": "method"}  # of studies, and of friction
LISTS = (Sequence, Iterable)
STRICT = ("trunnion.model.tolerances",)  # bases whose methods are public too
LONGEST = 60  # letters of a value that a message repeats


def check_keywords(call: str, keywords: Iterable[str], accepted: Iterable[str]) -> None:
    """TypeError that names the nearest argument if a keyword is none; call: what was called, such as `analyse`."""
    names = list(accepted)
    for word in keywords:
        if word not in names:
            method = BY_METHOD.get(word)
            remedy = f"give it {method} as the mechanism" if method and "mechanism" in names else nearest(word, names)
            raise TypeError(f"{call} takes no argument '{word}' — {remedy}")


def strict_arguments(public: Public) -> Public:
    """A public function, or a class with its public methods, whose calls are held to the signature.

    An unknown keyword and a value of another type are a TypeError, a word that is no choice a MechanismError; one text
    where a list is taken is a list of one.
    """
    if inspect.isclass(public):
        own = [vars(base) for base in reversed(public.__mro__) if base.__module__ in STRICT or base is public]
        for name, member in [item for members in own for item in members.items()]:
            call = f"{public.__name__}.{name}".removesuffix(".__init__")
            if inspect.isfunction(member) and (name == "__init__" or not name.startswith("_")):
                setattr(public, name, _strict(member, call))
            elif isinstance(member, classmethod):
                setattr(public, name, classmethod(_strict(member.__func__, call)))
        return public
    strict = _strict(public, public.__name__)

    @functools.wraps(public)
    def in_units_of_the_model(*args: Any, **keywords: Any) -> Any:
        quantities = stated_by([*args, *keywords.values()])
        with nullcontext() if quantities is None else shown_as(quantities):
            return strict(*args, **keywords)

    return in_units_of_the_model  # type: ignore[return-value]


def _strict(function: Callable[..., Any], call: str) -> Callable[..., Any]:
    signature = inspect.signature(function)
    parameters = signature.parameters
    names = [name for name in parameters if name not in ("self", "cls")]
    closed = not any(parameter.kind is parameter.VAR_KEYWORD for parameter in parameters.values())

    @functools.cache
    def meaning(name: str) -> Any:
        """What an annotation means where the function stands; without one, and of further arguments, anything."""
        hint, parameter = parameters[name].annotation, parameters[name]
        if hint is parameter.empty or parameter.kind in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD):
            return Any
        return eval(hint, inspect.unwrap(function).__globals__) if isinstance(hint, str) else hint

    @functools.wraps(function)
    def strict(*args: Any, **keywords: Any) -> Any:
        if closed:
            check_keywords(f"{call}()", keywords, names)
        try:
            bound = signature.bind_partial(*args, **keywords)
        except TypeError as error:  # too many of them, or one twice
            raise TypeError(f"{call}(): {error}") from None
        for name, value in bound.arguments.items():
            bound.arguments[name] = held(call, name, value, meaning(name))
        return function(*bound.args, **bound.kwargs)

    return strict


def held(call: str, name: str, value: Any, hint: Any) -> Any:
    """The value of an argument as its annotation has it; TypeError or MechanismError if it cannot be."""
    if _fits(value, hint):
        return value
    kinds, values = _kinds(hint), [value]
    member = next((get_args(kind)[0] for kind in kinds if get_origin(kind) in LISTS), None)
    if member is not None:
        values = list(value) if isinstance(value, Iterable) and not isinstance(value, str) else [value]
        if all(_fits(item, member) for item in values):
            return values
    choices = [word for kind in (*kinds, member) if get_origin(kind) is Literal for word in get_args(kind)]
    if choices and all(isinstance(text, str) for text in values):
        noun, remedy = NOUNS.get(name, name), f"use {' or '.join(choices)}"
        wrong = [text for text in values if text not in choices]
        raise MechanismError([Finding(f"there is no {noun} '{text}'", noun, remedy) for text in wrong])
    kind = re.sub(r"[\w.]+\.(?=\w)", "", inspect.formatannotation(hint))  # as documented: Sequence[str] | None
    remedy = next((REMEDIES[part] for part in re.findall(r"\w+", kind) if part in REMEDIES), "")
    text = repr(value)
    short = text if len(text) <= LONGEST and "\n" not in text else f"{type(value).__name__}(…)"
    raise TypeError(f"{call}({name}={short}) takes {kind}{remedy}")


def _kinds(hint: Any) -> tuple[Any, ...]:
    """The kinds of which an annotation allows any."""
    return get_args(hint) if get_origin(hint) in (Union, UnionType) else (hint,)


def _fits(value: Any, hint: Any) -> bool:
    """Whether a value is what an annotation says: numbers of any width, no truth value among them."""
    origin = get_origin(hint)
    if origin in (Union, UnionType):
        return any(_fits(value, kind) for kind in get_args(hint))
    if origin is Literal:
        return isinstance(value, str) and value in get_args(hint)
    if origin in LISTS:
        listed = isinstance(value, Sequence) and not isinstance(value, (str, bytes))
        return listed and all(_fits(item, get_args(hint)[0]) for item in value)
    if hint in (int, float):
        return isinstance(value, Integral if hint is int else Real) and not isinstance(value, bool)
    return hint is Any or isinstance(value, (bool, np.bool_) if hint is bool else origin or hint)
