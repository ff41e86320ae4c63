"""An identification as a Dataset."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trunnion.cycle.summary import inputs, references
from trunnion.results.attributes import finding_rows, origin
from trunnion.results.dataset import Variable, dataset_of, described
from trunnion.results.tables.identification import CURVES
from trunnion.rig.comparison import data_findings, hashed_files
from trunnion.rig.identification.findings import findings_of
from trunnion.rig.identification.identified import Identified
from trunnion.rig.identification.uncertainty import CONFIDENCE

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["VARIABLES", "dataset"]

Array = NDArray[Any]
SOURCES = (
    "G. A. F. Seber, C. J. Wild, Nonlinear Regression, Wiley, 1989, doi:10.1002/0471725315",
    "JCGM 100:2008, Evaluation of measurement data: Guide to the expression of uncertainty in measurement",
)


def dataset(found: Identified) -> xr.Dataset:
    """Estimates with all that is said of them."""
    problem, measurement = found.problem, found.measurement
    unknowns = problem.model.unknowns
    names = [one.name for one in unknowns]
    rows = _parameters(found) | _sensors(found) | _blocks(found)
    labels = {
        "parameter": names,
        "parameter_2": names,
        "source": found.budget[0],
        "sensor": [one.name for one in problem.sensors],
        "channel": list(problem.model.measures),
        "condition": [one.name for one in measurement.conditions],
    }
    variables = described({name: rows[name] for name in VARIABLES}, VARIABLES)
    system = problem.model.run.system
    attributes = {
        "name": found.mechanism.name,  # ahead of `identified`, as it always was
        "identified": measurement.name,
        **origin(found.mechanism, system.plan.formula),
        "confidence": CONFIDENCE,
        "parameter_paths": [one.paths for one in unknowns],
        "parameter_units": [one.unit for one in unknowns],
        "channel_units": [one.unit(system) for one in problem.model.measures.values()],
        "channel_measures": [one.name for one in problem.model.measures.values()],
        "drive": _drive(found),
        "drive_range": _driven(found),
        "files": [list(one.files) for one in measurement.conditions],
        "data_files": hashed_files(measurement.conditions),
        "data_findings": data_findings(measurement),
        "done": list(measurement.done),
        "inputs": inputs(found.mechanism),
        "evaluations": problem.evaluations,
        "starts": found.search.starts,
        "converged": int(found.search.fit.converged),
        "references": "\n".join([*SOURCES, *references(found.mechanism)]),
        "findings": finding_rows(findings_of(found)),
    }
    return dataset_of("identification", variables, labels, attributes)


def _drive(found: Identified) -> str:
    """The first driver, if its turns name the positions."""
    return next(iter(found.mechanism.drivers), "")


def _driven(found: Identified) -> list[list[float] | None]:
    """Angles of the first driver where the cycle begins and ends, rad, by condition; None if they name no position."""
    model = found.problem.model
    ends = (model.driven(k, found.told) for k in range(len(model.phases)))
    return [[first, last] if np.isfinite([first, last]).all() else None for first, last, _ in ends]


VARIABLES = {
    "start": Variable(("parameter",), "of the parameter", "start of the search"),
    "estimate": Variable(("parameter",), "of the parameter", "estimate; NaN if not identifiable"),
    "standard_uncertainty": Variable(("parameter",), "of the parameter", "standard uncertainty of the estimate"),
    "lower": Variable(("parameter",), "of the parameter", "lower end of the 95 % interval"),
    "upper": Variable(("parameter",), "of the parameter", "upper end of the 95 % interval"),
    "degrees_of_freedom": Variable(("parameter",), "1", "effective degrees of freedom of the standard uncertainty"),
    "limit": Variable(("parameter",), "1", "−1 on the lower limit, 1 on the upper: the interval is one-sided"),
    "told": Variable(("parameter",), "1", "1 if identifiable, 0 if not"),
    "correlation": Variable(("parameter", "parameter_2"), "1", "correlation of the estimates"),
    "share": Variable(("parameter", "source"), "1", "share of a source in the variance of an estimate"),
    "singular_value": Variable(
        ("parameter",), "1", "singular value of the derivatives with columns scaled to 1, the largest first"
    ),
    "sensor_error": Variable(("sensor",), "1", "estimated error of a sensor, in its standard uncertainties"),
    "sensor_size": Variable(("sensor",), "of the sensor", "its standard uncertainty as stated; NaN if it differs"),
    "sensor_uncertainty": Variable(("sensor",), "1", "standard uncertainty of that, in those stated"),
    "rms_before": Variable(("channel", "condition"), "of the channel", "root mean square of the residual at the start"),
    "rms_after": Variable(
        ("channel", "condition"), "of the channel", "root mean square of the residual with the estimates"
    ),
    "rms_expected": Variable(
        ("channel", "condition"), "of the channel", "its expected value from the scatter between turns"
    ),
    "used": Variable(("channel", "condition"), "1", "positions used"),
    "left_out": Variable(("channel", "condition"), "1", "positions with data that are not used"),
    "turns": Variable(("channel", "condition"), "1", "turns used"),
    "held_out_turns": Variable(("channel", "condition"), "1", "held-out turns"),
    "held_out_before": Variable(
        ("channel", "condition"),
        "of the channel",
        "root mean square of the residual of the held-out data, at the start values",
    ),
    "held_out_after": Variable(("channel", "condition"), "of the channel", "the same with the estimates"),
    "held_out_expected": Variable(
        ("channel", "condition"),
        "of the channel",
        "its expected value from the scatter and the uncertainty of the prediction",
    ),
    "reduced_chi_squared": Variable((), "1", "χ² of the residuals relative to the scatter between turns"),
    "chi_squared_freedom": Variable((), "1", "degrees of freedom of that χ²"),
    "chi_squared_chance": Variable((), "1", "chance of a larger one if the model is right"),
    "turn_correlation": Variable((), "1", "correlation of the contributions of successive turns"),
    "hold_out_ratio": Variable((), "1", "residuals of the held-out data over their expected value"),
    "phase": Variable(("condition", "position"), "1", "share of the cycle"),
    "measured": Variable(("channel", "condition", "position"), "of the channel", "mean over the turns"),
    "residual_before": Variable(
        ("channel", "condition", "position"), "of the channel", "measured minus model, at the start"
    ),
    "residual_after": Variable(
        ("channel", "condition", "position"),
        "of the channel",
        "measured value minus predicted reading of the sensor",
    ),
    "residual_uncertainty": Variable(
        ("channel", "condition", "position"), "of the channel", "standard uncertainty of the mean over the turns"
    ),
}


def _parameters(found: Identified) -> dict[str, Array]:
    n = found.problem.count
    low, high = found.interval
    return {
        "start": found.start[:n],
        "estimate": found.estimate,
        "standard_uncertainty": found.deviation[:n],
        "lower": low,
        "upper": high,
        "degrees_of_freedom": found.spread.freedom[:n],
        "limit": found.limit,
        "told": (~found.lost[:n]).astype(np.int8),
        "correlation": found.correlation,
        "share": found.budget[1],
        "singular_value": found.singular_values,
        "reduced_chi_squared": np.asarray(found.spread.test.reduced),
        "chi_squared_freedom": np.asarray(found.spread.test.freedom),
        "chi_squared_chance": np.asarray(found.spread.test.chance),
        "turn_correlation": np.asarray(found.spread.follows),
        "hold_out_ratio": np.asarray(found.trust),
    }


def _sensors(found: Identified) -> dict[str, Array]:
    n = found.problem.count
    lost = found.lost[n:]
    return {
        "sensor_error": np.where(lost, np.nan, found.x[n:]),
        "sensor_uncertainty": found.deviation[n:],
        "sensor_size": np.array([_size(one.sizes) for one in found.problem.sensors]),
    }


def _size(sizes: Sequence[float]) -> float:
    """The standard uncertainty of an error where it is one in all blocks that have it."""
    known = {one for one in sizes if one}
    return known.pop() if len(known) == 1 else float("nan")


def _blocks(found: Identified) -> dict[str, Array]:
    problem = found.problem
    channels = list(problem.model.measures)
    shape = len(channels), len(found.measurement.conditions)
    longest = max(len(one.phase) for one in found.measurement.conditions)
    figures = {key: np.full(shape, np.nan) for key in FIGURES}
    counts = {key: np.zeros(shape, np.int32) for key in COUNTS}
    curves = {key: np.full((*shape, longest), np.nan) for key in CURVES}
    phase = np.full((shape[1], longest), np.nan)
    for i, condition in enumerate(found.measurement.conditions):
        phase[i, : len(condition.phase)] = condition.phase

    def place(k: int) -> tuple[int, int]:
        return channels.index(problem.blocks[k].channel), problem.blocks[k].condition

    for one in found.misses:
        at, block = place(one.block), problem.blocks[one.block]
        for key, value in zip(FIGURES[:3], (one.before, one.after, one.expected), strict=True):
            figures[key][at] = value
        for key, number in zip(COUNTS[:3], (one.used, one.out, len(block.turns)), strict=True):
            counts[key][at] = number
        for key, row in zip(CURVES, (block.mean, *one.curves), strict=True):
            curves[key][at][: len(row)] = row
    for held in found.held_out:
        at = place(held.block)
        counts["held_out_turns"][at] = held.turns
        for key, value in zip(FIGURES[3:], (held.before, held.after, held.expected), strict=True):
            figures[key][at] = value
    return {
        **figures,
        **counts,
        "phase": phase,
        **curves,
    }


FIGURES = ("rms_before", "rms_after", "rms_expected", "held_out_before", "held_out_after", "held_out_expected")
COUNTS = ("used", "left_out", "turns", "held_out_turns")
