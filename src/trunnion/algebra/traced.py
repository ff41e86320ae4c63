"""Numbers of JAX in the place of NumPy arrays, so that the same kernels are compiled.

`Traced` holds a JAX array or tracer and answers to the operators, to NumPy's functions and to `namespace` with those of
JAX. A kernel that is run once on such numbers is written down by JAX as it goes: it has no values yet, so nothing can
be decided by them. Where a kernel looks at all lanes to save work, `np.any` is True and `np.all` is False: the answers
that no lane contradicts. Lanes that a kernel would treat apart (`namespace.apart`) are left as they are; who compiles
must find them and compute them again with NumPy.

Nothing here imports JAX before a number is made.
"""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable, Sequence
from importlib import import_module
from typing import Any

import numpy as np

__all__ = ["Traced", "UntraceableError", "bare", "kept", "looped"]


class UntraceableError(TypeError):
    """A kernel asks for what only numbers with values have: it cannot be compiled as it stands."""


def _jax() -> Any:
    return import_module("jax")


def _jnp() -> Any:
    return import_module("jax.numpy")


def bare(number: Any) -> Any:
    """The array of JAX inside; other numbers as they are, lists and tuples with what they hold."""
    if isinstance(number, Traced):
        return number.value
    if isinstance(number, (list, tuple)):
        return type(number)(bare(one) for one in number)
    return number


def _dressed(found: Any) -> Any:
    """Arrays of JAX as numbers again, also those in a list or tuple; shapes and the like as they are."""
    if isinstance(found, (list, tuple)):
        return type(found)(_dressed(one) for one in found)
    return Traced(found) if hasattr(found, "dtype") and hasattr(found, "aval") else found


def _operator(apply: Callable[[Any, Any], Any], turned: bool = False) -> Callable[[Traced, Any], Any]:
    def found(self: Traced, other: Any) -> Any:
        if hasattr(other, "dual"):  # a dual number knows how to take this one as a part
            return NotImplemented
        other = bare(other)
        return Traced(apply(other, self.value) if turned else apply(self.value, other))

    return found


