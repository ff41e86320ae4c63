"""How the figures of a cycle change with one or two of the mechanism's numbers.

Every point of the grid is a mechanism of its own, prepared and run as `analyse` does; its cycle comes to one number of
each of FIGURES. A point with a position without an answer has no figures of the cycle but its status, and the
efficiency of the ideal mechanism if that has an answer everywhere.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trunnion import __version__
from trunnion.analysis.account import (
    efficiency,
    effort_units,
    finding_row,
    model_notes,
    references,
    sound_positions,
)
from trunnion.analysis.analyse import Run, check_steps, positions, prepare
from trunnion.analysis.friction import FrictionMethod
from trunnion.errors import Finding, MechanismError, Severity, Status
from trunnion.model.expression import LITERAL, normalise
from trunnion.model.mechanism import Mechanism
from trunnion.model.units import Dimension, si_unit, unit

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["FIGURES", "MOST_POINTS", "Figure", "Swept", "sweep"]

MOST_POINTS = 100_000
MOST_NAMES = 6

Values = Sequence[float | str] | NDArray[np.float64]
Over = Mapping[str, Values | tuple[float | str, float | str, int]]


@dataclass(frozen=True)
class Figure:
    """A number of a cycle: dimensions before the swept names, unit, long name; part: "errors" of those that only
    mechanisms with errors have.
    """

    dims: tuple[str, ...]
    units: str
    long_name: str
    part: str = ""


FIGURES: dict[str, Figure] = {
    "efficiency": Figure((), "1", "useful work over drive work of the cycle"),
    "efficiency_ideal": Figure((), "1", "efficiency of the mechanism without errors", "errors"),
    "drive_effort_min": Figure(("driver",), "N m", "least drive effort"),
    "drive_effort_max": Figure(("driver",), "N m", "largest drive effort"),
    "drive_effort_rms": Figure(("driver",), "N m", "root mean square of the drive effort"),
    "drive_power_mean": Figure((), "W", "mean power of all drivers"),
    "useful_power_mean": Figure((), "W", "mean power taken by the useful loads"),
    "friction_power_mean": Figure((), "W", "mean power lost to friction"),
    "reaction_max": Figure(("joint",), "N", "largest reaction"),
    "transmission_error_max": Figure(
        ("joint",), "rad", "largest error of the joint's rotation, of a prismatic joint its slide", "errors"
    ),
    "locking_margin": Figure((), "1", "least multiple of the friction at which a position locks, ∞ if beyond 10"),
    "without_answer": Figure((), "1", "positions without an answer"),
    "status": Figure((), "1", "code of the gravest status of a position; see the attribute flag_meanings"),
}
INTEGERS = {"status": np.int8, "without_answer": np.int32}
SUBJECTS = ("driver", "joint")  # the dimensions that are not swept


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

    def say(self, index: int) -> str:
        """The value at an index as an equation, in the unit it was given in."""
        shown = (self.written or self.unit).removeprefix("1")
        return f"{self.name} = {self.values[index] / self.factor + 0.0:.6g} {shown}".rstrip()


def sweep(
    mechanism: Mechanism,
    over: Over,
    steps: int = 360,
    method: FrictionMethod | None = None,
    progress: Callable[[int], None] | None = None,
) -> xr.Dataset:
    """Figures of the cycle over a grid of one or two numbers of the mechanism.

    over: by name, as for `Mechanism.with_values` (a path or an ending that is unique), a list of values, or from, to
    and count: `{"misalignment": ("0 deg", "30 deg", 7), "input.speed": [50, 100]}`; plain numbers are SI.
    Returns a Dataset with a dimension for each name, last, its coordinate in SI, and the variables of `FIGURES`. Where
    any position of the cycle has no answer they are NaN, but for the locking margin of positions that lock: `status`
    and `without_answer` tell. Extremes leave out what `analyse` leaves out of its summary: positions with a relative
    speed of zero or close to a dead centre, unless there are no others.
    progress: called with the number of points done.
    Raises MechanismError for a name that is unknown or stands for several numbers, values that the model refuses (at
    any point), none or more than MOST_POINTS of them, or a structure that does not determine the motion.
    """
    check_steps(steps)
    swept = _grid(mechanism, over)
    shape = tuple(len(one.values) for one in swept)
    labels: dict[str, list[str]] = {
        "driver": list(mechanism.drivers),
        "joint": list(mechanism.effective_joints),
    }
    arrays = {
        name: np.full((*(len(labels[dim]) for dim in one.dims), *shape), 0 if name in INTEGERS else np.nan,
                      INTEGERS.get(name, np.float64))
        for name, one in FIGURES.items()
    }  # fmt: skip
    said: dict[tuple[str, str], list[Finding]] = {}
    method = method or FrictionMethod()
    run: Run | None = None
    erring = False
    for done, index in enumerate(np.ndindex(shape), 1):
        with _named(swept, index):
            run = prepare(mechanism.with_values(_at(swept, index)))
            if run.determinacy is not None:
                run.determinacy.refuse()
            erring = erring or run.erring
            for name, value in figures(run, steps, method).items():
                arrays[name][(Ellipsis, *index)] = value
            for finding in _model_findings(run):
                said.setdefault((finding.where, finding.what), []).append(finding)
        if progress:
            progress(done)
    assert run is not None  # a grid has a point
    found = [*_answers(swept, arrays), *_shared(said, int(np.prod(shape)))]
    arrays = {name: array for name, array in arrays.items() if erring or not FIGURES[name].part}
    return _dataset(mechanism, run, swept, labels, arrays, found, steps, method)


def figures(run: Run, steps: int, method: FrictionMethod) -> dict[str, Any]:
    """The figures of FIGURES of one prepared mechanism; numbers, or rows over drivers or joints."""
    found = positions(run, steps, method)
    arrays, cycle = found.arrays, run.cycle
    status = arrays["status"]
    missing = int(np.count_nonzero(status >= Status.NOT_CONVERGED))
    told: dict[str, Any] = {
        "locking_margin": float(np.min(arrays["locking_margin"])),
        "status": int(np.max(status)),
        "without_answer": missing,
    }
    if found.ideal:
        told["efficiency_ideal"] = efficiency(found.ideal, cycle)
    if missing:
        return told
    sound = sound_positions(status)
    kept = sound if len(sound) else np.arange(len(status))
    effort = arrays["drive_effort"]
    size = np.sqrt(np.sum(arrays["reaction_force"] ** 2, axis=1))
    if found.ideal:
        turned, slid = (np.abs(arrays[f"joint_{what}_error"][:, kept]) for what in ("rotation", "slide"))
        slides = np.array([kind == "prismatic" for kind, _ in run.system.joints.values()])
        told["transmission_error_max"] = np.where(slides, np.max(slid, axis=1), np.max(turned, axis=1))
    else:  # beside points with errors
        told |= {"efficiency_ideal": efficiency(arrays, cycle), "transmission_error_max": 0.0}
    return told | {
        "efficiency": efficiency(arrays, cycle),
        "drive_effort_min": np.min(effort[:, kept], axis=1),
        "drive_effort_max": np.max(effort[:, kept], axis=1),
        "drive_effort_rms": [float(np.sqrt(cycle.mean(row**2))) for row in effort],
        "drive_power_mean": cycle.mean(np.sum(arrays["drive_power"], axis=0)),
        "useful_power_mean": cycle.mean(arrays["useful_power"]),
        "friction_power_mean": cycle.mean(np.sum(arrays["friction_power"], axis=0)),
        "reaction_max": np.max(size[:, kept], axis=1),
    }


# ---- the grid -------------------------------------------------------------------------------------------------


def _grid(mechanism: Mechanism, over: Over) -> tuple[Swept, ...]:
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
    counts = [_count(name, values) for name, values in over.items()]
    points = int(np.prod(counts, dtype=object))
    if points > MOST_POINTS:
        what = f"a grid of {' × '.join(f'{count:,}' for count in counts)} points"
        raise MechanismError(Finding(what, "over", f"give at most {MOST_POINTS:,} in all"))
    return tuple(_swept(mechanism, name, path, over[name]) for path, name in paths.items())


def _count(name: str, values: Any) -> int:
    """How many values there are of a name; MechanismError if that is none."""
    remedy = "give a list of values, or from, to and count such as 0deg:30deg:7"
    if isinstance(values, str) or not isinstance(values, (Sequence, np.ndarray)) or np.ndim(values) > 1:
        raise MechanismError(Finding(f"'{values}' is no range and no list of values", name, remedy))
    if not isinstance(values, tuple):
        if not len(values):
            raise MechanismError(Finding("has no values to take", name, remedy))
        return len(values)
    count = values[-1] if len(values) == 3 else None
    if not isinstance(count, (int, np.integer)) or isinstance(count, bool):
        raise MechanismError(Finding(f"{values} is not from, to and count", name, remedy))
    if count < 2:
        what = f"a range of {count} value{'s' * (count != 1)} has no two ends"
        raise MechanismError(Finding(what, name, "give a count of 2 or more, or a single value"))
    return int(count)


@dataclass(frozen=True)
class _Value:
    """A value as read: in SI; the number and the unit it was written in, if it is nothing but these."""

    si: float
    number: Fraction
    unit: str
    plain: bool


def _swept(mechanism: Mechanism, name: str, path: str, given: Any) -> Swept:
    ends = given[:2] if isinstance(given, tuple) else given
    read, measured = [], ""
    for value in ends:
        value = value.item() if isinstance(value, np.generic) else value
        with_it = mechanism.with_values({path: value})
        measured = measured or _unit_of(with_it, path)
        read.append(_read(with_it, path, value))
    measured = measured or _unit_of(mechanism, path)  # plain numbers are in the unit of what they replace
    written = next((one.unit for one in read if one.unit), "")
    bare = next((value for one, value in zip(read, ends, strict=True) if one.plain and one.si), None)
    if written and bare is not None:
        raise MechanismError(
            Finding(f"{bare} has no unit, and others have", name, f"write it with one, as {bare} {written}")
        )
    factor = unit(written)[0] if written else Fraction(1)
    values = [one.si for one in read]
    if isinstance(given, tuple):
        count = int(given[2])
        exact = all(one.unit == written or not one.number for one in read)
        low, high = (one.number if exact else Fraction(one.si) / factor for one in read)
        # exact until rounded once, so that a point is the same float as when its value is written in a file
        between = (float((low * (count - 1 - k) + high * k) / (count - 1) * factor) for k in range(1, count - 1))
        values = [values[0], *between, values[1]]
    return Swept(name, path, measured, np.array(values, float), written, float(factor))


def _read(changed: Mechanism, path: str, value: float | str) -> _Value:
    """A value that the mechanism took, as it was written."""
    if path not in changed.parameters():
        what = f"'{value}' is no number but changes with the motion"
        raise MechanismError(Finding(what, path, "sweep over a dimension in it"))
    si = float(changed.parameter_set.stated(path))
    text = normalise(value).strip() if isinstance(value, str) else ""
    literal = LITERAL.fullmatch(text.removeprefix("-").strip())
    if not literal:
        return _Value(si, Fraction(si), "", not text)
    number = Fraction(literal["number"]) * (-1 if text.startswith("-") else 1)
    return _Value(si, number, literal["unit"] or literal["per"] or "", not (literal["unit"] or literal["per"]))


def _unit_of(mechanism: Mechanism, path: str) -> str:
    """SI unit of a number; of a dimension, as its value tells."""
    known: dict[str, Dimension | None] = {}
    for one, entry in mechanism.parameter_set.entries.items():  # dimensions first, in order of evaluation
        if one.startswith("dimensions."):
            known[one.removeprefix("dimensions.")] = entry.quantity.check(known)
    name = path.removeprefix("dimensions.")
    return si_unit(known[name]) if name in known and name != path else mechanism.parameter_set.entries[path].kind.unit


def _at(swept: Sequence[Swept], index: tuple[int, ...]) -> dict[str, float | str]:
    return {one.path: float(one.values[i]) for one, i in zip(swept, index, strict=True)}


def _say(swept: Sequence[Swept], index: Sequence[int]) -> str:
    return ", ".join(one.say(int(i)) for one, i in zip(swept, index, strict=True))


@contextmanager
def _named(swept: Sequence[Swept], index: tuple[int, ...]) -> Iterator[None]:
    """What is wrong at a point of the grid says at which."""
    try:
        yield
    except MechanismError as error:
        where = _say(swept, index)
        raise MechanismError([replace(one, what=f"{one.what} (at {where})") for one in error.findings]) from None


# ---- what there is to say -------------------------------------------------------------------------------------


def _model_findings(run: Run) -> Iterator[Finding]:
    yield from model_notes(run.system.mechanism, run.system)
    yield from run.chosen.findings
    if run.determinacy is not None:
        yield from run.determinacy.findings()


def _shared(said: Mapping[tuple[str, str], list[Finding]], points: int) -> Iterator[Finding]:
    """What the points have to say, each once; notes only if all have them."""
    for found in said.values():
        one, count = found[0], len(found)
        if count == points:
            yield one
        elif one.severity is not Severity.NOTE:
            yield replace(one, what=f"{one.what} (at {count:,} of {points:,} points)")


def _answers(swept: Sequence[Swept], arrays: Mapping[str, NDArray[Any]]) -> Iterator[Finding]:
    """An error for every status that leaves points without figures."""
    status, missing = arrays["status"], arrays["without_answer"]
    for code in Status:
        where = np.argwhere(status == code)
        if code.solved or not len(where):
            continue
        first = tuple(int(i) for i in where[0])
        count = int(missing[first])
        some_positions = f"{count:,} position{'s' * (count != 1)} without an answer"
        some = f"{len(where):,} of {status.size:,} points have no figures"
        what = f"{some}, first at {_say(swept, first)} ({some_positions}): {code.text}"
        names = " and ".join(one.name for one in swept)
        yield Finding(what, names, "run analyse with these values: it says where in the cycle, and why")


# ---- the result -----------------------------------------------------------------------------------------------


def _dataset(
    mechanism: Mechanism,
    run: Run,
    swept: Sequence[Swept],
    labels: Mapping[str, Sequence[str]],
    arrays: Mapping[str, NDArray[Any]],
    findings: Sequence[Finding],
    steps: int,
    method: FrictionMethod,
) -> xr.Dataset:
    import xarray as xr

    names = tuple(one.name for one in swept)
    variables = {
        name: xr.Variable((*FIGURES[name].dims, *names), array,
                          {"units": FIGURES[name].units, "long_name": FIGURES[name].long_name})
        for name, array in arrays.items()
    }  # fmt: skip
    if "transmission_error_max" in variables:
        units = ["m" if kind == "prismatic" else "rad" for kind, _ in run.system.joints.values()]
        variables["transmission_error_max"].attrs["member_units"] = json.dumps(units)
    coordinates = {
        one.name: xr.Variable(one.name, one.values, {
            "units": one.unit, "long_name": one.path, "written_unit": one.written, "written_factor": one.factor,
        })
        for one in swept
    }  # fmt: skip
    told = {dim: (dim, np.asarray(members, dtype=str)) for dim, members in labels.items()}
    attributes: dict[str, str | int] = {
        "name": mechanism.name,
        "formula": run.system.plan.formula,
        "swept": json.dumps(names, ensure_ascii=False),
        "steps": steps,
        "model_hash": mechanism.digest,
        "trunnion_version": __version__,
        "method": method.name,
        "references": "\n".join(references(mechanism)),
        "flag_values": " ".join(str(int(code)) for code in Status),
        "flag_meanings": " ".join(code.name.lower() for code in Status),
        "driver_units": json.dumps(effort_units(run.system)),
        "findings": json.dumps([finding_row(finding) for finding in findings], ensure_ascii=False),
    }
    return xr.Dataset(variables, {**told, **coordinates}, attributes)
