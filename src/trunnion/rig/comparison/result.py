"""The Dataset of `compare`: names, units, what was set, provenance."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trunnion.cycle.summary import PEZZUTI, inputs, references
from trunnion.errors import Status
from trunnion.model.expression import LITERAL
from trunnion.model.mechanism import Mechanism
from trunnion.model.units import unit as unit_of
from trunnion.results.attributes import cited, codes, finding_rows, origin
from trunnion.results.dataset import Variable, dataset_of, described
from trunnion.rig.comparison.assessment import Verdict, difference, expanded, probability, uncertainty_of
from trunnion.rig.comparison.causes import KINDS, Cause
from trunnion.rig.comparison.comparison import ChannelComparison, Compared
from trunnion.rig.comparison.findings import findings_of
from trunnion.rig.reading.log import gathered
from trunnion.rig.reading.measurement import Condition, Measurement
from trunnion.solve.friction_method import FrictionMethod

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["VARIABLES", "data_findings", "dataset", "hashed_files"]

Array = NDArray[Any]
GUM = "JCGM 100:2008, Evaluation of measurement data - Guide to the expression of uncertainty in measurement (GUM)"


# unit empty: that of each channel, in the attribute `channel_units`; "set": of what is set, in `set_units`; "drive":
# rad, m or s, as `drive_unit` says
CC, C = ("channel", "condition"), ("condition",)
COURSE = (*CC, "position")
VARIABLES: dict[str, Variable] = {
    "value": Variable(
        ("set", "condition"), "set", "number of the model that was set in the condition; NaN if it was not"
    ),
    "phase": Variable(("condition", "position"), "1", "share of the cycle from its start"),
    "drive": Variable(("condition", "position"), "drive", "coordinate of the first driver, or time"),
    "status": Variable(
        ("condition", "position"), "1", "code of the model's status; see the attribute flag_meanings", np.int8
    ),
    "measured": Variable(COURSE, "", "mean over the turns"),
    "scatter": Variable(COURSE, "", "standard deviation between turns"),
    "uncertainty": Variable(COURSE, "", "standard uncertainty of the mean: scatter, zero, gain"),
    "expanded": Variable(COURSE, "", "expanded uncertainty U of the mean"),
    "model": Variable(COURSE, "", "the model with the values of the condition"),
    "residual": Variable(COURSE, "", "measured minus model"),
    "compared": Variable(COURSE, "1", "1 where the position counts in the figures of the channel", np.int8),
    "turns": Variable(CC, "1", "turns that were measured", np.int32),
    "accuracy_zero": Variable(CC, "", "standard uncertainty of the zero"),
    "accuracy_gain": Variable(CC, "1", "standard uncertainty of the gain, relative"),
    "rms": Variable(CC, "", "root mean square of the residual"),
    "largest": Variable(CC, "", "residual of the largest size"),
    "largest_at": Variable(CC, "drive", "where the largest residual is"),
    "bias": Variable(CC, "", "mean residual"),
    "bias_expanded": Variable(CC, "", "expanded uncertainty of the bias"),
    "rms_unbiased": Variable(CC, "", "root mean square of the residual less the bias"),
    "within": Variable(CC, "1", "share of the positions within ±U"),
    "within_least": Variable(CC, "1", "least share of agreeing positions for agreement of the signal"),
    "correlation": Variable(CC, "1", "correlation of measured and model over the positions"),
    "verdict": Variable(CC, "1", "code of the verdict; see the attribute verdict_meanings", np.int8),
    "zero_error": Variable(CC, "", "error of the zero that fits the residual best"),
    "zero_explains": Variable(CC, "1", "share of the mean square of the residual that it explains"),
    "gain_error": Variable(CC, "1", "relative error of the gain that fits the residual best"),
    "gain_explains": Variable(CC, "1", "share of the mean square of the residual that it explains"),
    "angle_error": Variable(CC, "rad", "angle by which the readings would be ahead of the model"),
    "angle_explains": Variable(CC, "1", "share of the mean square of the residual that it explains"),
    "friction_error": Variable(CC, "1", "change of all friction, relative to the model's, that fits the residual best"),
    "friction_explains": Variable(CC, "1", "share of the mean square of the residual that it explains"),
    "efficiency": Variable(C, "1", "measured efficiency"),
    "efficiency_expanded": Variable(C, "1", "expanded uncertainty of the measured efficiency"),
    "efficiency_model": Variable(C, "1", "efficiency of the model"),
    "efficiency_within": Variable(
        C, "1", "1 where the model's efficiency is within ±U, −1 where one is unknown", np.int8
    ),
}
EFFICIENCY = [name for name in VARIABLES if name.startswith("efficiency")]
JUDGED = {"largest": "largest", "rms": "rms", "bias": "bias", "bias_expanded": "bias_expanded", "within": "within",
          "rms_unbiased": "rms_unbiased", "within_least": "least", "correlation": "correlation"}  # fmt: skip


def dataset(
    mechanism: Mechanism,
    measurement: Measurement,
    channels: Mapping[str, str],
    found: Sequence[Compared],
    coverage: float,
    method: FrictionMethod,
) -> xr.Dataset:
    """The numbers with all that is said of them."""
    sets = list(dict.fromkeys(name for one in found for name in one.condition.values))
    positions = max(len(one.condition.phase) for one in found)
    sizes = {"set": len(sets), "condition": len(found), "channel": len(channels), "position": positions}
    arrays = {name: one.blank(sizes) for name, one in VARIABLES.items()}
    arrays["verdict"][:], arrays["efficiency_within"][:] = Verdict.NOTHING, -1
    arrays["status"][:] = Status.NOT_ASSEMBLED  # of positions that a condition with fewer does not have
    for k, one in enumerate(found):
        _fill(arrays, k, one, sets, list(channels), coverage)
    if all(one.efficiency is None for one in found):
        arrays = {name: array for name, array in arrays.items() if name not in EFFICIENCY}
    labels = {"channel": list(channels), "condition": [one.condition.name for one in found], "set": sets}
    attributes = _attributes(mechanism, measurement, channels, found, coverage, method)
    return dataset_of("comparison", described(arrays, VARIABLES), labels, attributes)


def _fill(
    arrays: dict[str, Array], k: int, one: Compared, sets: Sequence[str], channels: Sequence[str], coverage: float
) -> None:
    """The numbers of one condition."""
    count = len(one.condition.phase)
    arrays["value"][:, k] = [one.condition.values.get(name, np.nan) for name in sets]
    arrays["phase"][k, :count] = one.condition.phase
    arrays["drive"][k, :count] = one.model.drive
    arrays["status"][k, :count] = one.model.status
    for i, name in enumerate(channels):
        if name in one.pairs:
            _fill_channel(arrays, (i, k), one, one.pairs[name], coverage)
    if one.efficiency is not None:
        of = one.efficiency
        arrays["efficiency"][k], arrays["efficiency_model"][k] = of.measured, of.model
        arrays["efficiency_expanded"][k] = of.expanded
        arrays["efficiency_within"][k] = int(of.within) if of.known else -1


def _fill_channel(
    arrays: dict[str, Array], at: tuple[int, int], one: Compared, pair: ChannelComparison, coverage: float
) -> None:
    course, judged, count = pair.course, pair.judged, len(one.condition.phase)
    of = uncertainty_of(course)
    there = pair.comparable & np.isfinite(course.mean) & np.isfinite(pair.model)
    rows = {
        "measured": course.mean, "scatter": course.scatter, "uncertainty": of.total,
        "expanded": expanded(of.total, of.freedom, coverage), "model": pair.model,
        "residual": difference(course.mean, pair.model), "compared": there,
    }  # fmt: skip
    for name, row in rows.items():
        arrays[name][(*at, slice(0, count))] = row
    arrays["turns"][at] = len(course.turns)
    arrays["accuracy_zero"][at], arrays["accuracy_gain"][at] = course.accuracy.zero, course.accuracy.gain
    arrays["verdict"][at] = judged.verdict
    if judged.place >= 0:
        arrays["largest_at"][at] = one.model.drive[judged.place]
    for name, field in JUDGED.items():
        arrays[name][at] = getattr(judged, field)
    for kind in KINDS:
        arrays[f"{kind}_error"][at], arrays[f"{kind}_explains"][at] = pair.causes.get(kind, Cause())


def _read_in(name: str, found: Sequence[Compared]) -> tuple[str, float]:
    """The unit of a channel's readings with its factor to SI, where they are what is measured itself."""
    return next((one.pairs[name].course.read_in for one in found if name in one.pairs), ("", 1.0))


