"""A largest torque where a load begins at a place of the ram: the place of the crank there moves with the lengths.

A slider-crank without friction and mass has the torque T = F dx/dθ = F r |sin θ| x/(x − r cos θ), which falls once the
crank has passed the middle of its stroke; a load from the ram's place x₀ on makes it largest there. The angle of the
crank at x₀ is that of the triangle: cos θ = (x₀² + r² − l²)/(2 r x₀).
"""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pytest

import trunnion

FORCE, START, R, L = 50e3, 0.222, 0.03, 0.2
LIMIT = {"r": 0.02e-3, "l": 0.05e-3, "x0": 0.03e-3}
LOADS = {
    "at once": "F * between(S.slide, x0, x0 + 40 mm)",
    "ramp": "F * min(1, max(0, (S.slide - x0) / 0.2 mm + 1))",  # whole at the same place
    "obtuse": "F * min(1, max(0, 1 - (x0 - S.slide) / 15 mm))",  # nearly as a smooth curve through 72 positions
}


def model(load: str = "at once", **more: Any) -> trunnion.Mechanism:
    axis = {"at": [0, 0], "axis": [1, 0]}
    data: dict[str, Any] = {
        "trunnion": 1,
        "space": "planar",
        "gravity": [0, 0],
        "dimensions": {"r": "30 mm", "l": "200 mm", "x0": "222 mm", "F": "50 kN"},
        "links": {
            "frame": {"points": {"O": [0, 0], "S": axis}},
            "crank": {"points": {"O": [0, 0], "P": ["r", 0]}},
            "rod": {"points": {"P": [0, 0], "Q": ["l", 0]}},
            "ram": {"points": {"Q": [0, 0], "S": axis}},
        },
        "joints": {
            "O": {"type": "revolute", "links": ["frame", "crank"]},
            "P": {"type": "revolute", "links": ["crank", "rod"]},
            "Q": {"type": "revolute", "links": ["rod", "ram"]},
            "S": {"type": "prismatic", "links": ["frame", "ram"], "guide": {"length": "150 mm"}},
        },
        "drivers": {"O": {"speed": "60 rpm", "start": "180 deg"}},
        "loads": {"press": {"joint": "S", "resisting_force": LOADS[load], "only": "positive"}},
        "assembly": {"Q": ["170 mm", 0]},
        "measures": {"peak": {"effort": "O", "as": "maximum"}},
        "tolerances": {name: f"±{1e3 * limit:g} mm" for name, limit in LIMIT.items()},
    }
    return trunnion.Mechanism.model_validate({**data, **more})


def peak(r: Any = R, l: Any = L, x0: Any = START) -> Any:  # noqa: E741
    """The torque where the load begins, N m."""
    cosine = (x0**2 + r**2 - l**2) / (2 * r * x0)
    return FORCE * r * np.sqrt(1 - cosine**2) * x0 / (x0 - r * cosine)


def slope(name: str, step: float = 1e-6) -> float:
    at = {"r": R, "l": L, "x0": START}
    return float(peak(**{**at, name: at[name] + step}) - peak(**{**at, name: at[name] - step})) / (2 * step)


@pytest.mark.parametrize("steps", [72, 360])
@pytest.mark.parametrize("load", LOADS)
def test_the_peak_and_its_derivatives_are_those_where_the_load_begins(load: str, steps: int) -> None:
    result = trunnion.tolerance(model(load), methods=("linear", "worst-case"), steps=steps)
    assert float(result["nominal"][0]) == pytest.approx(peak(), rel=1e-5)
    assert float(trunnion.analyse(model(load), steps)["measure_figure"].sel(measure="peak")) == pytest.approx(
        peak(), rel=1e-5
    )
    crank = 2 * np.pi - np.arccos((START**2 + R**2 - L**2) / (2 * R * START))
    assert float(result["place"][0]) == pytest.approx(np.degrees(crank), abs=1e-5)
    for name in LIMIT:
        found = float(result["sensitivity"].sel(parameter=f"dimensions.{name}")[0])
        assert found == pytest.approx(slope(name), rel=1e-3), name
    corners = [
        peak(*(nominal + way * limit for nominal, way, limit in zip((R, L, START), ways, LIMIT.values(), strict=True)))
        for ways in product((-1, 1), repeat=3)
    ]
    assert float(result["searched_lower"][0]) == pytest.approx(min(corners) - peak(), rel=1e-3)
    assert float(result["searched_upper"][0]) == pytest.approx(max(corners) - peak(), rel=1e-3)


