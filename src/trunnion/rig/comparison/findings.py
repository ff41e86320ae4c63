"""What there is to say of a comparison: which courses are not within, what would explain it, what has no answer."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.cycle.findings import model_notes
from trunnion.cycle.summary import inputs
from trunnion.errors import Finding, Severity, Status
from trunnion.model.expression import LITERAL
from trunnion.model.mechanism import Mechanism
from trunnion.model.names import as_key
from trunnion.model.units import unit as unit_of
from trunnion.results.sentences import finding_for
from trunnion.rig.comparison.assessment import Verdict, going_on
from trunnion.rig.comparison.explanations import AGREE, corrected, explained, hides_friction, told_in
from trunnion.rig.comparison.wording import extent, in_which, said, turned
from trunnion.rig.modelled import apart

if TYPE_CHECKING:
    from trunnion.rig.comparison.comparison import ChannelComparison, Compared
    from trunnion.rig.comparison.error_sources import Cause
    from trunnion.rig.reading.measurement import Condition

__all__ = ["findings_of", "other_speed", "units_set"]

SIGNIFICANT = 3.5  # standard deviations: of a correlation of turns that is none, in 1 of 4000 channels
SLOWER = 0.01  # of a speed: a difference to speak of


def findings_of(
    mechanism: Mechanism, channels: Mapping[str, str], found: Sequence[Compared], coverage: float
) -> list[Finding]:
    """Everything there is to say, errors of the comparison first."""
    rows = [
        *_answers(found),
        *_speeds(found),
        *_shifts(found),
        *(finding for name in channels for finding in _of_channel(name, channels[name], found)),
        *_efficiencies(found),
        *_of_the_model(found),
        *_left_out(found),
        *_going_on(channels, found),
        *_accuracies(channels, found),
        _exact(mechanism),
    ]
    order = list(Severity)
    return sorted(rows, key=lambda one: order.index(one.severity))


def units_set(
    mechanism: Mechanism, names: Iterable[str], conditions: Iterable[str]
) -> tuple[list[str], list[tuple[str, float]]]:
    """SI unit of each number that is set, and the unit with its factor that it is read in.

    That of the names of the conditions, such as `input.speed 250 rpm`, else the one that the model states it in.
    """
    known = {row["path"]: row for row in inputs(mechanism)}
    stated = dict(part.partition(" ")[::2] for name in conditions for part in name.split(", "))
    units, written = [], []
    for name in names:
        row = known.get(mechanism.path_of(name), {"unit": "", "text": ""})
        literals = (LITERAL.fullmatch(one.strip().removeprefix("-")) for one in (stated.get(name, ""), row["text"]))
        text = next((one["unit"] or one["per"] or "" for one in literals if one and (one["unit"] or one["per"])), "")
        text = text or {"rad": "deg"}.get(row["unit"], row["unit"])
        units.append(row["unit"])
        written.append((text, float(unit_of(text)[0]) if text and text != "1" else 1.0))
    return units, written


def _cases(name: str, found: Sequence[Compared]) -> list[tuple[Compared, ChannelComparison]]:
    return [(one, one.pairs[name]) for one in found if name in one.pairs]


# ---- channels -------------------------------------------------------------------------------------------------


def _of_channel(name: str, measures: str, found: Sequence[Compared]) -> Iterator[Finding]:
    """One finding for each explanation, over all conditions."""
    cases, shifted = _cases(name, found), _agreed(found)
    by_cause: dict[str, list[tuple[Compared, ChannelComparison]]] = {}
    local = [(one, pair) for one, pair in cases if pair.judged.stretch is not None and pair.cause is None]
    yield from _local(name, local, len(cases))
    for one, pair in cases:
        verdict = pair.judged.verdict
        if (pair.judged.stretch is None or pair.cause is not None) and verdict in (Verdict.NOT, Verdict.OFFSET):
            kind = pair.cause.kind if pair.cause else ""
            if not (kind == "shift" and shifted):  # it is said once for all channels
                of_offset = verdict is Verdict.OFFSET and kind != "sign" and not hides_friction(pair)
                by_cause.setdefault("zero" if of_offset else kind, []).append((one, pair))
    for kind, members in by_cause.items():
        yield explained(name, measures, kind, members, [one.condition for one, _ in cases])
    yield from _biased(name, cases)
    unknown = [len(pair.course.turns) for _, pair in cases if pair.judged.verdict is Verdict.UNKNOWN]
    once = "measured in one turn only"
    if max(unknown, default=1) > 1:
        once = f"has values from only one turn at a position, although up to {max(unknown)} turns were measured"
    turns = max(unknown, default=1)
    for verdict, code, figures in (
        (Verdict.UNKNOWN, "compare.turns_few", {"turns": turns}), (Verdict.NOTHING, "compare.nothing", {})
    ):  # fmt: skip
        names = [one.condition.name for one, pair in cases if pair.judged.verdict is verdict]
        if names:
            phrases = {"cases": in_which(names, len(cases)), "once": once}
            yield finding_for(code, f"channels.{name}", severity=None, phrases=phrases, **figures)


def _local(name: str, cases: Sequence[tuple[Compared, ChannelComparison]], of: int) -> Iterator[Finding]:
    """A channel that misses over a part of the cycle and agrees elsewhere, at the place where it misses most."""
    if not cases:
        return
    one, pair = max(cases, key=lambda case: _beyond(case[1]))
    stretch = pair.judged.stretch
    assert stretch is not None
    shown, size = told_in(name, [(one, pair)])
    start, end = (float(one.model.drive[k]) for k in (stretch.positions[0], stretch.positions[-1]))
    phrases = {
        "cases": in_which([case.condition.name for case, _ in cases], of),
        "most": f", the most in {one.condition.name}" if len(cases) > 1 else "",
        "place": f"{said(start, one.model.unit)} to {said(end, one.model.unit)}",
        "mean_told": said(stretch.mean / size, shown, True),
        "wide_told": said(stretch.expanded / size, shown),
    }
    figures: dict[str, Any] = {
        "start": start,
        "end": end,
        "mean": stretch.mean,
        "expanded": stretch.expanded,
        "count": len(cases),
    }
    yield finding_for(
        "compare.local", f"channels.{name}", phrases=phrases, percent=100 * stretch.share,
        within_percent=100 * pair.judged.within, **figures,
    )  # fmt: skip


def _beyond(pair: ChannelComparison) -> float:
    stretch = pair.judged.stretch
    return abs(stretch.mean) / max(stretch.expanded, 1e-300) if stretch is not None else 0.0


def _biased(name: str, cases: Sequence[tuple[Compared, ChannelComparison]]) -> Iterator[Finding]:
    """A channel that is within position by position, and whose mean residual is more than its U all the same.

    Of the conditions of a true model that is so in 5 %; where it is more or far more it is a warning.
    """
    ratios = [
        (abs(pair.judged.bias) / pair.judged.bias_expanded, one, pair)
        for one, pair in cases
        if pair.within and pair.judged.bias_expanded > 0
    ]
    beyond = [row for row in ratios if row[0] > 1]
    if not beyond:
        return
    ratio, one, pair = max(beyond, key=lambda row: row[0])
    often = len(beyond) > max(1.0, BY_CHANCE * len(ratios))
    shown, size = told_in(name, [(one, pair)])
    phrases = {
        "cases": in_which([row[1].condition.name for row in beyond], len(cases)),
        "most": f", the most in {one.condition.name}" if len(beyond) > 1 else "",
        "bias_told": said(pair.judged.bias / size, shown, True),
        "wide_told": said(pair.judged.bias_expanded / size, shown),
    }
    severity = Severity.WARNING if often or ratio > PLAINLY else None
    figures = {"bias": pair.judged.bias, "expanded": pair.judged.bias_expanded, "count": len(beyond)}
    yield finding_for(
        "compare.bias", f"channels.{name}", severity=severity, phrases=phrases,
        within_percent=100 * pair.judged.within, **figures,
    )  # fmt: skip


BY_CHANCE = 0.1  # of the conditions, in which the bias of a true model is beyond its U: twice what is expected
PLAINLY = 1.5  # times its U, from which a bias is one in any case


# ---- the crank angle ------------------------------------------------------------------------------------------


def _shifted(found: Sequence[Compared]) -> list[tuple[str, Compared, Cause]]:
    return [
        (name, one, pair.cause)
        for one in found
        for name, pair in one.pairs.items()
        if pair.cause is not None and pair.cause.kind == "shift" and pair.judged.verdict is Verdict.NOT
    ]


def _agreed(found: Sequence[Compared]) -> dict[int, float]:
    """By how much the angle of each condition is ahead, rad, by its place; empty where it is no error of the angle.

    It is one if two courses or more are shifted, and those of each condition alike.
    """
    sizes: dict[int, list[float]] = {}
    for _, one, cause in sorted(_shifted(found), key=lambda row: -row[2].explains):
        sizes.setdefault(found.index(one), []).append(cause.size * one.model.span)
    if sum(map(len, sizes.values())) < 2 or not all(map(_alike, sizes.values())):
        return {}
    every = [row[0] for row in sizes.values()]  # by the channel that it explains best
    if max(map(len, sizes.values())) == 1 and not _alike(every):  # of one channel, which may lag
        return {}
    return dict(sorted(zip(sizes, every, strict=True)))


def _alike(angles: Sequence[float]) -> bool:
    return bool(max(angles) - min(angles) <= max(AGREE, 0.2 * max(map(abs, angles))))


def _shifts(found: Sequence[Compared]) -> Iterator[Finding]:
    """A shift that the courses have in common is one of the angle: of all files, or of each its own."""
    ahead = _agreed(found)
    if not ahead:
        return
    cases = _shifted(found)
    unit, every, mean = cases[0][1].model.unit, list(ahead.values()), float(np.mean(list(ahead.values())))
    conditions, alike = [one.condition for one in found], _alike(every)
    off = [conditions[k] for k in ahead]
    told = f"of {extent(every, unit)} in the crank angle"
    if not alike:
        rows = (f"{one.name}: {turned(size, unit)}" for one, size in zip(off, every, strict=True))
        told = f"of the crank angle ({'; '.join(rows)})"
    remedy = corrected(conditions, [mean if alike else ahead.get(k, 0.0) for k in range(len(found))], unit)
    phrases = {
        "channels": ", ".join(dict.fromkeys(name for name, _, _ in cases)), "range": told, "remedy": remedy,
        "cases": in_which([one.name for one in off], len(found)),
    }  # fmt: skip
    least = min(cause.explains for _, _, cause in cases)
    sizes = {one.name: size for one, size in zip(off, every, strict=True)}
    yield finding_for(
        "compare.angle_shifted", "angle.zero", phrases=phrases, explains_percent=100 * least, mean=mean, sizes=sizes
    )


# ---- efficiency, the model, the sensors -----------------------------------------------------------------------


def _efficiencies(found: Sequence[Compared]) -> Iterator[Finding]:
    known = [(one, one.efficiency) for one in found if one.efficiency is not None]
    finite = [(one, of) for one, of in known if np.isfinite([of.measured, of.expanded, of.model]).all()]
    off = [(one, of) for one, of in finite if not of.within]
    if off:
        one, of = max(off, key=lambda case: abs(case[1].measured - case[1].model))
        most = f"; the most in {one.condition.name}" if len(off) > 1 else ""
        phrases = {"cases": in_which([case.condition.name for case, _ in off], len(known)), "most": most}
        figures = {"measured": of.measured, "expanded": of.expanded, "model": of.model}
        yield finding_for("compare.efficiency", "efficiency", severity=None, phrases=phrases, **figures)
    for missing in dict.fromkeys(one.unmeasured for one in found if one.unmeasured):
        where = in_which([one.condition.name for one in found if one.unmeasured == missing], len(found))
        phrases = {"cases": where}
        yield finding_for("compare.efficiency_unmeasured", "efficiency", phrases=phrases, missing=list(missing))
    for reason in dict.fromkeys(of.reason for _, of in known if of.reason[0]):
        where = in_which([one.condition.name for one, of in known if of.reason == reason], len(known))
        phrases = {"cases": where, "reason": reason[0], "remedy": reason[1]}
        yield finding_for("compare.efficiency_unknown", "efficiency", phrases=phrases)


def _speeds(found: Sequence[Compared]) -> Iterator[Finding]:
    """A driver that turned at another speed than the model's."""
    rows = [(one.condition, one.model.speed) for one in found]
    yield from other_speed(next(iter(found[0].model.run.system.mechanism.drivers), "") if found else "", rows)


