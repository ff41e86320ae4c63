"""Mechanisms in space in the studio's page: choosing, moving, layers, table of a loop; numbers against `analyse`."""

import numpy as np
import pytest

from studio.asking import EXAMPLES, analysed, edited
from trunnion.model.file import entries_of

FINE = 2e-6  # m: coordinates are written to the thousandth of a step of the grid
MODELS = {name: EXAMPLES[name] for name in ("rssr", "rssr-with-play")}


def place(result, key, index):
    return result["point_position"].sel(point=key).isel(position=index).values


def test_rows_of_a_loop_come_and_go_and_the_others_stay_as_written():
    """With names and comments; what speaks of a name that changes follows; the ground stays the last link."""
    text = EXAMPLES["pezzuti-cardan"]
    before = entries_of(text)[0]
    longer, _ = edited(text, {}, {"do": "add-row"})
    rows = entries_of(longer)[0]["loop"]
    assert (rows[:3], rows[4]) == (before["loop"][:3], before["loop"][3])
    comments = [line for line in text.splitlines() if "#" in line]
    assert set(comments) <= set(longer.splitlines())
    back, _ = edited(longer, {}, {"do": "delete", "what": ["joints", rows[3]["joint"]]})
    assert entries_of(back)[0] == before
    shorter = entries_of(edited(text, {}, {"do": "delete", "what": ["joints", "output"]})[0])[0]
    assert [row["link"] for row in shorter["loop"]] == ["input-shaft", "cross", "ground"]
    assert "output-shaft" not in shorter["links"]
    renamed = entries_of(edited(text, {}, {"do": "rename", "what": ["joints", "pin-1"], "to": "pin"})[0])[0]
    assert (renamed["loop"][1]["joint"], renamed["links"]["input-shaft"]["frame"]) == ("pin", "pin")
    driven = entries_of(edited(text, {}, {"do": "driver", "joint": "output"})[0])[0]
    assert list(driven["drivers"]) == ["output"]


@pytest.mark.spread(1)
@pytest.mark.parametrize(("example", "joint"), [("rssp", "B"), ("rssr", "C"), ("rssr", "A")])
def test_a_joint_moved_in_space_goes_so_far_and_nothing_else_does(example, joint):
    """At the position that is shown; whatever its coordinates are written as."""
    text, by = EXAMPLES[example], np.array([2e-3, -1e-3, 5e-4])
    gesture = {"do": "move", "point": joint, "by": by.tolist(), "index": 30, "size": 0.2}
    old, new = analysed(text), analysed(edited(text, {}, gesture)[0])
    for key in map(str, old["point"].values):
        expected = by if key.endswith(f".{joint}") else 0.0
        np.testing.assert_allclose(place(new, key, 30) - place(old, key, 30), expected, atol=2e-9)


def arrow(path):
    """Along x and y, px, from the start of an arrow to its tip."""
    (x, y), (a, b) = (map(float, part.split("L")[0].split(",")) for part in path.split("M")[1:3])
    return a - x, b - y


def quantity(words, unit):
    """The last number of a text, in its unit without a prefix."""
    number, prefixed = words.replace("\u2212", "-").replace("\u202f", "").replace("\u00a0", " ").split()[-2:]
    return float(number) * {"": 1, "m": 1e-3, "µ": 1e-6, "k": 1e3}[prefixed.removesuffix(unit)]


def spot(user, name):
    """The middle of a handle of the picture, px."""
    user.page.wait_for_selector(".hands .handle", timeout=5000)
    box = user.page.locator(f'.hands .handle[data-name="{name}"]').bounding_box()
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


