"""Motion in time against closed forms, published solutions and MuJoCo: motors, clutches, controllers, linkages."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from test_known_linkages import ANGLES, START

from mechanisms_parts import EXAMPLES, joined
from reference.mujoco_engine import Engine, mj
from timed import LINEAR, mass_on_a_belt, pulled_mass, slider_crank, three_posts, wheel
from trunnion import analyse, read, simulate
from trunnion.dynamics.measured import figures_in_time
from trunnion.model.mechanism import Mechanism
from trunnion.results.attributes import attribute
from trunnion.solve.run import prepare
from trunnion.views.motion import ENERGIES


def at(result, name, time, driver=0):
    """A number of the result at one of its times."""
    row = int(np.argmin(np.abs(result["time"].values - time)))
    assert result["time"].values[row] == pytest.approx(time, abs=1e-12)
    return float(result[name].values[driver, row])


def events(result, kind):
    rows = attribute(result, "events")
    return [float(t) for row, t in zip(rows, result["event_time"].values, strict=True) if row[0] == kind]


# ---- a flywheel: closed forms of THEORY 8 -----------------------------------------------------------------------


def test_a_run_down_is_told_from_where_the_motor_is_switched_off():
    """From 127.5 rad/s at 0.6 N m: J ω/T = 10.625 s and J ω²/(2 T) after the switch; the start adds nothing."""
    switched = wheel({**LINEAR, "off_from": 0.5}, initial={"speed": 127.5})
    told = {one.name: one.value for one in simulate(switched, 12.0, 2, 1e-11).trunnion.summary}
    assert told["A.run_down"] == pytest.approx(10.625, rel=1e-9)
    assert told["A.run_down_way"] == pytest.approx(127.5 * 10.625 / 2, rel=1e-9)
    stalled = simulate(wheel({**LINEAR, "stall_effort": 0.3}, initial={"speed": 10}), 5.0, 2)
    assert "A.run_down" not in {one.name for one in stalled.trunnion.summary}


def test_a_direct_current_motor_starts_a_flywheel():
    """ω = 127.5 (1 − e^(−t/1.875))."""
    result = simulate(wheel(LINEAR), 5.0, 5, 1e-12)
    assert at(result, "drive_rate", 1.0) == pytest.approx(52.70260701247094, rel=1e-10)
    assert at(result, "drive_coordinate", 5.0) == pytest.approx(415.048387557951, rel=1e-10)
    assert events(result, "break-away") == [0.0]


@pytest.mark.parametrize(
    ("grease", "time", "angle"),
    [(0.0, 10.625, 107.80260598490099 * 2 * np.pi), (0.004, 7.689820488627919, 440.27692670581223)],
)
def test_a_flywheel_runs_down(grease, time, angle):
    """Under a constant torque, and under one that grows with the speed as well."""
    result = simulate(wheel(None, 0.6, grease, initial={"speed": 127.5}), 12.0, 12, 1e-12)
    assert events(result, "rest") == [pytest.approx(time, rel=1e-10)]
    assert at(result, "drive_coordinate", 12.0) == pytest.approx(angle, rel=1e-10)
    assert at(result, "drive_rate", 12.0) == 0.0
    assert result["resting"].values[-1] == 1


def test_an_induction_motor_runs_up_by_kloss():
    """Without a load the time to a slip is J ω_s/(2 T_k) ∫ (s/s_k + s_k/s) ds."""
    motor = {"kind": "induction", "breakdown_effort": 20, "breakdown_slip": 0.2, "synchronous_speed": 50 * np.pi}
    for time, slip in zip(np.array([0.39537521522134894, 0.5344413770648673]), (0.5, 0.2), strict=True):
        result = simulate(wheel(motor, drag=0.0), time, 1, 1e-12)
        assert 1 - at(result, "drive_rate", time) / (50 * np.pi) == pytest.approx(slip, rel=1e-9)


@pytest.mark.slow
def test_a_motor_too_weak_stalls():
    """It gets slower by (0.6 − 0.5) N m/J and stops for good; a motor switched off, braked, or of no torque by then
    does not stall, nor does one that breaks away again."""

    constant = {"kind": "constant", "effort": 0.5}

    def codes(**motor):
        own = {"kind": "table", "over": "time", **motor} if "points" in motor else constant | motor
        result = simulate(wheel(own, initial={"speed": 2.0}), 2.0, 4, 1e-11)
        return {one.code: one.figures for one in result.trunnion.findings}

    (figures,) = codes().values()
    wanted = {"time": 1.0, "coordinate": 1.0, "place": "rad", "given": 0.5, "needed": 0.6, "unit": "N m", "driver": "A"}
    assert figures.pop("drivers") == ["A"]
    assert figures == {key: one if isinstance(one, str) else pytest.approx(one) for key, one in wanted.items()}
    assert list(codes()) == ["simulate.stalls"]
    assert list(codes(off_from=0.5)) == list(codes(brake=0.1, brake_from=0.5)) == ["simulate.rests"]
    assert list(codes(points=[[0, 0.5], [1.4, 0.5], [1.5, 0]])) == ["simulate.rests"]
    assert not codes(points=[[0, 0.5], [1.4, 0.5], [1.5, 1]])


def test_a_gear_a_rotor_and_a_loss():
    """(J + i² J_r η) ω̇ = i η T − T_f: ω = ω∞ (1 − e^(−t/τ))."""
    result = simulate(wheel({**LINEAR, "ratio": 3, "efficiency": 0.9, "inertia": 0.002}), 0.5, 1, 1e-12)
    whole = 0.05 + 9 * 0.002 * 0.9
    slope, start = 3 * 0.9 * 4 * 3 / 150, 3 * 0.9 * 4 - 0.6
    assert at(result, "drive_rate", 0.5) == pytest.approx(start / slope * (1 - np.exp(-slope * 0.5 / whole)), rel=1e-10)


def test_the_loss_of_a_gear_turns_round_with_the_power():
    """Above its no-load speed the motor brakes, through the same gear: the mechanism overcomes the loss as well."""
    motor = {**LINEAR, "ratio": 1, "efficiency": 0.8}
    result = simulate(wheel(motor, drag=0.0, initial={"speed": 200.0}), 0.2, 1, 1e-12)
    slope = 4 / 150 / 0.8
    wanted = 150 + 50 * np.exp(-slope * 0.2 / 0.05)
    assert at(result, "drive_rate", 0.2) == pytest.approx(wanted, rel=1e-10)


def test_switched_off_and_braked():
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


def test_a_table_over_time_breaks_a_wheel_away():
    """The torque grows evenly; it breaks away where it gets to that of the load."""
    motor = {"kind": "table", "over": "time", "points": [[0, 0], [2, 4]]}
    result = simulate(wheel(motor), 1.0, 1, 1e-11)
    assert events(result, "break-away") == [pytest.approx(0.3, abs=1e-9)]
    since = 0.7  # ω̇ = 2 (t − 0.3)/0.05
    assert at(result, "drive_rate", 1.0) == pytest.approx(since**2 / 0.05, rel=1e-7)


def test_a_speed_control_holds_the_speed():
    """J ω̈ = −K_p ω̇ − K_i (ω − ω*) beside the constant load: known roots, while the limit is not reached."""
    motor = {"kind": "speed-control", "target": 10, "proportional": 0.5, "integral": 2.0, "limit": 100}
    result = simulate(wheel(motor), 3.0, 3, 1e-11)
    matrix = np.array([[0, 1, 0], [0, -10, 40], [0, -1, 0]])  # q, ω, ∫
    constant = np.array([0, (0.5 * 10 - 0.6) / 0.05, 10])

    def rate(_, y):
        return np.asarray(matrix @ y + constant)

    wanted = solve_ivp(rate, (0, 3), np.zeros(3), rtol=1e-12, atol=1e-12, method="DOP853")
    assert at(result, "drive_rate", 3.0) == pytest.approx(wanted.y[1, -1], rel=1e-8)


def test_a_controller_on_the_brink_breaks_the_wheel_away_at_once():
    """K_p ω* is what the loss holds, and ∫ grows: J ω̈ + K_p ω̇ + K_i ω = K_i ω* from rest at t = 0."""
    motor = {"kind": "speed-control", "target": 100, "proportional": 0.006, "integral": 1e-6, "limit": 5}
    result = simulate(wheel(motor), 2.0, 4, 1e-11)
    fast, slow = np.roots([0.05, 0.006, 1e-6])
    time = result["time"].values[1:]
    wanted = 100 * (1 - (fast * np.exp(slow * time) - slow * np.exp(fast * time)) / (fast - slow))
    assert result["drive_rate"].values[0, 1:] == pytest.approx(wanted, rel=1e-8)
    assert len(events(result, "rest")) == 1
    assert events(result, "break-away") == pytest.approx([0.0], abs=1e-9)


# ---- linkages: published solutions ----------------------------------------------------------------------------


@pytest.mark.slow
def test_three_posts_pass_poses_with_all_rods_in_line():
    """IFToMM A02 by its own equation, 3 θ″ = −3.5 g cos θ (THEORY 8), twice through the singular pose."""
    result = simulate(three_posts(), 2.0, 2, 1e-11)
    assert at(result, "drive_coordinate", 1.0) == pytest.approx(-1.7670744763, abs=1e-8)
    assert at(result, "drive_rate", 1.0) == pytest.approx(-6.8073852409, abs=1e-8)
    assert at(result, "drive_coordinate", 2.0) == pytest.approx(-4.7702370345, abs=1e-8)
    assert at(result, "drive_rate", 2.0) == pytest.approx(-1.0189645914, abs=1e-8)


def test_andrews_squeezer_in_time():
    """Published angles after 0.03 s from rest under 0.033 N m: the example as it is."""
    result = simulate(read(EXAMPLES / "andrews-squeezer-in-time.yaml"), 0.03, 1, 1e-12)
    links = result["link_angle"].sel(link=["K1", "K2", "K3", "K4", "K5", "K6", "K7"]).values
    beta, theta, gamma, phi, delta, omega, epsilon = np.subtract(ANGLES, START)
    # some of the benchmark's angles count from another link: so K2 turns by β + Θ, K4 by δ + Φ, K6 by ε + Ω
    wanted = [beta, beta + theta, gamma, delta + phi, delta, epsilon + omega, epsilon]
    turned = (links[:, -1] - links[:, 0]) - np.array(wanted)
    assert at(result, "drive_coordinate", 0.03) == pytest.approx(ANGLES[0], rel=1e-9)
    assert np.angle(np.exp(1j * turned)) == pytest.approx(0.0, abs=1e-8)


# ---- stick and slip: closed form and published solution ---------------------------------------------------------


@pytest.mark.slow
def test_a_mass_on_a_belt_sticks_and_slips():
    """Slip 2/ω (π − atan(ω Δ/v)), stick 2 Δ/v, Δ = (F_s − F_k)/k (THEORY 8); from rest where the spring is free."""
    result = simulate(mass_on_a_belt(), 1.0, 10, 1e-10)
    (first, second), (_, stop) = events(result, "break-away"), events(result, "rest")
    assert first == pytest.approx(0.15, abs=1e-11)
    assert stop - first == pytest.approx(0.5355890089177974, abs=1e-9)
    assert second - stop == pytest.approx(0.1, abs=1e-9)
    assert np.abs(result["energy_residual"].values).max() < 1e-8 * float(result["work_drive"].values.max())


@pytest.mark.slow
def test_a_feed_works_on_the_spring_of_a_carriage_at_rest():
    """At rest the nut stretches the screw, F₀ + k v t, from 20 N on: its work is ∫ F v dt, all of it in the spring."""
    result = simulate(read(EXAMPLES / "stick-slip-drive.yaml"), 0.19, 19)
    way = 5e-3 * result["time"].values
    assert np.all(result["resting"] == 1)
    assert result["work_drive"].values == pytest.approx(20.0 * way + 0.5 * 40e3 * way**2, rel=1e-9, abs=1e-12)
    assert result["work_springs"].values == pytest.approx(-result["work_drive"].values, rel=1e-9, abs=1e-12)


@pytest.mark.slow
def test_a_pulled_mass_with_bristles():
    """Canudas de Wit's experiment, the end of the spring moved by a prescribed driver: place after several slips."""
    result = simulate(pulled_mass(), 25.0, 1, 1e-8)
    assert at(result, "drive_coordinate", 25.0) == pytest.approx(1.908839199, abs=1e-7)
    speed, force = at(result, "drive_rate", 25.0), -float(result["friction_force"].sel(joint="S").values[-1])
    steady, damping = 1 + 0.5 * np.exp(-((speed / 1e-3) ** 2)), np.sqrt(1e5)
    bristles = (force - (damping + 0.4) * speed) / (1e5 - damping * 1e5 * abs(speed) / steady)
    assert bristles == pytest.approx(1.18168e-5, abs=5e-11)


