"""Write into the pages what their blocks print now: `python tests/manual/update_pages.py [PAGE …]`.

Only blocks that no longer hold are rewritten. Lines that a page leaves out (`…`) stay left out: each line shown is put
beside the line of the output that resembles it most, in order. What was changed is to be read before it is kept.
"""

import os
import shutil
import sys
import tempfile
from collections.abc import Sequence
from difflib import SequenceMatcher
from pathlib import Path

import pytest
from test_docs import PAGES, ROOT, blocks, compare, worked_through

LEFT_OUT = "…"
ALIKE = 0.4  # of the words of a line: less is another line
WIDTH = "200"


def updated(shown: str, printed: str) -> str:
    """The lines shown, as they are printed now; new lines between two that follow each other are taken in."""
    lines, given = shown.splitlines(), printed.rstrip().splitlines()
    wanted = [k for k, line in enumerate(lines) if line.strip() != LEFT_OUT]
    place = dict(zip(wanted, _aligned([lines[k] for k in wanted], given), strict=True))
    found: list[str] = []
    last: int | None = None  # the line of the output that was written last; None after lines left out
    for k, line in enumerate(lines):
        at = place.get(k)
        if line.strip() == LEFT_OUT:
            found.append(line)
            last = None
        elif at is not None:
            found += given[at if last is None else last + 1 : at + 1]
            last = at
    if lines and lines[-1].strip() != LEFT_OUT and last is not None:
        found += given[last + 1 :]
    return "\n".join(line.rstrip() for line in found) + "\n"


def _aligned(wanted: Sequence[str], given: Sequence[str]) -> list[int | None]:
    """For each line its line of the output, rising, of greatest resemblance in all; None where there is none."""
    best = [[0.0] * (len(given) + 1) for _ in range(len(wanted) + 1)]
    like = [[SequenceMatcher(None, a.split(), b.split(), autojunk=False).ratio() for b in given] for a in wanted]
    for i in range(len(wanted) - 1, -1, -1):
        for j in range(len(given) - 1, -1, -1):
            both = like[i][j] + best[i + 1][j + 1] if like[i][j] >= ALIKE else 0.0
            best[i][j] = max(both, best[i + 1][j], best[i][j + 1])
    found: list[int | None] = []
    j = 0
    for i in range(len(wanted)):
        while j < len(given) and best[i][j] == best[i][j + 1]:
            j += 1
        taken = j < len(given) and best[i][j] != best[i + 1][j] and like[i][j] >= ALIKE
        found.append(j if taken else None)
        j += int(taken)
    return found


def update(page: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Rewrite the outputs of one page that do not hold; which commands failed or were updated."""
    text, told = page.read_text("utf-8"), []
    for block, shown, statuses in worked_through(page, monkeypatch):
        where = f"{page.relative_to(ROOT)}:{block.line}"
        if not {*statuses} <= {0, block.exit}:
            told.append(f"{where}: exit statuses {statuses}\n{shown}")
        if block.language == "text":
            try:
                compare(block.text, shown, where)
            except AssertionError:
                told.append(f"{where}: updated")
                text = text.replace(f"```text\n{block.text}```", f"```text\n{updated(block.text, shown)}```", 1)
    page.write_text(text, "utf-8")
    return told


def main(names: Sequence[str]) -> None:
    """Update the pages named, or all."""
    pages = [page for page in PAGES if not names or any(str(page).endswith(name) for name in names)]
    titled = {block.title: block.text for page in PAGES for block in blocks(page) if block.title}
    os.environ["COLUMNS"] = WIDTH
    for page in pages:
        with tempfile.TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as monkeypatch:
            shutil.copytree(ROOT / "examples", Path(folder) / "examples")
            for name, text in titled.items():
                (Path(folder) / name).write_text(text, encoding="utf-8")
            monkeypatch.chdir(folder)
            for line in update(page, monkeypatch):
                print(line, flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
