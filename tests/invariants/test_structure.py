"""Decomposition: order of modules, class, formula, what is said where drivers do not determine the motion; graphs."""

import numpy as np
import pytest
from benchmarks.studio import chain
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components, maximum_bipartite_matching

import trunnion
from mechanisms import MODELS, build, four_bar, model
from mechanisms_parts import joined
from trunnion import Mechanism, MechanismError
from trunnion.model.file import entries_of
from trunnion.structure.decompose import decompose, mobility_by_rank
from trunnion.structure.graph import components, longest_loop, matching

FORMULAS = {
    "four-bar": "I(0,1)R → II(2,3)RRR", "four-bar, other branch": "I(0,1)R → II(2,3)RRR",
    "slider-crank": "I(0,1)R → II(2,3)RRP", "inverted slider-crank": "I(0,1)R → II(2,3)RPR",
    "Watt six-bar": "I(0,1)R → II(2,3)RRR → II(4,5)RRR", "Stephenson six-bar": "I(0,1)R → II(2,3)RRR → II(4,5)RRR",
    "class III": "I(0,1)R → III(2,3,4,5)RRRRRR", "five-bar": "I(0,1)R → I(0,2)R → II(3,4)RRR",
    "excavator": "II(1,2,3)RRR[P] → I(1,4)R", "serial arm": "I(0,1)R → I(1,2)P → I(2,3)R",
    "Scotch yoke": "I(0,1)R → II(2,3)RPP", "elliptic bar": "I(0,1)P → II(2,3)RRP",
    "tangent drive": "I(0,1)R → II(2,3)PRP", "geared five-bar": "I(0,1)R → II(4)RG → II(2,3)RRR",
    "planet drive": "I(0,1)R → II(2)RG → II(3,4)RRP", "geared loop": "I(0,1)R → II(2,3,4)RRRRG",
    "rocker train": "I(0,1)R → II(2,3)RRR → II(4)RG → II(5,6)RRP",
    "rack on a rocker": "I(0,1)R → II(2,3)RPR → II(4)RG", "rack in a loop": "I(0,1)R → III(2,3,4,5,6)RRRRPRRG",
    "screwed strut": "III(1,2,3,4)RRRP[R]G",
}  # fmt: skip


@pytest.mark.parametrize("name", MODELS)
def test_a_plan_has_its_formula_and_is_a_partition_in_causal_order(name):
    mechanism = build(MODELS[name]())
    plan = decompose(mechanism)
    assert plan.formula == FORMULAS[name]
    assert plan.mobility == len(mechanism.drivers)
    _check_plan(mechanism, plan)


def _check_plan(mechanism, plan):
    """Every link and joint once; every module hangs on the ground or on earlier links; each counts as a group."""
    links = [link for module in plan.modules for link in module.links]
    joints = [joint for module in plan.modules for joint in module.joints]
    assert sorted(links) == sorted(set(mechanism.links) - {mechanism.fixed_link})
    assert sorted(joints) == sorted(mechanism.joints)
    known = {mechanism.fixed_link}
    for module in plan.modules:
        for joint in module.joints:
            assert set(mechanism.joints[joint].links) <= known | set(module.links), (joint, module)
        assert 3 * len(module.links) == 2 * len(module.joints) + len(module.driven) + len(module.gears)
        known |= set(module.links)
    assert plan.formula == " → ".join(module.label for module in plan.modules)


def loose_chain(links, joints, drivers):
    """A planar mechanism of pins only, whose geometry does not matter."""
    rng = np.random.default_rng(0)
    data = {"links": {link: {"points": {}} for link in links}, "joints": {}, "drivers": {}}
    for k, pair in enumerate(joints):
        name = f"J{k}"
        for link in pair:
            data["links"][link]["points"][name] = list(rng.normal(size=2))
        data["joints"][name] = {"type": "revolute", "links": list(pair)}
    data["drivers"] = {f"J{k}": {"speed": 1.0} for k in drivers}
    return data


