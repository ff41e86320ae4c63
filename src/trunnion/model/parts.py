"""The sections of a model file as frozen pydantic models: one class for each kind of entry, one field for each key.

A class reads the plain mappings, numbers and texts of a file; Python code may give those or the classes. Fields
left out stay unset, so that a model is written back with what was stated and nothing more.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import Discriminator, Field, PrivateAttr, Tag

from trunnion.joints.motion import MOTION_LAWS, MotionLaw
from trunnion.joints.motors import MOTORS, MotorKind
from trunnion.model.entry import Direction, Name, OneOf, Part, Position, ShortForm, forms, shape
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
    MassOrInertia,
    Moment,
    Quantity,
    Rate,
    Stiffness,
    Time,
)
from trunnion.model.rules import (
    InSpace,
    NotNegative,
    NotWith,
    NotZero,
    OnlyWith,
    Positive,
    Refers,
    Rising,
    Selects,
    Within,
)
from trunnion.model.units import KINDS


class Point(ShortForm):
    """A point of a link in the link's frame: `[x, y]`, or with the axis of a sliding or spatial joint there."""

    short_key, short_types = "at", (list, tuple)

    at: Annotated[Position, InSpace()]
    axis: Annotated[Direction | None, InSpace()] = None
    x: Annotated[Direction | None, InSpace()] = None


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
    mass: Annotated[Mass, NotNegative] = Quantity(0, KINDS["mass"])
    centre: (
        Annotated[
            Annotated[Position, Tag(":list"), InSpace()] | Annotated[PolarPoint, Tag(":group")],
            forms("[x, y] or {distance: …, angle: …}"),
        ]
        | None
    ) = None
    inertia: Annotated[
        Annotated[Inertia, Tag(":value")] | Annotated[InertiaTensor, Tag(":group")],
        forms("a number or a group {xx: …, yy: …, zz: …}"),
    ] = Quantity(0, KINDS["moment of inertia"])
    inertia_about: Literal["centre", "origin"] = "centre"
    frame: str | None = None
    useful: bool = False


_OF_ALL_MOTORS = (
    *("ratio", "efficiency", "inertia", "off_from", "brake", "brake_from"),
    *("clutch", "clutch_from", "clutch_until"),
)


class Motor(Part):
    """What drives a joint whose motion is found, by a kind of `joints.motors`, and what is between it and the joint.

    ratio: speed of the motor over that of the joint; efficiency: of that gear; inertia: of the rotor (mass of a linear
    motor), on the motor's side. off_from: time at which the motor is switched off; brake: effort that resists the joint
    from the time brake_from on. clutch: effort that a clutch between rotor and gear transmits at most, on the motor's
    side; it is engaged from the time clutch_from to clutch_until.
    """

    kind: Annotated[str, OneOf(MOTORS, "kind of motor"), Selects("motor", MOTORS, _OF_ALL_MOTORS)]
    effort: ForceOrMoment | None = None
    stall_effort: ForceOrMoment | None = None
    no_load_speed: Annotated[Rate | None, NotZero("the motor has no speed")] = None
    breakdown_effort: Annotated[ForceOrMoment | None, Positive] = None
    breakdown_slip: Annotated[Dimensionless | None, Positive] = None
    synchronous_speed: Annotated[Rate | None, NotZero("the motor has no speed")] = None
    points: Annotated[tuple[tuple[AnyQuantity, ForceOrMoment], ...], Field(min_length=2), Rising("place")] | None = None
    over: Literal["speed", "time"] = "speed"
    target: Rate | None = None
    proportional: Annotated[Damping | None, NotNegative] = None
    integral: Annotated[Stiffness | None, NotNegative] = None
    limit: Annotated[ForceOrMoment | None, Positive] = None
    ratio: Annotated[Dimensionless | None, NotZero("the motor would not turn")] = None
    efficiency: Annotated[Dimensionless | None, Within(0, 1, "(]")] = None
    inertia: Annotated[MassOrInertia | None, NotNegative] = None
    off_from: Annotated[Time | None, NotNegative] = None
    brake: Annotated[ForceOrMoment | None, NotNegative, OnlyWith("brake_from")] = None
    brake_from: Annotated[Time | None, NotNegative, OnlyWith("brake")] = None
    clutch: Annotated[
        ForceOrMoment | None, Positive, OnlyWith("inertia", "the inertia of the rotor, on the side of the motor")
    ] = None
    clutch_from: Annotated[Time | None, NotNegative, OnlyWith("clutch")] = None
    clutch_until: Annotated[Time | None, NotNegative, OnlyWith("clutch")] = None

    @property
    def of(self) -> MotorKind:
        """The kind."""
        return MOTORS[self.kind]


