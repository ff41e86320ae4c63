"""Allocation through the model: values of closed forms, exhaustive search, and the mechanism with what was found."""

import json

import numpy as np
import pytest
from allocations import rocker_sensitivities
from scipy.optimize import minimize_scalar
from scipy.stats import multivariate_normal

import trunnion
from mechanisms_parts import example, joined
from trunnion import Mechanism, MechanismError
from trunnion.results.attributes import summary_of
from trunnion.studies.allocation.allocate import half_widths

LIMIT = np.radians(0.1)


def slopes(count=72):
    """∂θ₄/∂(ground, crank, coupler, rocker) at `count` angles, rad/m."""
    return 1e3 * rocker_sensitivities(2 * np.pi * np.arange(count) / count)


def fourbar(**sections):
    """The example with other sections."""
    return Mechanism(**{**example("toleranced-fourbar").data(), **sections})


def findings(result, severity):
    return [
        f"{row['where']}: {row['what']}" for row in json.loads(result.attrs["findings"]) if row["severity"] == severity
    ]


def dimensions(result, key="tolerance"):
    """Of l1 … l4, half widths in mm."""
    return 1e3 * result[key].sel(parameter=[f"dimensions.l{i}" for i in range(1, 5)]).values


def by_one_limit(angle, criterion="worst-case"):
    """Half widths, mm, and cost of the example with its limit at one crank angle alone, in closed form."""
    s, b, k = np.abs(rocker_sensitivities(np.array([angle])))[0], np.array([1, 0.6, 1, 0.8]), 0.45
    if criterion == "worst-case":
        t = (b / s) ** (1 / (k + 1))
        t *= LIMIT / (s @ t)
    else:
        t = (b / s**2) ** (1 / (k + 2))
        t *= LIMIT / np.linalg.norm(s * t)
    return t, float(np.sum(b / t**k))


@pytest.mark.parametrize("criterion", ["worst-case", "rss"])
def test_limits_are_kept_over_the_whole_cycle(criterion):
    """Σ B/t^0.45, |Δθ₄| ≤ 0.1°: the dearest single angle keeps all others, whatever the steps and the start."""
    place = minimize_scalar(
        lambda angle: -by_one_limit(angle, criterion)[1], bounds=(0.2, 0.5), method="bounded", options={"xatol": 1e-12}
    )
    t, cost = by_one_limit(place.x, criterion)
    dense = np.abs(slopes(100_000)) * t / 1e3 / LIMIT
    assert np.max(np.linalg.norm(dense, axis=1, ord=1 if criterion == "worst-case" else 2)) < 1 + 1e-8
    for start, steps in ((0.001, 12), (1.0, 360)):
        model = example("toleranced-fourbar").with_tolerances({f"l{i}": start * 1e-3 for i in range(1, 5)})
        result = trunnion.allocate(model, criterion=criterion, steps=steps, samples=0)
        assert dimensions(result) == pytest.approx(t, rel=5e-5)  # the cost is flat at its least
        assert float(result["cost_total"]) == pytest.approx(cost, rel=1e-8)
        assert result.attrs["proven"]
        assert float(result["gap"]) < 1e-9
        bought = model.with_tolerances(half_widths(result))
        toleranced = trunnion.tolerance(bought, methods=["linear"], steps=90)
        key = "worst_case_upper" if criterion == "worst-case" else "rss"
        assert float(toleranced[key][0]) <= LIMIT * (1 + 1e-8)