@pytest.mark.parametrize("seed", range(25))
def test_random_assur_chains(seed):
    """Mechanisms grown group by group from drivers, dyads and triads on random links come apart into these again."""
    rng = np.random.default_rng(seed)
    links, joints, drivers, expected = ["ground"], [], [], []
    for _ in range(rng.integers(2, 7)):
        kind = rng.choice(["driver", "dyad", "triad"]) if len(links) > 1 else "driver"
        new = [f"L{len(links) + i}" for i in range({"driver": 1, "dyad": 2, "triad": 4}[kind])]
        bases = [str(b) for b in rng.choice(links, {"driver": 1, "dyad": 2, "triad": 3}[kind])]
        if kind == "driver":
            drivers.append(len(joints))
            joints.append((bases[0], new[0]))
        elif kind == "dyad":
            if bases[0] == bases[1] and len(links) > 1:
                bases[1] = next(link for link in links if link != bases[0])
            joints += [(bases[0], new[0]), (new[0], new[1]), (new[1], bases[1])]
        else:
            if len(set(bases)) == 1:
                bases[2] = next(link for link in links if link != bases[0])
            joints += [(bases[i], new[i]) for i in range(3)] + [(new[i], new[3]) for i in range(3)]
        links += new
        expected.append(tuple(sorted(new)))
    order = rng.permutation(len(joints))
    shuffled = [joints[k] if rng.random() < 0.5 else joints[k][::-1] for k in order]
    data = loose_chain(links, shuffled, [int(np.flatnonzero(order == k)[0]) for k in drivers])
    mechanism = Mechanism(**data)
    plan = decompose(mechanism)
    _check_plan(mechanism, plan)
    assert sorted(tuple(sorted(module.links)) for module in plan.modules) == sorted(expected)
    ranks = {1: 1, 2: 2, 4: 3}
    assert [module.rank for module in plan.modules] == [ranks[len(module.links)] for module in plan.modules]


