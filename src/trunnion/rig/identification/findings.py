"""What there is to say of an identification, in sentences."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from trunnion.errors import Finding, Severity, Status
from trunnion.results.sentences import finding_for
from trunnion.rig.comparison.error_sources import KINDS
from trunnion.rig.comparison.findings import other_speed
from trunnion.rig.comparison.wording import said
from trunnion.rig.identification.assessment import Assessment
from trunnion.rig.identification.fit import FAR
from trunnion.rig.identification.identifiability import Combination, InseparableUnknowns, known_of, sizes_of
from trunnion.rig.identification.misfit import MisfitCause, OwnSize
from trunnion.rig.identification.number_text import amount, joined, share
from trunnion.rig.identification.outstanding import Outstanding, outstanding
from trunnion.rig.identification.sensor_findings import exact_channels, of_sensors
from trunnion.rig.identification.uncertainty import quantile
from trunnion.rig.reading.log import few_digits
from trunnion.rig.reading.measurement import zeros_of_files
from trunnion.rig.reading.units_taken import read_as

__all__ = ["sentences"]

ALIKE = 0.95  # correlation from which two are hardly told apart
WELL = 0.03  # of an estimate: U of one that is known well all the same
MUCH = 3.0  # times what scatter explains, between conditions
POOR = 2.0  # times what is expected, of predictions
MOST_NAMED = 3
SMALL = 0.2  # of the largest: what a condition has of an error to be named with it
MOST_TOLD = 4
FEW = 5.0  # degrees of freedom
DOUBTFUL = 0.05  # a chance below which a misfit is spoken of
OF_DRIVE = "its readings are the angle of the drive: check the column of the channel"
OF_GAIN = "a gain error of {:+.2g} % would explain it: check gain and unit of the channel, and lengths of the model"
LENGTH = "check the lengths of the model and the zero of the angle, or identify a length that acts on it"
FACTOR = 0.5  # of a gain: told as a factor from here on
NUMBERS = ("no", "one", "two", "three", "four", "five", "six")


def sentences(judged: Assessment) -> list[Finding]:
    """Errors and warnings first."""
    parts = (_speeds, _search, _fit, _unused, _groups, _near, _limits, of_sensors, exact_channels, _data, _held)
    found = [one for part in parts for one in part(judged)]
    order = (Severity.ERROR, Severity.WARNING, Severity.NOTE)
    return sorted(found, key=lambda one: order.index(one.severity))


def _count(number: int, what: str) -> str:
    return f"{NUMBERS[number] if number < len(NUMBERS) else f'{number:,}'} {what}{'s' * (number != 1)}"


def _times(number: float) -> str:
    """A ratio to three digits, without a power of ten."""
    return f"{float(f'{number:.3g}'):,.10g}"


def _search(judged: Assessment) -> Iterator[Finding]:
    """How the search went."""
    search, problem = judged.found.search, judged.problem
    if search.shared < 1:
        yield finding_for("search.start", "start", share=search.shared)
    if problem.refused:
        phrases = {"told": _count(problem.refused, "step")}
        yield finding_for("search.refused", "search", phrases=phrases, count=problem.refused)
    if not search.fit.converged:
        yield finding_for("search.not_ended", "search", evaluations=search.fit.evaluations)
    elif not search.settled:
        yield finding_for("search.unsettled", "search")
    lost = judged.lost[: problem.count]
    if search.other is not None and not np.any(lost):
        pairs = list(zip(problem.model.unknowns, (float(value) for value in search.other), strict=False))
        phrases = {"told": ", ".join(f"{one.name} = {amount(value, None, one.unit)}" for one, value in pairs)}
        yield finding_for("search.other", "search", phrases=phrases, values={one.name: value for one, value in pairs})


def _fit(judged: Assessment) -> Iterator[Finding]:
    """Whether the model fits, and whether turns repeat."""
    test, problem, refuted = judged.found.spread.test, judged.problem, judged.refuted
    if test.misfit:
        chance = "less than 0.01 %" if test.chance < 1e-4 else f"{100 * test.chance:.2g} %"
        worth = "the estimates mean nothing" if refuted else "the intervals are widened accordingly"
        phrases = {"chance_told": chance, "reduced_told": _times(test.reduced), "worth": worth}
        severity = Severity.ERROR if refuted else None
        yield finding_for(
            "fit.misfit", "fit", severity=severity, phrases=phrases, reduced=test.reduced, chance=test.chance
        )
        yield from _causes(judged)
    elif test.chance < DOUBTFUL:
        phrases = {"chance_told": f"{100 * test.chance:.2g} %", "reduced_told": _times(test.reduced)}
        yield finding_for("fit.doubtful", "fit", phrases=phrases, reduced=test.reduced, chance=test.chance)
    if any(one.severity is Severity.ERROR for one in _speeds(judged)):
        return  # which is mended first
    odd = outstanding(judged) if test.misfit else None
    if odd is not None:
        yield _stands_out(odd)
    apart = judged.found.spread.apart
    for p in np.flatnonzero((apart > 1) & ~judged.lost[: problem.count]):
        if any(not one.own for one in judged.found.causes):  # which explain this, too
            break
        where, times = f"parameter {problem.model.unknowns[p].name}", np.sqrt(apart[p])
        severity = Severity.WARNING if times > MUCH else None
        remedy = "look for differences between conditions: settings, speed, temperature, the zero of each file"
        if odd is not None and odd.others:
            remedy = f"see {odd.channel} in {odd.condition}, whose residual stands out"
        phrases = {"times_told": _times(times), "remedy": remedy}
        yield finding_for("fit.conditions_disagree", where, severity=severity, phrases=phrases, times=times)
    single = [block for block in problem.blocks if block.fitted and not block.repeats]
    if single and len(single) == sum(block.fitted for block in problem.blocks):
        yield finding_for("fit.not_repeated", "data")
    freedom = judged.found.spread.freedom[: problem.count][~judged.lost[: problem.count]]
    if freedom.size and np.min(freedom) < FEW and not refuted:
        least = round(float(np.min(freedom)))
        yield finding_for("fit.freedom", "data", phrases={"told": _count(least, "degree")}, degrees=least)
    follows = judged.found.spread.follows
    pairs = sum(len(block.turns) - 1 for block in problem.blocks if block.fitted)
    if follows > 2 / np.sqrt(max(pairs, 1)):
        yield finding_for("fit.turns_alike", "data", correlation=follows)


def _unused(judged: Assessment) -> Iterator[Finding]:
    """Channels that are not fitted, a warning of those that the model misses all the same."""
    unused = judged.found.unused
    if unused is None or not unused.blocks:
        return
    ahead = any(one.kind in ("shift", "delay") for one in judged.found.causes)  # which holds for it too
    missing = {} if ahead else unused.missing(judged.told, judged.late)
    fine = [name for name in dict.fromkeys(block.channel for block in unused.blocks) if name not in missing]
    if fine:
        steps = any(one.kind == "delay" and not one.channel for one in judged.problem.sensors)  # of the angle
        more = [name for name in unused.moving(judged.told) if steps and name in fine]
        names = dict.fromkeys([*(block.channel for block in judged.problem.blocks), *more])
        taken = " ".join(f"--channel {name}" for name in names if more)
        yield finding_for("fit.unused", "channels", channels=fine, phrases={"taken": taken})
    units = {block.channel: block.course.shown for block in unused.blocks}
    for name, one in missing.items():
        unit, size = units[name]
        phrases = {
            "rms_told": said(one.rms / size, unit), "known_told": said(one.expected / size, unit),
            "of": "once its zero and gain are fitted" if one.shape else "about the mean",
            "by": "scatter" if one.shape else "standard uncertainty",
            "remedy": OF_DRIVE if one.drive else LENGTH if np.isnan(one.gain) else OF_GAIN.format(100 * one.gain),
        }  # fmt: skip
        yield finding_for("fit.unused_missed", f"channels.{name}", phrases=phrases, rms=one.rms, expected=one.expected)


def _stands_out(odd: Outstanding) -> Finding:
    """The condition that a misfit lies in, and where in the cycle."""
    others = f", in the others up to {few_digits(odd.others)} times" if odd.others else ""
    figures: dict[str, Any] = {"rms": odd.rms, "expected": odd.expected, "others": odd.others}
    place = ""
    if odd.place is not None:
        start, end = (np.degrees(one) for one in odd.place)
        place = f"; {share(odd.share)} of its mean square lies from {start:.0f}° to {end:.0f}° of the driver"
        figures |= {"start": odd.place[0], "end": odd.place[1], "share": odd.share}
    subject = f"the residual of {odd.channel} in {odd.condition}"
    phrases = {
        "subject": f"{subject} stands out" if odd.others else subject,
        "rms_told": f"RMS {said(odd.rms, odd.unit)}", "times_told": few_digits(odd.times),
        "others_told": others, "place": place,
    }  # fmt: skip
    return finding_for(
        "fit.stands_out", "fit", phrases=phrases, channel=odd.channel, condition=odd.condition,
        several=bool(odd.others), **figures,
    )  # fmt: skip


def _causes(judged: Assessment) -> Iterator[Finding]:
    """The error of angle or sensor that explains a misfit, with the estimates that go with it."""
    found, problem = judged.found.causes, judged.problem
    if not found:
        return
    first = found[0]
    also = [_story(judged, one) for one in found[1:]]
    also_told = f"; {' or '.join(also)} would explain as much" if also else ""
    lengths = [one.channel for one in found if one.kind == "length"]
    unit = {"shift": "rad", "delay": "s", "length": "m", "zero": _unit_of(judged, first.channel)}.get(first.kind, "1")
    phrases = {
        "story": _story(judged, first), "also": also_told, "estimates": _estimates(judged, first),
        "channel": " or ".join(lengths) if first.kind == "length" else first.channel,
        "times": f", {few_digits(judged.times_stated)} times its stated standard uncertainty,"
        if judged.times_stated > FAR else "",
        "left": f", reduced χ² {_times(first.left.reduced)} remains" if first.left.misfit else "",
        "lengths": f"check {' or '.join(lengths)} of the model first (--parameter {lengths[0]} identifies it); "
        if lengths and first.kind != "length" else "",
        "odd": joined(_odd(judged, first)), "files": _zeros(judged, first),
        "size_told": amount(first.size, None, unit) if first.kind != "shift" else f"{np.degrees(first.size):+.3g} deg",
    }  # fmt: skip
    each: dict[str, Any] = {"conditions": {_condition(judged, one): one.size for one in first.own}} if first.own else {}
    yield finding_for(
        "fit.cause", "fit", phrases=phrases, kind=first.kind, size=first.size,
        expanded=first.expanded, explains_percent=100 * first.explains, **each,
        values={one.name: float(value) for one, value in zip(problem.model.unknowns, first.estimates, strict=True)},
    )  # fmt: skip


def _estimates(judged: Assessment, one: MisfitCause) -> str:
    """What the unknowns would be with a cause."""
    rows = zip(judged.problem.model.unknowns, one.estimates, one.halves, strict=True)
    return joined([f"{own.name} = {amount(value, half, own.unit)}" for own, value, half in rows if np.isfinite(half)])


def _zeros(judged: Assessment, one: MisfitCause) -> str:
    """Zeros of the angle that single files are to state; empty where that is not what corrects them."""
    conditions = judged.found.measurement.conditions
    if one.kind != "shift":
        return ""
    if one.own:
        odd = {own.condition: own.size for own in one.own if abs(own.size) > own.expanded}
        return zeros_of_files(conditions, [odd.get(k, 0.0) for k in range(len(conditions))])
    stated = [condition for condition in conditions if condition.own_zero]
    return zeros_of_files(stated, [one.size] * len(stated)) if len(stated) == len(conditions) else ""


def _unit_of(judged: Assessment, channel: str) -> str:
    return next((one.course.unit for one in judged.problem.blocks if one.channel == channel), "1")


def _condition(judged: Assessment, one: OwnSize) -> str:
    return judged.found.measurement.conditions[one.condition].name


def _apart(one: MisfitCause) -> tuple[list[OwnSize], list[OwnSize]]:
    """The conditions that carry an error, the largest first, and the others."""
    least = SMALL * abs(one.size)
    odd = [own for own in one.own if abs(own.size) > max(own.expanded, least)]
    return sorted(odd, key=lambda own: -abs(own.size)), [own for own in one.own if own not in odd]


def _odd(judged: Assessment, one: MisfitCause) -> list[str]:
    return [_condition(judged, own) for own in _apart(one)[0][:MOST_TOLD]] or [""]


def _story(judged: Assessment, one: MisfitCause) -> str:
    """A cause with its size, that of each condition where they do not share it."""
    what = {
        "shift": "an offset of the drive angle",
        "delay": "a delay of all channels",
        "zero": f"a constant offset of {one.channel}",
        "gain": f"a gain error of {one.channel}",
        "length": f"a length {one.channel} {'larger' if one.size > 0 else 'smaller'} than the model's by",
    }.get(one.kind)
    if one.kind == "length":
        with_it = f" (with {_estimates(judged, one)})" if one is not judged.found.causes[0] else ""
        return f"{what} {amount(abs(one.size), one.expanded, 'm')}{with_it}"
    if what is None:
        return f"{KINDS[one.kind]} of {one.channel}"
    if not one.own and one.kind == "gain" and abs(one.size) >= FACTOR:
        value, as_of = amount(1 + one.size, one.expanded, "1"), _read_as(judged, one)
        return f"a gain of {one.channel} {value} times its true value{as_of and f' ({as_of})'}"
    as_of = _read_as(judged, one)
    if not one.own:
        return f"{what} of {_sized(judged, one, one.size, one.expanded)}{as_of and f' ({as_of})'}"
    odd, others = _apart(one)
    told = [f"{_condition(judged, own)}: {_sized(judged, one, own.size, own.expanded)}" for own in odd[:MOST_TOLD]]
    told += [f"{len(odd) - MOST_TOLD} more conditions"] * (len(odd) > MOST_TOLD)
    told += [as_of] * bool(as_of)
    rest = "the other" if len(others) == 1 else "the others"
    beyond = [abs(own.size) for own in others if abs(own.size) > own.expanded]
    if beyond:
        told.append(f"{rest} up to {_sized(judged, one, max(beyond), None)}")
    elif others:
        told.append(f"{rest} 0 within U")
    alone = "in single conditions" if others else "that differs between the conditions"
    return f"{what} {alone} ({'; '.join(told)})"


def _read_as(judged: Assessment, one: MisfitCause) -> str:
    """The unit that another was taken for, where a wrong gain is near the ratio of the two; else empty."""
    course = next((block.course for block in judged.problem.blocks if block.channel == one.channel), None)
    if one.kind != "gain" or course is None:
        return ""
    sizes = [own.size for own in _apart(one)[0]] if one.own else [one.size]
    return read_as([1 + size for size in sizes], *course.shown)


def _of_unit(judged: Assessment) -> bool:
    """Whether what explains a misfit is a unit taken for another."""
    return any(_read_as(judged, one) for one in judged.found.causes[:1])


def _sized(judged: Assessment, one: MisfitCause, size: float, expanded: float | None) -> str:
    """A size of a cause with its U and unit."""
    unit, factor = {"shift": ("rad", 1.0), "delay": ("ms", 1e3), "gain": ("%", 100.0)}.get(
        one.kind, (_unit_of(judged, one.channel), 1.0)
    )
    if expanded is None:
        return f"{few_digits(np.degrees(size))}°" if unit == "rad" else f"{few_digits(size * factor)} {unit}"
    return amount(size * factor, expanded * factor, unit).replace(" °", "°")


def _speeds(judged: Assessment) -> Iterator[Finding]:
    """A driver that ran at another speed than the model's."""
    model = judged.problem.model
    driver = next(iter(model.run.system.mechanism.drivers), "")
    conditions = judged.found.measurement.conditions
    fitted = dict.fromkeys(block.condition for block in judged.problem.blocks if block.fitted)
    yield from other_speed(driver, [(conditions[k], model.driven(k, judged.told)[2]) for k in fitted])


