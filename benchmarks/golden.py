"""Every verb on every example, kept and compared: `python -m benchmarks.golden store FOLDER`, then `compare OLD NEW`.

A rearrangement of the program must not change a number. `store` runs the command line of this checkout and keeps what
each command writes, prints and exits with. `compare` shows the largest difference of any number between two such
folders, and everything else that differs: variables, dimensions, columns, attributes, exit statuses. Texts for people
(what is printed, titles, sentences) are counted only.
"""

from __future__ import annotations

import argparse
import csv
import io
import json
import math
import os
import re
import shutil
import sys
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

__all__ = ["Difference", "compare", "store"]

LIMIT = 1e-12  # of the largest value of the same variable
EXAMPLES = Path(__file__).parent.parent / "examples"
STEPS = ["--steps", "24"]
# verb → its options, what it writes
VERBS: dict[str, list[str]] = {
    "check": [],
    "analyse": [*STEPS, "--out", "out.nc", "--out", "out.csv", "--out", "out.json", "--report", "out.html"],
    "locking": STEPS,
    "design": [],
    "assemble": [*STEPS, "--out", "out.nc", "--out", "out.csv"],
    "play": [*STEPS, "--out", "out.nc", "--out", "out.csv"],
    "sweep": [*STEPS, "--margin", "--out", "out.nc", "--out", "out.csv"],
    "tolerance": [*STEPS, "--samples", "200", "--jobs", "1", "--out", "out.nc", "--out", "out.csv"],
    "allocate": [*STEPS, "--samples", "200", "--jobs", "1", "--out", "out.nc", "--out", "out.csv"],
    "plot": [*STEPS, "--format", "svg", "--out", "plots"],
}
# of a rig file, one after the other in one folder
RIG: dict[str, list[str]] = {
    "rig-plan": ["rig", "MODEL", "RIG", "--plan"],
    "rig": ["rig", "MODEL", "RIG", "--out", "rig", "--seed", "3"],
    "data": ["data", "rig/mapping.yaml", "--out", "data.nc", "--out", "data.csv"],
    "compare": ["compare", "MODEL", "rig/mapping.yaml", "--out", "compare.nc", "--out", "compare.csv"],
    "identify": ["identify", "MODEL", "rig/mapping.yaml", "--out", "identify.nc", "--out", "identify.csv"],
}
RIGGED = {"cardan-rig": "pezzuti-cardan", "fourbar-rig": "toleranced-fourbar"}  # rig → its model
# what measures rounding: its size matters, not its digits
RESIDUALS = {
    "power_residual",
    "closure_residual",
    "friction_change",
    "friction_residual",
    "seat_change",
    "efficiency_error",
}
# attributes that say when and by what a file was made, and sentences
PASSING = {"created", "version", "command", "trunnion", "duration", "seconds", "history"}


# ---- store ----------------------------------------------------------------------------------------------------


def store(folder: Path, jobs: int, only: str = "") -> None:
    """Run every command and keep what it leaves in folder/EXAMPLE/VERB."""
    tasks = [(rig, _one_rig) for rig in sorted((EXAMPLES / "rig").glob("*.yaml"))]
    tasks += [(model, _one_model) for model in sorted(EXAMPLES.glob("*.yaml"))]
    with ProcessPoolExecutor(jobs) as pool:
        running = [pool.submit(run, file, folder / file.stem) for file, run in tasks if only in file.stem]
        for done in as_completed(running):
            print(done.result(), file=sys.stderr, flush=True)


def _one_model(model: Path, folder: Path) -> str:
    for verb, options in VERBS.items():
        over = ["--over", _swept(model)] if verb == "sweep" else []
        _empty(folder / verb)
        _command([verb, str(model), *over, *options], folder / verb)
    return model.stem


def _one_rig(rig: Path, folder: Path) -> str:
    _empty(folder)
    model = str(EXAMPLES / f"{RIGGED[rig.stem]}.yaml")
    for name, words in RIG.items():
        _command([{"RIG": str(rig), "MODEL": model}.get(word, word) for word in words], folder, f"{name}-")
    return rig.stem


def _empty(folder: Path) -> None:
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)


def _swept(model: Path) -> str:
    """Two values of the first number of a model that is not zero."""
    import trunnion

    numbers = trunnion.read(model).parameters()
    for path, value in numbers.items():
        size = float(np.max(np.abs(np.asarray(value, dtype=float))))
        if path.startswith(("dimensions.", "links.", "loop.")) and size > 0 and np.ndim(value) == 0:
            return f"{path}={float(value)!r},{float(value) * 0.999!r}"
    return "gravity.y=0,-9.81"


