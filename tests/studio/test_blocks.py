"""The mechanism as blocks: what passes their wires is that of `analyse`; built of blocks it is the drawn one."""

import json
import re

import numpy as np
import pytest

import trunnion
from studio.asking import EXAMPLES, analysed, ask, edited, model_of, near, sound, unpacked
from trunnion.model.file import entries_of, text_of
from trunnion.results.dataset import without_noise
from trunnion.studio.answers import answer

WATT = EXAMPLES["watt-six-bar"]


@pytest.mark.parametrize("name", ["watt-six-bar", "drawing-press", "rssr", "cardan-gears"])
def test_what_passes_the_wires_is_what_the_groups_give(name):
    """The load on the earlier link, with friction; and every joint is inside one block or the wire to one."""
    found, result = sound("blocks", EXAMPLES[name]), without_noise(analysed(EXAMPLES[name]))
    inner = [joint for block in found["blocks"] for joint in block.get("inner", [])]
    assert sorted(inner + [wire["joint"] for wire in found["wires"]]) == sorted(result["joint"].values)
    layout = json.loads(result.attrs["scene"])["joints"]
    for wire in found["wires"]:
        assert wire["from"] < wire["to"]
        joint, (earlier, later) = wire["joint"], wire["links"]
        assert earlier in found["blocks"][wire["from"]]["links"]
        assert later in found["blocks"][wire["to"]]["links"]
        back = -1 if layout[joint]["links"][1] == later else 1
        kind = "friction_force" if layout[joint]["type"] == "prismatic" else "friction_torque"
        near(wire["back"]["friction"], back * result[kind].sel(joint=joint))
        for axis in result["axis"].values:
            near(wire["back"]["force"][axis], back * result["reaction_force"].sel(joint=joint, axis=axis))
            for rate in ("position", "velocity"):
                track = result[f"point_{rate}"].sel(point=f"{later}.{joint}", axis=axis)
                near(wire["forward"][rate][axis], track)


def test_the_loads_on_a_block_balance():
    """Of a block without mass or load the forces that it takes from the wires add up to nothing, at every position."""
    entries = entries_of(WATT)[0]
    bare = {name: {"points": link["points"]} for name, link in entries["links"].items()}
    text = text_of(entries | {"links": bare, "loads": {"f": {"joint": "G", "resisting_torque": 5}}})
    found = sound("blocks", text)
    (first,) = [order for order, block in enumerate(found["blocks"]) if block["links"] == ["coupler", "bell-crank"]]
    for axis in "xy":
        forces = [
            (1 if wire["from"] == first else -1) * np.array(wire["back"]["force"][axis], float)
            for wire in found["wires"]
            if first in (wire["from"], wire["to"])
        ]
        largest = max(abs(force).max() for force in forces)
        assert largest > 1
        np.testing.assert_allclose(sum(forces), 0, atol=1e-5 * largest)


def test_shares_of_the_friction_add_up_to_one():
    shares = np.array([block["share"] for block in sound("blocks", WATT)["blocks"][1:]])
    np.testing.assert_allclose(shares.sum(axis=0), 1, atol=1e-5)


def built(*gestures):
    text, places = "", {}
    for one in gestures:
        found = sound("edit", text, places=places, gestures=[one])
        text, places = found["text"], found["places"]
    return model_of(text)


def block(kind, *pins, at="", **rest):
    return {"do": "block", "kind": kind, "pins": list(pins), "at": at, **rest}


def test_a_four_bar_and_a_six_bar_of_blocks_are_those_that_are_drawn():
    driver = block("driver", {"ground": "0, 0"}, at="0 mm, 40 mm")
    rocker = block("RRR", "link1.B", {"ground": "120 mm, 0 mm"}, at="100 mm, 80 mm")
    drawn = [
        {"do": "link", "from": {"ground": [0, 0]}, "to": [0, 0.04]},
        {"do": "driver", "joint": "A"},
        {"do": "link", "from": "link1.B", "to": [0.1, 0.08]},
        {"do": "link", "from": {"ground": [0.12, 0]}, "to": "link2.C"},
    ]
    more = block("RRR", "C", {"ground": "8 in, 0 in"}, at="180 mm, 90 mm")
    also = [
        {"do": "link", "from": "C", "to": [0.18, 0.09]},
        {"do": "link", "from": {"ground": [0.2032, 0]}, "to": "link4.F"},
    ]
    for blocks, strokes in (([driver, rocker], drawn), ([driver, rocker, more], [*drawn, *also])):
        own, other = built(*blocks), built(*strokes)
        assert own.links.keys() == other.links.keys()
        efforts = [
            trunnion.analyse(one.model_copy(update={"loads": {"t": {"joint": "D", "resisting_torque": 3}}}), 90)
            for one in (own, other)
        ]
        assert efforts[0].attrs["formula"] == efforts[1].attrs["formula"]
        np.testing.assert_allclose(*(one["drive_effort"].values for one in efforts), rtol=1e-12)


