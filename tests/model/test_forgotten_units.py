"""A forgotten unit is told with its figure, and plain SI numbers are left alone."""

from __future__ import annotations

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


@pytest.mark.parametrize(
    ("old", "new", "where", "figures"),
    [
        ("BC: 90 mm", "BC: 90", "dimensions.BC", "900 times the largest length with a unit, 0.1 m"),
        ("C: [BC, 0]", "C: [90, 0]", "links.coupler.points.C.x", "900 times"),
        ("C: [BC, 0]", "C: [2 * BC, 0]", "", ""),
        ("100 mm, AB: 30 mm, BC: 90 mm, CD: 70 mm", "10, AB: 3, BC: 9, CD: 7", "", ""),  # all of them plain
        ("AB: 30 mm, BC: 90 mm, CD: 70 mm", "AB: 30, BC: 90, CD: 70", "dimensions.BC", "as are 2 others without"),
        ("AD: 100 mm, AB: 30 mm", "AD: 100 mm, AB: 1", "dimensions.AB", "10 times"),
        ("radius: 6 mm", "radius: 6", "joint_defaults.pin.radius", "60 times"),
        ("radius: 6 mm", "radius: 60 mm", "", ""),  # an eccentric
        ("speed: 60 rpm", "speed: 60 rpm, range: [10, 90]", "drivers.A.range.from", "10 rad"),
    ],
)
def test_a_forgotten_unit(tmp_path: Path, old: str, new: str, where: str, figures: str) -> None:
    assert LINKAGE.count(old) == 1
    (tmp_path / "linkage.yaml").write_text(LINKAGE.replace(old, new), encoding="utf-8")
    found = [one for one in read(tmp_path / "linkage.yaml").checked if one.severity is Severity.WARNING]
    assert [one.where for one in found][:1] == ([where] if where else [])
    assert all(figures in one.what for one in found[:1])


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


@pytest.mark.parametrize(
    ("old", "new", "severity", "where", "figures"),
    [
        ("", "", None, "", ""),  # a plain factor and a plain hint
        ("range: [70 mm, 90 mm]", "range: [70 mm, 90]", Severity.WARNING, "drivers.S.range.to", "is 90 m, "),
        ("pinch: 1 mm", "pinch: 1", Severity.WARNING, "dimensions.pinch", "6 times the largest length"),
        ("pinch: 1 mm", "pinch: 0.001", None, "", ""),
        ("radius: 6 mm", "radius: 0.006", None, "", ""),
    ],
)
def test_a_plain_number_among_others_with_a_unit(
    tmp_path: Path, old: str, new: str, severity: Severity | None, where: str, figures: str
) -> None:
    (tmp_path / "clamp.yaml").write_text(CLAMP.replace(old, new), encoding="utf-8")
    told = read(tmp_path / "clamp.yaml").checked
    found = [(one.severity, one.where) for one in told]
    assert found == ([(severity, where)] if severity else [])
    assert all(figures in one.what for one in told)


STATED = "measures: {end: {point: ram.C, axis: x, as: maximum, "
BOUGHT = """tolerances: {AB: ±0.05 mm, BC: {limits: ±0.05 mm, shift: 0.01 mm}}
costs:
  AB: {model: power, B: 1, k: 1, unit: mm, least: 0.01 mm}
  B.clearance: {options: {g6: {tolerance: 28 um, cost: 40}, f7: {tolerance: 53 um, cost: 25}}}
"""


@pytest.mark.parametrize(
    ("old", "new", "severity", "where", "figures"),
    [
        ("", "", None, "", ""),
        ("28 um", "0.000028", None, "", ""),
        ("28 um", "28", Severity.WARNING, "costs.B.clearance.options.g6.tolerance", "156 times the largest length"),
        ("least: 0.01 mm", "least: 1e-5", None, "", ""),
        ("costs:", f"{STATED}limit: 0.2}}}}\ncosts:", Severity.WARNING, "measures.end.limit", "1.11 times"),
        ("costs:", f"{STATED}limit: 1e-4}}}}\ncosts:", None, "", ""),
        ("costs:", f"{STATED}at_least: 0.05}}}}\ncosts:", None, "", ""),
    ],
)
def test_a_plain_tolerance_or_cost_among_lengths_with_a_unit(
    tmp_path: Path, old: str, new: str, severity: Severity | None, where: str, figures: str
) -> None:
    bought = CLAMP.replace("pin: {radius: 6 mm}", "pin: {radius: 6 mm, clearance: 0.02 mm}") + BOUGHT.replace(old, new)
    (tmp_path / "clamp.yaml").write_text(bought, encoding="utf-8")
    told = read(tmp_path / "clamp.yaml").checked
    assert [(one.severity, one.where) for one in told] == ([(severity, where)] if severity else [])
    assert all(figures in one.what for one in told)


def test_plain_numbers_throughout_and_examples_are_left_alone(tmp_path: Path) -> None:
    plain = CLAMP.replace("80 mm + pinch", "80 * pinch").replace("8 N/mm", "8000").replace("5 N", "5")
    plain = re.sub(r"(\d+) mm(/s)?", lambda found: str(int(found[1]) / 1000), plain)
    (tmp_path / "clamp.yaml").write_text(plain.replace("radius: 0.006", "radius: 6 mm"), encoding="utf-8")
    told = [*read(tmp_path / "clamp.yaml").checked]
    for example in Path("examples").glob("*.yaml"):
        told += [one for one in read(example).checked if "plain number where" in one.what or "forgotten" in one.what]
    assert told == []


