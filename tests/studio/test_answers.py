"""Questions of the studio's page and their answers, without a server."""

import numpy as np
import pytest
from benchmarks.studio import chain

import trunnion
from studio.asking import EXAMPLES, analysed, ask, column, edited, model_of, solved, unpacked
from trunnion.errors import Status
from trunnion.model.file import entries_of, text_of
from trunnion.solve.margin import margin_in
from trunnion.solve.run import prepare
from trunnion.studio.answers import answer

FOURBAR = "durango-fourbar"


def test_the_answer_bears_the_question():
    found = unpacked(answer(b'{"ask": "start", "revision": 7}'))
    assert (found["ask"], found["revision"], found["version"]) == ("start", 7, trunnion.__version__)
    assert len(found["examples"]) > 40


@pytest.mark.parametrize(
    "question",
    [
        b"", b"[]", b"{", b'{"ask": "x"}', b'{"ask": "model"}', b'{"ask": "example", "name": "../x"}',
        b'{"ask": "drag", "text": "", "to": [1]}', b'{"ask": "edit", "text": "a: 1", "gestures": [{"do": "fly"}]}',
    ],
)  # fmt: skip
def test_bad_questions_get_a_sentence(question):
    assert len(unpacked(answer(question))["error"]) > 10


@pytest.mark.parametrize(
    "text", ["a", "trunnion: 1", "links: 3", "trunnion: 1\nlinks: {a: {}}", "- 1", "\x00", "x" * 400_000]
)
def test_bad_models_get_findings(text):
    found = ask(ask="model", text=text)
    assert not found["solved"]
    assert found["scene"] is None
    assert any(one["severity"] == "error" and one["what"] for one in found["findings"])


def test_an_empty_sheet_has_nothing_wrong():
    found = ask(ask="model", text="\n")
    assert (found["entries"], found["findings"], found["solved"]) == ({}, [], False)


def test_masses_of_links_are_not_solved():
    links = "".join(f"  l{k}: {{points: {{A: [0, 0]}}}}\n" for k in range(500))
    found = ask(ask="model", text=f"trunnion: 1\nlinks:\n{links}")
    assert [one["where"] for one in found["findings"]] == ["links"]


def test_a_model_reads_no_other_file():
    text = EXAMPLES[FOURBAR].replace("A: {speed: 10 rad/s}", "A: {law: table, file: secret.csv}")
    found = ask(ask="model", text=text)
    assert not found["solved"]
    assert "secret.csv" in found["findings"][0]["what"]


def test_the_cycle_is_that_of_analyse():
    found = ask(ask="model", text=EXAMPLES[FOURBAR])
    result = analysed(EXAMPLES[FOURBAR])
    (driver,) = found["scene"]["drivers"]
    np.testing.assert_allclose(driver["effort"], result.drive_effort.values[0], rtol=6e-7)
    assert found["margin_least"]["beyond"]
    assert found["numbers"]["dimensions.AB"] == 2.0
    assert {one["what"]: one["ok"] for one in found["ready"]} == {
        "motion": True, "forces": True, "friction": True, "play": False, "tolerance": False, "time": False,
    }  # fmt: skip


def test_pictures_of_examples():
    found = ask(ask="picture", name=FOURBAR)
    assert [one["ground"] for one in found["links"]] == [True, False, False, False]
    crank = next(track for track in found["paths"] if np.ptp(np.hypot(track["x"], track["y"])) < 1e-6)
    assert max(crank["x"]) == pytest.approx(2.0, rel=0.01)  # m, as the file states
    assert "no example" in ask(ask="picture", name="none")["error"]


def test_a_drag_that_changes_nothing_says_so():
    text = EXAMPLES["scotch-yoke"]
    places = ask(ask="model", text=text)["places"]
    (place,) = {tuple(at) for key, at in places.items() if key.endswith(".G") and not key.startswith("frame")}
    gesture = {"do": "move", "point": "G", "to": [place[0] + 0.003, place[1]]}
    found = ask(ask="edit", text=text, places=places, gestures=[gesture])
    assert found["says"] == "Move G: no length changes"


@pytest.mark.spread(2)
@pytest.mark.sample(8)
def test_every_example_opens(example):
    found = ask(ask="model", text=EXAMPLES[example])
    assert "error" not in found
    why = [one["code"] for one in found["findings"] if one["severity"] == "error"]
    assert found["solved"] or set(why) <= {"mobility.redundant", "input.drivers", "input.tables"}, found["findings"]


def pytest_generate_tests(metafunc):
    if "example" in metafunc.fixturenames:
        metafunc.parametrize("example", sorted(EXAMPLES))


