"""What makes a function a verb: its options by the names of its parameters, its outputs said before it begins.

No output is a file that the verb reads, and no two are one file; both follow from the types of its options, as what its
help calls files, numbers and texts does.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Collection, Iterator, Mapping
from copy import copy
from dataclasses import MISSING, fields, is_dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal, get_args, get_origin, get_type_hints

from typer import Option
from typer.models import ArgumentInfo, OptionInfo, ParameterInfo

from trunnion.cli.options import OPTIONS
from trunnion.errors import MechanismError
from trunnion.files import Target, writing

__all__ = ["flags_of", "options_of", "outputs", "types_in", "verb"]

Hints = dict[str, Any]  # types by the names of parameters
IN_PLACE = {"write": "file"}  # may name that input itself; the verb asks for --force then


def verb(lacks: str = "", **helps: str | ParameterInfo) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Make a function a verb: Typer sees its parameters and those of its groups (`Model`, `Files`, …) as options.

    Modules with verbs do not postpone their annotations: as texts all options would be compiled at every start.

    Parameters
    ----------
    lacks
        Options of the groups that this verb has not.
    **helps
        What a parameter does, or how Typer is to read it, where that is not as in `OPTIONS`.
    """

    def decorated(function: Callable[..., None]) -> Callable[..., None]:
        hints = get_type_hints(function, include_extras=True)
        groups: Hints = {name: hint for name, hint in hints.items() if is_dataclass(hint)}

        @functools.wraps(function)
        def run(**options: Any) -> None:
            own = {name: value for name, value in options.items() if name in hints}
            for name, group in groups.items():
                own[name] = group(**{part.name: options[part.name] for part in fields(group) if part.name in options})
            try:
                targets = []
                for name in outputs(run):
                    paths, flag = options.get(name), f"--{name.strip('_').replace('_', '-')}"
                    several = paths if isinstance(paths, list) else [paths] if paths is not None else []
                    targets += [Target(flag, path, options.get(IN_PLACE.get(name, ""))) for path in several]
                with writing(targets):
                    function(**own)
            except MechanismError as error:  # what Python calls by the name of an argument is an option here
                flags = flags_of(run)
                raise MechanismError(
                    [replace(finding, where=flags.get(finding.where, finding.where)) for finding in error.findings]
                ) from None

        parameters = _spread(function, hints, groups, lacks.split(), helps)
        run.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
        run.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
        return run

    return decorated


def _spread(
    function: Callable[..., None],
    hints: Hints,
    groups: Hints,
    lacks: Collection[str],
    helps: Mapping[str, str | ParameterInfo],
) -> list[inspect.Parameter]:
    """The arguments of a verb, those of groups first, and its options, those of groups last."""
    every: list[tuple[int, inspect.Parameter]] = []

    def add(name: str, hint: Any, usual: Any, shared: bool) -> None:
        info = _read(name.strip("_"), helps)
        argument, kind = isinstance(info, ArgumentInfo), next(types_in(hint))
        words = {Path: "FILE", int: "NUMBER", float: "NUMBER", str: "TEXT"}  # none for a switch
        word = "|".join(get_args(kind)) if get_origin(kind) is Literal else words.get(kind)
        info.metavar = info.metavar or (name.upper() if argument else word)
        default = inspect.Parameter.empty if usual is MISSING else usual
        annotation = Annotated[hint, info]
        parameter = inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)
        every.append(((1 - shared) if argument else (2 + shared), parameter))

    for name, parameter in inspect.signature(function).parameters.items():
        if name not in groups:
            add(name, hints[name], MISSING if parameter.default is parameter.empty else parameter.default, False)
            continue
        types = _types(groups[name])
        for part in fields(groups[name]):
            if part.name not in lacks:
                add(part.name, types[part.name], part.default, True)
    return [parameter for _, parameter in sorted(every, key=lambda pair: pair[0])]


def _read(name: str, helps: Mapping[str, str | ParameterInfo]) -> ParameterInfo:
    """How Typer reads a parameter: as it is declared for all verbs, with the help of this one."""
    special = helps.get(name)
    declared = special if isinstance(special, ParameterInfo) else OPTIONS.get(name, "")
    info: ParameterInfo = (
        copy(declared) if isinstance(declared, ParameterInfo) else Option(f"--{name.replace('_', '-')}", help=declared)
    )
    if isinstance(special, str):
        info.help = special
    return info


@functools.cache
def _types(group: type) -> Hints:
    """The types of the options of a group, read once for all verbs."""
    return get_type_hints(group, include_extras=True)


def types_in(hint: Any) -> Iterator[type]:
    """The types that a type is made of: of `list[str] | None` text and none; choices are one type."""
    parts = () if get_origin(hint) is Literal else get_args(hint)
    for part in parts:
        yield from types_in(part)
    if not parts:
        yield hint


# ---- what the types of a verb say ----------------------------------------------------------------------------------


def options_of(verb: Callable[..., None]) -> Iterator[tuple[str, Any, OptionInfo, str]]:
    """The options of a verb: the parameter, its type, what Typer knows of it, and the flag."""
    for name, hint in get_type_hints(verb, include_extras=True).items():
        info: ParameterInfo | None = next(iter(getattr(hint, "__metadata__", ())), None)
        if isinstance(info, OptionInfo):
            words = (info.default, *(info.param_decls or ()))  # of an annotation Typer calls the first the default
            flag = next((str(word) for word in words if str(word).startswith("--")), f"--{name.replace('_', '-')}")
            yield name, get_args(hint)[0], info, flag


def flags_of(verb: Callable[..., None]) -> dict[str, str]:
    """The options of a verb by the names of their parameters."""
    return {name.strip("_"): flag for name, _, _, flag in options_of(verb)}


def outputs(verb: Callable[..., None]) -> list[str]:
    """The parameters that name files to be written: every option that takes a path. Inputs are arguments or texts."""
    return [name for name, hint, _, _ in options_of(verb) if Path in types_in(hint)]
