"""Results of `tolerance` made by hand: a four-bar's rocker angle as it would be, and every kind that a view must bear.

The curve and its derivatives are those of the four-bar l₁..l₄ = 100, 30, 90, 70 mm; the samples are drawn from them to
first order with a little second order. The views take the numbers as they stand.
"""

from __future__ import annotations

import json
from functools import cache

import numpy as np
import xarray as xr
from scipy.stats import norm

LENGTHS = {"ground": 0.1, "crank": 0.03, "coupler": 0.09, "rocker": 0.07}
QUANTILES = (0.00135, 0.005, 0.025, 0.05, 0.25, 0.5, 0.75, 0.95, 0.975, 0.995, 0.99865)
ODD = ["Ω—Welle", "</script><script>alert(1)</script>", '<img src=x onerror="alert(2)">', "_$x$ & <!-- 曲柄"]
LIMIT = np.radians(0.1)
UNITS = {"nominal": "rad", "curve": "rad", "parameter_nominal": "m"}


def rocker(lengths, theta):
    """Angle of the rocker, open branch; lengths: ground, crank, coupler, rocker, each a number or (sample, 1)."""
    l1, l2, l3, l4 = lengths
    x, y = l2 * np.cos(theta) - l1, l2 * np.sin(theta)
    reach = np.hypot(x, y)
    return np.arctan2(y, x) - np.arccos((reach**2 + l4**2 - l3**2) / (2 * reach * l4))


@cache
def _four_bar(positions):
    """Nominal curve (position,), sensitivities (4, position) rad/m."""
    theta = 2 * np.pi * np.arange(positions) / positions
    base, step = np.array(list(LENGTHS.values())), 1e-7
    rows = [(rocker(base + step * unit, theta) - rocker(base - step * unit, theta)) / (2 * step) for unit in np.eye(4)]
    return theta, np.unwrap(rocker(base, theta)), np.array(rows)


def toleranced(
    positions=360, samples=4000, tolerance=0.00007, methods=("linear", "worst-case", "monte-carlo"), sobol=False,
    extra=0, measures=1, limits=True, failures=0, seed=1,
):  # fmt: skip
    """A Dataset of the contract. extra: numbers of little effect; measures: copies of the first."""
    theta, curve, slopes = _four_bar(positions)
    rng = np.random.default_rng(seed)
    names = [f"links.{name}.length" for name in LENGTHS]
    names += [f"joints.P{k}.pin.clearance" for k in range(extra)]
    more = 1e-6 * rng.random((extra, 1)) * np.cos(theta + rng.random((extra, 1))) / tolerance
    slope = np.vstack([slopes, more])
    half = np.full(len(names), tolerance)
    sigma = half / 3
    nominal = [*LENGTHS.values(), *[0.0] * extra]
    top = int(np.argmax(np.abs(slope).T @ half))
    effect, sides = np.abs(slope) * half[:, None], np.sqrt(np.sum((slope * half[:, None]) ** 2, axis=0))
    worst = effect.sum(axis=0)
    figures = {
        "nominal": 0.0, "worst_case_lower": -worst[top], "worst_case_upper": worst[top], "rss": sides[top],
        "deviation_linear": sides[top] / 3, "shift_linear": 0.0, "place": 360.0 * top / positions,
    }  # fmt: skip
    by_parameter = {
        "sensitivity": slope[:, top],
        "contribution_worst_case": effect[:, top],
        "contribution_rss": (effect[:, top] / sides[top]) ** 2,
    }
    over = {"curve": curve, "curve_worst_case_lower": -worst, "curve_worst_case_upper": worst, "curve_rss": sides}
    found = {
        **{name: (("measure",), [value] * measures) for name, value in figures.items()},
        **{name: (("measure", "parameter"), [values] * measures) for name, values in by_parameter.items()},
        **{name: (("measure", "position"), [values] * measures) for name, values in over.items()},
        "curve_sensitivity": (("measure", "parameter", "position"), [slope] * measures),
        "status": (("position",), np.zeros(len(curve), np.int8)),
        "parameter_nominal": (("parameter",), nominal),
        "parameter_lower": (("parameter",), -half),
        "parameter_upper": (("parameter",), half),
        "parameter_deviation": (("parameter",), sigma),
        "parameter_shift": (("parameter",), 0.0 * half),
    }
    if "worst-case" in methods:
        corner = np.array(nominal) + half * np.sign(slope[:, top])
        found |= {
            "searched_lower": (("measure",), [-0.98 * worst[top]] * measures),
            "searched_upper": (("measure",), [1.013 * worst[top]] * measures),
            "corner_lower": (("measure", "parameter"), [nominal] * measures),
            "corner_upper": (("measure", "parameter"), [corner] * measures),
        }
    sampled = [name for name in methods if "monte-carlo" in name]
    coordinates = {"quantile": list(QUANTILES)}
    if sampled:
        drawn = _drawn(rng, slope, sigma, samples)
        found |= _of_samples(drawn, measures, failures, samples)
        coordinates["cause"] = [
            "solved",
            "cannot be assembled",
            "locked by friction: no drive effort can move the mechanism",
        ]
    if sobol:
        first = found["contribution_rss"][1][0]
        for name, share in (("first_order", first * 0.97), ("total_order", first * 1.01)):
            found |= {name + end: (("measure", "parameter"), [np.clip(share + by, 0, 1)] * measures)
                      for end, by in (("", 0.0), ("_low", -0.015), ("_high", 0.015))}  # fmt: skip
    labels = ["angle-error", *(f"angle-error-{k}" for k in range(2, measures + 1))]
    variables = {
        name: (dims, np.asarray(values), {"units": UNITS.get(name, ""), "long_name": name.replace("_", " ")})
        for name, (dims, values) in found.items()
    }
    period = 0.5
    coordinates |= {
        "measure": labels,
        "parameter": names,
        "time": ("position", period * np.arange(positions) / positions, {"units": "s", "long_name": "time"}),
        "drive": ("position", np.degrees(theta), {"units": "°", "long_name": "angle of A"}),
    }
    attributes = {"kind": "tolerance", **_attributes(labels, names, methods, samples, limits, found)}
    return xr.Dataset(variables, coordinates, attributes)