def test_a_name_is_changed_wherever_it_stands():
    text = EXAMPLES[FOURBAR]
    before = analysed(text, 36)
    for what, new in ((["links", "coupler"], "rod"), (["joints", "C"], "K"), (["dimensions", "BC"], "length")):
        text, _ = edited(text, {}, {"do": "rename", "what": what, "to": new})
    assert not {"coupler", "BC"} & set(str(entries_of(text)[0]).replace("'", " ").split())
    np.testing.assert_allclose(analysed(text, 36).drive_effort, before.drive_effort, rtol=1e-12)
    assert len(text.splitlines()) == len(EXAMPLES[FOURBAR].splitlines())  # and what is on each, in its place
    assert "\n  AB: 2.00 m\n  length: 6.00 m\n  CD: 3.00 m\n" in text
    rod = "  rod: {points: {B: [0, 0], K: [length, 0], E: [BE * cos(gamma), BE * sin(gamma)]},"
    assert f"\n{rod}\n            mass" in text


def test_what_is_deleted_leaves_the_other_lines_as_they_are():
    before = EXAMPLES[FOURBAR].splitlines()
    text, _ = edited(EXAMPLES[FOURBAR], {}, {"do": "delete", "what": ["links", "rocker"]})
    gone = [line for line in before if line not in text.splitlines()]
    assert [line.split(":")[0].strip() for line in gone] == ["ground", "rocker", "C", "D", "brake", "assembly"]
    assert "  ground:  {points: {A: [0, 0]}}" in text.splitlines()


@pytest.mark.slow
@pytest.mark.parametrize("joint", ["U", "L", "K", "B", "G", "G2", "B2"])
def test_links_of_three_joints_keep_the_others(joint):
    """Jansen's leg: what is dragged goes there with the pins on its spot, the others stay where they are."""
    text = EXAMPLES["jansen"]
    scene, index = ask(ask="model", text=text)["scene"], 40
    joints = {one["name"]: one["at"] for one in scene["joints"]}

    def places(points):
        series = {name: points[at] for name, at in joints.items()}
        return {name: [one[axis][index % len(one[axis])] for axis in "xy"] for name, one in series.items()}

    before = places(scene["points"])
    to = np.add(before[joint], [0.01, -0.007])
    after = places(ask(ask="drag", text=text, point=joint, index=index, to=list(to))["points"])
    for name, place in before.items():
        there = to if place == pytest.approx(before[joint]) else place
        np.testing.assert_allclose(after[name], there, atol=1e-6, err_msg=name)


def test_a_drop_writes_what_the_drag_showed():
    text = EXAMPLES[FOURBAR]
    places = ask(ask="model", text=text)["places"]
    to = [4.0, 2.6]
    dragged = ask(ask="drag", text=text, point="C", index=0, to=to)
    assert [row[0] for row in dragged["changes"]] == ["BC", "CD"]
    text, _ = edited(text, places, {"do": "move", "point": "C", "to": to})
    found = ask(ask="model", text=text)
    efforts = found["scene"]["drivers"][0]["effort"], dragged["efforts"]["A"]
    np.testing.assert_allclose(*(np.array(effort, float) for effort in efforts), rtol=1e-4)
    assert found["places"]["rocker.C"] == pytest.approx(to, abs=1e-5)
    assert "chooses the branch" in text


@pytest.mark.spread(2)
@pytest.mark.parametrize("friction", ["stated", "off"])
@pytest.mark.parametrize(
    ("name", "path", "written", "value"),
    [
        (FOURBAR, "dimensions.BC", ("BC: 6.00 m", "BC: 5.7 m"), 5.7),
        ("drawing-press", "dimensions.L", ("L: 200 mm", "L: 210 mm"), 0.21),
        ("elliptic-trammel", "dimensions.b", ("b: 90 mm", "b: 92 mm"), 0.092),
    ],
)
def test_a_number_that_is_tried_gives_the_cycle_of_a_model_that_has_it(name, path, written, value, friction):
    text = EXAMPLES[name].replace(*written)
    assert text != EXAMPLES[name]
    result = analysed(text, friction=friction == "stated")
    scene = ask(ask="model", text=text, friction=friction)["scene"]
    for index in (0, 100, 250):
        tried = ask(ask="try", text=EXAMPLES[name], values={path: value}, index=index, friction=friction)
        margin, least = tried["margin"], float(result["locking_margin"][index])
        assert margin["beyond"] == (least > 3)
        assert margin["value"] == pytest.approx(min(least, 3.0), rel=1e-6)
    assert tried["status"] == scene["status"]
    for driver in scene["drivers"]:
        near = {"rtol": 0, "atol": 1e-6 * np.nanmax(np.abs(column(driver["effort"])))}
        np.testing.assert_allclose(column(tried["efforts"][driver["name"]]), column(driver["effort"]), **near)
    size = float(np.nanmax(np.abs(result["reaction_force"])))
    for joint in scene["joints"]:
        live = tried["joints"][joint["name"]]
        for axis in "xy":
            series = np.broadcast_to(column(joint["reaction"][axis]), 360)
            np.testing.assert_allclose(column(live[axis]), series, rtol=0, atol=1e-6 * size)
        lost = np.broadcast_to(column(joint["friction_power"]), 360)
        np.testing.assert_allclose(column(live["friction_power"]), lost, rtol=1e-5, atol=1e-6 * size)
        along = np.broadcast_to(column(joint["friction"] or [0.0]), 360)
        np.testing.assert_allclose(column(live.get("friction", [0.0] * 360)), along, rtol=0, atol=1e-6 * size)


