"""Linkages drawn, joined, chosen, copied and mirrored on the sheet, with the mouse, by keyboard and by fingers."""

import re

import numpy as np
import pytest

from studio.asking import analysed
from studio.test_gestures import SIX_BAR, TYPED
from trunnion.model.file import entries_of

RUBBING = {"pin": {"radius": "7 mm"}, "friction": 0.06}


class Hand:
    """A hand on the sheet: places in m; `by` mouse, keyboard or touch."""

    def __init__(self, user, by):
        self.user, self.by, self.page = user, by, user.page
        self.touch = self.page.context.new_cdp_session(self.page)
        if by == "touch":
            self.touch.send("Emulation.setTouchEmulationEnabled", {"enabled": True})

    def at(self, place):
        """A place of the sheet on the page, px."""
        box = self.page.locator(".sheet").bounding_box()
        x, y = self.user.of("sheet", "m.sheet.view.frame.to(given)", list(place))
        return box["x"] + x, box["y"] + y

    def tool(self, key, label):
        if self.by == "touch":
            self.page.click(f".tool:has-text('{label}')")
        else:
            self.page.locator(".sheet > svg").focus()
            self.page.keyboard.press(key)

    def click(self, place, shift=False):
        if self.by == "mouse":
            self.page.keyboard.down("Shift") if shift else None
            self.page.mouse.move(*np.add(self.at(place), -2))
            self.page.mouse.click(*self.at(place))
            self.page.keyboard.up("Shift") if shift else None
        elif self.by == "touch":
            self.fingers("touchStart", self.at(place))
            self.fingers("touchEnd")
        else:
            self.cross(place)
            self.page.keyboard.press("Shift+Enter" if shift else "Enter")
        self.user.idle()

    def cross(self, place):
        """Arrow keys until the cross is there, a step of the grid each."""
        self.page.locator(".sheet > svg").focus()
        self.page.keyboard.press("ArrowLeft")
        step = self.user.of("sheet", "m.sheet.step()")
        now = self.user.of("tools", "m.pointer.value.spot.at")
        for axis, (less, more) in enumerate((("ArrowLeft", "ArrowRight"), ("ArrowDown", "ArrowUp"))):
            count = round((place[axis] - now[axis]) / step)
            for _ in range(abs(count)):
                self.page.keyboard.press(more if count > 0 else less)

    def fingers(self, kind, *places):
        points = [{"x": x, "y": y, "id": 0} for x, y in places]
        self.touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    def drag(self, start, end):
        """From a place to another, as a hand does."""
        spots = [np.array(self.at(start)) + share * np.subtract(self.at(end), self.at(start)) for share in (0, 0.3, 1)]
        if self.by == "touch":
            self.fingers("touchStart", spots[0])
            for spot in spots[1:]:
                self.fingers("touchMove", spot)
            self.fingers("touchEnd")
        else:
            self.page.mouse.move(*spots[0])
            self.page.mouse.down()
            for spot in spots[1:]:
                self.page.mouse.move(*spot)
            self.page.mouse.up()
        self.user.idle()

    def link(self, start, end, pinned=False):
        self.tool("l", "Link")
        self.click(start, shift=pinned and self.by != "touch")
        self.click(end)
        if pinned and self.by == "touch":
            self.tool("p", "Pin")
            self.click(start)
        self.tool("v", "Select")

    def join(self, start, end):
        """An end is dropped on another; by keyboard with the tool."""
        if self.by != "keyboard":
            return self.drag(start, end)
        self.tool("j", "Join")
        self.click(start)
        self.click(end)
        return self.tool("v", "Select")


def effort(text):
    return analysed(text, 360)["drive_effort"].values[0]


