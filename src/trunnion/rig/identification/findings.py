"""Findings of an identification."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from trunnion.errors import Finding, Severity, counted
from trunnion.results.quantities import with_uncertainty
from trunnion.rig.comparison import other_speed
from trunnion.rig.identification.fit import FAR, shared_zero
from trunnion.rig.identification.result import Identified, MisfitCause
from trunnion.rig.identification.uncertainty import InseparableUnknowns

__all__ = ["findings_of"]

MUCH = 3.0  # times what scatter explains, between conditions
POOR = 2.0  # times what is expected, of predictions
OFF = 3.0  # standard uncertainties from what was stated of a sensor


def findings_of(identified: Identified) -> list[Finding]:
    """Errors and warnings first."""
    parts = (_speeds, _search, _fit, _repetitions, _sensors, _groups, _vague, _held_out)
    rows = [finding for part in parts for finding in part(identified)]
    return sorted(rows, key=lambda finding: list(Severity).index(finding.severity))


def _ratio(number: float) -> str:
    """To three digits, without a power of ten."""
    return f"{float(f'{number:.3g}'):,.10g}"


def _joined(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def _speeds(identified: Identified) -> Iterator[Finding]:
    """A driver that ran at another speed than the model's."""
    fit, conditions = identified.fit, identified.measurement.conditions
    fitted = dict.fromkeys(fit.blocks[k].condition for k in fit.fitted())
    driver = next(iter(identified.mechanism.drivers), "")
    return other_speed(driver, [(conditions[k], identified.driven(k)[2]) for k in fitted])


def _search(identified: Identified) -> Iterator[Finding]:
    """How the search went."""
    solution = identified.solution
    if not solution.converged:
        what = f"the search did not converge within {solution.evaluations} evaluations"
        remedy = "give start values closer to the solution, or fewer parameters"
        yield Finding.error("search.not_ended", "search", what, remedy, evaluations=solution.evaluations)
    elif not solution.settled:
        what = "the search did not converge: the set of usable positions changes with the estimates"
        yield Finding.warning("search.unsettled", "search", what, "use a guard of 2 or more")


def _fit(identified: Identified) -> Iterator[Finding]:
    """Whether the model fits, and what would explain a misfit."""
    test = identified.spread.test
    if test.misfit:
        worth = "the estimates mean nothing" if identified.refuted else "the intervals are widened accordingly"
        chance = "less than 0.01 %" if test.chance < 1e-4 else f"{100 * test.chance:.2g} %"
        what = f"the model does not fit: reduced χ² {_ratio(test.reduced)} (1 is expected from the scatter between "
        what += f"turns), p-value {chance}; {worth}"
        remedy = "see the residuals; identify another parameter as well, or use another friction law"
        severity = Severity.ERROR if identified.refuted else Severity.WARNING
        figures = {"reduced": test.reduced, "chance": test.chance}
        yield Finding.weighed(severity, "fit.misfit", "fit", what, remedy, **figures)
    if identified.causes:
        first, unknowns = identified.causes[0], identified.fit.model.unknowns
        rows = zip(unknowns, first.estimates, first.halves, strict=True)
        estimates = [f"{one.name} = {with_uncertainty(value, half, one.unit)}" for one, value, half in rows]
        what = " or ".join(f"{_story(identified, one)} ({100 * one.explains:.1f} %)" for one in identified.causes)
        if identified.times_stated > FAR:
            what += f"; the first is {_ratio(float(f'{identified.times_stated:.2g}'))} times its stated standard "
            what += "uncertainty"
        yield Finding.warning(
            "fit.cause", "fit",
            f"what would explain the misfit: {what}; with the first the estimates are {_joined(estimates)}",
            "check sensor, unit and zero, and lengths and loads of the model, which may act alike",
            kind=first.kind, channel=first.channel, size=first.size, expanded=first.expanded,
            explains_percent=100 * first.explains,
            values={one.name: float(value) for one, value in zip(unknowns, first.estimates, strict=True)},
        )  # fmt: skip


def _story(identified: Identified, cause: MisfitCause) -> str:
    """A cause with its size."""
    if cause.kind == "angle":
        return f"an offset of the drive angle of {with_uncertainty(cause.size, cause.expanded, 'rad')}"
    if cause.kind == "gain":
        return f"a gain error of {cause.channel} of {with_uncertainty(100 * cause.size, 100 * cause.expanded, '%')}"
    unit = next(block.signal.unit for block in identified.fit.blocks if block.channel == cause.channel)
    return f"a zero error of {cause.channel} of {with_uncertainty(cause.size, cause.expanded, unit)}"


def _repetitions(identified: Identified) -> Iterator[Finding]:
    """Whether turns and conditions repeat."""
    fit, spread = identified.fit, identified.spread
    for p in np.flatnonzero((spread.apart > 1) & ~identified.lost[: fit.count]) if not identified.causes else ():
        times = float(np.sqrt(spread.apart[p]))
        what = f"the conditions disagree: the estimates from single conditions vary {_ratio(times)} times as much as "
        what += "expected from the scatter between turns; the interval is widened accordingly"
        remedy = "look for differences between conditions: settings, speed, temperature, the zero of each file"
        severity, where = Severity.WARNING if times > MUCH else Severity.NOTE, fit.model.unknowns[p].name
        yield Finding.weighed(severity, "fit.conditions_disagree", f"parameter {where}", what, remedy, times=times)
    fitted = [fit.blocks[k] for k in fit.fitted()]
    if not any(block.repeats for block in fitted):
        what = "no turn is repeated: the scatter is estimated from the residuals, the model cannot be tested, and the "
        what += "intervals are too narrow if the data are filtered"
        yield Finding.warning("fit.not_repeated", "data", what, "record several turns")
    if spread.follows > 2 / np.sqrt(max(sum(len(block.turns) - 1 for block in fitted), 1)):
        what = f"successive turns are correlated ({spread.follows:.2f}): the intervals are widened accordingly"
        remedy = "look for a drift; warm the rig up"
        yield Finding.warning("fit.turns_alike", "data", what, remedy, correlation=spread.follows)


