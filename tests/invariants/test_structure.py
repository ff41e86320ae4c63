"""Decomposition: order of modules, class, formula, and what is said where drivers do not determine the motion."""

from __future__ import annotations

import copy
import time
from collections.abc import Sequence

import numpy as np
import pytest

import trunnion
from brief import brief
from mechanisms import MODELS, Data, build, four_bar, model, prismatic, revolute, slide
from trunnion import Mechanism, MechanismError
from trunnion.errors import Finding
from trunnion.structure.decompose import Plan, decompose

FORMULAS = {
    "four-bar": "I(0,1)R → II(2,3)RRR",
    "four-bar, other branch": "I(0,1)R → II(2,3)RRR",
    "slider-crank": "I(0,1)R → II(2,3)RRP",
    "inverted slider-crank": "I(0,1)R → II(2,3)RPR",
    "Watt six-bar": "I(0,1)R → II(2,3)RRR → II(4,5)RRR",
    "Stephenson six-bar": "I(0,1)R → II(2,3)RRR → II(4,5)RRR",
    "class III": "I(0,1)R → III(2,3,4,5)RRRRRR",
    "five-bar": "I(0,1)R → I(0,2)R → II(3,4)RRR",
    "excavator": "II(1,2,3)RRR[P] → I(1,4)R",
    "serial arm": "I(0,1)R → I(1,2)P → I(2,3)R",
    "Scotch yoke": "I(0,1)R → II(2,3)RPP",
    "elliptic bar": "I(0,1)P → II(2,3)RRP",
    "tangent drive": "I(0,1)R → II(2,3)PRP",
    "geared five-bar": "I(0,1)R → II(4)RG → II(2,3)RRR",
    "planet drive": "I(0,1)R → II(2)RG → II(3,4)RRP",
    "geared loop": "I(0,1)R → II(2,3,4)RRRRG",
    "rocker train": "I(0,1)R → II(2,3)RRR → II(4)RG → II(5,6)RRP",
    "rack on a rocker": "I(0,1)R → II(2,3)RPR → II(4)RG",
    "rack in a loop": "I(0,1)R → III(2,3,4,5,6)RRRRPRRG",
    "screwed strut": "III(1,2,3,4)RRRP[R]G",
}


@pytest.mark.parametrize("name", MODELS)
def test_formula(name: str) -> None:
    plan = decompose(build(MODELS[name]()))
    assert plan.formula == FORMULAS[name]
    assert plan.mobility == len(MODELS[name]()["drivers"])


@pytest.mark.parametrize("name", MODELS)
def test_plan_is_a_partition_in_causal_order(name: str) -> None:
    """Every link and joint once; every module hangs on the ground or on earlier links; each counts as a group."""
    mechanism = build(MODELS[name]())
    plan = decompose(mechanism)
    _check_plan(mechanism, plan)


def _check_plan(mechanism: Mechanism, plan: Plan) -> None:
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


def loose_chain(links: Sequence[str], joints: Sequence[tuple[str, str]], drivers: Sequence[int]) -> Data:
    """A planar mechanism of pins only, whose geometry does not matter."""
    rng = np.random.default_rng(0)
    data: Data = {"links": {link: {"points": {}} for link in links}, "joints": {}, "drivers": {}}
    for k, pair in enumerate(joints):
        name = f"J{k}"
        for link in pair:
            data["links"][link]["points"][name] = list(rng.normal(size=2))
        data["joints"][name] = revolute(*pair)
    data["drivers"] = {f"J{k}": {"speed": 1.0} for k in drivers}
    return data


@pytest.mark.parametrize("seed", range(25))
def test_random_assur_chains(seed: int) -> None:
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


def test_class_of_a_closed_contour() -> None:
    """Four links in a ring, hung at two opposite ones: class IV."""
    data = loose_chain(
        ["ground", "crank", "a", "b", "c", "d"],
        [("ground", "crank"), ("a", "b"), ("b", "c"), ("c", "d"), ("d", "a"), ("crank", "a"), ("ground", "c")],
        [0],
    )
    plan = decompose(Mechanism(**data))
    assert plan.formula == "I(0,1)R → IV(2,3,4,5)RRRRRR"


def test_inversion_changes_the_class() -> None:
    """Watt's six-bar driven at the crank has two dyads; Stephenson III driven at the other rocker has a triad."""
    data = MODELS["Stephenson six-bar"]()
    data["drivers"] = {"G": {"speed": 1.0, "range": [0.0, 0.1]}}
    plan = decompose(build(data))
    assert [module.rank for module in plan.modules] == [1, 3]


