"""What is drawn by hand: slots, gear pairs, ends on links, locks, names; against closed forms where there is motion."""

import re

import numpy as np
import pytest

from studio.asking import EXAMPLES, analysed, ask, edited, model_of, solved
from trunnion.model.file import entries_of

WHITWORTH = (
    {"do": "link", "from": {"ground": [0, 0.04]}, "to": [0.06, 0.1]},
    {"do": "link", "from": {"ground": [0, 0]}, "to": [-0.06, -0.1]},
    {"do": "slide", "joint": "link1.B", "along": "link2", "near": 0.001},
    {"do": "link", "from": "link2.D", "to": [0.3, -0.15]},
    {"do": "slide", "joint": "link3.F", "angle": 0.0},
    {"do": "driver", "joint": "A"},
)


def tracks(found, key):
    """Places of a point over the cycle, [position, axis]."""
    track = found["scene"]["points"][key]
    count = found["scene"]["count"]
    return np.stack([np.resize(np.array(track[axis], float), count) for axis in "xy"], axis=1)


def test_a_slotted_lever_points_at_the_crank_pin():
    text, places = edited("", {}, *WHITWORTH)
    found = solved(text)
    for key, place in places.items():  # it begins as it was drawn
        np.testing.assert_allclose(found["places"][key], place, atol=2e-6)
    pin, end = tracks(found, "link1.B"), tracks(found, "link2.D")
    length = np.hypot(0.06, 0.1)
    np.testing.assert_allclose(end, -length * pin / np.hypot(*pin.T)[:, None], atol=1e-6)  # C is the origin
    assert list(entries_of(text)[0]["joints"]) == ["A", "C", "B", "E", "D", "F", "G"]


@pytest.mark.slow
def test_the_forces_on_a_block_balance_with_the_friction_of_its_guide():
    rubbing = {"pin": {"radius": "5 mm"}, "guide": {"length": "30 mm"}, "friction": 0.2}
    text, _ = edited(
        "", {}, *WHITWORTH, {"do": "load", "at": "F", "force": ["-100 N", "0 N"]},
        {"do": "set", "path": ["joint_defaults"], "value": rubbing},
    )  # fmt: skip
    shown = solved(text)["scene"]
    pin, guide = ({one["name"]: one for one in shown["joints"]}[name] for name in ("B", "E"))
    angle = np.array(next(one["angle"] for one in shown["links"] if one["name"] == "link2"))
    known = np.array(shown["status"]) == 0
    for axis, part in {"x": np.cos(angle), "y": np.sin(angle)}.items():
        total = np.array(pin["reaction"][axis]) + np.array(guide["reaction"][axis]) + part * np.array(guide["friction"])
        np.testing.assert_allclose(total[known], 0.0, atol=1e-3)
    assert np.abs(np.array(guide["friction"])[known]).max() > 20.0


def test_a_link_itself_slides():
    """Scotch yoke: the yoke moves as the crank pin's height does not matter to it, x = r cos φ."""
    text, _ = edited(
        "", {},
        {"do": "link", "from": {"ground": [0, 0]}, "to": [0.03, 0]},
        {"do": "link", "from": [0.03, -0.06], "to": [0.03, 0.06]},
        {"do": "slide", "joint": {"on": "link2", "at": [0.03, 0.0]}, "angle": 0.0},
        {"do": "slide", "joint": "link1.B", "along": "link2", "near": 0.001},
        {"do": "driver", "joint": "A"},
    )  # fmt: skip
    found = solved(text)
    pin, yoke = tracks(found, "link1.B"), tracks(found, "link2.D")
    np.testing.assert_allclose(yoke[:, 0], pin[:, 0], atol=1e-8)
    np.testing.assert_allclose(yoke[:, 1], 0.06, atol=1e-8)


