"""Every friction is what its law says for its load wherever the status says solved; following it from none to all."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mechanisms import eccentric_press
from trunnion import FrictionMethod
from trunnion.algebra.dual import derivative, primal, seed
from trunnion.joints.contact_loads import GuideLoad, PinLoad
from trunnion.joints.friction import FRICTION_LAWS
from trunnion.solve import continuation
from trunnion.solve.friction import Contact, settle
from trunnion.solve.run import prepare

NEWTON = FrictionMethod()
COULOMB = FRICTION_LAWS["coulomb"]


@dataclass(frozen=True)
class Linear:
    """A module of one joint for each contact: reactions (joint, 3, lane) linear in the loads (load, joint, 3, lane)."""

    columns: Any

    def reactions(self, loads):
        found = sum(load * column for load, column in zip(loads, self.columns, strict=True))
        return [tuple(joint) for joint in found]


def settled(start, influence, contacts, method):
    """Of contacts (load, coefficient), one a joint. start: (joint, 3, lane); influence: (contact, joint, 3, lane)."""
    count = len(contacts)
    made = [
        Contact(
            k,
            [float(i == k + 1) for i in range(count + 1)],
            load,
            COULOMB.function(1.0, -1.0, coefficient=f, pair_factor=1.0),
        )
        for k, (load, f) in enumerate(contacts)
    ]
    with np.errstate(all="ignore"):  # as in every walk: what diverges comes out as no number
        return settle(Linear([start, *influence]).reactions, [1.0] + [0.0] * count, made, method)


def missed(found, contacts):
    """Largest |friction − law| of each lane over its largest friction, from what was found alone."""
    with np.errstate(all="ignore"):
        law = [
            f * load.normal(load.felt(reaction)) for (load, f), reaction in zip(contacts, found.reactions, strict=True)
        ]
        gaps = np.max([np.abs(a - b) for a, b in zip(found.forces, law, strict=True)], axis=0)
        return np.asarray(gaps / np.max(np.abs(found.forces), axis=0))


def test_a_load_that_changes_ends_while_the_other_end_stays():
    """A guide pressed by F = 1 − φ/2 and by a couple of 0.97 that no friction changes: φ = f · 0.97, at once or not."""
    f = 0.49
    guide = GuideLoad((0.0, 1.0), 2.0)
    start = np.array([[[0.0], [1.0], [0.97]]])
    found = settled(start, np.array([[[[0.0], [-0.5], [0.0]]]]), [(guide, f)], NEWTON)
    assert found.forces[0] == pytest.approx(f * 0.97, rel=1e-14)
    assert np.all(found.converged)
    assert np.all(found.residual <= 1e-14)


@st.composite
def modules(draw):
    """Up to four pins and guides, 40 lanes, friction weak to strong: some lanes have a certificate, others lock."""
    count = draw(st.integers(1, 4))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    guides = [draw(st.booleans()) for _ in range(count)]
    strength = draw(st.floats(0.05, 2.0))
    start = rng.normal(size=(count, 3, 40)) * 10.0 ** rng.uniform(-3, 3)
    influence = rng.normal(size=(count, count, 3, 40)) / count
    contacts = [
        (
            GuideLoad((0.6, 0.8), rng.uniform(0.05, 3.0, 40)) if guide else PinLoad(),
            strength * rng.uniform(0.05, 1.0, 40),
        )
        for guide in guides
    ]
    return start, influence, contacts


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(modules())
def test_converged_lanes_obey_their_laws(case):
    """Of both methods; where successive approximation converges and the solution is unique, both are the same."""
    start, influence, contacts = case
    newton = settled(start, influence, contacts, NEWTON)
    named = settled(start, influence, contacts, FrictionMethod("successive-approximation", limit=2000))
    for found in (newton, named):
        good = np.broadcast_to(found.converged, (40,))
        assert np.all(missed(found, contacts)[good] <= 1.001e-10)
        largest = np.max(np.abs(found.forces), axis=0)
        assert np.all(np.broadcast_to(found.residual, (40,))[good] <= 1e-10 * largest[good])
    certain = np.broadcast_to(newton.certain, (40,))
    assert np.all(np.broadcast_to(newton.converged, (40,))[certain])
    both = certain & np.broadcast_to(named.converged, (40,))
    assert np.allclose(np.array(newton.forces)[:, both], np.array(named.forces)[:, both], rtol=1e-7, atol=0)


def test_derivatives_are_those_of_the_side_of_the_kink():
    """A guide beside its kink, friction from its couple alone: no derivative by the force that another end carries."""
    for force, expected in ((0.5, 0.0), (2.0, 0.49 / (1 + 0.5 * 0.49))):
        push = seed(np.array([force]))
        found = settled(
            np.array([[0.0, push, np.array([1.0])]], dtype=object),
            np.array([[[0.0, np.array([-0.5]), 0.0]]], dtype=object),
            [(GuideLoad((0.0, 1.0), 2.0), 0.49)],
            NEWTON,
        )
        assert derivative(found.forces[0]) == pytest.approx(expected, rel=1e-12)
        assert primal(found.forces[0]) == pytest.approx(0.49 * (1.0 if expected == 0 else 2.0 / (1 + 0.5 * 0.49)))


def test_single_positions_of_an_eccentric_press():
    """One at a time, as no other one then makes the iteration go on; the law by hand, on both sides of a kink."""
    run = prepare(eccentric_press())
    sides = set()
    for time in np.linspace(0.05, 6.2, 400):
        back = run.solve(np.array([time]))
        reaction, friction = back.reactions["S"], float(back.friction["S"][0])
        at = back.walk.element("slider", "S")
        force, couple = abs(float(reaction.y[0])), abs(float((reaction.m - at.x * reaction.y)[0])) * 2 / 0.1
        sides.add(force > couple)
        assert abs(friction) == pytest.approx(0.49 * max(force, couple), rel=1e-10)
    assert sides == {True, False}


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


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "lanes"), [(0, 400), (2, 2000)])
def test_lanes_lock_at_the_share_to_which_small_steps_lead(seed, lanes, monkeypatch):
    """Folds, solutions that run to infinity and kinks, at up to six times the friction."""
    rng, start = np.random.default_rng(seed), [np.zeros(lanes)] * 3
    # pins with strong friction: reactions without it, influences, senses, lane last
    drawn = rng.normal(size=(3, 2, lanes)), rng.normal(size=(3, 3, 2, lanes)) * 0.6, rng.choice([-1.0, 1.0], (3, lanes))
    shares = continuation.follow(lambda x, s: _pins(x, s, *drawn), start, 6.0)[1]
    for name, value in {"FIRST_STEP": 0.004, "LONGEST_STEP": 0.004, "STRAIGHT": 0.0, "MOST_TRIALS": 3000}.items():
        monkeypatch.setattr(continuation, name, value)
    finely = continuation.follow(lambda x, s: _pins(x, s, *drawn), start, 6.0)[1]
    assert np.count_nonzero(shares < 6.0) > 0.95 * lanes
    assert np.allclose(shares, finely, rtol=1e-8, atol=1e-8)
