"""Our ES modules as one: a script for pages opened from a file, which may not import files, a module for the studio.

A browser spends some 10 ms on each file of a page, whatever its size, so that one is there before fifty are.
Each module becomes a function of its own scope that returns what it exports; an import becomes the unpacking of
that. Only the forms that our modules use are known, `import { a, b as c }` or `import * as a` `from "./x.js";` and
`export function`, `export const` or `export class`; anything else is refused, so a module cannot go wrong in silence.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Callable, Collection
from importlib.resources import files

__all__ = ["bundle", "module", "web_text"]

IMPORT = re.compile(r'^import (\{[^}]*\}|\* as \w+|\w+) from "([^"]+)";$', re.MULTILINE)
EXPORT = re.compile(r"^export (?=(?:async )?(?:function|const|class) (\w+))", re.MULTILINE)
LEFT_OVER = re.compile(r"^\s*(?:import|export)\b|\bimport\s*\(", re.MULTILINE)

Read = Callable[[str], str]


def web_text(name: str) -> str:
    """A file of `views/web` as text."""
    return (files("trunnion.views") / "web" / name).read_text(encoding="utf-8")


def bundle(entry: str, read: Read = web_text) -> str:
    """The module `entry` ("report.js") and all it imports as one script, in the order of dependence."""
    functions = _functions(entry, read, ())
    for name, text in functions.items():
        if "</" in text or "<!--" in text:
            raise _refusal(name)
    return '"use strict";\n' + "\n".join(functions.values())


def module(entry: str, read: Read, libraries: Collection[str]) -> str:
    """The module `entry` ("studio/main.js") and all it imports as one module; `libraries` stay imports.

    It exports each by the name of its path, `module_studio_main`.
    """
    functions = _functions(entry, read, libraries)
    imports = [f'import * as {_variable(name)} from "{name}";' for name in libraries]
    return "\n".join([*imports, *functions.values(), f"export {{ {', '.join(map(_variable, functions))} }};\n"])


def _functions(entry: str, read: Read, libraries: Collection[str]) -> dict[str, str]:
    done: dict[str, str] = {}
    _collect(entry.removesuffix(".js"), read, libraries, done, ())
    return done


def _collect(name: str, read: Read, libraries: Collection[str], done: dict[str, str], path: tuple[str, ...]) -> None:
    if name in path:
        raise ValueError(f"modules import each other: {' → '.join([*path, name])}")
    if name in done:
        return
    source = read(f"{name}.js")
    for what, other in IMPORT.findall(source):
        if other.startswith(".") and not what.isidentifier():
            _collect(_beside(name, other), read, libraries, done, (*path, name))
    done[name] = _as_function(name, source, libraries)


def _as_function(name: str, source: str, libraries: Collection[str]) -> str:
    def unpacked(match: re.Match[str]) -> str:
        what, other = match.groups()
        if other not in libraries and (what.isidentifier() or not other.startswith(".")):
            return match[0]
        named = {"{": what.replace(" as ", ": "), "*": what.split()[-1]}.get(what[0], f"{{ default: {what} }}")
        return f"const {named} = {_variable(other if other in libraries else _beside(name, other))};"

    exported = EXPORT.findall(source)
    body = IMPORT.sub(unpacked, EXPORT.sub("", source))
    if LEFT_OVER.search(body):
        raise _refusal(name)
    return f"const {_variable(name)} = (() => {{\n{body}return {{ {', '.join(exported)} }};\n}})();\n"


def _refusal(name: str) -> ValueError:
    return ValueError(f"{name}.js cannot be put into a page: unknown import or export, or the text `</` or `<!--`")


def _beside(name: str, other: str) -> str:
    """What a module imports, by its path without .js."""
    return posixpath.normpath(posixpath.join(posixpath.dirname(name), other)).removesuffix(".js")


def _variable(name: str) -> str:
    return "module_" + re.sub(r"\W", "_", name)
