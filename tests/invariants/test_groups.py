"""Groups by themselves: closed forms against the general group, which is held against finite differences and power."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mechanisms import Array, dyad
from trunnion.algebra.dual import Dual, derivative, primal
from trunnion.algebra.plane import Frame, Twist, Wrench, acceleration_at, compose, moment_at, velocity_at
from trunnion.groups import GROUPS
from trunnion.groups.general import General
from trunnion.groups.rrr import meet
from trunnion.groups.tree import OUTER, GroupJoint

LANES = 10_000


class Case:
    """Random poses of a group, built forward so that they close: link frames first, then elements to fit them."""

    def __init__(self, group: General, lanes: int, seed: int, spread: float = 1.0, offset: float = 0.0) -> None:
        rng = np.random.default_rng(seed)
        self.group, self.lanes, self.rng = group, lanes, rng
        n = group.links
        angle = rng.uniform(-np.pi, np.pi, (n, lanes))
        x, y = rng.uniform(-spread, spread, (2, n, lanes)) + offset
        self.frames = [Frame(x[i], y[i], np.cos(angle[i]), np.sin(angle[i])) for i in range(n)]
        self.elements: list[tuple[Frame, Frame]] = []
        self.drive: list[Array] = []
        for k, joint in enumerate(group.joints):
            at = rng.uniform(-spread, spread, (2, lanes)) + offset
            turn = rng.uniform(-np.pi, np.pi, lanes)
            q = rng.uniform(-1, 1, lanes) * (np.pi if joint.kind == "revolute" else spread)
            one = Frame(at[0], at[1], np.cos(turn), np.sin(turn))
            two = (
                Frame(one.x, one.y, np.cos(turn + q), np.sin(turn + q))
                if joint.kind == "revolute"
                else Frame(one.x + q * one.c, one.y + q * one.s, one.c, one.s)
            )
            if k in group.driven:
                self.drive.append(q)
            self.elements.append((self._on(joint.sides[0], one), self._on(joint.sides[1], two)))
        self.drive = [self.drive[sorted(group.driven).index(k)] for k in group.driven]

    def _on(self, link: int, element: Frame) -> Frame:
        """A global element in the coordinates of its link; global if it is outside."""
        if link == OUTER:
            return element
        f = self.frames[link]
        dx, dy = element.x - f.x, element.y - f.y
        return Frame(
            f.c * dx + f.s * dy,
            f.c * dy - f.s * dx,
            f.c * element.c + f.s * element.s,
            f.c * element.s - f.s * element.c,
        )

    def guess(self) -> list[Array]:
        """Free tree coordinates of the pose it was built from."""
        found: list[Array] = []
        for k, _ in self.group.free:
            one, two = (
                element if link == OUTER else compose(self.frames[link], element)
                for link, element in zip(self.group.joints[k].sides, self.elements[k], strict=True)
            )
            if self.group.joints[k].kind == "revolute":
                found.append(np.arctan2(one.c * two.s - one.s * two.c, one.c * two.c + one.s * two.s))
            else:
                found.append(one.c * (two.x - one.x) + one.s * (two.y - one.y))
        return found

    def outer(self) -> list[Any]:
        """Random twist, or derivative of one, of every outside link, a different one for each joint."""
        return [
            Twist(*self.rng.normal(size=(3, self.lanes))) if OUTER in joint.sides else None
            for joint in self.group.joints
        ]

    def loads(self) -> list[Wrench]:
        return [Wrench(*self.rng.normal(size=(3, self.lanes))) for _ in range(self.group.links)]


def same(a: Any, b: Any, weight: Array, tolerance: float = 1e-10) -> None:
    """Equal lane by lane, as a share of the lane's scale times its condition."""
    for one, two in zip(a, b, strict=True):
        for x, y in zip(one, two, strict=True):
            difference = np.abs(np.broadcast_to(x, weight.shape) - np.broadcast_to(y, weight.shape))
            assert np.all(difference <= tolerance * weight), float(np.max(difference / weight))


def size_of(items: Sequence[Any], lanes: int) -> Array:
    return 1 + np.max([np.abs(np.broadcast_to(n, (lanes,))) for item in items for n in item], axis=0)


