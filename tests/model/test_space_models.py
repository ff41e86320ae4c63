"""Spatial models: every way to state one wrongly is a finding; loops and links are written as they were read."""

from __future__ import annotations

import copy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from trunnion.errors import Finding, MechanismError, Severity
from trunnion.model.checks.check import check_model
from trunnion.model.file import placed
from trunnion.model.joint_parts import contact_lacks, has_guide, has_pin, motions
from trunnion.model.mechanism import Mechanism
from trunnion.model.parts import Joint

FindingsOf = Callable[..., tuple[Finding, ...]]
Mistake = Callable[..., None]

# A crank with balls at both ends of its rod, which pushes a slider: R, S, S, P, and a screw beside it.
RSSP = """\
trunnion: 1
space: spatial
gravity: [0, 0, -9.81]
links:
  ground:
    points: {A: {at: [0, 0, 0], axis: [0, 0, 1]}, D: {at: [0, 60 mm, 20 mm], axis: [1, 0, 0], x: [0, 0, 1]}}
  crank:
    points: {A: {at: [0, 0, 0], axis: [0, 0, 1]}, B: [30 mm, 0, 0]}
    mass: 0.4 kg
  rod:
    points: {B: [0, 0, 0], C: [120 mm, 0, 0]}
    mass: 0.2 kg
    inertia: {xx: 1.0e-6, yy: 9.6e-4, zz: 9.6e-4}
    inertia_about: origin
  slider:
    points: {C: [0, 0, 0], D: {at: [0, 0, 0], axis: [1, 0, 0], x: [0, 0, 1]}}
joints:
  A: {type: revolute, links: [ground, crank], pin: {bearing: 40 mm}}
  B: {type: spherical, links: [crank, rod]}
  C: {type: spherical, links: [rod, slider]}
  D: {type: prismatic, links: [ground, slider]}
joint_defaults:
  pin: {radius: 6 mm}
  guide: {length: 50 mm, width: 40 mm}
  friction: 0.1
drivers:
  A: {speed: 10 rad/s}
loads:
  work: {joint: D, resisting_force: 100 N}
springs:
  back: {between: [ground.D, slider.C], stiffness: 2 N/mm, free_length: 60 mm}
assembly:
  C: [100 mm, 60 mm, 20 mm]
measures:
  height: {point: rod.C, axis: z}
"""

