"""A number that a result is told by: what it is called, of what it is, its unit and its place; made once, then read."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite
from typing import Any

__all__ = ["MORE_THAN", "Figure"]

# names of figures that say how well a result is solved, and nothing of the mechanism
NUMERICAL = ("efficiency_error", "power_residual", "friction_iterations", "seat_rounds")
MORE_THAN = "more than"  # the aspect of a figure that is known from below only


@dataclass(frozen=True)
class Figure:
    """One number of the summary of a result.

    name: what a program asks for, such as `A.effort_max`; subject: in words; value: in `unit`, None if there is none,
    or words; aspect: which of the subject's figures, as "maximum"; place: where in the cycle, as "at 24°"; note: what
    is to be known of the subject.
    """

    name: str
    subject: str
    value: float | str | None
    unit: str = "1"
    aspect: str = ""
    place: str = ""
    note: str = ""

    def __post_init__(self) -> None:
        """A number is a float; one that is not finite is none."""
        if self.value is not None and not isinstance(self.value, str):
            object.__setattr__(self, "value", float(self.value) if isfinite(self.value) else None)

    @property
    def numerical(self) -> bool:
        """Whether it is a figure of the solution and not of the mechanism: a report has it in a table of its own."""
        return self.name in NUMERICAL

    @property
    def label(self) -> str:
        """What it is, in words: "drive torque of A, maximum, at 24°"."""
        note = f" ({self.note})" if self.note else ""
        return ", ".join(part for part in (f"{self.subject}{note}", self.aspect, self.place) if part)

    @property
    def remark(self) -> str:
        """The label without its subject, and without that the figure is a bound."""
        aspect = "" if self.aspect == MORE_THAN else self.aspect
        return ", ".join(part for part in (self.note, aspect, self.place) if part)

    def row(self) -> dict[str, Any]:
        """The figure for JSON."""
        parts = dict(vars(self))
        row = {"label": self.label, "value": parts.pop("value"), "unit": parts.pop("unit")}
        return row | {key: text for key, text in parts.items() if text}

    @classmethod
    def read(cls, row: Mapping[str, Any]) -> Figure:
        """The figure of a row."""
        texts = {key: str(row.get(key, "")) for key in ("name", "subject", "aspect", "place", "note")}
        return cls(value=row["value"], unit=row["unit"], **texts)
