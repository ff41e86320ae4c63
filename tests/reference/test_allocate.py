"""Allocation through the model: values of closed forms, exhaustive search, and the mechanism with what was found."""

from __future__ import annotations

import json
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.stats import multivariate_normal

import trunnion
from trunnion import Mechanism, MechanismError
from trunnion.joints.fits import standard_tolerance
from trunnion.studies.allocation.allocate import half_widths

EXAMPLES = Path(__file__).parents[2] / "examples"
LENGTHS = np.array([0.1, 0.03, 0.09, 0.07])
LIMIT = np.radians(0.1)


def slopes(count: int = 72) -> Any:
    """∂θ₄/∂(ground, crank, coupler, rocker) of the open branch at `count` angles, rad/m, from the loop equation."""
    ground, crank, coupler, rocker = LENGTHS
    theta = 2 * np.pi * np.arange(count) / count
    b = crank * np.exp(1j * theta)
    d = ground - b
    reach = np.abs(d)
    along = (coupler**2 - rocker**2 + reach**2) / (2 * reach)
    c = b + d / reach * (along + 1j * np.sqrt(coupler**2 - along**2))
    couple, rock = (c - b) / coupler, (c - ground) / rocker
    # the loop crank + coupler = ground + rocker, each length moved alone, the coupler's direction projected out
    changes = (-np.ones(count), np.exp(1j * theta), couple, -rock)
    turned = np.real(1j * (c - ground) * np.conj(couple))
    return np.array([np.real(change * np.conj(couple)) / turned for change in changes]).T


def fourbar(**sections: Any) -> Mechanism:
    """The example with other sections."""
    return Mechanism(**{**trunnion.read(EXAMPLES / "toleranced-fourbar.yaml").data(), **sections})


def findings(result: Any, severity: str) -> list[str]:
    return [
        f"{row['where']}: {row['what']}" for row in json.loads(result.attrs["findings"]) if row["severity"] == severity
    ]


def dimensions(result: Any, key: str = "tolerance") -> Any:
    """Of l1 … l4, half widths in mm."""
    return 1e3 * result[key].sel(parameter=[f"dimensions.l{i}" for i in range(1, 5)]).values


def test_reference_values() -> None:
    """Σ B/t^0.45, B = 1, 0.6, 1, 0.8, |Δθ₄| ≤ 0.1° at 72 angles, the same from six starts."""
    for start in (0.001, 0.01, 0.03, 0.1, 0.3, 1.0):
        model = trunnion.read(EXAMPLES / "toleranced-fourbar.yaml").with_tolerances(
            {f"l{i}": start * 1e-3 for i in range(1, 5)}
        )
        result = trunnion.allocate(model, steps=72, samples=0)
        assert dimensions(result) == pytest.approx([0.035238, 0.021336, 0.028878, 0.034654], abs=5e-7)
        assert float(result["cost_total"]) == pytest.approx(16.456705, abs=5e-7)
        assert result.attrs["proven"]
        assert float(result["gap"]) < 1e-9
    t = dimensions(result) * 1e-3
    taken = np.abs(slopes()) @ t / LIMIT
    assert np.max(taken) == pytest.approx(1, abs=1e-9)
    assert result["used_curve"].values[0] == pytest.approx(taken, abs=1e-9)


@pytest.mark.parametrize("criterion", ["worst-case", "rss"])
def test_closed_forms_of_one_limit(criterion: str) -> None:
    """t ∝ (B/|S|)^(1/(k + 1)) in the worst case, t ∝ (B/S²)^(1/(k + 2)) of RSS."""
    model = fourbar(measures={"θ": {"angle": "rocker", "at": "60 deg", "limit": "±0.1 deg"}})
    result = trunnion.allocate(model, criterion=criterion, samples=0)
    s, b, k = np.abs(slopes()[12]), np.array([1, 0.6, 1, 0.8]), 0.45
    if criterion == "worst-case":
        t = (b / s) ** (1 / (k + 1))
        t *= LIMIT / (s @ t)
    else:
        t = (b / s**2) ** (1 / (k + 2))
        t *= LIMIT / np.linalg.norm(s * t)
    assert dimensions(result) == pytest.approx(1e3 * t, rel=1e-6)  # a gap of 1e-6 would leave them open by 1e-3
    assert float(result["cost_total"]) == pytest.approx(float(np.sum(b / (1e3 * t) ** k)), rel=1e-8)
    # more room is worth what the cost falls by
    wider = trunnion.allocate(
        fourbar(measures={"θ": {"angle": "rocker", "at": "60 deg", "limit": "±0.1001 deg"}}),
        criterion=criterion,
        samples=0,
    )
    fall = float(result["cost_total"] - wider["cost_total"]) / np.radians(1e-4)
    assert float(result["saving"][0]) == pytest.approx(fall, rel=2e-3)