@pytest.mark.slow
@pytest.mark.parametrize("by", ["keyboard", "touch"])
def test_a_watt_six_bar_closed_by_joins_is_the_typed_one(user, by):
    user.new_sheet()
    user.page.locator(".sheet > svg").focus()
    user.keys("+", "+")
    hand, spot = Hand(user, by), {key: np.add(place, (-0.105, -0.04)) for key, place in SIX_BAR.items()}
    for start, end in (("A", "B"), ("D", "C"), ("G", "H")):
        hand.link(spot[start], spot[end], pinned=True)
    aside = np.array([[-0.1, 0.055], [0.03, 0.055]])
    for ends in (("B", "C"), ("F", "H")):
        hand.link(*aside)
        for start, end in zip(aside, ends, strict=True):
            hand.join(start, spot[end])
    assert len(user.state("Object.keys(s.answer.value.entries.joints)")) == 7
    hand.tool("d", "Drive")
    hand.click(spot["A"])
    hand.tool("v", "Select")
    user.until("s.solved.value")
    rubbing = {"do": "set", "path": ["joint_defaults"], "value": RUBBING}
    pivot = user.state("Object.keys(s.answer.value.entries.links.ground.points)[2]")
    user.of("actions", "m.edit(given)", [{"do": "load", "against": pivot, "size": "6 N m"}, rubbing])
    drawn, typed = effort(user.state("s.text.value")), effort(TYPED)
    np.testing.assert_allclose(drawn, typed, rtol=0, atol=1e-12 * np.abs(typed).max())
    for _ in range(user.state("s.past.value.length")):
        user.of("actions", "m.undo()")
    user.idle()
    assert user.state("s.text.value") == ""
    hand.link((-0.05, 0), (0.05, 0.05))
    hand.link((-0.05, 0.05), (0.03, -0.03))
    hand.tool("j", "Join")
    hand.click((-0.015, 0.015))  # beside the crossing: x/2 + 25 = -x for x = -50/3 mm
    user.until("s.answer.value.text === s.text.value && Object.keys(s.answer.value.entries.joints ?? {}).length")
    place = next(at for key, at in user.state("s.places.value").items() if key == "link2.E")
    np.testing.assert_allclose(place, [-0.05 / 3, 0.05 / 3], atol=1e-5)


@pytest.mark.slow
def test_a_mass_centre_is_dragged_with_the_forces_of_where_it_is(user):
    """By mouse, arrow key and finger; the crank lies along x: its frame is that of the sheet."""
    hand = Hand(user, "mouse")
    assert user.state("s.answer.value.numbers")["links.crank.centre.x"] == 1.0
    x, y = hand.at((1.0, 0.0))
    user.page.mouse.move(x, y)
    user.page.mouse.down()
    user.page.mouse.move(*hand.at((1.1, 0.1)))
    user.page.mouse.move(*hand.at((1.2, 0.3)))
    user.until("s.live.value?.efforts")
    live = user.state("s.live.value.efforts[s.answer.value.scene.drivers[0].name][s.index.value]")
    user.page.mouse.up()
    user.until("s.text.value.includes('1.2 m, 0.3 m') && s.answer.value.text === s.text.value && !s.live.value")
    torque = effort(user.state("s.text.value"))[user.state("s.index.value")]
    assert live == pytest.approx(torque, rel=1e-7)  # it comes as single precision
    mark = user.page.locator('.handle[data-kind="centres"][data-name="crank"]')
    assert mark.get_attribute("aria-label").replace("\xa0", " ") == "Mass centre of crank, 4.8 kg, at 1.2 m, 300 mm"
    step = user.of("sheet", "m.sheet.step()")
    mark.focus()
    user.keys("ArrowRight")
    assert user.state("s.answer.value.numbers")["links.crank.centre.x"] == pytest.approx(1.2 + step)
    Hand(user, "touch").drag((1.2 + step, 0.3), (1.0, 0.0))
    assert user.state("s.answer.value.numbers")["links.crank.centre.x"] == pytest.approx(1.0)
    assert user.state("s.past.value.length") == 3