def _attributes(
    mechanism: Mechanism,
    measurement: Measurement,
    channels: Mapping[str, str],
    found: Sequence[Compared],
    coverage: float,
    method: FrictionMethod,
) -> dict[str, Any]:
    first = found[0].model
    drivers = list(mechanism.drivers)
    units = {name: next(one.condition.courses[name].unit for one in found if name in one.pairs) for name in channels}
    sets = list(dict.fromkeys(name for one in found for name in one.condition.values))
    written = _units_set(mechanism, sets, [one.condition.name for one in found])
    told = findings_of(mechanism, channels, found)
    origins = origin(
        mechanism,
        first.run.system.plan.formula,
        drive_unit=first.unit,
        drive_name=drivers[0] if drivers and first.unit != "s" else "",
        drive_span=first.span,
        periodic=int(all(one.model.run.cycle.periodic for one in found)),
        all_within=int(_all_within(found)),
        coverage=coverage,
        probability=probability(coverage),
    )
    return {
        "comparing": measurement.name,
        **origins,
        "method": method.name,
        **cited(dict.fromkeys([GUM, PEZZUTI, *references(mechanism)])),
        **codes("verdict", Verdict),
        "channel_units": list(units.values()),
        "channel_read_in": [_read_in(name, found) for name in channels],
        "channel_measures": list(channels.values()),
        **dict(zip(("set_units", "set_written"), written, strict=True)),
        "findings": finding_rows(told),
        "data_findings": data_findings(measurement),
        "done": list(measurement.done),
        "files": hashed_files(one.condition for one in found),
        "condition_files": [list(one.condition.files) for one in found],
        "inputs": inputs(mechanism),
    }


