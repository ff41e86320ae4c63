"""Pins and sliders in play as they move in time, against published values, closed forms and own equations."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import trunnion
from brief import brief
from playing import LANKARANI, SMOOTH, SPEED, both_pins, loose_slider, own_equations, rattling, rubbing
from trunnion.dynamics.compiled_rates import CompiledRates
from trunnion.dynamics.opened import in_play, opened
from trunnion.dynamics.rates import Layout, Walks
from trunnion.dynamics.start import initial_row
from trunnion.dynamics.state import FreeMotion
from trunnion.dynamics.stated_contacts import contacts_of
from trunnion.errors import MechanismError
from trunnion.joints.contact import CONTACT_LAWS, hertz_stiffness, loss_factor, restitution_of
from trunnion.model.mechanism import Mechanism
from trunnion.solve.run import prepare

Array = NDArray[np.float64]

# ---- laws ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("law", "factor", "returned"),
    [
        ("hunt-crossley", 0.75, 0.662962200),
        ("lankarani-nikravesh", 0.5625, 0.725241114),
        ("flores", 1.6, 0.470444779),
        ("herbert-mcwhannell", 1.0, 0.593624260),
        ("lee-wang", 0.375, 0.799198782),
        ("gonthier", 1.5, 0.487741256),
        ("hu-guo", 1.5, 0.487741256),
        ("hertz", 0.0, 1.0),
    ],
)
def test_what_comes_back_of_a_stated_half(law: str, factor: float, returned: float) -> None:
    assert CONTACT_LAWS[law].factor(0.5) == pytest.approx(factor, rel=1e-14)
    assert restitution_of(CONTACT_LAWS[law].factor(0.5)) == pytest.approx(returned, abs=6e-10)


@given(st.floats(1e-3, 1.0))
def test_the_default_law_returns_what_is_stated(restitution: float) -> None:
    assert restitution_of(loss_factor(restitution)) == pytest.approx(restitution, rel=1e-9)


@pytest.mark.parametrize("law", sorted(CONTACT_LAWS))
@pytest.mark.parametrize("restitution", [0.2, 0.7])
def test_the_restitution_of_a_law_is_that_of_its_equation_of_motion(law: str, restitution: float) -> None:
    """A mass against a wall, integrated here: whatever mass, stiffness and speed are."""
    factor = CONTACT_LAWS[law].factor(restitution)
    mass, stiffness, speed = 0.3, 4e9, 0.7

    def rate(_: float, y: Array) -> list[float]:
        force = stiffness * max(y[0], 0.0) ** 1.5 * (1 + factor * y[1] / speed)
        return [y[1], -force / mass]

    def left(_: float, y: Array) -> float:
        return float(y[0])

    left.terminal, left.direction = True, -1  # type: ignore[attr-defined]
    found = solve_ivp(rate, (0, 1.0), [0.0, speed], events=left, rtol=1e-11, atol=1e-16, max_step=1e-5)
    assert -found.y_events[0][0, 1] / speed == pytest.approx(restitution_of(factor), rel=1e-6)


def test_stiffness_of_a_steel_pin_in_its_hole() -> None:
    """By hand: σ = (1 − 0.09)/207 GPa for both, √(9.5·10/0.5) mm."""
    sigma = 0.91 / 207e9
    wanted = 4 / (3 * 2 * sigma) * np.sqrt(9.5e-3 * 10e-3 / 0.5e-3)
    assert hertz_stiffness(9.5e-3, 10e-3, 207e9, 207e9, 0.3, 0.3) == pytest.approx(wanted, rel=1e-14)


# ---- a pin in its hole --------------------------------------------------------------------------------------------


def test_the_first_contact_of_a_rattling_pin() -> None:
    """Time, speed, penetration and duration as known before; all of them and the force by own equations.

    Extrapolation (Gragg, Bulirsch, Stoer) of the same two equations in numbers of 40 digits, with √(t − t₀) in place of
    the time during the contact, finds the largest force 45872.275412 N, 2.4089 × 10⁻⁵ s after the onset, and the
    penetration 7.79522239 × 10⁻⁵ m, whether in 40 steps or 60.
    """
    result = trunnion.simulate(rattling(), duration=3e-4, steps=300)
    begin, end = float(result["impact_begin"][0]), float(result["impact_end"][0])
    assert begin == pytest.approx(2.2728603e-4, rel=1e-7)
    assert end - begin == pytest.approx(5.34372e-5, rel=1e-6)
    assert float(result["impact_approach"][0]) == pytest.approx(4.38578315, rel=1e-8)
    assert float(result["impact_depth"][0]) == pytest.approx(7.795222e-5, rel=1e-6)
    (onset_time, lasts, onset), force, impulse = own_equations(3e-4)
    assert begin == pytest.approx(onset_time, rel=1e-9)
    assert end - begin == pytest.approx(lasts, rel=1e-6)
    assert float(result["impact_approach"][0]) == pytest.approx(onset, rel=1e-9)
    assert float(result["impact_force"][0]) == pytest.approx(force, rel=1e-7)
    assert float(result["impact_force"][0]) == pytest.approx(45872.275412, rel=1e-9)
    assert float(result["impact_depth"][0]) == pytest.approx(7.7952223924e-5, rel=1e-9)
    assert float(result["impact_impulse"][0]) == pytest.approx(impulse, rel=1e-8)
    turned_over = float(abs(result["work_drive"]).max())
    assert float(abs(result["energy_residual"]).max()) < 1e-8 * turned_over


@pytest.mark.slow
def test_contacts_of_the_first_turn() -> None:
    result = trunnion.simulate(rattling(), duration=2 * np.pi / SPEED, steps=1000)
    assert result.sizes["impact"] == 28
    assert float(abs(result["energy_residual"]).max()) < 1e-8 * float(abs(result["work_drive"]).max())


@pytest.mark.slow
@pytest.mark.parametrize("friction", [SMOOTH, 0.1], ids=["smooth", "coulomb"])
def test_a_turn_with_friction_in_the_other_joints(friction: float | dict[str, Any]) -> None:
    """Many contacts, and the books balance."""
    result = trunnion.simulate(rubbing(friction), duration=2 * np.pi / SPEED, steps=200)
    assert result.sizes["impact"] > 15
    assert float(abs(result["energy_residual"]).max()) < 1e-8 * float(abs(result["work_drive"]).max())


def test_the_reaction_in_play_is_the_contact_force() -> None:
    """On the slider by the rod; and the slider's mass times its acceleration, along the guide without friction."""
    result = trunnion.simulate(rattling(), duration=3e-4, steps=300)
    touching = result["contact_touching"].sel(contact="Q") == 1
    assert 30 < int(touching.sum()) < 80
    force = result["reaction_force"].sel(joint="Q")
    size = np.hypot(force.sel(axis="x"), force.sel(axis="y"))
    assert np.allclose(size, result["contact_normal_force"].sel(contact="Q"), rtol=1e-9, atol=1e-9)
    slide = result["joint_slide_acceleration"].sel(joint="S")
    assert np.allclose(0.14 * slide, force.sel(axis="x"), rtol=1e-7, atol=1e-6 * float(size.max()))


