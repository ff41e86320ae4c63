"""The report is one file that fetches nothing, holds every figure, and lets no name become code."""

from __future__ import annotations

import base64
import hashlib
import json
import math
import re
from html.parser import HTMLParser

import pytest
from stand_in import NASTY, four_bar

from trunnion.errors import Status
from trunnion.results.attributes import figure_rows, summary_of
from trunnion.results.figure import MORE_THAN, Figure
from trunnion.views.common.bundle import bundle, module, web_text
from trunnion.views.cycle.report import embedded, report
from trunnion.views.page import headline

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
    page = Page(text)
    for tag, attrs in page.tags:
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


@pytest.mark.parametrize(
    ("figure", "label", "told"),
    [
        (Figure("A.effort_min", "drive torque of A", 7.0, "W", "least", "at 350°"), "drive torque of A, least, at 350°",
         ("7.000\u00a0W", "least, at 350°")),
        (Figure("efficiency", "efficiency", 0, note="no net work"), "efficiency (no net work)",
         ("0", "no net work")),
        (Figure("locking_margin", "locking margin", 10, aspect=MORE_THAN, note="times the friction"),
         "locking margin (times the friction), more than", ("> 10", "times the friction")),
        (Figure("efficiency", "efficiency", math.nan), "efficiency", ("—", "")),
        (Figure("grashof", "type", "crank-rocker"), "type", ("crank-rocker", "")),
    ],
)  # fmt: skip
def test_a_figure_is_told_by_its_subject_its_value_and_a_remark(plain, figure, label, told):
    plain.attrs["summary"] = json.dumps(figure_rows([figure]))
    assert figure.label == label
    assert summary_of(plain) == [figure]
    assert headline(plain) == [(figure.subject, [told])]


def test_a_gap_is_told_even_if_no_finding_speaks_of_it():
    words = " ".join("".join(Page(report(four_bar(gap=(132, 229, Status.NOT_ASSEMBLED)))).words).split())
    assert "cannot be assembled, from 132° to 228° (drive angle A)" in words
    assert "97 not solved" in words


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


def test_a_module_of_modules_keeps_its_libraries():
    sources = {
        "own/a.js": 'import lib from "lib";\nimport { x as y } from "lib";\nimport * as b from "../web/b.js";\n'
        "export const one = lib(y) + b.two;\n",
        "web/b.js": "export const two = 2; // </p>\n",
    }
    text = module("own/a.js", sources.__getitem__, ["lib"])
    assert text.startswith('import * as module_lib from "lib";\nconst module_web_b = (() => {\n')
    assert "const { default: lib } = module_lib;\nconst { x: y } = module_lib;\nconst b = module_web_b;\n" in text
    assert text.endswith("export { module_web_b, module_own_a };\n")


@pytest.mark.parametrize(
    "source",
    ["export default 1;\n", 'import x from "./b.js";\n', "export { a };\n", 'import("./b.js");\n', "// </script>\n"],
)
def test_bundle_refuses_what_it_does_not_know(source):
    with pytest.raises(ValueError, match="cannot be put into a page"):
        bundle("a.js", {"a.js": source}.__getitem__)


def test_bundle_refuses_modules_that_import_each_other():
    sources = {"a.js": 'import { b } from "./b.js";\n', "b.js": 'import { a } from "./a.js";\n'}
    with pytest.raises(ValueError, match="a → b → a"):
        bundle("a.js", sources.__getitem__)


def test_classes_used_by_the_page_are_styled():
    """Each class that a module sets for looks has a rule in the style sheet."""
    style = web_text("report.css")
    for name in ("without-answer", "unsolved", "reaction", "cursor", "message", "band", "track", "drive", "key"):
        assert re.search(rf"\.{name}\b", style), name
