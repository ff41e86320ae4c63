"""The mechanism as its engineer states it: one immutable object, one-to-one with the model file."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from importlib import import_module
from typing import TYPE_CHECKING, Any, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from trunnion.algebra.namespace import Number
from trunnion.errors import Finding, MechanismError, Severity
from trunnion.joints.friction import FRICTION_LAWS
from trunnion.joints.motion import MotionLaw
from trunnion.model.arguments import strict_arguments
from trunnion.model.changes import assign, not_stated, with_law
from trunnion.model.checks.check import check_model
from trunnion.model.csv_table import TableFiles, place_findings, with_points
from trunnion.model.entry import ReadOnlyDict
from trunnion.model.findings import schema_findings
from trunnion.model.joint_parts import has_play, play
from trunnion.model.limits import DIGITS
from trunnion.model.merge import DEFAULT_LAW
from trunnion.model.names import nearest
from trunnion.model.parameters import Location, Numbers
from trunnion.model.parts import (
    Contact,
    Guide,
    Joint,
    Misalignment,
    Motor,
    Part,
    Pin,
    Seat,
    Variation,
)
from trunnion.model.tolerances import (
    FORMULA,
    Price,
    Tolerance,
    correlation,
    cost_paths,
    keep_limits,
    kept,
    prices,
    tolerated,
    with_samples,
    with_tolerances,
    written_limits,
)
from trunnion.model.units import Kind

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["Mechanism", "read_mechanism"]

# Parts of a joint whose numbers can be set before the file states them.
_JOINT_PARTS: Mapping[str, type[Part]] = {
    "pin": Pin,
    "guide": Guide,
    "contact": Contact,
    "misalignment": Misalignment,
    "seat": Seat,
}


@strict_arguments
class Mechanism(Numbers):
    """A linkage: dimensions, links, joints, drivers, loads. See the sections' classes in `model.parts`.

    Built from plain mappings, numbers (SI) and texts with units, or from the classes. A mechanism that exists is
    sound: whatever is wrong with it is raised as one MechanismError when it is built.
    """

    def __init__(self, **data: Any) -> None:
        """Validate and check; MechanismError with what is wrong: keys first, then names, then numbers."""
        try:
            super().__init__(**data)
        except ValidationError as error:
            raise MechanismError(schema_findings(error, Mechanism, data)) from None
        self.__dict__["checked"] = check_model(self)
        if findings := [finding for finding in self.checked if finding.severity is Severity.ERROR]:
            raise MechanismError(findings)

    @cached_property
    def checked(self) -> list[Finding]:
        """What the checks have found; of a mechanism that exists warnings and notes."""
        return check_model(self)

    @classmethod
    def model_validate(cls, obj: Any) -> Self:  # type: ignore[override]  # one way of reading
        """The mechanism of a mapping; MechanismError, as when built from keywords."""
        return obj if isinstance(obj, cls) else cls(**obj)

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """A copy, or the mechanism with some sections replaced, which is checked as any other; MechanismError."""
        if not update:
            return super().model_copy(deep=deep)
        names = {name: field.alias or name for name, field in type(self).model_fields.items()}
        return type(self)(**{names[name]: getattr(self, name) for name in self.model_fields_set} | dict(update))

    copy = model_copy  # type: ignore[assignment]  # pydantic's own goes past the checks

    @classmethod
    def read(cls, path: str | os.PathLike[str], tables: TableFiles | None = None) -> Mechanism:
        """The mechanism of a YAML, JSON or TOML file; MechanismError with file, line and remedy of every finding.

        tables: CSV files with the points of drivers and tables, by name, see `with_table`; they go before those that
        the model names.
        """
        from trunnion.model.file import read_model  # with ruamel.yaml

        return read_model(path, lambda data: cls(**data), tables)

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write the model as YAML or JSON, by extension; reading it again gives an equal mechanism."""
        from trunnion.model.file import write_model

        write_model(self.data(), path)

    def parameters(
        self, overrides: Mapping[str, Number] | None = None, deviations: Mapping[str, Number] | None = None
    ) -> dict[str, Number]:
        """Every number in SI by path, such as `links.crank.mass`.

        overrides: values by path or by an ending that is unique (`AB`, `crank.mass`): floats, arrays (sample, 1)
        or dual numbers; what depends on them follows. MechanismError names the nearest if a name is unknown.
        A load that is an expression of the motion is no number: it is there only if an override makes it one.
        Numbers with an error are as built, nominal and deviation; an override of such a number replaces the sum.
        deviations: what is added, by names as in overrides; a number that depends on others still follows them.
        """
        return self.parameter_set.evaluate(overrides, deviations)

    def ideal_parameters(self, overrides: Mapping[str, Number] | None = None) -> dict[str, Number]:
        """Every number as `parameters` gives it, without errors and with every axis where it belongs."""
        return self.parameter_set.ideal(overrides)

    @cached_property
    def worked_out(self) -> WorkedOut:
        """What others have worked out from it, by name, and keep as long as it lives: no part of its content."""
        return WorkedOut()

    @cached_property
    def seated(self) -> Mapping[str, Literal["loaded"] | Seat]:
        """How the pin lies in its hole, of every joint that has a play and a seat other than free."""
        return ReadOnlyDict(
            {
                name: joint.seat
                for name, joint in self.effective_joints.items()
                if joint.seat is not None and joint.seat != "free" and has_play(joint) and self._moves(name, joint)
            }
        )

    def _moves(self, name: str, joint: Joint) -> bool:
        """Whether a play is more than 0, across the axis or along it."""
        numbers = self.parameter_set.nominal
        return bool(play(joint, name, numbers) > 0 or numbers.get(f"joints.{name}.pin.end_float", 0.0) > 0)

    @cached_property
    def has_errors(self) -> bool:
        """Whether anything is off nominal: a number with an error, an axis, or a pin that does not lie centred."""
        numbers = self.parameter_set.nominal
        return bool(self.seated) or any(numbers[path] != 0 for path in self.parameter_set.errors)

    def parameter_kinds(self) -> dict[str, Kind]:
        """What each parameter measures, with its SI unit, by path."""
        return {path: entry.kind for path, entry in self.parameter_set.entries.items()}

    def tolerances(self) -> dict[str, tuple[float, float]]:
        """(lower, upper) signed deviations in SI of every parameter that states them, by path.

        A tolerance in `joint_defaults` is one of each joint that has it: the joints vary independently.
        """
        return written_limits(self)

    def tolerated(self) -> list[Tolerance]:
        """Every number that varies, in the order of `parameters`: those of `tolerances`, and those stated with ±."""
        return tolerated(self)

    def correlation(self) -> NDArray[np.float64]:
        """Correlation of the normal scores of the numbers of `tolerated`, in their order."""
        return correlation(self)

    def prices(self) -> list[Price]:
        """What tolerances and plays cost, by path, as stated in `costs`; in the order of the file."""
        return prices(self)

    def with_tolerances(self, half_widths: Mapping[str, float | str], digits: int = DIGITS) -> Mechanism:
        """The mechanism with other tolerances: half widths by name, each about the middle of its limits.

        A half width is in SI, or a text such as ±0.02 mm. The clearance of a joint, `joints.B.clearance`, is replaced
        itself. Limits that stand with the number, `40 mm ± 0.02 mm`, are changed there. digits: how many significant
        ones a half width is rounded down to. MechanismError for what is no half width.
        """
        return Mechanism(**with_tolerances(self, half_widths, digits))

    def with_samples(self, name: str, path: str | os.PathLike[str]) -> Mechanism:
        """The mechanism with a number that varies as measured: deviations in the one column of a CSV file.

        The unit stands in brackets in a header, `deviation [mm]`; without one they are SI. MechanismError with file
        and line of what cannot be read.
        """
        return Mechanism(**with_samples(self, name, path))

    def with_values(self, values: Mapping[str, float | str]) -> Mechanism:
        """The mechanism with some entries replaced, by names as in `parameters`; texts are read as in a file.

        So are the choices `over_constraint`, `fits`, `joint_defaults.friction.model`, `joint_defaults.seat` and the
        last two of a joint. Sizes, seat and misalignment of a joint, the error of a number and its tolerance, such as
        `tolerances.AB` or one key of it, `tolerances.AB.cp`, need not be stated yet, nor `at` and `over` of a measure.
        `measures.NAME.limit` is one text, and so is `measures.NAME.over`, such as "10 deg, 50 deg".
        """
        data = self.data()
        self._replace(values, data)
        return Mechanism(**data)

    def _replace(self, values: Mapping[str, float | str], data: dict[str, Any]) -> None:
        """Put values into plain data of this mechanism, or of one whose numbers have the same names."""
        for name, value in values.items():
            location = self._location(name)
            window = isinstance(value, str) and location[0] == "measures" and location[-1] == "over"
            put: Any = [end.strip() for end in str(value).strip("[] ").split(",")] if window else value
            assign(data, location, put, self.coordinates)
            keep_limits(self, name, value, data)

    def path_of(self, name: str) -> str:
        """The path of the number that a name means in `with_values`, stated or not; MechanismError if it means none."""
        try:
            return self.parameter_set.resolve(name)
        except MechanismError:
            entry = self._unstated(name)
            part = any(
                f".{name}." in f".{stated_path}" for stated_path in self.parameter_set.entries
            )  # of which some number is stated
            if not entry and not part and (path := not_stated(self, name)):
                remedy = "write it into the model file: then this name changes it"
                raise MechanismError(Finding(f"the model states no {path}", name, remedy)) from None
            if not entry:
                raise
            return entry[0]

    def _location(self, name: str) -> Location:
        """Where what a name means stands, or would stand; MechanismError if it means nothing."""
        choice = self._choice(name) or self._limits(name) or self._price(name)
        if choice:
            return choice
        entry = self.parameter_set.entries.get(self.path_of(name))
        if entry and entry.is_limit:
            remedy = f"set {entry.where}, as ±0.1 deg or +0.2/-0.1 deg"
            raise MechanismError(Finding("a limit is stated with the other", name, remedy))
        if entry:
            return entry.location
        unstated = self._unstated(name)
        assert unstated is not None  # or it would have no path
        return unstated[1]

    def _choice(self, name: str) -> Location | None:
        """Where a choice among words stands; None if the name is of a number."""
        if name in ("over_constraint", "fits"):
            return (name,)
        for choice in ("friction.model", "seat", "pin.fit"):
            holder = self._holder(name.removesuffix(f".{choice}")) if name.endswith(f".{choice}") else None
            if holder:
                return (*holder, *choice.split("."))
        return None

    def _limits(self, name: str) -> Location | None:
        """Where limits or place of a measure, limits or another key of a tolerance stand; None if not meant."""
        section, _, rest = name.partition(".")
        of, _, key = rest.rpartition(".")
        if section == "measures" and of in self.measures and key in ("limit", "at", "over"):
            return (section, of, key)
        if section != "tolerances":
            return None
        if key not in Variation.model_fields or not of:
            of, key = rest, "limits"
        try:
            path = self.parameter_set.resolve(of)
        except MechanismError as error:
            raise MechanismError([replace(item, where=name) for item in error.findings]) from None
        names = (item for item in self.variations if self.parameter_set.resolve(item) == path)
        of = next(names, of)
        short = key == "limits" and (of not in self.variations or self.variations[of].model_fields_set == {"limits"})
        return (section, of) if short else (section, of, key)

    def _price(self, name: str) -> Location | None:
        """Where a number of a cost stands, or would stand, by any name of what it is a cost of; None if not meant."""
        section, _, rest = name.partition(".")
        of, _, key = rest.rpartition(".")
        if section != "costs" or key not in (*FORMULA, "least", "most"):
            return None
        try:
            path = self.parameter_set.resolve(of)
        except MechanismError:
            path = ""
        names = [cost for cost in self.costs if cost == of or (path and path in cost_paths(self, cost))]
        return (section, names[0], key) if names else None

    def _unstated(self, name: str) -> tuple[str, Location] | None:
        """Path and place of the error of a number, or of a number of a joint, that the file may state and does not."""
        if name.startswith("errors."):
            named = name.removeprefix("errors.")
            try:
                return f"errors.{self.parameter_set.resolve(named)}", ("errors", named)
            except MechanismError as error:
                raise MechanismError([replace(finding, where=name) for finding in error.findings]) from None
        for part, kind in _JOINT_PARTS.items():
            before, middle, rest = name.rpartition(f".{part}.")
            holder = self._holder(before) if middle else None
            key, *below = rest.split(".")
            if (
                not holder
                or key not in kind.model_fields
                or (holder == ("joint_defaults",) and part in ("misalignment", "contact"))
            ):
                continue
            owner = before if before.startswith("joint") and before not in self.stated_joints else f"joints.{before}"
            path = f"{owner}.{part}.{rest}"
            if key == "direction" and below in (["x"], ["y"], ["z"]):
                return path, (*holder, part, key, "xyz".index(below[0]))
            return None if below or key in ("fit", "direction", "law") else (path, (*holder, part, key))
        before, middle, key = name.rpartition(".motor.")
        driver = before.removeprefix("drivers.")
        if middle and key in Motor.model_fields and driver in self.drivers and self.drivers[driver].motor is not None:
            return f"drivers.{driver}.motor.{key}", ("drivers", driver, "motor", key)
        if name == "joint_defaults.friction":  # as a file has it: a plain number is the coefficient
            name += ".coefficient"
        before, middle, key = name.rpartition(".friction.")
        if before == "joint_defaults" and key in FRICTION_LAWS[self._default_law].parameters:
            return name, (before, "friction", key)
        return None

    @property
    def _default_law(self) -> str:
        """The friction law of joints that state none."""
        friction = self.joint_defaults.friction
        return (friction and friction.law) or DEFAULT_LAW

    def _holder(self, name: str) -> Location | None:
        """Where `joint_defaults`, or a joint by its name or path, stands."""
        joint = name.removeprefix("joints.")
        if joint in self.stated_joints:
            return self._joint_location(joint)
        return ("joint_defaults",) if name == "joint_defaults" else None

    def _joint_location(self, joint: str) -> Location:
        rows = [row.joint for row in self.loop]
        return ("loop", rows.index(joint)) if joint in rows else ("joints", joint)

    def with_table(self, name: str, path: str | os.PathLike[str]) -> Mechanism:
        """The mechanism with the points of a driver or table replaced by the two columns of a CSV file.

        Time and coordinate of a driver, which gets the motion law `table` if it has another; place and value of a
        table. MechanismError with file and line of what cannot be read or makes no table.
        """
        data, read = with_points(self.data(), {name: path})
        try:
            return Mechanism(**kept(self, data))
        except MechanismError as error:
            raise MechanismError(place_findings(error.findings, read)) from None

    def with_friction(self, law: str, values: Mapping[str, float | str] | None = None) -> Mechanism:
        """The mechanism without friction ("off"), or with another law wherever there is friction.

        Parameters that the laws share are kept; MechanismError names those that the new law lacks.
        values: what else is replaced at the same time, as by `with_values`: parameters of the new law among it.
        """
        if law != "off" and law not in FRICTION_LAWS:
            remedy = nearest(law, [*FRICTION_LAWS, "off"])
            if law[:1].isdigit():
                remedy = f"a coefficient is set by joint_defaults.friction={law}, of one joint by NAME.friction={law}"
            raise MechanismError(Finding(f"'{law}' is not a friction law", remedy=remedy))
        if law == "off":
            changed = self.with_values(values) if values else self
            return Mechanism(**kept(changed, with_law(changed.data(), law)))
        data = with_law(self.data(), law)
        if values:
            # names are those of a mechanism that states all parameters of the law, as it does with the values
            Mechanism(**kept(self, with_law(self.data(), law, complete=True)))._replace(values, data)
        return Mechanism(**kept(self, data))

    def with_seats(self, seat: str) -> Mechanism:
        """The mechanism with one seating for all joints with play: "loaded" or "free"; MechanismError for another."""
        if seat not in ("loaded", "free"):
            what = f"'{seat}' is no seating of all joints"
            raise MechanismError(Finding(what, remedy="give loaded or free; state single seats in the model"))
        data = self.data()
        for holder in (*data.get("joints", {}).values(), *data.get("loop", [])):
            holder.pop("seat", None)
        return Mechanism(**kept(self, {**data, "joint_defaults": {**data.get("joint_defaults", {}), "seat": seat}}))

    def with_motions(self, laws: Mapping[str, MotionLaw]) -> Mechanism:
        """The mechanism whose drivers move as they were found to, by driver; its file and its digest stay the same."""
        drivers = {name: driver.moving(laws[name]) if name in laws else driver for name, driver in self.drivers.items()}
        copy = super().model_copy(update={"drivers": ReadOnlyDict(drivers)})
        copy.__dict__.pop("worked_out", None)
        return copy

    def plot(self) -> Figure:
        """The mechanism at its start as a matplotlib Figure, without loads and friction: bodies, joints, point curves.

        Lengths in m. Raises MechanismError if the structure does not determine the motion, or if no position of the
        cycle can be assembled.
        """
        return _notebook().mechanism_figure(self)  # type: ignore[no-any-return]

    def studio(self, height: int = 720) -> Any:
        """The studio on the mechanism, for a cell of a notebook; its `mechanism` is what was made of it there.

        height: of the cell, px. Raises MechanismError where the extra `notebook` is not installed.

        Examples
        --------
        In a notebook: `view = mechanism.studio()`, then `view`, and after dragging `view.mechanism`.
        """
        try:
            return import_module("trunnion.studio.widget").studio(self, height)
        except ImportError:
            what = "the studio of notebooks is not installed"
            raise MechanismError(Finding(what, remedy="pip install 'trunnion[notebook]'")) from None

    def __repr__(self) -> str:
        """One line; `data()` has all of it."""
        parts = f"{len(self.effective_links)} links, {len(self.effective_joints)} joints"
        return f"<Mechanism {self.name!r}, {self.space}: {parts}, {len(self.drivers)} drivers>"

    def __str__(self) -> str:
        """The same line: `print` shows no thousands of characters."""
        return repr(self)

    def _repr_html_(self) -> str:
        """What a notebook shows: drawing, structural formula, mobility, findings. Never raises."""
        return str(_notebook().mechanism_html(self))

    @cached_property
    def digest(self) -> str:
        """Hash of the content, 16 hexadecimal digits: equal mechanisms have equal digests."""
        data = self.model_dump(mode="json", by_alias=True)
        for measure in data["measures"].values():
            for key in [key for key, value in measure.items() if value is None and key not in HASHED]:
                del measure[key]
        for driver in data["drivers"].values():  # nor for those that analyses of a prescribed motion do not know
            for key in [key for key in ("free", "motor", "initial") if not driver[key]]:
                del driver[key]
        for spring in data["springs"].values():  # the hash of a spring is older than what may make it useful
            if not spring["useful"]:
                del spring["useful"]
        text = json.dumps(_canonical(data), sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:16]


