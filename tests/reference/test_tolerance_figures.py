"""Figures of a study at their edge: what first order cannot know, what does not exist, what no model may have."""

import json

import numpy as np
import pytest

import trunnion
from mechanisms_parts import joined
from toleranced import FOURBAR, fourbar, fourbar_angle, slider_crank
from trunnion import Mechanism, tolerance
from trunnion.studies.allocation.allocate import half_widths

ERROR = {"transmission_error": "D"}
PATH = {"path_error": "coupler.C"}


def studied(measure, methods=("linear", "worst-case", "monte-carlo")):
    model = fourbar(measures={"it": measure})
    return tolerance(model, methods=methods, samples=1000, steps=36, jobs=1).isel(measure=0)


@pytest.mark.parametrize("statistic", ["maximum", "mean"])
def test_band_of_a_transmission_error_is_about_nominal(statistic):
    """Half of the samples lie within ±0.6745 σ of no error, at every position, whatever figure is made of them."""
    found = studied({**ERROR, "as": statistic})
    quarter = 0.6745 * found.curve_deviation.values
    assert found.band.sel(quantile=0.25).values == pytest.approx(-quarter, rel=0.2)
    assert found.band.sel(quantile=0.75).values == pytest.approx(quarter, rel=0.2)


@pytest.mark.parametrize(
    "measure", [{**PATH, "as": one} for one in ("mean", "place-of-maximum")] + [{**ERROR, "as": "rms"}]
)
def test_first_order_of_what_has_no_derivative(measure):
    """It says that it has none; a worst case is found all the same, no less than any sample."""
    found = studied(measure)
    for name in ("worst_case_upper", "rss", "deviation_linear"):
        assert np.isnan(found[name])
    if not measure["as"].startswith("place"):
        assert found.searched_upper >= found.most - found.nominal - 1e-9 * abs(found.most)
        assert found.searched_lower <= found.least - found.nominal + 1e-9 * abs(found.most)


def test_figure_that_does_not_exist():
    """No turning back between 10 and 20°: no nominal figure, no derivative, no worst case, and it is said."""
    found = studied({"dead_centre": "C", "over": ["10 deg", "20 deg"]})
    for name in ("nominal", "worst_case_upper", "deviation_linear", "searched_lower", "searched_upper", "mean"):
        assert np.isnan(found[name]), name
    assert found["yield"] == 0


def test_nominal_outside_its_limits_is_no_worst_case():
    """Limits far from nominal at which nothing goes together: the nominal mechanism is not among the mechanisms."""
    model = fourbar(tolerances={"l1": "+0.9/+0.8 m"}, measures={"it": {"angle": "rocker"}})
    found = tolerance(model, methods=("worst-case",), steps=12)
    assert np.all(np.isnan([found.searched_lower, found.searched_upper]))


def told(result, key):
    return dict(zip(result.measure.values.tolist(), json.loads(result.attrs[key]), strict=True))


WIDE = 0.05e-3 / 3  # σ of each length


def correlated(rho, methods=("linear",), **options):
    rows = [{"of": ["l2", "l3"], "coefficient": rho}, {"of": ["l3", "l4"], "coefficient": -rho / 2}]
    return trunnion.tolerance(fourbar(correlations=rows, **options), methods=methods, samples=4000)


def drawn(rho, samples=400_000):
    """Deviations of the four lengths, and the angle of each four-bar by its closed form."""
    matrix = np.eye(4)
    matrix[1, 2] = matrix[2, 1] = rho
    matrix[2, 3] = matrix[3, 2] = -rho / 2
    off = WIDE * np.linalg.cholesky(matrix) @ np.random.default_rng(3).standard_normal((4, samples))
    return off, fourbar_angle(*(value + row for value, row in zip(FOURBAR.values(), off, strict=True)))


@pytest.mark.parametrize("rho", [0.6, -0.7])
def test_shares_are_covariances_with_the_measure(rho):
    """Of samples: a number's part is its slope times its covariance with the angle; together the variance."""
    found = correlated(rho)
    off, angle = drawn(rho)
    slopes = found["sensitivity"].values[0]
    wanted = slopes * np.array([np.cov(row, angle)[0, 1] for row in off]) / np.var(angle)
    np.testing.assert_allclose(found["contribution_variance"].values[0], wanted, atol=5e-3)
    assert found["contribution_variance"].sum().item() == pytest.approx(1, abs=1e-12)
    assert found["deviation_linear"].item() == pytest.approx(np.std(angle), rel=5e-3)


def test_shares_with_plays_and_directions_add_up():
    """Zones are independent of the lengths, and their share is that of the deviation with all correlations."""
    joints = fourbar().data()["joints"]
    joints["C"] |= {"pin": {"clearance": "0.03 mm"}}
    joints["B"] |= {"misalignment": {"offset": "0.02 mm", "offset_towards": "40 deg"}}
    tolerances = dict.fromkeys(FOURBAR, "±0.05 mm")
    tolerances |= {"joints.B.misalignment.offset": "±0.01 mm"}
    tolerances |= {"joints.B.misalignment.offset_towards": {"distribution": "direction"}}
    found = correlated(0.8, ("linear", "monte-carlo"), joints=joints, tolerances=tolerances)
    shares = found["contribution_variance"].isel(measure=0)
    assert shares.sum().item() == pytest.approx(1, abs=1e-12)
    plays = shares.sel(parameter="joints.C.clearance").item() * found["deviation_linear"].item() ** 2
    alone = found["sensitivity"].sel(parameter="joints.C.clearance").item() * 0.03e-3 / 2
    assert plays == pytest.approx(alone**2, rel=1e-9)
    assert found["deviation"].item() == pytest.approx(found["deviation_linear"].item(), rel=0.04)