def test_discrete_equals_exhaustive_search() -> None:
    """Four dimensions, six IT grades each."""
    grades = {6: 14.0, 7: 9.0, 8: 6.2, 9: 4.5, 10: 3.6, 11: 3.1}
    factors = {"l1": 1.0, "l2": 1.6, "l3": 0.9, "l4": 1.25}
    processes = {
        f"bore-{name}": {grade: factor * cost for grade, cost in grades.items()} for name, factor in factors.items()
    }
    for limit in (0.06, 0.1, 0.17):
        model = fourbar(
            costs={name: {"process": f"bore-{name}"} for name in factors},
            processes=processes,
            measures={"rocker-angle": {"angle": "rocker", "limit": f"±{limit} deg"}},
        )
        result = trunnion.allocate(model, steps=72, samples=0)
        halves = [[standard_tolerance(size, grade) / 2 for grade in grades] for size in LENGTHS]
        costs = [[factor * cost for cost in grades.values()] for factor in factors.values()]
        kept = [
            (sum(costs[i][k] for i, k in enumerate(taken)), taken)
            for taken in product(range(6), repeat=4)
            if np.max(np.abs(slopes()) @ [halves[i][k] for i, k in enumerate(taken)]) <= np.radians(limit) * (1 + 1e-9)
        ]
        cost, taken = min(kept)
        assert float(result["cost_total"]) == pytest.approx(cost, rel=1e-12)
        if sum(one[0] < cost + 1e-9 for one in kept) == 1:
            names = [f"IT{list(grades)[k]}" for k in taken]
            assert result["choice"].sel(parameter=[f"dimensions.l{i}" for i in range(1, 5)]).values.tolist() == names


def test_plays_are_bought() -> None:
    """A play has the loads of its pin under a unit load at the measure; none stated is a start like any other."""
    model = trunnion.read(EXAMPLES / "piston-by-cost.yaml")
    result = trunnion.allocate(model, samples=0)
    expected = [0.0567249, 0.03482455, 0.01382013, 0.01382013, 0.0181095]
    # a gap of 1e-6 leaves half widths open by 1e-3; the solver comes to some 1e-6
    assert 1e3 * result["tolerance"].values == pytest.approx(expected, rel=1e-5)
    none = model.with_values({f"joints.{joint}.pin.clearance": 0.0 for joint in "OPQ"})
    again = trunnion.allocate(none, samples=0)
    assert again["tolerance"].values == pytest.approx(result["tolerance"].values, rel=1e-9)
    assert again["tolerance_before"].values[2:] == pytest.approx([0, 0, 0])
    assert float(result["searched_upper"][0]) == pytest.approx(1e-4, rel=1e-3)


def test_exact_worst_case() -> None:
    """The worst case of the mechanism itself is at the limit, and costs a little more than that of first order."""
    model = trunnion.read(EXAMPLES / "toleranced-fourbar.yaml")
    linear, exact = (trunnion.allocate(model, steps=72, samples=0, exact=one) for one in (False, True))
    worst = max(-float(exact["searched_lower"][0]), float(exact["searched_upper"][0]))
    assert worst == pytest.approx(LIMIT, rel=2e-6)
    assert worst <= LIMIT * (1 + 1e-6)
    assert 0 < float(exact["cost_total"] - linear["cost_total"]) < 0.05
    assert not findings(exact, "warning")


