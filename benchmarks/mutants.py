"""Seeded faults: each is put into a copy of the sources, and the tests that are to catch it are run.

    python -m benchmarks.mutants [--only NAME …] [--jobs N]

One line a fault: caught (a test fails), survived (all pass: a gap in the tests), no longer applies (the text is not
there exactly once: the list in `benchmarks/faults` has to follow the code), or broken (the tests fail without it, or
do not run). The exit status is 1 unless all are caught. Tests are those of the working tree; the sources they import
are the copy's.
"""

from __future__ import annotations

import argparse
import compileall
import os
import queue
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from benchmarks.faults import FAULTS, Fault

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "src" / "trunnion"
LONGEST = 600.0  # s; a fault may also keep tests from ending, which counts as caught
CAUGHT, SURVIVED, GONE, BROKEN = "caught", "survived", "no longer applies", "broken"
FAILED, PASSED = 1, 0  # exit status of pytest


def applies(fault: Fault) -> bool:
    """Whether the text to replace stands exactly once in its file."""
    file = PACKAGE / fault.file
    return file.is_file() and fault.find != fault.replacement and file.read_text("utf-8").count(fault.find) == 1


def copied(folder: Path) -> Path:
    """A copy of the sources, compiled: Python then trusts what was compiled, of all files but the one at fault."""
    shutil.copytree(ROOT / "src", folder / "src", ignore=shutil.ignore_patterns("__pycache__"))
    compileall.compile_dir(folder / "src", quiet=2)
    return folder / "src"


def run_tests(sources: Path, tests: Sequence[str]) -> int:
    """Exit status of pytest on the tests, with the package of a copy; that of a failure where it does not end."""
    told = {"PYTHONPATH": str(sources), "PYTHONDONTWRITEBYTECODE": "1"}
    command = [sys.executable, "-m", "pytest", "-x", "-p", "no:cacheprovider", *tests]
    try:
        ran = subprocess.run(
            command, cwd=ROOT, env={**os.environ, **told}, capture_output=True, timeout=LONGEST, check=False
        )
    except subprocess.TimeoutExpired:
        return FAILED
    return ran.returncode


def tried(fault: Fault, sources: Path) -> str:
    """What becomes of a fault; the copy is left as it was."""
    if not applies(fault):
        return GONE
    file = sources / "trunnion" / fault.file
    compiled = list((file.parent / "__pycache__").glob(f"{file.stem}.*.pyc"))
    kept = [(path, path.read_bytes()) for path in (file, *compiled)]
    text = file.read_text("utf-8").replace(fault.find, fault.replacement)
    times = file.stat()
    try:
        for path in compiled:  # a fault of the same length within a second would not be seen
            path.unlink()
        file.write_text(text, "utf-8", newline="\n")
        status = run_tests(sources, fault.tests)
    finally:
        for path, raw in kept:
            path.write_bytes(raw)
        os.utime(file, ns=(times.st_atime_ns, times.st_mtime_ns))
    return {FAILED: CAUGHT, PASSED: SURVIVED}.get(status, BROKEN)


def judged(faults: Sequence[Fault], jobs: int) -> dict[str, str]:
    """What becomes of each fault, told as it is known."""
    found: dict[str, str] = {}
    with tempfile.TemporaryDirectory(prefix="trunnion-faults-") as folder, ThreadPoolExecutor(jobs) as pool:
        free: queue.SimpleQueue[Path] = queue.SimpleQueue()
        for k in range(jobs):
            free.put(copied(Path(folder) / str(k)))

        def one(fault: Fault) -> str:
            sources = free.get()
            try:
                return tried(fault, sources)
            finally:
                free.put(sources)

        for fault, what in zip(faults, pool.map(one, faults), strict=True):
            found[fault.name] = what
            print(f"{what:18} {fault.name}  ({fault.file})", flush=True)
    return found


def failing(faults: Sequence[Fault]) -> list[str]:
    """The tests of the faults that fail, or choose nothing, on the sources as they are: their failing says nothing."""
    together: dict[tuple[str, ...], dict[str, None]] = {}  # paths that share a choice of tests run in one go
    for fault in faults:
        end = fault.tests.index("-k") if "-k" in fault.tests else len(fault.tests)
        together.setdefault(fault.tests[end:], {}).update(dict.fromkeys(fault.tests[:end]))
    runs = [[*paths, *choice] for choice, paths in together.items()]
    return [" ".join(tests) for tests in runs if run_tests(ROOT / "src", tests) != PASSED]


def main() -> int:
    """Try the faults; the exit status."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.mutants", description=__doc__)
    parser.add_argument("--only", nargs="+", metavar="NAME", help="faults whose names contain one of these")
    parser.add_argument("--jobs", type=int, default=1, help="how many at a time")
    asked = parser.parse_args()
    faults = [one for one in FAULTS if not asked.only or any(part in one.name for part in asked.only)]
    if not faults:
        parser.error("no fault has such a name")
    if wrong := failing(faults):
        print("these tests fail, or choose nothing, on the sources as they are:", *wrong, sep="\n  ")
        return 1
    found = judged(faults, max(1, asked.jobs))
    counts = Counter(found.values())
    print(", ".join(f"{counts[what]} {what}" for what in (CAUGHT, SURVIVED, GONE, BROKEN)), f"of {len(faults)}")
    return 0 if counts[CAUGHT] == len(faults) else 1


if __name__ == "__main__":
    sys.exit(main())
