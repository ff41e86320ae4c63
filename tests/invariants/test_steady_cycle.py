"""Steady cycles, motions of many samples, and loads by place and speed, in time and over a cycle."""

import numpy as np
import pytest

import trunnion
from brief import brief
from mechanisms_parts import example, joined
from timed import LINEAR, mass_on_a_belt, slider_crank, wheel
from trunnion import MechanismError, analyse, simulate, sweep
from trunnion.dynamics.measured import FIGURES, figures_in_time
from trunnion.dynamics.steady_cycle import UnsteadyError
from trunnion.errors import Status
from trunnion.model.mechanism import Mechanism
from trunnion.solve.run import prepare


def figures(result):
    return {one.name: one.value for one in result.trunnion.summary}


def shaker(inertia, **motor):
    """A motor with an unbalance of 2 kg at 50 mm on a carriage of 10 kg, on a spring and a damper."""
    slide = {"at": [0, 0], "axis": [1, 0]}
    return trunnion.Mechanism(
        links={
            "ground": {"points": {"S": slide, "W": [-1, 0]}},
            "carriage": {"points": {"S": slide, "A": [0, 0]}, "mass": 10},
            "rotor": {"points": {"A": [0, 0]}, "mass": 2, "centre": [0.05, 0], "inertia": inertia},
        },
        joints=joined("ground =S= carriage -A- rotor"),
        drivers={
            "A": {"speed": 20, "motor": {"kind": "linear", "stall_effort": 4, "no_load_speed": 20, **motor},
                  "initial": {"speed": 20}},
            "S": {"range": [-1, 1], "speed": 1, "free": True, "initial": {"coordinate": 0}},
        },
        springs={"k": {"between": ["ground.W", "carriage.A"], "stiffness": 3000, "free_length": 1, "damping": 60}},
        gravity=[0, 0],
    )  # fmt: skip


def test_a_wheel_with_a_direct_current_motor():
    """T_s (1 − ω/ω₀) = drag, so ω = 150 (1 − 0.6/4) = 127.5; a difference decays as e^(−t T_s/(J ω₀)), over 2π/ω."""
    told = figures(trunnion.simulate(wheel(LINEAR), steps=12, steady=True))
    assert told["A.speed_mean"] == pytest.approx(127.5, rel=1e-9)
    assert told["cycle_time"] == pytest.approx(2 * np.pi / 127.5, rel=1e-9)
    assert told["decay"] == pytest.approx(np.exp(-2 * np.pi / 127.5 / 1.875), rel=1e-5)
    backward = figures(
        trunnion.simulate(wheel({**LINEAR, "stall_effort": -4, "no_load_speed": -150}), steps=12, steady=True)
    )
    assert backward["A.speed_mean"] == pytest.approx(127.5, rel=1e-9)


def test_a_controller_holds_the_speed_with_its_integral():
    """No error is left: ω is the target, and the integral gives the drag."""
    servo = {"kind": "speed-control", "target": 100, "proportional": 0.5, "integral": 2, "limit": 5}
    result = trunnion.simulate(wheel(servo), steps=12, steady=True)
    assert figures(result)["A.speed_mean"] == pytest.approx(100.0, rel=1e-9)
    assert result["drive_effort"].values == pytest.approx(0.6, rel=1e-9)


