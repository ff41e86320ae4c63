"""Impacts of rigid bodies at several places at once: Newton's restitution with Coulomb's friction.

Impulses Λ at the places change the rates of gaps and slips, γ⁺ = γ⁻ + G Λ with G = W M⁻¹ Wᵀ. At every place either
nothing is exchanged and γₙ⁺ ≥ −e γₙ⁻, or γₙ⁺ = −e γₙ⁻ with an impulse Λₙ ≥ 0 and one along the tangent, |Λₜ| ≤ f Λₙ,
that is −f Λₙ times the sign of the slip γₜ⁺: a linear complementarity problem (Ch. Glocker, F. Pfeiffer, Multibody
Dynamics with Unilateral Contacts, Wiley, 1996; without tangential restitution). Its cases change by the worst place
first, see `active.settled`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.dynamics.active import Mode, Modes, settled

__all__ = ["OPEN", "STICK", "Struck", "strike"]

Array = NDArray[np.float64]

OPEN, STICK = None, 0

CLOSE = 1e-12  # of the largest speed or impulse: differences that are rounding
HALVINGS = 60


class Struck(NamedTuple):
    """Impulses, N s, rates after the impact, m/s, (normals then tangents,), what every place did - None: nothing, else
    the sense of its slip, 0 where it sticks -, the loss, J, and the restitution that was kept of the one stated."""

    impulse: Array
    after: Array
    cases: Modes
    loss: float
    kept: float = 1.0


def strike(delassus: Array, before: Array, restitution: Array, friction: Array) -> Struck | None:
    """The impact at some places; None if no case fits.

    delassus: G, 1/kg, (2 places, 2 places); before: γ⁻, m/s, (2 places,), normals first; restitution, friction: of each
    place.
    Newton's law may gain energy where friction turns the slip round (T. R. Kane, D. A. Levinson, Dynamics: Theory and
    Applications, McGraw-Hill, 1985); the restitutions are then lowered together until nothing is gained, for without
    any the law always loses.
    """
    struck = _struck(delassus, before, restitution, friction)
    if struck is None:
        return None
    if struck.loss >= -CLOSE * float(np.abs(struck.impulse) @ (np.abs(before) + np.abs(struck.after))):
        return struck
    low, high, best = 0.0, 1.0, None
    for _ in range(HALVINGS):
        share = 0.5 * (low + high) if best is not None else 0.0
        tried = _struck(delassus, before, share * restitution, friction)
        if tried is not None and tried.loss >= 0.0:
            low, best = share, tried._replace(kept=share)
        elif best is None:
            return tried
        else:
            high = share
    return best


def _struck(delassus: Array, before: Array, restitution: Array, friction: Array) -> Struck | None:
    """The case to which no place objects; at first none exchanges anything."""
    places = len(restitution)
    back = -restitution * np.minimum(before[:places], 0.0)

    def objections(cases: Modes) -> Mapping[int, Mode] | None:
        impulse, after = _solved(delassus, before, back, friction, cases)
        return _objections(impulse, after, before, back, friction, cases)

    senses = _senses(before)
    choices = [(OPEN, s, STICK, -s) if f > 0.0 else (OPEN, s) for f, s in zip(friction, senses, strict=True)]
    cases = settled([OPEN] * places, objections, choices)
    if cases is None:
        return None
    impulse, after = _solved(delassus, before, back, friction, cases)
    return Struck(impulse, after, cases, -0.5 * float(impulse @ (before + after)))


def _solved(delassus: Array, before: Array, back: Array, friction: Array, cases: Modes) -> tuple[Array, Array]:
    """Impulses and rates after of one case: as many equations as places that exchange something."""
    places = len(cases)
    unknown, targets, spread = list[int](), list[float](), np.zeros((2 * places, 2 * places))
    for k, case in enumerate(cases):
        if case is not OPEN:
            spread[k, k], spread[places + k, k] = 1.0, -friction[k] * case
            unknown.append(k)
            targets.append(back[k] - before[k])
        if case == STICK:
            spread[places + k, places + k] = 1.0
            unknown.append(places + k)
            targets.append(-before[places + k])
    if not unknown:
        return np.zeros(2 * places), before
    rows, columns = np.array(unknown), spread[:, unknown]
    matrix = delassus[rows] @ columns
    numbers = np.linalg.lstsq(matrix, np.array(targets), rcond=1e-13)[0]  # two places may share one impulse
    impulse: Array = columns @ numbers
    return impulse, before + delassus @ impulse


def _senses(before: Array) -> list[int]:
    """Of the slips before."""
    return [-1 if slip < 0.0 else 1 for slip in before[len(before) // 2 :]]


def _objections(
    impulse: Array, after: Array, before: Array, back: Array, friction: Array, cases: Modes
) -> Mapping[int, Mode] | None:
    """The place that breaks its law most, and what it seems to do instead; None: the equations of a case, which were
    singular, are not kept."""
    places, senses = len(cases), _senses(before)
    normal, tangent, size = impulse[:places], impulse[places:], CLOSE * max(float(np.max(np.abs(impulse))), 1e-300)
    speed = CLOSE * max(float(np.max(np.abs(before))), 1e-300)
    worst: list[tuple[float, int, Mode]] = [(1.0, -1, OPEN)]
    for k, case in enumerate(cases):
        gap, slip = (after[k] - back[k]) / speed, after[places + k] / speed
        if case is OPEN:
            worst.append((-gap, k, senses[k]))
            continue
        if abs(gap) > 1.0 or (case == STICK and abs(slip) > 1.0):
            return None
        worst.append((-normal[k] / size, k, OPEN))
        if case == STICK:
            worst.append(((abs(tangent[k]) - friction[k] * normal[k]) / size, k, -int(np.sign(tangent[k]))))
        elif friction[k] > 0.0:
            worst.append((-case * slip, k, STICK))
    _, k, mode = max(worst, key=lambda miss: miss[0])
    return {} if k < 0 else {k: mode}
