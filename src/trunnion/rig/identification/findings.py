"""Findings of an identification."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from trunnion.errors import Finding, Severity
from trunnion.results.quantities import with_uncertainty
from trunnion.rig.comparison import other_speed
from trunnion.rig.identification.fit import shared_zero
from trunnion.rig.identification.result import Identified

__all__ = ["findings_of"]

MUCH = 3.0  # times what scatter explains, between conditions
POOR = 2.0  # times what is expected, of predictions
OFF = 3.0  # standard uncertainties from what was stated of a sensor


def findings_of(identified: Identified) -> list[Finding]:
    """Errors and warnings first."""
    fit, conditions = identified.fit, identified.measurement.conditions
    driver, fitted = next(iter(identified.mechanism.drivers), ""), {fit.blocks[k].condition for k in fit.fitted}
    rows = [*other_speed(driver, [(conditions[k], identified.cycles[k].speed) for k in sorted(fitted)])]
    for part in (_fit, _repetitions, _sensors, _parameters):
        rows += part(identified)
    return sorted(rows, key=lambda finding: list(Severity).index(finding.severity))


def _ratio(number: float) -> str:
    """To three digits, without a power of ten."""
    return f"{float(f'{number:.3g}'):,.10g}"


def _joined(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def _fit(identified: Identified) -> Iterator[Finding]:
    """Whether the search converged, the model fits and predicts, and what would explain a misfit."""
    solution, test, ratio = identified.solution, identified.spread.test, identified.hold_out_ratio
    if not (solution.converged and solution.settled):
        what, remedy = "the search did not converge", "give start values closer to the solution, or fewer parameters"
        severity = Severity.WARNING if solution.converged else Severity.ERROR
        yield Finding.weighed(severity, "search.not_ended", "search", what, remedy, evaluations=solution.evaluations)
    if test.misfit:
        worth = "the estimates mean nothing" if identified.refuted else "the intervals are widened accordingly"
        what = f"the model does not fit: reduced χ² {_ratio(test.reduced)} (1 is expected from the scatter between "
        what += f"turns), p-value {max(test.chance, 1e-4):.2g}{' or less' * (test.chance < 1e-4)}; {worth}"
        remedy = "see the residuals; identify another parameter as well, or use another friction law"
        severity = Severity.ERROR if identified.refuted else Severity.WARNING
        figures = {"reduced": test.reduced, "chance": test.chance}
        yield Finding.weighed(severity, "fit.misfit", "fit", what, remedy, **figures)
    if identified.causes:
        first, stories = identified.causes[0], []
        units = {block.channel: block.signal.unit for block in identified.fit.blocks} | {"": "rad"}
        for kind, channel, size, expanded, explains, *_ in identified.causes:
            by, unit = (100.0, "%") if kind == "gain" else (1.0, units[channel])
            of = f"the {kind} of {channel or 'the drive'} off by {with_uncertainty(by * size, by * expanded, unit)}"
            stories.append(f"{of} ({100 * explains:.1f} %)")
        rows = [*zip(identified.fit.model.unknowns, first.estimates, first.halves, strict=True)]
        estimates = [f"{number.name} = {with_uncertainty(value, half, number.unit)}" for number, value, half in rows]
        yield Finding.warning(
            "fit.cause", "fit",
            f"what would explain the misfit: {' or '.join(stories)}; with the first {_joined(estimates)}",
            "check sensor, unit and zero, and lengths and loads of the model, which may act alike",
            kind=first.kind, channel=first.channel, size=first.size, expanded=first.expanded,
            explains_percent=100 * first.explains, values={number.name: float(value) for number, value, _ in rows},
        )  # fmt: skip
    if ratio > POOR:
        what = f"the held-out data differ from the prediction by {ratio:.1f} times its standard uncertainty"
        remedy = "the model lacks an effect that differs there"
        yield Finding.warning("held_out.missed", "hold_out", what, remedy, times=ratio)


def _repetitions(identified: Identified) -> Iterator[Finding]:
    """Whether turns and conditions repeat."""
    fit, spread = identified.fit, identified.spread
    for p, unknown in enumerate(fit.model.unknowns) if not identified.causes else ():
        times = float(np.sqrt(spread.apart[p]))
        if times > 1 and not identified.lost[p]:
            what = f"the conditions disagree: estimates from single ones vary {_ratio(times)} times as much as the "
            what += "scatter between turns explains; the interval is widened accordingly"
            remedy = "look for differences between conditions: settings, speed, temperature, the zero of each file"
            severity = Severity.WARNING if times > MUCH else Severity.NOTE
            where = f"parameter {unknown.name}"
            yield Finding.weighed(severity, "fit.conditions_disagree", where, what, remedy, times=times)
    fitted = [fit.blocks[k] for k in fit.fitted]
    if not any(block.repeats for block in fitted):
        what = "no turn is repeated: the scatter is estimated from the residuals, the model cannot be tested, and the "
        what += "intervals are too narrow if the data are filtered"
        yield Finding.warning("fit.not_repeated", "data", what, "record several turns")
    if spread.follows > 2 / np.sqrt(max(sum(len(block.spread) - 1 for block in fitted), 1)):
        what = f"successive turns are correlated ({spread.follows:.2f}): the intervals are widened accordingly"
        remedy = "look for a drift; warm the rig up"
        yield Finding.warning("fit.turns_alike", "data", what, remedy, correlation=spread.follows)


def _sensors(identified: Identified) -> Iterator[Finding]:
    """Channels whose zero and gain count as exact; errors far from what is stated, where nothing explains a misfit."""
    fit, bare = identified.fit, dict[str, bool]()
    for block in (fit.blocks[k] for k in fit.fitted):
        stated = bool(block.effects or shared_zero(block.signal.accuracy) or block.signal.accuracy.gain)
        bare[block.channel] = bare.get(block.channel, True) and not stated
    if names := [name for name, is_bare in bare.items() if is_bare and not fit.model.measures[name].of_motion]:
        what = f"no accuracy is stated for {_joined(names)}: zero and gain count as exact, and the intervals are too "
        remedy = "state accuracy: {zero: …, gain: …} in the mapping"
        yield Finding.warning("sensor.no_accuracy", "sensors", f"{what}narrow", remedy)
    for s, sensor in enumerate(fit.sensors) if not (identified.causes or identified.spread.test.gross) else ():
        beyond, times = s in identified.beyond, abs(identified.beyond.get(s, float(identified.x[fit.count + s])))
        if sensor.stated and times > OFF:
            what = f"differs from its stated value by {times:.1f} standard uncertainties"
            what += ", which no stated error does: the estimates mean nothing" * beyond
            remedy = "check the sensor, its unit, its stated accuracy, and lengths and loads of the model"
            where, severity = "angle.zero" if sensor.angle else sensor.name, (Severity.WARNING, Severity.ERROR)[beyond]
            yield Finding.weighed(severity, "sensor.off", where, what, remedy, times=times, beyond=beyond)


def _parameters(identified: Identified) -> Iterator[Finding]:
    """Unknowns without an effect, that are not told apart, or that the data hardly determine."""
    fit = identified.fit
    channels = _joined(list(dict.fromkeys(fit.blocks[k].channel for k in fit.fitted)))
    every = [*(unknown.name for unknown in fit.model.unknowns), *(f"the {error.name}" for error in fit.sensors)]
    for group in identified.groups:
        names = [every[i] for i in group.members]
        what = f"{names[0]} is not identifiable: it has no effect on {channels}"
        if len(names) > 1:
            what = f"{_joined(names)} are not separately identifiable: they have the same effect on {channels}; "
            what += group.determined
        remedy = "fix one or more, or measure a quantity that tells them"
        yield Finding.warning("parameter.not_told_apart", f"parameter {names[0]}", what, remedy, names=names)
    for p, unknown in enumerate(fit.model.unknowns) if not identified.refuted else ():
        if identified.vague[p]:  # of a model that does not fit, that is why
            about = with_uncertainty(float(identified.x[p]), float(identified.half[p]), unknown.unit)
            what = f"{unknown.name} is not identifiable: its 95 % interval, {about}, is wider than the value itself"
            remedy = "fix it, or measure a quantity that depends on it more"
            yield Finding.warning("parameter.vague", f"parameter {unknown.name}", what, remedy)
