"""How friction and reactions are settled: the method, when it ends, and how far to look for locking."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from trunnion.algebra.namespace import Number
from trunnion.errors import Finding, MechanismError
from trunnion.model.arguments import strict_arguments
from trunnion.model.measure_table import MEASURES

Method = Literal["newton", "successive-approximation"]


@strict_arguments
@dataclass(frozen=True)
class FrictionMethod:
    """How friction and reactions are settled.

    name: "newton" or "successive-approximation" ([D] steps 1-5).
    criterion: largest change of a normal load between two rounds, N, at which the iteration ends ([D]: 1e-3 N). None:
    it ends when every friction is what its law says for the load found, to 1e-10 of the largest friction. With a
    criterion how far the laws are missed is told by `friction_residual` alone.
    limit: most rounds; a position that needs more is not converged.
    margin_up_to: how far, in multiples of the friction, to look for the point at which it locks; 0: not at all.
    multiple: of all friction that follows loads, instead of the friction as stated, by position.
    """

    name: Method = "newton"
    criterion: float | None = None
    limit: int = 200
    margin_up_to: float = 0.0
    multiple: Number | None = None

    def __post_init__(self) -> None:
        """MechanismError for figures that make no sense."""
        if self.criterion is not None and not self.criterion > 0:
            raise MechanismError(Finding(f"a criterion of {self.criterion:g} N is never met", "criterion", "above 0"))
        if self.limit < 1:
            raise MechanismError(Finding(f"{self.limit} iterations are too few", "iterations", "give 1 or more"))


MARGIN = MEASURES["locking_margin"].up_to  # multiple of the friction up to which the locking margin is looked for
