"""Mechanisms of other programs: read as a draft, of which a model file is made, and written at a position.

`import_file` and `export_model` are `trunnion import` and `trunnion export`; `FORMATS` lists what is read and written.
Names are loaded when first used.
"""

from __future__ import annotations

from trunnion.lazy import TYPE_CHECKING, loader

if TYPE_CHECKING:
    from trunnion.exchange.draft import Body as Body
    from trunnion.exchange.draft import Draft as Draft
    from trunnion.exchange.draft import Pair as Pair
    from trunnion.exchange.formats import FORMATS as FORMATS
    from trunnion.exchange.formats import export_model as export_model
    from trunnion.exchange.formats import import_file as import_file
    from trunnion.exchange.model_file import model_text as model_text

_PLACES = {
    "FORMATS": ("trunnion.exchange.formats", "FORMATS"),
    "Body": ("trunnion.exchange.draft", "Body"),
    "Draft": ("trunnion.exchange.draft", "Draft"),
    "Pair": ("trunnion.exchange.draft", "Pair"),
    "export_model": ("trunnion.exchange.formats", "export_model"),
    "import_file": ("trunnion.exchange.formats", "import_file"),
    "model_text": ("trunnion.exchange.model_file", "model_text"),
}

__all__ = ["FORMATS", "Body", "Draft", "Pair", "export_model", "import_file", "model_text"]

__getattr__ = loader("trunnion.exchange", _PLACES)


def __dir__() -> list[str]:
    return sorted(__all__)
