"""What is off nominal in a model: named errors, misaligned axes, plays and seats; every way to state one wrongly."""

import math
from pathlib import Path

import numpy as np
import pytest

from trunnion.algebra.dual import Dual
from trunnion.errors import MechanismError, Severity
from trunnion.model.checks.check import check_model
from trunnion.model.joint_parts import Misalignment, Seat, has_play, play
from trunnion.model.mechanism import Mechanism

EXAMPLES = Path(__file__).parents[2] / "examples"
FOURBAR, RSSR, CARDAN, SLIDER, PLAYING = (
    Mechanism.read(EXAMPLES / f"{name}.yaml")
    for name in ("durango-fourbar", "rssr-with-play", "pezzuti-cardan", "toleranced-slider-crank", "fourbar-with-play")
)


def refusal(mechanism, values):
    """What is said of values that a mechanism cannot have."""
    with pytest.raises(MechanismError) as error:
        mechanism.with_values(values)
    return str(error.value)


def doubts(mechanism):
    """Its warnings."""
    return [str(one) for one in check_model(mechanism) if one.severity is Severity.WARNING]


# errors of named numbers
def test_an_error_shifts_its_number_and_what_depends_on_it():
    off = FOURBAR.with_values({"errors.BE": "0.5 mm", "errors.rocker.points.C.x": -2e-3, "errors.crank.mass": 0.1})
    built, ideal, nominal = off.parameters(), off.ideal_parameters(), FOURBAR.parameters()
    assert built["dimensions.BE"] == 2.5005
    assert built["links.coupler.points.E.y"] == pytest.approx(2.5005 / 2, rel=1e-15)
    assert built["links.rocker.points.C.x"] == nominal["links.rocker.points.C.x"] - 2e-3
    assert built["links.crank.mass"] == pytest.approx(4.9, rel=1e-15)
    assert built["errors.dimensions.BE"] == 5e-4
    assert built.keys() == ideal.keys()
    assert {path: ideal[path] for path in nominal} == nominal
    assert ideal["errors.dimensions.BE"] == 0
    assert off.has_errors
    assert not FOURBAR.has_errors
    assert FOURBAR.ideal_parameters() == nominal
    assert Mechanism(**off.data()) == off


def test_overrides_beside_an_error():
    off = FOURBAR.with_values({"errors.AB": "1 mm", "errors.C.pin.radius": "10 um"})
    assert off.parameters({"AB": 2.0})["links.crank.points.B.x"] == 2.0  # the sum is replaced
    assert off.parameters({"errors.AB": 2e-3})["links.crank.points.B.x"] == 2.002
    assert off.ideal_parameters({"AB": 3.0})["links.crank.points.B.x"] == 3.0
    moved = off.parameters({"errors.dimensions.AB": Dual(0.0, 1.0)})["links.crank.points.B.x"]
    assert (moved.real, moved.dual) == (2.0, 1.0)
    samples = np.linspace(-1e-3, 1e-3, 4)[:, None]
    np.testing.assert_allclose(off.parameters({"errors.AB": samples})["links.crank.points.B.x"], 2 + samples)
    defaults = off.parameters({"joint_defaults.pin.radius": 0.02})
    assert [defaults[f"joints.{name}.pin.radius"] for name in "BC"] == [0.02, pytest.approx(0.02001, rel=1e-15)]


def test_errors_may_speak_of_dimensions():
    data = FOURBAR.data()
    data["dimensions"]["wear"] = "0.1 mm"
    off = Mechanism(**data, errors={"AB": "2 * wear", "C.pin.radius": "-wear"})
    assert off.parameters()["dimensions.AB"] == pytest.approx(2.0002, rel=1e-15)
    changed = off.parameters({"wear": 1e-3})
    assert changed["links.crank.points.B.x"] == pytest.approx(2.002, rel=1e-15)
    assert changed["joints.C.pin.radius"] == pytest.approx(off.ideal_parameters()["joints.C.pin.radius"] - 1e-3)


