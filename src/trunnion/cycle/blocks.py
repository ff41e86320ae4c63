"""More positions of a cycle than one would hold in memory: solved and written a block at a time.

What every position has goes to the files. Of the summary, extremes and counts are merged over the blocks; what is said
of the cycle as a whole, findings above all, is looked for at as many positions as a block has.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from trunnion.cycle.kept import ALL, Kept
from trunnion.cycle.model_measures import values_at
from trunnion.cycle.positions import check_steps, positions, stretch
from trunnion.cycle.summary import BALANCED, balance, books, dataset_of, figures, peak
from trunnion.errors import Finding, Severity, Status
from trunnion.results.attributes import encoded, figure_rows, finding_rows, findings_of, summary_of
from trunnion.results.export import in_parts, saving
from trunnion.results.figure import MORE_THAN, Figure
from trunnion.results.result import Result
from trunnion.results.sentences import finding_for
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import Run

__all__ = ["BLOCK", "blocked", "written"]

BLOCK = 1 << 17  # positions: enough for the compiled engine, some 100 MB of all variables of a four-bar
Paths = Sequence[str | os.PathLike[str]]


def blocked(run: Run, steps: int, out: Paths) -> bool:
    """Whether a cycle is written to these files in blocks.

    Not where few positions are asked for, where a file cannot be written in parts, nor with pins in seats: contact is
    lost between positions that are looked at together.
    """
    return bool(out) and steps > BLOCK and run.cycle.duration > 0 and not run.seats and all(map(in_parts, out))


def written(
    run: Run,
    steps: int,
    out: Paths,
    method: FrictionMethod | None = None,
    progress: Callable[[int], None] | None = None,
    engine: str = "auto",
    kept: Kept = ALL,
    saved: Mapping[str, Any] | None = None,
) -> Result:
    """Write the positions of a cycle to files, a block at a time; the result at as many positions as a block has.

    saved: of the tables, as of `export.save`. A file is written whole or not at all.
    """
    check_steps(steps)
    first = positions(run, BLOCK, method, None, kept.margin, True, engine, kept.variables, steps)
    attributes, measured = books(run, first, kept)
    extremes: dict[str, Figure] = {}
    count = np.zeros(len(Status), np.int64)
    tails: tuple[dict[str, Any], ...] = {}, {}
    powers = {name: np.zeros(1) for name in BALANCED if name in first.arrays}  # the largest so far
    with ExitStack() as stack:
        files = [stack.enter_context(saving(path, **(saved or {}), in_parts=True)) for path in out]
        for low in range(0, steps, BLOCK):
            some = range(low, min(low + BLOCK, steps))
            time = run.cycle.times(steps, some)
            block = stretch(run, time, first.method, engine, kept.variables, tails[0], among=steps)
            block = replace(block, means=first.means, ideal=first.ideal, course=first.course)
            values = values_at(run, measured.measures, time, first.method, tails[1], first.compiled)
            own = replace(measured, values=values)
            powers = {name: np.maximum(row, peak(block.arrays[name])) for name, row in powers.items()}
            count += np.bincount(block.arrays["status"].astype(np.intp), minlength=len(count))
            for figure in (*figures(run, block), *own.summary()):
                extremes[figure.name] = _further(extremes.get(figure.name, figure), figure)
            if some.stop == steps:
                unseen = [code for code in Status if count[code] and not np.any(first.arrays["status"] == code)]
                attributes |= _concluded(Result(attributes, _none), extremes, balance(powers), count, unseen)
            part = dataset_of(run, block, own, attributes, kept)
            for add in files:
                add(part)
            if progress:
                progress(some.stop)
    return Result(attributes, lambda: dataset_of(run, first, measured, attributes, kept))


def _further(one: Figure, other: Figure) -> Figure:
    """A figure of two stretches together, where it is an extreme."""
    if other.value is None or isinstance(one.value, str) or isinstance(other.value, str):
        return one
    if one.value is None or one.aspect == MORE_THAN:
        return other
    if other.aspect == MORE_THAN:
        return one
    least = one.aspect == "minimum"
    a, b = (abs(value) if one.aspect.startswith("largest") else value for value in (one.value, other.value))
    return other if (b < a if least else b > a) else one


def _concluded(
    looked: Result,
    extremes: Mapping[str, Figure],
    residual: float,
    count: NDArray[np.int64],
    unseen: Sequence[Status],
) -> dict[str, Any]:
    """Summary and findings over all blocks.

    looked: the result at some positions; residual: of the power balance; count: positions by status; unseen: statuses
    of positions at which it has not looked.
    """
    told = []
    for figure in summary_of(looked):
        if figure.aspect in ("minimum", "maximum", MORE_THAN) or figure.aspect.startswith("largest"):
            figure = extremes.get(figure.name, figure)
        if figure.name == "power_residual" and figure.value is not None:
            figure = replace(figure, value=residual)
        if figure.name == "positions_solved":
            figure = replace(figure, value=float(np.sum(count[: Status.NOT_CONVERGED])), aspect=f"of {np.sum(count)}")
        told.append(figure)
    findings = [*findings_of(looked), *_left_out(count, unseen)]
    return encoded({"summary": figure_rows(told), "findings": finding_rows(findings)})


def _left_out(count: NDArray[np.int64], unseen: Sequence[Status]) -> Iterator[Finding]:
    """What the findings are of, and statuses that they know nothing of."""
    steps, grave = int(np.sum(count)), [code for code in unseen if code > Status.ZERO_SLIP]
    if grave:
        states = {code.name.lower().replace("_", " "): int(count[code]) for code in grave}
        severity = Severity.ERROR if max(grave) >= Status.NOT_CONVERGED else Severity.WARNING
        yield finding_for("cycle.unseen", "steps", severity=severity, states=states, steps=steps, looked=BLOCK)
    yield finding_for("cycle.in_blocks", "steps", steps=steps, looked=BLOCK)


def _none() -> NoReturn:
    raise NotImplementedError
