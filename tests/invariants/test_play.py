"""What holds for the play of every pair and linkage, and seats where there is little to seat."""

from __future__ import annotations

import copy
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import mechanisms
import trunnion
from played import by_duals, plays, with_play
from trunnion import Mechanism, analyse, read
from trunnion.algebra.dual import Dual, derivative
from trunnion.algebra.space import ORIGIN, Frame, compose, relative
from trunnion.cycle.findings import listed
from trunnion.joints.clearance import (
    CLEARANCE_MODELS,
    described,
    describing,
    leaning,
    pin_transform,
    pressed,
    turned_by_friction,
    worst_case,
)
from trunnion.measures.measures import named
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import prepare

angles = st.floats(-3.1, 3.1)
radii = st.floats(1e-7, 1e-2)
lengths = st.floats(5e-3, 1.0)
components = st.floats(-1e4, 1e4).filter(lambda n: n == 0 or abs(n) > 1e-6)
frictions = st.floats(0, 2)
rates = st.floats(-50, 50).filter(lambda n: n == 0 or abs(n) > 1e-9)
MODELS = [model for models in CLEARANCE_MODELS.values() for model in models.values()]
PINS = [CLEARANCE_MODELS["spatial"][kind] for kind in ("revolute", "cylindrical")]


def entries(frame: Frame) -> Any:
    return np.array([[float(n) for n in vector] for vector in frame])


def vectors(count: int) -> Any:
    return st.tuples(*[components] * count)


def spun(vector: Any, angle: float) -> tuple[float, ...]:
    """A vector in x and y turned about z."""
    x, y = np.cos(angle) * vector[0] - np.sin(angle) * vector[1], np.sin(angle) * vector[0] + np.cos(angle) * vector[1]
    return (float(x), float(y), *vector[2:])


# ---- the shift ------------------------------------------------------------------------------------------------


@given(radii, lengths, angles, angles)
def test_shift_of_the_described_ends(rho: float, length: float, beta: float, xi: float) -> None:
    """[P]'s description and its end offsets are one pin; the offsets come back as β and ξ."""
    ends = described(rho, beta, xi)
    for play in PINS:
        found = entries(play.shift(ends, length))
        np.testing.assert_allclose(found, entries(pin_transform(rho, length, beta, xi)), rtol=0, atol=1e-15)
    found_beta, found_xi = describing(*ends)
    assert float(found_beta) == pytest.approx(beta, abs=1e-14)
    assert np.cos(float(found_xi) - xi) == pytest.approx(1, abs=1e-14)
    assert [np.hypot(*end) for end in ends] == pytest.approx([rho, rho])


@given(st.tuples(angles, angles), st.tuples(angles, angles))
def test_leaning_is_the_shortest_turn(across: tuple[float, float], place: tuple[float, float]) -> None:
    """A rotation whose axis is in x, y: R_xy = R_yx, trace 1 + 2 cos of the lean, and back again by −R's lean."""
    frame = entries(leaning(across, 0.3, place))
    axes = frame[:3]
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), rtol=0, atol=1e-15)
    assert np.linalg.det(axes) == pytest.approx(1, abs=1e-15)
    assert axes[0, 1] == axes[1, 0]
    assert np.trace(axes) == pytest.approx(1 + 2 / np.sqrt(1 + across[0] ** 2 + across[1] ** 2), abs=1e-15)
    assert axes[2] / axes[2, 2] == pytest.approx([*across, 1.0], abs=1e-13)
    there = compose(leaning(across), leaning((-across[0], -across[1])))
    np.testing.assert_allclose(entries(there)[:3], np.eye(3), rtol=0, atol=1e-15)
    back = relative(ORIGIN, leaning(across))
    np.testing.assert_allclose(entries(back)[:3], axes.T, rtol=0, atol=1e-15)


# ---- seats ----------------------------------------------------------------------------------------------------


