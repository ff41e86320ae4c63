"""What would explain a channel that is not within, with its size, and what to do about it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.errors import Finding
from trunnion.results.sentences import finding_for
from trunnion.rig.comparison.assessment import Verdict, difference
from trunnion.rig.comparison.error_sources import KINDS, NEAR, STATED, Cause, beyond_stated
from trunnion.rig.comparison.uncertainty import at_positions, uncertainty_of
from trunnion.rig.comparison.wording import extent, in_which, percent, said, turned
from trunnion.rig.reading.arcs import concentration
from trunnion.rig.reading.log import few_digits
from trunnion.rig.reading.measurement import Condition, zeros_of_files
from trunnion.rig.reading.units_taken import read_as

if TYPE_CHECKING:
    from trunnion.rig.comparison.comparison import ChannelComparison, Compared

__all__ = ["AGREE", "LENGTHS", "corrected", "explained", "hides_friction", "told_in"]

Members = Sequence[tuple["Compared", "ChannelComparison"]]
STANDS_OUT = 2.0  # times the median of the conditions
MUCH = 0.5  # of a mean square, that an offset would explain, to be spoken of
AGREE = np.radians(1.0)  # shifts that differ by less are one
LENGTHS = "an offset alone does not do: check the dimensions of the model"
FAR = 0.5  # of a gain: told as a factor from here on


def explained(name: str, measures: str, kind: str, members: Members, conditions: Sequence[Condition]) -> Finding:
    """A channel that is not within, with what would explain it; conditions: all that have it."""
    where = in_which([one.condition.name for one, _ in members], len(conditions))
    worst = min(pair.judged.within for _, pair in members)
    rms = max(pair.judged.rms for _, pair in members)
    unit, size = told_in(name, members)
    offset = all(pair.judged.verdict is Verdict.OFFSET for _, pair in members)
    if offset and kind == "zero":
        sizes = [_size(pair, kind) for _, pair in members]
        story, remedy = _story(name, measures, kind, sizes, members)
        if _of_motion(name, members) and _beyond(sizes, members):
            remedy = f"check the dimensions of the model, which act alike, then {remedy}"
        phrases = {"cases": where, "story": story, "remedy": remedy}
        after = min(pair.judged.within_unbiased for _, pair in members)
        return finding_for(
            "compare.offset", f"channels.{name}", phrases=phrases, within_percent=100 * worst,
            corrected_percent=100 * after,
        )  # fmt: skip
    remedy = "see the residual over the cycle; `trunnion identify` fits parameters of the model to the data"
    phrases = {
        "cases": where,
        "rms_told": f"{said(rms / size, unit)}{_most(members)}",
        "explained": "",
        "remedy": remedy,
    }
    figures: dict[str, Any] = {"within_percent": 100 * worst, "rms": rms, "several": len(members) > 1, "cause": kind}
    if not kind:
        phrases["explained"], place = _where(members)
        figures |= place
    else:
        sizes = [_size(pair, kind) for _, pair in members]
        least = min(cause.explains for cause in sizes)
        story, phrases["remedy"] = _story(name, measures, kind, sizes, members)
        if kind == "shift":
            entries = _entries(sizes, members, conditions)
            phrases["remedy"] += f"; if it is the zero, {entries}" * bool(entries)
        alike = {other.kind for _, pair in members for other in pair.others} - {kind}
        also = f"; {_others(alike, members)} would explain as much" if alike else ""
        beside = _offset_beside(members) if kind == "friction" and "zero" not in alike else ""
        if kind == "zero":
            beside = _left_over(name, members)
            if _of_motion(name, members):
                phrases["remedy"] = f"{LENGTHS}, then {phrases['remedy']}"
        phrases["explained"] = f"; {story} explains {percent(least)} of its mean square{also}{beside}"
        figures["explains"] = least
    return finding_for("compare.not_within", f"channels.{name}", severity=None, phrases=phrases, **figures)


def _left_over(name: str, members: Members) -> str:
    """What stays once an offset is taken off, which the scatter and the gain do not explain."""
    pair = max((one for _, one in members), key=lambda one: one.judged.rms_unbiased)
    (unit, size), of = told_in(name, members), at_positions(uncertainty_of(pair.course), pair.comparable)
    own = float(np.sqrt(np.nanmean(of.random**2 + of.local**2)))
    times = f", {few_digits(pair.judged.rms_unbiased / own)} times its standard uncertainty" if own > 0 else ""
    return f"; RMS {said(pair.judged.rms_unbiased / size, unit)} remains without it{times}"


def _most(members: Members) -> str:
    """The condition whose residual stands out among those of a finding; empty if none does."""
    sizes = [pair.judged.rms for _, pair in members]
    if len(sizes) < 2 or max(sizes) < STANDS_OUT * float(np.median(sizes)):
        return ""
    return f" in {members[int(np.argmax(sizes))][0].condition.name}"


def _where(members: Members) -> tuple[str, dict[str, float]]:
    """In which part of the cycle most of a residual lies, with its figures; of the condition with the largest."""
    one, pair = max(members, key=lambda case: case[1].judged.rms)
    residual = np.where(pair.comparable, difference(pair.course.mean, pair.model), np.nan)
    found = concentration(residual, one.model.run.cycle.periodic)
    if found is None:
        return "", {}
    start, end = float(one.model.drive[found.first]), float(one.model.drive[found.last])
    first, last = said(start, one.model.unit), said(end, one.model.unit)
    place = f"at {first}" if found.first == found.last else f"from {first} to {last}"
    of = f" in {one.condition.name}" if len(members) > 1 else ""
    return f"; {percent(found.share)} of its mean square{of} lies {place}", {
        "start": start,
        "end": end,
        "share": found.share,
    }


def _offset_beside(members: Members) -> str:
    """What a constant offset would explain where friction explains more: who takes it off hides the friction."""
    sizes = [_size(pair, "zero") for _, pair in members]
    if min(one.explains for one in sizes) < MUCH:
        return ""
    told = extent([one.size for one in sizes], members[0][1].course.unit)
    share = percent(min(one.explains for one in sizes))
    return f"; a constant offset of {told}{_remarks(_beyond(sizes, members))} would explain {share}"


def _others(kinds: set[str], members: Members) -> str:
    """Kinds that explain as much, of an offset with how far it is beyond what is stated."""
    zeros = [_size(pair, "zero") for _, pair in members]
    remarks = {"zero": _remarks(_beyond(zeros, members))}
    return " or ".join(f"{name}{remarks.get(kind, '')}" for kind, name in KINDS.items() if kind in kinds)


def _beyond(sizes: Sequence[Cause], members: Members) -> str:
    """How far an error of zero or gain is beyond what is stated of the sensor; empty if that may be."""
    accuracies = [pair.course.accuracy for _, pair in members]
    rows = zip(sizes, accuracies, strict=True)
    times = [beyond_stated(one, accuracy.zero, accuracy.gain) for one, accuracy in rows]
    if not min(times, default=0.0) > STATED:  # NaN where nothing is stated
        return ""
    low, high = few_digits(min(times)), few_digits(max(times))
    several = low if low == high else f"{low} to {high}"
    return f"{several} times the stated standard uncertainty of the {sizes[0].kind}"


def _remarks(*told: str) -> str:
    """What there is to remark, in brackets."""
    some = "; ".join(one for one in told if one)
    return f" ({some})" if some else ""


def hides_friction(pair: ChannelComparison) -> bool:
    """Whether friction explains a residual that an offset explains too, which is more than the zero of the sensor."""
    zero = pair.course.accuracy.zero
    return pair.cause is not None and pair.cause.kind == "friction" and 0 < STATED * zero < abs(pair.judged.bias)


def _size(pair: ChannelComparison, kind: str) -> Cause:
    if pair.cause is not None and pair.cause.kind == kind:
        return pair.cause
    judged = pair.judged  # an offset that is less than nearly all of the residual
    return Cause("zero", judged.bias, (judged.bias / judged.rms) ** 2)


ACT = "dimensions, friction and loads"
REMEDIES = {
    "flat": "check the sensor, its cable, and the column in the mapping",
    "mirror": "state angle: {sign: -1} in the mapping, or remove it, and check the zero of the angle",
    "drive": "check the column of the channel",
    "sign": "state sign: -1 for the channel in the mapping, or remove it",
    "zero": "check the zero of the channel, and whether the model lacks a load",
    "gain": f"check gain and unit of the channel, and {ACT} of the model",
    "shift": "check the zero of the angle, also of single files, and delays of the channel",
    "friction": "`trunnion identify` fits the friction of the model; a zero that is corrected instead hides it",
    "zero and gain": f"check zero and gain of the channel, and {ACT} of the model",
}
BEYOND = {
    "zero": "that is hardly the zero: check friction and loads of the model, which act alike, and fit them with "
    "`trunnion identify`; a zero that is corrected instead hides them",
    "gain": f"that is hardly the sensor: check unit and range of its amplifier in these files, and {ACT} of the model",
}
UNLIKE_FRICTION = (
    "check the zero of the channel, and loads of the model, which act alike; `trunnion identify` fits zero and friction"
)
MODEL = f"it differs between conditions: check {ACT} of the model, not the sensor"


def _story(name: str, measures: str, kind: str, sizes: Sequence[Cause], members: Members) -> tuple[str, str]:
    """What would explain it, with its size, and what to do about it."""
    first, pair = members[0]
    unit, values = pair.course.unit, [one.size for one in sizes]
    gains = {"gain": values, "zero and gain": [one.gain for one in sizes]}.get(kind, [])
    as_of = read_as([1 + one for one in gains], *pair.course.shown)
    subject = measures.removeprefix("rate:")
    driver = first.model.run.system.mechanism.drivers.get(subject)
    if driver is not None and driver.speed is not None and kind in ("zero", "gain"):  # not one that swings
        shown, size = pair.course.shown
        speed = float(np.nanmean(pair.course.mean)) / size
        story = extent([one / size for one in values], shown) if kind == "zero" else _percent(values)
        story += f", {as_of}" * bool(as_of)
        remedy = f"set: {{{subject}.speed: {{mean: {name}}}}} in the mapping uses the measured speed"
        return f"another speed of the driver, measured {said(speed, shown)} ({KINDS[kind]} of {story})", remedy
    if kind == "sign":
        alike = pair.judged.correlation
        story = "a wrong sign" + (f", correlation {alike:+.3f}," if np.isfinite(alike) else "")
    elif kind == "zero":
        offset = _offset_of(name, values, members)
        story = f"a constant offset of {offset}{_remarks(_beyond(sizes, members), _friction(sizes, members))}"
    elif kind == "gain":
        story = f"a gain {_times(values)}" if _times(values) else f"a gain error of {_percent(values)}"
        story += _remarks(as_of, _beyond(sizes, members))
    elif kind == "flat":
        story = f"a constant reading of {extent(values, unit, False)}"
    elif kind == "shift":
        story = _ahead(values, [one for one, _ in members])
    elif kind == "friction":
        low, high = f"{min(values):.3g}", f"{max(values):.3g}"
        story = f"friction {low if low == high else f'{low} to {high}'} times that of the model"
    elif kind in ("mirror", "drive"):
        story = KINDS[kind]
    else:
        story = f"an offset of {extent(values, unit)} and a gain error of {_percent(gains)}{_remarks(as_of)}"
    if kind in ("zero", "gain", "zero and gain") and _differ(kind, sizes, members):
        remedy = MODEL
    elif kind == "zero" and _of_motion(name, members):
        remedy = _zero(values, members)
    elif kind == "zero" and _friction(sizes, members):
        remedy = UNLIKE_FRICTION
    else:
        remedy = BEYOND[kind] if kind in BEYOND and _beyond(sizes, members) else REMEDIES[kind]
    return story, remedy.replace(ACT, "dimensions") if _of_motion(name, members) else remedy


def _of_motion(name: str, members: Members) -> bool:
    """Whether a channel measures a motion, on which neither friction nor loads act."""
    return members[0][0].model.measures[name].of_motion


def told_in(name: str, members: Members) -> tuple[str, float]:
    """Unit in which figures of a channel are told, and its factor to SI: of a motion that of its readings."""
    course = members[0][1].course
    return course.shown if _of_motion(name, members) else (course.unit, 1.0)


def _precise(value: float, wide: float) -> str:
    """A number with the digits that its uncertainty leaves, but three at least."""
    digits = math.floor(math.log10(abs(value) or 1.0)) - math.floor(math.log10(wide)) + 1 if wide > 0 else 3
    return f"{value + 0.0:+.{min(max(digits, 3), 10)}g}"


def _unsure(values: Sequence[float], members: Members) -> float:
    """How far an offset is not known: by its U, or by what it differs between conditions."""
    known = [pair.judged.bias_expanded for _, pair in members]
    return max(*(one for one in known if math.isfinite(one)), max(values) - min(values), 0.0)


def _offset_of(name: str, values: Sequence[float], members: Members) -> str:
    """An offset in words: of a motion with all digits that are known of it."""
    unit, size = told_in(name, members)
    if not _of_motion(name, members) or unit == "rad":
        return extent(values, unit)
    low, high = (_precise(one / size, _unsure(values, members) / size) for one in (min(values), max(values)))
    return f"{low} {unit}" if low == high else f"{low} to {high} {unit}"


def _zero(values: Sequence[float], members: Members) -> str:
    """What to do about the zero of a channel of a motion."""
    known = {pair.course.nothing for _, pair in members}
    stated = known.pop() if len(known) == 1 else None
    if stated is None:
        return "check the zero of the channel"
    reading, slope, unit = stated
    told = _precise(reading + float(np.mean(values)) / slope, _unsure(values, members) / abs(slope))
    return f"check the zero of the channel; if it is off, state zero: {told.removeprefix('+')} {unit}".rstrip()


def _friction(sizes: Sequence[Cause], members: Members) -> str:
    """What friction explains by its course, where that is clearly less than an offset beyond that stated does."""
    if not _beyond(sizes, members) or any("friction" in {one.kind for one in pair.others} for _, pair in members):
        return ""
    rows = [(one.explains - pair.friction, one, pair) for one, (_, pair) in zip(sizes, members, strict=True)]
    if not all(gap > NEAR for gap, _, _ in rows):  # NaN: friction was not tried
        return ""
    _, least, pair = min(rows, key=lambda row: row[0])
    return f"it explains {percent(least.explains)}, other friction {percent(pair.friction)}"


def corrected(conditions: Sequence[Condition], ahead: Sequence[float], unit: str) -> str:
    """What corrects zeros of the angle that are ahead, rad by condition: the zero that all share, or of each file."""
    alike = max(ahead) - min(ahead) == 0
    if alike and not all(one.own_zero for one in conditions):
        return f"add {turned(ahead[0], unit)} to angle: zero: in the mapping"
    entries = zeros_of_files(conditions, ahead)
    return f"correct the zero of each file: files: [{entries}]" if entries else "correct the zero of each file"


def _entries(sizes: Sequence[Cause], members: Members, conditions: Sequence[Condition]) -> str:
    """What corrects the angle if one channel alone tells of it: empty where not all conditions are off."""
    if len(members) < len(conditions):
        return ""
    spans = [cause.size * one.model.span for cause, (one, _) in zip(sizes, members, strict=True)]
    alike = max(spans) - min(spans) <= AGREE
    return corrected(conditions, [float(np.mean(spans))] * len(spans) if alike else spans, members[0][0].model.unit)


def _differ(kind: str, sizes: Sequence[Cause], members: Members) -> bool:
    """Whether an offset or a gain changes with the condition by more than its uncertainty, as no sensor's does."""
    if kind == "zero and gain":
        gains = [one._replace(size=one.gain) for one in sizes]
        return _differ("zero", sizes, members) or _differ("gain", gains, members)
    values = [one.size for one in sizes]
    spread = max(values) - min(values)
    known = [pair.judged.bias_expanded for _, pair in members]
    typical = [max(float(np.sqrt(np.nanmean(pair.course.read**2))), 1e-300) for _, pair in members]
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


def _ahead(shares: Sequence[float], found: Sequence[Compared]) -> str:
    spans = [share * one.model.span for share, one in zip(shares, found, strict=True)]
    if max(spans) - min(spans) > AGREE:
        told = [f"{one.condition.name}: {turned(span, one.model.unit)}" for one, span in zip(found, spans, strict=True)]
        return f"an error of the crank angle ({'; '.join(told)})"
    late = [-share * one.model.run.cycle.duration * 1e3 for share, one in zip(shares, found, strict=True)]
    angle, delay = extent(spans, found[0].model.unit), extent(late, "ms", False)
    return f"an error of {angle} in the crank angle, or a delay of {delay},"
