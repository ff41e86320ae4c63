"""The structure of a mechanism on the terminal."""

from __future__ import annotations

from trunnion.cli.terminal import console
from trunnion.cycle.inspect import Check
from trunnion.views.assembly.modes import gear_line, lines

__all__ = ["show_structure"]


def show_structure(found: Check, name: str, drivers: int) -> None:
    """Mobility, structural formula, modules with the ways to assemble them, and pairs of gears, a line each."""
    rank = found.rank_mobility
    by_rank = "by rank unknown: no position can be assembled" if rank is None else f"{rank} by rank"
    screen = console()
    screen.print(name, style="bold", markup=False)
    screen.print(f"mobility {found.mobility} by formula, {by_rank}; drivers: {drivers}", markup=False)
    screen.print(f"formula  {found.formula or '(no moving link)'}", markup=False)
    for number, (module, count) in enumerate(zip(found.plan.modules, found.assemblies, strict=True)):
        ways = "" if module.rank == 1 else f", {count} assembly {'mode' if count == 1 else 'modes'}"
        solver = "general group" if module.kind == "general" else "closed form"
        joints = ", ".join(module.joints)
        screen.print(
            f"  {module.label:<24} links {', '.join(module.links)}; joints {joints}; {solver}{ways}",
            markup=False, soft_wrap=True,
        )  # fmt: skip
        for choice in (one for one in found.choices if one.module == number):
            for line in lines(choice):
                screen.print(f"    {line}", markup=False, highlight=False, soft_wrap=True)
    for pair in found.gears:
        screen.print(f"gears    {gear_line(pair)}", markup=False, highlight=False, soft_wrap=True)
