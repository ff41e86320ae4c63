"""Every way to state a model wrongly is a finding that says what, where and in which line, with a remedy."""

import copy
import math
from collections.abc import Callable

import pytest
from model_samples import EXAMPLES, FOURBAR, RSSP, VARIED
from ruamel.yaml import YAML

from trunnion.errors import Finding, MechanismError, Severity
from trunnion.model.checks.check import check_model
from trunnion.model.file import placed
from trunnion.model.joint_parts import Joint
from trunnion.model.mechanism import Mechanism, read_mechanism
from trunnion.model.names import as_key
from trunnion.model.rules import NotZero, Within

FindingsOf = Callable[..., tuple[Finding, ...]]

# in which text what is replaced: by what, where the finding stands, what it says, how many lines further down
MISTAKES = {
    FOURBAR: {
        "mass: 4.8 kg": [
            ("mas: 4.8 kg", "links.crank.mas", "the key 'mas' is unknown"),
            ("centre: 3", "links.crank.centre", "takes [x, y] or {distance"),
            ("mass: true", "links.crank.mass", "a yes/no value"),
            ("mass: '4.8'", "links.crank.mass", "'4.8' has no unit where a mass"),
            ("mass: AB", "links.crank.mass", "'AB' is a length where a mass"),
            ("mass: .nan", "links.crank.mass", "nan is not a finite number"),
            ("mass: 1 kg * (AB / (AB - AB))", "links.crank.mass", "no finite value (inf)"),
            ("mass: 1 kg\n    centre: [1, 0]\n    inertia: 0.5\n    inertia_about: origin",
             "links.crank.inertia", "less than m r² = 1", 2),
            ("inertia: {xx: 1, yy: 1, zz: 1}", "links.crank.inertia", "planar link is one number"),
            ("frame: A", "links.crank.frame", "for the links of a loop")],
        "{speed: 10 rad/s}": [
            ("{}", "drivers.A", "'speed' is missing"), ("10 rad/s", "drivers.A", "not a group of entries"),
            ("", "drivers.A", "is empty"), ("{speed: 10,5 rad/s}", "drivers.A.5 rad/s", "has no value")],
        "[ground, crank]": [
            ("ground", "joints.A.links", "not a list"),
            ("[ground, 3]", "joints.A.links.1", "not a text"),
            ("[ground, cranc]", "joints.A.links", "there is no link 'cranc'"),
            ("[crank, crank]", "joints.A.links", "names the link 'crank' twice")],
        "B: [AB, 0]": [
            ("B: [AB]", "links.crank.points.B", "has 1 entries, at least 2"),
            ("B: [AB, 0, 0]", "links.crank.points.B", "has 3 coordinates"),
            ("'=B': [AB, 0]", "links.crank.points.=B", "begins with '=', which makes a formula"),
            ("Bx: [AB, 0]", "joints.B", "the link 'crank' has no point 'B'", 9)],
        "space: planar": [("ground: base", "ground", "there is no link 'base'")],
        "trunnion: 1": [
            ("trunnion: 2", "trunnion", "version 2, this program reads 1"),
            ("trunnion: 1\nreferences: [A book, 3]", "references.1", "is not a text", 1)],
        "trunnion: 1\n": [("", "trunnion", "version of the file is missing")],
        "  A: {type": [("  +A: {type", "joints.+A", "begins with '+'")],
        "AB: 2 m": [
            ("-AB: 2 m", "dimensions.-AB", "begins with '-'"),
            ("AB: 2 m + BC", "dimensions.AB", "'BC', which is not one"),
            ("AB: 2 m\n  a-b: 2 m", "dimensions.a-b", "cannot be used in an expression", 1),
            ("AB: 2 m\n  sin: 2 m", "dimensions.sin", "reserved name of expressions", 1),
            ("AB: ±2 mm", "dimensions.AB", "a tolerance without a value")],
        "[AB, 0]": [("[ABC, 0]", "links.crank.points.B.x", "'ABC' is not one of the dim")],
        "AB: 2 m\n  AD: 5.5 m": [("AB: AD\n  AD: AB", "dimensions.A", "is defined by itself: A")],
        "10 rad/s": [
            ("10 m/s", "drivers.A.speed", "a speed where an angular speed is needed"),
            ("10 Hz", "drivers.A.speed", "'Hz' may count turns"),
            ("10 rad/s, start: 3 deg ± 1 deg", "drivers.A.start", "does not vary"),
            ("10 rad/s, motor: {kind: induction, breakdown_effort: 9, power: 5 kW}",
             "drivers.A.motor.power", "the key 'power' is unknown")],
        "C: [7.6, 2.1]": [
            ("C: 30 mm", "assembly.C", "a length where an angle"),
            ("crank.K: [7.6, 2.1]", "assembly.crank.K", "no point 'crank.K'"),
            ("ground: way-1", "assembly.ground", "of a moving link, and 'ground' is none"),
            ("coupler: way-x", "assembly.coupler", "'way-x' is not the name of an"),
            ("coupler: Way 2", "assembly.coupler", "'Way 2' is not the name of an")],
        "  crank:\n": [
            ("  cr.ank:\n", "links.cr.ank", "has a dot"), ('  "cr\\u0007ank":\n', "links", "control characters"),
            ('  "":\n', "links", "empty")],
        "A: {speed": [("E: {speed", "drivers.E", "there is no joint 'E'")],
        "{link: coupler, at": [("{link: couplr, at", "loads.work.link", "no link 'couplr'")],
        "at: C": [("at: E", "loads.work.at", "has no point 'E'")],
        "point: coupler.C": [("point: coupler.Q", "measures.tip.point", "no point 'coupler.Q'")],
        "{point: coupler.C, axis: x}": [
            ("{effort: B}", "measures.tip.effort", "no driver 'B'"), ("{}", "measures.tip", "states nothing"),
            ("{point: coupler.C}", "measures.tip", "along an axis")],
        "axis: x": [("axis: z", "measures.tip.axis", "no z in the plane")],
        "type: revolute, links: [ground, crank]": [
            ("type: spherical, links: [ground, crank]", "joints.A", "a spherical joint does not exist in the plane")],
        "  rocker:\n": [("  idle: {}\n  rocker:\n", "links.idle", "no joint connects the link 'idle'")],
        "type: revolute, links: [ground, rocker]": [
            ("type: prismatic, links: [ground, rocker]", "links.ground.points.D", "has no axis, a prismatic", -13)],
        "D: [AD, 0]": [("D: {at: [AD, 0], axis: [0, 0]}", "links.ground.points.D.axis", "no direction")],
        ", force: [0, -1 kN]": [("", "loads.work", "states nothing")],
        "link: coupler, at: C": [("at: coupler.C", "loads.work", "states nothing")],
        "radius: 7.5 mm": [("diameter: 15 mm", "joint_defaults.pin.diameter", "unknown")],
        "link: coupler, at: C, ": [("", "loads.work", "states nothing")],
        "at: C, ": [("", "loads.work.force", "no effect without at")],
        "force: [0, -1 kN]": [
            ("moment: [0, 0, 1 N m]", "loads.work.moment", "one number"),
            ("resisting_torque: 1 N m", "loads.work.resisting_torque", "beside link")],
        "link: coupler, at: C, force: [0, -1 kN]": [
            ("joint: A, resisting_force: 1 N",
             "loads.work.resisting_force", "a revolute joint has no slide to resist"),
            ("joint: A, at: C, force: [0, 1]", "loads.work.at", "beside joint")],
        "{radius: 7.5 mm}": [
            ("{length: 7.5 mm}", "joints.A", "friction without the radius of the pin", -5),
            ("{radius: 0}", "joint_defaults.pin.radius", "is 0, where friction needs it")],
        "7.5 mm}": [("7.5 mm, clearance: 8 mm}", "joint_defaults.pin.clearance", "not less than the pin radius")],
        "friction: 0.1": [
            ("friction: {coeficient: 0.1}", "joint_defaults.friction.coeficient", "unknown to the"),
            ("friction: {pair_factor: 1}", "friction", "needs 'coefficient'")],
        "links: [ground, crank]}": [
            ("links: [ground, crank], pin: {fit: 20 mm}}", "joints.A.pin.fit", "'20 mm' is not a fit"),
            ("links: [ground, crank], pin: {fit: H7/g6}}", "joints.A.pin.fit", "'H7/g6' is not a fit"),
            ("links: [ground, crank], pin: {fit: 20H7/g6}}", "joints.A.pin.fit", "'20' has no unit"),
            ("links: [ground, crank], pin: {fit: 20 mm H7/g6, radius: 1}}",
             "joints.A.pin.fit", "beside radius")],
    },
    VARIED: {
        "model: power, B: 1, k: 0.45": [
            ("B: 1, k: 0.45", "costs.AB", "states nothing"),
            ("model: power, process: boring, B: 1, k: 1", "costs.AB", "model and process"),
        ],
        "k: 0.45, unit: mm": [
            ("k: 0.45", "costs.AB", "states no unit"),
            ("k: 0.45, unit: kg", "costs.AB.unit", "'kg' is the unit of a mass")],
        "least: 5 um": [
            ("least: 1 mm", "costs.AB.least", "above the most")],
        "  AB: {model": [("  t: {model", "costs.t", "'dimensions.t' has no tolerance")],
        "  A.clearance: {model": [
            ("  D.clearance: {model", "costs.D.clearance", "states no clearance"),
            ("  C.clearance: {model", "costs.C.clearance", "states no clearance"),
            ("  B.pin.clearance: {model", "costs.B.pin", "has no tolerance"),
            ("  dimensions.AB: {model", "costs.dimensions.AB", "are the same")],
        "model: power, B: 1, k: 1, unit: m": [("process: boring", "costs.A.clearance.process", "a play has no IT")],
        "{process: boring}": [
            ("{process: boring, B: 1}", "costs.CD.B", "beside process"),
            ("{process: boring, group: bores}", "costs.AB.group", "has formulas and choices", -2)],
        "{process: boring}\n  AD: {": [
            ("{process: boring, group: g}\n  AD: {group: g, ",
             "costs.CD.group", "'g' (CD, AD) has no choice in common")],
        "k: 30, unit: mm": [
            ("k: 30, unit: mm, least: 1 mm",
             "costs.AB.group", "bounds of the group 'bores' (AB, BC) exclude one another", -1)],
        "IT7: 9": [("IT17: 9", "processes.boring", "'IT17' is no IT grade")],
        "CD: 70 mm ±": [("CD: 700 mm ±", "costs.CD.process", "the size 700 mm is not in the tables", 32)],
        "  AB: ±t": [
            ("  XY: ±t", "tolerances.XY", "no number named 'XY'"),
            ("  AB: -0.1 mm", "tolerances.AB", "a sign on one side only"),
            ("  AB: ±(t - 1 mm)", "tolerances.AB", "is above the upper one"),
            ("  AB: {limits: ±t, distribution: gaussian}", "tolerances.AB", "'gaussian' is not a distr"),
            ("  AB: {limits: ±t, mode: 1 um}", "tolerances.AB.mode", "no effect on the distribution"),
            ("  AB: {limits: ±t, cpk: 1.3}", "tolerances.AB.cpk", "cpk 1.3 is above cp 1.2"),
            ("  AB: {distribution: uniform}", "tolerances.AB", "limits of 'dimensions.AB' are missing"),
            ("  AB: {limits: ±t, direction: uniform}", "tolerances.AB.direction", "no direction"),
            ("  AB: {distribution: sample}", "tolerances.AB", "deviations are missing"),
            ("  AB: ±t\n  dimensions.AB: ±t", "tolerances.dimensions.AB", "are the same number", 1),
            ("  AB: ±t\n  C.x: ±t", "tolerances.C.x", "stands for", 1),
            ("  AB: ±t\n  assembly.C.x: ±t", "tolerances.assembly.C.x", "is not a parameter", 1),
            ("  AB: ±t\n  joint_defaults.pin.clearance: 1 um", "clearance", "no number named", 1),
            ("  AB: ±5 %", "tolerances.AB", "a number where a length is needed")],
        "  B.seat.xi:": [("  A.pin.radius:", "tolerances.A.pin.radius", "is no angle")],
        "{distribution: direction}": [
            ("{limits: ±1 deg, distribution: direction}", "tolerances.B.seat.xi", "the whole turn has no limits")],
        "+0.02/0 mm": [("±0.02 mm", "tolerances.B.misalignment.offset", "a size is not negative")],
        "mode: 0.005": [("mode: 0.05", "tolerances.joint_defaults.friction.coefficient.mode", "outside")],
        "  A.friction.coefficient: ±0.03": [
            ("  A.friction.coefficient: ±10 %", "tolerances.A.friction.coefficient", "'±10 %' are in percent")],
        "friction: 0.2}": [("friction: 0.2 ± 10 %}", "joint_defaults.friction", "in percent, the value is not")],
        "BC: 90 mm ± 0.02 mm": [("BC: 90 mm +2/-1 %", "dimensions.BC", "in percent")],
        "distribution: truncated, cp: 1.2": [
            ("distribution: sample", "tolerance_defaults.distribution", "of one"),
            ("alpha: 1.2", "tolerance_defaults.alpha", "no effect on the"), ("cp: 1, cpk: 2", "cpk", "is above cp")],
        "of: [AB, BC], coefficient: 0.5": [
            ("of: [AB, t], coefficient: 0.5", "correlations.0", "no tolerance"),
            ("of: [AB], coefficient: 0.5", "correlations.0", "two parameters"),
            ("of: [AB, AB], coefficient: 0.5", "correlations.0", "twice")],
        "coefficient: 0.5}": [
            ("coefficient: 0.5}\n  - {of: [BC, AB], coefficient: 0.4}", "correlations.1", "entry 1", 1)],
        "{angle: rocker, limit: ±0.1 deg}": [
            ("{angle: rocker, rotation: D}", "measures.error", "angle and rotation"),
            ("{path_error: rocker.X}", "error.path_error", "no point 'rocker.X'"),
            ("{stroke: D, axis: x}", "measures.error.axis", "axis of a coord"),
            ("{stroke: D, at: 1 deg}", "measures.error.at", "one number of a range"),
            ("{stroke: D, as: rms}", "measures.error.as", "one number of a range"),
            ("{efficiency: cycle, over: [0 deg, 9 deg]}", "error.over", "all of it"),
            ("{angle: rocker, as: value}", "measures.error.as", "a position"),
            ("{angle: rocker, limit: ±(AB - BC)/AB}", "error.limit", "above the"),
            ("{angle: rocker, at_least: 2, at_most: 1}", "at_least", "at least 2"),
            ("{locking_margin: mechanism, at_least: 12}", "at_least", "up to 10")],
        "{angle: rocker, at: 60 deg,": [
            ("{angle: rocker, at: 60 deg, over: [0, 1],", "theta.over", "beside at"),
            ("{angle: rocker, at: 60 deg, as: rms,", "theta.as", "of a range")],
        "over: [0 deg, 180 deg]": [("over: [0 deg, 1 s]", "swing.over", "from angle to time")],
    },
    RSSP: {
        "bearing: 40 mm": [("bearing: 0", "joints.A.pin.bearing", "is 0, where friction needs it")],
        "width: 40 mm": [("width: 0", "joint_defaults.guide.width", "is 0, where friction needs it")],
        "A: {at: [0, 0, 0], axis: [0, 0, 1]}, B": [
            ("A: [0, 0, 0], B", "links.crank.points.A", "has no axis, a revolute joint needs one"),
            ("A: {at: [0, 0, 0], axis: [0, 0, 0]}, B", "links.crank.points.A.axis", "no direction")],
        "B: [30 mm, 0, 0]": [
            ("E: [30 mm, 0, 0]", "joints.B", "has no point 'B'", 11),
            ("B: {at: [30 mm, 0, 0], x: [0, 0, 3]}", "links.crank.points.B.x", "lies along the axis [0, 0, 1]")],
        "axis: [1, 0, 0], x: [0, 0, 1]}}\n  crank": [
            ("axis: [1, 0, 0], x: [-2, 0, 0]}}\n  crank", "links.ground.points.D.x", "lies along the axis")],
        "type: revolute": [
            ("type: helical", "joints.A", "a helical joint without a pitch"),
            ("type: revolute, pitch: 3 mm", "joints.A.pitch", "has no pitch")],
        "  A: {speed: 10 rad/s}": [("  B: {speed: 10 rad/s}", "drivers.B", "is spherical: it has 3 freedoms")],
        ", pin: {bearing: 40 mm}": [("", "joints.A", "without the length of the bearing")],
        "type: revolute, links: [ground, crank], pin: {bearing: 40 mm}": [
            ("type: universal, links: [ground, crank]", "joints.A", "without the length of the bearing"),
            ("type: planar, links: [ground, crank]",
             "joints.A.friction", "has no contact whose friction is modelled"),
            ("type: fixed, links: [ground, crank], friction: 0.1", "joints.A.friction", "a fixed joint in")],
        "  pin: {radius: 6 mm}\n": [("", "joints.B", "without the radius of the ball", -4)],
        "length: 50 mm, ": [("", "joints.D", "without the length of the guide", -3)],
        "type: revolute, links": [("type: planar, friction: 0, links", "joints.A.pin", "joint in space has no pin")],
        "type: spherical, links: [rod": [
            ("type: spherical, pin: {offset: 1 mm}, links: [rod",
             "joints.C.pin.offset", "has no axis to offset")],
        "{joint: D, resisting_force: 100 N}": [
            ("{joint: D, resisting_torque: 1 N m}", "loads.work.resisting_torque", "has no rotation to resist"),
            ("{joint: B, resisting_torque: 1 N m}",
             "loads.work.resisting_torque", "a spherical joint has no one axis"),
            ("{link: slider, moment: 3}", "loads.work.moment", "is [x, y, z]")],
        "between: [ground.D, slider.C], stiffness: 2 N/mm, free_length: 60 mm": [
            ("joint: C, damping: 1 N m s/rad",
             "springs.back.joint", "a spherical joint has no one axis for a spring")],
        "C: [100 mm, 60 mm, 20 mm]": [
            ("C: 30 deg", "assembly.C", "one number does not state how far a spherical joint"),
            ("rod.C: 30 deg", "assembly.rod.C", "not an angle")],
        "{point: rod.C, axis: z}": [("{angle: rod}", "measures.height.angle", "not turned by one angle")],
        "inertia: {xx: 1.0e-6, yy: 9.6e-4, zz: 9.6e-4}": [
            ("inertia: 9.6e-4", "links.rod.inertia", "of a spatial link is {xx")],
        "yy: 9.6e-4, zz": [("yy: 1.9e-3, zz", "links.rod.inertia", "no body has the principal moments")],
        "inertia_about: origin": [
            ("centre: [60 mm, 0, 30 mm]\n    inertia_about: origin",
             "links.rod.inertia", "no body has the princ", -1)],
        "mass: 0.4 kg": [("centre: {distance: 15 mm, angle: 0}", "links.crank.centre", "in the plane only")],
        "drivers:": [("gears:\n  mesh: {joints: [A, D], ratio: 2}\ndrivers:", "gears.mesh", "planar", 1)],
    },
}  # fmt: skip
CASES = [(text, old, *case) for text, group in MISTAKES.items() for old, cases in group.items() for case in cases]


