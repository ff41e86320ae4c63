"""How the figures of a cycle change with some of the mechanism's numbers.

Every point of the grid is a mechanism of its own; its cycle comes to one number of each of FIGURES. A point with a
position without an answer has no figures of the cycle but its status, and the efficiency of the ideal mechanism if that
has an answer everywhere.

Points that differ in nothing but numbers are solved in one pass, others each by itself. In one pass go points whose
modules are put together in the same way. What decides that is looked at: the numbers of a model at every point, the
choice of a closed form at every start, and mechanisms of their own at values of every name and at the corners of the
grid, where groups that are followed must come to the same figures. What the pass cannot answer for is prepared and
analysed alone: gears, seats of pins, bristles, redundant constraints, points that may pass a change point, and those
where a followed group does not close.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.namespace import Number
from trunnion.cycle.course import CycleCourse, margin_of
from trunnion.cycle.cycle_kernel import Engine, Many
from trunnion.cycle.fill import CONDITIONS
from trunnion.cycle.findings import of_run
from trunnion.cycle.positions import check_steps, positions
from trunnion.cycle.scales import peak, scales_of
from trunnion.cycle.summary import inputs, member_units, references
from trunnion.dynamics.measured import LONGER, courses_in_time, not_steady
from trunnion.errors import Finding, MechanismError, Severity, Status, agreeing, counted
from trunnion.measures.many import figures_of
from trunnion.measures.measures import Measure
from trunnion.model.arguments import strict_arguments
from trunnion.model.checks.check import bare_number, check_values
from trunnion.model.mechanism import Mechanism
from trunnion.model.parameters import ParameterSet
from trunnion.results.attributes import cited, finding_rows, origin
from trunnion.results.dataset import MemberUnits, Variable, dataset_of, described
from trunnion.solve import change_points
from trunnion.solve.assembly import grid as starts
from trunnion.solve.forward import pose_of, start
from trunnion.solve.friction_method import MARGIN, FrictionMethod
from trunnion.solve.hints import distance, hinted_at, hints, named_way
from trunnion.solve.loads import NOTHING_USEFUL, STATE_USEFUL, closes, has_useful_work
from trunnion.solve.run import Run, prepare
from trunnion.solve.switches import Mechanisms
from trunnion.solve.system import Cycle, System, law_of, rubbing
from trunnion.studies.sweep_grid import (
    FIGURES,
    Over,
    Reduced,
    Swept,
    at_point,
    grid,
    measures_of,
    reduced,
    say,
)

if TYPE_CHECKING:
    import xarray as xr

AT_ONCE = 10_000  # numbers in an array, which then stays in cache
COMPILED_AT_ONCE = 1 << 18
OF_MEANS = 1000  # positions of each point that its means take, about
OF_MARGIN = 20  # times as long a position takes with the locking margin
FEWEST = 24  # positions on which a change point between them shows
PROBES = 24  # values of a name at which a mechanism of its own is looked at
PROBES_FOLLOWED = 5  # the same with groups that are followed, which takes long
SAME = 1e-6  # of a figure: what two ways to the same assembly may differ by
Array = NDArray[np.float64]
Index = tuple[int, ...]


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
    findings = _with_bare(mechanism, points.swept, [*_findings(points, watched.values(), arrays)])
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


def _findings(points: Points, watched: Iterable[Measure], arrays: Mapping[str, NDArray[Any]]) -> Iterator[Finding]:
    """Points without figures, an efficiency, or a measure; what points have to say that were looked at by themselves,
    each once, and notes only if all have them."""
    status, names = arrays["status"], " and ".join(number.name for number in points.swept)

    def places(mask: NDArray[np.bool_]) -> tuple[str, str, dict[str, Any]]:
        """How many points of the grid are meant, and where the first is, in words and as figures."""
        where = np.argwhere(mask)
        first = say(points.swept, where[0].tolist())
        of = f"{len(where):,} of {counted(mask.size, 'point')}"
        return of, f"the first at {first}", {"points": len(where), "of": mask.size, "at": first}

    remedy = "run `trunnion analyse` with these values to see where in the cycle, and why"
    for code in Status:
        mask = status == code
        if not code.solved and mask.any():
            (of, first, figures), missing = places(mask), int(arrays["without_answer"][mask][0])
            where = f"{counted(missing, 'position')} not solved" if missing else "between the positions"
            what = f"{of} {agreeing(figures['points'], 'has', 'have')} no result, {first} ({where}): {code.text}"
            yield Finding.error("sweep.no_answer", names, what, remedy, **figures, positions=missing, status=code.text)
    looked = len(points.looked)
    all_points = f"{counted(looked, 'point')}{' looked at' * (looked < status.size)}"
    for by_point in points.said.values():
        finding, count = next(iter(by_point.values())), len(by_point)
        if count == looked:
            yield finding
        elif finding.severity is not Severity.NOTE:
            yield replace(finding, what=f"{finding.what} (at {count:,} of {all_points})")
    undefined = (status < Status.NOT_CONVERGED) & np.isnan(arrays["efficiency"])
    if np.any(undefined):
        of, first, figures = places(undefined)
        why, remedy = "the drivers supply no net work", "see the mean powers there"
        if not has_useful_work(points.mechanism):
            why, remedy = NOTHING_USEFUL, STATE_USEFUL
        what = f"the efficiency is undefined at {of}, {first}: {why}"
        yield Finding.note("sweep.no_efficiency", "efficiency", what, remedy, **figures)
    for measure in watched:
        mask = ~np.isfinite(arrays[measure.name])
        if measure.in_time and mask.any():
            of, first, figures = places(mask)
            what = f"{measure.name} has no value at {of}, {first}: {not_steady(points.run, measure)}"
            yield Finding.warning("sweep.not_steady", f"measures.{measure.name}", what, LONGER, **figures)


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
    # the largest reaction of all; of a point that locks they are ∞, beside which every other would be rounding
    scales, reactions = scales_of(run), arrays["reaction_max"]
    errors = ["m" if joint.pair.guided else "rad" for joint in run.system.joints.values()]
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
        **scales._replace(force=max(scales.force, peak(reactions[np.isfinite(reactions)]))).summary([]),
    }
    return dataset_of("sweep", variables, labels, attributes, along)


# ---- points ---------------------------------------------------------------------------------------------------


@dataclass
class Points:
    """The points of a grid and how their cycles are run.

    looked: points that were prepared by themselves; said: what they have to say, by place and text and then by point;
    erring: whether any point has errors; run: of the first point.
    """

    mechanism: Mechanism
    swept: Sequence[Swept]
    steps: int
    method: FrictionMethod
    margin: bool = False
    engine: str = "auto"

    def __post_init__(self) -> None:
        check_steps(self.steps)
        self.said: dict[tuple[str, str], dict[Index, Finding]] = {}
        self.looked: set[Index] = set()
        self.erring = False
        self.run = self._prepared(tuple(0 for _ in self.swept))
        each = (self.steps + OF_MEANS) * (OF_MARGIN if self.margin else 1)
        self._many = Many(self.run, self.engine, int(np.prod(self.shape)) * each)

    @property
    def shape(self) -> Index:
        return tuple(len(number.values) for number in self.swept)

    def solved(self) -> Iterator[tuple[Index, Reduced]]:
        """Figures of every point, in any order."""
        left = list(np.ndindex(self.shape))
        if self._similar:
            most = COMPILED_AT_ONCE if self._many.compiled else AT_ONCE
            size, later = max(1, most // self.steps), []
            for low in range(0, len(left), size):
                part = left[low : low + size]
                for index, figures in zip(part, self._together(part), strict=True):
                    if figures is None:
                        later.append(index)
                    else:
                        yield index, figures
            left = later
        for index in left:
            yield index, self._alone(index)

    # ---- each by itself ---------------------------------------------------------------------------------------

    def _prepared(self, index: Index) -> Run:
        """The mechanism of a point by itself; MechanismError says at which."""
        with at_point(self.swept, index):
            changed = self.mechanism.with_values(
                {number.path: number.stated(i) for number, i in zip(self.swept, index, strict=True)}
            )
            run = prepare(changed)
            if run.determinacy is not None:
                run.determinacy.refuse()
            self.looked.add(index)
            self.erring = self.erring or run.erring
            for finding in of_run(run):
                self.said.setdefault((finding.where, finding.what), {})[index] = finding
        return run

    def _alone(self, index: Index, run: Run | None = None) -> Reduced:
        run = run or (self._prepared(index) if any(index) else self.run)
        with at_point(self.swept, index):
            cycle = positions(run, self.steps, self.method, margin=False)
            margin = margin_of(run, replace(self.method, margin_up_to=MARGIN)) if self.margin else None
        return reduced(cycle.arrays, cycle.course, cycle.ideal, margin, run.system)

    def measured(self, index: Index, names: Sequence[str]) -> dict[str, float]:
        """Figures of measures at a point."""
        with at_point(self.swept, index):
            run = self._prepared(index) if any(index) else self.run
            measures = measures_of(run, names)
            timed = courses_in_time(run, measures, run.values, (1,))
            of_cycle = [measure for measure in measures if not measure.in_time]
            figures = figures_of(run, of_cycle, self.method) if of_cycle else {}
            return figures | {name: float(np.ravel(parts[0])[0]) for name, parts in timed.items()}

    # ---- in one pass ------------------------------------------------------------------------------------------

    @cached_property
    def _similar(self) -> bool:
        """Whether points may differ in nothing but numbers that flow through the modules' closed forms."""
        run, mechanism = self.run, self.run.system.mechanism
        joints = mechanism.effective_joints.values()
        if run.cycle.duration <= 0 or self.steps < FEWEST or mechanism.gears or run.chosen.meetings:
            return False
        if any(joint.seat not in (None, "free") for joint in joints):
            return False
        if any(law_of(run.system, name).relaxation is not None for name in rubbing(run.system)):
            return False
        if any(module.redundant for module in run.system.plan.modules):
            return False
        # looked at are points along every name from the first, and the corners
        first, most = tuple(0 for _ in self.shape), PROBES_FOLLOWED if self._followed else PROBES
        along = [
            (*first[:axis], int(i), *first[axis + 1 :])
            for axis, count in enumerate(self.shape)
            for i in np.unique(np.linspace(0, count - 1, min(count, most)).astype(int))
        ]
        corners = product(*({0, count - 1} for count in self.shape))
        alike = all(self._like(index) for index in dict.fromkeys([*along, *corners]))
        # what a joint is turned by its errors is told from the start of its own cycle, which a followed group has alone
        return alike and not (self._followed and self.erring)

    @cached_property
    def _followed(self) -> bool:
        """Whether any group is followed along the cycle of the first point."""
        return any(hasattr(assembly, "pose") for assembly in self.run.chosen.assembly)

    def _like(self, index: Index) -> bool:
        """Whether a point by itself has the numbers that one pass would give it, and the same tables and open ends."""
        run = self._prepared(index) if any(index) else self.run
        nominal_values, meant = run.values, self._values([index])
        if nominal_values.keys() != meant.keys() or run.system.plan.formula != self.run.system.plan.formula:
            return False
        same = all(
            nominal_values[path] == value or np.array_equal(nominal_values[path], np.ravel(value)[0], True)
            for path, value in meant.items()
        )
        left_open, others_open = (
            [(finding.where, finding.what) for finding in (each.determinacy.findings() if each.determinacy else ())]
            for each in (run, self.run)
        )
        closed, others_closed = (
            [closes(each.system.mechanism, name) for name in each.system.mechanism.tables] for each in (run, self.run)
        )
        if not same or left_open != others_open or closed != others_closed:
            return False
        if not self._followed:
            return True
        (together,) = self._together([index])
        if together is None:
            return True
        # whether both cycles come to the same statuses, efforts and reactions; powers follow from these
        alone, exact = self._alone(index, run), ("status", "without_answer")
        rough = [name for name in ("drive_effort_rms", "drive_effort_max", "reaction_max") if name in together]
        if together.keys() != alone.keys() or any(together[name] != alone[name] for name in exact):
            return False
        return all(
            np.allclose(together[name], alone[name], rtol=0.0, atol=SAME * np.max(np.abs(alone[name])))
            for name in rough
        )

    def _values(self, points: Sequence[Index], ideal: bool = False) -> dict[str, Number]:
        """Every number of the mechanism, (point, 1) where it varies."""
        mechanism, columns = self.run.system.mechanism, np.array(points, int).T
        entries = mechanism.parameter_set.entries
        numbers_of: dict[str, Number] = {}
        for number, places in zip(self.swept, columns, strict=True):
            error = entries[number.path].error
            numbers = number.values[places][:, np.newaxis]
            numbers_of[number.path] = numbers + (0.0 if ideal or not error else self.run.values[error])
        return mechanism.ideal_parameters(numbers_of) if ideal else mechanism.parameters(numbers_of)

    @np.errstate(all="ignore")
    def _together(self, points: Sequence[Index]) -> list[Reduced | None]:
        """Figures of some points; None where a point has to be looked at alone."""
        run, shape = self.run, (len(points), self.steps)
        values, ideal_values = self._values(points), self._values(points, ideal=True)
        cycles = self._cycles(points, values)
        time = np.array([cycle.times(self.steps) for cycle in cycles])
        time = time[0] if np.all(time == time[0]) else time
        errs = np.zeros(len(points), bool)  # which are others than their ideal ones
        for path, value in ideal_values.items():
            if value is not values[path]:
                errs |= np.broadcast_to(np.not_equal(value, values[path]), (len(points), 1))[:, 0]
        self.erring = self.erring or bool(errs.any())
        ours = _as_chosen(run, values, len(points))
        meant = ideal_values if errs.any() else None
        arrays, ideal = self._many.filled(values, meant, time, shape, (), self.method)
        ours &= ~_may_change(run.system, arrays[CONDITIONS], run.cycle.periodic)
        if self._followed:
            ours &= np.all(arrays["status"] != Status.NOT_ASSEMBLED, axis=1)
        answered = ours & np.all(arrays["status"] < Status.NOT_CONVERGED, axis=1)
        courses = self._courses(values, meant, cycles, answered)
        margins = self._courses(values, None, cycles, ours, margins=True) if self.margin else {}
        likes: dict[int, CycleCourse] = {}
        if errs.any():
            answered = ours & errs & np.all(ideal["status"] < Status.NOT_CONVERGED, axis=1)
            likes = self._courses(ideal_values, None, cycles, answered)
        figures: list[Reduced | None] = []
        for i in range(len(points)):
            rows = {name: array[..., i, :] for name, array in arrays.items()}
            meant_means = likes[i].means if i in likes else None
            parts = rows, courses.get(i), meant_means, margins.get(i), run.system
            figures.append(reduced(*parts) if ours[i] else None)
        return figures

    def _courses(
        self,
        values: Mapping[str, Number],
        ideal: Mapping[str, Number] | None,
        cycles: Sequence[Cycle],
        lanes: NDArray[np.bool_],
        margins: bool = False,
    ) -> dict[int, CycleCourse]:
        """The courses of some mechanisms of a batch by their number, or those of their locking margins.

        ideal: see `Many.courses`.
        """
        rows = np.flatnonzero(lanes)
        if not len(rows):
            return {}

        def some(numbers: Mapping[str, Number]) -> Mechanisms:
            every = Mechanisms(self.run.system, self.run.chosen.assembly, numbers, cycles)
            return replace(every, values=every.picked(rows), cycles=[cycles[row] for row in rows.tolist()])

        if margins:
            courses = self._many.margins(some(values), replace(self.method, margin_up_to=MARGIN))
        else:
            courses = self._many.courses(some(values), None if ideal is None else some(ideal).values, self.method)
        return dict(zip(rows.tolist(), courses, strict=True))

    def _cycles(self, points: Sequence[Index], values: Mapping[str, Number]) -> list[Cycle]:
        """The cycle of every point; MechanismError where its numbers are none that a mechanism can have."""

        def nth(number: Number, k: int) -> float:
            return float(number[k, 0]) if np.ndim(number) else float(number)

        mechanism, cycles = self.run.system.mechanism, []
        numbers: ParameterSet = copy.copy(mechanism.parameter_set)
        # the first point is a mechanism, and so sound
        changed = {path: value for path, value in values.items() if value is not self.run.values.get(path)}
        drive = {path: value for path, value in values.items() if path.startswith("drivers.")}
        numbers.nominal = {path: nth(value, 0) for path, value in values.items()}
        for k, index in enumerate(points):
            numbers.nominal.update((path, nth(value, k)) for path, value in changed.items())
            with at_point(self.swept, index):
                findings = check_values(mechanism, numbers, changed)
                wrong = [finding for finding in findings if finding.severity is Severity.ERROR]
                if wrong:
                    raise MechanismError(wrong)
                varies = any(np.ndim(value) for value in drive.values())
                own = {path: nth(value, k) for path, value in drive.items()}
                cycles.append(self.run.system.cycle(own) if varies else self.run.cycle)
        return cycles