# ---- limits -----------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_huge_flywheel_runs_as_the_analysis_prescribes():
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


def test_a_short_load_in_time_is_not_stepped_over():
    """10 N m for 20 ms turn 2 into 4 rad/s, far from the start and at rest alike."""
    data = wheel(None, drag=0.0, initial={"speed": 2.0}).data()
    data["links"]["wheel"]["inertia"] = 0.1
    data["loads"] = {"pulse": {"link": "wheel", "moment": "10 N m * between(time, 7.1 s, 7.12 s)"}}
    assert at(simulate(Mechanism(**data), 10.0, 10), "drive_rate", 10.0) == pytest.approx(4.0, rel=1e-9)


def test_a_gear_that_cannot_be_driven_back_holds_its_load():
    """Between η T and T/η of the load the motor neither lifts nor lowers it."""
    data = wheel({"kind": "constant", "effort": 1.0, "efficiency": 0.5}, drag=0.0).data()
    for moment, moves in ((-0.4, True), (-0.6, False), (-1.9, False), (-2.1, True)):
        data["loads"] = {"weight": {"link": "wheel", "moment": moment}}
        assert (at(simulate(Mechanism(**data), 1.0, 4), "drive_rate", 1.0) != 0.0) == moves


def test_a_controller_does_not_wind_up_at_rest():
    """While the limit holds it at rest its integral stays where the limit holds it."""
    motor = {"kind": "speed-control", "target": 10, "proportional": 0.02, "integral": 0.05, "limit": 0.5}
    result = simulate(wheel(motor, drag=0.6), 20.0, 4)
    assert np.all(result["drive_rate"].values == 0.0)  # 0.5 N m never get over 0.6
    assert result["drive_effort"].values[0, -1] == pytest.approx(0.5, rel=1e-9)
    (most,) = [figure.value for figure in result.trunnion.summary if figure.name == "A.effort_max"]
    assert most == pytest.approx(0.5, rel=1e-14)  # the limit itself, though the effort bends there


