"""The pictures of the studio in the manual: `python docs/studio_pictures.py`, with Chromium and the extra dev."""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import product
from pathlib import Path

from playwright.sync_api import Page, sync_playwright

ROOT = Path(__file__).resolve().parents[1]
SIZE = {"width": 1280, "height": 720}


def main() -> None:
    """Write all pictures in both themes, those of the press with layers and a variant last."""
    four_bar = {"start": _at_rest, "plots": _compared, "drawing": _drawing}
    press = {"layers": _layers, "variants": _variants}
    watt, loose, space = {"blocks": _blocks}, {"errors": _errors}, {"space": _space}
    for model, shots in (
        ("durango-fourbar", four_bar),
        ("drawing-press", press),
        ("watt-six-bar", watt),
        ("fourbar-with-play", loose),
        ("rssr-with-play", space),
    ):
        with _studio(model) as address, sync_playwright() as begun:
            browser = begun.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
            for (name, prepare), theme in product(shots.items(), ("light", "dark")):
                page = browser.new_page(viewport=SIZE, color_scheme=theme)  # type: ignore[arg-type]  # one of its words
                page.goto(address)
                page.wait_for_selector(".motion .player")
                page.wait_for_timeout(1500)
                prepare(page)
                page.wait_for_timeout(1500)
                page.screenshot(path=ROOT / "docs" / "images" / f"studio-{name}-{theme}.png")
            browser.close()


@contextmanager
def _studio(model: str) -> Iterator[str]:
    """The address of a studio on an example."""
    command = [sys.executable, "-m", "trunnion", "studio", f"examples/{model}.yaml", "--no-open", "--port", "0"]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            yield process.stdout.readline().split()[-1]
        finally:
            process.terminate()


def _go(page: Page, index: int) -> None:
    page.evaluate(f"import('/modules.js').then(m => m.module_studio_motion.crank.go({index}))")


def _at_rest(page: Page) -> None:
    _go(page, 48)


def _blocks(page: Page) -> None:
    _go(page, 40)
    page.click("role=tab[name=Blocks]")
    page.locator(".formula .term").nth(1).click()


def _errors(page: Page) -> None:
    page.click("button:has-text('× 100')")
    _go(page, 57)


def _space(page: Page) -> None:
    """A joint with its bar, its loads on the ends of the bearing, and sections along its pin."""
    _go(page, 60)
    page.locator(".hands .handle[aria-label^='Joint D']").focus()
    page.keyboard.press("Enter")
    for name in ("joint axes", "reactions", "end loads of bearings"):
        page.get_by_label(name, exact=True).click()


def _compared(page: Page) -> None:
    _go(page, 48)
    page.locator(".choice select").first.select_option("compare")
    page.click("role=tab[name=Plots]")


def _drawing(page: Page) -> None:
    """A quick return half drawn: the pin of its crank slides along the lever, the rod is being drawn."""
    page.click("summary:has-text('File')")
    page.click("button:has-text('New sheet')")
    page.wait_for_timeout(500)
    box = page.locator(".sheet").bounding_box()
    assert box is not None
    for tool, *places in (
        ("l", (330, 240, "Shift"), (403, 185)),
        ("l", (330, 295, "Shift"), (293, 350)),
        ("g", (403, 185), (311, 323)),
        ("l", (293, 350)),
    ):
        page.keyboard.press(tool)
        for x, y, *held in places:
            page.mouse.move(box["x"] + x, box["y"] + y)
            for key in held:
                page.keyboard.down(key)
            page.mouse.click(box["x"] + x, box["y"] + y)
            for key in held:
                page.keyboard.up(key)
            page.wait_for_timeout(800)
    page.mouse.move(box["x"] + 604, box["y"] + 350)


def _layers(page: Page) -> None:
    _go(page, 130)
    page.click("summary:has-text('Show')")
    for name in (
        "Values of the reactions",
        "Instant centres against the ground",
        "Friction circles",
        "Transmission angles",
    ):
        page.get_by_label(name, exact=True).click()
    page.keyboard.press("Escape")
    page.click("role=tab[name=Plots]")


def _variants(page: Page) -> None:
    _go(page, 60)
    page.click("role=tab[name=Plots]")
    page.click("button:has-text('Keep as variant A')")
    for path, value in ((["joint_defaults", "friction"], "0.15"), (["dimensions", "L"], "210 mm")):
        page.evaluate(
            "given => import('/modules.js').then(m => m.module_studio_actions.setValue(...given))", [path, value]
        )
        page.wait_for_timeout(2000)


if __name__ == "__main__":
    main()