def test_paths_of_what_is_not_stated_yet():
    paths = {
        "errors.AB": "errors.dimensions.AB", "AB": "dimensions.AB", "B.pin.clearance": "joints.B.pin.clearance",
        "joints.B.seat.xi": "joints.B.seat.xi", "joint_defaults.pin.clearance": "joint_defaults.pin.clearance",
    }  # fmt: skip
    assert {name: FOURBAR.path_of(name) for name in paths} == paths
    wrong = ("B.pin.clearence", "X.pin.clearance", "joint_defaults.misalignment.tilt", "B.pin.fit", "B.seat.direction")
    for name in wrong:
        with pytest.raises(MechanismError):
            FOURBAR.path_of(name)
    kinds = FOURBAR.with_values({"errors.AB": 1e-5, "errors.gamma": 1e-5}).parameter_kinds()
    assert [kinds[f"errors.dimensions.{name}"].unit for name in ("AB", "gamma")] == ["m", "rad"]


# misalignment
def test_every_turning_axis_can_be_misaligned():
    values = RSSR.parameters()
    assert {path for path in values if "misalignment" in path} == {
        f"joints.{name}.misalignment.{key}" for name in "AD" for key in ("tilt", "towards", "offset", "offset_towards")
    }
    flat = {path for path in FOURBAR.parameters() if path.startswith("joints.A.misalignment")}
    assert flat == {f"joints.A.misalignment.{key}" for key in ("towards", "offset", "offset_towards")}
    off = RSSR.with_values({"joints.A.misalignment.tilt": "0.2deg", "A.misalignment.towards": "30 deg"})
    assert off.joints["A"].misalignment == Misalignment(tilt="0.2deg", towards="30 deg")
    assert off.parameters()["joints.A.misalignment.tilt"] == pytest.approx(math.radians(0.2))
    assert off.ideal_parameters()["joints.A.misalignment.tilt"] == 0
    assert off.with_values({"joint_defaults.seat": "free", "D.seat": "free"}).has_errors


def test_the_offset_goes_towards_the_tilt_unless_stated():
    path = "joints.A.misalignment"
    off = RSSR.with_values({f"{path}.towards": 0.5})
    assert off.parameters()[f"{path}.offset_towards"] == 0.5
    assert off.parameters({f"{path}.towards": 0.7})[f"{path}.offset_towards"] == 0.7
    own = off.with_values({f"{path}.offset_towards": 0.1})
    assert [own.parameters()[f"{path}.{key}"] for key in ("towards", "offset_towards")] == [0.5, 0.1]


def test_a_row_of_a_loop_has_misalignment_and_seat():
    off = CARDAN.with_values({"joints.pin-1.misalignment.tilt": "0.1 deg", "joints.pin-1.seat": "loaded"})
    assert off.loop[1].seat == "loaded"
    assert off.stated_joints["pin-1"].seat == "loaded"
    assert off.stated_joints["pin-1"].misalignment == Misalignment(tilt="0.1 deg")
    assert off.seated == {"pin-1": "loaded"}
    assert Mechanism(**off.data()) == off


# plays and seats
def test_play_by_clearance_radii_and_fit():
    found = FOURBAR.with_values(
        {"A.pin.clearance": "20 um", "B.pin.hole_radius": "7.51 mm", "C.pin.cylindricity": 1e-6}
    )
    joints, values = found.effective_joints, found.parameters()
    assert [has_play(joints[name]) for name in "ABCD"] == [True, True, False, False]
    plays = [play(joints[name], name, values) for name in "ABCD"]
    assert plays == pytest.approx([2e-5, 1e-5, 0, 0], abs=1e-15)
    both = found.with_values({"B.pin.cylindricity": "2 um"})
    assert play(both.effective_joints["B"], "B", both.parameters()) == pytest.approx(1.2e-5, abs=1e-15)
    slide = SLIDER.parameters()
    assert play(SLIDER.effective_joints["S"], "S", slide) == 3e-5
    assert play(SLIDER.effective_joints["O"], "O", slide) == pytest.approx(
        12e-6, abs=1e-15
    )  # H7/g6: 7 to 41 µm, halved


