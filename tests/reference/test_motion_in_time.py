"""Motion in time against closed forms and published solutions."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from timed import LINEAR, mass_on_a_belt, pulled_mass, slider_crank, three_posts, wheel
from trunnion import MechanismError, analyse, read, simulate
from trunnion.joints.motors import control_at_rest, control_error
from trunnion.model.mechanism import Mechanism
from trunnion.results.attributes import attribute, summary_of

Array = NDArray[np.float64]
EXAMPLES = Path(__file__).parents[2] / "examples"


def at(result: Any, name: str, time: float, driver: int = 0) -> float:
    """A number of the result at one of its times."""
    row = int(np.argmin(np.abs(result["time"].values - time)))
    assert result["time"].values[row] == pytest.approx(time, abs=1e-12)
    return float(result[name].values[driver, row])


def events(result: Any, kind: str) -> list[float]:
    rows = attribute(result, "events")
    return [float(t) for row, t in zip(rows, result["event_time"].values, strict=True) if row[0] == kind]


# ---- a flywheel: closed forms of THEORY 8 -----------------------------------------------------------------------


def test_a_run_down_is_told_from_where_the_motor_is_switched_off() -> None:
    """From 127.5 rad/s at 0.6 N m: J ω/T = 10.625 s and J ω²/(2 T) after the switch; the start adds nothing."""
    switched = wheel({**LINEAR, "off_from": 0.5}, initial={"speed": 127.5})
    told = {one.name: one.value for one in simulate(switched, 12.0, 2, 1e-11).trunnion.summary}
    assert told["A.run_down"] == pytest.approx(10.625, rel=1e-9)
    assert told["A.run_down_way"] == pytest.approx(127.5 * 10.625 / 2, rel=1e-9)
    stalled = simulate(wheel({**LINEAR, "stall_effort": 0.3}, initial={"speed": 10}), 5.0, 2)
    assert "A.run_down" not in {one.name for one in stalled.trunnion.summary}


def test_a_direct_current_motor_starts_a_flywheel() -> None:
    """ω = 127.5 (1 − e^(−t/1.875))."""
    result = simulate(wheel(LINEAR), 5.0, 5, 1e-12)
    assert at(result, "drive_rate", 1.0) == pytest.approx(52.70260701247094, rel=1e-10)
    assert at(result, "drive_coordinate", 5.0) == pytest.approx(415.048387557951, rel=1e-10)
    assert events(result, "break-away") == [0.0]


@pytest.mark.parametrize(
    ("grease", "time", "angle"),
    [(0.0, 10.625, 107.80260598490099 * 2 * np.pi), (0.004, 7.689820488627919, 440.27692670581223)],
)
def test_a_flywheel_runs_down(grease: float, time: float, angle: float) -> None:
    """Under a constant torque, and under one that grows with the speed as well."""
    result = simulate(wheel(None, 0.6, grease, initial={"speed": 127.5}), 12.0, 12, 1e-12)
    assert events(result, "rest") == [pytest.approx(time, rel=1e-10)]
    assert at(result, "drive_coordinate", 12.0) == pytest.approx(angle, rel=1e-10)
    assert at(result, "drive_rate", 12.0) == 0.0
    assert result["resting"].values[-1] == 1


def test_an_induction_motor_runs_up_by_kloss() -> None:
    """Without a load the time to a slip is J ω_s/(2 T_k) ∫ (s/s_k + s_k/s) ds."""
    motor = {"kind": "induction", "breakdown_effort": 20, "breakdown_slip": 0.2, "synchronous_speed": 50 * np.pi}
    times = np.array([0.39537521522134894, 0.5344413770648673])
    for time, slip in zip(times, (0.5, 0.2), strict=True):
        result = simulate(wheel(motor, drag=0.0), time, 1, 1e-12)
        assert 1 - at(result, "drive_rate", time) / (50 * np.pi) == pytest.approx(slip, rel=1e-9)


def test_an_induction_motor_by_its_data_sheet_carries_its_rated_torque_at_its_rated_speed() -> None:
    """T_k = k P/ω_N and s_k = s_N (k + √(k² − 1)): 5.5 kW, 1455 rpm of 1500 rpm, breakdown ratio 2.8."""
    motor = {
        "kind": "induction",
        "breakdown_effort": 101.0716,
        "breakdown_slip": 0.1624602,
        "synchronous_speed": 50 * np.pi,
    }
    result = simulate(wheel(motor, drag=5500 / (1455 * np.pi / 30), initial={"speed": 140.0}), 1.0, 1, 1e-10)
    assert at(result, "drive_rate", 1.0) == pytest.approx(1455 * np.pi / 30, rel=1e-5)


def test_a_motor_too_weak_does_not_start() -> None:
    result = simulate(wheel({**LINEAR, "stall_effort": 0.5}), 1.0, 10)
    (finding,) = [one for one in result.trunnion.findings if one.code == "simulate.stays_at_rest"]
    assert finding.figures["given"] == pytest.approx(0.5)
    assert finding.figures["needed"] == pytest.approx(0.6)
    assert np.all(result["drive_rate"].values == 0.0)
    assert np.all(result["resting"].values == 1)


def test_a_motor_too_weak_stalls() -> None:
    """It gets slower by (0.6 − 0.5) N m/J and stops for good; a motor switched off, braked, or of no torque by then
    does not stall, nor does one that breaks away again."""

    constant = {"kind": "constant", "effort": 0.5}

    def codes(**motor: Any) -> dict[str, dict[str, Any]]:
        own = {"kind": "table", "over": "time", **motor} if "points" in motor else constant | motor
        result = simulate(wheel(own, initial={"speed": 2.0}), 2.0, 4, 1e-11)
        return {one.code: one.figures for one in result.trunnion.findings}

    (figures,) = codes().values()
    wanted = {"time": 1.0, "coordinate": 1.0, "place": "rad", "given": 0.5, "needed": 0.6, "unit": "N m", "driver": "A"}
    assert figures == {key: one if isinstance(one, str) else pytest.approx(one) for key, one in wanted.items()}
    assert list(codes()) == ["simulate.stalls"]
    assert list(codes(off_from=0.5)) == list(codes(brake=0.1, brake_from=0.5)) == ["simulate.rests"]
    assert list(codes(points=[[0, 0.5], [1.4, 0.5], [1.5, 0]])) == ["simulate.rests"]
    assert not codes(points=[[0, 0.5], [1.4, 0.5], [1.5, 1]])


def test_a_gear_a_rotor_and_a_loss() -> None:
    """(J + i² J_r η) ω̇ = i η T − T_f: ω = ω∞ (1 − e^(−t/τ))."""
    motor = {**LINEAR, "ratio": 3, "efficiency": 0.9, "inertia": 0.002}
    result = simulate(wheel(motor), 0.5, 1, 1e-12)
    whole = 0.05 + 9 * 0.002 * 0.9
    slope, start = 3 * 0.9 * 4 * 3 / 150, 3 * 0.9 * 4 - 0.6
    assert at(result, "drive_rate", 0.5) == pytest.approx(start / slope * (1 - np.exp(-slope * 0.5 / whole)), rel=1e-10)


def test_the_loss_of_a_gear_turns_round_with_the_power() -> None:
    """Above its no-load speed the motor brakes, through the same gear: the mechanism overcomes the loss as well."""
    motor = {**LINEAR, "ratio": 1, "efficiency": 0.8}
    result = simulate(wheel(motor, drag=0.0, initial={"speed": 200.0}), 0.2, 1, 1e-12)
    slope = 4 / 150 / 0.8
    wanted = 150 + 50 * np.exp(-slope * 0.2 / 0.05)
    assert at(result, "drive_rate", 0.2) == pytest.approx(wanted, rel=1e-10)


def test_switched_off_and_braked() -> None:
    """Constant torques: two straight lines in the speed, and a stop at a known time."""
    motor = {"kind": "constant", "effort": 4, "off_from": 1.0, "brake": 2.0, "brake_from": 1.5}
    result = simulate(wheel(motor), 4.0, 8, 1e-11)
    top = (4 - 0.6) / 0.05
    later = top - 0.6 / 0.05 * 0.5
    assert at(result, "drive_rate", 1.0) == pytest.approx(top, rel=1e-10)
    assert at(result, "drive_rate", 1.5) == pytest.approx(later, rel=1e-10)
    assert events(result, "rest") == [pytest.approx(1.5 + later * 0.05 / 2.6, rel=1e-9)]
    assert events(result, "motor-off") == [1.0]
    assert events(result, "brake") == [1.5]
    kinds, figures = zip(*((row[0], row[2:]) for row in attribute(result, "events")), strict=True)
    assert list(kinds) == ["break-away", "motor-off", "brake", "rest"]
    assert figures[2] == [2.0, "N m"]


def test_a_table_over_time_breaks_a_wheel_away() -> None:
    """The torque grows evenly; it breaks away where it gets to that of the load."""
    motor = {"kind": "table", "over": "time", "points": [[0, 0], [2, 4]]}
    result = simulate(wheel(motor), 1.0, 1, 1e-11)
    assert events(result, "break-away") == [pytest.approx(0.3, abs=1e-9)]
    since = 0.7  # ω̇ = 2 (t − 0.3)/0.05
    assert at(result, "drive_rate", 1.0) == pytest.approx(since**2 / 0.05, rel=1e-7)


def test_a_speed_control_holds_the_speed() -> None:
    """J ω̈ = −K_p ω̇ − K_i (ω − ω*) beside the constant load: known roots, while the limit is not reached."""
    motor = {"kind": "speed-control", "target": 10, "proportional": 0.5, "integral": 2.0, "limit": 100}
    result = simulate(wheel(motor), 3.0, 3, 1e-11)
    matrix = np.array([[0, 1, 0], [0, -10, 40], [0, -1, 0]])  # q, ω, ∫
    constant = np.array([0, (0.5 * 10 - 0.6) / 0.05, 10])

    def rate(_: float, y: np.ndarray) -> np.ndarray:
        return np.asarray(matrix @ y + constant)

    wanted = solve_ivp(rate, (0, 3), np.zeros(3), rtol=1e-12, atol=1e-12, method="DOP853")
    assert at(result, "drive_rate", 3.0) == pytest.approx(wanted.y[1, -1], rel=1e-8)


def test_a_controller_on_the_brink_breaks_the_wheel_away_at_once() -> None:
    """K_p ω* is what the loss holds, and ∫ grows: J ω̈ + K_p ω̇ + K_i ω = K_i ω* from rest at t = 0."""
    motor = {"kind": "speed-control", "target": 100, "proportional": 0.006, "integral": 1e-6, "limit": 5}
    result = simulate(wheel(motor), 2.0, 4, 1e-11)
    fast, slow = np.roots([0.05, 0.006, 1e-6])
    time = result["time"].values[1:]
    wanted = 100 * (1 - (fast * np.exp(slow * time) - slow * np.exp(fast * time)) / (fast - slow))
    assert result["drive_rate"].values[0, 1:] == pytest.approx(wanted, rel=1e-8)
    assert len(events(result, "rest")) == 1
    assert events(result, "break-away") == pytest.approx([0.0], abs=1e-9)


# Andrews' squeezer, from the test set of Mazzia and Magherini: β, Θ, γ, Φ, δ, Ω, ε at the start and at 0.03 s
START = np.array([
    -0.0617138900142764496, 0.0, 0.455279819163070380, 0.222668390165885884, 0.487364979543842550,
    -0.222668390165885884, 1.23054744454982119,
])  # fmt: skip
WANTED = np.array([
    15.81077119629904, -15.75637105984298, 0.04082224013073101, -0.5347301163226948, 0.5244099658805304,
    0.5347301163226948, 1.048080741042263,
])  # fmt: skip


# ---- linkages: published solutions ----------------------------------------------------------------------------


@pytest.mark.slow
def test_three_posts_pass_poses_with_all_rods_in_line() -> None:
    """IFToMM A02 by its own equation, 3 θ″ = −3.5 g cos θ (THEORY 8), twice through the singular pose."""
    result = simulate(three_posts(), 2.0, 2, 1e-11)
    assert at(result, "drive_coordinate", 1.0) == pytest.approx(-1.7670744763, abs=1e-8)
    assert at(result, "drive_rate", 1.0) == pytest.approx(-6.8073852409, abs=1e-8)
    assert at(result, "drive_coordinate", 2.0) == pytest.approx(-4.7702370345, abs=1e-8)
    assert at(result, "drive_rate", 2.0) == pytest.approx(-1.0189645914, abs=1e-8)


def test_andrews_squeezer_in_time() -> None:
    """Published angles after 0.03 s from rest under 0.033 N m: the example as it is."""
    result = simulate(read(EXAMPLES / "andrews-squeezer-in-time.yaml"), 0.03, 1, 1e-12)
    links = result["link_angle"].sel(link=["K1", "K2", "K3", "K4", "K5", "K6", "K7"]).values
    beta, theta, gamma, phi, delta, omega, epsilon = WANTED - START
    # some of the benchmark's angles count from another link: so K2 turns by β + Θ, K4 by δ + Φ, K6 by ε + Ω
    wanted = [beta, beta + theta, gamma, delta + phi, delta, epsilon + omega, epsilon]
    turned = (links[:, -1] - links[:, 0]) - np.array(wanted)
    assert at(result, "drive_coordinate", 0.03) == pytest.approx(WANTED[0], rel=1e-9)
    assert np.angle(np.exp(1j * turned)) == pytest.approx(0.0, abs=1e-8)


# ---- stick and slip: closed form and published solution ---------------------------------------------------------


@pytest.mark.slow
def test_a_mass_on_a_belt_sticks_and_slips() -> None:
    """Slip 2/ω (π − atan(ω Δ/v)), stick 2 Δ/v, Δ = (F_s − F_k)/k (THEORY 8); from rest where the spring is free."""
    result = simulate(mass_on_a_belt(), 1.0, 10, 1e-10)
    (first, second), (_, stop) = events(result, "break-away"), events(result, "rest")
    assert first == pytest.approx(0.15, abs=1e-11)
    assert stop - first == pytest.approx(0.5355890089177974, abs=1e-9)
    assert second - stop == pytest.approx(0.1, abs=1e-9)
    assert np.abs(result["energy_residual"].values).max() < 1e-8 * float(result["work_drive"].values.max())


@pytest.mark.slow
@pytest.mark.parametrize("clutch", [False, True])
def test_a_feed_works_on_the_spring_of_a_carriage_at_rest(clutch: bool) -> None:
    """At rest the nut stretches the screw, F₀ + k v t, from 20 N on: its work is ∫ F v dt, all of it in the spring.

    The same beside a motor behind an open clutch, whose rotor turns meanwhile.
    """
    feed = read(EXAMPLES / "stick-slip-drive.yaml")
    if clutch:
        data = feed.data()
        del data["drivers"]["S"]["free"]
        data["drivers"]["S"]["motor"] = {"kind": "constant", "effort": 1, "inertia": 1, "clutch": 5, "clutch_from": 9}
        feed = Mechanism(**data)
    result = simulate(feed, 0.19, 19)
    way = 5e-3 * result["time"].values
    assert np.all(result["resting"] == 1)
    assert result["work_drive"].values == pytest.approx(20.0 * way + 0.5 * 40e3 * way**2, rel=1e-9, abs=1e-12)
    assert result["work_springs"].values == pytest.approx(-result["work_drive"].values, rel=1e-9, abs=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("speed", [1e-3, 0.1])
def test_the_stated_speed_of_a_free_driver_is_nothing_to_its_motion(speed: float) -> None:
    """Its range then lasts another time than that of the prescribed nut, which `analyse` refuses."""
    data = read(EXAMPLES / "stick-slip-drive.yaml").data()
    data["drivers"]["S"] |= {"speed": speed}
    feed = Mechanism(**data)
    with pytest.raises(MechanismError, match="use the same duration"):
        analyse(feed, 12)
    assert simulate(feed, 0.19, 1)["work_drive"].values[-1] == pytest.approx(20.0 * 0.95e-3 + 0.5 * 40e3 * 0.95e-3**2)


@pytest.mark.slow
def test_the_feed_does_all_the_work_of_stick_and_slip() -> None:
    """∫ F v dt of the nut by its force at the rows; friction takes what the spring does not hold."""
    result = simulate(read(EXAMPLES / "stick-slip-drive.yaml"), 0.8, 2000)
    power = (result["drive_effort"] * result["drive_rate"]).sel(driver="E").values
    work = np.concatenate([[0.0], np.cumsum(0.5 * (power[1:] + power[:-1]) * np.diff(result["time"].values))])
    assert result["work_drive"].values == pytest.approx(work, abs=1e-7)
    stored = (0.5 * 40e3) * ((power / 5e-3 / 40e3) ** 2 - (20.0 / 40e3) ** 2)
    assert result["work_springs"].values == pytest.approx(-stored, abs=1e-9)


@pytest.mark.slow
def test_a_pulled_mass_with_bristles() -> None:
    """Canudas de Wit's experiment, the end of the spring moved by a prescribed driver: place after several slips."""
    result = simulate(pulled_mass(), 25.0, 1, 1e-8)
    assert at(result, "drive_coordinate", 25.0) == pytest.approx(1.908839199, abs=1e-7)
    speed, force = at(result, "drive_rate", 25.0), -float(result["friction_force"].sel(joint="S").values[-1])
    steady, damping = 1 + 0.5 * np.exp(-((speed / 1e-3) ** 2)), np.sqrt(1e5)
    bristles = (force - (damping + 0.4) * speed) / (1e5 - damping * 1e5 * abs(speed) / steady)
    assert bristles == pytest.approx(1.18168e-5, abs=5e-11)


