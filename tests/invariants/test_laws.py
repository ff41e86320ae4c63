"""Laws by themselves: friction, loads of bearings, impacts, the active set, shares of friction."""

import itertools
from math import exp, tanh

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.optimize import linprog

from trunnion.algebra.space import ORIGIN
from trunnion.dynamics.active_set import settled
from trunnion.dynamics.bordered import least_shares
from trunnion.dynamics.impact_motion import OPEN, STICK, strike
from trunnion.joints.contact_loads import BearingLoad, GuideLoad, PinLoad
from trunnion.joints.friction import FRICTION_LAWS

N, V = 50.0, 0.02  # N, m/s
NUMBERS = {
    "coefficient": 0.12, "static": 0.2, "stribeck_speed": 0.01, "transition_speed": 0.01, "viscous": 0.5,
    "stiffness": 2e4, "damping": 30.0, "pair_factor": 4 / 3, "arm": 5e-4,
}  # fmt: skip
CURVE = 0.12 + 0.08 * exp(-4.0)  # f + (f_s − f) exp(−(v/v_s)²), v = 2 v_s
FORCES = {
    "coulomb": -4 / 3 * 0.12 * N, "viscous": -(4 / 3 * 0.12 + 0.5 * V) * N, "stiction": -0.12 * N,
    "stribeck": -(CURVE + 0.5 * V) * N, "brown-mcphee": -(0.12 * tanh(8.0) + 0.08 * 2 / 1.75**2 + 0.5 * V) * N,
    "dahl": -0.12 * N, "lugre": -(CURVE + 0.5 * V) * N, "rolling-bearing": -0.12 * N, "rolling": -N,
}  # fmt: skip


def force(law, slip, **more):
    known = FRICTION_LAWS[law]
    numbers = {name: NUMBERS[name] for name, declared in known.parameters.items() if not declared.optional}
    return float(known.function(N, slip, **numbers, **more))


@pytest.mark.parametrize("law", FRICTION_LAWS)
def test_force_of_sliding(law):
    assert force(law, V) == pytest.approx(FORCES[law], rel=1e-12)
    assert force(law, -V) == pytest.approx(-FORCES[law], rel=1e-12)


@pytest.mark.parametrize("deflection", [0.0, 2e-6, -3e-6])
def test_bristles_pull_by_their_deflection_its_rate_and_the_speed(deflection):
    """LuGre: −(κ z + σ ż + c v) N with ż = v − κ |v| z/g(v); Dahl: −κ z N."""
    rate = V - 2e4 * V * deflection / CURVE
    assert force("lugre", V, deflection=deflection) == pytest.approx(
        -(2e4 * deflection + 30.0 * rate + 0.5 * V) * N, rel=1e-12
    )
    assert force("dahl", V, deflection=deflection) == pytest.approx(-2e4 * deflection * N, rel=1e-12)


def test_bristles_forget_over_the_way_that_bends_them():
    """ż = v − d z: steady sliding bends them by v/d = g(v)/κ, Dahl's by f/κ."""
    for law, bent in (("lugre", CURVE / 2e4), ("dahl", 0.12 / 2e4)):
        known = FRICTION_LAWS[law]
        decay = known.relaxation(V, **{name: NUMBERS[name] for name in known.parameters})
        assert V / decay == pytest.approx(bent, rel=1e-12)


def test_what_jumps_where_sliding_begins_is_larger_at_rest():
    """The value at rest has the sense of the slip about to begin, as that of sliding has."""
    for law in FRICTION_LAWS.values():
        if law.at_rest is not None:
            numbers = {name: NUMBERS[name] for name in law.parameters}
            assert law.at_rest(N, 1e-300, **numbers) == pytest.approx(-0.2 * N, rel=1e-12)
            assert law.at_rest(N, -1e-300, **numbers) == pytest.approx(0.2 * N, rel=1e-12)
            assert law.interval_at_rest


LENGTH, WIDTH = 0.3, 0.05


def of(load, *reaction):
    """Normal load under a reaction about the middle of the bearing."""
    return float(load.normal(load.felt(reaction)))


