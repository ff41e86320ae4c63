"""Tolerances to first order, worst cases and RSS: known numbers, closed forms of their own, derivatives, corners."""

import itertools

import numpy as np
import pytest
from scipy import stats

import trunnion
from toleranced import CASES, FOURBAR, fourbar, fourbar_angle, rssr, sampler, slopes
from trunnion.statistics.distributions import uniforms
from trunnion.studies.tolerance.linear import study

FAST = ("linear", "worst-case")
MM = 1e3  # of a derivative by a length, m⁻¹ in mm⁻¹


def sensitivities(result, measure=0):
    paths = [str(path) for path in result["parameter"].values]
    return dict(zip(paths, result["sensitivity"].values[measure].tolist(), strict=True))


@pytest.fixture(scope="module")
def results():
    return {name: trunnion.tolerance(build_(), methods=FAST) for name, (build_, _, _) in CASES.items()}


@pytest.mark.parametrize(
    ("name", "factor", "known"),
    [
        ("clutch", 1 / MM, (-0.2078770, -0.4141963, 0.2063193)),
        ("four-bar", 1 / MM, (0.013654, -0.013401, -0.015623, 0.006323)),
        ("slider-crank", 1.0, (0.307945, 1.024295, 0.221766)),
        ("RSSR", 1 / MM, (-0.00714601, -0.01955441, 0.01187232, 0.01702515, 0.26229468, -0.00948836, 0.00611075)),
    ],
)
def test_sensitivities(results, name, factor, known):
    """rad/mm and mm/mm, of an angle rad/rad, to the digits that are known."""
    digits = max(len(f"{number}".partition(".")[2]) for number in known)
    found = sensitivities(results[name])
    scaled = [slope * (1.0 if path.endswith("alpha") else factor) for path, slope in found.items()]
    np.testing.assert_allclose(scaled, known, rtol=0, atol=0.51 * 10.0**-digits)


def test_one_way_clutch(results):
    """φ = 7.0183898°, worst case 0.5340°, RSS 0.3167°, and from 6.4622° to 7.5333° on the mechanism itself."""
    found = results["clutch"]
    degrees = {name: np.degrees(found[name].item()) for name in ("nominal", "worst_case_upper", "rss")}
    assert degrees["nominal"] == pytest.approx(7.0183898, abs=5e-8)
    assert degrees["worst_case_upper"] == pytest.approx(0.5340, abs=5e-5)
    assert degrees["rss"] == pytest.approx(0.3167, abs=5e-5)
    assert found["worst_case_lower"].item() == -found["worst_case_upper"].item()
    low, high = (np.degrees((found["nominal"] + found[f"searched_{end}"]).item()) for end in ("lower", "upper"))
    assert low == pytest.approx(6.4622, abs=5e-5)
    assert high == pytest.approx(7.5333, abs=5e-5)


def test_clearance_of_the_spatial_crank_rocker():
    """0.044402° by the formula, 0.044448° on the mechanism itself, the pin shifted and leaning in its hole."""
    pin = {"radius": "10 mm", "hole_radius": "10.02 mm", "length": "20 mm"}
    found = trunnion.tolerance(rssr(pin, {}), methods=FAST)
    assert np.degrees(found["worst_case_upper"].item()) == pytest.approx(0.044402, abs=5e-7)
    ends = np.degrees([-found["searched_lower"].item(), found["searched_upper"].item()])
    assert max(ends) == pytest.approx(0.044448, abs=5e-7)
    assert np.mean(ends) == pytest.approx(0.044402, abs=5e-7)


@pytest.mark.parametrize("name", CASES)
def test_derivatives_are_exact(results, name):
    _, of, at = CASES[name]
    found = sensitivities(results[name])
    assert [path.removeprefix("dimensions.") for path in found] == list(at)
    np.testing.assert_allclose(list(found.values()), slopes(of, at, 3e-5), rtol=1e-8, atol=1e-8)
    assert results[name]["nominal"].item() == pytest.approx(of(**at), rel=1e-14)


