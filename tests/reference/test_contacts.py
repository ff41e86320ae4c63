"""Pins and sliders in play as they move in time, against published values, closed forms and own equations."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

import trunnion
import trunnion.dynamics.impact_motion as impact_motion
from brief import brief
from mechanisms_parts import joined
from playing import SMOOTH, SPEED, both_pins, loose_slider, own_equations, rattling, rubbing
from trunnion import simulate
from trunnion.dynamics.compiled_rates import CompiledRates
from trunnion.dynamics.opened import in_play, opened
from trunnion.dynamics.rates import Layout, Walks
from trunnion.dynamics.start import initial_row
from trunnion.dynamics.state import FreeMotion
from trunnion.dynamics.touching import contacts_of
from trunnion.errors import MechanismError
from trunnion.joints.contact import CONTACT_LAWS, hertz_stiffness, loss_factor, restitution_of
from trunnion.model.mechanism import Mechanism
from trunnion.results.attributes import attribute, summary_of
from trunnion.solve.run import prepare


@pytest.mark.parametrize(
    ("law", "factor", "returned"),
    [("hunt-crossley", 0.75, 0.662962200), ("lankarani-nikravesh", 0.5625, 0.725241114), ("flores", 1.6, 0.470444779),
     ("herbert-mcwhannell", 1.0, 0.593624260), ("lee-wang", 0.375, 0.799198782), ("gonthier", 1.5, 0.487741256),
     ("hu-guo", 1.5, 0.487741256), ("hertz", 0.0, 1.0)],
)  # fmt: skip
def test_what_comes_back_of_a_stated_half(law, factor, returned):
    assert CONTACT_LAWS[law].factor(0.5) == pytest.approx(factor, rel=1e-14)
    assert restitution_of(CONTACT_LAWS[law].factor(0.5)) == pytest.approx(returned, abs=6e-10)


@given(st.floats(1e-3, 1.0))
def test_the_default_law_returns_what_is_stated(restitution):
    assert restitution_of(loss_factor(restitution)) == pytest.approx(restitution, rel=1e-9)


@pytest.mark.parametrize("law", sorted(CONTACT_LAWS))
def test_the_restitution_of_a_law_is_that_of_its_equation_of_motion(law):
    """A mass against a wall, integrated here: whatever mass, stiffness and speed are."""
    factor = CONTACT_LAWS[law].factor(0.4)
    mass, stiffness, speed = 0.3, 4e9, 0.7

    def rate(_, y):
        force = stiffness * max(y[0], 0.0) ** 1.5 * (1 + factor * y[1] / speed)
        return [y[1], -force / mass]

    def left(_, y):
        return float(y[0])

    left.terminal, left.direction = True, -1
    found = solve_ivp(rate, (0, 1.0), [0.0, speed], events=left, rtol=1e-11, atol=1e-16, max_step=1e-5)
    assert -found.y_events[0][0, 1] / speed == pytest.approx(restitution_of(factor), rel=1e-6)


def test_stiffness_of_a_steel_pin_in_its_hole():
    """By hand: σ = (1 − 0.09)/207 GPa for both, √(9.5·10/0.5) mm."""
    sigma = 0.91 / 207e9
    wanted = 4 / (3 * 2 * sigma) * np.sqrt(9.5e-3 * 10e-3 / 0.5e-3)
    assert hertz_stiffness(9.5e-3, 10e-3, 207e9, 207e9, 0.3, 0.3) == pytest.approx(wanted, rel=1e-14)


def test_the_first_contact_of_a_rattling_pin():
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
    assert float(abs(result["energy_residual"]).max()) < 1e-8 * float(abs(result["work_drive"]).max())


@pytest.mark.slow
def test_a_turn_with_friction_in_the_other_joints():
    """Many contacts, and the books balance."""
    result = trunnion.simulate(rubbing(0.1), duration=2 * np.pi / SPEED, steps=200)
    assert result.sizes["impact"] > 15
    assert float(abs(result["energy_residual"]).max()) < 1e-8 * float(abs(result["work_drive"]).max())


def test_the_reaction_in_play_is_the_contact_force():
    """On the slider by the rod; and the slider's mass times its acceleration, along the guide without friction."""
    result = trunnion.simulate(rattling(), duration=3e-4, steps=300)
    touching = result["contact_touching"].sel(contact="Q") == 1
    assert 30 < int(touching.sum()) < 80
    force = result["reaction_force"].sel(joint="Q")
    size = np.hypot(force.sel(axis="x"), force.sel(axis="y"))
    assert np.allclose(size, result["contact_normal_force"].sel(contact="Q"), rtol=1e-9, atol=1e-9)
    slide = result["joint_slide_acceleration"].sel(joint="S")
    assert np.allclose(0.14 * slide, force.sel(axis="x"), rtol=1e-7, atol=1e-6 * float(size.max()))


