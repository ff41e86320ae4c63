"""The kernel of a tolerance run, compiled by JAX, which can also differentiate it."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.namespace import Number
from trunnion.algebra.traced import Traced, bare
from trunnion.errors import Finding, MechanismError
from trunnion.files import cache_directory
from trunnion.solve.compiled import Array, CompiledKernel, Lanes
from trunnion.solve.system import Values

__all__ = ["JaxKernel"]

BATCH = {"cpu": 1 << 13, "gpu": 1 << 22}  # configurations at a time, by platform: on a CPU they stay in its cache
HOPELESS = 0.5  # share of doubtful lanes from which the rest is left to NumPy


class JaxKernel(CompiledKernel):
    """Compiled by JAX, once for each set of numbers that vary, the others compiled in; threads: batches at a time."""

    def prepare(self) -> None:
        """Load JAX; MechanismError if it is not installed."""
        self._jax = _imported()
        self.threads = self.threads if self.platform == "cpu" else 1
        self._functions: dict[Any, Callable[..., Lanes]] = {}

    @property
    def platform(self) -> str:
        """Where it runs: cpu, gpu or tpu."""
        return str(self._jax.default_backend())

    def check(self, values: Values, time: Array | None = None) -> None:
        """See `CompiledKernel.check`."""
        with self._wide():
            self._jax.eval_shape(self.pure(dict(values)), {}, np.zeros(1))

    def fill(self, values: Values, time: Array, found: Lanes) -> None:
        """All lanes, a batch of samples at a time."""
        arrays = {path: np.asarray(value, float) for path, value in values.items() if np.ndim(value)}
        samples, positions = found.status.shape
        rows = max(1, min(samples, BATCH.get(self.platform, BATCH["gpu"]) // positions))
        function = self.function(values)

        def part(low: int) -> None:
            some = slice(low, low + rows)
            with self._wide():
                one = function(*_batch(arrays, time, samples, some, rows))
                for name, curve in one.curves.items():
                    found.curves[name][some] = curve[: samples - low]
                found.status[some] = one.status[: samples - low]
                found.doubtful[some] = one.doubtful[: samples - low]

        part(0)  # alone: it may have to be compiled first
        if np.mean(found.doubtful[:rows]) > HOPELESS:
            found.doubtful[rows:] = True  # as the rest would be: NumPy is quicker at once
            return
        with ThreadPoolExecutor(self.threads) as pool:
            list(pool.map(part, range(rows, samples, rows)))

    def function(self, values: Values) -> Callable[..., Lanes]:
        """The compiled function of (arrays by path, time); the floats among the values are compiled in."""
        paths = tuple(path for path, value in values.items() if np.ndim(value))
        constants = {path: value for path, value in values.items() if not np.ndim(value)}
        key = (paths, tuple(constants.items()))
        if key not in self._functions:
            self._functions[key] = self._jax.jit(self.pure(constants))
        return self._functions[key]

    def pure(self, constants: Values) -> Callable[[Mapping[str, Any], Any], Lanes]:
        """The same before it is compiled: a function of JAX arrays that JAX can differentiate and transform."""

        def compute(arrays: Mapping[str, Any], time: Any) -> Lanes:
            shape = np.broadcast_shapes(np.shape(time), *(array.shape for array in arrays.values()))
            numbers = {**constants, **{path: Traced(array) for path, array in arrays.items()}}
            found = self.walked(numbers, Traced(time))
            curves = {name: _full(curve, shape) for name, curve in found.curves.items()}
            return Lanes(curves, _full(found.status, shape), _full(found.doubtful, shape))

        return compute

    def gradient(
        self, values: Values, time: Array, figure: str, reduce: Callable[[Any], Any]
    ) -> dict[str, NDArray[np.float64]]:
        """Derivatives of one number by every array among the values, each in its shape, by reverse differentiation.

        reduce: makes that number of the figure's curve (sample, position), in JAX. Positions that are not plainly
        solved are not computed again here: leave them out in `reduce`, or take a figure without them.
        """
        constants = {path: value for path, value in values.items() if not np.ndim(value)}
        arrays = {path: np.asarray(value, float) for path, value in values.items() if np.ndim(value)}
        pure = self.pure(constants)
        with self._wide():
            slopes = self._jax.grad(lambda varied: reduce(pure(varied, time).curves[figure]))(arrays)
            return {path: np.asarray(slope) for path, slope in slopes.items()}

    def _wide(self) -> contextlib.AbstractContextManager[Any]:
        """Numbers of 64 bits, for JAX has 32 unless told."""
        return _float64(self._jax)


# ---- arrays ---------------------------------------------------------------------------------------------------


def _batch(
    arrays: Mapping[str, Array], time: Array, samples: int, part: slice, rows: int
) -> tuple[dict[str, Array], Array]:
    """The samples of a batch, always as many: a function is compiled for one shape."""

    def cut(value: Array) -> Array:
        return _filled(value[part], rows) if len(value) == samples and samples > 1 else value

    return {path: cut(value) for path, value in arrays.items()}, time if time.ndim == 1 else cut(time)


def _filled(value: Array, rows: int) -> Array:
    """Rows up to the size of a batch: the last one again."""
    short = rows - len(value)
    return np.concatenate([value, np.repeat(value[-1:], short, axis=0)]) if short else value


def _full(number: Number, shape: tuple[int, ...]) -> Any:
    return import_module("jax.numpy").broadcast_to(bare(number), shape)


# ---- JAX ------------------------------------------------------------------------------------------------------


def _imported() -> Any:
    """JAX, with what it compiles kept between runs; MechanismError if it is not installed."""
    try:
        jax: Any = import_module("jax")
    except ImportError:
        what = "the engine jax needs the package jax, which is not installed"
        raise MechanismError(Finding(what, "engine", "pip install 'trunnion[jax]', or use the engine numpy")) from None
    if not jax.config.jax_compilation_cache_dir:
        jax.config.update("jax_compilation_cache_dir", str(cache_directory("jax")))
    return jax


@contextlib.contextmanager
def _float64(jax: Any) -> Iterator[None]:
    holder = jax if hasattr(jax, "enable_x64") else import_module("jax.experimental")  # before JAX 0.8
    with holder.enable_x64(True):
        yield
