"""The frame of the studio's page in a real browser: first picture, gallery, files."""

from __future__ import annotations

import io
import itertools
import json
import re
import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image

import trunnion
from browsing import CHROMIUM
from trunnion.model.file import entries_of
from trunnion.model.mechanism import Mechanism

ROOT = Path(__file__).resolve().parents[2]
FOURBAR = (ROOT / "examples" / "durango-fourbar.yaml").read_text("utf-8")
ALL_BOXES = """(kinds) => kinds.map((kind) =>
    [...document.querySelectorAll(kind)].map((one) => one.getBoundingClientRect().toJSON()))"""

CUT_OFF = """[...document.querySelectorAll("button, select, input:not([type=checkbox]), summary")]
  .filter((one) => one.offsetParent && !one.closest(".panel .body, .tools"))
  .map((one) => [one, one.getBoundingClientRect()])
  .filter(([, box]) => box.right > innerWidth || box.bottom > innerHeight || Math.min(box.width, box.height) < 24)
  .map(([one]) => one.outerHTML)"""

FOREIGN = """<!doctype html><title>evil</title><iframe src="{address}"></iframe><img src="{home}/modules.js">
<script>
const tried = {{}};
const fetched = (name, path, asked) => fetch("{home}" + path, asked).then((reply) => reply.text()).then(
  (text) => (tried[name] = text), () => (tried[name] = null));
const opened = new Promise((done) => {{
  const socket = new WebSocket("{home}/socket".replace("http", "ws"), ["trunnion", "x"]);
  socket.onopen = () => done("open");
  socket.onclose = () => done(null);
}});
window.done = Promise.all([
  fetched("page", "/", {{ credentials: "include" }}),
  fetched("token", "{query}", {{ credentials: "include" }}),
  fetched("file", "/file/four-bar.yaml", {{ credentials: "include" }}),
  fetched("written", "/file/four-bar.yaml", {{ method: "PUT", body: '{{"text": "evil"}}', credentials: "include" }}),
  fetched("simple", "/file/four-bar.yaml", {{ method: "POST", body: "evil", mode: "no-cors", credentials: "include" }}),
  opened.then((state) => (tried.socket = state)),
]).then(() => tried);
</script>"""