@pytest.mark.parametrize("summed", [False, True])
def test_torsion_of_a_guide_is_carried_by_two_forces_its_width_apart(summed):
    """M = F w with F on either side: 2 M/w, to which a force across adds itself; along it nothing presses."""
    guide = BearingLoad(ORIGIN, LENGTH, summed, width=WIDTH)
    assert of(guide, 0, 0, 0, 0, 0, 3.0) == pytest.approx(2 * 3.0 / WIDTH)
    assert of(guide, 0, 0, 0, 0, 0, -3.0) == pytest.approx(2 * 3.0 / WIDTH)
    assert of(guide, 30.0, 40.0, 500.0, 0, 0, 3.0) == pytest.approx(50.0 + 2 * 3.0 / WIDTH)


def test_a_moment_across_a_bearing_is_carried_by_its_ends():
    """M = F L with F on either end; a force off the middle by a loads the ends as a lever: F (1/2 ± a/L)."""
    bearing = BearingLoad(ORIGIN, LENGTH)
    assert of(bearing, 0, 0, 0, 3.0, 0, 0) == pytest.approx(2 * 3.0 / LENGTH)
    inside, outside = 0.1 * LENGTH, 0.8 * LENGTH
    assert of(bearing, 0, 60.0, 0, -60.0 * inside, 0, 0) == pytest.approx(60.0)
    assert of(bearing, 0, 60.0, 0, -60.0 * outside, 0, 0) == pytest.approx(60.0 * 2 * outside / LENGTH)
    assert of(BearingLoad(ORIGIN, LENGTH, flank=1.25), 0, 0, -80.0, 0, 0, 0) == pytest.approx(100.0)


@pytest.mark.parametrize("off", [0.0, 0.1, 0.4, 0.9])
def test_a_guide_in_the_plane_is_loaded_at_its_two_ends(off):
    """A force off the middle by `off` presses on the ends, L/2 to either side, as on a beam on two supports."""
    guide = GuideLoad(across=(0.0, 1.0), length=LENGTH)
    ends = [70.0 * (0.5 + sign * off) for sign in (1, -1)]
    assert of(guide, 11.0, 70.0, 70.0 * off * LENGTH) == pytest.approx(sum(abs(end) for end in ends))
    moved = GuideLoad(across=(0.0, 1.0), length=LENGTH, middle=(off * LENGTH, 0.02))
    assert of(moved, 11.0, 70.0, 70.0 * off * LENGTH - 11.0 * 0.02) == pytest.approx(70.0)


LOADS = {
    "pin": PinLoad(),
    "guide in the plane": GuideLoad(across=(0.6, 0.8), length=LENGTH, middle=(0.04, -0.03)),
    "bearing": BearingLoad(ORIGIN, LENGTH),
    "bearing, summed": BearingLoad(ORIGIN, LENGTH, True),
    "guide": BearingLoad(ORIGIN, LENGTH, width=WIDTH),
    "thread": BearingLoad(ORIGIN, LENGTH, flank=1.25),
}


@pytest.mark.parametrize("name", LOADS)
def test_the_gradient_of_a_normal_load_is_that_of_differences(name):
    load, random = LOADS[name], np.random.default_rng(3)
    size = 3 if isinstance(load, PinLoad | GuideLoad) else 6
    for _ in range(20):
        felt = np.array(load.felt(tuple(random.normal(size=size))), float)
        found = load.gradient(tuple(felt), load.normal(tuple(felt)))
        steps = 1e-6 * np.eye(len(felt))
        expected = [(load.normal(tuple(felt + h)) - load.normal(tuple(felt - h))) / 2e-6 for h in steps]
        np.testing.assert_allclose(np.array(found, float), expected, rtol=1e-6, atol=1e-6)


seeds = st.integers(0, 2**32 - 1)


