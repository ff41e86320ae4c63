"""Our ES modules as one script, for pages opened from a file: browsers forbid such pages to import files.

Each module becomes a function of its own scope that returns what it exports; an import becomes the unpacking of
that. Only the two forms that our modules use are known, `import { a, b } from "./x.js";` and `export function`,
`export const` or `export class`; anything else is refused, so a module cannot go wrong in silence.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from importlib.resources import files

__all__ = ["bundle", "web_text"]

IMPORT = re.compile(r'^import \{([^}]*)\} from "\./([\w-]+)\.js";$', re.MULTILINE)
EXPORT = re.compile(r"^export (?=(?:async )?(?:function|const|class) (\w+))", re.MULTILINE)
LEFT_OVER = re.compile(r"^\s*(?:import|export)\b|\bimport\s*\(", re.MULTILINE)


def web_text(name: str) -> str:
    """A file of `views/web` as text."""
    return (files("trunnion.views") / "web" / name).read_text(encoding="utf-8")


def bundle(entry: str, read: Callable[[str], str] = web_text) -> str:
    """The module `entry` ("report.js") and all it imports as one script, in the order of dependence."""
    done: dict[str, str] = {}
    _collect(entry.removesuffix(".js"), read, done, ())
    return '"use strict";\n' + "\n".join(done.values())


def _collect(name: str, read: Callable[[str], str], done: dict[str, str], path: tuple[str, ...]) -> None:
    if name in path:
        raise ValueError(f"modules import each other: {' → '.join([*path, name])}")
    if name in done:
        return
    source = read(f"{name}.js")
    for _, other in IMPORT.findall(source):
        _collect(other, read, done, (*path, name))
    done[name] = _as_function(name, source)


def _as_function(name: str, source: str) -> str:
    exported = EXPORT.findall(source)
    body = IMPORT.sub(lambda found: f"const {{{found[1]}}} = {_variable(found[2])};", EXPORT.sub("", source))
    if "</" in body or "<!--" in body or LEFT_OVER.search(body):
        raise ValueError(f"{name}.js cannot be put into a page: unknown import or export, or the text `</` or `<!--`")
    return f"const {_variable(name)} = (() => {{\n{body}return {{ {', '.join(exported)} }};\n}})();\n"


def _variable(name: str) -> str:
    return "module_" + name.replace("-", "_")