def test_a_controller_does_not_wind_up_while_its_limit_holds():
    """It starts at its limit, ω = (5 − 0.6)/0.05 t, and there the integral grows as fast as the speed makes up for it.

    From where the limit lets go the integral is known, so that what follows is an initial value problem of its own.
    """
    motor = {"kind": "speed-control", "target": 100, "proportional": 0.5, "integral": 200.0, "limit": 5}
    result = simulate(wheel(motor), 2.0, 2000)
    time, speed = result["time"].values, result["drive_rate"].values[0]
    wanted = 0.5 * (100 - speed)
    held = wanted > 5
    assert speed[held] == pytest.approx(88 * time[held], rel=1e-8)
    assert result["drive_effort"].values[0][held][1:] == pytest.approx(5.0, rel=1e-12)
    assert np.max(speed) < 104  # with the integral of the whole start it would be twice as fast
    assert speed[-1] == pytest.approx(100, rel=1e-3)


MOVING = {"andrews-squeezer-in-time": 0.03, "flywheel-press": 3.0, "landing-gear": 50.0, "stick-slip-drive": 0.8,
          "tilting-gudgeon-pin": 1e-3, "worn-gudgeon-pin": 2e-3}  # fmt: skip


@pytest.mark.spread(1)
@pytest.mark.parametrize("example", MOVING)
def test_the_account_of_the_examples_as_they_begin(example):
    """Works and energies agree to 1e-8 of the largest of them that is turned over."""
    result = simulate(read(EXAMPLES / f"{example}.yaml"), MOVING[example], 200)
    accounts = [result[name] for name, _ in ENERGIES if name in result]
    assert abs(result["energy_residual"]).max() < 1e-8 * max(abs(one - one[0]).max() for one in accounts)


