"""The pictures of the studio in the manual: `python docs/studio_pictures.py`, with Chromium and the extra dev."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

from playwright.sync_api import sync_playwright

ROOT = Path(__file__).resolve().parents[1]
SIZE = {"width": 1280, "height": 720}


def main() -> None:
    """Write both pictures."""
    command = [sys.executable, "-m", "trunnion", "studio", "examples/durango-fourbar.yaml", "--no-open", "--port", "0"]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True) as process, sync_playwright() as begun:
        assert process.stdout is not None
        address = process.stdout.readline().split()[-1]
        browser = begun.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        try:
            for scheme in ("light", "dark"):
                page = browser.new_page(viewport=SIZE, color_scheme=scheme)
                page.goto(address)
                page.wait_for_selector(".handle")
                page.wait_for_timeout(1500)
                page.evaluate("import('/studio/motion.js').then(motion => motion.crank.go(48))")
                if scheme == "dark":
                    page.locator(".choice select").first.select_option("compare")
                    page.click("role=tab[name=Plots]")
                page.wait_for_timeout(1500)
                page.screenshot(path=ROOT / "docs" / "images" / f"studio-{scheme}.png")
        finally:
            browser.close()
            process.terminate()


if __name__ == "__main__":
    main()