@pytest.mark.parametrize("offset", [0.0, 100.0])
def test_rrr_equals_general(offset: float) -> None:
    """10 000 random groups, both branches: frames, velocities, accelerations, reactions to 1e-10."""
    group = dyad("RRR")
    case = Case(group, LANES, 7, offset=offset)
    pose = group.position(case.elements, case.guess())
    # closed-form order: (B on h, B on i), (C on i, C on j), (D on k, D on j)
    b, d = case.elements[0][0], case.elements[2][0]
    c = compose(case.frames[0], case.elements[1][0])
    left = (d.x - b.x) * (c.y - b.y) - (d.y - b.y) * (c.x - b.x) > 0
    assert 4000 < np.count_nonzero(left) < 6000
    branch = np.where(left, 1, -1)
    rrr = GROUPS["RRR"]
    closed = rrr.position(case.elements, branch)
    condition = rrr.condition(closed)
    good = condition < 1e3
    assert np.count_nonzero(good) > 0.95 * LANES
    weight = np.where(good, 1 + offset, np.inf) * condition
    same(pose.frames, closed.frames, weight)
    same(closed.frames, case.frames, weight)

    outer = case.outer(), case.outer()
    for one, two in zip(group.moved(pose, *outer), rrr.moved(closed, *outer), strict=True):
        same(one, two, weight * size_of(two, LANES))
    loads = case.loads()
    reactions = rrr.reactions(closed, loads)
    same(group.reactions(pose, loads), reactions, weight * size_of(reactions, LANES))
    assert np.all(np.where(good, rrr.closure(closed), 0) <= 1e-13 * weight)
    assert np.all(np.where(good, group.closure(pose), 0) <= 1e-13 * weight)


@pytest.mark.parametrize("branch", [1, -1])
def test_one_branch_for_all_lanes(branch: int) -> None:
    """A scalar branch puts C on its side in every lane; mirrored in x the other branch is its mirror image."""
    case = Case(dyad("RRR"), 500, 11)
    rrr = GROUPS["RRR"]
    pose = rrr.position(case.elements, branch)
    b, d = case.elements[0][0], case.elements[2][0]
    c = compose(pose.frames[0], case.elements[1][0])
    side = (d.x - b.x) * (c.y - b.y) - (d.y - b.y) * (c.x - b.x)
    assert np.all(np.sign(side) == branch)
    mirrored = [tuple(Frame(e.x, -e.y, e.c, -e.s) for e in pair) for pair in case.elements]
    other = rrr.position(mirrored, -branch)
    for f, g in zip(pose.frames, other.frames, strict=True):
        np.testing.assert_allclose([g.x, -g.y, g.c, -g.s], [f.x, f.y, f.c, f.s], rtol=0, atol=1e-9)


def test_rrr_where_the_circles_do_not_meet() -> None:
    """NaN in the lanes too far apart or one inside the other, numbers in the others; the general group likewise."""
    far = np.array([1.0, 2.5, 0.1, 1.5])
    elements = [
        (Frame(0.0, 0.0), Frame(0.0, 0.0)),
        (Frame(1.5, 0.0), Frame(0.8, 0.0)),
        (Frame(far, 0.0 * far), Frame(0.0, 0.0)),
    ]
    with np.errstate(all="ignore"):
        closed = GROUPS["RRR"].position(elements, 1)
        general = dyad("RRR").position(elements, [np.full(4, 1.0), np.full(4, -1.0)])
    expected = [True, False, False, True]
    np.testing.assert_array_equal(np.isfinite(closed.frames[0].x + closed.frames[1].c), expected)
    np.testing.assert_array_equal(np.isfinite(general.frames[0].x + general.frames[1].c), expected)


