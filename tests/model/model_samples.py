"""The example files, and a small model whose lines are known."""

from __future__ import annotations

from pathlib import Path

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.yaml"))
DURANGO = Path(__file__).parents[2] / "examples" / "durango-fourbar.yaml"

FOURBAR = """\
trunnion: 1
space: planar
dimensions:
  AB: 2 m
  AD: 5.5 m
links:
  ground:
    points: {A: [0, 0], D: [AD, 0]}
  crank:
    points: {A: [0, 0], B: [AB, 0]}
    mass: 4.8 kg
  coupler:
    points: {B: [0, 0], C: [6 m, 0]}
    inertia: 2 kg m^2
  rocker:
    points: {D: [0, 0], C: [3 m, 0]}
joints:
  A: {type: revolute, links: [ground, crank]}
  B: {type: revolute, links: [crank, coupler]}
  C: {type: revolute, links: [coupler, rocker]}
  D: {type: revolute, links: [ground, rocker]}
joint_defaults:
  pin: {radius: 7.5 mm}
  friction: 0.1
drivers:
  A: {speed: 10 rad/s}
loads:
  work: {link: coupler, at: C, force: [0, -1 kN]}
assembly:
  C: [7.6, 2.1]
measures:
  tip: {point: coupler.C, axis: x}
"""