# ---- what is not identifiable ---------------------------------------------------------------------------------


def _groups(judged: Assessment) -> Iterator[Finding]:
    problem = judged.problem
    used = sum(
        int(np.count_nonzero(mask)) for mask, one in zip(problem.masks, problem.blocks, strict=True) if one.fitted
    )
    many = problem.count + sum(not one.stated for one in problem.sensors)
    courses = any(one.fitted and one.turns.shape[1] > 1 for one in problem.blocks)  # not one figure of each turn
    if courses and used < many:
        out = sum(one.out for one in judged.misses)
        phrases = {"unknowns": _count(many, "unknown"), "out_told": f" ({out} more are left out)" if out else ""}
        yield finding_for("fit.few_positions", "data", phrases=phrases, positions=used, unknowns=many)
        return
    for group in [] if _of_unit(judged) else judged.found.groups:
        names = [_name(judged, i) for i in group.members]
        channels = joined(list(dict.fromkeys(block.channel for block in judged.problem.blocks if block.fitted)))
        where = f"parameter {names[0]}"
        if len(group.members) == 1:
            yield finding_for("parameter.no_effect", where, name=names[0], phrases={"channels": channels})
            continue
        same = "the same" if group.exact else "nearly the same"
        alike = f"{joined(names)} are not separately identifiable: they have {same} effect on {channels}"
        some = "one" if len(names) == 2 else "some"
        phrases = {"alike": alike, "known": _known(judged, group, names), "some": some}
        yield finding_for("parameter.not_told_apart", where, phrases=phrases, names=names)