TOPOLOGIES: dict[str, General] = {
    **{letters: dyad(letters) for letters in ("RRR", "RRP", "PRR", "RPR", "PRP", "RPP", "PPR")},
    "turned sides": General(
        2, (GroupJoint("revolute", (0, OUTER)), GroupJoint("prismatic", (1, 0)), GroupJoint("revolute", (1, OUTER)))
    ),
    "triad": General(
        4,
        tuple(GroupJoint("revolute", (3, i)) for i in range(3))
        + tuple(GroupJoint("revolute", (OUTER, i)) for i in range(3)),
    ),
    "triad with slides": General(
        4,
        (
            GroupJoint("revolute", (0, 3)),
            GroupJoint("prismatic", (3, 1)),
            GroupJoint("revolute", (2, 3)),
            GroupJoint("prismatic", (OUTER, 0)),
            GroupJoint("revolute", (1, OUTER)),
            GroupJoint("revolute", (OUTER, 2)),
        ),
    ),
    "closed contour": General(
        4,
        (
            *(GroupJoint("revolute", (i, (i + 1) % 4)) for i in range(4)),
            GroupJoint("revolute", (OUTER, 0)),
            GroupJoint("revolute", (OUTER, 2)),
        ),
    ),
    "cylinder driven": General(
        3,
        (
            GroupJoint("revolute", (OUTER, 0)),
            GroupJoint("prismatic", (0, 1)),
            GroupJoint("revolute", (1, 2)),
            GroupJoint("revolute", (2, OUTER)),
        ),
        (1,),
    ),
    "inner pin driven": General(
        3,
        (
            GroupJoint("revolute", (OUTER, 0)),
            GroupJoint("revolute", (0, 1)),
            GroupJoint("revolute", (2, 1)),
            GroupJoint("revolute", (2, OUTER)),
        ),
        (2,),
    ),
    "two driven": General(
        4,
        (
            GroupJoint("revolute", (0, OUTER)),
            GroupJoint("prismatic", (1, 0)),
            GroupJoint("revolute", (1, 2)),
            GroupJoint("prismatic", (2, 3)),
            GroupJoint("revolute", (3, OUTER)),
        ),
        (3, 1),
    ),
    "R driver": General(1, (GroupJoint("revolute", (OUTER, 0)),), (0,)),
    "P driver": General(1, (GroupJoint("prismatic", (OUTER, 0)),), (0,)),
    "P driver, turned": General(1, (GroupJoint("prismatic", (0, OUTER)),), (0,)),
}


def regular(group: General, lanes: int, seed: int) -> tuple[Case, Any, Array]:
    """A case, its pose by Newton from a guess nearby, and the lanes with a condition below 300."""
    case = Case(group, lanes, seed)
    pose = group.position(case.elements, case.guess(), case.drive)
    return case, pose, np.broadcast_to(pose.condition, (lanes,)) < 300


@pytest.mark.parametrize("name", TOPOLOGIES)
def test_general_position(name: str) -> None:
    """It stays on the assembly it starts from, and comes back to it from a guess a little off."""
    group = TOPOLOGIES[name]
    case, pose, good = regular(group, 300, 1)
    assert np.count_nonzero(good) > 150
    for frame, expected in zip(pose.frames, case.frames, strict=True):
        for a, b in zip(frame, expected, strict=True):
            np.testing.assert_allclose(np.broadcast_to(a, good.shape)[good], b[good], rtol=0, atol=1e-11)
    assert np.max(np.broadcast_to(group.closure(pose), good.shape)[good]) < 1e-12
    near = group.position(case.elements, [q + 1e-4 for q in case.guess()], case.drive)
    for frame, expected in zip(near.frames, case.frames, strict=True):
        np.testing.assert_allclose(np.broadcast_to(frame.x, good.shape)[good], expected.x[good], rtol=0, atol=1e-10)


