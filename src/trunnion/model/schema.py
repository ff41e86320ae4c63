"""JSON Schema of the model file, generated from the sections' classes and the tables of joints and friction laws.

`mechanism.schema.json` beside this file is what editors complete model files with; a test keeps it up to date.
Write it anew with `python -m trunnion.model.schema`.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from pydantic.json_schema import GenerateJsonSchema

from trunnion.model.mechanism import Mechanism

SCHEMA_FILE = Path(__file__).with_name("mechanism.schema.json")


class SchemaGenerator(GenerateJsonSchema):
    """Defaults as they would be written in a file; no titles that repeat the keys."""

    def encode_default(self, dft: Any) -> Any:
        return super().encode_default(getattr(dft, "source", dft))

    def field_title_should_be_set(self, schema: Any) -> bool:
        return False


def json_schema() -> dict[str, Any]:
    """The JSON Schema (2020-12) of a model file."""
    schema = Mechanism.model_json_schema(schema_generator=SchemaGenerator)
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **schema,
        "title": "Trunnion model file",
        "required": ["trunnion"],
    }


def schema_text() -> str:
    """The schema as the file holds it."""
    return json.dumps(json_schema(), indent=1, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    SCHEMA_FILE.write_text(schema_text(), encoding="utf-8")