def test_driven_inner_pin_and_two_modules() -> None:
    """A pin driven between two moving links of a loop: one module, the driven joint in brackets."""
    data = four_bar()
    data["drivers"] = {"C": {"speed": 1.0, "range": [0.5, 1.0]}}
    plan = decompose(build(data))
    assert plan.formula == "II(1,2,3)RR[R]R"
    assert plan.modules[0].driven == ("C",)


def test_ternary_ground_and_several_pins_at_one_point() -> None:
    data = MODELS["Watt six-bar"]()
    data["links"]["rocker"]["points"]["F"] = [0.7, 0]  # at C
    mechanism = build(data)
    assert decompose(mechanism).formula == FORMULAS["Watt six-bar"]
    result = brief(mechanism, 12)
    c, f = (result["point_position"].sel(point=f"rocker.{name}").values for name in "CF")
    np.testing.assert_allclose(c, f, atol=1e-15)


def findings_of(data: Data) -> tuple[Finding, ...]:
    with pytest.raises(MechanismError) as error:
        trunnion.analyse(Mechanism(**data), 4)
    return error.value.findings


def test_too_few_drivers() -> None:
    data = model(MODELS["five-bar"]())
    del data["drivers"]["E"]
    (finding,) = findings_of(data)
    assert "mobility is 2" in finding.what
    assert "one driver" in finding.what
    assert "drive" in finding.remedy


def test_too_many_drivers() -> None:
    data = model(four_bar())
    data["drivers"]["D"] = {"speed": 1.0}
    text = " ".join(str(finding) for finding in findings_of(data))
    assert "mobility is 1" in text
    assert "2 drivers" in text


def test_no_driver() -> None:
    data = model(four_bar())
    data["drivers"] = {}
    text = " ".join(str(finding) for finding in findings_of(data))
    assert "driver" in text


def test_rigid_part_and_loose_part() -> None:
    """A link on three pins is held once too much, a chain elsewhere hangs loose: only the count is right."""
    data = loose_chain(
        ["ground", "crank", "a", "b", "c", "d"],
        [
            ("ground", "crank"),
            ("ground", "a"),
            ("a", "b"),
            ("b", "ground"),
            ("a", "ground"),
            ("crank", "c"),
            ("c", "d"),
        ],
        [0],
    )
    mechanism = Mechanism(**data)
    findings = findings_of(data)
    assert decompose_mobility(mechanism) == 1
    text = " ".join(str(finding) for finding in findings)
    assert "twice" in text
    assert any(link in text for link in ("c", "d"))


def decompose_mobility(mechanism: Mechanism) -> int:
    return trunnion.structure.decompose.mobility_by_formula(mechanism)  # type: ignore[attr-defined]


def test_floating_rigid_part() -> None:
    """Two links pinned to each other twice are rigid wherever they hang; swinging on one pin they are also loose.

    Grübler counts 1 with one driver, yet the pair is constrained once too much and swings freely.
    """
    data = loose_chain(
        ["ground", "crank", "a", "b"], [("ground", "crank"), ("crank", "a"), ("a", "b"), ("a", "b")], [0]
    )
    text = " ".join(str(finding) for finding in findings_of(data))
    assert "twice" in text
    assert "undetermined" in text


def test_driver_on_what_is_already_driven() -> None:
    """Five-bar with both drivers on one crank's loop side: one on the crank, one between links it determines."""
    data = loose_chain(
        ["ground", "crank", "coupler", "rocker", "arm"],
        [("ground", "crank"), ("crank", "coupler"), ("coupler", "rocker"), ("rocker", "ground"), ("rocker", "arm")],
        [0, 3],
    )
    text = " ".join(str(finding) for finding in findings_of(data))
    assert "J0" in text or "J3" in text
    assert "already determined" in text or "twice" in text


