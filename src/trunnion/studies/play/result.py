"""The Dataset of `play`: names, units, summary and provenance."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.cycle.scales import scales_of
from trunnion.cycle.summary import inputs, references
from trunnion.errors import Finding, Status
from trunnion.measures.measures import Measure
from trunnion.results.attributes import cited, finding_rows, origin
from trunnion.results.dataset import MemberUnits, Variable, dataset_of, described, driven
from trunnion.results.figure import Figure
from trunnion.results.scales import Scales, extreme_place
from trunnion.solve.shifts import Play

if TYPE_CHECKING:
    import xarray as xr

    from trunnion.solve.run import Run

__all__ = ["VARIABLES", "dataset", "relied_on"]

Array = NDArray[np.float64]


# unit "measure": that of each measure; "sensitivity": that over m
OVER = ("measure", "position")
BY_JOINT = ("measure", "joint", "position")
VARIABLES: dict[str, Variable] = {
    "value": Variable(OVER, "measure", "the measure with every pin in the middle of its hole"),
    "worst_case": Variable(BY_JOINT, "measure", "largest change that the play of the joint can make, to either side"),
    "deviation": Variable(
        BY_JOINT, "measure", "standard deviation by the play of the joint, pins anywhere in their holes"
    ),
    "worst_case_total": Variable(OVER, "measure", "worst case of all joints to first order: the sum"),
    "rss": Variable(OVER, "measure", "root of the sum of the squares of the joints' worst cases"),
    "deviation_total": Variable(
        OVER, "measure", "standard deviation by the play of all joints, independent of one another"
    ),
    "sensitivity": Variable(
        ("measure", "joint", "end", "axis", "position"),
        "sensitivity",
        "change of the measure for an offset of 1 m at an end, of the link on which the worst case is larger",
    ),
    "radius": Variable(("joint", "end"), "m", "largest displacement of the pin from the middle, at an end"),
    "extreme_worst_case": Variable(
        ("measure", "joint"),
        "measure",
        "worst case of a maximum or minimum, or a stated place, there; NaN of other measures",
    ),
    "extreme_deviation": Variable(
        ("measure", "joint"),
        "measure",
        "standard deviation of a maximum or minimum, or a stated place, there; NaN of other measures",
    ),
    "extreme_time": Variable(
        ("measure",), "s", "time of a maximum or minimum, or a stated place; NaN of other measures"
    ),
    "status": Variable(("position",), "1", "code of the position's status; see the attribute flag_meanings", np.int8),
}


class PlayEffects(Protocol):
    """What the Dataset is made of; see `play.Effect`."""

    @property
    def run(self) -> Run: ...
    @property
    def measures(self) -> Sequence[Measure]: ...
    @property
    def plays(self) -> Mapping[str, Play]: ...
    @property
    def time(self) -> Array: ...
    @property
    def value(self) -> Array: ...
    @property
    def worst_case(self) -> Array: ...
    @property
    def deviation(self) -> Array: ...
    @property
    def total(self) -> Array: ...
    @property
    def sensitivity(self) -> Array: ...
    @property
    def status(self) -> NDArray[np.int8]: ...
    @property
    def extremes(self) -> Mapping[str, PlayEffects]: ...


def dataset(found: PlayEffects, findings: Sequence[Finding]) -> xr.Dataset:
    """The arrays with all that is said of them."""
    system, mechanism = found.run.system, found.run.system.mechanism
    sensitivity = found.sensitivity
    ends = sensitivity.shape[2]
    arrays: dict[str, Array | NDArray[np.int8]] = {
        "value": found.value,
        "worst_case": found.worst_case,
        "deviation": found.deviation,
        "worst_case_total": found.total,
        "rss": np.sqrt(np.sum(found.worst_case**2, axis=1)),
        "deviation_total": np.sqrt(np.sum(found.deviation**2, axis=1)),
        "sensitivity": sensitivity,
        "radius": _radii(found.plays, ends),
        "status": found.status,
        **_at_extremes(found),
    }
    units = [measure.unit(system) for measure in found.measures]
    own = MemberUnits("measure", units)
    per_length = MemberUnits("measure", [f"{unit}/m" for unit in units])
    variables = described(arrays, VARIABLES, {"measure": own, "sensitivity": per_length})
    labels = {
        "measure": [measure.name for measure in found.measures],
        "joint": list(found.plays),
        "end": [str(k + 1) for k in range(ends)],
        "axis": ["x", "y", "z"],
    }
    dial, scales = system.dial(found.run.values, found.time), scales_of(found.run)
    attributes = {
        **origin(mechanism, system.plan.formula),
        **cited(references(mechanism)),
        "limits": [measure.limit for measure in found.measures],
        "inputs": inputs(mechanism),
        "drive": dial.of,
        "drive_unit": dial.unit.strip(),
        "periodic": int(found.run.cycle.periodic),
        "extremes": [_extreme_of(found, measure) for measure in found.measures],
        **scales.summary(_summary(found, units, scales)),
        "findings": finding_rows(findings),
        "missed": [f"{one.where}: {one.what}" for one in findings if one.code.startswith("limit.exceeded")],
    }
    return dataset_of("play", variables, labels, attributes, driven(found.time, *dial))


def _extreme_of(found: PlayEffects, measure: Measure) -> list[str]:
    """The word for a measure's extreme, or "value", and where in the cycle it is, for tables; empty of other ones."""
    there = found.extremes.get(measure.name)
    return [] if there is None else [measure.rule, found.run.system.dial(found.run.values, there.time).at(0)]


