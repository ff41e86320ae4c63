"""What there is to say of a comparison: which courses are not within, what would explain it, what has no answer."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.cycle.summary import inputs, model_notes
from trunnion.errors import Finding, Severity, Status, counted
from trunnion.model.expression import LITERAL
from trunnion.model.mechanism import Mechanism
from trunnion.model.names import as_key
from trunnion.model.units import unit as unit_of
from trunnion.results.sentences import finding_for
from trunnion.rig.comparison.assessment import Verdict, going_on
from trunnion.rig.comparison.error_sources import KINDS, Cause
from trunnion.rig.reading.measurement import zeros_of_files

if TYPE_CHECKING:
    from trunnion.rig.comparison.comparison import ChannelComparison, Compared
    from trunnion.rig.reading.measurement import Condition

__all__ = ["findings_of", "gathered", "other_speed", "said", "speed_unit", "units_set"]

FAR = 0.5  # of a gain: told as a factor from here on
SIGNIFICANT = 3.5  # standard deviations: of a correlation of turns that is none, in 1 of 4000 channels
SLOWER = 0.01  # of a speed: a difference to speak of
AGREE = np.radians(1.0)  # shifts that differ by less, or by less than a fifth, are one


def findings_of(
    mechanism: Mechanism, channels: Mapping[str, str], found: Sequence[Compared], coverage: float
) -> list[Finding]:
    """Everything there is to say, errors of the comparison first."""
    rows = [
        *_answers(found),
        *_shifts(found),
        *(finding for name in channels for finding in _of_channel(name, channels[name], found)),
        *_efficiencies(found),
        *_speeds(found),
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


def gathered(findings: Iterable[Finding]) -> list[Finding]:
    """Findings about data files, those of one code and place only told once, with the files they are of."""
    alike: dict[tuple[str, ...], list[Finding]] = {}
    for one in findings:
        alike.setdefault((one.severity, one.where.partition(" ")[0], one.code, one.remedy), []).append(one)
    found = []
    for rows in alike.values():
        first, files = rows[0], list(dict.fromkeys(Path(one.file).name for one in rows if one.file))
        if len(rows) > 1:
            where = first.where if len({one.where for one in rows}) == 1 else f"{first.where.partition(' ')[0]}s"
            some = ", ".join(files[:4]) + (", …" if len(files) > 4 else "")
            what = f"{first.what} — {len(rows)} such findings" + (f": {some}" if files else "")
            first = replace(first, what=what, where=where, file="", line=None)
        found.append(first)
    return found


def said(value: float, unit: str, signed: bool = False) -> str:
    """A number with its unit; angles in degrees."""
    factor, shown = (180 / math.pi, "deg") if unit == "rad" else (1.0, "" if unit == "1" else unit)
    return f"{value * factor + 0.0:{'+' if signed else ''}.3g} {shown}".strip()


def _range(values: Sequence[float], unit: str, signed: bool = True) -> str:
    low, high = said(min(values), unit, signed), said(max(values), unit, signed)
    return low if low == high else f"{low.partition(' ')[0]} to {high}"


def _share(value: float) -> str:
    return f"{100 * value:.0f} %"


def _in(names: Sequence[str], of: int) -> str:
    """In which conditions."""
    if len(names) == of:
        return "in every condition" if of > 1 else f"in {names[0]}"
    first = "; ".join(names[:3]) + ("; …" if len(names) > 3 else "")
    return f"in {len(names)} of {counted(of, 'condition')} ({first})"


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
                by_cause.setdefault("zero" if verdict is Verdict.OFFSET and kind != "sign" else kind, []).append(
                    (one, pair)
                )
    for kind, members in by_cause.items():
        yield _explained(name, measures, kind, members, len(cases))
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
            phrases = {"cases": _in(names, len(cases)), "once": once}
            yield finding_for(code, f"channels.{name}", severity=None, phrases=phrases, **figures)


def _local(name: str, cases: Sequence[tuple[Compared, ChannelComparison]], of: int) -> Iterator[Finding]:
    """A channel that misses over a part of the cycle and agrees elsewhere, at the place where it misses most."""
    if not cases:
        return
    one, pair = max(cases, key=lambda case: _beyond(case[1]))
    stretch = pair.judged.stretch
    assert stretch is not None
    shown, size = pair.course.shown if pair.course.unit == "rad/s" else (pair.course.unit, 1.0)
    start, end = (float(one.model.drive[k]) for k in (stretch.positions[0], stretch.positions[-1]))
    phrases = {
        "cases": _in([case.condition.name for case, _ in cases], of),
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
    shown, size = pair.course.shown if pair.course.unit == "rad/s" else (pair.course.unit, 1.0)
    phrases = {
        "cases": _in([row[1].condition.name for row in beyond], len(cases)),
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


def _explained(
    name: str, measures: str, kind: str, members: Sequence[tuple[Compared, ChannelComparison]], of: int
) -> Finding:
    """A channel that is not within, with what would explain it."""
    where = _in([one.condition.name for one, _ in members], of)
    worst = min(pair.judged.within for _, pair in members)
    rms = max(pair.judged.rms for _, pair in members)
    unit = members[0][1].course.unit
    offset = all(pair.judged.verdict is Verdict.OFFSET for _, pair in members)
    if offset and kind == "zero":
        story, remedy = _story(name, measures, kind, [_size(pair, kind) for _, pair in members], members)
        phrases = {"cases": where, "story": story, "remedy": remedy}
        after = min(pair.judged.within_unbiased for _, pair in members)
        return finding_for(
            "compare.offset", f"channels.{name}", phrases=phrases, within_percent=100 * worst,
            corrected_percent=100 * after,
        )  # fmt: skip
    remedy = "see the residual over the cycle; `trunnion identify` fits parameters of the model to the data"
    phrases = {"cases": where, "rms_told": said(rms, unit), "explained": "", "remedy": remedy}
    figures: dict[str, Any] = {"within_percent": 100 * worst, "rms": rms, "several": len(members) > 1, "cause": kind}
    if kind:
        sizes = [_size(pair, kind) for _, pair in members]
        least = min(cause.explains for cause in sizes)
        story, phrases["remedy"] = _story(name, measures, kind, sizes, members)
        alike = {other.kind for _, pair in members for other in pair.others} - {kind}
        also = f"; {' or '.join(KINDS[one] for one in KINDS if one in alike)} would explain as much" if alike else ""
        phrases["explained"] = f"; {story} explains {_share(least)} of its mean square{also}"
        figures["explains"] = least
    return finding_for("compare.not_within", f"channels.{name}", severity=None, phrases=phrases, **figures)


def _size(pair: ChannelComparison, kind: str) -> Cause:
    if pair.cause is not None and pair.cause.kind == kind:
        return pair.cause
    judged = pair.judged  # an offset that is less than nearly all of the residual
    return Cause("zero", judged.bias, (judged.bias / judged.rms) ** 2)


REMEDIES = {
    "flat": "check the sensor, its cable, and the column in the mapping",
    "mirror": "state angle: {sign: -1} in the mapping, or remove it, and check the zero of the angle",
    "sign": "state sign: -1 for the channel in the mapping, or remove it",
    "zero": "check the zero of the channel, and whether the model lacks a load",
    "gain": "check gain and unit of the channel, and dimensions, friction and loads of the model",
    "shift": "check the zero of the angle, also of single files, and delays of the channel",
    "zero and gain": "check zero and gain of the channel, and dimensions, friction and loads of the model",
}
MODEL = "it differs between conditions: check dimensions, friction and loads of the model, not the sensor"


def _story(
    name: str, measures: str, kind: str, sizes: Sequence[Cause], members: Sequence[tuple[Compared, ChannelComparison]]
) -> tuple[str, str]:
    """What would explain it, with its size, and what to do about it."""
    first, pair = members[0]
    unit, values = pair.course.unit, [one.size for one in sizes]
    subject = measures.removeprefix("rate:")
    driver = first.model.run.system.mechanism.drivers.get(subject)
    if driver is not None and driver.speed is not None and kind in ("zero", "gain"):  # not one that swings
        shown, size = pair.course.shown
        speed = float(np.nanmean(pair.course.mean)) / size
        story = _range([one / size for one in values], shown) if kind == "zero" else _percent(values)
        remedy = f"set: {{{subject}.speed: {{mean: {name}}}}} in the mapping uses the measured speed"
        return f"another speed of the driver, measured {said(speed, shown)} ({KINDS[kind]} of {story})", remedy
    if kind == "sign":
        alike = pair.judged.correlation
        story = "a wrong sign" + (f", correlation {alike:+.3f}," if np.isfinite(alike) else "")
    elif kind == "zero":
        story = f"a constant offset of {_range(values, unit)}"
    elif kind == "gain":
        story = f"a gain {_times(values)}" if _times(values) else f"a gain error of {_percent(values)}"
    elif kind == "flat":
        story = f"a constant reading of {_range(values, unit, False)}"
    elif kind == "shift":
        story = _ahead(values, [one for one, _ in members])
    elif kind == "mirror":
        story = KINDS[kind]
    else:
        story = f"an offset of {_range(values, unit)} and a gain error of {_percent([one.gain for one in sizes])}"
    return story, MODEL if kind in ("zero", "gain", "zero and gain") and _differ(kind, sizes, members) else REMEDIES[
        kind
    ]


def _differ(kind: str, sizes: Sequence[Cause], members: Sequence[tuple[Compared, ChannelComparison]]) -> bool:
    """Whether an offset or a gain changes with the condition by more than its uncertainty, as no sensor's does."""
    if kind == "zero and gain":
        gains = [one._replace(size=one.gain) for one in sizes]
        return _differ("zero", sizes, members) or _differ("gain", gains, members)
    values = [one.size for one in sizes]
    spread = max(values) - min(values)
    known = [pair.judged.bias_expanded for _, pair in members]
    typical = [max(float(np.sqrt(np.nanmean(pair.course.mean**2))), 1e-300) for _, pair in members]
    wide = [one if kind == "zero" else one / size for one, size in zip(known, typical, strict=True)]
    return bool(spread > 2 * np.nanmax([*wide, 0.0]) and spread > 0.1 * abs(values[0]))


