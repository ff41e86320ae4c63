"""Assemblies chosen by name: which there are, that a name gives exactly the listed one, and what a wrong name is told.

The assemblies of the class III group are counted by other means: the plate's angle is swept, P and Q are placed by two
circles, and what remains, the length of the third rod, is looked at for changes of sign.
"""

import copy
import re

import numpy as np
import pytest
from benchmarks.drawn import planar, spatial
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import trunnion
from brief import brief
from mechanisms import MODELS, analyse, build, class_three, findings, four_bar
from mechanisms_parts import corner, example, joined
from timed import PARALLELOGRAM, driven_four_bar
from trunnion import Mechanism, MechanismError
from trunnion.algebra.namespace import flat
from trunnion.errors import Severity
from trunnion.solve.assembly_modes import choices, put_together
from trunnion.solve.hints import hints
from trunnion.solve.run import prepare
from trunnion.views.assembly import places

START = np.array([0.0])


def named(data, **assembly):
    """The data with assemblies chosen by name alone."""
    return {**copy.deepcopy(data), "assembly": assembly}


def choice_of(data):
    (choice,) = trunnion.check(build(data), 12).choices
    return choice


@pytest.mark.parametrize(("link", "name", "side"), [("coupler", "way-1", 1.0), ("rocker", "way-2", -1.0)])
def test_the_ways_of_a_four_bar_are_those_chosen_by_place(link, name, side):
    by_name, by_place = (analyse(data, 24) for data in (named(four_bar(), **{link: name}), four_bar(side=side)))
    for variable in ("point_position", "drive_effort", "reaction_force"):
        assert np.array_equal(by_name[variable], by_place[variable], equal_nan=True)
    assert not [one for one in findings(by_name) if one["where"].startswith("assembly")]


def test_the_list_of_a_four_bar_is_the_two_meets_of_two_circles():
    """B = (0.3, 0), D = (1, 0): C at distance 0.9 from B and 0.7 from D."""
    choice = choice_of(four_bar())
    along = (0.9**2 - 0.7**2 + 0.7**2) / (2 * 0.7)
    across = np.sqrt(0.9**2 - along**2)
    assert (choice.label, choice.links, choice.link) == ("II(2,3)RRR", ("coupler", "rocker"), "coupler")
    assert not choice.where
    assert [way.name for way in choice.ways] == ["way-1", "way-2"]
    assert [way.taken for way in choice.ways] == [True, False]
    assert [way.joints["C"] for way in choice.ways] == [
        pytest.approx((0.3 + along, across), abs=1e-12), pytest.approx((0.3 + along, -across), abs=1e-12)
    ]  # fmt: skip
    assert choice.line(choice.ways[1]) == "assembly: {coupler: way-2}"


@pytest.mark.spread(2)
@pytest.mark.parametrize("name", MODELS)
def test_every_listed_way_is_what_its_name_gives(name):
    """The joints lie where the list says, and nothing is left to say about the choice."""
    mechanism = build(MODELS[name]())
    for choice in trunnion.check(mechanism, 12).choices:
        assert sum(way.taken for way in choice.ways) == 1
        for way in choice.ways:
            run = prepare(put_together(mechanism, choice, way))
            walk = run.solve(np.array([choice.time])).walk
            for joint, place in way.joints.items():
                first, second = run.system.joints[joint].links
                one, two = walk.element(first, joint), walk.element(second, joint)
                slide = [one.c * (two.x - one.x) + one.s * (two.y - one.y)]
                found = [one.x, one.y] if len(place) == 2 else slide
                assert [float(np.ravel(n)[0]) for n in found] == pytest.approx(place, abs=1e-9)


def test_a_start_in_line_is_listed_where_its_ways_are_apart():
    """A parallelogram that starts in line: at the start both ways put C on one spot."""
    choice = choice_of(four_bar(0.3, 1.0, 0.3, 1.0))
    assert choice.where == "1° of A"
    places = [np.array(way.joints["C"]) for way in choice.ways]
    assert np.hypot(*(places[0] - places[1])) > 1e-3


