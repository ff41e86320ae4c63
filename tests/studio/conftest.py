"""A studio that is served, a browser, and a user in front of it; one studio and one browser for all tests of a file.

Where there is no browser, its tests are left out: what must hold everywhere is tested without one.
"""

import pytest

from browsing import CHROMIUM, QUIET, User
from served import served
from studio.asking import EXAMPLES


def pytest_collection_modifyitems(items):
    items[:] = [item for item in items if CHROMIUM or "browser" not in getattr(item, "fixturenames", ())]


@pytest.fixture(scope="module")
def studio(request, tmp_path_factory):
    """On the models that a file of tests states, the first of them open."""
    folder = tmp_path_factory.mktemp("models")
    models = getattr(request.module, "MODELS", {"four-bar": EXAMPLES["durango-fourbar"]})
    for name, text in models.items():
        (folder / f"{name}.yaml").write_text(text, encoding="utf-8")
    with served(folder, f"{next(iter(models))}.yaml", forms=getattr(request.module, "FORMS", ())) as own:
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
