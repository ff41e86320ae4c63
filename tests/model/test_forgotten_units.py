"""A forgotten unit is told with its figure, and plain SI numbers are left alone."""

import re
from pathlib import Path

import pytest

from trunnion import read, sweep
from trunnion.errors import Severity

LINKAGE = """\
trunnion: 1
space: planar
dimensions: {AD: 100 mm, AB: 30 mm, BC: 90 mm, CD: 70 mm}
links:
  ground:  {points: {A: [0, 0], D: [AD, 0]}}
  crank:   {points: {A: [0, 0], B: [AB, 0]}}
  coupler: {points: {B: [0, 0], C: [BC, 0]}}
  rocker:  {points: {D: [0, 0], C: [CD, 0]}}
joints:
  A: {type: revolute, links: [ground, crank]}
  B: {type: revolute, links: [crank, coupler]}
  C: {type: revolute, links: [coupler, rocker]}
  D: {type: revolute, links: [ground, rocker]}
joint_defaults: {pin: {radius: 6 mm}, friction: 0.1}
drivers: {A: {speed: 60 rpm}}
"""
CLAMP = """\
trunnion: 1
space: planar
gravity: [0, 0]
dimensions: {AB: 30 mm, BC: 90 mm, n: 2, pinch: 1 mm}
links:
  ground:  {points: {A: [0, 0], S: {at: [0, 0], axis: [1, 0]}, W: [n * BC, 0]}}
  crank:   {points: {A: [0, 0], B: [AB, 0]}}
  coupler: {points: {B: [0, 0], C: [BC, 0]}}
  ram:     {points: {C: [0, 0], S: {at: [0, 0], axis: [1, 0]}}}
joints:
  A: {type: revolute, links: [ground, crank]}
  B: {type: revolute, links: [crank, coupler]}
  C: {type: revolute, links: [coupler, ram]}
  S: {type: prismatic, links: [ground, ram], friction: 0}
joint_defaults: {pin: {radius: 6 mm}, friction: 0.1}
drivers: {S: {range: [70 mm, 90 mm], speed: 20 mm/s}}
loads: {F: {link: ram, at: C, force: [-5 N, 0]}}
springs: {work: {between: [ground.W, ram.C], stiffness: 8 N/mm, free_length: 80 mm + pinch, only: push}}
assembly: {B: [0.02, 0.02]}
"""
BOUGHT = (
    CLAMP.replace("radius: 6 mm", "radius: 6 mm, clearance: 0.02 mm")
    + """tolerances: {AB: ±0.05 mm}
costs:
  AB: {model: power, B: 1, k: 1, unit: mm, least: 1e-5}
  B.clearance: {options: {g6: {tolerance: 28 um, cost: 40}, f7: {tolerance: 0.000053, cost: 25}}}
measures: {end: {point: ram.C, axis: x, as: maximum, limit: 1e-4, at_least: 0.05}}
"""
)
SHAFT = Path("examples/double-cardan.yaml").read_text(encoding="utf-8")
SI = re.sub(r"(\d+) (mm|rpm)", r"\1", LINKAGE)


def put(text, old, new):
    """A text with something else in place of what it has once."""
    assert text.count(old) == 1
    return text.replace(old, new)


def shaft(axis, dimensions="", more=""):
    """The double Cardan shaft with the axis of the second fork of its middle shaft, and more dimensions."""
    turned = put(SHAFT, "C: {at: [0, 0, m], axis: [1, 0, 0]}", f"C: {{at: [0, 0, m], axis: {axis}}}")
    return turned.replace("dimensions:\n", f"dimensions:\n{dimensions}") + more