WHEEL_INERTIA = 0.05  # kg m², of `timed.wheel`
ROTOR_INERTIA = 0.02
RUN_UP = {"kind": "constant", "effort": 4, "off_from": 0.5, "inertia": ROTOR_INERTIA}


def kinds_of(result):
    rows = attribute(result, "events")
    return [(row[0], float(time)) for row, time in zip(rows, result["event_time"].values, strict=True)]


def last(result, name):
    return float(np.ravel(result[name].values)[-1])


def balanced(result, turned_over):
    assert float(np.max(np.abs(result["energy_residual"].values))) < 1e-8 * abs(turned_over)


def loaded(motor, moment):
    """The wheel under a moment that changes with time."""
    return Mechanism(**wheel(motor, drag=0.0).data() | {"loads": {"work": {"link": "wheel", "moment": moment}}})


def test_two_inertias_join():
    """By momentum, with the wheel seen through the gear; ½ J₁ J₂/(J₁ + J₂) Δω² is lost in the clutch."""
    ratio = 2.0
    motor = {**RUN_UP, "ratio": ratio, "clutch": 3, "clutch_from": 0.6}
    result = simulate(wheel(motor, drag=0.0), 2.0, 20, 1e-11)
    seen, top = WHEEL_INERTIA / ratio**2, 4 * 0.5 / ROTOR_INERTIA
    common, slipping = ROTOR_INERTIA * top / (ROTOR_INERTIA + seen), top / 3 / (1 / ROTOR_INERTIA + 1 / seen)
    assert last(result, "drive_rate") == pytest.approx(common / ratio, rel=1e-10)
    assert last(result, "rotor_speed") == pytest.approx(common, rel=1e-10)
    lost = 0.5 * ROTOR_INERTIA * seen / (ROTOR_INERTIA + seen) * top**2
    assert last(result, "work_clutch") == pytest.approx(lost, rel=1e-9)
    assert last(result, "work_drive") == pytest.approx(lost + 0.5 * WHEEL_INERTIA * (common / ratio) ** 2, rel=1e-9)
    assert kinds_of(result) == [
        ("motor-off", 0.5), ("clutch-slips", 0.6), ("clutch-holds", pytest.approx(0.6 + slipping, rel=1e-10)),
    ]  # fmt: skip
    balanced(result, lost)