@pytest.mark.slow
def test_stiff_bristles_take_a_slider_crank_past_its_dead_centre() -> None:
    """At 148.6 ms the integrator first asks far off, where the friction has no solution; a shorter step finds one."""
    law = {
        "law": "lugre", "coefficient": 0.1, "static": 0.15, "stribeck_speed": 1e-3, "stiffness": 1e5, "damping": 300,
        "viscous": 0.4,
    }  # fmt: skip
    result = simulate(slider_crank(law), 0.155, 1)
    assert not result.trunnion.findings
    finer = 3.405241456  # at a tolerance of 1e-12
    assert at(result, "drive_coordinate", 0.155) == pytest.approx(finer, rel=1e-8)
    assert abs(float(result["energy_residual"].values[-1])) < 1e-8 * float(result["work_drive"].values.sum())


# ---- against an integration in maximal coordinates, written here --------------------------------------------------


def newton_euler(friction: float, end: float) -> np.ndarray:
    """The slider-crank of `timed` as four bodies' equations with multipliers, friction by fixed point; ω over time.

    Coordinates: crank angle only as state; accelerations from the constraint equations differentiated twice.
    """
    r, length, lever, last = 0.035, 0.12, 0.01, np.zeros(4)
    m1, c1, j1, m2, c2, j2, m3 = 1.0, 0.01, 0.02, 0.5, 0.04, 1e-3, 0.6
    rotor, gravity, guide = 1e-3, 9.81, 0.05

    def rate(_: float, y: np.ndarray) -> list[float]:
        q, w = y
        s, c = np.sin(q), np.cos(q)
        sin_b = r * s / length
        cos_b = np.sqrt(1 - sin_b**2)
        b = -np.arcsin(sin_b)
        wb = -r * c * w / (length * cos_b)
        slide_rate = -r * s * w - length * np.sin(b) * wb
        # unknowns: α, β̈, ẍ, Ox, Oy, Px, Py, Qx, Qy, N, M; forces act on the second link of each joint
        speeds = np.array([w, wb - w, 0 - wb])
        rub = last  # friction torques of O, P, Q and friction force of S, on the second link, from what they last were
        for _round in range(200):
            a, rhs = np.zeros((11, 11)), np.zeros(11)
            # crank: m1 a = O − P + m1 g; about its own centre
            ax1, ay1 = np.array([-c1 * s, -c1 * c * w * w]), np.array([c1 * c, -c1 * s * w * w])
            a[0, [0, 3, 5]] = [m1 * ax1[0], -1, 1]
            rhs[0] = -m1 * ax1[1]
            a[1, [0, 4, 6]] = [m1 * ay1[0], -1, 1]
            rhs[1] = -m1 * ay1[1] - m1 * gravity
            motor = 8 * (1 - w / 157)
            # moment about the centre: O at (−c1), P at (r − c1) with −P
            ox, oy, px, py = -c1 * c, -c1 * s, (r - c1) * c, (r - c1) * s
            a[2, [0, 3, 4, 5, 6]] = [j1 + rotor, oy, -ox, -py, px]
            rhs[2] = motor + rub[0] - rub[1]
            # rod: centre at P + c2 (cos b, sin b)
            sb, cb = np.sin(b), np.cos(b)
            a[3, [0, 1, 5, 7]] = [-m2 * r * s, -m2 * c2 * sb, -1, 1]
            rhs[3] = m2 * (r * c * w * w + c2 * cb * wb * wb)
            a[4, [0, 1, 6, 8]] = [m2 * r * c, m2 * c2 * cb, -1, 1]
            rhs[4] = m2 * (r * s * w * w + c2 * sb * wb * wb) - m2 * gravity
            gx, gy, hx, hy = -c2 * cb, -c2 * sb, (length - c2) * cb, (length - c2) * sb
            a[5, [1, 5, 6, 7, 8]] = [j2, gy, -gx, -hy, hx]
            rhs[5] = rub[1] - rub[2]
            # piston: Q − load + friction of the guide; N and M of the guide
            a[6, [2, 7]] = [m3, -1]
            rhs[6] = -np.sign(slide_rate) * 40.0 + rub[3]
            a[7, [8, 9]] = [-1, -1]
            rhs[7] = -m3 * gravity
            a[8, 10] = -1
            rhs[8] = rub[2]
            # loop: x = r cos q + l cos b, 0 = r sin q + l sin b, twice differentiated
            a[9, [0, 1, 2]] = [r * s, length * sb, 1]
            rhs[9] = -r * c * w * w - length * cb * wb * wb
            a[10, [0, 1]] = [r * c, length * cb]
            rhs[10] = r * s * w * w + length * sb * wb * wb
            x = np.linalg.solve(a, rhs)
            loads = np.array([np.hypot(x[3], x[4]), np.hypot(x[5], x[6]), np.hypot(x[7], x[8])])
            press = max(abs(x[9]), 2 * abs(x[10]) / guide)
            new = np.append(-friction * lever * loads * np.sign(speeds), -friction * press * np.sign(slide_rate))
            if np.max(np.abs(new - rub)) <= 1e-13 * max(1.0, np.max(np.abs(new))):
                break
            rub[:] = new
        return [w, float(x[0])]

    found = solve_ivp(rate, (0, end), [0.0, 1e-9], rtol=1e-9, atol=1e-11, method="DOP853", max_step=1e-3)
    return np.asarray(found.y[:, -1])