def test_machine_code_has_the_rates_of_the_walks() -> None:
    for mechanism in (rattling(), both_pins(), loose_slider(), rubbing(SMOOTH), rubbing(0.1)):
        motion, row = _opened(mechanism)
        compiled = CompiledRates(motion)
        compiled.walks = None  # they are not asked
        rng = np.random.default_rng(3)
        for _ in range(5):
            state = row + 1e-3 * rng.standard_normal(len(row))
            onsets = tuple(
                float(speed) if rng.random() < 0.5 else None for speed in rng.random(len(motion.contacts.each))
            )
            senses = tuple(int(one) for one in rng.choice((-1, 1), len(motion.resisted)))
            at = Layout.of(motion).moment(np.array([1e-4]), state[:, None])._replace(onsets=onsets, senses=senses)
            one, other = compiled(at), Walks(motion)(at)
            assert np.allclose(one.second, other.second, rtol=1e-9)
            assert np.allclose(one.works, other.works, rtol=1e-9, atol=1e-13 * np.max(np.abs(other.second)))
            for seen, wanted in zip(compiled.look(at), Walks(motion).look(at), strict=True):
                assert np.allclose(seen, wanted, rtol=1e-9, atol=1e-15)


def _opened(mechanism: Mechanism) -> tuple[FreeMotion, Array]:
    run = prepare(mechanism)
    motion = FreeMotion.of(prepare(opened(run).mechanism), contacts_of(run, in_play(mechanism)))
    return motion, initial_row(motion)


