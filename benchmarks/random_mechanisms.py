"""Are the results right on mechanisms nobody drew? `python -m benchmarks.random_mechanisms`

Random planar and spatial mechanisms are analysed, and every position judged from the published results and the model's
numbers alone, by code that shares nothing with Trunnion (`benchmarks.judge`): joints that close in place, velocity and
acceleration, every link in balance by Newton and Euler, powers that add up, and friction by its law from the published
reactions and slip speeds. Each seed is one mechanism; `--only planar-17` replays it.

A position that is not `solved` is counted, not judged: a relative speed is zero there and friction an interval, it is
close to a dead centre, locked, or cannot be assembled. Most mechanisms are worked out without the search for the
locking margin, which takes most of the time of `trunnion.analyse` and changes no other number; every `--whole`-th goes
through `analyse`.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import sys
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

import trunnion
from benchmarks.drawn import planar, spatial
from benchmarks.judged import planar as judged_planar
from benchmarks.judged import spatial as judged_spatial
from benchmarks.judged.verdict import CHECKS, Data, Results, Verdict
from trunnion.solve.run import prepare

SPACES = {
    "planar": (planar.drawn, judged_planar.judge),
    "spatial": (spatial.drawn, judged_spatial.judge),
    "seated": (planar.seated, judged_planar.judge),
}
SHOWN = 12  # offenders listed for each check

__all__ = ["Found", "examine", "main", "result_of"]


@dataclass(frozen=True)
class Found:
    """What one seed came to.

    statuses: positions by code; worst: by check the largest residual of a solved position, that position, and of which
    joint or link; broken: by check the solved positions over the limit; refused: why there is no result.
    """

    name: str
    family: str
    statuses: Counter[int] = field(default_factory=Counter)
    worst: dict[str, tuple[float, int, str]] = field(default_factory=dict)
    broken: dict[str, int] = field(default_factory=dict)
    refused: str = ""
    crashed: str = ""
    seconds: float = 0.0


def result_of(data: Data, steps: int, whole: bool) -> Results:
    """The published numbers: of `trunnion.analyse` (whole), or the same without the search for the locking margin."""
    mechanism = trunnion.Mechanism(**data)
    if whole:
        return Results(trunnion.analyse(mechanism, steps))
    from trunnion.cycle.positions import positions
    from trunnion.results.variables import variables

    found = positions(prepare(mechanism), steps, margin=False)
    known = variables(mechanism.space)
    return Results.of(found.arrays, {name: known[name].dims for name in found.arrays}, found.labels, found.time)


def examine(space: str, seed: int, steps: int = 24, whole: bool = True) -> Found:
    """Draw, analyse and judge one mechanism."""
    begin = time.perf_counter()
    draw, judge = SPACES[space]
    family, data = draw(seed)
    name = f"{space}-{seed}"
    try:
        result = result_of(data, steps, whole)
    except trunnion.MechanismError as error:
        return Found(name, family, refused=str(error).splitlines()[0])
    except Exception as error:
        return Found(name, family, crashed=f"{type(error).__name__}: {error}")
    verdict = judge(data, result)
    return Found(
        name,
        family,
        Counter(int(code) for code in verdict.status),
        {check: verdict.worst(check) for check in CHECKS},
        {check: int(np.sum(verdict.broken(check))) for check in CHECKS},
        seconds=time.perf_counter() - begin,
    )


def _examine(job: tuple[str, int, int, bool]) -> Found:
    return examine(*job)


def _all(jobs: Sequence[tuple[str, int, int, bool]], workers: int) -> Iterator[Found]:
    """One after another, or in several processes."""
    if workers < 2:
        yield from map(_examine, jobs)
        return
    with multiprocessing.get_context("spawn").Pool(workers) as pool:
        yield from pool.imap_unordered(_examine, jobs, chunksize=8)


def _counts(console: Console, found: Sequence[Found]) -> None:
    """Mechanisms and positions by status, of the spaces and of the families."""
    statuses = sorted({code for one in found for code in one.statuses})
    table = Table(title="Positions by status", title_justify="left", pad_edge=False)
    table.add_column("space, family")
    for title in ("mechanisms", "refused", "positions", *(trunnion.Status(code).name.lower() for code in statuses)):
        table.add_column(title.replace("_", "\n"), justify="right")
    for space in SPACES:
        own = [one for one in found if one.name.startswith(space)]
        families = sorted({one.family for one in own})
        for family in [*families, ""]:
            part = [one for one in own if family in ("", one.family)]
            total: Counter[int] = sum((one.statuses for one in part), Counter())
            if part:
                cells = [len(part), sum(bool(one.refused) for one in part), sum(total.values())]
                cells += [total[code] for code in statuses]
                style = "" if family else "bold"
                table.add_row(f"  {family}" if family else space, *(f"{n:,}" for n in cells), style=style)
    console.print(table)


def _worst(console: Console, found: Sequence[Found]) -> int:
    """The largest residuals by check, and those who broke a limit; how many positions did."""
    table = Table(title="Residuals of solved positions, relative", title_justify="left", pad_edge=False)
    for title in ("check", "space", "limit", "largest", "of", "positions over", "mechanisms over"):
        table.add_column(title, justify="left" if title in ("check", "space", "of") else "right")
    judged = [one for one in found if one.worst]
    for check, limit in CHECKS.items():
        for space in SPACES:
            own = [one for one in judged if one.name.startswith(space)]
            if not own:
                continue
            worst = max(own, key=lambda one: one.worst[check][0])
            residual, position, where = worst.worst[check]
            over = [one.broken[check] for one in own if one.broken[check]]
            of = f"{worst.name} ({worst.family}), position {position}, {where}"
            table.add_row(check, space, f"{limit:g}", f"{residual:.2e}", of, f"{sum(over):,}", f"{len(over):,}")
    console.print(table)
    for check in CHECKS:
        broken = sorted((one for one in judged if one.broken[check]), key=lambda one: -one.worst[check][0])
        for one in broken[:SHOWN]:
            residual, position, where = one.worst[check]
            count = one.broken[check]
            text = (
                f"{check}: {one.name} ({one.family}) {residual:.2e} at position {position}, {where}; {count} positions"
            )
            console.print(text, highlight=False)
        if len(broken) > SHOWN:
            console.print(f"{check}: and {len(broken) - SHOWN} mechanisms more", highlight=False)
    return sum(sum(one.broken.values()) for one in judged)


def _refused(console: Console, found: Sequence[Found]) -> int:
    """Models that the check turned away, by its words, and those that ended the program; how many of these."""
    reasons = Counter(f"{one.family}: {one.refused}" for one in found if one.refused)
    for reason, count in reasons.most_common(SHOWN):
        console.print(f"refused {count} × {reason}", highlight=False)
    crashed = [one for one in found if one.crashed]
    for one in crashed:
        console.print(f"crashed: {one.name} ({one.family}) {one.crashed}", highlight=False)
    return len(crashed)


def _replay(console: Console, names: Sequence[str], steps: int, model: bool) -> int:
    """Every check of some mechanisms, position by position."""
    broken = 0
    for name in names:
        space, _, seed = name.partition("-")
        draw, judge = SPACES[space]
        family, data = draw(int(seed))
        if model:
            print(json.dumps({"trunnion": 1, **data}, indent=1))
            continue
        verdict: Verdict = judge(data, result_of(data, steps, True))
        table = Table(title=f"{name}: {family}", title_justify="left", pad_edge=False)
        for title in ("position", "status", *CHECKS, "of"):
            table.add_column(title)
        for i, code in enumerate(verdict.status):
            cells: list[Any] = [f"{verdict.residuals.get(check, np.zeros(steps))[i]:.1e}" for check in CHECKS]
            over = [check for check in CHECKS if verdict.broken(check)[i]]
            broken += len(over)
            of = ", ".join(f"{check}: {verdict.where[check][i]}" for check in over)
            table.add_row(str(i), trunnion.Status(int(code)).name.lower(), *cells, of)
        console.print(table)
    return broken


def main(arguments: Sequence[str] | None = None) -> int:
    """The command line; 1 if a solved position breaks a limit or a mechanism ends the program."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.random_mechanisms", description=__doc__.splitlines()[0])
    parser.add_argument("--planar", type=int, default=10_000, help="planar mechanisms (10000)")
    parser.add_argument("--spatial", type=int, default=1_000, help="spatial mechanisms (1000)")
    parser.add_argument("--seated", type=int, default=0, help="planar ones with their pins in loaded seats (0)")
    parser.add_argument("--steps", type=int, default=24, help="positions of each (24)")
    parser.add_argument("--seed", type=int, default=0, help="the first seed; each mechanism has the next (0)")
    parser.add_argument("--jobs", type=int, default=1, help="processes (1)")
    parser.add_argument("--whole", type=int, default=20, help="every so many go through trunnion.analyse itself (20)")
    parser.add_argument("--only", nargs="+", metavar="NAME", help="replay these alone, such as planar-17 spatial-3")
    parser.add_argument("--model", action="store_true", help="with --only: print the models as JSON instead")
    options = parser.parse_args(arguments)
    console = Console(width=None if sys.stdout.isatty() else 150)
    if options.only:
        return int(_replay(console, options.only, options.steps, options.model) > 0)
    jobs = [
        (space, options.seed + k, options.steps, k % options.whole == 0)
        for space in SPACES
        for k in range(getattr(options, space))
    ]
    begin = time.perf_counter()
    found = list(_all(jobs, options.jobs))
    console.print(f"{len(found):,} mechanisms, seeds from {options.seed}, {time.perf_counter() - begin:.0f} s")
    _counts(console, found)
    broken = _worst(console, found)
    crashed = _refused(console, found)
    return int(broken + crashed > 0)


if __name__ == "__main__":
    sys.exit(main())
