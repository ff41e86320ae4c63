"""What every verb writes: the files that its options name, said before it begins, so that none is one that it reads.

Also what its help calls files, numbers and texts, which follows from the types of its options too.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from dataclasses import replace
from enum import Enum
from pathlib import Path
from typing import Any, get_args, get_type_hints

from typer.models import ArgumentInfo, OptionInfo, ParameterInfo

from trunnion.errors import MechanismError
from trunnion.files import Target, writing

__all__ = ["flags_of", "guarded", "named_words", "outputs"]

IN_PLACE = {"write": "file", "write_mapping": "mapping"}  # may name that input itself; the verb asks for --force then


def guarded(verb: Callable[..., None]) -> Callable[..., None]:
    """The verb, run so that nothing it writes is something it reads, and no two outputs are one file."""
    names, flags = outputs(verb), flags_of(verb)

    @functools.wraps(verb)
    def run(*arguments: Any, **options: Any) -> None:
        try:
            with writing(list(_targets(names, options))):
                verb(*arguments, **options)
        except MechanismError as error:  # what Python calls by the name of an argument is an option here
            raise MechanismError(
                [replace(one, where=flags.get(one.where, one.where)) for one in error.findings]
            ) from None

    return run


def flags_of(verb: Callable[..., None]) -> dict[str, str]:
    """The options of a verb by the names of their parameters."""
    flags: dict[str, str] = {}
    for name, hint in get_type_hints(verb, include_extras=True).items():
        for info in (one for one in getattr(hint, "__metadata__", ()) if isinstance(one, OptionInfo)):
            words = (info.default, *(info.param_decls or ()))  # of an annotation Typer calls the first the default
            stated = next((str(word) for word in words if str(word).startswith("--")), "")
            flags[name.strip("_")] = stated or f"--{name.replace('_', '-')}"
    return flags


def outputs(verb: Callable[..., None]) -> list[str]:
    """The parameters that name files to be written: every option that takes a path. Inputs are arguments or texts."""
    hints = get_type_hints(verb, include_extras=True)
    return [name for name, hint in hints.items() if _is_option(hint) and _takes_path(hint)]


def _is_option(hint: Any) -> bool:
    return any(isinstance(one, OptionInfo) for one in getattr(hint, "__metadata__", ()))


def _takes_path(hint: Any) -> bool:
    return hint is Path or any(_takes_path(one) for one in get_args(hint))


def _targets(names: list[str], options: dict[str, Any]) -> Iterator[Target]:
    for name in names:
        given = options.get(name)
        for path in given if isinstance(given, list) else [given] if given is not None else []:
            yield Target(f"--{name.strip('_').replace('_', '-')}", path, options.get(IN_PLACE.get(name, "")))


# ---- help ----------------------------------------------------------------------------------------------------------


def named_words(verb: Callable[..., None]) -> None:
    """What the help calls the words of a verb: an argument by its name, else FILE, NUMBER, TEXT, the choices."""
    hints = get_type_hints(verb, include_extras=True)
    for name, hint in hints.items():
        for info in getattr(hint, "__metadata__", ()):
            if isinstance(info, ParameterInfo) and info.metavar is None:
                info.metavar = name.upper() if isinstance(info, ArgumentInfo) else _word(get_args(hint)[0])
    verb.__annotations__ = hints  # evaluated once: each evaluation of a text makes other options


def _word(hint: Any) -> str | None:
    """The word for a value of a type; none for a switch."""
    kinds = [one for one in get_args(hint) if one is not type(None)]
    if kinds:
        return _word(kinds[0])
    if issubclass(hint, Enum):
        return "|".join(str(member.value) for member in hint)
    return {Path: "FILE", int: "NUMBER", float: "NUMBER", str: "TEXT"}.get(hint)
