"""Mechanisms of other programs: read as a draft, of which a model file is made, and written at a position.

`import_file` and `export_model` are `trunnion import` and `trunnion export`; `FORMATS` lists what is read and written.
"""

from __future__ import annotations

from trunnion.exchange.draft import Body, Draft, Pair
from trunnion.exchange.formats import FORMATS, ExportOptions, ImportOptions, export_model, import_file
from trunnion.exchange.model_text import complete, model_text

__all__ = [
    "FORMATS",
    "Body",
    "Draft",
    "ExportOptions",
    "ImportOptions",
    "Pair",
    "complete",
    "export_model",
    "import_file",
    "model_text",
]