@pytest.mark.slow
@pytest.mark.parametrize("by", ["keyboard", "touch"])
def test_a_mechanism_is_mirrored_by_its_menu(user, by):
    """The four-bar takes the mirrored torque: that of before with the other sign."""
    hand, before = Hand(user, by), effort(user.state("s.text.value"))
    corner = user.of("sheet", "m.sheet.view.frame.from([40, 300])")
    if by == "keyboard":
        user.page.locator(".sheet > svg").focus()
        user.keys("Control+a", "Shift+F10")
        user.keys("ArrowDown", "Enter")
    else:
        hand.fingers("touchStart", hand.at(corner))
        user.until("document.querySelector('.context')")
        hand.fingers("touchEnd")
        user.page.click("role=menuitem[name='Choose all links']")
        assert user.page.locator(".of-group").count() == 3
        user.page.click("role=button[name='Mirror left to right']")
    user.until("s.past.value.length === 1 && s.answer.value.text === s.text.value && s.solved.value")
    after = effort(user.state("s.text.value"))
    np.testing.assert_allclose(after, -before, rtol=0, atol=1e-12 * np.abs(before).max())


@pytest.mark.slow
def test_links_in_a_box_are_moved_copied_and_deleted(user):
    user.new_sheet()
    hand = Hand(user, "mouse")
    for start, end in (((-0.1, 0), (-0.1, 0.05)), ((0, 0), (0, 0.05)), ((0.1, 0), (0.1, 0.05))):
        hand.link(start, end)
    user.page.keyboard.down("Shift")
    hand.drag((-0.14, -0.04), (0.04, 0.08))
    user.page.keyboard.up("Shift")
    assert user.state("s.group.value") == ["link1", "link2"]
    hand.drag((0, 0.025), (0.02, 0.025))
    places = user.state("s.places.value")
    assert places["link1.A"] == pytest.approx([-0.08, 0])
    assert places["link3.E"] == pytest.approx([0.1, 0])
    user.page.locator(".sheet > svg").focus()
    user.keys("ArrowUp", "Control+d")
    step = user.of("sheet", "m.sheet.step()")
    assert user.state("s.group.value") == ["link4", "link5"]
    copied = user.state("Object.entries(s.places.value).filter(([key]) => key.startsWith('link5')).map(one => one[1])")
    np.testing.assert_allclose(copied, [[0.02 + 2 * step, 3 * step], [0.02 + 2 * step, 0.05 + 3 * step]])
    for by, corners in (("keyboard", [(-0.1, -0.02), (-0.07, 0.08)]), ("touch", [(-0.1, -0.02), (-0.07, 0.08)])):
        other = Hand(user, by)
        user.keys("Escape")
        other.tool("b", "Box")
        if by == "touch":
            other.drag(*corners)
        else:
            other.click(corners[0])
            other.click(corners[1])
        assert user.state("s.group.value") == ["link1"]
    user.of("group", "m.chooseLinks(given)", ["link4", "link5"])
    user.page.locator(".sheet > svg").focus()
    user.keys("Delete")
    assert user.state("Object.keys(s.answer.value.entries.links).length") == 4
    user.keys("Control+z", "Control+z")
    assert user.state("s.places.value")["link1.A"] == pytest.approx([-0.08, step])