@given(st.integers(1, 3).flatmap(vectors), radii, st.floats(1e-3, 1e3))
def test_a_seat_depends_on_the_direction_of_the_load(load: tuple[float, ...], rho: float, factor: float) -> None:
    """Odd, the same for any size of load, on the wall; in the middle without load."""
    seat = pressed(load, rho)
    size = float(np.linalg.norm(load))
    if size == 0:
        assert seat == (0.0,) * len(load)
        return
    assert np.linalg.norm(seat) == pytest.approx(rho, rel=1e-15)
    assert pressed(tuple(-n for n in load), rho) == tuple(-n for n in seat)
    np.testing.assert_allclose(pressed(tuple(factor * n for n in load), rho), seat, rtol=1e-14)
    assert float(np.dot(load, seat)) == pytest.approx(float(worst_case([load], [rho])), rel=1e-14)
    assert pressed(tuple(float(n) for n in seat), rho) == pytest.approx(seat, rel=1e-14)


@given(vectors(2), radii, angles)
def test_derivative_of_the_worst_case_is_the_seat(load: tuple[float, float], rho: float, way: float) -> None:
    """∂(ρ |Q|)/∂Q = c: what a little more load adds to the worst case is where the pin lies."""
    assume(np.hypot(*load) > 0)
    direction = (np.cos(way), np.sin(way))
    lifted = tuple(Dual(q, d) for q, d in zip(load, direction, strict=True))
    slope = float(derivative(worst_case([lifted], [rho])))
    assert slope == pytest.approx(float(np.dot(pressed(load, rho), direction)), rel=1e-12, abs=1e-15 * rho)


# ---- friction -------------------------------------------------------------------------------------------------


@given(vectors(2), frictions, rates)
def test_friction_turns_without_changing_the_size(load: tuple[float, float], mu: float, rate: float) -> None:
    """|n| = |Q|; slip the other way turns the other way; the mirror image is turned back; odd in the load."""
    found = np.array(turned_by_friction(load, mu, (rate,)))
    assert np.hypot(*found) == pytest.approx(np.hypot(*load), rel=1e-14)
    other = np.array(turned_by_friction(load, mu, (-rate,)))
    mirrored = np.array(turned_by_friction((load[0], -load[1]), mu, (-rate,)))
    np.testing.assert_allclose(mirrored, found * [1, -1], rtol=1e-14)
    np.testing.assert_allclose(turned_by_friction((-load[0], -load[1]), mu, (rate,)), -found, rtol=1e-14)
    cosine = 1 / np.hypot(1, mu) if rate else 1.0
    np.testing.assert_allclose(found + other, 2 * cosine * np.array(load), rtol=0, atol=1e-14 * np.hypot(*load))


@given(vectors(3), frictions, st.tuples(rates, rates, rates), angles, st.floats(1e-3, 1e3))
def test_friction_of_a_ball_has_no_axes_of_its_own(
    load: tuple[float, ...], mu: float, spin: tuple[float, ...], turn: float, factor: float
) -> None:
    """Turned about z and mirrored with load and spin; any size of spin; |n| = |Q|."""
    size, rate = np.linalg.norm(load), np.linalg.norm(spin)
    assume(size > 0 and rate > 0)
    # near the cone where the ball gets on its pole the contact moves as a square root
    cosine = abs(np.dot(load, spin)) / (size * rate)
    assume(abs(cosine - 1 / np.hypot(1, mu)) > 1e-3)
    found = np.array(turned_by_friction(load, mu, spin), float)
    assert np.linalg.norm(found) == pytest.approx(size, rel=1e-12)
    near = {"rtol": 0.0, "atol": 1e-10 * size}
    np.testing.assert_allclose(turned_by_friction(load, mu, tuple(factor * n for n in spin)), found, **near)
    np.testing.assert_allclose(turned_by_friction(spun(load, turn), mu, spun(spin, turn)), spun(found, turn), **near)
    cycled = turned_by_friction((load[2], load[0], load[1]), mu, (spin[2], spin[0], spin[1]))
    np.testing.assert_allclose(cycled, [found[2], found[0], found[1]], **near)
    # a spin is an axial vector: in the mirror x → −x its other components change sign
    mirrored = turned_by_friction((-load[0], load[1], load[2]), mu, (spin[0], -spin[1], -spin[2]))
    np.testing.assert_allclose(mirrored, [-found[0], found[1], found[2]], **near)
    flat = turned_by_friction((load[0], load[1], 0.0), mu, (0.0, 0.0, spin[2]))
    expected = turned_by_friction((load[0], load[1]), mu, (spin[2],))
    np.testing.assert_allclose(flat[:2], expected, **near)
    assert flat[2] == 0