def test_yield() -> None:
    """The share of samples is the one asked for, within its interval, and costs less than the worst case."""
    model = trunnion.read(EXAMPLES / "toleranced-fourbar.yaml")
    result = trunnion.allocate(model, criterion="yield", target=0.95, steps=36, samples=4000)
    low, share, high = (float(result[f"yield_all{end}"]) for end in ("_low", "", "_high"))
    assert low <= 0.95 <= high
    assert share == float(result["trial_yield"][result["trial_cost"] == result["cost_total"]][0])
    assert float(result["cost_total"]) < 12.0
    t = dimensions(result) * 1e-3
    drawn = np.random.default_rng(4).standard_normal((20_000, 4)) * t / 3
    kept = np.mean(np.max(np.abs(drawn @ slopes(36).T), axis=1) <= LIMIT)
    assert kept == pytest.approx(0.95, abs=0.012)


def test_the_margins_tried_are_what_the_limit_has() -> None:
    """Room over standard deviation, which a cap by what is not bought keeps below the margin asked for."""
    costs = {name: {"model": "power", "B": 1, "k": 1, "unit": "mm", "least": "0.02 mm"} for name in ("l1", "l3")}
    model = fourbar(costs=costs, measures={"at": {"angle": "rocker", "at": "90 deg", "limit": "±0.02 deg"}})
    result = trunnion.allocate(model, criterion="yield", target=0.95, samples=2000)
    assert float(result["used"][0]) == pytest.approx(1.0, abs=1e-6)
    margin = float(result["trial_margin"][np.argmin(abs(result["trial_cost"].values - float(result["cost_total"])))])
    sigma = np.linalg.norm(slopes(4)[1] * 1e-3 * dimensions(result) / 3)
    assert margin * sigma == pytest.approx(np.radians(0.02), rel=1e-6)
    assert margin == pytest.approx(float(result["yield_margin"][0]), rel=1e-9)


def test_options_as_stated_cost_what_keeps_them() -> None:
    """A half width between two options is bought as the cheapest that keeps it; one below all has no cost."""
    data = trunnion.read(EXAMPLES / "fourbar-by-grades.yaml").data()
    paid = {"±0.02 mm": 11.8, "±0.03 mm": 4.2, "±0.2 mm": 1.5, "±0.007 mm": np.nan}
    for stated, cost in paid.items():
        model = Mechanism(**{**data, "tolerances": {**data["tolerances"], "l2": stated}})
        result = trunnion.allocate(model, steps=12, samples=0)
        assert float(result["cost_before"].sel(parameter="dimensions.l2")) == pytest.approx(cost, nan_ok=True)
        grades = 3 * 6.2  # IT8 of 70, 90 and 100 mm is 46, 54 and 54 µm
        assert float(result["cost_total_before"]) == pytest.approx(cost + grades + 4 * 1.6, nan_ok=True)


def test_several_limits_have_one_margin() -> None:
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

    def cost(t: Any) -> float:
        return float(np.sum(b / t**0.45))

    def margins(t: Any) -> Any:
        return 1 / np.linalg.norm(s * t / 3, axis=1)

    found, margin = dimensions(result), float(result["yield_margin"][0])
    assert result["yield_margin"].values[1] == margin
    assert np.min(margins(found)) == pytest.approx(margin, rel=1e-6)
    sigma = s * found / 3
    both = multivariate_normal(np.zeros(2), sigma @ sigma.T)
    assert float(both.cdf(np.ones(2), lower_limit=-np.ones(2))) == pytest.approx(target, abs=3e-4)
    room = {"type": "ineq", "fun": lambda t: margins(t) - margin}
    best = minimize(cost, found * 0.9, constraints=room, bounds=[(1e-4, 1.0)] * 4, method="SLSQP", tol=1e-10)
    assert cost(found) == pytest.approx(best.fun, rel=1e-6)


def test_a_yield_that_is_to_be_sure_has_it_at_the_lower_end_of_fresh_samples() -> None:
    model = trunnion.read(EXAMPLES / "piston-by-cost.yaml")
    plain, sure = (
        trunnion.allocate(model, criterion="yield", target=0.95, steps=12, samples=2000, sure=each)
        for each in (False, True)
    )
    assert float(plain["yield_checked_low"]) < 0.95 <= float(plain["yield_checked_high"])
    assert float(sure["yield_checked_low"]) >= 0.95
    assert float(sure["cost_total"]) > float(plain["cost_total"])
    with pytest.raises(MechanismError, match="only a yield can be sure"):
        trunnion.allocate(model, sure=True)


