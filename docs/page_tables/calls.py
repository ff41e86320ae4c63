"""The verbs of the command line with their options, and the public names of Python."""

from __future__ import annotations

import inspect
from typing import Any, get_args, get_type_hints

from page_tables.cells import code, rows_of


def command_line() -> str:
    """Every verb with its arguments and options."""
    from trunnion.cli.app import app

    parts = []
    for command in app.registered_commands:
        call = command.callback
        assert call is not None
        rows = []
        for parameter in inspect.signature(call).parameters.values():
            hint = get_type_hints(call, include_extras=True)[parameter.name]
            base, info = get_args(hint)[0], hint.__metadata__[0]
            names = [name for name in (info.default, *(info.param_decls or ())) if str(name).startswith("--")]
            argument = type(info).__name__ == "ArgumentInfo"
            default = parameter.default
            if default is inspect.Parameter.empty:
                default = "must be given"
            elif default is None or default is False:
                default = ""
            elif str(default) == ".":
                default = "here"
            rows.append(
                (
                    code(parameter.name.upper() if argument else names[0] if names else f"--{parameter.name}"),
                    "" if base is bool else _kind_of(base),
                    default,
                    info.help or "",
                )
            )
        name = command.name or call.__name__
        parts.append(
            f"## trunnion {name}\n\n{inspect.getdoc(call)}\n\n" + rows_of(("", "takes", "default", "meaning"), rows)
        )
    return "\n".join(parts)


def _kind_of(base: Any) -> str:
    text = str(base)
    words = {"int": "whole number", "float": "number", "Path": "path", "str": "text"}
    return next((word for key, word in words.items() if key in text), text)


def public_names() -> str:
    """mkdocstrings' directive for every public name; a module among them has a section of its own."""
    import trunnion

    places = [one for one in (getattr(trunnion, name) for name in trunnion.__all__) if not inspect.ismodule(one)]
    return "\n\n".join(f"::: {one.__module__}.{one.__qualname__}" for one in places)
