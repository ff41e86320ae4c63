"""The grid of a sweep: which numbers of a mechanism take which values, in the units they were given in."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError
from trunnion.model.expression import LITERAL
from trunnion.model.mechanism import Mechanism
from trunnion.model.units import Dimension, normalise, si_unit, unit
from trunnion.studies.sweep.figures import FIGURES

__all__ = ["MOST_NAMES", "MOST_POINTS", "Over", "Swept", "grid", "named", "say"]

MOST_POINTS = 100_000
MOST_NAMES = 6
SUBJECTS = ("driver", "joint")  # the dimensions that are not swept

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
            raise MechanismError(Finding("has no values", name, remedy))
        return len(values)
    count = values[-1] if len(values) == 3 else None
    if not isinstance(count, (int, np.integer)) or isinstance(count, bool):
        raise MechanismError(Finding(f"{values} is not from, to and count", name, remedy))
    if count < 2:
        what = f"a range of {count} value{'s' * (count != 1)} has no two ends"
        raise MechanismError(Finding(what, name, "give a count of 2 or more, or a single value"))
    return int(count)


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
    """SI unit of a number; of a dimension, as its value tells."""
    dimensions: dict[str, Dimension | None] = {}
    for other, entry in mechanism.parameter_set.entries.items():  # dimensions first, in order of evaluation
        if other.startswith("dimensions."):
            dimensions[other.removeprefix("dimensions.")] = entry.quantity.check(dimensions)
    name = path.removeprefix("dimensions.")
    is_dimension = name in dimensions and name != path
    return si_unit(dimensions[name]) if is_dimension else mechanism.parameter_set.entries[path].kind.unit


def say(swept: Sequence[Swept], index: Sequence[int]) -> str:
    return ", ".join(number.say(int(i)) for number, i in zip(swept, index, strict=True))


@contextmanager
def named(swept: Sequence[Swept], index: tuple[int, ...]) -> Iterator[None]:
    """What is wrong at a point of the grid says at which."""
    try:
        yield
    except MechanismError as error:
        where = say(swept, index)
        raise MechanismError(
            [replace(finding, what=f"{finding.what} (at {where})") for finding in error.findings]
        ) from None
