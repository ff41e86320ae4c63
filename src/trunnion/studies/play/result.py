"""The Dataset of `play`: names, units, summary and provenance."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.cycle.scales import scales_of
from trunnion.cycle.summary import inputs, references
from trunnion.errors import Finding
from trunnion.measures.measures import Measure
from trunnion.results.attributes import cited, finding_rows, origin
from trunnion.results.dataset import MemberUnits, Variable, dataset_of, described, driven
from trunnion.results.figure import Figure
from trunnion.solve.shifts import Play

if TYPE_CHECKING:
    import xarray as xr

    from trunnion.solve.run import Run

__all__ = ["EXTREMES", "VARIABLES", "dataset"]

Array = NDArray[np.float64]


EXTREMES = ("maximum", "minimum", "largest")  # statistics that are of one place
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
        "worst case at the place of a measure: a stated one, that of its maximum or minimum, else of the largest total",
    ),
    "extreme_deviation": Variable(("measure", "joint"), "measure", "standard deviation at that place"),
    "extreme_time": Variable(("measure",), "s", "time of that place"),
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
    def there(self) -> Mapping[str, PlayEffects]: ...


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
        **_at_places(found),
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
        "places": [_place_of(found, measure) for measure in found.measures],
        **scales.summary(_summary(found, units)),
        "findings": finding_rows(findings),
        "missed": [f"{one.where}: {one.what}" for one in findings if one.code == "limit.exceeded"],
    }
    return dataset_of("play", variables, labels, attributes, driven(found.time, *dial))


def _place_of(found: PlayEffects, measure: Measure) -> list[str]:
    """What the place of a measure is, and where in the cycle it is, for tables."""
    there = found.there[measure.name]
    stated = measure.at is not None or len(found.time) == 1
    kind = "" if stated else f"the {measure.rule}" if measure.rule in EXTREMES else "largest"
    return [kind, found.run.system.dial(found.run.values, there.time).at(0)]


def _at_places(found: PlayEffects) -> dict[str, Array]:
    """What is at the place of each measure."""
    theres = [found.there[measure.name] for measure in found.measures]
    worst, deviation = (np.array([part[0, :, 0] for part in parts]) for parts in (
        [one.worst_case for one in theres], [one.deviation for one in theres],
    ))  # fmt: skip
    time = np.array([one.time[0] for one in theres])
    return {"extreme_worst_case": worst, "extreme_deviation": deviation, "extreme_time": time}


def _radii(plays: Mapping[str, Play], ends: int) -> Array:
    found = np.full((len(plays), ends), np.nan)
    for row, play in zip(found, plays.values(), strict=True):
        for k, radius in enumerate(play.radii):
            row[k] = float(np.ravel(primal(radius))[0])
    return found


def _summary(found: PlayEffects, units: Sequence[str]) -> Iterator[Figure]:
    """Of each measure the worst case at its place: what each joint has in it, RSS and deviation."""
    for measure, unit in zip(found.measures, units, strict=True):
        name, there = measure.name, found.there[measure.name]
        kind, at = _place_of(found, measure)
        total = float(there.total[0, 0])
        if not np.isfinite(total):
            yield Figure(f"{name}.worst_case", f"{name}, worst case to first order", None, unit)
            continue
        aspect = "maximum" if kind == "largest" else f"of {kind}" if kind else ""
        yield Figure(f"{name}.worst_case", f"{name}, worst case to first order", total, unit, aspect, f"at {at}")
        rss, deviation = (np.sqrt(np.sum(part[0, :, 0] ** 2)) for part in (there.worst_case, there.deviation))
        yield Figure(f"{name}.rss", f"{name}, RSS there", rss, unit)
        yield Figure(f"{name}.deviation", f"{name}, standard deviation there", deviation, unit)
        for j, joint in enumerate(found.plays):
            yield Figure(f"{name}.{joint}.worst_case", f"{name}, of which {joint}", there.worst_case[0, j, 0], unit)
