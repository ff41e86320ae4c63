"""What a result says beside its numbers: where it comes from, its summary and findings; written and read here alone.

A number that a result is told by is a `Figure`: what it is called, of what it is, its unit and its place.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import IntEnum
from math import isfinite
from typing import TYPE_CHECKING, Any, Protocol

from trunnion.errors import Finding, MechanismError, Severity, Status
from trunnion.model.units import shown_as, stated_units
from trunnion.results.quantities import Units, common
from trunnion.version import __version__

if TYPE_CHECKING:
    from trunnion.model.mechanism import Mechanism

_AS_TEXT = json.JSONEncoder(ensure_ascii=False).encode
KEPT = "kept_variables"  # the attribute of a result that has not kept every variable
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


class Described(Protocol):
    """A Dataset, one of its variables, or a `Result` that is to become a Dataset."""

    @property
    def attrs(self) -> Mapping[Any, Any]: ...


def origin(mechanism: Mechanism, formula: str, **more: Any) -> dict[str, Any]:
    """Whose result it is, the units it is written in, and by which version; more: what comes between."""
    identity = {"name": mechanism.name, "formula": formula, **more, "model_units": stated_units(mechanism)}
    return {**identity, "model_hash": mechanism.digest, "trunnion_version": __version__}


def cited(references: Iterable[str], statuses: type[IntEnum] = Status) -> dict[str, Any]:
    """What the result is founded on, and what the codes of `status` mean."""
    return {"references": "\n".join(references), **codes("flag", statuses)}


def codes(what: str, of: type[IntEnum]) -> dict[str, str]:
    """Whole numbers and their words, as CF names them."""
    return {
        f"{what}_values": " ".join(str(int(code)) for code in of),
        f"{what}_meanings": " ".join(code.name.lower() for code in of),
    }


def finding_rows(findings: Iterable[Finding]) -> list[dict[str, Any]]:
    """Findings for JSON."""
    keys = ("severity", "where", "what", "remedy", "code")
    return [{key: str(getattr(finding, key)) for key in keys} | {"figures": plain(finding.figures)}
            for finding in findings]  # fmt: skip


def plain(value: Any) -> Any:
    """Figures or nested lists as JSON can hold them: no number of NumPy, and null for one that is not finite."""
    if isinstance(value, Mapping):
        return {key: plain(part) for key, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(part) for part in value]
    value = value.item() if hasattr(value, "item") else value
    return None if isinstance(value, float) and not isfinite(value) else value


def whole(result: Described, what: str) -> None:
    """MechanismError for something that is made of all variables of a result, of one that has not kept them."""
    if KEPT in result.attrs:
        message = f"this result has kept {len(attribute(result, KEPT))} of its variables: {what} is made of all"
        raise MechanismError(Finding(message, "variables", "analyse without naming variables"))


def encoded(attributes: Mapping[str, Any]) -> dict[str, Any]:
    """Attributes as files can hold them: lists and dicts as JSON."""
    return {name: _AS_TEXT(value) if isinstance(value, list | tuple | dict) else value
            for name, value in attributes.items()}  # fmt: skip


def attribute(result: Described, name: str, default: str = "[]") -> Any:
    """An attribute that `encoded` wrote; that of `default` if it is absent or empty."""
    return json.loads(result.attrs.get(name) or default)


def findings_of(result: Described) -> list[Finding]:
    """The findings that a result carries."""
    return [Finding(row["what"], row["where"], row["remedy"], Severity(row["severity"]),
                    code=row.get("code", ""), figures=row.get("figures", {}))
            for row in attribute(result, "findings")]  # fmt: skip


def summary_of(result: Described) -> list[Figure]:
    """The figures that one looks at first."""
    return [Figure.read(row) for row in attribute(result, "summary")]


def units_of(result: Described) -> Units:
    """The units in which a report shows forces, moments, powers and lengths: those of its model, or of its figures."""
    rows = [row for row in summary_of(result) if not row.numerical]
    with shown_as(attribute(result, "model_units", "{}")):
        return common((row.value, row.unit) for row in rows if isinstance(row.value, float))