class Initial(Part):
    """Where a free coordinate begins and how fast: from rest at the driver's start if not stated."""

    coordinate: AngleOrLength | None = None
    speed: Rate | None = None


_Columns = Annotated[tuple[str, str] | None, OnlyWith("file")]
_LAW = Selects(
    "motion law", MOTION_LAWS, also=("moves", "free", "motor", "initial", "columns"), instead={"file": "points"}
)


class Driver(Part):
    """Prescribed motion of the joint it is named after, by a law of `joints.motion`: `constant` if none is stated.

    With `free: true` or a motor, motion in time finds it; all other analyses prescribe it as stated.
    """

    law: Annotated[str, OneOf(MOTION_LAWS, "motion law"), _LAW] = "constant"
    moves: Annotated[str | None, Refers("joint"), OnlyWith("prescribed", "a motion that is prescribed")] = None
    speed: Annotated[Rate | None, NotZero("the driver does not move")] = None
    start: AngleOrLength | None = None
    range: tuple[AngleOrLength, AngleOrLength] | None = None
    mean: AngleOrLength | None = None
    amplitude: Annotated[AngleOrLength | None, NotZero("it never moves")] = None
    period: Annotated[Time | None, Positive] = None
    phase: Angle | None = None
    duration: Annotated[Time | None, Positive] = None
    return_duration: Annotated[Time | None, Positive, OnlyWith("returns")] = None
    dwell: Annotated[Time | None, NotNegative] = None
    returns: bool = True
    points: (
        Annotated[tuple[tuple[Time, AngleOrLength], ...], Field(min_length=2), Rising("time"), NotWith("file")] | None
    ) = None
    file: str | None = None
    columns: _Columns = None
    periodic: bool = False
    ends: Literal["clamped", "natural"] = "clamped"
    delay: Annotated[Time | None, NotNegative] = None
    free: bool = False
    motor: Motor | None = None
    initial: Annotated[Initial | None, OnlyWith("found", "free: true or a motor")] = None
    _found_law: MotionLaw | None = PrivateAttr(None)

    @property
    def found(self) -> bool:
        """Whether motion in time finds the coordinate."""
        return self.free or self.motor is not None

    @property
    def prescribed(self) -> bool:
        """Whether its law prescribes the motion in every analysis."""
        return not self.found

    @property
    def motion(self) -> MotionLaw:
        """The law."""
        return self._found_law or MOTION_LAWS[self.law]

    def moving(self, law: MotionLaw) -> Driver:
        """The driver as it was found to move, in place of the law that it states."""
        copy = self.model_copy()
        copy._found_law = law
        return copy

    @property
    def options(self) -> Mapping[str, bool | str]:
        """What the law is told beside numbers."""
        return {"returns": self.returns, "periodic": self.periodic, "ends": self.ends}

    def complete(self) -> Driver:
        """With zeros for what its law takes and was not stated."""
        coordinate = KINDS["angle"] | KINDS["length"]
        kinds = {"start": coordinate, "mean": coordinate, "phase": KINDS["angle"], "dwell": KINDS["time"],
                 "delay": KINDS["time"]}  # fmt: skip
        return self.filled({key: Quantity(0, kind) for key, kind in kinds.items() if key in self.motion.takes})


class Load(Part):
    """A load on a link (force at a point, moment), or one that resists the motion of a joint.

    Its numbers may be expressions of the motion: of `drive`, `speed`, `time`, the names of tables, turns and slides of
    joints (`S.slide`, `S.slide_velocity`) and coordinates of points (`ram.Q.x`, `ram.Q.velocity_x`).
    """

    one_of = ("link", "joint")
    some_of = ("force", "moment", "resisting_torque", "resisting_force")

    link: Annotated[str | None, Refers("link")] = None
    at: Annotated[str | None, NotWith("joint")] = None
    force: Annotated[
        Annotated[tuple[Force, ...], Field(min_length=2, max_length=3), InSpace()] | None,
        OnlyWith("at"),
        NotWith("joint"),
    ] = None
    moment: Annotated[
        Annotated[
            Annotated[Moment, Tag(":value")]
            | Annotated[tuple[Moment, ...], Field(min_length=3, max_length=3), Tag(":list")],
            forms("one moment (planar) or [x, y, z]"),
        ]
        | None,
        NotWith("joint"),
    ] = None
    frame: Annotated[Literal["global", "link"], NotWith("joint")] = "global"
    joint: Annotated[str | None, Refers("any joint")] = None
    resisting_torque: Annotated[Moment | None, NotNegative, NotWith("link", "resisting_force")] = None
    resisting_force: Annotated[Force | None, NotNegative, NotWith("link")] = None
    only: Annotated[Literal["positive", "negative"] | None, NotWith("link")] = None
    useful: bool = False


