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

HALVINGS = 200
SMALL, TERMS = 0.05, 20  # χ of which the series is summed, and its terms


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

    @property
    def needs(self) -> tuple[str, ...]:
        """Keys that must be given; of a law that gives, the stiffness or the modulus too."""
        return () if self.elastic else ("restitution",)

    @property
    def takes(self) -> tuple[str, ...]:
        """Keys that may be given."""
        material = ("modulus", "poisson_ratio", "hole_modulus", "hole_poisson_ratio")
        return () if self.rigid else ("stiffness", "exponent", *material)


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


def _missing(factor: float, restitution: float) -> float:
    """What the equation of an impact lacks, χ (1 + e) − ln((1 + χ)/(1 − χ e)), over χ²; from above to below 0 as χ or e
    grows. Of a small χ by its series, whose first terms cancel in the logarithms."""
    if factor < SMALL:
        return float(sum(((-1) ** k - restitution**k) * factor ** (k - 2) / k for k in range(2, TERMS)))
    with np.errstate(divide="ignore"):  # at the end of the range
        logarithms = np.log1p(factor) - np.log1p(-factor * restitution)
    return float((factor * (1 + restitution) - logarithms) / factor**2)


def _halved(low: float, high: float, missing: Callable[[float], float]) -> float:
    """Where a function passes 0 from above."""
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if missing(middle) > 0 else (low, middle)
        if high - low <= 4e-16 * high:
            break
    return 0.5 * (low + high)


def restitution_of(factor: float) -> float:
    """The restitution e that a loss factor χ gives, from 1 (χ = 0) down."""
    if factor == 0.0 or np.isinf(factor):
        return 1.0 if factor == 0.0 else 0.0
    return _halved(0.0, min(1.0, (1.0 - 1e-16) / factor), lambda restitution: _missing(factor, restitution))


def loss_factor(restitution: float) -> float:
    """The loss factor χ from which the restitution e comes back: the equation above, solved for χ < 1/e."""
    if restitution >= 1.0 or restitution <= 0.0:
        return 0.0 if restitution > 0.0 else np.inf
    return _halved(0.0, 1.0 / restitution, lambda factor: _missing(factor, restitution))


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
