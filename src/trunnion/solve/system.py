"""A mechanism made ready to run: its plan, its modules, what hangs where, and how it is driven."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra import plane, space
from trunnion.algebra.dual import primal
from trunnion.algebra.literal import is_zero
from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.vector import dot
from trunnion.errors import Finding, MechanismError
from trunnion.groups import GROUPS
from trunnion.groups.cylindrical_dyad import CylindricalDyad
from trunnion.groups.gear import GearPair
from trunnion.groups.general import General
from trunnion.groups.redundant import Support
from trunnion.groups.spatial import SpatialGroup
from trunnion.groups.tree import OUTER, GroupJoint
from trunnion.joints.friction import FRICTION_LAWS, FrictionLaw
from trunnion.joints.motion import Span
from trunnion.model.joint_parts import Joint, Losses
from trunnion.model.mechanism import Mechanism
from trunnion.results.quantities import readable
from trunnion.solve import shifts
from trunnion.structure.decompose import Module, Plan, decompose

STATE, FREED = "state.", ("coordinate", "rate", "second")  # paths of what a free driver does
COMMON_TURNS = 60  # of the slowest driver, within which the others must come back too
Values = Mapping[str, Number]  # every number of a mechanism by its path, SI


MOST_INTERVALS = 6  # named in one finding; the rest are counted
ROUNDING = 1e-7  # of the largest coordinate of a drive: what courses do not resolve

Positions = NDArray[np.intp]


class Dial(NamedTuple):
    """How positions are named to a person: the drive coordinate in degrees or mm, or time."""

    values: NDArray[np.float64]
    unit: str
    of: str

    def at(self, position: int) -> str:
        """One position; what is next to nothing of the largest coordinate is 0."""
        value, largest = float(self.values[position]), np.abs(self.values).max()
        return f"{0.0 if abs(value) < ROUNDING * largest else value:.4g}{self.unit}"

    def between(self, first: int, last: int) -> str:
        """A range: 'between 132° and 228°', 'at 132°' if its ends read alike."""
        low, high = self.at(first), self.at(last)
        return f"at {low}" if low == high else f"between {low} and {high}"

    def intervals(self, positions: Positions) -> str:
        """Positions as intervals: 'at 0° and 12°, between 132° and 228° of A'."""
        if len(positions) == len(self.values):
            return "at every position" if len(self.values) > 1 else "in its one position"
        runs = np.split(positions, np.flatnonzero(np.diff(positions) > 1) + 1)
        ranges, texts = [self.between(run[0], run[-1]) for run in runs[:MOST_INTERVALS]], list[str]()
        for single, group in itertools.groupby(ranges, lambda text: text.startswith("at ")):
            if single:
                *others, last = (text.removeprefix("at ") for text in group)
                texts.append(f"at {', '.join(others)} and {last}" if others else f"at {last}")
            else:
                texts += group
        more = f" and in {len(runs) - MOST_INTERVALS} more places" if len(runs) > MOST_INTERVALS else ""
        return ", ".join(texts) + more + (f" of {self.of}" if self.of else "")


@dataclass(frozen=True)
class Place:
    """A joint as its module sees it: kind, links and whether each is outside, in the module's order of sides.

    A witness is a joint between two known links, of which only the module's gear pairs speak.
    """

    joint: str
    kind: str
    links: tuple[str, str]
    outer: tuple[bool, bool]
    reversed_: bool

    @property
    def witness(self) -> bool:
        return all(self.outer)


@dataclass(frozen=True)
class Cycle:
    """One period or range of the drivers: how long it takes, s, whether its end is its start again, and the most
    turns that a driver makes in it, at its largest rate. advances: whether drivers come back and the links do not, as
    of a nut on its thread."""

    duration: float
    periodic: bool
    turns: float = 1.0
    advances: bool = False

    def times(self, steps: int) -> np.ndarray:
        """`steps` equally spaced times, s; the end is left out where it repeats the start."""
        return np.linspace(0.0, self.duration, steps, endpoint=not self.periodic)


@dataclass(frozen=True)
class System:
    """A mechanism, its plan and its modules. Numbers stay outside: every walk is given its `Values`.

    inverse: an `inverse.Inverse`, where a driver moves another joint by the law that it states.
    """

    mechanism: Mechanism
    plan: Plan
    inverse: Any = None

    @cached_property
    def spatial(self) -> bool:
        """Whether it is one in space."""
        return self.mechanism.space == "spatial"

    @property
    def algebra(self) -> Any:
        """Of its frames, twists and wrenches."""
        return space if self.spatial else plane

    @property
    def axes(self) -> str:
        """The global axes."""
        return "xyz" if self.spatial else "xy"

    @cached_property
    def codes(self) -> dict[Hashable, Any]:
        """Machine code of its walks, see `row_code`; None where there is none."""
        return {}

    @cached_property
    def groups(self) -> tuple[Any, ...]:
        """The module that computes each entry of the plan."""
        return tuple(self._group(*both) for both in zip(self.plan.modules, self.places, strict=True))

    @cached_property
    def places(self) -> tuple[tuple[Place, ...], ...]:
        """The joints of each module, then its witnesses; in space a module takes its joints as they are."""
        rows = []
        for module in self.plan.modules:
            turned = {} if self.spatial else dict(zip(module.joints, module.reversed_, strict=True))
            row = []
            for name in (*module.joints, *module.witnesses):
                (first, second), reversed_ = self.joints[name].links, turned.get(name, False)
                links = (second, first) if reversed_ else (first, second)
                outer = (links[0] not in module.links, links[1] not in module.links)
                row.append(Place(name, self.joints[name].type, links, outer, reversed_))
            rows.append(tuple(row))
        return tuple(rows)

    @property
    def joints(self) -> Mapping[str, Joint]:
        """Every joint, with the defaults merged in."""
        return self.mechanism.effective_joints

    @cached_property
    def order(self) -> dict[str, int]:
        """Where the joints stand in the file."""
        return {name: place for place, name in enumerate(self.joints)}

    def resting(self, joint: str) -> int:
        """How many contacts of a joint rest or slip each by itself: a cross has two pins, a sleeve turns and slides."""
        pair = self.joints[joint].pair
        return 2 if pair.crossed or (len(pair.freedoms) == 2 and self.summed(joint)) else 1

    def summed(self, joint: str) -> bool:
        """Whether the parts of a joint's load or slip count one by one, not as a vector.  [P 15-19]"""
        friction = self.joints[joint].friction
        return friction is not None and friction.model == "pezzuti"

    def turns(self, joint: str) -> bool:
        """Whether a joint's coordinate, as drivers and loads see it, is an angle."""
        return self.joints[joint].pair.turns

    @cached_property
    def points(self) -> tuple[tuple[str, str], ...]:
        """(link, point) of every named point; the joints of a loop are points of its links."""
        points = [(name, point) for name, link in self.mechanism.effective_links.items() for point in link.points]
        if self.mechanism.loop:
            points += [(link, name) for name, joint in self.joints.items() for link in joint.links]
        return tuple(dict.fromkeys(points))

    def _group(self, module: Module, places: Sequence[Place]) -> Any:
        if module.kind in GROUPS:
            return GROUPS[module.kind]
        number, names = {link: i for i, link in enumerate(module.links)}, [place.joint for place in places]
        ends = ([number.get(link, OUTER) for link in place.links] for place in places)
        joints = tuple(GroupJoint(place.kind, (a, b)) for place, (a, b) in zip(places, ends, strict=True))
        driven = tuple(names.index(name) for name in module.driven)
        if not self.spatial:
            gears = []
            for name in module.gears:
                touching, turned_round = self.mechanism.gears[name].touches, name in self.turned_round
                carriers = self.mechanism.carriers(name) if touching else None
                if carriers and turned_round:
                    carriers = carriers[1], carriers[0]
                slide = 1 - turned_round if self.mechanism.gears[name].slides else None
                first, second = (names.index(joint) for joint in self.gear_joints(name))
                gears.append(GearPair(first, second, carriers, slide))
            return General(len(module.links), joints, driven, tuple(gears), redundant=module.redundant)
        if module.kind == "CCC":
            elements = self.elements(self.mechanism.parameters())
            sides = (
                [elements[link, name].z for name in names if link in self.joints[name].links] for link in module.links
            )
            if all(abs(float(dot(first, second))) <= 1 - 1e-12 for first, second in sides):  # else no closed form
                return CylindricalDyad(2, joints)
        spins = tuple((number[link], names.index(a), names.index(b)) for link, a, b in module.spinning)
        return SpatialGroup(len(module.links), joints, driven, spins, redundant=module.redundant)

    @cached_property
    def turned_round(self) -> frozenset[str]:
        """Gear pairs whose second joint is the one whose turns are known: driven, or geared to such a joint, or a slide
        that an earlier module determines.

        φ₁ = (φ₂ − φ₀)/i then says what φ₂ = i φ₁ + φ₀ leaves open by whole turns of φ₂.
        """
        turned, reversed_ = set(self.mechanism.drivers), set()
        for module in self.plan.modules:
            turned |= {joint for joint in module.witnesses if not self.turns(joint)}
        for _ in self.mechanism.gears:
            for name in self.mechanism.gears:
                first, second = self.mechanism.coupled(name)
                if second in turned and first not in turned:
                    reversed_.add(name)
                if first in turned or second in turned:
                    turned |= {first, second}
        return frozenset(reversed_)

    def gear_joints(self, name: str) -> tuple[str, str]:
        """Joints of a gear pair, that whose turns are known first."""
        first, second = self.mechanism.coupled(name)
        return (second, first) if name in self.turned_round else (first, second)

    def ratio(self, values: Values, name: str) -> Number:
        """Ratio of a gear pair; of a rack or screw the slide for one radian, m."""
        gear, where = self.mechanism.gears[name], f"gears.{name}"
        if gear.lead is not None:
            return values[f"{where}.lead"] / (2 * np.pi)
        return values[f"{where}.{'ratio' if gear.radius is None else 'radius'}"]

    @cached_property
    def screws(self) -> dict[str, list[str]]:
        """Gear pairs that are screws, by the joint that turns: its friction is that of their threads."""
        screws: dict[str, list[str]] = {}
        for name, gear in self.mechanism.gears.items():
            if gear.lead is not None:
                screws.setdefault(self.mechanism.coupled(name)[0], []).append(name)
        return screws

    def rubbing_joint(self, number: int, place: int) -> str:
        """The joint whose friction acts at a place of a module: of its joints, then of its gear pairs."""
        places = self.places[number]
        if place < len(places):
            return places[place].joint
        return self.mechanism.coupled(self.plan.modules[number].gears[place - len(places)])[0]

    def elements(self, values: Values) -> dict[tuple[str, str], Any]:
        """Local frame of every joint's element, by (link, joint): errors of joints are in the second ones.

        Seats are in the elements of the links that carry them.
        """
        elements = self.holes(values)
        for name, joint in self.joints.items():
            for link, carrier in zip(joint.links, (shifts.PIN, shifts.HOLE), strict=True):
                element = elements[link, name]
                elements[link, name] = shifts.seated(self.mechanism.space, element, joint.type, values, name, carrier)
        return elements

    def holes(self, values: Values) -> dict[tuple[str, str], Any]:
        """The same where every pin lies in the middle of its hole."""
        elements = self.stated_elements(values)
        for name, joint in self.joints.items():
            end = joint.links[1], name
            elements[end] = shifts.misaligned(self.mechanism.space, elements[end], values, name)
        return elements

    def stated_elements(self, values: Values) -> dict[tuple[str, str], Any]:
        """The same without errors of joints; c, s in the plane and z in space is the direction of the joint."""
        if self.mechanism.loop:
            return self._loop_elements(values)
        elements: dict[tuple[str, str], Any] = {}
        for name, joint in self.joints.items():
            for link in joint.links:
                path, point = f"links.{link}.points.{name}", self.mechanism.links[link].points[name]
                place: Any = self.vector(values, path)
                if self.spatial:
                    axis: Any = self.vector(values, f"{path}.axis") if point.axis is not None else (0.0, 0.0, 1.0)
                    x: Any = self.vector(values, f"{path}.x") if point.x is not None else None
                    elements[link, name] = space.element(place, axis, x)
                elif "planar" in joint.pair.needs_axis:
                    ax, ay = self.vector(values, f"{path}.axis")
                    length = namespace(ax, ay).hypot(ax, ay)
                    elements[link, name] = plane.Frame(place[0], place[1], ax / length, ay / length)
                else:
                    elements[link, name] = plane.Frame(place[0], place[1])
        return elements

    def _loop_elements(self, values: Values) -> dict[tuple[str, str], space.Frame]:
        """Elements from the dual Denavit–Hartenberg table: joint k is Z(θ̂), the link after it X(α̂) to joint k + 1."""
        rows = self.mechanism.loop
        elements: dict[tuple[str, str], space.Frame] = {}
        for row, after in zip(rows, (*rows[1:], rows[0]), strict=True):
            path = f"loop.{row.joint}"
            twist, distance = values[f"{path}.twist"], values[f"{path}.distance"]
            c, s = namespace(twist).cos(twist), namespace(twist).sin(twist)
            first = space.ORIGIN
            following = space.Frame((1.0, 0.0, 0.0), (0.0, c, s), (0.0, -s, c), (distance, 0.0, 0.0))
            link_entry = self.mechanism.links.get(row.link)
            home = link_entry.frame if link_entry and link_entry.frame else None
            if home is None and row.link == self.mechanism.fixed_link:
                home = after.joint
            if home == after.joint and home != row.joint:
                first, following = space.relative(space.ORIGIN, following), space.ORIGIN
            path = f"loop.{after.joint}"  # the first element of a joint is moved by its constant slide or rotation
            if f"{path}.slide" in values:
                following = space.slid(following, values[f"{path}.slide"])
            if f"{path}.rotation" in values:
                following = space.turned(following, values[f"{path}.rotation"])
            elements[row.link, row.joint], elements[row.link, after.joint] = first, following
        return elements

    def lead(self, values: Values, joint: str) -> Number:
        """Slide for one radian of a helical pair, m; 0 of others.

        The joints of a screw in the plane are two, and neither is helical.
        """
        return values[f"joints.{joint}.pitch"] / (2 * np.pi) if self.joints[joint].pair.threaded else 0.0

    def support(self, values: Values, joint: str) -> Support:
        """How a joint holds its second link, where statics leaves its reaction open."""
        path, moments = f"joints.{joint}", self.spatial or not self.turns(joint)
        radial = values.get(f"{path}.stiffness.radial", 1.0)
        length = values.get(f"{path}.pin.bearing", values.get(f"{path}.guide.length")) if moments else None
        return Support(
            radial,
            values.get(f"{path}.stiffness.axial", radial),
            values.get(f"{path}.stiffness.tilting"),
            None if length is None or is_zero(length) else 0.5 * length,
            values.get(f"{path}.pin.offset", 0.0),
        )

    def vector(self, values: Values, path: str) -> tuple[Number, ...]:
        """The components with a path."""
        return tuple(values[f"{path}.{axis}"] for axis in self.axes)

    @cached_property
    def lossy(self) -> dict[str, Losses]:
        """Joints with losses that do not follow their load."""
        return {name: joint.losses for name, joint in self.joints.items() if joint.losses is not None}

    @cached_property
    def resisted(self) -> dict[str, set[bool]]:
        """Of every joint that loads or a constant loss resist, whether its turn (True) or its slide is."""
        resisted: dict[str, set[bool]] = {}
        for name, joint in self.lossy.items():
            if joint.constant is not None:
                resisted.setdefault(name, set()).add(self.turns(name))
        for load in self.mechanism.loads.values():
            if load.joint is not None:
                resisted.setdefault(load.joint, set()).add(load.resisting_torque is not None)
        return resisted

    def centre(self, values: Values, link: str) -> tuple[Number, ...]:
        """Local place of a link's mass centre, m."""
        path = f"links.{link}.centre"
        if f"{path}.distance" in values:
            distance, angle = values[f"{path}.distance"], values[f"{path}.angle"]
            xp = namespace(distance, angle)
            return distance * xp.cos(angle), distance * xp.sin(angle)
        return self.vector(values, path)

    def drive(self, values: Values, name: str, time: Number) -> tuple[Number, Number, Number]:
        """Coordinate, rate and second derivative of a driver at `time` (s) from the start, by its motion law.

        Of a free one what the values say, see `freed`.
        """
        if self.is_free(values, name):
            return tuple(values[f"{STATE}{name}.{key}"] for key in FREED)
        if self.mechanism.drivers[name].moves:
            moved: tuple[Number, Number, Number] = self.inverse.drive(values, name, time)
            return moved
        law = self.mechanism.drivers[name].motion
        return law.function(time, self.motion_of(values, name))

    def is_free(self, values: Values, name: str) -> bool:
        """Whether the values say what a driver does, in place of its motion law."""
        return f"{STATE}{name}.coordinate" in values

    def span(self, values: Values, name: str) -> Span:
        """One cycle of a driver."""
        span = self.mechanism.drivers[name].motion.span(self.motion_of(values, name))
        return self.inverse.span(name, span) if self.inverse and name in self.inverse.moves else span

    def knots(self, values: Values, name: str) -> list[Number]:
        """Times, s, within one cycle of a driver at which a derivative of its coordinate jumps."""
        return self.mechanism.drivers[name].motion.knots(self.motion_of(values, name))

    def motion_of(self, values: Values, name: str) -> dict[str, Number]:
        """What the motion law of a driver is given."""
        numbers: dict[str, Number] = {key: values[path] for key, path in self._driver_paths[name] if path in values}
        numbers.update(self.mechanism.drivers[name].options)
        return numbers

    @cached_property
    def _driver_paths(self) -> dict[str, list[tuple[str, str]]]:
        """(key, path) of the numbers of each driver."""
        paths = list(self.mechanism.parameter_set.entries)
        starts = {name: f"drivers.{name}." for name in self.mechanism.drivers}
        return {
            name: [(path.removeprefix(start), path) for path in paths if path.startswith(start)]
            for name, start in starts.items()
        }

    def dial(self, values: Values, time: NDArray[np.float64]) -> Dial:
        """Positions by the coordinate of the only driver if it runs one way, else by time (s)."""
        drivers = list(self.mechanism.drivers)
        if len(drivers) != 1 or not self.span(values, drivers[0]).one_way:
            return Dial(time, " s", "")
        q = np.broadcast_to(self.drive(values, drivers[0], time)[0], time.shape)
        revolute = self.turns(drivers[0])
        return Dial(np.degrees(q) if revolute else q * 1e3, "°" if revolute else " mm", drivers[0])

    def pace(self, values: Values) -> Number:
        """Angular speed typical of the mechanism, rad/s: the peak of its fastest driver, a slide's per size."""
        peaks = ((self.span(values, name).peak, self.turns(name)) for name in self.mechanism.drivers)
        return functools.reduce(np.maximum, (peak if turns else peak / self.size(values) for peak, turns in peaks), 0.0)

    def size(self, values: Values, elements: Mapping[tuple[str, str], Any] | None = None) -> Number:
        """Length typical of the mechanism, m: the widest spread of two joints on one link.

        Where all meet in one point it is that of any two points, in space the largest length of a pin; else 1 m.
        elements: of joints in space, if known.
        """
        if self.spatial:
            elements = self.elements(values) if elements is None else elements
            links = self.mechanism.effective_links
            joints = [[frame.place for (link, _), frame in elements.items() if link == name] for name in links]
            pins = [primal(value) for path, value in values.items() if path.endswith((".pin.bearing", ".pin.radius"))]
            smallest = functools.reduce(np.maximum, pins, 0.0)
        else:
            points = [[(name, self.vector(values, f"links.{link}.points.{name}")) for name in link_entry.points]
                      for link, link_entry in self.mechanism.links.items()]  # fmt: skip
            joints = [[place for name, place in places if name in self.joints] for places in points]
            smallest = _widest([[place for _, place in places] for places in points])
        widest = _widest(joints)
        return np.where(widest > 0, widest, np.where(smallest > 0, smallest, 1.0))

    def cycle(self, values: Values, turns: Mapping[str, float] | None = None, free: bool = False) -> Cycle:
        """How long the drivers take: the longest that ends, or the least time in which all make whole periods.

        So do joints behind gear pairs. turns: whole turns, in one period of the drivers, of joints that a gear pair
        starts from and that are neither driven nor geared; none if not given. free: what free drivers take counts only
        where all are free, for their motion is to be found.
        Where it is over COMMON_TURNS periods of the slowest, the cycle is its one period and not periodic.
        Raises MechanismError where a range runs against its speed or two drivers do not fit one cycle.
        """
        drivers = self.mechanism.drivers
        if not drivers:
            return Cycle(0.0, periodic=False)
        nominal = {path: float(np.ravel(primal(value))[0]) for path, value in values.items() if "drivers." in path}
        spans = {name: self.span(nominal, name) for name in drivers}
        free_drivers = {name for name, driver in drivers.items() if free and driver.found}
        counted = spans.keys() - free_drivers or spans.keys()  # of free ones only where all are free
        longest = float(max(spans[name].duration for name in counted))
        findings = []
        for name, span in spans.items():  # those whose range runs against their speed
            if span.duration < 0:
                speed = nominal[f"drivers.{name}.speed"]
                size = readable(speed, "rad/s" if self.turns(name) else "m/s")
                what = f"the range runs {'down' if speed > 0 else 'up'}, the speed is {size}"
                remedy = "swap the ends of the range, or the sign"
                findings.append(Finding(what, f"drivers.{name}.range", remedy))
        ending = [name for name, span in spans.items() if not span.periodic]
        for name in ending if not findings else ():
            span = spans[name]
            if name not in free_drivers and not span.rests and abs(span.duration - longest) > 1e-9 * longest:
                what = f"its range lasts {span.duration:g} s, the whole cycle lasts {longest:g} s"
                findings.append(Finding(what, f"drivers.{name}", "use the same duration for all drivers with a range"))
                break
        if findings:
            raise MechanismError(findings)
        periods = [longest / span.duration for span in spans.values()]
        if self.mechanism.gears:
            periods += self.geared_turns(values, longest, turns).values()
        fits = (np.array(periods) * n for n in range(1, COMMON_TURNS + 1))
        whole = (np.abs(laps - np.round(laps)) < 1e-9 * np.maximum(1.0, laps) for laps in fits)
        count = next((n for n, good in enumerate(whole, 1) if np.all(good)), 0)
        periodic = bool(count and not ending)
        duration = count * longest if periodic else longest
        # turns that a driver would make at its largest rate; of a slide, how often it would travel or turn its wheel
        ways = {name: 2 * np.pi if self.turns(name) else span.travel for name, span in spans.items()}
        for name, gear in self.mechanism.gears.items():
            if gear.slides and (slide := self.mechanism.coupled(name)[1]) in ways:
                around = 2 * np.pi * abs(float(np.ravel(primal(self.ratio(values, name)))[0]))
                ways[slide] = min(ways[slide], around)
        turns_made = max(float(spans[name].peak * duration / travel) for name, travel in ways.items())
        return Cycle(duration, periodic, turns_made)

    def geared_turns(
        self, values: Values, duration: float, others: Mapping[str, float] | None = None
    ) -> dict[str, float]:
        """Turns that driven joints and those geared to them make in a time; others: of more joints, to start from."""
        turns = dict(others or {})
        for name in self.mechanism.drivers:
            if self.turns(name):
                ends = [float(np.ravel(primal(self.drive(values, name, time)[0]))[0]) for time in (0.0, duration)]
                turns.setdefault(name, (ends[1] - ends[0]) / (2 * np.pi))
        for _ in self.mechanism.gears:  # each round reaches one gear pair farther, whichever way it is stated
            for name, gear in self.mechanism.gears.items():
                if gear.slides:
                    continue
                first, second = gear.joints
                ratio = float(np.ravel(primal(self.ratio(values, name)))[0])
                if first in turns:
                    turns.setdefault(second, ratio * turns[first])
                elif second in turns:
                    turns[first] = turns[second] / ratio
        return turns


