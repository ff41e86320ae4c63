"""Dual numbers through a whole analysis equal central differences, for every output by every number of the model."""

import numpy as np
import pytest

from mechanisms import MODELS, build, four_bar, law_named
from mechanisms_parts import bare
from trunnion import FrictionMethod
from trunnion.algebra.dual import Dual, derivative, primal
from trunnion.joints.friction import FRICTION_LAWS
from trunnion.solve.run import prepare

POSITIONS = 7
# Settled far below what the differences can see: the differences divide noise by a step of 2e-4 of the value.
METHOD = FrictionMethod("newton", 1e-11)


def outputs(back):
    """Every number a walk there and back finds, by name."""
    for link, motion in back.walk.motions.items():
        for part, group in zip(("place", "speed", "acceleration"), motion, strict=True):
            for i, number in enumerate(group):
                yield f"{part} {i} of {link}", number
    for kind in ("reactions", "friction", "efforts", "load_powers"):
        for name, value in getattr(back, kind).items():
            for i, number in enumerate(value if isinstance(value, tuple) else (value,)):
                yield f"{kind} {name} {i}", number
    for name, gear in back.gears.items():
        for i, number in enumerate((gear.torque, *gear.force)):
            yield f"gear {name} {i}", number
    yield "power of weight and inertia", back.body_power


def varied(run, paths, part):
    """Values in which sample i has its path i replaced by part(nominal value, row of zeros and a one)."""
    mechanism = run.system.mechanism
    replaced = {path: part(run.values[path], np.eye(len(paths))[:, [i]]) for i, path in enumerate(paths)}
    return dict(mechanism.parameters(replaced))


CASES = [
    *((name, friction) for name in MODELS for friction in (None, 0.15)),
    *((name, law_named(law)) for name in ("four-bar", "slider-crank") for law in FRICTION_LAWS if law != "rolling"),
]


@pytest.mark.sample(10)
@pytest.mark.spread(1)
@pytest.mark.parametrize(("name", "friction"), CASES)
def test_duals_equal_central_differences(name, friction):
    """To 1e-7 of the largest derivative or value per step-scale: sixth-order differences, all numbers at once."""
    run = prepare(build(MODELS[name](), friction=friction, radius=0.03))
    paths = [path for path in run.values if not path.startswith(("assembly.", "joint_defaults."))]
    time = (np.arange(POSITIONS) + 0.43) / POSITIONS * run.cycle.duration  # no slip changes its sign nearby
    step = np.array([2e-4 * max(abs(run.values[path]), 0.1) for path in paths])
    shape = (len(paths), POSITIONS)

    dual = run.solve(time, varied(run, paths, Dual), METHOD)
    moved = {
        k: dict(outputs(run.solve(time, varied(run, paths, lambda v, one, k=k: v + k * step[:, None] * one), METHOD)))
        for k in (-3, -2, -1, 1, 2, 3)
    }
    nominal = dict(outputs(run.solve(time, method=METHOD)))
    # a history is found in steps, which differences see where a time passes from one interval to the next
    accuracy = 1e-5 if run._past else 1e-7
    checked = 0
    for output, number in outputs(dual):
        differences = [np.broadcast_to(moved[k][output] - moved[-k][output], shape) for k in (1, 2, 3)]
        expected = (45 * differences[0] - 9 * differences[1] + differences[2]) / (60 * step[:, None])
        found = np.broadcast_to(derivative(number), shape)
        value = np.broadcast_to(nominal[output], shape)
        np.testing.assert_allclose(
            np.broadcast_to(primal(number), shape), value, rtol=0, atol=1e-11 * (1 + np.abs(value).max())
        )
        # where nothing depends on the number, the differences show rounding, 1e-13 over 2e-5
        scale = np.maximum(np.abs(expected).max(axis=1), np.abs(value).max(axis=1) / (5000 * step))
        limit = accuracy * scale + 1e-8
        off = [path for path, row in zip(paths, np.abs(found - expected) > limit[:, None], strict=True) if row.any()]
        assert not off, f"∂({output})/∂({', '.join(off)})"
        np.testing.assert_array_equal(np.isnan(found), np.isnan(expected))
        checked += len(paths)
    assert checked > 100


@pytest.mark.parametrize("name", ["four-bar", "slider-crank", "class III"])
def test_nested_duals_give_second_derivatives(name):
    """∂²/∂p∂q by depth 2 equals the difference of first derivatives."""
    run = prepare(build(MODELS[name](), radius=0.03))
    time = np.array([0.21, 0.63]) * run.cycle.duration
    p, q = "links.crank.points.B.x", "joints.B.friction.coefficient"
    vp, vq = run.values[p], run.values[q]

    def first(shift):
        values = run.system.mechanism.parameters({p: Dual(vp + shift[0], 1.0), q: vq + shift[1]})
        return {key: derivative(number) for key, number in outputs(run.solve(time, values, METHOD))}

    for other, value, seed in ((p, vp, np.array([1.0, 0.0])), (q, vq, np.array([0.0, 1.0]))):
        inner = {p: Dual(Dual(vp, seed[0]), Dual(1.0, 0.0)), q: Dual(Dual(vq, seed[1]), Dual(0.0, 0.0))}
        nested = run.solve(time, run.system.mechanism.parameters(inner), METHOD)
        h = 1e-3 * value
        lows = [first(k * h * seed) for k in (-2, -1, 1, 2)]
        for output, number in outputs(nested):
            if not isinstance(number, Dual):
                continue
            a, b, c, d = (np.broadcast_to(low[output], time.shape) for low in lows)
            expected = (8 * (c - b) - (d - a)) / (12 * h)
            found = np.broadcast_to(derivative(derivative(number)), time.shape)
            scale = max(float(np.abs(expected).max()), float(np.abs(b).max()) / abs(value), 1e-3)
            np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6 * scale, err_msg=f"{output} by {other}")


def test_a_pin_without_load_has_a_derivative_of_zero():
    """An unloaded dyad does not spoil the derivatives of the rest."""
    data = bare(four_bar()) | {"gravity": [0, 0], "loads": {"m": {"link": "crank", "moment": -5.0}}}
    run = prepare(build(data, friction=0.1, radius=0.01))
    values = run.system.mechanism.parameters({"links.rocker.points.C.x": Dual(0.7, 1.0)})
    effort = run.solve(np.linspace(0.0, 0.1, 5), values).efforts["A"]
    np.testing.assert_allclose(primal(effort), 5.0, rtol=1e-12)
    np.testing.assert_allclose(derivative(effort), 0.0, atol=1e-12)
