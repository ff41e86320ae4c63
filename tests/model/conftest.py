"""What reading a text as a model file raises, and the model whose numbers vary in every way."""

import pytest
from model_samples import VARIED

from trunnion.errors import MechanismError
from trunnion.model.mechanism import read_mechanism


@pytest.fixture
def findings_of(tmp_path):
    """The findings that reading a text as a file raises."""

    def read(content, name="model.yaml"):
        path = tmp_path / name
        path.write_bytes(content.encode() if isinstance(content, str) else content)
        with pytest.raises(MechanismError) as error:
            read_mechanism(path)
        assert all(finding.file == str(path) for finding in error.value.findings)
        return error.value.findings

    return read


@pytest.fixture
def varied(tmp_path):
    path = tmp_path / "varied.yaml"
    path.write_text(VARIED, encoding="utf-8")
    return read_mechanism(path)