def _near(judged: Assessment) -> Iterator[Finding]:
    """Pairs that are separately identifiable, but badly: what of them is known far better than either.

    Not those that are both known well, nor where a wrong unit makes nonsense of both.
    """
    n = 0 if _of_unit(judged) else judged.problem.count
    size = sizes_of(judged.problem, judged.found.x)
    half = quantile(judged.found.spread.freedom) * judged.deviation
    well = half[: judged.problem.count] < WELL * np.abs(judged.estimate)
    for p in range(n):
        for q in range(p):
            if not abs(judged.correlation[p, q]) > ALIKE or (well[p] and well[q]):  # NaN of what is not identifiable
                continue
            pair = (q, p)
            known = known_of(judged.problem, judged.found.x, judged.found.spread, pair, size)
            names = [_name(judged, i) for i in pair]
            together = f"{judged.correlation[p, q]:.3f}".replace("-", "−")
            best = (
                f": {_known(judged, InseparableUnknowns(pair, known, exact=False), names, short=True)}" if known else ""
            )
            phrases = {"known": best, "correlation_told": together}
            correlation = judged.correlation[p, q]
            yield finding_for(
                "parameter.hardly_told_apart", f"parameter {names[1]}", phrases=phrases, other=names[0],
                correlation=correlation,
            )  # fmt: skip


