"""The plain fields of a model file, and what follows from them without looking at a number: names, kinds."""

from __future__ import annotations

import re
from collections.abc import Mapping
from contextlib import suppress
from functools import cached_property
from typing import Annotated, Any, Literal

from pydantic import Field

from trunnion.model.entry import Name, Part, ReadOnlyDict
from trunnion.model.joint_parts import FitChoice, Joint, JointDefaults, LoopJoint, merge_joint
from trunnion.model.measure_table import MEASURES, Measure
from trunnion.model.parts import Driver, Gear, Hint, Link, Load, Spring, Table
from trunnion.model.quantity import Acceleration, AnyQuantity, Quantity, evaluation_order, nominal_dimensions
from trunnion.model.rules import InSpace, Refers
from trunnion.model.tolerance_parts import Correlation, Cost, Process, Variation, VariationDefaults
from trunnion.model.units import ANY, KINDS, NUMBER, Dimension, Kind, UnitError, si_unit

FIXED_NAMES = ("ground", "frame")


class Fields(Part):
    """The sections of a model file, as stated, and its links, joints and points, those of the loop among them."""

    trunnion: Literal[1] = 1
    name: str = ""
    space: Literal["planar", "spatial"] = "planar"
    over_constraint: Literal["refuse", "minimum-norm"] = "refuse"
    fits: FitChoice = "mean"
    gravity: Annotated[tuple[Acceleration, ...], Field(min_length=2, max_length=3), InSpace()] | None = None
    ground: Annotated[str | None, Refers("link")] = None
    dimensions: Mapping[Name, AnyQuantity] = {}
    errors: Mapping[str, AnyQuantity] = {}
    links: Mapping[Name, Link] = {}
    joints: Mapping[Name, Joint] = {}
    joint_defaults: JointDefaults = JointDefaults()
    gears: Mapping[Name, Gear] = {}
    loop: tuple[LoopJoint, ...] = ()
    drivers: Mapping[Name, Driver] = {}
    tables: Mapping[Name, Table] = {}
    loads: Mapping[Name, Load] = {}
    springs: Mapping[Name, Spring] = {}
    assembly: Mapping[str, Hint] = {}
    measures: Mapping[Name, Measure] = {}
    variations: Annotated[Mapping[str, Variation], Field(alias="tolerances")] = {}
    tolerance_defaults: VariationDefaults = VariationDefaults()
    correlations: tuple[Correlation, ...] = ()
    costs: Mapping[str, Cost] = {}
    processes: Mapping[Name, Process] = {}
    references: tuple[str, ...] = ()
    notes: str = ""

    @property
    def coordinates(self) -> int:
        """How many coordinates a point has: 2 or 3."""
        return 2 if self.space == "planar" else 3

    @property
    def position_form(self) -> str:
        """How a position is written."""
        return "[x, y]" if self.space == "planar" else "[x, y, z]"

    @cached_property
    def fixed_link(self) -> str:
        """The link that does not move: `ground`, else the link of that name or named frame; empty if there is none."""
        names = [*self.links, *(row.link for row in self.loop)]
        return self.ground or next((name for name in FIXED_NAMES if name in names), "")

    @cached_property
    def effective_links(self) -> Mapping[str, Link]:
        """Every link; one that only the loop names is massless."""
        return ReadOnlyDict({**self.links, **{row.link: Link() for row in self.loop if row.link not in self.links}})

    @cached_property
    def stated_joints(self) -> Mapping[str, Joint]:
        """Every joint as it was stated; a row of the loop joins the link before it to its own."""
        joints = dict(self.joints)
        for before, row in zip((*self.loop[-1:], *self.loop[:-1]), self.loop, strict=True):
            parts = {key: getattr(row, key) for key in Joint.model_fields if key != "links" and hasattr(row, key)}
            joints[row.joint] = Joint(links=(before.link, row.link), **parts)
        return ReadOnlyDict(joints)

    @cached_property
    def effective_joints(self) -> Mapping[str, Joint]:
        """Every joint with the defaults merged in and its friction complete: law, model and all parameters."""
        spatial = self.space == "spatial"
        pins = [self.joint_defaults.pin, *(joint.pin for joint in self.stated_joints.values())]
        named = any(pin and pin.fit and pin.fit.size.names for pin in pins)
        sizes = nominal_dimensions(self.dimensions) if named else {}
        return ReadOnlyDict({name: merge_joint(joint, self.joint_defaults, spatial, self.fits, sizes)
                             for name, joint in self.stated_joints.items()})  # fmt: skip

    @cached_property
    def points(self) -> Mapping[str, tuple[str, ...]]:
        """Names of the points of every link; a joint of the loop is a point of both its links."""
        rows = [row.joint for row in self.loop]
        ends = {name: [row for row in rows if name in self.stated_joints[row].links] for name in self.effective_links}
        return ReadOnlyDict({name: tuple(dict.fromkeys([*link.points, *ends[name]]))
                             for name, link in self.effective_links.items()})  # fmt: skip

    def named(self, noun: str) -> list[str]:
        """The names of the parts that a noun means: `link`, `point` (link.point), `joint` that moves, `driver` …"""
        joints, drivers, loads = self.effective_joints, self.drivers, self.loads
        match noun:
            case "point":
                return [f"{link}.{point}" for link, points in self.points.items() for point in points]
            case "joint":
                return [name for name, joint in joints.items() if joint.pair.motions]
            case "free driver":
                return [name for name, driver in drivers.items() if driver.found]
            case "load on a joint":
                return [name for name, load in loads.items() if load.joint is not None]
            case "driver or load":
                return list(dict.fromkeys([*drivers, *loads]))
        sections = {"link": self.effective_links, "any joint": joints, "driver": drivers, "spring": self.springs}
        return list({**sections, "process": self.processes}[noun])

    def coupled(self, gear: str) -> tuple[str, str]:
        """The joints of a gear pair, of a rack or screw that which turns first."""
        first, second = self.gears[gear].joints
        slides = self.gears[gear].slides and not self.effective_joints[first].pair.turns
        return (second, first) if slides else (first, second)

    def carriers(self, gear: str) -> tuple[int, int] | None:
        """On which side (0, 1) of each of its joints a gear pair has the link common to both; None without one."""
        first_links, two = (self.effective_joints[joint].links for joint in self.coupled(gear))
        shared = next((link for link in first_links if link in two), None)
        return None if shared is None else (first_links.index(shared), two.index(shared))

    def data(self) -> dict[str, Any]:
        """The model as plain mappings, lists, numbers and texts: what was stated, as it was written."""
        return {"trunnion": self.trunnion, **self.model_dump(mode="json", exclude_unset=True, by_alias=True)}