def _times(values: Sequence[float]) -> str:
    """A gain that is far off, as a factor; empty of others."""
    if max(abs(one) for one in values) < FAR:
        return ""
    low, high = f"{1 + min(values):.3g}", f"{1 + max(values):.3g}"
    return f"{low if low == high else f'{low} to {high}'} times its true value"


def _percent(values: Sequence[float]) -> str:
    low, high = f"{100 * min(values):+.2g}", f"{100 * max(values):+.2g}"
    return f"{low} %" if low == high else f"{low} to {high} %"


# ---- the crank angle ------------------------------------------------------------------------------------------


def _ahead(shares: Sequence[float], found: Sequence[Compared]) -> str:
    spans = [share * one.model.span for share, one in zip(shares, found, strict=True)]
    late = [-share * one.model.run.cycle.duration * 1e3 for share, one in zip(shares, found, strict=True)]
    angle, delay = _range(spans, found[0].model.unit), _range(late, "ms", False)
    return f"an error of {angle} in the crank angle, or a delay of {delay},"


def _shifted(found: Sequence[Compared]) -> list[tuple[str, Compared, Cause]]:
    return [
        (name, one, pair.cause)
        for one in found
        for name, pair in one.pairs.items()
        if pair.cause is not None and pair.cause.kind == "shift" and pair.judged.verdict is Verdict.NOT
    ]