@pytest.mark.parametrize("engine", ["numpy", "compiled"])
def test_samples_have_the_scatter_of_a_monte_carlo_of_the_formula(engine: str) -> None:
    result = trunnion.tolerance(model(), methods=("linear", "monte-carlo"), samples=10_000, steps=72, engine=engine)
    rng = np.random.default_rng(3)
    drawn = peak(
        *(rng.normal(nominal, limit / 3, 200_000) for nominal, limit in zip((R, L, START), LIMIT.values(), strict=True))
    )
    assert float(result["deviation"][0]) == pytest.approx(drawn.std(), rel=0.03)
    assert float(result["mean"][0]) == pytest.approx(drawn.mean(), abs=0.05 * drawn.std())
    assert float(result["deviation_linear"][0]) == pytest.approx(drawn.std(), rel=0.02)
    assert "first_order.scatter_differs" not in {one.code for one in result.trunnion.findings}


def test_the_worst_case_found_includes_a_play() -> None:
    """Of the pin of rod and ram: carried by the rod it is a longer one, by the ram it moves where the load begins."""
    play = 0.04e-3
    joints = {**model().data()["joints"]}
    joints["Q"] = {**joints["Q"], "pin": {"radius": "20 mm", "clearance": "0.04 mm"}}
    result = trunnion.tolerance(model(joints=joints), methods=("linear", "worst-case"), steps=72)
    for key, sign in (("searched_lower", -1), ("searched_upper", 1)):
        found = [
            peak(R + one * LIMIT["r"], L + two * (LIMIT["l"] + rod), START + three * (LIMIT["x0"] + ram))
            for one, two, three in product((-1, 1), repeat=3)
            for rod, ram in ((play, 0.0), (0.0, play))
        ]
        worst = sign * max(sign * (value - peak()) for value in found)
        assert float(result[key][0]) == pytest.approx(worst, rel=0.01)


def loose(play: float, crank: float = 301.3) -> trunnion.Mechanism:
    """Play between rod and ram, m; the load begins at a crank angle, deg, a hair before it."""
    angle = np.radians(crank)
    start = R * np.cos(angle) + np.sqrt(L**2 - (R * np.sin(angle)) ** 2) - 1e-9
    joints = {**model().data()["joints"]}
    joints["Q"] = {**joints["Q"], "pin": {"radius": "20 mm", "clearance": play}}
    return model(joints=joints, dimensions={**model().data()["dimensions"], "x0": float(start)})


@pytest.mark.parametrize(("steps", "crank"), [(72, 300.0), (73, 301.3)])
def test_play_changes_the_peak_itself_not_the_torque_at_one_crank_angle(crank: float, steps: int) -> None:
    """At that angle there is all of the load or none; first order is right where the play is small."""
    result = trunnion.play(loose(1e-5, crank), ["peak"], steps)
    assert not {one.code for one in result.trunnion.findings if one.code.endswith("_first_order")}
    assert float(result["extreme_time"][0]) == pytest.approx(((crank - 180) % 360) / 360, abs=1e-7)


