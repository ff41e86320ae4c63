"""Every way to state a model wrongly is a finding that says what, where, in which line, and what to do."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from model_samples import FOURBAR
from ruamel.yaml import YAML

from trunnion.errors import Finding, MechanismError, Severity
from trunnion.model.checks.check import check_model
from trunnion.model.mechanism import Mechanism
from trunnion.model.parts import Joint

FindingsOf = Callable[..., tuple[Finding, ...]]
Mistake = Callable[..., None]

# what is replaced in FOURBAR, by what, then the finding: line, part of where, of what and of the remedy
CASES = [
    # keys and shapes
    ("mass: 4.8 kg", "mas: 4.8 kg", 11, "links.crank.mas", "the key 'mas' is unknown", "'mass'"),
    ("dimensions:", "dimension:", 3, "dimension", "the key 'dimension' is unknown", "'dimensions'"),
    ("{radius: 7.5 mm}", "{radiu: 7.5 mm}", 23, "joint_defaults.pin.radiu", "unknown", "'radius'"),
    ("{speed: 10 rad/s}", "{}", 26, "drivers.A", "'speed' is missing", "add"),
    ("{speed: 10 rad/s}", "10 rad/s", 26, "drivers.A", "not a group of entries", "key: value"),
    ("{speed: 10 rad/s}", "", 26, "drivers.A", "is empty", "give it a value"),
    ("{speed: 10 rad/s}", "{speed: 10,5 rad/s}", 26, "drivers.A.5 rad/s", "has no value", "point, not"),
    ("[ground, crank]", "[ground]", 18, "joints.A.links", "'", "add"),
    ("[ground, crank]", "ground", 18, "joints.A.links", "not a list", "[..., ...]"),
    ("[ground, crank]", "[ground, crank, rocker]", 18, "joints.A.links", "more than the 2", "remove"),
    ("[ground, crank]", "[ground, 3]", 18, "joints.A.links.1", "not a text", "quotes"),
    ("B: [AB, 0]", "B: [AB]", 10, "links.crank.points.B", "has 1 entries, at least 2", "give"),
    ("B: [AB, 0]", "B: AB", 10, "links.crank.points.B", "not a group", ""),
    ("B: [AB, 0]", "B: [AB, 0, 0]", 10, "links.crank.points.B", "has 3 coordinates", "give 2"),
    ("mass: 4.8 kg", "centre: 3", 11, "links.crank.centre", "takes [x, y] or {distance", ""),
    ("mass: 4.8 kg", "centre: {distance: 1 m}", 11, "links.crank.centre", "'angle' is missing", "add"),
    ("mass: 4.8 kg", "inertia_about: center", 11, "links.crank.inertia_about", "not one of 'centre' or 'origin'", ""),
    ("mass: 4.8 kg", "mass: [4.8 kg]", 11, "links.crank.mass", "is a list, not a number", "1.2 kg"),
    ("mass: 4.8 kg", "mass: true", 11, "links.crank.mass", "a yes/no value", "1.2 kg"),
    ("space: planar", "space: flat", 2, "space", "not one of 'planar' or 'spatial'", ""),
    ("trunnion: 1", "trunnion: 2", 1, "trunnion", "version 2, this program reads 1", "trunnion: 1"),
    ("trunnion: 1\n", "", 1, "trunnion", "version of the file is missing", "trunnion: 1"),
    # names that a spreadsheet would execute
    ("B: [AB, 0]", "'=B': [AB, 0]", 10, "links.crank.points.=B", "begins with '=', which makes a formula", "a letter"),
    ("  A: {type", "  +A: {type", 18, "joints.+A", "begins with '+'", "a letter"),
    ("  crank:", "  '@crank':", 9, "links.@crank", "begins with '@'", "a letter"),
    ("AB: 2 m", "-AB: 2 m", 4, "dimensions.-AB", "begins with '-'", "a letter"),
    # quantities
    ("mass: 4.8 kg", "mass: 4.8 m", 11, "links.crank.mass", "a length where a mass", "1.2 kg"),
    ("mass: 4.8 kg", "mass: '4.8'", 11, "links.crank.mass", "'4.8' has no unit where a mass", "1.2 kg"),
    ("mass: 4.8 kg", "mass: AB", 11, "links.crank.mass", "'AB' is a length where a mass", "1.2 kg"),
    ("mass: 4.8 kg", "mass: .nan", 11, "links.crank.mass", "nan is not a finite number", "finite"),
    ("mass: 4.8 kg", "mass: -.inf", 11, "links.crank.mass", "-inf is not a finite number", "finite"),
    ("mass: 4.8 kg", "mass: 1 kg * (AB / (AB - AB))", 11, "links.crank.mass", "no finite value (inf)", "divisions"),
    ("mass: 4.8 kg", "mass: -1 kg", 11, "links.crank.mass", "is -1 kg, which is negative", "at least 0"),
    ("inertia: 2 kg m^2", "inertia: -2", 14, "links.coupler.inertia", "negative", "unit"),
    ("[AB, 0]", "[ABC, 0]", 10, "links.crank.points.B.x", "'ABC' is not one of the dim", "'AB'"),
    ("[AB, 0]", "[AB + 3, 0]", 10, "links.crank.points.B.x", "a length and a number are added", "3 mm"),
    ("AB: 2 m", "AB: 2 m + BC", 4, "dimensions.AB", "'BC', which is not one", "known: 'AB', 'AD'"),
    ("AB: 2 m", "AB: 2 * AB", 4, "dimensions.AB", "is defined by itself: AB → AB", "a value"),
    ("AB: 2 m\n  AD: 5.5 m", "AB: AD\n  AD: AB", 4, "dimensions.A", "is defined by itself: A", "a value"),
    ("AB: 2 m", "AB: 2 m + 3 kg", 4, "dimensions.AB", "a length and a mass are added", ""),
    ("AB: 2 m", "AB: 2 m\n  a-b: 2 m", 5, "dimensions.a-b", "cannot be used in an expression", "letters"),
    ("AB: 2 m", "AB: 2 m\n  sin: 2 m", 5, "dimensions.sin", "reserved name of expressions", "rename"),
    ("10 rad/s", "10 m/s", 26, "drivers.A.speed", "a speed where an angular speed is needed", "1500 rpm"),
    ("10 rad/s", "10 Hz", 26, "drivers.A.speed", "'Hz' may count turns", "rpm"),
    ("radius: 7.5 mm", "radius: 7.5 kg", 23, "joint_defaults.pin.radius", "a mass where a length", "60 mm"),
    ("friction: 0.1", "friction: 3 mm", 24, "joint_defaults.friction", "a length where a number", "0.1"),
    ("C: [7.6, 2.1]", "C: 30 mm", 30, "assembly.C", "a length where an angle", "30 deg"),
    ("trunnion: 1", "trunnion: 1\nreferences: [A book, 3]", 2, "references.1", "is not a text", "in quotes"),
    # names
    ("  crank:\n", "  cr.ank:\n", 9, "links.cr.ank", "has a dot", "- or _"),
    ("  crank:\n", '  "cr\\u0007ank":\n', 9, "links", "control characters", "printable"),
    ("  crank:\n", '  "":\n', 9, "links", "empty", "remove"),
    ("[ground, crank]", "[ground, cranc]", 18, "joints.A.links", "there is no link 'cranc'", "'crank'"),
    ("[ground, crank]", "[crank, crank]", 18, "joints.A.links", "names the link 'crank' twice", "two different"),
    ("B: [AB, 0]", "Bx: [AB, 0]", 19, "joints.B", "the link 'crank' has no point 'B'", "add B: [x, y]"),
    ("A: {speed", "E: {speed", 26, "drivers.E", "there is no joint 'E' to drive", "'A'"),
    ("{link: coupler, at", "{link: couplr, at", 28, "loads.work.link", "no link 'couplr'", "'coupler'"),
    ("at: C", "at: E", 28, "loads.work.at", "has no point 'E'", "'B', 'C'"),
    ("C: [7.6, 2.1]", "K: [7.6, 2.1]", 30, "assembly.K", "there is no joint 'K'", "'A'"),
    ("C: [7.6, 2.1]", "crank.K: [7.6, 2.1]", 30, "assembly.crank.K", "no point 'crank.K'", "crank.A"),
    ("C: [7.6, 2.1]", "ground: way-1", 30, "assembly.ground", "of a moving link, and 'ground' is none", "'crank'"),
    ("C: [7.6, 2.1]", "C: way-1", 30, "assembly.C", "of a moving link, and 'C' is none", "'crank'"),
    ("C: [7.6, 2.1]", "coupler: way-x", 30, "assembly.coupler", "'way-x' is not the name of an", "way-1, way-2"),
    ("C: [7.6, 2.1]", "coupler: way-0", 30, "assembly.coupler", "'way-0' is not the name of an", "way-1, way-2"),
    ("C: [7.6, 2.1]", "coupler: Way 2", 30, "assembly.coupler", "'Way 2' is not the name of an", "way-1, way-2"),
    ("point: coupler.C", "point: coupler.Q", 32, "measures.tip.point", "no point 'coupler.Q'", "coupler.C"),
    ("{point: coupler.C, axis: x}", "{effort: B}", 32, "measures.tip.effort", "no driver 'B'", "'A'"),
    ("{point: coupler.C, axis: x}", "{angle: B}", 32, "measures.tip.angle", "no link 'B'", "'crank'"),
    ("{point: coupler.C, axis: x}", "{}", 32, "measures.tip", "measures nothing", "one of point"),
    ("{point: coupler.C, axis: x}", "{point: coupler.C}", 32, "measures.tip", "along an axis", "axis: x"),
    ("axis: x", "axis: z", 32, "measures.tip.axis", "no z in the plane", "x or y"),
    ("space: planar", "ground: base", 2, "ground", "there is no link 'base'", "'ground'"),
    ("type: revolute, links: [ground, crank]", "type: revolut, links: [ground, crank]", 18, "joints.A.type",
     "'revolut' is not a joint type", "'revolute'"),
    ("type: revolute, links: [ground, crank]", "type: spherical, links: [ground, crank]", 18, "joints.A",
     "a spherical joint does not exist in the plane", "revolute"),
    # what no linkage can have
    ("  rocker:\n", "  idle: {}\n  rocker:\n", 15, "links.idle", "no joint connects the link 'idle'", "remove it"),
    ("type: revolute, links: [ground, rocker]", "type: prismatic, links: [ground, rocker]", 8,
     "links.ground.points.D", "has no axis, a prismatic joint needs one", "axis: [1, 0]"),
    ("D: [AD, 0]", "D: {at: [AD, 0], axis: [0, 0]}", 8, "links.ground.points.D.axis", "no direction", "[1, 0]"),
    ("10 rad/s", "0", 26, "drivers.A.speed", "is 0: the driver does not move", "however small"),
    ("10 rad/s", "10 rad/s, start: 3 deg ± 1 deg", 26, "drivers.A.start", "does not vary", "driven link"),
    ("10 rad/s", "10 rad/s, range: [1, 1]", 26, "drivers.A.range", "begins and ends at 1", "extent"),
    ("B: [AB, 0]", "B: [0, 0]", 10, "links.crank.points", "'A' and 'B' of the link 'crank' are at one", "move"),
    ("10 rad/s", "10 rad/s, motor: {kind: induction, breakdown_effort: 9, breakdown_slip: 0.2, synchronous_speed: 1, "
     "power: 5 kW}", 26, "drivers.A.motor.power", "the key 'power' is unknown", "breakdown_slip = s (k + √(k² − 1))"),
    (", force: [0, -1 kN]", "", 28, "loads.work", "this load is empty", "force or a moment"),
    ("link: coupler, at: C", "at: coupler.C", 28, "loads.work", "neither or both", "link: coupler, at: C"),
    ("AB: 2 m", "AB: ±2 mm", 4, "dimensions.AB", "a tolerance without a value", "tolerances: {"),
    ("radius: 7.5 mm", "diameter: 15 mm", 23, "joint_defaults.pin.diameter", "unknown", "'radius', half the diameter"),
    ("link: coupler, at: C, ", "", 28, "loads.work", "neither or both of a link and a joint", "state link"),
    ("at: C, ", "", 28, "loads.work", "no point to act at", "add at"),
    ("force: [0, -1 kN]", "moment: [0, 0, 1 N m]", 28, "loads.work.moment", "one number", "one number"),
    ("force: [0, -1 kN]", "resisting_torque: 1 N m", 28, "loads.work", "acts on a joint", "joint: "),
    ("link: coupler, at: C, force: [0, -1 kN]", "joint: X, resisting_torque: 1 N m", 28, "loads.work.joint",
     "there is no joint 'X'", "'A'"),
    ("link: coupler, at: C, force: [0, -1 kN]", "joint: A, resisting_force: 1 N", 28,
     "loads.work.resisting_force", "a revolute joint has no slide to resist", "remove"),
    ("link: coupler, at: C, force: [0, -1 kN]", "joint: A", 28, "loads.work", "this load is empty", "resisting"),
    ("link: coupler, at: C, force: [0, -1 kN]", "joint: A, at: C, force: [0, 1]", 28, "loads.work",
     "are for a load on a link", "resisting"),
    ("{radius: 7.5 mm}", "{length: 7.5 mm}", 18, "joints.A", "friction without the radius of the pin", "radius: "),
    ("{radius: 7.5 mm}", "{radius: 0}", 23, "joint_defaults.pin.radius", "is 0, where friction needs it", "above 0"),
    ("{radius: 7.5 mm}", "{radius: -7.5 mm}", 23, "joint_defaults.pin.radius", "negative", "at least 0"),
    ("7.5 mm}", "7.5 mm, clearance: 8 mm}", 23, "joint_defaults.pin.clearance", "not less than the radius", "unit"),
    ("friction: 0.1", "friction: -0.1", 24, "friction.coefficient", "is -0.1, which is negative", "at least 0"),
    ("friction: 0.1", "friction: {coefficient: 0.1, pair_factor: 0}", 24, "pair_factor", "is 0", "above 0"),
    ("friction: 0.1", "friction: {coeficient: 0.1}", 24, "joint_defaults.friction.coeficient", "unknown to the",
     "'coefficient'"),
    ("friction: 0.1", "friction: {pair_factor: 1}", 24, "friction", "needs 'coefficient'", "add coefficient"),
    ("friction: 0.1", "friction: {law: colomb}", 24, "joint_defaults.friction.law", "not a friction law", "'coulomb'"),
    ("friction: 0.1", "friction: {coefficient: 0.1, model: one}", 24, "friction.model", "not a friction model", ""),
    ("links: [ground, crank]}", "links: [ground, crank], guide: {length: 1}}", 18, "joints.A.guide",
     "has a pin, not a guide", "pin"),
    ("links: [ground, crank]}", "links: [ground, crank], pin: {fit: 20 mm}}", 18, "joints.A.pin.fit",
     "'20 mm' is not a fit", "20 mm H7/g6"),
    ("links: [ground, crank]}", "links: [ground, crank], pin: {fit: H7/g6}}", 18, "joints.A.pin.fit",
     "'H7/g6' has no diameter", "or state the radius of the pin too"),
    ("links: [ground, crank]}", "links: [ground, crank], pin: {fit: 20H7/g6}}", 18, "joints.A.pin.fit",
     "'20' has no unit", "write 20 mm H7/g6"),
    ("links: [ground, crank]}", "links: [ground, crank], pin: {fit: 20 H7/g6}}", 18, "joints.A.pin.fit",
     "'20' has no unit", "20 mm H7/g6"),
    ("links: [ground, crank]}", "links: [ground, crank], pin: {fit: 20 mm H7/g6, radius: 1}}", 18, "joints.A.pin",
     "states radius and clearance already", "keep"),
    ("mass: 4.8 kg", "mass: 1 kg\n    centre: [1, 0]\n    inertia: 0.5\n    inertia_about: origin", 13,
     "links.crank.inertia", "less than m r² = 1", "inertia_about"),
    ("mass: 4.8 kg", "inertia: {xx: 1, yy: 1, zz: 1}", 11, "links.crank.inertia", "planar link is one number", "one"),
    ("mass: 4.8 kg", "frame: A", 11, "links.crank.frame", "for the links of a loop", "remove"),
]  # fmt: skip


@pytest.mark.spread(89)
@pytest.mark.parametrize("case", CASES)
def test_one_mistake_is_found_where_it_is(mistake: Mistake, case: tuple[Any, ...]) -> None:
    mistake(FOURBAR, case, 3)


def test_every_finding_in_one_go_in_the_order_of_the_file(findings_of: FindingsOf) -> None:
    text = FOURBAR
    for old, new in (
        ("AB: 2 m", "AB: 2 furlongz"),
        ("mass: 4.8 kg", "mas: 4.8 kg"),
        ("inertia: 2 kg m^2", "inertia: 2 kg"),
        ("D: {type: revolute, links: [ground, rocker]}", "D: {type: revolute, links: [ground, roker]}"),
        ("{speed: 10 rad/s}", "{start: 0}"),
        ("at: C", "at: Z"),
        ("axis: x", "axis: w"),
    ):
        text = text.replace(old, new)
    found = findings_of(text)
    assert [one.line for one in found] == [4, 11, 14, 21, 26, 28, 32], "\n".join(map(str, found))


def test_a_lost_entry_is_not_reported_twice(findings_of: FindingsOf) -> None:
    found = findings_of(FOURBAR.replace("links: [crank, coupler]", "link: [crank, coupler]"))
    assert {one.where for one in found} == {"joints.B", "joints.B.link"}, "\n".join(map(str, found))


def test_a_wrong_coordinate_hides_nothing_else(findings_of: FindingsOf) -> None:
    found = findings_of(FOURBAR.replace("mass: 4.8 kg", "mass: -1\n    centre: [1 kg, 0]"))
    assert [one.where for one in found] == ["links.crank.mass", "links.crank.centre.x"], "\n".join(map(str, found))


def test_no_friction_needs_no_radius() -> None:
    mechanism = Mechanism.model_validate(
        YAML(typ="safe", pure=True).load(
            FOURBAR.replace("{radius: 7.5 mm}", "{}").replace("friction: 0.1", "friction: 0")
        )
    )
    assert all(joint.friction is None for joint in mechanism.effective_joints.values())


def test_python_raises_the_same_findings_without_lines(findings_of: FindingsOf) -> None:
    broken = Mechanism.model_validate
    with pytest.raises(MechanismError) as error:
        broken({"links": {"ground": {"points": {"A": [0, 0]}, "mas": 1}}, "joints": {"A": Joint(
            type="revolute", links=("ground", "crank"))}})  # fmt: skip
    found = error.value.findings
    assert ("links.ground.mas", "the key 'mas' is unknown") in {(one.where, one.what) for one in found}
    assert any(one.what == "there is no link 'crank'" for one in found)
    assert all(one.line is None and not one.file for one in found)


@pytest.mark.parametrize(
    ("section", "entry"),
    [
        ("joint_defaults", {"pin": {"diameter": 0.015}, "friction": 0.1}),
        (
            "springs",
            {"s": {"between": ["ground.A", "coupler.C"], "stifness": 10.0, "only": "push", "free_length": 9.0}},
        ),
    ],
)
def test_a_mistyped_key_is_told_without_what_follows(section: str, entry: dict[str, object]) -> None:
    """The rest is checked as if the key that was meant stood there."""
    data = YAML(typ="safe").load(FOURBAR) | {section: entry}
    with pytest.raises(MechanismError) as error:
        Mechanism(**data)
    (found,) = error.value.findings
    assert "did you mean" in found.remedy


def test_a_motor_stated_by_its_power_is_told_what_to_state() -> None:
    """And no unit of a power is expected there."""
    data = YAML(typ="safe").load(FOURBAR)
    data["drivers"]["A"]["motor"] = {"kind": "induction", "power": "5 kW"}
    with pytest.raises(MechanismError) as error:
        Mechanism(**data)
    (found,) = (one for one in error.value.findings if one.where.endswith("motor.power"))
    assert "breakdown_effort = k P" in found.remedy


def test_doubts_are_kept_apart_from_errors(findings_of: FindingsOf, tmp_path) -> None:  # type: ignore[no-untyped-def]
    path = tmp_path / "model.yaml"
    path.write_text(FOURBAR.replace("AB: 2 m", "AB: 2 m\n  unused: 3").replace("friction: 0.1", "friction: 1.4"))
    found = check_model(Mechanism.read(path))
    assert {one.severity for one in found} == {Severity.WARNING, Severity.NOTE}
    assert {one.where for one in found} >= {"dimensions.unused", "joint_defaults.friction.coefficient"}


LOOP = {
    "space": "spatial",
    "loop": [
        {"joint": "a", "type": "revolute", "link": "shaft", "twist": "90 deg"},
        {"joint": "b", "type": "cylindrical", "link": "cross", "twist": "90 deg"},
        {"joint": "c", "type": "cylindrical", "link": "ground", "twist": "90 deg"},
    ],
    "drivers": {"a": {"speed": 1}},
}


def _loop(**changes: object) -> dict[str, object]:
    return {**LOOP, **changes}


@pytest.mark.parametrize(
    ("data", "where", "what"),
    [
        (_loop(space="planar"), "loop", "a loop is spatial"),
        (_loop(joints={"d": {"type": "revolute", "links": ["shaft", "cross"]}}), "joints", "both given"),
        (_loop(loop=[*LOOP["loop"], LOOP["loop"][0]]), "loop", "the joint 'a' occurs in several rows"),  # type: ignore
        (_loop(links={"cross": {"frame": "a"}}), "links.cross.frame", "'a' is not a joint of the link 'cross'"),
        (_loop(links={"other": {"mass": 1}}), "links.other", "no joint connects the link 'other'"),
        (_loop(links={"cross": {"mass": 1, "inertia": 3}}), "links.cross.inertia", "{xx: …"),
        (_loop(links={"cross": {"mass": 1, "centre": [0, 0]}}), "links.cross.centre", "has 2 coordinates"),
        (_loop(links={"cross": {"inertia": {"xx": 1, "yy": 1, "zz": 3}}}), "links.cross.inertia", "exceeds the sum"),
        (_loop(links={"cross": {"inertia": {"xx": 1, "yy": 1, "zz": 1, "xy": 2}}}), "links.cross.inertia", "no body"),
        (_loop(loop=[{**LOOP["loop"][0], "rotation": 1}, *LOOP["loop"][1:]]), "loop.a.rotation", "is free"),  # type: ignore
        (_loop(loop=[{**LOOP["loop"][0], "twist": "3 mm"}, *LOOP["loop"][1:]]), "loop.a.twist", "a length"),  # type: ignore
        (_loop(loop=3), "loop", "not a list"),
        (_loop(loop=[3]), "loop.0", "not a group"),
        (_loop(gravity=[0, 0]), "gravity", "has 2 coordinates, a spatial model needs 3"),
    ],
)
def test_mistakes_in_a_loop(data: dict[str, object], where: str, what: str) -> None:
    with pytest.raises(MechanismError) as error:
        Mechanism(**data)
    assert any(one.where == where and what in one.what for one in error.value.findings), error.value


def test_a_loop_without_mistakes() -> None:
    assert Mechanism(**LOOP).fixed_link == "ground"
    assert Mechanism(**LOOP).effective_joints["a"].links == ("ground", "shaft")