@pytest.mark.slow
def test_dimensions_are_those_of_the_model(user):
    """Of a slider-crank 100 mm beside its guide, which is turned by 30°, and a triangle 30-40-50."""
    user.new_sheet()
    gestures = [
        {"do": "link", "from": {"ground": [0, 0]}, "to": [0.08, 0]},
        {"do": "link", "from": "link1.B", "to": [0.08, 0.2]},
        {"do": "slide", "joint": "link2.C", "angle": float(np.radians(30))},
        {"do": "link", "from": {"ground": [-0.1, 0]}, "to": [-0.06, 0]},
        {"do": "add-point", "link": "link3", "at": [-0.1, 0.03]},
    ]
    user.of("actions", "m.edit(given)", gestures)
    user.page.click("summary:has-text('Show')")
    user.page.click("label:has-text('Dimensions')")
    user.of("sheet", "m.sheet.fit()")
    words = [one.replace("\xa0", " ") for one in user.page.locator(".dimension-text, .laid").all_text_contents()]
    beside = 0.2 * np.cos(np.radians(30)) - 0.08 * np.sin(np.radians(30))  # of the guide through C from A
    lengths = ["80 mm", "200 mm", f"{1e3 * beside:.1f} mm", "100 mm", "40 mm", "30 mm", "50 mm"]
    assert sorted(words) == sorted([*lengths, "30°"])


@pytest.mark.slow
def test_a_first_mechanism_is_drawn_step_by_step(user):
    """By the reader's own clicks at the rings; the slider goes by r cos q + √(l² − r² sin² q)."""
    user.new_sheet()
    user.page.wait_for_selector(".welcome .card:nth-child(1) path")
    assert user.page.locator(".welcome .card").count() == 6
    user.page.click("text=Draw a first mechanism, step by step")
    for key, count in (("l", 2), ("p", 1), ("l", 2), ("g", 2), ("d", 1)):
        user.page.locator(".sheet > svg").focus()
        user.page.keyboard.press(key)
        assert user.page.locator(".ring").count() == count
        for one in [user.page.locator(".ring circle").nth(k).bounding_box() for k in range(count)]:
            user.page.mouse.move(one["x"] + 13, one["y"] + 13)
            user.page.mouse.click(one["x"] + one["width"] / 2, one["y"] + one["height"] / 2)
            user.idle()
    user.until("s.solved.value")
    user.page.click("role=button[name='Play']")
    user.until("s.index.value > 0")
    assert user.page.locator(".guide b").text_content() == "It runs"
    user.page.click("role=button[name='Close']")
    scene = user.state("s.answer.value.scene")
    (x, y), (end, _) = ([np.array(scene["points"][key][axis]) for axis in "xy"] for key in ("link1.B", "link2.C"))
    r, length = 0.04, np.hypot(0.15, 0.04)
    turn = np.arctan2(y, x + 0.08)
    expected = -0.08 + r * np.cos(turn) + np.sqrt(length**2 - (r * np.sin(turn)) ** 2)
    np.testing.assert_allclose(end, expected, atol=1e-5)  # lengths are as fine as the sheet
    assert user.page.evaluate("localStorage.getItem('trunnion studio tutorial')") == "done"


def draw(user, *strokes):
    """Strokes of the mouse: the key of a tool, and places in px, with Shift where a third is given, or letters."""
    for tool, *places in strokes:
        steps = user.state("s.past.value.length")
        user.keys(tool)
        for place in places:
            if isinstance(place, str):
                user.page.keyboard.type(place)
            else:
                user.click(*place[:2], shift=len(place) > 2)
        user.until(f"s.past.value.length > {steps}")
    user.keys("v")


def drag(user, name, dx, dy):
    """A joint pulled by so many px, as a hand does."""
    x, y = user.handle(name)
    user.page.mouse.move(x, y)
    user.page.mouse.down()
    for k in range(1, 11):
        user.page.mouse.move(x + 0.1 * k * dx, y + 0.1 * k * dy)
        user.page.wait_for_timeout(16)
    user.page.mouse.up()
    user.idle()
    return x, y


