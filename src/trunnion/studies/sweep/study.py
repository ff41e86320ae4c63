"""How the figures of a cycle change with some of the mechanism's numbers.

Every point of the grid is a mechanism of its own; its cycle comes to one number of each of FIGURES. Points that differ
in nothing but numbers are solved in one pass (`sweep_points`). A point with a position without an answer has no figures
of the cycle but its status, and the efficiency of the ideal mechanism if that has an answer everywhere.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trunnion.cycle.cycle_kernel import Engine
from trunnion.cycle.scales import peak, scales_of
from trunnion.cycle.summary import inputs, member_units, references
from trunnion.dynamics.measured import LONGER, not_steady
from trunnion.errors import Finding, Severity, Status, agreeing, counted
from trunnion.joints.pairs import PAIRS
from trunnion.measures.measures import Measure
from trunnion.model.arguments import strict_arguments
from trunnion.model.checks.units import bare_number
from trunnion.model.mechanism import Mechanism
from trunnion.results.attributes import cited, finding_rows, origin
from trunnion.results.dataset import MemberUnits, Variable, dataset_of, described
from trunnion.results.scales import Scales
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.loads import NOTHING_USEFUL, STATE_USEFUL, has_useful_work
from trunnion.solve.run import Run
from trunnion.studies.sweep.figures import FIGURES, left_out, measures_of
from trunnion.studies.sweep.grid import MOST_POINTS, Over, Swept, grid, say
from trunnion.studies.sweep.points import Points

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["FIGURES", "MOST_POINTS", "Swept", "sweep"]


@strict_arguments
@np.errstate(all="ignore")  # of numbers near the end of the floats: what has no value is NaN, and its status says so
def sweep(
    mechanism: Mechanism,
    over: Over,
    steps: int = 360,
    friction_method: FrictionMethod | None = None,
    progress: Callable[[int], None] | None = None,
    margin: bool = False,
    measures: Sequence[str] | None = None,
    engine: Engine = "auto",
) -> xr.Dataset:
    """Figures of the cycle over a grid of some numbers of the mechanism.

    Parameters
    ----------
    over
        By name, as for `Mechanism.with_values` (a path or an ending that is unique), a list of values, or from, to and
        count: `{"misalignment": ("0 deg", "30 deg", 7), "input.speed": [50, 100]}`; plain numbers are SI.
    steps, friction_method, engine
        As for `analyse`; engine auto is compiled where it pays and can do the mechanism.
    progress
        Called with the number of points done.
    margin
        Whether the locking margin is looked for as well, which takes many times as long as all else.
    measures
        Names of the model's, or written as for `play`, each with one figure a cycle; none if not given.

    Returns
    -------
    Dataset
        A dimension for each name, last, its coordinate in SI, and the variables of `FIGURES`. Where any position of the
        cycle has no answer they are NaN, but for the locking margin of positions that lock: `status` and
        `without_answer` tell. Extremes leave out what `analyse` leaves out of its summary.

    Raises
    ------
    MechanismError
        A name is unknown or stands for several numbers, values that the model refuses (at any point), none or more than
        MOST_POINTS of them, or a structure that does not determine the motion.
    """
    points = Points(mechanism, grid(mechanism, over), steps, friction_method or FrictionMethod(), margin, engine)
    labels = {"driver": list(mechanism.drivers), "joint": list(mechanism.effective_joints)}
    sizes = {dim: len(names) for dim, names in labels.items()}
    sizes |= {number.name: len(number.values) for number in points.swept}
    arrays = {
        name: variable.over(*(swept.name for swept in points.swept)).blank(sizes)
        for name, variable in FIGURES.items()
        if margin or variable.part != "margin"
    }
    measures = measures or ()
    watched = {measure.name: measure for measure in measures_of(points.run, measures)} if measures else {}
    arrays |= {name: np.full(points.shape, np.nan) for name in watched}
    for done, (index, row) in enumerate(points.solved(), 1):
        if watched:
            row |= points.measured(index, list(watched))
        for name, value in row.items():
            place: Any = (..., *index)
            arrays[name][place] = value
        if progress:
            progress(done)
    findings = [*_answers(points.swept, arrays), *_shared(points), *left_out(mechanism, measures)]
    findings = _with_bare(mechanism, points.swept, findings)
    findings += _undefined(points, watched.values(), arrays)
    if not points.erring:
        of_errors = {name for name, variable in FIGURES.items() if variable.part == "errors"}
        arrays = {name: array for name, array in arrays.items() if name not in of_errors}
    figures = FIGURES | {
        name: Variable((), measure.figure_unit(points.run.system, points.run.values), f"measure {name}")
        for name, measure in watched.items()
    }
    return _dataset(points, labels, arrays, findings, figures)


def _with_bare(mechanism: Mechanism, swept: Iterable[Swept], findings: list[Finding]) -> list[Finding]:
    """The findings, with what the largest value of each number says of its unit in place of what every value does."""
    bare: list[Finding] = []
    for item in swept:
        value = float(max(item.values, key=abs))
        if not item.written:
            checked = mechanism.with_values({item.path: value}).checked
            doubts = [doubt for doubt in checked if (doubt.where, doubt.severity) == (item.path, Severity.WARNING)]
            doubts = [*bare_number(mechanism.parameter_set, item.path, value)] or doubts
            more = f" (the largest of {len(item.values)} values)" if len(item.values) > 1 else ""
            bare += [replace(doubt, what=doubt.what + more) for doubt in doubts]
    return [*(item for item in findings if item.where not in {finding.where for finding in bare}), *bare]


# ---- what there is to say -------------------------------------------------------------------------------------


def _shared(points: Points) -> Iterator[Finding]:
    """What the points have to say that were looked at by themselves, each once; notes only if all have them."""
    total, looked = int(np.prod(points.shape)), len(points.looked)
    all_points = counted(total, "point") if looked == total else f"{counted(looked, 'point')} looked at"
    for by_point in points.said.values():
        finding, count = next(iter(by_point.values())), len(by_point)
        if count == looked:
            yield finding
        elif finding.severity is not Severity.NOTE:
            yield replace(finding, what=f"{finding.what} (at {count:,} of {all_points})")


def _places(swept: Sequence[Swept], mask: NDArray[np.bool_]) -> tuple[str, str, dict[str, Any]]:
    """How many points of the grid are meant, and where the first is, in words and as figures."""
    where = np.argwhere(mask)
    first = say(swept, tuple(int(i) for i in where[0]))
    of = f"{len(where):,} of {counted(mask.size, 'point')}"
    return of, f"the first at {first}", {"points": len(where), "of": mask.size, "at": first}


def _answers(swept: Sequence[Swept], arrays: Mapping[str, NDArray[Any]]) -> Iterator[Finding]:
    """An error for every status that leaves points without figures."""
    status, names = arrays["status"], " and ".join(number.name for number in swept)
    remedy = "run `trunnion analyse` with these values to see where in the cycle, and why"
    for code in Status:
        mask = status == code
        if code.solved or not mask.any():
            continue
        (of, first, figures), missing = _places(swept, mask), int(arrays["without_answer"][mask][0])
        where = f"{counted(missing, 'position')} not solved" if missing else "between the positions"
        what = f"{of} {agreeing(figures['points'], 'has', 'have')} no result, {first} ({where}): {code.text}"
        yield Finding.error("sweep.no_answer", names, what, remedy, **figures, positions=missing, status=code.text)


def _undefined(points: Points, watched: Iterable[Measure], arrays: Mapping[str, NDArray[Any]]) -> Iterator[Finding]:
    """Points with an answer that have no efficiency, and measures of a motion in time that have no value there."""
    undefined = (arrays["status"] < Status.NOT_CONVERGED) & np.isnan(arrays["efficiency"])
    if np.any(undefined):
        of, first, figures = _places(points.swept, undefined)
        why, remedy = "the drivers supply no net work", "see the mean powers there"
        if not has_useful_work(points.mechanism):
            why, remedy = NOTHING_USEFUL, STATE_USEFUL
        what = f"the efficiency is undefined at {of}, {first}: {why}"
        yield Finding.note("sweep.no_efficiency", "efficiency", what, remedy, **figures)
    for measure in watched:
        mask = ~np.isfinite(arrays[measure.name])
        if measure.in_time and mask.any():
            of, first, figures = _places(points.swept, mask)
            what = f"{measure.name} has no value at {of}, {first}: {not_steady(points.run, measure)}"
            yield Finding.warning("sweep.not_steady", f"measures.{measure.name}", what, LONGER, **figures)


def _scales(run: Run, arrays: Mapping[str, NDArray[Any]]) -> Scales:
    """Those of the first point, with the largest reaction of all."""
    scales = scales_of(run)
    reactions = arrays["reaction_max"]  # of a point that locks they are ∞, beside which every other would be rounding
    return scales._replace(force=max(scales.force, peak(reactions[np.isfinite(reactions)])))


# ---- the result -----------------------------------------------------------------------------------------------


def _dataset(
    points: Points,
    labels: Mapping[str, Sequence[str]],
    arrays: Mapping[str, NDArray[Any]],
    findings: Sequence[Finding],
    figures: Mapping[str, Variable],
) -> xr.Dataset:
    mechanism, run, swept = points.mechanism, points.run, points.swept
    names = [number.name for number in swept]
    errors = ["m" if PAIRS[kind].guided else "rad" for kind, _ in run.system.joints.values()]
    units = {**member_units(run.system), "transmission_error": MemberUnits("joint", errors)}
    variables = described(arrays, {name: variable.over(*names) for name, variable in figures.items()}, units)
    along: dict[str, xr.Variable] = {}
    for number in swept:
        described_by = {number.name: Variable((number.name,), number.unit, number.path)}
        along |= described({number.name: number.values}, described_by)
        along[number.name].attrs |= {"written_unit": number.written, "written_factor": number.factor}
    attributes = {
        **origin(mechanism, run.system.plan.formula, swept=names, steps=points.steps),
        "method": points.method.name,
        **cited(references(mechanism)),
        "inputs": inputs(mechanism),
        "findings": finding_rows(findings),
        **_scales(run, arrays).summary([]),
    }
    return dataset_of("sweep", variables, labels, attributes, along)
