"""Which numbers of a mechanism vary, within which limits and how, and what that costs: `tolerances`, `costs` ….

A name is one that `--set` takes. One of `joint_defaults` means the number of each joint that has it; those vary
independently. A number that is stated with ± or by a fit varies too."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import combinations
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError
from trunnion.joints.fits import standard_tolerance
from trunnion.model.csv_table import column
from trunnion.model.parameters import Entry, Numbers, measured, walk
from trunnion.model.places import assign, stated_at
from trunnion.model.quantity import Quantity
from trunnion.model.tolerance_parts import DIGITS, DISTRIBUTIONS, Cost, Variation, half_width, limits_text, written
from trunnion.model.units import ANY, KINDS, UnitError, unit

DEFAULTS = "joint_defaults."
FULL_TURN = "direction"  # the distribution over all directions
FORMULA = ("A", "B", "k")


@dataclass(frozen=True)
class Tolerance:
    """A number that varies.

    path: of the number; nominal: its value as it stands, SI; lower, upper: signed deviations, SI; distribution: a key
    of DISTRIBUTIONS; options: what it was told, SI, as far as stated: cp, cpk, shift, mode, alpha, beta, values (a
    tuple); direction: path of the angle that goes with it, uniform over a full turn, or empty.
    """

    path: str
    nominal: float
    lower: float
    upper: float
    distribution: str = "normal"
    options: Mapping[str, float | tuple[float, ...]] = field(default_factory=dict)
    direction: str = ""

    @property
    def middle(self) -> float:
        """The middle of the limits."""
        return (self.lower + self.upper) / 2

    @property
    def half_width(self) -> float:
        """Half the distance of the limits."""
        return (self.upper - self.lower) / 2

    @property
    def can_be_chosen(self) -> bool:
        """Whether its limits are a choice: not where it varies as measured, or over a full turn."""
        return "values" not in self.options and self.distribution != FULL_TURN


@dataclass(frozen=True)
class ProcessChoice:
    """One way to make a dimension: its name (an IT grade as `IT7`), the half width that it keeps, SI, and its cost."""

    name: str
    tolerance: float
    cost: float


@dataclass(frozen=True)
class Price:
    """What the tolerance of one number costs, or the play of one joint.

    path: of the number, or `joints.B.clearance` of a play (`play` says so); model: a cost model, or empty where there
    are choices; parameters: A, B, k and unit, the half width that counts as 1, SI; least, most: bounds, SI; group:
    name of those that have one half width; choices: from the cheapest on.
    """

    path: str
    play: bool = False
    model: str = ""
    parameters: Mapping[str, float] = field(default_factory=dict)
    least: float = 0.0
    most: float = np.inf
    group: str = ""
    choices: tuple[ProcessChoice, ...] = ()


def may_vary(entry: Entry) -> bool:
    """Whether a number is one of the mechanism itself: not of its measures, nor of where it begins and ends."""
    outside = entry.path.partition(".")[0] in ("measures", "assembly")
    return not entry.varies and not outside and not ends_motion(entry.path)


def ends_motion(path: str) -> bool:
    """Whether a number says where a driver begins or ends: samples are compared at the same coordinates of it."""
    return path.startswith("drivers.") and path.split(".")[2:3] in (["start"], ["range"])


def towards(path: str, entries: Mapping[str, Entry]) -> str:
    """The angle of the direction in which a tilt or an offset of a misaligned axis points; empty for others."""
    before, _, key = path.rpartition(".misalignment.")
    angle = f"{before}.misalignment." + {"tilt": "towards", "offset": "offset_towards"}.get(key, "")
    return angle if angle in entries else ""


class Varying(Numbers):
    """A model whose numbers vary and whose tolerances cost something."""

    # ---- what names mean

    def named_paths(self, names: Iterable[str]) -> list[str]:
        """The paths that names mean, those of `joint_defaults` as the numbers of the joints; unknown ones left out."""
        numbers, paths = self.parameter_set, list[str]()
        for name in names:
            with suppress(MechanismError):
                path = numbers.resolve(name)
                all_joints = [entry.path for entry in numbers.entries.values() if entry.alias == path]
                paths += all_joints if path.startswith(DEFAULTS) else [path]
        return paths

    def clearance_of(self, name: str) -> str:
        """The path of the clearance that `joints.B.clearance` or `B.clearance` means, of pin or guide; empty if none.

        The play of a joint is meant, not a tolerance of the number that states it, which is `joints.B.pin.clearance`.
        """
        joint = name.removeprefix("joints.").removesuffix(".clearance")
        paths = [f"joints.{joint}.{part}.clearance" for part in ("pin", "guide")] if name.endswith(".clearance") else []
        return next((path for path in paths if path in self.parameter_set.entries), "")

    def cost_paths(self, name: str) -> list[str]:
        """The paths that a name in `costs` means: of numbers, or `joints.B.clearance`; none if it means nothing."""
        clearance = self.clearance_of(name)
        return [f"joints.{clearance.split('.')[1]}.clearance"] if clearance else self.named_paths([name])

    # ---- what varies

    @cached_property
    def variations_by_path(self) -> Mapping[str, tuple[str, Variation]]:
        """Name and entry of `tolerances` by path; what is stated of a joint goes before what is stated of all."""
        numbers = self.parameter_set
        single: dict[str, tuple[str, Variation]] = {}
        of_all: dict[str, tuple[str, Variation]] = {}
        for name, variation in self.variations.items():
            for path in self.named_paths([name]):
                if may_vary(numbers.entries[path]):
                    (single if numbers.resolve(name) == path else of_all).setdefault(path, (name, variation))
        return {**of_all, **single}

    def tolerances(self) -> dict[str, tuple[float, float]]:
        """(lower, upper) signed deviations in SI of every parameter that states them, by path.

        A tolerance in `joint_defaults` is one of each joint that has it: the joints vary independently.
        """
        entries = self.parameter_set.entries.values()
        return {entry.path: entry.quantity.tolerance for entry in entries
                if entry.quantity.tolerance and not entry.path.startswith(DEFAULTS)
                and (not entry.alias or entry.alias.startswith(DEFAULTS))}  # fmt: skip

    def tolerated(self) -> list[Tolerance]:
        """Every number that varies, in the order of `parameters`: those of `tolerances`, and those stated with ±.

        Defaults are for what the distribution takes and the entry does not say; a default cpk is that beside the
        default cp.
        """
        numbers, defaults, written_limits = self.parameter_set, self.tolerance_defaults, self.tolerances()
        value, varying = numbers.value, list[Tolerance]()
        for path, entry in numbers.entries.items():
            if path not in self.variations_by_path and not (path in written_limits and may_vary(entry)):
                continue
            variation = self.variations_by_path.get(path, ("", Variation()))[1]
            distribution = variation.distribution or defaults.distribution
            options: dict[str, float | tuple[float, ...]] = {}
            for key in DISTRIBUTIONS[distribution]:
                option = getattr(variation, key)
                if option is None and not (key == "cpk" and variation.cp is not None):
                    option = getattr(defaults, key, None)
                if option is not None:
                    options[key] = tuple(map(value, option)) if isinstance(option, tuple) else value(option)
            lower, upper = written_limits.get(path, (-np.pi, np.pi) if distribution == FULL_TURN else (np.nan, np.nan))
            if variation.limits is not None:
                lower, upper = value(variation.limits.lower), value(variation.limits.upper)
            elif path not in written_limits and isinstance(sample := options.get("values"), tuple):
                lower, upper = min(sample), max(sample)
            direction = towards(path, numbers.entries) if variation.direction else ""
            nominal = float(numbers.nominal[path])
            varying.append(Tolerance(path, nominal, lower, upper, distribution, options, direction))
        return varying

    def correlation(self) -> NDArray[np.float64]:
        """Correlation of the normal scores of the numbers of `tolerated`, in their order."""
        place = {tolerance.path: index for index, tolerance in enumerate(self.tolerated())}
        matrix = np.eye(len(place))
        for pair in self.correlations:
            paths = [path for path in self.named_paths(pair.of) if path in place]
            value = self.parameter_set.value(pair.coefficient)
            for first, other in combinations(dict.fromkeys(paths), 2):
                matrix[place[first], place[other]] = matrix[place[other], place[first]] = value
        return matrix

    @cached_property
    def further_entries(self) -> tuple[Entry, ...]:
        """Every quantity of the sections about tolerances and costs: what is no number of the mechanism itself.

        What may be any quantity measures what the number does that the entry is of, of a cost of a play a length.
        """
        kinds, listed = measured(self, self.entries), list[Entry]()
        for key in ("tolerance_defaults", "tolerances", "correlations", "costs", "processes"):
            section = getattr(self, "variations" if key == "tolerances" else key)
            for name, part in section.items() if isinstance(section, Mapping) else [("", section)]:
                kind = KINDS["length"] if key == "costs" else ANY
                if key in ("tolerances", "costs"):
                    with suppress(MechanismError):  # a finding of its own
                        kind = kinds[self.parameter_names.resolve(name)]
                for entry in walk(part, f"{key}.{name}".rstrip("."), (key, name) if name else (key,)):
                    listed.append(replace(entry, kind=kind) if entry.kind is ANY else entry)
        return tuple(listed)

    # ---- what it costs

    def prices(self) -> list[Price]:
        """What tolerances and plays cost, by path, in the order of the file; of `joint_defaults` one of each joint.

        What varies as measured or over a full turn has no tolerance to choose, and no price.
        """
        fixed = {tolerance.path for tolerance in self.tolerated() if not tolerance.can_be_chosen}
        paths = [(path, cost) for name, cost in self.costs.items() for path in self.cost_paths(name)]
        return [self.price(path, cost) for path, cost in paths if path not in fixed]

    def price(self, path: str, cost: Cost) -> Price:
        """The numbers of a cost of a number or play; MechanismError where a process has no grade of its size."""
        numbers, value = self.parameter_set, self.parameter_set.value
        parameters = {key: value(getattr(cost, key)) for key in FORMULA if getattr(cost, key) is not None}
        if cost.model:
            parameters = {"A": 0.0, **parameters, "unit": float(unit(cost.unit)[0]) if cost.unit else 1.0}
        ways = (cost.options or {}).items()
        choices = [ProcessChoice(name, value(way.tolerance), value(way.cost)) for name, way in ways]
        for grade, paid in self.processes[cost.process].items() if cost.process else ():
            half = standard_tolerance(abs(float(numbers.nominal[path])), int(grade)) / 2
            choices.append(ProcessChoice(f"IT{grade}", half, value(paid)))
        choices.sort(key=lambda choice: (choice.cost, choice.tolerance))
        least, most, play = value(cost.least), value(cost.most, np.inf), path not in numbers.entries
        return Price(path, play, cost.model or "", parameters, least, most, cost.group or "", tuple(choices))

    # ---- other tolerances

    def with_tolerances(self, half_widths: Mapping[str, float | str], digits: int = DIGITS) -> Self:
        """The mechanism with other tolerances: half widths by name, each about the middle of its limits.

        A half width is in SI, or a text such as ±0.02 mm. The clearance of a joint, `joints.B.clearance`, is replaced
        itself. Limits that stand with the number, `40 mm ± 0.02 mm`, move to `tolerances`. digits: how many
        significant ones a half width is rounded down to. MechanismError for what is no half width.
        """
        numbers, data = self.parameter_set, self.data()
        kinds = measured(self, numbers.entries.values())
        tolerances = {item.path: item for item in self.tolerated()}
        findings: list[Finding] = []
        for name, stated in half_widths.items():
            play = self.clearance_of(name)
            path = play or numbers.resolve(name)
            tolerance, kind, entry = tolerances.get(path), kinds[path], numbers.entries[path]
            if not play and (tolerance is None or not tolerance.can_be_chosen):
                what = "has no tolerance" if tolerance is None else "varies as measured or over a full turn"
                remedy = "state limits in tolerances: {…}"
                findings.append(Finding(f"'{name}' {what}, none can be replaced", remedy=remedy))
                continue
            try:
                half = half_width(stated, kind, name)
            except MechanismError as error:
                findings += error.findings
                continue
            if play or tolerance is None:
                text = written(half, kind, digits)
                assign(data, entry.location, text, self.coordinates)
                self.keep_limits(play, text, data)
            else:
                self._vary(data, path, {"limits": limits_text(tolerance.middle, half, kind, digits)})
                if entry.quantity.tolerance and stated_at(data, entry.location) == entry.quantity.source:
                    assign(data, entry.location, entry.quantity.alone, self.coordinates)  # its limits stand there now
        if findings:
            raise MechanismError(findings)
        return type(self)(**data)

    def with_samples(self, name: str, path: str | os.PathLike[str]) -> Self:
        """The mechanism with a number that varies as measured: deviations in the one column of a CSV file.

        The unit stands in brackets in a header, `deviation [mm]`; without one they are SI. Limits stated are kept.
        MechanismError with file and line of what cannot be read.
        """
        target, data = self.parameter_set.resolve(name), self.data()
        deviations = column(Path(path), measured(self, self.entries)[target])
        self._vary(data, target, {"distribution": "sample", "values": deviations}, beside=("limits",))
        return type(self)(**data)

    def _vary(
        self, data: dict[str, Any], path: str, keys: Mapping[str, Any], beside: Iterable[str] = Variation.model_fields
    ) -> None:
        """Put keys into the entry of `tolerances` of a number, of this joint alone where it is of all joints.

        beside: which of its other keys stay.
        """
        section = data.setdefault("tolerances", {})
        name = self.variations_by_path.get(path, (path,))[0]
        stated = section.get(name, {})
        others = stated if isinstance(stated, dict) else {"limits": stated}
        entry = {**{key: value for key, value in others.items() if key in beside}, **keys}
        own_name = name if self.parameter_set.resolve(name) == path else path
        section[own_name] = entry["limits"] if entry.keys() == {"limits"} else entry

    def keep_limits(self, name: str, value: Any, data: dict[str, Any]) -> None:
        """Write the limits that stood with a number, as in `40 mm ± 0.02 mm`, into `tolerances` where it is replaced by
        one without: another nominal value is no other tolerance.
        """
        try:
            entry = self.parameter_set.entries[self.parameter_set.resolve(name)]
            again = Quantity.read(value, entry.kind).tolerance is not None
        except (MechanismError, UnitError):  # no number, or a finding of its own
            return
        follows = entry.alias and not entry.alias.startswith(DEFAULTS)
        if again or entry.quantity.tolerance is None or follows or not may_vary(entry):
            return
        lower, upper = entry.quantity.tolerance
        if self.variations_by_path.get(entry.path, ("", Variation()))[1].limits is None:
            kind = measured(self, self.entries)[entry.path]
            self._vary(data, entry.path, {"limits": limits_text((lower + upper) / 2, (upper - lower) / 2, kind)})

    def kept(self, data: Mapping[str, Any]) -> dict[str, Any]:
        """Plain data made of that of this mechanism, without errors, tolerances and costs of numbers it no longer has.

        So a mechanism without friction has no tolerance of a coefficient. MechanismError if they make no mechanism.
        """
        named = [key for key in ("errors", "tolerances", "costs") if data.get(key)]
        if not named:
            return dict(data)
        bare = {key: value for key, value in data.items() if key not in (*named, "correlations", "processes")}
        other = type(self)(**bare)

        def has(name: str) -> bool:
            with suppress(MechanismError):
                return bool(other.clearance_of(name) or other.parameter_set.resolve(name.removeprefix("errors.")))
            return False

        rest: dict[str, Any] = {key: {name: item for name, item in data[key].items() if has(name)} for key in named}
        if "correlations" in data:
            rows = [(row, [name for name in row["of"] if has(name)]) for row in data["correlations"]]
            rest["correlations"] = [{**row, "of": of} for row, of in rows if of == row["of"] or len(of) > 1]
        return {**data, **rest}
