"""Faults of the mechanics: algebra, joints, groups, solve, cycle, measures."""

from __future__ import annotations

from benchmarks.faults.fault import Fault

__all__ = ["FAULTS"]

_ALGEBRA = (
    Fault(
        "dual-quotient-sign",
        "algebra/dual.py",
        "(x.dual - quotient * y.dual)",
        "(x.dual + quotient * y.dual)",
        ("tests/algebra/test_dual.py",),
    ),
    Fault(
        "dual-power-exponent",
        "algebra/dual.py",
        "base ** (exponent - 1) * self.dual",
        "base**exponent * self.dual",
        ("tests/algebra/test_dual.py",),
    ),
    Fault(
        "screw-log-near-half-a-turn",
        "algebra/lines.py",
        "(yx - xy, xz + zx, zy + yz, 1 - xx - yy + zz)",
        "(yx - xy, xz - zx, zy + yz, 1 - xx - yy + zz)",
        ("tests/algebra/test_space.py",),
    ),
    Fault(
        "course-mean-of-even-panels",
        "algebra/course.py",
        "np.tensordot(self.half, integrals, 1)",
        "np.tensordot(np.full_like(self.half, np.mean(self.half)), integrals, 1)",
        ("tests/algebra/test_course.py",),
    ),
)

_JOINTS = (
    Fault(
        "guide-torsion-halved",
        "joints/contact_loads.py",
        "normal = normal + 2 * namespace(more[1]).abs(more[1]) / self.width",
        "normal = normal + namespace(more[1]).abs(more[1]) / self.width",
        ("tests/invariants/test_laws.py",),
    ),
    Fault(
        "guide-torsion-gradient-halved",
        "joints/contact_loads.py",
        "else 2 * namespace(more[1]).sign(more[1]) / self.width",
        "else namespace(more[1]).sign(more[1]) / self.width",
        ("tests/invariants/test_laws.py",),
    ),
    Fault(
        "lugre-damping-dropped",
        "joints/friction.py",
        'parameters["damping"] * rate + parameters["viscous"] * slip) * normal',
        'parameters["viscous"] * slip) * normal',
        ("tests/invariants/test_laws.py",),
    ),
    Fault(
        "friction-pair-factor-ignored",
        "joints/friction.py",
        '(parameters.get("pair_factor", 1.0) * parameters["coefficient"]) * normal',
        'parameters["coefficient"] * normal',
        ("tests/invariants/test_laws.py",),
    ),
    Fault(
        "planar-guide-couple-halved",
        "joints/contact_loads.py",
        "self.across[1], moment * (2 / self.length)",
        "self.across[1], moment * (1 / self.length)",
        ("tests/invariants/test_laws.py",),
    ),
    Fault(
        "clearance-load-of-the-other-end",
        "joints/clearance.py",
        "return [(hx - gx, hy - gy), (hx + gx, hy + gy)]",
        "return [(hx + gx, hy + gy), (hx - gx, hy - gy)]",
        ("tests/invariants/test_play.py",),
    ),
    Fault(
        "motion-return-takes-the-rise",
        "joints/motion.py",
        "_risen(profile, moment - step, back)",
        "_risen(profile, moment - step, duration)",
        ("tests/invariants/test_motion.py::test_a_return_of_its_own_duration",),
    ),
)