# what is replaced, by what, then the finding: line, where, part of what and of the remedy
CASES = [
    ("A: {at: [0, 0, 0], axis: [0, 0, 1]}, B", "A: [0, 0, 0], B", 8, "links.crank.points.A",
     "has no axis, a revolute joint needs one", "axis: [0, 0, 1]"),
    ("A: {at: [0, 0, 0], axis: [0, 0, 1]}, B", "A: {at: [0, 0, 0], axis: [0, 0, 0]}, B", 8,
     "links.crank.points.A.axis", "no direction", "[1, 0, 0]"),
    ("A: {at: [0, 0, 0], axis: [0, 0, 1]}, B", "A: {at: [0, 0], axis: [0, 0, 1]}, B", 8, "links.crank.points.A",
     "has 2 coordinates, a spatial model needs 3", "give 3"),
    ("B: [30 mm, 0, 0]", "E: [30 mm, 0, 0]", 19, "joints.B", "has no point 'B'", "add B: [x, y, z]"),
    ("axis: [1, 0, 0], x: [0, 0, 1]}}\n  crank", "axis: [1, 0, 0], x: [-2, 0, 0]}}\n  crank", 6,
     "links.ground.points.D.x", "lies along the axis", "across"),
    ("B: [30 mm, 0, 0]", "B: {at: [30 mm, 0, 0], x: [0, 0, 3]}", 8, "links.crank.points.B.x",
     "lies along the axis [0, 0, 1]", "across"),
    ("type: revolute", "type: helical", 18, "joints.A", "a helical joint without a pitch", "pitch: 5 mm"),
    ("type: revolute", "type: helical, pitch: 0", 18, "joints.A.pitch", "is 0", "revolute"),
    ("type: revolute", "type: revolute, pitch: 3 mm", 18, "joints.A.pitch", "has no pitch", "helical"),
    ("  A: {speed: 10 rad/s}", "  B: {speed: 10 rad/s}", 27, "drivers.B", "is spherical: it has 3 freedoms",
     "revolute, prismatic, cylindrical or helical"),
    (", pin: {bearing: 40 mm}", "", 18, "joints.A", "without the length of the bearing", "bearing: …"),
    ("type: revolute, links: [ground, crank], pin: {bearing: 40 mm}", "type: universal, links: [ground, crank]", 18,
     "joints.A", "without the length of the bearing", "bearing: …"),
    ("  pin: {radius: 6 mm}\n", "", 19, "joints.B", "without the radius of the ball", "radius: …"),
    ("length: 50 mm, ", "", 21, "joints.D", "without the length of the guide", "length: …"),
    ("type: revolute, links: [ground, crank], pin: {bearing: 40 mm}", "type: planar, links: [ground, crank]", 18,
     "joints.A.friction", "friction of a planar joint is not modelled", "friction: 0"),
    ("type: revolute, links: [ground, crank], pin: {bearing: 40 mm}",
     "type: fixed, links: [ground, crank], friction: 0.1", 18, "joints.A.friction", "friction of a fixed", "remove"),
    ("type: revolute, links", "type: planar, friction: 0, links", 18, "joints.A.pin", "neither guide nor pin",
     "remove"),
    ("type: revolute", "type: revolute, guide: {length: 1}", 18, "joints.A.guide", "a pin, not a guide", "pin"),
    ("type: spherical, links: [rod", "type: spherical, pin: {offset: 1 mm}, links: [rod", 20, "joints.C.pin.offset",
     "a ball has no axis", "move"),
    ("{radius: 6 mm}", "{radius: 6 mm, clearance: 7 mm}", 23, "joint_defaults.pin.clearance", "not less than the",
     "unit"),
    ("{joint: D, resisting_force: 100 N}", "{joint: D, resisting_torque: 1 N m}", 29, "loads.work.resisting_torque",
     "a prismatic joint has no rotation to resist", "remove"),
    ("{joint: D, resisting_force: 100 N}", "{joint: B, resisting_torque: 1 N m}", 29, "loads.work.resisting_torque",
     "a spherical joint has no one axis that a resisting torque", "moment on a link"),
    ("{joint: D, resisting_force: 100 N}", "{link: slider, at: C, force: [1, 0]}", 29, "loads.work.force",
     "has 2 coordinates", "give 3"),
    ("{joint: D, resisting_force: 100 N}", "{link: slider, moment: 3}", 29, "loads.work.moment", "is [x, y, z]",
     "[x, y, z]"),
    ("between: [ground.D, slider.C], stiffness: 2 N/mm, free_length: 60 mm", "joint: C, damping: 1 N m s/rad", 31,
     "springs.back.joint", "a spherical joint has no one axis for a spring", "two points"),
    ("C: [100 mm, 60 mm, 20 mm]", "C: [100 mm, 60 mm]", 33, "assembly.C", "has 2 coordinates", "give 3"),
    ("C: [100 mm, 60 mm, 20 mm]", "C: 30 deg", 33, "assembly.C", "one number does not state how far a spherical joint",
     "[x, y, z]"),
    ("C: [100 mm, 60 mm, 20 mm]", "rod.C: 30 deg", 33, "assembly.rod.C", "not an angle", "[x, y, z]"),
    ("C: [100 mm, 60 mm, 20 mm]", "D: 30 deg", 33, "assembly.D", "an angle where a length", "60 mm"),
    ("C: [100 mm, 60 mm, 20 mm]", "wheel: way-1", 33, "assembly.wheel", "and 'wheel' is none", "'crank'"),
    ("{point: rod.C, axis: z}", "{angle: rod}", 35, "measures.height.angle", "not turned by one angle", "add axis"),
    ("inertia: {xx: 1.0e-6, yy: 9.6e-4, zz: 9.6e-4}", "inertia: 9.6e-4", 13, "links.rod.inertia",
     "of a spatial link is {xx", "{xx"),
    ("yy: 9.6e-4, zz", "yy: 1.9e-3, zz", 13, "links.rod.inertia", "no body has the principal moments", "about"),
    ("inertia_about: origin", "centre: [60 mm, 0, 30 mm]\n    inertia_about: origin", 13, "links.rod.inertia",
     "no body has the principal moments", "inertia_about"),
    ("mass: 0.4 kg", "centre: {distance: 15 mm, angle: 0}", 9, "links.crank.centre", "in the plane only",
     "[x, y, z]"),
    ("drivers:", "gears:\n  mesh: {joints: [A, D], ratio: 2}\ndrivers:", 27, "gears.mesh", "planar", "planar"),
]  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_one_mistake_is_found_where_it_is(mistake: Mistake, case: tuple[Any, ...]) -> None:
    mistake(RSSP, case, whole=True)


