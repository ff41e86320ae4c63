"""The studies of the command line as forms: what the studio asks for before it runs one."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from inspect import Parameter, signature
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

from trunnion.cli.built import allocate, assemble, play, tolerance
from trunnion.cli.measured import compare, identify
from trunnion.cli.motion import design, locking, simulate, sweep
from trunnion.cli.options import options_of, types_in

STUDIES = (locking, design, play, tolerance, allocate, simulate, sweep, assemble, compare, identify)
# what the studio sets itself, and options that read a file or concern files and processes
LEFT_OUT = {
    *("file", "out", "report", "write", "force", "jobs", "cluster", "checkpoint", "table", "sample", "files"),
    *("units_row", "units", "columns", "kind", "format", "engine", "uncut"),
}


def forms() -> list[dict[str, Any]]:
    """Every study: verb, help, whether it reads a mapping, writes a report, and fields {flag, help, kind, choices}."""
    return [
        {
            "verb": study.__name__,
            "help": (study.__doc__ or "").strip().splitlines()[0],
            "mapping": "mapping" in signature(study).parameters,
            "report": any(name == "report" for name, *_ in options_of(study)),
            "fields": list(_fields(study)),
        }
        for study in STUDIES
    ]


def _fields(study: Callable[..., None]) -> Iterator[dict[str, Any]]:
    usual = {name: parameter.default for name, parameter in signature(study).parameters.items()}
    for name, hint, info, flag in options_of(study):
        types = set(types_in(hint))
        if name.strip("_") in LEFT_OUT or Path in types:
            continue
        choices = [list(get_args(part)) for part in types if get_origin(part) is Literal]
        value = usual[name] if usual[name] not in (None, False, Parameter.empty) else ""
        yield {
            "flag": flag.partition("/")[0],
            "help": (info.help or "").replace(" Repeatable.", "").replace(" Repeatable;", ";"),
            "kind": "flag" if bool in types else "number" if types & {int, float} else "text",
            "choices": choices[0] if choices else None,
            "several": any(get_origin(part) is list for part in (hint, *get_args(hint))),
            "usual": str(value),
        }