@pytest.mark.slow
def test_what_is_chosen_in_the_picture_is_lit_and_moved_along_an_axis(user):
    """By click, key and arrow; the joint goes so far along x; nothing else moves at the position that is shown."""
    user.page.mouse.click(*spot(user, "rod"))  # the middle of its body
    assert user.state("s.selection.value") == {"kind": "links", "name": "rod"}
    assert "Link" in user.page.locator(".of-part").inner_text()
    user.page.locator('.hands .handle[data-name="B"]').focus()
    user.keys("Enter")
    assert user.state("s.selection.value") == {"kind": "joints", "name": "B"}
    assert user.page.locator(".joint-axis.lit").count() == 0  # a ball has none
    user.state("s.index.value = 40")
    user.page.mouse.click(*spot(user, "C"))
    before = user.state("s.text.value")
    (x, y), arm = spot(user, "C"), user.page.locator(".arm.of-x .wide").bounding_box()
    tip = arm["x"] + arm["width"] - 3, arm["y"] + arm["height"] / 2
    user.page.mouse.move(*tip)
    user.page.mouse.down()
    user.page.mouse.move(tip[0] + 20, tip[1] + 4)
    user.page.mouse.move(tip[0] + 44, tip[1] + 8)
    said = user.state("s.notice.value.words")
    user.until("s.live.value?.scene && s.live.value.margin")  # as it comes to be, with its margin
    assert "here" in user.page.locator(".bar.bottom .margin").inner_text()
    user.page.mouse.up()
    user.until("s.past.value.length === 1 && s.live.value === null")
    by = float(said.split("x ")[1].split()[0]) / 1e3
    old, new = analysed(before), analysed(user.state("s.text.value"))
    assert 2e-3 < by < 3e-2
    np.testing.assert_allclose(place(new, "rod.C", 40) - place(old, "rod.C", 40), [by, 0, 0], atol=FINE)
    for key in ("crank.B", "rocker.D"):
        np.testing.assert_allclose(place(new, key, 40), place(old, key, 40), atol=FINE)
    moved = spot(user, "C")
    assert moved[0] > x + 5
    assert abs(moved[1] - y) < 25
    user.keys("Control+z")
    user.until("s.past.value.length === 0")
    assert user.state("s.text.value") == before


@pytest.mark.slow
def test_end_loads_and_the_section_of_a_pin_have_the_numbers_of_analyse(user):
    """Arrows times the scale that is stated; offset and tilt from the seats of both ends."""
    user.of("actions", "m.openFile('rssr-with-play.yaml')")
    user.until("s.solved.value && s.answer.value.scene.built")
    user.state("s.index.value = 60")
    user.page.get_by_label("end loads of bearings").check()
    user.page.get_by_label("reactions", exact=True).uncheck()
    user.page.click("button[aria-label='Look along the y axis']")
    user.page.mouse.click(*spot(user, "D"))
    user.idle()
    result = analysed(user.state("s.text.value"))
    size = user.page.locator(".key text", has_text="on an end").text_content()
    scale = arrow(user.page.locator(".key .reference").last.get_attribute("d"))[0] / quantity(size, "N")
    drawn = [arrow(one.get_attribute("d")) for one in user.page.locator(".reaction.of-end").all()]
    loads = [result["end_load"].sel(joint=joint).isel(position=60).values for joint in "AD"]
    expected = np.concatenate([load[np.isfinite(load).all(axis=1)][:, [0, 2]] for load in loads]) * scale
    np.testing.assert_allclose(drawn, expected * [1, -1], atol=0.4)  # px: ends are written to a tenth
    told = user.page.locator(".pin-section").evaluate_all("all => all.map(one => one.getAttribute('aria-label'))")
    ends = result["seat_offset"].sel(joint="D").isel(position=60).values
    for axis, words in enumerate(told):
        assert words.startswith(f"Section of D in z and {'xy'[axis]}:")
        offset, tilt = words.split("offset ")[1].split(", tilt ")
        np.testing.assert_allclose(quantity(offset, "m"), ends[:, axis].mean(), rtol=2e-3)
        np.testing.assert_allclose(quantity(tilt, "rad"), np.diff(ends[:, axis])[0] / 0.02, rtol=2e-3)


@pytest.mark.slow
def test_a_cardan_joint_is_built_from_an_empty_sheet_by_its_table(user):
    """One revolute and three cylindrical joints; tan(out) = tan(in) / cos(angle of the shafts) to 1e-12."""
    user.page.click("summary:has-text('File')")
    user.page.click("button:has-text('New sheet')")
    user.page.click("button:has-text('A loop in space, by its table')")
    user.until("s.solved.value")
    before = spot(user, "D")
    for label, typed in (("joint of row 4", "out"), ("twist α of out", "155"), ("offset s of A", "12 mm")):
        user.page.get_by_label(label).fill(typed)
        user.page.get_by_label(label).press("Enter")
        user.idle()
    assert np.hypot(*np.subtract(spot(user, "out"), before)) > 5  # the picture follows
    assert "twist: 155 deg" in user.state("s.text.value")
    result = analysed(user.state("s.text.value"), 90)
    into, out = (result["joint_rotation"].sel(joint=joint).values for joint in ("A", "out"))
    out = out - out[0]
    residual = np.sin(out) * np.cos(into) * np.cos(np.radians(25)) - np.cos(out) * np.sin(into)
    assert np.abs(residual).max() < 1e-12
    assert np.ptp(out) > 6
