"""`identify`: numbers of a model from measurements by least squares, with what they are worth."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError
from trunnion.measures.measures import Measure, named
from trunnion.model.arguments import strict_arguments
from trunnion.model.mechanism import Mechanism
from trunnion.rig.identification.blocks import EFFICIENCY, Block, blocks_of, channels_of, finite
from trunnion.rig.identification.fit import FitProblem, fit, sensors_of
from trunnion.rig.identification.holdout import HoldOut, held_out
from trunnion.rig.identification.identifiability import inseparable
from trunnion.rig.identification.misfit import explanations
from trunnion.rig.identification.search import search
from trunnion.rig.identification.signals import Model, SeatedModel
from trunnion.rig.identification.uncertainty import left_over, spread_of
from trunnion.rig.identification.unknowns import Parameters, described, unknowns
from trunnion.rig.modelled import apart, check_settings, refuse_backwards, refuse_unit, told_at
from trunnion.rig.reading.efficiency import load_joints
from trunnion.rig.reading.measurement import Measurement
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import Run, prepare

if TYPE_CHECKING:
    import xarray as xr

from trunnion.rig.identification.identified import Identified
from trunnion.rig.identification.model_values import values
from trunnion.rig.identification.result import dataset

__all__ = ["identify", "with_estimates"]

Array = NDArray[np.float64]
Errors = Literal["channel", "condition"]


@strict_arguments
@np.errstate(all="ignore")  # of numbers near the end of the floats: what has no value is NaN, and its status says so
def identify(
    mechanism: Mechanism,
    measurement: Measurement,
    parameters: Parameters,
    channels: Sequence[str] | None = None,
    start: Mapping[str, float | str] | None = None,
    hold_out: HoldOut = None,
    sensors: Errors = "channel",
    delay: float | None = None,
    guard: int | None = None,
    starts: int | None = None,
    friction_method: FrictionMethod | None = None,
    progress: Callable[[int], None] | None = None,
) -> xr.Dataset:
    """Numbers of a mechanism from what was measured, with 95 % intervals, correlation, and what cannot be told apart.

    parameters: names as for `Mechanism.with_values`, each an unknown; or by a name of your own the numbers that are to
    be one unknown: `{"pins": ["pin-1.friction.coefficient", "pin-2.friction.coefficient"]}`.
    channels: of the measurement; all that an unknown acts on if not given; `efficiency` is computed of torques and
    speeds. start: where the search begins, by name, SI or texts with units; the model's values if not given.
    hold_out: conditions by name, file or setting, or the share of the turns of each (the last), that are not fitted but
    predicted. sensors: whether zero and gain of a channel are off by the same in all conditions, or in each by its own.
    delay: standard uncertainty, s, of the time by which a channel lags behind the angle, as its bandwidth makes it;
    what it is in fact is estimated too. guard: positions left out on each side where the sense of a friction changes;
    one for every 90 of a cycle if not given.
    starts: places to begin at; more than one if the model does not fit and it is not given. progress: called with the
    number of models evaluated. friction_method: how friction and reactions are settled; Newton's method if not given.
    Method: weighted least squares with exact derivatives, trust region; covariances by the scatter between turns.
    Raises MechanismError for names, channels or conditions that are not there, or where the model has no answer.
    """
    _check(sensors, delay, guard, starts)
    check_settings(mechanism, measurement)
    measurement = finite(measurement)
    paths = described(mechanism, parameters)
    stated = _stated(mechanism, measurement, paths, start or {})
    settings = _settings(stated, measurement, paths)
    run = prepare(stated)
    if run.determinacy is not None:
        run.determinacy.refuse()
    joints = load_joints(stated)
    held, share = held_out(stated, measurement, hold_out)
    blocks = blocks_of(measurement, channels_of(measurement, channels, joints), held, share, joints)
    measures = _measures(stated, run, blocks)
    phases = tuple(np.asarray(one.phase, float) for one in measurement.conditions)
    kind = SeatedModel if any(seat.given is None for seat in run.seats) else Model
    model = kind(run, tuple(unknowns(stated, paths, start or {})), measures, settings, phases,
                 friction_method or FrictionMethod())  # fmt: skip
    unused: list[str] = []
    if channels is None:
        model, blocks, unused = _telling(model, blocks)
    at = np.array([one.start for one in model.unknowns])
    speeds = [(one, model.driven(k, at)[2]) for k, one in enumerate(measurement.conditions)]
    refuse_backwards(next(iter(stated.drivers), ""), speeds)
    names = [one.name for one in measurement.conditions] if sensors == "condition" else None
    lags = {one.name: one.lag for one in measurement.conditions}
    cuts = [(one.cut, one.speed) for one in measurement.conditions]
    problem = FitProblem(model, blocks, sensors_of(blocks, names, delay, lags, cuts), guard, progress=progress)
    return dataset(_solved(stated, measurement, problem, starts, unused))


def _solved(
    mechanism: Mechanism, measurement: Measurement, problem: FitProblem, starts: int | None, unused: Sequence[str]
) -> Identified:
    """The estimates, what they are worth, and what would explain a misfit."""
    found = search(problem, starts)
    spread = spread_of(problem, found.fit.x)
    problem.left_over = left_over(problem, spread)
    if problem.left_over > 1 and problem.sensors:
        found = replace(found, fit=fit(problem, found.fit.x))
        spread = spread_of(problem, found.fit.x)
    groups = inseparable(problem, found.fit.x, spread)
    speeds = (problem.model.driven(k, found.fit.x[: problem.count])[2] for k in range(len(measurement.conditions)))
    other = any(apart(one.speed, speed) for one, speed in zip(measurement.conditions, speeds, strict=True))
    causes = explanations(problem, found.start, spread.test) if spread.test.misfit and not other else []
    return Identified(mechanism, measurement, problem, found, spread, groups, causes, unused)


def _check(sensors: str, delay: float | None, guard: int | None, starts: int | None) -> None:
    """MechanismError for options that mean nothing."""
    if sensors not in ("channel", "condition"):
        what = f"errors of sensors are not alike by '{sensors}'"
        raise MechanismError(Finding(what, "sensors", "give channel or condition"))
    if delay is not None and not delay > 0:
        raise MechanismError(Finding(f"a delay of {delay:g} s is not above 0", "delay", "give a standard uncertainty"))
    if guard is not None and guard < 0:
        raise MechanismError(Finding(f"{guard} positions cannot be left out", "guard", "give 0 or more"))
    if starts is not None and starts < 1:
        raise MechanismError(Finding(f"the number of start points is {starts}", "starts", "give 1 or more"))


def _telling(model: Model, blocks: list[Block]) -> tuple[Model, list[Block], list[str]]:
    """Only the channels that an unknown acts on, as far as the start tells, all if there are none; then the others."""
    courses = model.courses(np.array([one.start for one in model.unknowns]))
    sizes = np.array([one.size or 1.0 for one in model.unknowns])
    moved = dict.fromkeys(model.measures, 0.0)
    for said in courses.said:
        for name, one in said.items():
            most = float(np.nanmax(np.abs(one.value), initial=0.0))
            change = float(np.nanmax(np.abs(np.nan_to_num(one.slope)) * sizes[:, None], initial=0.0))
            moved[name] = max(moved[name], change / most if most else change)
    kept = {name: model.measures[name] for name, share in moved.items() if share > NOTHING} or model.measures
    unused = [name for name in model.measures if name not in kept]
    return replace(model, measures=kept), [block for block in blocks if block.channel in kept], unused


NOTHING = 1e-9  # of a course: what an unknown does to it


def _stated(
    mechanism: Mechanism,
    measurement: Measurement,
    paths: Mapping[str, Sequence[str]],
    start: Mapping[str, float | str],
) -> Mechanism:
    """The mechanism with all numbers stated that the conditions set or that are looked for."""
    entries = mechanism.parameter_set.entries
    missing: dict[str, float | str] = {}
    for condition in measurement.conditions:
        for name, value in condition.values.items():
            path = mechanism.path_of(name)
            if path not in entries:
                missing[path] = float(value)
    for name, own in paths.items():
        missing.update({path: start.get(name, 0.0) for path in own if path not in entries})
    return mechanism.with_values(missing) if missing else mechanism


def _settings(
    mechanism: Mechanism, measurement: Measurement, paths: Mapping[str, Sequence[str]]
) -> tuple[dict[str, float], ...]:
    """What each condition sets, by path; MechanismError where that is looked for."""
    owners = {path: name for name, own in paths.items() for path in own}
    found, findings = [], []
    for condition in measurement.conditions:
        values = {mechanism.path_of(name): float(value) for name, value in condition.values.items()}
        for path in values:
            if path in owners:
                what = f"the condition {condition.name} sets {path}"
                findings.append(Finding(what, f"parameter {owners[path]}", "leave it out of the conditions"))
            elif path not in mechanism.parameters():
                what = f"the condition {condition.name} sets it, but it is no number: it changes with the motion"
                findings.append(Finding(what, path, "set a dimension in it"))
        found.append(values)
    if findings:
        raise MechanismError(findings[0])
    return tuple(found)


def _measures(mechanism: Mechanism, run: Run, blocks: Sequence[Block]) -> dict[str, Measure]:
    """What each channel measures; MechanismError for what has no course."""
    texts: dict[str, str] = {}
    for block in blocks:
        if texts.setdefault(block.channel, block.course.measures) != block.course.measures:
            what = f"measures {texts[block.channel]} in one condition and {block.course.measures} in another"
            raise MechanismError(Finding(what, f"channel {block.channel}", "use separate channels"))
    found = {name: named(mechanism, [text], run.values)[0] for name, text in texts.items()}
    for name, measure in found.items():
        if not measure.everywhere or not (measure.single(run.system) or measure.kind == EFFICIENCY):
            what = f"measures {texts[name]}, which is no one number at each position{told_at(measure)}"
            raise MechanismError(
                Finding(what, f"channel {name}", "effort:DRIVER, load:LOAD, rate:JOINT or link.point.x is")
            )
        refuse_unit(run, measure, name, next(block.course for block in blocks if block.channel == name))
    return found


def with_estimates(mechanism: Mechanism, result: xr.Dataset) -> Mechanism:
    """The mechanism with the estimates of a result in place, rounded to two digits of their standard uncertainty.

    Those that were not told apart stay as they are.
    """
    return mechanism.with_values(values(mechanism, result))
