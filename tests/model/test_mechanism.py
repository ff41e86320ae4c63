"""The mechanism: its numbers by name, joints with their defaults, measures, variants, identity."""

import copy
import json
import math
import operator
import pickle
from functools import partial

import numpy as np
import pytest
from model_samples import EXAMPLES

from trunnion.algebra.dual import Dual
from trunnion.errors import MechanismError
from trunnion.model.joint_parts import Friction, Joint, Pin
from trunnion.model.mechanism import Mechanism
from trunnion.model.parts import Driver, Link, Load

DURANGO, CARDAN, SLIDER = (
    Mechanism.read(next(path for path in EXAMPLES if path.stem == name))
    for name in ("durango-fourbar", "pezzuti-cardan", "toleranced-slider-crank")
)


NUMBERS = [
    (DURANGO, "ground", {
        "gravity.y": 0.0, "links.ground.points.D.x": 5.5, "links.ground.mass": 0.0, "links.crank.inertia": 1.7,
        "links.coupler.centre.distance": 2.8, "links.coupler.centre.angle": 0.152, "links.rocker.centre.x": 1.5,
        "links.coupler.points.E.x": 2.5 * math.cos(math.radians(30)), "links.coupler.points.E.y": 1.25,
        "joints.B.pin.radius": 0.0075, "joints.B.friction.coefficient": 0.4, "joints.B.friction.pair_factor": 1.0,
        "drivers.A.speed": 10.0, "drivers.A.start": 0.0, "loads.work.force.y": -1000.0, "loads.brake.moment": -250.0,
        "assembly.C.x": 7.6}),
    (SLIDER, "frame", {
        "links.frame.points.S.axis.x": 1.0, "links.frame.points.S.y": 0.0, "joints.O.pin.radius": 0.00999325,
        "joints.O.pin.hole_radius": 0.01000525, "joints.P.pin.radius": 0.0079875, "joints.Q.pin.clearance": 2e-5,
        "joints.S.guide.length": 0.04, "joints.S.friction.coefficient": 0.12, "gravity.y": -9.81,
        "drivers.O.speed": 1500 * 2 * math.pi / 60, "links.piston.inertia": 0.0, "links.piston.centre.x": 0.0}),
    (CARDAN, "ground", {
        "loop.input.twist": math.radians(89.9), "loop.output.twist": math.radians(164.9),
        "loop.pin-2.distance": 2e-5, "links.input-shaft.inertia.yz": 0.001026, "links.input-shaft.centre.y": 0.1277,
        "joints.pin-1.pin.radius": 0.01002, "joints.pin-1.pin.bearing": 0.06, "joints.pin-1.pin.length": 0.01,
        "joints.pin-1.pin.clearance": 1e-5, "joints.output.friction.coefficient": 0.42,
        "loads.brake.resisting_torque": 10.0, "gravity.z": 0.0}),
]  # fmt: skip


@pytest.mark.parametrize(("mechanism", "fixed", "expected"), NUMBERS)
def test_numbers_of_examples(mechanism, fixed, expected):
    values = mechanism.parameters()
    assert {path: values[path] for path in expected} == pytest.approx(expected, rel=1e-15)
    assert mechanism.fixed_link == fixed
    assert all(isinstance(value, float) for value in values.values())


def test_tolerances_and_joints_of_examples():
    halves = {
        "dimensions.crank": 2e-5, "dimensions.rod": 5e-5, "dimensions.offset": 1e-4, "joints.O.pin.radius": 3.25e-6,
        "joints.O.pin.hole_radius": 5.25e-6, "joints.P.pin.radius": 4.5e-6, "joints.P.pin.hole_radius": 4.5e-6,
        "joints.Q.pin.clearance": 8e-6,
    }  # fmt: skip
    assert SLIDER.tolerances() == {path: (-half, half) for path, half in halves.items()}
    assert CARDAN.effective_joints["pin-1"].links == ("input-shaft", "cross")
    assert CARDAN.effective_joints["input"].links == ("ground", "input-shaft")


def test_a_dimension_carries_what_depends_on_it():
    lengths = np.linspace(2.0, 3.0, 5)[:, None]
    values = DURANGO.parameters({"BE": lengths, "crank.mass": 5.0})
    assert values["links.coupler.points.E.y"] == pytest.approx(lengths / 2)
    assert values["links.crank.mass"] == 5.0
    values = DURANGO.parameters({"gamma": Dual(0.5, 1.0)})
    assert values["links.coupler.points.E.x"].dual == pytest.approx(-2.5 * math.sin(0.5))
    assert DURANGO.parameters()["dimensions.BE"] == 2.5  # and the mechanism is as it was