def test_the_ways_of_a_class_three_group_are_all_there_are():
    """Angles of the plate at which the third rod has its length, P by the lengths of the other two."""
    turn = np.linspace(-np.pi, np.pi, 3601)
    expected = []
    for side in (1, -1):
        p = corner(0.1, 1.4 - 0.15j - 0.6 * np.exp(1j * turn), 0.8485, 0.7566, side)
        gap = np.abs(p + (0.25 + 0.5j) * np.exp(1j * turn) - (0.55 + 1.9j)) - 0.8944
        crossed = np.flatnonzero(gap[:-1] * gap[1:] < 0)
        expected += list(turn[crossed] + gap[crossed] / (gap[crossed] - gap[crossed + 1]) * (turn[1] - turn[0]))
    choice, angles = choice_of(class_three()), []
    for way in choice.ways:
        p, q, r = (complex(*way.joints[pin]) for pin in "PQR")
        assert abs(p - 0.1) == pytest.approx(0.8485, abs=1e-12)
        assert abs(q - (1.4 - 0.15j)) == pytest.approx(0.7566, abs=1e-12)
        assert abs(r - (0.55 + 1.9j)) == pytest.approx(0.8944, abs=1e-12)
        assert (r - p) / (q - p) == pytest.approx((0.25 + 0.5j) / 0.6, abs=1e-12)
        angles.append(float(np.angle(q - p)))
    assert sorted(angles) == pytest.approx(sorted(expected), abs=1e-4)


@pytest.mark.spread(1)
@pytest.mark.parametrize(("model", "link", "pin"), [(four_bar, "rocker", "C"), (class_three, "plate", "P")])
def test_a_name_beats_a_place_and_says_so(model, link, pin):
    data = model()
    by_place = next(way for way in choice_of(data).ways if way.taken)
    for way in choice_of(data).ways:
        both = {**data, "assembly": {pin: data["assembly"][pin], link: way.name}}
        assert [one.name for one in choice_of(both).ways if one.taken] == [way.name]
        found = [one.severity for one in trunnion.check(build(both), 12).findings if one.where == f"assembly.{link}"]
        assert found == ([] if way.name == by_place.name else [Severity.WARNING])


def stated(text):
    """The places, slides and turns of a printed way, as they would be written into a model file."""
    unit = text.partition(";")[0].rpartition(" ")[2]
    points = {name: [f"{n} {unit}" for n in row.split(", ")] for name, row in re.findall(r"(\S+) \(([^)]*)\)", text)}
    slides = {name: f"{n} {unit}" for name, n in re.findall(r"(\S+) at (-?[\d.e+-]+)", text)}
    turns = {name: f"{n} deg" for name, n in re.findall(r"(\S+) (-?[\d.e+-]+)°", text)}
    return {**points, **slides, **turns}


def selected_by_what_is_printed(mechanism):
    """How many ways are listed; each is selected, and nothing left undecided, by its printed places alone."""
    run, count = prepare(mechanism), 0
    data = mechanism.data()
    for choice in choices(run):
        module = run.system.plan.modules[choice.module]
        used = {key for link, name, _ in hints(run.walk(START), module) for key in (name, f"{link}.{name}")}
        others = {key: hint for key, hint in data.get("assembly", {}).items() if key not in {*used, *choice.links}}
        for way in choice.ways:
            again = prepare(Mechanism(**{**data, "assembly": {**others, **stated(places(choice, way))}}))
            same = next(listed for listed in choices(again) if listed.links == choice.links)
            assert [listed.name for listed in same.ways if listed.taken] == [way.name]
            undecided = [one for one in again.chosen.findings if one.code == "assembly.choice"]
            assert list(choice.links) not in [one.figures["links"] for one in undecided]
            count += 1
    return count


@pytest.mark.spread(1)
@pytest.mark.parametrize("space", [planar, spatial], ids=["planar", "spatial"])
@given(seed=st.integers(0, 10**6))
@settings(max_examples=4, deadline=None)
def test_the_printed_places_of_a_way_of_any_mechanism_select_it(space, seed):
    _, data = space.drawn(seed)
    try:
        mechanism = Mechanism(**data)
        prepare(mechanism)
    except MechanismError:
        assume(False)
    selected_by_what_is_printed(mechanism)


