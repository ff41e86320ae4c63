"""Dual arithmetic against exact identities and finite differences, alone, nested, mixed in depth, on arrays."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from trunnion.algebra.dual import Dual, derivative, functions, primal, seed
from trunnion.algebra.namespace import namespace

parts = st.floats(-50, 50).filter(lambda v: abs(v) > 1e-3)
duals = st.builds(Dual, parts, parts)
deep = st.builds(Dual, duals, duals)
anything = st.one_of(parts, duals, deep)


def flat(number):
    """All components of a number at depth 2."""
    number = number if isinstance(number, Dual) else Dual(number, 0.0)
    if number.depth == 1:
        number = Dual(Dual(number.real, 0.0), Dual(number.dual, 0.0))

    def pair(part):
        return [float(part.real), float(part.dual)] if isinstance(part, Dual) else [float(part), 0.0]

    return [*pair(number.real), *pair(number.dual)]


def close(a, b, tolerance=1e-9):
    """Equal to rounding; a division by 1e-3 thrice may amplify it a billionfold against the smallest part."""
    x, y = flat(a), flat(b)
    np.testing.assert_allclose(x, y, rtol=tolerance, atol=tolerance * max(1e-6, *map(abs, x), *map(abs, y)))


@given(anything, anything, anything)
def test_ring_identities(x, y, z):
    close((x + y) + z, x + (y + z))
    close(x * y, y * x)
    close(x * (y + z), x * y + x * z)
    close(x - y, -(y - x))
    close(+x, x)
    close(x - x, 0.0)


@given(deep, deep)
def test_division_undoes_multiplication(x, y):
    """Each ε part divides by y once more, so rounding grows with the cube of its ε parts over itself."""
    growth = max(map(abs, flat(y))) / abs(primal(y))
    tolerance = max(1e-9, 1e-15 * growth**3)
    close(x * y / y, x, tolerance)
    close(1 / (1 / y), y, tolerance)
    close(x / y, x * y**-1, tolerance)


def test_epsilon_squared_is_zero_at_each_depth():
    eps = Dual(0.0, 1.0)
    assert flat(eps * eps) == [0.0] * 4
    outer = Dual(Dual(0.0, 0.0), Dual(1.0, 0.0))
    assert flat(outer * outer) == [0.0] * 4
    assert flat(eps * outer) == [0.0, 0.0, 0.0, 1.0], "the two epsilons are different and their product is not 0"


RANGES = {
    "sin": (-5, 5), "cos": (-5, 5), "tan": (-1.3, 1.3), "arcsin": (-0.9, 0.9), "arccos": (-0.9, 0.9), "arctan": (-5, 5),
    "sinh": (-3, 3), "cosh": (-3, 3), "tanh": (-2, 2), "exp": (-3, 3), "log": (0.3, 9), "sqrt": (0.3, 9),
    "square": (-5, 5), "abs": (0.2, 5),
}  # fmt: skip
FUNCTIONS = {
    **{name: (lambda xp, x, name=name: getattr(xp, name)(x), *ends) for name, ends in RANGES.items()},
    "abs, negative": (lambda xp, x: xp.abs(x), -5, -0.2), "arctan2 by y": (lambda xp, x: xp.arctan2(x, -0.7), 0.2, 3),
    "arctan2 by x": (lambda xp, x: xp.arctan2(0.7, x), -3, 3),
    "arctan2 of both": (lambda xp, x: xp.arctan2(x * x + 1, x), -3, 3),
    "hypot": (lambda xp, x: xp.hypot(x, 1.3), -3, 3), "hypot, second": (lambda xp, x: xp.hypot(0.4, x), 0.2, 3),
    "where": (lambda xp, x: xp.where(x > 0, x * x, -x), 0.1, 3),
    "where, other": (lambda xp, x: xp.where(x > 0, x * x, -x), -3, -0.1),
    "minimum": (lambda xp, x: xp.minimum(x * x, 4.0), 0.1, 1.9),
    "maximum": (lambda xp, x: xp.maximum(4.0, x * x), 2.1, 3), "power 3": (lambda _, x: x**3, -3, 3),
    "power -2": (lambda _, x: x**-2, 0.4, 3), "power 2.5": (lambda _, x: x**2.5, 0.4, 3),
    "power of 2": (lambda _, x: 2.0**x, -3, 3), "power of itself": (lambda _, x: x**x, 0.4, 3),
    "power 0": (lambda _, x: x**0, 0.4, 3), "nested": (lambda xp, x: xp.exp(xp.sin(x) / (1 + x * x)), -3, 3),
}  # fmt: skip


@pytest.mark.parametrize("name", FUNCTIONS)
def test_first_derivative(name):
    """Against eighth-order differences, good to 1e-9 here, on an array in one go."""
    function, low, high = FUNCTIONS[name]
    x = np.linspace(low, high, 23) + 0.013 * (high - low) / 23
    x = x[(x > low) & (x < high)]
    h = 2e-3 * min(1.0, high - low)
    weights = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 0, 4 / 5, -1 / 5, 4 / 105, -1 / 280]) / h
    x = x[(x - 4 * h > low) & (x + 4 * h < high)]
    expected = sum(w * function(np, x + k * h) for k, w in zip(range(-4, 5), weights, strict=True))
    number = function(functions, seed(x))
    np.testing.assert_allclose(primal(number), function(np, x), rtol=1e-15)
    np.testing.assert_allclose(derivative(number), expected, rtol=0, atol=1e-9 * max(1, np.abs(expected).max()))


@pytest.mark.parametrize("name", FUNCTIONS)
def test_second_derivative_by_nesting(name):
    """The derivative of the derivative: dual numbers of dual numbers against differences of the first derivative."""
    function, low, high = FUNCTIONS[name]
    x = np.linspace(low, high, 12)[1:-1]
    h = 1e-3 * min(1.0, high - low)
    weights = np.array([-1 / 60, 3 / 20, -3 / 4, 0, 3 / 4, -3 / 20, 1 / 60]) / h

    def first(at):
        return derivative(function(functions, seed(at)))

    expected = sum(w * first(x + k * h) for k, w in zip(range(-3, 4), weights, strict=True))
    number = function(functions, Dual(seed(x), Dual(np.ones_like(x), np.zeros_like(x))))
    assert number.depth == 2
    np.testing.assert_allclose(
        derivative(derivative(number)), expected, rtol=0, atol=1e-8 * max(1, np.abs(expected).max())
    )
    np.testing.assert_allclose(derivative(number.real), derivative(number).real, rtol=1e-14, atol=1e-14)


def test_mixed_depths():
    """A shallower number is a constant for the outermost ε of a deeper one."""
    shallow, outer = Dual(3.0, 1.0), Dual(Dual(2.0, 0.0), Dual(1.0, 0.0))
    product = shallow * outer
    assert flat(product) == [6.0, 2.0, 3.0, 1.0]
    assert flat(outer * shallow) == [6.0, 2.0, 3.0, 1.0]
    assert flat(shallow / outer) == pytest.approx([1.5, 0.5, -0.75, -0.25])
    assert flat(functions.hypot(Dual(4.0, 1.0), Dual(Dual(3.0, 0.0), Dual(1.0, 0.0))))[:3] == pytest.approx(
        [5.0, 0.8, 0.6]
    )
    assert flat(functions.where(True, shallow, outer)) == [3.0, 1.0, 0.0, 0.0]
    third = Dual(Dual(Dual(1.0)), Dual(Dual(1.0)))
    assert (third + 1.0).depth == (1.0 + third).depth == (third * shallow).depth == 3


def test_a_quantity_of_two_levels_is_a_differentiable_screw():
    """Transference and differentiation at once: cos of a dual angle θ + ε s, derived by θ."""
    theta, s = 0.7, 0.3
    screw = functions.cos(Dual(Dual(theta, s), Dual(1.0, 0.0)))
    assert flat(screw) == pytest.approx([math.cos(theta), -s * math.sin(theta), -math.sin(theta), -s * math.cos(theta)])


NOT_THERE = {
    "division by zero": lambda zero: 1.0 / zero,
    "division by dual zero of a dual": lambda zero: Dual(1.0, 2.0) / zero,
    "sqrt of 0": lambda zero: functions.sqrt(zero), "sqrt below 0": lambda zero: functions.sqrt(zero - 1.0),
    "log of 0": lambda zero: functions.log(zero), "log below 0": lambda zero: functions.log(zero - 1.0),
    "hypot of 0, 0": lambda zero: functions.hypot(zero, zero), "power −1 of 0": lambda zero: zero**-1,
    "power 1/2 of 0": lambda zero: zero**0.5, "power 1/2 below 0": lambda zero: (zero - 1.0) ** 0.5,
    "arcsin at 1": lambda zero: functions.arcsin(zero + 1.0),
    "arccos beyond 1": lambda zero: functions.arccos(zero + 1.5),
}  # fmt: skip


@pytest.mark.parametrize("shape", ["float", "array", "nested"])
@pytest.mark.parametrize("name", NOT_THERE)
def test_no_silent_number_where_there_is_no_derivative(name, shape):
    """NaN in the dual part of every kind of number: neither an infinity nor an exception."""
    zero = {
        "float": Dual(0.0, 1.0),
        "array": Dual(np.array([0.0, 0.0]), np.array([1.0, 0.0])),
        "nested": Dual(Dual(0.0, 1.0), Dual(1.0, 0.0)),
    }[shape]
    with np.errstate(all="ignore"):
        number = NOT_THERE[name](zero)
    dual = primal(derivative(number))
    assert not np.iscomplexobj(dual)
    assert np.all(np.isnan(dual)), number


def test_nan_stays_in_its_lane():
    root = functions.sqrt(Dual(np.array([0.0, 4.0, -1.0, np.nan]), 1.0))
    np.testing.assert_array_equal(root.real, [np.nan, 2.0, np.nan, np.nan])
    np.testing.assert_array_equal(root.dual, [np.nan, 0.25, np.nan, np.nan])


@pytest.mark.parametrize("function", [functions.maximum, functions.minimum])
def test_nan_is_not_lost_in_a_comparison(function):
    """As with NumPy: the larger of a number and NaN is NaN, whichever comes first."""
    nan, one = Dual(np.nan, 1.0), Dual(1.0, 1.0)
    assert np.isnan(primal(function(nan, one)))
    assert np.isnan(primal(function(one, nan)))


def test_arrays_on_the_left():
    array, x = np.array([1.0, 2.0, 4.0]), Dual(2.0, 3.0)
    for found, real, dual in (
        (array + x, array + 2, 3.0),
        (array - x, array - 2, -3.0),
        (array * x, array * 2, array * 3),
        (array / x, array / 2, -array * 3 / 4),
        (np.float64(3.0) * x, 6.0, 9.0),
        (np.array([2.0, 3.0]) ** Dual(2.0, 1.0), [4.0, 9.0], [4 * math.log(2), 9 * math.log(3)]),
    ):
        np.testing.assert_allclose(found.real, real)
        np.testing.assert_allclose(
            np.broadcast_to(found.dual, np.shape(found.real)), np.broadcast_to(dual, np.shape(real))
        )


def test_tests_and_constants_are_plain():
    x = Dual(np.array([1.0, np.nan, np.inf]), 1.0)
    np.testing.assert_array_equal(functions.isnan(x), [False, True, False])
    np.testing.assert_array_equal(functions.isfinite(x), [True, False, False])
    np.testing.assert_array_equal(functions.sign(Dual(np.array([-2.0, 3.0]), 1.0)), [-1.0, 1.0])
    np.testing.assert_array_equal(functions.zeros_like(x), [0.0, 0.0, 0.0])
    np.testing.assert_array_equal(derivative(np.ones(3)), np.zeros(3))
    assert namespace(1.0, np.ones(2)) is np
    assert namespace(np.ones(2), Dual(1.0)) is functions
    broad = Dual(np.ones((3, 4)), np.arange(4.0))  # an index means a place in the common shape of both parts
    np.testing.assert_array_equal(np.broadcast_to(broad[0].dual, (4,)), np.arange(4.0))
