"""The mechanism: its numbers by name, its joints with their defaults, its variants, its identity."""

from __future__ import annotations

import copy
import json
import math
import operator
import pickle
import subprocess
import sys
from functools import partial
from typing import Any

import numpy as np
import pytest
from model_samples import EXAMPLES

from trunnion.algebra.dual import Dual
from trunnion.errors import MechanismError
from trunnion.joints.friction import FRICTION_LAWS, FrictionLaw, LawParameter, coulomb
from trunnion.model.mechanism import Mechanism
from trunnion.model.parts import Driver, Friction, Joint, Link, Load, Pin, Point

DURANGO, CARDAN, SLIDER = (
    Mechanism.read(next(path for path in EXAMPLES if path.stem == name))
    for name in ("durango-fourbar", "pezzuti-cardan", "toleranced-slider-crank")
)


def test_numbers_of_the_fourbar() -> None:
    values = DURANGO.parameters()
    assert values["links.coupler.points.E.x"] == pytest.approx(2.5 * math.cos(math.radians(30)), rel=1e-15)
    assert values["links.coupler.points.E.y"] == pytest.approx(1.25, rel=1e-15)
    expected = {
        "gravity.y": 0.0, "links.ground.points.D.x": 5.5, "links.ground.mass": 0.0, "links.crank.inertia": 1.7,
        "links.coupler.centre.distance": 2.8, "links.coupler.centre.angle": 0.152, "links.rocker.centre.x": 1.5,
        "joints.B.pin.radius": 0.0075, "joints.B.friction.coefficient": 0.4, "joints.B.friction.pair_factor": 1.0,
        "drivers.A.speed": 10.0, "drivers.A.start": 0.0, "loads.work.force.y": -1000.0, "loads.brake.moment": -250.0,
        "assembly.C.x": 7.6,
    }  # fmt: skip
    assert {path: values[path] for path in expected} == expected
    assert all(isinstance(value, float) for value in values.values())


def test_numbers_of_the_slider_crank() -> None:
    values = SLIDER.parameters()
    expected = {
        "links.frame.points.S.axis.x": 1.0, "links.frame.points.S.y": 0.0, "joints.O.pin.radius": 0.00999325,
        "joints.O.pin.hole_radius": 0.01000525, "joints.P.pin.radius": 0.0079875,
        "joints.Q.pin.clearance": 2e-5,
        "joints.S.guide.length": 0.04, "joints.S.friction.coefficient": 0.12, "gravity.y": -9.81,
        "drivers.O.speed": 1500 * 2 * math.pi / 60, "links.piston.inertia": 0.0, "links.piston.centre.x": 0.0,
    }  # fmt: skip
    assert {path: values[path] for path in expected} == pytest.approx(expected, rel=1e-15)
    assert SLIDER.fixed_link == "frame"
    assert SLIDER.tolerances() == {
        "dimensions.crank": (-2e-5, 2e-5),
        "dimensions.rod": (-5e-5, 5e-5),
        "dimensions.offset": (-1e-4, 1e-4),
        "joints.O.pin.radius": (-3.25e-6, 3.25e-6),
        "joints.O.pin.hole_radius": (-5.25e-6, 5.25e-6),
        "joints.P.pin.radius": (-4.5e-6, 4.5e-6),
        "joints.P.pin.hole_radius": (-4.5e-6, 4.5e-6),
        "joints.Q.pin.clearance": (-8e-6, 8e-6),
    }
    fit = SLIDER.effective_joints["O"].pin.fit  # type: ignore[union-attr]
    assert (fit.hole, fit.shaft, fit.size.evaluate()) == ("H7", "g6", 0.02)  # type: ignore[union-attr]


def test_numbers_of_the_cardan_joint() -> None:
    values = CARDAN.parameters()
    expected = {
        "loop.input.twist": math.radians(89.9), "loop.output.twist": math.radians(164.9),
        "loop.pin-2.distance": 2e-5, "links.input-shaft.inertia.yz": 0.001026, "links.input-shaft.centre.y": 0.1277,
        "joints.pin-1.pin.radius": 0.01002, "joints.pin-1.pin.bearing": 0.06, "joints.pin-1.pin.length": 0.01,
        "joints.pin-1.pin.clearance": 1e-5, "joints.output.friction.coefficient": 0.42,
        "loads.brake.resisting_torque": 10.0, "gravity.z": 0.0,
    }  # fmt: skip
    assert {path: values[path] for path in expected} == pytest.approx(expected, rel=1e-15)
    assert CARDAN.fixed_link == "ground"
    assert CARDAN.effective_joints["pin-1"].links == ("input-shaft", "cross")
    assert CARDAN.effective_joints["input"].links == ("ground", "input-shaft")