def _command(words: list[str], folder: Path, name: str = "") -> None:
    """Run one command line in a folder; keep what it prints and its exit status there."""
    from trunnion.cli.app import main

    before, argv, printed, errors = Path.cwd(), sys.argv, io.StringIO(), io.StringIO()
    status: Any = 0
    os.chdir(folder)
    sys.argv = ["trunnion", *words]
    try:
        with redirect_stdout(printed), redirect_stderr(errors):
            main()
    except SystemExit as stop:
        status = stop.code
    finally:
        os.chdir(before)
        sys.argv = argv
    (folder / f"{name}printed.txt").write_text(printed.getvalue() + errors.getvalue(), encoding="utf-8")
    (folder / f"{name}exit.txt").write_text(f"{status}\n", encoding="utf-8")


# ---- compare --------------------------------------------------------------------------------------------------


@dataclass
class Difference:
    """What differs between two folders. largest: of any number, of the largest of its variable, and where."""

    files: int = 0
    numbers: int = 0
    largest: tuple[float, str] = (0.0, "")
    beyond: list[tuple[float, str]] = field(default_factory=list)
    other: list[str] = field(default_factory=list)
    added: list[tuple[str, list[str]]] = field(default_factory=list)
    texts: list[str] = field(default_factory=list)

    def values(self, old: Any, new: Any, place: str, scale: float = 0.0) -> None:
        """Compare two arrays. scale: what a difference is related to, beside the largest of them."""
        old, new = np.asarray(old), np.asarray(new)
        if old.shape != new.shape or (old.dtype.kind in "OUS") != (new.dtype.kind in "OUS"):
            self.other.append(f"{place}: shape {old.shape} was, {new.shape} is")
        elif old.dtype.kind in "OUSM":
            if not np.array_equal(old, new):
                self.other.append(f"{place}: other words")
        else:
            self.numbers += old.size
            self._numbers(old.astype(float), new.astype(float), place, scale)

    def _numbers(self, old: Any, new: Any, place: str, scale: float) -> None:
        same = (old == new) | (np.isnan(old) & np.isnan(new))
        if same.all():
            return
        size = max(scale, np.max(np.abs(old), where=np.isfinite(old), initial=0.0)) or 1.0
        gap = np.where(same, 0.0, np.abs(new - old) / size)
        largest = math.inf if np.isnan(gap).any() else float(gap.max())
        if RESIDUALS & set(re.split(r"[ .]", place)):
            return
        self.largest = max(self.largest, (largest, place))
        if largest > LIMIT:
            self.beyond.append((largest, place))

    def kept(self, old: Iterable[str], new: Iterable[str], place: str) -> None:
        """Note names that are gone, and those that are added."""
        was, now = set(old), set(new)
        if gone := sorted(was - now):
            self.other.append(f"{place}: {', '.join(gone)} gone")
        if more := sorted(now - was):
            self.added.append((place, more))

    def same(self, old: Any, new: Any, place: str) -> None:
        """Note two things that are not equal."""
        if old != new:
            self.other.append(f"{place}: {str(old)[:80]} was, {str(new)[:80]} is")


def compare(old: Path, new: Path) -> Difference:
    """Compare all that `store` kept in two folders."""
    found = Difference()
    names = [{path.relative_to(one) for path in one.rglob("*") if path.is_file()} for one in (old, new)]
    found.other += [f"{name}: is missing" for name in sorted(names[0] - names[1])]
    found.added += [("files", [str(name)]) for name in sorted(names[1] - names[0])]
    for name in sorted(names[0] & names[1]):
        found.files += 1
        kind = name.name if name.name.endswith("exit.txt") else name.suffix
        KINDS.get(kind, _texts)(old / name, new / name, str(name), found)
    return found


def _exits(old: Path, new: Path, name: str, found: Difference) -> None:
    found.same(old.read_text().strip(), new.read_text().strip(), name)


def _texts(old: Path, new: Path, name: str, found: Difference) -> None:
    if old.read_bytes() != new.read_bytes():
        found.texts.append(name)


def _datasets(old: Path, new: Path, name: str, found: Difference) -> None:
    import xarray as xr

    with xr.open_dataset(old, decode_times=False) as was, xr.open_dataset(new, decode_times=False) as now:
        found.kept(map(str, was.variables), map(str, now.variables), f"{name} variables")
        found.kept(map(str, was.attrs), map(str, now.attrs), f"{name} attributes")
        for one in sorted(map(str, set(was.variables) & set(now.variables))):
            found.same(was[one].dims, now[one].dims, f"{name} {one} dims")
            found.same(was[one].dtype.kind, now[one].dtype.kind, f"{name} {one} type")
            for key in ("units", "long_name"):
                found.same(was[one].attrs.get(key), now[one].attrs.get(key), f"{name} {one} {key}")
            found.values(was[one].values, now[one].values, f"{name} {one}")