def _drawn(rng, slope, sigma, samples):
    """Deviations of the curve, (sample, position)."""
    moves = rng.standard_normal((samples, len(sigma))) * sigma
    first = moves @ slope
    return first + 40.0 * first**2


def _of_samples(drawn, measures, failures, samples):
    figure = np.abs(drawn).max(axis=1)
    kept = figure[failures:]
    count, mean, sigma = len(kept), kept.mean(), kept.std(ddof=1)
    centred = (kept - mean) / sigma
    passed = int(np.sum(kept <= LIMIT))
    share, low, high = wilson(passed, samples)
    counts, edges = np.histogram(kept, 180)
    quantiles = np.quantile(kept, QUANTILES)
    sizes = np.array([2**k for k in range(6, 40) if 2**k < count] + [count])
    numbers = {
        "mean": mean, "deviation": sigma, "skewness": np.mean(centred**3), "kurtosis": np.mean(centred**4),
        "least": kept.min(), "most": kept.max(),
        "mean_low": mean - 1.96 * sigma / count**0.5, "mean_high": mean + 1.96 * sigma / count**0.5,
        "deviation_low": sigma * (1 - 1.96 / (2 * count) ** 0.5),
        "deviation_high": sigma * (1 + 1.96 / (2 * count) ** 0.5),
        "yield": share, "yield_low": low, "yield_high": high,
        "cp": np.nan, "cpk": (LIMIT - mean) / (3 * sigma),
    }  # fmt: skip
    found = {name: (("measure",), [value] * measures) for name, value in numbers.items()}
    for end, by in (("", 0.0), ("_low", -0.003), ("_high", 0.003)):
        found[f"quantile{end or '_value'}"] = (("measure", "quantile"), [quantiles * (1 + by)] * measures)
        found[f"yield_all{end}"] = ((), {"": share, "_low": low, "_high": high}[end])
    running = {
        "convergence_mean": [kept[:n].mean() for n in sizes],
        "convergence_deviation": [kept[:n].std(ddof=1) for n in sizes],
        "convergence_yield": [np.mean(kept[:n] <= LIMIT) for n in sizes],
    }
    return {
        **found,
        "histogram": (("measure", "bin"), [counts] * measures),
        "edge": (("measure", "edge"), [edges] * measures),
        "band": (("measure", "quantile", "position"), [np.quantile(drawn, QUANTILES, axis=0)] * measures),
        "failed": (("cause",), [0, failures - failures // 3, failures // 3]),
        "samples": ((), samples),
        "convergence_samples": (("size",), sizes),
        **{name: (("measure", "size"), [values] * measures) for name, values in running.items()},
    }


def wilson(passed, count):
    """Share and its 95 % interval."""
    share, z = passed / count, norm.ppf(0.975)
    middle = (share + z * z / (2 * count)) / (1 + z * z / count)
    half = z / (1 + z * z / count) * np.sqrt(share * (1 - share) / count + z * z / (4 * count**2))
    return share, middle - half, middle + half


def _attributes(labels, names, methods, samples, limits, found):
    rows = [{"label": "angle-error, worst case, linear", "value": found["worst_case_upper"][1][0], "unit": "rad"}]
    if "yield" in found:
        rows.append({"label": "angle-error, yield", "value": float(found["yield"][1][0]), "unit": "1"})
    finding = {
        "severity": "warning", "where": "measures.angle-error.limit", "what": "the worst case is 0.19°, limit 0.1°",
        "remedy": "tighten links.coupler.length first",
    }  # fmt: skip
    return {
        "name": "Four-bar with tolerances", "formula": "I(0,1) → II(2,3)RRR",
        "limits": json.dumps([[-LIMIT, LIMIT] if limits else None] * len(labels)),
        "bounds": json.dumps([[None, None]] * len(labels)),
        "measure_texts": json.dumps(["angle of rocker, largest deviation over the turn"] * len(labels)),
        "drive": "A", "drive_unit": "°", "periodic": 1, "methods": json.dumps(list(methods)),
        "samples": samples, "seed": 1,
        "sampling": "quasi-monte-carlo" if "quasi-monte-carlo" in methods else "monte-carlo",
        "summary": json.dumps(rows), "findings": json.dumps([finding] if limits else []),
        "model_hash": "9f2c41d07ab35e68", "trunnion_version": "0.5.0", "references": "",
        "flag_values": "0 8", "flag_meanings": "solved not_assembled",
    }  # fmt: skip


# ---- every kind of result -------------------------------------------------------------------------------------


def at_one_position():
    """One measure at one position, with its own nominal and unequal limits."""
    result = toleranced(24).isel(position=[4])
    spread = result["deviation"].values[0] * np.linspace(-3.5, 3.5, 181)
    base = np.radians(112.3)
    mass = np.diff(norm.cdf(spread / result["deviation"].values[0]))
    result["edge"] = (("measure", "edge"), [base + spread])
    result["histogram"] = (("measure", "bin"), [np.rint(4000 * mass).astype(int)])
    for name in ("mean", "nominal", "mean_low", "mean_high"):
        result[name] = (("measure",), [base + 1e-5 * (name != "nominal")], {"units": "rad"})
    for name, at in (("least", 0), ("most", -1)):
        result[name] = (("measure",), [base + spread[at]])
    sigma = float(result["deviation"].values[0])
    for end in ("", "_low", "_high"):
        result[f"quantile{end or '_value'}"] = (("measure", "quantile"), [base + sigma * norm.ppf(QUANTILES)])
    result["convergence_mean"] = result["convergence_mean"] + base - result["convergence_mean"][:, -1]
    result["worst_case_lower"] = -result["worst_case_upper"]
    result["searched_lower"] = -result["searched_upper"]
    result["cp"] = (("measure",), [0.15 / np.degrees(6 * sigma)])
    result.attrs["limits"] = json.dumps([[np.radians(-0.05), np.radians(0.1)]])
    result.attrs["measure_texts"] = json.dumps(["angle of rocker at 60° of A"])
    return result.assign_coords(measure=["theta"])


def structure():
    """Without a driver: one position, no coordinate of a drive."""
    result = at_one_position().drop_vars("drive")
    result.attrs |= {"drive": "", "drive_unit": "", "periodic": 0}
    return result


def torque():
    """A force measure bounded from above; its spread is a good part of it."""
    result = at_one_position()
    low, high = result["least"].values[0], result["most"].values[0]
    factor, base = 900.0 / (high - low), float(result["nominal"].values[0])
    for name, one in result.variables.items():
        key = str(name)
        if (
            "measure" not in one.dims
            or one.dtype.kind != "f"
            or key.startswith(("histogram", "yield", "cp", "convergence_yield", "place", "corner"))
        ):
            continue
        if key in ("skewness", "kurtosis", "contribution_rss"):
            continue
        moved = key in ("edge", "least", "most", "convergence_mean", "nominal") or key.startswith(("mean", "quantile_"))
        result[name] = (one.dims, (one.values - base) * factor + 9288.3 if moved else one.values * factor)
    for name in ("nominal", "curve"):
        result[name].attrs["units"] = "N m"
    result.attrs |= {
        "limits": "[null]", "bounds": "[[null, 9600.0]]",
        "measure_texts": '["torque of A, maximum over the turn"]',
    }  # fmt: skip
    return result.assign_coords(measure=["peak"])


def gap():
    """No position assembles from 130° to 175°."""
    result = toleranced()
    for name in ("curve", "curve_worst_case_lower", "curve_worst_case_upper", "curve_rss", "band"):
        values = result[name].values.copy()
        values[..., 130:176] = np.nan
        result[name] = (result[name].dims, values)
    result["status"][130:176] = 8
    return result


def odd_names():
    """Names that try to break out of a page or a plot."""
    result = toleranced(72, 1000)
    result = result.assign_coords(parameter=ODD, measure=["_$ω$ <b>曲柄</b>"])
    result.attrs["name"] = "</style><script>alert(3)</script>"
    return result


CASES = {
    "plain": toleranced,
    "one position": at_one_position,
    "structure": structure,
    "torque": torque,
    "no limits": lambda: toleranced(72, 1000, limits=False),
    "failures": lambda: toleranced(72, 3000, failures=120),
    "linear only": lambda: toleranced(72, methods=("linear",)),
    "sobol": lambda: toleranced(72, 2000, methods=("linear", "quasi-monte-carlo", "sobol"), sobol=True),
    "all within": lambda: toleranced(72, 1000, tolerance=2e-5),
    "twelve measures": lambda: toleranced(72, 1000, measures=12),
    "thirty parameters": lambda: toleranced(72, 1000, extra=26, sobol=True),
    "odd names": odd_names,
    "gap": gap,
}