def test_the_model_without_mistakes(tmp_path: Path) -> None:
    path = tmp_path / "rssp.yaml"
    path.write_text(RSSP, encoding="utf-8")
    assert not check_model(Mechanism.read(path))
    path.write_text(RSSP.replace(", width: 40 mm", ""), encoding="utf-8")
    (note,) = check_model(Mechanism.read(path))
    assert (note.where, note.severity) == ("joints.D", Severity.NOTE)
    assert "torsion about the slide" in note.what


@pytest.mark.parametrize(
    ("moments", "severity"),
    [
        ("xx: 27.6, yy: 34.5, zz: 6.91", None),
        ("xx: 27.6, yy: 34.6, zz: 6.91", Severity.WARNING),  # a plate, of three digits
        ("xx: 27.6, yy: 34.8, zz: 6.91", Severity.WARNING),
        ("xx: 27.6, yy: 34.9, zz: 6.91", Severity.ERROR),
        ("xx: 1e-6, yy: 1e-6, zz: -1e-8", Severity.ERROR),
    ],
)
def test_moments_of_inertia_that_were_rounded(tmp_path: Path, moments: str, severity: Severity | None) -> None:
    path = tmp_path / "plate.yaml"
    path.write_text(RSSP.replace("xx: 1.0e-6, yy: 9.6e-4, zz: 9.6e-4", moments), encoding="utf-8")
    try:
        told = [one for one in Mechanism.read(path).checked if one.where == "links.rod.inertia"]
    except MechanismError as error:
        told = [*error.findings]
    assert [one.severity for one in told] == ([severity] if severity else [])
    if severity is Severity.WARNING:
        assert "exceeds the sum of the others by 0." in told[0].what


@pytest.mark.parametrize(
    ("change", "where", "what"),
    [
        ("joint_defaults: {guide: {length: 1, width: 1}}", "joint_defaults.guide.width", "no torsion"),
    ],
)
def test_what_is_for_space_is_refused_in_the_plane(findings_of: FindingsOf, change: str, where: str, what: str) -> None:
    plane = """\
trunnion: 1
links: {ground: {points: {A: [0, 0]}}, arm: {points: {A: [0, 0]}}}
joints: {A: {type: revolute, links: [ground, arm]}}
drivers: {A: {speed: 1}}
"""
    found = findings_of(plane + change)
    assert [(one.where, one.line) for one in found if what in one.what] == [(where, 5)]


# ---- loops ----------------------------------------------------------------------------------------------------

LOOP: dict[str, Any] = {
    "space": "spatial",
    "loop": [
        {"joint": "a", "type": "revolute", "link": "shaft", "twist": "90 deg", "slide": "3 mm"},
        {"joint": "b", "type": "cylindrical", "link": "cross", "twist": "80 deg", "distance": "2 mm"},
        {"joint": "c", "type": "prismatic", "link": "fork", "twist": "70 deg", "rotation": "10 deg"},
        {"joint": "d", "type": "helical", "link": "ground", "twist": "60 deg", "pitch": "5 mm"},
    ],
    "links": {"cross": {"mass": 1, "centre": [0, 0, "1 mm"], "frame": "c", "points": {"tip": [0, 0, "20 mm"]}}},
    "joint_defaults": {"pin": {"radius": "5 mm", "bearing": "30 mm"}, "guide": {"length": 0.1, "width": 0.05},
                       "friction": {"law": "coulomb", "coefficient": 0.1, "model": "pezzuti"}},
    "drivers": {"a": {"speed": 1}},
    "loads": {"weight": {"link": "cross", "at": "tip", "force": [0, 0, -1]},
              "brake": {"link": "fork", "at": "c", "force": [0, 0, 1], "moment": [1, 0, 0]},
              "screw": {"joint": "d", "resisting_force": 3}},
    "springs": {"pull": {"between": ["cross.tip", "ground.a"], "preload": 3}},
    "assembly": {"b": "30 deg", "fork.d": [0, 0, 0], "cross": "way-2"},
    "measures": {"tip": {"point": "fork.c", "axis": "z"}},
}  # fmt: skip


