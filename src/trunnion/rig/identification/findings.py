"""Findings of an identification."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from trunnion.errors import Finding, Severity, counted
from trunnion.results.sentences import finding_for
from trunnion.rig.comparison import other_speed
from trunnion.rig.identification.fit import FAR, shared_zero
from trunnion.rig.identification.identifiability import Combination, InseparableUnknowns
from trunnion.rig.identification.identified import Identified
from trunnion.rig.identification.misfit import MisfitCause
from trunnion.rig.identification.number_text import amount, joined
from trunnion.rig.reading.log import few_digits

__all__ = ["findings_of"]

MUCH = 3.0  # times what scatter explains, between conditions
POOR = 2.0  # times what is expected, of predictions
OFF = 3.0  # standard uncertainties from what was stated of a sensor


def findings_of(identified: Identified) -> list[Finding]:
    """Errors and warnings first."""
    parts = (_speeds, _search, _fit, _sensors, _groups, _limits, _data)
    rows = [finding for part in parts for finding in part(identified)]
    return sorted(rows, key=lambda finding: list(Severity).index(finding.severity))


def _digits(number: float) -> str:
    """A ratio to three digits, without a power of ten."""
    return f"{float(f'{number:.3g}'):,.10g}"


def _speeds(identified: Identified) -> Iterator[Finding]:
    """A driver that ran at another speed than the model's."""
    fit, conditions = identified.fit, identified.measurement.conditions
    fitted = dict.fromkeys(fit.blocks[k].condition for k in fit.fitted())
    driver = next(iter(identified.mechanism.drivers), "")
    return other_speed(driver, [(conditions[k], fit.model.driven(k, identified.values)[2]) for k in fitted])


def _search(identified: Identified) -> Iterator[Finding]:
    """How the search went."""
    unknowns = identified.fit.model.unknowns
    if not identified.solution.converged:
        yield finding_for("search.not_ended", "search", evaluations=identified.solution.evaluations)
    elif not identified.solution.settled:
        yield finding_for("search.unsettled", "search")
    if identified.other is not None and not np.any(identified.lost[: len(unknowns)]):
        values = {one.name: float(value) for one, value in zip(unknowns, identified.other, strict=False)}
        text = ", ".join(f"{one.name} = {amount(values[one.name], None, one.unit)}" for one in unknowns)
        yield finding_for("search.other", "search", phrases={"told": text}, values=values)


def _fit(identified: Identified) -> Iterator[Finding]:
    """Whether the model fits, what would explain a misfit, and whether turns and conditions repeat."""
    fit, spread, test = identified.fit, identified.spread, identified.spread.test
    if test.misfit:
        phrases = {
            "chance_told": "less than 0.01 %" if test.chance < 1e-4 else f"{100 * test.chance:.2g} %",
            "reduced_told": _digits(test.reduced),
            "worth": "the estimates mean nothing" if identified.refuted else "the intervals are widened accordingly",
        }
        severity = Severity.ERROR if identified.refuted else None
        figures = {"reduced": test.reduced, "chance": test.chance}
        yield finding_for("fit.misfit", "fit", severity=severity, phrases=phrases, **figures)
    if identified.causes:
        yield _cause(identified)
    else:
        for p in np.flatnonzero((spread.apart > 1) & ~identified.lost[: fit.count]):
            where, times = f"parameter {fit.model.unknowns[p].name}", np.sqrt(spread.apart[p])
            severity = Severity.WARNING if times > MUCH else None
            phrases = {"times_told": _digits(times)}
            yield finding_for("fit.conditions_disagree", where, severity=severity, phrases=phrases, times=times)
    fitted = [fit.blocks[k] for k in fit.fitted()]
    if not any(block.repeats for block in fitted):
        yield finding_for("fit.not_repeated", "data")
    if spread.follows > 2 / np.sqrt(max(sum(len(block.turns) - 1 for block in fitted), 1)):
        yield finding_for("fit.turns_alike", "data", correlation=spread.follows)
    if identified.unused:
        yield finding_for("fit.unused", "channels", channels=list(identified.unused))


