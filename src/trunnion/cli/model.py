"""What verbs do with the model they are given: read it, apply the options, say where in the file a finding stands."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from trunnion.cli.options import named_file, setting
from trunnion.errors import Finding, MechanismError, Severity

if TYPE_CHECKING:
    from trunnion.model.mechanism import Mechanism

__all__ = ["exit_status", "lines_of", "placed", "stated"]


def stated(
    file: Path,
    settings: list[str] | None = None,
    tables: list[str] | None = None,
    friction: str | None = None,
    seat: str | None = None,
    swept: Mapping[str, float | str] | None = None,
) -> Mechanism:
    """The model with the options applied: `--table` and `--seat` first, then `--friction` together with `--set`.

    So a number that is set stands against what is said of all joints, and may be one that only the other law has.
    swept: a value of each number that the verb replaces, which may be such a one too.
    """
    from trunnion.model.mechanism import read_mechanism

    mechanism = read_mechanism(file, dict(named_file(text) for text in tables or ()))
    values = dict(setting(text) for text in settings or ())
    if seat is not None:
        mechanism = mechanism.with_seats(seat)
    if friction:
        return mechanism.with_friction(friction, {**(swept or {}), **values})
    return mechanism.with_values(values) if values else mechanism


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
