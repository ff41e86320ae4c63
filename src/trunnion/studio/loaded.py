"""A model given as text: read, checked and prepared once, for the questions that follow about the same text."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property, lru_cache
from threading import Lock
from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.errors import Finding, MechanismError, Severity
from trunnion.model.csv_table import stated_files
from trunnion.model.file import Lines, entries_of, place, version_findings
from trunnion.model.mechanism import Mechanism
from trunnion.model.places import with_law
from trunnion.results.dataset import without_noise
from trunnion.results.tables import selected
from trunnion.solve.run import Run, prepare
from trunnion.solve.system import rubbing

if TYPE_CHECKING:
    import xarray as xr

    from trunnion.cycle.positions import Positions
    from trunnion.results.dataset import Column

MOST_SIGNS = 300_000  # of a text: what is longer takes seconds to read at every stroke of a key
MOST_LINKS = 400  # that are solved while one draws
STEPS, MOST_STEPS = 360, 3600


_reading = Lock()  # a question that is asked meanwhile finds what was read for the one before


class Cycle:
    """A mechanism over its cycle, worked out as far as it is asked for.

    Parameters
    ----------
    run : the mechanism, prepared.
    steps : positions of the cycle.
    """

    def __init__(self, run: Run, steps: int) -> None:
        self.run, self.steps = run, steps
        self._figures: xr.Dataset | None = None
        self._working_out = Lock()

    @cached_property
    def positions(self) -> Positions:
        """Motion and forces at the positions; MechanismError where it has no cycle."""
        from trunnion.cycle.positions import positions  # not for the first picture

        if self.run.determinacy is not None:
            self.run.determinacy.refuse()
        with np.errstate(all="ignore"):
            return positions(self.run, self.steps, averaged=False)

    @cached_property
    def motion(self) -> xr.Dataset:
        """They as a result that has no figures of the cycle yet, which may take many times as long."""
        from trunnion.cycle.summary import result_of

        with np.errstate(all="ignore"):
            return result_of(self.run, self.positions).dataset

    @property
    def result(self) -> xr.Dataset:
        """What `analyse` gives, of the same positions; who asks while it is worked out waits for it."""
        from trunnion.cycle.positions import over_cycle
        from trunnion.cycle.summary import result_of

        with self._working_out, np.errstate(all="ignore"):
            if self._figures is None:
                self._figures = result_of(self.run, over_cycle(self.run, self.positions)).dataset
            return self._figures

    @cached_property
    def columns(self) -> dict[str, Column]:
        """The columns of numbers of the table of its motion, by name."""
        return columns_of(self.motion)


def columns_of(result: xr.Dataset) -> dict[str, Column]:
    """The columns of numbers of the table of a result, by name."""
    table = selected(without_noise(result), ["all"])
    return {column.name: column for column in table if column.values.dtype.kind == "f"}


@dataclass(frozen=True, eq=False)  # one for each text, by which its cycles are kept
class Loaded:
    """entries: plain data, None of a text that cannot be read; mechanism: None where it is not sound.

    findings: everything known before it is solved, with lines of the text. What is wrong with friction alone leaves the
    mechanism without it.
    """

    text: str
    entries: Mapping[str, Any] | None
    lines: Lines
    mechanism: Mechanism | None
    findings: tuple[Finding, ...]

    @property
    def bare(self) -> bool:
        """Whether the mechanism is one without friction, for what is stated of that is not sound."""
        errors = (finding.severity is Severity.ERROR for finding in self.findings)
        return self.mechanism is not None and any(errors)

    def placed(self, findings: tuple[Finding, ...]) -> list[Finding]:
        """Findings with their lines."""
        return place(findings, "", self.lines, self.entries or {})

    @property
    def run(self) -> Run:
        """The mechanism prepared; MechanismError if its structure does not determine its motion."""
        if self.mechanism is None:
            raise MechanismError(self.findings)
        with _reading:
            return prepare(self.mechanism)

    @lru_cache(maxsize=3)  # noqa: B019  # a handful of texts is kept, see `loaded`
    def cycle(self, steps: int, friction: bool) -> Cycle:
        """Its cycle with the friction that is stated, or with none."""
        run = self.run
        return Cycle(run if friction else prepare(run.system.mechanism.with_friction("off")), steps)


def loaded(text: str) -> Loaded:
    """A model of a text, whatever the text is."""
    with _reading:
        return _loaded(text)


@lru_cache(maxsize=8)
def _loaded(text: str) -> Loaded:
    try:
        if len(text) > MOST_SIGNS:
            what = f"has {len(text):,} signs; the studio reads {MOST_SIGNS:,} at most"
            raise MechanismError(Finding(what, remedy="analyse it on the command line"))
        entries, lines = entries_of(text) if text.strip() else ({}, {})
    except MechanismError as error:
        return Loaded(text, None, {}, None, error.findings)
    if not entries:
        return Loaded(text, {}, {}, None, ())
    mechanism, findings = None, list(version_findings(entries))
    findings += [
        Finding(f"names the file '{name[:60]}', which the studio does not read", f"{section}.{key}.file",
                "write its points into the model, or analyse it on the command line")
        for section, key, name in stated_files(entries)
    ]  # fmt: skip
    links = entries.get("links")
    if isinstance(links, dict) and len(links) > MOST_LINKS:
        what = f"are {len(links):,}; the studio solves {MOST_LINKS} at most"
        findings.append(Finding(what, "links", "analyse it on the command line"))
    try:
        if not findings:
            mechanism = Mechanism(**entries)
            findings = [finding for finding in mechanism.checked if finding.severity is not Severity.ERROR]
    except MechanismError as error:
        findings += error.findings
        with suppress(MechanismError, TypeError, AttributeError):  # the last two of joints that are no groups
            mechanism = Mechanism(**with_law(copy.deepcopy(dict(entries)), "off"))
    return Loaded(text, entries, lines, mechanism, tuple(place(findings, "", lines, entries)))


class Asked(dict[str, Any]):
    """A question of the page: its entries, and what most questions ask of their model, with friction or without."""

    @property
    def state(self) -> Loaded:
        """The model of its text."""
        return loaded(str(self["text"]))

    @property
    def steps(self) -> int:
        """Positions of the cycle."""
        return min(max(int(self.get("steps") or STEPS), 1), MOST_STEPS)

    @property
    def index(self) -> int:
        """The position that is shown."""
        return int(self.get("index") or 0) % self.steps

    @property
    def friction(self) -> bool:
        """Whether it is asked with the friction that is stated."""
        return self.get("friction") != "off"

    @property
    def rubs(self) -> bool:
        """Whether a joint then rubs."""
        return self.friction and bool(rubbing(self.state.run.system))

    @property
    def cycle(self) -> Cycle:
        """Its cycle; MechanismError where it has no motion."""
        return self.state.cycle(self.steps, self.friction)