@pytest.mark.parametrize("name", TOPOLOGIES)
def test_general_motion_is_the_derivative_of_its_position(name: str) -> None:
    """Outer links and drives move along t; frames differentiated by nested duals in t give the same motion."""
    group = TOPOLOGIES[name]
    case, pose, good = regular(group, 300, 2)
    twists_out, seconds_out = case.outer(), case.outer()
    rates = [case.rng.normal(size=300) for _ in group.driven]
    seconds = [case.rng.normal(size=300) for _ in group.driven]
    zero = np.zeros(300)

    def along(value: Array, rate: Array, second: Array) -> Dual:
        """value + rate t + second t²/2 with t seeded twice."""
        return Dual(Dual(value, rate), Dual(rate, second))

    moved = []
    for joint, pair, v, a in zip(group.joints, case.elements, twists_out, seconds_out, strict=True):
        sides = []
        for link, element in zip(joint.sides, pair, strict=True):
            if link != OUTER:
                sides.append(element)
                continue
            c, s = element.c, element.s
            ww = v.w * v.w
            speed, second = velocity_at(v, element[:2]), acceleration_at(v, a, element[:2])
            sides.append(
                Frame(
                    along(element.x, speed[0], second[0]),
                    along(element.y, speed[1], second[1]),
                    along(c, -v.w * s, -a.w * s - ww * c),
                    along(s, v.w * c, a.w * c - ww * s),
                )
            )
        moved.append(tuple(sides))
    drive = [along(q, r, b) for q, r, b in zip(case.drive, rates, seconds, strict=True)]
    curve = group.position(moved, case.guess(), drive)
    for frame, placed, twist, change in zip(
        curve.frames, pose.frames, *group.moved(pose, twists_out, seconds_out, rates, seconds), strict=True
    ):
        speed, second = velocity_at(twist, placed[:2]), acceleration_at(twist, change, placed[:2])
        for i in (0, 1):
            first = primal(derivative(frame[i]))
            both = derivative(derivative(frame[i]))
            np.testing.assert_allclose((speed[i] + zero)[good], (first + zero)[good], rtol=1e-8, atol=1e-8)
            size = 1 + np.abs(both + zero)
            assert np.all((np.abs(second[i] - both) <= 1e-7 * size)[good])
        c, s = primal(frame.c), primal(frame.s)
        turn = c * primal(derivative(frame.s)) - s * primal(derivative(frame.c))
        np.testing.assert_allclose((twist.w + zero)[good], (turn + zero)[good], rtol=1e-8, atol=1e-8)


@pytest.mark.parametrize("name", TOPOLOGIES)
def test_general_reactions_balance_every_link(name: str) -> None:
    """Force and moment on each link are zero, passive components vanish, each reaction at its stated point."""
    group = TOPOLOGIES[name]
    case, pose, good = regular(group, 300, 3)
    loads = case.loads()
    reactions = group.reactions(pose, loads)
    total = [[load.x, load.y, load.m] for load in loads]
    for k, (joint, wrench) in enumerate(zip(group.joints, reactions, strict=True)):
        first, second = (
            element if link == OUTER else compose(case.frames[link], element)
            for link, element in zip(joint.sides, case.elements[k], strict=True)
        )
        for link, sign in ((joint.sides[1], 1.0), (joint.sides[0], -1.0)):
            if link == OUTER:
                continue
            total[link][0] = total[link][0] + sign * wrench.x
            total[link][1] = total[link][1] + sign * wrench.y
            total[link][2] = total[link][2] + sign * moment_at(wrench, (-second.x, -second.y))
        if k not in group.driven:
            free = wrench.m if joint.kind == "revolute" else wrench.x * first.c + wrench.y * first.s
            assert np.all(np.abs(free + np.zeros(300))[good] < 1e-9), f"joint {k} resists its own freedom"
    size = size_of(reactions, 300)
    for link in total:
        for component in link:
            assert np.all((np.abs(component) < 1e-11 * size)[good])


@pytest.mark.parametrize("name", TOPOLOGIES)
def test_general_balances_power(name: str) -> None:
    """Virtual power: loads on the links' motion, reactions on outer elements, drive efforts on their rates."""
    group = TOPOLOGIES[name]
    case, pose, good = regular(group, 300, 4)
    outer = case.outer()
    rates = [case.rng.normal(size=300) for _ in group.driven]
    (twists, _), loads = group.moved(pose, outer, outer, rates, rates), case.loads()
    reactions = group.reactions(pose, loads)
    power: Any = sum(
        load.x * twist.x + load.y * twist.y + load.m * twist.w for load, twist in zip(loads, twists, strict=True)
    )
    for k, (joint, wrench) in enumerate(zip(group.joints, reactions, strict=True)):
        first, second = pose.elements[k][:2]
        if OUTER in joint.sides:
            side, (x, y) = joint.sides.index(OUTER), velocity_at(outer[k], second[:2])
            given_power = wrench.x * x + wrench.y * y + wrench.m * outer[k].w
            power = power + (given_power if side == 0 else -given_power)
        if k in group.driven:
            effort = wrench.m if joint.kind == "revolute" else wrench.x * first.c + wrench.y * first.s
            power = power + effort * rates[group.driven.index(k)]
    scale = size_of(reactions, 300) * size_of(twists, 300)
    assert np.all((np.abs(power) < 1e-10 * scale)[good])