@pytest.mark.parametrize("friction", [0.0, pytest.param(0.1, marks=pytest.mark.slow)])
def test_a_slider_crank_starts_as_its_bodies_do(friction: float) -> None:
    """Against the equations of all bodies, from just after the start, which begins at the dead centre."""
    result = simulate(slider_crank(friction), 0.3, 3, 1e-10)
    q, w = newton_euler(friction, 0.3)
    assert at(result, "drive_rate", 0.3) == pytest.approx(w, rel=1e-6)
    assert at(result, "drive_coordinate", 0.3) == pytest.approx(q, rel=1e-6)


# ---- limits -----------------------------------------------------------------------------------------------------


def test_a_huge_flywheel_runs_as_the_analysis_prescribes() -> None:
    """The difference of the efforts of a turn at constant speed falls as 1/J."""
    data = slider_crank().data()
    misses = []
    for inertia in (1e3, 1e4):
        driver = {"speed": 100, "free": True, "initial": {"speed": 100}}
        crank = {**data["links"]["crank"], "inertia": inertia}
        mechanism = Mechanism(**{**data, "links": {**data["links"], "crank": crank}, "drivers": {"O": driver}})
        turn = 2 * np.pi / 100
        result = simulate(mechanism, turn, 60, 1e-11)
        still = analyse(slider_crank(), steps=60)
        wanted = still["reaction_force"].sel(joint="Q").values
        wanted = np.append(wanted, wanted[:, :1], 1)
        sound = np.append(still["status"].values, 1) < 1  # at a dead centre the load is an interval in one of them
        miss = np.abs(result["reaction_force"].sel(joint="Q").values - wanted)[:, sound]
        misses.append(float(miss.max() / np.abs(wanted).max()))
    assert misses[1] < 1e-5
    assert misses[0] / misses[1] == pytest.approx(10.0, rel=0.05)