if CHROMIUM:  # not a skip: what must hold everywhere is tested without a browser; this is the page's own part

    def choose(user, menu, words):
        user.page.click(f"summary:has-text('{menu}')")
        user.page.locator(".menu button", has_text=words).click()

    def exported(user, what):
        """The bytes of a file."""
        user.page.click("summary:has-text('Export')")
        with user.page.expect_download(timeout=60000) as told:
            user.page.locator(".menu button", has_text=what).click()
        return Path(told.value.path()).read_bytes()

    def test_a_sheet_begun_while_the_file_is_read_stays(user):
        held = []
        user.page.route("**/file/*", lambda route: held.append(route))
        user.page.reload()
        user.page.wait_for_selector(".sheet svg")
        user.page.wait_for_timeout(300)
        choose(user, "File", "New sheet")
        assert len(held) == 1
        held[0].continue_()
        user.page.unroute("**/file/*")
        user.until("s.about.value.version")
        assert user.state("s.text.value") == ""
        assert user.state("s.fileName.value") is None

    @pytest.mark.slow
    def test_what_stands_on_one_spot_is_read_and_a_slot_is_its_links(user):
        user.of("actions", "m.openExample({ name: 'drawing-press' })")
        user.until("s.solved.value")
        assert "K, R" in user.page.locator("text.name").all_text_contents()
        user.page.locator(".cylinder [data-name=barrel]").click()
        assert user.state("s.selection.value") == {"kind": "links", "name": "barrel"}
        assert user.page.locator(".cylinder .chosen").count() == 1
        user.of("actions", "m.openExample({ name: 'whitworth-quick-return' })")
        user.until("s.solved.value && s.text.value.includes('hitworth')")
        link = user.page.locator(".slot").get_attribute("data-name")
        end = "(path => path.getPointAtLength(4).matrixTransform(path.getScreenCTM()))"
        spot = user.page.evaluate(f"(({{ x, y }}) => [x, y])({end}(document.querySelector('.slot .slit')))")
        user.page.mouse.click(*spot)
        assert user.state("s.selection.value") == {"kind": "links", "name": link}
        assert user.page.locator(".slot.chosen").count() == 1
        user.of("actions", "m.openExample({ name: 'durango-fourbar' })")
        user.until("s.solved.value && s.answer.value.scene.loads.length")
        user.state(
            "s.selection.value = { kind: 'points', name: s.answer.value.scene.links.flatMap((one) => one.free)[0] }"
        )
        user.state("s.layers.value = { ...s.layers.value, values: true }")
        user.page.wait_for_selector(".laid")
        for index in range(0, 360, 15):
            user.state(f"s.index.value = {index}")
            boxes = user.page.evaluate(ALL_BOXES, [".laid", ".sheet .load text"])  # of one picture
            assert all(boxes)
            for one, two in itertools.product(*boxes):
                wide, high = (
                    min(one[at] + one[size], two[at] + two[size]) - max(one[at], two[at])
                    for at, size in (("x", "width"), ("y", "height"))
                )
                assert min(wide, high) < 8, index  # a box is higher than its letters

    @pytest.mark.slow
    def test_why_it_does_not_move_and_the_name_of_a_new_file(user):
        user.of("actions", "m.openExample({ name: 'drawing-press' })")
        user.until("s.solved.value")
        user.of("actions", "m.save()")
        field = user.page.locator("dialog input")
        assert field.input_value() == "Toggle-drawing-press.yaml"
        assert field.evaluate("(one) => one.selectionEnd - one.selectionStart") == len("Toggle-drawing-press.yaml")
        user.keys("Escape")
        text = user.state("s.text.value")
        for old, new, told in (
            ("L: 200 mm", "L: 200 kg", "is a mass where a length is needed (point C of link ground)"),
            ("L: 200 mm", "L: banana", "'banana' is not one of the dimensions"),
        ):
            assert old in text
            user.of("actions", "m.typed(given)", text.replace(old, new))
            user.page.wait_for_timeout(600)
            user.idle()
            assert told in user.page.locator(".motion").inner_text()

    @pytest.mark.slow
    def test_a_refused_name_is_told_in_the_dialog(user):
        choose(user, "File", "Save as")
        user.page.locator("dialog input").fill("../elsewhere.yaml")
        user.page.click("dialog button:has-text('Save')")
        user.page.wait_for_selector("dialog [role=alert]:not(:empty)")
        assert "is not the name of a model file" in user.page.locator("dialog [role=alert]").inner_text()
        user.wrong.clear()  # the console tells of the answer 400
        user.page.locator("dialog input").fill("mine.yaml")
        user.page.click("dialog button:has-text('Save')")
        user.idle()
        assert user.page.locator("dialog").count() == 0
        (user.studio.folder / "mine.yaml").write_text("trunnion: 1\n", encoding="utf-8")
        user.of("actions", "m.typed(given)", "trunnion: 1\nname: other\n")
        user.idle()
        choose(user, "File", "Save as")
        user.page.click("dialog button:has-text('Save')")
        user.page.wait_for_selector("dialog [role=alert]:not(:empty)")
        assert "changed elsewhere" in user.page.locator("dialog [role=alert]").inner_text()
        user.wrong.clear()  # the console tells of the answer 409
        user.page.keyboard.press("Escape")
        user.page.wait_for_selector("dialog", state="detached")

    @pytest.mark.slow
    def test_examples_have_pictures(user):
        choose(user, "File", "Examples")
        assert user.page.locator(".gallery li").count() > 40
        user.page.locator("dialog input").fill("four-bar of durango")
        user.page.wait_for_selector(".gallery .thumbnail .body")
        assert user.page.locator(".gallery li").count() == 1
        assert user.page.locator(".thumbnail .body").count() == 3  # crank, coupler, rocker
        user.page.locator(".gallery button").click()
        user.until("s.solved.value")
        assert user.state("s.text.value") == FOURBAR
        assert user.state("s.fileName.value") is None

    # ---- files ----------------------------------------------------------------------------------------------------

    @pytest.mark.slow
    def test_a_table_says_what_the_analysis_says(user):
        result = trunnion.analyse(Mechanism(**entries_of(FOURBAR)[0]), 360)
        table = exported(user, "CSV")
        columns = np.genfromtxt(io.BytesIO(table), delimiter=",", names=True, deletechars="", replace_space=" ")
        np.testing.assert_allclose(columns["A.effort [N m]"], result["drive_effort"].values[0], rtol=1e-9)

    @pytest.mark.slow
    def test_pictures_and_the_report_are_whole(user):
        picture = Image.open(io.BytesIO(exported(user, "PNG")))
        assert min(picture.size) > 300
        assert len(picture.convert("RGB").getcolors(1 << 24)) > 50  # not blank
        drawn = ElementTree.fromstring(exported(user, "SVG"))
        assert len(list(drawn.iter("{http://www.w3.org/2000/svg}path"))) > 20
        report = exported(user, "Report").decode()
        assert "Four-bar of Durango" in report
        assert not re.search(r'(?:src|href)="https?:', report)

    @pytest.mark.slow
    def test_an_animation_has_60_pictures(user):
        assert Image.open(io.BytesIO(exported(user, "GIF"))).n_frames == 60

    @pytest.mark.slow
    @pytest.mark.parametrize("size", [(1280, 720), (2560, 1440), (820, 1180), (1180, 820)], ids=str)
    def test_nothing_is_cut_off_or_small(user, size):
        user.page.set_viewport_size(dict(zip(("width", "height"), size, strict=True)))
        user.page.wait_for_timeout(300)
        assert user.page.evaluate(CUT_OFF) == []
        sheet = user.page.locator(".sheet").bounding_box()
        assert min(sheet["width"], sheet["height"]) > 500

    # ---- who else -------------------------------------------------------------------------------------------------

    @pytest.mark.slow
    def test_a_page_of_another_origin_neither_reads_nor_writes(user):
        home, query = user.studio.address.split("/?")
        page = FOREIGN.format(address=user.studio.address, home=home, query=f"/?{query}").encode()

        class Foreign(BaseHTTPRequestHandler):
            def do_GET(self):
                self.send_response(200)
                self.send_header("Content-Type", "text/html")
                self.end_headers()
                self.wfile.write(page)

            def log_message(self, *_):
                pass

        server = ThreadingHTTPServer(("127.0.0.1", 0), Foreign)
        threading.Thread(target=server.serve_forever, daemon=True).start()
        before = (user.studio.folder / "four-bar.yaml").read_text("utf-8")
        try:
            other = user.page.context.new_page()  # of the same browser, which was let in
            other.goto(f"http://127.0.0.1:{server.server_port}/")
            tried = other.evaluate("window.done")
            assert set(tried.values()) <= {None, ""}, json.dumps(tried)[:500]
            inside = other.frames[1].evaluate("document.body ? document.body.innerText : ''")
            assert "Trunnion" not in inside
        finally:
            server.shutdown()
            server.server_close()
        assert (user.studio.folder / "four-bar.yaml").read_text("utf-8") == before

    @pytest.mark.slow
    @pytest.mark.parametrize(
        "text",
        [
            FOURBAR.replace("2.00 m", "1e308 m"),
            FOURBAR.replace("2.00 m", "9" * 4000),
            FOURBAR.replace("2.00 m", "=" + "9**" * 3000 + "9"),
            "trunnion: 1\nlinks: " + "{a: " * 3000 + "}" * 3000,
            "a: &a [x, x]\n" + "".join(f"b{k}: &b{k} [*{'a' if k == 0 else f'b{k - 1}'}, *a]\n" for k in range(60)),
            "trunnion: 1\nlinks:\n" + "".join(f"  l{k}: {{}}\n" for k in range(100_000)),
        ],
        ids=["1e308", "digits", "powers", "nested", "aliases", "links"],
    )
    def test_a_hostile_model_does_not_freeze_the_page(user, text):
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