@pytest.mark.parametrize("name", CASES)
def test_sums_of_first_order(results, name):
    """|S| t of each, their sum, the root of the sum of their squares; shares that add up to one."""
    result = results[name]
    _, of, at = CASES[name]
    changes = np.abs(slopes(of, at, 3e-5)) * result["parameter_upper"].values
    np.testing.assert_allclose(result["contribution_worst_case"].values[0], changes, rtol=1e-8, atol=1e-15)
    assert result["worst_case_upper"].item() == pytest.approx(np.sum(changes), rel=1e-8)
    assert result["worst_case_lower"].item() == pytest.approx(-np.sum(changes), rel=1e-8)
    assert result["rss"].item() == pytest.approx(np.linalg.norm(changes), rel=1e-8)
    np.testing.assert_allclose(
        result["contribution_rss"].values[0], changes**2 / np.sum(changes**2), rtol=1e-8, atol=1e-15
    )
    assert float(result["contribution_rss"].sum()) == pytest.approx(1, abs=1e-14)
    assert float(result["contribution_variance"].sum()) == pytest.approx(1, abs=1e-14)
    assert result["deviation_linear"].item() == pytest.approx(result["rss"].item() / 3, rel=1e-12)  # C_p = 1
    assert result["shift_linear"].item() == 0


@pytest.mark.parametrize("name", CASES)
def test_worst_corner(results, name):
    """The best of all corners by the closed form; and run again there, it gives the number that was found."""
    result = results[name]
    _, of, at = CASES[name]
    values, widths = np.array(list(at.values())), result["parameter_upper"].values
    corners = [values + np.array(sign) * widths for sign in itertools.product((-1, 1), repeat=len(at))]
    changes = [of(*corner) - of(*values) for corner in corners]
    assert result["searched_upper"].item() == pytest.approx(max(changes), rel=1e-11)
    assert result["searched_lower"].item() == pytest.approx(min(changes), rel=1e-11)
    for end in ("lower", "upper"):
        corner = result[f"corner_{end}"].values[0]
        assert np.all(np.abs(np.abs(corner - values) - widths) < 1e-15)
        assert of(*corner) - of(*values) == pytest.approx(result[f"searched_{end}"].item(), rel=1e-11)


def test_over_the_whole_turn():
    """A measure without a place: the course of derivatives, the place of the worst case, and what is found there."""
    found = trunnion.tolerance(fourbar(measures={"angle": {"angle": "rocker"}}), methods=FAST, steps=72)
    turn = np.radians(found["drive"].values)
    steep = np.array([slopes(lambda i=i, **at: fourbar_angle(**at, crank=turn[i]), FOURBAR, 3e-5) for i in range(72)])
    np.testing.assert_allclose(found["curve_sensitivity"].values[0], steep.T, rtol=1e-7, atol=1e-7)
    worst = 5e-5 * np.sum(np.abs(steep), axis=1)
    np.testing.assert_allclose(found["curve_worst_case_upper"].values[0], worst, rtol=1e-7)
    np.testing.assert_allclose(found["curve_worst_case_lower"].values[0], -worst, rtol=1e-7)
    np.testing.assert_allclose(found["curve_rss"].values[0], 5e-5 * np.linalg.norm(steep, axis=1), rtol=1e-7)
    np.testing.assert_allclose(found["curve_deviation"].values[0], 5e-5 / 3 * np.linalg.norm(steep, axis=1), rtol=1e-7)

    def worst_at(place):
        return 5e-5 * float(np.sum(np.abs(slopes(lambda **at: fourbar_angle(**at, crank=place), FOURBAR, 3e-5))))

    place = np.radians(found["place"].item())  # between the positions
    assert place == pytest.approx(turn[np.argmax(worst)], abs=turn[1])
    assert found["worst_case_upper"].item() == pytest.approx(worst_at(place), rel=1e-7)
    assert max(worst_at(place + step) for step in (-0.01, -1e-4, 1e-4, 0.01)) <= worst_at(place) * (1 + 1e-9)
    corners = [[v + s * 5e-5 for v, s in zip(FOURBAR.values(), sign, strict=True)]
               for sign in itertools.product((-1, 1), repeat=4)]  # fmt: skip
    many = np.linspace(0, 2 * np.pi, 3601)
    nominal = fourbar_angle(*FOURBAR.values(), crank=many)
    changes = [fourbar_angle(*corner, crank=many) - nominal for corner in corners]
    assert found["searched_upper"].item() == pytest.approx(np.max(changes), rel=1e-6)
    assert found["searched_lower"].item() == pytest.approx(np.min(changes), rel=1e-6)


