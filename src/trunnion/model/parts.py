"""The sections of a model file as frozen pydantic models: one class for each kind of entry, one field for each key.

A class reads the plain mappings, numbers and texts of a file; Python code may give those or the classes. Fields
left out stay unset, so that a model is written back with what was stated and nothing more.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Discriminator,
    Field,
    GetJsonSchemaHandler,
    PlainSerializer,
    PlainValidator,
    SerializerFunctionWrapHandler,
    Tag,
    WithJsonSchema,
    model_serializer,
    model_validator,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, PydanticCustomError

from trunnion.joints.friction import FRICTION_LAWS
from trunnion.joints.motion import MOTION_LAWS, MotionLaw
from trunnion.joints.pairs import PAIRS
from trunnion.model.names import nearest
from trunnion.model.quantity import (
    Angle,
    AngleOrLength,
    AnyQuantity,
    Damping,
    Dimensionless,
    Force,
    ForceOrMoment,
    Inertia,
    Length,
    Mass,
    Moment,
    Quantity,
    Rate,
    Stiffness,
    Time,
)
from trunnion.model.units import KINDS, UnitError

__all__ = [
    "FRICTION_MODELS",
    "JOINT_TYPES",
    "Driver",
    "Fit",
    "Friction",
    "Gear",
    "Guide",
    "InertiaTensor",
    "Joint",
    "JointDefaults",
    "Link",
    "Load",
    "LoopJoint",
    "Measure",
    "Part",
    "Pin",
    "Point",
    "PolarPoint",
    "Spring",
    "Table",
    "freedoms",
]

JOINT_TYPES = tuple(PAIRS)
FRICTION_MODELS = ("two-contact", "pezzuti")


def freedoms(joint_type: str) -> tuple[str, ...]:
    """The motions a joint of this type frees, of ("rotation", "slide"): a rotation has a pin, a slide alone a guide."""
    return PAIRS[joint_type].freedoms


def _name(name: str) -> str:
    """A name that can stand in a path and in a message."""
    if not name.strip() or name != name.strip():
        raise _problem(f"the name {name[:80]!r} is empty or begins or ends with a space", "remove the space")
    if "." in name:
        raise _problem(f"the name '{name[:80]}' has a dot, which separates the parts of a path", "use - or _")
    if len(name) > 80 or any(unicodedata.category(sign) in ("Cc", "Cf", "Cs", "Zl", "Zp") for sign in name):
        raise _problem(f"the name {name[:80]!r} has control characters or over 80", "use a short printable name")
    return name


def _problem(what: str, remedy: str) -> PydanticCustomError:
    return PydanticCustomError("stated", "{what}", {"what": what, "remedy": remedy})


def _known(table: tuple[str, ...], noun: str) -> Any:
    """Annotations of a text that must be an entry of a table, for validation and JSON Schema."""

    def check(value: str) -> str:
        if value not in table:
            raise _problem(f"'{value[:80]}' is not a {noun}", nearest(value, table))
        return value

    return AfterValidator(check), WithJsonSchema({"type": "string", "enum": list(table)})


FORMS = (":group", ":list", ":value", ":way")  # tags of the forms an entry may have


def _shape(value: object) -> str:
    """Which of the forms of an entry was written: a list, a group of entries or a single value."""
    if isinstance(value, (Mapping, BaseModel)):
        return ":group"
    return ":list" if isinstance(value, (list, tuple)) else ":value"


def _forms(text: str) -> Discriminator:
    return Discriminator(_shape, custom_error_type="forms", custom_error_message=f"takes {text}")


_check_type, _schema_type = _known(JOINT_TYPES, "joint type")
_check_law, _schema_law = _known(tuple(FRICTION_LAWS), "friction law")
_check_motion, _schema_motion = _known(tuple(MOTION_LAWS), "motion law")
_check_model, _schema_model = _known(FRICTION_MODELS, "friction model")

Name = Annotated[str, AfterValidator(_name)]
JointType = Annotated[str, _check_type, _schema_type]
Position = Annotated[tuple[Length, ...], Field(min_length=2, max_length=3)]
Direction = Annotated[tuple[Dimensionless, ...], Field(min_length=2, max_length=3)]


class Part(BaseModel):
    """An entry of a model file: immutable, an unknown key is an error."""

    model_config = ConfigDict(extra="forbid", frozen=True, hide_input_in_errors=True)


class Point(Part):
    """A point of a link in the link's frame: `[x, y]`, or with the axis of a sliding or spatial joint there."""

    at: Position
    axis: Direction | None = None
    x: Direction | None = None

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """The list or the group."""
        group = handler.resolve_ref_schema(handler(schema))
        return {"anyOf": [group["properties"]["at"], group], "description": group.pop("description")}

    @model_validator(mode="before")
    @classmethod
    def _read_list(cls, value: object) -> object:
        return {"at": value} if isinstance(value, (list, tuple)) else value

    @model_serializer(mode="wrap")
    def _write_list(self, write: SerializerFunctionWrapHandler) -> Any:
        long = write(self)
        return long["at"] if self.axis is None and self.x is None else long


