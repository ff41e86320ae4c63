"""The joints of a model file: what a pair is made of and how it sits; with defaults merged in and fits as radii."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, GetJsonSchemaHandler, PlainSerializer, PlainValidator, Tag, WithJsonSchema
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from trunnion.algebra.namespace import Number
from trunnion.errors import MechanismError
from trunnion.joints.clearance import CLEARANCE_MODELS
from trunnion.joints.contact import CONTACT_LAWS, ContactLaw
from trunnion.joints.fits import fit
from trunnion.joints.friction import FRICTION_LAWS
from trunnion.joints.pairs import PAIRS, Pair
from trunnion.model.entry import Direction, Name, OneOf, Part, ReadOnlyDict, ShortForm, forms, problem
from trunnion.model.quantity import (
    Angle,
    AnyQuantity,
    Damping,
    Dimensionless,
    ForceOrMoment,
    Length,
    LineStiffness,
    Pressure,
    Quantity,
    TorsionalStiffness,
)
from trunnion.model.rules import NotNegative, NotWith, NotZero, OnlyWith, Positive, Refers, Selects, Within
from trunnion.model.units import KINDS, UnitError

FRICTION_MODELS = ("two-contact", "pezzuti")


JointType = Annotated[str, OneOf(PAIRS, "joint type")]
Pitch = Annotated[Length, NotZero("the thread does not advance")]


_FIT = re.compile(r"^(?P<size>(?:.*[^\sA-Z])?)\s*(?P<hole>[A-Z]{1,2}[0-9]{1,2})\s*/\s*(?P<shaft>[a-z]{1,2}[0-9]{1,2})$")


@dataclass(frozen=True)
class Fit:
    """An ISO 286 fit such as `20 mm H7/g6`: diameter, hole class and shaft class, as written."""

    source: str
    size: Quantity
    hole: str
    shaft: str

    @classmethod
    def read(cls, source: object) -> Fit:
        """A fit from its text; a pydantic error if it is none."""
        if isinstance(source, Fit):
            return source
        match = _FIT.match(source.strip()) if isinstance(source, str) else None
        if not isinstance(source, str) or not match or not match["size"]:
            raise problem(f"{str(source)[:60]!r} is not a fit", "write diameter, hole and shaft as 20 mm H7/g6")
        try:
            size = Quantity.read(match["size"], KINDS["length"])
        except UnitError as error:
            raise problem(error.what, error.remedy) from error
        if size.tolerance:
            raise problem(f"the size of {source[:60]!r} has a tolerance of its own", "the classes of the fit state it")
        return cls(source, size, match["hole"], match["shaft"])


FitText = Annotated[
    Fit,
    PlainValidator(Fit.read),
    PlainSerializer(lambda fit: fit.source),
    WithJsonSchema({"type": "string", "description": "an ISO 286 fit", "examples": ["20 mm H7/g6"]}),
]


class Pin(Part):
    """Pin and hole of a joint that turns.

    length: of the pin in its hole (for play); bearing: effective length for friction, `length` if not stated;
    clearance: hole radius less pin radius; fit: both radii by ISO 286 instead; offset: of the middle of the bearing
    from the joint's point, along the axis; cylindricity: how much the pin may lie further out at its ends than the
    clearance lets it; end_float: play along the axis, end to end.
    """

    radius: Annotated[Length | None, NotNegative] = None
    hole_radius: Annotated[Length | None, NotNegative, NotWith("clearance")] = None
    length: Annotated[Length | None, NotNegative] = None
    bearing: Annotated[Length | None, NotNegative] = None
    clearance: Annotated[Length | None, NotNegative] = None
    fit: Annotated[FitText | None, NotWith("radius", "hole_radius", "clearance")] = None
    offset: Length | None = None
    cylindricity: Annotated[Length | None, NotNegative] = None
    end_float: Annotated[Length | None, NotNegative] = None


class Guide(Part):
    """Slider and guide of a joint that slides: length in contact, width over which it carries torsion, play across.

    height: of the slider across its guide in the plane, of the corners that touch where it is in play; 0 if not stated.
    """

    length: Annotated[Length | None, NotNegative] = None
    height: Annotated[Length | None, NotNegative] = None
    width: Annotated[Length | None, NotNegative] = None
    clearance: Annotated[Length | None, NotNegative] = None


MATERIAL = OnlyWith("modulus")


class Contact(Part):
    """How pin and hole, or slider and guide, push on each other where they touch: for pins in play in `simulate`.

    law: of `joints.contact`; restitution: speed after over speed before an impact, from 0 to 1; stiffness: K of
    F = K dⁿ, or the modulus of elasticity and Poisson's ratio of pin and hole instead (those of the hole are those of
    the pin if not stated); exponent: n. With law: rigid the restitution alone.
    """

    law: Annotated[str, OneOf(CONTACT_LAWS, "contact law"), Selects("contact law", CONTACT_LAWS)] = "restitution"
    restitution: Annotated[Dimensionless | None, Within(0, 1)] = None
    stiffness: Annotated[AnyQuantity | None, Positive, NotWith("modulus")] = None
    exponent: Annotated[Dimensionless | None, Within(1, 10)] = None
    modulus: Annotated[Pressure | None, Positive] = None
    poisson_ratio: Annotated[Dimensionless | None, Within(-1, 0.5, "(]"), MATERIAL] = None
    hole_modulus: Annotated[Pressure | None, Positive, MATERIAL] = None
    hole_poisson_ratio: Annotated[Dimensionless | None, Within(-1, 0.5, "(]"), MATERIAL] = None

    @property
    def of(self) -> ContactLaw:
        """The law."""
        return CONTACT_LAWS[self.law]

    def complete(self) -> Contact:
        """With the exponent 3/2 where bodies give, and Poisson's ratio 0.3 and the pin's material where not stated."""
        if self.of.rigid:
            return self
        ratio = self.poisson_ratio or Quantity(0.3, KINDS["number"])
        pin = {"poisson_ratio": ratio, "hole_modulus": self.modulus, "hole_poisson_ratio": ratio}
        return self.filled({"exponent": Quantity(1.5, KINDS["number"]), **(pin if self.modulus else {})})


class Seat(Part):
    """Where a pin, slider or ball lies in its play, given once for all positions.

    beta, xi: its ends lie at the angles xi + beta/2 and xi − beta/2 from the hole's x (of a guide, its clearance times
    the cosines of these aside); direction: of a ball, in the frame of the joint on the second link.
    """

    some_of = ("beta", "xi", "direction")

    beta: Annotated[Angle | None, Within(-math.pi, math.pi)] = None
    xi: Angle | None = None
    direction: Annotated[Direction | None, NotWith("beta", "xi")] = None

    def complete(self) -> Seat:
        """With zeros for the angles that were not stated, unless a direction is."""
        if self.direction is not None and self.beta is None and self.xi is None:
            return self
        return self.filled(dict.fromkeys(("beta", "xi"), Quantity(0, KINDS["angle"])))


SeatChoice = Annotated[
    Annotated[Literal["free", "loaded"], Tag(":value")] | Annotated[Seat, Tag(":group")],
    forms("free, loaded or a group {beta: …, xi: …}"),
]


class Misalignment(Part):
    """How the axis of the hole lies off its nominal place on the joint's second link.

    tilt, towards: it leans by this angle towards this direction, counted about the axis from the joint's x;
    offset, offset_towards: and is moved by this length along that one, `towards` if not stated.
    """

    tilt: Annotated[Angle | None, Within(-math.pi / 4, math.pi / 4)] = None
    towards: Angle | None = None
    offset: Length | None = None
    offset_towards: Angle | None = None

    def complete(self, spatial: bool) -> Misalignment:
        """With zeros for what was not stated; in the plane nothing tilts. `offset_towards` stays as it is."""
        kinds = {"towards": "angle", "offset": "length"} | ({"tilt": "angle"} if spatial else {})
        return self.filled({key: Quantity(0, KINDS[kind]) for key, kind in kinds.items()})


class Friction(ShortForm):
    """Friction of a joint: a law with its parameters, or one number, the coefficient (law: coulomb)."""

    short_key, short_types = "coefficient", (int, float, str, Quantity)
    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, AnyQuantity]

    law: Annotated[str, OneOf(FRICTION_LAWS, "friction law")] | None = None
    model: Annotated[str, OneOf(FRICTION_MODELS, "friction model")] | None = None

    @property
    def parameters(self) -> Mapping[str, Quantity]:
        """Parameters of the law by name: every key beside `law` and `model`."""
        return ReadOnlyDict(self.__pydantic_extra__)

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """The number, or the group with the parameters of every law in the table."""
        group = handler.resolve_ref_schema(handler(schema))
        declared = {key: parameter for law in FRICTION_LAWS.values() for key, parameter in law.parameters.items()}
        number = group["additionalProperties"]["type"]
        for key, parameter in declared.items():
            unit = f", {parameter.unit}" if parameter.unit else ""
            group["properties"][key] = {"type": number, "description": f"{parameter.meaning}{unit}"}
        group["additionalProperties"] = False
        return {"anyOf": [{"type": number}, group], "description": group.pop("description")}


class Losses(Part):
    """What resists a joint whatever its load, beside its friction: of a seal, of grease.

    constant: torque or force against the motion, an interval at rest; viscous: the same per speed.
    """

    some_of = ("constant", "viscous")

    constant: Annotated[ForceOrMoment | None, NotNegative] = None
    viscous: Annotated[Damping | None, NotNegative] = None


class BearingStiffness(Part):
    """How stiff a joint is where statics leaves its reaction open, see `over_constraint`.

    radial: across its axis; axial: along it, `radial` if not stated; tilting: against moments, radial (L/2)² of the
    bearing or guide of length L if not stated.
    """

    radial: Annotated[LineStiffness, Positive]
    axial: Annotated[LineStiffness | None, Positive] = None
    tilting: Annotated[TorsionalStiffness | None, Positive] = None


class JointDefaults(Part):
    """What every joint has unless it says otherwise: pins where it turns, guides where it slides."""

    pin: Pin | None = None
    guide: Guide | None = None
    friction: Friction | None = None
    seat: SeatChoice | None = None


class Joint(Part):
    """A kinematic pair between two links, at the point of its own name on both.

    contact: its pin is in play as it moves in time, and touches its hole; all other analyses leave it out.
    pitch: slide of a helical pair for one turn, positive for a right-hand thread. seat_on: the link on which the pin
    keeps its place while the joint turns, where its play is that of an analysis of tolerances; either if not stated.
    """

    type: JointType
    links: Annotated[tuple[str, str], Refers("link", distinct=True)]
    pitch: Pitch | None = None
    pin: Pin | None = None
    guide: Guide | None = None
    contact: Contact | None = None
    friction: Friction | None = None
    losses: Losses | None = None
    stiffness: BearingStiffness | None = None
    misalignment: Misalignment | None = None
    seat: SeatChoice | None = None
    seat_on: Name | None = None

    @property
    def pair(self) -> Pair:
        """The pair of its type."""
        return PAIRS[self.type]


class LoopJoint(Part):
    """A row of a dual Denavit–Hartenberg table: the joint, then the link after it up to the next joint."""

    joint: Name
    type: JointType
    link: Name
    twist: Angle = Quantity(0, KINDS["angle"])
    distance: Length = Quantity(0, KINDS["length"])
    slide: Length | None = None
    rotation: Angle | None = None
    pitch: Pitch | None = None
    pin: Pin | None = None
    guide: Guide | None = None
    friction: Friction | None = None
    losses: Losses | None = None
    stiffness: BearingStiffness | None = None
    misalignment: Misalignment | None = None
    seat: SeatChoice | None = None
    seat_on: Name | None = None


_PLAYS = {kind: model for models in CLEARANCE_MODELS.values() for kind, model in models.items()}
PLAY_PAIRS = tuple(_PLAYS)  # those whose play is modelled
TURNING_PAIRS = tuple(kind for kind, model in _PLAYS.items() if model.turns)  # of these those in which nothing slides


def contact_lacks(joint: Joint, spatial: bool) -> tuple[str, ...]:
    """Sizes of pin or guide that friction in this joint needs and that are not stated, such as ("radius",)."""
    if joint.pair.guided:
        return () if joint.guide and joint.guide.length else ("length",)
    rolls = joint.friction is not None and joint.friction.law == "rolling"
    radius = () if rolls or (joint.pin and joint.pin.radius) else ("radius",)
    if not spatial or joint.pair.ball:
        return radius
    return radius if joint.pin and (joint.pin.bearing or joint.pin.length) else (*radius, "bearing")


def has_play(joint: Joint) -> bool:
    """Whether a joint is of a type whose play is modelled and states one, be it 0."""
    pin, guide = joint.pin, joint.guide
    if joint.type not in PLAY_PAIRS:
        return False
    if joint.pair.guided:
        return guide is not None and guide.clearance is not None
    if pin is None:
        return False
    return pin.clearance is not None or pin.end_float is not None or bool(pin.radius and pin.hole_radius)


def clearance(name: str, values: Mapping[str, Number]) -> Number | None:
    """Radial clearance R − r of a joint's pin, or play of its guide to either side, m; None if none is stated.

    values: by path.
    """
    for part in ("pin", "guide"):
        path = f"joints.{name}.{part}"
        if f"{path}.clearance" in values:
            return values[f"{path}.clearance"]
        if f"{path}.hole_radius" in values and f"{path}.radius" in values:
            return values[f"{path}.hole_radius"] - values[f"{path}.radius"]
    return None


def play(joint: Joint, name: str, values: Mapping[str, Number]) -> Number:
    """How far each end of a joint's pin, slider or ball can lie from the middle of its hole, m; 0 without a play.

    The radial clearance, that between the radii where none is stated, and the cylindricity; of a pin with neither half
    its end float. values: by path.
    """
    if not has_play(joint):
        return 0.0
    if joint.pair.guided:
        return values[f"joints.{name}.guide.clearance"]
    pin, gap = f"joints.{name}.pin", clearance(name, values)
    across = 0.0 if gap is None else gap + values.get(f"{pin}.cylindricity", 0.0)
    return across if across != 0 else 0.5 * values.get(f"{pin}.end_float", 0.0)


# ---- a joint with the defaults of its model merged in, its fit as radii ----------------------------------------

DEFAULT_LAW = "coulomb"
NO_FRICTION = Quantity(0)
RADII = {"radius", "hole_radius", "clearance"}  # what a fit states
FitChoice = Literal["minimum", "mean", "maximum"]


def merge_joint(
    joint: Joint, defaults: JointDefaults, spatial: bool, limits: FitChoice, dimensions: Mapping[str, Number]
) -> Joint:
    """A joint with the defaults that apply to its type, its friction complete: law, model and every parameter.

    limits: which limits of a fit are nominal; dimensions: nominal values of the dimensions that its size may speak of.
    """
    pin, guide = joint.pin, joint.guide
    if joint.pair.turns and (pin or defaults.pin):
        default = {key: size for key, size in stated(defaults.pin).items() if key != "end_float" or joint.pair.pivot}
        pin = Pin(**_pin(default, stated(pin), limits, dimensions))
    if joint.pair.guided and (guide or defaults.guide):
        guide = Guide(**{**stated(defaults.guide), **stated(guide)})
    rubs = joint.pair.count > 0  # nothing slips in a fixed joint: it needs no exception from the defaults
    friction = _friction(stated(defaults.friction) if rubs else {}, stated(joint.friction))
    touching = joint.contact and joint.contact.complete()
    merged = joint.model_copy(update={"pin": pin, "guide": guide, "friction": friction, "contact": touching})
    bored = joint.pair.bored  # its numbers can be set; what another joint states is for a finding
    misalignment = (joint.misalignment or Misalignment()).complete(spatial) if bored else joint.misalignment
    merged = merged.model_copy(update={"misalignment": misalignment, "seat": _seat(merged, defaults.seat)})
    stated_of_law = friction.parameters if friction else {}
    if stated_of_law.get("coefficient") == NO_FRICTION and stated_of_law.get("backward") in (None, NO_FRICTION):
        touches = joint.pair.turns or joint.pair.guided
        if not touches or contact_lacks(merged, spatial):
            return merged.model_copy(update={"friction": None})  # friction: 0 asks for no radius or length
    return merged


def stated(part: BaseModel | None) -> Mapping[str, Any]:
    """What was written of a part: its own values by key."""
    return {} if part is None else {key: getattr(part, key) for key in sorted(part.model_fields_set)}


def _pin(
    default: Mapping[str, Any], own_pin: Mapping[str, Any], limits: FitChoice, dimensions: Mapping[str, Number]
) -> dict[str, Any]:
    """A pin's own values over the defaults; one way to state the play replaces the others."""
    instead = {"fit": RADII, "radius": {"fit"}}
    instead |= {"clearance": {"fit", "hole_radius"}, "hole_radius": {"fit", "clearance"}}
    replaced = {other for key in own_pin for other in instead.get(key, ())}
    merged = {**{key: size for key, size in default.items() if key not in replaced}, **own_pin}
    if merged.get("fit"):
        for key, radius in _radii(merged["fit"], limits, dimensions).items():
            merged[key] = merged.get(key) or radius
    return merged


