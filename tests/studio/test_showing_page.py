"""What the studio's page shows of an answer, in a real browser where there is one: the bar below, a played motion
between its positions, figures without rounding, the frame of the sheet, and no answer that is late.
"""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from browsing import CHROMIUM
from trunnion.model.file import entries_of, text_of

EXAMPLES = {path.stem: path.read_text("utf-8") for path in (Path(__file__).parents[2] / "examples").glob("*.yaml")}
FOURBAR = EXAMPLES["durango-fourbar"]
ROUNDING = re.compile(r"\d\s[pf]m\b|×10⁻|0\.00000")
WRITTEN = """[...document.querySelectorAll('[aria-label]')].map((one) => one.getAttribute('aria-label'))
    .concat([...document.querySelectorAll('text')].map((one) => one.textContent), [document.body.innerText])"""


def replaced(text, changes):
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    return text


def unloaded(text):
    entries = entries_of(text)[0]
    links = {link: {"points": one["points"]} for link, one in entries["links"].items()}
    return text_of({**entries, "links": links, "loads": {}})


SHORT_ROCKER = replaced(FOURBAR, {"AD: 5.50 m": "AD: 4.2 m", "AB: 2.00 m": "AB: 2.6 m", "CD: 3.00 m": "CD: 1.2 m"})