def test_machine_code_has_the_rates_of_the_walks():
    for mechanism in (rattling(), both_pins(), loose_slider(), rubbing(SMOOTH), rubbing(0.1)):
        run = prepare(mechanism)
        motion = FreeMotion.of(prepare(opened(run).mechanism), contacts_of(run, in_play(mechanism)))
        row, compiled = initial_row(motion), CompiledRates(motion)
        compiled.walks = None  # they are not asked
        rng = np.random.default_rng(3)
        for _ in range(5):
            state = row + 1e-3 * rng.standard_normal(len(row))
            onsets = tuple(float(speed) if rng.random() < 0.5 else None for speed in rng.random(len(motion.contacts)))
            senses = tuple(int(one) for one in rng.choice((-1, 1), len(motion.resisted)))
            at = Layout.of(motion).moment(np.array([1e-4]), state[:, None])._replace(onsets=onsets, senses=senses)
            one, other = compiled(at), Walks(motion)(at)
            assert np.allclose(one.second, other.second, rtol=1e-9)
            assert np.allclose(one.others, other.others, rtol=1e-9, atol=1e-13 * np.max(np.abs(other.second)))
            for seen, wanted in zip(compiled.look(at), Walks(motion).look(at), strict=True):
                assert np.allclose(seen, wanted, rtol=1e-9, atol=1e-15)


def test_a_rod_that_no_joint_holds():
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


def test_friction_at_the_contact_only_loses():
    data = rattling().data()
    law = {"law": "brown-mcphee", "coefficient": 0.1, "static": 0.15, "transition_speed": "0.05 m/s"}
    rubbed = {**data["joints"], "Q": {**data["joints"]["Q"], "friction": law}}
    result = trunnion.simulate(rattling(joints=rubbed), duration=3e-4, steps=300)
    friction = result["contact_friction_force"] * result["contact_slip"]
    assert float(friction.max()) <= 0.0
    assert float(friction.min()) < -100.0
    assert np.all(np.abs(result["contact_friction_force"]) <= 0.1501 * result["contact_normal_force"] + 1e-9)
    assert float(abs(result["energy_residual"]).max()) < 1e-8 * float(abs(result["work_drive"]).max())


def test_other_analyses_leave_the_contact_out():
    with_contact, without = (brief(rattling(one), steps=24) for one in (None, {}))
    assert np.array_equal(with_contact["reaction_force"], without["reaction_force"])


FIRST, SECOND = 2.692502752e-3, 5.612363190e-3  # s, of Flores, Leine, Glocker's slider
CLEARANCE = 1e-3  # m; what a step tells of its inside is exact to the integrator's tolerance
GUIDE = {"length": 0.1, "height": 0.05, "clearance": CLEARANCE}
RIGID = {"law": "rigid", "restitution": 0.4}


def guide(friction=0.01, contact=None, **initial):
    """The slider-crank with a slider in play of P. Flores, R. Leine, Ch. Glocker, Multibody Syst. Dyn. 23 (2010)
    165-190, doi:10.1007/s11044-009-9178-y."""
    return Mechanism(
        gravity=[0, -9.81],
        links={
            "frame": {"points": {"O": [0, 0], "S": {"at": [0, 0], "axis": [1, 0]}}},
            "crank": {"points": {"O": [0, 0], "A": [0.153, 0]}, "mass": 0.038, "inertia": 7.4e-5,
                      "centre": [0.0765, 0]},
            "rod": {"points": {"A": [0, 0], "B": [0.306, 0]}, "mass": 0.038, "inertia": 5.9e-4, "centre": [0.153, 0]},
            "slider": {"points": {"B": [0, 0], "S": {"at": [0, 0], "axis": [1, 0]}}, "mass": 0.076, "inertia": 2.7e-6},
        },
        ground="frame",
        joints=joined("frame -O- crank -A- rod -B- slider, frame =S= slider",
                      S={"guide": GUIDE, "friction": friction, "contact": contact or RIGID}),
        drivers={"O": {"speed": 150, "free": True, "initial": {"coordinate": 0, "speed": 150, **initial}}},
        assembly={"S": [0.459, 0]},
    )  # fmt: skip