def _sensors(identified: Identified) -> Iterator[Finding]:
    """Channels whose zero and gain count as exact; errors far from what is stated, but not beside what explains a
    misfit."""
    fit, stated = identified.fit, dict[str, bool]()
    for block in (fit.blocks[k] for k in fit.fitted()):
        accuracy = block.signal.accuracy
        has_any = bool(block.effects or shared_zero(accuracy) or accuracy.gain)
        stated[block.channel] = stated.get(block.channel, False) or has_any
    if bare := [name for name, has in stated.items() if not has and not fit.model.measures[name].of_motion]:
        what = f"no accuracy is stated for {_joined(bare)}: zero and gain count as exact, and the intervals are too "
        yield Finding.warning("sensor.no_accuracy", "sensors", f"{what}narrow",
                              "state accuracy: {zero: …, gain: …} in the mapping")  # fmt: skip
    for s, sensor in enumerate(fit.sensors) if not (identified.causes or identified.spread.test.gross) else ():
        beyond = s in identified.beyond
        times = abs(identified.beyond.get(s, float(identified.x[fit.count + s])))
        if sensor.stated and times > OFF:
            what = f"differs from its stated value by {times:.1f} standard uncertainties"
            what += ", which no stated error does: the estimates mean nothing" * beyond
            remedy = "check the sensor, its unit, its stated accuracy, and lengths and loads of the model"
            where, severity = "angle.zero" if sensor.angle else sensor.name, (Severity.WARNING, Severity.ERROR)[beyond]
            yield Finding.weighed(severity, "sensor.off", where, what, remedy, times=times, beyond=beyond)


def _groups(identified: Identified) -> Iterator[Finding]:
    """Fewer data than unknowns, unknowns without an effect, and those that are not told apart."""
    fit = identified.fit
    used, out = identified.positions
    unknowns = fit.count + sum(not one.stated for one in fit.sensors)
    courses = any(fit.blocks[k].turns.shape[1] > 1 for k in fit.fitted())  # not one figure of each turn
    if courses and used < unknowns:
        left_out = f" ({out} more are left out)" if out else ""
        what = f"{counted(used, 'position')} with data for {counted(unknowns, 'unknown')}{left_out}: they are not "
        remedy = "state more positions: in the mapping, add channels, or identify fewer parameters"
        figures = {"positions": used, "unknowns": unknowns}
        yield Finding.error("fit.few_positions", "data", f"{what}separately identifiable", remedy, **figures)
        return
    channels = _joined(list(dict.fromkeys(fit.blocks[k].channel for k in fit.fitted())))
    every = [*(one.name for one in fit.model.unknowns), *(f"the {one.name}" for one in fit.sensors)]
    for group in identified.groups:
        names = [every[i] for i in group.members]
        where = f"parameter {names[0]}"
        if len(names) == 1:
            what = f"{names[0]} is not identifiable: it has no effect on {channels}"
            remedy = "fix it, or measure a quantity that depends on it"
            yield Finding.warning("parameter.no_effect", where, what, remedy)
            continue
        what = f"{_joined(names)} are not separately identifiable: they have the same "
        what += f"effect on {channels}; {_determined(identified, group, names)}"
        remedy = "fix one or more of them, or measure a quantity that separates them"
        yield Finding.warning("parameter.not_told_apart", where, what, remedy, names=names)


def _vague(identified: Identified) -> Iterator[Finding]:
    """Unknowns that the data hardly determine; of a model that does not fit, that is why."""
    for p in np.flatnonzero(identified.vague) if not identified.refuted else ():
        unknown = identified.fit.model.unknowns[p]
        about = with_uncertainty(float(identified.x[p]), float(identified.half[p]), unknown.unit)
        what = f"{unknown.name} is not identifiable: its 95 % interval, {about}, is wider than the value itself"
        remedy = "fix it, or measure a quantity that depends on it more"
        yield Finding.warning("parameter.vague", f"parameter {unknown.name}", what, remedy)


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
    return f"{subject} is determined, {with_uncertainty(one.value, one.uncertainty, unit)}, neither alone"


def _held_out(identified: Identified) -> Iterator[Finding]:
    """Held-out data that are not predicted."""
    ratio, conditions = identified.hold_out_ratio, identified.measurement.conditions
    if ratio > POOR:
        names = dict.fromkeys(conditions[one.condition].name for one in identified.fit.blocks if len(one.held))
        what = f"the held-out data ({'; '.join(names)}) differ from the prediction by {ratio:.1f} times its standard "
        what += "uncertainty (scatter and estimates)"
        yield Finding.warning("held_out.missed", "hold_out", what, "the model lacks an effect that differs there",
                              times=ratio)  # fmt: skip