def table_case(kind: str, lanes: int) -> tuple[Any, General, Case]:
    """An entry of the table, the general group of the same joints, and random poses of it."""
    general = dyad(kind)
    return GROUPS[kind], general, Case(general, lanes, 21)


@pytest.mark.parametrize("kind", GROUPS)
def test_every_entry_equals_the_general_group(kind: str) -> None:
    """Whatever is in the table: same motion and reactions as the general group, by duals as well."""
    lanes = 400
    closed, general, case = table_case(kind, lanes)
    pose = general.position(case.elements, case.guess())
    good = np.broadcast_to(pose.condition, (lanes,)) < 300
    found = [closed.position(case.elements, branch) for branch in (1, -1)]
    hit = np.zeros(lanes, bool)
    outer, loads = (case.outer(), case.outer()), case.loads()
    expected = [pose.frames, *general.moved(pose, *outer), general.reactions(pose, loads)]
    for one in found:
        here = good & np.all(
            [np.abs(a.x - b.x) + np.abs(a.c - b.c) < 1e-6 for a, b in zip(one.frames, case.frames, strict=True)], axis=0
        )
        hit |= here
        actual = [one.frames, *closed.moved(one, *outer), closed.reactions(one, loads)]
        for a, b in zip(actual, expected, strict=True):
            same(a, b, np.where(here, size_of(b, lanes) * np.where(here, pose.condition, 1.0), np.inf))
        assert np.all(np.broadcast_to(closed.closure(one), (lanes,))[here] < 1e-12)
        assert np.all(np.broadcast_to(closed.condition(one), (lanes,))[here] < 1e4)
    assert np.count_nonzero(hit) == np.count_nonzero(good), "each pose belongs to one of the branches"


@given(st.floats(0.2, 3), st.floats(0.2, 3), st.floats(-np.pi, np.pi), st.floats(0.1, 3.0), st.sampled_from([1, -1]))
def test_meet(bc: float, cd: float, turn: float, bend: float, branch: int) -> None:
    """The pin found lies on both circles and on the stated side, from a triangle built the other way round."""
    b = (0.3, -0.7)
    c = (b[0] + bc * np.cos(turn), b[1] + bc * np.sin(turn))
    d = (c[0] + cd * np.cos(turn + np.pi - bend), c[1] + cd * np.sin(turn + np.pi - bend))
    x, y = meet(b, d, bc, cd, branch)
    assert np.hypot(x, y) == pytest.approx(bc, rel=1e-9)
    assert np.hypot(b[0] + x - d[0], b[1] + y - d[1]) == pytest.approx(cd, rel=1e-7)
    side = (d[0] - b[0]) * y - (d[1] - b[1]) * x
    assert side * branch > 0


@pytest.mark.parametrize("inward", [False, True])
def test_circles_that_miss_each_other_by_a_nanometre_do_not_meet(inward: bool) -> None:
    """Only what rounding leaves of a dead centre counts as one; beyond, however little, there is no position."""
    bc, cd = 1.0, 0.5
    centre = bc - cd if inward else bc + cd
    for gap, meets in ((-1e-9, True), (0.0, True), (1e-12, False), (1e-9, False), (1e-7, False)):
        with np.errstate(invalid="ignore"):
            found = meet((0.0, 0.0), (centre - gap if inward else centre + gap, 0.0), bc, cd, 1)
        assert bool(np.all(np.isfinite(found))) == meets, gap


@pytest.mark.parametrize("name", ["RRP", "triad", "cylinder driven"])
def test_general_does_not_mind_its_neighbours(name: str) -> None:
    """A lane solved alone has the pose and the condition that it has in a batch."""
    group = TOPOLOGIES[name]
    case, pose, good = regular(group, 40, 5)
    for i in np.flatnonzero(good)[:8]:
        elements = [tuple(Frame(*(np.asarray(n)[i] for n in f)) for f in pair) for pair in case.elements]
        alone = group.position(elements, [q[i] for q in case.guess()], [q[i] for q in case.drive])
        for one, both in zip(alone.frames, pose.frames, strict=True):
            for a, b in zip(one, both, strict=True):
                assert float(a) == pytest.approx(float(np.asarray(b)[i]), abs=1e-11)
        assert float(alone.condition) == pytest.approx(float(np.asarray(pose.condition)[i]), rel=1e-9)