SHAFT = Path("examples/double-cardan.yaml").read_text(encoding="utf-8")
FORK = "C: {at: [0, 0, m], axis: [1, 0, 0]}"  # of the middle shaft


def shaft(axis: str, dimensions: str = "", more: str = "") -> str:
    """The double Cardan shaft with the axis of its second fork, and more dimensions."""
    assert SHAFT.count(FORK) == 1
    turned = SHAFT.replace(FORK, f"C: {{at: [0, 0, m], axis: {axis}}}")
    return turned.replace("dimensions:\n", f"dimensions:\n{dimensions}") + more


TURNED = "[cos(phase), sin(phase), 0]"
LIFT = "loads: {{F: {{link: coupler, at: B, force: [0, 'between(drive, {}) * 10 N']}}}}\n"


@pytest.mark.parametrize(
    ("text", "severity", "places", "figure"),
    [
        (shaft(TURNED, "  phase: 3\n"), Severity.WARNING, ["dimensions.phase"], "is 3 rad, which is 172°"),
        (shaft(TURNED, "  phase: 0.5\n"), Severity.NOTE, ["dimensions.phase"], "28.6°"),
        (
            shaft("[cos(3), sin(2 deg + 1), 0]"),
            Severity.WARNING,
            ["links.middle.points.C.axis.x", "links.middle.points.C.axis.y"],
            "takes",
        ),
        (shaft(TURNED, "  phase: 3 deg\n", "tolerances: {phase: 1}"), Severity.WARNING, ["tolerances.phase"], "1 rad"),
        (shaft(TURNED, "  phase: 3 deg\n", "errors: {phase: 1}"), Severity.WARNING, ["errors.phase"], "1 rad"),
        (shaft(TURNED, "  phase: 3 deg\n"), None, [], ""),
        (shaft(TURNED, "  phase: pi / 2\n"), None, [], ""),
        (shaft("[cos(k * pi / 4), sin(k * 45 deg), 0]", "  k: 3\n"), None, [], ""),
        (shaft("[cos(side / l), sin(acos(0.3)), 0]"), None, [], ""),
        (SHAFT.replace("D: 0 deg", "D: 1"), Severity.WARNING, ["assembly.D"], "is 1 rad"),
        (LINKAGE + LIFT.format("20 deg, 90"), Severity.WARNING, ["loads.F.force.y"], "90 rad"),
        (LINKAGE.replace("60 rpm", "60 rpm, start: 3"), Severity.WARNING, ["drivers.A.start"], "3 rad"),
        (LINKAGE.replace("CD: 70 mm", "CD: 70 mm, s: 3").replace("60 rpm", "60 rpm, start: 10 deg - s"),
         Severity.WARNING, ["dimensions.s"], "3 rad"),
        (re.sub(r"(\d+) (mm|rpm)", r"\1", LINKAGE).replace("speed: 60", "speed: 60, start: 3"), None, [], ""),  # all SI
        (re.sub(r"(\d+) (mm|rpm)", r"\1", LINKAGE).replace("speed: 60", "speed: 60, start: 30"), Severity.WARNING,
         ["drivers.A.start"], "4.77 turns"),
    ],
)  # fmt: skip
def test_an_angle_without_a_unit(
    tmp_path: Path, text: str, severity: Severity | None, places: list[str], figure: str
) -> None:
    (tmp_path / "model.yaml").write_text(text, encoding="utf-8")
    found = [one for one in read(tmp_path / "model.yaml").checked if "radians" in one.what]
    assert [(one.where, one.severity) for one in found] == [(place, severity) for place in places]
    assert all(figure in one.what for one in found)


@pytest.mark.spread(1)
@pytest.mark.parametrize(("stated", "values"), [("10 deg", (-10, 0, 3)), ("0 deg", [10, 3])])
def test_plain_angles_of_a_sweep_are_told_once(tmp_path: Path, stated: str, values: object) -> None:
    (tmp_path / "shaft.yaml").write_text(shaft(TURNED, f"  phase: {stated}\n"), encoding="utf-8")
    found = sweep(read(tmp_path / "shaft.yaml"), {"phase": values}, 4).trunnion.findings  # type: ignore[dict-item]
    (told,) = (one for one in found if one.where == "dimensions.phase")
    assert told.severity is Severity.WARNING
    assert "10 " in told.what
    assert "the largest of" in told.what


def test_a_default_that_no_joint_follows_is_told(tmp_path: Path) -> None:
    """A fit is the pin's own clearance."""
    fitted = re.sub(r"(revolute, links: \[.*?\])", r"\1, pin: {fit: 12 mm H7/f7}", CLAMP)
    fitted = fitted.replace("pin: {radius: 6 mm}", "pin: {clearance: 0 mm}")
    assert fitted.count("fit:") == 3
    one_left = fitted.replace("pin: {fit: 12 mm H7/f7}", "pin: {radius: 6 mm}", 1)
    for text, told in ((fitted, ["joint_defaults.pin.clearance"]), (one_left, [])):
        (tmp_path / "clamp.yaml").write_text(text, encoding="utf-8")
        assert [one.where for one in read(tmp_path / "clamp.yaml").checked] == told
