"""Findings of an identification."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from trunnion.errors import Finding, Severity, agreeing, counted
from trunnion.rig.comparison import other_speed
from trunnion.rig.identification.fit import FAR, shared_zero
from trunnion.rig.identification.identifiability import InseparableUnknowns
from trunnion.rig.identification.misfit import MisfitCause
from trunnion.rig.identification.number_text import amount, few_digits, joined
from trunnion.rig.identification.result import Identified

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
    unknowns, solution = identified.fit.model.unknowns, identified.solution
    if not solution.converged:
        what = f"the search did not converge within {solution.evaluations} evaluations"
        remedy = "give start values closer to the solution, or fewer parameters"
        yield Finding(what, "search", remedy, code="search.not_ended", figures={"evaluations": solution.evaluations})
    elif not solution.settled:
        what = "the search did not converge: the set of usable positions changes with the estimates"
        yield Finding(what, "search", "use a guard of 2 or more", Severity.WARNING, code="search.unsettled")
    if identified.other is not None and not np.any(identified.lost[: len(unknowns)]):
        values = {one.name: float(value) for one, value in zip(unknowns, identified.other, strict=False)}
        text = ", ".join(f"{one.name} = {amount(values[one.name], None, one.unit)}" for one in unknowns)
        yield Finding(
            f"other values fit equally well: {text}", "search", "hold out a condition, or measure more conditions",
            Severity.WARNING, code="search.other", figures={"values": values},
        )  # fmt: skip


def _fit(identified: Identified) -> Iterator[Finding]:
    """Whether the model fits, what would explain a misfit, and whether turns and conditions repeat."""
    fit, spread, test = identified.fit, identified.spread, identified.spread.test
    if test.misfit:
        worth = "the estimates mean nothing" if identified.refuted else "the intervals are widened accordingly"
        chance = "less than 0.01 %" if test.chance < 1e-4 else f"{100 * test.chance:.2g} %"
        yield Finding(
            f"the model does not fit: reduced χ² {_digits(test.reduced)} (1 is expected from the scatter between "
            f"turns), p-value {chance}; {worth}", "fit",
            "see the residuals; identify another parameter as well, or use another friction law",
            Severity.ERROR if identified.refuted else Severity.WARNING, code="fit.misfit",
            figures={"reduced": test.reduced, "chance": test.chance},
        )  # fmt: skip
    if identified.causes:
        yield _cause(identified)
    for p in np.flatnonzero((spread.apart > 1) & ~identified.lost[: fit.count]) if not identified.causes else ():
        times = float(np.sqrt(spread.apart[p]))
        yield Finding(
            f"the conditions disagree: the estimates from single conditions vary {_digits(times)} times as much as "
            "expected from the scatter between turns; the interval is widened accordingly",
            f"parameter {fit.model.unknowns[p].name}",
            "look for differences between conditions: settings, speed, temperature, the zero of each file",
            Severity.WARNING if times > MUCH else Severity.NOTE, code="fit.conditions_disagree",
            figures={"times": times},
        )  # fmt: skip
    fitted = [fit.blocks[k] for k in fit.fitted()]
    if not any(block.repeats for block in fitted):
        yield Finding(
            "no turn is repeated: the scatter is estimated from the residuals, the model cannot be tested, and the "
            "intervals are too narrow if the data are filtered",
            "data", "record several turns", Severity.WARNING, code="fit.not_repeated",
        )  # fmt: skip
    if spread.follows > 2 / np.sqrt(max(sum(len(block.turns) - 1 for block in fitted), 1)):
        what = f"successive turns are correlated ({spread.follows:.2f}): the intervals are widened accordingly"
        remedy, figures = "look for a drift; warm the rig up", {"correlation": spread.follows}
        yield Finding(what, "data", remedy, Severity.WARNING, code="fit.turns_alike", figures=figures)
    if identified.unused:
        what = f"no parameter acts on {', '.join(identified.unused)}: not used in the fit"
        yield Finding(what, "channels", "", Severity.NOTE, code="fit.unused")


def _cause(identified: Identified) -> Finding:
    """The error of angle or sensor that explains a misfit, with the estimates that go with it."""
    first, *others = identified.causes
    unknowns = identified.fit.model.unknowns
    rows = zip(unknowns, first.estimates, first.halves, strict=True)
    estimates = [f"{one.name} = {amount(value, half, one.unit)}" for one, value, half in rows if np.isfinite(half)]
    beyond = identified.times_stated > FAR
    times = f", {few_digits(identified.times_stated)} times its stated standard uncertainty," if beyond else ""
    left = f", reduced χ² {_digits(first.left.reduced)} remains" if first.left.misfit else ""
    also = f"; {' or '.join(_story(identified, one) for one in others)} would explain as much" if others else ""
    stated = "" if beyond else f"; with accuracy: {{{first.kind}: …}} in the mapping it is estimated too"
    degrees, loads = f"{np.degrees(first.size):+.3g} deg", "and lengths and loads of the model, which may act alike"
    remedy = {
        "angle": f"check the zero of the angle; if it is off, add {degrees} to angle: zero: in the mapping",
        "zero": f"check the zero of {first.channel}{stated}",
        "gain": f"check unit and gain of {first.channel}, {loads}{stated}",
    }[first.kind]
    return Finding(
        f"{_story(identified, first)}{times} would explain {100 * first.explains:.0f} % of the misfit{left}{also}; the "
        f"estimates would then be {joined(estimates)}", "fit", remedy, Severity.WARNING, code="fit.cause",
        figures={
            "kind": first.kind, "channel": first.channel, "size": first.size, "expanded": first.expanded,
            "explains_percent": 100 * first.explains,
            "values": {one.name: float(value) for one, value in zip(unknowns, first.estimates, strict=True)},
        },
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
    """Channels whose zero and gain are taken as exact; errors far from what is stated of them, or beyond it, but not
    beside what explains a misfit."""
    fit, spread = identified.fit, identified.spread
    stated: dict[str, bool] = {}
    for block in (fit.blocks[k] for k in fit.fitted()):
        accuracy = block.signal.accuracy
        has_any = bool(block.effects or shared_zero(accuracy) or accuracy.gain)
        stated[block.channel] = stated.get(block.channel, False) or has_any
    bare = [name for name, has in stated.items() if not has and not fit.model.measures[name].of_motion]
    if bare:
        what = (
            f"no accuracy is stated for {joined(bare)}: zero and gain count as exact, and the intervals are too narrow"
        )
        remedy = "state accuracy: {zero: …, gain: …} in the mapping"
        yield Finding(what, "sensors", remedy, Severity.WARNING, code="sensor.no_accuracy")
    for s, sensor in enumerate(fit.sensors) if not (identified.causes or spread.test.gross) else ():
        beyond = s in spread.beyond
        times = abs(spread.beyond.get(s, float(identified.x[fit.count + s])))
        if sensor.stated and times > OFF:
            what = f"differs from its stated value by {times:.1f} standard uncertainties"
            if beyond:
                stated_size = f"{few_digits(times)} stated standard uncertainties"
                what = f"would have to be off by {stated_size}: the estimates mean nothing"
            remedy = "check the sensor, its unit, its stated accuracy, and the loads of the model"
            if sensor.angle:
                remedy = "check the zero of the angle, and the lengths and loads of the model"
            yield Finding(
                what, "angle.zero" if sensor.angle else sensor.name, remedy,
                Severity.ERROR if beyond else Severity.WARNING, code="sensor.off",
                figures={"times": times, "beyond": beyond},
            )  # fmt: skip


# ---- what is not identifiable ---------------------------------------------------------------------------------


def _groups(identified: Identified) -> Iterator[Finding]:
    """Fewer data than unknowns, unknowns without an effect, and those that are not told apart."""
    fit = identified.fit
    used, out = identified.positions
    unknowns = fit.count + sum(not one.stated for one in fit.sensors)
    courses = any(fit.blocks[k].turns.shape[1] > 1 for k in fit.fitted())  # not one figure of each turn
    if courses and used < unknowns:
        left_out = f" ({out} more are left out)" if out else ""
        yield Finding(
            f"{counted(used, 'position')} with data for {counted(unknowns, 'unknown')}{left_out}: they are not "
            "separately identifiable", "data",
            "state more positions: in the mapping, add channels, or identify fewer parameters",
            code="fit.few_positions", figures={"positions": used, "unknowns": unknowns},
        )  # fmt: skip
        return
    channels = joined(list(dict.fromkeys(fit.blocks[k].channel for k in fit.fitted())))
    every = [*(one.name for one in fit.model.unknowns), *(f"the {one.name}" for one in fit.sensors)]
    for group in identified.groups:
        names = [every[i] for i in group.members]
        where = f"parameter {names[0]}"
        if len(names) == 1:
            what = f"{names[0]} is not identifiable: it has no effect on {channels}"
            remedy = "fix it, or measure a quantity that depends on it"
            yield Finding(what, where, remedy, Severity.WARNING, code="parameter.no_effect")
            continue
        yield Finding(
            f"{joined(names)} are not separately identifiable: they have {'' if group.exact else 'nearly '}the same "
            f"effect on {channels}; {_determined(identified, group, names)}", where,
            "fix one or more of them, or measure a quantity that separates them", Severity.WARNING,
            code="parameter.not_told_apart", figures={"names": names},
        )  # fmt: skip


def _determined(identified: Identified, group: InseparableUnknowns, names: Sequence[str]) -> str:
    """What of unknowns that are not told apart is known, and that the rest is not."""
    one, unknowns = group.determined, identified.fit.model.unknowns
    if one is None:
        return "no combination of them is identifiable" if len(names) == 2 else "none of them is known alone"
    units = [unknowns[i].unit if i < len(unknowns) else "1" for i in group.members]
    subject, unit = f"their {one.form}", units[0] or "1"
    if one.form == "sum":
        weighed = f"{names[0]} {'−' if one.factors[1] < 0 else '+'} {abs(one.factors[1]):.3g} {names[1]} (SI)"
        subject = {1.0: "their sum", -1.0: "their difference"}.get(one.factors[1], weighed)
    else:
        dimensional = [unit for unit in units if unit not in ("", "1")]
        unit = dimensional[0] if one.form == "product" and len(dimensional) == 1 else "1"
    return f"{subject} is determined, {amount(one.value, one.uncertainty, unit)}, neither alone"


# ---- limits, data ---------------------------------------------------------------------------------------------


def _limits(identified: Identified) -> Iterator[Finding]:
    """Estimates on a limit, whose interval is one-sided."""
    low, high = identified.interval
    for p, unknown in enumerate(identified.fit.model.unknowns):
        if identified.limit[p]:
            far, side = (high[p], "at most") if identified.limit[p] < 0 else (low[p], "at least")
            limit, end = (amount(value, None, unknown.unit) for value in (identified.estimate[p], far))
            what = f"is at its bound {limit}: {side} {end} (95 %, one-sided)"
            figures = {"limit": identified.estimate[p], "far": far}
            yield Finding(what, f"parameter {unknown.name}", "", Severity.NOTE, code="parameter.limit", figures=figures)


def _data(identified: Identified) -> Iterator[Finding]:
    """How many positions are left out, and held-out data that are not predicted."""
    used, out = identified.positions
    if out:
        yield Finding(
            f"{out:,} of {counted(used + out, 'position')} {agreeing(out, 'is', 'are')} left out: friction reverses, a "
            "joint is at rest, a load has a corner or a jump, the position is close to singular, or the model has no "
            "solution", "data", "", Severity.NOTE, code="data.left_out",
            figures={"count": out, "positions": used + out},
        )  # fmt: skip
    ratio = identified.hold_out_ratio
    if ratio > POOR:
        conditions = identified.measurement.conditions
        names = dict.fromkeys(conditions[one.condition].name for one in identified.fit.blocks if len(one.held))
        yield Finding(
            f"the held-out data ({'; '.join(names)}) differ from the prediction by {ratio:.1f} times its standard "
            "uncertainty (scatter and estimates)", "hold_out", "the model lacks an effect that differs there",
            Severity.WARNING, code="held_out.missed", figures={"times": ratio},
        )  # fmt: skip