def changed(*path: Any, to: Any) -> dict[str, Any]:
    """The loop with one entry changed, or taken out (None)."""
    data = copy.deepcopy(LOOP)
    holder = data
    for key in path[:-1]:
        holder = holder.setdefault(key, {}) if isinstance(holder, dict) else holder[key]
    if to is None:
        del holder[path[-1]]
    else:
        holder[path[-1]] = to
    return data


@pytest.mark.parametrize(
    ("data", "where", "what"),
    [
        (changed("loop", 1, "type", to="spherical"), "loop.b.type", "no place in the table of a loop"),
        (changed("loop", 1, "type", to="universal"), "loop.b.type", "no place in the table of a loop"),
        (changed("loop", 1, "slide", to=1), "loop.b.slide", "is free, not constant"),
        (changed("loop", 2, "slide", to=1), "loop.c.slide", "is free, not constant"),
        (changed("loop", 3, "rotation", to=1), "loop.d.rotation", "is free, not constant"),
        (changed("loop", 3, "pitch", to=None), "joints.d", "without a pitch"),
        (changed("loop", 0, "pitch", to=1), "joints.a.pitch", "has no pitch"),
        (changed("loop", to=LOOP["loop"][-1:]), "loop", "one joint makes no loop"),
        (changed("ground", to="wall"), "ground", "there is no link 'wall'"),
        ({**changed("links", "wall", to={}), "ground": "wall"}, "ground", "'wall' is not a link of the loop"),
        (changed("links", "cross", "points", "b", to=[0, 0, 0]), "links.cross.points.b", "cannot be placed again"),
        (changed("links", "cross", "frame", to="d"), "links.cross.frame", "'d' is not a joint of the link 'cross'"),
        (changed("loads", "weight", "at", to="b1"), "loads.weight.at", "the link 'cross' has no point 'b1'"),
        (changed("loads", "weight", "link", to="crass"), "loads.weight.link", "there is no link 'crass'"),
        (changed("loads", "screw", "resisting_torque", to=1), "loads.screw", "a rotation and a slide at once"),
        (changed("loads", "brake", "moment", to=1), "loads.brake.moment", "is [x, y, z]"),
        (changed("springs", "pull", "between", to=["cross.tip", "ground.b"]), "springs.pull.between", "'ground.b'"),
        (changed("assembly", "fork.a", to=[0, 0, 0]), "assembly.fork.a", "there is no point 'fork.a'"),
        (changed("assembly", "ground", to="way-1"), "assembly.ground", "of a moving link"),
        (changed("joint_defaults", "pin", "bearing", to=None), "joints.a", "without the length of the bearing"),
        (changed("drivers", "e", to={"speed": 1}), "drivers.e", "there is no joint 'e'"),
    ],
)
def test_mistakes_in_a_loop(data: dict[str, Any], where: str, what: str) -> None:
    with pytest.raises(MechanismError) as error:
        Mechanism(**data)
    found = [one for one in error.value.findings if one.where == where and what in one.what]
    assert found, error.value
    assert found[0].remedy


def test_names_of_a_loop() -> None:
    mechanism = Mechanism(**LOOP)
    assert not [one for one in check_model(mechanism) if one.severity is Severity.ERROR]
    assert mechanism.points == {"cross": ("tip", "b", "c"), "shaft": ("a", "b"), "fork": ("c", "d"),
                                "ground": ("a", "d")}  # fmt: skip
    assert list(mechanism.effective_links) == ["cross", "shaft", "fork", "ground"]
    assert mechanism.effective_joints["d"].links == ("fork", "ground")


