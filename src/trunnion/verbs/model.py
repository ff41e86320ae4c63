"""What verbs do with the model they are given: read it, apply the options, say where in the file a finding stands."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from trunnion.errors import Finding, MechanismError, Severity
from trunnion.options import named_file, setting

if TYPE_CHECKING:
    from trunnion.model.mechanism import Mechanism

__all__ = ["exit_status", "lines_of", "placed", "stated"]


def stated(
    file: Path,
    settings: list[str] | None = None,
    tables: list[str] | None = None,
    friction: str | None = None,
    seat: str | None = None,
) -> Mechanism:
    """The model with the options `--table`, `--set`, `--friction` and `--seat` applied, in this order."""
    from trunnion.model.file import read_mechanism

    mechanism = read_mechanism(file, dict(named_file(text) for text in tables or ()))
    if settings:
        mechanism = mechanism.with_values(dict(setting(text) for text in settings))
    if friction:
        mechanism = mechanism.with_friction(friction)
    return mechanism if seat is None else mechanism.with_seats(seat)


@contextmanager
def lines_of(file: Path) -> Iterator[None]:
    """Findings about the model bear the line of its file also where the analysis finds them."""
    try:
        yield
    except MechanismError as error:
        raise MechanismError(placed(error.findings, file)) from None


def placed(findings: Iterable[Finding], file: Path, sections: Iterable[str] = ()) -> list[Finding]:
    """Findings with the line of the model file, if it can be read."""
    from trunnion.model.file import placed as place

    try:
        return place(findings, file, sections)
    except MechanismError:  # the file itself is what the findings are about
        return list(findings)


def exit_status(findings: Iterable[Finding]) -> int:
    """1 if any finding is an error."""
    return 1 if any(finding.severity is Severity.ERROR for finding in findings) else 0
