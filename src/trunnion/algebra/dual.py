"""Dual numbers a + ε b, ε² = 0: f(a + ε b) = f(a) + ε b f′(a).  [P 2; THEORY of the docs, "Numbers"]

The parts may be floats, arrays, or dual numbers again. ε is told apart by depth: numbers of equal depth share
the ε of that depth, and a shallower number is a constant for the outermost ε of a deeper one. So a spatial
quantity (depth 1) becomes a differentiable spatial quantity at depth 2: the ε of space is the innermost one.
`spatial` and `parts` put it there and take it out, whatever derivatives the numbers carry.

Where a function has no derivative (division by a zero real part, sqrt at or below 0) both parts are NaN: never
a silent number.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from types import SimpleNamespace
from typing import Any

import numpy as np

__all__ = ["Dual", "depth", "derivative", "functions", "parts", "primal", "seed", "single", "spatial"]


class Dual:
    """a + ε b with elementwise arithmetic; comparisons look at the real part only.

    real, dual: floats, arrays that broadcast, or dual numbers of them.
    """

    __slots__ = ("depth", "dual", "real")
    __array_ufunc__ = None  # an array on the left hands the operation over instead of looping over elements
    __hash__ = None  # type: ignore[assignment]

    def __init__(self, real: Any, dual: Any = 0.0) -> None:
        self.real = real
        self.dual = dual
        self.depth: int = 1 + max(_depth(real), _depth(dual))

    def __repr__(self) -> str:
        return f"Dual({self.real!r}, {self.dual!r})"

    def __array_namespace__(self, api_version: str | None = None) -> Any:
        """The functions that go with this number, as the array standard names the hook."""
        return functions

    def __getitem__(self, index: Any) -> Dual:
        lanes: Dual = _item(self, index, self.shape)
        return lanes

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape to which both parts broadcast."""
        return np.broadcast_shapes(_shape(self.real), _shape(self.dual))

    def __neg__(self) -> Dual:
        return Dual(-self.real, -self.dual)

    def __pos__(self) -> Dual:
        return self

    def __abs__(self) -> Dual:
        magnitude: Dual = functions.abs(self)
        return magnitude

    def __add__(self, other: Any) -> Dual:
        if _depth(other) < self.depth:
            return Dual(self.real + other, self.dual)
        x, y = _pair(self, other)
        return Dual(x.real + y.real, x.dual + y.dual)

    __radd__ = __add__

    def __sub__(self, other: Any) -> Dual:
        x, y = _pair(self, other)
        return Dual(x.real - y.real, x.dual - y.dual)

    def __rsub__(self, other: Any) -> Dual:
        return Dual.__add__(-self, other)

    def __mul__(self, other: Any) -> Dual:
        if _depth(other) < self.depth:  # a constant for this ε: two products instead of three
            return Dual(self.real * other, self.dual * other)
        x, y = _pair(self, other)
        return Dual(x.real * y.real, x.real * y.dual + x.dual * y.real)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Dual:
        x, y = _pair(self, other)
        quotient = x.real / _nonzero(y.real)
        return Dual(quotient, (x.dual - quotient * y.dual) / _nonzero(y.real))

    def __rtruediv__(self, other: Any) -> Dual:
        return Dual(other) / self if _depth(other) < self.depth else NotImplemented

    def __pow__(self, exponent: Any) -> Dual:
        if isinstance(exponent, Dual):
            return Dual.__rpow__(exponent, self)
        if exponent == 0:
            return Dual(self.real**0, self.dual * 0.0)
        base = self.real
        if not float(exponent).is_integer():
            base = _positive(base)
        elif exponent < 0:
            base = _nonzero(base)
        return Dual(base**exponent, exponent * base ** (exponent - 1) * self.dual)

    def __rpow__(self, base: Any) -> Dual:
        power: Dual = _exp(self * _of(base).log(base))
        return power

    def __lt__(self, other: Any) -> Any:
        return primal(self) < primal(other)

    def __le__(self, other: Any) -> Any:
        return primal(self) <= primal(other)

    def __gt__(self, other: Any) -> Any:
        return primal(self) > primal(other)

    def __ge__(self, other: Any) -> Any:
        return primal(self) >= primal(other)

    def __eq__(self, other: object) -> Any:
        return primal(self) == primal(other)

    def __ne__(self, other: object) -> Any:
        return primal(self) != primal(other)


