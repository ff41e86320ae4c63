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


@pytest.fixture
def mistake(findings_of: Callable[..., tuple[Finding, ...]]) -> Callable[..., None]:
    """One entry of a text replaced by a wrong one: a finding at its line says where, what and what to do."""

    def check(text: str, case: tuple[str, str, int, str, str, str], most: int = 1, whole: bool = False) -> None:
        old, new, line, where, what, remedy = case
        assert 1 <= text.count(old) <= most
        found = findings_of(text.replace(old, new))
        placed = [one for one in found if (where == one.where if whole else where in one.where)]
        texts = "\n".join(map(str, found))
        fitting = [one for one in placed if what in one.what and remedy in one.remedy]
        assert fitting, texts
        assert fitting[0].line == line, texts
        assert all(one.remedy and one.where and one.line for one in found), texts

    return check