def test_before_it_engages_they_move_apart():
    """The rotor by its motor alone, the wheel by its drag; so they do after it opens, with nothing lost in it."""
    motor = {**RUN_UP, "clutch": 50, "clutch_from": 0.0, "clutch_until": 0.25}
    result = simulate(wheel(motor, initial={"speed": 10.0}), 1.0, 4, 1e-11)
    together = 10.0 + (4 - 0.6) * 0.25 / (WHEEL_INERTIA + ROTOR_INERTIA)
    rotor, rate = result["rotor_speed"].values[0], result["drive_rate"].values[0]
    assert rotor[:2] == pytest.approx([10.0, together], rel=1e-10)
    assert rate[2:] == pytest.approx(together - 0.6 / WHEEL_INERTIA * np.array([0.25, 0.5, 0.75]), rel=1e-10)
    assert rotor[2:] == pytest.approx(together + 4 / ROTOR_INERTIA * 0.25, rel=1e-10)
    assert [kind for kind, _ in kinds_of(result)] == ["clutch-opens", "motor-off"]
    assert last(result, "work_clutch") == 0.0


def test_an_overload_makes_it_slip():
    """T − J₁ (T − L)/(J₁ + J₂) reaches C under L = a t; from then on the slip is a (t − t*)²/(2 J₂)."""
    effort, most, slope = 4.0, 5.0, 10.0
    result = simulate(loaded({**RUN_UP, "off_from": 5, "clutch": most}, "-10 N m/s * time"), 1.5, 3, 1e-11)
    begins = (most * (ROTOR_INERTIA + WHEEL_INERTIA) - WHEEL_INERTIA * effort) / ROTOR_INERTIA / slope
    assert kinds_of(result) == [("clutch-slips", pytest.approx(begins, rel=1e-9))]
    slip = result["rotor_speed"].values[0] - result["drive_rate"].values[0]
    assert slip[:2] == pytest.approx(0.0, abs=1e-9)
    assert slip[-1] == pytest.approx(slope * (1.5 - begins) ** 2 / (2 * WHEEL_INERTIA), rel=1e-9)
    assert last(result, "work_clutch") == pytest.approx(
        most * slope * (1.5 - begins) ** 3 / (6 * WHEEL_INERTIA), rel=1e-8
    )
    balanced(result, last(result, "work_drive"))


