"""`identify`: numbers of a model from measurements by least squares, with what they are worth."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import PurePath
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError, Status
from trunnion.measures.measures import Measure, named
from trunnion.model.arguments import strict_arguments
from trunnion.model.mechanism import Mechanism
from trunnion.rig.identification.findings import findings_of
from trunnion.rig.identification.fit import (
    EFFICIENCY,
    FILE_ZERO,
    Block,
    Evaluations,
    Fit,
    Solution,
    refined,
    sensor_errors,
    shared_zero,
    sizes_of,
    solved,
)
from trunnion.rig.identification.identifiability import inseparable
from trunnion.rig.identification.misfit import explanations
from trunnion.rig.identification.result import Identified, dataset
from trunnion.rig.identification.signals import Model, SeatedModel
from trunnion.rig.identification.uncertainty import excess, spread_of
from trunnion.rig.identification.unknowns import Parameters, described, unknowns
from trunnion.rig.modelled import apart, each, in_condition, measure_of, refuse_backwards, refuse_unit
from trunnion.rig.reading.efficiency import efficiency_of, load_joints, pairs_of
from trunnion.rig.reading.measurement import Accuracy, Condition, Measurement, Signal
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import Run, prepare

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["HoldOut", "held_out", "identify"]

Array = NDArray[np.float64]
HoldOut = float | str | Sequence[str] | None
NOTHING = 1e-9  # of a course: what an unknown does to it
MOST_NAMED = 6  # conditions in a message
SAME = 1e-6  # of a setting
HALVINGS = 8  # of a friction that locks at the start
OTHERS = (0.3, 3.0)  # times the start: where else a search begins first
CLOSE = 1e-3  # of the sizes: two searches ended at one place
AS_GOOD = 4.0  # sum of squares: another place is named if it is not worse by more


@strict_arguments
@np.errstate(all="ignore")  # of numbers near the end of the floats: what has no value is NaN, and its status says so
def identify(
    mechanism: Mechanism,
    measurement: Measurement,
    parameters: Parameters,
    channels: Sequence[str] | None = None,
    start: Mapping[str, float | str] | None = None,
    hold_out: HoldOut = None,
    sensors: Literal["channel", "condition"] = "channel",
    guard: int | None = None,
    starts: int = 1,
    friction_method: FrictionMethod | None = None,
    progress: Callable[[int], None] | None = None,
) -> xr.Dataset:
    """Identify numbers of a mechanism, with 95 % intervals, correlation, and what cannot be told apart.

    Weighted least squares with exact derivatives by a trust region; covariances by the scatter between turns.

    Parameters
    ----------
    mechanism : the model.
    measurement : as `rig.read` or `rig.observe` has it.
    parameters : names as for `Mechanism.with_values`, each an unknown; or by a name of your own the numbers that are to
        be one unknown: `{"pins": ["pin-1.friction.coefficient", "pin-2.friction.coefficient"]}`.
    channels : of the measurement; all that an unknown acts on if not given; `efficiency` is computed of torques and
        speeds.
    start : where the search begins, by name, SI or texts with units; the model's values if not given.
    hold_out : conditions by name, file or setting, or the share of the turns of each (the last), that are not fitted
        but predicted.
    sensors : whether zero and gain of a channel are off by the same in all conditions, or in each by its own.
    guard : positions left out on each side where the sense of a friction changes; one for every 90 of a cycle if not
        given.
    starts : places to begin at.
    friction_method : how friction and reactions are settled; Newton's method if not given.
    progress : called with the number of models evaluated.

    Returns
    -------
    Dataset with the estimates by parameter, errors of the sensors, and residuals by channel, condition and position.

    Raises
    ------
    MechanismError
        For names, channels or conditions that are not there, or where the model has no answer.
    """
    if guard is not None and guard < 0:
        raise MechanismError(Finding(f"{guard} positions cannot be left out", "guard", "give 0 or more"))
    if starts < 1:
        raise MechanismError(Finding(f"the number of start points is {starts}", "starts", "give 1 or more"))
    conditions = measurement.conditions
    each(conditions, partial(in_condition, mechanism))
    paths = described(mechanism, parameters)
    mechanism = _stated(mechanism, measurement, paths, start or {})
    settings = _settings(mechanism, measurement, paths)
    run = prepare(mechanism)
    if run.determinacy is not None:
        run.determinacy.refuse()
    joints = load_joints(mechanism)
    blocks = _blocks(measurement, _channels(measurement, channels, joints), held_out(mechanism, measurement, hold_out),
                     joints)  # fmt: skip
    kind = SeatedModel if any(seat.given is None for seat in run.seats) else Model
    sought, phases = unknowns(mechanism, paths, start or {}), tuple(np.asarray(one.phase, float) for one in conditions)
    method = friction_method or FrictionMethod()
    model = kind(run, tuple(sought), _measures(mechanism, run, blocks), settings, phases, method)
    unused: list[str] = []
    if channels is None:
        model, blocks, unused = _acted_on(model, blocks)
    at = np.array([one.start for one in model.unknowns])
    speeds = iter([model.driven(k, at)[2] for k in range(len(conditions))])
    each(conditions, lambda one: refuse_backwards(mechanism, one, next(speeds)))
    fit = Fit(
        Evaluations(model, progress), blocks, sensor_errors(model, conditions, blocks, sensors == "condition"), guard
    )
    begin = _runnable(fit)
    fit, best, other = _searched(fit, begin, starts)
    spread = spread_of(fit, best.x)
    fit = replace(fit, inflation=excess(fit, spread))
    if fit.inflation > 1 and fit.sensors:
        best = replace(solved(fit, best.x), evaluations=best.evaluations, settled=best.settled)
        spread = spread_of(fit, best.x)
    other_speeds = [apart(one.speed, model.driven(k, best.x[: fit.count])[2]) for k, one in enumerate(conditions)]
    causes = explanations(fit, begin, spread.test) if spread.test.misfit and not any(other_speeds) else []
    groups = inseparable(fit, best.x, spread)
    identified = Identified(mechanism, measurement, fit, best, starts, other, spread, groups, causes, unused)
    return dataset(identified, findings_of(identified))


# ---- the data -------------------------------------------------------------------------------------------------


def _channels(measurement: Measurement, channels: Sequence[str] | None, joints: Mapping[str, str]) -> list[str]:
    """Channels to fit, in the order of the data; all if none is named. MechanismError for one that is not there."""
    every = list(dict.fromkeys(name for one in measurement.conditions for name in one.courses))
    if not every:
        raise MechanismError(Finding("the measurement has no channels", measurement.name, "map one to a measure"))
    computed = [EFFICIENCY] if any(pairs_of(one, joints) for one in measurement.conditions) else []
    missing = [name for name in channels or () if name not in (*every, *computed)]
    if missing:
        remedy = f"the measurement has {', '.join(every)}{f', and {EFFICIENCY} of them' if computed else ''}"
        raise MechanismError(Finding(f"there is no channel '{missing[0]}'", "channels", remedy))
    return every if channels is None else [name for name in dict.fromkeys([*every, *computed]) if name in channels]


def _blocks(
    measurement: Measurement, channels: Sequence[str], held: tuple[frozenset[str], float], joints: Mapping[str, str]
) -> list[Block]:
    """One for each channel in each condition. held: conditions by name, and the share of the turns of each, the last
    ones; joints: of the loads, for the efficiency."""
    names, share = held
    blocks = []
    for index, condition in enumerate(measurement.conditions):
        for channel in channels:
            signal = condition.courses.get(channel)
            effects: dict[str, float] = {}
            if signal is None and channel == EFFICIENCY and pairs_of(condition, joints):
                signal, effects = _efficiency(condition, joints)
            if signal is None:
                continue
            turns = np.where(np.isinf(signal.turns), np.nan, signal.turns)
            fitted = len(turns) - (max(1, round(share * len(turns))) if share else 0)
            if fitted < 1:
                what = f"has {len(turns)} turn{'s' * (len(turns) != 1)}: none would be left to fit"
                remedy = "name conditions to hold out, or give a smaller share"
                raise MechanismError(Finding(what, f"condition {condition.name}", remedy))
            fitted = 0 if condition.name in names else fitted
            blocks.append(
                Block(index, channel, signal, turns[:fitted], turns[fitted:], effects, tuple(condition.files))
            )
    if not any(len(block.turns) for block in blocks):
        raise MechanismError(Finding("all conditions are held out", "hold_out", "leave some to fit"))
    return blocks


def _efficiency(condition: Condition, joints: Mapping[str, str]) -> tuple[Signal, dict[str, float]]:
    """The efficiency of each turn as a course of one position, and what the errors of its sensors do to it."""
    efficiency = efficiency_of(condition, joints)
    effects: dict[str, float] = {}
    for one in efficiency.contributions:
        accuracy = condition.courses[one.channel].accuracy if one.channel in condition.courses else Accuracy()
        if one.source == "gain":
            effects[f"gain of {one.channel}"] = one.sensitivity * one.input
        elif one.source == "zero":
            effects[f"zero of {one.channel}"] = one.sensitivity * shared_zero(accuracy)
            effects[f"{FILE_ZERO} of {one.channel}"] = one.sensitivity * accuracy.own
    return Signal(EFFICIENCY, "efficiency:cycle", "1", efficiency.per_turn[:, None]), effects


def held_out(mechanism: Mechanism, measurement: Measurement, hold_out: HoldOut) -> tuple[frozenset[str], float]:
    """Names of the conditions to hold out, and the share of the turns of the others.

    A condition is named by its name, the name of its file without extension, a setting such as `misalignment=15 deg`,
    or its value as it stands in the names, which may be that of several, or a part of its name that no other has.
    MechanismError for what names none.
    """
    if hold_out is None:
        return frozenset(), 0.0
    if isinstance(hold_out, (int, float)):
        if not 0 < hold_out < 1:
            what = f"a share of {hold_out:g} of the turns cannot be held out"
            raise MechanismError(Finding(what, "hold_out", "give a share between 0 and 1, or names of conditions"))
        return frozenset(), float(hold_out)
    conditions, held = measurement.conditions, set[str]()
    for text in [hold_out] if isinstance(hold_out, str) else hold_out:
        part = text.strip()
        exact = [one.name for one in conditions if text in (one.name, *(PurePath(file).stem for file in one.files))]
        settings = [one.name for one in conditions if part and f" {part}," in f"{one.name},"]
        parts = [one.name for one in conditions if part and part in one.name]
        named = exact or _with_setting(mechanism, measurement, part) or settings or parts * (len(parts) == 1)
        if not named:
            what = (
                f"'{text}' is in the names of {len(parts)} conditions" if parts else f"there is no condition '{text}'"
            )
            several = parts or [one.name for one in conditions]
            some = "; ".join(several[:MOST_NAMED]) + "; …" * (len(several) > MOST_NAMED)
            remedy = f"name one of {some}; or a file, or a setting as NAME=VALUE"
            raise MechanismError(Finding(what, "hold_out", remedy))
        held |= set(named)
    return frozenset(held), 0.0


def _with_setting(mechanism: Mechanism, measurement: Measurement, text: str) -> list[str]:
    """Names of the conditions with a setting NAME=VALUE."""
    name, equals, value = (part.strip() for part in text.partition("="))
    if not equals:
        return []
    path = mechanism.path_of(name)
    try:
        changed = mechanism.with_values({path: float(value)})
    except ValueError:  # with a unit
        changed = mechanism.with_values({path: value})
    stated = float(np.ravel(changed.parameters()[path])[0])
    names = []
    for one in measurement.conditions:
        number = {mechanism.path_of(key): number for key, number in one.values.items()}.get(path, np.nan)
        if abs(number - stated) <= SAME * max(abs(stated), abs(number)):
            names.append(one.name)
    return names


# ---- the model ------------------------------------------------------------------------------------------------


def _acted_on(model: Model, blocks: list[Block]) -> tuple[Model, list[Block], list[str]]:
    """Only the channels that an unknown acts on, as far as the start shows, all if there are none; then the others."""
    courses = model.courses(np.array([one.start for one in model.unknowns]))
    sizes = np.array([one.size or 1.0 for one in model.unknowns])
    moved = dict.fromkeys(model.measures, 0.0)
    for said in courses.said:
        for name, one in said.items():
            most = float(np.nanmax(np.abs(one.value), initial=0.0))
            change = float(np.nanmax(np.abs(np.nan_to_num(one.slope)) * sizes[:, None], initial=0.0))
            moved[name] = max(moved[name], change / most if most else change)
    acted_on = {name: model.measures[name] for name, share in moved.items() if share > NOTHING} or model.measures
    unused = [name for name in model.measures if name not in acted_on]
    return replace(model, measures=acted_on), [block for block in blocks if block.channel in acted_on], unused


def _stated(
    mechanism: Mechanism,
    measurement: Measurement,
    paths: Mapping[str, Sequence[str]],
    start: Mapping[str, float | str],
) -> Mechanism:
    """The mechanism with all numbers stated that the conditions set or that are looked for."""
    entries = mechanism.parameter_set.entries
    numbers: dict[str, float | str] = {}
    for condition in measurement.conditions:
        for name, value in condition.values.items():
            numbers.setdefault(mechanism.path_of(name), float(value))
    for name, own in paths.items():
        numbers |= dict.fromkeys(own, start.get(name, 0.0))
    missing = {path: value for path, value in numbers.items() if path not in entries}
    return mechanism.with_values(missing) if missing else mechanism


def _settings(
    mechanism: Mechanism, measurement: Measurement, paths: Mapping[str, Sequence[str]]
) -> tuple[dict[str, float], ...]:
    """What each condition sets, by path; MechanismError where that is looked for."""
    owners = {path: name for name, own in paths.items() for path in own}
    settings = []
    for condition in measurement.conditions:
        values = {mechanism.path_of(name): float(value) for name, value in condition.values.items()}
        for path in values:
            if path in owners:
                what = f"the condition {condition.name} sets {path}"
                remedy = "leave it out of the conditions"
                raise MechanismError(Finding(what, f"parameter {owners[path]}", remedy))
            if path not in mechanism.parameters():
                what = f"the condition {condition.name} sets it, but it is no number: it changes with the motion"
                raise MechanismError(Finding(what, path, "set a dimension in it"))
        settings.append(values)
    return tuple(settings)


def _measures(mechanism: Mechanism, run: Run, blocks: Sequence[Block]) -> dict[str, Measure]:
    """What each channel measures; MechanismError for what has no course."""
    measures: dict[str, Measure] = {}
    for block in blocks:
        channel, text = block.channel, block.signal.measures
        of_turns = channel == EFFICIENCY and block.turns.shape[1] == 1  # one figure of each, made in `_efficiency`
        measure = named(mechanism, [text], run.values)[0] if of_turns else measure_of(mechanism, run, channel, text)
        refuse_unit(run, measure, channel, block.signal)
        if measures.setdefault(channel, measure).name != measure.name:
            what = f"measures {measures[channel].name} in one condition and {measure.name} in another"
            raise MechanismError(Finding(what, f"channel {channel}", "use separate channels"))
    return measures


# ---- the search -----------------------------------------------------------------------------------------------


def _searched(fit: Fit, begin: Array, starts: int) -> tuple[Fit, Solution, Array | None]:
    """The best of the fits from several places, and another place that fits as well, if there is one.

    Others are the start times and divided by 3, then at random between a tenth and ten times.
    """
    best_fit, best = refined(fit, begin)
    other, random = None, np.random.default_rng(1)
    low, high = fit.bounds
    for k in range(starts - 1):
        place = begin.copy()
        place[: fit.count] *= OTHERS[k] if k < len(OTHERS) else 10 ** random.uniform(-1, 1, fit.count)
        try:
            next_fit, found = refined(fit, np.clip(place, low, high))
        except ValueError:  # no answer of the model there
            continue
        away = np.max(np.abs(found.x - best.x)[: fit.count] / sizes_of(best_fit, best.x)[: fit.count])
        if not found.converged or away <= CLOSE:
            continue
        if found.cost < best.cost * (1 - 1e-6) - 1e-6:
            other = best.x if best.cost < found.cost + AS_GOOD else None
            best_fit, best = next_fit, found
        elif found.cost < best.cost + AS_GOOD:
            other = found.x
    return best_fit, best, other


def _runnable(fit: Fit) -> Array:
    """The start, with less friction where that locks. MechanismError if no position can be used."""

    def unanswered(x: Array) -> int:
        return sum(int(np.count_nonzero(status >= Status.NOT_CONVERGED)) for status in fit.courses(x).status)

    unknowns = fit.model.unknowns
    rubs = [p for p, one in enumerate(unknowns) if any(".friction." in path for path in one.paths)]
    low = np.array([one.lower for one in unknowns])
    best, lost = fit.start, unanswered(fit.start)
    for k in range(1, HALVINGS + 1):
        if not lost or not rubs:
            break
        less = fit.start.copy()
        less[rubs] = np.maximum(fit.start[rubs] * 0.5**k, low[rubs])
        if unanswered(less) < lost:
            best, lost = less, unanswered(less)
    masks = replace(fit, variances=fit.first_scatter()).allowed(best)
    if not any(np.any(masks[k]) for k in fit.fitted()):
        codes = np.concatenate([np.asarray(status) for status in fit.courses(best).status])
        what = "no position can be used: no channel has a value there, friction reverses beside it, or the model has "
        what += f"no sound answer (most often {list(Status)[int(np.bincount(codes).argmax())].text})"
        remedy = "see the gaps with `trunnion data`; give a smaller guard, or start values with which the model runs"
        raise MechanismError(Finding(what, "data", remedy))
    return best