def _widest(links: Sequence[Sequence[Sequence[Number]]]) -> Number:
    """The largest distance of the points of a link from its first one, m."""
    widest: Number = 0.0
    for places in links:
        for place in places[1:]:
            apart = [primal(a) - primal(b) for a, b in zip(place, places[0], strict=True)]
            widest = np.maximum(widest, functools.reduce(np.hypot, apart))
    return widest


def build(mechanism: Mechanism, inverse: Any = None) -> System:
    """Decompose a mechanism and prepare its modules. Raises MechanismError if its structure does not determine it."""
    findings = []
    for name, joint in mechanism.effective_joints.items() if mechanism.space == "spatial" else ():
        law = joint.friction.law if joint.friction else None
        if law and FRICTION_LAWS[law].relaxation is not None and joint.pair.count > 1:
            # a deflection is followed along one way only
            what = f"the bristles of the law {law} bend in one direction, the slip of a {joint.type} joint has several"
            remedy = "use coulomb, viscous, stribeck or brown-mcphee here"
            findings.append(Finding(what, f"joints.{name}.friction", remedy))
    if findings:
        raise MechanismError(findings)
    return System(mechanism, decompose(mechanism), inverse)


def freed(values: Values, motions: Mapping[str, tuple[Number, Number, Number]]) -> dict[str, Number]:
    """The values with coordinates, rates and second derivatives of free drivers, which go before their motion laws."""
    numbers = dict(values)
    for name, motion in motions.items():
        numbers.update(zip((f"{STATE}{name}.{key}" for key in FREED), motion, strict=True))
    return numbers


