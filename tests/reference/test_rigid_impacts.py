"""Impacts of rigid bodies in play against published times, limits and laws."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import trunnion.dynamics.impact_motion as impact_motion
from trunnion import simulate
from trunnion.dynamics.compiled_closed import compiled_closed
from trunnion.dynamics.opened import opened
from trunnion.dynamics.rates import Layout, Walks
from trunnion.dynamics.start import initial_row
from trunnion.dynamics.state import FreeMotion, rates_of
from trunnion.dynamics.stated_contacts import contacts_of
from trunnion.dynamics.touching import Closed
from trunnion.errors import MechanismError
from trunnion.model.mechanism import Mechanism
from trunnion.results.attributes import attribute, summary_of
from trunnion.solve.run import prepare

FIRST, SECOND = 2.692502752e-3, 5.612363190e-3  # s, of Flores, Leine, Glocker's slider
CLEARANCE = 1e-3  # m; what a step tells of its inside is exact to the integrator's tolerance
RIGID = {"law": "rigid", "restitution": 0.4}


def guide(friction: float = 0.01, contact: dict[str, Any] | None = None, **initial: float) -> Mechanism:
    """The slider-crank with a slider in play of P. Flores, R. Leine, Ch. Glocker, Multibody Syst. Dyn. 23 (2010)
    165-190, doi:10.1007/s11044-009-9178-y."""
    return Mechanism(
        gravity=[0, -9.81],
        links={
            "frame": {"points": {"O": [0, 0], "S": {"at": [0, 0], "axis": [1, 0]}}},
            "crank": {
                "points": {"O": [0, 0], "A": [0.153, 0]},
                "mass": 0.038,
                "inertia": 7.4e-5,
                "centre": [0.0765, 0],
            },
            "rod": {"points": {"A": [0, 0], "B": [0.306, 0]}, "mass": 0.038, "inertia": 5.9e-4, "centre": [0.153, 0]},
            "slider": {"points": {"B": [0, 0], "S": {"at": [0, 0], "axis": [1, 0]}}, "mass": 0.076, "inertia": 2.7e-6},
        },
        ground="frame",
        joints={
            "O": {"type": "revolute", "links": ["frame", "crank"]},
            "A": {"type": "revolute", "links": ["crank", "rod"]},
            "B": {"type": "revolute", "links": ["rod", "slider"]},
            "S": {
                "type": "prismatic",
                "links": ["frame", "slider"],
                "guide": {"length": 0.1, "height": 0.05, "clearance": CLEARANCE},
                "friction": friction,
                "contact": contact or RIGID,
            },
        },
        drivers={"O": {"speed": 150, "free": True, "initial": {"coordinate": 0, "speed": 150, **initial}}},
        assembly={"S": [0.459, 0]},
    )


def pin(contact: dict[str, Any], friction: float = 0.0) -> Mechanism:
    """A slider-crank whose crank is driven evenly, with a worn pin at its slider."""
    return Mechanism(
        links={
            "frame": {"points": {"O": [0, 0], "S": {"at": [0, 0], "axis": [1, 0]}}},
            "crank": {"points": {"O": [0, 0], "P": [0.05, 0]}},
            "rod": {"points": {"P": [0, 0], "Q": [0.12, 0]}, "mass": 0.21, "inertia": 2.5e-4, "centre": [0.06, 0]},
            "slider": {"points": {"Q": [0, 0], "S": {"at": [0, 0], "axis": [1, 0]}}, "mass": 0.14},
        },
        ground="frame",
        joints={
            "O": {"type": "revolute", "links": ["frame", "crank"]},
            "P": {"type": "revolute", "links": ["crank", "rod"]},
            "Q": {
                "type": "revolute",
                "links": ["rod", "slider"],
                "pin": {"radius": 9.5e-3, "hole_radius": 10e-3},
                "contact": contact,
                **({"friction": friction} if friction else {}),
            },
            "S": {"type": "prismatic", "links": ["frame", "slider"]},
        },
        drivers={"O": {"speed": 523.5987755983}},
        assembly={"Q": [0.17, 0]},
    )


def events(result: Any, kind: str, of: str) -> list[float]:
    rows = attribute(result, "events")
    return [float(t) for row, t in zip(rows, result["event_time"].values, strict=True) if row[:2] == [kind, of]]


def balanced(result: Any) -> bool:
    """Whether the energy account is right to 1e-8 of the energy turned over."""
    moved = max(float(np.nanmax(np.abs(result[name].values))) for name in ("work_drive", "work_contact"))
    return bool(np.nanmax(np.abs(result["energy_residual"].values)) < 1e-8 * moved)


def codes(result: Any) -> list[str]:
    return [one.code for one in result.trunnion.findings]


# ---- the slider in its guide ------------------------------------------------------------------------------------


def test_a_slider_in_its_guide_strikes_closes_and_lifts_off() -> None:
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


def test_the_speeds_after_the_first_impact() -> None:
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


def test_impacts_without_end_are_ended_by_one_without_restitution(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(impact_motion, "CROWD", 2)
    monkeypatch.setattr(impact_motion, "CROWDED", 1.0)
    result = simulate(guide(), 7e-3, 7)
    (finding,) = [one for one in result.trunnion.findings if one.code == "simulate.restitution_lowered"]
    assert finding.figures["time"] == pytest.approx(SECOND, rel=1e-8)
    assert finding.figures["share"] == 0.0
    assert events(result, "closes", "S.1")[0] == pytest.approx(SECOND, rel=1e-8)
    assert balanced(result)


def falling(restitution: float, **more: Any) -> Mechanism:
    """A slider that falls through the play of its guide, on a shoe that holds it upright."""
    along, upward = {"at": [0, 0], "axis": [1, 0]}, {"at": [0, 0], "axis": [0, 1]}
    play = {"guide": {"length": 0.1, "height": 0.05, "clearance": CLEARANCE}}
    return Mechanism(
        gravity=[0, -9.81],
        links={
            "frame": {"points": {"S": along, "Y": along}},
            "slider": {"points": {"S": along, "B": [0, 0]}, "mass": 0.3, "inertia": 1e-4},
            "shoe": {"points": {"B": [0, 0], "X": upward}},
            "ram": {"points": {"X": upward, "Y": along}},
        },
        ground="frame",
        joints={
            "S": {"type": "prismatic", "links": ["frame", "slider"], **play,
                  "contact": {"law": "rigid", "restitution": restitution}},
            "B": {"type": "revolute", "links": ["slider", "shoe"]},
            "X": {"type": "prismatic", "links": ["ram", "shoe"]},
            "Y": {"type": "prismatic", "links": ["frame", "ram"]},
        },
        drivers={"Y": {"speed": 0.01, "range": [0, 1]}},
        **more,
    )  # fmt: skip


@pytest.mark.parametrize(("restitution", "drag"), [(0.3, 0.0), pytest.param(0.5, 2.0, marks=pytest.mark.slow)])
def test_a_falling_slider_bounces_ever_lower_and_comes_to_rest(restitution: float, drag: float) -> None:
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


def with_friction_elsewhere(own: float, names: str = "OA", **more: Any) -> Mechanism:
    """The guide with friction of its own in the contacts, and more of the pins of some names."""
    data = {key: part for key, part in guide(own).data().items() if part and key not in ("trunnion", "space")}
    joints = {name: dict(one) for name, one in data["joints"].items()}
    for name in names:
        joints[name] |= more
    return Mechanism(**{**data, "joints": joints})


@pytest.mark.slow
def test_friction_of_other_joints_beside_rigid_impacts() -> None:
    """Coulomb's, at rest and sliding: the account is right, and less of the speed is left than without."""
    pins = {"pin": {"radius": 0.01}, "friction": 0.3}
    found, bare = (simulate(model, 6e-3, 6) for model in (with_friction_elsewhere(0.0, **pins), guide(0.0)))
    assert {of for kind, of, *_ in attribute(found, "events") if kind == "impact"} >= {"S.1", "S.2"}
    assert float(found["work_friction"][-1]) > 0
    assert abs(found["drive_rate"].values[0, -1]) < abs(bare["drive_rate"].values[0, -1])
    assert balanced(found)


