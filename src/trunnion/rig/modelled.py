"""The model in one working condition: the course of what each channel measures, at the positions of the measurement."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.errors import Finding, MechanismError, Severity, Status
from trunnion.measures.evaluation import courses_of
from trunnion.measures.measures import Measure, coordinate_unit, named
from trunnion.model.mechanism import Mechanism
from trunnion.model.names import as_key
from trunnion.rig.reading.measurement import Condition, Signal
from trunnion.rig.reading.turns import gathered
from trunnion.solve.forward import Forward, forward
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import Run, prepare
from trunnion.solve.system import sticking

Array = NDArray[np.float64]
FAR = 0.05  # of a speed: an error of the settings
RIPPLE = 0.3  # of what pulses take of a speed, by where they come: 8/√720, the rest of a parabola over a straight line
STILL = 1e-9  # of the largest speed in the cycle: rounding, whose sign says nothing
SLOWER = 0.01  # of the duration of a cycle: a machine that keeps time runs no farther off


@dataclass(frozen=True, eq=False)
class Modelled:
    """What the model has at the positions of a condition, SI.

    drive: coordinate of the first driver if it runs one way, else time; unit: rad, m or s; span: what `drive` gains
    over the cycle; status: (position,); turned: (position,), see the function; courses: by channel, NaN where
    the status rules one out; left_open: standard uncertainty of a speed of pulses, by where these come.
    """

    run: Run
    drive: Array
    unit: str
    span: float
    status: NDArray[np.int8]
    turned: NDArray[np.bool_]
    courses: Mapping[str, Array]
    measures: Mapping[str, Measure]
    left_open: Mapping[str, Array]

    @property
    def speed(self) -> float:
        """Mean speed of the first driver, rad/s; NaN where it names no position."""
        return self.span / self.run.cycle.duration if self.unit == "rad" else float("nan")

    def comparable(self, channel: str) -> NDArray[np.bool_]:
        """Positions at which the model has one number for a channel.

        A force is an interval where a relative speed is zero, jumps between the positions beside, and is like a speed
        no number to rely on beside a dead centre.
        """
        finite, solved = np.isfinite(self.courses[channel]), self.status == Status.SOLVED
        if self.measures[channel].of_places:
            return finite
        if not self.measures[channel].of_motion:
            finite &= ~self.turned
        return finite & (solved if np.any(solved) else self.status < Status.CONTACT_LOST)


def measure_of(
    mechanism: Mechanism, run: Run, channel: str, name: str, course: Signal | None = None, section: str = "channels"
) -> Measure:
    """What a channel or a sensor measures.

    MechanismError if the model has no such course, or has it in another unit than the signal, such as N m for N.
    """
    where = f"{section}.{channel}.measures"
    try:
        measure = named(mechanism, [name], run.values)[0]
    except MechanismError as error:
        raise MechanismError([replace(finding, where=where) for finding in error.findings]) from None
    if not measure.everywhere or not measure.single(run.system):
        what = f"'{name}' is no number of a single position, as a sensor shows it"
        remedy = "a sensor measures such as effort:DRIVER, rate:JOINT, load:LOAD, rotation:JOINT or link.point.x"
        raise MechanismError(Finding(what, where, remedy))
    if course is not None and course.unit != (unit := measure.unit(run.system)):
        what = f"is in {course.unit}, and {course.measures} is in {unit}"
        raise MechanismError(Finding(what, f"channels.{channel}", "name another column, or state unit and gain"))
    return measure


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
    with _of_condition(condition):
        run = prepare(in_condition(mechanism, condition))
    findings: list[Finding] = []
    measures: dict[str, Measure] = {}
    for channel, name in {**(also or {}), **channels}.items():
        try:
            course = condition.courses[channel]
            measures[channel] = measure_of(run.system.mechanism, run, channel, name, course)
        except MechanismError as error:
            findings += error.findings if channel in channels else ()
    if findings:
        raise MechanismError(findings)
    if run.determinacy is not None and not all(measure.of_motion for measure in measures.values()):
        run.determinacy.refuse()
    phase, duration = np.asarray(condition.phase, float), run.cycle.duration
    time = phase * duration
    single = list({measure.name: measure for measure in measures.values()}.values())
    by_measure, status = courses_of(run, single, time, method)
    unit, drive, first, last = coordinate_unit(run.system, run.values), time, 0.0, duration
    if unit != "s":  # else the driver names no position
        name, ends = next(iter(run.system.mechanism.drivers)), np.array([0.0, duration * (1 - 1e-12)])
        drive, (first, last) = (_row(run.system.drive(run.values, name, at)[0], at) for at in (time, ends))
    same_cycle(run, condition, duration, float(first), float(last - first) if unit == "rad" else float("nan"))
    courses, left_open = {}, dict[str, Array]()
    for channel, measure in measures.items():
        modelled_row = _row(by_measure[measure.name][0], time)
        courses[channel], measured = modelled_row, condition.courses[channel]
        if measure.turning(run.system):  # both count their turns each in its own way
            turns = np.round((measured.mean - modelled_row) / (2 * np.pi))
            courses[channel] = modelled_row + 2 * np.pi * np.nan_to_num(turns)
        elif measured.per_turn and run.cycle.periodic:
            courses[channel] = over_pulses(modelled_row, phase, duration, measured.per_turn)
            left_open[channel] = RIPPLE * np.abs(modelled_row - courses[channel])
    moving = forward(run.system, run.values, run.chosen.assembly, time)
    sides = turned(run, moving, time.shape)
    return Modelled(run, drive, unit, float(last - first), status, sides, courses, measures, left_open)


def turned(run: Run, walk: Forward, shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """Positions beside one with a relative speed of the other sign, in a joint that friction or a load resists."""
    sides = np.zeros(shape, bool)
    for joint in sticking(run.system):
        speed = np.broadcast_to(np.asarray(primal(walk.speed(joint)), float), shape)
        most = np.max(np.abs(np.nan_to_num(speed)), axis=-1, keepdims=True)
        sign = np.where(np.abs(speed) > STILL * most, np.sign(speed), 0.0)
        differs = sign != np.roll(sign, -1, axis=-1)
        if not run.cycle.periodic:
            differs[..., -1] = False
        sides |= differs | np.roll(differs, 1, axis=-1)
    return sides


def over_pulses(speed: Array, phase: Array, duration: float, per_turn: int) -> Array:
    """A speed as a sensor of pulses shows it: their pitch over the time from each to the next, and straight in between.

    The first is the mean over the time of a pulse. The second is, over all places between two pulses, that mean twice.
    speed: (position,), rad/s, of a periodic cycle; it stays where it changes its sign or has no value.
    """
    from scipy.interpolate import CubicSpline

    half = np.pi / per_turn
    if not np.all(np.sign(speed[0]) * speed > 0) or half >= np.mean(np.abs(speed)) * duration / 2:
        return speed
    time, at = duration * np.concatenate([phase - 1, phase, phase + 1]), duration * phase
    for _ in range(3):
        angle, lasts = CubicSpline(time, np.tile(speed, 3)).antiderivative(), half / np.abs(speed)
        speed = np.asarray((angle(at + lasts) - angle(at - lasts)) / (2 * lasts))
    return speed


def in_condition(mechanism: Mechanism, condition: Condition) -> Mechanism:
    """The mechanism with the values of a condition, each in the unit it was stated in."""
    settings: dict[str, float | str] = dict(condition.values)
    for name, unit in condition.units.items():
        if unit != "1" and np.isfinite(condition.values.get(name, np.nan)):
            settings[name] = f"{condition.values[name]} {unit}"
    with _of_condition(condition):
        return mechanism.with_values(settings)


@contextmanager
def _of_condition(condition: Condition) -> Iterator[None]:
    """What is wrong with a condition says in which."""
    try:
        yield
    except MechanismError as error:
        tail, file = f" (in condition {condition.name})", str(next(iter(condition.files), ""))
        raise MechanismError(
            replace(finding, what=finding.what.removesuffix(tail) + tail, file=finding.file or file)
            for finding in error.findings
        ) from None


Item = TypeVar("Item")
Result = TypeVar("Result")


def each(
    items: Iterable[Item], of: Callable[[Item], Result], progress: Callable[[int], None] | None = None
) -> list[Result]:
    """What there is of every item; MechanismError with the errors of all. progress: called with those done."""
    results: list[Result] = []
    findings: list[Finding] = []
    for done, item in enumerate(items, 1):
        try:
            results.append(of(item))
        except MechanismError as error:
            findings += error.findings
        if progress:
            progress(done)
    if findings:
        raise MechanismError(gathered(finding for finding in findings if finding.severity is not Severity.NOTE))
    return results


def _row(number: object, time: Array) -> Array:
    return np.array(np.broadcast_to(np.asarray(number, float), time.shape))


def same_cycle(run: Run, condition: Condition, duration: float, begin: float, span: float) -> None:
    """MechanismError where the cycle of the data is not the model's, starts elsewhere, or runs backwards.

    duration: of the model's, s; begin, span: where the driver is at its start, and how far it turns, rad; NaN where its
    turns name no position. What the data do not tell is NaN.
    """
    file, driver, rpm = str(next(iter(condition.files), "")), next(iter(run.system.mechanism.drivers), ""), np.pi / 30
    if condition.speed * span < 0:
        what = f"the angle runs backwards: {condition.speed / rpm:.4g} rpm measured, "
        what += f"{span / duration / rpm:.4g} rpm stated of {driver}"
        remedy = f"set {as_key(f'{driver}.speed')} below zero if it does; else add sign: -1 to angle:, or remove it"
        figures = {"measured": condition.speed, "stated": span / duration}
        raise MechanismError(Finding(what, "angle", remedy, file=file, code="data.angle.backwards", figures=figures))
    off = condition.start - begin
    off -= 2 * np.pi * np.round(off / (2 * np.pi)) if run.cycle.periodic else 0.0
    findings = []
    for key, difference, least, data, model, unit in (
        ("cycle", condition.duration - duration, SLOWER * duration, condition.duration, duration, "s"),
        ("cycle", condition.cycle - abs(span), 1e-6 * abs(span), *np.degrees([condition.cycle, abs(span)]), "deg"),
        ("start", off + 0 * condition.cycle, 1e-6, *np.degrees([condition.start, begin]), "deg"),
    ):
        if abs(difference) > least:
            what = f"the {key} of the data is {data + 0.0:.10g} {unit}, that of the model {model + 0.0:.10g} {unit}"
            findings.append(Finding(what, key, f"state {key}: {model + 0.0:.10g} {unit} in the mapping"))
    if findings:
        raise MechanismError(findings)


def apart(measured: float, nominal: float, share: float = FAR) -> bool:
    """Whether a measured speed is off that of the model by more than a share of it; not where one is unknown."""
    return bool(abs(measured - nominal) > share * abs(nominal))
