"""A studio that is served, a browser, and a user in front of it; one studio and one browser for all tests of a file."""

from __future__ import annotations

from pathlib import Path

import pytest

from browsing import CHROMIUM, QUIET, User
from served import served

FOURBAR = Path(__file__).resolve().parents[2] / "examples" / "durango-fourbar.yaml"


@pytest.fixture(scope="module")
def studio(tmp_path_factory):
    folder = tmp_path_factory.mktemp("models")
    (folder / "four-bar.yaml").write_text(FOURBAR.read_text("utf-8"), encoding="utf-8")
    with served(folder, "four-bar.yaml") as own:
        yield own


@pytest.fixture(scope="module")
def browser():
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        launched = playwright.chromium.launch(executable_path=CHROMIUM, args=QUIET)
        yield launched
        launched.close()


@pytest.fixture
def user(browser, studio):
    """Fails where the page, its console, or a request to elsewhere does."""
    context = browser.new_context(viewport={"width": 1280, "height": 720}, accept_downloads=True)
    found = User(context.new_page(), studio)
    found.open()
    yield found
    wrong = list(found.wrong)
    context.close()
    assert not wrong, wrong