def _radii(stated_fit: Fit, limits: FitChoice, dimensions: Mapping[str, Number]) -> dict[str, Quantity]:
    """Radii of pin and hole of a fit with their tolerances; half the size for the pin alone where it has no limits."""
    size = stated_fit.size
    try:
        fit_limits = fit(float(size.evaluate(dimensions)), stated_fit.hole, stated_fit.shaft)
    except (MechanismError, KeyError):  # a finding of its own
        return {"radius": _half(size, 0.0, None)}
    radii = {}
    # the smallest play is that of the largest pin in the smallest hole
    for key, (low, high), end in (
        ("radius", fit_limits.shaft_limits, {"minimum": 1.0, "mean": 0.5, "maximum": 0.0}),
        ("hole_radius", fit_limits.hole_limits, {"minimum": 0.0, "mean": 0.5, "maximum": 1.0}),
    ):
        share = end[limits]
        nominal, width = (low + share * (high - low)) / 2, (high - low) / 2
        radii[key] = _half(size, round(nominal, 12), (round(-share * width, 12), round((1 - share) * width, 12)))
    return radii


def _half(size: Quantity, deviation: float, tolerance: tuple[float, float] | None) -> Quantity:
    """Half a diameter and a deviation (m) of the radius."""
    text = f"({size.source}) / 2" + f" {'-' if deviation < 0 else '+'} {abs(deviation):.12g} m" * (deviation != 0)
    return replace(Quantity.read(text, size.kind), tolerance=tolerance)