def _cause(identified: Identified) -> Finding:
    """The error of angle or sensor that explains a misfit, with the estimates that go with it."""
    first, *others = identified.causes
    unknowns = identified.fit.model.unknowns
    rows = zip(unknowns, first.estimates, first.halves, strict=True)
    estimates = [f"{one.name} = {amount(value, half, one.unit)}" for one, value, half in rows if np.isfinite(half)]
    times = f", {few_digits(identified.times_stated)} times its stated standard uncertainty,"
    phrases = {
        "story": _story(identified, first),
        "also": f"; {' or '.join(_story(identified, one) for one in others)} would explain as much" if others else "",
        "estimates": joined(estimates),
        "times": times if identified.times_stated > FAR else "",
        "left": f", reduced χ² {_digits(first.left.reduced)} remains" if first.left.misfit else "",
        "size_told": f"{np.degrees(first.size):+.3g} deg",
    }
    values = {one.name: float(value) for one, value in zip(unknowns, first.estimates, strict=True)}
    return finding_for(
        "fit.cause", "fit", phrases=phrases, kind=first.kind, channel=first.channel, size=first.size,
        expanded=first.expanded, explains_percent=100 * first.explains, values=values,
    )  # fmt: skip


def _story(identified: Identified, cause: MisfitCause) -> str:
    """A cause with its size."""
    if cause.kind == "angle":
        return f"an offset of the drive angle of {amount(cause.size, cause.expanded, 'rad').replace(' °', '°')}"
    if cause.kind == "gain":
        return f"a gain error of {cause.channel} of {amount(100 * cause.size, 100 * cause.expanded, '%')}"
    unit = next(block.signal.unit for block in identified.fit.blocks if block.channel == cause.channel)
    return f"a constant offset of {cause.channel} of {amount(cause.size, cause.expanded, unit)}"


def _sensors(identified: Identified) -> Iterator[Finding]:
    """Channels whose zero and gain are taken as exact, which of forces they hardly are, and errors far from what is
    stated of them, or beyond it; not beside what explains a misfit."""
    fit, spread = identified.fit, identified.spread
    stated: dict[str, bool] = {}
    for block in (fit.blocks[k] for k in fit.fitted()):
        accuracy = block.signal.accuracy
        has_any = bool(block.effects or shared_zero(accuracy) or accuracy.gain)
        stated[block.channel] = stated.get(block.channel, False) or has_any
    for of_motion, severity, narrow in (
        (False, Severity.WARNING, ", and the intervals are too narrow"), (True, Severity.NOTE, ""),
    ):  # fmt: skip
        bare = [name for name, has in stated.items() if not has and fit.model.measures[name].of_motion == of_motion]
        if bare:
            phrases = {"channels": joined(bare), "too_narrow": narrow}
            yield finding_for("sensor.no_accuracy", "sensors", severity=severity, phrases=phrases)
    if identified.causes or spread.test.gross:
        return
    for s, sensor in enumerate(fit.sensors):
        value, beyond = spread.beyond.get(s, float(identified.x[fit.count + s])), s in spread.beyond
        if sensor.stated and abs(value) > OFF:
            where = "angle.zero" if sensor.angle else sensor.name
            phrases = {"times_told": few_digits(abs(value))}
            figures = {"times": abs(value), "beyond": beyond, "of_angle": bool(sensor.angle)}
            yield finding_for(
                "sensor.off", where, severity=Severity.ERROR if beyond else None, phrases=phrases, **figures
            )


# ---- what is not identifiable ---------------------------------------------------------------------------------


