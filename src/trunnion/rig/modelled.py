"""The model in one working condition: the course of what each channel measures, at the positions of the measurement."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError, Status
from trunnion.measures.evaluation import courses_of
from trunnion.measures.measures import Measure, coordinate_unit, named
from trunnion.model.mechanism import Mechanism
from trunnion.model.parameters import measured
from trunnion.model.units import Kind, dimension_text, si_unit
from trunnion.rig.reading.checks import backward_finding
from trunnion.rig.reading.log import gathered
from trunnion.rig.reading.measurement import Condition, Measurement, Signal
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import Run, prepare

__all__ = [
    "Modelled",
    "apart",
    "check_settings",
    "measure_of",
    "modelled",
    "prepared",
    "refuse_backwards",
    "refuse_unit",
    "told_at",
]

Array = NDArray[np.float64]
FAR = 0.05  # of a speed: an error of the settings
SLOWER = 0.01  # of the duration of a cycle: a machine that keeps time runs no farther off


@dataclass(frozen=True, eq=False)
class Modelled:
    """What the model has at the positions of a condition, SI.

    drive: coordinate of the first driver if it runs one way, else time; unit: rad, m or s; span: what `drive` gains
    over the cycle; status: (position,); courses, units: by channel, NaN where the status rules a course out.
    """

    run: Run
    drive: Array
    unit: str
    span: float
    status: NDArray[np.int8]
    courses: Mapping[str, Array]
    measures: Mapping[str, Measure]

    @property
    def speed(self) -> float:
        """Mean speed of the first driver, rad/s; NaN where it names no position."""
        return self.span / self.run.cycle.duration if self.unit == "rad" else float("nan")

    @property
    def sound(self) -> NDArray[np.bool_]:
        """Positions whose forces can be relied on; all that are solved if there are no such."""
        best = self.status == Status.SOLVED
        return best if np.any(best) else self.status < Status.CONTACT_LOST

    def comparable(self, channel: str) -> NDArray[np.bool_]:
        """Positions at which the model has one number for a channel.

        A force is an interval where a relative speed is zero, and as a speed no number to rely on beside a dead centre.
        """
        there = np.isfinite(self.courses[channel])
        return there if self.measures[channel].of_places else there & self.sound


def measure_of(mechanism: Mechanism, run: Run, channel: str, name: str) -> Measure:
    """What a channel measures; MechanismError if the model has no such course."""
    where = f"channels.{channel}.measures"
    try:
        measure = named(mechanism, [name], run.values)[0]
    except MechanismError as error:
        raise MechanismError([replace(one, where=where) for one in error.findings]) from None
    if not measure.everywhere or not measure.single(run.system):
        what = f"'{name}' is no number of a single position" + told_at(measure)
        remedy = "a channel measures such as effort:DRIVER, rate:JOINT, load:LOAD, rotation:JOINT or link.point.x"
        raise MechanismError(Finding(what, where, remedy))
    return measure


def told_at(measure: Measure) -> str:
    """What a measure of the model states that no sensor follows; empty if it is of every position."""
    if measure.everywhere:
        return ""
    if measure.in_time:
        return ": it is of a motion in time"
    return f": the model gives it {f'as {measure.statistic}' if measure.statistic else 'at a place or over a range'}"


def modelled(
    mechanism: Mechanism,
    condition: Condition,
    channels: Mapping[str, str],
    method: FrictionMethod,
    also: Mapping[str, str] | None = None,
) -> Modelled:
    """The model with the values of a condition. channels: what each measures, by name; also: others, if they can be.

    Raises MechanismError for values or measures that the model does not have, all in one go.
    """
    run = prepared(mechanism, condition)
    findings: list[Finding] = []
    measures: dict[str, Measure] = {}
    for channel, name in {**(also or {}), **channels}.items():
        try:
            measures[channel] = _checked(run, condition, channel, name)
        except MechanismError as error:
            findings += error.findings if channel in channels else ()
    if findings:
        raise MechanismError(findings)
    if run.determinacy is not None and not all(one.of_motion for one in measures.values()):
        run.determinacy.refuse()
    time = np.asarray(condition.phase, float) * run.cycle.duration
    found, status = courses_of(run, list({one.name: one for one in measures.values()}.values()), time, method)
    courses = {name: _row(parts[0], time) for name, parts in found.items()}
    drive, unit, span = _drive(run, time)
    _same_cycle(run, condition, unit, span)
    beside = {
        channel: _beside(measure.turning(run.system), courses[measure.name], condition.courses[channel].mean)
        for channel, measure in measures.items()
    }
    return Modelled(run, drive, unit, span, status, beside, measures)


def _checked(run: Run, condition: Condition, channel: str, name: str) -> Measure:
    """What a channel measures; MechanismError if the model has no such course, or has it in another unit."""
    measure = measure_of(run.system.mechanism, run, channel, name)
    refuse_unit(run, measure, channel, condition.courses[channel])
    return measure


def refuse_unit(run: Run, measure: Measure, channel: str, course: Signal) -> None:
    """MechanismError where a channel has another unit than what it measures of the model, such as N in place of N m."""
    unit, own, name = measure.unit(run.system), course.unit, course.measures
    if own != unit:
        what = f"is in {own}, and {name} is in {unit}"
        remedy = "name another column, or state unit and gain, or what else it measures"
        raise MechanismError(Finding(what, f"channels.{channel}", remedy))


def prepared(mechanism: Mechanism, condition: Condition) -> Run:
    """The mechanism with the values of a condition; what is wrong with it says in which."""
    units = {name: si_unit(one) for name, one in condition.dimensions.items()}
    stated = {name: f"{value} {units[name]}" if units.get(name, "1") != "1" and np.isfinite(value) else value
              for name, value in condition.values.items()}  # fmt: skip
    with _in(condition):
        return prepare(mechanism.with_values(stated))


@contextmanager
def _in(condition: Condition) -> Iterator[None]:
    try:
        yield
    except MechanismError as error:
        told = [replace(one, what=f"{one.what} (in condition {condition.name})") for one in error.findings]
        raise MechanismError(told) from None


def _row(number: object, time: Array) -> Array:
    return np.array(np.broadcast_to(np.asarray(number, float), time.shape))


def _drive(run: Run, time: Array) -> tuple[Array, str, float]:
    """Coordinate of the first driver, its unit, what it gains in a cycle; time where it names no position."""
    unit = coordinate_unit(run.system, run.values)
    if unit == "s":
        return time, unit, run.cycle.duration
    first = next(iter(run.system.mechanism.drivers))
    ends = np.array([0.0, run.cycle.duration * (1 - 1e-12)])
    drive, low_high = (_row(run.system.drive(run.values, first, at)[0], at) for at in (time, ends))
    return drive, unit, float(low_high[1] - low_high[0])


def _same_cycle(run: Run, condition: Condition, unit: str, span: float) -> None:
    """MechanismError where the cycle that was cut out of the data is not the model's, or starts elsewhere."""
    if abs(condition.duration - run.cycle.duration) > SLOWER * run.cycle.duration:
        what = f"the cycle of the data is {condition.duration:g} s, that of the model {run.cycle.duration:g} s"
        remedy = f"state cycle: {run.cycle.duration:g} s in the mapping, or set: the number of the model that makes it"
        raise MechanismError(Finding(what, "cycle", remedy))
    if unit != "rad":
        return
    refuse_backwards(next(iter(run.system.mechanism.drivers)), [(condition, span / run.cycle.duration)])
    if not np.isfinite([condition.start, condition.cycle]).all():
        return
    findings: list[Finding] = []
    if abs(condition.cycle - abs(span)) > 1e-6 * abs(span):
        what = f"the cycle of the data is {_degrees(condition.cycle)}, that of the model {_degrees(abs(span))}"
        findings.append(Finding(what, "cycle", f"state cycle: {_degrees(abs(span))} in the mapping"))
    begin = float(
        _row(run.system.drive(run.values, next(iter(run.system.mechanism.drivers)), np.zeros(1))[0], np.zeros(1))[0]
    )
    apart = condition.start - begin
    apart -= 2 * np.pi * np.round(apart / (2 * np.pi)) if run.cycle.periodic else 0.0
    if abs(apart) > 1e-6:
        what = f"the cycle of the data starts at {_degrees(condition.start)}, that of the model at {_degrees(begin)}"
        findings.append(Finding(what, "start", f"state start: {_degrees(begin)} in the mapping"))
    if findings:
        raise MechanismError(findings)


