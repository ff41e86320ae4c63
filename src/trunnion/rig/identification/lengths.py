"""Lengths of the model that may be wrong where it does not fit: those whose derivatives resemble the residuals."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from trunnion.model.parameters import measured
from trunnion.model.units import KINDS
from trunnion.rig.identification.fit import FitProblem
from trunnion.rig.identification.unknowns import Unknown, unknowns

__all__ = ["likely_lengths"]

Array = NDArray[np.float64]
MOST = 3  # that are tried
NEAR = 0.8  # of what the best takes off the sum of squares
ACTS = 1e-6  # of its derivatives, that neither unknowns nor sensors have as well


def likely_lengths(problem: FitProblem, x: Array) -> list[Unknown]:
    """Lengths that, in first order beside all that is fitted, take most off the sum of squares.

    With Q the directions of the other columns of the Jacobian, r the residuals and e the column of a length, both
    without Q: (e·r)²/(e·e). Derivatives are exact, all lengths at once.
    """
    model = problem.model
    paths = {path.removeprefix("dimensions."): (path,) for path in _lengths(problem)}
    extra = unknowns(model.run.system.mechanism, paths, {})
    if not extra:
        return []
    n, more = problem.count, len(extra)
    wide = replace(problem, model=replace(model, unknowns=(*model.unknowns, *extra)), left_over=1.0)
    at = np.concatenate([x[:n], [one.start for one in extra], x[n:]])
    rows, own = wide.jacobian(at), np.r_[0:n, n + more : len(at)]
    others, _ = np.linalg.qr(rows[:, own])
    left, columns = (one - others @ (others.T @ one) for one in (wide.residuals(at), rows[:, n : n + more]))
    squares, whole = np.sum(columns**2, axis=0), np.sum(rows[:, n : n + more] ** 2, axis=0)
    acts = squares > ACTS**2 * whole
    taken = np.where(acts, (columns.T @ left) ** 2 / np.where(acts, squares, 1.0), 0.0)
    order = np.argsort(-taken, kind="stable")[:MOST]
    return [extra[k] for k in order if taken[k] > NEAR * np.max(taken)]


def _lengths(problem: FitProblem) -> Iterator[str]:
    """Paths of dimensions and places on links that are lengths, but for those that are sought or set."""
    model = problem.model
    mechanism = model.run.system.mechanism
    entries, values = mechanism.parameter_set.entries, mechanism.parameters()
    kinds = measured(mechanism, entries.values())
    known = {path for one in model.unknowns for path in one.paths} | {path for one in model.settings for path in one}
    for path, one in entries.items():
        sought = path in known or one.alias or one.depends or not path.startswith(("dimensions.", "links."))
        if not sought and kinds[path] is KINDS["length"] and np.ravel(values.get(path, 0.0))[0] != 0:
            yield path
