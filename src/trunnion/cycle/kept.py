"""Which variables of a cycle are kept, and as what numbers: where memory or the size of a file counts."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Literal

from trunnion.cycle.deviations import COMPARED
from trunnion.errors import Finding, MechanismError
from trunnion.joints.pairs import PAIRS
from trunnion.model.arguments import strict_arguments
from trunnion.model.names import nearest
from trunnion.results import variables as results
from trunnion.solve.system import System

__all__ = ["ALL", "Dtype", "Kept", "needed"]

Dtype = Literal["float64", "float32"]
# what summary and findings are made of
BOOKS = {
    "condition", "drive_effort", "drive_power", "friction_iterations", "friction_power", "joint_slide",
    "locking_margin", "power_residual", "reaction_force", "reaction_moment", "spring_elongation", "spring_power",
    "status", "useful_power",
}  # fmt: skip
# what makes an angle run on over whole turns
TURNED = {
    "joint_rotation": ("joint_rotation_velocity", "link_angle", "link_angle_velocity"),
    "link_angle": ("link_angle_velocity",),
}


@strict_arguments
@dataclass(frozen=True)
class Kept:
    """variables: names of `results.VARIABLES`, all if not given; the status is always kept. dtype: of the floats."""

    variables: tuple[str, ...] | None = None
    dtype: Dtype = "float64"

    @classmethod
    def read(cls, variables: Sequence[str] | None, dtype: Dtype) -> Kept:
        """What somebody asks for; MechanismError for a name or a kind of number that there is not."""
        for name in variables or ():
            if name not in results.VARIABLES:
                remedy = nearest(name, list(results.VARIABLES))
                raise MechanismError(Finding(f"a result has no variable '{name}'", "variables", remedy))
        return cls(None if variables is None else (*dict.fromkeys([*variables, "status"]),), dtype)

    @property
    def margin(self) -> bool:
        """Whether the locking margin is to be found, which may take longer than all else."""
        return self.variables is None or "locking_margin" in self.variables


ALL = Kept()


def needed(wanted: Collection[str], system: System, erring: bool) -> set[str]:
    """The variables that have to be found for those that are wanted and for the books of the cycle."""
    found = {*wanted, *BOOKS}
    if erring:
        parts = {name for name, one in results.VARIABLES.items() if one.part}
        found |= {*parts, *COMPARED}
    found |= {results.SAME_AS[name] for name in found & results.SAME_AS.keys()}
    if any(PAIRS[kind].threaded for kind, _ in system.joints.values()):  # a screw's slide follows its rotation
        found.add("joint_rotation")
    return found | {other for name in found & TURNED.keys() for other in TURNED[name]}
