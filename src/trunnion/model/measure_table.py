"""The measures of a model file: kinds of numbers to watch, and the entry that names one, at a place or over a range."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from math import inf
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, create_model, model_validator

from trunnion.model.entry import Direction, Part
from trunnion.model.expression import Expression, parse
from trunnion.model.quantity import AnyQuantity
from trunnion.model.rules import InSpace, NotWith, Positive
from trunnion.model.tolerance_parts import LimitText
from trunnion.model.units import KINDS, Kind, UnitError


@dataclass(frozen=True)
class MeasureKind:
    """One kind of measure.

    long_name: for tables; note: what else there is to say of it; quantity: what the course is, or both that it may be,
    where the joint, driver, load or spring turns and where it slides. of: what the key names (see `checks.measures`),
    or the words that it takes. needs: `places` of the links, their `motion` too, or `forces`; only then friction is
    solved; `simulation`: it is of the motion in time of a free driver and has no course over a cycle.
    rule: what makes the figure of the course if no statistic is stated, an entry of `measures.figures.RULES`;
    reduced: it is one number of a whole range already. against: whether the course is taken less that of the nominal
    mechanism, position by position. vector: whether `axis` or `along` picks one component: it `must` or `may`; in
    space alone: `must in space`, `may in space`. space: the only one, if it is not of both. up_to: how far it is looked
    for; what is not met up to there is ∞.
    """

    long_name: str
    quantity: Kind | tuple[Kind, Kind]
    of: str | tuple[str, ...]
    needs: Literal["places", "motion", "forces", "simulation"] = "places"
    rule: str = "deviation"
    against: bool = False
    reduced: bool = False
    vector: Literal["", "must", "may", "must in space", "may in space"] = ""
    space: str = ""
    up_to: float = inf
    note: str = ""

    @property
    def text(self) -> str:
        """Of its key in the file."""
        of = self.of if isinstance(self.of, str) else " or ".join(f"`{word}`" for word in self.of)
        return f"{of.removeprefix('any ')}: {self.long_name}{', ' * bool(self.note)}{self.note}"

    @property
    def quantities(self) -> tuple[Kind, ...]:
        """What the course may be."""
        return self.quantity if isinstance(self.quantity, tuple) else (self.quantity,)

    @property
    def of_forces(self) -> bool:
        """Whether it needs more than the motion."""
        return self.needs == "forces"

    @property
    def in_time(self) -> bool:
        """Whether it is of a motion in time."""
        return self.needs == "simulation"

    @property
    def at_rest(self) -> bool:
        """Whether it is zero in an idle machine: a force or a rate, no place and no ratio."""
        return self.needs != "places" and self.quantity is not NUMBER and self.quantity is not MOTION

    def vector_in(self, space: str) -> str:
        """Whether a component must or may be picked in a space; empty if there is none."""
        word, inside, _ = self.vector.partition(" in ")
        return word if not inside or space == "spatial" else ""


LENGTH, ANGLE, FORCE, NUMBER = (KINDS[name] for name in ("length", "angle", "force", "number"))
SPEED, SPIN, ACCELERATION = (KINDS[name] for name in ("speed", "angular speed", "acceleration"))
MOTION, RATE, EFFORT = (ANGLE, LENGTH), (SPIN, SPEED), (KINDS["moment"], FORCE)


def _of_results(name: str, si: str, *powers: int) -> Kind:
    """What no number of a model is, but a measure may be. powers: of length, mass, time and angle."""
    length, mass, time, angle = (Fraction(power) for power in powers)
    return Kind(name, si, f"10 {si}", ((length, mass, time, angle),))


SPIN_RATE = _of_results("angular acceleration", "rad/s^2", 0, 0, -2, 1)
POWER, ENERGY = _of_results("power", "W", 2, 1, -3, 0), _of_results("energy", "J", 2, 1, -2, 0)

COMPONENT = "its magnitude or, with `axis` or `along`, a component"

# in the order of the file's keys
MEASURES: dict[str, MeasureKind] = {
    "point": MeasureKind("coordinate of a point", LENGTH, "point", vector="must"),
    "path_error": MeasureKind(
        "distance of a point from its nominal place", LENGTH, "point", rule="maximum", against=True),
    "straightness": MeasureKind(
        "straightness of the path of a point", LENGTH, "point", rule="line", reduced=True,
        note="how far it is from a straight line"),
    "angle": MeasureKind(
        "angle of a link", ANGLE, "link", vector="must in space",
        note="in space its rotation about a global axis, relative to the ideal mechanism"),
    "rotation": MeasureKind("rotation of a joint", ANGLE, "joint", note="second link against first"),
    "slide": MeasureKind("slide of a joint", LENGTH, "joint"),
    "transmission_error": MeasureKind(
        "transmission error of a joint", MOTION, "joint", against=True, note="its motion less the nominal one"),
    "stroke": MeasureKind(
        "stroke of a joint", MOTION, "joint", rule="peak-to-peak", reduced=True, note="from end to end of its motion"),
    "dead_centre": MeasureKind(
        "dead centre of a joint", MOTION, "joint", rule="dead centre", reduced=True,
        note="the coordinate of the first driver at which its own is largest; with `as` place-of-minimum, smallest"),
    "time_ratio": MeasureKind(
        "time ratio of a joint", MOTION, "joint", rule="time ratio", reduced=True,
        note="of its ways forth and back the longer over the shorter, by the coordinate of the first driver"),
    "rate": MeasureKind(
        "speed of a joint", RATE, "joint", "motion", note="of its rotation, of a prismatic one its slide"),
    "joint_acceleration": MeasureKind(
        "acceleration of a joint", (SPIN_RATE, ACCELERATION), "joint", "motion",
        note="of its rotation, of a prismatic one its slide"),
    "velocity": MeasureKind("velocity of a point", SPEED, "point", "motion", vector="may", note=COMPONENT),
    "acceleration": MeasureKind(
        "acceleration of a point", ACCELERATION, "point", "motion", vector="may", note=COMPONENT),
    "angular_velocity": MeasureKind(
        "angular velocity of a link", SPIN, "link", "motion", vector="may in space", note=f"in space {COMPONENT}"),
    "angular_acceleration": MeasureKind(
        "angular acceleration of a link", SPIN_RATE, "link", "motion", vector="may in space",
        note=f"in space {COMPONENT}"),
    "transmission_angle": MeasureKind(
        "transmission angle at a joint", ANGLE, "any joint", space="planar",
        note="of a dyad, in the plane; from 0, where it locks, to 90 deg, where it drives best"),
    "pressure_angle": MeasureKind(
        "pressure angle at a joint", ANGLE, "any joint", space="planar",
        note="of a dyad, in the plane; from -90 to 90 deg, 0 being best"),
    "effort": MeasureKind("effort of a driver", EFFORT, "driver", "forces"),
    "load": MeasureKind(
        "torque or force of a load on a joint", EFFORT, "load on a joint", "forces",
        note="against the joint's positive sense"),
    "spring_force": MeasureKind(
        "force or torque of a spring", EFFORT, "spring", "motion", note="its pull, negative where it pushes"),
    "spring_elongation": MeasureKind(
        "elongation of a spring", MOTION, "spring", "motion", note="beyond its free length or angle"),
    "reaction": MeasureKind("reaction in a joint", FORCE, "any joint", "forces", vector="may", note=COMPONENT),
    "end_load": MeasureKind(
        "load on an end of a bearing", FORCE, "any joint", "forces",
        note="the larger of the two ends of a joint with a bearing or guide length; of a universal joint of both pins"),
    "power": MeasureKind(
        "power of a driver or load", POWER, "driver or load", "forces", note="positive into the mechanism"),
    "friction_power": MeasureKind("power lost to friction in a joint", POWER, "any joint", "forces"),
    "friction_energy": MeasureKind(
        "energy lost to friction in a joint", ENERGY, "any joint", "forces", rule="work", reduced=True,
        note="over the cycle or range"),
    "efficiency": MeasureKind(
        "efficiency", NUMBER, ("cycle", "instant"), "forces", rule="ratio",
        note="that of the whole `cycle`, or at each `instant`"),
    "locking_margin": MeasureKind(
        "locking margin", NUMBER, ("mechanism",), "forces", rule="minimum", up_to=10.0,
        note="of the `mechanism`: the multiple of its friction at which it locks"),
    "starting_time": MeasureKind(
        "starting time of a driver", KINDS["time"], "free driver", "simulation", rule="value", reduced=True,
        note="when the mean speed of a turn is 95 % of the steady one"),
    "steady_speed": MeasureKind(
        "steady speed of a driver", SPIN, "free driver", "simulation", rule="value", reduced=True,
        note="the mean of its last turn"),
    "fluctuation": MeasureKind(
        "coefficient of fluctuation of a driver", NUMBER, "free driver", "simulation", rule="value", reduced=True,
        note="(largest − smallest speed)/mean of its last turn"),
    "expression": MeasureKind(
        "expression of measures", NUMBER, "expression",
        note="of other measures of the model, of dimensions and of columns of a result, by their names, such as "
        "output - input, D.rotation - O.rotation or atan2(top.Q.y - low.P.y, AB)"),
    "peak_effort": MeasureKind(
        "largest effort of a driver in time", EFFORT, "free driver", "simulation", rule="value", reduced=True,
        note="its magnitude"),
}  # fmt: skip


Statistic = Literal[
    "value", "maximum", "minimum", "peak-to-peak", "mean", "rms", "largest", "place-of-maximum", "place-of-minimum",
    "dwell",
]  # fmt: skip
STATISTICS: tuple[str, ...] = Statistic.__args__  # type: ignore[attr-defined]


def _described(description: str, alias: str | None = None) -> Any:
    """A field that need not be stated."""
    return Field(default=None, alias=alias, description=description)


if TYPE_CHECKING:
    _Subject = Part
else:  # a key for each kind: a name, or one of its words
    of = {key: str if isinstance(kind.of, str) else Literal[kind.of] for key, kind in MEASURES.items()}
    keys = {key: (of[key] | None, _described(kind.text)) for key, kind in MEASURES.items()}
    _Subject = create_model("_Subject", __base__=Part, **keys)


class Measure(_Subject):
    """A number to watch, of one subject: a point, a link, a joint, a driver or the whole.

    A text alone is an expression. It is taken `at` a position, as a figure `over` a range, or, if neither is stated, at
    every position. `limit` is of its deviation from nominal, `at_least` and `at_most` are of the number itself.
    """

    one_of = tuple(MEASURES)

    axis: Literal["x", "y", "z"] | None = _described(
        "which coordinate of a point, or component of a velocity, an acceleration or a reaction; of an angle in "
        "space, the global axis that the link turns about"
    )
    along: Annotated[Direction | None, InSpace(), NotWith("axis")] = _described(
        "direction of the component, global axes, any length; instead of `axis`"
    )
    at: AnyQuantity | None = _described(
        "position: a coordinate of the first driver or a time; if neither this nor `as` is given, at every position"
    )
    statistic: Statistic | None = _described(
        "statistic over the range; `largest` is the largest magnitude, `dwell` the share of "
        "the time that it is `within` a band. If not given, that of the subject itself (stroke, dead_centre, ...), "
        "else the largest deviation from nominal",
        alias="as",
    )
    within: tuple[AnyQuantity, AnyQuantity] | None = _described(
        "the band of `as: dwell`, from its lower to its upper end"
    )
    over: Annotated[tuple[AnyQuantity, AnyQuantity] | None, NotWith("at")] = _described(
        "the range of it, two coordinates of the first driver or two times; the whole motion if not given"
    )
    duration: Annotated[AnyQuantity | None, Positive] = _described(
        "of a measure of a motion in time: how long it is followed from its start; ten cycles if not given"
    )
    limit: LimitText | None = _described(
        "allowed deviation from nominal, to either side or as +0.2/-0.1 deg: `tolerance` gives the yield, "
        "`play` the positions at which the worst case exceeds it"
    )
    at_least: AnyQuantity | None = _described("least that it may be itself")
    at_most: AnyQuantity | None = _described("most that it may be itself")

    @model_validator(mode="before")
    @classmethod
    def _read_text(cls, value: object) -> object:
        return {"expression": value} if isinstance(value, str) else value

    @property
    def formula(self) -> Expression | None:
        """Its expression; None of another kind, or of one that cannot be read, which is a finding."""
        with suppress(UnitError):
            return parse(self.subject) if self.kind == "expression" else None
        return None

    @property
    def kinds(self) -> list[str]:
        """Entries of MEASURES that are stated; one is to be."""
        return [key for key in MEASURES if getattr(self, key) is not None]

    @property
    def kind(self) -> str:
        """The entry of MEASURES that it is of, the first stated; empty if none is."""
        return next(iter(self.kinds), "")

    @property
    def subject(self) -> str:
        """What it is of: the name of a point, link, joint, driver or load, or a word such as `cycle`."""
        return str(getattr(self, self.kind)) if self.kind else ""

    @property
    def reduced(self) -> bool:
        """Whether its subject is one number of a whole curve."""
        return bool(self.kind) and (MEASURES[self.kind].reduced or self.subject == "cycle")
