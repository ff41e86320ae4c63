"""Loads that begin with a jump: extremes beside it, means up to it, and how its place moves, against closed forms.

A press without friction and mass has the torque T = F dx/dθ, which falls once the crank has passed the middle of its
stroke; a load from the ram's place x₀ on makes it largest there. The angle of the crank at x₀ is that of the triangle:
cos θ = (x₀² + r² − l²)/(2 r x₀). The useful work of a turn is F (r + l − x₀), whatever the way there.
"""

from itertools import product

import numpy as np
import pytest
from presses import arm, press
from scipy.integrate import quad

import trunnion
from measured import many
from toleranced import alone, sampler
from trunnion import Mechanism
from trunnion.measures.many import figures_of
from trunnion.measures.measures import named
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import prepare
from trunnion.studies.tolerance.linear import study

FORCE, BEGIN = 50e3, np.radians(320.3)


def cut(force="-50 kN * between(drive, 320.3 deg, 350 deg)", start=180.0, **more):
    """The press with a force on its ram along x."""
    loads = {"cut": {"link": "ram", "at": "Q", "force": [force, 0]}}
    drivers = {"O": {"speed": "60 rpm", "start": f"{start} deg"}}
    return press(**{"loads": loads, "drivers": drivers, **more})


def summary(result):
    return {one.name: one for one in result.trunnion.summary}


@pytest.mark.parametrize("steps", [12, 180])
@pytest.mark.parametrize("sign", [1, -1])
def test_an_extreme_is_that_at_the_jump(steps, sign):
    """Of effort and reaction alike, with its place; a load that pulls makes the least effort."""
    result = trunnion.analyse(cut(f"{-sign * 50} kN * between(drive, 320.3 deg, 350 deg)"), steps)
    figures = summary(result)
    effort = figures["O.effort_max" if sign > 0 else "O.effort_min"]
    assert effort.value == pytest.approx(sign * FORCE * arm(BEGIN), rel=1e-6)
    assert effort.place == "at 320.3°"
    rod = FORCE / np.sqrt(1 - (0.03 * np.sin(BEGIN) / 0.2) ** 2)  # the force along it
    assert figures["P.reaction_max"].value == pytest.approx(rod, rel=1e-6)
    assert float(np.abs(result["drive_effort"]).max()) < 0.999 * abs(effort.value)  # the positions stay as they are


def test_a_reaction_that_is_largest_at_another_jump_than_the_effort_is_located_too():
    """The torque is largest soon after the load begins, the reactions where it ends, nearer to the dead centre."""
    angle, drive = np.radians(357.3), np.linspace(BEGIN, np.radians(357.3), 100_001)
    torque = (50e3 + 40e3 * (drive - BEGIN) / 0.6457718) * arm(drive)
    tilt = np.sqrt(1 - (0.03 * np.sin(angle) / 0.2) ** 2)
    force = "-(50 kN + 40 kN * (drive - 320.3 deg) / 0.6457718 rad) * between(drive, 320.3 deg, 357.3 deg)"
    figures = summary(trunnion.analyse(cut(force), 36))
    assert figures["O.effort_max"].value == pytest.approx(np.max(torque), rel=1e-6)
    assert figures["O.effort_max"].place == f"at {np.degrees(drive[np.argmax(torque)]):.4g}°"
    assert figures["P.reaction_max"].place == "at 357.3°"
    assert figures["P.reaction_max"].value == pytest.approx(90e3 / tilt, rel=1e-6)


def test_the_start_of_a_cycle_is_beside_its_end():
    """A load that ends with the cycle has its jump behind the last position."""
    found = summary(trunnion.analyse(cut("50 kN * between(drive, 0 deg, 39.7 deg)", 39.6), 90))
    assert found["O.effort_max"].value == pytest.approx(FORCE * arm(BEGIN), rel=1e-6)


def test_a_jump_above_the_top_of_a_sample_is_met():
    """Of the nominal mechanism the top is smooth, of samples it may be beside the jump."""
    forces = ["-50 kN * wide / 20 mm * between(drive, 320.3 deg, 350 deg)", "35.58 kN * max(sin(drive), 0)"]
    loads = {str(k): {"link": "ram", "at": "Q", "force": [force, 0]} for k, force in enumerate(forces)}
    model = press({"wide": "20 mm ± 0.3 mm"}, loads=loads, drivers={"O": {"speed": "60 rpm", "start": "0 deg"}})
    found = study(model, ["maximum:effort:O"])
    nominal, batch = found.orders[0].nominal, sampler(found)
    u = np.array([[0.01, 0.3, 0.5, 0.7, 0.99]])
    figures, wide = batch.figures(u)["figure"][0], np.ravel(batch.inputs.values(u)["dimensions.wide"])
    tops = []
    for i in range(u.shape[1]):
        run = prepare(alone(model, batch.inputs.values(u), i))
        tops.append(float(np.max(np.asarray(found.measures[0].curve(run.solve(run.cycle.times(100_000)))[0]))))
    assert figures == pytest.approx(tops, rel=7e-5)  # what a step of 100,000 may leave out
    assert figures[-1] > 1.005 * nominal > 1.004 * figures[0]
    assert figures[-1] == pytest.approx(FORCE * wide[-1] / 0.02 * arm(BEGIN), rel=1e-7)