def _units_set(
    mechanism: Mechanism, names: Iterable[str], conditions: Iterable[str]
) -> tuple[list[str], list[tuple[str, float]]]:
    """SI unit of each number that is set, and the unit with its factor that it is read in.

    That of the names of the conditions, such as `input.speed 250 rpm`, else the one that the model states it in.
    """
    known = {row["path"]: row for row in inputs(mechanism)}
    stated = dict(part.partition(" ")[::2] for name in conditions for part in name.split(", "))
    units, written = [], []
    for name in names:
        row = known.get(mechanism.path_of(name), {"unit": "", "text": ""})
        literals = (LITERAL.fullmatch(one.strip().removeprefix("-")) for one in (stated.get(name, ""), row["text"]))
        text = next((one["unit"] or one["per"] or "" for one in literals if one and (one["unit"] or one["per"])), "")
        text = text or {"rad": "deg"}.get(row["unit"], row["unit"])
        units.append(row["unit"])
        written.append((text, float(unit_of(text)[0]) if text and text != "1" else 1.0))
    return units, written


def _all_within(found: Sequence[Compared]) -> bool:
    """Whether every course is within, and every efficiency."""
    courses = all(pair.within for one in found for pair in one.pairs.values())
    return courses and all(one.efficiency.within for one in found if one.efficiency is not None)


def data_findings(measurement: Measurement) -> list[dict[str, Any]]:
    """What was found while the data were read, with the file."""
    told = gathered(measurement.findings)
    return [{**row, "file": one.file} for row, one in zip(finding_rows(told), told, strict=True)]


def hashed_files(conditions: Iterable[Condition]) -> list[dict[str, Any]]:
    """Name, size and SHA-256 of every file of the data; without the last two where it is not at hand."""
    rows = []
    for name in dict.fromkeys(name for one in conditions for name in one.files):
        path = Path(name)
        row: dict[str, Any] = {"file": path.name, "bytes": None, "sha256": ""}
        if path.is_file():
            with path.open("rb") as file:
                row |= {"bytes": path.stat().st_size, "sha256": hashlib.file_digest(file, "sha256").hexdigest()}
        rows.append(row)
    return rows