@pytest.mark.parametrize("case", CASES)
def test_one_mistake_is_found_where_it_is(findings_of, case):
    text, old, new, where, what, *below = case
    found = findings_of(text.replace(old, new))
    fitting = [finding for finding in found if where in finding.where and what in finding.what]
    assert fitting, "\n".join(map(str, found))
    assert fitting[0].line == text[: text.index(old)].count("\n") + 1 + sum(below)
    assert all(finding.where and finding.line for finding in found)


def test_a_number_outside_its_limits_is_found_where_it_stands(tmp_path):
    """Every number whose field declares limits, of the samples and examples, just beyond each of them."""
    for name, text in (("four-bar", FOURBAR), ("varied", VARIED), ("rssp", RSSP)):
        (tmp_path / f"{name}.yaml").write_text(text, encoding="utf-8")
    tried = set()
    for path in [*EXAMPLES, *sorted(tmp_path.glob("*.yaml"))]:
        mechanism = read_mechanism(path)
        for entry in [*mechanism.entries, *mechanism.further_entries]:
            section, key = entry.path.partition(".")[0], entry.location[-1]
            rules = [rule for rule in entry.rules if isinstance(rule, Within | NotZero)]
            if not rules or entry.varies or entry.alias or section == "correlations" or (section, key) in tried:
                continue
            tried.add((section, key))
            for rule in rules:
                low, high = (rule.low, rule.high) if isinstance(rule, Within) else (0.0, math.inf)
                closed = isinstance(rule, Within) and rule.ends[0] == "["
                for value in [low - 0.1 * closed] * math.isfinite(low) + [high + 0.1] * math.isfinite(high):
                    with pytest.raises(MechanismError) as error:
                        mechanism.with_values({entry.path: value})
                    assert entry.where in [finding.where for finding in error.value.findings], (entry.path, value)
    assert len(tried) > 40