_GROUPS = (
    Fault(
        "dead-centre-tolerance",
        "groups/dyad.py",
        "ROUNDING = 1e-15",
        "ROUNDING = 1e-6",
        ("tests/invariants/test_groups.py", "-k", "meet"),
    ),
    Fault(
        "ball-acceleration-carried",
        "groups/tree.py",
        "            total = algebra.added(total, bracket(twist, part))\n            if not motion.together:\n",
        "            if not motion.together:\n                total = algebra.added(total, bracket(twist, part))\n",
        ("tests/reference/test_judged.py", "-k", "in_space"),
    ),
    Fault(
        "freedoms-do-not-carry-those-after-them",
        "groups/tree.py",
        "            if not motion.together:\n                twist",
        "            if motion is None:\n                twist",
        ("tests/reference/test_judged.py", "-k", "in_space"),
    ),
    Fault(
        "dyad-carried-sign",
        "groups/dyad.py",
        "minus(added(on_i, carried[1]), on_j)",
        "minus(minus(on_i, carried[1]), on_j)",
        ("tests/invariants/test_groups.py::test_every_entry_equals_the_general_group",),
    ),
    Fault(
        "slide-not-carried-along",
        "algebra/plane.py",
        "x = less(literal.times(b.w, a.y), literal.times(a.w, b.y))",
        "x = literal.times(b.w, a.y)",
        ("tests/invariants/test_groups.py", "-k", "derivative_of_its_position"),
    ),
    Fault(
        "gear-phase-sign",
        "groups/general.py",
        "ratio * start + phase",
        "ratio * start - phase",
        ("tests/reference/test_gears.py",),
    ),
    Fault(
        "rack-on-the-other-side",
        "groups/gear.py",
        "towards = radius * axis.s, -radius * axis.c",
        "towards = -radius * axis.s, radius * axis.c",
        ("tests/reference/test_gears.py",),
    ),
    Fault(
        "thread-friction-across-the-screw-alone",
        "solve/backward.py",
        "friction * lead / helix",
        "0.0 * friction",
        ("tests/reference/test_gears.py",),
    ),
    Fault(
        "spin-carried-the-wrong-way",
        "groups/spatial.py",
        "sense = -1.0 if group.joints[k].sides[1] in members else 1.0",
        "sense = 1.0 if group.joints[k].sides[1] in members else -1.0",
        ("tests/invariants/test_spatial_groups.py", "tests/reference/test_space_values.py", "-k", "spin"),
    ),
    Fault(
        "line-of-a-knee-fixed-in-its-link",
        "groups/spatial.py",
        "dot(twists[link].u, self._axis_rate(",
        "0.0 * dot(twists[link].u, self._axis_rate(",
        ("tests/reference/test_passive_freedoms.py", "-k", "does_not_spin"),
    ),
)

_SOLVE = (
    Fault(
        "useful-mark-ignored",
        "solve/loads.py",
        "marked = [name for name, load in mechanism.loads.items() if load.useful]",
        "marked = [name for name, load in mechanism.loads.items() if load.useful and False]",
        ("tests/reference/test_means.py",),
    ),
    Fault(
        "past-a-dead-centre-goes-on",
        "solve/inverse.py",
        "* self._sense_at_start < 0, np.nan, 0.0)",
        "* self._sense_at_start < -2, np.nan, 0.0)",
        ("tests/reference/test_output_driven.py", "-k", "dead_centre"),
    ),
    Fault(
        "weight-without-its-mass",
        "solve/loads.py",
        'yield values[f"links.{link}.mass"] * _dot(gravity, velocity)',
        "yield _dot(gravity, velocity)",
        ("tests/reference/test_means.py",),
    ),
    Fault(
        "stays-on-its-side",
        "solve/change_points.py",
        "before, after = np.max(np.abs(others - ours)[:, 5:], axis=0)",
        "return None\n    before, after = np.max(np.abs(others - ours)[:, 5:], axis=0)",
        ("tests/reference/test_change_points.py", "-m", "not slow", "-x"),
    ),
    Fault(
        "ends-where-a-track-turns-over",
        "solve/change_points.py",
        "for moment in follower.broken(track.coordinates, times)]",
        "for moment in follower.broken(track.coordinates, times)[:0]]",
        ("tests/reference/test_change_points.py", "-k", "in_space and deltoid"),
    ),
    Fault(
        "turns-over-where-the-start-is-met",
        "solve/change_points.py",
        "return bool(np.max(np.abs(ends[:, 1] - ends[:, 0])) < SAME)",
        "return False",
        ("tests/reference/test_change_points.py", "-k", "have_no_forces"),
    ),
    Fault(
        "half-turns-told-apart",
        "solve/assembly.py",
        "numbers += [element.z[i] * element.z[j] for i in range(3) for j in range(i, 3)]",
        "numbers += [*element.z]",
        ("tests/reference/test_assemblies.py", "-k", "half_turns"),
    ),
    Fault(
        "massive-links-half-round-alike",
        "solve/assembly.py",
        "bare = link.mass.source == 0 and",
        "bare =",
        ("tests/reference/test_assemblies.py", "-k", "half_turns"),
    ),
    Fault(
        "hints-hold-at-the-start-alone",
        "solve/hints.py",
        "if stated is None or not drivers",
        "if stated is not None or not drivers",
        ("tests/reference/test_assemblies.py", "-k", "hint_holds"),
    ),
    Fault(
        "spin-friction-sign",
        "solve/space/determinacy.py",
        "sign = 1.0 if walk.system.joints[name].links[1] in members else -1.0",
        "sign = 1.0",
        ("tests/reference/test_space_friction.py", "-k", "drags"),
    ),
    Fault(
        "resisting-load-drives",
        "solve/loads.py",
        "_in_joint(walk, load.joint, -sign * size, turns, speed)",
        "_in_joint(walk, load.joint, sign * size, turns, speed)",
        ("tests/invariants/test_loads.py", "-k", "resist"),
    ),
    Fault(
        "load-power-without-y",
        "algebra/plane.py",
        "force = plus(literal.times(wrench.x, twist.x), literal.times(wrench.y, twist.y))",
        "force = literal.times(wrench.x, twist.x)",
        ("tests/invariants/test_loads.py", "-k", "following or expression"),
    ),
    Fault(
        "gyroscopic-moment-dropped",
        "solve/forward.py",
        "plus(apply(tensor, change), cross(w, apply(tensor, w)))",
        "apply(tensor, change)",
        ("tests/reference/test_judged.py", "-k", "in_space"),
    ),
    Fault(
        "friction-of-one-pin-of-a-cross-not-felt",
        "solve/contacts.py",
        "unit, still, amount=share * rate, felt=True)",
        "unit, still, amount=share * rate)",
        ("tests/reference/test_judged.py", "-k", "in_space"),
    ),
    Fault(
        "screw-thread-lead-sign",
        "solve/contacts.py",
        "unit = _mixed(axis, middle, lever, lever / helix, lead / helix)",
        "unit = _mixed(axis, middle, lever, lever / helix, -lead / helix)",
        ("tests/reference/test_space_friction.py", "-k", "screw"),
    ),
    Fault(
        "bristles-begin-anywhere",
        "solve/bristles.py",
        "_picked(whole_gain, last) / xp.where(moves, lost, 1.0), 0.0)",
        "_picked(whole_gain, last), 0.0)",
        ("tests/reference/test_friction_by_direction.py", "-k", "chained"),
    ),
)