def other_speed(driver: str, rows: Sequence[tuple[Condition, float]]) -> Iterator[Finding]:
    """Of a driver whose speed, rad/s, in the model differs from that of the conditions; an error if by much."""
    off = [(one, speed) for one, speed in rows if apart(one.speed, speed, SLOWER)]
    if not off:
        return
    channels = {course.measures: course for one, _ in rows for course in one.courses.values()}
    reads = channels.get(f"rate:{driver}")
    unit, size = reads.shown if reads is not None and reads.read_in[0] else ("rpm", np.pi / 30)
    told = [f"{one.name}: {one.speed / size:.4g} {unit} measured, {speed / size:.4g} {unit} in the model"
            for one, speed in off]  # fmt: skip
    phrases = {
        "cases": in_which([one.name for one, _ in off], len(rows)).partition(" (")[0], "key": as_key(f"{driver}.speed"),
        "told": "; ".join(told[:MOST_TOLD]) + ("; …" if len(told) > MOST_TOLD else ""),
        "mean": reads.channel if reads is not None else "angle",
    }  # fmt: skip
    severity = Severity.ERROR if any(apart(one.speed, speed) for one, speed in off) else None
    figures = {"measured": off[0][0].speed, "model": off[0][1], "driver": driver}
    yield finding_for("compare.speed", f"drivers.{driver}", severity=severity, phrases=phrases, **figures)


