"""What the studio's page keeps and saves, in a real browser: no work is lost, and none becomes that of another file."""

import pytest

from browsing import User
from served import served
from studio.asking import EXAMPLES

FOURBAR = EXAMPLES["durango-fourbar"]
FULL = """(free) => {
    const put = (size) => {
        try {
            localStorage.setItem(`full ${localStorage.length}`, "x".repeat(size));
            return true;
        } catch {
            return false;
        }
    };
    if (free) localStorage.setItem("free", "x".repeat(free));
    for (let size = 1 << 20; size > 0; size >>= 1) while (put(size));
    localStorage.removeItem("free");
}"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "models").mkdir()
    (tmp_path / "models" / "a.yaml").write_text(FOURBAR, "utf-8")
    return tmp_path / "models"


@pytest.fixture
def tabs(browser, folder):
    """New tabs of one browser, each with a user in front of it."""
    context = browser.new_context(viewport={"width": 1280, "height": 720})
    with served(folder, "a.yaml") as studio:
        users = []

        def tab(address=None):
            users.append(User(context.new_page(), studio))
            users[-1].page.goto(address or studio.address)
            users[-1].until("s.about.value.version && s.answer.value")
            return users[-1]

        tab.context, tab.studio = context, studio
        yield tab
        wrong = [line for user in users for line in user.wrong if "409" not in line]  # the console tells of refusals
    context.close()
    assert not wrong, wrong


def typed(user, text):
    user.of("actions", "m.typed(given)", text)
    user.until("s.answer.value?.text === s.text.value")


def reloaded(user):
    user.page.reload()
    user.until("s.about.value.version && s.answer.value")


@pytest.mark.slow
def test_of_two_tabs_on_one_file_neither_loses_its_work(tabs, folder):
    first, second = tabs(), tabs()
    for user, words in ((first, "# first\n"), (second, "# second\n")):
        typed(user, FOURBAR + words)
    first.of("actions", "m.save()")
    second.of("actions", "m.save()")
    assert "changed elsewhere" in second.state("s.notice.value.words")
    for _ in range(2):
        reloaded(second)
        assert second.state("s.text.value") == FOURBAR + "# second\n"
        assert "a.yaml was changed elsewhere since" in second.page.locator(".message-card").inner_text()
        second.of("actions", "m.save()")  # what was not looked at is not replaced later either
        assert (folder / "a.yaml").read_text("utf-8") == FOURBAR + "# first\n"
    second.page.click("button:has-text('Discard it')")
    second.idle()
    assert second.state("s.text.value") == FOURBAR + "# first\n"
    second.keys("Control+z")
    second.page.close(run_before_unload=False)
    third = tabs()  # the work of a tab that is gone is found by the next
    assert third.state("s.text.value") == FOURBAR + "# second\n"
    fourth = tabs()  # and that of one that is open is left alone
    assert fourth.state("s.text.value") == FOURBAR + "# first\n"
    assert fourth.page.locator(".message-card").count() == 0


@pytest.mark.slow
def test_a_duplicated_tab_keeps_its_own_work(tabs):
    first = tabs()
    typed(first, FOURBAR + "# first\n")
    name = first.page.evaluate("sessionStorage.getItem('trunnion studio tab')")
    second = User(tabs.context.new_page(), tabs.studio)
    second.page.add_init_script(f"sessionStorage.setItem('trunnion studio tab', {name!r})")
    second.open()
    typed(second, FOURBAR + "# second\n")
    reloaded(first)
    assert first.state("s.text.value") == FOURBAR + "# first\n"


@pytest.mark.slow
@pytest.mark.parametrize("free", [0, 60_000])
def test_a_full_browser_says_so_and_recovers_nothing_older(tabs, free):
    """With a little room the text is kept and the oldest steps are not; with none nothing is, and that is told."""
    user = tabs()
    typed(user, FOURBAR + "# old\n")
    user.page.evaluate(FULL, free)
    for k in range(6):
        user.of("actions", "m.takeText(given, 'Step')", FOURBAR + f"# {k}\n" + "# and more\n" * 2000)
    user.idle()
    full = user.page.locator("[role=alert]:has-text('no room for this work')")
    assert full.count() == (0 if free else 1)
    reloaded(user)
    assert user.state("s.text.value").startswith(FOURBAR + "# 5\n" if free else FOURBAR)
    assert "# old" not in user.state("s.text.value")
    assert user.state("s.past.value.length") < 7
    assert user.page.locator("text=recovered").count() == (1 if free else 0)


@pytest.mark.slow
def test_a_browser_that_does_not_know_the_token_is_told_so(browser, studio):
    page = browser.new_page()
    page.goto(f"http://127.0.0.1:{studio.port}/#m=AAAA")
    page.wait_for_selector("text=This browser is not let in yet")
    assert "trunnion studio" in page.locator("[role=alert]").inner_text()
    page.close()


@pytest.mark.slow
def test_the_token_goes_to_no_other_port(tabs):
    assert "once=" not in tabs(tabs.studio.entrance()).page.url
    assert tabs.context.cookies() == []
    again = tabs(f"http://127.0.0.1:{tabs.studio.port}/")  # another tab of the browser that was let in
    assert again.state("s.text.value") == FOURBAR
