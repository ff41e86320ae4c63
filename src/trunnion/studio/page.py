"""The studio's page: its one document, its modules as one, and its other files."""

from __future__ import annotations

import json
import re
from functools import lru_cache
from importlib.resources import files
from importlib.resources.abc import Traversable

from trunnion.views.common.bundle import module

__all__ = ["document", "found", "script"]

PLACES = {"studio": ("trunnion.studio", "web"), "web": ("trunnion.views", "web")}
IMPORT_MAP = re.compile(r'<script type="importmap"[^>]*>(.*?)</script>', re.S)


def found(place: str, name: str) -> Traversable:
    """A file of the page; LookupError for what is none."""
    if place not in PLACES or not name or any(part in ("", ".", "..") for part in name.split("/")) or "\\" in name:
        raise LookupError(name)
    package, folder = PLACES[place]
    one = files(package) / folder
    for part in name.split("/"):
        one = one / part
    if not one.is_file():
        raise LookupError(name)
    return one


def document(nonce: str, token: str) -> str:
    """The HTML; nonce: of its import map; token: which the page names to the server, or "" if it has one already."""
    values = {"nonce": nonce, "token": token}
    return re.sub(r"{{(\w+)}}", lambda name: values[name[1]], _text("studio/index.html"))


@lru_cache(maxsize=1)
def script() -> str:
    """All modules of the page as one; the libraries that the document names stay files of their own."""
    known = json.loads(IMPORT_MAP.search(_text("studio/index.html"))[1])["imports"]  # type: ignore[index]  # it has one
    return module("studio/main.js", _text, known)


def _text(path: str) -> str:
    return found(*path.split("/", 1)).read_text(encoding="utf-8")