MOST_TOLD = 4


def _answers(found: Sequence[Compared]) -> Iterator[Finding]:
    """An error for every status that leaves positions of the model without numbers."""
    for code in Status:
        if code.solved:
            continue
        cases = [(one, int(np.count_nonzero(one.model.status == code))) for one in found]
        cases = [(one, count) for one, count in cases if count]
        if cases:
            first, count = cases[0]
            values = " ".join(f"--set {name}={value:.6g}" for name, value in first.condition.values.items())
            where = in_which([one.condition.name for one, _ in cases], len(found))
            phrases = {"cases": where, "analyse": f"run analyse {values}".rstrip()}
            size = len(first.condition.phase)
            yield finding_for("compare.no_answer", phrases=phrases, count=count, positions=size, status=code.text)


def _of_the_model(found: Sequence[Compared]) -> Iterator[Finding]:
    """What every analysis of this model says, and warnings of single conditions."""
    said_of: dict[tuple[str, str], list[Finding]] = {}
    for one in found:
        run = one.model.run
        left_open = run.determinacy.findings() if run.determinacy is not None else []
        for finding in (*model_notes(run.system.mechanism, run.system), *run.chosen.findings, *left_open):
            said_of.setdefault((finding.where, finding.what), []).append(finding)
    for rows in said_of.values():
        if len(rows) == len(found) or rows[0].severity is not Severity.NOTE:
            yield rows[0]


