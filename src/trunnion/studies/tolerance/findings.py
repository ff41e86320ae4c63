"""What a study of tolerances says in words: its summary, limits that are missed, and what is doubtful.

The worst case is that found on the mechanism where it was searched, else that of first order. A yield below 1 and a
C_pk below 1 miss limits too; but where the worst case keeps them no mechanism breaks them, however it scatters. Where a
yield is asked for, that alone decides.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from copy import copy
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.cycle.model_findings import of_run, shared_dimensions
from trunnion.cycle.scales import scales_of
from trunnion.dynamics.measured import LONGER, not_steady
from trunnion.errors import Finding, Severity, Status, agreeing, counted
from trunnion.model.checks.values import check_values
from trunnion.model.parameters import measured
from trunnion.model.tolerances import variations
from trunnion.results.figure import Figure
from trunnion.results.quantities import decimals_of, readable, scale_of, signed
from trunnion.results.scales import extreme_place
from trunnion.studies.tolerance.linear import by_position, limited, limits
from trunnion.studies.tolerance.sampled import CAUSES

if TYPE_CHECKING:
    from trunnion.studies.tolerance.first_order import Outcome
    from trunnion.studies.tolerance.linear import Of
    from trunnion.studies.tolerance.sampled import Sampled

__all__ = ["findings_of", "summary"]

Array = NDArray[np.float64]
TURNED = 0.01  # of the size of the mechanism: a shorter length may well turn round, as the offset of a slide
FAR_OFF = 0.2  # between first order and what is found, of which it is said
CLOSE, SLIGHT = 1e-6, 1e-3  # of a limit: rounding, and what first order leaves out where it was kept
OTHERWISE, ENOUGH = 1.5, 100  # ratio of standard deviations that first order does not explain, and samples for it


def summary(outcome: Outcome, sampled: Sampled | None, units: Sequence[str], dial: Any) -> Iterator[Figure]:
    """Of each measure: nominal figure, worst case, RSS, scatter, yield, and what contributes most."""
    run = outcome.study.run
    alone = ", without correlation" if outcome.study.effects.correlated else ""
    for i, (of, unit) in enumerate(zip(outcome.study.linear.measures, units, strict=True)):
        name, deviates = of.measure.name, of.measure.rule == "deviation"
        if not deviates:
            yield Figure(f"{name}.nominal", f"{name}, nominal", of.reference.figure, unit)
        at = ""
        if of.place >= 0 and run.cycle.duration > 0:
            course = np.asarray(of.course.spread.half if deviates else of.curve, float)
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
                yield Figure(f"{name}.{key}", f"{name}, {text}", sampled.arrays[key][i], figure_unit)
        yield from _contributions(outcome, of)
    if sampled is not None:
        if len(units) > 1:
            yield Figure("yield", "yield, all measures", sampled.arrays["yield_all"])
        yield Figure("samples", "samples", sampled.done)
        yield Figure("samples_failed", "samples not solved", np.sum(sampled.arrays["failed"]))


def _contributions(outcome: Outcome, of: Of) -> Iterator[Figure]:
    """The number that contributes most, by RSS and, of correlated numbers, by variance."""
    name, deviation, halves = of.measure.name, float(of.total.deviation), np.nan_to_num(of.figure.spread.half) ** 2
    shares = {"rss": (halves / np.sum(halves), "share of RSS²")} if np.sum(halves) > 0 else {}
    if outcome.study.effects.correlated and deviation > 0:
        shares["variance"] = of.figure.covariances / deviation**2, "share of the variance"
    for key, (parts, share) in shares.items():
        top = int(np.argmax(parts))
        subject = f"{name}, largest contribution, {outcome.study.inputs.names[top]}, {share}"
        yield Figure(f"{name}.contribution_{key}", subject, parts[top])


def findings_of(outcome: Outcome, sampled: Sampled | None) -> Iterator[Finding]:
    """What is doubtful, beside what the model itself has to say."""
    study = outcome.study
    run = study.run
    yield from _missed(outcome, sampled)
    yield from of_run(run, notes=False)
    if study.effects.correlated:
        what = "RSS and worst case ignore the correlations; standard deviation, shares of variance and samples include "
        yield Finding.note("tolerance.correlations_left_out", "correlations", f"{what}them")
    yield from shared_dimensions(run.system.mechanism)
    yield from _of_tolerances(outcome)
    yield from _nominal(outcome)
    for i, of in enumerate(study.linear.measures):
        yield from _first_order(outcome, i, of)
    if sampled is not None:
        yield from _samples(outcome, sampled)
    if outcome.indices is not None and (lost := outcome.indices.lost):
        what = (
            f"{counted(lost, 'sample')} of the variance-based indices {agreeing(lost, 'was', 'were')} not solved and "
        )
        what += f"{agreeing(lost, 'counts', 'count')} as the mean"
        remedy = "narrow the tolerances, or take the measure at a position that all samples reach"
        yield Finding.warning("tolerance.indices_lost", "", what, remedy, count=lost)


# ---- limits that are missed -----------------------------------------------------------------------------------


def _missed(outcome: Outcome, sampled: Sampled | None) -> Iterator[Finding]:
    """An error for each measure whose worst case, yield or capability is outside its limits, with what helps."""
    target, fine = outcome.target, True
    drawn = sampled.arrays if sampled is not None and sampled.done else None
    for i, of in enumerate(outcome.study.linear.measures):
        if not limited(of.measure):
            continue
        (low, high), outside = _worst(outcome, i, of)
        figures: dict[str, Any] = {"worst_lower": low, "worst_upper": high}
        parts = [_range(outcome, of, sampled, i, low, high)] if outside and target is None else []
        if drawn is not None:
            figures |= {key: float(drawn[key][i]) for key in ("yield", "yield_low", "yield_high", "cpk")}
            share, least, most = (figures[key] for key in ("yield", "yield_low", "yield_high"))
            if share < 1 if target is None else most < target:
                middle, *ends = (
                    f"{100 * share_end:.{decimals_of(most - least)}f}" for share_end in (share, least, most)
                )
                parts.append(f"yield {middle} % (95 % interval {ends[0]} to {ends[1]} %)")
            sure = np.isfinite(low) and np.isfinite(high) and not outside
            if figures["cpk"] < 1 and not sure and target is None:
                parts.append(f"Cpk {figures['cpk']:.3g}")
        if not parts:
            continue
        where, allowed = f"measures.{of.measure.name}", _allowed(outcome, of, sampled, i)
        remedy = _remedy(outcome, of, sampled, i)
        if target is None:
            what = f"limits not met: {'; '.join(parts)}; {allowed}"
            yield Finding.error("limit.missed", where, what, remedy, **figures)
        else:
            fine = False
            what, figures["target_percent"] = f"limits not met: {parts[0]}, required {100 * target:.6g} %", 100 * target
            yield Finding.error("limit.missed_yield", where, f"{what}; {allowed}", remedy, **figures)
    if target is not None and drawn is not None and fine and float(drawn["yield_all_high"]) < target:
        share, least, most = (100 * float(drawn[f"yield_all{end}"]) for end in ("", "_low", "_high"))
        what = f"limits not met: yield of all measures together {share:.6g} % (95 % confidence interval {least:.5g} to "
        what += f"{most:.5g} %), required {100 * target:.6g} %"
        remedy = "narrow the tolerances of the measure with the lowest yield first"
        figures = {"percent": share, "percent_low": least, "percent_high": most, "target_percent": 100 * target}
        yield Finding.error("limit.missed_together", "measures", what, remedy, **figures)


def _worst(outcome: Outcome, i: int, of: Of) -> tuple[tuple[float, float], bool]:
    """Worst case to either side, as far as it was asked for, and whether it is outside the limits."""
    low, high, slight = np.nan, np.nan, CLOSE
    if "linear" in outcome.methods:
        low, high = float(of.total.lower), float(of.total.upper)
    if outcome.worst is not None and all(np.isfinite(corner.value) for corner in outcome.worst[i]):
        (low, high), slight = (corner.value for corner in outcome.worst[i]), SLIGHT
    lower, upper = limits(of)
    size = max([abs(end) for end in (lower, upper) if np.isfinite(end)], default=0.0)
    return (low, high), low < lower - slight * size or high > upper + slight * size


def _scale(outcome: Outcome, of: Of, sampled: Sampled | None, i: int) -> tuple[float, str]:
    """Factor and unit for deviations of a measure, as the tables have them."""
    run, nominal = outcome.study.run, of.reference.figure
    sizes = [end for end in (of.measure.lower, of.measure.upper) if end is not None]
    sizes += [float(part) for part in of.total[:3]]
    if sampled is not None:
        sizes.append(3 * float(sampled.arrays["deviation"][i]))
    unit = of.measure.figure_unit(run.system, run.values)
    return scale_of(nominal if np.isfinite(nominal) else 0.0, sizes, unit)


def _range(outcome: Outcome, of: Of, sampled: Sampled | None, i: int, low: float, high: float) -> str:
    """The worst case in words."""
    factor, unit = _scale(outcome, of, sampled, i)
    worst = "worst case" if outcome.worst is not None else "worst case, first order,"
    lower, upper = limits(of)
    if lower == -upper and low == 0.0:
        return f"{worst} {signed(high, factor, unit, '')}"
    return f"{worst} {signed(low, factor, '')} to {signed(high, factor, unit)}"


def _allowed(outcome: Outcome, of: Of, sampled: Sampled | None, i: int) -> str:
    """The limits in words: deviations, and bounds of the figure itself with the nominal one."""
    measure, (factor, unit), parts = of.measure, _scale(outcome, of, sampled, i), []
    ends = [signed(end, factor, unit) for end in (measure.lower, measure.upper) if end is not None]
    if ends:
        parts.append(f"allowed {' to '.join(ends)}")
    bounds = {"at least": measure.at_least, "at most": measure.at_most, "nominal": of.reference.figure}
    if measure.at_least is not None or measure.at_most is not None:
        parts += [f"{word} {signed(end, factor, unit, '')}" for word, end in bounds.items() if end is not None]
    return ", ".join(parts)


def _remedy(outcome: Outcome, of: Of, sampled: Sampled | None, i: int) -> str:
    """What brings the measure within its limits: another nominal mechanism, other middles, or narrower tolerances."""
    study, (lower, upper) = outcome.study, limits(of)
    if lower > 0 or upper < 0:
        return (
            "the nominal value is outside the limits: change the mechanism or the limit, tolerances cannot correct it"
        )
    if _scatters(of, sampled, i):
        return "first order does not describe this measure: use --method sobol to find what to narrow first"
    spread, names = of.figure.spread, study.inputs.names
    middles = 0.5 * (spread.lower + spread.upper)
    middle = float(np.sum(middles))
    if not np.isfinite(middle):
        return "there is no first-order result: change the nominal mechanism, or narrow the tolerances and sample again"
    if not lower < middle < upper:
        factor, unit = _scale(outcome, of, sampled, i)
        what = f"the middle of the tolerances is off by {signed(middle, factor, unit)}"
        return f"{what}: centre them or change the nominal mechanism, narrower ones cannot correct it"
    # the variance decides a yield, and the worst case knows no correlation
    parts = np.nan_to_num(of.figure.covariances if outcome.target is not None else spread.worst)
    top, total = int(np.argmax(parts)), float(np.sum(parts))
    share = float(parts[top]) / total if total > 0 else 0.0
    of_what = "variance" if outcome.target is not None else "worst case"
    narrow = f"narrow first '{names[top]}', {100 * share:.3g} % of the {of_what}"
    prices = {price.path for price in study.run.system.mechanism.prices()}
    if not prices:
        return f"{narrow}; `trunnion allocate` finds the cheapest tolerances if the model states `costs`"
    unpriced = np.array([name not in prices for name in names])
    low, high = (float(np.sum(np.where(unpriced, end, middles))) for end in (spread.lower, spread.upper))
    if outcome.target is None and not (lower <= low and high <= upper):
        return f"{narrow}; tolerances without a cost, which `trunnion allocate` keeps, exceed the limits by themselves"
    return f"{narrow}; `trunnion allocate` finds the cheapest tolerances"


def _scatters(of: Of, sampled: Sampled | None, i: int) -> tuple[float, float] | None:
    """Standard deviations of the samples and of first order, where they differ so much that the latter means little."""
    if sampled is None or by_position(of.reference) or sampled.done < ENOUGH:
        return None
    drawn, linear = float(sampled.arrays["deviation"][i]), float(of.total.deviation)
    if not np.isfinite(drawn + linear) or not max(drawn, linear) > 0:
        return None
    return None if 1 / OTHERWISE < drawn / max(linear, 1e-300) < OTHERWISE else (drawn, linear)


# ---- what is doubtful -----------------------------------------------------------------------------------------


def _of_tolerances(outcome: Outcome) -> Iterator[Finding]:
    """Measured deviations outside the limits of their numbers; limits that let a number be what the model itself would
    refuse, or a length turn round, each name once."""
    study, mechanism = outcome.study, outcome.study.run.system.mechanism
    numbers, kinds = copy(mechanism.parameter_set), measured(mechanism, mechanism.parameter_set.entries.values())
    names, paths_seen = variations(mechanism), set()
    far = TURNED * float(np.ravel(primal(study.run.system.size(study.run.values)))[0])
    for tolerance in study.inputs.tolerances:
        values = np.atleast_1d(np.asarray(tolerance.options.get("values", 0.0)))
        outside = np.count_nonzero((values < tolerance.lower) | (values > tolerance.upper))
        if tolerance.distribution == "sample" and outside:
            largest = float(values[np.argmax(np.abs(values))])
            what = (
                f"{outside:,} of {len(values):,} measured deviations are outside the tolerance {tolerance.lower:g} to "
            )
            what += f"{tolerance.upper:g}, the largest is {largest:g} (SI units)"
            figures: dict[str, Any] = {"count": outside, "of": len(values), "farthest": largest}
            yield Finding.warning(
                "tolerance.measured_outside", tolerance.path, what, "check the unit of the data", **figures
            )
    for tolerance, end in product(study.inputs.tolerances, ("lower", "upper")):
        where = f"tolerances.{names[tolerance.path][0]}" if tolerance.path in names else tolerance.path
        deviation, unit = getattr(tolerance, end), kinds[tolerance.path].unit
        if (where, end) in paths_seen or not np.isfinite(deviation):
            continue
        paths_seen.add((where, end))
        numbers.nominal = mechanism.parameters(
            deviations={numbers.entries[tolerance.path].alias or tolerance.path: deviation}
        )
        changed = [path for path, value in numbers.nominal.items() if value != mechanism.parameter_set.nominal[path]]
        checked = check_values(mechanism, numbers, changed)
        refused = [finding for finding in checked if finding.severity is Severity.ERROR]
        reached = tolerance.nominal + deviation
        length = tolerance.path.startswith("dimensions.") and unit == "m" and tolerance.nominal > far
        if reached < 0 <= tolerance.nominal and (refused or length):
            what = f"its tolerance includes negative values, down to {readable(reached, unit)}"
            yield Finding.warning("tolerance.negative", where, what, "narrow the tolerance", least=reached)
        elif refused:
            what = f"its tolerance includes {readable(reached, unit)}, which no model may have: {refused[0].where} "
            what += refused[0].what
            yield Finding.warning("tolerance.impossible", where, what, "narrow the tolerance", value=reached)


def _nominal(outcome: Outcome) -> Iterator[Finding]:
    """Positions at which the nominal mechanism has no answer, or none to rely on; figures that it has not."""
    study = outcome.study
    dial = study.run.system.dial(study.run.values, study.plan.times)
    for code in Status:
        places = np.flatnonzero(study.linear.status == code)
        at = dial.intervals(places) if len(places) else ""
        if code >= Status.NOT_CONVERGED and len(places):
            what = f"nominal mechanism: {code.text} {at}"
            yield Finding.error("tolerance.nominal_no_answer", "", what, "there is no result there", at=at)
        elif code == Status.NEAR_SINGULAR and len(places):
            what = f"close to a dead centre {at}: the first-order result is not reliable there"
            yield Finding.warning("tolerance.near_singular", "", what, "use the samples there", at=at)
    for of in study.linear.measures:
        if np.isnan(of.reference.figure):
            where, what = f"measures.{of.measure.name}", f"{of.measure.name}: undefined for the nominal mechanism"
            if of.measure.in_time:
                what = f"{what}: {not_steady(study.run, of.measure)}"
                yield Finding.error("tolerance.nominal_not_steady", where, what, LONGER)
            else:
                remedy = "take it at a position, or over a range, where it is defined"
                yield Finding.error("tolerance.nominal_no_figure", where, what, remedy)


def _first_order(outcome: Outcome, i: int, of: Of) -> Iterator[Finding]:
    """A measure of which first order knows nothing, or whose worst case found is another."""
    where, status = f"measures.{of.measure.name}", outcome.study.linear.status
    if of.place >= 0 and not of.measure.of_motion and status[of.reference.window.index[of.place]] == Status.ZERO_SLIP:
        what = "a joint is momentarily at rest there: friction jumps, and the first-order result is one-sided"
        yield Finding.warning("first_order.one_sided", where, what, "use the samples")
    lower, upper = float(of.total.lower), float(of.total.upper)
    if not np.isfinite(upper):
        what = "the first-order analysis has no result"
        yield Finding.warning("first_order.no_answer", where, what, "use the samples")
    if not np.isfinite(upper) or outcome.worst is None:
        return
    least, most = outcome.worst[i]
    for end, corner in (("least", least), ("largest", most)):
        if not corner.assembles and of.measure.in_time:
            what = f"at the tolerance limits that give the {end} deviation to first order, "
            what += not_steady(outcome.study.run, of.measure)
            yield Finding.warning("first_order.corner_not_steady", where, what, LONGER)
        elif not corner.assembles:
            what = (
                f"the mechanism cannot be solved at the tolerance limits that give the {end} deviation to first order"
            )
            remedy = "within these tolerances it cannot always be assembled"
            yield Finding.warning("first_order.corner_open", where, what, remedy, end=end)
    size, searched = max(-lower, upper), max(-least.value, most.value)
    if np.isfinite(searched) and abs(searched - size) > FAR_OFF * max(size, searched) and max(size, searched) > 0:
        ratio = searched / size if size else np.inf
        what = (
            f"the worst case found by search is {'∞' if np.isinf(ratio) else f'{ratio:.2f}'} times the first-order one"
        )
        remedy = "use the one found by search, and the samples"
        yield Finding.note("first_order.worst_case_differs", where, what, remedy, ratio=ratio)


def _samples(outcome: Outcome, sampled: Sampled) -> Iterator[Finding]:
    """Samples without an answer; measures whose samples scatter quite otherwise than first order says."""
    study, done = outcome.study, sampled.done
    timed = any(of.measure.in_time for of in study.linear.measures)
    absent = "a figure does not exist" + (", or a motion does not run steadily within its duration" if timed else "")
    for code, count in enumerate(map(int, sampled.arrays["failed"])):
        if count:
            why = list(Status)[code].text if code < CAUSES - 1 else absent
            what = f"{count:,} of {counted(done, 'sample')} ({count / done:.2%}) could not be solved: {why}"
            remedy = "they count as outside every limit; mean and standard deviation are of the others"
            figures = {"count": count, "samples": done, "share": count / done}
            yield Finding.error("samples.no_answer", "tolerances", what, remedy, **figures)
    for i, of in enumerate(study.linear.measures):
        if differing := _scatters(of, sampled, i):
            unit = of.measure.figure_unit(study.run.system, study.run.values)
            drawn, linear = (readable(value, unit) for value in differing)
            what = f"the standard deviation of the samples is {drawn}, the first-order one {linear}"
            remedy = (
                "first order and its contributions do not describe this measure: use the samples, and --method sobol "
            )
            remedy += "for the contributions"
            figures = dict(zip(("found", "linear"), differing, strict=True))
            yield Finding.warning("first_order.scatter_differs", f"measures.{of.measure.name}", what, remedy, **figures)