@pytest.mark.parametrize("extension", ["yaml", "json"])
def test_what_is_written_is_what_was_read(extension: str, tmp_path: Path) -> None:
    spatial = tmp_path / "rssp.yaml"
    spatial.write_text(RSSP, encoding="utf-8")
    for mechanism in (Mechanism(**LOOP), Mechanism.read(spatial)):
        path = tmp_path / f"copy.{extension}"
        mechanism.write(path)
        again = Mechanism.read(path)
        assert again == mechanism
        assert again.data() == mechanism.data()
        assert again.digest == mechanism.digest


def test_later_findings_about_a_row_have_its_line(tmp_path: Path) -> None:
    path = tmp_path / "loop.yaml"
    Mechanism(**LOOP).write(path)
    line = 1 + next(k for k, text in enumerate(path.read_text("utf-8").splitlines()) if "joint: b" in text)
    for where in ("joints.b", "loop.b.twist"):
        assert placed([Finding("locks", where)], path) == [Finding("locks", where, line=line, file=str(path))]


def test_rows_of_a_loop_are_set_by_name() -> None:
    mechanism = Mechanism(**LOOP)
    changed_ = mechanism.with_values({"loop.b.twist": "81 deg", "loop.a.slide": "4 mm", "d.pitch": "-5 mm",
                                      "b.pin.bearing": "40 mm", "c.friction.coefficient": 0.2})  # fmt: skip
    values = changed_.parameters()
    assert [row.twist.source for row in changed_.loop] == ["90 deg", "81 deg", "70 deg", "60 deg"]
    assert (values["loop.a.slide"], values["joints.d.pitch"]) == (4e-3, -5e-3)
    assert [values[f"joints.{name}.pin.bearing"] for name in "abd"] == [0.03, 0.04, 0.03]
    assert [values[f"joints.{name}.friction.coefficient"] for name in "abcd"] == [0.1, 0.1, 0.2, 0.1]
    for path, value in mechanism.parameters().items():  # every number can be set
        other = value * 1.001 if value else 1e-6
        assert mechanism.with_values({path: other}).parameters()[path] == other, path


def test_friction_of_a_loop_is_put_off_and_changed() -> None:
    own = changed("loop", 1, "friction", to=0.3)
    mechanism = Mechanism(**own)
    assert mechanism.effective_joints["b"].friction.model == "pezzuti"  # type: ignore[union-attr]
    assert all(one.friction is None for one in mechanism.with_friction("off").effective_joints.values())
    same = mechanism.with_friction("coulomb").effective_joints
    found = {name: one.friction.parameters["coefficient"].evaluate() for name, one in same.items()}  # type: ignore[union-attr]
    assert found == {"a": 0.1, "b": 0.3, "c": 0.1, "d": 0.1}
    with pytest.raises(MechanismError) as error:
        mechanism.with_friction("brown-mcphee")
    assert {one.where for one in error.value.findings} == {"joint_defaults.friction", "joints.b.friction"}


# ---- what a type has ------------------------------------------------------------------------------------------


def test_what_touches_in_a_joint() -> None:
    assert [name for name in MOVES if has_pin(name)] == ["revolute", "cylindrical", "spherical", "universal", "helical"]
    assert [name for name in MOVES if has_guide(name)] == ["prismatic"]
    for name, expected in MOVES.items():
        assert motions(name) == expected
    pin = {"links": ("a", "b"), "pin": {"radius": 1}}
    for name in ("revolute", "cylindrical", "universal", "helical"):
        assert contact_lacks(Joint(type=name, **pin), spatial=True) == ("bearing",)
        assert contact_lacks(Joint(type=name, links=("a", "b"), pin={"length": 1}), spatial=True) == ("radius",)
        assert contact_lacks(Joint(type=name, **pin), spatial=False) == ()
    assert contact_lacks(Joint(type="spherical", **pin), spatial=True) == ()