def test_an_impact_that_closes_a_contact_tears_a_joint_loose() -> None:
    """The crank sticks until the slider, which falls, has landed; nothing of its energy is lost but in friction."""
    data = with_friction_elsewhere(0.0, "O", losses={"constant": 0.5}).data()
    data["joints"]["S"]["contact"]["restitution"] = 0.0
    data["drivers"]["O"]["initial"] = {"coordinate": 0.5, "speed": 0.0}
    found = simulate(Mechanism(**data), 0.0165, 2)
    kinds = [kind for kind, *_ in attribute(found, "events")]
    assert kinds == ["stick", "impact", "impact", "break-away", "closes", "closes", "stick"]
    assert balanced(found)


def test_friction_in_contacts_and_what_may_hold_a_joint_are_refused_together() -> None:
    """At rest both could take the load, and how they share it is not solved."""
    with pytest.raises(MechanismError) as caught:
        simulate(with_friction_elsewhere(0.01, losses={"constant": 0.5}), 1e-3)
    assert {one.where for one in caught.value.findings} == {"joints.O.losses.constant", "joints.A.losses.constant"}
    assert "beside friction between rigid bodies in S" in caught.value.findings[0].what


# ---- closed, stuck and jammed -----------------------------------------------------------------------------------


def test_without_restitution_the_first_impact_closes() -> None:
    result = simulate(guide(contact={"law": "rigid", "restitution": 0}), 4e-3, 8)
    assert events(result, "closes", "S.1") == events(result, "impact", "S.1")
    assert np.all(np.abs(result["contact_gap"].values[0, -2:]) < 1e-9 * CLEARANCE)
    assert balanced(result)


