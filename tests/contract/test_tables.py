"""Every entry of every table keeps its table's promise; a new entry is tested by being there."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from trunnion.algebra.dual import Dual, derivative, primal
from trunnion.joints.clearance import CLEARANCE_MODELS, pressed, worst_case
from trunnion.joints.contact_loads import GuideLoad, PinLoad
from trunnion.joints.friction import FRICTION_LAWS
from trunnion.joints.pairs import PAIRS

loads = st.floats(0, 1e6)
slips = st.floats(-1e3, 1e3).filter(lambda v: abs(v) > 1e-9)
components = st.floats(-1e4, 1e4)


def parameters(name):
    """A value for every parameter of a law, inside its range."""
    found = {}
    for key, declared in FRICTION_LAWS[name].parameters.items():
        default = 0.3 if declared.default is None else declared.default
        found[key] = min(max(default, declared.minimum), declared.maximum)
    return found


@pytest.mark.spread(2)
@pytest.mark.parametrize("name", FRICTION_LAWS)
@given(loads, slips)
def test_law_is_odd_and_dissipative(name, normal, slip):
    function, given_ = FRICTION_LAWS[name].function, parameters(name)
    force = function(normal, slip, **given_)
    assert function(normal, -slip, **given_) == -force
    assert force * slip <= 0
    assert np.isfinite(force)


@pytest.mark.spread(3)
@pytest.mark.parametrize("name", FRICTION_LAWS)
@given(slips)
def test_law_is_zero_at_zero_load_and_grows_with_it(name, slip):
    function, given_ = FRICTION_LAWS[name].function, parameters(name)
    assert function(0.0, slip, **given_) == 0
    assert np.all(np.diff(np.abs([function(n, slip, **given_) for n in (1.0, 2.0, 50.0)])) >= 0)


@pytest.mark.parametrize("name", FRICTION_LAWS)
def test_law_takes_arrays_and_duals(name):
    """(sample, position) broadcasting, and the derivative by load and every parameter against differences."""
    function, given_ = FRICTION_LAWS[name].function, parameters(name)
    normal, slip = np.linspace(1, 9, 5), np.array([-2.0, -0.1, 0.1, 0.7, 3.0])
    force = function(normal[:, None], slip, **given_)
    assert np.shape(force) == (5, 5)
    for i in range(5):
        for k in range(5):
            assert force[i, k] == pytest.approx(function(float(normal[i]), float(slip[k]), **given_))
    h = 1e-5
    by_load = derivative(function(Dual(normal, 1.0), slip, **given_))
    expected = (function(normal + h, slip, **given_) - function(normal - h, slip, **given_)) / (2 * h)
    np.testing.assert_allclose(by_load, expected, rtol=1e-7, atol=1e-9)
    for key, value in given_.items():
        found = function(normal, slip, **{**given_, key: Dual(value, 1.0)})
        ends = [function(normal, slip, **{**given_, key: value + sign * h}) for sign in (1, -1)]
        np.testing.assert_allclose(primal(found), function(normal, slip, **given_))
        np.testing.assert_allclose(derivative(found), (ends[0] - ends[1]) / (2 * h), rtol=1e-7, atol=1e-9)


@pytest.mark.parametrize("name", PAIRS)
def test_a_pair_about_one_axis_can_be_driven(name):
    """What can be driven, resisted and sprung is what moves about or along one axis; its first motion is driven."""
    pair = PAIRS[name]
    assert pair.one_axis == bool(pair.motions)
    assert pair.motions[:1] == (pair.freedoms[:1] if pair.one_axis else ())
    assert not (pair.turns and pair.guided)


def load_of(turn):
    return PinLoad() if turn is None else GuideLoad((-np.sin(turn), np.cos(turn)), 0.37)


def normal_of(load, *reaction):
    return float(load.normal(load.felt(reaction)))


@given(st.one_of(st.none(), st.floats(-3, 3)), components, components, components, st.floats(0.01, 50))
def test_normal_load(turn, x, y, m, factor):
    """N ≥ 0, the same for the opposite reaction, and proportional to it."""
    load = load_of(turn)
    normal = normal_of(load, x, y, m)
    assert normal >= 0
    assert normal_of(load, -x, -y, -m) == pytest.approx(normal)
    scaled = normal_of(load, factor * x, factor * y, factor * m)
    assert scaled == pytest.approx(factor * normal, rel=1e-9, abs=1e-9)
    if turn is None:
        assert normal == pytest.approx(np.hypot(x, y))
    else:  # the same as |F| where the force lies between the ends, as the couple 2|M|/L where it does not
        across = -np.sin(turn) * x + np.cos(turn) * y
        assert normal == pytest.approx(max(abs(across), 2 * abs(m) / 0.37), rel=1e-9, abs=1e-9)


@given(st.one_of(st.none(), st.floats(-3, 3)), st.lists(components, min_size=6, max_size=6))
def test_bound_of_the_normal_load(turn, numbers):
    """|N(R + δ) − N(R)| ≤ bound(δ): the certificate for a unique solution rests on it."""
    load, one, change = load_of(turn), np.array(numbers[:3]), np.array(numbers[3:])
    difference = normal_of(load, *(one + change)) - normal_of(load, *one)
    assert abs(difference) <= float(load.bound(load.felt(tuple(change)))) * (1 + 1e-12) + 1e-9


@given(st.one_of(st.none(), st.floats(-3, 3)), components, components, components)
def test_gradient_of_the_normal_load(turn, x, y, m):
    """Against the dual part of N, wherever N has one."""
    load = load_of(turn)
    felt = load.felt((x, y, m))
    normal = load.normal(felt)
    if turn is None and normal < 1e-3:
        return
    if turn is not None:
        across, couple = abs(np.cos(turn) * y - np.sin(turn) * x), 2 * abs(m) / load.length
        if min(abs(across - couple), across + couple) < 1e-6:  # an end without load: N has a kink there
            return
    gradient = load.gradient(felt, normal)
    for k in range(len(felt)):
        parts = [Dual(value, 1.0 if i == k else 0.0) for i, value in enumerate(felt)]
        expected = derivative(load.normal(tuple(parts)))
        assert float(gradient[k]) == pytest.approx(float(expected), rel=1e-9, abs=1e-9)


PLAYS = [(space, kind) for space, models in CLEARANCE_MODELS.items() for kind in models]
felt = components.filter(lambda n: n == 0 or abs(n) > 1e-9)  # the square of less is 0
wrenches = st.tuples(st.tuples(*[felt] * 3), st.tuples(*[felt] * 3))


@pytest.mark.parametrize(("space", "kind"), PLAYS)
def test_play_of_a_pair(space, kind):
    """Of a kind of pair there is; ends with a number and axes of their own; a length wherever two ends lie apart."""
    play = CLEARANCE_MODELS[space][kind]
    assert PAIRS[kind].planar or space == "spatial"
    keys = [key for end in play.ends for key in end]
    assert len(set(keys)) == len(keys)
    assert [key.split(".")[1] in "xyz" for key in keys] == [True] * len(keys)
    assert set(play.axial) < set(range(len(play.ends)))
    assert (play.size is not None) == ({key.split(".")[0] for key in keys} >= {"1", "2"})
    assert PAIRS[kind].guided == (play.size is not None and play.size[0] == "guide")
    offsets = [tuple(0.1 * i + k for k in range(len(end))) for i, end in enumerate(play.ends)]
    paths = play.paths("seats.A", offsets)
    assert list(paths) == [f"seats.A.{key}" for key in keys]
    assert play.offsets(paths, "seats.A") == offsets
    assert play.offsets(paths, "seats.B") is None
    some = dict([next(iter(paths.items()))])  # what is not there is 0
    assert play.offsets(some, "seats.A") == [tuple(some.get(f"seats.A.{key}", 0.0) for key in end) for end in play.ends]


def shift_numbers(shift):
    """Rotation matrix and place of a shift, in the plane as in space."""
    if not isinstance(shift[0], tuple):
        x, y, c, s = (float(n) for n in shift)
        return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]), np.array([x, y, 0.0])
    return np.array([[float(n) for n in axis] for axis in shift[:3]]).T, np.array([float(n) for n in shift[3]])


@pytest.mark.spread(2)
@pytest.mark.parametrize(("space", "kind"), PLAYS)
@given(st.integers(0, 10**6), st.floats(1e-6, 1e-2), st.floats(0.02, 1.0))
def test_shift_stays_within_the_clearance(space, kind, seed, rho, length):
    """A rotation and a place: none without offsets, no farther than ρ, tilted no more than 2ρ/H along each axis."""
    play, rng = CLEARANCE_MODELS[space][kind], np.random.default_rng(seed)
    offsets = []
    for end in play.ends:
        vector = rng.normal(size=len(end))
        offsets.append(tuple(rho * rng.choice([0.0, rng.uniform(), 1.0]) * vector / np.linalg.norm(vector)))
    axes, place = shift_numbers(play.shift(offsets, length))
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), rtol=0, atol=1e-15)
    free = 1 if kind in ("revolute", "cylindrical", "spherical") else 2  # a guide: ρ along each of its axes
    assert np.linalg.norm(place) <= rho * np.sqrt(free + len(play.axial)) * (1 + 1e-12)
    assert np.arccos(min((np.trace(axes) - 1) / 2, 1.0)) <= np.arctan(2 * rho * np.sqrt(free) / length) + 3e-8
    none = shift_numbers(play.shift([(0.0,) * len(end) for end in play.ends], length))
    np.testing.assert_array_equal(none[0], np.eye(3))
    np.testing.assert_array_equal(none[1], np.zeros(3))


@pytest.mark.spread(1)
@pytest.mark.parametrize(("space", "kind"), PLAYS)
@given(wrenches, wrenches, st.floats(0.02, 1.0), st.floats(-50, 50), st.integers(0, 10**6))
def test_seat_and_worst_case(space, kind, one, other, length, factor, seed):
    """Loads at the ends are linear in force and moment; the worst case is the support function of the play: even,
    homogeneous, subadditive, attained by the seat and by no other place; the seat is odd.
    """
    play, rng = CLEARANCE_MODELS[space][kind], np.random.default_rng(seed)
    radii = rng.uniform(1e-6, 1e-3, len(play.ends))

    def loads(wrench):
        return [np.array(load, float) for load in play.loads(*(tuple(part) for part in wrench), length)]

    def most(wrench):
        return float(worst_case([tuple(load) for load in loads(wrench)], radii))

    size = 1e-12 * (np.abs(one).max() + np.abs(other).max()) / length * max(1.0, abs(factor))
    both = np.array(one) + factor * np.array(other)
    for a, b, whole in zip(loads(one), loads(other), loads(both), strict=True):
        np.testing.assert_allclose(whole, a + factor * b, rtol=0, atol=size)
    assert [len(load) for load in loads(one)] == [len(end) for end in play.ends]
    expected = sum(r * float(np.linalg.norm(load)) for r, load in zip(radii, loads(one), strict=True))
    assert most(one) == pytest.approx(expected, rel=1e-14)
    assert most(factor * np.array(one)) == pytest.approx(abs(factor) * most(one), rel=1e-12)
    assert most(np.array(one) + np.array(other)) <= most(one) + most(other) + size * 1e-3
    seat = [np.array(pressed(tuple(load), r)) for load, r in zip(loads(one), radii, strict=True)]
    opposite = [np.array(pressed(tuple(-load), r)) for load, r in zip(loads(one), radii, strict=True)]
    work = 0.0
    for load, vector, reverse, radius in zip(loads(one), seat, opposite, radii, strict=True):
        np.testing.assert_array_equal(reverse, -vector)
        assert np.linalg.norm(vector) <= radius * (1 + 1e-15)
        anywhere = rng.normal(size=len(load))
        anywhere = radius * rng.uniform() * anywhere / np.linalg.norm(anywhere)
        assert load @ anywhere <= load @ vector * (1 + 1e-12)
        work += float(load @ vector)
    assert work == pytest.approx(most(one), rel=1e-14)