@pytest.mark.parametrize("criterion", ["worst-case", "rss"])
def test_closed_forms_of_one_limit(criterion):
    """t ∝ (B/|S|)^(1/(k + 1)) in the worst case, t ∝ (B/S²)^(1/(k + 2)) of RSS."""
    model = fourbar(measures={"θ": {"angle": "rocker", "at": "60 deg", "limit": "±0.1 deg"}})
    result = trunnion.allocate(model, criterion=criterion, samples=0)
    t, cost = by_one_limit(np.radians(60), criterion)
    assert dimensions(result) == pytest.approx(t, rel=1e-6)  # a gap of 1e-6 would leave them open by 1e-3
    assert float(result["cost_total"]) == pytest.approx(cost, rel=1e-8)
    # more room is worth what the cost falls by
    wider = fourbar(measures={"θ": {"angle": "rocker", "at": "60 deg", "limit": "±0.1001 deg"}})
    wider = trunnion.allocate(wider, criterion=criterion, samples=0)
    fall = float(result["cost_total"] - wider["cost_total"]) / np.radians(1e-4)
    assert float(result["saving"][0]) == pytest.approx(fall, rel=2e-3)


def test_plays_are_bought():
    """A play has the loads of its pin under a unit load at the measure; none stated is a start like any other."""
    model = example("piston-by-cost")
    result = trunnion.allocate(model, samples=0)
    expected = [0.0567249, 0.03482455, 0.01382013, 0.01382013, 0.0181095]
    # a gap of 1e-6 leaves half widths open by 1e-3; the solver comes to some 1e-6
    assert 1e3 * result["tolerance"].values == pytest.approx(expected, rel=1e-5)
    none = model.with_values({f"joints.{joint}.pin.clearance": 0.0 for joint in "OPQ"})
    again = trunnion.allocate(none, samples=0)
    assert again["tolerance"].values == pytest.approx(result["tolerance"].values, rel=1e-9)
    assert again["tolerance_before"].values[2:] == pytest.approx([0, 0, 0])
    assert float(result["searched_upper"][0]) == pytest.approx(1e-4, rel=1e-3)


def test_exact_worst_case():
    """The worst case of the mechanism itself is at the limit, and costs a little more than that of first order."""
    model = example("toleranced-fourbar")
    linear, exact = (trunnion.allocate(model, steps=72, samples=0, exact=one) for one in (False, True))
    worst = max(-float(exact["searched_lower"][0]), float(exact["searched_upper"][0]))
    assert worst == pytest.approx(LIMIT, rel=2e-6)
    assert worst <= LIMIT * (1 + 1e-6)
    assert 0 < float(exact["cost_total"] - linear["cost_total"]) < 0.05
    assert not findings(exact, "warning")


def test_yield():
    """The share of samples is the one asked for, within its interval, and costs less than the worst case."""
    model = example("toleranced-fourbar")
    result = trunnion.allocate(model, criterion="yield", target=0.95, steps=36, samples=4000)
    low, share, high = (float(result[f"yield_all{end}"]) for end in ("_low", "", "_high"))
    assert low <= 0.95 <= high
    assert share == next(row.value for row in summary_of(result) if row.name == "yield")  # of those that chose
    assert float(result["cost_total"]) < 12.0
    t = dimensions(result) * 1e-3
    drawn = np.random.default_rng(4).standard_normal((20_000, 4)) * t / 3
    kept = np.mean(np.max(np.abs(drawn @ slopes(36).T), axis=1) <= LIMIT)
    assert kept == pytest.approx(0.95, abs=0.012)


@pytest.mark.slow
def test_options_as_stated_cost_what_keeps_them():
    """A half width between two options is bought as the cheapest that keeps it; one below all has no cost."""
    data = example("fourbar-by-grades").data()
    for stated, cost in {"±0.02 mm": 11.8, "±0.03 mm": 4.2, "±0.2 mm": 1.5, "±0.007 mm": np.nan}.items():
        model = Mechanism(**{**data, "tolerances": {**data["tolerances"], "l2": stated}})
        result = trunnion.allocate(model, steps=12, samples=0)
        assert float(result["cost_before"].sel(parameter="dimensions.l2")) == pytest.approx(cost, nan_ok=True)
        grades = 3 * 6.2  # IT8 of 70, 90 and 100 mm is 46, 54 and 54 µm
        assert float(result["cost_total_before"]) == pytest.approx(cost + grades + 4 * 1.6, nan_ok=True)