@pytest.mark.slow
def test_a_slider_comes_to_rest_on_its_wall() -> None:
    """At a friction of 1.5 gravity does not move the crank on: it rests for good, held within the cone."""
    result = simulate(guide(1.5, {"law": "rigid", "restitution": 0.5}, coordinate=1.0, speed=20), 0.6, 20)
    assert np.all(np.abs(result["drive_rate"].values[0, -5:]) < 1e-12)
    touching = result["contact_touching"].values[:, -1]
    assert touching.tolist() == [0, 0, 1, 1]  # on the lower wall
    normal, friction = (result[f"contact_{name}_force"].values[2:, -1] for name in ("normal", "friction"))
    assert np.all(np.abs(friction) < 1.5 * normal)
    assert balanced(result)


@pytest.mark.slow
def test_a_guide_that_jams_says_so_and_keeps_what_was_found() -> None:
    result = simulate(guide(3.0, {"law": "rigid", "restitution": 0.5}, coordinate=1.0, speed=20), 0.2, 20)
    (jam,) = [one for one in result.trunnion.findings if one.code == "simulate.no_contact_force"]
    (lowered,) = [one for one in result.trunnion.findings if one.code == "simulate.restitution_lowered"]
    assert 0 < lowered.figures["share"] < 1
    rate, time = result["drive_rate"].values[0], result["time"].values
    assert np.all(np.isfinite(rate) == (time <= jam.figures["time"]))
    assert balanced(result)


# ---- the pin in its hole ----------------------------------------------------------------------------------------


def test_a_pin_closes_in_its_hole_and_the_account_is_right() -> None:
    """The crank is driven evenly: what it gives in an impact is part of the account."""
    result = simulate(pin({"law": "rigid", "restitution": 0.5}, 0.2), 1.5e-3, 15)
    struck = events(result, "impact", "Q")
    assert struck[0] == pytest.approx(2.2728603e-4, rel=1e-7)
    (closes,) = events(result, "closes", "Q")
    assert struck[-1] < closes < struck[-1] + 1e-8
    closed = result["time"].values > closes
    radius = np.hypot(*result["contact_offset"].values[0])
    assert radius[closed] == pytest.approx(0.5e-3, rel=1e-12)
    assert balanced(result)


