"""The kernel of a tolerance run, compiled by JAX: the same walk forward and back, written down once and run often.

`solve.forward`, `solve.backward`, the groups and the laws run on `algebra.traced` numbers; what comes out
is one function of the numbers that vary and of the times. Lanes that cannot be decided without values - not plainly
solved, or without proof that the friction has one solution - are computed again by NumPy, so that the answer is
NumPy's everywhere.
"""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.namespace import Number
from trunnion.algebra.traced import Traced, UntraceableError, bare
from trunnion.cycle.positions import CHUNK
from trunnion.errors import Finding, MechanismError, Status
from trunnion.solve.backward import Backward
from trunnion.solve.forward import forward
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import Run
from trunnion.solve.status import (
    NEAR_SINGULAR,
    pose_status,
    pose_status_number,
    status_number,
    status_of,
    worst_condition,
)
from trunnion.solve.system import Values, law_of, rubbing

__all__ = ["CompiledKernel", "Figure"]

Array = NDArray[np.float64]
Figure = Callable[[Backward], Number]  # one number of every position, of the motion (`back.walk`) or of the forces
BATCH = {"cpu": 1 << 13, "gpu": 1 << 22}  # configurations at a time, by platform: on a CPU they stay in its cache
HOPELESS = 0.5  # share of doubtful lanes from which the rest is left to NumPy
BORDER = 0.99 * NEAR_SINGULAR  # condition from which NumPy decides what a position is


class _Compiled(NamedTuple):
    """What the compiled function returns."""

    curves: dict[str, Any]
    status: Any
    doubtful: Any