def test_after_an_overload_it_holds_again():
    """A load that swings: the clutch slips and holds in turn, and every stretch of slip loses C ∫ s dt."""
    motor = {"kind": "linear", "stall_effort": 4, "no_load_speed": 150, "inertia": ROTOR_INERTIA, "clutch": 2.5}
    result = simulate(loaded(motor, "-6 N m * sin(8 rad/s * time)"), 3.0, 30_000, 1e-10)
    kinds = [kind for kind, _ in kinds_of(result)]
    assert kinds[:4] == ["clutch-slips", "clutch-holds"] * 2
    assert all(one != other for one, other in pairwise(kinds))
    slip, time = result["rotor_speed"].values[0] - result["drive_rate"].values[0], result["time"].values
    assert last(result, "work_clutch") == pytest.approx(2.5 * np.trapezoid(np.abs(slip), time), rel=1e-5)
    # of the motor's work, by its characteristic at the speed of its rotor, the rotor keeps ½ J ω²
    rotor = result["rotor_speed"].values[0]
    given = np.trapezoid(4 * (1 - rotor / 150) * rotor, time) - 0.5 * ROTOR_INERTIA * rotor[-1] ** 2
    assert last(result, "work_drive") == pytest.approx(given, rel=1e-5)
    balanced(result, last(result, "work_drive"))


def test_the_rotor_turns_while_the_load_holds_the_mechanism():
    """1 N m comes through the clutch, 3 N m are needed: the wheel rests, and the rotor gets faster by 3 N m."""
    result = simulate(wheel({**RUN_UP, "clutch": 1}, drag=3.0), 0.4, 4, 1e-11)
    assert np.all(result["drive_rate"].values == 0.0)
    assert result["rotor_speed"].values[0] == pytest.approx(
        3 / ROTOR_INERTIA * result["time"].values, rel=1e-10, abs=1e-12
    )
    assert result["drive_effort"].values[0] == pytest.approx(1.0)
    assert last(result, "work_clutch") == pytest.approx(0.5 * 3 / ROTOR_INERTIA * 0.4**2, rel=1e-9)
    balanced(result, last(result, "work_clutch"))


def crank(duration, **clutch):
    motor = {"kind": "linear", "stall_effort": 6, "no_load_speed": 100, "inertia": 0.01, "efficiency": 0.9, **clutch}
    data = slider_crank().data()
    data["drivers"]["O"]["motor"] = motor
    return simulate(Mechanism(**data), duration, 10, 1e-10)


@pytest.mark.slow
def test_a_clutch_that_never_slips_is_none():
    """With friction, a gear's loss and a start from rest."""
    plain, other = crank(0.1), crank(0.1, clutch=100)
    assert other["drive_rate"].values == pytest.approx(plain["drive_rate"].values, rel=1e-8)
    assert last(other, "work_clutch") == 0.0
    assert "work_clutch" not in plain