# keys of a measure that count in the hash unset too: it is not to change with what a measure may be besides
HASHED = (
    *("point", "axis", "path_error", "straightness", "angle", "rotation", "slide", "transmission_error", "stroke"),
    *("dead_centre", "rate", "effort", "load", "reaction", "efficiency", "locking_margin"),
    *("at", "as", "over", "limit", "at_least", "at_most"),
)


class WorkedOut(dict[str, Any]):
    """What is worked out from a mechanism; a copy of that begins without, in this process or another."""

    def __deepcopy__(self, memo: Any) -> WorkedOut:
        return WorkedOut()

    def __reduce__(self) -> tuple[type[WorkedOut], tuple[()]]:
        return WorkedOut, ()


def _notebook() -> Any:
    """The views of a notebook, by name: they stand above the model, which knows nothing else of them."""
    return import_module("trunnion.views.notebook")


def _canonical(value: Any) -> Any:
    """Plain data with 1 and 1.0 alike."""
    if isinstance(value, dict):
        return {key: _canonical(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_canonical(item) for item in value]
    return float(value) if isinstance(value, int) and not isinstance(value, bool) else value


@strict_arguments
def read_mechanism(path: str | os.PathLike[str], tables: TableFiles | None = None) -> Mechanism:
    """The mechanism of a YAML, JSON or TOML file.

    tables: CSV files with the points of drivers and tables, by name; they go before those that the model names.
    Raises MechanismError with file, line, cause and remedy of every finding.
    """
    return Mechanism.read(path, tables)
