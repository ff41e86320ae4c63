"""The engine for a GPU beside the compiled engine and the limits of the device: `python -m benchmarks.gpu`.

Mechanisms of `benchmarks.compiled`. Times are of the kernel alone, and of a batch with its check, its doubtful lanes
and all copies; limits are what a chain of products and sums, and a copy, reach there. Operations are those of 64 bits
in the PTX, each counted once, though a loop may repeat it.
"""

from __future__ import annotations

import argparse
import re
import time
from functools import partial
from typing import Any

import numpy as np

from benchmarks.compiled import JOBS, Job, best, job, kernel_of
from trunnion.engines.device import Device, DeviceCode, device, ptx
from trunnion.engines.graph import BOTH, Graph
from trunnion.engines.program import Program, program
from trunnion.errors import MechanismError
from trunnion.solve.compiled_device import DeviceKernel
from trunnion.solve.compiled_vectors import VectorKernel, inputs_of

CHAIN = 128  # products and sums
OPERATION = re.compile(r"^\s+(?:@\S+ )?(add|sub|mul|fma|div|rcp|sqrt)\.(?:\w+\.)*f64", re.MULTILINE)


class Clock:
    """Seconds of the last kernel of a device."""

    def __init__(self, of: Device) -> None:
        self.seconds, launch = 0.0, of.launch

        def timed(*told: Any) -> None:
            start = time.perf_counter()
            launch(*told)
            self.seconds = time.perf_counter() - start

        of.launch = timed  # type: ignore[method-assign]


def limits(of: Device, clock: Clock, lanes: int, rounds: int) -> tuple[float, float]:
    """Operations and bytes a second, of numbers of 64 bits."""
    graph = Graph()
    x = y = graph.input("x", BOTH)
    for _ in range(CHAIN):
        y = graph.apply("add", graph.apply("mul", y, graph.constant(0.999)), graph.constant(1e-3))
    least = []
    for node in (y, graph.apply("mul", x, graph.constant(2.0))):
        code, seconds = DeviceCode(program(graph, [node], 1, threads=True), of), []
        for _ in range(rounds):
            with code.running({"x": np.ones(lanes)}, [np.dtype(float)], 1, lanes):
                seconds.append(clock.seconds)
        least.append(min(seconds))
    return 2 * CHAIN * lanes / least[0], 16 * lanes / least[1]


def operations(made: Program) -> int:
    """Of one lane; a product and a sum at once are two."""
    found = OPERATION.findall(ptx(made.text).decode())
    return len(found) + found.count("fma")


def row(one: Job, clock: Clock, rounds: int, speed: float, bandwidth: float) -> str:
    """What one job takes, and its share of the limits."""
    there, here = kernel_of(one, DeviceKernel, None), kernel_of(one, VectorKernel, None)
    assert isinstance(there, DeviceKernel)
    inputs = inputs_of(one.values, one.times)
    samples, positions = max(len(value) for value in one.values.values() if np.ndim(value)), len(one.times)
    seconds, count = [], samples * positions
    code: Any = there.program(inputs)
    for _ in range(rounds + 1):
        with code.running(inputs.numbers, [np.dtype(kind) for kind in (float, np.int8, bool)], samples, positions):
            seconds.append(clock.seconds)
    batch, processor = (best(partial(kernel.curves, one.values, one.times), rounds) for kernel in (there, here))
    rate = count / min(seconds)
    done = operations(program(*there._recorded(inputs), 1, threads=True))
    times = " | ".join(f"{1e6 * took / count:.4f}" for took in (processor, min(seconds), batch))
    return f"{times} | {rate / 1e6:.0f} | {done * rate / speed:.0%} | {10 * rate / bandwidth:.0%} |"


def main(told: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--configurations", type=int, default=4_000_000)
    options = parser.parse_args(told)
    try:
        of = device()
    except MechanismError as error:
        print(error.findings[0].what)
        return
    clock = Clock(of)
    speed, bandwidth = limits(of, clock, options.configurations, options.rounds)
    print(f"the device computes {speed / 1e9:.0f} GFLOP/s (float64) and copies {bandwidth / 1e9:.0f} GB/s\n")
    print("| job | compiled, µs | kernel, µs | batch, µs | million/s | of arithmetic | of bandwidth |")
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: |")
    for name, forces in JOBS:
        one = job(name, forces, options.configurations)
        told_of = row(one, clock, options.rounds, speed, bandwidth)
        print(f"| {name}, {'friction' if forces else 'motion'} | {told_of}", flush=True)


if __name__ == "__main__":
    main()
