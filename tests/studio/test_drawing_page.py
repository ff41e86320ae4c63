"""Linkages drawn by mouse alone from an empty sheet, beside model files that state the same in their own way."""

from __future__ import annotations

import re

import numpy as np
import pytest

import trunnion
from browsing import CHROMIUM
from trunnion.model.file import entries_of
from trunnion.model.mechanism import Mechanism

PEAK = 1e-6  # of the peak: how near a torque must be
RUBBING = "joint_defaults: {pin: {radius: 5 mm}, guide: {length: 30 mm}, friction: 0.1}\n"
SHAPER = (
    """
trunnion: 1
space: planar
dimensions: {r: 50 mm, s: %s, l: 170 mm}
links:
  frame: {points: {O: [0, 30 mm], C: [0, 0], R: {at: [20 mm, -30 mm], axis: [1, 0]}}}
  crank: {points: {O: [0, 0], P: [0, r]}}
  slider: {points: {P: [0, 0], S: {at: [0, 0], axis: [0, 1]}}}
  lever: {points: {C: [0, 0], S: {at: [0, 0], axis: [0, 1]}, D: [0, -s]}}
  rod: {points: {D: [-l, 0], F: [0, 0]}}
  ram: {points: {F: [0, 0], R: {at: [0, 0], axis: [1, 0]}}}
joints:
  O: {type: revolute, links: [frame, crank]}
  P: {type: revolute, links: [crank, slider]}
  S: {type: prismatic, links: [lever, slider]}
  C: {type: revolute, links: [frame, lever]}
  D: {type: revolute, links: [lever, rod]}
  F: {type: revolute, links: [rod, ram]}
  R: {type: prismatic, links: [frame, ram]}
drivers: {O: {speed: 60 rpm, start: %s}}
loads: {cut: {link: ram, at: F, force: [-100 N, 0]}}
assembly: {D: [-20 mm, -30 mm], F: [150 mm, -30 mm], S: 72 mm}
"""
    + RUBBING
)  # its pivot C is the origin, its crank stands along its own y

if CHROMIUM:  # not a skip: gestures are tested without a browser; this is the page's own part

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

    def effort(user):
        return np.array(user.state("s.answer.value.scene.drivers[0].effort"), float)

    @pytest.mark.slow
    def test_a_whitworth_quick_return_by_mouse_alone(user):
        user.new_sheet()
        draw(
            user,
            ("l", (330, 240, 1), (403, 185)),  # crank from A on the ground to B
            ("l", (330, 295, 1), (293, 350)),  # lever from C on the ground to D
            ("g", (403, 185), (311, 323)),  # the crank pin slides along the lever
            ("l", (293, 350), (604, 350)),  # rod from D
            ("g", (604, 350), (680, 350)),  # its end slides on the ground
            ("d", (330, 240)),
            ("f", (604, 350), (500, 350)),
        )
        text = user.state("s.text.value")
        assert user.state("s.solved.value && !s.findings.value.some(({ severity }) => severity === 'error')"), text
        entries = entries_of(text)[0]
        drawn = [one for link in entries["links"].values() for point in link["points"].values() for one in point]
        assert "36.06 mm" in drawn  # of the lever, √(20² + 30²): no finer than it was drawn
        turn = float(entries["drivers"]["A"]["start"].split()[0]) - 90.0
        own = trunnion.analyse(Mechanism(**entries_of(SHAPER % ("36.06 mm", f"{turn} deg"))[0]), 360)
        torque = own["drive_effort"].values[0]
        user.page.click("role=tab[name=Text]")
        user.page.locator("textarea").fill(text.rstrip("\n") + "\n" + RUBBING)
        user.page.wait_for_timeout(700)
        user.idle()
        assert np.abs(effort(user) - torque).max() <= PEAK * np.abs(torque).max()

    @pytest.mark.slow
    def test_a_load_against_the_motion_is_put_on_a_pivot_and_on_its_link(user):
        user.box = {"x": 0, "y": 0}
        for spot in (user.handle("D"), None):
            (dx, dy), (cx, cy) = user.handle("D"), user.handle("C")
            user.keys("f")
            steps = user.state("s.past.value.length")
            user.click(*(spot or (0.5 * (cx + dx), 0.5 * (cy + dy))))
            user.page.keyboard.type("2 kNm" if spot else "300")
            assert "against the motion of D" in user.page.locator(".measure").text_content()
            user.click(*(spot or (0.5 * (cx + dx), 0.5 * (cy + dy))))
            user.until(f"s.past.value.length > {steps} && s.answer.value.text === s.text.value")
            user.keys("v")
        loads = entries_of(user.state("s.text.value"))[0]["loads"]
        assert {"joint": "D", "resisting_torque": "2 kNm"} in loads.values()
        assert loads["load2"] == {"joint": "D", "resisting_torque": "300 N m"}
        assert user.state("s.selection.value.name") == "load2"
        user.page.select_option("#value-loads-load2-only-0", label="clockwise")
        user.until("s.answer.value.text === s.text.value && s.text.value.includes('only: negative')")
        acts = user.state("s.answer.value.scene.loads.find(one => one.name === 'load2').acts")
        assert {0.0, 1.0} == set(acts)
        for sense in (0.0, 1.0):
            user.of("motion", "m.crank.go(given)", acts.index(sense))
            assert user.page.locator('[data-kind="loads"][data-name="load2"]').is_visible() == bool(sense)

    @pytest.mark.slow
    def test_a_pin_clicked_after_its_link_slides_along_it(user):
        user.new_sheet()
        draw(user, ("l", (330, 240, 1), (403, 185)), ("l", (330, 350, 1), (440, 110)))
        user.page.click(".tool:has-text('Slide')")
        user.click(360, 285)
        user.click(403, 185)
        user.until("s.missing.value[0]?.startsWith('The mobility is 1')")
        user.page.click(".tool:has-text('Drive')")
        user.click(330, 240)
        user.until("s.solved.value")
        user.page.click(".tool:has-text('Select')")
        user.page.keyboard.press("Space")  # plays: the button of the tool does not hold the key
        user.until("s.index.value > 0")
        user.page.keyboard.press("Space")
        joints = entries_of(user.state("s.text.value"))[0]["joints"]
        assert joints["E"] == {"type": "prismatic", "links": ["link2", "block1"]}
        assert joints["B"]["links"] == ["link1", "block1"]

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

    @pytest.mark.slow
    def test_a_locked_joint_stays_while_another_is_dragged(user):
        user.new_sheet()
        user.draw_four_bar()
        draw(user, ("k", (520, 180)))
        assert user.state("s.locked.value") == ["C"]
        assert user.page.locator(".padlock").count() == 1
        stays, drawn = user.handle("C"), user.state("s.text.value")
        x, y = drag(user, "D", 40, 20)
        assert np.hypot(*np.subtract(user.handle("D"), (x + 40, y + 20))) < 4
        assert np.hypot(*np.subtract(user.handle("C"), stays)) < 1
        moved = user.state("s.text.value")
        assert moved != drawn
        drag(user, "C", 30, 30)
        assert user.state("s.text.value") == moved
        assert "C is locked where it is" in user.state("s.notice.value.words")
        user.keys("Control+z", "Control+z")
        assert user.state("s.locked.value") == []
        drag(user, "C", 30, 30)
        assert np.hypot(*np.subtract(user.handle("C"), np.add(stays, 30))) < 4

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