@pytest.mark.slow
@given(turn=st.floats(-1e-3, 1e-3), crank=st.floats(0.1, 0.5), longer=st.sampled_from([0.0, 1e-9, 1e-6, 1e-3, 0.1]))
@settings(max_examples=15, deadline=None)
def test_ways_that_nearly_meet_are_told_apart(turn, crank, longer):
    """A linkage that starts in line, or nearly so, or only closes farther on, has as many digits as it takes."""
    data = named(four_bar(crank, 0.7, 0.6, 1.3 - crank + longer))
    data["drivers"]["A"]["start"] = float(np.pi + turn)
    assert selected_by_what_is_printed(build(data)) == 2


@pytest.mark.slow
@pytest.mark.parametrize("name", ["swash-plate-pump", "double-cardan"])
def test_the_turn_of_a_universal_joint_is_a_hint(name):
    """Its place is the same in several ways; its turn about its first pin is not."""
    mechanism = example(name)
    (choice,) = trunnion.check(mechanism, 12).choices
    assert any(mechanism.joints[joint].type == "universal" for joint in choice.ways[0].turns)
    assert selected_by_what_is_printed(mechanism) == len(choice.ways)


@pytest.mark.spread(1)
@pytest.mark.parametrize(("name", "share"), [("four-bar", 0.7), ("class III", 0.7), ("in space", 0.2)])
def test_a_hint_holds_where_its_driver_is(name, share):
    """Of every assembly the places at a position of the driver select it, though at the start others are nearer."""
    (a, b, c, d), at = PARALLELOGRAM
    models = {"four-bar": lambda: build(four_bar()), "class III": lambda: build(class_three()),
              "in space": lambda: driven_four_bar("spatial", (a, b, c + 0.1, d), at)}  # fmt: skip
    data = models[name]().data()
    data.pop("assembly", None)
    (choice,) = trunnion.check(Mechanism(**data), 12).choices
    joint = next((joint for joint, place in choice.ways[0].joints.items() if len(place) > 1), "C")
    driver = next(iter(data["drivers"]))
    for way in choice.ways:
        run = prepare(Mechanism(**{**data, "assembly": {choice.link: way.name}}))
        time = np.array([share * run.cycle.duration])
        place = run.solve(time).walk.point(run.system.joints[joint].links[1], joint).place
        stated = [float(np.ravel(part)[0]) for part in place]
        at = float(np.ravel(run.system.drive(run.values, driver, time)[0])[0])
        hinted = prepare(Mechanism(**{**data, "assembly": {joint: stated, "at": at}}))
        times = np.linspace(0.0, run.cycle.duration, 7)[:-1] + 0.01
        for link in choice.links:
            ours, theirs = (each.solve(times).walk.motions[link].frame for each in (run, hinted))
            for is_, was in zip(flat(theirs), flat(ours), strict=True):
                np.testing.assert_allclose(is_, was, atol=1e-9)


def jacked(first, **tube):
    """An arm on a hinge that a driven strut holds: universal or ball, slide, ball."""
    hinge, slide = {"at": [0, 0, 0], "axis": [0, 1, 0]}, {"at": [0, 0, 0], "axis": [1, 0, 0]}
    cross = first == "universal"
    return Mechanism(
        space="spatial",
        links={
            "ground": {"points": {"H": hinge, "U": {"at": [0.1, 0.3, 0.8], **({"axis": [0, 1, 0]} if cross else {})}}},
            "arm": {"points": {"H": hinge, "L": [0.5, 0.05, 0.1], "W": [0.6, 0, 0.05]}},
            "tube": {"points": {"U": {"at": [0, 0, 0], **({"axis": [0, 0, 1]} if cross else {})}, "T": slide}, **tube},
            "rod": {"points": {"T": slide, "L": [0.1, 0, 0]}},
        },
        joints=joined(f"ground -H- arm, ground -U:{first}- tube =T= rod, arm -L:spherical- rod"),
        drivers={"T": {"speed": 0.1, "range": [0.65, 0.75]}},
        loads={"w": {"link": "arm", "at": "W", "force": [10, 20, -300]}},
    )  # fmt: skip


