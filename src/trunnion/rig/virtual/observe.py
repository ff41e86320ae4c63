"""A virtual test rig: the model observed through sensors, under a schedule of working conditions.

`observe` solves the model in every condition and draws the errors that the sensors have. The Observation that it
returns makes the readings, condition by condition (`records`), writes them like those of a real rig, with the mapping
that reads them and the truth (`write`), or hands them on as a Measurement.

The machine stands still and unloaded while it is idle, and moves as its drivers say from the first sample after: it is
not brought up to speed, and neither motor nor brake has a dynamics of its own. Sensors do not act back on the machine.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.cycle.positions import positions
from trunnion.errors import Finding, MechanismError, Severity, Status, counted
from trunnion.measures.evaluation import courses_of
from trunnion.measures.measures import Measure
from trunnion.model.arguments import strict_arguments
from trunnion.model.mechanism import Mechanism
from trunnion.results.quantities import readable
from trunnion.rig.modelled import each, measure_of
from trunnion.rig.virtual.observation import Case, Observation, check_seed
from trunnion.rig.virtual.rig_file import Rig, SensorChannel, Value, resolved
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import Run, prepare

__all__ = ["Observation", "observe", "phases"]

Array = NDArray[np.float64]
MOST_ROWS = 20_000_000
EFFICIENCY_STEPS = 720
MOST_NAMED = 20  # conditions in one finding
BEYOND = 0.1  # of a cycle that is recorded before the first and past the last, so that their ends are there
CHUNK = 8_192  # instants at once: memory and cache
DIGITS = 12  # of a share of the cycle, in which instants that are one agree


@strict_arguments
@np.errstate(all="ignore")  # of numbers near the end of the floats: what has no value is NaN, and its status says so
def observe(
    mechanism: Mechanism,
    rig: Rig | Mapping[str, Any] | str | os.PathLike[str],
    seed: int = 1,
    progress: Callable[[int], None] | None = None,
) -> Observation:
    """Put a rig to a mechanism: solve the model in all conditions of the schedule, draw the errors of the sensors.

    A condition that the model cannot be in at every position, because it locks or does not go together, is left out,
    and a finding says which and why.

    Parameters
    ----------
    mechanism : the model.
    rig : a Rig, the entries of a rig file, or its path.
    seed : of all random numbers: the same seed, the same readings to the last bit.
    progress : called with the conditions done.

    Raises
    ------
    MechanismError
        For a rig that does not fit the mechanism, or if no condition is left.
    """
    check_seed(seed)
    if not isinstance(rig, Rig):
        rig = Rig(**rig) if isinstance(rig, Mapping) else Rig.read(rig)
    with _placed("set"):
        mechanism = mechanism.with_values(dict(rig.set_)) if rig.set_ else mechanism
    rows = rig.schedule.rows()
    channels: dict[str, SensorChannel] = {}
    cases: list[Case] = []
    for number, (name, row) in enumerate(zip(rig.names, rows, strict=True), 1):
        with _placed(f"schedule.{f'conditions.{number - 1}' if rig.schedule.conditions else 'over'}", number):
            run = prepare(mechanism.with_values(dict(row)) if row else mechanism)
        measures = _measures(rig, run)
        channels = channels or _channels(rig, run, measures)
        cases.append(_case(number, name, row, run, rig, measures, channels))
        if progress:
            progress(number)
    findings = tuple(_findings(cases, channels, rig))
    sound = tuple(case for case in cases if case.worst.solved)
    if not sound:
        what = f"none of the {len(rows)} conditions can" if len(rows) > 1 else "the condition cannot"
        remedy = "choose conditions in which the model has a solution at every position"
        raise MechanismError([*findings, Finding(f"{what} be measured", "schedule", remedy)])
    if any(finding.severity is Severity.ERROR for finding in findings):
        raise MechanismError(findings)
    skipped = tuple(case.number for case in cases if not case.worst.solved)
    return Observation(mechanism, rig, int(seed), channels, sound, skipped, findings)


@contextmanager
def _placed(where: str, number: int = 0) -> Iterator[None]:
    """What the model says of values that are set in a rig file: there, and in which condition."""
    try:
        yield
    except MechanismError as error:
        tail = f" (in condition {number})" if number else ""
        raise MechanismError(
            replace(finding, what=f"{f'{finding.where}: ' if finding.where else ''}{finding.what}{tail}", where=where)
            for finding in error.findings
        ) from None


def _measures(rig: Rig, run: Run) -> list[Measure]:
    """What each sensor measures; MechanismError with all that the model has no course of."""
    mechanism, sensors = run.system.mechanism, rig.sensors.items()
    measures = each(sensors, lambda item: measure_of(mechanism, run, item[0], item[1].measures, section="sensors"))
    if run.determinacy is not None and not all(measure.of_motion for measure in measures):
        run.determinacy.refuse()
    return measures


def _channels(rig: Rig, run: Run, measures: Sequence[Measure]) -> dict[str, SensorChannel]:
    """The sensors in the units of what they measure; MechanismError with all that does not fit."""
    pairs = zip(rig.sensors.items(), measures, strict=True)
    channels = each(pairs, lambda item: resolved(*item[0], rig.column(item[0][0]), item[1].unit(run.system)))
    findings: list[Finding] = []
    driver = next(iter(run.system.mechanism.drivers), None)
    if driver is None or run.cycle.duration <= 0:
        findings.append(Finding("the mechanism has no driver that moves", "schedule", "give the model a driver"))
    elif not run.cycle.periodic and rig.schedule.turns > 1:
        what = f"the cycle of {driver} ends elsewhere than it starts: it cannot run {rig.schedule.turns} times on end"
        findings.append(Finding(what, "schedule.turns", "state turns: 1"))
    if driver and rig.encoder and not (run.system.turns(driver) and run.system.span(run.values, driver).one_way):
        what = f"an encoder needs a driver that turns in one direction, {driver} does not"
        findings.append(Finding(what, "encoder", "remove the encoder: positions then follow from the time"))
    if findings:
        raise MechanismError(findings)
    return {channel.name: channel for channel in channels}


def _case(
    number: int, name: str, row: Mapping[str, Value], run: Run, rig: Rig, measures: Sequence[Measure],
    channels: Mapping[str, SensorChannel],
) -> Case:  # fmt: skip
    """One condition with its true courses. The idle time is taken to a whole number of samples."""
    rate, cycle = rig.rate.value, run.cycle
    before = math.ceil(rig.schedule.idle.value * rate - 1e-9)
    # Samples lie half an interval off the start of the cycle, so that edges of pulses that fall on samples otherwise
    # lie between them: a sampling clock knows nothing of the shaft.
    lead = math.ceil(BEYOND * cycle.duration * rate) - 0.5 if cycle.periodic else 0.0
    running = math.floor(cycle.duration * rate + 1e-9) + 1
    if cycle.periodic:
        running = math.ceil(lead) + math.ceil((rig.schedule.turns + BEYOND) * cycle.duration * rate)
    if before + running > MOST_ROWS:
        what = f"condition {number} takes {before + running:,} rows, a file at most {MOST_ROWS:,}"
        raise MechanismError(Finding(what, "rate", "sample more slowly, or fewer turns"))
    if running < 3:
        what = f"a cycle of condition {number} takes {cycle.duration:.4g} s, no three samples"
        raise MechanismError(Finding(what, "rate", "sample faster"))
    time, place = np.minimum(np.arange(running) / rate, cycle.duration), np.arange(running)
    if cycle.periodic:
        time, place = phases(cycle.duration, rate, running, lead)
    values, status = _solved(run, measures, time)
    case = Case(number, name, row, run, rate, before, running, lead, values[:, place], time, status)
    if not case.worst.solved:
        return case
    for course, channel in zip(values, channels.values(), strict=True):
        if channel.sensor.per_turn and np.min(course) < 0 < np.max(course):
            what = f"in {case} the speed changes its sign, which pulses do not show"
            remedy = "remove per_turn, or measure another joint"
            raise MechanismError(Finding(what, f"sensors.{channel.name}.per_turn", remedy))
    return replace(case, efficiency=positions(run, EFFICIENCY_STEPS, margin=False).means.efficiency)


# ---- true courses ----------------------------------------------------------------------------------------------


def phases(duration: float, rate: float, count: int, lead: float = 0.0) -> tuple[Array, NDArray[np.intp]]:
    """Distinct times (s) in the cycle of `count` samples, ascending, and the place of each sample among them.

    lead: how many sampling intervals the first comes before the start of the cycle.
    """
    share = np.round(np.mod((np.arange(count) - lead) / (duration * rate), 1.0), DIGITS) % 1.0
    distinct, place = np.unique(share, return_inverse=True)
    return distinct * duration, place


def _solved(run: Run, measures: Sequence[Measure], time: Array) -> tuple[Array, NDArray[np.int8]]:
    """Courses of measures, (measure, instant), at ascending times (s) of the cycle, with pins in their seats; status.

    Where a load or friction is an interval, at a speed of zero, a course is the mean of its neighbours; a load whose
    joint rests at several positions on end is 0 there: nothing moves against it.
    """
    single, periodic = list({measure.name: measure for measure in measures}.values()), run.cycle.periodic
    values, status = np.empty((len(measures), len(time))), np.empty(len(time), np.int8)
    for low in range(0, len(time), CHUNK):
        part = slice(low, low + CHUNK)
        curves, status[part] = courses_of(run, single, time[part], FrictionMethod())
        for row, measure in zip(values, measures, strict=True):
            row[part] = curves[measure.name][0]
    lost = status >= Status.NOT_CONVERGED
    values[:, lost] = np.nan
    for row, measure in zip(values, measures, strict=True) if not lost.any() else ():
        gaps = ~np.isfinite(row)
        if measure.kind == "load":
            before, after = np.roll(gaps, 1), np.roll(gaps, -1)
            if not periodic:
                before[0] = after[-1] = False
            row[gaps & (before | after)] = 0.0  # of more than one position; at the ends of a period too
        finite = np.isfinite(row)
        if finite.any() and not finite.all():
            row[~finite] = np.interp(
                time[~finite], time[finite], row[finite], period=run.cycle.duration * periodic or None
            )
    return values, status


# ---- findings -------------------------------------------------------------------------------------------------


def _findings(cases: Sequence[Case], channels: Mapping[str, SensorChannel], rig: Rig) -> Iterator[Finding]:
    """Conditions that cannot be, and what sensors do not show; each kind once."""
    where = "schedule.conditions" if rig.schedule.conditions else "schedule.over"
    for status in reversed(Status):
        if stopped := [case for case in cases if case.worst == status and not status.solved]:
            case = stopped[0]
            lost = np.flatnonzero(case.status >= Status.NOT_CONVERGED)
            what = f"{_which(stopped)} left out: {status.text}; in condition {case.number} at {len(lost)} of "
            what += f"{counted(len(case.status), 'position')}, first at "
            what += f"{360 * case.time[lost[0]] / case.cycle:.4g}° of the cycle"
            remedy = "run `trunnion analyse` with these values to see where in the cycle, and why"
            yield Finding.warning("rig.no_answer", where, what, remedy)
    if not (sound := [case for case in cases if case.worst.solved]):
        return
    driver, encoder = sound[0].driver, rig.encoder
    if encoder is None and len({case.start[1] > 0 for case in sound if case.named}) > 1:
        what = "the conditions turn in both directions, which only a count of pulses shows"
        remedy = "state an encoder, or one rig for each direction"
        yield Finding.error("rig.both_ways", "encoder", what, remedy)
    durations, one_way = [case.cycle for case in sound], sound[0].run.system.span(sound[0].run.values, driver).one_way
    if not encoder and one_way and max(durations) - min(durations) > 1e-9 * max(durations):
        what = f"the conditions differ in speed, and nothing measures the angle of {driver}"
        yield Finding.error("rig.no_angle", "encoder", what, "state an encoder")
    for i, (name, channel) in enumerate(channels.items()):
        highest = {case.number: float(np.max(np.abs(case.true[i]))) for case in sound}
        if clipped := [case for case in sound if highest[case.number] > channel.limit]:
            key = "range" if channel.limit == channel.range else "span"
            peak, limit = (readable(size, channel.unit) for size in (max(highest.values()), channel.limit))
            what = (
                f"{_which(clipped)}: {channel.sensor.measures} reaches {peak}, beyond the range of {limit}: readings "
            )
            remedy = "use a sensor with a larger range"
            yield Finding.warning("rig.clipped", f"sensors.{name}.{key}", f"{what}are clipped", remedy)


def _which(cases: Sequence[Case]) -> str:
    """Conditions by number, the first with what is set."""
    others = ", ".join(str(case.number) for case in cases[1:MOST_NAMED])
    more = f" and {len(cases) - MOST_NAMED} more" if len(cases) > MOST_NAMED else ""
    return f"{cases[0]}{f' and {others}' if others else ''}{more}"