TURNED = "[cos(phase), sin(phase), 0]"
LIFT = "loads: {F: {link: coupler, at: B, force: [0, 'between(drive, 20 deg, 90) * 10 N']}}\n"
AXIS = "links.middle.points.C.axis"
# a text, where doubts about units stand in it, and what is said of the first
DOUBTS = [
    (put(LINKAGE, "BC: 90 mm", "BC: 90"), ["dimensions.BC"], "900 times the largest length with a unit, 0.1 m"),
    (put(LINKAGE, "C: [BC, 0]", "C: [90, 0]"), ["links.coupler.points.C.x"], "900 times"),
    (put(LINKAGE, "100 mm, AB: 30 mm, BC: 90 mm, CD: 70 mm", "10, AB: 3, BC: 9, CD: 7"), [], ""),  # all of them plain
    (put(LINKAGE, "AB: 30 mm, BC: 90 mm, CD: 70 mm", "AB: 30, BC: 90, CD: 70"), ["dimensions.BC"], "as are 2 others"),
    (put(LINKAGE, "radius: 6 mm", "radius: 6"), ["joint_defaults.pin.radius"], "60 times"),
    (put(LINKAGE, "radius: 6 mm", "radius: 60 mm"), [], ""),  # an eccentric
    (put(LINKAGE, "60 rpm", "60 rpm, range: [10, 90]"), ["drivers.A.range.from", "drivers.A.range.to"], "10 rad"),
    (put(put(LINKAGE, "70 mm}", "70 mm, s: 3}"), "60 rpm", "60 rpm, start: 10 deg - s"), ["dimensions.s"], "3 rad"),
    (LINKAGE + LIFT, ["loads.F.force.y"], "90 rad"),
    (put(SI, "speed: 60", "speed: 60, start: 3"), [], ""),
    (put(SI, "speed: 60", "speed: 60, start: 30"), ["drivers.A.start"], "4.77 turns"),
    (CLAMP, [], ""),  # a plain factor and a plain hint
    (put(CLAMP, "pinch: 1 mm", "pinch: 1"), ["dimensions.pinch"], "6 times the largest length"),
    (BOUGHT, [], ""),
    (put(BOUGHT, "28 um", "28"), ["costs.B.clearance.options.g6.tolerance"], "156 times the largest length"),
    (put(BOUGHT, "limit: 1e-4", "limit: 0.2"), ["measures.end.limit"], "1.11 times"),
    (shaft(TURNED, "  phase: 3\n"), ["dimensions.phase"], "is 3 rad, which is 172°"),
    (shaft("[cos(3), sin(2 deg + 1), 0]"), [f"{AXIS}.x", f"{AXIS}.y"], "takes"),
    (shaft(TURNED, "  phase: 3 deg\n", "tolerances: {phase: 1}"), ["tolerances.phase"], "1 rad"),
    (shaft(TURNED, "  phase: 3 deg\n"), [], ""),
    (shaft("[cos(k * pi / 4), sin(k * 45 deg), 0]", "  k: 3\n"), [], ""),
    (put(SHAFT, "D: 0 deg", "D: 1"), ["assembly.D"], "is 1 rad"),
]


@pytest.mark.parametrize(("text", "places", "figure"), DOUBTS)
def test_a_number_without_a_unit(tmp_path, text, places, figure):
    (tmp_path / "model.yaml").write_text(text, encoding="utf-8")
    doubts = [one for one in read(tmp_path / "model.yaml").checked if "radians" in one.what or "forgotten" in one.what]
    assert [one.where for one in doubts] == places
    assert figure in "".join(one.what for one in doubts[:1])
    assert {one.severity for one in doubts} <= {Severity.WARNING}


def test_plain_numbers_throughout_and_examples_are_left_alone(tmp_path):
    plain = CLAMP.replace("80 mm + pinch", "80 * pinch").replace("8 N/mm", "8000").replace("5 N", "5")
    plain = re.sub(r"(\d+) mm(/s)?", lambda found: str(int(found[1]) / 1000), plain)
    (tmp_path / "clamp.yaml").write_text(plain.replace("radius: 0.006", "radius: 6 mm"), encoding="utf-8")
    told = [*read(tmp_path / "clamp.yaml").checked]
    for example in Path("examples").glob("*.yaml"):
        told += [one for one in read(example).checked if "plain number where" in one.what or "forgotten" in one.what]
    assert told == []


@pytest.mark.spread(1)
@pytest.mark.parametrize(("stated", "values"), [("10 deg", (-10, 0, 3)), ("0 deg", [10, 3])])
def test_plain_angles_of_a_sweep_are_told_once(tmp_path, stated, values):
    (tmp_path / "shaft.yaml").write_text(shaft(TURNED, f"  phase: {stated}\n"), encoding="utf-8")
    found = sweep(read(tmp_path / "shaft.yaml"), {"phase": values}, 4).trunnion.findings
    (told,) = (one for one in found if one.where == "dimensions.phase")
    assert told.severity is Severity.WARNING
    assert "10 " in told.what
    assert "the largest of" in told.what


def test_a_default_that_no_joint_follows_is_told(tmp_path):
    """A fit is the pin's own clearance."""
    fitted = re.sub(r"(revolute, links: \[.*?\])", r"\1, pin: {fit: 12 mm H7/f7}", CLAMP)
    fitted = fitted.replace("pin: {radius: 6 mm}", "pin: {clearance: 0 mm}")
    assert fitted.count("fit:") == 3
    one_left = fitted.replace("pin: {fit: 12 mm H7/f7}", "pin: {radius: 6 mm}", 1)
    for text, told in ((fitted, ["joint_defaults.pin.clearance"]), (one_left, [])):
        (tmp_path / "clamp.yaml").write_text(text, encoding="utf-8")
        assert [one.where for one in read(tmp_path / "clamp.yaml").checked] == told