def test_parallelogram_with_a_third_crank() -> None:
    """Mobility 0 by the formula although it moves: refused, with the count that fails, not answered wrongly."""
    data: Data = {
        "links": {
            "ground": {"points": {"A": [0, 0], "D": [2, 0], "G": [1, 0]}},
            "crank": {"points": {"A": [0, 0], "B": [0.5, 0]}},
            "coupler": {"points": {"B": [0, 0], "C": [2, 0], "H": [1, 0]}},
            "rocker": {"points": {"D": [0, 0], "C": [0.5, 0]}},
            "third": {"points": {"G": [0, 0], "H": [0.5, 0]}},
        },
        "joints": {
            "A": revolute("ground", "crank"),
            "B": revolute("crank", "coupler"),
            "C": revolute("coupler", "rocker"),
            "D": revolute("ground", "rocker"),
            "G": revolute("ground", "third"),
            "H": revolute("third", "coupler"),
        },
        "drivers": {"A": {"speed": 1.0, "start": 0.5}},
        "assembly": {"C": [2.4, 0.2]},
    }
    assert "mobility is 0" in findings_of(data)[0].what


def test_rank_of_a_parallelogram_differs_from_the_formula() -> None:
    """Rank of the joints' constraints, taken alone: 1 where Grübler says 0."""
    from trunnion.structure.decompose import mobility_by_rank

    turn = 0.7
    c, s = 0.5 * np.cos(turn), 0.5 * np.sin(turn)
    joints = {
        "A": ("revolute", ("ground", "crank")),
        "B": ("revolute", ("crank", "coupler")),
        "C": ("revolute", ("coupler", "rocker")),
        "D": ("revolute", ("ground", "rocker")),
        "G": ("revolute", ("ground", "third")),
        "H": ("revolute", ("third", "coupler")),
    }
    at = {"A": (0, 0), "B": (c, s), "C": (2 + c, s), "D": (2, 0), "G": (1, 0), "H": (1 + c, s)}
    links = ["ground", "crank", "coupler", "rocker", "third"]
    for shift in (0.0, 1e4):
        places = {name: (x + shift, y - shift, 1.0, 0.0) for name, (x, y) in at.items()}
        assert mobility_by_rank(links, "ground", joints, places) == 1
    places = {name: (x, y + (0.1 if name == "G" else 0.0), 1.0, 0.0) for name, (x, y) in at.items()}
    assert mobility_by_rank(links, "ground", joints, places) == 0


@pytest.mark.parametrize("shift", [0.0, 1e3, 1e5, 1e6])
def test_rank_far_from_the_origin(shift: float) -> None:
    """Where the drawing has its origin says nothing about mobility."""
    from trunnion.structure.decompose import mobility_by_rank

    result = brief(build(four_bar()), 6)
    joints = {
        "A": ("revolute", ("ground", "crank")),
        "B": ("revolute", ("crank", "coupler")),
        "C": ("revolute", ("coupler", "rocker")),
        "D": ("revolute", ("ground", "rocker")),
    }
    at = {
        name: result["point_position"].sel(point=f"{pair[1]}.{name}").values[:, 1] for name, (_, pair) in joints.items()
    }
    places = {name: (float(x) + shift, float(y) - shift, 1.0, 0.0) for name, (x, y) in at.items()}
    assert mobility_by_rank(["ground", "crank", "coupler", "rocker"], "ground", joints, places) == 1


@pytest.mark.spread(3)
@pytest.mark.parametrize("name", MODELS)
def test_check(name: str) -> None:
    """Both mobilities agree on ordinary linkages, and nothing is wrong with them."""
    found = trunnion.check(build(MODELS[name]()), 36)
    assert found.mobility == found.rank_mobility == len(MODELS[name]()["drivers"])
    assert found.formula == FORMULAS[name]
    assert not [f for f in found.findings if f.severity == "error"]
    assert len(found.assemblies) == len(found.plan.modules)


@pytest.mark.slow
def test_a_special_dyad_is_named() -> None:
    """Two parallel slides determine nothing across: PRP with parallel axes is singular everywhere, not an answer."""
    data = MODELS["tangent drive"]()
    data["links"]["ground"]["points"] = {"X": slide(0, 0), "G": slide(0, 1.0)}
    data["links"]["arm"] = {"points": {"X": slide(0, 0), "S": slide(0, 0.5)}}
    data["joints"]["X"] = prismatic("ground", "arm")
    del data["joints"]["A"]
    data["links"]["slider"]["points"]["G"] = slide(0.03, 0)
    data["joints"]["S"] = prismatic("arm", "block")
    data["drivers"] = {"X": {"speed": 0.1, "range": [0.0, 0.2]}}
    result = trunnion.analyse(build(data), 4)
    assert np.all(result["status"] >= trunnion.Status.SINGULAR)
    assert np.all(np.isnan(result["drive_effort"]))


