"""Friction laws of a contact: tangential force from normal load and slip speed.

A law knows nothing of joints: `joints.pairs` turns a reaction into the normal load of the contact and the
friction force back into a moment about the pair. A new law is one function and one entry of `FRICTION_LAWS`;
the model's schema, its checks, the documentation and the contract tests read the table.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

from trunnion.algebra.namespace import Number, namespace

__all__ = ["FRICTION_LAWS", "FrictionLaw", "LawParameter", "coulomb"]


@dataclass(frozen=True)
class LawParameter:
    """One parameter of a law: its unit (pint notation, empty if none), default (None: must be given), range."""

    unit: str = ""
    default: float | None = None
    minimum: float = 0.0
    maximum: float = float("inf")
    meaning: str = ""


class LawFunction(Protocol):
    """Tangential force (N) on the second body of a contact, from normal load (N) and slip speed (m/s)."""

    def __call__(self, normal: Number, slip: Number, **parameters: Number) -> Number: ...


@dataclass(frozen=True)
class FrictionLaw:
    """A friction law with what it needs and where it comes from.

    function: `(normal, slip, **parameters) -> force`, odd in slip, dissipative, zero at zero load.
    """

    function: LawFunction
    parameters: Mapping[str, LawParameter] = field(default_factory=dict)
    source: str = ""
    validity: str = ""


def coulomb(normal: Number, slip: Number, **parameters: Number) -> Number:
    """Coulomb friction of a pair: force = −sgn(slip) · pair_factor · coefficient · normal.  [D 8]

    normal: load of the contact ≥ 0, N; slip: speed of the second body against the first, m/s.
    The product f′ = pair_factor · coefficient is the coefficient of the pair; 4/3 of the material's is usual for
    a worn-in bearing (Baranov 1979, cited by [D]). At slip = 0 the force is an interval, here its middle, 0.
    Source: Durango, Calle, Ruiz (2010), eq. 8.
    """
    xp = namespace(normal, slip)
    return -xp.sign(slip) * (parameters["pair_factor"] * parameters["coefficient"]) * normal


FRICTION_LAWS: dict[str, FrictionLaw] = {
    "coulomb": FrictionLaw(
        coulomb,
        {
            "coefficient": LawParameter(meaning="friction coefficient of the material pairing"),
            "pair_factor": LawParameter(
                default=1.0, meaning="factor from the material's coefficient to the pair's (4/3 when worn in)"
            ),
        },
        source="Durango, Calle, Ruiz (2010), eq. 8",
        validity="dry or boundary-lubricated sliding; speed-independent",
    ),
}
