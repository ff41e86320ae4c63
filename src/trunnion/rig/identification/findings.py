"""Findings of an identification."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from trunnion.errors import Finding, Severity, counted
from trunnion.results.sentences import finding_for
from trunnion.rig.comparison import other_speed
from trunnion.rig.identification.blocks import shared_zero
from trunnion.rig.identification.fit import FAR
from trunnion.rig.identification.identifiability import Combination, InseparableUnknowns
from trunnion.rig.identification.identified import Identified
from trunnion.rig.identification.misfit import MisfitCause
from trunnion.rig.identification.number_text import amount, joined
from trunnion.rig.reading.log import few_digits

__all__ = ["findings_of"]

MUCH = 3.0  # times what scatter explains, between conditions
POOR = 2.0  # times what is expected, of predictions
SIMPLE = {(1.0, 1.0): "their sum", (1.0, -1.0): "their difference"}  # of two
OFF = 3.0  # standard uncertainties from what was stated of a sensor


def findings_of(found: Identified) -> list[Finding]:
    """Errors and warnings first."""
    parts = (_speeds, _search, _fit, _channels, _groups, _limits, _sensors, _data, _held)
    rows = [finding for part in parts for finding in part(found)]
    return sorted(rows, key=lambda finding: list(Severity).index(finding.severity))


def _digits(number: float) -> str:
    """A ratio to three digits, without a power of ten."""
    return f"{float(f'{number:.3g}'):,.10g}"


def _speeds(found: Identified) -> Iterator[Finding]:
    """A driver that ran at another speed than the model's."""
    model, conditions = found.problem.model, found.measurement.conditions
    fitted = dict.fromkeys(block.condition for block in found.problem.blocks if block.fitted)
    driver = next(iter(model.run.system.mechanism.drivers), "")
    return other_speed(driver, [(conditions[k], model.driven(k, found.told)[2]) for k in fitted])


def _search(found: Identified) -> Iterator[Finding]:
    """How the search went."""
    search, unknowns = found.search, found.problem.model.unknowns
    if not search.fit.converged:
        yield finding_for("search.not_ended", "search", evaluations=search.fit.evaluations)
    elif not search.settled:
        yield finding_for("search.unsettled", "search")
    if search.other is not None and not np.any(found.lost[: len(unknowns)]):
        values = {one.name: float(value) for one, value in zip(unknowns, search.other, strict=False)}
        told = ", ".join(f"{one.name} = {amount(values[one.name], None, one.unit)}" for one in unknowns)
        yield finding_for("search.other", "search", phrases={"told": told}, values=values)


def _fit(found: Identified) -> Iterator[Finding]:
    """Whether the model fits, what would explain a misfit, and whether turns and conditions repeat."""
    test, problem, spread = found.spread.test, found.problem, found.spread
    if test.misfit:
        worth = "the estimates mean nothing" if found.refuted else "the intervals are widened accordingly"
        chance = "less than 0.01 %" if test.chance < 1e-4 else f"{100 * test.chance:.2g} %"
        phrases = {"chance_told": chance, "reduced_told": _digits(test.reduced), "worth": worth}
        severity = Severity.ERROR if found.refuted else None
        figures = {"reduced": test.reduced, "chance": test.chance}
        yield finding_for("fit.misfit", "fit", severity=severity, phrases=phrases, **figures)
        yield from _causes(found)
    for p in np.flatnonzero((spread.apart > 1) & ~found.lost[: problem.count]) if not found.causes else ():
        where, times = f"parameter {problem.model.unknowns[p].name}", np.sqrt(spread.apart[p])
        severity = Severity.WARNING if times > MUCH else None
        phrases = {"times_told": _digits(times)}
        yield finding_for("fit.conditions_disagree", where, severity=severity, phrases=phrases, times=times)
    fitted = [block for block in problem.blocks if block.fitted]
    if not any(block.repeats for block in fitted):
        yield finding_for("fit.not_repeated", "data")
    pairs = sum(len(block.turns) - 1 for block in fitted)
    if spread.follows > 2 / np.sqrt(max(pairs, 1)):
        yield finding_for("fit.turns_alike", "data", correlation=spread.follows)