def _name(judged: Assessment, i: int) -> str:
    problem = judged.problem
    if i < problem.count:
        return problem.model.unknowns[i].name
    return f"the {problem.sensors[i - problem.count].name}"


def _known(judged: Assessment, group: InseparableUnknowns, names: Sequence[str], short: bool = False) -> str:
    """What of them is known, and that the rest is not; short: of what is known only."""
    if not group.known:
        return "no combination of them is identifiable"
    units = [_unit(judged, i) for i in group.members]
    pair = len(names) == 2
    if pair:
        one = group.known[0]
        with_unit = [unit for unit in units if unit not in ("", "1")]
        of_product = with_unit[0] if one.form == "product" and len(with_unit) == 1 else "1"
        result = amount(one.value, one.uncertainty, _leading(one, units) if one.form == "sum" else of_product)
        if short:
            subject = f"their {one.form}" if one.form != "sum" else _formula(one, names, units)
            return f"{subject} = {result} is determined best"
        other = {"sum": "difference", "product": "ratio", "ratio": "product"}[one.form]
        if one.form == "sum" and one.factors == (1.0, 1.0):
            return f"their sum is determined, {result}, their {other} is not"
        if one.form == "sum" and one.factors == (1.0, -1.0):
            return f"their difference is determined, {result}, their sum is not"
        if one.form != "sum":
            return f"their {one.form} is determined, {result}, neither alone"
        return f"{_formula(one, names, units)} = {result} is determined, neither alone"
    listed = "; ".join(
        f"{_formula(one, names, units)} = {amount(one.value, one.uncertainty, _leading(one, units))}"
        for one in group.known
    )
    many = f"{_count(len(group.known), 'combination')} of them {'is' if len(group.known) == 1 else 'are'} determined"
    return f"{many}, none alone: {listed}"


