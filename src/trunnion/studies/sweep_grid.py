"""The grid of a sweep: which numbers of a mechanism take which values, in the units they were given in; its figures."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.course import Place
from trunnion.cycle.course import CycleCourse, Means, magnitude
from trunnion.cycle.locking_course import least_margin
from trunnion.errors import Finding, MechanismError, Status
from trunnion.measures.measures import Measure, named
from trunnion.model.expression import LITERAL
from trunnion.model.mechanism import Mechanism
from trunnion.model.units import ANY, normalise, unit
from trunnion.results.dataset import Variable
from trunnion.solve.run import Run
from trunnion.solve.system import System

MOST_POINTS = 100_000
MOST_NAMES = 6
SUBJECTS = ("driver", "joint")  # the dimensions that are not swept

# dims before the swept names; part: "errors" of those that only mechanisms with errors have, "margin" of the one that
# is looked for only if asked
FIGURES: dict[str, Variable] = {
    "efficiency": Variable((), "1", "useful work over drive work of the cycle"),
    "efficiency_error": Variable(
        (), "1", "how far the errors of its integrals and pins that do not settle may have moved it"
    ),
    "efficiency_ideal": Variable((), "1", "efficiency of the mechanism without errors", part="errors"),
    "drive_effort_min": Variable(("driver",), "effort", "minimum drive effort"),
    "drive_effort_max": Variable(("driver",), "effort", "maximum drive effort"),
    "drive_effort_rms": Variable(("driver",), "effort", "root mean square of the drive effort"),
    "drive_power_mean": Variable((), "W", "mean power of all drivers"),
    "useful_power_mean": Variable((), "W", "mean power delivered to the useful loads"),
    "friction_power_mean": Variable((), "W", "mean power lost to friction"),
    "reaction_max": Variable(("joint",), "N", "maximum reaction"),
    "transmission_error_max": Variable(
        ("joint",),
        "transmission_error",
        "largest error of the joint's rotation, of a prismatic joint its slide",
        part="errors",
    ),
    "locking_margin": Variable(
        (), "1", "least multiple of the friction at which a position locks, ∞ if beyond 10", part="margin"
    ),
    "without_answer": Variable((), "1", "positions not solved", np.int32),
    "not_valid": Variable(
        (), "1", "positions at which a pin loses contact, left out of the figures", np.int32, part="errors"
    ),
    "status": Variable((), "1", "code of the gravest status of a position; see the attribute flag_meanings", np.int8),
}

Reduced = dict[str, Any]
Values = Sequence[float | str] | NDArray[np.float64]
Over = Mapping[str, Values | tuple[float | str, float | str, int]]


@dataclass(frozen=True)
class Swept:
    """A number that is swept: its name as given, its path, its values in SI.

    written: the unit that the values were given in, empty for plain numbers; factor: that unit in SI.
    """

    name: str
    path: str
    unit: str
    values: NDArray[np.float64]
    written: str = ""
    factor: float = 1.0

    def stated(self, index: int) -> float | str:
        """The value at an index as a model states it: with a unit, in SI, if it was given in one."""
        value = float(self.values[index])
        has_unit = self.written and self.unit not in ("1", "SI") and np.isfinite(value)
        return f"{value!r} {self.unit}" if has_unit else value

    def say(self, index: int) -> str:
        """The value at an index as an equation, in the unit it was given in."""
        unit = (self.written or self.unit).removeprefix("1")
        return f"{self.name} = {self.values[index] / self.factor + 0.0:.6g} {unit}".rstrip()


def grid(mechanism: Mechanism, over: Over) -> tuple[Swept, ...]:
    """The swept numbers; MechanismError with what is wrong with any of them."""
    if not 1 <= len(over) <= MOST_NAMES:
        what = f"{len(over)} names to sweep over"
        raise MechanismError(Finding(what, "over", f"give 1 to {MOST_NAMES}, such as misalignment=0deg:30deg:7"))
    paths: dict[str, str] = {}
    for name in over:
        path = mechanism.path_of(name)
        if path in paths:
            what = f"'{paths[path]}' and '{name}' are the same number, {path}"
            raise MechanismError(Finding(what, "over", "sweep over each once"))
        if name in FIGURES or name in SUBJECTS:
            what = f"the name '{name}' is also one of the result"
            raise MechanismError(Finding(what, "over", f"write it as {path}"))
        paths[path] = name
    counts = list[int]()
    for name, values in over.items():
        remedy = "give a list of values, or from, to and count such as 0deg:30deg:7"
        if isinstance(values, str) or not isinstance(values, (Sequence, np.ndarray)) or np.ndim(values) > 1:
            raise MechanismError(Finding(f"'{values}' is no range and no list of values", name, remedy))
        count: Any = len(values)
        if isinstance(values, tuple):
            count = values[-1] if len(values) == 3 else 0
            if not isinstance(count, (int, np.integer)) or isinstance(count, bool) or count < 2:
                what = f"{':'.join(map(str, values))} is not from, to and a count of 2 or more"
                raise MechanismError(Finding(what, name, remedy))
        elif not count:
            raise MechanismError(Finding("has no values", name, remedy))
        counts.append(int(count))
    points = int(np.prod(counts, dtype=object))
    if points > MOST_POINTS:
        what = f"a grid of {' × '.join(f'{count:,}' for count in counts)} points"
        raise MechanismError(Finding(what, "over", f"give at most {MOST_POINTS:,} in all"))
    return tuple(_swept(mechanism, name, path, over[name]) for path, name in paths.items())


def _swept(mechanism: Mechanism, name: str, path: str, sweep_values: Any) -> Swept:
    """A number with its values: SI, the unit of its measure, and the unit that they were written in."""
    ends = sweep_values[:2] if isinstance(sweep_values, tuple) else sweep_values
    read, measured, written, bare = list[float](), "", "", None
    for value in ends:
        value = value.item() if isinstance(value, np.generic) else value
        changed = mechanism.with_values({path: value})
        measured = measured or _unit_of(changed, path)
        if path not in changed.parameters():
            what = f"'{value}' is no number but changes with the motion"
            raise MechanismError(Finding(what, path, "sweep over a dimension in it"))
        read.append(float(changed.parameter_set.stated(path)))
        text = normalise(value).strip().removeprefix("-").strip() if isinstance(value, str) else ""
        literal = LITERAL.fullmatch(text)
        own_unit = (literal["unit"] or literal["per"] or "") if literal else ""
        written = written or own_unit
        if not own_unit and read[-1] and (literal or not text):
            bare = value if bare is None else bare
    if written and bare is not None:
        raise MechanismError(
            Finding(f"{bare} has no unit, and others have", name, f"write it with one, as {bare} {written}")
        )
    values = (
        np.linspace(read[0], read[1], int(sweep_values[2]))
        if isinstance(sweep_values, tuple)
        else np.array(read, float)
    )
    measured = measured or _unit_of(mechanism, path)  # plain numbers are in the unit of what they replace
    return Swept(name, path, measured, values, written, float(unit(written)[0]) if written else 1.0)


def _unit_of(mechanism: Mechanism, path: str) -> str:
    """SI unit of a number; of a dimension that is a plain number none, for its use alone tells."""
    kind = mechanism.parameter_kinds()[path]
    return "" if kind is ANY and path.startswith("dimensions.") else kind.unit


def say(swept: Sequence[Swept], index: Sequence[int]) -> str:
    """A point of the grid as equations."""
    return ", ".join(number.say(int(i)) for number, i in zip(swept, index, strict=True))


@contextmanager
def at_point(swept: Sequence[Swept], index: tuple[int, ...]) -> Iterator[None]:
    """What is wrong at a point of the grid says at which."""
    try:
        yield
    except MechanismError as error:
        where = say(swept, index)
        raise MechanismError(
            [replace(finding, what=f"{finding.what} (at {where})") for finding in error.findings]
        ) from None


# ---- figures --------------------------------------------------------------------------------------------------


def reduced(
    arrays: Mapping[str, NDArray[Any]],
    course: CycleCourse | None,
    ideal: Means | None,
    margin: CycleCourse | None,
    system: System,
) -> Reduced:
    """The figures of FIGURES of one cycle; numbers, or rows over drivers or joints.

    arrays: over positions, by the names of `results.VARIABLES`, the status among them; course: over the cycle, None
    where a position has no answer; ideal: means of the mechanism without errors, None if it has none; margin: that of
    the locking margin, if it was looked for.
    """
    status = arrays["status"]
    missing = int(np.count_nonzero(status >= Status.NOT_CONVERGED))
    figures: Reduced = {
        "status": int(np.max(status)),
        "without_answer": missing,
        "not_valid": int(np.count_nonzero(status == Status.CONTACT_LOST)),
    }
    if margin is not None:
        least, answered = least_margin(margin), np.all(status < Status.LOAD_UNDEFINED)
        figures["locking_margin"] = np.nan if not answered else np.inf if least is None else least.value
    if ideal:
        figures["efficiency_ideal"] = ideal.efficiency
    if missing or course is None or not np.any(course.sound):  # contact is lost everywhere
        return figures
    figures["status"] = max(figures["status"], int(np.max(course.status)))  # it may lock between two positions
    means = course.means
    joints, drivers = range(len(system.joints)), range(len(system.mechanism.drivers))
    if ideal:
        names = [f"joint_{'slide' if joint.pair.guided else 'rotation'}_error" for joint in system.joints.values()]
        figures["transmission_error_max"] = [
            _value(course.extreme(name, i, of=magnitude)) for i, name in enumerate(names)
        ]
    else:  # beside points with errors
        figures |= {"efficiency_ideal": means.efficiency, "transmission_error_max": 0.0}
    ends = [[_value(course.extreme("drive_effort", i, sign=sign)) for i in drivers] for sign in (-1.0, 1.0)]
    return figures | {
        "efficiency": means.efficiency,
        "efficiency_error": means.efficiency_error,
        "drive_effort_min": ends[0],
        "drive_effort_max": ends[1],
        "drive_effort_rms": means.drive_effort_rms,
        "drive_power_mean": means.drive_power_mean,
        "useful_power_mean": means.useful_power_mean,
        "friction_power_mean": means.friction_power.net,
        "reaction_max": [_value(course.extreme("reaction_force", i, of=magnitude)) for i in joints],
    }


def _value(place: Place | None) -> float:
    """An extreme; NaN where there is none."""
    return float("nan") if place is None else place.value


def measures_of(run: Run, names: Sequence[str]) -> list[Measure]:
    """Measures by their names, each with one figure a cycle; MechanismError with all that cannot be swept, and why."""
    measures = named(run.system.mechanism, names, run.values)
    findings = []
    for measure in measures:
        where = f"measures.{measure.name}"
        if measure.name in FIGURES:
            what = f"the measure '{measure.name}' has the name of a figure of the sweep"
            findings.append(Finding(what, where, "call it otherwise in the model"))
        elif measure.of.against or measure.of_attitude(run.system):
            what = f"the measure '{measure.name}' is a deviation from the nominal mechanism, and each point is its own"
            findings.append(
                Finding(what, where, "sweep another; see `trunnion tolerance` for the effect of tolerances on it")
            )
        elif measure.rule == "deviation":
            what = f"the measure '{measure.name}' has a number at every position and none of the cycle"
            findings.append(Finding(what, where, "state a position, at: 60 deg, or a statistic, as: maximum"))
    if findings:
        raise MechanismError(findings)
    return measures