class Traced:
    """A JAX array or tracer that behaves as a NumPy array does in a kernel."""

    __slots__ = ("value",)
    __hash__ = None  # type: ignore[assignment]

    def __init__(self, value: Any) -> None:
        self.value = value

    def __repr__(self) -> str:
        return f"Traced({self.value!r})"

    # ---- what an array says of itself ---------------------------------------------------------------------------

    @property
    def shape(self) -> tuple[int, ...]:
        return tuple(self.value.shape)

    @property
    def ndim(self) -> int:
        return int(self.value.ndim)

    @property
    def dtype(self) -> Any:
        return self.value.dtype

    def held(self) -> Traced:
        """The number as a constant for derivatives, as the real part of a dual number is."""
        return Traced(_jax().lax.stop_gradient(self.value))

    def kept(self) -> Traced:
        """The number, computed in one place only.

        XLA repeats cheap sums and products in every loop that uses them, and what these are made of again in those: a
        number that many others are made of is better kept. A quotient is, for XLA; this one's divisor is 1, which XLA
        cannot know, and NaN where the number is.
        """
        value, jnp = self.value, _jnp()
        return Traced(value / jnp.where(value == value, 1.0, jnp.nan))

    @classmethod
    def looped(cls, step: Callable[[list[Any]], list[Any]], start: Sequence[Any], rounds: int) -> list[Any]:
        """See `looped` below."""
        jax = _jax()

        def body(_: Any, numbers: list[Any]) -> list[Any]:
            return [_jnp().asarray(bare(one), float) for one in step([Traced(one) for one in numbers])]

        state = [_jnp().asarray(bare(one), float) for one in start]
        for _ in range(2):  # in the shape that it comes to: that of all lanes
            shapes = jax.eval_shape(body, 0, state)
            state = [_jnp().broadcast_to(one, shape.shape) for one, shape in zip(state, shapes, strict=True)]
        return [Traced(one) for one in jax.lax.fori_loop(0, rounds, body, state)]

    def astype(self, kind: Any) -> Traced:
        return Traced(self.value.astype(kind))

    def all(self, axis: Any = None) -> Any:
        return np.all(self, axis=axis)

    def __getitem__(self, index: Any) -> Traced:
        return Traced(self.value[bare(index)])

    # ---- what needs a value -------------------------------------------------------------------------------------

    def _refuse(self, *_: Any, **__: Any) -> Any:
        raise UntraceableError("a number that is being compiled has no value yet")

    __bool__ = __float__ = __int__ = __index__ = __len__ = __iter__ = __array__ = _refuse

    # ---- NumPy's functions --------------------------------------------------------------------------------------

    def __array_namespace__(self, api_version: str | None = None) -> Any:
        """The functions that go with this number, as the array standard names the hook."""
        return functions

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        if any(hasattr(one, "dual") for one in inputs):
            return NotImplemented
        if method != "__call__" or options:
            raise UntraceableError(f"np.{ufunc.__name__} with {method} {', '.join(options)} is not compiled")
        return getattr(self.__array_namespace__(), ufunc.__name__)(*inputs)

    def __array_function__(self, function: Any, types: Any, args: Sequence[Any], options: dict[str, Any]) -> Any:
        if function in _OF_ALL_LANES and not any(value is not None for value in (*args[1:], *options.values())):
            return _OF_ALL_LANES[function]
        return getattr(self.__array_namespace__(), function.__name__)(*args, **options)

    # ---- operators ----------------------------------------------------------------------------------------------

    __add__ = _operator(operator.add)
    __radd__ = _operator(operator.add, turned=True)
    __sub__ = _operator(operator.sub)
    __rsub__ = _operator(operator.sub, turned=True)
    __mul__ = _operator(operator.mul)
    __rmul__ = _operator(operator.mul, turned=True)
    __truediv__ = _operator(operator.truediv)
    __rtruediv__ = _operator(operator.truediv, turned=True)
    __mod__ = _operator(operator.mod)
    __pow__ = _operator(operator.pow)
    __rpow__ = _operator(operator.pow, turned=True)
    __and__ = __rand__ = _operator(operator.and_)
    __or__ = __ror__ = _operator(operator.or_)
    __xor__ = __rxor__ = _operator(operator.xor)
    __lt__ = _operator(operator.lt)
    __le__ = _operator(operator.le)
    __gt__ = _operator(operator.gt)
    __ge__ = _operator(operator.ge)
    __eq__ = _operator(operator.eq)
    __ne__ = _operator(operator.ne)

    def __neg__(self) -> Traced:
        return Traced(-self.value)

    def __pos__(self) -> Traced:
        return self

    def __abs__(self) -> Traced:
        return Traced(abs(self.value))

    def __invert__(self) -> Traced:
        return Traced(~self.value)


_OF_ALL_LANES: dict[Any, bool] = {np.any: True, np.all: False}


TAKEN_FOR_CHEAP = ("sin", "cos")  # by XLA, which would repeat them


class _Functions:
    """The functions of jax.numpy, by NumPy's names, on `Traced` numbers."""

    def __getattr__(self, name: str) -> Any:
        try:
            apply = getattr(_jnp(), name)
        except AttributeError:
            raise UntraceableError(f"JAX has no np.{name}") from None

        @functools.wraps(apply)
        def function(*args: Any, **options: Any) -> Any:
            found = apply(*bare(args), **{key: bare(value) for key, value in options.items()})
            return kept(_dressed(found)) if name in TAKEN_FOR_CHEAP else _dressed(found)

        setattr(self, name, function)
        return function


functions: Any = _Functions()


# ---- what is written down once instead of again and again -----------------------------------------------------------


def looped(step: Callable[[list[Any]], list[Any]], start: Sequence[Any], rounds: int) -> list[Any]:
    """step(… step(start)), with the step compiled once. start, and what a step makes of it: lists of numbers.

    It ends with the first step that changes nothing.
    """
    state = list(start)
    for done in range(rounds):
        kind = next((type(number) for number in state if isinstance(number, Traced)), None)
        if kind is not None:  # where plain numbers start, what a round makes of them tells the kind
            return kind.looped(step, state, rounds - done)
        before, state = state, step(state)
        if all(_same(a, b) for a, b in zip(before, state, strict=True)):
            break
    return state


def _same(one: Any, other: Any) -> bool:
    """Whether plain numbers are equal in value and shape; NaN is NaN. Numbers that are recorded never are."""
    if isinstance(one, Traced) or isinstance(other, Traced):
        return False
    return np.shape(one) == np.shape(other) and np.array_equal(one, other, equal_nan=True)


def kept(number: Any) -> Any:
    """The number, computed in one place only where it is compiled."""
    return number.kept() if isinstance(number, Traced) else number