def test_sizes_of_one_direction_go_with_each_other():
    """Two numbers make the offset that points anywhere: correlated they widen it, by samples as by first order."""
    data = slider_crank().data()
    data["dimensions"] |= {"e1": "0.2 mm", "e2": "0.1 mm"}
    data["joints"]["B"]["misalignment"] = {"offset": "e1 + e2", "offset_towards": "90 deg"}
    data["tolerances"] = {"e1": "±0.2 mm", "e2": "±0.1 mm"}
    data["tolerances"] |= {"joints.B.misalignment.offset_towards": {"distribution": "direction"}}
    data["correlations"] = [{"of": ["e1", "e2"], "coefficient": 0.95}]
    found = trunnion.tolerance(Mechanism(**data), methods=["linear", "monte-carlo"], samples=20_000)
    assert found["deviation_linear"].item() == pytest.approx(found["deviation"].item(), rel=0.02)
    assert found["contribution_variance"].sum().item() == pytest.approx(1, abs=1e-12)


NOMINAL = float(fourbar_angle(**FOURBAR))
COSTS = {name: {"model": "power", "B": 1, "k": 1, "unit": "mm"} for name in FOURBAR}


def missed(found):
    rows = json.loads(found.attrs["findings"])
    return [row for row in rows if row["severity"] == "error" and row["where"].startswith("measures.")]


def made(**limits):
    return {"measures": {"angle": {"angle": "rocker", "at": "60 deg", **limits}}}


@pytest.mark.parametrize(
    ("limits", "methods", "told"),
    [
        ({"limit": "±0.5 deg"}, ["linear", "worst-case", "monte-carlo"], ()),
        ({"limit": "±0.1 deg"}, ["linear", "worst-case"], ("worst case",)),
        ({"limit": "±0.05 deg"}, ["linear", "worst-case", "monte-carlo"], ("worst case", "yield", "Cpk")),
        ({"at_most": NOMINAL + 1e-3}, ["linear"], ("worst case", f"at most {np.degrees(NOMINAL + 1e-3):.7g}°")),
        ({"at_least": NOMINAL - 1e-2, "at_most": NOMINAL + 1e-2}, ["linear", "monte-carlo"], ()),
    ],
)
def test_what_is_outside_the_limits(limits, methods, told):
    rows = missed(trunnion.tolerance(fourbar(**made(**limits)), methods=methods, samples=2000))
    assert bool(rows) == bool(told)
    for word in told:
        assert word in rows[0]["what"]


def test_what_is_allocated_keeps_the_limit():
    mechanism = fourbar(**made(limit="±0.1 deg"), costs=COSTS)
    found = trunnion.allocate(mechanism, samples=0)
    assert found.attrs["found"]
    mended = mechanism.with_tolerances(half_widths(found))
    assert not missed(trunnion.tolerance(mended, methods=["linear", "worst-case"]))


@pytest.mark.parametrize(("asked", "fine"), [(0.9, True), (0.9999, False)])
def test_a_yield_that_is_asked_for_decides_alone(asked, fine):
    """The worst case is far outside either way."""
    mechanism = fourbar(**made(limit="±0.06 deg"))
    found = trunnion.tolerance(mechanism, samples=4000, target=asked)
    assert 0.95 < found["yield"].item() < 0.999
    assert bool(missed(found)) != fine
    assert missed(trunnion.tolerance(mechanism, samples=4000))


ROD = {
    "links": {
        "ground": {"points": {"O": [0, 0], "G": {"at": [0, "h"], "axis": [1, 0]}}},
        "rod": {"points": {"O": [0, 0], "P": ["a + b", 0]}},
        "block": {"points": {"P": [0, 0], "G": {"at": [0, 0], "axis": [1, 0]}}},
    },
    "joints": joined("ground -O- rod -P- block, ground =G= block"),
    "assembly": {"P": [0.09, 0.04]},
    "dimensions": {"a": "60 mm", "b": "40 mm", "h": "40 mm"},
    "measures": {"angle": {"angle": "rod"}},
}


def test_variance_based_indices_of_a_nearly_linear_measure():
    """sin(angle) = h/(a + b): with small tolerances the indices are those of first order, alone and in total."""
    mechanism = Mechanism(**ROD, tolerances={"a": 1e-6, "b": 2e-6, "h": 1e-6})
    result = tolerance(mechanism, methods=["linear", "quasi-monte-carlo", "sobol"], samples=20_000)
    share = result["contribution_variance"].values
    for order in ("first_order", "total_order"):
        assert result[order].values == pytest.approx(share, abs=0.01)
        assert np.all(result[f"{order}_low"].values <= share)
        assert np.all(share <= result[f"{order}_high"].values)
