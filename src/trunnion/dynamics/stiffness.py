"""What makes a motion stiff: its shortest time constant, and the numbers of the model that it hangs on most.

The derivative of a state by time, ẋ = f(x), has the derivatives J = ∂f/∂x. 1/|λ| of its largest eigenvalue is the
shortest time constant, and the steps of an explicit integrator are about as long. The numbers p with the largest
|∂ ln|λ| / ∂ ln p| are its cause: ½ for a spring and the mass on it, 1 for a damper.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.dynamics.motor import drives
from trunnion.dynamics.rates import Walks
from trunnion.dynamics.state import FreeMotion, Moment

__all__ = ["shortest"]

Array = NDArray[np.float64]

CHANGE = 1e-2  # of a number of the model, by which the eigenvalue is told from that without it
FLOOR = 1e-9  # of what is typical of a number of the state: the least by which derivatives are taken
NAMED, LESS = 3, 0.45  # causes that are told, and the share of the largest sensitivity from which they are
CAUSES = (  # sections of the model, and parts of their names, whose numbers may make a motion stiff
    ("springs", ""), ("joints", "friction"), ("joints", "losses"), ("drivers", "motor"),
    ("links", "mass"), ("links", "inertia"),
)  # fmt: skip


def shortest(motion: FreeMotion, at: Moment, step: float) -> dict[str, Any]:
    """The shortest time constant in a state, s, and what it hangs on most; no causes where none is found.

    step: s, over which the state changed last: the scale on which its derivatives are taken.
    """
    with np.errstate(all="ignore"):
        fastest = _fastest(motion, at, step)
        sizes: dict[str, float] = {}
        if np.isfinite(fastest) and fastest > 0.0:
            for name, changed in _changed(motion):
                sizes[name] = abs(np.log(_fastest(changed, at, step) / fastest) / np.log1p(CHANGE))
    largest = np.nanmax([*sizes.values(), 0.0])
    causes = sorted((name for name, size in sizes.items() if size > LESS * largest), key=lambda name: -sizes[name])
    return {"constant": 1.0 / fastest if fastest > 0.0 else np.nan, "causes": causes[:NAMED]}


def _changed(motion: FreeMotion) -> Iterator[tuple[str, FreeMotion]]:
    """The motion with one number of the model a little larger, by what it is called."""
    entries = motion.system.mechanism.parameter_set.entries
    for path, value in motion.values.items():
        section, _, rest = path.partition(".")
        number = float(np.ravel(primal(value))[0])
        if number == 0.0 or not any(section == name and part in rest for name, part in CAUSES):
            continue
        values = {**motion.values, path: number * (1.0 + CHANGE)}
        changed = replace(motion, run=replace(motion.run, values=values), drives=drives(motion.system, values))
        unit = entries[path].kind.unit if path in entries else ""
        yield f"{path} = {number:.4g}{f' {unit}' if unit and ' or ' not in unit else ''}", changed
    for k, contact in enumerate(motion.contacts.each):
        stiffer = list(motion.contacts.each)
        stiffer[k] = replace(contact, stiffness=contact.stiffness * (1.0 + CHANGE))
        yield f"the contact {contact.label}", replace(motion, contacts=replace(motion.contacts, each=tuple(stiffer)))


def _fastest(motion: FreeMotion, at: Moment, step: float) -> float:
    """|λ| of the largest eigenvalue of J, 1/s, by central differences; NaN where the state has no derivative."""
    system, n = motion.system, len(motion.names)
    size = float(np.ravel(system.size(motion.values))[0])
    unit = np.array([1.0 if system.turns(name) else size for name in motion.names])
    pace = float(np.sqrt(np.max(motion.unit / unit)))
    rates = Walks(motion)

    def derivative(numbers: Array) -> Array:
        q, rate, integral, bristles = np.split(numbers[:, None], [n, 2 * n, 3 * n])
        rates_at = rates(at._replace(q=q, rate=rate, integral=integral, bristles=bristles))
        return np.concatenate([rate[:, 0], rates_at.second, rates_at.integral, rates_at.bristles])

    state = np.concatenate([at.q, at.rate, at.integral, at.bristles])[:, 0]
    typical = np.concatenate([unit, unit * pace, unit, np.full(len(at.bristles), FLOOR)])
    reach = np.maximum(np.abs(derivative(state)) * step, FLOOR * typical)
    columns = [
        (derivative(state + change) - derivative(state - change)) / (2.0 * change[k])
        for k, change in enumerate(np.diag(reach))
    ]
    matrix = np.array(columns).T
    return float(np.max(np.abs(np.linalg.eigvals(matrix)))) if np.all(np.isfinite(matrix)) else np.nan