def pin(contact, friction=0.0):
    """The slider-crank with the worn pin at its slider, with another contact and friction there."""
    joints = rattling(contact).data()["joints"]
    return rattling(joints={**joints, "Q": {**joints["Q"], **({"friction": friction} if friction else {})}})


def events(result, kind, of):
    rows = attribute(result, "events")
    return [float(t) for row, t in zip(rows, result["event_time"].values, strict=True) if row[:2] == [kind, of]]


def balanced(result):
    """Whether the energy account is right to 1e-8 of the energy turned over."""
    moved = max(float(np.nanmax(np.abs(result[name].values))) for name in ("work_drive", "work_contact"))
    return bool(np.nanmax(np.abs(result["energy_residual"].values)) < 1e-8 * moved)


def codes(result):
    return [one.code for one in result.trunnion.findings]


@pytest.mark.parametrize("restitution", [-0.1, 1.1])
def test_a_restitution_is_from_0_to_1(restitution):
    with pytest.raises(MechanismError, match=r"S\.contact\.restitution: is .*(at most 1|negative)"):
        guide(contact={**RIGID, "restitution": restitution})


def test_a_slider_in_its_guide_strikes_closes_and_lifts_off():
    result = simulate(guide(), 16e-3, 32)
    for corner in ("S.1", "S.2"):  # the upper wall
        struck = events(result, "impact", corner)
        assert struck[:2] == [pytest.approx(FIRST, rel=1e-8, abs=0), pytest.approx(SECOND, rel=1e-8, abs=0)]
        assert events(result, "closes", corner) == [pytest.approx(9.145619e-3, abs=1e-7)]
        assert events(result, "lift-off", corner) == [pytest.approx(15.028652e-3, abs=1e-7)]
        assert events(result, "closes", corner)[0] > struck[-1]
    assert not events(result, "impact", "S.3")
    closed = (result["time"].values > 9.2e-3) & (result["time"].values < 15e-3)
    assert np.all(np.abs(result["contact_gap"].values[:2, closed]) < 1e-9 * CLEARANCE)
    assert np.all(result["contact_touching"].values[:2, closed] == 1)
    normal, friction = (result[f"contact_{name}_force"].values[0, closed] for name in ("normal", "friction"))
    assert np.all(normal > 0)
    assert friction == pytest.approx(-0.01 * normal * np.sign(result["contact_slip"].values[0, closed]), rel=1e-12)
    reaction = result["reaction_force"].sel(joint="S", axis="y").values[closed]
    assert reaction == pytest.approx(-result["contact_normal_force"].values[:2, closed].sum(axis=0), rel=1e-12)
    assert balanced(result)
    assert not codes(result)
    (impulse,) = [one.value for one in summary_of(result) if one.name == "S.1.impulse_max"]
    assert impulse == pytest.approx(result["impact_impulse"].values[0])


def test_the_speeds_after_the_first_impact():
    """ω⁺ of crank and rod, and their angles; the restitution is that of the gap."""
    after = FIRST + 1e-11
    result = simulate(guide(), 2 * after, 2)
    crank, rod = (result["link"].values.tolist().index(link) for link in ("crank", "rod"))
    angle, speed = (result[f"link_angle{suffix}"].values[:, 1] for suffix in ("", "_velocity"))
    assert angle[[crank, rod]] == pytest.approx([0.355304455, -0.171509541], abs=3e-9)
    assert speed[[crank, rod]] == pytest.approx([108.724580, -52.842290], rel=2e-8)
    back, to = result["impact_separation"].values[:2], result["impact_approach"].values[:2]
    assert back == pytest.approx(0.4 * to, rel=1e-12)
    assert np.all(result["impact_impulse"].values > 0)


def test_impacts_without_end_are_ended_by_one_without_restitution(monkeypatch):
    monkeypatch.setattr(impact_motion, "CROWD", 2)
    monkeypatch.setattr(impact_motion, "CROWDED", 1.0)
    result = simulate(guide(), 7e-3, 7)
    (finding,) = [one for one in result.trunnion.findings if one.code == "simulate.restitution_lowered"]
    assert finding.figures["time"] == pytest.approx(SECOND, rel=1e-8)
    assert finding.figures["share"] == 0.0
    assert events(result, "closes", "S.1")[0] == pytest.approx(SECOND, rel=1e-8)
    assert balanced(result)


