"""A Whitworth with a ram, whose load is against its motion, as a user of the studio draws it."""

TEXT = """\
trunnion: 1
name: Ram
space: planar
dimensions:
  crank: 30 mm
links:
  ground:
    points: {A: [0, 0], C: [0, -80 mm], G: {at: [-100 mm, 100 mm], axis: [1, 0]}}
  link1:
    points: {A: [0, 0], B: [crank, 0]}
  link2:
    points: {C: [0, 0], D: [180 mm, 0], F: {at: [0, 0], axis: [1, 0]}}
  link3:
    points: {D: [0, 0], E: [100 mm, 0]}
  block1:
    points: {B: [0, 0], F: {at: [0, 0], axis: [1, 0]}}
  block2:
    points: {E: [0, 0], G: {at: [0, 0], axis: [1, 0]}}
joints:
  A: {type: revolute, links: [ground, link1]}
  C: {type: revolute, links: [ground, link2]}
  D: {type: revolute, links: [link2, link3]}
  F: {type: prismatic, links: [link2, block1]}
  B: {type: revolute, links: [link1, block1]}
  G: {type: prismatic, links: [ground, block2]}
  E: {type: revolute, links: [link3, block2]}
assembly: {D: [0 mm, 100 mm], F: 110 mm, B: [0 mm, 30 mm], E: [-100 mm, 100 mm]}
drivers:
  A: {speed: 60 rpm, start: 90 deg}
loads:
  load1: {link: block2, at: G, force: ["-150 N * max(-1, min(1, G.slide_velocity / (1 mm/s)))", 0 N]}
joint_defaults:
  friction: 0.12
  pin: {radius: 8 mm}
  guide: {length: 40 mm}
"""
