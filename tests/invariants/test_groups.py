"""Groups by themselves: closed forms against the general group, which is held against finite differences and power."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mechanisms import Array, dyad
from trunnion.algebra.dual import Dual, derivative, primal
from trunnion.algebra.plane import Frame, Twist, Wrench, acceleration_at, compose, velocity_at
from trunnion.groups import GROUPS
from trunnion.groups.dyads import meet
from trunnion.groups.general import General
from trunnion.groups.tree import OUTER, GroupJoint


class Case:
    """Random poses of a group, built forward so that they close: link frames first, then elements to fit them."""

    def __init__(self, group, lanes, seed, spread=1.0, offset=0.0):
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

    def _on(self, link, element):
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

    def guess(self):
        """Free tree coordinates of the pose it was built from."""
        found = []
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

    def outer(self):
        """Random twist, or derivative of one, of every outside link, a different one for each joint."""
        return [
            Twist(*self.rng.normal(size=(3, self.lanes))) if OUTER in joint.sides else None
            for joint in self.group.joints
        ]

    def loads(self):
        return [Wrench(*self.rng.normal(size=(3, self.lanes))) for _ in range(self.group.links)]


def same(a, b, weight, tolerance=1e-10):
    """Equal lane by lane, as a share of the lane's scale times its condition."""
    for one, two in zip(a, b, strict=True):
        for x, y in zip(one, two, strict=True):
            difference = np.abs(np.broadcast_to(x, weight.shape) - np.broadcast_to(y, weight.shape))
            assert np.all(difference <= tolerance * weight), float(np.max(difference / weight))


def joined(text, *driven):
    """A group by its joints: kind and both links, x the outside; driven: places of the driven joints."""
    kinds = {"R": "revolute", "P": "prismatic"}
    links = [(one, two) for _, one, two in text.split()]
    places = [tuple(OUTER if link == "x" else int(link) for link in pair) for pair in links]
    joints = tuple(GroupJoint(kinds[word[0]], pair) for word, pair in zip(text.split(), places, strict=True))
    return General(1 + max(link for pair in places for link in pair), joints, driven)


TOPOLOGIES = {
    **{letters: dyad(letters) for letters in ("RRR", "RRP", "PRR", "RPR", "PRP", "RPP", "PPR")},
    "turned sides": joined("R0x P10 R1x"), "triad": joined("R30 R31 R32 Rx0 Rx1 Rx2"),
    "triad with slides": joined("R03 P31 R23 Px0 R1x Rx2"), "closed contour": joined("R01 R12 R23 R30 Rx0 Rx2"),
    "cylinder driven": joined("Rx0 P01 R12 R2x", 1), "inner pin driven": joined("Rx0 R01 R21 R2x", 2),
    "two driven": joined("R0x P10 R12 P23 R3x", 3, 1), "R driver": joined("Rx0", 0), "P driver": joined("Px0", 0),
    "P driver, turned": joined("P0x", 0),
}  # fmt: skip


@pytest.mark.parametrize("name", TOPOLOGIES)
def test_general_motion_is_the_derivative_of_its_position(name):
    """Outer links and drives move along t; frames differentiated by nested duals in t give the same motion."""
    group = TOPOLOGIES[name]
    case = Case(group, 300, 2)
    pose = group.position(case.elements, case.guess(), case.drive)
    good = np.broadcast_to(pose.condition, (300,)) < 300
    twists_out, seconds_out = case.outer(), case.outer()
    rates = [case.rng.normal(size=300) for _ in group.driven]
    seconds = [case.rng.normal(size=300) for _ in group.driven]
    zero = np.zeros(300)

    def along(value, rate, second):
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


@pytest.mark.parametrize("offset", [0.0, 100.0])
@pytest.mark.parametrize("kind", GROUPS)
def test_every_entry_equals_the_general_group(kind, offset):
    """Whatever is in the table: same motion and reactions as the general group, far from the origin too."""
    lanes = 2000
    closed, general = GROUPS[kind], dyad(kind)
    case = Case(general, lanes, 21, offset=offset)
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
            size = 1 + np.max([np.abs(np.broadcast_to(n, (lanes,))) for item in b for n in item], axis=0)
            same(a, b, np.where(here, (1 + offset) * size * np.where(here, pose.condition, 1.0), np.inf))
        assert np.all(np.broadcast_to(closed.closure(one), (lanes,))[here] < 1e-12 * (1 + offset))
        assert np.all(np.broadcast_to(closed.condition(one), (lanes,))[here] < 1e4)
    assert np.count_nonzero(hit) == np.count_nonzero(good), "each pose belongs to one of the branches"


@given(st.floats(0.2, 3), st.floats(0.2, 3), st.floats(-np.pi, np.pi), st.floats(0.1, 3.0), st.sampled_from([1, -1]))
def test_meet(bc, cd, turn, bend, branch):
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
def test_circles_that_miss_each_other_by_a_nanometre_do_not_meet(inward):
    """Only what rounding leaves of a dead centre counts as one; beyond, however little, there is no position."""
    bc, cd = 1.0, 0.5
    centre = bc - cd if inward else bc + cd
    for gap, meets in ((-1e-9, True), (0.0, True), (1e-12, False), (1e-9, False), (1e-7, False)):
        with np.errstate(invalid="ignore"):
            found = meet((0.0, 0.0), (centre - gap if inward else centre + gap, 0.0), bc, cd, 1)
        assert bool(np.all(np.isfinite(found))) == meets, gap
