"""A model file with some entries changed: its comments, its order and the way it is written stay where they can."""

from __future__ import annotations

import os
from collections.abc import Mapping, MutableMapping
from io import StringIO
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from trunnion.errors import Finding, MechanismError
from trunnion.model.file import read_mechanism, write_mechanism
from trunnion.model.mechanism import Mechanism
from trunnion.output import whole

__all__ = ["rewrite_mechanism"]

YAMLS = (".yaml", ".yml")


def rewrite_mechanism(
    mechanism: Mechanism, source: str | os.PathLike[str], path: str | os.PathLike[str], over: bool = False
) -> None:
    """Write a mechanism that was made of the file `source`, with the comments of that file if both are YAML.

    over: `path` may be the source itself. MechanismError if it is and may not, or if it cannot be written.
    """
    source, path = Path(source), Path(path)
    if not over and path.exists() and path.samefile(source):
        raise MechanismError(Finding("is the model itself", str(path), "name another file, or add --force"))
    text = _rewritten(mechanism, source) if {source.suffix.lower(), path.suffix.lower()} <= set(YAMLS) else None
    if text is None:
        write_mechanism(mechanism, path)
        return
    with whole(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")
        if read_mechanism(temporary) != mechanism:  # a way of writing that was not foreseen: without the comments then
            write_mechanism(mechanism, temporary)


def _rewritten(mechanism: Mechanism, source: Path) -> str | None:
    """The text of the source with what is different put in; None if it cannot be had."""
    yaml = YAML(typ="rt", pure=True)
    yaml.preserve_quotes = True
    yaml.allow_unicode = True
    yaml.width = 4096  # lines stay as long as they are
    try:
        before = read_mechanism(source).data()
        tree = yaml.load(source.read_text("utf-8"))
        _change(tree, before, mechanism.data())
        stream = StringIO()
        yaml.dump(tree, stream)
    except (MechanismError, YAMLError, OSError, ValueError, TypeError, KeyError):
        return None
    return stream.getvalue()


def _change(tree: MutableMapping[Any, Any], before: Mapping[str, Any], after: Mapping[str, Any]) -> None:
    """Bring a group of entries from one state to another, both as `Mechanism.data` gives them."""
    keys = {str(key): key for key in tree}
    for key in [key for key in before if key not in after]:
        del tree[keys[key]]
    for key, value in after.items():
        if key in before and before[key] == value:
            continue
        own = keys.get(key, key)
        there = tree.get(own)
        if isinstance(there, MutableMapping) and isinstance(value, Mapping) and isinstance(before.get(key), Mapping):
            _change(there, before[key], value)
        else:
            tree[own] = _short(value)


def _short(value: Any) -> Any:
    """Limits alone as they are usually written."""
    return value["limits"] if isinstance(value, Mapping) and list(value) == ["limits"] else value