SPRING = "springs: {s: {between: [ground.A, coupler.C], stifness: 10.0, only: push, free_length: 9.0}}\nmeasures:"
PLANE = """\
trunnion: 1
links: {ground: {points: {A: [0, 0]}}, arm: {points: {A: [0, 0], B: [1, 0]}}}
joints: {A: {type: revolute, links: [ground, arm]}}
drivers: {A: {speed: 1}}
"""
MOTION = "loads: {w: {joint: D, resisting_torque: 1 N m * cos(drive)}}\nmeasures:"
EXACTLY = [
    # all of a stage at once, in the order of the file: keys and units, then names, then numbers
    (FOURBAR, [("AB: 2 m", "AB: 2 furlongz"), ("mass: 4.8 kg", "mas: 4.8 kg"), ("inertia: 2 kg m^2", "inertia: 2 kg"),
               ("links: [ground, rocker]", "links: [ground, roker]"), ("axis: x", "axis: w")],
     ["dimensions.AB", "links.crank.mas", "links.coupler.inertia", "measures.tip.axis"]),
    (FOURBAR, [("links: [ground, rocker]", "links: [ground, roker]"), ("{speed: 10 rad/s}", "{start: 0}"),
               ("link: coupler, at", "link: couple, at"), ("mass: 4.8 kg", "mass: -1")],
     ["joints.D.links", "drivers.A", "loads.work.link"]),
    # what follows from a mistake is not told beside it
    (FOURBAR, [("links: [crank, coupler]", "link: [crank, coupler]")], ["joints.B", "joints.B.link"]),
    (FOURBAR, [("radius: 7.5 mm", "diameter: 15 mm")], ["joint_defaults.pin.diameter"]),
    (FOURBAR, [("friction: 0.1", "friction: off")], ["joint_defaults.friction.coefficient"]),
    (FOURBAR, [("measures:", SPRING)], ["springs.s.stifness"]),
    # and hides nothing else
    (FOURBAR, [("mass: 4.8 kg", "mass: -1\n    centre: [1, 0]"), ("friction: 0.1", "friction: -1")],
     ["links.crank.mass", "joint_defaults.friction.coefficient"]),
    (PLANE + "loads: {w: {link: arms, at: B, force: [0, 1, 2]}}\n"
     "springs: {S: {between: [ground.A, arm.C], damping: 1}}",
     [("speed: 1", "speed: 1, dwell: 1")],
     ["drivers.A.dwell", "loads.w.link", "loads.w.force", "springs.S.between"]),
    (VARIED, [("measures:", MOTION), ("  AB: ±t", "  AB: ±t\n  w.resisting_torque: ±1 N m")],
     ["tolerances.w.resisting_torque"]),
    (RSSP, [("space: spatial\n", "")], ["space"]),
]  # fmt: skip


