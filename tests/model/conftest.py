"""What reading a text as a model file raises."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from trunnion.errors import Finding, MechanismError
from trunnion.model.mechanism import read_mechanism


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
