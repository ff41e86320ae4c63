"""What a spatial linkage costs: the RCCC of Pezzuti et al. with friction, closed form and general group, beside MuJoCo.

Ours: poses, velocities, accelerations, reactions, friction of every joint and the drive effort, 10^5 configurations.
MuJoCo: one step of its forward dynamics per configuration, in compiled code called from a loop: the chain of the same
links closed by a weld constraint, which it solves softly; no friction, positions and velocities given.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.table import Table

from benchmarks.side import Side, take_turns
from trunnion import Mechanism
from trunnion.solve.assembly import choose
from trunnion.solve.run import Run, prepare
from trunnion.solve.system import System

Array = NDArray[np.float64]
EXAMPLE = Path(__file__).parents[1] / "examples" / "pezzuti-cardan.yaml"
CHUNK = 4096
CONFIGURATIONS = 100_000
PEER_CONFIGURATIONS = 5_000
LIMITS = {"closed form": 5.0, "general group": 40.0}  # µs per configuration

__all__ = ["Found", "fill", "verdicts"]


@dataclass(frozen=True)
class Found:
    """µs per configuration by contender; deviation: general group from closed form, of the largest effort."""

    best: dict[str, float]
    deviation: float


def _general(run: Run) -> Run:
    """The same mechanism with its dyad solved by the general group."""
    modules = tuple(replace(module, kind="general") for module in run.system.plan.modules)
    plan = replace(run.system.plan, modules=modules)
    system = System(run.system.mechanism, plan)
    found = [choose(_hinted(run, system, way), run.values, run.cycle) for way in (1, 2)]
    efforts = run.solve(np.zeros(1)).efforts["input"]
    runs = [replace(run, system=system, chosen=chosen) for chosen in found]
    return min(runs, key=lambda one: float(abs(one.solve(np.zeros(1)).efforts["input"] - efforts)[0]))


def _hinted(run: Run, system: System, way: int) -> System:
    mechanism = Mechanism(**{**run.system.mechanism.data(), "assembly": {"cross": f"way-{way}"}})
    return System(mechanism, system.plan)


def _solve(run: Run) -> Callable[[int], Array]:
    def go(n: int) -> Array:
        time, efforts = run.cycle.times(n), np.empty(n)
        for low in range(0, n, CHUNK):
            part = slice(low, low + CHUNK)
            efforts[part] = run.solve(time[part]).efforts["input"]
        return efforts

    return go


def _mujoco(run: Run) -> Side | None:
    """The chain input shaft – cross – output shaft, the last welded to a body on the output bearing."""
    if not find_spec("mujoco"):
        return None
    import mujoco
    from mujoco import rollout

    model = mujoco.MjModel.from_xml_string(_chain(run))
    state = mujoco.MjData(model)
    time = run.cycle.times(PEER_CONFIGURATIONS)
    walk = run.solve(time).walk
    names = ("input", "pin-1", "pin-2", "output")
    turns = [np.broadcast_to(walk.coordinates(name)[0], time.shape) for name in names]  # type: ignore[attr-defined]
    slides = [np.broadcast_to(walk.coordinates(name)[1], time.shape) for name in names]  # type: ignore[attr-defined]
    rates = [np.broadcast_to(n, time.shape) for name in names for n in walk.rates(name)]  # type: ignore[attr-defined]
    q = np.array([turns[0], *(row for k in (1, 2, 3) for row in (slides[k], turns[k]))]).T.copy()
    v = np.array([rates[0], *(rates[i] for k in (1, 2, 3) for i in (2 * k + 1, 2 * k))]).T.copy()

    states = np.zeros((len(q), mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)))
    states[:, 1 : 1 + model.nq + model.nv] = np.hstack([q, v])  # behind the time

    def go(n: int) -> Any:  # its own loop over all positions: a step of each, of which mj_forward is nearly all
        return rollout.rollout(model, state, states[:n], nstep=1)[0]

    return Side("MuJoCo, closed by a weld", "frictionless", go, np.asarray, (), PEER_CONFIGURATIONS)


def _chain(run: Run) -> str:
    """The model as MuJoCo reads it, by Denavit and Hartenberg's parameters of the loop."""
    values, rows = run.values, run.system.mechanism.loop
    twists = [float(values[f"loop.{row.joint}.twist"]) for row in rows]
    ways = [float(values[f"loop.{row.joint}.distance"]) for row in rows]

    def body(k: int, inside: str) -> str:
        before = f'pos="{ways[k - 1]} 0 0" euler="{twists[k - 1]} 0 0"' if k else ""
        slide = '<joint type="slide" axis="0 0 1"/>' if k else ""
        joints = slide + '<joint type="hinge" axis="0 0 1"/>'
        inertia = '<inertial pos="0 0 0.01" mass="0.5" diaginertia="0.001 0.001 0.001"/>'
        return f'<body name="link{k}" {before}>{joints}{inertia}{inside}</body>'

    # the ground's element of the last joint is the inverse of its link's way to the first
    last = f'euler="{-twists[3]} 0 0" pos="{-ways[3]} 0 0"'
    end = (
        f'<body name="end" {last}><joint type="slide" axis="0 0 1"/><joint type="hinge" axis="0 0 1"/>'
        '<inertial pos="0 0 0" mass="0.001" diaginertia="1e-6 1e-6 1e-6"/></body>'
    )
    tree = body(0, body(1, body(2, ""))) + end
    return (
        '<mujoco><compiler angle="radian" eulerseq="xyz"/><option gravity="0 0 0"/>'
        f'<worldbody>{tree}</worldbody><equality><weld body1="link2" body2="end"/></equality></mujoco>'
    )


def fill(rounds: int) -> tuple[Table, Found]:
    """Measure all; the table and the figures."""
    run = prepare(Mechanism.read(EXAMPLE))
    general = _general(run)
    sides = [
        Side("closed form", "friction", _solve(run), np.asarray, (), CONFIGURATIONS),
        Side("general group", "friction", _solve(general), np.asarray, (), CONFIGURATIONS),
    ]
    peer = _mujoco(run)
    sides += [peer] if peer else []
    best = take_turns(sides, rounds)
    one, other = (_solve(each)(720) for each in (run, general))
    deviation = float(np.nanmax(np.abs(one - other)) / np.nanmax(np.abs(one)))
    table = Table(title="RCCC of Pezzuti et al. (2006) with friction, one thread", title_justify="left", pad_edge=False)
    table.add_column("contender")
    for title in ("µs per\nconfiguration", "against\nclosed form", "limit", "kept"):
        table.add_column(title, justify="right")
    for name, value in best.items():
        limit = LIMITS.get(name)
        kept = "" if limit is None else "yes" if value <= limit else "NO"
        table.add_row(name, f"{value:.2f}", f"{value / best['closed form']:.1f}", f"{limit:g}" if limit else "", kept)
    return table, Found(best, deviation)


def verdicts(found: Found) -> list[tuple[str, bool]]:
    """The limits, each with whether it is kept."""
    sentences = [
        (f"RCCC with friction, {name}: {found.best[name]:.2f} µs, at most {limit:g} µs", found.best[name] <= limit)
        for name, limit in LIMITS.items()
    ]
    same = f"RCCC: general group and closed form differ by {found.deviation:.0e} of the largest effort, at most 1e-10"
    return [*sentences, (same, found.deviation <= 1e-10)]