@pytest.mark.slow
def test_gears_springs_forces_and_a_ternary_link_with_typed_values(user):
    user.new_sheet()
    draw(
        user,
        ("l", (250, 300, 1), "30\n"),  # towards the pointer
        ("l", (430, 300, 1), (500, 240)),
        ("l", (500, 240), (640, 240)),
        ("l", (570, 240), (570, 380, 1)),  # its end on the middle of the third: a ternary link
        ("e", (250, 300), "20:40", (430, 300)),
        ("d", (250, 300)),
        ("f", (640, 240), "250 N", (640, 340)),
        ("s", (640, 240), "2", (740, 240)),
    )
    entries = entries_of(user.state("s.text.value"))[0]
    assert entries["gears"]["gear1"]["ratio"] == "-20/40"
    assert entries["links"]["link1"]["points"]["B"] == ["30 mm", 0]
    assert len(entries["links"]["link3"]["points"]) == 3
    assert entries["springs"]["spring1"]["stiffness"] == "2 N/mm"
    assert entries["loads"]["load1"]["force"] == ["0 N", "-250 N"]
    assert user.state("s.solved.value")


def lengths(user):
    links = user.state("s.answer.value.entries.links")
    return {name: links[name]["points"] for name in ("link1", "link2", "link3")}


@pytest.mark.slow
def test_a_joint_on_its_path_moves_the_mechanism_and_off_it_changes_lengths(user):
    user.new_sheet()
    user.draw_four_bar()
    drawn, turn = user.state("s.text.value"), user.handle("A")
    x, y = user.handle("B")
    drag(user, "B", 75, 25)  # far off the circle: the drive turns it all the same
    assert user.state("s.text.value") == drawn
    assert "lengths" in user.state("s.notice.value.words")
    now = user.handle("B")
    assert np.hypot(*np.subtract(now, turn)) == pytest.approx(np.hypot(x - turn[0], y - turn[1]), abs=0.5)
    assert np.arctan2(turn[1] - now[1], now[0] - turn[0]) < np.arctan2(turn[1] - y, x - turn[0]) - 0.5
    x, y = user.handle("C")
    drag(user, "C", 4, 4)  # beside its path
    assert user.state("s.text.value") == drawn
    user.page.keyboard.down("Alt")
    drag(user, "B", 0, -20)
    user.page.keyboard.up("Alt")
    assert user.state("s.text.value") != drawn
    words = user.state("s.notice.value.words")
    assert words.startswith("Move B: x of B on link1 ")
    told = re.findall(r"([xy]) of (\w+) on (\w+) \S+ \S+ → (\S+ mm)", words)  # as told while the crank followed
    assert told
    for axis, point, link, length in told:
        assert lengths(user)[link][point]["xy".index(axis)] == length
    user.keys("Control+z")
    assert user.state("s.text.value") == drawn


@pytest.mark.slow
def test_two_fingers_shift_and_zoom_the_sheet(user):
    touch = user.page.context.new_cdp_session(user.page)
    touch.send("Emulation.setTouchEmulationEnabled", {"enabled": True})
    where = "((frame) => [frame.scale, ...frame.to([0, 0])])(m.sheet.view.frame)"
    user.idle()  # the first answer may fit the sheet anew
    scale, *origin = user.of("sheet", where)
    before, box = user.state("s.text.value"), user.page.locator(".sheet").bounding_box()

    def fingers(kind, *places):
        points = [{"x": box["x"] + x, "y": box["y"] + y, "id": k} for k, (x, y) in enumerate(places)]
        touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    x, y = user.handle("C")
    held = (x - box["x"], y - box["y"])  # the first finger is on a joint, which stays
    fingers("touchStart", held)
    fingers("touchMove", (held[0] - 30, held[1]))
    fingers("touchStart", (held[0] - 30, held[1]), (held[0] - 130, held[1]))
    fingers("touchMove", (held[0] + 20, held[1]), (held[0] - 130, held[1]))
    fingers("touchEnd")
    user.idle()
    now, *after = user.of("sheet", where)
    assert now == pytest.approx(1.5 * scale, rel=1e-4)
    middle = np.array([held[0] - 80, held[1]])
    np.testing.assert_allclose(after, middle + [25, 0] + 1.5 * (np.array(origin) - middle), atol=1e-3)
    assert user.state("s.text.value") == before
    assert user.state("s.live.value") is None
