"""Spatial groups by themselves: pairs in motion, closed form and general group, derivatives, balance of forces."""

from pathlib import Path

import numpy as np
import pytest

from brief import brief
from trunnion import Mechanism
from trunnion.algebra.namespace import flat
from trunnion.algebra.space import Screw, compose, element, relative
from trunnion.groups.cylindrical_dyad import CylindricalDyad
from trunnion.groups.spatial import SpatialGroup
from trunnion.groups.tree import OUTER, Element, GroupJoint
from trunnion.joints import pairs

LANES = 400
MOTIONS = pairs.MOTIONS["spatial"]
LEAD = 0.013


def random_frame(rng, lanes=1, reach=1.0):
    """Any frame; plain numbers for one lane."""
    shape = () if lanes == 1 else (lanes,)
    place, axis, x = (tuple(rng.normal(size=shape) for _ in range(3)) for _ in range(3))
    return element(tuple(reach * n for n in place), axis, x)


def numbers(value):
    return np.array(np.broadcast_arrays(*flat(value)), float)


# the cylindrical dyad
def dyad(sides):
    """Three cylindrical joints and their elements: random links between random known axes that they can reach."""
    rng = np.random.default_rng(len(sides) + sum(map(sum, sides)))
    joints = tuple(GroupJoint("cylindrical", pair) for pair in sides)
    links = [[random_frame(rng, LANES) for _ in range(2)] for _ in range(2)]
    # where the links are: then the known axes follow, so that the dyad closes
    frames = [random_frame(rng, LANES) for _ in range(2)]
    b = compose(frames[0], links[0][0])
    c0 = compose(frames[0], links[0][1])
    turn, slide = rng.uniform(-3, 3, LANES), rng.normal(size=LANES)
    frames[1] = relative(MOTIONS["cylindrical"].place(c0, [turn, slide], 0.0), links[1][0])
    d = compose(frames[1], links[1][1])
    known = [
        MOTIONS["cylindrical"].place(one, [rng.uniform(-3, 3, LANES), rng.normal(size=LANES)], 0.0) for one in (b, d)
    ]
    by_link = [{OUTER: known[0], 0: links[0][0]}, {0: links[0][1], 1: links[1][0]}, {OUTER: known[1], 1: links[1][1]}]
    return joints, [Element(by[one], by[two]) for by, (one, two) in zip(by_link, sides, strict=True)]


SIDES = [((OUTER, 0), (0, 1), (1, OUTER)), ((0, OUTER), (1, 0), (OUTER, 1)), ((OUTER, 0), (1, 0), (OUTER, 1))]


@pytest.mark.parametrize("sides", SIDES)
def test_the_closed_form_of_the_dyad_is_the_general_group(sides):
    joints, elements = dyad(sides)
    closed, general = CylindricalDyad(2, joints), SpatialGroup(2, joints)
    rng = np.random.default_rng(3)
    outer = [Screw(tuple(rng.normal(size=3)), tuple(rng.normal(size=3))) for _ in range(2)]
    outer_second = [Screw(tuple(rng.normal(size=3)), tuple(rng.normal(size=3))) for _ in range(2)]
    known = [outer[0], None, outer[1]]
    known_second = [outer_second[0], None, outer_second[1]]
    loads = [Screw(tuple(rng.normal(size=3)), tuple(rng.normal(size=3))) for _ in range(2)]
    solved = 0
    for branch in (1, -1):
        pose = closed.position(elements, branch)
        sound = np.isfinite(pose.gap) & (pose.condition < 1e3)
        assert np.mean(sound) > 0.8
        assert np.max(pose.gap[sound]) < 1e-12
        other = general.position(elements, [q + 1e-3 for q in pose.q])
        same = sound & np.isfinite(other.gap) & (np.abs(np.subtract(other.q, pose.q)).max(axis=0) < 0.1)
        solved += int(np.count_nonzero(same))
        found, wanted = (
            answers(closed, pose, known, known_second, loads),
            answers(general, other, known, known_second, loads),
        )
        scale = np.max(np.abs(wanted[:, same]), axis=0)
        assert np.max(np.abs(found[:, same] - wanted[:, same]) / scale) < 1e-10
    assert solved > LANES


def answers(group, pose, outer, outer_second, loads):
    """Everything that a group finds, (number, lane)."""
    twists, seconds = group.moved(pose, outer, outer_second)
    return numbers((pose.frames, tuple(twists), tuple(seconds), tuple(group.reactions(pose, loads))))


# a link between two balls
@pytest.mark.spread(1)
@pytest.mark.parametrize("reversed_", [False, True])
def test_a_link_with_a_free_spin_moves_as_it_is_said_to(reversed_):
    """A point off the line of its balls has the velocity of its places: the link does not spin on the way."""
    data = Mechanism.read(Path(__file__).parents[2] / "examples" / "rssr.yaml").data()
    data["links"]["rod"]["points"]["P"] = [0.05, 0.02, 0.01]
    if reversed_:
        for joint in ("B", "C"):
            data["joints"][joint]["links"] = data["joints"][joint]["links"][::-1]
    result = brief(Mechanism(**data), 2000)
    place, speed = (result[f"point_{what}"].sel(point="rod.P").values for what in ("position", "velocity"))
    found = (place[:, 2:] - place[:, :-2]) / (2 * float(result["time"][1] - result["time"][0]))
    assert np.max(np.abs(found - speed[:, 1:-1])) < 2e-4 * np.max(np.abs(speed))
    assert float(result["closure_residual"].max()) < 1e-14
