"""Tolerance studies: `python -m benchmarks.tolerances`.

Time a configuration (one sample at one position), workers, memory with the number of samples, the peer, and the
accuracy of Sobol points beside plain ones. All contenders of a table run in one go on one machine; read the ratios.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import platform
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

import trunnion
from benchmarks import durango as d
from benchmarks.run import peak_memory
from trunnion.model.mechanism import Mechanism
from trunnion.studies.batch import run
from trunnion.studies.tolerance.linear import ToleranceStudy, study
from trunnion.studies.tolerance.sampling import Method, Sampling

EXAMPLES = Path(__file__).parent.parent / "examples"
LIMITS = {"AB": "±1 mm", "BC": "±1 mm", "CD": "±1 mm", "AD": "±1 mm"}
BOTH = ("angle:rocker", "effort:A")
MOST_SAMPLES = 10_000_000


def fourbar(friction: bool = True) -> Mechanism:
    """The four-bar of Durango et al. with ±1 mm on its lengths."""
    mechanism = Mechanism.read(EXAMPLES / "durango-fourbar.yaml")
    mechanism = mechanism.with_values({f"tolerances.{name}": limits for name, limits in LIMITS.items()})
    return mechanism if friction else mechanism.with_friction("off")


def sampling(found: ToleranceStudy, samples: int, method: Method = "monte-carlo", seed: int = 1) -> Sampling:
    return found.sampling(method, samples, seed)


def spent(action: Callable[[], object]) -> float:
    """Seconds."""
    start = time.perf_counter()
    action()
    return time.perf_counter() - start


# ---- time and workers -----------------------------------------------------------------------------------------


def table(title: str, *columns: str) -> Table:
    found = Table(title=title, title_justify="left", pad_edge=False)
    for i, name in enumerate(columns):
        found.add_column(name, justify="left" if i == 0 else "right")
    return found


def workers(console: Console, samples: int) -> None:
    """One and more processes on the same run: angle and torque with friction, 360 positions."""
    found = study(fourbar(), BOTH)
    job = sampling(found, samples)
    shown = table(f"{samples:,} samples × 360 positions, angle and torque with friction", "jobs", "s", "µs/config", "×")
    first = math.nan
    for jobs in dict.fromkeys((1, 2, os.cpu_count() or 1)):
        seconds = spent(lambda jobs=jobs: run(job, jobs=jobs))
        first = seconds if jobs == 1 else first
        shown.add_row(str(jobs), f"{seconds:.2f}", f"{seconds / samples / 360 * 1e6:.3f}", f"{first / seconds:.2f}")
    console.print(shown)


# ---- memory ---------------------------------------------------------------------------------------------------


def whole(samples: int) -> None:
    """In a fresh process: the study that a user asks for, all of it, on all cores; printed as JSON."""
    mechanism = Mechanism.read(EXAMPLES / "toleranced-fourbar.yaml")
    start, busy = time.perf_counter(), time.process_time()
    trunnion.tolerance(mechanism, samples=samples, steps=36)
    told = {"seconds": time.perf_counter() - start, "busy": time.process_time() - busy, "bytes": peak_memory()}
    print(json.dumps(told))


def growth(console: Console) -> None:
    """Peak memory and time of the whole study with the number of samples, by the engine that `auto` takes."""
    shown = table("toleranced-fourbar, both measures, 36 positions, all cores", "samples", "s", "s of CPU", "MiB")
    for samples in (10_000, 100_000, 1_000_000, MOST_SAMPLES):
        command = [sys.executable, "-m", "benchmarks.tolerances", "--whole", str(samples)]
        told = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()[-1])
        shown.add_row(f"{samples:,}", f"{told['seconds']:.1f}", f"{told['busy']:.1f}", f"{told['bytes'] / 2**20:.0f}")
    console.print(shown)


# ---- the peer -------------------------------------------------------------------------------------------------


def peer(console: Console) -> None:
    """Monte Carlo of the coupler point by pylinkage, kinematics only, beside ours of the same and of much more."""
    try:
        from pylinkage.actuators import Crank
        from pylinkage.components import Ground
        from pylinkage.dyads import RRRDyad
        from pylinkage.simulation import Linkage
    except ImportError:
        console.print("pylinkage is not installed")
        return
    steps, samples, few = 360, 10_000, 200
    frame_a, frame_d = Ground(0.0, 0.0, name="A"), Ground(d.AD, 0.0, name="D")
    crank = Crank(anchor=frame_a, radius=d.AB, angular_velocity=2 * math.pi / steps, initial_angle=0.0, name="B")
    rocker = RRRDyad(crank.output, frame_d, distance1=d.BC, distance2=d.CD, x=3.9, y=2.5, name="C")
    linkage = Linkage([frame_a, frame_d, crank, rocker])
    nominal = np.array(linkage.get_constraints(), float)
    drawn = (nominal + np.random.default_rng(1).uniform(-1e-3, 1e-3, (few, nominal.size))).tolist()

    def theirs() -> None:  # its own `analyze_tolerance` walks through Python and takes twenty times as long
        for lengths in drawn:
            linkage.set_constraints(lengths)
            linkage.step_fast(iterations=steps)

    theirs()  # compiles
    rows = [("pylinkage, path of C", min(spent(theirs) for _ in range(5)) / few / steps)]
    for label, mechanism, measures in (
        ("Trunnion, path of C", fourbar(friction=False), ("coupler.C.x", "coupler.C.y")),
        ("Trunnion, angle and torque with friction", fourbar(), BOTH),
    ):
        found = study(mechanism, measures)
        for engine in ("numpy", "compiled"):
            job = found.sampling("monte-carlo", samples, 1, engine)
            sampler = job.prepare()
            sampler(0)
            best = min(spent(lambda: [sampler(block) for block in range(job.blocks)]) for _ in range(3))  # noqa: B023
            rows.append((f"{label}, {engine}", best / samples / steps))
    shown = table("One process, 360 positions: against the peer", "study", "µs/config", "peer/this")
    for label, one in rows:
        shown.add_row(label, f"{one * 1e6:.3f}", f"{rows[0][1] / one:.1f}")
    console.print(shown)


# ---- Sobol points ---------------------------------------------------------------------------------------------


def accuracy(console: Console) -> None:
    """Root mean square errors over seeds of the four-bar's rocker angle at 60°, plain and Sobol points."""
    mechanism = Mechanism.read(EXAMPLES / "toleranced-fourbar.yaml")
    found = study(mechanism, ["angle:rocker"], at="60 deg")
    seeds = range(1, 17)

    def figures(method: Method, samples: int, seed: int) -> tuple[float, float, float]:
        job = sampling(found, samples, method, seed)
        (figure,) = job.joined(run(job)[0]).figure
        return float(np.mean(figure)), float(np.std(figure, ddof=1)), float(np.quantile(figure, 0.99))

    exact = np.mean([figures("quasi-monte-carlo", 1 << 20, 1000 + seed) for seed in range(2)], axis=0)
    shown = table(
        "Rocker angle at 60°: root mean square error over 16 seeds, nrad",
        "points",
        "mean",
        "deviation",
        "99 % quantile",
    )
    for label, method, samples in (
        ("plain, 1,000,000", "monte-carlo", 1_000_000),
        ("plain, 50,000", "monte-carlo", 50_000),
        ("Sobol, 8 × 4,096", "quasi-monte-carlo", 32_768),
        ("Sobol, 8 × 1,024", "quasi-monte-carlo", 8_192),
    ):
        some = [figures(method, samples, seed) for seed in seeds]  # type: ignore[arg-type]
        errors = np.sqrt(np.mean((np.array(some) - exact) ** 2, axis=0))
        shown.add_row(label, *(f"{error * 1e9:.3g}" for error in errors))
    console.print(shown)


PARTS: dict[str, Callable[[Console], None]] = {
    "workers": lambda console: workers(console, 100_000),
    "growth": growth,
    "peer": peer,
    "accuracy": accuracy,
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("parts", nargs="*", choices=[*PARTS, []], help="all if none is named")
    parser.add_argument("--whole", type=int, metavar="SAMPLES", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.whole:
        whole(options.whole)
        return
    console = Console(width=120)
    console.print(
        f"Trunnion {trunnion.__version__}, NumPy {np.__version__}, {platform.machine()}, {os.cpu_count()} cores"
    )
    for name in options.parts or PARTS:
        PARTS[name](console)


if __name__ == "__main__":
    main()