@pytest.mark.parametrize(
    ("limits", "radius", "hole", "clearance"),
    [("minimum", -3.5, 0, 3.5), ("mean", -6.75, 5.25, 12), ("maximum", -10, 10.5, 20.5)],
)
def test_nominal_limits_of_a_fit(limits, radius, hole, clearance):
    """25 H7/g6: hole 0 … 21 µm, shaft −20 … −7 µm on the diameter."""
    found = FOURBAR.with_values({"fits": limits})
    data = found.data()
    data["joints"]["B"]["pin"] = {"fit": "25 mm H7/g6"}
    found = Mechanism(**data)
    values, tolerances = found.parameters(), found.tolerances()
    assert values["joints.B.pin.radius"] == pytest.approx(12.5e-3 + radius * 1e-6, abs=1e-15)
    assert values["joints.B.pin.hole_radius"] == pytest.approx(12.5e-3 + hole * 1e-6, abs=1e-15)
    assert play(found.effective_joints["B"], "B", values) == pytest.approx(clearance * 1e-6, abs=1e-15)
    assert tolerances["joints.B.pin.radius"] == pytest.approx(
        ((-10 - radius) * 1e-6, (-3.5 - radius) * 1e-6), abs=1e-15
    )
    assert tolerances["joints.B.pin.hole_radius"] == pytest.approx((-hole * 1e-6, (10.5 - hole) * 1e-6), abs=1e-15)


def test_the_size_of_a_fit_may_be_an_expression():
    data = FOURBAR.data()
    data["dimensions"]["bore"] = "24 mm"
    data["joint_defaults"]["pin"] = {"fit": "bore + 1 mm H7/g6"}
    found = Mechanism(**data)
    assert found.parameters()["joints.A.pin.radius"] == pytest.approx(12.49325e-3, abs=1e-15)
    assert found.parameters({"bore": 0.025})["joints.A.pin.radius"] == pytest.approx(12.99325e-3, abs=1e-15)
    assert found.tolerances()["joints.C.pin.radius"] == pytest.approx((-3.25e-6, 3.25e-6), abs=1e-15)
    larger = found.with_values({"bore": "59 mm"})  # limits of the new size
    assert larger.parameters()["joints.A.pin.radius"] == pytest.approx(30e-3 - 9.75e-6, abs=1e-15)


def test_one_way_to_state_the_play_replaces_the_default_one():
    data = FOURBAR.data()
    data["joint_defaults"]["pin"] = {"radius": "7.5 mm", "clearance": "20 um"}
    data["joints"]["A"]["pin"] = {"hole_radius": "7.6 mm"}
    data["joints"]["B"]["pin"] = {"fit": "15 mm H7/g6"}
    data["joints"]["C"]["pin"] = {"clearance": "30 um"}
    found = Mechanism(**data)
    values = found.parameters()
    plays = [play(joint, name, values) for name, joint in found.effective_joints.items()]
    assert plays == pytest.approx([1e-4, 10.25e-6, 3e-5, 2e-5], abs=1e-12)  # 15 H7/g6: 6 to 35 µm, halved


def test_seats_of_joints_and_defaults():
    assert PLAYING.seated == dict.fromkeys("ABCD", "loaded")
    assert PLAYING.has_errors
    some = PLAYING.with_values({"joints.A.seat": "free", "B.seat.xi": "30 deg", "C.pin.clearance": 0})
    assert some.seated == {"B": Seat(xi="30 deg").complete(), "D": "loaded"}
    values = some.parameters()
    assert (values["joints.B.seat.beta"], values["joints.B.seat.xi"]) == (0, pytest.approx(math.pi / 6))
    free = PLAYING.with_values({"joint_defaults.seat": "free"})
    assert (free.seated, free.has_errors) == ({}, False)
    assert SLIDER.seated == {}


