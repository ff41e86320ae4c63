"""`trunnion check`: findings and structure of a model, and the list of what can be set, swept and measured."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Option

from trunnion.cli.files import verb
from trunnion.cli.options import Model, placed
from trunnion.cli.result import end, write_text
from trunnion.cli.terminal import line, say, show_rows, wrote
from trunnion.errors import Finding, MechanismError

if TYPE_CHECKING:
    from trunnion.cycle.inspect import Check
    from trunnion.cycle.vocabulary import NamedMeasure, NamedNumber

__all__ = ["check"]

HEAD = ["name", "value", "unit"]


@verb(lacks="seat")
def check(
    model: Model,
    assemblies: Annotated[
        Path | None,
        Option("--assemblies", help="Also draw the assembly modes of each group: a .png, .svg or .pdf file."),
    ] = None,
    list_: Annotated[
        bool, Option("--list", help="List what can be set, swept and measured, with units and values.")
    ] = False,
    out: Annotated[Path | None, Option("--out", "-o", help="Write that list: a .json file.")] = None,
) -> None:
    """Check a model: findings, mobility, structure, assembly modes."""
    if list_ or out:
        _list(model, out)
        return
    from trunnion.cycle.inspect import check as inspect

    if assemblies:
        from trunnion.views.cycle.plots import check_figure

        check_figure(assemblies)
    mechanism = model.read()
    with model.lines():
        checked = inspect(mechanism)
    line(mechanism.name or model.file.name, "bold")
    _show_structure(checked, len(mechanism.drivers))
    if assemblies:
        from trunnion.views.assembly.mode_drawings import ways as drawings
        from trunnion.views.cycle.plots import save

        save(drawings(mechanism, checked.choices), assemblies)
        wrote(assemblies)
    end(checked.findings, model.file, "assembly measures", every=True)


def _show_structure(checked: Check, drivers: int) -> None:
    """Mobility, structural formula, modules with the ways to assemble them, and pairs of gears, a line each."""
    from trunnion.views.assembly.modes import gear_line, lines

    rank = checked.rank_mobility
    by_rank = "by rank unknown: no position can be assembled" if rank is None else f"{rank} by rank"
    line(f"mobility {checked.mobility} by formula, {by_rank}; drivers: {drivers}")
    line(f"formula  {checked.formula or '(no moving link)'}")
    for number, (module, count) in enumerate(zip(checked.plan.modules, checked.assemblies, strict=True)):
        modes = "" if module.rank == 1 else f", {count} assembly {'mode' if count == 1 else 'modes'}"
        solver = "general group" if module.kind == "general" else "closed form"
        joints = ", ".join(module.joints)
        line(f"  {module.label:<24} links {', '.join(module.links)}; joints {joints}; {solver}{modes}")
        for choice in (choice for choice in checked.choices if choice.module == number):
            for text in lines(choice):
                line(f"    {text}")
    for pair in checked.gears:
        line(f"gears    {gear_line(pair)}")


def _list(model: Model, out: Path | None) -> None:
    """Print what can be set, swept and measured, and write it if a file is named."""
    from trunnion.cycle.vocabulary import vocabulary

    mechanism = model.read()
    if out is not None and out.suffix.lower() != ".json":
        raise MechanismError(Finding(f"the list is JSON, '{out.name}' is not", "--out", "name a .json file"))
    with model.lines():
        words = vocabulary(mechanism)
    for swept, use in ((True, "parameters for --set and sweep --over"), (False, "parameters for --set only")):
        numbers = [number for number in words.numbers if number.swept is swept]
        if numbers:
            show_rows(use, [*HEAD, "written as"], [_row(number, number.written) for number in numbers])
    for verbs in dict.fromkeys(measure.verbs for measure in words.measures):
        taking = ", ".join(("analyse", "tolerance", "allocate", *verbs))
        title = f"measures of {taking}: figures of the cycle, or values at the start"
        measures = [measure for measure in words.measures if measure.verbs == verbs]
        measures.sort(key=lambda measure: not measure.stated)
        show_rows(title, [*HEAD, "what"], [_row(measure, measure.text) for measure in measures])
    say(placed(words.findings, model.file, ["measures"]))
    if out is not None:
        write_text(json.dumps(words.data(), ensure_ascii=False, indent=1) + "\n", out)
        wrote(out)


def _row(entry: NamedNumber | NamedMeasure, text: str) -> list[str]:
    """Name, value, unit and what it is of a number that can be set or a measure."""
    value = f"{entry.value + 0.0:.6g}" if math.isfinite(entry.value) else ""
    return [entry.name, value, "" if entry.unit in ("1", "SI") else entry.unit, text]