def _left_out(found: Sequence[Compared]) -> Iterator[Finding]:
    counts: Counter[str] = Counter()
    for one in found:
        for name, pair in one.pairs.items():
            counts[name] += int(np.count_nonzero(np.isfinite(pair.model) & ~pair.comparable))
    left = {name: count for name, count in counts.items() if count}
    if left:
        yield finding_for("compare.left_out", counts=left)


def _going_on(channels: Mapping[str, str], found: Sequence[Compared]) -> Iterator[Finding]:
    """Channels whose errors go on from turn to turn, in all conditions together."""
    for name in channels:
        alike = [going_on(pair.course) for _, pair in _cases(name, found)]
        count = sum(turns for _, turns in alike)
        if not count:
            continue
        mean = sum(value * turns for value, turns in alike if turns) / count
        if mean * math.sqrt(count) > SIGNIFICANT:
            yield finding_for("compare.turns_alike", f"channels.{name}", correlation=mean)


def _accuracies(channels: Mapping[str, str], found: Sequence[Compared]) -> Iterator[Finding]:
    bare = [
        name for name in channels
        if all(pair.course.accuracy.zero == pair.course.accuracy.gain == 0 for _, pair in _cases(name, found))
    ]  # fmt: skip
    if bare:
        yield finding_for("compare.no_accuracy", "channels", channels=bare)


def _exact(mechanism: Mechanism) -> Finding:
    return finding_for("compare.model_exact", toleranced=bool(mechanism.tolerances()))
