"""What a study of tolerances says in words: its summary, and its findings."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.cycle.account import model_notes
from trunnion.errors import Finding, Severity, Status, agreeing
from trunnion.errors import counted as number_of
from trunnion.model.checks.values import NOT_NEGATIVE
from trunnion.studies.tolerance.linear import by_position
from trunnion.studies.tolerance.sampling import CAUSES
from trunnion.studies.tolerance.targets import limited, missed

if TYPE_CHECKING:
    from trunnion.studies.tolerance.linear import Of
    from trunnion.studies.tolerance.outcome import Outcome
    from trunnion.studies.tolerance.sampled import Sampled

__all__ = ["findings_of", "summary"]

OTHERWISE, ENOUGH = 1.5, 100  # ratio of standard deviations that is told, and samples from which it is
CARRIED = 0.02  # of the standard deviation: what it may change with the link that carries a seat before it is told
FAR_OFF = 0.2  # between first order and what is found, of which it is said


def summary(outcome: Outcome, counted: Sampled | None, units: Sequence[str], dial: Any) -> list[dict[str, Any]]:
    """Of each measure: nominal figure, worst case, RSS, scatter, yield, and what contributes most."""
    rows: list[dict[str, Any]] = []
    for i, (of, unit) in enumerate(zip(outcome.study.linear.measures, units, strict=True)):
        rows += _of_measure(outcome, counted, i, of, unit, dial)
    if counted is not None and len(units) > 1:
        rows.append({"label": "yield, all measures", "value": counted.arrays["yield_all"], "unit": "1"})
    if counted is not None:
        rows.append({"label": "samples", "value": counted.done, "unit": "1"})
        rows.append({"label": "samples without an answer", "value": int(np.sum(counted.arrays["failed"])), "unit": "1"})
    return [{**row, "value": _plain(row["value"])} for row in rows]


def _of_measure(
    outcome: Outcome, counted: Sampled | None, i: int, of: Of, unit: str, dial: Any
) -> Iterator[dict[str, Any]]:
    name = of.measure.name
    if of.measure.rule != "deviation":
        yield {"label": f"{name}, nominal", "value": of.reference.figure, "unit": unit}
    placed = of.place >= 0 and outcome.study.run.cycle.duration > 0
    at = f", at {dial.at(of.reference.window.index[of.place])}" if placed else ""
    lower, upper, rss, _, deviation = (float(part) for part in of.total)
    yield {"label": f"{name}, worst case, linear{at}", "value": max(-lower, upper), "unit": unit}
    if outcome.worst is not None:
        for key, corner in zip(("least", "largest"), outcome.worst[i], strict=True):
            yield {"label": f"{name}, {key} deviation found", "value": corner.value, "unit": unit}
    alone = ", without correlation" if outcome.study.effects.correlated else ""
    yield {"label": f"{name}, RSS{alone}{at}", "value": rss, "unit": unit}
    yield {"label": f"{name}, standard deviation, linear{at}", "value": deviation, "unit": unit}
    if counted is not None:
        arrays = counted.arrays
        yield {"label": f"{name}, mean of samples", "value": arrays["mean"][i], "unit": unit}
        yield {"label": f"{name}, standard deviation of samples", "value": arrays["deviation"][i], "unit": unit}
        if limited(of.measure):
            yield {"label": f"{name}, yield", "value": arrays["yield"][i], "unit": "1"}
            yield {"label": f"{name}, yield, least by the 95 % interval", "value": arrays["yield_low"][i], "unit": "1"}
            yield {"label": f"{name}, C_pk", "value": arrays["cpk"][i], "unit": "1"}
    halves = np.nan_to_num(of.spread.half)
    if np.sum(halves**2) > 0:
        top = int(np.argmax(halves))
        share = float(halves[top] ** 2 / np.sum(halves**2))
        label = f"{name}, largest contribution, {outcome.study.inputs.names[top]}, share of RSS²"
        yield {"label": label, "value": share, "unit": "1"}
    if alone and deviation > 0:
        parts = outcome.study.effects.covariances(of.spread, of.slope) / deviation**2
        top = int(np.argmax(parts))
        label = f"{name}, largest contribution, {outcome.study.inputs.names[top]}, share of the variance"
        yield {"label": label, "value": float(parts[top]), "unit": "1"}


def _plain(value: Any) -> float | None:
    number = None if value is None else float(value)
    return number if number is not None and np.isfinite(number) else None


def findings_of(outcome: Outcome, counted: Sampled | None) -> Iterator[Finding]:
    """What is doubtful, beside what the model itself has to say."""
    study = outcome.study
    mechanism = study.run.system.mechanism
    yield from missed(outcome, counted)
    yield from (one for one in model_notes(mechanism, study.run.system) if one.severity is not Severity.NOTE)
    yield from study.run.chosen.findings
    if study.run.determinacy is not None:
        yield from study.run.determinacy.findings()
    loaded = [seat.joint for seat in study.run.seats if seat.given is None]
    if loaded:
        what = f"pins lie anywhere in their holes: seats by loads of {', '.join(loaded)} are not taken"
        yield Finding(what, "joints", "analyse takes them", Severity.NOTE)
    if study.effects.correlated:
        what = "RSS and worst case leave the correlations out: deviation, shares of variance and samples have them"
        yield Finding(what, "correlations", severity=Severity.NOTE)
    yield from _measured(outcome)
    yield from _impossible(outcome)
    yield from _nominal(outcome)
    for of in study.linear.measures:
        yield from _first_order(outcome, of)
        yield from _carried(outcome, of)
    if counted is not None:
        yield from _samples(outcome, counted)
    if outcome.indices is not None and outcome.indices.lost:
        lost = outcome.indices.lost
        some = f"{number_of(lost, 'sample')} of the variance-based indices {agreeing(lost, 'has', 'have')} no answer"
        what = f"{some} and {agreeing(lost, 'counts', 'count')} as the mean"
        yield Finding(what, "", "narrower tolerances, or a place where all go together", Severity.WARNING)


def _measured(outcome: Outcome) -> Iterator[Finding]:
    """Measured deviations outside the limits of their numbers."""
    for one in outcome.study.inputs.tolerances:
        values = np.atleast_1d(np.asarray(one.options.get("values", 0.0)))
        outside = np.count_nonzero((values < one.lower) | (values > one.upper))
        if one.distribution == "sample" and outside:
            far = float(values[np.argmax(np.abs(values))])
            limits = f"{one.lower:g} to {one.upper:g}"
            what = f"{outside:,} of {len(values):,} measured deviations are outside the limits {limits}"
            yield Finding(f"{what}, the farthest {far:g} (SI)", one.path, "check their unit", Severity.WARNING)


def _impossible(outcome: Outcome) -> Iterator[Finding]:
    """Limits that let a number be what the model itself would refuse."""
    for one in outcome.study.inputs.tolerances:
        least = one.nominal + one.lower
        if one.path.rpartition(".")[2] in NOT_NEGATIVE and least < 0:
            what = f"its limits let it be {least:g} (SI), which is negative"
            yield Finding(what, one.path, "narrow the limits", Severity.WARNING)


def _nominal(outcome: Outcome) -> Iterator[Finding]:
    """Positions at which the nominal mechanism has no answer, or none to rely on."""
    study = outcome.study
    dial = study.run.system.dial(study.run.values, study.plan.times)
    status = study.linear.status
    for code in Status:
        where = np.flatnonzero(status == code)
        if code >= Status.NOT_CONVERGED and len(where):
            yield Finding(f"nominal: {code.text} {dial.intervals(where)}", "", "nothing is known there")
        elif code == Status.NEAR_SINGULAR and len(where):
            what = f"close to a dead centre {dial.intervals(where)}: first order says little there"
            yield Finding(what, "", "rely on the samples there", Severity.WARNING)
    for of in study.linear.measures:
        if not np.isfinite(of.reference.figure):
            name, remedy = of.measure.name, "take it at a place, or over a range, where there is one"
            yield Finding(f"{name}: the nominal mechanism has no such figure", f"measures.{name}", remedy)


def _first_order(outcome: Outcome, of: Of) -> Iterator[Finding]:
    """A measure of which first order knows nothing, or whose worst case found is another."""
    position = of.reference.window.index[of.place] if of.place >= 0 else -1
    if position >= 0 and not of.measure.of_motion and outcome.study.linear.status[position] == Status.ZERO_SLIP:
        what = "a relative speed is zero there: friction jumps, and first order is of one side"
        yield Finding(what, f"measures.{of.measure.name}", "rely on the samples", Severity.WARNING)
    name, lower, upper = of.measure.name, float(of.total[0]), float(of.total[1])
    if not np.isfinite(upper):
        what = "first order has no answer"
        yield Finding(what, f"measures.{name}", "rely on the samples", Severity.WARNING)
        return
    if outcome.worst is None:
        return
    i = [one.measure for one in outcome.study.linear.measures].index(of.measure)
    least, most = outcome.worst[i]
    for end, corner in (("least", least), ("largest", most)):
        if not corner.assembles:
            what = f"at the linear corner of the {end} deviation the mechanism has no answer"
            yield Finding(what, f"measures.{name}", "the tolerances let it not go together there", Severity.WARNING)
    size, found = max(-lower, upper), max(-least.value, most.value)
    if np.isfinite(found) and abs(found - size) > FAR_OFF * max(size, found) and max(size, found) > 0:
        what = f"the worst case found is {found / size if size else np.inf:.2f} times that of first order"
        yield Finding(what, f"measures.{name}", "rely on the one found, and on samples", Severity.NOTE)


def _carried(outcome: Outcome, of: Of) -> Iterator[Finding]:
    """Plays whose part in the scatter is another if the pin keeps its place on the other link."""
    study, whole = outcome.study, float(of.total[4])
    others = []
    for joint in study.inputs.loose:
        taken, *more = (float(part) for part in study.effects.scatters(joint, of.slope))
        ratios = [np.sqrt(max(1 + (other**2 - taken**2) / whole**2, 0.0)) for other in more if whole > 0]
        others += [(joint, ratio) for ratio in ratios if abs(ratio - 1) > CARRIED]
    if others:
        joints = study.run.system.mechanism.effective_joints
        told = ", ".join(f"'{joints[name].links[0]}' in {name}: {ratio:.3g} times" for name, ratio in others)
        holes = ", ".join(f"'{joints[name].links[1]}' in {name}" for name, _ in others)
        what = (
            f"scatter and yield suppose that pins keep their places on the links of the holes ({holes}); on the other "
        )
        what += f"link the deviation is another ({told}); the worst case is of both"
        name = others[0][0]
        remedy = f"say joints.{name}.seat_on: {joints[name].links[0]} or {joints[name].links[1]}"
        yield Finding(what, f"measures.{of.measure.name}", remedy, Severity.NOTE)


def _scatter(outcome: Outcome, counted: Sampled) -> Iterator[Finding]:
    """Measures whose samples scatter quite otherwise than first order says."""
    for i, of in enumerate(outcome.study.linear.measures):
        linear, found = float(of.total[4]), float(counted.arrays["deviation"][i])
        if by_position(of.reference) or counted.done < ENOUGH or not np.isfinite(linear + found):
            continue
        if max(linear, found) > 0 and not 1 / OTHERWISE < found / max(linear, 1e-300) < OTHERWISE:
            what = f"the samples scatter by {found:.4g} (SI), first order says {linear:.4g}"
            remedy = "it is not linear within the tolerances: rely on the samples"
            yield Finding(what, f"measures.{of.measure.name}", remedy, Severity.WARNING)


def _samples(outcome: Outcome, counted: Sampled) -> Iterator[Finding]:
    failed, done = counted.arrays["failed"], counted.done
    for code in range(CAUSES):
        if failed[code]:
            text = list(Status)[code].text if code < CAUSES - 1 else "a figure does not exist"
            some = f"{int(failed[code]):,} of {number_of(done, 'sample')} ({failed[code] / done:.2%})"
            what = f"{some} {agreeing(int(failed[code]), 'has', 'have')} no answer: {text}"
            yield Finding(what, "tolerances", "they count as outside every limit; moments are of the others")
    yield from _scatter(outcome, counted)