def apart(measured: float, stated: float, share: float = FAR) -> bool:
    """Whether a measured speed is off that of the model by more than a share of it; not where one is unknown."""
    return bool(abs(measured - stated) > share * abs(stated))


def refuse_backwards(driver: str, rows: Iterable[tuple[Condition, float]]) -> None:
    """MechanismError where a condition turns the other way than the model, whose speeds are in rad/s."""
    against = [replace(backward_finding(driver, one.speed, speed), file=next(iter(one.files), ""))
               for one, speed in rows if one.speed * speed < 0]  # fmt: skip
    if against:
        raise MechanismError(gathered(against))


def _refuse_opposed(mechanism: Mechanism, conditions: Sequence[Condition]) -> None:
    """MechanismError where conditions turn against the speed that the driver has under their settings, by all files.

    Where that speed is taken from the data, it is the one without them, and an error only where all such are opposed.
    """
    driver = next(iter(mechanism.drivers), "")
    path = f"drivers.{driver}.speed"
    if path not in mechanism.parameter_set.entries:
        return
    from_data: list[tuple[Condition, float]] = []
    stated: list[tuple[Condition, float]] = []
    for condition in conditions:
        settings = {name: value for name, value in condition.values.items() if name not in condition.followed}
        unknown = dict.fromkeys(condition.followed, np.nan)
        follows = np.isnan(_number(mechanism, path, settings | unknown))
        (from_data if follows else stated).append((condition, _number(mechanism, path, settings)))
    opposed = all(condition.speed * speed < 0 for condition, speed in from_data)
    refuse_backwards(driver, [*(from_data if opposed else []), *stated])


