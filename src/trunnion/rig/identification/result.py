"""An identification as a Dataset, and its estimates as numbers of the model."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trunnion.cycle.summary import inputs, references
from trunnion.model.expression import LITERAL
from trunnion.model.mechanism import Mechanism
from trunnion.model.units import UnitError, normalise, unit
from trunnion.results.attributes import attribute, finding_rows, origin
from trunnion.results.dataset import dataset_of, described
from trunnion.rig.comparison import data_findings, hashed_files
from trunnion.rig.identification.findings import findings_of
from trunnion.rig.identification.identified import VARIABLES, Identified
from trunnion.rig.identification.number_text import decimals
from trunnion.rig.identification.uncertainty import CONFIDENCE

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["dataset", "with_estimates"]

Array = NDArray[Any]
USUAL = {"rad": "deg", "m": "mm"}  # units of numbers that the model states without one
SOURCES = (
    "G. A. F. Seber, C. J. Wild, Nonlinear Regression, Wiley, 1989, doi:10.1002/0471725315",
    "JCGM 100:2008, Evaluation of measurement data: Guide to the expression of uncertainty in measurement",
)


def dataset(identified: Identified) -> xr.Dataset:
    """Estimates with their uncertainty, residuals and findings."""
    fit, measurement, mechanism = identified.fit, identified.measurement, identified.mechanism
    model, conditions = fit.model, measurement.conditions
    names, system = [one.name for one in model.unknowns], model.run.system
    arrays = _parameters(identified) | identified.by_block
    labels = {
        "parameter": names,
        "parameter_2": names,
        "source": list(identified.spread.parts),
        "sensor": [one.name for one in fit.sensors],
        "channel": list(model.measures),
        "condition": [one.name for one in conditions],
    }
    ends = (model.driven(k, identified.values)[:2] for k in range(len(conditions)))
    attributes = {
        "name": mechanism.name,  # ahead of `identified`, as it always was
        "identified": measurement.name,
        **origin(mechanism, system.plan.formula),
        "confidence": CONFIDENCE,
        "parameter_paths": [one.paths for one in model.unknowns],
        "parameter_units": [one.unit for one in model.unknowns],
        "channel_units": [one.unit(system) for one in model.measures.values()],
        "channel_measures": [one.name for one in model.measures.values()],
        "drive": next(iter(mechanism.drivers), ""),
        # angles of the first driver where the cycle begins and ends, rad; None if they name no position
        "drive_range": [list(pair) if np.isfinite(pair).all() else None for pair in ends],
        "files": [list(one.files) for one in conditions],
        "data_files": hashed_files(conditions),
        "data_findings": data_findings(measurement),
        "done": list(measurement.done),
        "inputs": inputs(mechanism),
        "evaluations": fit.courses_at.count,
        "starts": identified.starts,
        "converged": int(identified.solution.converged),
        "references": "\n".join([*SOURCES, *references(mechanism)]),
        "findings": finding_rows(findings_of(identified)),
    }
    variables = described({name: arrays[name] for name in VARIABLES}, VARIABLES)
    return dataset_of("identification", variables, labels, attributes)


def _parameters(identified: Identified) -> dict[str, Array]:
    """What belongs to unknowns and sensors, and to the fit."""
    fit, spread, n, lost = identified.fit, identified.spread, identified.fit.count, identified.lost
    u, (lower, upper) = identified.deviation, identified.interval
    variances = np.array([np.diagonal(part)[:n] for part in spread.parts.values()]).T
    rows = fit.jacobian(identified.x)[:, :n]
    size = np.linalg.norm(rows, axis=0)
    singular = np.linalg.svd(rows / np.where(size > 0, size, 1.0), compute_uv=False)
    sizes = [{abs(one.angle)} if one.angle else {size for size in one.sizes if size} for one in fit.sensors]
    with np.errstate(all="ignore"):
        correlation = np.clip(spread.covariance[:n, :n] / np.outer(u[:n], u[:n]), -1.0, 1.0)
        share = variances / np.sum(variances, axis=1, keepdims=True)
    return {
        "start": fit.start[:n],
        "estimate": identified.estimate,
        "standard_uncertainty": u[:n],
        "lower": lower,
        "upper": upper,
        "degrees_of_freedom": spread.freedom[:n],
        "limit": identified.limit,
        "told": (~lost[:n]).astype(np.int8),
        "correlation": correlation,
        "share": np.where(lost[:n, None], np.nan, share),
        "singular_value": np.append(singular, np.zeros(n - len(singular))),  # fewer data than unknowns
        "sensor_error": np.where(lost[n:], np.nan, identified.x[n:]),
        "sensor_uncertainty": u[n:],
        "sensor_size": np.array([one.pop() if len(one) == 1 else np.nan for one in sizes]),
        "reduced_chi_squared": np.asarray(spread.test.reduced),
        "chi_squared_freedom": np.asarray(spread.test.freedom),
        "chi_squared_chance": np.asarray(spread.test.chance),
        "turn_correlation": np.asarray(spread.follows),
        "hold_out_ratio": np.asarray(identified.hold_out_ratio),
    }


# ---- estimates in the model -----------------------------------------------------------------------------------


def with_estimates(mechanism: Mechanism, result: xr.Dataset) -> Mechanism:
    """Put the estimates of a result into the mechanism, rounded to two digits of their standard uncertainty.

    Parameters
    ----------
    mechanism : the model that was identified.
    result : of `identify`.

    Returns
    -------
    The mechanism with the estimates, in the units that were written there; what was not told apart stays as it is.
    """
    values: dict[str, float | str] = {}
    units = attribute(result, "parameter_units")
    for p, paths in enumerate(attribute(result, "parameter_paths")):
        estimate, u = (float(result[name].values[p]) for name in ("estimate", "standard_uncertainty"))
        if math.isfinite(estimate):
            values |= {path: _text(mechanism, path, estimate, u, units[p]) for path in paths}
    return mechanism.with_values(values)


def _text(mechanism: Mechanism, path: str, value: float, u: float, si: str) -> float | str:
    """A number in the unit that is written at its path, with the digits that it has."""
    entry = mechanism.parameter_set.entries.get(path)
    source = entry.quantity.source if entry else ""
    literal = (
        LITERAL.fullmatch(normalise(source).strip().removeprefix("-").strip()) if isinstance(source, str) else None
    )
    written = (literal["unit"] if literal else "") or USUAL.get(si, "" if si == "1" else si)
    try:
        factor = float(unit(written)[0]) if written else 1.0
    except UnitError:
        written, factor = "", 1.0
    places = decimals(u / factor) if u > 0 else 6
    number = f"{round(value / factor, places):.{max(places, 0)}f}" if places < 12 else f"{value / factor:.6g}"
    return f"{number} {written}" if written else float(number)
