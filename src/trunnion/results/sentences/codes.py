"""The one place where a finding about a result becomes a sentence."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from trunnion.errors import Finding, Severity
from trunnion.results.sentences.cycle import CYCLE
from trunnion.results.sentences.dynamics import DYNAMICS
from trunnion.results.sentences.sentence import Sentence, filled
from trunnion.results.sentences.structure import STRUCTURE
from trunnion.results.sentences.studies import STUDIES

__all__ = ["QUIET", "SENTENCES", "finding_for"]

SENTENCES: dict[str, Sentence] = {**STRUCTURE, **CYCLE, **STUDIES, **DYNAMICS}
QUIET = frozenset(code for code, sentence in SENTENCES.items() if sentence.quiet)


def finding_for(
    code: str,
    where: str = "",
    *,
    severity: Severity | None = None,
    phrases: Mapping[str, str] | None = None,
    **figures: Any,
) -> Finding:
    """The finding of a code. severity: if it is not the usual one; phrases: parts of the sentence that are no figures.

    figures: numbers in SI, if their name does not say otherwise, with the names and places that it speaks of.
    """
    sentence, figures = SENTENCES[code], {name: _plain(value) for name, value in figures.items()}
    every = {**figures, **(phrases or {})}
    severity = sentence.severity if severity is None else severity
    what, remedy = filled(sentence.what, every), filled(sentence.remedy, every)
    return Finding(what, where, remedy, severity, code=code, figures=figures)


def _plain(value: Any) -> Any:
    """Numbers of NumPy as Python's."""
    return value.item() if hasattr(value, "item") else value
