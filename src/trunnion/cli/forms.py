"""The studies of the command line as forms: what the studio asks for before it runs one."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from enum import Enum
from inspect import signature
from pathlib import Path
from types import UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

from typer.models import ArgumentInfo, OptionInfo

from trunnion.cli.allocate import allocate
from trunnion.cli.assemble import assemble
from trunnion.cli.compare import compare
from trunnion.cli.files import flags_of
from trunnion.cli.identify import identify
from trunnion.cli.play import play
from trunnion.cli.simulate import simulate
from trunnion.cli.sweep import sweep
from trunnion.cli.tolerance import tolerance

__all__ = ["forms"]

STUDIES = (play, tolerance, allocate, simulate, sweep, assemble, compare, identify)
# what the studio sets itself, and options that read a file or concern files and processes
LEFT_OUT = {
    *("file", "out", "report", "write", "force", "jobs", "cluster", "checkpoint", "table", "sample", "files"),
    *("units_row", "units", "kind", "format", "engine", "uncut"),
}


def forms() -> list[dict[str, Any]]:
    """Every study with its options: verb, help, whether it reads a mapping, and fields {flag, help, kind, choices}."""
    return [_form(study) for study in STUDIES]


def _form(study: Callable[..., None]) -> dict[str, Any]:
    hints = get_type_hints(study, include_extras=True)
    hints.pop("return", None)
    arguments = [name for name, hint in hints.items() if _info(hint, ArgumentInfo) is not None]
    return {
        "verb": study.__name__,
        "help": (study.__doc__ or "").strip().splitlines()[0],
        "mapping": "mapping" in arguments,
        "fields": list(
            _fields(hints, flags_of(study), {name: one.default for name, one in signature(study).parameters.items()})
        ),
    }


def _fields(hints: dict[str, Any], flags: Mapping[str, str], usual: dict[str, Any]) -> Iterator[dict[str, Any]]:
    for name, hint in hints.items():
        info = _info(hint, OptionInfo)
        kind = get_args(hint)[0] if info is not None else None
        if info is None or name.strip("_") in LEFT_OUT or _is(kind, Path):
            continue
        flag = flags[name.strip("_")].partition("/")[0]
        choices = next(([str(one.value) for one in part] for part in _parts(kind) if _is_enum(part)), None)
        sort = "flag" if _is(kind, bool) else "number" if _is(kind, int) or _is(kind, float) else "text"
        several = any(get_origin(part) is list for part in (kind, *get_args(kind)))
        value = usual[name] if usual[name] not in (None, False) else ""
        said = (info.help or "").replace(" Repeatable.", "").replace(" Repeatable;", ";")
        yield {
            "flag": flag, "help": said, "kind": sort, "choices": choices, "several": several,
            "usual": str(getattr(value, "value", value)),
        }  # fmt: skip


def _info(hint: Any, of: type) -> Any:
    return next((one for one in getattr(hint, "__metadata__", ()) if isinstance(one, of)), None)


def _parts(kind: Any) -> Iterator[Any]:
    """The types that a type is made of."""
    yield kind
    if get_origin(kind) in (Union, UnionType, list):
        for part in get_args(kind):
            yield from _parts(part)


def _is(kind: Any, wanted: type) -> bool:
    return any(part is wanted for part in _parts(kind))


def _is_enum(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, Enum)