def test_written_and_read_again(tmp_path: Path) -> None:
    """The file holds what was verified."""
    model = trunnion.read(EXAMPLES / "fourbar-by-grades.yaml")
    result = trunnion.allocate(model, steps=36, samples=500)
    model.with_tolerances(half_widths(result)).write(tmp_path / "bought.yaml")
    again = trunnion.tolerance(trunnion.read(tmp_path / "bought.yaml"), samples=500, steps=36)
    for key in ("worst_case_upper", "searched_upper", "rss", "mean", "yield", "deviation"):
        np.testing.assert_array_equal(again[key].values, result[key].values)


def test_bounds_of_a_figure() -> None:
    """at_least and at_most leave room to one side each: from the nominal figure."""
    course = trunnion.tolerance(fourbar(), ["rotation:D"], ["linear"], at="60 deg", steps=4)
    nominal = float(course["nominal"][0])
    bounds = {"at_most": f"{np.degrees(nominal) + 0.1} deg", "at_least": f"{np.degrees(nominal) - 3} deg"}
    model = fourbar(measures={"turn": {"rotation": "D", "at": "60 deg", **bounds}})
    result = trunnion.allocate(model, samples=0)
    assert np.abs(slopes()[12]) @ dimensions(result) * 1e-3 == pytest.approx(LIMIT, rel=1e-7)


def test_lopsided_tolerances_take_room() -> None:
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


@pytest.mark.spread(6)
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
def test_measures_keep_their_limits(measure: dict[str, str]) -> None:
    """The worst case that is found on the mechanism keeps the limits, to second order, and samples do."""
    model = fourbar(measures={"m": measure})
    result = trunnion.allocate(model, steps=24, samples=300)
    assert result.attrs["found"]
    assert not [one for one in findings(result, "error") if "beyond" in one]
    assert float(result["yield"][0]) > 0.99
    assert 0.2 < float(result["used"][0]) <= 1 + 1e-6


def test_nothing_keeps_the_limits() -> None:
    costs = {f"l{i}": {"model": "power", "B": 1, "k": 1, "unit": "mm", "least": "0.02 mm"} for i in range(1, 5)}
    model = fourbar(costs=costs, measures={"rocker-angle": {"angle": "rocker", "limit": "±0.05 deg"}})
    result = trunnion.allocate(model, steps=72)
    assert not result.attrs["found"]
    assert half_widths(result) == {}
    (said,) = findings(result, "error")
    worst = np.max(np.abs(slopes()).sum(axis=1)) * 2e-5
    assert f"the deviation is +{np.degrees(worst):.6g}° at 20°" in said
    assert "measures.rocker-angle" in said
    assert "the limit +0.05° is infeasible" in said


def test_a_nominal_figure_beyond_its_bounds() -> None:
    result = trunnion.allocate(fourbar(measures={"t": {"effort": "A", "as": "maximum", "at_most": "1 N m"}}), steps=12)
    (said,) = findings(result, "error")
    assert said.startswith("measures.t: the nominal value is ")
    assert said.endswith("N m, at_most is 1 N m: tolerances cannot correct that")


def test_what_cannot_be_asked() -> None:
    model = trunnion.read(EXAMPLES / "toleranced-fourbar.yaml")
    for options, text in (
        ({"measures": ["torque"]}, "none of the measures torque has a limit"),
        ({"criterion": "best"}, "there is no criterion 'best'"),
        ({"choice": "both"}, "there is no choice 'both'"),
        ({"criterion": "yield", "target": 1.0}, "a yield of 1 is not possible"),
        ({"samples": -1}, "-1 samples"),
        ({"curve": 1}, "a curve of 1 points"),
        ({"measures": ["nowhere"]}, "none of the measures nowhere has a limit"),
    ):
        with pytest.raises(MechanismError, match=text):
            trunnion.allocate(model, **options)
    with pytest.raises(MechanismError, match="no continuous choice"):
        trunnion.allocate(trunnion.read(EXAMPLES / "fourbar-by-grades.yaml"), choice="continuous")
    with pytest.raises(MechanismError, match="no tolerance has a cost"):
        trunnion.allocate(fourbar(costs={}))
    with pytest.raises(MechanismError, match="no measure is stated"):
        trunnion.allocate(fourbar(measures={}))


