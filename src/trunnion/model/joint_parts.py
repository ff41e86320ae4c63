"""The joints of a model file: what a pair is made of, how it sits, what is wrong with it."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import (
    ConfigDict,
    GetJsonSchemaHandler,
    PlainSerializer,
    PlainValidator,
    Tag,
    WithJsonSchema,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from trunnion.algebra.namespace import Number
from trunnion.joints.clearance import CLEARANCE_MODELS
from trunnion.joints.contact import CONTACT_LAWS, ContactLaw
from trunnion.joints.friction import FRICTION_LAWS
from trunnion.joints.pairs import PAIRS
from trunnion.model.entry import Direction, Name, OneOf, Part, ReadOnlyDict, ShortForm, forms, problem
from trunnion.model.expression import DIAMETER
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

__all__ = [
    "FRICTION_MODELS", "JOINT_TYPES", "PLAY_PAIRS", "TURNING_PAIRS", "BearingStiffness", "Contact", "Fit", "Friction",
    "Guide", "Joint", "JointDefaults", "LoopJoint", "Losses", "Misalignment", "Pin", "Seat", "clearance",
    "contact_lacks", "freedoms", "has_guide", "has_pin", "has_play", "motions", "play",
]  # fmt: skip

JOINT_TYPES = tuple(PAIRS)
FRICTION_MODELS = ("two-contact", "pezzuti")


def freedoms(joint_type: str) -> tuple[str, ...]:
    """The motions a joint of this type frees, of ("rotation", "slide"): a rotation has a pin, a slide alone a guide."""
    return PAIRS[joint_type].freedoms


JointType = Annotated[str, OneOf(JOINT_TYPES, "joint type")]
Pitch = Annotated[Length, NotZero("the thread does not advance")]


_FIT = re.compile(r"^(?P<size>.*[^\sA-Z])\s*(?P<hole>[A-Z]{1,2}[0-9]{1,2})\s*/\s*(?P<shaft>[a-z]{1,2}[0-9]{1,2})$")
_CLASSES = re.compile(r"\s*[A-Z]{1,2}[0-9]{1,2}\s*/\s*[a-z]{1,2}[0-9]{1,2}\s*")


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
        if not isinstance(source, str) or not match:
            what = "has no diameter" if _CLASSES.fullmatch(str(source)) else "is not a fit"
            raise problem(f"{str(source)[:60]!r} {what}", "write diameter, hole and shaft as 20 mm H7/g6")
        diameter = match["size"].lstrip("".join(DIAMETER)).strip()
        plain = bool(re.fullmatch(r"[0-9]+(\.[0-9]*)?", diameter))
        if plain or diameter != match["size"]:  # Ø 24 H7/g6
            what = f"'{diameter}' has no unit" if plain else f"'{match['size'][0]}' is not read in '{source[:60]}'"
            raise problem(what, f"write {diameter}{' mm' * plain} {match['hole']}/{match['shaft']}")
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


LAW = Selects("contact law", CONTACT_LAWS)
MATERIAL = OnlyWith("modulus")


class Contact(Part):
    """How pin and hole, or slider and guide, push on each other where they touch: for pins in play in `simulate`.

    law: of `joints.contact`; restitution: speed after over speed before an impact, from 0 to 1; stiffness: K of
    F = K dⁿ, or the modulus of elasticity and Poisson's ratio of pin and hole instead (those of the hole are those of
    the pin if not stated); exponent: n. With law: rigid the restitution alone.
    """

    law: Annotated[str, OneOf(CONTACT_LAWS, "contact law"), LAW] = "restitution"
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


def motions(joint_type: str) -> tuple[str, ...]:
    """Which of rotation and slide a joint of this type makes about and along the one axis that both links share."""
    return PAIRS[joint_type].motions


def has_pin(joint_type: str) -> bool:
    """Whether a joint of this type has a pin (or ball) in a hole."""
    return PAIRS[joint_type].turns


def has_guide(joint_type: str) -> bool:
    """Whether a joint of this type has a slider in a guide."""
    return PAIRS[joint_type].guided


def contact_lacks(joint: Joint, spatial: bool) -> tuple[str, ...]:
    """Sizes of pin or guide that friction in this joint needs and that are not stated, such as ("radius",)."""
    if has_guide(joint.type):
        return () if joint.guide and joint.guide.length else ("length",)
    rolls = joint.friction is not None and joint.friction.law == "rolling"
    radius = () if rolls or (joint.pin and joint.pin.radius) else ("radius",)
    if not spatial or PAIRS[joint.type].ball:
        return radius
    return radius if joint.pin and (joint.pin.bearing or joint.pin.length) else (*radius, "bearing")


def has_play(joint: Joint) -> bool:
    """Whether a joint is of a type whose play is modelled and states one, be it 0."""
    pin, guide = joint.pin, joint.guide
    if joint.type not in PLAY_PAIRS:
        return False
    if has_guide(joint.type):
        return guide is not None and guide.clearance is not None
    return pin is not None and (
        pin.clearance is not None or pin.end_float is not None or bool(pin.radius and pin.hole_radius)
    )


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
    if has_guide(joint.type):
        return values[f"joints.{name}.guide.clearance"]
    pin, gap = f"joints.{name}.pin", clearance(name, values)
    across = 0.0 if gap is None else gap + values.get(f"{pin}.cylindricity", 0.0)
    return across if across != 0 else 0.5 * values.get(f"{pin}.end_float", 0.0)