def trammel(clearance: float = 2e-4, friction: float = 0.05) -> Mechanism:
    """A rod whose ends slide in guides at right angles, both in play; nothing else connects it with the ground."""
    points = {"H": {"at": [0, 0], "axis": [1, 0]}, "V": {"at": [0, 0], "axis": [0, 1]}}
    guide_ = {"guide": {"length": 0.06, "height": 0.03, "clearance": clearance}, "contact": RIGID}
    guide_["friction"], slider = friction, {"mass": 0.5, "inertia": 2e-4}
    return Mechanism(
        gravity=[0, -9.81],
        links={
            "frame": {"points": points},
            "h": {"points": {"H": points["H"], "A": [0, 0]}, **slider},
            "v": {"points": {"V": points["V"], "B": [0, 0]}, **slider},
            "rod": {"points": {"A": [0, 0], "B": [0.2, 0]}, "mass": 0.3, "centre": [0.1, 0], "inertia": 1e-3},
        },
        ground="frame",
        joints={
            "H": {"type": "prismatic", "links": ["frame", "h"], **guide_},
            "V": {"type": "prismatic", "links": ["frame", "v"], **guide_},
            "A": {"type": "revolute", "links": ["h", "rod"]},
            "B": {"type": "revolute", "links": ["v", "rod"]},
        },
        drivers={"A": {"free": True, "range": ["120 deg", "179 deg"], "speed": 1}},
        assembly={"B": [0, 0.1732]},
    )


def test_machine_code_of_closed_contacts_and_walks() -> None:
    """Rates, works, forces of contacts and what impulses come to, for contacts that fly, slip and stick."""
    mechanism = trammel()
    run = prepare(mechanism)
    motion = FreeMotion.of(prepare(opened(run).mechanism), contacts_of(run, ["H", "V"]))
    fast, slow, layout = compiled_closed(motion), Walks(motion), Layout.of(motion)
    assert fast is not None
    row = initial_row(motion)
    row[layout.coordinates : 2 * layout.coordinates] = [0.3, -0.2, 0.5, 2.0, -1.0]
    fly: Any = (None,) * 8
    sets: list[dict[int, Closed]] = [{2: Closed(1), 3: Closed(-1)}, {2: Closed(0), 3: Closed(0), 4: Closed(-1)}]
    for closed in ({}, *sets):
        onsets = tuple(closed.get(k, fly[k]) for k in range(8))
        found, expected = fast.derivative(0.0, row, onsets, 0.0), slow.derivative(0.0, row, onsets, 0.0)
        assert found == pytest.approx(expected, rel=1e-10, abs=1e-9)
        at = layout.moment(np.zeros(2), np.column_stack([row, row]))._replace(onsets=onsets)
        if closed:
            for here, there in zip(fast.touches(at), slow.touches(at), strict=True):
                np.testing.assert_allclose(here, there, rtol=1e-10, atol=1e-10)
    one = layout.moment(np.zeros(1), row[:, None])._replace(onsets=fly)
    for here, there in zip(fast.linear(one), slow.linear(one), strict=True):
        np.testing.assert_allclose(here, there, rtol=1e-9, atol=1e-9)


def test_a_rod_in_two_guides_keeps_its_account() -> None:
    """A loose link with a joint at its mass centre, and contacts that close on both guides."""
    found = simulate(trammel(), 0.03, 30)
    assert {"H.3", "H.4", "V.1", "V.2"} <= {
        label for label in found["contact"].values if len(events(found, "closes", label))
    }
    assert balanced(found)
    assert attribute(found, "findings") == []


@pytest.mark.slow
def test_impacts_that_accumulate_on_two_guides_at_once_come_to_rest() -> None:
    """A contact that another lets go lower than rounding stays closed, and one that is a rounding below its wall as the
    other strikes does not strike again."""
    found = simulate(trammel(2e-5, 0.1), 0.29, 30)  # at 0.2917 s it reaches the end of its range
    assert codes(found) == []
    assert balanced(found)


@pytest.mark.slow
def test_stiff_contacts_tend_to_rigid_impacts() -> None:
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


# ---- accelerations at contacts ----------------------------------------------------------------------------------