def test_what_no_limit_bounds() -> None:
    """A tolerance that does nothing to the measures would be bought without end."""
    costs = {**trunnion.read(EXAMPLES / "toleranced-fourbar.yaml").data()["costs"]}
    costs["A.friction.coefficient"] = {"model": "power", "B": 1, "k": 1}
    result = trunnion.allocate(fourbar(costs=costs), steps=12, samples=0)
    assert findings(result, "error") == [
        "costs.joints.A.friction.coefficient: no limit bounds this tolerance, and wider is cheaper"
    ]
    costs["A.friction.coefficient"]["most"] = 0.05
    assert trunnion.allocate(fourbar(costs=costs), steps=12, samples=0).attrs["found"]


def test_costs_that_are_not_taken() -> None:
    """A play that a number with a price changes is not bought by that number."""
    data = fourbar().data()
    joints = {**data["joints"]}
    joints["B"] = {**joints["B"], "pin": {"radius": "6 mm ± 5 um", "hole_radius": "6.02 mm ± 5 um"}}
    costs = {**data["costs"], "joints.B.pin.radius": {"model": "power", "B": 1, "k": 1, "unit": "mm"}}
    result = trunnion.allocate(fourbar(joints=joints, costs=costs), steps=24, samples=0)
    (said,) = [one for one in findings(result, "warning") if "is not allocated" in one]
    assert "it changes the play of B" in said
    assert result["bought"].sel(parameter="joints.B.pin.radius") == 0
    assert float(result["used"][0]) == pytest.approx(1)


def test_run_outs_and_seats_stay_as_they_are() -> None:
    """A run-out that points anywhere has no middle; a pin whose seat is given has no play to choose."""
    data = fourbar().data()
    tolerances = {
        **data["tolerances"],
        "joints.B.misalignment.offset": {"limits": "+0.01/0 mm", "direction": "uniform"},
    }
    joints = {**data["joints"]}
    joints["B"] = {**joints["B"], "misalignment": {"offset": "0 mm"}}
    joints["C"] = {**joints["C"], "pin": {"clearance": "10 um"}, "seat": {"xi": "30 deg"}}
    costs = {**data["costs"], **dict.fromkeys(("B.misalignment.offset", "C.clearance"), data["costs"]["l1"])}
    result = trunnion.allocate(fourbar(joints=joints, costs=costs, tolerances=tolerances), steps=24, samples=0)
    told = " ".join(findings(result, "warning"))
    assert "is not allocated: its direction is arbitrary" in told
    assert "is not allocated: its pin has a stated seat" in told
    # what it does stays, and the others keep their limits with it
    assert result["bought"].sel(parameter="joints.B.misalignment.offset") == 0
    assert float(result["used"][0]) == pytest.approx(1)
    assert float(result["cost_total"]) > 16.6


def test_curve_of_cost_over_accuracy() -> None:
    result = trunnion.allocate(trunnion.read(EXAMPLES / "toleranced-fourbar.yaml"), steps=36, samples=0, curve=3)
    assert result["trade_off_factor"].values == pytest.approx([0.5, 1, 2])
    # of a power model without a constant part the cost goes with the power of the limits
    assert result["trade_off_cost"].values == pytest.approx(float(result["cost_total"]) * np.array([2, 1, 0.5]) ** 0.45)
    assert result["trade_off_tolerance"].values[2, :4] == pytest.approx(2 * result["tolerance"].values[:4])


def test_the_curve_of_a_yield_passes_through_the_answer() -> None:
    """Samples ask for another margin than normal deviations do: the curve is of that one."""
    model = trunnion.read(EXAMPLES / "toleranced-fourbar.yaml")
    result = trunnion.allocate(model, ["rocker-angle"], "yield", 0.9, steps=12, samples=500, curve=3)
    costs = result["trade_off_cost"].values
    assert costs[1] == float(result["cost_total"])
    assert list(costs) == sorted(costs, reverse=True)
    assert float(result["yield_checked_high"]) >= 0.9
    plain = trunnion.allocate(model, ["rocker-angle"], "yield", 0.9, steps=12, samples=0, curve=3)
    ratio = costs / plain["trade_off_cost"].values
    assert ratio == pytest.approx(np.full(3, ratio[1]), rel=2e-2)  # as much dearer everywhere