@pytest.mark.parametrize(("typed", "written", "ratio"), [(None, -1, -1.0), ("20:40", "-20/40", -0.5), ("+3", 3, 3.0)])
def test_gears_mesh_as_they_are_drawn(typed, written, ratio):
    text, places = edited(
        "", {},
        {"do": "link", "from": {"ground": [0, 0]}, "to": [0.02, 0.01]},
        {"do": "link", "from": {"ground": [0.1, 0]}, "to": [0.08, 0.03]},
        {"do": "driver", "joint": "A"},
        {"do": "gear", "joints": ["A", {"on": "link2"}], **({"ratio": typed} if typed else {})},
    )  # fmt: skip
    assert entries_of(text)[0]["gears"]["gear1"]["ratio"] == written
    found = solved(text)
    assert found["places"]["link2.D"] == pytest.approx(places["link2.D"], abs=1e-6)
    one, two = (np.unwrap(np.arctan2(*(tracks(found, key) - centre).T[::-1]))
                for key, centre in (("link1.B", [0, 0]), ("link2.D", [0.1, 0])))  # fmt: skip
    np.testing.assert_allclose(two - two[0], ratio * (one - one[0]), atol=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize(
    "gesture",
    [
        {"do": "gear", "joints": ["A", "A"]}, {"do": "gear", "joints": ["A", "D"]},
        {"do": "gear", "joints": ["A", "C"], "ratio": "0"}, {"do": "gear", "joints": ["A", "G"]},
        {"do": "slide", "joint": "link2.D", "along": "link2"}, {"do": "slide", "joint": "E", "angle": 0.0},
        {"do": "slide", "joint": {"on": "link2", "at": [0, 0]}, "along": "link2"},
        {"do": "spring", "between": ["A", {"ground": [0.2, 0.2]}]}, {"do": "load", "at": [0, 0], "force": ["1 N", 0]},
        {"do": "load", "against": "Q"},
        {"do": "rename", "what": ["joints", "A"], "to": "B"},
        {"do": "set", "path": ["gears", "gear1", "ratio"], "value": None},
        {"do": "move", "point": "D", "to": [0, 0]}, {"do": "move", "point": "link1.Z", "to": [0, 0.04]},
        {"do": "join", "ends": ["link1.Z", "A"]}, {"do": "join", "ends": ["link1.Z", {"on": "link1", "at": [0, 0]}]},
        {"do": "join", "ends": [{"on": "link2", "at": [0, 0.1]}, {"on": "link3", "at": [0, 0.1]}]},
    ],
)  # fmt: skip
def test_what_cannot_be_done_is_refused_in_words(gesture):
    text, places = edited("", {}, *WHITWORTH, {"do": "add-point", "link": "link1", "at": [0.03, 0.08]})
    text, places = edited(text, places, {"do": "rename", "what": ["points", "link1.H"], "to": "Z"})
    if gesture["do"] == "spring":
        gesture = gesture | {"between": [{"ground": [0.1, 0.2]}, {"ground": [0.2, 0.2]}]}
    found = ask(ask="edit", text=text, places=places, gestures=[gesture])
    assert len(found["error"]) > 10
    assert "cannot be answered" not in found["error"]
    assert "links." not in found["error"]


def test_a_spring_begins_on_a_link_and_ends_on_the_ground():
    text, _ = edited(
        "", {},
        {"do": "link", "from": {"ground": [0, 0]}, "to": [0.1, 0]},
        {"do": "spring", "between": [{"on": "link1", "at": [0.05, 0]}, [0.05, 0.04]], "stiffness": "2 N/mm"},
        {"do": "load", "at": {"on": "link1", "at": [0.08, 0]}, "force": ["0 N", "-2 kN"]},
    )  # fmt: skip
    entries = entries_of(text)[0]
    assert entries["springs"]["spring1"] == {
        "between": ["link1.C", "ground.D"], "stiffness": "2 N/mm", "free_length": "40 mm",
    }  # fmt: skip
    assert entries["loads"]["load1"] == {"link": "link1", "at": "E", "force": ["0 N", "-2 kN"]}


def test_a_half_drawn_linkage_is_no_error():
    text, places, told = "", {}, []
    for gesture in WHITWORTH:
        text, places = edited(text, places, gesture)
        told.append(ask(ask="model", text=text)["missing"])
    assert [[re.search(r"mobility is (\d)", way)[1] for way in ways] for ways in told] == [[n] for n in "12121"] + [[]]
    text, _ = edited("", {}, {"do": "link", "from": [0, 0], "to": [1, 0]})
    assert ask(ask="model", text=text)["missing"] == ["There are no joints: join the links."]
    arms = [{"do": "link", "from": {"ground": [x, 0]}, "to": to} for x, to in ((0, [1, 1]), (2, "link1.B"))]
    still, _ = edited("", {}, *arms)
    found = ask(ask="model", text=still)
    assert found["missing"] == ["It stands still: its joints let no link move. Take one away, or let an end slide."]
    assert (found["ready"][0]["what"], found["ready"][0]["ok"]) == ("motion", False)
    assert "stands still" in found["ready"][0]["why"]
    wrong = text.replace("1 m,", "1 banana,").replace(" mm", " banana")
    assert ask(ask="model", text=wrong)["missing"] == []


def test_what_slides_goes_with_its_joint():
    text, places = edited("", {}, *WHITWORTH)
    text, _ = edited(text, places, {"do": "delete", "what": ["joints", "E"]})
    entries = entries_of(text)[0]
    assert "block1" not in entries["links"]
    assert list(entries["joints"]) == ["A", "C", "D", "F", "G"]
    assert list(entries["links"]["link2"]["points"]) == ["C", "D"]
    assert "B" in entries["links"]["link1"]["points"]


@pytest.mark.parametrize("point", ["D", "C"])
def test_what_is_dragged_on_a_slotted_lever_goes_there_and_the_rest_stays(point):
    text, places = edited("", {}, *WHITWORTH)
    now = solved(edited(text, places, {"do": "move", "point": point, "to": [-0.05, -0.07]})[0])["places"]
    moved = f"link2.{point}"
    assert now[moved] == pytest.approx([-0.05, -0.07], abs=1e-5)
    for key in {"link1.B", "link2.C", "link2.D", "link3.F"} - {moved}:
        assert now[key] == pytest.approx(places[key], abs=1e-5), key


def test_a_lever_turns_with_its_pin():
    text, places = edited("", {}, *WHITWORTH)
    found = ask(ask="drag", text=text, point="B", index=0, to=[0.05, 0.11])
    end = [found["points"]["link2.D"][axis][found["index"]] for axis in "xy"]
    assert np.hypot(*np.subtract(end, places["link2.D"])) > 5e-3


@pytest.mark.parametrize(
    "old", ["36 mm, 0]", "[0, 0]", "[ground, link1]", "{A: [0, 0]}", "revolute", "{speed: 60 rpm}", "-100 N"]
)
def test_a_text_that_is_not_sound_is_answered_with_what_is_found(old):
    text = (
        "trunnion: 1\nlinks:\n  ground: {points: {A: [0, 0]}}\n  link1: {points: {A: [0, 0], B: [36 mm, 0]}}\n"
        "joints: {A: {type: revolute, links: [ground, link1]}}\ndrivers: {A: {speed: 60 rpm}}\n"
        "loads: {load1: {link: link1, at: B, force: [-100 N, 0]}}\n"
    )
    assert old in text
    for odd in ("abc", "3.5", "[[1], {a: 2}]", "{a: [b]}", "null", "1e999"):
        found = ask(ask="model", text=text.replace(old, f"{odd}]" if old.startswith("36") else odd), steps=4)
        assert found["findings"] or found["solved"], (odd, found)


def test_everything_that_is_drawn_has_a_name_of_its_own():
    text, places = edited(
        "", {}, *WHITWORTH,
        {"do": "add-point", "link": "link3", "at": [0.2, -0.1]},
        {"do": "load", "at": "link3.H", "force": ["0 N", "-5 N"]},
        {"do": "spring", "between": ["link3.H", {"ground": [0.2, 0.2]}]},
    )  # fmt: skip
    before = np.array(solved(text)["scene"]["drivers"][0]["effort"], float)
    for what, new in (
        (["loads", "load1"], "cut"), (["springs", "spring1"], "return"), (["drivers", "A"], "crank"),
        (["points", "link3.H"], "tool"), (["links", "link3"], "rod"),
    ):  # fmt: skip
        text, places = edited(text, places, {"do": "rename", "what": what, "to": new})
    entries = entries_of(text)[0]
    assert [list(entries[part]) for part in ("loads", "springs", "drivers")] == [["cut"], ["return"], ["crank"]]
    assert entries["loads"]["cut"]["at"] == "tool"
    assert entries["springs"]["return"]["between"][0] == "rod.tool"
    np.testing.assert_allclose(np.array(solved(text)["scene"]["drivers"][0]["effort"], float), before, rtol=1e-6)


def test_a_load_against_the_motion_takes_power_from_a_slide_whichever_way_it_goes():
    text, places = edited("", {}, *WHITWORTH, {"do": "load", "against": "G", "size": "250 N"})
    text, places = edited(text, places, {"do": "set", "path": ["loads", "load1", "useful"], "value": True})
    text, places = edited(text, places, {"do": "load", "against": "C", "size": "2 N m"})
    assert entries_of(text)[0]["loads"] == {
        "load1": {"joint": "G", "resisting_force": "250 N", "useful": True},
        "load2": {"joint": "C", "resisting_torque": "2 N m"},
    }
    found = solved(text)
    loads = {load["name"]: load for load in found["scene"]["loads"]}
    assert [loads[name]["resists"] for name in ("load1", "load2")] == [250.0, 2.0]
    x = tracks(found, "block2.F")[:, 0]
    ahead = np.roll(x, -1) - np.roll(x, 1)
    clear = np.abs(ahead) > 0.02 * np.abs(ahead).max()
    np.testing.assert_array_equal(np.array(loads["load1"]["acts"])[clear], -np.sign(ahead)[clear])
    work = analysed(text, 720)["useful_power_mean"].item() * 1.0  # of a turn in 1 s
    assert work == pytest.approx(250.0 * 2 * np.ptp(x), rel=1e-4)
    text, _ = edited(text, places, {"do": "set", "path": ["loads", "load1", "only"], "value": "negative"})
    (acts,) = (load["acts"] for load in solved(text)["scene"]["loads"] if load["name"] == "load1")
    np.testing.assert_array_equal(np.array(acts)[clear], np.where(ahead < 0, 1, 0)[clear])


def test_the_mass_of_a_flat_bar_is_that_of_its_section():
    """m = ρ l b t, J = m (l² + b²)/12 about the middle: 7850 · 0.1 · 0.02 · 0.01 = 0.157 kg, 1.36067e-4 kg m²."""
    text, places = edited("", {}, {"do": "link", "from": {"ground": [0, 0]}, "to": [0.06, 0.08]})
    bar = {"do": "bar-mass", "link": "link1", "width": "20 mm", "thickness": "10 mm"}
    link = model_of(edited(text, places, bar | {"density": "7850 kg/m^3"})[0]).parameters()
    assert link["links.link1.mass"] == pytest.approx(0.157, rel=1e-6)
    assert link["links.link1.inertia"] == pytest.approx(0.157 * (0.1**2 + 0.02**2) / 12, rel=1e-5)
    assert (link["links.link1.centre.x"], link["links.link1.centre.y"]) == pytest.approx((0.05, 0))
    for given, middle in (({}, (0.05, 0)), ({"at": [0.06, 0]}, (0.036, -0.048))):  # 60 mm along x, at 53.13° to the bar
        after, _ = edited(text, places, {"do": "centre", "link": "link1"} | given)
        found = model_of(after).parameters()
        assert [found[f"links.link1.centre.{axis}"] for axis in "xy"] == pytest.approx(middle)
    refused = ({"width": "-1 mm"}, "not above 0"), ({"density": "7 kg"}, "no density"), ({"link": "ground"}, "no bar")
    for wrong, words in refused:
        question = {"places": places, "gestures": [bar | {"density": "7850 kg/m^3"} | wrong]}
        assert words in ask(ask="edit", text=text, **question)["error"]


SIX_BAR = {
    "A": (0, 0), "B": (0, 0.04), "C": (0.075, 0.08), "D": (0.135, 0), "F": (0.105, 0.04), "H": (0.165, 0.065),
    "G": (0.21, 0.005),
}  # fmt: skip
TYPED = """
trunnion: 1
space: planar
links:
  frame: {points: {A: [0, 0], D: [135 mm, 0], G: [210 mm, 5 mm]}}
  crank: {points: {A: [0, 0], B: [40 mm, 0]}}
  coupler: {points: {B: [0, 0], C: [85 mm, 0]}}
  lever: {points: {D: [0, 0], C: [100 mm, 0], F: [50 mm, 0]}}
  rod: {points: {F: [0, 0], H: [65 mm, 0]}}
  rocker: {points: {G: [0, 0], H: [75 mm, 0]}}
joints:
  A: {type: revolute, links: [frame, crank]}
  B: {type: revolute, links: [crank, coupler]}
  C: {type: revolute, links: [coupler, lever]}
  D: {type: revolute, links: [frame, lever]}
  F: {type: revolute, links: [lever, rod]}
  H: {type: revolute, links: [rod, rocker]}
  G: {type: revolute, links: [frame, rocker]}
joint_defaults: {pin: {radius: 7 mm}, friction: 0.06}
drivers: {A: {speed: 60 rpm, start: 90 deg}}
loads: {water: {joint: G, resisting_torque: 6 N m}}
assembly: {C: [75 mm, 80 mm], H: [165 mm, 65 mm]}
"""  # lengths by Pythagoras: 75-40-85, 60-80-100, 60-25-65, 45-60-75


def test_a_watt_six_bar_of_links_that_were_joined_is_the_typed_one():
    spot = {name: list(place) for name, place in SIX_BAR.items()}
    aside = ([0.0, 0.2], [0.1, 0.2])  # where links are drawn that come to their places by joins alone
    text, places = edited(
        "", {},
        {"do": "link", "from": {"ground": spot["A"]}, "to": spot["B"]},
        {"do": "link", "from": {"ground": spot["D"]}, "to": spot["C"]},
        {"do": "link", "from": {"ground": spot["G"]}, "to": spot["H"]},
        {"do": "link", "from": aside[0], "to": aside[1]},
        {"do": "join", "ends": ["link4.G", "link1.B"]},
        {"do": "join", "ends": ["link4.H", "link2.D"]},
        {"do": "link", "from": aside[0], "to": aside[1]},
        {"do": "join", "ends": ["link5.G", {"on": "link2", "at": spot["F"]}]},
        {"do": "join", "ends": ["link5.H", "link3.F"]},
        {"do": "driver", "joint": "A"},
        {"do": "load", "against": "E", "size": "6 N m"},
        {"do": "set", "path": ["joint_defaults"], "value": {"pin": {"radius": "7 mm"}, "friction": 0.06}},
    )  # fmt: skip
    drawn, typed = (analysed(one, 360)["drive_effort"].values for one in (text, TYPED))
    assert np.isfinite(drawn).all()
    np.testing.assert_allclose(drawn, typed, rtol=0, atol=1e-12 * np.abs(typed).max())
    shifted = {"do": "group", "what": "shift", "links": ["link4"], "by": [0.03, 0]}
    text, places = edited(text, places, shifted)  # its ends go with it, and the links there follow
    points = {name: one["points"] for name, one in entries_of(text)[0]["links"].items()}
    assert points["link1"]["B"] == ["50 mm", 0]  # √(30² + 40²)
    assert places["link2.D"] == pytest.approx([0.105, 0.08])
    assert places["link2.G"] == pytest.approx(spot["F"], abs=1e-6)  # it stays


def grouped(example, **given):
    """An example's efforts, and those after all its moving links are changed together."""
    text = EXAMPLES[example]
    entries = entries_of(text)[0]
    links = [name for name in entries["links"] if name != entries.get("ground") and name not in ("ground", "frame")]
    after, _ = edited(text, solved(text)["places"], {"do": "group", "links": links} | given)
    return [analysed(one, 72)["drive_effort"].values for one in (text, after)]


@pytest.mark.spread(1)
@pytest.mark.parametrize("example", ["watt-six-bar", "durango-fourbar", "spring-balanced-lamp"])
def test_a_mirrored_mechanism_has_the_mirrored_figures_and_a_copy_the_same(example):
    """Turned round and moving the other way, it takes the same torques the other way; gravity stays."""
    before, after = grouped(example, what="mirror", at=[0.013, 0.02])
    near = {"rtol": 0, "atol": 1e-12 * np.nanmax(np.abs(before))}
    np.testing.assert_allclose(after, -before, **near)
    for given, sign in (({"by": [0.1, 0.02]}, 1), ({"at": [0.5, 0.02]}, -1)):
        both = np.split(grouped(example, what="copy", **given)[1], 2)
        for one, expected in zip(both, (before, sign * before), strict=True):
            np.testing.assert_allclose(one, expected, **near)


def test_a_dimension_in_the_place_of_a_guide_is_renamed():
    text = """\
trunnion: 1
name: guide
dimensions: {AB: 30 mm}
links:
  frame: {points: {C: {at: [AB, 0], axis: [1, 0]}}}
"""
    rename = {"do": "rename", "what": ["dimensions", "AB"], "to": "far"}
    assert "at: [far, 0]" in edited(text, {}, rename)[0]


def test_a_dimension_that_is_emptied_is_missed_where_it_is_used():
    text = "trunnion: 1\ndimensions: {r: 5 mm, s: 2 mm}\nlinks:\n  ground: {points: {A: [0, r]}}\n"
    text, _ = edited(text, {}, {"do": "set", "path": ["dimensions", "r"], "value": None})
    assert entries_of(text)[0]["dimensions"] == {"s": "2 mm"}
    assert any("'r'" in one["what"] for one in ask(ask="model", text=text)["findings"])


FOUR_BAR = """
links:
  ground: {points: {A: [0, 0], D: [180 mm, 0]}}
  crank: {points: {A: [0, 0], B: [60 mm, 0]}}
  coupler: {points: {B: [0, 0], C: [160 mm, 0]}}
  rocker: {points: {D: [0, 0], C: [120 mm, 0]}}
joints:
  A: {type: revolute, links: [ground, crank]}
  B: {type: revolute, links: [crank, coupler]}
  C: {type: revolute, links: [coupler, rocker]}
  D: {type: revolute, links: [ground, rocker]}
drivers: {A: {speed: 60 rpm}}
loads: {push: {link: rocker, at: C, force: [-100 N, 0]}}
"""
MIRROR = {"do": "group", "links": ["crank", "coupler", "rocker"], "what": "mirror", "at": [0, 0], "start": True}


def test_what_no_hint_assembles_is_mirrored_as_it_is_drawn():
    """The other assembly would be taken without a hint of where the mirrored joint is."""
    before = analysed(FOUR_BAR, 12)
    places = {str(key): before.point_position.sel(point=key).values[:, 0].tolist() for key in before.point.values}
    after, peak = analysed(edited(FOUR_BAR, places, MIRROR)[0], 12), float(np.max(np.abs(before.drive_effort)))
    np.testing.assert_allclose(after.drive_effort.values, -before.drive_effort.values, atol=1e-9 * peak)


@pytest.mark.parametrize(
    ("more", "links", "told"),
    [
        ("joint_defaults: {friction: {coefficient: 0.1, backward: 0.3}}\n", None, "friction of all joints"),
        ("measures: {swing: {rotation: D, at: 60 deg}}\n", None, "measure swing"),
        ("tolerances: {links.coupler.points.C.x: +0.2/-0.0 mm}\n", None, "tolerances"),
        ("", ["rocker"], "joint C"),
        ("space: spatial\n", None, "in space"),
    ],
)
def test_what_would_not_be_mirrored_truly_is_refused(more, links, told):
    gesture = {**MIRROR, "links": links or MIRROR["links"]}
    assert told in ask(ask="edit", text=FOUR_BAR + more, places={}, gestures=[gesture])["error"]
