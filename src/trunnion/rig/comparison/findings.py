"""Findings of a comparison: which courses and efficiencies are not within U, what cannot be compared, and why."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from trunnion.cycle.findings import model_notes
from trunnion.errors import Finding, Severity, Status, counted
from trunnion.model.mechanism import Mechanism
from trunnion.model.names import as_key
from trunnion.results.quantities import readable
from trunnion.results.sentences import finding_for
from trunnion.rig.comparison.assessment import Verdict, going_on
from trunnion.rig.modelled import apart

if TYPE_CHECKING:
    from trunnion.rig.comparison.comparison import ChannelComparison, Compared
    from trunnion.rig.reading.measurement import Condition

__all__ = ["findings_of", "other_speed"]

SIGNIFICANT = 3.5  # standard deviations: of a correlation of turns that is none, in 1 of 4000 channels
SLOWER = 0.01  # of a speed: a difference to speak of
MOST_NAMED = 3  # conditions in one finding


def findings_of(mechanism: Mechanism, channels: Mapping[str, str], compared: Sequence[Compared]) -> list[Finding]:
    """Everything there is to say, errors of the comparison first."""
    rows = [
        *_answers(compared),
        *other_speed(next(iter(mechanism.drivers), ""), [(one.condition, one.model.speed) for one in compared]),
        *(finding for name in channels for finding in _of_channel(name, compared)),
        *_efficiencies(compared),
        *_of_the_model(compared),
        *_left_out(channels, compared),
    ]
    accuracies = {name: [pair.course.accuracy for _, pair in _cases(name, compared)] for name in channels}
    bare = [name for name, stated in accuracies.items() if not any(one.zero or one.gain for one in stated)]
    if bare:
        rows.append(finding_for("compare.no_accuracy", "channels", channels=bare))
    return sorted(rows, key=lambda finding: list(Severity).index(finding.severity))


def _cases(name: str, compared: Sequence[Compared]) -> list[tuple[Compared, ChannelComparison]]:
    return [(one, one.pairs[name]) for one in compared if name in one.pairs]


def _in_which(conditions: Sequence[Condition], count: int) -> str:
    """In which of so many conditions."""
    if len(conditions) == count:
        return "in every condition" if count > 1 else f"in {conditions[0].name}"
    names = "; ".join(one.name for one in conditions[:MOST_NAMED]) + "; …" * (len(conditions) > MOST_NAMED)
    return f"in {len(conditions)} of {counted(count, 'condition')} ({names})"


def _of_channel(name: str, compared: Sequence[Compared]) -> Iterator[Finding]:
    """Where a channel is not within U, cannot be judged, or has turns that resemble each other."""
    cases, where = _cases(name, compared), f"channels.{name}"

    def those(*verdicts: Verdict) -> tuple[list[ChannelComparison], dict[str, str]]:
        rows = [(one.condition, pair) for one, pair in cases if pair.judged.verdict in verdicts]
        return [pair for _, pair in rows], {"cases": _in_which([one for one, _ in rows], len(cases)) if rows else ""}

    off, phrases = those(Verdict.NOT, Verdict.OFFSET)
    if off:
        rms = max(pair.judged.rms for pair in off)
        unit, size = off[0].course.shown
        phrases |= {
            "rms_told": f"{rms / size:.3g} {unit}" if unit not in ("rad", "1") else readable(rms, unit, 3),
            "apart": "" if any(pair.judged.verdict is Verdict.NOT for pair in off) else " apart from a constant offset",
        }
        least = min(pair.judged.within for pair in off)
        yield finding_for(
            "compare.not_within", where, phrases=phrases, within_percent=100 * least, rms=rms, several=len(off) > 1
        )
    unknown, phrases = those(Verdict.UNKNOWN)
    if unknown:
        turns = max(len(pair.course.turns) for pair in unknown)
        yield finding_for("compare.turns_few", where, phrases=phrases, turns=turns)
    nothing, phrases = those(Verdict.NOTHING)
    if nothing:
        yield finding_for("compare.nothing", where, phrases=phrases)
    alike = [(value, turns) for value, turns in (going_on(pair.course) for _, pair in cases) if turns]
    count = sum(turns for _, turns in alike)
    mean = sum(value * turns for value, turns in alike) / max(count, 1)
    if mean * math.sqrt(count) > SIGNIFICANT:
        yield finding_for("compare.turns_alike", where, correlation=mean)


def _efficiencies(compared: Sequence[Compared]) -> Iterator[Finding]:
    rows = [(one.condition, one.efficiency) for one in compared if one.efficiency is not None]
    off = [(one, efficiency) for one, efficiency in rows if efficiency.known and not efficiency.within]
    if off:
        worst, efficiency = max(off, key=lambda row: abs(row[1].measured - row[1].model))
        most = f"; the most in {worst.name}" if len(off) > 1 else ""
        phrases = {"cases": _in_which([one for one, _ in off], len(rows)), "most": most}
        yield finding_for(
            "compare.efficiency", "efficiency", phrases=phrases, measured=efficiency.measured,
            expanded=efficiency.expanded, model=efficiency.model,
        )  # fmt: skip
    for missing in dict.fromkeys(one.unmeasured for one in compared if one.unmeasured):
        cases = _in_which([one.condition for one in compared if one.unmeasured == missing], len(compared))
        yield finding_for(
            "compare.efficiency_unmeasured", "efficiency", phrases={"cases": cases}, missing=list(missing)
        )
    for reason in dict.fromkeys(efficiency.reason for _, efficiency in rows if efficiency.reason[0]):
        cases = _in_which([one for one, efficiency in rows if efficiency.reason == reason], len(rows))
        phrases = {"cases": cases, "reason": reason[0], "remedy": reason[1]}
        yield finding_for("compare.efficiency_unknown", "efficiency", phrases=phrases)


def other_speed(driver: str, rows: Sequence[tuple[Condition, float]]) -> Iterator[Finding]:
    """Of a driver whose speed, rad/s, in the model differs from that of the conditions; an error if by much."""
    off = [(one, speed) for one, speed in rows if apart(one.speed, speed, SLOWER)]
    if not off:
        return
    channels = {course.measures: course for one, _ in rows for course in one.courses.values()}
    reads = channels.get(f"rate:{driver}")
    unit, size = reads.shown if reads is not None and reads.read_in[0] else ("rpm", np.pi / 30)
    speeds = [f"{one.name}: {one.speed / size:.4g} {unit} measured, {speed / size:.4g} {unit} in the model"
              for one, speed in off]  # fmt: skip
    phrases = {
        "cases": _in_which([one for one, _ in off], len(rows)).partition(" (")[0], "key": as_key(f"{driver}.speed"),
        "told": "; ".join(speeds[:MOST_NAMED]) + "; …" * (len(speeds) > MOST_NAMED),
        "mean": reads.channel if reads is not None else "angle",
    }  # fmt: skip
    severity = Severity.ERROR if any(apart(one.speed, speed) for one, speed in off) else None
    figures = {"measured": off[0][0].speed, "model": off[0][1], "driver": driver}
    yield finding_for("compare.speed", f"drivers.{driver}", severity=severity, phrases=phrases, **figures)


def _answers(compared: Sequence[Compared]) -> Iterator[Finding]:
    """An error for every status that leaves positions of the model without numbers."""
    for code in Status:
        cases = [one for one in compared if not code.solved and np.any(one.model.status == code)]
        if cases:
            first = cases[0]
            values = " ".join(f"--set {name}={value:.6g}" for name, value in first.condition.values.items())
            phrases = {
                "cases": _in_which([one.condition for one in cases], len(compared)),
                "analyse": f"run analyse {values}".rstrip(),
            }
            count = int(np.count_nonzero(first.model.status == code))
            positions = len(first.condition.phase)
            yield finding_for("compare.no_answer", phrases=phrases, count=count, positions=positions, status=code.text)


def _of_the_model(compared: Sequence[Compared]) -> Iterator[Finding]:
    """What every analysis of this model says, and warnings of single conditions."""
    alike: dict[tuple[str, str], list[Finding]] = {}
    for one in compared:
        run = one.model.run
        left_open = run.determinacy.findings() if run.determinacy is not None else []
        for finding in (*model_notes(run.system.mechanism, run.system), *run.chosen.findings, *left_open):
            alike.setdefault((finding.where, finding.what), []).append(finding)
    for rows in alike.values():
        if len(rows) == len(compared) or rows[0].severity is not Severity.NOTE:
            yield rows[0]


def _left_out(channels: Mapping[str, str], compared: Sequence[Compared]) -> Iterator[Finding]:
    counts = {
        name: sum(
            int(np.count_nonzero(np.isfinite(pair.model) & ~pair.comparable)) for _, pair in _cases(name, compared)
        )
        for name in channels
    }
    if any(counts.values()):
        yield finding_for("compare.left_out", counts={name: count for name, count in counts.items() if count})