def test_a_position_that_is_locked_while_it_is_dragged_has_its_margin_and_no_forces():
    text = EXAMPLES["drawing-press"].replace("friction: 0.1", "friction: 0.4")
    place = ask(ask="model", text=text)["places"]["lower.K"]
    dragged = ask(ask="drag", text=text, point="K", index=0, to=place)
    assert dragged["margin"]["value"] == pytest.approx(0.862, abs=5e-4)
    assert dragged["efforts"]["Z"][0] is None
    assert dragged["status"][0] == Status.LOCKED


def test_a_pin_on_the_ground_keeps_lengths_where_it_shall():
    text = EXAMPLES[FOURBAR]
    scene = ask(ask="model", text=text)["scene"]
    to = np.add([scene["points"]["rocker.D"][axis][0] for axis in "xy"], [0.1, -0.2])
    asked = {"text": text, "point": "D", "index": 0, "to": list(to)}
    found = ask(ask="drag", keep=True, **asked)["points"]
    for one, two in (("crank.B", "rocker.C"), ("rocker.C", "rocker.D")):
        before, after = (
            np.hypot(*(np.subtract(points[one][axis], points[two][axis]) for axis in "xy"))
            for points in (scene["points"], found)
        )
        np.testing.assert_allclose(after, before, rtol=1e-6)
    assert [found["rocker.D"][axis][0] for axis in "xy"] == pytest.approx(to, abs=1e-6)
    assert any(row[0] == "CD" for row in ask(ask="drag", **asked)["changes"])


def test_a_crank_follows_by_turning():
    found = ask(ask="drag", text=EXAMPLES[FOURBAR], point="B", index=10, to=[0.0, 2.2])
    track = found["points"]["crank.B"]
    assert found["index"] == 90
    assert (track["x"][90], track["y"][90]) == pytest.approx((0.0, 2.2), abs=1e-6)


def test_a_guide_goes_across_and_the_rod_along():
    text = EXAMPLES["slider-crank"]
    names = {one["type"]: one for one in ask(ask="model", text=text)["scene"]["joints"]}
    slide = names["prismatic"]["name"]
    spot = np.array(ask(ask="model", text=text)["places"][names["prismatic"]["at"]])
    found = ask(ask="drag", text=text, point=slide, index=0, to=[spot[0] + 0.001, spot[1] + 0.002])
    assert "error" not in found, found
    moved = [found["points"][names["prismatic"]["at"]][axis][0] for axis in "xy"]
    np.testing.assert_allclose(moved, [spot[0] + 0.001, spot[1] + 0.002], atol=1e-6)


@pytest.mark.parametrize(("size", "unit", "factor"), [(1e-6, "µm", 1e-6), (0.1, "mm", 1e-3), (1e3, "m", 1.0)])
def test_lengths_are_written_in_a_unit_that_suits_the_size(size, unit, factor):
    text = (
        f"trunnion: 1\nlinks:\n  ground: {{points: {{A: [0, 0]}}}}\n"
        f"  bar: {{points: {{A: [0, 0], B: [{size}, 0]}}}}\njoints: {{A: {{type: revolute, links: [ground, bar]}}}}\n"
    )
    places = {"ground.A": [0, 0], "bar.A": [0, 0], "bar.B": [size, 0]}
    text, places = edited(text, places, {"do": "link", "from": "bar.B", "to": [1.5 * size, 0]})
    number, written = entries_of(text)[0]["links"]["link1"]["points"]["C"][0].split()
    assert (float(number) * factor, written) == (pytest.approx(0.5 * size), unit)
    text, _ = edited(text, places, {"do": "add-point", "link": "bar", "at": [0.5 * size, 0.0]})
    assert entries_of(text)[0]["links"]["bar"]["points"]["D"][0].endswith(f" {unit}")  # and so it stays