# ---- other joints -------------------------------------------------------------------------------------------------


def test_a_rod_that_no_joint_holds() -> None:
    """Both its pins in play: momentum of rod and slider along the guide changes by the crank pin's force alone."""
    result = trunnion.simulate(both_pins(), duration=8e-4, steps=400)
    assert set(result["contact"].values) == {"P", "Q"}
    assert int(result.sizes["impact"]) >= 4
    assert float(abs(result["energy_residual"]).max()) < 1e-8 * float(abs(result["work_drive"]).max())
    force = result["reaction_force"].sel(joint="P", axis="x")  # on the rod by the crank
    centre = 0.5 * (result["point_acceleration"].sel(point="rod.P", axis="x")
                    + result["point_acceleration"].sel(point="rod.Q", axis="x"))  # fmt: skip
    slider = result["joint_slide_acceleration"].sel(joint="S")
    assert np.allclose(force, 0.21 * centre + 0.14 * slider, rtol=1e-7, atol=1e-6 * float(abs(force).max()))


@pytest.mark.slow
def test_a_slider_rests_on_its_guide() -> None:
    """Falls through its play, bounces, and then lies on two corners with the weight that it carries."""
    mechanism = loose_slider()
    result = trunnion.simulate(mechanism, duration=0.1, steps=300)
    lower = result["contact_gap"].sel(contact=["S.1", "S.2", "S.3", "S.4"])
    assert float(lower.min()) > -1e-4  # soft walls, some 50 N
    assert np.allclose(
        result["contact_gap"].sel(contact="S.1") + result["contact_gap"].sel(contact="S.3"), 2e-3, rtol=1e-6
    )
    assert int(result.sizes["impact"]) > 2
    assert float(abs(result["energy_residual"]).max()) < 1e-8 * max(1.0, float(abs(result["work_drive"]).max()))


@pytest.mark.slow
def test_less_clearance_gives_the_reactions_without_play() -> None:
    """A pin that a load keeps at its wall: what the reaction differs by falls with the clearance."""
    more: dict[str, Any] = {
        "drivers": {"O": {"speed": 20}},
        "loads": {"press": {"link": "slider", "at": "Q", "force": [-500, 0]}},
    }
    angle = np.array([50, 60])  # degrees, long after the start
    ideal = trunnion.analyse(rattling({}, **more), steps=360)["reaction_force"].sel(joint="Q").values[:, angle]
    misses = []
    for clearance in (1e-3, 1e-4):
        contact = {"restitution": 0.3, "stiffness": 1e7, "exponent": 1}
        mechanism = rattling(contact, {"radius": 0.01, "clearance": clearance}, **more)
        found = trunnion.simulate(mechanism, duration=2 * np.pi / 20 * 70 / 360, steps=70)
        force = found["reaction_force"].sel(joint="Q").values[:, angle]
        misses.append(float(np.max(np.abs(force - ideal))) / 500)
    assert misses[1] < 0.2 * misses[0]
    assert misses[1] < 5e-3


# ---- bad input ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("contact", "where"),
    [
        ({**LANKARANI, "restitution": 1.2}, "joints.Q.contact.restitution"),
        ({**LANKARANI, "restitution": 0}, "joints.Q.contact.restitution"),
        ({**LANKARANI, "modulus": "-1 GPa"}, "joints.Q.contact.modulus"),
        ({**LANKARANI, "stiffness": "1e9 N/m^1.5"}, "joints.Q.contact"),
        ({"restitution": 0.5}, "joints.Q.contact"),
        ({"stiffness": "1e9 N/m^1.5"}, "joints.Q.contact"),
        ({"restitution": 0.5, "stiffness": "3 N/m"}, "joints.Q.contact.stiffness"),
        ({"law": "hertz", "restitution": 0.5, "stiffness": "1e9 N/m^1.5"}, "joints.Q.contact.restitution"),
        ({"restitution": 0.5, "stiffness": 1e9, "poisson_ratio": 0.3}, "joints.Q.contact.poisson_ratio"),
        ({**LANKARANI, "exponent": 2}, "joints.Q.contact.exponent"),
    ],
)
def test_contacts_that_cannot_be(contact: dict[str, Any], where: str) -> None:
    with pytest.raises(MechanismError) as raised:
        rattling(contact)
    assert where in [finding.where for finding in raised.value.findings]


