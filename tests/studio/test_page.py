"""The studio's page in a real browser, where there is one: as a user draws, drags, types, reloads and saves.

Every test fails on an error of the page, on one in its console, and on a request to anywhere but this machine.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import trunnion
from browsing import CHROMIUM
from served import served
from studio.asking import ask
from trunnion.model.file import entries_of
from trunnion.model.mechanism import Mechanism

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = {path.stem: path.read_text("utf-8") for path in (ROOT / "examples").glob("*.yaml")}
PEAK = 1e-6  # of the peak: how near a torque must be


if CHROMIUM:  # not a skip: what must hold everywhere is tested without a browser; this is the page's own part

    def efforts(user):
        return user.state("s.answer.value.scene.drivers[0].effort")

    def analysed(text):
        return trunnion.analyse(Mechanism(**entries_of(text)[0]), 360)

    def test_a_four_bar_drawn_by_mouse_is_driven_rubbed_saved_and_opened_again(user):
        user.new_sheet()
        user.draw_four_bar()
        assert user.state("s.solved.value"), user.state("s.text.value")
        user.keys("f")
        user.click(520, 180)  # a load,
        user.click(520, 260)  # downwards
        user.idle()
        user.keys("v")
        text = user.state("s.text.value")
        user.page.click("role=tab[name=Text]")
        rubbing = text.rstrip("\n") + "\njoint_defaults: {pin: {radius: 5 mm}, friction: 0.2}\n"
        user.page.locator("textarea").fill(rubbing)
        user.page.wait_for_timeout(700)
        user.idle()
        assert user.state("s.text.value") == rubbing
        result = analysed(rubbing)
        torque = result["drive_effort"].values[0]
        assert abs(efforts(user)[60] - torque[60]) <= PEAK * np.abs(torque).max()
        user.page.click("summary:has-text('File')")
        user.page.click("button:has-text('Save as')")
        user.page.locator("dialog input").fill("drawn")
        user.page.click("dialog button:has-text('Save')")
        user.idle()
        saved = user.studio.folder / "drawn.yaml"
        assert saved.read_text("utf-8") == rubbing
        assert not user.state("s.unsaved.value")
        user.new_sheet()
        user.page.click("summary:has-text('File')")
        user.page.click("button:has-text('Open')")
        user.page.locator("dialog button", has_text="drawn.yaml").click()
        user.idle()
        assert user.state("s.text.value") == rubbing

    @pytest.mark.slow
    def test_a_mistake_in_drawing_a_part_leaves_the_rest_and_ends_with_the_next_answer(user):
        user.of("actions", "m.setValue(['dimensions', 'BC'], '5.9 m')")
        user.idle()
        user.state("(s.answer.value = { ...s.answer.value, margin_least: { value: null, at: '' } }, 0)")
        user.page.wait_for_selector("[role=alert]:has-text('The page made a mistake here')")
        user.page.click("button:has-text('Undo the last step')")
        user.until("s.answer.value.text === s.text.value")
        assert "BC: 6.00 m" in user.state("s.text.value")
        assert "> 10 everywhere" in user.page.locator(".bottom .margin").inner_text()
        assert user.page.locator("[role=alert]").count() == 0

    @pytest.mark.slow
    @pytest.mark.parametrize(
        "mistake",
        [
            "s.answer.value = { ...s.answer.value, scene: { count: 1 } }",  # in what follows the answer
            "Promise.reject(new Error('of a promise'))",
        ],
    )
    def test_a_mistake_elsewhere_is_told_and_the_page_goes_on(user, mistake):
        user.state(f"(setTimeout(() => {{ {mistake}; }}), 0)")
        user.page.wait_for_selector("[role=alert]:has-text('The page made a mistake here')")
        user.wrong.clear()  # the mistake itself, in the console
        for continued in user.page.locator("button:has-text('Continue')").all():
            continued.click()
        user.of("actions", "m.setValue(['dimensions', 'BC'], '5.9 m')")
        user.until("s.solved.value && s.answer.value.text === s.text.value")
        assert user.page.locator("[role=alert]").count() == 0
        assert user.page.locator('.handle[data-name="C"]').count() == 1

    @pytest.mark.slow
    def test_undo_to_the_empty_sheet_and_redo(user):
        user.new_sheet()
        user.draw_four_bar()
        drawn, steps = user.state("s.text.value"), user.state("s.past.value.map(one => one.name)")
        assert steps == ["Draw link1", "Draw link2", "Draw link3", "Drive A"]
        for _ in steps:
            user.keys("Control+z")
        assert user.state("s.text.value").strip() == ""
        for _ in steps:
            user.keys("Control+Shift+z")
        assert user.state("s.text.value") == drawn
        assert user.state("s.solved.value")

    @pytest.mark.slow
    def test_unsaved_work_survives_a_crash(user):
        user.new_sheet()
        user.draw_four_bar()
        drawn = user.state("s.text.value")
        page = user.page.context.new_page()  # the tab is gone without a word
        user.page.close(run_before_unload=False)
        user.page = page
        user.open()
        user.page.click("button:has-text('Open it')")
        user.idle()
        assert user.state("s.text.value") == drawn
        assert user.state("s.past.value.length") == 4
        user.page.reload()  # and once more in the same tab
        user.page.wait_for_selector(".sheet svg")
        user.until("s.about.value.version && s.answer.value")
        assert user.state("s.text.value") == drawn
        assert "recovered" in user.page.locator("body").inner_text()
        user.page.click("text=Discard it")
        user.idle()
        assert user.state("s.text.value") == ""
        user.keys("Control+z")
        assert user.state("s.text.value") == drawn

    @pytest.mark.slow
    def test_unsaved_work_on_a_file_is_offered_beside_another_sheet_with_its_variant(user):
        user.of("actions", "m.save(given)", "lever.yaml")
        user.page.click("role=tab[name=Plots]")
        user.page.click("button:has-text('Keep as variant A')")
        user.idle()
        variant = user.state("s.variant.value.text")
        changed = user.state("s.text.value").replace("friction: 0.1", "friction: 0.2") + "# mine\n"
        user.of("actions", "m.typed(given)", changed)
        user.idle()
        page = user.page.context.new_page()
        user.page.close(run_before_unload=False)
        user.page = page
        user.open()
        assert user.state("s.fileName.value") == "four-bar.yaml"
        assert "Unsaved work on lever.yaml" in user.page.locator(".message-card").inner_text()
        user.page.click("button:has-text('Open it')")
        user.until("s.fileName.value === 'lever.yaml'")
        assert user.state("s.text.value") == changed
        assert user.page.locator(".message-card").count() == 0  # it was asked for: no second question
        assert user.state("s.variant.value.text") == variant != changed
        user.page.click("role=tab[name=Plots]")
        user.page.wait_for_selector(".changes td")
        user.of("actions", "m.save(given)", "lever.yaml")
        user.idle()

    @pytest.mark.slow
    def test_an_unsaved_sheet_that_gives_way_is_told_with_how_it_comes_back(user):
        notice = user.page.locator(".bottom .notice")
        file = user.state("s.text.value")
        user.of("actions", "m.typed(given)", file + "# mine\n")
        user.new_sheet()
        assert "Unsaved work on four-bar.yaml is kept: open it again." in notice.text_content()
        user.of("actions", "m.typed(given)", "name: Mine\n")
        user.idle()
        user.new_sheet()
        assert notice.text_content() == "New sheet. Undo brings the unsaved sheet back."
        user.keys("Control+z")
        assert user.state("s.text.value") == "name: Mine\n"
        user.of("actions", "m.openFile('four-bar.yaml')")
        user.idle()
        assert notice.text_content() == "four-bar.yaml opened."
        assert user.state("s.text.value") == file + "# mine\n"
        user.page.click("button:has-text('Open it')")
        user.idle()
        assert user.state("s.text.value") == "name: Mine\n"

    @pytest.mark.slow
    def test_a_studio_that_has_stopped_says_so_and_answers_a_save(user, tmp_path):
        (tmp_path / "four-bar.yaml").write_text(EXAMPLES["durango-fourbar"], "utf-8")
        with served(tmp_path, "four-bar.yaml") as other:
            user.page.goto(other.address)
            user.until("s.solved.value")
        user.page.wait_for_selector("text=The studio on this machine has stopped")
        for act in ("m.save()", "m.setValue(['gravity'], [0, 0])"):
            user.state("s.say('')")
            user.of("actions", act)
            told = user.state("s.notice.value")
            assert told["bad"]
            assert "not saved" in told["words"] or "not carried out" in told["words"]
        user.wrong.clear()  # the browser's own lines about a server that is gone

    @pytest.mark.slow
    def test_a_joint_is_dragged_and_brought_back(user):
        before, (x, y) = user.state("s.text.value"), user.handle("C")
        user.page.mouse.move(x, y)
        user.page.mouse.down()
        for k in range(1, 16):
            user.page.mouse.move(x - k, y - 2 * k)
            user.page.wait_for_timeout(16)
        user.page.wait_for_timeout(150)
        assert "BC" in user.page.locator(".next-step").inner_text()
        user.page.mouse.up()
        user.idle()
        assert "Move C: BC 6 m → " in user.state("s.notice.value.words")
        there = user.handle("C")
        assert np.hypot(there[0] - x + 15, there[1] - y + 30) < 6
        text = user.state("s.text.value")
        np.testing.assert_allclose(efforts(user), analysed(text)["drive_effort"].values[0], rtol=1e-6)
        user.keys("Control+z")
        assert user.state("s.text.value") == before

    @pytest.mark.slow
    def test_a_plot_that_is_pointed_at_gives_the_position_back_and_undo_keeps_its_place(user):
        undo = user.page.locator("button[title^='Undo'], button[title='Nothing to undo']")
        before = undo.bounding_box()["x"]
        user.of("actions", "m.typed(given)", user.state("s.text.value") + "# more\n")
        user.until("s.unsaved.value && s.answer.value.text === s.text.value")
        assert undo.bounding_box()["x"] == before
        user.of("motion", "m.crank.go(given)", 17)
        user.page.click("role=tab[name=Plots]")
        user.page.wait_for_selector(".plot path.curve")
        user.idle()
        box = user.page.locator(".plot").first.bounding_box()

        def index_at(share):
            user.page.mouse.move(box["x"] + share * box["width"], box["y"] + 60)
            user.page.wait_for_timeout(120)
            return user.state("s.index.value")

        assert 100 < index_at(0.5) < 260
        assert index_at(-0.5) == 17
        user.page.mouse.click(box["x"] + 0.6 * box["width"], box["y"] + 60)
        clicked = user.state("s.index.value")
        assert index_at(0.3) < clicked == index_at(-0.5)  # what was clicked stays

    @pytest.mark.slow
    def test_a_slider_crank_by_keys_alone(user):
        user.new_sheet()
        user.keys("l", "ArrowLeft", "Shift+Enter", "ArrowRight", "ArrowUp", "ArrowUp", "ArrowUp", "Enter")
        user.keys("Enter", "Shift+ArrowRight", "ArrowDown", "ArrowDown", "ArrowDown", "Enter", "v")
        user.page.locator(".handle").last.focus()
        user.keys("g", "Enter", "ArrowRight", "Enter")
        user.page.locator('.handle[data-name="A"]').focus()
        user.keys("d", "Enter", "v")
        assert user.state("s.solved.value"), user.state("s.text.value")
        kinds = user.state("s.answer.value.scene.joints.map(one => one.type)")
        assert sorted(kinds) == ["prismatic", "revolute", "revolute", "revolute"]
        user.page.locator(".sheet > svg").focus()
        user.keys(" ")
        user.page.wait_for_timeout(400)
        assert user.state("s.index.value") > 3
        user.keys(" ")

    @pytest.mark.slow
    def test_what_is_wrong_is_told_where_it_stands(user):
        field = user.page.locator("#value-joint_defaults-friction-coefficient-0")
        user.of("motion", "m.crank.go(given)", 40)
        field.fill("0.1 banana")
        field.press("Tab")
        user.idle()
        assert "banana" in user.page.locator(".wrong").first.inner_text()
        assert user.state("s.solved.value && s.index.value") == 40  # it moves on
        assert "shown without friction" in user.page.locator(".message-card.bad").inner_text()
        field.fill("0.2")
        field.press("Tab")
        user.idle()
        assert "coefficient: 0.2" in user.state("s.text.value")
        assert user.state("s.solved.value")
        field.fill("0.3")
        user.keys("Enter")  # taken over: what is undone then is the step, not the letters
        assert "coefficient: 0.3" in user.state("s.text.value")
        user.keys("Control+z")
        assert "coefficient: 0.2" in user.state("s.text.value")

    @pytest.mark.slow
    def test_a_bare_number_takes_the_unit_and_a_name_that_is_taken_is_refused(user):
        field = user.page.locator("#value-dimensions-BC-0")
        field.fill("5.9")
        field.press("Tab")
        user.idle()
        assert "BC: 5.9 m" in user.state("s.text.value")
        user.page.locator(".parts button", has_text="rocker").click()
        user.page.locator(".name-of-part").fill("crank")
        user.page.locator(".name-of-part").press("Tab")
        user.idle()
        assert user.page.locator(".name-of-part").input_value() == "rocker"
        assert "not a free name" in user.state("s.notice.value.words")

    @pytest.mark.slow
    def test_a_file_changed_elsewhere_is_not_overwritten(user):
        other = user.studio.folder / "shared.yaml"
        user.of("actions", "m.save(given)", "shared.yaml")
        user.idle()
        mine = other.read_text("utf-8")
        other.write_text(mine + "# elsewhere\n", "utf-8")
        user.of("actions", "m.typed(given)", "trunnion: 1\n")
        user.idle()
        user.of("actions", "m.save(given)", "shared.yaml")
        user.idle()
        assert other.read_text("utf-8") == mine + "# elsewhere\n"
        assert "changed elsewhere" in user.state("s.notice.value.words")
        user.wrong.clear()  # the console tells of the answer 409

    @pytest.mark.slow
    def test_names_are_never_markup(user):
        evil = "<img src=x onerror=alert(1)>"
        text = EXAMPLES["durango-fourbar"].replace("coupler", f"'{evil}'").replace("name: ", f"name: '{evil}' # ")
        user.page.click("role=tab[name=Text]")
        user.page.locator("textarea").fill(text)
        user.page.wait_for_timeout(700)
        user.idle()
        for tab in ("Properties", "Plots", "Findings"):
            user.page.click(f"role=tab[name={tab}]")
        assert user.state("s.solved.value")
        assert user.page.locator("img").count() == 0

    @pytest.mark.slow
    def test_masses_of_links_do_not_freeze_the_page(user):
        rows = "".join(f"  l{k}: {{points: {{A: [0, 0], B{k}: [{k}, 0]}}}}\n" for k in range(4000))
        for links, told in ((rows, "400 at most"), (10 * rows, "300,000 at most")):
            content = f"trunnion: 1\nlinks:\n  ground: {{}}\n{links}"
            user.of("actions", "m.typed(given)", content)
            user.page.wait_for_timeout(1000)
            user.idle()
            user.page.locator("[role=tab]", has_text="Findings").click()
            user.idle()
            assert told in user.page.locator("body").inner_text()

    def test_mechanisms_in_space_open_after_each_other(user):
        for name in ("rssr", "bennett", "universal-joint"):
            user.of("actions", "m.openExample({ name: given })", name)
            user.idle()
            assert user.state("s.solved.value")
            assert not user.wrong, (name, user.wrong)

    @pytest.mark.slow
    def test_every_example_opens(user):
        for name in sorted(EXAMPLES)[::3]:  # the answers to all of them are in test_answers.py
            user.of("actions", "m.openExample({ name: given })", name)
            user.idle()
            errors = user.state("s.answer.value.findings.filter(one => one.severity === 'error').map(one => one.code)")
            allowed = {"mobility.redundant", "input.drivers", "input.tables"}
            assert user.state("s.solved.value") or set(errors) <= allowed, (name, errors)
            assert not user.wrong, (name, user.wrong)

    @pytest.mark.slow
    def test_a_picture_shows_the_position_of_the_sheet(user):
        user.state("s.index.value = 90")
        user.page.click("summary:has-text('Export')")
        with user.page.expect_download() as download:
            user.page.locator(".menu button", has_text="PNG").click()
        assert download.value.suggested_filename == "four-bar.png"  # of the file, not of the model's name
        question = {"ask": "export", "what": "png", "text": user.state("s.text.value")}
        drawn = {index: ask(**question, index=index)["bytes"] for index in (0, 90)}
        assert Path(download.value.path()).read_bytes() == drawn[90] != drawn[0]

    @pytest.mark.slow
    @pytest.mark.parametrize("what", ["CSV", "PNG", "SVG", "GIF", "Report"])
    def test_files_are_had(user, what):
        user.page.click("summary:has-text('Export')")
        with user.page.expect_download(timeout=60000) as told:
            user.page.locator(".menu button", has_text=what).click()
        assert Path(told.value.path()).stat().st_size > 500
