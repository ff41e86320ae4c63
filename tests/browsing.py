"""Somebody in front of the studio's page, in a real browser where there is one."""

import re
import shutil
from itertools import pairwise

import pytest

CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")
QUIET = ["--no-sandbox", "--disable-quic", "--disable-background-networking", "--disable-component-update",
         "--disable-sync"]  # fmt: skip
HERE = re.compile(r"(http|ws)://127\.0\.0\.1:|data:|blob:")


class User:
    """Somebody in front of a page; state(name): a signal of the page."""

    def __init__(self, page, studio):
        self.page, self.studio, self.wrong = page, studio, []
        page.on("pageerror", lambda error: self.wrong.append(f"page: {error}"))
        page.on(
            "console", lambda line: line.type in ("error", "warning") and self.wrong.append(f"console: {line.text}")
        )
        page.on("request", lambda asked: HERE.match(asked.url) or self.wrong.append(f"request: {asked.url}"))

    def open(self):
        self.page.goto(self.studio.address)
        self.page.wait_for_selector(".sheet svg, .hands .handle")
        self.until("s.about.value.version && s.answer.value")

    def state(self, words):
        return self.of("state", f"(s => {words})(m)")

    def of(self, module, words, given=None):
        """What is made of a module of the page, `m`, and what is given."""
        taken = f'given => import("/modules.js").then(({{ module_studio_{module}: m }}) => {words})'
        return self.page.evaluate(taken, given)

    def idle(self):
        self.page.wait_for_timeout(40)
        for _ in range(200):
            if self.state("s.connected.value && s.busy.value === 0"):
                break
            self.page.wait_for_timeout(25)
        else:
            pytest.fail("the page is never idle")
        self.page.wait_for_timeout(20)

    def until(self, words, module="state"):
        """Wait for something of a module, `m`; of `state` it is `s`, too."""
        for _ in range(400):
            if self.of(module, f"(s => Boolean({words}))(m)"):
                return self.idle()
            self.page.wait_for_timeout(25)
        return pytest.fail(f"never: {words}")

    def keys(self, *keys):
        for key in keys:
            self.page.keyboard.press(key)
        self.idle()

    def new_sheet(self):
        self.page.click("summary:has-text('File')")
        self.page.click("button:has-text('New sheet')")
        self.idle()
        self.box = self.page.locator(".sheet").bounding_box()
        self.page.locator(".sheet > svg").focus()

    def click(self, x, y, shift=False):
        """Click at a place of the sheet, px."""
        x, y = self.box["x"] + x, self.box["y"] + y
        self.page.mouse.move(x - 3, y - 2)
        self.page.mouse.move(x, y)
        if shift:
            self.page.keyboard.down("Shift")
        self.page.mouse.click(x, y)
        if shift:
            self.page.keyboard.up("Shift")
        self.page.wait_for_timeout(20)

    def handle(self, name):
        box = self.page.locator(f'.handle[data-name="{name}"]').bounding_box()
        return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2

    def draw_four_bar(self):
        """By mouse: three links, the crank driven."""
        places = (200, 350), (250, 270), (520, 180), (480, 350)
        for k, (one, other) in enumerate(pairwise(places)):
            self.keys("l")
            self.click(*one, shift=k == 0)
            steps = self.state("s.past.value.length")
            self.click(*other, shift=k == 2)
            self.until(f"s.past.value.length > {steps}")  # else what follows may come before the link is there
            self.keys("Escape")
        self.keys("d")
        self.click(200, 350)
        self.idle()
        self.keys("v")
