"""Known linkages: what other means say of the examples, published states and figures of the theory sheet."""

import numpy as np
import pytest

import trunnion
from brief import brief
from gallery.benchmarks import butterfly, butterfly_torque
from gallery.drawing import turns
from gallery.entry import STEPS, slope
from gallery.presses import jaw_angle
from mechanisms import DURANGO
from mechanisms_parts import example
from trunnion import FrictionMethod, Status
from trunnion.solve.run import prepare


def track(result, point):
    x, y = result["point_position"].sel(point=point).transpose("axis", "position").values
    return x + 1j * y


def test_toggle_amplifies_by_its_angle():
    """F_out/F_in = (cos γ / tan α − sin γ)/2, γ of the cylinder above the horizontal: 1/(2 tan α) if it is level."""
    result = brief(example("toggle-press").with_friction("off"), STEPS)
    knee = track(result, "upper.A")
    tilt = np.angle(knee - (-0.5 + 0.25j))
    gain = (np.cos(tilt) / np.tan(np.arcsin(-knee.real / 0.2)) - np.sin(tilt)) / 2
    np.testing.assert_allclose(100e3 / result["drive_effort"].sel(driver="Z").values, gain, rtol=1e-11)
    assert gain.max() == pytest.approx(np.sqrt(0.2**2 - 0.001**2) / 0.002, rel=1e-5)  # 100 times at 1 mm


@pytest.mark.spread(1)
@pytest.mark.parametrize("coefficient", [0.05, 0.1, 0.2])
def test_toggle_locks_within_its_friction_circles(coefficient):
    """The punch cannot push the knee away while one line touches the circles of O, A and P: knee nearer than 2 f ρ.

    The knee is the load, a resisting cylinder; which size it has does not matter.
    """
    data = example("toggle-press").data()
    low, high = (0.45 - 2 * np.sqrt(0.2**2 - x**2) for x in (0.5e-3, 12e-3))
    data["drivers"] = {"B": {"range": [low, high], "speed": 0.01}}
    data["loads"] = {"cylinder": {"joint": "Z", "resisting_force": 1000.0}}
    data["joint_defaults"]["friction"] = coefficient
    data["assembly"] = {"K": [-0.5e-3, 0.25], "A": [-0.5e-3, 0.25]}
    result = brief(trunnion.Mechanism(**data), 800)
    knee = -track(result, "upper.A").real
    locked = result["status"].values == Status.LOCKED
    assert np.array_equal(locked, knee < 2 * coefficient * 0.02)
    assert 0 < np.count_nonzero(locked) < 800


def test_jaw_crusher_torque_of_the_rock():
    """What the rock adds to the torque without friction is −M dψ/dθ while the jaw closes, else nothing."""
    ideal = example("jaw-crusher").with_friction("off")
    loaded = brief(ideal, STEPS)
    free = brief(ideal.with_values({"loads.rock.resisting_torque": 0.0}), STEPS)
    added = (loaded["drive_effort"] - free["drive_effort"]).sel(driver="O").values
    rate = np.array([slope(lambda q: complex(jaw_angle(q)), q).real for q in turns(0.0)])
    np.testing.assert_allclose(added, np.where(rate < 0, -200e3 * rate, 0.0), rtol=0, atol=1e-5)
    assert np.count_nonzero(rate < 0) > STEPS / 3


@pytest.mark.slow
def test_double_butterfly_pins_and_torque():
    mechanism = example("double-butterfly").with_friction("off")
    result = trunnion.analyse(mechanism, 24)
    assert float(result["closure_residual"].max()) < 1e-13
    for k in range(24):
        turn = 2 * np.pi * k / 24
        for pin, place in butterfly(turn)[0].items():
            link = next(name for name, one in mechanism.links.items() if pin in one.points)
            assert track(result.isel(position=[k]), f"{link}.{pin}")[0] == pytest.approx(place, abs=1e-11)
        assert float(result["drive_effort"][0, k]) == pytest.approx(butterfly_torque(turn), abs=1e-5)