def test_defaults_are_followed_until_a_joint_has_its_own_value():
    values = DURANGO.parameters({"joint_defaults.friction.coefficient": 0.2, "B.friction.coefficient": 0.3})
    found = [values[f"joints.{name}.friction.coefficient"] for name in "ABCD"]
    assert found == [0.2, 0.3, 0.2, 0.2]
    data = SLIDER.data()
    pin = {**data["joints"]["P"]["pin"], "length": "20 mm"}
    long = Mechanism(**{**data, "joints": {**data["joints"], "P": {**data["joints"]["P"], "pin": pin}}})
    assert long.parameters()["joints.P.pin.bearing"] == 0.02
    assert long.parameters({"P.pin.length": 0.03})["joints.P.pin.bearing"] == 0.03


@pytest.mark.parametrize(
    ("name", "what", "remedy"),
    [
        ("crnk.mass", "there is no number named 'crnk.mass'", "'crank.mass'"),
        ("mass", "stands for 4 numbers", "links.crank.mass"),
        ("", "there is no number named ''", "known"),
        ("coeficient", "there is no number named 'coeficient'", "did you mean 'coefficient'?"),
        ("spede", "there is no number named 'spede'", "did you mean 'speed'?"),
        ("A.initial.place", "there is no number named 'A.initial.place'", ""),
        ("crank.inertia.xx", "there is no number named 'crank.inertia.xx'", ""),
        ("A.pin.radius.x", "there is no number named 'A.pin.radius.x'", "'A.pin.radius'"),
        ("crank.mass.x", "there is no number named 'crank.mass.x'", "'crank.mass'"),
    ],
)
def test_unknown_names_and_numbers_that_are_not_stated(name, what, remedy):
    with pytest.raises(MechanismError):
        DURANGO.parameters({name: 1.0})
    with pytest.raises(MechanismError) as error:
        DURANGO.with_values({name: 1.0})
    assert what in error.value.findings[0].what
    assert remedy in error.value.findings[0].remedy


def test_every_parameter_can_be_set_and_is_set():
    for mechanism in (DURANGO, CARDAN, SLIDER):
        kinds = mechanism.parameter_kinds()
        for path, value in mechanism.parameters().items():
            if mechanism is SLIDER and path.startswith(("joints.O.pin.", "joints.P.pin.")) and "radius" in path:
                continue  # the file states a fit there
            changed = value * 1.001 if value else 1e-6
            assert mechanism.parameters({path: changed})[path] == changed
            assert mechanism.with_values({path: changed}).parameters()[path] == changed, path
            assert kinds[path].unit


def test_texts_are_set_with_the_kind_of_their_place():
    changed = DURANGO.with_values({"AB": "2.1 m ± 1 mm", "joints.B.friction.coefficient": 0.3, "A.speed": "60 rpm"})
    values = changed.parameters()
    assert (values["links.crank.points.B.x"], values["drivers.A.speed"]) == (2.1, pytest.approx(2 * math.pi))
    assert [values[f"joints.{name}.friction.coefficient"] for name in "AB"] == [0.4, 0.3]
    assert changed.tolerances() == {"dimensions.AB": (-1e-3, 1e-3)}
    with pytest.raises(MechanismError, match=r"links\.crank\.mass: 'AB' is a length where a mass is needed"):
        DURANGO.with_values({"crank.mass": "AB"})


def test_friction_merges_defaults_and_own_values():
    data = DURANGO.data()
    data["joints"]["B"]["friction"] = {"pair_factor": "4/3"}
    data["joints"]["C"]["friction"] = 0.1
    joints = Mechanism(**data).effective_joints
    for name, factor, coefficient in (("A", 1.0, 0.4), ("B", 4 / 3, 0.4), ("C", 1.0, 0.1), ("D", 1.0, 0.4)):
        friction = joints[name].friction
        assert friction is not None
        assert (friction.law, friction.model) == ("coulomb", "two-contact")
        numbers = {key: value.evaluate() for key, value in friction.parameters.items()}
        assert numbers == {"pair_factor": factor, "coefficient": coefficient}