class Table(Part):
    """A quantity stated by points (coordinate of the first driver or time, value), for the expressions of loads.

    file: instead of the points; they take its place when a model file is read. columns: the headers of its two columns.
    """

    over: Literal["drive", "time"] = "drive"
    points: Annotated[
        tuple[tuple[AnyQuantity, AnyQuantity], ...], Field(min_length=2), Rising("at"), NotWith("file")
    ] = ()
    file: str | None = None
    columns: _Columns = None
    interpolation: Literal["linear", "spline"] = "linear"
    periodic: bool = False
    period: AnyQuantity | None = None

    @property
    def repeats(self) -> bool:
        """Whether it goes on beyond its points."""
        return self.periodic or self.period is not None


class Spring(Part):
    """A spring, a damper or both: along the line between two points of two links, or in the freedom of a joint.

    It pulls with preload + stiffness · (length − free length) + damping · rate; so does a torsional one, by angles.
    One that only pulls does so while it is longer than its free length, one that only pushes while it is shorter.
    """

    one_of = ("between", "joint")
    some_of = ("stiffness", "damping", "preload")

    between: Annotated[tuple[str, str] | None, Refers("point")] = None
    joint: Annotated[str | None, Refers("any joint")] = None
    stiffness: Annotated[Stiffness | None, NotNegative] = None
    free_length: Annotated[Length | None, NotNegative, OnlyWith("stiffness")] = None
    free_angle: Annotated[Angle | None, OnlyWith("stiffness")] = None
    damping: Annotated[Damping | None, NotNegative] = None
    preload: ForceOrMoment | None = None
    only: Annotated[Literal["pull", "push"] | None, OnlyWith("stiffness")] = None
    useful: bool = False


USUAL_PRESSURE_ANGLE = Quantity.read("20 deg", KINDS["angle"])


class Gear(Part):
    """A gear pair: the rotation of the second joint is ratio · rotation of the first + phase.

    With teeth the joints share a link, the carrier, and the tooth force acts at the pitch point, inclined by the
    pressure angle (20 deg if not stated); without, a train, belt or chain passes torques alone. Where one of the joints
    slides, its slide is radius · rotation + phase (a rack; without teeth a chain or rope) or lead · turns + phase (a
    screw).
    """

    one_of = ("ratio", "radius", "lead")

    joints: Annotated[tuple[str, str], Refers("any joint", distinct=True)]
    ratio: Annotated[Dimensionless | None, NotZero("the second joint would not turn at all")] = None
    radius: Annotated[Length | None, NotZero("the rack would not move at all")] = None
    lead: Annotated[Length | None, NotZero("the nut would not move at all")] = None
    phase: AngleOrLength = Quantity(0, KINDS["angle"])
    teeth: Annotated[bool, NotWith("lead")] = True  # a screw has no pitch point
    pressure_angle: Annotated[Angle | None, Within(0, math.pi / 2, "[)"), OnlyWith("teeth"), NotWith("lead")] = None

    def complete(self) -> Gear:
        """With the usual pressure angle if it has teeth and states none."""
        return self.filled({"pressure_angle": USUAL_PRESSURE_ANGLE} if self.teeth and self.lead is None else {})

    @property
    def slides(self) -> bool:
        """Whether one of its joints slides."""
        return self.radius is not None or self.lead is not None

    @property
    def touches(self) -> bool:
        """Whether it acts at a pitch point on a link that both joints share."""
        return self.radius is not None or (self.teeth and self.lead is None)


AT = "at"  # in an assembly, where the first driver is when points are where it says
FOLDS = "folds"  # at a change point a group stays on its side of it
_WAY = re.compile(rf"^(way-[1-9][0-9]{{0,3}}|{FOLDS})$")
_LIKE_A_WAY = re.compile(r"(?i)^(way[-_ ]\w*|folds?)$")  # meant as a name, whatever is wrong with it


def _hint_shape(value: object) -> str:
    return ":way" if isinstance(value, str) and _LIKE_A_WAY.match(value) else shape(value)


Hint = Annotated[
    Annotated[Position, Tag(":list")]
    | Annotated[AngleOrLength, Tag(":value")]
    | Annotated[str, Field(pattern=_WAY.pattern), Tag(":way")],
    Discriminator(
        _hint_shape,
        custom_error_type="forms",
        custom_error_message="takes coordinates of a point, rotation or slide of a joint, or way-1, way-2, …, folds of "
        "a link",
    ),
]
