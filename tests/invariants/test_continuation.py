"""Following friction from none to all of it, and many rounds of successive approximation."""

from __future__ import annotations

import numpy as np
import pytest

import trunnion
from mechanisms import build, four_bar
from trunnion.algebra import linalg
from trunnion.solve import continuation


def _pins(x, share, start, gain, signs):
    """Residual and Jacobian of pins in a loop of influence: φ_k = f_k |R_k0 + Σ G_kl φ_l|."""
    reactions = [[start[k][i] + sum(gain[k][j][i] * x[j] for j in range(3)) for i in range(2)] for k in range(3)]
    sizes = [np.hypot(*r) for r in reactions]
    residual = [x[k] - share * signs[k] * sizes[k] for k in range(3)]
    jacobian = [
        [
            (1.0 if k == j else 0.0)
            - share * signs[k] * sum(a * b for a, b in zip(reactions[k], gain[k][j], strict=True)) / sizes[k]
            for j in range(3)
        ]
        for k in range(3)
    ]
    return residual, jacobian


def _drawn(rng: np.random.Generator, lanes: int):
    """Random pins with strong friction: reactions without it, influences, senses, lane last."""
    start, gain = rng.normal(size=(3, 2, lanes)), rng.normal(size=(3, 3, 2, lanes)) * 0.6
    return start, gain, rng.choice([-1.0, 1.0], size=(3, lanes))


def _finely(drawn, lanes: int, steps: int) -> np.ndarray:
    """Share up to which a solution is followed in small fixed steps: an independent walk of the same path.

    A lane that was lost is lost; Newton's rounds end when nothing moves any more.
    """
    reached, alive = np.zeros(lanes), np.arange(lanes)
    x = [np.zeros(lanes) for _ in range(3)]
    with np.errstate(all="ignore"):
        for step in range(1, steps + 1):
            share = np.full(len(alive), step / steps)
            new = x
            for _ in range(8):
                residual, jacobian = _pins(new, share, *drawn)
                (move,) = linalg.solve(jacobian, residual)
                new = [value - delta for value, delta in zip(new, move, strict=True)]
                size = np.maximum.reduce([np.abs(value) for value in new])
                if np.all(np.maximum.reduce([np.abs(delta) for delta in move]) <= 1e-12 * (1 + size)):
                    break
            residual, jacobian = _pins(new, share, *drawn)
            jump = np.maximum.reduce([np.abs(a - b) for a, b in zip(new, x, strict=True)])
            good = np.maximum.reduce([np.abs(r) for r in residual]) < 1e-9 * (1 + size)
            good &= (linalg.determinant(jacobian) > 0) & (jump < 0.5 * (1 + size))
            x = [value[good] for value in new]
            if not np.all(good):
                alive, drawn = alive[good], [numbers[..., good] for numbers in drawn]
            reached[alive] = step / steps
    return reached


SLOWLY = [pytest.param(2, 2000, marks=pytest.mark.slow)]


@pytest.mark.parametrize(("seed", "lanes"), [(0, 400), *SLOWLY])
def test_lanes_lock_at_the_share_to_which_small_steps_lead(
    seed: int, lanes: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Folds, solutions that run to infinity and kinks, at up to six times the friction."""
    drawn, start = _drawn(np.random.default_rng(seed), lanes), [np.zeros(lanes)] * 3
    shares = continuation.follow(lambda x, s: _pins(x, s, *drawn), start, 6.0)[1]
    for name, value in {"FIRST_STEP": 0.004, "LONGEST_STEP": 0.004, "STRAIGHT": 0.0, "MOST_TRIALS": 3000}.items():
        monkeypatch.setattr(continuation, name, value)
    finely = continuation.follow(lambda x, s: _pins(x, s, *drawn), start, 6.0)[1]
    assert np.count_nonzero(shares < 6.0) > 0.95 * lanes
    assert np.allclose(shares, finely, rtol=1e-8, atol=1e-8)


@pytest.mark.slow
def test_continuation_never_claims_a_solution_beyond_the_fold() -> None:
    """Lanes that fine stepping loses on the way are not reported solved at full friction."""
    lanes, seeds = 800, 2
    each = zip(*(_drawn(np.random.default_rng(seed), lanes) for seed in range(seeds)), strict=True)
    drawn = [np.concatenate(numbers, axis=-1) for numbers in each]  # a call takes longer than its lanes
    shares = continuation.follow(lambda x, s: _pins(x, s, *drawn), [np.zeros(lanes * seeds)] * 3)[1]
    for share, fine in zip(
        shares.reshape(seeds, lanes), _finely(drawn, lanes * seeds, 1000).reshape(seeds, lanes), strict=True
    ):
        claimed, true = share >= 1.0, fine >= 1.0
        assert np.count_nonzero(true) > 50
        assert np.count_nonzero(~true) > 50
        assert np.count_nonzero(claimed & (fine < 0.99)) == 0
        assert np.count_nonzero(true & ~claimed) <= 2  # near a fold the finer walk may survive where the coarse doubts
        both = ~true & ~claimed
        assert np.median(np.abs(share[both] - fine[both])) < 2e-3


@pytest.mark.parametrize("seed", range(2))
def test_compiled_steps_lead_as_far(seed: int) -> None:
    """The same way, recorded and compiled: a lane stops at the same fold, or goes on where the other does."""
    from trunnion.engines.graph import POSITION, Graph
    from trunnion.engines.machine_code import MachineCode, vector_width
    from trunnion.engines.program import program
    from trunnion.engines.recorded import Recorded, number_of

    lanes, rng = 800, np.random.default_rng(seed)
    drawn = _drawn(rng, lanes)
    _, expected = continuation.follow(lambda x, s: _pins(x, s, *drawn), [np.zeros(lanes)] * 3)
    graph, inputs = Graph(), {}
    recorded = []
    for name, numbers in zip(("start", "gain", "signs"), drawn, strict=True):
        cells = np.empty(numbers.shape[:-1], object)
        for place in np.ndindex(cells.shape):
            inputs[f"{name}{place}"] = np.ascontiguousarray(numbers[place])
            cells[place] = Recorded(graph, graph.input(f"{name}{place}", POSITION))
        recorded.append(cells.tolist())
    _, share = continuation.follow(lambda x, s: _pins(x, s, *recorded), [0.0] * 3)
    found = np.empty((1, lanes))
    MachineCode(program(graph, [number_of(graph, share)], vector_width())).run(inputs, [found], (0, 1), (0, lanes))
    assert 100 < np.count_nonzero(expected < 1.0) < lanes - 100
    assert np.max(np.abs(found[0] - expected)) < 1e-9


@pytest.mark.slow
def test_many_rounds_are_counted_right() -> None:
    mechanism = build(four_bar(), friction=0.9, radius=0.25)
    method = trunnion.FrictionMethod("successive-approximation", 1e-14, 40_000)
    assert int(trunnion.analyse(mechanism, 12, method)["friction_iterations"].min()) >= 0