@pytest.mark.slow
def test_a_summary_says_how_it_starts() -> None:
    """Of a light crank, which runs steadily after some turns; the starting time is that of longer runs."""
    links = slider_crank().data()["links"]
    light = slider_crank(links={**links, "crank": {**links["crank"], "inertia": 0.003}})
    long, short = ({one.name: one for one in summary_of(simulate(light, time, 100))} for time in (0.9, 0.7))
    assert 0.05 < long["O.starting_time"].value < 0.5
    assert long["O.starting_time"].value == pytest.approx(short["O.starting_time"].value, rel=0.05)
    assert 0.01 < long["O.fluctuation"].value < 0.5
    assert long["O.speed_mean"].value < 157
    begun = {one.name for one in summary_of(simulate(slider_crank(), 0.3, 10))}
    assert "O.starting_time" not in begun  # it still accelerates


def test_a_short_load_in_time_is_not_stepped_over() -> None:
    """10 N m for 20 ms turn 2 into 4 rad/s, far from the start and at rest alike."""
    data = wheel(None, drag=0.0, initial={"speed": 2.0}).data()
    data["links"]["wheel"]["inertia"] = 0.1
    data["loads"] = {"pulse": {"link": "wheel", "moment": "10 N m * between(time, 7.1 s, 7.12 s)"}}
    result = simulate(Mechanism(**data), 10.0, 10)
    assert at(result, "drive_rate", 10.0) == pytest.approx(4.0, rel=1e-9)


