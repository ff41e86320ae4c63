"""The mechanism as its engineer states it: one immutable object, one-to-one with the model file."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cached_property
from importlib import import_module
from typing import TYPE_CHECKING, Any, Literal, Self, get_args, get_origin

from pydantic import BaseModel, ValidationError

from trunnion.algebra.namespace import Number
from trunnion.errors import Finding, MechanismError, Severity
from trunnion.joints.friction import FRICTION_LAWS
from trunnion.joints.motion import MotionLaw
from trunnion.model.arguments import strict_arguments
from trunnion.model.checks.check import check_model
from trunnion.model.csv_table import TableFiles, place_findings, with_points
from trunnion.model.entry import ReadOnlyDict
from trunnion.model.joint_parts import Seat, has_play, play
from trunnion.model.names import nearest
from trunnion.model.parameters import Location, measured
from trunnion.model.places import assign, fields_at, schema_findings, stated_at, with_law
from trunnion.model.quantity import Quantity
from trunnion.model.tolerance_parts import Cost, Variation
from trunnion.model.tolerances import Varying
from trunnion.model.units import Kind

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@strict_arguments
class Mechanism(Varying):
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
        """How the pin lies in its hole, of every joint that has a play above 0 and a seat other than free."""
        numbers = self.parameter_set.nominal
        return ReadOnlyDict(
            {
                name: joint.seat
                for name, joint in self.effective_joints.items()
                if joint.seat is not None and joint.seat != "free" and has_play(joint)
                and (play(joint, name, numbers) > 0 or numbers.get(f"joints.{name}.pin.end_float", 0.0) > 0)
            }
        )  # fmt: skip

    @cached_property
    def has_errors(self) -> bool:
        """Whether anything is off nominal: a number with an error, an axis, or a pin that does not lie centred."""
        numbers = self.parameter_set.nominal
        return bool(self.seated) or any(numbers[path] != 0 for path in self.parameter_set.errors)

    def parameter_kinds(self) -> dict[str, Kind]:
        """What each parameter measures, with its SI unit, by path; of a dimension, as far as its value tells."""
        return measured(self, self.parameter_set.entries.values())

    def with_values(self, values: Mapping[str, float | str]) -> Mechanism:
        """The mechanism with some entries replaced, by names as in `parameters`; texts are read as in a file.

        A name may be that of any key that the file may state, stated or not: `fits`, `joint_defaults.seat`,
        `B.pin.clearance`, `A.motor.limit`, `errors.AB`, `tolerances.AB` or one key of it, `tolerances.AB.cp`.
        `measures.NAME.limit` is one text, and so is `measures.NAME.over`, such as "10 deg, 50 deg".
        """
        data = self.data()
        self._replace(values, data)
        return Mechanism(**data)

    def _replace(self, values: Mapping[str, float | str], data: dict[str, Any]) -> None:
        """Put values into plain data of this mechanism, or of one whose numbers have the same names."""
        for name, value in values.items():
            _, location = place_of(self, name)
            window = isinstance(value, str) and location[0] == "measures" and location[-1] == "over"
            put: Any = [end.strip() for end in str(value).strip("[] ").split(",")] if window else value
            assign(data, location, put, self.coordinates)
            self.keep_limits(name, value, data)

    def path_of(self, name: str) -> str:
        """The path of the number that a name means in `with_values`, stated or not; MechanismError if it means none."""
        return place_of(self, name)[0] or self.parameter_set.resolve(name)

    def with_table(self, name: str, path: str | os.PathLike[str]) -> Mechanism:
        """The mechanism with the points of a driver or table replaced by the two columns of a CSV file.

        Time and coordinate of a driver, which gets the motion law `table` if it has another; place and value of a
        table. MechanismError with file and line of what cannot be read or makes no table.
        """
        data, read = with_points(self.data(), {name: path})
        try:
            return Mechanism(**self.kept(data))
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
            return Mechanism(**changed.kept(with_law(changed.data(), law)))
        data = with_law(self.data(), law)
        self._replace(values or {}, data)
        return Mechanism(**self.kept(data))

    def with_seats(self, seat: str) -> Mechanism:
        """The mechanism with one seating for all joints with play: "loaded" or "free"; MechanismError for another."""
        if seat not in ("loaded", "free"):
            what = f"'{seat}' is no seating of all joints"
            raise MechanismError(Finding(what, remedy="give loaded or free; state single seats in the model"))
        data = self.data()
        for holder in (*data.get("joints", {}).values(), *data.get("loop", [])):
            holder.pop("seat", None)
        return Mechanism(**self.kept({**data, "joint_defaults": {**data.get("joint_defaults", {}), "seat": seat}}))

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
        views = import_module("trunnion.views.shown")  # by name: it stands above the model
        return views.mechanism_figure(self)  # type: ignore[no-any-return]

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

    __str__ = __repr__  # `print` shows no thousands of characters

    def _repr_html_(self) -> str:
        """What a notebook shows: drawing, structural formula, mobility, findings. Never raises."""
        return str(import_module("trunnion.views.shown").mechanism_html(self))

    @cached_property
    def digest(self) -> str:
        """Hash of the content, 16 hexadecimal digits: equal mechanisms have equal digests."""
        data = self.model_dump(mode="json", by_alias=True, exclude_defaults=True)
        text = json.dumps(_canonical(data), sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:16]


class WorkedOut(dict[str, Any]):
    """What is worked out from a mechanism; a copy of that begins without, in this process or another."""

    def __deepcopy__(self, memo: Any) -> WorkedOut:
        return WorkedOut()

    def __reduce__(self) -> tuple[type[WorkedOut], tuple[()]]:
        return WorkedOut, ()


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


# ---- where what a name means stands in the file, or would stand: the place that `with_values` changes -----------


def place_of(mechanism: Varying, name: str) -> tuple[str, Location]:
    """The path of the number that a name means, empty if it is no number, and its place in the file.

    MechanismError if it means nothing.
    """
    section, _, rest = name.partition(".")
    if rest and section in ("errors", "tolerances", "costs"):
        return _of_number(mechanism, section, rest)
    try:
        entry = mechanism.parameter_set.entries[mechanism.parameter_set.resolve(name)]
    except MechanismError:
        if place := next(_of_key(mechanism, name), None):
            return place
        raise
    if entry.is_limit:
        remedy = f"set {entry.where}, as ±0.1 deg or +0.2/-0.1 deg"
        raise MechanismError(Finding("a limit is stated with the other", name, remedy))
    return entry.path, entry.location


def _of_number(mechanism: Varying, section: str, rest: str) -> tuple[str, Location]:
    """Place of the error, the tolerance or the cost of a number by any name of that, or of one of its keys."""
    of, _, key = rest.rpartition(".")
    keys = {"errors": (), "tolerances": Variation.model_fields, "costs": Cost.model_fields}[section]
    if not of or key not in keys:
        of, key = rest, ""
    stated: Mapping[str, Any] = getattr(mechanism, "variations" if section == "tolerances" else section)

    def paths(name: str) -> list[str]:
        return mechanism.cost_paths(name) if section == "costs" else [mechanism.parameter_set.resolve(name)]

    try:
        meant = paths(of)
    except MechanismError as error:
        raise MechanismError(replace(error.findings[0], where=f"{section}.{rest}")) from None
    name = next((other for other in stated if other == of or not {*meant}.isdisjoint(paths(other))), of)
    if section == "errors":
        return f"errors.{meant[0]}", (section, name)
    if section == "costs" and (name not in stated or not key):
        raise MechanismError(Finding(f"there is no cost '{rest}'", f"costs.{rest}", nearest(of, stated)))
    short = key in ("", "limits") and (name not in stated or stated[name].model_fields_set <= {"limits"})
    return "", (section, name) if short else (section, name, key or "limits")


def _of_key(mechanism: Varying, name: str) -> Iterator[tuple[str, Location]]:
    """Paths and places of keys that entries of the file may state by a name: `B.pin.clearance`, `A.motor.limit` …"""
    keys, data = tuple(name.split(".")), mechanism.data()
    sections = {key: getattr(mechanism, key) for key in type(mechanism).model_fields}
    sections["joints"] = mechanism.stated_joints
    rows = [row.joint for row in mechanism.loop]
    groups = [section for section, entries in sections.items() if isinstance(entries, Mapping)]
    for location in (keys, *((section, *keys) for section in groups)):
        section, owner = location[0], location[1] if location[1:] else ""
        entries = sections.get(section)
        entry = entries.get(owner) if isinstance(entries, Mapping) else entries
        if not isinstance(entry, str | BaseModel if location is keys else BaseModel):
            continue
        place: Location = location
        if section == "joints" and owner in rows:
            place = ("loop", rows.index(owner), *location[2:])
        *_, above, key = ("", *location)
        fields, group = fields_at(type(mechanism), location[:-1]), stated_at(data, place[:-1])
        if key in fields and (group is None or isinstance(group, dict) or above in ("friction", "seat")):
            if key == "friction":  # a plain number is the coefficient
                location, place = (*location, "coefficient"), (*place, "coefficient")
            yield ".".join(location) if key == "friction" or _is_number(fields[key]) else "", place


def _is_number(annotation: Any) -> bool:
    """Whether a field is a quantity, or may be one of several forms that is."""
    several = () if get_origin(annotation) is tuple else get_args(annotation)
    return annotation is Quantity or any(map(_is_number, several))