def test_what_has_no_length_is_refused():
    text, places = edited("", {}, {"do": "link", "from": {"ground": [0, 0]}, "to": [0.05, 0.05]})
    move = {"do": "move", "point": "link1.B", "to": places["link1.A"]}
    found = ask(ask="edit", text=text, places=places, gestures=[move])
    assert "no length" in found["error"]


def test_the_other_assembly_is_one_click_away():
    text = EXAMPLES[FOURBAR]
    was = ask(ask="model", text=text)
    (other,) = ask(ask="assemblies", text=text)["others"]
    ghost = {key: (track["x"][0], track["y"][0]) for key, track in other["points"].items()}
    assert ghost["crank.B"] == pytest.approx(was["places"]["crank.B"])
    assert ghost["rocker.C"][1] < 0 < was["places"]["rocker.C"][1]
    text, _ = edited(text, was["places"], *other["gestures"])
    assert ask(ask="model", text=text)["places"]["rocker.C"] == pytest.approx(ghost["rocker.C"])


def test_the_least_margin_is_that_of_a_position_that_has_one():
    """The first positions cannot be assembled, the others are far from locking; the least is between two positions."""
    text = EXAMPLES[FOURBAR]
    for old, new in (("AD: 5.50 m", "AD: 4.2 m"), ("AB: 2.00 m", "AB: 2.6 m"), ("CD: 3.00 m", "CD: 1.2 m")):
        text = text.replace(old, new)
    found = ask(ask="model", text=text)
    assert found["margin"][0] is None
    assert {one for one in found["margin"] if one is not None} == {10.0}
    (figure,) = [one for one in analysed(text).trunnion.summary if one.name == "locking_margin"]
    assert found["margin_least"] == {"value": figure.value, "beyond": False, "at": figure.place.removeprefix("at ")}


def test_what_goes_nowhere_together_is_mended_by_a_gesture():
    """Its answer has places of no point, and these are what the gesture starts from."""
    found = solved(text := EXAMPLES[FOURBAR].replace("AD: 5.50 m", "AD: 55 m"))
    assert found["places"] == {}
    mended, _ = edited(text, found["places"], {"do": "set", "path": ["dimensions", "AD"], "value": "5.50 m"})
    assert len(solved(mended)["places"]) == len(found["scene"]["points"])


@pytest.mark.parametrize("name", [FOURBAR, "rssr"])
def test_where_nothing_loads_the_joints_there_is_no_margin(name):
    entries = entries_of(EXAMPLES[name])[0]
    links = {link: {"points": one["points"]} for link, one in entries["links"].items()}
    found = ask(ask="model", text=text_of({**entries, "links": links, "loads": {}}))
    assert found["solved"]
    assert (found["margin_least"], found["margin_why"]) == (None, "nothing loads its joints")


@pytest.mark.parametrize(
    ("name", "path"),
    [
        (FOURBAR, ["joints", "K", "pin", "radius"]),
        (FOURBAR, ["loads", "wind", "force", 0]),
        (FOURBAR, ["links", "coupler", "points", "K"]),
        ("spherical-four-bar", ["joints", "K", "friction", "coefficient"]),
    ],
)
def test_a_value_makes_no_part(name, path):
    found = ask(ask="edit", text=EXAMPLES[name], gestures=[{"do": "set", "path": path, "value": "5 mm"}])
    assert "is not there" in found["error"]


def test_a_link_that_the_loop_alone_names_takes_a_mass():
    text = "trunnion: 1\nspace: spatial\nloop:\n- {link: base, joint: A}\n- {link: crank, joint: B}\n"
    text = edited(text, {}, {"do": "set", "path": ["links", "crank", "mass"], "value": "2 kg"})[0]
    assert entries_of(text)[0]["links"] == {"crank": {"mass": "2 kg"}}


@pytest.mark.spread(2)
@pytest.mark.parametrize("what", ["csv", "report", "png", "svg"])
def test_files(what):
    found = ask(ask="export", text=EXAMPLES[FOURBAR], what=what, steps=36)
    assert len(found["bytes"]) > 500
    assert found["name"].startswith("Four-bar-of-Durango")
    if what == "csv":
        assert found["bytes"].count(b"\n") == 37
        assert b",A.effort [N m]," in found["bytes"].split(b"\n")[0]


