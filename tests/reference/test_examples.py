"""More of what other means say of the examples, over whole runs; the gallery has one figure of each."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import trunnion
from brief import brief
from gallery.benchmarks import butterfly, butterfly_torque, share, share_by_hand
from gallery.drawing import jansen_foot, klann_foot, turns
from gallery.entry import STEPS, Outcome
from gallery.plane import slope
from gallery.presses import jaw_angle
from trunnion import Status

EXAMPLES = Path(__file__).parents[2] / "examples"


def example(name: str) -> trunnion.Mechanism:
    return trunnion.read(EXAMPLES / f"{name}.yaml")


def track(result: Any, point: str) -> Any:
    x, y = result["point_position"].sel(point=point).transpose("axis", "position").values
    return x + 1j * y


def test_peaucellier_pen_by_inversion() -> None:
    """E = k²/conj(B) with k² = L² − m²: on the line x = k²/2r at the height x tan(θ/2), all along."""
    result = brief(example("peaucellier"), STEPS)
    turn = result["joint_rotation"].sel(joint="O").values
    height = (0.25**2 - 0.1**2) / (2 * 0.16) * np.tan(turn / 2)
    np.testing.assert_allclose(track(result, "side-CE.pen").imag, height, rtol=0, atol=1e-14)
    speed = (0.25**2 - 0.1**2) / (4 * 0.16 * np.cos(turn / 2) ** 2) * np.pi / 2
    found = result["point_velocity"].sel(point="side-CE.pen", axis="y").values
    np.testing.assert_allclose(found, speed, rtol=1e-12)


def test_feet_of_the_legs() -> None:
    jansen, klann = (brief(example(name), STEPS) for name in ("jansen", "klann"))
    np.testing.assert_allclose(track(jansen, "shank.foot"), jansen_foot(turns(np.pi)), rtol=0, atol=1e-13)
    np.testing.assert_allclose(track(klann, "leg.foot"), klann_foot(turns(np.pi)), rtol=0, atol=1e-12)


def test_klann_data_have_the_stride_that_they_are_made_for() -> None:
    """From the foot at the origin, extended, half a turn leads to (1, 0) units: what a misread digit would spoil."""
    foot = track(brief(example("klann"), 2), "leg.foot") / 0.2
    np.testing.assert_allclose(foot, [0, 1], rtol=0, atol=5e-4)


def test_toggle_amplifies_by_its_angle() -> None:
    """F_out/F_in = (cos γ / tan α − sin γ)/2, γ of the cylinder above the horizontal: 1/(2 tan α) if it is level."""
    result = brief(example("toggle-press").with_friction("off"), STEPS)
    knee = track(result, "upper.A")
    tilt = np.angle(knee - (-0.5 + 0.25j))
    gain = (np.cos(tilt) / np.tan(np.arcsin(-knee.real / 0.2)) - np.sin(tilt)) / 2
    np.testing.assert_allclose(100e3 / result["drive_effort"].sel(driver="Z").values, gain, rtol=1e-11)
    assert gain.max() == pytest.approx(np.sqrt(0.2**2 - 0.001**2) / 0.002, rel=1e-5)  # 100 times at 1 mm


@pytest.mark.spread(1)
@pytest.mark.parametrize("coefficient", [0.05, 0.1, 0.2])
def test_toggle_locks_within_its_friction_circles(coefficient: float) -> None:
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


def test_jaw_crusher_torque_of_the_rock() -> None:
    """What the rock adds to the torque without friction is −M dψ/dθ while the jaw closes, else nothing."""
    ideal = example("jaw-crusher").with_friction("off")
    loaded = brief(ideal, STEPS)
    free = brief(ideal.with_values({"loads.rock.resisting_torque": 0.0}), STEPS)
    added = (loaded["drive_effort"] - free["drive_effort"]).sel(driver="O").values
    rate = np.array([slope(lambda q: complex(jaw_angle(q)), q).real for q in turns(0.0)])
    np.testing.assert_allclose(added, np.where(rate < 0, -200e3 * rate, 0.0), rtol=0, atol=1e-5)
    assert np.count_nonzero(rate < 0) > STEPS / 3


def test_five_bar_right_motor() -> None:
    mechanism = example("five-bar-robot")
    one = Outcome(mechanism, brief(mechanism, STEPS))
    assert share(one, "E") == pytest.approx(share_by_hand("E"), abs=1e-9)


@pytest.mark.slow
def test_double_butterfly_pins_and_torque() -> None:
    mechanism = example("double-butterfly").with_friction("off")
    result = trunnion.analyse(mechanism, 24)
    assert float(result["closure_residual"].max()) < 1e-13
    for k in range(24):
        turn = 2 * np.pi * k / 24
        for pin, place in butterfly(turn)[0].items():
            link = next(name for name, one in mechanism.links.items() if pin in one.points)
            assert track(result.isel(position=[k]), f"{link}.{pin}")[0] == pytest.approx(place, abs=1e-11)
        assert float(result["drive_effort"][0, k]) == pytest.approx(butterfly_torque(turn), abs=1e-5)


# ---- Andrews' squeezer: the published states (test set for IVP solvers, release 2.4, problem andrews) --------------

ANGLES = (15.81077119629904, -15.75637105984298, 0.04082224013073101, -0.5347301163226948, 0.5244099658805304,
          0.5347301163226948, 1.048080741042263)  # fmt: skip
RATES = (1139.920302151208, -1424.379294994111, 11.03291221937134, 19.29337464421385, 0.5735699284790808,
         -19.29337464421385, 0.3231791658026955)  # fmt: skip
SECONDS = (-24631.76316945196, 51850.37701610329, 324102.5686413781, 566749.3645176213, 16743.62929479361,
           -566749.3645176222, 9826.520791458422)  # fmt: skip
MULTIPLIERS = (199.1753333731910, -29.75531228015052, 23.06654119098399, 31.45271365475927, 22.64249232082739,
               11.61740700019673)  # fmt: skip


def squeezer_at_the_end() -> Any:
    """The squeezer at t = 0.03 s of the benchmark: K1 swings such that it has there the published β, β̇ and β̈."""
    data, w = example("andrews-squeezer").data(), 100.0
    across, along = -SECONDS[0] / w**2, RATES[0] / w
    data["drivers"]["O"] = {"law": "harmonic", "mean": ANGLES[0] - across, "amplitude": float(np.hypot(across, along)),
                            "period": 2 * np.pi / w, "phase": float(np.arctan2(across, along))}  # fmt: skip
    return trunnion.analyse(trunnion.Mechanism(**data), 4).isel(position=0)


def relative(one: Any, variable: str) -> Any:
    """β, Θ, γ, Φ, δ, Ω, ε of the benchmark: three of them are between two links."""
    k = {name: float(one[variable].sel(link=name)) for name in one["link"].values}
    return np.array([k["K1"], k["K2"] - k["K1"], k["K3"], k["K4"] - k["K5"], k["K5"], k["K6"] - k["K7"], k["K7"]])


def test_squeezer_from_rest() -> None:
    """At the start: published accelerations, the torque that they come from and the first two multipliers."""
    start = brief(example("andrews-squeezer"), 4).isel(position=0)
    expected = [-0.0617138900142764496, 0, 0.455279819163070380, 0.222668390165885885, 0.487364979543842550,
                -0.222668390165885885, 1.23054744454982119]  # fmt: skip
    np.testing.assert_allclose(relative(start, "link_angle"), expected, rtol=0, atol=1e-13)
    seconds = relative(start, "link_angle_acceleration")
    np.testing.assert_allclose(seconds, [14222.4439199541387, -10666.8329399655854, 0, 0, 0, 0, 0], rtol=0, atol=1e-9)
    assert float(start["drive_effort"][0]) == pytest.approx(0.033, abs=1e-13)
    force = start["reaction_force"].sel(joint="E").values
    np.testing.assert_allclose(force, [98.5668703962410896, -6.12268834425566266], rtol=0, atol=1e-11)


def test_squeezer_at_the_end() -> None:
    """Angles to rounding; rates to 1e-10 and accelerations to 1e-5 of the published, which is what those carry."""
    end = squeezer_at_the_end()
    turned = relative(end, "link_angle") - ANGLES
    np.testing.assert_allclose(turned - 2 * np.pi * np.round(turned / (2 * np.pi)), 0, atol=1e-13)
    np.testing.assert_allclose(relative(end, "link_angle_velocity"), RATES, rtol=0, atol=1e-10 * RATES[0])
    np.testing.assert_allclose(relative(end, "link_angle_acceleration"), SECONDS, rtol=2e-6)
    assert float(end["drive_effort"][0]) == pytest.approx(0.033, abs=1e-8)
    forces = np.concatenate([end["reaction_force"].sel(joint=joint).values for joint in ("E", "E2", "E3")])
    np.testing.assert_allclose(forces, MULTIPLIERS, rtol=0, atol=5e-5)
