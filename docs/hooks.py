"""What the build of the pages adds to their text, so that no table or picture can drift from the code.

- `<!-- generated: NAME -->` in a page becomes the table of that name, made from the code's own tables; see
  `page_tables/`.
- The figures and reports that a page refers to are drawn; see `figures.py`.
- The line that says that a page has no tables in the repository is left out.
- The gallery is made of the examples and of `tests/gallery/facts.py`; see `gallery_page.py`.
- `$x$` and `$$x$$` become MathML, which browsers set without any script.

With TRUNNION_DOCS=text in the environment every figure is an empty one and the gallery's figures are not computed:
text, links and tables are checked within seconds, as `make test` does.
"""

from __future__ import annotations

import gc
import os
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

from latex2mathml.converter import convert
from markdown.extensions import Extension
from markdown.inlinepatterns import InlineProcessor
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
EXAMPLES = ROOT / "examples"

TEXT_ONLY = os.environ.get("TRUNNION_DOCS") == "text"

# The matrices are small: further threads of the linear algebra would only spin. Said before NumPy is loaded.
for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
gc.set_threshold(50_000, 50, 50)  # pages and drawings are many small objects that live to the end

sys.path.append(str(DOCS))  # MkDocs has it there only while it loads this module
import figures  # noqa: E402
import gallery_page  # noqa: E402
import page_tables  # noqa: E402

# ---- mathematics ----------------------------------------------------------------------------------------------


class _Formula(InlineProcessor):
    """A formula between dollar signs, as MathML."""

    def handleMatch(self, m: re.Match[str], data: str) -> tuple[str | Element | None, int | None, int | None]:  # noqa: N802
        """MathML, kept away from the other patterns."""
        display = "block" if m.group(1) == "$$" else "inline"
        return self.md.htmlStash.store(convert(m.group(2).strip(), display=display)), m.start(0), m.end(0)


class Mathematics(Extension):
    """`$…$` in a line and `$$…$$` on its own."""

    def extendMarkdown(self, md: Any) -> None:  # noqa: N802
        """After code spans, before escapes: a backslash belongs to the formula."""
        md.inlinePatterns.register(_Formula(r"(?<!\\)(\$\$?)(?!\s)(.+?)(?<!\s)\1", md), "mathematics", 185)


def on_config(config: Any) -> Any:
    """Add the formulas to the Markdown extensions."""
    config["markdown_extensions"].append(Mathematics())
    return config


# ---- files that no page has -----------------------------------------------------------------------------------


def on_files(files: Files, config: Any) -> Files:
    """Draw what the pages refer to; put the examples and the schema beside them."""
    pages = [path.read_text("utf-8") for path in sorted(DOCS.rglob("*.md"))]
    for place, content in figures.drawn(pages, gallery_page):
        files.append(File.generated(config, place, content=content))
    for path in sorted(EXAMPLES.glob("*.yaml")):
        files.append(File.generated(config, f"examples/{path.name}", abs_src_path=str(path)))
    schema = ROOT / "src" / "trunnion" / "model" / "mechanism.schema.json"
    files.append(File.generated(config, f"reference/{schema.name}", abs_src_path=str(schema)))
    return files


# ---- tables ---------------------------------------------------------------------------------------------------


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Put the generated tables into a page."""

    def table(found: re.Match[str]) -> str:
        name, _, argument = found[1].partition(" ")
        if name not in TABLES:
            raise PluginError(f"there is no generated table '{name}'; known: {', '.join(TABLES)}")
        return TABLES[name](argument) if argument else TABLES[name]()

    markdown = re.sub(r"^> `make docs` fills in the tables? .*\n\n", "", markdown, flags=re.M)
    return re.sub(r"<!-- generated: (.+?) -->", table, markdown)


def gallery() -> str:
    """The entries of the gallery; those whose report a page shows link to it."""
    pages = "".join(path.read_text("utf-8") for path in DOCS.rglob("*.md"))
    reports = set(re.findall(r"figures/([\w-]+)/report\.html", pages))
    return gallery_page.page(figures.kept, reports, TEXT_ONLY)


TABLES: dict[str, Callable[..., str]] = {**page_tables.TABLES, "gallery": gallery}
