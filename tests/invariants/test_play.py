"""What holds for the play of every pair and linkage, and seats where there is little to seat."""

import copy
import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import mechanisms
import trunnion
from mechanisms_parts import example, joined
from played import with_play
from trunnion import Mechanism, analyse
from trunnion.cycle.findings import listed
from trunnion.joints.clearance import CLEARANCE_MODELS, pressed, worst_case

radii = st.floats(1e-7, 1e-2)
components = st.floats(-1e4, 1e4).filter(lambda n: n == 0 or abs(n) > 1e-6)
PINS = [CLEARANCE_MODELS["spatial"][kind] for kind in ("revolute", "cylindrical")]


def vectors(count):
    return st.tuples(*[components] * count)


@given(st.integers(1, 3).flatmap(vectors), radii, st.floats(1e-3, 1e3))
def test_a_seat_depends_on_the_direction_of_the_load(load, rho, factor):
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


@pytest.mark.parametrize("model", PINS)
def test_a_force_at_one_end_of_a_pin_presses_there_alone(model):
    """A force at z = ±H/2 has the moment r × F about mid-length; the other end feels nothing of it."""
    force, length = np.array([30.0, -40.0, 0.0]), 0.08
    for end, z in ((0, -length / 2), (1, length / 2)):
        loads = model.loads(tuple(force), tuple(np.cross([0.0, 0.0, z], force)), length)
        np.testing.assert_allclose(loads[end], force[:2], atol=1e-12)
        np.testing.assert_allclose(loads[1 - end], 0.0, atol=1e-12)


STEPS = 8
clearances = st.floats(1e-7, 1e-4)


def played(mechanism, *measures):
    return trunnion.play(mechanism, list(measures) or None, STEPS)


@pytest.mark.slow
@settings(max_examples=3)
@given(st.lists(clearances, min_size=3, max_size=3))
def test_joints_add_up(found):
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


@pytest.mark.spread(1)
@pytest.mark.parametrize("name", ["slider-crank", "class III"])
def test_which_link_has_the_hole_does_not_matter(name):
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


def changed(name, values):
    return example(name).with_values(values)


def told(result, what):
    return [one for one in json.loads(result.attrs["findings"]) if one["code"] == what]


def test_a_passage_is_told_once_however_few_the_positions():
    """35.66° is 0.198 of two positions a turn."""
    result = analyse(example("fourbar-with-play"), steps=2)
    found = {one["where"]: one["figures"] for one in told(result, "contact.lost")}
    (together,) = [where for where, figures in found.items() if figures["at"] == "at 35.66°, at 223.5°"]
    assert "B" in together
    assert found[together]["count"] == together.count(",") + 1 > 1  # the other pin of the coupler, in one finding
    assert len({figures["at"] for figures in found.values()}) == len(found)


@pytest.mark.parametrize("steps", [7, 36])
def test_a_measure_is_the_figure_of_the_summary_where_pins_cross_their_play(steps):
    """Whichever positions are next to a crossing."""
    data = example("fourbar-with-play").data()
    data["measures"] = {name: {"effort": "A", "as": name} for name in ("minimum", "maximum", "rms")}
    figures = {one.name: one.value for one in analyse(Mechanism(**data), steps=steps).trunnion.summary}
    for name, key in (("minimum", "effort_min"), ("maximum", "effort_max"), ("rms", "effort_rms")):
        assert figures[name] == pytest.approx(figures[f"A.{key}"], rel=1e-6)


@pytest.mark.slow
def test_a_stretch_without_load_is_one_loss_of_contact():
    """The massless compressor has no pressure from 40° to 180°: nothing presses there."""
    data = example("slider-crank").data()
    data |= {"gravity": [0, 0], "joint_defaults": {"pin": {"clearance": "10 um"}, "seat": "loaded"}}
    for link in data["links"].values():
        for key in ("mass", "centre", "inertia"):
            link.pop(key, None)
    result = analyse(Mechanism(**data), steps=360)
    assert np.array_equal(np.flatnonzero(result["contact_lost"].sel(joint="P")), np.arange(40, 181))
    assert np.all(result["seat_offset"].sel(joint="P", end="1", axis=["x", "y"]).isel(position=slice(41, 180)) == 0)
    (finding,) = told(result, "contact.unloaded")  # of all joints at once, and no loss of any of them
    assert finding["figures"] == {"joints": ["O", "P", "Q"], "at": "between 40° and 180°"}
    assert not told(result, "contact.lost")


@pytest.mark.slow
@pytest.mark.parametrize("steps", [36, 97, 360])
def test_passages_are_found_between_wide_steps(steps):
    """At 4.96° the load of end 1 turns round within 0.05 of its peak; seen over a wide step it does so far from 0."""
    (finding,) = told(analyse(example("rssr-with-play"), steps=steps), "contact.lost")
    first, *more = finding["figures"]["at"].split(", ")
    assert 4.89 < float(first.removeprefix("at ").removesuffix("° (end 1)")) < 4.97
    assert more == ["at 191.6° (end 1)", "at 191.6° (end 2)"]


@pytest.mark.parametrize(("pinch", "known"), [("0.05 mm", False), ("5 mm", True)])
def test_no_efficiency_where_the_pins_do_not_settle_over_much_of_the_work(pinch, known):
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
        "joints": joined("ground -O- crank -P- rod -Q- ram, ground =S= ram", S={"friction": 0}),
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


def test_many_places_are_told_by_how_often_and_the_ends():
    places = [f"at {k}°" for k in range(12)]
    assert listed(places[:3]) == "at 0°, at 1°, at 2°"
    assert listed(places) == "12 times, first at 0°, last at 11°"