def _causes(found: Identified) -> Iterator[Finding]:
    """The error of angle or sensor that explains a misfit, with the estimates that go with it."""
    if not found.causes:
        return
    first, *others = found.causes
    unknowns = found.problem.model.unknowns
    rows = zip(unknowns, first.estimates, first.halves, strict=True)
    estimates = [f"{one.name} = {amount(value, half, one.unit)}" for one, value, half in rows if np.isfinite(half)]
    beyond = f", {few_digits(found.times_stated)} times its stated standard uncertainty,"
    phrases = {
        "story": _story(found, first),
        "also": f"; {' or '.join(_story(found, one) for one in others)} would explain as much" if others else "",
        "estimates": joined(estimates),
        "times": beyond if found.times_stated > FAR else "",
        "left": f", reduced χ² {_digits(first.left.reduced)} remains" if first.left.misfit else "",
        "size_told": f"{np.degrees(first.size):+.3g} deg",
    }
    figures: dict[str, Any] = {"kind": first.kind, "channel": first.channel, "size": first.size}
    values = {one.name: float(value) for one, value in zip(unknowns, first.estimates, strict=True)}
    yield finding_for(
        "fit.cause", "fit", phrases=phrases, expanded=first.expanded, explains_percent=100 * first.explains,
        values=values, **figures,
    )  # fmt: skip


def _story(found: Identified, cause: MisfitCause) -> str:
    """A cause with its size."""
    if cause.kind == "angle":
        return f"an offset of the drive angle of {amount(cause.size, cause.expanded, 'rad').replace(' °', '°')}"
    if cause.kind == "gain":
        return f"a gain error of {cause.channel} of {amount(100 * cause.size, 100 * cause.expanded, '%')}"
    unit = next(block.course.unit for block in found.problem.blocks if block.channel == cause.channel)
    return f"a constant offset of {cause.channel} of {amount(cause.size, cause.expanded, unit)}"


def _channels(found: Identified) -> Iterator[Finding]:
    """Channels that are not used, and those whose zero and gain are taken as exact: of forces that is hardly so."""
    if found.unused:
        yield finding_for("fit.unused", "channels", channels=list(found.unused))
    stated: dict[str, bool] = {}
    for block in found.problem.blocks:
        accuracy = block.course.accuracy
        if block.fitted:
            known = bool(block.effects or shared_zero(accuracy) or accuracy.gain)
            stated[block.channel] = stated.get(block.channel, False) or known
    for of_motion in (False, True):
        bare = [name for name, known in stated.items()
                if not known and found.problem.model.measures[name].of_motion == of_motion]  # fmt: skip
        if bare:
            phrases = {
                "channels": joined(bare),
                "too_narrow": "" if of_motion else ", and the intervals are too narrow",
            }
            severity = Severity.NOTE if of_motion else Severity.WARNING
            yield finding_for("sensor.no_accuracy", "sensors", severity=severity, phrases=phrases)


# ---- what is not identifiable ---------------------------------------------------------------------------------


def _groups(found: Identified) -> Iterator[Finding]:
    """Fewer data than unknowns, unknowns without an effect, and those that are not told apart."""
    problem = found.problem
    used, out = (sum(getattr(one, key) for one in found.misses) for key in ("used", "out"))
    unknowns = problem.count + sum(not one.stated for one in problem.sensors)
    courses = any(one.fitted and one.turns.shape[1] > 1 for one in problem.blocks)  # not one figure of each turn
    if courses and used < unknowns:
        phrases = {"unknowns": counted(unknowns, "unknown"), "out_told": f" ({out} more are left out)" if out else ""}
        yield finding_for("fit.few_positions", "data", phrases=phrases, positions=used, unknowns=unknowns)
        return
    channels = joined(list(dict.fromkeys(block.channel for block in problem.blocks if block.fitted)))
    every = [*(one.name for one in problem.model.unknowns), *(f"the {one.name}" for one in problem.sensors)]
    for group in found.groups:
        names = [every[i] for i in group.members]
        where = f"parameter {names[0]}"
        if len(names) == 1:
            yield finding_for("parameter.no_effect", where, name=names[0], phrases={"channels": channels})
            continue
        same = "the same" if group.exact else "nearly the same"
        phrases = {
            "alike": f"{joined(names)} are not separately identifiable: they have {same} effect on {channels}",
            "known": _known(found, group, names),
        }
        yield finding_for("parameter.not_told_apart", where, phrases=phrases, names=names)


