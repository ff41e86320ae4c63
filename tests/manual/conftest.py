"""The command line as tests call it."""

import sys
from collections.abc import Callable
from typing import NamedTuple

import pytest

from trunnion.cli import app as cli


class Outcome(NamedTuple):
    """Exit status and what was printed."""

    code: int
    out: str
    err: str


Run = Callable[..., Outcome]


@pytest.fixture
def program(monkeypatch, capsys, tmp_path):
    """The program, in this process, in an empty folder and a terminal of 160 columns; a thin space is a space."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "160")

    def call(*arguments):
        monkeypatch.setattr(sys, "argv", ["trunnion", *map(str, arguments)])
        capsys.readouterr()
        code = 0
        try:
            cli.main()
        except SystemExit as stop:
            code = int(stop.code or 0)
        out, err = (text.replace("\u00a0", " ") for text in capsys.readouterr())
        assert "Traceback" not in err + out
        return Outcome(code, out, err)

    return call
