"""The locking margin of a position is its own: alone, in company and compiled; with that friction it locks."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from mechanisms import build, four_bar, slider_crank
from mechanisms_space import cardan, rssr
from trunnion import Mechanism
from trunnion.cycle.locking_course import locks
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.margin import locking_margin
from trunnion.solve.run import Run, prepare
from trunnion.solve.walk_kernel import WalkKernel

Array = Any
STEPS, MECHANISMS, ALONE = 24, 20, slice(None, None, 5)
SAME = 1e-9
NEARLY = 1e-3  # of the margin, below and above which it is looked whether a position locks


def pressed_slider(rng: np.random.Generator) -> Mechanism:
    """A light slider-crank with a load across its guide, whose contact changes ends as the friction grows."""
    r = 0.03 * rng.uniform(0.7, 1.3)
    data = slider_crank(r, r * rng.uniform(2.5, 5.0), r * rng.uniform(-0.3, 0.3))
    for link in ("crank", "rod", "piston"):
        data["links"][link] = {"points": data["links"][link]["points"]}
    aside = [rng.uniform(-0.02, 0.04), rng.uniform(-0.02, 0.02)]
    data["links"]["piston"]["points"] |= {"C": {"at": [0, 0], "axis": [1, 0]}, "H": aside}
    data["loads"] = {
        "work": {"joint": "C", "resisting_force": rng.uniform(40.0, 150.0)},
        "across": {"link": "piston", "at": "H", "force": [0.0, -60.0]},
    }
    return build(data, friction=0.25, radius=0.006 * rng.uniform(0.5, 1.5), guide=0.04)


def crank_and_rocker(rng: np.random.Generator) -> Mechanism:
    data = four_bar(*np.array([0.3, 0.9, 0.7, 1.0]) * rng.uniform(0.95, 1.05, 4))
    data["loads"]["work"] = {"joint": "D", "resisting_torque": rng.uniform(5.0, 60.0)}
    return build(data, friction=rng.uniform(0.4, 0.6), radius=rng.uniform(0.08, 0.15))


def ball_rods(rng: np.random.Generator) -> Mechanism:
    data = rssr(friction=rng.uniform(0.3, 0.6)).data
    for name, joint in data["joints"].items():
        joint["pin"] = {"radius": rng.uniform(0.01, 0.02), **({"bearing": 0.02} if name in "AD" else {})}
    data["loads"]["brake"]["resisting_torque"] = rng.uniform(0.5, 4.0)
    return Mechanism.model_validate(data)


def shafts(rng: np.random.Generator) -> Mechanism:
    """RCCC: a Cardan joint with errors."""
    data = cardan(rng.uniform(0.04, 0.08), rng.uniform(10.0, 40.0), rng.uniform(0.05, 0.5), rng.uniform(0.5, 5.0))
    data["joint_defaults"]["friction"] = rng.uniform(0.3, 0.5)
    return Mechanism.model_validate(data)


DRAWN: dict[str, Callable[[np.random.Generator], Mechanism]] = {
    "slider-crank": pressed_slider, "four-bar": crank_and_rocker, "RSSR": ball_rods, "RCCC": shafts,
}  # fmt: skip
CASES = [pytest.param(name, seed, id=f"{name}-{seed}") for name in DRAWN for seed in range(MECHANISMS)]


def prepared(name: str, seed: int) -> Run:
    return prepare(DRAWN[name](np.random.default_rng(seed)))


def margins(run: Run, time: Array) -> Array:
    with np.errstate(all="ignore"):
        back = run.solve(time, method=FrictionMethod(margin_up_to=10.0))
        return np.broadcast_to(locking_margin(back), time.shape).copy()


def locked(run: Run, time: Array, multiple: Array) -> Array:
    with np.errstate(all="ignore"):
        return locks(run.solve(time, method=FrictionMethod(multiple=multiple)))


@pytest.mark.sample(10)
@pytest.mark.spread(4, "slider-crank-3", "slider-crank-9")
@pytest.mark.parametrize(("name", "seed"), CASES)
def test_a_margin_is_where_it_locks_whatever_is_solved_with_it(name: str, seed: int) -> None:
    run = prepared(name, seed)
    time = run.cycle.times(STEPS)
    margin = margins(run, time)
    np.testing.assert_array_equal([margins(run, moment)[0] for moment in time[ALONE, None]], margin[ALONE])
    finite = np.isfinite(margin)
    assert finite.any()
    assert not locked(run, time[finite], (1 - NEARLY) * margin[finite]).any()
    assert locked(run, time[finite], (1 + NEARLY) * margin[finite]).all()


@pytest.mark.sample(6)
@pytest.mark.spread(2)
@pytest.mark.parametrize(("name", "seed"), CASES)
def test_the_compiled_margin_is_the_same(name: str, seed: int) -> None:
    pytest.importorskip("llvmlite")
    run = prepared(name, seed)
    time = run.cycle.times(STEPS)
    kernel = WalkKernel(run, {"margin": locking_margin}, method=FrictionMethod(margin_up_to=10.0))
    compiled = kernel.curves(run.values, time)[0]["margin"][0]
    np.testing.assert_allclose(compiled, margins(run, time), rtol=SAME)
