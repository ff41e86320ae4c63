"""What can go wrong, said so that a person can act on it.

A `Finding` is one sentence about a model or a result: what, where, the figure, the remedy. Findings about a
model are collected and raised together as one `MechanismError`; failures of a computation are data: NaN in the
result and a `Status` for each position.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from enum import IntEnum, StrEnum
from typing import Any, Self


def counted(count: int, noun: str, plural: str = "") -> str:
    """A number with its noun: "1 row", "2,000 rows"."""
    return f"{count:,} {agreeing(count, noun, plural or noun + 's')}"


def agreeing(count: int, singular: str, many: str) -> str:
    """The word that goes with a number: "is" of one, "are" of several or none."""
    return singular if count == 1 else many


class Severity(StrEnum):
    """How much a finding weighs: an error forbids the analysis, a warning doubts it, a note informs."""

    ERROR = "error"
    WARNING = "warning"
    NOTE = "note"


# words that sentences begin with
OPENINGS = {"a", "an", "at", "both", "has", "is", "it", "no", "of", "states", "the", "there", "this", "two"}


@dataclass(frozen=True)
class Finding:
    """One thing to know about a model or a result.

    what: the fact with its figure and the limit it breaks, a sentence without a full stop.
    where: path inside the model such as `links.crank.mass`; empty if it concerns the whole.
    remedy: what to do about it; line, file: where it stands in the model file, if it was read from one.
    code: what a program asks for, such as `friction.locked`; of something that was put in, `input.` and its section.
    figures: the numbers of the sentence by name, in SI if their name does not say otherwise, with the names and places
    that it speaks of.
    """

    what: str
    where: str = ""
    remedy: str = ""
    severity: Severity = Severity.ERROR
    line: int | None = None
    file: str = ""
    code: str = ""
    figures: Mapping[str, Any] = field(default_factory=dict, hash=False)

    def __post_init__(self) -> None:
        if not self.code:
            section = self.where.lstrip("-").replace(" ", ".").partition(".")[0]
            object.__setattr__(self, "code", f"input.{section or 'file'}")

    @classmethod
    def weighed(cls, severity: Severity, code: str, where: str, what: str, remedy: str = "", /, **figures: Any) -> Self:
        """A finding about a result, with its code and the figures of its sentence."""
        plain = {name: value.item() if hasattr(value, "item") else value for name, value in figures.items()}
        return cls(what, where, remedy, severity, code=code, figures=plain)

    @classmethod
    def error(cls, code: str, where: str, what: str, remedy: str = "", /, **figures: Any) -> Self:
        """What forbids to use a result."""
        return cls.weighed(Severity.ERROR, code, where, what, remedy, **figures)

    @classmethod
    def warning(cls, code: str, where: str, what: str, remedy: str = "", /, **figures: Any) -> Self:
        """What makes a result doubtful."""
        return cls.weighed(Severity.WARNING, code, where, what, remedy, **figures)

    @classmethod
    def note(cls, code: str, where: str, what: str, remedy: str = "", /, **figures: Any) -> Self:
        """What one should know of a result."""
        return cls.weighed(Severity.NOTE, code, where, what, remedy, **figures)

    def at(self, file: str, line: int | None) -> Finding:
        """The same finding with its place in a file."""
        return replace(self, file=file, line=line)

    @property
    def kind_of_part(self) -> str:
        """What `joints.A` is, joint, where the sentence begins with A itself; nothing elsewhere, nor if A is a word."""
        section, _, name = self.where.partition(".")
        named = name and name not in OPENINGS and self.what.startswith(f"{name} ")
        return (section if "," in name else section.removesuffix("s")) if named else ""

    def __str__(self) -> str:
        place = ":".join(str(part) for part in (self.file, self.line) if part)
        head = " ".join(part for part in (f"{place}:" if place else "", f"{self.severity}:") if part)
        subject = f"{self.kind_of_part} " if self.kind_of_part else f"{self.where}: " if self.where else ""
        remedy = f" — {self.remedy}" if self.remedy else ""
        return f"{head} {subject}{self.what}{remedy}"


class MechanismError(ValueError):
    """The model cannot be analysed; `findings` says why, all in one go."""

    def __init__(self, findings: Finding | Iterable[Finding]) -> None:
        self.findings: tuple[Finding, ...] = (findings,) if isinstance(findings, Finding) else tuple(findings)
        super().__init__("\n".join(str(finding) for finding in self.findings))

    def __reduce__(self) -> tuple[type[MechanismError], tuple[tuple[Finding, ...]]]:
        """Pickled with its findings, so that it can come from another process."""
        return type(self), (self.findings,)


class Coded(IntEnum):
    """An integer code that carries its words."""

    text: str

    def __new__(cls, value: int, text: str) -> Self:
        """A member: its code, and what it says."""
        member = int.__new__(cls, value)
        member._value_ = value
        member.text = text
        return member


class Status(Coded):
    """What a position came to, in rising order of severity; from `NOT_CONVERGED` on the forces are NaN."""

    SOLVED = 0, "solved"
    ZERO_SLIP = 1, "a joint with friction is momentarily at rest: its friction may act either way"
    NEAR_SINGULAR = 2, "close to a singular position: forces and speeds depend strongly on the dimensions"
    CONTACT_LOST = 3, "a pin loses contact: its load reverses, or nothing presses it"
    NOT_CONVERGED = 4, "the friction iteration did not converge"
    LOCKED = 5, "locked by friction: no drive effort can move the mechanism"
    LOAD_UNDEFINED = 6, "a load or spring has no value: outside its table, a division by zero, a length of zero"
    SINGULAR = 7, "singular position (dead centre): speeds and forces have no finite value"
    NOT_ASSEMBLED = 8, "cannot be assembled"

    @property
    def solved(self) -> bool:
        """Whether the position has numbers for everything."""
        return self < Status.NOT_CONVERGED