def driven_coordinates(
    system: System, module: Module, places: Sequence[Place], values: Values, time: Number
) -> tuple[list[Number], list[Number], list[Number]]:
    """Coordinates, rates and second derivatives of a module's driven joints, in the module's sense.

    Then come three numbers for each of its gear pairs: ratio, phase and coordinate of the first joint. Its rotation is
    known with its whole turns if it is driven and otherwise taken as the nearest to 0.
    """
    q: list[Number] = []
    rate: list[Number] = []
    second: list[Number] = []
    for name in module.driven:
        place = next(place for place in places if place.joint == name)
        sign = -1.0 if place.reversed_ else 1.0
        for target, value in zip((q, rate, second), system.drive(values, name, time), strict=True):
            target.append(sign * value)
    for name in module.gears:
        first = system.gear_joints(name)[0]
        turned = system.drive(values, first, time)[0] if first in system.mechanism.drivers else 0.0
        ratio, phase = system.ratio(values, name), values[f"gears.{name}.phase"]
        if name in system.turned_round:  # φ₁ = (φ₂ − φ₀)/i
            ratio, phase = 1 / ratio, -phase / ratio
        q += [ratio, phase, turned]
        rate += [ratio, 0.0, 0.0]
        second += [ratio, 0.0, 0.0]
    return q, rate, second


