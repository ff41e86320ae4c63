"""Motion in time: `python -m benchmarks.motions`.

One start-up of 1 s, and many toleranced ones, of the press of the examples: with the friction of all joints, a gear
with loss and an induction motor. Beside them a kernel written by hand for the frictionless press with the same
masses, motor and load: its one equation in closed form, integrated by DOP853 of SciPy to the same tolerance. CPU time,
the best of several rounds in turn, and the wall time of two processes. Read the ratios; nothing here is a test.

And one turn of a slider-crank whose gudgeon pin rattles in its hole, 28 contacts: by machine code, and the first of its
contacts by walks and by the equations of its two free coordinates, written by hand. Beside it Exudyn, if it is
installed, by steps of two sizes, with how far the figures of the first contact are off.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable
from unittest import mock

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.integrate import DOP853
from tests.playing import SPEED, own_equations, rattling

import trunnion
from benchmarks import exudyn_pin
from benchmarks.mutants import ROOT
from benchmarks.side import version
from trunnion.dynamics.measured import figures_in_time
from trunnion.model.mechanism import Mechanism
from trunnion.solve.run import prepare
from trunnion.studies.tolerance.linear import study

DURATION, TOLERANCE = 1.0, 1e-9
PENETRATION = 7.795222e-5  # m, of the first contact of the pin, by other integrators to all its digits
SHARE = 0.01  # of the crank's inertia and of its radius, by which they are toleranced


def press(friction: bool = True) -> Mechanism:
    """The press of the examples, some of whose numbers are toleranced."""
    found = trunnion.read(ROOT / "examples" / "flywheel-press.yaml")
    data = found.data()
    data["dimensions"]["r"] = "40 mm ± 0.05 mm"
    data["links"]["crank"]["inertia"] = "22 kg m^2 ± 0.5 kg m^2"
    data["measures"] = {"peak": {"peak_effort": "O", "duration": f"{DURATION} s"}}
    if not friction:
        data["joint_defaults"] = {}
        data["drivers"]["O"]["motor"]["efficiency"] = 1
    return Mechanism(**data)


def by_hand() -> float:
    """M(θ) θ̈ + ½ M′(θ) θ̇² = T − ∂V/∂θ − load of the frictionless press, scalar; the speed after DURATION."""
    r, rod_length, g = 0.04, 0.22, 9.81
    rod, ram, reach = 14.0, 60.0, 80.0 / 220.0
    ratio, rotor, load = 12.0, 0.02, 80e3
    begin, end = math.radians(235.0), math.radians(270.0)

    def mass(q: float) -> tuple[float, float, float]:
        """Reduced mass, its derivative by a difference, and torque of gravity and of unit force on the ram."""
        s, c = math.sin(q), math.cos(q)
        root = math.sqrt(rod_length * rod_length - r * r * c * c)
        turned = -r * s / root  # of the rod by the crank, its pin below: x = r cos q = −l sin φ
        down = r * c - r * r * c * s / root  # of the ram by the crank
        x, y = -r * s * (1 - reach), (1 - reach) * r * c + reach * down
        found = 22.0 + ratio * ratio * rotor + rod * (x * x + y * y) + 0.09 * turned * turned + ram * down * down
        return found, down, rod * y + ram * down

    def rate(_: float, state: np.ndarray) -> tuple[float, float]:
        q, w = float(state[0]), float(state[1])
        m, down, weight = mass(q)
        slope = (mass(q + 1e-6)[0] - mass(q - 1e-6)[0]) / 2e-6
        slip = 1.0 - ratio * w / (50 * math.pi)
        torque = ratio * 2 * 60.0 * slip * 0.2 / (slip * slip + 0.04)
        work = load * down if begin < q % (2 * math.pi) < end and down * w < 0 else 0.0
        return w, (torque + work - g * weight - 0.5 * slope * w * w) / m

    solver = DOP853(rate, 0.0, [math.pi / 2, 0.0], DURATION, rtol=TOLERANCE, atol=1e-11)
    while solver.status == "running":
        solver.step()
    return float(solver.y[1])


def best(rounds: int, *actions: Callable[[], object]) -> list[float]:
    """CPU time of each, s: the best of rounds in which they take turns."""
    found = [math.inf] * len(actions)
    for _ in range(rounds):
        for k, action in enumerate(actions):
            start = time.process_time()
            action()
            found[k] = min(found[k], time.process_time() - start)
    return found


def one(console: Console, rounds: int) -> float:
    """One start-up; CPU time of the plain kernel."""
    mechanism, ideal = press(), press(friction=False)
    speeds = [float(trunnion.simulate(one, DURATION, 100)["drive_rate"][0, -1]) for one in (mechanism, ideal)]
    times = best(
        rounds,
        lambda: trunnion.simulate(mechanism, DURATION, 100, TOLERANCE),
        lambda: trunnion.simulate(ideal, DURATION, 100, TOLERANCE),
        by_hand,
    )
    table = Table("one start-up of 1 s", "CPU, s", "ratio", "speed at the end, rad/s")
    names = ("simulate, with friction", "simulate, without", "by hand, without, speed alone")
    for name, seconds, speed in zip(names, times, (*speeds, by_hand()), strict=True):
        table.add_row(name, f"{seconds:.3f}", f"{seconds / times[-1]:.1f}", f"{speed:.8f}")
    console.print(table)
    return times[-1]


def many(console: Console, samples: int, plain: float) -> None:
    """Many toleranced start-ups: the figures themselves, and a whole study in one and in two processes."""
    mechanism = press()
    run, draw = prepare(mechanism), np.random.default_rng(1)
    few = min(samples, 100)
    moved = {
        "dimensions.r": 0.04 * (1 + SHARE * draw.uniform(-1, 1, (few, 1))),
        "links.crank.inertia": 22.0 * (1 + SHARE * draw.uniform(-1, 1, (few, 1))),
    }
    values = dict(mechanism.parameters(moved))
    (seconds,) = best(2, lambda: figures_in_time(run, "O", values, few, DURATION))
    table = Table("toleranced start-ups of 1 s", "ms CPU a start", "ratio to one by hand", "s wall")
    table.add_row(f"figures of {few}", f"{seconds / few * 1e3:.2f}", f"{seconds / few / plain:.2f}", "")
    job = study(mechanism).sampling("monte-carlo", samples, 1)
    for jobs in (1, 2):
        start = time.perf_counter()
        run(job, jobs=jobs)
        wall = time.perf_counter() - start
        table.add_row(f"{samples} samples, {jobs} process{'es' if jobs > 1 else ''}", "", "", f"{wall:.1f}")
    console.print(table)


def rattled(console: Console) -> None:
    """A pin in its hole: whole turn, and the first contact by machine code, by walks and by hand."""
    mechanism, turn, short = rattling(), 2 * math.pi / SPEED, 2.9e-4

    def walked() -> None:
        with mock.patch("trunnion.dynamics.compiled_rates.compilable", return_value=False):
            trunnion.simulate(mechanism, short, 10)

    trunnion.simulate(mechanism, short, 1)  # compiles
    whole, first, by_walks, plain = best(
        2,
        lambda: trunnion.simulate(mechanism, turn, 100),
        lambda: trunnion.simulate(mechanism, short, 10),
        walked,
        lambda: own_equations(short),
    )
    table = Table("a pin in its hole", "CPU, s", "ratio")
    for name, seconds in (("one turn, machine code", whole), ("first contact, machine code", first),
                          ("first contact, walks", by_walks), ("first contact, by hand", plain)):  # fmt: skip
        table.add_row(name, f"{seconds:.3f}", f"{seconds / plain:.2f}")
    console.print(table)


def beside_exudyn(console: Console, rounds: int) -> None:
    """The same turn here and in Exudyn: CPU time, and the first contact beside the one by hand."""
    if not version("exudyn"):
        console.print("exudyn is not installed: no peer for the pin in its hole")
        return
    (begin, lasts, _), _, _ = own_equations(2.9e-4)
    mechanism, turn = rattling(), 2 * math.pi / SPEED
    result = trunnion.simulate(mechanism, turn, 100)
    start, end, depth = (float(result[f"impact_{name}"][0]) for name in ("begin", "end", "depth"))
    own = exudyn_pin.Contacts(start, end - start, depth, result.sizes["impact"])
    peers = {step: exudyn_pin.contacts(step, turn) for step in (1e-7, 5e-8)}
    times = best(
        rounds,
        lambda: trunnion.simulate(mechanism, turn, 100),
        *(lambda step=step: exudyn_pin.moved(step, turn) for step in peers),
    )
    table = Table("one turn of a pin in its hole", "CPU, s", "contacts", "first: begin", "duration", "penetration")
    names = ("simulate, machine code", *(f"exudyn {version('exudyn')}, steps of {step:g} s" for step in peers))
    for name, seconds, one in zip(names, times, (own, *peers.values()), strict=True):
        off = (one.begin / begin - 1, one.duration / lasts - 1, one.penetration / PENETRATION - 1)
        table.add_row(name, f"{seconds:.2f}", str(one.number), *(f"{share:.1e}" for share in off))
    console.print(table)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, default=400)
    parser.add_argument("--rounds", type=int, default=5)
    arguments = parser.parse_args()
    console = Console()
    rattled(console)
    beside_exudyn(console, arguments.rounds)
    many(console, arguments.samples, one(console, arguments.rounds))


if __name__ == "__main__":
    main()