class CompiledKernel:
    """Curves of measures over samples and positions, compiled once for each set of numbers that vary.

    run: the prepared mechanism; figures: by name, what to read off each walk; forces: whether one of them needs more
    than the motion; threads: batches at a time, by default one for each core. Raises MechanismError if JAX is not
    installed, or the mechanism has what only NumPy does.
    """

    def __init__(
        self,
        run: Run,
        figures: Mapping[str, Figure],
        forces: bool = True,
        method: FrictionMethod | None = None,
        threads: int | None = None,
    ) -> None:
        self.run = run
        self.figures = dict(figures)
        self.forces = forces
        self.method = method or FrictionMethod()
        self._jax = _imported()
        _check(run)
        self.threads = threads or (os.cpu_count() or 1 if self.platform == "cpu" else 1)
        self.again = 0  # lanes that NumPy computed again, so far
        self._functions: dict[Any, Callable[..., _Compiled]] = {}

    @property
    def platform(self) -> str:
        """Where it runs: cpu, gpu or tpu."""
        return str(self._jax.default_backend())

    def curves(self, values: Values, time: Array) -> tuple[dict[str, Array], NDArray[np.int8]]:
        """Figures by name, and the status, both (sample, position).

        values: every number by path; floats are compiled in, arrays (sample, 1) may differ from call to call.
        time: (position,) s, or (sample, position).
        """
        arrays = {path: np.asarray(value, float) for path, value in values.items() if np.ndim(value)}
        samples = max((len(value) for value in (*arrays.values(), np.atleast_2d(time))), default=1)
        shape = (samples, time.shape[-1])
        curves = {name: np.empty(shape) for name in self.figures}
        status = np.empty(shape, np.int8)
        doubtful = np.empty(shape, bool)
        rows = max(1, min(samples, BATCH.get(self.platform, BATCH["gpu"]) // shape[1]))
        function = self.function(values)

        def fill(low: int) -> None:
            part = slice(low, low + rows)
            with self._wide():
                found = function(*_batch(arrays, time, samples, part, rows))
                for name, curve in found.curves.items():
                    curves[name][part] = curve[: samples - low]
                status[part] = found.status[: samples - low]
                doubtful[part] = found.doubtful[: samples - low]

        fill(0)  # alone: it may have to be compiled first
        if np.mean(doubtful[:rows]) > HOPELESS:
            doubtful[rows:] = True  # as the rest would be: NumPy is quicker at once
        else:
            with ThreadPoolExecutor(self.threads) as pool:
                list(pool.map(fill, range(rows, samples, rows)))
        self._again(values, time, curves, status, doubtful)
        return curves, status

    def function(self, values: Values) -> Callable[..., _Compiled]:
        """The compiled function of (arrays by path, time); the floats among the values are compiled in."""
        paths = tuple(path for path, value in values.items() if np.ndim(value))
        constants = {path: value for path, value in values.items() if not np.ndim(value)}
        key = (paths, tuple(constants.items()))
        if key not in self._functions:
            self._functions[key] = self._jax.jit(self.pure(constants))
        return self._functions[key]

    def pure(self, constants: Values) -> Callable[[Mapping[str, Any], Any], _Compiled]:
        """The same before it is compiled: a function of JAX arrays that JAX can differentiate and transform."""

        def compute(arrays: Mapping[str, Any], time: Any) -> _Compiled:
            values = {**constants, **{path: Traced(array) for path, array in arrays.items()}}
            shape = np.broadcast_shapes(np.shape(time), *(array.shape for array in arrays.values()))
            with np.errstate(all="ignore"):
                back = self._back(values, Traced(time), self.method)
                status = status_number(back) if self.forces else pose_status_number(back.walk)
                doubtful = (status > Status.ZERO_SLIP) | (worst_condition(back.walk) > BORDER)
                for settled in back.settled:
                    doubtful = doubtful | np.logical_not(settled.certain)
                curves = {name: _full(figure(back), shape) for name, figure in self.figures.items()}
            return _Compiled(curves, _full(status, shape), _full(doubtful, shape))

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

    def _back(self, values: Values, time: Number, method: FrictionMethod) -> Backward:
        """One walk, back again only where forces are asked for."""
        run = self.run
        try:
            if self.forces:
                return run.solve(time, values, method)
            return Backward(forward(run.system, values, run.chosen.assembly, time), {})
        except UntraceableError as error:
            what = f"this mechanism is not compiled: {error}"
            raise MechanismError(Finding(what, "engine", "use the engine numpy")) from error

    def by_numpy(self, values: Values, time: Number) -> Backward:
        """The same walk by NumPy."""
        with np.errstate(all="ignore"):
            return self._back(values, time, self.method)

    def _again(
        self,
        values: Values,
        time: Array,
        curves: dict[str, Array],
        status: NDArray[np.int8],
        doubtful: NDArray[np.bool_],
    ) -> None:
        """Compute the doubtful lanes with NumPy, a chunk at a time."""
        rows, columns = np.nonzero(doubtful)
        self.again += len(rows)
        for low in range(0, len(rows), CHUNK):
            row, column = rows[low : low + CHUNK], columns[low : low + CHUNK]
            part = {path: _lanes(value, row) for path, value in values.items()}
            times = time[column] if time.ndim == 1 else time[row, column]
            back = self.by_numpy(part, times)
            with np.errstate(all="ignore"):
                found = status_of(back, row.shape) if self.forces else pose_status(back.walk, row.shape)
                status[row, column] = found
                for name, figure in self.figures.items():
                    curves[name][row, column] = figure(back)

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


def _lanes(value: Number, rows: NDArray[np.intp]) -> Number:
    """The number in some samples, one after the other."""
    if not np.ndim(value):
        return value
    flat = np.ravel(value)
    return flat[rows] if len(flat) > 1 else float(flat[0])


def _full(number: Number, shape: tuple[int, ...]) -> Any:
    return import_module("jax.numpy").broadcast_to(bare(number), shape)


def _check(run: Run) -> None:
    """MechanismError for what only NumPy does."""
    remedy = "use the engine numpy"
    for module in run.system.plan.modules:
        if module.redundant:
            what = f"the links {', '.join(module.links)} are over-constrained, which is solved by least squares"
            raise MechanismError(Finding(f"{what}: that is not compiled", "engine", remedy))
    for joint in rubbing(run.system):
        if law_of(run.system, joint).relaxation is not None:
            what = f"the friction of {joint} has a memory along the cycle: that is not compiled"
            raise MechanismError(Finding(what, f"joints.{joint}.friction", remedy))


# ---- JAX ------------------------------------------------------------------------------------------------------


def _imported() -> Any:
    """JAX, with what it compiles kept between runs; MechanismError if it is not installed."""
    try:
        jax: Any = import_module("jax")
    except ImportError:
        what = "the engine jax needs the package jax, which is not installed"
        raise MechanismError(Finding(what, "engine", "pip install 'trunnion[jax]', or use the engine numpy")) from None
    if not jax.config.jax_compilation_cache_dir:
        jax.config.update("jax_compilation_cache_dir", str(cache_directory()))
    return jax


def cache_directory() -> Path:
    """Where compiled functions are kept between runs: the user's cache directory."""
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA", Path.home() / "AppData" / "Local"))
    elif sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return base / "trunnion" / "jax"


@contextlib.contextmanager
def _float64(jax: Any) -> Iterator[None]:
    holder = jax if hasattr(jax, "enable_x64") else import_module("jax.experimental")  # before JAX 0.8
    with holder.enable_x64(True):
        yield
