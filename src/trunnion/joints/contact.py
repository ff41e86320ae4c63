"""Contact laws: normal force between two bodies that touch, from penetration, its rate and the speed of the onset.

F = K dⁿ (1 + χ ḋ/v₀), not below 0: d penetration, v₀ speed of approach at the onset of the contact. A law is what it
makes of the stated coefficient of restitution c: the loss factor χ. The restitution e that comes back of it follows
from the equation of motion of an impact, whatever K, n and v₀ (K. H. Hunt, F. R. E. Crossley, J. Appl. Mech. 42 (1975)
440-445, doi:10.1115/1.3423596; Y. Gonthier et al., Multibody Syst. Dyn. 11 (2004) 209-233,
doi:10.1023/B:MUBO.0000029392.21648.bc):

    χ (1 + e) = ln((1 + χ)/(1 − χ e))

It is not c, except for the default law, which solves this equation for χ. A new law is one function and one entry of
`CONTACT_LAWS`; the model's schema, its checks, the documentation and the tests read the table.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from trunnion.algebra.namespace import Number, namespace

__all__ = [
    "CONTACT_LAWS", "ContactLaw", "elastic_force", "hertz_stiffness", "loss_factor", "normal_force", "restitution_of",
]  # fmt: skip

MOST = 1e9  # loss factor beyond which nothing comes back
HALVINGS = 200


@dataclass(frozen=True)
class ContactLaw:
    """A contact law.

    factor: `(restitution) -> χ`; elastic: it takes no restitution and loses nothing; source and validity: where it
    comes from and for what; rigid: the bodies do not give: impacts by Newton's law instead of a force.
    """

    factor: Callable[[float], float]
    source: str
    validity: str
    elastic: bool = False
    rigid: bool = False


def normal_force(
    depth: Number, rate: Number, onset: Number, stiffness: float, exponent: float, factor: float
) -> Number:
    """F = K dⁿ (1 + χ ḋ/v₀), N; 0 where d ≤ 0 or where the surfaces part faster than they spring back.

    depth: d, m; rate: ḋ, m/s; onset: v₀, m/s; stiffness: K, N/mⁿ.
    """
    return elastic_force(depth, stiffness, exponent) * namespace(rate).maximum(1.0 + factor * rate / onset, 0.0)


def elastic_force(depth: Number, stiffness: float, exponent: float) -> Number:
    """K dⁿ, N; 0 where d ≤ 0."""
    xp = namespace(depth)
    inside = xp.maximum(depth, 0.0)
    power = inside * xp.sqrt(inside) if exponent == 1.5 else inside if exponent == 1.0 else xp.power(inside, exponent)
    return stiffness * power


def hertz_stiffness(
    pin_radius: float, hole_radius: float, pin_modulus: float, hole_modulus: float, pin_poisson: float,
    hole_poisson: float,
) -> float:  # fmt: skip
    """K = 4/(3 (σ_p + σ_h)) √(R r/(R − r)), N/m^1.5, σ = (1 − ν²)/E: a sphere of the pin's radius in a hollow one.

    In use for pins in holes since H. M. Lankarani, P. E. Nikravesh, J. Mech. Des. 112 (1990) 369-376,
    doi:10.1115/1.2912617; it does not know the length of the pin. Radii, m; moduli, Pa.
    """
    compliance = (1 - pin_poisson**2) / pin_modulus + (1 - hole_poisson**2) / hole_modulus
    return float(4 / (3 * compliance) * np.sqrt(pin_radius * hole_radius / (hole_radius - pin_radius)))


def restitution_of(factor: float) -> float:
    """The restitution e that a loss factor χ gives, from 1 (χ = 0) down."""
    if factor == 0.0:
        return 1.0

    @np.errstate(divide="ignore")  # at the end of the range
    def missing(e: float) -> float:
        return float(np.log1p(factor) - np.log1p(-factor * e) - factor * (1 + e))

    low, high = 0.0, min(1.0, (1.0 - 1e-16) / factor)
    for _ in range(HALVINGS):  # it grows from below 0 without bound
        middle = 0.5 * (low + high)
        low, high = (middle, high) if missing(middle) < 0 else (low, middle)
    return 0.5 * (low + high)


def loss_factor(restitution: float) -> float:
    """The loss factor χ from which the restitution e comes back: the equation above, solved for χ."""
    if restitution >= 1.0:
        return 0.0
    low, high = 0.0, 1.0
    while restitution_of(high) > restitution and high < MOST:
        high *= 2.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if restitution_of(middle) > restitution else (low, middle)
        if high - low <= 4e-16 * high:
            break
    return 0.5 * (low + high)


CONTACT_LAWS: dict[str, ContactLaw] = {
    "restitution": ContactLaw(
        loss_factor,
        "K. H. Hunt, F. R. E. Crossley, J. Appl. Mech. 42 (1975) 440-445, with χ from their equation of motion",
        "any restitution above 0: what is stated comes back",
    ),
    "hertz": ContactLaw(
        lambda c: 0.0, "H. Hertz, J. reine angew. Math. 92 (1882) 156-171", "elastic: nothing is lost", elastic=True
    ),
    "hunt-crossley": ContactLaw(
        lambda c: 1.5 * (1 - c),
        "K. H. Hunt, F. R. E. Crossley, J. Appl. Mech. 42 (1975) 440-445, doi:10.1115/1.3423596",
        "restitution near 1",
    ),
    "lankarani-nikravesh": ContactLaw(
        lambda c: 0.75 * (1 - c * c),
        "H. M. Lankarani, P. E. Nikravesh, J. Mech. Des. 112 (1990) 369-376, doi:10.1115/1.2912617",
        "restitution near 1",
    ),
    "flores": ContactLaw(
        lambda c: 1.6 * (1 - c) / c,
        "P. Flores et al., Multibody Syst. Dyn. 25 (2011) 357-375, doi:10.1007/s11044-010-9237-4",
        "the whole range, less comes back than is stated at small restitution",
    ),
    "herbert-mcwhannell": ContactLaw(
        lambda c: 6 * (1 - c) / ((2 * c - 1) ** 2 + 3),
        "R. G. Herbert, D. C. McWhannell, J. Eng. Ind. 99 (1977) 513-520, doi:10.1115/1.3439270",
        "restitution near 1",
    ),
    "lee-wang": ContactLaw(
        lambda c: 0.75 * (1 - c),
        "T. W. Lee, A. C. Wang, J. Mech. Transm. Autom. Des. 105 (1983) 534-543, doi:10.1115/1.3258452",
        "small losses: it loses half of what Hunt and Crossley's does",
    ),
    "gonthier": ContactLaw(
        lambda c: (1 - c * c) / c,
        "Y. Gonthier et al., Multibody Syst. Dyn. 11 (2004) 209-233, doi:10.1023/B:MUBO.0000029392.21648.bc",
        "the whole range",
    ),
    "hu-guo": ContactLaw(
        lambda c: 1.5 * (1 - c) / c,
        "S. Hu, X. Guo, Multibody Syst. Dyn. 35 (2015) 131-151, doi:10.1007/s11044-015-9453-z",
        "the whole range",
    ),
    "rigid": ContactLaw(
        loss_factor,
        "I. Newton; Ch. Glocker, F. Pfeiffer, Multibody Dynamics with Unilateral Contacts, Wiley, 1996",
        "impacts much shorter than the motion between them: any restitution, 0 included",
        rigid=True,
    ),
}