def test_building_from_classes_is_building_from_data():
    data = DURANGO.data()
    classes = {
        "links": {name: Link(**link) for name, link in data["links"].items()},
        "joints": {name: Joint(**joint) for name, joint in data["joints"].items()},
        "drivers": {"A": Driver(**data["drivers"]["A"])},
        "loads": {name: Load(**load) for name, load in data["loads"].items()},
    }
    mechanism = Mechanism(**{**data, **classes})
    assert mechanism == DURANGO
    assert mechanism.data() == data
    friction = Joint(
        type="revolute", links=("ground", "crank"), pin=Pin(radius=0.01), friction=Friction(coefficient=0.1)
    )
    other = Mechanism(**{**data, "joints": {**data["joints"], "A": friction}})
    assert other.data()["joints"]["A"]["friction"] == 0.1
    assert Mechanism(**other.data()) == other


def test_equal_mechanisms_have_equal_digests():
    data = DURANGO.data()
    same = Mechanism(**{**data, "links": dict(reversed(data["links"].items())), "gravity": [0.0, 0]})
    assert (same == DURANGO, same.digest == DURANGO.digest) == (True, True)
    assert DURANGO.with_values({"AB": "2.01 m"}).digest != DURANGO.digest
    assert len(DURANGO.digest) == 16


@pytest.mark.parametrize("name", ["durango-fourbar", "double-cardan", "piston-by-cost"])
@pytest.mark.parametrize("analysed", [False, True])
def test_a_mechanism_cannot_be_changed_in_place(name, analysed):
    mechanism = Mechanism.read(f"examples/{name}.yaml")
    if analysed:
        mechanism.parameters()
    link = next(iter(mechanism.links.values()))
    groups = [mechanism.dimensions, mechanism.springs, mechanism.effective_joints, mechanism.processes, link.points]
    groups += mechanism.processes.values()
    groups += [mechanism.parameter_set.nominal, mechanism.parameter_set.entries]
    calls = [partial(setattr, mechanism, "name", "other"), partial(delattr, link, "mass")]
    for friction in (joint.friction for joint in mechanism.effective_joints.values() if joint.friction):
        groups.append(friction.parameters)
        calls.append(partial(setattr, friction, "coefficient", 0.2))
    for group in groups:
        calls += [partial(operator.setitem, group, "L", 1.7), partial(group.update, {"L": 1.7}), group.clear]
    for call in calls:
        with pytest.raises(TypeError, match="with_values"):
            call()
    for same in (copy.deepcopy(mechanism), pickle.loads(pickle.dumps(mechanism)), mechanism.model_copy()):
        assert same == mechanism == Mechanism(**json.loads(json.dumps(mechanism.data())))
        assert (same.digest, same.parameters()) == (mechanism.digest, mechanism.parameters())
        with pytest.raises(TypeError, match="with_values"):
            same.dimensions["L"] = 1.7


def test_a_copy_with_an_update_is_checked_and_worked_out_anew():
    mechanism = Mechanism.read("examples/durango-fourbar.yaml")
    before = mechanism.parameters()["dimensions.AB"]
    other = mechanism.model_copy(update={"dimensions": {**mechanism.dimensions, "AB": 2 * before}})
    assert other.parameters()["links.crank.points.B.x"] == 2 * before
    with pytest.raises(MechanismError, match="parsec"):
        mechanism.model_copy(update={"dimensions": {**mechanism.dimensions, "AB": "2 parsec per"}})


def with_measure(mechanism, **keys):
    return Mechanism(**{**mechanism.data(), "measures": {"one": keys}})


def test_limits_are_two_numbers(varied):
    values = varied.parameters()
    found = {path: float(value) for path, value in values.items() if path.startswith("measures.")}
    limits = {
        "error.limit.lower": -0.1 * DEG, "error.limit.upper": 0.1 * DEG, "theta.at": 60 * DEG,
        "theta.limit.lower": -0.1 * DEG, "theta.limit.upper": 0.2 * DEG, "later.at": 0.1, "later.limit.lower": -2e-3,
        "later.limit.upper": 2e-3, "peak.at_most": 12.0, "swing.over.from": 0.0, "swing.over.to": np.pi,
        "swing.limit.lower": -0.05 / 30, "swing.limit.upper": 0.05 / 30,
    }  # fmt: skip
    assert found == pytest.approx({f"measures.{name}": value for name, value in limits.items()}, rel=1e-14)


def test_a_position_is_a_time_if_it_is_stated_as_one(varied):
    kinds = varied.parameter_kinds()
    assert kinds["measures.theta.at"].name == "angle"
    assert kinds["measures.later.at"].name == "time"
    data = {**varied.data(), "dimensions": {**varied.data()["dimensions"], "when": "0.2 s"}}
    data["measures"] = {"one": {"angle": "rocker", "at": "when / 2"}, "two": {"angle": "rocker", "at": 1.5}}
    kinds = Mechanism(**data).parameter_kinds()
    assert [kinds[f"measures.{name}.at"].name for name in ("one", "two")] == ["time", "angle"]


