"""Everything of a mechanism that can be set, swept and measured: names, units and present values."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from trunnion.algebra.dual import primal
from trunnion.cycle.model_measures import watched
from trunnion.errors import Finding, MechanismError, Severity
from trunnion.measures.evaluation import courses_of
from trunnion.measures.measures import Measure, named
from trunnion.model.measure_table import MEASURES
from trunnion.model.mechanism import Mechanism
from trunnion.model.parameters import measured
from trunnion.solve.forward import forward
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import Run, prepare

__all__ = ["NamedMeasure", "NamedNumber", "Vocabulary", "vocabulary"]

TIMES = ("at", "over", "within", "along")  # of a measure, and no number to sweep over: they say what is looked at


@dataclass(frozen=True)
class NamedNumber:
    """A number of the model: its shortest name and its path, SI unit and value, and the text as it was written.

    value: NaN of one that changes with the motion; swept: whether `--over` takes it as well as `--set`.
    """

    name: str
    path: str
    unit: str
    value: float
    written: str
    swept: bool


@dataclass(frozen=True)
class NamedMeasure:
    """A measure by its name, what it is, its SI unit and value; NaN where there is none.

    stated: whether the model states it; value: its figure over the cycle, of one that has none by itself that at the
    start.
    """

    name: str
    text: str
    unit: str
    value: float
    stated: bool


@dataclass(frozen=True)
class Vocabulary:
    """What `--set` and `--over` take, and what `--measure`, `measures:` and the channels of a rig take.

    findings: which measures of the model cannot be told, and why.
    """

    numbers: tuple[NamedNumber, ...]
    measures: tuple[NamedMeasure, ...]
    findings: tuple[Finding, ...] = ()


@np.errstate(all="ignore")
def vocabulary(mechanism: Mechanism) -> Vocabulary:
    """Every number and every measure of a mechanism by name, with unit and present value.

    Raises MechanismError if the structure does not determine the motion.
    """
    run = prepare(mechanism)
    of_cycle = watched(run, np.zeros(1), FrictionMethod())
    figures = dict(zip((item.name for item in of_cycle.measures), of_cycle.figures, strict=True))
    listed = [*named(mechanism, mechanism.measures, run.values), *_others(run)]
    open_ = run.determinacy is not None and any(item.severity is Severity.ERROR for item in run.determinacy.findings())
    single = [item for item in listed if item.single(run.system) and (item.of_motion or not open_)]
    starts, measures = courses_of(run, single, np.zeros(1), FrictionMethod())[0], []
    for measure in listed:
        value = float(figures.get(measure.name, np.nan))
        if not np.isfinite(value) and measure.name in starts:
            value = float(np.ravel(primal(starts[measure.name][0]))[0])
        unit, is_stated = measure.figure_unit(run.system, run.values), measure.name in mechanism.measures
        measures.append(NamedMeasure(measure.name, measure.of.long_name, unit, value, is_stated))
    return Vocabulary(tuple(_numbers(mechanism)), tuple(measures), tuple(of_cycle.findings))


def _numbers(mechanism: Mechanism) -> Iterator[NamedNumber]:
    values, names = mechanism.parameters(), mechanism.parameter_names
    kinds, shortest = measured(mechanism, mechanism.parameter_set.entries.values()), dict[str, str]()
    for ending, paths in names.endings.items():
        path = paths[0]
        if len(paths) == 1 and len(ending) < len(shortest.get(path, path)) and mechanism.path_of(ending) == path:
            shortest[path] = ending  # it means this number, and no dimension or whole path
    for path, entry in mechanism.parameter_set.entries.items():
        value = float(np.ravel(primal(values[path]))[0]) if path in values else float("nan")
        place = path.split(".")
        swept = path in values and not (place[0] == "measures" and place[2] in TIMES)
        name = path.removeprefix("dimensions.") if place[0] == "dimensions" else shortest.get(path, path)
        yield NamedNumber(name, path, kinds[path].unit, value, str(entry.quantity.source), swept)


def _others(run: Run) -> Iterator[Measure]:
    """What can be measured beside what the model states: every kind of everything that moves or bears and has it."""
    mechanism = run.system.mechanism
    walk = forward(run.system, run.values, run.chosen.assembly, np.zeros(1))
    for kind, of in MEASURES.items():
        if of.space not in ("", mechanism.space) or kind == "expression":
            continue
        for subject in mechanism.named(of.of) if isinstance(of.of, str) else of.of:
            if subject.partition(".")[0] == mechanism.fixed_link and of.of in ("point", "link"):
                continue
            axes = ("x", "y", "z")[: mechanism.coordinates]
            picked = of.vector_in(mechanism.space)
            for axis in (*([""] if picked != "must" else []), *(axes if picked else ())):
                full_name = f"{subject}.{axis}" if axis else subject
                text = full_name if kind == "point" else f"{kind}:{full_name}"
                with suppress(MechanismError):  # such as the slide of a joint that turns
                    measure = named(mechanism, [text], run.values)[0]
                    if measure.of_places:
                        measure.curve(walk)
                    yield measure
