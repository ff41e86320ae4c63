"""The studio in a cell of a notebook: the kernel answers the page, and follows what is done there."""

import base64
import json
from pathlib import Path

import numpy as np
import pytest

import trunnion
from studio.asking import unpacked

pytest.importorskip("anywidget")

FOURBAR = Path(__file__).resolve().parents[2] / "examples" / "durango-fourbar.yaml"
# the notebook around the cell: it takes the widget's messages to the kernel and back
HOST = """
const listeners = [];
const bytesOf = (text) => new DataView(Uint8Array.from(atob(text), (sign) => sign.charCodeAt(0)).buffer);
const textOf = (bytes) => btoa(Array.from(new Uint8Array(bytes), (one) => String.fromCharCode(one)).join(""));
window.told = (message, body) => listeners.forEach((one) => one(message, body === null ? [] : [bytesOf(body)]));
const model = {
  get: () => 700,
  on: (_, does) => listeners.push(does),
  off() {},
  send: (message, _, buffers) => window.kernel(message, (buffers ?? []).map((one) => textOf(one.buffer ?? one))),
};
const address = URL.createObjectURL(new Blob([window.bridge], { type: "text/javascript" }));
import(address).then((found) => found.default.render({ model, el: document.body }));
"""


@pytest.fixture
def widget():
    made = trunnion.read(FOURBAR).studio(height=500)
    yield made
    made.close()


def test_the_kernel_answers_as_the_server_does(widget):
    sent = []
    widget.send = lambda content, buffers=None: sent.append((content, buffers))
    question = json.dumps({"ask": "model", "text": widget.text, "revision": 3, "steps": 60})
    widget._asked(widget, {"id": "a 1", "question": question}, [])
    (head, (body,)) = sent.pop()
    assert head == {"id": "a 1", "status": 200}
    found = unpacked(body)
    assert found["revision"] == 3
    effort = trunnion.analyse(trunnion.read(FOURBAR), 60)["drive_effort"].values[0]
    np.testing.assert_allclose(found["scene"]["drivers"][0]["effort"], effort, rtol=1e-5)
    for path, status in (("/files", 200), ("/file/mechanism.yaml", 200), ("/import/a.step", 404)):
        widget._asked(widget, {"id": "a 2", "path": path}, [])
        assert sent.pop()[0]["status"] == status, path


def test_it_follows_what_is_saved_and_asked_in_the_cell(widget):
    widget.send = lambda *_: None
    text = widget.text.replace("2.00 m", "2.10 m")
    assert text != widget.text
    widget._asked(widget, {"id": "a 1", "path": "/file/mechanism.yaml"}, [json.dumps({"text": text}).encode()])
    assert widget.mechanism.parameters()["dimensions.AB"] == pytest.approx(2.1)
    question = json.dumps({"ask": "model", "text": "links: {", "revision": 1})
    widget._asked(widget, {"id": "a 1", "question": question}, [])
    with pytest.raises(trunnion.MechanismError):
        widget.mechanism  # noqa: B018


@pytest.fixture
def cell(browser, widget):
    """A frame of the widget in a page of its own, and the widget."""
    page, wrong = browser.new_page(viewport={"width": 1200, "height": 760}), []
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.on("console", lambda message: message.type == "error" and wrong.append(message.text))
    waiting = []
    page.expose_function("kernel", lambda message, buffers: waiting.append((message, buffers)))
    widget.send = lambda content, buffers=None: page.evaluate(
        "([content, body]) => window.told(content, body)",
        [content, base64.b64encode(bytes(buffers[0])).decode() if buffers else None],
    )

    def pump(until, longest=400):
        for _ in range(longest):
            page.wait_for_timeout(25)
            while waiting:
                message, buffers = waiting.pop(0)
                widget._asked(widget, message, [base64.b64decode(one) for one in buffers])
            if until():
                return
        pytest.fail(f"the cell does not answer: {wrong}")

    notebook = "<!doctype html><title>notebook</title>"
    page.route("http://notebook.test/", lambda route: route.fulfill(body=notebook, content_type="text/html"))
    page.goto("http://notebook.test/")
    page.evaluate("bridge => { window.bridge = bridge; }", widget._esm)
    page.add_script_tag(content=HOST, type="module")
    yield page.frame_locator("iframe"), pump
    assert not wrong, wrong
    page.close()


@pytest.mark.slow
def test_a_cell_opens_drags_and_gives_the_changed_mechanism_back(cell, widget):
    frame, pump = cell
    pump(lambda: frame.locator(".formula .term").count() == 2)
    assert frame.locator(".formula .term").all_inner_texts() == ["I(0,1)R", "II(2,3)RRR"]
    frame.get_by_role("tab", name="Properties").click()
    field = frame.get_by_label("AB", exact=True)
    field.fill("2.2 m")
    field.press("Enter")
    pump(lambda: "2.2 m" in widget.text)
    assert widget.mechanism.parameters()["dimensions.AB"] == pytest.approx(2.2)
