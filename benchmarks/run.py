"""Trunnion against its peers, and what a group costs: `make bench`, or `python -m benchmarks.run`.

Two measurements of the four-bar. Time: all contenders for a job take turns in one process, the best of several rounds
counts. Growth and memory: each contender alone in a fresh process per number of configurations, where the peak of the
resident memory is read. One thread but where two are named; CPU time stands beside the clock's.
"""

from __future__ import annotations

import argparse
import json
import math
import resource
import subprocess
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.side import JOBS, MOTION_COLUMNS, OUTPUTS, Job, Side, crank_angles, take_turns, timed, version

SIZES = (10**2, 10**3, 10**4, 10**5, 10**6)
BUDGET = 6.0  # s: a size expected to take longer is left out of the growth columns


@dataclass(frozen=True)
class Measured:
    """What was found for one contender: µs per configuration in turn, and alone µs and peak bytes by size."""

    best: float
    alone: dict[int, dict[str, float]]


# name → where its side is made, in the order of the table; Trunnion leads each job and is what the others are
# divided by. A side's module is imported when it is asked for, so that a process carries only what it measures.
CONTENDERS: dict[Job, dict[str, str]] = {
    "motion": {
        "Trunnion": "ours.trunnion_side",
        "Trunnion compiled": "ours.compiled_side",
        "Trunnion compiled, 2 threads": "ours.compiled_threads_side",
        "Numba loop": "reference_kernels.numba_side",
        "Numba loop, 2 threads": "reference_kernels.numba_threads_side",
        "pylinkage": "peers.pylinkage_side",
    },
    "friction": {
        "Trunnion": "ours.trunnion_side",
        "Trunnion compiled": "ours.compiled_side",
        "Trunnion compiled, 2 threads": "ours.compiled_threads_side",
        "Trunnion analyse()": "ours.dataset_side",
        "Numba loop": "reference_kernels.numba_side",
        "Numba loop, 2 threads": "reference_kernels.numba_threads_side",
        "stacked 9×9": "reference_kernels.stacked_side",
        "stacked 9×9, superposed": "reference_kernels.superposed_side",
    },
    "frictionless": {
        "Trunnion": "ours.trunnion_side",
        "Trunnion compiled": "ours.compiled_side",
        "Trunnion compiled, 2 threads": "ours.compiled_threads_side",
        "Numba loop": "reference_kernels.numba_side",
        "Numba loop, 2 threads": "reference_kernels.numba_threads_side",
        "Pinocchio": "peers.pinocchio_side",
        "fourbarhinge": "peers.fourbarhinge_side",
    },
}


def make(job: Job, name: str) -> Side | None:
    """A contender for a job, None if what it needs is not installed."""
    module, _, function = CONTENDERS[job][name].partition(".")
    side: Side | None = getattr(import_module(f"benchmarks.{module}"), function)(job)
    return side


def deviation(side: Side, n: int = 360) -> float:
    """Largest difference from the reference (the Numba loop's equations), relative to each column's peak."""
    kernels = import_module("benchmarks.reference_kernels")
    theta = crank_angles(n)
    if side.job == "motion":
        reference, columns = kernels.numba_motion(theta), MOTION_COLUMNS
    else:
        friction = {} if side.job == "friction" else {"friction_radius": 0.0}
        reference, columns = kernels.numba_loop(theta, **friction), OUTPUTS
    found = side.table(side.run(n))
    worst = 0.0
    for k, column in enumerate(side.columns):
        expected = reference[:, columns.index(column)]
        difference = np.abs(found[:, k] - expected)
        if column.startswith("link_angle"):
            difference = np.abs(np.angle(np.exp(1j * difference)))  # modulo a turn
        peak = np.abs(expected).max()
        if column != "iterations" and peak > 0.0:
            worst = max(worst, float(difference.max() / peak))
    return worst


