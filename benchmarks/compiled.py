"""The compiled kernel beside NumPy's: `python -m benchmarks.compiled`, on a CPU or, where JAX finds one, on a GPU.

The four-bar of `examples/durango-fourbar.yaml` with three lengths that differ from sample to sample: its motion, and
the drive effort with friction. Both kernels take turns in one process and the best of several rounds counts. NumPy
runs in chunks on one core; JAX on as many threads as it is given. What the device is and how much of it is used is
printed beside: the bytes that must be written at least and the operations that the program counts, against what a copy
and a chain of products reach on the same device in the same run.
"""

from __future__ import annotations

import argparse
import os
import platform
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from trunnion import Mechanism
from trunnion.cycle.positions import CHUNK
from trunnion.measures.measures import named
from trunnion.solve.run import prepare
from trunnion.solve.status import pose_status, status_of
from trunnion.studies.tolerance.compiled import CompiledKernel

MODEL = Path(__file__).parents[1] / "examples" / "durango-fourbar.yaml"
SIZES = (10**4, 10**5, 10**6, 4 * 10**6)
POSITIONS = 360
SPREAD = 1e-3
PROBE = 1 << 24  # numbers in the arrays that measure the device


class Found(NamedTuple):
    """Seconds of both kernels, the largest difference relative to the curve's peak, and the share computed again."""

    numpy: float
    jax: float
    apart: float
    again: float


def best(run: Callable[[], Any], rounds: int) -> float:
    """Least time of several rounds, s."""
    times = []
    for _ in range(rounds):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return min(times)


def by_numpy(kernel: CompiledKernel, values: dict[str, Any], moments: Any, samples: int) -> Any:
    """The same curves by NumPy, in chunks."""
    rows = max(1, CHUNK // len(moments))
    curves = {name: np.empty((samples, len(moments))) for name in kernel.figures}
    for low in range(0, samples, rows):
        part = {path: value[low : low + rows] if np.ndim(value) else value for path, value in values.items()}
        shape = (min(rows, samples - low), len(moments))
        back = kernel.by_numpy(part, moments)
        _ = status_of(back, shape) if kernel.forces else pose_status(back.walk, shape)
        with np.errstate(all="ignore"):
            for name, figure in kernel.figures.items():
                curves[name][low : low + rows] = figure(back)
    return curves


def job(forces: bool, samples: int, threads: int | None) -> tuple[CompiledKernel, dict[str, Any], Any]:
    """The kernel, all numbers, and the times of one turn."""
    mechanism = Mechanism.read(MODEL)
    run = prepare(mechanism)
    (measure,) = named(mechanism, ["effort:A" if forces else "angle:rocker"], run.values)
    figure = (lambda back: back.efforts["A"]) if forces else (lambda back: measure.value(back.walk))
    rng = np.random.default_rng(1)
    varied = {
        f"dimensions.{name}": run.values[f"dimensions.{name}"] * (1 + SPREAD * rng.standard_normal((samples, 1)))
        for name in ("AB", "BC", "CD")
    }
    kernel = CompiledKernel(run, {measure.name: figure}, forces, threads=threads)
    return kernel, mechanism.parameter_set.evaluate(varied), run.cycle.times(POSITIONS)


def measured(forces: bool, configurations: int, rounds: int, threads: int | None) -> Found:
    """Both kernels on one job."""
    samples = max(1, configurations // POSITIONS)
    kernel, values, moments = job(forces, samples, threads)
    curves, _ = kernel.curves(values, moments)  # compiled by now
    again = kernel.again / (samples * POSITIONS)
    expected = by_numpy(kernel, values, moments, samples)
    apart = max(float(np.nanmax(np.abs(curves[n] - e)) / np.nanmax(np.abs(e))) for n, e in expected.items())
    return Found(
        best(lambda: by_numpy(kernel, values, moments, samples), rounds),
        best(lambda: kernel.curves(values, moments), rounds),
        apart,
        again,
    )


def device(jax: Any, rounds: int) -> tuple[float, float]:
    """What the device reaches: bytes/s of y = 2 x, and operations/s of a chain of 256 products and sums."""
    numbers = jax.numpy.linspace(0.0, 1.0, PROBE)
    copy = jax.jit(lambda x: 2 * x)

    @jax.jit
    def chain(x: Any) -> Any:
        for _ in range(128):
            x = x * 0.999 + 1e-3
        return x

    for run in (copy, chain):
        jax.block_until_ready(run(numbers))
    bandwidth = 16 * PROBE / best(lambda: jax.block_until_ready(copy(numbers)), rounds)
    return bandwidth, 256 * PROBE / best(lambda: jax.block_until_ready(chain(numbers)), rounds)


def operations(kernel: CompiledKernel, values: dict[str, Any], moments: Any) -> tuple[float, float]:
    """Floating-point operations and bytes of memory or cache for one configuration, as the compiler counts them."""
    arrays = {path: np.asarray(value) for path, value in values.items() if np.ndim(value)}
    cost = kernel.function(values).lower(arrays, moments).compile().cost_analysis()
    cost = cost[0] if isinstance(cost, list) else cost
    lanes = len(next(iter(arrays.values()))) * len(moments)
    return cost.get("flops", 0.0) / lanes, cost.get("bytes accessed", 0.0) / lanes


def processor() -> str:
    """Name of the processor, where the system tells."""
    told = Path("/proc/cpuinfo")
    lines = told.read_text().splitlines() if told.exists() else []
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), platform.machine())


def main() -> None:
    import jax

    jax.config.update("jax_enable_x64", True)
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--threads", type=int, default=None, help="of JAX on a CPU; all cores if not given")
    parser.add_argument("--sizes", type=int, nargs="*", default=SIZES, help="configurations")
    options = parser.parse_args()
    one = jax.devices()[0]
    print(f"{processor()}, {os.cpu_count()} cores; JAX {jax.__version__} on {one.platform}: {one.device_kind}")
    bandwidth, speed = device(jax, options.rounds)
    print(f"the device copies {bandwidth / 1e9:.1f} GB/s and computes {speed / 1e9:.1f} GFLOP/s (float64)\n")
    print("| job | configurations | NumPy, M/s | JAX, M/s | ratio | apart | again |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for forces in (False, True):
        name = "drive effort with friction" if forces else "motion"
        found = None
        for size in options.sizes:
            found = measured(forces, size, options.rounds, options.threads)
            print(
                f"| {name} | {size:.0e} | {size / found.numpy / 1e6:.2f} | {size / found.jax / 1e6:.2f}"
                f" | {found.numpy / found.jax:.2f} | {found.apart:.0e} | {found.again:.1%} |"
            )
        if found is not None:
            kernel, values, moments = job(forces, 64, options.threads)
            flops, touched = operations(kernel, values, moments)
            rate = options.sizes[-1] / found.jax
            written = 8 * len(kernel.figures) + 2  # curves, status, and whether it is to be computed again
            print(
                f"\n{name}: {flops:.0f} operations a configuration, {flops * rate / speed:.0%} of the device's"
                f" arithmetic; {written} bytes that must be written, {written * rate / bandwidth:.1%} of its bandwidth;"
                f" {touched:.0f} bytes between loops, {touched * rate / bandwidth:.0%} of it if none were in cache\n"
            )


if __name__ == "__main__":
    main()
