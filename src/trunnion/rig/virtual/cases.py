"""The working conditions of a virtual rig: whether the model can be in them, and what its sensors are to see there."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np

from trunnion.errors import Finding, MechanismError, Status, counted
from trunnion.measures.measures import Measure, named
from trunnion.results.quantities import readable
from trunnion.rig.modelled import told_at
from trunnion.rig.reading.rig_file import Rig, Value
from trunnion.rig.virtual.sensors import SensorChannel, resolved
from trunnion.rig.virtual.true_signals import SampledSignals, cycle_efficiency, sampled
from trunnion.solve.run import Run

__all__ = ["Case", "case_names", "case_of", "channels_of", "findings_of", "measures_of", "placed_at", "speed_differs"]

MOST_ROWS = 20_000_000
BEYOND = 0.1  # of a cycle that is recorded before the first and past the last, so that their ends are there
MOST_NAMED = 20  # conditions in one finding


@dataclass(frozen=True)
class Case:
    """A working condition that the model can be in: what is set, how it is sampled, what is true.

    before, running, after: samples of the idle stretches and of the run; lead: sampling intervals from the first sample
    of the run to the start of its first cycle, a whole number and a half; efficiency: of the model, NaN if it has none.
    """

    number: int
    name: str
    settings: Mapping[str, Value]
    run: Run
    before: int
    running: int
    after: int
    lead: float
    true: SampledSignals
    efficiency: float

    @property
    def worst(self) -> Status:
        """The gravest status of a position."""
        return max(one for one in Status if np.any(self.true.status == one))

    @property
    def rows(self) -> int:
        return self.before + self.running + self.after

    @property
    def first(self) -> int:
        """The first sample of the run that lies in its first cycle."""
        return math.ceil(self.lead)

    def drive(self, rate: float, sample: int = 0) -> tuple[float, float]:
        """Coordinate and rate of the first driver at a sample of the run, rad or m."""
        driver = next(iter(self.run.system.mechanism.drivers))
        found = self.run.system.drive(self.run.values, driver, (sample - self.lead) / rate)
        return float(np.ravel(found[0])[0]), float(np.ravel(found[1])[0])

    @property
    def origin(self) -> float:
        """Sample, counted from the first of the file, at which time is 0: the first, or, where the driver does not name
        positions by its coordinate, the start of the first cycle."""
        return 0.0 if self.named else self.before + self.lead

    @property
    def named(self) -> bool:
        """Whether the first driver turns one way, so that its coordinate names positions."""
        driver = next(iter(self.run.system.mechanism.drivers))
        return self.run.system.turns(driver) and self.run.system.span(self.run.values, driver).one_way

    @property
    def part(self) -> slice:
        """Samples at which the machine runs."""
        return slice(self.before, self.before + self.running)

    def say(self) -> str:
        """What is set, as text."""
        return ", ".join(f"{name} = {_shown(value)}" for name, value in self.settings.items()) or "as the model states"


def _shown(value: Value) -> str:
    return value if isinstance(value, str) else f"{value:.6g}"


@contextmanager
def placed_at(where: str, number: int = 0) -> Iterator[None]:
    """What the model says of values that are set in a rig file: there, and in which condition."""
    try:
        yield
    except MechanismError as error:
        place = f" (in condition {number})" if number else ""
        told = [
            replace(one, what=f"{one.where}: {one.what}{place}" if one.where else f"{one.what}{place}", where=where)
            for one in error.findings
        ]
        raise MechanismError(told) from None


def measures_of(rig: Rig, run: Run) -> list[Measure]:
    """What each sensor measures; MechanismError with all that the model has no course of."""
    found: list[Measure] = []
    findings: list[Finding] = []
    mechanism = run.system.mechanism
    for name, sensor in rig.sensors.items():
        where = f"sensors.{name}.measures"
        try:
            measure = named(mechanism, [sensor.measures], run.values)[0]
        except MechanismError as error:
            findings += [replace(one, where=where) for one in error.findings]
            continue
        if not measure.everywhere or not measure.single(run.system):
            what = f"'{sensor.measures}' is no number that a sensor shows at every instant{told_at(measure)}"
            remedy = "write effort:DRIVER, rate:JOINT, load:LOAD, rotation:JOINT, slide:JOINT or link.point.x"
            findings.append(Finding(what, where, remedy))
        found.append(measure)
    if findings:
        raise MechanismError(findings)
    if run.determinacy is not None and not all(one.of_motion for one in found):
        run.determinacy.refuse()
    return found


def channels_of(rig: Rig, run: Run, measures: Sequence[Measure]) -> dict[str, SensorChannel]:
    """The sensors in the units of what they measure; MechanismError with all that does not fit."""
    found: dict[str, SensorChannel] = {}
    findings: list[Finding] = []
    for (name, sensor), measure in zip(rig.sensors.items(), measures, strict=True):
        try:
            found[name] = resolved(name, sensor, rig.column(name), measure.unit(run.system))
        except MechanismError as error:
            findings += error.findings
    findings += _of_the_drive(rig, run)
    if findings:
        raise MechanismError(findings)
    return found


def _of_the_drive(rig: Rig, run: Run) -> Iterator[Finding]:
    """What the driver does not let a rig do."""
    driver = next(iter(run.system.mechanism.drivers), None)
    if driver is None or run.cycle.duration <= 0:
        yield Finding("the mechanism has no driver that moves", "schedule", "give the model a driver")
        return
    if not run.cycle.periodic and rig.schedule.turns > 1:
        what = f"the cycle of {driver} ends elsewhere than it starts: it cannot run {rig.schedule.turns} times on end"
        yield Finding(what, "schedule.turns", "state turns: 1")
    if rig.encoder and not (run.system.turns(driver) and run.system.span(run.values, driver).one_way):
        what = f"an encoder needs a driver that turns in one direction, {driver} does not"
        yield Finding(what, "encoder", "remove the encoder: positions then follow from the time")


def case_names(count: int) -> list[str]:
    """Names of conditions, and of their files."""
    width = max(2, len(str(count)))
    return [f"run-{number:0{width}d}" for number in range(1, count + 1)]


def case_of(
    number: int,
    name: str,
    row: Mapping[str, Value],
    run: Run,
    rig: Rig,
    measures: Sequence[Measure],
    channels: Mapping[str, SensorChannel],
) -> Case:
    """One condition with its true courses. The idle times are taken to a whole number of samples."""
    rate, cycle = rig.rate.value, run.cycle
    pauses = rig.schedule.pauses
    before, after = (math.ceil(float(one.evaluate()) * rate - 1e-9) for one in (pauses.before, pauses.after))
    # Samples lie half an interval off the start of the cycle, so that edges of pulses that fall on samples otherwise
    # lie between them: a sampling clock knows nothing of the shaft.
    lead = math.ceil(BEYOND * cycle.duration * rate) - 0.5 if cycle.periodic else 0.0
    if cycle.periodic:
        running = math.ceil(lead) + math.ceil((rig.schedule.turns + BEYOND) * cycle.duration * rate)
    else:
        running = math.floor(cycle.duration * rate + 1e-9) + 1
    if before + running + after > MOST_ROWS:
        what = f"condition {number} takes {before + running + after:,} rows, a file at most {MOST_ROWS:,}"
        raise MechanismError(Finding(what, "rate", "sample more slowly, or fewer turns"))
    if running < 3:
        what = f"a cycle of condition {number} takes {cycle.duration:.4g} s, no three samples"
        raise MechanismError(Finding(what, "rate", "sample faster"))
    tolerances = {i: max(one.step, one.noise) / 10 for i, one in enumerate(channels.values())}
    true = sampled(run, measures, rate, running, lead, tolerances)
    case = Case(number, name, row, run, before, running, after, lead, true, float("nan"))
    if not case.worst.solved:
        return case
    for course, (sensor, channel) in zip(true.values, channels.items(), strict=True):
        if channel.per_turn and np.min(course) < 0 < np.max(course):
            what = f"in condition {number} ({case.say()}) the speed changes its sign, which pulses do not show"
            remedy = "remove per_turn, or measure another joint"
            raise MechanismError(Finding(what, f"sensors.{sensor}.per_turn", remedy))
    return replace(case, efficiency=cycle_efficiency(run))


def findings_of(cases: Sequence[Case], channels: Mapping[str, SensorChannel], rig: Rig) -> Iterator[Finding]:
    """What there is to say of conditions: those that cannot be, and what sensors do not tell; each kind once."""
    where = "schedule.conditions" if rig.schedule.conditions else "schedule.over"
    for status in reversed(Status):
        stopped = [case for case in cases if case.worst == status]
        if stopped and not status.solved:
            one = stopped[0]
            places = np.flatnonzero(one.true.status >= Status.NOT_CONVERGED)
            first = 360 * one.true.time[places[0]] / one.run.cycle.duration
            what = f"{_named(stopped)} left out: {status.text}; in condition {one.number} at {len(places)} of "
            what += f"{counted(len(one.true.status), 'position')}, first at {first:.4g}° of the cycle"
            remedy = "run `trunnion analyse` with these values to see where in the cycle, and why"
            figures = {
                "status": status.text,
                "condition": one.number,
                "count": len(places),
                "positions": len(one.true.status),
                "first_deg": first,
            }
            yield Finding.warning("rig.no_answer", where, what, remedy, **figures)
    sound = [case for case in cases if case.worst.solved]
    if mended := [case for case in sound if case.true.mended]:
        most = max(case.true.mended for case in mended)
        what = f"{_named(mended)}: a load has no unique value at up to {counted(most, 'position')}, because its joint "
        what += "is at rest; sensors read 0 during a rest, and the mean of the neighbours at a single position"
        yield Finding.note("rig.load_at_rest", where, what, positions=most)
    yield from _lost_pulses(sound, rig)
    yield from _both_ways(sound, rig)
    driver = next(iter(cases[0].run.system.mechanism.drivers))
    placed = rig.encoder or any(one.measures == f"rate:{driver}" for one in channels.values())
    if sound and not placed and speed_differs(sound):
        what = f"the conditions differ in speed, and no channel measures the angle of {driver}"
        remedy = f"state an encoder, or a sensor of rate:{driver}"
        yield Finding.error("rig.no_angle", "encoder", what, remedy, driver=driver)
    for i, (name, channel) in enumerate(channels.items()):
        peaks = {case.number: float(np.max(np.abs(case.true.values[i]))) for case in sound}
        clipped = [case for case in sound if peaks[case.number] > channel.limit]
        if clipped:
            key = "range" if channel.limit == channel.range else "span"
            what = f"{_named(clipped)}: {channel.measures} reaches {readable(max(peaks.values()), channel.unit)}, "
            what += f"beyond the range of {readable(channel.limit, channel.unit)}: readings are clipped"
            remedy = "use a sensor with a larger range"
            figures = {
                "measures": channel.measures,
                "peak": max(peaks.values()),
                "unit": channel.unit,
                "limit": channel.limit,
            }
            yield Finding.warning("rig.clipped", f"sensors.{name}.{key}", what, remedy, **figures)


def _both_ways(cases: Sequence[Case], rig: Rig) -> Iterator[Finding]:
    """Drivers that turn either way, where there is no count of an encoder: files then begin at other coordinates."""
    one_way = [case for case in cases if case.named]
    if len({case.drive(rig.rate.value)[1] > 0 for case in one_way}) < 2:
        return
    if rig.encoder is None:
        what = "the conditions turn in both directions, and no channel measures the angle of the driver"
        remedy = "state an encoder of kind: count, or one rig for each direction"
        yield Finding.error("rig.both_ways", "encoder", what, remedy)
    elif rig.encoder.kind == "level":
        what = "the conditions turn in both directions, which the level of an encoder does not distinguish"
        yield Finding.error("rig.both_ways_level", "encoder.kind", what, "record kind: count")


def speed_differs(cases: Sequence[Case]) -> bool:
    """Whether the first driver runs one way and not as fast in all conditions."""
    driver = next(iter(cases[0].run.system.mechanism.drivers))
    spans = [case.run.system.span(case.run.values, driver) for case in cases]
    durations = [case.run.cycle.duration for case in cases]
    return spans[0].one_way and max(durations) - min(durations) > 1e-9 * max(durations)


def _named(cases: Sequence[Case]) -> str:
    """Conditions by number, the first with what is set."""
    first = f"condition {cases[0].number} ({cases[0].say()})"
    if len(cases) == 1:
        return f"{first} is" if cases[0].worst >= Status.NOT_CONVERGED else first
    shown = ", ".join(str(case.number) for case in cases[1:MOST_NAMED])
    more = f" and {len(cases) - MOST_NAMED} more" if len(cases) > MOST_NAMED else ""
    are = " are" if cases[0].worst >= Status.NOT_CONVERGED else ""
    return f"{first} and condition{'s' * (len(cases) > 2)} {shown}{more}{are}"


def _lost_pulses(cases: Sequence[Case], rig: Rig) -> Iterator[Finding]:
    """An encoder whose level is sampled too slowly to tell every pulse."""
    if rig.encoder is None or rig.encoder.kind != "level":
        return
    peaks = {}
    for case in cases:
        driver = next(iter(case.run.system.mechanism.drivers))
        peaks[case.number] = float(case.run.system.span(case.run.values, driver).peak) / (2 * np.pi)
    lost = [case for case in cases if 4 * peaks[case.number] * rig.encoder.per_turn > rig.rate.value * (1 + 1e-9)]
    if lost:
        most = max(peaks.values()) * rig.encoder.per_turn
        what = f"{_named(lost)}: some encoder pulses are lost: up to {most:.4g} pulses per second, sampled at "
        what += f"{rig.rate.value:.4g} Hz"
        remedy = "use a sampling rate of four times the pulse rate, or record kind: count"
        yield Finding.warning("rig.pulses_lost", "encoder.kind", what, remedy, pulses=most, rate=rig.rate.value)