def rubbing(system: System) -> list[str]:
    """Joints that have friction."""
    return [name for name, joint in system.joints.items() if joint.friction is not None]


def felt(system: System, values: Values) -> list[str]:
    """Joints with friction whose coefficient is not 0, as far as their law is proportional to one."""
    joints = []
    for joint in rubbing(system):
        path = f"joints.{joint}.friction.{scale_of(system, values, joint)}"
        if path not in values or np.any(np.asarray(primal(values[path])) != 0):
            joints.append(joint)
    return joints


def law_parameters(law: FrictionLaw, values: Values, joint: str) -> dict[str, Number]:
    """The stated parameters of the friction law of a joint."""
    paths = {key: f"joints.{joint}.friction.{key}" for key in law.parameters}
    return {key: values[path] for key, path in paths.items() if path in values}


def scale_of(system: System, values: Values, joint: str) -> str:
    """The parameter that the friction of a joint is proportional to; "" of none, or where directions differ."""
    return "" if f"joints.{joint}.friction.backward" in values else law_of(system, joint).scale


def law_of(system: System, joint: str) -> FrictionLaw:
    """Friction law of a joint that has friction."""
    friction = system.joints[joint].friction
    return FRICTION_LAWS[friction.law if friction and friction.law else "coulomb"]


def sticking(system: System) -> list[str]:
    """Joints whose friction, or a load that resists them, is an interval where their relative speed is zero."""
    rubbed = {name for name in rubbing(system) if law_of(system, name).interval_at_rest}
    return [name for name in system.joints if name in system.resisted or name in rubbed]