def test_a_gear_that_cannot_be_driven_back_holds_its_load() -> None:
    """Between η T and T/η of the load the motor neither lifts nor lowers it."""
    motor = {"kind": "constant", "effort": 1.0, "efficiency": 0.5}
    data = wheel(motor, drag=0.0).data()
    for moment, moves in ((-0.4, True), (-0.6, False), (-1.9, False), (-2.1, True)):
        data["loads"] = {"weight": {"link": "wheel", "moment": moment}}
        result = simulate(Mechanism(**data), 1.0, 4)
        assert (at(result, "drive_rate", 1.0) != 0.0) == moves


def test_a_controller_does_not_wind_up_at_rest() -> None:
    """While the limit holds it at rest its integral stays where the limit holds it."""
    motor = {"kind": "speed-control", "target": 10, "proportional": 0.02, "integral": 0.05, "limit": 0.5}
    result = simulate(wheel(motor, drag=0.6), 20.0, 4)
    assert np.all(result["drive_rate"].values == 0.0)  # 0.5 N m never get over 0.6
    assert result["drive_effort"].values[0, -1] == pytest.approx(0.5, rel=1e-9)


@pytest.mark.parametrize("gain", [20.0, 200.0])
def test_a_controller_does_not_wind_up_while_its_limit_holds(gain: float) -> None:
    """It starts at its limit, ω = (5 − 0.6)/0.05 t, and there the integral grows as fast as the speed makes up for it.

    From where the limit lets go the integral is known, so that what follows is an initial value problem of its own.
    """
    motor = {"kind": "speed-control", "target": 100, "proportional": 0.5, "integral": gain, "limit": 5}
    result = simulate(wheel(motor), 2.0, 2000)
    time, speed = result["time"].values, result["drive_rate"].values[0]
    wanted = 0.5 * (100 - speed)
    held = wanted > 5
    assert speed[held] == pytest.approx(88 * time[held], rel=1e-8)
    assert result["drive_effort"].values[0][held][1:] == pytest.approx(5.0, rel=1e-12)
    assert np.max(speed) < 104  # with the integral of the whole start it would be twice as fast
    assert speed[-1] == pytest.approx(100, rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("target", [10.0, -10.0])
@pytest.mark.parametrize(("proportional", "begin"), [(0.0, 0.0), (0.02, 0.0), (0.02, 40.0), (0.02, -20.0)])
def test_the_integral_of_a_controller_at_rest(target: float, proportional: float, begin: float) -> None:
    """In closed form what its rate integrates to: up to the limit, held there, held beyond, and back from below."""
    begin *= np.sign(target)
    parameters = {"target": target, "proportional": proportional, "integral": 0.05, "limit": 0.5}

    def rate(time: float, y: np.ndarray) -> np.ndarray:
        return control_error(0.0 * y, np.asarray(time), parameters, y)

    time = np.array([0.0, 0.3, 0.6, 0.602, 0.61, 1.002, 1.01, 3.01])
    found = solve_ivp(rate, (0, 4), [begin], t_eval=time, rtol=1e-10, atol=1e-12, max_step=1e-3)
    assert control_at_rest(time, parameters, np.array(begin)) == pytest.approx(found.y[0], abs=1e-7)