def test_dyads_with_a_slider_move():
    crank = block("driver", {"ground": "0 mm, 0 mm"}, at="20 mm, 0 mm")
    press = built(crank, block("RRP", "link1.B", at="100 mm, 0 mm"))
    assert trunnion.check(press).formula == "I(0,1)R → II(2,3)RRP"
    lever = built(crank, block("RPR", {"ground": "0 mm, -50 mm"}, "link1.B"))
    assert trunnion.check(lever).formula.endswith("RPR")
    geared = built(crank, block("driver", {"ground": "60 mm, 0 mm"}), block("gear", "A", "C", ratio="20:40"))
    assert geared.gears["gear1"].joints == ("A", "C")


@pytest.mark.parametrize("angle", ["35 deg", ""])
@pytest.mark.parametrize("first", [True, False])
def test_a_driver_and_a_ccc_are_a_cardan_joint(angle, first):
    """Pins of a cross at right angles, θ and φ from the common normal: sin θ sin φ + cos θ cos φ cos δ = 0,
    so that ω₂/ω₁ = cos δ / (1 − sin² δ cos² θ).
    """
    blocks = [block("CCC", at=angle)]
    text, _ = edited("", {}, *([block("driver", {"ground": "0 mm, 0 mm"})] if first else []), *blocks)
    result = analysed(text, 72)
    assert "CCC" in result.attrs["formula"]
    theta, phi = (result["joint_rotation"].sel(joint=joint).values for joint in "AD")
    rates = [result["joint_rotation_velocity"].sel(joint=joint).values for joint in "AD"]
    delta = np.radians(35 if angle else 30)
    near = {"rtol": 0, "atol": 1e-12}
    np.testing.assert_allclose(np.sin(theta) * np.sin(phi) + np.cos(theta) * np.cos(phi) * np.cos(delta), 0, **near)
    ratio = np.cos(delta) / (1 - np.sin(delta) ** 2 * np.cos(theta) ** 2)
    np.testing.assert_allclose(rates[1] / rates[0], ratio, **near)
    assert sound("model", text)["findings"] == []
    assert "closes a loop in space" in ask(ask="edit", text=text, places={}, gestures=blocks)["error"]


def test_groups_with_two_slides_and_of_class_three_move_as_their_closed_forms():
    crank = block("driver", {"ground": "0 mm, 0 mm"}, at="20 mm, 10 mm")
    yoke = built(crank, block("RPP", "link1.B", at="80 mm, 10 mm"))
    assert trunnion.check(yoke).formula == "I(0,1)R → II(2,3)RPP"
    found = trunnion.analyse(yoke, 24)
    angle = found["link_angle"].sel(link="link1").values
    slide = found["joint_slide"].sel(joint="F").values
    cosine = np.hypot(20e-3, 10e-3) * np.cos(angle)
    np.testing.assert_allclose(slide - slide[0], cosine - cosine[0], atol=1e-12)
    slotted = built(crank, block("PRP", "link1.B", at="10 mm, 5 mm"))  # across the crank as it is drawn
    assert trunnion.check(slotted).formula.endswith("PRP")
    found = trunnion.analyse(slotted, 24)
    turned = found["link_angle"].sel(link="link1").values - np.arctan2(10, 20)
    solved = found["status"].values < 3
    assert solved.sum() >= 20
    tangent = np.hypot(10e-3, 5e-3) * np.tan(turned)
    np.testing.assert_allclose(found["joint_slide"].sel(joint="D").values[solved], tangent[solved], atol=1e-9)
    pins = "link1.B", {"ground": "120 mm, 0 mm"}, {"ground": "60 mm, 120 mm"}
    plate = built(crank, block("triad", *pins))
    assert trunnion.check(plate).formula == "I(0,1)R → III(2,3,4,5)RRRRRR"
    found = trunnion.analyse(plate, 24)
    assert np.all(found["status"] == 0)
    assert found["closure_residual"].max() < 1e-9