@pytest.mark.parametrize(("rule", "ends"), [("minimum", (np.max, np.min)), ("maximum", (np.min, np.max))])
def test_worst_case_of_the_least_and_the_largest_deviation(rule, ends):
    """At a place the deviation is within ±Σ T |S|, whatever the steps. The least of all may fall as far as the widest
    of these reaches down, and can rise no farther than the narrowest reaches up; the largest the other way up."""
    measures = {"error": {"transmission_error": "D", "as": rule}}
    found = trunnion.tolerance(fourbar(measures=measures), methods=["linear", "worst-case"], steps=7)

    def worst(turn):
        return 5e-5 * np.sum(np.abs(slopes(lambda **at: fourbar_angle(**at, crank=turn), FOURBAR, 3e-5)), axis=0)

    for key, end, sign in zip(("worst_case_lower", "worst_case_upper"), ends, (-1, 1), strict=True):
        turn = np.linspace(0.0, 2 * np.pi, 4001)
        for _ in range(3):  # closer and closer to where the course is widest, or narrowest, which may be a corner
            place = turn[np.argmax(worst(turn) * (1 if end is np.max else -1))]
            turn = place + np.linspace(-1.0, 1.0, 801) * (turn[1] - turn[0])
        assert found[key].item() == pytest.approx(sign * end(worst(turn)), rel=1e-6)


T = 5e-5
DISTRIBUTIONS = {
    "normal": ({}, stats.norm(0, T / 3)),
    "normal, cp": ({"cp": 1.5}, stats.norm(0, T / 4.5)),
    "normal, cpk": ({"cp": 1.33, "cpk": 1.0}, stats.norm(T / 3 / 1.33 * 3 * 0.33, T / 3 / 1.33)),
    "normal, shift": ({"cp": 1.33, "cpk": 1.0, "shift": "-0.01 mm"}, stats.norm(-1e-5, T / 3 / 1.33)),
    "uniform": ({"distribution": "uniform"}, stats.uniform(-T, 2 * T)),
    "triangular": ({"distribution": "triangular", "mode": "0.02 mm"}, stats.triang(0.7, -T, 2 * T)),
    "truncated": ({"distribution": "truncated", "cp": 0.5}, stats.truncnorm(-1.5, 1.5, 0, T / 1.5)),
    "truncated, shift": (
        {"distribution": "truncated", "cp": 0.4, "shift": "0.0125 mm"},
        stats.truncnorm(-1.5, 0.9, T / 4, T / 1.2),
    ),
    "beta": ({"distribution": "beta", "alpha": 2, "beta": 3}, stats.beta(2, 3, -T, 2 * T)),
}


@pytest.mark.parametrize("name", DISTRIBUTIONS)
def test_moments_of_a_distribution(name):
    """Mean and standard deviation carried by the derivative, and every sample, against SciPy's distributions."""
    keys, law = DISTRIBUTIONS[name]
    mechanism = fourbar(tolerances={"l3": {"limits": "±0.05 mm"} | keys})
    found = trunnion.tolerance(mechanism, methods=["linear"])
    steep = slopes(fourbar_angle, FOURBAR, 3e-5)[2]
    assert found["parameter_deviation"].item() == pytest.approx(law.std(), rel=1e-8)
    assert found["parameter_shift"].item() == pytest.approx(law.mean(), rel=1e-9, abs=1e-18)
    assert found["deviation_linear"].item() == pytest.approx(abs(steep) * law.std(), rel=1e-8)
    assert found["shift_linear"].item() == pytest.approx(steep * law.mean(), rel=1e-8, abs=1e-15)
    u = uniforms(2, 0, 1, 800)
    angles = sampler(study(mechanism)).figures(u)["figure"][0]
    np.testing.assert_allclose(angles, fourbar_angle(**FOURBAR | {"l3": 0.09 + law.ppf(u[0])}), rtol=0, atol=1e-11)


def test_limits_to_one_side():
    mechanism = fourbar(tolerances={"l2": "+0.04/-0.01 mm", "l4": "+0.03/+0.01 mm"})
    found = trunnion.tolerance(mechanism, methods=FAST)
    _, two, _, four = slopes(fourbar_angle, FOURBAR, 3e-5)
    assert two < 0 < four
    assert found["worst_case_upper"].item() == pytest.approx(-1e-5 * two + 3e-5 * four, rel=1e-8)
    assert found["worst_case_lower"].item() == pytest.approx(4e-5 * two + 1e-5 * four, rel=1e-8)
    assert found["rss"].item() == pytest.approx(np.hypot(2.5e-5 * two, 1e-5 * four), rel=1e-8)
    assert found["shift_linear"].item() == pytest.approx(1.5e-5 * two + 2e-5 * four, rel=1e-8)
    np.testing.assert_allclose(found["corner_upper"].values[0], [0.03 - 1e-5, 0.07 + 3e-5], rtol=1e-14)