MOVES = {
    "revolute": ("rotation",),
    "prismatic": ("slide",),
    "cylindrical": ("rotation", "slide"),
    "spherical": (),
    "universal": (),
    "helical": ("rotation", "slide"),
    "planar": (),
    "fixed": (),
}


@pytest.mark.parametrize("friction", [0, {"coefficient": 0}])
def test_no_friction_needs_no_bearing(friction: object) -> None:
    data = changed("joint_defaults", to={"pin": {"radius": 1}, "friction": friction})
    assert all(joint.friction is None for joint in Mechanism(**data).effective_joints.values())


def test_a_fixed_joint_is_not_asked_for_friction_by_the_defaults() -> None:
    data: dict[str, Any] = {
        "space": "spatial",
        "links": {
            "ground": {"points": {"a": {"at": [0, 0, 0], "axis": [0, 0, 1]}}},
            "arm": {"points": {"a": {"at": [0, 0, 0], "axis": [0, 0, 1]}, "b": [1, 0, 0]}},
            "head": {"points": {"b": [0, 0, 0]}, "mass": 1},
        },
        "joints": {
            "a": {"type": "revolute", "links": ["ground", "arm"]},
            "b": {"type": "fixed", "links": ["arm", "head"]},
        },
        "joint_defaults": {"pin": {"radius": 0.01, "bearing": 0.1}, "friction": 0.1},
        "drivers": {"a": {"speed": 1}},
        "gravity": [0, 0, 0],
    }
    joints = Mechanism(**data).effective_joints
    assert joints["a"].friction is not None
    assert (joints["b"].friction, joints["b"].pin) == (None, None)


def test_choices_among_words_are_set_like_numbers() -> None:
    examples = Path(__file__).parents[2] / "examples"
    four_bar = Mechanism.read(examples / "fourbar-in-space.yaml")
    assert four_bar.over_constraint == "refuse"
    assert four_bar.with_values({"over_constraint": "minimum-norm"}).over_constraint == "minimum-norm"
    with pytest.raises(MechanismError, match="'refuse' or 'minimum-norm'"):
        four_bar.with_values({"over_constraint": "some"})
    cardan = Mechanism.read(examples / "pezzuti-cardan.yaml")

    def models(mechanism: Mechanism) -> list[str | None]:
        return [joint.friction.model for joint in mechanism.effective_joints.values() if joint.friction]

    assert models(cardan) == ["two-contact"] * 4
    assert models(cardan.with_values({"joint_defaults.friction.model": "pezzuti"})) == ["pezzuti"] * 4
    one = cardan.with_values({"joints.pin-1.friction.model": "pezzuti"})
    assert models(one) == ["two-contact", "pezzuti", "two-contact", "two-contact"]
    with pytest.raises(MechanismError):
        cardan.with_values({"joints.pin-9.friction.model": "pezzuti"})


def test_a_spatial_model_that_does_not_say_so_has_one_finding() -> None:
    data = Mechanism.read(Path(__file__).parents[2] / "examples" / "rssr.yaml").data()
    del data["space"]
    with pytest.raises(MechanismError) as raised:
        Mechanism(**data)
    (finding,) = raised.value.findings
    assert finding.where == "space"
    assert "space: spatial" in finding.remedy


def test_a_plain_angle_of_many_turns_is_doubted() -> None:
    data = Mechanism.read(Path(__file__).parents[2] / "examples" / "universal-joint.yaml").data()
    data["loop"][0]["twist"] = 90
    doubts = [finding for finding in check_model(Mechanism(**data)) if finding.severity is Severity.WARNING]
    assert any(
        "14.3 turns" in finding.what and finding.remedy.startswith("write 90 deg if it is in degrees")
        for finding in doubts
    )


@pytest.mark.parametrize(("text", "value"), [("20 Nm", 20.0), ("3 kNm", 3000.0), ("5 mNm", 0.005), ("20 N m", 20.0)])
def test_torques_written_without_a_space(text: str, value: float) -> None:
    cardan = Mechanism.read(Path(__file__).parents[2] / "examples" / "pezzuti-cardan.yaml")
    torque = cardan.with_values({"loads.brake.resisting_torque": text}).parameters()["loads.brake.resisting_torque"]
    assert torque == pytest.approx(value, rel=1e-15)