@pytest.mark.parametrize(
    ("gesture", "words"),
    [
        (block("XYZ"), "is no block"),
        (block("driver", {"ground": "0 mm"}), "is no place"),
        (block("driver", {"ground": "0 kg, 1 kg"}), "is no length"),
        (block("RRR", {"ground": "0, 0"}, {"ground": "0, 0"}), "same pin twice"),
        (block("RPR", {"ground": "0, 0"}, {"ground": "1, 0"}), "choose a pin that is drawn"),
        (block("RRR", "none", {"ground": "1, 0"}), "is not a joint or a point"),
    ],
)
def test_what_cannot_be_placed_is_refused_in_words(gesture, words):
    question = {"ask": "edit", "text": "", "places": {}, "gestures": [gesture], "revision": 1}
    assert words in unpacked(answer(json.dumps(question).encode()))["error"]


def opened(user, text):
    user.of("actions", "m.takeText(given, 'Edit')", text)
    user.until(f"s.solved.value && s.answer.value.text.length === {len(text)}")


@pytest.mark.slow
def test_blocks_links_and_terms_light_each_other(user):
    page = user.page
    opened(user, WATT)
    terms = page.locator(".formula .term")
    assert terms.all_inner_texts() == ["I(0,1)R", "II(2,3)RRR", "II(4,5)RRR"]
    terms.nth(1).click()
    page.locator(".wiring .block.chosen").wait_for()
    assert "coupler" in page.locator(".wiring .block.chosen").get_attribute("aria-label")
    lit = page.locator("g.of-block").evaluate_all("list => list.map((one) => one.dataset.name).sort()")
    assert lit == ["bell-crank", "coupler"]
    user.of("state", "m.selection.value = {kind: 'links', name: 'agitator'}")
    page.locator(".wiring .block.chosen[aria-label*=agitator]").wait_for()
    rows = page.locator(".passing tbody tr")
    assert rows.count() == 2
    assert "from bell-crank" in rows.first.inner_text()


@pytest.mark.slow
def test_links_wires_and_curves_are_reached_by_keys(user):
    page = user.page
    opened(user, WATT)
    page.get_by_role("button", name="Link coupler", exact=True).focus()
    page.keyboard.press("Enter")
    assert user.state("s.selection.value.name") == "coupler"
    page.get_by_role("tab", name="Blocks").click()
    page.get_by_role("button", name=re.compile("^Wire G from")).focus()
    page.keyboard.press("Enter")
    assert user.state("s.selection.value") == {"kind": "joints", "name": "G"}
    page.get_by_role("tab", name="Plots").click()
    page.locator(".charts .chart").first.focus()
    user.keys("Shift+ArrowRight", "ArrowLeft")
    assert user.state("s.index.value") == 9
    effort = analysed(WATT)["drive_effort"].values[0, 9]
    assert f"torque {effort:.2f} [N m]" in page.locator(".notice").inner_text()


@pytest.mark.slow
def test_a_mechanism_is_built_of_blocks_by_the_keyboard(user):
    page = user.page
    user.new_sheet()
    page.get_by_role("tab", name="Blocks").click()
    page.get_by_label("Place of pin 1").fill("0 mm, 0 mm")
    page.get_by_label("End at").fill("0 mm, 40 mm")
    page.get_by_role("button", name="Place the block").press("Enter")
    user.until("Object.keys(s.answer.value?.entries?.links ?? {}).length === 2")
    page.get_by_label("Kind of block").select_option("RRR")
    page.get_by_label("Pin 1", exact=True).select_option("link1.B")
    page.get_by_label("Place of pin 2").fill("120 mm, 0 mm")
    page.get_by_label("Inner pin at").fill("100 mm, 80 mm")
    page.get_by_role("button", name="Place the block").press("Enter")
    user.until("s.solved.value")
    assert page.locator(".formula .term").all_inner_texts() == ["I(0,1)R", "II(2,3)RRR"]
