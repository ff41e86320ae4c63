"""The studio's page: its one document, its modules as one, and its other files."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Mapping
from functools import lru_cache
from importlib.resources import files
from importlib.resources.abc import Traversable

from trunnion.views.page import module

PLACES = {"studio": ("trunnion.studio", "web"), "web": ("trunnion.views", "web")}
IMPORT_MAP = re.compile(r'<script type="importmap"[^>]*>(.*?)</script>', re.S)


def found(place: str, name: str) -> Traversable:
    """A file of the page; LookupError for what is none."""
    if place not in PLACES or not name or any(part in ("", ".", "..") for part in name.split("/")) or "\\" in name:
        raise LookupError(name)
    package, folder = PLACES[place]
    path = files(package) / folder
    for part in name.split("/"):
        path = path / part
    if not path.is_file():
        raise LookupError(name)
    return path


def document(nonce: str, token: str) -> str:
    """The HTML; nonce: of its import map; token: which the page names to the server, or "" if it has one already."""
    values = {"nonce": nonce, "token": token}
    return re.sub(r"{{(\w+)}}", lambda name: values[name[1]], _text("studio/index.html"))


@lru_cache(maxsize=1)
def script() -> str:
    """All modules of the page as one; the libraries that the document names stay files of their own."""
    imports = json.loads(IMPORT_MAP.search(_text("studio/index.html"))[1])["imports"]  # type: ignore[index]  # it has one
    return module("studio/main.js", _text, imports)


@lru_cache(maxsize=1)
def one_file() -> str:
    """The page in one file, for a frame in a notebook: style, modules and libraries inside it, nothing fetched."""
    imports: dict[str, str] = json.loads(IMPORT_MAP.search(_text("studio/index.html"))[1])["imports"]  # type: ignore[index]
    libraries: dict[str, str] = {}
    while len(libraries) < len(imports):  # a library comes after those that it imports
        for name, path in imports.items():
            text = _text(path.removeprefix("/"))
            needs = [other for other in imports if re.search(rf'from *"{re.escape(other)}"', text)]
            if name not in libraries and all(other in libraries for other in needs):
                libraries[name] = _as_data(text, libraries)
    style = "".join(_text(path) for path in ("web/report.css", "studio/studio.css", "studio/panels.css"))
    head = '<meta charset="utf-8"><meta name="token" content=""><meta name="cell"><title>Trunnion studio</title>'
    body = f'<div id="studio"></div><script type="module" src="{_as_data(script(), libraries)}"></script>'
    return f'<!doctype html><html lang="en"><head>{head}<style>{style}</style></head><body>{body}</body></html>'


def _as_data(text: str, libraries: Mapping[str, str]) -> str:
    """A module as a data address, what it imports being such addresses too."""
    for name, address in libraries.items():
        for before in (f'from"{name}"', f'from "{name}"'):
            text = text.replace(before, f'from "{address}"')
    return f"data:text/javascript;base64,{base64.b64encode(text.encode()).decode()}"


def _text(path: str) -> str:
    return found(*path.split("/", 1)).read_text(encoding="utf-8")
