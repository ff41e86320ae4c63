"""JSON Schema of the mapping file, generated from its classes, for editors that complete and check as you type."""

from __future__ import annotations

import json
from typing import Any

from trunnion.model.schema import SchemaGenerator
from trunnion.rig.reading.mapping import DataMapping
from trunnion.rig.reading.sensor_quantity import Amount

__all__ = ["schema_text"]


class _Generator(SchemaGenerator):
    """Amounts as they would be written in a file."""

    def encode_default(self, dft: Any) -> Any:
        return dft.source if isinstance(dft, Amount) else super().encode_default(dft)


def schema_text() -> str:
    """The JSON Schema (2020-12) of a mapping file."""
    schema = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **DataMapping.model_json_schema(schema_generator=_Generator),
        "title": "Trunnion mapping file",
    }
    return json.dumps(schema, indent=1, ensure_ascii=False) + "\n"