@example(1, 2, 0, 1.0, 1.0)  # no case fits this restitution
@given(seeds, st.integers(1, 3), st.integers(0, 2), st.floats(0, 1), st.floats(0, 2))
def test_an_impact_keeps_its_law_and_gains_nothing(seed, places, more, restitution, friction):
    """Random masses, ways and rates, with as many coordinates as places or more."""
    random = np.random.default_rng(seed)
    count = places + 1 + more
    root = random.normal(size=(count, count))
    mass = root @ root.T + 0.05 * np.eye(count)
    ways = random.normal(size=(2 * places, count))
    rate = random.normal(size=count)
    before = ways @ rate
    spread = np.linalg.solve(mass, ways.T)
    own, rough = np.full(places, restitution), np.full(places, friction)
    found = strike(ways @ spread, before, own, rough)
    after = rate + spread @ found.impulse
    energy = 0.5 * rate @ mass @ rate
    assert 0.5 * after @ mass @ after <= energy * (1 + 1e-9)
    assert energy - 0.5 * after @ mass @ after - found.loss <= 1e-9 * (energy + abs(found.loss))
    assert 0.0 <= found.kept <= 1.0
    normal, tangent = found.impulse[:places], found.impulse[places:]
    small = 1e-8 * max(np.max(np.abs(found.impulse)), 1e-300)
    speed = 1e-8 * np.max(np.abs(before))
    back = -found.kept * own * np.minimum(before[:places], 0.0)
    for k, case in enumerate(found.cases):
        assert found.after[k] >= back[k] - speed
        assert normal[k] >= -small
        assert abs(tangent[k]) <= friction * normal[k] + small
        if case is OPEN:
            assert normal[k] == 0.0
            continue
        assert abs(found.after[k] - back[k]) <= speed
        slip = found.after[places + k]
        if case == STICK:
            assert abs(slip) <= speed
        elif friction > 0.0:
            assert slip * case >= -speed
            assert abs(tangent[k] + case * friction * normal[k]) <= small


def test_two_places_on_one_wall_share_an_impulse():
    """Their slips are one, so that the tangential equations are singular."""
    ways = np.array([[1.0, -0.5, 0.0], [1.0, 0.5, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 1.0]])
    spread = np.linalg.solve(np.diag([1.0, 0.1, 1.0]), ways.T)
    found = strike(ways @ spread, ways @ np.array([-1.0, 0.0, 0.3]), np.full(2, 0.5), np.full(2, 2.0))
    assert abs(found.after - [0.5, 0.5, 0.0, 0.0]).max() < 1e-14
    assert abs(found.impulse[2:].sum() + 0.3) < 1e-14


@given(st.integers(0, 2**32 - 1), st.integers(1, 6))
def test_the_worst_row_first_finds_what_all_cases_have(seed, count):
    """w = M z + q, z ≥ 0, w ≥ 0, z·w = 0; of a positive definite M exactly one case agrees."""
    random = np.random.default_rng(seed)
    root, begin = random.normal(size=(count, count)), random.normal(size=count)
    matrix = root @ root.T + 0.1 * np.eye(count) + 0.5 * (root - root.T)

    def missed(modes):
        held = [k for k, mode in enumerate(modes) if mode == 0]
        force = np.zeros(count)
        force[held] = np.linalg.solve(matrix[np.ix_(held, held)], -begin[held])
        gap = matrix @ force + begin
        return {k: min(0.0, force[k] if k in held else gap[k]) for k in range(count)}

    def objections(modes):
        rows = missed(modes)
        worst = min(rows, key=lambda k: rows[k])
        return {worst: None if modes[worst] == 0 else 0} if rows[worst] < -1e-12 else {}

    solutions = [case for case in itertools.product((None, 0), repeat=count) if not any(missed(case).values())]
    assert [settled([None] * count, objections, [(None, 0)] * count)] == solutions


def test_where_changes_come_round_all_cases_are_tried():
    def objections(modes):
        return {} if modes == (0, None) else {k: None if mode == 0 else 0 for k, mode in enumerate(modes)}

    assert settled([None, None], objections, [(None, 0)] * 2) == (0, None)
    assert settled([None], lambda modes: None, [(None, 0)]) is None


@pytest.mark.parametrize(("rank", "count"), [(1, 1), (1, 4), (2, 2), (2, 5), (3, 6)])
def test_the_largest_share_is_the_least(rank, count):
    random = np.random.default_rng(rank * 10 + count)
    for _ in range(10):
        ways, wanted = random.normal(size=(rank, count)), random.normal(size=rank)
        found = least_shares(ways, wanted)
        assert ways @ found == pytest.approx(wanted, abs=1e-12)
        both = np.vstack([np.hstack([np.eye(count), -np.ones((count, 1))]),
                          np.hstack([-np.eye(count), -np.ones((count, 1))])])  # fmt: skip
        told = linprog(
            np.append(np.zeros(count), 1.0), both, np.zeros(2 * count), np.hstack([ways, np.zeros((rank, 1))]), wanted,
            bounds=(None, None),
        )  # fmt: skip
        assert np.max(np.abs(found)) == pytest.approx(told.fun, rel=1e-9)