@pytest.mark.parametrize(("text", "changes", "places"), EXACTLY)
def test_exactly_these_findings(findings_of, text, changes, places):
    for old, new in changes:
        assert text.count(old) == 1
        text = text.replace(old, new)
    found = findings_of(text)
    lines = [finding.line for finding in found]
    assert lines == sorted(lines, key=lambda line: line or 0)
    assert sorted(finding.where for finding in found) == sorted(places), "\n".join(map(str, found))


def test_python_raises_the_same_findings_without_lines():
    data = {"links": {"ground": {"points": {"A": [0, 0]}, "mas": 1}},
            "joints": {"A": Joint(type="revolute", links=("ground", "crank"))}}  # fmt: skip
    with pytest.raises(MechanismError) as error:
        Mechanism(**data)
    found = error.value.findings
    assert {("links.ground.mas", "the key 'mas' is unknown")} <= {(one.where, one.what) for one in found}
    assert all(finding.line is None and not finding.file for finding in found)


def warned(text, tmp_path):
    """Where the doubts about a text stand, and their severity."""
    (tmp_path / "model.yaml").write_text(text, encoding="utf-8")
    return {finding.where: finding.severity for finding in check_model(read_mechanism(tmp_path / "model.yaml"))}


def test_doubts_are_kept_apart_from_errors(tmp_path):
    text = FOURBAR.replace("AB: 2 m", "AB: 2 m\n  unused: 3")
    found = warned(text, tmp_path)
    assert found["dimensions.unused"] is Severity.NOTE
    text = VARIED.replace("t: 0.05 mm}", "t: 0.05 mm, idle: 1 mm}")
    found = warned(text.replace("  AB: ±t", "  AB: ±t\n  idle: ±t"), tmp_path)
    assert found["dimensions.idle"] is Severity.NOTE
    assert found["tolerances.BC"] is Severity.NOTE  # overrides what stands with the number
    assert not warned(RSSP, tmp_path)
    assert warned(RSSP.replace(", width: 40 mm", ""), tmp_path) == {
        "joints.D": Severity.NOTE
    }  # torsion about the slide


