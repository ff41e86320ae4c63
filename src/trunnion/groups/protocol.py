"""What every module of a mechanism offers: motion forward, reactions backward.

A module is a driver or an Assur group. Its joints have a fixed order and each joint a first and a second side.
The elements handed over are *local* to a link of the group and *global* (known) on a link outside it.
Modules see numbers only: no model, no friction, no clearance. Friction and inertia arrive as loads.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

from trunnion.algebra.namespace import Number
from trunnion.algebra.plane import Acceleration, Frame, Twist, Wrench

__all__ = ["Elements", "Group"]

Elements = Sequence[tuple[Frame, Frame]]  # per joint: its element on the first and on the second link


class Group(Protocol):
    """The four questions, answered in this order; `pose` is what `position` returned, opaque to the caller.

    Wherever there is no answer (circles that do not meet, Newton not converged) the numbers are NaN.
    BRANCHES: the assemblies that `position` takes, none for a group that is solved by Newton.
    """

    @property
    def BRANCHES(self) -> tuple[int, ...]: ...  # noqa: N802

    def position(self, elements: Elements, assembly: Any, drive: Sequence[Number] = ()) -> Any:
        """Pose of the group's links. assembly: the branch; drive: coordinates of driven joints, rad or m.

        The pose has `frames`, one for each link.
        """

    def velocity(self, pose: Any, outer: Sequence[Twist | None], drive: Sequence[Number] = ()) -> list[Twist]:
        """Velocities of the frame origins of the links. outer: of each joint's element on an outside link."""

    def acceleration(
        self,
        pose: Any,
        twists: Sequence[Twist],
        outer_twists: Sequence[Twist | None],
        outer: Sequence[Acceleration | None],
        drive: Sequence[Number] = (),
        rates: Sequence[Number] = (),
    ) -> list[Acceleration]:
        """Accelerations of the frame origins of the links; drive: second, rates: first derivatives."""

    def reactions(self, pose: Any, loads: Sequence[Wrench]) -> list[Wrench]:
        """Reactions on the second link of each joint by the first, about the joint's point on the second.

        loads: everything else that acts on each link, inertia included, about the origin of its frame.
        The component along a driven freedom is the drive effort with the friction of that joint.
        """

    def closure(self, pose: Any) -> Number:
        """Largest distance by which a joint is open, m."""

    def condition(self, pose: Any) -> Number:
        """Condition of the group's Jacobian (Frobenius, times 2/n: 2 at best); without bound at a dead centre."""