_CYCLE = (
    Fault(
        "residual-not-related-to-power",
        "cycle/summary.py",
        "return residual / highest if highest > 0 else residual",
        "return residual",
        ("tests/reference/test_means.py",),
    ),
    Fault(
        "efficiency-inverted",
        "cycle/course.py",
        "return self.useful_power.net / work if work > 0 and",
        "return work / self.useful_power.net if work > 0 and",
        ("tests/reference/test_means.py", "-k", "efficiency"),
    ),
    Fault(
        "mean-effort-for-rms",
        "cycle/course.py",
        "lost, np.sqrt(squares),",
        "lost, squares,",
        ("tests/reference/test_means.py",),
    ),
    Fault(
        "useful-power-sign",
        "cycle/fill.py",
        "useful = useful - power",
        "useful = useful + power",
        ("tests/reference/test_means.py", "-k", "efficiency"),
    ),
)

_MEASURES = (
    Fault(
        "angles-of-an-expression-jump",
        "measures/measures.py",
        "near(number, angle_at(run, part, primal(time))) if turns else number",
        "number",
        ("tests/reference/test_kinematic_measures.py",),
    ),
    Fault(
        "ends-share-no-moment",
        "solve/contacts.py",
        "loads += [minus(half, couple), plus(half, couple)]",
        "loads += [half, half]",
        ("tests/reference/test_friction_by_direction.py",),
    ),
    Fault(
        "friction-of-a-cross-bears-on-nothing",
        "solve/contacts.py",
        "walk.algebra.added(reaction, friction) if pair.crossed else reaction",
        "reaction",
        ("tests/reference/test_friction_by_direction.py",),
    ),
    Fault(
        "friction-forward-is-backward",
        "joints/friction.py",
        "xp.where(primal(slip) < 0, backward, forward)",
        "xp.where(primal(slip) > 0, backward, forward)",
        ("tests/reference/test_friction_by_direction.py",),
    ),
    Fault(
        "peak-to-peak-of-one-side",
        "measures/figures.py",
        "return panels.top(of).value - panels.top(of, -1.0).value",
        "return panels.top(of).value",
        ("tests/reference/test_measures.py", "-k", "stroke"),
    ),
    Fault(
        "dead-centre-at-the-end-of-a-range",
        "measures/figures.py",
        "return selected(around | ~at_end, self._coordinate(time), np.nan)",
        "return self._coordinate(time)",
        ("tests/reference/test_measures.py", "-k", "dead_centre"),
    ),
    Fault(
        "straightness-angle-doubled",
        "measures/figures.py",
        "angle = 0.5 * xp.arctan2(*twice)",
        "angle = 0.4 * xp.arctan2(*twice)",
        ("tests/reference/test_measures.py", "-k", "straightness"),
    ),
    Fault(
        "place-of-an-extreme-moves-the-other-way",
        "algebra/panels.py",
        "-slope / np.where(bend == 0.0, 1.0, bend)",
        "slope / np.where(bend == 0.0, 1.0, bend)",
        ("tests/invariants/test_measures.py",),
    ),
    Fault(
        "dwell-counts-the-other-part",
        "algebra/panels.py",
        "np.sum(np.diff(spots)[up])",
        "np.sum(np.diff(spots)[~up])",
        ("tests/reference/test_kinematic_measures.py", "-k", "dwell"),
    ),
    Fault(
        "breaks-stay-in-derivatives",
        "measures/many.py",
        "bends = Dual(bends, np.divide(shifts, 2 * step,",
        "bends = Dual(bends, 0.0 * np.divide(shifts, 2 * step,",
        ("tests/reference/test_loads_that_jump.py",),
    ),
    Fault(
        "transmission-angle-not-folded",
        "measures/measures.py",
        "np.pi / 2 - namespace(angle).abs(angle)",
        "np.pi / 2 - angle",
        ("tests/reference/test_kinematic_measures.py", "-k", "cosines"),
    ),
)