def test_a_default_seat_is_for_joints_with_play():
    found = RSSR.with_values({"joint_defaults.seat": "loaded"})
    assert {name: joint.seat for name, joint in found.effective_joints.items()} == {
        **dict.fromkeys("ABC", "free"), "D": "loaded"
    }  # fmt: skip
    ball = RSSR.with_values({"B.pin.clearance": "10 um"})
    data = ball.data()
    data["joints"]["B"]["seat"] = {"direction": [0, 0, "1"]}
    found = Mechanism(**data)
    assert found.parameters()["joints.B.seat.direction.z"] == 1
    assert "joints.B.seat.xi" not in found.parameters()
    assert isinstance(found.seated["B"], Seat)
    turned = found.with_values({"joints.B.seat.direction.x": 1.0})
    assert turned.parameters()["joints.B.seat.direction.x"] == 1


def test_the_end_float_of_the_defaults_is_for_revolute_joints():
    data = RSSR.data()
    data["joint_defaults"]["pin"] = {"end_float": "0.1 mm"}
    values = Mechanism(**data).parameters()
    assert [f"joints.{name}.pin.end_float" in values for name in "ABCD"] == [True, False, False, True]


@pytest.mark.parametrize(
    ("mechanism", "name", "value", "what"),
    [
        (FOURBAR, "errors.ABX", 1, "there is no number named 'ABX' — did you mean 'AB'?"),
        (FOURBAR, "errors.mass", 1, "the name 'mass' stands for 4 numbers"),
        (FOURBAR, "errors.AB", "0.1", "errors.AB: '0.1' has no unit where a length is needed"),
        (FOURBAR, "errors.gamma", "1 mm", "errors.gamma: '1 mm' is a length where an angle is needed"),
        (FOURBAR, "errors.AB", "AB / 1000", "is defined by itself: AB → AB"),
        (FOURBAR, "errors.AB", "CX / 1000", "errors.AB: 'CX / 1000' refers to 'CX'"),
        (FOURBAR, "B.misalignment.tilt", "1 deg", "B.misalignment.tilt: a revolute joint in the plane cannot tilt"),
        (SLIDER, "S.misalignment.offset", "1 mm", "a prismatic joint in the plane has no plain pin whose misalignment"),
        (RSSR, "B.misalignment.tilt", "1 deg", "a spherical joint in space has no plain pin whose misalignment"),
        (FOURBAR, "joints.B.seat", "loaded", "joints.B: a seat without play"),
        (FOURBAR, "B.pin.hole_radius", "7 mm", "is 7 mm, less than the radius 7.5 mm of the pin"),
        (FOURBAR, "joint_defaults.pin.end_float", "1 mm", "a revolute joint in the plane has no play along"),
        (RSSR, "B.pin.end_float", "1 mm", "a spherical joint in space has no play along an axis"),
        (PLAYING, "B.seat.beta", "3 deg", "joints.B.seat.beta: a revolute joint in the plane does not tilt"),
        (PLAYING, "", {"B.seat": {"direction": [1, 0]}}, "has its seat stated by angles"),
        (PLAYING, "joints.A.seat", "tight", "'tight' is not one of 'free' or 'loaded'"),
        (PLAYING, "joints.A.seat", [1, 2], "takes free, loaded or a group"),
        (SLIDER, "O.pin.hole_radius", "11 mm", "joints.O.pin.fit: is stated beside hole_radius"),
        (FOURBAR, "", {"errors.AB": 1e-5, "errors.dimensions.AB": 1e-5}, "'dimensions.AB' and 'AB' are the same numb"),
        (FOURBAR, "", {"B.pin.hole_radius": "8 mm", "B.pin.clearance": "1 um"}, "is stated beside clearance"),
        (RSSR, "", {"B.pin.clearance": "1 um", "B.seat.xi": 1}, "joint in space has its seat stated by a direction"),
    ],
)
def test_what_cannot_be_stated_is_refused(mechanism, name, value, what):
    assert what in refusal(mechanism, value if isinstance(value, dict) else {name: value})


RSSR_PIN = {key: value for key, value in RSSR.data()["joints"]["D"]["pin"].items() if key != "length"}