def _as_chosen(run: Run, values: Mapping[str, Number], count: int) -> NDArray[np.bool_]:
    """Which mechanisms of a batch go together as the first does: nearest to the hints at the start, as in `choose`."""
    system, times = run.system, starts(run.cycle)
    lane = hinted_at(start(system, run.values), times)
    walk, time = start(system, values), times[lane : lane + 1]
    ours = np.ones(count, bool)
    for number, module in enumerate(system.plan.modules):
        branches, assembly = system.groups[number].BRANCHES, run.chosen.assembly[number]
        free = module.rank > 1 and len(branches) > 1 and named_way(system, module, len(branches)) is None
        if free and hints(walk, module):
            poses = [pose_of(walk, number, branch, time) for branch in branches]
            away = [np.broadcast_to(distance(walk, module, pose.frames), (count, 1))[:, 0] for pose in poses]
            nearest = np.where(away[1] < away[0], branches[1], branches[0])
            ours &= np.isfinite(away[0]) & np.isfinite(away[1]) & (nearest == assembly)
        walk.assembly.append(assembly)
        walk.take(number, pose_of(walk, number, assembly, time), time)
    return ours


def _may_change(system: System, conditions: Array, periodic: bool) -> NDArray[np.bool_]:
    """Which mechanisms of a batch may pass a change point: see `change_points.suspects`."""
    suspected = np.zeros(conditions.shape[1], bool)
    for module, group, condition in zip(system.plan.modules, system.groups, conditions, strict=True):
        if module.rank > 1 and group.BRANCHES:
            margin = 1 / condition
            around = np.concatenate([margin[:, -1:], margin, margin[:, :1]], axis=1) if periodic else margin
            suspected |= np.any(change_points.suspects(around), axis=-1)
    return suspected