def peak_memory() -> int:
    """Peak resident memory of this process, bytes.

    On Linux the high-water mark of the address space: ru_maxrss of a child also counts its parent before exec.
    """
    status = Path("/proc/self/status")
    if status.exists():
        for line in status.read_text().splitlines():
            if line.startswith("VmHWM"):
                return int(line.split()[1]) * 1024
    scale = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * scale


def measure_alone(job: Job, name: str, n: int) -> None:
    """In a fresh process: best time and peak memory of one contender, printed as JSON."""
    side = make(job, name)
    if side is None:
        raise SystemExit(f"{name} is not installed")
    side.run(100)
    rounds = 200 if n <= 1000 else 10 if n <= 10**5 else 2
    seconds = math.inf
    spent = 0.0
    for _ in range(rounds):
        once = timed(partial(side.run, n))
        seconds, spent = min(seconds, once), spent + once
        if spent > BUDGET / 4:
            break
    print(json.dumps({"us": seconds / n * 1e6, "bytes": peak_memory()}))


def growth(job: Job, side: Side, best: float, sizes: Iterable[int]) -> dict[int, dict[str, float]]:
    """µs per configuration and peak bytes of a side at each size, each in a process of its own."""
    found = {}
    for n in sizes:
        if best * n * 1e-6 > BUDGET:
            continue
        command = [sys.executable, "-m", "benchmarks.run", "--alone", job, side.name, str(n)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode == 0:
            found[n] = json.loads(done.stdout.splitlines()[-1])
    return found


def _figures(value: float) -> str:
    """Three significant digits without an exponent."""
    if not math.isfinite(value):
        return "–"
    return f"{value:.{max(0, 2 - math.floor(math.log10(value)))}f}" if value > 0 else "0"


def empty_table() -> Table:
    """The table's columns."""
    table = Table(title="Four-bar of Durango et al. (2010)", title_justify="left", pad_edge=False)
    table.add_column("job, contender")
    table.add_column("µs per\nconfiguration", justify="right")
    table.add_column("µs of\nCPU", justify="right")
    table.add_column("time against\nTrunnion", justify="right")
    for n in SIZES:
        table.add_column(f"µs at\n10^{round(math.log10(n))}", justify="right")
    table.add_column("peak MB at\n10^5", justify="right")
    table.add_column("peak MB at\n10^6", justify="right")
    table.add_column("deviation", justify="right")
    return table


def fill_job(table: Table, job: Job, rounds: int, sizes: tuple[int, ...]) -> dict[str, Measured]:
    """Measure one job and add its rows; returns the figures by contender."""
    sides = {name: side for name in CONTENDERS[job] if (side := make(job, name)) is not None}
    busy: dict[str, float] = {}
    best = take_turns(sides.values(), rounds, busy)
    found: dict[str, Measured] = {}
    table.add_row(f"[bold]{JOBS[job]}[/bold]")
    for name in CONTENDERS[job]:
        if name not in sides:
            table.add_row(f"  {name}", "not installed")
            continue
        side = sides[name]
        found[name] = Measured(best[name], growth(job, side, best[name], sizes))
        alone = found[name].alone
        table.add_row(
            f"  {name}" + (f" ({side.note})" if side.note else ""),
            _figures(best[name]),
            _figures(busy[name]),
            _figures(best[name] / best.get("Trunnion", math.nan)),
            *(_figures(alone[n]["us"]) if n in alone else "–" for n in SIZES),
            *(f"{alone[n]['bytes'] / 1e6:.0f}" if n in alone else "–" for n in (10**5, 10**6)),
            f"{deviation(side):.0e}",
        )
    table.add_section()
    return found


def verdicts(found: dict[Job, dict[str, Measured]]) -> list[tuple[str, bool]]:
    """The project's limits, each with whether it is kept; a limit whose contender is missing is left out."""
    limits = []
    friction, motion = found["friction"], found["motion"]
    if "Trunnion" in friction:
        ours = friction["Trunnion"]
        ratio = friction["stacked 9×9"].best / ours.best
        limits.append((f"with friction {ratio:.1f} × faster than the stacked 9×9, at least 5", ratio >= 5.0))
        one, two = "Trunnion compiled", "Trunnion compiled, 2 threads"
        for name, other in ((one, "Numba loop"), (two, "Numba loop, 2 threads")):
            if name in friction and other in friction:
                ratio = friction[other].best / friction[name].best
                limits.append((f"{name}: {ratio:.1f} × faster than the {other}, at least 3", ratio >= 3.0))
        if "Numba loop" in friction:
            limit = max(0.6, 2.5 * friction["Numba loop"].best)
            text = f"with friction {ours.best:.3f} µs, at most max(0.6, 2.5 × Numba loop) = {limit:.3f} µs"
            limits.append((text, ours.best <= limit))
        peaks = [
            side.alone[10**6]["bytes"] / 1e6 for name, side in friction.items() if "Trunnion" in name and side.alone
        ]
        if peaks:
            limits.append((f"10^6 configurations within {max(peaks):.0f} MB, at most 1000", max(peaks) <= 1000.0))
    if "Trunnion" in motion and "pylinkage" in motion:
        ratio = motion["pylinkage"].best / motion["Trunnion"].best
        limits.append((f"motion at {ratio:.2f} × the speed of pylinkage, at least 1", ratio >= 1.0))
    return limits


def linkages(console: Console, rounds: int) -> list[tuple[str, bool]]:
    """The second table, what a group costs, and its limits."""
    groups = import_module("benchmarks.groups")  # not above: a process measured alone shall not carry Trunnion
    with console.status("cost of a group"):
        table, found = groups.fill(rounds)
    console.print(table)
    console.print(
        "µs per configuration, best of the rounds; forces: all less motion. Stacked: Newton-Euler equations of all "
        "links at once, motion given and not timed, solved once with a right side for each joint's friction; "
        "deviation: of its forces, friction and efforts from Trunnion's, relative to the largest of their kind."
    )
    spatial = import_module("benchmarks.spatial")
    with console.status("spatial linkage"):
        table, in_space = spatial.fill(rounds)
    console.print(table)
    seats = import_module("benchmarks.seats")
    with console.status("loaded seats"):
        table, seated = seats.fill(rounds)
    console.print(table)
    limits: list[tuple[str, bool]] = groups.verdicts(found) + spatial.verdicts(in_space) + seats.verdicts(seated)
    return limits


def main() -> int:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=15, help="rounds of the interleaved timing")
    parser.add_argument("--no-growth", action="store_true", help="leave out growth and memory")
    parser.add_argument("--check", action="store_true", help="exit status 1 if a limit is broken")
    parser.add_argument("--alone", nargs=3, metavar=("JOB", "CONTENDER", "N"), help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.alone:
        job, name, n = options.alone
        measure_alone(job, name, int(n))
        return 0
    console = Console(width=None if sys.stdout.isatty() else 170)
    sizes = () if options.no_growth else SIZES
    table = empty_table()
    found: dict[Job, dict[str, Measured]] = {}
    for job, title in JOBS.items():
        with console.status(title):
            found[job] = fill_job(table, job, options.rounds, sizes)
    console.print(table)
    console.print(
        "µs per configuration: best of the rounds, contenders in turn, 10^5 configurations (Pinocchio 5000, "
        "fourbarhinge 500); µs and peak MB at a size: alone in a fresh process, interpreter and imports "
        "included; deviation: from the Numba loop, relative to each output's peak."
    )
    limits = verdicts(found)
    if version("trunnion"):
        limits += linkages(console, options.rounds)
    for sentence, kept in limits:
        console.print(f"{'kept' if kept else 'BROKEN'}: {sentence}")
    return int(options.check and not all(kept for _, kept in limits))


if __name__ == "__main__":
    sys.exit(main())