def _groups(identified: Identified) -> Iterator[Finding]:
    """Fewer data than unknowns, unknowns without an effect, and those that are not told apart."""
    fit = identified.fit
    used, out = (sum(getattr(one, key) for one in identified.misses.values()) for key in ("used", "out"))
    unknowns = fit.count + sum(not one.stated for one in fit.sensors)
    courses = any(fit.blocks[k].turns.shape[1] > 1 for k in fit.fitted())  # not one figure of each turn
    if courses and used < unknowns:
        phrases = {"unknowns": counted(unknowns, "unknown"), "out_told": f" ({out} more are left out)" if out else ""}
        yield finding_for("fit.few_positions", "data", phrases=phrases, positions=used, unknowns=unknowns)
        return
    channels = joined(list(dict.fromkeys(fit.blocks[k].channel for k in fit.fitted())))
    every = [*(one.name for one in fit.model.unknowns), *(f"the {one.name}" for one in fit.sensors)]
    for group in identified.groups:
        names = [every[i] for i in group.members]
        where = f"parameter {names[0]}"
        if len(names) == 1:
            yield finding_for("parameter.no_effect", where, name=names[0], phrases={"channels": channels})
            continue
        same = "the same" if group.exact else "nearly the same"
        phrases = {
            "alike": f"{joined(names)} are not separately identifiable: they have {same} effect on {channels}",
            "known": _determined(identified, group, names),
        }
        yield finding_for("parameter.not_told_apart", where, phrases=phrases, names=names)


def _determined(identified: Identified, group: InseparableUnknowns, names: Sequence[str]) -> str:
    """What of unknowns that are not told apart is known, and that the rest is not."""
    one, unknowns = group.determined, identified.fit.model.unknowns
    if one is None:
        return "no combination of them is identifiable" if len(names) == 2 else "none of them is known alone"
    units = [unknowns[i].unit if i < len(unknowns) else "1" for i in group.members]
    subject, unit = f"their {one.form}", units[0] or "1"
    if one.form == "sum":
        subject = {1.0: "their sum", -1.0: "their difference"}.get(one.factors[1]) or _formula(one, names, units)
    else:
        dimensional = [unit for unit in units if unit not in ("", "1")]
        unit = dimensional[0] if one.form == "product" and len(dimensional) == 1 else "1"
    return f"{subject} is determined, {amount(one.value, one.uncertainty, unit)}, neither alone"


def _formula(one: Combination, names: Sequence[str], units: Sequence[str]) -> str:
    """A sum with its factor and its unit, such as `a − 2 1/m b`."""
    lead, unit = ("1" if one_unit in ("", "1") else one_unit for one_unit in units)
    under = f"({unit})" if set(unit) & set(" /*") else unit
    per = "" if unit == lead else f" {lead}" if unit == "1" else f" {lead}/{under}"
    size = "" if abs(one.factors[1]) == 1 and not per else f"{abs(one.factors[1]):.3g}{per} "
    return f"{names[0]} {'−' if one.factors[1] < 0 else '+'} {size}{names[1]}"


# ---- limits, data ---------------------------------------------------------------------------------------------


def _limits(identified: Identified) -> Iterator[Finding]:
    """Estimates on a limit, whose interval is one-sided."""
    low, high = identified.interval
    for p, unknown in enumerate(identified.fit.model.unknowns):
        if identified.limit[p]:
            far, side = (high[p], "at most") if identified.limit[p] < 0 else (low[p], "at least")
            ends = [amount(end, None, unknown.unit) for end in (identified.estimate[p], far)]
            phrases = {"limit_told": ends[0], "side": side, "far_told": ends[1]}
            figures = {"limit": identified.estimate[p], "far": far}
            yield finding_for("parameter.limit", f"parameter {unknown.name}", phrases=phrases, **figures)


def _data(identified: Identified) -> Iterator[Finding]:
    """How many positions are left out, and held-out data that are not predicted."""
    used, out = (sum(getattr(one, key) for one in identified.misses.values()) for key in ("used", "out"))
    if out:
        yield finding_for("data.left_out", "data", count=out, positions=used + out)
    ratio = identified.hold_out_ratio
    if ratio > POOR:
        conditions = identified.measurement.conditions
        names = dict.fromkeys(conditions[identified.fit.blocks[k].condition].name for k in identified.held_out)
        yield finding_for("held_out.missed", "hold_out", phrases={"names": "; ".join(names)}, times=ratio)
