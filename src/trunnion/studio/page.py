"""The studio's page: its files, and its one document, which names all its modules so that they are fetched at once."""

from __future__ import annotations

import json
import posixpath
import re
from functools import lru_cache
from importlib.resources import files
from importlib.resources.abc import Traversable

__all__ = ["document", "found", "modules"]

PLACES = {"studio": ("trunnion.studio", "web"), "web": ("trunnion.views", "web")}
IMPORT = re.compile(r'(?:^|;)(?:import|export)\b[^";]*?\bfrom\s*"([^"]+)"', re.M)
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


def document(nonce: str) -> str:
    """The HTML; nonce: of its import map. Modules named beforehand come in one go, not in rounds of their imports."""
    links = "\n".join(f'<link rel="modulepreload" href="{path}">' for path in modules())
    return _start().replace("{{modules}}", links).replace("{{nonce}}", nonce)


@lru_cache(maxsize=1)
def _start() -> str:
    return found("studio", "index.html").read_text(encoding="utf-8")


@lru_cache(maxsize=1)
def modules() -> tuple[str, ...]:
    """The paths of all modules that the page loads, from its first on, by their imports."""
    known = json.loads(IMPORT_MAP.search(_start())[1])["imports"]  # type: ignore[index]  # the page has one
    paths = ["/studio/main.js"]
    for path in paths:
        _, place, name = path.split("/", 2)
        text = found(place, name).read_text(encoding="utf-8")
        for other in IMPORT.findall(text):
            whole = known.get(other) or posixpath.normpath(posixpath.join(posixpath.dirname(path), other))
            if whole not in paths:
                paths.append(whole)
    return tuple(paths)