def test_several_limits_have_one_margin():
    """Room over standard deviation is the same for both; the yield is that of their normal distribution."""
    places, halves, target = (300, 140), np.radians([0.1, 0.08]), 0.95
    measures = {
        f"at{place}": {"angle": "rocker", "at": f"{place} deg", "limit": f"±{np.degrees(half)} deg"}
        for place, half in zip(places, halves, strict=True)
    }
    b = np.array([1, 0.6, 1, 0.8])
    costs = {f"l{i + 1}": {"model": "power", "B": float(price), "k": 0.45, "unit": "mm", "most": "1 mm"}
             for i, price in enumerate(b)}  # fmt: skip
    result = trunnion.allocate(fourbar(measures=measures, costs=costs), criterion="yield", target=target, samples=0)
    s = slopes(360)[list(places)] * 1e-3 / halves[:, None]
    sigma, margin = s * dimensions(result) / 3, float(result["yield_margin"][0])
    assert result["yield_margin"].values[1] == margin
    assert np.min(1 / np.linalg.norm(sigma, axis=1)) == pytest.approx(margin, rel=1e-6)
    both = multivariate_normal(np.zeros(2), sigma @ sigma.T)
    assert float(both.cdf(np.ones(2), lower_limit=-np.ones(2))) == pytest.approx(target, abs=3e-4)


@pytest.mark.slow
def test_a_yield_that_is_to_be_sure_has_it_at_the_lower_end_of_fresh_samples():
    model = example("piston-by-cost")
    plain, sure = (
        trunnion.allocate(model, criterion="yield", target=0.95, steps=12, samples=2000, sure=each)
        for each in (False, True)
    )
    assert float(plain["yield_checked_low"]) < 0.95 <= float(plain["yield_checked_high"])
    assert float(sure["yield_checked_low"]) >= 0.95
    assert float(sure["cost_total"]) > float(plain["cost_total"])


def test_bounds_of_a_figure():
    """at_least and at_most leave room to one side each: from the nominal figure."""
    course = trunnion.tolerance(fourbar(), ["rotation:D"], ["linear"], at="60 deg", steps=4)
    nominal = float(course["nominal"][0])
    bounds = {"at_most": f"{np.degrees(nominal) + 0.1} deg", "at_least": f"{np.degrees(nominal) - 3} deg"}
    model = fourbar(measures={"turn": {"rotation": "D", "at": "60 deg", **bounds}})
    result = trunnion.allocate(model, samples=0)
    assert np.abs(slopes()[12]) @ dimensions(result) * 1e-3 == pytest.approx(LIMIT, rel=1e-7)


def test_lopsided_tolerances_take_room():
    """The middle of the limits moves the measure by itself."""
    tolerances = {f"l{i}": "±0.03 mm" for i in range(1, 5)} | {"l3": "+0.04/-0.02 mm"}
    model = fourbar(tolerances=tolerances, measures={"θ": {"angle": "rocker", "at": "60 deg", "limit": "±0.1 deg"}})
    result = trunnion.allocate(model, samples=0)
    s = slopes()[12]
    used = np.abs(s) @ dimensions(result) * 1e-3
    assert used == pytest.approx(LIMIT - abs(s[2]) * 1e-5, rel=1e-7)
    read = model.with_tolerances(half_widths(result))
    coupler = next(one for one in read.tolerated() if one.path == "dimensions.l3")
    assert (coupler.lower + coupler.upper) / 2 == pytest.approx(1e-5)


