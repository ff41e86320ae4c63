"""The page in a real browser: drawn, dragged, played, typed, exported, reloaded and saved; and who else asks."""

import json
import time
from pathlib import Path

import numpy as np
import pytest

from served import served
from studio.asking import EXAMPLES, analysed, ask

PEAK = 1e-6  # of the peak: how near a torque must be


def efforts(user):
    return user.state("s.answer.value.scene.drivers[0].effort")


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
    torque = analysed(rubbing)["drive_effort"].values[0]
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
def test_every_example_opens(user):
    for name in sorted(EXAMPLES)[::9]:  # the answers to all of them are in test_answers.py
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


FOURBAR = EXAMPLES["durango-fourbar"]

CUT_OFF = """[...document.querySelectorAll("button, select, input:not([type=checkbox]), summary")]
  .filter((one) => one.offsetParent && !one.closest(".panel .body, .tools"))
  .map((one) => [one, one.getBoundingClientRect()])
  .filter(([, box]) => box.right > innerWidth || box.bottom > innerHeight || Math.min(box.width, box.height) < 24)
  .map(([one]) => one.outerHTML)"""


@pytest.mark.slow
def test_nothing_is_cut_off_or_small(user):
    for size in [(1280, 720), (2560, 1440), (820, 1180), (1180, 820)]:
        user.page.set_viewport_size(dict(zip(("width", "height"), size, strict=True)))
        user.page.wait_for_timeout(300)
        assert user.page.evaluate(CUT_OFF) == []
        sheet = user.page.locator(".sheet").bounding_box()
        assert min(sheet["width"], sheet["height"]) > 500


HOSTILE = [
    FOURBAR.replace("2.00 m", "1e308 m"),
    FOURBAR.replace("2.00 m", "9" * 4000),
    FOURBAR.replace("2.00 m", "=" + "9**" * 3000 + "9"),
    "trunnion: 1\nlinks: " + "{a: " * 3000 + "}" * 3000,
    "a: &a [x, x]\n" + "".join(f"b{k}: &b{k} [*{'a' if k == 0 else f'b{k - 1}'}, *a]\n" for k in range(60)),
    "trunnion: 1\nlinks:\n" + "".join(f"  l{k}: {{}}\n" for k in range(100_000)),
]


@pytest.mark.slow
def test_hostile_models_do_not_freeze_the_page(user):
    for text in HOSTILE:
        begin = time.perf_counter()
        user.of("actions", "m.typed(given)", text)
        user.page.wait_for_timeout(500)
        user.idle()
        assert time.perf_counter() - begin < 20
        waited = user.page.evaluate(
            "new Promise(done => { const from = performance.now(); setTimeout(() => done(performance.now() - from)); })"
        )
        assert waited < 1000  # ms
        user.of("actions", "m.typed(given)", FOURBAR)
        user.until("s.solved.value && s.answer.value.text === s.text.value")


def test_a_slider_changes_the_mechanism_as_it_is_pulled_and_the_file_as_it_is_released(user):
    text, torque = user.state("s.text.value"), user.page.locator(".readout div:has-text('torque A') dd")
    before = torque.text_content()
    box = user.page.get_by_label("BC, slider").bounding_box()
    user.page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])
    user.page.mouse.down()
    for step in range(8):
        user.page.mouse.move(box["x"] + (0.5 - 0.005 * step) * box["width"], box["y"] + 0.5 * box["height"])
        user.page.wait_for_timeout(40)
    user.until("s.live.value?.joints.B.x.length === 360")
    assert user.state("s.text.value") == text
    live = torque.text_content()
    assert live != before
    assert user.page.evaluate("document.querySelectorAll('.layer.vectors path')[1].getAttribute('d')")
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
    asked = []  # places that are asked for, and None for an answer

    def watch(socket):
        socket.on("framesent", lambda content: asked.append(json.loads(content).get("to", ())))
        socket.on("framereceived", lambda content: b'"ask": "drag"' in content[:80] and asked.append(None))

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
    assert max(np.cumsum([1 if one else -1 for one in asked if one != ()])) == 1
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