def test_number_that_follows_another():
    """The length of the coupler by a dimension, and where its pin is drilled from there: both move the pin."""
    mechanism = fourbar(tolerances={"l3": "±0.05 mm", "links.coupler.points.C.x": "±0.01 mm"})
    found = trunnion.tolerance(mechanism, methods=FAST)
    steep = slopes(fourbar_angle, FOURBAR, 3e-5)[2]
    np.testing.assert_allclose(found["sensitivity"].values[0], [steep, steep], rtol=1e-8)
    assert found["worst_case_upper"].item() == pytest.approx(-6e-5 * steep, rel=1e-8)
    least = fourbar_angle(**(FOURBAR | {"l3": 0.09 - 6e-5})) - fourbar_angle(**FOURBAR)
    assert found["searched_upper"].item() == pytest.approx(least, rel=1e-11)


def test_play_of_a_fit():
    """Hole and pin with limits of their own: the worst case has the largest play, the scatter E ρ² of both radii."""
    pin = {"radius": "4.99 mm ± 0.003 mm", "hole_radius": "5 mm ± 0.005 mm"}
    joints = fourbar().data()["joints"]
    found = trunnion.tolerance(fourbar(tolerances={}, joints=joints | {"C": {**joints["C"], "pin": pin}}), methods=FAST)
    at = [str(name) for name in found["parameter"].values]
    assert at == ["joints.C.pin.radius", "joints.C.pin.hole_radius", "joints.C.clearance"]
    steep = abs(slopes(fourbar_angle, FOURBAR, 3e-5)[2])
    load = found["sensitivity"].values[0, 2]
    assert load == pytest.approx(steep, rel=1e-8)  # the same force in the coupler
    assert found["worst_case_upper"].item() == pytest.approx(18e-6 * load, rel=1e-12)
    square = 10e-6**2 + (3e-6 / 3) ** 2 + (5e-6 / 3) ** 2
    assert found["deviation_linear"].item() == pytest.approx(load * np.sqrt(square / 4), rel=1e-12)
    assert found["parameter_upper"].values[2] == pytest.approx(18e-6, rel=1e-12)


FINE = np.linspace(0, 2 * np.pi, 7200, endpoint=False)
CURVES = {
    "path": {"path_error": "coupler.C"},
    "place": {"path_error": "coupler.C", "at": "60 deg"},
    "rms": {"path_error": "coupler.C", "as": "rms"},
    "error": {"transmission_error": "D"},
    "swing": {"transmission_error": "D", "as": "peak-to-peak"},
    "stroke": {"stroke": "D"},
    "height": {"point": "coupler.C", "axis": "y", "as": "maximum"},
}


def of_courses(sizes):
    """Least and largest deviation of every figure above of one four-bar from the nominal one."""
    angle, nominal = (fourbar_angle(*one, crank=FINE) for one in (sizes, FOURBAR.values()))
    pin, meant = sizes[0] + sizes[3] * np.exp(1j * angle), FOURBAR["l1"] + FOURBAR["l4"] * np.exp(1j * nominal)
    away, turned = np.abs(pin - meant), angle - nominal
    stroke, height = np.ptp(angle) - np.ptp(nominal), np.max(pin.imag) - np.max(meant.imag)
    figures = {"path": np.max(away), "place": away[1200], "rms": np.sqrt(np.mean(away**2)), "swing": np.ptp(turned)}
    found = {
        name: (float(value), float(value)) for name, value in (figures | {"stroke": stroke, "height": height}).items()
    }
    return found | {"error": (float(np.min(turned)), float(np.max(turned)))}


def test_worst_case_of_figures_of_a_course():
    """Found on the mechanism: the same as the best of all corners by the closed form."""
    found = trunnion.tolerance(fourbar(measures=CURVES), methods=FAST, steps=180)
    signs = itertools.product((-1, 0, 1), repeat=4)
    corners = [of_courses([v + s * T for v, s in zip(FOURBAR.values(), sign, strict=True)]) for sign in signs]
    for name in CURVES:
        at = found.sel(measure=name)
        assert at["searched_upper"].item() == pytest.approx(max(one[name][1] for one in corners), rel=1e-4), name
        assert at["searched_lower"].item() == pytest.approx(min(one[name][0] for one in corners), rel=1e-4, abs=1e-15)
        if name != "rms":  # of which first order takes the largest instead
            assert at["worst_case_upper"].item() == pytest.approx(at["searched_upper"].item(), rel=0.01)