def _unit(judged: Assessment, i: int) -> str:
    """SI unit of an unknown; errors of sensors are in their standard uncertainties."""
    return judged.problem.model.unknowns[i].unit if i < judged.problem.count else "1"


def _leading(one: Combination, units: Sequence[str]) -> str:
    """SI unit of a combination: that of its first number, whose factor is 1."""
    return next(unit for factor, unit in zip(one.factors, units, strict=True) if factor != 0)


def _formula(one: Combination, names: Sequence[str], units: Sequence[str]) -> str:
    parts: list[str] = []
    lead = _leading(one, units)
    for factor, name, unit in zip(one.factors, names, units, strict=True):
        if factor == 0:
            continue
        per = "" if unit == lead else f"{_ratio(lead, unit)} "
        size = "" if abs(factor) == 1 and not per else f"{abs(factor):.3g} {per}"
        sign = ("− " if factor < 0 else "+ ") if parts else ("−" if factor < 0 else "")
        parts.append(f"{sign}{size}{name}")
    return " ".join(parts)


def _ratio(over: str, under: str) -> str:
    """A unit by another: 1/m, N m/rad."""
    if under in ("", "1"):
        return over
    return f"{over}/({under})" if set(under) & set(" /*") else f"{over}/{under}"


# ---- limits, sensors, data ------------------------------------------------------------------------------------