@pytest.mark.parametrize(
    ("moments", "severity"),
    [
        ("xx: 27.6, yy: 34.5, zz: 6.91", None),
        ("xx: 27.6, yy: 34.8, zz: 6.91", Severity.WARNING),  # a plate, of three digits
        ("xx: 27.6, yy: 34.9, zz: 6.91", Severity.ERROR),
        ("xx: 1e-6, yy: 1e-6, zz: -1e-8", Severity.ERROR),
    ],
)
def test_moments_of_inertia_that_were_rounded(tmp_path, moments, severity):
    text = RSSP.replace("xx: 1.0e-6, yy: 9.6e-4, zz: 9.6e-4", moments)
    try:
        found = warned(text, tmp_path)
    except MechanismError as error:
        found = {finding.where: finding.severity for finding in error.findings}
    assert found.get("links.rod.inertia") == severity


@pytest.mark.parametrize("name", ["pin 1", "left: pin", "a, b", "#1", "[x]", "{x}", "no", "12", "it's", '"big"', "& γ"])
def test_a_name_that_advice_puts_into_a_file_is_a_key_of_it(name):
    load = YAML(typ="safe", pure=True).load
    assert list(load(f"{{{as_key(name)}: 1}}")) == list(load(f"{as_key(name)}: 1")) == [name]