def _agreed(found: Sequence[Compared]) -> bool:
    """Whether all courses that a shift explains are shifted alike, and there are two of them."""
    cases = _shifted(found)
    angles = [cause.size * one.model.span for _, one, cause in cases]
    if len(angles) < 2:
        return False
    return bool(max(angles) - min(angles) <= max(AGREE, 0.2 * max(abs(angle) for angle in angles)))


def _shifts(found: Sequence[Compared]) -> Iterator[Finding]:
    """A shift that the courses have in common is one of the angle."""
    if not _agreed(found):
        return
    cases = _shifted(found)
    ahead = [cause.size * one.model.span for _, one, cause in cases]
    unit, mean = cases[0][1].model.unit, float(np.mean(ahead))
    names = ", ".join(dict.fromkeys(name for name, _, _ in cases))
    where = _in(list(dict.fromkeys(one.condition.name for _, one, _ in cases)), len(found))
    least = min(cause.explains for _, _, cause in cases)
    remedy = f"add {said(mean, unit, True)} to the zero of the angle in the mapping"
    conditions = [one.condition for one in {id(one): one for _, one, _ in cases}.values()]
    if all(one.own_zero for one in conditions) and (entries := zeros_of_files(conditions, [mean] * len(conditions))):
        remedy = f"correct the zeros that the files state: files: [{entries}]"
    phrases = {"cases": where, "channels": names, "range": _range(ahead, unit), "remedy": remedy}
    yield finding_for("compare.angle_shifted", "angle.zero", phrases=phrases, explains_percent=100 * least, mean=mean)


