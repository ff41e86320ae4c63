"""What an identification comes to: intervals, limits, residuals before and after; as a Dataset, and in the model."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trunnion.cycle.summary import inputs, references
from trunnion.errors import Finding, Severity
from trunnion.model.mechanism import Mechanism
from trunnion.results.attributes import attribute, finding_rows, origin
from trunnion.results.dataset import Variable, dataset_of, described
from trunnion.results.quantities import decimals, with_uncertainty
from trunnion.rig.comparison import data_findings, hashed_files, other_speed, written_unit
from trunnion.rig.identification.fit import FAR, Fit, Solution, shared_zero, sizes_of, solved
from trunnion.rig.identification.signals import DriveCycle
from trunnion.rig.identification.uncertainty import CONFIDENCE, Covariances, lack_of_fit, quantile
from trunnion.rig.reading.measurement import Measurement, rms

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["VARIABLES", "Identified", "dataset", "with_estimates"]

Array = NDArray[np.float64]
SOURCES = (
    "G. A. F. Seber, C. J. Wild, Nonlinear Regression, Wiley, 1989, doi:10.1002/0471725315",
    "JCGM 100:2008, Evaluation of measurement data: Guide to the expression of uncertainty in measurement",
)
NEAR_LIMIT = 0.98  # of the most that a stated error may come to
AT_LIMIT = 0.05  # of the standard uncertainty: nearer than this to a limit is on it
MUCH = 3.0  # times what scatter explains, between conditions
POOR = 2.0  # times what is expected, of predictions
UNEXPLAINED = 0.2  # of a misfit: what is left if an error explains it
OFF = 3.0  # standard uncertainties from what was stated of a sensor

PARAMETER, SENSOR, BLOCK = ("parameter",), ("sensor",), ("channel", "condition")
COURSE = (*BLOCK, "position")
VARIABLES = {
    "start": Variable(PARAMETER, "of the parameter", "start of the search"),
    "estimate": Variable(PARAMETER, "of the parameter", "estimate; NaN if not identifiable"),
    "standard_uncertainty": Variable(PARAMETER, "of the parameter", "standard uncertainty of the estimate"),
    "lower": Variable(PARAMETER, "of the parameter", "lower end of the 95 % interval"),
    "upper": Variable(PARAMETER, "of the parameter", "upper end of the 95 % interval"),
    "degrees_of_freedom": Variable(PARAMETER, "1", "effective degrees of freedom of the standard uncertainty"),
    "limit": Variable(PARAMETER, "1", "−1 on the lower limit, 1 on the upper: the interval is one-sided"),
    "told": Variable(PARAMETER, "1", "1 if identifiable, 0 if not, or if the interval is wider than the value itself"),
    "correlation": Variable(("parameter", "parameter_2"), "1", "correlation of the estimates"),
    "share": Variable(("parameter", "source"), "1", "share of a source in the variance of an estimate"),
    "singular_value": Variable(PARAMETER, "1", "singular value of the derivatives, columns scaled to 1; largest first"),
    "sensor_error": Variable(SENSOR, "1", "estimated error of a sensor, in its standard uncertainties"),
    "sensor_size": Variable(
        SENSOR, "of the sensor", "stated standard uncertainty, of the angle rad; NaN if it differs"
    ),
    "sensor_uncertainty": Variable(SENSOR, "1", "standard uncertainty of that, in those stated"),
    "rms_before": Variable(BLOCK, "of the channel", "root mean square of the residual at the start"),
    "rms_after": Variable(BLOCK, "of the channel", "root mean square of the residual with the estimates"),
    "rms_expected": Variable(BLOCK, "of the channel", "its expected value from the scatter between turns"),
    "used": Variable(BLOCK, "1", "positions used", np.int32),
    "left_out": Variable(BLOCK, "1", "positions with data that are not used", np.int32),
    "turns": Variable(BLOCK, "1", "turns used", np.int32),
    "held_out_turns": Variable(BLOCK, "1", "held-out turns", np.int32),
    "held_out_before": Variable(BLOCK, "of the channel", "rms of the residual of the held-out data, at the start"),
    "held_out_after": Variable(BLOCK, "of the channel", "the same with the estimates"),
    "held_out_expected": Variable(BLOCK, "of the channel", "its expected value, by scatter and prediction"),
    "reduced_chi_squared": Variable((), "1", "χ² of the residuals relative to the scatter between turns"),
    "chi_squared_freedom": Variable((), "1", "degrees of freedom of that χ²"),
    "chi_squared_chance": Variable((), "1", "chance of a larger one if the model is right"),
    "turn_correlation": Variable((), "1", "correlation of the contributions of successive turns"),
    "hold_out_ratio": Variable((), "1", "residuals of the held-out data over their expected value"),
    "phase": Variable(("condition", "position"), "1", "share of the cycle"),
    "measured": Variable(COURSE, "of the channel", "mean over the turns"),
    "residual_before": Variable(COURSE, "of the channel", "measured minus model, at the start"),
    "residual_after": Variable(COURSE, "of the channel", "measured value minus predicted reading of the sensor"),
    "residual_uncertainty": Variable(COURSE, "of the channel", "standard uncertainty of the mean over the turns"),
}


@dataclass(frozen=True)
class Identified:
    """An identification, with the figures of its unknowns and, behind them, of the errors of its sensors.

    groups: unknowns that the data do not separate, by their places; encoder: path of an unknown by which the encoder of
    the data is off, no number of the mechanism; empty without.
    """

    mechanism: Mechanism
    measurement: Measurement
    fit: Fit
    solution: Solution
    spread: Covariances
    groups: Sequence[Sequence[int]]
    encoder: str = ""

    @property
    def x(self) -> Array:
        """Where the search ended."""
        return self.solution.x

    @cached_property
    def lost(self) -> NDArray[np.bool_]:
        """What the data do not tell."""
        return np.isin(np.arange(len(self.x)), [member for group in self.groups for member in group])

    @cached_property
    def half(self) -> Array:
        """Half of a two-sided 95 % interval, whether the data tell the unknown or not."""
        return np.asarray(quantile(self.spread.freedom) * self.spread.deviation)

    @cached_property
    def vague(self) -> NDArray[np.bool_]:
        """Unknowns whose 95 % interval is wider than twice themselves, or than their limits are apart."""
        low, high = self.fit.bounds
        return np.asarray((self.half > np.minimum(sizes_of(self.fit, self.x), (high - low) / 2)) & ~self.lost)

    @cached_property
    def beyond(self) -> dict[int, float]:
        """What errors of sensors come to with nothing stated of them, by place, where that is far off: of those at
        their limit, and of those without which there is hardly a misfit."""
        test, excess = self.spread.test, dict[int, float]()
        fit = replace(self.fit, inflation=1.0) if test.misfit else self.fit
        for s, (error, size) in enumerate(zip(fit.sensors, self.x[fit.count :], strict=True)):
            at_limit = abs(size) > NEAR_LIMIT * error.most
            if error.stated and (at_limit or test.misfit):
                free = replace(fit, sensors=[*fit.sensors[:s], replace(error, stated=False), *fit.sensors[s + 1 :]])
                x = solved(free, self.x).x
                explained = at_limit or lack_of_fit(free, x).reduced - 1 < UNEXPLAINED * (test.reduced - 1)
                if explained and abs(x[fit.count + s]) >= FAR:
                    excess[s] = float(x[fit.count + s])
        return excess

    @property
    def refuted(self) -> bool:
        """Whether the estimates stand for something else: a gross misfit, or an error beyond what is stated of it."""
        return self.spread.test.gross or bool(self.beyond)

    @cached_property
    def intervals(self) -> dict[str, NDArray[Any]]:
        """Limit that an estimate is on, −1, 0 or 1, the estimate, and its 95 % interval within the limits.

        On a limit the interval is one-sided, from where a step without limits ends if that is inside.
        """
        (low, high), x, u = self.fit.bounds, self.x, np.where(self.lost, np.nan, self.spread.deviation)
        step = -self.spread.inverse @ (self.fit.jacobian(x).T @ self.fit.residuals(x))
        near = AT_LIMIT * np.nan_to_num(u) + 1e-9 * np.abs(x)
        upper, lower = (~self.lost & (gap <= near) for gap in (high - x, x - low))
        limit = np.where(upper & (step >= 0), 1, np.where(lower & (step <= 0), -1, 0))
        estimate = np.where(self.lost, np.nan, np.where(limit < 0, low, np.where(limit > 0, high, x)))
        half, one_sided = quantile(self.spread.freedom) * u, quantile(self.spread.freedom, one_sided=True) * u
        least = np.where(limit > 0, np.minimum(x + step, high) - one_sided, estimate - half)
        most = np.where(limit < 0, np.maximum(x + step, low) + one_sided, estimate + half)
        least, most = np.where(limit < 0, low, least), np.where(limit > 0, high, most)
        figures = {"limit": limit.astype(np.int8), "estimate": estimate, "standard_uncertainty": u}
        return figures | {"lower": np.maximum(least, low), "upper": np.minimum(most, high)}

    @cached_property
    def by_block(self) -> dict[str, NDArray[Any]]:
        """Residuals, (channel, condition) and (channel, condition, position), with the phases of the conditions."""
        fit, conditions, channels = self.fit, self.measurement.conditions, list(self.fit.model.measures)
        longest = max(len(condition.phase) for condition in conditions)
        sizes = {"channel": len(channels), "condition": len(conditions), "position": longest}
        variables = {name: variable for name, variable in VARIABLES.items() if variable.dims}
        arrays = {name: var.blank(sizes) for name, var in variables.items() if set(var.dims) <= set(sizes)}
        for k, condition in enumerate(conditions):
            arrays["phase"][k, : len(condition.phase)] = condition.phase
        allowed = fit.allowed(self.x)
        for k, block in enumerate(fit.blocks):
            at, mask = (channels.index(block.channel), block.condition), fit.masks[k]
            rows: dict[str, Array] = {}
            figures: dict[str, float] = {"turns": len(block.signal.turns), "held_out_turns": len(block.held.turns)}
            if len(block.signal.turns):
                before, after = (np.where(mask, fit.gap(x, k), np.nan) for x in (fit.start, self.x))
                # of the positions that are used: beside jumps turns scatter more
                scatter = np.sqrt(block.pooled(mask) / np.maximum(block.signal.count, 1) + block.unresolved**2)
                expected = np.where(mask & block.repeats, scatter, np.nan)
                rows = {"measured": block.signal.mean, "residual_before": before, "residual_after": after,
                        "residual_uncertainty": expected}  # fmt: skip
                figures |= {"rms_before": rms(before), "rms_after": rms(after), "rms_expected": rms(expected)}
                figures["used"] = int(np.count_nonzero(mask))
                figures["left_out"] = int(np.count_nonzero(np.isfinite(block.signal.mean) & ~mask))
            if len(block.held.turns):
                where = allowed[k] & np.isfinite(block.held.mean)
                before, after = (fit.gap(x, k, block.held.mean)[where] for x in (fit.start, self.x))
                columns = np.nan_to_num(fit.reading(self.x, k)[1][:, where])
                predicted = np.einsum("pi,pq,qi->i", columns, self.spread.covariance, columns)
                expected = np.sqrt(self._scatter(k) / np.maximum(block.held.count, 1)[where] + predicted)
                at_blocks = {"before": before, "after": after, "expected": expected}
                figures |= {f"held_out_{name}": rms(row) for name, row in at_blocks.items()}
            for name, row in rows.items():
                arrays[name][at][: len(row)] = row
            for name, figure in figures.items():
                arrays[name][at] = figure
        return arrays

    def _scatter(self, k: int) -> float:
        """Variance of one turn of a block of which turns are held out."""
        block, mask = self.fit.blocks[k], self.fit.masks[k]
        if block.repeats:
            return block.pooled(mask)
        if len(block.held.turns) > 1:
            return float(np.nanmean(block.held.scatter[mask] ** 2))
        alike = [self.fit.variances[j] for j in self.fit.fitted if self.fit.blocks[j].channel == block.channel]
        return float(np.mean(alike)) if alike else float("nan")

    @property
    def hold_out_ratio(self) -> float:
        """Rms of all predictions over what is expected of them; NaN if nothing is held out."""
        return rms(self.by_block["held_out_after"] / self.by_block["held_out_expected"])

    @cached_property
    def cycles(self) -> list[DriveCycle]:
        """The cycle in every condition, with the estimates."""
        values = np.asarray(np.where(self.lost, self.fit.start, self.x)[: self.fit.count])
        return [self.fit.model.cycle(k, values) for k in range(len(self.measurement.conditions))]


def dataset(identified: Identified) -> xr.Dataset:
    """Estimates with their uncertainty, residuals and findings."""
    fit, measurement, mechanism = identified.fit, identified.measurement, identified.mechanism
    model, conditions, spread, n = fit.model, measurement.conditions, identified.spread, fit.count
    names, system = [unknown.name for unknown in model.unknowns], model.run.system
    u, variances = identified.intervals["standard_uncertainty"], np.array([*map(np.diagonal, spread.parts.values())])
    rows = fit.jacobian(identified.x)[:, :n]
    singular = np.linalg.svd(rows / (np.linalg.norm(rows, axis=0) + (rows == 0).all(axis=0)), compute_uv=False)
    sizes = [{abs(error.angle)} if error.angle else set(error.sizes[error.sizes != 0]) for error in fit.sensors]
    with np.errstate(all="ignore"):
        correlation = np.clip(spread.covariance[:n, :n] / np.outer(u[:n], u[:n]), -1.0, 1.0)
        share = (variances / np.sum(variances, axis=0))[:, :n].T
    arrays = {
        **identified.by_block,
        **{name: figures[:n] for name, figures in identified.intervals.items()},
        "start": fit.start[:n],
        "degrees_of_freedom": spread.freedom[:n],
        "told": (~identified.lost & ~identified.vague)[:n].astype(np.int8),
        "correlation": correlation,
        "share": np.where(identified.lost[:n, None], np.nan, share),
        "singular_value": np.append(singular, np.zeros(n - len(singular))),  # fewer data than unknowns
        "sensor_error": np.where(identified.lost, np.nan, identified.x)[n:],
        "sensor_uncertainty": u[n:],
        "sensor_size": np.array([size.pop() if len(size) == 1 else np.nan for size in sizes]),
        "reduced_chi_squared": np.asarray(spread.test.reduced),
        "chi_squared_freedom": np.asarray(spread.test.freedom),
        "chi_squared_chance": np.asarray(spread.test.chance),
        "turn_correlation": np.asarray(spread.follows),
        "hold_out_ratio": np.asarray(identified.hold_out_ratio),
    }
    labels = {
        "parameter": names, "parameter_2": names, "source": list(spread.parts),
        "sensor": [error.name for error in fit.sensors], "channel": list(model.measures),
        "condition": [condition.name for condition in conditions],
    }  # fmt: skip
    ends = [(cycle.begin, cycle.begin + cycle.turn) for cycle in identified.cycles]
    attributes = {
        "name": mechanism.name,
        "identified": measurement.name,
        **origin(mechanism, system.plan.formula),
        "confidence": CONFIDENCE,
        "encoder": identified.encoder,
        "parameter_paths": [unknown.paths for unknown in model.unknowns],
        "parameter_units": [unknown.unit for unknown in model.unknowns],
        "channel_units": [measure.unit(system) for measure in model.measures.values()],
        "channel_measures": [measure.name for measure in model.measures.values()],
        "drive": next(iter(mechanism.drivers), ""),
        # angles of the first driver where the cycle begins and ends, rad; None if they name no position
        "drive_range": [list(pair) if np.isfinite(pair).all() else None for pair in ends],
        "files": [list(condition.files) for condition in conditions],
        "data_files": hashed_files(conditions),
        "data_findings": data_findings(measurement),
        "done": list(measurement.done),
        "inputs": inputs(mechanism),
        "evaluations": fit.courses_at.count,
        "converged": int(identified.solution.converged),
        "references": "\n".join([*SOURCES, *references(mechanism)]),
        "findings": finding_rows(_findings(identified)),
    }
    variables = described({name: arrays[name] for name in VARIABLES}, VARIABLES)
    return dataset_of("identification", variables, labels, attributes)


# ---- findings -------------------------------------------------------------------------------------------------


def _findings(identified: Identified) -> list[Finding]:
    """Errors and warnings first."""
    fit, conditions = identified.fit, identified.measurement.conditions
    driver, fitted = next(iter(identified.mechanism.drivers), ""), {fit.blocks[k].condition for k in fit.fitted}
    rows = [*other_speed(driver, [(conditions[k], identified.cycles[k].speed) for k in sorted(fitted)])]
    for part in (_fit, _repetitions, _sensors, _parameters):
        rows += part(identified)
    return sorted(rows, key=lambda finding: list(Severity).index(finding.severity))


def _joined(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def _fit(identified: Identified) -> Iterator[Finding]:
    """Whether the search converged, the model fits and predicts, and what would explain a misfit."""
    solution, test, ratio = identified.solution, identified.spread.test, identified.hold_out_ratio
    if not (solution.converged and solution.settled):
        what, remedy = "the search did not converge", "give start values closer to the solution, or fewer parameters"
        severity = Severity.WARNING if solution.converged else Severity.ERROR
        yield Finding.weighed(severity, "search.not_ended", "search", what, remedy, evaluations=solution.evaluations)
    if test.misfit:
        worth = "the estimates mean nothing" if identified.refuted else "the intervals are widened accordingly"
        reduced = f"{float(f'{test.reduced:.3g}'):,.10g}"  # without a power of ten
        what = f"the model does not fit: reduced χ² {reduced} (1 is expected from the scatter between turns), p-value "
        what += f"{max(test.chance, 1e-4):.2g}{' or less' * (test.chance < 1e-4)}; {worth}"
        remedy = (
            "`trunnion compare` shows what zero, gain, angle or friction would explain it; or identify more parameters"
        )
        severity = Severity.ERROR if identified.refuted else Severity.WARNING
        figures = {"reduced": test.reduced, "chance": test.chance}
        yield Finding.weighed(severity, "fit.misfit", "fit", what, remedy, **figures)
    if ratio > POOR:
        what = f"the held-out data differ from the prediction by {ratio:.1f} times its standard uncertainty"
        remedy = "the model lacks an effect that differs there"
        yield Finding.warning("held_out.missed", "hold_out", what, remedy, times=ratio)


def _repetitions(identified: Identified) -> Iterator[Finding]:
    """Whether turns and conditions repeat."""
    fit, spread = identified.fit, identified.spread
    for p, unknown in enumerate(fit.model.unknowns):
        times = float(np.sqrt(spread.apart[p]))
        if times > 1 and not identified.lost[p]:
            what = f"the conditions disagree: estimates from single ones vary {times:.2g} times as much as the "
            what += "scatter between turns explains; the interval is widened accordingly"
            remedy = "look for differences between conditions: settings, speed, temperature, the zero of each file"
            severity = Severity.WARNING if times > MUCH else Severity.NOTE
            where = f"parameter {unknown.name}"
            yield Finding.weighed(severity, "fit.conditions_disagree", where, what, remedy, times=times)
    fitted = [fit.blocks[k] for k in fit.fitted]
    if not any(block.repeats for block in fitted):
        what = "no turn is repeated: the scatter is estimated from the residuals, the model cannot be tested, and the "
        what += "intervals are too narrow if the data are filtered"
        yield Finding.warning("fit.not_repeated", "data", what, "record several turns")
    if spread.follows > 2 / np.sqrt(max(sum(len(block.spread) - 1 for block in fitted), 1)):
        what = f"successive turns are correlated ({spread.follows:.2f}): the intervals are widened accordingly"
        remedy = "look for a drift; warm the rig up"
        yield Finding.warning("fit.turns_alike", "data", what, remedy, correlation=spread.follows)


def _sensors(identified: Identified) -> Iterator[Finding]:
    """Channels whose zero and gain count as exact; errors far from what is stated, where nothing explains a misfit."""
    fit, bare = identified.fit, dict[str, bool]()
    for block in (fit.blocks[k] for k in fit.fitted):
        has_error = bool(shared_zero(block.signal.accuracy) or block.signal.accuracy.gain)
        bare[block.channel] = bare.get(block.channel, True) and not has_error
    if names := [name for name, is_bare in bare.items() if is_bare and not fit.model.measures[name].of_motion]:
        what = f"no accuracy is stated for {_joined(names)}: zero and gain count as exact, and the intervals are too "
        remedy = "state accuracy: {zero: …, gain: …} in the mapping"
        yield Finding.warning("sensor.no_accuracy", "sensors", f"{what}narrow", remedy)
    for s, sensor in enumerate(fit.sensors) if not identified.spread.test.gross else ():
        excess, times = s in identified.beyond, abs(identified.beyond.get(s, float(identified.x[fit.count + s])))
        if sensor.stated and times > OFF:
            what = f"differs from its stated value by {times:.1f} standard uncertainties"
            what += ", which no stated error does: the estimates mean nothing" * excess
            remedy = "check the sensor, its unit, its stated accuracy, and lengths and loads of the model"
            where, severity = "angle.zero" if sensor.angle else sensor.name, (Severity.WARNING, Severity.ERROR)[excess]
            yield Finding.weighed(severity, "sensor.off", where, what, remedy, times=times, beyond=excess)


def _parameters(identified: Identified) -> Iterator[Finding]:
    """Unknowns without an effect, that are not told apart, or that the data hardly determine."""
    fit = identified.fit
    channels = _joined(list(dict.fromkeys(fit.blocks[k].channel for k in fit.fitted)))
    every = [*(unknown.name for unknown in fit.model.unknowns), *(f"the {error.name}" for error in fit.sensors)]
    for group in identified.groups:
        names = [every[i] for i in group]
        what = f"{names[0]} is not identifiable: it has no effect on {channels}"
        if len(names) > 1:
            what = f"{_joined(names)} are not separately identifiable: they have the same effect on {channels}"
        remedy = "fix one or more, or measure a quantity that tells them"
        yield Finding.warning("parameter.not_told_apart", f"parameter {names[0]}", what, remedy, names=names)
    for p, unknown in enumerate(fit.model.unknowns) if not identified.refuted else ():
        if identified.vague[p]:  # of a model that does not fit, that is why
            about = with_uncertainty(float(identified.x[p]), float(identified.half[p]), unknown.unit)
            what = f"{unknown.name} is not identifiable: its 95 % interval, {about}, is wider than the value itself"
            remedy = "fix it, or measure a quantity that depends on it more"
            yield Finding.warning("parameter.vague", f"parameter {unknown.name}", what, remedy)


# ---- estimates in the model -----------------------------------------------------------------------------------


def with_estimates(mechanism: Mechanism, result: xr.Dataset) -> Mechanism:
    """Put the estimates of a result into the mechanism, rounded to two digits of their standard uncertainty.

    Parameters
    ----------
    mechanism : the model that was identified.
    result : of `identify`.

    Returns
    -------
    The mechanism with the estimates, in the units that were written there; what is not identifiable stays as it is, and
    so does the start of a driver: by that the encoder is off, and the zero of the angle in the mapping.
    """
    values: dict[str, float | str] = {}
    units = attribute(result, "parameter_units")
    for p, paths in enumerate(attribute(result, "parameter_paths")):
        estimate, u = (float(result[name].values[p]) for name in ("estimate", "standard_uncertainty"))
        if result["told"].values[p] and result.attrs["encoder"] not in paths:
            values |= {path: _text(mechanism, path, estimate, u, units[p]) for path in paths}
    return mechanism.with_values(values)


def _text(mechanism: Mechanism, path: str, value: float, u: float, si: str) -> float | str:
    """A number in the unit that is written at its path, with the digits that it has."""
    entry = mechanism.parameter_set.entries.get(path)
    written, factor = written_unit(entry.quantity.source if entry else "", si)
    places = decimals(u / factor) if u > 0 else 6
    number = f"{round(value / factor, places):.{max(places, 0)}f}" if places < 12 else f"{value / factor:.6g}"
    return f"{number} {written}" if written else float(number)