def test_pins_in_a_large_play_change_the_peak_by_what_the_triangle_says() -> None:
    """The pin anywhere at the rim of its hole, the triangle of crank and rod being closed there."""
    play = 3e-3
    result = trunnion.play(loose(play), ["peak"], 72)
    (found,) = [one.figures for one in result.trunnion.findings if one.code.endswith("_first_order")]
    begin = loose(play).data()["dimensions"]["x0"]
    rim = np.linspace(0, 2 * np.pi, 3601)
    x, y = begin + play * np.cos(rim), play * np.sin(rim)
    far = np.hypot(x, y)
    angle = np.arctan2(y, x) - np.arccos((far**2 + R**2 - L**2) / (2 * R * far))
    up = R * np.sin(angle) - y
    torque = FORCE * R * (-np.sin(angle) - np.cos(angle) * up / np.sqrt(L**2 - up**2))
    assert max(-found["low"], found["high"]) == pytest.approx(np.max(np.abs(torque - peak(x0=begin))), rel=0.01)


@pytest.mark.slow
def test_an_allocation_keeps_the_yield_that_the_formula_has() -> None:
    costs = {name: {"model": "power", "B": 1, "k": 0.5, "unit": "mm", "most": "0.2 mm"} for name in LIMIT}
    room = 3.5 * float(np.sqrt(sum((slope(name) * limit / 3) ** 2 for name, limit in LIMIT.items())))
    measures = {"peak": {"effort": "O", "as": "maximum", "limit": f"±{room:.6g} N m"}}
    asked = {"criterion": "yield", "target": 0.99, "steps": 72, "samples": 4000}
    result = trunnion.allocate(model(costs=costs, measures=measures), **asked)
    assert float(result["cost_total"]) < float(result["cost_total_before"])
    rng, half = np.random.default_rng(4), result["tolerance"].values / 3
    names = [str(name).partition(".")[2] for name in result["parameter"].values]
    at = {"r": R, "l": L, "x0": START}
    drawn = peak(**{name: rng.normal(at[name], size, 200_000) for name, size in zip(names, half, strict=True)})
    assert np.mean(np.abs(drawn - peak()) <= room) == pytest.approx(0.99, abs=0.004)


def offset_slide(**more: Any) -> trunnion.Mechanism:
    """The stroke √((l + r)² − e²) − √((l − r)² − e²) has no derivative by the offset e of the slide at e = 0."""
    data = model().data()
    return model(
        links={**data["links"], "frame": {"points": {"O": [0, 0], "S": {"at": [0, "e"], "axis": [1, 0]}}}},
        dimensions={**data["dimensions"], "e": "0 mm"},
        loads={},
        tolerances={"e": "±4 mm", "r": "±0.1 um"},
        measures={"stroke": {"point": "ram.Q", "axis": "x", "as": "peak-to-peak", "limit": "±4 um"}},
        **more,
    )


def test_what_first_order_does_not_describe_is_not_advised_by_it() -> None:
    result = trunnion.tolerance(offset_slide(), samples=2000, steps=72)
    found = {one.code: one for one in result.trunnion.findings}
    e = np.random.default_rng(5).normal(0.0, 4e-3 / 3, 100_000)
    stroke = np.sqrt((L + R) ** 2 - e**2) - np.sqrt((L - R) ** 2 - e**2)
    assert found["first_order.scatter_differs"].figures["found"] == pytest.approx(stroke.std(), rel=0.1)
    assert "--method sobol" in found["first_order.scatter_differs"].remedy
    assert "sobol" in found["limit.missed"].remedy
    assert "narrow first '" not in found["limit.missed"].remedy


@pytest.mark.parametrize(
    ("criterion", "code"), [("worst-case", "allocation.worst_case_beyond"), ("yield", "yield.missed")]
)
def test_an_allocation_by_first_order_that_does_not_hold_is_an_error(criterion: Any, code: str) -> None:
    costs = {name: {"model": "power", "B": 1, "k": 0.5, "unit": "mm", "most": "5 mm"} for name in ("e", "r")}
    result = trunnion.allocate(offset_slide(costs=costs), criterion=criterion, steps=72, samples=1000)
    assert {one.code: one.severity for one in result.trunnion.findings}[code] == "error"