@pytest.mark.slow
def test_half_turns_of_a_strut_are_no_assemblies_of_their_own():
    """The ball of the arm meets a sphere about U on two places; a cross holds the tube in two turns at each."""
    (choice,) = trunnion.check(jacked("universal"), 12).choices
    (spins,) = trunnion.check(jacked("spherical"), 12).choices
    balls = [np.array([way.joints["L"] for way in of.ways]) for of in (choice, spins)]
    np.testing.assert_allclose(balls[0], balls[1], atol=1e-9)
    assert len(balls[0]) == 2
    heavy = jacked("universal", mass=1.0, centre=[0.1, 0, 0])
    assert len(trunnion.check(heavy, 12).choices[0].ways) == 4
    for way in choice.ways:
        held, spun = (
            brief(put_together(jacked(first), of, way), 5)
            for first, of in (("universal", choice), ("spherical", spins))
        )
        np.testing.assert_allclose(held["drive_effort"], spun["drive_effort"], rtol=1e-9)


JOINTS = {"S": "spherical", "R": "revolute", "P": "prismatic", "C": "cylindrical", "U": "universal"}


def drawn(seed):
    """A linkage that grows by groups between random points, drawn in one frame for all its links.

    Every third in space; some begin before or after where they are drawn.
    """
    rng, spatial = np.random.default_rng(seed), seed % 3 == 2
    size, last = 3 if spatial else 2, "crank"
    links = {"ground": {}}
    joints = {}

    def add(kind, *ends):
        """A joint at a random place, on both links alike."""
        name, place = f"{kind}{len(joints)}", rng.uniform(-1, 1, size).tolist()
        axes = [{}, {}]
        if (spatial and kind != "S") or kind == "P":
            axis = rng.normal(size=size)
            other = np.cross(axis, rng.normal(size=size)) if kind == "U" else axis
            axes = [{"axis": axis.tolist()}, {"axis": other.tolist()}]
        joints[name] = {"type": JOINTS[kind], "links": list(ends)}
        for link, more in zip(ends, axes, strict=True):
            links.setdefault(link, {})[name] = {"at": place, **more} if more else place

    def anchor():
        return str(rng.choice(list(links)))

    add("R", "ground", "crank")
    for _ in range(1 if spatial else int(rng.integers(1, 4))):
        if not spatial and rng.random() < 0.3:  # a link on three rods
            body = f"link-{len(links)}"
            for k, base in enumerate([last, anchor(), "ground"]):
                rod = f"rod-{len(links)}-{k}"
                add("R", base, rod)
                add("R", rod, body)
            last = body
        else:  # two links, one on the last that moves, the other on any
            kinds = rng.choice(["SSR", "USR", "SCR", "CCC", "RSC"] if spatial else ["RRR", "RRP", "PRR", "RPR"])
            first, second = f"link-{len(links)}", f"link-{len(links) + 1}"
            for kind, ends in zip(kinds, ((last, first), (first, second), (anchor(), second)), strict=True):
                add(str(kind), *ends)
            last = second
    start = float(rng.choice([0.0, 0.0, -0.02, 0.02]))
    return Mechanism(
        space="spatial" if spatial else "planar",
        links={link: {"points": points} for link, points in links.items()},
        joints=joints,
        drivers={next(iter(joints)): {"speed": 1.0, "range": [start, start + 0.3]}},
    )


@pytest.mark.parametrize(("first", "count"), [(0, 12), pytest.param(12, 30, marks=pytest.mark.slow)])
def test_random_linkages_are_assembled_as_drawn(first, count):
    """Where the driver is as drawn, the frames of all links coincide; without a warning that one had to choose."""
    looked = 0
    for seed in range(first, first + count):
        run = prepare(drawn(seed))
        start = float(run.values[next(path for path in run.values if path.endswith("range.from"))])
        if start > 0.0:
            continue
        assert not any(one.code == "assembly.choice" for one in run.chosen.findings), seed
        walk = run.walk(np.array([-start]))
        same = [*np.eye(3).ravel(), 0.0, 0.0, 0.0] if walk.system.spatial else [0.0, 0.0, 1.0, 0.0]
        for link, motion in walk.motions.items():
            if not any(link in spin for module in run.system.plan.modules for spin in module.spinning):
                values = [float(np.ravel(n)[0]) for n in flat(motion.frame)]
                np.testing.assert_allclose(values, same, atol=1e-7, err_msg=f"{seed} {link}")
        looked += 1
    assert looked > 0.6 * count
