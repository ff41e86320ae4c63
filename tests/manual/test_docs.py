"""What README.md and docs/ show is what happens: every Python block and every `trunnion` command runs.

The blocks of a page run in order, in one folder with the examples at hand; Python blocks share their names.
CONTRIBUTING.md tells the marks. Links between pages are checked by `mkdocs build --strict`.
"""

import contextlib
import importlib
import importlib.util
import io
import math
import re
import shlex
import shutil
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

from trunnion.cli.app import main

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted([ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / "docs").rglob("*.md")])
FENCE = re.compile(r"^( *)```(\w+)?([^\n]*)\n(.*?)^\1```$", re.DOTALL | re.MULTILINE)
MARK = re.compile(r"<!-- (exit|test): (\w+) -->\s*$")
NUMBER = re.compile(r"(?<![\w.])[-−]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?(?![\w.]*\w)")
LAYERS = (
    "algebra|joints|statistics|model|structure|groups|results|solve|cycle|measures|studies|rig|views|cli|errors|files"
)


@dataclass(frozen=True)
class Block:
    """A fenced block: its language, the title of a file, its text, where it stands, and its mark."""

    language: str
    title: str
    text: str
    line: int
    exit: int
    skip: bool


def blocks(page):
    """The fenced blocks of a page, in order."""
    text = page.read_text("utf-8")
    for found in FENCE.finditer(text):
        mark = MARK.search(text[: found.start()])
        title = re.search(r'title="([^"]+)"', found[3])
        yield Block(
            found[2] or "", title[1] if title else "", found[4], text.count("\n", 0, found.start()) + 1,
            int(mark[2]) if mark and mark[1] == "exit" else 0, bool(mark and mark[1] == "test"),
        )  # fmt: skip


@pytest.fixture(scope="session")
def files():
    """Titled blocks of all pages: models that commands and Python code may use on any page."""
    return {block.title: block.text for page in PAGES for block in blocks(page) if block.title}


@pytest.fixture
def place(tmp_path, files, monkeypatch):
    """The folder a page is worked through in, with the examples and the titled blocks."""
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    for name, text in files.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")  # no table or line is wrapped
    return tmp_path


QUICK = ("CONTRIBUTING.md", "groups-by-hand.md", "dual-algebra.md")


@pytest.mark.parametrize(
    "page",
    [pytest.param(page, marks=() if page.name in QUICK else pytest.mark.slow) for page in PAGES],
    ids=lambda page: str(page.relative_to(ROOT)),
)
def test_page(page, place, monkeypatch):
    for block, shown, statuses in worked_through(page, monkeypatch):
        where = f"{page.relative_to(ROOT)}:{block.line}"
        if block.language == "sh":  # only the last may end with the status that the block declares
            assert statuses == [0] * (len(statuses) - 1) + [block.exit] * bool(statuses), (
                f"{where}: {statuses}\n{shown}"
            )
        elif block.language == "text":
            compare(block.text, shown, where)


def worked_through(page, monkeypatch):
    """The blocks of a page in order, with what the code or the commands printed last, and exit statuses of commands."""
    names = {"__name__": "page"}
    shown = ""
    for block in (block for block in blocks(page) if not block.skip):
        statuses = []
        if block.language == "python":
            output = io.StringIO()
            with contextlib.redirect_stdout(output):
                exec(compile(block.text, f"{page.relative_to(ROOT)}:{block.line}", "exec"), names)
            shown = output.getvalue()
        elif block.language == "sh":
            commands = [line for line in block.text.splitlines() if line.startswith("trunnion ")]
            done = [run(command, monkeypatch) for command in commands]
            statuses, shown = [status for status, _ in done], "".join(text for _, text in done)
        yield block, shown, statuses


def run(command, monkeypatch):
    """Exit status and text of a command, run in this process as the console script would."""
    monkeypatch.setattr(sys, "argv", shlex.split(command, comments=True))
    output, status = io.StringIO(), 0
    with contextlib.redirect_stdout(output), contextlib.redirect_stderr(output):
        try:
            main()
        except SystemExit as end:
            status = int(end.code or 0)
    return status, output.getvalue()