@pytest.mark.parametrize("model", PINS)
def test_a_force_at_one_end_of_a_pin_presses_there_alone(model: Any) -> None:
    """A force at z = ±H/2 has the moment r × F about mid-length; the other end feels nothing of it."""
    force, length = np.array([30.0, -40.0, 0.0]), 0.08
    for end, z in ((0, -length / 2), (1, length / 2)):
        moment = np.cross([0.0, 0.0, z], force)
        loads = model.loads(tuple(force), tuple(moment), length)
        np.testing.assert_allclose(loads[end], force[:2], atol=1e-12)
        np.testing.assert_allclose(loads[1 - end], 0.0, atol=1e-12)


STEPS = 8
clearances = st.floats(1e-7, 1e-4)


def played(mechanism: Mechanism, *measures: str) -> xr.Dataset:
    return trunnion.play(mechanism, list(measures) or None, STEPS)


@settings(max_examples=3)
@given(st.lists(clearances, min_size=3, max_size=3))
def test_joints_add_up(found: list[float]) -> None:
    """A joint's part is the same alone or beside others; the totals are the sum and the root of squares."""
    base, data, alone = mechanisms.four_bar(), mechanisms.four_bar(), []
    for joint, clearance in zip("BCD", found, strict=True):
        one = copy.deepcopy(base)
        one["joints"][joint]["pin"] = {"radius": 0.01, "clearance": clearance}
        data["joints"][joint]["pin"] = {"radius": 0.01, "clearance": clearance}
        alone.append(played(Mechanism(trunnion=1, **one), "rotation:D"))
    together = played(Mechanism(trunnion=1, **data), "rotation:D")
    for joint, one in zip("BCD", alone, strict=True):
        part = together["worst_case"].sel(joint=joint)
        np.testing.assert_allclose(part, one["worst_case"].sel(joint=joint), rtol=1e-12)
    total = sum(one["worst_case_total"] for one in alone)
    np.testing.assert_allclose(together["worst_case_total"], total, rtol=1e-12)
    scatter = sum(one["deviation_total"] ** 2 for one in alone)
    np.testing.assert_allclose(together["deviation_total"] ** 2, scatter, rtol=1e-12)


def test_no_clearance_no_effect() -> None:
    result = played(with_play(mechanisms.model(mechanisms.slider_crank()), 0.0), "slide:C", "effort:A")
    assert np.all(result["worst_case"].values == 0)
    assert np.all(result["deviation"].values == 0)
    assert np.any(result["sensitivity"].values != 0)


@pytest.mark.parametrize("name", ["slider-crank", "class III"])
def test_which_link_has_the_hole_does_not_matter(name: str) -> None:
    """To first order: pins and holes changed over have the same worst case; a turn has the other sign."""
    data = mechanisms.MODELS[name]()
    turned = copy.deepcopy(data)
    link = next(link for link in data["links"] if link != "ground")
    for joint, stated in turned["joints"].items():
        if joint not in data["drivers"] and stated["type"] == "revolute":  # the middle of a guide is on one link only
            stated["links"] = stated["links"][::-1]
    first = next(iter(data["links"][link]["points"]))
    names = [f"{other}.{next(iter(data['links'][other]['points']))}.x" for other in data["links"] if other != "ground"]
    one, other = (played(with_play(case), *names, f"{link}.{first}.y") for case in (data, turned))
    np.testing.assert_allclose(other["worst_case"], one["worst_case"], rtol=1e-9, atol=1e-18)


