"""A four-bar whose numbers vary in every way that a model file knows."""

from __future__ import annotations

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
