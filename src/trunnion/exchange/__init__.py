"""Mechanisms of other programs: read as a draft, of which a model file is made, and written at a position.

`import_file` and `export_model` are `trunnion import` and `trunnion export`; `FORMATS` lists what is read and written.
Names are loaded when first used.
"""

from __future__ import annotations

TYPE_CHECKING = False  # as in `trunnion`

if TYPE_CHECKING:
    from typing import Any

    from trunnion.exchange.draft import Body as Body
    from trunnion.exchange.draft import Draft as Draft
    from trunnion.exchange.draft import Pair as Pair
    from trunnion.exchange.formats import FORMATS as FORMATS
    from trunnion.exchange.formats import export_model as export_model
    from trunnion.exchange.formats import import_file as import_file
    from trunnion.exchange.model_file import model_text as model_text

_PLACES = {
    "FORMATS": "formats",
    "Body": "draft",
    "Draft": "draft",
    "Pair": "draft",
    "export_model": "formats",
    "import_file": "formats",
    "model_text": "model_file",
}

__all__ = ["FORMATS", "Body", "Draft", "Pair", "export_model", "import_file", "model_text"]


def __getattr__(name: str) -> Any:
    """Load a public name from where it lives."""
    from importlib import import_module

    if name not in _PLACES:
        raise AttributeError(f"module 'trunnion.exchange' has no attribute '{name}'")
    return getattr(import_module(f"trunnion.exchange.{_PLACES[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