@pytest.mark.parametrize(
    ("stiffness", "exponent", "newton"),
    [("60e9 N/m^1.5", 1.5, 6e10), ("2 MN/m", 1, 2e6), ("3 kN/mm^1.5", 1.5, 3e3 * 1000**1.5), (5e10, 1.5, 5e10)],
)
def test_a_stiffness_with_its_unit(stiffness: float | str, exponent: float, newton: float) -> None:
    mechanism = rattling({"restitution": 0.5, "stiffness": stiffness, "exponent": exponent})
    assert mechanism.parameters()["joints.Q.contact.stiffness"] == pytest.approx(newton, rel=1e-12)


def test_a_contact_without_clearance() -> None:
    with pytest.raises(MechanismError) as raised:
        rattling(pin={"radius": 0.01, "clearance": 0})
    assert [finding.where for finding in raised.value.findings] == ["joints.Q.contact"]


def test_a_driven_joint_is_not_in_play() -> None:
    data = rattling().data()
    crank = {**data["joints"]["O"], "pin": {"radius": 0.01, "clearance": 1e-4}, "contact": LANKARANI}
    with pytest.raises(MechanismError) as raised:
        rattling(joints={**data["joints"], "O": crank})
    assert "joints.O.contact" in [finding.where for finding in raised.value.findings]


def test_two_pins_in_play_on_a_link_without_mass() -> None:
    with pytest.raises(MechanismError) as raised:
        trunnion.simulate(both_pins(mass=0.0), duration=1e-3)
    assert [finding.where for finding in raised.value.findings] == ["links.rod"]


def test_friction_that_sticks_is_refused_in_play() -> None:
    data = rattling().data()
    rubbed = {**data["joints"], "Q": {**data["joints"]["Q"], "friction": 0.1}}
    with pytest.raises(MechanismError) as raised:
        trunnion.simulate(rattling(joints=rubbed), duration=1e-3)
    assert [finding.where for finding in raised.value.findings] == ["joints.Q.friction"]


def test_a_drive_that_hardly_moves() -> None:
    """The mass matrix keeps its digits where weights are all that is large."""
    slow = rattling({}, gravity=[0, -9.81]).data()
    result = trunnion.simulate(
        rattling(gravity=[0, -9.81], drivers={"O": {**slow["drivers"]["O"], "speed": 1e-5}}), 0.02, 20
    )
    assert float(abs(result["energy_residual"]).max()) < 1e-9 * float(np.ptp(result["potential_energy"].values))


def test_friction_at_the_contact_only_loses() -> None:
    data = rattling().data()
    law = {"law": "brown-mcphee", "coefficient": 0.1, "static": 0.15, "transition_speed": "0.05 m/s"}
    rubbed = {**data["joints"], "Q": {**data["joints"]["Q"], "friction": law}}
    result = trunnion.simulate(rattling(joints=rubbed), duration=3e-4, steps=300)
    friction = result["contact_friction_force"] * result["contact_slip"]
    assert float(friction.max()) <= 0.0
    assert float(friction.min()) < -100.0
    assert np.all(np.abs(result["contact_friction_force"]) <= 0.1501 * result["contact_normal_force"] + 1e-9)
    assert float(abs(result["energy_residual"]).max()) < 1e-8 * float(abs(result["work_drive"]).max())


def test_other_analyses_leave_the_contact_out() -> None:
    with_contact, without = (brief(rattling(one), steps=24) for one in (None, {}))
    assert np.array_equal(with_contact["reaction_force"], without["reaction_force"])
