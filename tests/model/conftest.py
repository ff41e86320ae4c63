"""What reading a text as a model file raises, and the model whose numbers vary in every way."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from model_samples import VARIED

from trunnion.errors import Finding, MechanismError
from trunnion.model.mechanism import Mechanism, read_mechanism


@pytest.fixture
def findings_of(tmp_path: Path) -> Callable[..., tuple[Finding, ...]]:
    """The findings that reading a text as a file raises."""

    def read(content: str | bytes, name: str = "model.yaml") -> tuple[Finding, ...]:
        path = tmp_path / name
        path.write_bytes(content.encode() if isinstance(content, str) else content)
        with pytest.raises(MechanismError) as error:
            read_mechanism(path)
        assert all(finding.file == str(path) for finding in error.value.findings)
        return error.value.findings

    return read


@pytest.fixture
def varied(tmp_path: Path) -> Mechanism:
    path = tmp_path / "varied.yaml"
    path.write_text(VARIED, encoding="utf-8")
    return read_mechanism(path)