RING = [("ground", "crank"), ("a", "b"), ("b", "c"), ("c", "d"), ("d", "a"), ("crank", "a"), ("ground", "c")]
DRIVEN_ELSEWHERE = {  # the mechanism, its driver, the formula
    "a ring of four links, hung at two opposite ones": (
        loose_chain(["ground", "crank", *"abcd"], RING, [0]), "I(0,1)R → IV(2,3,4,5)RRRRRR"
    ),
    "Stephenson's at its other rocker": (
        MODELS["Stephenson six-bar"]() | {"drivers": {"G": {"speed": 1.0, "range": [0.0, 0.1]}}},
        "I(0,5)R → III(1,2,3,4)RRRRRR",
    ),
    "a pin between two moving links": (
        four_bar() | {"drivers": {"C": {"speed": 1.0, "range": [0.5, 1.0]}}}, "II(1,2,3)RR[R]R"
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", DRIVEN_ELSEWHERE)
def test_the_driver_decides_the_modules(name):
    data, formula = DRIVEN_ELSEWHERE[name]
    assert decompose(Mechanism(**model(data))).formula == formula


def parallelogram(third):
    """With a third crank, beside the two or off their line."""
    return {
        "links": {
            "ground": {"points": {"A": [0, 0], "D": [2, 0], "G": [1, third]}},
            "crank": {"points": {"A": [0, 0], "B": [0.5, 0]}},
            "coupler": {"points": {"B": [0, 0], "C": [2, 0], "H": [1, 0]}},
            "rocker": {"points": {"D": [0, 0], "C": [0.5, 0]}},
            "third": {"points": {"G": [0, 0], "H": [0.5, 0]}},
        },
        "joints": joined("ground -A- crank -B- coupler -C- rocker, ground -D- rocker, ground -G- third -H- coupler"),
        "drivers": {"A": {"speed": 1.0, "start": 0.5}},
        "assembly": {"C": [2.4, 0.2]},
    }


HELD_TWICE = [
    ("ground", "crank"), ("ground", "a"), ("a", "b"), ("b", "ground"), ("a", "ground"), ("crank", "c"), ("c", "d"),
]  # fmt: skip
WRONG = {  # and what is said
    "a five-bar with one driver": (
        model(MODELS["five-bar"]() | {"drivers": {"A": {"speed": 2.0}}}), ("mobility is 2", "one driver")
    ),
    "a four-bar with two": (
        model(four_bar() | {"drivers": {"A": {"speed": 4.0}, "D": {"speed": 1.0}}}), ("mobility is 1", "2 drivers")
    ),
    "no driver": (model(four_bar() | {"drivers": {}}), ("driver",)),
    "a link on three pins, a chain elsewhere loose: only the count is right": (
        loose_chain(["ground", "crank", *"abcd"], HELD_TWICE, [0]), ("twice", "c, d")
    ),
    "two links pinned twice to each other, swinging": (
        loose_chain(["ground", "crank", "a", "b"], [("ground", "crank"), ("crank", "a"), ("a", "b"), ("a", "b")], [0]),
        ("twice", "undetermined"),
    ),
    "a driver on what another determines": (
        loose_chain(
            ["ground", "crank", "coupler", "rocker", "arm"],
            [("ground", "crank"), ("crank", "coupler"), ("coupler", "rocker"), ("rocker", "ground"), ("rocker", "arm")],
            [0, 3],
        ),
        ("J3", "twice"),
    ),
    "a parallelogram of three cranks: it moves, but not by the formula": (parallelogram(0.0), ("mobility is 0",)),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG)
def test_what_is_not_determined_is_refused_with_its_cause(name):
    data, words = WRONG[name]
    with pytest.raises(MechanismError) as error:
        trunnion.analyse(Mechanism(**data), 4)
    assert all(word in str(error.value) for word in words), error.value


@pytest.mark.parametrize("shift", [0.0, 1e4, 1e6])
@pytest.mark.parametrize(("off", "mobility"), [(0.0, 1), (0.1, 0)])
def test_rank_of_a_parallelogram_of_three_cranks(shift, off, mobility):
    """Rank of the joints' constraints, taken alone: 1 where Grübler says 0, wherever the drawing has its origin."""
    c, s = 0.5 * np.cos(0.7), 0.5 * np.sin(0.7)
    at = {"A": (0, 0), "B": (c, s), "C": (2 + c, s), "D": (2, 0), "G": (1, off), "H": (1 + c, s)}
    joints = {name: ("revolute", tuple(joint["links"])) for name, joint in parallelogram(0.0)["joints"].items()}
    places = {name: (x + shift, y - shift, 1.0, 0.0) for name, (x, y) in at.items()}
    assert mobility_by_rank(["ground", "crank", "coupler", "rocker", "third"], "ground", joints, places) == mobility


@pytest.mark.spread(3)
@pytest.mark.parametrize("name", MODELS)
def test_check(name):
    """Both mobilities agree on ordinary linkages, and nothing is wrong with them."""
    found = trunnion.check(build(MODELS[name]()), 36)
    assert found.mobility == found.rank_mobility == len(MODELS[name]()["drivers"])
    assert not [f for f in found.findings if f.severity == "error"]
    assert len(found.assemblies) == len(found.plan.modules)


def test_mobility_by_rank_of_a_long_row():
    found = trunnion.check(Mechanism(**entries_of(chain(120))[0]), 1)
    assert found.mobility == found.rank_mobility == 1


COUNTS = st.integers(1, 12)


@st.composite
def relations(draw, square=False):
    """Which of n rows is related to which of m columns."""
    rows = draw(COUNTS)
    columns = rows if square else draw(COUNTS)
    bits = draw(st.lists(st.booleans(), min_size=rows * columns, max_size=rows * columns))
    return np.array(bits, dtype=np.int8).reshape(rows, columns)


def lists(relation):
    return [np.flatnonzero(row).tolist() for row in relation]


@given(relations())
def test_as_many_rows_are_matched_as_can_be(relation):
    """No column twice, only columns that suit, and as many as SciPy's Hopcroft-Karp matches."""
    found = matching(lists(relation), relation.shape[1])
    taken = [(row, column) for row, column in enumerate(found) if column >= 0]
    assert len({column for _, column in taken}) == len(taken)
    assert all(relation[pair] for pair in taken)
    assert len(taken) == np.count_nonzero(maximum_bipartite_matching(csr_array(relation), "column") >= 0)


@given(relations(square=True))
def test_components_are_those_of_scipy(relation):
    count, labels = connected_components(csr_array(relation), directed=True, connection="strong")
    found = components(lists(relation))
    assert len(set(zip(found, labels.tolist(), strict=True))) == count == len(set(found))


def test_a_long_chain_and_a_long_loop():
    """Twenty thousand nodes: no recursion."""
    n = 20_000
    assert sorted(components([[i + 1] for i in range(n - 1)] + [[]])) == list(range(n))
    assert set(components([[(i + 1) % n] for i in range(n)])) == {0}
    assert matching([[i] for i in range(n)], n) == list(range(n))


def loops_up_to(edges, most):
    """All loops of at most so many edges, each a set of edges as bits."""
    number = {pair: 1 << k for k, edge in enumerate(edges) for pair in (edge, edge[::-1])}
    ways = [([start], 0) for start in {node for edge in edges for node in edge}]
    loops = set()
    while ways:
        path, used = ways.pop()
        for node in (other for one, other in number if one == path[-1] and not used & number[one, other]):
            bits = used | number[path[-1], node]
            if node == path[0]:
                loops.add(bits)
            elif node not in path and len(path) < most:
                ways.append(([*path, node], bits))
    return list(loops)


def independent(rows):
    """How many sets of edges do not follow from others."""
    basis = []
    for row in rows:
        for other in basis:
            row = min(row, row ^ other)
        basis += [row] * bool(row)
    return len(basis)


@given(st.sets(st.tuples(st.integers(0, 6), st.integers(0, 6)).filter(lambda pair: pair[0] < pair[1]), max_size=12))
def test_loops_up_to_the_longest_span_all_and_shorter_ones_do_not(pairs):
    edges = sorted(pairs)
    longest, all_of_them = longest_loop(edges), independent(loops_up_to(edges, 7))
    assert independent(loops_up_to(edges, longest)) == all_of_them
    assert independent(loops_up_to(edges, longest - 1)) < all_of_them or longest == 0
