"""Nodes and weights of means over panels between known edges.

Every panel goes by the rule of Gauss and Kronrod, 7 and 15 nodes: none lies on an edge, so what jumps there counts with
the value of its own side. R. Piessens, E. de Doncker-Kapenga, C. W. Überhuber, D. K. Kahaner, QUADPACK, Springer 1983.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["CANCELLED", "Nodes", "nodes"]

Array = NDArray[np.float64]

CANCELLED = 1e-12  # of a mean of magnitudes: less than this is what rounding leaves of one that is zero

# abscissae and weights of the half from the outermost node to the middle, as QK15 has them
_NODES = [
    *(0.991455371120812639206854697526329, 0.949107912342758524526189684047851, 0.864864423359769072789712788640926),
    *(0.741531185599394439863864773280788, 0.586087235467691130294144691693013, 0.405845151377397166906606412076961),
    *(0.207784955007898467600689403773245, 0.0),
]
_KRONROD = [
    *(0.022935322010529224963732008058970, 0.063092092629978553290700663189204, 0.104790010322250183839876322541518),
    *(0.140653259715525918745189590510238, 0.169004726639267902826583426598550, 0.190350578064785409913256402421014),
    *(0.204432940075298892414161999234649, 0.209482141084727828012999174891714),
]
_GAUSS = [0.129484966168869693270611432679082, 0.279705391489276667901467771423780,
          0.381830050505118944950369775488975, 0.417959183673469387755102040816327]  # fmt: skip
NODES = np.array([*(-x for x in _NODES), *_NODES[-2::-1]])
KRONROD = np.array([*_KRONROD, *_KRONROD[-2::-1]])
GAUSS = np.zeros(15)
GAUSS[1::2] = [*_GAUSS, *_GAUSS[-2::-1]]


class Nodes(NamedTuple):
    """Places of a mean over panels, rising, the weight of each, and weights of the rule inside, to tell the error."""

    at: Array
    weights: Array
    inside: Array


def nodes(edges: Array) -> Nodes:
    """The nodes of all panels between edges, (…, edge); (…, node)."""
    half, middle = 0.5 * np.diff(edges)[..., None], 0.5 * (edges[..., 1:] + edges[..., :-1])[..., None]
    share, shape = half / (edges[..., -1:] - edges[..., :1])[..., None], (*edges.shape[:-1], -1)
    return Nodes(*(part.reshape(shape) for part in (middle + half * NODES, share * KRONROD, share * GAUSS)))
