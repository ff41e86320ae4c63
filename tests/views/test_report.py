"""Reports are one file that fetches nothing, holds every figure, and lets no name become code."""

import base64
import hashlib
import json
import re
from html.parser import HTMLParser
from xml.etree import ElementTree

import pytest
from stand_in import NASTY, four_bar
from stand_in_tolerances import CASES

import trunnion
from mechanisms_parts import example
from trunnion import play, sweep
from trunnion.views.page import bundle, embedded
from trunnion.views.play import tables as play_tables
from trunnion.views.readings import readings
from trunnion.views.report import report
from trunnion.views.tolerance import drawable
from trunnion.views.tolerance import report as tolerance_report

VOID = {"meta", "link", "br", "img", "input", "hr"}


class Page(HTMLParser):
    """What a browser would find: elements, attributes, text, and the content of scripts and styles."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.words, self.raw, self.open = [], [], [], []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        (self.raw if self.open and self.open[-1] in ("script", "style") else self.words).append(data)

    def scene(self):
        return json.loads(next(text for text in self.raw if text.startswith('{"format"')))


@pytest.mark.slow
def test_every_kind_of_result_makes_a_well_formed_page(case):
    _, result = case
    page = Page(report(result, result))
    assert not page.open
    assert page.scene()["count"] == result.sizes["position"]


def test_nothing_is_fetched(plain, ideal):
    text = report(plain, ideal)
    addresses = set(re.findall(r"https?://[^\s\"'<)]+", text))
    assert addresses == {"http://www.w3.org/2000/svg"}  # the name of a language
    for tag, attrs in Page(text).tags:
        assert not attrs.get("src")
        assert attrs.get("href", "data:,") in ("data:,", "#notes"), tag
        assert not [name for name in attrs if name.startswith("on") or name == "style"]
    assert not re.search(r"@import|url\((?!#)", text)
    assert len(text) < 1_500_000


def test_the_policy_allows_exactly_the_one_script_and_the_one_style(ideal):
    text = report(ideal)
    policy = next(a["content"] for _, a in Page(text).tags if a.get("http-equiv") == "Content-Security-Policy")
    for tag, pattern in (("script", r'<script type="module">(.*?)</script>'), ("style", r"<style>(.*?)</style>")):
        found = re.findall(pattern, text, re.DOTALL)
        assert len(found) == 1
        digest = base64.b64encode(hashlib.sha256(found[0].encode()).digest()).decode()
        assert f"{tag}-src 'sha256-{digest}'" in policy
    assert "default-src 'none'" in policy


def test_names_never_become_markup_or_code():
    text = report(
        four_bar(24, rename=NASTY).assign_attrs(name=NASTY["C"], formula="</title><b>", references=NASTY["B"])
    )
    page = Page(text)
    tags = [tag for tag, _ in page.tags]
    assert tags.count("script") == 2
    assert "img" not in tags
    assert "b" not in tags[: tags.index("body")]
    assert [joint["name"] for joint in page.scene()["joints"]] == list(NASTY.values())
    assert NASTY["B"] in "".join(page.words)  # the reference, as text


@pytest.mark.parametrize("name", ["</script>", "<!--", "]]>", "\u2028", "&lt;"])
def test_embedded_json_cannot_end_its_element(name):
    text = embedded({name: [name]})
    assert not set(text) & set("<>&\u2028\u2029")
    assert json.loads(text) == {name: [name]}


def test_nan_cannot_slip_into_the_page():
    with pytest.raises(ValueError, match="JSON"):
        embedded([float("nan")])


def test_modules_keep_to_the_forms_that_can_be_bundled():
    script = bundle("report.js")
    assert script.count("(() => {") >= 7
    assert not re.search(r"^\s*(import|export)\b", script, re.MULTILINE)
    for unsafe in ("innerHTML", "outerHTML", "insertAdjacentHTML", "document.write", "eval(", "new Function"):
        assert unsafe not in script


def test_bundle_puts_modules_in_order_and_each_in_its_own_scope():
    sources = {
        "a.js": 'import { two } from "./b.js";\nimport {\n  three,\n} from "./c.js";\n'
        "const own = 1;\nexport const one = own + two + three;\n",
        "b.js": 'import { three } from "./c.js";\nconst own = 2;\nexport function two() {\n  return own;\n}\n',
        "c.js": "export const three = 3;\n",
    }
    script = bundle("a.js", sources.__getitem__)
    assert script.index("module_c =") < script.index("module_b =") < script.index("module_a =")
    assert script.count("module_c = (()") == 1
    assert "return { two };" in script


@pytest.mark.parametrize(
    "source",
    ["export default 1;\n", 'import x from "./b.js";\n', "export { a };\n", 'import("./b.js");\n', "// </script>\n"],
)
def test_bundle_refuses_what_it_does_not_know(source):
    with pytest.raises(ValueError, match="cannot be put into a page"):
        bundle("a.js", {"a.js": source}.__getitem__)


SOURCE = "data:image/svg+xml;base64,"


@pytest.mark.sample(6)
@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in CASES if name != "twelve measures"])
def test_every_kind_of_tolerance_makes_a_well_formed_page(name):
    result = CASES[name]()
    page = Page(tolerance_report(result))
    assert not page.open
    pictures = [attrs["src"] for tag, attrs in page.tags if tag == "img"]
    assert len(pictures) == len(drawable(readings(result)[0]))
    for picture in pictures:
        ElementTree.fromstring(base64.b64decode(picture.removeprefix(SOURCE)))


JOINT = "joints.A.friction.coefficient"


def _page(text):
    """A page that fetches nothing and runs nothing."""
    assert text.startswith("\n<!doctype html>") or text.startswith("<!doctype html>")
    assert "<script" not in text
    assert not re.search(r'(?:src|href)="(?!data:|#)', text)
    return text


@pytest.mark.slow
def test_play():
    result = play(example("fourbar-with-play"), ["rotation:C", "rotation:D"], steps=12)
    page = _page(trunnion.report(result))
    assert page.count("<img") == 2
    for table in play_tables(result):
        assert all(f">{cell}</td>" in page for row in table.rows for cell in row if cell)
    assert "0.02 mm" in page  # the input data


@pytest.mark.slow
def test_sweep():
    result = sweep(example("toleranced-fourbar"), {JOINT: [0.0, 0.1, 0.2]}, steps=12)
    page = _page(trunnion.report(result, measures=["efficiency", "friction_power_mean"]))
    assert page.count("<img") == 2
    for value in result["efficiency"].values:
        assert f">{value:.6g}</td>" in page