def primal(number: Any) -> Any:
    """The number without any ε: its innermost real part."""
    while isinstance(number, Dual):
        number = number.real
    return number


def single(number: Any) -> float:
    """The first lane of a number, without any ε."""
    return float(np.ravel(primal(number))[0])


def seed(number: Any) -> Dual:
    """number + ε·1: what to feed a kernel to get the derivative by `number` in the dual part of its results."""
    return Dual(number, _of(number).ones_like(number))


def derivative(number: Any) -> Any:
    """Dual part of the outermost ε; 0 for a number that does not depend on it."""
    return number.dual if isinstance(number, Dual) else np.zeros_like(number)


def spatial(real: Any, dual: Any) -> Dual:
    """real + ε dual with the ε of space, below every ε that the two carry for derivatives: θ + ε s.  [P 1, 2]"""
    if isinstance(real, Dual) or isinstance(dual, Dual):
        real, dual = _pair(real, dual)
        return Dual(spatial(real.real, dual.real), spatial(real.dual, dual.dual))
    return Dual(real, dual)


def parts(number: Any) -> tuple[Any, Any]:
    """Real and dual part by the ε of space, each with the derivatives that the number carries; undoes `spatial`."""
    if not isinstance(number, Dual):
        return number, np.zeros_like(number)
    if number.depth == 1:
        return number.real, number.dual
    (real, dual), (real_slope, dual_slope) = parts(number.real), parts(number.dual)
    return Dual(real, real_slope), Dual(dual, dual_slope)


def depth(numbers: Iterable[Any]) -> int:
    """Steps of Newton's method at a solution that carry all derivatives of numbers along: one for each level of ε."""
    return max(map(_depth, numbers), default=0)


def _shape(number: Any) -> tuple[int, ...]:
    return number.shape if isinstance(number, Dual) else np.shape(number)


def _depth(number: Any) -> int:
    return number.depth if isinstance(number, Dual) else 0


def _of(number: Any) -> Any:
    """Namespace of one number; `algebra.namespace` is the public way and imports this module."""
    if isinstance(number, Dual):
        return functions
    if isinstance(number, (float, int, np.ndarray)) or not hasattr(number, "__array_namespace__"):
        return np
    return number.__array_namespace__()


def _item(part: Any, index: Any, shape: tuple[int, ...]) -> Any:
    """The same lanes of every part, whatever shape each has before broadcasting."""
    if isinstance(part, Dual):
        return Dual(_item(part.real, index, shape), _item(part.dual, index, shape))
    return _of(part).broadcast_to(part, shape)[index]


def _pair(x: Any, y: Any) -> tuple[Dual, Dual]:
    """Both as dual numbers of the same depth: the shallower one is constant for the outer ε."""
    depth_x, depth_y = _depth(x), _depth(y)
    for _ in range(depth_x, depth_y):
        x = Dual(x)
    for _ in range(depth_y, depth_x):
        y = Dual(y)
    return x, y


def _nonzero(number: Any) -> Any:
    """The number with NaN in place of an exact zero: a dual quotient does not exist there."""
    xp = _of(number)
    return xp.where(primal(number) == 0, np.nan, number)


def _positive(number: Any) -> Any:
    """The number with NaN where it is not above zero: sqrt and log have no dual value there."""
    xp = _of(number)
    return xp.where(primal(number) > 0, number, np.nan)


def _chain(name: str, slope: Callable[[Any, Any], Any]) -> Callable[[Any], Any]:
    """Dual form of the function `name`; slope(xp, a) is its derivative at the real part."""

    def apply(x: Any) -> Any:
        if not isinstance(x, Dual):
            return getattr(_of(x), name)(x)
        xp = _of(x.real)
        return Dual(getattr(xp, name)(x.real), slope(xp, x.real) * x.dual)

    apply.__name__ = name
    return apply