@pytest.mark.spread(3)
@pytest.mark.parametrize(
    "measure",
    [
        {"path_error": "coupler.C", "limit": "±0.05 mm"},
        {"path_error": "coupler.C", "as": "rms", "at_most": "0.05 mm"},
        {"transmission_error": "D", "as": "peak-to-peak", "at_most": "0.2 deg"},
        {"transmission_error": "D", "as": "rms", "at_most": "0.1 deg"},
        {"transmission_error": "D", "as": "maximum", "limit": "±0.1 deg"},
        {"stroke": "D", "limit": "±0.1 deg"},
        {"dead_centre": "D", "limit": "±0.1 deg"},
        {"point": "coupler.C", "axis": "x", "as": "maximum", "limit": "+0.1/-0.05 mm"},
        {"effort": "A", "as": "maximum", "limit": "±0.04 N m"},
    ],
    ids=lambda one: "-".join(map(str, one.values())),
)
def test_measures_keep_their_limits(measure):
    """The worst case that is found on the mechanism keeps the limits, to second order, and samples do."""
    result = trunnion.allocate(fourbar(measures={"m": measure}), steps=24, samples=300)
    assert result.attrs["found"]
    assert not [one for one in findings(result, "error") if "beyond" in one]
    assert float(result["yield"][0]) > 0.99
    assert 0.2 < float(result["used"][0]) <= 1 + 1e-6


def same_figures(results):
    """All figures but those of positions are the same to 1e-8."""
    for result in results[1:]:
        for name, figure in results[0].items():
            if "position" not in figure.dims and figure.dtype.kind in "fi" and name not in ("gap", "saving"):
                size = np.max(np.abs(np.nan_to_num(figure.values)), initial=0.0)
                np.testing.assert_allclose(result[name].values, figure.values, rtol=0, atol=1e-8 * size, err_msg=name)


@pytest.mark.spread(3)
@pytest.mark.parametrize(
    "measure",
    [
        {"path_error": "coupler.C", "limit": "±0.05 mm"},
        {"transmission_error": "D", "as": "maximum", "limit": "±0.1 deg"},
        {"effort": "A", "limit": "±0.04 N m"},
    ],
    ids=("path", "lead", "effort"),
)
@pytest.mark.parametrize("criterion", ["worst-case", "rss", "yield"])
def test_no_figure_depends_on_the_steps(measure, criterion):
    model, samples = fourbar(measures={"m": measure}), 200
    same_figures([trunnion.allocate(model, criterion=criterion, steps=steps, samples=0) for steps in (7, 12, 120, 361)])
    if criterion == "yield":
        asked = {"criterion": criterion, "target": 0.9, "samples": samples}
        same_figures([trunnion.allocate(model, steps=steps, **asked) for steps in (7, 120)])
    else:
        methods = ("linear", "worst-case", "monte-carlo" if criterion == "rss" else "quasi-monte-carlo")
        same_figures([trunnion.tolerance(model, methods=methods, samples=samples, steps=steps) for steps in (7, 120)])


def test_a_distance_is_kept_in_every_direction_at_least_cost():
    """Σ B/t^0.45 with Σ |u·∂C/∂l| t ≤ 0.05 mm for all unit vectors u at all angles, by SLSQP on a grid of both."""
    model = fourbar(measures={"m": {"path_error": "coupler.C", "limit": "±0.05 mm"}})
    result = trunnion.allocate(model, samples=0)
    assert float(result["cost_total"]) == pytest.approx(21.7296386, rel=1e-6)
    assert dimensions(result) == pytest.approx([0.02272726, 0.01231861, 0.01622134, 0.01372147], rel=1e-3)
    linear = trunnion.tolerance(model.with_tolerances(half_widths(result)), methods=["linear"], steps=24)
    assert float(linear["worst_case_upper"][0]) == pytest.approx(5e-5, rel=1e-6)


def test_an_absurd_price_proves_nothing():
    """An option that nobody would take leaves the choice among the others as sharp as it is without it."""
    data = example("fourbar-by-grades").data()
    plain = trunnion.allocate(Mechanism(**data), samples=0)
    gold = {"gold": {"tolerance": "1 um", "cost": 1e15}}
    costs = {**data["costs"], "l2": {"options": {**data["costs"]["l2"]["options"], **gold}}}
    dear = trunnion.allocate(Mechanism(**{**data, "costs": costs}), samples=0)
    assert float(dear["cost_total"]) == float(plain["cost_total"])
    assert dear.attrs["proven"] == plain.attrs["proven"] == 1
    assert float(dear["gap"]) == pytest.approx(float(plain["gap"]), abs=1e-9)