def test_friction_that_is_not_whole_leaves_the_motion():
    text = EXAMPLES[FOURBAR].replace("coefficient: 0.4", "coefficient: banana 0.4")
    assert text != EXAMPLES[FOURBAR]
    found = ask(ask="model", text=text)
    assert found["solved"]
    assert found["bare"]
    assert "banana" in found["findings"][0]["what"]
    plain = analysed(EXAMPLES[FOURBAR], friction=False)
    np.testing.assert_allclose(found["scene"]["drivers"][0]["effort"], plain["drive_effort"].values[0], rtol=6e-7)
    assert "banana" in ask(ask="export", text=text, what="csv")["error"]
    worse = ask(ask="model", text=text.replace("BC: 6.00 m", "BC: 6.00 kg"))
    assert not worse["solved"]
    assert not worse["bare"]


@pytest.mark.slow
@pytest.mark.parametrize("index", [8, 200])
def test_of_many_joints_the_forces_are_those_of_the_position_that_is_shown(index):
    """A chain of 82 links: its paths are there, thinned, and its forces are those of the model that has the number."""
    text = chain(40)
    scene = ask(ask="model", text=text.replace("b: 140 mm", "b: 141 mm"))["scene"]
    tried = ask(ask="try", text=text, values={"dimensions.b": 0.141}, index=index)
    assert tried["index"] == index
    assert tried["status"] == [scene["status"][index]]
    here = {key: [(track[axis] * 360)[index] for axis in "xy"] for key, track in scene["points"].items()}
    for key, place in here.items():
        assert [tried["points"][key][axis] for axis in "xy"] == [pytest.approx([part], abs=1e-6) for part in place]
    efforts = tried["efforts"]["O"], [scene["drivers"][0]["effort"][index]]
    assert efforts[0] == pytest.approx(efforts[1], rel=1e-5)
    size = max(abs(part) for joint in scene["joints"] for axis in "xy" for part in joint["reaction"][axis])
    for joint in scene["joints"]:
        for axis in "xy":
            live = tried["joints"][joint["name"]][axis]
            assert live == pytest.approx([joint["reaction"][axis][index]], abs=1e-6 * size)
    assert sum(len(track["x"]) for track in tried["tracks"].values()) <= 20_000
    assert {"rocker0.B0", "rocker39.B39"} <= tried["tracks"].keys()
    assert not any(key.endswith(".C3") for key in tried["tracks"])  # a pin on the ground goes nowhere


def test_what_is_tried_or_dragged_in_space_is_the_model_that_has_it():
    text = EXAMPLES["rssr"]
    changed = text.replace("a: 30 mm", "a: 31 mm")
    tried = ask(ask="try", text=text, values={"dimensions.a": 0.031}, index=30)
    shown = ask(ask="model", text=changed)
    assert changed != text
    assert tried["status"] == shown["scene"]["status"]
    for joint, other in zip(tried["scene"]["joints"], shown["scene"]["joints"], strict=True):
        for axis in "xyz":
            np.testing.assert_allclose(column(joint["reaction"][axis]), column(other["reaction"][axis]), rtol=1e-5)
    assert tried["margin"]["value"] == pytest.approx(min(shown["margin"][30], 3.0), rel=1e-6)
    way = {"point": "A", "index": 10, "by": [0.0, 0.0, 0.002]}
    dragged = ask(ask="drag", text=text, **way)
    moved, _ = edited(text, {}, {"do": "move", "size": 0.2, **way})
    links = {link["name"]: link["pose"] for link in ask(ask="model", text=moved)["scene"]["links"]}
    for link in dragged["scene"]["links"]:
        for axis in "xyz":
            np.testing.assert_allclose(column(link["pose"][axis]), column(links[link["name"]][axis]), atol=2e-5)


@pytest.mark.slow
@pytest.mark.parametrize("index", [10, 200])
def test_of_many_contacts_the_margin_is_more_than_is_told(index):
    """What is told is proved by bounds of the equations; the margin itself is followed to where it locks."""
    text = chain(6).replace("friction: 0.1", "friction: 0.3").replace("radius: 5 mm", "radius: 30 mm")
    told = ask(ask="try", text=text, values={}, index=index)["margin"]
    run = prepare(model_of(text))
    followed = float(margin_in(run.solve(run.cycle.times(360)[[index]]), 3.0)[0])
    assert told["beyond"]
    assert 1.5 < told["value"] < min(followed, 3.0)