def _seat(joint: Joint, default: SeatChoice | None) -> SeatChoice:
    """A joint's own seat; else the default where it has a play that this can mean; else free."""
    seat = joint.seat
    suits = default is not None and has_play(joint)
    if isinstance(default, Seat):
        suits = suits and (default.direction is not None) == joint.pair.ball
    if seat is None:
        seat = default if suits else "free"
    elif isinstance(seat, Seat) and isinstance(default, Seat) and suits:
        seat = Seat(**{**stated(default), **stated(seat)})
    return seat.complete() if isinstance(seat, Seat) else seat or "free"


def _friction(default: Mapping[str, Any], own_friction: Mapping[str, Any]) -> Friction | None:
    """Friction complete: the joint's own over the file's defaults (those its law knows) over the law's."""
    if not default and not own_friction:
        return None
    law = own_friction.get("law") or default.get("law") or DEFAULT_LAW
    declared = FRICTION_LAWS[law].parameters
    if (default.get("law") or DEFAULT_LAW) != law:
        default = {key: value for key, value in default.items() if key in (*declared, "model")}
    if "coefficient" in own_friction:  # of both directions, unless it says otherwise
        default = {key: value for key, value in default.items() if key != "backward"}
    filled = {key: parameter.default for key, parameter in declared.items() if parameter.default is not None}
    model = own_friction.get("model") or default.get("model") or "two-contact"
    return Friction.model_validate({**filled, **default, **own_friction, "law": law, "model": model})