def _known(found: Identified, group: InseparableUnknowns, names: Sequence[str]) -> str:
    """What of unknowns that are not told apart is known, and that the rest is not."""
    if not group.known:
        return "no combination of them is identifiable"
    n = found.problem.count
    units = [found.problem.model.unknowns[i].unit if i < n else "1" for i in group.members]
    told = []
    for one in group.known:
        dimensional = [unit for unit in units if unit not in ("", "1")]
        of_product = dimensional[0] if one.form == "product" and len(dimensional) == 1 else "1"
        unit = _leading(one, units) if one.form == "sum" else of_product
        subject = f"their {one.form}" if one.form != "sum" else _formula(one, names, units)
        if one.form == "sum" and one.factors in SIMPLE:
            subject = SIMPLE[one.factors]
        told.append(f"{subject} is determined, {amount(one.value, one.uncertainty, unit)}")
    return f"{'; '.join(told)}, {'neither' if len(names) == 2 else 'none'} alone"


def _leading(one: Combination, units: Sequence[str]) -> str:
    """SI unit of a combination: that of its first number, whose factor is 1."""
    return next(unit for factor, unit in zip(one.factors, units, strict=True) if factor != 0)


def _formula(one: Combination, names: Sequence[str], units: Sequence[str]) -> str:
    """A sum with its factors and their units, such as `a − 2 1/m b`."""
    parts: list[str] = []
    lead = _leading(one, units)
    for factor, name, unit in zip(one.factors, names, units, strict=True):
        if factor == 0:
            continue
        under = f"({unit})" if set(unit) & set(" /*") else unit
        per = "" if unit == lead else f"{lead} " if unit in ("", "1") else f"{lead}/{under} "
        size = "" if abs(factor) == 1 and not per else f"{abs(factor):.3g} {per}"
        sign = ("− " if factor < 0 else "+ ") if parts else ("−" if factor < 0 else "")
        parts.append(f"{sign}{size}{name}")
    return " ".join(parts)


# ---- limits, sensors, data ------------------------------------------------------------------------------------


def _limits(found: Identified) -> Iterator[Finding]:
    """Estimates on a limit, whose interval is one-sided."""
    low, high = found.interval
    for p, unknown in enumerate(found.problem.model.unknowns):
        if found.limit[p]:
            far, side = (high[p], "at most") if found.limit[p] < 0 else (low[p], "at least")
            ends = [amount(end, None, unknown.unit) for end in (found.estimate[p], far)]
            phrases = {"limit_told": ends[0], "side": side, "far_told": ends[1]}
            figures = {"limit": found.estimate[p], "far": far}
            yield finding_for("parameter.limit", f"parameter {unknown.name}", phrases=phrases, **figures)


def _sensors(found: Identified) -> Iterator[Finding]:
    """Sensors whose error is far from what is stated of it, or would have to be beyond it; not beside what explains."""
    problem, spread = found.problem, found.spread
    for s, sensor in enumerate(problem.sensors) if not (found.causes or spread.test.gross) else ():
        value = spread.beyond.get(s, float(found.x[problem.count + s]))
        if sensor.stated and abs(value) > OFF:
            beyond, of_angle = s in spread.beyond, bool(sensor.angle)
            yield finding_for(
                "sensor.off", "angle.zero" if of_angle else sensor.name, severity=Severity.ERROR if beyond else None,
                phrases={"times_told": few_digits(abs(value))}, times=abs(value), beyond=beyond, of_angle=of_angle,
            )  # fmt: skip


def _data(found: Identified) -> Iterator[Finding]:
    """How many positions are left out."""
    used, out = (sum(getattr(one, key) for one in found.misses) for key in ("used", "out"))
    if out:
        yield finding_for("data.left_out", "data", count=out, positions=used + out)


def _held(found: Identified) -> Iterator[Finding]:
    """Held-out data that are not predicted."""
    if found.trust > POOR:
        conditions = found.measurement.conditions
        names = dict.fromkeys(conditions[found.problem.blocks[one.block].condition].name for one in found.held_out)
        yield finding_for("held_out.missed", "hold_out", phrases={"names": "; ".join(names)}, times=found.trust)