_ENGINES = (
    Fault(
        "negative-difference-not-turned",
        "engines/graph.py",
        'self.apply("sub", *inner.args[::-1])',
        'self.apply("sub", *inner.args)',
        ("tests/reference/test_engines.py",),
    ),
    Fault(
        "angle-beyond-a-quarter",
        "engines/lanes.py",
        "quarter = self._minus(math.pi / 4, self.neg(small), HALF_PI[1] / 2)",
        "quarter = self._minus(math.pi / 4, small, HALF_PI[1] / 2)",
        ("tests/reference/test_engines.py",),
    ),
    Fault(
        "doubtful-lane-of-another-sample",
        "solve/walk_kernel.py",
        "return flat[rows] if len(flat) > 1",
        "return flat[0 * rows] if len(flat) > 1",
        ("tests/reference/test_compiled.py",),
    ),
    Fault(
        "code-of-others-trusted",
        "engines/machine_code.py",
        "and not file_status.st_mode & (stat.S_IWGRP | stat.S_IWOTH)",
        "and bool(file_status.st_mode)",
        ("tests/reference/test_engines.py",),
    ),
    Fault(
        "loop-ends-with-its-first-lane-at-rest",
        "engines/lanes.py",
        'return self.b.icmp_signed("!=", self.b.bitcast(lanes, mask), ir.Constant(mask, 0))',
        "return self.b.extract_element(lanes, ir.Constant(INT, 0))",
        ("tests/reference/test_engines.py", "tests/reference/test_compiled.py"),
    ),
    Fault(
        "margin-of-astray-steps",
        "solve/continuation.py",
        "good = (closed > 0) & (determinant > 0) & near &",
        "good = (closed > 0) & (determinant > 0) &",
        ("tests/invariants/test_friction.py",),
    ),
    Fault(
        "compiled-cycle-keeps-zero-slip",
        "cycle/cycle_kernel.py",
        "gravest=Status.SOLVED,",
        "gravest=Status.LOCKED,",
        ("tests/reference/test_compiled.py",),
    ),
    Fault(
        "component-against-the-edges",
        "structure/graph.py",
        "before[other].append(node)",
        "before[node].append(other)",
        ("tests/invariants/test_structure.py",),
    ),
)

