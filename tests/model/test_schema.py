"""The shipped JSON Schema is the model's, and knows the tables."""

from __future__ import annotations

import json

import pytest
from model_samples import EXAMPLES

from trunnion.joints.friction import FRICTION_LAWS
from trunnion.joints.pairs import PAIRS
from trunnion.model.mechanism import read_mechanism
from trunnion.model.schema import SCHEMA_FILE, json_schema, schema_text


def test_the_shipped_schema_is_up_to_date() -> None:
    assert SCHEMA_FILE.read_text(encoding="utf-8") == schema_text(), "run python -m trunnion.model.schema"


def test_the_schema_knows_the_tables() -> None:
    text = json.dumps(json_schema())
    for law, declared in FRICTION_LAWS.items():
        assert f'"{law}"' in text
        assert all(f'"{parameter}": ' in text for parameter in declared.parameters)
    assert all(f'"{pair}"' in text for pair in PAIRS)


@pytest.mark.spread(15)
@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_the_examples_satisfy_the_schema(example) -> None:  # type: ignore[no-untyped-def]
    jsonschema = pytest.importorskip("jsonschema")
    validator = jsonschema.Draft202012Validator(json_schema())
    data = read_mechanism(example).data()
    validator.validate(data)
    assert not validator.is_valid({**data, "linkz": {}})
    assert not validator.is_valid({**data, "links": {"a": {"points": {"A": {"axis": [1, 0]}}}}})
