"""Names that do exist, for messages about one that does not; texts that a spreadsheet would take for a formula."""

from __future__ import annotations

import functools
import inspect
import json
import os
import re
from collections.abc import Callable, Iterable
from difflib import get_close_matches
from typing import Any, TypeVar

__all__ = ["FORMULA", "as_key", "check_keywords", "guarded", "nearest", "strict_keywords", "unguarded"]

Public = TypeVar("Public", bound=Callable[..., Any])

SHOWN = 8
FORMULA = frozenset("=+-@\t\r\n＝＋－＠")  # with which a cell begins that a spreadsheet executes; some are full width
_PLAIN = re.compile(r"[^\W\d](?:[\w. +/-]*\w)?")  # what YAML takes for a text as it stands, in braces too
# words in common use for those of a model file: too unlike them to be found by their letters
MEANT = {
    "rectangular": "uniform",
    "gauss": "normal",
    "gaussian": "normal",
    "diameter": "radius",
}
REMARKS = {"radius": ", half the diameter"}
# options of the command line that are methods of a mechanism in Python
BY_METHOD = {
    "friction": "mechanism.with_friction('off')",
    "seat": "mechanism.with_seats('free')",
    "set": "mechanism.with_values({NAME: VALUE})",
    "table": "mechanism.with_table(NAME, FILE)",
}
# arguments that are neither a text nor a path, with what they are
OBJECTS = {
    "mechanism": "a Mechanism: trunnion.read(FILE) makes one",
    "friction_method": "a FrictionMethod; mechanism.with_friction('off') leaves friction out",
}
_WORDS = ("true", "false", "null", "yes", "no", "on", "off")  # and what it does not


def as_key(name: str) -> str:
    """A name as it is written as a key in a model file: in quotation marks where its signs mean something in YAML."""
    plain = _PLAIN.fullmatch(name) and name.casefold() not in _WORDS
    return name if plain else json.dumps(name, ensure_ascii=False)


def nearest(name: str, known: Iterable[str]) -> str:
    """A remedy for an unknown name: the nearest known ones, else the first few that exist."""
    name, names = str(name), list(dict.fromkeys(known))
    folded = {one.casefold(): one for one in reversed(names)}
    if (meant := MEANT.get(name.casefold())) in names:
        return f"did you mean '{meant}'{REMARKS.get(meant, '')}?"
    close = [folded[one] for one in get_close_matches(name.casefold()[:80], folded, n=3, cutoff=0.6)]
    if close:
        return "did you mean " + " or ".join(f"'{one}'" for one in close) + "?"
    if not names:
        return "none is defined"
    more = ", …" if len(names) > SHOWN else ""
    return "known: " + ", ".join(f"'{one}'" for one in names[:SHOWN]) + more


def check_keywords(call: str, keywords: Iterable[str], known: Iterable[str]) -> None:
    """TypeError that names the nearest argument if a keyword is none; call: what was called, such as `analyse()`."""
    names = list(known)
    for word in keywords:
        if word not in names:
            method = BY_METHOD.get(word)
            remedy = f"give it {method} as the mechanism" if method and "mechanism" in names else nearest(word, names)
            raise TypeError(f"{call} takes no argument '{word}' — {remedy}")


def strict_keywords(public: Public) -> Public:
    """A public function, or a class with its public methods, whose calls `check_keywords` holds to the signature."""
    if inspect.isclass(public):
        for name, member in list(vars(public).items()):
            call_name = f"{public.__name__}.{name}"
            if inspect.isfunction(member) and (name == "__init__" or not name.startswith("_")):
                setattr(public, name, _strict(member, call_name))
            elif isinstance(member, classmethod):
                setattr(public, name, classmethod(_strict(member.__func__, call_name)))
        return public
    return _strict(public, public.__name__)  # type: ignore[return-value]


def _strict(function: Callable[..., Any], name: str) -> Callable[..., Any]:
    parameters = inspect.signature(function).parameters
    if any(one.kind is inspect.Parameter.VAR_KEYWORD for one in parameters.values()):
        return function  # what it hands on is checked where it arrives
    known = [key for key, one in parameters.items() if one.kind is not inspect.Parameter.POSITIONAL_ONLY]
    call_name = f"{name.removesuffix('.__init__')}()"
    first = next(iter(parameters), "")

    @functools.wraps(function)
    def call(*args: Any, **keywords: Any) -> Any:
        if not keywords.keys() <= parameters.keys():
            check_keywords(call_name, keywords, [key for key in known if key != "self"])
        for key, value in (*([(first, args[0])] if args else []), *keywords.items()):
            if key in OBJECTS and (isinstance(value, (str, os.PathLike)) or (value is None and key == first)):
                raise TypeError(f"{call_name} takes {OBJECTS[key]}")
        return function(*args, **keywords)

    return call


def guarded(text: str) -> str:
    """A text for a cell of CSV, with an apostrophe before it if a spreadsheet would take it for a formula."""
    return f"'{text}" if text[:1] in FORMULA and text and not _is_number(text) else text


def unguarded(cell: str) -> str:
    """The text of a cell that `guarded` has written."""
    return cell[1:] if cell[:1] == "'" and cell[1:2] in FORMULA and cell[1:] else cell


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