def test_an_unbalanced_rotor_shakes_its_carriage():
    """Forced vibration: X = m e ω²/√((k − M ω²)² + (c ω)²); the motor gives what the damper takes, T ω = c (X ω)²/2.

    The inertia of the rotor holds its speed even, to m e X/J = 3e-7.
    """
    result = trunnion.simulate(shaker(1e4), duration=8.0, steps=360, steady=True)
    speed = figures(result)["A.speed_mean"]
    amplitude = 2 * 0.05 * speed**2 / np.hypot(3000 - 12 * speed**2, 60 * speed)
    slide = result["joint_slide"].sel(joint="S").values
    assert 2 * abs(np.fft.rfft(slide)[1]) / 360 == pytest.approx(amplitude, rel=1e-6)
    assert 4 * (1 - speed / 20) == pytest.approx(60 * amplitude**2 * speed / 2, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("friction", [0.0, pytest.param(0.1, marks=pytest.mark.slow)])
def test_the_motion_goes_on_as_it_is(friction):
    """Integrated on from the first position of the cycle it repeats; works and efforts are those of the cycle."""
    data = slider_crank(friction).data()
    data["drivers"]["O"]["initial"] = {"speed": 118}
    result = trunnion.simulate(trunnion.Mechanism(**data), duration=0.3, steps=120, steady=True)
    told = figures(result)
    speed = float(result["joint_rotation_velocity"].sel(joint="O")[0])
    data["drivers"]["O"]["initial"] = {"coordinate": 0, "speed": speed}
    after = trunnion.simulate(trunnion.Mechanism(**data), duration=told["cycle_time"], steps=120, tolerance=1e-12)
    rate = after["drive_rate"].sel(driver="O").values
    assert rate[120] == pytest.approx(speed, rel=1e-8)
    assert np.max(np.abs(rate[:120] - result["joint_rotation_velocity"].sel(joint="O").values)) < 1e-8 * speed
    for name in ("reaction_force", "drive_effort"):
        of_both = [np.moveaxis(np.asarray(one[name].values), -1, 0)[1:60] for one in (result, after)]
        assert np.max(np.abs(of_both[0] - of_both[1])) < 1e-6 * np.max(np.abs(of_both[1])), name
    works = {name: float(after[f"work_{name}"][120]) for name in ("drive", "loads", "friction")}
    left = works["drive"] + works["loads"] - works["friction"]
    assert abs(left) < 1e-8 * works["drive"]  # no energy is left over
    assert float(result["drive_power_mean"]) * told["cycle_time"] == pytest.approx(works["drive"], rel=1e-7)
    assert told["efficiency"] == pytest.approx(-works["loads"] / works["drive"], rel=1e-7)


@pytest.mark.parametrize(
    ("made", "code"),
    [
        (wheel({**LINEAR, "stall_effort": 0.5}), "simulate.not_round"),
        (wheel(initial={"speed": 10}), "simulate.not_round"),
        (wheel({"kind": "constant", "effort": 1}, drag=0.5), "simulate.not_repeating"),
    ],
)
def test_no_steady_cycle_is_told_with_its_cause(made, code):
    with pytest.raises(UnsteadyError) as told:
        trunnion.simulate(made, steady=True)
    assert told.value.findings[0].code == code


@pytest.mark.parametrize(
    ("made", "where"),
    [
        (wheel({**LINEAR, "off_from": 2}), "drivers.A.motor.off_from"),
        (wheel({"kind": "table", "over": "time", "points": [[0, 4], [1, 3]]}), "drivers.A.motor.over"),
        (wheel(LINEAR, drag="0.6 N m * between(time, 0 s, 9 s)"), "loads.drag.resisting_torque"),
        (mass_on_a_belt(), "drivers.B"),
    ],
)
def test_what_cannot_be_a_cycle_is_refused(made, where):
    with pytest.raises(trunnion.MechanismError) as told:
        trunnion.simulate(made, steady=True)
    assert told.value.findings[0].where == where


TURN = 2 * np.pi
AGREED = 1e-6  # relative


def spread(mechanism, count, **numbers):
    """Numbers that scatter by a share of themselves, (sample, 1)."""
    draw, nominal = np.random.default_rng(1), mechanism.parameters()
    shares = {name.replace("__", "."): share for name, share in numbers.items()}
    moved = {path: nominal[path] * (1 + share * draw.uniform(-1, 1, (count, 1))) for path, share in shares.items()}
    return dict(mechanism.parameters(moved))


def test_flywheels_with_inertias_of_their_own():
    """J ω̇ = 4 (1 − ω/150) − 0.6: ω = 127.5 (1 − e^(−t/τ)), τ = J 150/4, of every sample."""
    mechanism, count, duration = wheel(LINEAR), 5, 12.0
    inertia = 0.05 * np.linspace(0.5, 2.0, count)[:, None]
    values = dict(mechanism.parameters({"links.wheel.inertia": inertia}))
    tau = inertia[:, 0] * 150 / 4

    def gone(time):
        return 127.5 * (time - tau * (1 - np.exp(-time / tau)))

    def when(angle):
        time = np.ones_like(angle)
        for _ in range(50):
            time = time - (gone(time) - angle) / (127.5 * (1 - np.exp(-time / tau)))
        return time

    figures = figures_in_time(prepare(mechanism), "A", values, count, duration)
    np.testing.assert_allclose(figures["peak_effort"], 4.0, rtol=1e-7)  # as it starts
    steady = TURN / (duration - when(gone(duration) - TURN))
    np.testing.assert_allclose(figures["steady_speed"], steady, rtol=1e-7)
    time = figures["starting_time"]
    np.testing.assert_allclose(TURN / (time - when(gone(time) - TURN)), 0.95 * steady, rtol=1e-7)


@pytest.mark.parametrize(("effort", "starts"), [(0.5, False), (0.7, True)])
def test_what_is_larger_at_rest_holds_every_one(effort, starts):
    """A pin with 0.2 N m of sliding and 0.6 N m at rest: φ = ½ α t² under the rest of the torque."""
    data, duration = wheel({"kind": "constant", "effort": effort}, drag=0.0).data(), 12.0
    data["gravity"], data["links"]["wheel"]["mass"] = [0, -10], 10
    law = {"law": "stiction", "coefficient": 0.1, "static": 0.3}
    data["joints"]["A"].update(pin={"radius": 0.02}, friction=law)
    mechanism, count = Mechanism(**data), 3
    values = spread(mechanism, count, links__wheel__inertia=0.2)
    speed = figures_in_time(prepare(mechanism), "A", values, count, duration)["steady_speed"]
    pull = (effort - 0.2) / values["links.wheel.inertia"][:, 0]
    last = duration - np.sqrt(duration**2 - 2 * TURN / pull)
    np.testing.assert_allclose(speed, TURN / last if starts else np.full(count, np.nan), rtol=1e-8)


# against each by itself
MOTORS = {
    "linear": {"kind": "linear", "stall_effort": 8, "no_load_speed": 157, "inertia": 1e-3},
    "geared": {
        "kind": "induction", "breakdown_effort": 5, "breakdown_slip": 0.3, "synchronous_speed": 300, "ratio": 2,
        "efficiency": 0.9, "inertia": 5e-4,
    },
    "controlled": {"kind": "speed-control", "target": 90, "proportional": 0.3, "integral": 0.5, "limit": 8},
    "table": {"kind": "table", "points": [[0, 9], [80, 7], [160, 0]]},
    "switched off": {"kind": "constant", "effort": 6, "off_from": 0.2, "brake": 2, "brake_from": 0.25},
    "clutched": {"kind": "linear", "stall_effort": 9, "no_load_speed": 150, "inertia": 0.01, "clutch": 6},
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("name", MOTORS)
def test_together_as_each_by_itself(name):
    """Every kind of motor, with its own numbers varied, on a slider-crank with friction and a load that resists."""
    mechanism = slider_crank(0.05, drivers={"O": {"speed": 100, "start": 0.3, "motor": MOTORS[name]}})
    motor = [path for path in mechanism.parameters() if ".motor." in path and not path.endswith(("_from", "until"))]
    values = spread(mechanism, 2, links__piston__mass=0.05, **dict.fromkeys(motor, 0.03))
    together = figures_in_time(prepare(mechanism), "O", values, 2, 0.3, 1e-10)
    for i in range(2):
        own = {path: float(value[i, 0]) if np.ndim(value) else value for path, value in values.items()}
        alone = figures_in_time(prepare(mechanism), "O", own, 1, 0.3, 1e-10)
        for key in FIGURES:
            near = AGREED if key == "fluctuation" else 0.0  # a difference of speeds, by their mean
            np.testing.assert_allclose(together[key][i], alone[key][0], AGREED, near, err_msg=f"{key} of {i}")
    assert np.all(np.isfinite(together["peak_effort"]))


def test_numbers_that_were_nothing_or_one_are_looked_at_anew():
    """Machine code has some 0 and 1 built in; motions with other numbers do not take it."""
    mechanism = slider_crank(0.05)
    run, values = prepare(mechanism), mechanism.parameters()
    paths = [path for path in ("links.crank.mass", "links.rod.centre.y", "links.crank.centre.y") if path in values]
    assert {values[path] for path in paths} <= {0.0, 1.0}
    first, second = (
        figures_in_time(run, "O", {**values, **dict.fromkeys(paths, size)}, 1, 0.1)["peak_effort"][0]
        for size in (0.0, 0.03)
    )
    changed = mechanism.parameters({path: np.array([[0.03]]) for path in paths})
    alone = figures_in_time(prepare(mechanism), "O", changed, 1, 0.1)["peak_effort"][0]
    assert second == pytest.approx(alone, rel=1e-9)
    assert abs(second - first) > 1e-6 * second


# the height of the ram by the crank angle, and by the motion of its joint and its point
HEIGHTS = {
    "drive": "(0.035 m * cos(drive) + sqrt((0.12 m)^2 - (0.035 m * sin(drive))^2))", "slide": "S.slide",
    "point": "piston.Q.x",
    "distance": "hypot(rod.Q.x - frame.O.x, rod.Q.y - frame.O.y)",
}  # fmt: skip
PRESS = "-30 N - 4000 N/m * ({0} - 0.11 m) - 500 N/m * abs({0} - 0.13 m) - 100 N * between({0}, 0.1 m, 0.12 m)"


def pressed(force, **more):
    return slider_crank(0.1, loads={"work": {"link": "piston", "at": "Q", "force": [force, 0]}}, **more)


@pytest.mark.spread(1)
@pytest.mark.parametrize("name", ["slide", "distance", "point"])
def test_a_press_force_over_the_height_of_the_ram(name):
    """It equals the same force stated over the crank angle, at every position and in the means."""
    one, other = (analyse(pressed(PRESS.format(HEIGHTS[key])), 90) for key in (name, "drive"))
    bare = analyse(slider_crank(0.1, loads={}), 90)
    largest = float(np.abs(other["drive_effort"]).max())
    assert float(np.abs(other["drive_effort"] - bare["drive_effort"]).max()) > 0.1 * largest
    for key in ("drive_effort", "reaction_force", "useful_power", "drive_effort_rms"):
        size = float(np.abs(other[key]).max())
        assert one[key].values == pytest.approx(other[key].values, rel=0, abs=1e-12 * size), key


def test_a_driven_joint_turns_as_the_drive_does():
    """In time its turns begin again, so that a wave over the angle is one at every turn."""
    one, other = (brief(pressed(f"-50 N * sin({name})"), 24) for name in ("O.rotation", "drive"))
    assert one["drive_effort"].values == pytest.approx(other["drive_effort"].values, rel=1e-12)
    data = wheel({"kind": "constant", "effort": 1.0}, drag=0.0).data()
    data["loads"] = {"wave": {"link": "wheel", "moment": "-0.5 N m * sin(A.rotation)"}}
    result = simulate(Mechanism(**data), 2.0, 4, 1e-10)
    turned, rate = result["drive_coordinate"].values[0], result["drive_rate"].values[0]
    assert 0.5 * 0.05 * rate**2 == pytest.approx(turned + 0.5 * (np.cos(turned) - 1), abs=1e-7)


def test_in_space():
    """A torque that resists by the rate of its joint is a damper's."""
    data = example("rssr").data()
    last = [name for name, one in data["joints"].items() if one["type"] == "revolute"][-1]
    resisted = {"joint": last, "resisting_torque": f"0.3 N m s/rad * abs({last}.rotation_velocity)"}
    one = brief(Mechanism(**{**data, "loads": {"oil": resisted}}), 24)
    other = brief(Mechanism(**{**data, "loads": {}, "springs": {"oil": {"joint": last, "damping": 0.3}}}), 24)
    largest = float(np.abs(other["drive_effort"]).max())
    assert one["drive_effort"].values == pytest.approx(other["drive_effort"].values, abs=1e-12 * largest)


def test_the_compiled_engine_has_them():
    model = pressed(PRESS.format("S.slide"))
    one, other = (sweep(model, {"rod.mass": [0.4, 0.5]}, steps=36, engine=engine) for engine in ("numpy", "compiled"))
    assert other["drive_effort_max"].values == pytest.approx(one["drive_effort_max"].values, rel=1e-9)


@pytest.mark.parametrize(
    ("force", "remedy"),
    [
        ("-50 N/m * S.slied", "S.slide"),
        ("-50 N * S.rotation", "Q.rotation"),
        ("-50 N/m * pistn.Q.x", "piston.Q.x"),
        ("-50 N * S.slide", "force"),
    ],
)
def test_a_name_that_means_nothing_is_one_finding(force, remedy):
    with pytest.raises(MechanismError) as caught:
        pressed(force)
    (finding,) = caught.value.findings
    assert finding.where == "loads.work.force.x"
    assert remedy in finding.remedy


@pytest.mark.parametrize(("free_length", "rows"), [(0.0, 0), (0.01, 1)])
def test_a_spring_whose_ends_meet_at_the_start(free_length, rows):
    """Without a free length x = v/w sin w t; with one there is no direction at 0 s, which is said and marked."""
    slide = {"at": [0, 0], "axis": [1, 0]}
    block = Mechanism(
        links={
            "ground": {"points": {"S": slide, "F": [0, 0]}},
            "block": {"points": {"S": slide, "P": [0, 0]}, "mass": 1},
        },
        joints={"S": {"type": "prismatic", "links": ["ground", "block"]}},
        drivers={"S": {"range": [-1, 1], "speed": 1, "free": True, "initial": {"coordinate": 0, "speed": 0.5}}},
        springs={"k": {"between": ["ground.F", "block.P"], "stiffness": 100, "free_length": free_length}},
    )
    result = simulate(block, 0.2, 4)
    assert np.sum(result["status"] == Status.LOAD_UNDEFINED) == rows
    assert [one.code for one in result.trunnion.findings] == ["simulate.undefined"] * rows
    if not rows:
        wanted = 0.05 * np.sin(10 * result["time"].values)
        assert result["drive_coordinate"].values[0] == pytest.approx(wanted, abs=1e-9)