class PolarPoint(Part):
    """A point by its distance from the link's origin and its angle from the link's x."""

    distance: Length
    angle: Angle


class InertiaTensor(Part):
    """Inertia of a spatial link, kg m²: entries of the symmetric tensor (so xy = −∫ x y dm)."""

    xx: Inertia
    yy: Inertia
    zz: Inertia
    xy: Inertia = Quantity(0, KINDS["moment of inertia"])
    xz: Inertia = Quantity(0, KINDS["moment of inertia"])
    yz: Inertia = Quantity(0, KINDS["moment of inertia"])


class Link(Part):
    """A rigid body: its points by name, its mass properties in its own frame (massless if not stated).

    centre: mass centre, the origin if not stated; inertia refers to it unless `inertia_about` is origin.
    frame: in a spatial loop, the joint whose frame the mass properties are given in.
    """

    points: Mapping[Name, Point] = {}
    mass: Mass = Quantity(0, KINDS["mass"])
    centre: (
        Annotated[
            Annotated[Position, Tag(":list")] | Annotated[PolarPoint, Tag(":group")],
            _forms("[x, y] or {distance: …, angle: …}"),
        ]
        | None
    ) = None
    inertia: Annotated[
        Annotated[Inertia, Tag(":value")] | Annotated[InertiaTensor, Tag(":group")],
        _forms("a number or a group {xx: …, yy: …, zz: …}"),
    ] = Quantity(0, KINDS["moment of inertia"])
    inertia_about: Literal["centre", "origin"] = "centre"
    frame: str | None = None


_FIT = re.compile(r"^(?P<size>.*\S)\s+(?P<hole>[A-Z]{1,2}[0-9]{1,2})\s*/\s*(?P<shaft>[a-z]{1,2}[0-9]{1,2})$")


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
        found = _FIT.match(source.strip()) if isinstance(source, str) else None
        if not isinstance(source, str) or not found:
            raise _problem(f"{str(source)[:60]!r} is not a fit", "write diameter, hole and shaft as 20 mm H7/g6")
        try:
            size = Quantity.read(found["size"], KINDS["length"])
        except UnitError as error:
            raise _problem(error.what, error.remedy) from error
        return cls(source, size, found["hole"], found["shaft"])


FitText = Annotated[
    Fit,
    PlainValidator(Fit.read),
    PlainSerializer(lambda fit: fit.source),
    WithJsonSchema({"type": "string", "description": "an ISO 286 fit", "examples": ["20 mm H7/g6"]}),
]


class Pin(Part):
    """Pin and hole of a joint that turns.

    length: of the pin in its hole (for play); bearing: effective length for friction, `length` if not stated;
    clearance: hole radius less pin radius; fit: diameter and clearance by ISO 286 instead; offset: of the
    middle of the bearing from the joint's point, along the axis.
    """

    radius: Length | None = None
    length: Length | None = None
    bearing: Length | None = None
    clearance: Length | None = None
    fit: FitText | None = None
    offset: Length | None = None