def _limits(judged: Assessment) -> Iterator[Finding]:
    low, high = judged.interval
    for p, unknown in enumerate(judged.problem.model.unknowns):
        where = f"parameter {unknown.name}"
        if judged.limit[p]:
            end = judged.estimate[p]
            far = high[p] if judged.limit[p] < 0 else low[p]
            side = "at most" if judged.limit[p] < 0 else "at least"
            ends = [amount(one, None, unknown.unit) for one in (end, far)]
            phrases = {"limit_told": ends[0], "side": side, "far_told": ends[1]}
            yield finding_for("parameter.limit", where, phrases=phrases, limit=end, far=far)
            continue
        size = max(abs(judged.estimate[p]), unknown.size)
        half = quantile(judged.found.spread.freedom[p]) * judged.deviation[p]
        if size > 0 and half > size and not judged.refuted:
            value = judged.estimate[p]
            phrases = {"told": amount(value, half, unknown.unit)}
            yield finding_for("parameter.hardly_known", where, phrases=phrases, value=value, half=half)


def _data(judged: Assessment) -> Iterator[Finding]:
    """What was left out."""
    problem = judged.problem
    courses = problem.courses(judged.found.x)
    used, out = (sum(getattr(one, key) for one in judged.misses) for key in ("used", "out"))
    if out:
        yield finding_for("data.left_out", "data", count=out, positions=used + out)
    locked = sum(int(np.count_nonzero(status == Status.LOCKED)) for status in courses.status)
    lost = sum(int(np.count_nonzero(status >= Status.NOT_CONVERGED)) for status in courses.status) - locked
    for number, why in ((locked, "locked by friction"), (lost, "without a solution")):
        if number:
            yield finding_for("fit.no_answer", "fit", phrases={"why": why}, count=number)


def _held(judged: Assessment) -> Iterator[Finding]:
    """How well what was held out is predicted."""
    rows = judged.held_out
    if not rows:
        return
    trust = judged.trust
    conditions = judged.found.measurement.conditions
    held = list(dict.fromkeys(conditions[judged.problem.blocks[one.block].condition].name for one in rows))
    names = "; ".join(held) if len(held) <= MOST_NAMED else f"{len(held)} conditions"
    phrases = {"names": names}
    if not np.isfinite(trust):
        yield finding_for("held_out.untested", "hold_out", phrases=phrases)
    else:
        code = "held_out.missed" if trust > POOR else "held_out.predicted"
        yield finding_for(code, "hold_out", phrases=phrases, times=trust)