@pytest.mark.parametrize(
    ("mechanism", "joint", "keys", "what"),
    [
        (SLIDER, "S", {"seat": "loaded", "guide": {"clearance": "10 um"}, "friction": 0}, "joints.S: a seat without"),
        (RSSR, "D", {"pin": RSSR_PIN, "friction": 0}, "joints.D: a seat without the length of the pin"),
        (PLAYING, "A", {"seat": {}}, "joints.A.seat: states nothing"),
        (PLAYING, "B", {"seat_on": "frame"}, "joints.B.seat_on: 'frame' is no link of this joint"),
        (SLIDER, "S", {"seat_on": "frame"}, "joints.S.seat_on: a prismatic joint in the plane needs none"),
        (PLAYING, "B", {"seat": {"xi": 0.5}, "seat_on": PLAYING.joints["B"].links[0]}, "or its seat is stated"),
        *((RSSR, "A", {"type": kind, "seat": "loaded", "friction": 0, "pin": {}}, f"a {kind} joint in space has no pl")
          for kind in ("universal", "planar", "fixed")),
        (RSSR, "A", {"type": "helical", "pitch": 1e-3, "seat": "loaded", "pin": {}}, "in space has no play that"),
    ],
)  # fmt: skip
def test_joints_with_seats_stated_wrongly(mechanism, joint, keys, what):
    data = mechanism.data()
    data["joints"][joint] |= keys
    with pytest.raises(MechanismError) as error:
        Mechanism(**data)
    assert what in str(error.value)


# what is doubtful
def with_fit(text, **joint):
    data = FOURBAR.data()
    data["joints"]["B"] |= {"pin": {"fit": text}, **joint}
    return Mechanism(**data)


def test_press_fits():
    (doubt,) = doubts(with_fit("40 mm H7/p6"))
    assert "40 mm H7/p6 is a press fit, no play: it cannot turn as a bearing" in doubt
    assert "-42 um to -1 um" in doubt
    (doubt,) = doubts(with_fit("25 mm H7/k6"))
    assert "25 mm H7/k6 may press: its play on the diameter is -15 um to 19 um" in doubt
    assert not doubts(with_fit("25 mm H7/g6"))
    assert not doubts(with_fit("25 mm H7/h6"))  # 0 … 34 µm
    with pytest.raises(MechanismError, match=r"nominal play of the fit 40 mm H7/p6 is -10\.75 um on the radius"):
        with_fit("40 mm H7/p6", seat="loaded")
    with_fit("40 mm H7/p6", seat="free")


def test_large_plays_and_short_pins():
    assert not doubts(PLAYING)
    (doubt,) = doubts(PLAYING.with_values({"A.pin.clearance": "0.31 mm"}))
    assert "a play of 0.31 mm is 1.03 % of the 30 mm from 'A' to 'B'" in doubt
    eccentric = {"A.pin.clearance": "0.31 mm", "A.pin.radius": "35 mm"}  # wider than the crank is long: a lever still
    (doubt,) = doubts(PLAYING.with_values(eccentric))
    assert "a play of 0.31 mm is 1.03 % of the 30 mm from 'A' to 'B'" in doubt
    assert not doubts(RSSR)
    # 2 · 10 · 0.51 / 20² = 0.0255
    (doubt,) = doubts(RSSR.with_values({"D.pin.hole_radius": "10.51 mm"}))
    assert "the error is up to 2.5 %" in doubt or "the error is up to 2.6 %" in doubt
    found = doubts(RSSR.with_values({"D.pin.length": "19 mm"}))
    assert any("the pin is 19 mm long, less than its diameter 20 mm" in doubt for doubt in found)
    assert not doubts(RSSR.with_values({"D.pin.length": "19 mm", "D.seat": "free"}))
    assert doubts(RSSR.with_values({"D.pin.length": "19 mm", "D.seat": "free", "D.misalignment.tilt": 1e-3}))
    (doubt,) = doubts(FOURBAR.with_values({"joint_defaults.seat": "loaded"}))
    assert "joint_defaults.seat: no joint has play" in doubt
