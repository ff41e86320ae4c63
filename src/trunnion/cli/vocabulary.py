"""The list of `check`: what of a model can be set, swept and measured."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING

from trunnion.cli.model import lines_of, placed
from trunnion.cli.terminal import say, show_rows, wrote
from trunnion.errors import Finding, MechanismError
from trunnion.files import whole

if TYPE_CHECKING:
    from trunnion.model.mechanism import Mechanism

__all__ = ["show"]


def show(file: Path, mechanism: Mechanism, out: Path | None) -> None:
    """Print the list, and write it if a file is named."""
    from trunnion.cycle.vocabulary import vocabulary

    if out is not None and out.suffix.lower() != ".json":
        raise MechanismError(Finding(f"the list is JSON, '{out.name}' is not", "--out", "name a .json file"))
    with lines_of(file):
        found = vocabulary(mechanism)
    for swept, use in ((True, "parameters for --set and sweep --over"), (False, "parameters for --set only")):
        numbers = [
            [one.name, _number(one.value), _unit(one.unit), one.written] for one in found.numbers if one.swept is swept
        ]
        if numbers:
            show_rows(use, [*HEAD, "written as"], numbers)
    for verbs in dict.fromkeys(one.verbs for one in found.measures):
        taking = ", ".join(("analyse", "tolerance", "allocate", *verbs))
        title = f"measures of {taking}: figures of the cycle, or values at the start"
        own = sorted((one for one in found.measures if one.verbs == verbs), key=lambda one: not one.stated)
        rows = [[one.name, _number(one.value), _unit(one.unit), one.text] for one in own]
        show_rows(title, [*HEAD, "what"], rows)
    say(placed(found.findings, file, ["measures"]))
    if out is not None:
        with whole(out) as temporary:
            temporary.write_text(json.dumps(found.data(), ensure_ascii=False, indent=1) + "\n", encoding="utf-8")
        wrote(out)


HEAD = ["name", "value", "unit"]


def _number(value: float) -> str:
    return f"{value + 0.0:.6g}" if math.isfinite(value) else ""


def _unit(unit: str) -> str:
    return "" if unit in ("1", "SI") else unit
