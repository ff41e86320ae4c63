"""What verbs do with the model they are given: read it, apply the options, say where in the file a finding stands."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
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
    from trunnion.model.screen import follow, stated_units

    mechanism = read_mechanism(file, dict(named_file(text) for text in tables or ()))
    values = dict(setting(text) for text in settings or ())
    if seat is not None:
        mechanism = mechanism.with_seats(seat)
    bare = list(_bare(mechanism, values))
    if friction:
        mechanism = mechanism.with_friction(friction, {**(swept or {}), **values})
    elif values:
        mechanism = mechanism.with_values(values)
    mechanism.checked[:] = [*(one for one in mechanism.checked if one.where not in {own.where for own in bare}), *bare]
    follow(stated_units(mechanism))
    return mechanism


def _bare(mechanism: Mechanism, values: Mapping[str, float | str]) -> Iterator[Finding]:
    """Numbers that lack the unit that the model has."""
    from trunnion.model.checks.magnitudes import bare_number

    numbers = mechanism.parameter_set
    for name, value in values.items():
        with suppress(MechanismError):  # of a name that means nothing, which is said where it is set
            if not isinstance(value, str):
                yield from bare_number(numbers, numbers.resolve(name), value)


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
