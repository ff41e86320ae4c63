"""Lengths far larger than the others: a forgotten unit is told with its figure, and plain SI numbers are left alone."""

from __future__ import annotations

from pathlib import Path

import pytest

from trunnion import read
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
        ("C: [BC, 0]", "C: [0.09, 0]", "", ""),
        ("100 mm, AB: 30 mm, BC: 90 mm, CD: 70 mm", "10, AB: 3, BC: 9, CD: 7", "", ""),  # all of them plain
        ("AB: 30 mm, BC: 90 mm", "AB: 30, BC: 90", "dimensions.BC", "as are 1 others"),
        ("radius: 6 mm", "radius: 6", "joint_defaults.pin.radius", "60 times"),
        ("radius: 6 mm", "radius: 60 cm", "joint_defaults.pin.radius", "more than every link is long"),
        ("radius: 6 mm", "radius: 60 mm", "", ""),  # an eccentric
        ("speed: 60 rpm", "speed: 60 rpm, range: [10, 90]", "drivers.A.range.from", "10 rad"),
        ("speed: 60 rpm", "speed: 60 rpm, range: [0, 12.566]", "", ""),
    ],
)
def test_a_forgotten_unit(tmp_path: Path, old: str, new: str, where: str, figures: str) -> None:
    assert LINKAGE.count(old) == 1
    (tmp_path / "linkage.yaml").write_text(LINKAGE.replace(old, new), encoding="utf-8")
    found = [one for one in read(tmp_path / "linkage.yaml").checked if one.severity is Severity.WARNING]
    assert [one.where for one in found][:1] == ([where] if where else [])
    assert all(figures in one.what for one in found[:1])
