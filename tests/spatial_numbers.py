"""Random lines, poses and screws for the tests of spatial algebra, and their parts as arrays."""

from typing import Any

import numpy as np

from mechanisms import Array
from trunnion.algebra.dual import Dual, parts


def vector(a: Array) -> tuple[Any, Any, Any]:
    """Components (x, y, z) of an array (…, 3)."""
    return a[..., 0], a[..., 1], a[..., 2]


def stacked(entries: Any) -> Array:
    """An array (…, 3) of three components, one (…, 3, 3) of three rows."""
    if isinstance(entries[0], (tuple, list)):
        return np.stack(np.broadcast_arrays(*[stacked(row) for row in entries]), axis=-2)
    return np.stack(np.broadcast_arrays(*(np.asarray(entry, float) for entry in entries)), axis=-1)


def apart(entries: Any) -> tuple[Array, Array]:
    """Real and dual parts of a dual vector or matrix of depth 1, as arrays."""
    if isinstance(entries[0], (tuple, list)):
        both = [apart(row) for row in entries]
        return tuple(np.stack(np.broadcast_arrays(*half), axis=-2) for half in zip(*both, strict=True))  # type: ignore[return-value]
    both = [parts(entry) for entry in entries]
    return stacked([real for real, _ in both]), stacked([dual for _, dual in both])


def rows(a: Array) -> Any:
    """Rows of an array (…, 3, 3)."""
    return tuple(vector(a[..., i, :]) for i in range(3))


def matrix(real: Array, dual: Array) -> Any:
    """Rows of dual numbers of two arrays (…, 3, 3)."""
    return tuple(tuple(Dual(real[..., i, j], dual[..., i, j]) for j in range(3)) for i in range(3))


def random_directions(rng: np.random.Generator, count: int) -> Array:
    """Unit vectors (count, 3)."""
    a = rng.normal(size=(count, 3))
    return a / np.linalg.norm(a, axis=-1, keepdims=True)


def random_rotations(rng: np.random.Generator, count: int) -> Array:
    """Rotation matrices (count, 3, 3), of quaternions evenly on their sphere."""
    q = rng.normal(size=(count, 4))
    w, x, y, z = (q / np.linalg.norm(q, axis=-1, keepdims=True)).T
    entries = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(entries), (0, 1), (-2, -1))