class Guide(Part):
    """Slider and guide of a joint that slides: length in contact, width over which it carries torsion, play across."""

    length: Length | None = None
    width: Length | None = None
    clearance: Length | None = None


class Friction(BaseModel):
    """Friction of a joint: a law with its parameters, or one number, the coefficient (law: coulomb)."""

    model_config = ConfigDict(extra="allow", frozen=True, hide_input_in_errors=True)
    __pydantic_extra__: dict[str, AnyQuantity]

    law: Annotated[str, _check_law, _schema_law] | None = None
    model: Annotated[str, _check_model, _schema_model] | None = None

    @property
    def parameters(self) -> Mapping[str, Quantity]:
        """Parameters of the law by name: every key beside `law` and `model`."""
        return self.__pydantic_extra__

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """The number, or the group with the parameters of every law in the table."""
        group = handler.resolve_ref_schema(handler(schema))
        declared = {key: one for law in FRICTION_LAWS.values() for key, one in law.parameters.items()}
        number = group["additionalProperties"]["type"]
        for key, one in declared.items():
            unit = f", {one.unit}" if one.unit else ""
            group["properties"][key] = {"type": number, "description": f"{one.meaning}{unit}"}
        group["additionalProperties"] = False
        return {"anyOf": [{"type": number}, group], "description": group.pop("description")}

    @model_validator(mode="before")
    @classmethod
    def _read_number(cls, value: object) -> object:
        return {"coefficient": value} if isinstance(value, (int, float, str, Quantity)) else value

    @model_serializer(mode="wrap")
    def _write_number(self, write: SerializerFunctionWrapHandler) -> Any:
        long = write(self)
        return long["coefficient"] if list(long) == ["coefficient"] else long


class JointDefaults(Part):
    """What every joint has unless it says otherwise: pins where it turns, guides where it slides."""

    pin: Pin | None = None
    guide: Guide | None = None
    friction: Friction | None = None


class Joint(Part):
    """A kinematic pair between two links, at the point of its own name on both.

    pitch: slide of a helical pair for one turn, positive for a right-hand thread.
    """

    type: JointType
    links: tuple[str, str]
    pitch: Length | None = None
    pin: Pin | None = None
    guide: Guide | None = None
    friction: Friction | None = None


class LoopJoint(Part):
    """A row of a dual Denavit–Hartenberg table: the joint, then the link after it up to the next joint."""

    joint: Name
    type: JointType
    link: Name
    twist: Angle = Quantity(0, KINDS["angle"])
    distance: Length = Quantity(0, KINDS["length"])
    slide: Length | None = None
    rotation: Angle | None = None
    pitch: Length | None = None
    pin: Pin | None = None
    guide: Guide | None = None
    friction: Friction | None = None


class Driver(Part):
    """Prescribed motion of the joint it is named after, by a law of `joints.motion`: `constant` if none is stated."""

    law: Annotated[str, _check_motion, _schema_motion] = "constant"
    speed: Rate | None = None
    start: AngleOrLength | None = None
    range: tuple[AngleOrLength, AngleOrLength] | None = None
    mean: AngleOrLength | None = None
    amplitude: AngleOrLength | None = None
    period: Time | None = None
    phase: Angle | None = None
    duration: Time | None = None
    return_duration: Time | None = None
    dwell: Time | None = None
    returns: bool = True
    points: Annotated[tuple[tuple[Time, AngleOrLength], ...], Field(min_length=2)] | None = None
    periodic: bool = False
    ends: Literal["clamped", "natural"] = "clamped"
    delay: Time | None = None

    @property
    def motion(self) -> MotionLaw:
        """The law."""
        return MOTION_LAWS[self.law]

    @property
    def options(self) -> Mapping[str, bool | str]:
        """What the law is told beside numbers."""
        return {"returns": self.returns, "periodic": self.periodic, "ends": self.ends}

    def complete(self) -> Driver:
        """With zeros for what its law takes and was not stated."""
        missing = {key: zero for key, zero in _DRIVER_ZEROS.items() if key in self.motion.takes}
        return self.model_copy(update={key: zero for key, zero in missing.items() if getattr(self, key) is None})


