"""Curves that are the same are drawn once, with the names of all: "A = B"."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from trunnion.views.common.cycle import Array

__all__ = ["joined"]

SAME = 1e-6  # of the largest value of all curves: a difference that no figure shows


def joined(curves: Mapping[str, Array]) -> list[tuple[str, int, Array]]:
    """Label, number of the first name and values of each different curve, in order. Gaps are a part of a curve."""
    finite = [np.max(np.abs(values[np.isfinite(values)]), initial=0.0) for values in curves.values()]
    near = SAME * float(max(finite, default=0.0))
    groups: list[tuple[list[str], int, Array]] = []
    for number, (name, values) in enumerate(curves.items()):
        for members, _, other in groups:
            same = values.shape == other.shape
            if same and np.allclose(values, other, rtol=0.0, atol=near, equal_nan=True):
                members.append(name)
                break
        else:
            groups.append(([name], number, values))
    return [(" = ".join(members), first, values) for members, first, values in groups]