def test_run_outs_and_seats_stay_as_they_are():
    """A run-out that points anywhere has no middle; a pin whose seat is given has no play to choose."""
    data = fourbar().data()
    data["tolerances"]["joints.B.misalignment.offset"] = {"limits": "+0.01/0 mm", "direction": "uniform"}
    data["joints"]["B"]["misalignment"] = {"offset": "0 mm"}
    data["joints"]["C"] |= {"pin": {"clearance": "10 um"}, "seat": {"xi": "30 deg"}}
    data["costs"] |= dict.fromkeys(("B.misalignment.offset", "C.clearance"), data["costs"]["l1"])
    result = trunnion.allocate(Mechanism(**data), steps=24, samples=0)
    # what it does stays, and the others keep their limits with it
    assert result["bought"].sel(parameter="joints.B.misalignment.offset") == 0
    assert float(result["used"][0]) == pytest.approx(1)
    assert float(result["cost_total"]) > 16.6


def test_curve_of_cost_over_accuracy():
    result = trunnion.allocate(example("toleranced-fourbar"), steps=36, samples=0, curve=3)
    assert result["trade_off_factor"].values == pytest.approx([0.5, 1, 2])
    # of a power model without a constant part the cost goes with the power of the limits
    assert result["trade_off_cost"].values == pytest.approx(float(result["cost_total"]) * np.array([2, 1, 0.5]) ** 0.45)
    assert result["trade_off_tolerance"].values[2, :4] == pytest.approx(2 * result["tolerance"].values[:4])


def test_a_criterion_that_leaves_out_correlations_says_so():
    model = fourbar(correlations=[{"of": ["l1", "l2"], "coefficient": 0.5}])
    result = trunnion.allocate(model, criterion="worst-case", steps=24, samples=0)
    assert "correlations: the criterion worst-case ignores the correlations" in findings(result, "warning")


def test_what_cannot_be_allocated():
    for model, text in (
        (fourbar(costs={}), "no tolerance has a cost"),
        (fourbar(measures={}), "no measure is stated"),
        (fourbar(measures={"θ": {"angle": "rocker"}}), "none of the measures θ has a limit"),
    ):
        with pytest.raises(MechanismError, match=text):
            trunnion.allocate(model)


def test_a_tolerance_without_effect_is_not_bounded_by_rounding():
    """The toggle of a press is straight at the least height whatever its crank is, whose slope there is rounding."""
    press = Mechanism(
        dimensions={"a": 0.25, "r": 0.09},
        gravity=[0, 0],
        links={
            "ground": {"points": {"O": [0, 0], "A": [0.48, -0.18], "S": {"at": [0, 0], "axis": [0, -1]}}},
            "crank": {"points": {"A": [0, 0], "B": ["r", 0]}},
            "pull": {"points": {"B": [0, 0], "C": [0.52, 0]}},
            "upper": {"points": {"O": [0, 0], "K": ["a", 0], "C": ["a", 0]}},
            "lower": {"points": {"K": [0, 0], "P": [0.3, 0]}},
            "ram": {"points": {"P": [0, 0], "S": {"at": [0, 0], "axis": [0, -1]}}},
        },
        joints=joined("ground -A- crank -B- pull -C- upper -K- lower -P- ram, ground -O- upper, ground =S= ram"),
        drivers={"A": {"speed": 4.0}},
        assembly={"K": [0.1, -0.23], "P": [0, -0.5]},
        tolerances={"a": "±0.1 mm", "r": "±0.05 mm"},
        measures={"low": {"point": "ram.P", "axis": "y", "as": "minimum", "limit": "±0.3 mm"}},
        costs={name: {"model": "power", "B": 2, "k": 0.5, "unit": "mm"} for name in "ar"},
    )  # fmt: skip
    result = trunnion.allocate(press, steps=36, samples=0)
    assert findings(result, "error") == ["costs.dimensions.r: no limit bounds this tolerance, and wider is cheaper"]