def test_the_dead_centre_under_load_is_that_of_a_window_before_it() -> None:
    """The ram is held back by three clearances; the load ends as it turns round, where no figure of a seat is valid."""
    clearance, ends = 20e-6, 359.5
    data = model().data()
    for name in ("O", "P", "Q"):
        data["joints"][name]["pin"] = {"radius": "25 mm", "clearance": clearance}
    shut = {"point": "ram.Q", "axis": "x", "as": "maximum"}
    window = {"shut": {**shut, "over": ["330 deg", f"{ends} deg"]}, "cycle": shut}
    seated = {**data, "joint_defaults": {"seat": "loaded"}, "measures": window}
    result = trunnion.analyse(trunnion.Mechanism.model_validate(seated), 720)
    angle = np.radians(ends)
    ideal = R * np.cos(angle) + np.sqrt(L**2 - (R * np.sin(angle)) ** 2)
    assert float(result["measure_figure"].sel(measure="shut")) == pytest.approx(ideal - 3 * clearance, abs=1e-8)
    notes = {one.where: one.what for one in result.trunnion.findings if one.code == "measure.contact_lost"}
    assert "where a load begins or ends or a joint reverses" in notes["measures.cycle"]


def test_a_sweep_says_why_there_is_no_efficiency_where_the_load_never_acts() -> None:
    """The ram reaches r + l: 210 and 220 mm do not reach the load at 222 mm."""
    result = trunnion.sweep(model(), {"r": ["10 mm", "20 mm", "30 mm"]}, steps=36)
    assert np.isnan(result["efficiency"].values).tolist() == [True, True, False]
    (note,) = [one for one in result.trunnion.findings if one.code == "sweep.no_efficiency"]
    assert (
        note.what == "the efficiency is undefined at 2 of 3 points, the first at r = 10 mm: the driver does no net work"
    )


def test_two_corners_that_are_as_high_do_not_cancel() -> None:
    """A press in line whose force acts both ways: a slide off the line raises one of its peaks as it lowers the other.
    That of half a turn alone is the same size."""
    mechanism = trunnion.Mechanism(
        trunnion=1,
        dimensions={"r": "30 mm", "l": "100 mm", "e": "0 mm ± 0.1 mm"},
        links={
            "ground": {"points": {"O": [0, 0], "S": {"at": [0, "e"], "axis": [1, 0]}}},
            "crank": {"points": {"O": [0, 0], "P": ["r", 0]}},
            "rod": {"points": {"P": [0, 0], "Q": ["l", 0]}},
            "ram": {"points": {"Q": [0, 0], "S": {"at": [0, 0], "axis": [1, 0]}}},
        },
        joints={
            "O": {"type": "revolute", "links": ["ground", "crank"]},
            "P": {"type": "revolute", "links": ["crank", "rod"]},
            "Q": {"type": "revolute", "links": ["rod", "ram"]},
            "S": {"type": "prismatic", "links": ["ground", "ram"]},
        },
        drivers={"O": {"speed": 6.0}},
        loads={"press": {"joint": "S", "resisting_force": "1000 N * between(S.slide, 115 mm, 200 mm)"}},
        measures={
            "top": {"effort": "O", "as": "maximum"},
            "half": {"effort": "O", "as": "maximum", "over": ["0 deg", "180 deg"]},
            "beside": {"effort": "O", "as": "maximum", "over": ["51 deg", "55 deg"]},
        },
    )  # fmt: skip
    found = trunnion.tolerance(mechanism, methods=["linear", "worst-case"])
    assert found["nominal"].values == pytest.approx(28.49227750631508, rel=1e-8)  # F r sin(θ + φ)/cos φ at 115 mm
    assert found["worst_case_upper"].values == pytest.approx(6.13845e-3, rel=1e-4)  # its derivative by e
    assert found["searched_upper"].values == pytest.approx(6.13845e-3, rel=1e-2)