_DYNAMICS = (
    Fault(
        "rotor-without-its-ratio",
        "dynamics/motor.py",
        "integral, now) - self.inertia * self.ratio * second",
        "integral, now) - self.inertia * second",
        ("tests/reference/test_motion_in_time.py", "-k", "rotor"),
    ),
    Fault(
        "loss-of-a-gear-one-way",
        "joints/motors.py",
        "np.where(joint * speed >= 0.0, joint * efficiency, joint / efficiency)",
        "joint * efficiency",
        ("tests/reference/test_motion_in_time.py", "-k", "gear"),
    ),
    Fault(
        "friction-of-the-other-sense-at-rest",
        "dynamics/state.py",
        "miss = sense * (self.given(begins",
        "miss = (self.given(begins",
        ("tests/reference/test_motion_in_time.py", "-k", "weak or breaks"),
    ),
    Fault(
        "twice-the-kinetic-energy",
        "dynamics/rates.py",
        "energy = energy - 0.5 * algebra.power",
        "energy = energy - algebra.power",
        ("tests/reference/test_motion_in_time.py", "-k", "mujocos"),
    ),
)

_STICKING = (
    Fault(
        "shares-beyond-their-end",
        "dynamics/active_set.py",
        "if most > 1.0 + SLACK or",
        "if most > 1.5 + SLACK or",
        ("tests/reference/test_joints_that_lock.py", "-k", "blocks"),
    ),
    Fault(
        "shares-that-are-not-the-least",
        "dynamics/bordered.py",
        "abs(normal @ target) / total <= best",
        "abs(normal @ target) / total >= best >= 0.0",
        ("tests/invariants/test_laws.py",),
    ),
    Fault(
        "brake-that-holds-nothing",
        "dynamics/motor.py",
        " - share * self.braking(now)",
        "",
        ("tests/reference/test_joints_that_lock.py", "-k", "braked"),
    ),
)

_CONTACT = (
    Fault(
        "slip-without-the-spin-of-the-pin",
        "dynamics/touching.py",
        "_minus(plane.velocity_at(moving, place)",
        "_minus(plane.velocity_at(moving, plane.point_of(body, self.pin))",
        ("tests/reference/test_contacts.py", "-k", "friction"),
    ),
    Fault(
        "contact-without-its-loss",
        "joints/contact.py",
        ".maximum(1.0 + factor * rate / onset, 0.0)",
        ".maximum(1.0 + 0.0 * factor * rate / onset, 0.0)",
        ("tests/reference/test_contacts.py", "-k", "first_contact"),
    ),
    Fault(
        "contact-pushes-the-pin-alone",
        "dynamics/touching.py",
        "((self.body, 1.0), (self.other, -1.0))",
        "((self.body, 1.0),)",
        ("tests/reference/test_contacts.py", "-k", "reaction"),
    ),
    Fault(
        "whole-stiffness-at-each-end-of-a-pin",
        "dynamics/touching.py",
        'half = 0.5 * common["stiffness"]',
        'half = common["stiffness"]',
        ("tests/reference/test_pins_in_space.py", "-k", "long_pin"),
    ),
    Fault(
        "slip-of-a-pin-in-space-at-its-axis",
        "dynamics/touching.py",
        "place = plus(end.place, scaled(self.wall, normal))",
        "place = end.place",
        ("tests/reference/test_pins_in_space.py", "-k", "let_go and 0.007"),
    ),
    Fault(
        "machine-code-without-brakes",
        "dynamics/motor.py",
        "brake_from=ever if braked else never",
        "brake_from=never",
        ("tests/invariants/test_free_motion.py", "-k", "machine_code"),
    ),
    Fault(
        "machine-code-of-other-numbers",
        "dynamics/compiled_rates.py",
        "bool(motion.resisted), *self.constant.items()",
        "bool(motion.resisted)",
        ("tests/invariants/test_steady_cycle.py", "-k", "nothing_or_one"),
    ),
    Fault(
        "mass-matrix-of-the-other-sign",
        "dynamics/compiled_rates.py",
        "share = matrix[i][k] / matrix[k][k]",
        "share = -matrix[i][k] / matrix[k][k]",
        ("tests/reference/test_contacts.py", "-k", "machine_code"),
    ),
)

FAULTS = (*_CONTACT, *_STICKING, *_ALGEBRA, *_JOINTS, *_GROUPS, *_ENGINES, *_SOLVE, *_CYCLE, *_DYNAMICS, *_MEASURES)