if CHROMIUM:  # not a skip: what must hold everywhere is tested without a browser; this is the page's own part

    def written(user, text):
        user.of("actions", "m.takeText(given, 'Edit')", text)
        user.until(f"s.solved.value && s.answer.value.text.length === {len(text)}")

    @pytest.mark.slow
    @pytest.mark.parametrize(
        ("text", "words"),
        [
            (SHORT_ROCKER, "least 1.5 at 273.6°"),  # its first positions cannot be assembled; it is least between two
            (unloaded(FOURBAR), "nothing loads its joints"),
        ],
        ids=["without some positions", "unloaded"],
    )
    def test_the_bar_has_the_margin_and_goes_on(user, text, words):
        written(user, text)
        margin = user.page.locator(".bar.bottom .margin")
        assert words in margin.inner_text()
        assert user.page.locator("[role=alert]").count() == 0
        written(user, EXAMPLES["drawing-press"])
        assert "least 3.45 at 0 mm" in margin.inner_text()

    @pytest.mark.slow
    def test_rounding_is_shown_as_nothing(user):
        written(user, EXAMPLES["chebyshev-line"])
        user.page.click("role=tab[name=Plots]")
        for joint in user.state("s.answer.value.scene.joints.map(({ name }) => name)"):
            user.state(f"s.selection.value = {{ kind: 'joints', name: '{joint}' }}")
            user.idle()
            for index in (0, 90, 180, 270):
                user.of("motion", "m.crank.go(given)", index)
                assert not [words for words in user.page.evaluate(WRITTEN) if ROUNDING.search(words)]
        user.state("s.text.value = s.text.value.replace('drivers', 'drivens')")
        user.of("actions", "m.solve()")
        user.state("s.places.value = Object.fromEntries(Object.keys(s.places.value).map((key) => [key, [7e-18, 0.1]]))")
        user.idle()
        label = user.page.locator(".handle").first.get_attribute("aria-label")
        assert label.endswith("at 0\u00a0m, 100\u00a0mm")

    def test_a_slowly_played_mechanism_moves_between_its_positions(user):
        """A crank of 360 positions in 32 s: each of the browser's pictures shows it farther, on its circle."""
        user.page.locator(".pace select").select_option("32")
        user.page.locator(".player .play").click()
        seen = user.page.evaluate(
            """async () => {
              const seen = [];
              const pin = document.querySelector('.handle[data-name="B"]');
              const { module_studio_state: state } = await import("/modules.js");
              for (let count = 0; count < 40; count += 1) {
                await new Promise(requestAnimationFrame);
                seen.push([state.index.value, Number(pin.getAttribute("cx")), Number(pin.getAttribute("cy"))]);
              }
              return seen;
            }"""
        )
        user.page.locator(".player .play").click()
        positions = len({index for index, *_ in seen})
        places = {tuple(place) for _, *place in seen}
        assert len(places) > 2 * positions
        centre, (x, y) = user.handle("A"), user.handle("B")
        frame = user.page.locator(".sheet").bounding_box()
        reach = np.hypot(x - centre[0], y - centre[1])
        for px, py in places:
            assert np.hypot(px + frame["x"] - centre[0], py + frame["y"] - centre[1]) == pytest.approx(reach, abs=0.3)
        assert user.state("s.share.value") == 0  # where it stands it is at a position

    @pytest.mark.slow
    def test_the_frame_of_an_empty_sheet_stays_with_the_first_link(user):
        user.new_sheet()
        scale = user.of("sheet", "m.sheet.view.frame.scale")
        user.keys("l")
        user.click(200, 300)
        user.click(330, 240)
        user.until("s.past.value.length === 1")
        assert user.of("sheet", "m.sheet.view.frame.scale") == scale
        link = user.state("({ text: s.text.value, places: s.places.value, locked: [] })")
        user.of("actions", "m.openFile('four-bar.yaml')")
        user.until("s.solved.value")
        drawn = """import("/modules.js").then(({ module_studio_state: state }) => {
            m.openText("", "New sheet");
            state.commit("Draw link1", { text: "", places: {}, locked: [] }, given);
            return m.solve();
        })"""
        user.of("actions", drawn, link)  # before the empty sheet is answered
        user.until("s.answer.value?.text === s.text.value && s.answer.value.entries.links")
        assert user.of("sheet", "m.sheet.view.frame.scale") == scale

    def test_a_slider_changes_the_mechanism_as_it_is_pulled_and_the_file_as_it_is_released(user):
        text, torque = user.state("s.text.value"), user.page.locator(".readout div:has-text('torque A') dd")
        before = torque.text_content()
        slider = user.page.get_by_label("BC, slider")
        box = slider.bounding_box()
        user.page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])
        user.page.mouse.down()
        for step in range(8):
            user.page.mouse.move(box["x"] + (0.5 - 0.005 * step) * box["width"], box["y"] + 0.5 * box["height"])
            user.page.wait_for_timeout(40)
        user.until("s.live.value?.joints.B.reaction.x.length === 360")
        assert user.state("s.text.value") == text
        live = torque.text_content()
        assert live != before
        arrow = "document.querySelectorAll('.layer.vectors path')[1].getAttribute('d')"
        pulled = user.page.evaluate(arrow)
        assert pulled
        assert "here" in user.page.locator(".bar.bottom .margin").inner_text()
        user.page.mouse.up()
        user.until("s.live.value === null && s.past.value.length === 1 && s.answer.value.text === s.text.value")
        assert user.state("s.text.value") != text
        assert torque.text_content().split()[0][:4] == live.split()[0][:4]
        user.keys("Control+z")
        assert user.state("s.text.value") == text
        user.page.mouse.down()  # pulled and brought back: nothing changes
        user.page.mouse.move(box["x"] + 0.4 * box["width"], box["y"] + 0.5 * box["height"])
        user.until("s.live.value")
        user.page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])
        user.page.mouse.up()
        user.until("s.live.value === null")
        assert user.state("s.text.value") == text

    @pytest.mark.slow
    def test_one_question_of_a_drag_is_under_way_and_the_newest_is_asked_next(user):
        asked, most = [], [0]

        def watch(socket):
            socket.on("framesent", lambda content: sent(json.loads(content)))
            socket.on("framereceived", lambda content: b'"ask": "drag"' in content[:80] and asked.append(None))

        def sent(question):
            if question["ask"] == "drag":
                asked.append(question["to"])
                under_way = sum(1 if one else -1 for one in asked)
                most[0] = max(most[0], under_way)

        user.page.on("websocket", watch)
        user.page.reload()
        user.until("s.solved.value && s.about.value.version")
        x, y = user.handle("C")
        user.page.mouse.move(x, y)
        user.page.keyboard.down("Alt")
        user.page.mouse.down()
        for step in range(60):
            user.page.mouse.move(x - step / 2, y - step)
        user.until("s.live.value")
        places = [place for place in asked if place]
        user.page.mouse.up()
        user.page.keyboard.up("Alt")
        user.until("s.live.value === null && s.past.value.length === 1")
        assert most[0] == 1
        assert 1 < len(places) < 60
        assert places[-1][1] == max(place[1] for place in places)
        there = user.handle("C")
        assert np.hypot(there[0] - x + 29.5, there[1] - y + 59) < 2

    @pytest.mark.slow
    def test_an_answer_to_what_was_changed_since_is_dropped(user):
        """A step that is answered after the text was changed, and a cycle of a text that is no longer there."""
        changed = FOURBAR.replace("BC: 6.00 m", "BC: 5.80 m")
        step = "m.setValue(['dimensions', 'BC'], '5.9 m')"
        user.of("actions", f"({step}, new Promise((done) => setTimeout(() => done(m.typed(given)))))", changed)
        user.until("s.solved.value && s.answer.value.text === s.text.value")
        assert user.state("s.text.value") == changed
        assert "changed meanwhile" in user.state("s.notice.value.words")
        other = FOURBAR.replace("BC: 6.00 m", "BC: 5.70 m")
        user.of("actions", "(m.takeText(given[0], 'Edit'), m.takeText(given[1], 'Edit'), null)", [other, changed])
        user.until("s.solved.value && s.answer.value.text === s.text.value")
        assert user.state("s.answer.value.entries.dimensions.BC") == "5.80 m"

    def test_figures_of_before_are_grey_until_the_new_ones_are_there(user):
        awaited = "document.body.classList.contains('awaited')"
        assert not user.page.evaluate(awaited)
        text = FOURBAR.replace("BC: 6.00 m", "BC: 5.80 m")
        assert user.of("actions", f"(m.takeText(given, 'Edit'), {awaited})", text)
        user.until("s.solved.value && s.answer.value.text === s.text.value")
        assert not user.page.evaluate(awaited)
