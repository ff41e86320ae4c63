"""Menus by keys, the list of keys, and what is shown while a joint is dragged or the model has a mistake."""

from __future__ import annotations

import pytest

from browsing import CHROMIUM
from served import served
from studio.whitworth import TEXT

if CHROMIUM:  # not a skip: this is the page's own part

    @pytest.fixture(scope="module")
    def studio(tmp_path_factory):
        folder = tmp_path_factory.mktemp("rams")
        (folder / "ram.yaml").write_text(TEXT, encoding="utf-8")
        with served(folder, "ram.yaml") as own:
            yield own

    def focused(user):
        return user.page.evaluate("document.activeElement.textContent.trim()")

    @pytest.mark.slow
    def test_a_menu_is_gone_through_by_arrows(user):
        user.page.focus("summary:has-text('File')")
        seen = []
        for key in ("ArrowDown", "ArrowDown", "ArrowUp", "End", "ArrowDown"):
            user.keys(key)
            seen.append(focused(user))
        assert seen == ["New sheet", "Open …", "New sheet", "Keys …", "New sheet"]
        user.keys("Escape")
        assert focused(user) == "File"
        assert user.page.locator("details[open]").count() == 0

    @pytest.mark.slow
    def test_a_question_mark_lists_the_keys(user):
        user.page.locator(".sheet > svg").focus()
        user.keys("?")
        words = user.page.text_content("dialog")
        assert all(one in words for one in ("move the cross", "pin it to the ground", "play or pause", "undo"))
        user.keys("Escape")
        assert user.state("s.dialog.value") is None
        user.page.focus("#value-name-0")
        user.keys("?")  # in a field it is a letter
        assert user.state("s.dialog.value") is None

    @pytest.mark.slow
    def test_torque_friction_and_margin_are_those_of_the_dragged_mechanism(user):
        user.until("s.solved.value")
        torque = user.page.locator(".readout div:has-text('torque A') dd")
        friction = user.page.locator(".readout div:has-text('friction power') dd")
        before = [torque.text_content(), friction.text_content()]
        x, y = user.handle("D")
        user.page.mouse.move(x, y)
        user.page.mouse.down()
        for step in range(1, 9):
            user.page.mouse.move(x, y - 4 * step)
            user.page.wait_for_timeout(60)
        user.until("s.live.value?.efforts")
        dragged = [torque.text_content(), friction.text_content()]
        assert dragged[0] != before[0]
        assert dragged[1] != before[1]
        margin = user.page.locator(".bar.bottom .margin").inner_text()
        assert "> 3 here" in margin
        assert "least" not in margin
        user.page.mouse.up()
        user.until("s.live.value === null && s.past.value.length === 1")
        for cell, words in zip((torque, friction), dragged, strict=True):
            assert cell.text_content().split()[0][:3] == words.split()[0][:3]

    def test_with_a_mistake_the_mechanism_stays_as_it_was_drawn(user):
        user.until("s.solved.value")
        slot = "document.querySelector('.slot .slit').getAttribute('d').match(/-?[\\d.]+/g).map(Number)"
        x1, y1, x2, y2 = user.page.evaluate(slot)
        user.of("actions", "m.typed(given)", TEXT.replace("[100 mm, 0]", "[rodd, 0]"))
        user.until("s.answer.value.findings.some(({ severity }) => severity === 'error')")
        a1, b1, a2, b2 = user.page.evaluate(slot)
        assert (b2 - b1) * (x2 - x1) == pytest.approx((y2 - y1) * (a2 - a1), abs=1.0)

    @pytest.mark.slow
    def test_what_is_wrong_leaves_the_mechanism_in_view_until_it_is_pointed_at(user):
        user.of("actions", "m.typed(given)", TEXT.replace("friction: 0.12", "friction: 2"))
        user.until("s.answer.value.margin_least?.value < 1")
        card = user.page.locator("button.message-card.bad")
        low = card.bounding_box()["height"]
        card.hover()
        user.page.wait_for_timeout(60)
        assert low < 40 < card.bounding_box()["height"]
        assert "all joints below 0.742" in card.text_content()