# ---- efficiency, the model, the sensors -----------------------------------------------------------------------


def _efficiencies(found: Sequence[Compared]) -> Iterator[Finding]:
    known = [(one, one.efficiency) for one in found if one.efficiency is not None]
    finite = [(one, of) for one, of in known if np.isfinite([of.measured, of.expanded, of.model]).all()]
    off = [(one, of) for one, of in finite if not of.within]
    if off:
        one, of = max(off, key=lambda case: abs(case[1].measured - case[1].model))
        most = f"; the most in {one.condition.name}" if len(off) > 1 else ""
        phrases = {"cases": _in([case.condition.name for case, _ in off], len(known)), "most": most}
        figures = {"measured": of.measured, "expanded": of.expanded, "model": of.model}
        yield finding_for("compare.efficiency", "efficiency", severity=None, phrases=phrases, **figures)
    for missing in dict.fromkeys(one.unmeasured for one in found if one.unmeasured):
        where = _in([one.condition.name for one in found if one.unmeasured == missing], len(found))
        phrases = {"cases": where}
        yield finding_for("compare.efficiency_unmeasured", "efficiency", phrases=phrases, missing=list(missing))
    for reason in dict.fromkeys(of.reason for _, of in known if of.reason[0]):
        where = _in([one.condition.name for one, of in known if of.reason == reason], len(known))
        phrases = {"cases": where, "reason": reason[0], "remedy": reason[1]}
        yield finding_for("compare.efficiency_unknown", "efficiency", phrases=phrases)


def _speeds(found: Sequence[Compared]) -> Iterator[Finding]:
    """A driver that turned at another speed than the model's."""
    rows = []
    for one in found:
        first = next(iter(one.model.run.system.mechanism.drivers), "")
        if first and one.model.unit == "rad":
            rows.append((one.condition.name, one.condition.speed, one.model.span / one.model.run.cycle.duration))
            driver = first
    if rows:
        yield from other_speed(driver, rows, len(found), speed_unit(driver, [one.condition for one in found]))


def speed_unit(driver: str, conditions: Iterable[Condition]) -> tuple[str, float]:
    """Unit in which the speed of a driver is read, such as U/min, and its size in rad/s; rad/s where it is not read."""
    courses = [one for condition in conditions for one in condition.courses.values()]
    return next((one.shown for one in courses if one.measures == f"rate:{driver}"), ("rad/s", 1.0))


def other_speed(
    driver: str, rows: Sequence[tuple[str, float, float]], of: int, shown: tuple[str, float]
) -> Iterator[Finding]:
    """Of a driver whose speed, by condition as measured and in the model, rad/s, differs; of: conditions in all; shown:
    unit in which it is told, and its size in rad/s."""
    unit, size = shown
    off = [row for row in rows if np.isfinite(row[1]) and abs(row[1] - row[2]) > SLOWER * abs(row[2])]
    if off:
        _, measured, theirs = off[0]
        phrases = {
            "cases": _in([row[0] for row in off], of), "key": as_key(f"{driver}.speed"),
            "measured_told": said(measured / size, unit), "model_told": said(theirs / size, unit),
        }  # fmt: skip
        figures = {"measured": measured, "model": theirs, "driver": driver}
        yield finding_for("compare.speed", f"drivers.{driver}", severity=None, phrases=phrases, **figures)


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
            where = _in([one.condition.name for one, _ in cases], len(found))
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