def _rows(old: Path, new: Path, name: str, found: Difference) -> None:
    was, now = (list(csv.reader(path.read_text(encoding="utf-8").splitlines())) for path in (old, new))
    if not (was and now and len(was) == len(now)):
        found.same(len(was), len(now), f"{name} rows")
        return
    found.kept(was[0], now[0], f"{name} columns")
    kept = [column for column in now[0] if column in was[0]]
    found.same([column for column in was[0] if column in kept], kept, f"{name} order of columns")
    columns = {one: [row[was[0].index(one)] for row in was[1:]] for one in kept}
    of_quantity: dict[str, float] = {}  # the largest number of a quantity, over all joints and components
    for column, cells in columns.items():
        quantity = _quantity(column)
        of_quantity[quantity] = max([of_quantity.get(quantity, 0.0), *map(_size, cells)])
    for column, cells in columns.items():
        others = [row[now[0].index(column)] for row in now[1:]]
        _cells(cells, others, f"{name} {column}", found, of_quantity[_quantity(column)])


def _quantity(column: str) -> str:
    return re.sub(r"_[xyz]$", "", column.rpartition(".")[2])


def _size(cell: str) -> float:
    try:
        return abs(float(cell)) if math.isfinite(float(cell)) else 0.0
    except ValueError:
        return 0.0


def _cells(was: list[str], now: list[str], place: str, found: Difference, scale: float) -> None:
    try:
        old, new = ([float(cell or "nan") for cell in cells] for cells in (was, now))
    except ValueError:
        found.same(was, now, place)
        return
    found.values(old, new, place, scale)


def _json(old: Path, new: Path, name: str, found: Difference) -> None:
    was, now = (json.loads(path.read_text(encoding="utf-8")) for path in (old, new))
    _tree(was, now, name, found)


def _tree(was: Any, now: Any, place: str, found: Difference) -> None:
    if isinstance(was, dict) and isinstance(now, dict):
        found.kept(was, now, f"{place} keys")
        for key in sorted(was.keys() & now.keys() - PASSING):
            _tree(was[key], now[key], f"{place} {key}", found)
    elif _numeric(was) and _numeric(now) and np.shape(was) == np.shape(now):
        found.values(np.array(was, float), np.array(now, float), place)
    elif isinstance(was, list) and isinstance(now, list) and len(was) == len(now):
        for k, (a, b) in enumerate(zip(was, now, strict=True)):
            _tree(a, b, f"{place} {k}", found)
    elif isinstance(was, float) or isinstance(now, float):
        found.values(np.nan if was is None else was, np.nan if now is None else now, place)
    elif isinstance(was, str) and isinstance(now, str):
        if was != now:
            found.texts.append(place)
    else:
        found.same(was, now, place)


def _numeric(data: Any) -> bool:
    """Whether it is a list of numbers, nested or not, null among them."""
    if isinstance(data, list):
        return bool(data) and all(_numeric(one) for one in data)
    return data is None or (isinstance(data, (int, float)) and not isinstance(data, bool))


KINDS = {".nc": _datasets, ".csv": _rows, ".json": _json, "exit.txt": _exits}


def show(found: Difference) -> int:
    """Print what differs; 1 if anything does but texts."""
    print(f"{found.files:,} files, {found.numbers:,} numbers")
    print(f"largest difference {found.largest[0]:.3g} {found.largest[1]}")
    print(f"{len(found.beyond):,} variables beyond {LIMIT:g}, {len(found.other):,} other differences, ", end="")
    print(f"{len(found.texts):,} texts differ, {len(found.added):,} places have additions: ", end="")
    print(", ".join(sorted({one for _, names in found.added for one in names})) or "none")
    for size, place in sorted(found.beyond, reverse=True)[:40]:
        print(f"  {size:.3g}  {place}")
    for line in found.other[:60]:
        print(f"  {line}")
    return int(bool(found.beyond or found.other))


def main() -> None:
    """Store or compare."""
    words = argparse.ArgumentParser(prog="python -m benchmarks.golden", description=__doc__.splitlines()[0])
    verbs = words.add_subparsers(dest="verb", required=True)
    one = verbs.add_parser("store", help="run every verb on every example of this checkout")
    one.add_argument("folder", type=Path)
    one.add_argument("--jobs", type=int, default=2)
    one.add_argument("--only", default="", help="part of an example's name")
    two = verbs.add_parser("compare", help="what differs between two folders")
    two.add_argument("old", type=Path)
    two.add_argument("new", type=Path)
    two.add_argument("--texts", action="store_true", help="name the texts that differ")
    given = words.parse_args()
    if given.verb == "store":
        store(given.folder.resolve(), given.jobs, given.only)
        return
    found = compare(given.old, given.new)
    status = show(found)
    if given.texts:
        print(*found.texts, sep="\n")
    sys.exit(status)


if __name__ == "__main__":
    main()