def _at_extremes(found: PlayEffects) -> dict[str, Array]:
    """What is at the places of extremes, or stated, NaN of other measures."""
    names, count = [measure.name for measure in found.measures], len(found.plays)
    worst, deviation = (np.full((len(names), count), np.nan) for _ in range(2))
    time = np.full(len(names), np.nan)
    for i, name in enumerate(names):
        if name in found.extremes:
            there = found.extremes[name]
            worst[i], deviation[i], time[i] = there.worst_case[0, :, 0], there.deviation[0, :, 0], there.time[0]
    return {"extreme_worst_case": worst, "extreme_deviation": deviation, "extreme_time": time}


def relied_on(numbers: Array, status: NDArray[np.int8]) -> Array:
    """The numbers, (…, position), NaN close to dead centres, where first order says little; all if all are close."""
    near = status >= Status.NEAR_SINGULAR
    return numbers if np.all(near) else np.where(near, np.nan, numbers)


def _radii(plays: Mapping[str, Play], ends: int) -> Array:
    found = np.full((len(plays), ends), np.nan)
    for row, play in zip(found, plays.values(), strict=True):
        for k, radius in enumerate(play.radii):
            row[k] = float(np.ravel(primal(radius))[0])
    return found


def _summary(found: PlayEffects, units: Sequence[str], scales: Scales) -> Iterator[Figure]:
    """Of each measure the largest worst case, or that of its extreme: what each joint has in it, RSS and deviation."""
    for i, (measure, unit) in enumerate(zip(found.measures, units, strict=True)):
        name, there = measure.name, found.extremes.get(measure.name)
        own, k = (found, i) if there is None else (there, 0)
        of = found.run.system.dial(found.run.values, own.time)
        total = relied_on(own.total[k], own.status)
        worst = f"{name}.worst_case", f"{name}, worst case to first order"
        if not np.any(np.isfinite(total)):
            yield Figure(*worst, None, unit)
            continue
        top = int(np.nanargmax(total))
        aspect = "maximum" if there is None else f"of the {measure.rule}" if measure.at is None else ""
        yield Figure(*worst, total[top], unit, aspect, extreme_place(total, f"at {of.at(top)}", scales.floor(unit)))
        rss, deviation = (np.sqrt(np.sum(part[k, :, top] ** 2)) for part in (own.worst_case, own.deviation))
        yield Figure(f"{name}.rss", f"{name}, RSS there", rss, unit)
        yield Figure(f"{name}.deviation", f"{name}, standard deviation there", deviation, unit)
        for j, joint in enumerate(found.plays):
            yield Figure(f"{name}.{joint}.worst_case", f"{name}, of which {joint}", own.worst_case[k, j, top], unit)