def test_a_dimension_carries_what_depends_on_it() -> None:
    lengths = np.linspace(2.0, 3.0, 5)[:, None]
    values = DURANGO.parameters({"BE": lengths, "crank.mass": 5.0})
    assert values["links.coupler.points.E.y"] == pytest.approx(lengths / 2)
    assert values["links.crank.mass"] == 5.0
    values = DURANGO.parameters({"gamma": Dual(0.5, 1.0)})
    assert values["links.coupler.points.E.x"].dual == pytest.approx(-2.5 * math.sin(0.5))
    assert DURANGO.parameters()["dimensions.BE"] == 2.5  # and the mechanism is as it was


def test_dimensions_may_depend_on_dimensions_in_any_order() -> None:
    data = DURANGO.data()
    data["dimensions"] = {
        "BE": "half * 2",
        "half": "AB - 0.75 m",
        **{k: v for k, v in data["dimensions"].items() if k != "BE"},
    }
    mechanism = Mechanism(**data)
    assert mechanism.parameters()["dimensions.BE"] == 2.5
    assert mechanism.parameters({"AB": 3.0})["links.coupler.points.E.y"] == pytest.approx(2.25)
    assert mechanism.parameters({"half": 1.0, "AB": 3.0})["dimensions.BE"] == 2.0


def test_defaults_are_followed_until_a_joint_has_its_own_value() -> None:
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
        ("AD ", "there is no number named 'AD '", "'AD'"),
        ("", "there is no number named ''", "known"),
    ],
)
def test_unknown_names(name: str, what: str, remedy: str) -> None:
    for call in (DURANGO.parameters, DURANGO.with_values):
        with pytest.raises(MechanismError) as error:
            call({name: 1.0})
        assert what in error.value.findings[0].what
        assert remedy in error.value.findings[0].remedy


@pytest.mark.parametrize(
    ("name", "what"),
    [
        ("A.initial.coordinate", "the model states no drivers.A.initial.coordinate"),
        ("drivers.A.initial.coordinate", "the model states no drivers.A.initial.coordinate"),
        ("crank.inertia.xx", "the model states no links.crank.inertia.xx"),
        ("A.initial.place", "there is no number named 'A.initial.place'"),
        ("crank.inital", "there is no number named 'crank.inital'"),
    ],
)
def test_what_a_file_may_state_and_does_not_is_no_unknown_name(name: str, what: str) -> None:
    with pytest.raises(MechanismError) as error:
        DURANGO.with_values({name: 1.0})
    (finding,) = error.value.findings
    assert finding.what == what
    assert ("write it into the model file" in finding.remedy) == ("states no" in what)


def test_every_parameter_can_be_set_and_is_set() -> None:
    for mechanism in (DURANGO, CARDAN, SLIDER):
        kinds = mechanism.parameter_kinds()
        for path, value in mechanism.parameters().items():
            if mechanism is SLIDER and path.startswith(("joints.O.pin.", "joints.P.pin.")) and "radius" in path:
                continue  # the file states a fit there
            changed = value * 1.001 if value else 1e-6
            assert mechanism.parameters({path: changed})[path] == changed
            assert mechanism.with_values({path: changed}).parameters()[path] == changed, path
            assert kinds[path].unit


def test_texts_are_set_with_the_kind_of_their_place() -> None:
    changed = DURANGO.with_values({"AB": "2.1 m ± 1 mm", "joints.B.friction.coefficient": 0.3, "A.speed": "60 rpm"})
    values = changed.parameters()
    assert (values["links.crank.points.B.x"], values["drivers.A.speed"]) == (2.1, pytest.approx(2 * math.pi))
    assert [values[f"joints.{name}.friction.coefficient"] for name in "AB"] == [0.4, 0.3]
    assert changed.tolerances() == {"dimensions.AB": (-1e-3, 1e-3)}
    with pytest.raises(MechanismError, match=r"links\.crank\.mass: 'AB' is a length where a mass is needed"):
        DURANGO.with_values({"crank.mass": "AB"})


def test_friction_off_and_of_another_law(monkeypatch: pytest.MonkeyPatch) -> None:
    off = SLIDER.with_friction("off")
    assert not [path for path in off.parameters() if "friction" in path]
    assert all(joint.friction is None for joint in DURANGO.with_friction("off").effective_joints.values())
    sticky = FrictionLaw(coulomb, {"coefficient": LawParameter(), "speed": LawParameter("m/s", 0.01)})
    monkeypatch.setitem(FRICTION_LAWS, "sticky", sticky)
    # the schema's list of laws is made when the model is imported; laws are entries of a table in the source
    with pytest.raises(MechanismError, match="'colomb' is not a friction law — did you mean 'coulomb'"):
        DURANGO.with_friction("colomb")
    assert DURANGO.with_friction("coulomb").parameters() == DURANGO.parameters()


def test_friction_merges_defaults_and_own_values() -> None:
    data = DURANGO.data()
    data["joints"]["B"]["friction"] = {"pair_factor": "4/3"}
    data["joints"]["C"]["friction"] = 0.1
    joints = Mechanism(**data).effective_joints
    found = {name: {key: value.evaluate() for key, value in joints[name].friction.parameters.items()} for name in "ABC"}  # type: ignore[union-attr]
    assert found == {
        "A": {"pair_factor": 1.0, "coefficient": 0.4},
        "B": {"pair_factor": 4 / 3, "coefficient": 0.4},
        "C": {"pair_factor": 1.0, "coefficient": 0.1},
    }
    assert all(joints[name].friction.law == "coulomb" for name in "ABCD")  # type: ignore[union-attr]
    assert all(joints[name].friction.model == "two-contact" for name in "ABCD")  # type: ignore[union-attr]