# ---- what numbers of measures, places and dimensions are --------------------------------------------------------

_COLUMN = re.compile(r"(?P<part>\w+)\.(?P<kind>rotation|slide|effort)|(?P<point>\w+\.\w+)\.(?P<axis>[xyz])")


def dimension_kinds(mechanism: Fields) -> dict[str, Kind]:
    """What each dimension measures, as far as its value tells."""
    dimensions: dict[str, Dimension | None] = {}
    for name in evaluation_order(mechanism.dimensions)[0]:
        with suppress(UnitError, KeyError):  # findings of their own
            dimensions[name] = mechanism.dimensions[name].check(dimensions, ANY)
    return {name: _of_dimension(dimension) for name, dimension in dimensions.items() if dimension is not None}


def _of_dimension(dimension: Dimension | None) -> Kind:
    """The usual kind of a dimension, a number where none is known."""
    dimension = dimension or NUMBER
    usual, si = {kind.dimensions[0]: kind for kind in KINDS.values()}, si_unit(dimension)
    return usual.get(dimension) or Kind("quantity", si, f"1 {si}", (dimension,))


def drive_kind(mechanism: Fields) -> Kind:
    """What the coordinate of the first driver measures."""
    joint = mechanism.effective_joints.get(next(iter(mechanism.drivers), ""))
    return KINDS["length" if joint and not joint.pair.turns else "angle"]


def course_kind(mechanism: Fields, measure: Measure) -> Kind:
    """What a measure is at every position; of a joint with two motions the rotation."""
    if not measure.kind:  # a finding of its own
        return ANY
    if measure.kind == "expression":
        with suppress(UnitError, KeyError):  # findings of their own
            formula = measure.formula
            return _of_dimension(formula.dimension(operand_dimensions(mechanism, measure)) if formula else None)
        return ANY
    kind = MEASURES[measure.kind]
    section = {"load on a joint": "loads", "spring": "springs"}.get(str(kind.of), "joints")
    return kind.quantities[-1 if part_turns(mechanism, section, measure.subject) is False else 0]


def part_turns(mechanism: Fields, section: str, name: str) -> bool | None:
    """Whether what a part is of turns, or slides; None where that is not said, or a finding of its own."""
    part = getattr(mechanism, section).get(name)
    if isinstance(part, Gear):
        return not part.slides
    if isinstance(part, Load):
        return part.resisting_torque is not None
    if isinstance(part, Spring) and part.joint is None:  # between two points
        return False
    joint = part.joint if isinstance(part, Spring) else part.moves if isinstance(part, Driver) else None
    stated = mechanism.effective_joints.get(joint or name)
    return None if stated is None else stated.pair.turns


def place_kind(mechanism: Fields, quantity: Quantity, dimensions: Mapping[str, Dimension | None]) -> Kind:
    """A time if it is stated as one, else the coordinate of the first driver. dimensions: of the names in it."""
    with suppress(UnitError, KeyError):  # findings of their own
        if quantity.check(dimensions) in KINDS["time"].dimensions:
            return KINDS["time"]
    return drive_kind(mechanism)


def operands(mechanism: Fields, measure: Measure) -> dict[str, Measure | None]:
    """What each name in the expression of a measure stands for: a measure, None for a dimension or for nothing.

    A name is that of a measure or a dimension of the model, or of a column of a result: JOINT.rotation, JOINT.slide,
    DRIVER.effort or LINK.POINT.x.
    """
    names = measure.formula.names if measure.formula else ()
    return {name: mechanism.measures.get(name) or _column(name) for name in names}


def _column(name: str) -> Measure | None:
    match = _COLUMN.fullmatch(name)
    if match is None:
        return None
    of_point = {"point": match["point"], "axis": match["axis"]}
    return Measure.model_validate(of_point if match["point"] else {match["kind"]: match["part"]})


def operand_dimensions(mechanism: Fields, measure: Measure) -> dict[str, Dimension | None]:
    """The dimension of each name in an expression, None where it is not known; KeyError for what is nothing."""
    of_dimensions = dimension_kinds(mechanism)
    kinds: dict[str, Dimension | None] = {}
    for name, part in operands(mechanism, measure).items():
        if part is None and name not in mechanism.dimensions:
            raise KeyError(name)
        kind = of_dimensions.get(name, ANY) if part is None else course_kind(mechanism, part)
        kinds[name] = next(iter(kind.dimensions), None)
    return kinds