_ANGLE_OR_LENGTH = KINDS["angle"] | KINDS["length"]
_DRIVER_ZEROS = {
    "start": Quantity(0, _ANGLE_OR_LENGTH),
    "mean": Quantity(0, _ANGLE_OR_LENGTH),
    "phase": Quantity(0, KINDS["angle"]),
    "dwell": Quantity(0, KINDS["time"]),
    "delay": Quantity(0, KINDS["time"]),
}


class Load(Part):
    """A load on a link (force at a point, moment), or one that resists the motion of a joint.

    Its numbers may be expressions of the motion: of `drive`, `speed`, `time` and the names of tables.
    """

    link: str | None = None
    at: str | None = None
    force: Annotated[tuple[Force, ...], Field(min_length=2, max_length=3)] | None = None
    moment: (
        Annotated[
            Annotated[Moment, Tag(":value")]
            | Annotated[tuple[Moment, ...], Field(min_length=3, max_length=3), Tag(":list")],
            _forms("one moment (planar) or [x, y, z]"),
        ]
        | None
    ) = None
    frame: Literal["global", "link"] = "global"
    joint: str | None = None
    resisting_torque: Moment | None = None
    resisting_force: Force | None = None
    only: Literal["positive", "negative"] | None = None
    useful: bool = False


class Table(Part):
    """A quantity stated by points (coordinate of the first driver or time, value), for the expressions of loads."""

    over: Literal["drive", "time"] = "drive"
    points: Annotated[tuple[tuple[AnyQuantity, AnyQuantity], ...], Field(min_length=2)]
    interpolation: Literal["linear", "spline"] = "linear"
    periodic: bool = False


class Spring(Part):
    """A spring, a damper or both: along the line between two points of two links, or in the freedom of a joint.

    It pulls with preload + stiffness · (length − free length) + damping · rate; so does a torsional one, by angles.
    One that only pulls does so while it is longer than its free length, one that only pushes while it is shorter.
    """

    between: tuple[str, str] | None = None
    joint: str | None = None
    stiffness: Stiffness | None = None
    free_length: Length | None = None
    free_angle: Angle | None = None
    damping: Damping | None = None
    preload: ForceOrMoment | None = None
    only: Literal["pull", "push"] | None = None


class Gear(Part):
    """A gear pair: the rotation of the second joint is ratio · rotation of the first + phase.

    With teeth the joints share a link, the carrier, and the tooth force acts at the pitch point, inclined by the
    pressure angle (20 deg if not stated); without, a train, belt or chain passes torques alone.
    """

    joints: tuple[str, str]
    ratio: Dimensionless
    phase: Angle = Quantity(0, KINDS["angle"])
    teeth: bool = True
    pressure_angle: Angle | None = None

    def complete(self) -> Gear:
        """With the usual pressure angle if it has teeth and states none."""
        usual = Quantity.read("20 deg", KINDS["angle"]) if self.teeth else None
        return self if self.pressure_angle else self.model_copy(update={"pressure_angle": usual})


class Measure(Part):
    """A number to watch: a coordinate of a point, rotation or slide of a joint, angle of a link, effort of a driver."""

    point: str | None = None
    axis: Literal["x", "y", "z"] | None = None
    effort: str | None = None
    angle: str | None = None
    rotation: str | None = None
    slide: str | None = None
    limit: AnyQuantity | None = None


_WAY = re.compile(r"^way-[1-9][0-9]{0,3}$")
_LIKE_A_WAY = re.compile(r"(?i)^way[-_ ]\w*$")  # meant as a name, whatever is wrong with it


def _hint_shape(value: object) -> str:
    return ":way" if isinstance(value, str) and _LIKE_A_WAY.match(value) else _shape(value)


Hint = Annotated[
    Annotated[Position, Tag(":list")]
    | Annotated[AngleOrLength, Tag(":value")]
    | Annotated[str, Field(pattern=_WAY.pattern), Tag(":way")],
    Discriminator(
        _hint_shape,
        custom_error_type="forms",
        custom_error_message="takes coordinates of a point, rotation or slide of a joint, or way-1, way-2, … of a link",
    ),
]