def test_the_drive_of_a_press_whose_load_jumps():
    """Power in = power out: T = F x'(θ) from 320.3° to 350°, else 0."""
    end, places = np.radians(350), np.array([BEGIN, np.radians(350)])
    work = FORCE * np.ptp(0.03 * np.cos(places) + np.sqrt(0.2**2 - (0.03 * np.sin(places)) ** 2))
    found = trunnion.design(cut(start=0.0))
    assert found.mean_power == pytest.approx(work, rel=1e-9)  # in one second
    square = quad(lambda angle: (FORCE * arm(angle)) ** 2, BEGIN, end, epsrel=1e-12)[0]
    assert found.rms_effort == pytest.approx(np.sqrt(square / (2 * np.pi)), rel=1e-7)
    assert found.peak_power == pytest.approx(2 * np.pi * FORCE * arm(BEGIN), rel=1e-6)
    assert FORCE * arm(end) * 2 * np.pi > work  # above the mean to the end of the cut
    swing = work * (1 - (end - BEGIN) / (2 * np.pi))
    assert found.energy_swing == pytest.approx(swing, rel=1e-7)
    assert found.flywheel(0.05) == pytest.approx(swing / (0.05 * (2 * np.pi) ** 2), rel=1e-7)
    with pytest.raises(trunnion.MechanismError):
        found.flywheel(0.0)


START, R, L = 0.222, 0.03, 0.2
LIMIT = {"r": 0.02e-3, "l": 0.05e-3, "x0": 0.03e-3}
LOADS = {
    "at once": "F * between(S.slide, x0, x0 + 40 mm)",
    "ramp": "F * min(1, max(0, (S.slide - x0) / 0.2 mm + 1))",  # whole at the same place
    "obtuse": "F * min(1, max(0, 1 - (x0 - S.slide) / 15 mm))",  # nearly as a smooth curve through 72 positions
}


def model(load="at once", **more):
    sections = {
        "loads": {"press": {"joint": "S", "resisting_force": LOADS[load], "only": "positive"}},
        "measures": {"peak": {"effort": "O", "as": "maximum"}},
        "tolerances": {name: f"±{1e3 * limit:g} mm" for name, limit in LIMIT.items()},
    }
    return press({"x0": START, "F": "50 kN"}, **{**sections, **more})


def peak(r=R, l=L, x0=START):  # noqa: E741
    """The torque where the load begins, N m."""
    cosine = (x0**2 + r**2 - l**2) / (2 * r * x0)
    return FORCE * r * np.sqrt(1 - cosine**2) * x0 / (x0 - r * cosine)


def slope(name, step=1e-6):
    at = {"r": R, "l": L, "x0": START}
    return float(peak(**{**at, name: at[name] + step}) - peak(**{**at, name: at[name] - step})) / (2 * step)


@pytest.mark.parametrize("load", LOADS)
def test_the_peak_and_its_derivatives_are_those_where_the_load_begins(load):
    result = trunnion.tolerance(model(load), methods=("linear", "worst-case"), steps=72)
    assert float(result["nominal"][0]) == pytest.approx(peak(), rel=1e-5)
    figure = trunnion.analyse(model(load), 72)["measure_figure"].sel(measure="peak")
    assert float(figure) == pytest.approx(peak(), rel=1e-5)
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


def test_samples_have_the_scatter_of_a_monte_carlo_of_the_formula():
    result = trunnion.tolerance(model(), methods=("linear", "monte-carlo"), samples=10_000, steps=72)
    rng = np.random.default_rng(3)
    sizes = zip((R, L, START), LIMIT.values(), strict=True)
    drawn = peak(*(rng.normal(nominal, limit / 3, 200_000) for nominal, limit in sizes))
    assert float(result["deviation"][0]) == pytest.approx(drawn.std(), rel=0.03)
    assert float(result["mean"][0]) == pytest.approx(drawn.mean(), abs=0.05 * drawn.std())
    assert float(result["deviation_linear"][0]) == pytest.approx(drawn.std(), rel=0.02)
    assert "first_order.scatter_differs" not in {one.code for one in result.trunnion.findings}