def test_parts_are_the_norms_of_the_gradient() -> None:
    """With the same radius everywhere, Σ ρ²|Q|² over joints is ρ² times the squared length of the whole gradient."""
    run = prepare(with_play(mechanisms.MODELS["Watt six-bar"](), 1e-5))
    known, time = plays(run.system, run.values), run.cycle.times(STEPS)
    (measure,) = named(run.system.mechanism, ["rotation:G"], run.values)
    slopes = by_duals(run, measure, known, time, FrictionMethod())
    square = sum(part**2 for ends in slopes.values() for end in ends for part in end)
    result = played(with_play(mechanisms.MODELS["Watt six-bar"](), 1e-5), "rotation:G")
    np.testing.assert_allclose(result["rss"].values[0], 1e-5 * np.sqrt(square), rtol=1e-9)


EXAMPLES = Path(__file__).parents[2] / "examples"


def changed(name: str, values: dict[str, float | str]) -> Mechanism:
    return read(EXAMPLES / f"{name}.yaml").with_values(values)


def told(result: xr.Dataset, what: str) -> list[dict[str, Any]]:
    return [one for one in json.loads(result.attrs["findings"]) if one["code"] == what]


def test_a_passage_is_told_once_however_few_the_positions() -> None:
    """35.66° is 0.198 of two positions a turn."""
    result = analyse(read(EXAMPLES / "fourbar-with-play.yaml"), steps=2)
    found = {one["where"]: one["figures"] for one in told(result, "contact.lost")}
    (together,) = [where for where, figures in found.items() if figures["at"] == "at 35.66°, at 223.5°"]
    assert "B" in together
    assert found[together]["count"] == together.count(",") + 1 > 1  # the other pin of the coupler, in one finding
    assert len({figures["at"] for figures in found.values()}) == len(found)


def massless_compressor() -> dict[str, Any]:
    """The model's data, pins in loaded seats; without pressure, from 40° to 180°, nothing presses."""
    data = read(EXAMPLES / "slider-crank.yaml").data()
    data["gravity"] = [0, 0]
    for link in data["links"].values():
        for key in ("mass", "centre", "inertia"):
            link.pop(key, None)
    data["joint_defaults"] = {"pin": {"clearance": "10 um"}, "seat": "loaded"}
    return data


@pytest.mark.slow
def test_a_stretch_without_load_is_one_loss_of_contact() -> None:
    """The massless compressor has no pressure from 40° to 180°: nothing presses there."""
    data = massless_compressor()
    result = analyse(Mechanism(**data), steps=360)
    lost = np.flatnonzero(result["contact_lost"].sel(joint="P"))
    assert np.array_equal(lost, np.arange(40, 181))
    assert np.all(result["seat_offset"].sel(joint="P", end="1", axis=["x", "y"]).isel(position=slice(41, 180)) == 0)
    (finding,) = told(result, "contact.unloaded")  # of all joints at once, and no loss of any of them
    assert finding["figures"] == {"joints": ["O", "P", "Q"], "at": "between 40° and 180°"}
    assert not told(result, "contact.lost")


@pytest.mark.slow
def test_figures_say_which_positions_they_are_of_where_contact_is_lost() -> None:
    """No load from 40° to 180°."""
    data = massless_compressor()
    data["measures"] = {"course": {"slide": "S"}, "stroke": {"stroke": "S"}, "mean": {"slide": "S", "as": "rms"}}
    data["measures"] |= {one: {"slide": "S", "as": one} for one in ("minimum", "maximum")}
    window = {"slide": "S", "over": ["50 deg", "170 deg"]}
    data["measures"] |= {"low": window | {"as": "minimum"}, "swing": window | {"as": "peak-to-peak"}}
    data["measures"]["there"] = {"slide": "S", "at": "90 deg"}
    result = analyse(Mechanism(**data), steps=360)
    valid = result["status"].values != 3
    slide = result["joint_slide"].sel(joint="S").values
    figures = {one.name: one for one in result.trunnion.summary}
    share = np.count_nonzero(~valid) / 360
    assert figures["S.stroke"].note == f"without {share:.2g} of the cycle"
    assert figures["S.stroke"].value == pytest.approx(figures["stroke"].value, rel=1e-4)
    assert figures["course.max"].value == pytest.approx(np.max(slide[valid]))
    dense = analyse(Mechanism(**data), steps=20_000)
    slide = dense["joint_slide"].sel(joint="S").values[dense["status"].values != 3]
    for name, pick in (("minimum", np.min), ("maximum", np.max)):
        assert figures[name].value == pytest.approx(pick(slide), rel=1e-5)  # valid, next to the stretch
    found = {one.where: one for one in result.trunnion.findings if one.code == "measure.contact_lost"}
    for name in ("low", "swing", "there"):
        assert figures[name].value is None
        assert "loses contact" in figures[name].note
        told = found[f"measures.{name}"].figures["at"]  # where, for a place or a window beside it
        assert told.endswith("°")
        assert told in figures[name].note
        assert np.isnan(result["measure_figure"].sel(measure=name))
    assert figures["mean"].value is not None
    assert "loses contact at " in figures["mean"].note


