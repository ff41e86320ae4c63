"""`identify`: numbers of a model from measurements by least squares, with what they are worth.

Settings of the conditions and paths of the unknowns → one prepared model → blocks of data → fit → covariances → result.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from itertools import product
from pathlib import PurePath
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError, Status
from trunnion.measures.measures import Measure
from trunnion.model.arguments import strict_arguments
from trunnion.model.mechanism import Mechanism
from trunnion.rig.identification.fit import Block, Evaluations, Fit, refined, sensor_errors, solved
from trunnion.rig.identification.result import Identified, dataset
from trunnion.rig.identification.signals import Model, Parameters, described, unknowns
from trunnion.rig.identification.uncertainty import inseparable, spread_of
from trunnion.rig.modelled import each, in_condition, measure_of, refuse_unit, same_cycle
from trunnion.rig.reading.measurement import Condition, Measurement
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


@strict_arguments
@np.errstate(all="ignore")  # of numbers near the end of the floats: what has no value is NaN, and its status says so
def identify(
    mechanism: Mechanism,
    measurement: Measurement,
    parameters: Parameters,
    channels: Sequence[str] | None = None,
    start: Mapping[str, float | str] | None = None,
    hold_out: HoldOut = None,
    guard: int | None = None,
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
    channels : of the measurement; all that an unknown acts on if not given.
    start : where the search begins, by name, SI or texts with units; the model's values if not given.
    hold_out : conditions by name, file or setting, or the share of the turns of each (the last), that are not fitted
        but predicted.
    guard : positions left out on each side where the sense of a friction changes; one for every 90 of a cycle if not
        given.
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
    conditions = measurement.conditions
    each(conditions, partial(in_condition, mechanism))
    paths = described(mechanism, parameters)
    mechanism, settings = _with_settings(mechanism, conditions, paths, start or {})
    run = prepare(mechanism)
    if run.determinacy is not None:
        run.determinacy.refuse()
    blocks = _blocks(measurement, channels, held_out(mechanism, measurement, hold_out))
    if follow := [seat.joint for seat in run.seats if seat.given is None]:
        what = f"pins lie as their loads press them, which carries no derivatives: {', '.join(follow)}"
        raise MechanismError(Finding(what, "seat", "state seat: free, or the side that each lies on"))
    phases = tuple(np.asarray(condition.phase, float) for condition in conditions)
    sought, measures = tuple(unknowns(mechanism, paths, start or {})), _measures(mechanism, run, blocks)
    model = Model(run, sought, measures, settings, phases, friction_method or FrictionMethod())
    if channels is None:
        model = replace(model, measures=_acted_on(model))
        blocks = [block for block in blocks if block.channel in model.measures]
    encoder = f"drivers.{next(iter(mechanism.drivers), '')}.start"  # an unknown of data that state an angle
    starts = [condition.start for condition in conditions]
    if not (any(encoder in unknown.paths for unknown in sought) and np.isfinite(starts).any()):
        encoder = ""
    at = np.array([unknown.before[0] if encoder in unknown.paths else unknown.start for unknown in sought])

    def check(k: int) -> None:
        cycle = model.cycle(k, at)
        same_cycle(run, conditions[k], model.cycles[k].duration, cycle.begin, cycle.turn)

    each(range(len(conditions)), check)
    errors = sensor_errors(model, conditions, blocks)
    fit = Fit(Evaluations(model, progress or (lambda count: None)), blocks, errors, guard)
    begin = _runnable(fit)
    fit, best = refined(fit, begin)
    spread = spread_of(fit, best.x)
    if spread.excess > 1 and fit.sensors:
        fit = replace(fit, inflation=spread.excess)
        best = best._replace(x=solved(fit, best.x).x)
        spread = spread_of(fit, best.x)
    return dataset(Identified(mechanism, measurement, fit, best, spread, inseparable(fit, best.x, spread), encoder))


# ---- the data -------------------------------------------------------------------------------------------------


def _blocks(
    measurement: Measurement,
    channels: Sequence[str] | None,
    held_conditions: tuple[frozenset[str], float],
) -> list[Block]:
    """One for each channel in each condition; all channels if none is named.

    held_conditions: conditions by name, and the share of the turns of each, the last ones.
    """
    conditions, (names, share) = measurement.conditions, held_conditions
    every = list(dict.fromkeys(name for condition in conditions for name in condition.courses))
    if not every:
        raise MechanismError(Finding("the measurement has no channels", measurement.name, "map one to a measure"))
    if missing := [name for name in channels or () if name not in every]:
        remedy = f"the measurement has {', '.join(every)}"
        raise MechanismError(Finding(f"there is no channel '{missing[0]}'", "channels", remedy))
    blocks = []
    picked = every if channels is None else [name for name in every if name in channels]
    for (index, condition), channel in product(enumerate(conditions), picked):
        if (signal := condition.courses.get(channel)) is None:
            continue
        turns = np.where(np.isinf(signal.turns), np.nan, signal.turns)
        fitted = len(turns) - (max(1, round(share * len(turns))) if share else 0)
        if fitted < 1:
            what = f"has {len(turns)} turn{'s' * (len(turns) != 1)}: none would be left to fit"
            remedy = "name conditions to hold out, or give a smaller share"
            raise MechanismError(Finding(what, f"condition {condition.name}", remedy))
        fitted = 0 if condition.name in names else fitted
        first, last = (replace(signal, turns=part) for part in (turns[:fitted], turns[fitted:]))
        blocks.append(Block(index, channel, first, last))
    if not any(len(block.signal.turns) for block in blocks):
        raise MechanismError(Finding("all conditions are held out", "hold_out", "leave some to fit"))
    return blocks


def held_out(mechanism: Mechanism, measurement: Measurement, hold_out: HoldOut) -> tuple[frozenset[str], float]:
    """Names of the conditions to hold out, and the share of the turns of the others.

    A condition is named by its name, the name of its file, a setting such as `misalignment=15 deg`, or a part of its
    name that is a value or a word there. MechanismError for what names none.
    """
    if isinstance(hold_out, (int, float)):
        if not 0 < hold_out < 1:
            what = f"a share of {hold_out:g} of the turns cannot be held out"
            raise MechanismError(Finding(what, "hold_out", "give a share between 0 and 1, or names of conditions"))
        return frozenset(), float(hold_out)
    conditions, picked = measurement.conditions, set[str]()
    for text in [hold_out] if isinstance(hold_out, str) else hold_out or ():
        exact, parts, part = set[str](), set[str](), text.strip()
        name, equals, value = (item.strip() for item in text.partition("="))
        for condition in conditions:
            files = [PurePath(file) for file in condition.files]
            if text in (condition.name, *(file.name for file in files), *(file.stem for file in files)):
                exact.add(condition.name)
            elif part and re.search(rf"(?<![\w.-]){re.escape(part)}(?![\w.-])", condition.name):
                parts.add(condition.name)
            elif equals:
                path = mechanism.path_of(name)
                settings = {mechanism.path_of(key): setting for key, setting in condition.values.items()}
                number: float | str = value
                with suppress(ValueError):  # with a unit
                    number = float(value)
                value_stated = float(np.ravel(mechanism.with_values({path: number}).parameters()[path])[0])
                if np.isclose(settings.get(path, np.nan), value_stated, rtol=SAME, atol=0):
                    exact.add(condition.name)
        if not exact | parts:
            names = "; ".join(condition.name for condition in conditions[:MOST_NAMED])
            remedy = f"name one of {names}{'; …' * (len(conditions) > MOST_NAMED)}; or a file, or NAME=VALUE"
            raise MechanismError(Finding(f"there is no condition '{text}'", "hold_out", remedy))
        picked |= exact or parts
    return frozenset(picked), 0.0


# ---- the model ------------------------------------------------------------------------------------------------


def _with_settings(
    mechanism: Mechanism,
    conditions: Sequence[Condition],
    paths: Mapping[str, Sequence[str]],
    start: Mapping[str, float | str],
) -> tuple[Mechanism, tuple[dict[str, float], ...]]:
    """The mechanism with all numbers stated that conditions set or that are looked for, and what each sets, by path.

    MechanismError where a condition sets what is looked for, or what is no number.
    """
    values = (condition.values.items() for condition in conditions)
    settings = [{mechanism.path_of(name): float(value) for name, value in pairs} for pairs in values]
    owners = {path: name for name, members in paths.items() for path in members}
    numbers: dict[str, float | str] = {path: value for row in reversed(settings) for path, value in row.items()}
    numbers |= {path: start.get(name, 0.0) for path, name in owners.items()}
    missing = {path: item for path, item in numbers.items() if path not in mechanism.parameter_set.entries}
    mechanism = mechanism.with_values(missing) if missing else mechanism
    every = mechanism.parameters()
    for condition, row in zip(conditions, settings, strict=True):
        for path in row:
            what = f"the condition {condition.name} sets {path}"
            if path in owners:
                raise MechanismError(Finding(what, f"parameter {owners[path]}", "leave it out of the conditions"))
            if path not in every:
                what += ", but it is no number: it changes with the motion"
                raise MechanismError(Finding(what, path, "set a dimension in it"))
    return mechanism, tuple(settings)


def _measures(mechanism: Mechanism, run: Run, blocks: Sequence[Block]) -> dict[str, Measure]:
    """What each channel measures; MechanismError for what has no course."""
    measures: dict[str, Measure] = {}
    for block in blocks:
        channel, text = block.channel, block.signal.measures
        measure = measure_of(mechanism, run, channel, text)
        refuse_unit(run, measure, channel, block.signal)
        if measures.setdefault(channel, measure).name != measure.name:
            what = f"measures {measures[channel].name} in one condition and {measure.name} in another"
            raise MechanismError(Finding(what, f"channel {channel}", "use separate channels"))
    return measures


def _acted_on(model: Model) -> dict[str, Measure]:
    """The channels that an unknown acts on, as far as the start shows; all if there are none."""
    courses = model.courses(np.array([unknown.start for unknown in model.unknowns]))
    sizes, moved = np.array([unknown.size or 1.0 for unknown in model.unknowns])[:, None], dict[str, Measure]()
    for name, course in (pair for row in courses.said for pair in row.items()):
        most = float(np.nanmax(np.abs(course.value), initial=0.0)) or 1.0
        if np.nanmax(np.abs(np.nan_to_num(course.slope)) * sizes, initial=0.0) > NOTHING * most:
            moved[name] = model.measures[name]
    return {name: measure for name, measure in model.measures.items() if name in moved} or dict(model.measures)


# ---- the search -----------------------------------------------------------------------------------------------


def _runnable(fit: Fit) -> Array:
    """The start, with less friction where that locks. MechanismError if no position can be used."""
    rubs = [p for p, unknown in enumerate(fit.model.unknowns) if any(".friction." in path for path in unknown.paths)]
    starts, lost = [fit.start], list[int]()
    for k in range(HALVINGS + 1):
        lost.append(sum(int(np.sum(codes >= Status.NOT_CONVERGED)) for codes in fit.courses(starts[-1]).status))
        if not (lost[-1] and rubs):
            break
        starts.append(fit.start.copy())
        starts[-1][rubs] = np.maximum(fit.start[rubs] * 0.5 ** (k + 1), fit.bounds[0][rubs])
    best = starts[int(np.argmin(lost))]
    masks = replace(fit, variances=fit.first_scatter()).allowed(best)
    if not any(np.any(masks[k]) for k in fit.fitted):
        codes = np.concatenate([np.asarray(status) for status in fit.courses(best).status])
        what = "no position can be used: no channel has a value there, friction reverses beside it, or the model has "
        what += f"no sound answer (most often {list(Status)[int(np.bincount(codes).argmax())].text})"
        remedy = "see the gaps with `trunnion data`; give a smaller guard, or start values with which the model runs"
        raise MechanismError(Finding(what, "data", remedy))
    return best