# Andrews' squeezer: the published states (test set for IVP solvers, release 2.4, problem andrews)
START = (-0.0617138900142764496, 0, 0.455279819163070380, 0.222668390165885885, 0.487364979543842550,
         -0.222668390165885885, 1.23054744454982119)  # fmt: skip
ANGLES = (15.81077119629904, -15.75637105984298, 0.04082224013073101, -0.5347301163226948, 0.5244099658805304,
          0.5347301163226948, 1.048080741042263)  # fmt: skip
RATES = (1139.920302151208, -1424.379294994111, 11.03291221937134, 19.29337464421385, 0.5735699284790808,
         -19.29337464421385, 0.3231791658026955)  # fmt: skip
SECONDS = (-24631.76316945196, 51850.37701610329, 324102.5686413781, 566749.3645176213, 16743.62929479361,
           -566749.3645176222, 9826.520791458422)  # fmt: skip
MULTIPLIERS = (199.1753333731910, -29.75531228015052, 23.06654119098399, 31.45271365475927, 22.64249232082739,
               11.61740700019673)  # fmt: skip


def relative(one, variable):
    """β, Θ, γ, Φ, δ, Ω, ε of the benchmark: three of them are between two links."""
    k = {name: float(one[variable].sel(link=name)) for name in one["link"].values}
    return np.array([k["K1"], k["K2"] - k["K1"], k["K3"], k["K4"] - k["K5"], k["K5"], k["K6"] - k["K7"], k["K7"]])


def test_squeezer_from_rest():
    """At the start: published accelerations, the torque that they come from and the first two multipliers."""
    start = brief(example("andrews-squeezer"), 4).isel(position=0)
    np.testing.assert_allclose(relative(start, "link_angle"), START, rtol=0, atol=1e-13)
    seconds = relative(start, "link_angle_acceleration")
    np.testing.assert_allclose(seconds, [14222.4439199541387, -10666.8329399655854, 0, 0, 0, 0, 0], rtol=0, atol=1e-9)
    assert float(start["drive_effort"][0]) == pytest.approx(0.033, abs=1e-13)
    force = start["reaction_force"].sel(joint="E").values
    np.testing.assert_allclose(force, [98.5668703962410896, -6.12268834425566266], rtol=0, atol=1e-11)


def test_squeezer_at_the_end():
    """Angles to rounding; rates to 1e-10 and accelerations to 1e-5 of the published, which is what those carry.

    K1 swings such that it has the β, β̇ and β̈ of the benchmark at t = 0.03 s.
    """
    data, w = example("andrews-squeezer").data(), 100.0
    across, along = -SECONDS[0] / w**2, RATES[0] / w
    data["drivers"]["O"] = {"law": "harmonic", "mean": ANGLES[0] - across, "amplitude": float(np.hypot(across, along)),
                            "period": 2 * np.pi / w, "phase": float(np.arctan2(across, along))}  # fmt: skip
    end = brief(trunnion.Mechanism(**data), 4).isel(position=0)
    turned = relative(end, "link_angle") - ANGLES
    np.testing.assert_allclose(turned - 2 * np.pi * np.round(turned / (2 * np.pi)), 0, atol=1e-13)
    np.testing.assert_allclose(relative(end, "link_angle_velocity"), RATES, rtol=0, atol=1e-10 * RATES[0])
    np.testing.assert_allclose(relative(end, "link_angle_acceleration"), SECONDS, rtol=2e-6)
    assert float(end["drive_effort"][0]) == pytest.approx(0.033, abs=1e-8)
    forces = np.concatenate([end["reaction_force"].sel(joint=joint).values for joint in ("E", "E2", "E3")])
    np.testing.assert_allclose(forces, MULTIPLIERS, rtol=0, atol=5e-5)


RATE = 10.0  # rad/s, of the crank


@pytest.fixture(scope="module")
def results():
    mechanism = trunnion.read(DURANGO)
    return {"friction": trunnion.analyse(mechanism), "ideal": trunnion.analyse(mechanism.with_friction("off"))}


AT_SIXTY_DEGREES = {  # on the second link of the joint by the first: crank, coupler, rocker, rocker
    "A": (-3388.683339, -2499.828824), "B": (-3148.683339, -2084.136630),
    "C": (229.965844, 905.533667), "D": (-639.235315, -1207.667824),
}  # fmt: skip