def _number(mechanism: Mechanism, path: str, settings: Mapping[str, float]) -> float:
    """A number of the mechanism, SI, under settings; names that the model does not have are passed over."""
    numbers = {}
    for name, value in settings.items():
        with suppress(MechanismError):
            numbers[mechanism.parameter_set.resolve(name)] = value
    return float(mechanism.parameters(numbers)[path])


def _degrees(angle: float) -> str:
    return f"{np.degrees(angle) + 0.0:.10g} deg"


def _beside(turning: bool, course: Array, measured: Array) -> Array:
    """The course; an angle within half a turn of what was measured, for both count their turns each in its own way."""
    if not turning:
        return course
    turns = np.round((measured - course) / (2 * np.pi))
    return course + 2 * np.pi * np.nan_to_num(turns)


def check_settings(mechanism: Mechanism, measurement: Measurement) -> None:
    """MechanismError where a condition states a number in a unit that the model's number cannot have.

    Also where the angle runs backwards.
    Names that the model does not have, and numbers without a unit, which are SI, are passed over.
    """
    _refuse_opposed(mechanism, measurement.conditions)
    findings: dict[tuple[str, str], Finding] = {}
    stated = {name for one in measurement.conditions for name in one.dimensions}
    kinds: dict[str, Kind | None] = {}
    for name in stated:
        try:
            path = mechanism.path_of(name)
        except MechanismError:  # told with the condition it is in
            continue
        entries = mechanism.parameter_set.entries
        if path not in entries:  # a number that the model does not state yet
            value = next(one.values[name] for one in measurement.conditions if name in one.dimensions)
            try:
                other = mechanism.with_values({name: value})
            except MechanismError:
                continue
            kinds[name] = measured(other, other.parameter_set.entries.values()).get(path)
        else:
            kinds[name] = measured(mechanism, entries.values()).get(path)
    for condition in measurement.conditions:
        for name, dimension in condition.dimensions.items():
            kind = kinds.get(name)
            if kind is None or kind.accepts(dimension):
                continue
            what = f"{dimension_text(dimension)} is set where the model has {_needed(kind.name)}"
            remedy = f"set {_needed(kind.name)} such as {kind.example}, or another number of the model"
            file = str(condition.files[0]) if condition.files else ""
            told = f"{what} (in condition {condition.name})"
            findings.setdefault((name, what), Finding(told, f"set.{name}", remedy, file=file))
    if findings:
        raise MechanismError(list(findings.values()))


def _needed(kind: str) -> str:
    return f"{'an' if kind[0] in 'aeiou' else 'a'} {kind}"