def test_the_worst_case_found_includes_a_play():
    """Of the pin of rod and ram: carried by the rod it is a longer one, by the ram it moves where the load begins."""
    play, data = 0.04e-3, model().data()
    data["joints"]["Q"]["pin"] = {"radius": "20 mm", "clearance": "0.04 mm"}
    result = trunnion.tolerance(Mechanism(**data), methods=("linear", "worst-case"), steps=72)
    for key, sign in (("searched_lower", -1), ("searched_upper", 1)):
        found = [
            peak(R + a * LIMIT["r"], L + b * (LIMIT["l"] + rod), START + c * (LIMIT["x0"] + ram))
            for a, b, c in product((-1, 1), repeat=3)
            for rod, ram in ((play, 0.0), (0.0, play))
        ]
        worst = sign * max(sign * (value - peak()) for value in found)
        assert float(result[key][0]) == pytest.approx(worst, rel=0.01)


@pytest.mark.spread(1)
@pytest.mark.parametrize(
    ("criterion", "code"), [("worst-case", "allocation.worst_case_beyond"), ("yield", "yield.missed")]
)
def test_an_allocation_by_first_order_that_does_not_hold_is_an_error(criterion, code):
    """The stroke √((l + r)² − e²) − √((l − r)² − e²) has no derivative by the offset e of the slide at e = 0."""
    offset = press(
        tolerances={"e": "±4 mm", "r": "±0.1 um"},
        measures={"stroke": {"point": "ram.Q", "axis": "x", "as": "peak-to-peak", "limit": "±4 um"}},
        costs={name: {"model": "power", "B": 1, "k": 0.5, "unit": "mm", "most": "5 mm"} for name in ("e", "r")},
    )
    result = trunnion.allocate(offset, criterion=criterion, steps=72, samples=1000)
    assert {one.code: one.severity for one in result.trunnion.findings}[code] == "error"


def test_the_dead_centre_under_load_is_that_of_a_window_before_it():
    """The ram is held back by three clearances; the load ends as it turns round, where no figure of a seat is valid."""
    clearance, end, data = 20e-6, 359.5, model().data()
    for name in ("O", "P", "Q"):
        data["joints"][name]["pin"] = {"radius": "25 mm", "clearance": clearance}
    shut = {"point": "ram.Q", "axis": "x", "as": "maximum", "over": ["330 deg", f"{end} deg"]}
    built = Mechanism(**{**data, "joint_defaults": {"seat": "loaded"}, "measures": {"shut": shut}})
    angle = np.radians(end)
    ideal = R * np.cos(angle) + np.sqrt(L**2 - (R * np.sin(angle)) ** 2)
    figure = trunnion.analyse(built, 720)["measure_figure"].sel(measure="shut")
    assert float(figure) == pytest.approx(ideal - 3 * clearance, abs=1e-8)


def test_a_sweep_has_no_efficiency_where_the_load_never_acts():
    """The ram reaches r + l: 210 and 220 mm do not reach the load at 222 mm."""
    result = trunnion.sweep(model(), {"r": ["10 mm", "20 mm", "30 mm"]}, steps=36)
    assert np.isnan(result["efficiency"].values).tolist() == [True, True, False]


@pytest.mark.slow
def test_two_corners_that_are_as_high_do_not_cancel():
    """A press in line whose force acts both ways: a slide off the line raises one of its peaks as it lowers the other.
    That of half a turn alone is the same size."""
    top = {"effort": "O", "as": "maximum"}
    mechanism = press(
        {"l": "100 mm", "e": "0 mm ± 0.1 mm"},
        drivers={"O": {"speed": 6.0}},
        loads={"press": {"joint": "S", "resisting_force": "1000 N * between(S.slide, 115 mm, 200 mm)"}},
        measures={
            "top": top,
            "half": {**top, "over": ["0 deg", "180 deg"]},
            "beside": {**top, "over": ["51 deg", "55 deg"]},
        },
    )
    found = trunnion.tolerance(mechanism, methods=["linear", "worst-case"])
    assert found["nominal"].values == pytest.approx(28.49227750631508, rel=1e-8)  # F r sin(θ + φ)/cos φ at 115 mm
    assert found["worst_case_upper"].values == pytest.approx(6.13845e-3, rel=1e-4)  # its derivative by e
    assert found["searched_upper"].values == pytest.approx(6.13845e-3, rel=1e-2)