def test_torque_power_and_reactions_of_durangos_four_bar(results):
    """The figures of the theory sheet; T with friction − T without = P_friction/ω₁ at every position."""
    ideal, rubbed = (results[case]["drive_effort"].sel(driver="A").values for case in ("ideal", "friction"))
    extremes = [ideal.min(), ideal.max(), rubbed.min(), rubbed.max()]
    assert extremes == pytest.approx([-18747.140121, 9177.173578, -18552.874991, 9288.302313], abs=1e-6)
    assert [ideal[60], rubbed[60]] == pytest.approx([3364.879649, 3393.503681], abs=1e-6)
    lost = results["friction"]["friction_power"].sum("joint").values
    assert [lost.mean(), lost[60]] == pytest.approx([517.465106, 286.240327], abs=1e-6)
    assert (lost.max(), np.argmax(lost)) == (pytest.approx(2375.340, abs=5e-4), 358)
    assert float(results["friction"]["efficiency"]) == 0.0  # constant loads over a closed cycle do no useful work
    np.testing.assert_allclose(rubbed - ideal, lost / RATE, rtol=0, atol=1e-12 * np.abs(ideal).max())
    for joint, expected in AT_SIXTY_DEGREES.items():
        found = results["friction"]["reaction_force"].sel(joint=joint).isel(position=60)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6)


def test_zero_slip_is_an_interval(results):
    """At 0° and 180° the relative speed at C is exactly zero; the torque is bracketed by either sign of friction."""
    result = results["friction"]
    status = result["status"].values
    np.testing.assert_array_equal(np.flatnonzero(status == Status.ZERO_SLIP), [0, 180])
    assert np.all(status[np.setdiff1d(np.arange(360), [0, 180])] == Status.SOLVED)
    lower, upper, effort = (result[f"drive_effort{end}"].values[0] for end in ("_lower", "_upper", ""))
    here = status == Status.ZERO_SLIP
    assert np.all(lower[here] < effort[here])
    assert np.all(effort[here] < upper[here])
    np.testing.assert_array_equal(lower[~here], effort[~here])
    np.testing.assert_array_equal(upper[~here], effort[~here])


@pytest.mark.parametrize("position", [0.0, np.pi])
def test_interval_holds_the_limits_from_both_sides(results, position):
    """On either side friction at C is fully on; both torques, extrapolated to the place itself, are the ends."""
    run = prepare(trunnion.read(DURANGO))
    result, index = results["friction"], round(np.degrees(position))
    step = 1e-5  # rad: what curves over it is below 1e-10 T″ ≈ 1e-4 N m
    angles = (position + step * np.array([-2.0, -1.0, 1.0, 2.0])) % (2 * np.pi)
    near = run.solve(angles / RATE).efforts["A"]
    ends = sorted([2 * near[1] - near[0], 2 * near[2] - near[3]])
    assert ends[0] == pytest.approx(float(result["drive_effort_lower"][0, index]), abs=2e-4)
    assert ends[1] == pytest.approx(float(result["drive_effort_upper"][0, index]), abs=2e-4)
    assert ends[1] - ends[0] > 2e-3


@pytest.mark.parametrize(("limit", "share"), [(3, 1e-3), (1, 5e-2)])
def test_three_iterations_suffice(limit, share):
    """The paper's statement: after three iterations within 0.1 % at ten equally spaced positions."""
    run = prepare(trunnion.read(DURANGO))
    time = run.cycle.times(10)
    few = run.solve(time, method=FrictionMethod("successive-approximation", None, limit))
    exact = run.solve(time)
    assert all(np.max(settled.iterations) <= limit for settled in few.settled)
    for joint, reaction in exact.reactions.items():
        size = np.hypot(reaction.x, reaction.y)
        error = np.hypot(few.reactions[joint].x - reaction.x, few.reactions[joint].y - reaction.y)
        assert np.all(error < share * size), joint
    assert np.max(few.settled[0].iterations) == limit
