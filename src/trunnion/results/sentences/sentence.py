"""One sentence with gaps for figures, and how figures are written into it."""

from __future__ import annotations

from collections.abc import Callable
from string import Formatter
from typing import Any, NamedTuple

from trunnion.errors import Severity, agreeing, counted
from trunnion.results.quantities import readable

__all__ = ["ERROR", "NOTE", "WARNING", "Sentence", "filled"]

ERROR, WARNING, NOTE = Severity.ERROR, Severity.WARNING, Severity.NOTE


class Sentence(NamedTuple):
    """What is the case and what to do about it: texts with gaps, or functions of the figures; how much it weighs.

    quiet: for the report and the files alone, for it is so in nearly every result.
    """

    severity: Severity
    what: str | Callable[..., str]
    remedy: str | Callable[..., str] = ""
    quiet: bool = False


class _Words(Formatter):
    """How figures are written.

    `{names}` of a list are joined by commas; `{n:#row}` is "1 row", `{n:#is/are}` the word that goes with n;
    `{size:~m}` and `{size:~{unit}}` a quantity, given in SI, with a unit that fits its size: "12.5 mm"; ∞; `~~` with
    seven digits, for what differs little.
    """

    def format_field(self, value: Any, format_spec: str) -> str:
        if isinstance(value, (list, tuple)):
            return ", ".join(map(str, value))
        if format_spec.startswith("#"):
            one, several, many = format_spec[1:].partition("/")
            return agreeing(int(value), one, many) if several else counted(int(value), one)
        if isinstance(value, float) and value == float("inf"):
            return "∞"
        if format_spec.startswith("~~"):
            return readable(value, format_spec[2:], 7)
        if format_spec.startswith("~"):
            return readable(value, format_spec[1:])
        return str(super().format_field(value, format_spec))


def filled(text: str | Callable[..., str], figures: dict[str, Any]) -> str:
    """The text with its figures."""
    return text(**figures) if callable(text) else _Words().vformat(text, (), figures)
