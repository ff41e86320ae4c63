"""Mechanisms of other programs: read as a draft, of which a model file is made, and written at a position.

`import_file` and `export_model` are `trunnion import` and `trunnion export`; `FORMATS` lists what is read and written.
"""

from trunnion.exchange.draft import Body, Draft, Pair
from trunnion.exchange.formats import FORMATS, export_model, import_file
from trunnion.exchange.model_file import model_text

__all__ = ["FORMATS", "Body", "Draft", "Pair", "export_model", "import_file", "model_text"]