def test_motions_with_a_clutch_are_taken_one_by_one():
    """Among samples of the capacity: the peak effort is that capacity where it slips."""
    motor = {"kind": "linear", "stall_effort": 9, "no_load_speed": 100, "inertia": ROTOR_INERTIA, "clutch": 6}
    run = prepare(wheel(motor))
    values = {**run.values, "drivers.A.motor.clutch": np.array([[5.0], [100.0]])}
    peaks = figures_in_time(run, "A", values, 2, 0.2)["peak_effort"]
    assert peaks == pytest.approx([5.0, 0.6 + WHEEL_INERTIA * (9 - 0.6) / (WHEEL_INERTIA + ROTOR_INERTIA)], rel=1e-9)


STALL, NO_LOAD, ROTOR, PULL = 8.0, 157.0, 1e-3, 40.0  # N m, rad/s, kg m², N
AXIS = {"at": [0, 0], "axis": [1, 0]}
SLIDER_CRANK = {  # a slider-crank; the flywheel is in the crank's inertia
    "gravity": [0, -9.81],
    "links": {
        "ground": {"points": {"O": [0, 0], "S": AXIS}},
        "crank": {"points": {"O": [0, 0], "P": [0.035, 0]}, "mass": 1.0, "centre": [0.01, 0.0], "inertia": 0.02},
        "rod": {"points": {"P": [0, 0], "Q": [0.12, 0]}, "mass": 0.5, "centre": [0.04, 0.0], "inertia": 1e-3},
        "piston": {"points": {"Q": [0, 0], "S": AXIS}, "mass": 0.6, "centre": [0.0, 0.0], "inertia": 1e-4},
    },
    "joints": joined("ground -O- crank -P- rod -Q- piston, ground =S= piston"),
    "drivers": {"O": {"speed": 100}},
    "assembly": {"Q": [0.155, 0]},
}


def by_engine(start, times):
    """Crank angle and rate at some times, (2, time)."""
    engine = Engine(SLIDER_CRANK, 0.0, 1.0)
    lean = -np.arcsin(0.035 / 0.12 * np.sin(start[0]))  # of the rod, which tells the assembly
    guesses, q = {"S": 0.14, "P": lean - start[0], "Q": -lean}, np.zeros(engine.size)
    for name, dof in engine.dof.items():
        q[dof] = engine.sense[name] * guesses.get(name, 0.0)

    def rate(_, y):
        engine.move(q, [(float(y[0]), float(y[1]))])
        q[:] = engine.state.qpos
        along = np.linalg.solve(engine.rows(), np.eye(engine.size)[-1])  # B: of a unit rate of the driver
        momentum, pushed = np.zeros(engine.size), np.zeros((3, engine.size))
        mj.mj_mulM(engine.model, engine.state, momentum, along)
        mj.mj_jac(engine.model, engine.state, pushed, None, engine.place("piston", "Q"), engine.body("piston"))
        given = STALL * (1 - y[1] / NO_LOAD) - PULL * pushed[0] @ along
        resting = along @ engine.state.qfrc_inverse  # with α = 0
        return [float(y[1]), float((given - resting) / (along @ momentum + ROTOR))]

    found = solve_ivp(rate, (0, times[-1]), start, t_eval=times, rtol=1e-9, atol=1e-10, method="DOP853")
    return np.asarray(found.y)


def test_a_start_with_a_motor_is_mujocos():
    """From rest 1 rad from the dead centre: angle and rate to 1e-6."""
    motor = {"kind": "linear", "stall_effort": STALL, "no_load_speed": NO_LOAD, "inertia": ROTOR}
    driver = {"O": {"speed": 100, "start": 1.0, "motor": motor}}
    load = {"work": {"link": "piston", "at": "Q", "force": [-PULL, 0]}}
    result = simulate(Mechanism(**{**SLIDER_CRANK, "drivers": driver, "loads": load}), 0.4, 4, 1e-10)
    wanted = by_engine((1.0, 0.0), result["time"].values)
    assert result["drive_coordinate"].values[0] == pytest.approx(wanted[0], rel=1e-6)
    assert result["drive_rate"].values[0] == pytest.approx(wanted[1], rel=1e-6)
    assert wanted[0, -1] > 4 * np.pi
    balanced(result, last(result, "work_drive"))
    assert np.abs(result["power_residual"].values).max() < 1e-9 * np.abs(result["drive_power"].values).max()