_exp = _chain("exp", lambda xp, a: xp.exp(a))


def _sqrt(x: Any) -> Any:
    if not isinstance(x, Dual):
        return _of(x).sqrt(x)
    root = _of(x.real).sqrt(_positive(x.real))
    return Dual(root, x.dual / (2 * root))


def _log(x: Any) -> Any:
    if not isinstance(x, Dual):
        return _of(x).log(x)
    real = _positive(x.real)
    return Dual(_of(real).log(real), x.dual / real)


def _arctan2(y: Any, x: Any) -> Any:
    y, x = _pair(y, x) if isinstance(y, Dual) or isinstance(x, Dual) else (y, x)
    if not isinstance(y, Dual):
        return _of(y).arctan2(y, x)
    square = _nonzero(x.real * x.real + y.real * y.real)
    return Dual(_arctan2(y.real, x.real), (x.real * y.dual - y.real * x.dual) / square)


def _hypot(x: Any, y: Any) -> Any:
    x, y = _pair(x, y) if isinstance(x, Dual) or isinstance(y, Dual) else (x, y)
    if not isinstance(x, Dual):
        return _of(x).hypot(x, y)
    radius = _nonzero(_hypot(x.real, y.real))
    return Dual(radius, (x.real * x.dual + y.real * y.dual) / radius)


def _where(condition: Any, x: Any, y: Any) -> Any:
    condition = primal(condition)
    x, y = _pair(x, y) if isinstance(x, Dual) or isinstance(y, Dual) else (x, y)
    if not isinstance(x, Dual):
        xp = _of(x) if _of(x) is not np else _of(y)
        return xp.where(condition, x, y)
    return Dual(_where(condition, x.real, y.real), _where(condition, x.dual, y.dual))


def _on_real(name: str) -> Callable[..., Any]:
    """A test or a constant: looks at the real part and returns a plain array."""

    def apply(x: Any, *rest: Any) -> Any:
        return getattr(_of(primal(x)), name)(primal(x), *rest)

    apply.__name__ = name
    return apply


functions: SimpleNamespace = SimpleNamespace(
    sin=_chain("sin", lambda xp, a: xp.cos(a)),
    cos=_chain("cos", lambda xp, a: -xp.sin(a)),
    tan=_chain("tan", lambda xp, a: 1 + xp.tan(a) ** 2),
    arcsin=_chain("arcsin", lambda xp, a: 1 / functions.sqrt(_positive(1 - a * a))),
    arccos=_chain("arccos", lambda xp, a: -1 / functions.sqrt(_positive(1 - a * a))),
    arctan=_chain("arctan", lambda xp, a: 1 / (1 + a * a)),
    sinh=_chain("sinh", lambda xp, a: xp.cosh(a)),
    cosh=_chain("cosh", lambda xp, a: xp.sinh(a)),
    tanh=_chain("tanh", lambda xp, a: 1 - xp.tanh(a) ** 2),
    exp=_exp,
    log=_log,
    sqrt=_sqrt,
    square=lambda x: x * x,
    abs=lambda x: x * _of(primal(x)).sign(primal(x)) if isinstance(x, Dual) else _of(x).abs(x),
    sign=lambda x: _of(primal(x)).sign(primal(x)),  # piecewise constant: no dual part
    arctan2=_arctan2,
    hypot=_hypot,
    where=_where,
    minimum=lambda x, y: _where(~(primal(x) > primal(y)) & ~np.isnan(primal(y)), x, y),
    maximum=lambda x, y: _where(~(primal(x) < primal(y)) & ~np.isnan(primal(y)), x, y),
    isnan=_on_real("isnan"),
    isfinite=_on_real("isfinite"),
    zeros_like=_on_real("zeros_like"),
    ones_like=_on_real("ones_like"),
    full_like=_on_real("full_like"),
)
