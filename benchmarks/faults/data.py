"""Faults of what is done with it: statistics, studies, rig, model, results, views, cli."""

from __future__ import annotations

from benchmarks.faults.fault import Fault

__all__ = ["FAULTS"]

_STATISTICS = (
    Fault(
        "empirical-quantile-off-by-one",
        "statistics/distributions.py",
        "place = np.ceil(np.asarray(u) * values.size).astype(np.int64) - 1",
        "place = np.floor(np.asarray(u) * values.size).astype(np.int64)",
        ("tests/statistics/test_distributions.py",),
    ),
    Fault(
        "capability-to-the-farther-limit",
        "statistics/intervals.py",
        "min(upper - mean, mean - lower)",
        "max(upper - mean, mean - lower)",
        ("tests/statistics",),
    ),
    Fault(
        "deviation-by-the-number",
        "statistics/intervals.py",
        "np.sqrt(second * number / (number - 1))",
        "np.sqrt(second)",
        ("tests/statistics/test_intervals.py",),
    ),
    Fault(
        "half-a-block-is-taken",
        "studies/batch.py",
        "partial.replace(place)",
        "place.write_bytes(raw[: len(raw) // 2])",
        ("tests/tolerance/test_checkpoint.py",),
    ),
    Fault(
        "cost-slope-unit-dropped",
        "statistics/costs.py",
        "return A + varying, -k * varying / unit",
        "return A + varying, -k * varying",
        ("tests/statistics/test_costs.py",),
    ),
    Fault(
        "replicates-without-student",
        "statistics/intervals.py",
        "half = special.stdtrit(number - 1, 1 - TAIL) * np.asarray(deviation)",
        "half = special.ndtri(1 - TAIL) * np.asarray(deviation)",
        ("tests/statistics/test_intervals.py",),
    ),
)

_STUDIES = (
    Fault(
        "worst-minimum-taken-as-maximum",
        "studies/tolerance/linear.py",
        'extreme(end, 1.0 if measure.rule == "maximum" else -1.0)',
        "extreme(end, 1.0)",
        ("tests/reference/test_tolerance.py", "-k", "worst_case_of_the_least"),
    ),
    Fault(
        "play-scatter-of-another-dimension",
        "studies/tolerance/effects.py",
        "square / (len(q) + 2) * length(q)",
        "square / (len(q) + 1) * length(q)",
        ("tests/reference/test_play.py", "-k", "one_rule"),
    ),
    Fault(
        "tolerance-mean-shift-sign",
        "studies/tolerance/effects.py",
        "upper, half, slope * mean, scatter)",
        "upper, half, -slope * mean, scatter)",
        ("tests/reference/test_tolerance.py", "-k", "limits_to_one_side or moments"),
    ),
    Fault(
        "allocation-drift-forgotten-on-one-side",
        "studies/allocation/solve.py",
        "np.concatenate([(effects.linear + drift)[keep[0]], (effects.linear - drift)[keep[1]]])",
        "np.concatenate([(effects.linear + drift)[keep[0]], effects.linear[keep[1]]])",
        ("tests/reference/test_allocation.py",),
    ),
    Fault(
        "margin-is-squared",
        "studies/allocation/problem.py",
        "effects.linear @ tolerances + self.margins() * root",
        "effects.linear @ tolerances + self.margins() ** 2 * root",
        ("tests/reference/test_allocation.py",),
    ),
    Fault(
        "dead-centre-of-a-resting-link",
        "studies/design.py",
        "passages[before * after < 0]",
        "passages[before * after <= 0]",
        ("tests/reference/test_design.py",),
    ),
)

_RIG = (
    Fault(
        "misfit-of-conditions-independent",
        "rig/identification/uncertainty.py",
        "alike = max(alike, together / own if own > 0 else 1.0)",
        "alike = max(alike, 1.0)",
        ("tests/rig/test_identify_uncertainty.py",),
    ),
    Fault(
        "turns-without-their-freedom",
        "rig/identification/uncertainty.py",
        "covariance = moved.T @ moved * (turns / (turns - 1))",
        "covariance = moved.T @ moved",
        ("tests/rig/test_identify_uncertainty.py",),
    ),
    Fault(
        "bias-of-following-turns",
        "rig/identification/uncertainty.py",
        "products += float(np.sum(unit[1:] * unit[:-1])) + unit.shape[1] / turns",
        "products += float(np.sum(unit[1:] * unit[:-1]))",
        ("tests/rig/test_identify_uncertainty.py",),
    ),
    Fault(
        "lack-of-fit-of-a-population",
        "rig/identification/uncertainty.py",
        "float(np.var(sums[most], ddof=1))",
        "float(np.var(sums[most]))",
        ("tests/rig/test_identify_uncertainty.py",),
    ),
    Fault(
        "scatter-of-a-population",
        "rig/reading/measurement.py",
        "np.nanstd(turns, axis=0, ddof=1)",
        "np.nanstd(turns, axis=0)",
        ("tests/rig/test_compare.py", "-k", "gum or freedom or scatter or turns"),
    ),
    Fault(
        "efficiency-scatter-of-a-population",
        "rig/reading/measurement.py",
        "float(np.std(per_turn, ddof=1))",
        "float(np.std(per_turn))",
        ("tests/rig/test_efficiency.py",),
    ),
    Fault(
        "bias-scatter-of-a-population",
        "rig/comparison.py",
        "np.std(means, ddof=1)",
        "np.std(means)",
        ("tests/rig/test_compare.py", "-k", "gum or bias"),
    ),
    Fault(
        "bias-without-its-local-part",
        "rig/comparison.py",
        "local = np.array([np.sqrt(np.mean(of.local**2) / len(of.local))])",
        "local = np.zeros(1)",
        ("tests/rig/test_compare.py", "-k", "gum or bias"),
    ),
    Fault(
        "residual-is-model-less-measured",
        "rig/comparison.py",
        "residual = measured - model\n",
        "residual = model - measured\n",
        ("tests/rig/test_compare.py", "-k", "gain_has_its_size or beside_itself"),
    ),
    Fault(
        "month-before-day",
        "rig/reading/tables.py",
        '{"dayfirst": dayfirst}',
        '{"dayfirst": not dayfirst}',
        ("tests/measured_data/test_laboratory_files.py", "-k", "order"),
    ),
    Fault(
        "pulses-without-the-line-between",
        "rig/modelled.py",
        "for _ in range(3):",
        "for _ in range(2):",
        ("tests/rig/test_campaigns.py", "-k", "pulses"),
    ),
)

