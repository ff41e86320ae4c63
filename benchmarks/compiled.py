"""The compiled kernels beside NumPy's: `python -m benchmarks.compiled`.

Mechanisms with three numbers that differ from sample to sample: motion, and the drive effort with friction. All kernels
take turns in one process and the best of several rounds counts. NumPy runs in chunks on one core, the machine code of
LLVM on one and on all.
"""

from __future__ import annotations

import argparse
import os
import platform
import time
from collections.abc import Callable
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from trunnion import Mechanism
from trunnion.cycle.positions import CHUNK
from trunnion.solve.backward import pose_status, status_of
from trunnion.solve.run import Run, prepare
from trunnion.solve.walk_kernel import WalkKernel

EXAMPLES = Path(__file__).parents[1] / "examples"
JOBS = (
    ("durango-fourbar", False), ("durango-fourbar", True), ("watt-six-bar", True), ("toggle-press", True),
    ("stephenson-six-bar", True), ("rccc", True), ("rssr", True),
)  # fmt: skip
POSITIONS = 360
SPREAD = 1e-4


class Job(NamedTuple):
    """Numbers of a mechanism over samples, and the times of one cycle."""

    run: Run
    forces: bool
    values: dict[str, Any]
    times: Any


def best(run: Callable[[], Any], rounds: int) -> float:
    """Least time of several rounds, s."""
    times = []
    for _ in range(rounds):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return min(times)


def by_numpy(kernel: WalkKernel, values: dict[str, Any], moments: Any, samples: int) -> Any:
    """The same curves by NumPy, in chunks."""
    rows = max(1, CHUNK // len(moments))
    curves = {name: np.empty((samples, len(moments))) for name in kernel.figures}
    for low in range(0, samples, rows):
        part = {path: value[low : low + rows] if np.ndim(value) else value for path, value in values.items()}
        shape = (min(rows, samples - low), len(moments))
        with np.errstate(all="ignore"):
            back = kernel.back(part, moments)
            _ = status_of(back, shape) if kernel.forces else pose_status(back.walk, shape)
            for name, figure in kernel.figures.items():
                curves[name][low : low + rows] = figure(back)
    return curves


def job(name: str, forces: bool, configurations: int) -> Job:
    """A mechanism with three numbers that differ."""
    mechanism = Mechanism.read(EXAMPLES / f"{name}.yaml")
    run = prepare(mechanism)
    entries, rng = mechanism.parameter_set.entries, np.random.default_rng(1)
    free = (
        path for path, entry in entries.items()
        if path.startswith(("dimensions.", "links.")) and not entry.depends and run.values.get(path)
    )  # fmt: skip
    shape = (max(1, configurations // POSITIONS), 1)
    varied = {path: run.values[path] * (1 + SPREAD * rng.standard_normal(shape)) for path in islice(free, 3)}
    return Job(run, forces, mechanism.parameter_set.evaluate(varied), run.cycle.times(POSITIONS))


def kernel_of(one: Job, threads: int | None) -> WalkKernel:
    """A kernel that gives the angle of the last link, or the effort of the first driver."""
    driver, link = next(iter(one.run.system.mechanism.drivers)), list(one.run.system.mechanism.effective_links)[-1]

    def angle(back: Any) -> Any:
        frame = back.walk.motions[link].frame
        return np.arctan2(frame.s, frame.c)

    return WalkKernel(
        one.run, {"curve": (lambda back: back.efforts[driver]) if one.forces else angle}, one.forces, threads=threads
    )


def measured(one: Job, rounds: int, threads: int | None) -> str:
    """A row of the table: all kernels on one job, in turn."""
    kernels = {
        "compiled, one thread": kernel_of(one, 1),
        "compiled": kernel_of(one, threads),
    }
    samples = max(len(value) for value in one.values.values() if np.ndim(value))
    count = samples * len(one.times)
    start = time.perf_counter()
    curves, _ = kernels["compiled"].curves(one.values, one.times)
    first = time.perf_counter() - start
    again = kernels["compiled"].again / count
    some = max(1, min(samples, 200_000 // len(one.times)))  # as many as NumPy does in a second
    part = {path: value[:some] if np.ndim(value) else value for path, value in one.values.items()}
    expected = by_numpy(kernels["compiled"], part, one.times, some)["curve"]
    apart = float(np.nanmax(np.abs(curves["curve"][:some] - expected)) / np.nanmax(np.abs(expected)))
    calls: dict[str, Callable[[], Any]] = {
        name: partial(kernel.curves, one.values, one.times) for name, kernel in kernels.items()
    }
    for call in calls.values():
        call()
    numpy = partial(by_numpy, kernels["compiled"], part, one.times, some)
    least = dict.fromkeys(("numpy", *calls), np.inf)
    for _ in range(rounds):
        least["numpy"] = min(least["numpy"], best(numpy, 1) / (some * len(one.times)))
        for name, call in calls.items():
            least[name] = min(least[name], best(call, 1) / count)
    told = " | ".join(f"{1e6 * seconds:.3f}" for seconds in least.values())
    ratio = least["numpy"] / least["compiled, one thread"]
    return f"{told} | {ratio:.1f} | {first:.2f} | {apart:.0e} | {again:.1%} |"


def processor() -> str:
    """Name of the processor, where the system tells."""
    told = Path("/proc/cpuinfo")
    lines = told.read_text().splitlines() if told.exists() else []
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), platform.machine())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--threads", type=int, default=None, help="all cores if not given")
    parser.add_argument("--configurations", type=int, default=1_000_000)
    options = parser.parse_args()
    print(f"{processor()}, {os.cpu_count()} cores\n")
    print(
        "Microseconds a configuration; ratio of NumPy to compiled, one thread each; first call, s; largest difference"
    )
    print("from NumPy, of the peak; share that NumPy decides.\n")
    print("| job | NumPy | compiled, one thread | compiled | ratio | first | difference | NumPy decides |")
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |")
    for name, forces in JOBS:
        of = job(name, forces, options.configurations)
        print(
            f"| {name}, {'friction' if forces else 'motion'} | {measured(of, options.rounds, options.threads)}",
            flush=True,
        )


if __name__ == "__main__":
    main()