@pytest.mark.parametrize("mechanism", [guide(), pin(RIGID)])
def test_gaps_and_slips_accelerate_as_their_rates_change(mechanism: Mechanism) -> None:
    """Against central differences of the rates along a motion."""
    run, random = prepare(mechanism), np.random.default_rng(7)
    playing = [name for name, joint in mechanism.effective_joints.items() if joint.contact is not None]
    motion = FreeMotion.of(prepare(opened(run).mechanism), contacts_of(run, playing))
    layout, row = Layout.of(motion), initial_row(motion)
    q, rate, second = (random.normal(size=(len(motion.names), 1)) * size for size in (0.2, 30.0, 500.0))
    q[:, 0] = 0.02 * q[:, 0] + row[: len(q)] + 0.3
    time, step = 1e-3, 1e-6

    def at(shift: float) -> Any:
        places = q + shift * rate + 0.5 * shift**2 * second
        rows = np.vstack([places, rate + shift * second, np.zeros((layout.size - 2 * len(q), 1))])
        return motion.walk(layout.moment(np.array([time + shift]), rows), second)

    before, after = (rates_of(motion.contacts.states(at(side * step)))[:, 0] for side in (-1, 1))
    here = at(0.0)
    found = [one.accelerations(here) for one in motion.contacts.each]
    exact = np.array([gap[0] for gap, _ in found] + [slip[0] for _, slip in found])
    assert exact == pytest.approx((after - before) / (2 * step), rel=1e-6)


# ---- what is stated ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("contact", "where"),
    [
        ({"law": "rigid"}, ""),
        ({"law": "rigid", "restitution": 0.5, "stiffness": 1e9}, ".stiffness"),
        ({"law": "rigid", "restitution": 0.5, "modulus": "210 GPa"}, ".modulus"),
        ({"law": "rigid", "restitution": -0.1}, ".restitution"),
        ({"law": "rigid", "restitution": 1.1}, ".restitution"),
        ({"law": "restitution", "restitution": 0, "stiffness": 1e9}, ".restitution"),
    ],
)
def test_contacts_that_cannot_be(contact: dict[str, Any], where: str) -> None:
    with pytest.raises(MechanismError) as raised:
        pin(contact)
    assert [one.where for one in raised.value.findings] == [f"joints.Q.contact{where}"]


def test_motions_that_cannot_be() -> None:
    data = {key: part for key, part in guide().data().items() if part and key not in ("trunnion", "space")}
    joints = {name: dict(one) for name, one in data["joints"].items()}
    joints["B"] |= {"pin": {"clearance": 1e-4}, "contact": {"law": "hertz", "stiffness": 1e9}}
    with pytest.raises(MechanismError) as raised:
        simulate(Mechanism(**{**data, "joints": joints}), 1e-4, 1)
    assert [one.where for one in raised.value.findings] == ["joints.B.contact.law"]
    joints = {name: dict(one) for name, one in data["joints"].items()}
    joints["S"]["friction"] = {"law": "viscous", "coefficient": 0.1, "viscous": 0.1}
    with pytest.raises(MechanismError) as raised:
        simulate(Mechanism(**{**data, "joints": joints}), 1e-4, 1)
    assert [one.where for one in raised.value.findings] == ["joints.S.friction"]


@pytest.mark.slow
def test_several_joints_in_play_at_once() -> None:
    """A rod that no joint holds, between two worn pins, and a slider with play: some strike while others are closed."""
    data = {key: part for key, part in pin({"law": "rigid", "restitution": 0.6}, 0.15).data().items()
            if key in ("links", "ground", "joints", "drivers", "assembly")}  # fmt: skip
    joints = {name: dict(one) for name, one in data["joints"].items()}
    joints["P"] |= {key: joints["Q"][key] for key in ("pin", "contact", "friction")}
    joints["S"] |= {"guide": {"length": 0.05, "height": 0.03, "clearance": 2e-4}, "contact": RIGID}
    links = {name: dict(one) for name, one in data["links"].items()}
    links["slider"]["inertia"] = 3e-5
    result = simulate(Mechanism(**{**data, "links": links, "joints": joints}), 7.5e-4, 6)
    struck = {of for kind, of, *_ in attribute(result, "events") if kind == "impact"}
    assert {"P", "Q"} < struck
    assert np.all(result["contact_gap"].values > -1e-9 * CLEARANCE)
    assert balanced(result)
    assert not codes(result)
