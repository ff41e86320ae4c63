"""What a study of tolerances says in words: its summary, limits that are missed, and what is doubtful.

The worst case is that found on the mechanism where it was searched, else that of first order. A yield below 1 and a
C_pk below 1 miss limits too; but where the worst case keeps them no mechanism breaks them, however it scatters. Where a
yield is asked for, that alone decides.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.cycle.findings import of_run, shared_dimensions
from trunnion.cycle.scales import scales_of
from trunnion.dynamics.measured import LONGER, not_steady
from trunnion.errors import Finding, Severity, Status, counted
from trunnion.model.checks.check import check_values
from trunnion.results.attributes import Figure
from trunnion.results.dataset import extreme_place
from trunnion.results.quantities import decimals_of, readable, scale_of, signed
from trunnion.studies.tolerance.effects import Corner
from trunnion.studies.tolerance.linear import MeasureOrder, Table, ToleranceStudy, limited
from trunnion.studies.tolerance.sampling import Indices, Samples

Array = NDArray[np.float64]
Sampled = Mapping[str, Any]  # arrays by the names of `result.VARIABLES`
CLOSE, SLIGHT = 1e-6, 1e-3  # of a limit: rounding, and what first order leaves out where it was kept
OTHERWISE, ENOUGH = 1.5, 100  # ratio of standard deviations that first order does not explain, and samples for it


@dataclass(frozen=True, eq=False)
class Outcome:
    """What the methods that were asked for found; None of those that were not. target: the yield asked for."""

    study: ToleranceStudy
    steps: int
    methods: tuple[str, ...]
    worst: Sequence[tuple[Corner, Corner]] | None = None
    samples: Samples | None = None
    indices: Indices | None = None
    target: float | None = None

    @cached_property
    def table(self) -> Table:
        """The courses at the positions of the result."""
        return self.study.table(self.steps)


def summary(outcome: Outcome, sampled: Sampled | None, units: Sequence[str], dial: Any) -> Iterator[Figure]:
    """Of each measure: nominal figure, worst case, RSS, scatter and yield."""
    run = outcome.study.run
    alone = ", without correlation" if outcome.study.effects.correlated else ""
    for i, (of, unit) in enumerate(zip(outcome.study.orders, units, strict=True)):
        name, deviates = of.measure.name, of.measure.rule == "deviation"
        if not deviates:
            yield Figure(f"{name}.nominal", f"{name}, nominal", of.nominal, unit)
        at = ""
        if of.placed and run.cycle.duration > 0:
            course = np.asarray(outcome.table.courses[i].spread.half if deviates else outcome.table.curves[i], float)
            at = f"at {run.system.dial(run.values, np.array([of.time])).at(0)}"
            at = extreme_place(course, at, scales_of(run).floor(unit))
        lower, upper, rss, _, deviation = map(float, of.total)
        yield Figure(f"{name}.worst_case", f"{name}, worst case, linear", max(-lower, upper), unit, place=at)
        if outcome.worst is not None:
            for end, key, corner in zip(("lower", "upper"), ("least", "largest"), outcome.worst[i], strict=True):
                yield Figure(f"{name}.searched_{end}", f"{name}, {key} deviation found", corner.value, unit)
        yield Figure(f"{name}.rss", f"{name}, RSS{alone}", rss, unit, place=at)
        yield Figure(f"{name}.deviation_linear", f"{name}, standard deviation, linear", deviation, unit, place=at)
        if sampled is not None:
            figures = [("mean", "mean of samples", unit), ("deviation", "standard deviation of samples", unit)]
            if limited(of.measure):
                low = "yield, least by the 95 % interval"
                figures += [("yield", "yield", "1"), ("yield_low", low, "1"), ("cpk", "C_pk", "1")]
            for key, text, figure_unit in figures:
                yield Figure(f"{name}.{key}", f"{name}, {text}", sampled[key][i], figure_unit)
    if sampled is not None:
        if len(units) > 1:
            yield Figure("yield", "yield, all measures", sampled["yield_all"])
        yield Figure("samples", "samples", int(sampled["samples"]))
        yield Figure("samples_failed", "samples not solved", np.sum(sampled["failed"]))


def findings_of(outcome: Outcome, sampled: Sampled | None) -> Iterator[Finding]:
    """Limits that are missed, and what is doubtful, beside what the model itself has to say."""
    study = outcome.study
    target, fine = outcome.target, True
    for i, of in enumerate(study.orders):
        if limited(of.measure) and (missed := _missed(outcome, sampled, i, of)) is not None:
            fine = False
            yield missed
    if fine and target is not None and sampled is not None and float(sampled["yield_all_high"]) < target:
        what = f"limits not met: all measures together: {_yield(sampled, 'yield_all')}, required {100 * target:.6g} %"
        remedy = "narrow the tolerances of the measure with the lowest yield first"
        yield Finding.error("limit.missed_together", "measures", what, remedy, target=target)
    yield from of_run(study.run, notes=False)
    if study.effects.correlated:
        what = "RSS and worst case ignore the correlations; standard deviation, shares of variance and samples include "
        yield Finding.note("tolerance.correlations_left_out", "correlations", f"{what}them")
    yield from shared_dimensions(study.run.system.mechanism)
    yield from _of_tolerances(outcome)
    yield from _nominal(outcome)
    for i, of in enumerate(study.orders):
        yield from _first_order(outcome, sampled, i, of)
    if sampled is not None:
        done = int(sampled["samples"])
        for code, count in enumerate(map(int, sampled["failed"])):
            if count:
                why = list(Status)[code].text if code < len(Status) else "a figure does not exist"
                what = f"{count:,} of {counted(done, 'sample')} ({count / done:.2%}) could not be solved: {why}"
                remedy = "they count as outside every limit; mean and standard deviation are of the others"
                figures = {"count": count, "samples": done, "share": count / done}
                yield Finding.error("samples.no_answer", "tolerances", what, remedy, **figures)
    if outcome.indices is not None and (lost := outcome.indices.lost):
        what = f"{counted(lost, 'sample')} of the variance-based indices not solved, which count as the mean"
        remedy = "narrow the tolerances, or take the measure at a position that all samples reach"
        yield Finding.warning("tolerance.indices_lost", "", what, remedy, count=lost)


# ---- limits that are missed -----------------------------------------------------------------------------------


def _missed(outcome: Outcome, sampled: Sampled | None, i: int, of: MeasureOrder) -> Finding | None:
    """An error for a measure whose worst case, yield or capability is outside its limits, with what helps."""
    study, measure, target = outcome.study, of.measure, outcome.target
    low, high, slight = np.nan, np.nan, CLOSE
    if "linear" in outcome.methods:
        low, high = float(of.total.lower), float(of.total.upper)
    if outcome.worst is not None and all(np.isfinite(corner.value) for corner in outcome.worst[i]):
        (low, high), slight = (corner.value for corner in outcome.worst[i]), SLIGHT
    lower, upper = of.limits
    size = max([abs(end) for end in (lower, upper) if np.isfinite(end)], default=0.0)
    outside = low < lower - slight * size or high > upper + slight * size

    nominal, unit = of.nominal, measure.figure_unit(study.run.system, study.run.values)
    sizes = [end for end in (measure.lower, measure.upper) if end is not None] + [float(part) for part in of.total[:3]]
    factor, unit = scale_of(nominal if np.isfinite(nominal) else 0.0, sizes, unit)
    parts, figures = [], {"worst_lower": low, "worst_upper": high}
    if outside and target is None:
        parts.append(f"worst case {signed(low, factor, '')} to {signed(high, factor, unit)}")
    if sampled is not None:
        figures |= {key: float(sampled[key][i]) for key in ("yield", "yield_low", "yield_high", "cpk")}
        if figures["yield"] < 1 if target is None else figures["yield_high"] < target:
            parts.append(_yield(sampled, "yield", i))
        sure = np.isfinite(low) and np.isfinite(high) and not outside
        if figures["cpk"] < 1 and not sure and target is None:
            parts.append(f"Cpk {figures['cpk']:.3g}")
    if not parts:
        return None
    ends = [signed(end, factor, unit) for end in (measure.lower, measure.upper) if end is not None]
    if target is not None:
        parts.append(f"required {100 * target:.6g} %")
        figures["target_percent"] = 100 * target
    parts += [f"allowed {' to '.join(ends)}"] if ends else []
    if measure.at_least is not None or measure.at_most is not None:
        bounds = {"at least": measure.at_least, "at most": measure.at_most, "nominal": nominal}
        parts += [f"{word} {signed(end, factor, unit, '', 7)}" for word, end in bounds.items() if end is not None]
    what, where = f"limits not met: {'; '.join(parts)}", f"measures.{measure.name}"
    return Finding.error("limit.missed", where, what, _remedy(outcome, of), **figures)


def _yield(sampled: Sampled, name: str, i: int | tuple[()] = ()) -> str:
    """A yield in words, with as many digits as its interval has."""
    share, least, most = (float(sampled[f"{name}{end}"][i]) for end in ("", "_low", "_high"))
    middle, *ends = (f"{100 * part:.{decimals_of(most - least)}f}" for part in (share, least, most))
    return f"yield {middle} % (95 % interval {ends[0]} to {ends[1]} %)"


def _remedy(outcome: Outcome, of: MeasureOrder) -> str:
    """What brings a measure within its limits: another nominal mechanism, or narrower tolerances."""
    lower, upper = of.limits
    # the variance decides a yield, and the worst case knows no correlation
    of_what = "worst case" if outcome.target is None else "variance"
    parts = np.nan_to_num(of.worst.spread.worst if outcome.target is None else of.figure.covariances)
    if lower > 0 or upper < 0 or not np.sum(parts) > 0:
        return "change the nominal mechanism or the limit: tolerances cannot correct it"
    top = int(np.argmax(parts))
    narrow = f"narrow first '{outcome.study.inputs.names[top]}', {100 * parts[top] / np.sum(parts):.3g} % of the"
    return f"{narrow} {of_what}; `trunnion allocate` finds the cheapest tolerances if the model states `costs`"


# ---- what is doubtful -----------------------------------------------------------------------------------------


def _of_tolerances(outcome: Outcome) -> Iterator[Finding]:
    """Limits that let a number be what the model itself would refuse, each name once."""
    mechanism = outcome.study.run.system.mechanism
    numbers, nominal = copy(mechanism.parameter_set), mechanism.parameter_set.nominal
    names, refused = mechanism.variations_by_path, set()
    for tolerance, end in product(outcome.study.inputs.tolerances, ("lower", "upper")):
        where = f"tolerances.{names[tolerance.path][0]}" if tolerance.path in names else tolerance.path
        deviation = getattr(tolerance, end)
        if (where, end) in refused or not np.isfinite(deviation):
            continue
        alias = numbers.entries[tolerance.path].alias or tolerance.path
        numbers.nominal = mechanism.parameters(deviations={alias: deviation})
        changed = [path for path, value in numbers.nominal.items() if value != nominal[path]]
        checked = check_values(mechanism, numbers, changed)
        if wrong := next((finding for finding in checked if finding.severity is Severity.ERROR), None):
            refused.add((where, end))
            what = f"its tolerance includes values which no model may have: {wrong.where} {wrong.what}"
            yield Finding.warning("tolerance.impossible", where, what, value=tolerance.nominal + deviation)


def _nominal(outcome: Outcome) -> Iterator[Finding]:
    """Positions at which the nominal mechanism has no answer, or none to rely on; figures that it has not."""
    study = outcome.study
    dial = study.run.system.dial(study.run.values, outcome.table.plan.times)
    for code in Status:
        places = np.flatnonzero(outcome.table.status == code)
        if len(places) and (code >= Status.NOT_CONVERGED or code == Status.NEAR_SINGULAR):
            severity = Severity.ERROR if code >= Status.NOT_CONVERGED else Severity.WARNING
            at, remedy = dial.intervals(places), "the first-order result there is none to rely on: use the samples"
            what = f"nominal mechanism: {code.text} {at}"
            yield Finding.weighed(severity, "tolerance.nominal_no_answer", "", what, remedy, at=at)
    for of in study.orders:
        if np.isnan(of.nominal):
            what, remedy = f"{of.measure.name}: undefined for the nominal mechanism", "take it where it is defined"
            if of.measure.in_time:
                what, remedy = f"{what}: {not_steady(study.run, of.measure)}", LONGER
            yield Finding.error("tolerance.nominal_no_figure", f"measures.{of.measure.name}", what, remedy)


def _first_order(outcome: Outcome, sampled: Sampled | None, i: int, of: MeasureOrder) -> Iterator[Finding]:
    """A measure of which first order knows nothing, or whose corner or scatter is another on the mechanism."""
    study, where, remedy = outcome.study, f"measures.{of.measure.name}", "use the samples"
    if of.rests and not of.measure.of_motion:
        what = "a joint is momentarily at rest there: friction jumps, and the first-order result is one-sided"
        yield Finding.warning("first_order.one_sided", where, what, remedy)
    if not np.isfinite(of.total.upper):
        yield Finding.warning("first_order.no_answer", where, "the first-order analysis has no result", remedy)
    elif outcome.worst is not None:
        least, most = outcome.worst[i]
        for end, corner in (("least", least), ("largest", most)):
            if not corner.assembles:
                what = f"no result at the tolerance limits that give the {end} deviation to first order"
                steady = f": {not_steady(study.run, of.measure)}" if of.measure.in_time else ""
                yield Finding.warning("first_order.corner_open", where, f"{what}{steady}", remedy, end=end)
    if sampled is not None and int(sampled["samples"]) >= ENOUGH and not of.by_place:
        drawn, linear = float(sampled["deviation"][i]), float(of.total.deviation)
        if max(drawn, linear) > OTHERWISE * min(drawn, linear):  # not of NaN
            unit = of.measure.figure_unit(study.run.system, study.run.values)
            what = f"the standard deviation of the samples is {readable(drawn, unit)}, "
            what += f"the first-order one {readable(linear, unit)}"
            remedy = "use the samples, and --method sobol for the contributions"
            figures = {"found": drawn, "linear": linear}
            yield Finding.warning("first_order.scatter_differs", where, what, remedy, **figures)