# loops
LOOP = {
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


def changed(*path, to):
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


INERTIA = ("links", "cross", "inertia")


@pytest.mark.parametrize(
    ("data", "where", "what"),
    [
        (changed("space", to="planar"), "loop", "a loop is spatial"),
        (changed("joints", to={"d": {"type": "revolute", "links": ["shaft", "cross"]}}), "joints", "both given"),
        (changed("loop", to=[*LOOP["loop"], LOOP["loop"][0]]), "loop", "the joint or link 'a' occurs in several rows"),
        (changed("loop", to=LOOP["loop"][-1:]), "joints.d.links", "names the link 'ground' twice"),
        (changed("loop", to=[3]), "loop.0", "not a group"),
        (changed("loop", 1, "type", to="spherical"), "loop.b.type", "no place in the table of a loop"),
        (changed("loop", 1, "slide", to=1), "loop.b.slide", "is free, not constant"),
        (changed("loop", 3, "rotation", to=1), "loop.d.rotation", "is free, not constant"),
        (changed("loop", 3, "pitch", to=None), "joints.d", "without a pitch"),
        (changed("loop", 0, "pitch", to=1), "joints.a.pitch", "has no pitch"),
        (changed(*INERTIA, to=3), "links.cross.inertia", "{xx: …"),
        (changed(*INERTIA, to={"xx": 1, "yy": 1, "zz": 3}), "links.cross.inertia", "exceeds the sum"),
        (changed("links", "cross", "frame", to="d"), "links.cross.frame", "'d' is not a joint of the link 'cross'"),
        (changed("links", "cross", "centre", to=[0, 0]), "links.cross.centre", "has 2 coordinates"),
        (changed("links", "cross", "points", "b", to=[0, 0, 0]), "links.cross.points.b", "cannot be placed again"),
        ({**changed("links", "wall", to={}), "ground": "wall"}, "ground", "'wall' is not a link of the loop"),
        (changed("loads", "screw", "resisting_torque", to=1), "loads.screw.resisting_torque", "beside resisting_force"),
        (changed("springs", "pull", "between", to=["cross.tip", "ground.b"]), "springs.pull.between", "'ground.b'"),
        (changed("assembly", "fork.a", to=[0, 0, 0]), "assembly.fork.a", "there is no point 'fork.a'"),
        (changed("joint_defaults", "pin", "bearing", to=None), "joints.a", "without the length of the bearing"),
    ],
)
def test_mistakes_in_a_loop(data, where, what):
    with pytest.raises(MechanismError) as error:
        Mechanism(**data)
    found = [finding for finding in error.value.findings if finding.where == where and what in finding.what]
    assert found, error.value


def test_names_of_a_loop():
    mechanism = Mechanism(**LOOP)
    assert not [finding for finding in check_model(mechanism) if finding.severity is Severity.ERROR]
    assert mechanism.points == {"cross": ("tip", "b", "c"), "shaft": ("a", "b"), "fork": ("c", "d"),
                                "ground": ("a", "d")}  # fmt: skip
    assert list(mechanism.effective_links) == ["cross", "shaft", "fork", "ground"]
    assert mechanism.effective_joints["d"].links == ("fork", "ground")


def test_later_findings_about_a_row_have_its_line(tmp_path):
    path = tmp_path / "loop.yaml"
    Mechanism(**LOOP).write(path)
    line = 1 + next(k for k, text in enumerate(path.read_text("utf-8").splitlines()) if "joint: b" in text)
    for where in ("joints.b", "loop.b.twist"):
        assert placed([Finding("locks", where)], path) == [Finding("locks", where, line=line, file=str(path))]


def test_rows_of_a_loop_are_set_by_name():
    mechanism = Mechanism(**LOOP)
    other = mechanism.with_values({"loop.b.twist": "81 deg", "loop.a.slide": "4 mm", "d.pitch": "-5 mm",
                                   "b.pin.bearing": "40 mm", "c.friction.coefficient": 0.2})  # fmt: skip
    values = other.parameters()
    assert [row.twist.source for row in other.loop] == ["90 deg", "81 deg", "70 deg", "60 deg"]
    assert (values["loop.a.slide"], values["joints.d.pitch"]) == (4e-3, -5e-3)
    assert [values[f"joints.{name}.pin.bearing"] for name in "abd"] == [0.03, 0.04, 0.03]
    assert [values[f"joints.{name}.friction.coefficient"] for name in "abcd"] == [0.1, 0.1, 0.2, 0.1]
    for path, value in mechanism.parameters().items():  # every number can be set
        new = value * 1.001 if value else 1e-6
        assert mechanism.with_values({path: new}).parameters()[path] == new, path


def test_friction_of_a_loop_is_put_off_and_changed():
    mechanism = Mechanism(**changed("loop", 1, "friction", to=0.3))
    assert mechanism.effective_joints["b"].friction.model == "pezzuti"
    assert all(joint.friction is None for joint in mechanism.with_friction("off").effective_joints.values())
    values = mechanism.with_friction("coulomb").parameters()
    assert [values[f"joints.{name}.friction.coefficient"] for name in "abcd"] == [0.1, 0.3, 0.1, 0.1]
    with pytest.raises(MechanismError) as error:
        mechanism.with_friction("brown-mcphee")
    assert {finding.where for finding in error.value.findings} == {"joint_defaults.friction", "joints.b.friction"}


@pytest.mark.parametrize("friction", [0, {"coefficient": 0}])
def test_no_friction_needs_no_size_of_a_bearing(friction):
    loop = changed("joint_defaults", to={"pin": {"radius": 1}, "friction": friction})
    plane = YAML(typ="safe", pure=True).load(FOURBAR.replace("{radius: 7.5 mm}", "{}")) | {}
    plane["joint_defaults"]["friction"] = friction
    for data in (loop, plane):
        assert all(joint.friction is None for joint in Mechanism(**data).effective_joints.values())


def test_a_fixed_joint_is_not_asked_for_friction_by_the_defaults():
    text = RSSP.replace("C: {type: spherical, links: [rod, slider]}", "C: {type: fixed, links: [rod, slider]}")
    joints = Mechanism(**YAML(typ="safe", pure=True).load(text)).effective_joints
    assert joints["A"].friction is not None
    assert (joints["C"].friction, joints["C"].pin) == (None, None)


def test_choices_among_words_are_set_like_numbers():
    four_bar, cardan = (
        Mechanism.read(next(path for path in EXAMPLES if path.stem == name))
        for name in ("fourbar-in-space", "pezzuti-cardan")
    )
    assert four_bar.over_constraint == "refuse"
    assert four_bar.with_values({"over_constraint": "minimum-norm"}).over_constraint == "minimum-norm"
    with pytest.raises(MechanismError, match="'refuse' or 'minimum-norm'"):
        four_bar.with_values({"over_constraint": "some"})

    def models(**values):
        changed = cardan.with_values({key.replace("__", "."): value for key, value in values.items()})
        return [joint.friction.model for joint in changed.effective_joints.values() if joint.friction]

    assert models() == ["two-contact"] * 4
    assert models(joint_defaults__friction__model="pezzuti") == ["pezzuti"] * 4
    assert models(**{"joints.pin-1.friction.model": "pezzuti"}).count("pezzuti") == 1
    with pytest.raises(MechanismError):
        models(**{"joints.pin-9.friction.model": "pezzuti"})