_MODEL = (
    Fault(
        "nesting-of-yaml-off-by-one",
        "model/file.py",
        "if self.nesting > MAX_DEPTH:",
        "if self.nesting >= MAX_DEPTH:",
        ("tests/model/test_file.py", "-k", "nest"),
    ),
    Fault(
        "nesting-of-toml-off-by-one",
        "model/file.py",
        "if deep or _depth(data) > MAX_DEPTH:",
        "if deep or _depth(data) > MAX_DEPTH + 1:",
        ("tests/model/test_file.py", "-k", "nest"),
    ),
    Fault(
        "alias-allowed",
        "model/file.py",
        "if isinstance(event, AliasEvent):",
        "if isinstance(event, AliasEvent) and not event.anchor:",
        ("tests/model/test_file.py", "-k", "no_model"),
    ),
    Fault(
        "half-width-is-a-width",
        "model/tolerances.py",
        "return (self.upper - self.lower) / 2",
        "return self.upper - self.lower",
        ("tests/model/test_tolerances.py", "tests/reference/test_tolerance_zones.py"),
    ),
    Fault(
        "defaults-over-what-is-stated",
        "model/tolerances.py",
        "return {**of_all, **single}",
        "return {**single, **of_all}",
        ("tests/model/test_tolerances.py",),
    ),
)

_RESULTS = (
    Fault(
        "power-in-not-written",
        "results/tables/cycle.py",
        'Column("power_in", "W", result["drive_power"].values.sum(axis=0))',
        'Column("power_in", "W", result["drive_power"].values[:1].mean(axis=0) * 0.0)',
        ("tests/invariants/test_written_results.py", "-k", "csv"),
    ),
    Fault(
        "set-values-of-the-next-condition",
        "results/tables/studies.py",
        "np.repeat(row, times)",
        "np.tile(row, times)",
        ("tests/views/test_compare.py", "tests/rig/test_compare.py", "-k", "stands_beside"),
    ),
)

_VIEWS = (
    Fault(
        "efficiency-difference-sign",
        "views/compare.py",
        "(m, u, c, m - c)",
        "(m, u, c, c - m)",
        ("tests/views/test_compare.py", "-k", "tables or difference"),
    ),
    Fault(
        "radians-for-degrees",
        "results/quantities.py",
        'return 180.0 / math.pi, "°"',
        'return 1.0, "°"',
        ("tests/views/test_quantities.py",),
    ),
    Fault(
        "runs-are-not-closed",
        "views/curves.py",
        "first = int(np.argmin(within)) if abscissa(result).closed else 0",
        "first = 0",
        ("tests/views/test_peaks.py",),
    ),
)

_CLI = (
    Fault(
        "findings-end-well",
        "cli/result.py",
        "return int(any(",
        "return 0 * int(any(",
        ("tests/manual/test_cli.py",),
    ),
    Fault(
        "bad-input-is-a-finding",
        "cli/app.py",
        "BAD_INPUT, FAULT, STOPPED = 2, 3, 130",
        "BAD_INPUT, FAULT, STOPPED = 1, 3, 130",
        ("tests/manual/test_cli_options.py", "tests/manual/test_cli_files.py"),
    ),
    Fault(
        "grid-points-of-one-axis",
        "cli/options.py",
        "return math.prod(values[2] if isinstance(values, tuple)",
        "return max(values[2] if isinstance(values, tuple)",
        ("tests/manual/test_cli_options.py", "-k", "combinations"),
    ),
)

FAULTS = (*_STATISTICS, *_STUDIES, *_RIG, *_MODEL, *_RESULTS, *_VIEWS, *_CLI)