def test_a_fit_replaces_the_default_radius_and_the_other_way_round() -> None:
    data = DURANGO.data()
    data["joints"]["B"]["pin"] = {"fit": "20 mm H7/g6"}
    values = Mechanism(**data).parameters({"joint_defaults.pin.radius": 1.0})
    assert [values[f"joints.{name}.pin.radius"] for name in "AB"] == [1.0, 0.00999325]
    data["joint_defaults"]["pin"] = {"fit": "20 mm H7/g6"}
    data["joints"]["B"]["pin"] = {"radius": "7 mm"}
    joints = Mechanism(**data).effective_joints
    assert joints["B"].pin.fit is None  # type: ignore[union-attr]
    assert joints["A"].pin.radius.evaluate() == 0.00999325  # type: ignore[union-attr]


def test_building_from_classes_is_building_from_data() -> None:
    def revolute(*links: str) -> Joint:
        return Joint(type="revolute", links=links)

    parts = {
        "links": {
            "ground": Link(points={"A": Point(at=[0, 0]), "D": [5.5, 0]}),
            "crank": Link(points={"A": [0, 0], "B": ["2 m", 0]}, mass="4.8 kg"),
            "coupler": Link(points={"B": [0, 0], "C": [6, 0]}),
            "rocker": Link(points={"D": [0, 0], "C": [3, 0]}),
        },
        "joints": {
            "A": Joint(
                type="revolute", links=("ground", "crank"), pin=Pin(radius=0.01), friction=Friction(coefficient=0.1)
            ),
            "B": revolute("crank", "coupler"),
            "C": revolute("coupler", "rocker"),
            "D": revolute("ground", "rocker"),
        },
        "drivers": {"A": Driver(speed=10)},
        "loads": {"work": Load(link="coupler", at="C", force=[0, "-1 kN"])},
    }
    mechanism = Mechanism(**parts)
    assert Mechanism(**mechanism.data()) == mechanism
    assert mechanism.data()["joints"]["A"]["friction"] == 0.1
    assert mechanism.data()["links"]["ground"]["points"] == {"A": [0, 0], "D": [5.5, 0]}
    assert Mechanism(**{**mechanism.data(), "links": parts["links"]}) == mechanism


def test_equal_mechanisms_have_equal_digests() -> None:
    data = DURANGO.data()
    same = Mechanism(**{**data, "links": dict(reversed(data["links"].items())), "gravity": [0.0, 0]})
    assert (same == DURANGO, same.digest == DURANGO.digest) == (True, True)
    assert DURANGO.with_values({"AB": "2.01 m"}).digest != DURANGO.digest
    assert len(DURANGO.digest) == 16


def test_a_mechanism_shows_its_own_names() -> None:
    names = {name for name in dir(DURANGO) if not name.startswith("_")}
    assert {"dimensions", "joints", "with_values", "parameters", "read", "digest"} <= names
    assert not any(name.startswith(("model_", "parse_")) or name in ("json", "copy", "dict") for name in names)
    assert DURANGO.model_copy() == DURANGO


@pytest.mark.parametrize("name", ["durango-fourbar", "double-cardan", "piston-by-cost"])
@pytest.mark.parametrize("analysed", [False, True])
def test_a_mechanism_cannot_be_changed_in_place(name: str, analysed: bool) -> None:
    mechanism = Mechanism.read(f"examples/{name}.yaml")
    if analysed:
        mechanism.parameters()
    link = next(iter(mechanism.links.values()))
    groups = [mechanism.dimensions, mechanism.springs, mechanism.effective_joints, mechanism.processes, link.points]
    groups += mechanism.processes.values()
    groups += [mechanism.parameter_set.nominal, mechanism.parameter_set.entries]
    calls: list[Any] = [partial(setattr, mechanism, "name", "other"), partial(delattr, link, "mass")]
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


def test_a_copy_with_an_update_is_checked_and_worked_out_anew() -> None:
    mechanism = Mechanism.read("examples/durango-fourbar.yaml")
    before = mechanism.parameters()["dimensions.AB"]
    other = mechanism.model_copy(update={"dimensions": {**mechanism.dimensions, "AB": 2 * before}})
    assert other.parameters()["links.crank.points.B.x"] == 2 * before
    with pytest.raises(MechanismError, match="parsec"):
        mechanism.model_copy(update={"dimensions": {**mechanism.dimensions, "AB": "2 parsec per"}})


@pytest.mark.slow
def test_importing_the_mechanism_leaves_the_units_alone() -> None:
    code = "import sys, trunnion.model.mechanism; print('pint' in sys.modules, 'ruamel' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "False"]