def test_same_mechanism_in_any_order_has_the_same_modules() -> None:
    data = MODELS["Watt six-bar"]()
    shuffled = copy.deepcopy(data)
    shuffled["links"] = dict(reversed(shuffled["links"].items()))
    one, two = decompose(build(data)), decompose(build(shuffled))
    assert {frozenset(m.links) for m in one.modules} == {frozenset(m.links) for m in two.modules}


def ladder(count: int) -> Data:
    """A crank and rocker after rocker behind it, each on its own dyad: two links more in each four-bar of the row."""
    data: Data = {"links": {"ground": {"points": {"A": [0, 0]}}, "crank": {"points": {"A": [0, 0], "P0": [0.03, 0]}}}}
    data["joints"] = {"A": revolute("ground", "crank")}
    before = "crank"
    for k in range(1, count + 1):
        coupler, rocker = f"coupler-{k}", f"rocker-{k}"
        data["links"]["ground"]["points"][f"O{k}"] = [0.1 * k, 0]
        data["links"][coupler] = {"points": {f"P{k - 1}": [0, 0], f"C{k}": [0.1, 0]}}
        data["links"][rocker] = {"points": {f"O{k}": [0, 0], f"C{k}": [0.07, 0], f"P{k}": [0.07, 0]}}
        data["joints"] |= {f"P{k - 1}": revolute(before, coupler), f"C{k}": revolute(coupler, rocker)}
        data["joints"][f"O{k}"] = revolute("ground", rocker)
        before = rocker
    del data["links"][before]["points"][f"P{count}"]
    return data | {"drivers": {"A": {"speed": 1.0}}}


def row(count: int) -> Data:
    """An arm of many links, each driven on the one before."""
    data: Data = {"links": {"ground": {"points": {"J0": [0, 0]}}}, "joints": {}, "drivers": {}}
    for k in range(count):
        data["links"][f"L{k}"] = {"points": {f"J{k}": [0, 0], f"J{k + 1}": [0.1, 0]}}
        data["joints"][f"J{k}"] = revolute(f"L{k - 1}" if k else "ground", f"L{k}")
        data["drivers"][f"J{k}"] = {"speed": 1.0 + k % 5}
    del data["links"][f"L{count - 1}"]["points"][f"J{count}"]
    return data


@pytest.mark.slow
def test_a_thousand_links() -> None:
    """Long rows come apart into their modules, whatever their rank taken at once drowns in, and are analysed."""
    plan = decompose(Mechanism(**ladder(500)))
    assert [module.kind for module in plan.modules] == ["R"] + ["RRR"] * 500
    arm = Mechanism(**row(1000))
    assert len(decompose(arm).modules) == 1000
    assert bool((trunnion.analyse(arm, 2)["status"] == trunnion.Status.SOLVED).all())


def test_mobility_by_rank_of_a_long_row() -> None:
    found = trunnion.check(Mechanism(**ladder(120)), 8)
    assert found.mobility == found.rank_mobility == 1


def test_fault_in_a_long_row() -> None:
    """What is wrong at the end of a long row is named, and not the whole row."""
    data = ladder(100)
    data["links"]["ground"]["points"]["X"] = [1.0, 2.0]  # the last rocker is held once more, and a link hangs loose
    data["links"]["rocker-100"]["points"] |= {"X": [0.3, 0.2], "Y": [0.1, 0.1]}
    data["links"]["loose"] = {"points": {"Y": [0, 0], "Z": [0.2, 0]}}
    data["links"]["hanging"] = {"points": {"Z": [0, 0]}}
    data["joints"] |= {"X": revolute("ground", "rocker-100"), "Y": revolute("rocker-100", "loose")}
    data["joints"]["Z"] = revolute("loose", "hanging")
    text = " ".join(str(one) for one in findings_of(data))
    assert "the links loose, hanging stay undetermined" in text
    assert len(text) < 500


@pytest.mark.slow
def test_time_grows_with_the_links() -> None:
    """Four times the links take about four times as long, and not sixteen."""

    def took(mechanism: Mechanism) -> float:
        begin = time.process_time()
        trunnion.check(mechanism, 12)
        return time.process_time() - begin

    took(Mechanism(**row(5)))  # what is loaded at first
    few, many = (min(took(Mechanism(**row(count))) for _ in range(2)) for count in (100, 400))
    assert many < 8 * few