def compare(expected, actual, where):
    """Every line shown occurs in the output, in order; `…` stands for lines left out, rules of tables do not count."""
    lines = iter([_words(line) for line in actual.splitlines()])
    for line in (one for one in expected.splitlines() if _words(one) not in ([], ["…"])):
        assert any(len(_words(line)) == len(other) and all(map(_same, _words(line), other)) for other in lines), (
            f"{where}: not in the output: {line}\n{actual}"
        )


def _words(line):
    return re.sub("[┃│━╇─┼]", " ", line).split()


def _same(a, b):
    """Of words; numbers to four digits, rounding noise as equal."""
    if a == b:
        return True
    values = [[float(found.replace("−", "-")) for found in NUMBER.findall(word)] for word in (a, b)]
    if not values[0] or len(values[0]) != len(values[1]) or NUMBER.sub("#", a) != NUMBER.sub("#", b):
        return False
    return all(math.isclose(x, y, rel_tol=5e-5, abs_tol=1e-12) for x, y in zip(*values, strict=True))


def test_comparison():
    """The comparison itself sees a wrong figure and a missing line."""
    compare(" torque │ -18552.9 │ N m\n", "other\ntorque ┃ -18552.8749 N m\n", "here")
    with pytest.raises(AssertionError):
        compare("torque 18552.9\n", "torque 18562.9\n", "here")
    with pytest.raises(AssertionError):
        compare("one\ntwo\n", "two\none\n", "here")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_code_named_exists(page):
    """A module, class or function that the text names by its path inside the package is there."""
    text = FENCE.sub("", page.read_text("utf-8"))
    for path in sorted(set(re.findall(rf"`((?:{LAYERS})(?:\.\w+)+)`", text))):
        if not path.endswith((".py", ".json")):
            assert _resolve(f"trunnion.{path}"), f"{page.relative_to(ROOT)}: there is no {path}"


def _resolve(path):
    parts = path.split(".")
    for cut in range(len(parts), 0, -1):
        try:
            found = importlib.import_module(".".join(parts[:cut]))
        except ModuleNotFoundError:
            continue
        for name in parts[cut:]:
            if not hasattr(found, name) and name not in getattr(found, "__annotations__", {}):
                return False
            found = getattr(found, name, None)
        return True
    return False


def test_every_key_of_the_model_is_told():
    """docs/meanings.yaml tells every key of every section, and no other; those of a measure are told by the code."""
    yaml = pytest.importorskip("yaml")
    from trunnion.model import joint_parts, measure_table, mechanism, parts, tolerance_parts

    for name, keys in yaml.safe_load((ROOT / "docs" / "meanings.yaml").read_text("utf-8")).items():
        modules = (mechanism, parts, joint_parts, tolerance_parts, measure_table)
        section = next(getattr(module, name) for module in modules if hasattr(module, name))
        assert keys.keys() == {field.alias or key for key, field in section.model_fields.items()}, name
    assert all(field.description for field in measure_table.Measure.model_fields.values())


def test_every_table_is_placed():
    """Each generated table stands on a page, and each place for one has a table."""
    pytest.importorskip("mkdocs")
    pytest.importorskip("latex2mathml")
    spec = importlib.util.spec_from_file_location("docs_hooks", ROOT / "docs" / "hooks.py")
    hooks = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(hooks)
    texts = [page.read_text("utf-8") for page in PAGES]
    assert {found for text in texts for found in re.findall(r"<!-- generated: (\S+).*? -->", text)} == set(hooks.TABLES)


@pytest.mark.parametrize("page", ["README.md", "docs/tutorial.md"])
def test_parts_of_the_press_are_those_of_the_file(page):
    """Every line of the model that these pages show stands in the example that their commands run."""
    model = (ROOT / "examples" / "drawing-press.yaml").read_text("utf-8").splitlines()
    shown = [line for one in blocks(ROOT / page) if one.language == "yaml" for line in one.text.splitlines()]
    assert shown
    assert set(shown) <= set(model)
