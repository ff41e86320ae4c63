"""What a study of tolerances says in words: its summary, and its findings."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from copy import copy
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.cycle.findings import model_notes, shared_dimensions
from trunnion.cycle.scales import scales_of
from trunnion.dynamics.measured import LONGER, not_steady
from trunnion.errors import Finding, Severity, Status, agreeing, counted
from trunnion.model.checks.values import check_values
from trunnion.model.parameters import measured
from trunnion.model.tolerances import variations
from trunnion.results.figure import Figure
from trunnion.results.quantities import readable
from trunnion.results.scales import extreme_place
from trunnion.studies.tolerance.sampled import CAUSES
from trunnion.studies.tolerance.targets import limited, missed, scatters

if TYPE_CHECKING:
    from trunnion.studies.tolerance.linear import Of
    from trunnion.studies.tolerance.outcome import Outcome
    from trunnion.studies.tolerance.sampled import Sampled

__all__ = ["findings_of", "summary"]

Array = NDArray[np.float64]
TURNED = 0.01  # of the size of the mechanism: a shorter length may well turn round, as the offset of a slide
FAR_OFF = 0.2  # between first order and what is found, of which it is said


def summary(outcome: Outcome, sampled: Sampled | None, units: Sequence[str], dial: Any) -> Iterator[Figure]:
    """Of each measure: nominal figure, worst case, RSS, scatter, yield, and what contributes most."""
    for i, (of, unit) in enumerate(zip(outcome.study.linear.measures, units, strict=True)):
        yield from _of_measure(outcome, of, i, unit, dial)
        if sampled is not None:
            yield from _of_samples(sampled, of, i, unit)
        yield from _contributions(outcome, of)
    if sampled is None:
        return
    if len(units) > 1:
        yield Figure("yield", "yield, all measures", sampled.arrays["yield_all"])
    yield Figure("samples", "samples", sampled.done)
    yield Figure("samples_failed", "samples not solved", np.sum(sampled.arrays["failed"]))


def _of_measure(outcome: Outcome, of: Of, i: int, unit: str, dial: Any) -> Iterator[Figure]:
    name = of.measure.name
    if of.measure.rule != "deviation":
        yield Figure(f"{name}.nominal", f"{name}, nominal", of.reference.figure, unit)
    placed = of.place >= 0 and outcome.study.run.cycle.duration > 0
    course = np.asarray(of.course.spread.half if of.measure.rule == "deviation" else of.curve, float)
    run = outcome.study.run
    at = f"at {run.system.dial(run.values, np.array([of.time])).at(0)}" if placed else ""
    at = at and extreme_place(course, at, scales_of(outcome.study.run).floor(unit))
    lower, upper, rss, _, deviation = map(float, of.total)
    yield Figure(f"{name}.worst_case", f"{name}, worst case, linear", max(-lower, upper), unit, place=at)
    if outcome.worst is not None:
        for end, key, corner in zip(("lower", "upper"), ("least", "largest"), outcome.worst[i], strict=True):
            yield Figure(f"{name}.searched_{end}", f"{name}, {key} deviation found", corner.value, unit)
    alone = ", without correlation" if outcome.study.effects.correlated else ""
    yield Figure(f"{name}.rss", f"{name}, RSS{alone}", rss, unit, place=at)
    yield Figure(f"{name}.deviation_linear", f"{name}, standard deviation, linear", deviation, unit, place=at)


def _of_samples(sampled: Sampled, of: Of, i: int, unit: str) -> Iterator[Figure]:
    name = of.measure.name
    told = [("mean", "mean of samples", unit), ("deviation", "standard deviation of samples", unit)]
    if limited(of.measure):
        told += [
            ("yield", "yield", "1"),
            ("yield_low", "yield, least by the 95 % interval", "1"),
            ("cpk", "C_pk", "1"),
        ]
    for key, text, own in told:
        yield Figure(f"{name}.{key}", f"{name}, {text}", sampled.arrays[key][i], own)


def _contributions(outcome: Outcome, of: Of) -> Iterator[Figure]:
    """The number that contributes most, by RSS and by variance."""
    halves = np.nan_to_num(of.figure.spread.half) ** 2
    if np.sum(halves) > 0:
        yield _most(outcome, of, "rss", halves / np.sum(halves), "share of RSS²")
    deviation = float(of.total.deviation)
    if outcome.study.effects.correlated and deviation > 0:
        parts = of.figure.covariances / deviation**2
        yield _most(outcome, of, "variance", parts, "share of the variance")


def _most(outcome: Outcome, of: Of, key: str, parts: Array, what: str) -> Figure:
    name, top = of.measure.name, int(np.argmax(parts))
    subject = f"{name}, largest contribution, {outcome.study.inputs.names[top]}, {what}"
    return Figure(f"{name}.contribution_{key}", subject, parts[top])


def findings_of(outcome: Outcome, sampled: Sampled | None) -> Iterator[Finding]:
    """What is doubtful, beside what the model itself has to say."""
    study = outcome.study
    mechanism = study.run.system.mechanism
    yield from missed(outcome, sampled)
    yield from (one for one in model_notes(mechanism, study.run.system) if one.severity is not Severity.NOTE)
    yield from study.run.chosen.findings
    if study.run.determinacy is not None:
        yield from study.run.determinacy.findings()
    loaded = [seat.joint for seat in study.run.seats if seat.given is None]
    if loaded:
        yield Finding.note(
            "tolerance.seats_not_taken",
            "joints",
            f"the pins of {', '.join(loaded)} can be anywhere in their holes here: that the model "
            "has them pressed by the load (seat: loaded) is left out, and scatter and limits are "
            "about the mechanism with every pin in the middle of its hole",
            "`trunnion analyse` has the shift by that seat; pins that are always pressed one way: state seat: {xi: …}",
            joints=loaded,
        )
    if study.effects.correlated:
        yield Finding.note(
            "tolerance.correlations_left_out",
            "correlations",
            "RSS and worst case ignore the correlations; standard deviation, shares of variance "
            "and samples include them",
        )
    yield from shared_dimensions(mechanism)
    yield from _measured(outcome)
    yield from _impossible(outcome)
    yield from _range_ends(outcome)
    yield from _nominal(outcome)
    for of in study.linear.measures:
        yield from _first_order(outcome, of)
    if sampled is not None:
        yield from _samples(outcome, sampled)
    if outcome.indices is not None and outcome.indices.lost:
        yield Finding.warning(
            "tolerance.indices_lost",
            "",
            f"{counted(outcome.indices.lost, 'sample')} of the variance-based indices "
            f"{agreeing(outcome.indices.lost, 'was', 'were')} not solved and "
            f"{agreeing(outcome.indices.lost, 'counts', 'count')} as the mean",
            "narrow the tolerances, or take the measure at a position that all samples reach",
            count=outcome.indices.lost,
        )


def _measured(outcome: Outcome) -> Iterator[Finding]:
    """Measured deviations outside the limits of their numbers."""
    for one in outcome.study.inputs.tolerances:
        values = np.atleast_1d(np.asarray(one.options.get("values", 0.0)))
        outside = np.count_nonzero((values < one.lower) | (values > one.upper))
        if one.distribution == "sample" and outside:
            far = float(values[np.argmax(np.abs(values))])
            what = f"{outside:,} of {len(values):,} measured deviations are outside the tolerance {one.lower:g} to "
            what += f"{one.upper:g}, the largest is {far:g} (SI units)"
            figures: dict[str, Any] = {"count": outside, "of": len(values), "farthest": far}
            yield Finding.warning("tolerance.measured_outside", one.path, what, "check the unit of the data", **figures)


def _impossible(outcome: Outcome) -> Iterator[Finding]:
    """Limits that let a number be what the model itself would refuse, or a length turn round; each name once."""
    study, mechanism = outcome.study, outcome.study.run.system.mechanism
    numbers, kinds = copy(mechanism.parameter_set), measured(mechanism, mechanism.parameter_set.entries.values())
    names, seen = variations(mechanism, numbers), set()
    far = TURNED * float(np.ravel(primal(study.run.system.size(study.run.values)))[0])
    for one, end in product(study.inputs.tolerances, ("lower", "upper")):
        where = f"tolerances.{names[one.path][0]}" if one.path in names else one.path
        deviation, unit = getattr(one, end), kinds[one.path].unit
        if (where, end) in seen or not np.isfinite(deviation):
            continue
        seen.add((where, end))
        numbers.nominal = mechanism.parameters(deviations={numbers.entries[one.path].alias or one.path: deviation})
        changed = [path for path, value in numbers.nominal.items() if value != mechanism.parameter_set.nominal[path]]
        refused = [one for one in check_values(mechanism, numbers, changed) if one.severity is Severity.ERROR]
        reached = one.nominal + deviation
        length = one.path.startswith("dimensions.") and unit == "m" and one.nominal > far
        if reached < 0 <= one.nominal and (refused or length):
            yield Finding.warning(
                "tolerance.negative",
                where,
                f"its tolerance includes negative values, down to {readable(reached, unit)}",
                "narrow the tolerance",
                least=reached,
                unit=unit,
            )
        elif refused:
            why = f"{refused[0].where} {refused[0].what}"
            yield Finding.warning(
                "tolerance.impossible",
                where,
                f"its tolerance includes {readable(reached, unit)}, which no model may have: {why}",
                "narrow the tolerance",
                value=reached,
                unit=unit,
            )


def _range_ends(outcome: Outcome) -> Iterator[Finding]:
    """Tolerances that move the range or the start of a driver, which samples do not follow."""
    study, mechanism = outcome.study, outcome.study.run.system.mechanism
    parameters, found = mechanism.parameter_set, {name: list[str]() for name in mechanism.drivers}
    for one in study.inputs.tolerances:
        deviation = one.upper if one.upper else one.lower
        moved = mechanism.parameters(deviations={parameters.entries[one.path].alias or one.path: deviation})
        for name, numbers in found.items():
            paths = (f"drivers.{name}.{key}" for key in ("range.from", "range.to", "start"))
            if any(path in moved and moved[path] != parameters.nominal[path] for path in paths):
                numbers.append(one.path.removeprefix("dimensions."))
    for name, numbers in found.items():
        if numbers:
            yield Finding.warning(
                "tolerance.range_fixed",
                f"drivers.{name}",
                f"the tolerance of {', '.join(numbers)} does not move the range of {name} in the "
                "samples, which are all at the same places of the drive",
                "state the deviation in the link that it moves, as a dimension e in its points, such "
                "as [r*cos(e), r*sin(e)]; `trunnion sweep` moves the range",
                numbers=numbers,
                driver=name,
            )


def _nominal(outcome: Outcome) -> Iterator[Finding]:
    """Positions at which the nominal mechanism has no answer, or none to rely on."""
    study = outcome.study
    dial = study.run.system.dial(study.run.values, study.plan.times)
    status = study.linear.status
    for code in Status:
        where = np.flatnonzero(status == code)
        if code >= Status.NOT_CONVERGED and len(where):
            yield Finding.error(
                "tolerance.nominal_no_answer",
                "",
                f"nominal mechanism: {code.text} {dial.intervals(where)}",
                "there is no result there",
                status=code.text,
                at=dial.intervals(where),
            )
        elif code == Status.NEAR_SINGULAR and len(where):
            yield Finding.warning(
                "tolerance.near_singular",
                "",
                f"close to a dead centre {dial.intervals(where)}: the first-order result is not reliable there",
                "use the samples there",
                at=dial.intervals(where),
            )
    for of in study.linear.measures:
        if np.isnan(of.reference.figure):
            name = of.measure.name
            if of.measure.in_time:
                what = f"{name}: undefined for the nominal mechanism: {not_steady(study.run, of.measure)}"
                yield Finding.error("tolerance.nominal_not_steady", f"measures.{name}", what, LONGER)
            else:
                yield Finding.error(
                    "tolerance.nominal_no_figure",
                    f"measures.{name}",
                    f"{name}: undefined for the nominal mechanism",
                    "take it at a position, or over a range, where it is defined",
                    measure=name,
                )


def _first_order(outcome: Outcome, of: Of) -> Iterator[Finding]:
    """A measure of which first order knows nothing, or whose worst case found is another."""
    position = of.reference.window.index[of.place] if of.place >= 0 else -1
    if position >= 0 and not of.measure.of_motion and outcome.study.linear.status[position] == Status.ZERO_SLIP:
        yield Finding.warning(
            "first_order.one_sided",
            f"measures.{of.measure.name}",
            "a joint is momentarily at rest there: friction jumps, and the first-order result is one-sided",
            "use the samples",
        )
    where, lower, upper = f"measures.{of.measure.name}", float(of.total.lower), float(of.total.upper)
    if not np.isfinite(upper):
        yield Finding.warning(
            "first_order.no_answer", where, "the first-order analysis has no result", "use the samples"
        )
        return
    if outcome.worst is None:
        return
    i = [one.measure for one in outcome.study.linear.measures].index(of.measure)
    least, most = outcome.worst[i]
    for end, corner in (("least", least), ("largest", most)):
        if not corner.assembles and of.measure.in_time:
            what = f"at the tolerance limits that give the {end} deviation to first order, "
            what += not_steady(outcome.study.run, of.measure)
            yield Finding.warning("first_order.corner_not_steady", where, what, LONGER)
        elif not corner.assembles:
            yield Finding.warning(
                "first_order.corner_open",
                where,
                f"the mechanism cannot be solved at the tolerance limits that give the {end} deviation to first order",
                "within these tolerances it cannot always be assembled",
                end=end,
            )
    size, found = max(-lower, upper), max(-least.value, most.value)
    if np.isfinite(found) and abs(found - size) > FAR_OFF * max(size, found) and max(size, found) > 0:
        yield Finding.note(
            "first_order.worst_case_differs",
            where,
            f"the worst case found by search is {found / size if size else np.inf:.2f} times the first-order one",
            "use the one found by search, and the samples",
            ratio=found / size if size else np.inf,
        )


def _scatter(outcome: Outcome, sampled: Sampled) -> Iterator[Finding]:
    """Measures whose samples scatter quite otherwise than first order says."""
    for i, of in enumerate(outcome.study.linear.measures):
        if differing := scatters(of, sampled, i):
            (found, linear), unit = (
                differing,
                of.measure.figure_unit(outcome.study.run.system, outcome.study.run.values),
            )
            where = f"measures.{of.measure.name}"
            yield Finding.warning(
                "first_order.scatter_differs",
                where,
                f"the standard deviation of the samples is {readable(found, unit)}, the first-order "
                f"one {readable(linear, unit)}",
                "first order and its contributions do not describe this measure: use the samples, "
                "and --method sobol for the contributions",
                found=found,
                linear=linear,
                unit=unit,
            )


def _samples(outcome: Outcome, sampled: Sampled) -> Iterator[Finding]:
    failed, done = sampled.arrays["failed"], sampled.done
    timed = any(of.measure.in_time for of in outcome.study.linear.measures)
    absent = "a figure does not exist" + (", or a motion does not run steadily within its duration" if timed else "")
    for code in range(CAUSES):
        if failed[code]:
            text = list(Status)[code].text if code < CAUSES - 1 else absent
            count = int(failed[code])
            yield Finding.error(
                "samples.no_answer",
                "tolerances",
                f"{count:,} of {counted(done, 'sample')} ({count / done:.2%}) could not be solved: {text}",
                "they count as outside every limit; mean and standard deviation are of the others",
                count=count,
                samples=done,
                share=count / done,
                why=text,
            )
    yield from _scatter(outcome, sampled)