DEG = np.pi / 180
UNITS = {"length": "1 um", "angle": "1 deg", "angular speed": "1 rpm", "moment": "1 N m", "force": "1 N", "number": 0.1}
GIVES = [
    ("length", {"point": "coupler.C", "axis": "x"}), ("length", {"path_error": "coupler.C"}),
    ("length", {"straightness": "coupler.C"}), ("length", {"stroke": "S"}), ("length", {"transmission_error": "S"}),
    ("length", {"slide": "S"}), ("angle", {"angle": "rocker"}), ("angle", {"rotation": "D"}),
    ("angle", {"transmission_error": "D"}), ("angle", {"stroke": "D"}), ("angle", {"dead_centre": "D"}),
    ("angle", {"dead_centre": "D", "as": "place-of-minimum"}), ("angle", {"effort": "A", "as": "place-of-maximum"}),
    ("angular speed", {"rate": "D"}), ("moment", {"effort": "A"}), ("force", {"reaction": "C"}),
    ("force", {"reaction": "C", "axis": "y"}), ("number", {"efficiency": "cycle"}),
    ("number", {"efficiency": "instant"}), ("number", {"locking_margin": "mechanism"}),
]  # fmt: skip


@pytest.mark.sample(15)
@pytest.mark.spread(10)
@pytest.mark.parametrize(("kind", "keys"), GIVES)
def test_what_a_measure_gives(varied, kind, keys):
    """A limit of another kind is a finding."""
    model = SLIDER if "S" in keys.values() else varied
    good = with_measure(model, **keys, limit=UNITS[kind], at_most=UNITS[kind])
    assert {unit.name for path, unit in good.parameter_kinds().items() if path.startswith("measures.")} == {kind}
    with pytest.raises(MechanismError) as error:
        with_measure(model, **keys, limit="1 kg")
    (finding,) = error.value.findings  # both limits, once
    assert finding.where == "measures.one.limit"
    assert f"'1 kg' is a mass where {'an' if kind[0] == 'a' else 'a'} {kind} is needed" in finding.what


@pytest.mark.parametrize(
    ("example", "keys", "what"),
    [
        ("one-way-clutch", {"angle": "strut", "at": "10 deg"}, "there is no driver whose coordinate it could be"),
        ("rssr", {"transmission_error": "B"}, "a spherical joint has no rotation or slide about one axis"),
        ("rssr", {"angle": "rocker"}, "add axis: x, y or z"),
    ],
)
def test_a_measure_that_the_structure_does_not_have(example, keys, what):
    mechanism = Mechanism.read(next(path for path in EXAMPLES if path.stem == example))
    with pytest.raises(MechanismError, match=what):
        with_measure(mechanism, **keys)


def test_place_and_window_of_a_measure_can_be_set(varied):
    """Also where the file states none; what is no window says so."""
    bare = with_measure(varied, effort="A")
    for text in ("10 deg, 50 deg", "[10 deg, 50 deg]"):
        values = bare.with_values({"measures.one.over": text}).parameters()
        assert [values[f"measures.one.over.{end}"] for end in ("from", "to")] == pytest.approx([10 * DEG, 50 * DEG])
    assert bare.with_values({"measures.one.at": "10 deg"}).parameters()["measures.one.at"] == pytest.approx(10 * DEG)
    for wrong in ("10 deg", 3.0):
        with pytest.raises(MechanismError) as caught:
            bare.with_values({"measures.one.over": wrong})
        assert caught.value.findings[0].where == "measures.one.over"


def test_no_coordinate_stands_for_an_end_of_a_range():
    press = Mechanism.read(next(path for path in EXAMPLES if path.stem == "inverted-slider-crank"))
    name = next(name for name, driver in press.drivers.items() if driver.range)
    assert press.path_of(f"drivers.{name}.range.from") == f"drivers.{name}.range.from"
    for wrong in ("x", "y", "form"):
        with pytest.raises(MechanismError, match="no number named"):
            press.with_values({f"drivers.{name}.range.{wrong}": 0.1})
    with pytest.raises(MechanismError, match="no number of seconds is long enough"):
        press.with_values({f"drivers.{name}.range.to": 1e308, f"drivers.{name}.speed": 1e-3})