PUSH, CRANK, TOUCH, TIME = 800.0, 0.05, 0.24, 0.5
FIGURES = {
    "power": {"power": "press", "as": "mean"},
    "within": {"power": "press", "as": "mean", "over": ["290 deg", "350 deg"]},
    "torque": {"effort": "O", "as": "rms"},
    "turned": {"effort": "O", "as": "mean", "over": ["300 deg", "60 deg"]},
}


def touching(start=0.0, numbers=None, **more):
    """A press over the last of its stroke, with other dimensions, m, and another start, deg."""
    load = {"joint": "S", "resisting_force": f"{PUSH} N * between(ram.Q.x, touch, 1 m)", "only": "positive"}
    drivers = {"O": {"speed": "120 rpm", "start": f"{start} deg"}}
    sections = {"loads": {"press": load}, "drivers": drivers, "measures": FIGURES, **more}
    return press({"r": CRANK, "touch": TOUCH, **(numbers or {})}, **sections)


def sampled(mechanism, **numbers):
    """The figures of many presses at once, as a study has them."""
    run = prepare(mechanism)
    spread = {
        "drivers.O.speed" if name == "speed" else f"dimensions.{name}": value[:, None]
        for name, value in numbers.items()
    }
    reads = many(run, named(mechanism, FIGURES, run.values)).read(mechanism.parameter_set.evaluate(spread))
    return {name: np.asarray(read.figure) for name, read in reads.items()}


def single(mechanism):
    """The figures of one press by itself."""
    run = prepare(mechanism)
    return figures_of(run, named(mechanism, FIGURES, run.values), FrictionMethod())


@pytest.mark.spread(1)
@pytest.mark.parametrize("start", [326.9, 100.0])
def test_figures_of_many_are_those_of_each_alone_and_of_the_closed_form(start):
    """Near the nominal place, far from it, and where the ram does not come to the load, or is at it throughout.

    The load begins nominally at 327°, beside the start of some of the turns.
    """
    touch = TOUCH + np.array([0.0, 2e-5, -3e-4, 4e-3, -2e-2, 9.9e-3, 0.0101, 0.03])
    found = sampled(touching(start), touch=touch, l=np.full(len(touch), L))
    way = np.maximum(CRANK + L - touch, 0.0)
    np.testing.assert_allclose(found["power"], -PUSH * way / TIME, rtol=1e-9, atol=1e-9)
    angle = np.radians([290.0, 350.0])
    ram = CRANK * np.cos(angle) + np.sqrt(L**2 - (CRANK * np.sin(angle)) ** 2)
    pressed = np.clip(ram[1] - np.maximum(touch, ram[0]), 0.0, None)
    np.testing.assert_allclose(found["within"], -PUSH * pressed / (TIME / 6), rtol=1e-9, atol=1e-9)
    for k in range(len(touch)):
        exact = single(touching(start, {"touch": float(touch[k])}))
        for name in FIGURES:
            assert found[name][k] == pytest.approx(exact[name], rel=2e-7, abs=1e-9), (name, k)


def test_pins_in_seats_move_the_place_at_which_the_load_begins():
    """A pin on one side of its hole along the rod makes the rod longer by the clearance."""
    play, data = 1e-3, touching().data()
    data["joints"]["P"] |= {"pin": {"radius": 0.01, "clearance": play}, "seat": {"xi": "180 deg"}}
    found, expected = single(Mechanism(**data)), single(touching(numbers={"l": L + play}))
    assert found["power"] == pytest.approx(-PUSH * (CRANK + L + play - TOUCH) / TIME, rel=1e-6)
    for name in FIGURES:
        assert found[name] == pytest.approx(expected[name], rel=1e-6), name
    toleranced = Mechanism(**{**data, "tolerances": {"touch": 1e-4}})
    result = trunnion.tolerance(toleranced, ["power"], ["linear"], steps=24).sel(measure="power")
    assert float(result["nominal"]) == pytest.approx(expected["power"], rel=1e-9)
    assert float(result["worst_case_upper"]) == pytest.approx(PUSH / TIME * 1e-4, rel=1e-6)


@pytest.mark.parametrize("touch", [TOUCH, 0.2505])
def test_a_speed_that_varies_and_a_load_that_is_only_just_not_met(touch):
    """Useful power F (r + l − touch) n, whether the nominal ram comes to the load or not."""
    places = touch + np.array([0.0, -1e-3, 1e-3, -4e-3, 8e-3])
    speed = 4 * np.pi * np.array([1.0, 1 + 1e-6, 0.97, 1.05, 1.0])
    found = sampled(touching(numbers={"touch": touch}), touch=places, speed=speed)
    expected = -PUSH * np.maximum(CRANK + L - places, 0.0) * speed / (2 * np.pi)
    np.testing.assert_allclose(found["power"], expected, rtol=1e-7, atol=1e-7)