def falling(restitution, **more):
    """A slider that falls through the play of its guide, on a shoe that holds it upright."""
    along, upward = {"at": [0, 0], "axis": [1, 0]}, {"at": [0, 0], "axis": [0, 1]}
    return Mechanism(
        gravity=[0, -9.81],
        links={
            "frame": {"points": {"S": along, "Y": along}},
            "slider": {"points": {"S": along, "B": [0, 0]}, "mass": 0.3, "inertia": 1e-4},
            "shoe": {"points": {"B": [0, 0], "X": upward}},
            "ram": {"points": {"X": upward, "Y": along}},
        },
        ground="frame",
        joints=joined("frame =S= slider -B- shoe, frame =Y= ram =X= shoe",
                      S={"guide": GUIDE, "contact": {"law": "rigid", "restitution": restitution}}),
        drivers={"Y": {"speed": 0.01, "range": [0, 1]}},
        **more,
    )  # fmt: skip


@pytest.mark.parametrize(("restitution", "drag"), [(0.3, 0.0), pytest.param(0.5, 2.0, marks=pytest.mark.slow)])
def test_a_falling_slider_bounces_ever_lower_and_comes_to_rest(restitution, drag):
    """It falls with g − R/m and rises with g + R/m under a resistance R beside it; all bounces are a geometric series,
    and the drop's energy is lost."""
    load = {"loads": {"drag": {"joint": "X", "resisting_force": drag}}} if drag else {}
    result = simulate(falling(restitution, **load), 0.2, 10)
    down, up = 9.81 - drag / 0.3, 9.81 + drag / 0.3
    first, speed, slower = np.sqrt(2 * CLEARANCE / down), np.sqrt(2 * CLEARANCE * down), np.sqrt(down / up)
    rest = first + restitution * speed * (1 / up + slower / down) / (1 - restitution * slower)
    for corner in ("S.3", "S.4"):
        assert events(result, "impact", corner)[0] == pytest.approx(first, rel=1e-8)
        assert events(result, "closes", corner) == [pytest.approx(rest, rel=1e-5)]
    assert result["contact_touching"].values[:, -1].tolist() == [0, 0, 1, 1]
    lost = float(result["work_contact"][-1] - result["work_loads"][-1])
    assert lost == pytest.approx(0.3 * 9.81 * CLEARANCE, rel=1e-8)
    assert not codes(result)


@pytest.mark.slow
def test_an_impact_that_closes_a_contact_tears_a_joint_loose():
    """The crank sticks until the slider, which falls, has landed; nothing of its energy is lost but in friction."""
    data = guide(0.0, {**RIGID, "restitution": 0.0}).data()
    data["joints"]["O"]["losses"] = {"constant": 0.5}
    data["drivers"]["O"]["initial"] = {"coordinate": 0.5, "speed": 0.0}
    found = simulate(Mechanism(**data), 0.0165, 2)
    kinds = [kind for kind, *_ in attribute(found, "events")]
    assert kinds == ["stick", "impact", "impact", "break-away", "closes", "closes", "stick"]
    assert balanced(found)


def test_a_pin_closes_in_its_hole_and_the_account_is_right():
    """The crank is driven evenly: what it gives in an impact is part of the account."""
    result = simulate(pin({"law": "rigid", "restitution": 0.5}, 0.2), 1.5e-3, 15)
    struck = events(result, "impact", "Q")
    assert struck[0] == pytest.approx(2.2728603e-4, rel=1e-7)
    (closes,) = events(result, "closes", "Q")
    assert struck[-1] < closes < struck[-1] + 1e-8
    closed = result["time"].values > closes
    assert np.hypot(*result["contact_offset"].values[0])[closed] == pytest.approx(0.5e-3, rel=1e-12)
    assert balanced(result)


@pytest.mark.slow
def test_stiff_contacts_tend_to_rigid_impacts():
    """What misses falls with the time of a contact, as K^(−2/5): by 6.3 for a stiffness a hundred times as large."""
    rigid = simulate(pin({"law": "rigid", "restitution": 0.9}), 7e-4, 4)
    missed = []
    for stiffness in (1e11, 1e13):
        soft = simulate(pin({"law": "restitution", "restitution": 0.9, "stiffness": stiffness}), 7e-4, 4)
        missed.append([
            abs(float(soft[name].values[at] - rigid[name].values[at]))
            for name, at in (("impact_separation", 0), ("impact_begin", 1), ("impact_impulse", 0))
        ])  # fmt: skip
        assert float(soft["impact_begin"].values[0]) == pytest.approx(float(rigid["impact_begin"].values[0]), rel=1e-9)
    for wide, narrow in zip(*missed, strict=True):
        assert 4.5 < wide / narrow < 8.5
    assert missed[1][0] < 0.013 * 4.3858
