"""A model beside a measurement: residual and verdict of every channel in every working condition, and the efficiency.

The model is run with the values of each condition and taken at the positions of the measurement. It has no uncertainty
of its own here: what its numbers are uncertain by is not in the verdict.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError, Status
from trunnion.model.arguments import strict_arguments
from trunnion.model.mechanism import Mechanism
from trunnion.model.names import nearest
from trunnion.rig.comparison.assessment import Verdict, difference, judge
from trunnion.rig.comparison.causes import causes
from trunnion.rig.comparison.comparison import ChannelComparison, Compared, Efficient
from trunnion.rig.comparison.result import dataset
from trunnion.rig.modelled import Modelled, check_settings, modelled
from trunnion.rig.reading.efficiency import Pairs, efficiency_of, load_joints, pairs_of
from trunnion.rig.reading.measurement import Condition, Measurement
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.loads import useful_loads, useful_springs

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["compare"]

Array = NDArray[np.float64]


@strict_arguments
@np.errstate(all="ignore")  # of numbers near the end of the floats: what has no value is NaN, and its status says so
def compare(
    mechanism: Mechanism,
    measurement: Measurement,
    channels: Sequence[str] | None = None,
    coverage: float = 2.0,
    *,
    friction_method: FrictionMethod | None = None,
    progress: Callable[[int], None] | None = None,
) -> xr.Dataset:
    """The model beside a measurement, condition by condition and channel by channel.

    channels: some of the measurement's by name; all that measure something if not given. coverage: factor k of the
    expanded uncertainty U = k u where turns are many (`judge.expanded`). progress: called with the conditions done.
    friction_method: how friction and reactions are settled; Newton's method if not given.
    Returns a Dataset over (channel, condition, position) of `compared.VARIABLES`, SI, residual = measured − model;
    NaN where the model has no answer or nothing was measured.
    Method: at each position the model with the condition's values; U by the GUM from the scatter between turns, the
    zero and the gain of the sensor. Where a course is not within U, the size of an error of the zero, the gain, the
    crank angle and the friction is fitted to the residual, each by itself, with the share that it explains.
    Raises MechanismError for values, channels or measures that the model does not have.
    """
    if not (np.isfinite(coverage) and 0 < coverage <= 8):
        raise MechanismError(Finding(f"{coverage:g} is no coverage factor", "coverage", "give such as 2, up to 8"))
    wanted = _channels(measurement, channels)
    check_settings(mechanism, measurement)
    method, joints = friction_method or FrictionMethod(), load_joints(mechanism)
    found: list[Compared] = []
    for done, condition in enumerate(measurement.conditions, 1):
        there = {name: what for name, what in wanted.items() if name in condition.courses}
        powers = pairs_of(condition, joints)
        also = _of_powers(powers) if powers else {}
        model = modelled(mechanism, condition, there, method, also)
        without = _Frictionless(mechanism, condition, there, method)
        pairs = {name: _pair(condition, model, name, coverage, without) for name in there}
        missing = _unmeasured(mechanism, condition) if powers else ()
        whole = powers is not None and not missing and also.keys() <= model.courses.keys()
        efficiency = _efficiency(condition, model, joints, coverage) if whole else None
        found.append(Compared(condition, model, pairs, efficiency, missing))
        if progress:
            progress(done)
    return dataset(mechanism, measurement, wanted, found, coverage, method)


def _of_powers(powers: Pairs) -> dict[str, str]:
    """What the channels that tell powers measure, by name."""
    return {one.channel: one.measures for pair in (*powers.driven, *powers.loaded) for one in pair}


def _channels(measurement: Measurement, wanted: Sequence[str] | None) -> dict[str, str]:
    """What each channel measures, by name; MechanismError if there is none, or not one that is wanted."""
    known: dict[str, str] = {}
    for condition in measurement.conditions:
        for name, course in condition.courses.items():
            if course.measures:
                known.setdefault(name, course.measures)
    missing = [name for name in wanted or () if name not in known]
    if missing:
        raise MechanismError(
            [Finding(f"there is no channel '{name}'", "--channel", nearest(name, known)) for name in missing]
        )
    if not known:
        what = "no channel measures anything of the model" if measurement.conditions else "there is no condition in it"
        raise MechanismError(
            Finding(what, measurement.name, "state measures: effort:DRIVER of a channel in the mapping")
        )
    return known if wanted is None else {name: known[name] for name in dict.fromkeys(wanted)}


@dataclass
class _Frictionless:
    """The model of a condition without its friction, analysed where a channel asks for it."""

    mechanism: Mechanism
    condition: Condition
    channels: Mapping[str, str]
    method: FrictionMethod

    @cached_property
    def courses(self) -> Mapping[str, Array]:
        """By channel; none where the model has no friction, or has no answer without it."""
        stated = self.mechanism.with_values(dict(self.condition.values))
        try:
            free = stated.with_friction("off")
            if free.data() == stated.data():
                return {}
            return modelled(free, replace(self.condition, values={}), self.channels, self.method).courses
        except MechanismError:
            return {}


def _pair(
    condition: Condition, model: Modelled, channel: str, coverage: float, frictionless: _Frictionless
) -> ChannelComparison:
    course, theirs = condition.courses[channel], model.courses[channel]
    comparable = model.comparable(channel)
    pair = ChannelComparison(course, theirs, comparable, judge(course, theirs, comparable, coverage))
    if pair.judged.verdict not in (Verdict.NOT, Verdict.OFFSET):
        return pair
    residual = np.where(comparable, difference(course.mean, theirs), np.nan)
    free = None if model.measures[channel].of_motion else frictionless.courses.get(channel)
    drive = model.drive if model.unit == "rad" else None
    return replace(pair, causes=causes(residual, theirs, course.accuracy.datum, drive, free))


def _unmeasured(mechanism: Mechanism, condition: Condition) -> tuple[str, ...]:
    """Drivers, useful loads and springs that no channel tells the effort of, by their entries in the model."""
    measured = {course.measures for course in condition.courses.values()}
    drivers = (f"drivers.{name}" for name in mechanism.drivers if f"effort:{name}" not in measured)
    loads = (f"loads.{name}" for name in useful_loads(mechanism) if f"load:{name}" not in measured)
    return (*drivers, *loads, *(f"springs.{name}" for name in useful_springs(mechanism)))


VAGUE = 0.5  # expanded uncertainty from which an efficiency is none


def _efficiency(condition: Condition, model: Modelled, joints: Mapping[str, str], coverage: float) -> Efficient | None:
    """Efficiency as a rig computes it: of the measured courses, and of the model's in their place."""
    try:
        measured = efficiency_of(condition, joints)
    except MechanismError as error:  # no turn is whole, or no power goes in
        first = error.findings[0]
        return Efficient(model=_of_model(condition, model, joints), reason=(first.what, first.remedy))
    if measured.turns < 2:
        once = "there is only one turn: the uncertainty cannot be estimated without scatter", "measure more turns"
        return Efficient(measured.value, model=_of_model(condition, model, joints), reason=once)
    wide = measured.factor(coverage) * measured.uncertainty
    wrong = "a sign, a gain, a unit or a column of its channels is wrong", "check their means"
    if wide > VAGUE:
        return Efficient(measured.value, model=_of_model(condition, model, joints),
                         reason=(f"its U of {wide:.3g} is not meaningful: {wrong[0]}", wrong[1]))  # fmt: skip
    if measured.value > 1 + wide:
        return Efficient(measured.value, model=_of_model(condition, model, joints),
                         reason=(f"{measured.value:.4g} is above 1: {wrong[0]}", wrong[1]))  # fmt: skip
    return Efficient(measured.value, wide, _of_model(condition, model, joints))


def _of_model(condition: Condition, model: Modelled, joints: Mapping[str, str]) -> float:
    """The efficiency of the model's courses; NaN where it has no answer at some position."""
    solved = model.status < Status.NOT_CONVERGED
    courses = {  # a load has no torque where its joint rests, and takes no power
        name: replace(condition.courses[name], turns=np.where(solved, np.nan_to_num(course), course)[np.newaxis])
        for name, course in model.courses.items()
    }
    try:
        # its positions are equal steps of time, whatever those of the measurement are
        return efficiency_of(replace(condition, courses=courses, speed=np.nan), joints).value
    except MechanismError:
        return float("nan")