@pytest.mark.slow
@pytest.mark.parametrize("steps", [36, 97, 360])
def test_passages_are_found_between_wide_steps(steps: int) -> None:
    """At 4.96° the load of end 1 turns round within 0.05 of its peak; seen over a wide step it does so far from 0."""
    (finding,) = told(analyse(read(EXAMPLES / "rssr-with-play.yaml"), steps=steps), "contact.lost")
    first, *more = finding["figures"]["at"].split(", ")
    assert 4.89 < float(first.removeprefix("at ").removesuffix("° (end 1)")) < 4.97
    assert more == ["at 191.6° (end 1)", "at 191.6° (end 2)"]


@pytest.mark.parametrize(("pinch", "known"), [("0.05 mm", False), ("5 mm", True)])
def test_no_efficiency_where_the_pins_do_not_settle_over_much_of_the_work(pinch: str, known: bool) -> None:
    """A ram touches its work with the pins on one side of their holes and not on the other: what flows is not known.

    Pressed by much more than the play, nearly all of the work is known: it is that of the spring.
    """
    pin = {"at": [0, 0], "axis": [1, 0]}
    model = {
        "trunnion": 1, "name": "press", "space": "planar", "gravity": [0, 0],
        "dimensions": {"r": "40 mm", "l": "150 mm", "pinch": pinch},
        "links": {
            "ground": {"points": {"O": [0, 0], "S": pin, "W": ["r + l + 50 mm", 0]}},
            "crank": {"points": {"O": [0, 0], "P": ["r", 0]}},
            "rod": {"points": {"P": [0, 0], "Q": ["l", 0]}},
            "ram": {"points": {"Q": [0, 0], "S": pin}},
        },
        "joints": {
            "O": {"type": "revolute", "links": ["ground", "crank"]},
            "P": {"type": "revolute", "links": ["crank", "rod"]},
            "Q": {"type": "revolute", "links": ["rod", "ram"]},
            "S": {"type": "prismatic", "links": ["ground", "ram"], "friction": 0},
        },
        "joint_defaults": {"pin": {"radius": "5 mm", "clearance": "0.05 mm"}, "friction": 0.1, "seat": "loaded"},
        "drivers": {"O": {"range": ["-90 deg", "-1 deg"], "speed": "1 rad/s"}},
        "springs": {"work": {"between": ["ground.W", "ram.Q"], "stiffness": "800 N/mm", "only": "push", "useful": True,
                             "free_length": "50 mm + pinch"}},
        "assembly": {"Q": ["l", 0]},
    }  # fmt: skip
    figures = {one.name: one for one in analyse(Mechanism(**model), steps=36).trunnion.summary}
    for name in ("efficiency", "efficiency_error", "friction_power_mean"):
        assert (figures[name].value is not None) == known
    assert ("pins do not settle" in figures["efficiency"].note) != known
    assert figures["efficiency_ideal"].value is not None


def test_many_places_are_told_by_how_often_and_the_ends() -> None:
    places = [f"at {k}°" for k in range(12)]
    assert listed(places[:3]) == "at 0°, at 1°, at 2°"
    assert listed(places) == "12 times, first at 0°, last at 11°"
