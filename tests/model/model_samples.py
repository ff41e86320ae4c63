"""The example files, and small models whose lines are known."""

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

# A four-bar whose numbers vary in every way that a model file knows.
VARIED = """\
trunnion: 1
space: planar
dimensions: {AD: 100 mm, AB: 30 mm, BC: 90 mm ± 0.02 mm, CD: 70 mm ± 0.05 mm, t: 0.05 mm}
links:
  ground:  {points: {A: [0, 0], D: [AD, 0]}}
  crank:   {points: {A: [0, 0], B: [AB, 0]}, mass: 0.2 kg ± 5 g}
  coupler: {points: {B: [0, 0], C: [BC, 0]}}
  rocker:  {points: {D: [0, 0], C: [CD, 0]}}
joints:
  A: {type: revolute, links: [ground, crank], pin: {clearance: 20 um}, friction: 0.1}
  B: {type: revolute, links: [crank, coupler], pin: {clearance: 20 um}, seat: {xi: 30 deg}}
  C: {type: revolute, links: [coupler, rocker], pin: {fit: 12 mm H7/g6}}
  D: {type: revolute, links: [ground, rocker]}
joint_defaults: {pin: {radius: 6 mm}, friction: 0.2}
drivers: {A: {speed: 60 rpm}}
assembly: {C: [94 mm, 70 mm]}
tolerances:
  AB: ±t
  AD: +0.02/-0.01 mm
  BC: {limits: ±0.05 mm, cp: 1.33, cpk: 1.0, shift: 0.01 mm}
  CD: {distribution: uniform}
  joint_defaults.friction.coefficient: {limits: +0.02/-0.01, distribution: triangular, mode: 0.005}
  A.friction.coefficient: ±0.03
  B.misalignment.offset: {limits: +0.02/0 mm, direction: uniform}
  B.seat.xi: {distribution: direction}
  A.pin.clearance: {distribution: sample, values: [10 um, -3 um, 2 um]}
  drivers.A.speed: {limits: ±1 rpm, distribution: beta, alpha: 2, beta: 3}
tolerance_defaults: {distribution: truncated, cp: 1.2}
correlations:
  - {of: [AB, BC], coefficient: 0.5}
  - {of: [joint_defaults.friction.coefficient], coefficient: 0.9}
costs:
  AB: {model: power, B: 1, k: 0.45, unit: mm, least: 5 um, most: 2 * t, group: bores}
  BC: {model: exponential, A: 1, B: 20, k: 30, unit: mm, group: bores}
  CD: {process: boring}
  AD: {options: {milled: {tolerance: t, cost: 3}, ground: {tolerance: 10 um, cost: 9}}}
  A.clearance: {model: power, B: 1, k: 1, unit: m}
processes:
  boring: {IT7: 9, 8: 6}
measures:
  error: {angle: rocker, limit: ±0.1 deg}
  theta: {angle: rocker, at: 60 deg, limit: +0.2/-0.1 deg}
  later: {rotation: D, at: 0.1 s, limit: 2e-3}
  peak: {effort: A, as: maximum, at_most: 12 N m}
  swing: {stroke: D, over: [0 deg, 180 deg], limit: ±t/AB}
"""

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
